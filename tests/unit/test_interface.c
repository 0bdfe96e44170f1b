// @ranks 1 2 3 4
/* The interface uncouples the interiors of the ranks; its inverse is that of the sum over ranks. */
#include "../../src/fem/rotated.h"
#include "../scene.h"

static const char *const scene = "-bodies a,b -body_a_mesh box:1,0.5,0.4:6,3,3 -body_a_material linear "
                                 "-body_a_young 1e3 -body_a_poisson 0.3 -body_a_density 10 "
                                 "-body_b_mesh box:0.3,0.5,0.4:2 -body_b_translate 0,0,2 -body_b_material "
                                 "linear -body_b_young 2e3 -body_b_poisson 0.4 "
                                 "-body_b_density 7 -sets low -set_low_at plane:0,0,1,0 -effects clamp "
                                 "-effect_clamp_type support -effect_clamp_on low";

static void check_structure(SbSpace s, SbInterface f, PetscInt *mine)
{
  PetscInt lost = 0, out_of_range = 0;

  *mine = 0;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    *mine += f->index[i] >= 0;
    for (PetscInt k = s->plan->oi[i]; k < s->plan->oi[i + 1] && f->index[i] < 0 && s->fixed[i] != 7; k++) {
      /* an interior node's neighbours elsewhere are on the interface, or held */
      if (f->index[s->plan->oj[k]] < 0 && s->fixed[s->plan->oj[k]] != 7) lost++;
    }
  }
  for (PetscInt i = 0; i < s->nnode; i++) out_of_range += f->index[i] >= f->n;
  SB_CHECK(lost == 0, "%" PetscInt_FMT " interior nodes touch the interior of another rank", lost);
  SB_CHECK(out_of_range == 0 && *mine == f->nmine, "%" PetscInt_FMT " numbers out of range", out_of_range);
}

int main(int argc, char **argv)
{
  TestScene t;
  SbSpace s;
  SbInterface f;
  PetscInt mine, all, n;
  PetscMPIInt size, rank;
  PetscReal *schur, worst = 0.;
  PetscBool ok;
  float *x;
  Mat A;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(test_scene_open(scene, &t));
  s = t.model->space;
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A)); /* makes the graph */
  PetscCall(SbInterfaceCreate(s, &f));
  check_structure(s, f, &mine);
  PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(all == f->n, "%" PetscInt_FMT " nodes of %" PetscInt_FMT, all, f->n);
  SB_CHECK(size == 1 ? f->n == 0 : f->n > 0, "%" PetscInt_FMT " nodes on %d ranks", f->n, (int)size);

  /* every rank gives (tridiagonal + (rank + 1) I) / size: the sum over ranks is known */
  n = 3 * f->n;
  PetscCall(PetscCalloc1((size_t)n * (size_t)n, &schur));
  PetscCall(PetscMalloc1(n, &x));
  for (PetscInt j = 0; j < n; j++) {
    schur[j * n + j] = 2. + (PetscReal)(rank + 1) / size;
    if (j + 1 < n) schur[j * n + j + 1] = -1.;
    schur[j * n + j] /= size;
    if (j + 1 < n) schur[j * n + j + 1] /= size;
    x[j] = rank == 0 ? (float)PetscSinReal((PetscReal)j) : 0.f;
  }
  PetscCall(SbInterfaceInvert(f, schur, &ok));
  SB_CHECK(ok, "not positive definite");
  PetscCall(SbInterfaceSolve(f, x));
  for (PetscInt j = 0; j < n; j++) {
    /* sum of (rank + 1) / size, divided by size once more */
    const PetscReal diagonal = 2. + 0.5 * (size + 1.) / size;
    const PetscReal b = diagonal * x[j] - (j ? x[j - 1] : 0.f) - (j + 1 < n ? x[j + 1] : 0.f);

    worst = PetscMax(worst, PetscAbsReal(b - PetscSinReal((PetscReal)j)));
  }
  SB_CHECK(worst < 1e-5, "residual %g", (double)worst);
  PetscCall(PetscArrayzero(schur, (size_t)n * (size_t)n));
  PetscCall(SbInterfaceInvert(f, schur, &ok));
  SB_CHECK(ok == (n == 0), "a singular matrix was inverted");
  PetscCall(PetscFree(schur));
  PetscCall(PetscFree(x));
  PetscCall(SbInterfaceDestroy(&f));
  SB_CHECK(f == NULL, "destroy leaves a pointer");
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&t));
  SB_TEST_END();
}
