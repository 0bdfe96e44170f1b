/*
  Directions and temperatures of cells from arrays of the mesh file: those of the tet of the file
  whose centre is next to the centre of the cell at rest. That is the cell itself, whatever its
  number and rank; of a refined or re-meshed body it is a tet near by. Rank 0 reads the file once
  more and sends centres and values to all, which keep them while they look them up.
*/
#include "fem_impl.h"
#include "sbgeometry.h"
#include "sbmeshio.h"

/* An array of the file. */
typedef struct {
  char option[4 * SB_NAME_MAX]; /* that names it */
  const char *name;
  int width; /* numbers per tet */
} Array;

/* The values of the cells of material k of a body: those of cell c at to + stride c. */
static PetscErrorCode from_field(SbMesh mesh, PetscInt body, PetscInt k, const Array *array,
                                 PetscInt stride, PetscReal to[])
{
  PetscMPIInt rank;
  PetscInt n = 0;
  PetscReal *centre = NULL;
  PetscReal *value = NULL;
  PetscReal(*box)[6];
  SbBoxTree tree;
  SbCaughtError caught = {0, ""};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  if (!rank)
    SB_CATCH(&caught, SbImportCellData(&mesh->body[body], array->option, array->name, array->width,
                                       &n, &centre, &value));
  PetscCall(SbCaughtRaise(mesh->comm, &caught));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, mesh->comm));
  if (rank) {
    PetscCall(PetscMalloc1(3 * n, &centre));
    PetscCall(PetscMalloc1(array->width * n, &value));
  }
  PetscCallMPI(MPI_Bcast(centre, (PetscMPIInt)(3 * n), MPIU_REAL, 0, mesh->comm));
  PetscCallMPI(MPI_Bcast(value, (PetscMPIInt)(array->width * n), MPIU_REAL, 0, mesh->comm));
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
    for (int e = 0; e < array->width && found >= 0; e++)
      to[stride * c + e] = value[array->width * found + e];
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscCall(PetscFree(centre));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCellFieldsFind(SbMesh mesh, const SbMaterial material[])
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    for (PetscInt i = -1; i < mesh->body[b].ninclusion; i++) {
      const PetscInt k = i < 0 ? b : mesh->body[b].inclusion[i].material;
      const SbFibres f = material[k]->fibres;
      const SbEigenstrain eigen = material[k]->eigen;
      Array array;

      if (eigen && eigen->field[0]) {
        array = (Array){.name = eigen->field, .width = 1};
        (void)snprintf(array.option, sizeof(array.option), "%s_field",
                       eigen->option[SB_EIGEN_TEMPERATURE]);
        if (!mesh->temperature)
          PetscCall(PetscCalloc1(mesh->ncell, &mesh->temperature));
        PetscCall(from_field(mesh, b, k, &array, 1, mesh->temperature));
      }
      if (!f || !(f->field[0][0] || f->field[1][0] || f->surface[0][0]))
        continue;
      if (!mesh->direction)
        PetscCall(PetscCalloc1(6 * mesh->ncell, &mesh->direction));
      for (int n = 0; n < 2; n++) {
        if (!f->field[n][0])
          continue;
        array = (Array){.name = f->field[n], .width = 3};
        (void)snprintf(array.option, sizeof(array.option), "%s_field", f->option[n]);
        PetscCall(from_field(mesh, b, k, &array, 6, mesh->direction + 3 * n));
      }
      if (f->surface[0][0])
        PetscCall(SbFibresByRule(mesh, b, k, f));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
