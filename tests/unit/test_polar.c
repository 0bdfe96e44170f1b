// @ranks 1
/*
  Polar rotations against an independent reference: singular values by one-sided Jacobi in long
  double, itself checked by the definition (R orthogonal, R^T F symmetric, every sum of two signed
  stretches >= 0).
*/
#include "material_checks.h"

typedef long double Long;
static const PetscReal eps = 2.2204460492503131e-16;

/* Error of the reference, and tolerance of the comparison; both larger where long double has no
   more digits than double. */
static PetscReal fault = 5e-17, rounding = 8 * 2.2204460492503131e-16;

static void polar_one(const PetscReal F[9], PetscReal R[9])
{
  SbPack f[9], r[9];

  for (int l = 0; l < SB_BATCH; l++)
    SbPackPut(9, F, l, f);
  SbPolar((const SbPack *)f, r);
  SbPackGet(9, (const SbPack *)r, SB_BATCH / 2, R);
}

static void cross(const Long a[3], const Long b[3], Long c[3])
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

static Long dot(const Long a[3], const Long b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Orthogonalises the columns a[0..2] of F V by rotations V (columns too), longest first. */
static void one_sided_jacobi(Long a[3][3], Long v[3][3])
{
  for (int sweep = 0; sweep < 40; sweep++) {
    for (int p = 0; p < 2; p++) {
      for (int q = p + 1; q < 3; q++) {
        const Long alpha = dot(a[p], a[p]);
        const Long beta = dot(a[q], a[q]);
        const Long gamma = dot(a[p], a[q]);

        if (gamma == 0 || fabsl(gamma) < 1e-21L * sqrtl(alpha * beta))
          continue;
        const Long zeta = (beta - alpha) / (2 * gamma);
        const Long t = (zeta < 0 ? -1 : 1) / (fabsl(zeta) + sqrtl(1 + zeta * zeta));
        const Long c = 1 / sqrtl(1 + t * t);
        const Long s = t * c;
        for (int k = 0; k < 3; k++) {
          const Long ap = a[p][k];
          const Long aq = a[q][k];
          const Long vp = v[p][k];
          const Long vq = v[q][k];

          a[p][k] = c * ap - s * aq;
          a[q][k] = s * ap + c * aq;
          v[p][k] = c * vp - s * vq;
          v[q][k] = s * vp + c * vq;
        }
      }
    }
  }
  for (int p = 0; p < 2; p++) {
    for (int q = p + 1; q < 3; q++) {
      if (dot(a[q], a[q]) <= dot(a[p], a[p]))
        continue;
      for (int k = 0; k < 3; k++) {
        const Long x = a[p][k];
        const Long y = v[p][k];

        a[p][k] = a[q][k];
        a[q][k] = x;
        v[p][k] = v[q][k];
        v[q][k] = y;
      }
    }
  }
}

/* Reference rotation; s[3] signed stretches, the last one with the sign of det F. Needs rank
   two. */
static void reference(const PetscReal F[9], Long R[9], Long s[3])
{
  Long a[3][3];
  Long v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Long u[3][3];

  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      a[j][i] = F[3 * i + j];
  one_sided_jacobi(a, v);
  for (int p = 0; p < 2; p++) {
    s[p] = sqrtl(dot(a[p], a[p]));
    for (int k = 0; k < 3; k++)
      u[p][k] = a[p][k] / s[p];
  }
  const Long c = dot(u[0], u[1]);
  const Long n = sqrtl(1 - c * c);
  for (int k = 0; k < 3; k++)
    u[1][k] = (u[1][k] - c * u[0][k]) / n;
  cross(u[0], u[1], u[2]);
  cross(v[0], v[1], v[2]);
  s[2] = 0;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++)
      s[2] += u[2][i] * F[3 * i + j] * v[2][j];
    for (int j = 0; j < 3; j++)
      R[3 * i + j] = u[0][i] * v[0][j] + u[1][i] * v[1][j] + u[2][i] * v[2][j];
  }
}

/* Largest violation of the defining properties of the reference, relative to |F|. */
static PetscReal reference_fault(const PetscReal F[9], const Long R[9], const Long s[3])
{
  Long worst = 0;
  Long norm = sqrtl(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);

  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      Long rr = 0;
      Long x = 0;
      Long y = 0;

      for (int k = 0; k < 3; k++) {
        rr += R[3 * k + i] * R[3 * k + j];
        x += R[3 * k + i] * F[3 * k + j];
        y += R[3 * k + j] * F[3 * k + i];
      }
      worst = fmaxl(worst, fmaxl(fabsl(rr - (i == j)), fabsl(x - y) / norm));
    }
  }
  return (PetscReal)fmaxl(worst, -(s[1] + s[2]) / norm);
}

