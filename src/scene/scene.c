/*
  scene.c - builds the model from options, without computing: bodies with material and element,
  effects, sets.

  Names of bodies, sets and effects are parts of option names: -body_<name>_young. These are
  case-insensitive in PETSc, hence names must differ in more than case. PETSc also takes
  `-body_young` for a missing `-body_1_young`: a part of a name that has only digits could read
  another name's option, and is an error.

  Sets are named by the options `on` of effects, `on` and `in` of probes, `inclusions` of bodies.
  All such names are collected before the mesh is read, because its sets are marked while the bodies
  are read.
*/
#include <ctype.h>
#include "sbsurface.h"
#include "scene_impl.h"

#define NAME_LENGTH 31 /* PETSc allows 63 characters of an option's name in YAML files */

const SbOption SbRunRows[] = {
  {"bodies", SB_OPTION_NAMES, 1, "", NULL, "", "names of the bodies, separated by commas"},
  {"sets", SB_OPTION_NAMES, 1, "", "", "",
   "names of sets that are defined by a shape; physical groups of the meshes, bodies, `all` and "
   "`boundary` "
   "need no set"},
  {"effects", SB_OPTION_NAMES, 1, "", "", "",
   "names of the effects: loads, supports, damping and contact"},
  {"validate", SB_OPTION_BOOL, 1, "", "false", "",
   "check the invariants of the mesh and of the finite-element space after set-up"},
  {0},
};
const SbOption SbBodyRows[] = {
  {"mesh", SB_OPTION_STRING, 1, "", NULL, "",
   "mesh of tetrahedra: a file (.msh .mesh .vtk .vtu .unv .inp .bdf .feb .med .exo .cgns .ele .vol "
   ".h5 and others: "
   "docs/reference/meshes.md), a closed surface to fill (.stl .obj .off .ply .poly .smesh), or "
   "box:lx,ly,lz:n, or box:lx,ly,lz:nx,ny,nz (m, cells)"},
  {"mesh_step", SB_OPTION_INT, 1, "", "0", "[-1, inf)",
   "when the mesh is the output of a run (fields.h5): number of the frame whose positions are "
   "taken; 0: "
   "reference configuration, -1: the last"},
  {"scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "factor on the coordinates of the mesh, before rotation; 0.001 for a file in mm"},
  {"rotate", SB_OPTION_REALS, 4, "", "0,0,1,0", "(-inf, inf)",
   "axis x,y,z and angle in degrees, before translation"},
  {"translate", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)",
   "translation, after scaling and rotation"},
  {"copies", SB_OPTION_STRING, 1, "", "", "",
   "instances NAME1, NAME2, ... of this body, which share its options: a file with a line x y z "
   "[ax ay az "
   "degrees [scale [vx vy vz]]] for each, or grid:nx,ny,nz,dx,dy,dz (m); scales multiply, "
   "rotations "
   "compose, translations and velocities add up; empty: one body"},
  {"element", SB_OPTION_STRING, 1, "", "p1", SbElementNames,
   "finite element; p2, cr and dg do not lock when poisson is near 0.5, p2 is the most accurate "
   "where the "
   "solution is smooth"},
  {"material", SB_OPTION_STRING, 1, "", "", SbMaterialNames, "material law, required"},
  {"rigid", SB_OPTION_BOOL, 1, "", "false", "",
   "the body is rigid: it moves by forces and contact as a whole, with mass, centre and moments of "
   "inertia of its mesh; element and material are not read, contact needs response barrier"},
  {"rigid_stiffness", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "of a rigid body: Young's modulus of the energy that keeps it rigid; 0: 1e4 times the largest "
   "of Young's moduli of soft bodies and of the pressures of motions in the scene"},
  {"inclusions", SB_OPTION_NAMES, 1, "", "", "",
   "sets or volume groups whose tets have another material, -inclusion_<name>_..."},
  {"displacement", SB_OPTION_FORMULA, 3, "m", "0,0,0", "",
   "initial displacement: numbers or formulas of the reference position x, y, z"},
  {"state", SB_OPTION_STRING, 1, "", "", "",
   "RUN or RUN,STEP: initial displacement and velocity are those of this body in the results of "
   "another run "
   "(its folder or fields.h5; without STEP the last frame), which may have another mesh, element, "
   "material, "
   "integrator and other effects; or of a checkpoint, in full precision if bodies, meshes and "
   "elements are "
   "the same"},
  {"velocity", SB_OPTION_FORMULA, 3, "m/s", "0,0,0", "",
   "initial velocity: numbers or formulas of the reference position x, y, z"},
  {"angular_velocity", SB_OPTION_REALS, 3, "rad/s", "0,0,0", "(-inf, inf)",
   "initial angular velocity about the centre of mass"},
  {0},
};
const SbOption SbInclusionRows[] = {
  {"material", SB_OPTION_STRING, 1, "", "", SbMaterialNames, "material law, required"},
  {0},
};

