/*
  refine.c - regular refinement: each edge is bisected, each tet is divided into eight.

  Four children are at the corners. The remaining octahedron is cut into four tets around the
  shortest of its three diagonals, which keeps the shape quality of repeated refinement bounded
  (Zhang, "Successive subdivisions of tetrahedra and multigrid methods on tetrahedral meshes",
  1995). Diagonals are inside a tet, so the refined mesh is conforming for any choice. Children have
  the orientation of their parent.

  New vertices on the boundary are at the middle of straight edges; the original geometry is
  unknown. A curved tet keeps its shape: the P2 map, restricted to a child, has the following
  offsets of edge nodes from the midpoint: o/4 on both halves of an edge with offset o; o/4 of the
  opposite edge of the triangle, on an edge between two midpoints; on the diagonal a quarter of the
  sum of the offsets of the four edges that it does not connect, less a quarter of those of the two
  edges that it connects.
*/
#include "mesh_impl.h"

/* Nodes of an item: corners 0 to 3, then the midpoints of its edges in the order of SbTetEdge. */
enum {
  M01 = 4,
  M02,
  M03,
  M12,
  M13,
  M23,
  NODES
};

/* Children at the corners of a line, a triangle (then the one in the middle) and a tet. */
static const int ncorner[4] = {0, 4, 12, 16};
static const int corners[4][16] = {
  {0},
  {0, M01, M01, 1},
  {0, M01, M02, M01, 1, M12, M02, M12, 2, M01, M12, M02},
  {0, M01, M02, M03, M01, 1, M12, M13, M02, M12, 2, M23, M03, M13, M23, 3},
};

/* Three diagonals of the octahedron: their ends, and the four midpoints around each and the first
   one again, such that (from, to, ring[i], ring[i + 1]) is positively oriented. */
static const int diagonals[3][7] = {
  {M01, M23, M02, M03, M13, M12, M02},
  {M02, M13, M03, M01, M12, M23, M03},
  {M03, M12, M01, M02, M23, M13, M01},
};

/* Vertices of the children of one item, [2^dim][dim + 1]. */
static void split(const SbImport *im, int dim, const PetscInt v[], const SbImportEdges *edges,
                  PetscInt child[])
{
  PetscInt node[NODES];
  PetscReal shortest = PETSC_MAX_REAL;
  const int *best = diagonals[0];

  for (int k = 0; k <= dim; k++)
    node[k] = v[k];
  for (int e = 0; e < 6; e++)
    if (SbTetEdge[e][1] <= dim)
      node[M01 + e] =
        edges->nvert + SbImportEdgesFind(edges, v[SbTetEdge[e][0]], v[SbTetEdge[e][1]]);
  for (int i = 0; i < ncorner[dim]; i++)
    child[i] = node[corners[dim][i]];
  if (dim < 3)
    return;
  for (int d = 0; d < 3; d++) {
    const PetscReal length2 =
      SbDistance2(im->x + 3 * node[diagonals[d][0]], im->x + 3 * node[diagonals[d][1]]);

    /* tolerance: among equal diagonals the first one is taken, independent of rounding */
    if (!(length2 < shortest * (1 - 1e-12)))
      continue;
    shortest = length2;
    best = diagonals[d];
  }
  for (int i = 0; i < 16; i++)
    child[16 + i] = node[best[i % 4 < 2 ? i % 4 : i / 4 + i % 4]];
}

/* Adds a curved edge, if its offset is not zero. */
static PetscErrorCode add_middle(SbImport *im, PetscInt a, PetscInt b, const PetscReal off[3])
{
  PetscFunctionBeginUser;
  if (off[0] == 0 && off[1] == 0 && off[2] == 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(++im->nmiddle.n, sizeof(*im->middle), &im->nmiddle.capacity, &im->middle));
  im->middle[im->nmiddle.n - 1] = (SbMiddle){
    .end = {PetscMin(a, b), PetscMax(a, b)}, .node = -1, .off = {off[0], off[1], off[2]}};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Curved edges of the children of a tet; off[][3]: offsets of parent edges, by midpoint vertex -
   nvert. */
static PetscErrorCode curve_children(SbImport *im, const PetscInt v[4], PetscInt nvert,
                                     const PetscReal off[], const PetscInt child[8][4])
{
  const PetscInt m[6] = {child[0][1], child[0][2], child[0][3],
                         child[1][2], child[1][3], child[2][3]};
  const PetscInt from = child[4][0];
  const PetscInt to = child[4][1];
  PetscReal quarter[6][3];
  PetscReal inner[3] = {0, 0, 0};
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
    for (int i = 0; i < 2; i++)
      PetscCall(add_middle(im, v[p[i]], m[e], quarter[e]));
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

PetscErrorCode SbMeshFileRefine(SbImport *im)
{
  SbImportEdges edges;
  const PetscInt nvert = im->nvert;
  const PetscInt curved = im->nmiddle.n;
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

    for (int k = 0; e >= 0 && k < 3; k++)
      off[3 * e + k] = middle->off[k];
  }
  im->nmiddle.n = 0;
  for (PetscInt v = 0; v < n; v++)
    im->vert_number[v] = v + 1;
  im->nvert = n;

  // children of each item, with its tags
  for (int d = 1; d < 4; d++) {
    static const char *const what[4] = {"points", "lines", "triangles", "tets"};
    SbItems parent = im->item[d];
    SbItems *item = &im->item[d];
    const PetscInt nchild = 1 << d;

    *item = (SbItems){0};
    PetscCall(SbImportSetItems(im, d, nchild * parent.n));
    for (PetscInt i = 0; i < parent.n; i++) {
      const PetscInt *v = parent.vert + (size_t)(d + 1) * (size_t)i;
      PetscInt *child = item->vert + (size_t)(d + 1) * (size_t)nchild * (size_t)i;

      split(im, d, v, &edges, child);
      if (d == 3 && curved)
        PetscCall(curve_children(im, v, nvert, off, (const PetscInt(*)[4])(const void *)child));
      for (PetscInt k = 0; k < nchild; k++)
        item->tags[nchild * i + k] = parent.tags[i];
      if (im->progress && !(i & 0xffff))
        PetscCall(im->progress(what[d], (PetscInt64)nchild * i, (PetscInt64)nchild * parent.n,
                               im->progress_ctx));
    }
    PetscCall(SbItemsFree(&parent));
  }
  PetscCall(SbImportEdgesDestroy(&edges));
  PetscCall(PetscFree(off));
  PetscCall(SbImportMiddles(im, NULL, &largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}
