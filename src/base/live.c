/*
  live.c - interactive control: formulas whose values are read from a file during the run;
  -effect_<name>_displacement live, and other formulas of effects.

  The file, live.txt in the folder of the run, has a line `NAME x y z` (m) for each effect with a
  live displacement, and lines `NAME_angle a` (degrees), `NAME_vector x y z` (N), ... for other
  options of effects. Another program may rewrite it at any time, best by renaming a new file. Rank
  0 reads it after each accepted step. A displacement then moves towards the target in a straight
  line with the speed -live_speed, an angle with -live_angular_speed; other values change at once.
  Each value is a table of two rows, so that a repeated step has the same values. A run that is
  faster than -live_pace simulated seconds per second waits; a slower one does not catch up.
*/
#include <unistd.h>
#include "formula.h"
#include "option.h"

#define LIVE_BYTES 65536 /* largest size of the file */
#define VALUE_MAX 48     /* largest number of live values */

typedef struct {
  char name[2 * SB_NAME_MAX];   /* first word of its line in the file: tool, tool_angle */
  char column[3 * SB_NAME_MAX]; /* column of the history file: tool_live_x, tool_angle_live */
  const char *unit;
  const PetscReal *speed; /* unit/s; NULL: unlimited, the value changes at once */
  int n;                  /* size of the vector option, whose components are consecutive */
  SbFormula formula;
} Value;

static struct {
  PetscInt n;
  Value value[VALUE_MAX];
  char file[PETSC_MAX_PATH_LEN];
  PetscReal speed, angular_speed,
    pace;                 /* m/s; degree/s; simulated seconds per second, 0: unlimited */
  PetscReal clock, begun; /* origin of wall time and simulated time, s; clock 0: not started */
  PetscBool warned;       /* a warning about an invalid line was printed */
} live = {.file = "live.txt", .speed = 0.2, .angular_speed = 90., .pace = 1.};

/* Linear change from `from` at time t to `to` at t + duration. */
static void set_rows(SbFormula f, PetscReal t, PetscReal from, PetscReal duration, PetscReal to)
{
  const PetscReal row[2][2] = {{t, from}, {t + duration, to}};

  memcpy(f->row, row, sizeof(row));
}