const SbOption SbSetRows[] = {
  {"at", SB_OPTION_STRING, 1, "", NULL, "",
   "shape of the set in the reference configuration, after scale, rotate, translate (m): "
   "box:x0,y0,z0,x1,y1,z1, plane:nx,ny,nz,d[,tolerance] (n.x = d), sphere:x,y,z,r, "
   "halfspace:nx,ny,nz,d (n.x "
   "<= d), or group:name, body:name, boundary"},
  {0},
};

/* Describes what is wrong with a name; NULL if it is valid. */
static const char *name_problem(const char *name)
{
  PetscBool only_digits = PETSC_FALSE;

  if (strlen(name) > NAME_LENGTH)
    return "is longer than 31 characters";
  if (!isalpha((unsigned char)name[0]))
    return "does not begin with a letter";
  for (const char *c = name; *c; c++)
    if (!isalnum((unsigned char)*c) && *c != '_')
      return "may hold letters, digits and underscores only";
  for (const char *c = name; *c; c++) {
    if (*c == '_') {
      if (!c[1] || c[1] == '_')
        return "has an underscore without a word after it";
      only_digits = PETSC_TRUE;
    } else if (!isdigit((unsigned char)*c))
      only_digits = PETSC_FALSE;
    if (only_digits && *c != '_' && (c[1] == '_' || !c[1]))
      return "has a part of digits only; leave out the underscore before it";
  }
  if (!strcasecmp(name, "all") || !strcasecmp(name, "boundary"))
    return "has a meaning of its own where sets are named";
  return NULL;
}

/* Reads the names of bodies, sets or effects from an option of class "": each begins with a letter
   and has letters, digits and underscores, is not a reserved word, and occurs once. `what` is
   "body", "set" or "effect". The caller frees the names with PetscFree(). */
