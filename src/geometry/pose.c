/*
  pose.c - rigid motions: a rotation about an axis through a point, by Rodrigues' formula, then a
  translation.
*/
#include "sbgeometry.h"

void SbPoseSet(const PetscReal axis[3], PetscReal angle, const PetscReal c[3], const PetscReal d[3],
               SbPose *pose)
{
  const PetscReal half = PetscSinReal(angle / 2);
  const PetscReal s = PetscSinReal(angle);
  const PetscReal v = 2 * half * half;
  const PetscReal K[9] = {0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0};
  PetscReal K2[9];

  SbMatMul(K, K, K2);
  *pose = (SbPose){.c = {c[0], c[1], c[2]},
                   .d = {d[0], d[1], d[2]},
                   .axis = {axis[0], axis[1], axis[2]},
                   .angle = angle};
  for (int k = 0; k < 9; k++)
    pose->R[k] = (k % 4 == 0) + s * K[k] + v * K2[k];
}

void SbPoseWay(const SbPose *from, const SbPose *to, const SbPose *at, const PetscReal x[3],
               PetscReal way[3])
{
  PetscReal arm[3];

  for (int i = 0; i < 3; i++)
    arm[i] = x[i] - at->c[i] - at->d[i];
  SbCross(at->axis, arm, way);
  for (int i = 0; i < 3; i++)
    way[i] = (to->angle - from->angle) * way[i] + to->d[i] - from->d[i];
}

void SbPoseApply(const SbPose *pose, const PetscReal X[3], PetscReal x[3])
{
  const PetscReal r[3] = {X[0] - pose->c[0], X[1] - pose->c[1], X[2] - pose->c[2]};

  for (int i = 0; i < 3; i++)
    x[i] = pose->c[i] + SbDot3(pose->R + 3 * i, r) + pose->d[i];
}

void SbPoseInvert(const SbPose *pose, const PetscReal x[3], PetscReal X[3])
{
  PetscReal r[3];

  for (int i = 0; i < 3; i++)
    r[i] = x[i] - pose->c[i] - pose->d[i];
  for (int i = 0; i < 3; i++)
    X[i] = pose->c[i] + pose->R[i] * r[0] + pose->R[3 + i] * r[1] + pose->R[6 + i] * r[2];
}
