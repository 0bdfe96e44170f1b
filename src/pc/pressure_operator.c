/*
  The tangent with a separate volumetric part: K = A + B^T C^-1 B.

  Every law's tangent is A + sum over cells of lambda / V b b^T, b_a = V D grad psi_a
  (SbMaterialOps.dilatation_gradient). A does not contain lambda and is stored; a row of B is the
  vector b of a cell; C is diagonal, V / lambda of each cell. K x is computed from these, without
  cancellation of terms with lambda.

  In the vectors of the iteration the pressures p of the cells follow the displacements of the
  nodes. A cell's pressure belongs to the rank that owns the cell; B^T p updates those of the ghost
  cells. Prescribed unknowns: their columns of B are zero.
*/
#include "pressure.h"
#include "sbkernel.h"

#define S0 1.5 /* factor in B A^-1 B^T ~ S0 V / (2 mu): fewest iterations among 0.5, 1 and 1.5 */
#define LARGEST_WEIGHT 1e4 /* largest lambda / mu in the weighted norm of GMRES */

static void clear_fixed(SbSpace s, PetscReal x[])
{
  for (PetscInt k = 0; k < 3 * s->nfixed && s->fixed_node[k / 3] < s->nnode_owned; k++) {
    const PetscInt i = s->fixed_node[k / 3];
    const PetscInt c = k % 3;

    if (s->fixed[i] & (1 << c))
      x[3 * i + c] = 0.;
  }
}

