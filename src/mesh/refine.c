/*
  refine.c - regular refinement: each edge is bisected, each tet is divided into eight.

  Four children are at the corners. The remaining octahedron is cut into four tets around the shortest of its three diagonals,
  which keeps the shape quality of repeated refinement bounded (Zhang, "Successive subdivisions of tetrahedra and multigrid methods on
  tetrahedral meshes", 1995). Diagonals are inside a tet, so the refined mesh is conforming for any choice. Children have the
  orientation of their parent.

  New vertices on the boundary are at the middle of straight edges; the original geometry is unknown. A curved tet keeps its shape: the P2 map, restricted to a child, has
  the following offsets of edge nodes from the midpoint: o/4 on both halves of an edge with offset o; o/4 of the opposite edge of the triangle, on an edge between two midpoints; on
  the diagonal a quarter of the sum of the offsets of the four edges that it does not connect, less a quarter of those of the two edges that it connects.
*/
#include "sbkernel.h"
#include "mesh_impl.h"

enum { M01, M02, M03, M12, M13, M23 }; /* midpoints of the edges of a tet, in the order of SbTetEdge */

/* Three diagonals of the octahedron, and the four midpoints around each, such that (from, to, ring[i], ring[i + 1]) is positively oriented. */
static const struct {
  int from, to, ring[4];
} diagonals[3] = {
  {M01, M23, {M02, M03, M13, M12}},
  {M02, M13, {M03, M01, M12, M23}},
  {M03, M12, {M01, M02, M23, M13}},
};

/* Vertices of the eight children of the tet v with the edge midpoints m. */
static void split_tet(const PetscReal x[], const PetscInt v[4], const PetscInt m[6], PetscInt child[8][4])
{
  const PetscInt corner[4][4] = {{v[0], m[M01], m[M02], m[M03]},
                                 {m[M01], v[1], m[M12], m[M13]},
                                 {m[M02], m[M12], v[2], m[M23]},
                                 {m[M03], m[M13], m[M23], v[3]}};
  PetscReal shortest = PETSC_MAX_REAL;
  int best = 0;

  memcpy(child, corner, sizeof(corner));
  for (int d = 0; d < 3; d++) {
    PetscReal r[3], length;

    SbSubtract(x + 3 * m[diagonals[d].from], x + 3 * m[diagonals[d].to], r);
    length = SbDot3(r, r);

    /* tolerance: among equal diagonals the first one is taken, independent of rounding */
    if (length < shortest * (1 - 1e-12)) shortest = length, best = d;
  }
  for (int k = 0; k < 4; k++) {
    child[4 + k][0] = m[diagonals[best].from];
    child[4 + k][1] = m[diagonals[best].to];
    child[4 + k][2] = m[diagonals[best].ring[k]];
    child[4 + k][3] = m[diagonals[best].ring[(k + 1) % 4]];
  }
}

