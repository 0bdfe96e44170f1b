/*
  plex.c - the DMPLEX of a scene: topology, rest coordinates, overlap, point star forest, labels.

  Each rank builds its part from the cells that distribute.c has sent it and number.c has ordered:
  point c is cell c of SbMesh, point ncell + v its vertex v; faces and edges follow where an element
  has nodes there. Cones are written directly: faces and edges are found by counting sorts
  (faces.c), six times as fast as DMPlexInterpolate(), and strata of labels are set as wholes.

  PETSc's tet has its faces' normals outside with the vertices in the order 0 2 1 3 of a tet of
  SbMesh. Cones of faces and edges are in ascending order of original numbers, so that they are the
  same on all ranks.

  Owners. Cells and vertices: distribute.c. The ends of a face or edge may have several owners: it
  belongs to the rank of its cell with the lowest original number, or of that with the highest one,
  every second time. The owner of a cell knows all cells around its faces and edges (the overlap is
  complete) and so their owners; a broadcast over the cells brings an owner's numbers to the cells
  next to it, a second one to their copies.

  Labels: body; material (number of the material of the tets of an inclusion, else that of the
  body); boundary (1); vtk (1: owned cells, which PETSc's VTK viewers write); each set of the
  scenario by its name (1). Faces are in them where the mesh has faces.
*/
#include <petscdmplex.h>
#include "mesh_impl.h"

enum {
  NFACE = 4,
  NEDGE = 6,
  NSIDE = NFACE + NEDGE /* faces and edges of a tet */
};

/* Vertices of a tet in PETSc's order, and its faces as cones have them: vertices in that order. */
static const int plex_vertex[4] = {0, 2, 1, 3};
static const int plex_face[NFACE][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {2, 1, 3}};
static const int plex_opposite[NFACE] = {3, 2, 1, 0};

/* Faces and edges of this rank's cells while the plex is built; numbers from zero on. */
typedef struct {
  PetscInt nface, nedge;
  PetscInt *face;      /* [ncell][4] face opposite each vertex */
  PetscInt *edge;      /* [ncell][6] edges 01 02 03 12 13 23 */
  PetscInt *face_vert; /* [nface][3] vertices, original numbers ascending */
  PetscInt *face_edge; /* [nface][3] edges 01 12 02 of these */
  PetscInt *edge_vert; /* [nedge][2] likewise */
} Sides;

static PetscErrorCode sides_destroy(Sides *s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(s->face_vert));
  PetscCall(PetscFree(s->face_edge));
  PetscCall(PetscFree(s->edge_vert));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers the edge of a tet between its vertices a and b, 0..3. */
static int edge_between(int a, int b)
{
  static const int edge[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};

  return edge[a][b];
}

/* Sorts the corners of a face, 0..3 of a tet, by the original numbers of their vertices. */
static void sort_corners(const PetscInt orig[], const PetscInt vert[4], int corner[3])
{
  for (int i = 1; i < 3; i++)
    for (int j = i; j > 0 && orig[vert[corner[j]]] < orig[vert[corner[j - 1]]]; j--) {
      const int keep = corner[j];

      corner[j] = corner[j - 1];
      corner[j - 1] = keep;
    }
}

