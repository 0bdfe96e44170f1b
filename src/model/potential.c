/*
  The potential of barrier contact for Newton's method: sums over the effects with this response.
*/
#include "model_impl.h"
#include "sblog.h"

/* SbEffectCall() with its time added to the contact phase as well. */
#define CONTACT_CALL(e, op, ...)                                           \
  do {                                                                     \
    PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0)); \
    SbEffectCall(e, op, __VA_ARGS__);                                      \
    PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));   \
  } while (0)

#define ROUNDS 20   /* most iterations of the separation of initial contacts */
#define SWEEPS 1000 /* Gauss-Seidel sweeps over the contacts in each round */
#define FAR 2.      /* largest displacement of a body per iteration, over the target gap */
#define CLOSE 0.9   /* gap over the target gap below which there is contact */
#define MISSED 1e-3 /* tolerance of the sweeps over the target gap */

/* Order of initial contacts: bodies, direction, gap, target gap. */
static int by_value(const void *a, const void *b)
{
  const SbInitialContact *p = a;
  const SbInitialContact *q = b;
  const PetscInt body =
    p->body[0] != q->body[0] ? p->body[0] - q->body[0] : p->body[1] - q->body[1];
  const PetscReal difference[6] = {
    body, p->n[0] - q->n[0], p->n[1] - q->n[1], p->n[2] - q->n[2], p->gap - q->gap, p->to - q->to};

  for (int i = 0; i < 6; i++)
    if (difference[i] != 0.)
      return difference[i] < 0. ? -1 : 1;
  return 0;
}

/* Gap of a contact after the displacements `way` of its two bodies, m. */
static PetscReal gap_after(const SbInitialContact *t, const PetscReal way[])
{
  return t->gap + SbDot3(t->n, way + 3 * t->body[0]) - SbDot3(t->n, way + 3 * t->body[1]);
}

/* Squared length of the part of a contact's normal along which its two bodies are not fixed. */
static PetscReal free_part(const SbInitialContact *t, const uint8_t fixed[])
{
  PetscReal sum = 0.;

  for (int k = 0; k < 6; k++)
    if (!(fixed[t->body[k / 3]] >> (k % 3) & 1))
      sum += PetscSqr(t->n[k % 3]);
  return sum;
}

/* Gauss-Seidel: each contact moves its bodies along it, except fixed components; way[nbody + 1][3],
   m. */
static void sweep_touches(PetscInt n, const SbInitialContact touch[], PetscInt nbody,
                          const uint8_t fixed[], PetscReal way[])
{
  PetscReal worst = 1.;

  for (PetscInt k = 0; k < 3 * (nbody + 1); k++)
    way[k] = 0.;
  for (int sweep = 0; sweep < SWEEPS && worst > MISSED; sweep++) {
    worst = 0.;
    for (PetscInt i = 0; i < n; i++) {
      const SbInitialContact *t = &touch[i];
      const PetscReal missing = t->to - gap_after(t, way);
      const PetscReal sum = free_part(t, fixed);

      if (missing <= 0. || sum < MISSED)
        continue;
      worst = PetscMax(worst, missing / t->to);
      for (int k = 0; k < 6; k++) {
        const PetscInt b = t->body[k / 3];

        if (!(fixed[b] >> (k % 3) & 1))
          way[3 * b + k % 3] += (k < 3 ? 1. : -1.) * missing / sum * t->n[k % 3];
      }
    }
  }
}

/* Finds displacements of bodies that open all contacts to their target gaps, as far as prescribed
   components allow. Bodies enclosed by others without enough space are fixed. Displacements are
   limited to a few gaps, the distance within which contacts were searched. fixed[nbody + 1]: bit c,
   component c is prescribed or was fixed here; way[nbody + 1][3], m. Returns whether some body
   moves. */
static PetscBool find_ways(PetscInt n, const SbInitialContact touch[], PetscInt nbody,
                           uint8_t fixed[], PetscReal way[])
{
  PetscReal longest = 0.;
  PetscReal most = PETSC_MAX_REAL;
  PetscBool again = PETSC_FALSE;

  for (PetscInt i = 0; i < n; i++) {
    const SbInitialContact *t = &touch[i];

    again = (PetscBool)(again || (t->gap < CLOSE * t->to && free_part(t, fixed) >= MISSED));
    most = PetscMin(most, FAR * t->to);
  }
  if (!again)
    return PETSC_FALSE;

  /* fix the bodies of contacts whose gap would decrease */
  while (again) {
    again = PETSC_FALSE;
    sweep_touches(n, touch, nbody, fixed, way);
    for (PetscInt i = 0; i < n; i++) {
      const SbInitialContact *t = &touch[i];

      if (gap_after(t, way) >= PetscMin(t->gap, t->to) - MISSED * t->to)
        continue;
      for (int k = 0; k < 2; k++) {
        const PetscInt b = t->body[k];

        again = (PetscBool)(again || fixed[b] != 7);
        fixed[b] = 7;
      }
    }
  }

  /* limit the displacement */
  for (PetscInt b = 0; b <= nbody; b++)
    longest = PetscMax(longest, PetscSqrtReal(SbDot3(way + 3 * b, way + 3 * b)));
  for (PetscInt k = 0; longest > most && k < 3 * (nbody + 1); k++)
    way[k] *= most / longest;
  return (PetscBool)(longest > MISSED * most);
}

