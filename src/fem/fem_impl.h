/*
  fem_impl.h - functions shared by the files of src/fem: layout, face terms, assembly, points of a
  batch.
*/
#pragma once
#include "sbfem.h"

#define SB_NOT_OWNED PETSC_MIN_INT /* in SbPlan.offset: the row is of another rank */

/* layout.c: creates the nodes of the space. After the batches: the nodes of each stress.
   Collective. */
PetscErrorCode SbLayoutNodes(SbSpace space);
PetscErrorCode SbLayoutCliques(SbSpace space);
PetscErrorCode SbLayoutDestroy(SbSpace space);

/* rigid.c: of the rigid bodies, in the order of the layout: their first cells; once the nodes have
   numbers, these nodes and the basis at the vertices. Nothing without a rigid body. Not
   collective. */
PetscErrorCode SbRigidCreate(SbSpace space);
PetscErrorCode SbRigidDescribe(SbSpace space);
PetscErrorCode SbRigidDestroy(SbSpace space);

/* jump.c: face terms of CR and DG, as stiffness or times the body's beta. Not collective. */
typedef enum {
  SB_JUMP_STIFFNESS,
  SB_JUMP_DAMPING
} SbJumpFactor;
PetscErrorCode SbJumpCreate(SbSpace space, SbJump *jump);
PetscErrorCode SbJumpDestroy(SbJump *jump);
/* Adds the penalty at smooth walls, once supports are known. */
PetscErrorCode SbJumpFindWalls(SbSpace space);
/* f[nnode][3] += (factor) K_F x; the jumps of displacements x less the offsets r; complete on owned
   nodes. x[nnode][3] with ghosts. */
void SbJumpAdd(SbSpace space, const PetscReal x[], SbJumpFactor factor, PetscReal f[]);
/* The energy 1/2 x . (factor) K_F x of the face terms, this rank's part, J. */
PetscReal SbJumpEnergy(SbSpace space, const PetscReal x[], SbJumpFactor factor, PetscReal body[]);
/* node[nbatch][8][SB_BATCH] of the faces, borrowed; returns nbatch. */
PetscInt SbJumpCliques(SbSpace space, const PetscInt **node);
/* The matrix of the face in lane l of batch b, to be multiplied by the 3x3 identity; zero in
   padding. */
void SbJumpMatrix(SbSpace space, PetscInt b, PetscInt l, PetscReal K[8][8]);

/* Sums the current face terms for the matrix, in the plan. */
PetscErrorCode SbJumpSumTerms(SbSpace space);

/* A face between two local cells; cell[1] = SB_SUPPORT: between a cell and a support node. */
typedef struct {
  PetscInt cell[2], face[2];
} SbFace;
#define SB_SUPPORT (-1)

/*
  face_shape.c: faces of long and flat cells.

  SbFaceSlopes - of a face whose cells have the mean volume `volume`, m^3: what the penalty spares
                 the slopes of the jump; rest is left at 0. Not collective.
  SbFacesWarn  - warns of bodies with cells beyond those that are verified; face[n] of this rank,
                 V[ncell] volumes, m^3. Collective.
*/
typedef struct {
  PetscReal rest;         /* c1 at rest, N/m */
  PetscReal bears;        /* part of the stress that the penalty at rest bears, of round cells' */
  PetscReal spared[2][3]; /* of the penalty at rest, and of what stress adds to it: parts of c1 on
                             |J_i - J_(i + 1)|^2, 0 to 1/3 in the mean */
} SbSlopes;
SbSlopes SbFaceSlopes(SbSpace space, const SbFace *face, PetscReal volume);
PetscErrorCode SbFacesWarn(SbSpace space, PetscInt n, const SbFace face[], const PetscReal V[]);

/* less[3], N/m, of c1: what slopes are spared in all. */
static inline void SbSlopesLess(const SbSlopes *slopes, PetscReal c1, PetscReal less[3])
{
  const PetscReal rest = PetscMin(c1, slopes->rest);

  for (int i = 0; i < 3; i++)
    less[i] = rest * slopes->spared[0][i] + (c1 - rest) * slopes->spared[1][i];
}

