/*
  progress.c - progress line on standard error: overwritten in place on a terminal, else a new line
  at intervals. Phases of less than a second print nothing.
*/
#include <unistd.h>
#include "tool.h"

#define PATIENCE 1.0 /* s before the first line */

const char *SbToolNumber(PetscInt64 n, char text[32])
{
  char digits[24];
  const int length = snprintf(digits, sizeof(digits), "%lld", (long long)n);
  int k = 0;

  for (int i = 0; i < length; i++) {
    text[k++] = digits[i];
    if (digits[i] != '-' && i + 1 < length && (length - i - 1) % 3 == 0)
      text[k++] = ',';
  }
  text[k] = 0;
  return text;
}

void SbToolBegin(SbTool *tool, const char *phase)
{
  tool->phase = phase;
  tool->start = MPI_Wtime();
  tool->last = tool->start + PATIENCE;
  tool->terminal = (PetscBool)isatty(STDERR_FILENO);
  tool->open = (PetscBool)(tool->terminal && !tool->quiet);
  if (tool->open)
    (void)fprintf(stderr, "\r%-79.79s", phase);
}

PetscErrorCode SbToolProgress(const char *what, PetscInt64 done, PetscInt64 total, void *ctx)
{
  SbTool *tool = (SbTool *)ctx;
  const PetscLogDouble t = MPI_Wtime();
  char line[PETSC_MAX_PATH_LEN], number[32];
  char share[16] = "";

  PetscFunctionBeginUser;
  if (tool->quiet || t < tool->last)
    PetscFunctionReturn(PETSC_SUCCESS);
  tool->last = t + (tool->terminal ? 0.2 : 5.0);
  if (total > 0)
    SbFormat(sizeof(share), share, ", %d %%", (int)(100. * (double)done / (double)total));
  SbFormat(sizeof(line), line, "%s: %s %s%s, %.0f s", tool->phase, SbToolNumber(done, number), what,
           share, t - tool->start);
  (void)fprintf(stderr, tool->terminal ? "\r%-79.79s" : "%s\n", line);
  (void)fflush(stderr);
  tool->open = tool->terminal;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbToolEnd(SbTool *tool)
{
  if (tool->open)
    (void)fprintf(stderr, "\r%79s\r", "");
  tool->open = PETSC_FALSE;
}
