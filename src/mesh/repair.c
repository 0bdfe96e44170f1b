/*
  repair.c - makes a mesh that a run accepts, where dropping, turning and welding can do it.

  In this order: vertices closer than a tolerance become one (a hash of cubes; each vertex joins the first one before it
  within reach); tets that then use a vertex twice are dropped, these are collapsed and leave no gap; so are further copies of
  a tet, whose groups go to the first; flat tets are dropped, which leaves a slit without width where they had a neighbour at
  every face, and these are counted; inverted tets are turned; triangles and lines of groups that collapsed, came again or are no face of a
  tet, and unused vertices, are dropped. The check of a run has the last word: what overlaps cannot be repaired here.
*/
#include "mesh_impl.h"

/* ------------------------------------------------------------------ welding */

/* Chains of vertices by the cube that they lie in. */
typedef struct {
  PetscReal origin[3], h;
  uint64_t mask;
  PetscInt *head, *next;
} Cubes;

static uint64_t cube_hash(const Cubes *cubes, const int64_t at[3])
{
  uint64_t key = (uint64_t)at[0] * 0x9e3779b97f4a7c15u;

  key = (key ^ (uint64_t)at[1]) * 0xc2b2ae3d27d4eb4fu;
  key = (key ^ (uint64_t)at[2]) * 0x165667b19e3779f9u;
  return (key ^ key >> 32) & cubes->mask;
}

static inline int64_t cube_of(const Cubes *cubes, int i, PetscReal x)
{
  return (int64_t)floor((x - cubes->origin[i]) / cubes->h);
}

/* A vertex in the cubes within reach of x, -1 when there is none. */
static PetscInt find_near(const Cubes *cubes, const PetscReal x[], const PetscReal p[3], PetscReal reach)
{
  int64_t low[3], high[3], at[3];

  for (int i = 0; i < 3; i++) {
    low[i] = cube_of(cubes, i, p[i] - reach);
    high[i] = cube_of(cubes, i, p[i] + reach);
  }
  for (at[0] = low[0]; at[0] <= high[0]; at[0]++)
    for (at[1] = low[1]; at[1] <= high[1]; at[1]++)
      for (at[2] = low[2]; at[2] <= high[2]; at[2]++)
        for (PetscInt v = cubes->head[cube_hash(cubes, at)]; v >= 0; v = cubes->next[v]) {
          const PetscReal *q = x + 3 * v, d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};

          if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= reach * reach) return v;
        }
  return -1;
}

