/*
  Viscoelastic materials: a Prony series on any law, and a viscosity beside it. This file has the
  constants; src/fem/viscous.c the history.

  The law given is the instantaneous one. Its energy has a part of the shape and one of the volume,

    psi = psi_s(F) + K/2 theta(F)^2,   psi_s = psi_mu + (lambda - K)/2 theta^2,   K = lambda + 2/3
    mu,

  with theta the law's dilatation: at small strains the deviator and the pressure. The second
  Piola-Kirchhoff stress S of the first part and the pressure K theta of the second each relax,
  apart from each other (quasi-linear viscoelasticity, Fung 1972):

    S(t) = (1 - sum g_i) S_e(t) + sum H_i,   H_i = g_i int exp(-(t - s) / tau_i) dS_e(s),

  so that after a sudden strain the shear modulus is G(t) = G (1 - sum g_i (1 - exp(-t / tau_i))),
  and likewise the bulk modulus with k_i. S belongs to the material frame: a rotation changes
  nothing.

  In a step that began with H_i and S_e^n, S_e is taken as linear in time up to d later (Taylor,
  Pister and Goudreau 1970), which is of second order in d:

    H_i(d) = exp(-x) H_i + g_i b(x) (S_e - S_e^n),   x = d / tau_i,   b(x) = (1 - exp(-x)) / x.

  So the stress is that of an energy: with a = 1 - sum g_i (1 - b), c = 1 - sum k_i (1 - b) the law
  a psi_s + c K/2 theta^2, plus tensors and pressures that are constant in the step. The former is a
  times the law itself with another lambda, a lambda' = a lambda + (c - a) K: `step`, at no cost.
  d = 0: the state at the end of the last step, a = c = 1; d = infinity: the relaxed law.
*/
#include "material_impl.h"

/* b(x), right for small x and 0 for x = inf. */
static PetscReal mean_of_decay(PetscReal x)
{
  return x > 0. ? -expm1(-x) / x : 1.;
}

