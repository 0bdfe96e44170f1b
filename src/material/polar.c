/*
  Polar rotation of 3x3 matrices.

  R maximises R : F over all rotations. With R written as a unit quaternion q this is q^T N q with a
  symmetric traceless 4x4 matrix N linear in F (Davenport's q-method; Horn, "Closed-form solution of
  absolute orientation using unit quaternions", 1987), so q is the eigenvector of the largest
  eigenvalue. In terms of the signed stretches s1 >= s2 >= |s3| that eigenvalue is lambda = s1 + s2
  + s3 = tr(R^T F), and the gap to the next one is 2 (s2 + s3). Reflections, singular F and
  rotations by any angle need no special case; only a small gap is difficult, where R itself is
  ill-conditioned.

  Fast path, vectorised over the lanes and without branches, after Higham and Noferini ("An
  algorithm to compute the polar decomposition of a 3x3 matrix", 2016), with the adjugate instead of
  a factorisation:
    1. lambda is the largest root of p(x) = x^4 - 2 a x^2 - 8 d x + a^2 - 4 b, a = |F|^2, d = det F,
       b = |cof F|^2. All four roots are real: Laguerre's method converges to it monotonically from
       the upper bound sqrt(3 a), with order three. For F = I the bound is the root.
    2. adj(lambda I - N) is q q^T times p'(lambda) up to the error of lambda: its column of the
    largest entry
       is the result of one inverse iteration; multiplying this column by the adjugate is a second
       one.
  A lane is accepted if the gap is not small (p' = 8 (s1+s2)(s2+s3)(s3+s1) relative to lambda^3) and
  the last Laguerre step was so short that the error is below rounding. Other lanes are computed one
  by one by the robust path: LAPACK's eigenvectors of N.
*/
#include <sbmaterial.h>
#include <petscblaslapack.h>

#define ROOT_STEPS 3
#define SMALLEST_GAP 1e-3 /* least p'(lambda) / (4 lambda^3) of an accepted lane; at most 16/27 */
#define LAST_STEP 1e-3    /* largest last step of an accepted lane, relative to the gap */

/* N[10] = 00 01 02 03 11 12 13 22 23 33 with q^T N q = R(q) : F, q = (w, x, y, z). */
SB_INLINE void davenport(const PetscReal F[9], PetscReal N[10])
{
  N[0] = F[0] + F[4] + F[8];
  N[1] = F[7] - F[5];
  N[2] = F[2] - F[6];
  N[3] = F[3] - F[1];
  N[4] = F[0] - F[4] - F[8];
  N[5] = F[1] + F[3];
  N[6] = F[2] + F[6];
  N[7] = F[4] - F[0] - F[8];
  N[8] = F[5] + F[7];
  N[9] = F[8] - F[0] - F[4];
}

/* Rotation of a nonzero quaternion of any length. */
SB_INLINE void quaternion_rotation(const PetscReal q[4], PetscReal R[9])
{
  const PetscReal w = q[0];
  const PetscReal x = q[1];
  const PetscReal y = q[2];
  const PetscReal z = q[3];
  const PetscReal s = 2 / (w * w + x * x + y * y + z * z);
  const PetscReal sx = s * x;
  const PetscReal sy = s * y;
  const PetscReal sz = s * z;

  R[0] = 1 - (sy * y + sz * z);
  R[1] = sx * y - sz * w;
  R[2] = sx * z + sy * w;
  R[3] = sx * y + sz * w;
  R[4] = 1 - (sx * x + sz * z);
  R[5] = sy * z - sx * w;
  R[6] = sx * z - sy * w;
  R[7] = sy * z + sx * w;
  R[8] = 1 - (sx * x + sy * y);
}

/* Adjugate of a symmetric 4x4 matrix, both as 00 01 02 03 11 12 13 22 23 33, by minors of pairs of
   rows. */
SB_INLINE void adjugate4(const PetscReal M[10], PetscReal A[10])
{
  /* rows 0 and 1: column pairs 01 02 03 12 13 23; rows 2 and 3: 02 03 12 13 23 (01 equals t5) */
  const PetscReal t0 = M[0] * M[4] - M[1] * M[1];
  const PetscReal t1 = M[0] * M[5] - M[1] * M[2];
  const PetscReal t2 = M[0] * M[6] - M[1] * M[3];
  const PetscReal t3 = M[1] * M[5] - M[4] * M[2];
  const PetscReal t4 = M[1] * M[6] - M[4] * M[3];
  const PetscReal t5 = M[2] * M[6] - M[5] * M[3];
  const PetscReal b1 = M[2] * M[8] - M[3] * M[7];
  const PetscReal b2 = M[2] * M[9] - M[3] * M[8];
  const PetscReal b3 = M[5] * M[8] - M[6] * M[7];
  const PetscReal b4 = M[5] * M[9] - M[6] * M[8];
  const PetscReal b5 = M[7] * M[9] - M[8] * M[8];

  A[0] = M[4] * b5 - M[5] * b4 + M[6] * b3;
  A[1] = M[2] * b4 - M[1] * b5 - M[3] * b3;
  A[2] = M[6] * t5 - M[8] * t4 + M[9] * t3;
  A[3] = M[7] * t4 - M[5] * t5 - M[8] * t3;
  A[4] = M[0] * b5 - M[2] * b2 + M[3] * b1;
  A[5] = M[8] * t2 - M[3] * t5 - M[9] * t1;
  A[6] = M[2] * t5 - M[7] * t2 + M[8] * t1;
  A[7] = M[3] * t4 - M[6] * t2 + M[9] * t0;
  A[8] = M[5] * t2 - M[2] * t4 - M[8] * t0;
  A[9] = M[2] * t3 - M[5] * t1 + M[7] * t0;
}

