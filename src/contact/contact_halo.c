/*
  contact_halo.c - features of other ranks that a rank holds beside its own, because they may meet
  them.

  Each rank has groups of neighbouring triangles of one body. It tells all ranks the box of each,
  around the motion of its vertices. Each triangle goes, with its vertices and edges, from the rank
  that owns its first vertex to those ranks that have a group of another body, or with self-contact
  of any, whose box meets that of the triangle. A feature that meets one of a rank is part of a
  triangle that meets one of its groups: nothing is missed. What comes, does so with all that is
  constant: position at rest, nodes with weights, areas; positions follow by a star forest.

  Within a step vertices are only added, behind the others: pairs with friction and springs name
  them. At the start of a step those that are no longer near may go (`drop`).
*/
#include "pairs.h"
#include "sbgeometry.h"

#define GROUPS 128    /* most groups of a rank, about */
#define GROUP_LEAST 8 /* triangles in a group at least */

/* The groups of the kept triangles: of each body runs in the order of a tree at rest. */
static PetscErrorCode make_groups(SbContactSurface m)
{
  const SbSpace s = m->space;
  const PetscInt nbody = s->mesh->nbody;
  const PetscInt size = PetscMax(GROUP_LEAST, 1 + m->nkept_triangle / GROUPS);
  PetscInt *key, *start, *item, *vertex;
  PetscMPIInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nkept_triangle, &m->group));
  PetscCall(PetscMalloc1(s->size, &m->ngroup));
  PetscCall(PetscMalloc2(m->nkept_triangle, &key, 3 * m->nkept_triangle, &vertex));
  for (PetscInt t = 0; t < m->nkept_triangle; t++)
    key[t] = m->part[m->triangle[3 * t]];
  PetscCall(SbBucketByKey(m->nkept_triangle, key, nbody, &start, &item));
  for (PetscInt b = 0; b < nbody; b++) {
    const PetscInt count = start[b + 1] - start[b];
    PetscInt in = 0;
    SbBoxTree tree;

    if (!count)
      continue;
    for (PetscInt k = 0; k < 3 * count; k++)
      vertex[k] = m->triangle[3 * item[start[b] + k / 3] + k % 3];
    PetscCall(SbBoxTreeCreateTriangles(count, vertex, m->X, &tree));
    for (PetscInt k = 0; k < 4 * tree.start[1]; k++) {
      if (tree.order[k] < 0)
        continue;
      m->group[item[start[b] + tree.order[k]]] = n + (PetscMPIInt)(in++ / size);
    }
    n += (PetscMPIInt)((count - 1) / size) + 1;
    PetscCall(SbBoxTreeDestroy(&tree));
  }
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, m->ngroup, 1, MPI_INT, s->comm));
  PetscCall(PetscFree2(key, vertex));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(item));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The star forest, and the columns of the Hessian, of the vertices held now. */
