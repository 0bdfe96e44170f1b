/*
  sbfem.h - layer 3: nodes and unknowns, batches of cells, residual, tangent, constraints of
  nodes, and the assembly plan for linear solvers.
*/
#pragma once
#include "sbelement.h"
#include "sbmesh.h"

/* data */

/* The arguments of an evaluation of forces and tangent. Arrays: owned nodes, then ghosts,
   [nnode][3]. */
typedef struct {
  PetscReal t;  /* s */
  PetscReal dt; /* length of the step being taken, s; 0 in a static run */
  PetscInt step;
  PetscReal shift_a;  /* dA/dU of the integrator, 1/s^2; 0 in a static run: no inertia */
  PetscReal shift_v;  /* dV/dU of the integrator, 1/s; 0 in a static run: no damping */
  PetscReal shift_k;  /* factor on the stiffness: 1, or 0 when only the mass matrix is wanted */
  const PetscReal *u; /* displacement, m */
  const PetscReal *v; /* velocity, m/s; NULL in a static run */
  const PetscReal *a; /* acceleration, m/s^2; NULL in a static run */
} SbStage;

/* Stress at a point of a batch, after a step of Newton's method whose linearisation it is from
   (src/fem/linear_stress.c). */
typedef struct {
  SbPack p;    /* modulus of the dilatation times it, Pa */
  SbPack S[6]; /* second Piola-Kirchhoff stress 00 01 02 11 12 22, Pa */
} SbLinearStress;

/* Cells of one body and one material, owned or ghost: the unit of dispatch. */
typedef struct {
  PetscInt body;
  SbMaterial material;   /* borrowed from the model */
  SbElement element;     /* borrowed */
  PetscInt bstart, bend; /* batches; the last one may be partly filled */
  PetscBool broken;      /* DG: strains come from the means of the two sides of each face */
  PetscBool
    quadratic; /* P2: strains at the points of SbRuleQuadratic, or SbRuleQuintic where curved */
  /* P2 cells that are curved at rest; NULL: straight. Gradients, parts of the volume at the points
     [batch][SB_POINTS]([9]), lumped mass / (density V) [batch][10]; their memory is the space's */
  SbPack *curve_g, *curve_weight, *curve_mass;
  SbMaterial pointwise; /* the law at the points, less what of its volumetric part is of the mean */
  PetscInt nnode;       /* of a cell: 4, of P2 SB_CELL_NODES */
  SbPack *axes;         /* [batches][9] SbMaterial.axes of a law with fibres, else NULL; owned */
  SbLinearStress *stress; /* [batches][points]; NULL before SbSpaceLineariseStress(); owned */
  struct _p_SbStressHistory *history;   /* of a viscoelastic material, else NULL; owned */
  struct _p_SbSoftening *softening;     /* of a material that softens, else NULL; owned */
  struct _p_SbContraction *contraction; /* of fibres that contract, else NULL; owned */
  struct _p_SbEigenState *eigen;        /* of strains without stress, else NULL; owned */
} SbRegion;

typedef struct _p_SbJump *SbJump;               /* face terms of CR and DG, src/fem/jump.c */
typedef struct _p_SbConstraints *SbConstraints; /* below */

/* Groups of nodes that an effect couples: those with a node that is owned here. */
typedef struct {
  PetscInt n, nstart, nnode; /* groups; room in the arrays */
  PetscInt *start;           /* [n+1] */
  PetscInt *node;            /* [start[n]] local nodes; global ones until SbSpaceCoupleDone() */
} SbCouplings;

