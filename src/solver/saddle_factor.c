/*
  The saddle-point system of exact constraints by a sparse factorisation, for response `multiplier`:

    [ K + F^T k S   F^T        ] [ z ]   [ r ]
    [ G            -e diag(B)  ] [ m ] = [ 0 ],    B = G D F^T

  It is regular where K is not: a body that only constraints support needs no anchors (constraint.c). e is tiny: with it constraints that depend on others
  share their force instead of making the matrix singular. What e leaves of G z is projected away by the caller.

  The matrix is indefinite, and symmetric but for friction: LDL^T or LU of MUMPS, or LU of UMFPACK on one of the ranks (pc_direct.c). Springs stand in it, although
  they join nodes that K's graph does not. Made again when K or the constraints have changed, and only then.
*/
#include "solver_impl.h"
#include "sbconstraint.h"
#include "rotated.h"
#include "sbsolver.h"

#define DIRECT_STATIC \
  30000 /* unknowns up to which a factorisation per solve is chosen; see docs/reports/contact.md */
#define DIRECT_DYNAMIC 1000

struct _p_SbSaddleFactor {
  PC pc;
  Vec b, x;                 /* displacements and multipliers of this rank */
  PetscInt version, matrix; /* of the constraints and of K */
  PetscBool ok;
};

PetscErrorCode SbSaddleChoose(SbSpace s, PetscBool dynamic, PetscInt choice, SbSaddle *saddle, char reason[],
                              size_t size)
{
  const PetscInt unknowns = 3 * s->Nnode;
  const char *package;

  PetscFunctionBeginUser;
  PetscCall(SbDirectPackage(s->comm, unknowns, PETSC_FALSE, &package));
  PetscCheck(choice != 1 || package, s->comm, PETSC_ERR_USER,
             "-saddle_solver direct needs MUMPS or SuiteSparse, and this PETSc was built without both: use "
             "-saddle_solver iterative");
  if (!choice) choice = package && unknowns <= (dynamic ? DIRECT_DYNAMIC : DIRECT_STATIC) ? 1 : 2;
  *saddle = choice == 1 ? SB_SADDLE_DIRECT : SB_SADDLE_NONE;
  if (choice == 1)
    PetscCall(PetscSNPrintf(reason, size, "multipliers of contact directly, by %s", package));
  else
    PetscCall(PetscSNPrintf(reason, size, "constraints of contact by their null space"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_factor(SbSaddleFactor *factored)
{
  SbSaddleFactor f = *factored;

  PetscFunctionBeginUser;
  PetscCall(PCDestroy(&f->pc));
  PetscCall(VecDestroy(&f->b));
  PetscCall(VecDestroy(&f->x));
  PetscCall(PetscFree(*factored));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K by scalars. MatConvert() is not asked: it takes a parallel block matrix apart, whose parts others hold. */
static PetscErrorCode copy_matrix(SbSpace s, Mat K, Mat *A)
{
  const PetscInt n = s->nnode_owned;
  PetscInt *node, *ia, *ja, *near, *far;
  PetscReal *block;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(n, &node, n + 1, &ia, 3 * n, &near, 3 * n, &far));
  for (PetscInt i = 0; i < n; i++) node[i] = i;
  PetscCall(SbSpaceGetRows(s, K, n, node, ia, NULL, NULL));
  PetscCall(PetscMalloc2(ia[n], &ja, 9 * ia[n], &block));
  PetscCall(SbSpaceGetRows(s, K, n, node, ia, ja, block));
  for (PetscInt i = 0; i < 3 * n; i++) {
    near[i] = far[i] = 0;
    for (PetscInt e = ia[i / 3]; e < ia[i / 3 + 1]; e++) (ja[e] < n ? near : far)[i] += 3;
  }
  PetscCall(MatCreateAIJ(s->comm, 3 * n, 3 * n, 3 * s->Nnode, 3 * s->Nnode, 0, near, 0, far, A));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt row = 3 * s->gnode[i], rows[3] = {row, row + 1, row + 2};

    for (PetscInt e = ia[i]; e < ia[i + 1]; e++) {
      const PetscInt column = 3 * s->gnode[ja[e]], columns[3] = {column, column + 1, column + 2};

      PetscCall(MatSetValues(*A, 3, rows, 3, columns, block + 9 * e, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(PetscFree2(ja, block));
  PetscCall(PetscFree4(node, ia, near, far));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K and the springs */
static PetscErrorCode create_stiffness(SbSpace s, Mat *A)
{
  SbConstraints c = s->constraints;
  Mat kS, FtkS;

  PetscFunctionBeginUser;
  PetscCall(copy_matrix(s, c->K, A));
  if (!c->spring.N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDuplicate(c->spring.free, MAT_COPY_VALUES, &kS));
  PetscCall(MatDiagonalScale(kS, c->k, NULL));
  PetscCall(MatTransposeMatMult(c->spring.push_free, kS, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &FtkS));
  PetscCall(MatAXPY(*A, 1., FtkS, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&kS));
  PetscCall(MatDestroy(&FtkS));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -e diag(G D F^T) */
static PetscErrorCode create_small(SbConstraints c, Mat *C)
{
  Vec d;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(c->gram, &d, NULL));
  PetscCall(MatGetDiagonal(c->gram, d));
  PetscCall(VecScale(d, -SB_CONSTRAINT_REGULARIZATION));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)c->gram), c->exact.n, c->exact.n, c->exact.N,
                         c->exact.N, 1, NULL, 0, NULL, C));
  PetscCall(MatDiagonalSet(*C, d, INSERT_VALUES));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_saddle(SbSpace s, Mat *S)
{
  SbConstraints c = s->constraints;
  Mat block[4] = {NULL, NULL, c->exact.free, NULL}, nest;

  PetscFunctionBeginUser;
  PetscCall(create_stiffness(s, &block[0]));
  PetscCall(MatTranspose(c->exact.push_free, MAT_INITIAL_MATRIX, &block[1]));
  PetscCall(create_small(c, &block[3]));
  PetscCall(MatCreateNest(PetscObjectComm((PetscObject)c->gram), 2, NULL, 2, NULL, block, &nest));
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, S));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&block[0]));
  PetscCall(MatDestroy(&block[1]));
  PetscCall(MatDestroy(&block[3]));
  PetscCall(MatSetOption(*S, MAT_SYMMETRIC, (PetscBool)!c->nonsymmetric));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode factor(SbSpace s, SbSaddleFactor f)
{
  PCFailedReason failed;
  const char *package;
  Mat S;

  PetscFunctionBeginUser;
  PetscCall(PCDestroy(&f->pc));
  PetscCall(VecDestroy(&f->b));
  PetscCall(VecDestroy(&f->x));
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, PETSC_FALSE, &package));
  PetscCall(create_saddle(s, &S));
  PetscCall(MatCreateVecs(S, &f->x, &f->b));
  PetscCall(PCCreate(s->comm, &f->pc));
  PetscCall(PCSetOptionsPrefix(f->pc, "saddle_"));
  PetscCall(PCSetOperators(f->pc, S, S));
  PetscCall(MatDestroy(&S)); /* the preconditioner keeps it */
  PetscCall(SbPCDirectSet(f->pc, package, (PetscBool)!s->constraints->nonsymmetric));
  PetscCall(PCSetFromOptions(f->pc));
  PetscCall(SbPCCheckPivots(f->pc));
  PetscCall(PCSetUp(f->pc));
  PetscCall(PCGetFailedReason(f->pc, &failed));
  f->ok = (PetscBool)!failed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A factorisation of K as it is now with the constraints as they are. */
