/*
  barrier_friction.c - lagged friction of the response `barrier`: normal forces and slip directions of its pairs, and the lag.

  Both are those of an earlier state y: the start of the step, or the solve before. A solution x has the friction F(x; y) instead of F(x; x). The
  lag is sum |F(x; x) - F(x; y)| over the nodes, relative to the sum of mu N over the pairs: the change of normal forces, closest points and
  slip directions. Fixed-point iterations, one solve each, end when it is small (Li et al. 2020, section 5.7). They converge if a change of friction changes normal forces by less than itself.
*/
#include "barrier_impl.h"

/* Displacement in the step of the obstacle's contact point by rotation, beyond the interpolated one of its vertices. */
static void find_rotation(const Barrier *b, PetscBool end, const Active *a, FrictionPair *friction)
{
  const SbContactMesh m = b->mesh;
  const PetscInt *v = b->pairs->pair[a->pair].v;
  PetscReal X[3], at[3] = {0}, other[3], sign = 0.;

  for (int k = 0; k < 4; k++) {
    if (v[k] >= m->nbody_vertex || friction->weight[k] == 0.) continue;
    sign = friction->weight[k] > 0. ? 1. : -1.;
    for (int i = 0; i < 3; i++) at[i] += PetscAbsReal(friction->weight[k]) * b->x[3 * v[k] + i];
  }
  for (int i = 0; i < 3; i++) at[i] -= sign * a->gap * friction->n[i];
  SbPoseInvert(&b->pose[end], at, X);
  SbPoseApply(&b->pose[!end], X, other);
  for (int i = 0; i < 3; i++) friction->rotation[i] = sign * (end ? at[i] - other[i] : other[i] - at[i]);
  for (int k = 0; k < 4; k++) {
    const PetscInt o = 3 * (v[k] - m->nbody_vertex);

    for (int i = 0; i < 3 && o >= 0; i++)
      friction->rotation[i] += friction->weight[k] * (b->to[o + i] - b->from[o + i]);
  }
}

PetscErrorCode SbBarrierFindFriction(Barrier *b, PetscBool end)
{
  PetscFunctionBeginUser;
  b->nnext = 0;
  for (PetscInt i = 0; b->scene.friction > 0. && i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];
    PetscReal energy, gradient[12];
    FrictionPair friction = {.pair = *pair};

    friction.force = b->scene.friction * SbBarrierForce(b, a, &energy, gradient);
    PetscCall(PetscArraycpy(friction.weight, a->at.weight, 4));
    PetscCall(PetscArraycpy(friction.n, a->at.n, 3));
    if (b->scene.obstacle) find_rotation(b, end, a, &friction);
    if (b->nnext == b->next_size) {
      b->next_size = PetscMax(64, 2 * b->next_size);
      PetscCall(PetscRealloc((size_t)b->next_size * sizeof(*b->next), &b->next));
    }
    b->next[b->nnext++] = friction;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbBarrierSwapFriction(Barrier *b)
{
  const PetscInt n = b->nfriction, size = b->friction_size;
  FrictionPair *friction = b->friction;

  b->nfriction = b->nnext;
  b->friction_size = b->next_size;
  b->friction = b->next;
  b->nnext = n;
  b->next_size = size;
  b->next = friction;
}

PetscErrorCode SbBarrierLag(Barrier *b)
{
  const SbSpace s = b->mesh->space;
  PetscReal *f, sum[2] = {0.};

  PetscFunctionBeginUser;
  PetscCall(SbBarrierFindFriction(b, PETSC_TRUE));

  /* the normal forces cancel */
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  (void)SbBarrierGradient(b, 1., f);
  SbBarrierSwapFriction(b);
  (void)SbBarrierGradient(b, -1., f);
  SbBarrierSwapFriction(b);
  for (PetscInt i = 0; i < s->nnode_owned; i++) sum[0] += PetscSqrtReal(SbDot3(f + 3 * i, f + 3 * i));
  for (PetscInt i = 0; i < b->nnext; i++) sum[1] += counts(b, &b->next[i].pair) ? b->next[i].force : 0.;
  PetscCall(PetscFree(f));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, s->comm));
  b->lag = sum[1] > 0. ? sum[0] / sum[1] : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}
