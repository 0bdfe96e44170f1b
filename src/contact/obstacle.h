/*
  obstacle.h - the surface of a rigid obstacle, for contact_mesh.c.
*/
#pragma once
#include "sbcontact.h"

/* The surface of an obstacle at rest: vertices, and triangles; without triangles one vertex (sphere) or an edge of two (capsule), with a radius. */
typedef struct {
  SbObstacleSide side;
  PetscReal radius; /* m; of a bowl, too */
  PetscInt nvertex, ntriangle;
  PetscReal *x;       /* [nvertex][3] m; owned */
  PetscInt *triangle; /* [ntriangle][3] counter-clockwise seen from outside; owned */
} SbObstacleSurface;
/* Not collective, after SbObstacleSetUp(); release with SbObstacleFreeSurface(). */
PetscErrorCode SbObstacleGetSurface(SbObstacle obstacle, SbObstacleSurface *surface);
PetscErrorCode SbObstacleFreeSurface(SbObstacleSurface *surface);
