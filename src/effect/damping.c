/*
  damping.c - Rayleigh damping, C = alpha M + beta K, of some bodies or of all.

  A mode of angular frequency w is damped with the ratio zeta = (alpha / w + beta w) / 2: alpha
  slows the whole motion as in a viscous medium (rigid motion too), beta takes out fast vibration.
  This effect writes the two numbers into the space at set-up; the forces come with inertia and with
  the internal force. Two dampings of one body add up.
*/
#include "effect_impl.h"

typedef struct {
  PetscReal alpha, beta; /* 1/s, s */
} Damping;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "", "", "bodies that are damped; default: all"},
  {"alpha", SB_OPTION_REAL, 1, "1/s", "0", "[0, inf)",
   "Rayleigh damping: factor on the mass matrix"},
  {"beta", SB_OPTION_REAL, 1, "s", "0", "[0, inf)",
   "Rayleigh damping: factor on the stiffness matrix"},
};

static PetscErrorCode options_damping(SbEffect e, const SbScope *scope)
{
  Damping *d = (Damping *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "alpha", &d->alpha));
  PetscCall(SbOptionReal(scope, "beta", &d->beta));
  if (d->alpha == 0. && d->beta == 0.)
    PetscCall(SbWarning(PETSC_COMM_WORLD,
                        "the effect %s damps nothing: give -effect_%s_alpha (1/s) or "
                        "-effect_%s_beta (s)",
                        e->name, e->name, e->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_damping(SbEffect e, SbSpace space)
{
  const Damping *d = (const Damping *)e->data;
  const SbMesh mesh = space->mesh;

  PetscFunctionBeginUser;

  /* an error with the nearest names where there is no such body */
  for (PetscInt i = 0; i < e->on.n; i++) {
    PetscInt b = 0;

    while (b < mesh->nbody && strcmp(mesh->body[b].name, e->on.name[i]))
      b++;
    if (b == mesh->nbody) {
      const char **names;
      char near[512];

      PetscCall(PetscMalloc1(mesh->nbody, &names));
      for (b = 0; b < mesh->nbody; b++)
        names[b] = mesh->body[b].name;
      SbSuggestNames(e->on.name[i], mesh->nbody, names, sizeof(near), near);
      PetscCall(PetscFree(names));
      SETERRQ(mesh->comm, PETSC_ERR_USER_INPUT,
              "%s: there is no body %s%s%s; damping acts on bodies, see -bodies", e->on.option,
              e->on.name[i], near[0] ? "; did you mean " : "", near);
    }
  }
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    PetscInt i = 0;

    while (i < e->on.n && strcmp(mesh->body[b].name, e->on.name[i]))
      i++;
    if (e->on.n && i == e->on.n)
      continue;
    space->alpha[b] += d->alpha;
    space->beta[b] += d->beta;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectDamping = {
  .name = "damping",
  .size = sizeof(Damping),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_damping, .setup = setup_damping},
};
