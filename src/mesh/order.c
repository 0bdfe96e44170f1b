/*
  order.c - reverse Cuthill-McKee order of this rank's vertices (Cuthill and McKee, 1969; George and Liu, 1979).

  Two vertices are neighbours when a cell holds both, so the search goes from vertices to cells and on to their vertices,
  visiting each cell once; the graph of vertices is never formed. Each connected part starts at an end, which a search
  from anywhere finds (further searches did not narrow the bandwidth of real meshes), and is numbered as a whole, parts
  in the order of their first vertex.
*/
#include "mesh_impl.h"

typedef struct {
  const PetscInt *cell; /* [ncell][4] vertices, -1 where one takes no part */
  PetscInt *start;      /* [nvert + 1] into incident */
  PetscInt *incident;   /* corners 4 cell + a at each vertex */
  PetscInt *vert_mark;  /* [nvert] number of the search that came by last */
  PetscInt *cell_mark;  /* [ncell] */
  PetscInt search;
} Graph;

static inline PetscInt degree(const Graph *g, PetscInt v)
{
  return g->start[v + 1] - g->start[v];
}

/* Breadth-first search from a vertex: the number of vertices reached, and where the last level of them begins. */
static PetscInt search(Graph *g, PetscInt root, PetscInt queue[], PetscInt *last)
{
  PetscInt n = 1, level_end = 1, begin;

  g->search++;
  g->vert_mark[root] = g->search;
  queue[0] = root;
  *last = 0;
  for (PetscInt i = 0; i < n; i++) {
    if (i == level_end) {
      *last = level_end;
      level_end = n;
    }
    // appends the unseen neighbours, those with few cells first
    begin = n;
    for (PetscInt k = g->start[queue[i]]; k < g->start[queue[i] + 1]; k++) {
      const PetscInt c = g->incident[k] / 4;

      if (g->cell_mark[c] == g->search) continue;
      g->cell_mark[c] = g->search;
      for (int a = 0; a < 4; a++) {
        const PetscInt w = g->cell[4 * c + a];
        PetscInt j = n;

        if (w < 0 || g->vert_mark[w] == g->search) continue;
        g->vert_mark[w] = g->search;
        for (; j > begin && degree(g, queue[j - 1]) > degree(g, w); j--) queue[j] = queue[j - 1];
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

    if (g.vert_mark[v]) continue; /* seen by the search of an earlier part */
    // Cuthill-McKee order of the part that holds v, from a vertex of few cells as far away as any
    n = search(&g, v, order + done, &last);
    root = order[done + last];
    for (PetscInt k = last; k < n; k++) {
      if (degree(&g, order[done + k]) < degree(&g, root)) root = order[done + k];
    }
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
