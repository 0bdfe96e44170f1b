/*
  contact_set.c - the contacts of a scene as the rest of the program sees them: sums over all of
  them, whatever partner and response each one has. The active set is in active_set.c.
*/
#include "contact_impl.h"

PetscErrorCode SbContactSetCreate(SbSpace space, PetscInt n, const SbEffect effect[],
                                  SbContactSet *to)
{
  PetscFunctionBeginUser;
  *to = (SbContactSet){.space = space};
  for (PetscInt e = 0; e < n; e++)
    to->n += effect[e]->contact != NULL;
  if (!to->n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(to->n, &to->contact, to->n, &to->active_set, to->n, &to->potential));
  to->n = 0;
  for (PetscInt e = 0; e < n; e++) {
    const SbContact c = effect[e]->contact;

    if (!c)
      continue;
    c->number = e;
    to->contact[to->n++] = c;
    if (c->ops->start_active_set)
      to->active_set[to->nactive_set++] = c;
    if (c->ops->gradient)
      to->potential[to->npotential++] = c;
    if (c->ends_step && !to->ends_step)
      to->ends_step = c;
    to->nexact += c->exact;
    to->nrigid += c->rigid;
    to->saddle = (PetscBool)(to->saddle || (c->exact && c->saddle));
    to->nconstraint += c->ops->assemble_constraints != NULL;
    to->nrestitution += c->restitution > 0.;
  }
  PetscCall(SbContactSetCheckRepeated(to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetDestroy(SbContactSet *contacts)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree3(contacts->contact, contacts->active_set, contacts->potential));
  *contacts = (SbContactSet){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetBeginStep(SbContactSet *contacts, PetscReal t, PetscReal dt,
                                     PetscReal speed, PetscBool again, Vec U0, Vec V0)
{
  const SbSpace s = contacts->space;
  const PetscReal *v;
  PetscReal *u;

  PetscFunctionBeginUser;
  contacts->speed = speed;
  PetscCall(SbSpaceGetLocalWrite(s, U0, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
  for (PetscInt k = 0; k < contacts->n; k++)
    if (again && contacts->contact[k]->ops->solve_again)
      PHASE_CALL(contacts->contact[k], solve_again, s);
    else
      PHASE_CALL(contacts->contact[k], begin_step, s, t, dt, speed, u);

  /* the responses of this attempt */
  contacts->nexact = 0;
  contacts->saddle = PETSC_FALSE;
  for (PetscInt k = 0; k < contacts->n; k++) {
    contacts->nexact += contacts->contact[k]->exact;
    contacts->saddle = (PetscBool)(contacts->saddle ||
                                   (contacts->contact[k]->exact && contacts->contact[k]->saddle));
  }

  /* the impacts of this step */
  if (contacts->nrestitution && V0) {
    contacts->bounce.U0 = U0;
    contacts->bounce.V0 = V0;
    contacts->bounce.dt = dt;
    contacts->bounce.left = 1.;
    contacts->bounce.reductions = 0;
    PetscCall(SbSpaceGetLocalRead(s, V0, &v));
    for (PetscInt k = 0; k < contacts->n; k++)
      if (contacts->contact[k]->restitution > 0.)
        PHASE_CALL(contacts->contact[k], find_impacts, s, dt, u, v);
    PetscCall(SbSpaceRestoreLocalRead(s, V0, &v));
  }
  PetscCall(SbSpaceRestoreLocalWrite(s, U0, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbContactSetAdvance(const SbContactSet *contacts, PetscReal progress)
{
  for (PetscInt k = 0; k < contacts->n; k++)
    contacts->contact[k]->progress = progress;
}

PetscErrorCode SbContactSetMaxStep(const SbContactSet *contacts, Vec X, Vec Y, PetscReal *part,
                                   PetscInt *nactive)
{
  const SbSpace s = contacts->space;
  const PetscReal *u0, *u1;
  PetscReal found[2] = {1., 0.};
  Vec next;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(X, &next));
  PetscCall(VecWAXPY(next, -1., Y, X));
  PetscCall(SbSpaceGetLocalRead(s, X, &u0));
  PetscCall(SbSpaceGetLocalRead(s, next, &u1));
  for (PetscInt k = 0; k < contacts->n; k++) {
    PetscReal mine = 1.;
    PetscInt pairs = 0;

    PHASE_CALL(contacts->contact[k], max_step, s, u0, u1, NULL, &mine, &pairs);
    found[0] = PetscMin(found[0], mine);
    found[1] -= (PetscReal)pairs;
  }
  PetscCall(SbSpaceRestoreLocalRead(s, next, &u1));
  PetscCall(SbSpaceRestoreLocalRead(s, X, &u0));
  PetscCall(VecDestroy(&next));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found, 2, MPIU_REAL, MPI_MIN, s->comm));
  *part = found[0];
  *nactive = (PetscInt)-found[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbContactSetObstacleWay(const SbContactSet *contacts, PetscReal size)
{
  PetscReal most = 0.;

  for (PetscInt k = 0; k < contacts->n; k++) {
    const SbPartner *p = &((const Contact *)contacts->contact[k])->partner;
    const PetscReal turn = PetscAbsReal(p->pose[1].angle - p->pose[0].angle);
    PetscReal way = PetscSqrtReal(SbDistance2(p->pose[0].d, p->pose[1].d)) + turn * size;

    most = PetscMax(most, p->obstacle ? way : 0.);
  }
  return most;
}

PetscErrorCode SbContactSetGradient(const SbContactSet *contacts, Vec U, PetscReal scale,
                                    PetscBool free_only, PetscReal *energy, Vec F)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;
  PetscReal *f;
  PetscReal sum = 0.;
  PetscScalar *out;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], gradient, s, u, &sum, f);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(VecGetArray(F, &out));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (!free_only || !(s->fixed[i / 3] & (1 << (i % 3))))
      out[i] += scale * f[i];
  PetscCall(VecRestoreArray(F, &out));
  PetscCall(PetscFree(f));
  if (energy)
    PetscCallMPI(MPI_Allreduce(&sum, energy, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lends u[nnode][3] of U and f[nnode][3], zero, of F. Collective. */
static PetscErrorCode lend(SbSpace s, Vec U, Vec F, const PetscReal **u, PetscReal **f)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, u));
  PetscCall(SbSpaceGetLocalWrite(s, F, f));
  PetscCall(PetscArrayzero(*f, 3 * s->nnode));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode give_back(SbSpace s, Vec U, Vec F, const PetscReal **u, PetscReal **f)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceRestoreLocalRead(s, U, u));
  PetscCall(SbSpaceRestoreLocalWrite(s, F, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetHessian(const SbContactSet *contacts, Vec U, SbContactHessian kind,
                                   SbBlocks *blocks, Vec R)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;
  PetscReal *r;

  PetscFunctionBeginUser;
  PetscCall(lend(s, U, R, &u, &r));
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], hessian, s, u, kind, blocks, r);
  PetscCall(give_back(s, U, R, &u, &r));
  PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetConstraints(const SbContactSet *contacts, Vec X, SbConstraintRows *rows)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, X, &u));
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], constraints, s, u, rows);
  PetscCall(SbSpaceRestoreLocalRead(s, X, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetHolding(const SbContactSet *contacts, Vec X, SbConstraintRows *rows)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, X, &u));
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], holding, s, u, rows);
  PetscCall(SbSpaceRestoreLocalRead(s, X, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetUpdateFriction(SbContactSet *contacts, Vec X, PetscBool solved,
                                          PetscBool *again)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  PetscCall(SbSpaceGetLocalRead(s, X, &u));
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], update_friction, s, u, solved, again);
  PetscCall(SbSpaceRestoreLocalRead(s, X, &u));
  if (contacts->nrestitution && solved && !*again)
    PetscCall(SbContactSetCheckRestitution(contacts, X, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetFallBack(const SbContactSet *contacts, const char *why, PetscBool *again)
{
  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], fall_back, contacts->space, why, again);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetExplain(const SbContactSet *contacts, PetscInt rounds)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], explain, contacts->space, rounds);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *SbContactSetUnsettled(const SbContactSet *contacts)
{
  for (PetscInt k = 0; k < contacts->n; k++)
    if (contacts->contact[k]->unsettled[0])
      return contacts->contact[k]->unsettled;
  return "";
}

