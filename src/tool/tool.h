/*
  tool.h - shared declarations of supple-mesh: command line and commands.
*/
#pragma once
#include "sbmeshio.h"
#include "sbsurface.h"

#define SB_TOOL_OPTIONS 17

/* Command line of supple-mesh, parsed. */
typedef struct {
  PetscBool help, version;
  int nword;
  const char *word[4];              /* command, then files; further words are only counted */
  PetscBool given[SB_TOOL_OPTIONS]; /* by rows of the table of options */
  const char *unknown;              /* first option, without dash, that is none of PETSc's either */
} SbToolLine;

typedef struct _SbTool {
  const struct _SbToolCommand *command;
  const char *in, *out;     /* out: NULL if the command writes no mesh */
  SbBody body;              /* body of the file `in`: name, step, scale, rotate, translate, tet */
  PetscInt levels;          /* option -levels */
  SbMeshFormat format;      /* option -format */
  char group[SB_GROUP_MAX]; /* option -group; "": the whole mesh */
  char view[PETSC_MAX_PATH_LEN]; /* option -view; "": no picture */
  PetscBool quiet;
  PetscLogDouble start,
    last;                   /* wall time of the beginning of the phase and of the last report, s */
  PetscBool terminal, open; /* standard error is a terminal; the line there is to be overwritten */
  const char *phase;        /* description of the phase: "reading liver.msh" */
} SbTool;

/* line.c */
/* Reads the command line, and removes the words that are not options, -help and -version from
   argc, argv for PETSc. line borrows from argv. Before PetscInitialize(). */
PetscErrorCode SbToolCommandLine(int *argc, char *argv[], SbToolLine *line);
/* Checks command, number of files and options, and reads the options. */
PetscErrorCode SbToolSetFromOptions(const SbToolLine *line, SbTool *tool);
PetscErrorCode SbToolHelp(void);

/* commands.c: runs the command. */
PetscErrorCode SbToolRun(SbTool *tool);
/* Table of commands, ends with NULL; nfile: number of files; help: one line. */
typedef struct _SbToolCommand {
  const char *name, *files, *help;
  int nfile;
  PetscErrorCode (*run)(SbTool *tool, SbImport *mesh);
} SbToolCommand;
extern const SbToolCommand SbToolCommands[];

/* info.c */
PetscErrorCode SbToolInfo(SbTool *tool, SbImport *mesh);

/* view.c: renders the mesh to the picture tool->view. */
PetscErrorCode SbToolView(SbTool *tool, const SbImport *mesh);

/* progress.c: begins a phase that may take long, with a progress line. */
void SbToolBegin(SbTool *tool, const char *phase);
PetscErrorCode SbToolProgress(const char *what, PetscInt64 done, PetscInt64 total, void *ctx);
void SbToolEnd(SbTool *tool);
/* Runs a call as a phase with a progress line. */
#define SB_TOOL_PHASE(tool, phase, call) \
  do {                                   \
    PetscErrorCode sb_ierr;              \
    SbToolBegin(tool, phase);            \
    sb_ierr = (call);                    \
    SbToolEnd(tool);                     \
    PetscCall(sb_ierr);                  \
  } while (0)
/* Number with separators: 1234567 is "1,234,567". */
const char *SbToolNumber(PetscInt64 n, char text[32]);