typedef struct _p_SbSpace *SbSpace;
struct _p_SbSpace {
  MPI_Comm comm;
  PetscMPIInt rank, size; /* in comm */
  SbMesh mesh;            /* borrowed */
  DM dm; /* that of the mesh with the section of the nodes, three unknowns "displacement" each */
  PetscInt Nnode, nnode_owned, nnode;
  PetscInt gnode_start;
  PetscInt nnode_cell; /* nodes of local cells; those behind are of couplings only */
  PetscInt *gnode;     /* [nnode] global node numbers; owned first, ghosts ascending, those of
                          couplings by themselves */
  PetscInt *cell_node; /* [ncell][4] local nodes; of P2 those at the vertices */
  PetscInt
    *edge_node; /* [ncell][6] local nodes at edges of P2 cells, -1: none; NULL without a P2 body */
  PetscReal *node_x; /* [nnode][3] rest position of each node, m */
  /* [nnode] number that no partition changes, right on owned nodes: vert_orig of a vertex; Nvert +
     4 cell_orig + a of node a of a cell, the lowest of those that share it, 4 Ncell more for its
     support; Nvert + 8 Ncell + 6 cell_orig + e of edge e, the lowest of those that share it */
  PetscInt *node_orig;
  PetscInt *node_body; /* [nnode] */
  uint64_t *node_set; /* [nnode] SB_SET_BIT(k) when constrained with set k; of a face its support */
  PetscBool view_displacement; /* -displacement_view is given */
  PetscBool faces;             /* some body has its nodes at faces */
  PetscBool rigid;             /* some body is rigid */
  PetscInt *rigid_first;       /* [nbody] first local cell of a rigid body, -1: none, or it is not
                                  rigid; NULL without a rigid body */
  PetscReal (*rigid_basis)[4]; /* [nvert] weights of a rigid body's nodes at its vertices, which are
                                  right outside of their tet as well; NULL without a rigid body */
  PetscBool vertices;          /* all have them at vertices only: nodes are the mesh's vertices */
  PetscInt
    *dirichlet_node; /* [ncell][4] massless node that a DG face is tied to, -1: none; or NULL */
  const SbElement *element;   /* [nbody] borrowed */
  const SbMaterial *material; /* by SbMesh.cell_material; borrowed */
  PetscInt nregion;
  SbRegion *region;        /* [nregion] */
  PetscInt nbatch;         /* SB_BATCH cells side by side; a batch never mixes regions */
  PetscInt nbatch_owned;   /* those of owned cells come first */
  SbRegion **batch_region; /* [nbatch] */
  PetscInt *batch_cell;    /* [nbatch] first local cell */
  PetscInt *batch_n;       /* [nbatch] cells in it, 1..SB_BATCH */
  PetscInt width; /* nodes that the stress of a cell acts on at most: 4, 8 with DG, 10 with P2 */
  /* [nbatch][width][SB_BATCH] these nodes (padding repeats the first cell): the four, then those
     across the faces, or those of P2 at the edges (again its own where there is no other) */
  PetscInt *batch_clique;
  SbPack
    *batch_weight; /* [nbatch][4] of a cell's own node in the mean of the two; NULL without DG */
  SbJump jump;     /* NULL without face nodes */
  SbConstraints
    constraints; /* NULL unless an effect may constrain nodes along directions of their own */
  SbCouplings couplings;
  PetscBool own_nodes; /* arrays over nodes are the space's, even if all nodes are vertices */
  PetscBool coupled;   /* an effect may couple nodes that share no cell, in an assembled tangent */
  SbPack *
    batch_g; /* [nbatch][9] basis gradients of nodes 1..3, 1/m, of straight cells; 64-byte aligned */
  SbPack *batch_V;         /* [nbatch] volumes, m^3; 0 in padding; 64-byte aligned */
  void *batch_memory;      /* memory of batch_g, batch_V and those of curved cells */
  PetscReal *node_mass;    /* [nnode] lumped mass, kg, complete on owned nodes */
  PetscReal *node_share;   /* [nnode] integral of density phi_a, kg; node_mass itself without P2 */
  PetscReal *alpha, *beta; /* [nbody] Rayleigh damping C = alpha M + beta K, 1/s and s */
  PetscReal added_mass;    /* in node_mass of owned nodes besides that of the cells, kg */
  PetscBool consistent_mass; /* -mass consistent */
  PetscBool
    tentative; /* the tangent may be indefinite: a failed solve is repeated with a definite one */
  uint8_t *fixed; /* [nnode] bit c set: component c of the node is prescribed */
  PetscReal
    *vertex_value;        /* [nvert][3] displacement that supports prescribe at corners of the faces
                              whose nodes they prescribe, else zero, m; NULL without face nodes */
  PetscInt nfixed;        /* local nodes with any bit */
  PetscInt *fixed_node;   /* [nfixed] ascending */
  PetscReal *fixed_value; /* [nfixed][3] prescribed displacement at the last evaluation, m */
  PetscBool
    ghosted; /* more than one rank: vectors carry ghosts, also where a rank happens to have none */
  Vec template_vec;       /* ghosted (more than one rank) or sequential; block size 3 */
  struct _p_SbPlan *plan; /* cell blocks -> matrix values; NULL before SbSpaceCreateMatrix() */
  PetscReal
    block_scale;    /* on blocks of SbSpaceAddCellBlock(): the load factor of a static run, or 1 */
  PetscBool rough;  /* the last solve had a loose tolerance: its contact forces are inaccurate */
  PetscBool linear; /* every region's law is linear */
  PetscBool positive;             /* a region's law has infinite energy where det F <= 0 */
  PetscInt nhistory;              /* history variables of a cell at most, all ranks */
  PetscBool viscous;              /* some body is viscoelastic, on any rank */
  PetscBool viscous_began;        /* they have values */
  PetscLogEvent viscous_event;    /* SbMat_viscous, around their updates */
  PetscBool softening;            /* some body softens, on any rank */
  PetscLogEvent softening_event;  /* SbMat_mullins, around the updates of its history */
  PetscBool active;               /* some fibres contract, on any rank, */
  PetscBool active_rates;         /* and with a force that depends on their velocity */
  PetscLogEvent active_event;     /* SbMat_active, around the evaluation of their tensions */
  PetscBool eigen;                /* some body has strains without stress, on any rank, */
  PetscBool grows, active_strain; /* and others than active ones; active ones */
  PetscLogEvent eigen_event;      /* SbMat_eigenstrain, around their evaluation */
  SbPack
    *pressure; /* [nbatch] of P2's means, Pa, tension, by SbSpaceLineariseStress(), NULL before */
  PetscBool linear_stress; /* tangents have the stresses of that instead of those of states */
};

/* the space and its vectors */

/* Collective. Borrowed: materials by the numbers in the mesh (one per body, then those of
   inclusions), elements one per body. Options read: -mass. */
PetscErrorCode SbSpaceCreate(SbMesh mesh, const SbMaterial material[], const SbElement element[],
                             SbSpace *space);
PetscErrorCode SbSpaceDestroy(SbSpace *space);
PetscErrorCode SbSpaceValidate(SbSpace space);
extern const SbOption SbSpaceRows[];

/* A zeroed vector with the layout of the unknowns (3 per node, with ghosts). Collective. Caller
   destroys. */
PetscErrorCode SbSpaceCreateVec(SbSpace space, Vec *v);
/* -displacement_view: shows displacements U[nnode][3], m, with a viewer of PETSc. Collective. */
PetscErrorCode SbSpaceViewDisplacement(SbSpace space, Vec U);
/* Current positions of vertices of owned cells, x[nvert][3], m; CR and DG: means over cells.
   Collective. */
PetscErrorCode SbSpaceVertexPositions(SbSpace space, Vec U, PetscReal x[]);
/* Brings ghosts up to date and lends the local array [nnode][3] of `v`. Collective; restore in the
   same function. */
