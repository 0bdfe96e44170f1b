/*
  sblog.h - layer 0: log events and stages, for the files that log: the list grows with every new
  phase.
*/
#pragma once
#include "sbbase.h"

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