/* Numbers with commas; n: their number, 0: the option is empty. */
static PetscErrorCode read_list(const SbScope *scope, const char *key, PetscReal value[],
                                PetscInt *n)
{
  char text[1024], option[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  SbOptionName(scope, key, sizeof(option), option);
  PetscCall(SbOptionString(scope, key, sizeof(text), text));
  *n = text[0] ? SbParseNumbers(text, SB_PRONY_TERMS, value) : 0;
  PetscCheck(!text[0] || *n > 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s is no list of 1 to %d numbers with commas between them", option, text,
             SB_PRONY_TERMS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coefficients of the terms: as many as times, each in [0, 1), and so their sum. */
static PetscErrorCode read_coefficients(const SbScope *scope, const char *key, PetscInt nterm,
                                        PetscReal value[], PetscReal *sum, PetscBool *given)
{
  char option[3 * SB_NAME_MAX], times[3 * SB_NAME_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  SbOptionName(scope, key, sizeof(option), option);
  SbOptionName(scope, "prony_times", sizeof(times), times);
  PetscCall(read_list(scope, key, value, &n));
  *given = (PetscBool)(n > 0);
  *sum = 0.;
  PetscCheck(n == 0 || n == nterm, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s has %" PetscInt_FMT " and %s %" PetscInt_FMT
             " numbers: each term of the series takes one of both",
             option, n, times, nterm);
  for (PetscInt i = 0; i < n; i++) {
    PetscCheck(value[i] >= 0., PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: number %" PetscInt_FMT
               " is %g; a coefficient is the fraction of the instantaneous modulus that relaxes, "
               "in [0, 1)",
               option, i + 1, (double)value[i]);
    *sum += value[i];
  }
  PetscCheck(*sum < 1., PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: the coefficients sum to %g, and nothing would be left of the modulus at long "
             "times: their sum must be below 1",
             option, (double)*sum);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SHORT 1e-2 /* of the shortest relaxation time: nothing relaxes in less */
#define NEXT 1.2   /* ratio of times that are examined */

/* The energy of neohookean has no least value with lambda < 0, at any time. */
static PetscErrorCode check_lambda(SbMaterial m, const char *option)
{
  const SbViscous v = m->viscous;
  PetscReal t = PETSC_MAX_REAL;
  PetscReal end = 0.;
  PetscReal least;

  PetscFunctionBeginUser;
  if (m->type != &SbMaterialNeoHookean)
    PetscFunctionReturn(PETSC_SUCCESS);
  least = v->relaxed->rest->lambda;
  for (PetscInt i = 0; i < v->n; i++) {
    t = PetscMin(t, SHORT * v->time[i]);
    end = PetscMax(end, v->time[i] / SHORT);
  }
  for (; t < end; t *= NEXT) {
    SbViscousSetElapsed(m, t);
    least = PetscMin(least, v->step->rest->lambda);
  }
  SbViscousSetElapsed(m, PETSC_INFINITY);
  PetscCheck(least >= 0., PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: the bulk modulus relaxes below 2/3 of the shear modulus, where the energy of the "
             "law neohookean has no least value; take smaller coefficients, or the law "
             "stable_neohookean",
             option);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbViscousRead(SbMaterial m, const SbScope *scope)
{
  SbViscous v;
  PetscReal sum[2];
  PetscBool given[2];
  char option[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&v));
  m->viscous = v;
  SbOptionName(scope, "prony_times", sizeof(option), option);
  PetscCall(read_list(scope, "prony_times", v->time, &v->n));
  for (PetscInt i = 0; i < v->n; i++)
    PetscCheck(v->time[i] > 0. && !PetscIsInfOrNanReal(v->time[i]), PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: number %" PetscInt_FMT " is %g s; relaxation times are in (0, inf) s", option,
               i + 1, (double)v->time[i]);
  PetscCall(read_coefficients(scope, "prony_shear", v->n, v->shear, &sum[0], &given[0]));
  PetscCall(read_coefficients(scope, "prony_bulk", v->n, v->bulk, &sum[1], &given[1]));
  PetscCheck(!v->n || given[0] || given[1], PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s has %" PetscInt_FMT
             " times and no coefficients: give prony_shear, prony_bulk, or both",
             option, v->n);
  if (sum[0] == 0. && sum[1] == 0.)
    v->n = 0;
  PetscCall(SbOptionReal(scope, "viscosity", &v->viscosity[0]));
  PetscCall(SbOptionReal(scope, "viscosity_bulk", &v->viscosity[1]));
  if (!v->n && v->viscosity[0] == 0. && v->viscosity[1] == 0.) {
    PetscCall(PetscFree(m->viscous));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* the stress S is that of det F > 0 only */
  m->positive = (PetscBool)!m->linear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbViscousRelax(SbMaterial m, const SbScope *scope)
{
  const SbViscous v = m->viscous;
  char option[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  SbViscousSetElapsed(m, PETSC_INFINITY);
  SbMaterialSetLame(v->relaxed, v->step->rest->lambda, v->step->rest->mu);
  v->relaxed_scale = v->scale;
  SbOptionName(scope, "prony_bulk", sizeof(option), option);
  PetscCall(check_lambda(m, option));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbViscousSetElapsed(SbMaterial m, PetscReal elapsed)
{
  const SbViscous v = m->viscous;
  const PetscReal lambda = m->rest->lambda;
  const PetscReal mu = m->rest->mu;
  PetscReal c = 1.;

  v->elapsed = elapsed;
  v->scale = 1.;
  for (PetscInt i = 0; i < v->n; i++) {
    const PetscReal x = elapsed / v->time[i];

    v->decay[i] = PetscExpReal(-x);
    v->mean[i] = mean_of_decay(x);
    v->scale -= v->shear[i] * (1. - v->mean[i]);
    c -= v->bulk[i] * (1. - v->mean[i]);
  }
  if (c == v->scale)
    SbMaterialSetLame(v->step, lambda, mu);
  else
    SbMaterialSetLame(v->step, lambda + SbMaterialBulkModulus(m) * (c / v->scale - 1.), mu);
}
