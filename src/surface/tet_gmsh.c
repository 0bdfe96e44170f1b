/*
  tet_gmsh.c - tets by the gmsh library (Geuzaine and Remacle 2009), in its child process.

  The surface becomes discrete entities, one for each pair of regions that meet there. Kept, they are the mesh of the boundary as
  they are. Remeshed, gmsh cuts them along edges that turn by more than the angle, finds a parametrisation of each
  piece (classifySurfaces, createGeometry) and meshes pieces and seams with the wanted size. Each region is a volume
  within its entities. The tets are made by its Delaunay method and improved by its own optimisers, and by Netgen's where it has it.
*/
#include "sbgmsh.h"
#include "sbtet.h"
#include "tet_backends.h"

enum { TRIANGLE = 2, TET = 4 }; /* gmsh's numbers of element types */

/* An entity of the model and the regions on its sides. */
typedef struct {
  int tag;
  PetscInt side[2]; /* in front and behind, as in SbSurface */
} Piece;

typedef struct {
  const SbTetJob *job;
  PetscInt npiece;
  Piece *piece;
} Model;

/* ------------------------------------------------------------------ into the model */

static PetscErrorCode add_surface(const SbGmsh *g, Model *m)
{
  const SbSurface *s = m->job->surface;
  PetscInt *piece;
  size_t *tag, *node, *vertex;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(s->ntri, &piece, s->ntri, &tag, 3 * (size_t)s->ntri, &node));
  // the piece between the regions of each triangle, made when new
  for (PetscInt f = 0; f < s->ntri; f++) {
    const PetscInt *side = s->side + 2 * f;
    PetscInt k = 0;

    while (k < m->npiece && (m->piece[k].side[0] != side[0] || m->piece[k].side[1] != side[1])) k++;
    if (k == m->npiece) {
      PetscCall(PetscRealloc((size_t)(m->npiece + 1) * sizeof(*m->piece), &m->piece));
      m->piece[m->npiece++] = (Piece){(int)k + 1, {side[0], side[1]}};
    }
    piece[f] = k;
  }
  for (PetscInt k = 0; k < m->npiece; k++) SB_GMSH(g, ModelAddDiscreteEntity, 2, m->piece[k].tag, NULL, 0);
  // nodes: all on the first entity, gmsh assigns them by the triangles
  PetscCall(PetscMalloc1(s->nvert, &vertex));
  for (PetscInt v = 0; v < s->nvert; v++) vertex[v] = (size_t)v + 1;
  SB_GMSH(g, ModelMeshAddNodes, 2, 1, vertex, (size_t)s->nvert, s->x, 3 * (size_t)s->nvert, NULL, 0);
  PetscCall(PetscFree(vertex));
  for (PetscInt k = 0; k < m->npiece; k++) {
    size_t n = 0;

    for (PetscInt f = 0; f < s->ntri; f++) {
      if (piece[f] != k) continue;
      tag[n] = (size_t)f + 1;
      for (int i = 0; i < 3; i++) node[3 * n + (size_t)i] = (size_t)s->tri[3 * f + i] + 1;
      n++;
    }
    SB_GMSH(g, ModelMeshAddElementsByType, m->piece[k].tag, TRIANGLE, tag, n, node, 3 * n);
  }
  PetscCall(PetscFree3(piece, tag, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the cut along edges the pieces are new ones, of the same triangles. */
static PetscErrorCode cut_surface(const SbGmsh *g, Model *m)
{
  const SbSurface *s = m->job->surface;
  const PetscReal angle = m->job->options.angle * PETSC_PI / 180;
  int *entity;
  size_t n;

  PetscFunctionBeginUser;
  SB_GMSH(g, ModelMeshClassifySurfaces, angle, 1, 1, PETSC_PI, 0);
  SB_GMSH(g, ModelMeshCreateGeometry, NULL, 0);
  SB_GMSH(g, ModelGetEntities, &entity, &n, 2);
  m->npiece = 0;
  PetscCall(PetscRealloc(n / 2 * sizeof(*m->piece), &m->piece));
  for (size_t i = 0; i + 1 < n; i += 2) {
    size_t *tag, ntag, *node, nnode;

    SB_GMSH(g, ModelMeshGetElementsByType, TRIANGLE, &tag, &ntag, &node, &nnode, entity[i + 1], 0, 1);
    if (ntag) {
      const size_t f = tag[0] - 1;

      PetscCheck(f < (size_t)s->ntri, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
                 "a piece of the surface has triangle %zu, which is not there", tag[0]);
      m->piece[m->npiece++] = (Piece){entity[i + 1], {s->side[2 * f], s->side[2 * f + 1]}};
    }
    g->Free(tag);
    g->Free(node);
  }
  g->Free(entity);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ out of the model */

/* Items of one entity; their corners are tags of nodes, from 0. */
static PetscErrorCode take_items(const SbGmsh *g, int dim, int entity, PetscInt tags, SbImport *im)
{
  size_t *tag, ntag, *node, nnode;

  PetscFunctionBeginUser;
  SB_GMSH(g, ModelMeshGetElementsByType, dim == 3 ? TET : TRIANGLE, &tag, &ntag, &node, &nnode, entity, 0, 1);
  for (size_t i = 0; i < ntag; i++) {
    PetscInt vert[4] = {0, 0, 0, 0};

    for (int k = 0; k <= dim; k++) vert[k] = (PetscInt)node[i * (size_t)(dim + 1) + (size_t)k] - 1;
    PetscCall(SbImportAddItem(im, dim, vert, tags, (int64_t)i + 1));
  }
  g->Free(tag);
  g->Free(node);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the job */

static PetscErrorCode work(const SbGmsh *g, void *ctx, SbImport *im)
{
  Model m = {.job = (const SbTetJob *)ctx};
  const SbSurface *s;
  int missing = 0, *tag;
  size_t *number, ntag, nx, nparameter, most = 0;
  double *x, *parameter;

  PetscFunctionBeginUser;
  PetscCall(add_surface(g, &m));
  if (m.job->remesh) PetscCall(cut_surface(g, &m));
  // a volume for each region, between the pieces that have it on a side
  PetscCall(PetscMalloc1(m.npiece, &tag));
  for (PetscInt r = 0; r < m.job->surface->nregion; r++) {
    int loop = (int)r + 1;
    size_t n = 0;

    for (PetscInt k = 0; k < m.npiece; k++) {
      if (m.piece[k].side[0] == r || m.piece[k].side[1] == r) tag[n++] = m.piece[k].tag;
    }
    SB_GMSH(g, ModelGeoAddSurfaceLoop, tag, n, loop);
    SB_GMSH(g, ModelGeoAddVolume, &loop, 1, loop);
  }
  SB_GMSH0(g, ModelGeoSynchronize);
  PetscCall(PetscFree(tag));
  SB_GMSH(g, OptionSetNumber, "Mesh.MeshSizeMax", m.job->size);
  SB_GMSH(g, OptionSetNumber, "Mesh.MeshSizeMin", m.job->remesh ? m.job->size : 0);
  SB_GMSH(g, OptionSetNumber, "Mesh.MeshSizeFromPoints", 0);
  SB_GMSH(g, OptionSetNumber, "Mesh.MeshSizeExtendFromBoundary", m.job->remesh ? 0 : 1);
  SB_GMSH(g, OptionSetNumber, "Mesh.Optimize", 1);
  SB_GMSH(g, OptionSetNumber, "Mesh.OptimizeThreshold", 0.4);
  SB_GMSH(g, ModelMeshGenerate, 3);
  // optimises beyond Generate; Netgen's optimiser is not in every build of gmsh
  for (int pass = 0; pass < 2; pass++) {
    SB_GMSH(g, ModelMeshOptimize, "Relocate3D", 0, 2, NULL, 0);
    SB_GMSH(g, ModelMeshOptimize, "", 0, 1, NULL, 0);
    if (!missing) g->ModelMeshOptimize("Netgen", 0, 1, NULL, 0, &missing);
  }
  // tets by region, triangles by entity, then the nodes they use
  s = m.job->surface;
  for (PetscInt r = 0; r < s->nregion; r++) PetscCall(take_items(g, 3, (int)r + 1, r, im));
  PetscCheck(im->item[3].n, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "no tets were made");
  for (PetscInt k = 0; k < m.npiece; k++) PetscCall(take_items(g, 2, m.piece[k].tag, 0, im));
  // vertices in the order of their tags, so that those of a kept surface are the first ones; left out: the old surface's
  SB_GMSH(g, ModelMeshGetNodes, &number, &ntag, &x, &nx, &parameter, &nparameter, -1, -1, 0, 0);
  for (size_t i = 0; i < ntag; i++) most = PetscMax(most, number[i]);
  PetscCheck(most < PETSC_MAX_INT / 8, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "too many nodes");
  PetscCall(SbImportSetVertices(im, (PetscInt)most));
  for (size_t i = 0; i < ntag; i++) PetscCall(PetscArraycpy(im->x + 3 * (number[i] - 1), x + 3 * i, 3));
  PetscCall(SbImportDropUnused(im));
  g->Free(number);
  g->Free(x);
  g->Free(parameter);
  PetscCall(PetscFree(m.piece));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tags of new triangles: the triangle of the surface nearest to their middle, so groups survive when a surface is remeshed. */
static PetscErrorCode nearest_triangles(const SbSurface *s, SbItems *tri, const PetscReal x[])
{
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(SbBoxTreeCreateTriangles(s->ntri, s->tri, s->x, &tree));
  for (PetscInt i = 0, f; i < tri->n; i++) {
    const PetscInt *v = tri->vert + 3 * i;
    PetscReal middle[6];
    SbBoxNearest nearest;

    for (int k = 0; k < 6; k++)
      middle[k] = (x[3 * v[0] + k % 3] + x[3 * v[1] + k % 3] + x[3 * v[2] + k % 3]) / 3;
    tri->tags[i] = 0;
    // of equally near ones the first
    for (SbBoxNearestBegin(&tree, middle, PETSC_MAX_REAL, &nearest); SbBoxNearestNext(&nearest, &f);) {
      const PetscInt *c = s->tri + 3 * f;
      const PetscReal *const corner[3] = {s->x + 3 * c[0], s->x + 3 * c[1], s->x + 3 * c[2]};
      PetscReal w[3], d2;

      (void)SbTriangleClosestPoint(middle, corner, w, &d2);
      if (d2 > nearest.limit2 || (d2 == nearest.limit2 && f > tri->tags[i])) continue;
      nearest.limit2 = d2;
      tri->tags[i] = f;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTetRun_Gmsh(const SbTetJob *job, SbImport *tets)
{
  SbTetJob mine = *job;
  const SbGmshJob child = {job->where, "made tetrahedra", job->options.seconds, work, &mine};

  PetscFunctionBeginUser;
  PetscCall(SbGmshRun(&child, tets));
  if (job->remesh)
    PetscCall(nearest_triangles(job->surface, &tets->item[2], tets->x));
  else {
    // a kept surface is not read back: its triangles are those of the input
    tets->item[2].n = 0;
    for (PetscInt f = 0; f < job->surface->ntri; f++)
      PetscCall(SbImportAddItem(tets, 2, job->surface->tri + 3 * f, f, job->surface->number[f]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