PetscReal SbContactSetWork(const SbContactSet *contacts)
{
  PetscReal work = 0.;

  for (PetscInt k = 0; k < contacts->n; k++)
    work += contacts->contact[k]->work;
  return work;
}

PetscErrorCode SbContactSetGap(const SbContactSet *contacts, PetscReal t, Vec U, Vec G)
{
  const SbSpace s = contacts->space;
  SbStage stage = {.t = t, .shift_k = 1.};
  PetscReal *gap, *g;

  PetscFunctionBeginUser;
  if (!contacts->n) {
    PetscCall(VecZeroEntries(G));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(s->nnode, &gap));
  PetscCall(lend(s, U, G, &stage.u, &g));
  for (PetscInt i = 0; i < s->nnode; i++)
    gap[i] = PETSC_MAX_REAL;
  for (PetscInt k = 0; k < contacts->n; k++)
    CONTACT_CALL(contacts->contact[k], gap, s, &stage, gap, g);
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    if (gap[i / 3] < PETSC_MAX_REAL)
      g[i] *= gap[i / 3];
  PetscCall(give_back(s, U, G, &stage.u, &g));
  PetscCall(PetscFree(gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetForce(const SbContactSet *contacts, PetscReal t, Vec U, Vec F)
{
  const SbSpace s = contacts->space;
  SbStage stage = {.t = t, .shift_k = 1.};
  PetscReal *f;

  PetscFunctionBeginUser;
  if (!contacts->n) {
    PetscCall(VecZeroEntries(F));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(lend(s, U, F, &stage.u, &f));
  for (PetscInt k = 0; k < contacts->n; k++)
    if (contacts->contact[k]->effect->ops.force)
      SbEffectCall(contacts->contact[k]->effect, force, s, &stage, f);
  if (s->constraints)
    SbConstraintsAddForces(s, f);
  PetscCall(give_back(s, U, F, &stage.u, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetPoints(const SbContactSet *contacts, PetscReal t, Vec U,
                                  SbContactPoints *list)
{
  const SbSpace s = contacts->space;
  SbStage stage = {.t = t, .shift_k = 1.};

  PetscFunctionBeginUser;
  if (!contacts->n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  for (PetscInt k = 0; k < contacts->n; k++) {
    const PetscInt before = list->n;

    CONTACT_CALL(contacts->contact[k], points, s, &stage, list);
    for (PetscInt i = before; i < list->n; i++)
      list->point[i].effect = contacts->contact[k]->number;
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetNearest(const SbContactSet *contacts, size_t size, char text[])
{
  PetscReal least = PETSC_MAX_REAL;

  PetscFunctionBeginUser;
  text[0] = 0;
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], nearest, contacts->space, &least, size, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetWarnAtEnd(const SbContactSet *contacts)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], warn_at_end, contacts->space);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetGapForces(const SbContactSet *contacts, Vec U, Vec F, PetscReal *bound)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;
  PetscReal *f;

  PetscFunctionBeginUser;
  *bound = 0.;
  PetscCall(lend(s, U, F, &u, &f));
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], gap_forces, s, u, f, bound);
  PetscCall(give_back(s, U, F, &u, &f));
  PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, F));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bound, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetScaleWidths(const SbContactSet *contacts, PetscReal factor,
                                       PetscReal growth, PetscBool *changed)
{
  PetscFunctionBeginUser;
  *changed = PETSC_FALSE;
  for (PetscInt k = 0; k < contacts->n; k++)
    PHASE_CALL(contacts->contact[k], scale_width, factor, growth, changed);
  PetscFunctionReturn(PETSC_SUCCESS);
}
