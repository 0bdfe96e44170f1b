/*
  fixed.c - nodes with zero displacement, in all directions or in some.

  Prescribes u_c = 0 for the chosen components c. history.csv has the reaction, the force of the support on the body
  (prescribed.c has the sign). Of several effects that prescribe one unknown, the first in the scenario counts.

  CR and DG are constrained at the triangles of their surface, in the mean: one triangle alone, or two, leave rotations
  free. A DG face that is fixed in all directions has a node of its own that is prescribed, to which its cell is tied
  by a penalty (src/fem/layout.c; -body_X_dirichlet strong: the mean itself is prescribed). Single directions are
  constrained in the mean itself.
*/
#include "effect_impl.h"

typedef struct {
  int components; /* bits 0..2 */
  SbPrescribed prescribed;
} Fixed;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose nodes are fixed: vertices, p2 also edge midpoints, cr and dg the means over boundary faces"},
  {"components", SB_OPTION_CHOICE, 1, "", "xyz", SB_COMPONENT_CHOICES, "directions that are fixed"},
};

static PetscErrorCode options_fixed(SbEffect e, const SbScope *scope)
{
  Fixed *s = (Fixed *)e->data;
  PetscInt choice;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(scope, "components", &choice));
  s->components = SbPrescribedComponents(choice);
  e->prescribed = (PetscBool)(s->components == 7);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_fixed(SbEffect e, SbSpace space)
{
  Fixed *s = (Fixed *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbPrescribedSetUp(&s->prescribed, space, &e->on, s->components));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode prescribe_fixed(SbEffect e, SbSpace space, PetscReal t)
{
  Fixed *s = (Fixed *)e->data;

  PetscFunctionBeginUser;
  (void)t;
  PetscCall(SbPrescribedSetValues(&s->prescribed, space, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_fixed(SbEffect e, SbSpace space, const SbStage *stage,
                                    const PetscReal residual[], PetscReal values[])
{
  const Fixed *s = (const Fixed *)e->data;

  PetscFunctionBeginUser;
  (void)space;
  (void)stage;
  SbPrescribedReaction(&s->prescribed, residual, values);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_fixed(SbEffect e)
{
  Fixed *s = (Fixed *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbPrescribedFree(&s->prescribed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"reaction_x", "reaction_y", "reaction_z"};

const SbEffectType SbEffectFixed = {
  .name = "fixed",
  .size = sizeof(Fixed),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_fixed,
          .setup = setup_fixed,
          .prescribe = prescribe_fixed,
          .history = history_fixed,
          .destroy = destroy_fixed},
};
