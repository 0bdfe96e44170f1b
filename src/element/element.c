/*
  Creation of elements by name, and their options.
*/
#include "element_impl.h"
#include "sblog.h"

PetscFunctionList SbElementList = NULL;

static const SbOption cr_rows[] = {
  {"gamma1", SB_OPTION_REAL, 1, "", "0.6", "(0, inf)",
   "penalty factor on the full jump across faces; smaller values are softer, much larger ones lock"},
};
static const SbOption dg_rows[] = {
  {"gamma0", SB_OPTION_REAL, 1, "", "4", "(0, inf)", "penalty factor on the mean of the jump over a face"},
  {"gamma1", SB_OPTION_REAL, 1, "", "0.6", "(0, inf)",
   "penalty factor on the full jump across faces; smaller values are softer, much larger ones lock"},
  {"dirichlet", SB_OPTION_CHOICE, 1, "", "weak", "weak|strong",
   "boundary faces that are fixed in all directions: weak, by a penalty, or strong, by their mean "
   "displacement"},
};

static PetscErrorCode destroy_list(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListDestroy(&SbElementList));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption p2_rows[] = {
  {"volume", SB_OPTION_CHOICE, 1, "", "mean", "mean|pointwise",
   "volumetric energy: of the mean dilatation of a tet (P2/P0), or fully integrated, which locks when "
   "poisson is near 0.5"},
};

PetscErrorCode SbElementRegister(const char *name, PetscErrorCode (*create)(SbElement), PetscInt nrows,
                                 const SbOption rows[])
{
  PetscFunctionBeginUser;
  if (!SbElementList) PetscCall(PetscRegisterFinalize(destroy_list));
  PetscCall(PetscFunctionListAdd(&SbElementList, name, create));
  if (nrows) PetscCall(SbOptionsRegister("body", name, nrows, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbElementRegister("p1", SbElementCreate_P1, 0, NULL));
  PetscCall(SbElementRegister("p2", SbElementCreate_P2, PETSC_STATIC_ARRAY_LENGTH(p2_rows), p2_rows));
  PetscCall(SbElementRegister("cr", SbElementCreate_CR, PETSC_STATIC_ARRAY_LENGTH(cr_rows), cr_rows));
  PetscCall(SbElementRegister("dg", SbElementCreate_DG, PETSC_STATIC_ARRAY_LENGTH(dg_rows), dg_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_options(const SbScope *body, SbElement e)
{
  SbScope scope;

  PetscFunctionBeginUser;
  PetscCall(SbScopeSet(&scope, "body", e->name, body->instance));
  if (e->gamma0 > 0.) PetscCall(SbOptionReal(&scope, "gamma0", &e->gamma0));
  if (e->gamma1 > 0.) PetscCall(SbOptionReal(&scope, "gamma1", &e->gamma1));
  if (e->mean_volume) {
    PetscInt pointwise;

    PetscCall(SbOptionChoice(&scope, "volume", &pointwise));
    e->mean_volume = (PetscBool)!pointwise;
  }
  if (e->weak) {
    PetscInt strong;

    PetscCall(SbOptionChoice(&scope, "dirichlet", &strong));
    e->weak = (PetscBool)!strong;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementCreate(const char *name, const SbScope *body, SbElement *element)
{
  PetscErrorCode (*create)(SbElement) = NULL;
  SbElement e;

  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListFind(SbElementList, name, &create));
  if (!create) {
    char all[256];

    PetscCall(SbListAdvise(SbElementList, name, sizeof(all), all));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "there is no element \"%s\": choose one of %s", name, all);
  }
  PetscCall(PetscNew(&e));
  PetscCall(PetscStrncpy(e->name, name, sizeof(e->name)));
  PetscCall(SbLogNamed("Elem", name, &e->event));
  PetscCall((*create)(e));
  *element = e;
  if (body) PetscCall(read_options(body, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementDestroy(SbElement *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(*e));
  PetscFunctionReturn(PETSC_SUCCESS);
}
