// @ranks 1
/*
  Hertz contact of two elastic P1 bodies (hertz.h) under mesh refinement.
*/
#include "hertz.h"

/* Forces on three meshes, each of half the cell size of the one before: an error of order two, so
   Aitken's limit is Hertz's force; the gap of a barrier of the width d / 100 adds up to 1.5 % to
   it. */
static PetscErrorCode check_meshes(const Pair *p)
{
  static const PetscInt cells[] = {5, 10, CELLS};
  PetscReal force[3], limit;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) {
    const Case c = {cells[i], 0.12, 5e-3, "p1", NULL};

    PetscCall(hertz(p, &c, &force[i]));
  }
  limit = verify_aitken(force);
  test_print("  %s: limit %.4f of the formula\n", p->name, limit);
  SB_CHECK_NEAR(force[2], 1, 0.04, "force on the finest mesh against that of Hertz");
  SB_CHECK_NEAR(limit, 1, 0.02, "limit of the force against that of Hertz");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_case(const Pair *p, PetscReal a)
{
  const Case c = {CELLS, a, 5e-3, "p1", NULL};
  PetscReal force;

  PetscFunctionBeginUser;
  PetscCall(hertz(p, &c, &force));
  SB_CHECK_NEAR(force, 1, 0.04, "force against that of Hertz");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exact gaps and forces, and those of springs with multipliers, on a coarser mesh. */
static PetscErrorCode check_response(const Pair *p, const char *response)
{
  const Case c = {CELLS / 2, 0.12, 5e-3, "p1", response};
  const Case barrier = {CELLS / 2, 0.12, 5e-3, "p1", NULL};
  PetscReal force, known;

  PetscFunctionBeginUser;
  PetscCall(hertz(p, &barrier, &known));
  PetscCall(hertz(p, &c, &force));
  SB_CHECK_NEAR(force, 1, 0.08, "force against that of Hertz");
  SB_CHECK_NEAR(force, known, 0.02 * known, "force against that of the barrier");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const Pair sphere = {"sphere on a half-space", {1e5, 3e5}, {0, RADIUS}};
  static const Pair spheres = {"two spheres", {1e5, 1e5}, {2 * RADIUS, 2 * RADIUS}};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_meshes(&sphere));
  PetscCall(check_case(&sphere, 0.08));
  PetscCall(check_case(&sphere, 0.1));
  PetscCall(check_meshes(&spheres));
  PetscCall(check_case(&spheres, 0.1));
  PetscCall(check_response(&sphere, "augmented"));
  PetscCall(check_response(&sphere, "projected"));
  PetscCall(check_response(&spheres, "multiplier"));
  SB_TEST_END();
}
