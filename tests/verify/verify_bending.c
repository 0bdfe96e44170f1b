// @ranks 1
/*
  Bending near nu = 1/2 with CR, DG and P2, compared with P1: the clamped bar under its weight and
  Cook's membrane (references: high-order elements, mixed near nu = 1/2). The penalty gamma1 is a
  compromise between both problems and verify_locking.c; docs/reports/locking.md has finer meshes.

  P2 on one and two cells across: with the whole volumetric part by the mean of a cell its energy is
  9.7 and 2.1 % too large at nu = 0.3, 14.6 and 2.0 % at 0.49; with SB_POINT_MODULUS 1.5 and 0.5,
  6.3 and 0.7 %.
*/
#include "locking.h"

#define ELEMENTS 4
static const char *const elements[ELEMENTS] = {"p1", "cr", "dg", "p2"};

/* End displacement of the bar: n = 4 cells across, then 8 for CR only if nu is large. */
static PetscErrorCode check_bar(PetscReal nu, PetscReal tip, PetscReal energy)
{
  PetscReal value[2] = {0., 0.};
  LockingCost cost;
  char more[256];

  PetscFunctionBeginUser;
  for (int e = 0; e < ELEMENTS + (nu > 0.4); e++) {
    const char *element = elements[e < ELEMENTS ? e : 1];
    const PetscInt n = e < ELEMENTS ? 4 : 8;

    PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s -solver cholmod", element));
    PetscCall(locking_bar(n, nu, more, value, &cost));
    test_print("  bar, nu %-6g %s n %d: %.6f (%.2f %%), %.5f J (%.2f %%)\n", nu, element, (int)n,
               value[0], 100. * (value[0] / tip - 1.), value[1], 100. * (value[1] / energy - 1.));
    if (e == 0) {
      SB_CHECK(value[0] / tip < (nu > 0.4 ? 0.8 : 0.9), "P1 bends by %g: too much for this test",
               value[0]);
    } else {
      SB_CHECK_NEAR(value[0], tip, (n == 4 ? 0.02 : 0.01) * PetscAbsReal(tip), element);
      SB_CHECK_NEAR(value[1], energy, (n == 4 ? 0.03 : 0.01) * energy, element);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Strain energy of P2 on coarse meshes of the bar. */
static PetscErrorCode check_coarse(PetscReal nu, PetscReal energy, const PetscReal most[2])
{
  PetscReal value[2] = {0., 0.};
  LockingCost cost;

  PetscFunctionBeginUser;
  for (PetscInt n = 1; n <= 2; n++) {
    PetscCall(locking_bar(n, nu, "-body_a_element p2 -solver cholmod", value, &cost));
    test_print("  bar, nu %-6g p2 n %d: %.5f J (%.2f %%)\n", nu, (int)n, value[1],
               100. * (value[1] / energy - 1.));
    SB_CHECK_NEAR(value[1], energy, most[n - 1] * energy, "energy of P2 on a coarse mesh");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u_y at (48,60) and (48,52); edges of 4 m. */
static PetscErrorCode check_cook(PetscReal nu, PetscReal corner, PetscReal middle)
{
  PetscReal value[2] = {0., 0.};
  LockingCost cost;
  char more[256];

  PetscFunctionBeginUser;
  for (int e = 0; e < ELEMENTS; e++) {
    PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s -solver cholmod", elements[e]));
    PetscCall(locking_cook("meshes/cook.msh", nu, more, value, &cost));
    test_print("  Cook, nu %-8g %s: %.4f (%.2f %%), %.4f (%.2f %%)\n", nu, elements[e], value[0],
               100. * (value[0] / corner - 1.), value[1], 100. * (value[1] / middle - 1.));
    if (e) {
      SB_CHECK_NEAR(value[0], corner, 0.015 * corner, elements[e]);
      SB_CHECK_NEAR(value[1], middle, 0.015 * middle, elements[e]);
    } else if (nu > 0.49) {
      SB_CHECK(value[0] < 0.75 * corner, "P1 moves by %g: too much for this test", value[0]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_bar(0.3, -0.785713, 6.38808));
  PetscCall(check_bar(0.49, -0.762295, 6.18476));
  PetscCall(check_coarse(0.3, 6.38808, (const PetscReal[2]){0.02, 0.01}));
  PetscCall(check_coarse(0.49, 6.18476, (const PetscReal[2]){0.08, 0.012}));
  PetscCall(check_cook(1. / 3., 22.6106, 21.5246));
  PetscCall(check_cook(0.49, 19.6653, 18.7368));
  PetscCall(check_cook(0.4999, 19.4285, 18.5120));
  SB_TEST_END();
}
