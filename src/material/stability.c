/*
  Stability of a law at large strains: Drucker's criterion for incompressible deformations, as
  Abaqus checks hyperelastic constants. With principal stretches l_i = exp(e_i) of product 1 and the
  Kirchhoff stresses t_i = l_i P_ii, the work of a small change is D_ab de_a de_b, D_ab = d(t_a -
  t_3)/de_b, a, b = 1, 2, e_3 = -e_1 - e_2: D must be positive definite. Its derivatives are central
  differences of the stress, from which the pressure drops out.
*/
#include "material_impl.h"

#define STEPS 200  /* from 1 to the last stretch, equal in its logarithm */
#define DELTA 1e-5 /* step of the differences in e: error 1e-10 of the modulus */
#define LOWEST \
  -1e-5 /* eigenvalue, in shear moduli at rest or larger ones, below which a law is unstable */

/* (e1, e2) of a mode at the logarithm e of its stretch. */
static void strains(int mode, PetscReal e, PetscReal s[2])
{
  s[0] = e;
  s[1] = mode == 0 ? -e / 2 : mode == 1 ? e : 0;
}

/* The eigenvalues of D, Pa, the lower one first; no numbers beyond a limit of stretch. */
static void eigenvalues(const struct _p_SbMaterial *m, const PetscReal e[2], PetscReal value[2])
{
  SbPack F[9], P[9];
  PetscReal D[2][2];

  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      F[k][l] = 0;
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal d = l % 2 ? -DELTA : DELTA;
    const PetscReal a = e[0] + (l / 2 == 0 ? d : 0);
    const PetscReal b = e[1] + (l / 2 == 1 ? d : 0);

    F[0][l] = exp(a);
    F[4][l] = exp(b);
    F[8][l] = exp(-a - b);
  }
  m->ops.stress(m, (const SbPack *)F, P);
  for (int b = 0; b < 2; b++)
    for (int a = 0; a < 2; a++) {
      const int up = 2 * b;
      const int down = 2 * b + 1;

      D[a][b] = (F[4 * a][up] * P[4 * a][up] - F[8][up] * P[8][up] -
                 F[4 * a][down] * P[4 * a][down] + F[8][down] * P[8][down]) /
                (2 * DELTA);
    }
  const PetscReal half = (D[0][0] + D[1][1]) / 2;
  const PetscReal skew = (D[0][0] - D[1][1]) / 2;
  const PetscReal off = (D[0][1] + D[1][0]) / 2;

  value[0] = half - PetscSqrtReal(skew * skew + off * off);
  value[1] = half + PetscSqrtReal(skew * skew + off * off);
}

void SbMaterialFindUnstable(const struct _p_SbMaterial *m, int mode, PetscBool tension,
                            PetscReal *stretch)
{
  const PetscReal last = PetscLogReal(tension ? 3. : 0.3);

  *stretch = 0;
  for (int n = 1; n <= STEPS; n++) {
    PetscReal e[2], value[2];

    strains(mode, n * last / STEPS, e);
    eigenvalues(m, e, value);
    if (!(value[0] >= LOWEST * PetscMax(m->rest->mu, value[1]))) {
      if (value[0] == value[0])
        *stretch = PetscExpReal(n * last / STEPS);
      return;
    }
  }
}
