/*
  sbelement.h - layer 2: kernels on batches of SB_BATCH tets with four nodes and constant basis
  gradients.

  The kernels take arrays and return arrays: no MPI, no allocation, no mesh. Lanes as in
  sbmaterial.h; inputs and outputs never overlap. Gradients sum to zero: g holds those of nodes
  1..3, everything about node 0 follows from them.
*/
#pragma once
#include "sbmaterial.h"

#define SB_PAIRS 55
/* Pairs (a, b) with a <= b in the order of the blocks of a symmetric matrix: ten, or all of P2. */
static const int SbPairA[SB_PAIRS] = {0, 0, 0, 0, 1, 1, 1, 2, 2, 3, 0, 1, 2, 3, 4, 0, 1, 2, 3,
                                      4, 5, 0, 1, 2, 3, 4, 5, 6, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1,
                                      2, 3, 4, 5, 6, 7, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
static const int SbPairB[SB_PAIRS] = {0, 1, 2, 3, 1, 2, 3, 2, 3, 3, 4, 4, 4, 4, 4, 5, 5, 5, 5,
                                      5, 5, 6, 6, 6, 6, 6, 6, 6, 7, 7, 7, 7, 7, 7, 7, 7, 8, 8,
                                      8, 8, 8, 8, 8, 8, 8, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9};
/*
  SbElement - what distinguishes one element from another. P1, CR and DG are linear in a cell and
  have four nodes there: P1 at the vertices, CR and DG at the centroids of the faces, node a
  opposite vertex a. CR shares a node between the two cells of a face; in DG each cell has its own.
  They differ in `tabulate`, in the mass, and in the face terms (src/fem/jump.c). P2 is quadratic:
  it has six more nodes at the edges, and is a P1 cell at each of its points (src/element/p2.c).
  All cells of a rigid body have the same four nodes, the corners of a tet of their own, whose
  barycentric coordinates are the basis (src/fem/rigid.c).
*/
typedef struct _p_SbElement *SbElement;
typedef struct {
  /* Basis gradients of nodes 1..3 (node 0 has minus their sum) and volumes from vertex positions of
     one cell. x[4][3] m; g[3][3] row a = grad phi_{a+1}, 1/m; V m^3, negative when the cell is
     inverted. A cell without volume gives gradients that are not finite: the mesh refuses it
     before. */
  void (*tabulate)(const PetscReal x[4][3], PetscReal g[3][3], PetscReal *V);
  /* mass of a cell / (density V): lumped share of each node, and consistent M_aa, M_ab */
  PetscReal mass_lumped, mass_diagonal,
    mass_coupling;            /* P1: 1/4, 1/10, 1/20; P2: SbQuadraticMass() */
  PetscReal mass_lumped_edge; /* P2: of a node at an edge */
  PetscReal vertex[4]
                  [4]; /* vertex[v][a]: value of basis function a at vertex v. P1: the identity */
} SbElementOps;
struct _p_SbElement {
  char name[SB_NAME_MAX];
  PetscLogEvent
    event; /* SbElem_<name>, around the set-up of its cells; in a step they are their law's */
  PetscInt
    nodes_per[4];   /* nodes per vertex, edge, face, cell. P1: 1,0,0,0; CR: 0,0,1,0; DG: 0,0,0,4 */
  PetscReal gamma0; /* DG: factor on the penalty of mean jumps */
  PetscReal gamma1; /* CR and DG: factor on the penalty of jumps */
  PetscBool
    mean_volume; /* P2: most of the volumetric part of the energy is that of the mean of the cell */
  PetscBool
    weak; /* DG: a prescribed boundary face gets a node of its own, to which the cell is tied */
  PetscBool rigid; /* of a rigid body: no nodes per vertex, edge, face or cell */
  SbElementOps ops;
};
/* An element by name, and what it is with its options at their defaults. */
typedef struct {
  PetscInt nrow;
  const SbOption *row; /* [nrow] its options, class "body", type = its name */
  struct _p_SbElement element;
} SbElementType;

/* Names of all elements, "p1|p2|...": the range of the option `element`. */
extern char SbElementNames[];
/* Adds an element, which must live as long as the program, and its option rows. Not collective,
   same on all ranks. */
PetscErrorCode SbElementRegister(const SbElementType *type);
PetscErrorCode SbElementRegisterAll(void);
/* Names of all elements, in the order of their registration; their number. Not collective. */
#define SB_ELEMENT_TYPES 16
PetscInt SbElementTypes(const char *names[SB_ELEMENT_TYPES]);
/* The element of a name; NULL if there is none. Not collective. */
const SbElementType *SbElementFind(const char *name);
/* Creates an element by name and reads the options of body (NULL: their defaults; its `type` is not
   examined); owned by the caller. Error: PETSC_ERR_USER for an unknown name, and what the option
   readers refuse. */
PetscErrorCode SbElementCreate(const char *name, const SbScope *body, SbElement *e);
/* The element of rigid bodies, which has no name in the registry: -body_<name>_rigid asks for
   it. */
#define SB_ELEMENT_RIGID "rigid"
PetscErrorCode SbElementCreateRigid(SbElement *e);
PetscErrorCode SbElementDestroy(SbElement *e);
/* Whether it has its nodes at faces: CR and DG. */
static inline PetscBool SbElementHasFaces(const struct _p_SbElement *e)
{
  return (PetscBool)(e->nodes_per[2] || e->nodes_per[3]);
}

/* F = one I + sum_a u_a (x) grad phi_a; one: 1, or 0 for the gradient of a velocity. g[3*(a-1)+j] =
   d phi_a / dX_j, a = 1..3, 1/m; u[3*a+i], a = 0..3, m. */
void SbCellGradient(const SbPack g[9], const SbPack u[12], PetscReal one, SbPack F[9]);
/* f[3*a+i] = V P_ij grad phi_a,j: internal force of the cell on its nodes, N. The four forces sum
   to zero. */
void SbCellForce(const SbPack g[9], const SbPack V, const SbPack P[9], SbPack f[12]);
/*
  Ten upper blocks of the cell matrix for Hooke's tensor turned by R: K[p][3*i+k] for p = 0..9 as
  SbPairA/B, K_ab = V (lambda h_a h_b^T + mu h_b h_a^T + mu (h_a . h_b) I), h = R grad phi. N/m.
  Diagonal blocks are symmetric to the last bit; the blocks (a, 0..3) sum to zero, (b, a) = (a,
  b)^T.
*/
void SbCellBlocksIsotropic(const SbPack g[9], const SbPack V, PetscReal lambda, PetscReal mu,
                           const SbPack R[9], SbPack K[10][9]);
/*
  The same for the tangent that SbMaterialOps.spin describes, R and symmetric W (Pa) from there:
  K_ab = V (2 mu (h_a . h_b) I + lambda h_a h_b^T + [h_a]x R W R^T [h_b]x^T).
*/
void SbCellBlocksCorotated(const SbPack g[9], const SbPack V, PetscReal lambda, PetscReal mu,
                           const SbPack R[9], const SbPack W[9], SbPack K[10][9]);
/* The same for a full tangent C, symmetric in the pairs: K_ab,ik = V C_(ij)(kl) grad phi_a,j grad
   phi_b,l. */
void SbCellBlocksGeneral(const SbPack g[9], const SbPack V, const SbPack C[81], SbPack K[10][9]);

/* P2, src/element/p2.c */
extern const SbPointRule SbRuleQuadratic; /* degree 2: where stresses are taken */
extern const SbPointRule SbRuleCubic;     /* degree 3 */
/* u[12] at the vertices of a P1 cell with the gradient of U[30] at L. Transpose: F[30] += its
   forces f. */
void SbQuadraticAt(const PetscReal L[4], const SbPack U[30], SbPack u[12]);
void SbQuadraticAdd(const PetscReal L[4], const SbPack f[12], SbPack F[30]);
/* K[p] for p = 0..54 from the ten blocks of P1 at each point of a rule, and factor b_a b_b^T. */
void SbQuadraticBlocks(const SbPointRule *rule, const SbPack B[][10][9], const SbPack factor,
                       const SbPack b[30], SbPack K[SB_PAIRS][9]);
/* K += weight d^2(det F)/du^2 at L; g as for P1, F there. */
void SbQuadraticAddJacobian(const PetscReal L[4], const SbPack g[9], const SbPack F[9],
                            const SbPack weight, SbPack K[SB_PAIRS][9]);
/* Consistent mass M_ab of a cell / (density V), a, b = 0..9. */
PetscReal SbQuadraticMass(int a, int b);
