/*
  pressure.h - a surface under a pressure, for effects that know how large it is: pressure.c, with
  the method.
*/
#pragma once
#include "mean_surface.h"

/* An edge of the free rim of the surface under pressure: nodes from, to, and between them (-1:
   none, it is straight). The surface lies to the left, seen from outside. */
typedef struct {
  PetscInt node[3];
} SbRimEdge;

/* First in the data of an effect that has one. */
typedef struct {
  /* the pressure at a stage, Pa; collective */
  PetscErrorCode (*at)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal *p);
  PetscBool follower;
  PetscInt nfacet, nedge;
  PetscInt nrim;       /* edges of its rim, of all ranks; 0: it is closed */
  PetscReal rim_at[3]; /* middle of the first one, m */
  PetscReal sign;      /* of a closed surface: -1 around a cavity, else 1 */
  PetscInt nall;       /* with those of bodies with nodes at faces, which follow the others */
  SbFacet *facet;      /* [nall] of owned and ghost cells; the first nfacet act facet by facet */
  SbRimEdge *rim;      /* [nedge] of P1 and P2, with an owned node */

  /* bodies with nodes at faces */
  PetscReal *share;       /* [nbody] s above; 0 for other bodies */
  SbMeanSurface *surface; /* of these bodies; NULL: there are none */
  PetscReal *weight;      /* [surface->nfacet] c - s */
  PetscBool prisms;       /* the surface is closed, or facets go on behind its rim that are held */
  PetscBool some;         /* some facet that is not held has a weight, on some rank */
  PetscReal volume;       /* that history adds, so that the geometric volume results at rest, m^3 */
  PetscReal *vertex[3];   /* [nvert][3] work arrays */
} SbPressure;

/* Operations of these effects (sbeffect.h); `data` begins with an SbPressure whose `at` and
   `follower` are set. */
PetscErrorCode SbPressureSetUp(SbEffect e, SbSpace space);
PetscErrorCode SbPressureForce(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[]);
PetscErrorCode SbPressureTangent(SbEffect e, SbSpace space, const SbStage *stage, Mat A);
PetscErrorCode SbPressureBeside(SbEffect e, SbSpace space, const SbStage *stage,
                                const PetscReal x[], PetscReal y[]);
PetscErrorCode SbPressureVolume(SbEffect e, PetscReal t, PetscReal pressure[]);
PetscErrorCode SbPressureDestroy(SbEffect e);
/* The rim of the surface, between vertices of the mesh: number of its edges on all ranks, and of
   those that no facet of a body with nodes at faces goes on behind which is held in its normal
   direction; the middle of the first one by original numbers, m. Collective; of p: nall, facet, and
   what belongs to `surface`. */
PetscErrorCode SbPressureRim(const SbPressure *p, SbMesh mesh, PetscInt nrim[2], PetscReal at[3]);
/* f[nnode][3] += the forces of the pressure p, Pa, at the displacements u; right on owned nodes. */
PetscErrorCode SbPressureAddForce(const SbPressure *load, SbSpace space, PetscReal p,
                                  const PetscReal u[], PetscReal f[]);
/* This rank's part of the volume inside the surface at the displacements u, m^3; negative in a
   cavity. */
PetscErrorCode SbPressureInside(const SbPressure *load, SbSpace space, const PetscReal u[],
                                PetscReal *inside);
