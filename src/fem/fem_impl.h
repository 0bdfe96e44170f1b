/*
  fem_impl.h - functions shared by the files of src/fem: layout, face terms, assembly, points of a batch.
*/
#pragma once
#include "sbassembly.h"

/* layout.c: creates the nodes of the space. After the batches: the nodes that each cell's stress acts on. Collective. */
PetscErrorCode SbLayoutNodes(SbSpace space);
PetscErrorCode SbLayoutCliques(SbSpace space);
PetscErrorCode SbLayoutDestroy(SbSpace space);

/* jump.c: face terms of CR and DG, as stiffness or times the body's beta. Not collective. */
typedef enum { SB_JUMP_STIFFNESS, SB_JUMP_DAMPING } SbJumpFactor;
PetscErrorCode SbJumpCreate(SbSpace space, SbJump *jump);
PetscErrorCode SbJumpDestroy(SbJump *jump);
/* f[nnode][3] += (factor) K_F x; the jumps of displacements x are reduced by the offsets r; complete on owned nodes. x[nnode][3] with ghosts. */
void SbJumpAdd(SbSpace space, const PetscReal x[], SbJumpFactor factor, PetscReal f[]);
/* The energy 1/2 x . (factor) K_F x of the face terms, this rank's part, J. */
PetscReal SbJumpEnergy(SbSpace space, const PetscReal x[], SbJumpFactor factor, PetscReal body[]);
/* node[nbatch][8][SB_BATCH] of the faces, borrowed; returns nbatch. */
PetscInt SbJumpCliques(SbSpace space, const PetscInt **node);
/* Updates the moduli m of the penalty from x. Returns whether one changed on this rank, or faces have offsets r, which rotate. */
PetscBool SbJumpFollow(SbSpace space, const PetscReal x[], SbStepsOf steps);
/* Whether this is the first call, without SbJumpSetStiffness() before. */
PetscBool SbJumpBegin(SbSpace space);
/* Updates the penalties. With x the faces' energies are kept or, first, their forces; NULL: r = 0. changed: set if one changed on this rank by a percent or more. */
PetscErrorCode SbJumpRenew(SbSpace space, const PetscReal x[], PetscBool first, PetscBool *changed);
/* SbSpaceGetJumps() for local x; SbJumpSetStiffness() restores k[5 ncell], with ghosts, before SbJumpRenew(). */
void SbJumpStiffness(SbSpace space, const PetscReal x[], PetscReal k[]);
void SbJumpSetStiffness(SbSpace space, const PetscReal k[]);
/* The matrix of the face in lane l of batch b, to be multiplied by the 3x3 identity; zero in padding. */
void SbJumpMatrix(SbSpace space, PetscInt b, PetscInt l, PetscReal K[8][8]);

/* plan.c. Position of a cell in SbPlan.offset; block (a, b) follows at SB_BATCH (width a + b). */
size_t SbPlanCellOffset(SbSpace space, PetscInt cell);
PetscErrorCode SbPlanDestroy(SbPlan *plan);

/* The value arrays of a matrix, and their block layout. */
typedef struct {
  SbMatrixKind kind;
  Mat part[2]; /* diagonal and off-diagonal part; the second is NULL on one rank */
  PetscScalar *value[2];
  const PetscReal *face_term; /* [nbody] factor on the face terms from which its rows start, or NULL */
} SbValues;

/* tangent.c: borrows the value arrays of a matrix; its state increases in SbSpaceFinishTangent(). Not collective. */
PetscErrorCode SbValuesBegin(Mat A, SbValues *x);
PetscErrorCode SbValuesEnd(SbValues *x);

/* Address of block k (as in SbPlan.offset) of a row, and the distances between its rows and columns. */
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

/* Clears the rows that batch b adds to first, or sets them to the face terms; for every batch in order, before its SbInsertBatch(). */
void SbInsertClear(SbSpace space, const SbValues *x, PetscInt b);
/* quadratic.c: points of a batch. P1, CR and DG have one; P2 cells four, curved ones those of SbRuleQuintic. Not collective. */
typedef struct {
  int n, step;             /* number of points; gradients of point q: g + step q */
  const SbPointRule *rule; /* rule of P2 */
  const SbPack *g, *V;     /* gradients; V[0]: volume of the cell */
  const SbPack *weight;    /* [n] fractions of the volume */
} SbPoints;
SbPoints SbBatchPoints(SbSpace space, const SbRegion *region, PetscInt b);
/* W = the volume of a point. */
SB_INLINE void SbPointVolume(const SbPoints *at, int q, SbPack W)
{
  for (int l = 0; l < SB_BATCH; l++) W[l] = at->weight[q][l] * (*at->V)[l];
}
/* Gathers U[3 nnode] as sb_gather_strain() for x (NULL: zero), and F at the points (rate: without the identity). */
void SbBatchGradients(SbSpace space, const SbRegion *region, PetscInt b, const PetscReal x[], PetscBool rate,
                      SbPack U[30], SbPack F[SB_POINTS][9]);
/* Forces of a stress P at point q on the values of sb_gather_strain(): added for P2, set for others, which have one point. */
void SbPointForce(const SbPoints *at, int q, const SbPack P[9], SbPack f[30]);
/*
  The volumetric part of the energy, V lambda/2 (mean of theta)^2: pressure = lambda times the mean (Pa, tension), b[30] = V d mean/du (m^2; NULL: not
  wanted). F: at the points.
*/
void SbQuadraticVolume(const struct _p_SbMaterial *m, const SbPoints *at, const SbPack U[30],
                       const SbPack F[SB_POINTS][9], SbPack pressure, SbPack b[30]);
/* The rule that is exact for det F; for a curved cell that of its points. */
SB_INLINE const SbPointRule *SbVolumeRule(const SbPoints *at)
{
  return at->step ? at->rule : &SbRuleCubic;
}
/* Evaluates the law at the points of a cell. P (Pa), psi (J/m^3), pressure (Pa, compression) may be NULL. */
void SbBatchState(SbSpace space, const SbRegion *region, PetscInt b, const PetscReal x[],
                  SbPack F[SB_POINTS][9], SbPack P[SB_POINTS][9], SbPack psi[SB_POINTS],
                  SbPack pressure[SB_POINTS]);
/* Entry (a, b) of the consistent mass of a straight cell, over density V. */
SB_INLINE PetscReal SbCellMass(const SbRegion *region, int a, int b)
{
  if (region->quadratic) return SbQuadraticMass(a, b);
  return a == b ? region->element->ops.mass_diagonal : region->element->ops.mass_coupling;
}

/* Adds the blocks of each cell of batch b, ten or, for P2, SB_PAIRS; K is 32-byte aligned. */
void SbInsertBatch(SbSpace space, const SbValues *x, PetscInt b, int npair, const SbPack K[][9]);
/* The same for DG cells, whose blocks couple the means at their faces. */
void SbInsertBroken(SbSpace space, const SbValues *x, PetscInt b, const SbPack K[10][9]);

/* constraint.c: projects an assembled matrix, or regularises it. Not collective. */
void SbConstraintsFinishTangent(SbSpace space, const SbValues *x);
PetscErrorCode SbConstraintsDestroy(SbConstraints *constraints);

/* The same projection for rows of a matrix-free operator. */
PetscErrorCode SbMatrixFreeAddRows(Mat A, PetscInt n, const PetscInt node[], const PetscInt ia[],
                                   PetscReal block[]);
