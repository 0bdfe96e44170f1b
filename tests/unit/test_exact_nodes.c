// @ranks 1 3
/*
  Nodes solved exactly: for any preconditioner of the rest, the residual at these nodes vanishes
  afterwards (to the 1e-4 of the 16-bit factor); the correction is symmetric; constrained nodes and
  nodes with non-local rows are never chosen.
*/
#include "../../src/pc/rotated.h"
#include "../scene.h"

static const char *const scene =
  "-bodies a -body_a_mesh box:1,0.5,0.4:6,4,4 -body_a_material corotated "
  "-body_a_young 1e3 -body_a_poisson 0.3 -body_a_density 10 "
  "-sets left -set_left_at plane:1,0,0,0 -effects clamp -effect_clamp_type "
  "fixed -effect_clamp_on left -effect_clamp_components x";

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.4 * PetscSinReal(3. * x[0] + x[1]);
  v[1] = 0.3 * PetscCosReal(2. * x[1] - x[2]) * x[0];
  v[2] = 0.5 * PetscSinReal(x[0] + 4. * x[2]) * x[0];
}

/* z = M r, with P a multiple of the identity. */
static void apply(SbExactNodes *e, PetscInt n, const float r[], float work[], float z[])
{
  for (PetscInt i = 0; i < n; i++)
    work[i] = r[i];
  SbExactNodesBefore(e, work);
  for (PetscInt i = 0; i < n; i++)
    z[i] = 0.01f * work[i];
  SbExactNodesAfter(e, r, z);
}

int main(int argc, char **argv)
{
  TestScene t;
  SbExactNodes e = {0};
  SbSpace s;
  PetscReal *spread;
  PetscReal worst = 0.;
  PetscReal products[2] = {0., 0.};
  PetscInt n;
  PetscInt wrong = 0;
  PetscInt total;
  float *r, *w, *z, *r2, *z2;
  Mat A;
  Vec U;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_scene_open(scene, &t));
  s = t.model->space;
  n = 3 * s->nnode_owned;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(test_fill(t.model, wave, U));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A));
  PetscCall(SbModelTangent(t.model, 0., 0., 50., 1., U, NULL, A));
  PetscCall(PetscMalloc6(s->nnode_owned, &spread, n, &r, n, &w, n, &z, n, &r2, n, &z2));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    spread[i] = s->node_x[3 * i] < 0.5 ? 1. : 0.;
  for (PetscInt i = 0; i < n; i++) {
    r[i] = sinf((float)(i + 1));
    r2[i] = cosf((float)(3 * i));
  }
  PetscCall(SbExactNodesSetUp(&e, s, A, spread, 2.));
  SB_CHECK(e.n == 0, "%" PetscInt_FMT " nodes above a limit that none reaches", e.n);
  apply(&e, n, r, w, z);
  for (PetscInt i = 0; i < n; i++)
    wrong += z[i] != 0.01f * r[i];
  SB_CHECK(wrong == 0, "without nodes the rest is not left alone");

  PetscCall(SbExactNodesSetUp(&e, s, A, spread, 0.5));
  wrong = 0;
  for (PetscInt k = 0; k < e.n; k++)
    wrong += s->fixed[e.node[k]] != 0 || spread[e.node[k]] < 1. ||
             s->plan->oi[e.node[k]] < s->plan->oi[e.node[k] + 1];
  SB_CHECK(wrong == 0, "%" PetscInt_FMT " nodes must not have been chosen", wrong);
  PetscCallMPI(MPI_Allreduce(&e.n, &total, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(total > 5, "%" PetscInt_FMT " nodes", total);
  apply(&e, n, r, w, z);
  apply(&e, n, r2, w, z2);
  for (PetscInt k = 0; k < e.n; k++) {
    for (PetscInt c = 0; c < 3; c++) {
      PetscReal sum = -r[3 * e.node[k] + c];

      for (PetscInt at = e.ia[k]; at < e.ia[k + 1]; at++)
        for (PetscInt d = 0; d < 3; d++)
          sum += e.value[9 * at + 3 * c + d] * z[3 * e.ja[at] + d];
      worst = PetscMax(worst, PetscAbsReal(sum));
    }
  }
  SB_CHECK(worst < 1e-3, "residual %g on nodes that are solved exactly", worst);
  for (PetscInt i = 0; i < n; i++) {
    products[0] += z[i] * r2[i];
    products[1] += z2[i] * r[i];
  }
  SB_CHECK_NEAR(products[0], products[1], 1e-4 * (1. + PetscAbsReal(products[0])), "symmetry");
  PetscCall(SbExactNodesDestroy(&e));
  PetscCall(PetscFree6(spread, r, w, z, r2, z2));
  PetscCall(MatDestroy(&A));
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&t));
  SB_TEST_END();
}
