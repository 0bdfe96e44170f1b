/*
  contact_surface.c - the surfaces of bodies and of an obstacle as vertices, edges and triangles: of
  each rank its own features, to which contact_halo.c adds those of other ranks that may meet them.

  A vertex of a body moves by a weighted mean of nodes: with P1 its own node, of a rigid body its
  four; with CR and DG, whose displacement is discontinuous, the mean over the cells behind the
  facets around it, so that the surface is closed and linear fields are reproduced. A facet of P2 is
  four flat triangles over its six nodes: its corners and the middles of its sides are vertices. The
  rank that owns the vertex in the mesh knows all facets around it (the overlap), makes its list of
  nodes and moves it; a star forest brings its position to the ranks that hold it, too. Numbers
  follow the original ones: nothing depends on the partition.

  The whole surface is on every rank while it is set up, and released then. A rank keeps the
  vertices that have a node of it, the triangles around these, and the edges and vertices of them.

  The obstacle: a sphere is a vertex, a capsule an edge, with a radius. Box, cylinder and mesh are
  triangles. A half-space and a bowl touch vertices only; they are stored as two vertices, a point
  and the tip of the normal there, or as one, the centre.
*/
#include "pairs.h"

/* Points of a facet: its three corners; with P2 the middles of its sides too, 3 + k behind corner
   k. */
static inline PetscInt npoint_of(SbSpace s, const SbFacet *f)
{
  return s->edge_node && s->edge_node[6 * f->cell] >= 0 ? 6 : 3;
}

/* The local node of P2 in the middle of side k of a facet; edges of a tet: 01 02 03 12 13 23. */
static PetscInt middle_of(SbSpace s, const SbFacet *f, PetscInt k)
{
  const int a = f->corner[k];
  const int b = f->corner[(k + 1) % 3];

  return s->edge_node[6 * f->cell + (a && b ? a + b : a + b - 1)];
}

/* Own points are numbered vertices first, then nodes in the middle of sides; -1: another rank's, or
   none. */
static PetscInt own_point(SbSpace s, const SbFacet *f, PetscInt k)
{
  PetscInt node;

  if (k < 3)
    return f->vertex[k] < s->mesh->nvert_owned ? f->vertex[k] : -1;
  if (k >= npoint_of(s, f))
    return -1;
  node = middle_of(s, f, k - 3);
  return node < s->nnode_owned ? s->mesh->nvert_owned + node : -1;
}

/* Records of own vertices, of 7 + 2 count numbers: id, part, count, place, area, then nodes with
   weights. */
