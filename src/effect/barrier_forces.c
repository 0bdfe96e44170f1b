/*
  barrier_forces.c - the pairs of the response `barrier` at an iterate, their energy and its derivatives, and those of friction. barrier.c describes them.
*/
#include "barrier_impl.h"

/* ------------------------------------------------------------------ where things are */

/* Positions of the obstacle's vertices after the fraction `progress` of its path. */
void SbBarrierPlaceObstacle(const Barrier *b, PetscReal progress, PetscReal x[])
{
  const PetscInt first = 3 * b->mesh->nbody_vertex;

  for (PetscInt k = first; k < 3 * b->mesh->nvertex; k++)
    x[k] = progress == 1. ? b->to[k - first]
                          : b->from[k - first] + progress * (b->to[k - first] - b->from[k - first]);
}

static int compare_active(const void *x, const void *y, void *ctx)
{
  const SbContactPair *pair = ((const Barrier *)ctx)->pairs->pair, *p = &pair[((const Active *)x)->pair],
                      *q = &pair[((const Active *)y)->pair];

  if (p->side != q->side) return p->side ? 1 : -1;
  if (p->kind != q->kind) return p->kind < q->kind ? -1 : 1;
  for (int k = 0; k < 4; k++) {
    if (p->v[k] != q->v[k]) return p->v[k] < q->v[k] ? -1 : 1;
  }
  return 0;
}

/* Positions at the local displacements u, and the pairs with gaps below the width, in the order of their numbers. Collective. */
PetscErrorCode SbBarrierUpdate(Barrier *b, const PetscReal u[])
{
  const PetscInt n = 3 * b->mesh->space->nnode_owned;
  PetscBool same;

  PetscFunctionBeginUser;
  PetscCall(PetscArraycmp(u, b->u, b->known ? n : 0, &same));
  same = (PetscBool)(b->known && same && b->now == b->progress);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, SB_MPI_BOOL, MPI_LAND, b->mesh->space->comm));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(b->u, u, n));
  b->now = b->progress;
  b->known = PETSC_TRUE;
  PetscCall(SbContactMeshGetPositions(b->mesh, u, NULL, b->x));
  SbBarrierPlaceObstacle(b, b->progress, b->x);
  PetscCall(SbContactPairsFind(b->pairs, b->x, b->x));
  b->nactive = 0;
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    Active a = {.pair = i};

    if (SbContactPairSweptApart(b->mesh, &b->pairs->pair[i], b->x, b->x, b->w[0])) continue;
    a.gap = SbContactPairGap(b->mesh, &b->pairs->pair[i], b->x, &a.at);
    if (a.gap >= width_of(b, &b->pairs->pair[i])) continue;
    if (b->nactive == b->size) {
      b->size = PetscMax(64, 2 * b->size);
      PetscCall(PetscRealloc((size_t)b->size * sizeof(*b->active), &b->active));
    }
    b->active[b->nactive++] = a;
  }
  if (b->nactive > 1) PetscCall(PetscTimSort(b->nactive, b->active, sizeof(*b->active), compare_active, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ forces */

/* The tangential slip of a pair since the step began, m. */
PetscReal SbBarrierSlip(const Barrier *b, const FrictionPair *friction, PetscReal u[3])
{
  PetscReal normal = 0.;

  for (int i = 0; i < 3; i++) {
    u[i] = -b->progress * friction->rotation[i];
    for (int k = 0; k < 4; k++)
      u[i] +=
        friction->weight[k] * (b->x[3 * friction->pair.v[k] + i] - b->start[3 * friction->pair.v[k] + i]);
    normal += u[i] * friction->n[i];
  }
  for (int i = 0; i < 3; i++) u[i] -= normal * friction->n[i];
  return PetscSqrtReal(SbDot3(u, u));
}

/* Energy of friction, J, its gradient by the pair's vertices, N. */
PetscReal SbBarrierFriction(const Barrier *b, const FrictionPair *friction, PetscReal gradient[12])
{
  PetscReal u[3];
  const PetscReal y = SbBarrierSlip(b, friction, u), e = b->slip, slope = SbBarrierSlope(b, y);

  for (int k = 0; k < 12; k++) gradient[k] = friction->force * slope * friction->weight[k / 3] * u[k % 3];
  return friction->force * (y < e ? y * y / e - y * y * y / (3. * e * e) + e / 3. : y);
}

PetscReal SbBarrierForce(const Barrier *b, const Active *a, PetscReal *energy, PetscReal gradient[12])
{
  const SbContactPair *pair = &b->pairs->pair[a->pair];
  PetscReal force = 0., w2 = 0.;

  SbBarrierPair(b->mesh, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), energy,
                gradient, PETSC_FALSE, NULL);
  for (int k = 0; k < 4; k++) {
    force -= a->at.weight[k] * SbDot3(gradient + 3 * k, a->at.n);
    w2 += PetscSqr(a->at.weight[k]);
  }
  return PetscMax(0., force / w2);
}

/* f += sign times the gradient of n vertices, distributed to their owned nodes, N. */
static void spread(const Barrier *b, PetscInt n, const PetscInt vertex[], PetscReal sign,
                   const PetscReal gradient[], PetscReal f[])
{
  const SbContactMesh m = b->mesh;

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt v = vertex[k];

    if (v >= m->nbody_vertex) continue;
    for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
      if (m->node[j] < 0 || m->node[j] >= m->space->nnode_owned) continue;
      for (int i = 0; i < 3; i++) f[3 * m->node[j] + i] += sign * m->weight[j] * gradient[3 * k + i];
    }
  }
}

