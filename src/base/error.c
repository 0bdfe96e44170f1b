/*
  error.c - error handling: an error reaches the user as one line, once, and every rank ends with a
  non-zero code.

  PETSc's own handler prints a trace on every rank, which hides the relevant message. A *user error*
  (a wrong option, an unreadable file) needs no trace; its message is kept while the error code is
  returned up to main(), and SbErrorFinish() prints it. There all ranks enter a non-blocking
  reduction, which selects the lowest rank with an error to print. If others are blocked in a
  collective call, a rank that failed alone cannot complete it: after a grace period it prints the
  message and aborts the run.

  Internal errors are printed with PETSc's trace immediately, and as one line at the end too.

  A crash, as PETSc divides by zero where options of its solvers make no sense, is one line that
  names these options, and the exit code of PETSc's own handler.
*/
#include <signal.h>
#include <stdarg.h>
#include <strings.h>
#include <unistd.h>
#include "option.h"

#define GRACE 3.0 /* s; grace period in which a failed rank waits for the others */

static struct {
  MPI_Comm comm;       /* duplicate of the run's, without other pending communication */
  PetscBool pending;   /* a user error is being returned to main(), or was posted */
  PetscBool posted;    /* by SbErrorPost(): the run counts as failed */
  int code;            /* exit code of the program */
  PetscBool trace;     /* option -error_trace */
  char message[2048];  /* message of the last error */
  char file[256];      /* names of the option files, for messages about YAML */
  const char *program; /* program name, prefix of every message */
  void (*failure_handler)(const char *message,
                          void *ctx); /* called on the rank that prints the error */
  void *failure_ctx;
  void (*at_end)(void);
} state = {.comm = MPI_COMM_NULL, .program = "supple", .code = 1};

static PetscBool is_user_error(PetscErrorCode n, const char *function)
{
  static const int ours[] = {PETSC_ERR_USER,
                             PETSC_ERR_USER_INPUT,
                             PETSC_ERR_FILE_OPEN,
                             PETSC_ERR_FILE_READ,
                             PETSC_ERR_FILE_WRITE,
                             PETSC_ERR_FILE_UNEXPECTED,
                             PETSC_ERR_ARG_UNKNOWN_TYPE,
                             PETSC_ERR_MISSING_FACTOR,
                             PETSC_ERR_MEM};

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ours); i++)
    if ((int)n == ours[i])
      return PETSC_TRUE;

  // errors in options and option files, which PETSc raises under other codes
  return (PetscBool)(function && SbHasPrefix(function, "PetscOptionsInsert PetscOptionsStringTo "
                                                       "PetscOptionsSetValue PetscParseLayerYAML"));
}

/* Whether a viewer or monitor that the user gave, as "-dm_view draw", is why PETSc failed. */
static PetscBool is_wrong_viewer(const char *function, const char *file, const char *message,
                                 size_t size, char given[])
{
  const PetscBool viewer =
    (PetscBool)((file && (strstr(file, "src/sys/classes/viewer/") ||
                          strstr(file, "src/sys/classes/draw/"))) ||
                (file && function && strstr(file, "src/dm/") && strstr(function, "View")));

  given[0] = 0;
  for (PetscInt i = 0; file && i < SbTheOptions.nuser; i++) {
    const char *name = SbTheOptions.user[i].name;
    const char *value = SbTheOptions.user[i].value;
    const char *path = value ? strchr(value, ':') : NULL;
    const PetscBool shows = (PetscBool)(strstr(name, "_view") || strstr(name, "_monitor"));
    char text[PETSC_MAX_PATH_LEN];

    // the file that the message is about, or the only ones that may be meant
    SbFormat(sizeof(text), text, "%.*s", path ? (int)strcspn(path + 1, ":") : 0,
             path ? path + 1 : "");
    if (shows && value && value[0] && (viewer || (text[0] && message && strstr(message, text))))
      SbAppend(size, given, "%s-%s %s", given[0] ? " " : "", name, value);
  }
  return (PetscBool)(given[0] != 0);
}

