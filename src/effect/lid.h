/*
  lid.h - lids over the openings of a cavity: lid.c, with the method; the facets of its wall.
*/
#pragma once
#include "effect_impl.h"

/* A facet of a wall, as ranks send it. */
typedef struct {
  PetscInt vertex[3], node[3]; /* gvert, gnode */
  PetscReal x[3][3];           /* m, counter-clockwise seen from outside of its body */
} SbWallFacet;
/* Those of owned cells, of all ranks. Collective; the caller frees them. */
PetscErrorCode SbWallGather(SbSpace space, PetscInt nfacet, const SbFacet facets[], PetscInt *n,
                            SbWallFacet **facet);

/* A lid: the vertices of its rim, in the order in which a facet of the wall would go around
   them. */
typedef struct {
  PetscInt n;
  PetscInt *node; /* [n] among the nodes of the coupling */
} SbLid;

/* Start with {0}. */
typedef struct {
  PetscInt n, size;
  SbLid *lid; /* [n] of all ranks */
} SbLids;

/* Of the rims of n facets; all[nnode]: the nodes of the coupling, sorted. Errors
   (PETSC_ERR_USER_INPUT, alike on all ranks): there is none, rims that touch each other. */
PetscErrorCode SbLidsFind(SbLids *lids, SbEffect e, MPI_Comm comm, PetscInt n,
                          const SbWallFacet facet[], PetscInt nnode, const PetscInt all[]);
/* What they add to SbPressureInside(), m^3: on the rank that owns the first node of the coupling
   `number`, -1: none of its nodes is owned here. u NULL: at rest. Not collective. */
PetscReal SbLidsInside(const SbLids *lids, SbSpace space, PetscInt number, const PetscReal u[]);
/* f[nnode][3] += the forces of a pressure p, Pa, on them, N; right on owned nodes. Not
   collective. */
void SbLidsPush(const SbLids *lids, SbSpace space, PetscInt number, PetscReal p,
                const PetscReal u[], PetscReal f[]);
/* K[3 n][3 n] of the coupling += factor times the derivative of minus these forces for p = 1. Not
   collective. */
void SbLidsTurn(const SbLids *lids, SbSpace space, PetscInt number, PetscReal factor,
                const PetscReal u[], PetscInt n, PetscReal K[]);
PetscErrorCode SbLidsDestroy(SbLids *lids);