/* The column of a positive semi-definite A (00 01 02 03 11 12 13 22 23 33) with the largest
   entry. */
SB_INLINE void largest_column(const PetscReal A[10], PetscReal q[4])
{
  const PetscReal c1[4] = {A[1], A[4], A[5], A[6]};
  const PetscReal c2[4] = {A[2], A[5], A[7], A[8]};
  const PetscReal c3[4] = {A[3], A[6], A[8], A[9]};
  PetscReal best = A[0];

  for (int k = 0; k < 4; k++)
    q[k] = A[k];
  for (int k = 0; k < 4; k++)
    q[k] = A[4] > best ? c1[k] : q[k];
  best = A[4] > best ? A[4] : best;
  for (int k = 0; k < 4; k++)
    q[k] = A[7] > best ? c2[k] : q[k];
  best = A[7] > best ? A[7] : best;
  for (int k = 0; k < 4; k++)
    q[k] = A[9] > best ? c3[k] : q[k];
}

/* Fast path of one lane. Returns 1 if the result is accepted, else 0, also for NaN. */
SB_INLINE PetscReal polar_fast(const PetscReal F[9], PetscReal R[9])
{
  PetscReal cof[9], N[10], A[10], q[4], p[4];
  PetscReal step = 0;
  PetscReal slope = 0;

  /* Largest root of the characteristic polynomial. */
  SbMatCofactor(F, cof);
  const PetscReal a = SbDot9(F, F);
  const PetscReal d2 = 2 * SbDot3(F, cof);
  const PetscReal c0 = a * a - 4 * SbDot9(cof, cof);
  PetscReal x = sqrt(3 * a);
  for (int k = 0; k < ROOT_STEPS; k++) {
    const PetscReal value = ((x * x - 2 * a) * x - 4 * d2) * x + c0;

    slope = (x * x - a) * x - d2;
    step = value / (slope + sqrt(9 * slope * slope - 3 * value * (3 * x * x - a)));
    x -= step;
  }

  /* Its eigenvector: the largest column of the adjugate, multiplied by the adjugate. */
  davenport(F, N);
  for (int k = 0; k < 10; k++)
    N[k] = -N[k];
  N[0] += x;
  N[4] += x;
  N[7] += x;
  N[9] += x;
  adjugate4(N, A);
  largest_column(A, q);
  p[0] = A[0] * q[0] + A[1] * q[1] + A[2] * q[2] + A[3] * q[3];
  p[1] = A[1] * q[0] + A[4] * q[1] + A[5] * q[2] + A[6] * q[3];
  p[2] = A[2] * q[0] + A[5] * q[1] + A[7] * q[2] + A[8] * q[3];
  p[3] = A[3] * q[0] + A[6] * q[1] + A[8] * q[2] + A[9] * q[3];
  quaternion_rotation(p, R);

  /* The gap is at least slope / (2 x^2). The limits on a keep these powers within the range of a
     double. */
  slope = (a < 1e16 ? slope : 0) > SMALLEST_GAP * x * x * x ? slope : 0;
  slope = a > 1e-16 ? slope : 0;
  return LAST_STEP * slope > 2 * x * x * fabs(step) ? 1 : 0;
}

/* Any F, scaled to a largest entry of one. */
static void polar_robust(const PetscReal F[9], PetscReal R[9])
{
  PetscReal scale = 0, G[9], n[10], lambda[4], work[34 * 4]; /* of LAPACK: (block size + 2) n */
  PetscBLASInt four = 4;
  PetscBLASInt nwork = 34 * 4;
  PetscBLASInt info;
  int best = 0;

  for (int k = 0; k < 9; k++) {
    if (!isfinite(F[k])) {
      for (int m = 0; m < 9; m++)
        R[m] = NAN;
      return;
    }
    scale = fabs(F[k]) > scale ? fabs(F[k]) : scale;
  }
  for (int k = 0; k < 9; k++)
    G[k] = scale > 0 ? F[k] / scale : 0;
  davenport(G, n);
  PetscReal N[16] = {n[0], 0, 0, 0, n[1], n[4], 0, 0, n[2], n[5], n[7], 0, n[3], n[6], n[8], n[9]};
  LAPACKsyev_("V", "U", &four, N, &four, lambda, work, &nwork, &info);

  /* the first of equal ones, which is I for F = 0 */
  while (lambda[best] < lambda[3])
    best++;
  quaternion_rotation(N + 4 * best, R);
}

SB_KERNEL void SbPolar(const SbPack F[restrict 9], SbPack R[restrict 9])
{
  SbPack trust;
  PetscReal worst = 1;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], r[9];

    SbPackGet(9, F, l, f);
    trust[l] = polar_fast(f, r);
    SbPackPut(9, r, l, R);
  }
  for (int l = 0; l < SB_BATCH; l++)
    worst = trust[l] > 0 ? worst : 0;
  if (worst > 0)
    return;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], r[9];

    if (trust[l] > 0)
      continue;
    SbPackGet(9, F, l, f);
    polar_robust(f, r);
    SbPackPut(9, r, l, R);
  }
}
