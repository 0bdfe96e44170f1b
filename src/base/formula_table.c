/*
  formula_table.c - function of time given by a table in a text file with two columns.

  Each line: time (s) and value, separated by blanks, a comma or a semicolon; `#` starts a comment;
  empty lines are ignored. Times must ascend. Linear interpolation, constant outside. Only rank 0
  reads the file, which scales to thousands of ranks; an error is broadcast and raised on all ranks.
*/
#include "formula.h"

/* Reads the complete file. Rank 0 only. *buffer: for a line; the caller frees it. f: NULL, and
   `why`: it is not open. */
static PetscErrorCode read_rows(FILE *f, const char *why, const char *file, const char *where,
                                char **buffer, SbFormula formula)
{
  static const char blanks[] = " \t\n\v\f\r";
  size_t size = 0;
  ssize_t length;
  PetscInt *const n = &formula->nrow;
  PetscReal(**const rows)[2] = &formula->row;
  PetscInt room = 0;

  PetscFunctionBeginUser;
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_USER, "%s: cannot open %s: %s", where, file, why);
  for (int number = 1; (length = getline(buffer, &size, f)) >= 0; number++) {
    PetscReal row[2];
    char *const line = *buffer;
    char *next = line;
    const char *problem = SbLineProblem(line, (size_t)length);
    char *end;
    PetscBool valid = PETSC_TRUE;

    PetscCheck(!problem, PETSC_COMM_SELF, PETSC_ERR_USER, "%s: %s, line %d %s", where, file, number,
               problem);

    // two numbers, or a blank line
    line[strcspn(line, "#")] = 0;
    next += strspn(next, blanks);
    if (!*next)
      continue;
    for (int i = 0; i < 2; i++) {
      row[i] = strtod(next, &end);
      valid = (PetscBool)(valid && end > next && isfinite(row[i]));
      next = end + strspn(end, i ? blanks : " \t\n\v\f\r,;");
    }
    PetscCheck(valid && !*next, PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: %s, line %d: expected two numbers, time (s) and value", where, file, number);
    if (*n && row[0] <= (*rows)[*n - 1][0]) {
      char times[64]; /* PetscSNPrintf() would write "2." */

      (void)snprintf(times, sizeof(times), "%g s does not come after %g s", (double)row[0],
                     (double)(*rows)[*n - 1][0]);
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s: %s, line %d: time %s; times must ascend", where,
              file, number, times);
    }
    PetscCall(SbReserve(*n + 1, sizeof(**rows), &room, rows));
    PetscCall(PetscArraycpy((*rows)[*n], row, 2));
    (*n)++;
  }
  PetscCheck(!ferror(f), PETSC_COMM_SELF, PETSC_ERR_USER, "%s: cannot read %s", where, file);
  PetscCheck(*n, PETSC_COMM_SELF, PETSC_ERR_USER, "%s: %s holds no numbers", where, file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormulaReadTable(MPI_Comm comm, const char *file, const char *where,
                                  SbFormula formula)
{
  PetscMPIInt rank;
  SbCaughtError caught = {0, ""};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    FILE *f;
    char *line = NULL;
    const char *why = SbFileOpen(file, SB_TEXT_BYTES, &f);

    SB_CATCH(&caught, read_rows(f, why, file, where, &line, formula));
    free(line);
    if (f)
      (void)fclose(f);
  }
  PetscCall(SbCaughtRaise(comm, &caught));
  PetscCallMPI(MPI_Bcast(&formula->nrow, 1, MPIU_INT, 0, comm));
  if (rank)
    PetscCall(PetscMalloc1(formula->nrow, &formula->row));
  PetscCallMPI(MPI_Bcast(formula->row, (PetscMPIInt)(2 * formula->nrow), MPIU_REAL, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbFormulaEvalTable(const struct _p_SbFormula *f, PetscReal t)
{
  PetscReal(*const row)[2] = f->row;
  PetscInt lo = 0;
  PetscInt hi = f->nrow - 1;
  PetscReal w;

  if (t <= row[lo][0])
    return row[lo][1];
  if (t >= row[hi][0])
    return row[hi][1];
  while (hi - lo > 1) {
    const PetscInt mid = (lo + hi) / 2;

    if (row[mid][0] <= t)
      lo = mid;
    else
      hi = mid;
  }
  w = (t - row[lo][0]) / (row[hi][0] - row[lo][0]);
  return (1 - w) * row[lo][1] + w * row[hi][1];
}