static PetscReal orthogonality(const PetscReal R[9])
{
  PetscReal G[9];
  PetscReal worst = fabs(SbMatDet(R) - 1);

  SbMatTransposeMul(R, R, G);
  for (int k = 0; k < 9; k++)
    worst = larger(worst, fabs(G[k] - (k % 4 == 0)));
  return worst;
}

/*
  R is a rotation up to rounding, and within `rounding` |F| / (s2 + s3) of the reference: the
  rounding of F and of the intermediate sums times the condition number. Where that exceeds 1e-3
  only the maximum itself is compared.
*/
static void check_against_reference(const PetscReal F[9], const char *what)
{
  Long Q[9], s[3];
  Long trace = 0;
  PetscReal R[9];
  PetscReal error = 0;

  reference(F, Q, s);
  polar_one(F, R);
  const PetscReal norm = sqrt((PetscReal)(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
  const PetscReal gap = (PetscReal)(s[1] + s[2]);
  SB_CHECK(reference_fault(F, Q, s) < fault, "%s: the reference is wrong by %g", what,
           reference_fault(F, Q, s));
  SB_CHECK(orthogonality(R) < 8 * eps, "%s: R^T R - I or det R - 1 is %g", what, orthogonality(R));
  for (int k = 0; k < 9; k++) {
    error = larger(error, fabs((PetscReal)(R[k] - Q[k])));
    trace += (Long)R[k] * F[k];
  }
  if (gap > 1e3 * rounding * norm) {
    SB_CHECK(error <= rounding * norm / gap, "%s: R off by %g with |F| / (s2 + s3) = %g", what,
             error, norm / gap);
  }
  SB_CHECK(trace >= s[0] + s[1] + s[2] - 2 * rounding * norm, "%s: R : F is %g below its maximum",
           what, (PetscReal)(s[0] + s[1] + s[2] - trace));
}

/* Pure rotations, and rotated stretches 1.1, 1, 0.9, at angles through a full turn; exact half
   turns too. */
static void test_angles(void)
{
  const PetscReal axes[5][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, 0.8, 0}, {0.48, -0.6, 0.64}};
  const PetscReal S[9] = {1.05, 0.04, -0.02, 0.04, 0.97, 0.03, -0.02, 0.03, 1.01};

  for (int a = 0; a < 5; a++) {
    for (int degree = 0; degree <= 360; degree++) {
      const PetscReal t = degree * PETSC_PI / 180;
      const PetscReal c = degree == 180 ? -1 : cos(t);
      const PetscReal s = degree == 180 ? 0 : sin(t);
      const PetscReal *n = axes[a];
      PetscReal Q[9], F[9];

      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
          Q[3 * i + j] = (1 - c) * n[i] * n[j] + (i == j ? c : 0);
        Q[3 * i + (i + 1) % 3] -= s * n[(i + 2) % 3];
        Q[3 * i + (i + 2) % 3] += s * n[(i + 1) % 3];
      }
      check_against_reference(Q, "pure rotation");
      SbMatMul(Q, S, F);
      check_against_reference(F, "rotation of a stretch");
    }
  }
}

static void test_uniform(void)
{
  PetscReal F[9];

  for (int t = 0; t < 20000; t++) {
    const PetscReal small = pow(10, -16 * fabs(uniform()));
    const PetscReal size = pow(10, 6 * uniform());

    for (int k = 0; k < 9; k++)
      F[k] = size * uniform();
    check_against_reference(F, "random");
    with_stretches(1 + 0.5 * uniform(), 1 + 0.5 * uniform(), small, F);
    check_against_reference(F, "nearly rank two");
    with_stretches(1, small, small * uniform(), F);
    check_against_reference(F, "nearly rank one");
    with_stretches(1 + 0.5 * uniform(), 1 + 0.5 * uniform(), -fabs(uniform()), F);
    check_against_reference(F, "mirrored");
    with_stretches(1 + uniform(), 1, -1 + small, F);
    check_against_reference(F, "mirrored with nearly equal stretches");
  }
}

