/*
  bvh.c - candidates by two trees of bounding volumes, one over the facets and one over the points.

  The trees are made when the facets are other ones (tree.c); in every call their volumes are fitted to where things are now, from the
  last node to the first, since children come after their node. A volume holds the swept motion; those of facets are grown by the
  reach. When the volumes of inner nodes have grown by more than the factor `growth` against those of single facets, compared with the
  last build, the trees are made anew.

  The search walks through both trees at once, from the pair of roots: each child of the point's node is tested against all children of
  the facet's node in one sweep (volume.c), and the pairs that meet are followed. What meets at the leaves are the candidates, in the
  order of the walk; a counting sort brings them to their points.

  With self-contact there are two walks. The first one follows only what may face each other (cone.c), and marks the points that face some
  facet: the others have no contact. The second one, over the marked points, leaves out nothing, since which of the facets near a
  point is its contact depends also on those that do not face it (near.c). A smooth closed body then costs little: nodes that touch
  are neighbours, and their normals agree. Between different bodies the cones would save less than they cost.
*/
#include "sbbvh.h"
#include "detect.h"
#include "tree.h"
#include "volume.h"

typedef struct {
  PetscInt a, f;   /* node of the points, node of the facets */
  unsigned am, fm; /* which children of each; all bits for all */
  PetscBool apart; /* they are of two parts */
} Visit;

typedef struct {
  SbTree tree;
  SbBound *block;   /* [nnode][rows][lanes] of facets, [nnode][lanes][rows] of points, m */
  PetscInt *part;   /* [nnode][width] part of all that is below, NO_PART when there are several */
  PetscInt *common; /* [nnode] the same of the node */
  PetscReal inner;  /* sum of the sizes of inner nodes */
  PetscReal leaves; /* and of single items */
} Fitted;

typedef struct {
  SbBvhSettings settings;
  SbBvhCounts counts;
  SbVolume volume;
  Fitted facets, points;
  PetscBool *open;      /* [nvertex] as in SbFacetLinks */
  SbBound *vertex_cone; /* [nvertex][SB_VOLUME_CONE] */
  PetscReal *normal;    /* [nfacet][3] */
  PetscInt nvertex;
  PetscBool cull;  /* the trees have cones, for self-contact */
  PetscBool first; /* in this walk */
  unsigned *live;  /* [nnode of points] children that are walked to */
  PetscReal built; /* relative size of the volumes at the last build */
  PetscBool stale; /* other settings */
  Visit *stack;
  PetscInt stack_size;
  PetscInt (*pair)[2]; /* point, facet */
  PetscInt pair_size, npair;
} Bvh;

#define NO_PART PETSC_MIN_INT
#define ROOM 80 /* the most that one visit can add: 8 x 8 pairs of children, and twice 8 with what is left */

/* ------------------------------------------------------------------ fitting */

static void facet_column(const SbDetector d, const SbDetectScene *s, const SbVolume *v, PetscInt f,
                         SbBound column[])
{
  const PetscReal *x[6];
  int n = 0;

  /* of a box all is known */
  for (int i = 0; i < 3 && v->k != 6; i++) {
    x[n++] = s->x + 3 * s->facet[3 * f + i];
    if (s->x0) x[n++] = s->x0 + 3 * s->facet[3 * f + i];
  }
  SbVolumeOf(v, n, x, d->facet_box + 6 * f, s->reach, column);
}

static void point_column(const SbDetector d, const SbDetectScene *s, const SbVolume *v, PetscInt p,
                         SbBound column[])
{
  const PetscReal *x[2] = {s->p + 3 * p, NULL};
  int n = 1;

  if (s->x0) x[n++] = s->p0 + 3 * p;
  SbVolumeOf(v, n, x, d->point_box + 6 * p, 0, column);
}

