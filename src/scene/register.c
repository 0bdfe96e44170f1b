/*
  register.c - registers all types that a scenario can name: a new one is a file in its folder, a
  line here.
*/
#include "sbremesh.h"
#include "sbsurface.h"
#include "scene_impl.h"

PetscErrorCode SbRegisterAll(void)
{
  static const SbEffectType *const effects[] = {
    &SbEffectGravity,    &SbEffectBodyForce, &SbEffectTraction,
    &SbEffectPressure,   &SbEffectCavity,    &SbEffectFoundation,
    &SbEffectMembrane,   &SbEffectMass,      &SbEffectFrame,
    &SbEffectWater,      &SbEffectTie,       &SbEffectPeriodic,
    &SbEffectJoint,      &SbEffectSpring,    &SbEffectCable,
    &SbEffectPointForce, &SbEffectFixed,     &SbEffectPrescribedDisplacement,
    &SbEffectTorque,     &SbEffectDamping,   &SbEffectContact};
  static const struct {
    const char *klass;
    const SbOption *rows;
  } tables[] = {
    {"", SbRunRows},          {"body", SbBodyRows},       {"inclusion", SbInclusionRows},
    {"effect", SbEffectRows}, {"", SbMeshRows},           {"body", SbTetRows},
    {"", SbSpaceRows},        {"", SbTimeRows},           {"", SbSolverRows},
    {"", SbOutputRows},       {"probe", SbProbeRows},     {"", SbLedgerRows},
    {"", SbRemeshRows},       {"body", SbRemeshBodyRows}, {"", SbCommandRows},
    {"set", SbSetRows}};

  PetscFunctionBeginUser;
  PetscCall(SbLogInitialize());

  /* in the order of the manual */
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(tables); i++)
    PetscCall(SbOptionsRegister(tables[i].klass, "", PETSC_DECIDE, tables[i].rows));
  PetscCall(SbElementRegisterAll());
  PetscCall(SbMaterialRegisterAll());
  PetscCall(SbTimeRegister());
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(effects); i++)
    PetscCall(SbEffectRegister(effects[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
