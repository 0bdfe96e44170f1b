/*
  clean.c - repair of small defects of a surface: nearly coincident vertices, duplicate and degenerate triangles; detection of open edges.

  Repaired, counted and reported: vertices within a tolerance are merged, transitively, at the position of the first one; triangles that thereby
  collapse, and duplicates, are removed. Two coincident triangles with opposite orientation become one wall between two regions. For a
  triangle with collinear corners, the neighbour at its longest edge is divided at the opposite corner, so that the shape is unchanged. Open edges are an error.
*/
#include "sbkernel.h"
#include "surface_impl.h"

#define PASSES 20         /* passes over flat triangles: one may be adjacent to another */
#define PARTNERS_MAX 4000 /* largest number of open edges for the search for matching edges */

static PetscReal distance2(const SbTriangles *t, PetscInt v, PetscInt w)
{
  const PetscReal *a = t->x + 3 * v, *b = t->x + 3 * w, d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};

  return SbDot3(d, d);
}

/* ------------------------------------------------------------------ duplicate triangles */

/* Removes the triangles that are not marked. */
static PetscErrorCode keep_triangles(SbTriangleFile *f, const PetscBool keep[])
{
  SbTriangles *t = f->t;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < t->ntri; i++) {
    if (!keep[i]) continue;
    PetscCall(PetscArraymove(t->tri + 3 * n, t->tri + 3 * i, 3));
    f->tags[n] = f->tags[i];
    f->number[n++] = f->number[i];
  }
  t->ntri = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscInt vert[3]; /* ascending */
  PetscInt triangle;
  PetscBool odd; /* the corners are an odd permutation of vert[] */
} Triple;

/* Keeps the first of several triangles with the same corners, with the groups of all of them. */
static PetscErrorCode drop_doubled(SbTriangleFile *f, PetscBool keep[], SbSurfaceRepairs *m)
{
  SbTriangles *t = f->t;
  Triple *triple;

  PetscFunctionBeginUser;
  if (!t->ntri) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(t->ntri, &triple));
  for (PetscInt i = 0; i < t->ntri; i++) {
    const PetscInt *v = t->tri + 3 * i;
    const int low = v[0] < v[1] ? (v[0] < v[2] ? 0 : 2) : (v[1] < v[2] ? 1 : 2);
    const PetscInt p = v[(low + 1) % 3], q = v[(low + 2) % 3];

    triple[i] = (Triple){{v[low], PetscMin(p, q), PetscMax(p, q)}, i, (PetscBool)(p > q)};
    keep[i] = PETSC_TRUE;
  }
  PetscCall(SbSortByKeys(t->ntri, sizeof(*triple), 4, triple));
  for (PetscInt i = 0, n; i < t->ntri; i += n) {
    PetscBool wall = PETSC_FALSE;

    for (n = 1; i + n < t->ntri && !memcmp(triple[i].vert, triple[i + n].vert, sizeof(triple[i].vert)); n++) {
      keep[triple[i + n].triangle] = PETSC_FALSE;
      wall = (PetscBool)(wall || triple[i + n].odd != triple[i].odd);
      // union of the groups
      if (f->tags[triple[i].triangle] != f->tags[triple[i + n].triangle]) {
        const SbImport *im = f->im;
        PetscInt group[64], ngroup = 0;

        for (PetscInt j = i; j <= i + n; j += n) {
          const PetscInt set = f->tags[triple[j].triangle];

          for (PetscInt k = im->tags_start[set]; k < im->tags_start[set + 1] && ngroup < 64; k++)
            group[ngroup++] = im->tags_group[k];
        }
        PetscCall(SbImportTagSet(f->im, ngroup, group, &f->tags[triple[i].triangle]));
      }
    }
    m->nwall += wall;
    m->ndoubled += n - 1 - wall;
  }
  PetscCall(keep_triangles(f, keep));
  PetscCall(PetscFree(triple));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfaceMergeVertices(SbTriangleFile *f, PetscReal tolerance, SbSurfaceRepairs *m)
{
  SbTriangles *t = f->t;
  PetscInt *first;
  PetscBool *keep;
  PetscReal moved2 = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(t->nvert, &first, t->ntri, &keep));
  PetscCall(SbWeld(t->nvert, t->x, tolerance, PETSC_TRUE, first));
  for (PetscInt v = 0; v < t->nvert; v++) {
    const PetscReal d2 = distance2(t, v, first[v]);

    moved2 = PetscMax(moved2, d2);
    m->nwelded += d2 > 0; /* exactly coincident vertices are not counted */
  }
  for (PetscInt i = 0; i < t->ntri; i++) {
    PetscInt *v = t->tri + 3 * i;

    for (int k = 0; k < 3; k++) v[k] = first[v[k]];
    keep[i] = (PetscBool)(v[0] != v[1] && v[1] != v[2] && v[2] != v[0]);
    m->ncollapsed += !keep[i];
  }
  m->tolerance = tolerance;
  m->moved = PetscSqrtReal(moved2);
  PetscCall(keep_triangles(f, keep));
  PetscCall(drop_doubled(f, keep, m));
  PetscCall(PetscFree2(first, keep));
  PetscCall(SbDropUnusedPoints(&t->nvert, t->x, 3 * t->ntri, t->tri));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ flat triangles */