/* A facet's cone is that around its vertices'. */
static void facet_cone(const SbDetector d, const Bvh *b, PetscInt f, SbBound cone[SB_VOLUME_CONE])
{
  SbBound block[3][SB_VOLUME_CONE];

  for (int k = 0; k < 3; k++) {
    const SbBound *at = b->vertex_cone + SB_VOLUME_CONE * d->rings.vertex[3 * f + k];

    for (int r = 0; r < SB_VOLUME_CONE; r++) block[k][r] = at[r];
  }
  SbConeMerge(&block[0][0], 1, SB_VOLUME_CONE, 3, cone);
}

/* Part of all children of a node. */
static PetscInt common_part(PetscInt n, const PetscInt part[])
{
  for (PetscInt l = 1; l < n; l++) {
    if (part[l] != part[0]) return NO_PART;
  }
  return part[0];
}

/* Volume, cone and part of a single item. */
static void fit_item(const SbDetector d, const SbDetectScene *s, const Bvh *b, PetscBool points,
                     PetscInt item, SbBound column[], PetscInt *part)
{
  if (points) {
    *part = s->point_part[item];
    point_column(d, s, &b->volume, item, column);
    if (b->cull) SbConeOf(s->p_normal + 3 * item, column + b->volume.cone);
  } else {
    *part = s->facet_part[item];
    facet_column(d, s, &b->volume, item, column);
    if (b->cull) facet_cone(d, b, item, column + b->volume.cone);
  }
}

/* All nodes of one of the two trees, children before parents. */
static void fit(const SbDetector d, const SbDetectScene *s, const Bvh *b, PetscBool points, Fitted *t)
{
  const SbVolume *v = &b->volume;
  const PetscInt w = v->width, row = points ? 1 : v->lanes, lane = points ? v->rows : 1;
  const size_t stride = (size_t)v->lanes * (size_t)v->rows;
  SbBound column[SB_VOLUME_ROWS];

  t->inner = t->leaves = 0;
  for (PetscInt g = t->tree.nnode - 1; g >= 0; g--) {
    PetscInt *part = t->part + g * w;

    for (PetscInt l = 0; l < t->tree.nchild[g]; l++) {
      const PetscInt child = t->tree.child[g * w + l];
      SbBound *block = t->block + stride * g + l * lane;

      if (child >= 0) {
        const SbBound *below = t->block + stride * child;

        part[l] = t->common[child];
        SbVolumeMerge(v, below, row, lane, t->tree.nchild[child], column);
        if (b->cull) SbConeMerge(below + v->cone * row, row, lane, t->tree.nchild[child], column + v->cone);
        t->inner += SbVolumeSize(v, column);
      } else {
        fit_item(d, s, b, points, SB_TREE_ITEM(child), column, part + l);
        t->leaves += SbVolumeSize(v, column);
      }
      for (int r = 0; r < v->rows; r++) block[r * row] = column[r];
    }
    t->common[g] = common_part(t->tree.nchild[g], part);
  }
}

/* ------------------------------------------------------------------ building */

