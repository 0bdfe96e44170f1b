/*
  formula.h - compiled form of a formula, shared by the compiler and the reader of tables.
*/
#pragma once
#include "sbbase.h"

#define SB_FORMULA_STACK 64 /* largest stack depth of a formula */

typedef struct {
  char op;   /* n number, v variable, f function, m unary minus; + - * / ^ */
  int index; /* v: 0 to 3 for t, x, y, z; f: row of the table of functions */
  PetscReal number;
  int change; /* of the number of values on the stack */
} SbFormulaStep;

struct _p_SbFormula {
  PetscInt nstep;
  SbFormulaStep *step; /* [nstep] postfix code; NULL for a table */
  PetscBool uses[2];   /* time, position */
  PetscInt nrow;
  PetscReal (*row)[2]; /* [nrow] time, s, ascending, and value */
  char *where, *text;  /* owned; name of the option; the formula, NULL: it is live */
  PetscReal largest;   /* its values' largest size: SB_LENGTH_MAX for lengths */
};

/* An empty formula of an option whose name is `where`. */
PetscErrorCode SbFormulaNew(const char *where, SbFormula *formula);

/* where: option name, for messages. */
PetscErrorCode SbFormulaCreate(MPI_Comm comm, const char *text, const char *where,
                               SbFormula *formula);
/* Reads a two-column file on rank 0 and broadcasts it. Collective. Errors name option, file and
   line. */
PetscErrorCode SbFormulaReadTable(MPI_Comm comm, const char *file, const char *where,
                                  SbFormula formula);
/* Makes row->count empty formulas those of an option that is `live` (live.c); where: its name. */
PetscErrorCode SbLiveCreate(const char *where, const SbOption *row, SbFormula formula[]);
/* Removes a live formula that is being destroyed. */
void SbLiveForget(SbFormula formula);
/* What is wrong with the n characters of a line: a zero byte, or ends of lines as of old Macs,
   which would join lines; NULL: nothing. */
static inline const char *SbLineProblem(const char *line, size_t n)
{
  const char *cr = (const char *)memchr(line, '\r', n);

  if (memchr(line, 0, n))
    return "holds a zero byte; it is no text file";
  if (cr && cr + 1 < line + n && cr[1] != '\n')
    return "holds a carriage return alone; end lines with a newline";
  return NULL;
}
/* Linear interpolation, constant outside. */
PetscReal SbFormulaEvalTable(const struct _p_SbFormula *formula, PetscReal t);
