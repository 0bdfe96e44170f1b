/*
  sbbase.h - layer 0: options described by tables, errors and warnings, formulas of time and
  position.
*/
#pragma once
#include <petsc.h>
#include <stdint.h>

#include "sbcompat.h"

#define SB_VERSION "0.1.0"
#define SB_NAME_MAX 64 /* longest name of a body, set or effect, with the terminating zero */

#define SB_OPTION_DEFAULT \
  "default" /* -body_default_<key> applies to bodies without their own <key> */

/* options */
typedef enum {
  SB_OPTION_BOOL,
  SB_OPTION_INT,
  SB_OPTION_REAL,
  SB_OPTION_REALS,  /* exactly `count` numbers separated by commas */
  SB_OPTION_STRING, /* free text: a file name, a mesh description */
  SB_OPTION_NAMES,  /* any number of names separated by commas */
  SB_OPTION_CHOICE, /* one word out of `range`, "a|b|c" */
  SB_OPTION_FORMULA /* `count` formulas of t, x, y, z, separated by semicolons; see SbFormula */
} SbOptionKind;

/*
  One row describes one option of ours. Rows are `static const` arrays beside the code that reads
  them; registered, they are the table from which -help, the checks, -scenario_view and
  docs/options.md are made.
*/
typedef struct {
  const char *key; /* last part of the name: "young" in -body_liver_young */
  SbOptionKind kind;
  PetscInt count;   /* values of SB_OPTION_REALS, formulas of SB_OPTION_FORMULA; 1 otherwise */
  const char *unit; /* "Pa", "kg/m^3"; "" when there is none */
  /* default as it would be typed; NULL: must be given; "": none, number, truth value or choice
     stay */
  const char *preset;
  const char *range; /* "(0, inf)", "[0, 0.5)" for numbers; "a|b|c" for a choice; "" when free */
  const char *help;  /* one sentence */
} SbOption;

/*
  Where an option is read: -<klass>_<instance>_<key>, or -<key> when klass is "" (program-wide
  options). `type` is the registered name of the implementation that reads it ("gravity",
  "corotated"; "" for what all instances of the class have); it selects the rows, it is not part of
  the option's name.
*/
typedef struct {
  char klass[SB_NAME_MAX]; /* "", "body", "set", "effect" */
  char type[SB_NAME_MAX];
  char instance[SB_NAME_MAX]; /* "liver" */
} SbScope;
extern const SbScope SbRunScope; /* of the program-wide options */

/* Adds n rows to the table, PETSC_DECIDE: up to one without a key. Names and rows must live as long
   as the program. Not collective. */
PetscErrorCode SbOptionsRegister(const char *klass, const char *type, PetscInt n,
                                 const SbOption rows[]);
void SbScopeSet(SbScope *scope, const char *klass, const char *type, const char *instance);

/*
  Readers: value given by the user for the instance, for what it is a copy of (SbOptionsInherit()),
  or, of bodies, for all by -body_default_<key>; else the preset of the row. Each value read is
  remembered with its text (for SbOptionsView(), SbOptionsCheck()). Errors (PETSC_ERR_USER, one line
  that names the full option, value, range, unit): unreadable, out of range, missing; a key without
  a row is a programming error.
*/
PetscErrorCode SbOptionBool(const SbScope *scope, const char *key, PetscBool *value);
PetscErrorCode SbOptionInt(const SbScope *scope, const char *key, PetscInt *value);
PetscErrorCode SbOptionReal(const SbScope *scope, const char *key, PetscReal *value);
PetscErrorCode SbOptionReals(const SbScope *scope, const char *key, PetscReal value[]);
PetscErrorCode SbOptionString(const SbScope *scope, const char *key, size_t size, char value[]);
/* names: PetscFree(); choice: position in `range`, into an int or an enum; second: whether it is
   1. */
PetscErrorCode SbOptionNames(const SbScope *scope, const char *key, PetscInt *n,
                             char (**names)[SB_NAME_MAX]);
