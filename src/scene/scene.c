/*
  scene.c - from options to a model: bodies with material and element, effects, sets. Nothing is computed here.
*/
#include "scene_impl.h"

/* Those of material/register.c, for the manual. */
#define LAWS "linear|corotated|stvk|neohookean"

static const SbOption run_rows[] = {
  {"bodies", SB_OPTION_NAMES, 1, "", NULL, "", "names of the bodies, with commas between them"},
  {"sets", SB_OPTION_NAMES, 1, "", "", "",
   "names of sets given by a shape; physical groups of the meshes, bodies, `all` and `boundary` need no set"},
  {"effects", SB_OPTION_NAMES, 1, "", "", "",
   "names of the effects: what acts on the bodies beyond elasticity and inertia"},
  {"validate", SB_OPTION_BOOL, 1, "", "false", "",
   "checks the invariants of mesh and space after they are set up"},
};
static const SbOption body_rows[] = {
  {"mesh", SB_OPTION_STRING, 1, "", NULL, "",
   "mesh of tetrahedra: a file (.msh .mesh .vtk .vtu .unv .inp .bdf .ele .vol .h5 and others: "
   "docs/reference/meshes.md), a closed surface to fill (.stl .obj .off .ply .poly .smesh), or "
   "box:lx,ly,lz:n, or box:lx,ly,lz:nx,ny,nz (m, cells)"},
  {"mesh_step", SB_OPTION_INT, 1, "", "0", "[-1, inf)",
   "when the mesh is a run's output (fields.h5): the step whose positions are taken; 0: at rest, -1: the "
   "last"},
  {"scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "factor on the coordinates of the mesh, before rotation; 0.001 for a file in mm"},
  {"rotate", SB_OPTION_REALS, 4, "", "0,0,1,0", "(-inf, inf)",
   "axis x,y,z and angle in degrees, before translation"},
  {"translate", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)", "shift of the scaled and rotated mesh"},
  {"element", SB_OPTION_STRING, 1, "", "p1", "p1|p2|cr|dg",
   "finite element; p2, cr and dg do not lock when poisson is near 0.5, p2 is the most accurate where the "
   "solution is smooth"},
  {"material", SB_OPTION_STRING, 1, "", "", LAWS, "material law, required"},
  {"inclusions", SB_OPTION_NAMES, 1, "", "", "",
   "sets or volume groups whose tetrahedra have a material of their own, -inclusion_<name>_..."},
  {"velocity", SB_OPTION_REALS, 3, "m/s", "0,0,0", "(-inf, inf)",
   "velocity of the centre of mass at the start"},
  {"angular_velocity", SB_OPTION_REALS, 3, "rad/s", "0,0,0", "(-inf, inf)",
   "angular velocity about the centre of mass at the start"},
};
static const SbOption inclusion_rows[] = {
  {"material", SB_OPTION_STRING, 1, "", "", LAWS, "material law, required"},
};

PetscErrorCode SbSceneRegister(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionsRegister("inclusion", "", PETSC_STATIC_ARRAY_LENGTH(inclusion_rows), inclusion_rows));
  PetscCall(SbOptionsRegister("", "", PETSC_STATIC_ARRAY_LENGTH(run_rows), run_rows));
  PetscCall(SbOptionsRegister("body", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bodies */

/* Reads a word that must be a name in a list of types. */
static PetscErrorCode read_type(const SbScope *scope, const char *key, PetscFunctionList list,
                                char word[SB_NAME_MAX])
{
  char option[3 * SB_NAME_MAX], all[512];
  void (*constructor)(void) = NULL;

  PetscFunctionBeginUser;
  PetscCall(SbOptionName(scope, key, sizeof(option), option));
  PetscCall(SbOptionString(scope, key, SB_NAME_MAX, word));
  PetscCall(PetscFunctionListFind(list, word, &constructor));
  if (constructor) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbListAdvise(list, word, sizeof(all), all));
  PetscCheck(word[0], PETSC_COMM_SELF, PETSC_ERR_USER, "%s must be given: one of %s", option, all);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s %s is not one of %s", option, word, all);
}

static PetscErrorCode read_body(SbModel model, PetscInt i)
{
  SbBody *body = &model->body[i];
  SbScope scope;
  PetscReal axis;

  PetscFunctionBeginUser;
  PetscCall(SbScopeSet(&scope, "body", "", body->name));
  PetscCall(SbOptionString(&scope, "mesh", sizeof(body->mesh), body->mesh));
  PetscCheck(body->mesh[0], PETSC_COMM_SELF, PETSC_ERR_USER, "-body_%s_mesh names no file", body->name);
  PetscCall(SbTetOptionsRead(&scope, body->mesh, &body->tet));
  PetscCall(SbOptionInt(&scope, "mesh_step", &body->mesh_step));
  PetscCall(SbOptionReal(&scope, "scale", &body->scale));
  PetscCall(SbOptionReals(&scope, "rotate", body->rotate));
  axis = PetscAbsReal(body->rotate[0]) + PetscAbsReal(body->rotate[1]) + PetscAbsReal(body->rotate[2]);
  PetscCheck(
    axis > 0 || body->rotate[3] == 0, PETSC_COMM_SELF, PETSC_ERR_USER,
    "-body_%s_rotate: the axis 0,0,0 has no direction; give x,y,z of the axis, then the angle in degrees",
    body->name);
  PetscCall(SbOptionReals(&scope, "translate", body->translate));
  PetscCall(read_type(&scope, "element", SbElementList, body->element));
  PetscCall(read_type(&scope, "material", SbMaterialList, body->material));
  PetscCall(SbElementCreate(body->element, &scope, &model->element[i]));
  PetscCall(SbMaterialCreate(body->material, &scope, &model->material[i]));
  body->density = model->material[i]->density;
  PetscCall(SbOptionReals(&scope, "velocity", body->velocity));
  PetscCall(SbOptionReals(&scope, "angular_velocity", body->angular_velocity));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The materials of the inclusions of body i, behind those that are there. */
static PetscErrorCode read_inclusions(SbModel model, PetscInt i)
{
  SbBody *body = &model->body[i];
  char(*names)[SB_NAME_MAX], law[SB_NAME_MAX];
  SbScope scope;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbScopeSet(&scope, "body", "", body->name));
  PetscCall(SbOptionNames(&scope, "inclusions", &n, &names));
  PetscCheck(n <= SB_INCLUSION_MAX, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_inclusions names %" PetscInt_FMT " sets; a body may have up to %d", body->name, n,
             SB_INCLUSION_MAX);
  PetscCall(PetscRealloc((size_t)(model->nmaterial + n) * sizeof(*model->material), &model->material));
  PetscCall(PetscRealloc((size_t)(model->nmaterial + n - model->nbody + 1) * SB_NAME_MAX, &model->inclusion));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(PetscStrncpy(model->inclusion[model->nmaterial - model->nbody], names[k], SB_NAME_MAX));
    PetscCall(SbScopeSet(&scope, "inclusion", "", names[k]));
    PetscCall(read_type(&scope, "material", SbMaterialList, law));
    PetscCall(SbMaterialCreate(law, &scope, &model->material[model->nmaterial]));
    body->inclusion[body->ninclusion++].material = model->nmaterial++;
  }
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_bodies(SbModel model)
{
  char(*names)[SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbSceneReadNames("bodies", "body", &model->nbody, &names));
  PetscCheck(model->nbody, PETSC_COMM_SELF, PETSC_ERR_USER, "-bodies names no body; at least one is needed");
  PetscCall(PetscCalloc1(model->nbody, &model->body));
  PetscCall(PetscCalloc1(model->nbody, &model->material));
  PetscCall(PetscCalloc1(model->nbody, &model->element));
  for (PetscInt i = 0; i < model->nbody; i++)
    PetscCall(PetscStrncpy(model->body[i].name, names[i], SB_NAME_MAX));
  PetscCall(PetscFree(names));
  model->nmaterial = model->nbody;
  for (PetscInt i = 0; i < model->nbody; i++) PetscCall(read_body(model, i));
  for (PetscInt i = 0; i < model->nbody; i++) PetscCall(read_inclusions(model, i));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the whole scene */

PetscErrorCode SbSceneCreate(MPI_Comm comm, SbModel *model)
{
  char(*names)[SB_NAME_MAX];
  PetscInt n;
  static const char *const keys[] = {"mass", "mesh_partitioner", "mesh_report", "validate"};
  SbScope scope;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(model));
  (*model)->comm = comm;
  PetscCall(read_bodies(*model));

  PetscCall(SbSceneReadNames("effects", "effect", &n, &names));
  PetscCall(PetscCalloc1(n, &(*model)->effect));
  for (PetscInt i = 0; i < n; i++) {
    const PetscErrorCode ierr = SbEffectCreate(names[i], &(*model)->effect[(*model)->neffect++]);

    if (ierr) PetscCall(PetscFree(names));
    PetscCall(ierr);
  }
  PetscCall(PetscFree(names));
  PetscCall(SbSceneReadSets(*model));

  /* options whose readers come after the mesh: read ahead, so that a bad value is found before it */
  PetscCall(SbScopeSet(&scope, "", "", ""));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(keys); i++) PetscCall(SbOptionCheckEarly(&scope, keys[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneValidate(SbModel model)
{
  SbScope scope;
  PetscBool validate;

  PetscFunctionBeginUser;
  PetscCall(SbScopeSet(&scope, "", "", ""));
  PetscCall(SbOptionBool(&scope, "validate", &validate));
  if (!validate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMeshValidate(model->mesh));
  PetscCall(SbSpaceValidate(model->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}
