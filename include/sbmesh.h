/*
  sbmesh.h - layer 2: bodies read from files or made as boxes, placed, checked, merged, partitioned
  with the help of METIS, and held as plain arrays with one layer of overlap; tets on one rank, for
  what works on them before that.
*/
#pragma once
#include <petscdm.h>
#include "sbgeometry.h"

#define SB_SET_MAX 63 /* named sets that one scenario may use: one bit each, bit 0 is taken */
#define SB_ON_BOUNDARY \
  ((uint64_t)1) /* bit 0 of SbMesh.face_set: the face has no cell on the other side */
#define SB_CURVED ((uint64_t)1) /* bit 0 of SbMesh.cell_set: an edge is curved at rest */
#define SB_SET_BIT(k) ((uint64_t)1 << ((k) + 1))
#define SB_SLIVER \
  0.5 /* degrees: tets with a smaller dihedral angle are slivers, which slow down solvers */
#define SB_INCLUSION_MAX 16 /* inclusions of a body: tets with a material of their own */

/* bodies and sets, as the scenario gives them */

/* Program that fills a surface with tets. */
typedef enum {
  SB_TET_AUTO, /* gmsh, and tetgen where that fails */
  SB_TET_GMSH,
  SB_TET_TETGEN
} SbTetBackend;
/* Whether the triangles of a surface are kept. */
typedef enum {
  SB_TET_SURFACE_AUTO, /* kept when their mean edge is within a factor of 1.5 of the size */
  SB_TET_KEEP,
  SB_TET_REMESH
} SbTetSurface;
#define SB_TET_NEAR_MAX 8 /* places with finer tets */
/* A place with finer tets: within `radius` of a box of half edges half[3]; a sphere has none. */
typedef struct {
  PetscReal x[3];                  /* its middle, m */
  PetscReal axes[3][3];            /* unit vectors along its edges */
  PetscReal half[3], radius, size; /* m */
} SbTetNear;
/* Parameters of filling a surface with tets; lengths in the surface's unit. */
typedef struct {
  PetscReal size;            /* wanted edge; 0: the mean edge of the surface */
  PetscReal merge_tolerance; /* closer vertices are merged; negative: 1e-7 of the diagonal */
  PetscReal
    untangle; /* by how much self-intersections may be smoothed; negative: half the mean edge */
  PetscReal angle;   /* degrees; edges with sharper turns are kept when the surface is remeshed */
  PetscReal seconds; /* time limit of gmsh, and of tetgen, s */
  SbTetBackend backend;
  SbTetSurface surface;
  PetscInt nnear;
  SbTetNear near[SB_TET_NEAR_MAX]; /* [nnear] as the body is placed; of SbImport: before that */
} SbTetOptions;
/*
  A mesh in memory, instead of a body's file. The arrays are on rank 0, NULL elsewhere; the rest is
  alike on all ranks. Groups of the file are there as the bits of the sets that they mean.
*/
typedef struct {
  PetscInt step;  /* step after which it was made; 0: the mesh of the file */
  PetscReal mass; /* kg, of the body on this mesh: densities are scaled; 0: as its materials say */
  PetscReal
    bound; /* the body is re-meshed when its quality falls below it; 0: as the options say */
  PetscInt nvert, ncell, ntri, nedge;
  PetscReal *x;       /* [nvert][3] rest position, placed, m */
  PetscInt *cell;     /* [ncell][4] positively oriented; every vertex is used */
  PetscInt *tri;      /* [ntri][3] triangles in sets of groups */
  uint64_t *vert_set; /* [nvert] SB_SET_BIT() of sets that are groups */
  uint64_t *tri_set;  /* [ntri] */
  uint64_t *cell_set; /* [ncell] */
  PetscInt
    *edge; /* [nedge][2] edges that are curved at rest: vertices, the lower one first; ascending */
  PetscReal *edge_off; /* [nedge][3] their nodes from their middles, m */
} SbMemoryMesh;