static PetscErrorCode connect(SbContactSurface m)
{
  const PetscInt nentry = m->nbody_vertex ? m->start[m->nbody_vertex] : 0;
  PetscInt n = 0;
  PetscInt *leaf, *sorted;
  PetscSFNode *root;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(m->nbody_vertex, &leaf, m->nbody_vertex, &root));
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    if (m->own[v])
      continue;
    leaf[n] = v;
    root[n++] = m->remote[v];
  }
  PetscCall(PetscSFDestroy(&m->sf));
  PetscCall(PetscSFCreate(m->space->comm, &m->sf));
  PetscCall(
    PetscSFSetGraph(m->sf, m->nkept_vertex, n, leaf, PETSC_COPY_VALUES, root, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(m->sf));
  PetscCall(PetscFree2(leaf, root));

  PetscCall(PetscMalloc1(nentry, &sorted));
  PetscCall(PetscArraycpy(sorted, m->gnode, nentry));
  m->ncolumn = nentry;
  PetscCall(PetscSortRemoveDupsInt(&m->ncolumn, sorted));
  for (PetscInt e = 0; e < nentry; e++)
    PetscCall(PetscFindInt(m->gnode[e], m->ncolumn, sorted, &m->column[e]));
  PetscCall(PetscFree(sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceShareOut(SbContactSurface m)
{
  PetscFunctionBeginUser;
  if (m->space->size == 1) {
    m->ncolumn = m->space->Nnode;
    PetscCall(PetscFree(m->column));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (m->halo)
    PetscCall(make_groups(m));
  PetscCall(connect(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceUpdate(SbContactSurface m, PetscReal x[])
{
  MPI_Datatype unit;

  PetscFunctionBeginUser;
  if (!m->sf)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Type_contiguous(3, MPIU_REAL, &unit));
  PetscCallMPI(MPI_Type_commit(&unit));
  PetscCall(PetscSFBcastBegin(m->sf, unit, x, x, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(m->sf, unit, x, x, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceSum(SbContactSurface m, PetscMPIInt n, PetscReal x[])
{
  PetscReal *component;

  PetscFunctionBeginUser;
  if (!m->sf)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m->nbody_vertex, &component));
  for (PetscMPIInt i = 0; i < n; i++) {
    for (PetscInt v = 0; v < m->nbody_vertex; v++)
      component[v] = x[n * v + i];
    PetscCall(PetscSFReduceBegin(m->sf, MPIU_REAL, component, component, MPI_SUM));
    PetscCall(PetscSFReduceEnd(m->sf, MPIU_REAL, component, component, MPI_SUM));
    PetscCall(PetscSFBcastBegin(m->sf, MPIU_REAL, component, component, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(m->sf, MPIU_REAL, component, component, MPI_REPLACE));
    for (PetscInt v = 0; v < m->nbody_vertex; v++)
      x[n * v + i] = component[v];
  }
  PetscCall(PetscFree(component));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceNormals(SbContactSurface m, const PetscReal x[], PetscReal normal[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(normal, 3 * m->nvertex));
  for (PetscInt t = 0; t < m->ntriangle; t++) {
    const PetscInt *v = m->triangle + 3 * t;
    PetscReal n[3];

    (void)SbContactTriangleArea(x, v, n);
    for (int k = 0; k < 9; k++)
      normal[3 * v[k / 3] + k % 3] += n[k % 3];
  }
  PetscCall(SbContactSurfaceUpdate(m, normal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A message holds blocks of features. Integers: numbers of vertices, triangles, edges; of each
  vertex number, part, owner, number there, whether it is driven, number n of nodes, n nodes, n bits
  of prescribed components; of each triangle its number and those of its vertices; of each edge
  likewise. Reals: of each vertex position at rest, area, n weights; of each triangle its six parts;
  of each edge its area and its two.
*/
typedef struct {
  PetscInt n, size, *integer;
  PetscInt nreal, real_size;
  PetscReal *real;
} Message;
#define VERTEX_INTEGERS 6
#define VERTEX_REALS 4
#define TRIANGLE_REALS 6
#define EDGE_REALS 3

static PetscErrorCode free_message(Message *message)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(message->integer));
  PetscCall(PetscFree(message->real));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a block; the lists are of kept features. */
static PetscErrorCode pack(SbContactSurface m, const PetscInt n[3], PetscInt *const list[3],
                           Message *to)
{
  PetscInt *integer;
  PetscReal *real;
  PetscInt nentry = 0;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n[0]; k++)
    nentry += m->start[list[0][k] + 1] - m->start[list[0][k]];
  PetscCall(SbReserve(to->n + 3 + VERTEX_INTEGERS * n[0] + 2 * nentry + 4 * n[1] + 3 * n[2],
                      sizeof(PetscInt), &to->size, &to->integer));
  PetscCall(
    SbReserve(to->nreal + VERTEX_REALS * n[0] + nentry + TRIANGLE_REALS * n[1] + EDGE_REALS * n[2],
              sizeof(PetscReal), &to->real_size, &to->real));
  integer = to->integer + to->n;
  real = to->real + to->nreal;
  for (int i = 0; i < 3; i++)
    *integer++ = n[i];
  for (PetscInt k = 0; k < n[0]; k++) {
    const PetscInt v = list[0][k];
    const PetscInt count = m->start[v + 1] - m->start[v];

    *integer++ = m->number[v];
    *integer++ = m->part[v];
    *integer++ = (PetscInt)m->remote[v].rank;
    *integer++ = m->remote[v].index;
    *integer++ = m->driven[v];
    *integer++ = count;
    for (int i = 0; i < 3; i++)
      *real++ = m->X[3 * v + i];
    *real++ = m->area[v];
    for (PetscInt e = m->start[v]; e < m->start[v + 1]; e++) {
      integer[0] = m->gnode[e];
      integer[count] = m->fixed[e];
      integer++;
      *real++ = m->weight[e];
    }
    integer += count;
  }
  for (PetscInt k = 0; k < n[1]; k++) {
    const PetscInt t = list[1][k];

    *integer++ = m->triangle_number[t];
    for (int i = 0; i < 3; i++)
      *integer++ = m->number[m->triangle[3 * t + i]];
    for (int i = 0; i < TRIANGLE_REALS; i++)
      *real++ = m->share[TRIANGLE_REALS * t + i];
  }
  for (PetscInt k = 0; k < n[2]; k++) {
    const PetscInt e = list[2][k];

    *integer++ = m->edge_number[e];
    *integer++ = m->number[m->edge[2 * e]];
    *integer++ = m->number[m->edge[2 * e + 1]];
    *real++ = m->edge_area[e];
    for (int i = 0; i < 2; i++)
      *real++ = m->edge_share[2 * e + i];
  }
  to->n = (PetscInt)(integer - to->integer);
  to->nreal = (PetscInt)(real - to->real);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vertex of a number that is held; -1: none. */
static inline PetscErrorCode find_vertex(SbContactSurface m, PetscInt number, PetscInt *v)
{
  PetscInt at;

  PetscFunctionBeginUser;
  PetscCall(PetscFindInt(number, m->nkept_vertex, m->number, v));
  if (*v >= 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFindInt(number, m->nbody_vertex - m->nkept_vertex, m->halo_number, &at));
  *v = at < 0 ? -1 : m->halo_vertex[at];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices of other ranks by number. */
static PetscErrorCode order_halo(SbContactSurface m)
{
  const PetscInt n = m->nbody_vertex - m->nkept_vertex;

  PetscFunctionBeginUser;
  PetscCall(PetscRealloc(sizeof(PetscInt) * (size_t)PetscMax(1, n), &m->halo_number));
  PetscCall(PetscRealloc(sizeof(PetscInt) * (size_t)PetscMax(1, n), &m->halo_vertex));
  for (PetscInt k = 0; k < n; k++) {
    m->halo_number[k] = m->number[m->nkept_vertex + k];
    m->halo_vertex[k] = m->nkept_vertex + k;
  }
  PetscCall(PetscSortIntWithArray(n, m->halo_number, m->halo_vertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where a feature is in a message: integers, reals. */
typedef struct {
  PetscInt number, integer, real;
} Place;

/* Adds the vertices of a message that are not held; counts those that are not kept. */
static PetscErrorCode take_vertices(SbContactSurface m, const Message *from)
{
  const PetscInt *integer = from->integer;
  PetscInt n = 0;
  PetscInt size = 0;
  PetscInt nentry, nhalo, held;
  Place *place = NULL;

  PetscFunctionBeginUser;
  for (PetscInt i = 0, r = 0; i < from->n;) {
    const PetscInt *count = integer + i;

    i += 3;
    for (PetscInt k = 0; k < count[0]; k++) {
      const PetscInt nnode = integer[i + VERTEX_INTEGERS - 1];
      PetscInt v;

      PetscCall(PetscFindInt(integer[i], m->nkept_vertex, m->number, &v));
      if (v < 0) {
        PetscCall(SbReserve(n + 1, sizeof(*place), &size, &place));
        place[n++] = (Place){integer[i], i, r};
      }
      i += VERTEX_INTEGERS + 2 * nnode;
      r += VERTEX_REALS + nnode;
    }
    i += 4 * count[1] + 3 * count[2];
    r += TRIANGLE_REALS * count[1] + EDGE_REALS * count[2];
  }
  PetscCall(SbSortByKeys(n, sizeof(*place), 1, place));
  nhalo = m->nbody_vertex - m->nkept_vertex;
  m->nneeded = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt *at = integer + place[k].integer;
    const PetscReal *real = from->real + place[k].real;
    const PetscInt v = m->nbody_vertex;
    const PetscInt nnode = at[VERTEX_INTEGERS - 1];

    if (k && place[k].number == place[k - 1].number)
      continue;
    m->nneeded++;
    PetscCall(PetscFindInt(place[k].number, nhalo, m->halo_number, &held));
    if (held >= 0)
      continue;
    nentry = v ? m->start[v] : 0;
    PetscCall(SbContactSurfaceRoom(m, v + 1, nentry + nnode, 0, 0));
    m->start[0] = 0;
    m->number[v] = at[0];
    m->part[v] = at[1];
    m->remote[v] = (PetscSFNode){.rank = at[2], .index = at[3]};
    m->driven[v] = (uint8_t)at[4];
    m->own[v] = 0;
    m->area[v] = real[3];
    PetscCall(PetscArraycpy(m->X + 3 * v, real, 3));
    PetscCall(PetscArraycpy(m->gnode + nentry, at + VERTEX_INTEGERS, nnode));
    PetscCall(PetscArraycpy(m->weight + nentry, real + VERTEX_REALS, nnode));
    for (PetscInt e = 0; e < nnode; e++)
      m->fixed[nentry + e] = (uint8_t)at[VERTEX_INTEGERS + nnode + e];
    m->start[v + 1] = nentry + nnode;
    PetscCall(SbContactSurfaceFindNodes(m, v));
    m->nbody_vertex = m->nvertex = v + 1;
  }
  PetscCall(PetscFree(place));

  PetscCall(order_halo(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the triangles and edges of a message that are not kept: behind those that are, in the order
   of their numbers. */
static PetscErrorCode take_features(SbContactSurface m, const Message *from)
{
  static const PetscInt reals[] = {TRIANGLE_REALS, EDGE_REALS};
  const PetscInt *integer = from->integer;
  PetscInt n[2] = {0, 0};
  PetscInt size[2] = {0, 0};
  Place *place[2] = {NULL, NULL};

  PetscFunctionBeginUser;
  for (PetscInt i = 0, r = 0; i < from->n;) {
    const PetscInt *count = integer + i;

    i += 3;
    for (PetscInt k = 0; k < count[0]; k++) {
      r += VERTEX_REALS + integer[i + VERTEX_INTEGERS - 1];
      i += VERTEX_INTEGERS + 2 * integer[i + VERTEX_INTEGERS - 1];
    }
    for (int kind = 0; kind < 2; kind++) {
      for (PetscInt k = 0; k < count[1 + kind]; k++, i += 4 - kind, r += reals[kind]) {
        PetscInt at;

        PetscCall(PetscFindInt(integer[i], kind ? m->nkept_edge : m->nkept_triangle,
                               kind ? m->edge_number : m->triangle_number, &at));
        if (at >= 0)
          continue;
        PetscCall(SbReserve(n[kind] + 1, sizeof(Place), &size[kind], &place[kind]));
        place[kind][n[kind]++] = (Place){integer[i], i, r};
      }
    }
  }
  m->ntriangle = m->nkept_triangle;
  m->nedge = m->nkept_edge;
  PetscCall(SbContactSurfaceRoom(m, 0, 0, m->ntriangle + n[0], m->nedge + n[1]));
  for (int kind = 0; kind < 2; kind++) {
    PetscCall(SbSortByKeys(n[kind], sizeof(Place), 1, place[kind]));
    for (PetscInt k = 0; k < n[kind]; k++) {
      const PetscInt *at = integer + place[kind][k].integer;
      const PetscReal *real = from->real + place[kind][k].real;
      PetscInt *to = kind ? m->edge + 2 * m->nedge : m->triangle + 3 * m->ntriangle;

      if (k && place[kind][k].number == place[kind][k - 1].number)
        continue;
      for (int i = 0; i < 3 - kind; i++)
        PetscCall(find_vertex(m, at[1 + i], &to[i]));
      if (kind) {
        m->edge_area[m->nedge] = real[0];
        PetscCall(PetscArraycpy(m->edge_share + 2 * m->nedge, real + 1, 2));
        m->edge_number[m->nedge++] = at[0];
      } else {
        PetscCall(PetscArraycpy(m->share + TRIANGLE_REALS * m->ntriangle, real, TRIANGLE_REALS));
        m->triangle_number[m->ntriangle++] = at[0];
      }
    }
    PetscCall(PetscFree(place[kind]));
  }
  m->nbody_triangle = m->ntriangle;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The boxes of the groups of all ranks, in their order, with the body: [n][7]. */
static PetscErrorCode share_groups(SbContactSurface m, const PetscReal (*box)[6], PetscInt *n,
                                   PetscReal (**all)[6], PetscInt **part)
{
  const SbSpace s = m->space;
  const PetscInt nown = m->ngroup[s->rank];
  PetscReal(*own)[6];
  PetscInt *own_part;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(nown, &own, nown, &own_part));
  for (PetscInt g = 0; g < nown; g++)
    SbBoxClear(own[g]);
  for (PetscInt t = 0; t < m->nkept_triangle; t++) {
    SbBoxMerge(own[m->group[t]], box[t]);
    own_part[m->group[t]] = m->part[m->triangle[3 * t]];
  }
  PetscCall(SbAllgatherv(s->comm, MPIU_REAL, 6 * nown, own, n, all, NULL));
  PetscCall(SbAllgatherv(s->comm, MPIU_INT, nown, own_part, n, part, NULL));
  PetscCall(PetscFree2(own, own_part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ranks to which triangles go: pairs[n] of a rank and a triangle, by rank. */
static PetscErrorCode find_meetings(SbContactSurface m, const PetscReal (*box)[6], PetscInt *n,
                                    PetscInt (**pairs)[2])
{
  const SbSpace s = m->space;
  PetscInt size = 0;
  PetscInt ngroup;
  PetscReal(*group)[6];
  PetscInt *part, *rank, *last;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  *n = 0;
  *pairs = NULL;
  PetscCall(share_groups(m, box, &ngroup, &group, &part));
  PetscCall(PetscMalloc2(ngroup, &rank, s->size, &last));
  for (PetscInt g = 0, r = 0, end = m->ngroup[0]; g < ngroup; g++) {
    while (g >= end)
      end += m->ngroup[++r];
    rank[g] = r;
    if (r == s->rank)
      SbBoxClear(group[g]);
  }
  for (PetscMPIInt r = 0; r < s->size; r++)
    last[r] = -1;
  PetscCall(SbBoxTreeCreate(ngroup, (const PetscReal(*)[6])group, &tree));
  for (PetscInt t = 0; t < m->nkept_triangle; t++) {
    const PetscInt own = m->part[m->triangle[3 * t]];
    SbBoxNearest query;
    PetscInt g;

    if (!m->own[m->triangle[3 * t]])
      continue;
    for (SbBoxNearestBegin(&tree, box[t], 0., &query); SbBoxNearestNext(&query, &g);) {
      if (last[rank[g]] == t || (part[g] == own && !m->self))
        continue;
      last[rank[g]] = t;
      PetscCall(SbReserve(*n + 1, sizeof(**pairs), &size, pairs));
      (*pairs)[*n][0] = rank[g];
      (*pairs)[(*n)++][1] = t;
    }
  }
  PetscCall(SbSortByKeys(*n, sizeof(**pairs), 2, *pairs));
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree2(rank, last));
  PetscCall(PetscFree(group));
  PetscCall(PetscFree(part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The block of triangles pairs[n][1] with their vertices and edges; stamp[2]: of vertices and
   edges, the last block that had them. side[ntriangle][3]: edges of the triangles. */
static PetscErrorCode pack_triangles(SbContactSurface m, PetscInt n, PetscInt (*pairs)[2],
                                     const PetscInt side[], PetscInt *const stamp[2], Message *to)
{
  PetscInt count[3] = {0, n, 0};
  PetscInt *list[3];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(3 * n, &list[0], n, &list[1], 3 * n, &list[2]));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt t = pairs[k][1];

    list[1][k] = t;
    for (int i = 0; i < 3; i++) {
      const PetscInt item[2] = {m->triangle[3 * t + i], side[3 * t + i]};

      for (int kind = 0; kind < 2; kind++) {
        if (stamp[kind][item[kind]] == pairs[0][0])
          continue;
        stamp[kind][item[kind]] = pairs[0][0];
        list[2 * kind][count[2 * kind]++] = item[kind];
      }
    }
  }
  PetscCall(pack(m, count, list, to));
  PetscCall(PetscFree3(list[0], list[1], list[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The edges of the kept triangles: side[nkept_triangle][3]. */
static PetscErrorCode find_sides(SbContactSurface m, PetscInt side[])
{
  PetscInt *start, *edge, *low;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nkept_edge, &low));
  for (PetscInt e = 0; e < m->nkept_edge; e++)
    low[e] = m->edge[2 * e];
  PetscCall(SbBucketByKey(m->nkept_edge, low, m->nkept_vertex, &start, &edge));
  for (PetscInt k = 0; k < 3 * m->nkept_triangle; k++) {
    const PetscInt a = m->triangle[k];
    const PetscInt b = m->triangle[3 * (k / 3) + (k + 1) % 3];

    for (PetscInt i = start[PetscMin(a, b)]; i < start[PetscMin(a, b) + 1]; i++)
      if (m->edge[2 * edge[i] + 1] == PetscMax(a, b))
        side[k] = edge[i];
  }
  PetscCall(PetscFree(low));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends the messages, one after the other in `out`, of the lengths count[2 rank], integers and
   reals. */
static PetscErrorCode exchange(MPI_Comm comm, PetscMPIInt size, PetscMPIInt count[],
                               const Message *out, Message *in)
{
  PetscMPIInt *got, *part;

  PetscFunctionBeginUser;
  *in = (Message){0};
  PetscCall(PetscMalloc2(2 * size, &got, 4 * size, &part));
  PetscCallMPI(MPI_Alltoall(count, 2, MPI_INT, got, 2, MPI_INT, comm));
  for (int kind = 0; kind < 2; kind++) {
    PetscMPIInt *const scount = part;
    PetscMPIInt *const sfirst = part + size;
    PetscMPIInt *const rcount = part + 2 * size;
    PetscMPIInt *const rfirst = part + 3 * size;
    PetscMPIInt total = 0;

    sfirst[0] = 0;
    for (PetscMPIInt r = 0; r < size; r++) {
      scount[r] = count[2 * r + kind];
      rcount[r] = got[2 * r + kind];
      rfirst[r] = total;
      total += rcount[r];
      if (r)
        sfirst[r] = sfirst[r - 1] + scount[r - 1];
    }
    if (kind) {
      in->nreal = total;
      PetscCall(PetscMalloc1(total, &in->real));
      PetscCallMPI(MPI_Alltoallv(out->real, scount, sfirst, MPIU_REAL, in->real, rcount, rfirst,
                                 MPIU_REAL, comm));
    } else {
      in->n = total;
      PetscCall(PetscMalloc1(total, &in->integer));
      PetscCallMPI(MPI_Alltoallv(out->integer, scount, sfirst, MPIU_INT, in->integer, rcount,
                                 rfirst, MPIU_INT, comm));
    }
  }
  PetscCall(PetscFree2(got, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceReach(SbContactSurface m, PetscReal grown, const PetscReal x0[],
                                     const PetscReal x1[])
{
  const SbSpace s = m->space;
  PetscReal(*box)[6];
  PetscInt npair;
  PetscInt(*pairs)[2];
  PetscInt *side, *stamp[2];
  PetscMPIInt *count;
  Message out = {0};
  Message in;

  PetscFunctionBeginUser;
  if (!m->halo)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(SbContactSurfaceFollow(m, x0) && SbContactSurfaceFollow(m, x1), PETSC_COMM_SELF,
             PETSC_ERR_PLIB, "Positions are not in arrays of SbContactSurfaceCreateArray()");
  if (m->drop) {
    m->nvertex = m->nbody_vertex = m->nkept_vertex;
    PetscCall(order_halo(m));
    m->drop = PETSC_FALSE;
  }

  /* the ranks whose groups each triangle meets */
  PetscCall(PetscMalloc1(m->nkept_triangle, &box));
  for (PetscInt t = 0; t < m->nkept_triangle; t++) {
    SbBoxClear(box[t]);
    for (int k = 0; k < 3; k++) {
      SbBoxAdd(box[t], x0 + 3 * m->triangle[3 * t + k]);
      SbBoxAdd(box[t], x1 + 3 * m->triangle[3 * t + k]);
    }
    for (int c = 0; c < 6; c++)
      box[t][c] += c < 3 ? -grown : grown;
  }
  PetscCall(find_meetings(m, (const PetscReal(*)[6])box, &npair, &pairs));
  PetscCall(PetscFree(box));

  /* a block for each of these ranks */
  PetscCall(PetscMalloc4(3 * m->nkept_triangle, &side, m->nkept_vertex, &stamp[0], m->nkept_edge,
                         &stamp[1], 2 * s->size, &count));
  PetscCall(find_sides(m, side));
  for (PetscInt v = 0; v < m->nkept_vertex; v++)
    stamp[0][v] = -1;
  for (PetscInt e = 0; e < m->nkept_edge; e++)
    stamp[1][e] = -1;
  PetscCall(PetscArrayzero(count, 2 * s->size));
  for (PetscInt first = 0, last; first < npair; first = last) {
    const PetscInt n[2] = {out.n, out.nreal};
    const PetscInt rank = pairs[first][0];

    for (last = first; last < npair && pairs[last][0] == rank; last++)
      continue;
    PetscCall(pack_triangles(m, last - first, pairs + first, side, stamp, &out));
    PetscCall(PetscMPIIntCast(out.n - n[0], &count[2 * rank]));
    PetscCall(PetscMPIIntCast(out.nreal - n[1], &count[2 * rank + 1]));
  }
  PetscCall(PetscFree(pairs));
  PetscCall(exchange(s->comm, s->size, count, &out, &in));
  PetscCall(PetscFree4(side, stamp[0], stamp[1], count));

  PetscCall(take_vertices(m, &in));
  PetscCall(take_features(m, &in));
  PetscCall(free_message(&out));
  PetscCall(free_message(&in));
  PetscCall(connect(m));
  for (int i = 0; i < m->narray; i++)
    PetscCall(SbContactSurfaceUpdate(m, *m->array[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceHold(SbContactSurface m, PetscInt n, const PetscInt number[],
                                    PetscInt v[])
{
  PetscInt *list[3] = {NULL, NULL, NULL};
  PetscInt count[3] = {0, 0, 0};
  Message out = {0};
  Message in = {0};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, &list[0]));
  for (PetscInt k = 0; k < n; k++) {
    PetscInt at;

    if (number[k] >= m->Nbody_vertex)
      continue;
    PetscCall(find_vertex(m, number[k], &at));
    if (at >= 0 && m->own[at])
      list[0][count[0]++] = at;
  }
  PetscCall(pack(m, count, list, &out));
  PetscCall(PetscFree(list[0]));
  if (m->halo) {
    PetscCall(SbAllgatherv(m->space->comm, MPIU_INT, out.n, out.integer, &in.n, &in.integer, NULL));
    PetscCall(
      SbAllgatherv(m->space->comm, MPIU_REAL, out.nreal, out.real, &in.nreal, &in.real, NULL));
    PetscCall(take_vertices(m, &in));
    PetscCall(connect(m));
    for (int i = 0; i < m->narray; i++)
      PetscCall(SbContactSurfaceUpdate(m, *m->array[i]));
  }
  PetscCall(free_message(&out));
  PetscCall(free_message(&in));
  for (PetscInt k = 0; k < n; k++)
    if (number[k] >= m->Nbody_vertex)
      v[k] = m->nbody_vertex + number[k] - m->Nbody_vertex;
    else
      PetscCall(find_vertex(m, number[k], &v[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the features of the obstacle behind those of the bodies. */
static PetscErrorCode add_obstacle(SbContactSurface m, SbContactSurface w)
{
  const PetscInt nvertex = m->nvertex - m->nbody_vertex;
  const PetscInt ntriangle = m->ntriangle - m->nbody_triangle;

  PetscFunctionBeginUser;
  PetscCall(SbContactSurfaceRoom(w, w->nvertex + nvertex, 0, w->ntriangle + ntriangle,
                                 w->nedge + m->nedge));
  for (PetscInt k = 0; k < nvertex; k++) {
    const PetscInt v = w->nvertex++;
    const PetscInt of = m->nbody_vertex + k;

    w->part[v] = m->part[of];
    w->number[v] = m->number[of];
    w->mine[v] = m->mine[of];
    w->own[v] = m->own[of];
    w->driven[v] = m->driven[of];
    w->area[v] = m->area[of];
    PetscCall(PetscArraycpy(w->X + 3 * v, m->X + 3 * of, 3));
  }
  for (PetscInt k = 0; k < 3 * ntriangle; k++)
    w->triangle[3 * w->ntriangle + k] =
      m->triangle[3 * m->nbody_triangle + k] - m->nbody_vertex + w->nbody_vertex;
  for (PetscInt k = 0; k < ntriangle; k++)
    w->triangle_number[w->ntriangle + k] = m->triangle_number[m->nbody_triangle + k];
  PetscCall(
    PetscArraycpy(w->share + 6 * w->ntriangle, m->share + 6 * m->nbody_triangle, 6 * ntriangle));
  w->ntriangle += ntriangle;
  for (PetscInt e = 0; e < m->nedge; e++) {
    if (m->edge[2 * e] < m->nbody_vertex)
      continue;
    for (int k = 0; k < 2; k++)
      w->edge[2 * w->nedge + k] = m->edge[2 * e + k] - m->nbody_vertex + w->nbody_vertex;
    w->edge_area[w->nedge] = m->edge_area[e];
    PetscCall(PetscArraycpy(w->edge_share + 2 * w->nedge, m->edge_share + 2 * e, 2));
    w->edge_number[w->nedge++] = m->edge_number[e];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceGather(SbContactSurface m, const PetscReal x[],
                                      SbContactSurface *whole, PetscReal **y)
{
  const MPI_Comm comm = m->space->comm;
  PetscInt *list[3], *number;
  PetscInt count[3] = {0, 0, 0};
  PetscInt n;
  PetscReal *own, *all;
  Message out = {0};
  Message in = {0};
  SbContactSurface w;

  PetscFunctionBeginUser;

  /* what this rank owns: of triangles and edges those whose first vertex it does */
  PetscCall(PetscMalloc5(m->nkept_vertex, &list[0], m->nkept_triangle, &list[1], m->nkept_edge,
                         &list[2], m->nkept_vertex, &number, 3 * m->nkept_vertex, &own));
  for (PetscInt v = 0; v < m->nkept_vertex; v++) {
    if (!m->own[v])
      continue;
    number[count[0]] = m->number[v];
    PetscCall(PetscArraycpy(own + 3 * count[0], x + 3 * v, 3));
    list[0][count[0]++] = v;
  }
  for (PetscInt t = 0; t < m->nkept_triangle; t++)
    if (m->own[m->triangle[3 * t]])
      list[1][count[1]++] = t;
  for (PetscInt e = 0; e < m->nkept_edge; e++)
    if (m->edge[2 * e] < m->nbody_vertex && m->own[m->edge[2 * e]])
      list[2][count[2]++] = e;
  PetscCall(pack(m, (const PetscInt *)count, list, &out));
  PetscCall(SbAllgatherv(comm, MPIU_INT, out.n, out.integer, &in.n, &in.integer, NULL));
  PetscCall(SbAllgatherv(comm, MPIU_REAL, out.nreal, out.real, &in.nreal, &in.real, NULL));

  /* of all ranks, by number */
  PetscCall(PetscNew(&w));
  *w = (struct _p_SbContactSurface){.space = m->space,
                                    .self = m->self,
                                    .rim = m->rim,
                                    .radius = m->radius,
                                    .side = m->side,
                                    .Nbody_vertex = m->Nbody_vertex,
                                    .shortest = m->shortest,
                                    .mean_edge = m->mean_edge,
                                    .size = m->size,
                                    .farthest = m->farthest};
  PetscCall(SbContactSurfaceRoom(w, m->Nbody_vertex, 0, 0, 0));
  PetscCall(take_vertices(w, &in));
  PetscCall(take_features(w, &in));
  PetscCall(add_obstacle(m, w));
  PetscCall(PetscMalloc1(3 * w->nvertex, y));
  PetscCall(PetscArraycpy(*y + 3 * w->nbody_vertex, x + 3 * m->nbody_vertex,
                          3 * (m->nvertex - m->nbody_vertex)));
  {
    PetscInt *numbers;

    PetscCall(SbAllgatherv(comm, MPIU_INT, count[0], number, &n, &numbers, NULL));
    PetscCall(SbAllgatherv(comm, MPIU_REAL, 3 * count[0], own, &n, &all, NULL));
    for (PetscInt k = 0; k < n; k++)
      (*y)[3 * numbers[k / 3] + k % 3] = all[k];
    PetscCall(PetscFree(numbers));
    PetscCall(PetscFree(all));
  }
  PetscCall(free_message(&out));
  PetscCall(free_message(&in));
  PetscCall(PetscFree5(list[0], list[1], list[2], number, own));
  *whole = w;
  PetscFunctionReturn(PETSC_SUCCESS);
}
