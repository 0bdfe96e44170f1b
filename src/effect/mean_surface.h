/*
  mean_surface.h - the continuous surface of bodies with nodes at faces; mean_surface.c.
*/
#pragma once
#include "effect_impl.h"

typedef struct {
  SbSpace space;   /* borrowed */
  PetscInt nfacet; /* boundary facets of owned and ghost cells */
  SbFacet *facet;  /* [nfacet] */
  PetscInt *node;  /* [nfacet] node on the facet, of a weakly supported one that of the support */
  PetscReal *part; /* [nvert][3] share of one facet in the mean at a vertex, by component */
  uint8_t *plane;  /* [nvert] components of the vertex that supports around it prescribe */
} SbMeanSurface;

/* Surfaces of the bodies with in[body]. After supports are set up. Collective. */
PetscErrorCode SbMeanSurfaceCreate(SbSpace space, const PetscBool in[], SbMeanSurface **surface);
PetscErrorCode SbMeanSurfaceDestroy(SbMeanSurface **surface);
/* Whether a support prescribes the displacement of facet i normal to it. Not collective. */
PetscBool SbMeanSurfaceHeld(const SbMeanSurface *surface, PetscInt i);
/* y[nvert][3], m: the vertices at the displacements u[nnode][3] (NULL: none); or their rate for u,
   without the rest positions. Collective. */
PetscErrorCode SbMeanSurfaceMove(const SbMeanSurface *surface, PetscBool rate, const PetscReal u[],
                                 PetscReal y[]);
/* f[nnode][3] += the nodes' part of forces g[nvert][3], N, on vertices, right on owned vertices
   before, and on all after; right on owned nodes. Collective. */
PetscErrorCode SbMeanSurfaceForces(const SbMeanSurface *surface, PetscReal g[], PetscReal f[]);