/* A body as the scenario gives it. Data, no methods. */
typedef struct {
  char name[SB_NAME_MAX];
  char copy_of
    [SB_NAME_MAX]; /* body of the scenario that it is a copy of (-body_<name>_copies); else "" */
  /* file, or box:lx,ly,lz:n or box:lx,ly,lz:nx,ny,nz, from the origin to (lx, ly, lz), n cells
     along the shortest side; groups xmin xmax ymin ymax zmin zmax */
  char mesh[PETSC_MAX_PATH_LEN];
  PetscInt
    mesh_step; /* of the file of a run: the step whose positions it has; 0 at rest, -1 the last */
  PetscReal scale;           /* factor on the file's coordinates, first */
  PetscReal rotate[4];       /* axis (need not be normed) and angle in degrees, second */
  PetscReal translate[3];    /* m, third */
  SbTetOptions tet;          /* for a mesh that is a surface; m */
  PetscInt refine;           /* how often each tet is divided into eight after reading */
  char element[SB_NAME_MAX]; /* p1, p2, cr, dg */
  PetscBool other_nodes;     /* nodes at faces or edges: needs the full overlap */
  PetscBool rigid;           /* all cells share four nodes: needs them on one rank */
  PetscReal rigid_stiffness; /* Young's modulus of a rigid body, Pa; 0: by the scene */
  PetscBool
    edge_nodes; /* nodes at edges, where a mesh of second order has them; else tets are straight */
  char material[SB_NAME_MAX];    /* a law's name (SbMaterialNames) */
  PetscReal density;             /* kg/m^3 */
  PetscReal velocity[3];         /* initial velocity of the centre of mass, m/s */
  PetscReal angular_velocity[3]; /* initial angular velocity about the centre of mass, rad/s */
  PetscInt ninclusion;           /* inclusions: tets with a material of their own */
  struct {
    PetscInt set, material; /* set that holds the tets; number of the material */
  } inclusion[SB_INCLUSION_MAX];
  SbMemoryMesh
    *in_memory; /* a mesh in memory instead of the file, NULL: none; owned by the model */
  /* found by SbMeshCreate(), equal on all ranks */
  PetscInt nvert, ncell, nfacet; /* global counts; nfacet counts boundary facets */
  PetscInt npart;                /* connected parts */
  PetscReal volume;              /* rest volume, m^3 */
  PetscReal min_dihedral;        /* smallest dihedral angle, degrees */
  PetscInt nsliver;              /* tets with one below SB_SLIVER */
  PetscReal
    max_radius_ratio; /* circumradius / (3 inradius), 1 for the regular tet; the worst cell */
  PetscReal bbox[6];  /* xmin ymin zmin xmax ymax zmax, placed, m */
  char note[768];     /* repairs and remarks, "unused vertices left out: 3, ..."; "" when none */
} SbBody;
/* Diagonal of the smallest body's box, m. Not collective. */
PetscReal SbBodySmallest(PetscInt nbody, const SbBody body[]);
/* A point outside of the box of each body by more than a twentieth of its diagonal; *nearest: least
   distance to a box, m. Not collective. */
PetscBool SbBodyFarFrom(PetscInt nbody, const SbBody body[], const PetscReal point[3],
                        PetscReal *nearest);

/*
  A named set of the scenario: where loads and supports act. From a gmsh physical group of that name
  (of any body, or of one when written body.group; a group without a name is called surface_12,
  volume_3, ...), or a shape in the placed rest frame. A shape holds the vertices inside it, the
  boundary facets with three and the tets with four of these, with a slack of 1e-6 of the body's
  diagonal. A group of surfaces holds its triangles (inner ones too) and their vertices; a group of
  volumes its tets, their vertices and boundary facets.
*/
typedef enum {
  SB_SET_GROUP,
  SB_SET_BOX,
  SB_SET_PLANE,
  SB_SET_SPHERE,
  SB_SET_HALFSPACE,
  SB_SET_BODY,
  SB_SET_BOUNDARY
} SbSetShape;
typedef struct {
  char name[SB_NAME_MAX];
  SbSetShape shape;
  char group[2 * SB_NAME_MAX]; /* SB_SET_GROUP: group or body.group; SB_SET_BODY: body */
  /* box: xmin ymin zmin xmax ymax zmax; plane: nx ny nz d tol (|n.x - d| <= tol); sphere: cx cy cz
     r; halfspace: nx ny nz d (n.x <= d); n has length 1 here, d is scaled likewise */
  PetscReal p[8];
  PetscInt nvert, nfacet, ncell; /* by SbMeshCreate(), of all ranks; nfacet: boundary facets */
  PetscBool prescribed;          /* an effect prescribes every displacement there */
} SbSet;

/* Allocates a mesh in memory, zeroed. Not collective. */
PetscErrorCode SbMemoryMeshCreate(PetscInt nvert, PetscInt ncell, PetscInt ntri, PetscInt nedge,
                                  SbMemoryMesh **in_memory);
