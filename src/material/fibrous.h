/*
  fibrous.h - laws with fibres: a matrix as in isochoric.h, and an energy of the isochoric strain in
  the axes of the cell,

    psi = W(x1, x2) + Wf(E) + K/2 theta(J)^2,   E = Q^T (J^(-2/3) F^T F - I) Q / 2.

  The columns of Q are the fibre, the sheet and their normal (SbMaterial.axes).
*/
#pragma once
#include "isochoric.h"

/* Exponent beyond which an energy is infinite, and its derivatives are no numbers: far beyond any
   stiffness that a factorisation bears, and below the overflow of their products. */
#define SB_FIBRE_LIMIT 250.

/* Wf, J/m^3, and its derivatives, Pa. Symmetric tensors have the six entries 00 01 02 11 12 22;
   dWf = sum w_n S_n dE_n and dS_n = sum w_m C_nm dE_m, w = 1, or 2 off the diagonal. */
typedef struct {
  SbPack W;
  SbPack S[6];
  SbPack C[6][6];
} SbFibreEnergy;

/* Begins the data of a law of this kind. */
typedef struct {
  SbIsochoric isochoric; /* shape SbFibrousNoMatrix(): without W */
  /* Wf at E of a batch; with level 0 its energy, 1 also S, 2 also C, lower half too. */
  void (*fibre)(const struct _p_SbMaterial *m, int level, const SbPack E[6], SbFibreEnergy *w);
} SbFibrous;

void SbFibrousNoMatrix(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                       SbShapeEnergy *w);

/* SbMaterialOps of such a law. */
void SbFibrousEnergy(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi);
void SbFibrousStress(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9]);
void SbFibrousTangent(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81]);

#define SB_FIBROUS_OPS                                                               \
  .energy = SbFibrousEnergy, .stress = SbFibrousStress, .tangent = SbFibrousTangent, \
  SB_ISOCHORIC_DILATATION

/* Wf += k1/(2 k2) (exp(k2 x^2) - 1), x = G : E, where x > 0 or `both`; k2 = 0: k1/2 x^2. G[6] as E,
   the same in all cells: dx = sum w_n G_n dE_n. */
void SbFibreAddExponential(PetscReal k1, PetscReal k2, PetscBool both, const PetscReal G[6],
                           int level, const SbPack E[6], SbFibreEnergy *w);
/* G : G */
SB_INLINE PetscReal SbFibreSquare(const PetscReal G[6])
{
  return G[0] * G[0] + G[3] * G[3] + G[5] * G[5] + 2 * (G[1] * G[1] + G[2] * G[2] + G[4] * G[4]);
}
/* All zero, as far as the level says. */
void SbFibreClear(int level, SbFibreEnergy *w);

/*
  SbFibresRead - reads the directions of the axes, options SB_FIBRE_ROWS, into m->fibres.

  sheet: whether the law needs the second axis.
  Errors: PETSC_ERR_USER for formulas of time, and without a sheet where one is needed. Not
  collective.
*/
PetscErrorCode SbFibresRead(SbMaterial m, const SbScope *scope, PetscBool sheet);
/* Reads them for `option`, which needs them, unless the law has its own. Error: PETSC_ERR_USER if
   none is given. */
PetscErrorCode SbFibresRequire(SbMaterial m, const SbScope *scope, const char *option);

/* Option rows of the directions of fibres. */
#define SB_FIBRE_ROWS                                                                              \
  {"fibre",                                                                                        \
   SB_OPTION_FORMULA,                                                                              \
   3,                                                                                              \
   "",                                                                                             \
   "1,0,0",                                                                                        \
   "",                                                                                             \
   "direction of the fibres, of laws that have them, and of bodies that contract or grow, of any " \
   "length but 0: numbers or formulas of the rest position x, y, z, at the centre of each tet"},   \
    {"sheet",                                                                                      \
     SB_OPTION_FORMULA,                                                                            \
     3,                                                                                            \
     "",                                                                                           \
     "0,0,0",                                                                                      \
     "",                                                                                           \
     "direction in the plane of fibres and sheet, likewise; what it has along the fibres is "      \
     "left out; 0,0,0: any, for laws that do not need it"},                                        \
    {"fibre_field",                                                                                \
     SB_OPTION_STRING,                                                                             \
     1,                                                                                            \
     "",                                                                                           \
     "",                                                                                           \
     "",                                                                                           \
     "array of the mesh file with the direction of the fibres of each tet, in place of `fibre`: "  \
     "ElementData of gmsh, CellData of VTK files, /mesh/NAME of an .h5 mesh; empty: none"},        \
    {"sheet_field", SB_OPTION_STRING, 1, "", "", "", "the same for the sheets"},                   \
    {"fibre_surfaces",                                                                             \
     SB_OPTION_NAMES,                                                                              \
     1,                                                                                            \
     "",                                                                                           \
     "",                                                                                           \
     "",                                                                                           \
     "directions by rule, as in a ventricle of the heart: four sets, its outer and its inner "     \
     "surface, base and apex; with a right ventricle a fifth, its inner surface; none: no rule"},  \
  {                                                                                                \
    "fibre_angles", SB_OPTION_REALS, 4, "degree", "40,-50,-65,25", "[-90, 90]",                    \
      "of the rule: alpha of the fibres to the circumference, inside and outside, and beta of "    \
      "the sheets to the wall's normal, inside and outside"                                        \
  }
