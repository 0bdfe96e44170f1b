/*
  The tangent A = shift_a M + shift_v C + shift_k K(u), written directly to the value arrays of the
  matrix.

  K is summed from the cells' blocks (sbelement.h) at the positions of the assembly plan (plan.c); C
  = alpha M + beta K per region; the lumped M is added to the diagonal blocks. Cells are evaluated
  in batches: the kernel is vectorised over the lanes, and the blocks of all lanes are added to the
  matrix (insert.c), which clears each row before its first block.

  petsc/private/petscimpl.h: no public call increases the state of a parallel matrix.

  Prescribed unknowns: their rows and columns are zero except for the diagonal entry, which keeps
  its magnitude, so that the scaling of the matrix is unchanged.
*/
#include "fem_impl.h"
#include "sbkernel.h"
#include <petsc/private/petscimpl.h>

#define ASSEMBLY "SbAssembly"

PetscErrorCode SbMatrixSetAssembly(Mat A, const SbAssembly *assembly)
{
  PetscContainer container;

  PetscFunctionBeginUser;
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)A), &container));
  PetscCall(PetscContainerSetPointer(container, (void *)assembly));
  PetscCall(PetscObjectCompose((PetscObject)A, ASSEMBLY, (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMatrixGetAssembly(Mat A, const SbAssembly **assembly)
{
  PetscObject container;

  PetscFunctionBeginUser;
  *assembly = NULL;
  PetscCall(PetscObjectQuery((PetscObject)A, ASSEMBLY, &container));
  if (container)
    PetscCall(PetscContainerGetPointer((PetscContainer)container, (void **)assembly));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMatGetBlocks(Mat A, PetscBool aij, SbMatBlocks *x)
{
  static const char *const types[5] = {MATSEQAIJ, MATMPIAIJ, MATSEQBAIJ, MATMPIBAIJ, MATSEQSBAIJ};
  static PetscErrorCode (*const get[3])(Mat, PetscScalar **) = {
    MatSeqAIJGetArray, MatSeqBAIJGetArray, MatSeqSBAIJGetArray};
  const SbAssembly *own;
  PetscInt type = 0;

  PetscFunctionBeginUser;
  PetscCall(SbMatrixGetAssembly(A, &own));
  if (own && own->stored)
    A = own->stored;
  for (PetscBool same = PETSC_FALSE; type < 5; type++) {
    PetscCall(PetscObjectTypeCompare((PetscObject)A, types[type], &same));
    if (same)
      break;
  }
  PetscCheck(type < 5 && (aij || type > 1), PetscObjectComm((PetscObject)A), PETSC_ERR_USER_INPUT,
             "%s and SBAIJ matrices, and this one is %s: leave -mat_type alone, and -snes_type to "
             "Newton's method",
             aij ? "Assembly takes AIJ, BAIJ" : "This preconditioner takes BAIJ",
             ((PetscObject)A)->type_name);
  *x = (SbMatBlocks){(SbMatrixKind)(type / 2), (PetscBool)(type == 4), {A, NULL}, {NULL, NULL}};
  if (type == 1)
    PetscCall(MatMPIAIJGetSeqAIJ(A, &x->part[0], &x->part[1], NULL));
  if (type == 3)
    PetscCall(MatMPIBAIJGetSeqBAIJ(A, &x->part[0], &x->part[1], NULL));
  for (int q = 0; q < 2 && x->part[q]; q++)
    PetscCall(get[x->kind](x->part[q], &x->value[q]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMatRestoreRead(Mat A, PetscErrorCode (*restore)(Mat, PetscScalar *[]),
                                PetscScalar *value[])
{
  PetscObjectState state;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectStateGet((PetscObject)A, &state));
  PetscCall((*restore)(A, value));
  PetscCall(PetscObjectStateSet((PetscObject)A, state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMatRestoreBlocks(SbMatBlocks *x)
{
  static PetscErrorCode (*const restore[3])(Mat, PetscScalar **) = {
    MatSeqAIJRestoreArray, MatSeqBAIJRestoreArray, MatSeqSBAIJRestoreArray};

  PetscFunctionBeginUser;
  for (int q = 0; q < 2 && x->part[q]; q++)
    PetscCall(SbMatRestoreRead(x->part[q], restore[x->kind], &x->value[q]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors of one evaluation in a region. */
typedef struct {
  PetscReal stiffness; /* factor on dP/dF */
  PetscReal
    damping; /* factor on Hooke's tensor rotated by R (sbmaterial.h, SbMaterialDampingStress) */
  PetscReal lambda;             /* volumetric modulus of the law, Pa */
  PetscReal damped;             /* that of damping, and their mean by these factors: they differ */
  PetscReal both;               /* for viscoelastic materials only */
  PetscReal mu;                 /* shear modulus of the law, Pa */
  const SbPack *pressure;       /* pressure in addition to the law's own, Pa, tension; NULL: none */
  const SbPack *mean;           /* that of a linearised stress */
  const SbLinearStress *stress; /* NULL: that of the state */
} Factors;

static void scaled_volumes(const SbPack V, PetscReal factor, SbPack W)
{
  for (int l = 0; l < SB_BATCH; l++)
    W[l] = factor * V[l];
}

/* Volumetric part left out of a cell's blocks: D (SbMaterialOps.dilatation_gradient), and the
   factor on its moduli. */
typedef struct {
  SbPack D[9];
  PetscReal factor, lambda; /* Pa */
} Split;

/* C -= lambda D D^T */
SB_KERNEL static void remove_volumetric(PetscReal lambda, const SbPack D[restrict 9],
                                        SbPack C[restrict 81])
{
  for (int i = 0; i < 9; i++) {
    for (int k = 0; k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        C[9 * i + k][l] -= lambda * (D[i][l] * D[k][l]);
  }
}

/* Blocks of a law at F, without mass; `split` NULL: with the volumetric part. */
static void law_blocks(const struct _p_SbMaterial *m, const SbPack *g, const SbPack V,
                       const Factors *x, const SbPack F[9], Split *split, SbPack K[10][9])
{
  const PetscReal both = x->stiffness + x->damping;
  const PetscReal lambda = split ? 0. : x->both;
  SbPack R[9], T[9], W;

  scaled_volumes(V, both, W);
  if (m->linear || m->ops.frame) {
    /* Hooke's tensor rotated by R, with its damping */
    m->ops.frame(m, F, R);
    SbCellBlocksIsotropic(g, W, lambda, x->mu, (const SbPack *)R, K);
  } else if (m->ops.spin && x->stiffness != 0.) {
    /* the same plus a tensor T on the spins (sbelement.h); damping has this form, T = -mu I */
    m->ops.spin(m, F, x->pressure ? *x->pressure : NULL, R, T);
    for (int k = 0; x->damping != 0. && k < 9; k++) {
      const PetscReal rest = k % 4 ? 0. : x->damping * x->mu;

      for (int l = 0; l < SB_BATCH; l++)
        T[k][l] = (x->stiffness * T[k][l] - rest) / both;
    }
    SbCellBlocksCorotated(g, W, lambda, x->mu, (const SbPack *)R, (const SbPack *)T, K);
  } else {
    SbPack C[81], D[10][9];

    /* a full tangent dP/dF, without its volumetric part; damping is added */
    if (x->stress)
      SbLinearStressTangent(m, F, x->stress, x->pressure ? *x->pressure : NULL,
                            x->mean ? *x->mean : NULL, C);
    else
      m->ops.tangent(m, F, C);
    if (split) {
      m->ops.dilatation_gradient(m, F, split->D);
      split->factor = x->stiffness;
      split->lambda = x->lambda;
      remove_volumetric(x->lambda, (const SbPack *)split->D, C);
    }
    if (x->pressure && !x->stress && m->ops.dilatation_hessian)
      m->ops.dilatation_hessian(m, F, *x->pressure, C);
    scaled_volumes(V, x->stiffness, W);
    SbCellBlocksGeneral(g, W, (const SbPack *)C, K);
    if (x->damping == 0.)
      return;
    SbPolar(F, R);
    scaled_volumes(V, x->damping, W);
    SbCellBlocksIsotropic(g, W, x->damped, x->mu, (const SbPack *)R, D);
    for (int k = 0; k < 90; k++)
      for (int l = 0; l < SB_BATCH; l++)
        K[k / 9][k % 9][l] += D[k / 9][k % 9][l];
    return;
  }
  if (!split)
    return;
  memcpy(split->D, R, sizeof(split->D));
  split->factor = both;
  split->lambda = x->both;
}

/* K_ab += factor b_a b_b^T */
SB_KERNEL static void add_dyad(const SbPack factor, const SbPack b[restrict 30],
                               SbPack K[restrict SB_PAIRS][9])
{
  for (int p = 0; p < SB_PAIRS; p++) {
    for (int e = 0; e < 9; e++) {
      const PetscReal *x = b[3 * SbPairA[p] + e / 3];
      const PetscReal *y = b[3 * SbPairB[p] + e % 3];

      for (int l = 0; l < SB_BATCH; l++)
        K[p][e][l] += factor[l] * (x[l] * y[l]);
    }
  }
}

/* Factors of a region with the factors of stiffness and damping: of the law of the step for the
   former. */
static Factors factors_of(const SbRegion *region, PetscReal stiffness, PetscReal damping)
{
  const SbMaterial m = region->material;
  const PetscReal lambda = SbMaterialVolumetricModulus(m);
  Factors x = {.stiffness = stiffness,
               .damping = damping,
               .lambda = lambda,
               .damped = lambda,
               .both = lambda,
               .mu = SbMaterialShearModulus(m)};

  if (!region->history)
    return x;
  x.stiffness *= m->viscous->scale;
  x.lambda = x.both = SbMaterialVolumetricModulus(m->viscous->step);
  if (damping != 0.)
    x.both = (x.stiffness * x.lambda + damping * lambda) / (x.stiffness + damping);
  return x;
}

/* The pressure that does not come from F of a viscoelastic material, over its scale, with that of
   P2's mean or NULL; whether there is any. */
static PetscBool point_pressure(const SbRegion *region, PetscInt b, int q, const PetscReal mean[],
                                SbPack pressure)
{
  const PetscReal scale = -1. / region->material->viscous->scale;

  for (int l = 0; l < SB_BATCH; l++)
    pressure[l] = 0.;
  SbViscousPressure(region, b, q, pressure);
  for (int l = 0; l < SB_BATCH; l++)
    pressure[l] = scale * pressure[l] + (mean ? mean[l] : 0.);
  return (PetscBool)(mean || region->history->pressures);
}

/* Of P2's mean: its pressure p with the history, over the scale; returns the modulus of the
   step. */
static PetscReal mean_history(const SbRegion *region, PetscInt b, const Factors *x, PetscBool one_D,
                              PetscReal lambda, SbPack p)
{
  const PetscReal scale = region->material->viscous->scale;
  const PetscReal damping = one_D ? x->damping : 0.;
  const PetscReal *constant;
  PetscReal factor;

  SbViscousMean(region, b, PETSC_FALSE, &factor, &constant);
  factor /= scale;
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = factor * p[l] + constant[l] / scale;
  return damping == 0. ? factor * lambda
                       : (x->stiffness * factor + damping) * lambda / (x->stiffness + damping);
}

/* What the history of a viscoelastic material, and fibres that contract, add to the blocks of a
   point. */
static void add_to_law(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                       const SbPack *g, const SbPack V, PetscReal stiffness, const SbPack F[9],
                       SbPack K[10][9])
{
  SbPack W;

  scaled_volumes(V, stiffness, W);
  if (region->history)
    SbViscousBlocks(region, law, b, q, g, W, F, K);
  if (region->contraction)
    SbActiveBlocks(region, law, b, q, g, W, F, K);
}

/* Volumetric modulus of a P2 cell that stays in the matrix when the volumetric part is split off.
   With one pressure per cell the inf-sup constant of P2 is small on some meshes; the remaining
   modulus stiffens the modes that the pressures hardly constrain. Iterations of -solver pressure,
   bar at nu 0.4999, 3, 6, 8, 12 cells across: 93, 168, 212, - without; 54, 62, 77, 102 with 10; 92,
   105, 111, 118 with 30. */
#define KEPT 10.      /* times mu, */
#define KEPT_MOST 0.9 /* but at most this fraction of lambda */

/* Whether tangents have linearised stresses: not those that the user wants filtered. */
SB_INLINE PetscBool has_linear_stress(SbSpace s, const SbRegion *region)
{
  return (PetscBool)(s->linear_stress && region->stress && !region->history &&
                     (region->material->adaptive || region->material->tangent == SB_TANGENT_EXACT));
}

/* Blocks of a P2 batch (quadratic.c): the law at the points, with the second derivative of theta
   times the mean pressure; lambda_m/V b b^T, b = V dm/du; and, for theta = J - 1, V lambda_m m d^2
   m/du^2, which a filtered tangent omits. For damping R replaces D in b. With `out`, b is stored
   there and lambda_m/V b b^T is not added. */
static void quadratic_blocks(SbSpace s, const SbRegion *region, const PetscReal displacement[],
                             PetscReal shift_k, const Factors *x, PetscInt batch,
                             const SbVolumetric *out, SbPack K[SB_PAIRS][9])
{
  struct _p_SbMaterial own, whole;
  const struct _p_SbMaterial *m = SbBatchVolumeLaw(region, batch, &whole);
  const SbMaterial law = region->pointwise;
  const SbPoints points = SbBatchPoints(s, batch);
  const SbPack *V = points.V;
  const PetscBool mean = (PetscBool)(law != region->material);
  const PetscBool one_D = (PetscBool)(m->linear || m->ops.frame || m->ops.spin);
  const PetscReal damped_m = mean ? SbMaterialMeanModulus(m) : 0.;
  const PetscBool split = (PetscBool)(out && mean && damped_m > 0.);
  PetscReal lambda_m = damped_m;
  SbPack U[30], F[SB_POINTS][9], B[SB_POINTS][10][9] __attribute__((aligned(64))), W, p, factor,
    b[30] = {{0}};
  SbPack pressure;
  const struct _p_SbMaterial *local = SbBatchLaw(region, law, batch, &own);
  Factors at = *x;

  SbBatchGradients(s, batch, m->linear ? NULL : displacement, PETSC_FALSE, U, F);
  if (mean) {
    SbQuadraticVolume(m, &points, (const SbPack *)U, (const SbPack(*)[9])F, p, b);
    if (region->history)
      lambda_m = mean_history(region, batch, x, one_D, damped_m, p);
    else if (s->linear_stress)
      memcpy(p, s->pressure[batch], sizeof(p));
    at.lambda = at.damped = at.both = SbMaterialVolumetricModulus(law);
    at.pressure =
      m->jacobian ? NULL : &p; /* the second derivative of the exact mean is added below */
    at.mean = m->jacobian && law->tangent == SB_TANGENT_EXACT_SPD ? NULL : &p;
  }

  const PetscReal *of_mean = at.pressure ? p : NULL;

  for (int q = 0; q < points.n; q++) {
    if (has_linear_stress(s, region))
      at.stress = &region->stress[points.n * (batch - region->bstart) + q];
    SbPointVolume(&points, q, W);
    SbPointLaw(region, batch, q, &own);
    if (region->history && point_pressure(region, batch, q, of_mean, pressure))
      at.pressure = (const SbPack *)&pressure;
    law_blocks(local, points.g + points.step * q, W, &at, (const SbPack *)F[q], NULL, B[q]);
    if (region->history || region->contraction)
      add_to_law(region, local, batch, q, points.g + points.step * q, W, shift_k,
                 (const SbPack *)F[q], B[q]);
  }
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal both = x->stiffness + (one_D ? x->damping : 0.);
    const PetscReal kept = split ? PetscMin(KEPT_MOST * lambda_m, KEPT * x->mu) : lambda_m;

    factor[l] = (*V)[l] > 0. ? kept * both / (*V)[l] : 0.;
    if (out)
      out->modulus[batch][l] = split ? both * (lambda_m - kept) : 0.;
    if (out)
      out->shear[batch][l] = split ? both * (x->mu + 0.75 * kept) : 0.;
  }
  if (out)
    memset(out->b + out->stride * batch, 0, sizeof(b));
  if (split)
    memcpy(out->b + out->stride * batch, b, sizeof(b));
  SbQuadraticBlocks(points.rule, (const SbPack(*)[10][9])B, factor, (const SbPack *)b, K);
  if (!mean)
    return;
  if (m->jacobian && law->tangent != SB_TANGENT_EXACT_SPD) {
    const SbPointRule *rule = SbVolumeRule(&points);

    for (int q = 0; q < rule->n; q++) {
      const SbPack *g = points.g + points.step * q;
      SbPack u[12], here[9];

      SbQuadraticAt(rule->L[q], (const SbPack *)U, u);
      SbCellGradient(g, (const SbPack *)u, 1., here);
      for (int l = 0; l < SB_BATCH; l++)
        factor[l] =
          x->stiffness * (points.step ? points.weight[q][l] : rule->weight[q]) * (*V)[l] * p[l];
      SbQuadraticAddJacobian(rule->L[q], g, (const SbPack *)here, factor, K);
    }
  }
  if (one_D || x->damping == 0.)
    return;
  memset(b, 0, sizeof(b));
  for (int q = 0; q < points.n; q++) {
    SbPack R[9];

    SbPolar((const SbPack *)F[q], R);
    SbPointForce(&points, q, (const SbPack *)R, b);
  }
  for (int l = 0; l < SB_BATCH; l++)
    factor[l] = (*V)[l] > 0. ? damped_m * x->damping / (*V)[l] : 0.;
  add_dyad(factor, (const SbPack *)b, K);
}

/* A matrix to assemble. */
typedef struct {
  SbSpace space;
  SbMatBlocks x;
  const SbStage
    *faces; /* its rows start from the face terms with the factors of this stage, or NULL, */
  const PetscReal *beta; /* and with the damping [nbody], s */
} Fill;

/* Adds the blocks of a batch, ten or SB_PAIRS per cell, and its consistent mass; K is work
   space. */
static void fill_batch(const Fill *fill, PetscInt r, PetscInt b, PetscReal inertia, SbPack K[][9])
{
  const SbSpace s = fill->space;
  const SbRegion *region = &s->region[r];
  const int npair = region->quadratic ? SB_PAIRS : 10;

  SbInsertClear(s, &fill->x, b, fill->faces, fill->beta);
  if (region->broken) {
    SbInsertBatch(s, &fill->x, b, npair, PETSC_TRUE, (const SbPack(*)[9])K);
    if (inertia == 0.)
      return;
    memset(K, 0, 90 * sizeof(SbPack));
  }
  if (inertia != 0.) {
    SbPack mass[SB_PAIRS];

    SbBatchMass(s, b, mass);
    for (int k = 0; k < 3 * npair; k++)
      for (int l = 0; l < SB_BATCH; l++)
        K[k / 3][4 * (k % 3)][l] += inertia * mass[k / 3][l];
  }
  SbInsertBatch(s, &fill->x, b, npair, PETSC_FALSE, (const SbPack(*)[9])K);
}

/* Assembles region r into several matrices; fill[0] is that of the space itself. */
static void fill_region(SbSpace s, PetscInt r, const SbStage *stage, PetscInt nfill,
                        const Fill fill[], const SbVolumetric *out)
{
  const SbRegion *region = &s->region[r];
  const SbMaterial m = region->material;
  const PetscReal shift = stage->shift_a + stage->shift_v * s->alpha[region->body];
  const PetscReal inertia = s->consistent_mass ? m->density * shift : 0.;
  const Factors factors =
    factors_of(region, stage->shift_k, stage->shift_v * s->beta[region->body]);
  const PetscBool faces = SbElementHasFaces(region->element);
  Split kept;
  Split *split = out && faces && factors.lambda > 0. ? &kept : NULL;

  for (PetscInt b = region->bstart; b < region->bend; b++) {
    SbPack K[SB_PAIRS][9] __attribute__((aligned(64))), copy[10][9] __attribute__((aligned(64))),
      U[30], F[SB_POINTS][9];

    if (region->quadratic)
      quadratic_blocks(s, region, stage->u, stage->shift_k, &factors, b, out, K);
    else {
      Factors at = factors;
      struct _p_SbMaterial own;
      const struct _p_SbMaterial *law = SbBatchLaw(region, m, b, &own);
      SbPack pressure;

      if (!m->linear)
        SbBatchGradients(s, b, stage->u, PETSC_FALSE, U, F);
      if (has_linear_stress(s, region))
        at.stress = &region->stress[b - region->bstart];
      if (region->history && point_pressure(region, b, 0, NULL, pressure))
        at.pressure = (const SbPack *)&pressure;
      law_blocks(law, s->batch_g + 9 * b, s->batch_V[b], &at, (const SbPack *)F[0], split, K);
      if (region->history || region->contraction)
        add_to_law(region, law, b, 0, s->batch_g + 9 * b, s->batch_V[b], stage->shift_k,
                   (const SbPack *)F[0], K);

      /* b_a = V D grad psi_a, as the force of a stress D */
      for (int l = 0; out && l < SB_BATCH; l++) {
        out->modulus[b][l] = split ? split->factor * split->lambda : 0.;
        out->shear[b][l] = split ? split->factor * factors.mu : 0.;
      }
      if (out)
        memset(out->b + out->stride * b, 0, 12 * sizeof(SbPack));
      if (split)
        SbCellForce(s->batch_g + 9 * b, s->batch_V[b], (const SbPack *)split->D,
                    out->b + out->stride * b);
    }

    /* the same cells in another space: the gradients of P1 are -1/3 times those of CR */
    for (PetscInt n = nfill - 1; n > 0 && !region->quadratic; n--) {
      const PetscReal scale =
        faces && fill[n].space->region[r].element->nodes_per[0] ? 1. / 9. : 1.;

      for (int k = 0; k < 90; k++)
        for (int l = 0; l < SB_BATCH; l++)
          copy[k / 9][k % 9][l] = scale * K[k / 9][k % 9][l];
      fill_batch(&fill[n], r, b, inertia, copy);
    }
    fill_batch(&fill[0], r, b, inertia, K);
  }
}

PetscErrorCode SbSpaceAssembleSplit(SbSpace s, const SbStage *stage, PetscInt n,
                                    const SbSpace space[], const Mat A[], const SbVolumetric *out)
{
  const PetscBool lumped =
    (PetscBool)(!s->consistent_mass && (stage->shift_a != 0. || stage->shift_v != 0.));
  Fill fill[3];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n; k++) {
    fill[k] = (Fill){.space = space[k], .faces = space[k]->jump ? stage : NULL, .beta = s->beta};
    PetscCall(SbMatGetBlocks(A[k], PETSC_TRUE, &fill[k].x));
  }
  for (PetscInt r = 0; r < s->nregion; r++) {
    PetscCall(PetscLogEventBegin(s->region[r].material->event, 0, 0, 0, 0));
    fill_region(s, r, stage, n, fill, out);
    PetscCall(PetscLogEventEnd(s->region[r].material->event, 0, 0, 0, 0));
  }
  for (PetscInt k = 0; k < n; k++) {
    const SbSpace to = space[k];

    /* the lumped mass matrix, and its damping */
    for (PetscInt i = 0; lumped && i < to->nnode_owned; i++) {
      size_t rs, cs;
      PetscScalar *v = sb_block(&fill[k].x, to->plan, i, to->plan->diagonal[i], &rs, &cs);

      for (size_t c = 0; c < 3; c++)
        v[c * (rs + cs)] +=
          (stage->shift_a + stage->shift_v * s->alpha[to->node_body[i]]) * to->node_mass[i];
    }
    PetscCall(SbMatRestoreBlocks(&fill[k].x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAssembleTangent(SbSpace s, const SbStage *stage, Mat A)
{
  const SbAssembly *own;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_TANGENT], A, 0, 0, 0));
  PetscCall(SbMatrixGetAssembly(A, &own));
  if (own)
    PetscCall((own->assemble)(A, stage));
  else
    PetscCall(SbSpaceAssembleSplit(s, stage, 1, &s, &A, NULL));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_TANGENT], A, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddCellBlock(SbSpace s, Mat A, PetscInt cell, PetscInt a, PetscInt b,
                                   const PetscReal block[9])
{
  const PetscInt node[2] = {SbSpaceCellNode(s, cell, a), SbSpaceCellNode(s, cell, b)};
  const PetscInt w = s->width;
  PetscInt batch;
  SbMatBlocks x;

  PetscFunctionBeginUser;
  if (node[0] >= s->nnode_owned)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFindInt(cell, s->nbatch, s->batch_cell, &batch));
  if (batch < 0)
    batch = -batch - 2; /* not the first cell of its batch */
  PetscCall(SbMatGetBlocks(A, PETSC_TRUE, &x));
  sb_insert_block(
    s, &x, node[0], node[1],
    s->plan->offset[(size_t)(batch * w * w + w * a + b) * SB_BATCH + cell - s->batch_cell[batch]],
    s->block_scale, PETSC_FALSE, block);
  PetscCall(SbMatRestoreBlocks(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddSpring(SbSpace s, Mat A, PetscInt cell, PetscInt a,
                                const PetscReal block[9])
{
  const SbAssembly *own;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceAddCellBlock(s, A, cell, a, a, block));
  PetscCall(SbMatrixGetAssembly(A, &own));
  if (own && own->add_spring)
    PetscCall((own->add_spring)(A, SbSpaceCellNode(s, cell, a), s->block_scale, block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceFinishTangent(SbSpace s, Mat A)
{
  const SbPlan p = s->plan;
  const SbAssembly *own;
  SbMatBlocks x;

  PetscFunctionBeginUser;
  PetscCall(SbMatrixGetAssembly(A, &own));
  if (own) {
    if (own->finish)
      PetscCall((own->finish)(A));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbMatGetBlocks(A, PETSC_TRUE, &x));

  /* clear rows and columns of prescribed unknowns, keeping the magnitude on the diagonal */
  for (PetscInt n = 0; n < p->nfix; n++) {
    const int rows = p->fix_mask[n] & 7;
    const int columns = (p->fix_mask[n] >> 3) & 7;
    const int diagonal = p->fix_mask[n] & 64;
    size_t rs, cs;
    PetscScalar *v;

    if (x.symmetric && p->fix_block[n] < p->diagonal[p->fix_row[n]])
      continue;
    v = sb_block(&x, p, p->fix_row[n], p->fix_block[n], &rs, &cs);
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) {
        PetscScalar *e = v + (size_t)i * rs + (size_t)j * cs;

        if (!(rows & (1 << i)) && !(columns & (1 << j)))
          continue;
        if (diagonal && i == j)
          *e = *e == 0. ? 1. : PetscAbsScalar(*e);
        else
          *e = 0.;
      }
    }
  }
  if (s->constraints)
    SbConstraintsFinishTangent(s, &x);
  PetscCall(SbMatRestoreBlocks(&x));

  /* assembly of the parts invalidates their cached diagonals; of the parallel one the state is
     enough */
  for (int q = 0; q < 2 && x.part[q]; q++) {
    PetscCall(MatAssemblyBegin(x.part[q], MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(x.part[q], MAT_FINAL_ASSEMBLY));
  }
  if (x.part[0] != A)
    PetscCall(PetscObjectStateIncrease((PetscObject)A));
  PetscFunctionReturn(PETSC_SUCCESS);
}