static PetscErrorCode update(SbSpace s)
{
  SbConstraints c = s->constraints;
  SbSaddleFactor f;

  PetscFunctionBeginUser;
  if (!c->factored) {
    PetscCall(PetscNew(&c->factored));
    c->destroy_factored = destroy_factor;
  }
  f = c->factored;
  if (f->pc && f->matrix == c->matrix && f->version == c->version) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(factor(s, f));
  f->matrix = c->matrix;
  f->version = c->version;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSaddleFactorSolve(SbSpace s, Vec r, Vec z, PetscBool *ok)
{
  const PetscInt n = 3 * s->nnode_owned;
  const PetscScalar *from;
  PetscScalar *to;
  SbSaddleFactor f;

  PetscFunctionBeginUser;
  PetscCall(update(s));
  f = s->constraints->factored;
  *ok = f->ok;
  if (!f->ok) {
    PetscCall(VecSet(z, PETSC_INFINITY));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecZeroEntries(f->b));
  PetscCall(VecGetArrayRead(r, &from));
  PetscCall(VecGetArray(f->b, &to));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArray(f->b, &to));
  PetscCall(VecRestoreArrayRead(r, &from));
  PetscCall(PCApply(f->pc, f->b, f->x));
  PetscCall(VecGetArrayRead(f->x, &from));
  PetscCall(VecGetArray(z, &to));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArray(z, &to));
  PetscCall(VecRestoreArrayRead(f->x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSaddleFactorCountNegative(SbSpace s, PetscInt *negative)
{
  const SbSaddleFactor f = s->constraints->factored;

  PetscFunctionBeginUser;
  *negative = -1;
  if (!f || !f->ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbPCDirectCountNegative(f->pc, negative));
  if (*negative >= 0) *negative = PetscMax(0, *negative - s->constraints->exact.N);
  PetscFunctionReturn(PETSC_SUCCESS);
}