/*
  wall.c: the penalty on jumps at smooth walls. Not collective.

  SbFaceIsHeld   - whether all of a boundary face's displacement is prescribed; its node, on which
                   supports act
  SbFaceWallAxis - 0..2: the axis across the smooth wall that a boundary face is on, or SB_NO_WALL;
                   its node
  SbWallsFind    - lists the facets on walls of cells with an owned node, c1 = 0, after supports
  SbWallJumps    - half the jumps J[3] across the wall at the corners, m or m/s
  SbWallsAdd, SbWallsEnergy - as SbJumpAdd(), SbJumpEnergy()
  SbWallPenalty  - the energy of half jumps J[3] with a penalty c1, less
  SbWallMatrix   - K[i][j], N/m: the entry (axis, axis) of the block of nodes i and j of a wall
*/
#define SB_NO_WALL (-1)
typedef struct {
  SbFace face; /* the cell on both sides */
  PetscInt axis;
  PetscInt node[3];   /* of the cell, opposite the corners */
  PetscInt vertex[3]; /* the corners */
  PetscReal share;    /* 1: the cell is this rank's own; else 0 */
  PetscReal c1;       /* as that of a face between two such cells, N/m */
  SbSlopes slopes;
  PetscReal less[3]; /* of the slopes, N/m */
  PetscReal r[3];    /* offsets of J, m; as those of faces */
} SbWall;
typedef struct {
  PetscInt n;
  SbWall *wall; /* [n]; NULL: none */
} SbWalls;
PetscBool SbFaceIsHeld(SbSpace space, PetscInt face, PetscInt *node);
PetscInt SbFaceWallAxis(SbSpace space, PetscInt face, PetscInt *node);
PetscErrorCode SbWallsFind(SbSpace space, SbWalls *walls);
void SbWallJumps(SbSpace space, const SbWall *wall, const PetscReal x[], SbJumpFactor factor,
                 PetscReal J[3]);
void SbWallsAdd(SbSpace space, const SbWalls *walls, const PetscReal x[], SbJumpFactor factor,
                PetscReal f[]);
PetscReal SbWallsEnergy(SbSpace space, const SbWalls *walls, const PetscReal x[],
                        SbJumpFactor factor, PetscReal body[]);
PetscReal SbWallPenalty(PetscReal c1, const PetscReal less[3], const PetscReal J[3]);
void SbWallMatrix(const SbWall *wall, PetscReal K[3][3]);

/* Factor of the penalty on the negative stiffness that it balances in load steps;
   docs/reference/theory.md. */
#define SB_FOLLOW 4.

/* fibre_rule.c: centre of a straight tet at rest, m; and SbMesh.direction of the cells of material
   k of a body by the rule of surfaces; collective. */
void SbCellCentre(SbMesh mesh, PetscInt cell, PetscReal x[3]);
PetscErrorCode SbFibresByRule(SbMesh mesh, PetscInt body, PetscInt k, SbFibres fibres);

/* axes.c: the axes of cells of laws with fibres, once there are batches. Collective; errors as
   SbMaterialAxes(). */
PetscErrorCode SbSpaceFindAxes(SbSpace space);

/* residual.c */
/* Per owned cell: Cauchy stress, symmetric, T[9] (Pa), and of P2 as in SbSpaceCellPiola() at its
   points, point[ncell] (may be NULL). Not collective. */
void SbSpaceCellCauchy(SbSpace space, const PetscReal u[], PetscReal T[], SbPointStress point[]);

/* edge_gap.c: the gaps around edges that the volume of CR and DG cells misses. Not collective. */
typedef struct _p_SbEdgeGaps *SbEdgeGaps;
/* Faces in batches. Borrowed while gaps exist: node. */
typedef struct {
  PetscInt nface, nbatch;
  const SbFace *face;   /* [nface] in the order of batches and lanes */
  const PetscInt *n;    /* [nbatch] faces in a batch */
  const PetscInt *node; /* [nbatch][8][SB_BATCH] as SbJumpCliques() */
} SbFaceBatches;
PetscErrorCode SbEdgeGapsCreate(SbSpace space, const SbFaceBatches *faces, const uint8_t slides[],
                                SbEdgeGaps *gaps);
