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
  PetscBool *in;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(space->mesh->nbody, &in));
  PetscCall(SbEffectBodies(space, &e->on, in));
  for (PetscInt b = 0; b < space->mesh->nbody; b++) {
    if (!in[b])
      continue;
    space->alpha[b] += d->alpha;
    space->beta[b] += d->beta;
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectDamping = {
  .name = "damping",
  .size = sizeof(Damping),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_damping, .setup = setup_damping},
};