/* Separates bodies in initial contact by rigid displacements, in a dynamic run until the barrier is
   inactive. Effects move the vertices of remaining contacts. */
PetscErrorCode SbModelPotentialStart(SbModel m, PetscReal t, PetscReal dt, Vec U)
{
  const SbSpace s = m->space;
  const PetscInt nbody = s->mesh->nbody;
  uint8_t *fixed;
  PetscReal *way, *u;
  PetscBool go_on = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalWrite(s, U, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
  PetscCall(PetscCalloc2(nbody + 1, &fixed, 3 * (nbody + 1), &way));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    fixed[s->node_body[i]] |= s->fixed[i];
  fixed[nbody] = 7;
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, fixed, (PetscMPIInt)(nbody + 1), MPI_UINT8_T, MPI_BOR, m->comm));
  for (int round = 0; go_on && round < ROUNDS; round++) {
    SbInitialContacts list = {0};
    SbInitialContact *touch;
    PetscInt n;

    go_on = PETSC_FALSE;
    for (PetscInt e = 0; e < m->npotential; e++)
      CONTACT_CALL(m->potential[e], touching, s, t, dt, u, &go_on, &list);
    if (!go_on)
      break;
    PetscCall(SbAllgatherv(m->comm, MPI_BYTE, list.n * (PetscInt)sizeof(*touch), list.touch, &n,
                           &touch, NULL));
    n /= (PetscInt)sizeof(*touch);
    if (n)
      qsort(touch, (size_t)n, sizeof(*touch), by_value);
    PetscCall(PetscFree(list.touch));
    go_on = find_ways(n, touch, nbody, fixed, way);
    PetscCall(PetscFree(touch));
    for (PetscInt i = 0; go_on && i < 3 * s->nnode; i++)
      u[i] += way[3 * s->node_body[i / 3] + i % 3];
  }
  PetscCall(PetscFree2(fixed, way));
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The speed V of a step from t to t + dt, m/s, the scale of tolerances of barrier contact: m V^2 /
   2 is the kinetic and strain energy of the bodies, of mass m, at its start, plus half of the work
   of all loads and support forces along the size of the smallest body. */
