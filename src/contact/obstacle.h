/*
  obstacle.h - the surface of a rigid obstacle, for contact_mesh.c.
*/
#pragma once
#include "sbcontact.h"

/* The surface of an obstacle at rest: vertices, and triangles; without triangles one vertex (sphere) or an
   edge of two (capsule), with a radius. Its arrays are the obstacle's. */
typedef struct {
  SbObstacleSide side;
  PetscReal radius; /* m; of a bowl, too */
  PetscInt nvertex, ntriangle;
  const PetscReal *x;       /* [nvertex][3] m */
  const PetscInt *triangle; /* [ntriangle][3] counter-clockwise seen from outside */
} SbObstacleSurface;
/* Not collective, after SbObstacleSetUp(). */
SbObstacleSurface SbObstacleGetSurface(SbObstacle obstacle);
