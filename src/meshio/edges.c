/*
  edges.c - list of the unique edges of all tets, triangles and lines.

  Counting sort: each edge goes into the bucket of its lower vertex; each bucket is sorted, and
  equal neighbours in it are one edge. The number of an edge is its position in the list.
*/
#include "meshio_impl.h"

static const int edge_count[4] = {0, 1, 3,
                                  6}; /* edges by dimension; triangles use the pairs 0, 1 and 3 */
static const int edge_row[4][6] = {{0}, {0}, {0, 1, 3}, {0, 1, 2, 3, 4, 5}};

PetscErrorCode SbImportEdgesCreate(const SbImport *im, SbImportEdges *edges)
{
  PetscInt *low, *high, *item;
  PetscInt n = 0;
  PetscInt begin = 0;
  PetscInt kept = 0;
  PetscInt64 total = 0;

  PetscFunctionBeginUser;
  *edges = (SbImportEdges){.nvert = im->nvert};
  for (int d = 1; d < 4; d++)
    total += (PetscInt64)edge_count[d] * im->item[d].n;
  PetscCheck(total <= PETSC_MAX_INT, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: has more edges than this build can number", im->where);

  // edges of all items, by their lower vertices
  PetscCall(PetscMalloc2((size_t)total, &low, (size_t)total, &high));
  for (int d = 1; d < 4; d++) {
    for (PetscInt i = 0; i < edge_count[d] * im->item[d].n; i++) {
      const PetscInt *v = im->item[d].vert + (size_t)(d + 1) * (size_t)(i / edge_count[d]);
      const int *pair = SbTetEdge[edge_row[d][i % edge_count[d]]];

      low[n] = PetscMin(v[pair[0]], v[pair[1]]);
      high[n++] = PetscMax(v[pair[0]], v[pair[1]]);
    }
  }
  PetscCall(SbBucketByKey(n, low, im->nvert, &edges->start, &item));
  PetscCall(PetscMalloc1(n, &edges->high));

  // sort each bucket, and remove duplicate edges
  for (PetscInt v = 0; v < edges->nvert; v++) {
    const PetscInt end = edges->start[v + 1];

    for (PetscInt i = begin; i < end; i++)
      edges->high[i] = high[item[i]];
    PetscCall(PetscSortInt(end - begin, edges->high + begin));
    for (PetscInt i = begin; i < end; i++) {
      if (i > begin && edges->high[i] == edges->high[i - 1])
        continue;
      edges->high[kept++] = edges->high[i];
    }
    edges->start[v + 1] = kept;
    begin = end;
  }
  edges->nedge = kept;
  PetscCall(PetscFree2(low, high));
  PetscCall(PetscFree(item));
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
  const PetscInt low = PetscMin(a, b);
  const PetscInt begin = edges->start[low];
  PetscInt at;

  (void)PetscFindInt(PetscMax(a, b), edges->start[low + 1] - begin, edges->high + begin, &at);
  return at < 0 ? -1 : begin + at;
}

void SbImportEdgeNodes(const SbImport *im, const SbImportEdges *edges, PetscReal x[])
{
  for (PetscInt a = 0; a < edges->nvert; a++)
    for (PetscInt e = edges->start[a]; e < edges->start[a + 1]; e++)
      for (int i = 0; i < 3; i++)
        x[3 * e + i] = (im->x[3 * a + i] + im->x[3 * edges->high[e] + i]) / 2;
  for (PetscInt m = 0; m < im->nmiddle.n; m++) {
    const SbMiddle *middle = &im->middle[m];
    const PetscInt e = SbImportEdgesFind(edges, middle->end[0], middle->end[1]);

    for (int i = 0; e >= 0 && i < 3; i++)
      x[3 * e + i] += middle->off[i];
  }
}
