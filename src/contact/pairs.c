/*
  pairs.c - pairs of features (vertex-triangle, edge-edge) that may come into contact, their
  gaps, and the collision-free part of a motion.

  Search. Each vertex has a box around its motion, grown by a margin; those of edges and triangles
  enclose the boxes of their vertices. All pairs of a vertex and a triangle, and of two edges, whose
  boxes are within the reach, are given by a spatial hash (Teschner et al. 2003;
  src/geometry/spatial_hash.c), into which a rank puts its own features and what may meet them, or
  by trees of boxes, which are refitted (src/geometry/box_tree.c). Both give the same pairs, which
  are ordered by number. They stay valid while every vertex stays in its box: iterations that move
  little, as most do, need no search. A motion with too many pairs is halved.

  Safe part of a motion. Additive continuous collision detection (Li, Kaufman and Jiang,
  "Codimensional incremental potential contact", ACM TOG 40(4), 2021, section 5; src/geometry/ccd.c)
  leaves a tenth of each gap. A half-space and a bowl have roots of quadratic polynomials.
*/
#include "pairs.h"
#include "sbgeometry.h"

#define LEFT 0.1 /* fraction of its gap that a pair keeps at least */
#define LEFT_MOST \
  0.5 /* largest gap that is kept, over the reach: a distant pair may come within the reach at once */

static inline void places(const SbContactPair *pair, const PetscReal x[], PetscReal at[12])
{
  for (int k = 0; k < 12; k++)
    at[k] = x[3 * pair->v[k / 3] + k % 3];
}

PetscReal SbContactPairGap(SbContactSurface m, const SbContactPair *pair, const PetscReal x[],
                           SbDistance *g)
{
  PetscReal at[12], r[3], length;

  places(pair, x, at);
  if (!pair->side) {
    SbDistanceFind(pair->kind, at, g);
    return g->d - SbContactPairRadius(m, pair);
  }

  /* the obstacle's vertices 1 and 2: a point of the plane and the tip of its normal; or 1, the
     centre */
  g->weight[0] = 1.;
  g->weight[1] = -1.;
  g->weight[2] = g->weight[3] = 0.;
  for (int i = 0; i < 3; i++) {
    r[i] = at[i] - at[3 + i];
    g->n[i] = m->side == SB_SIDE_PLANE ? at[6 + i] - at[3 + i] : -r[i];
  }
  length = SbNormalise(g->n);
  g->d = m->side == SB_SIDE_PLANE ? SbDot3(g->n, r) : m->radius - length;
  return g->d;
}

/* Distance of the prescribed vertices of both sides of a pair at at[4][3], m. */
static PetscReal rim_gap(SbContactSurface m, const SbContactPair *pair, const PetscReal at[12])
{
  const int split = SbContactPairSplit(pair);
  const PetscBool turned =
    (PetscBool)(m->driven[pair->v[0]] + (split > 1 && m->driven[pair->v[1]]) > 1);
  PetscReal x[12];
  int n = 0;
  SbDistance g;

  /* a vertex, then a vertex or an edge */
  for (int k = 0; k < 4; k++) {
    const int i = turned ? (k + split) % 4 : k;

    for (int c = 0; c < 3 && m->driven[pair->v[i]]; c++)
      x[n++] = at[3 * i + c];
  }
  SbDistanceFind(n == 6 ? SB_PAIR_VERTEX_VERTEX : SB_PAIR_VERTEX_EDGE, x, &g);
  return g.d;
}

PetscReal SbContactPairRimGap(SbContactSurface m, const SbContactPair *pair, const PetscReal x[])
{
  PetscReal at[12];

  places(pair, x, at);
  return rim_gap(m, pair, at);
}

#define JOINED 1e-9 /* of the bodies' size: prescribed parts that are nearer are at one place */
#define MARGIN 0.1  /* of the mean edge: least growth of the boxes */
#define CROWD \
  200 /* a motion with more pairs than CROWD (number of vertices + CROWD_LEAST) is halved */
#define CROWD_LEAST 1000
#define CHUNK 256 /* pairs of boxes at once */
#define CELL 1.5  /* width of the hash's cells over the mean edge with the growth of its box */

/* Features of one kind, those with a node of this rank or the others, with a tree over their boxes
   if trees search. */
