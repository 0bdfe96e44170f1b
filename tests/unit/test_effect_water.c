/*
  Water on a deformed block that the level cuts: the force is minus the derivative of the energy in
  the history, and has no torque about the vertical through the centre of what is wet; the tangent
  by Taylor remainders, of buoyancy with P1, of drag by the velocity with every element; symmetry of
  the matrix; the same on several ranks as on one.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {{"skin", "boundary"}};

#define RHO_G 9810.0 /* N/m^3 */

/* Smooth direction w[nnode][3]. */
static void direction(const Fixture *x, PetscReal seed, PetscReal w[])
{
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];

    for (int c = 0; c < 3; c++)
      w[3 * i + c] = PetscSinReal(seed + 2 * c + 3 * X[0] - (1 + seed) * X[1] + 5 * X[2] * X[0]);
  }
}

static PetscErrorCode dot(const Fixture *x, const PetscReal a[], const PetscReal b[],
                          PetscReal *all)
{
  PetscReal sum = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 3 * x->space->nnode_owned; i++)
    sum += a[i] * b[i];
  PetscCallMPI(MPI_Allreduce(&sum, all, 1, MPIU_REAL, MPI_SUM, x->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A column of the history over all ranks. */
static PetscErrorCode column(Fixture *x, SbEffect e, int which, PetscReal *all)
{
  const SbStage stage = {.u = x->u};
  PetscReal values[6] = {0};

  PetscFunctionBeginUser;
  PetscCall((*e->ops.history)(e, x->space, &stage, NULL, values));
  PetscCallMPI(MPI_Allreduce(&values[which], all, 1, MPIU_REAL, MPI_SUM, x->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A: the effect's part of the tangent at this stage. */
static PetscErrorCode tangent(Fixture *x, SbEffect e, const SbStage *stage, Mat A)
{
  const SbStage none = {.u = stage->u, .v = stage->v};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceAssembleTangent(x->space, &none, A));
  PetscCall((*e->ops.tangent)(e, x->space, stage, A));
  PetscCall(SbSpaceFinishTangent(x->space, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The quotient of |f(h) - f(0) + h A w| for two h, 1e-2 and 1e-3: 100; moved: u or v of the stage,
   from start[]. */
static PetscErrorCode taylor(Fixture *x, SbEffect e, Mat A, const SbStage *stage, PetscReal moved[],
                             PetscReal *quotient)
{
  const PetscInt n = 3 * x->space->nnode;
  PetscReal *w, *f, *g, *Aw, *start, remainder[2];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc5(n, &w, n, &f, n, &g, n, &Aw, n, &start));
  direction(x, 1, w);
  PetscCall(PetscArraycpy(start, moved, n));
  PetscCall(tangent(x, e, stage, A));
  PetscCall(fixture_apply(x, A, w, Aw));
  PetscCall(PetscArrayzero(f, n));
  PetscCall((*e->ops.force)(e, x->space, stage, f));
  for (int k = 0; k < 2; k++) {
    const PetscReal h = k ? 1e-4 : 1e-3;

    for (PetscInt i = 0; i < n; i++)
      moved[i] = start[i] + h * w[i];
    PetscCall(PetscArrayzero(g, n));
    PetscCall((*e->ops.force)(e, x->space, stage, g));
    for (PetscInt i = 0; i < 3 * x->space->nnode_owned; i++)
      g[i] += h * Aw[i] - f[i];
    PetscCall(dot(x, g, g, &remainder[k]));
  }
  PetscCall(PetscArraycpy(moved, start, n));
  SB_CHECK(remainder[0] > 0, "a remainder of 0 shows nothing");
  *quotient = PetscSqrtReal(remainder[0] / remainder[1]);
  PetscCall(PetscFree5(w, f, g, Aw, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_buoyancy(Fixture *x, Fixture *serial, PetscBool quadratic)
{
  const PetscInt n = 3 * x->space->nnode;
  const PetscReal h = 1e-4;
  const SbStage stage = {.u = x->u, .shift_k = 1};
  PetscReal E[2], F[3], M[3], volume, work, quotient, a, b, *w, *u, *y;
  SbEffect e, es;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(effect_create(
    x, "sea", "-effect_sea_type water -effect_sea_on skin -effect_sea_level 0.513", &e));
  PetscCall(effect_create(serial, "sea", "", &es));
  SB_CHECK(!e->linear && e->steady && !e->stiff, "buoyancy depends on the displacement");
  e->dynamic = PETSC_TRUE; /* the history has no load factor */
  deform(x, quadratic ? 0.2 : 1);
  deform(serial, quadratic ? 0.2 : 1);
  PetscCall(effect_force(x, e, 0));
  PetscCall(effect_force(serial, es, 0));
  PetscCall(check_serial(x, serial, RHO_G, "parallel and serial force at a node"));

  /* P1 and P2 have closed surfaces: no force sideways, upwards the weight of the water */
  if (!x->space->faces) {
    PetscCall(column(x, e, 3, &volume));
    PetscCall(resultant(x, F, M));
    SB_CHECK(volume > 0.2 && volume < 0.9, "volume below the level %g", volume);
    SB_CHECK_NEAR(F[0], 0, 1e-5 * RHO_G, "force along x");
    SB_CHECK_NEAR(F[1], 0, 1e-5 * RHO_G, "force along y");
    SB_CHECK_NEAR(F[2], RHO_G * volume, 1e-9 * RHO_G, "buoyancy");
    SB_CHECK_NEAR(M[2], 0, 1e-5 * RHO_G, "moment about the vertical");

    /* the force is minus the derivative of the energy: by differences, error h^2 */
    PetscCall(PetscMalloc3(n, &w, n, &u, n, &y));
    direction(x, 1, w);
    PetscCall(PetscArraycpy(u, x->u, n));
    for (int k = 0; k < 2; k++) {
      for (PetscInt i = 0; i < n; i++)
        x->u[i] = u[i] + (k ? -h : h) * w[i];
      PetscCall(column(x, e, 4, &E[k]));
    }
    PetscCall(PetscArraycpy(x->u, u, n));
    PetscCall(dot(x, x->f, w, &work));
    SB_CHECK(PetscAbsReal(work) > 100, "virtual work %g J shows nothing", work);
    SB_CHECK_NEAR((E[0] - E[1]) / (2 * h), -work, (quadratic ? 1e-4 : 1e-6) * RHO_G,
                  "virtual work is minus the change of the energy");

    /* tangent: exact of P1; of P2 to the quadrature of curved facets */
    PetscCall(SbSpacePrescribeDone(x->space));
    PetscCall(SbSpaceCreateMatrix(x->space, SB_MATRIX_BAIJ, &A));
    PetscCall(taylor(x, e, A, &stage, x->u, &quotient));
    SB_CHECK(quotient > (quadratic ? 50 : 95) && quotient < 105, "Taylor remainder: quotient %g",
             quotient);
    direction(x, 2, u);
    PetscCall(fixture_apply(x, A, w, y));
    PetscCall(dot(x, u, y, &a));
    PetscCall(fixture_apply(x, A, u, y));
    PetscCall(dot(x, w, y, &b));
    SB_CHECK_NEAR(a, b, 1e-11 * RHO_G, "v A w = w A v");
    PetscCall(MatDestroy(&A));
    PetscCall(PetscFree3(w, u, y));
  }
  PetscCall(SbEffectDestroy(&e));
  PetscCall(SbEffectDestroy(&es));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drag on the block at rest that moves with v = (1, 2, 3) m/s through water that goes with (1, 0,
   0) m/s: faces along x have no velocity normal to them. */
static PetscErrorCode check_drag(Fixture *x)
{
  const PetscReal speed = 1000. / 2;
  const PetscReal tangent_speed = PetscSqrtReal(13.);
  PetscReal sum[3], moment[3], quotient, *v;
  SbStage stage = {.u = x->u, .shift_v = 1};
  SbEffect e;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * x->space->nnode, &v));
  PetscCall(PetscArrayzero(x->u, 3 * x->space->nnode));
  PetscCall(PetscArrayzero(x->f, 3 * x->space->nnode));
  for (PetscInt i = 0; i < 3 * x->space->nnode; i++)
    v[i] = 1 + (PetscReal)(i % 3);
  stage.v = v;
  PetscCall(effect_create(x, "wind",
                          "-effect_wind_type water -effect_wind_on skin -effect_wind_drag_normal 2 "
                          "-effect_wind_drag_tangent 0.1 -effect_wind_drag_linear 5 "
                          "-effect_wind_velocity 1;0;0",
                          &e));
  SB_CHECK(e->stiff, "drag is not for explicit integrators");
  PetscCall((*e->ops.force)(e, x->space, &stage, x->f));
  PetscCall(resultant(x, sum, moment));
  SB_CHECK_NEAR(sum[0], 0, 1e-8, "drag along x");
  SB_CHECK_NEAR(sum[1], -2 * speed * (2 * 4 + 0.1 * 2 * (tangent_speed + 2)) - 6 * 5 * 2, 1e-8,
                "drag along y");
  SB_CHECK_NEAR(sum[2], -2 * speed * (2 * 9 + 0.1 * 3 * (tangent_speed + 3)) - 6 * 5 * 3, 1e-8,
                "drag along z");
  PetscCall(SbSpacePrescribeDone(x->space));
  PetscCall(SbSpaceCreateMatrix(x->space, SB_MATRIX_BAIJ, &A));
  deform(x, 0.5);
  PetscCall(taylor(x, e, A, &stage, v, &quotient));
  SB_CHECK(quotient > 90 && quotient < 110, "Taylor remainder of drag: quotient %g", quotient);
  PetscCall(MatDestroy(&A));
  PetscCall(PetscFree(v));
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  Fixture x, serial;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:3", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(fixture_create(PETSC_COMM_SELF, 1, "box:1,1,1:3", PETSC_STATIC_ARRAY_LENGTH(sets), sets,
                           &serial));
  PetscCall(check_buoyancy(&x, &serial, (PetscBool)!strcmp(element, "p2")));
  PetscCall(fixture_destroy(&x));
  PetscCall(fixture_destroy(&serial));
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:3", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(check_drag(&x));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1"));
  PetscCall(check_element("p2"));
  PetscCall(check_element("cr"));
  PetscCall(check_element("dg"));
  SB_TEST_END();
}
