/*
  Stable neo-Hookean material of Smith, de Goes and Kim ("Stable neo-Hookean flesh simulation",
  2018, equation 14, with the logarithmic term that makes F = 0 no stationary point). With I1 =
  |F|^2, J = det F:

    psi = a/2 (I1 - 3) - a/2 log((I1 + 1)/4) + b/2 (J - 1)^2 - 3a/4 (J - 1)
    P   = a (1 - 1/(I1 + 1)) F + (b (J - 1) - 3a/4) cof F

  which is their energy with alpha = 1 + 3a/(4b), less a constant. F = I is stress-free, and psi is
  finite for every F, also an inverted one. Linearised at F = I, dP = 3a/4 (H + H^T) + (b - 5a/8)
  tr(H) I, so that

    a = 4/3 mu,   b = lambda + 5/6 mu

  make the small-strain limit exactly Hooke's law with (E, nu), for every nu in (-1, 0.5) (b > 0
  there). This b is for psi with the log term; without it the constants differ.

  Tangent, exact: with g = 1/(I1 + 1), p = b (J - 1) - 3a/4, c = cof F
    dP/dF = a (1 - g) identity + 2 a g^2 F F + b c c + p d(cof F)/dF (SbAddCofactorTangent()).
  In signed stretches: flips a (1 - g) - p s_k, twists a (1 - g) + p s_k (section 4 of the paper).
*/
#include "material_impl.h"

/* Energy from H = F - I, whose first-order terms cancel: with x = (I1 - 3)/4, I1 - 3 = 2 tr H +
   |H|^2 and J - 1 = tr H + h2 + det H (h2: sum of the principal 2x2 minors) inserted, nothing
   cancels at small strains. */
SB_KERNEL static void energy_stable(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                    SbPack psi)
{
  const PetscReal a = 4 * m->rest->mu / 3;
  const PetscReal b = m->rest->lambda + 5 * m->rest->mu / 6;
  SbPack x;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal h[9], c[9];

    SbPackGet(9, F, l, h);
    h[0] -= 1;
    h[4] -= 1;
    h[8] -= 1;
    SbMatCofactor(h, c);
    const PetscReal tr = h[0] + h[4] + h[8];
    const PetscReal square = SbDot9(h, h);
    const PetscReal rest = c[0] + c[4] + c[8] + SbDot3(h, c);
    const PetscReal j = tr + rest;
    x[l] = (2 * tr + square) / 4;
    psi[l] = 3 * a / 8 * square - 3 * a / 4 * rest + b / 2 * j * j;
  }
  for (int l = 0; l < SB_BATCH; l++)
    psi[l] += a / 2 * (x[l] - log1p(x[l]));
}

SB_KERNEL static void stress_stable(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                    SbPack P[restrict 9])
{
  const PetscReal a = 4 * m->rest->mu / 3;
  const PetscReal b = m->rest->lambda + 5 * m->rest->mu / 6;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    const PetscReal I1 = SbDot9(f, f);
    const PetscReal shear = a * I1 / (I1 + 1);
    const PetscReal p = b * (SbDot3(f, c) - 1) - 3 * a / 4;
    for (int k = 0; k < 9; k++)
      P[k][l] = shear * f[k] + p * c[k];
  }
}

/* theta = J - 1, from H = F - I as in the energy. */
SB_KERNEL static void dilatation_stable(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack theta)
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal h[9], c[9];

    SbPackGet(9, F, l, h);
    h[0] -= 1;
    h[4] -= 1;
    h[8] -= 1;
    SbMatCofactor(h, c);
    theta[l] = h[0] + h[4] + h[8] + c[0] + c[4] + c[8] + SbDot3(h, c);
  }
}

