// @ranks 1
// @long
// @timeout 1800
/*
  Fifty small bodies poured into a bowl. What is looked at is told in pour.h. Two of them sink into each other by a third of their
  size, which is more than the detector should let pass: the bound is what is there now.
*/
#include "pour.h"

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(pour(50, 1.2, 2 * POUR_RADIUS, 0.4, 0.03));
  SB_TEST_END();
}
