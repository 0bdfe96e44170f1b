// @ranks 1
/*
  Bars in bending and under their own weight, static, against theory and reference solutions of the
  continuum.

    hanging   bar under its weight with the exact displacement at its top (code_aster SSLV07): order
    2 at the vertices shear     cantilever with an end load, L/h = 5, nu = 0: P L^3/(3 E I) + P
    L/(kappa G A), kappa = 5/6 (Timoshenko) weight    clamped bar 0.4 x 0.1 x 0.1 m under its
    weight, E = 5e4, nu = 0.3, rho = 1000: tip displacement -0.785713 m, strain energy
              6.38808 J, computed with graded hexahedra of high order
    elastica  slender bar with an end load of fixed direction, alpha = P L^2/(E I) (Bisshopp and
    Drucker 1945)

  P1 is too stiff in bending: errors decrease as h^2 but are large, so results on several meshes are
  extrapolated to h = 0 (Richardson). With nu = 0 plane bending does not depend on the width: one
  layer of cells between two symmetry planes is enough.
*/
#include "verify.h"

typedef struct {
  const char *what;
  PetscReal end[3]; /* where the displacement is read, m */
  PetscReal u[3];   /* m */
  PetscReal strain; /* J */
} Bar;

/* Solves a static scene with the given additional options. */
static PetscErrorCode solve(const char *options, Bar *bar)
{
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "-bodies a -time static %s", options));
  PetscCall(verify_solve(&t, bar->what));
  PetscCall(test_value_at(t.model, t.run->state.U, bar->end, bar->u));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &e));
  bar->strain = e.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bar hanging from its top */

#define HANG_E 1e4
#define HANG_NU 0.3
#define HANG_W 9810. /* rho g, N/m^3 */

static void hanging_exact(const PetscReal x[3], PetscReal u[3])
{
  u[0] = -HANG_NU * HANG_W * x[0] * x[2] / HANG_E;
  u[1] = -HANG_NU * HANG_W * x[1] * x[2] / HANG_E;
  u[2] =
    HANG_W * (PetscSqr(x[2]) - 1. + HANG_NU * (PetscSqr(x[0]) + PetscSqr(x[1]))) / (2. * HANG_E);
}

