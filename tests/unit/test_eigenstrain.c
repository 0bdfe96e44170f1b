// @ranks 1
/* Laws with strains without stress (src/material/eigenstrain.c), for all laws of the registry:
   stress is the derivative of the energy and the tangent that of the stress, the part that changes
   volume and its derivatives, the force on the strains; with and without fibres. */
#include "../laws.h"
#include "material_checks.h"

/* Stretches l and m in lane 2, others around it, as SbEigenLaw() takes them. */
static void put_stretches(PetscReal l, PetscReal m, PetscBool linear, SbPack stretch[3])
{
  for (int lane = 0; lane < SB_BATCH; lane++) {
    const PetscReal more = 1 + 0.05 * (lane - 2);

    stretch[0][lane] = 1 / (l * more);
    stretch[1][lane] = 1 / (m * more);
    stretch[2][lane] = linear ? 1 : m * more * sqrt(l * more);
  }
}

/* psi + p r theta in lane 2. */
static PetscReal energy_with(SbMaterial m, const PetscReal F[9], PetscReal p)
{
  return energy_of(m, F) + p * dilatation_of(m, F);
}

static void check_force(SbMaterial w, SbPack stretch[3], const PetscReal at[2],
                        const PetscReal F[9], PetscBool fibres)
{
  const PetscReal h = 1e-5;
  const PetscReal pressure = 0.3 * stress_scale(w);
  SbPack f[9], p, force[2];

  batch(F, f);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = pressure;
  SbEigenForce(w, (const SbPack *)f, p, force);
  for (int k = 0; k < (fibres ? 2 : 1); k++) {
    const PetscReal exact = fibres ? force[k][2] : force[0][2] + force[1][2];
    PetscReal psi[2];

    for (int i = 0; i < 2; i++) {
      const PetscReal by = exp(i ? h : -h);

      put_stretches(at[0] * (fibres && k ? 1 : by), at[1] * (fibres && !k ? 1 : by), w->linear,
                    stretch);
      psi[i] = energy_with(w, F, pressure);
    }
    SB_CHECK_NEAR((psi[1] - psi[0]) / (2 * h), exact, 1e-7 * stress_scale(w), "force on a strain");
  }
  put_stretches(at[0], at[1], w->linear, stretch);
}

static PetscErrorCode check_strained(SbMaterial m, PetscBool fibres)
{
  const PetscReal at[2] = {fibres ? 1.2 : 1.1, 1.1};
  PetscReal Q[9], F[9];
  SbPack axes[9], stretch[3];
  struct _p_SbMaterial w = *m;
  struct _p_SbMaterial shear;
  SbMaterial other;

  PetscFunctionBeginUser;
  PetscCall(SbMaterialGetShear(m, &other));
  random_rotation(Q);
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      axes[k][l] = Q[k];
  put_stretches(at[0], at[1], m->linear, stretch);
  shear = *other;
  w.axes = shear.axes = fibres ? (const SbPack *)axes : NULL;
  SbEigenLaw(&w, m, PETSC_FALSE, 0);
  w.stretch = shear.stretch = (const SbPack *)stretch;
  SbEigenLaw(&shear, other, PETSC_FALSE, 0);
  w.shear = &shear;

  /* a free cell has no stress */
  for (int k = 0; k < 9 && fibres; k++)
    F[k] = at[1] * (k % 4 == 0) + (at[0] - at[1]) * Q[3 * (k / 3)] * Q[3 * (k % 3)];
  for (int k = 0; k < 9 && !fibres; k++)
    F[k] = at[1] * (k % 4 == 0);
  PetscReal P[9];
  stress_of(&w, F, P);
  SB_CHECK(sqrt(SbDot9(P, P)) < 1e-13 * stress_scale(m) && energy_of(&w, F) < 1e-13,
           "%s: %g Pa in a free cell", m->type->name, sqrt(SbDot9(P, P)));

  /* elsewhere: near the identity, turned */
  for (int i = 0; i < 4; i++) {
    random_deformation(0.1, F);
    for (int k = 0; k < 2; k++) {
      w.tangent = k ? SB_TANGENT_EXACT : m->tangent;
      if (w.tangent == SB_TANGENT_EXACT)
        check_derivatives(&w, F, m->type->name);
    }
    shear.tangent = w.tangent;
    PetscCall(check_volume(&w, F));
    check_force(&w, stretch, at, F, fibres);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *laws[SB_MATERIAL_TYPES];
  PetscInt n;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  n = SbMaterialTypes(laws);
  for (PetscInt i = 0; i < n; i++) {
    SbMaterial m;

    test_print("%s\n", laws[i]);
    PetscCall(law_create(laws[i], 5e3, 0.4, 1000, &m));
    PetscCall(check_strained(m, PETSC_TRUE));
    PetscCall(check_strained(m, PETSC_FALSE));
    PetscCall(SbMaterialDestroy(&m));
  }
  SB_CHECK(derivative_switches < 20, "%d tangents were at a switch", (int)derivative_switches);
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
