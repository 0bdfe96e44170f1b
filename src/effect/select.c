/*
  select.c - the cells, boundary facets and nodes that the sets named by -effect_<name>_on select on this rank.

  The mesh carries one bit per set on vertices, cells and faces. An item in several of the named sets must act once:
  cells are tested against the union of the bits, a facet is taken with the first of its sets, nodes are sorted and
  doubles removed (a node need not be a vertex, so it has no bits of its own).
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

/* Number of the i-th set of `on`; an error when it selects nothing of the kind. */
static PetscErrorCode find_set(SbSpace space, const SbEffectOn *on, PetscInt i, Kind kind, PetscInt *k)
{
  const char *const need[] = {"tetrahedra", "boundary facets", "vertices"};
  const char *const hint[] = {"choose a set that encloses whole tetrahedra, such as a body or a larger box",
                              "choose a set that contains whole triangles of the surface, such as a thicker plane or box",
                              "choose a larger set"};
  const SbSet      *set;
  PetscInt          count;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceFindSet(space, on->name[i], on->option, k));
  set   = &space->mesh->set[*k];
  count = kind == CELLS ? set->ncell : kind == FACETS ? set->nfacet : set->nvert;
  PetscCheck(count, space->comm, PETSC_ERR_USER_INPUT,
             "%s: set %s selects no %s (%" PetscInt_FMT " vertices, %" PetscInt_FMT " boundary facets, %" PetscInt_FMT
             " tetrahedra): %s",
             on->option, set->name, need[kind], set->nvert, set->nfacet, set->ncell, hint[kind]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode need_sets(SbSpace space, const SbEffectOn *on)
{
  PetscFunctionBeginUser;
  PetscCheck(on->n, space->comm, PETSC_ERR_USER_INPUT, "%s: name at least one set (see -sets)", on->option);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectFacets(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacet **facets)
{
  SbFacet *list = NULL;
  uint64_t seen = 0;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(need_sets(space, on));
  for (PetscInt i = 0; i < on->n; i++) {
    SbFacet *more;
    PetscInt k, nmore;

    PetscCall(find_set(space, on, i, FACETS, &k));
    PetscCall(SbSpaceGetSetFacets(space, k, &nmore, &more));
    PetscCall(PetscRealloc((size_t)(*n + nmore + 1) * sizeof(*list), &list));
    for (PetscInt j = 0; j < nmore; j++) {
      if (!(space->mesh->face_set[4 * more[j].cell + more[j].face] & seen)) list[(*n)++] = more[j];
    }
    PetscCall(PetscFree(more));
    seen |= SB_SET_BIT(k);
  }
  *facets = list;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectNodes(SbSpace space, const SbEffectOn *on, PetscInt *n, PetscInt **nodes)
{
  PetscInt *list = NULL;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(need_sets(space, on));
  for (PetscInt i = 0; i < on->n; i++) {
    PetscInt *more;
    PetscInt  k, nmore;

    PetscCall(find_set(space, on, i, NODES, &k));
    PetscCall(SbSpaceGetSetNodes(space, k, &nmore, &more));
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
  uint64_t     mask = 0;

  PetscFunctionBeginUser;
  *n = 0;
  for (PetscInt i = 0; i < on->n; i++) {
    PetscInt k;

    PetscCall(find_set(space, on, i, CELLS, &k));
    mask |= SB_SET_BIT(k);
  }
  PetscCall(PetscMalloc1(mesh->ncell, cells));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    if (!on->n || (mesh->cell_set[c] & mask)) (*cells)[(*n)++] = c;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
