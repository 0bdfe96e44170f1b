/*
  material_checks.h - checks for every material: stress is the derivative of the energy and the
  tangent that of the stress, the part that changes volume and its derivatives, frame invariance,
  independence of SIMD lanes, projected tangents are the projections of the exact ones.

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

/* Size of stresses at strains of order one, Pa. */
static inline PetscReal stress_scale(SbMaterial m)
{
  return SbMaterialYoungModulus(m) + SbMaterialVolumetricModulus(m);
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

static inline PetscReal dilatation_of(SbMaterial m, const PetscReal F[9])
{
  SbPack f[9], theta;

  batch(F, f);
  m->ops.dilatation(m, (const SbPack *)f, theta);
  return theta[2];
}

static inline void gradient_of(SbMaterial m, const PetscReal F[9], PetscReal D[9])
{
  SbPack f[9], d[9];

  batch(F, f);
  m->ops.dilatation_gradient(m, (const SbPack *)f, d);
  SbPackGet(9, (const SbPack *)d, 2, D);
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

/* Deformations next to which a family of fibres begins to bear, where the tangent jumps. */
static PetscInt derivative_switches;

/*
  Taylor: psi(F + t H) - psi(F) - t P : H and P(F + t H) - P(F) - t C : H are of order two: halving
  t divides a remainder by four up to terms of third order. Summed over six directions H, so that no
  leading term vanishes by chance; at t about 1/3000 the remainders are above 1e-8 E and their third
  order below a few percent.
*/
static inline void check_derivatives(SbMaterial m, const PetscReal F[9], const char *what)
{
  PetscReal P[9], C[81], order;
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
  order = log2(r[1][0] / r[1][1]);
  if (m->type->fibres && fabs(order - 2) > 0.1) {
    derivative_switches++;
    return;
  }
  SB_CHECK_NEAR(log2(r[0][0] / r[0][1]), 2, 0.1, what);
  if (m->linear)
    SB_CHECK(r[1][0] < 1e-13 * stress_scale(m), "%s: remainder %g of a linear stress", what,
             r[1][0]);
  else
    SB_CHECK_NEAR(order, 2, 0.1, what);
  for (int i = 0; i < 9; i++)
    for (int k = 0; k < i; k++)
      SB_CHECK(C[9 * i + k] == C[9 * k + i], "%s: tangent not symmetric", what);
}

/*
  The part that changes volume, and its derivatives: with theta the dilatation, D its gradient, and
  the same law without this part,

    psi - psi_mu = lambda/2 theta^2,   P - P_mu = lambda theta D,
    (C - C_mu) : H = lambda (D : H) D + lambda theta dD,   dD = dD/dF : H,

  with central differences for dtheta = D : H and dD, whose errors are of the order 1e-10. At rest D
  = I (check_rest), which fixes the signs.
*/
static inline PetscErrorCode check_volume(SbMaterial m, const PetscReal F[9])
{
  const PetscReal t = 1e-5;
  const PetscReal scale = stress_scale(m);
  const PetscReal lambda = SbMaterialVolumetricModulus(m);
  const PetscReal theta = dilatation_of(m, F);
  const char *law = m->type->name;
  PetscReal H[9], up[9], down[9], D[9], D1[9], D2[9], dD[9], P[9], Q[9], C[81], CH[9], C_mu[81];
  SbPack f[9], p;
  SbPack c[81] = {{0}};
  SbMaterial shear;

  PetscFunctionBeginUser;
  PetscCall(SbMaterialGetShear(m, &shear));
  SB_CHECK_NEAR(energy_of(m, F) - energy_of(shear, F), lambda / 2 * theta * theta, 1e-13 * scale,
                "energy of the change of volume");
  gradient_of(m, F, D);
  stress_of(m, F, P);
  stress_of(shear, F, Q);
  for (int k = 0; k < 9; k++)
    Q[k] += lambda * theta * D[k];
  SB_CHECK(difference(9, P, Q) < 1e-13 * scale, "%s: stress of the change of volume off by %g", law,
           difference(9, P, Q));

  /* derivatives along H */
  for (int k = 0; k < 9; k++) {
    H[k] = uniform();
    up[k] = F[k] + t * H[k];
    down[k] = F[k] - t * H[k];
  }
  SB_CHECK_NEAR((dilatation_of(m, up) - dilatation_of(m, down)) / (2 * t), SbDot9(D, H), 1e-8,
                "derivative of the dilatation");
  gradient_of(m, up, D1);
  gradient_of(m, down, D2);
  for (int k = 0; k < 9; k++)
    dD[k] = (D1[k] - D2[k]) / (2 * t);
  tangent_of(m, F, C);
  tangent_of(shear, F, C_mu);
  contract(C, H, CH);
  contract(C_mu, H, Q);
  for (int k = 0; k < 9; k++)
    Q[k] += lambda * (SbDot9(D, H) * D[k] + theta * dD[k]);
  SB_CHECK(difference(9, CH, Q) < 1e-8 * scale, "%s: tangent of the change of volume off by %g",
           law, difference(9, CH, Q));

  /* the second derivative, times a pressure of 3 in lane 2 */
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = 1 + l;
  batch(F, f);
  if (m->ops.dilatation_hessian)
    m->ops.dilatation_hessian(m, (const SbPack *)f, p, c);
  SbPackGet(81, (const SbPack *)c, 2, C);
  contract(C, H, CH);
  for (int k = 0; k < 9; k++)
    dD[k] *= 3;
  SB_CHECK(m->ops.spin || difference(9, CH, dD) < 1e-8, "%s: Hessian of the dilatation off by %g",
           law, difference(9, CH, dD));
  if (m->jacobian)
    SB_CHECK_NEAR(theta, SbMatDet(F) - 1, 1e-14, "dilatation against J - 1");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangent by the special forms that a law gives of it (SbMaterialOps): frame, of a linear law;
   spin. */
static inline void check_special_tangent(SbMaterial m, const PetscReal F[9])
{
  const PetscReal mu = SbMaterialShearModulus(m);
  const PetscReal lambda = SbMaterialVolumetricModulus(m);
  SbPack f[9], r[9], w[9];
  PetscReal H[9], R[9], W[9], B[9], T[9], C[81], CH[9], y[3], z[3];

  if (!m->ops.spin && !m->ops.frame)
    return;
  batch(F, f);
  for (int k = 0; k < 9; k++) {
    H[k] = uniform();
    W[k] = k % 4 == 0 ? -mu : 0;
  }
  if (m->ops.spin) {
    m->ops.spin(m, (const SbPack *)f, NULL, r, w);
    SbPackGet(9, (const SbPack *)w, 2, W);
  } else
    m->ops.frame(m, (const SbPack *)f, r);
  SbPackGet(9, (const SbPack *)r, 2, R);

  /* 2 mu H + lambda (R : H) R + R [z]x, z = W y */
  SbMatTransposeMul(R, H, B);
  for (int i = 0; i < 3; i++)
    y[i] = B[3 * ((i + 2) % 3) + (i + 1) % 3] - B[3 * ((i + 1) % 3) + (i + 2) % 3];
  for (int i = 0; i < 3; i++)
    z[i] = SbDot3(W + 3 * i, y);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      T[3 * i + j] = 2 * mu * H[3 * i + j] + lambda * SbDot9(R, H) * R[3 * i + j] +
                     R[3 * i + (j + 1) % 3] * z[(j + 2) % 3] -
                     R[3 * i + (j + 2) % 3] * z[(j + 1) % 3];
  tangent_of(m, F, C);
  contract(C, H, CH);
  SB_CHECK(difference(9, CH, T) < 1e-12 * stress_scale(m),
           "%s: special form of the tangent off by %g", m->type->name, difference(9, CH, T));
}

/* A law softens where the stress of a uniaxial compression has a maximum. */
static inline void check_softening(SbMaterial m)
{
  PetscReal before = -PETSC_INFINITY;
  PetscBool softens = PETSC_FALSE;

  for (int n = 1; n <= 40; n++) {
    const PetscReal F[9] = {n / 40., 0, 0, 0, 1, 0, 0, 0, 1};
    PetscReal P[9];

    stress_of(m, F, P);
    softens = (PetscBool)(softens || P[0] < before);
    before = P[0];
  }
  SB_CHECK(softens == m->softens, "%s: softens %d, its type says %d", m->type->name, softens,
           m->softens);
}

/* At rest: no energy, no stress, Hooke's tensor, the moduli and wave speed that follow from it, and
   no change of volume; pressure is positive in compression. */
static inline void check_rest(SbMaterial m)
{
  const PetscReal F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const PetscReal E = SbMaterialYoungModulus(m);
  const PetscReal nu = SbMaterialPoisson(m);
  const PetscReal G = SbMaterialShearModulus(m);
  const PetscReal K = SbMaterialBulkModulus(m);
  const PetscReal lambda = SbMaterialVolumetricModulus(m);
  PetscReal P[9], C[81], D[9];
  PetscReal sum = 0;

  /* the stiffness is Hooke's */
  stress_of(m, F, P);
  tangent_of(m, F, C);
  SB_CHECK(energy_of(m, F) == 0, "%s: energy %g at rest", m->type->name, energy_of(m, F));
  for (int k = 0; k < 9; k++)
    SB_CHECK(P[k] == 0, "%s: stress %g at rest", m->type->name, P[k]);
  for (int i = 0; i < 9 && !m->type->fibres; i++) {
    for (int k = 0; k < 9; k++) {
      const int turned = 3 * (k % 3) + k / 3;
      const PetscReal hooke = G * ((i == k) + (i == turned)) + lambda * (i % 4 == 0 && k % 4 == 0);

      SB_CHECK_NEAR(C[9 * i + k], hooke, 1e-14 * stress_scale(m),
                    "tangent at rest against Hooke's tensor");
    }
  }
  for (int k = 0; k < 9; k++)
    sum += C[9 * 4 * (k / 3) + 4 * (k % 3)] / 9;
  SB_CHECK_NEAR(K, sum, 1e-14 * (K + E), "bulk modulus against the tangent");
  if (m->type->fibres) {
    PetscReal trace = -3 * K;

    /* G is the mean over all directions: the trace over symmetric strains is 10 G + 3 K */
    for (int k = 0; k < 9; k++)
      trace += (C[10 * k] + C[9 * k + 3 * (k % 3) + k / 3]) / 2;
    SB_CHECK_NEAR(G, trace / 10, 1e-14 * stress_scale(m), "mean shear modulus against the tangent");
  } else {
    SB_CHECK_NEAR(G, C[9 * 1 + 1], 1e-14 * E, "shear modulus against the tangent");
    SB_CHECK_NEAR(SbMaterialWaveModulus(m), C[0], 1e-14 * C[0], "wave modulus against the tangent");
  }
  SB_CHECK_NEAR(9 * K * G / (3 * K + G), E, 1e-14 * E, "moduli against Young's modulus");
  SB_CHECK_NEAR((3 * K - 2 * G) / (6 * K + 2 * G), nu, 1e-14, "moduli against Poisson's ratio");

  /* volume: theta = 0, D = I; p = -lambda theta */
  gradient_of(m, F, D);
  SB_CHECK(dilatation_of(m, F) == 0, "%s: dilatation %g at rest", m->type->name,
           dilatation_of(m, F));
  SB_CHECK(difference(9, D, F) == 0, "%s: gradient of the dilatation is %g from I at rest",
           m->type->name, difference(9, D, F));
  for (int k = 0; k < 4; k++) {
    const PetscReal s = 0.8 + 0.1 * k + (k > 1) * 0.1;
    const PetscReal S[9] = {s, 0, 0, 0, s, 0, 0, 0, s};
    const PetscReal theta = dilatation_of(m, S);
    SbPack f[9], p;

    batch(S, f);
    SbMaterialPressure(m, (const SbPack *)f, p);
    SB_CHECK(s > 1 ? theta > 0 : theta < 0, "%s: dilatation %g of a stretch of %g", m->type->name,
             theta, s);
    SB_CHECK(p[2] == -lambda * theta, "%s: pressure %g of a stretch of %g", m->type->name, p[2], s);
  }
}

/* psi(Q F) = psi(F) = psi(F Q), P(Q F) = Q P(F), P(F Q) = P(F) Q: rounding only, seen through the
   polar rotation. */
static inline void check_invariance(SbMaterial m, const PetscReal F[9])
{
  const PetscReal scale = stress_scale(m);
  PetscReal Q[9], G[9], P[9], A[9], B[9];

  random_rotation(Q);
  stress_of(m, F, P);
  SbMatMul(Q, F, G);
  SB_CHECK_NEAR(energy_of(m, G), energy_of(m, F), 1e-13 * scale,
                "energy after a rotation of space");
  stress_of(m, G, A);
  SbMatMul(Q, P, B);
  SB_CHECK(difference(9, A, B) < 1e-13 * scale, "%s: stress turns wrongly by %g", m->type->name,
           difference(9, A, B));

  /* the axes of a law with fibres turn with the material */
  SbPack turned[9];
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      turned[k][l] = Q[3 * (k % 3) + k / 3];
  struct _p_SbMaterial other = *m;
  other.axes = m->type->fibres ? (const SbPack *)turned : NULL;
  SbMatMul(F, Q, G);
  SB_CHECK_NEAR(energy_of(&other, G), energy_of(m, F), 1e-13 * scale,
                "energy after a rotation of the material");
  stress_of(&other, G, A);
  SbMatMul(P, Q, B);
  SB_CHECK(difference(9, A, B) < 1e-13 * scale, "%s: material stress off by %g", m->type->name,
           difference(9, A, B));
}

/* No stress and no energy under rotations through 360 degrees by 15 about three axes. */
static inline void check_rotations(SbMaterial m)
{
  const PetscReal axes[3][3] = {{0, 0, 1}, {1, 1, 1}, {1, 2, 3}};
  const PetscReal E = SbMaterialYoungModulus(m);

  for (int a = 0; a < 3; a++) {
    for (int degree = 0; degree <= 360; degree += 15) {
      PetscReal Q[9], P[9];

      axis_rotation(axes[a], degree * PETSC_PI / 180, Q);
      stress_of(m, Q, P);
      SB_CHECK(sqrt(SbDot9(P, P)) <= 1e-12 * E, "%s: stress %g E after %d degrees", m->type->name,
               sqrt(SbDot9(P, P)) / E, degree);
      SB_CHECK_NEAR(energy_of(m, Q), 0, 1e-15 * E, "energy of a rotation");
    }
  }
}

/* Every step along -P from an inverted state lowers the energy. `recovers`: for a law that pulls
   any cell back, the way ends at det F > 0 and rest. */
static inline void check_inversion(SbMaterial m, PetscBool recovers)
{
  const PetscReal E = SbMaterialYoungModulus(m);

  for (int t = 0; t < 20; t++) {
    const PetscReal step = 0.1 / SbMaterialWaveModulus(m);
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
      up += after > before + 1e-14 * stress_scale(m);
      before = after;
    }
    SB_CHECK(!up, "%s: %d steps along -P raised the energy", m->type->name, (int)up);
    if (recovers) {
      SB_CHECK(SbMatDet(F) > 0.99, "%s: det F is still %g", m->type->name, SbMatDet(F));
      SB_CHECK(after < 1e-6 * E, "%s: %g of E is left as energy", m->type->name, after / E);
    }
  }
}

/* A law that does not admit det F <= 0: the energy grows without bound towards it, and is infinite
   from there on, or from a limit of stretch on, where no stress is a number. */
static inline void check_barrier(SbMaterial m)
{
  PetscReal before = 0;

  for (int t = 0; t < 40; t++) {
    const PetscReal s = pow(0.5, t);
    PetscReal F[9], P[9];

    with_stretches(1.1, 0.9, s, F);
    const PetscReal energy = energy_of(m, F);
    const PetscBool beyond = (PetscBool)(m->type->limited && t > 3 && isinf(energy));
    stress_of(m, F, P);

    /* the energy of a law with fibres also depends on how they are turned */
    SB_CHECK((beyond || isfinite(energy)) &&
               (t < 1 || energy > before || isinf(before) || m->type->fibres),
             "%s: energy %g of the stretch %g", m->type->name, energy, s);
    SB_CHECK(beyond != isfinite(SbDot9(P, P)), "%s: stress %g of the stretch %g", m->type->name,
             P[0], s);
    before = energy;
    with_stretches(1.1, 0.9, t == 0 ? 0 : -s, F);
    if (t == 0)
      memset(F, 0, 3 * sizeof(*F));
    stress_of(m, F, P);
    SB_CHECK(isinf(energy_of(m, F)) && energy_of(m, F) > 0, "%s: energy %g of the stretch %g",
             m->type->name, energy_of(m, F), -s);
    SB_CHECK(!isfinite(SbDot9(P, P)), "%s: stress %g of the stretch %g", m->type->name, P[0], -s);
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
    PetscReal size = stress_scale(m);

    if (wild) {
      for (int k = 0; k < 9; k++)
        F[k] = t % 8 == 3 ? 2 * uniform() : 0.01 * uniform();
    } else {
      with_stretches(1 + 0.6 * uniform(), 0.8 + 0.5 * uniform(),
                     0.5 + (t % 4 == 2 ? 0.7 : 0.3) * uniform(), F);
    }
    if (m->type->positive && isinf(energy_of(m, F)))
      continue;
    PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
    tangent_of(m, F, exact);
    PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT_SPD));
    tangent_of(m, F, spd);
    lowest = project(spd, projected);
    for (int k = 0; k < 81; k++)
      size = larger(size, fabs(spd[k]));
    SB_CHECK(lowest >= -1e-14 * size, "%s: exact_spd has the eigenvalue %g of %g", m->type->name,
             lowest, size);
    if (wild)
      continue;
    smallest = project(exact, projected);
    indefinite += smallest < -1e-3 * SbMaterialYoungModulus(m);
    SB_CHECK(difference(81, spd, projected) < 1e-11 * size,
             "%s: exact_spd is %g from the projected tangent", m->type->name,
             difference(81, spd, projected) / size);
  }
  SB_CHECK(indefinite > 50, "%s: only %d of the exact tangents were indefinite", m->type->name,
           (int)indefinite);
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All operations of a law at f, one after another: for each lane what[.][l]; their number. */
#define OPERATIONS (1 + 9 + 81 + 18 + 1 + 9 + 81)
static inline int all_operations(SbMaterial m, const SbPack f[9], SbPack what[OPERATIONS])
{
  SbPack one;
  int n = 91;

  for (int l = 0; l < SB_BATCH; l++)
    one[l] = 1;
  m->ops.energy(m, f, what[0]);
  m->ops.stress(m, f, what + 1);
  m->ops.tangent(m, f, what + 10);
  if (m->ops.spin)
    m->ops.spin(m, f, NULL, what + n, what + n + 9);
  n += m->ops.spin ? 18 : 0;
  m->ops.dilatation(m, f, what[n++]);
  m->ops.dilatation_gradient(m, f, what + n);
  n += 9;
  if (!m->ops.dilatation_hessian)
    return n;
  memset(what + n, 0, 81 * sizeof(*what));
  m->ops.dilatation_hessian(m, f, one, what + n);
  return n + 81;
}

/* The same F in any lane among any neighbours, NaN included: the same bits from every operation. */
static inline void check_lanes(SbMaterial m)
{
  SbPack f[9], first[OPERATIONS], what[OPERATIONS];
  PetscReal F[9];
  PetscInt different = 0;

  for (int t = 0; t < 100; t++) {
    random_deformation(0.4, F);
    batch(F, f);
    (void)all_operations(m, (const SbPack *)f, first);
    for (int place = 0; place < SB_BATCH; place++) {
      for (int l = 0; l < SB_BATCH; l++)
        for (int k = 0; k < 9; k++)
          f[k][l] = l == place ? F[k] : l % 3 ? uniform() : NAN;
      const int n = all_operations(m, (const SbPack *)f, what);
      for (int k = 0; k < n; k++)
        different += what[k][place] != first[k][2];
    }
  }
  SB_CHECK(!different, "%s: %d results depend on their neighbours", m->type->name, (int)different);
}

/*
  The damping stress takes energy out at any F; in an unstrained, turned cell it is the exact
  tangent, which vanishes for a spin.
*/
static inline void check_damping(SbMaterial m, const PetscReal F[9])
{
  const PetscReal scale = stress_scale(m);
  const PetscReal spin[9] = {0, -0.3, 0.2, 0.3, 0, 0.9, -0.2, -0.9, 0};
  PetscReal H[9], Q[9], C[81], dP[9], CH[9];

  for (int k = 0; k < 9; k++)
    H[k] = uniform();
  damping_of(m, F, H, dP);
  SB_CHECK(SbDot9(H, dP) >= 0, "%s: damping feeds in %g", m->type->name, SbDot9(H, dP));
  random_rotation(Q);
  tangent_of(m, Q, C);
  contract(C, H, CH);
  damping_of(m, Q, H, dP);
  SB_CHECK(m->type->fibres || difference(9, CH, dP) < 1e-13 * scale, "%s: damping is %g from C : H",
           m->type->name, difference(9, CH, dP));
  SbMatMul(spin, Q, H);
  damping_of(m, Q, H, dP);
  SB_CHECK(sqrt(SbDot9(dP, dP)) < 1e-14 * scale, "%s: a spin is damped by %g", m->type->name,
           sqrt(SbDot9(dP, dP)));
}

/* psi(I + t H) is Hooke's energy up to a relative error of order t, down to strains of 1e-7. */
static inline void check_small_strains(SbMaterial m)
{
  PetscReal H[9], F[9];
  PetscReal before = 0;

  for (int k = 0; k < 9; k++)
    H[k] = uniform();
  for (int n = 3; n < 25; n++) {
    const PetscReal t = ldexp(1, -n);
    const PetscReal tr = H[0] + H[4] + H[8];
    PetscReal hooke = SbMaterialVolumetricModulus(m) / 2 * tr * tr;

    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        hooke += SbMaterialShearModulus(m) / 4 * (H[3 * i + j] + H[3 * j + i]) *
                 (H[3 * i + j] + H[3 * j + i]);
    for (int k = 0; k < 9; k++)
      F[k] = (k % 4 == 0) + t * H[k];
    const PetscReal error = fabs(energy_of(m, F) / (t * t * hooke) - 1);
    if (n > 9 && n < 14)
      SB_CHECK_NEAR(before / error, 2, 0.2, "order of the small-strain limit");

    /* F represents t H with an error of eps, eps / t relative to the energy */
    if (n > 16)
      SB_CHECK(error < 4 * t + 1e-14 / t, "energy of a strain of %g is off by %g", t, error);
    before = error;
  }
}

/* What holds for every law. The first part includes linear ones, whose strain a rotation
   changes. */
static inline PetscErrorCode check_law(SbMaterial m)
{
  PetscReal F[9];

  PetscFunctionBeginUser;
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
  derivative_switches = 0;
  check_rest(m);
  check_lanes(m);
  check_softening(m);
  if (!m->linear && !m->type->fibres)
    check_small_strains(m);
  for (int t = 0; t < 100; t++) {
    random_deformation(0.25, F);
    check_derivatives(m, F, "order of the Taylor remainder");
    PetscCall(check_volume(m, F));
    check_special_tangent(m, F);
  }
  SB_CHECK(derivative_switches <= 3, "%s: %d of 100 tangents are no derivatives", m->type->name,
           (int)derivative_switches);
  if (m->linear)
    PetscFunctionReturn(PETSC_SUCCESS);
  check_rotations(m);
  if (m->type->positive)
    check_barrier(m);
  else
    check_inversion(m, PETSC_FALSE);
  for (int t = 0; t < 100; t++) {
    random_deformation(0.25, F);
    check_invariance(m, F);
    check_damping(m, F);
  }
  for (int t = 0; t < 100 && !m->type->positive; t++) {
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
    SB_CHECK_NEAR(P[k], expected[k], 1e-10 * SbMaterialYoungModulus(m), what);
}