static PetscErrorCode step_speed(SbModel m, PetscReal t, PetscReal dt, Vec U, Vec V,
                                 PetscReal *speed)
{
  const SbSpace s = m->space;
  SbEvaluation at = {.U = U, .V = V};
  PetscReal load = 0.;
  PetscReal *f;
  SbEnergies energies;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(m, U, V, &energies));
  if (PetscIsInfOrNanReal(energies.strain))
    energies.strain = 0.;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbEvaluationBegin(m, t + dt, &at));
  PetscCall(SbModelExternalForces(m, &at.stage, PETSC_TRUE, 1., f));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    load += PetscSqrtReal(SbDot3(f + 3 * i, f + 3 * i));

  /* support forces: internal forces at prescribed nodes */
  if (m->nprescribe) {
    PetscCall(PetscArrayzero(f, 3 * s->nnode));
    PetscCall(SbSpaceAddInternalForce(s, &at.stage, f));
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      if (s->fixed[i])
        load += PetscSqrtReal(SbDot3(f + 3 * i, f + 3 * i));
  }
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCall(PetscFree(f));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &load, 1, MPIU_REAL, MPI_SUM, m->comm));
  *speed = PetscSqrtReal(
    (2. * (energies.kinetic + energies.strain) + load * SbBodySmallest(m->nbody, m->body)) /
    m->mass);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialBegin(SbModel m, PetscReal t, PetscReal dt, Vec U0, Vec V0)
{
  SbEvaluation at = {.U = U0, .V = V0};
  PetscReal *u;

  PetscFunctionBeginUser;
  m->barrier_speed = 0.;
  if (V0)
    PetscCall(step_speed(m, t, dt, U0, V0, &m->barrier_speed));
  PetscCall(SbSpaceGetLocalWrite(m->space, U0, &u));
  PetscCall(SbSpaceUpdateGhosts(m->space, u));
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], begin_barrier, m->space, t, dt, m->barrier_speed, u);
  PetscCall(SbSpaceRestoreLocalWrite(m->space, U0, &u));

  /* impact velocities of this step */
  if (!m->nrestitution || !V0)
    PetscFunctionReturn(PETSC_SUCCESS);
  m->bounce = (struct _SbBounce){.U0 = U0, .V0 = V0, .dt = dt, .left = 1.};
  PetscCall(SbEvaluationBegin(m, t, &at));
  for (PetscInt e = 0; e < m->npotential; e++)
    if (m->potential[e]->ops.meet)
      CONTACT_CALL(m->potential[e], meet, m->space, dt, at.stage.u, at.stage.v);
  PetscCall(SbEvaluationEnd(m, &at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialAdvance(SbModel m, PetscReal progress)
{
  PetscFunctionBeginUser;
  for (PetscInt e = 0; e < m->npotential; e++)
    m->potential[e]->progress = progress;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialMaxStep(SbModel m, Vec X, Vec Y, PetscReal *part, PetscInt *nactive)
{
  const PetscReal *u0, *u1;
  PetscReal found[2] = {1., 0.};
  Vec next;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(X, &next));
  PetscCall(VecWAXPY(next, -1., Y, X));
  PetscCall(SbSpaceGetLocalRead(m->space, X, &u0));
  PetscCall(SbSpaceGetLocalRead(m->space, next, &u1));
  for (PetscInt e = 0; e < m->npotential; e++) {
    PetscReal mine;
    PetscInt pairs;

    CONTACT_CALL(m->potential[e], safe, m->space, u0, u1, &mine, &pairs);
    found[0] = PetscMin(found[0], mine);
    found[1] -= (PetscReal)pairs;
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, next, &u1));
  PetscCall(SbSpaceRestoreLocalRead(m->space, X, &u0));
  PetscCall(VecDestroy(&next));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found, 2, MPIU_REAL, MPI_MIN, m->comm));
  *part = found[0];
  *nactive = (PetscInt)-found[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialNearest(SbModel m, size_t size, char text[])
{
  PetscReal least = PETSC_MAX_REAL;

  PetscFunctionBeginUser;
  text[0] = 0;
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], nearest, m->space, &least, size, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialUpdateFriction(SbModel m, Vec X, PetscBool solved, PetscBool *again)
{
  const PetscReal *u;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  PetscCall(SbSpaceGetLocalRead(m->space, X, &u));
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], lag, m->space, u, solved, again);
  PetscCall(SbSpaceRestoreLocalRead(m->space, X, &u));
  if (m->nrestitution && solved && !*again)
    PetscCall(SbModelRestitutionUpdate(m, X, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialHessian(SbModel m, Vec U, SbContactHessian kind, SbBlocks *blocks,
                                       Vec R)
{
  SbEvaluation at = {.U = U, .F = R};

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, 0., &at));
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], hessian, m->space, at.stage.u, kind, blocks, at.f);
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCall(SbSpaceZeroPrescribed(m->space, PETSC_TRUE, R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPotentialGradient(SbModel m, Vec U, PetscReal scale, PetscBool free_only,
                                        PetscReal *energy, Vec F)
{
  const SbSpace s = m->space;
  const PetscReal *u;
  PetscReal *f;
  PetscReal sum = 0.;
  PetscScalar *out;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], potential, s, u, &sum, f);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(VecGetArray(F, &out));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (!free_only || !(s->fixed[i / 3] & (1 << (i % 3))))
      out[i] += scale * f[i];
  PetscCall(VecRestoreArray(F, &out));
  PetscCall(PetscFree(f));
  if (energy)
    PetscCallMPI(MPI_Allreduce(&sum, energy, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGapForces(SbModel m, Vec U, Vec F, PetscReal *bound)
{
  SbEvaluation at = {.U = U, .F = F};

  PetscFunctionBeginUser;
  *bound = 0.;
  PetscCall(SbEvaluationBegin(m, 0., &at));
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], gap_forces, m->space, at.stage.u, at.f, bound);
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCall(SbSpaceZeroPrescribed(m->space, PETSC_TRUE, F));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bound, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelScaleBarrierWidths(SbModel m, PetscReal factor, PetscReal growth,
                                         PetscBool *changed)
{
  PetscFunctionBeginUser;
  *changed = PETSC_FALSE;
  for (PetscInt e = 0; e < m->npotential; e++)
    CONTACT_CALL(m->potential[e], scale_width, factor, growth, changed);
  PetscFunctionReturn(PETSC_SUCCESS);
}
