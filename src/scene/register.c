/*
  register.c - everything that a scenario can name: one line per type. A new type is one file in its folder and one line
  here.
*/
#include "sbremesh.h"
#include "scene_impl.h"
#include "sblog.h"

PetscErrorCode SbRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbLogInitialize());

  /* or PETSc never frees the partitioners that are registered before the first one is used */
  PetscCall(PetscPartitionerInitializePackage());

  /* what a run has once, in the order of the manual */
  PetscCall(SbSceneRegister());
  PetscCall(SbMeshRegister());
  PetscCall(SbSpaceRegister());
  PetscCall(SbTimeRegister());
  PetscCall(SbOutputRegister());
  PetscCall(SbLedgerRegister());
  PetscCall(SbRemeshRegister());
  PetscCall(SbCommandRegister());

  PetscCall(SbElementRegisterAll());
  PetscCall(SbMaterialRegisterAll());
  PetscCall(SbSetsRegister());

  PetscCall(SbEffectRegister_Gravity());
  PetscCall(SbEffectRegister_BodyForce());
  PetscCall(SbEffectRegister_Traction());
  PetscCall(SbEffectRegister_Pressure());
  PetscCall(SbEffectRegister_PointForce());
  PetscCall(SbEffectRegister_Fixed());
  PetscCall(SbEffectRegister_PrescribedDisplacement());
  PetscCall(SbEffectRegister_Damping());
  PetscCall(SbEffectRegister_Contact());
  PetscFunctionReturn(PETSC_SUCCESS);
}
