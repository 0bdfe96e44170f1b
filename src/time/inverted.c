/*
  Rejects steps that invert tets, with -time_inverted reject; and those that invert a tet of a law
  whose energy is infinite there, which has no forces to start the next step from.

  det F <= 0 in a tet is no admissible deformation; with laws of finite energy a run could go on,
  with meaningless results. A step that increases the number of such tets is rejected, so inverted
  initial states may recover. It is repeated with half its length; below 2^-time_max_halvings of the
  nominal length the run stops: shorter steps would only approach the flat tet.
*/
#include "time_impl.h"

PetscErrorCode SbRunDescribeDivergence(SbRun run, Vec X, SNESConvergedReason reason, size_t size,
                                       char text[])
{
  PetscFunctionBeginUser;
  text[0] = 0;
  if (reason == SNES_DIVERGED_FNORM_NAN)
    PetscCall(SbSpaceDescribeInverted(run->model->space, X, size, text));
  if (!text[0])
    PetscCall(PetscStrncpy(text, SNESConvergedReasons[reason], size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunRejectInverted(SbRun run, PetscReal t, PetscReal dt, const Vec U[2],
                                   PetscBool *ok)
{
  PetscInt n[2];
  PetscReal least[2];

  PetscFunctionBeginUser;
  run->solve.rejected_inverted = PETSC_FALSE;
  if (*ok && run->model->space->positive) {
    char inverted[512];

    PetscCall(SbSpaceDescribeInverted(run->model->space, U[1], sizeof(inverted), inverted));
    if (inverted[0]) {
      *ok = PETSC_FALSE;
      run->solve.rejected_inverted = PETSC_TRUE;
      PetscCall(SbRunFail(run, "%s %g to %g: %s",
                          run->solve.ts ? "the step from t, s =" : "the step from the load factor",
                          (double)t, (double)(t + dt), inverted));
    }
  }
  if (!run->solve.reject_inverted || !*ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 2; k++) {
    const SbSpace s = run->model->space;
    PetscReal energy, volume;
    const PetscReal *u;

    /* number of tets with det F <= 0, all ranks, and smallest det F */
    PetscCall(SbSpaceGetLocalRead(s, U[k], &u));
    SbSpaceStrainEnergy(s, u, NULL, &energy, &least[k], &n[k], &volume);
    PetscCall(SbSpaceRestoreLocalRead(s, U[k], &u));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n[k], 1, MPIU_INT, MPI_SUM, run->model->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least[k], 1, MPIU_REAL, MPI_MIN, run->model->comm));
  }
  if (n[1] <= n[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  *ok = PETSC_FALSE;
  run->solve.rejected_inverted = PETSC_TRUE;
  PetscCall(
    SbRunFail(run,
              "%s %g to %g would invert %" PetscInt_FMT
              " more tet%s (smallest det F %.3g, before it %.3g), which -time_inverted reject; "
              "re-mesh the body before that (-remesh_quality), or give it a finer mesh",
              run->solve.ts ? "the step from t, s =" : "the step from the load factor", (double)t,
              (double)(t + dt), n[1] - n[0], n[1] - n[0] == 1 ? "" : "s", (double)least[1],
              (double)least[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
