// @ranks 1 3
/*
  Rubber that softens by its first stretch; mullins.py has its cycles.

    tangent   a bar that was bent farther: residuals change by the tangent times the change, the
              energy by the force, with every element
    unnamed   the factor is 1 without softening, and 1 on loading; below it where a body unloads
    start     a run that begins with a displacement remembers it
    errors    of integrators whose stable step is not known
*/
#include "derivatives.h"

#define BAR                                                                                     \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:%d -body_bar_material %s -body_bar_density 1000 " \
  "-body_bar_element %s -body_bar_tangent exact -effects hold,gravity -effect_hold_type fixed " \
  "-effect_hold_on xmin -time static -static_steps 2 -snes_rtol 1e-9 -solver direct "           \
  "-body_bar_mullins_r 1.5 -body_bar_mullins_m 5 -body_bar_mullins_beta 1 -body_bar_poisson "   \
  "0.45 %s "

static void ripple(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(20. * x[1]) * x[0];
  v[1] = PetscCosReal(15. * x[2] + 5. * x[0]) * x[0];
  v[2] = PetscSinReal(12. * x[0] + 9. * x[1]) * x[0];
}

/* Least and largest factor of the cells at U. */
static PetscErrorCode factors(SbModel m, Vec U, PetscReal range[2])
{
  const PetscReal *u;
  PetscReal *value;
  PetscReal ends[2] = {-1., 0.}; /* -least, largest */

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->mesh->ncell_owned, &value));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  SbSpaceMullinsFactor(m->space, u, value);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  for (PetscInt c = 0; c < m->mesh->ncell_owned; c++) {
    ends[0] = PetscMax(ends[0], -value[c]);
    ends[1] = PetscMax(ends[1], value[c]);
  }
  PetscCall(PetscFree(value));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ends, 2, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  range[0] = -ends[0];
  range[1] = ends[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_tangent(const char *law, const char *element, const char *constants)
{
  PetscReal range[2];
  TestScene t;
  Vec X, D;

  PetscFunctionBeginUser;
  verify_case("tangent, %s, %s", law, element);
  PetscCall(test_open(&t, BAR, element[0] == 'p' ? 1 : 2, law, element, constants));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(factors(t.model, t.run->state.U, range));
  SB_CHECK(range[1] == 1., "%s: factors %g to %g on loading", verify_title, range[0], range[1]);
  PetscCall(VecDuplicate(t.run->state.U, &X));
  PetscCall(VecDuplicate(X, &D));
  PetscCall(test_fill(t.model, ripple, D));
  PetscCall(SbSpaceZeroPrescribed(t.model->space, PETSC_TRUE, D));

  /* half unloaded, and otherwise deformed */
  PetscCall(VecCopy(t.run->state.U, X));
  PetscCall(VecScale(X, 0.5));
  PetscCall(VecAXPY(X, 0.002, D));
  PetscCall(factors(t.model, X, range));
  VERIFY_LESS(range[0], 0.8, "least factor on unloading");
  PetscCall(verify_derivatives(&t, 1., 1e-4, X, D));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&D));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define CUBE                                                                                  \
  "-bodies cube -body_cube_mesh box:1,1,1:1 -body_cube_material isochoric_neohookean "        \
  "-body_cube_young 1e5 -body_cube_poisson 0.4 -body_cube_density 1 -sets skin -set_skin_at " \
  "body:cube -effects pull -effect_pull_type prescribed_displacement -effect_pull_on skin "   \
  "-solver direct "
#define SOFT "-body_cube_mullins_r 2 -body_cube_mullins_m 1e4 "

/* Displacement controls all: initial stretch 1.5, and half of that at the end. */
static PetscErrorCode check_start(void)
{
  PetscReal range[2];
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("start");
  for (int soft = 0; soft < 2; soft++) {
    PetscCall(test_open(&t,
                        CUBE "%s -body_cube_displacement 0.5*x;0;0 -effect_pull_displacement "
                             "(0.5-0.25*t)*x;0;0 -time euler_implicit -ts_dt 0.25 -ts_max_time 1",
                        soft ? SOFT : ""));
    PetscCall(verify_solve(&t, verify_title));
    PetscCall(factors(t.model, t.run->state.U, range));
    if (soft)
      VERIFY_LESS(range[1], 0.9, "factor of a body that began with a stretch");
    else
      SB_CHECK(range[0] == 1. && range[1] == 1., "factors %g to %g without softening", range[0],
               range[1]);
    SB_CHECK(t.model->space->softening == (PetscBool)soft, "softening %d",
             (int)t.model->space->softening);
    PetscCall(test_scene_close(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_errors(void)
{
  static const char *const times[] = {"euler_symplectic", "euler_explicit"};
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("errors");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(times); i++) {
    char text[VERIFY_TEXT];

    PetscCall(PetscSNPrintf(text, sizeof(text),
                            CUBE SOFT "-effect_pull_displacement 0,0,0 -time %s", times[i]));
    SB_CHECK_ERROR(test_scene_open(text, &t), PETSC_ERR_USER, "-body_cube_mullins_r|-time");
    PetscCall(test_scene_close(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_tangent("isochoric_neohookean", "p1", "-body_bar_young 3e4"));
  PetscCall(check_tangent("isochoric_neohookean", "p2", "-body_bar_young 3e4"));
  PetscCall(check_tangent("yeoh", "p2", "-body_bar_c1 5e3 -body_bar_c3 1e2"));
  PetscCall(check_tangent("ogden", "cr", "-body_bar_mu 1e4 -body_bar_alpha 3"));
  PetscCall(check_tangent("mooney_rivlin", "dg", "-body_bar_c10 4e3 -body_bar_c01 1e3"));
  PetscCall(check_start());
  PetscCall(check_errors());
  SB_TEST_END();
}