static void test_singular(void)
{
  const PetscReal zero[9] = {0};
  const PetscReal minus[9] = {-1, 0, 0, 0, -1, 0, 0, 0, -1};
  const PetscReal one[9] = {0, 0, 3, 0, 0, 0, 0, 0, 0};
  const PetscReal flat[9] = {0, -2, 0, 1, 0, 0, 0, 0, 0};
  const PetscReal identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const PetscReal turned[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  PetscReal R[9], F[9];

  polar_one(zero, R);
  SB_CHECK(!memcmp(R, identity, sizeof(R)), "the rotation of F = 0 is not I");
  polar_one(flat, R);
  for (int k = 0; k < 9; k++)
    SB_CHECK_NEAR(R[k], turned[k], 4 * eps, "rotation of a flattened quarter turn");

  /* rank one and the full reflection: any maximiser is valid; the maxima are 3 and 1 */
  polar_one(one, R);
  SB_CHECK(orthogonality(R) < 8 * eps, "rank one: not a rotation");
  SB_CHECK_NEAR(SbDot9(R, one), 3, 16 * eps, "rank one: R : F");
  polar_one(minus, R);
  SB_CHECK(orthogonality(R) < 8 * eps, "reflection: not a rotation");
  SB_CHECK_NEAR(SbDot9(R, minus), 1, 16 * eps, "reflection: R : F");
  for (int t = 0; t < 1000; t++) {
    with_stretches(1 + 0.5 * uniform(), 1 + 0.5 * uniform(), 0, F);
    check_against_reference(F, "rank two");
  }
}

/* Independence of the magnitude of F over the range of a double; nonfinite values stay nonfinite
   and do not affect other lanes. */
static void test_range(void)
{
  const int power[] = {-1060, -500, -150, -90, -60, -30, 30, 60, 90, 150, 500, 1020};
  PetscReal F[9], G[9], R[9], Q[9];

  with_stretches(1.3, 0.9, 0.4, F);
  polar_one(F, R);
  for (size_t p = 0; p < sizeof(power) / sizeof(power[0]); p++) {
    for (int k = 0; k < 9; k++)
      G[k] = ldexp(F[k], power[p]);
    polar_one(G, Q);

    /* below 2^-1022 the entries of G themselves are subnormal */
    const PetscReal tolerance = power[p] < -1022 ? ldexp(1, -1074 - power[p]) * 8 : 16 * eps;
    for (int k = 0; k < 9; k++)
      SB_CHECK_NEAR(Q[k], R[k], tolerance, "rotation of a scaled F");
  }
  F[4] = NAN;
  polar_one(F, R);
  for (int k = 0; k < 9; k++)
    SB_CHECK(isnan(R[k]), "the rotation of a NaN is %g", R[k]);
  F[4] = INFINITY;
  polar_one(F, R);
  for (int k = 0; k < 9; k++)
    SB_CHECK(isnan(R[k]), "the rotation of an infinity is %g", R[k]);
}

/* The same F in every lane, among lanes that need the robust path or are not finite, gives bitwise
   the same result. */
static void test_lanes(void)
{
  PetscInt different = 0;

  for (int t = 0; t < 500; t++) {
    PetscReal F[9], G[9], R[9], Q[9];
    SbPack f[9], r[9];

    for (int k = 0; k < 9; k++)
      F[k] = (k % 4 == 0) + (t % 5) * 0.3 * uniform();
    polar_one(F, R);
    for (int place = 0; place < SB_BATCH; place++) {
      for (int l = 0; l < SB_BATCH; l++) {
        with_stretches(1, uniform(), l % 3 ? uniform() : 0, G);
        if (l == (place + 3) % SB_BATCH)
          G[0] = NAN;
        SbPackPut(9, l == place ? F : G, l, f);
      }
      SbPolar((const SbPack *)f, r);
      SbPackGet(9, (const SbPack *)r, place, Q);
      different += memcmp(R, Q, sizeof(R)) != 0;
    }
  }
  SB_CHECK(!different, "%d results depend on their neighbours", (int)different);
}

/* Valgrind and some processors evaluate long double in double precision, whatever the compiler
   states. */
static void measure_long(void)
{
  volatile Long step = 1;
  volatile Long sum = 2;

  while (sum > 1) {
    step /= 2;
    sum = 1 + step;
  }
  if (step < 1e-18L)
    return;
  fault = 200 * eps;
  rounding += fault;
}

int main(int argc, char **argv)
{
  const PetscReal F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  PetscReal R[9];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &the_random));
  PetscCall(PetscRandomSetSeed(the_random, 20240517));
  PetscCall(PetscRandomSeed(the_random));
  measure_long();

  /* at rest, and near it */
  polar_one(F, R);
  SB_CHECK(!memcmp(F, R, sizeof(R)), "the rotation of F = I is not exactly I");
  for (int t = 0; t < 2000; t++) {
    const PetscReal size = pow(10, -1 - 14 * (t / 2000.));
    PetscReal G[9];

    for (int k = 0; k < 9; k++)
      G[k] = F[k] + size * uniform();
    check_against_reference(G, "near rest");
  }
  test_angles();
  test_uniform();
  test_singular();
  test_range();
  test_lanes();
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
