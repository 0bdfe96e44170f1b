/*
  Damping: its numbers in the regions of the bodies that it names, of all when it names none, added where two meet; body
  names that do not exist.
*/
// @ranks 1 3
#include "effect_fixture.h"

/* Every region of body b, owned or ghost, has alpha[b] and beta[b]. */
static void check_regions(const Fixture *x, const PetscReal alpha[2], const PetscReal beta[2])
{
  for (PetscInt r = 0; r < x->space->nregion; r++) {
    const SbRegion *region = &x->space->region[r];

    SB_CHECK_NEAR(region->alpha, alpha[region->body], 0, "alpha");
    SB_CHECK_NEAR(region->beta, beta[region->body], 0, "beta");
  }
}

int main(int argc, char **argv)
{
  Fixture x;
  SbEffect e[3];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(fixture_create(PETSC_COMM_WORLD, 2, "box:1,1,1:2", 0, NULL, &x));
  check_regions(&x, (const PetscReal[2]){0, 0}, (const PetscReal[2]){0, 0});
  PetscCall(effect_create(&x, "damping", "-effect_damping_alpha 0.5 -effect_damping_beta 0.25", &e[0]));
  check_regions(&x, (const PetscReal[2]){0.5, 0.5}, (const PetscReal[2]){0.25, 0.25});
  PetscCall(effect_create(
    &x, "thick",
    "-effect_thick_type damping -effect_thick_on other,other -effect_thick_alpha 1 -effect_thick_beta 0.01",
    &e[1]));
  check_regions(&x, (const PetscReal[2]){0.5, 1.5}, (const PetscReal[2]){0.25, 0.25 + 0.01});
  for (int i = 0; i < 2; i++) {
    SB_CHECK(!e[i]->ops.force && !e[i]->ops.tangent && !e[i]->ops.prestep && !e[i]->ops.accept,
             "nothing to do at run time");
    PetscCall(SbEffectDestroy(&e[i]));
  }
  CHECK_MESSAGE(effect_create(&x, "wrong", "-effect_wrong_type damping -effect_wrong_on blok", &e[2]),
                "block");
  PetscCall(SbEffectDestroy(&e[2]));
  check_regions(&x, (const PetscReal[2]){0.5, 1.5}, (const PetscReal[2]){0.25, 0.25 + 0.01});
  PetscCall(fixture_destroy(&x));
  SB_TEST_END();
}
