// @ranks 1
/*
  A cushion between two plates that both move, until it is half as high; quarter of it, planes of symmetry x = 0 and y = 0, no friction.

  Both plates push alike, the force rises in every step, no cell is inverted, and nothing moves up or down in the middle. The work of
  the plates is the energy that the cushion has taken. With Poisson's ratio 0.49 the volume hardly changes.
  With P1, x itself is an
  admissible test function: the integral of the trace of the stress is the sum of x . f, which is minus the height times the force.
*/
#include "contact.h"

#define RADIUS 0.05 /* m */
#define STEPS 20

/* A quarter of a block with bulging top and bottom, so that contact begins in the middle. */
static void cushion(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  (void)n;
  (void)at;
  (void)ctx;
  x[2] = (2 * x[2] - 1) * (1 - 0.15 * (x[0] * x[0] + x[1] * x[1]));
  for (int k = 0; k < 3; k++) x[k] *= RADIUS;
}

typedef struct {
  PetscReal force[2];      /* of the plates in the last step, z, N */
  PetscReal last;          /* of the upper one in the step before, N */
  PetscReal apart;         /* largest sum of both as a part of the force */
  PetscReal drift;         /* of the centre of mass, z, m */
  PetscReal behind, min_J; /* m */
  PetscReal volume;        /* at rest, m^3 */
  PetscReal fall;          /* largest loss of force in a step, N */
  PetscReal contacts[2];   /* at the end */
} Squeeze;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  static const char *const plates[2] = {"top", "bottom"};
  Squeeze *s = (Squeeze *)ctx;

  PetscFunctionBeginUser;
  if (step->step == 0) {
    s->volume = step->energies.volume;
    s->min_J = 1;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int k = 0; k < 2; k++) {
    PetscReal behind;

    PetscCall(contact_column(run, step->t, plates[k], "force_z", &s->force[k]));
    PetscCall(contact_column(run, step->t, plates[k], "contacts", &s->contacts[k]));
    PetscCall(contact_column(run, step->t, plates[k], "penetration", &behind));
    s->behind = PetscMax(s->behind, behind);
  }
  s->fall = PetscMax(s->fall, s->last + s->force[0]);
  s->last = -s->force[0];
  s->apart = PetscMax(s->apart, PetscAbsReal(s->force[0] + s->force[1]) / s->last);
  s->drift = PetscMax(s->drift, PetscAbsReal(step->energies.centre[2]));
  s->min_J = PetscMin(s->min_J, step->energies.min_J);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integral of the trace of the Cauchy stress over the deformed body, N m. */
static PetscErrorCode stress_trace(TestScene *t, PetscReal *integral)
{
  SbSpace s = t->model->space;
  PetscReal *sigma, *J;
  const PetscReal *u;

  PetscFunctionBeginUser;
  *integral = 0;
  PetscCall(PetscMalloc2(6 * s->mesh->ncell_owned, &sigma, s->mesh->ncell_owned, &J));
  PetscCall(SbSpaceGetLocalRead(s, t->run->U, &u));
  PetscCall(SbSpaceCellState(s, u, sigma, J, NULL));
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    const PetscReal *x[4];
    PetscReal e[3][3], cross[3];

    for (int a = 0; a < 4; a++) x[a] = s->mesh->x + 3 * s->mesh->cell[4 * c + a];
    for (int a = 0; a < 3; a++) {
      for (int k = 0; k < 3; k++) e[a][k] = x[a + 1][k] - x[0][k];
    }
    SbCross(e[0], e[1], cross);
    *integral += (sigma[6 * c] + sigma[6 * c + 1] + sigma[6 * c + 2]) * J[c] * SbDot3(cross, e[2]) / 6;
  }
  PetscCall(PetscFree2(sigma, J));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, integral, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_squeeze(const char *element, PetscInt cells, PetscReal poisson, PetscReal swell)
{
  const PetscInt n[3] = {cells, cells, 2 * cells};
  const PetscReal young = 1e4;
  Squeeze s = {.last = 0};
  PetscReal trace, virial, lost, account;
  char path[512];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, cushion, NULL, path));
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material neohookean "
    "-body_a_young %g -body_a_poisson %g "
    "-sets x0,y0 -set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -effects x,y,top,bottom -effect_x_type "
    "fixed "
    "-effect_x_on x0 -effect_x_components x -effect_y_type fixed -effect_y_on y0 -effect_y_components y "
    "-effect_top_type contact -effect_top_obstacle plane:0,0,-1,%g -effect_top_displacement 0;0;%g*t "
    "-effect_bottom_type contact -effect_bottom_obstacle plane:0,0,1,%g -effect_bottom_displacement 0;0;%g*t "
    "-time static -static_steps %d -snes_rtol 1e-8 -ksp_rtol 1e-8",
    path, element, (double)young, (double)poisson, -RADIUS, -0.5 * RADIUS, -RADIUS, 0.5 * RADIUS, STEPS));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &s, NULL));
  PetscCall(verify_solve(&t, "squeeze"));
  PetscCall(stress_trace(&t, &trace));
  virial = s.force[0] * RADIUS / trace; /* it is RADIUS high now */
  lost = 1 - t.run->energies.volume / s.volume;
  account = t.run->energies.prescribed_work / t.run->energies.strain;
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  squeeze, %s, nu %g: %g and %g contacts, force %.4f N, both plates to %.1e of it, it fell by %.1e of "
    "it at most; centre moved by %.1e m; volume lost %.3f %%\n",
    element, (double)poisson, (double)s.contacts[0], (double)s.contacts[1], (double)s.last, (double)s.apart,
    (double)(s.fall / s.last), (double)s.drift, (double)(100 * lost)));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  work of the plates %.4f of the energy, height times force %.7f of the trace, penetration %.1e m, "
    "min J %.3f, %d solves in %d steps, %d cut\n",
    (double)account, (double)virial, (double)s.behind, (double)s.min_J, (int)t.run->newton_total,
    (int)t.run->steps_total, (int)t.run->rejected_total));
  SB_CHECK(s.apart < 1e-6, "%s: the plates push with forces that differ by %g", element, (double)s.apart);
  SB_CHECK(s.fall < 2e-3 * s.last, "%s: the force fell by %g N", element, (double)s.fall);
  SB_CHECK(s.contacts[0] == s.contacts[1] && s.contacts[0] > 10, "%s: %g and %g nodes touch", element,
           (double)s.contacts[0], (double)s.contacts[1]);
  SB_CHECK(s.drift < 1e-7 * RADIUS, "%s: the centre moved by %g m", element, (double)s.drift);
  SB_CHECK(s.min_J > 0, "%s: det F %g", element, (double)s.min_J);
  SB_CHECK(s.behind < 1e-6 * RADIUS, "%s: penetration %g m", element, (double)s.behind);
  SB_CHECK(PetscAbsReal(lost) < swell, "%s, nu %g: the volume changed by %g", element, (double)poisson,
           (double)lost);
  SB_CHECK_NEAR(account, 1, 0.02, "work of the plates against the energy");
  if (!strcmp(element, "p1"))
    SB_CHECK_NEAR(virial, 1, 1e-6, "height times force against the trace of the stress");
  PetscCall(test_scene_close(&t));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_squeeze("p1", 4, 0.3, 0.35));
  PetscCall(check_squeeze("cr", 3, 0.49, 0.012));
  SB_TEST_END();
}