/* Whether an option is of supple: one of a class, or a program-wide key. */
static PetscBool is_ours(const char *name)
{
  for (PetscInt i = 0; i < SbTheOptions.nrow; i++) {
    const char *klass = SbTheOptions.row[i].klass;
    const size_t n = strlen(klass);

    if (n ? !strncasecmp(name, klass, n) && name[n] == '_'
          : !strcasecmp(name, SbTheOptions.row[i].row->key))
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The options for PETSc's solvers, or for what cuts the mesh, that the user gave: "-pc_type mg
   -pc_mg_levels 3"; "" if there are none. Not those that only show something. */
static void solver_options(PetscBool cutting, size_t size, char text[])
{
  static const char *const words[] = {"ksp_", "pc_", "snes_", "mat_", "vec_", "dm_", "ts_"};
  static const char *const shows[] = {"_view", "_monitor", "_converged_reason"};

  text[0] = 0;
  for (PetscInt i = 0; i < SbTheOptions.nuser; i++) {
    const char *name = SbTheOptions.user[i].name;
    const char *value = SbTheOptions.user[i].value;
    PetscBool wanted = (PetscBool)(cutting && strstr(name, "petscpartitioner_"));

    for (size_t k = 0; !cutting && k < PETSC_STATIC_ARRAY_LENGTH(words); k++)
      wanted = (PetscBool)(wanted || strstr(name, words[k]));
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(shows); k++)
      wanted = (PetscBool)(wanted && !strstr(name, shows[k]));
    if (wanted && (cutting || !is_ours(name)))
      SbAppend(size, text, "%s-%s%s%s", text[0] ? " " : "", name, value ? " " : "",
               value ? value : "");
  }
}

/* Whether options of solvers that the user gave, as "-pc_type bjacobi -pc_bjacobi_blocks 1000", are
   why PETSc's solvers or containers failed. */
static PetscBool is_wrong_choice(const char *function, const char *file, size_t size, char given[])
{
  static const char *const rooms[] = {"src/ksp/", "src/snes/", "src/ts/",         "src/mat/",
                                      "src/vec/", "src/dm/",   "src/sys/objects/"};
  PetscBool petsc = PETSC_FALSE;

  given[0] = 0;
  for (size_t i = 0; file && i < PETSC_STATIC_ARRAY_LENGTH(rooms); i++)
    if (strstr(file, rooms[i]))
      petsc = PETSC_TRUE;
  if (!petsc)
    return PETSC_FALSE;
  solver_options((PetscBool)(strstr(file, "src/dm/partitioner/") != NULL), size, given);
  return (PetscBool)(given[0] || (function && strstr(function, "SetTolerances")));
}

/* Whether memory is used up. PETSc 3.18 gives a line number as the code. */
static PetscBool is_memory(PetscErrorCode n, const char *function)
{
  return (PetscBool)(n == PETSC_ERR_MEM ||
                     (function && SbHasPrefix(function, "PetscMallocAlign PetscReallocAlign")));
}

/* The message of an error: PETSc's, or our own where it says nothing. */
static const char *words(PetscErrorCode n, const char *function, const char *message, size_t size,
                         char own[])
{
  if (is_memory(n, function) && !(message && strstr(message, "out of memory"))) {
    SbFormat(size, own,
             "out of memory (%s): make the scene smaller, or raise the limits of memory (ulimit "
             "-v, -d, those of the batch system)",
             message && message[0] ? message : "PETSc");
    return own;
  }
  if (message && message[strspn(message, " \n")])
    return message;
  SbFormat(size, own, "error %d of PETSc in %s()", (int)n, function ? function : "?");
  return own;
}

static PetscErrorCode handler(MPI_Comm comm, int line, const char *function, const char *file,
                              PetscErrorCode n, PetscErrorType p, const char *mess, void *ctx)
{
  (void)comm;
  (void)ctx;
  if (is_memory(n, function))
    n = PETSC_ERR_MEM;
  if (p == PETSC_ERROR_INITIAL) {
    const PetscBool yaml = (PetscBool)(function && strstr(function, "YAML"));
    char given[256], own[256];
    const PetscBool choice =
      (PetscBool)(is_wrong_viewer(function, file, mess, sizeof(given), given) ||
                  is_wrong_choice(function, file, sizeof(given), given));

    state.code = 1;
    state.pending = (PetscBool)(choice || is_user_error(n, function));
    (void)snprintf(state.message, sizeof(state.message), "%s%s%s%s", yaml ? state.file : "",
                   yaml && state.file[0] ? ": " : "", words(n, function, mess, sizeof(own), own),
                   mess && !strncmp(mess, "Unknown first token", 19)
                     ? ": an option begins with a dash, and a comment with #"
                     : "");

    /* PETSc's words say nothing of a file, or of what to do */
    if (strstr(state.message, "max number of options"))
      SbFormat(
        sizeof(state.message), state.message,
        "the scenario has more options than PETSc %s can hold, 512: give what many bodies "
        "share as -body_default_..., make alike ones -body_NAME_copies, or use a newer PETSc",
        SB_PETSC_VERSION);
    if (choice) {
      for (char *c = strchr(state.message, '\n'); c; c = strchr(c, '\n'))
        *c = ' ';
      SbAppend(sizeof(state.message), state.message, "%s%s%s", given[0] ? ", with " : "", given,
               state.trace ? "" : " (-error_trace shows where)");
    }
  }
  if (state.pending && !state.trace)
    return n;

  /* PETSC_COMM_SELF: on a larger one PETSc's handler lets the other ranks sleep and exit with code
     0 */
  return PetscTraceBackErrorHandler(PETSC_COMM_SELF, line, function, file, n, p, mess, NULL);
}

PetscErrorCode SbErrorHandlerInstall(MPI_Comm comm, const char *program)
{
  PetscFunctionBeginUser;
  state.program = program;
  PetscCallMPI(MPI_Comm_dup(comm, &state.comm));
  PetscCall(PetscPushErrorHandler(handler, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Signal handler. The process is lost: what is said may fail where memory is damaged. */
static PetscErrorCode crashed(int number, void *ctx)
{
  static const struct {
    int number;
    const char *words;
  } kinds[] = {{SIGFPE, "a division by zero"},
               {SIGSEGV, "memory out of reach"},
               {SIGBUS, "memory out of reach"},
               {SIGILL, "an instruction that this processor does not have"}};
  static volatile sig_atomic_t again;
  const char *what = NULL;
  char given[512], line[1024];

  (void)ctx;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(kinds); i++)
    if (kinds[i].number == number)
      what = kinds[i].words;
  if (!what || state.trace || again)
    return PetscSignalHandlerDefault(number, NULL);
  again = 1;

  // the lowest rank that crashed ends all; the others leave it the time, until its signal comes
  if (PetscGlobalRank && sleep((unsigned)GRACE))
    _exit(PETSC_ERR_SIG);
  solver_options(PETSC_FALSE, sizeof(given), given);
  SbFormat(sizeof(line), line,
           "%s: error: a crash, %s (signal %d)%s%s%s; -error_trace shows more\n", state.program,
           what, number, given[0] ? ", with " : "", given,
           given[0] ? ": try other values of these, or leave them out"
                    : ": an error of the program or of a library");
  (void)!write(STDERR_FILENO, line, strlen(line));
  if (PetscGlobalSize == 1)
    _exit(PETSC_ERR_SIG);
  (void)MPI_Abort(state.comm, PETSC_ERR_SIG);
  return PETSC_ERR_SIG;
}

PetscErrorCode SbErrorCatchCrashes(void)
{
  PetscBool none;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsHasName(NULL, NULL, "-no_signal_handler", &none));
  if (none)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscPushSignalHandler(crashed, NULL));
  PetscCall(PetscRegisterFinalize(PetscPopSignalHandler));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbErrorSetTrace(PetscBool trace)
{
  state.trace = trace;
}

void SbErrorSetFile(const char *file)
{
  SbAppend(sizeof(state.file), state.file, "%s%s", state.file[0] ? ", " : "", file);
}

/* Whether PETSc can parse the first n lines of a text as YAML; *end: end of these lines. */
static PetscBool reads_lines(char text[], PetscInt n, char **end)
{
  PetscOptions trial;
  PetscErrorCode ierr;
  char kept;

  *end = text;
  for (PetscInt i = 0; i < n && **end; i++)
    *end += strcspn(*end, "\n") + (strchr(*end, '\n') != NULL);
  kept = **end;
  **end = 0;
  ierr = PetscOptionsCreate(&trial);
  if (!ierr)
    ierr = PetscOptionsInsertStringYAML(trial, text);
  (void)PetscOptionsDestroy(&trial);
  **end = kept;
  return (PetscBool)!ierr;
}

/* Adds the first line to the message with which the YAML file can no longer be parsed. */
void SbErrorFindYamlLine(void)
{
  char text[1 << 16], *end, message[sizeof(state.message)];
  const char *dot = strrchr(state.file, '.');
  FILE *f = NULL;
  PetscInt n = 0;
  size_t size;

  if (strstr(state.message, "YAML") && dot && (!strcmp(dot, ".yml") || !strcmp(dot, ".yaml")))
    (void)SbFileOpen(state.file, 0, &f);
  if (!f)
    return;
  size = fread(text, 1, sizeof(text) - 1, f);
  text[size] = 0;
  (void)fclose(f);
  for (const char *c = text; *c; c++)
    n += *c == '\n' || !c[1];
  memcpy(message, state.message, sizeof(message));
  while (n > 1 && !reads_lines(text, n - 1, &end))
    n--;
  (void)reads_lines(text, n - 1, &end);
  (void)snprintf(state.message, sizeof(state.message), "%.1900s, line %d: '%.*s'%s", message,
                 (int)n, (int)PetscMin(strcspn(end, "\n"), 60), end,
                 memchr(end, '\t', strcspn(end, "\n"))
                   ? "; YAML takes blanks, no tabs"
                   : "; compare its indentation, colons and quotes");
}

void SbErrorPost(PetscBool stopped, const char *message)
{
  SbFormat(sizeof(state.message), state.message, "%s", message);
  if (stopped)
    state.code = SB_EXIT_STOPPED;
  state.pending = state.posted = PETSC_TRUE;
}

void SbErrorSetFailureHandler(void (*failure_handler)(const char *message, void *ctx), void *ctx)
{
  state.failure_handler = failure_handler;
  state.failure_ctx = ctx;
}

void SbErrorSetCleanup(void (*fn)(void))
{
  state.at_end = fn;
}

/* Prints the error line; on one rank only. */
static void print_error(void)
{
  if (state.failure_handler)
    (*state.failure_handler)(state.message, state.failure_ctx);
  (void)fflush(stdout);
  (void)fprintf(stderr, "%s: %s: %s\n", state.program,
                state.code == SB_EXIT_STOPPED ? "stopped" : "error", state.message);
  (void)fflush(stderr);
}

int SbErrorFinish(PetscErrorCode ierr)
{
  enum {
    SPEAKER,
    FAILED
  }; /* SPEAKER, encoded: lowest rank with a user error, else with any error */
  int mine[2], all[2];
  int failed = 0;
  int done = 0;
  PetscMPIInt rank, size;
  MPI_Request request;
  double end;

  if (state.at_end)
    (*state.at_end)();

  // the lowest rank that failed speaks for all
  if (ierr)
    failed = 1;
  else if (state.posted)
    failed = state.code;
  (void)MPI_Comm_rank(state.comm, &rank);
  (void)MPI_Comm_size(state.comm, &size);
  mine[SPEAKER] = -rank - (state.pending ? 0 : size) - (failed ? 0 : 2 * size);
  mine[FAILED] = failed;
  (void)MPI_Iallreduce(mine, all, 2, MPI_INT, MPI_MAX, state.comm, &request);
  end = MPI_Wtime() + GRACE + 0.1 * PetscMin(rank, 20);
  while (!done && (!failed || MPI_Wtime() < end)) {
    (void)MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (!done)
      (void)usleep(1000);
  }
  if (!done) {
    print_error();
    (void)MPI_Abort(state.comm, 1);
  }
  if (all[FAILED] && all[SPEAKER] == mine[SPEAKER])
    print_error();
  (void)MPI_Comm_free(&state.comm);
  (void)MPI_Finalize();
  return all[FAILED];
}

PetscErrorCode SbCatchError(MPI_Comm comm, int line, const char *function, const char *file,
                            PetscErrorCode code, PetscErrorType kind, const char *text, void *ctx)
{
  SbCaughtError *caught = (SbCaughtError *)ctx;
  char own[256];

  if (is_memory(code, function))
    code = PETSC_ERR_MEM;
  if (kind == PETSC_ERROR_INITIAL) {
    caught->code = (int)code;
    (void)snprintf(caught->text, sizeof(caught->text), "%s",
                   words(code, function, text, sizeof(own), own));
  }
  if (!is_user_error(code, NULL))
    (void)PetscTraceBackErrorHandler(comm, line, function, file, code, kind, text, NULL);
  return code;
}

PetscErrorCode SbCaughtRaise(MPI_Comm comm, const SbCaughtError *caught)
{
  SbCaughtError first = *caught;
  PetscMPIInt rank, size, who;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  who = caught->code ? rank : size;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &who, 1, MPI_INT, MPI_MIN, comm));
  if (who == size)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Bcast(&first, (int)sizeof(first), MPI_BYTE, who, comm));
  SETERRQ(comm, (PetscErrorCode)first.code, "%s", first.text);
}

PetscErrorCode SbWarning(MPI_Comm comm, const char *format, ...)
{
  PetscMPIInt rank;
  va_list args;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  (void)fflush(stdout);
  (void)fprintf(stderr, "%s: warning: ", state.program);
  va_start(args, format);
  (void)vfprintf(stderr, format, args);
  va_end(args);
  (void)fprintf(stderr, "\n");
  PetscFunctionReturn(PETSC_SUCCESS);
}
