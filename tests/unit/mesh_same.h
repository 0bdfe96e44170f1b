/*
  mesh_same.h - comparison of two meshes in memory: vertices, simplices of every dimension, and
  their groups.
*/
#pragma once
#include "../file.h"
#include "mesh_test.h"

static char test_folder[512];

/* Path of a file of all ranks in a folder that is removed when the program ends. Collective. */
static inline PetscErrorCode test_path_of_all(const char *name, char path[512])
{
  PetscFunctionBeginUser;
  if (!test_folder[0])
    PetscCall(test_file_folder(test_folder));
  PetscCall(PetscSNPrintf(path, 512, "%s/%s", test_folder, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for a file of its own for each rank that tests something alone. */
static inline PetscErrorCode test_path(const char *name, char path[512])
{
  char own[64];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(own, sizeof(own), "%d_%s", (int)test_rank, name));
  PetscCall(test_path_of_all(own, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode test_free(SbImport **im)
{
  PetscFunctionBeginUser;
  PetscCall(SbImportDestroy(*im));
  PetscCall(PetscFree(*im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode test_read(const char *path, PetscInt step, SbImport **im)
{
  SbBody body = test_body("b", path);
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  body.mesh_step = step;
  PetscCall(PetscNew(im));
  ierr = SbImportRead(&body, *im);
  if (ierr)
    PetscCall(test_free(im));
  PetscFunctionReturn(ierr);
}

/* Writes and reads again. */
static inline PetscErrorCode test_round(const SbImport *im, const char *name, SbMeshFormat format,
                                        SbImport **again)
{
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_path(name, path));
  PetscCall(SbMeshFileWrite(im, path, format));
  PetscCall(test_read(path, 0, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names of the groups of an item, each with its dimension and number, in alphabetical order. */
static inline void test_groups_of(const SbImport *im, int dim, PetscInt i, size_t size, char text[])
{
  const PetscInt tags = im->item[dim].tags[i];
  PetscInt group[32];
  PetscInt n = 0;

  text[0] = 0;
  for (PetscInt k = im->tags_start[tags]; k < im->tags_start[tags + 1] && n < 32; k++) {
    PetscInt at = n++;

    for (; at > 0 && strcmp(im->group[group[at - 1]].name, im->group[im->tags_group[k]].name) > 0;
         at--)
      group[at] = group[at - 1];
    group[at] = im->tags_group[k];
  }
  for (PetscInt k = 0; k < n; k++) {
    const SbGroup *g = &im->group[group[k]];
    const size_t used = strlen(text);

    (void)snprintf(text + used, size - used, "%s%d %lld %s", k ? ", " : "", (int)g->dim,
                   (long long)g->tag, g->name);
  }
}

static inline void test_same_items(const SbImport *a, const SbImport *b, int dim, const char *what)
{
  const SbItems *p = &a->item[dim];
  const SbItems *q = &b->item[dim];

  SB_CHECK(p->n == q->n, "%s: %d and %d items of dimension %d", what, (int)p->n, (int)q->n, dim);
  for (PetscInt i = 0; i < PetscMin(p->n, q->n); i++) {
    char of_a[1024], of_b[1024];

    test_groups_of(a, dim, i, sizeof(of_a), of_a);
    test_groups_of(b, dim, i, sizeof(of_b), of_b);
    if (strcmp(of_a, of_b)) {
      SB_CHECK(0, "%s: item %d of dimension %d is in '%s' and in '%s'", what, (int)i, dim, of_a,
               of_b);
      return;
    }
    if (memcmp(p->vert + (dim + 1) * i, q->vert + (dim + 1) * i,
               (size_t)(dim + 1) * sizeof(PetscInt))) {
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
  for (int d = 0; d < 4; d++)
    test_same_items(a, b, d, what);
  SB_CHECK(a->nmiddle.n == b->nmiddle.n, "%s: %d and %d curved edges", what, (int)a->nmiddle.n,
           (int)b->nmiddle.n);
  for (PetscInt i = 0; i < PetscMin(a->nmiddle.n, b->nmiddle.n); i++) {
    const SbMiddle *p = &a->middle[i];
    const SbMiddle *q = &b->middle[i];
    PetscBool same = (PetscBool)(p->end[0] == q->end[0] && p->end[1] == q->end[1]);

    for (int k = 0; k < 3; k++)
      same = (PetscBool)(same && PetscAbsReal(p->off[k] - q->off[k]) < 1e-15);
    if (!same) {
      SB_CHECK(0, "%s: another curved edge %d", what, (int)i);
      return;
    }
  }
}
