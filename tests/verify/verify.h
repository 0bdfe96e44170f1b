/*
  verify.h - common functions of the verification programs: scenes, boxes with perturbed vertices,
  3x3 algebra, Richardson extrapolation.
*/
#pragma once
#include "../file.h"
#include "../scene.h"

#define VERIFY_TEXT TEST_TEXT

/* Vertex at[3] = 0..n of a box with n[3] cells, and its map; x is the point of the unit cube on
   entry. */
typedef struct {
  PetscInt n[3], at[3];
  void *ctx;
} VerifyPlace;
typedef void (*VerifyMap)(const VerifyPlace *place, PetscReal x[3]);

static inline PetscInt verify_vertex(const PetscInt n[3], const PetscInt at[3])
{
  return (at[2] * (n[1] + 1) + at[1]) * (n[0] + 1) + at[0];
}

/* Vertices of tet w = 0..5 of the cell c[3]: six around a diagonal, mirrored between adjacent cells
   as in a box: mesh. */
static inline void verify_tet(const PetscInt n[3], const PetscInt c[3], int w, PetscInt vertex[4])
{
  static const int ways[6][4] = {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7},
                                 {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 4, 6, 7}};
  const int mirror = (int)((c[0] & 1) | (c[1] & 1) << 1 | (c[2] & 1) << 2);
  const PetscBool swap =
    (PetscBool)(((c[0] + c[1] + c[2]) & 1) ^ (w >= 3)); /* for positive orientation */

  for (int a = 0; a < 4; a++) {
    const int corner = ways[w][swap && a >= 2 ? 5 - a : a] ^ mirror;
    const PetscInt at[3] = {c[0] + (corner & 1), c[1] + (corner >> 1 & 1), c[2] + (corner >> 2)};

    vertex[a] = verify_vertex(n, at);
  }
}

static inline void verify_write_cells(FILE *f, const PetscInt n[3])
{
  PetscInt c[3], v[4];
  PetscInt count = 0;

  for (c[2] = 0; c[2] < n[2]; c[2]++) {
    for (c[1] = 0; c[1] < n[1]; c[1]++) {
      for (c[0] = 0; c[0] < n[0]; c[0]++) {
        for (int w = 0; w < 6; w++) {
          verify_tet(n, c, w, v);
          fprintf(f, "%d 4 2 0 1 %d %d %d %d\n", (int)++count, (int)v[0] + 1, (int)v[1] + 1,
                  (int)v[2] + 1, (int)v[3] + 1);
        }
      }
    }
  }
}

/*
  A box of n[0] x n[1] x n[2] cells with its vertices where `map` puts them, as a gmsh file in the
  folder for temporary files. Collective; the path is the same on all ranks, rank 0 writes.
*/
static inline PetscErrorCode verify_mesh_write(const PetscInt n[3], VerifyMap map, void *ctx,
                                               char path[512])
{
  VerifyPlace p = {.n = {n[0], n[1], n[2]}, .ctx = ctx};
  PetscInt *at = p.at;
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &f));
  if (f) {
    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n",
            (int)((n[0] + 1) * (n[1] + 1) * (n[2] + 1)));
    for (at[2] = 0; at[2] <= n[2]; at[2]++) {
      for (at[1] = 0; at[1] <= n[1]; at[1]++) {
        for (at[0] = 0; at[0] <= n[0]; at[0]++) {
          PetscReal x[3];

          for (int k = 0; k < 3; k++)
            x[k] = (PetscReal)at[k] / (PetscReal)n[k];
          map(&p, x);
          fprintf(f, "%d %.17g %.17g %.17g\n", (int)verify_vertex(n, at) + 1, x[0], x[1], x[2]);
        }
      }
    }
    fprintf(f, "$EndNodes\n$Elements\n%d\n", (int)(6 * n[0] * n[1] * n[2]));
    verify_write_cells(f, n);
    fprintf(f, "$EndElements\n");
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Upper bound of SbSpace.node_orig: vertices; with nodes at faces or edges also four per cell,
   their supports, and six. */
static inline PetscInt verify_numbers(SbModel m)
{
  return m->mesh->Nvert + (m->space->faces || m->space->edge_node ? 14 * m->mesh->Ncell : 0);
}

/*
  A vector of the run by the number of each node that no partition changes, on every rank:
  [verify_numbers()][3], zero at numbers without a node; the caller frees it with PetscFree().
*/
static inline PetscErrorCode verify_gather(SbModel m, Vec U, PetscReal **value)
{
  const SbSpace s = m->space;
  const PetscInt n = verify_numbers(m);
  const PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * n, value));
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    for (int k = 0; k < 3; k++)
      (*value)[3 * s->node_orig[i] + k] = u[3 * i + k];
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, *value, (PetscMPIInt)(3 * n), MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest difference of two arrays, relative to the largest value of the first. */
static inline PetscReal verify_difference(PetscInt n, const PetscReal a[], const PetscReal b[])
{
  PetscReal size = 0.;
  PetscReal difference = 0.;

  for (PetscInt i = 0; i < n; i++) {
    size = PetscMax(size, PetscAbsReal(a[i]));
    difference = PetscMax(difference, PetscAbsReal(a[i] - b[i]));
    if (PetscIsInfOrNanReal(b[i]))
      return PETSC_MAX_REAL;
  }
  return difference / size;
}