enum {
  VERTEX,
  TRIANGLE,
  EDGE,
  OTHERS /* the same again, of others */
};
static const int corners[] = {1, 3, 2};
struct SbContactFeatures {
  PetscInt n, *item;   /* [n] numbers in the mesh */
  PetscReal (*box)[6]; /* [n] */
  PetscInt room[2];
  SbBoxTree tree;
};

/* Vertices of feature i; `own` is room for one. */
static inline const PetscInt *vertices_of(SbContactSurface m, int kind, PetscInt i, PetscInt *own)
{
  *own = i;
  return kind == VERTEX ? own : kind == TRIANGLE ? m->triangle + 3 * i : m->edge + 2 * i;
}

/* Whether the features of a pair stay farther apart than the reach for all positions of its
   vertices in their boxes: the distance at the centres less the largest displacement of a vertex
   from there. */
static PetscBool stays_apart(SbContactPairs p, const SbContactPair *pair)
{
  const int split = SbContactPairSplit(pair);
  PetscReal at[12];
  PetscReal far[2] = {0., 0.};
  SbDistance g;

  for (int k = 0; k < 4; k++) {
    const PetscReal *box = p->box + 6 * pair->v[k];
    PetscReal square = 0.;

    for (int i = 0; i < 3; i++) {
      at[3 * k + i] = 0.5 * (box[i] + box[3 + i]);
      square += 0.25 * PetscSqr(box[3 + i] - box[i]);
    }
    far[k >= split] = PetscMax(far[k >= split], square);
  }
  SbDistanceFind(pair->kind, at, &g);
  return (PetscBool)(g.d - SbContactPairRadius(p->mesh, pair) >
                     p->reach + PetscSqrtReal(far[0]) + PetscSqrtReal(far[1]));
}

/* Whether the features belong to an overlap (SbContactOverlap.near): such pairs are excluded. */
static inline PetscBool overlaps(SbContactPairs p, const SbContactPair *pair)
{
  const int split = SbContactPairSplit(pair);
  int near[2] = {0, 0};

  for (int k = 0; p->near && k < 4; k++)
    near[k >= split] = PetscMax(near[k >= split], p->near[SbContactNumber(p->mesh, pair->v[k])]);
  if (!near[0] || !near[1])
    return PETSC_FALSE;
  return (PetscBool)(split == 1 ? near[0] == SB_OVERLAP_INSIDE
                                : PetscMax(near[0], near[1]) >= SB_OVERLAP_INTERSECTED);
}

/* Whether the prescribed parts of a pair are at one place: they keep the others of one side from
   passing through those of the other, as a common vertex would. */
static PetscBool joined(SbContactPairs p, const SbContactPair *pair)
{
  PetscReal at[12];

  for (int k = 0; k < 12; k++) {
    const PetscReal *box = p->box + 6 * pair->v[k / 3] + k % 3;

    at[k] = 0.5 * (box[0] + box[3]);
  }
  return (PetscBool)(rim_gap(p->mesh, pair, at) < JOINED * p->mesh->size);
}