/* Adds a curved edge, if its offset is not zero. */
static PetscErrorCode add_middle(SbImport *im, PetscInt a, PetscInt b, const PetscReal off[3])
{
  PetscFunctionBeginUser;
  if (off[0] == 0 && off[1] == 0 && off[2] == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(++im->nmiddle.n, sizeof(*im->middle), &im->nmiddle.capacity, &im->middle));
  im->middle[im->nmiddle.n - 1] =
    (SbMiddle){.end = {PetscMin(a, b), PetscMax(a, b)}, .node = -1, .off = {off[0], off[1], off[2]}};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Curved edges of the children of a tet; off[][3]: offsets of the parent edges, indexed by midpoint vertex - nvert. */
static PetscErrorCode curve_children(SbImport *im, const PetscInt v[4], PetscInt nvert, const PetscReal off[],
                                     const PetscInt child[8][4])
{
  const PetscInt m[6] = {child[0][1], child[0][2], child[0][3], child[1][2], child[1][3], child[2][3]},
                 from = child[4][0], to = child[4][1];
  PetscReal quarter[6][3], inner[3] = {0, 0, 0};
  PetscInt edge_at[4][4];

  PetscFunctionBeginUser;
  for (int e = 0; e < 6; e++) {
    const int *p = SbTetEdge[e];
    const PetscReal sign = m[e] == from || m[e] == to ? -1 : 1;

    edge_at[p[0]][p[1]] = edge_at[p[1]][p[0]] = e;
    for (int k = 0; k < 3; k++) {
      quarter[e][k] = 0.25 * off[3 * (m[e] - nvert) + k];
      inner[k] += sign * quarter[e][k];
    }
    for (int i = 0; i < 2; i++) PetscCall(add_middle(im, v[p[i]], m[e], quarter[e]));
  }
  // edge between the midpoints of the edges from corner i to j and k
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++)
      for (int k = 0; k < j; k++)
        if (i != j && i != k)
          PetscCall(add_middle(im, m[edge_at[i][j]], m[edge_at[i][k]], quarter[edge_at[j][k]]));
  PetscCall(add_middle(im, from, to, inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices of the children of one item, [2^dim][dim + 1]. */
static void split(const SbImport *im, int dim, const PetscInt v[], const SbImportEdges *edges,
                  PetscInt child[])
{
  PetscInt m[6];

  for (int e = 0; e < 6; e++) {
    const int *p = SbTetEdge[e];

    if (p[1] <= dim) m[e] = edges->nvert + SbImportEdgesFind(edges, v[p[0]], v[p[1]]);
  }
  if (dim == 3) {
    split_tet(im->x, v, m, (PetscInt(*)[4])child);
  } else if (dim == 2) {
    const PetscInt four[12] = {v[0],   m[M01], m[M02], m[M01], v[1],   m[M12],
                               m[M02], m[M12], v[2],   m[M01], m[M12], m[M02]};

    memcpy(child, four, sizeof(four));
  } else {
    const PetscInt two[4] = {v[0], m[M01], m[M01], v[1]};

    memcpy(child, two, sizeof(two));
  }
}

PetscErrorCode SbMeshFileRefine(SbImport *im)
{
  SbImportEdges edges;
  const PetscInt nvert = im->nvert, curved = im->nmiddle.n;
  PetscInt n;
  PetscReal *off, largest;

  PetscFunctionBeginUser;
  PetscCheck(im->item[3].n <= PETSC_MAX_INT / 64, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %" PetscInt_FMT " tets, refined, are more than this build can number", im->where,
             im->item[3].n);
  PetscCall(SbImportEdgesCreate(im, &edges));
  // new vertices at the edge nodes, after the old ones
  n = im->nvert + edges.nedge;
  PetscCall(PetscRealloc(3 * (size_t)n * sizeof(PetscReal), &im->x));
  PetscCall(PetscRealloc((size_t)n * sizeof(int64_t), &im->vert_number));
  SbImportEdgeNodes(im, &edges, im->x + 3 * nvert);
  PetscCall(PetscCalloc1(curved ? 3 * (size_t)edges.nedge : 0, &off));
  for (PetscInt i = 0; i < curved; i++) {
    const SbMiddle *middle = &im->middle[i];
    const PetscInt e = SbImportEdgesFind(&edges, middle->end[0], middle->end[1]);

    for (int k = 0; e >= 0 && k < 3; k++) off[3 * e + k] = middle->off[k];
  }
  im->nmiddle.n = 0;
  for (PetscInt v = 0; v < n; v++) im->vert_number[v] = v + 1;
  im->nvert = n;
  // children of each item, with its tags
  for (int d = 1; d < 4; d++) {
    static const char *const what[4] = {"points", "lines", "triangles", "tets"};
    SbItems parent = im->item[d], *item = &im->item[d];
    const PetscInt nchild = 1 << d;

    PetscCall(PetscMemzero(item, sizeof(*item)));
    PetscCall(SbImportSetItems(im, d, nchild * parent.n));
    for (PetscInt i = 0; i < parent.n; i++) {
      const PetscInt *v = parent.vert + (size_t)(d + 1) * (size_t)i;
      PetscInt *child = item->vert + (size_t)(d + 1) * (size_t)nchild * (size_t)i;

      split(im, d, v, &edges, child);
      if (d == 3 && curved)
        PetscCall(curve_children(im, v, nvert, off, (const PetscInt(*)[4])(const void *)child));
      for (PetscInt k = 0; k < nchild; k++) item->tags[nchild * i + k] = parent.tags[i];
      if (im->progress && !(i & 0xffff))
        PetscCall(
          im->progress(what[d], (PetscInt64)nchild * i, (PetscInt64)nchild * parent.n, im->progress_ctx));
    }
    PetscCall(SbItemsFree(&parent));
  }
  PetscCall(SbImportEdgesDestroy(&edges));
  PetscCall(PetscFree(off));
  PetscCall(SbImportMiddles(im, NULL, &largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}