PetscErrorCode SbEdgeGapsDestroy(SbEdgeGaps *gaps);
/* Whether a cell of this rank at x[nnode][3] has a pressure that the penalty does not bear;
   even[nbody]: pressures of loads, Pa, or NULL. */
PetscBool SbEdgeGapsNeeded(SbSpace space, const uint8_t slides[], const PetscReal x[],
                           const PetscReal even[]);
/* slides[nbody]: bodies that have no gaps, as one or two components are prescribed at a facet that
   is not on a smooth wall across an axis. Collective. */
PetscErrorCode SbEdgeGapsFindSliding(SbSpace space, uint8_t slides[]);
/* How new tensions and edges change the gaps. */
typedef struct {
  PetscReal energy;  /* of this rank's gaps, edge by edge, J */
  PetscBool differ;  /* some do */
  PetscBool unborne; /* some tension by more than the penalty bears */
  PetscReal even[2]; /* sum over this rank's edges of the change over what the penalty bears; of
                        ones */
} SbGapsChange;
/* Finds tensions and edges at x. */
PetscErrorCode SbEdgeGapsFollow(SbSpace space, SbEdgeGaps gaps, const PetscReal x[],
                                const PetscReal even[], SbGapsChange *change);
/* Those found last become those of the energy. */
void SbEdgeGapsRenew(SbEdgeGaps gaps);
/* Mean of the tensions found last over the edges of an owned cell, Pa; 0 where an edge is left
   out. */
PetscReal SbEdgeGapsTension(SbEdgeGaps gaps, PetscInt cell);
/* f[nnode][3] += forces, N; complete on owned nodes. */
void SbEdgeGapsAdd(SbSpace space, SbEdgeGaps gaps, const PetscReal x[], PetscReal f[]);
/* Energy of a face, J. */
PetscReal SbEdgeGapsEnergy(SbSpace space, SbEdgeGaps gaps, const PetscReal x[], PetscInt b,
                           PetscInt l);
/* Energy of this rank's edges at smooth walls, J; body[nbody]: added to those of bodies, or
   NULL. */
PetscReal SbEdgeGapsMirrorEnergy(SbSpace space, SbEdgeGaps gaps, const PetscReal x[],
                                 PetscReal body[]);
/* Number of edges at walls; the four nodes of one, v[i][j]: the off-diagonal entries (y, z), (z,
   x), (x, y) of the symmetric block of two of them, N/m. */
PetscInt SbEdgeGapsMirrors(SbEdgeGaps gaps);
const PetscInt *SbEdgeGapsMirrorMatrix(SbEdgeGaps gaps, PetscInt i, PetscReal v[4][4][3]);
/* v[i][j]: the block of node i of the first side and node j of the other one is the matrix of v x,
   N/m; the other blocks follow by symmetry, and those of a side with itself are zero. */
void SbEdgeGapsMatrix(SbEdgeGaps gaps, PetscInt b, PetscInt l, PetscReal v[4][4][3]);

/* plan.c */
PetscErrorCode SbPlanDestroy(SbPlan *plan);

/* tangent.c: the table of SbMatrixSetAssembly(), NULL for a matrix of blocks. */
PetscErrorCode SbMatrixGetAssembly(Mat A, const SbAssembly **assembly);

/* Address of block k (as in SbPlan.offset) of a row, and the distances between its rows and
   columns. */
static inline PetscScalar *sb_block(const SbMatBlocks *x, SbPlan p, PetscInt row, PetscInt k,
                                    size_t *row_stride, size_t *column_stride)
{
  const int q = k < 0;
  const PetscInt *ptr = q ? p->oi : p->di;

  if (q)
    k = ~k;
  if (x->kind == SB_MATRIX_AIJ) {
    *row_stride = 3 * (size_t)(ptr[row + 1] - ptr[row]);
    *column_stride = 1;
    return x->value[q] + 9 * (size_t)ptr[row] + 3 * (size_t)(k - ptr[row]);
  }
  *row_stride = 1;
  *column_stride = 3;
  if (x->symmetric)
    k = p->ui[row] + k - p->diagonal[row];
  return x->value[q] + 9 * (size_t)k;
}

