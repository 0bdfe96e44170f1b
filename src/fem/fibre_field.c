/*
  Directions of cells from arrays of the mesh file: those of the tet of the file whose centre is
  next to the centre of the cell at rest. That is the cell itself, whatever its number and rank; of
  a refined or re-meshed body it is a tet near by. Rank 0 reads the file once more and sends centres
  and directions to all, which keep them while they look them up.
*/
#include "fem_impl.h"
#include "sbgeometry.h"
#include "sbmeshio.h"

/* Direction i, 0: fibre, 1: sheet, of the cells of material k of a body. */
static PetscErrorCode from_field(SbMesh mesh, PetscInt body, PetscInt k, SbFibres f, int i)
{
  PetscMPIInt rank;
  PetscInt n = 0;
  PetscReal *centre = NULL;
  PetscReal *direction = NULL;
  PetscReal(*box)[6];
  char option[4 * SB_NAME_MAX];
  SbBoxTree tree;
  SbCaughtError caught = {0, ""};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  (void)snprintf(option, sizeof(option), "%s_field", f->option[i]);
  if (!rank)
    SB_CATCH(&caught,
             SbImportDirections(&mesh->body[body], option, f->field[i], &n, &centre, &direction));
  PetscCall(SbCaughtRaise(mesh->comm, &caught));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, mesh->comm));
  if (rank) {
    PetscCall(PetscMalloc1(3 * n, &centre));
    PetscCall(PetscMalloc1(3 * n, &direction));
  }
  PetscCallMPI(MPI_Bcast(centre, (PetscMPIInt)(3 * n), MPIU_REAL, 0, mesh->comm));
  PetscCallMPI(MPI_Bcast(direction, (PetscMPIInt)(3 * n), MPIU_REAL, 0, mesh->comm));
  PetscCall(PetscMalloc1(n, &box));
  for (PetscInt c = 0; c < 6 * n; c++)
    box[c / 6][c % 6] = centre[3 * (c / 6) + c % 3];
  PetscCall(SbBoxTreeCreate(n, (const PetscReal(*)[6])box, &tree));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    PetscReal x[6];
    PetscInt at;
    PetscInt found = -1;
    SbBoxNearest nearest;

    if (mesh->cell_body[c] != body || mesh->cell_material[c] != k)
      continue;
    SbCellCentre(mesh, c, x);
    SbCellCentre(mesh, c, x + 3);
    for (SbBoxNearestBegin(&tree, x, PETSC_MAX_REAL, &nearest); SbBoxNearestNext(&nearest, &at);) {
      const PetscReal d2 = SbDistance2(x, centre + 3 * at);

      if (d2 < nearest.limit2 || (d2 == nearest.limit2 && at < found)) {
        nearest.limit2 = d2;
        found = at;
      }
    }
    for (int e = 0; e < 3 && found >= 0; e++)
      mesh->direction[6 * c + 3 * i + e] = direction[3 * found + e];
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscCall(PetscFree(centre));
  PetscCall(PetscFree(direction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFibresFind(SbMesh mesh, const SbMaterial material[])
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    for (PetscInt i = -1; i < mesh->body[b].ninclusion; i++) {
      const PetscInt k = i < 0 ? b : mesh->body[b].inclusion[i].material;
      const SbFibres f = material[k]->fibres;

      if (!f || !(f->field[0][0] || f->field[1][0] || f->surface[0][0]))
        continue;
      if (!mesh->direction)
        PetscCall(PetscCalloc1(6 * mesh->ncell, &mesh->direction));
      for (int n = 0; n < 2; n++)
        if (f->field[n][0])
          PetscCall(from_field(mesh, b, k, f, n));
      if (f->surface[0][0])
        PetscCall(SbFibresByRule(mesh, b, k, f));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
