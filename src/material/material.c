/*
  The material laws: their names and options, creation, choice of the tangent, damping.

  Lame parameters at rest: mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).
*/
#include "material_impl.h"
#include "sblog.h"

PetscFunctionList SbMaterialList = NULL;

static const SbOption body_rows[] = {
  {"young", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "Young's modulus"},
  {"poisson", SB_OPTION_REAL, 1, "", NULL, "(-1, 0.5)",
   "Poisson's ratio; soft tissue is near 0.5, where p1 elements lock"},
  {"density", SB_OPTION_REAL, 1, "kg/m^3", "1000", "(0, inf)",
   "mass per volume in the reference configuration"},
};
/* of laws with and without a warped tangent */
static const SbOption tangents[] = {
  {"tangent", SB_OPTION_CHOICE, 1, "", "auto", "auto|warped|exact|exact_spd",
   "tangent stiffness: warped, Hooke's tensor rotated with the cell (stiffness warping, positive "
   "definite); "
   "exact; exact_spd, exact with each cell projected to positive semi-definite"},
  {"tangent", SB_OPTION_CHOICE, 1, "", "auto", "auto|exact|exact_spd",
   "tangent stiffness: exact; exact_spd, exact with each cell projected to positive semi-definite, "
   "for CG"},
};

static PetscErrorCode destroy_list(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListDestroy(&SbMaterialList));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialRegister(const char *law, void (*create)(SbMaterial),
                                  const SbOption *tangent)
{
  PetscFunctionBeginUser;
  if (!SbMaterialList)
    PetscCall(PetscRegisterFinalize(destroy_list));
  PetscCall(PetscFunctionListAdd(&SbMaterialList, law, create));
  if (tangent)
    PetscCall(SbOptionsRegister("body", law, 1, tangent));
  if (tangent)
    PetscCall(SbOptionsRegister("inclusion", law, 1, tangent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionsRegister("body", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscCall(SbOptionsRegister("inclusion", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscCall(SbMaterialRegister("linear", SbMaterialCreate_Linear, NULL));
  PetscCall(SbMaterialRegister("corotated", SbMaterialCreate_Corotated, &tangents[0]));
  PetscCall(SbMaterialRegister("stvk", SbMaterialCreate_StVK, &tangents[1]));
  PetscCall(SbMaterialRegister("neohookean", SbMaterialCreate_NeoHookean, &tangents[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreateElastic(const char *law, PetscReal E, PetscReal nu,
                                       PetscReal density, SbMaterial *material)
{
  void (*create)(SbMaterial) = NULL;
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListFind(SbMaterialList, law, &create));
  PetscCheck(create, PETSC_COMM_SELF, PETSC_ERR_USER, "There is no material law \"%s\"", law);
  PetscCall(PetscNew(&m));
  PetscCall(PetscStrncpy(m->law, law, sizeof(m->law)));
  PetscCall(SbLogNamed("Mat", law, &m->event));
  m->E = E;
  m->nu = nu;
  m->mu = E / (2 * (1 + nu));
  m->lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  m->density = density;
  create(m);
  PetscCall(SbMaterialSetTangent(m, m->ops.spin ? SB_TANGENT_WARPED : SB_TANGENT_EXACT));
  *material = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreate(const char *law, const SbScope *body, SbMaterial *material)
{
  SbScope scope;
  PetscReal E, nu, density;
  int choice;
  SbMaterial m;

  PetscFunctionBeginUser;
  SbScopeSet(&scope, body->klass, law, body->instance);
  PetscCall(SbOptionReal(&scope, "young", &E));
  PetscCall(SbOptionReal(&scope, "poisson", &nu));
  PetscCall(SbOptionReal(&scope, "density", &density));
  PetscCall(SbMaterialCreateElastic(law, E, nu, density, material));
  m = *material;
  PetscCall(PetscStrncpy(m->name, body->instance, sizeof(m->name)));
  if (SbOptionFind(&scope, "tangent")) {
    /* auto, then the tangents of the law: all or, without a warped one, the two exact ones */
    PetscCall(SbOptionChoice(&scope, "tangent", &choice));
    m->adaptive = (PetscBool)(choice == 0);
    choice += m->ops.spin ? SB_TANGENT_WARPED - 1 : SB_TANGENT_EXACT - 1;
    PetscCall(SbMaterialSetTangent(m, m->adaptive ? SB_TANGENT_EXACT_SPD : (SbTangentKind)choice));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialDestroy(SbMaterial *m)
{
  PetscFunctionBeginUser;
  if (!*m)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMaterialDestroy(&(*m)->shear));
  PetscCall(PetscFree(*m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialGetShear(SbMaterial m, SbMaterial *shear)
{
  PetscFunctionBeginUser;
  if (!m->shear) {
    PetscCall(SbMaterialCreateElastic(m->law, 2 * m->mu, 0., m->density, &m->shear));
    PetscCall(SbMaterialSetTangent(m->shear, m->tangent));
  }
  *shear = m->shear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialSetTangent(SbMaterial m, SbTangentKind kind)
{
  PetscFunctionBeginUser;
  PetscCheck(!m->linear || kind == SB_TANGENT_EXACT, PETSC_COMM_SELF, PETSC_ERR_USER,
             "material law %s has one tangent only: do not choose one", m->law);
  PetscCheck(kind != SB_TANGENT_WARPED || m->ops.spin, PETSC_COMM_SELF, PETSC_ERR_USER,
             "material law %s has no warped tangent: choose exact or exact_spd", m->law);
  m->tangent = kind;
  if (m->ops.spin)
    m->ops.frame = kind == SB_TANGENT_WARPED ? m->ops.volumetric : NULL;
  if (m->shear)
    PetscCall(SbMaterialSetTangent(m->shear, kind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SB_KERNEL void SbMaterialDampingStress(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       const SbPack H[restrict 9], SbPack dP[restrict 9])
{
  const PetscReal lambda = m->lambda;
  const PetscReal mu = m->mu;
  SbPack R[9];

  SbMaterialRotation(m, F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9], h[9], b[9], t[9];

    SbPackGet(9, R, l, r);
    SbPackGet(9, H, l, h);
    SbMatTransposeMul(h, r, b);
    SbMatMul(r, b, t);
    const PetscReal p = lambda * (b[0] + b[4] + b[8]);
    for (int k = 0; k < 9; k++)
      dP[k][l] = mu * (h[k] + t[k]) + p * r[k];
  }
}
