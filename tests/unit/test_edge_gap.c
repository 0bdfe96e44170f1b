// @ranks 1 3
/*
  The gaps around edges of CR and DG: the volume of the cells and of the gaps together depends on
  the boundary only; energy, forces and matrix belong together; what a support gets balances the
  rest.
*/
#include "../../src/fem/fem_impl.h"
#include "../scene.h"

/* Pressed to nine tenths in all directions by supports: the pressure is the same in every cell. */
static const char *const scene =
  "-bodies a -body_a_mesh box:0.5,0.4,0.3:2 -body_a_material stable_neohookean -body_a_young 1e5 "
  "-body_a_poisson 0.3 -body_a_density 1000 -body_a_element %s -body_a_tangent exact %s -time "
  "static";

/* Supports: held all around or at one end, smooth walls all around, one beside an end. */
#define HOLD(on)                                                                                \
  "-effect_hold_type prescribed_displacement -effect_hold_on " on " -effect_hold_displacement " \
  "-0.1*x;-0.1*y;-0.1*z "
#define WALLS(k, on)                                                                               \
  "-effect_" k "_type prescribed_displacement -effect_" k "_on " on " -effect_" k "_components " k \
  " -effect_" k "_displacement -0.1*x;-0.1*y;-0.1*z "
#define ALL "-effects hold " HOLD("boundary")
#define END "-effects hold " HOLD("zmin")
#define SMOOTH \
  "-effects x,y,z " WALLS("x", "xmin,xmax") WALLS("y", "ymin,ymax") WALLS("z", "zmin,zmax")
#define CUT "-effects hold,x " HOLD("zmin,zmax,ymin,ymax") WALLS("x", "xmin,xmax")

static void pressed(const PetscReal x[3], PetscReal v[3])
{
  for (int k = 0; k < 3; k++)
    v[k] = -0.1 * x[k];
}

