/*
  bvh.c - candidates by two trees of bounding volumes, one over the facets and one over the points.

  The trees are made when the facets are other ones (tree.c); in every call their volumes are fitted to where things are now, from the
  last node to the first, since children come after their node. A volume holds the swept motion; those of facets are grown by the
  reach. When the volumes of inner nodes have grown by more than GROWTH against those of single facets, compared with the
  last build, the trees are rebuilt.

  The search walks through both trees at once, from the pair of roots: all children of the point's node are tested against all children of
  the facet's node in one sweep (volume.c), and the pairs that meet are followed. What meets at the leaves are the candidates, in the
  order of the walk; a counting sort brings them to their points.

  What a large tree costs beyond a small one is waiting for memory, and branches that cannot be foreseen. So a node is one piece of
  memory, whole cache lines of it, which is fetched when it is put on the stack; nodes lie in the order of the walk; facets and points, which
  do not, are fetched some nodes ahead. Which pairs meet is one number of 64 bits: those of nodes, of items and of both are told
  apart by masks.

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
  SbMeets wanted;  /* which of their children */
  PetscBool apart; /* they are of two parts */
} Visit;

/* All that a visit needs of a node, in whole cache lines: after the children come the bounds. */
typedef struct {
  SbMeets inner;                 /* pairs with a child that is a node */
  SbMeets live;                  /* pairs with a child, of points: with one that is walked to */
  PetscInt child[SB_TREE_WIDTH]; /* as in SbTree */
  SbBound bounds[];              /* [rows][SB_TREE_WIDTH] of facets, [SB_TREE_WIDTH][rows] of points, m */
} Node;

typedef struct {
  SbTree tree;
  size_t stride;        /* bytes from node to node */
  char *memory, *node;  /* [nnode] of Node, allocated and aligned */
  PetscInt *part;       /* [nnode][SB_TREE_WIDTH] part of all that is below, NO_PART when there are several */
  PetscInt *common;     /* [nnode] the same of the node */
  PetscReal inner_size; /* sum of the sizes of inner nodes */
  PetscReal item_size;  /* and of single items */
} Fitted;

typedef struct {
  PetscInt k; /* planes of a volume */
  SbBvhCounts counts;
  SbVolume volume;
  Fitted facets, points;
  PetscBool *open;      /* [nvertex] as in SbFacetLinks */
  SbBound *vertex_cone; /* [nvertex][SB_VOLUME_CONE] */
  PetscReal *normal;    /* [nfacet][3] */
  PetscInt nvertex;
  PetscBool cull;  /* the trees have cones, for self-contact */
  PetscBool first; /* in this walk */
  PetscReal built; /* relative size of the volumes at the last build */
  PetscBool stale; /* other volumes */
  Visit *stack;
  PetscInt stack_size;
  PetscInt (*pair)[2]; /* point, facet */
  PetscInt pair_size, npair;
} Bvh;

#define NO_PART PETSC_MIN_INT
#define GROWTH 2 /* of the volumes until the trees are rebuilt */
#define ROW \
  ((SbMeets)0xFF) /* pairs of child 0 of a node of points with all of a node of facets; child c: << 8 c */
#define COLUMN \
  ((SbMeets)0x0101010101010101) /* pairs of all of a node of points with child 0 of facets; child l: << l */
#define AHEAD 8                 /* nodes */
#define LINE 64                 /* bytes, of the cache; a guess does no harm */
#define ROOM 80 /* the most that one visit can add: 8 x 8 pairs of children, and twice 8 with what is left */

/* ------------------------------------------------------------------ nodes */

static inline Node *node_of(const Fitted *t, PetscInt g)
{
  return (Node *)(t->node + t->stride * (size_t)g);
}

/* ------------------------------------------------------------------ fitting */

