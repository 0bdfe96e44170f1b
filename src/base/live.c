/*
  live.c - formulas that follow what somebody does while a run goes on: -effect_<name>_displacement live.

  A file, live.txt in the run's folder, has a line `NAME x y z` (m) for each effect that is moved. Others rewrite it as often as they like, best by renaming a new one. After each accepted step rank
  0 reads it, and the effect goes from where it is towards the new place in a straight line, at -live_speed at most: three tables of two rows. So a step that is tried again is the same one.
  A run that is faster than -live_pace simulated seconds per second waits; one that is slower does not hurry afterwards.
*/
#include "formula.h"

#define MOVED_MAX 16 /* effects that are moved */

typedef struct {
  char name[SB_NAME_MAX];
  SbFormula formula[3];
} Moved;

static struct {
  PetscInt n;
  Moved moved[MOVED_MAX];
  char file[PETSC_MAX_PATH_LEN];
  PetscReal speed, pace; /* m/s; simulated seconds per second, 0: no limit */
  PetscReal clock,
    begun; /* s: the clock, and the time of the run, from which the pace counts; clock 0: not yet */
} live = {.file = "live.txt", .speed = 0.2, .pace = 1.};

/* From `from` at time t on to `to`. */
static void set_rows(SbFormula f, PetscReal t, PetscReal from, PetscReal duration, PetscReal to)
{
  f->time[0] = t;
  f->value[0] = from;
  f->time[1] = t + duration;
  f->value[1] = to;
}

PetscErrorCode SbLiveCreate(const char *where, SbFormula formula[3])
{
  const char *name = strchr(where[0] == '-' ? where + 1 : where, '_'), *end = strrchr(where, '_');
  Moved *moved = &live.moved[live.n];
  PetscReal place[3] = {0., 0., 0.};

  PetscFunctionBeginUser;
  PetscCheck(live.n < MOVED_MAX && name && end > name, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s live: up to %d effects can be moved while a run goes on", where, MOVED_MAX);
  (void)snprintf(moved->name, sizeof(moved->name), "%.*s", (int)(end - name - 1), name + 1);
  /* a scene that is made again goes on where it was */
  for (PetscInt i = 0; i < live.n; i++)
    for (int k = 0; k < 3 && !strcmp(live.moved[i].name, moved->name); k++)
      place[k] = live.moved[i].formula[k]->value[0];
  for (int k = 0; k < 3; k++) {
    PetscCall(PetscNew(&formula[k]));
    formula[k]->uses_time = PETSC_TRUE;
    formula[k]->nrow = 2;
    PetscCall(PetscMalloc1(2, &formula[k]->time));
    PetscCall(PetscMalloc1(2, &formula[k]->value));
    set_rows(formula[k], 0., place[k], 1., place[k]);
    moved->formula[k] = formula[k];
  }
  live.n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbLiveForget(SbFormula formula)
{
  for (PetscInt i = 0; i < live.n; i++)
    if (live.moved[i].formula[0] == formula) live.moved[i--] = live.moved[--live.n];
}

PetscErrorCode SbLiveSetUp(const char *file, PetscReal speed, PetscReal pace)
{
  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(live.file, file, sizeof(live.file)));
  live.speed = speed;
  live.pace = pace;
  live.clock = 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbLiveCount(void)
{
  return live.n;
}

const char *SbLivePlace(PetscInt i, PetscReal t, PetscReal place[3])
{
  for (int k = 0; k < 3; k++) place[k] = SbFormulaEvalTable(live.moved[i].formula[k], t);
  return live.moved[i].name;
}

void SbLiveSetPlace(PetscInt i, PetscReal t, const PetscReal place[3])
{
  for (int k = 0; k < 3; k++) set_rows(live.moved[i].formula[k], t, place[k], 1., place[k]);
}

/* Where the file wants each effect; those that it does not name, or not with three numbers, keep their target. Rank 0. */
static void read_targets(PetscReal target[][3])
{
  FILE *f = fopen(live.file, "r");
  char line[512];

  while (f && fgets(line, sizeof(line), f)) {
    const size_t n = strcspn(line, " \t,");

    for (PetscInt i = 0; i < live.n; i++) {
      char *next = line + n, *end;
      PetscReal x[3];
      int k = 0;

      if (strlen(live.moved[i].name) != n || strncmp(line, live.moved[i].name, n)) continue;
      for (; k < 3; k++) {
        next += strspn(next, " \t,");
        x[k] = strtod(next, &end);
        if (end == next || !isfinite(x[k])) break;
        next = end;
      }
      if (k == 3) memcpy(target[i], x, sizeof(x));
    }
  }
  if (f) (void)fclose(f);
}

PetscErrorCode SbLiveAdvance(MPI_Comm comm, PetscReal t)
{
  PetscReal target[MOVED_MAX][3], ahead;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  /* in time with the clock */
  if (live.clock == 0.) {
    live.clock = MPI_Wtime();
    live.begun = t;
  }
  ahead = live.pace > 0. ? (t - live.begun) / live.pace - (MPI_Wtime() - live.clock) : 0.;
  if (ahead > 0.)
    PetscCall(PetscSleep(ahead));
  else {
    live.clock = MPI_Wtime();
    live.begun = t;
  }

  /* from here to where they are wanted */
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  for (PetscInt i = 0; i < live.n; i++)
    for (int k = 0; k < 3; k++) target[i][k] = live.moved[i].formula[k]->value[1];
  if (!rank) read_targets(target);
  PetscCallMPI(MPI_Bcast(target, (PetscMPIInt)(3 * live.n), MPIU_REAL, 0, comm));
  for (PetscInt i = 0; i < live.n; i++) {
    PetscReal place[3], way = 0.;

    (void)SbLivePlace(i, t, place);
    for (int k = 0; k < 3; k++) way += PetscSqr(target[i][k] - place[k]);
    way = PetscSqrtReal(way);
    for (int k = 0; k < 3; k++)
      set_rows(live.moved[i].formula[k], t, place[k], way > 0. ? way / live.speed : 1., target[i][k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
