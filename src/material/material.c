/*
  The registry of material laws, and their creation by name; choice of the tangent, damping.

  Lame parameters at rest: mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).
*/
#include "fibrous.h"
#include "sbbase.h"

#define LISTED(law) &law,
static const SbMaterialType *const laws[] = {SB_MATERIAL_LAWS(LISTED)};
static const SbMaterialType *types[SB_MATERIAL_TYPES];
static PetscInt ntype;
char SbMaterialNames[SB_MATERIAL_TYPES * SB_NAME_MAX];

static const SbOption body_rows[] = {
  {"young", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)",
   "Young's modulus; not of laws with moduli of their own, as mooney_rivlin"},
  {"poisson", SB_OPTION_REAL, 1, "", NULL, "(-1, 0.5)",
   "Poisson's ratio; soft tissue is near 0.5, where p1 elements lock; laws with moduli of their "
   "own "
   "take bulk instead, if it is given"},
  {"density", SB_OPTION_REAL, 1, "kg/m^3", "1000", "(0, inf)",
   "mass per volume in the reference configuration"},
  {"prony_times", SB_OPTION_STRING, 1, "s", "", "",
   "viscoelastic: relaxation times of the terms of a Prony series, up to 16 numbers with commas; "
   "the moduli of the law are the instantaneous ones"},
  {"prony_shear", SB_OPTION_STRING, 1, "", "", "",
   "fractions of the shear modulus that relax, one for each time, in [0, 1), their sum below 1; "
   "fibres relax with the shear modulus"},
  {"prony_bulk", SB_OPTION_STRING, 1, "", "", "",
   "fractions of the bulk modulus that relax, one for each time; empty: it does not relax"},
  {"viscosity", SB_OPTION_REAL, 1, "Pa s", "0", "[0, inf)",
   "Kelvin-Voigt: viscosity beside the elastic law, of changes of shape"},
  {"viscosity_bulk", SB_OPTION_REAL, 1, "Pa s", "0", "[0, inf)",
   "Kelvin-Voigt: viscosity of changes of volume"},
  {"active_tension", SB_OPTION_FORMULA, 1, "Pa", "0", "",
   "fibres that contract: second Piola-Kirchhoff stress along them beside that of the law, at "
   "least "
   "0; a formula of the time and the rest position, or table:FILE; 0: they do not"},
  {"active_strain", SB_OPTION_FORMULA, 1, "", "0", "",
   "fibres that contract, another way: strain at which they are without stress, above -1, negative "
   "where they shorten, at constant volume; a formula as that of active_tension"},
  {"active_length", SB_OPTION_CHOICE, 1, "", "none", "none|parabola|gaussian",
   "factor on the tension at a stretch l of the fibres, with z = (l - active_optimum) / "
   "active_width: parabola, max(0, 1 - z^2); gaussian, exp(-z^2)"},
  {"active_optimum", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "stretch of the fibres at which this factor is 1"},
  {"active_width", SB_OPTION_REAL, 1, "", "0.5", "(0, inf)",
   "difference to that stretch at which it is 0 (parabola) or 1/e (gaussian)"},
  {"active_velocity", SB_OPTION_REAL, 1, "1/s", "0", "[0, inf)",
   "Hill: rate of the stretch of fibres that shorten without force; dynamic runs only; 0: the "
   "force "
   "does not depend on the rate"},
  {"active_curvature", SB_OPTION_REAL, 1, "", "0.25", "(0, inf)",
   "Hill: k of the factor (1 + v) / (1 - v/k) on the tension, v the rate over active_velocity"},
  {"active_eccentric", SB_OPTION_REAL, 1, "", "1.5", "[1, inf)",
   "this factor of fibres that lengthen fast"},
  {"mullins_r", SB_OPTION_REAL, 1, "", "0", "[0, inf)",
   "rubber that softens by its first stretch (Mullins): r of Ogden and Roxburgh, above 1; at most "
   "1/r of the stress that changes the shape is lost; 0: it does not soften"},
  {"mullins_m", SB_OPTION_REAL, 1, "J/m^3", "0", "[0, inf)",
   "softening spreads over energies of the shape of m + beta times the largest one so far"},
  {"mullins_beta", SB_OPTION_REAL, 1, "", "0", "[0, inf)",
   "beta of mullins_m; 0: the original of Ogden and Roxburgh"},
  {"growth", SB_OPTION_FORMULA, 1, "", "0", "",
   "growth: strain without stress, in all directions, above -1; a formula of the time and the rest "
   "position, or table:FILE; 0: none"},
  {"growth_fibre", SB_OPTION_FORMULA, 1, "", "0", "", "growth along the fibres, likewise"},
  {"growth_plane", SB_OPTION_FORMULA, 1, "", "0", "",
   "growth in the plane across the fibres, in its two directions, likewise"},
  {"prestrain", SB_OPTION_FORMULA, 1, "", "0", "",
   "strain of the fibres at rest, above -1, positive where they are stretched, at constant volume; "
   "a formula as that of growth"},
  {"thermal_expansion", SB_OPTION_REAL, 1, "1/K", "0", "",
   "coefficient of thermal expansion, of lengths; needs temperature"},
  {"temperature", SB_OPTION_FORMULA, 1, "K", "0", "",
   "temperature above that without stress; a formula as that of growth; needs thermal_expansion"},
  {"temperature_field", SB_OPTION_STRING, 1, "", "", "",
   "array of the mesh file with a number for each tet, by which temperature is multiplied: "
   "ElementData of gmsh, CellData of VTK files, /mesh/NAME of an .h5 mesh; empty: none"},
  SB_FIBRE_ROWS,
};

