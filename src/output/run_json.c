/*
  run.json: what ran, where, with which settings, how long and how it ended. Written when a run
  starts (status "running") and replaced as a whole when it ends; a run that was killed leaves the
  first version.
*/
#include <stdarg.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbsolver.h"

#if defined(__clang__)
  #define COMPILER __VERSION__
#else
  #define COMPILER "GCC " __VERSION__
#endif

/*
  Prints JSON: ' stands for ", $s for a text with its quotes, $d for a PetscInt, and $g for a real
  number, null where it is none.
*/
static void put(FILE *f, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  for (; *format; format++) {
    if (*format != '$') {
      (void)fputc(*format == '\'' ? '"' : *format, f);
    } else if (*++format == 'd') {
      (void)fprintf(f, "%" PetscInt_FMT, va_arg(args, PetscInt));
    } else if (*format == 'g') {
      const double value = va_arg(args, double);

      (void)fprintf(f, PetscIsInfOrNanReal(value) ? "null" : "%.10g", value);
    } else {
      (void)fputc('"', f);
      for (const char *text = va_arg(args, const char *); *text; text++)
        if (*text == '"' || *text == '\\')
          (void)fprintf(f, "\\%c", *text);
        else if ((unsigned char)*text < 32)
          (void)fprintf(f, "\\u%04x", *text);
        else
          (void)fputc(*text, f);
      (void)fputc('"', f);
    }
  }
  va_end(args);
}

