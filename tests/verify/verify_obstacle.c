// @ranks 1 2
// @timeout 200
/*
  Rigid obstacles given by a mesh, and bodies that overlap an obstacle at first.

    mesh       a block that falls on a box and slides over its edge moves as well when the box is a mesh of tets
    overlap    a block that begins 30 % of its height behind a plane is brought out: how fast, how deep it still is after
               1 and 5 times `recovery`, and what energy it gets; with every response and element
    at_once    a static run closes the same overlap in its first step
*/
#include "verify.h"

enum { FX, FY, FZ, TX, TY, TZ, CONTACTS, PENETRATION, NVALUE };

static SbEffect find_contact(SbModel m)
{
  for (PetscInt e = 0; e < m->neffect; e++) {
    if (m->effect[e]->ops.touch) return m->effect[e];
  }
  return NULL;
}

/* Columns of the history of the only contact, on every rank. */
static PetscErrorCode contact_values(SbRun run, PetscReal t, PetscReal values[NVALUE])
{
  SbModel m = run->model;
  SbEffect e = find_contact(m);
  SbStage stage = {.t = t, .shift_k = 1};
  const PetscReal *r;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->U, &R));
  PetscCall(SbModelResidual(m, t, run->U, run->V, run->A, PETSC_FALSE, R));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  PetscCall(SbSpaceGetLocalRead(m->space, run->U, &stage.u));
  PetscCall((*e->ops.history)(e, m->space, &stage, r, values));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->U, &stage.u));
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, values, NVALUE, MPIU_REAL, MPI_SUM, m->comm));
  PetscCall(VecDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode open_scene(TestScene *t, const char *format, ...)
{
  char text[VERIFY_TEXT];
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(PetscVSNPrintf(text, sizeof(text), format, NULL, args));
  va_end(args);
  PetscCall(test_scene_open(text, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ mesh */

/* The box of the obstacle, 0.3 x 0.2 x 0.1 m below z = 0. */
static void table(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  (void)n;
  (void)at;
  (void)ctx;
  x[0] = 0.3 * x[0] - 0.2;
  x[1] = 0.2 * x[1] - 0.1;
  x[2] = 0.1 * x[2] - 0.1;
}

typedef struct {
  PetscReal force, most;
} Fall;

static PetscErrorCode watch_fall(SbRun run, const SbStep *step, void *ctx)
{
  Fall *f = (Fall *)ctx;
  PetscReal values[NVALUE];

  PetscFunctionBeginUser;
  PetscCall(contact_values(run, step->t, values));
  f->force = values[FZ];
  f->most = PetscMax(f->most, values[FZ]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fall_on(const char *obstacle, PetscReal *u[], PetscInt *n, Fall *f)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(f, sizeof(*f)));
  PetscCall(open_scene(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.05:2 -body_a_material corotated -body_a_young 2e4 "
    "-body_a_poisson 0.3 -body_a_density 1000 -body_a_rotate 1,2,0,15 -body_a_translate -0.02,-0.047,0.03 "
    "-body_a_velocity 0.5,0,-0.5 -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_obstacle %s -effect_floor_friction 0.2 -time euler_implicit -ts_dt 0.005 "
    "-ts_max_time 0.15 -snes_rtol 1e-12 -ksp_rtol 1e-11",
    obstacle));
  PetscCall(SbRunAddMonitor(t.run, watch_fall, f, NULL));
  PetscCall(verify_solve(&t, obstacle));
  *n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->U, u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_mesh(void)
{
  const PetscInt n[3] = {6, 4, 2};
  PetscReal *u[2], off;
  PetscInt length;
  Fall f[2];
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, table, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(fall_on("box:-0.2,-0.1,-0.1,0.1,0.1,0", &u[0], &length, &f[0]));
  PetscCall(fall_on(text, &u[1], &length, &f[1]));
  off = verify_difference(length, u[0], u[1]);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  mesh: displacements differ by %.1e of the largest; force up to %.3g N, at the end "
                        "%.6g and %.6g N\n",
                        (double)off, (double)f[0].most, (double)f[0].force, (double)f[1].force));
  SB_CHECK(f[0].most > 20, "it hit the box with %g N", (double)f[0].most);
  SB_CHECK(off < 1e-10, "on the mesh of the box displacements differ by %g", (double)off);
  for (int k = 0; k < 2; k++) PetscCall(PetscFree(u[k]));
  PetscCall(verify_mesh_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ overlap */

#define DEPTH 0.03 /* m, of a height of 0.1 */
#define MASS 1.0   /* kg */
#define STEP 0.005 /* s */
#define RECOVERY 30

typedef struct {
  PetscReal speed, energy, depth[2]; /* largest of the steps; depth after 1 and 5 times RECOVERY */
} Overlap;

static PetscErrorCode watch_overlap(SbRun run, const SbStep *step, void *ctx)
{
  Overlap *o = (Overlap *)ctx;
  PetscReal values[NVALUE];
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  o->speed = PetscMax(o->speed, e.max_speed);
  o->energy = PetscMax(o->energy, e.kinetic + e.strain);
  for (int k = 0; k < 2; k++) {
    if (step->step != (k ? 5 : 1) * RECOVERY) continue;
    PetscCall(contact_values(run, step->t, values));
    o->depth[k] = values[PENETRATION];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The lowest nodes begin with the speed v = depth / recovery, 0.2 m/s. A bar that is pushed with v from one end moves with 2 v at the other when the
  wave arrives there, and has the energy M v^2 then: half of it motion, half of it strain. That of its weight is 1e-3 J.
*/
static PetscErrorCode check_overlap(const char *element, const char *response, const char *obstacle)
{
  const PetscReal v = DEPTH * (1 - PetscExpReal(-1. / RECOVERY)) / STEP;
  const PetscBool springs = (PetscBool)(response[0] == 'p' && response[1] == 'e');
  Overlap o;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&o, sizeof(o)));
  PetscCall(open_scene(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material corotated -body_a_young 5e4 "
    "-body_a_poisson 0.3 -body_a_density 1000 -body_a_translate -0.05,-0.05,%g -body_a_element %s -effects "
    "gravity,floor -effect_floor_type contact -effect_floor_obstacle %s -effect_floor_response %s "
    "-effect_floor_recovery %d -time euler_implicit -ts_dt %g -ts_max_time %g -snes_rtol 1e-8",
    -DEPTH, element, obstacle, response, RECOVERY, STEP, 5.001 * RECOVERY * STEP));
  PetscCall(SbRunAddMonitor(t.run, watch_overlap, &o, NULL));
  PetscCall(verify_solve(&t, "overlap"));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  overlap, %s, %s, %.5s: speed up to %.3f v, energy up to %.3f M v^2, %.3f and %.4f of "
                "the depth after 1 and 5 times recovery\n",
                element, response, obstacle, (double)(o.speed / v), (double)(o.energy / (MASS * v * v)),
                (double)(o.depth[0] / DEPTH), (double)(o.depth[1] / DEPTH)));
  SB_CHECK(o.speed < 2 * v, "a node has %g m/s", (double)o.speed);
  SB_CHECK(o.energy < MASS * v * v + 1e-3, "the block has got %g J", (double)o.energy);
  /* the springs give a little under the weight */
  SB_CHECK_NEAR(o.depth[0] / DEPTH, PetscExpReal(-1), springs ? 2e-3 : 1e-4, "depth after recovery");
  SB_CHECK_NEAR(o.depth[1] / DEPTH, PetscExpReal(-5), springs ? 2e-3 : 1e-4,
                "depth after five times recovery");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ at once */

/* Deep in a mesh its field is coarser: the way out is found all the same. */
static PetscErrorCode check_overlap_mesh(void)
{
  const PetscInt n[3] = {30, 20, 10};
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, table, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(check_overlap("p1", "projected", text));
  PetscCall(verify_mesh_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_at_once(void)
{
  TestScene t;
  PetscReal values[NVALUE];

  PetscFunctionBeginUser;
  PetscCall(
    open_scene(&t, "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material corotated -body_a_young 5e4 "
                   "-body_a_poisson 0.3 -body_a_density 1000 -effects top,floor -effect_top_type support "
                   "-effect_top_on zmax "
                   "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0.02 -time static"));
  PetscCall(verify_solve(&t, "at once"));
  PetscCall(contact_values(t.run, 1, values));
  /* E = 5e4 Pa, a strain of 0.2 and an area of 0.01 m^2: about 100 N */
  SB_CHECK(values[PENETRATION] < 1e-7 && values[FZ] > 90, "static: %g m deep, %g N",
           (double)values[PENETRATION], (double)values[FZ]);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_mesh());
  PetscCall(check_overlap("p1", "projected", "plane:0,0,1,0"));
  PetscCall(check_at_once());
  if (size == 1) {
    PetscCall(check_overlap("cr", "projected", "plane:0,0,1,0"));
    PetscCall(check_overlap("p1", "augmented", "plane:0,0,1,0"));
    PetscCall(check_overlap("p1", "penalty", "plane:0,0,1,0"));
    PetscCall(check_overlap_mesh());
  }
  SB_TEST_END();
}
