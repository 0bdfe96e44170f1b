/*
  Re-meshing during a run: a body is re-meshed when the quality of its tets is too low, or at given
  times, and the run continues.

  After each step a callback decides whether the time loop returns (SbRunMonitors.post_step). Then
  the state is gathered on rank 0 (gather.c), bodies are re-meshed and the state is interpolated
  (bodies.c), the scene is set up again from its options with these meshes in memory, and the state
  is transferred: vectors, history variables of effects, totals, output, ledger. Scaled densities
  conserve mass (SbMemoryMesh.mass), a rigid motion added to the velocities conserves momenta
  (check.c). The change of kinetic and strain energy is remesh_loss in the energy balance.

  If re-meshing fails the body keeps its mesh, and the run continues with a warning; the next try is
  when its quality has halved, but at the earliest after 1, 2, 4, ... steps. The same bound holds
  after a mesh that is hardly better: no body is re-meshed in every step.
*/
#include "remesh_impl.h"
#include "sbscene.h"

#define AGAIN 0.5 /* factor on the quality reached: below that a body may be re-meshed again */
#define QUALITY_LEAST 1e-3 /* quality of new tets at rest and now below which vertices are moved */

struct _p_SbRemesh {
  PetscLogEvent event;
  PetscInt nbody;
  PetscBool *named; /* [nbody] may be re-meshed */
  PetscBool *due;   /* [nbody] is to be re-meshed now; afterwards: has been */
  PetscReal *asked; /* [nbody] quality bound of the options; 0: none */
  PetscReal *bound; /* [nbody] current quality bound */
  PetscReal *worst; /* [nbody] quality of the worst tet after the last step */
  PetscInt *from;   /* [nbody] step from which the quality bound applies again */
  PetscInt *rest;   /* [nbody] steps without a try after the last failure */
  PetscInt ntime;
  PetscReal *time; /* [ntime] times of re-meshing, s */
  PetscInt nchange;
  PetscReal *change; /* [nchange] times when supports come or go, s: the scene is set up again */
  PetscBool meshes;  /* bodies may be re-meshed; else only supports change */
  PetscBool changes; /* supports come or go now */
  PetscBool failed;  /* -remesh_failed */
  PetscInt tried;    /* last step after which -remesh_failed applied, -1: never */
  SbRemeshing how;
  SbColumn *column; /* columns of the ledger and remesh_loss */
};

const SbOption SbRemeshRows[] = {
  {"remesh_quality", SB_OPTION_REAL, 1, "", "0", "[0, 1)",
   "a body is re-meshed when the radius ratio 3 r/R (inscribed and circumscribed sphere) of a tet "
   "falls "
   "below this (1: regular, 0: flat, negative: inverted); 0: off"},
  {"remesh_times", SB_OPTION_NAMES, 1, "s", "", "",
   "times at which bodies are re-meshed, separated by commas"},
  {"remesh_failed", SB_OPTION_BOOL, 1, "", "false", "",
   "when a step fails and halving does not help: re-mesh the body with the worst tet and repeat "
   "the step"},
  {"remesh_bodies", SB_OPTION_NAMES, 1, "", "", "", "bodies that may be re-meshed; empty: all"},
  {"remesh_from", SB_OPTION_CHOICE, 1, "", "deformed", "deformed|rest",
   "configuration that is filled with new tets: the current one, or the reference configuration"},
  {"remesh_size", SB_OPTION_REAL, 1, "", "1", "[0.1, 10]",
   "edge length of new tets inside a body, relative to the mean edge of its surface, whose "
   "triangles are "
   "kept"},
  {0},
};
const SbOption SbRemeshBodyRows[] = {
  {"remesh_quality", SB_OPTION_REAL, 1, "", "", "[0, 1)",
   "value for this body in place of -remesh_quality"},
  {0},
};

