/*
  Registration of the material laws and of the options that they read.
*/
#include "material_impl.h"

static const SbOption body_rows[] = {
  {"young", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "Young's modulus"},
  {"poisson", SB_OPTION_REAL, 1, "", NULL, "(-1, 0.5)",
   "Poisson's ratio; soft tissue is near 0.5, where p1 elements lock"},
  {"density", SB_OPTION_REAL, 1, "kg/m^3", "1000", "(0, inf)",
   "mass per volume in the reference configuration"},
};
static const SbOption corotated_rows[] = {
  {"tangent", SB_OPTION_CHOICE, 1, "", "auto", "auto|warped|exact|exact_spd",
   "tangent stiffness: warped, Hooke's tensor rotated with the cell (stiffness warping, positive definite); "
   "exact; exact_spd, exact with each cell projected to positive semi-definite"},
};
static const SbOption exact_rows[] = {
  {"tangent", SB_OPTION_CHOICE, 1, "", "auto", "auto|exact|exact_spd",
   "tangent stiffness: exact; exact_spd, exact with each cell projected to positive semi-definite, for CG"},
};

PetscErrorCode SbMaterialRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionsRegister("body", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscCall(SbOptionsRegister("inclusion", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscCall(SbMaterialRegister("linear", SbMaterialCreate_Linear, 0, NULL));
  PetscCall(SbMaterialRegister("corotated", SbMaterialCreate_Corotated, 1, corotated_rows));
  PetscCall(SbMaterialRegister("stvk", SbMaterialCreate_StVK, 1, exact_rows));
  PetscCall(SbMaterialRegister("neohookean", SbMaterialCreate_NeoHookean, 1, exact_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
