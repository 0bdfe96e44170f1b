/*
  barrier.c - what keeps the features of a pair apart.

  The energy of a gap d below the width w, s = d / w, per area (Li et al., "Incremental potential contact", ACM TOG 39(4), 2020, in the physical form
  of ipc-toolkit):

    b = -k w (s - 1)^2 ln s,   b' = k (-2 (s - 1) ln s - (s - 1)^2 / s),   b'' = k/w (-2 ln s - 2 (s - 1)/s - (s^2 - 1)/s^2)

  Parallel edges: the nearest points jump; their energy is multiplied by (2 - c/e) c/e, c = |a x b|^2 below e = 1e-3 |a|^2 |b|^2 at rest (the same
  article, section 5). Vertices and triangles carry what is left out. With e = 1e-5 blocks a little askew on each other take a third more iterations (docs/reports/contact.md).
*/
#include "sbbarrier.h"

#define MOLLIFIED 1e-3 /* e above */

void SbBarrier(PetscReal d, PetscReal w, PetscReal k, PetscReal area, PetscReal b[3])
{
  const PetscReal s = d / w;

  b[0] = b[1] = b[2] = 0.;
  if (s >= 1.) return;
  if (s <= 0.) {
    b[0] = PETSC_INFINITY;
    return;
  }
  b[0] = -k * area * w * PetscSqr(s - 1.) * PetscLogReal(s);
  b[1] = k * area * (-2. * (s - 1.) * PetscLogReal(s) - PetscSqr(s - 1.) / s);
  b[2] = k * area / w * (-2. * PetscLogReal(s) - 2. * (s - 1.) / s - (s * s - 1.) / (s * s));
}

void SbBarrierPair(SbContactMesh m, const SbContactPair *pair, PetscReal gap, const SbDistance *g,
                   const PetscReal x[], PetscReal width, PetscReal pressure, PetscReal *energy,
                   PetscReal gradient[12], PetscBool clamp, PetscReal H[144])
{
  PetscReal b[3], at[12], grad[12], C[144], e = 1.;

  SbBarrier(gap, width, pressure, pair->area, b);
  for (int k = 0; k < 12; k++) {
    at[k] = x[3 * pair->v[k / 3] + k % 3];
    gradient[k] = g->weight[k / 3] * g->n[k % 3];
  }

  /* a half-space has no curvature; that of a bowl is positive */
  if (pair->side) {
    *energy = b[0];
    for (int i = 0; i < 12 && H; i++) {
      for (int j = 0; j < 12; j++) {
        H[12 * i + j] = b[2] * gradient[i] * gradient[j];
        if (m->side == SB_SIDE_BOWL && i < 3 && j < 3)
          H[12 * i + j] -= b[1] / (m->radius - gap) * ((i == j) - g->n[i] * g->n[j]);
      }
    }
    for (int k = 0; k < 12; k++) gradient[k] *= b[1];
    return;
  }

  /* parallel edges: the factor */
  if (pair->kind == SB_PAIR_EDGE_EDGE) {
    PetscReal rest[2];

    for (int k = 0; k < 2; k++) {
      const PetscReal *p = m->X + 3 * pair->v[2 * k], *q = m->X + 3 * pair->v[2 * k + 1],
                      r[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};

      rest[k] = SbDot3(r, r);
    }
    e = SbEdgeMollifier(at, MOLLIFIED * rest[0] * rest[1], grad, H ? C : NULL);
  }
  *energy = e * b[0];

  /* e b'' dd dd + e b' d2d + b d2e + b' (de dd + dd de), or its positive part */
  if (H) {
    const PetscReal factor[2] = {e * b[2], e * b[1]};

    SbDistanceHessian(at, g, factor, (PetscBool)(clamp && e == 1.), H);
    if (e < 1.) {
      for (int i = 0; i < 12; i++) {
        for (int j = 0; j < 12; j++)
          H[12 * i + j] += b[0] * C[12 * i + j] + b[1] * (grad[i] * gradient[j] + gradient[i] * grad[j]);
      }
      if (clamp) SbSymmetricProjectPSD(12, H);
    }
  }
  for (int k = 0; k < 12; k++) gradient[k] = e * b[1] * gradient[k] + (e < 1. ? b[0] * grad[k] : 0.);
}
