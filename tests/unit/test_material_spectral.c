// @ranks 1
/* Eigenvalues of symmetric matrices on lanes, signed stretches, and the sum of the modes of an
   isotropic tangent. */
#include "../../src/material/material_impl.h"
#include "material_checks.h"

static const PetscReal eps = 2.2204460492503131e-16;

/* S = V diag(s) V^T and V^T V = I up to rounding of the largest entry, for eigenvalues of any
   ratio, equal ones, zero. */
static void test_eig(void)
{
  for (int t = 0; t < 20000; t++) {
    const PetscReal size = pow(10, 3 * uniform());
    const PetscReal small = pow(10, -16 * fabs(uniform()));
    PetscReal w[3] = {uniform(), uniform(), uniform()};
    PetscReal Q[9], A[9], D[9], v[9], s[3];
    SbPack S[6], e[3], V[9];

    if (t % 4 == 1)
      w[1] = w[0] + small;
    if (t % 4 == 2)
      w[1] = w[2] = small * uniform();
    if (t % 4 == 3)
      w[0] = w[1] = w[2] = t % 8 == 3 ? 0 : 1;
    random_rotation(Q);
    for (int k = 0; k < 9; k++)
      D[k] = size * w[k % 3] * Q[k];
    SbMatMulTranspose(D, Q, A);
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal upper[6] = {A[0], A[1], A[2], A[4], A[5], A[8]};

      SbPackPut(6, upper, l, S);
    }
    A[3] = A[1];
    A[6] = A[2];
    A[7] = A[5];
    SbSymEig((const SbPack *)S, e, V);
    SbPackGet(9, (const SbPack *)V, 5, v);
    SbPackGet(3, (const SbPack *)e, 5, s);
    for (int k = 0; k < 9; k++)
      D[k] = s[k % 3] * v[k];
    SbMatMulTranspose(D, v, Q);
    SB_CHECK(difference(9, A, Q) < 20 * eps * size, "V diag(s) V^T is %g from S of size %g",
             difference(9, A, Q), size);
    SbMatTransposeMul(v, v, Q);
    for (int k = 0; k < 9; k++)
      SB_CHECK_NEAR(Q[k], k % 4 == 0, 20 * eps, "V^T V");
    SB_CHECK_NEAR(SbMatDet(v), 1, 20 * eps, "det V");
  }
}

/* F = U diag(s) V^T with rotations U and V, also for mirrored and singular F. */
static void test_stretches(void)
{
  for (int t = 0; t < 5000; t++) {
    PetscReal F[9], u[9], v[9], d[9], G[9];
    SbPack f[9], U[9], V[9], s[3];

    with_stretches(1 + 0.5 * uniform(), 1 + 0.5 * uniform(), t % 3 ? 0.5 * uniform() : 0, F);
    batch(F, f);
    SbStretches((const SbPack *)f, U, s, V);
    SbPackGet(9, (const SbPack *)U, 2, u);
    SbPackGet(9, (const SbPack *)V, 2, v);
    for (int k = 0; k < 9; k++)
      d[k] = u[k] * s[k % 3][2];
    SbMatMulTranspose(d, v, G);

    /* the gap of the polar rotation is at least 0.05 here */
    SB_CHECK(difference(9, F, G) < 1e-13, "U diag(s) V^T is %g from F", difference(9, F, G));
    SB_CHECK_NEAR(SbMatDet(u), 1, 50 * eps, "det U");
    SB_CHECK_NEAR(SbMatDet(v), 1, 50 * eps, "det V");
  }
}

/* For any nonnegative flips, twists and Hessian the tangent has exactly these eigenvalues and
   eigenmatrices. */
static void test_modes(void)
{
  for (int t = 0; t < 500; t++) {
    PetscReal u[9], v[9], f[3], w[3], h[9], q[9], C[81], upper[6];
    SbPack U[9], V[9], flip[3], twist[3], hessian[6], c[81];

    random_rotation(u);
    random_rotation(v);
    for (int k = 0; k < 9; k++)
      q[k] = uniform();
    SbMatMulTranspose(q, q, h);
    const int index[6] = {0, 1, 2, 4, 5, 8};
    for (int k = 0; k < 6; k++)
      upper[k] = h[index[k]];
    for (int k = 0; k < 3; k++) {
      f[k] = uniform();
      w[k] = uniform();
    }
    for (int l = 0; l < SB_BATCH; l++) {
      SbPackPut(9, u, l, U);
      SbPackPut(9, v, l, V);
      SbPackPut(3, f, l, flip);
      SbPackPut(3, w, l, twist);
      SbPackPut(6, upper, l, hessian);
    }
    SbSpectralTangent((const SbPack *)U, (const SbPack *)V, (const SbPack *)hessian,
                      (const SbPack *)flip, (const SbPack *)twist, c);
    SbPackGet(81, (const SbPack *)c, 3, C);
    for (int mode = 0; mode < 9; mode++) {
      const int k = mode % 3;
      const int i = (k + 1) % 3;
      const int j = (k + 2) % 3;
      PetscReal E[9], CE[9], expected[9];

      for (int p = 0; p < 9; p++) {
        const PetscReal *up = u + 3 * (p / 3);
        const PetscReal *vp = v + 3 * (p % 3);

        E[p] = mode < 3   ? up[i] * vp[j] + up[j] * vp[i]
               : mode < 6 ? up[i] * vp[j] - up[j] * vp[i]
                          : up[k] * vp[k];
        expected[p] = mode < 3 ? fmax(f[k], 0) * E[p] : fmax(w[k], 0) * E[p];
        if (mode >= 6)
          expected[p] = h[k] * up[0] * vp[0] + h[3 + k] * up[1] * vp[1] + h[6 + k] * up[2] * vp[2];
      }
      contract(C, E, CE);
      SB_CHECK(difference(9, CE, expected) < 1e-13, "mode %d is off by %g", mode,
               difference(9, CE, expected));
    }
  }
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  test_eig();
  test_stretches();
  test_modes();
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
