/*
  sbscene.h - layer 10: from the command line and an option file to a model; names that a scenario
  may use.
*/
#pragma once
#include "sbledger.h"
#include "sboutput.h"

/* What the command line asks of the program beside the options of the scenario: words of argv,
   borrowed; NULL when not asked for. */
typedef struct {
  const char *help;     /* topic, "" without one */
  const char *view;     /* file of -scenario_view, "" for standard output */
  const char *table;    /* file of -options_table, "-" for standard output */
  const char *scenario; /* first word of the command line when it is no option */
  PetscBool version;
  PetscInt nfile;
  const char *file[16]; /* [nfile] scenario and other option files that can be read, in order */
  char
    problem[PETSC_MAX_PATH_LEN + 256]; /* what is wrong with the command line; "" when nothing is */
} SbCommand;

/*
  SbCommandLine - takes what is for the program itself out of the command line. Collective on comm;
  after MPI_Init(), before PetscInitialize().

  Taken out: -help [TOPIC], -version, -scenario_view [FILE], -options_table FILE; `-help petsc`
  becomes PETSc's own -help. Nothing at all is a request for help, and nothing to run. A first word
  that is no option names the scenario; it stays, and PETSc passes over it. A
  word that belongs to no option and an option file that cannot be read (rank 0 looks) are described
  in command->problem, because PETSc cannot report an error before PetscInitialize(); an
  -options_file that cannot be read is taken out.

  Input and output:
    argc, argv - as from main(); words are taken out in place
*/
PetscErrorCode SbCommandLine(MPI_Comm comm, int *argc, char *argv[], SbCommand *command);

/* Registers every type and option row of the program, in one readable list. Not collective. */
PetscErrorCode SbRegisterAll(void);

/*
  SbSceneCreate - the model that the scenario describes: bodies, sets, materials, elements, effects.
  Collective. The caller destroys the model with SbModelDestroy().

  Options read: -bodies and -body_<name>_..., -sets and -set_<name>_at, -effects and
  -effect_<name>_...; -mass and -mesh_..., which are used later, so that their values are checked
  before anything is computed. A set that is named and that -sets does not define is, in this order:
  the body of that name, all bodies ("all"), the whole boundary ("boundary"), the physical group of
  that name in the meshes. Errors: PETSC_ERR_USER for a missing or unknown name, doubled names,
  values out of range.
*/
PetscErrorCode SbSceneCreate(MPI_Comm comm, SbModel *model);

/*
  SbSceneCheck - what no single option can know: mesh files exist, a static run is constrained by
  something. Collective; after SbRunCreate(), which says whether the run is static.

  Errors: PETSC_ERR_USER with names that are near in the folder of a missing file.
*/
PetscErrorCode SbSceneCheck(SbModel model);

/* Warns of bodies so large that their files may be in mm. Collective; after SbModelSetUp(). */
PetscErrorCode SbSceneCheckSizes(SbModel model);

/* -show: prints where bodies, sets, effects and obstacles are at the start, m. Collective; after
   SbRunSetUp(). */
PetscErrorCode SbSceneShow(SbRun run);

/* Warns of bodies that overlap and have no contact with each other; `when`: begins the sentence. It
   looks at boxes first, and further only at bodies whose boxes overlap. found: whether it warned.
   Collective. */
PetscErrorCode SbSceneWarnOverlap(SbRun run, const char *when, PetscBool *found);