PetscErrorCode SbSpaceGetLocalRead(SbSpace space, Vec v, const PetscReal **array);
static inline PetscErrorCode SbSpaceRestoreLocalRead(SbSpace space, Vec v, const PetscReal **array)
{
  (void)space;
  return VecRestoreArrayRead(v, array);
}
/* Lends the local array of `v` for writing; values of ghosts are ignored afterwards. Not
   collective. */
PetscErrorCode SbSpaceGetLocalWrite(SbSpace space, Vec v, PetscReal **array);
static inline PetscErrorCode SbSpaceRestoreLocalWrite(SbSpace space, Vec v, PetscReal **array)
{
  (void)space;
  return VecRestoreArray(v, array);
}
/* Brings x[nnode][3] of owned nodes to the ghosts of other ranks. Collective. */
PetscErrorCode SbSpaceUpdateGhosts(SbSpace space, PetscReal x[]);

/* forces and jumps */

/* f[nnode][3] += internal force (stress divergence and beta K v), N. Right on owned nodes. Not
   collective. */
PetscErrorCode SbSpaceAddInternalForce(SbSpace space, const SbStage *stage, PetscReal f[]);
/* f += M (a + alpha v); a or v may be NULL. */
void SbSpaceAddInertia(SbSpace space, const SbStage *stage, PetscReal f[]);

/* Sets the stresses of tangents to linearised ones (src/fem/linear_stress.c): from the last ones to
   S(U) - dS/dU . step by this part; U, step: m. step NULL: S(U). U NULL: tangents have the stresses
   of their states again. Collective. */
PetscErrorCode SbSpaceLineariseStress(SbSpace space, Vec U, Vec step, PetscReal part);

/* Adapts the penalty on jumps of CR and DG to the state U, m (src/fem/jump.c). steps: load steps,
   with the energies of full jumps; time steps, where the energy of each face at U is kept within
   bounds; time steps without damping, where no penalty falls. changed (or NULL): some penalty did;
   in load steps, the energy of jumps by more than `enough`, J, or a penalty or tension by more than
   what the old one bears, on all ranks, else penalties stay; in one that failed at U, tensions on
   the mean by more than that, as where stress is even.
   Until the next call the face terms are constant; at first they are those of the rest state.
   even[nbody], Pa: pressure of loads that work on the volume of all cells, which balances as much
   of their stress; NULL: none. Collective. */
typedef enum {
  SB_STEPS_OF_LOAD,
  SB_STEPS_FAILED, /* of load */
  SB_STEPS_IN_TIME,
  SB_STEPS_UNDAMPED
} SbStepsOf;
PetscErrorCode SbSpaceFollowJumps(SbSpace space, Vec U, const PetscReal even[], SbStepsOf steps,
                                  PetscReal enough, PetscBool *changed);
/* Warns of bodies of CR and DG with many tets of shapes for which the penalty on jumps is not
   verified. Collective. */
PetscErrorCode SbSpaceWarnShapes(SbSpace space);
/* For checkpoints and re-meshing, k[5 ncell_owned]: for each of a cell's four faces the stiffness
   of the full jump at U that has the face's energy, N/m, 0: no such face; and the stress that the
   penalty depends on, Pa. Set: the same, before SbSpaceFollowJumps(). Collective. */
PetscErrorCode SbSpaceGetJumps(SbSpace space, Vec U, PetscReal k[]);
PetscErrorCode SbSpaceSetJumps(SbSpace space, const PetscReal k[]);

/*
  The history of viscoelastic cells (src/fem/viscous.c); nothing without any. Collective.

  SbSpaceViscousStart   - relaxed at U, unless there is a history already. Before it, stresses are
                          the relaxed ones.
  SbSpaceViscousAt      - stresses, energies and tangents are from now on those at a time after the
                          last step, s, in which the step began with U, m, and V, m/s; 0: at its
                          end. second: of second order, for viscosities
  SbSpaceViscousAdvance - a step of length dt, s, from U0 to U1 was accepted. loss: raised by what
                          the branches of Prony series lost, J, or NULL: energies are not wanted
  SbSpaceViscousWork    - what viscosities dissipate in a step from U[0], V[0] to U[1], V[1], m
                          and m/s, raises loss, J: by the mean of their stresses at both ends, as
                          works in the energy balance
  SbSpaceViscousStored  - energy of the branches of a body, -1: of all, J. Not collective.
*/
PetscErrorCode SbSpaceViscousStart(SbSpace space, Vec U);
PetscErrorCode SbSpaceViscousAt(SbSpace space, PetscReal elapsed, PetscBool second, Vec U, Vec V);
PetscErrorCode SbSpaceViscousAdvance(SbSpace space, PetscReal dt, Vec U0, Vec U1, PetscReal *loss);
PetscErrorCode SbSpaceViscousWork(SbSpace space, const Vec U[2], const Vec V[2], PetscReal *loss);
PetscReal SbSpaceViscousStored(SbSpace space, PetscInt body);

/*
  Materials that soften (src/fem/mullins.c); nothing without any.

  SbSpaceMullinsAdvance - the state U, m, was accepted, or a run begins there: points remember the
                          largest energy of their shape. loss: raised by what that lost, J, or NULL:
                          energies are not wanted. Collective.
  SbSpaceMullinsFreeze  - stresses have the factor that they have at U, whatever they are of; U
                          NULL: no longer. Collective.
  SbSpaceMullinsFactor  - per owned cell: the factor on the stress that changes the shape, the mean
                          of its points, value[ncell_owned]; 1 without softening. Not collective.
*/
PetscErrorCode SbSpaceMullinsAdvance(SbSpace space, Vec U, PetscReal *loss);
PetscErrorCode SbSpaceMullinsFreeze(SbSpace space, Vec U);
void SbSpaceMullinsFactor(SbSpace space, const PetscReal u[], PetscReal value[]);

