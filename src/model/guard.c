/*
  Guarded contact as Newton's method sees it: all effects that have it together.
*/
#include "sbmodel.h"

PetscErrorCode SbModelGuardBegin(SbModel m, PetscReal t, PetscReal dt, Vec U0)
{
  PetscReal *u;
  PetscBool moved = PETSC_FALSE;
  Vec local;

  PetscFunctionBeginUser;
  /* a copy with ghosts that may be written */
  PetscCall(VecDuplicate(U0, &local));
  PetscCall(VecCopy(U0, local));
  PetscCall(SbSpaceGetLocalRead(m->space, local, (const PetscReal **)&u));
  for (PetscInt e = 0; e < m->npotential; e++) {
    PetscBool mine;

    SbEffectCall(m->potential[e], begin_guarded, m->space, t, dt, u, &mine);
    moved = (PetscBool)(moved || mine);
  }
  if (moved) {
    PetscScalar *u0;

    PetscCall(VecGetArray(U0, &u0));
    PetscCall(PetscArraycpy(u0, u, 3 * m->space->nnode_owned));
    PetscCall(VecRestoreArray(U0, &u0));
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, local, (const PetscReal **)&u));
  PetscCall(VecDestroy(&local));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGuardAdvance(SbModel m, PetscReal progress)
{
  PetscFunctionBeginUser;
  for (PetscInt e = 0; e < m->npotential; e++) SbEffectCall(m->potential[e], advance, progress);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGuardSafe(SbModel m, Vec X, Vec Y, PetscReal progress, PetscReal *part,
                                PetscInt *nactive)
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

    SbEffectCall(m->potential[e], safe, m->space, u0, u1, progress, &mine, &pairs);
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

PetscErrorCode SbModelGuardNearest(SbModel m, size_t size, char text[])
{
  PetscReal least = PETSC_MAX_REAL;
  char mine[256];

  PetscFunctionBeginUser;
  text[0] = 0;
  for (PetscInt e = 0; e < m->npotential; e++) {
    PetscReal gap;

    SbEffectCall(m->potential[e], nearest, m->space, &gap, sizeof(mine), mine);
    if (gap >= least) continue;
    least = gap;
    PetscCall(PetscStrncpy(text, mine, size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGuardLag(SbModel m, Vec X, PetscBool *again)
{
  const PetscReal *u;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  PetscCall(SbSpaceGetLocalRead(m->space, X, &u));
  for (PetscInt e = 0; e < m->npotential; e++) {
    PetscBool mine;

    SbEffectCall(m->potential[e], lag, m->space, u, &mine);
    *again = (PetscBool)(*again || mine);
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, X, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGuardHessian(SbModel m, Vec U, SbContactHessian kind, SbBlocks *blocks)
{
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  for (PetscInt e = 0; e < m->npotential; e++)
    SbEffectCall(m->potential[e], hessian, m->space, u, kind, blocks);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGuardGradient(SbModel m, Vec U, PetscReal scale, PetscBool free_only, PetscReal *energy,
                                    Vec F)
{
  const SbSpace s = m->space;
  const PetscReal *u;
  PetscReal *f, sum = 0.;
  PetscScalar *out;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt e = 0; e < m->npotential; e++) {
    PetscReal mine;

    SbEffectCall(m->potential[e], potential, s, u, &mine, f);
    sum += mine;
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(VecGetArray(F, &out));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    if (!free_only || !(s->fixed[i / 3] & (1 << (i % 3)))) out[i] += scale * f[i];
  }
  PetscCall(VecRestoreArray(F, &out));
  PetscCall(PetscFree(f));
  if (energy) PetscCallMPI(MPI_Allreduce(&sum, energy, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelGuardWork(SbModel m, Vec U, PetscReal *work, Vec F)
{
  PetscFunctionBeginUser;
  *work = 0.;
  PetscCall(SbModelGuardGradient(m, U, 1., PETSC_FALSE, NULL, F));
  for (PetscInt e = 0; e < m->npotential; e++) {
    PetscReal mine;

    SbEffectCall(m->potential[e], work, &mine);
    *work += mine;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
