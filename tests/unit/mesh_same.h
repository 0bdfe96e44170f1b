/*
  mesh_same.h - comparison of two meshes in memory: vertices, simplices of every dimension, and their groups.
*/
#pragma once
#include <unistd.h>
#include "mesh_test.h"

/* A file of its own for each rank that tests something alone; the caller removes it. */
static inline void test_path(const char *name, size_t size, char path[])
{
  (void)snprintf(path, size, "/tmp/sbmesh_%d_%d_%s", (int)getpid(), (int)test_rank, name);
}

/* The same path on all ranks. */
static inline PetscErrorCode test_path_of_all(const char *name, size_t size, char path[])
{
  int id = (int)getpid();

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Bcast(&id, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  (void)snprintf(path, size, "/tmp/sbmesh_all_%d_%s", id, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes a file, and the .xmf of an .h5. */
static inline void test_unlink(const char *path)
{
  char index[256];

  (void)snprintf(index, sizeof(index), "%.*s.xmf", (int)(strrchr(path, '.') - path), path);
  (void)unlink(path);
  (void)unlink(index);
}

static inline PetscErrorCode test_read(const char *path, PetscInt step, SbImport **im)
{
  SbBody body = test_body("b", path);

  PetscFunctionBeginUser;
  body.mesh_step = step;
  PetscCall(SbMeshFileRead(&body, NULL, NULL, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes, reads again and removes. */
static inline PetscErrorCode test_round(const SbImport *im, const char *name, SbMeshFormat format,
                                        SbImport **again)
{
  char path[256];

  PetscFunctionBeginUser;
  test_path(name, sizeof(path), path);
  PetscCall(SbMeshFileWrite(im, path, format));
  PetscCall(test_read(path, 0, again));
  test_unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names of the groups of an item, each with its dimension and number, in alphabetical order. */
static inline void test_groups_of(const SbImport *im, int dim, PetscInt i, size_t size, char text[])
{
  const PetscInt tags = im->item[dim].tags[i];
  PetscInt group[32], n = 0;

  text[0] = 0;
  for (PetscInt k = im->tags_start[tags]; k < im->tags_start[tags + 1] && n < 32; k++) {
    PetscInt at = n++;

    for (; at > 0 && strcmp(im->group[group[at - 1]].name, im->group[im->tags_group[k]].name) > 0; at--)
      group[at] = group[at - 1];
    group[at] = im->tags_group[k];
  }
  for (PetscInt k = 0; k < n; k++) {
    const SbGroup *g = &im->group[group[k]];
    const size_t used = strlen(text);

    (void)snprintf(text + used, size - used, "%s%d %lld %s", k ? ", " : "", (int)g->dim, (long long)g->tag,
                   g->name);
  }
}

static inline void test_same_items(const SbImport *a, const SbImport *b, int dim, const char *what)
{
  const SbItems *p = &a->item[dim], *q = &b->item[dim];

  SB_CHECK(p->n == q->n, "%s: %d and %d items of dimension %d", what, (int)p->n, (int)q->n, dim);
  for (PetscInt i = 0; i < PetscMin(p->n, q->n); i++) {
    char of_a[1024], of_b[1024];

    test_groups_of(a, dim, i, sizeof(of_a), of_a);
    test_groups_of(b, dim, i, sizeof(of_b), of_b);
    if (strcmp(of_a, of_b)) {
      SB_CHECK(0, "%s: item %d of dimension %d is in '%s' and in '%s'", what, (int)i, dim, of_a, of_b);
      return;
    }
    if (memcmp(p->vert + (dim + 1) * i, q->vert + (dim + 1) * i, (size_t)(dim + 1) * sizeof(PetscInt))) {
      SB_CHECK(0, "%s: item %d of dimension %d has other vertices", what, (int)i, dim);
      return;
    }
  }
  SB_CHECK(1, "all items of dimension %d", dim);
}

static inline void test_same(const SbImport *a, const SbImport *b, const char *what)
{
  SB_CHECK(a->nvert == b->nvert, "%s: %d and %d vertices", what, (int)a->nvert, (int)b->nvert);
  SB_CHECK(a->nvert == b->nvert && !memcmp(a->x, b->x, 3 * (size_t)a->nvert * sizeof(PetscReal)),
           "%s: other coordinates", what);
  for (int d = 0; d < 4; d++) test_same_items(a, b, d, what);
  SB_CHECK(a->nmiddle.n == b->nmiddle.n, "%s: %d and %d curved edges", what, (int)a->nmiddle.n,
           (int)b->nmiddle.n);
  for (PetscInt i = 0; i < PetscMin(a->nmiddle.n, b->nmiddle.n); i++) {
    const SbMiddle *p = &a->middle[i], *q = &b->middle[i];
    PetscBool same = (PetscBool)(p->end[0] == q->end[0] && p->end[1] == q->end[1]);

    for (int k = 0; k < 3; k++) same = (PetscBool)(same && PetscAbsReal(p->off[k] - q->off[k]) < 1e-15);
    if (!same) {
      SB_CHECK(0, "%s: another curved edge %d", what, (int)i);
      return;
    }
  }
}
