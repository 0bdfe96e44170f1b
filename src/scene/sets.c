/*
  sets.c - named sets of a scene: defined by a shape in -sets, or named by effects, probes and bodies alone.

  Sets are named by the options `on` of effects, `on` and `in` of probes, `inclusions` of bodies. A name that
  -sets does not define means, in this order: the body of that name, `all` bodies, the whole `boundary`, the
  physical group of that name. All such names are collected before the mesh is read, because its sets are
  marked while the bodies are read.
*/
#include "scene_impl.h"

const SbOption SbSetRows[] = {
  {"at", SB_OPTION_STRING, 1, "", NULL, "",
   "shape of the set in the reference configuration, after scale, rotate, translate (m): "
   "box:x0,y0,z0,x1,y1,z1, plane:nx,ny,nz,d[,tolerance] (n.x = d), sphere:x,y,z,r, halfspace:nx,ny,nz,d (n.x "
   "<= d), or group:name, body:name, boundary"},
  {0},
};

/* Index of the body of this name, or of its first copy. */
static PetscInt find_body(SbModel model, const char *name)
{
  for (PetscInt i = 0; i < model->nbody; i++)
    if (!strcmp(model->body[i].name, name) || !strcmp(model->body[i].copy_of, name)) return i;
  return -1;
}

static PetscInt find_set(SbModel model, const char *name)
{
  for (PetscInt i = 0; i < model->nset; i++)
    if (!strcmp(model->set[i].name, name)) return i;
  return -1;
}

static PetscErrorCode read_set(SbModel model, const char *name)
{
  SbSet *set = &model->set[model->nset];
  SbScope scope;
  char option[3 * SB_NAME_MAX], text[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCheck(find_body(model, name) < 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-sets: '%s' is the name of a body and means the whole of it; give the set another name", name);
  SbScopeSet(&scope, "set", "", name);
  SbOptionName(&scope, "at", sizeof(option), option);
  PetscCall(SbOptionString(&scope, "at", sizeof(text), text));
  PetscCall(SbSetParse(option, text, set));
  PetscCall(PetscStrncpy(set->name, name, sizeof(set->name)));
  PetscCheck(set->shape != SB_SET_BODY || find_body(model, set->group) >= 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s: the scenario has no body %s", option, text, set->group);
  model->nset++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the set of a name without a definition in -sets. */
static PetscErrorCode use_name(SbModel model, const char *name)
{
  SbSet *set = &model->set[model->nset];

  PetscFunctionBeginUser;
  if (find_set(model, name) >= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrncpy(set->name, name, sizeof(set->name)));
  set->shape = find_body(model, name) >= 0 ? SB_SET_BODY
               : !strcmp(name, "all")      ? SB_SET_HALFSPACE
               : !strcmp(name, "boundary") ? SB_SET_BOUNDARY
                                           : SB_SET_GROUP;
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

PetscErrorCode SbSceneReadSets(SbModel model)
{
  char(*names)[SB_NAME_MAX];
  SbScope scope;
  PetscInt n, room;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(SbSceneReadNames("sets", "set", &n, &names));
  room = n;
  PetscCall(PetscCalloc1(n + SB_SET_MAX + 1, &model->set));
  for (PetscInt i = 0; i < n && !ierr; i++) ierr = read_set(model, names[i]);
  PetscCall(PetscFree(names));
  PetscCall(ierr);
  for (PetscInt e = 0; e < model->neffect; e++) {
    // sets of an effect; none if its type has no such option
    SbScopeSet(&scope, "effect", model->effect[e]->type, model->effect[e]->name);
    if (!SbOptionFind(&scope, "on")) continue;
    PetscCall(SbOptionNames(&scope, "on", &n, &names));
    for (PetscInt i = 0; i < n && model->nset <= SB_SET_MAX; i++) PetscCall(use_name(model, names[i]));
    PetscCall(PetscFree(names));
  }
  /* sets over which probes average */
  PetscCall(SbOptionNames(&SbRunScope, "probes", &n, &names));
  for (PetscInt i = 0; i < 2 * n && model->nset <= SB_SET_MAX; i++) {
    char name[SB_NAME_MAX];

    SbScopeSet(&scope, "probe", "", names[i / 2]);
    PetscCall(SbOptionString(&scope, i % 2 ? "in" : "on", sizeof(name), name));
    if (name[0]) PetscCall(use_name(model, name));
  }
  PetscCall(PetscFree(names));
  for (PetscInt b = 0; b < model->nbody; b++) {
    SbBody *body = &model->body[b];

    for (PetscInt k = 0; k < body->ninclusion && model->nset <= SB_SET_MAX; k++) {
      const char *name = model->inclusion[body->inclusion[k].material - model->nbody];

      PetscCall(use_name(model, name));
      body->inclusion[k].set = find_set(model, name);
    }
  }
  PetscCheck(model->nset <= SB_SET_MAX, PETSC_COMM_SELF, PETSC_ERR_USER,
             "the scenario uses more than %d sets (%" PetscInt_FMT
             " in -sets, the others named by effects, probes and inclusions); join some of them",
             SB_SET_MAX, room);
  PetscFunctionReturn(PETSC_SUCCESS);
}
