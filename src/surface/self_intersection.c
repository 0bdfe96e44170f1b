/*
  self_intersection.c - detects intersections of the triangles of a surface beyond shared corners,
  and removes small ones by smoothing.

  Candidate pairs by a bounding volume hierarchy, exact test in src/geometry/intersection.c.
*/
#include "surface_impl.h"

#define NAMED 3   /* largest number of pairs in a message */
#define PASSES 60 /* largest number of smoothing passes */
#define FEW 0.02  /* largest fraction of intersecting triangles that is smoothed */

/* Pairs of triangles that intersect. */
typedef struct {
  PetscInt n; /* number of pairs found */
  PetscInt pair[NAMED][2];
  PetscBool *crossing; /* [ntri] triangle intersects another one */
} Search;

/* Finds all pairs; *s has crossing[] allocated. */
static PetscErrorCode find_pairs(const SbTriangles *t, Search *s)
{
  SbBoxTree tree;

  PetscFunctionBeginUser;
  s->n = 0;
  PetscCall(PetscArrayzero(s->crossing, t->ntri));
  PetscCall(SbBoxTreeCreateTriangles(t->ntri, t->tri, t->x, &tree));
  for (PetscInt i = 0, other; i < t->ntri; i++) {
    SbBoxNearest query;
    PetscReal box[6];

    SbTriangleBox(t->x, t->tri + 3 * i, box);
    for (SbBoxNearestBegin(&tree, box, 0, &query); SbBoxNearestNext(&query, &other);) {
      if (other <= i || !SbTrianglesCross(t->x, t->tri + 3 * i, t->tri + 3 * other))
        continue;
      if (s->n < NAMED)
        PetscCall(PetscArraycpy(s->pair[s->n], ((const PetscInt[2]){i, other}), 2));
      s->crossing[i] = s->crossing[other] = PETSC_TRUE;
      s->n++;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Laplacian smoothing: active vertices move halfway to the mean of their neighbours. Work space:
   sum. */
static void smooth(SbTriangles *t, const PetscBool active[], PetscReal (*sum)[4])
{
  for (PetscInt v = 0; v < t->nvert; v++)
    sum[v][0] = sum[v][1] = sum[v][2] = sum[v][3] = 0;
  for (PetscInt i = 0; i < 3 * t->ntri; i++) {
    const PetscInt a = t->tri[i];
    const PetscInt b = t->tri[SbSlotNext(i)];

    for (int k = 0; k < 3; k++) {
      sum[a][k] += t->x[3 * b + k];
      sum[b][k] += t->x[3 * a + k];
    }
    sum[a][3]++;
    sum[b][3]++;
  }
  for (PetscInt v = 0; v < t->nvert; v++)
    for (int k = 0; active[v] && k < 3; k++)
      t->x[3 * v + k] = 0.5 * t->x[3 * v + k] + 0.5 * sum[v][k] / sum[v][3];
}

/* Smooths around intersecting triangles until there are none, with displacements up to `reach`, m;
   else restores positions. s: pairs before, then remaining pairs. */
static PetscErrorCode untangle(SbTriangles *t, PetscReal reach, Search *s, SbSurfaceRepairs *m)
{
  PetscBool *active, *before;
  PetscReal *x0, (*sum)[4];

  PetscFunctionBeginUser;
  PetscCall(
    PetscCalloc4(t->nvert, &active, t->nvert, &before, 3 * (size_t)t->nvert, &x0, t->nvert, &sum));
  PetscCall(PetscArraycpy(x0, t->x, 3 * (size_t)t->nvert));
  for (int pass = 0; pass < PASSES && s->n && m->untangled <= reach; pass++) {
    PetscReal most = 0;

    // activate the vertices of intersecting triangles; in every fourth pass also adjacent vertices
    for (PetscInt i = 0; i < 3 * t->ntri; i++)
      active[t->tri[i]] = (PetscBool)(active[t->tri[i]] || s->crossing[i / 3]);
    PetscCall(PetscArraycpy(before, active, t->nvert));
    for (PetscInt f = 0; f < t->ntri && pass % 4 == 3; f++) {
      const PetscInt *v = t->tri + 3 * f;

      if (before[v[0]] || before[v[1]] || before[v[2]])
        active[v[0]] = active[v[1]] = active[v[2]] = PETSC_TRUE;
    }
    smooth(t, active, sum);
    m->nuntangled = 0;
    for (PetscInt v = 0; v < t->nvert; v++) {
      const PetscReal d2 = SbDistance2(t->x + 3 * v, x0 + 3 * v);

      m->nuntangled += d2 > 0;
      most = PetscMax(most, d2);
    }
    m->untangled = PetscSqrtReal(most);
    PetscCall(find_pairs(t, s));
  }
  if (s->n || m->untangled > reach)
    PetscCall(PetscArraycpy(t->x, x0, 3 * (size_t)t->nvert));
  PetscCall(PetscFree4(active, before, x0, sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfaceUntangle(SbTriangleFile *f, PetscReal reach, SbSurfaceRepairs *m)
{
  SbTriangles *t = f->t;
  Search search, left;
  PetscInt ncrossing = 0;
  char why[192] = "";
  char option[SB_IMPORT_OPTION_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(t->ntri, &search.crossing));
  PetscCall(find_pairs(t, &search));
  for (PetscInt i = 0; i < t->ntri; i++)
    ncrossing += search.crossing[i];
  m->npairs = search.n;
  left = search;
  if (search.n && (PetscReal)ncrossing > FEW * (PetscReal)t->ntri)
    (void)snprintf(why, sizeof(why),
                   "with %" PetscInt_FMT " of %" PetscInt_FMT " triangles it is no small fold",
                   ncrossing, t->ntri);
  else if (search.n && reach > 0) {
    PetscCall(untangle(t, reach, &left, m));
    if (left.n || m->untangled > reach)
      (void)snprintf(why, sizeof(why), "smoothing did not part them within %.3g m (%s)",
                     (double)reach, SbImportOption(f->im, "untangle", option));
  } else if (search.n)
    (void)snprintf(why, sizeof(why), "%s 0 forbids to smooth it",
                   SbImportOption(f->im, "untangle", option));
  PetscCall(PetscFree(search.crossing));
  if (why[0]) {
    const PetscReal *x = t->x + 3 * t->tri[3 * search.pair[0][0]];
    char text[256] = "";

    // message: some of the pairs, and the position of the first one
    for (PetscInt k = 0; k < PetscMin(search.n, NAMED); k++)
      SbAppend(sizeof(text), text, "%s%lld and %lld", k ? ", " : "",
               (long long)f->number[search.pair[k][0]], (long long)f->number[search.pair[k][1]]);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
            "%s: the surface cuts or touches itself at %" PetscInt_FMT
            " pair%s of triangles: %s%s, near (%.6g, %.6g, %.6g) m; %s; join the parts into one "
            "(meshlab, "
            "blender: boolean union), or move them apart",
            f->where, search.n, search.n == 1 ? "" : "s", text, search.n > NAMED ? ", ..." : "",
            (double)x[0], (double)x[1], (double)x[2], why);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
