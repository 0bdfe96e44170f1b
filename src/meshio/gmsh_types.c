/*
  gmsh_types.c - table of gmsh's element types (reference manual, "MSH file format"), by number.
*/
#include "meshio_impl.h"

const SbGmshType SbGmshTypes[SB_GMSH_NTYPES] = {
  {NULL, 0, 0},
  {"2-node lines", 1, 2},
  {"3-node triangles", 2, 3},
  {"4-node quadrangles", 2, 4},
  {"4-node tetrahedra", 3, 4},
  {"hexahedra", 3, 8},
  {"prisms", 3, 6},
  {"pyramids", 3, 5},
  {"3-node lines", 1, 3},
  {"6-node triangles", 2, 6},
  {"9-node quadrangles", 2, 9},
  {"10-node tetrahedra", 3, 10},
  {"27-node hexahedra", 3, 27},
  {"18-node prisms", 3, 18},
  {"14-node pyramids", 3, 14},
  {"points", 0, 1},
  {"8-node quadrangles", 2, 8},
  {"20-node hexahedra", 3, 20},
  {"15-node prisms", 3, 15},
  {"13-node pyramids", 3, 13},
  {"9-node triangles", 2, 9},
  {"10-node triangles", 2, 10},
  {"12-node triangles", 2, 12},
  {"15-node triangles", 2, 15},
  {"15-node triangles", 2, 15},
  {"21-node triangles", 2, 21},
  {"4-node lines", 1, 4},
  {"5-node lines", 1, 5},
  {"6-node lines", 1, 6},
  {"20-node tetrahedra", 3, 20},
  {"35-node tetrahedra", 3, 35},
  {"56-node tetrahedra", 3, 56},
};

PetscErrorCode SbImportCheckTypes(const SbImport *im)
{
  PetscFunctionBeginUser;
  for (int t = 1; t < SB_GMSH_NTYPES; t++) {
    const char *advice = strstr(SbGmshTypes[t].name, "tetra")
                           ? "supple takes tets of 4 or 10 nodes (gmsh: Mesh.ElementOrder = 1 or 2)"
                           : "supple simulates tetrahedra only: split them (gmsh: "
                             "Mesh.SubdivisionAlgorithm = 0, Recombine off)";

    PetscCheck(t == SB_GMSH_TET || t == SB_GMSH_TET10 || SbGmshTypes[t].dim < 3 || !im->count[t],
               PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: holds %lld %s; %s", im->where,
               (long long)im->count[t], SbGmshTypes[t].name, advice);
  }
  if (im->count[SB_GMSH_TET] || im->count[SB_GMSH_TET10] ||
      (im->surface && im->count[SB_GMSH_TRIANGLE]))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int t = 1; t < SB_GMSH_NTYPES; t++)
    PetscCheck(SbGmshTypes[t].dim < 2 || !im->count[t], PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s: is a surface: %lld %s and no tetrahedra; mesh the volume (gmsh -3)", im->where,
               (long long)im->count[t], SbGmshTypes[t].name);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
          "%s: holds no tetrahedra; mesh the volume (gmsh -3) and save all of it", im->where);
  PetscFunctionReturn(PETSC_SUCCESS);
}
