// @ranks 1 2
/*
  A body without contact moves as if the other bodies were absent.

    named    two distant bodies and a distant obstacle: bitwise the same result with and without
    contact effects, if
             the preconditioner depends on the matrix only
             (friction between bodies uses FGMRES instead of CG, whose result differs within the
             tolerance)
    beside   a body that flies past a collision of two others, against the same body alone. One
    linear system has all
             bodies, and Newton's method and CG stop by a norm over all of them: the motion is the
             same within these tolerances
*/
#include "contact.h"

#define BODY(name, element, place, spin)                                                        \
  "-body_" name "_mesh box:0.1,0.1,0.1:2 -body_" name "_translate " place " -body_" name        \
  "_element " element " -body_" name "_material corotated -body_" name "_young 2e4 -body_" name \
  "_poisson 0.3 -body_" name "_angular_velocity " spin " "
#define TIME "-time %s -ts_dt 0.005 -ts_max_time 0.1 -solver %s "

/* Displacements and velocities by original number, [2][3 n]; `r` (may be NULL) is filled. */
static PetscErrorCode motion(const char *options, Record *r, PetscInt *n, PetscReal **value)
{
  PetscReal *u, *v;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &t));
  if (r)
    PetscCall(record_add(&t, r));
  PetscCall(verify_solve(&t, options));
  *n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, &u));
  PetscCall(verify_gather(t.model, t.run->state.V, &v));
  PetscCall(PetscMalloc1(2 * *n, value));
  PetscCall(PetscArraycpy(*value, u, *n));
  PetscCall(PetscArraycpy(*value + *n, v, *n));
  PetscCall(PetscFree(u));
  PetscCall(PetscFree(v));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The preconditioners of `rotated` and `two_level` keep something from solve to solve and are
  renewed when the operator is a new one, as the one that contact constraints wrap: with a
  `tolerance` scenes with them may differ by what solves leave.
*/
static PetscErrorCode check_named(const char *element, const char *time, const char *solver,
                                  PetscReal tolerance)
{
  static const char *const effects[4] = {
    "-effects gravity", "-effects gravity,meet -effect_meet_type contact ",
    "-effects gravity,floor -effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,-5 -effect_floor_friction 0.3",
    "-effects gravity,meet,floor -effect_meet_type contact "
    "-effect_floor_type contact -effect_floor_obstacle sphere:0,0,-9,1"};
  PetscReal *value[4];
  PetscInt n = 0;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    value[k] = NULL;
    if (k == 2 && !strncmp(time, "newmark", 7))
      continue; /* does not support friction */
    PetscCall(PetscSNPrintf(text, sizeof(text),
                            "-bodies a,b " BODY("a", "%s", "0,0,0", "0,3,9")
                              BODY("b", "%s", "0.3,0,0", "2,0,-5") TIME "%s",
                            element, element, time, solver, effects[k]));
    PetscCall(motion(text, NULL, &n, &value[k]));
  }
  for (int k = 1; k < 4; k++) {
    PetscReal off;

    if (!value[k])
      continue;
    off = verify_difference(2 * n, value[0], value[k]);
    verify_case("named, %s, %s, %s: %s", element, time, solver, effects[k]);
    if (tolerance > 0)
      VERIFY_LESS(off, tolerance, "change of the motion");
    else
      SB_CHECK(!memcmp(value[0], value[k], (size_t)(2 * n) * sizeof(PetscReal)),
               "%s: the motion differs by %g", verify_title, off);
  }
  for (int k = 0; k < 4; k++)
    PetscCall(PetscFree(value[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first body in the list has the lowest numbers in both scenes. */
static PetscErrorCode check_beside(const char *solver, PetscReal tolerance)
{
  Record r = {0};
  PetscReal *alone, *beside;
  PetscInt n, all;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "-bodies a " BODY("a", "p1", "0,0,0", "0,3,9") TIME
                          "-snes_rtol 1e-11 -ksp_rtol 1e-10",
                          "euler_implicit", solver));
  PetscCall(motion(text, NULL, &n, &alone));
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "-bodies a,b,c " BODY("a", "p1", "0,0,0", "0,3,9") BODY(
                            "b", "p1", "0.3,0,0", "2,0,-5") BODY("c", "p1", "0.43,0.03,0", "0,0,4")
                            TIME "-body_c_velocity -1,0,0 -effects meet -effect_meet_type contact "
                                 "-snes_rtol 1e-11 -ksp_rtol 1e-10",
                          "euler_implicit", solver));
  PetscCall(motion(text, &r, &all, &beside));
  verify_case("beside, %s", solver);
  VERIFY_MORE(record_max(&r, "meet_contacts"), 3, "pairs of the others");
  VERIFY_LESS(verify_difference(n, alone, beside), tolerance, "change of the displacement");
  VERIFY_LESS(verify_difference(n, alone + n, beside + all), tolerance, "change of the velocity");
  PetscCall(PetscFree(alone));
  PetscCall(PetscFree(beside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_named("p1", "euler_implicit", "rotated", 1e-7));
  PetscCall(check_named("p1", "genalpha", "cg_icc", 0));
  PetscCall(check_named("p1", "newmark -snes_rtol 1e-11 -ksp_rtol 1e-11", "cg_icc", 1e-8));
  PetscCall(check_named("p1", "euler_implicit", "cg_icc", 0));
  PetscCall(check_named("cr", "euler_implicit", "cg_icc", 0));
  PetscCall(check_named("cr", "euler_implicit", "cg_two_level", 1e-7));
  PetscCall(check_named("dg", "euler_implicit", "cg_jacobi", 0));
  PetscCall(check_named("p2", "euler_implicit", "cg_jacobi", 0));
  PetscCall(check_beside("cg_icc", 1e-9));
  PetscCall(check_beside("direct", 1e-9));
  SB_TEST_END();
}
