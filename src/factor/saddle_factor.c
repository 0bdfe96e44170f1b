/*
  Sparse factorisation of the saddle-point system of constraints, exact ones and springs: for
  response `multiplier`, and where iterations in the null space of the constraints take too many
  (src/time/solver_list.c):

    [ K + F^T k G   F^T ] [ z ]   [ r ]
    [ G             0   ] [ m ] = [ 0 ]

  Each constraint acts on one node, so that its multiplier m is eliminated there
  (src/fem/constraint.c): with projectors P and Q of the nodes, s the sizes of their blocks and r =
  P r

    (P (K + F^T k G) P + s Q) z = r.

  This is regular even for a singular K, of a body that only constraints support. It is symmetric
  while no node slides with friction, and definite where K is: L L^T of CHOLMOD, LDL^T or LU of
  MUMPS, or LU of UMFPACK (direct.c). It is factored again only when K or the constraints have
  changed; the pattern is that of K, and is analysed once.
*/
#include "sbfactor.h"

/* The matrix of the system, of the type AIJ. */
static PetscErrorCode assemble(SbSpace s, Mat A)
{
  const SbConstraints c = s->constraints;
  const PetscInt n = s->nnode_owned;
  const PetscInt nz = s->plan->di[n] + s->plan->oi[n];
  PetscInt *ia, *ja;
  PetscReal *block;

  PetscFunctionBeginUser;

  /* K as AIJ; MatConvert() would need parts of the block matrix that are in use */
  PetscCall(PetscMalloc3(n + 1, &ia, nz, &ja, 9 * (size_t)nz, &block));
  PetscCall(SbSpaceGetRows(s, c->K, n, NULL, ia, ja, block));

  /* springs are added and blocks projected while they are copied */
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = ia[k]; j < ia[k + 1]; j++) {
      if (ja[j] == k) {
        for (int i = 0; i < 3 && c->added; i++)
          block[9 * j + 4 * i] -= c->added[3 * k + i];
        SbConstraintsAddSprings(s, k, block + 9 * j);
      }
      SbConstraintsProjectBlock(s, k, ja[j], 3, 1, block + 9 * j);
      PetscCall(
        MatSetValuesBlocked(A, 1, &s->gnode[k], 1, &s->gnode[ja[j]], block + 9 * j, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(PetscFree3(ia, ja, block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factorisation of a symmetric system, or of one that is not. */
static PetscErrorCode create(SbSpace s, PetscBool symmetric, PC *pc)
{
  const PetscBool definite = (PetscBool)(symmetric && s->constraints->definite);
  const char *package;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, definite, &package));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_AIJ, &A));
  PetscCall(assemble(s, A));
  PetscCall(MatSetOption(A, MAT_SYMMETRIC, symmetric));
  PetscCall(PCCreate(s->comm, pc));
  PetscCall(PCSetOptionsPrefix(*pc, "saddle_"));
  PetscCall(PCSetOperators(*pc, A, A));
  PetscCall(MatDestroy(&A)); /* the preconditioner keeps a reference */
  PetscCall(SbPCDirectSet(*pc, package, symmetric));
  PetscCall(PCSetFromOptions(*pc));
  PetscCall(SbPCCheckPivots(*pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its time is part of the solve that it belongs to: it counts once. */
static PetscErrorCode set_up(PC pc)
{
  static const char *const names[] = {"PCSetUp", "PCSetUpOnBlocks"};
  PetscLogEvent event;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(names); i++) {
    PetscCall(PetscLogEventGetId(names[i], &event));
    PetscCall(PetscLogEventDeactivatePush(event));
  }
  PetscCall(PCSetUp(pc));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(names); i++) {
    PetscCall(PetscLogEventGetId(names[i], &event));
    PetscCall(PetscLogEventDeactivatePop(event));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSaddleFactorSolve(SbSpace s, Vec r, Vec z, PCFailedReason *failed)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;

  /* the factorisation of this K with these constraints is missing */
  if (!c->factored || c->factored_matrix != c->matrix || c->factored_version != c->version) {
    if (c->failed || c->factored_symmetric == c->tilted)
      PetscCall(PCDestroy(&c->factored));
    if (c->factored) {
      Mat A;

      PetscCall(PCGetOperators(c->factored, &A, NULL));
      PetscCall(assemble(s, A));
    } else {
      c->factored_symmetric = (PetscBool)!c->tilted;
      PetscCall(create(s, c->factored_symmetric, &c->factored));
    }
    PetscCall(set_up(c->factored));
    PetscCall(PCGetFailedReason(c->factored, &c->failed));
    c->factored_matrix = c->matrix;
    c->factored_version = c->version;
  }

  *failed = c->failed;
  if (c->failed)
    PetscCall(VecSet(z, PETSC_INFINITY));
  else
    PetscCall(PCApply(c->factored, r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}