/*
  The history of cells of both kinds (src/fem/history.c).

  SbSpaceGetHistory  - for checkpoints, x[nhistory ncell_owned]. Not collective.
  SbSpaceSetHistory  - the same. Collective.
  SbSpaceMeanHistory - in the record x of an owned cell, from SbSpaceGetHistory(), what its points
                       have becomes their mean, first in the record: branches of a series, largest
                       energies; back: the points of a cell of another mesh get it, and the last
                       step of a viscoelastic one is that of SbSpaceViscousStart(), to be called
                       then. Not collective.
*/
PetscErrorCode SbSpaceGetHistory(SbSpace space, PetscReal x[]);
PetscErrorCode SbSpaceSetHistory(SbSpace space, const PetscReal x[]);
PetscErrorCode SbSpaceMeanHistory(SbSpace space, const PetscBool of_body[], PetscBool back,
                                  PetscInt stride, PetscReal x[]);

/*
  Fibres that contract (src/fem/active.c); nothing without any.

  SbSpaceActiveAt      - stresses and tangents are from now on those with the tensions at a time, s;
                         those that do not depend on it are multiplied by load. Not collective.
                         Errors: those of SbActiveTension()
  SbSpaceActiveRates   - with a relation of force and velocity: as SbSpaceViscousAt(). Collective.
  SbSpaceActiveMost    - for SbSpaceStableStep(), the largest tensions between two times, s, of 201
                         that are evaluated. Not collective.
  SbSpaceActiveEnergy  - energy of these tensions over this rank's cells at u[nnode][3], m; J. Its
                         derivative is their force. Not collective.
  SbSpaceAddActiveForce - f[nnode][3] += the force of the fibres on the nodes, N, right on owned
                         ones. Not collective.
  SbSpaceActiveTension - per owned cell: the tension times its factors by length and velocity, Pa,
                         value[ncell_owned]; 0: none. Not collective.
*/
PetscErrorCode SbSpaceActiveAt(SbSpace space, PetscReal t, PetscReal load);
PetscErrorCode SbSpaceActiveMost(SbSpace space, PetscReal from, PetscReal to);
PetscErrorCode SbSpaceActiveRates(SbSpace space, PetscReal elapsed, PetscBool second, Vec U, Vec V);
PetscReal SbSpaceActiveEnergy(SbSpace space, const PetscReal u[]);
void SbSpaceAddActiveForce(SbSpace space, const PetscReal u[], PetscReal f[]);
void SbSpaceActiveTension(SbSpace space, const PetscReal u[], PetscReal value[]);

/*
  Strains without stress (src/fem/eigenstrain.c); nothing without any.

  SbSpaceEigenAt    - stresses and tangents are from now on those with the strains at a time, s;
                      those that do not depend on it are multiplied by load. Not collective. Errors:
                      those of SbEigenstrainAt()
  SbSpaceEigenKeep  - the strains are those of an equilibrium, from which the next step starts: the
                      first SbSpaceLineariseStress() without a step has its stresses. Not
                      collective.
  SbSpaceEigenWork  - work of active strains, and of all others, of this rank's cells since the last
                      call, which ended a step as this one does, J; 0 at the first one. Not
                      collective.
  SbSpaceCellGrowth - per owned cell: the volume without stress over that at rest,
                      value[ncell_owned]; 1: none. Not collective.
*/
PetscErrorCode SbSpaceEigenAt(SbSpace space, PetscReal t, PetscReal load);
PetscErrorCode SbSpaceEigenKeep(SbSpace space);
void SbSpaceEigenWork(SbSpace space, const PetscReal u[], PetscBool first, PetscReal work[2]);
void SbSpaceCellGrowth(SbSpace space, PetscReal value[]);

/* matrices and their assembly */

typedef enum {
  SB_MATRIX_AIJ,
  SB_MATRIX_BAIJ,
  SB_MATRIX_SBAIJ
} SbMatrixKind; /* SBAIJ: one rank only */
/* Preallocated matrix and the assembly plan. Collective. Caller destroys the matrix. */
PetscErrorCode SbSpaceCreateMatrix(SbSpace space, SbMatrixKind kind, Mat *A);
/* A = shift_a M + shift_v C + shift_k K(u). No communication; SbSpaceFinishTangent() must
   follow. */
PetscErrorCode SbSpaceAssembleTangent(SbSpace space, const SbStage *stage, Mat A);
/* Replaces rows and columns of prescribed unknowns by a scaled identity and closes the assembly. */
PetscErrorCode SbSpaceFinishTangent(SbSpace space, Mat A);
/* Between the two: A += a 3x3 block (row-major, N/m) for nodes a, b of a local cell, as
   SbSpaceCellNode() numbers them. Not collective. */
PetscErrorCode SbSpaceAddCellBlock(SbSpace space, Mat A, PetscInt cell, PetscInt a, PetscInt b,
                                   const PetscReal block[9]);
/* The same for a spring from node a to a rigid support, possibly the only one of a body: it is also
   added to the coarse spaces of -solver pressure. The block is positive semi-definite; the node's
   owner must be among the callers. */
PetscErrorCode SbSpaceAddSpring(SbSpace space, Mat A, PetscInt cell, PetscInt a,
                                const PetscReal block[9]);

