/*
  check.c - consistency checks of several options, before the computation.

  A missing mesh file is an error here, before other bodies are read; the message suggests similar
  names in its folder. A static run without prescribed displacements has a singular matrix.
*/
#include <dirent.h>
#include <errno.h>
#include <unistd.h>
#include "scene_impl.h"

#define LARGE 2.       /* m; files of larger soft bodies are usually in mm */
#define LOCKS 0.495    /* Poisson's ratio from which on linear tets lock */
#define AUXETIC (-0.9) /* Poisson's ratio below which there is hardly a material */
#define LIGHT 10.      /* kg/m^3; no soft body in SI units has a lower density */

/* Similar file names in the folder of `path`, with the folder; "" if there are none. Rank 0
   only. */
static PetscErrorCode near_files(const char *path, size_t size, char text[])
{
  const char *slash = strrchr(path, '/');
  const char *name = slash ? slash + 1 : path;
  char folder[PETSC_MAX_PATH_LEN], found[PETSC_MAX_PATH_LEN];
  struct dirent **entry;
  const char **list;
  int n;

  PetscFunctionBeginUser;
  text[0] = 0;
  SbFormat(sizeof(folder), folder, "%.*s", (int)(name - path), path);
  n = scandir(slash ? folder : ".", &entry, NULL, alphasort);
  if (n < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n, &list));
  for (int i = 0; i < n; i++)
    list[i] = entry[i]->d_name;
  SbSuggestNames(name, n, list, sizeof(found), found);
  if (found[0])
    SbFormat(size, text, "%s%s", folder, found);
  for (int i = 0; i < n; i++)
    free(entry[i]);
  free(entry);
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 checks that the mesh file exists; collective. */
static PetscErrorCode check_mesh_file(MPI_Comm comm, const SbBody *body)
{
  const char *mesh = body->mesh;
  const char *dot = strrchr(mesh, '.');
  char near[PETSC_MAX_PATH_LEN] = "";
  char other[PETSC_MAX_PATH_LEN + 8];
  char advice[PETSC_MAX_PATH_LEN + 32] = "";
  int error = 0;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));

  // the file, or the .node file of a TetGen mesh given by its stem
  SbFormat(sizeof(other), other, "%s.node", mesh);
  if (!rank && access(other, R_OK) && access(mesh, R_OK)) {
    error = errno;

    /* advice: make it, if there is a .geo file as for meshes of the scenarios; a similar name; the
       folder */
    if (error == ENOENT && dot && !strcmp(dot, ".msh") && !strncmp(mesh, "meshes/", 7)) {
      SbFormat(sizeof(other), other, "%.*s.geo", (int)(dot - mesh), mesh);
      if (!access(other, R_OK))
        SbFormat(sizeof(advice), advice, "; make %s makes it", mesh);
    }
    if (error == ENOENT && !advice[0])
      PetscCall(near_files(mesh, sizeof(near), near));
    if (near[0]) {
      SbFormat(sizeof(advice), advice, "; did you mean %s?", near);
    } else if (!advice[0] && mesh[0] != '/') {
      PetscCall(PetscGetWorkingDirectory(near, sizeof(near)));
      SbFormat(sizeof(advice), advice, "; relative names begin in %s", near);
    }
  }
  PetscCallMPI(MPI_Bcast(&error, 1, MPI_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(advice, sizeof(advice), MPI_CHAR, 0, comm));
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_USER, "-body_%s_mesh %s: %s%s", body->name, mesh,
             strerror(error), advice);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warns of a Poisson's ratio with which results are seldom what was meant: of a body or an
   inclusion, named, on tets of a body. */