static PetscErrorCode list_own(SbContactSurface m, PetscInt n, const SbFacet facet[],
                               PetscInt *size, PetscReal **records)
{
  const SbSpace s = m->space;
  const SbMesh mesh = s->mesh;
  const PetscInt npoint = mesh->nvert_owned + (s->edge_node ? s->nnode_owned : 0);
  PetscInt *key, *start, *ring;
  PetscInt room = 0;

  PetscFunctionBeginUser;

  /* facets around each own point: number 6 facet + point */
  PetscCall(PetscMalloc1(6 * n, &key));
  for (PetscInt i = 0; i < 6 * n; i++)
    key[i] = own_point(s, &facet[i / 6], i % 6);
  PetscCall(SbBucketByKey(6 * n, key, npoint, &start, &ring));
  PetscCall(PetscFree(key));

  *size = 0;
  *records = NULL;
  for (PetscInt p = 0; p < npoint; p++) {
    const PetscInt middle = p - mesh->nvert_owned;
    const PetscInt first = start[p];
    const PetscInt last = start[p + 1];
    const PetscReal *X = middle < 0 ? mesh->x + 3 * p : s->node_x + 3 * middle;
    PetscReal *record, *entry;
    PetscInt nnode = 0;

    if (first == last)
      continue;
    PetscCall(SbReserve(*size + 7 + 8 * (last - first), sizeof(**records), &room, records));
    record = *records + *size;
    entry = record + 7;
    record[0] = (PetscReal)(middle < 0 ? mesh->vert_orig[p] : s->node_orig[middle]);
    record[1] = (PetscReal)(middle < 0 ? mesh->vert_body[p] : s->node_body[middle]);
    for (int i = 0; i < 3; i++)
      record[3 + i] = X[i];
    record[6] = 0.;
    for (PetscInt i = first; i < last; i++) {
      const SbFacet *f = &facet[ring[i] / 6];
      const PetscReal *w;

      /* a third of each triangle around: a facet is one, with P2 four */
      record[6] += f->area / (npoint_of(s, f) == 3 ? 3. : middle < 0 ? 12. : 4.);
      if (middle >= 0)
        continue;
      w = SbSpaceCornerBasis(s, f->cell, f->corner[ring[i] % 6]);
      for (int a = 0; a < 4; a++) {
        const PetscReal g = (PetscReal)s->gnode[s->cell_node[4 * f->cell + a]];
        PetscInt j = 0;

        if (w[a] == 0.)
          continue;
        while (j < nnode && entry[2 * j] != g)
          j++;
        if (j == nnode) {
          entry[2 * nnode] = g;
          entry[2 * nnode++ + 1] = 0.;
        }
        entry[2 * j + 1] += w[a] / (PetscReal)(last - first);
      }
    }
    if (middle >= 0) {
      entry[0] = (PetscReal)s->gnode[middle];
      entry[1] = 1.;
      nnode = 1;
    }
    record[2] = (PetscReal)nnode;
    *size += 7 + 2 * nnode;
  }
  PetscCall(PetscFree(ring));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vertices of all ranks in the order of their numbers, and room for `nobstacle` of the
   obstacle; id[nbody_vertex], their numbers in the mesh, which the caller frees. */
static PetscErrorCode make_vertices(SbContactSurface m, PetscInt n, const SbFacet facet[],
                                    PetscInt nobstacle, PetscInt **id)
{
  const SbSpace s = m->space;
  PetscInt nown = 0;
  PetscInt nall;
  PetscInt nv = 0;
  PetscInt nentry = 0;
  PetscInt *order, *arrival, *before;
  PetscReal *own, *all;

  PetscFunctionBeginUser;
  PetscCall(list_own(m, n, facet, &nown, &own));
  PetscCall(PetscMalloc1(s->size, &before));
  PetscCallMPI(MPI_Allgather(&nown, 1, MPIU_INT, before, 1, MPIU_INT, s->comm));
  PetscCall(SbAllgatherv(s->comm, MPIU_REAL, nown, own, &nall, &all, NULL));
  PetscCall(PetscFree(own));

  /* the order of numbers: vertex order[k] arrives as number k */
  for (PetscInt i = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2], nv++)
    nentry += (PetscInt)all[i + 2];
  m->nbody_vertex = m->Nbody_vertex = nv;
  m->nvertex = nv + nobstacle;
  PetscCall(SbContactSurfaceRoom(m, m->nvertex, nentry, 0, 0));
  PetscCall(PetscMalloc1(nv, id));
  PetscCall(PetscMalloc2(nv, &arrival, nv, &order));
  for (PetscInt i = 0, k = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2], k++) {
    (*id)[k] = (PetscInt)all[i];
    arrival[k] = k;
  }
  PetscCall(PetscSortIntWithArray(nv, *id, arrival));
  for (PetscInt v = 0; v < nv; v++)
    order[arrival[v]] = v;

  /* their records in that order */
  m->start[0] = 0;
  for (PetscInt i = 0, k = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2], k++)
    m->start[order[k] + 1] = (PetscInt)all[i + 2];
  for (PetscInt v = 0; v < nv; v++)
    m->start[v + 1] += m->start[v];
  for (PetscInt i = 0, k = 0, rank = 0, next = before[0]; i < nall;
       i += 7 + 2 * (PetscInt)all[i + 2], k++) {
    const PetscInt v = order[k];
    const PetscInt start = m->start[v];
    const PetscInt count = m->start[v + 1] - start;

    while (i >= next)
      next += before[++rank];
    m->remote[v] = (PetscSFNode){.rank = rank, .index = v};
    m->own[v] = rank == s->rank;
    m->driven[v] = 0;
    m->part[v] = (PetscInt)all[i + 1];
    PetscCall(PetscArraycpy(m->X + 3 * v, all + i + 3, 3));
    m->area[v] = all[i + 6];
    for (PetscInt e = 0; e < count; e++) {
      m->gnode[start + e] = (PetscInt)all[i + 7 + 2 * e];
      m->weight[start + e] = all[i + 8 + 2 * e];
      m->fixed[start + e] = 0;
    }
    PetscCall(PetscSortIntWithScalarArray(count, m->gnode + start, m->weight + start));
    PetscCall(SbContactSurfaceFindNodes(m, v));
  }
  for (PetscInt v = 0; v < m->nvertex; v++)
    m->number[v] = v;
  PetscCall(PetscFree(all));
  PetscCall(PetscFree(before));
  PetscCall(PetscFree2(arrival, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The triangles of all ranks, in the order of numbers that no partition changes: a facet is one,
   with P2 four. Corners go by the number of the vertex, or, in the middle of a side, by that of its
   node. */
static PetscErrorCode make_triangles(SbContactSurface m, PetscInt n, const SbFacet facet[],
                                     PetscInt nobstacle, const PetscInt id[])
{
  static const int part[5][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}, {0, 1, 2}};
  const SbSpace s = m->space;
  PetscInt(*mine)[4], *all, nmine = 0, total, nmiddle = 0, *gnode, *vertex;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(4 * n, &mine));
  for (PetscInt i = 0; i < n; i++) {
    const PetscBool six = (PetscBool)(npoint_of(s, &facet[i]) == 6);

    if (facet[i].cell >= s->mesh->ncell_owned)
      continue;
    for (int q = six ? 0 : 4; q < (six ? 4 : 5); q++, nmine++) {
      mine[nmine][0] = 16 * s->mesh->cell_orig[facet[i].cell] + 4 * facet[i].face + q % 4;
      for (int k = 0; k < 3; k++) {
        const int p = part[q][k];

        mine[nmine][1 + k] = p < 3 ? s->mesh->vert_orig[facet[i].vertex[p]]
                                   : -1 - s->gnode[middle_of(s, &facet[i], p - 3)];
      }
    }
  }
  PetscCall(SbAllgatherv(s->comm, MPIU_INT, 4 * nmine, mine, &total, &all, NULL));
  PetscCall(PetscFree(mine));
  PetscCall(SbSortByKeys(total / 4, 4 * sizeof(*all), 1, all));

  /* vertices by their nodes, where they are in the middle of sides */
  PetscCall(PetscMalloc2(m->nbody_vertex, &gnode, m->nbody_vertex, &vertex));
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    if (id[v] < s->mesh->Nvert)
      continue;
    gnode[nmiddle] = m->gnode[m->start[v]];
    vertex[nmiddle++] = v;
  }
  PetscCall(PetscSortIntWithArray(nmiddle, gnode, vertex));
  m->nbody_triangle = total / 4;
  m->ntriangle = m->nbody_triangle + nobstacle;
  PetscCall(SbContactSurfaceRoom(m, 0, 0, m->ntriangle, 0));
  for (PetscInt t = 0; t < m->ntriangle; t++)
    m->triangle_number[t] = t;
  for (PetscInt i = 0; i < 3 * m->nbody_triangle; i++) {
    const PetscInt corner = all[4 * (i / 3) + 1 + i % 3];
    PetscInt at;

    if (corner >= 0)
      PetscCall(PetscFindInt(corner, m->nbody_vertex, id, &at));
    else
      PetscCall(PetscFindInt(-1 - corner, nmiddle, gnode, &at));
    m->triangle[i] = corner >= 0 ? at : vertex[at];
  }
  PetscCall(PetscFree2(gnode, vertex));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The edges of all triangles, each once, its area a third of that of the triangles around; `lone`:
   the obstacle is an edge of its own. */