/*
  Couplings: groups of nodes that need not share a cell, declared before effects are set up.

  SbSpaceCouple     - a group of n different nodes by their global numbers, to be called by every
                      rank that owns one of them, with the nodes in the same order; other ranks may
                      call it, too. Output: its number on this rank, -1: none of its nodes is owned
                      here. Not collective. Error: PETSC_ERR_ARG_OUTOFRANGE for no such node.
  SbSpaceCoupleDone - after the last one: nodes of groups that no local cell has become ghosts, so
                      that arrays over nodes and vectors made before are no longer valid.
                      Collective.
  SbSpaceAddCoupling - between SbSpaceAssembleTangent() and SbSpaceFinishTangent(): A += K[3 n][3
  n],
                      row-major, N/m, for group `number`; rows of nodes owned here. The nodes are
                      space->couplings.node[start[number] ...]. Not collective.
*/
PetscErrorCode SbSpaceCouple(SbSpace space, PetscInt n, const PetscInt gnode[], PetscInt *number);
PetscErrorCode SbSpaceCoupleDone(SbSpace space);
PetscErrorCode SbSpaceAddCoupling(SbSpace space, Mat A, PetscInt number, const PetscReal K[]);

/* f[nnode][3] += factor dV/du, V the volume of a body (m^3) at u, right on owned nodes; or, with A,
   A += factor d^2V/du^2 times block_scale, as SbSpaceAddCellBlock() does. Not collective. */
PetscErrorCode SbSpaceAddVolume(SbSpace space, PetscInt body, const PetscReal u[], PetscReal factor,
                                PetscReal f[], Mat A);
/* This rank's part of that volume of a body with linear elements, m^3; u NULL: at rest. Not
   collective. */
PetscReal SbSpaceVolume(SbSpace space, PetscInt body, const PetscReal u[]);

/* prescribed unknowns */

/* Marks components (bits 0..2) of a local node as prescribed; set-up only. All ranks with the node
   do it. */
PetscErrorCode SbSpacePrescribe(SbSpace space, PetscInt node, int components);
/* After all effects were set up: builds fixed_node. */
PetscErrorCode SbSpacePrescribeDone(SbSpace space);
/* Whether no unknown of any rank is free: algebraic multigrid finds nothing to coarsen. Collective.
 */
PetscErrorCode SbSpaceAllPrescribed(SbSpace space, PetscBool *all);
/* Writes the prescribed displacements of the last evaluation (fixed_value) into u[nnode_owned][3],
   m, and projects it onto exact constraints. Not collective. */
void SbSpaceSetPrescribed(SbSpace space, PetscScalar u[]);
/* Zeroes the prescribed components of a vector, or all others. Not collective. */
PetscErrorCode SbSpaceZeroPrescribed(SbSpace space, PetscBool prescribed, Vec X);

/* stresses and energies of cells */

/* Stress of a P2 cell, Pa: at the points of SbRuleQuadratic, and the mean pressure, positive in
   tension. */
typedef struct {
  PetscReal P[4][9], pressure;
} SbPointStress;

/* Per owned cell: Cauchy stress sigma[6] = xx yy zz xy yz xz (Pa), J, energy density (J/m^3, rest),
   the law's pressure -lambda theta, Pa (SbMaterialPressure()). Outputs may be NULL. Not
   collective. */
void SbSpaceCellState(SbSpace space, const PetscReal u[], PetscReal sigma[], PetscReal J[],
                      PetscReal psi[], PetscReal pressure[]);
/* Fills SbMesh.direction for laws that take directions from the mesh file or by a rule, and
   SbMesh.temperature for bodies with a field of it; material as SbSpaceCreate() takes it. Errors:
   those of SbImportCellData(); PETSC_ERR_USER_INPUT for a set without a vertex of the body.
   Collective. */
PetscErrorCode SbCellFieldsFind(SbMesh mesh, const SbMaterial material[]);
/* Per owned cell: the unit vector of an axis, 0: fibre, 1: sheet, at rest, value[ncell_owned][3];
   zero where the law has none. Not collective. */
void SbSpaceCellAxis(SbSpace space, int axis, PetscReal value[]);
/* Per owned cell: first Piola-Kirchhoff stress P[9] (Pa), rotation R[9] in F (the identity for the
   linear law; may be NULL), energy density psi (J/m^3, rest); of P2, whose stresses are means over
   the points of SbRuleQuadratic, P there as well, point[ncell][4][9] (may be NULL); of a curved
   cell the linear function nearest to P is taken there. Not collective. */
void SbSpaceCellPiola(SbSpace space, const PetscReal u[], PetscReal P[], PetscReal R[],
                      PetscReal psi[], PetscReal point[]);
/* Adds rest volumes of owned cells of the law `linear`, m^3: of all of them, and of those that are
   turned by more than `angle`, rad. Local: reduce them. */
void SbSpaceTurned(SbSpace space, const PetscReal u[], PetscReal angle, PetscReal volume[2]);
/* The same of all other laws, of cells that turn by more than `angle` between two displacements. */
void SbSpaceTurnedBetween(SbSpace space, const PetscReal u0[], const PetscReal u1[],
                          PetscReal angle, PetscReal volume[2]);
/* Where laws have infinite energies for det F <= 0 (src/fem/admissible.c): the longest step s in
   [0, 1] from X to X - s scale Y, X being admissible, that stays clear of that; 1 with other laws.
   Collective. */
PetscErrorCode SbSpaceLongestStep(SbSpace space, Vec X, Vec Y, PetscReal scale, PetscReal *part);
/* The worst tet with det F <= 0 of such a law, or beyond its limit of stretch: number, body and
   place, for a message; "" if there is none. Collective. */
PetscErrorCode SbSpaceDescribeInverted(SbSpace space, Vec U, size_t size, char text[]);
/* Owned cells: strain energy (J; added to body[nbody] by bodies, too, unless that is NULL),
   smallest det F, number with det F <= 0, current volume (m^3). Local: reduce them. */
