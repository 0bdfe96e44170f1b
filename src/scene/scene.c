/*
  scene.c - builds the model from options, without computing: bodies with material and element, effects, sets.
*/
#include "scene_impl.h"

/* Materials registered by material/register.c, for the manual. */
#define LAWS "linear|corotated|stvk|neohookean"

const SbOption SbRunRows[] = {
  {"bodies", SB_OPTION_NAMES, 1, "", NULL, "", "names of the bodies, separated by commas"},
  {"sets", SB_OPTION_NAMES, 1, "", "", "",
   "names of sets that are defined by a shape; physical groups of the meshes, bodies, `all` and `boundary` "
   "need no set"},
  {"effects", SB_OPTION_NAMES, 1, "", "", "", "names of the effects: loads, supports, damping and contact"},
  {"validate", SB_OPTION_BOOL, 1, "", "false", "",
   "check the invariants of the mesh and of the finite-element space after set-up"},
  {0},
};
const SbOption SbBodyRows[] = {
  {"mesh", SB_OPTION_STRING, 1, "", NULL, "",
   "mesh of tetrahedra: a file (.msh .mesh .vtk .vtu .unv .inp .bdf .ele .vol .h5 and others: "
   "docs/reference/meshes.md), a closed surface to fill (.stl .obj .off .ply .poly .smesh), or "
   "box:lx,ly,lz:n, or box:lx,ly,lz:nx,ny,nz (m, cells)"},
  {"mesh_step", SB_OPTION_INT, 1, "", "0", "[-1, inf)",
   "when the mesh is the output of a run (fields.h5): number of the frame whose positions are taken; 0: "
   "reference configuration, -1: the last"},
  {"scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "factor on the coordinates of the mesh, before rotation; 0.001 for a file in mm"},
  {"rotate", SB_OPTION_REALS, 4, "", "0,0,1,0", "(-inf, inf)",
   "axis x,y,z and angle in degrees, before translation"},
  {"translate", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)", "translation, after scaling and rotation"},
  {"copies", SB_OPTION_STRING, 1, "", "", "",
   "instances NAME1, NAME2, ... of this body, which share its options: a file with a line x y z [ax ay az "
   "degrees [scale [vx vy vz]]] for each, or grid:nx,ny,nz,dx,dy,dz (m); scales multiply, rotations "
   "compose, translations and velocities add up; empty: one body"},
  {"element", SB_OPTION_STRING, 1, "", "p1", "p1|p2|cr|dg",
   "finite element; p2, cr and dg do not lock when poisson is near 0.5, p2 is the most accurate where the "
   "solution is smooth"},
  {"material", SB_OPTION_STRING, 1, "", "", LAWS, "material law, required"},
  {"inclusions", SB_OPTION_NAMES, 1, "", "", "",
   "sets or volume groups whose tets have another material, -inclusion_<name>_..."},
  {"displacement", SB_OPTION_FORMULA, 3, "m", "0,0,0", "",
   "initial displacement: numbers or formulas of the reference position x, y, z"},
  {"state", SB_OPTION_STRING, 1, "", "", "",
   "RUN or RUN,STEP: initial displacement and velocity are those of this body in the results of another run "
   "(its folder or fields.h5; without STEP the last frame), which may have another mesh, element, material, "
   "integrator and other effects; or of a checkpoint, in full precision if bodies, meshes and elements are "
   "the same"},
  {"velocity", SB_OPTION_FORMULA, 3, "m/s", "0,0,0", "",
   "initial velocity: numbers or formulas of the reference position x, y, z"},
  {"angular_velocity", SB_OPTION_REALS, 3, "rad/s", "0,0,0", "(-inf, inf)",
   "initial angular velocity about the centre of mass"},
  {0},
};
const SbOption SbInclusionRows[] = {
  {"material", SB_OPTION_STRING, 1, "", "", LAWS, "material law, required"},
  {0},
};

/* Reads a word that must be a name in a list of types. */
static PetscErrorCode read_type(const SbScope *scope, const char *key, PetscFunctionList list,
                                char word[SB_NAME_MAX])
{
  char option[3 * SB_NAME_MAX], all[512];
  void (*constructor)(void) = NULL;

  PetscFunctionBeginUser;
  SbOptionName(scope, key, sizeof(option), option);
  PetscCall(SbOptionString(scope, key, SB_NAME_MAX, word));
  PetscCall(PetscFunctionListFind(list, word, &constructor));
  if (constructor) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbListAdvise(list, word, sizeof(all), all));
  PetscCheck(word[0], PETSC_COMM_SELF, PETSC_ERR_USER, "%s must be given: one of %s", option, all);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s %s is not one of %s", option, word, all);
}