/* Adds the pair of a vertex i and a triangle j, or of two edges, if they may come into contact. */
static PetscErrorCode add_features(SbContactPairs p, SbPairKind kind, PetscInt i, PetscInt j)
{
  const SbContactSurface m = p->mesh;
  const PetscBool edges = (PetscBool)(kind == SB_PAIR_EDGE_EDGE);
  const PetscBool turned =
    (PetscBool)(m->edge_number && edges ? m->edge_number[i] > m->edge_number[j] : i > j);
  const PetscInt low = turned ? j : i;
  const PetscInt high = turned ? i : j;
  const PetscInt *a = edges ? m->edge + 2 * low : &i;
  const PetscInt *b = edges ? m->edge + 2 * high : m->triangle + 3 * j;
  SbContactPair pair = {.kind = kind,
                        .v = {a[0], edges ? a[1] : b[0], edges ? b[0] : b[1], edges ? b[1] : b[2]}};
  const PetscInt one = m->part[a[0]];
  const PetscInt two = m->part[b[0]];
  const PetscInt obstacle = m->space->mesh->nbody;
  int driven[2] = {0, 0};
  const int split = SbContactPairSplit(&pair);

  PetscFunctionBeginUser;

  /* of different bodies, one of them the obstacle if there is one, or self-contact, which a rigid
     body has not; not both prescribed */
  if (one != two
        ? m->nvertex > m->nbody_vertex && one != obstacle && two != obstacle
        : !m->self || one == obstacle || (m->space->rigid && m->space->element[one]->rigid))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 4; k++) {
    driven[k >= split] += m->driven[pair.v[k]];
    for (int l = split; k < split && l < 4; l++)
      if (pair.v[k] == pair.v[l])
        PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (driven[0] + driven[1] == 4)
    PetscFunctionReturn(PETSC_SUCCESS);
  pair.rims = (PetscBool)(driven[0] && driven[1] && two != obstacle && one != obstacle);
  if (edges)
    pair.area =
      b[0] >= m->nbody_vertex ? m->edge_area[low] : 0.5 * (m->edge_area[low] + m->edge_area[high]);
  else
    pair.area =
      i < m->nbody_vertex ? m->area[i] : (m->area[b[0]] + m->area[b[1]] + m->area[b[2]]) / 3.;
  if (m->once && edges)
    for (int k = 0; k < 4; k++)
      pair.share[k] = m->edge_share[2 * (k < 2 ? low : high) + k % 2];
  else if (m->once)
    for (int k = 0; k < 6; k++)
      pair.share[k] = m->share[6 * j + k];
  if (overlaps(p, &pair) || stays_apart(p, &pair) || (pair.rims && joined(p, &pair)))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(p->n + 1, sizeof(pair), &p->size, &p->pair));
  p->pair[p->n++] = pair;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Features by kind, those of this rank first; `all`, or only those of others. */
