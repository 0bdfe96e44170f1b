/*
  Options of the output, the complete scenario, and the monitors of a run.
*/
#include <inttypes.h>
#include <signal.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "output_impl.h"

const SbOption SbOutputRows[] = {
  {"output_dir", SB_OPTION_STRING, 1, "", "", "",
   "folder of the results; empty: out/<name of the scenario file>"},
  {"show", SB_OPTION_BOOL, 1, "", "false", "",
   "print where bodies, sets, effects and obstacles are at the start, write this frame with the "
   "sets to the folder <output_dir>_show, and end without computing anything; scripts/render "
   "FOLDER --show draws it"},
  {"output_overwrite", SB_OPTION_BOOL, 1, "", "false", "",
   "replace the results of an earlier run in the folder; if not, they are moved into its subfolder "
   "before_DATE"},
  {"output_fields", SB_OPTION_NAMES, 1, "", "position,displacement,velocity,von_mises", "",
   "fields in fields.h5: position, displacement, velocity, acceleration, reaction, contact_force, "
   "contact_pressure, contact_gap, nodal_stress, nodal_von_mises, stress, von_mises, pressure, "
   "mean_pressure, J, energy_density, space_error, fibre, sheet, active_tension, growth, rank; "
   "sets: where the sets and groups are that the scenario names; none: no such file"},
  {"output_every", SB_OPTION_REAL, 1, "s", "0", "[0, inf)",
   "simulated time between frames of fields.h5; 0: by output_every_steps"},
  {"output_every_steps", SB_OPTION_INT, 1, "", "1", "[1, inf)",
   "steps between frames of fields.h5, while output_every is 0"},
  {"output_precision", SB_OPTION_CHOICE, 1, "", "float", "float|double", "numbers in fields.h5"},
  {"output_discontinuous", SB_OPTION_BOOL, 1, "", "false", "",
   "each tet in fields.h5 has points of its own, so that cr and dg are discontinuous as computed; "
   "if not, "
   "values are averaged at the vertices"},
  {"output_quadratic", SB_OPTION_BOOL, 1, "", "false", "",
   "where all bodies are of p2: viewers show quadratic tets; if not, each is eight linear ones "
   "over its ten "
   "nodes"},
  {"output_contacts", SB_OPTION_BOOL, 1, "", "false", "",
   "contacts.vtkhdf, contacts.xmf: the active contact points of each frame, with normals, gaps and "
   "forces"},
  {"output_history", SB_OPTION_BOOL, 1, "", "true", "", "write history.csv"},
  {"output_history_bodies", SB_OPTION_BOOL, 1, "", "false", "",
   "history.csv also has energies, momentum and centre of mass of each body"},
  {"output_history_every", SB_OPTION_INT, 1, "", "1", "[1, inf)",
   "steps between rows of history.csv"},
  {"checkpoint_every_time", SB_OPTION_REAL, 1, "s", "0", "[0, inf)",
   "simulated time between checkpoints; 0: not by time"},
  {"checkpoint_every_steps", SB_OPTION_INT, 1, "", "0", "[0, inf)",
   "steps between checkpoints; 0: not by steps"},
  {"checkpoint_keep", SB_OPTION_INT, 1, "", "2", "[1, inf)", "checkpoints kept, the newest ones"},
  {"restart", SB_OPTION_STRING, 1, "", "", "",
   "checkpoint to resume from, or latest: the newest one in output_dir, or auto: that one if there "
   "is any; "
   "empty: start from the beginning"},
  {"probes", SB_OPTION_NAMES, 1, "", "", "",
   "names of probes: points, surfaces and volumes whose displacement or other fields are columns "
   "of "
   "history.csv"},
  {"progress", SB_OPTION_BOOL, 1, "", "true", "", "print a progress line"},
  {"quiet", SB_OPTION_BOOL, 1, "", "false", "", "print errors and warnings only"},
  {0},
};

void SbOutputFile(SbRun run, const char *name, char path[PETSC_MAX_PATH_LEN], PetscBool *quiet)
{
  const SbOutput out = (SbOutput)run->monitors.output;

  *quiet = out->quiet;
  SbOutputPath(out, name, path);
}

