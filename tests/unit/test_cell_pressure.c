// Cell pressure of the volumetric term: lambda/2 theta^2 is the part of every material's energy
// that vanishes with lambda, positive in compression, and for small strains it is -lambda tr(eps).
// Cells of a scene get it from their own material.
#include "../laws.h"
#include "../scene.h"

/* F = I + size times reproducible numbers in [-1, 1]. */
static PetscErrorCode deform(PetscRandom random, PetscReal size, SbPack F[9])
{
  PetscFunctionBeginUser;
  for (int k = 0; k < 9; k++) {
    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal r;

      PetscCall(PetscRandomGetValueReal(random, &r));
      F[k][l] = (k % 4 == 0) + size * (2. * r - 1.);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_energy(const char *law, PetscRandom random)
{
  SbMaterial m, shear;
  SbPack F[9], psi, without, p;

  PetscFunctionBeginUser;
  PetscCall(law_create(law, 1000., 0.45, 1., &m));

  /* lambda is 0 for nu = 0; mu is that of m */
  PetscCall(law_create(law, 2. * SbMaterialShearModulus(m), 0., 1., &shear));
  for (int i = 0; i < 20; i++) {
    PetscCall(deform(random, 0.3, F));
    m->ops.energy(m, (const SbPack *)F, psi);
    shear->ops.energy(shear, (const SbPack *)F, without);
    SbMaterialPressure(m, (const SbPack *)F, p);
    for (int l = 0; l < SB_BATCH; l++) // energies are of the size of 1000 Pa
      SB_CHECK_NEAR(p[l] * p[l] / (2. * SbMaterialVolumetricModulus(m)), psi[l] - without[l], 1e-11,
                    law);
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(SbMaterialDestroy(&shear));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_small(const char *law, PetscRandom random)
{
  const PetscReal size = 1e-6;
  SbMaterial m;
  SbPack F[9], p;

  PetscFunctionBeginUser;
  PetscCall(law_create(law, 1000., 0.4999, 1., &m));
  PetscCall(deform(random, size, F));
  SbMaterialPressure(m, (const SbPack *)F, p);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal expected =
      -SbMaterialVolumetricModulus(m) * ((F[0][l] - 1.) + (F[4][l] - 1.) + (F[8][l] - 1.));

    // the next order of the strain, and the rounding of 1 + 1e-6 in the materials that need F
    // itself
    SB_CHECK_NEAR(p[l], expected, SbMaterialVolumetricModulus(m) * (20. * size * size + 1e-14),
                  law);
  }
  PetscCall(deform(random, 0., F));
  SbMaterialPressure(m, (const SbPack *)F, p);
  for (int l = 0; l < SB_BATCH; l++)
    SB_CHECK_NEAR(p[l], 0., 1e-14 * SbMaterialVolumetricModulus(m), "pressure at rest");
  for (int k = 0; k < 9; k += 4)
    for (int l = 0; l < SB_BATCH; l++)
      F[k][l] = 0.9;
  SbMaterialPressure(m, (const SbPack *)F, p);
  for (int l = 0; l < SB_BATCH; l++)
    SB_CHECK(p[l] > 0., "%s: pressure %g in compression", law, p[l]);
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void squeeze(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.02 * x[0];
  u[1] = -0.01 * x[1] + 0.05 * x[0];
  u[2] = -0.03 * x[2];
}

/* Bodies with different elements and materials: every cell has the pressure of its material. */
static PetscErrorCode test_scene(void)
{
  static const PetscReal lambda[3] = {1000. * 0.3 / (1.3 * 0.4), 5000. * 0.25 / (1.25 * 0.5),
                                      2000. * 0.4 / (1.4 * 0.2)};
  const PetscReal green = 0.02 + 0.0002 + 0.5 * 0.0025 - 0.01 + 0.5 * 1e-4 - 0.03 + 0.5 * 9e-4;
  const PetscReal theta[3] = {-0.02, green, 1.02 * 0.99 * 0.97 - 1.};
  TestScene scene;
  const PetscReal *u;
  PetscReal *p;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(
    "-bodies a,b,c -body_a_mesh box:1,1,1:2 -body_b_mesh box:1,1,1:2 -body_c_mesh box:1,1,1:2 "
    "-body_a_element p1 -body_b_element cr -body_c_element dg -body_a_material linear "
    "-body_b_material stvk "
    "-body_c_material stable_neohookean -body_a_young 1000 -body_a_poisson 0.3 -body_b_young 5000 "
    "-body_b_poisson 0.25 -body_c_young 2000 -body_c_poisson 0.4 -time newmark -ts_dt 0.1 "
    "-ts_max_time 1",
    &scene));
  PetscCall(test_fill(scene.model, squeeze, scene.run->state.U));
  PetscCall(PetscMalloc1(scene.model->mesh->ncell_owned, &p));
  PetscCall(SbSpaceGetLocalRead(scene.model->space, scene.run->state.U, &u));
  SbSpaceCellState(scene.model->space, u, NULL, NULL, NULL, p);
  PetscCall(SbSpaceRestoreLocalRead(scene.model->space, scene.run->state.U, &u));
  for (PetscInt c = 0; c < scene.model->mesh->ncell_owned; c++) {
    const PetscInt b = scene.model->mesh->cell_body[c];

    SB_CHECK_NEAR(p[c], -lambda[b] * theta[b], 1e-12 * lambda[b], "pressure of a cell");
  }
  PetscCall(PetscFree(p));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  const char *laws[SB_MATERIAL_TYPES];
  PetscInt n;
  PetscRandom random;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbRegisterAll());
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 7));
  PetscCall(PetscRandomSeed(random));
  n = SbMaterialTypes(laws);
  for (PetscInt i = 0; i < n; i++) {
    /* its energy of the shape depends on lambda */
    if (law_is_compressible(laws[i]))
      continue;
    PetscCall(test_energy(laws[i], random));
    PetscCall(test_small(laws[i], random));
  }
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(test_scene());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
