/*
  log.c - PETSc log events: one per phase of at least about one percent of a run, three stages, and
  one event for each effect, material, element and output of a scene.

  The names are those printed by -log_view. Events belong to no class (PETSC_OBJECT_CLASSID),
  because they time phases, not objects.
*/
#include "sbbase.h"

PetscLogEvent SbEvents[SB_EVENT_COUNT];
PetscLogStage SbLogStageSetup, SbLogStageSolve, SbLogStageOutput;

PetscErrorCode SbLogInitialize(void)
{
  static const char *const names[SB_EVENT_COUNT] = {
    "SbMeshRead",   "SbMeshDistrib", "SbSpaceSetUp", "SbMatrixSetUp", "SbResidual",
    "SbTangent",    "SbEnergy",      "SbEffects",    "SbContact",     "SbSearch",
    "SbSearchHash", "SbSearchTree",  "SbProject",    "SbSolverSetUp", "SbContactSolve",
    "SbStability",  "SbOutput",      "SbCheckpoint",
  };
  static const char *const stages[3] = {"Setup", "Solve", "Output"};
  PetscLogStage *const numbers[3] = {&SbLogStageSetup, &SbLogStageSolve, &SbLogStageOutput};

  PetscFunctionBeginUser;
  for (int i = 0; i < SB_EVENT_COUNT; i++)
    PetscCall(PetscLogEventRegister(names[i], PETSC_OBJECT_CLASSID, &SbEvents[i]));
  for (int i = 0; i < 3; i++) {
    PetscCall(PetscLogStageGetId(stages[i], numbers[i]));
    if (*numbers[i] < 0)
      PetscCall(PetscLogStageRegister(stages[i], numbers[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLogNamed(const char *kind, const char *name, PetscLogEvent *event)
{
  char text[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), "Sb%s_%s", kind, name));
  PetscCall(PetscLogEventGetId(text, event));
  if (*event < 0)
    PetscCall(PetscLogEventRegister(text, PETSC_OBJECT_CLASSID, event));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the time of an event in all stages, s. */
static PetscErrorCode add_seconds(PetscLogEvent event, PetscReal *seconds)
{
  const PetscLogStage stages[] = {0, SbLogStageSetup, SbLogStageSolve, SbLogStageOutput};

  PetscFunctionBeginUser;
  for (size_t s = 0; s < PETSC_STATIC_ARRAY_LENGTH(stages); s++) {
    PetscEventPerfInfo info;

    if (s && stages[s] <= 0)
      continue;
    PetscCall(PetscLogEventGetPerfInfo(stages[s], event, &info));
    *seconds += (PetscReal)info.time;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLogSeconds(PetscReal seconds[SB_PHASE_COUNT])
{
  /* PCSetUp has SB_EVENT_SOLVER_SETUP, and is in PCSetUpOnBlocks */
  static const char *const solve[] = {"KSPSolve", "PCSetUp"};
  static const struct {
    SbPhase phase;
    SbEvent event;
  } ours[] = {{SB_PHASE_MESH, SB_EVENT_MESH_READ},      {SB_PHASE_MESH, SB_EVENT_MESH_DISTRIBUTE},
              {SB_PHASE_SETUP, SB_EVENT_SPACE_SETUP},   {SB_PHASE_SETUP, SB_EVENT_MATRIX_SETUP},
              {SB_PHASE_RESIDUAL, SB_EVENT_RESIDUAL},   {SB_PHASE_TANGENT, SB_EVENT_TANGENT},
              {SB_PHASE_SOLVE, SB_EVENT_CONTACT_SOLVE}, {SB_PHASE_CONTACT, SB_EVENT_CONTACT},
              {SB_PHASE_SEARCH, SB_EVENT_SEARCH},       {SB_PHASE_ENERGY, SB_EVENT_ENERGY},
              {SB_PHASE_OUTPUT, SB_EVENT_OUTPUT},       {SB_PHASE_OUTPUT, SB_EVENT_CHECKPOINT}};

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(seconds, SB_PHASE_COUNT));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ours); i++)
    PetscCall(add_seconds(SbEvents[ours[i].event], &seconds[ours[i].phase]));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(solve); i++) {
    PetscLogEvent event;

    PetscCall(PetscLogEventGetId(solve[i], &event));
    if (event >= 0)
      PetscCall(add_seconds(event, &seconds[SB_PHASE_SOLVE]));
  }
  seconds[SB_PHASE_CONTACT] = PetscMax(0, seconds[SB_PHASE_CONTACT] - seconds[SB_PHASE_SEARCH]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