/*
  An equilibrium gap g is proportional to the width w, so the error of the state is w du/dw to first order: (K + H) w du/dw = sum b'' g n, H the Hessian of the barrier. Its sign
  does not matter here.
*/
PetscErrorCode SbEffectGapForces_Barrier(SbEffect e, SbSpace s, const PetscReal u[], PetscReal f[],
                                         PetscReal *bound)
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  *bound = 0.;
  PetscCall(SbBarrierUpdate(b, u));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];
    PetscReal d[3], energy, gradient[12];
    const PetscReal force = SbBarrierForce(b, a, &energy, gradient);

    SbBarrier(a->gap, width_of(b, pair), pressure_of(b, pair), pair->area, d);
    if (d[0] <= 0.) continue;
    if (counts(b, pair)) *bound += 0.5 * force * a->gap;
    for (int k = 0; k < 12; k++)
      gradient[k] = energy / d[0] * d[2] * a->gap * a->at.weight[k / 3] * a->at.n[k % 3];
    spread(b, pair->side ? 1 : 4, pair->v, 1., gradient, f);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f += sign times the gradient of all energies at the current positions, N; returns their sum over this rank's pairs, J. */
PetscReal SbBarrierGradient(const Barrier *b, PetscReal sign, PetscReal f[])
{
  PetscReal sum = 0., energy, gradient[12];

  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];

    (void)SbBarrierForce(b, a, &energy, gradient);
    spread(b, pair->side ? 1 : 4, pair->v, sign, gradient, f);
    if (counts(b, pair)) sum += energy;
  }
  for (PetscInt i = 0; i < b->nfriction; i++) {
    energy = SbBarrierFriction(b, &b->friction[i], gradient);
    spread(b, b->friction[i].pair.side ? 1 : 4, b->friction[i].pair.v, sign, gradient, f);
    if (counts(b, &b->friction[i].pair)) sum += energy;
  }
  for (PetscInt i = 0; i < b->nspring; i++) {
    const Spring *spring = &b->spring[i];
    PetscReal push[15];
    const PetscReal force = SbBarrierSpring(b, spring, push);

    spread(b, spring->n, spring->v, sign, push, f);
    if (b->mesh->own[spring->v[0]]) sum += 0.5 * force * (spring->goal - SbBarrierSpringPlace(b, spring));
  }
  return sum;
}

