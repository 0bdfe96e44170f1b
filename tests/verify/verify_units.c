// @ranks 1 2
/*
  Independence of units and of the directions of the axes: a scene in m, kg, s is run again in mm,
  g, ms, with all lengths times 1e-6 and times 1e3 (density and stiffness kept, so times scale with
  lengths), with stiffness and density times 1e-9 and 1e9, and rotated by 37 degrees about (1,2,3).
  The displacements, in the units of the first, agree to 1e-8 of the largest (rotated: 1e-9).
  Tolerances, initial guesses, step control and the choice of the explicit step have default values:
  none of them may depend on units or directions, nor may the face terms of CR and DG. Only Newton's
  tolerance is smaller: the preconditioner is in single precision, and its effect on the solution
  depends on the direction.

  Barrier contact, a block that slides to rest with friction and two that collide in flight: as many
  iterations in m kg s, mm t s, m kg ms and cm g us, and the same displacements to CONTACT.
*/
#include "verify.h"

/* Number of new units in one m, kg, s; angle of rotation, rad. */
typedef struct {
  const char *what;
  PetscReal m, kg, s, angle, tolerance;
} Units;

static const PetscReal axis[3] = {1., 2., 3.};

static PetscErrorCode add(char text[], const char *format, ...)
{
  const size_t n = strlen(text);
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  SB_CHECK((size_t)vsnprintf(text + n, VERIFY_TEXT - n, format, args) < VERIFY_TEXT - n,
           "scenario is too long");
  va_end(args);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two bars, one of them in free flight, and all kinds of loads. */
static PetscErrorCode scenario(const char *element, const char *law, const char *time,
                               PetscReal seconds, const Units *q, char text[])
{
  const double m = q->m;
  const double s = q->s;
  const double pa = q->kg / (m * s * s);
  const double rho = q->kg / (m * m * m);

  /* P1 is far too stiff on this mesh; CR and DG get a stiffer bar */
  const double E = strcmp(element, "p1") ? 1e6 : 1e5;
  PetscReal R[9], g[3], pull[3], v[3], spin[3];

  PetscFunctionBeginUser;
  verify_rotation(axis, q->angle, R);
  verify_apply(R, (const PetscReal[3]){1., 0.5, -9.81}, g);
  verify_apply(R, (const PetscReal[3]){500., 0., 200.}, pull);
  verify_apply(R, (const PetscReal[3]){0.5, 0.2, 0.}, v);
  verify_apply(R, (const PetscReal[3]){1., 2., 4.}, spin);
  text[0] = 0;
  PetscCall(add(text,
                "-bodies bar%s -body_bar_mesh box:%.17g,%.17g,%.17g:2 -body_bar_element %s "
                "-body_bar_material %s "
                "-body_bar_young %.17g -body_bar_poisson 0.4 -body_bar_density %.17g "
                "-body_bar_rotate 1,2,3,%.17g",
                strstr(time, "static") ? "" : ",block", 0.4 * m, 0.1 * m, 0.1 * m, element, law,
                E * pa, 1e3 * rho, q->angle * 180. / PETSC_PI));
  if (!strstr(time, "static")) {
    PetscReal at[3];

    verify_apply(R, (const PetscReal[3]){0., 0.3, 0.1}, at);
    PetscCall(add(
      text,
      " -body_block_mesh box:%.17g,%.17g,%.17g:1 -body_block_element %s -body_block_material %s "
      "-body_block_young %.17g -body_block_poisson 0.3 -body_block_density %.17g "
      "-body_block_rotate 1,2,3,%.17g",
      0.2 * m, 0.1 * m, 0.1 * m, element, law, 2e5 * pa, 5e2 * rho, q->angle * 180. / PETSC_PI));
    PetscCall(add(text,
                  " -body_block_translate %.17g,%.17g,%.17g -body_block_velocity %.17g,%.17g,%.17g "
                  "-body_block_angular_velocity %.17g,%.17g,%.17g",
                  at[0] * m, at[1] * m, at[2] * m, v[0] * m / s, v[1] * m / s, v[2] * m / s,
                  spin[0] / s, spin[1] / s, spin[2] / s));
    PetscCall(add(text,
                  " -effect_damping_alpha %.17g -effect_damping_beta %.17g -ts_max_time %.17g",
                  0.5 / s, 1e-3 * s, seconds * s));
    if (strstr(time, "euler_symplectic") == NULL)
      PetscCall(add(text, " -ts_dt %.17g", 0.01 * s));
  }
  PetscCall(
    add(text,
        " -effects clamp,gravity,pull,air%s -effect_clamp_type fixed -effect_clamp_on bar.xmin "
        "-effect_gravity_vector %.17g,%.17g,%.17g -effect_pull_type traction "
        "-effect_pull_on bar.xmax -effect_pull_vector %.17g;%.17g;%.17g -effect_air_type pressure "
        "-effect_air_on bar.zmax -effect_air_value %.17g %s",
        strstr(time, "static") ? "" : ",damping", g[0] * m / (s * s), g[1] * m / (s * s),
        g[2] * m / (s * s), pull[0] * pa, pull[1] * pa, pull[2] * pa, 100. * pa, time));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, const char *law, const char *time,
                            PetscReal seconds)
{
  static const Units units[] = {
    {"m, kg, s", 1., 1., 1., 0., 0.},
    {"mm, g, ms", 1e3, 1e3, 1e3, 0., 1e-8},
    {"lengths 1e-6", 1e-6, 1e-18, 1e-6, 0., 1e-8},
    {"lengths 1e3", 1e3, 1e9, 1e3, 0., 1e-8},
    {"mass 1e-9", 1., 1e-9, 1., 0., 1e-8},
    {"mass 1e9", 1., 1e9, 1., 0., 1e-8},
    {"turned", 1., 1., 1., 37. * PETSC_PI / 180., 1e-9},
  };
  TestScene t;
  PetscReal *first = NULL;
  PetscReal *u, R[9];
  PetscInt n;
  PetscInt first_steps = 0;
  PetscInt steps;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  test_print("  %s %s, %s:", element, law, time);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(units); i++) {
    PetscCall(scenario(element, law, time, seconds, &units[i], text));
    PetscCall(test_scene_open(text, &t));
    PetscCall(verify_solve(&t, units[i].what));
    steps = t.run->counters.steps;
    n = verify_numbers(t.model);
    PetscCall(verify_gather(t.model, t.run->state.U, &u));
    PetscCall(test_scene_close(&t));

    /* displacements in m, rotated back */
    verify_rotation(axis, -units[i].angle, R);
    for (PetscInt j = 0; j < n; j++) {
      PetscReal x[3];

      verify_apply(R, u + 3 * j, x);
      for (int k = 0; k < 3; k++)
        u[3 * j + k] = x[k] / units[i].m;
    }
    if (!first) {
      first = u;
      first_steps = steps;
      test_print(" %d steps", (int)steps);
      continue;
    }
    const PetscReal difference = verify_difference(3 * n, first, u);
    test_print("; %s %.1e", units[i].what, difference);
    SB_CHECK(steps == first_steps, "%s, %s, %s, %s: %d steps instead of %d", element, law, time,
             units[i].what, (int)steps, (int)first_steps);
    SB_CHECK(difference <= units[i].tolerance, "%s, %s, %s, %s: %g", element, law, time,
             units[i].what, difference);
    PetscCall(PetscFree(u));
  }
  test_print("\n");
  PetscCall(PetscFree(first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define CONTACT \
  1e-9 /* of the largest: rounding, which each impact and each change between sticking and sliding enlarges; seen are 1e-11 */

static PetscErrorCode contact(const char *what, PetscReal speed, PetscReal friction,
                              PetscReal seconds)
{
  static const Units units[] = {{"m, kg, s", 1., 1., 1., 0., 0.},
                                {"mm, t, s", 1e3, 1e-3, 1., 0., 0.},
                                {"m, kg, ms", 1., 1., 1e3, 0., 0.},
                                {"cm, g, us", 1e2, 1e3, 1e6, 0., 0.}};
  PetscReal *first = NULL;
  PetscReal *u;
  PetscInt newton = 0;

  PetscFunctionBeginUser;
  test_print("  %s:", what);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(units); i++) {
    const Units *q = &units[i];
    const double m = q->m;
    const double s = q->s;
    const double pa = q->kg / (m * s * s);
    const double rho = q->kg / (m * m * m);
    char text[VERIFY_TEXT] = "-bodies low,high -effects gravity,floor,meet -time euler_implicit ";
    PetscReal difference;
    TestScene t;
    PetscInt n;

    for (int b = 0; b < 2; b++) {
      const char *name = b ? "high" : "low";

      PetscCall(
        add(text,
            "-body_%s_mesh box:%.17g,%.17g,%.17g:2 -body_%s_young %.17g -body_%s_poisson 0.3 "
            "-body_%s_density %.17g -body_%s_material stable_neohookean ",
            name, 0.1 * m, 0.1 * m, 0.1 * m, name, 1e5 * pa, name, name, 1e3 * rho, name));
      PetscCall(add(text, "-body_%s_translate %.17g,%.17g,%.17g -body_%s_velocity %.17g,0,%.17g ",
                    name, 0.013 * b * m, 0.021 * b * m, (0.001 + 0.112 * b) * m, name,
                    (b ? -0.5 : 1.) * speed * m / s, (b ? -1. : 0.) * speed * m / s));
    }
    PetscCall(
      add(text,
          "-effect_gravity_vector 0,0,%.17g -effect_floor_type contact -effect_meet_type contact "
          "-effect_floor_response barrier -effect_floor_obstacle plane:0,0,1,0 "
          "-effect_floor_friction %g -effect_meet_friction %g -ts_dt %.17g -ts_max_time %.17g",
          -9.81 * m / (s * s), friction, friction, 0.005 * s, seconds * s));
    PetscCall(test_scene_open(text, &t));
    PetscCall(verify_solve(&t, q->what));
    n = 3 * verify_numbers(t.model);
    PetscCall(verify_gather(t.model, t.run->state.U, &u));
    for (PetscInt k = 0; k < n; k++)
      u[k] /= q->m;
    difference = first ? verify_difference(n, first, u) : 0.;
    if (!first)
      newton = t.run->counters.newton;
    test_print("%s %s %d iterations, %.1e", first ? ";" : "", q->what, (int)t.run->counters.newton,
               difference);
    SB_CHECK(t.run->counters.newton == newton && t.run->counters.rejected == 0,
             "%s, %s: %d iterations, not %d; %d rejected steps", what, q->what,
             (int)t.run->counters.newton, (int)newton, (int)t.run->counters.rejected);
    SB_CHECK(difference <= CONTACT, "%s, %s: displacements differ by %g", what, q->what,
             difference);
    if (first)
      PetscCall(PetscFree(u));
    else
      first = u;
    PetscCall(test_scene_close(&t));
  }
  test_print("\n");
  PetscCall(PetscFree(first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("p1", "linear", "-time static", 0.));
  PetscCall(check("p1", "stable_neohookean", "-time static", 0.));
  PetscCall(check("p1", "corotated", "-time newmark -snes_rtol 1e-8", 0.3));
  PetscCall(check("p1", "stvk", "-time genalpha -snes_rtol 1e-8", 0.3));
  PetscCall(check("p1", "corotated", "-time newmark -ts_adapt_type basic -snes_rtol 1e-8", 0.3));
  PetscCall(check("p1", "stable_neohookean", "-time euler_symplectic", 0.1));
  PetscCall(check("p2", "stable_neohookean", "-time static -solver direct -snes_rtol 1e-10", 0.));
  PetscCall(check("p2", "corotated", "-time newmark -snes_rtol 1e-10 -solver direct", 0.05));
  PetscCall(check("p2", "stvk", "-time euler_symplectic", 0.002));
  PetscCall(check("cr", "stable_neohookean", "-time static -solver direct -snes_rtol 1e-10", 0.));
  PetscCall(check("dg", "stable_neohookean", "-time static -solver direct -snes_rtol 1e-10", 0.));
  PetscCall(check("cr", "corotated", "-time newmark -snes_rtol 1e-10 -solver direct", 0.05));
  PetscCall(check("dg", "stvk", "-time genalpha -snes_rtol 1e-10 -solver direct", 0.05));
  PetscCall(check("dg", "stable_neohookean", "-time euler_symplectic", 0.002));
  PetscCall(contact("friction", 0.3, 0.4, 0.1));
  PetscCall(contact("impact", 5., 0., 0.05));
  SB_TEST_END();
}
