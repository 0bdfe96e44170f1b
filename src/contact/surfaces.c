/*
  surfaces.c - contact of surfaces: pairs of their features with an energy of the gap, and friction.

  Barrier. Below the width w pairs of features repel each other by the barrier of pair_energy.c, an
  energy that is infinite at contact. It is part of the potential that Newton's method minimises
  (src/newton), and every iteration is limited by continuous collision detection
  (pairs.c). So an accepted state can be reached from the one before it without
  surfaces passing through each other.

  Prescribed motions, such as an obstacle on its path, are linear within a step; `progress` is the
  fraction that is completed. Newton's method raises it to one as fast as the surfaces allow.

  Friction, -effect_X_sticking exact: multipliers.c. Smooth: Coulomb's law with the normal forces N
  and closest points of the pairs at the start of the step (Li et al., "Incremental potential
  contact", ACM TOG 39(4), 2020, section 4): the energy mu N f0(|u_t|) of the slip u_t since then,
  whose slope rises from 0 to 1 within the slip e = dt times a small speed:

    f0 = u^2/e - u^3/(3 e^2) + e/3,   f0' = 2 u/e - u^2/e^2   for u < e;   f0 = u, f0' = 1   beyond.

  In a static run, or with friction_solves, the step is solved again with the normal forces and
  closest points of the last solution until friction changes by less than a tolerance
  (friction_pairs.c), and reported.

  Initial contact. Bodies that touch when a run begins, or are in each other by less than the width,
  are moved apart rigidly (initial_contacts.c), to a gap of the width (in a static run a little
  less, so that it is felt); where that fails, by their vertices. Beyond the width the barrier holds
  no energy: at half of it, it holds many times that of the deformation, which it would throw them
  apart with, or lose in the first load step. Bodies that intersect by more are separated by penalty
  springs (separation.c); in a static run they are moved apart rigidly, too, as far as their places
  tell how.
*/
#include "surfaces.h"

#define WIDTH 1e-3      /* default w over the size of the smallest body */
#define WIDTH_CUBE 3e-3 /* largest default w over the cube root of its volume */
#define PRESSURE 0.1    /* of Young's modulus of the softer side */
#define SLIP 1e-4       /* sticking speed over the speed of a step (SbModelStepSpeed()) */
#define SLIP_LEAST \
  1e-7 /* least sticking slip e of a time step over the size of the smallest body */
/* The least one that -effect_NAME_slip_speed may give, alike. A block that slides (0.3 m, steps of
   0.01 s) has the same energy at 0.2 s within 4e-5 from 3e-10 to 3e-12, a third of it at 3e-13
   after rejected steps, and no end at 3e-16. */
#define SLIP_ROUNDING 1e-11
#define SLIP_STATIC 1e-5 /* the same of a static load step */
#define STIFFEST_PARTING \
  64. /* largest factor on them: they are some 30 times as stiff as a layer of cells without it */
#define HALF 0.5     /* fraction of the prescribed separation below which springs get stiffer */
#define STIFFEST 11. /* of the shear modulus, for springs: lambda + 2 mu at nu = 0.45 */
#define CLOSED 0.999 /* initial gap over w in static runs, where a force closes it */
#define OPEN 0.99    /* of the initial gap: a pair that is moved apart is so */
#define WIDTH_ROUNDING 1e-6 /* of a gap that is meant to be w, over w */
#define ON 1e-9             /* of the bodies' size: a distance below which it has no direction */
#define ALONG 0.9  /* cosine of a distance and the normal of surfaces in each other, if it counts */
#define NEXT 0.1   /* of the width: faces that are nearer touch */
#define SOFTER 0.1 /* after a failed load step springs of exact constraints have this part ... */
#define SOFTEST \
  0.01 /* ... down to this. Arches of 7 and 9 stones of 30 and 10 GPa fail with 1; forces are right
          to 1e-6 with 0.1 and 0.01, to 4e-4 with 0.001 */
#define SUMS 6      /* in the first record of a checkpoint */
#define FARTHEST 2. /* of the width and the depth: largest displacement of a node by that */
#define MEAN 1.5    /* in time, of the mean of several vertices' displacements, for their node */
#define NEARBY 5.   /* search distance over w for gaps that moving apart may close */
#define PASSES 200  /* sweeps over all pairs for that */
#define WIDTH_LEAST \
  1e-8 /* least w with -accuracy over sizes and coordinates: w/100 is far above rounding */

/* Stiffness of springs of this material, Pa/m: that of a layer of cells. */
static PetscReal spring_of(const Surfaces *b, SbMaterial law)
{
  return b->options.stiffness *
         PetscMin(SbMaterialWaveModulus(law), STIFFEST * SbMaterialShearModulus(law)) /
         b->surface->mean_edge;
}

static PetscErrorCode setup_surfaces(SbEffect e, SbSpace s)
{
  Surfaces *b = (Surfaces *)e->data;
  const PetscInt nbody = s->mesh->nbody;
  PetscReal cube = PETSC_MAX_REAL;
  SbFacet *facet;
  PetscInt n, nobstacle;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerSetUp(e, s->comm, &b->contact.partner));
  PetscCall(SbEffectFacets(s, &e->on, &n, &facet));
  PetscCall(SbContactSurfaceCreate(s, n, facet, b->contact.partner.obstacle, &b->surface));
  for (PetscInt i = 0; i < n && !is_barrier(b); i++)
    PetscCheck(!SbSpaceCellElement(s, facet[i].cell)->rigid, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "effect %s: body '%s' is rigid, whose contact has the response barrier: leave "
               "-effect_%s_response out",
               e->name, s->mesh->body[s->mesh->cell_body[facet[i].cell]].name, e->name);
  PetscCall(PetscFree(facet));
  nobstacle = 3 * (b->surface->nvertex - b->surface->nbody_vertex);
  s->coupled = PETSC_TRUE;
  if (!b->contact.partner.obstacle)
    PetscCall(SbSurfacesFindBodies(e, s->mesh));

  /* width and pressure of each body */
  for (PetscInt i = 0; i < nbody; i++)
    cube = PetscMin(cube, PetscCbrtReal(s->mesh->body[i].volume));
  PetscCall(SbContactSurfaceCreateArray(b->surface, &b->motion.x));
  PetscCall(SbContactSurfaceCreateArray(b->surface, &b->motion.start));
  PetscCall(SbContactSurfaceCreateArray(b->surface, &b->motion.other));
  PetscCall(PetscMalloc4(5 * nbody + 5, &b->widths.w, 3 * s->nnode_owned, &b->motion.u, nobstacle,
                         &b->motion.from, nobstacle, &b->motion.to));
  b->widths.k = b->widths.w + nbody + 1;
  b->widths.mass = b->widths.k + nbody + 1;
  b->widths.guard = b->widths.mass + nbody + 1;
  b->widths.spring = b->widths.guard + nbody + 1;
  b->widths.w[nbody] = b->widths.k[nbody] = b->widths.mass[nbody] = b->widths.guard[nbody] =
    b->widths.spring[nbody] = b->contact.base.width = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < nbody; i++) {
    b->widths.w[i] = b->options.width > 0.
                       ? b->options.width
                       : PetscMin(PetscMin(WIDTH * b->surface->size, WIDTH_CUBE * cube),
                                  0.5 * b->surface->shortest);
    b->contact.base.width = PetscMin(b->contact.base.width, b->widths.w[i]);
    b->widths.mass[i] = s->material[i]->density * s->mesh->body[i].volume;
    b->widths.guard[i] = b->options.pressure > 0.
                           ? b->options.pressure
                           : PRESSURE * SbMaterialYoungModulus(s->material[i]);
    b->widths.spring[i] = spring_of(b, s->material[i]);
    b->widths.k[i] = is_barrier(b) ? b->widths.guard[i] : b->widths.spring[i];
  }
  PetscCheck(
    b->widths.w[0] <= b->surface->shortest, s->comm, PETSC_ERR_USER_INPUT,
    "-effect_%s_barrier_width %g m is larger than the shortest edge of the surface, %g m: take at "
    "most half of that",
    e->name, (double)b->options.width, (double)b->surface->shortest);
  b->surface->self = b->options.self;
  b->surface->once = b->options.once;
  b->surface->rim =
    2. * b->contact.base.width; /* what touches, and what faces turn by as they open */
  PetscCall(SbContactPairsCreate(b->surface, (has_multipliers(b) ? 2. : 1.) * b->widths.w[0],
                                 b->options.search, &b->pairs));
  b->record.least = PETSC_MAX_REAL;
  b->record.shortest = b->separation.stiffer = b->widths.scale = b->multipliers.softer = 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions of the obstacle's vertices at the start and the end of a step from t to t + dt. */
