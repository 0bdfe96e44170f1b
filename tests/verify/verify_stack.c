// @ranks 1 2
/*
  Five blocks of very different masses and meshes fall onto each other and come to rest.

  At rest each interface carries the weight above it, as given by the field of contact forces (on
  each body), by the history of the floor and by that of the bodies (the sum over all interfaces).
  There is no motion and no penetration.

    smooth   without friction, a quarter of the stack between its symmetry planes: a free one would
    slide apart at the
             smallest perturbation, as a real one would
    rough    with friction 0.5, blocks rotated and off the centre
*/
#include "contact.h"

#define G 9.81
#define BLOCKS 5
#define GUIDED                                                                                     \
  "-sets x0,y0 -set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -effects gravity,floor,meet,x,y " \
  "-effect_x_type fixed -effect_x_on x0 -effect_x_components x -effect_y_type fixed -effect_y_on " \
  "y0 "                                                                                            \
  "-effect_y_components y"

typedef struct {
  PetscReal size[3]; /* m */
  PetscInt cells[3];
  PetscReal density;         /* kg/m^3 */
  PetscReal turn, centre[2]; /* of the rough stack: rotation about z, degrees; position, m */
} Block;

/* From below: masses of 0.58, 0.3, 3, 0.31 and 0.96 kg. */
static const Block blocks[BLOCKS] = {{{0.12, 0.12, 0.04}, {3, 3, 2}, 1000, 0, {0, 0}},
                                     {{0.1, 0.1, 0.03}, {2, 2, 1}, 1000, 10, {0.003, 0}},
                                     {{0.094, 0.094, 0.034}, {3, 3, 1}, 10000, -7, {-0.004, 0.003}},
                                     {{0.08, 0.08, 0.04}, {2, 2, 2}, 1200, 20, {0, -0.005}},
                                     {{0.075, 0.075, 0.034}, {4, 4, 1}, 5000, 33, {0.006, 0.004}}};