static PetscErrorCode list_features(SbContactPairs p, PetscBool all)
{
  const SbContactSurface m = p->mesh;
  const PetscInt count[] = {m->side == SB_SIDE_NONE ? m->nvertex : m->nbody_vertex, m->ntriangle,
                            m->nedge};

  PetscFunctionBeginUser;
  for (int k = all ? 0 : OTHERS; k < 2 * OTHERS; k++) {
    struct SbContactFeatures *f = &p->features[k];

    f->n = 0;
    for (PetscInt i = 0; i < count[k % OTHERS]; i++) {
      PetscInt own;
      const PetscInt *v = vertices_of(m, k % OTHERS, i, &own);
      PetscBool mine = PETSC_FALSE;

      for (int a = 0; a < corners[k % OTHERS]; a++)
        mine = (PetscBool)(mine || m->mine[v[a]]);
      if (mine != (PetscBool)(k < OTHERS))
        continue;
      PetscCall(SbReserve(f->n + 1, sizeof(*f->item), &f->room[0], &f->item));
      f->item[f->n++] = i;
    }
    PetscCall(SbReserve(f->n, sizeof(*f->box), &f->room[1], &f->box));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsCreate(SbContactSurface m, PetscReal reach, SbContactSearch search,
                                    SbContactPairs *pairs)
{
  SbContactPairs p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  *pairs = p;
  p->mesh = m;
  p->reach = reach;
  p->most = PETSC_MAX_INT;
  p->margin = PetscMax(2. * reach, MARGIN * m->mean_edge);
  if (search == SB_SEARCH_HASH)
    PetscCall(SbSpatialHashCreate(CELL * (m->mean_edge + 2. * p->margin + reach), &p->hash));
  PetscCall(SbContactSurfaceCreateArray(m, &p->shorter));
  PetscCall(PetscCalloc1(6, &p->features));
  PetscCall(list_features(p, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbContactPairsForget(SbContactPairs p)
{
  SbContactSurface m = p->mesh;

  if (m->nbody_vertex - m->nkept_vertex <= 2 * m->nneeded)
    return;
  m->drop = PETSC_TRUE;
  p->known = PETSC_FALSE;
}

PetscErrorCode SbContactPairsDestroy(SbContactPairs *pairs)
{
  PetscFunctionBeginUser;
  if (!*pairs)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 6; k++) {
    struct SbContactFeatures *f = &(*pairs)->features[k];

    PetscCall(SbBoxTreeDestroy(&f->tree));
    PetscCall(PetscFree(f->item));
    PetscCall(PetscFree(f->box));
  }
  PetscCall(SbSpatialHashDestroy(&(*pairs)->hash));
  PetscCall(PetscFree((*pairs)->features));
  PetscCall(SbContactSurfaceDestroyArray((*pairs)->mesh, &(*pairs)->shorter));
  PetscCall(PetscFree((*pairs)->box));
  PetscCall(PetscFree((*pairs)->first));
  PetscCall(PetscFree((*pairs)->place));
  PetscCall(PetscFree((*pairs)->other));
  PetscCall(PetscFree((*pairs)->pair));
  PetscCall(PetscFree(*pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all vertices stay where the pairs were searched for. */
static PetscBool still_within(SbContactPairs p, const PetscReal x0[], const PetscReal x1[])
{
  for (PetscInt v = 0; v < p->nbox; v++) {
    const PetscReal *box = p->box + 6 * v;
    const PetscReal *a = x0 + 3 * v;
    const PetscReal *b = x1 + 3 * v;

    if (!((a[0] >= box[0]) & (a[0] <= box[3]) & (a[1] >= box[1]) & (a[1] <= box[4]) &
          (a[2] >= box[2]) & (a[2] <= box[5]) & (b[0] >= box[0]) & (b[0] <= box[3]) &
          (b[1] >= box[1]) & (b[1] <= box[4]) & (b[2] >= box[2]) & (b[2] <= box[5])))
      return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The sets of features that meet: those of this rank among themselves, and with those of others. */
#define NMEETING 5
static const int meeting[NMEETING][2] = {{VERTEX, TRIANGLE},
                                         {VERTEX, OTHERS + TRIANGLE},
                                         {OTHERS + VERTEX, TRIANGLE},
                                         {EDGE, EDGE},
                                         {EDGE, OTHERS + EDGE}};

/* Adds the pair of feature i and j of the sets of a meeting. */
static inline PetscErrorCode add_meeting(SbContactPairs p, int q, PetscInt i, PetscInt j)
{
  return add_features(p, meeting[q][0] == EDGE ? SB_PAIR_EDGE_EDGE : SB_PAIR_VERTEX_TRIANGLE,
                      p->features[meeting[q][0]].item[i], p->features[meeting[q][1]].item[j]);
}

/* Pairs of features whose boxes meet, by the hash. It holds this rank's features, and of the others
   those that are near them. */
static PetscErrorCode search_hash(SbContactPairs p)
{
  const SbHashPair *found;
  PetscInt n;
  SbHashPairs walk;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH_HASH], 0, 0, 0, 0));
  PetscCall(SbSpatialHashClear(p->hash));
  for (int k = 0; k < 2 * OTHERS; k++)
    PetscCall(SbSpatialHashAdd(p->hash, p->features[k].n, (const PetscReal(*)[6])p->features[k].box,
                               (PetscBool)(k >= OTHERS)));
  PetscCall(SbHashPairsBegin(p->hash, NMEETING, meeting, &walk));
  do {
    PetscCall(SbHashPairsNext(&walk, CHUNK, &n, &found));
    for (PetscInt k = 0; k < n; k++)
      PetscCall(add_meeting(p, found[k].meeting, found[k].a, found[k].b));
    p->ncandidate += n;
    p->full = (PetscBool)(p->n > p->most);
  } while (n && !p->full);
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH_HASH], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same by trees of boxes. */
static PetscErrorCode search_trees(SbContactPairs p)
{
  PetscInt found[2 * CHUNK];

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH_TREE], 0, 0, 0, 0));
  for (int k = 0; k < 6; k++) {
    struct SbContactFeatures *f = &p->features[k];

    if (p->mesh->halo && k >= OTHERS)
      PetscCall(SbBoxTreeDestroy(&f->tree));
    if (p->nsearch == 1 || (p->mesh->halo && k >= OTHERS))
      PetscCall(SbBoxTreeCreate(f->n, (const PetscReal(*)[6])f->box, &f->tree));
    else
      PetscCall(SbBoxTreeRefit(&f->tree, (const PetscReal(*)[6])f->box));
  }
  for (int q = 0; q < NMEETING && !p->full; q++) {
    SbBoxPairs walk;
    PetscInt n;

    SbBoxPairsBegin(&p->features[meeting[q][0]].tree, &p->features[meeting[q][1]].tree, 0., &walk);
    while (!p->full && (n = SbBoxPairsNext(&walk, CHUNK, found)) > 0) {
      for (PetscInt k = 0; k < n; k++)
        PetscCall(add_meeting(p, q, found[2 * k], found[2 * k + 1]));
      p->ncandidate += n;
      p->full = (PetscBool)(p->n > p->most);
    }
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH_TREE], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether pair p comes before q of the same kind and first vertex. */
static inline PetscBool before(const PetscInt place[], const SbContactPair *p,
                               const SbContactPair *q)
{
  for (int k = 1; k < 4; k++)
    if (p->v[k] != q->v[k])
      return (PetscBool)(place[p->v[k]] < place[q->v[k]]);
  return PETSC_FALSE;
}

/* The places of the vertices in the order of their numbers: kept ones are in it, those of other
   ranks by halo_number[], those of the obstacle are last. */
static void find_places(SbContactSurface m, PetscInt place[])
{
  const PetscInt nhalo = m->number ? m->nbody_vertex - m->nkept_vertex : 0;
  PetscInt h = 0;

  for (PetscInt v = 0; v < m->nvertex; v++) {
    if (nhalo && v >= m->nkept_vertex)
      break;
    for (; h < nhalo && m->halo_number[h] < m->number[v]; h++)
      place[m->halo_vertex[h]] = v + h;
    place[v] = v + h;
  }
  for (; h < nhalo; h++)
    place[m->halo_vertex[h]] = m->nkept_vertex + h;
}

/* Orders the pairs by kind, then by numbers of vertices: by counting for the first one, which
   leaves a few for each, by insertion for the others. */
static PetscErrorCode order_pairs(SbContactPairs p)
{
  const PetscInt nvertex = p->mesh->nvertex;
  PetscInt n = 0;
  PetscInt *place;

  PetscFunctionBeginUser;
  find_places(p->mesh, p->place);
  place = p->place;
  PetscCall(PetscArrayzero(p->first, 2 * nvertex));
  for (PetscInt i = 0; i < p->n; i++)
    p->first[(p->pair[i].kind == SB_PAIR_EDGE_EDGE ? nvertex : 0) + place[p->pair[i].v[0]]]++;
  for (PetscInt k = 0; k < 2 * nvertex; k++) {
    n += p->first[k];
    p->first[k] = n - p->first[k];
  }
  PetscCall(SbReserve(p->size, sizeof(*p->other), &p->other_size, &p->other));
  for (PetscInt i = 0; i < p->n; i++) {
    const SbContactPair *pair = &p->pair[i];

    p->other[p->first[(pair->kind == SB_PAIR_EDGE_EDGE ? nvertex : 0) + place[pair->v[0]]]++] =
      *pair;
  }
  for (PetscInt i = 1; i < p->n; i++) {
    const SbContactPair pair = p->other[i];
    PetscInt k = i;

    for (; k > 0 && p->other[k - 1].kind == pair.kind && p->other[k - 1].v[0] == pair.v[0] &&
           before(place, &pair, &p->other[k - 1]);
         k--)
      p->other[k] = p->other[k - 1];
    p->other[k] = pair;
  }
  PetscCall(PetscArraycpy(p->pair, p->other, p->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsFind(SbContactPairs p, const PetscReal x0[], const PetscReal x1[])
{
  const SbContactSurface m = p->mesh;
  PetscReal *const *follow[2] = {SbContactSurfaceFollow(m, x0), SbContactSurfaceFollow(m, x1)};
  PetscInt count[3] = {0, 0, 0};
  PetscBool valid = (PetscBool)(p->known && still_within(p, x0, x1));

  PetscFunctionBeginUser;
  p->full = PETSC_FALSE;
  if (m->halo)
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &valid, 1, SB_MPI_BOOL, MPI_LAND, m->space->comm));
  if (valid)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  p->known = PETSC_TRUE;
  p->nsearch++;
  p->n = p->ncandidate = 0;

  /* what may meet this rank's features, with boxes around vertices */
  if (m->halo) {
    PetscCall(SbContactSurfaceReach(m, p->margin + 0.5 * p->reach, x0, x1));
    PetscCall(list_features(p, PETSC_FALSE));
    x0 = *follow[0];
    x1 = *follow[1];
  }
  PetscCall(SbReserve(6 * m->nvertex, sizeof(*p->box), &p->box_room, &p->box));
  if (2 * m->nvertex > p->first_room)
    PetscCall(PetscFree(p->place));
  PetscCall(SbReserve(2 * m->nvertex, sizeof(*p->first), &p->first_room, &p->first));
  if (!p->place)
    PetscCall(PetscMalloc1(p->first_room, &p->place));
  p->nbox = m->nvertex;
  for (PetscInt v = 0; v < m->nvertex; v++) {
    PetscReal *box = p->box + 6 * v;

    for (int k = 0; k < 3; k++) {
      box[k] = PetscMin(x0[3 * v + k], x1[3 * v + k]) - p->margin;
      box[3 + k] = PetscMax(x0[3 * v + k], x1[3 * v + k]) + p->margin;
    }
  }

  /* boxes of the features around those of their vertices, grown by half the reach */
  for (int k = 0; k < 6; k++) {
    struct SbContactFeatures *f = &p->features[k];

    for (PetscInt i = 0; i < f->n; i++) {
      PetscInt own;
      const PetscInt *v = vertices_of(m, k % OTHERS, f->item[i], &own);
      const PetscReal grown = 0.5 * p->reach + (v[0] < m->nbody_vertex ? 0. : m->radius);

      for (int c = 0; c < 6; c++)
        f->box[i][c] = p->box[6 * v[0] + c];
      for (int a = 1; a < corners[k % OTHERS]; a++)
        SbBoxMerge(f->box[i], p->box + 6 * v[a]);
      for (int c = 0; c < 6; c++)
        f->box[i][c] += c < 3 ? -grown : grown;
    }
  }

  /* those that meet, by number */
  if (p->hash)
    PetscCall(search_hash(p));
  else
    PetscCall(search_trees(p));
  if (p->n > 1 && !p->full)
    PetscCall(order_pairs(p));
  if (p->hash)
    SbSpatialHashCount(p->hash, count);
  PetscCall(PetscInfo(
    NULL,
    "search for pairs: %" PetscInt_FMT " boxes in %" PetscInt_FMT
    " entries of the hash; %" PetscInt_FMT " pairs of boxes meet, %" PetscInt_FMT
    " are kept; %" PetscInt_FMT " vertices held, %" PetscInt_FMT " of other ranks\n",
    count[0], count[1], p->ncandidate, p->n, m->nbody_vertex, m->nbody_vertex - m->nkept_vertex));

  /* a half-space or a bowl: vertices whose boxes come within the reach */
  for (PetscInt v = 0; v < m->nbody_vertex && m->side != SB_SIDE_NONE; v++) {
    SbContactPair pair = {
      .side = PETSC_TRUE, .v = {v, m->nbody_vertex, m->nvertex - 1, v}, .area = m->area[v]};
    PetscReal way = 0.;
    PetscReal away;
    SbDistance g;

    if (!m->mine[v] || m->driven[v] ||
        (p->near && p->near[SbContactNumber(m, v)] == SB_OVERLAP_INSIDE))
      continue;
    for (int i = 0; i < 3; i++)
      way += PetscSqr(x1[3 * v + i] - x0[3 * v + i] - x1[3 * m->nbody_vertex + i] +
                      x0[3 * m->nbody_vertex + i]);
    away = PetscMin(SbContactPairGap(m, &pair, x0, &g), SbContactPairGap(m, &pair, x1, &g)) -
           PetscSqrtReal(way);
    if (away >= p->reach + 4. * p->margin)
      continue;
    PetscCall(SbReserve(p->n + 1, sizeof(pair), &p->size, &p->pair));
    p->pair[p->n++] = pair;
  }
  if (m->halo)
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &p->full, 1, SB_MPI_BOOL, MPI_LOR, m->space->comm));
  if (p->full)
    p->known = PETSC_FALSE;
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first time in (0, 1] at which a t^2 + b t + c, positive at 0, is zero; 1 + : none. */
static PetscReal first_root(PetscReal a, PetscReal b, PetscReal c)
{
  const PetscReal disc = b * b - 4. * a * c;
  PetscReal t = 2.;

  if (disc < 0.)
    return t;

  /* the root without cancellation; with c > 0 the smaller positive one is 2 c / (-b + root) where b
     < 0, and where a < 0 (-b - root) / 2 a */
  if (b < 0.)
    t = 2. * c / (-b + PetscSqrtReal(disc));
  else if (a < 0.)
    t = (-b - PetscSqrtReal(disc)) / (2. * a);
  return t;
}

/* The collision-free fraction of the motion for one pair. */
static PetscReal safe_part(SbContactSurface m, const SbContactPair *pair, PetscReal most,
                           const PetscReal x0[], const PetscReal x1[])
{
  PetscReal a[12], b[12], r0[3], dr[3], n0[3], dn[3], left;
  PetscReal part = 1.;
  SbDistance g;

  places(pair, x0, a);
  places(pair, x1, b);
  if (!pair->side) {
    const SbCCDLimits limits = {.radius = SbContactPairRadius(m, pair), .keep = LEFT, .most = most};

    (void)SbTimeOfImpact(pair->kind, a, b, &limits, &part);
    return part;
  }
  left = PetscMin(LEFT * SbContactPairGap(m, pair, x0, &g), most);
  for (int i = 0; i < 3; i++) {
    r0[i] = a[i] - a[3 + i];
    dr[i] = b[i] - b[3 + i] - r0[i];
    n0[i] = a[6 + i] - a[3 + i];
    dn[i] = b[6 + i] - b[3 + i] - n0[i];
  }
  if (m->side == SB_SIDE_PLANE)
    part = first_root(SbDot3(dn, dr), SbDot3(n0, dr) + SbDot3(dn, r0), SbDot3(n0, r0) - left);
  else
    part = first_root(-SbDot3(dr, dr), -2. * SbDot3(r0, dr),
                      PetscSqr(m->radius - left) - SbDot3(r0, r0));
  return PetscMin(1., part);
}

/* Lowers the fractions of the bodies of a pair. */
static void lower_bodies(SbContactSurface m, const SbContactPair *pair, PetscReal safe,
                         PetscReal body[])
{
  const PetscInt nbody = m->space->mesh->nbody;

  for (int side = 0; side < 2; side++) {
    const PetscInt b = SbContactPairPart(m, pair, side);

    if (b < nbody)
      body[b] = PetscMin(body[b], safe);
  }
}

PetscErrorCode SbContactPairsMaxStep(SbContactPairs p, const PetscReal x0[], const PetscReal x1[],
                                     PetscReal body[], PetscReal *part)
{
  const SbContactSurface m = p->mesh;
  PetscReal *const *follow[2] = {SbContactSurfaceFollow(m, x0), SbContactSurfaceFollow(m, x1)};
  const PetscInt nvertex =
    m->nvertex - m->nbody_vertex + PetscMax(m->nbody_vertex, m->Nbody_vertex);
  PetscReal whole = 1.;
  PetscReal safe;

  PetscFunctionBeginUser;

  /* halve the motion until it has few enough pairs */
  p->most = PetscMin(CROWD * (PetscInt64)(nvertex + CROWD_LEAST), PETSC_MAX_INT / 2);
  PetscCall(SbContactPairsFind(p, x0, x1));
  while (p->full) {
    whole *= 0.5;
    x0 = follow[0] ? *follow[0] : x0;
    x1 = follow[1] ? *follow[1] : x1;
    for (PetscInt k = 0; k < 3 * m->nvertex; k++)
      p->shorter[k] = x0[k] + 0.5 * (x1[k] - x0[k]);
    follow[1] = &p->shorter;
    if (whole <= PETSC_SQRT_MACHINE_EPSILON)
      p->most = PETSC_MAX_INT;
    PetscCall(SbContactPairsFind(p, x0, p->shorter));
  }
  x0 = follow[0] ? *follow[0] : x0;
  x1 = follow[1] ? *follow[1] : x1;
  p->most = PETSC_MAX_INT;

  *part = 1.;
  for (PetscInt i = 0; i < p->n; i++) {
    const SbContactPair *pair = &p->pair[i];

    if (!m->own[pair->v[0]] && !(pair->v[0] >= m->nbody_vertex && m->own[pair->v[1]]))
      continue;
    if (SbContactPairSweptApart(m, pair, x0, x1, p->reach))
      continue;
    safe = safe_part(m, pair, LEFT_MOST * p->reach, x0, x1);
    *part = PetscMin(*part, safe); /* a macro: its arguments are evaluated twice */
    if (body && whole * safe < 1.)
      lower_bodies(m, pair, whole * safe, body);
  }
  *part *= whole;
  PetscFunctionReturn(PETSC_SUCCESS);
}
