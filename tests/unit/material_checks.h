/*
  material_checks.h - checks for every material: stress is the derivative of the energy and the
  tangent that of the stress, frame invariance, independence of SIMD lanes, projected tangents are
  the projections of the exact ones.

  Deformation gradients are evaluated one at a time in each lane of a batch whose other lanes have
  different ones.
*/
#pragma once
#include "../test.h"
#include <sbmaterial.h>
#include <string.h>

static PetscRandom the_random;

static inline PetscErrorCode random_begin(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &the_random));
  PetscCall(PetscRandomSetSeed(the_random, 4711));
  PetscCall(PetscRandomSeed(the_random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniform in [-1, 1). */
static inline PetscReal uniform(void)
{
  PetscReal x = 0;

  (void)PetscRandomGetValueReal(the_random, &x);
  return 2 * x - 1;
}

/* Rotation about an axis of any length by an angle in radians. */
static inline void axis_rotation(const PetscReal axis[3], PetscReal angle, PetscReal Q[9])
{
  const PetscReal n = sqrt(SbDot3(axis, axis));
  const PetscReal a[3] = {axis[0] / n, axis[1] / n, axis[2] / n};
  const PetscReal c = cos(angle);
  const PetscReal s = sin(angle);

  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      Q[3 * i + j] = (1 - c) * a[i] * a[j] + (i == j ? c : 0);
  for (int i = 0; i < 3; i++) {
    Q[3 * i + (i + 1) % 3] -= s * a[(i + 2) % 3];
    Q[3 * i + (i + 2) % 3] += s * a[(i + 1) % 3];
  }
}

static inline void random_rotation(PetscReal Q[9])
{
  const PetscReal axis[3] = {uniform(), uniform(), uniform()};

  axis_rotation(axis, PETSC_PI * uniform(), Q);
}

/* A turned (I + size * random): well away from inversion for size below 0.3. */
static inline void random_deformation(PetscReal size, PetscReal F[9])
{
  PetscReal Q[9], S[9];

  random_rotation(Q);
  for (int k = 0; k < 9; k++)
    S[k] = (k % 4 == 0) + size * uniform();
  SbMatMul(Q, S, F);
}

/* F = A diag(s) B^T with random rotations. */
static inline void with_stretches(PetscReal s0, PetscReal s1, PetscReal s2, PetscReal F[9])
{
  const PetscReal s[3] = {s0, s1, s2};
  PetscReal A[9], B[9];

  random_rotation(A);
  random_rotation(B);
  for (int k = 0; k < 9; k++)
    A[k] *= s[k % 3];
  SbMatMulTranspose(A, B, F);
}

/* A batch with F in lane 2 and unrelated numbers around it. */
static inline void batch(const PetscReal F[9], SbPack f[9])
{
  for (int l = 0; l < SB_BATCH; l++)
    for (int k = 0; k < 9; k++)
      f[k][l] = (k % 4 == 0) + 0.1 * l - 0.03 * k;
  SbPackPut(9, F, 2, f);
}

static inline PetscReal energy_of(SbMaterial m, const PetscReal F[9])
{
  SbPack f[9], psi;

  batch(F, f);
  m->ops.energy(m, (const SbPack *)f, psi);
  return psi[2];
}

static inline void stress_of(SbMaterial m, const PetscReal F[9], PetscReal P[9])
{
  SbPack f[9], p[9];

  batch(F, f);
  m->ops.stress(m, (const SbPack *)f, p);
  SbPackGet(9, (const SbPack *)p, 2, P);
}

static inline void tangent_of(SbMaterial m, const PetscReal F[9], PetscReal C[81])
{
  SbPack f[9], c[81];

  batch(F, f);
  m->ops.tangent(m, (const SbPack *)f, c);
  SbPackGet(81, (const SbPack *)c, 2, C);
}

static inline void damping_of(SbMaterial m, const PetscReal F[9], const PetscReal H[9],
                              PetscReal dP[9])
{
  SbPack f[9], h[9], p[9];

  batch(F, f);
  batch(H, h);
  SbMaterialDampingStress(m, (const SbPack *)f, (const SbPack *)h, p);
  SbPackGet(9, (const SbPack *)p, 2, dP);
}

/* B = C : H */
static inline void contract(const PetscReal C[81], const PetscReal H[9], PetscReal B[9])
{
  for (int i = 0; i < 9; i++) {
    B[i] = 0;
    for (int k = 0; k < 9; k++)
      B[i] += C[9 * i + k] * H[k];
  }
}

/* The larger of two; unlike fmax() it keeps a NaN, so that no check passes on one. */
static inline PetscReal larger(PetscReal a, PetscReal b)
{
  return b > a || isnan(b) ? b : a;
}

static inline PetscReal difference(int n, const PetscReal a[], const PetscReal b[])
{
  PetscReal worst = 0;

  for (int k = 0; k < n; k++)
    worst = larger(worst, fabs(a[k] - b[k]));
  return worst;
}

/*
  Taylor: psi(F + t H) - psi(F) - t P : H and P(F + t H) - P(F) - t C : H are of order two: halving
  t divides a remainder by four up to terms of third order. Summed over six directions H, so that no
  leading term vanishes by chance; at t about 1/3000 the remainders are above 1e-8 E and their third
  order below a few percent.
*/
static inline void check_derivatives(SbMaterial m, const PetscReal F[9], const char *what)
{
  PetscReal P[9], C[81];
  PetscReal r[2][2] = {{0, 0}, {0, 0}};

  stress_of(m, F, P);
  tangent_of(m, F, C);
  for (int direction = 0; direction < 6; direction++) {
    PetscReal H[9], CH[9];

    for (int k = 0; k < 9; k++)
      H[k] = uniform();
    contract(C, H, CH);
    for (int step = 0; step < 2; step++) {
      const PetscReal t = step ? 1. / 4096 : 1. / 2048;
      PetscReal G[9], Q[9];

      for (int k = 0; k < 9; k++)
        G[k] = F[k] + t * H[k];
      r[0][step] += fabs(energy_of(m, G) - energy_of(m, F) - t * SbDot9(P, H));
      stress_of(m, G, Q);
      for (int k = 0; k < 9; k++)
        Q[k] -= P[k] + t * CH[k];
      r[1][step] += sqrt(SbDot9(Q, Q));
    }
  }
  SB_CHECK_NEAR(log2(r[0][0] / r[0][1]), 2, 0.1, what);
  if (m->linear)
    SB_CHECK(r[1][0] < 1e-13 * (m->E + m->lambda), "%s: remainder %g of a linear stress", what,
             r[1][0]);
  else
    SB_CHECK_NEAR(log2(r[1][0] / r[1][1]), 2, 0.1, what);
  for (int i = 0; i < 9; i++)
    for (int k = 0; k < i; k++)
      SB_CHECK(C[9 * i + k] == C[9 * k + i], "%s: tangent not symmetric", what);
}

/* The curvature of theta is the derivative of its derivative: D(F + t H) - D(F) - t C : H is at
   most quadratic in t. */
static inline void check_curvature(SbMaterial m, const PetscReal F[9])
{
  const PetscReal t = 1e-4;
  PetscReal H[9], G[9], CH[9], C[81];
  SbPack f[9], g[9], D[9], E[9], p;
  SbPack c[81] = {{0}};

  if (!m->ops.curvature)
    return;
  for (int k = 0; k < 9; k++) {
    H[k] = uniform();
    G[k] = F[k] + t * H[k];
  }
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = 1 + l;
  batch(F, f);
  batch(G, g);
  m->ops.volumetric(m, (const SbPack *)f, D);
  m->ops.volumetric(m, (const SbPack *)g, E);
  m->ops.curvature(m, (const SbPack *)f, p, c);
  SbPackGet(81, (const SbPack *)c, 2, C);
  contract(C, H, CH);
  for (int k = 0; k < 9; k++)
    SB_CHECK(fabs(E[k][2] - D[k][2] - t * CH[k] / 3) < 4 * t * t,
             "%s: curvature of theta off by %g of %g", m->law, E[k][2] - D[k][2] - t * CH[k] / 3,
             t);
}

/* At rest: no energy, no stress, Hooke's tensor, and the moduli and wave speed that follow from
   it. */
static inline void check_rest(SbMaterial m)
{
  const PetscReal F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  PetscReal P[9], C[81];

  stress_of(m, F, P);
  tangent_of(m, F, C);
  SB_CHECK(energy_of(m, F) == 0, "%s: energy %g at rest", m->law, energy_of(m, F));
  for (int k = 0; k < 9; k++)
    SB_CHECK(P[k] == 0, "%s: stress %g at rest", m->law, P[k]);
  for (int i = 0; i < 9; i++) {
    for (int k = 0; k < 9; k++) {
      const int turned = 3 * (k % 3) + k / 3;
      const PetscReal hooke =
        m->mu * ((i == k) + (i == turned)) + m->lambda * (i % 4 == 0 && k % 4 == 0);

      SB_CHECK_NEAR(C[9 * i + k], hooke, 1e-14 * (m->lambda + m->E),
                    "tangent at rest against Hooke's tensor");
    }
  }
  const PetscReal G = m->mu;
  const PetscReal K = SbMaterialBulkModulus(m);
  PetscReal sum = 0;
  for (int k = 0; k < 9; k++)
    sum += C[9 * 4 * (k / 3) + 4 * (k % 3)] / 9;
  SB_CHECK_NEAR(G, C[9 * 1 + 1], 1e-14 * m->E, "shear modulus against the tangent");
  SB_CHECK_NEAR(K, sum, 1e-14 * (K + m->E), "bulk modulus against the tangent");
  SB_CHECK_NEAR(SbMaterialWaveModulus(m), C[0], 1e-14 * C[0], "wave modulus against the tangent");
  SB_CHECK_NEAR(9 * K * G / (3 * K + G), m->E, 1e-14 * m->E, "moduli against Young's modulus");
}

/* psi(Q F) = psi(F) = psi(F Q), P(Q F) = Q P(F), P(F Q) = P(F) Q: rounding only, seen through the
   polar rotation. */
static inline void check_invariance(SbMaterial m, const PetscReal F[9])
{
  const PetscReal scale = m->E + m->lambda;
  PetscReal Q[9], G[9], P[9], A[9], B[9];

  random_rotation(Q);
  stress_of(m, F, P);
  SbMatMul(Q, F, G);
  SB_CHECK_NEAR(energy_of(m, G), energy_of(m, F), 1e-13 * scale,
                "energy after a rotation of space");
  stress_of(m, G, A);
  SbMatMul(Q, P, B);
  SB_CHECK(difference(9, A, B) < 1e-13 * scale, "%s: stress turns wrongly by %g", m->law,
           difference(9, A, B));
  SbMatMul(F, Q, G);
  SB_CHECK_NEAR(energy_of(m, G), energy_of(m, F), 1e-13 * scale,
                "energy after a rotation of the material");
  stress_of(m, G, A);
  SbMatMul(P, Q, B);
  SB_CHECK(difference(9, A, B) < 1e-13 * scale, "%s: material stress off by %g", m->law,
           difference(9, A, B));
}

/* No stress and no energy under rotations through 360 degrees by 15 about three axes. */
static inline void check_rotations(SbMaterial m)
{
  const PetscReal axes[3][3] = {{0, 0, 1}, {1, 1, 1}, {1, 2, 3}};

  for (int a = 0; a < 3; a++) {
    for (int degree = 0; degree <= 360; degree += 15) {
      PetscReal Q[9], P[9];

      axis_rotation(axes[a], degree * PETSC_PI / 180, Q);
      stress_of(m, Q, P);
      SB_CHECK(sqrt(SbDot9(P, P)) <= 1e-12 * m->E, "%s: stress %g E after %d degrees", m->law,
               sqrt(SbDot9(P, P)) / m->E, degree);
      SB_CHECK_NEAR(energy_of(m, Q), 0, 1e-15 * m->E, "energy of a rotation");
    }
  }
}

/* Following -P from inverted states ends at det F > 0 and rest; every step lowers the energy. */
static inline void check_inversion(SbMaterial m, PetscBool recovers)
{
  for (int t = 0; t < 20; t++) {
    const PetscReal step = 0.1 / (m->lambda + 2 * m->mu);
    PetscReal F[9], P[9], before;
    PetscReal after = 0;
    PetscInt up = 0;

    with_stretches(1 + 0.3 * uniform(), 0.9 + 0.1 * uniform(), -0.4 + 0.2 * uniform(), F);
    SB_CHECK(SbMatDet(F) < 0, "the start is not inverted");
    before = energy_of(m, F);
    for (int n = 0; n < (recovers ? 4000 : 5); n++) {
      stress_of(m, F, P);
      for (int k = 0; k < 9; k++)
        F[k] -= step * P[k];
      after = energy_of(m, F);
      up += after > before + 1e-14 * (m->E + m->lambda);
      before = after;
    }
    SB_CHECK(!up, "%s: %d steps along -P raised the energy", m->law, (int)up);
    if (recovers) {
      SB_CHECK(SbMatDet(F) > 0.99, "%s: det F is still %g", m->law, SbMatDet(F));
      SB_CHECK(after < 1e-6 * m->E, "%s: %g of E is left as energy", m->law, after / m->E);
    }
  }
}

/* Jacobi's method: eigenvalues w and eigenvectors (rows of V) of a symmetric 9x9 matrix. */
static inline void eigen9(const PetscReal C[81], PetscReal w[9], PetscReal V[81])
{
  PetscReal A[81];

  memcpy(A, C, sizeof(A));
  for (int k = 0; k < 81; k++)
    V[k] = k % 10 == 0;
  for (int sweep = 0; sweep < 12; sweep++) {
    for (int p = 0; p < 8; p++) {
      for (int q = p + 1; q < 9; q++) {
        if (A[9 * p + q] == 0)
          continue;
        const PetscReal z = (A[10 * q] - A[10 * p]) / (2 * A[9 * p + q]);
        const PetscReal t = (z < 0 ? -1 : 1) / (fabs(z) + sqrt(1 + z * z));
        const PetscReal c = 1 / sqrt(1 + t * t);
        const PetscReal s = t * c;

        for (int k = 0; k < 9; k++) {
          const PetscReal x = A[9 * k + p];
          const PetscReal y = A[9 * k + q];
          const PetscReal v = V[9 * p + k];
          const PetscReal u = V[9 * q + k];

          A[9 * k + p] = c * x - s * y;
          A[9 * k + q] = s * x + c * y;
          V[9 * p + k] = c * v - s * u;
          V[9 * q + k] = s * v + c * u;
        }
        for (int k = 0; k < 9; k++) {
          const PetscReal x = A[9 * p + k];
          const PetscReal y = A[9 * q + k];

          A[9 * p + k] = c * x - s * y;
          A[9 * q + k] = s * x + c * y;
        }
      }
    }
  }
  for (int k = 0; k < 9; k++)
    w[k] = A[10 * k];
}

/* D = C with its negative eigenvalues raised to zero; returns the smallest eigenvalue of C. */
static inline PetscReal project(const PetscReal C[81], PetscReal D[81])
{
  PetscReal w[9], V[81];
  PetscReal smallest = PETSC_INFINITY;

  eigen9(C, w, V);
  for (int k = 0; k < 81; k++)
    D[k] = 0;
  for (int e = 0; e < 9; e++) {
    smallest = fmin(smallest, w[e]);
    for (int k = 0; k < 81; k++)
      D[k] += fmax(w[e], 0) * V[9 * e + k / 9] * V[9 * e + k % 9];
  }
  return smallest;
}

/* exact_spd has no negative eigenvalue for any F; where F is not degenerate it is the exact
   tangent, projected. */
static inline PetscErrorCode check_spd(SbMaterial m)
{
  PetscInt indefinite = 0;

  PetscFunctionBeginUser;
  for (int t = 0; t < 400; t++) {
    const PetscBool wild = t % 4 == 3 ? PETSC_TRUE : PETSC_FALSE;
    PetscReal F[9], exact[81], spd[81], projected[81], smallest, lowest;
    PetscReal size = m->E + m->lambda;

    if (wild) {
      for (int k = 0; k < 9; k++)
        F[k] = t % 8 == 3 ? 2 * uniform() : 0.01 * uniform();
    } else {
      with_stretches(1 + 0.6 * uniform(), 0.8 + 0.5 * uniform(),
                     0.5 + (t % 4 == 2 ? 0.7 : 0.3) * uniform(), F);
    }
    PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
    tangent_of(m, F, exact);
    PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT_SPD));
    tangent_of(m, F, spd);
    lowest = project(spd, projected);
    for (int k = 0; k < 81; k++)
      size = larger(size, fabs(spd[k]));
    SB_CHECK(lowest >= -1e-14 * size, "%s: exact_spd has the eigenvalue %g of %g", m->law, lowest,
             size);
    if (wild)
      continue;
    smallest = project(exact, projected);
    indefinite += smallest < -1e-3 * m->E;
    SB_CHECK(difference(81, spd, projected) < 1e-11 * size,
             "%s: exact_spd is %g from the projected tangent", m->law,
             difference(81, spd, projected) / size);
  }
  SB_CHECK(indefinite > 50, "%s: only %d of the exact tangents were indefinite", m->law,
           (int)indefinite);
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same F in any lane among any neighbours, NaN included: the same bits from every operation. */
static inline void check_lanes(SbMaterial m)
{
  SbPack f[9], psi, P[9], C[81];
  PetscReal F[9], p[9], q[9], c[81], d[81];
  PetscInt different = 0;

  for (int t = 0; t < 100; t++) {
    random_deformation(0.4, F);
    const PetscReal e = energy_of(m, F);
    stress_of(m, F, p);
    tangent_of(m, F, c);
    for (int place = 0; place < SB_BATCH; place++) {
      for (int l = 0; l < SB_BATCH; l++)
        for (int k = 0; k < 9; k++)
          f[k][l] = l == place ? F[k] : l % 3 ? uniform() : NAN;
      m->ops.energy(m, (const SbPack *)f, psi);
      m->ops.stress(m, (const SbPack *)f, P);
      m->ops.tangent(m, (const SbPack *)f, C);
      SbPackGet(9, (const SbPack *)P, place, q);
      SbPackGet(81, (const SbPack *)C, place, d);
      different += psi[place] != e || memcmp(p, q, sizeof(p)) != 0 || memcmp(c, d, sizeof(c)) != 0;
    }
  }
  SB_CHECK(!different, "%s: %d results depend on their neighbours", m->law, (int)different);
}

/*
  The damping stress takes energy out at any F; in an unstrained, turned cell it is the exact
  tangent, which vanishes for a spin.
*/
static inline void check_damping(SbMaterial m, const PetscReal F[9])
{
  const PetscReal scale = m->E + m->lambda;
  const PetscReal spin[9] = {0, -0.3, 0.2, 0.3, 0, 0.9, -0.2, -0.9, 0};
  PetscReal H[9], Q[9], C[81], dP[9], CH[9];

  for (int k = 0; k < 9; k++)
    H[k] = uniform();
  damping_of(m, F, H, dP);
  SB_CHECK(SbDot9(H, dP) >= 0, "%s: damping feeds in %g", m->law, SbDot9(H, dP));
  random_rotation(Q);
  tangent_of(m, Q, C);
  contract(C, H, CH);
  damping_of(m, Q, H, dP);
  SB_CHECK(difference(9, CH, dP) < 1e-13 * scale, "%s: damping is %g from C : H", m->law,
           difference(9, CH, dP));
  SbMatMul(spin, Q, H);
  damping_of(m, Q, H, dP);
  SB_CHECK(sqrt(SbDot9(dP, dP)) < 1e-14 * scale, "%s: a spin is damped by %g", m->law,
           sqrt(SbDot9(dP, dP)));
}

/* What holds for all nonlinear laws. `recovers`: the law pulls inverted cells back. */
static inline PetscErrorCode check_law(SbMaterial m, PetscBool recovers)
{
  PetscReal F[9];

  PetscFunctionBeginUser;
  check_rest(m);
  check_rotations(m);
  check_inversion(m, recovers);
  check_lanes(m);
  for (int t = 0; t < 100; t++) {
    random_deformation(0.25, F);
    check_derivatives(m, F, "order of the Taylor remainder");
    check_curvature(m, F);
    check_invariance(m, F);
    check_damping(m, F);
  }
  for (int t = 0; t < 100; t++) {
    with_stretches(1.2 + 0.3 * uniform(), 1, -0.3 + 0.2 * uniform(), F);
    check_derivatives(m, F, "order of the Taylor remainder, inverted");
    check_invariance(m, F);
  }
  PetscCall(check_spd(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |P - expected| <= 1e-10 E for the homogeneous states. */
static inline void check_stress(SbMaterial m, const PetscReal F[9], const PetscReal expected[9],
                                const char *what)
{
  PetscReal P[9];

  stress_of(m, F, P);
  for (int k = 0; k < 9; k++)
    SB_CHECK_NEAR(P[k], expected[k], 1e-10 * m->E, what);
}
