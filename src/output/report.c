/*
  Console output: a header before the run, a table after it. Eighty columns. Seconds of a phase are
  the mean of the ranks; the last phase is the rest of the wall time.
*/
#include <stdarg.h>
#include <time.h>
#include "output_impl.h"
#include "sbsolver.h"

#define WIDTH 79
#define INDENT 11
#define TURNED 10.        /* degrees from which on the law `linear` is wrong by some per cent */
#define TURNED_SHARE 0.01 /* of the volume: less is a corner */

/* "title      words ..." with the words wrapped at WIDTH and indented. */
static void entry(const char *title, const char *format, ...)
{
  char text[2048], *word;
  int column = INDENT;
  va_list args;

  va_start(args, format);
  (void)vsnprintf(text, sizeof(text), format, args);
  va_end(args);
  (void)PetscPrintf(PETSC_COMM_SELF, "%-*s", INDENT - 1, title);
  for (word = strtok(text, " "); word; word = strtok(NULL, " ")) {
    const int n = (int)strlen(word);

    if (column + 1 + n > WIDTH && column > INDENT) {
      (void)PetscPrintf(PETSC_COMM_SELF, "\n%*s", INDENT - 1, "");
      column = INDENT;
    }
    (void)PetscPrintf(PETSC_COMM_SELF, " %s", word);
    column += n + 1;
  }
  (void)PetscPrintf(PETSC_COMM_SELF, "\n");
}

/*
  "liver", or for the first of alike copies "50 x ball"; false for the others. mass[2]: the least
  and the largest of them, kg. Copies are alike in all that the tables say but the mass, as they may
  differ in scale.
*/
static PetscBool line_of_body(SbModel m, SbOutput out, PetscInt b, size_t size, char name[],
                              PetscReal mass[2])
{
  const SbBody *body = &m->body[b];
  const SbMaterial law = m->material[b];
  PetscInt n = 0;

  mass[0] = mass[1] = law->density * body->volume;
  (void)snprintf(name, size, "%s", body->name);
  for (PetscInt k = 0; k < m->nbody && body->copy_of[0]; k++) {
    const SbBody *other = &m->body[k];
    const SbMaterial other_law = m->material[k];

    if (strcmp(other->copy_of, body->copy_of) || strcmp(other->element, body->element) ||
        other->ncell != body->ncell || out->body_nodes[k] != out->body_nodes[b] ||
        other_law->type != law->type ||
        SbMaterialYoungModulus(other_law) != SbMaterialYoungModulus(law) ||
        SbMaterialPoisson(other_law) != SbMaterialPoisson(law) ||
        other_law->density != law->density)
      continue;
    if (k < b)
      return PETSC_FALSE;
    mass[0] = PetscMin(mass[0], other_law->density * other->volume);
    mass[1] = PetscMax(mass[1], other_law->density * other->volume);
    if (++n > 1)
      (void)snprintf(name, size, "%" PetscInt_FMT " x %s", n, body->copy_of);
  }
  return PETSC_TRUE;
}

static void print_bodies(SbModel m, SbOutput out)
{
  char name[2 * SB_NAME_MAX], kg[32];
  PetscInt tets = 0;
  PetscInt nodes = 0;
  PetscReal mass[2];

  (void)PetscPrintf(PETSC_COMM_SELF, "\n%-15s %-7s %8s %9s %9s %13s %12s\n", "body", "element",
                    "tets", "nodes", "unknowns", "min angle deg", "radius ratio");
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbBody *body = &m->body[b];
    const PetscInt n = out->body_nodes[b];

    tets += body->ncell;
    nodes += n;
    if (!line_of_body(m, out, b, sizeof(name), name, mass))
      continue;
    (void)PetscPrintf(
      PETSC_COMM_SELF,
      "%-15.15s %-7.7s %8" PetscInt_FMT " %9" PetscInt_FMT " %9" PetscInt_FMT " %13.1f %12.2f\n",
      name, body->element, body->ncell, n, 3 * n, body->min_dihedral, body->max_radius_ratio);
  }
  if (m->nbody > 1)
    (void)PetscPrintf(PETSC_COMM_SELF,
                      "%-15s %-7s %8" PetscInt_FMT " %9" PetscInt_FMT " %9" PetscInt_FMT "\n",
                      "together", "", tets, nodes, 3 * nodes);
  (void)PetscPrintf(PETSC_COMM_SELF, "\n%-15s %-12s %11s %9s %14s %12s\n", "body", "material",
                    "E (Pa)", "nu", "rho (kg/m^3)", "mass (kg)");
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbMaterial material = m->material[b];

    if (!line_of_body(m, out, b, sizeof(name), name, mass))
      continue;
    if (mass[1] - mass[0] > 1e-5 * mass[1])
      SbFormat(sizeof(kg), kg, "%.2g-%.2g", mass[0], mass[1]);
    else
      SbFormat(sizeof(kg), kg, "%.5g", mass[0]);
    (void)PetscPrintf(PETSC_COMM_SELF, "%-15.15s %-12.12s %11.4g %9.6g %14.6g %12s\n", name,
                      material->type->name, SbMaterialYoungModulus(material),
                      SbMaterialPoisson(material), material->density, kg);
  }
  (void)PetscPrintf(PETSC_COMM_SELF, "\n");
}