/* Numbers faces and edges in the order of the cells, and finds their vertices. */
static PetscErrorCode find_sides(SbMesh mesh, Sides *s)
{
  SbFaces faces;

  PetscFunctionBeginUser;

  // a face gets its number from the first of its cells
  PetscCall(SbFacesCreate(mesh->nvert, mesh->ncell, mesh->cell, &faces));
  PetscCall(PetscMalloc1(NFACE * (size_t)mesh->ncell, &s->face));
  s->nface = 0;
  for (PetscInt i = 0; i < NFACE * mesh->ncell; i++) {
    const PetscInt c = i / NFACE;
    const PetscInt other = faces.neighbour[i];
    int f = 0;

    if (other < 0 || other > c) {
      s->face[i] = s->nface++;
      continue;
    }
    while (f < 3 && faces.neighbour[NFACE * other + f] != c)
      f++;
    s->face[i] = s->face[NFACE * other + f];
  }
  mesh->neighbour = faces.neighbour;
  faces.neighbour = NULL;
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(SbTetEdges(mesh->nvert, mesh->ncell, mesh->cell, &s->nedge, &s->edge));

  // vertices of faces and edges, edges of faces; the last cell of each decides, as all agree
  PetscCall(PetscMalloc1(3 * (size_t)s->nface, &s->face_vert));
  PetscCall(PetscMalloc1(3 * (size_t)s->nface, &s->face_edge));
  PetscCall(PetscMalloc1(2 * (size_t)s->nedge, &s->edge_vert));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscInt *v = mesh->cell + 4 * (size_t)c;

    for (int f = 0; f < NFACE; f++) {
      const PetscInt at = 3 * s->face[NFACE * c + f];
      int k[3] = {(f + 1) % 4, (f + 2) % 4, (f + 3) % 4};

      sort_corners(mesh->vert_orig, v, k);
      for (int i = 0; i < 3; i++) {
        s->face_vert[at + i] = v[k[i]];
        s->face_edge[at + i] = s->edge[NEDGE * c + edge_between(k[i], k[(i + 1) % 3])];
      }
    }
    for (int e = 0; e < NEDGE; e++) {
      const PetscInt at = 2 * s->edge[NEDGE * c + e];
      const PetscInt a = v[SbTetEdge[e][0]];
      const PetscInt b = v[SbTetEdge[e][1]];
      const PetscBool ordered = (PetscBool)(mesh->vert_orig[a] < mesh->vert_orig[b]);

      s->edge_vert[at] = ordered ? a : b;
      s->edge_vert[at + 1] = ordered ? b : a;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Orientations of a triangle in the cone of a tet: [i][j] where the vertices of the triangle that
   come first and second there are its i-th and j-th. */
static PetscErrorCode triangle_orientations(PetscInt orientation[3][3])
{
  static const PetscInt own[3] = {0, 1, 2};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      const PetscInt there[3] = {i, j, 3 - i - j};

      orientation[i][j] = 0;
      if (i != j)
        PetscCall(
          DMPolytopeGetVertexOrientation(DM_POLYTOPE_TRIANGLE, own, there, &orientation[i][j]));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cones of a mesh with faces and edges. */
static PetscErrorCode fill_cones(SbMesh mesh, const Sides *s, PetscInt cone[],
                                 PetscInt orientation[])
{
  const PetscInt vertices = mesh->ncell;
  const PetscInt faces = vertices + mesh->nvert;
  const PetscInt edges = faces + s->nface;
  PetscInt *face_cone = cone + NFACE * (size_t)mesh->ncell;
  PetscInt *edge_cone = face_cone + 3 * (size_t)s->nface;
  PetscInt turned[3][3];

  PetscFunctionBeginUser;
  PetscCall(triangle_orientations(turned));

  // faces of the cells
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    for (int k = 0; k < NFACE; k++) {
      const PetscInt face = s->face[NFACE * c + plex_vertex[plex_opposite[k]]];
      const PetscInt *own = s->face_vert + 3 * face;
      PetscInt at[2];

      for (int i = 0; i < 2; i++) {
        const PetscInt v = mesh->cell[4 * (size_t)c + plex_vertex[plex_face[k][i]]];

        at[i] = v == own[0] ? 0 : v == own[1] ? 1 : 2;
      }
      cone[NFACE * c + k] = faces + face;
      orientation[NFACE * c + k] = turned[at[0]][at[1]];
    }
  }

  // edges of the faces: the last one runs from the third vertex to the first
  for (PetscInt i = 0; i < 3 * s->nface; i++) {
    face_cone[i] = edges + s->face_edge[i];
    orientation[NFACE * mesh->ncell + i] = i % 3 == 2 ? -1 : 0;
  }
  for (PetscInt i = 0; i < 2 * s->nedge; i++)
    edge_cone[i] = vertices + s->edge_vert[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A stratum of a label: the points first to last - 1. */
static PetscErrorCode set_range(DMLabel label, PetscInt value, PetscInt first, PetscInt last)
{
  IS points;

  PetscFunctionBeginUser;
  if (last <= first)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISCreateStride(PETSC_COMM_SELF, last - first, first, 1, &points));
  PetscCall(DMLabelSetStratumIS(label, value, points));
  PetscCall(ISDestroy(&points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points, cones, supports, strata. s: NULL without faces and edges. */
static PetscErrorCode create_topology(SbMesh mesh, const Sides *s)
{
  const PetscInt first[5] = {0, mesh->ncell, mesh->ncell + mesh->nvert,
                             mesh->ncell + mesh->nvert + (s ? s->nface : 0),
                             mesh->ncell + mesh->nvert + (s ? s->nface + s->nedge : 0)};
  static const PetscInt cone_size[4] = {4, 0, 3, 2};
  static const DMPolytopeType type[4] = {DM_POLYTOPE_TETRAHEDRON, DM_POLYTOPE_POINT,
                                         DM_POLYTOPE_TRIANGLE, DM_POLYTOPE_SEGMENT};
  PetscInt *cone, *orientation;
  DMLabel types;
  DM dm = mesh->dm;

  PetscFunctionBeginUser;
  PetscCall(DMPlexSetChart(dm, 0, first[4]));
  for (int k = 0; k < 4; k++)
    for (PetscInt p = first[k]; k != 1 && p < first[k + 1]; p++)
      PetscCall(DMPlexSetConeSize(dm, p, cone_size[k]));
  PetscCall(DMSetUp(dm));
  PetscCall(DMPlexGetCones(dm, &cone));
  PetscCall(DMPlexGetConeOrientations(dm, &orientation));
  if (s)
    PetscCall(fill_cones(mesh, s, cone, orientation));
  for (PetscInt i = 0; !s && i < 4 * mesh->ncell; i++)
    cone[i] = mesh->ncell + mesh->cell[i - i % 4 + plex_vertex[i % 4]];
  PetscCall(DMPlexSymmetrize(dm));

  // the types are known: PETSc need not look at every cone
  PetscCall(DMCreateLabel(dm, "celltype"));
  PetscCall(DMPlexGetCellTypeLabel(dm, &types));
  for (int k = 0; k < 4; k++)
    PetscCall(set_range(types, type[k], first[k], first[k + 1]));
  PetscCall(DMPlexStratify(dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Face or, behind the faces, edge number i = NSIDE cell + side. */
static inline PetscInt side_of(const Sides *s, PetscInt i)
{
  const PetscInt c = i / NSIDE;
  const PetscInt k = i % NSIDE;

  return k < NFACE ? s->face[NFACE * c + k] : s->nface + s->edge[NEDGE * c + k - NFACE];
}

/* Owner of each face and edge, and the point that it is there. Collective. */
static PetscErrorCode own_sides(SbMesh mesh, const Sides *s, PetscMPIInt rank, PetscSFNode side[])
{
  const PetscInt nside = s->nface + s->nedge;
  const PetscInt n = NSIDE * mesh->ncell;
  PetscInt *low, *high;
  PetscSFNode *sent;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(nside, &low, nside, &high, n, &sent));
  for (PetscInt i = 0; i < nside; i++) {
    low[i] = PETSC_MAX_INT;
    high[i] = -1;
    side[i] = (PetscSFNode){-1, -1};
  }

  // lowest and highest original number of the cells at each side; those that this rank decides
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt at = side_of(s, i);

    low[at] = PetscMin(low[at], mesh->cell_orig[i / NSIDE]);
    high[at] = PetscMax(high[at], mesh->cell_orig[i / NSIDE]);
  }
  for (PetscInt i = 0; i < NSIDE * mesh->ncell_owned; i++) {
    const PetscInt at = side_of(s, i);

    if (mesh->cell_orig[i / NSIDE] == ((low[at] + high[at]) % 2 ? low[at] : high[at]))
      side[at] = (PetscSFNode){rank, mesh->ncell + mesh->nvert + at};
  }

  // the first round completes owned cells, the second one their copies
  for (int round = 0; round < 2; round++) {
    for (PetscInt i = 0; i < n; i++)
      sent[i] = side[side_of(s, i)];
    PetscCall(SbForestBroadcast(mesh->cell_sf, NSIDE * sizeof(*sent) / sizeof(PetscInt), MPIU_INT,
                                sent, sent));
    for (PetscInt i = 0; i < n; i++)
      if (sent[i].rank >= 0)
        side[side_of(s, i)] = sent[i];
  }
  PetscCall(PetscFree3(low, high, sent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The point star forest, from the owners of points to their copies. Collective. */
static PetscErrorCode set_point_forest(SbMesh mesh, const Sides *s)
{
  const PetscInt nside = s ? s->nface + s->nedge : 0;
  const PetscInt npoint = mesh->ncell + mesh->nvert + nside;
  PetscInt n = 0;
  PetscInt *leaf;
  PetscSFNode *root, *point;
  PetscMPIInt rank, size;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(mesh->comm, &size));
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  if (size == 1)
    PetscFunctionReturn(PETSC_SUCCESS);

  // the owner of each point, and which point it is there
  PetscCall(PetscMalloc1(npoint, &point));
  for (PetscInt p = 0; p < mesh->ncell + mesh->nvert; p++)
    point[p] = (PetscSFNode){rank, p};
  for (int k = 0; k < 2; k++) {
    PetscSFNode *part = point + (k ? mesh->ncell : 0);

    PetscCall(SbForestBroadcast(k ? mesh->vert_sf : mesh->cell_sf,
                                sizeof(*point) / sizeof(PetscInt), MPIU_INT, part, part));
  }
  if (s)
    PetscCall(own_sides(mesh, s, rank, point + mesh->ncell + mesh->nvert));

  // leaves: the points of other ranks
  PetscCall(PetscMalloc1(npoint, &leaf));
  PetscCall(PetscMalloc1(npoint, &root));
  for (PetscInt p = 0; p < npoint; p++) {
    PetscCheck(point[p].rank >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "No rank owns point %" PetscInt_FMT, p);
    if (point[p].rank == rank)
      continue;
    leaf[n] = p;
    root[n++] = point[p];
  }
  PetscCall(PetscFree(point));
  PetscCall(DMGetPointSF(mesh->dm, &sf));
  PetscCall(PetscSFSetGraph(sf, npoint, n, leaf, PETSC_COPY_VALUES, root, PETSC_COPY_VALUES));
  PetscCall(PetscFree(leaf));
  PetscCall(PetscFree(root));
  PetscCall(PetscSFSetUp(sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Strata of a label from key[n] of the points first, first + 1, ...; negative: in none. */
static PetscErrorCode set_strata(DMLabel label, PetscInt n, const PetscInt key[], PetscInt nkey)
{
  PetscInt *start, *item;

  PetscFunctionBeginUser;
  PetscCall(SbBucketByKey(n, key, nkey, &start, &item));
  for (PetscInt k = 0; k < nkey; k++) {
    IS points;

    if (start[k] == start[k + 1])
      continue;
    PetscCall(ISCreateGeneral(PETSC_COMM_SELF, start[k + 1] - start[k], item + start[k],
                              PETSC_COPY_VALUES, &points));
    PetscCall(DMLabelSetStratumIS(label, k, points));
    PetscCall(ISDestroy(&points));
  }
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(item));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Labels of the bodies, their materials, the boundary and the sets. */
static PetscErrorCode set_labels(SbMesh mesh, const Sides *s)
{
  const PetscInt nface = s ? s->nface : 0;
  const PetscInt npoint = mesh->ncell + mesh->nvert + nface;
  PetscInt *key;
  PetscInt nmaterial = mesh->nbody;
  DMLabel label;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    nmaterial += mesh->body[b].ninclusion;

  // cells and vertices of the bodies, cells of the materials
  PetscCall(DMCreateLabel(mesh->dm, "body"));
  PetscCall(DMGetLabel(mesh->dm, "body", &label));
  PetscCall(PetscMalloc1(npoint, &key));
  if (mesh->nbody == 1) {
    PetscCall(set_range(label, 0, 0, mesh->ncell + mesh->nvert));
  } else {
    PetscCall(PetscArraycpy(key, mesh->cell_body, mesh->ncell));
    PetscCall(PetscArraycpy(key + mesh->ncell, mesh->vert_body, mesh->nvert));
    PetscCall(set_strata(label, mesh->ncell + mesh->nvert, key, mesh->nbody));
  }

  // cells that viewers write: without the overlap
  PetscCall(DMCreateLabel(mesh->dm, "vtk"));
  PetscCall(DMGetLabel(mesh->dm, "vtk", &label));
  PetscCall(set_range(label, 1, 0, mesh->ncell_owned));
  PetscCall(DMCreateLabel(mesh->dm, "material"));
  PetscCall(DMGetLabel(mesh->dm, "material", &label));
  if (nmaterial == 1)
    PetscCall(set_range(label, 0, 0, mesh->ncell));
  else
    PetscCall(set_strata(label, mesh->ncell, mesh->cell_material, nmaterial));

  // the boundary, then the sets: bit k of the masks
  for (PetscInt k = 0; k <= mesh->nset; k++) {
    const uint64_t bit = k ? SB_SET_BIT(k - 1) : SB_ON_BOUNDARY;
    const char *own = k ? mesh->set[k - 1].name : "boundary";
    char name[SB_NAME_MAX + 16];
    PetscBool taken;

    for (PetscInt p = 0; p < npoint; p++)
      key[p] = -1;
    for (PetscInt c = 0; k && c < mesh->ncell; c++)
      key[c] = mesh->cell_set[c] & bit ? 1 : -1;
    for (PetscInt v = 0; k && v < mesh->nvert; v++)
      key[mesh->ncell + v] = mesh->vert_set[v] & bit ? 1 : -1;
    for (PetscInt i = 0; (!k || s) && i < NFACE * mesh->ncell; i++) {
      if (!(mesh->face_set[i] & bit))
        continue;
      for (int a = 0; !k && a < 3; a++)
        key[mesh->ncell + mesh->cell[i - i % 4 + SbFaceVertex[i % 4][a]]] = 1;
      if (s)
        key[mesh->ncell + mesh->nvert + s->face[i]] = 1;
    }

    // a set may have the name of another label: set_NAME, set1_NAME, ...
    PetscCall(PetscStrncpy(name, own, sizeof(name)));
    PetscCall(DMHasLabel(mesh->dm, name, &taken));
    for (int again = 0; taken; again++) {
      (void)snprintf(name, sizeof(name), "set%.*d_%s", again > 0, again, own);
      PetscCall(DMHasLabel(mesh->dm, name, &taken));
    }
    PetscCall(DMCreateLabel(mesh->dm, name));
    PetscCall(DMGetLabel(mesh->dm, name, &label));
    PetscCall(set_strata(label, npoint, key, 2));
  }
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPlexCreate(SbMesh mesh, PetscBool sides)
{
  Sides s = {0};

  PetscFunctionBeginUser;
  PetscCall(DMCreate(mesh->comm, &mesh->dm));
  PetscCall(DMSetType(mesh->dm, DMPLEX));
  PetscCall(PetscObjectSetName((PetscObject)mesh->dm, "mesh"));
  PetscCall(DMSetDimension(mesh->dm, 3));
  if (sides)
    PetscCall(find_sides(mesh, &s));
  PetscCall(create_topology(mesh, sides ? &s : NULL));
  PetscCall(DMPlexBuildCoordinatesFromCellList(mesh->dm, 3, mesh->x));
  PetscCall(set_point_forest(mesh, sides ? &s : NULL));
  PetscCall(DMPlexSetOverlap(mesh->dm, NULL, 1));
  PetscCall(DMPlexDistributeSetDefault(mesh->dm, PETSC_FALSE));
  PetscCall(set_labels(mesh, sides ? &s : NULL));

  // points of the faces and edges of each cell
  for (PetscInt i = 0; sides && i < NFACE * mesh->ncell; i++)
    s.face[i] += mesh->ncell + mesh->nvert;
  for (PetscInt i = 0; sides && i < NEDGE * mesh->ncell; i++)
    s.edge[i] += mesh->ncell + mesh->nvert + s.nface;
  mesh->face_point = s.face;
  mesh->edge_point = s.edge;
  PetscCall(sides_destroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
