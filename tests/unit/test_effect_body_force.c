/*
  Body force: force and moment of quadratic densities on all cells and on a part; time in the
  density and as a factor; independence of the number of ranks; every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"lower", "box:-1,-1,-1,2,2,0.5"}, {"block", "body:block"}, {"shell", "plane:0,0,1,0"}};

#define PULL "-effect_pull_type body_force -effect_pull_density 1+x;2*y^2;x*z"
#define GROW "-effect_grow_type body_force -effect_grow_density t*x;0;0 -effect_grow_time 2+t"
#define HALF "-effect_half_type body_force -effect_half_on lower,lower -effect_half_density 0;0;8"

static const LoadCase cases[] = {
  /* b = (1 + x, 2 y^2, x z) on the unit cube: M = integral X x b = (y x z - z 2 y^2, z (1 + x) - x
     x z, x 2 y^2 - y (1 + x)) */
  {"pull",
   PULL,
   PETSC_TRUE,
   1,
   1,
   {1.5, 2. / 3, 0.25},
   {1. / 8 - 1. / 3, 3. / 4 - 1. / 6, 1. / 3 - 3. / 4},
   0},
  {"grow", GROW, PETSC_FALSE, 3, 10, {3 * 5 * 0.5, 0, 0}, {0, 3 * 5 * 0.25, -3 * 5 * 0.25}, 0},
  /* 8 N/m^3 on the lower half, also if it is named twice; the force of the last effect is
     checked */
  {"half", HALF, PETSC_TRUE, 0, 4, {0, 0, 4}, {2, -2, 0}, 0}};

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  for (int k = 0; k < 4; k++) {
    FixturePair p;
    const Fixture *x = &p.all;

    fixture_use(elements[k], elements[k], PETSC_FALSE);
    PetscCall(fixture_pair_create(1, PETSC_STATIC_ARRAY_LENGTH(sets), sets, &p));
    PetscCall(check_loads(&p, PETSC_STATIC_ARRAY_LENGTH(cases), cases));
    for (PetscInt i = 0; i < x->space->nnode; i++)
      if (x->space->node_x[3 * i + 2] > 0.75)
        SB_CHECK(x->f[3 * i + 2] == 0, "force outside the set");
    PetscCall(check_effect_refused(
      &p.all, "flat",
      "-effect_flat_type body_force -effect_flat_on shell -effect_flat_density 0;0;8",
      "-effect_flat_on|set shell|9 vertices"));
    PetscCall(fixture_pair_destroy(&p));
  }
  SB_TEST_END();
}
