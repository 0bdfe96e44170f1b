/*
  Traction: force and moment of polynomial densities on faces, counted once in overlapping sets; a
  total force; a dead load does not follow the deformation; time; independence of the number of
  ranks; every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"top", "plane:0,0,1,1"}, {"east", "plane:1,0,0,1"}, {"tip", "sphere:1,1,1,0.1"}};

#define WIND "-effect_wind_type traction -effect_wind_on top -effect_wind_vector x^2;1+y;x*y"
#define PUSH "-effect_push_type traction -effect_push_on top,east,top -effect_push_total 6,-12,18"
#define MORE "-effect_push_vector 1;0;0 -effect_push_time 1+t"

static const LoadCase cases[] = {
  /* q = (x^2, 1 + y, x y) on z = 1: F and M = integral (y q_z - q_y, q_x - x q_z, x q_y - y q_x) */
  {"wind",
   WIND,
   PETSC_TRUE,
   1,
   1,
   {1. / 3, 1.5, 0.25},
   {1. / 6 - 1.5, 1. / 3 - 1. / 6, 0.75 - 1. / 6},
   1},
  /* a total over two faces of 1 m^2 each, centred at (.5, .5, 1) and (1, .5, .5): it acts at (.75,
     .5, .75) */
  {"push", PUSH, PETSC_TRUE, 0, 20, {6, -12, 18}, {9 + 9, 4.5 - 13.5, -9 - 3}, 0},
  /* total force and vector together, 2 N in x by the vector, and three times that at t = 2 */
  {"push",
   MORE,
   PETSC_FALSE,
   2,
   20,
   {24, -36, 54},
   {54, 3 * (-9 + 2 * 0.75), 3 * (-12 - 2 * 0.5)},
   0}};

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "dg", "p2"};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  for (int k = 0; k < 5; k++) {
    FixturePair p;

    /* a face with a support has loads like any other */
    fixture_use(elements[k], elements[k], (PetscBool)(k == 3));
    PetscCall(fixture_pair_create(1, PETSC_STATIC_ARRAY_LENGTH(sets), sets, &p));
    PetscCall(check_loads(&p, PETSC_STATIC_ARRAY_LENGTH(cases), cases));
    PetscCall(check_effect_refused(
      &p.all, "dot", "-effect_dot_type traction -effect_dot_on tip -effect_dot_total 0,0,1",
      "-effect_dot_on|set tip|1 vertices|0 boundary|0 tetrahedra"));
    PetscCall(fixture_pair_destroy(&p));
  }
  SB_TEST_END();
}
