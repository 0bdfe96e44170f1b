// @ranks 1 2
/*
  Effectivity of the error estimates of the ledger, estimate over true error in the energy norm: of
  time steps on an oscillating bar, for every integrator and with damping; of linear and Newton
  solves with loose tolerances; of quantities of static runs, by the mesh; of contact springs and
  barrier gaps. And: the ledger changes no result, its estimates are the same on any number of
  ranks, and -accuracy is reached, also if contact is the largest error. The true error of the time
  step is relative to the same run with 32 times shorter steps by Newmark's method, that of a solve
  relative to a solution up to rounding.
*/
#include "../../src/ledger/ledger_impl.h"
#include "verify.h"

#define BAR                                                                                 \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:2 -body_bar_young 1e5 -body_bar_poisson 0.3 " \
  "-body_bar_density 1000 -effects gravity,hold -effect_hold_type fixed -effect_hold_on xmin "

/* Energy norm of the difference of two states of the model, whose material is linear or nearly
   linear between them. */
static PetscErrorCode distance(SbModel m, Vec U, Vec V, Vec U1, Vec V1, PetscReal *error)
{
  PetscReal unused;
  PetscReal mass = 0.;
  PetscReal all;
  PetscScalar form;
  PetscInt inverted;
  const PetscScalar *v;
  Vec D, F[2];

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &D));
  PetscCall(VecDuplicate(U, &F[0]));
  PetscCall(VecDuplicate(U, &F[1]));
  PetscCall(VecWAXPY(D, -1., U, U1));
  PetscCall(SbModelStrainEnergy(m, U, F[0], &unused, &inverted));
  PetscCall(SbModelStrainEnergy(m, U1, F[1], &unused, &inverted));
  PetscCall(VecAXPY(F[1], -1., F[0]));
  PetscCall(VecDot(F[1], D, &form));
  PetscCall(VecDestroy(&F[0]));
  PetscCall(VecDestroy(&F[1]));
  if (V) {
    PetscCall(VecWAXPY(D, -1., V, V1));
    PetscCall(VecGetArrayRead(D, &v));
    for (PetscInt i = 0; i < 3 * m->space->nnode_owned; i++)
      mass += m->space->node_mass[i / 3] * v[i] * v[i];
    PetscCall(VecRestoreArrayRead(D, &v));
  }
  PetscCallMPI(MPI_Allreduce(&mass, &all, 1, MPIU_REAL, MPI_SUM, m->comm));
  *error = PetscSqrtReal(0.5 * (PetscAbsReal(form) + all));
  PetscCall(VecDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error of `source` in a run against a reference run. */
static PetscErrorCode compare(const char *what, const char *name, SbErrorSource source,
                              const char *scene, const char *coarse, const char *fine,
                              PetscReal low, PetscReal high)
{
  PetscReal error = 0.;
  PetscReal estimate, stored;
  PetscReal linear = 0.;
  PetscReal ratio;
  TestScene t, reference;

  PetscFunctionBeginUser;
  PetscCall(test_open(&reference, "%s %s", scene, fine));
  PetscCall(verify_solve(&reference, what));
  PetscCall(test_open(&t, "%s %s -ledger yes", scene, coarse));
  PetscCall(verify_solve(&t, what));
  PetscCall(distance(reference.model, reference.run->state.U, reference.run->state.V,
                     t.run->state.U, t.run->state.V, &error));
  PetscCall(test_ledger(t.run, source, &estimate, &stored));

  /* the remainder of Newton's method is partly that of its linear solves */
  if (source == SB_ERROR_NONLINEAR)
    PetscCall(test_ledger(t.run, SB_ERROR_LINEAR, &linear, &stored));
  estimate = PetscSqrtReal(PetscSqr(estimate) + PetscSqr(linear));
  ratio = estimate / error;
  stored = PetscSqrtReal(stored);
  test_print("  | %s | %s | %.2e | %.2e | %.2f |\n", what, name, error / stored, estimate / stored,
             ratio);
  SB_CHECK(ratio >= low && ratio <= high, "%s, %s: estimate / error %g is not in [%g, %g]", what,
           name, ratio, low, high);
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_close(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode steps(void)
{
  static const struct {
    const char *what, *scene, *coarse, *fine;
    PetscReal low, high;
  } of[] = {
    {"implicit Euler", "", "-time euler_implicit -ts_dt 0.002", "-time newmark -ts_dt 0.000125",
     0.5, 2},
    {"implicit Euler, long steps", "", "-time euler_implicit -ts_dt 0.01",
     "-time newmark -ts_dt 0.0005", 0.3, 3},
    {"Newmark", "", "-time newmark -ts_dt 0.008", "-time newmark -ts_dt 0.00025", 0.5, 2},
    {"generalized alpha", "", "-time genalpha -ts_dt 0.008", "-time newmark -ts_dt 0.00025", 0.5,
     2},
    {"symplectic Euler", "", "-time euler_symplectic -ts_dt 5e-4", "-time newmark -ts_dt 0.00025",
     0.5, 2},
    {"implicit Euler, damped",
     "-effects gravity,hold,damp -effect_damp_type damping -effect_damp_alpha 4",
     "-time euler_implicit -ts_dt 0.002", "-time newmark -ts_dt 0.000125", 0.5, 2},
    {"Newmark, corotated", "-body_bar_material corotated", "-time newmark -ts_dt 0.008",
     "-time newmark -ts_dt 0.00025", 0.5, 2},
    {"Newmark, P2", "-body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_element p2 -solver direct",
     "-time newmark -ts_dt 0.008", "-time newmark -ts_dt 0.00025", 0.5, 2},
  };

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    char scene[VERIFY_TEXT];

    /* thousands of steps of a small system: on several ranks only an implicit and an explicit
       integrator */
    if (test_size > 1 && i != 2 && i != 4)
      continue;
    PetscCall(PetscSNPrintf(scene, sizeof(scene),
                            BAR "-body_bar_material linear -ts_max_time 0.4 -ksp_rtol 1e-10 %s",
                            of[i].scene));
    PetscCall(compare(of[i].what, "time", SB_ERROR_TIME, scene, of[i].coarse, of[i].fine, of[i].low,
                      of[i].high));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solves(void)
{
  static const char cg[] = "-solver cg_icc -ksp_norm_type unpreconditioned ";
  static const struct {
    const char *what, *name;
    SbErrorSource source;
    const char *scene, *coarse, *fine;
  } of[] = {
    {"CG to 1e-2", "linear", SB_ERROR_LINEAR, "-body_bar_material linear -time static",
     "-ksp_rtol 1e-2", "-ksp_rtol 1e-13"},
    {"CG to 1e-5", "linear", SB_ERROR_LINEAR, "-body_bar_material linear -time static",
     "-ksp_rtol 1e-5", "-ksp_rtol 1e-13"},
    {"Newton to 1e-1", "nonlinear", SB_ERROR_NONLINEAR,
     "-body_bar_material stable_neohookean -time static", "-ksp_rtol 1e-8 -snes_rtol 1e-1",
     "-ksp_rtol 1e-10 -snes_rtol 1e-12"},
    {"Newton to 1e-4", "nonlinear", SB_ERROR_NONLINEAR,
     "-body_bar_material stable_neohookean -time static", "-ksp_rtol 1e-8 -snes_rtol 1e-4",
     "-ksp_rtol 1e-10 -snes_rtol 1e-12"},
    {"CG to 1e-3, Newmark", "linear", SB_ERROR_LINEAR,
     "-body_bar_material linear -time newmark -ts_dt 0.01 -ts_max_time 0.4", "-ksp_rtol 1e-3",
     "-ksp_rtol 1e-12"},
    {"CG to 1e-3, generalized alpha", "linear", SB_ERROR_LINEAR,
     "-body_bar_material linear -time genalpha -ts_dt 0.01 -ts_max_time 0.4", "-ksp_rtol 1e-3",
     "-ksp_rtol 1e-12"},
    {"Newton to 1e-3, implicit Euler", "nonlinear", SB_ERROR_NONLINEAR,
     "-body_bar_material corotated -time euler_implicit -ts_dt 0.01 -ts_max_time 0.4",
     "-snes_rtol 1e-3", "-snes_rtol 1e-10 -ksp_rtol 1e-8"},
    {"CG to 1e-3, implicit Euler", "linear", SB_ERROR_LINEAR,
     "-body_bar_material linear -time euler_implicit -ts_dt 0.01 -ts_max_time 0.4",
     "-ksp_rtol 1e-3", "-ksp_rtol 1e-12"},
    {"CG to 1e-3, P2", "linear", SB_ERROR_LINEAR,
     "-body_bar_material linear -body_bar_element p2 -time static", "-ksp_rtol 1e-3",
     "-ksp_rtol 1e-13"},
  };

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    char scene[VERIFY_TEXT];

    /* with a factor per rank the error of CG is smooth and accumulates:
       docs/reports/error_estimates.md */
    if (test_size > 1 && strstr(of[i].scene, "ts_dt") && of[i].source == SB_ERROR_LINEAR)
      continue;
    PetscCall(PetscSNPrintf(scene, sizeof(scene), BAR "%s %s", cg, of[i].scene));
    PetscCall(
      compare(of[i].what, of[i].name, of[i].source, scene, of[i].coarse, of[i].fine, 0.3, 3));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values of the quantity of interest after each step. */
static PetscErrorCode record(SbRun run, const SbStep *step, void *ctx)
{
  const SbLedger l = (SbLedger)run->monitors.post_solve.ctx;

  PetscFunctionBeginUser;
  ((PetscReal *)ctx)[step->step] = l->quantity.value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define TIP                                                                                 \
  "-ledger yes -ledger_quantity displacement -ledger_at 0.4,0.05,0.05 -body_bar_young 1e5 " \
  "-ts_max_time 0.4 "

/* Largest error of the tip by the time step in a run of n steps, against one of 20 n. */
static PetscErrorCode tip_in_time(const char *scene, const char *integrator, PetscInt n)
{
  PetscReal *value[2];
  PetscReal error = 0.;
  PetscReal estimate = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  for (int fine = 0; fine < 2; fine++) {
    PetscCall(PetscCalloc1(20 * n + 1, &value[fine]));
    PetscCall(test_open(&t, BAR TIP "%s -time %s -ts_dt %.17g", scene,
                        fine ? "newmark" : integrator, 0.4 / (fine ? 20. * (double)n : (double)n)));
    PetscCall(SbRunAddMonitor(t.run, record, value[fine]));
    PetscCall(verify_solve(&t, scene));
    if (!fine)
      estimate = ((SbLedger)t.run->monitors.post_solve.ctx)->quantity.error[SB_ERROR_TIME];
    PetscCall(test_scene_close(&t));
  }
  for (PetscInt i = 1; i <= n; i++)
    error = PetscMax(error, PetscAbsReal(value[0][i] - value[1][20 * i]));
  test_print("  | tip, %s, %d steps, %s | time | %.2e | %.2e | %.2f |\n", integrator, (int)n, scene,
             error, estimate, estimate / error);
  SB_CHECK(estimate > 0.3 * error && estimate < 3. * error,
           "tip, %s, %s: estimate / error %g is not in [0.3, 3]", integrator, scene,
           estimate / error);
  PetscCall(PetscFree(value[0]));
  PetscCall(PetscFree(value[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a quantity, -accuracy is of that: fast oscillations that the tip does not show cost
   nothing. */
static PetscErrorCode tip_accuracy(void)
{
  static const char scene[] =
    BAR TIP "-body_bar_material linear -body_bar_element cr -body_bar_poisson 0.4999 "
            "-ts_max_time 0.2 -time newmark ";
  PetscReal tip[2] = {0., 0.};
  PetscReal range = 0.;
  PetscInt steps = 0;
  TestScene t;

  PetscFunctionBeginUser;
  for (int fine = 0; fine < 2; fine++) {
    const SbQuantity *q;

    PetscCall(test_open(&t, "%s %s", scene, fine ? "-ts_dt 0.001" : "-ts_dt 0.01 -accuracy 0.01"));
    PetscCall(verify_solve(&t, "accuracy of the tip"));
    q = &((SbLedger)t.run->monitors.post_solve.ctx)->quantity;
    tip[fine] = q->value;
    range = q->most - q->least;
    if (!fine)
      steps = t.run->counters.steps;
    PetscCall(test_scene_close(&t));
  }
  test_print("  tip, cr, nu 0.4999, -accuracy 0.01: %d steps, error %.2e of the range\n",
             (int)steps, PetscAbsReal(tip[0] - tip[1]) / range);
  SB_CHECK(steps < 100, "-accuracy 0.01 for the tip takes %d steps", (int)steps);
  SB_CHECK_NEAR(tip[0], tip[1], 0.01 * range, "tip with -accuracy 0.01");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors of the tip of a swinging bar by the time step. */
static PetscErrorCode quantities(void)
{
  static const char p1[] = "-body_bar_material linear";
  static const char p2[] =
    "-body_bar_material linear -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_element p2";
  static const char turned[] = "-body_bar_material corotated -snes_rtol 1e-9";
  PetscFunctionBeginUser;
  PetscCall(tip_in_time(p1, "newmark", 20));
  if (test_size == 1) {
    PetscCall(tip_accuracy());
    PetscCall(tip_in_time(p1, "genalpha", 40));
    PetscCall(tip_in_time(p1, "euler_implicit", 40));
    PetscCall(tip_in_time(p2, "newmark", 40));
    PetscCall(tip_in_time(turned, "newmark", 20));
    PetscCall(tip_in_time(turned, "euler_implicit", 40));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves a static scene, then what the ledger needs for the error of its quantity; the error by the
   mesh has to be within a factor of two. exact: of a much finer mesh. */
static PetscErrorCode quantity(const char *what, const char *element, PetscReal nu, PetscReal exact,
                               const char *options)
{
  TestScene t;
  const SbQuantity *q;
  PetscReal error, ratio;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "%s -body_a_poisson %g -body_a_element %s -time static -ledger yes "
                      "-snes_rtol 1e-8 -ksp_rtol 1e-9",
                      options, (double)nu, element));
  PetscCall(verify_solve(&t, what));
  PetscCall(SbFinerRun(t.run, t.ledger));
  q = &t.ledger->quantity;
  error = PetscAbsReal(q->value - exact);
  ratio = q->error[SB_ERROR_SPACE] / error;
  test_print("  | %s, %s, nu %g | space | %.2e | %.2e | %.2f |\n", what, element, (double)nu, error,
             q->error[SB_ERROR_SPACE], ratio);
  SB_CHECK(t.ledger->finer.ncell > 0, "%s, %s, nu %g: no finer run: %s", what, element, (double)nu,
           t.ledger->finer.why);
  SB_CHECK(ratio > 0.5 && ratio < 2., "%s, %s, nu %g: estimate / error %g", what, element,
           (double)nu, ratio);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors of quantities of static runs by the mesh, of all elements. References: P2 on the same
   tets, divided twice, and extrapolated. */
static PetscErrorCode quantities_in_space(void)
{
  static const char cook[] =
    "-bodies a -body_a_mesh meshes/cook.msh -body_a_material linear -body_a_young 1 "
    "-body_a_density 1 -effects hold,plane,pull -effect_hold_type fixed -effect_hold_on left "
    "-effect_plane_type fixed -effect_plane_on all -effect_plane_components z -effect_pull_type "
    "traction -effect_pull_on right -effect_pull_vector 0;1/16;0 -ledger_quantity displacement "
    "-ledger_at 48,52,0 -ledger_direction 0,1,0";
  static const char bar[] =
    "-bodies a -body_a_mesh box:0.4,0.1,0.1:2 -body_a_density 1000 -effects g,h -effect_g_type "
    "gravity -effect_g_vector 0,0,-9.81 -effect_h_type fixed -effect_h_on xmin -body_a_young "
    "1.5e5 -static_steps 4 -ledger_quantity displacement -ledger_at 0.4,0.05,0.05 ";
  static const char press[] =
    "-bodies a -body_a_mesh box:1,1,1:2 -body_a_density 1 -body_a_material linear -body_a_young 1 "
    "-sets part -set_part_at box:0,0,1,0.5,0.5,1 -effects low,top -effect_low_type fixed "
    "-effect_low_on zmin -effect_top_type prescribed_displacement -effect_top_on part "
    "-effect_top_displacement 0;0;-0.01 -ledger_quantity reaction -ledger_on part";
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  static const struct {
    PetscReal nu, cook, bar, press;
  } of[] = {{0.3, 21.94363, -0.21310, -0.005059}, {0.4999, 18.5042, -0.20940, -0.005571}};

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    for (size_t e = 0; e < PETSC_STATIC_ARRAY_LENGTH(elements); e++) {
      char scene[VERIFY_TEXT];

      PetscCall(quantity("Cook", elements[e], of[i].nu, of[i].cook, cook));
      if (test_size > 1)
        continue;
      PetscCall(quantity("block", elements[e], of[i].nu, of[i].press, press));
      PetscCall(PetscSNPrintf(scene, sizeof(scene), "%s -body_a_material stable_neohookean", bar));
      PetscCall(quantity("bent bar", elements[e], of[i].nu, of[i].bar, scene));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where no finer run is possible or asked for the ledger says so, and takes duality. */
static PetscErrorCode no_finer(const char *options, const char *why)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      BAR "-body_bar_material linear -time static -ledger yes -ledger_quantity "
                          "displacement -ledger_at 0.4,0.05,0.05 %s",
                      options));
  PetscCall(verify_solve(&t, options));
  PetscCall(SbFinerRun(t.run, t.ledger));
  SB_CHECK(!t.ledger->finer.ncell && !strncmp(t.ledger->finer.why, why, strlen(why)) &&
             !t.ledger->finer.why[0] == !why[0],
           "%s: %d tets of a finer run, '%s'", options, (int)t.ledger->finer.ncell,
           t.ledger->finer.why);
  SB_CHECK(t.ledger->quantity.error[SB_ERROR_SPACE] > 0., "%s: no error by duality", options);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Penalty springs against the exact rigid contact: a block indented by a ball, and one that settles
   evenly on its springs. */
static PetscErrorCode springs(void)
{
  static const char block[] =
    "-bodies block -body_block_mesh box:0.1,0.1,0.05:4 -body_block_material linear "
    "-body_block_young 1e5 "
    "-body_block_poisson 0.3 -effects hold,tool -effect_hold_type fixed -effect_tool_type contact "
    "-effect_tool_response projected -effect_tool_on zmax -time static -ksp_rtol 1e-10 ";
  static const char ball[] =
    "-effect_hold_on zmin -effect_tool_obstacle sphere:0.05,0.05,0.087,0.04";
  static const char *const stiffness[] = {"20", "5"};
  static const char *const width[] = {"2e-4", "1e-3"};

  PetscFunctionBeginUser;
  for (int i = 0; i < 2; i++) {
    char scene[VERIFY_TEXT], coarse[256];

    PetscCall(PetscSNPrintf(scene, sizeof(scene), "%s %s", block, ball));
    PetscCall(PetscSNPrintf(coarse, sizeof(coarse),
                            "-effect_tool_response penalty -effect_tool_stiffness %s",
                            stiffness[i]));
    PetscCall(compare("springs under a ball", "contact", SB_ERROR_CONTACT, scene, coarse,
                      "-effect_tool_response projected", 0.3, 3));
    PetscCall(PetscSNPrintf(coarse, sizeof(coarse),
                            "-effect_tool_response barrier -effect_tool_barrier_width %s",
                            width[i]));
    PetscCall(compare("gaps of a barrier under a ball", "contact", SB_ERROR_CONTACT, scene, coarse,
                      "-effect_tool_response barrier -effect_tool_barrier_width 4e-6", 0.3, 3));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A ledger does not change the state: bitwise the same result. */
static PetscErrorCode spectator(const char *options)
{
  PetscReal difference;
  TestScene t[2];

  PetscFunctionBeginUser;
  for (int i = 0; i < 2; i++) {
    PetscCall(test_open(
      &t[i], BAR "%s %s", options,
      i ? "-ledger yes -ledger_every 2 -ledger_quantity displacement -ledger_at 0.4,0,0" : ""));
    PetscCall(verify_solve(&t[i], "spectator"));
  }
  SB_CHECK(!t[0].ledger && !t[0].run->monitors.post_solve.fn && !t[0].run->monitors.ncolumn,
           "a run without -ledger has one");
  SB_CHECK(t[1].run->monitors.ncolumn == SB_ERROR_COUNT, "%d columns",
           (int)t[1].run->monitors.ncolumn);
  PetscCall(VecAXPY(t[1].run->state.U, -1., t[0].run->state.U));
  PetscCall(VecNorm(t[1].run->state.U, NORM_INFINITY, &difference));
  SB_CHECK(difference == 0., "with a ledger displacements differ by %g m: %s", difference, options);
  SB_CHECK(t[0].run->counters.linear == t[1].run->counters.linear,
           "with a ledger iterations differ: %s", options);
  for (int i = 0; i < 2; i++)
    PetscCall(test_scene_close(&t[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The requested accuracy is reached, and not exceeded by a large factor. */
static PetscErrorCode dial(PetscReal accuracy, PetscInt *steps)
{
  PetscReal error = 0.;
  PetscReal form, stored;
  TestScene t, reference;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &reference,
    BAR "-body_bar_material linear -ts_max_time 0.4 -time newmark -ts_dt 0.00025 -ksp_rtol 1e-10"));
  PetscCall(verify_solve(&reference, "dial"));
  PetscCall(test_open(
    &t, BAR "-body_bar_material linear -ts_max_time 0.4 -time newmark -ts_dt 0.01 -accuracy %g",
    accuracy));
  PetscCall(verify_solve(&t, "dial"));
  PetscCall(distance(reference.model, reference.run->state.U, reference.run->state.V,
                     t.run->state.U, t.run->state.V, &error));
  PetscCall(test_ledger(t.run, SB_ERROR_TIME, &form, &stored));
  *steps = t.run->counters.steps;
  test_print("  -accuracy %g: %d steps, %d iterations, error %.2e\n", accuracy, (int)*steps,
             (int)t.run->counters.linear, error / PetscSqrtReal(stored));
  SB_CHECK(error < accuracy * PetscSqrtReal(stored), "-accuracy %g: error %g", accuracy,
           error / PetscSqrtReal(stored));
  SB_CHECK(error > 0.05 * accuracy * PetscSqrtReal(stored), "-accuracy %g: error %g, far too good",
           accuracy, error / PetscSqrtReal(stored));
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_close(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every integrator reaches the end, and few of its steps are rejected: the estimate knows at which
   time in a step the acceleration of generalized-alpha holds (0.001: 1078 of 2669 attempts were
   rejected, now 123 of 1160), and an explicit step with too large an error is repeated, not the
   end. */
static PetscErrorCode rejections(const char *integrator)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t, BAR "-body_bar_material corotated -ts_max_time 0.2 -accuracy 0.01 -time %s", integrator));
  PetscCall(verify_solve(&t, integrator));
  test_print("  %s: %d steps, %d attempts rejected\n", integrator, (int)t.run->counters.steps,
             (int)t.run->counters.rejected);
  SB_CHECK_NEAR(t.run->clock.t, 0.2, 1e-12, "end of the run");
  SB_CHECK(t.run->counters.rejected < 0.4 * t.run->counters.steps, "%s: %d of %d steps rejected",
           integrator, (int)t.run->counters.rejected, (int)t.run->counters.steps);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A block between rollers and a plate that is displaced onto it by a hundredth of the height:
  uniform strain; the gaps are the only error, and their share of the displacement is that of force
  and state. And a ball that indents a block against the same with a tiny width: the error is the
  requested one, or a tenth of that of the mesh.
*/
static PetscErrorCode gaps(void)
{
  static const char plate[] =
    "-bodies block -body_block_mesh box:0.1,0.1,0.05:4 -body_block_material linear "
    "-body_block_young 1e5 "
    "-body_block_poisson 0.3 -sets left,front,low -set_left_at plane:1,0,0,0 -set_front_at "
    "plane:0,1,0,0 "
    "-set_low_at plane:0,0,1,0 -effects x,y,z,tool -effect_x_type fixed -effect_x_on left "
    "-effect_x_components x -effect_y_type fixed -effect_y_on front -effect_y_components y "
    "-effect_z_type "
    "fixed -effect_z_on low -effect_z_components z -effect_tool_type contact -effect_tool_response "
    "barrier "
    "-effect_tool_obstacle plane:0,0,-1,-0.0505 -effect_tool_displacement 0;0;-0.001*t -time "
    "static ";
  static const char ball[] =
    "-bodies block -body_block_mesh box:0.1,0.1,0.05:4 -body_block_material linear "
    "-body_block_young 1e5 "
    "-body_block_poisson 0.3 -effects hold,tool -effect_hold_type fixed -effect_hold_on zmin "
    "-effect_tool_type contact -effect_tool_response barrier -effect_tool_on zmax -time static "
    "-effect_tool_obstacle sphere:0.05,0.05,0.0905,0.04 -effect_tool_displacement 0;0;-0.0035*t ";
  static const PetscReal asked[] = {1e-2, 1e-3};
  const PetscReal exact = 0.5 * 1e5 * 0.01 * PetscSqr(0.0005 / 0.05) * 0.05; /* strain energy, J */
  TestScene t, reference;
  SbEnergies energies;
  PetscReal width = 0.;

  PetscFunctionBeginUser;
  PetscCall(test_open(&reference, "%s -effect_tool_barrier_width 1e-6", ball));
  PetscCall(verify_solve(&reference, "ball"));
  for (int i = 0; i < 2; i++) {
    PetscReal error;
    PetscReal mesh = 0.;
    PetscReal stored;

    PetscCall(test_open(&t, "%s -accuracy %g", plate, asked[i]));
    PetscCall(verify_solve(&t, "plate"));
    PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &energies));
    error =
      PetscSqrtReal(energies.strain / exact) - 1.; /* of the strain, and therefore of the force */
    test_print("  plate, -accuracy %g: force off by %.1e, width %.1e m\n", asked[i], error,
               t.model->contacts.potential[0]->width);
    SB_CHECK(error > 0.02 * asked[i] && error < asked[i], "plate, -accuracy %g: force off by %g",
             asked[i], error);
    SB_CHECK(!i || t.model->contacts.potential[0]->width < 0.2 * width, "width %g, then %g m",
             width, t.model->contacts.potential[0]->width);
    width = t.model->contacts.potential[0]->width;
    PetscCall(test_scene_close(&t));

    PetscCall(test_open(&t, "%s -accuracy %g", ball, asked[i]));
    PetscCall(verify_solve(&t, "ball"));
    PetscCall(distance(reference.model, reference.run->state.U, reference.run->state.V,
                       t.run->state.U, t.run->state.V, &error));
    PetscCall(test_ledger(t.run, SB_ERROR_SPACE, &mesh, &stored));
    test_print("  ball, -accuracy %g: contact off by %.1e, mesh by %.1e\n", asked[i],
               error / PetscSqrtReal(stored), mesh / PetscSqrtReal(stored));
    SB_CHECK(error < PetscMax(asked[i] * PetscSqrtReal(stored), 0.1 * mesh),
             "ball, -accuracy %g: %g", asked[i], error / PetscSqrtReal(stored));
    PetscCall(test_scene_close(&t));
  }
  PetscCall(test_scene_close(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt few, many;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscLogDefaultBegin()); /* seconds of phases, as main() has them */
  PetscCall(quantities_in_space());
  PetscCall(steps());
  PetscCall(solves());
  PetscCall(quantities());
  PetscCall(no_finer("-ledger_finer_most 0", ""));
  PetscCall(no_finer("-ledger_finer_most 191", "it takes more than -ledger_finer_most"));
  PetscCall(no_finer("-static_control arc_length", "arc length"));
  PetscCall(springs());

  /* a factorisation on several ranks sums in the order in which messages arrive */
  PetscCall(spectator("-body_bar_material linear -time static -solver cg_icc"));
  PetscCall(spectator("-body_bar_material corotated -ts_dt 0.01 -ts_max_time 0.1"));
  PetscCall(spectator("-body_bar_material corotated -time genalpha -ts_dt 0.01 -ts_max_time 0.1"));
  PetscCall(dial(0.1, &few));
  PetscCall(dial(0.01, &many));
  SB_CHECK(many > few, "-accuracy 0.01 takes %d steps, 0.1 %d", (int)many, (int)few);
  PetscCall(rejections("genalpha"));
  PetscCall(rejections("genalpha -time_spectral_radius 0.9"));
  PetscCall(rejections("newmark"));
  PetscCall(rejections("euler_symplectic"));
  PetscCall(gaps());
  SB_TEST_END();
}
