/*
  empty_blocks.c - block Jacobi and additive Schwarz on ranks that own no unknowns.

  PETSc's incomplete Cholesky of an SBAIJ matrix reads its first row, which a matrix without rows
  does not have. Blocks without rows therefore get no preconditioner.

  petsc/private/pcimpl.h: the operations of a PC that PETSc implements have no public setter, and
  the blocks exist only between its set-up and theirs.
*/
#include "sbfactor.h"
#include <petsc/private/pcimpl.h>

#define ORIGINAL "SbPCSetUpOnBlocksOriginal_C"
#define ORIGINAL_SETUP "SbPCSetUpBlocksOriginal_C"

static PetscErrorCode setup_blocks(PC pc)
{
  PetscErrorCode (*original)(PC) = NULL;
  PetscBool jacobi;
  PetscInt n = 0;
  KSP *block;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCBJACOBI, &jacobi));
  if (jacobi)
    PetscCall(PCBJacobiGetSubKSP(pc, &n, NULL, &block));
  else
    PetscCall(PCASMGetSubKSP(pc, &n, NULL, &block));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt rows;
    Mat A;
    PC inner;

    PetscCall(KSPGetOperators(block[i], &A, NULL));
    PetscCall(MatGetSize(A, &rows, NULL));
    PetscCall(KSPGetPC(block[i], &inner));
    if (!rows)
      PetscCall(PCSetType(inner, PCNONE));
  }
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL, &original));
  PetscCall((*original)(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first set-up of PETSc's types chooses how the blocks are set up. */
static PetscErrorCode setup(PC pc)
{
  PetscErrorCode (*original)(PC) = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL_SETUP, &original));
  PetscCall((*original)(pc));
  if (pc->ops->setuponblocks && pc->ops->setuponblocks != setup_blocks) {
    PetscCall(PetscObjectComposeFunction((PetscObject)pc, ORIGINAL, pc->ops->setuponblocks));
    pc->ops->setuponblocks = setup_blocks;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCAllowEmptyBlocks(PC pc)
{
  PetscBool blocks;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &blocks, PCBJACOBI, PCASM, ""));
  if (!blocks || pc->ops->setup == setup)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, ORIGINAL_SETUP, pc->ops->setup));
  pc->ops->setup = setup;
  PetscFunctionReturn(PETSC_SUCCESS);
}