/* Lets items use the first of the vertices that lie together. Those left over are unused from then on. */
static PetscErrorCode weld(SbImport *im, PetscReal tolerance, SbRepair *done)
{
  Cubes cubes;
  PetscReal diagonal;
  PetscInt *map;
  PetscReal high[3];

  PetscFunctionBeginUser;
  // bounding box and its diagonal
  for (int i = 0; i < 3; i++) cubes.origin[i] = high[i] = im->nvert ? im->x[i] : 0;
  for (PetscInt v = 0; v < im->nvert; v++) {
    for (int i = 0; i < 3; i++) {
      cubes.origin[i] = PetscMin(cubes.origin[i], im->x[3 * v + i]);
      high[i] = PetscMax(high[i], im->x[3 * v + i]);
    }
  }
  diagonal = PetscSqrtReal((high[0] - cubes.origin[0]) * (high[0] - cubes.origin[0]) +
                           (high[1] - cubes.origin[1]) * (high[1] - cubes.origin[1]) +
                           (high[2] - cubes.origin[2]) * (high[2] - cubes.origin[2]));
  done->merge_tolerance = tolerance < 0 ? 1e-9 * diagonal : tolerance;
  if (done->merge_tolerance == 0 || !(diagonal > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  cubes.h = PetscMax(4 * done->merge_tolerance, diagonal / (1 + cbrt((double)im->nvert)));
  for (cubes.mask = 1; cubes.mask < (uint64_t)im->nvert; cubes.mask *= 2) {
  }
  PetscCall(PetscMalloc3((size_t)cubes.mask, &cubes.head, im->nvert, &cubes.next, im->nvert, &map));
  for (uint64_t i = 0; i < cubes.mask; i++) cubes.head[i] = -1;
  cubes.mask--;
  for (PetscInt v = 0; v < im->nvert; v++) {
    const PetscReal *p = im->x + 3 * v;
    const PetscInt near = find_near(&cubes, im->x, p, done->merge_tolerance);

    map[v] = near < 0 ? v : near;
    if (near < 0) {
      const int64_t at[3] = {cube_of(&cubes, 0, p[0]), cube_of(&cubes, 1, p[1]), cube_of(&cubes, 2, p[2])};
      const uint64_t slot = cube_hash(&cubes, at);

      cubes.next[v] = cubes.head[slot];
      cubes.head[slot] = v;
    } else
      done->nwelded++;
  }
  for (int d = 0; d < 4; d++)
    for (PetscInt i = 0; i < (d + 1) * im->item[d].n; i++) im->item[d].vert[i] = map[im->item[d].vert[i]];
  PetscCall(PetscFree3(cubes.head, cubes.next, map));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ single items */

/* Keeps the items that are not marked. */
static PetscErrorCode drop_marked(SbItems *item, int dim, const PetscBool drop[], PetscInt *ndropped)
{
  PetscInt kept = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < item->n; i++) {
    if (drop[i]) continue;
    PetscCall(
      PetscArraymove(item->vert + (dim + 1) * (size_t)kept, item->vert + (dim + 1) * (size_t)i, dim + 1));
    item->tags[kept] = item->tags[i];
    item->number[kept++] = item->number[i];
  }
  *ndropped += item->n - kept;
  item->n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool collapsed(const PetscInt v[], int dim)
{
  for (int i = 0; i <= dim; i++)
    for (int j = 0; j < i; j++)
      if (v[i] == v[j]) return PETSC_TRUE;
  return PETSC_FALSE;
}

static PetscErrorCode drop_collapsed(SbImport *im, int dim, PetscInt *ndropped)
{
  SbItems *item = &im->item[dim];
  PetscBool *drop;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(item->n, &drop));
  for (PetscInt i = 0; i < item->n; i++) drop[i] = collapsed(item->vert + (dim + 1) * (size_t)i, dim);
  PetscCall(drop_marked(item, dim, drop, ndropped));
  PetscCall(PetscFree(drop));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ items that come again */

static PetscBool same_vertices(const PetscInt a[], const PetscInt b[], int dim)
{
  for (int i = 0; i <= dim; i++) {
    int j = 0;

    while (j <= dim && a[i] != b[j]) j++;
    if (j > dim) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The tag set with the groups of two. */
static PetscErrorCode join_tags(SbImport *im, PetscInt a, PetscInt b, PetscInt *joined)
{
  PetscInt *group, n = 0;

  PetscFunctionBeginUser;
  *joined = a;
  if (a == b) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * (size_t)im->ngroup, &group));
  for (PetscInt k = im->tags_start[a]; k < im->tags_start[a + 1]; k++) group[n++] = im->tags_group[k];
  for (PetscInt k = im->tags_start[b]; k < im->tags_start[b + 1]; k++) group[n++] = im->tags_group[k];
  PetscCall(SbImportTagSet(im, n, group, joined));
  PetscCall(PetscFree(group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the items by their lowest vertex and compares within each list; the first of equal ones stays. */
static PetscErrorCode drop_repeats(SbImport *im, int dim, PetscInt *ndropped)
{
  SbItems *item = &im->item[dim];
  PetscInt *head, *next;
  PetscBool *drop;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(im->nvert, &head, item->n, &next));
  PetscCall(PetscCalloc1(item->n, &drop));
  for (PetscInt v = 0; v < im->nvert; v++) head[v] = -1;
  for (PetscInt i = 0; i < item->n; i++) {
    const PetscInt *v = item->vert + (dim + 1) * (size_t)i;
    PetscInt low = v[0], same;

    for (int a = 1; a <= dim; a++) low = PetscMin(low, v[a]);
    same = head[low];
    while (same >= 0 && !same_vertices(v, item->vert + (dim + 1) * (size_t)same, dim)) same = next[same];
    if (same >= 0) {
      drop[i] = PETSC_TRUE;
      PetscCall(join_tags(im, item->tags[same], item->tags[i], &item->tags[same]));
    } else {
      next[i] = head[low];
      head[low] = i;
    }
  }
  PetscCall(drop_marked(item, dim, drop, ndropped));
  PetscCall(PetscFree(drop));
  PetscCall(PetscFree2(head, next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ flat tets, and triangles that are no face */

static PetscErrorCode drop_flat(SbImport *im, SbRepair *done)
{
  SbItems *item = &im->item[3];
  PetscReal largest = 0, det;
  PetscBool *drop, any = PETSC_FALSE;
  SbFaces faces;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(item->n, &drop));
  for (PetscInt i = 0; i < 3 * im->nvert; i++) largest = PetscMax(largest, PetscAbsReal(im->x[i]));
  for (PetscInt c = 0; c < item->n; c++) {
    drop[c] = SbTetFlat(im->x, item->vert + 4 * c, largest, &det);
    any = (PetscBool)(any || drop[c]);
  }
  if (any) {
    PetscCall(SbFacesCreate(im->nvert, item->n, item->vert, &faces));
    for (PetscInt c = 0; c < item->n; c++) {
      const PetscInt *n = faces.neighbour + 4 * c;

      done->nslit += drop[c] && n[0] >= 0 && n[1] >= 0 && n[2] >= 0 && n[3] >= 0;
    }
    PetscCall(SbFacesDestroy(&faces));
    PetscCall(drop_marked(item, 3, drop, &done->nflat));
  }
  PetscCall(PetscFree(drop));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode drop_lost(SbImport *im, const SbFaces *faces)
{
  SbItems *item = &im->item[2];
  PetscBool *drop;
  PetscInt slots[2], ndropped = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(item->n, &drop));
  for (PetscInt t = 0; t < item->n; t++) drop[t] = (PetscBool)!SbFacesFind(faces, item->vert + 3 * t, slots);
  PetscCall(drop_marked(item, 2, drop, &ndropped));
  PetscCall(PetscFree(drop));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshFileRepair(SbImport *im, PetscReal tolerance, SbRepair *done)
{
  SbFaces faces;
  PetscErrorCode ierr;
  PetscInt turned, nitem = im->item[0].n + im->item[1].n + im->item[2].n, ndropped = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(done, sizeof(*done)));
  PetscCall(PetscMemzero(&faces, sizeof(faces)));
  PetscCall(weld(im, tolerance, done));
  PetscCall(drop_collapsed(im, 3, &done->ncollapsed));
  PetscCall(drop_repeats(im, 3, &done->nduplicate));
  for (int d = 0; d < 3; d++) {
    PetscCall(drop_collapsed(im, d, &ndropped));
    PetscCall(drop_repeats(im, d, &ndropped));
  }
  PetscCall(drop_flat(im, done));
  PetscCheck(
    im->item[3].n, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: nothing is left: every tetrahedron is flat or uses a vertex twice; check -merge_tolerance and the "
    "scale of the file",
    im->where);
  turned = im->nreoriented;
  ierr = SbImportCheck(im, &faces);
  done->nturned = im->nreoriented - turned;
  done->nunused = im->nunused - done->nwelded;
  if (!ierr) ierr = drop_lost(im, &faces);
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(ierr);
  for (PetscInt v = 0; v < im->nvert; v++) im->vert_number[v] = v + 1;
  done->nitem = nitem - im->item[0].n - im->item[1].n - im->item[2].n;
  im->nunused = im->nreoriented = im->nlost = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
