/*
  history.csv: one row of scalars per step, each written to the file at once and by one call.

  First line: names. Second line: units behind a '#', so that pandas and numpy skip it with
  comment='#'. Numbers have 17 digits: what is read back is what was computed. `total` is kinetic +
  strain - load_work - prescribed_work, constant as long as nothing is dissipated.

  One reduction per row sums values of effects, probes and bodies, and a flag that the row before
  failed.
*/
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>
#include "output_impl.h"

struct _p_SbHistory {
  int fd; /* rank 0; -1 elsewhere */
  SbFileIdentity on_disk;
  char path[PETSC_MAX_PATH_LEN];
  FILE *text; /* rank 0: in memory, a row or the header, row[size] */
  char *row;
  size_t size;
  PetscInt last_step;   /* of the last row in the file, or -1 */
  PetscInt nextra;      /* columns of effects, probes and bodies */
  PetscReal (*mass)[4]; /* [nbody] centre at rest, m, and mass, kg, for columns of bodies */
  PetscReal *mine,
    *sum; /* [nextra + 1] values of this rank, sums of all; the last: the row before failed */
  char message[SB_MESSAGE_MAX]; /* why it failed; empty when it did not */
};

/* The columns of every run, with their offset in SbStep; `total` is a sum of others. */
static const struct {
  const char *name, *unit;
  enum {
    REAL,
    COUNT,
    TOTAL
  } kind;
  size_t from;
} columns[] = {
#define AT(member) offsetof(SbStep, member)
  {"step", "1", COUNT, AT(step)},
  {"time", "s", REAL, AT(t)},
  {"dt", "s", REAL, AT(dt)},
  {"kinetic", "J", REAL, AT(energies.kinetic)},
  {"strain", "J", REAL, AT(energies.strain)},
  {"load_work", "J", REAL, AT(energies.load_work)},
  {"prescribed_work", "J", REAL, AT(energies.prescribed_work)},
  {"damping_loss", "J", REAL, AT(energies.damping_loss)},
  {"integrator_loss", "J", REAL, AT(energies.integrator_loss)},
  {"total", "J", TOTAL, 0},
  {"momentum_x", "kg m/s", REAL, AT(energies.momentum[0])},
  {"momentum_y", "kg m/s", REAL, AT(energies.momentum[1])},
  {"momentum_z", "kg m/s", REAL, AT(energies.momentum[2])},
  {"angular_x", "kg m^2/s", REAL, AT(energies.angular[0])},
  {"angular_y", "kg m^2/s", REAL, AT(energies.angular[1])},
  {"angular_z", "kg m^2/s", REAL, AT(energies.angular[2])},
  {"centre_x", "m", REAL, AT(energies.centre[0])},
  {"centre_y", "m", REAL, AT(energies.centre[1])},
  {"centre_z", "m", REAL, AT(energies.centre[2])},
  {"volume", "m^3", REAL, AT(energies.volume)},
  {"min_J", "1", REAL, AT(energies.min_J)},
  {"inverted", "1", COUNT, AT(energies.ninverted)},
  {"max_speed", "m/s", REAL, AT(energies.max_speed)},
  {"max_displacement", "m", REAL, AT(energies.max_displacement)},
  {"newton", "1", COUNT, AT(newton)},
  {"linear", "1", COUNT, AT(linear)},
  {"rejected", "1", COUNT, AT(rejected)},
};

/* Those of runs with viscoelastic bodies. */
static const struct {
  const char *name;
  size_t from;
} losses[] = {{"relaxation_loss", AT(energies.relaxation_loss)},
              {"viscosity_loss", AT(energies.viscosity_loss)}};

#define ACTIVE "active_work"   /* with fibres that contract */
#define GROWTH "growth_work"   /* with other strains without stress */
#define MULLINS "mullins_loss" /* with materials that soften */

