/*
  contact_surface.c - the surfaces of bodies and of an obstacle as vertices, edges and triangles, on
  every rank.

  A vertex of a body moves by a weighted mean of nodes: with P1 its own node; with CR and DG, whose
  displacement is discontinuous, the mean over the cells behind the facets around it, so that the
  surface is closed and linear fields are reproduced. A facet of P2 is four flat triangles over its
  six nodes: its corners and the middles of its sides are vertices. The rank that owns the vertex in
  the mesh knows all facets around it (the overlap), makes its list of nodes and moves it; positions
  are gathered by all ranks, 24 bytes per vertex of the surface. Numbers follow the original ones:
  nothing depends on the partition.

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
    m->nlocal++;
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
      w = SbSpaceCellElement(s, f->cell)->ops.vertex[f->corner[ring[i] % 6]];
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
   obstacle. */
static PetscErrorCode make_vertices(SbContactSurface m, PetscInt n, const SbFacet facet[],
                                    PetscInt nobstacle)
{
  const SbSpace s = m->space;
  PetscInt nown = 0;
  PetscInt nall;
  PetscInt nv = 0;
  PetscInt *id, *arrival;
  PetscReal *own, *all;
  PetscMPIInt nlocal;

  PetscFunctionBeginUser;
  PetscCall(list_own(m, n, facet, &nown, &own));
  PetscCall(SbAllgatherv(s->comm, MPIU_REAL, nown, own, &nall, &all, NULL));
  PetscCall(PetscFree(own));

  /* how many vertices each rank moves */
  PetscCall(PetscMPIIntCast(3 * m->nlocal, &nlocal));
  PetscCall(PetscMalloc2(s->size, &m->count, s->size, &m->first));
  PetscCallMPI(MPI_Allgather(&nlocal, 1, MPI_INT, m->count, 1, MPI_INT, s->comm));
  m->first[0] = 0;
  for (PetscMPIInt r = 1; r < s->size; r++)
    m->first[r] = m->first[r - 1] + m->count[r - 1];

  /* the order of numbers: vertex order[k] arrives as number k */
  for (PetscInt i = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2])
    nv++;
  m->nbody_vertex = nv;
  m->nvertex = nv + nobstacle;
  PetscCall(PetscMalloc2(nv, &id, nv, &arrival));
  for (PetscInt i = 0, k = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2], k++) {
    id[k] = (PetscInt)all[i];
    arrival[k] = k;
  }
  PetscCall(PetscSortIntWithArray(nv, id, arrival));
  PetscCall(PetscCalloc3(nv, &m->order, 6 * nv, &m->buffer, nv + 1, &m->start));
  for (PetscInt v = 0; v < nv; v++)
    m->order[arrival[v]] = v;
  PetscCall(PetscFree2(id, arrival));

  /* their records in that order */
  for (PetscInt i = 0, k = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2], k++)
    m->start[m->order[k] + 1] = (PetscInt)all[i + 2];
  for (PetscInt v = 0; v < nv; v++)
    m->start[v + 1] += m->start[v];
  PetscCall(PetscMalloc4(m->start[nv], &m->gnode, m->start[nv], &m->node, m->start[nv], &m->weight,
                         m->start[nv], &m->fixed));
  PetscCall(
    PetscMalloc4(m->nvertex, &m->part, nv, &m->id, 3 * m->nvertex, &m->X, m->nvertex, &m->area));
  PetscCall(PetscCalloc3(m->nvertex, &m->mine, m->nvertex, &m->own, m->nvertex, &m->driven));
  for (PetscInt i = 0, k = 0; i < nall; i += 7 + 2 * (PetscInt)all[i + 2], k++) {
    const PetscInt v = m->order[k];
    const PetscInt start = m->start[v];
    const PetscInt count = m->start[v + 1] - start;

    m->id[v] = (PetscInt)all[i];
    m->part[v] = (PetscInt)all[i + 1];
    PetscCall(PetscArraycpy(m->X + 3 * v, all + i + 3, 3));
    m->area[v] = all[i + 6];
    for (PetscInt e = 0; e < count; e++) {
      m->gnode[start + e] = (PetscInt)all[i + 7 + 2 * e];
      m->weight[start + e] = all[i + 8 + 2 * e];
    }
    PetscCall(PetscSortIntWithScalarArray(count, m->gnode + start, m->weight + start));
    for (PetscInt e = start; e < start + count; e++) {
      const PetscInt node = m->gnode[e] - s->gnode_start;

      if (node >= 0 && node < s->nnode_owned) {
        m->node[e] = node;
        m->mine[v] = 1;
        continue;
      }
      PetscCall(PetscFindInt(m->gnode[e], s->nnode_cell - s->nnode_owned, s->gnode + s->nnode_owned,
                             &m->node[e]));
      m->node[e] = m->node[e] < 0 ? -1 : s->nnode_owned + m->node[e];
    }
  }
  PetscCall(PetscFree(all));
  m->local = m->order + m->first[s->rank] / 3;
  for (PetscInt k = 0; k < m->nlocal; k++)
    m->own[m->local[k]] = m->mine[m->local[k]] = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The triangles of all ranks, in the order of numbers that no partition changes: a facet is one,
   with P2 four. Corners go by the number of the vertex, or, in the middle of a side, by that of its
   node. */