PetscErrorCode SbLiveCreate(const char *where, const SbOption *row, SbFormula formula[])
{
  const char *name = strchr(where[0] == '-' ? where + 1 : where, '_');
  const int n = (int)row->count;
  const PetscBool moved = (PetscBool)!strcmp(row->key, "displacement");
  const int ending = moved ? (int)strlen("_displacement") : 0; /* left out of the names */
  const int length = name ? (int)strlen(name + 1) - ending : 0;

  PetscFunctionBeginUser;
  PetscCheck(live.n + n <= VALUE_MAX && name, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s live: %d numbers can be set while a run goes on, three by a vector", where,
             VALUE_MAX);
  for (int k = 0; k < n; k++) {
    Value *v = &live.value[live.n + k];
    PetscReal old = 0.;

    /* names in the file and in the history; a displacement has the name of its effect */
    (void)snprintf(v->name, sizeof(v->name), "%.*s", length, name + 1);
    (void)snprintf(v->column, sizeof(v->column), n == 1 ? "%.*s_live" : "%.*s_live_%c", length,
                   name + 1, 'x' + k);
    v->unit = row->unit[0] ? row->unit : "1";
    if (moved)
      v->speed = &live.speed;
    else
      v->speed = strcmp(row->key, "angle") ? NULL : &live.angular_speed;
    v->n = n;

    /* keep the value after re-meshing */
    for (PetscInt i = 0; i < live.n; i++)
      if (!strcmp(live.value[i].column, v->column))
        old = live.value[i].formula->row[0][1];
    formula[k]->uses[0] = PETSC_TRUE;
    formula[k]->nrow = 2;
    PetscCall(PetscMalloc1(2, &formula[k]->row));
    set_rows(formula[k], 0., old, 1., old);
    v->formula = formula[k];
  }
  live.n += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbLiveForget(SbFormula formula)
{
  for (PetscInt i = 0; i < live.n; i++) {
    if (live.value[i].formula != formula)
      continue;
    live.n--;
    memmove(&live.value[i], &live.value[i + 1], (size_t)(live.n - i) * sizeof(Value));
    break;
  }
}

void SbLiveSetUp(const char *file, PetscReal speed, PetscReal angular_speed, PetscReal pace)
{
  SbFormat(sizeof(live.file), live.file, "%s", file);
  live.speed = speed;
  live.angular_speed = angular_speed;
  live.pace = pace;
  live.clock = 0.;
}

PetscInt SbLiveCount(void)
{
  return live.n;
}

const char *SbLiveColumn(PetscInt i, const char **unit)
{
  if (unit)
    *unit = live.value[i].unit;
  return live.value[i].column;
}

PetscReal SbLiveGet(PetscInt i, PetscReal t)
{
  return SbFormulaEvalTable(live.value[i].formula, t);
}

void SbLiveSet(PetscInt i, PetscReal t, PetscReal value)
{
  set_rows(live.value[i].formula, t, value, 1., value);
}

/* Reads targets from the file; one without a valid line stays. Warns of the first invalid line.
   Rank 0. */
static PetscErrorCode read_targets(PetscReal target[])
{
  FILE *f;
  const char *why = SbFileOpen(live.file, LIVE_BYTES, &f);
  char *line = NULL;
  size_t size = 0;
  ssize_t length;

  PetscFunctionBeginUser;
  if (!f && !live.warned && !access(live.file, F_OK)) {
    live.warned = PETSC_TRUE;
    PetscCall(SbWarning(PETSC_COMM_SELF, "%s is not read: %s", live.file, why));
  }
  while (f && (length = getline(&line, &size, f)) >= 0) {
    const size_t n = strcspn(line, " \t,\r\n");
    const PetscBool text = (PetscBool)!SbLineProblem(line, (size_t)length);
    PetscBool useful = (PetscBool)(text && (!n || line[0] == '#'));

    for (PetscInt i = 0; i < live.n; i += live.value[i].n) {
      char *next = line + n;
      char *end;
      PetscReal x[SB_OPTION_COUNT_MAX];
      int k = 0;

      if (!text || strlen(live.value[i].name) != n || strncmp(line, live.value[i].name, n))
        continue;
      for (; k < live.value[i].n; k++) {
        next += strspn(next, " \t,");
        x[k] = strtod(next, &end);
        if (end == next || !(PetscAbsReal(x[k]) <= live.value[i].formula->largest))
          break;
        next = end;
      }
      if (k == live.value[i].n)
        memcpy(&target[i], x, (size_t)k * sizeof(*x));
      useful = (PetscBool)(useful || k == live.value[i].n);
    }
    if (useful || live.warned || line[length - 1] != '\n')
      continue;
    line[strcspn(line, "\r\n")] = 0;
    live.warned = PETSC_TRUE;
    PetscCall(SbWarning(
      PETSC_COMM_SELF,
      "%s: the line '%.200s' is not one of a value that is live, as `%s` with %d number%s",
      live.file, line, live.value[0].name, live.value[0].n, live.value[0].n > 1 ? "s" : ""));
  }
  free(line);
  if (f)
    (void)fclose(f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLiveAdvance(MPI_Comm comm, PetscReal t)
{
  PetscReal target[VALUE_MAX], ahead;
  PetscMPIInt rank;

  PetscFunctionBeginUser;

  /* wait if simulated time is ahead of wall time */
  ahead = live.pace > 0. && live.clock > 0.
            ? (t - live.begun) / live.pace - (MPI_Wtime() - live.clock)
            : 0.;
  if (ahead > 0.)
    PetscCall(PetscSleep(ahead));
  else {
    live.clock = MPI_Wtime();
    live.begun = t;
  }

  /* from the current values to the targets */
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  for (PetscInt i = 0; i < live.n; i++)
    target[i] = live.value[i].formula->row[1][1];
  if (!rank)
    PetscCall(read_targets(target));
  PetscCallMPI(MPI_Bcast(target, (PetscMPIInt)live.n, MPIU_REAL, 0, comm));
  for (PetscInt first = 0; first < live.n; first += live.value[first].n) {
    const Value *v = &live.value[first];
    PetscReal way = 0.;

    for (PetscInt i = first; i < first + v->n; i++)
      way += PetscSqr(target[i] - SbLiveGet(i, t));
    way = PetscSqrtReal(way);
    for (PetscInt i = first; i < first + v->n; i++)
      set_rows(live.value[i].formula, t, SbLiveGet(i, t), v->speed ? way / *v->speed : 0.,
               target[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