SB_KERNEL static void tangent_spd(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                  SbPack C[restrict 81])
{
  const PetscReal a = 4 * m->rest->mu / 3;
  const PetscReal b = m->rest->lambda + 5 * m->rest->mu / 6;
  SbPack U[9], V[9], s[3], hessian[6], flip[3], twist[3];

  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal x = s[0][l];
    const PetscReal y = s[1][l];
    const PetscReal z = s[2][l];
    const PetscReal g = 1 / (x * x + y * y + z * z + 1);
    const PetscReal p = b * (x * y * z - 1) - 3 * a / 4;
    const PetscReal shear = a * (1 - g);
    const PetscReal stretch = 2 * a * g * g;

    hessian[0][l] = shear + stretch * x * x + b * (y * z) * (y * z);
    hessian[1][l] = stretch * x * y + b * (y * z) * (z * x) + p * z;
    hessian[2][l] = stretch * x * z + b * (y * z) * (x * y) + p * y;
    hessian[3][l] = shear + stretch * y * y + b * (z * x) * (z * x);
    hessian[4][l] = stretch * y * z + b * (z * x) * (x * y) + p * x;
    hessian[5][l] = shear + stretch * z * z + b * (x * y) * (x * y);
    for (int k = 0; k < 3; k++) {
      flip[k][l] = shear - p * s[k][l];
      twist[k][l] = shear + p * s[k][l];
    }
  }
  SbSpectralTangent(U, V, hessian, flip, twist, C);
}

SB_KERNEL static void tangent_stable(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                     SbPack C[restrict 81])
{
  const PetscReal a = 4 * m->rest->mu / 3;
  const PetscReal b = m->rest->lambda + 5 * m->rest->mu / 6;
  SbPack cof[9], pF[9], shear, stretch;

  if (m->tangent == SB_TANGENT_EXACT_SPD) {
    tangent_spd(m, F, C);
    return;
  }
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    const PetscReal g = 1 / (SbDot9(f, f) + 1);
    const PetscReal p = b * (SbDot3(f, c) - 1) - 3 * a / 4;
    shear[l] = a * (1 - g);
    stretch[l] = 2 * a * g * g;
    SbPackPut(9, c, l, cof);
    for (int k = 0; k < 9; k++)
      pF[k][l] = p * f[k];
  }
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int row = kl / 3 - ij / 3,
                column = (kl % 3 - ij % 3 + 3) % 3; /* 0 same, 1 next, 2 previous */
      const int third = 3 * ((6 - ij / 3 - kl / 3) % 3) + (6 - ij % 3 - kl % 3) % 3;
      const PetscReal same = ij == kl;
      const PetscReal sign = row && column ? (row == column ? 1 : -1) : 0;
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        c[l] = b * cof[ij][l] * cof[kl][l] + stretch[l] * F[ij][l] * F[kl][l] +
               sign * pF[third][l] + same * shear[l];
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

/* d theta/dF = cof F */
SB_KERNEL static void dilatation_gradient_stable(const struct _p_SbMaterial *m,
                                                 const SbPack F[restrict 9], SbPack D[restrict 9])
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    SbPackPut(9, c, l, D);
  }
}

SB_KERNEL void SbAddCofactorTangent(const SbPack F[restrict 9], const SbPack p,
                                    SbPack C[restrict 81])
{
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = 0; kl < 9; kl++) {
      const int row = (kl / 3 - ij / 3 + 3) % 3;
      const int column = (kl % 3 - ij % 3 + 3) % 3;
      const int third = 3 * ((6 - ij / 3 - kl / 3) % 3) + (6 - ij % 3 - kl % 3) % 3;
      const PetscReal sign = row && column ? (row == column ? 1 : -1) : 0;

      for (int l = 0; l < SB_BATCH && sign != 0.; l++)
        C[9 * ij + kl][l] += sign * p[l] * F[third][l];
    }
  }
}

static void dilatation_hessian_stable(const struct _p_SbMaterial *m, const SbPack F[9],
                                      const SbPack p, SbPack C[81])
{
  (void)m;
  SbAddCofactorTangent(F, p, C);
}

static const SbOption rows[] = {SB_MATERIAL_TANGENT_ROW};

const SbMaterialType SbMaterialStableNeoHookean = {
  .name = "stable_neohookean",
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .jacobian = PETSC_TRUE,
  .share = 5. / 6.,
  .ops = {.energy = energy_stable,
          .stress = stress_stable,
          .tangent = tangent_stable,
          .dilatation = dilatation_stable,
          .dilatation_gradient = dilatation_gradient_stable,
          .dilatation_hessian = dilatation_hessian_stable},
};
