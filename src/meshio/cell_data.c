/*
  Numbers or vectors of the tets of a body, from an array of its mesh file. Readers keep the array
  of the wanted name with the numbers that its rows have in the file; here they meet the tets of
  these numbers.
*/
#include "meshio_impl.h"

PetscErrorCode SbImportCellData(const SbBody *body, const char *option, const char *name, int width,
                                PetscInt *n, PetscReal **centre, PetscReal **value)
{
  SbImport im = {.field_width = width};
  SbNumbers rows = {0};
  const SbItems *tets = &im.item[3];

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(im.field, name, sizeof(im.field)));
  PetscCall(SbImportRead(body, &im));
  PetscCheck(
    im.nfield, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: %s has no array '%s' with %s per tet; ElementData of gmsh, CellData of VTK files and "
    "/mesh/%s of an .h5 mesh are read",
    option, body->mesh, name, width == 3 ? "three numbers" : "one number", name);
  for (PetscInt i = 0; i < im.nfield; i++)
    PetscCall(SbNumbersAdd(&rows, im.field_number[i]));
  *n = tets->n;
  PetscCall(PetscCalloc1(3 * tets->n, centre));
  PetscCall(PetscMalloc1(width * tets->n, value));
  for (PetscInt c = 0; c < tets->n; c++) {
    const PetscInt row = SbNumbersFind(&rows, tets->number[c]);

    PetscCheck(row >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: array '%s' of %s has no row for tet %lld", option, name, body->mesh,
               (long long)tets->number[c]);
    for (int k = 0; k < 12; k++)
      (*centre)[3 * c + k % 3] += im.x[3 * tets->vert[4 * c + k / 3] + k % 3] / 4.;
    for (int k = 0; k < width; k++)
      (*value)[width * c + k] = im.field_value[width * row + k];
  }
  PetscCall(SbNumbersDestroy(&rows));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
