/*
  Negative eigenvalues of K = H D H, H a reflection, D a diagonal: their number for several D, with
  M = I and with M near K; the lowest mode; zero is not negative; equal eigenvalues are counted
  each; a K with many eigenvalues close to each other; an M that is not definite is noticed.
*/
#include "sbsolver.h"
#include "test.h"

#define N 240

typedef struct {
  Vec D, M, h, w; /* D; diagonal of M = H M H; unit vector of the reflection; work */
} Matrix;

/* y = H x */
static PetscErrorCode reflect(const Matrix *m, Vec x, Vec y)
{
  PetscScalar part;

  PetscFunctionBeginUser;
  PetscCall(VecDot(m->h, x, &part));
  PetscCall(VecWAXPY(y, -2. * part, m->h, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode multiply(void *ctx, Vec x, Vec y)
{
  const Matrix *m = (const Matrix *)ctx;

  PetscFunctionBeginUser;
  PetscCall(reflect(m, x, m->w));
  PetscCall(VecPointwiseMult(m->w, m->w, m->D));
  PetscCall(reflect(m, m->w, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(void *ctx, Vec r, Vec z)
{
  const Matrix *m = (const Matrix *)ctx;

  PetscFunctionBeginUser;
  PetscCall(reflect(m, r, m->w));
  PetscCall(VecPointwiseDivide(m->w, m->w, m->M));
  PetscCall(reflect(m, m->w, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode start(void *ctx, PetscInt k, Vec r)
{
  PetscInt first, end;

  PetscFunctionBeginUser;
  (void)ctx;
  PetscCall(VecGetOwnershipRange(r, &first, &end));
  for (PetscInt i = first; i < end; i++)
    PetscCall(VecSetValue(r, i, PetscCosReal((PetscReal)i * (3. * (PetscReal)i + (PetscReal)k)),
                          INSERT_VALUES));
  PetscCall(VecAssemblyBegin(r));
  PetscCall(VecAssemblyEnd(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lowest[n]: the first eigenvalues, the others from 1 to `last`; sign: of M. near: M = |K|. */
static PetscErrorCode check(PetscInt n, const PetscReal lowest[], PetscReal last, PetscBool near,
                            PetscReal sign, PetscInt most, PetscInt negative)
{
  Matrix m;
  SbPencil pencil = {multiply, solve, start, &m};
  SbInertia found;
  Vec scale, mode;
  PetscReal size, along;
  PetscInt first, end;

  PetscFunctionBeginUser;
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, N, &m.D));
  PetscCall(VecDuplicate(m.D, &m.M));
  PetscCall(VecDuplicate(m.D, &m.h));
  PetscCall(VecDuplicate(m.D, &m.w));
  PetscCall(VecDuplicate(m.D, &scale));
  PetscCall(VecDuplicate(m.D, &mode));
  PetscCall(VecGetOwnershipRange(m.D, &first, &end));
  for (PetscInt i = first; i < end; i++) {
    const PetscReal value = i < n ? lowest[i] : 1. + (last - 1.) * (PetscReal)i / N;

    PetscCall(VecSetValue(m.D, i, value, INSERT_VALUES));
    PetscCall(
      VecSetValue(m.M, i, sign * (near ? PetscMax(PetscAbsReal(value), 0.5) : 1.), INSERT_VALUES));
    PetscCall(VecSetValue(m.h, i, PetscSinReal(1. + (PetscReal)i), INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(m.D));
  PetscCall(VecAssemblyEnd(m.D));
  PetscCall(VecAssemblyBegin(m.M));
  PetscCall(VecAssemblyEnd(m.M));
  PetscCall(VecAssemblyBegin(m.h));
  PetscCall(VecAssemblyEnd(m.h));
  PetscCall(VecNormalize(m.h, NULL));
  PetscCall(VecSet(scale, last));
  PetscCall(SbNegativeModes(&pencil, scale, most, mode, &found));
  test_print("  %d lowest, others to %g: %d negative, %d solves\n", (int)n, (double)last,
             (int)found.negative, (int)found.solves);
  SB_CHECK(found.definite == (sign > 0.), "definite");
  if (sign > 0.) {
    SB_CHECK(found.known, "not known");
    SB_CHECK(found.negative == PetscMin(negative, most), "%d negative", (int)found.negative);
    SB_CHECK(found.more == (negative >= most), "more");
  }
  if (sign > 0. && negative) {
    /* the mode of the lowest eigenvalue of K, or with M near K of any of the negative ones, which
       are alike for the pencil */
    PetscCall(VecNorm(mode, NORM_2, &size));
    PetscCall(reflect(&m, mode, m.w));
    PetscCall(VecPointwiseMult(scale, m.w, m.D));
    PetscCall(VecDot(scale, m.w, &along));
    along /= size * size;
    SB_CHECK(along < 0., "x . K x = %g", (double)along);
    SB_CHECK(near || PetscAbsReal(along / lowest[0] - 1.) < 0.02, "lowest eigenvalue %g",
             (double)along);
  }
  for (Vec *v[] = {&m.D, &m.M, &m.h, &m.w, &scale, &mode, NULL}, **at = v; *at; at++)
    PetscCall(VecDestroy(*at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const PetscReal three[] = {-3., -1., -0.2, 0.3};
  static const PetscReal equal[] = {-3., -3., -1., -1., -1.};
  static const PetscReal small[] = {-1e-5, 1e-3};
  static const PetscReal zero[] = {0., 0.5};
  static const PetscReal positive[] = {1e-4, 0.5};

  SB_TEST_BEGIN(argc, argv);
  for (int near = 0; near < 2; near++) {
    const PetscReal last = near ? 1e6 : 50.;

    PetscCall(check(4, three, last, (PetscBool)near, 1., 6, 3));
    PetscCall(check(4, three, last, (PetscBool)near, 1., 2, 3));
    PetscCall(check(5, equal, last, (PetscBool)near, 1., 6, 5));
    PetscCall(check(2, small, last, (PetscBool)near, 1., 6, 1));
    PetscCall(check(2, zero, last, (PetscBool)near, 1., 6, 0));
    PetscCall(check(2, positive, last, (PetscBool)near, 1., 6, 0));
    PetscCall(check(4, three, last, (PetscBool)near, -1., 6, 3));
  }
  PetscCall(check(0, NULL, 1., PETSC_FALSE, 1., 6, 0));
  SB_TEST_END();
}