PetscErrorCode SbReportHeader(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;
  char threads[64] = "one thread";
  char text[1024] = "";
  char name[SB_NAME_MAX];
  int most;

  PetscFunctionBeginUser;
  if (out->quiet || out->rank)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* number of threads of a library that cannot be limited to one */
  most = SbThreadsSetOne();
  if (most > 1)
    (void)snprintf(threads, sizeof(threads), "up to %d threads", most);
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "supple %s with PETSc %s on %d rank%s, %s each\n",
                        SB_VERSION, SB_PETSC_VERSION, (int)out->size, out->size == 1 ? "" : "s",
                        threads));
  print_bodies(run->model, out);
  if (out->scenario[0])
    entry("scenario", "%s", out->scenario);
  PetscCall(SbOptionsEnvironment(sizeof(text), text));
  if (text[0])
    entry("environment", "PETSC_OPTIONS gives %s", text);
  text[0] = 0;

  // effects, with the notes of their set-up
  for (PetscInt e = 0; e < run->model->neffect; e++) {
    const SbEffect effect = run->model->effect[e];

    SbAppend(sizeof(text), text, "%s%s", e ? ", " : "", effect->name);
    if (strcmp(effect->name, effect->type))
      SbAppend(sizeof(text), text, " (%s)", effect->type);
  }
  entry("effects", "%s", text[0] ? text : "none");
  for (PetscInt e = 0; e < run->model->neffect; e++)
    if (run->model->effect[e]->note[0])
      entry("effect", "%s: %s", run->model->effect[e]->name, run->model->effect[e]->note);

  // integrator and steps
  SbRunIntegrator(run, sizeof(name), name);
  if (run->clock.arc.on)
    entry("time", "%s, along the path of equilibria; load increment of the first step %g", name,
          1. / (double)run->clock.static_steps);
  else if (!run->model->dynamic)
    entry("time", "%s, %" PetscInt_FMT " load step%s", name, run->clock.static_steps,
          run->clock.static_steps == 1 ? "" : "s");
  else
    entry("time", "%s, t = %g to %g s%s %g s", name, run->clock.t0, run->clock.t_end,
          run->clock.fixed ? " in steps of" : ", adaptive steps, the first one", run->clock.dt);
  if (run->solve.solver_parts[0] && strcmp(run->solve.solver, run->solve.solver_parts))
    entry("solver", "%s (%s): %s", run->solve.solver, run->solve.solver_parts,
          run->solve.solver_reason);
  else
    entry("solver", "%s: %s", run->solve.solver, run->solve.solver_reason);
  text[0] = 0;
  for (PetscInt k = 0; k < out->nfield; k++)
    SbAppend(sizeof(text), text, "%s%s", k ? ", " : ": ", out->field[k]->name);
  if (out->nfield && out->every > 0.)
    SbAppend(sizeof(text), text, " every %g s", out->every);
  else if (out->nfield && out->every_steps > 1)
    SbAppend(sizeof(text), text, " every %" PetscInt_FMT " steps", out->every_steps);
  else if (out->nfield)
    SbAppend(sizeof(text), text, " every step");
  if (out->history)
    SbAppend(sizeof(text), text, "%s history", out->nfield ? ";" : ":");
  entry("output", "%s%s", out->dir, text);
  for (PetscInt p = 0; p < out->nprobe && out->history; p++) {
    const SbProbe *probe = &out->probe[p];
    char where[64] = "a tet";

    if (probe->kind != SB_PROBE_POINT) {
      entry("probe", "%s: mean over the %s of '%s'", probe->name,
            probe->kind == SB_PROBE_FACETS ? "facets" : "tets", probe->set);
      continue;
    }
    if (probe->original >= run->model->mesh->Nvert)
      (void)snprintf(where, sizeof(where), "the node of an edge");
    else if (probe->original >= 0)
      (void)snprintf(where, sizeof(where), "vertex %lld", (long long)probe->original);
    entry("probe", "%s at %s (%g, %g, %g) m, %.3g m from the given position", probe->name, where,
          probe->x[0], probe->x[1], probe->x[2], PetscSqrtReal(SbDistance2(probe->x, probe->at)));
  }
  (void)fflush(PETSC_STDOUT);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReportShown(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;

  PetscFunctionBeginUser;
  PetscCall(SbFramesClose(out));
  PetscCall(SbRunJson(run, out, "shown", "-show"));
  PetscCall(PetscPrintf(out->comm, "\nNothing was computed. A picture: scripts/render %s --show\n",
                        out->dir));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReportRemeshed(SbRun run, const SbRemeshed *event)
{
  SbOutput out = (SbOutput)run->monitors.output;
  const PetscReal change = event->energy[1] - event->energy[0];

  PetscFunctionBeginUser;
  if (!out)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(out->nremeshed + 1, sizeof(*event), &out->remeshed_size, &out->remeshed));
  out->remeshed[out->nremeshed++] = *event;
  if (out->quiet)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbProgressEnd(out);
  PetscCall(PetscPrintf(out->comm,
                        "body '%s' is re-meshed after step %" PetscInt_FMT
                        ", t = %g%s: worst quality %.3g -> %.3g, %" PetscInt_FMT
                        " -> %" PetscInt_FMT " tets, energy %+.3g J (%+.2g %%)\n",
                        event->body, event->step, event->t, run->model->dynamic ? " s" : "",
                        event->quality[0], event->quality[1], event->tets[0], event->tets[1],
                        change, (event->energy[0] > 0. ? 100. * change / event->energy[0] : 0.)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void size_text(PetscReal bytes, size_t size, char text[])
{
  static const char *const unit[] = {"B", "kB", "MB", "GB"};
  int k = 0;

  for (; bytes >= 1e3 && k < 3; k++)
    bytes /= 1e3;
  SbFormat(size, text, k ? "%.3g %s" : "%.0f %s", bytes, unit[k]);
}

PetscErrorCode SbReportSummary(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;
  const PetscBool stopped = (PetscBool)(run->clock.stop_reason[0] != 0);
  const char *const status = run->clock.cut_short ? "cut short" : "completed";
  PetscReal turned;
  SbPhases phases;
  char files[1024] = "";
  char memory[32], sum[32], solver[SB_NAME_MAX], text[512];
  SbOutputFileSize *file;
  PetscInt nfile;

  PetscFunctionBeginUser;
  SbProgressEnd(out);
  PetscCall(SbFramesClose(out));
  PetscCall(SbRunJson(run, out, stopped ? "stopped" : status,
                      run->clock.cut_short && !stopped ? "-ts_max_steps" : run->clock.stop_reason));
  PetscCall(SbPhasesGet(out, &phases));
  if (run->monitors.want_energies && run->state.energies.ninverted)
    PetscCall(
      SbWarning(run->model->comm,
                "%" PetscInt_FMT
                " tetrahedra are inverted or flat at the end (det F down to %g): what they show is "
                "no deformation of a body. Smaller steps or loads may avoid it; laws differ in how "
                "they come back, see docs/reference/guarantees.md",
                run->state.energies.ninverted, run->state.energies.min_J));
  PetscCall(SbModelTurned(run->model, run->state.U, TURNED * PETSC_PI / 180., &turned));
  if (turned > TURNED_SHARE)
    PetscCall(SbWarning(run->model->comm,
                        "%.3g %% of what has -body_NAME_material linear is turned by more than %g "
                        "degrees at the end: the law is one of small rotations, and takes a turn "
                        "for a strain; corotated or neohookean do not",
                        (double)(100. * turned), TURNED));
  PetscCall(SbModelWarnHeldLoads(run->model, run->clock.t, run->state.U, run->state.V));
  PetscCall(SbContactSetWarnAtEnd(&run->model->contacts));
  if (out->quiet)
    PetscFunctionReturn(PETSC_SUCCESS);

  // seconds of the phases
  if (!out->rank) {
    const PetscReal steps = (PetscReal)run->counters.steps;
    const PetscReal tets = (PetscReal)run->model->mesh->Ncell;

    PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n%-15s %10s %8s %14s %18s\n", "phase", "seconds",
                          "share", "ms per step", "us per step, tet"));
    for (int i = 0; i < SB_PHASE_COUNT; i++) {
      const PetscReal seconds = phases.seconds[i];

      if ((i == SB_PHASE_CONTACT || i == SB_PHASE_SEARCH) && !(seconds > 0))
        continue; /* none in the scene */
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-15s %10.3f %7.1f%%", SbPhaseNames[i], seconds,
                            (phases.total > 0. ? 100. * seconds / phases.total : 0.)));
      if (steps > 0. && i > SB_PHASE_SETUP)
        PetscCall(PetscPrintf(PETSC_COMM_SELF, " %14.3f %18.4f", (1e3 * seconds / steps),
                              (1e6 * seconds / steps / tets)));
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n"));
    }
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-15s %10.3f\n\n", "total", phases.total));
  }

  /* summaries of effects */
  for (PetscInt e = 0; e < run->model->neffect; e++) {
    const SbEffect effect = run->model->effect[e];

    if (!effect->ops.summary)
      continue;
    text[0] = 0;
    PetscCall(effect->ops.summary(effect, run->model->space, sizeof(text), text));
    if (!out->rank && text[0])
      entry("effect", "%s: %s", effect->name, text);
  }
  if (out->rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  entry("steps",
        "%" PetscInt_FMT " (%" PetscInt_FMT " attempts rejected), %" PetscInt_FMT
        " Newton and %" PetscInt_FMT " linear iterations",
        run->counters.steps, run->counters.rejected, run->counters.newton, run->counters.linear);
  if (run->counters.unsolved)
    entry("",
          "%" PetscInt_FMT " of %" PetscInt_FMT
          " steps ended before they were solved, with at most "
          "%.3g m left of their displacement (-contact_quality fast)",
          run->counters.unsolved, run->counters.steps, (double)run->counters.most_left);
  if (run->counters.turned)
    entry("",
          "%" PetscInt_FMT " load steps were cut, in which supports would turn by more than 30 "
          "degrees, cells turned by more than 90, or that ended in an unstable equilibrium "
          "(-static_adapt)",
          run->counters.turned);
  if (run->stability.nunstable)
    entry("", "%" PetscInt_FMT " of %" PetscInt_FMT " equilibria examined are unstable",
          run->stability.nunstable, run->stability.nknown);
  if (run->stability.nunknown)
    entry("", "the stability of %" PetscInt_FMT " of %" PetscInt_FMT " equilibria is not known",
          run->stability.nunknown, run->stability.nknown + run->stability.nunknown);
  if (run->solve.solver_parts[0]) {
    PetscCall(SbSolverDescribe(run->solve.snes, run->model->space, sizeof(solver), solver));
    if (strcmp(solver, run->solve.solver_parts))
      entry("solver", "%s at the end, %s at first", solver, run->solve.solver_parts);
  }
  size_text(phases.memory_max, sizeof(memory), memory);
  size_text(phases.memory_sum, sizeof(sum), sum);
  entry("memory",
        out->size > 1 ? "%s at the peak of the largest rank, %s together" : "%s at the peak",
        memory, sum);
  PetscCall(SbOutputFiles(out, &nfile, &file));
  for (PetscInt i = 0; i < nfile; i++) {
    size_text((PetscReal)file[i].bytes, sizeof(memory), memory);
    SbAppend(sizeof(files), files, "%s%s %s", i ? ", " : "", file[i].name, memory);
  }
  PetscCall(PetscFree(file));
  entry("files", "in %s: %s", out->dir, files);
  if (stopped)
    entry("stopped", "%s", run->clock.stop_reason);
  (void)fflush(PETSC_STDOUT);
  PetscFunctionReturn(PETSC_SUCCESS);
}
