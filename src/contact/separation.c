/*
  separation.c - one-sided springs along fixed directions, which separate overlaps; impacts.c has
  those of restitution.

  A spring has the energy k/2 (g - goal)^2 while g = n . sum weight x is below a goal; each step has
  new ones.

  Surfaces that are in each other by less than the width of the barrier when a run begins only
  touch: they are moved apart rigidly (initial_contacts.c).

  Overlap. Each penetrating point (overlap.c) is moved out by a part of its depth in
  each step, so that the depth falls to 1/e in -effect_X_separation_steps steps; by the width of the
  barrier at least, the last time to a gap of that width, and in a static run at once. Springs that
  reach less than half of that get stiffer. Pairs of the overlap are excluded from barrier and
  collision detection until they are apart by the width; springs keep what is outside there
  meanwhile, and open what intersects no longer: at small gaps the barrier has many times the energy
  of the deformation.
*/
#include "surfaces.h"

#define STIFF 10.  /* static run: stiffness over that of the barrier */
#define HELD 5.    /* of the width: gap within which what is outside is kept there */
#define FRONT 0.7  /* cosine of a gap and the direction of separation that opens it */
#define OPENED 0.9 /* of the width: a gap at which what overlapped is apart */
#define OPENING 30 /* most steps for that: bodies pressed from outside may never be */
#define SAME 1e-5  /* of the bodies' size: positions this close coincide */

