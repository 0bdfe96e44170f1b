/*
  surface_edges.c - the edges of a distributed surface: own ones, then those between facets of the scene that others own.

  An own edge needs both its facets, which the overlap of the mesh holds: with P1 every cell around an owned vertex is here, so the owner
  of that of its vertices with the lower identity owns the edge; with CR and DG every cell that touches an owned cell is here, so the owner of its first facet
  does. Both are told by identities: each edge has one owner on any partition, which is not always that of a facet. Own edges never
  change; the others are made when the facets of other ranks are other ones. Both facets of an edge that comes near an own one are
  in the scene then, as the near place is in the boxes of both (halo_plan.c).
*/
#include "edge.h"
#include "surface_impl.h"

static inline PetscBool at_vertices(SbSpace space, PetscInt cell)
{
  return (PetscBool)(space->element[space->mesh->cell_body[cell]]->nodes_per[0] > 0);
}

/* Room for n edges. */
static PetscErrorCode reserve(SbContactSurface s, PetscInt n)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const size_t size = (size_t)n + (size_t)n / 8 + 1;

  PetscFunctionBeginUser;
  if (n <= d->edge_size) PetscFunctionReturn(PETSC_SUCCESS);
  d->edge_size = (PetscInt)size;
  PetscCall(PetscRealloc(4 * size * sizeof(PetscInt), &d->edges.corner));
  PetscCall(PetscRealloc(2 * size * sizeof(PetscInt), &d->edges.vertex));
  PetscCall(PetscRealloc(size * sizeof(PetscInt), &d->edges.part));
  PetscCall(PetscRealloc(size * sizeof(PetscInt), &d->edges.id));
  PetscCall(PetscRealloc(size * sizeof(PetscReal), &d->edges.thick));
  PetscCall(PetscRealloc(4 * size * sizeof(PetscInt), &s->edge_node));
  PetscCall(PetscRealloc(8 * size * sizeof(PetscReal), &s->edge_weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ own edges */

/* Sides of facets of owned and ghost cells; with P1 only those whose edge is an own one. */
static PetscInt list_sides(SbContactSurface s, const SbFacet facet[], SbSide side[])
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbSpace space = s->space;
  PetscInt n = 0;

  for (PetscInt i = 0; i < 3 * d->nlocal; i++) {
    const SbFacet *f = &facet[i / 3];
    PetscInt vertex[3];

    for (int k = 0; k < 3; k++) vertex[k] = space->mesh->vert_orig[f->vertex[k]];
    SbSideSet(vertex, space->mesh->cell_body[f->cell], 4 * space->mesh->cell_orig[f->cell] + f->face, i,
              side + n);
    if (at_vertices(space, f->cell)) {
      const PetscInt k = side[n].forward ? i % 3 : (i + 1) % 3;

      if (space->cell_node[4 * f->cell + f->corner[k]] >= space->nnode_owned) continue;
    }
    n++;
  }
  return n;
}

static PetscInt face_node(SbSpace space, const SbFacet *f)
{
  return space->gnode[space->cell_node[4 * f->cell + f->face]];
}

/* What own edges are, but for their corners. */
static void fill_own(SbContactSurface s, const SbFacet facet[])
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbSpace space = s->space;
  const SbEdges *e = &d->edges;

  for (PetscInt i = 0; i < e->nown; i++) {
    const SbFacet *f = &facet[d->side[i][0] / 3];

    s->edge_facet[i] = d->side[i][0] / 3;
    e->thick[i] = PetscMin(f->height, facet[d->side[i][1] / 3].height);
    e->part[i] = space->mesh->cell_body[f->cell];
    e->id[i] = 3 * (4 * space->mesh->cell_orig[f->cell] + f->face) + d->side[i][0] % 3;
    for (int a = 0; a < 4; a++) s->edge_node[4 * i + a] = space->gnode[space->cell_node[4 * f->cell + a]];
    for (int j = 0; j < 2; j++) {
      const PetscInt k = (d->side[i][0] + j) % 3;
      const PetscReal *weight = SbSpaceCellElement(space, f->cell)->ops.vertex[f->corner[k]];

      e->vertex[2 * i + j] = space->mesh->vert_orig[f->vertex[k]];
      s->edge_carrier[2 * i + j] = at_vertices(space, f->cell)
                                     ? space->gnode[space->cell_node[4 * f->cell + f->corner[k]]]
                                     : face_node(space, &facet[d->side[i][j] / 3]);
      for (int a = 0; a < 4; a++) s->edge_weight[8 * i + 4 * j + a] = weight[a];
    }
  }
}