PetscErrorCode SbMaterialRegister(const SbMaterialType *type)
{
  PetscInt i = 0;

  PetscFunctionBeginUser;

  // Repeated registration is allowed: SbOptionsReset() may have removed the options.
  while (i < ntype && types[i] != type)
    i++;
  PetscCheck(i < SB_MATERIAL_TYPES, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No room for material law %s",
             type->name);
  if (i == ntype) {
    SbAppend(sizeof(SbMaterialNames), SbMaterialNames, "%s%s", ntype ? "|" : "", type->name);
    types[ntype++] = type;
  }
  if (type->nrow) {
    PetscCall(SbOptionsRegister("body", type->name, type->nrow, type->row));
    PetscCall(SbOptionsRegister("inclusion", type->name, type->nrow, type->row));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionsRegister("body", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscCall(SbOptionsRegister("inclusion", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(laws); i++)
    PetscCall(SbMaterialRegister(laws[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbMaterialTypes(const char *names[SB_MATERIAL_TYPES])
{
  for (PetscInt i = 0; i < ntype; i++)
    names[i] = types[i]->name;
  return ntype;
}

const SbMaterialType *SbMaterialFind(const char *law)
{
  for (PetscInt i = 0; i < ntype; i++)
    if (!strcmp(types[i]->name, law))
      return types[i];
  return NULL;
}

/* A material of a type, with the constants of the law still to be read. */
static PetscErrorCode create(const SbMaterialType *type, PetscReal E, PetscReal nu,
                             PetscReal density, SbMaterial *material)
{
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&m));
  m->type = type;
  m->ops = type->ops;
  m->linear = type->linear;
  m->softens = type->softens;
  m->jacobian = type->jacobian;
  m->positive = type->positive;
  PetscCall(SbLogNamed("Mat", type->name, &m->event));
  m->density = density;
  PetscCall(PetscNew(&m->rest));
  m->rest->E = E;
  m->rest->nu = nu;
  m->rest->mu = E / (2 * (1 + nu));
  m->rest->lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  if (type->size)
    PetscCall(PetscCalloc(type->size, &m->data));
  PetscCall(SbMaterialSetTangent(m, m->ops.spin ? SB_TANGENT_WARPED : SB_TANGENT_EXACT));
  *material = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreateElastic(const char *law, PetscReal E, PetscReal nu,
                                       PetscReal density, SbMaterial *material)
{
  const SbMaterialType *type = SbMaterialFind(law);
  SbScope nobody;

  PetscFunctionBeginUser;
  PetscCheck(type, PETSC_COMM_SELF, PETSC_ERR_USER, "There is no material law \"%s\"", law);
  PetscCheck(!type->own_moduli, PETSC_COMM_SELF, PETSC_ERR_USER,
             "Material law %s has moduli of its own, which do not follow from E and nu", law);
  PetscCall(create(type, E, nu, density, material));
  SbScopeSet(&nobody, "body", law, "");
  if (type->ops.setfromoptions)
    PetscCall((*type->ops.setfromoptions)(*material, &nobody));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m with other Lame parameters, in *other, which m owns. */
static PetscErrorCode with_lame(SbMaterial m, PetscReal lambda, PetscReal mu, SbMaterial *other)
{
  PetscFunctionBeginUser;
  if (*other)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(create(m->type, 2 * mu, 0., m->density, other));
  if (lambda != 0.)
    SbMaterialSetLame(*other, lambda, mu);
  PetscCall(SbMaterialSetTangent(*other, m->tangent));
  if (m->type->size)
    PetscCall(PetscMemcpy((*other)->data, m->data, m->type->size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreate(const char *law, const SbScope *body, SbMaterial *material)
{
  const SbMaterialType *type = SbMaterialFind(law);
  SbScope scope;
  PetscReal density;
  PetscReal E = 1;
  PetscReal nu = 0;
  int choice;
  SbMaterial m;

  PetscFunctionBeginUser;
  SbScopeSet(&scope, body->klass, law, body->instance);
  if (!type || !type->own_moduli) {
    PetscCall(SbOptionReal(&scope, "young", &E));
    PetscCall(SbOptionReal(&scope, "poisson", &nu));
  }
  PetscCall(SbOptionReal(&scope, "density", &density));
  PetscCheck(type, PETSC_COMM_SELF, PETSC_ERR_USER, "There is no material law \"%s\"", law);
  PetscCall(create(type, E, nu, density, material));
  m = *material;
  PetscCall(PetscStrncpy(m->name, body->instance, sizeof(m->name)));
  if (type->ops.setfromoptions)
    PetscCall((*type->ops.setfromoptions)(m, &scope));
  if (SbOptionFind(&scope, "tangent")) {
    /* auto, then the tangents of the law: all or, without a warped one, the two exact ones */
    PetscCall(SbOptionChoice(&scope, "tangent", &choice));
    m->adaptive = (PetscBool)(choice == 0);
    choice += m->ops.spin ? SB_TANGENT_WARPED - 1 : SB_TANGENT_EXACT - 1;
    PetscCall(SbMaterialSetTangent(m, m->adaptive ? SB_TANGENT_EXACT_SPD : (SbTangentKind)choice));
  }
  PetscCall(SbActiveRead(m, &scope));
  PetscCall(SbEigenstrainRead(m, &scope));
  PetscCall(SbViscousRead(m, &scope));
  if (m->viscous) {
    SbMaterial *const laws_of[2] = {&m->viscous->step, &m->viscous->relaxed};

    for (int k = 0; k < 2; k++) {
      PetscCall(with_lame(m, m->rest->lambda, m->rest->mu, laws_of[k]));
      (*laws_of[k])->positive = m->positive;
    }
    PetscCall(SbViscousRelax(m, &scope));
  }
  PetscCall(SbMullinsRead(m, &scope));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialCreateRigid(const SbScope *body, SbMaterial *material)
{
  const SbMaterialType *type = SbMaterialFind("stvk");
  PetscReal density;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(body, "density", &density));
  PetscCall(create(type, 1., 0., density, material));
  PetscCall(PetscStrncpy((*material)->name, body->instance, sizeof((*material)->name)));
  (*material)->adaptive = PETSC_TRUE;
  (*material)->softens = PETSC_FALSE; /* at strains that it does not have */
  PetscCall(SbMaterialSetTangent(*material, SB_TANGENT_EXACT_SPD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialDestroy(SbMaterial *m)
{
  PetscFunctionBeginUser;
  if (!*m)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMaterialDestroy(&(*m)->shear));
  PetscCall(SbMaterialDestroy(&(*m)->point));
  PetscCall(SbMaterialDestroy(&(*m)->stiffest));
  PetscCall(SbFibresDestroy(&(*m)->fibres));
  PetscCall(SbActiveDestroy(&(*m)->active));
  PetscCall(PetscFree((*m)->mullins));
  PetscCall(SbEigenstrainDestroy(&(*m)->eigen));
  if ((*m)->viscous) {
    PetscCall(SbMaterialDestroy(&(*m)->viscous->step));
    PetscCall(SbMaterialDestroy(&(*m)->viscous->relaxed));
    PetscCall(PetscFree((*m)->viscous));
  }
  PetscCall(PetscFree((*m)->rest));
  PetscCall(PetscFree((*m)->data));
  PetscCall(PetscFree(*m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialGetShear(SbMaterial m, SbMaterial *shear)
{
  PetscFunctionBeginUser;
  PetscCall(with_lame(m, 0., m->rest->mu, &m->shear));
  *shear = m->shear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialGetPointwise(SbMaterial m, SbMaterial *point)
{
  const PetscReal mean = SbMaterialMeanModulus(m);

  PetscFunctionBeginUser;
  if (mean != 0.)
    PetscCall(with_lame(m, m->rest->lambda - mean, m->rest->mu, &m->point));
  *point = mean != 0. ? m->point : m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialGetStiffest(SbMaterial m, SbMaterial *stiffest)
{
  const PetscReal more = m->rest->fibre / 2;

  PetscFunctionBeginUser;
  if (more > 0)
    PetscCall(with_lame(m, m->rest->lambda, m->rest->mu + more, &m->stiffest));
  *stiffest = more > 0 ? m->stiffest : m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbMaterialPressure(const struct _p_SbMaterial *m, const SbPack F[9], SbPack p)
{
  m->ops.dilatation(m, F, p);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] *= -m->rest->lambda;
}

PetscErrorCode SbMaterialSetTangent(SbMaterial m, SbTangentKind kind)
{
  PetscFunctionBeginUser;
  PetscCheck(!m->linear || kind == SB_TANGENT_EXACT, PETSC_COMM_SELF, PETSC_ERR_USER,
             "material law %s has one tangent only: do not choose one", m->type->name);
  PetscCheck(kind != SB_TANGENT_WARPED || m->ops.spin, PETSC_COMM_SELF, PETSC_ERR_USER,
             "material law %s has no warped tangent: choose exact or exact_spd", m->type->name);
  m->tangent = kind;
  if (m->ops.spin)
    m->ops.frame = kind == SB_TANGENT_WARPED ? m->ops.dilatation_gradient : NULL;
  if (m->shear)
    PetscCall(SbMaterialSetTangent(m->shear, kind));
  if (m->point)
    PetscCall(SbMaterialSetTangent(m->point, kind));
  if (m->viscous)
    PetscCall(SbMaterialSetTangent(m->viscous->step, kind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SB_KERNEL void SbMaterialDampingStress(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       const SbPack H[restrict 9], SbPack dP[restrict 9])
{
  const PetscReal lambda = m->rest->lambda;
  const PetscReal mu = m->rest->mu;
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
