// @ranks 1
/* The barrier of a pair: its derivatives by differences, with the radius of an obstacle, for
   parallel edges, a half-space and a bowl; without what other pairs count too. */
#include "../../src/contact/pairs.h"
#include "pair_reference.h"

#define NRANDOM 4000

static const PetscReal width = 0.5, pressure = 3.;
static SbPairLaw law = {.width = 0.5, .stiffness = 3.};

/* b and its derivatives: positive, decreasing, convex; zero from the width on, infinite at zero
   gap. */
static void check_function(void)
{
  PetscReal b[3], c[3], d[3];

  for (int i = 1; i < 100; i++) {
    const PetscReal gap = 0.01 * i * width;
    const PetscReal step = 1e-6 * gap;

    SbBarrier(gap, width, pressure, 2., b);
    SbBarrier(gap - step, width, pressure, 2., c);
    SbBarrier(gap + step, width, pressure, 2., d);
    SB_CHECK(b[0] > 0. && b[1] < 0. && b[2] > 0., "signs at %g of the width: %g %g %g", 0.01 * i,
             b[0], b[1], b[2]);
    SB_CHECK_NEAR((d[0] - c[0]) / (2. * step), b[1], 1e-7 * (PetscAbsReal(b[1]) + pressure),
                  "slope");
    SB_CHECK_NEAR((d[1] - c[1]) / (2. * step), b[2], 1e-7 * (PetscAbsReal(b[2]) + pressure / width),
                  "curvature");
  }
  SbBarrier(width, width, pressure, 2., b);
  SB_CHECK(b[0] == 0. && b[1] == 0. && b[2] == 0., "at the width: %g %g %g", b[0], b[1], b[2]);
  SbBarrier(0., width, pressure, 2., b);
  SB_CHECK(b[0] >= PETSC_INFINITY, "where surfaces touch: %g", b[0]);
}

static PetscReal energy_at(SbContactSurface m, const SbContactPair *pair, const PetscReal x[],
                           PetscReal gradient[])
{
  PetscReal energy, gap;
  SbDistance distance;

  gap = SbContactPairGap(m, pair, x, &distance);
  if (gap <= 0.)
    return PETSC_INFINITY;
  SbPairEnergy(m, pair, &law, gap, &distance, x, &energy, gradient, PETSC_FALSE, NULL);
  return energy;
}

/* Edges of length 1 that cross at an angle of 0.01: at larger gaps their barrier is reduced by the
   mollifier, which its derivatives include; at small gaps it is complete. */
static void check_crossing(void)
{
  PetscReal X[12] = {0., 0., 0., 1., 0., 0., 0., 0., 0., 1., 0., 0.};
  PetscReal x[12], gradient[12];
  PetscReal last = 0.;
  PetscReal b[3];
  struct _p_SbContactSurface mesh = {.nbody_vertex = 4, .nvertex = 4, .X = X};
  const SbContactPair pair = {.kind = SB_PAIR_EDGE_EDGE, .v = {0, 1, 2, 3}, .area = 0.7};

  for (PetscReal gap = 0.02; gap > 1e-5; gap *= 0.8) {
    PetscReal energy;

    for (int k = 0; k < 12; k++)
      x[k] = X[k] + (k % 3 == 2 && k > 5 ? gap : 0.);
    x[7] -= 0.005;
    x[10] += 0.005;
    energy = energy_at(&mesh, &pair, x, gradient);
    SbBarrier(gap, width, pressure, pair.area, b);
    SB_CHECK(energy > last && energy <= (1. + 1e-6) * b[0],
             "energy %g at the gap %g, %g of edges at any angle", energy, gap, b[0]);
    SB_CHECK(gap > 0.012 ? energy < 0.9 * b[0] : gap > 0.005 || energy > 0.999 * b[0],
             "part %g of the barrier at the gap %g", energy / b[0], gap);
    last = energy;
  }
}

/* What pairs share counts once: over a fan of triangles, and across a row of edges, the energy of a
   point or an edge at a height does not depend on where it is, though up to six features are as
   near; without, it does. */
