/*
  long_way.c - bodies that would go farther than their own size in a time step, and meet something
  on the way: a warning.

  Collision detection keeps surfaces apart along the iterations of a step. Where these are long
  beside the bodies, they may end beside or behind what a body meets, as any path around it is one
  without an intersection, and with more energy than at the start.
*/
#include "time_impl.h"

#define SQRT3 1.7320508075688772

/* way[b] = longest displacement Y of the nodes of body b, m, on all ranks. */
static PetscErrorCode longest_by_body(const SbModel m, Vec Y, PetscReal way[])
{
  const SbSpace s = m->space;
  const PetscScalar *y;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(way, m->nbody));
  PetscCall(VecGetArrayRead(Y, &y));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal at[3] = {y[3 * i], y[3 * i + 1], y[3 * i + 2]};

    way[s->node_body[i]] = PetscMax(way[s->node_body[i]], PetscSqrtReal(SbDot3(at, at)));
  }
  PetscCall(VecRestoreArrayRead(Y, &y));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, way, (PetscMPIInt)m->nbody, MPIU_REAL, MPI_MAX, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunWarnLongWay(SbRun run, const SbSolvedStep *step)
{
  const SbModel m = run->model;
  PetscReal farthest = 1.; /* over the body's size */
  PetscInt worst = -1;
  PetscReal fastest; /* component, m/s */
  PetscReal *way, *free;
  PetscReal part;
  PetscBool farther;
  Vec Y, Z;

  PetscFunctionBeginUser;
  if (run->monitors.warned_way || !m->dynamic || !m->contacts.npotential)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(run->state.V, NORM_INFINITY, &fastest));
  if (SQRT3 * fastest * step->dt <= SbBodySmallest(m->nbody, m->body))
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the way with the velocity at the start, and the part of it that is free */
  PetscCall(PetscMalloc2(m->nbody, &way, m->nbody, &free));
  PetscCall(VecDuplicate(run->state.V, &Y));
  PetscCall(VecDuplicate(run->state.V, &Z));
  PetscCall(VecAXPBY(Y, -step->dt, 0., run->state.V));
  PetscCall(longest_by_body(m, Y, way));
  PetscCall(SbContactSetBodySteps(&m->contacts, step->U0, Y, Z, NULL, &part, &farther));
  PetscCall(longest_by_body(m, Z, free));

  /* the body that would go the farthest */
  for (PetscInt b = 0; b < m->nbody; b++) {
    const PetscReal far = way[b] / SbBoxDiagonal(m->body[b].bbox);

    if (free[b] == way[b] || far <= farthest)
      continue;
    worst = b;
    farthest = far;
  }
  if (worst >= 0) {
    const PetscReal size = SbBoxDiagonal(m->body[worst].bbox);

    run->monitors.warned_way = PETSC_TRUE;
    PetscCall(SbWarning(
      m->comm,
      "t = %g s: %s would go %.3g m in a step of %g s, %.2g times its size of %.3g m, and meets "
      "something on the way: surfaces do not pass through each other in the iterations of the "
      "step, but it may end beside or behind what it meets, with energy that it did not have. "
      "Steps in which it goes less than its size resolve this: -ts_dt below %.2g",
      (double)step->t, m->body[worst].name, (double)way[worst], (double)step->dt, (double)farthest,
      (double)size, (double)(step->dt / farthest)));
  }
  PetscCall(VecDestroy(&Y));
  PetscCall(VecDestroy(&Z));
  PetscCall(PetscFree2(way, free));
  PetscFunctionReturn(PETSC_SUCCESS);
}
