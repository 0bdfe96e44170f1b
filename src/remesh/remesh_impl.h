/*
  remesh_impl.h - shared by the files of re-meshing: the old scene with its state on rank 0, and the
  new one.
*/
#pragma once
#include "sbremesh.h"
#include "sbmeshio.h"
#include "sbsurface.h"

/* the mesher */

/*
  Re-meshing of one body (src/remesh/body.c), on rank 0. Not collective.

  A hull is the surface of a body and what parts its regions inside; its tags are all 0. A mesher
  fills it with tets: their first vertices are those of the hull, unchanged and in order, its
  triangles are faces of tets. x and cell (positively oriented) are allocated here; the caller
  frees. An error is one line that says why it did not work.
*/
typedef struct {
  PetscInt nvert, ncell;
  PetscReal *x;   /* [nvert][3] m */
  PetscInt *cell; /* [ncell][4] */
} SbTets;
typedef PetscErrorCode (*SbMesher)(const char *where, const SbSurface *hull, PetscReal size,
                                   void *ctx, SbTets *tets);
/* The program's own: SbTetrahedralize(). */
PetscErrorCode SbMesherDefault(const char *where, const SbSurface *hull, PetscReal size, void *ctx,
                               SbTets *tets);
/* Who makes the tets, instead of SbMesherDefault(). Not collective. */
void SbRemeshSetMesher(SbRemesh remesh, SbMesher mesher, void *ctx);

/* All bodies in original order, and up to three vectors of the run. Arrays are on rank 0, NULL
   elsewhere. */
typedef struct {
  PetscInt nbody, nvert, ncell;
  PetscInt nfield; /* number of vectors: U, then V, A if the run has them */
  PetscInt width;  /* nodes per cell: 4; 8 with supports of its faces; 14 with P2's edge nodes */
  PetscInt *vert0, *cell0; /* [nbody + 1] first vertex and cell of each body; on all ranks */
  PetscReal *mass;         /* [nbody] mass, kg; on all ranks */
  PetscReal *X, *x; /* [nvert][3] rest and current positions, CR and DG: means around vertices; m */
  uint64_t *vert_set;      /* [nvert] bits of sets */
  PetscInt *cell;          /* [ncell][4] vertices */
  PetscInt *cell_material; /* [ncell] material numbers */
  uint64_t *cell_set;      /* [ncell][5] bits of sets of the cell, then of its faces */
  PetscReal
    *edge_off;      /* [ncell][6][3] edge offsets as in SbMesh; NULL: no cell is curved at rest */
  PetscReal *value; /* [ncell][width][nfield][3] values, SI; PETSC_MAX_REAL: no support, no node */
#define SB_EDGES 8  /* index of the first edge node of a cell */
} SbGathered;
PetscErrorCode SbGather(SbRun run, SbGathered *g); /* collective; SbGatheredDestroy() */
PetscErrorCode SbGatheredDestroy(SbGathered *g);
/* Sets the vectors of a run from value, width and nfield of g, for cells of the run's mesh.
   Collective. */
PetscErrorCode SbScatter(const SbGathered *g, SbRun run);

/* Renumbered surface nodes by original numbers, ascending in `from`, on all ranks; PetscFree2(from,
   to). */
typedef struct {
  PetscInt n, *from, *to;
} SbRenamed;

/* body.c: new mesh of one body, on rank 0; not collective */
typedef struct {
  SbMesher mesher;
  void *ctx;
  PetscReal size;    /* target edge length over the mean edge of the hull */
  PetscBool better;  /* error if the worst tet is no better now than that of the old mesh */
  PetscBool rest;    /* the reference configuration is tetrahedralised, else the current one */
  PetscReal quality; /* least quality of tets at rest, and now (SbTetQuality) */
} SbRemeshing;
/* The old mesh; numbers from the body's first vertex and tet; positions and offsets are
   borrowed. */
