/*
  fixed.c - nodes constrained where they are at rest, in all directions or in some.

  Prescribes u_c = 0 for the chosen components c. The history gets the force of the support on the body
  (prescribed.c has the sign). Between effects that want the same unknown, the one named first in the scenario has
  it.

  CR and DG are constrained at the triangles of their surface, in the mean: one triangle alone, or two, leave rotations
  free. A DG face that is fixed in all directions has a node of its own that is prescribed, to which its cell is tied
  by a penalty (src/fem/layout.c; -body_X_dirichlet strong: the mean itself is prescribed). Single directions are
  constrained in the mean itself.
*/
#include "effect_impl.h"

typedef struct {
  SbEffectOn on;
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
  PetscCall(SbEffectReadOn(scope, &s->on));
  PetscCall(SbOptionChoice(scope, "components", &choice));
  s->components = SbPrescribedComponents(choice);
  if (s->components == 7) e->prescribed = &s->on;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_fixed(SbEffect e, SbSpace space)
{
  Fixed *s = (Fixed *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbPrescribedSetUp(&s->prescribed, space, &s->on, s->components));
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
  PetscCall(SbEffectFreeOn(&s->on));
  PetscCall(SbPrescribedFree(&s->prescribed));
  PetscCall(PetscFree(e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_fixed(SbEffect e)
{
  static const char *const columns[] = {"reaction_x", "reaction_y", "reaction_z"};
  Fixed *s;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  e->data = s;
  e->ops.setfromoptions = options_fixed;
  e->ops.setup = setup_fixed;
  e->ops.prescribe = prescribe_fixed;
  e->ops.history = history_fixed;
  e->ops.destroy = destroy_fixed;
  e->column = columns;
  e->ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRegister_Fixed(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbEffectRegister("fixed", create_fixed, PETSC_STATIC_ARRAY_LENGTH(rows), rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