/* The columns of a body with -output_history_bodies, in the order of SbModelBodySums(). */
static const struct {
  const char *name, *unit;
} body_columns[SB_BODY_SUMS] = {
  {"kinetic", "J"},         {"strain", "J"},   {"momentum_x", "kg m/s"}, {"momentum_y", "kg m/s"},
  {"momentum_z", "kg m/s"}, {"centre_x", "m"}, {"centre_y", "m"},        {"centre_z", "m"}};

/* The unit of a column of an effect, by its name. */
static const char *unit_of(const char *column)
{
  static const struct {
    const char *word, *unit;
  } units[] = {{"torque", "N m"},    {"force", "N"},       {"reaction", "N"}, {"penetration", "m"},
               {"gap", "m"},         {"work", "J"},        {"energy", "J"},   {"loss", "J"},
               {"volume", "m^3"},    {"pressure", "Pa"},   {"flow", "m^3/s"}, {"area", "m^2"},
               {"angle", "degrees"}, {"displacement", "m"}};

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(units); i++)
    if (strstr(column, units[i].word))
      return units[i].unit;
  return "1";
}

/* One column in both lines at the top. */
static void put_column(FILE *line[2], const char *unit, const char *format, ...)
  PETSC_ATTRIBUTE_FORMAT(3, 4);
static void put_column(FILE *line[2], const char *unit, const char *format, ...)
{
  va_list args;

  va_start(args, format);
  (void)vfprintf(line[0], format, args);
  va_end(args);
  (void)fprintf(line[1], ",%s", unit);
}

