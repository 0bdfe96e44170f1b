/*
  sbassembly.h - layer 3: for linear solvers: the assembly plan, gathers of batches, rows of
  operators.
*/
#pragma once
#include "sbfem.h"

/*
  The plan: sparsity graph of the owned node rows, split as PETSc splits it (diagonal part: owned
  columns; off-diagonal part: ghost columns), and for each local cell the position of its width^2
  node blocks in it. A block index k of row i is the same for BAIJ (values 9 k ..) and for AIJ with
  full 3x3 blocks: sb_block().
*/
typedef struct _p_SbPlan {
  PetscInt *di, *dj;  /* diagonal part: rows [nnode_owned+1], local columns ascending */
  PetscInt *oi, *oj;  /* off-diagonal part: local ghost nodes, ascending by global number */
  PetscInt *diagonal; /* [nnode_owned] block index of (i, i) */
  /* [nbatch][width^2][SB_BATCH] block (a, b) at width a + b: k in the diagonal part, ~k in the
     off-diagonal part, SB_NOT_OWNED when row a is another rank's; padding lanes have those of the
     first */
  PetscInt *offset;
  PetscInt *coupling_start; /* [couplings.n] into coupling; NULL without couplings */
  PetscInt *coupling;       /* [n^2] of a group of n nodes: block (a, b) at n a + b, as in offset */
  PetscInt *ui;   /* [nnode_owned+1] first upper block of each row, for SBAIJ; NULL otherwise */
  PetscInt npair; /* of blocks of a cell in upper: 10, or SB_PAIRS with a P2 body */
  PetscInt *
    upper; /* [nbatch][npair][SB_BATCH] block of pair p in the upper triangle, ~k: to be transposed */
  PetscInt *fresh_start; /* [nbatch+1] into fresh */
  PetscInt *fresh;       /* [nnode_owned] rows in the order in which the batches reach them first */
  PetscReal *face_term[2]; /* factor of the identity in each block of both parts, N/m; or NULL */
  PetscInt nfix;           /* blocks that a prescribed unknown touches */
  PetscInt *fix_block;     /* [nfix] block index as in offset */
  PetscInt *fix_row;       /* [nfix] local row node */
  uint8_t
    *fix_mask; /* [nfix] bits 0..2: rows, 3..5: columns of the block to clear; 6: diagonal block */
} * SbPlan;
#define SB_NOT_OWNED PETSC_MIN_INT

PetscErrorCode SbPlanCreate(SbSpace space, SbPlan *plan);

/*
  The volumetric part of a tangent, kept out of the matrix: sum over cells of modulus / V b b^T, b_a
  = V D grad psi_a with D from SbMaterialOps.dilatation_gradient; of P2 V times the derivative of
  the mean of theta. Cells of P1 bodies and of laws with lambda <= 0 are kept whole: b and both
  moduli are zero.
*/
typedef struct {
  PetscInt stride; /* lanes of a batch in b: 12, or 30 with a P2 body */
  SbPack *b;       /* [nbatch][stride] m^2; 0 in padding */
  SbPack *modulus; /* [nbatch] lambda times the factor of stiffness and damping, Pa */
  SbPack *shear;   /* [nbatch] mu likewise, Pa */
} SbVolumetric;
/* The tangent without its volumetric part, in up to three spaces, space[0] = s, whose strains they
   are. Where space[k] has its nodes at vertices and s at faces, A[k] is the same form there. out
   NULL: nothing is left out. Not collective. */
PetscErrorCode SbSpaceAssembleSplit(SbSpace s, const SbStage *stage, PetscInt n,
                                    const SbSpace space[], const Mat A[], const SbVolumetric *out);

/* Assembly of an operator other than one block matrix. */
typedef struct {
  Mat stored; /* target of SbSpaceAddCellBlock(); borrowed; NULL: none */
  PetscErrorCode (*assemble)(
    Mat A, const SbStage *stage); /* for SbSpaceAssembleTangent(). Not collective */
  /* for SbSpaceAddSpring(): factor times a block, N/m, of a node; `stored` has it already; or
     NULL */
  PetscErrorCode (*add_spring)(Mat A, PetscInt node, PetscReal factor, const PetscReal block[9]);
  PetscErrorCode (*finish)(
    Mat A); /* for SbSpaceFinishTangent(); NULL: nothing is to be done. Collective */
} SbAssembly;
/* Makes the functions of sbfem.h assemble A so. The table is borrowed and lives as long as A.
   Collective. */