PetscErrorCode SbRemeshSetFromOptions(SbModel m, SbRemesh *remesh)
{
  PetscBool named = PETSC_FALSE;
  PetscBool any = PETSC_FALSE;
  PetscBool given;
  PetscInt n;
  SbScope own;
  SbRemesh r;
  char(*words)[SB_NAME_MAX], wrong[SB_NAME_MAX] = "";
  PetscReal all;
  static const char *const keys[] = {"remesh_quality", "remesh_times", "remesh_failed"};

  PetscFunctionBeginUser;

  // whether the scenario asks for re-meshing, by any option but the settings
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(keys); k++) {
    PetscCall(SbOptionGiven(&SbRunScope, keys[k], &given));
    named = (PetscBool)(named || given);
  }
  for (PetscInt b = 0; b < m->nbody; b++) {
    SbScopeSet(&own, "body", "", m->body[b].name);
    PetscCall(SbOptionGiven(&own, "remesh_quality", &given));
    named = (PetscBool)(named || given);
  }
  PetscCall(PetscNew(&r));
  *remesh = r;
  r->nbody = m->nbody;
  r->tried = -1;
  PetscCall(PetscCalloc7(m->nbody, &r->named, m->nbody, &r->due, m->nbody, &r->asked, m->nbody,
                         &r->bound, m->nbody, &r->worst, m->nbody, &r->from, m->nbody, &r->rest));

  // times at which supports come and go after the start
  PetscCall(PetscMalloc1(2 * m->neffect, &r->change));
  for (PetscInt e = 0; e < m->neffect; e++) {
    const SbEffect effect = m->effect[e];

    if (!effect->ops.prescribe)
      continue;
    if (effect->from > 0.)
      r->change[r->nchange++] = effect->from;
    if (effect->until > 0. && effect->until < PETSC_MAX_REAL)
      r->change[r->nchange++] = effect->until;
  }
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCheck(!m->body[b].rigid || !named, PETSC_COMM_SELF, PETSC_ERR_USER,
               "-body_%s_rigid: scenes with rigid bodies are not re-meshed: leave the options "
               "-remesh_ out",
               m->body[b].name);
  for (PetscInt e = 0; e < m->neffect; e++)
    PetscCheck(strcmp(m->effect[e]->type, "periodic") || !named, PETSC_COMM_SELF, PETSC_ERR_USER,
               "effect %s: opposite sides of a cell do not get the same new meshes: leave the "
               "options -remesh_ out, or the effect",
               m->effect[e]->name);
  for (PetscInt e = 0; e < m->neffect; e++)
    PetscCheck(!m->effect[e]->ops.settle || !named, PETSC_COMM_SELF, PETSC_ERR_USER,
               "effect %s: what has torn is known by the cells of the mesh: scenes with "
               "-effect_%s_strength are not re-meshed: leave the options -remesh_ out, or the "
               "strength",
               m->effect[e]->name, m->effect[e]->name);
  for (PetscInt e = 0; e < m->neffect; e++)
    PetscCheck(strcmp(m->effect[e]->type, "mass") || !named, PETSC_COMM_SELF, PETSC_ERR_USER,
               "effect %s: the mass of a body that is re-meshed is its own: leave the options "
               "-remesh_ out, or the effect",
               m->effect[e]->name);
  if (!named && !r->nchange)
    PetscCall(SbRemeshDestroy(remesh));
  if (*remesh)
    PetscCall(SbLogNamed("Mesh", "remesh", &r->event));
  if (!named)
    PetscFunctionReturn(PETSC_SUCCESS);

  // the named bodies; all if none is named
  PetscCall(SbOptionNames(&SbRunScope, "remesh_bodies", &n, &words));
  for (PetscInt b = 0; b < m->nbody; b++)
    r->named[b] = (PetscBool)!n;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt b = 0;

    while (b < m->nbody && strcmp(words[i], m->body[b].name))
      b++;
    if (b < m->nbody)
      r->named[b] = PETSC_TRUE;
    else
      PetscCall(PetscStrncpy(wrong, words[i], sizeof(wrong)));
  }
  PetscCall(PetscFree(words));
  PetscCheck(!wrong[0], PETSC_COMM_SELF, PETSC_ERR_USER,
             "-remesh_bodies: the scenario has no body '%s'; give names of -bodies", wrong);

  // their quality bounds
  PetscCall(SbOptionReal(&SbRunScope, "remesh_quality", &all));
  for (PetscInt b = 0; b < m->nbody; b++) {
    if (!r->named[b])
      continue;
    r->asked[b] = all;
    SbScopeSet(&own, "body", "", m->body[b].name);
    PetscCall(SbOptionReal(&own, "remesh_quality", &r->asked[b]));
    r->bound[b] = r->asked[b];
    any = (PetscBool)(any || r->asked[b] > 0.);
  }

  // times of re-meshing
  PetscCall(SbOptionNames(&SbRunScope, "remesh_times", &r->ntime, &words));
  PetscCall(PetscMalloc1(r->ntime, &r->time));
  for (PetscInt i = 0; i < r->ntime; i++) {
    char *end;

    r->time[i] = strtod(words[i], &end);
    if (!wrong[0] && (*end || !(r->time[i] > 0.) || PetscIsInfOrNanReal(r->time[i])))
      PetscCall(PetscStrncpy(wrong, words[i], sizeof(wrong)));
  }
  PetscCall(PetscFree(words));
  PetscCheck(!wrong[0], PETSC_COMM_SELF, PETSC_ERR_USER,
             "-remesh_times: '%s' is no time above 0 s; give numbers with commas between them",
             wrong);
  PetscCall(SbOptionBool(&SbRunScope, "remesh_failed", &r->failed));
  PetscCall(SbOptionSecond(&SbRunScope, "remesh_from", &r->how.rest));
  PetscCall(SbOptionReal(&SbRunScope, "remesh_size", &r->how.size));
  r->how.quality = QUALITY_LEAST;
  r->how.mesher = SbMesherDefault;
  r->meshes = (PetscBool)(any || r->ntime || r->failed);
  if (!r->meshes && !r->nchange)
    PetscCall(SbRemeshDestroy(remesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbRemeshSetMesher(SbRemesh r, SbMesher mesher, void *ctx)
{
  r->how.mesher = mesher;
  r->how.ctx = ctx;
}

PetscErrorCode SbRemeshDestroy(SbRemesh *remesh)
{
  SbRemesh r = *remesh;

  PetscFunctionBeginUser;
  if (!r)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree7(r->named, r->due, r->asked, r->bound, r->worst, r->from, r->rest));
  PetscCall(PetscFree(r->time));
  PetscCall(PetscFree(r->change));
  PetscCall(PetscFree(r->column));
  PetscCall(PetscFree(*remesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Decides when a re-meshing is due, and of which bodies. */
static PetscErrorCode check_quality(SbRun run, PetscInt step, PetscReal t, PetscReal dt, void *ctx,
                                    PetscBool *pause)
{
  const PetscReal ahead =
    1e-6 * dt; /* tolerance for rounding: a step that ends there has reached the time */
  SbRemesh r = (SbRemesh)ctx;
  PetscBool time = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(r->event, 0, 0, 0, 0));
  for (PetscInt i = 0; i < r->ntime; i++)
    time = (PetscBool)(time || (r->time[i] > t - dt + ahead && r->time[i] <= t + ahead));
  r->changes = PETSC_FALSE;
  for (PetscInt i = 0; i < r->nchange; i++)
    r->changes =
      (PetscBool)(r->changes || (r->change[i] > t - dt + ahead && r->change[i] <= t + ahead));
  *pause = r->changes;
  r->how.better = (PetscBool)!time;
  if (r->meshes)
    PetscCall(SbBodyQualities(run->model, run->state.U, r->named, r->worst));
  for (PetscInt b = 0; b < r->nbody && r->meshes; b++) {
    const PetscBool bad =
      (PetscBool)(r->asked[b] > 0. && r->worst[b] < r->bound[b] && step >= r->from[b]);

    r->due[b] = (PetscBool)(r->named[b] && (time || bad));
    *pause = (PetscBool)(*pause || r->due[b]);
  }
  PetscCall(PetscLogEventEnd(r->event, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a failed step: the body with the worst tet is due, once per state. */
static PetscErrorCode check_after_failure(SbRemesh r, SbRun run, PetscBool *again)
{
  PetscInt worst = -1;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  if (!r->failed || !run->clock.stop_reason[0] || run->clock.stopped || run->clock.step <= r->tried)
    PetscFunctionReturn(PETSC_SUCCESS);
  r->tried = run->clock.step;
  if (!run->clock.step) {
    PetscCall(SbWarning(run->model->comm,
                        "-remesh_failed: the first step failed, with the bodies as they were "
                        "given: none is re-meshed, their meshes, loads or steps must change"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbBodyQualities(run->model, run->state.U, r->named, r->worst));
  for (PetscInt b = 0; b < r->nbody; b++) {
    r->due[b] = PETSC_FALSE;
    if (r->named[b] && (worst < 0 || r->worst[b] < r->worst[worst]))
      worst = b;
  }
  if (worst < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  r->due[worst] = *again = PETSC_TRUE;
  r->how.better = PETSC_FALSE;
  PetscCall(SbWarning(run->model->comm, "%s; body '%s' is re-meshed", run->clock.stop_reason,
                      run->model->body[worst].name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRemeshAttach(SbRemesh r, SbRun run)
{
  PetscFunctionBeginUser;
  if (!r)
    PetscFunctionReturn(PETSC_SUCCESS);
  run->monitors.post_step.fn = check_quality;
  run->monitors.post_step.ctx = r;
  if (!r->meshes)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(r->column));
  PetscCall(PetscMalloc1(run->monitors.ncolumn + 3, &r->column));
  PetscCall(PetscArraycpy(r->column, run->monitors.column, run->monitors.ncolumn));
  r->column[run->monitors.ncolumn++] =
    (SbColumn){"remesh_loss", "J", &run->state.energies.remesh_loss};
  r->column[run->monitors.ncolumn++] =
    (SbColumn){"remesh_mass", "kg", &run->state.energies.remesh_mass};
  r->column[run->monitors.ncolumn++] =
    (SbColumn){"remesh_momentum", "kg m/s", &run->state.energies.remesh_momentum};
  run->monitors.column = r->column;
  run->monitors.want_energies = PETSC_TRUE;
  for (PetscInt b = 0; b < r->nbody; b++) {
    const SbMemoryMesh *in_memory = run->model->body[b].in_memory;

    if (in_memory && in_memory->bound > 0.)
      r->bound[b] = PetscMin(r->bound[b], in_memory->bound);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scene: model, run and ledger. */
typedef struct {
  SbModel model;
  SbRun run;
  SbLedger ledger;
} Scene;

/* The values of supports at the present time. What a support of a static run holds from here on is
   where it is until the next load step moves it, which then has the work of that. */
static PetscErrorCode prescribe(const SbRemesh r, const Scene *s)
{
  const Vec U = s->run->state.U;
  PetscBool meshed = PETSC_FALSE;
  Vec values;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < r->nbody; b++)
    meshed = (PetscBool)(meshed || r->due[b]);
  PetscCall(VecDuplicate(U, &values));
  PetscCall(VecCopy(U, values));
  PetscCall(SbModelPrescribe(s->model, s->run->clock.t, values));
  if (meshed || s->model->dynamic)
    PetscCall(VecCopy(values, U));
  PetscCall(VecDestroy(&values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the new scene and transfers the state. */
static PetscErrorCode replace(SbRemesh r, Scene *old, SbRemeshResult *result)
{
  Scene s = {NULL, NULL, NULL};
  SbEnergies e[2] = {{0}};
  PetscReal speed[2] = {
    0.}; /* largest speed, and acceleration, added to conserve momenta and their rates */
  SbRun run;
  const SbRun before = old->run;
  PetscReal(*momenta)[6];

  PetscFunctionBeginUser;

  // set up the scene from its options, on the new meshes; the solver is the one chosen before
  PetscCall(SbSceneCreate(old->model->comm, &s.model));
  PetscCall(SbRunCreate(s.model, &run));
  s.run = run;
  PetscCall(
    PetscStrncpy(run->solve.solver_choice, before->solve.solver, sizeof(run->solve.solver_choice)));
  PetscCall(SbLedgerSetFromOptions(run, &s.ledger));

  // the bodies' meshes, on rank 0; the model owns them from now on
  for (PetscInt b = 0; b < s.model->nbody; b++) {
    PetscCall(SbMemoryMeshShare(s.model->comm, &result->in_memory[b]));
    s.model->body[b].in_memory = result->in_memory[b];
    result->in_memory[b] = NULL;
  }
  s.model->t_begin = before->clock.t;
  PetscCall(SbModelSetUp(s.model));
  PetscCall(SbRunSetUp(run));
  PetscCall(PetscStrncpy(run->solve.solver_reason, before->solve.solver_reason,
                         sizeof(run->solve.solver_reason)));

  // transfer the state
  PetscCall(SbRunTransferState(before, run));
  PetscCall(SbScatter(&result->next, run));
  PetscCall(SbHistoryHandOver(before, run, result, r->due));
  PetscCall(prescribe(r, &s));

  // conserve the bodies' momenta, and their rates where the integrator stores accelerations
  PetscCall(PetscCalloc1(old->model->nbody, &momenta));
  for (int i = 0; i < 2; i++) {
    const Vec from = i ? before->state.A : before->state.V;
    const Vec to = i ? run->state.A : run->state.V;

    if (!to)
      continue;
    PetscCall(SbBodyMomenta(old->model, before->state.U, from, momenta));
    PetscCall(SbBodySetMomenta(s.model, run->state.U, to, r->due, (const PetscReal(*)[6])momenta,
                               &speed[i]));
  }
  PetscCall(PetscFree(momenta));
  PetscCall(SbEffectsHandOver(before, run, &result->renamed));
  PetscCall(SbModelActiveAt(s.model, run->clock.t));
  if (s.model->dynamic) {
    PetscCall(SbSpaceViscousAt(s.model->space, 0., PETSC_FALSE, run->state.U, run->state.V));
    PetscCall(SbSpaceActiveRates(s.model->space, 0., PETSC_FALSE, run->state.U, run->state.V));
  }

  // penalty of CR and DG for the new state, before accelerations and energies are computed
  if (run->solve.J && s.model->dynamic && run->solve.preset != SB_TIME_ALPHA2)
    PetscCall(SbModelFollowJumps(
      s.model, run->clock.t, run->state.U,
      run->solve.preset == SB_TIME_NEWMARK ? SB_STEPS_UNDAMPED : SB_STEPS_IN_TIME, NULL));
  PetscCall(SbRunRestartAcceleration(run));

  // energy, mass and momentum of both states; the difference of energy is remesh_loss
  PetscCall(SbModelEnergies(old->model, before->state.U, before->state.V, &e[0]));
  PetscCall(SbModelEnergies(s.model, run->state.U, run->state.V, &e[1]));
  run->state.energies.remesh_loss += e[0].kinetic + e[0].strain - e[1].kinetic - e[1].strain;
  run->state.energies.remesh_mass += PetscAbsReal(s.model->mass - old->model->mass);
  run->state.energies.remesh_momentum += PetscSqrtReal(SbDistance2(e[0].momentum, e[1].momentum));
  PetscCall(SbLedgerAttach(s.ledger));
  if (s.ledger)
    PetscCall(SbLedgerContinue(old->ledger, s.ledger));
  PetscCall(SbRemeshAttach(r, run));
  if (before->monitors.output)
    PetscCall(SbOutputReattach(before, run));

  // one line for each body that was re-meshed
  for (PetscInt b = 0; b < r->nbody; b++) {
    const SbRemeshOutcome *o = &result->outcome[b];
    SbRemeshed entry = {.step = run->clock.step,
                        .t = run->clock.t,
                        .tets = {o->ncell[0], o->ncell[1]},
                        .vertices = {o->nvert[0], o->nvert[1]},
                        .energy = {e[0].kinetic + e[0].strain, e[1].kinetic + e[1].strain},
                        .quality = {r->worst[b], o->quality},
                        .moved = o->nmoved,
                        .speed = speed[0],
                        .shift = PetscSqrtReal(SbDistance2(e[0].centre, e[1].centre))};

    if (!r->due[b])
      continue;
    PetscCall(PetscStrncpy(entry.body, s.model->body[b].name, sizeof(entry.body)));
    PetscCall(SbReportRemeshed(run, &entry));
  }
  PetscCall(SbLedgerDestroy(&old->ledger));
  PetscCall(SbRunDestroy(&old->run));
  PetscCall(SbModelDestroy(&old->model));
  *old = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* any: some body has a new mesh. */
static PetscErrorCode apply(SbRemesh r, Scene *scene, PetscBool *any)
{
  SbRemeshResult result;
  SbRun run = scene->run;
  const SbModel m = scene->model;
  SbRenamed *renamed = &result.renamed;
  SbGathered g;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCall(PetscLogStagePush(SbLogStageSetup));
  PetscCall(PetscLogEventBegin(r->event, 0, 0, 0, 0));

  // new meshes on rank 0; messages, counts and names are sent to all ranks
  PetscCallMPI(MPI_Comm_rank(m->comm, &rank));
  PetscCall(SbGather(run, &g));
  PetscCall(SbRemeshResultCreate(&g, &result));
  if (!rank)
    PetscCall(SbRemeshBodies(m, &g, r->due, run->clock.step, &r->how, &result));
  PetscCall(SbGatheredDestroy(&g));
  PetscCallMPI(MPI_Bcast(result.outcome, (int)((size_t)m->nbody * sizeof(*result.outcome)),
                         MPI_BYTE, 0, m->comm));
  PetscCallMPI(MPI_Bcast(&renamed->n, 1, MPIU_INT, 0, m->comm));
  if (rank)
    PetscCall(PetscMalloc2(renamed->n, &renamed->from, renamed->n, &renamed->to));
  PetscCallMPI(MPI_Bcast(renamed->from, (PetscMPIInt)renamed->n, MPIU_INT, 0, m->comm));
  PetscCallMPI(MPI_Bcast(renamed->to, (PetscMPIInt)renamed->n, MPIU_INT, 0, m->comm));
  *any = r->changes;
  r->changes = PETSC_FALSE;
  for (PetscInt b = 0; b < m->nbody; b++) {
    const PetscBool done = (PetscBool)(r->due[b] && !result.outcome[b].message[0]);
    const PetscReal reached = done ? result.outcome[b].quality : r->worst[b];

    *any = (PetscBool)(*any || done);
    if (!r->due[b])
      continue;
    if (!done)
      PetscCall(SbWarning(m->comm, "body '%s' keeps its mesh after step %" PetscInt_FMT ": %s",
                          m->body[b].name, run->clock.step, result.outcome[b].message));

    // quality and step from which the body may be re-meshed again
    if (reached > 0.)
      r->bound[b] = PetscMin(r->asked[b], AGAIN * reached);
    r->rest[b] = done && reached > 0. ? 0 : PetscMax(1, 2 * r->rest[b]);
    r->from[b] = run->clock.step + r->rest[b];
    if (result.in_memory[b] && done)
      result.in_memory[b]->bound = r->bound[b];
    r->due[b] = done; /* which replace() needs */
  }
  if (*any)
    PetscCall(replace(r, scene, &result));
  PetscCall(SbRemeshResultDestroy(&result));
  PetscCall(PetscLogEventEnd(r->event, 0, 0, 0, 0));
  PetscCall(PetscLogStagePop());

  // without a new mesh the time loop resumes at the current step
  if (!*any) {
    run->clock.step0 = run->clock.step;
    run->clock.t0 = run->clock.t;
    run->counters.newton_before = run->counters.newton;
    run->counters.linear_before = run->counters.linear;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRemeshSolve(SbRemesh r, SbModel *model, SbRun *run, SbLedger *ledger)
{
  Scene scene = {*model, *run, ledger ? *ledger : NULL};
  SbRun first = scene.run;
  PetscBool again, any;

  PetscFunctionBeginUser;

  // a checkpoint before a due re-meshing contains the old meshes: a restart re-meshes first
  if (r && first->clock.step0 && (first->monitors.post_step.dt > 0. || r->nchange)) {
    const PetscBool initial = (PetscBool) !(first->monitors.post_step.dt > 0.);

    first->clock.step = first->clock.step0;
    first->clock.t = first->clock.t0;
    PetscCall(check_quality(first, first->clock.step0, first->clock.t0,
                            initial ? first->clock.t0 : first->monitors.post_step.dt, r, &again));

    // the new scene is in its initial state, as at the start of the first run: only supports come
    // and go
    for (PetscInt b = 0; b < r->nbody && initial; b++)
      r->due[b] = PETSC_FALSE;
    if (initial ? r->changes : again)
      PetscCall(apply(r, &scene, &any));
  }
  do {
    PetscBool failed = PETSC_FALSE;

    PetscCall(SbRunSolve(scene.run));
    again = scene.run->clock.paused;
    if (r && !again)
      PetscCall(check_after_failure(r, scene.run, &failed));
    if (again || failed)
      PetscCall(apply(r, &scene, &any));
    if (failed)
      again = any;
    *model = scene.model;
    *run = scene.run;
    if (ledger)
      *ledger = scene.ledger;
  } while (again);
  PetscFunctionReturn(PETSC_SUCCESS);
}