/* Adds a block, or its transpose, times a factor, at its position in an owned row. */
static inline void sb_insert_block(SbSpace s, const SbMatBlocks *x, PetscInt row, PetscInt column,
                                   PetscInt position, PetscReal factor, PetscBool turn,
                                   const PetscReal k[9])
{
  size_t rs, cs;
  PetscScalar *v;

  if (position == SB_NOT_OWNED || (x->symmetric && row > column))
    return;
  v = sb_block(x, s->plan, row, position, &rs, &cs);
  for (size_t i = 0; i < 3; i++)
    for (size_t j = 0; j < 3; j++)
      v[i * rs + j * cs] += factor * (turn ? k[3 * j + i] : k[3 * i + j]);
}

/* For every batch b in order, before its SbInsertBatch(): clears the rows that it adds to first, or
   sets them to the face terms with the factors of a stage and beta[nbody], s, damping. NULL:
   without face terms. */
void SbInsertClear(SbSpace space, const SbMatBlocks *x, PetscInt b, const SbStage *faces,
                   const PetscReal beta[]);
/* quadratic.c: points of a batch. P1, CR and DG have one; P2 four, curved cells those of
   SbRuleQuintic. */
typedef struct {
  int n, step;             /* number of points; gradients of point q: g + step q */
  const SbPointRule *rule; /* rule of P2 */
  const SbPack *g, *V;     /* gradients; V[0]: volume of the cell */
  const SbPack *weight;    /* [n] fractions of the volume */
} SbPoints;
SbPoints SbBatchPoints(SbSpace space, PetscInt b);
/* active.c: tensions of the fibres of a region that contract, and what they are of: the time, or
   the load. */
struct _p_SbContraction {
  SbPack *tension; /* [batches] Pa */
  SbPack *most;    /* [batches] their largest values by SbSpaceActiveMost(), or 0 */
  PetscReal at;
  PetscBool known;
  int npoint;
  SbFibreRate *rate; /* [batches][npoint] with a velocity, else NULL */
  PetscBool moving;  /* it is known: not in static runs */
};
/* mullins.c: the largest energies of the shape of the cells of a region that softens. */
struct _p_SbSoftening {
  int npoint;
  SbPack *most, *factor; /* [batches][npoint] J/m^3; of SbSpaceMullinsFreeze(), */
  PetscBool frozen;      /* which acts */
};
PetscErrorCode SbMullinsCreate(SbSpace space);
PetscErrorCode SbMullinsDestroy(SbRegion *region);
/* history.c: what viscous.c and mullins.c keep of cells, once there are batches. Collective. */
#define SB_HISTORY_POINT \
  (8 * SB_PRONY_TERMS) /* numbers of a point that another mesh takes at most */
PetscErrorCode SbHistoryCreate(SbSpace space);

/* eigenstrain.c: strains without stress of a region, and the time and the load that they are of. */
struct _p_SbEigenState {
  PetscInt npoint; /* of a cell */
  int step;        /* 3: each point has strains of its own, 0: all have those of the first */
  /* [batches][points with strains of their own]: of SbEigenLaw() [3]; logarithms along and across
     the fibres, and that of the active strain, [3]; at the last SbSpaceEigenWork() the forces on
     the first two, J, and the three, [5] */
  SbPack *stretch, *log, *last;
  SbPack *kept;    /* stretch at SbSpaceEigenKeep(), NULL before */
  PetscBool fresh; /* it is what the first tangent of a step linearises from */
  PetscReal at[2];
  PetscBool known;
};

/* Of a copy of the law of a region that softens or has strains without stress: that at point q of
   batch b. */
SB_INLINE void SbPointLaw(const SbRegion *region, PetscInt b, int q, struct _p_SbMaterial *own)
{
  const struct _p_SbSoftening *a = region->softening;
  const struct _p_SbEigenState *e = region->eigen;

  if (e) {
    const PetscInt each = e->step ? e->step * e->npoint : 3;

    own->stretch = (const SbPack *)e->stretch + each * (b - region->bstart) + e->step * q;
  }
  if (a) {
    const PetscInt k = a->npoint * (b - region->bstart) + q;

    own->most = (const SbPack *)a->most + k;
    own->factor = a->frozen ? (const SbPack *)a->factor + k : NULL;
  }
}
/* A law of a region as its operations take it for batch b: itself or, of a law with fibres, one
   that softens or one with strains without stress, `own`, a copy with what these cells have; at the
   first point, for others SbPointLaw(). */
