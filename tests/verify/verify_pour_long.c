// @ranks 1
// @long
// @cpu 1800
/*
  Fifty small bodies poured into a bowl. What is examined is described in pour.h. They meet corner
  on corner and with edges over bent faces at up to 3 m/s, a quarter of their size in a step: what a
  step leaves in another body is up to 5 % of the size, in few steps.
*/
#include "pour.h"

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(pour(50, 1.2, 2 * POUR_RADIUS, 0.08, 0.03));
  SB_TEST_END();
}
