/*
  contact_problem.h - linear system of two blocks in barrier contact, with a given contact
  stiffness.
*/
#pragma once
#include "scene.h"

typedef struct {
  TestScene scene;
  Mat K;
  Vec F, Y;
  SbBlocks blocks;
  PetscInt npair; /* number of contact blocks of all ranks */
  PetscReal
    scale; /* current mean diagonal of the contact blocks over that of K, at nodes in contact */
} ContactProblem;

/* Tangent K + M / h^2 at rest of two blocks of an element, `cells` along the edge of the upper one,
   and their contact blocks. Collective. */
static inline PetscErrorCode contact_problem_open(PetscInt cells, const char *element, PetscReal h,
                                                  const char *more, ContactProblem *p)
{
  SbStage stage = {.shift_k = 1., .shift_a = 1. / (h * h)};
  char text[2048];
  const PetscReal *u;
  PetscScalar *f;
  PetscMPIInt size;
  SbSpace s;
  Vec zero;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(p, sizeof(*p)));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-bodies low,high -body_low_mesh box:0.12,0.12,0.06:%d -body_high_mesh box:0.08,0.08,0.06:%d "
    "-body_high_translate 0.021,0.018,0.06005 -body_low_material linear -body_low_young 1e5 "
    "-body_low_poisson 0.4 -body_low_density 1000 -body_high_material linear -body_high_young 1e5 "
    "-body_high_poisson 0.4 -body_high_density 1000 -body_low_element %s -body_high_element %s "
    "-effects hold,meet -effect_hold_type fixed -effect_hold_on low.zmin -effect_meet_type contact "
    "-effect_meet_response barrier -effect_meet_barrier_width 1e-4 -time euler_implicit -ts_dt %g "
    "%s",
    (int)PetscMax(1, cells * 4 / 5), (int)cells, element, element, (double)h, more));
  PetscCall(test_scene_open(text, &p->scene));
  s = p->scene.model->space;

  /* tangent and contact blocks at rest, where the barrier is not softened */
  PetscCall(SbSpaceCreateMatrix(s, size == 1 ? SB_MATRIX_SBAIJ : SB_MATRIX_BAIJ, &p->K));
  PetscCall(SbSpaceCreateVec(s, &zero));
  PetscCall(SbContactSetBeginStep(&p->scene.model->contacts, 0., h, 0., PETSC_FALSE, zero, NULL));
  PetscCall(SbSpaceCreateVec(s, &p->F));
  PetscCall(
    SbContactSetHessian(&p->scene.model->contacts, zero, SB_HESSIAN_PROJECTED, &p->blocks, p->F));
  PetscCall(SbSpaceGetLocalRead(s, zero, &u));
  stage.u = u;
  PetscCall(SbSpaceAssembleTangent(s, &stage, p->K));
  PetscCall(SbSpaceFinishTangent(s, p->K));
  PetscCall(SbSpaceRestoreLocalRead(s, zero, &u));
  PetscCall(VecDestroy(&zero));
  PetscCallMPI(MPI_Allreduce(&p->blocks.n, &p->npair, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));

  /* a load that varies from node to node */
  PetscCall(VecDuplicate(p->F, &p->Y));
  PetscCall(VecGetArray(p->F, &f));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    const PetscReal *x = s->node_x + 3 * (i / 3);

    f[i] = s->fixed[i / 3] & (1 << i % 3)
             ? 0.
             : s->node_mass[i / 3] * ((i % 3 == 2 ? -9.81 : 0.3) +
                                      PetscSinReal(40. * x[i % 3] + 70. * x[0] + 90. * x[1]));
  }
  PetscCall(VecRestoreArray(p->F, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scales the contact blocks so that their mean diagonal is `ratio` times that of K. Collective. */
static inline PetscErrorCode contact_problem_scale(ContactProblem *p, PetscReal ratio)
{
  const SbSpace s = p->scene.model->space;
  PetscReal sum[3] = {0., 0., 0.};
  PetscReal *own;
  const PetscScalar *d;
  Vec D;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(s->nnode_owned, &own));
  for (PetscInt k = 0; k < p->blocks.n; k++)
    if (p->blocks.block[k].v[1] == s->gnode_start + p->blocks.block[k].v[0])
      own[p->blocks.block[k].v[0]] +=
        p->blocks.block[k].H[0] + p->blocks.block[k].H[4] + p->blocks.block[k].H[8];
  PetscCall(VecDuplicate(p->F, &D));
  PetscCall(MatGetDiagonal(p->K, D));
  PetscCall(VecGetArrayRead(D, &d));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (own[i] <= 0.)
      continue;
    sum[0] += own[i];
    sum[1] += d[3 * i] + d[3 * i + 1] + d[3 * i + 2];
  }
  PetscCall(VecRestoreArrayRead(D, &d));
  PetscCall(VecDestroy(&D));
  PetscCall(PetscFree(own));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  for (PetscInt k = 0; k < 9 * p->blocks.n; k++)
    p->blocks.block[k / 9].H[k % 9] *= ratio * sum[1] / sum[0];
  p->scale = ratio;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |F - (K + C) Y| / |F|, with the product of C computed block by block. Collective. */
static inline PetscErrorCode contact_problem_residual(ContactProblem *p, PetscReal *relative)
{
  const PetscScalar *y;
  PetscScalar *r;
  PetscReal norm;
  VecScatter scatter;
  Vec R, all;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(p->F, &R));
  PetscCall(MatMult(p->K, p->Y, R));
  PetscCall(VecAYPX(R, -1., p->F));
  PetscCall(VecScatterCreateToAll(p->Y, &scatter, &all));
  PetscCall(VecScatterBegin(scatter, p->Y, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, p->Y, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(all, &y));
  PetscCall(VecGetArray(R, &r));
  for (PetscInt k = 0; k < 9 * p->blocks.n; k++)
    r[3 * p->blocks.block[k / 9].v[0] + k % 9 / 3] -=
      p->blocks.block[k / 9].H[k % 9] * y[3 * p->blocks.block[k / 9].v[1] + k % 3];
  PetscCall(VecRestoreArray(R, &r));
  PetscCall(VecRestoreArrayRead(all, &y));
  PetscCall(VecNorm(R, NORM_2, relative));
  PetscCall(VecNorm(p->F, NORM_2, &norm));
  *relative /= norm;
  PetscCall(VecDestroy(&all));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode contact_problem_close(ContactProblem *p)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(p->blocks.block));
  PetscCall(MatDestroy(&p->K));
  PetscCall(VecDestroy(&p->F));
  PetscCall(VecDestroy(&p->Y));
  PetscCall(test_scene_close(&p->scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