PetscErrorCode SbOptionChoice(const SbScope *scope, const char *key, void *choice);
PetscErrorCode SbOptionSecond(const SbScope *scope, const char *key, PetscBool *second);
/* From now on -<klass>_<instance>_<key>, if not given, has the value of -<klass>_<from>_<key>. */
PetscErrorCode SbOptionsInherit(const char *klass, const char *instance, const char *from);
/* Whether the user gives it; does not count as reading for SbOptionsView(). */
PetscErrorCode SbOptionGiven(const SbScope *scope, const char *key, PetscBool *given);
/* Reads and checks a value that is asked for only later, when much has been computed already. */
PetscErrorCode SbOptionCheckEarly(const SbScope *scope, const char *key);
/* The row of a key in the scope; NULL if there is none. */
const SbOption *SbOptionFind(const SbScope *scope, const char *key);

/* Full name, e.g. "-body_liver_young", for messages. */
void SbOptionName(const SbScope *scope, const char *key, size_t size, char name[]);

/* Adds options of PETSc's objects, such as "-key value", with a prefix to PETSc's database unless
   the user set them, or (clear) removes those whose values are still the same. -ksp_type and
   -pc_type are skipped: they are set by calls, so that types in the database are always the user's.
   Not collective. */
PetscErrorCode SbOptionsSetDefaults(const char *prefix, const char *options, PetscBool clear);

/* Examines the options of ours that nobody read (src/base/option_check.c): warns of one that is of
   no use in this run, with the reason; one that does not exist ends the run, with the nearest
   names, as does a value of PETSc's that cannot be meant (src/base/option_petsc.c). Collective. */
PetscErrorCode SbOptionsCheck(void);
/* Notes the names in the lists of a scenario file (-bodies, -effects, ...), which the command line
   may override. After all rows are registered. Collective. */
PetscErrorCode SbOptionsFile(MPI_Comm comm, const char *file);
/* Call once, when the user's options are all in the database and before the program adds its own
   (presets of solvers): what is added later is not the user's. Without this call everything counts.
   Not collective. */
PetscErrorCode SbOptionsRemember(void);
/* PetscInitialize() without the files .petscrc, which PETSc would read in the home and in the
   working folder; `-skip_petscrc no` on the command line reads them. *argv is replaced.
   Collective. */
PetscErrorCode SbOptionsInitialize(int *argc, char ***argv, const char *file);
/* Why an option file is not read, "" if it is: the first option in it, or in a file that it names,
   with which PETSc would load a library, run a program or open a connection (-dll_append); a file
   in it that cannot be read. Before PetscInitialize(). Not collective. */
void SbOptionsRefused(const char *file, size_t size, char why[]);
/* The options of the environment (PETSC_OPTIONS, PETSC_OPTIONS_YAML of this process) that count, as
   "-name value ..."; after SbOptionsRemember(). Not collective. */
PetscErrorCode SbOptionsEnvironment(size_t size, char text[]);
/* At the end of a run: warns about each option of the user's that nobody read; n: how many.
   Collective. */
PetscErrorCode SbOptionsUnused(MPI_Comm comm, PetscInt *n);
/* The complete scenario as an option file that runs again: every option of ours read so far with
   its value, help as comment, then the PETSc options that the user gave. Collective; rank 0
   writes. */
PetscErrorCode SbOptionsView(PetscViewer viewer);
/*
  SbOptionsHelp - the manual for -help, from the table.

  Collective; rank 0 prints. topic: "": how to run it, a first scene, the topics; "all": everything;
  else a class, a type, the first word of options, or a word in their names and texts. Errors:
  PETSC_ERR_USER.
*/
PetscErrorCode SbOptionsHelp(MPI_Comm comm, const char *topic);
/* The table for programs (scripts/manual): columns class, type, option, kind, count, unit,
   required, default, range, meaning, with tabs between them and a headline. Collective; rank 0
   writes; file "-": to stdout. */
PetscErrorCode SbOptionsTable(MPI_Comm comm, const char *file);
/* ASCII viewer on a file, "" or "-": standard output; an error on every rank if not writable.
   Collective. */
PetscErrorCode SbViewerOpen(MPI_Comm comm, const char *file, PetscViewer *viewer);
/* Destroys it; an error on every rank (PETSC_ERR_FILE_WRITE) if not all could be written.
   Collective. */
PetscErrorCode SbViewerClose(MPI_Comm comm, const char *file, PetscViewer *viewer);
/* The error alone, of what rank 0 has printed to standard output; a reader that left early is
   none. Collective. */
PetscErrorCode SbStandardOutputCheck(MPI_Comm comm);
PetscErrorCode
SbOptionsReset(void); /* forgets what was read and registered; before PetscFinalize() */