/* Options of the bodies, with a gap of 0.3 mm below each. */
static PetscErrorCode write_blocks(PetscBool rough, size_t size, char text[])
{
  PetscReal z = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(text, "-bodies b0,b1,b2,b3,b4", size));
  for (int k = 0; k < BLOCKS; k++) {
    const Block *b = &blocks[k];
    const PetscReal angle = rough ? b->turn * PETSC_PI / 180 : 0;
    const PetscReal c = PetscCosReal(angle);
    const PetscReal s = PetscSinReal(angle);
    const PetscReal half[2] = {0.5 * b->size[0], 0.5 * b->size[1]};
    const PetscReal x = rough ? b->centre[0] - c * half[0] + s * half[1] : 0;
    const PetscReal y = rough ? b->centre[1] - s * half[0] - c * half[1] : 0;
    char one[512];

    z += 0.0003;
    PetscCall(PetscSNPrintf(
      one, sizeof(one),
      " -body_b%d_mesh box:%g,%g,%g:%d,%d,%d -body_b%d_rotate 0,0,1,%g -body_b%d_translate "
      "%.15g,%.15g,%g "
      "-body_b%d_material corotated -body_b%d_young 1e6 -body_b%d_poisson 0.3 -body_b%d_density %g",
      k, b->size[0], b->size[1], b->size[2], (int)b->cells[0], (int)b->cells[1], (int)b->cells[2],
      k, rough ? b->turn : 0, k, x, y, z, k, k, k, k, b->density));
    PetscCall(PetscStrlcat(text, one, size));
    z += b->size[2];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores the displacement at a given time. */
typedef struct {
  PetscReal since; /* s */
  Vec U;           /* m */
} Since;

static PetscErrorCode keep(SbRun run, const SbStep *step, void *ctx)
{
  Since *s = (Since *)ctx;

  PetscFunctionBeginUser;
  (void)run;
  if (s->U || step->t < s->since)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(step->U, &s->U));
  PetscCall(VecCopy(step->U, s->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* slow: bound of the speed at the end, m/s. */
static PetscErrorCode check_stack(PetscReal friction, PetscReal slow)
{
  const PetscReal end = friction > 0 ? 0.8 : 1;
  const PetscReal size = 0.12;
  Since at = {.since = 0.8 * end};
  Record r = {.g = G};
  PetscReal force[3 * BLOCKS], mass[BLOCKS];
  PetscReal carried = 0;
  PetscReal weight = 0;
  PetscReal sum = 0;
  PetscReal drift;
  PetscReal vertical = 0;
  PetscReal sideways = 0;
  char bodies[VERIFY_TEXT / 2];
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("stack, friction %g", friction);
  PetscCall(write_blocks((PetscBool)(friction > 0), sizeof(bodies), bodies));
  PetscCall(test_open(
    &t,
    "%s %s -effect_floor_type contact -effect_floor_on b0 -effect_floor_obstacle plane:0,0,1,0 "
    "-effect_floor_friction %g -effect_meet_type contact -effect_meet_friction %g -time "
    "euler_implicit -ts_dt 0.01 -ts_max_time %g -snes_rtol 1e-10 -ksp_rtol 1e-9",
    bodies, friction > 0 ? "-effects gravity,floor,meet" : GUIDED, friction, friction, end));
  PetscCall(SbRunAddMonitor(t.run, keep, &at));
  PetscCall(record_solve(&t, &r));
  PetscCall(VecAXPY(at.U, -1, t.run->state.U));
  PetscCall(VecNorm(at.U, NORM_INFINITY, &drift));
  PetscCall(VecDestroy(&at.U));

  /* net contact forces against weights, interface by interface from above, relative to the weight
     there */
  PetscCall(contact_body_forces(t.run, end, force));
  PetscCall(contact_body_masses(t.model, mass));
  for (int k = BLOCKS - 1; k >= 0; k--) {
    carried += force[3 * k + 2];
    weight += G * mass[k];
    if (k > 0)
      sum += weight; /* the floor is another effect */
    vertical = PetscMax(vertical, PetscAbsReal(carried / weight - 1));
    for (int i = 0; i < 2; i++)
      sideways = PetscMax(sideways, PetscAbsReal(force[3 * k + i]) / (G * mass[k]));
  }
  PetscCall(test_scene_close(&t));
  weight = G * r.mass;
  VERIFY_LESS(vertical, 1e-3, "force of an interface against the weight above, off by");
  if (friction > 0)
    VERIFY_LESS(sideways, 1e-3, "force on a block sideways, of its weight");
  VERIFY_NEAR(record_last(&r, "floor_force_z") / weight, 1, 1e-3,
              "force of the floor against the weight");
  VERIFY_NEAR(record_last(&r, "meet_normal_force") / sum, 1, 2e-3,
              "normal forces in the history against the weights");
  VERIFY_LESS(record_last(&r, "speed"), slow, "fastest node, m/s");

  /* sticking contacts creep with less than 1e-3 of the size per second */
  VERIFY_LESS(drift, (friction > 0 ? 1e-4 : 1e-5) * size, "motion at rest, m");
  VERIFY_LESS(record_max(&r, "floor_penetration"), 1e-6 * size, "behind the floor, m");
  VERIFY_NEAR(record_max(&r, "meet_penetration"), 0, 0, "in each other, m");
  SB_CHECK(record_starts(&r, "floor_contacts") >= 1, "the blocks did not fall");
  VERIFY_MORE(record_max(&r, "meet_contacts"), 20, "pairs");
  VERIFY_MORE(record_max(&r, "floor_force_z"), 1.2 * weight, "largest force of the floor, N");
  if (friction > 0) /* the guides of the other one push, too */
    VERIFY_LESS(record_max(&r, "missing"), 1e-4, "momentum that no force explains, kg m/s");
  VERIFY_LESS(record_gain(&r, "energy"), 1e-6, "largest gain of a step, J");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_stack(0, 5e-4));
  if (test_size > 1)
    SB_TEST_END(); /* many solves of a small system: on one rank only */
  PetscCall(check_stack(0.5, 1e-4));
  SB_TEST_END();
}