/* d = B u; absolute: with |B|. */
static PetscErrorCode apply_divergence(SbPressureOperator op, const PetscScalar u[],
                                       PetscBool absolute, PetscScalar d[])
{
  SbSpace s = op->space;
  PetscScalar *x;
  const PetscReal *local;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(op->u, &x));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    x[i] = absolute ? PetscAbsScalar(u[i]) : u[i];
  clear_fixed(s, x);
  PetscCall(VecRestoreArray(op->u, &x));
  PetscCall(SbSpaceGetLocalRead(s, op->u, &local));

  /* d[ncell_owned] = B x of owned cells; x[nnode][3] with ghosts. */
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPack *v = (const SbPack *)op->volume.b + op->volume.stride * b;
    SbPack cell_u[30];
    SbPack sum = {0};

    sb_gather_strain(s, b, local, cell_u);
    for (int k = 0; k < 3 * region->nnode; k++)
      for (int l = 0; l < SB_BATCH; l++)
        sum[l] += (absolute ? PetscAbsReal(v[k][l]) : v[k][l]) * cell_u[k][l];
    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      d[s->batch_cell[b] + l] = sum[l];
  }
  PetscCall(SbSpaceRestoreLocalRead(s, op->u, &local));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureOperatorAddGradient(SbPressureOperator op, const PetscScalar p[],
                                             PetscBool absolute, PetscReal factor, PetscScalar y[])
{
  SbSpace s = op->space;
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(op->p, p, s->mesh->ncell_owned));
  PetscCall(PetscSFBcastBegin(s->mesh->cell_sf, MPIU_REAL, op->p, op->p, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(s->mesh->cell_sf, MPIU_REAL, op->p, op->p, MPI_REPLACE));
  PetscCall(SbSpaceGetLocalWrite(s, op->u, &f));
  PetscCall(PetscArrayzero(f, 3 * s->nnode));

  /* f = B^T p, complete on owned nodes */
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPack *v = (const SbPack *)op->volume.b + op->volume.stride * b;
    const PetscReal *value = op->p + s->batch_cell[b];
    SbPack force[30];
    SbPack lane = {0};

    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      lane[l] = value[l];
    for (int k = 0; k < 3 * region->nnode; k++)
      for (int l = 0; l < SB_BATCH; l++)
        force[k][l] = (absolute ? PetscAbsReal(v[k][l]) : v[k][l]) * lane[l];
    sb_scatter_strain(s, b, force, f);
  }
  clear_fixed(s, f);
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    y[i] += factor * f[i];
  PetscCall(SbSpaceRestoreLocalWrite(s, op->u, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureOperatorApply(SbPressureOperator op, const PetscScalar u[],
                                       const PetscScalar p[], PetscScalar y[], PetscScalar d[])
{
  PetscFunctionBeginUser;
  PetscCall(VecPlaceArray(op->a, u));
  PetscCall(VecPlaceArray(op->b, y));
  PetscCall(MatMult(op->levels->A[0], op->a, op->b));
  PetscCall(VecResetArray(op->a));
  PetscCall(VecResetArray(op->b));
  PetscCall(apply_divergence(op, u, PETSC_FALSE, d));
  PetscCall(SbPressureOperatorAddGradient(op, p, PETSC_FALSE, 1., y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Y += B^T C^-1 B X; absolute: with |B|. */
static PetscErrorCode add_volumetric(SbPressureOperator op, PetscBool absolute, Vec X, Vec Y)
{
  const PetscScalar *x;
  PetscScalar *y, *d;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(op->space->mesh->ncell_owned, &d));
  PetscCall(VecGetArrayRead(X, &x));
  PetscCall(VecGetArray(Y, &y));
  PetscCall(apply_divergence(op, x, absolute, d));
  for (PetscInt c = 0; c < op->space->mesh->ncell_owned; c++)
    d[c] *= op->Cinv[c];
  PetscCall(SbPressureOperatorAddGradient(op, d, absolute, 1., y));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscCall(VecRestoreArray(Y, &y));
  PetscCall(PetscFree(d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureOperatorRounding(SbPressureOperator op, Vec X, PetscReal *level)
{
  Vec Y;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(X, &Y));
  PetscCall(MatGetDiagonal(op->levels->A[0], Y));
  PetscCall(VecPointwiseMult(Y, Y, X));
  PetscCall(VecAbs(Y));
  PetscCall(add_volumetric(op, PETSC_TRUE, X, Y));
  PetscCall(VecNorm(Y, NORM_2, level));
  *level *= PETSC_MACHINE_EPSILON;
  PetscCall(VecDestroy(&Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Pressure(Mat K, Vec X, Vec Y)
{
  SbPressureOperator op;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(K, &op));
  PetscCall(MatMult(op->levels->A[0], X, Y));
  PetscCall(add_volumetric(op, PETSC_FALSE, X, Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatGetDiagonal_Pressure(Mat K, Vec D)
{
  SbPressureOperator op;
  PetscScalar *d;
  PetscReal *y;
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(K, &op));
  PetscCall(MatGetDiagonal(op->levels->A[0], D));
  s = op->space;
  PetscCall(PetscCalloc1(3 * s->nnode, &y));

  /* Adds the squares of the entries of B C^-1/2 at each node to y[nnode][3]; complete on owned
     nodes. */
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPack *v = (const SbPack *)op->volume.b + op->volume.stride * b;

    for (PetscInt k = 0; k < 3 * region->nnode; k++) {
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        const PetscReal weight = region->broken ? s->batch_weight[4 * b + k / 3][l] : 1.;
        const PetscReal square = op->volume.modulus[b][l] / s->batch_V[b][l] * PetscSqr(v[k][l]);
        const PetscInt node = s->batch_clique[(s->width * b + k / 3) * SB_BATCH + l];

        y[3 * node + k % 3] += square * PetscSqr(weight);
        if (region->broken)
          y[3 * s->batch_clique[(s->width * b + 4 + k / 3) * SB_BATCH + l] + k % 3] +=
            square * PetscSqr(1. - weight);
      }
    }
  }
  clear_fixed(s, y);
  PetscCall(VecGetArray(D, &d));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    d[i] += y[i];
  PetscCall(VecRestoreArray(D, &d));
  PetscCall(PetscFree(y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrices of all levels without the volumetric part, which goes to op->volume. */
static PetscErrorCode assemble(Mat K, const SbStage *stage)
{
  SbPressureOperator op;
  SbLevels v;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(K, &op));
  v = op->levels;
  v->stage = *stage;
  if (v->spring)
    PetscCall(PetscArrayzero(v->spring, 9 * (size_t)v->at[0]->nnode_owned));
  PetscCall(SbSpaceAssembleSplit(v->at[0], stage, v->n, v->at, v->A, &op->volume));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the other levels: A[0] contains the spring already. */
static PetscErrorCode add_spring(Mat K, PetscInt node, PetscReal factor, const PetscReal block[9])
{
  SbPressureOperator op;
  SbLevels v;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(K, &op));
  v = op->levels;
  if (v->multigrid || node >= v->at[0]->nnode_owned)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!v->spring)
    PetscCall(PetscCalloc1(9 * (size_t)v->at[0]->nnode_owned, &v->spring));
  for (int k = 0; k < 9; k++)
    v->spring[9 * node + k] += factor * block[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode finish(Mat K)
{
  SbPressureOperator op;
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(K, &op));
  s = op->space;
  PetscCall(SbLevelsShareSprings(op->levels));
  for (PetscInt k = 0; k < op->levels->n; k++)
    PetscCall(SbSpaceFinishTangent(op->levels->at[k], op->levels->A[k]));

  /* C, its inverse, S and weight of the cells, from the moduli of the last assembly */
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;
      const PetscReal V = s->batch_V[b][l];
      const PetscReal modulus = op->volume.modulus[b][l];
      PetscReal square = 0.;

      for (int k = 0; k < 3 * s->batch_region[b]->nnode; k++)
        square += PetscSqr(op->volume.b[op->volume.stride * b + k][l]);
      op->Cinv[c] = modulus / V;
      op->C[c] = modulus > 0. ? V / modulus : 1.;
      op->S[c] = op->C[c] + (modulus > 0. ? S0 * V / (2. * op->volume.shear[b][l]) : 0.);
      op->weight[c] = 1.;
      if (modulus > 0.)
        op->weight[c] =
          PetscSqrtReal(square) * PetscMin(modulus / V, LARGEST_WEIGHT / (op->S[c] - op->C[c]));
    }
  }
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY)); /* increases the object state */
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Pressure(Mat K)
{
  SbPressureOperator op;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(K, &op));
  PetscCall(SbLevelsDestroy(&op->levels));
  PetscCall(PetscFree(op->memory));
  PetscCall(PetscFree5(op->C, op->Cinv, op->S, op->weight, op->p));
  PetscCall(VecDestroy(&op->u));
  PetscCall(VecDestroy(&op->a));
  PetscCall(VecDestroy(&op->b));
  PetscCall(PetscFree(op));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureOperatorCreate(SbSpace s, Mat *K)
{
  const PetscInt n = s->mesh->ncell_owned;
  SbPressureOperator op;

  PetscFunctionBeginUser;
  PetscCheck(
    !s->faces != !s->edge_node, s->comm, PETSC_ERR_USER,
    "-solver pressure is for bodies with -body_<name>_element p2, or with cr or dg, %s: choose "
    "auto, or cg_two_level",
    s->faces ? "not for both in one run" : "and there are none");
  PetscCall(PetscNew(&op));
  op->space = s;
  PetscCall(SbLevelsCreate(s, &op->levels));
  op->volume.stride = s->edge_node ? 30 : 12;
  PetscCall(
    PetscMalloc((size_t)(s->nbatch * (op->volume.stride + 2)) * sizeof(SbPack) + 64, &op->memory));
  op->volume.b = (SbPack *)(((uintptr_t)op->memory + 63) & ~(uintptr_t)63);
  op->volume.modulus = op->volume.b + op->volume.stride * s->nbatch;
  op->volume.shear = op->volume.modulus + s->nbatch;
  PetscCall(
    PetscMalloc5(n, &op->C, n, &op->Cinv, n, &op->S, n, &op->weight, s->mesh->ncell, &op->p));
  PetscCall(SbSpaceCreateVec(s, &op->u));
  PetscCall(MatCreateVecs(op->levels->A[0], &op->a, &op->b));
  PetscCall(MatCreateShell(s->comm, 3 * s->nnode_owned, 3 * s->nnode_owned, PETSC_DETERMINE,
                           PETSC_DETERMINE, op, K));
  PetscCall(MatSetBlockSize(*K, 3));
  PetscCall(MatShellSetOperation(*K, MATOP_MULT, SB_OPERATION(MatMult_Pressure)));
  PetscCall(MatShellSetOperation(*K, MATOP_GET_DIAGONAL, SB_OPERATION(MatGetDiagonal_Pressure)));
  PetscCall(MatShellSetOperation(*K, MATOP_DESTROY, SB_OPERATION(MatDestroy_Pressure)));
  PetscCall(MatSetOption(*K, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*K, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(MatSetUp(*K));
  op->assembly = (SbAssembly){op->levels->A[0], assemble, add_spring, finish};
  PetscCall(SbMatrixSetAssembly(*K, &op->assembly));
  PetscFunctionReturn(PETSC_SUCCESS);
}
