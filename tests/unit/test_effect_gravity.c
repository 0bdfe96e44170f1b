/*
  Gravity: weight and its moment about the origin for two boxes; the factor of time; contributions
  to nodes of other ranks; every element, also mixed.
*/
// @ranks 1 3
#include "effect_fixture.h"

/* Unit boxes centred at (0.5, 0.5, 0.5) and (3.5, 0.5, 0.5), 1200 kg each: a force F acts at their
   common centre (2, .5, .5). */
#define AT(x, y, z)                                           \
  {x, y, z},                                                  \
  {                                                           \
    0.5 * (z)-0.5 * (y), 0.5 * (x)-2 * (z), 2 * (y)-0.5 * (x) \
  }
#define SLOW \
  "-effect_slow_type gravity -effect_slow_vector 1,-2,3 -effect_slow_time ramp(t/2)" /* switched on over 2 s */

static const LoadCase cases[] = {
  {"gravity", "", PETSC_TRUE, 0, 2400, AT(0, 0, -9.81 * 2400), 0}, /* that of the earth */
  {"gravity", "-effect_gravity_vector 1,-2,3", PETSC_TRUE, 7, 2400, AT(2400, -4800, 7200), 0},
  {"slow", SLOW, PETSC_FALSE, 0.5, 2400, AT(600, -1200, 1800), 0},
  {"slow", SLOW, PETSC_FALSE, 0, 2400, AT(0., 0., 0.), 0}};

int main(int argc, char **argv)
{
  static const char *const elements[][2] = {
    {"p1", "p1"}, {"cr", "cr"}, {"dg", "p1"}, {"cr", "dg"}, {"p2", "cr"}};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  for (int k = 0; k < 5; k++) {
    FixturePair p;

    fixture_use(elements[k][0], elements[k][1], PETSC_FALSE);
    PetscCall(fixture_pair_create(2, 0, NULL, &p));
    PetscCall(check_loads(&p, PETSC_STATIC_ARRAY_LENGTH(cases), cases));
    PetscCall(fixture_pair_destroy(&p));
  }
  SB_TEST_END();
}
