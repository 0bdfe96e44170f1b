/*
  order.c - reverse Cuthill-McKee order of the vertices of this rank (Cuthill and McKee, 1969;
  George and Liu, 1979).

  Two vertices are adjacent when a cell has both: the search visits the cells of a vertex, each cell
  once, and then their vertices; the vertex graph is never formed. Each connected component starts
  at a peripheral vertex, which one search from an arbitrary vertex finds (further searches did not
  reduce the bandwidth of real meshes). Components are numbered one after the other, in the order of
  their first vertex.
*/
#include "mesh_impl.h"

typedef struct {
  const PetscInt *cell; /* [ncell][4] vertices, -1: ignored */
  PetscInt *start;      /* [nvert + 1] offsets into incident[] */
  PetscInt *incident;   /* corners 4 cell + a at each vertex */
  PetscInt *vert_mark;  /* [nvert] number of the last search that visited the vertex */
  PetscInt *cell_mark;  /* [ncell] */
  PetscInt search;
} Graph;

static inline PetscInt degree(const Graph *g, PetscInt v)
{
  return g->start[v + 1] - g->start[v];
}

/* Breadth-first search from a vertex: number of those reached; `last`: where the last level
   begins. */
static PetscInt search(Graph *g, PetscInt root, PetscInt queue[], PetscInt *last)
{
  PetscInt n = 1;
  PetscInt level_end = 1;
  PetscInt begin;

  g->search++;
  g->vert_mark[root] = g->search;
  queue[0] = root;
  *last = 0;
  for (PetscInt i = 0; i < n; i++) {
    if (i == level_end) {
      *last = level_end;
      level_end = n;
    }

    // append the unvisited neighbours, sorted by ascending degree
    begin = n;
    for (PetscInt k = g->start[queue[i]]; k < g->start[queue[i] + 1]; k++) {
      const PetscInt c = g->incident[k] / 4;

      if (g->cell_mark[c] == g->search)
        continue;
      g->cell_mark[c] = g->search;
      for (int a = 0; a < 4; a++) {
        const PetscInt w = g->cell[4 * c + a];
        PetscInt j = n;

        if (w < 0 || g->vert_mark[w] == g->search)
          continue;
        g->vert_mark[w] = g->search;
        for (; j > begin && degree(g, queue[j - 1]) > degree(g, w); j--)
          queue[j] = queue[j - 1];
        queue[j] = w;
        n++;
      }
    }
  }
  return n;
}

PetscErrorCode SbOrderRCM(PetscInt nvert, PetscInt ncell, const PetscInt cell[], PetscInt order[])
{
  Graph g = {.cell = cell};

  PetscFunctionBeginUser;
  PetscCall(SbBucketByKey(4 * ncell, cell, nvert, &g.start, &g.incident));
  PetscCall(PetscCalloc2(nvert, &g.vert_mark, ncell, &g.cell_mark));
  for (PetscInt v = 0, done = 0; v < nvert; v++) {
    PetscInt n, last, root;

    if (g.vert_mark[v])
      continue; /* in an earlier component */

    // order of the component of v, from a vertex of lowest degree in the last level; then reversed
    n = search(&g, v, order + done, &last);
    root = order[done + last];
    for (PetscInt k = last; k < n; k++)
      if (degree(&g, order[done + k]) < degree(&g, root))
        root = order[done + k];
    n = search(&g, root, order + done, &last);
    for (PetscInt i = 0; i < n / 2; i++) {
      const PetscInt keep = order[done + i];

      order[done + i] = order[done + n - 1 - i];
      order[done + n - 1 - i] = keep;
    }
    done += n;
  }
  PetscCall(PetscFree(g.start));
  PetscCall(PetscFree(g.incident));
  PetscCall(PetscFree2(g.vert_mark, g.cell_mark));
  PetscFunctionReturn(PETSC_SUCCESS);
}