static PetscErrorCode read_options(SbOutput out, SbModel model)
{
  PetscInt nname;
  char(*names)[SB_NAME_MAX];
  static const char *const shown[] = {"displacement", "sets"}; /* fields of -show */
  PetscBool show;

  PetscFunctionBeginUser;
  PetscCall(SbOptionBool(&SbRunScope, "show", &show));

  /* the folder; without a name, out/<scenario without folder and ending> */
  PetscCall(SbOptionString(&SbRunScope, "output_dir", sizeof(out->dir), out->dir));
  if (!out->dir[0]) {
    const char *slash = strrchr(out->scenario, '/');
    const char *base = slash ? slash + 1 : out->scenario;
    const char *dot = strrchr(base, '.');

    SbFormat(sizeof(out->dir), out->dir, "out/%.*s",
             dot && dot > base ? (int)(dot - base) : (int)sizeof(out->dir), base[0] ? base : "run");
  }

  // not that of the run, whose results stay
  for (size_t n = strlen(out->dir); show && n > 1 && out->dir[n - 1] == '/';)
    out->dir[--n] = 0;
  if (show)
    SbAppend(sizeof(out->dir), out->dir, "_show");
  PetscCheck(strlen(out->dir) + SB_FILE_MAX < PETSC_MAX_PATH_LEN, out->comm, PETSC_ERR_USER,
             "-output_dir %s is too long", out->dir);
  PetscCall(SbOptionBool(&SbRunScope, "output_overwrite", &out->overwrite));
  out->overwrite = (PetscBool)(out->overwrite || show);

  /* the fields of -output_fields, without those that a static run lacks; and body */
  PetscCall(SbOptionNames(&SbRunScope, "output_fields", &nname, &names));
  if (nname == 1 && !strcmp(names[0], "none"))
    nname = 0;
  if (show)
    nname = PETSC_STATIC_ARRAY_LENGTH(shown);
  for (PetscInt i = 0; i < nname || (i == nname && out->nfield); i++) {
    const SbField *f;
    PetscInt k = 0;

    PetscCall(SbFieldFind("-output_fields", i < nname ? (show ? shown[i] : names[i]) : "body", &f));
    while (k < out->nfield && out->field[k] != f)
      k++;
    if (k == out->nfield && (model->dynamic || !f->dynamic))
      out->field[out->nfield++] = f;
  }
  PetscCall(PetscFree(names));

  /* contents and intervals */
  PetscCall(SbOptionReal(&SbRunScope, "output_every", &out->every));
  PetscCall(SbOptionInt(&SbRunScope, "output_every_steps", &out->every_steps));
  PetscCall(SbOptionSecond(&SbRunScope, "output_precision", &out->precise));
  PetscCall(SbOptionBool(&SbRunScope, "output_discontinuous", &out->discontinuous));
  PetscCall(SbOptionBool(&SbRunScope, "output_quadratic", &out->quadratic));
  PetscCheck(!out->quadratic || !out->discontinuous, out->comm, PETSC_ERR_USER_INPUT,
             "-output_quadratic yes and -output_discontinuous yes: give one of them");
  for (PetscInt b = 0; out->quadratic && b < model->nbody; b++)
    PetscCheck(!strcmp(model->body[b].element, "p2"), out->comm, PETSC_ERR_USER_INPUT,
               "-output_quadratic yes: all bodies must be of element p2, but '%s' is of %s",
               model->body[b].name, model->body[b].element);
  PetscCall(SbOptionBool(&SbRunScope, "output_contacts", &out->contact_points));
  PetscCheck(!out->contact_points || out->nfield, out->comm, PETSC_ERR_USER_INPUT,
             "-output_contacts yes needs frames, but -output_fields is none: give -output_fields "
             "body at least");
  PetscCall(SbOptionBool(&SbRunScope, "output_history", &out->history));
  PetscCall(SbOptionBool(&SbRunScope, "output_history_bodies", &out->history_bodies));
  PetscCall(SbOptionInt(&SbRunScope, "output_history_every", &out->history_every));
  PetscCall(SbOptionReal(&SbRunScope, "checkpoint_every_time", &out->checkpoint_every));
  PetscCall(SbOptionInt(&SbRunScope, "checkpoint_every_steps", &out->checkpoint_every_steps));
  PetscCall(SbOptionInt(&SbRunScope, "checkpoint_keep", &out->checkpoint_keep));
  PetscCall(SbOptionString(&SbRunScope, "restart", sizeof(out->restart), out->restart));
  PetscCall(SbProbesSetFromOptions(out, model->dynamic));

  // -show writes one frame, whatever the scenario asks for
  if (show) {
    out->contact_points = out->history = PETSC_FALSE;
    out->checkpoint_every = 0.;
    out->checkpoint_every_steps = 0;
    PetscCheck(!out->restart[0], out->comm, PETSC_ERR_USER_INPUT,
               "-show shows the start of a run; leave out -restart %s", out->restart);
  }

  /* live.txt, which has the values of live formulas */
  if (SbLiveCount()) {
    char path[PETSC_MAX_PATH_LEN];
    PetscReal speed, angular_speed, pace;

    PetscCall(SbOptionReal(&SbRunScope, "live_speed", &speed));
    PetscCall(SbOptionReal(&SbRunScope, "live_angular_speed", &angular_speed));
    PetscCall(SbOptionReal(&SbRunScope, "live_pace", &pace));
    SbOutputPath(out, "live.txt", path);
    SbLiveSetUp(path, speed, angular_speed, pace);
  }

  /* console output */
  PetscCall(SbOptionBool(&SbRunScope, "progress", &out->progress));
  PetscCall(SbOptionBool(&SbRunScope, "quiet", &out->quiet));
  out->progress = (PetscBool)(out->progress && !show);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a line with the hash of a file to the identity, unless it has one; only of regular files,
   which can be read again. */
static void add_content(const char *file, FILE *identity, char *const *text)
{
  char line[PETSC_MAX_PATH_LEN + 64];
  char buffer[65536];
  FILE *f = NULL;
  struct stat info;
  size_t n;
  uint64_t sum = 0;

  (void)fflush(identity);
  SbFormat(sizeof(line), line, "\n" SB_CONTENT "%s ", file);
  if (strstr(*text, line) || stat(file, &info) || !S_ISREG(info.st_mode) || !(f = fopen(file, "r")))
    return;
  while ((n = fread(buffer, 1, sizeof(buffer), f)) > 0)
    sum = SbHashBytes(sum, n, buffer);
  (void)fclose(f);
  (void)fprintf(identity, SB_CONTENT "%s %016" PRIx64 "\n", file, sum);
}

/* The files that values of options name: `table:FILE` of formulas, `mesh:FILE` of obstacles. */
static void add_contents(const char *value, FILE *identity, char *const *text)
{
  static const char *const kinds[] = {"table:", "mesh:"};

  for (const char *v = value; *v; v++) {
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(kinds); k++) {
      char file[PETSC_MAX_PATH_LEN];
      int length;

      if ((v > value && !strchr(" ;,\"", v[-1])) || strncmp(v, kinds[k], strlen(kinds[k])))
        continue;
      v += strlen(kinds[k]);
      length = (int)strcspn(v, ";\"");

      // the whole rest, unless commas separate it from other formulas
      SbFormat(sizeof(file), file, "%.*s", length, v);
      if (access(file, R_OK))
        SbFormat(sizeof(file), file, "%.*s", (int)strcspn(v, ",;\""), v);
      for (size_t n = strlen(file); n && file[n - 1] == ' ';)
        file[--n] = 0;
      add_content(file, identity, text);
    }
  }
}