PetscErrorCode SbMatrixSetAssembly(Mat A, const SbAssembly *assembly);

/* u[3 a + i][lane] of n nodes of a batch from a local array [nnode][3]. */
SB_INLINE void sb_gather_nodes(int n, const PetscInt node[], const PetscReal x[], SbPack u[])
{
  for (int a = 0; a < n; a++) {
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal *p = x + 3 * node[a * SB_BATCH + l];

      u[3 * a][l] = p[0];
      u[3 * a + 1][l] = p[1];
      u[3 * a + 2][l] = p[2];
    }
  }
}

/* The nodes of a batch, those of P2 at edges behind those at vertices: [region.nnode][SB_BATCH]. */
static inline const PetscInt *sb_batch_nodes(SbSpace s, PetscInt b)
{
  return s->batch_clique + (size_t)(b * s->width) * SB_BATCH;
}

/* Longest side of a box: length scale of rotations. */
SB_INLINE PetscReal SbRigidSize(const PetscReal box[6])
{
  return PetscMax(box[3] - box[0], PetscMax(box[4] - box[1], box[5] - box[2]));
}
/* Value of rigid-body mode 0 to 5 (translations, rotations about its middle) at x, over its
   size. */
void SbRigidMode(PetscInt mode, const PetscReal x[3], const PetscReal box[6], PetscReal value[3]);
/* The near null space of A: the six rigid-body modes, which algebraic multigrid must reproduce,
   made orthonormal. Six serve any number of bodies: no aggregate spans two, and each body turns
   about its own centre. fill(mode, v, ctx) writes this rank's part of a mode; one that vanishes is
   left out. Collective. */
PetscErrorCode
SbAttachModes(Mat A, PetscErrorCode (*fill)(PetscInt mode, PetscScalar v[], const void *ctx),
              const void *ctx);

/*
  Nodal values that strains are computed from, u[3 nnode]: of the cells' nodes; for DG the means m =
  p + w (u - p) of the own node u and the one across the face p.
*/
static inline void sb_gather_strain(SbSpace s, PetscInt b, const PetscReal x[], SbPack u[30])
{
  const SbRegion *region = s->batch_region[b];

  /* loops of constant length */
  if (region->nnode == 4)
    sb_gather_nodes(4, sb_batch_nodes(s, b), x, u);
  else
    sb_gather_nodes(10, sb_batch_nodes(s, b), x, u);
  if (region->broken) {
    SbPack p[12];

    sb_gather_nodes(4, sb_batch_nodes(s, b) + 4 * SB_BATCH, x, p);
    for (int k = 0; k < 12; k++)
      for (int l = 0; l < SB_BATCH; l++)
        u[k][l] = p[k][l] + s->batch_weight[4 * b + k / 3][l] * (u[k][l] - p[k][l]);
  }
}

/* f[nnode][3] += the first n lanes of a batch's vectors at nnode nodes. */
SB_INLINE void sb_scatter_nodes(int nnode, const PetscInt node[], PetscInt n, const SbPack fe[],
                                PetscReal f[])
{
  for (int a = 0; a < nnode; a++) {
    for (PetscInt l = 0; l < n; l++) {
      PetscReal *p = f + 3 * node[a * SB_BATCH + l];

      p[0] += fe[3 * a][l];
      p[1] += fe[3 * a + 1][l];
      p[2] += fe[3 * a + 2][l];
    }
  }
}

/* The transpose of sb_gather_strain(): forces on the means go to the two nodes by their weights. */
static inline void sb_scatter_strain(SbSpace s, PetscInt b, SbPack fe[30], PetscReal f[])
{
  const SbRegion *region = s->batch_region[b];

  if (region->broken) {
    SbPack p[12];

    for (int k = 0; k < 12; k++) {
      for (int l = 0; l < SB_BATCH; l++) {
        const PetscReal own = s->batch_weight[4 * b + k / 3][l] * fe[k][l];

        p[k][l] = fe[k][l] - own;
        fe[k][l] = own;
      }
    }
    sb_scatter_nodes(4, sb_batch_nodes(s, b) + 4 * SB_BATCH, s->batch_n[b], (const SbPack *)p, f);
  }
  if (region->nnode == 4)
    sb_scatter_nodes(4, sb_batch_nodes(s, b), s->batch_n[b], (const SbPack *)fe, f);
  else
    sb_scatter_nodes(10, sb_batch_nodes(s, b), s->batch_n[b], (const SbPack *)fe, f);
}

