/*
  Creation of material laws by name, their options, and functions shared by several laws: tangents, damping.

  Lame parameters at rest: mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).
*/
#include "material_impl.h"
#include "sblog.h"

PetscFunctionList SbMaterialList = NULL;

static PetscErrorCode destroy_list(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListDestroy(&SbMaterialList));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialRegister(const char *law, PetscErrorCode (*create)(SbMaterial), PetscInt nrows,
                                  const SbOption rows[])
{
  PetscFunctionBeginUser;
  if (!SbMaterialList) PetscCall(PetscRegisterFinalize(destroy_list));
  PetscCall(PetscFunctionListAdd(&SbMaterialList, law, create));
  if (nrows) PetscCall(SbOptionsRegister("body", law, nrows, rows));
  if (nrows) PetscCall(SbOptionsRegister("inclusion", law, nrows, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreateElastic(const char *law, PetscReal E, PetscReal nu, PetscReal density,
                                       const char *where, SbMaterial *material)
{
  PetscErrorCode (*create)(SbMaterial) = NULL;
  SbMaterial m;
  char all[256] = "";

  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListFind(SbMaterialList, law, &create));
  if (!create) PetscCall(SbListAdvise(SbMaterialList, law, sizeof(all), all));
  PetscCheck(create, PETSC_COMM_SELF, PETSC_ERR_USER, "%s: there is no material law \"%s\"; the laws are %s",
             where, law, all);
  PetscCheck(E > 0 && E < PETSC_INFINITY, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: Young's modulus is %g Pa; it must lie in (0, inf)", where, (double)E);
  PetscCheck(nu > -1 && nu < 0.5, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: Poisson's ratio is %g; it must lie in (-1, 0.5): take 0.499 for an incompressible material",
             where, (double)nu);
  PetscCheck(density > 0 && density < PETSC_INFINITY, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: density is %g kg/m^3; it must lie in (0, inf)", where, (double)density);
  PetscCall(PetscNew(&m));
  PetscCall(PetscStrncpy(m->law, law, sizeof(m->law)));
  PetscCall(SbLogNamed("Mat", law, &m->event));
  m->E = E;
  m->nu = nu;
  m->mu = E / (2 * (1 + nu));
  m->lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  m->density = density;
  PetscCall((*create)(m));
  *material = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreate(const char *law, const SbScope *body, SbMaterial *material)
{
  SbScope scope;
  PetscReal E, nu, density;
  char where[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(where, sizeof(where), "-%s_%s_material", body->klass, body->instance));
  SbScopeSet(&scope, body->klass, law, body->instance);
  PetscCall(SbOptionReal(&scope, "young", &E));
  PetscCall(SbOptionReal(&scope, "poisson", &nu));
  PetscCall(SbOptionReal(&scope, "density", &density));
  PetscCall(SbMaterialCreateElastic(law, E, nu, density, where, material));
  if ((*material)->ops.setfromoptions) PetscCall(((*material)->ops.setfromoptions)(*material, &scope));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialDestroy(SbMaterial *m)
{
  PetscFunctionBeginUser;
  if (!*m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMaterialDestroy(&(*m)->shear));
  PetscCall(PetscFree(*m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialGetShear(SbMaterial m, SbMaterial *shear)
{
  PetscFunctionBeginUser;
  if (!m->shear) {
    PetscCall(SbMaterialCreateElastic(m->law, 2 * m->mu, 0., m->density, "material", &m->shear));
    PetscCall(SbMaterialSetTangent(m->shear, m->tangent));
  }
  *shear = m->shear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialSetTangent(SbMaterial m, SbTangentKind kind)
{
  PetscFunctionBeginUser;
  if (m->ops.settangent) {
    PetscCall((m->ops.settangent)(m, kind));
  } else {
    PetscCheck(kind == m->tangent, PETSC_COMM_SELF, PETSC_ERR_USER,
               "material law %s has one tangent only: do not choose one", m->law);
  }
  if (m->shear) PetscCall(SbMaterialSetTangent(m->shear, kind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialSetTangent_Exact(SbMaterial m, SbTangentKind kind)
{
  PetscFunctionBeginUser;
  PetscCheck(kind != SB_TANGENT_WARPED, PETSC_COMM_SELF, PETSC_ERR_USER,
             "material law %s has no warped tangent: choose exact or exact_spd", m->law);
  m->tangent = kind;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialSetFromOptions_Tangent(SbMaterial m, const SbScope *scope)
{
  const int first = m->tangent == SB_TANGENT_WARPED ? SB_TANGENT_WARPED : SB_TANGENT_EXACT;
  int choice;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(scope, "tangent", &choice));
  m->adaptive = (PetscBool)(choice == 0);
  PetscCall(
    SbMaterialSetTangent(m, m->adaptive ? SB_TANGENT_EXACT_SPD : (SbTangentKind)(first + choice - 1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SB_KERNEL void SbMaterialDampingStress(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       const SbPack H[restrict 9], SbPack dP[restrict 9])
{
  const PetscReal lambda = m->lambda, mu = m->mu;
  SbPack R[9];

  SbMaterialRotation(m, F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9], h[9], b[9], t[9];

    SbPackGet(9, (const SbPack *)R, l, r);
    SbPackGet(9, H, l, h);
    SbMatTransposeMul(h, r, b);
    SbMatMul(r, b, t);
    const PetscReal p = lambda * (b[0] + b[4] + b[8]);
    for (int k = 0; k < 9; k++) dP[k][l] = mu * (h[k] + t[k]) + p * r[k];
  }
}
