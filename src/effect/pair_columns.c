/*
  pair_columns.c - columns of the history for each pair of bodies: contact forces and numbers of contacts.
*/
#include "barrier.h"

#define PAIRS 200 /* most pairs with columns */

static const char *const apart_names[] = {"force_x", "force_y", "force_z", "contacts"};
static const char *const self_names[] = {"normal_force", "contacts"};
#define APART 4 /* columns of two bodies */
#define SELF 2  /* and of one with itself, whose net force is zero */

/* The columns of two bodies, or of one with itself, behind the n that there are. */
static PetscErrorCode name_columns(SbEffect e, SbPairs *p, const char a[], const char b[], PetscInt *n)
{
  const PetscBool apart = (PetscBool)(a != b);

  PetscFunctionBeginUser;
  for (int k = 0; k < (apart ? APART : SELF); k++, (*n)++) {
    char *name = p->text[*n - p->fixed];

    PetscCall(
      PetscSNPrintf(name, sizeof(p->text[0]), "%s_%s_%s", a, b, (apart ? apart_names : self_names)[k]));
    for (PetscInt i = 0; i < *n; i++)
      PetscCheck(strcmp(name, p->column[i]), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
                 "-effect_%s_pairs yes: history.csv would have two columns %s_%s: give a body another name",
                 e->name, e->name, name);
    p->column[*n] = name;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPairsSetUp(SbEffect e, SbMesh mesh, const PetscBool takes_part[], PetscBool self, SbPairs *p)
{
  PetscInt64 npair;
  PetscInt n;

  PetscFunctionBeginUser;
  if (!p->wanted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(mesh->nbody, &p->slot));
  for (PetscInt b = 0; b < mesh->nbody; b++) p->slot[b] = takes_part[b] ? p->nsurface++ : -1;
  npair = (PetscInt64)p->nsurface * (p->nsurface - 1) / 2 + (self ? p->nsurface : 0);
  PetscCheck(npair <= PAIRS, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_pairs yes: the %" PetscInt_FMT " bodies of -effect_%s_on make %" PetscInt64_FMT
             " pairs, more than the %d that history.csv may have columns for: name fewer sets, or use "
             "-output_contacts yes",
             e->name, p->nsurface, e->name, npair, PAIRS);
  n = p->fixed = e->ncolumn;
  PetscCall(PetscMalloc1(n + APART * (PetscInt)npair, &p->column));
  PetscCall(PetscMalloc1(APART * npair, &p->text));
  PetscCall(PetscMalloc1(p->nsurface * p->nsurface, &p->place));
  PetscCall(PetscArraycpy(p->column, e->column, n));
  for (PetscInt a = 0; a < mesh->nbody; a++) {
    for (PetscInt b = a; b < mesh->nbody; b++) {
      if (p->slot[a] < 0 || p->slot[b] < 0 || (a == b && !self)) continue;
      p->place[p->nsurface * p->slot[a] + p->slot[b]] = n;
      PetscCall(name_columns(e, p, mesh->body[a].name, mesh->body[b].name, &n));
    }
  }
  e->column = p->column;
  e->ncolumn = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbPairsAdd(const SbPairs *p, PetscInt first, PetscInt second, PetscReal normal_force,
                const PetscReal force[3], PetscReal values[])
{
  const PetscInt low = PetscMin(first, second), high = PetscMax(first, second);
  PetscReal *at;

  if (!p->wanted) return;
  at = values + p->place[p->nsurface * p->slot[low] + p->slot[high]];
  if (low == high) {
    at[0] += normal_force;
    at[1] += normal_force > 0.;
    return;
  }
  for (int k = 0; k < 3; k++) at[k] += first == high ? force[k] : -force[k];
  at[3] += normal_force > 0.;
}

PetscErrorCode SbPairsFree(SbPairs *p)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(p->slot));
  PetscCall(PetscFree(p->place));
  PetscCall(PetscFree(p->column));
  PetscCall(PetscFree(p->text));
  PetscFunctionReturn(PETSC_SUCCESS);
}