/* SbSuggestNames - the names of `n` candidates closest to `word` by edit distance, joined by " or
   "; "" when none is near. NULL among the names is passed over: PetscFunctionListGet() counts its
   closing one. */
void SbSuggestNames(const char *word, PetscInt n, const char *const names[], size_t size,
                    char text[]);
/* What to say of a word that is none of these names: "p1, cr, dg; did you mean cr?". */
void SbSuggestName(const char *word, PetscInt n, const char *const names[], size_t size,
                   char text[]);
/* The same with the names in alphabetical order; sorts them. */
void SbAdviseSorted(const char *word, PetscInt n, const char *names[], size_t size, char text[]);
/* Whether a word begins with one of these, "ksp_ pc_ snes_", in capitals or not. */
PetscBool SbHasPrefix(const char *word, const char *beginnings);

/* errors and warnings */

/*
  SbErrorHandlerInstall - from here on a user error (PETSC_ERR_USER, PETSC_ERR_USER_INPUT,
  PETSC_ERR_FILE_*, a bad option file) is not printed where it happens, but by SbErrorFinish().
  Other errors get PETSc's trace. Collective; after MPI_Init(), before PetscInitialize(). comm: of
  the run, is duplicated; program: a literal, begins error lines and warnings.
*/
PetscErrorCode SbErrorHandlerInstall(MPI_Comm comm, const char *program);
/* A crash (SIGSEGV, SIGFPE, ...) is one line with the options of solvers that were given; not with
   -no_signal_handler. After PetscInitialize(). */
PetscErrorCode SbErrorCatchCrashes(void);
void SbErrorSetTrace(PetscBool trace); /* the stack of calls with every error, also of the input */
/* The option file that PETSc is about to read: PETSc's messages about YAML do not name it. */
void SbErrorSetFile(const char *file);
/* Adds the line of a syntax error in a YAML file, "line 6: ...", to the message of PETSc's
   error. */
void SbErrorFindYamlLine(void);
#define SB_EXIT_STOPPED \
  75 /* of a run that was asked to stop and can go on: EX_TEMPFAIL of sysexits.h */
/* An error line at the end of a run whose calls all succeeded: a solver gave up, the output is
   complete. stopped: no error but a requested stop: the line says so, and the exit code is
   SB_EXIT_STOPPED. */
void SbErrorPost(PetscBool stopped, const char *message);
/* Callback on one rank when the run fails, before the error line, in any state of PETSc; no
   communication. */
void SbErrorSetFailureHandler(void (*failure_handler)(const char *message, void *ctx), void *ctx);
/* Callback on this rank at the start of SbErrorFinish(), with or without an error, to remove
   files. */
void SbErrorSetCleanup(void (*fn)(void));
/*
  SbErrorFinish - last call of main() on every rank: `supple: error: ...` on stderr, once for the
  run; then MPI_Finalize(), or MPI_Abort() when other ranks do not arrive within a few seconds.
  Returns the exit code, non-zero on all ranks when one failed. `ierr` is the code that came up, 0
  after PetscFinalize().
*/
int SbErrorFinish(PetscErrorCode ierr);
/* An error of one rank (rank 0, a child process), to be raised by all. */
typedef struct {
  int code;
  char text[1024];
} SbCaughtError;
/* For PetscPushErrorHandler(), ctx an SbCaughtError: keeps the message; internal errors also have a
   trace. */
PetscErrorCode SbCatchError(MPI_Comm comm, int line, const char *function, const char *file,
                            PetscErrorCode code, PetscErrorType kind, const char *text, void *ctx);
/* Keeps the error of a call that this rank makes alone: SB_CATCH(&caught, call). */
#define SB_CATCH(caught, call)                              \
  do {                                                      \
    PetscErrorCode sb_ierr;                                 \
    PetscCall(PetscPushErrorHandler(SbCatchError, caught)); \
    sb_ierr = call;                                         \
    PetscCall(PetscPopErrorHandler());                      \
    (caught)->code = (int)sb_ierr;                          \
  } while (0)
/* Raises the error caught by the lowest failed rank on all ranks. Collective. */
PetscErrorCode SbCaughtRaise(MPI_Comm comm, const SbCaughtError *caught);
/* One line `supple: warning: ...` on stderr by rank 0 of comm; printf format without newline.
   Collective. */