static PetscErrorCode read_names(const char *key, const char *what, PetscInt *n,
                                 char (**names)[SB_NAME_MAX])
{
  char problem[4 * SB_NAME_MAX] = "";

  PetscFunctionBeginUser;
  PetscCall(SbOptionNames(&SbRunScope, key, n, names));

  // the first invalid name
  for (PetscInt i = 0; i < *n && !problem[0]; i++) {
    const char *name = (*names)[i];
    const char *wrong = name_problem(name);

    if (!strcmp(what, "body") && !strcasecmp(name, SB_OPTION_DEFAULT))
      wrong = "stands for all bodies in -body_default_young and the like";
    if (wrong)
      PetscCall(PetscSNPrintf(problem, sizeof(problem), "the name '%s' %s", name, wrong));
    for (PetscInt j = 0; j < i && !problem[0]; j++) {
      const char *hint = strcmp(name, (*names)[j]) ? " (upper and lower case count as one)" : "";

      if (strcasecmp(name, (*names)[j]))
        continue;
      PetscCall(PetscSNPrintf(problem, sizeof(problem),
                              "two are named '%s'%s; every %s needs a name of its own", name, hint,
                              what));
    }
  }
  if (problem[0])
    PetscCall(PetscFree(*names));
  PetscCheck(!problem[0], PETSC_COMM_SELF, PETSC_ERR_USER, "-%s: %s", key, problem);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a word that must be one of the names of n types, which are sorted here. */
static PetscErrorCode read_type(const SbScope *scope, const char *key, PetscInt n,
                                const char *names[], char word[SB_NAME_MAX])
{
  char option[3 * SB_NAME_MAX], all[512];

  PetscFunctionBeginUser;
  SbOptionName(scope, key, sizeof(option), option);
  PetscCall(SbOptionString(scope, key, SB_NAME_MAX, word));
  for (PetscInt i = 0; i < n; i++)
    if (!strcmp(names[i], word))
      PetscFunctionReturn(PETSC_SUCCESS);
  SbAdviseSorted(word, n, names, sizeof(all), all);
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

/* Whether a body begins away from its rest state; 0;0;0, as scenario.opts has it, is none. */
static PetscErrorCode is_moved(const SbStart *start, PetscBool *moved)
{
  PetscFunctionBeginUser;
  *moved = PETSC_FALSE;
  for (int k = 0; k < 3; k++) {
    PetscReal u = 1.;

    if (!SbFormulaUses(start->displacement[k], 'x'))
      PetscCall(SbFormulaEval(start->displacement[k], 0., NULL, &u));
    *moved = (PetscBool)(*moved || u != 0.);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Element and material of a body; a rigid one has its own. */
static PetscErrorCode read_element_and_material(SbModel model, PetscInt i, const SbScope *scope)
{
  SbBody *body = &model->body[i];
  const char *elements[SB_ELEMENT_TYPES], *laws[SB_MATERIAL_TYPES];

  PetscFunctionBeginUser;
  PetscCall(SbOptionBool(scope, "rigid", &body->rigid));
  PetscCall(SbOptionReal(scope, "rigid_stiffness", &body->rigid_stiffness));
  if (body->rigid) {
    PetscCall(PetscStrncpy(body->element, SB_ELEMENT_RIGID, sizeof(body->element)));
    PetscCall(SbElementCreateRigid(&model->element[i]));
    PetscCall(SbMaterialCreateRigid(scope, &model->material[i]));
    PetscCall(PetscStrncpy(body->material, model->material[i]->type->name, sizeof(body->material)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(body->rigid_stiffness == 0., PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_rigid_stiffness is of rigid bodies, and this one is soft: give "
             "-body_%s_rigid yes, or leave it out",
             body->name, body->name);
  PetscCall(read_type(scope, "element", SbElementTypes(elements), elements, body->element));
  PetscCall(read_type(scope, "material", SbMaterialTypes(laws), laws, body->material));
  PetscCall(SbElementCreate(body->element, scope, &model->element[i]));
  PetscCall(SbMaterialCreate(body->material, scope, &model->material[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_body(SbModel model, PetscInt i)
{
  SbBody *body = &model->body[i];
  const char *laws[SB_MATERIAL_TYPES];
  char(*inclusions)[SB_NAME_MAX], law[SB_NAME_MAX];
  PetscInt n;
  SbScope scope;
  PetscReal axis;

  PetscFunctionBeginUser;
  SbScopeSet(&scope, "body", "", body->name);
  PetscCall(SbOptionString(&scope, "mesh", sizeof(body->mesh), body->mesh));
  PetscCheck(body->mesh[0], PETSC_COMM_SELF, PETSC_ERR_USER, "-body_%s_mesh names no file",
             body->name);
  PetscCall(SbTetOptionsRead(&scope, body->mesh, &body->tet));
  PetscCall(SbOptionInt(&scope, "mesh_step", &body->mesh_step));
  PetscCall(SbOptionReal(&scope, "scale", &body->scale));
  PetscCall(SbOptionReals(&scope, "rotate", body->rotate));
  axis =
    PetscAbsReal(body->rotate[0]) + PetscAbsReal(body->rotate[1]) + PetscAbsReal(body->rotate[2]);
  PetscCheck(axis > 0 || body->rotate[3] == 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_rotate: the axis 0,0,0 has no direction; give x,y,z of the axis, then the "
             "angle in degrees",
             body->name);
  PetscCall(SbOptionReals(&scope, "translate", body->translate));
  PetscCall(read_element_and_material(model, i, &scope));
  body->density = model->material[i]->density;
  PetscCall(read_start(&scope, "displacement", model->start[i].displacement));
  PetscCall(read_start(&scope, "velocity", model->start[i].velocity));
  for (int k = 0; k < 3; k++) {
    /* constant velocities are stored in the body */
    if (SbFormulaUses(model->start[i].velocity[k], 'x'))
      continue;
    PetscCall(SbFormulaEval(model->start[i].velocity[k], 0., NULL, &body->velocity[k]));
    PetscCall(SbFormulaDestroy(&model->start[i].velocity[k]));
  }
  PetscCall(is_moved(&model->start[i], &model->start[i].moved));
  PetscCall(SbOptionString(&scope, "state", sizeof(model->start[i].state), model->start[i].state));
  PetscCheck(
    !model->start[i].state[0] || !model->start[i].moved, PETSC_COMM_SELF, PETSC_ERR_USER,
    "-body_%s_state and -body_%s_displacement both say where the body begins: give one of them",
    body->name, body->name);
  PetscCall(SbOptionReals(&scope, "angular_velocity", body->angular_velocity));

  /* append the materials of its inclusions */
  PetscCall(SbOptionNames(&scope, "inclusions", &n, &inclusions));
  PetscCheck(n <= SB_INCLUSION_MAX, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_inclusions names %" PetscInt_FMT " sets; a body may have up to %d",
             body->name, n, SB_INCLUSION_MAX);
  PetscCheck(!n || !body->rigid, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-body_%s_inclusions: a rigid body has no materials: leave them out, or make it of "
             "several bodies",
             body->name);
  PetscCall(
    PetscRealloc((size_t)(model->nmaterial + n) * sizeof(*model->material), &model->material));
  for (PetscInt k = 0; k < n; k++) {
    SbScopeSet(&scope, "inclusion", "", inclusions[k]);
    PetscCall(read_type(&scope, "material", SbMaterialTypes(laws), laws, law));
    PetscCall(SbMaterialCreate(law, &scope, &model->material[model->nmaterial]));
    body->inclusion[body->ninclusion++].material = model->nmaterial++;
  }
  PetscCall(PetscFree(inclusions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int compare_names(const void *a, const void *b)
{
  return strcasecmp((*(const SbBody *const *)a)->name, (*(const SbBody *const *)b)->name);
}

/* No two bodies may have one name. Sorted, as there may be many thousand copies. */
static PetscErrorCode check_body_names(SbModel model)
{
  const SbBody **sorted;
  const char *twice = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(model->nbody, &sorted));
  for (PetscInt b = 0; b < model->nbody; b++)
    sorted[b] = &model->body[b];
  qsort(sorted, (size_t)model->nbody, sizeof(*sorted), compare_names);
  for (PetscInt b = 1; b < model->nbody && !twice; b++)
    if (!compare_names(&sorted[b - 1], &sorted[b]))
      twice = sorted[b]->name;
  PetscCall(PetscFree(sorted));
  PetscCheck(!twice, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-bodies: two bodies are named '%s', which copies are too; rename one", twice);
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
  PetscCall(PetscCalloc3(nbody, &model->body, nbody, &model->element, nbody, &model->start));
  PetscCall(PetscCalloc1(nbody, &model->material));
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
      PetscCall(read_body(model, b));
      if (ncopy[i])
        SbPlacementAdd(&copy[i][k], body);
    }
  }
  PetscCall(check_body_names(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_bodies(SbModel model)
{
  char(*names)[SB_NAME_MAX];
  PetscInt n, *ncopy;
  SbPlacement **copy;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(read_names("bodies", "body", &n, &names));
  PetscCall(PetscCalloc2(n, &ncopy, n, &copy));
  ierr = read_named_bodies(model, n, (const char(*)[SB_NAME_MAX])names, ncopy, copy);
  for (PetscInt i = 0; i < n; i++)
    PetscCall(PetscFree(copy[i]));
  PetscCall(PetscFree2(ncopy, copy));
  PetscCall(PetscFree(names));
  PetscFunctionReturn(ierr);
}

/* Index of the body of this name, or of its first copy. */
static PetscInt find_body(SbModel model, const char *name)
{
  for (PetscInt i = 0; i < model->nbody; i++)
    if (!strcmp(model->body[i].name, name) || !strcmp(model->body[i].copy_of, name))
      return i;
  return -1;
}

static PetscInt find_set(SbModel model, const char *name)
{
  for (PetscInt i = 0; i < model->nset; i++)
    if (!strcmp(model->set[i].name, name))
      return i;
  return -1;
}

static PetscErrorCode read_set(SbModel model, const char *name)
{
  SbSet *set = &model->set[model->nset];
  SbScope scope;
  char option[3 * SB_NAME_MAX], text[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCheck(
    find_body(model, name) < 0, PETSC_COMM_SELF, PETSC_ERR_USER,
    "-sets: '%s' is the name of a body and means the whole of it; give the set another name", name);
  SbScopeSet(&scope, "set", "", name);
  SbOptionName(&scope, "at", sizeof(option), option);
  PetscCall(SbOptionString(&scope, "at", sizeof(text), text));
  PetscCall(SbSetParse(option, text, set));
  PetscCall(PetscStrncpy(set->name, name, sizeof(set->name)));
  PetscCheck(set->shape != SB_SET_BODY || find_body(model, set->group) >= 0, PETSC_COMM_SELF,
             PETSC_ERR_USER, "%s %s: the scenario has no body %s", option, text, set->group);
  model->nset++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the set of a name without a definition in -sets. */
static PetscErrorCode use_name(SbModel model, const char *name)
{
  SbSet *set = &model->set[model->nset];

  PetscFunctionBeginUser;
  if (find_set(model, name) >= 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrncpy(set->name, name, sizeof(set->name)));
  if (find_body(model, name) >= 0)
    set->shape = SB_SET_BODY;
  else if (!strcmp(name, "all"))
    set->shape = SB_SET_HALFSPACE;
  else if (!strcmp(name, "boundary"))
    set->shape = SB_SET_BOUNDARY;
  else
    set->shape = SB_SET_GROUP;
  if (set->shape == SB_SET_HALFSPACE) {
    /* one that contains every point */
    set->p[2] = 1;
    set->p[3] = PETSC_MAX_REAL;
  } else if (set->shape != SB_SET_BOUNDARY) {
    PetscCall(PetscStrncpy(set->group, name, sizeof(set->group)));
  }
  model->nset++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the sets of -sets, then those that effects, probes and inclusions name without one. */
static PetscErrorCode read_sets(SbModel model)
{
  char(*names)[SB_NAME_MAX];
  SbScope scope;
  PetscInt n, room;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(read_names("sets", "set", &n, &names));
  room = n;
  PetscCall(PetscCalloc1(n + SB_SET_MAX + 1, &model->set));
  for (PetscInt i = 0; i < n && !ierr; i++)
    ierr = read_set(model, names[i]);
  PetscCall(PetscFree(names));
  PetscCall(ierr);
  for (PetscInt e = 0; e < model->neffect; e++) {
    const SbEffectOn *const on[2] = {&model->effect[e]->on, &model->effect[e]->to};

    for (int k = 0; k < 2; k++)
      for (PetscInt i = 0; i < on[k]->n && model->nset <= SB_SET_MAX; i++)
        PetscCall(use_name(model, on[k]->name[i]));
  }

  /* sets over which probes average */
  PetscCall(SbOptionNames(&SbRunScope, "probes", &n, &names));
  for (PetscInt i = 0; i < 2 * n && model->nset <= SB_SET_MAX; i++) {
    char name[SB_NAME_MAX];

    SbScopeSet(&scope, "probe", "", names[i / 2]);
    PetscCall(SbOptionString(&scope, i % 2 ? "in" : "on", sizeof(name), name));
    if (name[0])
      PetscCall(use_name(model, name));
  }
  PetscCall(PetscFree(names));
  for (PetscInt b = 0; b < model->nbody; b++) {
    SbBody *body = &model->body[b];

    for (PetscInt k = 0; k < body->ninclusion && model->nset <= SB_SET_MAX; k++) {
      const char *name = model->material[body->inclusion[k].material]->name;

      PetscCall(use_name(model, name));
      body->inclusion[k].set = find_set(model, name);
    }
  }

  /* surfaces of rules for fibres */
  for (PetscInt k = 0; k < model->nmaterial; k++) {
    const SbFibres fibres = model->material[k]->fibres;

    for (int i = 0; fibres && i < SB_FIBRE_SURFACES && model->nset <= SB_SET_MAX; i++)
      if (fibres->surface[i][0])
        PetscCall(use_name(model, fibres->surface[i]));
  }
  PetscCheck(
    model->nset <= SB_SET_MAX, PETSC_COMM_SELF, PETSC_ERR_USER,
    "the scenario uses more than %d sets (%" PetscInt_FMT
    " in -sets, the others named by effects, probes, inclusions and fibres); join some of them",
    SB_SET_MAX, room);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneCreate(MPI_Comm comm, SbModel *model)
{
  char(*names)[SB_NAME_MAX];
  PetscInt n;
  PetscErrorCode ierr = PETSC_SUCCESS;
  static const char *const keys[] = {"mass",         "displacement_view", "petscpartitioner_type",
                                     "mesh_reading", "mesh_report",       "validate"};

  PetscFunctionBeginUser;
  PetscCall(PetscNew(model));
  (*model)->comm = comm;
  PetscCall(read_bodies(*model));

  PetscCall(read_names("effects", "effect", &n, &names));
  PetscCall(PetscCalloc1(n, &(*model)->effect));
  for (PetscInt i = 0; i < n && !ierr; i++)
    ierr = SbEffectCreate(names[i], &(*model)->effect[(*model)->neffect++]);
  PetscCall(PetscFree(names));
  PetscCall(ierr);
  PetscCall(read_sets(*model));

  /* check options that are read after the mesh already now, to report errors early */
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(keys); i++)
    PetscCall(SbOptionCheckEarly(&SbRunScope, keys[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