PetscErrorCode SbMemoryMeshDestroy(SbMemoryMesh **in_memory);
/* Sends step, mass and bound of the mesh on rank 0 to empty ones on all; NULL there: NULL on all.
   Collective. */
PetscErrorCode SbMemoryMeshShare(MPI_Comm comm, SbMemoryMesh **in_memory);
/*
  SbSetParse - reads the description of a set. Not collective.

  Input: option - full name, for messages; text - group:NAME, group:BODY.NAME,
  box:xmin,ymin,zmin,xmax,ymax,zmax, plane:nx,ny,nz,d[,tolerance], sphere:cx,cy,cz,r,
  halfspace:nx,ny,nz,d, body:NAME or boundary (lengths in m).
  Output: shape, group, p of set; its name is left alone.
  Errors: PETSC_ERR_USER_INPUT, one line that names option, text and the right form.
*/
PetscErrorCode SbSetParse(const char *option, const char *text, SbSet *set);

/* the distributed mesh */

/*
  SbMesh - this rank's part of the mesh. Own numbering: vertices and cells owned by this rank first,
  then the ghosts that touch them: every cell with an owned vertex is here. With nodes at faces or
  edges every cell that shares a vertex with an owned cell is here; else no ghost cell without an
  owned vertex. Constant after creation.
*/
typedef struct _p_SbMesh *SbMesh;
struct _p_SbMesh {
  MPI_Comm comm;
  /* DMPLEX: point c is cell c, ncell + v vertex v, behind them faces and edges if an element has
     nodes there; with overlap, point star forest, rest coordinates and labels (src/mesh/plex.c) */
  DM dm;
  PetscInt *face_point, *edge_point; /* [ncell][4], [ncell][6]; NULL without faces and edges */
  PetscInt *neighbour; /* [ncell][4] local cell across each face, -1: none; NULL likewise */
  PetscSF cell_sf,
    vert_sf; /* from owned cells and vertices to their ghost copies, numbered as here */
  PetscInt nbody;
  SbBody *body; /* [nbody] borrowed: the model owns the bodies */
  PetscInt nset;
  SbSet *set; /* [nset] borrowed */

  PetscInt Nvert, Ncell; /* global counts */
  PetscInt nvert_owned, nvert;
  PetscInt
    gvert_start; /* global number of this rank's first owned vertex; owned ones follow each other */
  PetscInt *gvert; /* [nvert] global vertex number (depends on the partition); ghosts ascending */
  PetscInt *
    vert_orig; /* [nvert] original number: in the order of bodies, then of used vertices in files */
  PetscInt *vert_body; /* [nvert] */
  PetscReal *x;        /* [nvert][3] rest position, placed, m */
  uint64_t *vert_set;  /* [nvert] SB_SET_BIT(k) when in set k */

  PetscInt ncell_owned, ncell;
  PetscInt *cell; /* [ncell][4] local vertices, positively oriented: det(x1-x0, x2-x0, x3-x0) > 0 */
  PetscInt *cell_orig; /* [ncell] original number, as for vertices */
  PetscInt *
    cell_body; /* [ncell]; owned and ghost cells by body, inclusion, curved or not, lowest vertex */
  PetscInt *
    cell_material; /* [ncell] number of the body, or material of its first inclusion with the cell */
  uint64_t *cell_set; /* [ncell] SB_SET_BIT(k), SB_CURVED */
  PetscReal *
    edge_off; /* [ncell][6][3] of nodes at edges from their middles, m; NULL without curved cells */
  /* [ncell][6] directions of fibre and sheet of laws that take them from the mesh file or by a
     rule, else unset; NULL: no law does. By SbCellFieldsFind(), later than the rest. */
  PetscReal *direction;
  PetscReal *temperature; /* [ncell] likewise, of bodies with a field of temperatures, or NULL */
  uint64_t
    *face_set; /* [ncell][4] face f is opposite vertex f: SB_ON_BOUNDARY, SB_SET_BIT(k) in set k */
};

