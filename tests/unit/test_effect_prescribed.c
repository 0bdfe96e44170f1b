/*
  Unknowns prescribed by several effects: the first one owns them, with their values and reactions, and an
  effect without any is an error; every element; supports of DG faces.
*/
// @ranks 1 3
#include "../../src/effect/effect_impl.h"
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"bottom", "plane:0,0,1,0"}, {"west", "plane:1,0,0,0"}, {"edge", "box:-1,-1,-0.1,0.1,2,0.1"}};

/* Option with one of the sets, valid until the next call. */
static const SbEffectOn *on_set(int k)
{
  static char name[1][SB_NAME_MAX];
  static const SbEffectOn on = {.option = "-effect_test_on", .n = 1, .name = name};

  (void)snprintf(name[0], SB_NAME_MAX, "%s", sets[k][0]);
  return &on;
}

/* Number of prescribed unknowns over all ranks. */
static PetscErrorCode count(const SbPrescribed *hold, PetscInt *all)
{
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < hold->nowned; i++) {
    for (int c = 0; c < 3; c++) n += (hold->components[i] >> c) & 1;
  }
  PetscCallMPI(MPI_Allreduce(&n, all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values and reactions: bottom prescribes x and z of its nodes, west the remaining components of its own. */
static PetscErrorCode check_values(Fixture *x, SbPrescribed *bottom, SbPrescribed *west)
{
  const PetscInt side = x->space->faces ? 8 : 9, shared = x->space->faces ? 0 : 3; // nodes
  PetscReal *residual, force[2][3], all[2][3];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 3 * bottom->n; i++) x->f[i] = 10;
  PetscCall(SbPrescribedSetValues(bottom, x->space, x->f));
  PetscCall(SbPrescribedSetValues(west, x->space, NULL));
  for (PetscInt k = 0; k < x->space->nfixed; k++) {
    const PetscBool low = x->space->node_x[3 * x->space->fixed_node[k] + 2] < 1e-9 ? PETSC_TRUE : PETSC_FALSE;

    for (int c = 0; c < 3; c++) {
      SB_CHECK_NEAR(x->space->fixed_value[3 * k + c], low && c != 1 ? 10 : 0, 0, "prescribed value");
    }
  }
  PetscCall(PetscMalloc1(3 * x->space->nnode, &residual));
  for (PetscInt i = 0; i < 3 * x->space->nnode; i++) residual[i] = 1 + (PetscReal)(i % 3);
  SbPrescribedReaction(bottom, residual, force[0]);
  SbPrescribedReaction(west, residual, force[1]);
  PetscCallMPI(MPI_Allreduce(force, all, 6, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all[0][0], side, 0, "bottom, x");
  SB_CHECK_NEAR(all[0][1], 0, 0, "bottom, y");
  SB_CHECK_NEAR(all[0][2], side * 3, 0, "bottom, z");
  SB_CHECK_NEAR(all[1][0], side - shared, 0, "west, x");
  SB_CHECK_NEAR(all[1][1], side * 2, 0, "west, y");
  SB_CHECK_NEAR(all[1][2], (side - shared) * 3, 0, "west, z");
  PetscCall(PetscFree(residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  const PetscBool p1 = element[0] == 'p' ? PETSC_TRUE : PETSC_FALSE;
  Fixture x;
  SbPrescribed bottom = {0}, west = {0}, edge = {0};
  PetscInt n;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  SB_CHECK(SbPrescribedComponents(0) == 1 && SbPrescribedComponents(2) == 4 &&
             SbPrescribedComponents(5) == 5 && SbPrescribedComponents(6) == 7,
           "bits of the choices " SB_COMPONENT_CHOICES);

  PetscCall(SbPrescribedSetUp(&bottom, x.space, on_set(0), 5));
  PetscCall(count(&bottom, &n));
  SB_CHECK_NEAR(n, p1 ? 18 : 16, 0, "unknowns of the bottom");
  PetscCall(SbPrescribedSetUp(&west, x.space, on_set(1), 7));
  PetscCall(count(&west, &n));
  SB_CHECK_NEAR(n, p1 ? 9 * 3 - 3 * 2 : 8 * 3, 0, "unknowns of the west side without those of the bottom");
  /* all local nodes, ghosts included, have the bits of their position */
  for (PetscInt i = 0; i < x.space->nnode; i++) {
    const PetscReal *X = &x.space->node_x[3 * i];
    const int expected = (X[2] < 1e-9 ? 5 : 0) | (X[0] < 1e-9 ? 7 : 0);

    SB_CHECK(x.space->fixed[i] == expected, "bits %d at (%g, %g, %g), expected %d", x.space->fixed[i], X[0],
             X[1], X[2], expected);
  }
  SB_CHECK_ERROR(SbPrescribedSetUp(&edge, x.space, on_set(2), 5), PETSC_ERR_USER_INPUT,
                 p1 ? "-effect_test_on" : "body block");
  PetscCall(SbSpacePrescribeDone(x.space));
  PetscCall(check_values(&x, &bottom, &west));

  PetscCall(SbPrescribedFree(&bottom));
  PetscCall(SbPrescribedFree(&west));
  PetscCall(SbPrescribedFree(&edge));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The support of a DG face is prescribed, whichever effect is first, and the node of the cell is free. */
static PetscErrorCode check_supports(void)
{
  Fixture x;
  SbPrescribed hold[2] = {0};
  PetscInt n[2], supports = 0;

  PetscFunctionBeginUser;
  fixture_use("dg", "dg", PETSC_TRUE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  for (int i = 0; i < 2; i++) {
    PetscCall(SbPrescribedSetUp(&hold[i], x.space, on_set(0), i ? 7 : 4));
    PetscCall(count(&hold[i], &n[i]));
  }
  SB_CHECK(n[0] == 8 && n[1] == 16, "z of the first, the rest of the second: %d, %d unknowns", (int)n[0],
           (int)n[1]);
  for (PetscInt i = 0; i < 4 * x.mesh->ncell; i++) {
    const PetscInt own = x.space->cell_node[i], node = x.space->dirichlet_node[i];

    SB_CHECK(!x.space->fixed[own], "a cell's own node is constrained");
    if (node < 0) continue;
    supports += i < 4 * x.mesh->ncell_owned;
    SB_CHECK(x.space->fixed[node] == 7 && x.space->node_mass[node] == 0, "a support is free or heavy");
    SB_CHECK_NEAR(x.space->node_x[3 * node + 2], 0, 0, "place of a support");
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &supports, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(supports == 8 && x.space->Nnode == 4 * x.mesh->Ncell + 8, "%d supports", (int)supports);
  PetscCall(SbSpaceValidate(x.space));
  for (int i = 0; i < 2; i++) PetscCall(SbPrescribedFree(&hold[i]));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1"));
  PetscCall(check_element("cr"));
  PetscCall(check_element("dg"));
  PetscCall(check_supports());
  SB_TEST_END();
}
