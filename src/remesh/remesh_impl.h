/*
  remesh_impl.h - shared by the files of re-meshing: the old scene with its state on rank 0, and the new one.
*/
#pragma once
#include "sbremesh.h"
#include "sbtet.h"

/* All bodies in original order, and up to three vectors of the run. Arrays are on rank 0 alone, NULL elsewhere. */
typedef struct {
  PetscInt nbody, nvert, ncell;
  PetscInt nfield;         /* vectors: U, V, A, as far as the run has them */
  PetscInt width;          /* 4: nodes of a cell; 8: and supports of its faces; 14: and P2's at edges */
  PetscInt *vert0, *cell0; /* [nbody + 1] first vertex and cell of each body; on all ranks */
  PetscReal *mass;         /* [nbody] kg; on all ranks */
  PetscReal *X, *x;        /* [nvert][3] at rest; now, of CR and DG the means around vertices; m */
  uint64_t *vert_set;      /* [nvert] */
  PetscInt *cell;          /* [ncell][4] vertices */
  PetscInt *cell_material; /* [ncell] */
  uint64_t *cell_set;      /* [ncell][5] of the cell, of its faces */
  PetscReal *edge_off;     /* [ncell][6][3] as in SbMesh; NULL: no cell is curved at rest */
  PetscReal *value; /* [ncell][width][nfield][3]; SI; PETSC_MAX_REAL where there is no support, no node */
#define SB_EDGES 8  /* where the nodes at edges begin */
} SbGathered;
PetscErrorCode SbGather(SbRun run, SbGathered *g); /* collective; SbGatheredDestroy() */
PetscErrorCode SbGatheredDestroy(SbGathered *g);
/* Fills the vectors of a run from value, width and nfield of g, whose cells are those of the run's mesh. Collective. */
PetscErrorCode SbScatter(const SbGathered *g, SbRun run);

/* Nodes of the surface by their original numbers, ascending in `from`, on all ranks; PetscFree2(from, to). */
typedef struct {
  PetscInt n, *from, *to;
} SbRenamed;

/* ------------------------------------------------------------------ body.c: another mesh of one body, on rank 0; not collective */

typedef struct {
  SbMesher mesher;
  void *ctx;
  PetscReal size;    /* wanted edge, in mean edges of the hull */
  PetscBool better;  /* a mesh whose worst tet is no better now than that of the old one is refused */
  PetscBool rest;    /* the body is filled as it is at rest, else as it is now */
  PetscReal quality; /* least that tets may have at rest, and now (SbTetQuality) */
} SbRemeshing;
/* The mesh that there is; all borrowed. */
typedef struct {
  PetscInt nvert, ncell;
  const PetscReal *X, *x;    /* [nvert][3] at rest, now; m */
  const PetscInt *cell;      /* [ncell][4] */
  const PetscInt *region;    /* [ncell] tets of different numbers stay apart */
  const SbFaces *faces;      /* of cell */
  const PetscReal *edge_off; /* [ncell][6][3] at rest; NULL: straight */
} SbOldMesh;
/* Another one of the same body; arrays owned, SbNewMeshDestroy(). */
typedef struct {
  PetscInt nvert, ncell, nkept;
  PetscReal *X, *x; /* [nvert][3] at rest, and now as the old mesh has it there; m */
  PetscInt *cell;   /* [ncell][4] */
  PetscInt *kept;   /* [nkept] old vertex of each of the first new ones, which are where they were */
  PetscInt *within; /* [ncell] old tet that holds the middle of the new one */
  PetscReal *
    edge_off; /* [ncell][6][3] of nodes at edges from their middles, at rest, m; NULL: no old tet is curved */
  PetscReal *flat; /* [nvert][3] where the vertices would be at rest if old tets were straight, m; or NULL */
  PetscInt nmoved; /* vertices that were moved, for tets that would have been inverted or too flat */
  PetscReal quality; /* of the worst tet, now */
} SbNewMesh;
/* Errors (PETSC_ERR_USER_INPUT): what the mesher says; tets that stay inverted at rest or now. */
PetscErrorCode SbRemeshBody(const char *where, const SbOldMesh *old, const SbRemeshing *how, SbNewMesh *mesh);
PetscErrorCode SbNewMeshDestroy(SbNewMesh *mesh);

/*
  bodies.c - rank 0: the bodies with due[b] are remeshed, what comes of it is a SbRemeshResult.

  Not collective. message: why a body could not be re-meshed, "" when it was or was not due; it keeps its mesh then.
*/
typedef struct {
  PetscInt nvert[2], ncell[2]; /* before and after */
  PetscInt nmoved;
  PetscReal quality; /* of the worst tet after it */
  char message[512];
} SbRemeshOutcome;
typedef struct {
  PetscInt nbody;
  SbMemoryMesh **in_memory; /* [nbody] meshes of all bodies, on rank 0; NULL: elsewhere, or taken */
  SbRemeshOutcome *outcome; /* [nbody] */
  PetscBool *done;          /* [nbody] has a new mesh */
  SbGathered next;   /* the same scene with the state looked up there; X, vert_set and so on are left out */
  SbRenamed renamed; /* nodes of the surfaces of all bodies */
} SbRemeshResult;
PetscErrorCode SbRemeshResultCreate(PetscInt nbody,
                                    SbRemeshResult *result); /* empty. SbRemeshResultDestroy() */
PetscErrorCode SbRemeshResultDestroy(SbRemeshResult *result);
PetscErrorCode SbRemeshBodies(SbModel model, const SbGathered *g, const PetscBool due[], PetscInt step,
                              const SbRemeshing *how, SbRemeshResult *result);

/*
  check.c - qualities and momenta.
*/
/* Where the vertices of owned cells are now, x[nvert][3], m: of CR and DG the means around them. Collective. */
PetscErrorCode SbCornerPositions(SbSpace space, Vec U, PetscReal x[]);
/* worst[nbody]: quality of the worst tet of each body that is named, else 1. Collective. */
PetscErrorCode SbBodyQualities(SbModel model, Vec U, const PetscBool named[], PetscReal worst[]);
/* Momentum and angular momentum about the origin of each body, [nbody][6], SI. Collective. */
PetscErrorCode SbBodyMomenta(SbModel model, Vec U, Vec V, PetscReal momenta[][6]);
/* Adds rigid velocities to the named bodies, except at prescribed unknowns, so that they have these momenta.
   Collective. `largest`: speed that was added, m/s. */
PetscErrorCode SbBodySetMomenta(SbModel model, Vec U, Vec V, const PetscBool named[],
                                const PetscReal momenta[][6], PetscReal *largest);

/* effects.c: transfers the history variables of effects to the new model. Collective. */
PetscErrorCode SbEffectsHandOver(SbRun from, SbRun to, const SbRenamed *renamed);
