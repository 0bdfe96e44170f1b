/*
  option_view.c - writes the complete scenario as an option file that can be run.

  Every value read so far, as the user's or the default text, without loss of digits; then the
  user's options for PETSc. PETSc's file format cuts a line at '#', removes quotes around a value
  and has no escapes: a value with a blank is quoted; one that begins with a minus sign and a letter
  is preceded by a blank, as names begin so. A value with '#' or a quote can only be given on the
  command line, and the file says so.
*/
#include <ctype.h>
#include <errno.h>
#include <poll.h>
#include <unistd.h>
#include "option.h"

/* PETSc 3.18 allows 512 options; beyond this number of lines defaults are written as comments. */
#define LINES_MAX 420

static PetscErrorCode print_value(PetscViewer viewer, const char *value, int width)
{
  const PetscBool name_like =
    (PetscBool)(value[0] == '-' && (isalpha((unsigned char)value[1]) || value[1] == '-'));
  const char *quote = name_like || !value[0] || strpbrk(value, " \t'") ? "\"" : "";
  char text[PETSC_MAX_PATH_LEN + 4];

  PetscFunctionBeginUser;
  PetscCall(
    PetscSNPrintf(text, sizeof(text), "%s%s%s%s", quote, name_like ? " " : "", value, quote));
  PetscCall(PetscViewerASCIIPrintf(viewer, " %-*s", width, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode print_record(PetscViewer viewer, const SbOptionRecord *r,
                                   PetscBool with_presets)
{
  const SbOption *row = r->row;
  const char *mark = "# ";

  PetscFunctionBeginUser;
  if (strpbrk(r->text, "#\""))
    mark = "# an option file cannot hold this value; give it on the command line:\n# ";
  else if (r->given || (with_presets && r->text[0]))
    mark = "";
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s%s", mark, r->name));
  PetscCall(print_value(viewer, r->text, PetscMax(1, 48 - (int)strlen(r->name))));
  PetscCall(
    PetscViewerASCIIPrintf(viewer, " # %s%s%s%s%s%s%s\n", r->given ? "" : "default; ", row->help,
                           row->unit[0] ? ", " : "", row->unit, row->range[0] ? ", " : "",
                           row->range[0] == '[' || row->range[0] == '(' ? "in " : "", row->range));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool same_instance(const SbOptionRecord *a, const SbOptionRecord *b)
{
  return (PetscBool)(!strcmp(a->scope.klass, b->scope.klass) &&
                     !strcmp(a->scope.instance, b->scope.instance));
}

PetscErrorCode SbOptionsView(PetscViewer viewer)
{
  const PetscBool with_presets = (PetscBool)(SbTheOptions.nrecord < LINES_MAX);
  const SbOptionRecord *records = SbTheOptions.record;
  const SbOptionRecord *end = records + SbTheOptions.nrecord;
  char folder[PETSC_MAX_PATH_LEN];
  PetscInt n = SbTheOptions.nuser;
  SbOptionUser *users = SbTheOptions.user;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscGetWorkingDirectory(folder, sizeof(folder)));
  PetscCall(
    PetscViewerASCIIPrintf(viewer,
                           "# The complete scenario, written by supple %s; it runs again with\n"
                           "#   supple THIS_FILE\n"
                           "# from this folder, where relative file names begin: %s\n",
                           SB_VERSION, folder));
  if (!with_presets)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "# Defaults are comments: PETSc 3.18 holds at most 512 options.\n"));

  /* program-wide records in the order of the manual, independent of the order of reading */
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n# the run\n"));
  for (PetscInt i = 0; i < SbTheOptions.nrow; i++)
    for (const SbOptionRecord *r = records; r < end; r++)
      if (!r->scope.klass[0] && r->row == SbTheOptions.row[i].row)
        PetscCall(print_record(viewer, r, with_presets));

  /* all records of one instance under one headline */
  for (const SbOptionRecord *first = records; first < end; first++) {
    PetscBool seen = (PetscBool)!first->scope.klass[0];

    for (const SbOptionRecord *r = records; r < first && !seen; r++)
      seen = same_instance(first, r);
    if (seen)
      continue;
    PetscCall(
      PetscViewerASCIIPrintf(viewer, "\n# %s %s\n", first->scope.klass, first->scope.instance));
    for (const SbOptionRecord *r = first; r < end; r++)
      if (same_instance(r, first))
        PetscCall(print_record(viewer, r, with_presets));
  }

  /* the user's options of PETSc */
  if (!SbTheOptions.remembered)
    PetscCall(SbOptionUsersGet(&n, &users));
  for (PetscInt i = 0; i < n; i++) {
    const char *value = users[i].value;
    PetscBool ours = PETSC_FALSE;

    for (const SbOptionRecord *r = records; r < end && !ours; r++)
      ours = (PetscBool)!strcasecmp(r->name + 1, users[i].name);
    if (ours)
      continue;
    if (!any)
      PetscCall(PetscViewerASCIIPrintf(viewer, "\n# for PETSc\n"));
    any = PETSC_TRUE;
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s-%s", value && strpbrk(value, "#\"") ? "# " : "",
                                     users[i].name));
    if (value)
      PetscCall(print_value(viewer, value, 0));
    PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  }
  if (!SbTheOptions.remembered)
    PetscCall(SbOptionUsersFree(&n, &users));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbViewerOpen(MPI_Comm comm, const char *file, PetscViewer *viewer)
{
  PetscMPIInt rank;
  int error = 0;

  PetscFunctionBeginUser;
  if (!file[0] || !strcmp(file, "-")) {
    PetscCall(PetscViewerASCIIOpen(comm, "stdout", viewer));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* only rank 0 opens the file; a failure is broadcast, to avoid a deadlock */
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    FILE *f = fopen(file, "w");

    if (f)
      (void)fclose(f);
    else
      error = errno;
  }
  PetscCallMPI(MPI_Bcast(&error, 1, MPI_INT, 0, comm));
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write %s: %s", file,
             strerror(error));
  PetscCall(PetscViewerASCIIOpen(comm, file, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes what a stream still holds; whether all of it could be written. */
static int flush_failed(FILE *f)
{
  errno = 0;
  if (!fflush(f) && !ferror(f))
    return 0;
  return errno ? errno : EIO; /* an earlier write failed */
}

/* An error of rank 0 is one of all. */
static PetscErrorCode raise(MPI_Comm comm, int error, const char *name)
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Bcast(&error, 1, MPI_INT, 0, comm));
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot write all of %s: %s", name,
             error == EIO ? "the disk may be full" : strerror(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the other end of a pipe was closed: no error of a program in a row of them. */
static PetscBool reader_left(FILE *f)
{
  struct pollfd end = {.fd = fileno(f), .events = POLLOUT};

  return (PetscBool)(poll(&end, 1, 0) > 0 && end.revents & (POLLERR | POLLHUP));
}

PetscErrorCode SbStandardOutputCheck(MPI_Comm comm)
{
  PetscMPIInt rank;
  int error = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank)
    error = flush_failed(stdout);
  if (error == EPIPE || (error && reader_left(stdout)))
    error = 0;
  PetscCall(raise(comm, error, "standard output"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbViewerClose(MPI_Comm comm, const char *file, PetscViewer *viewer)
{
  PetscMPIInt rank;
  FILE *f;
  int error = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!file[0] || !strcmp(file, "-")) {
    PetscCall(PetscViewerDestroy(viewer));
    PetscCall(SbStandardOutputCheck(comm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscViewerASCIIGetPointer(*viewer, &f));
  if (!rank)
    error = flush_failed(f);
  PetscCall(PetscViewerDestroy(viewer));
  PetscCall(raise(comm, error, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