static PetscErrorCode find_path(Surfaces *b, PetscReal t, PetscReal dt)
{
  const SbContactSurface m = b->surface;

  PetscFunctionBeginUser;
  if (!b->contact.partner.obstacle)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbPartnerBeginStep(t, dt, &b->contact.partner));
  for (PetscInt v = m->nbody_vertex; v < m->nvertex; v++) {
    SbPoseApply(&b->contact.partner.pose[0], m->X + 3 * v,
                b->motion.from + 3 * (v - m->nbody_vertex));
    SbPoseApply(&b->contact.partner.pose[1], m->X + 3 * v,
                b->motion.to + 3 * (v - m->nbody_vertex));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The separation direction of a pair at distance zero: the normal of the triangle, or of both
   edges, where surfaces face each other. n: from the second side to the first; false: none. */
static PetscBool facing(const Surfaces *b, const SbContactPair *pair, const PetscReal normal[],
                        PetscReal n[3])
{
  const PetscReal *x[4];
  PetscReal p[3], q[3], length;
  PetscReal outward[2] = {0., 0.};
  const PetscBool edges = (PetscBool)(pair->kind == SB_PAIR_EDGE_EDGE);

  for (int k = 0; k < 4; k++)
    x[k] = b->motion.x + 3 * pair->v[k];
  SbSubtract(x[edges ? 1 : 2], x[edges ? 0 : 1], p);
  SbSubtract(x[3], x[edges ? 2 : 1], q);
  SbCross(p, q, n);
  length = PetscSqrtReal(SbDot3(n, n));
  if (length <= 1e-3 * PetscSqrtReal(SbDot3(p, p) * SbDot3(q, q)))
    return PETSC_FALSE;
  for (int k = 0; k < 4; k++)
    outward[k >= (edges ? 2 : 1)] += SbDot3(n, normal + 3 * pair->v[k]);
  if (edges && outward[1] < 0.)
    length = -length;
  for (int i = 0; i < 3; i++)
    n[i] /= length;
  return (PetscBool)(outward[0] * length < 0. && outward[1] * length > 0.);
}

/* SB_TOUCH_... of both parts of a pair; 0 in self-contact. */
static inline uint8_t how_they_touch(const Surfaces *b, const SbContactPair *pair)
{
  const PetscInt one = b->surface->part[pair->v[0]];
  const PetscInt two = b->surface->part[pair->v[SbContactPairSplit(pair)]];
  const uint8_t *touching = b->separation.overlap.touching;

  return one == two ? 0 : touching[one] & touching[two];
}

/* Whether the surfaces of a pair face each other along its distance: n, their common normal, and
   the signed gap along it, m, negative if they are in each other. */
static PetscBool face_to_face(const Surfaces *b, const SbContactPair *pair,
                              const PetscReal normal[], const SbDistance *d, PetscReal n[3],
                              PetscReal *gap)
{
  if (!facing(b, pair, normal, n) ||
      (d->d >= ON * b->surface->size && PetscAbsReal(SbDot3(n, d->n)) < ALONG))
    return PETSC_FALSE;
  *gap = 0.;
  for (int k = 0; k < 4; k++)
    *gap += d->weight[k] * SbDot3(n, b->motion.x + 3 * pair->v[k]);
  return PETSC_TRUE;
}

/* How a pair stands when a run begins: its gap, m, and d->n, the direction to open it. Of parts
   whose surfaces touch face to face only such pairs count at first, of vertices if there are any:
   the distances of others have no direction, or a wrong one. Returns whether the pair counts. */
static PetscBool initial_gap(const Surfaces *b, const SbContactPair *pair, const PetscReal normal[],
                             SbDistance *d, PetscReal *gap)
{
  const SbContactSurface m = b->surface;
  const uint8_t both = how_they_touch(b, pair);
  PetscReal n[3];

  *gap = SbContactPairGap(m, pair, b->motion.x, d);
  if (pair->side || SbContactPairRadius(m, pair) > 0. ||
      (!(both & SB_TOUCH_NOW) && d->d >= ON * m->size))
    return PETSC_TRUE;
  if ((both & SB_TOUCH_VERTICES && pair->kind == SB_PAIR_EDGE_EDGE) ||
      !face_to_face(b, pair, normal, d, n, gap) ||
      *gap < -SB_TOUCH * of_pair(b, b->widths.w, pair)) /* the other side of a body */
    return PETSC_FALSE;
  for (int i = 0; i < 3; i++)
    d->n[i] = n[i];
  return PETSC_TRUE;
}

/* Parts that touch face to face, or are in each other by less than SB_TOUCH of the width; the
   latter also where rounding hides that an edge goes through a triangle. Collective. */
static PetscErrorCode find_touching(Surfaces *b, const PetscReal normal[])
{
  const SbContactSurface m = b->surface;
  uint8_t *touching = b->separation.overlap.touching;
  const PetscInt nbody = m->space->mesh->nbody;
  PetscReal sunk = b->separation.sunk;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k <= nbody; k++)
    touching[k] &= SB_TOUCH_ONCE;
  for (PetscInt i = 0; i < b->pairs->n && !b->separation.overlapping; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscInt one = m->part[pair->v[0]];
    const PetscInt two = m->part[pair->v[SbContactPairSplit(pair)]];
    const PetscReal w = of_pair(b, b->widths.w, pair);
    const PetscBool edges = (PetscBool)(pair->kind == SB_PAIR_EDGE_EDGE);
    PetscReal n[3], gap;
    SbDistance d;

    if (one == two || pair->side || !counts(b, pair) || SbContactPairRadius(m, pair) > 0. ||
        SbContactPairSweptApart(m, pair, b->motion.x, b->motion.x, SB_TOUCH * w) ||
        SbContactPairGap(m, pair, b->motion.x, &d) >= PetscMin(SB_TOUCH * w, width_of(b, pair)) ||
        !face_to_face(b, pair, normal, &d, n, &gap) || gap >= (edges ? 0. : NEXT * w))
      continue;
    touching[one] |= SB_TOUCH_ONCE | SB_TOUCH_NOW | (edges ? 0 : SB_TOUCH_VERTICES);
    touching[two] |= SB_TOUCH_ONCE | SB_TOUCH_NOW | (edges ? 0 : SB_TOUCH_VERTICES);
    sunk = PetscMax(sunk, -gap);
  }
  PetscCallMPI(MPI_Allreduce(&sunk, &b->separation.sunk, 1, MPIU_REAL, MPI_MAX, m->space->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, touching, (PetscMPIInt)(nbody + 1), MPI_UINT8_T, MPI_BOR,
                             m->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The gap to which a pair is opened when a run begins, m. */
static PetscReal initial_target(const Surfaces *b, const SbContactPair *pair)
{
  const PetscReal w = of_pair(b, b->widths.w, pair);

  return PetscMin(b->contact.base.effect->dynamic ? w : CLOSED * w, width_of(b, pair));
}

static PetscErrorCode initial_contacts_surfaces(SbContact contact, SbSpace s, PetscReal t,
                                                PetscReal dt, const PetscReal u[], PetscBool *first,
                                                SbInitialContacts *list)
{
  Surfaces *b = (Surfaces *)contact;
  const SbEffect e = contact->effect;
  const SbContactSurface m = b->surface;
  PetscReal *normal;

  PetscFunctionBeginUser;
  if (b->motion.begun || t != 0.)
    PetscFunctionReturn(PETSC_SUCCESS); /* it goes on, perhaps from a checkpoint */
  *first = PETSC_TRUE;
  PetscCall(find_path(b, t, dt));
  PetscCall(SbContactSurfaceMarkDriven(m));
  PetscCall(SbSurfacesPlace(b, u, 0., b->motion.x));
  PetscCall(SbSurfacesSeparate(e, s, dt, (PetscBool)!b->separation.searched, PETSC_TRUE));
  b->separation.searched = PETSC_TRUE;
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  PetscCall(PetscMalloc1(3 * m->nvertex, &normal));
  PetscCall(SbContactSurfaceNormals(m, b->motion.x, normal));
  PetscCall(find_touching(b, normal));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscInt one = m->part[pair->v[0]];
    const PetscInt two = m->part[pair->v[SbContactPairSplit(pair)]];
    SbInitialContact touch = {
      .body = {one, two}, .to = initial_target(b, pair), .width = width_of(b, pair)};
    SbDistance d;

    if (one == two || !counts(b, pair))
      continue;
    if (SbContactPairSweptApart(m, pair, b->motion.x, b->motion.x,
                                NEARBY * of_pair(b, b->widths.w, pair)))
      continue;
    if (!initial_gap(b, pair, normal, &d, &touch.gap) ||
        touch.gap > NEARBY * of_pair(b, b->widths.w, pair))
      continue;
    for (int k = 0; k < 3; k++)
      touch.n[k] = d.n[k];
    PetscCall(SbReserve(list->n + 1, sizeof(*list->touch), &list->size, &list->touch));
    list->touch[list->n++] = touch;
  }
  PetscCall(PetscFree(normal));
  b->motion.known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks prescribed vertices that stand just inside another body beside prescribed ones of it, as
   the rims of two blocks that overlap on one clamped base; rims NULL: whether there are some here,
   among the pairs of the places. */
static uint8_t mark_sunk_rims(const Surfaces *b, uint8_t rims[])
{
  const SbContactSurface m = b->surface;
  uint8_t any = 0;

  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    PetscReal n[3];
    PetscReal area;
    SbDistance d;

    if (!pair->rims || pair->kind != SB_PAIR_VERTEX_TRIANGLE || !m->driven[pair->v[0]] ||
        SbContactPairGap(m, pair, b->motion.x, &d) >= m->rim)
      continue;
    area = SbContactTriangleArea(b->motion.x, pair->v + 1, n);
    if (SbDot3(n, d.n) > -area) /* beside the facet, not behind it: |n| = 2 area */
      continue;
    any = SB_OVERLAP_INSIDE;
    for (int k = 0; k < 4; k++)
      if (rims && m->driven[pair->v[k]])
        rims[SbContactNumber(m, pair->v[k])] = SB_OVERLAP_INSIDE;
  }
  return any;
}

/* Sunk rims never part, and their edges go through each other there: pairs of them are excluded.
   Free vertices beside them stay guarded. Collective. */
static PetscErrorCode find_sunk_rims(Surfaces *b)
{
  const SbContactSurface m = b->surface;
  const PetscInt N = m->nvertex - m->nbody_vertex + m->Nbody_vertex;
  uint8_t *rims;
  uint8_t any;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(N, &rims));
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  any = mark_sunk_rims(b, rims);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_UINT8_T, MPI_MAX, m->space->comm));
  if (any) {
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, rims, (PetscMPIInt)N, MPI_UINT8_T, MPI_MAX, m->space->comm));
    b->separation.rims = rims;
    b->pairs->near = b->pairs->near ? b->pairs->near : rims;
    b->pairs->known = b->motion.known = PETSC_FALSE;
  } else
    PetscCall(PetscFree(rims));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether prescribed vertices here stand in the obstacle, or on it, and edges and triangles beside
   them may meet it: half-spaces and bowls have none. */
