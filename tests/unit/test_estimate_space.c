// @ranks 1 2 3 4
/*
  Spatial error estimate: zero for solutions that the element represents exactly and for rigid
  motions, zero across materials with different constant stresses, invariant under rotation of the
  body, additive, and independent of the number of ranks.

  Tolerances. Rounding of the strains, 1e-16 over the relative cell size, is squared in the
  energies: 1e-24 of them.
*/
#include "../laws.h"
#include "../../src/ledger/ledger_impl.h"
#include "../scene.h"

#define FAR 40. /* Young's modulus of the inclusion over that of the body, nu = 0 */

static PetscErrorCode open_scene(MPI_Comm comm, const char *options, SbModel *m)
{
  SbRun run;

  PetscFunctionBeginUser;
  PetscCall(test_options(options));
  PetscCall(SbSceneCreate(comm, m));
  PetscCall(SbRunCreate(*m, &run));
  PetscCall(SbModelSetUp(*m));
  PetscCall(SbRunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ displacements, m */

static void linear_field(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.01 * x[0] + 0.02 * x[1] - 0.01 * x[2] + 0.3;
  u[1] = 0.03 * x[0] - 0.02 * x[1] + 0.01 * x[2];
  u[2] = -0.01 * x[0] + 0.01 * x[1] + 0.02 * x[2] - 0.2;
}

/* Rotated by 1 rad about (0, 0, 1) and translated. */
static void rigid_field(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal c = PetscCosReal(1.);
  const PetscReal s = PetscSinReal(1.);

  u[0] = (c - 1.) * x[0] - s * x[1] + 0.5;
  u[1] = s * x[0] + (c - 1.) * x[1] - 0.2;
  u[2] = 0.1;
}

/* Equal stress on both sides of x = 1/2. */
static void two_field(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.01 * (x[0] < 0.5 ? x[0] : 0.5 + (x[0] - 0.5) / FAR);
  u[1] = 0.;
  u[2] = 0.;
}

/* Equal strain: the stress jumps. */
static void jump_field(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.01 * x[0];
  u[1] = 0.02 * x[1];
  u[2] = 0.01 * x[2];
}

static void wavy_field(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.01 * PetscSinReal(3. * x[0] + x[1]);
  u[1] = 0.02 * PetscSinReal(2. * x[1] - x[2]);
  u[2] = 0.01 * PetscSinReal(2. * x[2] + x[0]);
}

/* The same, rotated rigidly by 1 rad about (0, 0, 1). */
static void turned_field(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal c = PetscCosReal(1.);
  const PetscReal s = PetscSinReal(1.);
  PetscReal y[3];

  wavy_field(x, y);
  for (int k = 0; k < 3; k++)
    y[k] += x[k];
  u[0] = c * y[0] - s * y[1] - x[0];
  u[1] = s * y[0] + c * y[1] - x[1];
  u[2] = y[2] - x[2];
}

/* ------------------------------------------------------------------ checks */

/* Estimate for a field, with sums over bodies. Collective. */
static PetscErrorCode estimate(SbModel m, void (*field)(const PetscReal x[3], PetscReal value[3]),
                               SbSpaceEstimate *est)
{
  Vec U;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(m->space, &U));
  PetscCall(test_fill(m, field, U));
  PetscCall(SbSpaceEstimateCreate(m, est));
  PetscCall(SbSpaceEstimateCompute(*est, 0., U, NULL, NULL));
  PetscCall(VecDestroy(&U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_patch(const char *element, const char *law)
{
  const PetscBool linear = (PetscBool)!strcmp(law, "linear");
  SbSpaceEstimate est;
  SbModel m;
  char text[1024];

  PetscFunctionBeginUser;
  PetscCall(
    PetscSNPrintf(text, sizeof(text),
                  "-bodies a -body_a_mesh box:1,1,1:3 -body_a_element %s -body_a_material %s "
                  "-body_a_young 1e3 -body_a_poisson 0.3 -body_a_density 1 -time static %s",
                  element, law, law_moduli(law, "a", 1e3, 0.3)));
  PetscCall(open_scene(PETSC_COMM_WORLD, text, &m));
  PetscCall(estimate(m, linear_field, &est));
  SB_CHECK(est->strain[0] > 0.1, "%s, %s: strain energy %g", element, law, est->strain[0]);
  SB_CHECK(est->body2[0] <= 1e-24 * est->strain[0], "%s, %s: %g of %g J of a constant stress",
           element, law, est->body2[0], est->strain[0]);
  PetscCall(SbSpaceEstimateDestroy(&est));
  if (!linear) {
    PetscReal error2[2];

    for (int k = 0; k < 2; k++) {
      PetscCall(estimate(m, k ? turned_field : wavy_field, &est));
      error2[k] =
        est->body2[0] /
        est->factor[0]; /* the factor examines forces of supports, of which there are none */
      PetscCall(SbSpaceEstimateDestroy(&est));
    }
    SB_CHECK_NEAR(error2[1] / error2[0], 1., 1e-9, "estimate of a turned body over that before");
    PetscCall(estimate(m, rigid_field, &est));
    SB_CHECK(est->body2[0] <= 1e-24 * 1e3, "%s, %s: %g J of a rigid motion", element, law,
             est->body2[0]);
    PetscCall(SbSpaceEstimateDestroy(&est));
  }
  SB_CHECK(!est, "not set to NULL");
  PetscCall(SbModelDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_materials(const char *element)
{
  SbSpaceEstimate est;
  SbModel m;
  char text[1024];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-bodies a -body_a_mesh box:1,1,1:4 -body_a_element %s -body_a_material linear "
    "-body_a_young 1e3 -body_a_poisson 0 -body_a_density 1 -body_a_inclusions far -sets far "
    "-set_far_at box:0.5,0,0,1,1,1 -inclusion_far_material linear -inclusion_far_young %g "
    "-inclusion_far_poisson 0 -inclusion_far_density 1 -time static",
    element, 1e3 * FAR));
  PetscCall(open_scene(PETSC_COMM_WORLD, text, &m));
  for (int k = 0; k < 2; k++) {
    PetscCall(estimate(m, k ? jump_field : two_field, &est));
    SB_CHECK(est->strain[0] > 0.02, "%s: strain energy %g", element, est->strain[0]);
    SB_CHECK(est->body2[0] <= 1e-24 * est->strain[0],
             "%s: %g of %g J where each material has a constant stress", element, est->body2[0],
             est->strain[0]);
    PetscCall(SbSpaceEstimateDestroy(&est));
  }
  PetscCall(SbModelDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies of all elements, one with an inclusion, loads and supports: n values per body, in
   order. */
#define NVALUE 3
static PetscErrorCode many_bodies(MPI_Comm comm, PetscReal value[4 * NVALUE])
{
  SbSpaceEstimate est;
  PetscReal sum[4] = {0., 0., 0., 0.};
  SbModel m;

  PetscFunctionBeginUser;
  PetscCall(open_scene(
    comm,
    "-bodies a,b,c,d -body_d_mesh box:1,1,1:2 -body_d_element p2 -body_d_translate 6,0,0 "
    "-body_d_material "
    "stable_neohookean -body_d_young 1e3 -body_d_poisson 0.49 -body_d_density 1 -body_a_mesh "
    "box:1,1,1:4 "
    "-body_b_mesh box:1,1,1:3 -body_c_mesh box:1,1,1:2 "
    "-body_b_element cr -body_c_element dg -body_b_translate 2,0,0 -body_c_translate 4,0,0 "
    "-body_a_material linear -body_b_material corotated -body_c_material linear -body_a_young 1e3 "
    "-body_b_young 1e3 -body_c_young 1e3 -body_a_poisson 0.48 -body_b_poisson 0.4 -body_c_poisson "
    "0.3 "
    "-body_a_density 1 -body_b_density 1 -body_c_density 1 -body_a_inclusions far -sets far "
    "-set_far_at box:0.5,0,0,1,1,1 -inclusion_far_material linear -inclusion_far_young 5e3 "
    "-inclusion_far_poisson 0.3 -inclusion_far_density 1 -effects hold,weight -effect_hold_type "
    "fixed "
    "-effect_hold_on zmin -effect_weight_type gravity -effect_weight_vector 0,0,-9.81 -time static",
    &m));
  PetscCall(estimate(m, wavy_field, &est));
  for (PetscInt c = 0; c < m->mesh->ncell_owned; c++)
    sum[m->mesh->cell_body[c]] += est->cell2[c];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, comm));
  for (int b = 0; b < 4; b++) {
    value[NVALUE * b] = est->body2[b];
    value[NVALUE * b + 1] = est->strain[b];
    value[NVALUE * b + 2] = est->factor[b];
    SB_CHECK_NEAR(sum[b] / est->body2[b], 1., 1e-12, "sum over the cells of a body");
  }
  SB_CHECK(est->factor[0] > 1.001, "factor of P1 %g", est->factor[0]);
  SB_CHECK(est->factor[1] == 1. && est->factor[2] == 1. && est->factor[3] == 1.,
           "factors of CR, DG and P2");
  PetscCall(SbSpaceEstimateDestroy(&est));
  PetscCall(SbModelDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  const char *laws[SB_MATERIAL_TYPES];
  PetscInt nlaw;
  PetscReal alone[4 * NVALUE], together[4 * NVALUE];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbRegisterAll());
  nlaw = SbMaterialTypes(laws);
  for (int e = 0; e < 4; e++) {
    for (PetscInt l = 0; l < nlaw; l++)
      PetscCall(check_patch(elements[e], laws[l]));
    PetscCall(check_materials(elements[e]));
  }
  PetscCall(many_bodies(PETSC_COMM_SELF, alone));
  PetscCall(many_bodies(PETSC_COMM_WORLD, together));
  for (int k = 0; k < 4 * NVALUE; k++)
    SB_CHECK_NEAR(together[k] / alone[k], 1., 1e-11, "value on all ranks over that on one");
  SB_TEST_END();
}
