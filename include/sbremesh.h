/* sbremesh.h - layer 10: re-meshing of bodies during a run, and its mesher. */
#pragma once
#include "sbledger.h"
#include "sbsurface.h"

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

/*
  SbRemesh - re-meshing of bodies during a run (src/remesh/remesh.c).

  Order of calls: SbRemeshSetFromOptions() after SbSceneCreate(); SbRemeshAttach() after
  SbRunSetUp() and SbLedgerAttach(), before SbOutputAttach(), whose history gets the column
  remesh_loss; SbRemeshSolve() instead of SbRunSolve(); SbRemeshDestroy().
*/
typedef struct _p_SbRemesh *SbRemesh;
extern const SbOption SbRemeshRows[], SbRemeshBodyRows[];
/* Options read: -remesh_..., -body_<name>_remesh_quality. remesh: NULL when none asks for it.
   Collective. */
PetscErrorCode SbRemeshSetFromOptions(SbModel model, SbRemesh *remesh);
/* Who makes the tets, instead of SbMesherDefault(). Not collective. */
void SbRemeshSetMesher(SbRemesh remesh, SbMesher mesher, void *ctx);
/* NULL: nothing. Not collective. */
PetscErrorCode SbRemeshAttach(SbRemesh remesh, SbRun run);
/*
  The whole time loop or load path, as SbRunSolve(). model, run and ledger (NULL: there is none) are
  replaced when a body is re-meshed; the old ones are destroyed. remesh NULL: SbRunSolve() alone.
  Collective.
*/
PetscErrorCode SbRemeshSolve(SbRemesh remesh, SbModel *model, SbRun *run, SbLedger *ledger);
PetscErrorCode SbRemeshDestroy(SbRemesh *remesh);
