/*
  Probes: points of the bodies whose displacement the history follows. Each sits at the vertex nearest to the point asked
  for in the rest state; of equally near ones, at that with the smallest original number. It shows what vertex fields show
  there: the unknown of P1, the mean of the cells around it for CR and DG.
*/
#include <math.h>
#include "output_impl.h"

/* The nearest vertex that this rank owns: squared distance, local number (-1 when it owns none). */
static void nearest_owned(const SbMesh mesh, const PetscReal at[3], PetscReal *best, PetscInt *local)
{
  *best = PETSC_MAX_REAL;
  *local = -1;
  for (PetscInt i = 0; i < mesh->nvert_owned; i++) {
    const PetscReal *x = mesh->x + 3 * i;
    const PetscReal d2 = PetscSqr(x[0] - at[0]) + PetscSqr(x[1] - at[1]) + PetscSqr(x[2] - at[2]);

    if (d2 < *best || (d2 == *best && *local >= 0 && mesh->vert_orig[i] < mesh->vert_orig[*local])) {
      *best = d2;
      *local = i;
    }
  }
}

PetscErrorCode SbProbesFind(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;

  PetscFunctionBeginUser;
  if (out->nprobe) PetscCall(SbPointsPrepare(run, out));
  for (PetscInt p = 0; p < out->nprobe; p++) {
    SbProbe *probe = &out->probe[p];
    PetscReal mine, all, here[3] = {0., 0., 0.};
    PetscInt local, original = PETSC_MAX_INT;

    nearest_owned(mesh, probe->at, &mine, &local);
    PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPIU_REAL, MPI_MIN, out->comm));
    if (local >= 0 && mine == all) original = mesh->vert_orig[local];
    PetscCallMPI(MPI_Allreduce(&original, &probe->original, 1, MPIU_INT, MPI_MIN, out->comm));
    probe->local = original == probe->original ? local : -1;
    if (probe->local >= 0) PetscCall(PetscArraycpy(here, mesh->x + 3 * local, 3));
    PetscCallMPI(MPI_Allreduce(here, probe->x, 3, MPIU_REAL, MPI_SUM, out->comm));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