/* The whole text, on one rank; phases is NULL when nothing was timed. */
static PetscErrorCode write_json(SbRun run, SbOutput out, const char *status, const char *reason,
                                 const SbPhases *phases, char message[SB_MESSAGE_MAX])
{
  const SbModel m = run->model;
  char host[256] = "";
  char path[PETSC_MAX_PATH_LEN];
  char *text = NULL;
  char *options, name[SB_NAME_MAX];
  char parts[SB_NAME_MAX] = "";
  char environment[1024];
  char mpi[MPI_MAX_LIBRARY_VERSION_STRING];
  size_t size = 0;
  FILE *f = open_memstream(&text, &size);
  int n;

  PetscFunctionBeginUser;
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for run.json");

  // versions of the program and its libraries, machine
  (void)MPI_Get_library_version(mpi, &n);
  mpi[strcspn(mpi, ",\n")] = 0;
  (void)gethostname(host, sizeof(host) - 1);
  put(
    f,
    "{\n  'program': 'supple',\n  'version': $s,\n  'petsc': $s,\n  'mpi': $s,\n  'hdf5': $s,\n"
    "  'compiler': $s,\n  'host': $s,\n  'cores': $d,\n  'ranks': $d,\n  'threads_per_rank': $d,\n"
    "  'started': $s,\n  'scenario': $s,\n  'bodies': [",
    SB_VERSION, SB_PETSC_VERSION, mpi, H5_VERS_INFO, COMPILER, host,
    (PetscInt)sysconf(_SC_NPROCESSORS_ONLN), (PetscInt)out->size, (PetscInt)SbThreadsSetOne(),
    out->started, out->scenario);

  // bodies with their meshes and materials
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbBody *body = &m->body[b];
    const SbMaterial material = m->material[b];

    put(f, b ? ",\n    {" : "\n    {");
    put(f,
        "'name': $s, 'mesh': $s, 'tets': $d, 'vertices': $d, 'volume': $g, 'min_dihedral': $g, "
        "'max_radius_ratio': $g,\n     'element': $s, 'nodes': $d, 'unknowns': $d, 'material': $s, "
        "'young': $g, 'poisson': $g, 'density': $g}",
        body->name, body->mesh, body->ncell, body->nvert, body->volume, body->min_dihedral,
        body->max_radius_ratio, body->element, out->body_nodes[b], 3 * out->body_nodes[b],
        material->type->name, SbMaterialYoungModulus(material), SbMaterialPoisson(material),
        material->density);
  }

  // settings; the solver is the current one: a fallback may have replaced it
  SbRunIntegrator(run, sizeof(name), name);
  if (run->solve.solver_parts[0])
    PetscCall(SbSolverDescribe(run->solve.snes, m->space, sizeof(parts), parts));
  put(f,
      "\n  ],\n  'time': $s,\n  'solver': $s,\n  'solver_reason': $s,\n  'solver_parts': $s,\n"
      "  'unknowns': $d,\n  'dt': $g,\n  't_start': $g,\n  't_end': $g,\n",
      name, run->solve.solver, run->solve.solver_reason, parts, 3 * m->space->Nnode, run->clock.dt,
      run->clock.t0, run->clock.t_end);
  for (int notes = 0; notes < 2; notes++) {
    put(f, notes ? "  'effect_notes': [" : "  'effects': [");
    for (PetscInt e = 0; e < m->neffect; e++)
      put(f, e ? ", $s" : "$s", notes ? m->effect[e]->note : m->effect[e]->name);
    put(f, "],\n");
  }
  PetscCall(PetscOptionsGetAll(NULL, &options));
  put(f, "  'options': $s,\n", options);
  PetscCall(SbOptionsEnvironment(sizeof(environment), environment));
  put(f, "  'options_of_environment': $s,\n", environment);
  PetscCall(PetscFree(options));

  // events of re-meshing
  for (PetscInt i = 0; i < out->nremeshed; i++) {
    const SbRemeshed *r = &out->remeshed[i];

    put(f, i ? ",\n    {" : "  'remeshed': [\n    {");
    put(f,
        "'body': $s, 'step': $d, 'time': $g, 'tets': [$d, $d], 'vertices': [$d, $d], "
        "'vertices_moved': $d,\n"
        "     'quality_before': $g, 'quality_after': $g, 'energy_before': $g, 'energy_after': $g,\n"
        "     'rigid_speed': $g, 'centre_shift': $g}",
        r->body, r->step, r->t, r->tets[0], r->tets[1], r->vertices[0], r->vertices[1], r->moved,
        r->quality[0], r->quality[1], r->energy[0], r->energy[1], r->speed, r->shift);
  }
  if (out->nremeshed)
    put(f, "\n  ],\n");

  // stability of static equilibria
  if (phases && !m->dynamic)
    put(f, "  'equilibria': {'known': $d, 'unstable': $d, 'unknown': $d},\n  'steps_cut': $d,\n",
        run->stability.nknown, run->stability.nunstable, run->stability.nunknown,
        run->counters.turned);

  // cost: steps, iterations, seconds, memory, files
  if (phases) {
    SbOutputFileSize *file;
    PetscInt nfile;

    put(f,
        "  'steps': $d,\n  'newton_iterations': $d,\n  'linear_iterations': $d,\n  "
        "'rejected_steps': $d,\n"
        "  'seconds': {",
        run->counters.steps, run->counters.newton, run->counters.linear, run->counters.rejected);
    for (int i = 0; i < SB_PHASE_COUNT; i++)
      put(f, "$s: $g, ", SbPhaseNames[i], phases->seconds[i]);
    put(f,
        "'time loop': $g, 'total': $g},\n  'cpu_seconds_max': $g,\n  'memory_max_bytes': $g,\n"
        "  'memory_sum_bytes': $g,\n  'files': [",
        run->counters.seconds_solve, phases->total, phases->cpu, phases->memory_max,
        phases->memory_sum);
    PetscCall(SbOutputFiles(out, &nfile, &file));
    for (PetscInt i = 0; i < nfile; i++)
      (void)fprintf(f, "%s\n    {\"name\": \"%s\", \"bytes\": %" PetscInt64_FMT "}", i ? "," : "",
                    file[i].name, file[i].bytes);
    PetscCall(PetscFree(file));
    put(f, "\n  ],\n");
  }
  put(f, "  'reason': $s,\n", reason);
  if (run->clock.stopped)
    put(f, "  'go_on': $s,\n",
        run->monitors.last.step > run->clock.step0 ? "-restart latest" : "-restart auto");
  put(f, "  'status': $s\n}\n", status);
  (void)fclose(f);
  SbOutputPath(out, "run.json", path);
  SbFileReplace(path, text, size, message);
  free(text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *const SbPhaseNames[SB_PHASE_COUNT] = {
  "mesh",    "set-up",         "residual", "tangent", "linear solve",
  "contact", "contact search", "energies", "output",  "other"};

PetscErrorCode SbPhasesGet(SbOutput out, SbPhases *p)
{
  struct rusage usage;

  PetscFunctionBeginUser;
  PetscCall(SbLogSeconds(p->seconds));
  PetscCall(PetscTime(&p->total));
  p->seconds[SB_PHASE_OTHER] = p->total - out->wall_start;
  p->cpu = SB_CPU_SECONDS - out->cpu_start;
  (void)getrusage(RUSAGE_SELF, &usage);
  p->memory_max = p->memory_sum = 1024. * (PetscReal)usage.ru_maxrss;
  p->total = p->seconds[SB_PHASE_OTHER];
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, p->seconds, SB_PHASE_COUNT, MPIU_REAL, MPI_SUM, out->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &p->total, 1, MPIU_REAL, MPI_MAX, out->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &p->cpu, 1, MPIU_REAL, MPI_MAX, out->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &p->memory_max, 1, MPIU_REAL, MPI_MAX, out->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &p->memory_sum, 1, MPIU_REAL, MPI_SUM, out->comm));
  p->seconds[SB_PHASE_OTHER] = p->total;
  for (int i = 0; i < SB_PHASE_OTHER; i++) {
    p->seconds[i] /= out->size;
    p->seconds[SB_PHASE_OTHER] -= p->seconds[i];
  }
  p->seconds[SB_PHASE_OTHER] = PetscMax(p->seconds[SB_PHASE_OTHER], 0.);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunJson(SbRun run, SbOutput out, const char *status, const char *reason)
{
  SbPhases phases;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  PetscCall(SbPhasesGet(out, &phases));
  if (!out->rank)
    PetscCall(write_json(run, out, status, reason, &phases, message));
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReportFailure(SbRun run, const char *reason)
{
  SbOutput out = run ? (SbOutput)run->monitors.output : NULL;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  if (!out || !out->attached)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbProgressEnd(out);
  PetscCall(write_json(run, out, "failed", reason, NULL, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}
