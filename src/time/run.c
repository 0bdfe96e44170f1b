/*
  The life of a run: options, set-up, the loop over time or load, end.
*/
#include "sbsolver.h"
#include "time_impl.h"

/* Options of time steps. */
static PetscErrorCode read_dynamic(SbRun r)
{
  char text[64];
  PetscBool given, given_new;

  PetscFunctionBeginUser;

  /* every PETSc accepts both names of the step option: -ts_time_step is the new one */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ts_dt", &given));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-ts_time_step", text, sizeof(text), &given_new));
  if (given_new && !given)
    PetscCall(PetscOptionsSetValue(NULL, "-ts_dt", text));
  PetscCall(SbOptionReal(&SbRunScope, "ts_dt", &r->clock.dt));
  PetscCall(SbOptionGiven(&SbRunScope, "ts_dt", &r->clock.dt_given));
  PetscCall(SbOptionReal(&SbRunScope, "ts_max_time", &r->clock.t_end));
  PetscCall(SbOptionSecond(&SbRunScope, "time_predictor", &r->solve.velocity_predictor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The arc-length method. */
static PetscErrorCode read_arc_length(SbRun r)
{
  const SbModel model = r->model;

  PetscFunctionBeginUser;
  PetscCall(SbOptionInt(&SbRunScope, "static_max_steps", &r->clock.arc.steps));
  PetscCall(SbOptionReal(&SbRunScope, "static_max_displacement", &r->clock.arc.displacement));
  PetscCall(SbOptionReal(&SbRunScope, "static_longest_step", &r->clock.arc.longest));

  /* the arc-length method needs exact tangents: `auto` becomes exact */
  for (PetscInt k = 0; k < model->nmaterial; k++) {
    char option[3 * SB_NAME_MAX];
    PetscBool given;

    if (model->material[k]->linear || model->material[k]->tangent == SB_TANGENT_EXACT)
      continue;
    SbFormat(sizeof(option), option, "-%s_%s_tangent", k < model->nbody ? "body" : "inclusion",
             model->material[k]->name);
    PetscCall(PetscOptionsHasName(NULL, NULL, option, &given));
    PetscCheck(!given, model->comm, PETSC_ERR_USER_INPUT,
               "-static_control arc_length needs exact tangents: leave %s out, or make it exact",
               option);
    PetscCall(SbMaterialSetTangent(model->material[k], SB_TANGENT_EXACT));
    model->material[k]->adaptive = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of load steps. */
static PetscErrorCode read_static(SbRun r)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionInt(&SbRunScope, "static_steps", &r->clock.static_steps));
  PetscCall(SbOptionBool(&SbRunScope, "static_adapt", &r->clock.adapt));
  PetscCall(SbOptionReal(&SbRunScope, "static_min_increment", &r->clock.min_increment));
  PetscCall(SbOptionSecond(&SbRunScope, "static_control", &r->clock.arc.on));
  PetscCall(SbOptionChoice(&SbRunScope, "static_unstable", &r->stability.action));
  r->clock.t_end = 1.;
  r->clock.dt = 1. / (PetscReal)r->clock.static_steps;
  if (r->clock.arc.on)
    PetscCall(read_arc_length(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrators that viscoelastic materials do not go with. */
static PetscErrorCode check_viscous(const SbMaterial m, PetscBool body, SbRun r)
{
  PetscFunctionBeginUser;
  if (!m->viscous)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(r->solve.preset != SB_TIME_ALPHA2, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_%s: -time alpha2 keeps no history of stresses; take genalpha, which is the "
             "same method",
             body ? "body" : "inclusion", m->name, m->viscous->n ? "prony_times" : "viscosity");
  PetscCheck(!SbRunIsExplicit(r) ||
               (m->viscous->viscosity[0] == 0. && m->viscous->viscosity[1] == 0.),
             PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_viscosity: the stable step of explicit integrators is known without "
             "viscosities; take -time euler_implicit, newmark or genalpha, or a series of "
             "prony_times, which goes with all of them",
             body ? "body" : "inclusion", m->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrators that rigid bodies do not go with. */
static PetscErrorCode check_rigid(const SbBody *body, SbRun r)
{
  PetscFunctionBeginUser;
  PetscCheck(!body->rigid || (!SbRunIsExplicit(r) && r->solve.preset != SB_TIME_ALPHA2),
             PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_rigid: rigid bodies go with -time euler_implicit, newmark, genalpha and "
             "static; explicit steps would be too short, and alpha2 is genalpha",
             body->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrators that strains without stress, and a relation of force and velocity, do not go
   with. */
static PetscErrorCode check_active(const SbMaterial m, PetscBool body, SbRun r)
{
  PetscFunctionBeginUser;
  if (m->eigen && !m->linear)
    PetscCheck(!SbRunIsExplicit(r), PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: the stable step of explicit integrators does not know how stiff it makes a "
               "body; take -time euler_implicit, newmark or genalpha",
               m->eigen->name);
  if (!m->active || m->active->velocity == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(!SbRunIsExplicit(r) && r->solve.preset != SB_TIME_ALPHA2, PETSC_COMM_SELF,
             PETSC_ERR_USER,
             "-%s_%s_active_velocity: the stable step of explicit integrators, and -time alpha2, "
             "do not know the rate of fibres; take -time euler_implicit, newmark or genalpha",
             body ? "body" : "inclusion", m->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrators that softening does not go with. */
static PetscErrorCode check_mullins(const SbMaterial m, PetscBool body, SbRun r)
{
  PetscFunctionBeginUser;
  PetscCheck(!m->mullins || !SbRunIsExplicit(r), PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_mullins_r: the stable step of explicit integrators does not know how stiff "
             "unloading is; take -time euler_implicit, newmark, genalpha or static",
             body ? "body" : "inclusion", m->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunCreate(SbModel model, SbRun *run)
{
  SbRun r;
  int inverted, quality;
  PetscBool barrier = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&r));
  r->solve.barrier_weight = 1.;
  r->model = model;
  PetscCall(SbOptionChoice(&SbRunScope, "time", &r->solve.preset));
  model->dynamic = (PetscBool)(r->solve.preset != SB_TIME_STATIC);
  if (model->dynamic)
    PetscCall(read_dynamic(r));
  else
    PetscCall(read_static(r));
  if (r->solve.preset == SB_TIME_GENALPHA || r->solve.preset == SB_TIME_ALPHA2)
    PetscCall(SbOptionReal(&SbRunScope, "time_spectral_radius", &r->solve.spectral_radius));
  if (r->solve.preset == SB_TIME_NEWMARK) {
    PetscCall(SbOptionReal(&SbRunScope, "time_newmark_beta", &r->solve.newmark[0]));
    PetscCall(SbOptionReal(&SbRunScope, "time_newmark_gamma", &r->solve.newmark[1]));
  }
  PetscCall(SbRunReadStop(r));
  PetscCall(SbOptionInt(&SbRunScope, "time_max_halvings", &r->clock.max_halvings));
  PetscCall(SbOptionChoice(&SbRunScope, "time_inverted", &inverted));
  r->solve.reject_inverted = (PetscBool)(inverted == 2);
  for (PetscInt k = 0; k < model->nmaterial && !inverted && !model->dynamic && !r->clock.arc.on;
       k++)
    r->solve.reject_inverted = (PetscBool)(r->solve.reject_inverted || model->material[k]->softens);
  for (PetscInt k = 0; k < model->nmaterial; k++)
    PetscCall(check_viscous(model->material[k], (PetscBool)(k < model->nbody), r));
  for (PetscInt b = 0; b < model->nbody; b++)
    PetscCall(check_rigid(&model->body[b], r));
  for (PetscInt k = 0; k < model->nmaterial; k++)
    PetscCall(check_active(model->material[k], (PetscBool)(k < model->nbody), r));
  for (PetscInt k = 0; k < model->nmaterial; k++)
    PetscCall(check_mullins(model->material[k], (PetscBool)(k < model->nbody), r));
  PetscCheck(!r->solve.reject_inverted || r->solve.preset != SB_TIME_ALPHA2, PETSC_COMM_SELF,
             PETSC_ERR_USER,
             "-time_inverted reject: -time alpha2 cannot reject steps; take genalpha, which is the "
             "same method");
  for (PetscInt k = 0; k < model->nmaterial; k++)
    PetscCheck(
      !model->material[k]->positive || r->solve.preset != SB_TIME_ALPHA2, PETSC_COMM_SELF,
      PETSC_ERR_USER,
      "-body_%s_material %s: -time alpha2 cannot reject steps that invert a tet, which the "
      "law does not admit; take genalpha, which is the same method",
      model->material[k]->name, model->material[k]->type->name);
  for (PetscInt e = 0; e < model->neffect; e++) {
    PetscCheck(!SbRunIsExplicit(r) || !model->effect[e]->stiff, PETSC_COMM_WORLD,
               PETSC_ERR_USER_INPUT,
               "effect %s: the stable step of -time euler_symplectic and euler_explicit does not "
               "know its springs and dampers; use an implicit integrator",
               model->effect[e]->name);
    r->solve.saddle = (PetscBool)(r->solve.saddle ||
                                  (model->effect[e]->contact && model->effect[e]->contact->saddle));
    barrier = (PetscBool)(barrier || SbEffectHasPotential(model->effect[e]));
  }
  if (r->solve.saddle)
    PetscCall(SbOptionChoice(&SbRunScope, "saddle_solver", &r->solve.saddle_choice));
  if (barrier)
    PetscCall(SbOptionChoice(&SbRunScope, "contact_solver", &r->solve.contact_choice));
  PetscCall(SbOptionChoice(&SbRunScope, "contact_quality", &quality));
  r->solve.fast = (PetscBool)(quality == 1);
  PetscCall(SbSolverSetFromOptions(r->solve.solver_choice, sizeof(r->solve.solver_choice)));
  *run = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements, velocities and masses, with the initial state. */
static PetscErrorCode create_state(SbRun run)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  PetscScalar *mass;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &run->state.mass));
  PetscCall(VecGetArrayWrite(run->state.mass, &mass));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    mass[i] = s->node_mass[i / 3];
  PetscCall(VecRestoreArrayWrite(run->state.mass, &mass));
  PetscCall(SbSpaceCreateVec(s, &run->state.U));
  if (m->dynamic) {
    PetscCall(SbSpaceCreateVec(s, &run->state.V));
    if (run->solve.preset != SB_TIME_ALPHA2)
      PetscCall(SbSpaceCreateVec(s, &run->state.A));
  }
  if (run->clock.arc.on)
    PetscCall(SbSpaceCreateVec(s, &run->state.path));
  if (!m->dynamic)
    m->load = run->clock.t0; /* a static run starts with load factor t0 */
  PetscCall(SbModelInitialState(m, run->state.U, run->state.V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names of the linear solvers, and the reasons for them, for the log's header. */
static PetscErrorCode choose_solvers(SbRun run)
{
  const SbModel m = run->model;
  SbRunSolver *solve = &run->solve;
  char reason[128];

  const SbSolverProblem problem = {m->dynamic, m->linear, SbRunIsExplicit(run),
                                   solve->solver_choice};

  PetscFunctionBeginUser;
  if (run->clock.arc.on)
    PetscCall(
      SbSolverChooseIndefinite(m->comm, sizeof(solve->solver_choice), solve->solver_choice));
  PetscCall(SbSolverChoose(m->space, &problem, sizeof(solve->solver_reason), solve->solver_reason,
                           &solve->solver_used));
  PetscCall(PetscStrncpy(solve->solver, solve->solver_used->name, sizeof(solve->solver)));
  PetscCall(SbRunCheckContact(run));
  if (m->contacts.npotential) {
    PetscCall(SbContactSystemDescribe(solve->contact_choice, reason, sizeof(reason)));
    SbAppend(sizeof(solve->solver_reason), solve->solver_reason, "; %s", reason);
  }
  if (solve->saddle) {
    PetscCall(SbSaddleChoose(m->space, m->dynamic, solve->saddle_choice, &solve->saddle_used,
                             reason, sizeof(reason)));
    SbAppend(sizeof(solve->solver_reason), solve->solver_reason, "; %s", reason);
  }
  PetscCheck(!solve->solver_used->matrix_free || !m->ntangent, m->comm, PETSC_ERR_USER,
             "-solver %s works without a matrix, and the effect %s adds to it: use -solver rotated",
             solve->solver, m->tangent[0]->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangent, and the operators for what it lacks and for constraints outside of it. */
static PetscErrorCode create_matrices(SbRun run)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  SbRunSolver *solve = &run->solve;

  PetscFunctionBeginUser;
  PetscCall(SbSolverCreateOperator(s, solve->solver_used, &solve->J));
  if (m->nnonsymmetric)
    PetscCall(SbFormCreateOperator(run));
  else {
    PetscCall(PetscObjectReference((PetscObject)solve->J));
    solve->system = solve->J;
  }
  if (SbConstraintsSeparate(s)) {
    solve->unprojected = solve->system;
    PetscCall(SbConstraintsCreateOperator(s, solve->J, solve->unprojected, (PetscBool)!m->dynamic,
                                          solve->saddle_used, &solve->system));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The equation of equilibrium. */
static PetscErrorCode set_up_static(SbRun run)
{
  const SbModel m = run->model;
  Vec F;

  PetscFunctionBeginUser;
  run->clock.fixed = (PetscBool)!run->clock.arc.on;
  PetscCall(SbSpaceCreateVec(m->space, &F));
  PetscCall(SNESCreate(m->comm, &run->solve.snes));
  PetscCall(SNESSetFunction(run->solve.snes, F, SbFormStaticFunction, run));
  PetscCall(
    SNESSetJacobian(run->solve.snes, run->solve.system, run->solve.J, SbFormStaticJacobian, run));
  PetscCall(VecDestroy(&F));
  PetscCall(SbRunSetUpSolver(run));
  if (run->clock.arc.on)
    PetscCall(SbArcLengthCheck(run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSetUp(SbRun run)
{
  const SbModel m = run->model;
  const PetscBool explicit = SbRunIsExplicit(run);
  const SbSpace s = m->space;
  SbRunSolver *solve = &run->solve;
  PetscBool warped = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCheck(m->dynamic || !SbLiveCount(), m->comm, PETSC_ERR_USER_INPUT,
             "-effect_<name>_... live: interactive values need a time, and -time static has none: "
             "choose -time euler_implicit, newmark or genalpha");
  for (PetscInt b = 0; b < m->nbody; b++)
    if (s->alpha[b] != 0. || s->beta[b] != 0.)
      solve->damped = m->dynamic;

  /* state, linear solvers, matrices, integrator */
  PetscCall(create_state(run));
  PetscCall(choose_solvers(run));
  if (!explicit)
    PetscCall(create_matrices(run));
  if (m->dynamic)
    PetscCall(SbRunSetUpIntegrator(run));
  else
    PetscCall(set_up_static(run));
  PetscCall(SbSolverListCreate(run));

  /* PETSc's options may have changed the preset */
  if (!explicit) {
    PetscCall(SbSolverDescribe(solve->snes, s, sizeof(solve->solver_parts), solve->solver_parts));
    if (solve->solver_used->by_type ||
        (solve->solver_used->direct && !strstr(solve->solver_parts, solve->solver_used->package)))
      PetscCall(PetscStrncpy(solve->solver, solve->solver_parts, sizeof(solve->solver)));
  }

  /* one solve per step, with a tangent maybe too soft: no bound on the energy
     (docs/reference/theory.md) */
  for (PetscInt k = 0; k < m->nmaterial; k++)
    warped = (PetscBool)(warped || m->material[k]->tangent == SB_TANGENT_WARPED);
  solve->soft = (PetscBool)(m->dynamic && !explicit && !m->linear && solve->single && warped);
  if (solve->soft && (solve->velocity_predictor || solve->preset == SB_TIME_NEWMARK))
    PetscCall(SbWarning(
      s->comm,
      "-snes_type ksponly with %s and a warped tangent may gain energy without bound: give "
      "-body_<name>_tangent exact_spd, or leave -snes_type ksponly out",
      solve->velocity_predictor ? "-time_predictor velocity" : "-time newmark"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAddMonitor(SbRun run, SbMonitorFn fn, void *ctx)
{
  PetscFunctionBeginUser;
  PetscCheck(run->monitors.n < (PetscInt)PETSC_STATIC_ARRAY_LENGTH(run->monitors.list),
             PETSC_COMM_SELF, PETSC_ERR_PLIB, "More than %d monitors",
             (int)PETSC_STATIC_ARRAY_LENGTH(run->monitors.list));
  run->monitors.list[run->monitors.n].fn = fn;
  run->monitors.list[run->monitors.n++].ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies that touch when the run begins are moved apart; the energy that this gives them is work of
   the contact: what they begin with, in a static run what they have in equilibrium, when their
   supports are back. */
static PetscErrorCode start_contacts(SbRun run)
{
  const SbModel m = run->model;
  const PetscReal t = run->clock.t0;
  SbContact first = NULL; /* that has something to resolve */
  PetscBool shifted;
  SbEnergies energies = {0};
  PetscReal start, now;
  Vec shift;

  PetscFunctionBeginUser;
  if (!m->contacts.n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactSetStart(&m->contacts, t, run->clock.dt, run->state.U));
  PetscCall(VecDuplicate(run->state.U, &shift));
  if (!m->dynamic && m->contacts.npotential)
    PetscCall(SbContactSetShift(&m->contacts, t, run->clock.dt, run->state.U, shift, &first));
  shifted = (PetscBool)(first != NULL);
  PetscCall(SbModelEnergies(m, run->state.U, run->state.V, &energies));
  start = now = energies.strain;
  for (PetscInt k = 0; k < m->contacts.npotential; k++) {
    PetscBool moved;

    PetscCall(SbContactSetPart(&m->contacts, k, t, run->state.U, &moved));
    if (!moved)
      continue;
    PetscCall(SbModelEnergies(m, run->state.U, run->state.V, &energies));
    SbContactGive(m->contacts.potential[k], m->space, energies.strain - now, 0.);
    now = energies.strain;
    first = first ? first : m->contacts.potential[k];
  }
  if (!first && !m->dynamic && t == 0.)
    PetscCall(SbContactSetFindPenetrated(&m->contacts, t, run->state.U, &first));
  if (!m->dynamic && first)
    PetscCall(SbStaticPush(run, shifted ? shift : NULL, first, start));
  PetscCall(VecDestroy(&shift));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunShow(SbRun run)
{
  PetscFunctionBeginUser;
  run->clock.wall_start = MPI_Wtime();
  PetscCall(SbModelActiveAt(run->model, run->clock.t0));
  PetscCall(SbRunStepAccepted(run, run->clock.step0, run->clock.t0, 0., PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSolve(SbRun run)
{
  const SbModel m = run->model;
  const char *unit = m->dynamic ? " s" : "";
  char inverted[512];

  PetscFunctionBeginUser;

  /* effects that act only before or after the run */
  for (PetscInt k = 0; k < m->neffect && !run->clock.arc.on && run->clock.wall_start == 0.; k++) {
    const SbEffect e = m->effect[k];
    const PetscBool before = (PetscBool)(e->until <= 0.);

    if (before || e->from >= run->clock.t_end)
      PetscCall(SbWarning(
        m->comm, "the effect %s never acts: -effect_%s_%s %g%s, and the run goes from 0 to %g%s",
        e->name, e->name, before ? "until" : "from", (double)(before ? e->until : e->from), unit,
        (double)run->clock.t_end, unit));
  }
  if (run->clock.wall_start == 0.)
    run->clock.wall_start = MPI_Wtime();
  run->clock.paused = PETSC_FALSE;
  run->monitors.last.U = NULL;
  PetscCall(SbModelActiveAt(m, run->clock.t0));
  PetscCall(start_contacts(run));
  PetscCall(SbSpaceDescribeInverted(m->space, run->state.U, sizeof(inverted), inverted));
  PetscCheck(!inverted[0], m->comm, PETSC_ERR_USER_INPUT, "The run cannot start: %s", inverted);

  /* viscoelastic bodies begin relaxed, unless the run goes on */
  if (m->space->viscous && m->dynamic) {
    PetscCall(SbSpaceViscousStart(m->space, run->state.U));
    PetscCall(SbSpaceViscousAt(m->space, 0., PETSC_FALSE, run->state.U, run->state.V));
  }
  PetscCall(SbSpaceMullinsAdvance(m->space, run->state.U, NULL));
  if (m->dynamic)
    PetscCall(SbSpaceActiveRates(m->space, 0., PETSC_FALSE, run->state.U, run->state.V));
  if (run->solve.ts)
    PetscCall(SbRunIntegrate(run));
  else if (run->clock.arc.on)
    PetscCall(SbArcLengthSolve(run));
  else
    PetscCall(SbStaticSolve(run));
  run->counters.seconds_solve = MPI_Wtime() - run->clock.wall_start;
  if (!run->clock.paused)
    PetscCall(SbSpaceViewDisplacement(m->space, run->state.U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunDestroy(SbRun *run)
{
  SbRun r = *run;

  PetscFunctionBeginUser;
  if (!r)
    PetscFunctionReturn(PETSC_SUCCESS);
  Vec *const vectors[] = {&r->solve.R,
                          &r->solve.left,
                          &r->solve.nonsymmetric.U,
                          &r->solve.nonsymmetric.x,
                          &r->solve.nonsymmetric.y,
                          &r->state.U,
                          &r->state.V,
                          &r->state.A,
                          &r->state.loads,
                          &r->state.active,
                          &r->state.reaction,
                          &r->state.previous,
                          &r->state.path,
                          &r->state.mass};
  if (r->monitors.output_destroy)
    PetscCall(r->monitors.output_destroy(r));
  PetscCall(PetscFree(r->solve.fallbacks));
  PetscCall(PetscFree(r->solve.alone));
  PetscCall(SbPotentialDestroy(&r->solve.potential));
  if (!r->solve.ts)
    PetscCall(SNESDestroy(&r->solve.snes));
  PetscCall(TSDestroy(&r->solve.ts));
  PetscCall(MatDestroy(&r->stability.K));
  PetscCall(MatDestroy(&r->solve.system));
  PetscCall(MatDestroy(&r->solve.unprojected));
  PetscCall(MatDestroy(&r->solve.J));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(vectors); k++)
    PetscCall(VecDestroy(vectors[k]));
  PetscCall(PetscFree(*run));
  PetscFunctionReturn(PETSC_SUCCESS);
}