static PetscErrorCode fitted_destroy(Fitted *t)
{
  PetscFunctionBeginUser;
  PetscCall(SbTreeDestroy(&t->tree));
  PetscCall(PetscFree3(t->block, t->part, t->common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is allocated stays for all calls; lanes without a child never meet anything. */
static PetscErrorCode fitted_create(const SbBinary *binary, const SbVolume *v, Fitted *t)
{
  SbBound none[SB_VOLUME_ROWS];

  PetscFunctionBeginUser;
  PetscCall(fitted_destroy(t));
  PetscCall(SbTreeCreate(binary, v->width, &t->tree));
  const size_t nnode = (size_t)t->tree.nnode, rows = (size_t)v->rows, lanes = (size_t)v->lanes;

  PetscCall(
    PetscMalloc3(nnode * lanes * rows, &t->block, nnode * (size_t)v->width, &t->part, nnode, &t->common));
  SbVolumeNone(v, none);
  for (size_t r = 0; r < nnode * rows; r++) {
    for (size_t l = 0; l < lanes; l++) t->block[r * lanes + l] = none[r % rows];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode cones_create(const SbDetector d, const SbDetectScene *s, const PetscBool open[], Bvh *b)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree4(b->open, b->vertex_cone, b->normal, b->live));
  b->nvertex = d->rings.nvertex;
  PetscCall(PetscMalloc4(b->nvertex, &b->open, SB_VOLUME_CONE * b->nvertex, &b->vertex_cone, 3 * s->nfacet,
                         &b->normal, b->points.tree.nnode, &b->live));
  PetscCall(PetscArraycpy(b->open, open, b->nvertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode build(SbDetector d, const SbDetectScene *s, Bvh *b)
{
  const SbTreeItems facets = {s->nfacet, d->facet_box, s->facet_part};
  const SbTreeItems points = {s->npoint, d->point_box, s->point_part};
  const PetscBool linked = (PetscBool)(b->settings.build == SB_BVH_CONNECTIVITY);
  SbBinary over_facets, over_points;
  SbFacetLinks links;

  PetscFunctionBeginUser;
  SbVolumeSet(b->settings.k, b->settings.branching, s->self, &b->volume);
  b->cull = s->self;
  PetscCall(SbFacetLinksCreate(s, &d->rings, &links));
  PetscCall(SbBinaryCreate(&facets, linked ? links.start : NULL, links.list, &over_facets));
  PetscCall(SbBinaryHang(&over_facets, links.seat, &points, &over_points));
  PetscCall(fitted_create(&over_facets, &b->volume, &b->facets));
  PetscCall(fitted_create(&over_points, &b->volume, &b->points));
  PetscCall(cones_create(d, s, links.open, b));
  PetscCall(SbBinaryDestroy(&over_facets));
  PetscCall(SbBinaryDestroy(&over_points));
  PetscCall(SbFacetLinksDestroy(&links));
  b->stale = PETSC_FALSE;
  b->counts.nodes = b->facets.tree.nnode;
  b->counts.depth = b->facets.tree.depth;
  d->stats.rebuilt++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The median of some points: in the middle of the scene, also when a body has left it. */
static void find_origin(const SbDetectScene *s, PetscReal origin[3])
{
  enum { MOST = 101 };
  const PetscInt n = PetscMin(s->npoint, MOST);
  PetscReal at[MOST];

  for (int i = 0; i < 3; i++) {
    for (PetscInt j = 0; j < n; j++) at[j] = s->p[3 * (j * (PetscInt64)s->npoint / n) + i];
    (void)PetscSortReal(n, at);
    origin[i] = n ? at[n / 2] : 0;
  }
}

static void fit_both(SbDetector d, const SbDetectScene *s, Bvh *b)
{
  if (b->cull) SbConesOfVertices(s, &d->rings, b->open, b->normal, b->vertex_cone);
  find_origin(s, b->volume.origin);
  fit(d, s, b, PETSC_FALSE, &b->facets);
  fit(d, s, b, PETSC_TRUE, &b->points);
}

/* Sizes of the inner nodes in those of the facets: unlike the sum itself it does not change with the scale, the reach or the speed. */
static PetscReal relative_size(const Bvh *b)
{
  const PetscReal leaves = b->facets.leaves;

  return leaves > 0 ? (b->facets.inner + b->points.inner) / leaves : 0;
}

static PetscErrorCode prepare(SbDetector d, const SbDetectScene *s, Bvh *b)
{
  PetscBool anew = (PetscBool)(b->stale || !d->same_facets || b->cull != s->self ||
                               b->facets.tree.n != s->nfacet || b->points.tree.n != s->npoint);

  PetscFunctionBeginUser;
  if (!anew) {
    fit_both(d, s, b);
    anew = (PetscBool)(relative_size(b) > b->settings.growth * b->built);
  }
  if (anew) {
    PetscCall(build(d, s, b));
    fit_both(d, s, b);
    b->built = relative_size(b);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ walking */

static PetscErrorCode grow(size_t item, PetscInt n, PetscInt *size, void *array)
{
  PetscFunctionBeginUser;
  PetscCheck(
    n < PETSC_MAX_INT / 2, PETSC_COMM_SELF, PETSC_ERR_SUP,
    "contact detection found more than %" PetscInt_FMT " pairs: the reach is far larger than the facets", n);
  *size = 2 * n + 1024;
  PetscCall(PetscRealloc(item * (size_t)*size, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode make_room(Bvh *b, PetscInt nstack)
{
  PetscFunctionBeginUser;
  if (nstack + ROOM > b->stack_size)
    PetscCall(grow(sizeof(*b->stack), nstack + ROOM, &b->stack_size, &b->stack));
  if (b->npair + ROOM > b->pair_size)
    PetscCall(grow(sizeof(*b->pair), b->npair + ROOM, &b->pair_size, &b->pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes out of the children of a facet node those of one part, where the node holds several. */
static unsigned without_part(const Bvh *b, PetscInt f, PetscInt part, unsigned mask)
{
  const PetscInt *parts = b->facets.part + f * b->volume.width;

  for (PetscInt l = 0; l < b->facets.tree.nchild[f]; l++) {
    if (parts[l] == part) mask &= ~(1u << l);
  }
  return mask;
}

/*
  Which children of the two nodes meet: bits of the point node's, and hit[] for them. Parts do not meet themselves unless `self`; below
  nodes of two parts there is nothing to compare.
*/
static unsigned meet(Bvh *b, Visit *v, PetscBool self, unsigned hit[])
{
  const SbVolume *volume = &b->volume;
  const size_t stride = (size_t)volume->lanes * (size_t)volume->rows;
  const PetscInt *part = b->points.part + v->a * volume->width;
  const unsigned mask = v->am & b->live[v->a];
  unsigned any;

  if (!self && !v->apart) {
    const PetscInt common = b->points.common[v->a], other = b->facets.common[v->f];

    if (common == other && common != NO_PART) return 0;
    v->apart = (PetscBool)(common != NO_PART && other != NO_PART);
  }
  any = volume->meet[b->first ? 1 : 0](b->points.block + stride * v->a, volume->rows, mask,
                                       b->facets.block + stride * v->f, hit);
  for (int c = 0; mask >> c; c++) {
    b->counts.visits += mask >> c & 1;
    if (!(any >> c & 1)) continue;
    hit[c] &= v->fm;
    if (!self && !v->apart && part[c] != NO_PART) hit[c] = without_part(b, v->f, part[c], hit[c]);
  }
  return any;
}

/* A child of a point node against those of a facet node that it meets: follows them. Returns the new end of the stack. */
static PetscInt follow(Bvh *b, const Visit *v, PetscInt c, unsigned hit, unsigned single[], PetscInt nstack)
{
  const PetscInt w = b->volume.width, child = b->points.tree.child[v->a * w + c];
  const PetscInt *facet = b->facets.tree.child + v->f * w;
  unsigned leaves = 0;

  for (PetscInt l = 0; hit >> l; l++) {
    if (!(hit >> l & 1)) continue;
    if (child >= 0) {
      if (facet[l] >= 0)
        b->stack[nstack++] = (Visit){child, facet[l], ~0u, ~0u, v->apart};
      else
        leaves |= 1u << l;
    } else if (facet[l] >= 0)
      single[l] |= 1u << c;
    else if (b->first)
      b->live[v->a] &= ~(1u << c);
    else {
      b->pair[b->npair][0] = SB_TREE_ITEM(child);
      b->pair[b->npair++][1] = SB_TREE_ITEM(facet[l]);
    }
  }
  if (leaves) b->stack[nstack++] = (Visit){child, v->f, ~0u, leaves, v->apart};
  return nstack;
}

/* All pairs that meet, into b->pair; in the first walk points that meet anything are taken out of b->live. */
static PetscErrorCode walk(Bvh *b, PetscBool self)
{
  const PetscInt w = b->volume.width;
  PetscInt nstack = 0;

  PetscFunctionBeginUser;
  if (!b->facets.tree.nnode || !b->points.tree.nnode) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(make_room(b, 1));
  b->stack[nstack++] = (Visit){0, 0, ~0u, ~0u, PETSC_FALSE};
  while (nstack) {
    Visit v = b->stack[--nstack];
    unsigned hit[8], single[8] = {0}; /* points that go on alone to each child of the facet node */
    unsigned any = meet(b, &v, self, hit), alone = 0;

    if (PetscMin(b->stack_size - nstack, b->pair_size - b->npair) < ROOM) PetscCall(make_room(b, nstack));
    for (PetscInt c = 0; any >> c; c++) {
      if (any >> c & 1) nstack = follow(b, &v, c, hit[c], single, nstack);
    }
    for (PetscInt l = 0; l < w; l++) alone |= single[l];
    for (PetscInt l = 0; alone && l < w; l++) {
      if (single[l])
        b->stack[nstack++] = (Visit){v.a, b->facets.tree.child[v.f * w + l], single[l], ~0u, v.apart};
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the first walk: points that met something are walked to again, the others no more. */
static void turn_live(Bvh *b)
{
  const SbTree *t = &b->points.tree;

  for (PetscInt g = t->nnode - 1; g >= 0; g--) {
    for (PetscInt l = 0; l < t->nchild[g]; l++) {
      const PetscInt child = t->child[g * t->width + l];
      const PetscBool met = (PetscBool)(child >= 0 ? b->live[child] != 0 : !(b->live[g] >> l & 1));

      if (met)
        b->live[g] |= 1u << l;
      else
        b->live[g] &= ~(1u << l);
    }
  }
}

/* The candidates; for self-contact only those of points that face something. */
static PetscErrorCode find_pairs(Bvh *b, PetscBool self)
{
  PetscFunctionBeginUser;
  b->npair = 0;
  b->counts.visits = 0;
  for (PetscInt g = 0; g < b->points.tree.nnode; g++) b->live[g] = (1u << b->points.tree.nchild[g]) - 1;
  b->first = self;
  if (self) {
    PetscCall(walk(b, self));
    turn_live(b);
  }
  b->first = PETSC_FALSE;
  PetscCall(walk(b, self));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs to the lists of their points. */
static PetscErrorCode sort_pairs(SbDetector d, const SbDetectScene *s, const Bvh *b)
{
  PetscInt *start = d->start;

  PetscFunctionBeginUser;
  PetscCall(SbCandidatesReserve(d, b->npair));
  for (PetscInt p = 0; p <= s->npoint; p++) start[p] = 0;
  for (PetscInt i = 0; i < b->npair; i++) start[b->pair[i][0]]++;
  for (PetscInt p = 0; p < s->npoint; p++) start[p + 1] += start[p];
  for (PetscInt i = b->npair - 1; i >= 0; i--) d->candidate[--start[b->pair[i][0]]] = b->pair[i][1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt64 bytes(const Bvh *b)
{
  const Fitted *t[2] = {&b->facets, &b->points};
  PetscInt64 sum =
    (PetscInt64)sizeof(*b->stack) * b->stack_size + (PetscInt64)sizeof(*b->pair) * b->pair_size;

  sum += b->nvertex * (PetscInt64)(sizeof(PetscBool) + SB_VOLUME_CONE * sizeof(SbBound)) +
         3 * b->facets.tree.n * (PetscInt64)sizeof(PetscReal);

  for (int i = 0; i < 2; i++) {
    const PetscInt64 n = t[i]->tree.nnode, w = b->volume.width;

    sum += n * (PetscInt64)sizeof(SbBound) * b->volume.lanes * b->volume.rows +
           n * (2 * w + 2) * (PetscInt64)sizeof(PetscInt);
  }
  return sum;
}

/* ------------------------------------------------------------------ operations */

static PetscErrorCode search(SbDetector d, const SbDetectScene *s)
{
  Bvh *b = (Bvh *)d->data;
  char volume[32] = "spheres";

  PetscFunctionBeginUser;
  PetscCall(prepare(d, s, b));
  PetscCall(find_pairs(b, s->self));
  PetscCall(sort_pairs(d, s, b));
  d->stats.memory = bytes(b);
  if (b->settings.k == 6)
    PetscCall(PetscStrncpy(volume, "boxes", sizeof(volume)));
  else if (b->settings.k)
    PetscCall(PetscSNPrintf(volume, sizeof(volume), "%d-DOPs", (int)b->settings.k));
  PetscCall(PetscSNPrintf(d->stats.text, sizeof(d->stats.text),
                          "tree of %s, %d children, %s, %" PetscInt_FMT " nodes, depth %" PetscInt_FMT,
                          volume, (int)b->settings.branching,
                          b->settings.build == SB_BVH_TOP_DOWN ? "top-down" : "by connectivity",
                          b->counts.nodes, b->counts.depth));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy(SbDetector d)
{
  Bvh *b = (Bvh *)d->data;

  PetscFunctionBeginUser;
  PetscCall(fitted_destroy(&b->facets));
  PetscCall(fitted_destroy(&b->points));
  PetscCall(PetscFree4(b->open, b->vertex_cone, b->normal, b->live));
  PetscCall(PetscFree(b->stack));
  PetscCall(PetscFree(b->pair));
  PetscCall(PetscFree(d->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbBvhSettingsDefault(SbBvhSettings *s)
{
  *s = (SbBvhSettings){.branching = 4, .k = 6, .build = SB_BVH_CONNECTIVITY, .growth = 2};
}

/* The tree of a detector; an error when it is of another kind. */
static PetscErrorCode tree_of(SbDetector d, Bvh **b)
{
  PetscFunctionBeginUser;
  PetscCheck(d->ops.search == search, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "the contact detector is of kind %s: settings of the tree are for kind bvh", d->ops.name);
  *b = (Bvh *)d->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBvhSet(SbDetector d, const SbBvhSettings *s)
{
  Bvh *b = NULL;

  PetscFunctionBeginUser;
  PetscCall(tree_of(d, &b));
  PetscCheck(s->branching == 2 || s->branching == 4 || s->branching == 8, PETSC_COMM_SELF,
             PETSC_ERR_ARG_OUTOFRANGE, "branching of the contact tree is %" PetscInt_FMT ": write 2, 4 or 8",
             s->branching);
  PetscCheck(s->k == 0 || s->k == 6 || s->k == 14 || s->k == 18 || s->k == 26, PETSC_COMM_SELF,
             PETSC_ERR_ARG_OUTOFRANGE,
             "planes of a volume of the contact tree are %" PetscInt_FMT
             ": write 6, 14, 18, 26, or 0 for spheres",
             s->k);
  PetscCheck(
    s->build == SB_BVH_CONNECTIVITY || s->build == SB_BVH_TOP_DOWN, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
    "the contact tree cannot be built in way %d: write connectivity (0) or top-down (1)", (int)s->build);
  PetscCheck(s->growth > 1, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "growth of the contact tree until it is built anew is %g: it must be above 1",
             (double)s->growth);
  b->settings = *s;
  b->stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBvhGetCounts(SbDetector d, SbBvhCounts *counts)
{
  Bvh *b = NULL;

  PetscFunctionBeginUser;
  PetscCall(tree_of(d, &b));
  *counts = b->counts;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode sb_detector_bvh(SbDetector d)
{
  Bvh *b;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&b));
  SbBvhSettingsDefault(&b->settings);
  b->stale = PETSC_TRUE;
  d->data = b;
  d->ops = (SbDetectorOps){"bvh", search, destroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
