/*
  clean.c - repair of small defects of a surface: nearly coincident vertices, duplicate and
  degenerate triangles; detection of open edges.

  Repaired, counted and reported: vertices within a tolerance are merged, transitively, at the
  position of the first one; triangles that thereby collapse, and duplicates, are removed. Two
  coincident triangles with opposite orientation become one wall between two regions. For a triangle
  with collinear corners, the neighbour at its longest edge is divided at the opposite corner, so
  that the shape is unchanged. Open edges are an error.
*/
#include "surface_impl.h"

#define PASSES 20         /* passes over flat triangles: one may be adjacent to another */
#define PARTNERS_MAX 4000 /* largest number of open edges for the search for matching edges */

static PetscReal distance2(const SbTriangles *t, PetscInt v, PetscInt w)
{
  return SbDistance2(t->x + 3 * v, t->x + 3 * w);
}

/* A triangle in the search for duplicates. */
typedef struct {
  PetscInt vert[3]; /* ascending */
  PetscInt triangle;
  PetscBool odd; /* the corners are an odd permutation of vert[] */
} Triple;

PetscErrorCode SbSurfaceMergeVertices(SbTriangleFile *f, PetscReal tolerance, SbSurfaceRepairs *m)
{
  SbTriangles *t = f->t;
  PetscInt *first;
  PetscInt ntriple = 0;
  PetscInt kept = 0;
  PetscBool *keep;
  Triple *triple;
  PetscReal moved2 = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(t->nvert, &first, t->ntri, &keep, t->ntri, &triple));
  PetscCall(SbWeld(t->nvert, t->x, tolerance, PETSC_TRUE, first));
  for (PetscInt v = 0; v < t->nvert; v++) {
    const PetscReal d2 = distance2(t, v, first[v]);

    moved2 = PetscMax(moved2, d2);
    m->nwelded += d2 > 0; /* exactly coincident vertices are not counted */
  }
  m->tolerance = tolerance;
  m->moved = PetscSqrtReal(moved2);

  // triangles that have not collapsed, sorted by their corners
  for (PetscInt i = 0; i < t->ntri; i++) {
    PetscInt *v = t->tri + 3 * i;
    PetscInt p, q;
    int low;

    for (int k = 0; k < 3; k++)
      v[k] = first[v[k]];
    keep[i] = (PetscBool)(v[0] != v[1] && v[1] != v[2] && v[2] != v[0]);
    m->ncollapsed += !keep[i];
    if (!keep[i])
      continue;
    low = v[0] < v[1] ? 0 : 1;
    if (v[low] >= v[2])
      low = 2;
    p = v[(low + 1) % 3];
    q = v[(low + 2) % 3];
    triple[ntriple++] = (Triple){{v[low], PetscMin(p, q), PetscMax(p, q)}, i, (PetscBool)(p > q)};
  }
  PetscCall(SbSortByKeys(ntriple, sizeof(*triple), 4, triple));

  // of several with the same corners the first stays, with the groups of all of them
  for (PetscInt i = 0, n; i < ntriple; i += n) {
    PetscBool wall = PETSC_FALSE;

    for (n = 1;
         i + n < ntriple && !memcmp(triple[i].vert, triple[i + n].vert, sizeof(triple[i].vert));
         n++) {
      PetscInt *tags = &f->tags[triple[i].triangle];
      PetscInt group[64];
      PetscInt ngroup = 0;
      const PetscInt other = triple[i + n].triangle;
      const PetscInt sets[2] = {*tags, f->tags[other]};

      keep[other] = PETSC_FALSE;
      wall = (PetscBool)(wall || triple[i + n].odd != triple[i].odd);
      if (sets[0] == sets[1])
        continue;
      for (int j = 0; j < 2; j++)
        for (PetscInt k = f->im->tags_start[sets[j]];
             k < f->im->tags_start[sets[j] + 1] && ngroup < 64; k++)
          group[ngroup++] = f->im->tags_group[k];
      PetscCall(SbImportTagSet(f->im, ngroup, group, tags));
    }
    m->nwall += wall;
    m->ndoubled += n - 1 - wall;
  }
  for (PetscInt i = 0; i < t->ntri; i++) {
    if (!keep[i])
      continue;
    PetscCall(PetscArraymove(t->tri + 3 * kept, t->tri + 3 * i, 3));
    f->tags[kept] = f->tags[i];
    f->number[kept++] = f->number[i];
  }
  t->ntri = kept;
  PetscCall(PetscFree3(first, keep, triple));
  PetscCall(SbDropUnusedPoints(&t->nvert, t->x, 3 * t->ntri, t->tri));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Longest edge of a triangle, the first of equal ones. */
static int longest_edge(const SbTriangles *t, PetscInt f)
{
  PetscReal l2[3];

  for (int k = 0; k < 3; k++)
    l2[k] = distance2(t, t->tri[3 * f + k], t->tri[SbSlotNext(3 * f + k)]);
  return l2[2] > PetscMax(l2[0], l2[1]) ? 2 : l2[1] > l2[0];
}

/* One pass over the edges that removes flat triangles; each triangle is changed at most once per
   pass. */
