/*
  Active contraction of fibres, on any law: a tension T along the direction f of the fibres at rest,
  in addition to the stress of the law,

    S = T g(l) h(v) f f^T,   l = |F f|,   v = (dl/dt) / v_max,

  of second Piola-Kirchhoff (Nash and Hunter 2000; Land et al. 2015, problem 3): the force of the
  fibres over their area at rest is T g h l, the Cauchy stress T g h l^2/J along F f. T is a formula
  of time and place, g the relation of force and length,

    none       g = 1
    parabola   g = max(0, 1 - z^2),   z = (l - l_0)/w
    gaussian   g = exp(-z^2)          (Thelen 2003)

  h that of force and velocity (Hill 1938) with the curvature k, and in lengthening a hyperbola of
  the same slope at v = 0 up to N:

    v <= -1       h = 0
    -1 < v <= 0   h = (1 + v)/(1 - v/k)
    0 < v         h = 1 + (N - 1) v/(v + c),   c = (N - 1)/(1 + 1/k)

  In a step h is a function of l: v = v_0 + s (l - l_start). So the stress has an energy T phi(l),
  phi the integral of l g h, and its tangent is symmetric: with u = F f and G = g h

    P = T G u f^T,   dP = T (G du + c (u . du) u/l^2) f^T,   c = l dG/dl.

  With a velocity g is that of the stretch which the step is expected to reach, l_start + d dl/dt,
  constant in the step and of second order; phi follows from the integrals of h and v h.

  src/fem/active.c has the tension of the cells and the rates of their fibres.
*/
#include "fibrous.h"

#define NOTHING 1e-3 /* Pa: a negative tension this small is rounding of its formula */

PetscErrorCode SbActiveDestroy(SbActive *active)
{
  PetscFunctionBeginUser;
  if (!*active)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbFormulaDestroy(&(*active)->tension));
  PetscCall(PetscFree(*active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbActiveRead(SbMaterial m, const SbScope *scope)
{
  PetscReal value = 1;
  SbActive a;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&a));
  m->active = a;
  SbOptionName(scope, "active_tension", sizeof(a->option), a->option);
  PetscCall(SbOptionFormulas(scope, "active_tension", &a->tension));
  a->steady = (PetscBool)!SbFormulaUses(a->tension, 't');
  if (a->steady && !SbFormulaUses(a->tension, 'x'))
    PetscCall(SbFormulaEval(a->tension, 0, NULL, &value));
  if (value == 0) {
    PetscCall(SbActiveDestroy(&m->active));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbOptionChoice(scope, "active_length", &a->length));
  PetscCall(SbOptionReal(scope, "active_optimum", &a->optimum));
  PetscCall(SbOptionReal(scope, "active_width", &a->width));
  PetscCall(SbOptionReal(scope, "active_velocity", &a->velocity));
  PetscCall(SbOptionReal(scope, "active_curvature", &a->curvature));
  PetscCall(SbOptionReal(scope, "active_eccentric", &a->eccentric));
  PetscCheck(!m->linear || (!a->length && a->velocity == 0), PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_%s: with the law linear a tension does not depend on the stretch; take the "
             "law corotated, or leave it out",
             scope->klass, scope->instance, a->length ? "active_length" : "active_velocity");
  PetscCall(SbFibresRequire(m, scope, a->option));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbActiveTension(const struct _p_SbActive *a, PetscReal t, const PetscReal x[3],
                               PetscReal *tension)
{
  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(a->tension, t, x, tension));
  PetscCheck(*tension >= -NOTHING, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s is %g Pa at t = %g, (%.4g, %.4g, %.4g) m: fibres pull, so that a tension is at "
             "least 0",
             a->option, (double)*tension, (double)t, (double)x[0], (double)x[1], (double)x[2]);
  *tension = PetscMax(*tension, 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The integral of (l_0 + w z) g(z) w dz from 0. */
SB_INLINE PetscReal of_length(const struct _p_SbActive *a, PetscReal z)
{
  const PetscReal o = a->optimum;
  const PetscReal w = a->width;

  if (a->length == SB_LENGTH_GAUSSIAN)
    return w * (o * PetscSqrtReal(PETSC_PI) / 2 * erf(z) - w / 2 * expm1(-z * z));
  z = PetscMax(-1, PetscMin(z, 1));
  return w * (o * (z - z * z * z / 3) + w * z * z * (0.5 - z * z / 4));
}

/* g at z, and its derivative by z. */
SB_INLINE PetscReal length_factor(const struct _p_SbActive *a, PetscReal z, PetscReal *slope)
{
  PetscReal g = 1;

  *slope = 0;
  if (a->length == SB_LENGTH_GAUSSIAN) {
    g = PetscExpReal(-z * z);
    *slope = -2 * z * g;
  } else if (a->length == SB_LENGTH_PARABOLA) {
    g = PetscMax(0, 1 - z * z);
    *slope = g > 0 ? -2 * z : 0;
  }
  return g;
}

/* h at v, its derivative, and the integrals of h and v h from 0. */
typedef struct {
  PetscReal h, slope, first, second;
} VelocityFactor;

SB_INLINE VelocityFactor velocity_factor(const struct _p_SbActive *a, PetscReal v)
{
  const PetscReal k = a->curvature;
  const PetscReal more = a->eccentric - 1;
  const PetscReal c = more / (1 + 1 / k);
  VelocityFactor x;

  if (v > 0) {
    const PetscReal log = more > 0 ? c * log1p(v / c) : 0;
    const PetscReal part = more > 0 ? v / (v + c) : 0;

    x.h = 1 + more * part;
    x.slope = more > 0 ? more * c / PetscSqr(v + c) : 0;
    x.first = (1 + more) * v - more * log;
    x.second = (1 + more) * v * v / 2 - more * c * (v - log);
    return x;
  }
  const PetscReal u = PetscMax(v, -1);
  const PetscReal log = k * (1 + k) * log1p(-u / k);
  x.h = (1 + u) / (1 - u / k);
  x.slope = v > -1 ? k * (1 + k) / PetscSqr(k - u) : 0;
  x.first = -log - k * u;
  x.second = k * (-log - (1 + k) * u - u * u / 2);
  return x;
}

void SbActiveFactors(const struct _p_SbActive *a, const SbPack E, const SbFibreRate *rate,
                     SbPack phi, SbPack G, SbPack c)
{
  const PetscReal rest = a->length ? of_length(a, (1 - a->optimum) / a->width) : 0;

  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal stretch = PetscSqrtReal(PetscMax(1 + 2 * E[l], 0));
    PetscReal slope, z;

    phi[l] = E[l];
    G[l] = 1;
    c[l] = 0;
    if (!rate && !a->length)
      continue;
    z = ((rate ? rate->expected[l] : stretch) - a->optimum) / a->width;
    G[l] = length_factor(a, z, &slope);
    if (!rate) {
      phi[l] = of_length(a, z) - rest;
      c[l] = stretch * slope / a->width;
      continue;
    }
    const PetscReal g = G[l];
    const PetscReal s = rate->slope;
    const PetscReal v = rate->v[l] + s * (stretch - rate->start[l]);
    const VelocityFactor now = velocity_factor(a, v);
    G[l] *= now.h;
    c[l] = g * stretch * now.slope * s;
    phi[l] *= G[l];
    if (s > 0) {
      const VelocityFactor before = velocity_factor(a, rate->v[l]);

      phi[l] = g / s *
               ((rate->start[l] - rate->v[l] / s) * (now.first - before.first) +
                (now.second - before.second) / s);
    }
  }
}
