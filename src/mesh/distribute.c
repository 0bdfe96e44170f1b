/*
  distribute.c - distribution of the merged mesh: each rank gets its cells, their vertices, and
  copies of cells of other ranks (ghosts).

  Cells are sent directly to their owners, with their vertices: a vertex is sent once to each rank
  that needs it. A distributed directory tells which ranks have a vertex: rank r keeps the r-th
  block of original vertex numbers. Vertices that are shared by the same set of ranks are sorted
  along the longest axis of their bounding box and divided among these ranks in equal contiguous
  parts: all of them compute the same owners, the load is balanced, and the parts are compact, so
  that there are few ghosts. Then each rank sends copies of its cells to the owners of their
  vertices.
*/
#include <stdlib.h>
#include "mesh_impl.h"

PetscErrorCode SbLocalMeshDestroy(SbLocalMesh *c)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(c->cell));
  PetscCall(PetscFree(c->data));
  PetscCall(PetscFree(c->vertex));
  PetscCall(PetscFree(c->owner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends the cells which[] (NULL: all) of the route; `owned`: their vertices have owners. */
static PetscErrorCode send_cells(const SbLocalMesh *from, PetscBool owned, const SbRoute *route,
                                 SbLocalMesh *to)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)route->sf);
  const PetscInt *which = route->which;
  PetscInt *at, *to_rank, *start, *order, *last;
  PetscMPIInt size;
  SbRouteList list = {0};
  SbRoute vertices;

  PetscFunctionBeginUser;
  *to = (SbLocalMesh){0};

  // vertices to send to each rank, in the order of the cells; at[][4]: which of the list the
  // vertices of a cell are, then their places there
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(
    PetscMalloc3(4 * (size_t)route->nsend, &at, route->nsend, &to_rank, from->nvert, &last));
  for (PetscInt i = 0; i < route->nsend; i++)
    to_rank[i] = route->place[i].rank;
  PetscCall(SbBucketByKey(route->nsend, to_rank, size, &start, &order));
  for (PetscInt v = 0; v < from->nvert; v++)
    last[v] = -1;
  for (PetscInt k = 0; k < route->nsend; k++) {
    const PetscInt i = order[k];
    const PetscInt *v = from->cell + 4 * (size_t)(which ? which[i] : i);

    for (int a = 0; a < 4; a++) {
      if (last[v[a]] < 0 || list.rank[last[v[a]]] != to_rank[i]) {
        last[v[a]] = list.n;
        PetscCall(SbRouteAdd(&list, v[a], (PetscMPIInt)to_rank[i]));
      }
      at[4 * (size_t)i + a] = last[v[a]];
    }
  }
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(order));
  PetscCall(SbRouteCreate(comm, list.n, list.item, list.rank, &vertices));
  for (PetscInt i = 0; i < 4 * route->nsend; i++)
    at[i] = vertices.place[at[i]].index;
  PetscCall(SbRouteSend(route, 4 * sizeof(PetscInt), NULL, at, &to->cell));
  PetscCall(PetscFree3(at, to_rank, last));
  to->ncell = route->nrecv;
  to->nvert = vertices.nrecv;
  PetscCall(SbRouteSend(route, sizeof(SbCellData), which, from->data, &to->data));
  PetscCall(SbRouteSend(&vertices, sizeof(SbVertexData), list.item, from->vertex, &to->vertex));
  if (owned)
    PetscCall(SbRouteSend(&vertices, sizeof(PetscMPIInt), list.item, from->owner, &to->owner));
  PetscCall(SbRouteDestroy(&vertices));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Original numbers with which n records begin, and the permutation that sorts these in ascending
   order. */
