// @ranks 1 2
/*
  Lame's thick-walled sphere, radii 1 and 2, pressure 1 inside, E = 1, nu = 0.49999, one eighth of
  it between symmetry planes (supports of one component), edge length 0.3: displacement, radial and
  hoop stress of the cells against

    u = (1/7) ((1 - 2 nu) r + 4 (1 + nu) / r^2),   sigma_rr = (1 - 8 / r^3) / 7,   sigma_tt = (1 + 4
    / r^3) / 7.

  The stresses are of first order, with the largest error at the wall, where their gradient is
  largest.
*/
#include "locking.h"

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};

  SB_TEST_BEGIN(argc, argv);
  for (int i = 0; i < 4; i++) {
    LockingShell e = {0};
    LockingCost cost;
    char more[256];

    PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s -solver direct", elements[i]));
    PetscCall(locking_shell("meshes/shell.msh", 0.49999, more, &e, &cost));
    test_print(
      "  %s: errors of u %.4f, stress %.4f %.4f, at the wall %.4f %.4f; u of the wall %.4f\n",
      elements[i], e.u, e.stress[0], e.stress[1], e.wall[0], e.wall[1], e.at_wall);
    if (i == 0) {
      SB_CHECK(e.u > 0.3, "P1 has an error of %g only: this mesh shows no locking", e.u);
      continue;
    }
    SB_CHECK(e.u < 0.04, "%s: error of u %g", elements[i], e.u);
    SB_CHECK_NEAR(e.at_wall, 1., 0.04, "displacement of the inner wall");
    for (int k = 0; k < 2; k++) {
      SB_CHECK(e.stress[k] < 0.08, "%s: error of stress %d is %g", elements[i], k, e.stress[k]);
      SB_CHECK(e.wall[k] < 0.15, "%s: at the wall %g", elements[i], e.wall[k]);
    }
  }
  SB_TEST_END();
}
