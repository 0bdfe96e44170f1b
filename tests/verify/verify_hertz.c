// @ranks 1
/*
  Contact of two elastic bodies of P1 after Hertz: what hertz.h tells, on meshes that are refined, with each response and either side looking.
*/
#include "hertz.h"

/* Forces on three meshes, each of half the cell size of the one before: an error of order two, so Aitken's limit is Hertz's force. */
static PetscErrorCode check_meshes(const Pair *p)
{
  static const PetscInt cells[] = {5, 10, CELLS};
  PetscReal force[3], limit;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) {
    const Case c = {cells[i], "projected", "one", 0.12, 1e-3, "p1"};

    PetscCall(hertz(p, &c, &force[i]));
  }
  limit = verify_aitken(force);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %s: limit %.4f of the formula\n", p->name, (double)limit));
  SB_CHECK_NEAR(force[2], 1, 0.03, "force on the finest mesh against that of Hertz");
  SB_CHECK_NEAR(limit, 1, 0.01, "limit of the force against that of Hertz");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_case(const Pair *p, const char *response, const char *sides, PetscReal a,
                                 PetscReal honest)
{
  const Case c = {CELLS, response, sides, a, honest, "p1"};
  PetscReal force;

  PetscFunctionBeginUser;
  PetscCall(hertz(p, &c, &force));
  SB_CHECK_NEAR(force, 1, 0.03, "force against that of Hertz");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const Pair sphere = {"sphere on a half-space", {1e5, 3e5}, {0, RADIUS}};
  static const Pair spheres = {"two spheres", {1e5, 1e5}, {2 * RADIUS, 2 * RADIUS}};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_meshes(&sphere));
  PetscCall(check_case(&sphere, "projected", "one", 0.08, 1e-3));
  PetscCall(check_case(&sphere, "projected", "one", 0.1, 1e-3));
  PetscCall(check_case(&sphere, "projected", "two", 0.1, 0.05));
  PetscCall(check_case(&sphere, "augmented", "one", 0.1, 1e-3));
  PetscCall(check_case(&sphere, "augmented", "two", 0.12, 1e-3));
  PetscCall(check_meshes(&spheres));
  PetscCall(check_case(&spheres, "projected", "two", 0.1, 0.05));
  PetscCall(check_case(&spheres, "augmented", "two", 0.1, 1e-3));
  SB_TEST_END();
}
