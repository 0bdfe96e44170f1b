// @ranks 1
/* What every law must fulfil (material_checks.h), for all laws of the registry: a new one is tested
   here without a line of its own. */
#include "../laws.h"
#include "material_checks.h"

int main(int argc, char **argv)
{
  static const PetscReal nu[] = {0.3, 0.49, 0};
  const char *laws[SB_MATERIAL_TYPES];
  PetscInt n;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  n = SbMaterialTypes(laws);
  SB_CHECK(n >= 4, "only %d laws are registered", (int)n);
  for (PetscInt i = 0; i < n; i++) {
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(nu); k++) {
      SbMaterial m;

      test_print("%s, Poisson's ratio %g\n", laws[i], nu[k]);
      PetscCall(law_create(laws[i], 5e3, nu[k], 1000, &m));
      PetscCall(check_law(m));
      PetscCall(SbMaterialDestroy(&m));
    }
  }
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
