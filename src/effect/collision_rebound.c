/*
  collision_rebound.c - restitution between bodies. The law and what it does to the energy are described in src/model/restitution.c.

  The pairs of a step are first searched for where everything would be without forces, at u0 + h v0. There the detector finds what is about to
  meet, however fast, and the relative displacement of a pair is h times its relative velocity when the step began: nothing else has to
  be brought from the ranks of the other body. A pair that is found only later in the step, farther than the reach from there, is constrained
  at the gap zero as without restitution.
*/
#include "collision.h"

void SbCollisionFly(Collision *c, SbSpace space, const PetscReal u0[], const PetscReal v0[],
                    const PetscReal u[])
{
  for (PetscInt i = 0; i < 3 * space->nnode; i++)
    c->flight[i] = space->fixed[i / 3] & (1 << (i % 3)) ? u[i] : u0[i] + c->bounce.dt * v0[i];
}

void SbCollisionMeet(Collision *c)
{
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const PetscReal start = SbDot3(hit->normal, hit->start), now = SbDot3(hit->normal, hit->now);

    hit->arrives = 0;
    if (hit->was || hit->allowed > TOLERANCE * c->surface->size) continue;
    hit->gap0 = PetscMax(0, start - hit->value);
    hit->arrives = PetscMax(0, (start - now) / c->bounce.dt);
  }
}

void SbCollisionHit(const Collision *c, Hit *hit)
{
  hit->on = PETSC_TRUE;
  hit->leaves = SbRestitutionGap(&c->bounce, hit->gap0, hit->arrives);
}

/* Of what leaves, and of what ends an overlap. */
PetscErrorCode SbEffectRestitution_Collision(SbEffect e, PetscReal *work)
{
  const Collision *c = (const Collision *)e->data;

  PetscFunctionBeginUser;
  *work = 0;
  for (PetscInt i = 0; i < c->nhit; i++) {
    const Hit *hit = &c->hit[i];

    if (hit->on) *work += hit->lambda * PetscMax(0, SbCollisionPlace(hit) - SbDot3(hit->normal, hit->start));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectScaleRestitution_Collision(SbEffect e, PetscReal share)
{
  Collision *c = (Collision *)e->data;

  PetscFunctionBeginUser;
  c->bounce.left = share;
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];

    if (hit->leaves > 0) hit->leaves = SbRestitutionGap(&c->bounce, hit->gap0, hit->arrives);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
