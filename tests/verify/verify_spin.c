// @ranks 1 2
/*
  Rotation.

    turned     a body rotated rigidly in steps of 15 degrees through a full revolution, and
    translated: no force with rotation-invariant
               materials, |f|_max / (E L^2) <= 1e-12, and sigma_xx = 2 (mu + lambda)(cos t - 1)
               about z with the linear one
    spin       a stiff free body that spins about a principal axis, implicit Euler. A step minimises
    the distance to
               x0 + h v0 over rigid motions: its closest rotation. In the plane of the spin x0 + h
               v0 is x0 times the complex number 2 - e^(-i d), d being the rotation of the last
               step, so that the rotations satisfy

                 d' = arg(2 - e^(-i d)),  first one atan(w0 h),

               for small w0 h the law w(t) = w0 / sqrt(1 + 2 w0^2 h t), for any stiffness
    rod        a thin spinning rod stretches by u = rho w^2 l^3 / (3 E) on each side of its centre.
    Stiffness-proportional
               damping removes the vibration, and must not change the spin
*/
#include <complex.h>
#undef I
#include "verify.h"

static const double complex unit = 1.0i;

/* ------------------------------------------------------------------ turned */

/* Largest error of sigma_xx over the cells, relative to 2 (mu + lambda). */
static PetscErrorCode linear_stress(TestScene *t, PetscReal angle, PetscReal *error)
{
  SbSpace s = t->model->space;
  const SbMaterial m = t->model->material[0];
  const PetscReal modulus = 2. * (SbMaterialShearModulus(m) + SbMaterialVolumetricModulus(m));
  const PetscReal *u;
  PetscReal *sigma;

  PetscFunctionBeginUser;
  *error = 0.;
  PetscCall(PetscMalloc1(6 * s->mesh->ncell_owned, &sigma));
  PetscCall(SbSpaceGetLocalRead(s, t->run->state.U, &u));
  SbSpaceCellState(s, u, sigma, NULL, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->state.U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++)
    *error = PetscMax(*error, PetscAbsReal(sigma[6 * c] / modulus - (PetscCosReal(angle) - 1.)));
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, error, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_turned(const char *element, const char *law)
{
  const PetscReal askew[3] = {1., 2., 3.};
  const PetscReal z[3] = {0., 0., 1.};
  const PetscReal E = 1e5;
  const PetscBool linear = (PetscBool)!strcmp(law, "linear");
  PetscReal worst = 0.;
  Vec F;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:1,0.8,0.6:3 -body_a_translate -0.3,-0.2,-0.1 "
                      "-body_a_element %s -body_a_material %s -body_a_young %g -body_a_poisson 0.4 "
                      "-body_a_density 1000",
                      element, law, E));
  PetscCall(VecDuplicate(t.run->state.U, &F));
  for (int k = 1; k <= 24; k++) {
    const PetscReal angle = k * PETSC_PI / 12.;
    PetscReal size;

    PetscCall(verify_turn(&t, linear ? z : askew, angle, (const PetscReal[3]){0.7, -1.3, 0.4}));
    if (linear) {
      PetscCall(linear_stress(&t, angle, &size));
    } else {
      PetscCall(SbModelResidual(t.model, 0., t.run->state.U, NULL, NULL, PETSC_TRUE, F));
      PetscCall(VecNorm(F, NORM_INFINITY, &size));
      size /= E;
    }
    worst = PetscMax(worst, size);
  }
  test_print("  turned through 360 degrees, %s %-10s: %s %.1e\n", element, law,
             linear ? "stress from 2 (mu + lambda)(cos t - 1)" : "largest force / (E L^2)", worst);
  SB_CHECK(worst <= 1e-12, "%s, %s: %g", element, law, worst);
  PetscCall(VecDestroy(&F));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ spin */

/* Reference position of the node nearest to a point: a vertex, or the centroid of a face. */
static PetscErrorCode nearest_node(SbModel m, const PetscReal at[3], PetscReal place[3])
{
  PetscScalar *x;
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(m->space, &X));
  PetscCall(VecGetArray(X, &x));
  PetscCall(PetscArraycpy(x, m->space->node_x, 3 * m->space->nnode_owned));
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(test_value_at(m, X, at, place));
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscReal left[3], right[3]; /* reference positions of two nodes */
  PetscReal last[2], d, w0h,
    worst; /* direction between them, next expected rotation, largest error */
} Spin;

