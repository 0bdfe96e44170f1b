/*
  repeated.c - effects that act on the same surfaces and fight each other, or count twice: two ties
  of the same surfaces, a tie and contact of what it ties, two cavities with one wall, two periodic
  cells of one body. Contacts among themselves are examined by src/contact/repeated.c.
*/
#include "model_impl.h"

static PetscBool is(SbEffect e, const char *type)
{
  return (PetscBool)!strcmp(e->type, type);
}

/* How many facets of all bodies are in both. */
static PetscErrorCode count_shared(SbModel m, const SbEffectOn *one, const SbEffectOn *two,
                                   PetscInt *n)
{
  PetscInt *shared;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nbody, &shared));
  PetscCall(SbEffectShared(m->space, one, two, shared));
  *n = 0;
  for (PetscInt b = 0; b < m->nbody; b++)
    *n += shared[b];
  PetscCall(PetscFree(shared));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two ties that hold at the same time, in either order of their surfaces. */
static PetscErrorCode check_ties(SbModel m, SbEffect one, SbEffect two)
{
  PetscFunctionBeginUser;
  if (one->from >= two->until || two->from >= one->until)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int turned = 0; turned < 2; turned++) {
    PetscInt n[2];

    PetscCall(count_shared(m, &one->on, turned ? &two->to : &two->on, &n[0]));
    PetscCall(count_shared(m, &one->to, turned ? &two->on : &two->to, &n[1]));
    if (!n[0] || !n[1])
      continue;
    PetscCall(SbWarning(
      m->comm,
      "effects %s and %s are both ties of %" PetscInt_FMT " facets of %s with %" PetscInt_FMT
      " of %s: where they meet their stiffnesses add up; leave one of them out, unless that is "
      "meant",
      one->name, two->name, n[0], one->on.option, n[1], one->to.option));
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A tie, and contact between bodies. */
static PetscErrorCode check_contact(SbModel m, SbEffect tie, SbEffect contact)
{
  PetscInt n[2];

  PetscFunctionBeginUser;
  PetscCall(count_shared(m, &tie->on, &contact->on, &n[0]));
  PetscCall(count_shared(m, &tie->to, &contact->on, &n[1]));
  if (n[0] && n[1])
    PetscCall(SbWarning(
      m->comm,
      "effect %s is contact of surfaces that %s ties (%" PetscInt_FMT " and %" PetscInt_FMT
      " facets): where their gap is small it pushes against the tie, and the forces of both are "
      "larger than what the bodies bear; let -effect_%s_on name the other surfaces",
      contact->name, tie->name, n[0], n[1], contact->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two cavities. */
static PetscErrorCode check_cavities(SbModel m, SbEffect one, SbEffect two)
{
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(count_shared(m, &one->on, &two->on, &n));
  PetscCheck(!n || one->from >= two->until || two->from >= one->until, m->comm,
             PETSC_ERR_USER_INPUT,
             "%s and %s have %" PetscInt_FMT
             " facets in common: one wall cannot be around two fillings; leave one out, or give "
             "each its own wall",
             one->on.option, two->on.option, n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two periodic cells: each holds a place of its body, which would keep the other one from
   straining it. */
static PetscErrorCode check_cells(SbModel m, SbEffect one, SbEffect two)
{
  PetscInt *n, *n2;

  PetscFunctionBeginUser;
  if (one->from >= two->until || two->from >= one->until)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(m->nbody, &n, m->nbody, &n2));
  PetscCall(SbEffectShared(m->space, &one->on, &one->on, n));
  PetscCall(SbEffectShared(m->space, &two->on, &two->on, n2));
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCheck(!n[b] || !n2[b], m->comm, PETSC_ERR_USER_INPUT,
               "effects %s and %s are both periodic, and of the body %s: give one of them all axes "
               "and the whole gradient (-effect_%s_axes, -effect_%s_gradient), and leave the other "
               "one out",
               one->name, two->name, m->body[b].name, one->name, one->name);
  PetscCall(PetscFree2(n, n2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelCheckRepeated(SbModel m)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->neffect; k++) {
    SbEffect one = m->effect[k];

    for (PetscInt l = 0; l < m->neffect; l++) {
      SbEffect two = m->effect[l];

      if (l > k && is(one, "tie") && is(two, "tie"))
        PetscCall(check_ties(m, one, two));
      if (l > k && is(one, "cavity") && is(two, "cavity"))
        PetscCall(check_cavities(m, one, two));
      if (l > k && is(one, "periodic") && is(two, "periodic"))
        PetscCall(check_cells(m, one, two));
      if (is(one, "tie") && two->contact && !SbContactHasObstacle(two->contact))
        PetscCall(check_contact(m, one, two));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