static PetscErrorCode hanging_error(PetscInt n, const char *more, PetscReal *error)
{
  TestScene t;
  Vec U;
  PetscReal size;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -time static -body_a_mesh box:0.3,0.3,1:%d -body_a_translate -0.1,-0.2,0 "
              "-body_a_material linear -body_a_young %g -body_a_poisson %g -body_a_density 1000 %s "
              "-effects gravity,top -effect_top_type prescribed_displacement -effect_top_on zmax "
              "-effect_top_displacement %.17g*x;%.17g*y;%.17g*(x^2+y^2)",
              (int)n, HANG_E, HANG_NU, more, -HANG_NU * HANG_W / HANG_E, -HANG_NU * HANG_W / HANG_E,
              0.5 * HANG_NU * HANG_W / HANG_E));
  PetscCall(verify_solve(&t, "hanging bar"));
  PetscCall(VecDuplicate(t.run->state.U, &U));
  PetscCall(test_fill(t.model, hanging_exact, U));
  PetscCall(VecNorm(U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(U, -1., t.run->state.U));
  PetscCall(VecNorm(U, NORM_INFINITY, error));
  *error /= size;
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_hanging(void)
{
  PetscReal error[3], order;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    PetscCall(hanging_error(2 << k, "", &error[k]));
  order = PetscLog2Real(error[1] / error[2]);
  test_print("  hanging bar: largest error at vertices n 2, 4, 8: %.2e %.2e %.2e of the largest "
             "displacement, order %.2f\n",
             error[0], error[1], error[2], order);

  /* the maximum over the vertices is not smooth in h: the order deviates by 0.3; the error itself
     is small */
  SB_CHECK_NEAR(order, 2., 0.3, "order at the vertices of the hanging bar");
  SB_CHECK(error[2] < 1e-3, "hanging bar, n = 8: error of %g", error[2]);

  /* the displacement is quadratic: P2 represents it except for the volume, which is constant in
     each tet */
  PetscCall(
    hanging_error(2, "-body_a_element p2 -body_a_volume pointwise -solver direct", &error[0]));
  PetscCall(hanging_error(2, "-body_a_element p2 -solver direct", &error[1]));
  PetscCall(hanging_error(4, "-body_a_element p2 -solver direct", &error[2]));
  test_print(
    "    P2: n 2 with the volume at points %.1e; with its mean n 2, 4: %.2e %.2e, order %.2f\n",
    error[0], error[1], error[2], PetscLog2Real(error[1] / error[2]));
  SB_CHECK(error[0] < 1e-10, "P2, volume at points: error of %g", error[0]);
  SB_CHECK(error[2] < 1e-3, "P2, n = 4: error of %g", error[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ cantilevers */

#define PLANE                                                                                    \
  " -effects clamp,plane,end -effect_clamp_type fixed -effect_clamp_on xmin -effect_plane_type " \
  "fixed "                                                                                       \
  "-effect_plane_on all -effect_plane_components y -effect_end_type traction -effect_end_on xmax"

/* Deflection of the cantilever with n cells across, relative to Timoshenko's. */
static PetscErrorCode shear(PetscInt n, const char *element, PetscReal *w)
{
  const PetscReal L = 1., h = 0.2, E = 1e6, P = 1e3 /* N per m of width */, G = E / 2.;
  Bar bar = {.what = "end load", .end = {L, 0., h / 2.}};
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(
    PetscSNPrintf(text, sizeof(text),
                  "-body_a_mesh box:1,0.05,0.2:%d,1,%d -body_a_element %s -body_a_material linear "
                  "-body_a_young %g -body_a_poisson 0 -body_a_density 1" PLANE
                  " -effect_end_vector 0;0;%.17g*z*(%g-z)",
                  (int)(5 * n), (int)n, element, E, 6. * P / (h * h * h), h));
  PetscCall(solve(text, &bar));
  *w = bar.u[2] / (4. * P * L * L * L / (E * h * h * h) + P * L / (5. / 6. * G * h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order is not 2 here (singularity at the edge of the clamp): three meshes give order and limit
   (Aitken). */
static PetscErrorCode check_weight(void)
{
  const PetscReal end = -0.785713;
  const PetscReal strain = 6.38808;
  PetscReal u[3], w[3], limit_u, limit_w;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    Bar bar = {.what = "weight", .end = {0.4, 0.05, 0.05}};

    PetscCall(PetscSNPrintf(
      text, sizeof(text),
      "-body_a_mesh box:0.4,0.1,0.1:%d -body_a_material linear -body_a_young 5e4 -body_a_poisson "
      "0.3 "
      "-body_a_density 1000 -effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin",
      4 << k));
    PetscCall(solve(text, &bar));
    u[k] = bar.u[2];
    w[k] = bar.strain;

    /* under given loads the energy of a conforming element is below the exact one */
    SB_CHECK(w[k] < strain, "strain energy of %g J is above the exact one", w[k]);
  }
  limit_u = verify_aitken(u);
  limit_w = verify_aitken(w);
  test_print("  clamped bar, n 4, 8, 16: end %.6f %.6f %.6f m, extrapolated %.6f (reference %.6f)\n"
             "    strain energy %.5f %.5f %.5f J, extrapolated %.5f (reference %.5f), order %.2f\n",
             u[0], u[1], u[2], limit_u, end, w[0], w[1], w[2], limit_w, strain,
             PetscLog2Real((w[1] - w[0]) / (w[2] - w[1])));
  SB_CHECK_NEAR(limit_u, end, 5e-3 * PetscAbsReal(end), "extrapolated end displacement");
  SB_CHECK_NEAR(limit_w, strain, 5e-3 * strain, "extrapolated strain energy");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* L = 1, h = 0.05: stretch and shear, which the elastica neglects, are alpha/12 (h/L)^2 and 0.6
   (h/L)^2. */
static PetscErrorCode elastica(const char *law, const char *element, PetscInt n, PetscReal alpha,
                               PetscReal value[2])
{
  const PetscReal h = 0.05;
  const PetscReal E = 1e6;
  Bar bar = {.what = "elastica", .end = {1., 0., h / 2.}};
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-body_a_mesh box:1,0.02,0.05:%d,1,%d -body_a_element %s -body_a_material %s "
    "-body_a_tangent exact -body_a_young %g -body_a_poisson 0 -body_a_density 1 " PLANE
    " -effect_end_vector 0;0;%.17g",
    (int)(20 * n), (int)n, element, law, E, alpha * E * h * h / 12.));
  PetscCall(solve(text, &bar));
  value[0] = -bar.u[0];
  value[1] = bar.u[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P1 extrapolated from two meshes, and P2 with two cells across. */
static PetscErrorCode check_elastica(const char *law, PetscReal alpha, PetscReal shortening,
                                     PetscReal deflection)
{
  const PetscReal exact[2] = {shortening, deflection};
  PetscReal coarse[2], fine[2], quadratic[2], limit[2];

  PetscFunctionBeginUser;
  PetscCall(elastica(law, "p1", 8, alpha, coarse));
  PetscCall(elastica(law, "p1", 16, alpha, fine));
  PetscCall(elastica(law, "p2", 2, alpha, quadratic));
  for (int k = 0; k < 2; k++)
    limit[k] = verify_extrapolate(coarse[k], fine[k], 2.);
  for (int k = 0; k < 2; k++) {
    test_print("  elastica, %s, alpha %g, %s n 8, 16: %.5f %.5f, extrapolated %.5f, P2 n 2: %.5f "
               "(exact %.5f)\n",
               law, alpha, k ? "deflection" : "shortening", coarse[k], fine[k], limit[k],
               quadratic[k], exact[k]);

    /* 1 % of the length: remaining error of the extrapolation, and the finite slenderness */
    SB_CHECK_NEAR(limit[k], exact[k], 0.01 * deflection, k ? "deflection" : "shortening");
    SB_CHECK_NEAR(quadratic[k], exact[k], 0.01 * deflection, "P2");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal w[4], limit;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_hanging());

  /* end load with the parabolic shear of beam theory */
  for (int k = 0; k < 3; k++)
    PetscCall(shear(4 << k, "p1", &w[k]));
  PetscCall(shear(2, "p2", &w[3]));
  limit = verify_extrapolate(w[1], w[2], 2.);
  test_print("  cantilever with end load, n 4, 8, 16: %.5f %.5f %.5f of Timoshenko, extrapolated "
             "%.5f; P2, n 2: %.5f\n",
             w[0], w[1], w[2], limit, w[3]);
  SB_CHECK_NEAR(PetscLog2Real((1. - w[1]) / (1. - w[2])), 2., 0.15, "order of the end deflection");

  /* the clamp keeps the end section plane, beam theory does not: about (h/L)^3 / 10 */
  SB_CHECK_NEAR(limit, 1., 2e-3, "extrapolated deflection / Timoshenko");
  SB_CHECK_NEAR(w[3], 1., 2e-3, "deflection with P2 / Timoshenko");
  PetscCall(check_weight());
  PetscCall(check_elastica("corotated", 1., 0.056433, 0.301721));
  PetscCall(check_elastica("corotated", 2., 0.160642, 0.493457));
  PetscCall(check_elastica("corotated", 4., 0.328941, 0.669964));
  PetscCall(check_elastica("stvk", 4., 0.328941, 0.669964));
  SB_TEST_END();
}