/* Rotation by an angle (rad) about an axis, row by row (Rodrigues). */
static inline void verify_rotation(const PetscReal axis[3], PetscReal angle, PetscReal R[9])
{
  const PetscReal length = PetscSqrtReal(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  const PetscReal k[3] = {axis[0] / length, axis[1] / length, axis[2] / length};
  const PetscReal s = PetscSinReal(angle),
                  c = 2. * PetscSqr(PetscSinReal(0.5 * angle)); /* 1 - cos */
  const PetscReal K[9] = {0., -k[2], k[1], k[2], 0., -k[0], -k[1], k[0], 0.};

  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      PetscReal K2 = 0.;

      for (int m = 0; m < 3; m++)
        K2 += K[3 * i + m] * K[3 * m + j];
      R[3 * i + j] = (i == j) + s * K[3 * i + j] + c * K2;
    }
  }
}

static inline void verify_apply(const PetscReal A[9], const PetscReal x[3], PetscReal y[3])
{
  for (int i = 0; i < 3; i++)
    y[i] = A[3 * i] * x[0] + A[3 * i + 1] * x[1] + A[3 * i + 2] * x[2];
}

/* Sets the displacement of a rigid rotation and translation. */
static inline PetscErrorCode verify_turn(TestScene *t, const PetscReal axis[3], PetscReal angle,
                                         const PetscReal moved[3])
{
  const SbSpace s = t->model->space;
  PetscReal R[9];
  PetscScalar *u;

  PetscFunctionBeginUser;
  verify_rotation(axis, angle, R);
  PetscCall(VecGetArray(t->run->state.U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    verify_apply(R, s->node_x + 3 * i, u + 3 * i);
    for (int k = 0; k < 3; k++)
      u[3 * i + k] += moved[k] - s->node_x[3 * i + k];
  }
  PetscCall(VecRestoreArray(t->run->state.U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Richardson extrapolation of two values, the second with half the mesh size, error of the given
   order. */
static inline PetscReal verify_extrapolate(PetscReal coarse, PetscReal fine, PetscReal order)
{
  return fine + (fine - coarse) / (PetscPowReal(2., order) - 1.);
}

/* Aitken extrapolation of three values, each with half the mesh size of the previous one, of
   unknown order. */
static inline PetscReal verify_aitken(const PetscReal v[3])
{
  return v[2] - PetscSqr(v[2] - v[1]) / ((v[2] - v[1]) - (v[1] - v[0]));
}

/* Checks that a run reaches its planned end. */
static inline PetscErrorCode verify_solve(TestScene *t, const char *what)
{
  PetscFunctionBeginUser;
  PetscCall(SbRunSolve(t->run));
  SB_CHECK(!t->run->clock.stop_reason[0], "%s: %s", what, t->run->clock.stop_reason);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Order of Newton's method: errors after one iteration from the solution with a perturbation of
  `size`, and of a tenth of it; `ripple` is any displacement.
*/
static inline PetscErrorCode verify_newton(TestScene *t,
                                           void (*ripple)(const PetscReal x[3], PetscReal v[3]),
                                           PetscReal size, PetscReal error[2], PetscReal *order)
{
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(t->run->state.U, &X));
  PetscCall(SNESSetTolerances(t->run->solve.snes, 0., 0., 0., 1, SB_UNLIMITED));
  for (int k = 0; k < 2; k++) {
    PetscCall(test_fill(t->model, ripple, X));
    PetscCall(VecAYPX(X, k ? 0.1 * size : size, t->run->state.U));
    PetscCall(SbModelPrescribe(t->model, 1., X));
    PetscCall(SNESSolve(t->run->solve.snes, NULL, X));
    PetscCall(VecAXPY(X, -1., t->run->state.U));
    PetscCall(VecNorm(X, NORM_INFINITY, &error[k]));
  }
  *order = PetscLog10Real(error[0] / error[1]);
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Title of the checks that follow. */
static char verify_title[256];

static inline void PETSC_ATTRIBUTE_FORMAT(1, 2) verify_case(const char *format, ...)
{
  va_list args;

  va_start(args, format);
  (void)vsnprintf(verify_title, sizeof(verify_title), format, args);
  va_end(args);
  test_print("  %s\n", verify_title);
}

/* Prints a number that a report quotes. */
static inline void verify_show(const char *what, PetscReal value)
{
  test_print("    %s: %.5g\n", what, value);
}

/* Checks that print the compared values, also if they pass. */
#define VERIFY_NEAR(value, expected, tolerance, what)                                            \
  do {                                                                                           \
    const double verify_v = (double)(value), verify_e = (double)(expected),                      \
                 verify_t = (double)(tolerance);                                                 \
    test_print("    %s: %.7g (%.7g within %.2g)\n", what, verify_v, verify_e, verify_t);         \
    SB_CHECK(fabs(verify_v - verify_e) <= verify_t, "%s: %s: %.15g, expected %.15g within %.3g", \
             verify_title, what, verify_v, verify_e, verify_t);                                  \
  } while (0)
#define VERIFY_LESS(value, bound, what)                                                           \
  do {                                                                                            \
    const double verify_v = (double)(value), verify_b = (double)(bound);                          \
    test_print("    %s: %.5g (below %.3g)\n", what, verify_v, verify_b);                          \
    SB_CHECK(verify_v < verify_b, "%s: %s: %.15g, not below %.15g", verify_title, what, verify_v, \
             verify_b);                                                                           \
  } while (0)
#define VERIFY_MORE(value, bound, what)                                                           \
  do {                                                                                            \
    const double verify_v = (double)(value), verify_b = (double)(bound);                          \
    test_print("    %s: %.5g (above %.3g)\n", what, verify_v, verify_b);                          \
    SB_CHECK(verify_v > verify_b, "%s: %s: %.15g, not above %.15g", verify_title, what, verify_v, \
             verify_b);                                                                           \
  } while (0)

/* Options of a body; all arguments are strings. */
#define VERIFY_BODY(b, mesh, law, young, poisson)                                                \
  " -body_" b "_mesh " mesh " -body_" b "_material " law " -body_" b "_young " young " -body_" b \
  "_poisson " poisson " -body_" b "_density 1000 "
