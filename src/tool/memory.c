/*
  memory.c - what a run will take, from the counts of a mesh.

  Nodes are those of the element: vertices (p1), faces (cr), four in every tet (dg). A row of the matrix has a block of
  3 x 3 numbers for itself and for every node that a term joins it with:

    p1  N + 2 edges
    cr  N + 12 for each tet (six pairs of faces, each in one tet only) + 18 for each inner face, whose jump joins the three other
        faces of one side with those of the other
    dg  16 for each tet + 32 for each inner face

  The rest was measured: see the constants. docs/reference/meshes.md says how good it is.
*/
#include "tool.h"

#define PROCESS 43e6   /* bytes of a run without a mesh to speak of */
#define TET 600.       /* bytes: mesh and geometry of a tet, with vertices and boundary */
#define FACTOR 4096.   /* bytes for each unknown of a factorisation */
#define FACTORED 60000 /* unknowns up to which -solver auto factors the matrix of a dynamic run */

PetscReal SbToolMemory(const SbMeshFacts *f, const char *element, PetscInt *unknowns, PetscReal *matrix)
{
  const PetscReal inner = f->nface - f->body.nfacet, ncell = f->body.ncell;
  PetscReal nodes = f->body.nvert, blocks = nodes + 2. * f->nedge,
            times = 1.9; /* matrix, plan, preconditioner */

  if (!strcmp(element, "cr")) {
    nodes = f->nface;
    blocks = nodes + 12 * ncell + 18 * inner;
  } else if (!strcmp(element, "dg")) {
    nodes = 4 * ncell;
    blocks = 16 * ncell + 32 * inner;
    times = 2.45;
  }
  *unknowns = (PetscInt)(3 * nodes);
  *matrix = 72 * blocks;
  return PROCESS + TET * ncell + times * *matrix + (*unknowns <= FACTORED ? FACTOR * *unknowns : 0);
}
