/*
  Quadrature of dead loads: force and first moments of polynomial densities up to the documented
  degree, on the cells and on one face of a unit cube; degree 5 and above must show an error
  (otherwise the test would not detect the degree); time-dependent densities; every element.

  With linear basis functions sum_a f_a = integral q and sum_a f_a x_a = integral q x, exactly if q
  phi_a is integrated exactly: degree 4 of q on rules of degree 5.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {{"top", "plane:0,0,1,1"}};

/* Integral of x^i y^j z^k over the unit cube, or over its face z = 1. */
static PetscReal exact(PetscInt ncorner, const int p[3])
{
  return 1.0 / ((p[0] + 1) * (p[1] + 1) * (ncorner == 4 ? p[2] + 1 : 1));
}

/* Sums over the owned nodes of all ranks: f_x, and f_x x, f_x y, f_x z. */
static PetscErrorCode moments(Fixture *x, SbEffect load, PetscReal t, PetscReal all[4])
{
  PetscReal sum[4] = {0};

  PetscFunctionBeginUser;
  PetscCall(effect_force(x, load, t));
  for (PetscInt i = 0; i < x->space->nnode_owned; i++) {
    sum[0] += x->f[3 * i];
    for (int c = 0; c < 3; c++)
      sum[1 + c] += x->f[3 * i] * x->space->node_x[3 * i + c];
    SB_CHECK(x->f[3 * i + 1] == 0 && x->f[3 * i + 2] == 0, "other components");
  }
  PetscCallMPI(MPI_Allreduce(sum, all, 4, MPIU_REAL, MPI_SUM, x->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_monomial(Fixture *x, PetscInt ncorner, const int p[3])
{
  SbEffect load;
  char text[128];
  PetscReal sum[4];

  PetscFunctionBeginUser;
  PetscCall(
    PetscSNPrintf(text, sizeof(text), "-effect_%s x^%d*y^%d*z^%d;0;0",
                  ncorner == 4 ? "body_force_density" : "traction_on top -effect_traction_vector",
                  p[0], p[1], p[2]));
  PetscCall(effect_create(x, ncorner == 4 ? "body_force" : "traction", text, &load));
  PetscCall(moments(x, load, 0, sum));
  if (p[0] + p[1] + p[2] <= 4) {
    // The published points and weights have 20 digits; rounding of some hundred additions.
    SB_CHECK_NEAR(sum[0], exact(ncorner, p), 1e-14, text);
    for (int c = 0; c < 3; c++) {
      int higher[3] = {p[0], p[1], p[2]};

      higher[c]++;
      SB_CHECK_NEAR(sum[1 + c], exact(ncorner, higher), 1e-14, text);
    }
  } else {
    SB_CHECK(PetscAbsReal(sum[0] - exact(ncorner, p)) > 1e-10, "%s is beyond the rule, yet exact",
             text);
  }
  PetscCall(SbEffectDestroy(&load));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_time(Fixture *x)
{
  SbEffect load;
  PetscReal sum[4];

  PetscFunctionBeginUser;
  PetscCall(effect_create(
    x, "body_force", "-effect_body_force_density 3*t*x;0;0 -effect_body_force_time 0.5", &load));
  for (int k = 0; k < 4; k++) {
    const PetscReal t =
      k < 2 ? 2.0 : (PetscReal)k - 3; // twice the same time, then back to earlier ones

    PetscCall(moments(x, load, t, sum));
    SB_CHECK_NEAR(sum[0], 0.5 * 3 * t * 0.5, 1e-14, "force that grows with time");
    SB_CHECK_NEAR(sum[1], 0.5 * 3 * t / 3, 1e-14, "its moment");
  }
  PetscCall(SbEffectDestroy(&load));
  PetscCall(PetscOptionsClearValue(NULL, "-effect_body_force_time"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  Fixture x;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", 1, sets, &x));
  for (PetscInt ncorner = 3; ncorner <= 4; ncorner++) {
    const int beyond[2][3] = {{6, 0, 0}, {0, 6, 0}};

    for (int i = 0; i <= 4; i++) {
      for (int j = 0; i + j <= 4; j++)
        for (int k = 0; i + j + k <= 4; k++)
          PetscCall(check_monomial(&x, ncorner, (const int[3]){i, j, k}));
    }
    for (int i = 0; i < 2; i++)
      PetscCall(check_monomial(&x, ncorner, beyond[i]));
    if (ncorner == 4)
      PetscCall(check_time(&x));
  }
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1"));
  PetscCall(check_element("cr"));
  PetscCall(check_element("dg"));
  PetscCall(check_element("p2"));
  SB_TEST_END();
}