PetscErrorCode SbEffectForce_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[])
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  (void)SbBarrierGradient(b, -1., f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectPotential_Barrier(SbEffect e, SbSpace s, const PetscReal u[], PetscReal *energy,
                                         PetscReal f[])
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  *energy = 0.;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, u));
  *energy = SbBarrierGradient(b, 1., f);

  /* pairs whose slip has reversed since the Hessian was evaluated */
  for (PetscInt i = 0; i < b->nfriction; i++) {
    PetscReal slip[3];

    (void)SbBarrierSlip(b, &b->friction[i], slip);
    if (SbDot3(slip, b->friction[i].slip) < 0.) b->friction[i].turns = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the blocks of a pair's Hessian where one of both vertices has nodes here; H[144], or with `weight` H[9] with respect to the weighted sum of positions. */
static PetscErrorCode add_blocks(Barrier *b, const SbContactPair *pair, const PetscReal weight[4],
                                 const PetscReal H[])
{
  const SbContactMesh m = b->mesh;
  const int n = pair->side ? 1 : 4;

  PetscFunctionBeginUser;
  for (int p = 0; p < n; p++) {
    for (int q = p; q < n; q++) {
      const PetscInt v = pair->v[p], w = pair->v[q];
      PetscReal block[9];

      if (v >= m->nbody_vertex || w >= m->nbody_vertex || !(m->mine[v] | m->mine[w])) continue;
      for (int k = 0; weight && k < 9; k++) block[k] = weight[p] * weight[q] * H[k];
      PetscCall(SbContactBlocksAdd(&b->blocks, v, w, weight ? block : H + 36 * p + 3 * q, weight ? 3 : 12));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectHessian_Barrier(SbEffect e, SbSpace s, const PetscReal u[], SbContactHessian kind,
                                       SbBlocks *blocks, PetscReal r[])
{
  Barrier *b = (Barrier *)e->data;
  PetscReal energy, gradient[12], H[144];

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbBarrierUpdate(b, u));
  PetscCall(SbContactBlocksClear(&b->blocks));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];

    SbBarrierPair(b->mesh, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), &energy,
                  gradient, (PetscBool)(kind != SB_HESSIAN_EXACT), H);
    PetscCall(add_blocks(b, pair, NULL, H));
  }

  /*
  friction: mu N (f0'/u (I - n n - u u/u^2) + f0'' u u/u^2); the parabola that bounds f0 from above has f0'/u instead of f0''. A sliding pair whose slip reversed in the last trial step
    is treated as sticking: a spring with the force mu N at the slip e replaces mu N f0'. If a full step leaves it beyond e, it slides.
  */
  for (PetscInt i = 0; i < b->nfriction; i++) {
    FrictionPair *friction = &b->friction[i];
    PetscReal T[9];
    const PetscReal y = SbBarrierSlip(b, friction, friction->slip), w = b->slip;
    PetscReal slope = SbBarrierSlope(b, y), curve = y < w ? 2. / w - 2. * y / (w * w) : 0.;

    friction->sticks = (PetscBool)(y > w && kind != SB_HESSIAN_MAJORIZED &&
                                   (friction->turns || (friction->sticks && kind != SB_HESSIAN_EXACT)));
    friction->turns = PETSC_FALSE;
    if (friction->sticks) {
      PetscReal force[12];

      for (int k = 0; k < 12; k++)
        force[k] = friction->force * (1. / w - slope) * friction->weight[k / 3] * friction->slip[k % 3];
      spread(b, friction->pair.side ? 1 : 4, friction->pair.v, 1., force, r);
      slope = curve = 1. / w;
    } else if (kind == SB_HESSIAN_MAJORIZED)
      curve = slope;
    for (int k = 0; k < 9; k++) {
      T[k] = slope * ((k % 4 ? 0. : 1.) - friction->n[k / 3] * friction->n[k % 3]);
      if (y > 0.) T[k] += (curve - slope) * friction->slip[k / 3] * friction->slip[k % 3] / (y * y);
      T[k] *= friction->force;
    }
    PetscCall(add_blocks(b, &friction->pair, friction->weight, T));
  }

  /* active springs */
  for (PetscInt i = 0; i < b->nspring; i++) {
    const Spring *spring = &b->spring[i];

    if (!spring->held && SbBarrierSpringPlace(b, spring) >= spring->goal) continue;
    for (PetscInt k = 0; k < spring->n * spring->n; k++) {
      const PetscInt p = k / spring->n, q = k % spring->n, v = spring->v[p], w = spring->v[q];
      PetscReal B[9];

      if (q < p || v >= b->mesh->nbody_vertex || w >= b->mesh->nbody_vertex ||
          !(b->mesh->mine[v] | b->mesh->mine[w]))
        continue;
      for (int j = 0; j < 9; j++)
        B[j] = spring->stiffness * spring->weight[p] * spring->weight[q] * spring->normal[j / 3] *
               spring->normal[j % 3];
      PetscCall(SbContactBlocksAdd(&b->blocks, v, w, B, 3));
    }
  }
  PetscCall(SbContactBlocksToNodes(b->mesh, &b->blocks, blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}
