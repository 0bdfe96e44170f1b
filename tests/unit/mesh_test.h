/*
  mesh_test.h - common functions of the tests of the mesh layer: bodies and sets in one line, meshes
  read and checked as in a run.
*/
#pragma once
#include <sbmeshio.h>
#include "../test.h"

/* A body of this name and mesh, neither scaled nor moved. */
static inline SbBody test_body(const char *name, const char *mesh)
{
  SbBody body = {0};

  (void)snprintf(body.name, sizeof(body.name), "%s", name);
  (void)snprintf(body.mesh, sizeof(body.mesh), "%s", mesh);
  body.scale = 1;
  body.density = 1;
  return body;
}

static inline PetscErrorCode test_set(const char *name, const char *text, SbSet *set)
{
  PetscFunctionBeginUser;
  memset(set, 0, sizeof(*set));
  (void)snprintf(set->name, sizeof(set->name), "%s", name);
  PetscCall(SbSetParse("-set", text, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesh as a run reads and checks it. */
typedef struct {
  SbImport im;
  SbMeshStatistics facts;
} TestMesh;

static inline PetscErrorCode test_mesh_read(SbBody body, TestMesh *m)
{
  PetscFunctionBeginUser;
  memset(m, 0, sizeof(*m));
  PetscCall(SbImportRead(&body, &m->im));
  PetscCall(SbMeshFileMeasure(&m->im, &m->facts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a file; SbImportDestroy(). */
static inline PetscErrorCode test_import(const char *path, SbImport *im)
{
  const SbBody body = test_body("b", path);

  PetscFunctionBeginUser;
  memset(im, 0, sizeof(*im));
  PetscCall(SbImportRead(&body, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bends the edges of the tets whose middle is beyond x = 0.5, as a smooth motion would. */
static inline PetscErrorCode test_curve(SbImport *im)
{
  PetscReal largest;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 6 * im->item[3].n; i++) {
    const PetscInt a = im->item[3].vert[4 * (i / 6) + SbTetEdge[i % 6][0]];
    const PetscInt b = im->item[3].vert[4 * (i / 6) + SbTetEdge[i % 6][1]];
    const PetscReal *x = im->x + 3 * a;
    const PetscReal *y = im->x + 3 * b;
    SbMiddle m = {.end = {PetscMin(a, b), PetscMax(a, b)}, .node = -1};

    for (int k = 0; k < 3; k++) {
      const int p = (k + 1) % 3;
      const int q = (k + 2) % 3;

      m.off[k] =
        0.05 * (PetscSinReal(x[p] + y[p] + 1.5 * (x[q] + y[q])) -
                0.5 * (PetscSinReal(2 * x[p] + 3 * x[q]) + PetscSinReal(2 * y[p] + 3 * y[q])));
    }
    if (x[0] + y[0] < 1)
      continue;
    PetscCall(SbReserve(++im->nmiddle.n, sizeof(m), &im->nmiddle.capacity, &im->middle));
    im->middle[im->nmiddle.n - 1] = m;
  }
  PetscCall(SbImportMiddles(im, NULL, &largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a tag set has the group; items of one dimension that belong to it. */
static inline PetscBool test_in_group(const SbImport *im, PetscInt tags, const char *name)
{
  for (PetscInt t = im->tags_start[tags]; t < im->tags_start[tags + 1]; t++)
    if (!strcmp(im->group[im->tags_group[t]].name, name))
      return PETSC_TRUE;
  return PETSC_FALSE;
}

static inline PetscInt test_count(const SbImport *im, int dim, const char *name)
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < im->item[dim].n; i++)
    n += test_in_group(im, im->item[dim].tags[i], name);
  return n;
}

/* Reads, checks, frees, also after an error, which it returns. */
static inline PetscErrorCode test_mesh_use(const char *path)
{
  TestMesh m;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = test_mesh_read(test_body("b", path), &m);
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(ierr);
}
