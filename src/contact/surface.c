/*
  surface.c - the surface of bodies as corners, facets and points of this rank.

  Own facets are those of owned cells. Their corners: with P1 the vertices, each once; with CR and DG the displacement jumps from
  facet to facet, so each facet has three corners of its own, u = sum_a phi_a(vertex) u_a. Identities come from the numbers that no
  partition changes: 4 cell_orig + face for a facet, vert_orig for a vertex, node_orig for a point.

  Points are the owned nodes that carry the surface: vertices of P1, also those whose facets all belong to ghost cells, and
  centroids of boundary faces of CR and DG. The overlap of the mesh holds every facet around an owned vertex, so areas and normals
  are complete without communication. Around a vertex facets are summed in the order of their identities: the normal is
  the same to the last bit on any number of ranks. A normal is zero where the facets around a point cancel.

  Facets of other ranks, which follow the own ones, are the work of halo.c; edges that of surface_edges.c.
*/
#include "surface_impl.h"
#include "sblog.h"

void SbContactSurfacePosition(SbSpace space, PetscInt at, const PetscReal u[], PetscReal x[3])
{
  const PetscInt cell = at / 4, *node = space->cell_node + 4 * cell;
  const PetscReal *weight = SbSpaceCellElement(space, cell)->ops.vertex[at % 4],
                  *X = space->mesh->x + 3 * space->mesh->cell[at];

  for (int i = 0; i < 3; i++) x[i] = X[i];
  for (int a = 0; a < 4; a++) {
    if (weight[a] == 0) continue;
    for (int i = 0; i < 3; i++) x[i] += weight[a] * u[3 * node[a] + i];
  }
}

static inline PetscBool at_vertices(SbSpace space, PetscInt cell)
{
  return (PetscBool)(space->element[space->mesh->cell_body[cell]]->nodes_per[0] > 0);
}

/* ------------------------------------------------------------------ set-up */

