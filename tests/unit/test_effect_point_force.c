/*
  Point force: the total on one vertex and on a face, shares of the nodes; the work is that of the
  vertex, whose displacement is averaged over the adjacent cells; time; independence of the number
  of ranks; every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {{"top", "plane:0,0,1,1"}, {"tip", "sphere:1,1,1,0.1"}};

/* Work of x->f on a displacement: that of the force G at the vertex at X, taken from the cells
   there. */
static PetscErrorCode check_work(Fixture *x, const PetscReal X[3], const PetscReal G[3])
{
  const SbSpace s = x->space;
  PetscReal sum[5] = {0}, all[5], expected = 0; // mean displacement, its weight; work

  PetscFunctionBeginUser;

  // Numbers without order, the same on every number of ranks.
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    const PetscInt number = s->node_orig[i / 3];

    sum[4] += x->f[i] * PetscSinReal((PetscReal)(i % 3 + 1) * (PetscReal)number);
  }
  for (PetscInt cell = 0; cell < x->mesh->ncell_owned; cell++) {
    const PetscReal volume = 1.0 / 48; // all tets of the box are alike

    for (int k = 0; k < 4; k++) {
      const PetscReal *at = &x->mesh->x[3 * x->mesh->cell[4 * cell + k]];

      if (PetscAbsReal(at[0] - X[0]) + PetscAbsReal(at[1] - X[1]) + PetscAbsReal(at[2] - X[2]) >
          1e-9)
        continue;
      sum[3] += volume;
      for (int a = 0; a < 4; a++) {
        const PetscInt number = s->node_orig[s->cell_node[4 * cell + a]];

        for (int c = 0; c < 3; c++)
          sum[c] += volume * SbSpaceCellElement(s, cell)->ops.vertex[k][a] *
                    PetscSinReal((PetscReal)(c + 1) * (PetscReal)number);
      }
    }
  }
  PetscCallMPI(MPI_Allreduce(sum, all, 5, MPIU_REAL, MPI_SUM, s->comm));
  for (int c = 0; c < 3; c++)
    expected += G[c] * all[c] / all[3];
  SB_CHECK_NEAR(all[4], expected, 1e-12, "work of a force on a vertex");
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define LIFT "-effect_lift_type point_force -effect_lift_on tip,top -effect_lift_vector 9;-18;27"
#define POKE                                                                       \
  "-effect_poke_type point_force -effect_poke_on tip -effect_poke_vector 0;3*t;0 " \
  "-effect_poke_time t"

static const LoadCase cases[] = {
  /* the nodes of the top are symmetric about (.5, .5, 1) */
  {"lift", LIFT, PETSC_TRUE, 0, 30, {9, -18, 27}, {0.5 * 27 + 18, 9 - 0.5 * 27, -9 - 4.5}, 0},
  {"poke", POKE, PETSC_FALSE, 2, 12, {0, 12, 0}, {-12, 0, 12}, 0}};

static PetscErrorCode check_element(const char *element, PetscBool held)
{
  FixturePair p;
  Fixture *x = &p.all;
  SbEffect lift;

  PetscFunctionBeginUser;
  fixture_use(element, element, held);
  PetscCall(fixture_pair_create(1, PETSC_STATIC_ARRAY_LENGTH(sets), sets, &p));
  PetscCall(check_loads(&p, PETSC_STATIC_ARRAY_LENGTH(cases), cases));
  PetscCall(
    check_work(x, (const PetscReal[3]){1, 1, 1}, cases[1].F)); /* of the force of the last case */

  // With nodes at vertices each of the nine has the same share.
  PetscCall(effect_create(x, "lift", LIFT, &lift));
  PetscCall(effect_force(x, lift, 0));
  for (PetscInt i = 0; !strcmp(element, "p1") && i < x->space->nnode_owned; i++)
    SB_CHECK_NEAR(x->f[3 * i + 2], x->space->node_x[3 * i + 2] > 1 - 1e-9 ? 3 : 0, 1e-14,
                  "share of a node");
  PetscCall(SbEffectDestroy(&lift));
  PetscCall(check_effect_refused(
    x, "bad", "-effect_bad_type point_force -effect_bad_on tip -effect_bad_vector 0;x;0",
    "-effect_bad_vector"));
  PetscCall(fixture_pair_destroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1", PETSC_FALSE));
  PetscCall(check_element("cr", PETSC_FALSE));
  PetscCall(check_element("dg", PETSC_FALSE));
  PetscCall(check_element("dg", PETSC_TRUE));
  PetscCall(check_element("p2", PETSC_FALSE));
  SB_TEST_END();
}
