/*
  Fixed support: constrained unknowns, their value zero, and the reaction: the residual of a body
  under its weight, so that the support carries the weight at its nodes; every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {{"bottom", "plane:0,0,1,0"}, {"all", "box:-1,-1,-1,2,2,2"}};

static PetscErrorCode history(Fixture *x, SbEffect e, PetscReal all[3])
{
  const SbStage stage = {.u = x->u};
  PetscReal mine[3];

  PetscFunctionBeginUser;
  PetscCall((*e->ops.history)(e, x->space, &stage, x->f, mine));
  PetscCallMPI(MPI_Allreduce(mine, all, 3, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element, PetscReal low)
{
  Fixture x;
  SbEffect roll, rest, weight;
  PetscReal R[3];
  PetscBool same;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(effect_create(
    &x, "roll", "-effect_roll_type fixed -effect_roll_on bottom -effect_roll_components z", &roll));
  PetscCall(effect_create(&x, "rest", "-effect_rest_type fixed -effect_rest_on all", &rest));
  PetscCall(SbSpacePrescribeDone(x.space));
  SB_CHECK(roll->linear && roll->steady && !roll->ops.force && !roll->ops.tangent,
           "a support is no force");
  SB_CHECK(roll->ncolumn == 3, "columns");
  PetscCall(PetscStrcmp(roll->column[2], "reaction_z", &same));
  SB_CHECK(same, "column %s", roll->column[2]);
  for (PetscInt i = 0; i < x.space->nnode; i++)
    SB_CHECK(x.space->fixed[i] == 7, "every unknown is constrained");

  // Values are overwritten by zeros, each by its owner.
  for (PetscInt i = 0; i < 3 * x.space->nfixed; i++)
    x.space->fixed_value[i] = 1;
  PetscCall((*roll->ops.prescribe)(roll, x.space, 0));
  for (PetscInt k = 0; k < x.space->nfixed; k++) {
    const PetscBool at =
      x.space->node_x[3 * x.space->fixed_node[k] + 2] < 1e-9 ? PETSC_TRUE : PETSC_FALSE;

    SB_CHECK(x.space->fixed_value[3 * k] == 1 && x.space->fixed_value[3 * k + 2] == (at ? 0 : 1),
             "values of the first support");
  }
  PetscCall((*rest->ops.prescribe)(rest, x.space, 0));
  for (PetscInt i = 0; i < 3 * x.space->nfixed; i++)
    SB_CHECK(x.space->fixed_value[i] == 0, "values of both supports");

  // Residual of a body in its reference state under its weight: minus the load. Both supports
  // together carry 1200 kg.
  PetscCall(effect_create(&x, "gravity", "", &weight));
  PetscCall(effect_force(&x, weight, 0));
  for (PetscInt i = 0; i < 3 * x.space->nnode; i++)
    x.f[i] = -x.f[i];
  PetscCall(history(&x, roll, R));
  SB_CHECK_NEAR(R[0], 0, 0, "sideways");
  SB_CHECK_NEAR(R[2], DENSITY * 9.81 * low, 1e-9, "reaction of the bottom");
  PetscCall(history(&x, rest, R));
  SB_CHECK_NEAR(R[2], DENSITY * 9.81 * (1 - low), 1e-9, "reaction of the rest");

  PetscCall(SbEffectDestroy(&weight));
  PetscCall(SbEffectDestroy(&roll));
  PetscCall(SbEffectDestroy(&rest));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());

  // In a box with this subdivision the lowest layer of vertices has a quarter of the mass: half of
  // the lower of two layers.
  PetscCall(check_element("p1", 0.25));

  // Eight tets of 48 have a face at the bottom, which has a quarter of their mass.
  PetscCall(check_element("cr", 8.0 / 48 / 4));
  PetscCall(check_element("dg", 8.0 / 48 / 4));
  SB_TEST_END();
}
