/*
  select.c - the cells, boundary facets and nodes that the sets named by -effect_<name>_on select
  here.

  The mesh carries one bit per set on vertices, cells and faces, the space on nodes. An item in
  several of the named sets acts once: they are tested against the union of the bits, facets taken
  with their first set.

  Nodes of P1 bodies are vertices; those of CR and DG lie at faces. A set that holds a corner or an
  edge of such a body holds none of its nodes. Ignoring it would silently drop a constraint, so it
  is an error. A rigid body is in a set as a whole, or its nodes are not.
*/
#include "effect_impl.h"

/* Numbers k[on->n] of the named sets, and the union of their bits; an error when one selects
   nothing. */
static PetscErrorCode find_sets(SbSpace space, const SbEffectOn *on, SbOnKind kind,
                                PetscInt k[SB_SET_MAX], uint64_t *mask)
{
  const char *const need[] = {"tetrahedra", "vertices", "vertices", "boundary facets"};
  const char *const hint[] = {
    "take a set that encloses whole tetrahedra, such as a body or a larger box",
    "take a larger set", "take a larger set",
    "take a set that contains whole triangles of the surface, such as a thicker plane or box"};

  PetscFunctionBeginUser;
  PetscCheck(on->n || kind == SB_ON_CELLS, space->comm, PETSC_ERR_USER_INPUT,
             "%s: name at least one set, see -sets", on->option);
  PetscCheck(on->n <= SB_SET_MAX, space->comm, PETSC_ERR_USER_INPUT,
             "%s names %" PetscInt_FMT " sets, at most %d can be used", on->option, on->n,
             SB_SET_MAX);
  *mask = 0;
  for (PetscInt i = 0; i < on->n; i++) {
    const SbSet *set;
    PetscInt found;

    PetscCall(SbSpaceFindSet(space, on->name[i], on->option, &k[i]));
    set = &space->mesh->set[k[i]];
    if (kind == SB_ON_CELLS)
      found = set->ncell;
    else
      found = kind == SB_ON_FACETS ? set->nfacet : set->nvert;
    PetscCheck(found, space->comm, PETSC_ERR_USER_INPUT,
               "%s: set %s selects no %s (%" PetscInt_FMT " vertices, %" PetscInt_FMT
               " boundary facets, %" PetscInt_FMT " tetrahedra): %s",
               on->option, set->name, need[kind], set->nvert, set->nfacet, set->ncell, hint[kind]);
    *mask |= SB_SET_BIT(k[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectFacets(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacet **facets)
{
  PetscInt k[SB_SET_MAX];
  PetscInt size = 0;
  uint64_t seen = 0;
  uint64_t mask;

  PetscFunctionBeginUser;
  *n = 0;
  *facets = NULL;
  PetscCall(find_sets(space, on, SB_ON_FACETS, k, &mask));
  for (PetscInt i = 0; i < on->n; i++) {
    SbFacet *more;
    PetscInt nmore;

    PetscCall(SbSpaceGetSetFacets(space, k[i], &nmore, &more));
    PetscCall(SbReserve(*n + nmore, sizeof(**facets), &size, facets));
    for (PetscInt j = 0; j < nmore; j++)
      if (!(space->mesh->face_set[4 * more[j].cell + more[j].face] & seen))
        (*facets)[(*n)++] = more[j];
    PetscCall(PetscFree(more));
    seen |= SB_SET_BIT(k[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* place[n]: 4 cell + face of the facets of owned cells, sorted; the caller frees. */
static PetscErrorCode find_places(SbSpace s, const SbEffectOn *on, PetscInt *n, PetscInt **place)
{
  SbFacet *facet;
  PetscInt all;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(s, on, &all, &facet));
  PetscCall(PetscMalloc1(all, place));
  *n = 0;
  for (PetscInt i = 0; i < all; i++)
    if (facet[i].cell < s->mesh->ncell_owned)
      (*place)[(*n)++] = 4 * facet[i].cell + facet[i].face;
  PetscCall(PetscSortInt(*n, *place));
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectShared(SbSpace s, const SbEffectOn *one, const SbEffectOn *two,
                              PetscInt shared[])
{
  const SbEffectOn *const on[2] = {one, two};
  PetscInt n[2], *place[2];

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(shared, s->mesh->nbody));
  for (int k = 0; k < 2; k++)
    PetscCall(find_places(s, on[k], &n[k], &place[k]));
  for (PetscInt i = 0, j = 0; i < n[0] && j < n[1];) {
    if (place[0][i] == place[1][j])
      shared[s->mesh->cell_body[place[0][i] / 4]]++;
    if (place[0][i] <= place[1][j])
      i++;
    else
      j++;
  }
  for (int k = 0; k < 2; k++)
    PetscCall(PetscFree(place[k]));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, shared, (PetscMPIInt)s->mesh->nbody, MPIU_INT, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body with nodes at faces that has vertices in the sets must have nodes there. Collective. */
static PetscErrorCode check_nodes(SbSpace space, const SbEffectOn *on, uint64_t mask)
{
  const SbMesh mesh = space->mesh;
  PetscInt *count; /* vertices and nodes of each body */
  PetscInt b = 0;
  PetscInt nvert;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(2 * mesh->nbody, &count));
  for (PetscInt v = 0; v < mesh->nvert_owned; v++)
    count[2 * mesh->vert_body[v]] += !!(mesh->vert_set[v] & mask);
  for (PetscInt i = 0; i < space->nnode_owned; i++)
    count[2 * space->node_body[i] + 1] += !!(space->node_set[i] & mask);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)(2 * mesh->nbody), MPIU_INT, MPI_SUM,
                             space->comm));
  while (b < mesh->nbody && (!count[2 * b] || count[2 * b + 1]))
    b++;
  nvert = b < mesh->nbody ? count[2 * b] : 0;
  PetscCall(PetscFree(count));
  PetscCheck(
    !nvert || !space->element[b]->rigid, space->comm, PETSC_ERR_USER_INPUT,
    "%s selects %" PetscInt_FMT " vertices of body %s, which is rigid and is supported as "
    "a whole: take the body, or a set with all of its surface; foundations and springs hold "
    "parts",
    on->option, nvert, mesh->body[b].name);
  PetscCheck(!nvert, space->comm, PETSC_ERR_USER_INPUT,
             "%s selects %" PetscInt_FMT " vertices of body %s but none of its triangles, where "
             "element %s has its nodes: take a set that "
             "contains whole triangles, such as a thicker plane or box",
             on->option, nvert, mesh->body[b].name, space->element[b]->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectItems(SbSpace space, const SbEffectOn *on, SbOnKind kind, PetscInt *n,
                             PetscInt **items)
{
  const PetscInt count[] = {space->mesh->ncell, space->mesh->nvert, space->nnode};
  const uint64_t *const sets[] = {space->mesh->cell_set, space->mesh->vert_set, space->node_set};
  PetscInt k[SB_SET_MAX];
  uint64_t mask;

  PetscFunctionBeginUser;
  PetscCall(find_sets(space, on, kind, k, &mask));
  if (kind == SB_ON_NODES && (space->faces || space->rigid))
    PetscCall(check_nodes(space, on, mask));
  *n = 0;
  PetscCall(PetscMalloc1(count[kind], items));
  for (PetscInt i = 0; i < count[kind]; i++)
    if (!on->n || sets[kind][i] & mask)
      (*items)[(*n)++] = i;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectBodies(SbSpace space, const SbEffectOn *on, PetscBool in[])
{
  const SbMesh mesh = space->mesh;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    in[b] = (PetscBool)!on->n;
  for (PetscInt i = 0; i < on->n; i++) {
    PetscInt b = 0;

    while (b < mesh->nbody && strcmp(mesh->body[b].name, on->name[i]))
      b++;

    /* an error with the nearest names where there is no such body */
    if (b == mesh->nbody) {
      const char **names;
      char near[512];

      PetscCall(PetscMalloc1(mesh->nbody, &names));
      for (b = 0; b < mesh->nbody; b++)
        names[b] = mesh->body[b].name;
      SbSuggestNames(on->name[i], mesh->nbody, names, sizeof(near), near);
      PetscCall(PetscFree(names));
      SETERRQ(mesh->comm, PETSC_ERR_USER_INPUT,
              "%s: there is no body %s%s%s; this effect acts on bodies, see -bodies", on->option,
              on->name[i], near[0] ? "; did you mean " : "", near);
    }
    in[b] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