/* The lines of the complete scenario that determine the mechanics, on which a checkpoint must
   agree, and behind them the hashes of the files that they name; the mesh itself is compared, not
   the name of its file. */
static PetscErrorCode keep_identity(SbRun run, SbOutput out, const char *text)
{
  char *lines;
  size_t size;
  FILE *identity = open_memstream(&lines, &size);

  PetscFunctionBeginUser;
  PetscCheck(identity, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for the options");
  (void)fprintf(identity, "-time %s\n", run->model->dynamic ? "dynamic" : "static");
  for (int pass = 0; pass < 2; pass++) {
    for (const char *line = text; *line;
         line += strcspn(line, "\n") + (line[strcspn(line, "\n")] == '\n')) {
      const size_t name = strcspn(line, " \n");
      int length = (int)strcspn(line, "\n#");
      char option[2 * PETSC_MAX_PATH_LEN];

      while (length && line[length - 1] == ' ')
        length--;
      if (!SbHasPrefix(line, "-bodies -body_ -sets -set_ -effects -effect_ -mass") ||
          memmem(line, name, "_mesh", 5) || memmem(line, name, "_remesh_", 8))
        continue;
      SbFormat(sizeof(option), option, "%.*s", length, line);
      if (pass)
        add_contents(option, identity, &lines);
      else
        (void)fprintf(identity, "%.*s\n", length, line);
    }
  }
  (void)fclose(identity);
  PetscCall(PetscStrallocpy(lines, &out->identity));
  free(lines);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;

  PetscFunctionBeginUser;
  if (!out)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbFramesDestroy(out));
  PetscCall(SbHistoryDestroy(out));
  PetscCall(SbOutputForgetMesh(out));
  for (PetscInt p = 0; p < out->nprobe; p++) {
    PetscCall(PetscFree(out->probe[p].nodes.item));
    PetscCall(PetscFree(out->probe[p].cells.item));
    PetscCall(PetscFree(out->probe[p].stresses.item));
  }
  PetscCall(PetscFree(out->probe));
  PetscCall(PetscFree(out->identity));
  PetscCall(PetscFree(out->remeshed));
  SbFolderUnlock(out);
  PetscCall(PetscFree(run->monitors.output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputSetFromOptions(SbRun run, const char *scenario)
{
  SbOutput out;
  time_t now = time(NULL);
  struct tm local;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&out));
  run->monitors.output = out;
  run->monitors.output_destroy = destroy;
  out->lock = -1;
  out->comm = run->model->comm;
  PetscCallMPI(MPI_Comm_rank(out->comm, &out->rank));
  PetscCallMPI(MPI_Comm_size(out->comm, &out->size));
  PetscCall(PetscTime(&out->wall_start));
  out->cpu_start = SB_CPU_SECONDS;
  (void)strftime(out->started, sizeof(out->started), "%Y-%m-%dT%H:%M:%S%z",
                 localtime_r(&now, &local));
  PetscCall(PetscStrncpy(out->scenario, scenario, sizeof(out->scenario)));
  PetscCall(read_options(out, run->model));

  // A limit on the size of files is met as a failed write, with its message, not as a signal.
  (void)signal(SIGXFSZ, SIG_IGN);
  if (!out->rank)
    SbFolderMake(out, message);
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_OPEN, message));
  if (!strcmp(out->restart, "auto")) {
    char path[PETSC_MAX_PATH_LEN];

    PetscCall(PetscStrncpy(out->restart, "latest", sizeof(out->restart)));
    PetscCall(SbCheckpointFind(out, path));
    if (!path[0])
      out->restart[0] = 0;
  }

  // The closing table needs the log events.
  PetscCall(PetscLogDefaultBegin());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputAttach(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;
  char *scenario = NULL;
  char path[PETSC_MAX_PATH_LEN];
  char message[SB_MESSAGE_MAX] = "";
  size_t size = 0;
  PetscViewer viewer;
  FILE *memory;
  PetscMPIInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));

  /* log events of what the scenario asks for: alike on all ranks, also where some have nothing to
     write */
  if (out->nfield)
    PetscCall(SbLogNamed("Out", "fields", &out->event.fields));
  for (PetscInt i = 0; i < out->nfield; i++)
    PetscCall(SbLogNamed("Field", out->field[i]->name, &out->field_event[i]));
  if (out->contact_points)
    PetscCall(SbLogNamed("Out", "contacts", &out->event.contacts));
  if (out->history)
    PetscCall(SbLogNamed("Out", "history", &out->event.history));
  if (out->history && out->nprobe)
    PetscCall(SbLogNamed("Out", "probes", &out->event.probes));
  if (out->progress && !out->quiet)
    PetscCall(SbLogNamed("Out", "progress", &out->event.progress));

  /* load the checkpoint first: if it is refused, the folder stays unchanged */
  PetscCall(SbOutputCountNodes(run->model->space, out));

  // the complete scenario as text on rank 0, and on all ranks the part of it that checkpoints carry
  memory = out->rank ? NULL : open_memstream(&scenario, &size);
  PetscCheck(out->rank || memory, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for scenario.opts");
  PetscCall(PetscViewerASCIIOpenWithFILE(out->comm, memory, &viewer));
  PetscCall(SbOptionsView(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  if (!out->rank) {
    (void)fclose(memory);
    PetscCall(keep_identity(run, out, scenario));
    PetscCall(PetscMPIIntCast((PetscInt)strlen(out->identity) + 1, &n));
  }
  PetscCallMPI(MPI_Bcast(&n, 1, MPI_INT, 0, out->comm));
  if (out->rank)
    PetscCall(PetscMalloc1(n, &out->identity));
  PetscCallMPI(MPI_Bcast(out->identity, n, MPI_CHAR, 0, out->comm));
  if (out->restart[0]) {
    PetscCall(SbCheckpointLoad(run));
    PetscCall(SbFramesCheck(run, out));
  }
  if (!out->rank)
    PetscCall(SbFolderClear(out, run->clock.step0));

  /* scenario.opts and run.json */
  SbOutputPath(out, "scenario.opts", path);
  if (!out->rank)
    SbFileReplace(path, scenario, size, message);
  free(scenario);
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscCall(SbRunJson(run, out, "running", ""));
  out->attached = PETSC_TRUE;

  /* attach monitors */
  PetscCall(SbFramesAttach(run, out));
  PetscCall(SbHistoryAttach(run, out));
  PetscCall(SbCheckpointAttach(run, out));
  PetscCall(SbProgressAttach(run, out));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Row and frame of this step are written, on the old mesh; the next ones are on the new mesh. */
PetscErrorCode SbOutputReattach(SbRun from, SbRun to)
{
  SbOutput out = (SbOutput)from->monitors.output;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  to->monitors.output = out;
  to->monitors.output_destroy = from->monitors.output_destroy;
  from->monitors.output = NULL;
  from->monitors.output_destroy = NULL;
  PetscCall(SbOutputForgetMesh(out));
  PetscCall(SbOutputCountNodes(to->model->space, out));
  PetscCall(SbFramesAttach(to, out));
  PetscCall(SbHistoryAttach(to, out));
  PetscCall(SbCheckpointAttach(to, out));
  PetscCall(SbProgressAttach(to, out));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
