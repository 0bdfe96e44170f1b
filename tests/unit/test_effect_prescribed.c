/*
  Unknowns prescribed by several effects: the first one owns them, with their values and reactions,
  and an effect without any is an error; every element; supports of DG faces.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"bottom", "plane:0,0,1,0"}, {"west", "plane:1,0,0,0"}, {"edge", "box:-1,-1,-0.1,0.1,2,0.1"}};

/* Number of prescribed unknowns over all ranks. */
static PetscErrorCode count(const Fixture *x, PetscInt *all)
{
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < x->space->nnode_owned; i++)
    for (int c = 0; c < 3; c++)
      n += (x->space->fixed[i] >> c) & 1;
  PetscCallMPI(MPI_Allreduce(&n, all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values and reactions: bottom prescribes x and z of its nodes, west the remaining components of
   its own. */
static PetscErrorCode check_values(Fixture *x, SbEffect bottom, SbEffect west)
{
  const PetscInt side = x->space->faces ? 8 : 9, shared = x->space->faces ? 0 : 3; // nodes
  const SbStage stage = {.u = x->u};
  PetscReal *residual;
  PetscReal force[8] = {0};
  PetscReal all[8];

  PetscFunctionBeginUser;
  PetscCall((*bottom->ops.prescribe)(bottom, x->space, 0.));
  PetscCall((*west->ops.prescribe)(west, x->space, 0.));
  for (PetscInt k = 0; k < x->space->nfixed; k++) {
    const PetscBool low =
      x->space->node_x[3 * x->space->fixed_node[k] + 2] < 1e-9 ? PETSC_TRUE : PETSC_FALSE;

    for (int c = 0; c < 3; c++)
      SB_CHECK_NEAR(x->space->fixed_value[3 * k + c], low && c != 1 ? 10 : 0, 0,
                    "prescribed value");
  }
  PetscCall(PetscMalloc1(3 * x->space->nnode, &residual));
  for (PetscInt i = 0; i < 3 * x->space->nnode; i++)
    residual[i] = 1 + (PetscReal)(i % 3);
  PetscCall((*bottom->ops.history)(bottom, x->space, &stage, residual, force));
  PetscCall((*west->ops.history)(west, x->space, &stage, residual, force + 4));
  PetscCallMPI(MPI_Allreduce(force, all, 8, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all[0], side, 0, "bottom, x");
  SB_CHECK_NEAR(all[1], 0, 0, "bottom, y");
  SB_CHECK_NEAR(all[2], side * 3, 0, "bottom, z");
  SB_CHECK_NEAR(all[4], side - shared, 0, "west, x");
  SB_CHECK_NEAR(all[5], side * 2, 0, "west, y");
  SB_CHECK_NEAR(all[6], (side - shared) * 3, 0, "west, z");
  PetscCall(PetscFree(residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  const PetscBool p1 = element[0] == 'p' ? PETSC_TRUE : PETSC_FALSE;
  SbEffect bottom, west, edge;
  Fixture x;
  PetscInt n;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(effect_create(
    &x, "prescribed_displacement",
    "-effect_prescribed_displacement_on bottom -effect_prescribed_displacement_components xz "
    "-effect_prescribed_displacement_displacement 10;10;10",
    &bottom));
  PetscCall(count(&x, &n));
  SB_CHECK_NEAR(n, p1 ? 18 : 16, 0, "unknowns of the bottom");
  PetscCall(
    effect_create(&x, "fixed", "-effect_fixed_on west -effect_fixed_components xyz", &west));
  PetscCall(count(&x, &n));
  SB_CHECK_NEAR(n, p1 ? 18 + 9 * 3 - 3 * 2 : 16 + 8 * 3, 0,
                "unknowns of the west side without the bottom's");

  /* all local nodes, ghosts included, have the bits of their position */
  for (PetscInt i = 0; i < x.space->nnode; i++) {
    const PetscReal *X = &x.space->node_x[3 * i];
    const int expected = (X[2] < 1e-9 ? 5 : 0) | (X[0] < 1e-9 ? 7 : 0);

    SB_CHECK(x.space->fixed[i] == expected, "bits %d at (%g, %g, %g), expected %d",
             x.space->fixed[i], X[0], X[1], X[2], expected);
  }
  SB_CHECK_ERROR(
    effect_create(&x, "edge",
                  "-effect_edge_type fixed -effect_edge_on edge -effect_edge_components xz", &edge),
    PETSC_ERR_USER_INPUT, p1 ? "-effect_edge_on" : "body block");
  PetscCall(SbSpacePrescribeDone(x.space));
  PetscCall(check_values(&x, bottom, west));
  PetscCall(SbEffectDestroy(&bottom));
  PetscCall(SbEffectDestroy(&west));
  PetscCall(SbEffectDestroy(&edge));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The support of a DG face is prescribed, whichever effect is first, and the node of the cell is
   free. */
static PetscErrorCode check_supports(void)
{
  Fixture x;
  SbEffect hold[2];
  PetscInt n[2];
  PetscInt supports = 0;

  PetscFunctionBeginUser;
  fixture_use("dg", "dg", PETSC_TRUE);
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(
    effect_create(&x, "fixed", "-effect_fixed_on bottom -effect_fixed_components z", &hold[0]));
  PetscCall(count(&x, &n[0]));
  PetscCall(effect_create(
    &x, "edge", "-effect_edge_type fixed -effect_edge_on bottom -effect_edge_components xyz",
    &hold[1]));
  PetscCall(count(&x, &n[1]));
  SB_CHECK(n[0] == 8 && n[1] == 24, "z of the first, the rest of the second: %d, %d unknowns",
           (int)n[0], (int)n[1]);
  for (PetscInt i = 0; i < 4 * x.mesh->ncell; i++) {
    const PetscInt own = x.space->cell_node[i];
    const PetscInt node = x.space->dirichlet_node[i];

    SB_CHECK(!x.space->fixed[own], "a cell's own node is constrained");
    if (node < 0)
      continue;
    supports += i < 4 * x.mesh->ncell_owned;
    SB_CHECK(x.space->fixed[node] == 7 && x.space->node_mass[node] == 0,
             "a support is free or heavy");
    SB_CHECK_NEAR(x.space->node_x[3 * node + 2], 0, 0, "place of a support");
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &supports, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(supports == 8 && x.space->Nnode == 4 * x.mesh->Ncell + 8, "%d supports", (int)supports);
  PetscCall(SbSpaceValidate(x.space));
  for (int i = 0; i < 2; i++)
    PetscCall(SbEffectDestroy(&hold[i]));
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
