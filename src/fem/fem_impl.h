/*
  fem_impl.h - what the files of src/fem share: the assembly plan and the gather of a batch.
*/
#pragma once
#include "sbassembly.h"

/* layout.c: nodes of the space; then, with batches in place, the nodes that each cell's stress acts on. Collective. */
PetscErrorCode SbLayoutNodes(SbSpace space);
PetscErrorCode SbLayoutCliques(SbSpace space);
PetscErrorCode SbLayoutDestroy(SbSpace space);

/* jump.c: face terms of CR and DG, as stiffness or times the body's beta. Not collective. */
typedef enum { SB_JUMP_STIFFNESS, SB_JUMP_DAMPING } SbJumpFactor;
PetscErrorCode SbJumpCreate(SbSpace space, SbJump *jump);
PetscErrorCode SbJumpDestroy(SbJump *jump);
/* f[nnode][3] += (factor) K_F x; right on owned nodes. x[nnode][3] with ghosts. */
void SbJumpAdd(SbSpace space, const PetscReal x[], SbJumpFactor factor, PetscReal f[]);
/* 1/2 x . (factor) K_F x, this rank's part. */
PetscReal SbJumpEnergy(SbSpace space, const PetscReal x[], SbJumpFactor factor, PetscReal body[]);
/* node[nbatch][8][SB_BATCH] of the faces, borrowed; returns nbatch. */
PetscInt SbJumpCliques(SbSpace space, const PetscInt **node);
/* The matrix of the face in lane l of batch b, times the 3x3 identity; zero in padding. */
void SbJumpMatrix(SbSpace space, PetscInt b, PetscInt l, PetscReal K[8][8]);

/* plan.c. Where a cell begins in SbPlan.offset: block (a, b) follows at SB_BATCH (width a + b). */
size_t SbPlanCellOffset(SbSpace space, PetscInt cell);
PetscErrorCode SbPlanDestroy(SbPlan *plan);

/* The value arrays of a matrix and how blocks lie in them. */
typedef struct {
  SbMatrixKind kind;
  Mat part[2]; /* diagonal and off-diagonal part; the second is NULL on one rank */
  PetscScalar *value[2];
  const PetscReal *
    face_term; /* [nbody] factor on the face terms that the rows of a body begin with; NULL: they begin with zero */
} SbValues;

/* tangent.c: the values of a matrix of the space; what was changed shows after SbSpaceFinishTangent(). Not collective. */
PetscErrorCode SbValuesBegin(Mat A, SbValues *x);
PetscErrorCode SbValuesEnd(SbValues *x);

/* Where block k (as in SbPlan.offset) of row i begins in its value array, and the distance between its rows and columns. */
static inline PetscScalar *sb_block(const SbValues *x, SbPlan p, PetscInt row, PetscInt k, size_t *row_stride,
                                    size_t *column_stride)
{
  const int q = k < 0;
  const PetscInt *ptr = q ? p->oi : p->di;

  if (q) k = ~k;
  if (x->kind == SB_MATRIX_AIJ) {
    *row_stride = 3 * (size_t)(ptr[row + 1] - ptr[row]);
    *column_stride = 1;
    return x->value[q] + 9 * (size_t)ptr[row] + 3 * (size_t)(k - ptr[row]);
  }
  *row_stride = 1;
  *column_stride = 3;
  if (x->kind == SB_MATRIX_SBAIJ) k = p->ui[row] + k - p->diagonal[row];
  return x->value[q] + 9 * (size_t)k;
}

/* Clears the rows that batch b reaches first, or fills them with the face terms; call it for every batch in turn, each before SbInsertBatch(). */
void SbInsertClear(SbSpace space, const SbValues *x, PetscInt b);
/*
  quadratic.c: P2 cells. Not collective. The nodes of a batch [10][SB_BATCH].
*/
static inline const PetscInt *sb_quadratic_nodes(SbSpace s, PetscInt b)
{
  return s->batch_clique + (size_t)(b * s->width) * SB_BATCH;
}
/* F (rate: without the identity) at the points of SbRuleQuadratic. */
void SbQuadraticGradients(const SbPack g[9], const SbPack U[30], PetscBool rate, SbPack F[4][9]);
/*
  The volumetric part of the energy, V lambda/2 (mean of theta)^2: pressure = lambda times the mean (Pa, tension), b[30] = V d mean/du (m^2; NULL: not
  wanted). F at the points of SbRuleQuadratic.
*/
void SbQuadraticVolume(const struct _p_SbMaterial *m, const SbPack g[9], const SbPack V, const SbPack U[30],
                       const SbPack F[4][9], SbPack pressure, SbPack b[30]);
/* What a law says at the points of a cell: one, for P2 four. Returns their number. P (Pa), psi (J/m^3), pressure (Pa, compression) may be NULL. */
PetscInt SbBatchState(SbSpace space, const SbRegion *region, PetscInt b, const PetscReal x[], SbPack F[4][9],
                      SbPack P[4][9], SbPack psi[4], SbPack pressure[4]);

/* Adds the ten blocks of each cell of batch b; K is 32-byte aligned. */
void SbInsertBatch(SbSpace space, const SbValues *x, PetscInt b, const SbPack K[10][9]);
/* The 55 blocks of P2 cells. */
void SbInsertQuadratic(SbSpace space, const SbValues *x, PetscInt b, const SbPack K[SB_PAIRS][9]);
/* The same for DG cells, whose blocks stand between the means of their faces. */
void SbInsertBroken(SbSpace space, const SbValues *x, PetscInt b, const SbPack K[10][9]);

/* constraint.c: projects an assembled matrix, or makes it regular. Not collective. */
void SbConstraintsFinishTangent(SbSpace space, const SbValues *x);
PetscErrorCode SbConstraintsDestroy(SbConstraints *constraints);

/* Gives a BAIJ or SBAIJ matrix of the space the fast product of product.c. Collective. */
PetscErrorCode SbProductAttach(SbSpace space, SbMatrixKind kind, Mat A);

/* The part of it that a matrix-free operator does. */
PetscErrorCode SbMatrixFreeAddRows(Mat A, PetscInt n, const PetscInt node[], const PetscInt ia[],
                                   PetscReal block[]);