typedef struct {
  PetscInt nvert, ncell;
  const PetscReal *X, *x;    /* [nvert][3] positions at rest, now; m */
  PetscInt *cell;            /* [ncell][4] vertices */
  PetscInt *region;          /* [ncell] region numbers; faces between regions are kept */
  SbFaces faces;             /* faces of `cell` */
  const PetscReal *edge_off; /* [ncell][6][3] edge offsets at rest; NULL: straight edges */
  SbLocator rest;            /* of places at rest */
} SbOldMesh;
/* The new mesh of the body; arrays owned, SbNewMeshDestroy(). */
typedef struct {
  PetscInt nvert, ncell, nkept;
  PetscReal *X, *x; /* [nvert][3] positions at rest; now, interpolated on the old mesh; m */
  PetscInt *cell;   /* [ncell][4] vertices */
  PetscInt *kept;   /* [nkept] old numbers of the first vertices, which have kept their positions */
  PetscInt *within; /* [ncell] old tet that contains the centroid of the new one */
  PetscReal *
    edge_off; /* [ncell][6][3] offsets of edge nodes from edge midpoints, m; NULL: no curved tets */
  PetscReal *flat;   /* [nvert][3] rest positions for straight old tets, m; NULL: no curved tets */
  PetscInt nmoved;   /* vertices moved for inverted or flat tets */
  PetscReal quality; /* quality of the worst tet, now */
} SbNewMesh;
/* SbLocatorFind(); error (PETSC_ERR_USER_INPUT) if it finds none. Not collective. */
PetscErrorCode SbOldTetFind(SbLocator locator, const PetscReal point[3], PetscInt *cell,
                            PetscReal weight[4]);
/* Errors (PETSC_ERR_USER_INPUT): those of the mesher; tets that stay inverted at rest or now. */
PetscErrorCode SbRemeshBody(const char *where, const SbOldMesh *old, const SbRemeshing *how,
                            SbNewMesh *mesh);
PetscErrorCode SbNewMeshDestroy(SbNewMesh *mesh);

/*
  bodies.c - rank 0: re-meshes the bodies with due[b], and fills a SbRemeshResult.

  Not collective. message: reason of a failure, with which a body keeps its mesh; "": re-meshed, or
  not due.
*/
typedef struct {
  PetscInt nvert[2], ncell[2]; /* numbers before and after */
  PetscInt nmoved;
  PetscReal quality; /* quality of the worst tet afterwards */
  char message[512];
} SbRemeshOutcome;
typedef struct {
  SbMemoryMesh **in_memory; /* [nbody] meshes of all bodies, on rank 0; NULL: elsewhere, or taken */
  SbRemeshOutcome *outcome; /* [nbody] numbers, quality and message of each body */
  SbGathered next;          /* next scene with its state; X, vert_set and so on are not set */
  PetscInt *from;           /* [next.ncell] old cell that holds the centroid of each; on rank 0 */
  SbRenamed renamed;        /* renumbered nodes of the surfaces of all bodies */
} SbRemeshResult;           /* SbRemeshResultDestroy() */
PetscErrorCode SbRemeshResultCreate(const SbGathered *g, SbRemeshResult *result);
PetscErrorCode SbRemeshResultDestroy(SbRemeshResult *result);
PetscErrorCode SbRemeshBodies(SbModel model, const SbGathered *g, const PetscBool due[],
                              PetscInt step, const SbRemeshing *how, SbRemeshResult *result);

/* check.c: qualities and momenta */
/* worst[nbody]: quality of the worst tet of each named body, else 1. Collective. */
PetscErrorCode SbBodyQualities(SbModel model, Vec U, const PetscBool named[], PetscReal worst[]);
/* Momentum and angular momentum about the origin of each body, [nbody][6], SI. Collective. */
PetscErrorCode SbBodyMomenta(SbModel model, Vec U, Vec V, PetscReal momenta[][6]);
/* Adds rigid velocities to the named bodies, except at prescribed unknowns, so that they have these
   momenta. Collective. `largest`: largest speed that was added, m/s. */
PetscErrorCode SbBodySetMomenta(SbModel model, Vec U, Vec V, const PetscBool named[],
                                const PetscReal momenta[][6], PetscReal *largest);

/* gather.c: transfers the history variables of effects to the new model. Collective. */
PetscErrorCode SbEffectsHandOver(SbRun from, SbRun to, const SbRenamed *renamed);
/* The history of cells at the end of a step, from the cells result->from: bodies with due[nbody]
   have new meshes. Collective. */
PetscErrorCode SbHistoryHandOver(SbRun from, SbRun to, const SbRemeshResult *result,
                                 const PetscBool due[]);
