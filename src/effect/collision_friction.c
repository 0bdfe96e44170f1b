/*
  collision_friction.c - friction (friction.c) of pairs of a point and a surface, and of two edges.
*/
#include "collision.h"

/* The pair as friction sees it. */
static inline SbFrictionPair pair_of(Hit *hit)
{
  return (SbFrictionPair){.n = hit->n,
                          .node = hit->node,
                          .weight = hit->weight,
                          .normal = hit->normal,
                          .start = hit->start,
                          .now = hit->now,
                          .k = hit->k,
                          .rests = hit->rests,
                          .grip = &hit->grip};
}

void SbCollisionFrictionEnter(const Collision *c, Hit *hit)
{
  const SbFrictionPair p = pair_of(hit);

  SbFrictionEnter(&c->friction, &p, -SbCollisionExcess(hit));
}

void SbCollisionFrictionPush(const Collision *c, Hit *hit, PetscReal push[3 * NODES], PetscBool *oblique)
{
  const SbFrictionPair p = pair_of(hit);
  PetscReal direction[3];

  SbFrictionDirection(&c->friction, &p, direction, oblique);
  if (*oblique) SbCollisionCoef(hit, direction, push);
}

PetscErrorCode SbCollisionFrictionHold(const Collision *c, SbSpace space, PetscInt i, PetscInt id)
{
  const SbFrictionPair p = pair_of(&c->hit[i]);

  PetscFunctionBeginUser;
  PetscCall(SbFrictionHold(&c->friction, space, &p, SB_COLLISION_IDS + 2 * id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbCollisionFrictionRead(const Collision *c, SbSpace space, PetscReal along, Hit *hit)
{
  const SbFrictionPair p = pair_of(hit);

  SbFrictionRead(&c->friction, space, &p, SbCollisionForce(c, hit), along);
}

void SbCollisionFrictionSettle(Collision *c, PetscReal largest, PetscBool *changed)
{
  PetscReal worst = 0;

  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const SbFrictionPair p = pair_of(hit);
    PetscReal error;

    if (!hit->on || hit->row < 0) continue;
    error = SbFrictionSettle(&c->friction, &p, SbCollisionForce(c, hit));
    worst = PetscMax(worst, error);
  }
  SbFrictionJudge(&c->friction, worst, largest, changed);
}

PetscErrorCode SbCollisionFrictionAccept(Collision *c, const char effect[], SbSpace space, PetscReal t)
{
  PetscFunctionBeginUser;
  PetscCall(SbFrictionWarn(&c->friction, effect, space, t));
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const SbFrictionPair p = pair_of(hit);

    SbFrictionAccept(&c->friction, &p, (PetscBool)(hit->on && SbCollisionForce(c, hit) > 0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
