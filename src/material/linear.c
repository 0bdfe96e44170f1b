/*
  Linear: sigma = 2 mu eps + lambda tr(eps) I with eps = sym(F) - I, psi = mu eps : eps + lambda/2
  tr(eps)^2.

  For small strains and small rotations only: a rotation by t has a strain cos(t) - 1. Constant
  tangent.
*/
#include "material_impl.h"

SB_INLINE void strain(const SbPack F[9], int l, PetscReal e[9])
{
  SbPackGet(9, F, l, e);
  e[1] = e[3] = (e[1] + e[3]) / 2;
  e[2] = e[6] = (e[2] + e[6]) / 2;
  e[5] = e[7] = (e[5] + e[7]) / 2;
  e[0] -= 1;
  e[4] -= 1;
  e[8] -= 1;
}

SB_KERNEL static void energy_linear(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                    SbPack psi)
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal e[9];

    strain(F, l, e);
    const PetscReal tr = e[0] + e[4] + e[8];
    psi[l] = mu * SbDot9(e, e) + lambda / 2 * tr * tr;
  }
}

SB_KERNEL static void stress_linear(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                    SbPack P[restrict 9])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal e[9];

    strain(F, l, e);
    const PetscReal p = lambda * (e[0] + e[4] + e[8]);
    for (int k = 0; k < 9; k++)
      P[k][l] = 2 * mu * e[k] + (k % 4 == 0 ? p : 0);
  }
}

/* theta = tr(eps) */
static void dilatation_linear(const struct _p_SbMaterial *m, const SbPack F[9], SbPack theta)
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++)
    theta[l] = (F[0][l] - 1) + (F[4][l] - 1) + (F[8][l] - 1);
}

static void frame_linear(const struct _p_SbMaterial *m, const SbPack F[9], SbPack R[9])
{
  (void)m;
  (void)F;
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      R[k][l] = k % 4 == 0;
}

static void tangent_linear(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  (void)F;
  for (int i = 0; i < 9; i++) {
    for (int k = 0; k < 9; k++) {
      const int turned = 3 * (k % 3) + k / 3;
      const PetscReal c =
        m->rest->mu * ((i == k) + (i == turned)) + m->rest->lambda * (i % 4 == 0 && k % 4 == 0);

      for (int l = 0; l < SB_BATCH; l++)
        C[9 * i + k][l] = c;
    }
  }
}

const SbMaterialType SbMaterialLinear = {
  .name = "linear",
  .linear = PETSC_TRUE,
  .ops = {.energy = energy_linear,
          .stress = stress_linear,
          .tangent = tangent_linear,
          .frame = frame_linear,
          .dilatation = dilatation_linear,
          .dilatation_gradient = frame_linear},
};
