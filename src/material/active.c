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

  Active strain: fibres are without stress at the stretch 1 + g, and all else at constant volume
  (Taber and Perucchio 2000; Ambrosi and Pezzuto 2012), F = F_e F_a,

    F_a = (1 + g) f f^T + (1 + g)^(-1/2) (1 - f f^T),   psi(F F_a^-1),

  of laws whose dilatation is a function of det F, which F_a leaves as it is. With A = F_a^-1, which
  is symmetric, P = P_e A and dP = (C_e : dF A) A.

  src/fem/active.c has the tension and the strain of the cells and the rates of their fibres.
*/
#include "fibrous.h"

#define NOTHING 1e-3 /* Pa: a negative tension this small is rounding of its formula */

PetscErrorCode SbActiveDestroy(SbActive *active)
{
  PetscFunctionBeginUser;
  if (!*active)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbFormulaDestroy(&(*active)->tension));
  PetscCall(SbFormulaDestroy(&(*active)->strain));
  PetscCall(PetscFree(*active));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether any of the options is given that say where fibres are. */
static PetscErrorCode has_directions(const SbScope *scope, PetscBool *has)
{
  static const char *const keys[] = {"fibre", "fibre_field", "fibre_surfaces"};

  PetscFunctionBeginUser;
  *has = PETSC_FALSE;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(keys) && !*has; k++)
    PetscCall(SbOptionGiven(scope, keys[k], has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a formula; steady: not of t; any: not 0. */
static PetscErrorCode read_formula(const SbScope *scope, const char *key, size_t size,
                                   char option[], SbFormula *formula, PetscBool *steady,
                                   PetscBool *any)
{
  PetscReal value = 1;

  PetscFunctionBeginUser;
  SbOptionName(scope, key, size, option);
  PetscCall(SbOptionFormulas(scope, key, formula));
  *steady = (PetscBool)!SbFormulaUses(*formula, 't');
  if (*steady && !SbFormulaUses(*formula, 'x'))
    PetscCall(SbFormulaEval(*formula, 0, NULL, &value));
  *any = (PetscBool)(value != 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Laws and other options that an active strain does not go with. */
static PetscErrorCode check_strain(const SbMaterial m, const SbScope *scope)
{
  PetscReal viscosity[2];
  char times[64];

  PetscFunctionBeginUser;
  PetscCheck(m->type->positive || m->type->jacobian, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: the law %s measures changes of volume by another number than det F; take "
             "neohookean, or another law for large strains",
             m->active->strain_option, m->type->name);
  PetscCall(SbOptionString(scope, "prony_times", sizeof(times), times));
  PetscCall(SbOptionReal(scope, "viscosity", &viscosity[0]));
  PetscCall(SbOptionReal(scope, "viscosity_bulk", &viscosity[1]));
  PetscCheck(!times[0] && viscosity[0] == 0 && viscosity[1] == 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: the strain of a viscoelastic material has no such part; take active_tension, or "
             "leave prony_times and viscosity out",
             m->active->strain_option);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbActiveRead(SbMaterial m, const SbScope *scope)
{
  PetscBool pulls, has;
  SbActive a;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&a));
  m->active = a;
  PetscCall(read_formula(scope, "active_tension", sizeof(a->option), a->option, &a->tension,
                         &a->steady, &pulls));
  PetscCall(read_formula(scope, "active_strain", sizeof(a->strain_option), a->strain_option,
                         &a->strain, &a->strain_steady, &a->strains));
  if (!pulls && !a->strains) {
    PetscCall(SbActiveDestroy(&m->active));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (a->strains)
    PetscCall(check_strain(m, scope));
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
  if (m->fibres)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* a law without fibres of its own */
  PetscCall(has_directions(scope, &has));
  PetscCheck(has, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: fibres of the law %s have no direction: give -%s_%s_fibre, as 1,0,0, or "
             "fibre_field or fibre_surfaces",
             pulls ? a->option : a->strain_option, m->type->name, scope->klass, scope->instance);
  PetscCall(SbFibresRead(m, scope, PETSC_FALSE));
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

PetscErrorCode SbActiveStrainAt(const struct _p_SbActive *a, PetscReal t, PetscReal load,
                                const PetscReal x[3], PetscReal *strain)
{
  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(a->strain, t, x, strain));
  *strain *= a->strain_steady ? load : 1;
  PetscCheck(*strain > -1, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s is %g at t = %g, (%.4g, %.4g, %.4g) m: fibres keep a length, so that a strain is "
             "above -1",
             a->strain_option, (double)*strain, (double)t, (double)x[0], (double)x[1],
             (double)x[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law of F_e. */
static struct _p_SbMaterial elastic(const struct _p_SbMaterial *m)
{
  struct _p_SbMaterial law = *m->inner;

  law.axes = m->axes;
  law.tangent = m->tangent;
  return law;
}

/* B = X A of 3x3 matrices, rows of X. */
SB_KERNEL static void shorten(const struct _p_SbMaterial *m, const SbPack X[restrict 9],
                              SbPack B[restrict 9])
{
  const SbPack *Q = m->axes;

  for (int i = 0; i < 3; i++) {
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal f[3] = {Q[0][l], Q[3][l], Q[6][l]};
      const PetscReal a = m->shortening[0][l];
      const PetscReal b = m->shortening[1][l];
      const PetscReal along = X[3 * i][l] * f[0] + X[3 * i + 1][l] * f[1] + X[3 * i + 2][l] * f[2];

      for (int j = 0; j < 3; j++)
        B[3 * i + j][l] = b * X[3 * i + j][l] + (a - b) * along * f[j];
    }
  }
}

static void energy_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi)
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9];

  shorten(m, F, Fe);
  law.ops.energy(&law, (const SbPack *)Fe, psi);
}

static void stress_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], Pe[9];

  shorten(m, F, Fe);
  law.ops.stress(&law, (const SbPack *)Fe, Pe);
  shorten(m, (const SbPack *)Pe, P);
}

/* Rows of 3x3 matrices on both sides; the upper half is computed, and copied. */
static void tangent_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], T[81], half[81];

  shorten(m, F, Fe);
  law.ops.tangent(&law, (const SbPack *)Fe, T);
  for (int ij = 0; ij < 9; ij++)
    shorten(m, (const SbPack *)T + 9 * ij, half + 9 * ij);
  for (int kl = 0; kl < 9; kl++) {
    SbPack column[9], both[9];

    for (int ij = 0; ij < 9; ij++)
      memcpy(column[ij], half[9 * ij + kl], sizeof(SbPack));
    shorten(m, (const SbPack *)column, both);
    for (int ij = 0; ij <= kl; ij++)
      SbTangentPut(both[ij], ij, kl, C);
  }
}

void SbActiveStrain(struct _p_SbMaterial *m, const struct _p_SbMaterial *law,
                    const SbPack shortening[2])
{
  m->inner = law;
  m->shortening = shortening;
  m->ops.energy = energy_strained;
  m->ops.stress = stress_strained;
  m->ops.tangent = tangent_strained;
}

void SbActiveStrainForce(const struct _p_SbMaterial *m, const SbPack F[9], SbPack force)
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], P[9];

  /* P_e : F dA/dg */
  shorten(m, F, Fe);
  law.ops.stress(&law, (const SbPack *)Fe, P);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal a = m->shortening[0][l];
    const PetscReal f[3] = {m->axes[0][l], m->axes[3][l], m->axes[6][l]};
    PetscReal all = 0;
    PetscReal along = 0;

    for (int i = 0; i < 3; i++) {
      PetscReal p = 0;
      PetscReal v = 0;

      for (int j = 0; j < 3; j++) {
        all += P[3 * i + j][l] * F[3 * i + j][l];
        p += P[3 * i + j][l] * f[j];
        v += F[3 * i + j][l] * f[j];
      }
      along += p * v;
    }
    force[l] = -a * a * along + (all - along) / (2 * m->shortening[1][l]);
  }
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