static void facet_column(const SbDetector d, const SbDetectScene *s, const SbVolume *v, PetscInt f,
                         SbBound column[])
{
  const PetscReal *x[6];
  int n = 0;

  /* of a box all is known */
  for (int i = 0; i < 3 && v->nslab > 3; i++) {
    x[n++] = s->x + 3 * s->facet[3 * f + i];
    if (s->x0) x[n++] = s->x0 + 3 * s->facet[3 * f + i];
  }
  SbVolumeOf(v, n, x, d->facet_box + 6 * f, SbDetectRange(s), column);
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

/* The boxes of a node's items will be needed soon: in the order of the tree they lie anywhere. */
SB_INLINE void prefetch_items(const Node *node, const PetscReal box[])
{
  for (PetscInt l = 0; l < SB_TREE_WIDTH; l++)
    __builtin_prefetch(box + 6 * PetscMax(0, SB_TREE_ITEM(node->child[l])));
}

/* All nodes of one of the two trees, children before parents. */
static void fit(const SbDetector d, const SbDetectScene *s, const Bvh *b, PetscBool points, Fitted *t)
{
  const SbVolume *v = &b->volume;
  const PetscInt w = SB_TREE_WIDTH, row = points ? 1 : w, lane = points ? v->rows : 1;
  SbBound column[SB_VOLUME_ROWS];

  t->inner_size = t->item_size = 0;
  for (PetscInt g = t->tree.nnode - 1; g >= 0; g--) {
    Node *node = node_of(t, g);
    PetscInt *part = t->part + g * w;

    if (g >= AHEAD) prefetch_items(node_of(t, g - AHEAD), points ? d->point_box : d->facet_box);
    for (PetscInt l = 0; l < t->tree.nchild[g]; l++) {
      const PetscInt child = node->child[l];
      SbBound *bounds = node->bounds + l * lane;

      if (child >= 0) {
        const SbBound *below = node_of(t, child)->bounds;

        part[l] = t->common[child];
        SbVolumeMerge(v, below, row, lane, column);
        if (b->cull) SbConeMerge(below + v->cone * row, row, lane, t->tree.nchild[child], column + v->cone);
        t->inner_size += SbVolumeSize(column);
      } else {
        fit_item(d, s, b, points, SB_TREE_ITEM(child), column, part + l);
        t->item_size += SbVolumeSize(column);
      }
      for (int r = 0; r < v->rows; r++) bounds[r * row] = column[r];
    }
    t->common[g] = common_part(t->tree.nchild[g], part);
  }
}

/* ------------------------------------------------------------------ building */

static PetscErrorCode fitted_destroy(Fitted *t)
{
  PetscFunctionBeginUser;
  PetscCall(SbTreeDestroy(&t->tree));
  PetscCall(PetscFree3(t->memory, t->part, t->common));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Children of node g and what they are; bounds that meet nothing, which the lanes without a child keep. */
static void fill_node(const SbVolume *v, PetscBool points, PetscInt g, const SbBound none[], Fitted *t)
{
  const PetscInt *child = t->tree.child + g * SB_TREE_WIDTH, n = SB_TREE_WIDTH * v->rows;
  Node *node = node_of(t, g);

  node->inner = node->live = 0;
  for (PetscInt l = 0; l < SB_TREE_WIDTH; l++) {
    const SbMeets with = points ? ROW << SB_TREE_WIDTH * l : COLUMN << l;

    node->child[l] = child[l];
    if (child[l] >= 0) node->inner |= with;
    if (child[l] != SB_TREE_NONE) node->live |= with;
  }
  for (PetscInt i = 0; i < n; i++) node->bounds[i] = none[points ? i % v->rows : i / SB_TREE_WIDTH];
}

/* What is allocated stays for all calls. */
static PetscErrorCode fitted_create(const SbBinary *binary, const SbVolume *v, PetscBool points, Fitted *t)
{
  const size_t width = SB_TREE_WIDTH;
  SbBound none[SB_VOLUME_ROWS];

  PetscFunctionBeginUser;
  PetscCall(fitted_destroy(t));
  PetscCall(SbTreeCreate(binary, &t->tree));
  const size_t nnode = (size_t)t->tree.nnode;

  t->stride = sizeof(Node) + width * (size_t)v->rows * sizeof(SbBound);
  t->stride = (t->stride + LINE - 1) / LINE * LINE;
  PetscCall(
    PetscMalloc3(nnode * t->stride + LINE - 1, &t->memory, nnode * width, &t->part, nnode, &t->common));
  t->node = t->memory + (LINE - (uintptr_t)t->memory % LINE) % LINE;
  SbVolumeNone(v, none);
  for (PetscInt g = 0; g < t->tree.nnode; g++) fill_node(v, points, g, none, t);
  PetscCall(PetscFree(t->tree.child)); /* the nodes have them */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode cones_create(const SbDetector d, const SbDetectScene *s, const PetscBool open[], Bvh *b)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree3(b->open, b->vertex_cone, b->normal));
  b->nvertex = d->rings.nvertex;
  PetscCall(PetscMalloc3(b->nvertex, &b->open, SB_VOLUME_CONE * b->nvertex, &b->vertex_cone, 3 * s->nfacet,
                         &b->normal));
  PetscCall(PetscArraycpy(b->open, open, b->nvertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode build(SbDetector d, const SbDetectScene *s, Bvh *b)
{
  const SbTreeItems facets = {s->nfacet, d->facet_box, s->facet_part};
  const SbTreeItems points = {s->npoint, d->point_box, s->point_part};
  SbBinary over_facets, over_points;
  SbFacetLinks links;

  PetscFunctionBeginUser;
  SbVolumeSet(b->k, s->self, &b->volume);
  b->cull = s->self;
  PetscCall(SbFacetLinksCreate(s, &d->rings, &links));
  PetscCall(SbBinaryCreate(&facets, links.start, links.list, &over_facets));
  PetscCall(SbBinaryHang(&over_facets, links.seat, &points, &over_points));
  PetscCall(fitted_create(&over_facets, &b->volume, PETSC_FALSE, &b->facets));
  PetscCall(fitted_create(&over_points, &b->volume, PETSC_TRUE, &b->points));
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
  const PetscReal items = b->facets.item_size;

  return items > 0 ? (b->facets.inner_size + b->points.inner_size) / items : 0;
}

static PetscErrorCode prepare(SbDetector d, const SbDetectScene *s, Bvh *b)
{
  PetscBool anew = (PetscBool)(b->stale || !d->same_facets || b->cull != s->self ||
                               b->facets.tree.n != s->nfacet || b->points.tree.n != s->npoint);

  PetscFunctionBeginUser;
  if (!anew) {
    fit_both(d, s, b);
    anew = (PetscBool)(relative_size(b) > GROWTH * b->built);
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

/* Takes out of the pairs of children those of one part, where the nodes hold several. */
static SbMeets without_own(const Bvh *b, const Visit *v, SbMeets pairs)
{
  const PetscInt *points = b->points.part + v->a * SB_TREE_WIDTH;
  const PetscInt *facets = b->facets.part + v->f * SB_TREE_WIDTH;

  for (PetscInt c = 0; c < b->points.tree.nchild[v->a]; c++) {
    for (PetscInt l = 0; l < b->facets.tree.nchild[v->f]; l++) {
      if (points[c] == facets[l] && points[c] != NO_PART) pairs &= ~((SbMeets)1 << (SB_TREE_WIDTH * c + l));
    }
  }
  return pairs;
}

/* In the row of each child of a point node the lowest bit when it is in any of the pairs, and no other. */
static inline SbMeets children_in(SbMeets pairs)
{
  pairs |= pairs >> 1;
  pairs |= pairs >> 2;
  pairs |= pairs >> 4;
  return pairs & COLUMN;
}

/*
  Which children of the two nodes meet. Parts do not meet themselves unless `self`; below nodes of two parts there is nothing to
  compare.
*/
static inline SbMeets meet(Bvh *b, Node *point, Node *facet, PetscBool self, Visit *v)
{
  const SbMeets wanted = v->wanted & point->live & facet->live;
  SbMeets pairs;

  if (!self && !v->apart) {
    const PetscInt common = b->points.common[v->a], other = b->facets.common[v->f];

    if (common == other && common != NO_PART) return 0;
    v->apart = (PetscBool)(common != NO_PART && other != NO_PART);
  }
  b->counts.visits += (PetscInt64)(children_in(wanted) * COLUMN >> 56); /* the sum of the lowest bits */
  pairs = b->volume.meet[b->first ? 1 : 0](point->bounds, b->volume.rows, wanted, facet->bounds);
  return !self && !v->apart ? without_own(b, v, pairs) : pairs;
}

/* Number of the lowest bit, and of the highest. */
static inline PetscInt lowest(SbMeets pairs)
{
  return (PetscInt)__builtin_ctzll(pairs);
}

static inline PetscInt highest(SbMeets pairs)
{
  return 63 - (PetscInt)__builtin_clzll(pairs);
}

/* Both nodes will be visited soon. */
static inline PetscInt push(Bvh *b, PetscInt a, PetscInt f, SbMeets wanted, const Visit *from,
                            PetscInt nstack)
{
  const Node *point = node_of(&b->points, a), *facet = node_of(&b->facets, f);

  __builtin_prefetch(point);
  __builtin_prefetch((const char *)point + LINE);
  __builtin_prefetch(facet);
  __builtin_prefetch((const char *)facet + LINE);
  b->stack[nstack] = (Visit){a, f, wanted, from->apart};
  return nstack + 1;
}

/*
  Pairs of which at least one is a node: on the stack, so that the first are visited first, in the order of the nodes in memory. Items
  wait until the other side has come down to items. Returns the new end.
*/
static inline PetscInt follow(Bvh *b, const Node *point, const Node *facet, const Visit *v, SbMeets pairs,
                              PetscInt nstack)
{
  enum { lanes = SB_TREE_WIDTH };

  for (SbMeets m = pairs & point->inner & ~facet->inner; m;) {
    const PetscInt c = highest(m) / lanes;

    nstack = push(b, point->child[c], v->f, (m >> lanes * c & ROW) * COLUMN, v, nstack);
    m &= ~(ROW << lanes * c);
  }
  for (SbMeets m = pairs & ~point->inner & facet->inner; m;) {
    const PetscInt l = highest(m) % lanes;
    const SbMeets with = m & COLUMN << l;

    nstack = push(b, v->a, facet->child[l], (with >> l) * ROW, v, nstack);
    m ^= with;
  }
  for (SbMeets m = pairs & point->inner & facet->inner; m;) {
    const PetscInt i = highest(m);

    nstack = push(b, point->child[i / lanes], facet->child[i % lanes], ~(SbMeets)0, v, nstack);
    m ^= (SbMeets)1 << i;
  }
  return nstack;
}

/* Pairs of items; in the first walk the points that have any are walked to no more. */
static inline void keep(Bvh *b, Node *point, const Node *facet, SbMeets pairs)
{
  if (b->first) {
    point->live &= ~(children_in(pairs) * ROW);
    return;
  }
  for (; pairs; pairs &= pairs - 1) {
    const PetscInt i = lowest(pairs);

    b->pair[b->npair][0] = SB_TREE_ITEM(point->child[i / SB_TREE_WIDTH]);
    b->pair[b->npair++][1] = SB_TREE_ITEM(facet->child[i % SB_TREE_WIDTH]);
  }
}

/* All pairs that meet, into b->pair; in the first walk points that meet anything are no more alive. */
static PetscErrorCode walk(Bvh *b, PetscBool self)
{
  PetscInt nstack = 0;

  PetscFunctionBeginUser;
  if (!b->facets.tree.nnode || !b->points.tree.nnode) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(make_room(b, 1));
  b->stack[nstack++] = (Visit){0, 0, ~(SbMeets)0, PETSC_FALSE};
  while (nstack) {
    Visit v = b->stack[--nstack];
    Node *point = node_of(&b->points, v.a), *facet = node_of(&b->facets, v.f);
    const SbMeets pairs = meet(b, point, facet, self, &v), nodes = point->inner | facet->inner;

    if (PetscMin(b->stack_size - nstack, b->pair_size - b->npair) < ROOM) PetscCall(make_room(b, nstack));
    keep(b, point, facet, pairs & ~nodes);
    nstack = follow(b, point, facet, &v, pairs & nodes, nstack);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which children of the points' nodes are walked to: all. */
static void set_live(Bvh *b)
{
  for (PetscInt g = 0; g < b->points.tree.nnode; g++)
    node_of(&b->points, g)->live = ~(SbMeets)0 >> SB_TREE_WIDTH * (SB_TREE_WIDTH - b->points.tree.nchild[g]);
}

/* After the first walk: points that met something are walked to again, the others no more. */
static void turn_live(Bvh *b)
{
  const SbTree *t = &b->points.tree;

  for (PetscInt g = t->nnode - 1; g >= 0; g--) {
    Node *node = node_of(&b->points, g);
    SbMeets live = 0;

    for (PetscInt l = 0; l < t->nchild[g]; l++) {
      const SbMeets own = ROW << SB_TREE_WIDTH * l;

      if (node->inner & own ? node_of(&b->points, node->child[l])->live != 0 : !(node->live & own))
        live |= own;
    }
    node->live = live;
  }
}

/* The candidates; for self-contact only those of points that face something. */
static PetscErrorCode find_pairs(Bvh *b, PetscBool self)
{
  PetscFunctionBeginUser;
  b->npair = 0;
  b->counts.visits = 0;
  b->first = self;
  if (self) {
    set_live(b);
    PetscCall(walk(b, self));
    turn_live(b);
    b->first = PETSC_FALSE;
  }
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
    const PetscInt64 n = t[i]->tree.nnode, w = SB_TREE_WIDTH;

    sum += n * (PetscInt64)t[i]->stride + n * (w + 2) * (PetscInt64)sizeof(PetscInt);
  }
  return sum;
}

/* ------------------------------------------------------------------ operations */

static PetscErrorCode search(SbDetector d, const SbDetectScene *s)
{
  Bvh *b = (Bvh *)d->data;

  PetscFunctionBeginUser;
  PetscCall(prepare(d, s, b));
  PetscCall(find_pairs(b, s->self));
  PetscCall(sort_pairs(d, s, b));
  d->stats.memory = bytes(b);
  PetscCall(PetscSNPrintf(d->stats.text, sizeof(d->stats.text),
                          "tree of %s, %" PetscInt_FMT " nodes, depth %" PetscInt_FMT,
                          b->k == 6 ? "boxes" : "14-DOPs", b->counts.nodes, b->counts.depth));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy(SbDetector d)
{
  Bvh *b = (Bvh *)d->data;

  PetscFunctionBeginUser;
  PetscCall(fitted_destroy(&b->facets));
  PetscCall(fitted_destroy(&b->points));
  PetscCall(PetscFree3(b->open, b->vertex_cone, b->normal));
  PetscCall(PetscFree(b->stack));
  PetscCall(PetscFree(b->pair));
  PetscCall(PetscFree(d->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tree of a detector; an error when it is of another kind. */
static PetscErrorCode tree_of(SbDetector d, Bvh **b)
{
  PetscFunctionBeginUser;
  PetscCheck(d->ops.search == search, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "the contact detector is of kind %s: a tree is in those of kind bvh", d->ops.name);
  *b = (Bvh *)d->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBvhSet(SbDetector d, PetscInt k)
{
  Bvh *b = NULL;

  PetscFunctionBeginUser;
  PetscCall(tree_of(d, &b));
  PetscCheck(k == 6 || k == 14, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "planes of a volume of the contact tree are %" PetscInt_FMT ": write 6 (a box) or 14", k);
  b->k = k;
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

PetscErrorCode SbDetectorCreate_BVH(SbDetector d)
{
  Bvh *b;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&b));
  b->k = 6;
  b->stale = PETSC_TRUE;
  d->data = b;
  d->ops = (SbDetectorOps){"bvh", search, destroy};
  PetscFunctionReturn(PETSC_SUCCESS);
}