SB_INLINE const struct _p_SbMaterial *SbBatchAxes(const SbRegion *region,
                                                  const struct _p_SbMaterial *law, PetscInt b,
                                                  struct _p_SbMaterial *own)
{
  if (!region->axes && !region->softening && !region->eigen)
    return law;
  *own = *law;
  if (region->axes)
    own->axes = (const SbPack *)region->axes + 9 * (b - region->bstart);
  if (region->softening)
    SbMullinsSoften(own, law, region->material->mullins);
  if (region->eigen)
    SbEigenLaw(own, law, region->material->eigen->isochoric, region->eigen->step);
  SbPointLaw(region, b, 0, own);
  return own;
}
/* The law whose dilatation has a mean in P2 cells. */
SB_INLINE const struct _p_SbMaterial *SbBatchVolumeLaw(const SbRegion *region, PetscInt b,
                                                       struct _p_SbMaterial *own)
{
  if (!region->eigen || region->material->eigen->isochoric)
    return region->material;
  return SbBatchAxes(region, region->material, b, own);
}
/* The same; of a viscoelastic material the law of the step, to which SbViscousStress() and its
   siblings add the history. */
SB_INLINE const struct _p_SbMaterial *SbBatchLaw(const SbRegion *region,
                                                 const struct _p_SbMaterial *law, PetscInt b,
                                                 struct _p_SbMaterial *own)
{
  if (region->history && law == region->material)
    law = law->viscous->step;
  return SbBatchAxes(region, law, b, own);
}

/* viscous.c: history of the cells of a region; a point has `width` numbers, S[6], theta and, of P2
   with a mean dilatation, that. */
struct _p_SbStressHistory {
  int npoint, width;
  PetscBool mean;      /* P2 with a mean dilatation */
  PetscBool pressures; /* theta or its mean relax apart from S */
  PetscBool acting;    /* there is a history: SbSpaceViscousAt() */
  PetscReal hooke[2];  /* lambda and mu on E of viscosities in a step, Pa */
  SbPack *last;        /* [batch][npoint][width] of the law at the end of the last step */
  SbPack *branch;      /* [batch][npoint][term][width] of the series, Pa */
  SbPack *dead;        /* [batch][npoint][width] what is constant in the step, Pa */
};
PetscErrorCode SbViscousCreate(SbSpace space);
PetscErrorCode SbViscousDestroy(SbRegion *region);
/* Of a region with a history, at point q of batch b with F: from P and psi of the law
   (SbBatchLaw()) those with the history. K: adds to the blocks of the tangent of scale times the
   law, W: the volume times the factor of the stiffness. */
void SbViscousStress(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                     const SbPack F[9], SbPack P[9]);
void SbViscousEnergy(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                     const SbPack F[9], SbPack psi);
void SbViscousBlocks(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                     const SbPack g[9], const SbPack W, const SbPack F[9], SbPack K[10][9]);
/* p, Pa, compression, from that of the law of the step. */
void SbViscousPressure(const SbRegion *region, PetscInt b, int q, SbPack p);
/* The pressure of P2's mean is `factor` times that of SbQuadraticVolume() plus `constant`, Pa, a
   lane each; energy: for the energy. */
void SbViscousMean(const SbRegion *region, PetscInt b, PetscBool energy, PetscReal *factor,
                   const PetscReal **constant);

/* active.c */
PetscErrorCode SbActiveCreate(SbSpace space);
PetscErrorCode SbActiveDestroyRegion(SbRegion *region);
/* At point q of batch b of such a region with F: adds to P and to the blocks K of the tangent of a
   law, W: the volume times the factor of the stiffness. */
void SbActiveStress(const SbRegion *region, PetscInt b, int q, const SbPack F[9], SbPack P[9]);
void SbActiveBlocks(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                    const SbPack g[9], const SbPack W, const SbPack F[9], SbPack K[10][9]);
/* f += their tangent at rest with the largest tensions, or those of the largest force, times x. */
void SbActiveStiffest(SbSpace space, const SbRegion *region, const PetscReal x[], PetscReal f[]);