/* Facets of owned and ghost cells; numbers of the vertices on them. */
static PetscErrorCode list_local(SbContactSurface s, PetscInt n, const SbFacet facet[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const SbMesh mesh = s->space->mesh;
  PetscInt *slot;

  PetscFunctionBeginUser;
  d->nlocal = n;
  PetscCall(PetscMalloc1(n, &d->local));
  PetscCall(PetscMalloc1(mesh->nvert, &slot));
  for (PetscInt v = 0; v < mesh->nvert; v++) slot[v] = -1;
  for (PetscInt i = 0; i < n; i++) {
    for (int k = 0; k < 3; k++) {
      const PetscInt at = 4 * facet[i].cell + facet[i].corner[k], v = mesh->cell[at];

      if (slot[v] < 0) slot[v] = d->nvertex++;
      d->local[i].at[k] = at;
      d->local[i].vertex[k] = slot[v];
    }
    d->local[i].own = facet[i].cell < mesh->ncell_owned ? s->nfacet_owned++ : -1;
  }
  PetscCall(PetscFree(slot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of vertex k of a local facet among own corners, a new one when it is none yet. */
static PetscInt corner_of(SbContactSurface s, PetscInt corner[], PetscInt facet, int k)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const SbContactSurfaceFacet *f = &d->local[facet];
  const PetscInt cell = f->at[0] / 4;
  PetscInt c = at_vertices(s->space, cell) ? corner[f->vertex[k]] : -1;

  if (c < 0) {
    c = corner[f->vertex[k]] = d->ncorner_owned++;
    d->corner_at[c] = f->at[k];
    d->corner_part[c] = s->space->mesh->cell_body[cell];
  }
  return c;
}

/*
  Corners of own facets: a vertex of P1 once, others for each facet. Fills facet[]. Behind them what else own edges need: corners of
  facets of ghost cells.
*/
static PetscErrorCode make_corners(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const SbMesh mesh = s->space->mesh;
  PetscInt *corner;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(d->nvertex, &corner));
  PetscCall(PetscMalloc2(3 * s->nfacet_owned + 4 * d->edges.nown, &d->corner_at,
                         3 * s->nfacet_owned + 4 * d->edges.nown, &d->corner_part));
  for (PetscInt v = 0; v < d->nvertex; v++) corner[v] = -1;
  for (PetscInt i = 0; i < d->nlocal; i++) {
    const PetscInt own = d->local[i].own;

    for (int k = 0; k < 3 && own >= 0; k++) d->facet[3 * own + k] = corner_of(s, corner, i, k);
  }
  for (PetscInt i = 0; i < 4 * d->edges.nown; i++) {
    const PetscInt at = d->side[i / 4][i % 4 == 3], facet = at / 3, own = d->local[facet].own;
    const int k = (int)((at + (i % 4 == 3 ? 2 : i % 4)) % 3);

    d->edges.corner[i] = own >= 0 ? d->facet[3 * own + k] : corner_of(s, corner, facet, k);
  }
  PetscCall(PetscFree(corner));
  PetscCall(PetscMalloc1(3 * d->ncorner_owned, &d->x));
  PetscCall(PetscMalloc1(3 * d->ncorner_owned, &d->x0));
  PetscCall(PetscMalloc1(3 * d->ncorner_owned, &d->X));
  for (PetscInt c = 0; c < d->ncorner_owned; c++) {
    for (int i = 0; i < 3; i++) d->X[3 * c + i] = mesh->x[3 * mesh->cell[d->corner_at[c]] + i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Identities, nodes and weights of own facets. */
static PetscErrorCode make_facets(SbContactSurface s, const SbFacet facet[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const SbSpace space = s->space;
  const SbMesh mesh = space->mesh;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * s->nfacet_owned, &d->facet));
  PetscCall(PetscMalloc1(3 * s->nfacet_owned, &d->facet_vertex));
  PetscCall(PetscMalloc1(s->nfacet_owned, &d->facet_part));
  PetscCall(PetscMalloc1(s->nfacet_owned, &d->facet_id));
  PetscCall(PetscMalloc1(4 * s->nfacet_owned, &s->facet_node));
  PetscCall(PetscMalloc1(12 * s->nfacet_owned, &s->facet_weight));
  PetscCall(PetscMalloc1(s->nfacet_owned, &s->facet_height));
  for (PetscInt i = 0; i < d->nlocal; i++) {
    const PetscInt f = d->local[i].own, cell = facet[i].cell;

    if (f < 0) continue;
    d->facet_part[f] = mesh->cell_body[cell];
    d->facet_id[f] = 4 * mesh->cell_orig[cell] + facet[i].face;
    s->facet_height[f] = facet[i].height;
    for (int a = 0; a < 4; a++) s->facet_node[4 * f + a] = space->gnode[space->cell_node[4 * cell + a]];
    for (int k = 0; k < 3; k++) {
      const PetscReal *weight = SbSpaceCellElement(space, cell)->ops.vertex[facet[i].corner[k]];

      d->facet_vertex[3 * f + k] = mesh->vert_orig[facet[i].vertex[k]];
      for (int a = 0; a < 4; a++) s->facet_weight[12 * f + 4 * k + a] = weight[a];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The local node of corner k of a facet with P1, of the facet itself with CR and DG. */
static inline PetscInt carrier(SbSpace space, const SbFacet *f, int k)
{
  return space->cell_node[4 * f->cell + (at_vertices(space, f->cell) ? f->corner[k] : f->face)];
}

/* Owned nodes that carry the surface, ascending; point[nnode_owned] gets their numbers, -1 elsewhere. */
static PetscErrorCode make_points(SbContactSurface s, const SbFacet facet[], PetscInt point[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const SbSpace space = s->space;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < space->nnode_owned; i++) point[i] = -1;
  for (PetscInt i = 0; i < 3 * d->nlocal; i++) {
    const PetscInt node = carrier(space, &facet[i / 3], i % 3);

    if (node < space->nnode_owned) point[node] = 0;
  }
  for (PetscInt i = 0; i < space->nnode_owned; i++) n += point[i] == 0;
  s->scene.npoint = n;
  PetscCall(PetscMalloc4(3 * n, &d->p, 3 * n, &d->p0, 3 * n, &d->P, 3 * n, &d->p_normal));
  PetscCall(PetscMalloc5(n, &d->point_part, n, &d->point_id, n, &d->point_vertex, n, &d->point_facet, n,
                         &d->point_own));
  PetscCall(PetscMalloc1(n, &s->point_node));
  PetscCall(PetscCalloc1(n, &s->point_area));
  n = 0;
  for (PetscInt i = 0; i < space->nnode_owned; i++) {
    if (point[i] < 0) continue;
    s->point_node[n] = i;
    d->point_part[n] = space->node_body[i];
    d->point_id[n] = d->point_vertex[n] = space->node_orig[i];
    d->point_facet[n] = d->point_own[n] = -1;
    for (int k = 0; k < 3; k++) d->P[3 * n + k] = space->node_x[3 * i + k];
    point[i] = n++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A P1 facet around an owned point. */
static void add_fan(SbContactSurface s, const SbFacet *f, const PetscInt point[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbContactSurfaceFan fan;
  PetscBool mine = PETSC_FALSE;

  for (int k = 0; k < 3; k++) {
    fan.node[k] = carrier(s->space, f, k);
    fan.point[k] = fan.node[k] < s->space->nnode_owned ? point[fan.node[k]] : -1;
    if (fan.point[k] < 0) continue;
    mine = PETSC_TRUE;
    s->point_area[fan.point[k]] += f->area / 3;
  }
  if (mine) d->fan[d->nfan++] = fan;
}

/* What areas and normals of points are made of, in the order of the facets' identities. */
static PetscErrorCode make_fans(SbContactSurface s, const SbFacet facet[], const PetscInt point[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  const SbSpace space = s->space;
  PetscInt *id, *order;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(d->nlocal, &id, d->nlocal, &order));
  PetscCall(PetscMalloc1(d->nlocal, &d->fan));
  for (PetscInt i = 0; i < d->nlocal; i++) {
    id[i] = 4 * space->mesh->cell_orig[facet[i].cell] + facet[i].face;
    order[i] = i;
  }
  PetscCall(PetscSortIntWithArray(d->nlocal, id, order));
  for (PetscInt i = 0; i < d->nlocal; i++) {
    const SbFacet *f = &facet[order[i]];
    const PetscInt node = carrier(space, f, 0);

    if (at_vertices(space, f->cell)) {
      add_fan(s, f, point);
    } else if (node < space->nnode_owned) {
      PetscAssert(d->local[order[i]].own >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                  "Node %" PetscInt_FMT " on the surface is owned here and its cell is not", node);
      s->point_area[point[node]] = f->area;
      d->point_facet[point[node]] = id[i];
      d->point_vertex[point[node]] = -1;
      d->point_own[point[node]] = d->local[order[i]].own;
    }
  }
  PetscCall(PetscFree2(id, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Size of the bodies and mean edge of all facets at rest. */
static PetscErrorCode measure(SbContactSurface s)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbMesh mesh = s->space->mesh;
  PetscReal box[3] = {0}, sum[2] = {0, 3 * (PetscReal)s->nfacet_owned}, e[3];

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    for (int k = 0; k < 3; k++) box[k] = PetscMax(box[k], mesh->body[b].bbox[3 + k] - mesh->body[b].bbox[k]);
  }
  s->size = PetscSqrtReal(SbDot3(box, box));
  for (PetscInt i = 0; i < 3 * s->nfacet_owned; i++) {
    const PetscReal *a = d->X + 3 * d->facet[i], *b = d->X + 3 * d->facet[3 * (i / 3) + (i + 1) % 3];

    for (int k = 0; k < 3; k++) e[k] = b[k] - a[k];
    sum[0] += PetscSqrtReal(SbDot3(e, e));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, s->space->comm));
  s->edge = sum[1] > 0 ? sum[0] / sum[1] : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lends the arrays to the scene. */
static void publish(SbContactSurface s)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  SbDetectScene *scene = &s->scene;

  scene->x = d->x;
  scene->X = d->X;
  scene->facet = d->facet;
  scene->facet_vertex = d->facet_vertex;
  scene->facet_part = d->facet_part;
  scene->facet_id = d->facet_id;
  scene->p = d->p;
  scene->P = d->P;
  scene->p_normal = d->p_normal;
  scene->point_part = d->point_part;
  scene->point_id = d->point_id;
  scene->point_vertex = d->point_vertex;
  scene->point_facet = d->point_facet;
  scene->edges = &d->edges;
}

PetscErrorCode SbContactSurfaceSetForeign(SbContactSurface s, PetscInt n)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;

  PetscFunctionBeginUser;
  if (n > d->foreign_size) {
    const size_t more = (size_t)n + (size_t)n / 8, nfacet = (size_t)s->nfacet_owned + more,
                 ncorner = (size_t)d->ncorner_owned + 3 * more;

    d->foreign_size = (PetscInt)more;
    PetscCall(PetscRealloc(3 * ncorner * sizeof(*d->x), &d->x));
    PetscCall(PetscRealloc(3 * ncorner * sizeof(*d->x0), &d->x0));
    PetscCall(PetscRealloc(3 * ncorner * sizeof(*d->X), &d->X));
    PetscCall(PetscRealloc(3 * nfacet * sizeof(*d->facet), &d->facet));
    PetscCall(PetscRealloc(3 * nfacet * sizeof(*d->facet_vertex), &d->facet_vertex));
    PetscCall(PetscRealloc(nfacet * sizeof(*d->facet_part), &d->facet_part));
    PetscCall(PetscRealloc(nfacet * sizeof(*d->facet_id), &d->facet_id));
    PetscCall(PetscRealloc(4 * nfacet * sizeof(*s->facet_node), &s->facet_node));
    PetscCall(PetscRealloc(12 * nfacet * sizeof(*s->facet_weight), &s->facet_weight));
    PetscCall(PetscRealloc(nfacet * sizeof(*s->facet_height), &s->facet_height));
  }
  s->scene.nfacet = s->nfacet_owned + n;
  s->scene.ncorner = d->ncorner_owned + 3 * n;
  publish(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceCreate(SbSpace space, PetscInt n, const SbFacet facet[],
                                      SbContactSurface *surface)
{
  SbContactSurface s;
  SbContactSurfaceData *d;
  PetscInt *point;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  PetscCall(PetscNew(&d));
  s->data = d;
  s->space = space;
  s->scene.version = 1;
  d->npart = space->mesh->nbody;
  PetscCall(list_local(s, n, facet));
  PetscCall(make_facets(s, facet));
  PetscCall(SbContactSurfaceOwnEdges(s, facet));
  PetscCall(make_corners(s));
  PetscCall(PetscMalloc1(space->nnode_owned, &point));
  PetscCall(make_points(s, facet, point));
  PetscCall(make_fans(s, facet, point));
  PetscCall(PetscFree(point));
  PetscCall(measure(s));
  PetscCall(SbContactSurfaceSetForeign(s, 0));
  PetscCall(SbContactSurfaceOtherEdges(s));
  PetscCall(SbHaloCreate(s));
  *surface = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceDestroy(SbContactSurface *surface)
{
  SbContactSurfaceData *d;

  PetscFunctionBeginUser;
  if (!*surface) PetscFunctionReturn(PETSC_SUCCESS);
  d = (SbContactSurfaceData *)(*surface)->data;
  PetscCall(SbHaloDestroy(&d->halo));
  PetscCall(SbContactSurfaceFreeEdges(*surface));
  PetscCall(PetscFree2(d->corner_at, d->corner_part));
  PetscCall(PetscFree(d->local));
  PetscCall(PetscFree(d->fan));
  PetscCall(PetscFree(d->x));
  PetscCall(PetscFree(d->x0));
  PetscCall(PetscFree(d->X));
  PetscCall(PetscFree(d->facet));
  PetscCall(PetscFree(d->facet_vertex));
  PetscCall(PetscFree(d->facet_part));
  PetscCall(PetscFree(d->facet_id));
  PetscCall(PetscFree4(d->p, d->p0, d->P, d->p_normal));
  PetscCall(PetscFree5(d->point_part, d->point_id, d->point_vertex, d->point_facet, d->point_own));
  PetscCall(PetscFree(d));
  PetscCall(PetscFree((*surface)->facet_node));
  PetscCall(PetscFree((*surface)->facet_weight));
  PetscCall(PetscFree((*surface)->facet_height));
  PetscCall(PetscFree((*surface)->point_node));
  PetscCall(PetscFree((*surface)->point_area));
  PetscCall(PetscFree(*surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ motion */

/* Own corners and points at local displacements u. */
static void place_all(SbContactSurface s, const PetscReal u[], PetscReal x[], PetscReal p[])
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;

  for (PetscInt c = 0; c < d->ncorner_owned; c++)
    SbContactSurfacePosition(s->space, d->corner_at[c], u, x + 3 * c);
  for (PetscInt i = 0; i < s->scene.npoint; i++) {
    for (int k = 0; k < 3; k++) p[3 * i + k] = d->P[3 * i + k] + u[3 * s->point_node[i] + k];
  }
}

/* n = twice the area vector of a triangle. */
static inline void area_vector(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3],
                               PetscReal n[3])
{
  PetscReal e1[3], e2[3];

  for (int k = 0; k < 3; k++) {
    e1[k] = b[k] - a[k];
    e2[k] = c[k] - a[k];
  }
  SbCross(e1, e2, n);
}

/* Normals of points: of a vertex from the facets around it, of a centroid that of its facet. */
static void turn_normals(SbContactSurface s, const PetscReal u[])
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  PetscReal n[3], x[3][3];

  for (PetscInt i = 0; i < s->scene.npoint; i++) {
    const PetscInt *c = d->point_own[i] < 0 ? NULL : d->facet + 3 * d->point_own[i];

    for (int k = 0; k < 3; k++) d->p_normal[3 * i + k] = 0;
    if (c) area_vector(d->x + 3 * c[0], d->x + 3 * c[1], d->x + 3 * c[2], d->p_normal + 3 * i);
  }
  for (PetscInt i = 0; i < d->nfan; i++) {
    const SbContactSurfaceFan *f = &d->fan[i];

    for (int k = 0; k < 3; k++) {
      for (int j = 0; j < 3; j++) x[k][j] = s->space->node_x[3 * f->node[k] + j] + u[3 * f->node[k] + j];
    }
    area_vector(x[0], x[1], x[2], n);
    for (int k = 0; k < 3; k++) {
      for (int j = 0; j < 3 && f->point[k] >= 0; j++) d->p_normal[3 * f->point[k] + j] += n[j];
    }
  }
  for (PetscInt i = 0; i < s->scene.npoint; i++) {
    PetscReal *m = d->p_normal + 3 * i;
    const PetscReal length = PetscSqrtReal(SbDot3(m, m));

    for (int k = 0; k < 3 && length > 0; k++) m[k] /= length;
  }
}

PetscErrorCode SbContactSurfaceUpdate(SbContactSurface s, const PetscReal u0[], const PetscReal u[],
                                      PetscReal reach, PetscBool self, PetscBool *close)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  s->scene.reach = reach;
  s->scene.self = self;
  place_all(s, u, d->x, d->p);
  if (u0) {
    place_all(s, u0, d->x0, d->p0);
  } else {
    PetscCall(PetscArraycpy(d->x0, d->x, 3 * d->ncorner_owned));
    PetscCall(PetscArraycpy(d->p0, d->p, 3 * s->scene.npoint));
  }
  turn_normals(s, u);
  PetscCall(SbHaloUpdate(s, u0, u, close));
  s->scene.x0 = u0 ? d->x0 : NULL;
  s->scene.p0 = u0 ? d->p0 : NULL;
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
