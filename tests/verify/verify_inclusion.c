// @ranks 1 2 3
/*
  A body of two materials. A cube whose far half is an inclusion is pulled along x between smooth
  walls: the stress is sigma everywhere, and each half has the strain sigma / (lambda + 2 mu). The
  exact displacement is linear in each half, so that every element must reproduce it on any mesh,
  for any ratio of moduli: here one million, once in the stiffness and once in lambda only.

  Tolerance: 1e-6 of the largest displacement: rounding times the condition number, which grows with
  the contrast. The mass includes both densities.
*/
#include "verify.h"

typedef struct {
  const char *name;
  PetscReal E, nu; /* of the inclusion */
} Inclusion;

#define BULK_E 1e4
#define BULK_NU 0.3
#define SIGMA 10.

static PetscReal modulus(PetscReal E, PetscReal nu)
{
  return E * (1. - nu) / ((1. + nu) * (1. - 2. * nu)); /* lambda + 2 mu */
}

static PetscErrorCode check(const char *element, const Inclusion *in)
{
  const PetscReal near = SIGMA / modulus(BULK_E, BULK_NU);
  const PetscReal far = SIGMA / modulus(in->E, in->nu);
  TestScene t;
  SbSpace s;
  const PetscScalar *u;
  const PetscReal largest = 0.5 * PetscMax(near, far);
  PetscReal worst = 0.;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies cube -body_cube_mesh box:1,1,1:4 -body_cube_element %s -body_cube_material linear "
    "-body_cube_young %g -body_cube_poisson %g -body_cube_density 1000 -body_cube_inclusions far "
    "-sets far -set_far_at box:0.5,0,0,1,1,1 -inclusion_far_material linear -inclusion_far_young "
    "%g "
    "-inclusion_far_poisson %.12g -inclusion_far_density 3000 -effects pull,x,y,z "
    "-effect_pull_type traction "
    "-effect_pull_on xmax -effect_pull_vector %g;0;0 -effect_x_type fixed -effect_x_on xmin "
    "-effect_x_components x -effect_y_type fixed -effect_y_on ymin,ymax -effect_y_components y "
    "-effect_z_type fixed -effect_z_on zmin,zmax -effect_z_components z -time static",
    element, BULK_E, BULK_NU, in->E, in->nu, SIGMA));
  PetscCall(verify_solve(&t, in->name));
  s = t.model->space;
  SB_CHECK_NEAR(t.model->mass, 2000., 2000. * 1e-13, "mass of both halves");
  PetscCall(VecGetArrayRead(t.run->state.U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal x = s->node_x[3 * i];
    const PetscReal exact = near * PetscMin(x, 0.5) + far * PetscMax(0., x - 0.5);

    worst = PetscMax(worst, PetscAbsReal(u[3 * i] - exact));
    for (int k = 1; k < 3; k++)
      worst = PetscMax(worst, PetscAbsReal(u[3 * i + k]));
  }
  PetscCall(VecRestoreArrayRead(t.run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPI_MAX, t.model->comm));
  test_print("%s, %s: error %.1e of the largest displacement\n", element, in->name,
             worst / largest);
  SB_CHECK(worst <= 1e-6 * largest, "%s, %s: error %g m", element, in->name, worst);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  static const Inclusion inclusions[] = {
    {"soft", 1e-2, 0.3}, {"stiff", 1e10, 0.3}, {"lambda only", 1e4, 0.4999999}};

  SB_TEST_BEGIN(argc, argv);
  for (size_t e = 0; e < PETSC_STATIC_ARRAY_LENGTH(elements); e++)
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(inclusions); k++)
      PetscCall(check(elements[e], &inclusions[k]));
  SB_TEST_END();
}