void SbSpaceStrainEnergy(SbSpace space, const PetscReal u[], PetscReal body[], PetscReal *energy,
                         PetscReal *minJ, PetscInt *ninverted, PetscReal *volume);
/* v . C v of owned cells, W. Local: reduce it. */
PetscErrorCode SbSpaceDampingPower(SbSpace space, const PetscReal u[], const PetscReal v[],
                                   PetscReal *power);
/* Largest stable step of an explicit run at rest, with its damping, s; a few percent too large at
   most. Collective, after SbSpacePrescribeDone(). */
PetscErrorCode SbSpaceStableStep(SbSpace space, PetscReal *dt);

/* rigid bodies (src/fem/rigid.c) */

/* The largest strain |F^T F - I| / 2 of this rank's rigid bodies at u[nnode][3], m, and whose it
   is, -1: there are none. Not collective. */
PetscReal SbSpaceRigidStrain(SbSpace space, const PetscReal u[], PetscInt *body);
/* Gives rigid bodies that are not prescribed, with velocities v[nnode_owned][3], m/s (NULL:
   static), the stretch of their spin: changes u[nnode_owned][3], m. Not collective. Errors
   (PETSC_ERR_USER_INPUT): u or v strains one. */
PetscErrorCode SbSpaceRigidStart(SbSpace space, PetscReal u[], const PetscReal v[]);

/* places: facets, curved cells, sets */

/*
  A boundary facet. face = 0..3, opposite local vertex `face`. The displacement of its corner k is
  sum_a SbSpaceCornerBasis(space, cell, corner[k])[a] u[cell_node[4 cell + a]].
*/
typedef struct {
  PetscInt cell, face;
  PetscInt corner[3]; /* 0..3, which vertices of the cell, counter-clockwise seen from outside */
  PetscInt vertex[3]; /* the same as local vertices of the mesh */
  PetscReal
    area; /* rest area, m^2, if curved too; height and normal: of the plane of its corners */
  PetscReal height;    /* rest height of the cell over it, m */
  PetscReal normal[3]; /* rest outward unit normal */
} SbFacet;
/* Positions of the ten nodes of a P2 cell at rest. */
void SbSpaceCellPositions(SbSpace space, PetscInt cell, PetscReal x[SB_CELL_NODES][3]);
/* Integrals of the basis functions over a curved P2 cell, or over a facet of it unless that is
   NULL. Returns their sum, its volume (m^3) or area (m^2). */
PetscReal SbSpaceCurvedIntegrals(SbSpace space, PetscInt cell, const SbFacet *facet,
                                 PetscReal integral[SB_CELL_NODES]);
/* The element of a local cell. */
static inline SbElement SbSpaceCellElement(SbSpace space, PetscInt cell)
{
  return space->element[space->mesh->cell_body[cell]];
}
/* Values of the basis functions of a local cell at its corner 0..3, [4]; not of P2, whose nodes are
   its corners. */
static inline const PetscReal *SbSpaceCornerBasis(SbSpace space, PetscInt cell, PetscInt corner)
{
  const SbElement e = SbSpaceCellElement(space, cell);

  return e->rigid ? space->rigid_basis[space->mesh->cell[4 * cell + corner]]
                  : e->ops.vertex[corner];
}
/* Node a = 0..9 of a P2 cell, 0..3 of another one. */
static inline PetscInt SbSpaceCellNode(SbSpace space, PetscInt cell, PetscInt a)
{
  return a < 4 ? space->cell_node[4 * cell + a] : space->edge_node[6 * cell + a - 4];
}
/* All local boundary facets (of owned and ghost cells) in set k of the mesh, -1: in any or none.
   Allocated here; PetscFree. */
PetscErrorCode SbSpaceGetSetFacets(SbSpace space, PetscInt k, PetscInt *n, SbFacet **facets);
/* Index of a set by name; -1 and an error if there is none (where = option, for the message). */
PetscErrorCode SbSpaceFindSet(SbSpace space, const char *name, const char *where, PetscInt *k);

/* real time: many similar systems, solved fast */

/* The tangent without a matrix: A = shift_a M + shift_v C + shift_k sum_T R_T K_T R_T^T, applied
   cell by cell from the cells' rotated gradients, for laws whose tangent is Hooke's tensor turned
   by a rotation (linear; co-rotated with the warped tangent), lumped mass, and elements without
   face terms (P1, P2). A is a MATSHELL owned by the caller; the space is borrowed. Its state is set
   by SbSpaceAssembleTangent(), as for any matrix. Prescribed unknowns have a scaled identity.
   Collective. Errors: PETSC_ERR_SUP for what it is not for. */
PetscErrorCode SbSpaceCreateMatrixFree(SbSpace space, Mat *A);
/* Whether the space's laws, elements and mass allow a matrix-free operator. Collective, same on all
   ranks. */
PetscErrorCode SbSpaceAllowsMatrixFree(SbSpace space, PetscBool *has);

/* constraints of single nodes */

/*
  n . u = value, exactly or by springs, for contact with rigid obstacles (method:
  src/fem/constraint.c).

  SbSpaceCreateConstraints() during set-up of an effect that may need them. Then, as often as they
  change: SbSpaceClearConstraints(), SbSpaceAddConstraint() by the owners of the nodes,
  SbSpaceAssembleConstraints(). SbModelPrescribe(), residuals, tangents and solves follow.
*/

/* Treatment of constraints outside K: iterations in the null space of exact ones, or a
   factorisation. */
typedef enum {
  SB_SADDLE_NONE,
  SB_SADDLE_DIRECT
} SbSaddle;

