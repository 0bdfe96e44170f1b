/*
  memory.c - what a run will take, from the counts of a mesh.

  Nodes are those of the element: vertices (p1), faces (cr), four in every tet (dg). A row of the matrix has a block of
  3 x 3 numbers for itself and for every node that a term joins it with:

    p1  N + 2 edges
    cr  N + 12 tets, six pairs of faces in a tet, each in one tet only; the terms of the jump at a face join the four faces of
        one side with those of the other: 9 more pairs for each inner face
    dg  16 for each tet, 2 x 16 for each inner face

  The memory of a run is proportional to tets and blocks, with factors that were measured: docs/meshes.md.
*/
#include "tool.h"

PetscReal SbToolMemory(const SbMeshFacts *f, const char *element, PetscInt *unknowns, PetscReal *matrix)
{
  const PetscReal inner = f->nface - f->body.nfacet, ncell = f->body.ncell;
  PetscReal nodes = f->body.nvert, blocks = nodes + 2. * f->nedge;

  if (!strcmp(element, "cr")) {
    nodes = f->nface;
    blocks = nodes + 12 * ncell + 18 * inner;
  } else if (!strcmp(element, "dg")) {
    nodes = 4 * ncell;
    blocks = 16 * ncell + 32 * inner;
  }
  *unknowns = (PetscInt)(3 * nodes);
  *matrix = blocks * 76;
  return 60e6 + 1000 * ncell + 3 * *matrix;
}