static PetscErrorCode make_triangles(SbContactSurface m, PetscInt n, const SbFacet facet[],
                                     PetscInt nobstacle)
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
    if (m->id[v] < s->mesh->Nvert)
      continue;
    gnode[nmiddle] = m->gnode[m->start[v]];
    vertex[nmiddle++] = v;
  }
  PetscCall(PetscSortIntWithArray(nmiddle, gnode, vertex));
  m->nbody_triangle = total / 4;
  m->ntriangle = m->nbody_triangle + nobstacle;
  PetscCall(PetscMalloc1(3 * m->ntriangle, &m->triangle));
  for (PetscInt i = 0; i < 3 * m->nbody_triangle; i++) {
    const PetscInt corner = all[4 * (i / 3) + 1 + i % 3];
    PetscInt at;

    if (corner >= 0)
      PetscCall(PetscFindInt(corner, m->nbody_vertex, m->id, &at));
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
  PetscCall(PetscMalloc2(6 * m->ntriangle + 2, &m->edge, 3 * m->ntriangle + 1, &m->edge_area));
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceCreate(SbSpace s, PetscInt n, const SbFacet facet[],
                                      SbObstacle obstacle, SbContactSurface *mesh)
{
  SbTriangles o = {0};
  SbContactSurface m;
  PetscInt nbody_edge = 0;

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
  PetscCall(make_vertices(m, n, facet, o.nvert));
  PetscCall(make_triangles(m, n, facet, o.ntri));
  PetscCall(PetscArraycpy(m->X + 3 * m->nbody_vertex, o.x, 3 * o.nvert));
  for (PetscInt i = 0; i < 3 * o.ntri; i++)
    m->triangle[3 * m->nbody_triangle + i] = m->nbody_vertex + o.tri[i];
  for (PetscInt v = m->nbody_vertex; v < m->nvertex; v++) {
    m->part[v] = s->mesh->nbody;
    m->area[v] = 0.;
    m->own[v] = (uint8_t)!s->rank;
    m->driven[v] = 1;
  }
  PetscCall(make_edges(m, (PetscBool)(m->radius > 0. && o.nvert == 2)));

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
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceMarkDriven(SbContactSurface m)
{
  const SbSpace s = m->space;
  const PetscInt n = m->start[m->nbody_vertex];

  PetscFunctionBeginUser;
  for (PetscInt j = 0; j < n; j++)
    m->fixed[j] =
      (uint8_t)(m->node[j] >= 0 && m->node[j] < s->nnode_owned ? s->fixed[m->node[j]] : 0);
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, m->fixed, (PetscMPIInt)n, MPI_UINT8_T, MPI_MAX, s->comm));
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    m->driven[v] = 1;
    for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++)
      if ((m->fixed[j] & 7) != 7)
        m->driven[v] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceGetPositions(SbContactSurface m, const PetscReal u[], PetscReal x[])
{
  PetscReal *mine = m->buffer;
  PetscReal *all = m->buffer + 3 * m->nlocal;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->nlocal; k++) {
    const PetscInt v = m->local[k];

    for (int i = 0; i < 3; i++)
      mine[3 * k + i] = m->X[3 * v + i];
    for (PetscInt e = m->start[v]; e < m->start[v + 1]; e++)
      for (int i = 0; i < 3; i++)
        mine[3 * k + i] += m->weight[e] * u[3 * m->node[e] + i];
  }
  PetscCallMPI(MPI_Allgatherv(mine, (PetscMPIInt)(3 * m->nlocal), MPIU_REAL, all, m->count,
                              m->first, MPIU_REAL, m->space->comm));
  for (PetscInt k = 0; k < m->nbody_vertex; k++)
    for (int i = 0; i < 3; i++)
      x[3 * m->order[k] + i] = all[3 * k + i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceDestroy(SbContactSurface *mesh)
{
  SbContactSurface m = *mesh;

  PetscFunctionBeginUser;
  if (!m)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree4(m->gnode, m->node, m->weight, m->fixed));
  PetscCall(PetscFree4(m->part, m->id, m->X, m->area));
  PetscCall(PetscFree3(m->mine, m->own, m->driven));
  PetscCall(PetscFree(m->triangle));
  PetscCall(PetscFree2(m->edge, m->edge_area));
  PetscCall(PetscFree2(m->count, m->first));
  PetscCall(PetscFree3(m->order, m->buffer, m->start));
  PetscCall(PetscFree(*mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