typedef struct {
  PetscInt node;  /* owned local node */
  PetscReal n[3]; /* unit vector of the constraint n . u */
  PetscReal
    push[3];        /* direction of the force; differs from n where the node slides with friction */
  PetscReal value;  /* right-hand side: n . u = value, m */
  PetscBool spring; /* the force is constant + stiffness (value - n . u); else a multiplier */
  PetscReal stiffness, constant; /* N/m, >= 0, and N */
  PetscReal velocity;            /* of n . u at the end of the step, m/s */
  PetscReal force; /* by the last SbConstraintsComputeForces(), N; positive: along push */
  PetscReal sum;   /* n . u then, m */
  PetscInt next;   /* next constraint of the node, -1: none; filled by SbSpaceAddConstraint() */
} SbConstraint;

struct _p_SbConstraints {
  PetscBool
    beside; /* solves treat them outside K (SbConstraintsCreateOperator()), else K is projected */
  PetscBool nonsymmetric; /* some may have push other than n */
  PetscInt n, size;
  SbConstraint *constraint; /* [n] */
  PetscInt *first;          /* [nnode_owned] last constraint of a node, -1: none */
  PetscReal *Q;             /* [nnode][9] the projection of a residual at a node is r - Q r */
  /* of all ranks, since the last SbSpaceAssembleConstraints() */
  PetscInt ntotal, nexact;
  PetscBool tilted; /* some have push other than n */

  /* src/solver: solves with constraints outside K */
  SbSaddle saddle;
  Mat K;            /* borrowed; NULL before SbConstraintsCreateOperator() */
  Mat whole;        /* borrowed: the complete tangent, K plus SbModelNonsymmetric(), or K */
  PetscReal *added; /* [nnode_owned][3] diagonal regularisation added to K, N/m; NULL: none */
  PetscInt version, matrix; /* raised when the constraints change, and when K does */
  PC
    factored; /* factorisation of the system, owned; NULL before the first solve with SB_SADDLE_DIRECT */
  PetscInt factored_version, factored_matrix; /* version and matrix then */
  PetscBool factored_symmetric;               /* it is one of a symmetric matrix */
  PetscBool definite;                         /* K is, but for rounding, where it is symmetric */
  PCFailedReason failed;                      /* of this factorisation */
  PetscBool general;                          /* FGMRES replaces a method for symmetric systems */
  char method[SB_NAME_MAX];
  KSPNormType norm;
  PCSide side; /* of the replaced method */
};

/* The constraints that solves treat outside K; NULL: there are none. Not collective. */
static inline SbConstraints SbConstraintsSeparate(SbSpace space)
{
  return space->constraints && space->constraints->beside ? space->constraints : NULL;
}

/* Whether a factorisation of the saddle-point system replaces the preconditioner now. Not
   collective. */
static inline PetscBool SbConstraintsFactored(SbSpace space)
{
  const SbConstraints c = space->constraints;

  return (PetscBool)(c && c->saddle == SB_SADDLE_DIRECT && c->ntotal);
}

/* beside: solves treat the constraints outside K; nonsymmetric: push may differ from n, which needs
   `beside`. Flags of several calls are joined by or. Alike on all ranks. Not collective. */
PetscErrorCode SbSpaceCreateConstraints(SbSpace space, PetscBool beside, PetscBool nonsymmetric);
void SbSpaceClearConstraints(SbSpace space);
/* Output: number of the constraint on this rank; -1: redundant, as it follows from earlier exact
   ones and supports of the node, and not added. Not collective. */
PetscErrorCode SbSpaceAddConstraint(SbSpace space, const SbConstraint *constraint,
                                    PetscInt *number);
/* After the last SbSpaceAddConstraint(): builds Q and the global counts. Collective. */
PetscErrorCode SbSpaceAssembleConstraints(SbSpace space);
/* Whether there is one on any rank. Not collective, alike on all ranks. */
static inline PetscBool SbSpaceIsConstrained(SbSpace space)
{
  return (PetscBool)(space->constraints && space->constraints->ntotal);
}
/* Lends constraint `number` of this rank till the next one is added. */
static inline SbConstraint *SbSpaceGetConstraint(SbSpace space, PetscInt number)
{
  return &space->constraints->constraint[number];
}

/*
  Not collective, on owned nodes [nnode_owned][3]: x <- the closest displacement, m, that satisfies
  exact constraints, or velocity, m/s, of which n . x is theirs (if push is n); x <- x - Q x:
  projected residual.
*/
void SbConstraintsPrescribe(SbSpace space, PetscBool velocities, PetscReal x[]);
void SbConstraintsProject(SbSpace space, PetscReal x[]);
/* z <- its projection onto directions that supports and exact constraints admit. Not collective. */
PetscErrorCode SbSpaceProjectAdmissible(SbSpace space, Vec z);
/* f[nnode_owned][3], N, less springs' forces; projected by exact constraints if `constrain`. */
void SbConstraintsResidual(SbSpace space, const PetscReal u[], PetscBool constrain, PetscReal f[]);
/* y <- y + (F^T k G - added) x, F, G, k: push, n and stiffness of springs; the same added to the
   diagonal block of a node. */
void SbConstraintsAddTangent(SbSpace space, const PetscReal x[], PetscReal y[]);
void SbConstraintsAddSprings(SbSpace space, PetscInt node, PetscReal block[9]);
/* Computes `force` and `sum` of all, for u[nnode_owned][3], m, and its residual r without
   constraints (but with springs), N. */