/* Moves free components of nodes, each differently, the same on any number of ranks. */
static PetscErrorCode roughen(SbSpace s, PetscReal size, PetscReal seed, Vec U)
{
  PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(U, &u));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (!(s->fixed[i / 3] & (1 << i % 3)))
      u[i] += size * PetscSinReal(seed * (PetscReal)(3 * s->node_orig[i / 3] + i % 3));
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pressed scene, with the gaps of that state. */
static PetscErrorCode open_scene(const char *element, const char *supports, TestScene *t, Vec *U)
{
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(test_open(t, scene, element, supports));
  s = t->model->space;
  s->beta[0] = 1.; /* the energy of the penalty alone is that of damping */
  PetscCall(SbSpaceCreateVec(s, U));
  t->model->load = 1.;
  PetscCall(test_fill(t->model, pressed, *U));
  PetscCall(SbModelPrescribe(t->model, 1., *U));
  PetscCall(SbSpaceFollowJumps(s, *U, NULL, SB_STEPS_OF_LOAD, 0., NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy of the gaps, J, and volume of the cells, m^3. */
static PetscErrorCode state_of(SbSpace s, Vec U, PetscReal value[2])
{
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  value[0] =
    SbJumpEnergy(s, u, SB_JUMP_STIFFNESS, NULL) - SbJumpEnergy(s, u, SB_JUMP_DAMPING, NULL);
  value[1] = SbSpaceVolume(s, 0, u);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 2, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces of the gaps: those of the face terms less those of the penalty. */
static PetscErrorCode forces_of(SbSpace s, Vec U, Vec F)
{
  const PetscReal *u;
  PetscReal *f, *g;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &g));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(SbSpaceGetLocalWrite(s, F, &f));
  PetscCall(PetscArrayzero(f, 3 * s->nnode));
  SbJumpAdd(s, u, SB_JUMP_STIFFNESS, f);
  SbJumpAdd(s, u, SB_JUMP_DAMPING, g);
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    f[i] -= g[i];
  PetscCall(SbSpaceRestoreLocalWrite(s, F, &f));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscFree(g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* p times the volume of cells and gaps stays, whatever the free nodes do: exactly inside of held
   faces, at walls to second order in `size`, m. */
static PetscErrorCode check_volume(const char *supports, PetscReal size, PetscReal tolerance)
{
  TestScene t;
  PetscReal before[2], after[2], sigma[6], J, tension;
  PetscReal *all, *dets;
  const PetscReal *u;
  SbSpace s;
  Vec U;

  PetscFunctionBeginUser;
  PetscCall(open_scene("cr", supports, &t, &U));
  s = t.model->space;
  PetscCall(PetscMalloc2(6 * s->mesh->ncell_owned, &all, s->mesh->ncell_owned, &dets));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  SbSpaceCellState(s, u, all, dets, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscArraycpy(sigma, all, 6));
  J = dets[0];
  PetscCall(PetscFree2(all, dets));
  tension =
    (sigma[0] + sigma[1] + sigma[2]) / 3. + SbMaterialShearModulus(t.model->material[0]) / 4.;
  SB_CHECK_NEAR(J, 0.729, 1e-12, "the cells are not pressed evenly");
  PetscCall(state_of(s, U, before));
  PetscCall(roughen(s, size, 17., U));
  PetscCall(state_of(s, U, after));
  PetscCall(PetscPrintf(s->comm, "  cells %g m^3 more, gaps %g J more, tension %g Pa\n",
                        after[1] - before[1], after[0] - before[0], tension));
  SB_CHECK(PetscAbsReal(after[1] - before[1]) > 0.1 * PetscSqr(size),
           "the volume of the cells hardly changes");
  SB_CHECK_NEAR((after[0] - before[0]) / (tension * (before[1] - after[1])), 1., tolerance,
                "energy of the gaps, of that of the missing volume");
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The energy is quadratic: its central difference is exact. Forces sum up to zero. */
static PetscErrorCode check_forces(const char *element, const char *supports)
{
  TestScene t;
  PetscReal value[2][2];
  PetscScalar slope, sum;
  PetscReal size;
  SbSpace s;
  Vec U, W, F;

  PetscFunctionBeginUser;
  PetscCall(open_scene(element, supports, &t, &U));
  s = t.model->space;
  PetscCall(VecDuplicate(U, &W));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(roughen(s, 1e-2, 17., U));
  PetscCall(roughen(s, 1e-2, 13., W));
  PetscCall(forces_of(s, U, F));
  PetscCall(VecDot(F, W, &slope));
  PetscCall(VecSum(F, &sum));
  PetscCall(VecNorm(F, NORM_1, &size));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecAXPY(U, k ? -2. : 1., W));
    PetscCall(state_of(s, U, value[k]));
  }
  PetscCall(PetscPrintf(s->comm, "  %s: slope %.12g J, sum of forces %g of %g N\n", element, slope,
                        sum, size));
  SB_CHECK(size > 1., "%s: no forces", element);
  SB_CHECK_NEAR((value[0][0] - value[1][0]) / 2., slope, 1e-10 * size, "slope of the energy");
  SB_CHECK_NEAR(sum, 0., 1e-13 * size, "sum of the forces");
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&W));
  PetscCall(VecDestroy(&F));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangent of the model against differences of its residual. */
static PetscErrorCode check_matrix(const char *element, const char *supports, SbMatrixKind kind)
{
  const PetscReal h = 1e-5;
  TestScene t;
  PetscReal size, error;
  SbSpace s;
  Vec U, W, R[2], Y;
  Mat K;

  PetscFunctionBeginUser;
  PetscCall(open_scene(element, supports, &t, &U));
  s = t.model->space;
  s->beta[0] = 0.;
  PetscCall(VecDuplicate(U, &W));
  PetscCall(VecDuplicate(U, &Y));
  PetscCall(roughen(s, 1e-4, 17., U));
  PetscCall(roughen(s, 1., 13., W));
  PetscCall(SbSpaceCreateMatrix(s, kind, &K));
  PetscCall(SbModelTangent(t.model, 1., 0., 0., 1., U, NULL, K));
  PetscCall(MatMult(K, W, Y));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecDuplicate(U, &R[k]));
    PetscCall(VecAXPY(U, k ? -2. * h : h, W));
    PetscCall(SbModelResidual(t.model, 1., U, NULL, NULL, PETSC_TRUE, R[k]));
  }
  PetscCall(VecAXPBY(R[0], -0.5 / h, 0.5 / h, R[1]));
  PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, Y));
  PetscCall(VecNorm(Y, NORM_2, &size));
  PetscCall(VecAXPY(Y, -1., R[0]));
  PetscCall(VecNorm(Y, NORM_2, &error));
  PetscCall(PetscPrintf(s->comm, "  %s: matrix off by %g of %g\n", element, error, size));
  SB_CHECK(error < 1e-6 * size, "%s: the matrix differs by %g from differences of the residual",
           element, error / size);
  for (int k = 0; k < 2; k++)
    PetscCall(VecDestroy(&R[k]));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&W));
  PetscCall(VecDestroy(&Y));
  PetscCall(MatDestroy(&K));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_volume(ALL, 1e-3, 1e-9));
  PetscCall(check_volume(CUT, 1e-4, 1e-4));
  PetscCall(check_volume(SMOOTH, 1e-4, 1e-4));
  PetscCall(check_forces("cr", END));
  PetscCall(check_forces("dg", END));
  PetscCall(check_forces("cr", CUT));
  PetscCall(check_forces("cr", SMOOTH));
  PetscCall(check_matrix("cr", END, SB_MATRIX_AIJ));
  PetscCall(check_matrix("cr", END, SB_MATRIX_BAIJ));
  PetscCall(check_matrix("dg", END, SB_MATRIX_BAIJ));
  PetscCall(check_matrix("cr", SMOOTH, SB_MATRIX_BAIJ));
  SB_TEST_END();
}