static PetscErrorCode watch_spin(SbRun run, const SbStep *step, void *ctx)
{
  Spin *s = (Spin *)ctx;
  PetscReal a[3], b[3], e[2], turned;

  PetscFunctionBeginUser;
  PetscCall(test_value_at(run->model, step->U, s->left, a));
  PetscCall(test_value_at(run->model, step->U, s->right, b));
  for (int k = 0; k < 2; k++)
    e[k] = s->right[k] + b[k] - s->left[k] - a[k];
  if (step->step > 0) {
    turned =
      PetscAtan2Real(s->last[0] * e[1] - s->last[1] * e[0], s->last[0] * e[0] + s->last[1] * e[1]);
    s->d = step->step == 1 ? PetscAtanReal(s->w0h) : carg(2. - cexp(-unit * s->d));
    s->worst = PetscMax(s->worst, PetscAbsReal(turned / s->d - 1.));
    s->d = turned;
  }
  for (int k = 0; k < 2; k++)
    s->last[k] = e[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_spin(const char *element, const char *law, PetscReal E, PetscReal w0,
                                 PetscReal h, PetscReal tolerance, PetscReal near)
{
  const PetscInt steps = 100;
  const PetscReal wt = w0 / PetscSqrtReal(1. + 2. * w0 * w0 * h * h * (PetscReal)steps);
  const PetscReal left[3] = {-0.15, 0., 0.};
  const PetscReal right[3] = {0.15, 0., 0.};
  Spin s = {.w0h = w0 * h};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_translate -0.15,-0.05,-0.05 -body_a_element "
    "%s "
    "-body_a_material %s -body_a_young %g -body_a_poisson 0.3 -body_a_density 1000 "
    "-body_a_angular_velocity 0,0,%.17g -time euler_implicit -ts_dt %.17g -ts_max_time %.17g "
    "-snes_rtol 1e-10",
    element, law, E, w0, h, h * (PetscReal)steps));
  PetscCall(nearest_node(t.model, left, s.left));
  PetscCall(nearest_node(t.model, right, s.right));
  PetscCall(SbRunAddMonitor(t.run, watch_spin, &s));
  PetscCall(verify_solve(&t, "spin"));
  test_print("  spin, implicit Euler, %s %s, E %g, w0 h %g: turns of %d steps within %.1e of the "
             "recurrence; end %.5f rad/s, law %.5f\n",
             element, law, E, w0 * h, (int)steps, s.worst, s.d / h, wt);
  SB_CHECK(t.run->counters.steps == steps, "%d steps were taken", (int)t.run->counters.steps);
  SB_CHECK(s.worst <= tolerance, "%s, %s, E %g: turns are off by %g", element, law, E, s.worst);
  SB_CHECK_NEAR(s.d / h, wt, near * wt, "w(t)");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ rod */

static PetscErrorCode check_rod(const char *element, const char *law)
{
  const PetscReal w = 2.;
  const PetscReal l = 0.5;
  const PetscReal E = 1e6;
  const PetscReal rho = 1000.;
  const PetscReal stretch = rho * w * w * l * l * l / (3. * E);
  PetscReal left[3] = {-l, 0., 0.};
  PetscReal right[3] = {l, 0., 0.};
  PetscReal a[3], b[3];
  PetscReal longer = 0.;
  PetscReal rest = 0.;
  PetscReal spin;
  SbEnergies before, after;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:1,0.05,0.05:20,2,2 -body_a_translate -0.5,-0.025,-0.025 "
    "-body_a_element %s -body_a_material %s -body_a_young %g -body_a_poisson 0 "
    "-body_a_density %g -body_a_angular_velocity 0,0,%g -effects damping "
    "-effect_damping_beta 0.01 -time newmark -ts_dt 0.002 -ts_max_time 0.4 -snes_rtol 1e-9",
    element, law, E, rho, w));
  PetscCall(nearest_node(t.model, left, left));
  PetscCall(nearest_node(t.model, right, right));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &before));
  PetscCall(verify_solve(&t, "rod"));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &after));
  PetscCall(test_value_at(t.model, t.run->state.U, left, a));
  PetscCall(test_value_at(t.model, t.run->state.U, right, b));
  for (int k = 0; k < 3; k++) {
    rest += PetscSqr(right[k] - left[k]);
    longer += PetscSqr(right[k] + b[k] - left[k] - a[k]);
  }
  longer = PetscSqrtReal(longer) - PetscSqrtReal(rest);
  spin = after.angular[2] / before.angular[2];
  test_print("  rod, %s %s, after %.2f rad: longer by %.5e m on each side (%.5e), angular "
             "momentum %.7f of the start\n",
             element, law, 0.4 * (double)w, 0.5 * longer, stretch, spin);

  /* a strain of 3e-4, and 20 cells, in which the face terms of CR and DG, and the edges of P2, are
     stiff */
  SB_CHECK_NEAR(0.5 * longer, stretch, (strcmp(element, "p1") ? 1e-2 : 5e-3) * stretch,
                "stretch of the rod");
  SB_CHECK_NEAR(spin, 1., 1e-4, "angular momentum with damping");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  static const char *const laws[] = {"corotated", "stvk", "stable_neohookean", "linear"};

  SB_TEST_BEGIN(argc, argv);
  for (int e = 0; e < 4; e++) {
    for (int law = 0; law < 4; law++)
      PetscCall(check_turned(elements[e], laws[law]));
    PetscCall(check_spin(elements[e], "corotated", 1e9, 10., 0.01, 1e-6, 0.02));
  }
  PetscCall(check_spin("p1", "corotated", 1e11, 10., 0.01, 1e-8, 0.02));
  PetscCall(check_spin("p1", "stvk", 1e9, 10., 0.01, 1e-6, 0.02));
  PetscCall(check_spin("p1", "stable_neohookean", 1e9, 10., 0.01, 1e-6, 0.02));
  PetscCall(check_spin("p1", "corotated", 1e9, 100., 0.01, 1e-3, 1.));
  PetscCall(check_rod("p1", "corotated"));
  PetscCall(check_rod("p1", "stvk"));
  PetscCall(check_rod("p1", "stable_neohookean"));
  PetscCall(check_rod("cr", "corotated"));
  PetscCall(check_rod("dg", "stable_neohookean"));
  PetscCall(check_rod("p2", "stvk"));
  SB_TEST_END();
}
