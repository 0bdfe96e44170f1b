/*
  tool.h - what the files of supple-mesh share: its command line, its commands.
*/
#pragma once
#include "sbmeshfile.h"

/* The command line of supple-mesh, taken apart. */
typedef struct {
  PetscBool help, version;
  int nword;
  const char *word[4];              /* command, then files; more are counted only */
  char problem[PETSC_MAX_PATH_LEN]; /* what is wrong; "" when nothing is */
} SbToolLine;

typedef struct _SbTool {
  const char *command, *in, *out; /* out: NULL when the command writes no mesh */
  SbBody body;                    /* of `in`: name of the file, step, scale, rotate, translate, tet */
  PetscReal merge_tolerance;      /* -merge_tolerance, m; below 0: the default */
  PetscInt levels;                /* -levels */
  SbMeshFormat format;            /* -format */
  char view[PETSC_MAX_PATH_LEN];  /* -view; "" for no picture */
  PetscBool quiet;
  PetscLogDouble start, last; /* wall time of the phase that is reported, and of the last report, s */
  PetscBool terminal, open;   /* standard error is a terminal; a line is being rewritten there */
  const char *phase;          /* "reading liver.msh" */
} SbTool;

/* line.c */
/* Takes words that are no options, -help and -version out of argc, argv. Before PetscInitialize(). */
PetscErrorCode SbToolCommandLine(int *argc, char *argv[], SbToolLine *line);
/* Checks command, number of files and options, and reads these. */
PetscErrorCode SbToolSetFromOptions(int argc, char *argv[], const SbToolLine *line, SbTool *tool);
PetscErrorCode SbToolHelp(void);
PetscErrorCode SbToolRegister(void);

/* commands.c: runs the command. */
PetscErrorCode SbToolRun(SbTool *tool);
/* Names of the commands, NULL at the end; nfile: how many files each wants; help: a line about each. */
typedef struct {
  const char *name, *files, *help;
  int nfile;
  PetscErrorCode (*run)(SbTool *tool, SbImport *mesh);
} SbToolCommand;
extern const SbToolCommand SbToolCommands[];

/* info.c */
PetscErrorCode SbToolInfo(SbTool *tool, SbImport *mesh);

/* view.c: draws the mesh to tool->view. */
PetscErrorCode SbToolView(SbTool *tool, const SbImport *mesh);

/* progress.c: a line on standard error while something takes long. */
void SbToolBegin(SbTool *tool, const char *phase);
PetscErrorCode SbToolProgress(const char *what, PetscInt64 done, PetscInt64 total, void *ctx);
void SbToolEnd(SbTool *tool);
/* A call that may take long, with that line while it goes on. */
#define SB_TOOL_PHASE(tool, phase, call) \
  do {                                   \
    PetscErrorCode sb_ierr;              \
    SbToolBegin(tool, phase);            \
    sb_ierr = (call);                    \
    SbToolEnd(tool);                     \
    PetscCall(sb_ierr);                  \
  } while (0)
/* 1234567 as "1,234,567". */
const char *SbToolNumber(PetscInt64 n, char text[32]);
