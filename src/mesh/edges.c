/*
  edges.c - edges: pairs of vertices that a tet, triangle or line joins, each once.

  The edges of every item go into the bucket of their lower vertex (a counting sort); each bucket is sorted, equal neighbours
  in it are one edge. The number of an edge is its position in the list.
*/
#include "mesh_impl.h"

static const int edge_count[4] = {0, 1, 3,
                                  6}; /* of an item, by dimension; triangles use the pairs 0, 1 and 3 */
static const int edge_row[4][6] = {{0}, {0}, {0, 1, 3}, {0, 1, 2, 3, 4, 5}};

static inline void edge_of(const SbItems *item, int dim, PetscInt i, int e, PetscInt *low, PetscInt *high)
{
  const PetscInt *v = item->vert + (size_t)(dim + 1) * (size_t)i;
  const PetscInt a = v[SbTetEdge[edge_row[dim][e]][0]], b = v[SbTetEdge[edge_row[dim][e]][1]];

  *low = PetscMin(a, b);
  *high = PetscMax(a, b);
}

PetscErrorCode SbImportEdgesCreate(const SbImport *im, SbImportEdges *edges)
{
  PetscInt *next, low, high;
  PetscInt64 total = 0;
  PetscInt begin = 0, kept = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(edges, sizeof(*edges)));
  edges->nvert = im->nvert;
  for (int d = 1; d < 4; d++) total += (PetscInt64)edge_count[d] * im->item[d].n;
  PetscCheck(total <= PETSC_MAX_INT, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: has more edges than this build can number", im->where);
  PetscCall(PetscCalloc1((size_t)im->nvert + 1, &edges->start));
  PetscCall(PetscMalloc1((size_t)total, &edges->high));
  for (int d = 1; d < 4; d++) {
    for (PetscInt i = 0; i < im->item[d].n; i++) {
      for (int e = 0; e < edge_count[d]; e++) {
        edge_of(&im->item[d], d, i, e, &low, &high);
        edges->start[low + 1]++;
      }
    }
  }
  for (PetscInt v = 0; v < im->nvert; v++) edges->start[v + 1] += edges->start[v];
  PetscCall(PetscMalloc1(im->nvert, &next));
  PetscCall(PetscArraycpy(next, edges->start, im->nvert));
  for (int d = 1; d < 4; d++) {
    for (PetscInt i = 0; i < im->item[d].n; i++) {
      for (int e = 0; e < edge_count[d]; e++) {
        edge_of(&im->item[d], d, i, e, &low, &high);
        edges->high[next[low]++] = high;
      }
    }
  }
  PetscCall(PetscFree(next));
  // sorts each bucket and closes the gaps of repeated edges
  for (PetscInt v = 0; v < edges->nvert; v++) {
    const PetscInt end = edges->start[v + 1];

    PetscCall(PetscSortInt(end - begin, edges->high + begin));
    for (PetscInt i = begin; i < end; i++) {
      if (i > begin && edges->high[i] == edges->high[i - 1]) continue;
      edges->high[kept++] = edges->high[i];
    }
    edges->start[v + 1] = kept;
    begin = end;
  }
  edges->nedge = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportEdgesDestroy(SbImportEdges *edges)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(edges->start));
  PetscCall(PetscFree(edges->high));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbImportEdgesFind(const SbImportEdges *edges, PetscInt a, PetscInt b)
{
  const PetscInt low = PetscMin(a, b), begin = edges->start[low];
  PetscInt at;

  (void)PetscFindInt(PetscMax(a, b), edges->start[low + 1] - begin, edges->high + begin, &at);
  return at < 0 ? -1 : begin + at;
}