static PetscErrorCode cut_flat(SbTriangleFile *f, SbKey edge[], PetscInt *ncut, PetscInt *nflat)
{
  SbTriangles *t = f->t;
  const PetscInt n = 3 * t->ntri;
  PetscBool *flat, *touched;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(t->ntri, &flat, t->ntri, &touched));
  *ncut = *nflat = 0;
  for (PetscInt i = 0; i < t->ntri; i++) {
    (void)SbTriangleArea(t->x, t->tri + 3 * i, &flat[i]);
    *nflat += flat[i];
  }
  if (*nflat)
    SbTrianglesEdges(t, edge);
  for (PetscInt i = 0, m; *nflat && i < n; i += m) {
    m = SbKeysAlike(n, edge, i);
    for (PetscInt k = 0; m == 2 && k < 2; k++) {
      const PetscInt slot = edge[i + k].slot;
      const PetscInt across = edge[i + 1 - k].slot;
      const PetscInt mine = slot / 3;
      const PetscInt other = across / 3;
      PetscInt middle, a, b, c;

      if (!flat[mine] || touched[mine] || touched[other] || slot % 3 != longest_edge(t, mine))
        continue;

      /* neighbour (a, b, c) at the longest edge (a, b), on which the third corner of the flat
         triangle lies: the two become (a, middle, c) and (middle, b, c) */
      middle = t->tri[SbSlotNext(SbSlotNext(slot))];
      a = t->tri[across];
      b = t->tri[SbSlotNext(across)];
      c = t->tri[SbSlotNext(SbSlotNext(across))];
      PetscCall(PetscArraycpy(t->tri + 3 * other, ((const PetscInt[3]){a, middle, c}), 3));
      PetscCall(PetscArraycpy(t->tri + 3 * mine, ((const PetscInt[3]){middle, b, c}), 3));
      f->number[mine] = f->number[other];
      f->tags[mine] = f->tags[other];
      touched[mine] = touched[other] = PETSC_TRUE;
      (*ncut)++;
    }
  }
  PetscCall(PetscFree2(flat, touched));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smallest tolerance with which each open edge has a partner; 0 if it is too large for rounding. */
static PetscReal partner_distance(const SbTriangles *t, PetscInt n, const PetscInt slot[])
{
  PetscReal need = 0;
  PetscReal edge = 0;

  if (n > PARTNERS_MAX)
    return 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt a = t->tri[slot[i]];
    const PetscInt b = t->tri[SbSlotNext(slot[i])];
    PetscReal least = PETSC_MAX_REAL;

    edge += PetscSqrtReal(distance2(t, a, b)) / (PetscReal)n;
    for (PetscInt j = 0; j < n; j++) {
      const PetscInt c = t->tri[slot[j]];
      const PetscInt d = t->tri[SbSlotNext(slot[j])];
      const PetscReal against = PetscMax(distance2(t, a, d), distance2(t, b, c));
      const PetscReal along = PetscMax(distance2(t, a, c), distance2(t, b, d));

      if (i != j)
        least = PetscMin(least, PetscMin(against, along));
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
  PetscInt *slot;
  PetscInt nopen = 0;
  PetscInt first;
  PetscInt ncut = 1;
  PetscInt nflat = 1;
  PetscReal need;
  const PetscReal *a, *b;
  char option[SB_IMPORT_OPTION_MAX];
  char what[256] = "close the holes (meshlab: close holes; blender: fill)";

  PetscFunctionBeginUser;

  // remove flat triangles as far as possible
  PetscCall(PetscMalloc2(n, &edge, n, &slot));
  for (int pass = 0; pass < PASSES && ncut; pass++) {
    PetscCall(cut_flat(f, edge, &ncut, &nflat));
    repairs->nflat += ncut;
  }

  // open edges: edges of one triangle only
  SbTrianglesEdges(t, edge);
  for (PetscInt i = 0, m; i < n; i += m) {
    m = SbKeysAlike(n, edge, i);
    if (m == 1)
      slot[nopen++] = edge[i].slot;
  }
  PetscCall(PetscSortInt(nopen, slot));
  first = nopen ? slot[0] : 0;
  need = partner_distance(t, nopen, slot);
  PetscCall(PetscFree2(edge, slot));
  for (PetscInt i = 0; nflat && i < t->ntri; i++) {
    const PetscReal *x = t->x + 3 * t->tri[3 * i];
    PetscBool flat;

    (void)SbTriangleArea(t->x, t->tri + 3 * i, &flat);
    PetscCheck(!flat, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: triangle %lld at (%.6g, %.6g, %.6g) m has no area (of %" PetscInt_FMT
               " such ones), and no neighbour that could take it in; remove it (meshlab: remove "
               "degenerate faces)",
               f->where, (long long)f->number[i], (double)x[0], (double)x[1], (double)x[2], nflat);
  }
  if (!nopen)
    PetscFunctionReturn(PETSC_SUCCESS);

  // error message: the first open edge, and the merge tolerance that would close the surface, if
  // there is one
  a = t->x + 3 * t->tri[first];
  b = t->x + 3 * t->tri[SbSlotNext(first)];
  if (need > 0 && f->body)
    (void)snprintf(what, sizeof(what),
                   "every open edge has a partner within %.3g m: %s %.2g joins them, if that is "
                   "rounding and not shape",
                   (double)need, SbImportOption(f->im, "merge_tolerance", option),
                   (double)(1.1 * need));
  SETERRQ(
    PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: the surface is open: %" PetscInt_FMT
    " edges have a triangle on one side only, the first is that of triangle %lld from (%.6g, %.6g, "
    "%.6g) to (%.6g, %.6g, %.6g) m; %s",
    f->where, nopen, (long long)f->number[first / 3], (double)a[0], (double)a[1], (double)a[2],
    (double)b[0], (double)b[1], (double)b[2], what);
}