static uint8_t has_sunk_supports(const Surfaces *b)
{
  const SbContactSurface m = b->surface;
  const PetscReal close = NEXT * b->contact.base.width;
  uint8_t any = 0;

  for (PetscInt v = 0; v < m->nbody_vertex && m->side == SB_SIDE_NONE; v++) {
    PetscReal X[3], n[3];

    SbPoseInvert(&b->contact.partner.pose[0], b->motion.x + 3 * v, X);
    if (m->own[v] && m->driven[v] && SbObstacleDistance(b->contact.partner.obstacle, X, n) < close)
      any = SB_OVERLAP_INSIDE;
  }
  return any;
}

/* What bodies overlap of a half-space, bowl, sphere or capsule: each point with its own
   direction. */
static PetscErrorCode add_points(const Surfaces *b, SbSpace s, SbInitialContacts *list)
{
  const SbContactOverlap *o = &b->separation.overlap;
  SbInitialContacts mine = {0};
  SbInitialContact *touch;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbReserve(o->n, sizeof(*mine.touch), &mine.size, &mine.touch));
  for (PetscInt i = 0; i < o->n; i++) {
    const SbPenetration *p = &o->point[i];
    const PetscInt body = b->surface->part[p->v[0]];

    touch = &mine.touch[mine.n++];
    *touch =
      (SbInitialContact){.body = {body, s->mesh->nbody}, .gap = -p->depth, .to = b->widths.w[body]};
    for (int k = 0; k < 3; k++)
      touch->n[k] = p->normal[k];
  }
  PetscCall(SbAllgatherv(s->comm, MPI_BYTE, mine.n * (PetscInt)sizeof(*touch), mine.touch, &n,
                         &touch, NULL));
  n /= (PetscInt)sizeof(*touch);
  PetscCall(SbReserve(list->n + n, sizeof(*touch), &list->size, &list->touch));
  PetscCall(PetscArraycpy(list->touch + list->n, touch, n));
  list->n += n;
  PetscCall(PetscFree(touch));
  PetscCall(PetscFree(mine.touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode overlaps_surfaces(SbContact contact, SbSpace s, PetscBool *all,
                                        SbInitialContacts *list)
{
  Surfaces *b = (Surfaces *)contact;
  const SbContactOverlap *o = &b->separation.overlap;

  PetscFunctionBeginUser;
  if (!b->separation.overlapping || b->contact.partner.obstacle) { /* supports would sink again */
    uint8_t sunk = b->contact.partner.obstacle ? has_sunk_supports(b) : mark_sunk_rims(b, NULL);

    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sunk, 1, MPI_UINT8_T, MPI_MAX, s->comm));
    *all = (PetscBool)(*all && !sunk);
  }
  if (!b->separation.overlapping)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (b->surface->side != SB_SIDE_NONE || b->surface->radius > 0.) {
    PetscCall(add_points(b, s, list));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  *all = (PetscBool)(*all && o->nway);
  for (PetscInt k = 0; k < o->nway; k++) {
    const PetscInt *part = o->way[k].part;
    SbInitialContact touch = {.body = {part[0], part[1]},
                              .to = PetscMin(b->widths.w[part[0]], b->widths.w[part[1]])};

    for (PetscInt i = 0; i < o->n; i++) {
      const SbPenetration *p = &o->point[i];
      const PetscInt own = b->surface->part[p->v[0]];
      const PetscInt other = b->surface->part[p->v[p->n - 1]];

      if (PetscMin(own, other) == part[0] && PetscMax(own, other) == part[1])
        touch.gap = PetscMin(touch.gap, -p->depth);
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &touch.gap, 1, MPIU_REAL, MPI_MIN, s->comm));
    if (touch.gap == 0.)
      continue; /* of an earlier search */
    *all = (PetscBool)(*all && SbDot3(o->way[k].n, o->way[k].n) > 0.);
    for (int i = 0; i < 3; i++)
      touch.n[i] = o->way[k].n[i];
    PetscCall(SbReserve(list->n + 1, sizeof(*list->touch), &list->size, &list->touch));
    list->touch[list->n++] = touch;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves touching surfaces apart to their initial gap where bodies could not be: Jacobi iterations
   over all closer pairs. Every rank treats its own pairs; displacements of vertices are summed over
   all. */
static PetscErrorCode part_surfaces(SbContact contact, SbSpace s, PetscReal t, PetscReal u[],
                                    PetscBool *moved)
{
  Surfaces *b = (Surfaces *)contact;
  const SbContactSurface m = b->surface;
  PetscReal most; /* of the displacement of a node, m: some pairs, as those beside an overlap, never
                     open */
  PetscReal *normal, *push; /* push[4 v]: sum of displacements of vertex v, and their number */
  PetscReal *begin;         /* u at the beginning */
  PetscReal *node;          /* node[4 i]: sum of displacements of node i, and their number */
  PetscReal far = 0.;       /* farthest that a node has moved since, m */
  const PetscReal beyond = b->contact.base.effect->dynamic ? MEAN : 1.;

  PetscFunctionBeginUser;
  *moved = PETSC_FALSE;
  if (b->motion.begun || t != 0.)
    PetscFunctionReturn(PETSC_SUCCESS); /* it goes on, perhaps from a checkpoint */
  PetscCall(PetscMalloc2(3 * s->nnode_owned, &begin, 4 * s->nnode_owned, &node));
  PetscCall(PetscArraycpy(begin, u, 3 * s->nnode_owned));
  most = FARTHEST * (b->contact.base.width + b->separation.sunk);
  for (int pass = 0; pass < PASSES && far < most; pass++) {
    PetscInt n = 0;

    PetscCall(SbSurfacesPlace(b, u, 0., b->motion.x));
    PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
    PetscCall(PetscCalloc2(4 * m->nvertex, &push, 3 * m->nvertex, &normal));
    PetscCall(SbContactSurfaceNormals(m, b->motion.x, normal));
    PetscCall(find_touching(b, normal));
    for (PetscInt i = 0; i < b->pairs->n; i++) {
      const SbContactPair *pair = &b->pairs->pair[i];
      const PetscReal goal = initial_target(b, pair);
      PetscReal gap;
      PetscReal lever = 0.;
      SbDistance d;

      if (!counts(b, pair))
        continue;
      if (!initial_gap(b, pair, normal, &d, &gap) && d.d >= ON * m->size)
        continue;
      if (gap >= OPEN * goal)
        continue;
      if (!pair->side && d.d < ON * m->size && !facing(b, pair, normal, d.n)) {
        /* along the outward normal of the second side */
        for (int k = 0; k < 3; k++) {
          d.n[k] = 0.;
          for (int v = SbContactPairSplit(pair); v < 4; v++)
            d.n[k] += normal[3 * pair->v[v] + k];
        }
        if (SbNormalise(d.n) <= 0.)
          continue;
      }
      for (int k = 0; k < 4; k++)
        if (!m->driven[pair->v[k]])
          lever += PetscSqr(d.weight[k]);
      if (lever <= 0.)
        continue;
      lever =
        PetscMax(lever, SB_LEVER); /* prescribed vertices hold the pair nearly all by themselves */
      n++;
      for (int k = 0; k < 4; k++) {
        const PetscInt v = pair->v[k];

        if (m->driven[v] || d.weight[k] == 0.)
          continue;
        for (int j = 0; j < 3; j++)
          push[4 * v + j] += (goal - gap) * d.weight[k] / lever * d.n[j];
        push[4 * v + 3]++;
      }
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, s->comm));
    *moved = (PetscBool)(*moved || n);
    PetscCall(SbContactSurfaceSum(m, 4, push));

    /* a node moves by the mean of the vertices that have it: of CR and DG these are many */
    PetscCall(PetscArrayzero(node, 4 * s->nnode_owned));
    for (PetscInt v = 0; v < m->nbody_vertex; v++) {
      for (PetscInt j = m->start[v]; push[4 * v + 3] > 0. && j < m->start[v + 1]; j++) {
        const PetscInt to = 4 * m->node[j];

        if (to < 0 || to >= 4 * s->nnode_owned)
          continue;
        for (int i = 0; i < 3; i++)
          node[to + i] += push[4 * v + i] / push[4 * v + 3];
        node[to + 3]++;
      }
    }
    for (PetscInt k = 0; k < 3 * s->nnode_owned; k++) {
      const PetscReal number = node[4 * (k / 3) + 3];

      if (number > 0. && !(s->fixed[k / 3] >> (k % 3) & 1))
        u[k] += (number > 1. ? beyond : 1.) * node[k + k / 3] / number;
    }
    PetscCall(PetscFree2(push, normal));
    if (!n)
      break;
    for (PetscInt k = 0; k < 3 * s->nnode_owned; k++)
      far = PetscMax(far, PetscAbsReal(u[k] - begin[k]));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &far, 1, MPIU_REAL, MPI_MAX, s->comm));
    PetscCall(SbSpaceUpdateGhosts(s, u));
  }
  PetscCall(PetscFree2(begin, node));
  b->motion.known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy of pairs without multipliers at the current positions, J, and the work of its forces there
   on the obstacle along the path of this step, J; this rank's. They rotate with the obstacle:
   moment times angle. */
