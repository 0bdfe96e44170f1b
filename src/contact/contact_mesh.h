/*
  contact_mesh.h - shared by the files about surfaces in contact, and obstacle.c.
*/
#pragma once
#include "sbbarrier.h"
#include "sbtriangles.h"

/* Area of a triangle of the vertices v; n[3], its normal, twice as long. */
static inline PetscReal SbContactTriangleArea(const PetscReal x[], const PetscInt v[3],
                                              PetscReal n[3])
{
  PetscReal a[3], b[3];

  SbSubtract(x + 3 * v[1], x + 3 * v[0], a);
  SbSubtract(x + 3 * v[2], x + 3 * v[0], b);
  SbCross(a, b, n);
  return 0.5 * PetscSqrtReal(SbDot3(n, n));
}

typedef enum {
  PLANE,
  SPHERE,
  BOX,
  CAPSULE,
  CYLINDER,
  BOWL,
  MESH
} Shape;
struct _p_SbObstacle {
  Shape shape;
  PetscReal p[7];                      /* its numbers */
  char option[3 * SB_NAME_MAX], *file; /* full name of it; mesh: its path */
  /* at rest, of a mesh after SbObstacleSetUp(); without triangles one vertex (sphere) or an edge of
     two (capsule), with a radius */
  SbTriangles surface;
  SbSignedDistance distance; /* mesh: of the surface */
};