PetscErrorCode SbWarning(MPI_Comm comm, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(2, 3);

/* texts */

/* Prints into text, or appends to it; truncated to size. */
void SbFormat(size_t size, char text[], const char *format, ...) PETSC_ATTRIBUTE_FORMAT(3, 4);
void SbAppend(size_t size, char text[], const char *format, ...) PETSC_ATTRIBUTE_FORMAT(3, 4);
/* Comma-separated numbers, into p[most]; returns their count, -1 for other text or more numbers. */
int SbParseNumbers(const char *text, int most, PetscReal p[]);

/* files */

#define SB_TEXT_BYTES ((size_t)1 << 28) /* largest size of a table, a file of copies, a history */

/* Opens a regular file for reading, of at most `most` bytes (0: any size): never waits, as for a
   pipe without a writer. Returns NULL, or the reason why not, and then *file is NULL. Close with
   fclose(). */
const char *SbFileOpen(const char *path, size_t most, FILE **file);
/* A new empty file for writing, in place of what has this name: a link is removed, not followed.
   NULL and errno if that fails. Close with fclose(). */
FILE *SbFileCreate(const char *path);

/* arrays */

/* Enlarges *array, of *size elements of `unit` bytes, to at least `need`, and twice: appending is
   cheap. */
PetscErrorCode SbReserve(PetscInt need, size_t unit, PetscInt *size, void *array);
/*
  SbBucketByKey - positions 0..n-1 by key: those with key k are item[start[k]..start[k + 1]),
  ascending.

  Not collective. Positions with a key below 0 or from nkey on take no part. Output: start[nkey +
  1], item[start[nkey]]; the caller frees both.
*/
PetscErrorCode SbBucketByKey(PetscInt n, const PetscInt key[], PetscInt nkey, PetscInt **start,
                             PetscInt **item);
/* Sorts n items of `size` bytes by the nkey PetscInts that they begin with, one after the other. */
PetscErrorCode SbSortByKeys(PetscInt n, size_t size, int nkey, void *item);
/*
  SbAllgatherv - one array on all ranks, of those of all ranks in their order.

  Collective. Input: mine[n]. Output: total; all, address of a pointer to the array, which the
  caller frees; before (or NULL), entries of lower ranks.
*/
PetscErrorCode SbAllgatherv(MPI_Comm comm, MPI_Datatype type, PetscInt n, const void *mine,
                            PetscInt *total, void *all, PetscInt *before);

/* memory */

/* Whether limits of memory (ulimit -v, -d) leave room for a run; if not, says so in one line on
   stderr. Before MPI_Init(). program: begins the line. */
PetscBool SbMemoryIsEnough(const char *program);

/* Freed arrays of 32 MiB and more go back to the system from here on. After PetscInitialize(). */
void SbMemoryReturnLarge(void);

/* threads */

/*
  SbThreadsSetOne - from here on loaded libraries (OpenMP's, BLAS) compute on the calling thread
  alone.

  Not collective. Returns the number of threads that some library would still use, 1 when all obey.
  For libraries that are loaded later call it again.
*/
int SbThreadsSetOne(void);

/* m; a tenth of a light year. Coordinates and displacements beyond it are errors where they enter,
   as products of six of them must not overflow. */
#define SB_LENGTH_MAX 1e15
/* Whether each of n numbers is finite and at most SB_LENGTH_MAX in size. */
static inline PetscBool SbLengthsFit(PetscInt n, const PetscReal x[])
{
  for (PetscInt i = 0; i < n; i++)
    if (!(PetscAbsReal(x[i]) <= SB_LENGTH_MAX))
      return PETSC_FALSE;
  return PETSC_TRUE;
}

/* formulas */

/*
  SbFormula - a number as a function of time t (s) and rest position x, y, z (m).

  Text: numbers, t x y z, pi, + - * / ^, parentheses, unary minus, functions sin cos tan asin acos
  atan atan2 exp log sqrt abs min max floor tanh step(a) (0 for a < 0, else 1), ramp(a) (a clamped
  to [0, 1]), clamp(a, lo, hi); or `table:FILE`, a file with two columns (t in s, value; comma or
  blanks; # comments), linear in between, constant outside. Compiled once to a stack program;
  evaluation allocates nothing.
*/
typedef struct _p_SbFormula *SbFormula;
/*
  Its value. Not collective. x may be NULL when the formula does not use it.

  Error: PETSC_ERR_USER_INPUT with option, time and place if the value is not a number, infinite, or
  a length beyond SB_LENGTH_MAX.
*/
PetscErrorCode SbFormulaEval(SbFormula formula, PetscReal t, const PetscReal x[3],
                             PetscReal *value);
PetscBool SbFormulaUses(SbFormula formula, char variable); /* 't': time; 'x': position */
PetscErrorCode SbFormulaDestroy(SbFormula *formula);
/*
  Live formulas (src/base/live.c): numbers set during a run, where a formula of an effect is the
  word `live`.

  SetUp: file, largest speed (m/s) and angular speed (degree/s), largest ratio of simulated to real
  time, 0: no limit; before the first step. Of number i = 0 .. SbLiveCount() - 1: Column, its name
  in the history and its unit (may be NULL); Get, its value at time t of the present step; Set
  changes it. Advance: after an accepted step that ended at t, reads new targets from the file.
  Collective.
*/
void SbLiveSetUp(const char *file, PetscReal speed, PetscReal angular_speed, PetscReal pace);
PetscInt SbLiveCount(void);
const char *SbLiveColumn(PetscInt i, const char **unit);
PetscReal SbLiveGet(PetscInt i, PetscReal t);
void SbLiveSet(PetscInt i, PetscReal t, PetscReal value);
PetscErrorCode SbLiveAdvance(MPI_Comm comm, PetscReal t);
/* Reads an option of kind SB_OPTION_FORMULA: `count` formulas as in the row; destroy each. */
PetscErrorCode SbOptionFormulas(const SbScope *scope, const char *key, SbFormula formulas[]);

/* log events and stages: the list grows with every new phase */

/* One event per phase that can take one percent of a run; registered by SbLogInitialize(). */
typedef enum {
  SB_EVENT_MESH_READ,
  SB_EVENT_MESH_DISTRIBUTE,
  SB_EVENT_SPACE_SETUP,
  SB_EVENT_MATRIX_SETUP,
  SB_EVENT_RESIDUAL,
  SB_EVENT_TANGENT,
  SB_EVENT_ENERGY,
  SB_EVENT_EFFECTS,
  SB_EVENT_CONTACT,
  SB_EVENT_SEARCH,      /* for pairs of vertices, edges and triangles that may meet */
  SB_EVENT_SEARCH_HASH, /* within it: by the spatial hash */
  SB_EVENT_SEARCH_TREE, /* within it: by trees of boxes */
  SB_EVENT_PROJECT,     /* within solves: into the null space of the contact constraints */
  SB_EVENT_SOLVER_SETUP,
  SB_EVENT_CONTACT_SOLVE, /* systems with blocks of contact, without PETSc's KSPSolve */
  SB_EVENT_STABILITY,     /* negative eigenvalues of static tangents, with what that takes */
  SB_EVENT_OUTPUT,
  SB_EVENT_CHECKPOINT,
  SB_EVENT_COUNT
} SbEvent;
extern PetscLogEvent SbEvents[SB_EVENT_COUNT];
extern PetscLogStage SbLogStageSetup, SbLogStageSolve, SbLogStageOutput;
PetscErrorCode SbLogInitialize(void);
/*
  SbLogNamed - the log event of something that a scene names: "SbEff_gravity", made when first asked
  for.

  Not collective, but to be called alike on all ranks: PETSc identifies events by their order.

  Input:
    kind, name - "Eff" (effects), "Mat" (laws), "Elem" (elements), "Field" (fields of fields.h5),
    "Out" (other
                 output), "Est" (estimates), "Mesh" (re-meshing), and the name in the scenario
  Output:
    event      - of all that have this name
*/
PetscErrorCode SbLogNamed(const char *kind, const char *name, PetscLogEvent *event);
/* Phases of a run. Events of a phase do not contain each other; the solve is PETSc's KSP and PC
   events. */
typedef enum {
  SB_PHASE_MESH,
  SB_PHASE_SETUP,
  SB_PHASE_RESIDUAL,
  SB_PHASE_TANGENT,
  SB_PHASE_SOLVE,
  SB_PHASE_CONTACT, /* without the search */
  SB_PHASE_SEARCH,
  SB_PHASE_ENERGY,
  SB_PHASE_OUTPUT,
  SB_PHASE_OTHER, /* time outside all events: 0 */
  SB_PHASE_COUNT
} SbPhase;
/* Seconds of each phase so far on this rank. Not collective. */
PetscErrorCode SbLogSeconds(PetscReal seconds[SB_PHASE_COUNT]);
