/*
  damping.c - Rayleigh damping, C = alpha M + beta K, of some bodies or of all.

  A mode of angular frequency w is damped with the ratio zeta = (alpha / w + beta w) / 2: alpha slows the
  whole motion as in a viscous medium (rigid motion too), beta takes out fast vibration. This effect writes
  the two numbers into the regions of the space at set-up; the forces come with inertia and with the internal
  force. Two dampings of one body add up.
*/
#include "effect_impl.h"

typedef struct {
  SbEffectOn on;         /* names of bodies */
  PetscReal alpha, beta; /* 1/s, s */
} Damping;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "", "", "bodies that are damped; default: all"},
  {"alpha", SB_OPTION_REAL, 1, "1/s", "0", "[0, inf)", "Rayleigh damping: factor on the mass matrix"},
  {"beta", SB_OPTION_REAL, 1, "s", "0", "[0, inf)", "Rayleigh damping: factor on the stiffness matrix"},
};

static PetscErrorCode options_damping(SbEffect e, const SbScope *scope)
{
  Damping *d = (Damping *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectReadOn(scope, &d->on));
  PetscCall(SbOptionReal(scope, "alpha", &d->alpha));
  PetscCall(SbOptionReal(scope, "beta", &d->beta));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error with the nearest names when there is no body of that name. */
static PetscErrorCode check_body(SbMesh mesh, const SbEffectOn *on, const char *name)
{
  const char **names;
  char near[512];

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    PetscBool same;

    PetscCall(PetscStrcmp(mesh->body[b].name, name, &same));
    if (same) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(mesh->nbody, &names));
  for (PetscInt b = 0; b < mesh->nbody; b++) names[b] = mesh->body[b].name;
  PetscCall(SbNearestNames(name, mesh->nbody, names, sizeof(near), near));
  PetscCall(PetscFree(names));
  SETERRQ(mesh->comm, PETSC_ERR_USER_INPUT,
          "%s: there is no body %s%s%s; damping acts on bodies, see -bodies", on->option, name,
          near[0] ? "; did you mean " : "", near);
}

static PetscErrorCode setup_damping(SbEffect e, SbSpace space)
{
  const Damping *d = (const Damping *)e->data;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < d->on.n; i++) PetscCall(check_body(space->mesh, &d->on, d->on.name[i]));
  for (PetscInt r = 0; r < space->nregion; r++) {
    SbRegion *region = &space->region[r];
    PetscBool damped = d->on.n ? PETSC_FALSE : PETSC_TRUE;

    for (PetscInt i = 0; i < d->on.n && !damped; i++) {
      PetscCall(PetscStrcmp(d->on.name[i], space->mesh->body[region->body].name, &damped));
    }
    if (!damped) continue;
    region->alpha += d->alpha;
    region->beta += d->beta;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_damping(SbEffect e)
{
  Damping *d = (Damping *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFreeOn(&d->on));
  PetscCall(PetscFree(e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_damping(SbEffect e)
{
  Damping *d;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&d));
  e->data = d;
  e->ops.setfromoptions = options_damping;
  e->ops.setup = setup_damping;
  e->ops.destroy = destroy_damping;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRegister_Damping(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbEffectRegister("damping", create_damping, PETSC_STATIC_ARRAY_LENGTH(rows), rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