static PetscErrorCode ascending(PetscInt n, size_t unit, const void *record, PetscInt number[],
                                PetscInt order[])
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    number[i] = *(const PetscInt *)(const void *)((const char *)record + unit * (size_t)i);
    order[i] = i;
  }
  PetscCall(PetscSortIntWithPermutation(n, number, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends cells that have come, and those of their vertices that are not there yet, by original
   number: a vertex may have come from several ranks. The first cells, which this rank owns, by
   original number too. Destroys `from`. */
static PetscErrorCode append(SbLocalMesh *local, SbLocalMesh *from)
{
  const PetscInt known = local->nvert;
  const PetscInt before = local->ncell;
  const PetscInt room = PetscMax(from->nvert, from->ncell);
  const size_t nvert = (size_t)known + (size_t)from->nvert;
  const size_t ncell = (size_t)before + (size_t)from->ncell;
  PetscInt *orig, *number, *order, *position;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(known, &orig, room, &number, room, &order, from->nvert, &position));
  for (PetscInt v = 0; v < known; v++)
    orig[v] = local->vertex[v].orig;
  PetscCall(ascending(from->nvert, sizeof(*from->vertex), from->vertex, number, order));
  PetscCall(PetscRealloc(nvert * sizeof(*local->vertex), &local->vertex));
  PetscCall(PetscRealloc(nvert * sizeof(*local->owner), &local->owner));
  for (PetscInt i = 0; i < from->nvert; i++) {
    const PetscInt v = order[i];
    PetscInt *n = &local->nvert;

    PetscCall(PetscFindInt(number[v], known, orig, &position[v]));
    if (position[v] >= 0)
      continue;
    if (*n == known || local->vertex[*n - 1].orig != number[v]) {
      local->vertex[*n] = from->vertex[v];
      local->owner[(*n)++] = from->owner ? from->owner[v] : -1;
    }
    position[v] = *n - 1;
  }
  PetscCall(PetscFree(from->vertex));
  PetscCall(ascending(from->ncell, sizeof(*from->data), from->data, number, order));
  PetscCall(PetscRealloc(ncell * sizeof(*local->data), &local->data));
  PetscCall(PetscRealloc(4 * ncell * sizeof(*local->cell), &local->cell));
  for (PetscInt k = 0; k < from->ncell; k++) {
    const PetscInt c = before ? k : order[k];
    const PetscInt at = local->ncell++;

    local->data[at] = from->data[c];
    for (int a = 0; a < 4; a++)
      local->cell[4 * (size_t)at + a] = position[from->cell[4 * (size_t)c + a]];
  }
  PetscCall(PetscFree4(orig, number, order, position));
  PetscCall(SbLocalMeshDestroy(from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices that several ranks have. */
typedef struct {
  PetscInt vert, orig, n;
  const PetscMPIInt *rank; /* [n] ranks that have the vertex, ascending */
  PetscReal along;
} Shared;
typedef struct {
  PetscInt n;
  Shared *vert; /* [n] */
  PetscMPIInt *rank;
} Border;

/* Shared vertices of this rank with the ranks that have them, from the directory. */
static PetscErrorCode border_create(MPI_Comm comm, PetscInt Nvert, const SbLocalMesh *local,
                                    Border *border)
{
  const PetscInt n = local->nvert;
  const PetscSFNode *home;
  PetscInt nroot = PETSC_DECIDE;
  PetscInt nlist = 0;
  PetscInt *orig, *start, *begin, *end;
  PetscMPIInt *holder;
  PetscSFNode *list;
  PetscSF forest, lists;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(n, &orig, n, &begin, n, &end));
  for (PetscInt v = 0; v < n; v++)
    orig[v] = local->vertex[v].orig;
  PetscCall(PetscSplitOwnership(comm, &nroot, &Nvert));
  PetscCall(SbForestCreate(comm, nroot, n, orig, &forest));
  PetscCall(SbForestRanks(forest, &start, &holder));

  /* each of the ranks that have a vertex gets the whole list of them */
  PetscCall(SbForestBroadcast(forest, 1, MPIU_INT, start, begin));
  PetscCall(SbForestBroadcast(forest, 1, MPIU_INT, start + 1, end));
  border->n = 0;
  for (PetscInt v = 0; v < n; v++) {
    border->n += end[v] > begin[v] + 1;
    nlist += end[v] > begin[v] + 1 ? end[v] - begin[v] : 0;
  }
  PetscCall(PetscMalloc2(border->n, &border->vert, nlist, &border->rank));
  PetscCall(PetscMalloc1(nlist, &list));
  PetscCall(PetscSFGetGraph(forest, NULL, NULL, NULL, &home));
  border->n = nlist = 0;
  for (PetscInt v = 0; v < n; v++) {
    if (end[v] == begin[v] + 1)
      continue;
    border->vert[border->n++] = (Shared){v, orig[v], end[v] - begin[v], border->rank + nlist, 0};
    for (PetscInt k = begin[v]; k < end[v]; k++)
      list[nlist++] = (PetscSFNode){home[v].rank, k};
  }
  PetscCall(PetscSFCreate(comm, &lists));
  PetscCall(
    PetscSFSetGraph(lists, start[nroot], nlist, NULL, PETSC_COPY_VALUES, list, PETSC_OWN_POINTER));
  PetscCall(SbForestBroadcast(lists, 1, MPI_INT, holder, border->rank));
  PetscCall(PetscSFDestroy(&lists));
  PetscCall(PetscSFDestroy(&forest));
  PetscCall(PetscFree3(orig, begin, end));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(holder));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int compare_ranks(const void *a, const void *b)
{
  const Shared *p = (const Shared *)a;
  const Shared *q = (const Shared *)b;

  if (p->n != q->n)
    return p->n < q->n ? -1 : 1;
  for (PetscInt i = 0; i < p->n; i++)
    if (p->rank[i] != q->rank[i])
      return p->rank[i] < q->rank[i] ? -1 : 1;
  return 0;
}

static int compare_shared(const void *a, const void *b)
{
  const Shared *p = (const Shared *)a;
  const Shared *q = (const Shared *)b;
  const int ranks = compare_ranks(a, b);

  if (ranks)
    return ranks;
  if (p->along != q->along)
    return p->along < q->along ? -1 : 1;
  return (p->orig > q->orig) - (p->orig < q->orig);
}

/* Lists the owned cells to copy, and the destination ranks. */
static PetscErrorCode list_copies(const SbLocalMesh *local, const Border *border, PetscBool all,
                                  PetscMPIInt me, PetscMPIInt size, SbRouteList *list)
{
  PetscInt *shared, *mark;

  PetscFunctionBeginUser;

  // position of each vertex in border->vert, -1: not shared
  PetscCall(PetscMalloc2(local->nvert, &shared, size, &mark));
  for (PetscInt v = 0; v < local->nvert; v++)
    shared[v] = -1;
  for (PetscInt i = 0; i < border->n; i++)
    shared[border->vert[i].vert] = i;

  // a cell goes once to each rank that owns one of its vertices (`all`: that has one)
  for (PetscMPIInt r = 0; r < size; r++)
    mark[r] = -1;
  for (PetscInt c = 0; c < local->ncell_owned; c++) {
    mark[me] = c;
    for (int a = 0; a < 4; a++) {
      const PetscInt v = local->cell[4 * (size_t)c + a];
      const Shared *s = shared[v] < 0 ? NULL : border->vert + shared[v];

      for (PetscInt k = 0; s && k < (all ? s->n : 1); k++) {
        const PetscMPIInt r = all ? s->rank[k] : local->owner[v];

        if (mark[r] != c)
          PetscCall(SbRouteAdd(list, c, r));
        mark[r] = c;
      }
    }
  }
  PetscCall(PetscFree2(shared, mark));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDistribute(PetscPartitioner partitioner, PetscBool all, SbMergedMesh *w,
                            SbLocalMesh *local)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)partitioner);
  SbLocalMesh whole = {.cell = w->cell, .data = w->data, .vertex = w->vertex};
  PetscMPIInt size, rank, *dest;
  PetscInt n;
  SbRouteList copies = {0};
  SbRoute route;
  SbLocalMesh owned, ghost;
  Border border;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  whole.ncell = whole.ncell_owned = w->ncell;
  whole.nvert = w->nvert;

  // partition the mesh, and take over its arrays, on one rank without a copy
  PetscCall(PetscMalloc1(w->ncell, &dest));
  PetscCall(SbPartition(partitioner, w, dest));
  PetscCall(PetscFree2(w->neighbour, w->remote));
  w->cell = NULL;
  w->data = NULL;
  w->vertex = NULL;
  if (size == 1) {
    *local = whole;
    PetscCall(PetscFree(dest));
    PetscCall(PetscCalloc1(local->nvert, &local->owner));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // each cell goes to its owner
  PetscCall(SbRouteCreate(comm, w->ncell, NULL, dest, &route));
  PetscCall(send_cells(&whole, PETSC_FALSE, &route, &owned));
  PetscCall(SbRouteDestroy(&route));
  PetscCall(SbLocalMeshDestroy(&whole));

  *local = (SbLocalMesh){0};
  PetscCall(append(local, &owned));
  local->ncell_owned = local->ncell;

  // owners of the shared vertices
  PetscCall(border_create(comm, w->Nvert, local, &border));

  // the vertices of each set of ranks, in equal parts along the longest axis of their bounding box
  for (PetscInt v = 0; v < local->nvert; v++)
    local->owner[v] = rank;
  if (border.n)
    qsort(border.vert, (size_t)border.n, sizeof(Shared), compare_shared);
  for (PetscInt i = 0; i < border.n; i += n) {
    Shared *s = border.vert + i;
    PetscReal box[6];
    int axis;

    for (n = 1; i + n < border.n && !compare_ranks(s, s + n);)
      n++;
    SbBoxClear(box);
    for (PetscInt k = 0; k < n; k++)
      SbBoxAdd(box, local->vertex[s[k].vert].x);
    axis = SbBoxLongest(box);
    for (PetscInt k = 0; k < n; k++)
      s[k].along = local->vertex[s[k].vert].x[axis];
    qsort(s, (size_t)n, sizeof(Shared), compare_shared);
    for (PetscInt k = 0; k < n; k++)
      local->owner[s[k].vert] = s[k].rank[(PetscInt64)k * s[k].n / n];
  }
  PetscCall(list_copies(local, &border, all, rank, size, &copies));
  PetscCall(PetscFree2(border.vert, border.rank));
  PetscCall(SbRouteCreate(comm, copies.n, copies.item, copies.rank, &route));
  PetscCall(send_cells(local, PETSC_TRUE, &route, &ghost));
  PetscCall(SbRouteDestroy(&route));
  PetscCall(append(local, &ghost));
  PetscFunctionReturn(PETSC_SUCCESS);
}