static PetscReal gap_energy(const Surfaces *b, PetscReal *along)
{
  PetscReal sum = 0.;

  *along = 0.;
  for (PetscInt i = 0; i < b->active.n && !has_multipliers(b); i++) {
    Term t;

    SbPairTerm(b, i, &t);
    if (!t.counts)
      continue;
    sum += t.energy;
    for (int k = 0; b->contact.partner.obstacle && k < 4; k++) {
      PetscReal way[3];

      if (t.v[k] < b->surface->nbody_vertex)
        continue;
      SbPoseWay(&b->contact.partner.pose[0], &b->contact.partner.pose[1],
                &b->contact.partner.pose[b->motion.progress > 0.], b->motion.x + 3 * t.v[k], way);
      *along += SbDot3(t.gradient + 3 * k, way);
    }
  }
  return sum;
}

/* w = scale times its default. */
static void set_scale(SbEffect e, PetscReal scale)
{
  Surfaces *b = (Surfaces *)e->data;

  for (PetscInt i = 0; i < b->surface->space->mesh->nbody; i++)
    b->widths.w[i] *= scale / b->widths.scale;
  b->contact.base.width *= scale / b->widths.scale;
  b->widths.scale = scale;
  b->motion.known = PETSC_FALSE;
}

static PetscErrorCode scale_width_surfaces(SbContact contact, PetscReal factor, PetscReal growth,
                                           PetscBool *changed)
{
  Surfaces *b = (Surfaces *)contact;
  const SbEffect e = contact->effect;
  PetscReal far = b->surface->size;
  PetscReal least;

  PetscFunctionBeginUser;
  if (!is_barrier(b) || b->options.width > 0. || b->separation.overlapping)
    PetscFunctionReturn(PETSC_SUCCESS);
  b->widths.wider = factor > 1. ? factor : 0.;
  b->widths.growth = growth;
  if (factor > 1.)
    PetscFunctionReturn(PETSC_SUCCESS);
  far = PetscMax(far, b->surface->farthest);
  least = WIDTH_LEAST * far / b->contact.base.width;
  if (least >= 1.)
    PetscFunctionReturn(PETSC_SUCCESS);
  set_scale(e, PetscMax(factor, least) * b->widths.scale);
  *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A static run begins: surfaces that are apart by w, as far as positions tell, are to touch, so
   that w becomes larger by as little. Without it the barrier there has no stiffness to begin
   with. With multipliers w is what it was from the first update on. */
static PetscErrorCode touch_at_width(SbEffect e)
{
  Surfaces *b = (Surfaces *)e->data;
  PetscReal least = PETSC_MAX_REAL; /* over w */

  PetscFunctionBeginUser;
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    SbDistance d;
    const PetscReal gap = SbContactPairGap(b->surface, pair, b->motion.x, &d);

    if (pair->rims)
      continue;
    least = PetscMin(least, gap / of_pair(b, b->widths.w, pair));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_REAL, MPI_MIN, b->surface->space->comm));
  if (PetscAbsReal(least - 1.) < WIDTH_ROUNDING)
    set_scale(e, (1. + 2. * WIDTH_ROUNDING) * b->widths.scale);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a load step that failed, exact constraints have softer springs: where loads are far smaller
   than the stiffness of the bodies, as in an arch of stone, Newton's method cycles between sets of
   pairs. Multipliers then settle in more updates. The next steps have stiffer ones again. */
