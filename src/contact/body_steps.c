/*
  body_steps.c - a direction whose length is limited body by body: what touches nothing goes on
  while others are held up by a collision.

  Bodies with a pair, lagged friction or a coupling between them have one potential and keep a
  common length; those without share none, so that the direction remains one of descent.
*/
#include "contact_impl.h"

/* The lowest number of the group of a body. */
static PetscInt group_of(PetscInt group[], PetscInt b)
{
  while (group[b] != b)
    b = group[b] = group[group[b]];
  return b;
}

/* Two bodies keep a common length. */
static void join(SbBodySteps *bodies, PetscInt one, PetscInt two)
{
  one = group_of(bodies->group, one);
  two = group_of(bodies->group, two);
  bodies->group[PetscMax(one, two)] = PetscMin(one, two);
}

void SbBodyStepsJoin(SbBodySteps *bodies, PetscInt one, PetscInt two)
{
  if (one < bodies->n)
    bodies->touches[one] = PETSC_TRUE;
  if (two < bodies->n)
    bodies->touches[two] = PETSC_TRUE;
  if (one < bodies->n && two < bodies->n)
    join(bodies, one, two);
}

/* The groups of all ranks together, and the least fraction of each for all of its bodies. */
static PetscErrorCode merge(MPI_Comm comm, SbBodySteps *bodies)
{
  const PetscInt n = bodies->n;
  PetscInt *all;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (size > 1) {
    PetscCall(PetscMalloc1(size * n, &all));
    PetscCallMPI(
      MPI_Allgather(bodies->group, (PetscMPIInt)n, MPIU_INT, all, (PetscMPIInt)n, MPIU_INT, comm));
    for (PetscInt k = 0; k < size * n; k++)
      join(bodies, k % n, all[k]);
    PetscCall(PetscFree(all));
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, bodies->touches, (PetscMPIInt)n, SB_MPI_BOOL, MPI_LOR, comm));
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, bodies->part, (PetscMPIInt)n, MPIU_REAL, MPI_MIN, comm));
  }
  for (PetscInt b = 0; b < n; b++) {
    const PetscInt first = group_of(bodies->group, b);

    bodies->part[first] = PetscMin(bodies->part[first], bodies->part[b]);
  }
  for (PetscInt b = 0; b < n; b++)
    bodies->part[b] = bodies->part[group_of(bodies->group, b)];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Joins bodies whose nodes an effect couples: springs, ties, joints. */
static void join_coupled(SbSpace s, SbBodySteps *bodies)
{
  const SbCouplings *c = &s->couplings;

  for (PetscInt k = 0; k < c->n; k++)
    for (PetscInt i = c->start[k] + 1; i < c->start[k + 1]; i++)
      join(bodies, s->node_body[c->node[c->start[k]]], s->node_body[c->node[i]]);
}

PetscErrorCode SbContactSetBodySteps(const SbContactSet *contacts, Vec X, Vec Y, Vec Z,
                                     PetscBool alone[], PetscReal *part, PetscBool *farther)
{
  const SbSpace s = contacts->space;
  SbBodySteps bodies = {.n = s->mesh->nbody};
  const PetscReal *u0, *u1;
  PetscScalar *z;

  PetscFunctionBeginUser;
  PetscCall(
    PetscMalloc3(bodies.n, &bodies.part, bodies.n, &bodies.group, bodies.n, &bodies.touches));
  for (PetscInt b = 0; b < bodies.n; b++) {
    bodies.part[b] = 1.;
    bodies.group[b] = b;
    bodies.touches[b] = PETSC_FALSE;
  }
  *part = 1.;
  PetscCall(VecWAXPY(Z, -1., Y, X));
  PetscCall(SbSpaceGetLocalRead(s, X, &u0));
  PetscCall(SbSpaceGetLocalRead(s, Z, &u1));
  for (PetscInt k = 0; k < contacts->npotential; k++) {
    PetscReal mine = 1.;
    PetscInt nactive = 0;

    PHASE_CALL(contacts->potential[k], max_step, s, u0, u1, &bodies, &mine, &nactive);
    *part = PetscMin(*part, mine);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, Z, &u1));
  PetscCall(SbSpaceRestoreLocalRead(s, X, &u0));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, part, 1, MPIU_REAL, MPI_MIN, s->comm));

  *farther = PETSC_FALSE;
  if (*part < 1. || alone) {
    join_coupled(s, &bodies);
    PetscCall(merge(s->comm, &bodies));
  }
  for (PetscInt b = 0; b < bodies.n; b++) {
    *farther = (PetscBool)(*farther || bodies.part[b] > *part);
    if (alone)
      alone[b] = (PetscBool)(!bodies.touches[b] && bodies.part[b] == 1.);
  }
  PetscCall(VecCopy(Y, Z));
  PetscCall(VecGetArray(Z, &z));
  for (PetscInt i = 0; *part < 1. && i < 3 * s->nnode_owned; i++)
    z[i] *= bodies.part[s->node_body[i / 3]];
  PetscCall(VecRestoreArray(Z, &z));
  PetscCall(PetscFree3(bodies.part, bodies.group, bodies.touches));
  PetscFunctionReturn(PETSC_SUCCESS);
}
