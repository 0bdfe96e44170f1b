/*
  detect.c - contact detection on one rank: boxes of facets and points, candidates by a tree of boxes or by trial of all, then near.c.

  A box holds its facet at the end and, when the motion is examined, at the start of the step, and so everything in between: corners
  move on straight lines. Two that come within the reach, or cross, have boxes that meet.
*/
#include "detect.h"
#include "sblog.h"

PetscErrorCode SbDetectorCreate(SbDetectKind kind, SbDetector *detector)
{
  SbDetector d;

  PetscFunctionBeginUser;
  PetscCheck(kind == SB_DETECT_TREE || kind == SB_DETECT_BRUTE, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "there is no contact detector of kind %d", (int)kind);
  PetscCall(PetscNew(&d));
  *detector = d;
  d->nfacet = -1;
  d->kind = kind;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectorDestroy(SbDetector *detector)
{
  SbDetector d = *detector;

  PetscFunctionBeginUser;
  if (!d) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBoxTreeDestroy(&d->tree));
  PetscCall(PetscFree(d->facet_box));
  PetscCall(PetscFree2(d->point_box, d->start));
  PetscCall(PetscFree(d->candidate));
  PetscCall(SbDetectRingsDestroy(d));
  PetscCall(SbDetectSharpDestroy(d));
  PetscCall(PetscFree(d->hit));
  PetscCall(PetscFree(d->near));
  PetscCall(PetscFree(*detector));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Storage for this scene; it grows by half as much again, so that a scene that grows slowly does not allocate each time. */
static PetscErrorCode reserve(SbDetector d, const SbDetectScene *s)
{
  PetscFunctionBeginUser;
  if (s->nfacet > d->facet_size) {
    d->facet_size = s->nfacet + s->nfacet / 2;
    PetscCall(PetscFree(d->facet_box));
    PetscCall(PetscMalloc1(6 * (size_t)d->facet_size, &d->facet_box));
  }
  if (s->npoint > d->point_size || !d->start) {
    d->point_size = s->npoint + s->npoint / 2;
    PetscCall(PetscFree2(d->point_box, d->start));
    PetscCall(PetscMalloc2(6 * (size_t)d->point_size, &d->point_box, d->point_size + 1, &d->start));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline void box_of(const PetscReal x[3], PetscReal box[6])
{
  for (int k = 0; k < 3; k++) box[k] = box[3 + k] = x[k];
}

static inline void box_add(const PetscReal x[3], PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = PetscMin(box[k], x[k]);
    box[3 + k] = PetscMax(box[3 + k], x[k]);
  }
}

static void boxes(SbDetector d, const SbDetectScene *s)
{
  const PetscReal *x = s->x, *x0 = s->x0, *p0 = s->x0 ? s->p0 : NULL;

  for (PetscInt f = 0; f < s->nfacet; f++) {
    PetscReal *box = d->facet_box + 6 * f;
    const PetscInt *c = s->facet + 3 * f;

    box_of(x + 3 * c[0], box);
    for (int k = 1; k < 3; k++) box_add(x + 3 * c[k], box);
    for (int k = 0; x0 && k < 3; k++) box_add(x0 + 3 * c[k], box);
    SbBoxGrow(SbDetectRange(s), box);
  }
  for (PetscInt i = 0; i < s->npoint; i++) {
    box_of(s->p + 3 * i, d->point_box + 6 * i);
    if (p0) box_add(p0 + 3 * i, d->point_box + 6 * i);
  }
}

PetscErrorCode SbDetectBegin(SbDetector d, const SbDetectScene *s)
{
  PetscFunctionBeginUser;
  d->same_facets = (PetscBool)(d->nfacet == s->nfacet && d->version == s->version);
  d->nfacet = -1; /* should the search fail, the next call begins again */
  PetscCall(reserve(d, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One more candidate, if the scene wants the pair. */
static inline PetscErrorCode add_candidate(SbDetector d, const SbDetectScene *s, PetscInt point,
                                           PetscInt facet, PetscInt *n)
{
  PetscFunctionBeginUser;
  if (!s->self && s->point_part[point] == s->facet_part[facet]) PetscFunctionReturn(PETSC_SUCCESS);
  if (*n == d->candidate_size) {
    PetscCall(PetscIntCast((PetscInt64)*n + *n / 2 + 64, &d->candidate_size));
    PetscCall(PetscRealloc(sizeof(*d->candidate) * (size_t)d->candidate_size, &d->candidate));
  }
  d->candidate[(*n)++] = facet;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectCandidates(SbDetector d, const SbDetectScene *s)
{
  const PetscReal(*box)[6] = (const PetscReal(*)[6])d->facet_box;
  const PetscInt built = d->tree.built;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbDetectRingsUpdate(d, s));
  if (d->kind == SB_DETECT_BRUTE) {
    for (PetscInt i = 0; i < s->npoint; i++) {
      d->start[i] = n;
      for (PetscInt f = 0; f < s->nfacet; f++) {
        if (SbBoxesOverlap(d->point_box + 6 * i, box[f])) PetscCall(add_candidate(d, s, i, f, &n));
      }
    }
    d->start[s->npoint] = n;
    (void)snprintf(d->stats.text, sizeof(d->stats.text),
                   "brute force, %" PetscInt_FMT " x %" PetscInt_FMT " boxes", s->npoint, s->nfacet);
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // the order of the tree is kept while the facets are the same
  if (d->same_facets && d->tree.n == s->nfacet) {
    PetscCall(SbBoxTreeRefit(&d->tree, box));
    d->stats.rebuilt += d->tree.built - built;
  } else {
    PetscCall(SbBoxTreeDestroy(&d->tree));
    PetscCall(SbBoxTreeCreate(s->nfacet, box, &d->tree));
    d->stats.rebuilt++;
  }
  for (PetscInt i = 0, f; i < s->npoint; i++) {
    SbBoxQuery query;

    d->start[i] = n;
    for (SbBoxQueryBegin(&d->tree, d->point_box + 6 * i, &query); SbBoxQueryNext(&query, &f);)
      PetscCall(add_candidate(d, s, i, f, &n));
  }
  d->start[s->npoint] = n;
  d->stats.memory = (PetscInt64)((size_t)d->tree.start[d->tree.nlevel] * sizeof(*d->tree.group) +
                                 4 * (size_t)d->tree.start[1] * sizeof(*d->tree.order));
  (void)snprintf(d->stats.text, sizeof(d->stats.text),
                 "tree of %" PetscInt_FMT " groups of boxes in %d levels, made %" PetscInt_FMT " times",
                 d->tree.start[d->tree.nlevel], d->tree.nlevel, d->stats.rebuilt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectorFind(SbDetector d, const SbDetectScene *s, PetscInt *n, const SbNear **near)
{
  PetscFunctionBeginUser;
  PetscCheck(s->reach > 0 && !PetscIsInfOrNanReal(s->reach), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "the reach of contact detection is %g m: it must be positive and finite", (double)s->reach);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscCall(SbDetectBegin(d, s));
  boxes(d, s);
  PetscCall(SbDetectCandidates(d, s));
  PetscCall(SbDetectNarrow(d, s, n));
  d->version = s->version;
  d->nfacet = s->nfacet;
  d->stats.found = *n;
  *near = d->near;
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectorGetStats(SbDetector d, SbDetectStats *stats)
{
  PetscFunctionBeginUser;
  *stats = d->stats;
  PetscFunctionReturn(PETSC_SUCCESS);
}
