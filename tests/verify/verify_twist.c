// @long
// @ranks 1
// @timeout 600
/*
  A neo-Hookean bar at nu = 0.499, one end turned by 90 degrees: CR and DG agree, and approach a finer mesh. Two cells across give
  the torque of a square bar to a fifth only.
*/
#include "locking.h"

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(
    locking_check_pair("twist", locking_twist, "-solver mumps", 0.02, 4, (const PetscReal[2]){1e-3, 0.25}));
  SB_TEST_END();
}