/* Longest edge of a triangle. */
static int longest_edge(const SbTriangles *t, PetscInt f)
{
  const PetscInt *v = t->tri + 3 * f;
  PetscReal most = -1;
  int edge = 0;

  for (int k = 0; k < 3; k++) {
    const PetscReal l2 = distance2(t, v[k], v[(k + 1) % 3]);

    if (l2 > most) {
      most = l2;
      edge = k;
    }
  }
  return edge;
}

/* One pass over the edges that removes flat triangles; each triangle is changed at most once per pass. */
static PetscErrorCode cut_flat(SbTriangleFile *f, PetscBool touched[], SbKey edge[], PetscInt *ncut,
                               PetscInt *nflat)
{
  SbTriangles *t = f->t;
  const PetscInt n = 3 * t->ntri;
  PetscBool *flat;
  PetscReal longest2, around;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(t->ntri, &flat));
  *ncut = *nflat = 0;
  for (PetscInt i = 0; i < t->ntri; i++) {
    flat[i] = (PetscBool) !(SbTriangleMeasure(t, i, &longest2, &around) > SB_TRIANGLE_FLAT * longest2);
    *nflat += flat[i];
    touched[i] = PETSC_FALSE;
  }
  if (*nflat) SbTrianglesEdges(t, edge);
  for (PetscInt i = 0, m; *nflat && i < n; i += m) {
    m = SbKeysAlike(n, edge, i);
    for (PetscInt k = 0; m == 2 && k < 2; k++) {
      const PetscInt mine = edge[i + k].slot / 3, other = edge[i + 1 - k].slot / 3;
      const int e = (int)(edge[i + k].slot % 3), j = (int)(edge[i + 1 - k].slot % 3);
      PetscInt middle, *v, *w, a, b, c;

      if (!flat[mine] || touched[mine] || touched[other] || e != longest_edge(t, mine)) continue;
      /* neighbour (a, b, c) at the longest edge (a, b), on which the third corner of the flat triangle lies: the two
         become (a, middle, c) and (middle, b, c) */
      middle = t->tri[3 * mine + (e + 2) % 3];
      v = f->t->tri + 3 * other;
      w = f->t->tri + 3 * mine;
      a = v[j];
      b = v[(j + 1) % 3];
      c = v[(j + 2) % 3];
      v[0] = a;
      v[1] = middle;
      v[2] = c;
      w[0] = middle;
      w[1] = b;
      w[2] = c;
      f->number[mine] = f->number[other];
      f->tags[mine] = f->tags[other];
      touched[mine] = touched[other] = PETSC_TRUE;
      (*ncut)++;
    }
  }
  PetscCall(PetscFree(flat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ open edges */

/* Vertex of an edge: its first (0) or second (1). */
static PetscInt edge_end(const SbTriangles *t, PetscInt slot, int end)
{
  return t->tri[end ? (slot % 3 == 2 ? slot - 2 : slot + 1) : slot];
}

/* Smallest tolerance with which each open edge coincides with another one; 0 if it is too large to be due to rounding. */
static PetscReal partner_distance(const SbTriangles *t, PetscInt n, const PetscInt slot[])
{
  PetscReal need = 0, edge = 0;

  if (n > PARTNERS_MAX) return 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt a = edge_end(t, slot[i], 0), b = edge_end(t, slot[i], 1);
    PetscReal least = PETSC_MAX_REAL;

    edge += PetscSqrtReal(distance2(t, a, b)) / (PetscReal)n;
    for (PetscInt j = 0; j < n; j++) {
      const PetscInt c = edge_end(t, slot[j], 0), d = edge_end(t, slot[j], 1);
      const PetscReal against = PetscMax(distance2(t, a, d), distance2(t, b, c)),
                      along = PetscMax(distance2(t, a, c), distance2(t, b, d));

      if (i != j) least = PetscMin(least, PetscMin(against, along));
    }
    need = PetscMax(need, PetscSqrtReal(least));
  }
  return need < 0.25 * edge ? need : 0;
}

PetscErrorCode SbSurfaceRepairTriangles(SbTriangleFile *f, SbSurfaceRepairs *repairs)
{
  const SbTriangles *t = f->t;
  const PetscInt n = 3 * t->ntri;
  SbKey *edge;
  PetscBool *touched;
  PetscInt *slot, nopen = 0, first, ncut = 1, nflat = 1;
  PetscReal need, longest2, around;
  const PetscReal *a, *b;
  char option[SB_IMPORT_OPTION_MAX], what[256] = "close the holes (meshlab: close holes; blender: fill)";

  PetscFunctionBeginUser;
  // remove flat triangles as far as possible
  PetscCall(PetscMalloc3(n, &edge, t->ntri, &touched, n, &slot));
  for (int pass = 0; pass < PASSES && ncut; pass++) {
    PetscCall(cut_flat(f, touched, edge, &ncut, &nflat));
    repairs->nflat += ncut;
  }
  // open edges: edges of one triangle only
  SbTrianglesEdges(t, edge);
  for (PetscInt i = 0, m; i < n; i += m) {
    m = SbKeysAlike(n, edge, i);
    if (m == 1) slot[nopen++] = edge[i].slot;
  }
  PetscCall(PetscSortInt(nopen, slot));
  first = nopen ? slot[0] : 0;
  need = partner_distance(t, nopen, slot);
  PetscCall(PetscFree3(edge, touched, slot));
  for (PetscInt i = 0; nflat && i < t->ntri; i++) {
    const PetscReal *x = t->x + 3 * t->tri[3 * i];

    PetscCheck(
      SbTriangleMeasure(t, i, &longest2, &around) > SB_TRIANGLE_FLAT * longest2, PETSC_COMM_SELF,
      PETSC_ERR_USER_INPUT,
      "%s: triangle %lld at (%.6g, %.6g, %.6g) m has no area (of %" PetscInt_FMT
      " such ones), and no neighbour that could take it in; remove it (meshlab: remove degenerate faces)",
      f->where, (long long)f->number[i], (double)x[0], (double)x[1], (double)x[2], nflat);
  }
  if (!nopen) PetscFunctionReturn(PETSC_SUCCESS);
  // error message: the first open edge, and the merge tolerance that would close the surface, if there is one
  a = t->x + 3 * edge_end(t, first, 0);
  b = t->x + 3 * edge_end(t, first, 1);
  if (need > 0 && f->body)
    (void)snprintf(
      what, sizeof(what),
      "every open edge has a partner within %.3g m: %s %.2g joins them, if that is rounding and not shape",
      (double)need, SbImportOption(f->im, "merge_tolerance", option), (double)(1.1 * need));
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "%s: the surface is open: %" PetscInt_FMT
          " edges have a triangle on one side only, the first is that of triangle %lld from (%.6g, %.6g, "
          "%.6g) to (%.6g, %.6g, %.6g) m; %s",
          f->where, nopen, (long long)f->number[first / 3], (double)a[0], (double)a[1], (double)a[2],
          (double)b[0], (double)b[1], (double)b[2], what);
}