static void soften(Surfaces *b, PetscReal t, PetscReal dt)
{
  Multipliers *m = &b->multipliers;

  if (b->contact.base.effect->dynamic || !is_exact(b))
    return;
  if (m->tried > 0. && m->begun == t && dt < m->tried)
    m->softer = PetscMax(SOFTEST, SOFTER * m->softer);
  else if (m->begun != t)
    m->softer = PetscMin(1., m->softer / SOFTER);
  m->begun = t;
  m->tried = dt;
}

/* Springs whose forces become multipliers resist the inertia of a layer of cells as well, so that
   these settle as soon in short steps, dt, s, as in long ones. */
static void stiffen(Surfaces *b, PetscReal dt)
{
  const SbContactSurface m = b->surface;

  for (PetscInt i = 0; i < m->space->mesh->nbody && has_multipliers(b); i++)
    b->widths.k[i] =
      b->multipliers.softer * b->widths.spring[i] +
      (b->contact.base.effect->dynamic
         ? b->options.stiffness * m->space->material[i]->density * m->mean_edge / PetscSqr(dt)
         : 0.);
}

/* Keeps the forces of pairs at the start of a load step, and its displacements u: their work is the
   mean of both ends times the way, as that of the loads. */
static PetscErrorCode keep_forces(Surfaces *b, const PetscReal u[])
{
  const PetscInt n = 3 * b->surface->space->nnode_owned;
  const PetscInt nspring = b->springs.n;
  PetscReal *force;

  PetscFunctionBeginUser;
  if (!b->motion.force)
    PetscCall(PetscMalloc2(n, &b->motion.force, n, &b->motion.begin));
  PetscCall(PetscArraycpy(b->motion.begin, u, n));
  PetscCall(PetscCalloc1(3 * b->surface->space->nnode, &force));
  b->springs.n = 0;
  (void)SbSurfacesAddGradient(b, -1., force);
  b->springs.n = nspring;
  PetscCall(PetscArraycpy(b->motion.force, force, n));
  PetscCall(PetscFree(force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Friction has not been updated in this solve. */
static void forget_lag(Surfaces *b)
{
  b->friction.nlag = b->friction.nstuck = 0;
  b->friction.lag = 0.;
  b->friction.least = PETSC_INFINITY;
}

static PetscErrorCode begin_step_surfaces(SbContact contact, SbSpace s, PetscReal t, PetscReal dt,
                                          PetscReal speed, PetscReal u0[])
{
  Surfaces *b = (Surfaces *)contact;
  const SbEffect e = contact->effect;
  const SbContactSurface m = b->surface;
  PetscReal least = PETSC_MAX_REAL;
  PetscReal energy[2], unused;

  PetscFunctionBeginUser;
  PetscCall(find_path(b, t, dt));
  b->contact.base.progress = 0.;
  SbSurfacesBeginResponse(b);
  soften(b, t, dt);
  stiffen(b, dt);
  PetscCall(SbMultipliersRestore(b));
  b->friction.pairs.n = b->friction.next.n = b->springs.n = b->springs.nbounce = 0;
  SbContactPairsForget(b->pairs);
  b->motion.known = (PetscBool)(b->motion.known && b->pairs->known);
  if (!b->motion.begun)
    PetscCall(SbContactSurfaceMarkDriven(m));
  if (!b->motion.begun || b->separation.overlapping || b->separation.parted) {
    PetscCall(SbSurfacesPlace(b, u0, 0., b->motion.x));
    PetscCall(SbSurfacesSeparate(
      e, s, dt, (PetscBool)(!b->motion.begun && !b->separation.searched && t == 0.), PETSC_FALSE));
  }
  if (!b->motion.begun && !b->separation.overlapping)
    PetscCall(find_sunk_rims(b));
  if (!b->motion.begun && t == 0. && !e->dynamic) /* not when it goes on from a checkpoint */
    PetscCall(touch_at_width(e));
  b->motion.begun = PETSC_TRUE;
  PetscCall(SbSurfacesUpdate(b, u0));
  if (b->widths.wider >
      0.) { /* widens the barrier as far as its energy grows by at most `growth` */
    const PetscReal old = b->widths.scale;

    energy[0] = gap_energy(b, &unused);
    set_scale(e, PetscMin(1., b->widths.wider * old));
    PetscCall(SbSurfacesUpdate(b, u0));
    energy[1] = gap_energy(b, &unused);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy, 2, MPIU_REAL, MPI_SUM, s->comm));
    if (energy[1] - energy[0] > b->widths.growth)
      set_scale(e, old);
    b->widths.wider = 0.;
    PetscCall(SbSurfacesUpdate(b, u0));
  }
  PetscCall(PetscArraycpy(b->motion.start, b->motion.x, 3 * m->nvertex));
  for (PetscInt i = 0; i < b->active.n; i++)
    least = PetscMin(least, b->active.pair[i].gap);
  PetscCheck(least > 0., PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "The effect %s: a gap of %g m at the start of a step: edges or corners lie exactly in "
             "each other; move a body a little by -body_NAME_translate",
             e->name, (double)least);
  b->sums.energy = gap_energy(b, &b->sums.obstacle_power);

  /* the first load step begins without force, as if bodies came from apart: that gaps are within w
     already is no work */
  b->motion.from_rest = (PetscBool)(!e->dynamic && !b->motion.accepted && t == 0.);
  if (b->motion.from_rest)
    b->sums.energy = b->sums.obstacle_power = 0.;
  else if (!e->dynamic && has_multipliers(b))
    PetscCall(keep_forces(b, u0));

  /* friction with the normal forces at the start */
  b->friction.slip =
    e->dynamic ? PetscMax(SLIP * speed * dt, SLIP_LEAST * m->size) : SLIP_STATIC * m->size;
  if (b->options.slip_speed > 0. && e->dynamic) {
    const PetscReal slip = b->options.slip_speed * dt;

    PetscCheck(b->motion.accepted || (slip >= SLIP_ROUNDING * m->size && slip <= m->size),
               PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_slip_speed %g m/s is a slip of %g m in a step of %g s: %s the smallest "
               "body, of %g m; give a speed from %g to %g m/s, or 0",
               e->name, (double)b->options.slip_speed, (double)slip, (double)dt,
               slip > m->size ? "more than" : "less than rounding lets follow in", (double)m->size,
               (double)(SLIP_ROUNDING * m->size / dt), (double)(m->size / dt));
    b->friction.slip = PetscMax(slip, SLIP_ROUNDING * m->size); /* of halved steps */
  }
  forget_lag(b);
  PetscCall(SbSurfacesFindFriction(b, PETSC_FALSE));
  SbSurfacesSwapFriction(b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Friction and multipliers stay those of the last solution. */
static PetscErrorCode solve_again_surfaces(SbContact contact, SbSpace s)
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  (void)s;
  forget_lag(b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Joins the bodies between which there is an energy: of an active pair, of lagged friction, of a
   spring. */
static void join_bodies(const Surfaces *b, SbBodySteps *bodies)
{
  const PetscInt *part = b->surface->part;

  for (PetscInt i = 0; i < b->active.n; i++)
    SbBodyStepsJoin(bodies, SbContactPairPart(b->surface, &b->active.pair[i].pair, 0),
                    SbContactPairPart(b->surface, &b->active.pair[i].pair, 1));
  for (PetscInt i = 0; i < b->friction.pairs.n; i++) {
    const SbContactPair *pair = &b->friction.pairs.pair[i].on.pair;

    SbBodyStepsJoin(bodies, SbContactPairPart(b->surface, pair, 0),
                    SbContactPairPart(b->surface, pair, 1));
  }
  for (PetscInt i = 0; i < b->springs.n; i++) {
    const SbPenetration *at = &b->springs.spring[i].at;

    for (PetscInt k = 1; k < at->n; k++)
      SbBodyStepsJoin(bodies, part[at->v[0]], part[at->v[k]]);
  }
}

static PetscErrorCode max_step_surfaces(SbContact contact, SbSpace s, const PetscReal u0[],
                                        const PetscReal u1[], SbBodySteps *bodies, PetscReal *part,
                                        PetscInt *nactive)
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbSurfacesUpdate(b, u0));
  *nactive = b->active.n;
  PetscCall(SbSurfacesPlace(b, u1, 1., b->motion.other));
  PetscCall(SbContactPairsMaxStep(b->pairs, b->motion.x, b->motion.other,
                                  bodies ? bodies->part : NULL, part));
  if (bodies)
    join_bodies(b, bodies);
  b->record.shortest = PetscMin(b->record.shortest, *part);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_surfaces(SbEffect e, SbSpace s, const SbStage *stage)
{
  Surfaces *b = (Surfaces *)e->data;
  const SbContactSurface m = b->surface;
  PetscReal power;
  PetscReal progress[2] = {0., 0.};             /* of springs: what they opened, what they should */
  const PetscReal part = e->dynamic ? 1. : 0.5; /* of the work that forces at the end do */

  PetscFunctionBeginUser;
  PetscCall(SbSurfacesUpdate(b, stage->u));

  /* work of contact on the bodies in the step: of pairs, by their energy or, with multipliers, the
     forces at its end, in load steps at both ends; of friction; of springs */
  b->contact.base.work = b->sums.energy + 0.5 * b->sums.obstacle_power;
  b->sums.energy = gap_energy(b, &power);
  b->contact.base.work += 0.5 * power - b->sums.energy;
  for (PetscInt i = 0; i < b->active.n && has_multipliers(b); i++) {
    Term t;

    SbPairTerm(b, i, &t);
    for (int k = 0; k < 12 && t.counts; k++) {
      const PetscInt c = 3 * t.v[k / 3] + k % 3;

      if (t.v[k / 3] < m->nbody_vertex)
        b->contact.base.work -= part * t.gradient[k] * (b->motion.x[c] - b->motion.start[c]);
    }
  }
  for (PetscInt k = 0; k < 3 * s->nnode_owned && b->motion.force && !b->motion.from_rest; k++)
    b->contact.base.work += (1. - part) * b->motion.force[k] * (stage->u[k] - b->motion.begin[k]);
  b->motion.accepted = PETSC_TRUE;
  for (PetscInt i = 0; i < b->friction.pairs.n; i++) {
    const FrictionPair *pair = &b->friction.pairs.pair[i];
    PetscReal u[3], q[3];
    const PetscReal factor = SbPairFrictionFactor(b, SbPairSticking(b, pair, q));

    if (!counts(b, &pair->on.pair))
      continue;
    (void)SbPairSlip(b, pair, u);
    b->friction.loss += factor * SbDot3(q, u);
    if (b->options.sticks) /* less what its spring stores */
      b->friction.loss -= (PetscSqr(factor) * SbDot3(q, q) - SbDot3(pair->tangent, pair->tangent)) /
                          (2. * pair->stiffness);
    for (int k = 0; k < 12; k++) {
      const PetscInt v = pair->on.pair.v[k / 3];
      const PetscInt c = 3 * v + k % 3;

      if (v < m->nbody_vertex)
        b->contact.base.work -=
          factor * q[k % 3] * pair->on.at.weight[k / 3] * (b->motion.x[c] - b->motion.start[c]);
    }
  }
  for (PetscInt i = 0; i < b->springs.n; i++) {
    const Spring *spring = &b->springs.spring[i];
    const PetscReal way = SbSpringPlace(b, spring) - spring->start;
    PetscReal push[15];

    if (!counts_spring(b, spring))
      continue;
    b->contact.base.work += SbSpringForce(b, spring, push) * way;
    if (i >= b->springs.n - b->springs.nbounce)
      continue;
    progress[0] += PetscMin(way, spring->goal - spring->start);
    progress[1] += spring->goal - spring->start;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, progress, 2, MPIU_REAL, MPI_SUM, s->comm));
  b->sums.work += b->contact.base.work;
  PetscCall(SbMultipliersKeep(b));
  b->separation.parted = PETSC_FALSE;
  if (progress[1] > 0.)
    b->separation.stiffer = progress[0] < HALF * progress[1]
                              ? PetscMin(STIFFEST_PARTING, 2. * b->separation.stiffer)
                              : PetscMax(1., 0.5 * b->separation.stiffer);

  if (b->contact.friction.mu > 0.)
    PetscCall(SbSurfacesLag(b));
  b->friction.most = PetscMax(b->friction.most, b->friction.lag);

  for (PetscInt i = 0; i < b->active.n; i++)
    b->record.least = PetscMin(b->record.least, b->active.pair[i].gap);
  b->record.most = PetscMax(b->record.most, b->active.n);
  if (!b->options.verify || b->separation.overlapping)
    PetscFunctionReturn(PETSC_SUCCESS);
  b->separation.overlap.coplanar = PETSC_FALSE;
  b->separation.overlap.touch = 0.;
  PetscCall(SbContactOverlapFind(b->surface, b->motion.x, PETSC_FALSE, &b->separation.overlap));
  PetscCheck(!b->separation.overlap.ncrossing, s->comm, PETSC_ERR_PLIB,
             "The effect %s: at t = %g s %" PetscInt_FMT
             " edges go through triangles, one at (%g, %g, %g) m",
             e->name, (double)stage->t, b->separation.overlap.ncrossing,
             (double)b->separation.overlap.place[0], (double)b->separation.overlap.place[1],
             (double)b->separation.overlap.place[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a record of a checkpoint has, at PAIR_KEY; a multiplier has its force there. */
enum {
  RECORD_SUMS = -1, /* SUMS numbers: accumulated sums, and factors that go from step to step */
  RECORD_WAY = -2,  /* parts that overlap, and their direction */
  RECORD_PART = -3  /* a part, and SB_TOUCH_... of it */
};

/* Adds a record of n numbers. */
static void add_record(PetscInt nstate, PetscInt *at, PetscReal records[], int kind, int n,
                       const PetscReal number[])
{
  PetscReal *record = records + nstate * (*at)++;

  for (int i = 0; i < n; i++)
    record[i] = number[i];
  record[PAIR_KEY] = kind;
}

/* Forces follow from the positions and the multipliers: these are saved, accumulated sums, of which
   each rank has its own, and what the separation of an overlap goes on from. */
static PetscErrorCode save_surfaces(SbEffect e, SbSpace s, PetscInt *n, PetscReal **records)
{
  const Surfaces *b = (const Surfaces *)e->data;
  const PairForces *m = &b->multipliers.kept;
  const SbContactOverlap *o = &b->separation.overlap;
  const PetscInt npart = o->touching ? s->mesh->nbody + 1 : 0;
  const PetscReal sum[SUMS] = {b->sums.work + b->contact.base.given,
                               b->friction.loss,
                               s->rank ? 0. : b->separation.stiffer,
                               s->rank ? 0. : b->widths.scale,
                               s->rank ? 0. : (PetscReal)b->separation.opening,
                               s->rank ? 0. : b->contact.overlap.longest};
  PetscInt at = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(e->nstate * (1 + m->n + o->nway + npart), records));
  add_record(e->nstate, &at, *records, RECORD_SUMS, SUMS, sum);
  for (PetscInt k = 0; k < o->nway && !s->rank; k++) {
    const SbOverlapWay *w = &o->way[k];

    add_record(
      e->nstate, &at, *records, RECORD_WAY, 5,
      (const PetscReal[]){(PetscReal)w->part[0], (PetscReal)w->part[1], w->n[0], w->n[1], w->n[2]});
  }
  for (PetscInt k = 0; k < npart && !s->rank; k++)
    if (o->touching[k] & (SB_TOUCH_OVERLAP | SB_TOUCH_PARTED))
      add_record(e->nstate, &at, *records, RECORD_PART, 2,
                 (const PetscReal[]){(PetscReal)k, (PetscReal)o->touching[k]});
  for (PetscInt k = 0; k < m->n && !s->rank; k++) {
    PetscReal *record = *records + e->nstate * at++;

    for (int i = 0; i < PAIR_KEY; i++)
      record[i] = m->pair[k].key[i];
    record[PAIR_KEY] = m->pair[k].force;
    for (int i = 0; i < 3; i++)
      record[PAIR_KEY + 1 + i] = m->pair[k].tangent[i];
  }
  *n = at;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_surfaces(SbEffect e, SbSpace s, PetscReal t, const PetscReal u[],
                                    PetscInt n, const PetscReal records[])
{
  Surfaces *b = (Surfaces *)e->data;
  PairForces *m = &b->multipliers.kept;
  SbContactOverlap *o = &b->separation.overlap;
  PetscReal sum[SUMS] = {0.};

  PetscFunctionBeginUser;
  (void)t;
  (void)u;
  m->n = o->nway = 0;
  PetscCall(SbReserve(n, sizeof(*m->pair), &m->size, &m->pair));
  PetscCall(SbContactOverlapCreate(b->surface, o));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *record = records + e->nstate * k;

    if (record[PAIR_KEY] == RECORD_SUMS) {
      for (int i = 0; i < SUMS; i++)
        sum[i] += record[i];
    } else if (record[PAIR_KEY] == RECORD_WAY) {
      PetscCall(SbReserve(o->nway + 1, sizeof(*o->way), &o->way_size, &o->way));
      o->way[o->nway++] = (SbOverlapWay){.part = {(PetscInt)record[0], (PetscInt)record[1]},
                                         .n = {record[2], record[3], record[4]}};
    } else if (record[PAIR_KEY] == RECORD_PART) {
      o->touching[(PetscInt)record[0]] = (uint8_t)record[1];
      b->separation.resumed = b->separation.announced = PETSC_TRUE;
    } else {
      for (int i = 0; i < PAIR_KEY; i++)
        m->pair[m->n].key[i] = (PetscInt)record[i];
      m->pair[m->n].force = record[PAIR_KEY];
      for (int i = 0; i < 3; i++)
        m->pair[m->n].tangent[i] = record[PAIR_KEY + 1 + i];
      m->n++;
    }
  }
  b->sums.work = s->rank ? 0. : sum[0];
  b->friction.loss = s->rank ? 0. : sum[1];
  b->separation.stiffer = sum[2];
  if (sum[3] > 0. && b->options.width == 0.)
    set_scale(e, sum[3]);
  b->separation.opening = (PetscInt)sum[4];
  b->contact.overlap.longest = sum[5];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a solve: multipliers, then friction. Where only friction has multipliers, a time step takes
   those of the step before. */
static PetscErrorCode update_surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                      PetscBool solved, PetscBool *again)
{
  Surfaces *b = (Surfaces *)contact;
  const PetscBool settles = (PetscBool)(!contact->effect->dynamic || b->options.settled > 0.);

  PetscFunctionBeginUser;
  if (solved && (has_multipliers(b) || (b->options.sticks && settles))) {
    PetscCall(SbSurfacesUpdate(b, u));
    PetscCall(SbMultipliersUpdate(b, again));
    if (has_multipliers(b) && b->widths.scale > 1.) { /* touch_at_width(): their forces exist now */
      set_scale(contact->effect, 1.);
      *again = PETSC_TRUE;
    }
    if (*again)
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbContactUpdateFriction_Surfaces(contact, s, u, solved, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_surfaces(SbEffect e)
{
  Surfaces *b = (Surfaces *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbContactPairsDestroy(&b->pairs));
  PetscCall(SbContactSurfaceDestroy(&b->surface)); /* with positions */
  PetscCall(PetscFree4(b->widths.w, b->motion.u, b->motion.from, b->motion.to));
  PetscCall(PetscFree2(b->motion.force, b->motion.begin));
  PetscCall(PetscFree(b->columns.slot));
  PetscCall(PetscFree3(b->columns.column, b->columns.text, b->columns.place));
  PetscCall(PetscFree(b->active.pair));
  PetscCall(PetscFree(b->multipliers.now.pair));
  PetscCall(PetscFree(b->multipliers.kept.pair));
  PetscCall(PetscFree(b->friction.pairs.pair));
  PetscCall(PetscFree(b->friction.next.pair));
  PetscCall(PetscFree(b->blocks.block));
  PetscCall(PetscFree(b->blocks.slot));
  PetscCall(PetscFree(b->springs.spring));
  PetscCall(SbContactOverlapFree(&b->separation.overlap));
  PetscCall(PetscFree(b->separation.rims));
  PetscCall(SbPartnerDestroy(&b->contact.partner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbContactOps surface_ops = {
  .initial_contacts = initial_contacts_surfaces,
  .overlaps = overlaps_surfaces,
  .warn_overlaps = SbContactWarnOverlaps_Surfaces,
  .part = part_surfaces,
  .begin_step = begin_step_surfaces,
  .solve_again = solve_again_surfaces,
  .find_impacts = SbContactFindImpacts_Surfaces,
  .gradient = SbContactGradient_Surfaces,
  .hessian = SbContactHessian_Surfaces,
  .max_step = max_step_surfaces,
  .update_friction = update_surfaces,
  .constraints = SbContactConstraints_Pairs,
  .holding = SbContactHolding_Pairs,
  .fall_back = SbContactFallBack_Surfaces,
  .impact_work = SbContactImpactWork_Surfaces,
  .scale_restitution = SbContactScaleRestitution_Surfaces,
  .gap = SbContactGap_Surfaces,
  .points = SbContactPoints_Surfaces,
  .nearest = SbContactNearest_Surfaces,
  .warn_at_end = SbContactWarnAtEnd_Surfaces,
  .gap_forces = SbContactGapForces_Surfaces,
  .scale_width = scale_width_surfaces,
};
static const SbEffectOps surface_effect = {
  .setup = setup_surfaces,
  .force = SbEffectForce_Surfaces,
  .accept = accept_surfaces,
  .save = save_surfaces,
  .load = load_surfaces,
  .history = SbEffectHistory_Surfaces,
  .summary = SbEffectSummary_Surfaces,
  .destroy = destroy_surfaces,
};

PetscErrorCode SbSurfacesCreate(SbEffect e, const SbScope *scope)
{
  static const char *const obstacle[] = {
    "force_x",     "force_y", "force_z", "torque_x",      "torque_y",     "torque_z", "contacts",
    "penetration", "gap",     "energy",  "friction_loss", "friction_lag", "unguarded"};
  static const char *const bodies[] = {
    "contacts",      "penetration", "penetration_mean", "normal_force", "friction_force", "work",
    "friction_loss", "gap",         "energy",           "friction_lag", "unguarded"};
  Surfaces *b = (Surfaces *)e->data;
  int search, sticking, unsettled, weights;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "barrier_width", &b->options.width));
  PetscCall(SbOptionReal(scope, "barrier_pressure", &b->options.pressure));
  PetscCall(SbOptionBool(scope, "verify", &b->options.verify));
  PetscCall(SbOptionChoice(scope, "search", &search));
  b->options.search = (SbContactSearch)search;
  if (search == SB_SEARCH_AUTO)
    b->options.search = b->contact.partner.obstacle ? SB_SEARCH_TREE : SB_SEARCH_HASH;
  if (!b->contact.partner.obstacle) {
    PetscCall(SbOptionBool(scope, "self", &b->options.self));
    PetscCall(SbOptionBool(scope, "pairs", &b->options.pairs));
  }
  PetscCall(SbOptionInt(scope, "friction_solves", &b->options.friction_solves));
  PetscCall(SbOptionReal(scope, "friction_tolerance", &b->options.friction_tolerance));
  e->ops = surface_effect;
  PetscCall(SbOptionReal(scope, "stiffness", &b->options.stiffness));
  PetscCall(SbOptionReal(scope, "multiplier_tolerance", &b->options.settled));
  PetscCall(SbOptionChoice(scope, "sticking", &sticking));
  b->options.sticks = (PetscBool)(b->contact.friction.mu > 0. && sticking == 0);
  PetscCall(SbOptionReal(scope, "slip_speed", &b->options.slip_speed));
  PetscCheck(b->options.slip_speed == 0. || sticking == 1, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_slip_speed is of -effect_%s_sticking smooth: give that, too, or leave it "
             "out; with exact nothing creeps",
             e->name, e->name);
  b->contact.base.ops = &surface_ops;
  b->contact.base.exact = is_exact(b);
  b->contact.base.rigid = has_multipliers(b);
  b->contact.base.saddle = (PetscBool)(b->contact.response == MULTIPLIER);
  b->contact.base.springs = (PetscBool)(b->contact.friction.mu > 0.);
  e->linear = PETSC_FALSE;
  PetscCall(SbOptionChoice(scope, "weights", &weights));
  b->options.once = (PetscBool)(weights == 1);
  PetscCall(SbOptionChoice(scope, "unsettled", &unsettled));
  b->fall_back.response = b->contact.response;
  b->fall_back.may = (PetscBool)(has_multipliers(b) && unsettled == 2);
  e->nstate = PAIR_KEY + 4;
  e->column = b->contact.partner.obstacle ? obstacle : bodies;
  e->ncolumn = b->contact.partner.obstacle ? PETSC_STATIC_ARRAY_LENGTH(obstacle)
                                           : PETSC_STATIC_ARRAY_LENGTH(bodies);
  PetscFunctionReturn(PETSC_SUCCESS);
}