/* Rotations that are stored for a cell: P2 has one at each point of SbRuleQuadratic, others use the
   first. */
static inline PetscInt sb_rotation_points(SbSpace s)
{
  return s->edge_node ? 4 : 1;
}
/* R[nbatch][sb_rotation_points()][9]: the frames of laws, or polar rotations of F, at u[nnode][3]
   with ghosts, m; NULL: at rest. Not collective. */
void SbSpaceCellRotations(SbSpace space, const PetscReal u[], SbPack R[]);
/* The material's rotation around each owned node, node_R[nnode_owned][9], row-major: the proper one
   closest to the volume-weighted mean of those of the cells around it. spread[nnode_owned] (may be
   NULL): the largest |R_cell - R|_F^2 among these cells, 8 sin^2(angle / 2). Not collective. */
PetscErrorCode SbSpaceAverageRotations(SbSpace space, const SbPack R[], PetscReal node_R[],
                                       PetscReal spread[]);

/* Lends the rotations of cells that a matrix-free operator holds; NULL for another matrix. */
PetscErrorCode SbMatrixFreeGetRotations(Mat A, const SbPack **R);

/* Rows of A, a matrix-free operator, AIJ, BAIJ or SBAIJ of the space, for the owned local nodes
   node[n], NULL: 0 to n - 1. Output: ia[n+1], ja: local nodes, owned ones first, both ascending;
   block[ia[n]][9], row-major, N/m. ja and block may be NULL to learn ia. Caller owns the arrays.
   Not collective. */
PetscErrorCode SbSpaceGetRows(SbSpace space, Mat A, PetscInt n, const PetscInt node[],
                              PetscInt ia[], PetscInt ja[], PetscReal block[]);

/* ia[nnode_owned+1], ja: graph of the space by global nodes, of one PetscMalloc2() that the caller
   frees. Not collective. */
PetscErrorCode SbSpaceGetGraph(SbSpace space, PetscInt **ia, PetscInt **ja);

/* Gives a symmetric SBAIJ (one rank) or BAIJ matrix of final pattern the product of product.c.
   Collective. */
PetscErrorCode SbProductAttach(Mat A);
/* Lends the rows of a sequential BAIJ or SBAIJ matrix: start[n+1], column[start[n]]. Not
   collective. */
PetscErrorCode SbMatGetPattern(Mat A, PetscInt *n, const PetscInt *start[],
                               const PetscInt *column[]);
/* The rows and columns of this rank of A, BAIJ or SBAIJ with the fast product, as SBAIJ: borrowed
   from A, up to date until values of A change; A itself when that is SBAIJ on one rank. Ask again
   after each assembly. Not collective. */
PetscErrorCode SbProductGetSymmetric(Mat A, Mat *local);
/* y -= the columns of other ranks of A times x. Collective. */
PetscErrorCode SbProductSubtractOffDiagonal(Mat A, Vec x, Vec y);
/* Gives back values only read, by the matrix's own function, say MatSeqSBAIJRestoreArray. Since
   3.25 PETSc takes these functions for a change of the matrix, after which fast products and
   preconditioners are set up again, in each iteration if one reads the values in its set-up. Not
   collective. */
PetscErrorCode SbMatRestoreRead(Mat A, PetscErrorCode (*restore)(Mat, PetscScalar *[]),
                                PetscScalar *value[]);
/* The values of a matrix: diagonal part, and the one with ghost columns; of SBAIJ the upper
   triangle. */
typedef struct {
  SbMatrixKind kind;
  PetscBool symmetric; /* SBAIJ */
  Mat part[2];         /* the second one NULL on one rank */
  PetscScalar *value[2];
} SbMatBlocks;
/* Lends the values of a block matrix, BAIJ or SBAIJ or, if `aij`, AIJ; its state stays. Not
   collective. Error: PETSC_ERR_SUP for another kind. */
PetscErrorCode SbMatGetBlocks(Mat A, PetscBool aij, SbMatBlocks *blocks);
PetscErrorCode SbMatRestoreBlocks(SbMatBlocks *blocks);
