/*
  sboutput.h - layer 5: one folder per run. fields.h5 + fields.xmf, history.csv, scenario.opts, run.json, checkpoints, progress.

  Everything here attaches to a run as a monitor; what the scenario does not ask for is not attached.
*/
#pragma once
#include "sbtime.h"

/* A named field. compute() fills this rank's owned entities (vertices or cells, in the mesh's local order). */
typedef struct {
  const char *name;              /* "von_mises" */
  const char *unit;
  PetscInt    ncomp;             /* 1 scalar, 3 vector, 6 symmetric tensor (XDMF Tensor6 order) */
  PetscBool   cell;              /* per cell, else per vertex */
  PetscBool   constant;          /* written once, with the mesh */
  const char *help;
  PetscErrorCode (*compute)(SbRun run, const SbStep *step, PetscReal *values);
} SbField;

PetscErrorCode SbOutputRegister(void); /* option rows */
/* Creates the output folder (error when it cannot be written), writes scenario.opts, attaches the monitors asked for. Collective. */
PetscErrorCode SbOutputAttach(SbRun run);
/* Reads -restart FILE if given: fills run->U, V, A, step0, t0 and the running totals, on any number of ranks. Collective. */
PetscErrorCode SbCheckpointLoad(SbRun run, const char *file);
/* Header before the run, table after it (rank 0 prints); run.json. */
PetscErrorCode SbReportHeader(SbRun run);
PetscErrorCode SbReportSummary(SbRun run);
