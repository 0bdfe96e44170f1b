// @ranks 1 2
/*
  Two cubes that begin half in each other, which no reach of contact sees at once: the depth is found, all points get the same way out (a smaller cube
  in a face: ways to one side), the depth is taken back by the option's steps, and
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
  PetscReal contacts, agreement, pairs;
} Overlap;

/* The least cosine between the normal of a pair that is behind and the mean one of the same body, after the first step. */
static PetscErrorCode agreement(SbRun run, PetscReal *least, PetscReal *pairs)
{
  const Collision *c = (const Collision *)contact_effect(run->model, "meet")->data;
  PetscReal mean[6] = {0};

  PetscFunctionBeginUser;
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
      const Hit *hit = &c->hit[i];
      PetscReal *m = mean + 3 * c->surface->scene.point_part[hit->point];

      if (hit->gap > -0.1 * DEPTH) continue;
      *pairs += !pass;
      if (pass)
        *least = PetscMin(*least, SbDot3(m, hit->normal) / PetscSqrtReal(SbDot3(m, m)));
      else
        for (int k = 0; k < 3; k++) m[k] += hit->normal[k];
    }
    if (!pass) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mean, 6, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, least, 1, MPIU_REAL, MPI_MIN, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, pairs, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  if (step->step == 1) {
    o->first = depth;
    PetscCall(agreement(run, &o->agreement, &o->pairs));
  }
  if (step->step == STEPS) o->depth = depth;
  o->contacts = contacts;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, const char *detection, PetscReal shift, const char *turn)
{
  const PetscReal v = DEPTH * (1 - PetscExpReal(-1. / STEPS)) / STEP, mass = 2 * 1000 * PetscPowReal(SIZE, 3);
  const PetscBool apart = (PetscBool)(shift >= SIZE), vertices = (PetscBool)(element[0] == 'p');
  Overlap o = {.agreement = 1};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:3 -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate %g,0,0 %s "
    "-body_a_material corotated -body_a_young 1e5 -body_a_poisson 0.3 -body_a_element %s "
    "-body_b_material corotated -body_b_young 1e5 -body_b_poisson 0.3 -body_b_element %s "
    "-effects meet -effect_meet_type collision -effect_meet_detection %s -effect_meet_recovery %d "
    "-time euler_implicit -ts_dt %g -ts_max_time 0.48 -snes_rtol 1e-9",
    (double)shift, turn, element, element, detection, STEPS, STEP));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &o, NULL));
  PetscCall(verify_solve(&t, "overlap"));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  %s, %s, %g m apart: %.3f of the depth after a step, %.3f after %d, energy %.3g J of %.3g "
    "allowed, momentum %.1e, cosine %.2f, %g pairs at the end\n",
    element, detection, (double)shift, (double)(o.first / DEPTH), (double)(o.depth / DEPTH), STEPS,
    (double)o.energy, (double)(mass * v * v), (double)o.momentum, (double)o.agreement, (double)o.contacts));
  SB_CHECK(o.contacts == 0, "%g pairs still touch", (double)o.contacts);
  SB_CHECK(o.momentum < 1e-9, "momentum %g kg m/s", (double)o.momentum);
  if (apart)
    SB_CHECK(o.energy < 1e-20, "bodies that do not touch get %g J", (double)o.energy);
  else {
    /* corners move out by the sides, too: less than the whole depth is left */
    /* ways out lead to one side; the nearest places do to all */
    SB_CHECK(o.agreement > 0.2 && o.pairs > 4, "normals differ: cosine %g", (double)o.agreement);
    if (vertices && !turn[0])
      SB_CHECK_NEAR(o.first / DEPTH, PetscExpReal(-1. / STEPS), 0.02, "depth after a step");
    SB_CHECK(o.first > 0.5 * DEPTH && o.depth < 0.6 * o.first, "%g m, then %g m deep", (double)o.first,
             (double)o.depth);
    SB_CHECK(o.energy < 2 * mass * v * v && o.energy > 0.01 * mass * v * v, "energy %g J", (double)o.energy);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("p1", "hash", DEPTH, ""));
  PetscCall(
    check("p1", "brute", 0.07,
          "-body_b_mesh box:0.06,0.06,0.06:2 -body_b_translate 0.06,0.02,0.03 -body_b_rotate 1,2,3,5"));
  PetscCall(check("p1", "bvh", DEPTH, "-effect_meet_self yes"));
  PetscCall(check("cr", "hash", DEPTH, ""));
  PetscCall(check("p1", "hash", SIZE + 0.001, ""));
  SB_TEST_END();
}
