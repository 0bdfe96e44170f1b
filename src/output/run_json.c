/*
  run.json: what ran, where, with which settings, how long and how it ended. Written when a run starts (status
  "running") and replaced as a whole when it ends; a run that was killed leaves the first version.
*/
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbsolver.h"

/* A JSON string with its quotes. */
static void put_string(FILE *f, const char *text)
{
  (void)fputc('"', f);
  for (; *text; text++) {
    const unsigned char c = (unsigned char)*text;

    if (c == '"' || c == '\\')
      (void)fprintf(f, "\\%c", c);
    else if (c < 32)
      (void)fprintf(f, "\\u%04x", c);
    else
      (void)fputc(c, f);
  }
  (void)fputc('"', f);
}

static void put_text(FILE *f, const char *key, const char *text)
{
  (void)fprintf(f, "  \"%s\": ", key);
  put_string(f, text);
  (void)fputs(",\n", f);
}

/* JSON has no infinity and no NaN. */
static void put_real(FILE *f, const char *key, PetscReal value, const char *end)
{
  if (PetscIsInfOrNanReal(value))
    (void)fprintf(f, "\"%s\": null%s", key, end);
  else
    (void)fprintf(f, "\"%s\": %.10g%s", key, (double)value, end);
}

static PetscErrorCode put_settings(FILE *f, SbRun run)
{
  char name[SB_NAME_MAX], parts[SB_NAME_MAX] = "";
  char *options;

  PetscFunctionBeginUser;
  SbRunIntegrator(run, sizeof(name), name);
  put_text(f, "time", name);
  put_text(f, "solver", run->solver);
  put_text(f, "solver_reason", run->solver_reason);
  /* the current one: a fallback may have replaced it */
  if (run->solver_parts[0]) PetscCall(SbSolverDescribe(run->snes, run->model->space, sizeof(parts), parts));
  put_text(f, "solver_parts", parts);
  (void)fprintf(f, "  \"unknowns\": %" PetscInt_FMT ",\n  ", 3 * run->model->space->Nnode);
  put_real(f, "dt", run->dt, ",\n  ");
  put_real(f, "t_start", run->t0, ",\n  ");
  put_real(f, "t_end", run->t_end, ",\n");
  for (int notes = 0; notes < 2; notes++) {
    (void)fprintf(f, "  \"%s\": [", notes ? "effect_notes" : "effects");
    for (PetscInt e = 0; e < run->model->neffect; e++) {
      (void)fprintf(f, "%s", e ? ", " : "");
      put_string(f, notes ? run->model->effect[e]->note : run->model->effect[e]->name);
    }
    (void)fprintf(f, "],\n");
  }
  PetscCall(PetscOptionsGetAll(NULL, &options));
  put_text(f, "options", options);
  PetscCall(PetscFree(options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole text, on one rank; phases is NULL when nothing was timed. */
static PetscErrorCode write_json(SbRun run, SbOutput out, const char *status, const char *reason,
                                 const SbPhases *phases, char message[SB_MESSAGE_MAX])
{
  char host[256] = "", path[PETSC_MAX_PATH_LEN], *text = NULL, mpi[MPI_MAX_LIBRARY_VERSION_STRING];
  size_t size = 0;
  FILE *f = open_memstream(&text, &size);
  int n;

  PetscFunctionBeginUser;
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for run.json");
  (void)fprintf(f, "{\n  \"program\": \"supple\",\n");
  // versions of the program and its libraries
  put_text(f, "version", SB_VERSION);
  put_text(f, "petsc", SB_PETSC_VERSION);
  (void)MPI_Get_library_version(mpi, &n);
  mpi[strcspn(mpi, ",\n")] = 0;
  put_text(f, "mpi", mpi);
  put_text(f, "hdf5", H5_VERS_INFO);
#if defined(__clang__)
  put_text(f, "compiler", __VERSION__);
#else
  put_text(f, "compiler", "GCC " __VERSION__);
#endif
  (void)gethostname(host, sizeof(host) - 1);
  put_text(f, "host", host);
  (void)fprintf(f, "  \"cores\": %ld,\n  \"ranks\": %d,\n  \"threads_per_rank\": %d,\n",
                sysconf(_SC_NPROCESSORS_ONLN), (int)out->size, SbThreadsSetOne());
  put_text(f, "started", out->started);
  put_text(f, "scenario", out->scenario);
  // bodies with their meshes and materials
  (void)fprintf(f, "  \"bodies\": [");
  for (PetscInt b = 0; b < run->model->nbody; b++) {
    const SbBody *body = &run->model->body[b];
    const SbMaterial material = run->model->material[b];

    (void)fprintf(f, "%s\n    {\"name\": ", b ? "," : "");
    put_string(f, body->name);
    (void)fprintf(f, ", \"mesh\": ");
    put_string(f, body->mesh);
    (void)fprintf(f, ", \"tets\": %" PetscInt_FMT ", \"vertices\": %" PetscInt_FMT ", ", body->ncell,
                  body->nvert);
    put_real(f, "volume", body->volume, ", ");
    put_real(f, "min_dihedral", body->min_dihedral, ", ");
    put_real(f, "max_radius_ratio", body->max_radius_ratio, ",\n     ");
    (void)fprintf(f, "\"element\": \"%s\", \"nodes\": %" PetscInt_FMT ", \"unknowns\": %" PetscInt_FMT ", ",
                  body->element, out->body_nodes[b], 3 * out->body_nodes[b]);
    (void)fprintf(f, "\"material\": \"%s\", ", material->law);
    put_real(f, "young", material->E, ", ");
    put_real(f, "poisson", material->nu, ", ");
    put_real(f, "density", material->density, "}");
  }
  (void)fprintf(f, "\n  ],\n");
  PetscCall(put_settings(f, run));
  // events of re-meshing
  if (out->nremeshed) {
    (void)fprintf(f, "  \"remeshed\": [");
    for (PetscInt i = 0; i < out->nremeshed; i++) {
      const SbRemeshed *r = &out->remeshed[i];

      (void)fprintf(f, "%s\n    {\"body\": ", i ? "," : "");
      put_string(f, r->body);
      (void)fprintf(f, ", \"step\": %" PetscInt_FMT ", ", r->step);
      put_real(f, "time", r->t, ", ");
      (void)fprintf(f,
                    "\"tets\": [%" PetscInt_FMT ", %" PetscInt_FMT "], \"vertices\": [%" PetscInt_FMT
                    ", %" PetscInt_FMT "], \"vertices_moved\": %" PetscInt_FMT ",\n     ",
                    r->tets[0], r->tets[1], r->vertices[0], r->vertices[1], r->moved);
      put_real(f, "quality_before", r->quality[0], ", ");
      put_real(f, "quality_after", r->quality[1], ", ");
      put_real(f, "energy_before", r->energy[0], ", ");
      put_real(f, "energy_after", r->energy[1], ",\n     ");
      put_real(f, "rigid_speed", r->speed, ", ");
      put_real(f, "centre_shift", r->shift, "}");
    }
    (void)fprintf(f, "\n  ],\n");
  }
  // cost: steps, iterations, seconds, memory, files
  if (phases) {
    SbOutputFileSize *file;
    PetscInt nfile;

    (void)fprintf(f,
                  "  \"steps\": %" PetscInt_FMT ",\n  \"newton_iterations\": %" PetscInt_FMT
                  ",\n  \"linear_iterations\": %" PetscInt_FMT ",\n  \"rejected_steps\": %" PetscInt_FMT
                  ",\n",
                  run->steps_total, run->newton_total, run->linear_total, run->rejected_total);
    (void)fprintf(f, "  \"seconds\": {");
    for (int i = 0; i < SB_PHASE_COUNT; i++)
      put_real(f, phases->phase[i].name, phases->phase[i].seconds, ", ");
    put_real(f, "time loop", run->seconds_solve, ", ");
    put_real(f, "total", phases->total, "},\n  ");
    put_real(f, "cpu_seconds_max", phases->cpu, ",\n  ");
    put_real(f, "memory_max_bytes", phases->memory_max, ",\n  ");
    put_real(f, "memory_sum_bytes", phases->memory_sum, ",\n");
    (void)fprintf(f, "  \"files\": [");
    PetscCall(SbOutputFiles(out, &nfile, &file));
    for (PetscInt i = 0; i < nfile; i++)
      (void)fprintf(f, "%s\n    {\"name\": \"%s\", \"bytes\": %" PetscInt64_FMT "}", i ? "," : "",
                    file[i].name, file[i].bytes);
    PetscCall(PetscFree(file));
    (void)fprintf(f, "\n  ],\n");
  }
  put_text(f, "reason", reason);
  if (run->stopped) put_text(f, "go_on", run->seen.step > run->step0 ? "-restart latest" : "-restart auto");
  (void)fprintf(f, "  \"status\": \"%s\"\n}\n", status);
  (void)fclose(f);
  PetscCall(SbOutputPath(out, "run.json", sizeof(path), path));
  SbFileReplace(path, text, size, message);
  free(text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPhasesGet(SbOutput out, SbPhases *p)
{
  static const char *const names[SB_PHASE_COUNT] = {"mesh",         "set-up",  "residual",       "tangent",
                                                    "linear solve", "contact", "contact search", "energies",
                                                    "output",       "other"};
  enum { CPU = SB_PHASE_COUNT, MEMORY, N };
  PetscReal mine[N], most[N];
  struct rusage usage;

  PetscFunctionBeginUser;
  PetscCall(SbLogSeconds(mine));
  PetscCall(PetscTime(&p->total));
  p->total -= out->wall_start;
  mine[SB_PHASE_OTHER] = p->total;
  mine[CPU] = SB_CPU_SECONDS - out->cpu_start;
  (void)getrusage(RUSAGE_SELF, &usage);
  mine[MEMORY] = 1024. * (PetscReal)usage.ru_maxrss;
  PetscCallMPI(MPI_Allreduce(mine, most, N, MPIU_REAL, MPI_MAX, out->comm));
  PetscCallMPI(MPI_Allreduce(&mine[MEMORY], &p->memory_sum, 1, MPIU_REAL, MPI_SUM, out->comm));
  p->total = most[SB_PHASE_OTHER];
  for (int i = 0; i < SB_PHASE_OTHER; i++) most[SB_PHASE_OTHER] -= most[i];
  for (int i = 0; i < SB_PHASE_COUNT; i++) {
    p->phase[i].name = names[i];
    p->phase[i].seconds = PetscMax(most[i], 0.);
  }
  p->cpu = most[CPU];
  p->memory_max = most[MEMORY];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunJson(SbRun run, SbOutput out, const char *status, const char *reason)
{
  SbPhases phases;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  PetscCall(SbPhasesGet(out, &phases));
  if (!out->rank) PetscCall(write_json(run, out, status, reason, &phases, message));
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReportFailure(SbRun run, const char *reason)
{
  SbOutput out = run ? (SbOutput)run->output : NULL;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  if (!out || !out->attached) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbProgressEnd(out));
  PetscCall(write_json(run, out, "failed", reason, NULL, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}