/* Reads a vector of formulas of position. */
static PetscErrorCode read_start(const SbScope *scope, const char *key, SbFormula formula[3])
{
  char option[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbOptionFormulas(scope, key, formula));
  SbOptionName(scope, key, sizeof(option), option);
  for (int k = 0; k < 3; k++)
    PetscCheck(!SbFormulaUses(formula[k], 't'), PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: what a body begins with may use the place x, y, z only, not t", option);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_body(SbModel model, PetscInt i)
{
  SbBody *body = &model->body[i];
  char(*inclusions)[SB_NAME_MAX], law[SB_NAME_MAX];
  PetscInt n;
  SbScope scope;
  PetscReal axis;

  PetscFunctionBeginUser;
  SbScopeSet(&scope, "body", "", body->name);
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
  PetscCall(read_start(&scope, "displacement", model->start[i].displacement));
  PetscCall(read_start(&scope, "velocity", model->start[i].velocity));
  for (int k = 0; k < 3; k++) {
    /* constant velocities are stored in the body */
    if (SbFormulaUses(model->start[i].velocity[k], 'x')) continue;
    body->velocity[k] = SbFormulaEval(model->start[i].velocity[k], 0., NULL);
    PetscCall(SbFormulaDestroy(&model->start[i].velocity[k]));
  }
  PetscCall(SbOptionGiven(&scope, "displacement", &model->start[i].moved));
  PetscCall(SbOptionString(&scope, "state", sizeof(model->start[i].state), model->start[i].state));
  PetscCheck(!model->start[i].state[0] || !model->start[i].moved, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_state and -body_%s_displacement both say where the body begins: give one of them",
             body->name, body->name);
  PetscCall(SbOptionReals(&scope, "angular_velocity", body->angular_velocity));

  /* append the materials of its inclusions */
  PetscCall(SbOptionNames(&scope, "inclusions", &n, &inclusions));
  PetscCheck(n <= SB_INCLUSION_MAX, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_inclusions names %" PetscInt_FMT " sets; a body may have up to %d", body->name, n,
             SB_INCLUSION_MAX);
  PetscCall(PetscRealloc((size_t)(model->nmaterial + n) * sizeof(*model->material), &model->material));
  PetscCall(PetscRealloc((size_t)(model->nmaterial + n - model->nbody + 1) * SB_NAME_MAX, &model->inclusion));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(PetscStrncpy(model->inclusion[model->nmaterial - model->nbody], inclusions[k], SB_NAME_MAX));
    SbScopeSet(&scope, "inclusion", "", inclusions[k]);
    PetscCall(read_type(&scope, "material", SbMaterialList, law));
    PetscCall(SbMaterialCreate(law, &scope, &model->material[model->nmaterial]));
    body->inclusion[body->ninclusion++].material = model->nmaterial++;
  }
  PetscCall(PetscFree(inclusions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the n bodies of these names, with all copies; the caller frees copy[i][ncopy[i]]. */
static PetscErrorCode read_named_bodies(SbModel model, PetscInt n, const char (*names)[SB_NAME_MAX],
                                        PetscInt ncopy[], SbPlacement *copy[])
{
  PetscInt nbody = 0;

  PetscFunctionBeginUser;
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_USER, "-bodies names no body; at least one is needed");
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(SbSceneReadCopies(model->comm, names[i], &ncopy[i], &copy[i]));
    nbody += PetscMax(ncopy[i], 1);
  }
  PetscCall(PetscCalloc1(nbody, &model->body));
  PetscCall(PetscCalloc1(nbody, &model->material));
  PetscCall(PetscCalloc1(nbody, &model->element));
  PetscCall(PetscCalloc1(nbody, &model->start));
  model->nmaterial = model->nbody = nbody;

  /* each body with its options, each copy with its placement */
  for (PetscInt i = 0, b = 0; i < n; i++) {
    for (PetscInt k = 0; k < PetscMax(ncopy[i], 1); k++, b++) {
      SbBody *body = &model->body[b];

      PetscCall(PetscStrncpy(body->name, names[i], SB_NAME_MAX));
      if (ncopy[i]) {
        PetscCall(PetscStrncpy(body->copy_of, names[i], SB_NAME_MAX));
        PetscCall(PetscSNPrintf(body->name, SB_NAME_MAX, "%s%" PetscInt_FMT, names[i], k + 1));
        PetscCall(SbOptionsInherit("body", body->name, body->copy_of));
      }
      for (PetscInt j = 0; j < b; j++)
        PetscCheck(strcasecmp(model->body[j].name, body->name), PETSC_COMM_SELF, PETSC_ERR_USER,
                   "-bodies: two bodies are named '%s', which copies are too; rename one", body->name);
      PetscCall(read_body(model, b));
      if (ncopy[i]) SbPlacementAdd(&copy[i][k], body);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_bodies(SbModel model)
{
  char(*names)[SB_NAME_MAX];
  PetscInt n, *ncopy;
  SbPlacement **copy;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(SbSceneReadNames("bodies", "body", &n, &names));
  PetscCall(PetscCalloc2(n, &ncopy, n, &copy));
  ierr = read_named_bodies(model, n, (const char(*)[SB_NAME_MAX])names, ncopy, copy);
  for (PetscInt i = 0; i < n; i++) PetscCall(PetscFree(copy[i]));
  PetscCall(PetscFree2(ncopy, copy));
  PetscCall(PetscFree(names));
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbSceneCreate(MPI_Comm comm, SbModel *model)
{
  char(*names)[SB_NAME_MAX];
  PetscInt n;
  PetscErrorCode ierr = PETSC_SUCCESS;
  static const char *const keys[] = {"mass", "mesh_partitioner", "mesh_reading", "mesh_report", "validate"};

  PetscFunctionBeginUser;
  PetscCall(PetscNew(model));
  (*model)->comm = comm;
  PetscCall(read_bodies(*model));

  PetscCall(SbSceneReadNames("effects", "effect", &n, &names));
  PetscCall(PetscCalloc1(n, &(*model)->effect));
  for (PetscInt i = 0; i < n && !ierr; i++)
    ierr = SbEffectCreate(names[i], &(*model)->effect[(*model)->neffect++]);
  PetscCall(PetscFree(names));
  PetscCall(ierr);
  PetscCall(SbSceneReadSets(*model));

  /* check options that are read after the mesh already now, to report errors early */
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(keys); i++)
    PetscCall(SbOptionCheckEarly(&SbRunScope, keys[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneValidate(SbModel model)
{
  PetscBool validate;

  PetscFunctionBeginUser;
  PetscCall(SbOptionBool(&SbRunScope, "validate", &validate));
  if (!validate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMeshValidate(model->mesh));
  PetscCall(SbSpaceValidate(model->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}