static PetscErrorCode make_edges(SbContactSurface m, PetscBool lone)
{
  PetscInt(*side)[3];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * m->ntriangle, &side));
  for (PetscInt i = 0; i < 3 * m->ntriangle; i++) {
    const PetscInt a = m->triangle[i];
    const PetscInt b = m->triangle[3 * (i / 3) + (i + 1) % 3];

    side[i][0] = PetscMin(a, b);
    side[i][1] = PetscMax(a, b);
    side[i][2] = i / 3;
  }
  PetscCall(SbSortByKeys(3 * m->ntriangle, sizeof(*side), 3, side));
  PetscCall(SbContactSurfaceRoom(m, 0, 0, 0, 3 * m->ntriangle + 1));
  for (PetscInt i = 0; i < 3 * m->ntriangle; i++) {
    PetscReal n[3];
    const PetscReal area = SbContactTriangleArea(m->X, m->triangle + 3 * side[i][2], n) / 3.;

    if (i && side[i][0] == side[i - 1][0] && side[i][1] == side[i - 1][1])
      m->edge_area[m->nedge - 1] += area;
    else {
      m->edge[2 * m->nedge] = side[i][0];
      m->edge[2 * m->nedge + 1] = side[i][1];
      m->edge_area[m->nedge++] = area;
    }
  }
  PetscCall(PetscFree(side));
  if (lone) {
    m->edge[2 * m->nedge] = m->nbody_vertex;
    m->edge[2 * m->nedge + 1] = m->nbody_vertex + 1;
    m->edge_area[m->nedge++] = 0.;
  }
  for (PetscInt e = 0; e < m->nedge; e++)
    m->edge_number[e] = e;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parts of lower features in the pairs that share them (pair_energy.c): of a side of n
   triangles n - 1, so that one remains, and of a corner what makes up for the sides there; each
   triangle has its part of them. Of an end of n edges n - 1. */