/* The two lines at the top, as the row. */
static PetscErrorCode put_header(SbRun run, SbOutput out, SbHistory h)
{
  const PetscInt nbody = out->history_bodies ? run->model->nbody : 0;
  static const char *const axes[][6] = {
    [1] = {""}, [3] = {"x", "y", "z"}, [6] = {"xx", "xy", "xz", "yy", "yz", "zz"}};
  char *units;
  const char *unit;
  size_t size;
  FILE *line[2] = {h->text, open_memstream(&units, &size)};

  PetscFunctionBeginUser;
  PetscCheck(line[1], PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for %s", h->path);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(columns); i++)
    put_column(line, columns[i].unit, "%s%s", i ? "," : "", columns[i].name);
  for (size_t i = 0; run->model->space->viscous && i < PETSC_STATIC_ARRAY_LENGTH(losses); i++)
    put_column(line, "J", ",%s", losses[i].name);
  if (run->model->space->active || run->model->space->active_strain)
    put_column(line, "J", "," ACTIVE);
  if (run->model->space->grows)
    put_column(line, "J", "," GROWTH);
  if (run->model->space->softening)
    put_column(line, "J", "," MULLINS);
  for (PetscInt e = 0; e < run->model->nhistory; e++) {
    const SbEffect effect = run->model->history[e];

    for (PetscInt c = 0; c < effect->ncolumn; c++)
      put_column(line, unit_of(effect->column[c]), ",%s_%s", effect->name, effect->column[c]);
  }
  for (const SbProbe *probe = out->probe; probe < out->probe + out->nprobe; probe++) {
    for (PetscInt i = 0; i < probe->nfield; i++) {
      const SbField *f = probe->field[i];
      const char *name = !strcmp(f->name, "displacement") ? "u" : f->name;

      for (PetscInt c = 0; c < f->ncomp; c++)
        put_column(line, f->unit, ",%s_%s%s%s", probe->name, name,
                   f->ncomp > 1 && name[1] ? "_" : "", axes[f->ncomp][c]);
    }
  }
  for (PetscInt i = 0; i < nbody * SB_BODY_SUMS; i++)
    put_column(line, body_columns[i % SB_BODY_SUMS].unit, ",%s_%s",
               run->model->body[i / SB_BODY_SUMS].name, body_columns[i % SB_BODY_SUMS].name);
  for (PetscInt i = 0; i < SbLiveCount(); i++) {
    const char *column = SbLiveColumn(i, &unit);

    put_column(line, unit, ",%s", column);
  }
  for (PetscInt c = 0; c < run->monitors.ncolumn; c++)
    put_column(line, run->monitors.column[c].unit, ",%s", run->monitors.column[c].name);
  (void)fclose(line[1]);
  (void)fprintf(h->text, "\n#%s\n", units + 1);
  free(units);
  (void)fflush(h->text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the row in one call; a row truncated by a full disk is removed. */
static void write_row(SbHistory h, char message[SB_MESSAGE_MAX])
{
  const off_t before = lseek(h->fd, 0, SEEK_END);
  const ssize_t n = write(h->fd, h->row, h->size);

  (void)SbFileLost(h->path, &h->on_disk);
  if (n == (ssize_t)h->size)
    return;
  SbFormat(SB_MESSAGE_MAX, message, "cannot write %zu bytes to %s: %s; " SB_NO_ROOM, h->size,
           h->path, strerror(n < 0 ? errno : ENOSPC));
  if (n > 0 && ftruncate(h->fd, before))
    SbFormat(SB_MESSAGE_MAX, message, "cannot write to %s, its last row is incomplete", h->path);
}

/* Number of columns of effects; of column k the name in a checkpoint, where name is not NULL. */
static PetscInt effect_columns(SbRun run, PetscInt k, size_t size, char name[])
{
  PetscInt n = 0;

  for (PetscInt e = 0; e < run->model->nhistory; e++) {
    const SbEffect effect = run->model->history[e];

    if (name && k >= n && k < n + effect->ncolumn)
      SbFormat(size, name, "history_%s_%s", effect->name, effect->column[k - n]);
    n += effect->ncolumn;
  }
  return n;
}

PetscErrorCode SbHistoryWrite(SbRun run, SbOutput out, PetscInt step, SbH5 *h)
{
  const PetscInt n = effect_columns(run, 0, 0, NULL);
  char name[4 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; out->hist && out->hist->last_step == step && k < n; k++) {
    (void)effect_columns(run, k, sizeof(name), name);
    PetscCall(SbH5PutReal(h, h->file, name, out->hist->sum[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHistoryRead(SbRun run, SbOutput out, SbH5 *h)
{
  const PetscInt n = effect_columns(run, 0, 0, NULL);
  PetscBool all = PETSC_TRUE;
  char name[4 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscFree(out->resumed));
  PetscCall(PetscMalloc1(n, &out->resumed));
  for (PetscInt k = 0; k < n && all; k++) {
    (void)effect_columns(run, k, sizeof(name), name);
    SbH5GetReal(h->file, name, &out->resumed[k], &all);
  }
  if (!all)
    PetscCall(PetscFree(out->resumed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode monitor(SbRun run, const SbStep *step, void *ctx)
{
  SbOutput out = (SbOutput)ctx;
  SbHistory h = out->hist;
  const SbModel model = run->model;
  const SbSpace s = model->space;
  const PetscInt nbody = out->history_bodies ? model->nbody : 0;
  PetscReal *values = h->mine;
  PetscReal *of_bodies = h->mine + h->nextra - nbody * SB_BODY_SUMS;
  SbStage stage = {.t = step->t, .dt = step->dt, .step = step->step};
  const PetscBool resumed = (PetscBool)(step->step == run->clock.step0 && step->step > 0);
  const PetscReal *residual;
  PetscMPIInt n;

  PetscFunctionBeginUser;

  // forces of contact are of the step before, which this run, or that on this mesh, did not solve
  if (resumed && model->contacts.n && !out->resumed)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (h->last_step >= step->step ||
      (step->step != run->clock.step0 && !step->last && step->step % out->history_every))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(out->event.history, 0, 0, 0, 0));

  /* this rank's part of the columns of effects, probes and bodies */
  PetscCall(PetscArrayzero(h->mine, h->nextra + 1));
  if (model->nhistory || out->nprobe) {
    PetscCall(SbSpaceGetLocalRead(s, step->U, &stage.u));
    if (step->V)
      PetscCall(SbSpaceGetLocalRead(s, step->V, &stage.v));
    if (step->A)
      PetscCall(SbSpaceGetLocalRead(s, step->A, &stage.a));
    if (model->nhistory) {
      PetscCheck(step->R, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "The residual was asked for but not given to the monitors");
      PetscCall(SbSpaceGetLocalRead(s, step->R, &residual));
      for (PetscInt e = 0; e < model->nhistory; values += model->history[e++]->ncolumn)
        SbEffectCall(model->history[e], history, s, &stage, residual, values);
      PetscCall(SbSpaceRestoreLocalRead(s, step->R, &residual));
    }
    if (out->nprobe) {
      PetscCall(PetscLogEventBegin(out->event.probes, 0, 0, 0, 0));
      PetscCall(SbProbesAdd(run, out, step, &stage, values));
      PetscCall(PetscLogEventEnd(out->event.probes, 0, 0, 0, 0));
    }
    PetscCall(SbSpaceRestoreLocalRead(s, step->U, &stage.u));
    if (step->V)
      PetscCall(SbSpaceRestoreLocalRead(s, step->V, &stage.v));
    if (step->A)
      PetscCall(SbSpaceRestoreLocalRead(s, step->A, &stage.a));
  }
  if (nbody)
    PetscCall(SbModelBodySums(model, step->U, step->V, (PetscReal(*)[SB_BODY_SUMS])of_bodies));

  /* sums of all ranks; the run ends when the row before could not be written */
  h->mine[h->nextra] = h->message[0] ? 1. : 0.;
  PetscCall(PetscMPIIntCast(h->nextra + 1, &n));
  PetscCallMPI(MPI_Allreduce(h->mine, h->sum, n, MPIU_REAL, MPI_SUM, out->comm));
  if (h->sum[h->nextra] > 0.)
    PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, h->message));
  for (PetscInt b = 0; b < nbody; b++) // centres are means
    for (int k = 1; k <= 3; k++)
      h->sum[h->nextra - (nbody - b - 1) * SB_BODY_SUMS - k] /= h->mass[b][3];

  if (resumed && out->resumed)
    PetscCall(PetscArraycpy(h->sum, out->resumed, effect_columns(run, 0, 0, NULL)));

  /* the row, as text, for one call */
  h->last_step = step->step;
  if (h->fd >= 0) {
    const SbEnergies *e = &step->energies;
    const PetscReal total =
      e->kinetic + e->strain - e->load_work - e->prescribed_work - e->active_work - e->growth_work;

    rewind(h->text);
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(columns); k++) {
      const void *value =
        columns[k].kind == TOTAL ? (const char *)&total : (const char *)step + columns[k].from;

      if (k)
        (void)fputc(',', h->text);
      if (columns[k].kind == COUNT)
        (void)fprintf(h->text, "%" PetscInt_FMT, *(const PetscInt *)value);
      else
        (void)fprintf(h->text, "%.17g", *(const PetscReal *)value);
    }
    for (size_t k = 0; s->viscous && k < PETSC_STATIC_ARRAY_LENGTH(losses); k++)
      (void)fprintf(h->text, ",%.17g",
                    *(const PetscReal *)(const void *)((const char *)step + losses[k].from));
    if (s->active || s->active_strain)
      (void)fprintf(h->text, ",%.17g", e->active_work);
    if (s->grows)
      (void)fprintf(h->text, ",%.17g", e->growth_work);
    if (s->softening)
      (void)fprintf(h->text, ",%.17g", e->mullins_loss);
    for (PetscInt k = 0; k < h->nextra; k++)
      (void)fprintf(h->text, ",%.17g", h->sum[k]);
    for (PetscInt k = 0; k < SbLiveCount(); k++)
      (void)fprintf(h->text, ",%.17g", SbLiveGet(k, step->t));
    for (PetscInt k = 0; k < run->monitors.ncolumn; k++)
      (void)fprintf(h->text, ",%.17g", *run->monitors.column[k].value);
    (void)fputc('\n', h->text);
    (void)fflush(h->text);
    write_row(h, h->message);
  }
  if (step->last)
    PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, h->message));
  PetscCall(PetscLogEventEnd(out->event.history, 0, 0, 0, 0));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens the file, at the beginning and after a restart. */
static PetscErrorCode open_file(SbRun run, SbOutput out, char message[SB_MESSAGE_MAX])
{
  SbHistory h = out->hist;
  PetscBool kept = PETSC_FALSE;

  PetscFunctionBeginUser;
  h->text = open_memstream(&h->row, &h->size);
  PetscCheck(h->text, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for %s", h->path);
  PetscCall(put_header(run, out, h));
  if (out->restart[0]) {
    FILE *file;
    char *text = NULL;
    char *line, *end;
    size_t room = 0;

    // rows up to step0 of a file with the same columns are kept; one without its end was cut off by
    // a kill
    (void)SbFileOpen(h->path, 0, &file);
    if (file && getdelim(&text, &room, 0, file) > 0 && !strncmp(text, h->row, h->size)) {
      for (line = text + h->size; (end = strchr(line, '\n')); line = end + 1) {
        const long step = strtol(line, NULL, 10);

        if (step > run->clock.step0)
          break;
        h->last_step = (PetscInt)step;
      }
      SbFileReplace(h->path, text, (size_t)(line - text), message);
      kept = PETSC_TRUE;
    }
    free(text);
    if (file)
      (void)fclose(file);

    /* a history with other columns stays, under another name */
    if (!kept && !access(h->path, F_OK)) {
      char other[SB_OTHER_MAX];

      SbFileKeep(h->path, run->clock.step0, other, message);
      if (!message[0])
        PetscCall(SbWarning(PETSC_COMM_SELF, "%s is damaged or has other columns: kept as %s",
                            h->path, other));
    }
  }
  if (message[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  h->fd = open(h->path, O_WRONLY | O_CREAT | O_NOFOLLOW | (kept ? O_APPEND : O_TRUNC), 0666);
  SbFileRemember(h->path, &h->on_disk);
  if (h->fd < 0)
    SbFormat(SB_MESSAGE_MAX, message, "cannot open %s for writing: %s", h->path, strerror(errno));
  else if (!kept)
    write_row(h, message);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHistoryAttach(SbRun run, SbOutput out)
{
  const SbModel model = run->model;
  SbHistory h = out->hist;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  if (!out->history)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!h) {
    PetscCall(PetscNew(&h));
    out->hist = h;
    h->fd = -1;
    h->last_step = -1;
    for (PetscInt e = 0; e < model->nhistory; e++)
      h->nextra += model->history[e]->ncolumn;
    for (PetscInt p = 0; p < out->nprobe; p++)
      for (PetscInt i = 0; i < out->probe[p].nfield; i++)
        h->nextra += out->probe[p].field[i]->ncomp;
    if (out->history_bodies)
      h->nextra += SB_BODY_SUMS * model->nbody;
    PetscCall(
      PetscMalloc3(h->nextra + 1, &h->mine, h->nextra + 1, &h->sum, model->nbody, &h->mass));
    SbOutputPath(out, "history.csv", h->path);
    if (!out->rank)
      PetscCall(open_file(run, out, message));
    PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
    PetscCallMPI(MPI_Bcast(&h->last_step, 1, MPIU_INT, 0, out->comm));
  } else
    PetscCall(PetscFree(out->resumed));

  /* from now on rows are those of this run */
  PetscCall(SbProbesFind(run, out));
  if (out->history_bodies)
    PetscCall(SbModelCentres(model, NULL, h->mass));
  run->monitors.want_energies = PETSC_TRUE;
  if (model->nhistory)
    run->monitors.want_residual = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(run, monitor, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHistoryDestroy(SbOutput out)
{
  SbHistory h = out->hist;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(out->resumed));
  if (!h)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (h->fd >= 0)
    (void)close(h->fd);
  if (h->text)
    (void)fclose(h->text);
  free(h->row);
  PetscCall(PetscFree3(h->mine, h->sum, h->mass));
  PetscCall(PetscFree(out->hist));
  PetscFunctionReturn(PETSC_SUCCESS);
}