/* Whether two bodies coincide: then no separation direction exists. */
static PetscErrorCode same_place(const Surfaces *b, const PetscInt body[2], PetscBool *same)
{
  const SbContactSurface m = b->surface;
  PetscReal box[2][6];
  PetscReal most = 0.;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    SbBoxClear(box[k]);
    for (PetscInt v = 0; v < m->nbody_vertex; v++)
      if (m->part[v] == body[k])
        SbBoxAdd(box[k], b->motion.x + 3 * v);
    for (int i = 3; i < 6; i++)
      box[k][i] = -box[k][i];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box, 12, MPIU_REAL, MPI_MIN, m->space->comm));
  for (int i = 0; i < 6; i++)
    most = PetscMax(most, PetscAbsReal(box[0][i] - box[1][i]));
  *same = (PetscBool)(most < SAME * m->size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A spring for a pair that is to be opened to the gap `to`, m, from d. */
static PetscErrorCode add_opening(Surfaces *b, const SbContactPair *pair, const SbDistance *d,
                                  PetscReal gap, PetscReal to)
{
  const PetscReal k = of_pair(b, b->widths.k, pair);
  const PetscReal w = of_pair(b, b->widths.w, pair);
  PetscReal lever = 0.;
  Spring spring = {.at = {.area = pair->area, .number = b->springs.n},
                   .stiffness = b->separation.stiffer * k * pair->area / w};

  PetscFunctionBeginUser;
  for (int i = 0; i < 4; i++)
    lever += b->surface->driven[pair->v[i]] ? 0. : PetscSqr(d->weight[i]);
  if (lever < SB_LEVER)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int pass = 0; pass < 2; pass++) { /* positive weights first */
    for (int i = 0; i < 4; i++) {
      if (pass ? d->weight[i] >= 0. : d->weight[i] <= 0.)
        continue;
      spring.at.v[spring.at.n] = pair->v[i];
      spring.at.weight[spring.at.n++] = d->weight[i];
    }
  }
  for (int i = 0; i < 3; i++)
    spring.at.normal[i] = d->n[i];
  spring.start = SbSpringPlace(b, &spring);
  spring.goal = spring.start + to - gap;
  PetscCall(SbReserve(b->springs.n + 1, sizeof(spring), &b->springs.size, &b->springs.spring));
  b->springs.spring[b->springs.n++] = spring;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* While bodies overlap, what of them is outside the other one already is kept there by springs, in
   place of the barrier that is excluded: it would fall back. That are pairs whose gap opens along
   the direction of separation. Collective. */
static PetscErrorCode hold_parted(Surfaces *b)
{
  const SbContactSurface m = b->surface;
  const SbContactOverlap *o = &b->separation.overlap;
  const uint8_t *near = b->pairs->near;

  PetscFunctionBeginUser;
  b->pairs->near = NULL;
  b->pairs->known = PETSC_FALSE;
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  b->pairs->near = near;
  b->pairs->known = PETSC_FALSE;
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscInt one = m->part[pair->v[0]];
    const PetscInt two = m->part[pair->v[SbContactPairSplit(pair)]];
    const PetscReal w = of_pair(b, b->widths.w, pair);
    PetscReal along, gap;
    SbDistance d;
    PetscInt k = 0;

    if (one == two || pair->side || SbContactPairRadius(m, pair) > 0.)
      continue;
    while (k < o->nway &&
           (o->way[k].part[0] != PetscMin(one, two) || o->way[k].part[1] != PetscMax(one, two)))
      k++;
    if (k == o->nway)
      continue;
    gap = SbContactPairGap(m, pair, b->motion.x, &d);
    along = (one < two ? 1. : -1.) * SbDot3(d.n, o->way[k].n);
    if (gap < HELD * w && along > FRONT)
      PetscCall(add_opening(b, pair, &d, gap, w));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies that overlapped and do so no longer are opened on to the width of the barrier by springs,
   and stay without it until then, or for OPENING steps: the barrier has much energy at small gaps.
   Collective. */
static PetscErrorCode open_parted(Surfaces *b)
{
  const SbContactSurface m = b->surface;
  SbContactOverlap *o = &b->separation.overlap;
  const PetscInt nbody = m->space->mesh->nbody;
  PetscInt parted = 0;
  PetscBool open = PETSC_TRUE;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k <= nbody; k++)
    parted += (o->touching[k] & SB_TOUCH_PARTED) != 0;
  if (!parted)
    PetscFunctionReturn(PETSC_SUCCESS);
  b->pairs->near = b->separation.rims;
  b->pairs->known = PETSC_FALSE;
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscInt one = m->part[pair->v[0]];
    const PetscInt two = m->part[pair->v[SbContactPairSplit(pair)]];
    const PetscReal w = of_pair(b, b->widths.w, pair);
    PetscReal gap;
    SbDistance d;

    if (one == two || pair->side || SbContactPairRadius(m, pair) > 0. ||
        !(o->touching[one] & o->touching[two] & SB_TOUCH_PARTED))
      continue;
    gap = SbContactPairGap(m, pair, b->motion.x, &d);
    if (gap >= w)
      continue;
    open = (PetscBool)(open && gap >= OPENED * w);
    for (int k = 0; k < 4; k++)
      o->near[SbContactNumber(m, pair->v[k])] = SB_OVERLAP_INSIDE;
    if (SbDot3(d.n, d.n) > 0.)
      PetscCall(add_opening(b, pair, &d, gap, w));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &open, 1, SB_MPI_BOOL, MPI_LAND, m->space->comm));
  if (open || ++b->separation.opening > OPENING) {
    b->springs.n = 0;
    for (PetscInt k = 0; k <= nbody; k++)
      o->touching[k] &= ~SB_TOUCH_PARTED;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  b->separation.overlapping = PETSC_TRUE;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, o->near,
                             (PetscMPIInt)(m->nvertex - m->nbody_vertex + m->Nbody_vertex),
                             MPI_UINT8_T, MPI_MAX, m->space->comm));
  b->pairs->near = o->near;
  b->pairs->known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactWarnOverlaps_Surfaces(SbContact contact, SbSpace s, SbParted how)
{
  static const char *const text[] = {
    [SB_PARTED_RIGIDLY] = "moved apart",
    [SB_PARTED_BY_SUPPORTS] = "moved apart with their supports, and pushed together from there",
    [SB_PARTED_BY_SPRINGS] = "separated by springs in the first load step, as supports or shapes "
                             "let nothing else; the energy balance has an error by that"};
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  if (b->separation.found[0])
    PetscCall(SbWarning(s->comm, "%s. They are %s", b->separation.found, text[how]));
  b->separation.found[0] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfacesSeparate(SbEffect e, SbSpace s, PetscReal dt, PetscBool first,
                                  PetscBool touch)
{
  Surfaces *b = (Surfaces *)e->data;
  const SbContactSurface m = b->surface;
  SbContactOverlap *o = &b->separation.overlap;
  PetscBool inside = PETSC_FALSE;
  PetscBool same = PETSC_FALSE;
  const PetscInt N = m->nvertex - m->nbody_vertex + m->Nbody_vertex;
  PetscInt body[2] = {0, 0};
  uint8_t *was; /* o->near of the overlap itself */

  PetscFunctionBeginUser;
  b->springs.n = 0;
  o->touch = touch && !b->separation.overlapping ? SB_TOUCH * b->contact.base.width : 0.;
  if (!b->motion.begun && !b->separation.resumed && !b->contact.partner.obstacle)
    PetscCall(SbContactSurfaceIsInside(m, b->motion.x, body, &inside));
  o->coplanar = PETSC_TRUE;
  for (PetscInt k = 0; k <= s->mesh->nbody && o->touching; k++)
    if (o->touching[k] & SB_TOUCH_OVERLAP)
      o->touching[k] |= SB_TOUCH_PARTED;
  PetscCall(SbContactOverlapFind(m, b->motion.x, inside, o));
  if (inside)
    PetscCall(same_place(b, body, &same));
  PetscCheck(!inside || (o->npoint && !same), s->comm, PETSC_ERR_USER_INPUT,
             "The effect %s: body %s is inside body %s when the run begins, or in the same place; "
             "move one of them by "
             "-body_%s_translate",
             e->name, s->mesh->body[body[0]].name, s->mesh->body[body[1]].name,
             s->mesh->body[body[0]].name);
  b->separation.overlapping = (PetscBool)(o->ncrossing > 0 && !o->touches);
  if (o->touches)
    b->separation.sunk = PetscMax(b->separation.sunk, o->farthest);

  /* a body wholly inside the obstacle has no separation direction */
  if (first && b->contact.partner.obstacle && !o->ncrossing) {
    PetscReal place[4] = {-1., PETSC_MIN_REAL, PETSC_MIN_REAL, PETSC_MIN_REAL}; /* body, x */
    PetscInt lowest[2] = {PETSC_MAX_INT, PETSC_MAX_INT}; /* number of all ranks, of this one */
    SbPose pose;

    PetscCall(SbPartnerPose(&b->contact.partner, 0., &pose));
    for (PetscInt v = 0; v < m->nbody_vertex; v++) {
      PetscReal X[3], n[3];

      SbPoseInvert(&pose, b->motion.x + 3 * v, X);
      if (lowest[1] < PETSC_MAX_INT || !m->own[v] || m->driven[v] ||
          SbObstacleDistance(b->contact.partner.obstacle, X, n) > -SAME * m->size)
        continue;
      lowest[0] = lowest[1] = SbContactNumber(m, v);
      place[0] = (PetscReal)m->part[v];
      PetscCall(PetscArraycpy(place + 1, b->motion.x + 3 * v, 3));
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, lowest, 1, MPIU_INT, MPI_MIN, s->comm));
    for (int i = 0; lowest[1] != lowest[0] && i < 4; i++)
      place[i] = PETSC_MIN_REAL;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, place, 4, MPIU_REAL, MPI_MAX, s->comm));
    if (lowest[0] < PETSC_MAX_INT) {
      const char *name = s->mesh->body[(PetscInt)place[0]].name;

      SETERRQ(s->comm, PETSC_ERR_USER_INPUT,
              "The effect %s: %s is inside the obstacle when the run begins, at (%g, %g, %g) m; "
              "move it by "
              "-body_%s_translate",
              e->name, name, (double)place[1], (double)place[2], (double)place[3], name);
    }
  }
  if (b->pairs->near || b->separation.overlapping)
    b->pairs->known = PETSC_FALSE;
  b->pairs->near = b->separation.overlapping ? o->near : b->separation.rims;
  b->motion.known = PETSC_FALSE;
  if (!b->separation.overlapping) {
    if (e->dynamic && (b->motion.begun || b->separation.resumed))
      PetscCall(open_parted(b));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  b->separation.opening = 0;

  /* excludes pairs of gap zero, too, as of a vertex in a triangle, and those of what is intersected
     with a surface nearer than the width, as of sides in a common plane: the barrier has much
     energy there */
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  PetscCall(PetscMalloc1(N, &was));
  PetscCall(PetscArraycpy(was, o->near, N));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscInt one = m->part[pair->v[0]];
    const PetscInt two = m->part[pair->v[SbContactPairSplit(pair)]];
    PetscReal limit = SAME * m->size;
    SbDistance d;

    for (int k = 0; k < 4 && one != two; k++)
      if (o->touching[one] & o->touching[two] & SB_TOUCH_OVERLAP && !pair->side &&
          was[SbContactNumber(m, pair->v[k])] >= SB_OVERLAP_INTERSECTED)
        limit = of_pair(b, b->widths.w, pair);
    if (SbContactPairGap(m, pair, b->motion.x, &d) > limit)
      continue;
    for (int k = 0; k < 4; k++)
      o->near[SbContactNumber(m, pair->v[k])] = SB_OVERLAP_INSIDE;
  }
  PetscCall(PetscFree(was));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, o->near, (PetscMPIInt)N, MPI_UINT8_T, MPI_MAX, s->comm));
  b->pairs->known = PETSC_FALSE;

  /* names what overlaps, once */
  if (!b->separation.announced) {
    const char *name[2];

    for (int k = 0; k < 2; k++)
      name[k] = o->part[k] < s->mesh->nbody ? s->mesh->body[o->part[k]].name : "the obstacle";
    PetscCheck(
      o->npoint > 0, s->comm, PETSC_ERR_USER_INPUT,
      "The effect %s: %s and %s overlap at (%g, %g, %g) m, and no separation direction was found: "
      "%" PetscInt_FMT " edges intersect triangles; move one of them by -body_NAME_translate",
      e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2],
      o->ncrossing);
    SbFormat(
      sizeof(b->separation.found), b->separation.found,
      "The effect %s: %s and %s overlap at (%g, %g, %g) m when the run begins; %" PetscInt_FMT
      " points are up to %g m deep",
      e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2],
      o->npoint, (double)(o->farthest > 0. ? o->farthest : o->deepest));
    b->separation.announced = PETSC_TRUE;
  }

  /* in a static run SbContactSetShift() decides what happens to them */
  if (e->dynamic && b->separation.found[0]) {
    PetscCall(SbWarning(
      s->comm,
      "%s. They are separated gradually (-effect_%s_separation_steps); until then they may pass "
      "through each other there",
      b->separation.found, e->name));
    b->separation.found[0] = 0;
  }

  if (e->dynamic)
    SbOverlapBegin(&b->contact.overlap, 0., dt);
  for (PetscInt i = 0; i < o->n; i++) {
    const SbPenetration *p = &o->point[i];
    const PetscInt one = m->part[p->v[0]];
    const PetscInt two = m->part[p->v[p->n - 1]];
    const PetscReal w = PetscMin(b->widths.w[one], b->widths.w[two]);
    const PetscReal k = PetscMin(b->widths.k[one], b->widths.k[two]);
    PetscReal lever = 0.; /* of what is not prescribed */
    const PetscReal gap = e->dynamic ? w : 0.5 * w;
    const PetscReal all = p->depth + gap;
    PetscReal part = PetscMax(w, all * (1. - b->contact.overlap.left));
    Spring spring = {
      .at = *p, .stiffness = b->separation.stiffer * k * p->area / w * (e->dynamic ? 1. : STIFF)};

    spring.start = SbSpringPlace(b, &spring);

    /* prescribed vertices stay as they are */
    for (PetscInt j = 0; j < p->n; j++)
      lever += m->driven[p->v[j]] ? 0. : PetscSqr(p->weight[j]);
    if (lever < SB_LEVER)
      continue;

    /* the barrier would add much energy to what is parted by less than its width */
    if (!e->dynamic || p->depth < part)
      part = all;
    spring.goal = spring.start + part;
    PetscCall(SbReserve(b->springs.n + 1, sizeof(spring), &b->springs.size, &b->springs.spring));
    b->springs.spring[b->springs.n++] = spring;
  }
  if (e->dynamic)
    PetscCall(hold_parted(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