/*
  SbMeshCreate - reads, checks, transforms, merges, partitions and distributes the bodies.
  Collective.

  Input: comm; bodies and sets as the scenario gives them (their "found" fields are filled; both
  must outlive the mesh).
  Options read: -petscpartitioner_type, -mesh_reading, -mesh_report (one line of checks and quality
  per body on rank 0). Errors: PETSC_ERR_USER_INPUT / PETSC_ERR_FILE_* with one line that names
  body, file, line or cell, and what to do. Fatal: unreadable or truncated file, no tets, other
  volume cells, 2D mesh, NaN or infinite coordinate, degenerate tet, duplicate tet, face shared by
  three tets, set that selects nothing. Repaired and reported: unused vertices, negative
  orientation. Reported: several connected parts, non-manifold surface edges.
*/
PetscErrorCode SbMeshCreate(MPI_Comm comm, PetscInt nbody, SbBody body[], PetscInt nset,
                            SbSet set[], SbMesh *mesh);
PetscErrorCode SbMeshDestroy(SbMesh *mesh);
/* Star forest of the leaves 0, 1, ... n - 1 with the roots root[n], of which this rank has the next
   nroot. Collective; the caller destroys it. */
PetscErrorCode SbForestCreate(MPI_Comm comm, PetscInt nroot, PetscInt n, const PetscInt root[],
                              PetscSF *forest);
/* Brings n numbers of each root to its leaves, or those of each leaf to its root. Collective. */
PetscErrorCode SbForestBroadcast(PetscSF forest, PetscInt n, MPI_Datatype type, const void *root,
                                 void *leaf);
PetscErrorCode SbForestReduce(PetscSF forest, PetscInt n, MPI_Datatype type, const void *leaf,
                              void *root);
PetscErrorCode
SbMeshValidate(SbMesh mesh); /* ordering, ranges, ownership, sums; for -validate and tests */
extern const SbOption SbMeshRows[];
/* route.c: records to other ranks */

typedef struct {
  PetscSF sf; /* from records that come in to those that leave */
  PetscInt nsend, nrecv;
  PetscInt *which;    /* [nsend] which of the caller's items they are, or NULL */
  PetscSFNode *place; /* [nsend] where each goes: rank, and its number among those that come in */
} SbRoute;

/* Prepares n records to go to ranks dest[n]; their order among those for one rank stays. The route
   takes over which and frees dest. Collective. */
PetscErrorCode SbRouteCreate(MPI_Comm comm, PetscInt n, PetscInt *which, PetscMPIInt *dest,
                             SbRoute *route);
PetscErrorCode SbRouteDestroy(SbRoute *route);
/* Sends records of `unit` bytes, of which record[which[i]] (NULL: record[i]) goes to dest[i];
   received[nrecv] by rank, PetscFree(). Collective. */
PetscErrorCode SbRouteSend(const SbRoute *route, size_t unit, const PetscInt which[],
                           const void *record, void *received);

/* tets as arrays on one rank: faces, shape, checks. Not collective */

typedef struct _p_SbImport SbImport; /* vertices, simplices of every dimension and their groups */

/* faces.c: which cells share a face */
typedef struct {
  PetscInt ncell;
  PetscInt *start; /* [nvert + 1] into `face`: faces by lowest vertex */
  SbKey
    *face; /* [4 ncell] of the two other vertices, ascending for each lowest; slots 4 cell + face */
  PetscInt *neighbour; /* [ncell][4] cell across face f (opposite vertex f), -1 on the boundary */
  PetscInt nboundary;
  PetscInt nshared;   /* faces of more than two cells */
  PetscInt shared[3]; /* three cells at the first one of these */
} SbFaces;

/* of face f, counter-clockwise seen from outside a positively oriented tet */
extern const int SbFaceVertex[4][3];

PetscErrorCode SbFacesCreate(PetscInt nvert, PetscInt ncell, const PetscInt cell[], SbFaces *faces);
PetscErrorCode SbFacesDestroy(SbFaces *faces);
/* Slots of the face with these vertices: 0 (no such face), 1 (boundary) or 2. */
PetscInt SbFacesFind(const SbFaces *faces, const PetscInt vert[3], PetscInt slots[2]);

/* check.c, quality.c */

/* Adds "what: n" to a note, unless n is 0. */
static inline void SbNoteCount(size_t size, char note[], const char *what, PetscInt n)
{
  if (n)
    SbAppend(size, note, "%s%s: %" PetscInt_FMT, note[0] ? ", " : "", what, n);
}

/* Leaves out vertices that no tet uses, and items with such a one; counts them in nunused and
   nlost. */