void SbConstraintsComputeForces(SbSpace space, const PetscReal u[], const PetscReal r[]);
/* After it: adds the forces of all constraints to f[nnode_owned][3], N. */
void SbConstraintsAddForces(SbSpace space, PetscReal f[]);
/* After it: turns this residual r into reactions: of supports, elsewhere constraints, N. */
void SbConstraintsReactions(SbSpace space, PetscReal r[]);
/* Block of local nodes i, j: B <- P_i B P_j (P = I - Q), if i = j plus |B| Q_i; strides of rows,
   columns. */
void SbConstraintsProjectBlock(SbSpace space, PetscInt i, PetscInt j, size_t rs, size_t cs,
                               PetscScalar *v);

/* recovery of stresses at vertices and nodes from those of cells (src/fem/recovery.c) */

#define SB_FIT_MONOMIALS 10 /* monomials up to degree two */
#define SB_FIT_VALUES 10    /* fitted values: nine of the stress, the pressure */

typedef struct _p_SbRecovery *SbRecovery;
struct _p_SbRecovery {
  SbMesh mesh;              /* borrowed */
  const SbElement *element; /* [nbody] borrowed */
  PetscInt nlayer;          /* largest number of materials around a vertex, all ranks */
  PetscInt
    *slot; /* [ncell][4] index of the value of each corner of a cell: nlayer vertex + layer */
  PetscReal
    *weight; /* [ncell][4] weight of a cell's stress in the value of a corner; 0: not owned */
  PetscReal *value; /* [nvert nlayer][9] recovered values */

  /* for P2; NULL without a P2 body, or without vertices here */
  PetscBool quadratic; /* some body is P2: alike on all ranks, as arrays are not */
  PetscReal (
    *factor)[2][SB_FIT_MONOMIALS * SB_FIT_MONOMIALS]; /* [nvert_owned nlayer] Cholesky factors */
  struct SbFit {
    PetscReal c[SB_FIT_VALUES]
               [SB_FIT_MONOMIALS]; /* coefficients of monomials of (X - X_v) / size */
    PetscReal size;                /* length scale, m */
  } * fit;                         /* [nvert nlayer] */
};
/* Patches, once. Collective. */
PetscErrorCode SbRecoveryCreate(SbSpace space, SbRecovery *recovery);
PetscErrorCode SbRecoveryDestroy(SbRecovery *recovery); /* sets NULL; NULL is accepted */
/* Fits the stresses of owned cells, P[ncell][9] and of P2 point[ncell], Pa; those of
   ghosts are filled in. Collective. */
PetscErrorCode SbRecoveryFit(SbRecovery recovery, PetscReal P[], SbPointStress point[]);
/* The recovered stress at a corner of a cell, linear elements, [9] Pa. Not collective. */
static inline const PetscReal *SbRecoveryCorner(SbRecovery r, PetscInt cell, int a)
{
  return r->value + 9 * r->slot[4 * cell + a];
}
/* The recovered stress P and, returned, mean stress at node a = 0..9 of a P2 cell, Pa. Not
   collective. */
PetscReal SbRecoveryNode(SbRecovery recovery, PetscInt cell, int a, PetscReal P[9]);

/*
  Cauchy stress at the nodes of cells (src/fem/nodal_stress.c), for output.

  SbNodalStressCompute - at displacements U, m. Collective.
  SbNodalStressAt      - after it, at node a = 0..3, of P2 to 9, of a local cell: sigma[6] = xx yy
  zz
                         xy yz xz, Pa, on the cell's side where materials meet. Not collective.
*/
typedef struct _p_SbNodalStress *SbNodalStress;
PetscErrorCode SbNodalStressCreate(SbSpace space, SbNodalStress *stress);
PetscErrorCode SbNodalStressCompute(SbNodalStress stress, Vec U);
void SbNodalStressAt(SbNodalStress stress, PetscInt cell, int a, PetscReal sigma[6]);
PetscErrorCode SbNodalStressDestroy(SbNodalStress *stress); /* sets NULL; NULL is accepted */

/* for linear solvers: the assembly plan */

/*
  The plan: sparsity graph of the owned node rows, split as PETSc splits it (diagonal part: owned
  columns; off-diagonal part: ghost columns), and for each local cell the position of its width^2
  node blocks in it. A block index k of row i is the same for BAIJ (values 9 k ..) and for AIJ with
  full 3x3 blocks.
*/
typedef struct _p_SbPlan {
  PetscInt *di, *dj;  /* diagonal part: rows [nnode_owned+1], local columns ascending */
  PetscInt *oi, *oj;  /* off-diagonal part: local ghost nodes, ascending by global number */
  PetscInt *diagonal; /* [nnode_owned] block index of (i, i) */
  /* [nbatch][width^2][SB_BATCH] block (a, b) at width a + b: k in the diagonal part, ~k in the
     off-diagonal part, PETSC_MIN_INT when row a is another rank's; padding lanes have those of the
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
  /* in each block of both parts, [6] N/m: vector v of v x, then the entries (y, z), (z, x), (x, y)
     of a symmetric matrix; or NULL */
  PetscReal *edge_term[2];
  PetscReal *wall_term[2]; /* [3] in each block: its diagonal, N/m; NULL without smooth walls */
  PetscInt nfix;           /* blocks that a prescribed unknown touches */
  PetscInt *fix_block;     /* [nfix] block index as in offset */
  PetscInt *fix_row;       /* [nfix] local row node */
  uint8_t
    *fix_mask; /* [nfix] bits 0..2: rows, 3..5: columns of the block to clear; 6: diagonal block */
} * SbPlan;

PetscErrorCode SbPlanCreate(SbSpace space, SbPlan *plan);

/* splitting, and other operators */

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

/* batches: gathers and scatters */

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

/* rigid-body modes */

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

/* rotations of cells and nodes */

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

/* rows, graphs and values of matrices */

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
