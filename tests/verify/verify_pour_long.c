// @ranks 1
// @long
// @timeout 1800
/*
  Fifty small bodies poured into a bowl. What is looked at is told in pour.h.
*/
#include "pour.h"

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(pour(50, 1.2, 2 * POUR_RADIUS, ""));
  SB_TEST_END();
}
