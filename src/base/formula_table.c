/*
  formula_table.c - function of time given by a table in a text file with two columns.

  Each line: time (s) and value, separated by blanks, a comma or a semicolon; `#` starts a comment; empty lines are
  ignored. Times must ascend. Linear interpolation, constant outside. Only rank 0 reads the file, which scales to thousands of
  ranks; an error is broadcast and raised on all ranks.
*/
#include <ctype.h>
#include <errno.h>
#include "formula.h"

/* Parses one line: returns 1 for two numbers, 0 for a blank line, else -1. */
static int read_line(char *line, PetscReal row[2])
{
  char *next = line, *end;

  if (strchr(line, '#')) *strchr(line, '#') = 0;
  for (int i = 0; i < 2; i++) {
    while (isspace((unsigned char)*next) || (i && (*next == ',' || *next == ';'))) next++;
    if (!*next && !i) return 0;
    row[i] = strtod(next, &end);
    if (end == next || !isfinite(row[i])) return -1;
    next = end;
  }
  while (isspace((unsigned char)*next)) next++;
  return *next ? -1 : 1;
}

/* Reads the complete file. Rank 0 only. */
static PetscErrorCode read_rows(FILE *f, const char *file, const char *where, PetscInt *n, PetscReal **rows)
{
  char line[512];
  PetscInt room = 0;

  PetscFunctionBeginUser;
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_USER, "%s: cannot open %s: %s", where, file, strerror(errno));
  for (int number = 1; fgets(line, sizeof(line), f); number++) {
    PetscReal row[2];
    const int found = read_line(line, row);

    PetscCheck(found >= 0, PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: %s, line %d: expected two numbers, time (s) and value", where, file, number);
    if (!found) continue;
    if (*n && row[0] <= (*rows)[2 * (*n - 1)]) {
      char times[64]; /* PetscSNPrintf() would write "2." */

      (void)snprintf(times, sizeof(times), "%g s does not come after %g s", (double)row[0],
                     (double)(*rows)[2 * (*n - 1)]);
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s: %s, line %d: time %s; times must ascend", where, file,
              number, times);
    }
    PetscCall(SbReserve(*n + 1, 2 * sizeof(PetscReal), &room, rows));
    PetscCall(PetscArraycpy(*rows + 2 * *n, row, 2));
    ++*n;
  }
  PetscCheck(!ferror(f), PETSC_COMM_SELF, PETSC_ERR_USER, "%s: cannot read %s", where, file);
  PetscCheck(*n, PETSC_COMM_SELF, PETSC_ERR_USER, "%s: %s holds no numbers", where, file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormulaReadTable(MPI_Comm comm, const char *file, const char *where, SbFormula formula)
{
  PetscMPIInt rank;
  PetscInt n = 0;
  PetscReal *rows = NULL;
  SbCaughtError caught = {0, ""};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    FILE *f = fopen(file, "r");

    SB_CATCH(&caught, read_rows(f, file, where, &n, &rows));
    if (f) (void)fclose(f);
    if (caught.code) PetscCall(PetscFree(rows));
  }
  PetscCall(SbCaughtRaise(comm, &caught));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, comm));
  if (rank) PetscCall(PetscMalloc1(2 * n, &rows));
  PetscCallMPI(MPI_Bcast(rows, (PetscMPIInt)(2 * n), MPIU_REAL, 0, comm));
  formula->nrow = n;
  PetscCall(PetscMalloc2(n, &formula->time, n, &formula->value));
  for (PetscInt i = 0; i < n; i++) {
    formula->time[i] = rows[2 * i];
    formula->value[i] = rows[2 * i + 1];
  }
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbFormulaEvalTable(const struct _p_SbFormula *f, PetscReal t)
{
  PetscInt lo = 0, hi = f->nrow - 1;
  PetscReal w;

  if (t <= f->time[lo]) return f->value[lo];
  if (t >= f->time[hi]) return f->value[hi];
  while (hi - lo > 1) {
    const PetscInt mid = (lo + hi) / 2;

    if (f->time[mid] <= t)
      lo = mid;
    else
      hi = mid;
  }
  w = (t - f->time[lo]) / (f->time[hi] - f->time[lo]);
  return (1 - w) * f->value[lo] + w * f->value[hi];
}
