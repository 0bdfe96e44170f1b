/*
  sbcontact.h - layer 7: rigid obstacles, fixed or on a prescribed path.
*/
#pragma once
#include "sbfem.h"

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
/* A rigid motion: x = c + R (X - c) + d; R turns by an angle (rad) about the unit axis. */
typedef struct {
  PetscReal R[9], c[3], d[3], axis[3], angle;
} SbPose;
/* Tangent of the arc from pose `from` to pose `to` at the end `at`, for the point x there: way = d1
   - d0 + (angle1 - angle0) axis x (x - c - d), m. Not collective. */
void SbPoseWay(const SbPose *from, const SbPose *to, const SbPose *at, const PetscReal x[3],
               PetscReal way[3]);
/* Rotation by an angle (rad) about the unit axis through c, then the translation d. */
void SbPoseSet(const PetscReal axis[3], PetscReal angle, const PetscReal c[3], const PetscReal d[3],
               SbPose *pose);
void SbPoseApply(const SbPose *pose, const PetscReal X[3], PetscReal x[3]);
void SbPoseInvert(const SbPose *pose, const PetscReal x[3], PetscReal X[3]);