static void check_once(void)
{
  PetscReal X[24], x[24];
  PetscReal b[3];
  struct _p_SbContactSurface mesh = {.nbody_vertex = 8, .nvertex = 8, .X = X};

  for (int gap = 1; gap < 10; gap++) {
    const PetscReal height = 0.05 * gap * width;

    SbBarrier(height, width, pressure, 0.7, b);
    for (int i = 0; i < 20; i++) {
      PetscReal sum[2] = {0., 0.};

      /* vertices: the point, the middle of the fan, six around */
      for (int k = 0; k < 24; k++)
        x[k] = 0.;
      x[0] = 0.02 * i * (gap % 3);
      x[1] = -0.03 * i;
      x[2] = height;
      for (int k = 0; k < 6; k++) {
        x[6 + 3 * k] = 3. * PetscCosReal(PETSC_PI / 3. * k);
        x[7 + 3 * k] = 3. * PetscSinReal(PETSC_PI / 3. * k);
      }
      for (int once = 0; once < 2; once++) {
        for (int k = 0; k < 6; k++) {
          SbContactPair pair = {
            .kind = SB_PAIR_VERTEX_TRIANGLE, .v = {0, 1, 2 + k, 2 + (k + 1) % 6}, .area = 0.7};
          PetscReal gradient[12];

          if (once) {
            pair.share[0] = pair.share[2] = 0.5;
            pair.share[3] = 1. / 6.;
          }
          sum[once] += energy_at(&mesh, &pair, x, gradient);
        }
      }
      SB_CHECK_NEAR(sum[1], b[0], 1e-12 * b[0], "a point over a fan");
      SB_CHECK(i || sum[0] > 5.99 * b[0], "of six triangles %g instead of %g", sum[0], b[0]);
    }
    for (int i = -10; i <= 10; i++) {
      PetscReal sum = 0.;

      /* vertices: the edge, and a row of three */
      for (int k = 0; k < 24; k++)
        X[k] = x[k] = 0.;
      x[0] = -2.;
      x[3] = 2.;
      x[2] = x[5] = height;
      x[1] = x[4] = 0.05 * i;
      x[7] = -2.;
      x[13] = 2.;
      for (int k = 0; k < 15; k++)
        X[k] = x[k];
      for (int k = 0; k < 2; k++) {
        const SbContactPair pair = {.kind = SB_PAIR_EDGE_EDGE,
                                    .v = {0, 1, 2 + k, 3 + k},
                                    .area = 0.7,
                                    .share = {0., 0., k ? 0.5 : 0., k ? 0. : 0.5}};
        PetscReal gradient[12];

        sum += energy_at(&mesh, &pair, x, gradient);
      }
      SB_CHECK_NEAR(sum, b[0], 1e-12 * b[0], "an edge across a row of edges");
    }
  }
}

/* Gradient, Hessian and projected Hessian against central differences, for the motion of the first
   nv vertices, which belong to bodies. */
