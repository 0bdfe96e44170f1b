/*
  Sparse factorisation of the saddle-point system of exact constraints, for response `multiplier`:

    [ K + F^T k G   F^T ] [ z ]   [ r ]
    [ G             0   ] [ m ] = [ 0 ]

  Each constraint acts on one node, so that its multiplier m is eliminated there
  (src/fem/constraint.c): with projectors P and Q of the nodes, s the sizes of their blocks and r =
  P r

    (P (K + F^T k G) P + s Q) z = r.

  This is regular even for a singular K, of a body that only constraints support. It is symmetric
  without friction: LDL^T or LU of MUMPS, or LU of UMFPACK on one rank (direct.c). It is factored
  again only when K or the constraints have changed.
*/
#include "sbfactor.h"

PetscErrorCode SbSaddleFactorSolve(SbSpace s, Vec r, Vec z, PCFailedReason *failed)
{
  const char *package;
  SbConstraints c = s->constraints;
  Mat A;

  PetscFunctionBeginUser;

  /* the factorisation of this K with these constraints is missing */
  if (!c->factored || c->factored_matrix != c->matrix || c->factored_version != c->version) {
    const PetscInt n = s->nnode_owned;
    const PetscInt nz = s->plan->di[n] + s->plan->oi[n];
    PetscInt *ia, *ja;
    PetscReal *block;

    PetscCall(PCDestroy(&c->factored));
    PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, PETSC_FALSE, &package));

    /* K as AIJ; MatConvert() would need parts of the block matrix that are in use */
    PetscCall(PetscMalloc3(n + 1, &ia, nz, &ja, 9 * (size_t)nz, &block));
    PetscCall(SbSpaceGetRows(s, c->K, n, NULL, ia, ja, block));
    PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_AIJ, &A));

    /* springs are added and blocks projected while they are copied */
    for (PetscInt k = 0; k < n; k++) {
      for (PetscInt j = ia[k]; j < ia[k + 1]; j++) {
        if (ja[j] == k)
          SbConstraintsAddSprings(s, k, block + 9 * j);
        SbConstraintsProjectBlock(s, k, ja[j], 3, 1, block + 9 * j);
        PetscCall(MatSetValuesBlocked(A, 1, &s->gnode[k], 1, &s->gnode[ja[j]], block + 9 * j,
                                      INSERT_VALUES));
      }
    }
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatSetOption(A, MAT_SYMMETRIC, (PetscBool)!c->nonsymmetric));
    PetscCall(PetscFree3(ia, ja, block));
    PetscCall(PCCreate(s->comm, &c->factored));
    PetscCall(PCSetOptionsPrefix(c->factored, "saddle_"));
    PetscCall(PCSetOperators(c->factored, A, A));
    PetscCall(MatDestroy(&A)); /* the preconditioner keeps a reference */
    PetscCall(SbPCDirectSet(c->factored, package, (PetscBool)!c->nonsymmetric));
    PetscCall(PCSetFromOptions(c->factored));
    PetscCall(SbPCCheckPivots(c->factored));
    PetscCall(PCSetUp(c->factored));
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
