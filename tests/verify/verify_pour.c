// @ranks 1 2
/*
  Eight small bodies poured into a bowl; verify_pour_long pours fifty. pour.h describes the checks.
*/
#include "pour.h"

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(pour(8, 0.5, POUR_RADIUS, 0.03, 1e-3));
  SB_TEST_END();
}