/* eigenstrain.c */
PetscErrorCode SbEigenCreate(SbSpace space);
PetscErrorCode SbEigenDestroyRegion(SbRegion *region);
/* Exchanges the strains for those kept, where these are fresh, and back; they are no longer. */
void SbEigenExchangeKept(SbSpace space);
void SbEigenForgetKept(SbSpace space);

/* W = the volume of a point. */
SB_INLINE void SbPointVolume(const SbPoints *at, int q, SbPack W)
{
  for (int l = 0; l < SB_BATCH; l++)
    W[l] = at->weight[q][l] * (*at->V)[l];
}
/* Gathers U[3 nnode] as sb_gather_strain() for x (NULL: zero), and F at the points (rate: less
   I). */
void SbBatchGradients(SbSpace space, PetscInt b, const PetscReal x[], PetscBool rate, SbPack U[30],
                      SbPack F[SB_POINTS][9]);
/* Forces of a stress P at point q on the values of sb_gather_strain(): added for P2, else set (one
   point). */
void SbPointForce(const SbPoints *at, int q, const SbPack P[9], SbPack f[30]);
/* The volumetric part of the energy, V lambda/2 (mean of theta)^2: pressure = lambda times the mean
   (Pa, tension), b[30] = V d mean/du (m^2; NULL: not wanted). F: at the points. */
void SbQuadraticVolume(const struct _p_SbMaterial *m, const SbPoints *at, const SbPack U[30],
                       const SbPack F[SB_POINTS][9], SbPack pressure, SbPack b[30]);
/* The rule that is exact for det F; for a curved cell that of its points. */
SB_INLINE const SbPointRule *SbVolumeRule(const SbPoints *at)
{
  return at->step ? at->rule : &SbRuleCubic;
}
/* Evaluates the law at the points of a cell. P (Pa), psi (J/m^3), pressure (Pa, compression) may be
   NULL. P has the stress of fibres that contract, psi is what is stored. */
void SbBatchState(SbSpace space, PetscInt b, const PetscReal x[], SbPack F[SB_POINTS][9],
                  SbPack P[SB_POINTS][9], SbPack psi[SB_POINTS], SbPack pressure[SB_POINTS]);
/* linear_stress.c: C = the tangent of a law at F with the linearised stress. Pressures of P2's
   mean, Pa, tension, or NULL: hessian in the second derivative of theta, mean in the stress.
   Filtered, C is positive semi-definite. */
void SbLinearStressTangent(const struct _p_SbMaterial *m, const SbPack F[9],
                           const SbLinearStress *stress, const SbPack hessian, const SbPack mean,
                           SbPack C[81]);
/* residual.c: f += elastic forces of a region (if `elastic`) and of damping by beta, s; u NULL:
   rest. */
void SbRegionForces(SbSpace space, const SbRegion *region, PetscBool elastic, PetscReal beta,
                    const SbStage *stage, PetscReal f[]);
/* The consistent mass of each cell, over its density: the integral of phi_a phi_b for each pair,
   m^3. */
void SbBatchMass(SbSpace space, PetscInt b, SbPack mass[SB_PAIRS]);

/* Adds the blocks of each cell of batch b, ten or, for P2, SB_PAIRS; broken: DG, between means at
   faces. K is 32-byte aligned. */
void SbInsertBatch(SbSpace space, const SbMatBlocks *x, PetscInt b, int npair, PetscBool broken,
                   const SbPack K[][9]);
/* constraint.c: projects an assembled matrix, or regularises it. Not collective. */
void SbConstraintsFinishTangent(SbSpace space, const SbMatBlocks *x);
PetscErrorCode SbConstraintsDestroy(SbConstraints *constraints);

/* matrix_free.c: adds the rows of SbSpaceGetRows() of the operator. Not collective. */
PetscErrorCode SbMatrixFreeAddRows(Mat A, PetscInt n, const PetscInt node[], const PetscInt ia[],
                                   PetscReal block[]);
