/*
  Vectors of a space: the storage of a ghosted PETSc vector is the local array that the kernels read, owned nodes first.

  Reading updates the ghosts; writing does not communicate. On one rank there are no ghosts, and vectors are plain sequential ones.
*/
#include "fem_impl.h"

PetscErrorCode SbSpaceCreateVec(SbSpace s, Vec *v)
{
  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s->template_vec, v));
  PetscCall(VecZeroEntries(*v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The storage of a ghosted vector continues after its owned entries. */
PetscErrorCode SbSpaceGetLocalRead(SbSpace s, Vec v, const PetscReal **array)
{
  PetscFunctionBeginUser;
  if (s->ghosted) {
    PetscCall(VecGhostUpdateBegin(v, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGhostUpdateEnd(v, INSERT_VALUES, SCATTER_FORWARD));
  }
  PetscCall(VecGetArrayRead(v, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceRestoreLocalRead(SbSpace s, Vec v, const PetscReal **array)
{
  PetscFunctionBeginUser;
  (void)s;
  PetscCall(VecRestoreArrayRead(v, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceGetLocalWrite(SbSpace s, Vec v, PetscReal **array)
{
  PetscFunctionBeginUser;
  if (s->ghosted) {
    Vec local = NULL;

    PetscCall(VecGhostGetLocalForm(v, &local));
    PetscCheck(local, s->comm, PETSC_ERR_ARG_WRONG,
               "The vector has no ghost entries: make it by SbSpaceCreateVec()");
    PetscCall(VecGhostRestoreLocalForm(v, &local));
  }
  PetscCall(VecGetArray(v, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceRestoreLocalWrite(SbSpace s, Vec v, PetscReal **array)
{
  PetscFunctionBeginUser;
  (void)s;
  PetscCall(VecRestoreArray(v, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceUpdateGhosts(SbSpace s, PetscReal x[])
{
  const PetscReal *all;

  PetscFunctionBeginUser;
  if (!s->ghosted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecPlaceArray(s->template_vec, x));
  PetscCall(SbSpaceGetLocalRead(s, s->template_vec, &all));
  PetscCall(SbSpaceRestoreLocalRead(s, s->template_vec, &all));
  PetscCall(VecResetArray(s->template_vec));
  PetscFunctionReturn(PETSC_SUCCESS);
}
