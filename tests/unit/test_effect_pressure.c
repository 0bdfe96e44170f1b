/*
  Pressure: no resultant and the work -p dV on a closed deformed surface; force on one face; the
  tangent by Taylor remainders on a closed surface and on an open one, with free and fixed boundary;
  symmetry of the matrix; boundaries that are supported, or in symmetry planes, need no boundary
  term; rest normals if requested; every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {{"skin", "boundary"}, {"top", "plane:0,0,1,1"}};

#define P 250.0 /* Pa */

/* Current volume over all ranks, m^3: with nodes at vertices the sum of det / 6 over owned
   cells. */
static PetscErrorCode volume(const Fixture *x, const PetscReal u[], PetscReal *all)
{
  PetscReal sum = 0;
  PetscReal energy, minJ;
  PetscInt ninverted;

  PetscFunctionBeginUser;
  if (!x->space->vertices)
    SbSpaceStrainEnergy(x->space, u, NULL, &energy, &minJ, &ninverted, &sum);
  for (PetscInt cell = 0; x->space->vertices && cell < x->mesh->ncell_owned; cell++) {
    const PetscInt *node = &x->space->cell_node[4 * cell];
    PetscReal p[4][3], e[9];

    for (int a = 0; a < 4; a++)
      for (int i = 0; i < 3; i++)
        p[a][i] = x->space->node_x[3 * node[a] + i] + u[3 * node[a] + i];
    for (int k = 0; k < 9; k++)
      e[k] = p[k / 3 + 1][k % 3] - p[0][k % 3];
    sum += SbMatDet(e) / 6;
  }
  PetscCallMPI(MPI_Allreduce(&sum, all, 1, MPIU_REAL, MPI_SUM, x->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smooth direction w[nnode][3] that depends on the seed; with `rim` zero on the edges of the
   top. */
static void direction(const Fixture *x, PetscReal seed, PetscBool rim, PetscReal w[])
{
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];
    const PetscBool in =
      X[0] > 1e-9 && X[0] < 1 - 1e-9 && X[1] > 1e-9 && X[1] < 1 - 1e-9 ? PETSC_TRUE : PETSC_FALSE;
    const PetscReal one = rim && !in ? 0 : 1;

    for (int c = 0; c < 3; c++)
      w[3 * i + c] =
        one * PetscSinReal(seed + 2 * c + 3 * X[0] - (1 + seed) * X[1] + 5 * X[2] * X[0]);
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

static PetscErrorCode check_closed(Fixture *x, Fixture *serial)
{
  const PetscReal zero[3] = {0, 0, 0};
  const PetscReal h = 0.05;
  SbEffect e, es;
  PetscReal *w, *v, V[4], work;

  PetscFunctionBeginUser;
  PetscCall(effect_create(
    x, "air", "-effect_air_type pressure -effect_air_on skin -effect_air_value 250", &e));
  PetscCall(effect_create(serial, "air", "", &es));
  SB_CHECK(!e->linear && e->steady && e->ops.tangent,
           "a follower load depends on the displacement");
  deform(x, 1);
  deform(serial, 1);
  PetscCall(effect_force(x, e, 0));
  PetscCall(effect_force(serial, es, 0));
  PetscCall(check_resultant(x, zero, zero, P, "pressure all around"));
  PetscCall(check_serial(x, serial, P, "parallel and serial pressure at a node"));

  // V is a cubic polynomial along w: this difference is its exact derivative up to rounding, 1e-16
  // V / h.
  PetscCall(PetscMalloc2(3 * x->space->nnode, &w, 3 * x->space->nnode, &v));
  direction(x, 1, PETSC_FALSE, w);
  for (int k = 0; k < 4; k++) {
    const PetscReal step[] = {h, -h, 2 * h, -2 * h};

    for (PetscInt i = 0; i < 3 * x->space->nnode; i++)
      v[i] = x->u[i] + step[k] * w[i];
    PetscCall(volume(x, v, &V[k]));
  }
  PetscCall(dot(x, x->f, w, &work));
  SB_CHECK_NEAR(work, -P * (8 * (V[0] - V[1]) - (V[2] - V[3])) / (12 * h), 1e-12 * P / h,
                "virtual work is -p dV");
  SB_CHECK(PetscAbsReal(work) > 1, "virtual work %g J shows nothing", work);
  PetscCall(PetscFree2(w, v));
  PetscCall(SbEffectDestroy(&e));
  PetscCall(SbEffectDestroy(&es));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_face(Fixture *x)
{
  const PetscReal F[3] = {0, 0, -3 * P};
  const PetscReal M[3] = {-1.5 * P, 1.5 * P, 0};
  const char *options =
    "-effect_hat_type pressure -effect_hat_on top -effect_hat_value 125*t -effect_hat_time t+1";

  // A rotation by 90 degrees about x maps (x, y, z) to (x, -z, y): the top then faces -y, and its
  // load is along +y at (.5, -1, .5).
  const PetscReal G[3] = {0, 3 * P, 0};
  const PetscReal N[3] = {-1.5 * P, 0, 1.5 * P};
  SbEffect e;

  PetscFunctionBeginUser;

  // At t = 2: 250 Pa, times 3.
  deform(x, 0);
  PetscCall(effect_create(x, "hat", options, &e));
  PetscCall(effect_force(x, e, 2));
  PetscCall(check_resultant(x, F, M, 3 * P, "pressure on the top"));
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];

    x->u[3 * i + 1] = -X[2] - X[1];
    x->u[3 * i + 2] = X[1] - X[2];
  }
  PetscCall(effect_force(x, e, 2));
  PetscCall(check_resultant(x, G, N, 3 * P, "pressure on the turned top"));
  PetscCall(SbEffectDestroy(&e));

  // Not a follower load: on the rotated body it still acts downwards, and is linear.
  PetscCall(effect_create(x, "hat", "-effect_hat_follower no", &e));
  SB_CHECK(e->linear && !e->steady && !e->ops.tangent, "a dead pressure");
  PetscCall(effect_force(x, e, 2));
  deform(x, 0);
  PetscCall(check_resultant(x, F, M, 3 * P, "dead pressure on the top"));
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsClearValue(NULL, "-effect_hat_follower"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A = contribution of the effect to the tangent at x->u. */
static PetscErrorCode tangent(Fixture *x, SbEffect e, PetscReal shift_k, Mat A)
{
  SbStage stage = {.t = 2, .u = x->u}; // no mass, no stiffness: the matrix starts from zero

  PetscFunctionBeginUser;
  PetscCall(SbSpaceAssembleTangent(x->space, &stage, A));
  stage.shift_k = shift_k;
  PetscCall((*e->ops.tangent)(e, x->space, &stage, A));
  PetscCall(SbSpaceFinishTangent(x->space, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  |f(u + h w) - f(u) + h A w| must decrease as h^2: it is -p times a quadratic in h w on facets, so
  the ratio of two steps is 100 up to rounding. Without the tangent it is 10.
*/
static PetscErrorCode check_taylor(Fixture *x, SbEffect e, Mat A, PetscBool rim)
{
  const PetscInt n = x->space->nnode;
  PetscReal *w, *u, *f, *Aw, remainder[2];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(3 * n, &w, 3 * n, &u, 3 * n, &f, 3 * n, &Aw));
  deform(x, 1);
  direction(x, 1, rim, w);
  PetscCall(PetscArraycpy(u, x->u, 3 * n));
  PetscCall(effect_force(x, e, 2));
  PetscCall(PetscArraycpy(f, x->f, 3 * n));
  PetscCall(tangent(x, e, 1, A));
  PetscCall(fixture_apply(x, A, w, Aw));

  // The part that is applied outside the matrix.
  if (e->ops.nonsymmetric) {
    const SbStage stage = {.t = 2, .u = x->u, .shift_k = 1};
    PetscReal *y;

    PetscCall(PetscCalloc1(3 * n, &y));
    PetscCall((*e->ops.nonsymmetric)(e, x->space, &stage, w, y));
    for (PetscInt i = 0; i < 3 * x->space->nnode_owned; i++)
      Aw[i] += y[i];
    PetscCall(PetscFree(y));
  }
  for (int k = 0; k < 2; k++) {
    const PetscReal h = k ? 1e-3 : 1e-2;

    for (PetscInt i = 0; i < 3 * n; i++)
      x->u[i] = u[i] + h * w[i];
    PetscCall(effect_force(x, e, 2));
    for (PetscInt i = 0; i < 3 * x->space->nnode_owned; i++)
      x->f[i] += h * Aw[i] - f[i];

    // With a constrained rim its own rows do not count.
    if (rim)
      for (PetscInt i = 0; i < 3 * x->space->nnode_owned; i++)
        x->f[i] *= w[3 * (i / 3)] == 0 ? 0 : 1;
    PetscCall(dot(x, x->f, x->f, &remainder[k]));
    remainder[k] = PetscSqrtReal(remainder[k]);
  }
  SB_CHECK(remainder[0] > 1e-6, "remainder %g shows nothing", remainder[0]);
  SB_CHECK_NEAR(remainder[0] / remainder[1], 100, 1e-3,
                "Taylor remainder of the pressure, quotient of two steps");
  PetscCall(PetscFree4(w, u, f, Aw));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_tangent(Fixture *x)
{
  const PetscInt n = x->space->nnode;
  SbEffect closed, open;
  Mat A;
  PetscReal *v, *w, *y, a, b;

  PetscFunctionBeginUser;
  PetscCall(SbEffectCreate("air", &closed));
  PetscCall((*closed->ops.setup)(closed, x->space));
  PetscCall(SbEffectCreate("hat", &open));
  PetscCall((*open->ops.setup)(open, x->space));
  PetscCall(SbSpacePrescribeDone(x->space));
  PetscCall(SbSpaceCreateMatrix(x->space, SB_MATRIX_BAIJ, &A));
  PetscCall(check_taylor(x, closed, A, PETSC_FALSE));

  // P1 and P2: the boundary term is outside the matrix; CR and DG: that of the continuous surface
  // is, whose nodes share no cell.
  SB_CHECK(!closed->ops.nonsymmetric && open->ops.nonsymmetric, "what is beside the matrix");
  PetscCall(check_taylor(x, open, A, PETSC_FALSE));
  PetscCall(check_taylor(x, open, A, PETSC_TRUE));

  // The matrix is symmetric also with a free rim, and zero if no stiffness is requested.
  PetscCall(PetscMalloc3(3 * n, &v, 3 * n, &w, 3 * n, &y));
  deform(x, 1);
  direction(x, 1, PETSC_FALSE, v);
  direction(x, 2, PETSC_FALSE, w);
  PetscCall(tangent(x, open, 1, A));
  PetscCall(fixture_apply(x, A, w, y));
  PetscCall(dot(x, v, y, &a));
  PetscCall(fixture_apply(x, A, v, y));
  PetscCall(dot(x, w, y, &b));
  SB_CHECK_NEAR(a, b, 1e-13 * P, "v A w = w A v");
  SB_CHECK(x->space->faces || PetscAbsReal(a) > 1e-3 * P, "v A w = %g shows nothing", a);
  PetscCall(tangent(x, open, 0, A));
  PetscCall(MatNorm(A, NORM_FROBENIUS, &a));
  SB_CHECK_NEAR(a, 0, 0, "tangent of a pure mass matrix");
  PetscCall(PetscFree3(v, w, y));
  PetscCall(MatDestroy(&A));
  PetscCall(SbEffectDestroy(&closed));
  PetscCall(SbEffectDestroy(&open));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rim of the top in symmetry planes, the edge at x = 1 fixed: no boundary term of the tangent is
   left. */
static PetscErrorCode check_rim(Fixture *x)
{
  SbEffect e;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];
    int components = 0;

    if (X[0] < 1e-9)
      components |= 1;
    if (X[1] < 1e-9 || X[1] > 1 - 1e-9)
      components |= 2;
    if (X[0] > 1 - 1e-9)
      components = 7;
    PetscCall(SbSpacePrescribe(x->space, i, components));
  }
  PetscCall(SbEffectCreate("hat", &e));
  PetscCall((*e->ops.setup)(e, x->space));
  SB_CHECK(!e->ops.nonsymmetric == !x->space->faces, "a rim that is held");
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  Fixture x, serial, held;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:3", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(fixture_create(PETSC_COMM_SELF, 1, "box:1,1,1:3", PETSC_STATIC_ARRAY_LENGTH(sets), sets,
                           &serial));
  PetscCall(check_closed(&x, &serial));
  PetscCall(check_face(&x));
  PetscCall(check_tangent(&x));
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:3", PETSC_STATIC_ARRAY_LENGTH(sets),
                           sets, &held));
  PetscCall(check_rim(&held));
  PetscCall(fixture_destroy(&held));
  PetscCall(fixture_destroy(&x));
  PetscCall(fixture_destroy(&serial));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1"));
  PetscCall(check_element("cr"));
  PetscCall(check_element("dg"));
  PetscCall(check_element("p2"));
  SB_TEST_END();
}
