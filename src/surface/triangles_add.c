/*
  triangles_add.c - a surface grows vertex by vertex and triangle by triangle, with the groups of its triangles.
*/
#include <ctype.h>
#include "triangles.h"

PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *f, const PetscReal x[3])
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  PetscCall(SbReserve(t->nvert + 1, 3 * sizeof(PetscReal), &f->vert_size, &t->x));
  for (int i = 0; i < 3; i++) t->x[3 * t->nvert + i] = x[i];
  t->nvert++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesAdd(SbTriangleFile *f, PetscInt a, PetscInt b, PetscInt c, int64_t number)
{
  SbTriangles *t = f->t;
  PetscInt *v;

  PetscFunctionBeginUser;
  if (t->ntri == f->tri_size) {
    f->tri_size = PetscMax(256, 2 * f->tri_size);
    PetscCall(PetscRealloc(3 * (size_t)f->tri_size * sizeof(PetscInt), &t->tri));
    PetscCall(PetscRealloc((size_t)f->tri_size * sizeof(int64_t), &f->number));
    if (f->groups) PetscCall(PetscRealloc((size_t)f->tri_size * sizeof(PetscInt), &f->tags));
  }
  if (f->groups) f->tags[t->ntri] = f->now;
  v = t->tri + 3 * t->ntri;
  v[0] = a;
  v[1] = b;
  v[2] = c;
  f->number[t->ntri++] = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesGroups(SbTriangleFile *f, PetscInt n, const char *const names[])
{
  PetscInt group[16];

  PetscFunctionBeginUser;
  if (!f->groups) PetscFunctionReturn(PETSC_SUCCESS);
  n = PetscMin(n, 16);
  for (PetscInt i = 0; i < n; i++) {
    char name[SB_GROUP_MAX];
    uint64_t hash = 0xcbf29ce484222325u; /* stands for the name where groups have numbers (FNV-1a) */

    PetscCall(PetscStrncpy(name, names[i], sizeof(name)));
    for (char *c = name; *c; c++) {
      if (isspace((unsigned char)*c)) *c = '_';
      hash = (hash ^ (unsigned char)*c) * 0x100000001b3u;
    }
    PetscCall(SbImportGroup(f->groups, 2, (int64_t)(hash >> 2), name, &group[i]));
  }
  PetscCall(SbImportTagSet(f->groups, n, group, &f->now));
  PetscFunctionReturn(PETSC_SUCCESS);
}