PetscErrorCode SbImportDropUnused(SbImport *import);
/* Removes unused vertices, orients cells, checks for defects; builds the faces. */
PetscErrorCode SbImportCheck(SbImport *import, SbFaces *faces);
/* Sums and maxima over tets and vertices; neutral where there are none. */
typedef struct {
  PetscInt nsliver;  /* tets with a dihedral angle below that wanted */
  PetscReal volume;  /* m^3 */
  PetscReal most[8]; /* cosine of a dihedral angle, radius ratio, -x, -y, -z, x, y, z */
} SbShape;
void SbImportShape(const SbImport *import, PetscReal degrees, SbShape *shape);

/*
  SbTetQuality - shape of a tet, positions in m: 3 r / R with the radii of the spheres in it and
  around it, 1 for the regular one, 0 for a flat one, negative when it is inverted. Not collective.
*/
PetscReal SbTetQuality(const PetscReal x[], const PetscInt vert[4]);
/* curve.c: of a tet with its edges off their middles by off[6][3], its volume, and the least
   Jacobian, where P2 uses it and at its nodes, over that of the straight tet. */
PetscReal SbTetCurvedVolume(const PetscReal x[], const PetscInt vert[4], const PetscReal off[18]);
PetscReal SbTetCurvedLeast(const PetscReal x[], const PetscInt vert[4], const PetscReal off[18]);

/* a mesh read by SbImportRead(), on one rank: measured, repaired, refined. Not collective. Errors:
   PETSC_ERR_USER_INPUT, PETSC_ERR_FILE_*, a line that names the file and what to do */

/* Simplices of group i of a mesh, and their length, area or volume; m, m^2, m^3; 0 for points. */
PetscErrorCode SbMeshFileGroup(const SbImport *import, PetscInt i, PetscInt *n, PetscReal *size);

#define SB_ANGLE_BINS 18 /* of ten degrees */
#define SB_RATIO_BINS 8
extern const PetscReal SbRatioBinEdges[SB_RATIO_BINS]; /* lower ends of the bins of radius ratios */

typedef struct {
  SbBody body;                     /* the fields that SbMeshCreate() finds */
  PetscInt nedge, nface;           /* of the tets; nface counts each face once */
  PetscReal area;                  /* of the boundary, m^2 */
  PetscReal edge[3];               /* shortest, mean, longest, m */
  PetscReal max_dihedral;          /* degrees */
  PetscInt64 angle[SB_ANGLE_BINS]; /* dihedral angles, six for each tet */
  PetscInt64 ratio[SB_RATIO_BINS]; /* radius ratios of the tets, 1 for the regular tet */
} SbMeshStatistics;
/*
  SbMeshFileMeasure - statistics, after checks and repairs (unused vertices, orientation) as those
  of a run.

  Errors: what SbMeshCreate() refuses.
*/
PetscErrorCode SbMeshFileMeasure(SbImport *import, SbMeshStatistics *facts);

typedef struct {
  PetscReal merge_tolerance; /* vertices at most so far apart became one, m */
  PetscInt nwelded;          /* vertices that went into another one */
  PetscInt ncollapsed;       /* tets that used a vertex twice, dropped */
  PetscInt nflat;            /* flat tets, dropped */
  PetscInt nslit; /* those of them that had no face on the boundary: a slit without width is left */
  PetscInt nduplicate; /* duplicate tets, removed; their groups are joined */
  PetscInt nturned;    /* inverted tets, reoriented */
  PetscInt nunused;    /* vertices that no tet uses, dropped */
  PetscInt nfolded;    /* curved tets that folded over themselves: their edges are straight now */
  int64_t folded;      /* the first of them, in the file */
  PetscReal folded_at[3]; /* its place, m */
  PetscInt nitem; /* duplicate, collapsed or unused triangles, lines, points of groups, removed */
} SbRepair;
/*
  SbMeshFileRepair - makes a mesh that a run accepts, where dropping, turning and welding can do it.

  Input:
    merge_tolerance - vertices at most so far apart become one, m; 0: none; below 0: 1e-9 of the
    diagonal
  Output:
    done - counts of repairs
  Errors: remaining defects that SbMeshCreate() would refuse: overlapping tets, no tets.
*/
PetscErrorCode SbMeshFileRepair(SbImport *import, PetscReal merge_tolerance, SbRepair *done);

/* Cuts every tet into eight, every triangle into four, every line into two; groups are carried
   over. */
PetscErrorCode SbMeshFileRefine(SbImport *import);
