/*
  register.c - registers all types that a scenario can name: a new one is a file in its folder, a line here.
*/
#include "sbremesh.h"
#include "scene_impl.h"
#include "sblog.h"

PetscErrorCode SbRegisterAll(void)
{
  static const SbEffectType *const effects[] = {&SbEffectGravity,
                                                &SbEffectBodyForce,
                                                &SbEffectTraction,
                                                &SbEffectPressure,
                                                &SbEffectPointForce,
                                                &SbEffectFixed,
                                                &SbEffectPrescribedDisplacement,
                                                &SbEffectDamping,
                                                &SbEffectContact};

  PetscFunctionBeginUser;
  PetscCall(SbLogInitialize());

  /* otherwise PETSc does not free partitioners that are registered before the first use */
  PetscCall(PetscPartitionerInitializePackage());

  /* in the order of the manual */
  PetscCall(SbSceneRegister());
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(effects); i++) PetscCall(SbEffectRegister(effects[i]));
  PetscCall(SbMeshRegister());
  PetscCall(SbSpaceRegister());
  PetscCall(SbTimeRegister());
  PetscCall(SbOutputRegister());
  PetscCall(SbLedgerRegister());
  PetscCall(SbRemeshRegister());
  PetscCall(SbCommandRegister());

  PetscCall(SbElementRegisterAll());
  PetscCall(SbMaterialRegisterAll());
  PetscFunctionReturn(PETSC_SUCCESS);
}
