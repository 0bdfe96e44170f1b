// @ranks 1 2 3 4
/* The interface uncouples the interiors of the ranks with few nodes; what it solves is the sum over
   ranks, as a dense solve does. */
#include "sbfactor.h"
#include "../scene.h"
#include <petscblaslapack.h>

static const char *const scene =
  "-bodies a,b -body_a_mesh box:1,0.5,0.4:6,3,3 -body_a_material linear -body_a_young 1e3 "
  "-body_a_poisson 0.3 -body_a_density 10 -body_b_mesh box:0.3,0.5,0.4:2 -body_b_translate 0,0,2 "
  "-body_b_material linear -body_b_young 2e3 -body_b_poisson 0.4 -body_b_density 7 -sets low "
  "-set_low_at plane:0,0,1,0 -effects clamp -effect_clamp_type fixed -effect_clamp_on low";

static PetscErrorCode check_structure(SbSpace s, SbInterface f, PetscInt *mine)
{
  PetscInt lost = 0;
  PetscInt out_of_range = 0;
  PetscInt lower = 0;
  PetscInt size, most;

  PetscFunctionBeginUser;
  *mine = 0;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    *mine += f->index[i] >= 0;
    for (PetscInt k = s->plan->oi[i]; k < s->plan->oi[i + 1] && f->index[i] < 0 && s->fixed[i] != 7;
         k++) {
      /* neighbours of an interior node on other ranks are in the interface, or fixed */
      if (f->index[s->plan->oj[k]] < 0 && s->fixed[s->plan->oj[k]] != 7)
        lost++;
    }
  }

  /* bound: all nodes adjacent to a lower rank */
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscBool touches = PETSC_FALSE;

    for (PetscInt k = s->plan->oi[i]; k < s->plan->oi[i + 1]; k++)
      touches = (PetscBool)(touches || (s->gnode[s->plan->oj[k]] < s->gnode_start &&
                                        s->fixed[s->plan->oj[k]] != 7));
    lower += touches && s->fixed[i] != 7;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lower, 1, MPIU_INT, MPI_SUM, s->comm));
  SB_CHECK(f->n <= lower, "%" PetscInt_FMT " nodes where %" PetscInt_FMT " touch a lower rank",
           f->n, lower);
  PetscCall(SbSpaceInterfaceSize(s, &size, &most));
  SB_CHECK(size == f->n && most == 1500,
           "%" PetscInt_FMT " nodes, told %" PetscInt_FMT " of %" PetscInt_FMT, f->n, size, most);
  for (PetscInt i = 0; i < s->nnode; i++)
    out_of_range += f->index[i] >= f->n;
  SB_CHECK(lost == 0, "%" PetscInt_FMT " interior nodes touch the interior of another rank", lost);
  SB_CHECK(out_of_range == 0 && *mine == f->nmine, "%" PetscInt_FMT " numbers out of range",
           out_of_range);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Share of a rank in exp(-|i - j| / 20) + (i == j) / 20, condition number about 800; the shares are
   unequal. */
static void fill(PetscMPIInt rank, PetscMPIInt size, PetscInt n, PetscReal S[])
{
  const PetscReal share = 2. * (rank + 1) / ((PetscReal)size * (size + 1));

  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = j; i < n; i++)
      S[(size_t)j * (size_t)n + (size_t)i] =
        share * (PetscExpReal(-(PetscReal)(i - j) / 20.) + (i == j ? 0.05 : 0.));
  }
}

