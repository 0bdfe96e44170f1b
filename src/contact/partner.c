/*
  partner.c - the other side of a contact where that is a rigid obstacle: its options, its path, and
  the force and torque on it.
*/
#include "contact_impl.h"

PetscErrorCode SbPartnerRead(SbEffect e, const SbScope *scope, SbPartner *p)
{
  char option[3 * SB_NAME_MAX], text[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(SbOptionString(scope, "obstacle", sizeof(text), text));
  if (!text[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  SbOptionName(scope, "obstacle", sizeof(option), option);
  PetscCall(SbObstacleCreate(option, text, &p->obstacle));
  if (p->obstacle->shape == MESH) {
    PetscCall(SbOptionReal(scope, "obstacle_scale", &p->scale));
    PetscCall(SbOptionReals(scope, "obstacle_at", p->at));
  }
  PetscCall(SbPathRead(e, scope, PETSC_FALSE, &p->path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPartnerSetUp(SbEffect e, MPI_Comm comm, SbPartner *p)
{
  PetscFunctionBeginUser;
  if (p->obstacle)
    PetscCall(SbObstacleSetUp(p->obstacle, comm, p->scale, p->at, sizeof(e->note), e->note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPartnerDestroy(SbPartner *p)
{
  PetscFunctionBeginUser;
  PetscCall(SbObstacleDestroy(&p->obstacle));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPartnerPose(const SbPartner *p, PetscReal t, SbPose *pose)
{
  PetscReal d[3], degrees;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++)
    PetscCall(SbFormulaEval(p->path.displacement[i], t, NULL, &d[i]));
  PetscCall(SbFormulaEval(p->path.angle, t, NULL, &degrees));
  SbPoseSet(p->path.axis, degrees * PETSC_PI / 180, p->path.point, d, pose);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPartnerBeginStep(PetscReal t, PetscReal dt, SbPartner *p)
{
  PetscFunctionBeginUser;
  if (!p->obstacle)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbPartnerPose(p, t, &p->pose[0]));
  PetscCall(SbPartnerPose(p, t + dt, &p->pose[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbPartnerAddForce(const SbPartner *p, const SbPose *pose, const PetscReal x[3],
                       const PetscReal f[3], PetscReal values[])
{
  PetscReal arm[3], moment[3];

  for (int i = 0; i < 3; i++)
    arm[i] = x[i] - p->path.point[i] - pose->d[i];
  SbCross(arm, f, moment);
  for (int i = 0; i < 3; i++) {
    values[i] += f[i];
    values[3 + i] += moment[i];
  }
}

PetscBool SbContactHasObstacle(SbContact contact)
{
  return (PetscBool)(((const Contact *)contact->effect->data)->partner.obstacle != NULL);
}
