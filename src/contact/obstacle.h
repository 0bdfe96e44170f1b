/*
  obstacle.h - rigid obstacles, fixed or on a prescribed path.
*/
#pragma once
#include "sbfem.h"
#include "sbgeometry.h"
#include "sbsurface.h"

typedef struct _p_SbObstacle *SbObstacle;
/*
  SbObstacleCreate - reads the description of a rigid obstacle.

  Not collective.

  Input: option - full name, for messages; text (lengths in m)
    plane:nx,ny,nz,d                 the half-space n.x <= d is solid
    sphere:x,y,z,r   box:x0,y0,z0,x1,y1,z1   capsule:x0,y0,z0,x1,y1,z1,r
    cylinder:x0,y0,z0,x1,y1,z1,r bowl:x,y,z,r                     everything outside the sphere is
    solid mesh:FILE                        what a closed surface encloses: .stl, .obj, .off or .msh
  Output: obstacle; the caller destroys it.
  Errors: PETSC_ERR_USER_INPUT, one line that names option, text and the right form.
*/
PetscErrorCode SbObstacleCreate(const char *option, const char *text, SbObstacle *obstacle);
PetscErrorCode SbObstacleDestroy(SbObstacle *obstacle);
/*
  SbObstacleSetUp - reads the file of a mesh: obstacle, before SbObstacleDistance(); no other shape
  needs it.

  Collective. Every rank holds the whole obstacle.

  Input: scale, at - x <- scale x + at (m) for the coordinates of the file.
  Output: note[size] - one line on the obstacle for the run's report is appended, with other shapes
  nothing. Errors: those of SbTrianglesRead(), alike on all ranks.
*/
PetscErrorCode SbObstacleSetUp(SbObstacle obstacle, MPI_Comm comm, PetscReal scale,
                               const PetscReal at[3], size_t size, char note[]);
/* Signed distance of a point from the obstacle at rest, m, negative inside, and the unit outward
   normal at the nearest point of its surface, or one of several (centre of a sphere). Not
   collective. */
PetscReal SbObstacleDistance(SbObstacle obstacle, const PetscReal x[3], PetscReal normal[3]);

/* Obstacles that only vertices can touch: a half-space, stored as a point of its surface and the
   tip of the unit normal there; a bowl, as its centre. */
typedef enum {
  SB_SIDE_NONE,
  SB_SIDE_PLANE,
  SB_SIDE_BOWL
} SbObstacleSide;

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
