/*
  separation.c - one-sided springs along fixed directions, which separate overlaps; impacts.c has
  those of restitution.

  A spring has the energy k/2 (g - goal)^2 while g = n . sum weight x is below a goal; each step has
  new ones.

  Surfaces that are in each other by less than the width of the barrier when a run begins only
  touch: they are moved apart rigidly (initial_contacts.c).

  Overlap. Each penetrating point (overlap.c) is moved out by a part of its depth in
  each step, so that the depth falls to 1/e in -effect_X_separation_steps steps; by the width of the
  barrier at least, and in a static run at once. Springs that reach less than half of that get
  stiffer. Pairs of the overlap are excluded from barrier and collision detection until there is
  none left.
*/
#include "surfaces.h"

#define STIFF 10. /* static run: stiffness over that of the barrier */
#define SAME 1e-5 /* of the bodies' size: positions this close coincide */

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

PetscErrorCode SbSurfacesSeparate(SbEffect e, SbSpace s, PetscReal dt, PetscBool first,
                                  PetscBool touch)
{
  Surfaces *b = (Surfaces *)e->data;
  const SbContactSurface m = b->surface;
  SbContactOverlap *o = &b->separation.overlap;
  PetscBool inside = PETSC_FALSE;
  PetscBool same = PETSC_FALSE;
  PetscInt body[2] = {0, 0};

  PetscFunctionBeginUser;
  b->springs.n = 0;
  o->touch = touch && !b->separation.overlapping ? SB_TOUCH * b->contact.base.width : 0.;
  if (!b->motion.begun && !b->contact.partner.obstacle)
    PetscCall(SbContactSurfaceIsInside(m, b->motion.x, body, &inside));
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
  b->pairs->near = b->separation.overlapping ? o->near : NULL;
  b->motion.known = PETSC_FALSE;
  if (!b->separation.overlapping)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* excludes pairs of gap zero, too, as of a vertex in a triangle */
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    SbDistance d;

    if (SbContactPairGap(m, pair, b->motion.x, &d) > SAME * m->size)
      continue;
    for (int k = 0; k < 4; k++)
      o->near[SbContactNumber(m, pair->v[k])] = SB_OVERLAP_INSIDE;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, o->near,
                             (PetscMPIInt)(m->nvertex - m->nbody_vertex + m->Nbody_vertex),
                             MPI_UINT8_T, MPI_MAX, s->comm));
  b->pairs->known = PETSC_FALSE;

  /* warns once, naming what overlaps */
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
    PetscCall(SbWarning(
      s->comm,
      "The effect %s: %s and %s overlap at (%g, %g, %g) m when the run begins; %" PetscInt_FMT
      " points are up to %g m deep. They are separated gradually (-effect_%s_separation_steps); "
      "until then "
      "they may pass through each other there",
      e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2],
      o->npoint, (double)o->deepest, e->name));
  }
  b->separation.announced = PETSC_TRUE;

  if (e->dynamic)
    SbOverlapBegin(&b->contact.overlap, dt);
  for (PetscInt i = 0; i < o->n; i++) {
    const SbPenetration *p = &o->point[i];
    const PetscInt one = m->part[p->v[0]];
    const PetscInt two = m->part[p->v[p->n - 1]];
    const PetscReal w = PetscMin(b->widths.w[one], b->widths.w[two]);
    const PetscReal k = PetscMin(b->widths.k[one], b->widths.k[two]);
    const PetscReal all = p->depth + 0.5 * w;
    Spring spring = {
      .at = *p, .stiffness = b->separation.stiffer * k * p->area / w * (e->dynamic ? 1. : STIFF)};

    spring.start = SbSpringPlace(b, &spring);
    spring.goal =
      spring.start +
      (e->dynamic ? PetscMin(all, PetscMax(w, all * (1. - b->contact.overlap.left))) : all);
    PetscCall(SbReserve(b->springs.n + 1, sizeof(spring), &b->springs.size, &b->springs.spring));
    b->springs.spring[b->springs.n++] = spring;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
