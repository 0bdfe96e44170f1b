/*
  Large rotations in a load step.

  The displacement at the end of a load step does not say how often it went around: a grip that
  turns by 210 degrees in one step stands where one that turns by 150 degrees the other way does,
  and Newton's method finds the equilibrium of that. A bar twisted by up to 180 degrees in one step
  came out right with every element and law, by 210 degrees or more in most cases not: another
  torque, even of the other sign, with exit code 0. So load steps are cut where supports turn by
  more than SB_TURN.

  Before a step. The motion from x0 to x1 of the nodes of a support turns by the rotation nearest to
  the sum of (x1 - c1) (x0 - c0)^T, c the centres (Kabsch 1976). Angles of PARTS parts of the step
  are summed, as a rotation of 360 degrees leaves nothing between its ends; the parts are unequal,
  so that no multiple of it escapes. A multiple of the identity makes the rotation of nodes in line,
  which have no angle about it, the smallest.

  After a step. Loads turn bodies, too, and they may snap; if cells turned by more than
  SB_TURN_CELLS, the step is repeated with half its length, CUTS times at most.
*/
#include "sbmaterial.h"
#include "time_impl.h"

#define PARTS 16
#define UNEQUAL 0.3 /* shift of the ends of parts, over their mean length */
#define LEAST 1e-3  /* multiple of the identity, over the sum of squares */

PetscErrorCode SbRunSupportsTurn(SbRun run, PetscReal from, PetscReal to, PetscReal *angle,
                                 SbEffect *effect)
{
  const SbModel m = run->model;

  PetscFunctionBeginUser;
  *angle = 0.;
  *effect = NULL;
  for (PetscInt e = 0; e < m->nprescribe; e++) {
    const SbEffect support = m->prescribe[e];
    PetscReal sum[PARTS][16] = {{0.}};
    PetscReal end[PARTS + 1];
    PetscReal all = 0.;

    if (!support->ops.moments)
      continue;
    for (int k = 0; k <= PARTS; k++) {
      const PetscReal shift = k && k < PARTS ? UNEQUAL * PetscSinReal((PetscReal)k * k) : 0.;

      end[k] = from + (to - from) * ((PetscReal)k + shift) / PARTS;
    }
    for (int k = 0; k < PARTS; k++) {
      const PetscReal factor[2] = {support->steady ? end[k] : 1.,
                                   support->steady ? end[k + 1] : 1.};

      SbEffectCall(support, moments, m->space, end[k], end[k + 1], factor, sum[k]);
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum[0][0], 16 * PARTS, MPIU_REAL, MPI_SUM, m->comm));
    for (int k = 0; k < PARTS && sum[k][0] > 0.; k++) {
      SbPack H[9], R[9];
      PetscReal size = 0.;

      for (int q = 0; q < 9; q++) {
        const PetscReal h = sum[k][7 + q] - sum[k][4 + q / 3] * sum[k][1 + q % 3] / sum[k][0];

        size += PetscSqr(h);
        for (int l = 0; l < SB_BATCH; l++)
          H[q][l] = h;
      }
      for (int l = 0; l < SB_BATCH; l++)
        for (int q = 0; q < 9; q += 4)
          H[q][l] += LEAST * PetscSqrtReal(size);
      SbPolar((const SbPack *)H, R);
      all += PetscAcosReal(PetscClipInterval((R[0][0] + R[4][0] + R[8][0] - 1.) / 2., -1., 1.));
    }
    if (all > *angle) {
      *angle = all;
      *effect = support;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunCutTurn(SbRun run, PetscReal from, PetscReal least, PetscReal *length)
{
  const PetscReal whole = *length;
  PetscReal first = 0.;
  PetscReal angle;
  SbEffect effect;

  PetscFunctionBeginUser;
  for (;;) {
    PetscCall(SbRunSupportsTurn(run, from, from + *length, &angle, &effect));
    if (first == 0.)
      first = angle;
    if (angle <= SB_TURN * (1. + 1e-6) || *length <= least)
      break;
    *length = PetscMax(least, *length / PetscCeilReal(angle / SB_TURN - 1e-6));
  }
  if (*length == whole)
    PetscFunctionReturn(PETSC_SUCCESS);
  run->counters.turned++;
  PetscCall(PetscInfo(
    run->solve.snes, "load factor %g: the next %g would turn a support by %g degrees: %g\n",
    (double)from, (double)whole, (double)(first * 180. / PETSC_PI), (double)*length));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunTurned(SbRun run, Vec U0, Vec U1, PetscReal *share)
{
  const SbSpace s = run->model->space;
  const PetscReal *u[2];
  PetscReal volume[2] = {0., 0.};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U0, &u[0]));
  PetscCall(SbSpaceGetLocalRead(s, U1, &u[1]));
  SbSpaceTurnedBetween(s, u[0], u[1], SB_TURN_CELLS, volume);
  PetscCall(SbSpaceRestoreLocalRead(s, U1, &u[1]));
  PetscCall(SbSpaceRestoreLocalRead(s, U0, &u[0]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, volume, 2, MPIU_REAL, MPI_SUM, s->comm));
  *share = volume[0] > 0. ? volume[1] / volume[0] : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}