static PetscErrorCode find_shares(SbContactSurface m)
{
  PetscInt *ntriangle, *nedge; /* [nvertex] around */
  PetscInt *excess;            /* [nvertex] triangles of the edges around beyond one each */
  PetscInt(*side)[4];          /* vertices, triangle, which of its sides */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(m->nvertex, &ntriangle, m->nvertex, &nedge, m->nvertex, &excess));
  PetscCall(PetscMalloc1(3 * m->ntriangle, &side));
  for (PetscInt i = 0; i < 3 * m->ntriangle; i++) {
    const PetscInt a = m->triangle[i];
    const PetscInt b = m->triangle[3 * (i / 3) + (i + 1) % 3];

    side[i][0] = PetscMin(a, b);
    side[i][1] = PetscMax(a, b);
    side[i][2] = i / 3;
    side[i][3] = i % 3;
    ntriangle[a]++;
  }
  PetscCall(SbSortByKeys(3 * m->ntriangle, sizeof(*side), 3, side));
  for (PetscInt i = 0; i < 3 * m->ntriangle;) {
    PetscInt last = i + 1;

    while (last < 3 * m->ntriangle && side[last][0] == side[i][0] && side[last][1] == side[i][1])
      last++;
    for (int k = 0; k < 2; k++) {
      nedge[side[i][k]]++;
      excess[side[i][k]] += last - i - 1;
    }
    for (PetscInt k = i; k < last; k++)
      m->share[6 * side[k][2] + side[k][3]] = (PetscReal)(last - i - 1) / (PetscReal)(last - i);
    i = last;
  }
  for (PetscInt i = 0; i < 3 * m->ntriangle; i++) {
    const PetscInt v = m->triangle[i];

    m->share[6 * (i / 3) + 3 + i % 3] =
      (PetscReal)(1 + excess[v] - ntriangle[v]) / (PetscReal)ntriangle[v];
  }
  for (PetscInt i = 0; i < 2 * m->nedge; i++) {
    const PetscInt n = PetscMax(1, nedge[m->edge[i]]);

    m->edge_share[i] = (PetscReal)(n - 1) / (PetscReal)n;
  }
  PetscCall(PetscFree(side));
  PetscCall(PetscFree3(ntriangle, nedge, excess));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What this rank keeps of the whole surface, which is released. The numbers are those of the whole
   surface, the order as well. */
