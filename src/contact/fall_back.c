/*
  fall_back.c - a step in which the forces of a response with multipliers do not settle goes on with
  the barrier, which needs none, on the same pairs (-effect_X_unsettled). The step after it has the
  response of the effect again, whose multipliers begin with the forces of the barrier.
*/
#include "surfaces.h"

static void set_response(Surfaces *b, SbResponse response)
{
  if (response == b->contact.response)
    return;
  b->contact.response = response;
  b->contact.base.exact = is_exact(b);
  b->contact.base.rigid = has_multipliers(b);
  b->contact.base.saddle = (PetscBool)(response == MULTIPLIER);
  for (PetscInt i = 0; i < b->surface->space->mesh->nbody && is_barrier(b); i++)
    b->widths.k[i] = b->widths.guard[i];
  b->motion.known = PETSC_FALSE;
}

void SbSurfacesBeginResponse(Surfaces *b)
{
  set_response(b, b->fall_back.now ? BARRIER : b->fall_back.response);
  b->fall_back.now = PETSC_FALSE;
}

PetscErrorCode SbContactFallBack_Surfaces(SbContact contact, SbSpace s, const char *why,
                                          PetscBool *again)
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  if (!b->fall_back.may || is_barrier(b))
    PetscFunctionReturn(PETSC_SUCCESS);
  b->fall_back.now = *again = PETSC_TRUE;
  if (!b->fall_back.n++)
    PetscCall(SbWarning(s->comm,
                        "%s. The effect %s goes on with the response barrier in this step; said "
                        "once, the summary has the number of such steps",
                        why, contact->effect->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}
