/*
  select.c - the cells, boundary facets and nodes that the sets named by -effect_<name>_on select on this
  rank.

  The mesh carries one bit per set on vertices, cells and faces. An item in several of the named sets must act
  once: cells are tested against the union of the bits, a facet is taken with the first of its sets, nodes are
  sorted and doubles removed (a node need not be a vertex, so it has no bits of its own).
*/
#include "sbeffect.h"

PetscErrorCode SbEffectReadOn(const SbScope *scope, SbEffectOn *on)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionName(scope, "on", sizeof(on->option), on->option));
  PetscCall(SbOptionNames(scope, "on", &on->n, &on->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectFreeOn(SbEffectOn *on)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(on->name));
  on->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef enum { CELLS, FACETS, NODES } Kind;

/* Numbers k[on->n] of the named sets; an error when one selects nothing of the kind. */
static PetscErrorCode find_sets(SbSpace space, const SbEffectOn *on, Kind kind, PetscInt k[SB_SET_MAX])
{
  const char *const need[] = {"tetrahedra", "boundary facets", "vertices"};
  const char *const hint[] = {
    "take a set that encloses whole tetrahedra, such as a body or a larger box",
    "take a set that contains whole triangles of the surface, such as a thicker plane or box",
    "take a larger set"};

  PetscFunctionBeginUser;
  PetscCheck(on->n || kind == CELLS, space->comm, PETSC_ERR_USER_INPUT,
             "%s: name at least one set, see -sets", on->option);
  PetscCheck(on->n <= SB_SET_MAX, space->comm, PETSC_ERR_USER_INPUT,
             "%s names %" PetscInt_FMT " sets, at most %d can be used", on->option, on->n, SB_SET_MAX);
  for (PetscInt i = 0; i < on->n; i++) {
    const SbSet *set;
    PetscInt count;

    PetscCall(SbSpaceFindSet(space, on->name[i], on->option, &k[i]));
    set = &space->mesh->set[k[i]];
    count = kind == CELLS ? set->ncell : kind == FACETS ? set->nfacet : set->nvert;
    PetscCheck(count, space->comm, PETSC_ERR_USER_INPUT,
               "%s: set %s selects no %s (%" PetscInt_FMT " vertices, %" PetscInt_FMT
               " boundary facets, %" PetscInt_FMT " tetrahedra): %s",
               on->option, set->name, need[kind], set->nvert, set->nfacet, set->ncell, hint[kind]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectFacets(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacet **facets)
{
  SbFacet *list = NULL;
  uint64_t seen = 0;
  PetscInt k[SB_SET_MAX];

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(find_sets(space, on, FACETS, k));
  for (PetscInt i = 0; i < on->n; i++) {
    SbFacet *more;
    PetscInt nmore;

    PetscCall(SbSpaceGetSetFacets(space, k[i], &nmore, &more));
    PetscCall(PetscRealloc((size_t)(*n + nmore + 1) * sizeof(*list), &list));
    for (PetscInt j = 0; j < nmore; j++) {
      if (!(space->mesh->face_set[4 * more[j].cell + more[j].face] & seen)) list[(*n)++] = more[j];
    }
    PetscCall(PetscFree(more));
    seen |= SB_SET_BIT(k[i]);
  }
  *facets = list;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectNodes(SbSpace space, const SbEffectOn *on, PetscInt *n, PetscInt **nodes)
{
  PetscInt *list = NULL, k[SB_SET_MAX];

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(find_sets(space, on, NODES, k));
  for (PetscInt i = 0; i < on->n; i++) {
    PetscInt *more;
    PetscInt nmore;

    PetscCall(SbSpaceGetSetNodes(space, k[i], &nmore, &more));
    PetscCall(PetscRealloc((size_t)(*n + nmore + 1) * sizeof(*list), &list));
    PetscCall(PetscArraycpy(&list[*n], more, nmore));
    PetscCall(PetscFree(more));
    *n += nmore;
  }
  PetscCall(PetscSortRemoveDupsInt(n, list));
  *nodes = list;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectCells(SbSpace space, const SbEffectOn *on, PetscInt *n, PetscInt **cells)
{
  const SbMesh mesh = space->mesh;
  uint64_t mask = 0;
  PetscInt k[SB_SET_MAX];

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(find_sets(space, on, CELLS, k));
  for (PetscInt i = 0; i < on->n; i++) mask |= SB_SET_BIT(k[i]);
  PetscCall(PetscMalloc1(mesh->ncell, cells));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    if (!on->n || (mesh->cell_set[c] & mask)) (*cells)[(*n)++] = c;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