static PetscErrorCode check_poisson(SbModel model, const SbMaterial material, const char *klass,
                                    const char *name, const SbBody *body)
{
  const PetscReal nu = SbMaterialPoisson(material);
  PetscBool bulk = PETSC_FALSE;
  SbScope scope;
  char what[4 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  if (nu < LOCKS && nu >= AUXETIC)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* what gives it: Poisson's ratio, or the bulk modulus of a law with moduli of its own */
  SbScopeSet(&scope, klass, material->type->name, name);
  if (SbOptionFind(&scope, "bulk"))
    PetscCall(SbOptionGiven(&scope, "bulk", &bulk));
  if (bulk)
    SbFormat(sizeof(what), what, "-%s_%s_bulk %g Pa, a Poisson's ratio of %g,", klass, name,
             (double)SbMaterialBulkModulus(material), (double)nu);
  else
    SbFormat(sizeof(what), what, "-%s_%s_poisson %g", klass, name, (double)nu);
  if (nu >= LOCKS && !strcmp(body->element, "p1"))
    PetscCall(SbWarning(model->comm,
                        "%s with -body_%s_element p1: linear tets lock, the body is too stiff; "
                        "take p2, cr or dg",
                        what, body->copy_of[0] ? body->copy_of : body->name));
  if (nu < AUXETIC)
    PetscCall(SbWarning(model->comm,
                        "%s is near -1, where the shear modulus E/(2(1+nu)) has no limit: it is %g "
                        "times that of nu = 0",
                        what, (double)(1. / (1. + nu))));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warns of constants with which a law is unstable at stretches of 0.3 to 3, once for each mode. */
static PetscErrorCode check_stability(SbModel model, const SbMaterial material, const char *klass,
                                      const char *name)
{
  static const char *const modes[3] = {"uniaxial", "equibiaxial", "planar"};
  char text[512] = "";

  PetscFunctionBeginUser;
  if (!material->type->own_moduli && !material->type->limited)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int mode = 0; mode < 3; mode++) {
    for (int tension = 0; tension < 2; tension++) {
      PetscReal stretch;

      SbMaterialFindUnstable(material, mode, tension ? PETSC_TRUE : PETSC_FALSE, &stretch);
      if (stretch > 0.)
        SbAppend(sizeof(text), text, "%s%s %s %s the stretch %.3g", text[0] ? ", " : "",
                 modes[mode], tension ? "tension" : "compression", tension ? "beyond" : "below",
                 (double)stretch);
    }
  }
  if (text[0])
    PetscCall(SbWarning(model->comm,
                        "-%s_%s_material %s: with these constants the law is unstable (Drucker), "
                        "its tangent modulus negative, in %s; stay within, or fit the constants "
                        "to tests of all these modes",
                        klass, name, material->type->name, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_material(SbModel model, const SbMaterial material, const char *klass,
                                     const char *name, const SbBody *body)
{
  PetscFunctionBeginUser;
  PetscCall(check_poisson(model, material, klass, name, body));
  PetscCall(check_stability(model, material, klass, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The materials of a body and its inclusions; copies have those of the first one. */
static PetscErrorCode check_materials(SbModel model, PetscInt i)
{
  const SbBody *body = &model->body[i];

  PetscFunctionBeginUser;
  if (i && body->copy_of[0] && !strcmp(body->copy_of, model->body[i - 1].copy_of))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(check_material(model, model->material[i], "body",
                           body->copy_of[0] ? body->copy_of : body->name, body));
  for (PetscInt k = 0; k < body->ninclusion; k++)
    PetscCall(check_material(model, model->material[body->inclusion[k].material], "inclusion",
                             model->set[body->inclusion[k].set].name, body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Water that has a level weighs as the bodies do, unless its gravity is given: an error. */
static PetscErrorCode check_water(SbModel model, SbEffect water)
{
  PetscReal sum[3] = {0};
  PetscReal own[3], vector[3];
  const char *weight = NULL;
  PetscBool level, given;
  SbScope scope;

  PetscFunctionBeginUser;
  SbScopeSet(&scope, "effect", water->type, water->name);
  PetscCall(SbOptionGiven(&scope, "level", &level));
  PetscCall(SbOptionGiven(&scope, "gravity", &given));
  PetscCall(SbOptionReals(&scope, "gravity", own));
  if (!level || given)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt e = 0; e < model->neffect; e++) {
    if (strcmp(model->effect[e]->type, SbEffectGravity.name))
      continue;
    weight = model->effect[e]->name;
    SbScopeSet(&scope, "effect", SbEffectGravity.name, weight);
    PetscCall(SbOptionReals(&scope, "vector", vector));
    for (int k = 0; k < 3; k++)
      sum[k] += vector[k];
  }
  PetscCheck(
    weight, model->comm, PETSC_ERR_USER_INPUT,
    "effect %s: there is water, and bodies have no weight: name an effect of type gravity; "
    "-effect_%s_gravity (m/s^2) says that it is meant",
    water->name, water->name);
  for (int k = 0; k < 3; k++)
    PetscCheck(sum[k] == own[k], model->comm, PETSC_ERR_USER_INPUT,
               "-effect_%s_vector is %g,%g,%g m/s^2, and the water of effect %s has "
               "%g,%g,%g m/s^2: give -effect_%s_gravity",
               weight, (double)sum[0], (double)sum[1], (double)sum[2], water->name, (double)own[0],
               (double)own[1], (double)own[2], water->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneCheck(SbModel model)
{
  PetscBool constrained = model->dynamic;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < model->nbody; i++)
    PetscCall(check_materials(model, i));
  for (PetscInt e = 0; e < model->neffect && !constrained; e++)
    constrained =
      (PetscBool)(model->effect[e]->ops.prescribe || model->effect[e]->holds ||
                  (SbEffectHasPotential(model->effect[e]) && model->effect[e]->contact->springs));
  for (PetscInt e = 0; e < model->neffect; e++)
    if (!strcmp(model->effect[e]->type, SbEffectWater.name))
      PetscCall(check_water(model, model->effect[e]));
  for (PetscInt i = 0; i < model->nbody; i++) {
    if (strncmp(model->body[i].mesh, "box:", 4))
      PetscCall(check_mesh_file(model->comm, &model->body[i]));
    PetscCheck(model->dynamic || (!model->start[i].moved && !model->start[i].state[0]),
               PETSC_COMM_SELF, PETSC_ERR_USER,
               "-body_%s_%s is for dynamic runs: -time static begins without loads, at rest",
               model->body[i].name, model->start[i].moved ? "displacement" : "state");
  }
  PetscCheck(
    constrained, PETSC_COMM_SELF, PETSC_ERR_USER,
    "-time static: nothing holds the bodies, so there is no unique equilibrium; name an effect of "
    "type fixed, prescribed_displacement or foundation, or springs to the ground");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneCheckSizes(SbModel model)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < model->nbody; i++) {
    const SbBody *body = &model->body[i];
    const PetscReal length =
      PetscMax(PetscMax(body->bbox[3] - body->bbox[0], body->bbox[4] - body->bbox[1]),
               body->bbox[5] - body->bbox[2]);
    SbScope scope;
    PetscBool given;

    /* a box has the size given by the user; densities below the limit are in t/mm^3 or g/cm^3 */
    if (length < LARGE || body->density < LIGHT || !strncmp(body->mesh, "box:", 4))
      continue;
    if (i && body->copy_of[0] && !strcmp(body->copy_of, model->body[i - 1].copy_of))
      continue;
    SbScopeSet(&scope, "body", "", body->copy_of[0] ? body->copy_of : body->name);
    PetscCall(SbOptionGiven(&scope, "scale", &given));
    if (!given)
      PetscCall(SbWarning(
        model->comm,
        "body '%s' is %.3g m long: if its file is in mm, give -body_%s_scale 0.001 (in cm: "
        "0.01); if it is in m, -body_%s_scale 1 says so",
        body->name, (double)length, scope.instance, scope.instance));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