static PetscErrorCode keep_own(SbContactSurface *mesh)
{
  const SbContactSurface w = *mesh;
  PetscInt nentry = 0;
  PetscInt *at;    /* [nvertex] of the whole surface: number here, -1: not kept */
  PetscInt *index; /* [nbody_vertex] number at the owner */
  PetscInt(*side)[2];
  SbContactSurface m;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&m));
  *m = *w;
  m->nvertex = m->nbody_vertex = m->ntriangle = m->nbody_triangle = m->nedge = 0;
  for (int k = 0; k < 4; k++)
    m->room[k] = 0;
  m->start = m->part = m->number = m->gnode = m->node = m->column = m->triangle =
    m->triangle_number = m->edge = m->edge_number = NULL;
  m->X = m->area = m->weight = m->edge_area = m->share = m->edge_share = NULL;
  m->mine = m->own = m->driven = m->fixed = NULL;
  m->remote = NULL;

  /* triangles and edges of own vertices; those of an obstacle on all ranks */
  PetscCall(PetscMalloc2(w->nvertex, &at, w->nbody_vertex, &index));
  for (PetscInt v = 0; v < w->nvertex; v++)
    at[v] = w->mine[v] || v >= w->nbody_vertex ? 0 : -1;
  for (PetscInt t = 0; t < w->ntriangle; t++) {
    const PetscInt *v = w->triangle + 3 * t;

    if (w->mine[v[0]] | w->mine[v[1]] | w->mine[v[2]] || t >= w->nbody_triangle)
      m->ntriangle++;
  }
  PetscCall(SbContactSurfaceRoom(m, 0, 0, m->ntriangle, 3 * m->ntriangle + 1));
  m->ntriangle = 0;
  for (PetscInt t = 0; t < w->ntriangle; t++) {
    const PetscInt *v = w->triangle + 3 * t;

    if (!(w->mine[v[0]] | w->mine[v[1]] | w->mine[v[2]]) && t < w->nbody_triangle)
      continue;
    for (int k = 0; k < 3; k++) {
      at[v[k]] = 0;
      m->triangle[3 * m->ntriangle + k] = v[k];
    }
    PetscCall(PetscArraycpy(m->share + 6 * m->ntriangle, w->share + 6 * t, 6));
    m->triangle_number[m->ntriangle++] = t;
    m->nbody_triangle += t < w->nbody_triangle;
  }

  /* the edges of these triangles: both lists ascend */
  PetscCall(PetscMalloc1(3 * m->ntriangle, &side));
  for (PetscInt k = 0; k < 3 * m->ntriangle; k++) {
    const PetscInt a = m->triangle[k];
    const PetscInt b = m->triangle[3 * (k / 3) + (k + 1) % 3];

    side[k][0] = PetscMin(a, b);
    side[k][1] = PetscMax(a, b);
  }
  PetscCall(SbSortByKeys(3 * m->ntriangle, sizeof(*side), 2, side));
  for (PetscInt e = 0, k = 0; e < w->nedge; e++) {
    const PetscInt *v = w->edge + 2 * e;

    while (k < 3 * m->ntriangle && (side[k][0] < v[0] || (side[k][0] == v[0] && side[k][1] < v[1])))
      k++;
    if (v[0] < w->nbody_vertex &&
        (k == 3 * m->ntriangle || side[k][0] != v[0] || side[k][1] != v[1]))
      continue;
    m->edge[2 * m->nedge] = v[0];
    m->edge[2 * m->nedge + 1] = v[1];
    m->edge_number[m->nedge] = e;
    PetscCall(PetscArraycpy(m->edge_share + 2 * m->nedge, w->edge_share + 2 * e, 2));
    m->edge_area[m->nedge++] = w->edge_area[e];
  }

  PetscCall(PetscFree(side));

  /* their vertices */
  for (PetscInt v = 0; v < w->nvertex; v++) {
    if (at[v] < 0)
      continue;
    at[v] = m->nvertex++;
    if (v < w->nbody_vertex)
      nentry += w->start[v + 1] - w->start[v];
  }
  PetscCall(SbContactSurfaceRoom(m, m->nvertex, nentry, 0, 0));
  m->start[0] = 0;
  for (PetscInt v = 0; v < w->nvertex; v++) {
    const PetscInt k = at[v];

    if (k < 0)
      continue;
    m->part[k] = w->part[v];
    m->number[k] = v;
    m->mine[k] = w->mine[v];
    m->own[k] = w->own[v];
    m->driven[k] = w->driven[v];
    m->area[k] = w->area[v];
    PetscCall(PetscArraycpy(m->X + 3 * k, w->X + 3 * v, 3));
    if (v >= w->nbody_vertex)
      continue;
    m->nbody_vertex++;
    m->remote[k] = w->remote[v];
    m->start[k + 1] = m->start[k];
    for (PetscInt e = w->start[v]; e < w->start[v + 1]; e++) {
      m->gnode[m->start[k + 1]] = w->gnode[e];
      m->node[m->start[k + 1]] = w->node[e];
      m->weight[m->start[k + 1]] = w->weight[e];
      m->fixed[m->start[k + 1]++] = w->fixed[e];
    }
  }
  for (PetscInt k = 0; k < 3 * m->ntriangle; k++)
    m->triangle[k] = at[m->triangle[k]];
  for (PetscInt k = 0; k < 2 * m->nedge; k++)
    m->edge[k] = at[m->edge[k]];

  /* where their owners have them */
  for (PetscInt v = 0; v < w->nbody_vertex; v++)
    index[v] = w->own[v] ? at[v] : 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, index, (PetscMPIInt)w->nbody_vertex, MPIU_INT, MPI_SUM,
                             m->space->comm));
  for (PetscInt k = 0; k < m->nbody_vertex; k++)
    m->remote[k].index = index[m->number[k]];
  PetscCall(PetscFree2(at, index));
  PetscCall(SbContactSurfaceDestroy(mesh));
  *mesh = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceCreate(SbSpace s, PetscInt n, const SbFacet facet[],
                                      SbObstacle obstacle, SbContactSurface *mesh)
{
  SbTriangles o = {0};
  SbContactSurface m;
  PetscInt nbody_edge = 0;
  PetscInt *id;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&m));
  *mesh = m;
  m->space = s;

  /* vertices and triangles of the bodies, then of the obstacle, which belong to rank 0 */
  if (obstacle) {
    const Shape shape = obstacle->shape;

    o = obstacle->surface;
    m->side = shape == PLANE ? SB_SIDE_PLANE : shape == BOWL ? SB_SIDE_BOWL : SB_SIDE_NONE;
    if (shape == SPHERE || shape == BOWL)
      m->radius = obstacle->p[3];
    if (shape == CAPSULE)
      m->radius = obstacle->p[6];
  }
  PetscCall(make_vertices(m, n, facet, o.nvert, &id));
  PetscCall(make_triangles(m, n, facet, o.ntri, id));
  PetscCall(PetscFree(id));
  PetscCall(PetscArraycpy(m->X + 3 * m->nbody_vertex, o.x, 3 * o.nvert));
  for (PetscInt i = 0; i < 3 * o.ntri; i++)
    m->triangle[3 * m->nbody_triangle + i] = m->nbody_vertex + o.tri[i];
  for (PetscInt v = m->nbody_vertex; v < m->nvertex; v++) {
    m->part[v] = s->mesh->nbody;
    m->area[v] = 0.;
    m->mine[v] = 0;
    m->own[v] = (uint8_t)!s->rank;
    m->driven[v] = 1;
  }
  PetscCall(make_edges(m, (PetscBool)(m->radius > 0. && o.nvert == 2)));
  PetscCall(find_shares(m));

  /* shortest and mean edge of the bodies, size of the smallest one */
  m->shortest = PETSC_MAX_REAL;
  for (; nbody_edge < m->nedge && m->edge[2 * nbody_edge] < m->nbody_vertex; nbody_edge++) {
    const PetscInt *e = m->edge + 2 * nbody_edge;
    const PetscReal length = PetscSqrtReal(SbDistance2(m->X + 3 * e[0], m->X + 3 * e[1]));

    m->shortest = PetscMin(m->shortest, length);
    m->mean_edge += length;
  }
  m->mean_edge /= (PetscReal)PetscMax(1, nbody_edge);
  m->size = SbBodySmallest(s->mesh->nbody, s->mesh->body);
  for (PetscInt k = 0; k < 3 * m->nbody_vertex; k++)
    m->farthest = PetscMax(m->farthest, PetscAbsReal(m->X[k]));

  /* on several ranks what each keeps */
  if (s->size > 1) {
    PetscCall(keep_own(mesh));
    m = *mesh;
    m->halo = (PetscBool)!obstacle;
  }
  m->nkept_vertex = m->nbody_vertex;
  m->nkept_triangle = m->nbody_triangle;
  m->nkept_edge = m->nedge;
  PetscCall(SbContactSurfaceShareOut(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceMarkDriven(SbContactSurface m)
{
  const SbSpace s = m->space;
  uint8_t *fixed; /* [Nnode] of all ranks */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(s->Nnode, &fixed));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    fixed[s->gnode_start + i] = (uint8_t)s->fixed[i];
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, fixed, (PetscMPIInt)s->Nnode, MPI_UINT8_T, MPI_MAX, s->comm));
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    m->driven[v] = 1;
    for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
      m->fixed[j] = fixed[m->gnode[j]];
      if ((m->fixed[j] & 7) != 7)
        m->driven[v] = 0;
    }
  }
  PetscCall(PetscFree(fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceGetPositions(SbContactSurface m, const PetscReal u[], PetscReal x[])
{
  PetscFunctionBeginUser;
  for (PetscInt v = 0; v < m->nkept_vertex; v++) {
    if (!m->own[v])
      continue;
    for (int i = 0; i < 3; i++)
      x[3 * v + i] = m->X[3 * v + i];
    for (PetscInt e = m->start[v]; e < m->start[v + 1]; e++)
      for (int i = 0; i < 3; i++)
        x[3 * v + i] += m->weight[e] * u[3 * m->node[e] + i];
  }
  PetscCall(SbContactSurfaceUpdate(m, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceDestroy(SbContactSurface *mesh)
{
  SbContactSurface m = *mesh;

  PetscFunctionBeginUser;
  if (!m)
    PetscFunctionReturn(PETSC_SUCCESS);
  while (m->narray)
    PetscCall(SbContactSurfaceDestroyArray(m, m->array[m->narray - 1]));
  PetscCall(PetscFree(m->start));
  PetscCall(PetscFree(m->gnode));
  PetscCall(PetscFree(m->node));
  PetscCall(PetscFree(m->column));
  PetscCall(PetscFree(m->weight));
  PetscCall(PetscFree(m->fixed));
  PetscCall(PetscFree(m->part));
  PetscCall(PetscFree(m->number));
  PetscCall(PetscFree(m->remote));
  PetscCall(PetscFree(m->X));
  PetscCall(PetscFree(m->area));
  PetscCall(PetscFree(m->mine));
  PetscCall(PetscFree(m->own));
  PetscCall(PetscFree(m->driven));
  PetscCall(PetscFree(m->triangle));
  PetscCall(PetscFree(m->triangle_number));
  PetscCall(PetscFree(m->edge));
  PetscCall(PetscFree(m->edge_number));
  PetscCall(PetscFree(m->edge_area));
  PetscCall(PetscFree(m->share));
  PetscCall(PetscFree(m->edge_share));
  PetscCall(PetscFree(m->group));
  PetscCall(PetscFree(m->ngroup));
  PetscCall(PetscFree(m->halo_number));
  PetscCall(PetscFree(m->halo_vertex));
  PetscCall(PetscSFDestroy(&m->sf));
  PetscCall(PetscFree(*mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
