// @ranks 1 3
/* Rotations of nodes: exact for a rigid rotation by any angle, the local rotation in a bent bar, I
   for linear materials. */
#include "../scene.h"
#include "sbfem.h"

static const char *const bar =
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:16,4,4 -body_bar_material %s "
  "-body_bar_young 5e4 -body_bar_poisson 0.4 -body_bar_density 1000";

static PetscReal angle; /* rad */

static void turned(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal c = PetscCosReal(angle);
  const PetscReal s = PetscSinReal(angle);

  u[0] = (c - 1.) * x[0] + s * x[2];
  u[1] = 0.3;
  u[2] = -s * x[0] + (c - 1.) * x[2];
}

static void bent(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal radius = 0.4 / angle;
  const PetscReal phi = x[0] / radius;
  const PetscReal z = x[2] - 0.05;

  u[0] = (radius + z) * PetscSinReal(phi) - x[0];
  u[1] = 0.;
  u[2] = (radius + z) * PetscCosReal(phi) - radius - z;
}

/* Largest |R - Q(angle at x)| and largest spread; the rotation about y is `angle`, or increases
   along the bar when it is bent. */
static PetscErrorCode measure(const char *law, PetscBool bend, PetscReal *error, PetscReal *spread)
{
  TestScene t;
  const PetscReal *u;
  PetscReal *R, *found;
  SbPack *cells;
  SbSpace s;
  Vec U;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, bar, law));
  s = t.model->space;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(test_fill(t.model, bend ? bent : turned, U));
  PetscCall(PetscMalloc2(9 * s->nnode_owned, &R, s->nnode_owned, &found));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(PetscMalloc1(9 * sb_rotation_points(s) * s->nbatch, &cells));
  SbSpaceCellRotations(s, u, cells);
  PetscCall(SbSpaceAverageRotations(s, (const SbPack *)cells, R, found));
  PetscCall(PetscFree(cells));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  *error = *spread = 0.;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal phi = bend ? angle * s->node_x[3 * i] / 0.4 : angle;
    const PetscReal c = PetscCosReal(phi);
    const PetscReal d = PetscSinReal(phi);
    const PetscReal Q[9] = {c, 0., d, 0., 1., 0., -d, 0., c};

    for (int k = 0; k < 9; k++)
      *error = PetscMax(*error, PetscAbsReal(R[9 * i + k] - Q[k]));
    *spread = PetscMax(*spread, found[i]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, error, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, spread, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscFree2(R, found));
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal error, spread, coarse;

  SB_TEST_BEGIN(argc, argv);
  for (angle = 0.; angle < 6.; angle += 0.7) {
    PetscCall(measure("corotated", PETSC_FALSE, &error, &spread));
    SB_CHECK(error < 1e-12 && spread < 1e-12, "turned by %g: error %g, spread %g", angle, error,
             spread);
  }
  angle = 2.;
  PetscCall(measure("stable_neohookean", PETSC_FALSE, &error, &spread));
  SB_CHECK(error < 1e-12, "a law without frame, turned by 2: error %g", error);
  PetscCall(measure("linear", PETSC_FALSE, &error, &spread));
  SB_CHECK(error > 1. && spread == 0., "a linear law is not turned, but error is %g, spread %g",
           error, spread);

  /* a cell has 1/16 of the length of the bar: its rotation differs from that of its nodes by about
     angle / 32, at the ends by twice that */
  PetscCall(measure("corotated", PETSC_TRUE, &error, &spread));
  SB_CHECK(error > 0. && error < angle / 16., "bent by 2: error %g", error);
  SB_CHECK(spread < 8. * PetscSqr(angle / 16.), "bent by 2: spread %g", spread);
  coarse = spread;
  angle = 1.;
  PetscCall(measure("corotated", PETSC_TRUE, &error, &spread));
  SB_CHECK(coarse > 3. * spread, "spread falls from %g to %g when half as bent: it is a square",
           coarse, spread);
  SB_TEST_END();
}