/* Sides of own facets whose edge others own, if it is one; identities of own edges, ascending. */
static PetscErrorCode list_open(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const PetscInt n = 3 * s->nfacet_owned;
  PetscBool *known;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(n, &known));
  for (PetscInt i = 0; i < 2 * d->edges.nown; i++) {
    const PetscInt at = d->side[i / 2][i % 2], own = d->local[at / 3].own;

    if (own >= 0) known[3 * own + at % 3] = PETSC_TRUE;
  }
  PetscCall(PetscMalloc1(n, &d->open));
  for (PetscInt i = 0; i < n; i++) {
    if (!known[i]) d->open[d->nopen++] = i;
  }
  PetscCall(PetscFree(known));
  PetscCall(PetscMalloc1(d->edges.nown, &d->own_id));
  PetscCall(PetscArraycpy(d->own_id, d->edges.id, d->edges.nown));
  PetscCall(PetscSortInt(d->edges.nown, d->own_id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceOwnEdges(SbContactSurface s, const SbFacet facet[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  PetscInt n, kept = 0;
  SbSide *side;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * d->nlocal, &side));
  n = list_sides(s, facet, side);
  PetscCall(PetscMalloc1(n / 2, &d->side));
  PetscCall(SbSidesPair(n, side, &n, d->side));
  PetscCall(PetscFree(side));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt first = d->side[i][0] / 3;

    if (!at_vertices(s->space, facet[first].cell) && d->local[first].own < 0) continue;
    d->side[kept][0] = d->side[i][0];
    d->side[kept++][1] = d->side[i][1];
  }
  d->edges.n = d->edges.nown = kept;
  PetscCall(reserve(s, kept));
  PetscCall(PetscMalloc1(kept, &s->edge_facet));
  PetscCall(PetscMalloc1(2 * kept, &s->edge_carrier));
  fill_own(s, facet);
  PetscCall(list_open(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the others */

/* What the edge between two sides of facets of the scene is. */
static void fill_other(SbContactSurface s, const PetscInt at[2], PetscInt i)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbEdges *e = &d->edges;
  const PetscInt f = at[0] / 3;

  e->part[i] = d->facet_part[f];
  e->id[i] = 3 * d->facet_id[f] + at[0] % 3;
  e->thick[i] = PetscMin(s->facet_height[f], s->facet_height[at[1] / 3]);
  for (int j = 0; j < 3; j++) e->corner[4 * i + j] = d->facet[3 * f + (at[0] + j) % 3];
  e->corner[4 * i + 3] = d->facet[at[1] - at[1] % 3 + (at[1] + 2) % 3];
  for (int a = 0; a < 4; a++) s->edge_node[4 * i + a] = s->facet_node[4 * f + a];
  for (int j = 0; j < 2; j++) {
    const PetscInt k = (at[0] + j) % 3;

    e->vertex[2 * i + j] = d->facet_vertex[3 * f + k];
    for (int a = 0; a < 4; a++) s->edge_weight[8 * i + 4 * j + a] = s->facet_weight[12 * f + 4 * k + a];
  }
}

PetscErrorCode SbContactSurfaceOtherEdges(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const PetscInt most = d->nopen + 3 * (s->scene.nfacet - s->nfacet_owned);
  PetscInt n, (*pair)[2];
  SbSide *side;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(most, &side, most / 2 + 1, &pair));
  for (PetscInt i = 0; i < most; i++) {
    const PetscInt at = i < d->nopen ? d->open[i] : 3 * s->nfacet_owned + i - d->nopen, f = at / 3;

    SbSideSet(d->facet_vertex + 3 * f, d->facet_part[f], d->facet_id[f], at, side + i);
  }
  PetscCall(SbSidesPair(most, side, &n, pair));
  PetscCall(reserve(s, d->edges.nown + n));
  d->edges.n = d->edges.nown;
  for (PetscInt i = 0; i < n; i++) {
    PetscInt place;

    fill_other(s, pair[i], d->edges.n);
    PetscCall(PetscFindInt(d->edges.id[d->edges.n], d->edges.nown, d->own_id, &place));
    if (place < 0) d->edges.n++;
  }
  PetscCall(PetscFree2(side, pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceFreeEdges(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(d->side));
  PetscCall(PetscFree(d->open));
  PetscCall(PetscFree(d->own_id));
  PetscCall(PetscFree(d->edges.corner));
  PetscCall(PetscFree(d->edges.vertex));
  PetscCall(PetscFree(d->edges.part));
  PetscCall(PetscFree(d->edges.id));
  PetscCall(PetscFree(d->edges.thick));
  PetscCall(PetscFree(s->edge_node));
  PetscCall(PetscFree(s->edge_weight));
  PetscCall(PetscFree(s->edge_facet));
  PetscCall(PetscFree(s->edge_carrier));
  PetscFunctionReturn(PETSC_SUCCESS);
}
