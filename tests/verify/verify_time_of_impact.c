// @ranks 1 2
/*
  Time of impact within a step (-effect_<name>_time_of_impact). An elastic bar hits a wall: in the
  wave solution the contact lasts for the time 2 L / c from the impact, and the rebound speed is the
  initial one. Runs begin at several distances from the wall, so that the impact is at different
  times within a step.

    wall        a rigid wall: time of first contact, duration and rebound speed, without and with
    steps divided at the impact, with every response; a divided
                step and its remainder end at the time of the undivided one
    bounds      steps are not divided if the impact is near one of their ends, or if there is none
*/
#include "contact.h"

#define SPEED 0.1 /* m/s; the bar is 1 m long, its waves run at 10 m/s */
#define FORCE 2.5 /* N, of the wave solution: rho c v A */
#define PHASES 5  /* on one rank; on several ranks one suffices */

typedef struct {
  PetscReal first, last, velocity, gain; /* span of contact, s; at the end, m/s; of a step, J */
  PetscInt off, solves, steps;           /* off: number of steps that end off the grid of ts_dt */
} Impact;

#define BAR                                                                             \
  "-bodies a -body_a_mesh box:1,0.05,0.05:1 -body_a_material linear -body_a_young 1e5 " \
  "-body_a_poisson 0 "                                                                  \
  "-body_a_density 1000 -body_a_velocity %g,0,0 -body_a_translate %.15g,0,0 -ts_dt %g " \
  "-ts_max_time %g "                                                                    \
  "-ksp_rtol 1e-10 -snes_rtol 1e-10 -effects "
#define WALL                                                                             \
  "wall -effect_wall_type contact -effect_wall_response projected -effect_wall_on xmin " \
  "-effect_wall_obstacle plane:1,0,0,0 "
/* A bar that starts `phase` steps before the impact. */
static PetscErrorCode fly(const char *more, PetscReal phase, PetscReal dt, PetscReal end, Impact *b)
{
  Record r = {0};

  PetscFunctionBeginUser;
  PetscCall(record_run(&r, BAR WALL "%s", (double)-SPEED, (double)(SPEED * phase * dt), (double)dt,
                       (double)end, more));
  *b = (Impact){.velocity = record_last(&r, "a_vx"),
                .gain = record_gain(&r, "energy"),
                .solves = r.newton,
                .steps = r.steps};
  record_span(&r, "wall_force_x", 1e-6 * FORCE, &b->first, &b->last);
  for (PetscInt i = 0; i < r.n; i++) {
    const PetscReal step = record_at(&r, "t", i) / dt;

    b->off += PetscAbsReal(step - PetscFloorReal(step + 0.5)) > 1e-6;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt phases = PHASES;

/* Largest errors over the phases, sums of counts. */
typedef struct {
  PetscReal first, duration, velocity; /* s, s, of the speed */
  PetscInt solves, steps, off;
} Errors;

static PetscErrorCode measure(const char *more, PetscReal dt, PetscReal end, Errors *e)
{
  PetscFunctionBeginUser;
  *e = (Errors){0};
  for (int k = 0; k < phases; k++) {
    const PetscReal phase = 10.9 - 0.2 * k;
    Impact b;

    PetscCall(fly(more, phase, dt, end, &b));
    e->first = PetscMax(e->first, PetscAbsReal(b.first - phase * dt));
    e->duration = PetscMax(e->duration, PetscAbsReal(b.last - b.first - 0.2));
    e->velocity = PetscMax(e->velocity, PetscAbsReal(b.velocity / SPEED - 1));
    e->solves += b.solves;
    e->steps += b.steps;
    e->off += b.off;
    SB_CHECK(b.gain < 1e-12, "%s: a step gains %g J", more, b.gain);
  }
  test_print("  %-50s dt %5.2g s: first touch off by %.3f steps, duration by %.2f ms, speed after "
             "by %.4f; %d solves, %d steps\n",
             more, dt, e->first / dt, 1e3 * e->duration, e->velocity, (int)e->solves,
             (int)e->steps);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Undivided steps give the time of impact to within a step; divided ones give it accurately, with
   one more step and a few solves per impact. */
static PetscErrorCode check(const char *response, PetscReal dt)
{
  const PetscReal end = 0.24 + 12 * dt;
  char more[128];
  Errors whole, cut;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(more, sizeof(more), "-effect_wall_time_of_impact no %s", response));
  PetscCall(measure(more, dt, end, &whole));
  PetscCall(PetscSNPrintf(more, sizeof(more), "-effect_wall_time_of_impact yes %s", response));
  PetscCall(measure(more, dt, end, &cut));
  SB_CHECK(whole.first > 0.8 * dt && whole.first < dt,
           "%s: whole steps find the first touch to %g s", more, whole.first);
  SB_CHECK(cut.first < 1e-4 * dt, "%s: cut steps find the first touch to %g s", more, cut.first);
  SB_CHECK(cut.duration < 0.6 * whole.duration && cut.duration < 0.6 * dt,
           "%s: duration off by %g, whole by %g", more, cut.duration, whole.duration);
  SB_CHECK(cut.velocity < whole.velocity + 1e-3, "%s: speed after off by %g, whole by %g", more,
           cut.velocity, whole.velocity);
  SB_CHECK(cut.steps == whole.steps + phases, "%s: %d steps, whole %d", more, (int)cut.steps,
           (int)whole.steps);
  SB_CHECK(!strstr(response, "augmented") ? cut.solves <= whole.solves + 6 * phases : 1,
           "%s: %d solves, whole %d", more, (int)cut.solves, (int)whole.solves);
  SB_CHECK(whole.off == 0 && cut.off == phases, "%s: %d and %d steps end beside the grid", more,
           (int)whole.off, (int)cut.off);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const PetscReal phase[] = {3.02, 3.98, 1000};
  Impact b;

  SB_TEST_BEGIN(argc, argv);
  if (test_size > 1)
    phases = 1;
  PetscCall(check("", 0.005));

  /* points that arrive near the ends of a step, and none that arrive: no division */
  for (int k = 0; k < 3; k++) {
    PetscCall(fly("-effect_wall_time_of_impact yes", phase[k], 0.002, 0.02, &b));
    SB_CHECK(b.off == 0 && b.steps == 10,
             "%g steps before the wall: %d steps, %d of them beside the grid", phase[k],
             (int)b.steps, (int)b.off);
    SB_CHECK((b.first > 0) == (k < 2), "%g steps before the wall: first touch at %g s", phase[k],
             b.first);
  }
  if (test_size == 1) {
    PetscCall(check("", 0.002));
    PetscCall(check("-effect_wall_response penalty -effect_wall_stiffness 1000", 0.002));
    PetscCall(check("-effect_wall_response augmented", 0.002));
    PetscCall(check("-effect_wall_response multiplier", 0.002));
  }
  SB_TEST_END();
}
