/*
  body_steps.c - a direction whose length is limited body by body: what touches nothing goes on
  while others are held up by a collision.

  Bodies with an active pair between them have one potential and keep a common length; those without
  share none, so that the direction remains one of descent.
*/
#include "contact_impl.h"

/* The lowest number of the group of a body. */
static PetscInt group_of(PetscInt group[], PetscInt b)
{
  while (group[b] != b)
    b = group[b] = group[group[b]];
  return b;
}

void SbBodyStepsJoin(SbBodySteps *bodies, PetscInt one, PetscInt two)
{
  if (one < bodies->n)
    bodies->touches[one] = PETSC_TRUE;
  if (two < bodies->n)
    bodies->touches[two] = PETSC_TRUE;
  if (one >= bodies->n || two >= bodies->n)
    return;
  one = group_of(bodies->group, one);
  two = group_of(bodies->group, two);
  bodies->group[PetscMax(one, two)] = PetscMin(one, two);
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
      if (all[k] != k % n)
        SbBodyStepsJoin(bodies, k % n, all[k]);
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

PetscErrorCode SbContactSetBodySteps(const SbContactSet *contacts, Vec X, Vec Y, PetscBool alone[])
{
  const SbSpace s = contacts->space;
  SbBodySteps bodies = {.n = s->mesh->nbody, .touches = alone};
  const PetscReal *u0, *u1;
  PetscScalar *y;
  Vec next;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(bodies.n, &bodies.part, bodies.n, &bodies.group));
  for (PetscInt b = 0; b < bodies.n; b++) {
    bodies.part[b] = 1.;
    bodies.group[b] = b;
    bodies.touches[b] = PETSC_FALSE;
  }
  PetscCall(VecDuplicate(X, &next));
  PetscCall(VecWAXPY(next, -1., Y, X));
  PetscCall(SbSpaceGetLocalRead(s, X, &u0));
  PetscCall(SbSpaceGetLocalRead(s, next, &u1));
  for (PetscInt k = 0; k < contacts->npotential; k++) {
    const SbContact c = contacts->potential[k];
    PetscReal part;
    PetscInt nactive;

    PetscCall((*c->ops->max_step)(c, s, u0, u1, &bodies, &part, &nactive));
  }
  PetscCall(SbSpaceRestoreLocalRead(s, next, &u1));
  PetscCall(SbSpaceRestoreLocalRead(s, X, &u0));
  PetscCall(VecDestroy(&next));
  PetscCall(merge(s->comm, &bodies));

  PetscCall(VecGetArray(Y, &y));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    y[i] *= bodies.part[s->node_body[i / 3]];
  PetscCall(VecRestoreArray(Y, &y));
  for (PetscInt b = 0; b < bodies.n; b++)
    alone[b] = (PetscBool)(!bodies.touches[b] && bodies.part[b] == 1.);
  PetscCall(PetscFree2(bodies.part, bodies.group));
  PetscFunctionReturn(PETSC_SUCCESS);
}
