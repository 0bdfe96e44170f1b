/*
  Error of the time integrator. With E_j the energy of the j-th derivative of the state (u, v), 1/2
  d.K d + 1/2 d'.M d' for d = u^(j), the local error of a method of order p is c h^(p+1)
  E_(p+1)^(1/2): its eigenvalue z for an oscillator of frequency w has |z - exp(i w h)| = c (w
  h)^(p+1), each derivative a factor w.

  Local errors add up, but the error of an oscillation is bounded by its energy. One that the steps
  do not resolve reaches this bound soon, which the sum of asymptotic errors ignores. With x = c
  h^(p+1) w^(p+1) per step, min(sum x, 1) <= (sum x)^(j/(p+1)) for every j, so that

    (sum c h^(p+1))^(j/(p+1)) E_j^(1/2),   j = 0 .. p,

  are also bounds; the smallest of them and of the sum is used. (With implicit Euler and j = 1 it is
  the energy dissipated by the method.) Derivatives are finite differences of the accelerations,
  which the integrators store (second_order.c), at the times to which they belong.
*/
#include "ledger_impl.h"

/* Energy of a derivative of the state, with displacement D and velocity rate. Collective. */
static PetscErrorCode derivative_energy(SbLedger l, const SbSolvedStep *step, Vec D, Vec rate,
                                        PetscReal *energy)
{
  PetscReal mass, stiffness;

  PetscFunctionBeginUser;
  PetscCall(SbMassForm(l, rate, &mass));
  PetscCall(SbStiffnessForm(l, step->t + step->dt, step->U, D, &stiffness));
  *energy = 0.5 * (mass + stiffness);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEstimateTime(SbLedger l, const SbSolvedStep *step, PetscBool all)
{
  const PetscReal h = step->dt;
  const PetscReal gap =
    l->order == 2 ? h + SbRunAccelerationShift(l->run, h, l->shift) - l->shift : h;
  Vec rate = l->w[0];
  Vec second = l->delta;
  PetscReal mass;

  PetscFunctionBeginUser;
  if (all)
    PetscCall(derivative_energy(l, step, step->V, step->A, &l->derivative[1]));
  PetscCall(VecWAXPY(rate, -1., step->A0, step->A));
  PetscCall(VecScale(rate, 1. / gap));

  /* implicit Euler starts without an acceleration; after re-meshing no integrator has a valid
     one */
  if (step->t == l->run->clock.t0 && (l->anew || (l->order == 1 && l->run->clock.step0 == 0)))
    PetscCall(VecZeroEntries(rate));
  if (all || l->order == 1)
    PetscCall(derivative_energy(l, step, step->A, rate, &l->derivative[2]));
  if (l->order == 2) {
    PetscCall(VecCopy(rate, second));
    if (l->before && l->before_dt > 0.) {
      PetscCall(VecAXPBYPCZ(second, -1. / l->before_dt, 1. / l->before_dt, 1., l->kept, l->before));
      PetscCall(VecScale(second, 2. / (gap + l->before_dt)));
    } else
      PetscCall(VecZeroEntries(second));
    PetscCall(derivative_energy(l, step, rate, second, &l->derivative[3]));
  }
  l->step_time =
    l->c * PetscPowReal(h, (PetscReal)l->order + 1.) * PetscSqrtReal(l->derivative[l->order + 1]);
  l->offset = 0.;
  if (l->ahead > 0.) {
    PetscCall(SbMassForm(l, step->A, &mass));
    l->offset = l->ahead * h * PetscSqrtReal(0.5 * mass);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbEstimateTimeAdd(SbLedger l, PetscReal dt, PetscReal left)
{
  const PetscReal power = (PetscReal)l->order + 1.;
  PetscReal least;

  l->lost = left * l->lost + l->step_time;
  l->tau += l->c * PetscPowReal(dt, power);
  l->span += dt;
  least = PetscMin(l->lost, PetscSqrtReal(l->stored));
  for (int j = 1; j <= l->order; j++) {
    l->mean[j] += dt * l->derivative[j];
    least = PetscMin(least, PetscPowReal(l->tau, (PetscReal)j / power) *
                              PetscSqrtReal(l->mean[j] / l->span));
  }
  l->error[SB_ERROR_TIME] = least;
}
