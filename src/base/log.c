/*
  log.c - one PETSc log event per phase that can take one percent of a run, the three stages of a run, and one event for each
  effect, law, element and output that a scene names.

  The names are what -log_view prints. Events are class-less (PETSC_OBJECT_CLASSID), because they time phases, not
  objects.
*/
#include "sbbase.h"
#include "sblog.h"

PetscLogEvent SbEvents[SB_EVENT_COUNT];
PetscLogStage SbLogStageSetup, SbLogStageSolve, SbLogStageOutput;

static PetscErrorCode stage(const char *name, PetscLogStage *s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscLogStageGetId(name, s));
  if (*s < 0) PetscCall(PetscLogStageRegister(name, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLogInitialize(void)
{
  static const char *const names[SB_EVENT_COUNT] = {
    "SbMeshRead", "SbMeshDistrib", "SbSpaceSetUp",   "SbMatrixSetUp", "SbResidual",
    "SbTangent",  "SbEnergy",      "SbEffects",      "SbContact",     "SbSearch",
    "SbProject",  "SbSolverSetUp", "SbContactSolve", "SbOutput",      "SbCheckpoint",
  };

  PetscFunctionBeginUser;
  for (int i = 0; i < SB_EVENT_COUNT; i++)
    PetscCall(PetscLogEventRegister(names[i], PETSC_OBJECT_CLASSID, &SbEvents[i]));
  PetscCall(stage("Setup", &SbLogStageSetup));
  PetscCall(stage("Solve", &SbLogStageSolve));
  PetscCall(stage("Output", &SbLogStageOutput));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLogNamed(const char *kind, const char *name, PetscLogEvent *event)
{
  char text[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), "Sb%s_%s", kind, name));
  PetscCall(PetscLogEventGetId(text, event));
  if (*event < 0) PetscCall(PetscLogEventRegister(text, PETSC_OBJECT_CLASSID, event));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLogSeconds(PetscLogEvent event, PetscReal *seconds)
{
  const PetscLogStage stages[] = {0, SbLogStageSetup, SbLogStageSolve, SbLogStageOutput};

  PetscFunctionBeginUser;
  for (size_t s = 0; s < PETSC_STATIC_ARRAY_LENGTH(stages); s++) {
    PetscEventPerfInfo info;

    if (s && stages[s] <= 0) continue;
    PetscCall(PetscLogEventGetPerfInfo(stages[s], event, &info));
    *seconds += (PetscReal)info.time;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLogSecondsNamed(const char *name, PetscReal *seconds)
{
  PetscLogEvent event;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventGetId(name, &event));
  if (event >= 0) PetscCall(SbLogSeconds(event, seconds));
  PetscFunctionReturn(PETSC_SUCCESS);
}