int main(int argc, char **argv)
{
  TestScene t;
  SbSpace s;
  SbInterface f;
  PetscInt mine, all, n;
  PetscReal *schur, *dense, *expected;
  PetscReal worst = 0.;
  PetscReal largest = 0.;
  PetscInt64 bytes, sum, most;
  PetscBool ok;
  float *x;
  Mat A;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_scene_open(scene, &t));
  s = t.model->space;
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A)); /* makes the graph */
  PetscCall(SbInterfaceCreate(s, &f));
  PetscCall(check_structure(s, f, &mine));
  PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(all == f->n, "%" PetscInt_FMT " nodes of %" PetscInt_FMT, all, f->n);
  SB_CHECK(test_size == 1 ? f->n == 0 : f->n > 0, "%" PetscInt_FMT " nodes on %d ranks", f->n,
           (int)test_size);

  n = 3 * f->n;
  PetscCall(PetscCalloc2((size_t)n * (size_t)n, &schur, (size_t)n * (size_t)n, &dense));
  PetscCall(PetscMalloc2(n, &x, n, &expected));
  fill(test_rank, test_size, n, schur);
  fill(0, 1, n, dense);
  for (PetscInt j = 0; j < n; j++) {
    expected[j] = PetscSinReal((PetscReal)j);
    x[j] = (float)(expected[j] * (test_rank == 0 ? 1.5 : -0.5 / (test_size - 1)));
  }
  if (n) {
    PetscBLASInt order;
    PetscBLASInt one = 1;
    PetscBLASInt info;

    PetscCall(PetscBLASIntCast(n, &order));
    PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &order, dense, &order, &info));
    PetscCallBLAS("LAPACKpotrs",
                  LAPACKpotrs_("L", &order, &one, dense, &order, expected, &order, &info));
  }
  PetscCall(SbInterfaceFactorise(f, 0, schur, &ok));
  SB_CHECK(ok, "not positive definite");
  PetscCall(SbInterfaceSolve(f, x));
  for (PetscInt j = 0; j < n; j++) {
    worst = PetscMax(worst, PetscAbsReal(expected[j] - x[j]));
    largest = PetscMax(largest, PetscAbsReal(expected[j]));
  }

  /* entries are rounded to 1.5e-5 of the largest one of their row */
  SB_CHECK(worst <= 5e-4 * largest, "off by %g of %g", worst, largest);

  /* the triangle in 16-bit integers, in blocks of 48 rows with columns padded to 32, evenly
     distributed */
  bytes = (PetscInt64)(sizeof(*f->word) * f->nword);
  PetscCallMPI(MPI_Allreduce(&bytes, &sum, 1, MPIU_INT64, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(&bytes, &most, 1, MPIU_INT64, MPI_MAX, PETSC_COMM_WORLD));
  SB_CHECK(sum >= n * (n + 1) && sum <= n * (n + 112),
           "%" PetscInt64_FMT " bytes for %" PetscInt_FMT " rows", sum, n);
  SB_CHECK(n < 48 * test_size || (PetscReal)most <= 1.5 * (PetscReal)sum / test_size,
           "%" PetscInt64_FMT " of %" PetscInt64_FMT " bytes on one rank", most, sum);

  /* a rank with much other work gets no share */
  fill(test_rank, test_size, n, schur);
  PetscCall(SbInterfaceFactorise(f, test_rank == 0 ? 1000000000 : 0, schur, &ok));
  SB_CHECK(ok && (test_rank || !f->nword), "%zu words on the busy rank", f->nword);

  /* zero, and a matrix that is indefinite in its last entry only */
  PetscCall(PetscArrayzero(schur, (size_t)n * (size_t)n));
  PetscCall(SbInterfaceFactorise(f, 0, schur, &ok));
  SB_CHECK(ok == (n == 0), "a singular matrix was factored");
  fill(test_rank, test_size, n, schur);
  if (n && test_rank == 0)
    schur[(size_t)n * (size_t)n - 1] = -100.;
  PetscCall(SbInterfaceFactorise(f, 0, schur, &ok));
  SB_CHECK(ok == (n == 0), "an indefinite matrix was factored");
  PetscCall(PetscFree2(schur, dense));
  PetscCall(PetscFree2(x, expected));
  PetscCall(SbInterfaceDestroy(&f));
  SB_CHECK(f == NULL, "destroy leaves a pointer");
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&t));
  SB_TEST_END();
}
