/*
  Torque: no resultant, its moment on each body that it is for, with every element and in a deformed
  shape; the same on nodes of other ranks; the forces of an angular acceleration. Static runs refuse
  it.
*/
// @ranks 1 3
#include "effect_fixture.h"

#define OPTIONS "-effect_turn_type torque -effect_turn_vector 3;0-4*t;5 -effect_turn_time 1+t"

/* Resultant and moments on one body and on both, at two times and in a deformed shape. */
static PetscErrorCode check_moments(FixturePair *p, const char *on, PetscReal bodies)
{
  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    const PetscReal t = 0.5 * k;
    const PetscReal factor = bodies * (1. + t);
    const PetscReal M[3] = {3. * factor, -4. * t * factor, 5. * factor};
    Fixture *const x[2] = {&p->all, &p->alone};

    for (int i = 0; i < 2; i++) {
      SbEffect e;

      deform(x[i], 0.2 * k);
      PetscCall(PetscOptionsInsertString(NULL, OPTIONS));
      PetscCall(PetscOptionsInsertString(NULL, on));
      PetscCall(SbEffectCreate("turn", &e));
      e->dynamic = PETSC_TRUE;
      PetscCall((*e->ops.setup)(e, x[i]->space));
      SB_CHECK(!e->steady && !e->linear && e->no_potential, "the force follows the body");
      PetscCall(effect_force(x[i], e, t));
      PetscCall(SbEffectDestroy(&e));
    }
    PetscCall(check_resultant(&p->all, (const PetscReal[3]){0., 0., 0.}, M, 1e2, on));
    PetscCall(check_serial(&p->all, &p->alone, 1e2, on));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[][2] = {
    {"p1", "p1"}, {"cr", "cr"}, {"dg", "p1"}, {"cr", "dg"}, {"p2", "cr"}};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  for (int k = 0; k < 5; k++) {
    FixturePair p;

    fixture_use(elements[k][0], elements[k][1], PETSC_FALSE);
    PetscCall(fixture_pair_create(2, 0, NULL, &p));
    PetscCall(check_moments(&p, "-effect_turn_on block,other", 2.));
    PetscCall(check_moments(&p, "-effect_turn_on other", 1.));
    if (k == 0)
      PetscCall(check_effect_refused(&p.all, "turn", OPTIONS " -effect_turn_on block", "static"));
    PetscCall(fixture_pair_destroy(&p));
  }
  SB_TEST_END();
}
