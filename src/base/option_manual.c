/*
  option_manual.c - the reference manual from the table of options: for the terminal (-help) and as docs/options.md.

  Blocks are told by class in the order of registration: first what every instance of the class has, then each type.
*/
#include "option.h"

/* What the value looks like: "3 numbers", "euler_implicit|newmark". */
static PetscErrorCode describe_value(const SbOption *row, size_t size, char text[])
{
  const char *many = row->count > 1 ? "s" : "";
  char number[16] = "";

  PetscFunctionBeginUser;
  if (row->count > 1) PetscCall(PetscSNPrintf(number, sizeof(number), "%" PetscInt_FMT " ", row->count));
  switch (row->kind) {
  case SB_OPTION_BOOL:
    PetscCall(PetscSNPrintf(text, size, "true or false"));
    break;
  case SB_OPTION_INT:
    PetscCall(PetscSNPrintf(text, size, "whole number"));
    break;
  case SB_OPTION_REAL:
    PetscCall(PetscSNPrintf(text, size, "number"));
    break;
  case SB_OPTION_REALS:
    PetscCall(PetscSNPrintf(text, size, "%snumber%s with commas", number, many));
    break;
  case SB_OPTION_STRING:
    PetscCall(PetscSNPrintf(text, size, "text"));
    break;
  case SB_OPTION_NAMES:
    PetscCall(PetscSNPrintf(text, size, "names with commas"));
    break;
  case SB_OPTION_CHOICE:
    PetscCall(PetscSNPrintf(text, size, "one of"));
    break;
  case SB_OPTION_FORMULA:
    PetscCall(
      PetscSNPrintf(text, size, "%sformula%s%s", number, many, row->count > 1 ? " with semicolons" : ""));
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode help_row(PetscViewer viewer, const SbOptionBlock *block, const SbOption *row)
{
  char name[SB_OPTION_NAME_MAX], value[64];

  PetscFunctionBeginUser;
  PetscCall(SbOptionManualName(block, row, sizeof(name), name));
  PetscCall(describe_value(row, sizeof(value), value));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %s: %s", name, value));
  if (row->range[0])
    PetscCall(
      PetscViewerASCIIPrintf(viewer, "%s %s", row->kind == SB_OPTION_CHOICE ? "" : " in", row->range));
  if (row->unit[0]) PetscCall(PetscViewerASCIIPrintf(viewer, " %s", row->unit));
  if (!row->preset)
    PetscCall(PetscViewerASCIIPrintf(viewer, ", required"));
  else if (row->preset[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, ", default %s", row->preset));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n      %s\n", row->help));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Text of a table cell: a bar would end the cell. */
static PetscErrorCode print_cell(PetscViewer viewer, const char *text, PetscBool code)
{
  char escaped[1024];
  size_t n = 0;

  PetscFunctionBeginUser;
  for (; *text && n + 3 < sizeof(escaped); text++) {
    if (*text == '|' || (!code && (*text == '<' || *text == '*' || *text == '_'))) escaped[n++] = '\\';
    escaped[n++] = *text;
  }
  escaped[n] = 0;
  PetscCall(PetscViewerASCIIPrintf(viewer, code && n ? " `%s` |" : " %s |", escaped));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode markdown_row(PetscViewer viewer, const SbOptionBlock *block, const SbOption *row)
{
  char name[SB_OPTION_NAME_MAX], value[64];

  PetscFunctionBeginUser;
  PetscCall(SbOptionManualName(block, row, sizeof(name), name));
  PetscCall(describe_value(row, sizeof(value), value));
  PetscCall(PetscViewerASCIIPrintf(viewer, "|"));
  PetscCall(print_cell(viewer, name, PETSC_TRUE));
  PetscCall(print_cell(viewer, value, PETSC_FALSE));
  PetscCall(print_cell(viewer, row->unit, PETSC_FALSE));
  if (row->preset)
    PetscCall(print_cell(viewer, row->preset, PETSC_TRUE));
  else
    PetscCall(print_cell(viewer, "required", PETSC_FALSE));
  PetscCall(print_cell(viewer, row->range, PETSC_TRUE));
  PetscCall(print_cell(viewer, row->help, PETSC_FALSE));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Headline of a block: "The run", "Every body", "body: corotated". */
static PetscErrorCode headline(PetscViewer viewer, const SbOptionBlock *block, PetscBool markdown)
{
  const char *mark = markdown ? "## " : "";

  PetscFunctionBeginUser;
  if (!block->klass[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, "\n%sThe run\n", mark));
  else if (!block->type[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, "\n%sEvery %s\n", mark, block->klass));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "\n%s%s: %s\n", mark, block->klass, block->type));
  if (markdown)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "\n| option | value | unit | default | range | meaning |\n|---|---|---|---|---|---|\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All blocks of a class and type under one headline. */
static PetscErrorCode print_type(PetscViewer viewer, const SbOptionBlock *first, PetscBool markdown)
{
  PetscFunctionBeginUser;
  PetscCall(headline(viewer, first, markdown));
  for (const SbOptionBlock *b = first; b < SbTheOptions.block + SbTheOptions.nblock; b++) {
    if (strcmp(b->klass, first->klass) || strcmp(b->type, first->type)) continue;
    for (PetscInt i = 0; i < b->n; i++) {
      if (markdown)
        PetscCall(markdown_row(viewer, b, &b->rows[i]));
      else
        PetscCall(help_row(viewer, b, &b->rows[i]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool is_first(PetscInt i, PetscBool by_type)
{
  const SbOptionBlock *a = &SbTheOptions.block[i];

  for (const SbOptionBlock *b = SbTheOptions.block; b < a; b++)
    if (!strcmp(a->klass, b->klass) && (!by_type || !strcmp(a->type, b->type))) return PETSC_FALSE;
  return PETSC_TRUE;
}

static PetscErrorCode print_manual(PetscViewer viewer, PetscBool markdown)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < SbTheOptions.nblock; i++) {
    const char *klass = SbTheOptions.block[i].klass;

    if (!is_first(i, PETSC_FALSE)) continue;
    /* what all instances have comes before what one type has */
    for (int typed = 0; typed < 2; typed++) {
      for (PetscInt j = i; j < SbTheOptions.nblock; j++) {
        const SbOptionBlock *b = &SbTheOptions.block[j];

        if (!strcmp(b->klass, klass) && (b->type[0] != 0) == typed && b->n && is_first(j, PETSC_TRUE))
          PetscCall(print_type(viewer, b, markdown));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsHelp(MPI_Comm comm)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(comm, "", &viewer));
  PetscCall(
    PetscViewerASCIIPrintf(viewer, "supple %s - soft bodies by finite elements on PETSc\n\n", SB_VERSION));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  supple SCENARIO.opts [-option value ...]\n"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  mpirun -n 4 supple SCENARIO.yml\n\n"));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "The last value given wins. SI units. -help petsc lists PETSc's own options.\n"));
  PetscCall(print_manual(viewer, PETSC_FALSE));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsMarkdown(MPI_Comm comm, const char *file)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(comm, file, &viewer));
  PetscCall(
    PetscViewerASCIIPrintf(viewer,
                           "# Options of supple %s\n\nMade by `supple -options_markdown docs/options.md` "
                           "from the table in the source; `supple -help` prints the same.\n",
                           SB_VERSION));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "SI units. The last value given wins. Options of PETSc can be given as well.\n"));
  PetscCall(print_manual(viewer, PETSC_TRUE));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
