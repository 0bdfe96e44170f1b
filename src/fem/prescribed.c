/*
  Prescribed unknowns. They stay in the system, so that the block size is three everywhere: their rows are u = prescribed
  (see tangent.c for the matrix). The initial guess of every solve has the prescribed values, so that their
  residual is zero and their effect on free unknowns is in the right-hand side.
*/
#include "fem_impl.h"

PetscErrorCode SbSpacePrescribe(SbSpace s, PetscInt node, int components)
{
  PetscFunctionBeginUser;
  PetscCheck(!s->fixed_node, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "Unknowns can be prescribed during set-up only");
  s->fixed[node] |= (uint8_t)(components & 7);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpacePrescribeDone(SbSpace s)
{
  PetscFunctionBeginUser;
  s->nfixed = 0;
  for (PetscInt i = 0; i < s->nnode; i++) s->nfixed += s->fixed[i] != 0;
  PetscCall(PetscCalloc2(s->nfixed, &s->fixed_node, 3 * s->nfixed, &s->fixed_value));
  s->nfixed = 0;
  for (PetscInt i = 0; i < s->nnode; i++) {
    if (s->fixed[i]) s->fixed_node[s->nfixed++] = i;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceZeroPrescribed(SbSpace s, PetscBool prescribed, Vec X)
{
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (prescribed == ((s->fixed[i / 3] >> i % 3) & 1)) x[i] = 0.;
  PetscCall(VecRestoreArray(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
