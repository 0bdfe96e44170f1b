/*
  sbfem.h - layer 3: nodes and unknowns, batches of cells, assembly, constraints, solver set-up.
*/
#pragma once
#include "sbelement.h"
#include "sbmesh.h"

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
  SbMaterial
    pointwise;    /* the law at the points, less its volumetric part where that is of the mean */
  PetscInt nnode; /* of a cell: 4, of P2 SB_CELL_NODES */
} SbRegion;

typedef struct _p_SbJump *SbJump;               /* face terms of CR and DG, src/fem/jump.c */
typedef struct _p_SbConstraints *SbConstraints; /* sbconstraint.h */

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
     4 cell_orig + a of node a of a cell, the lower of two that share it, 4 Ncell more for its
     support; Nvert + 8 Ncell + 6 cell_orig + e of edge e, the lowest of those that share it */
  PetscInt *node_orig;
  PetscInt *node_body; /* [nnode] */
  uint64_t *node_set; /* [nnode] SB_SET_BIT(k) when constrained with set k; of a face its support */
  PetscBool view_displacement; /* -displacement_view is given */
  PetscBool faces;             /* some body has its nodes at faces */
  PetscBool vertices;          /* all have them at vertices only: nodes are the mesh's vertices */
  PetscInt
    *neighbour; /* [ncell][4] local cell across each face, -1: none; NULL without face nodes */
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
  PetscBool consistent_mass; /* -mass consistent */
  PetscBool
    tentative; /* the tangent may be indefinite: a failed solve is repeated with a definite one */
  uint8_t *fixed;         /* [nnode] bit c set: component c of the node is prescribed */
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
  SbPack *pressure; /* [nbatch] of SbSpaceLinearisePressure(), NULL before it, */
  PetscBool linear_pressure; /* and whether tangents have them instead of the pressures of states */
};

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

/* f[nnode][3] += internal force (stress divergence and beta K v), N. Right on owned nodes. Not
   collective. */
PetscErrorCode SbSpaceAddInternalForce(SbSpace space, const SbStage *stage, PetscReal f[]);
/* f += M (a + alpha v); a or v may be NULL. */
void SbSpaceAddInertia(SbSpace space, const SbStage *stage, PetscReal f[]);

/* Sets the cell pressures of tangents to linearised ones (src/fem/quadratic.c), p = p(U) + part
   dp/dU . along step; U, step: m. step NULL: p(U). U NULL: tangents have the pressures of their
   states again. Collective. */
PetscErrorCode SbSpaceLinearisePressure(SbSpace space, Vec U, Vec step, PetscReal along,
                                        PetscReal part);

/* Adapts the penalty on jumps of CR and DG to the state U, m (src/fem/jump.c). steps: load steps,
   with the energies of full jumps; time steps, where the energy of each face at U is kept within
   bounds; time steps without damping, where no penalty falls. changed (or NULL): some penalty did,
   for load steps by a percent or more. Until the next call the face terms are constant; at first
   they are those of the rest state. Collective. */
typedef enum {
  SB_STEPS_OF_LOAD,
  SB_STEPS_IN_TIME,
  SB_STEPS_UNDAMPED
} SbStepsOf;
PetscErrorCode SbSpaceFollowJumps(SbSpace space, Vec U, SbStepsOf steps, PetscBool *changed);
/* For checkpoints and re-meshing, k[5 ncell_owned]: for each of a cell's four faces the stiffness
   of the full jump at U that has the face's energy, N/m, 0: no such face; and the stress that the
   penalty depends on, Pa. Set: the same, before SbSpaceFollowJumps(). Collective. */
PetscErrorCode SbSpaceGetJumps(SbSpace space, Vec U, PetscReal k[]);
PetscErrorCode SbSpaceSetJumps(SbSpace space, const PetscReal k[]);

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

/* f[nnode][3] += factor dV/du, V the volume of a body (m^3) at u, right on owned nodes; or, with f
   NULL, A += factor d^2V/du^2 times block_scale, as SbSpaceAddCellBlock() does. Not collective. */
PetscErrorCode SbSpaceAddVolume(SbSpace space, PetscInt body, const PetscReal u[], PetscReal factor,
                                PetscReal f[], Mat A);

/* Marks components (bits 0..2) of a local node as prescribed; set-up only. All ranks with the node
   do it. */
PetscErrorCode SbSpacePrescribe(SbSpace space, PetscInt node, int components);
/* After all effects were set up: builds fixed_node. */
PetscErrorCode SbSpacePrescribeDone(SbSpace space);
/* Writes the prescribed displacements of the last evaluation (fixed_value) into u[nnode_owned][3],
   m, and projects it onto exact constraints. Not collective. */
void SbSpaceSetPrescribed(SbSpace space, PetscScalar u[]);
/* Zeroes the prescribed components of a vector, or all others. Not collective. */
PetscErrorCode SbSpaceZeroPrescribed(SbSpace space, PetscBool prescribed, Vec X);

/* Per owned cell: Cauchy stress sigma[6] = xx yy zz xy yz xz (Pa), J, energy density (J/m^3, rest),
   the law's pressure -lambda theta, Pa (SbMaterialPressure()). Outputs may be NULL. Not
   collective. */
void SbSpaceCellState(SbSpace space, const PetscReal u[], PetscReal sigma[], PetscReal J[],
                      PetscReal psi[], PetscReal pressure[]);
/* Per owned cell: first Piola-Kirchhoff stress P[9] (Pa), rotation R[9] in F (the identity for the
   linear law; may be NULL), energy density psi (J/m^3, rest); of P2, whose stresses are means over
   the points of SbRuleQuadratic, P there as well, point[ncell][4][9] (may be NULL); of a curved
   cell the linear function nearest to P is taken there. Not collective. */
void SbSpaceCellPiola(SbSpace space, const PetscReal u[], PetscReal P[], PetscReal R[],
                      PetscReal psi[], PetscReal point[]);
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

/*
  A boundary facet. face = 0..3, opposite local vertex `face`. The displacement of its corner k is
  sum_a element->ops.vertex[corner[k]][a] u[cell_node[4 cell + a]], the element being that of the
  cell's body.
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
/* Node a = 0..9 of a P2 cell, 0..3 of another one. */
static inline PetscInt SbSpaceCellNode(SbSpace space, PetscInt cell, PetscInt a)
{
  return a < 4 ? space->cell_node[4 * cell + a] : space->edge_node[6 * cell + a - 4];
}
/* All local boundary facets (of owned and ghost cells) in set k of the mesh. Allocated here;
   PetscFree. */
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
