// @ranks 1 2
/*
  Two cubes that begin half in each other, which no reach of contact sees at once: the depth is found, taken back by the option's steps, and
  the bodies part with no more than twice the energy M v^2 of a bar that is pushed with the speed v at which it is taken back. Momentum stays. A
  body that begins within reach of the other but not in it is not touched.
*/
#include "../../src/effect/collision.h"
#include "contact.h"

#define SIZE 0.1
#define DEPTH 0.05
#define STEP 0.004
#define STEPS 30 /* of recovery */

typedef struct {
  PetscReal first, depth, energy, momentum, torque; /* depth after a step and after STEPS of them, m */
  PetscReal contacts;
} Overlap;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Overlap *o = (Overlap *)ctx;
  PetscReal depth, contacts;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  o->energy = PetscMax(o->energy, e.kinetic + e.strain);
  for (int k = 0; k < 3; k++) o->momentum = PetscMax(o->momentum, PetscAbsReal(e.momentum[k]));
  PetscCall(contact_column(run, step->t, "meet", "penetration", &depth));
  PetscCall(contact_column(run, step->t, "meet", "contacts", &contacts));
  if (step->step == 1) o->first = depth;
  if (step->step == STEPS) o->depth = depth;
  o->contacts = contacts;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, const char *detection, PetscReal shift)
{
  const PetscReal v = DEPTH * (1 - PetscExpReal(-1. / STEPS)) / STEP, mass = 2 * 1000 * PetscPowReal(SIZE, 3);
  const PetscBool apart = (PetscBool)(shift >= SIZE), vertices = (PetscBool)(element[0] == 'p');
  Overlap o = {.first = 0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:3 -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate %g,0,0 "
    "-body_a_material corotated -body_a_young 1e5 -body_a_poisson 0.3 -body_a_element %s "
    "-body_b_material corotated -body_b_young 1e5 -body_b_poisson 0.3 -body_b_element %s "
    "-effects meet -effect_meet_type collision -effect_meet_detection %s -effect_meet_recovery %d "
    "-time euler_implicit -ts_dt %g -ts_max_time 0.48 -snes_rtol 1e-9",
    (double)shift, element, element, detection, STEPS, STEP));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &o, NULL));
  PetscCall(verify_solve(&t, "overlap"));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  %s, %s, %g m apart: %.3f of the depth after a step, %.3f after %d, energy %.3g J of %.3g "
                "allowed, momentum %.1e, %g pairs at the end\n",
                element, detection, (double)shift, (double)(o.first / DEPTH), (double)(o.depth / DEPTH),
                STEPS, (double)o.energy, (double)(mass * v * v), (double)o.momentum, (double)o.contacts));
  SB_CHECK(o.contacts == 0, "%g pairs still touch", (double)o.contacts);
  SB_CHECK(o.momentum < 1e-9, "momentum %g kg m/s", (double)o.momentum);
  if (apart)
    SB_CHECK(o.energy < 1e-20, "bodies that do not touch get %g J", (double)o.energy);
  else {
    /* corners move out by the sides, too: less than the whole depth is left */
    if (vertices) SB_CHECK_NEAR(o.first / DEPTH, PetscExpReal(-1. / STEPS), 0.02, "depth after a step");
    SB_CHECK(o.first > 0.5 * DEPTH && o.depth < 0.6 * DEPTH, "%g m, then %g m deep", (double)o.first,
             (double)o.depth);
    SB_CHECK(o.energy < 2 * mass * v * v && o.energy > 0.01 * mass * v * v, "energy %g J", (double)o.energy);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("p1", "hash", DEPTH));
  PetscCall(check("p1", "bvh", DEPTH));
  PetscCall(check("cr", "hash", DEPTH));
  PetscCall(check("p1", "hash", SIZE + 0.001));
  SB_TEST_END();
}