static void check_pair(SbContactSurface m, const SbContactPair *pair, PetscReal x[12], int nv,
                       PetscInt *tried)
{
  const PetscReal step = 1e-6;
  PetscReal energy, gap, gradient[12], H[2][144];
  PetscReal reference[144] = {0.};
  PetscReal largest = 0.;
  PetscReal worst = 0.;
  SbDistance distance;

  gap = SbContactPairGap(m, pair, x, &distance);
  if (gap <= 0.02 || gap >= width)
    return;
  for (int clamp = 0; clamp < 2; clamp++)
    SbPairEnergy(m, pair, &law, gap, &distance, x, &energy, gradient, (PetscBool)clamp, H[clamp]);
  for (int k = 0; k < 3 * nv; k++) {
    PetscReal side[2], g[2][12];

    for (int s = 0; s < 2; s++) {
      x[k] += s ? 2. * step : -step;
      side[s] = energy_at(m, pair, x, g[s]);
    }
    x[k] -= step;
    SB_CHECK_NEAR((side[1] - side[0]) / (2. * step), gradient[k],
                  2e-4 * (pressure + PetscAbsReal(gradient[k])), "gradient");
    for (int l = 0; l < 3 * nv; l++)
      reference[12 * k + l] = (g[1][l] - g[0][l]) / (2. * step);
  }

  /* the closest feature can change within the differences: then these are not symmetric or are
     large, and the pair is skipped */
  for (int k = 0; k < 144; k++) {
    largest = PetscMax(largest, PetscAbsReal(reference[k]));
    worst = PetscMax(worst, PetscAbsReal(reference[k] - reference[12 * (k % 12) + k / 12]));
  }
  if (worst > 1e-4 * largest)
    return;
  for (int clamp = 0; clamp < 2; clamp++) {
    if (clamp)
      SbSymmetricProjectPSD(12, reference);
    for (int k = 0; k < 3 * nv; k++) {
      for (int l = 0; l < 3 * nv; l++)
        SB_CHECK_NEAR(H[clamp][12 * k + l], reference[12 * k + l], 2e-3 * largest + 1e-6,
                      "second derivative, or its positive part");
    }
  }
  (*tried)++;
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscReal x[12], X[12], u[3], n[3];
  struct _p_SbContactSurface mesh = {.nbody_vertex = 4, .nvertex = 4, .X = X};
  SbContactPair pair = {.kind = SB_PAIR_VERTEX_TRIANGLE, .v = {0, 1, 2, 3}, .area = 0.7};
  PetscInt tried[9] = {0};

  check_function();
  check_crossing();
  check_once();
  for (int i = 0; i < NRANDOM; i++) {
    for (int k = 0; k < 12; k++)
      X[k] = x[k] = pair_random();
    pair.side = PETSC_FALSE;
    mesh.side = SB_SIDE_NONE;
    mesh.radius = 0.;
    mesh.nbody_vertex = 4;
    pair.kind = SB_PAIR_VERTEX_TRIANGLE;
    check_pair(&mesh, &pair, x, 4, &tried[0]);
    pair.kind = SB_PAIR_EDGE_EDGE;
    check_pair(&mesh, &pair, x, 4, &tried[1]);

    /* what other pairs count too is taken off */
    for (int k = 0; k < 6; k++)
      pair.share[k] = k < 3 ? 0.5 : 0.2;
    pair.kind = SB_PAIR_VERTEX_TRIANGLE;
    check_pair(&mesh, &pair, x, 4, &tried[7]);
    pair.kind = SB_PAIR_EDGE_EDGE;
    check_pair(&mesh, &pair, x, 4, &tried[8]);
    for (int k = 0; k < 6; k++)
      pair.share[k] = 0.;

    /* nearly parallel edges at a small distance */
    for (int k = 0; k < 3; k++) {
      x[6 + k] = x[k] + 0.1 * pair_random() + (k == 2 ? 0.2 : 0.);
      x[9 + k] = x[6 + k] + x[3 + k] - x[k] + 0.01 * pair_random();
    }
    check_pair(&mesh, &pair, x, 4, &tried[2]);

    /* the same at such a small distance that the mollifier depends on the gap */
    for (int k = 0; k < 3; k++)
      u[k] = x[3 + k] - x[k];
    SbCross(u, X, n);
    for (int k = 0; k < 3; k++) {
      x[6 + k] = x[k] + 0.03 * n[k] / PetscSqrtReal(SbDot3(n, n));
      x[9 + k] = x[6 + k] + u[k] + 0.01 * pair_random();
      x[6 + k] -= 0.01 * pair_random();
    }
    check_pair(&mesh, &pair, x, 4, &tried[5]);
    pair.share[0] = pair.share[3] = 0.8;
    pair.share[1] = 0.5;
    check_pair(&mesh, &pair, x, 4, &tried[8]);
    for (int k = 0; k < 6; k++)
      pair.share[k] = 0.;

    /* the same with one edge of a capsule */
    mesh.nbody_vertex = 2;
    mesh.radius = 0.01;
    for (int k = 0; k < 6; k++)
      x[6 + k] += 0.01 * n[k % 3] / PetscSqrtReal(SbDot3(n, n));
    check_pair(&mesh, &pair, x, 4, &tried[6]);

    /* half-space and bowl: only the first vertex moves */
    pair.side = PETSC_TRUE;
    mesh.nbody_vertex = 1;
    mesh.side = SB_SIDE_PLANE;
    for (int k = 0; k < 3; k++)
      x[6 + k] = x[3 + k] + (k == 2);
    check_pair(&mesh, &pair, x, 1, &tried[3]);
    mesh.side = SB_SIDE_BOWL;
    mesh.radius = 1.;
    check_pair(&mesh, &pair, x, 1, &tried[4]);
  }
  for (int k = 0; k < 9; k++)
    SB_CHECK(tried[k] > 100, "%d pairs of kind %d examined", (int)tried[k], k);
  SB_TEST_END();
}
