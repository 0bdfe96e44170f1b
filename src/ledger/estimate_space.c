/*
  estimate_space.c - the discretisation error in space, by stress recovery.

  Recovery. P_h is the first Piola-Kirchhoff stress, constant in each cell; for DG that of the
  gradient of the means. P* is linear in each cell, with the recovered values at the vertices
  (src/fem/recovery.c). The error of a cell is estimated by the difference:

    off_T = 1/2 int_T D : C^-1 : D,  D = P* - P_h, s = sym(R^T D), C^-1: |dev s|^2 / (2 mu) +
    tr(s)^2 / (9 K),

  K = lambda + 2/3 mu, R the rotation in F (Zienkiewicz and Zhu 1992; for CR and DG with averages
  instead of fits: Carstensen and Funken, Math. Comp. 70, 2001). In this norm it stays bounded as nu
  -> 1/2. For CR and DG it is complete. It needs neither loads nor inertia: P_h balances them.

  Stiffness. P1 is too stiff, near nu = 1/2 by any factor (locking): then P_h is wrong everywhere,
  and P* - P_h has only a fraction of a small energy. But P* shows how much too stiff P1 is. Let a
  be the energy of P_h in the norm above, b its smooth part and a - b what the mesh has added. Of
  the multiples s u_h of the solution, under the same loads, the best one with the stiffness of the
  smooth part only, s^2 b - 2 s a -> min, has s = a / b, and its potential energy is below that of
  u_h by

    |e|^2 = s a - a = (a - b) a / b:

  a Galerkin solution in a space of one dimension. With prescribed displacements instead of loads
  u_h cannot be scaled and |e|^2 = a - b; in general, with theta the fraction of the work that is
  done by loads,

    |e|^2 = (a - b) (1 + theta (a / b - 1)),  theta = 1 - sum R . (u - m) / (2 a), at least 0 and at
    most 1,

  R the forces of supports and contact, m for each component the mean of u weighted by |R|: supports
  with the same motion do no work. Without locking a / b -> 1, and the estimate is that of recovery.
  a - b is the sum of off_T: its shear part unchanged, its pressure part, which locks, enlarged.
  Where P_h oscillates from cell to cell the fit over some twenty cells keeps a little of it
  (measured: up to a fifth of the energy), so the smooth energy of the pressure is at most that of
  P* less a quarter of off, but a - b contains off at most twice. The factor on off_T is computed
  for each P1 body, and is the same in all its cells.

  P2. The deviator of P_h is linear in a cell, given at its points, P* quadratic; the pressure,
  constant in a cell, is compared with the mean of p*:

    off_T = 1/(4 mu) int_T |dev (s* - s_h)|^2 + V/(2 K) (mean p* - p_h)^2.

  Displacements have the accuracy of deviators and mean pressures, one order above that of pointwise
  pressures. P2 does not lock: no factor.

  The error of a quantity is a product of two errors (quantity.c) and has terms that off_T lacks:
  p_h is not K theta at a point, theta the dilatation of u_h. From the form 2 mu dev e : dev e' + p
  theta' + p' theta - p p' / K of the errors in displacement and pressure, with the discrete dual
  solution subtracted, of which p_h is as little K theta,

    form_T = off_T + int pi^2 / (2 K) - pi t + (K - lambda_m) / 2 t^2,

  pi and t what p* and theta differ by from their means over the cell, lambda_m the modulus of the
  mean (src/fem/quadratic.c). It may be negative, as the cell may be too soft.

  Limits. The norm is that of Hooke's law in the rotated frame of the cell: for strains of order one
  it is not the tangent's. theta counts supports that rotate by large angles as doing work, and
  contact between bodies as a support: the estimate of a locked body is too low then. Features that
  the mesh does not resolve at all are not detected. In a dynamic run the error is that of the
  current state, against the continuum under the current loads and inertia (elliptic reconstruction,
  Makridakis and Nochetto, SIAM J. Numer. Anal. 41, 2003), not one accumulated since the start.
*/
#include "ledger_impl.h"
#include "sbgeometry.h"
#include "sbkernel.h"
#include <petscblaslapack.h>

#define KEPT \
  0.25 /* largest fraction of the energy of an oscillating pressure that recovery keeps */
#define FLOOR 1e-8        /* least smooth fraction of the energy */
#define RIDGE 0.05        /* factor in r above */
#define RIDGE_SLOPE 0.01  /* factor on slopes of the pressure, over the number of cells */
#define RIDGE_SECOND 1e-3 /* the same for second derivatives */
#define NFIT 10           /* monomials up to degree two */
#define NVALUE 10         /* fitted values: nine of P, the pressure */

/* Sums over a body. Energies in J. */
typedef enum {
  SHEAR,           /* shear energy of P_h */
  PRESSURE,        /* pressure energy of P_h */
  SHEAR_OFF,       /* shear energy of P* - P_h */
  PRESSURE_OFF,    /* pressure energy of P* - P_h */
  PRESSURE_SMOOTH, /* pressure energy of P* */
  STRAIN,          /* strain energy */
  FORCE_SIZE,      /* |R|, three components, N */
  SHIFT = FORCE_SIZE + 3,
  FORCE = SHIFT + 3,
  WORK = FORCE + 3,
  NSUM = WORK + 3
} Sum;

/* Whether a body is P1, the element that locks. */
static inline PetscBool is_stiff(SbModel model, PetscInt body)
{
  return (PetscBool)(model->element[body]->nodes_per[0] && !model->element[body]->nodes_per[1]);
}

PetscErrorCode SbSpaceEstimateCreate(SbModel model, SbSpaceEstimate *estimate)
{
  const PetscInt n = model->mesh->ncell_owned;
  PetscBool stiff = PETSC_FALSE;
  PetscBool quadratic = PETSC_FALSE;
  SbSpaceEstimate est;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&est));
  est->model = model;
  for (PetscInt b = 0; b < model->nbody; b++) {
    stiff = (PetscBool)(stiff || is_stiff(model, b));
    quadratic = (PetscBool)(quadratic || model->element[b]->nodes_per[1]);
  }
  PetscCall(SbRecoveryCreate(model->space, &est->recovery));
  if (quadratic)
    PetscCall(PetscMalloc1(model->mesh->ncell, &est->stress));
  PetscCall(PetscCalloc3(model->nbody, &est->body2, model->nbody, &est->strain, model->nbody,
                         &est->factor));
  PetscCall(PetscCalloc3(n, &est->cell2, n, &est->psi, 9 * (size_t)model->mesh->ncell, &est->P));
  if (!model->space->linear)
    PetscCall(PetscMalloc1(9 * (size_t)n, &est->R));
  if (stiff)
    PetscCall(SbSpaceCreateVec(model->space, &est->residual));
  *estimate = est;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceEstimateDestroy(SbSpaceEstimate *estimate)
{
  SbSpaceEstimate est = *estimate;

  PetscFunctionBeginUser;
  if (!est)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbRecoveryDestroy(&est->recovery));
  PetscCall(PetscFree3(est->body2, est->strain, est->factor));
  PetscCall(PetscFree3(est->cell2, est->psi, est->P));
  PetscCall(PetscFree(est->stress));
  PetscCall(PetscFree(est->R));
  PetscCall(VecDestroy(&est->residual));
  PetscCall(PetscFree(*estimate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* s = sym(R^T T), 00 11 22 01 12 02: T in the rotated frame of the cell; R NULL: identity. */
static inline void turn(const PetscReal R[9], const PetscReal T[9], PetscReal s[6])
{
  PetscReal turned[9];
  const PetscReal *t = T;

  if (R) {
    SbMatTransposeMul(R, T, turned);
    t = turned;
  }
  s[0] = t[0];
  s[1] = t[4];
  s[2] = t[8];
  s[3] = 0.5 * (t[1] + t[3]);
  s[4] = 0.5 * (t[5] + t[7]);
  s[5] = 0.5 * (t[2] + t[6]);
}

/* |dev s|^2; the energy of the shear is 1 / (4 mu) of it, that of the pressure tr(s)^2 / (18 K),
   J/m^3. */
static inline PetscReal shear(const PetscReal s[6])
{
  const PetscReal mean = (s[0] + s[1] + s[2]) / 3.;

  return PetscSqr(s[0] - mean) + PetscSqr(s[1] - mean) + PetscSqr(s[2] - mean) +
         2. * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
}

static inline PetscReal trace2(const PetscReal s[6])
{
  return PetscSqr(s[0] + s[1] + s[2]);
}

static PetscReal cell_volume(SbMesh mesh, PetscInt c)
{
  return SbTetDeterminant(mesh->x, mesh->cell + 4 * c) / 6.;
}

/* Adds the energies of an owned cell, G and K its moduli, and returns off_T. The integral of the
   square of a linear function over a tet is V / 20 (sum |d_a|^2 + |sum d_a|^2), d_a at the
   vertices. */
static PetscReal add_cell(SbSpaceEstimate est, PetscInt c, PetscReal G, PetscReal K,
                          PetscReal sum[NSUM])
{
  const PetscReal *R = est->R ? est->R + 9 * c : NULL;
  const PetscReal V = cell_volume(est->model->mesh, c);
  const PetscReal shear_part = V / (4. * G);
  const PetscReal pressure_part = V / (18. * K);
  PetscReal s[6];
  PetscReal star[5][6] = {{0.}};
  PetscReal off[5][6] = {{0.}};
  PetscReal squares[3] = {0., 0., 0.};

  turn(R, est->P + 9 * c, s);
  for (int a = 0; a < 4; a++) {
    turn(R, SbRecoveryCorner(est->recovery, c, a), star[a]);
    for (int k = 0; k < 6; k++) {
      off[a][k] = star[a][k] - s[k];
      off[4][k] += off[a][k];
      star[4][k] += star[a][k];
    }
  }
  for (int a = 0; a < 5; a++) {
    squares[0] += shear_part / 20. * shear(off[a]);
    squares[1] += pressure_part / 20. * trace2(off[a]);
    squares[2] += pressure_part / 20. * trace2(star[a]);
  }
  sum[SHEAR] += shear_part * shear(s);
  sum[PRESSURE] += pressure_part * trace2(s);
  sum[SHEAR_OFF] += squares[0];
  sum[PRESSURE_OFF] += squares[1];
  sum[PRESSURE_SMOOTH] += squares[2];
  sum[STRAIN] += V * est->psi[c];
  return squares[0] + squares[1];
}

/* off_T of an owned P2 cell from values at ten nodes; SbQuadraticMass() integrates products of
   quadratics. rest: what the form of est->form2 has more. */
static PetscReal quadratic_off(SbSpaceEstimate est, PetscInt c, SbMaterial law, PetscReal *rest)
{
  const PetscReal G = SbMaterialShearModulus(law);
  const PetscReal K = SbMaterialBulkModulus(law);
  const PetscReal mean_modulus = SbMaterialMeanModulus(law);
  const PetscReal *R = est->R ? est->R + 9 * c : NULL;
  const PetscReal V = cell_volume(est->model->mesh, c);
  const PetscReal near = SbRuleQuadratic.L[0][0];
  const PetscReal far = SbRuleQuadratic.L[0][1];
  const SbPointStress *at = est->stress + c;
  PetscReal off[SB_CELL_NODES][6];
  PetscReal pressure = 0.;
  PetscReal corner[4];
  PetscReal square = 0.;

  for (int a = 0; a < SB_CELL_NODES; a++) {
    const int i = a < 4 ? a : SbTetEdge[a - 4][0];
    const int j = a < 4 ? a : SbTetEdge[a - 4][1];
    PetscReal P[9], mean;

    mean = SbRecoveryNode(est->recovery, c, a, P);
    pressure += (a < 4 ? -0.05 : 0.2) * mean;
    if (a < 4)
      corner[a] = mean;
    for (int k = 0; k < 9; k++) {
      const PetscReal sum = at->P[0][k] + at->P[1][k] + at->P[2][k] + at->P[3][k];

      P[k] -= (0.5 * (at->P[i][k] + at->P[j][k]) - far * sum) / (near - far);
    }
    turn(R, P, off[a]);
    mean = (off[a][0] + off[a][1] + off[a][2]) / 3.;
    for (int k = 0; k < 3; k++)
      off[a][k] -= mean;
  }
  for (int a = 0; a < SB_CELL_NODES; a++) {
    for (int b = 0; b < SB_CELL_NODES; b++) {
      PetscReal product = 0.;

      for (int k = 0; k < 6; k++)
        product += (k < 3 ? 1. : 2.) * off[a][k] * off[b][k];
      square += SbQuadraticMass(a, b) * product;
    }
  }

  // pressure and dilatation less their means
  *rest = 0.;
  for (int q = 0; q < 4; q++) {
    PetscReal s[6];
    PetscReal p = 0.;
    PetscReal theta;

    for (int a = 0; a < 4; a++)
      p += (SbRuleQuadratic.L[q][a] - 0.25) * corner[a];
    turn(R, at->P[q], s);
    theta = ((s[0] + s[1] + s[2]) / 3. - at->pressure) / (K - mean_modulus);
    *rest += V / 4. * (p * p / (2. * K) - p * theta + (K - mean_modulus) / 2. * theta * theta);
  }
  return V / (4. * G) * square + V / (2. * K) * PetscSqr(pressure - at->pressure);
}

/* |e|^2 of a P1 body. */
static PetscReal stiff_error(const PetscReal sum[NSUM])
{
  const PetscReal a = sum[SHEAR] + sum[PRESSURE];
  const PetscReal off = sum[PRESSURE_OFF];
  const PetscReal rough =
    PetscMin(2. * off, PetscMax(off, sum[PRESSURE] - sum[PRESSURE_SMOOTH] + KEPT * off));
  const PetscReal loss = PetscMin(sum[SHEAR], sum[SHEAR_OFF]) + PetscMin(sum[PRESSURE], rough);
  const PetscReal b = PetscMax(a - loss, FLOOR * a);
  PetscReal work = 0.;
  PetscReal theta;

  if (a <= 0.)
    return 0.;
  for (int k = 0; k < 3; k++) {
    const PetscReal size = sum[FORCE_SIZE + k];

    if (size > 0.)
      work += sum[WORK + k] - sum[SHIFT + k] / size * sum[FORCE + k];
  }
  theta = PetscMin(1., PetscMax(0., 1. - work / (2. * a)));
  return loss * (1. + theta * (a / b - 1.));
}

PetscErrorCode SbSpaceEstimateCompute(SbSpaceEstimate est, PetscReal t, Vec U, Vec V, Vec A)
{
  const SbModel model = est->model;
  const SbMesh mesh = model->mesh;
  const PetscReal *u;
  PetscReal(*sum)[NSUM], *point = NULL;

  PetscFunctionBeginUser;
  if (est->stress)
    PetscCall(PetscCalloc1(36 * (size_t)mesh->ncell, &point));
  PetscCall(SbSpaceGetLocalRead(model->space, U, &u));
  SbSpaceCellPiola(model->space, u, est->P, est->R, est->psi, point);
  PetscCall(SbSpaceRestoreLocalRead(model->space, U, &u));
  for (PetscInt c = 0; point && c < mesh->ncell_owned; c++) {
    PetscReal s[6];

    turn(est->R ? est->R + 9 * c : NULL, est->P + 9 * c, s);
    memcpy(est->stress[c].P, point + 36 * c, sizeof(est->stress[c].P));
    est->stress[c].pressure = (s[0] + s[1] + s[2]) / 3.;
  }
  PetscCall(PetscFree(point));

  PetscCall(SbRecoveryFit(est->recovery, est->P, est->stress));

  /* sums over the cells of each body */
  est->form2 = 0.;
  PetscCall(PetscCalloc1(model->nbody, &sum));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const SbMaterial law = model->material[mesh->cell_material[c]];
    const PetscReal K = SbMaterialBulkModulus(law);
    const PetscInt body = mesh->cell_body[c];
    PetscReal rest;

    if (model->element[body]->nodes_per[1]) {
      est->cell2[c] = quadratic_off(est, c, law, &rest);
      est->form2 += rest;
      sum[body][SHEAR_OFF] += est->cell2[c];
      sum[body][STRAIN] += cell_volume(mesh, c) * est->psi[c];
    } else
      est->cell2[c] = add_cell(est, c, SbMaterialShearModulus(law), K, sum[body]);
  }
  if (est->residual) {
    const PetscReal *force;

    /* the terms of theta: forces of supports and contact, and the displacements of nodes there */
    PetscCall(SbModelResidual(model, t, U, V, A, PETSC_FALSE, est->residual));
    PetscCall(VecGetArrayRead(est->residual, &force));
    PetscCall(VecGetArrayRead(U, &u));
    for (PetscInt i = 0; i < 3 * model->space->nnode_owned; i++) {
      PetscReal *mine = sum[model->space->node_body[i / 3]];

      mine[FORCE_SIZE + i % 3] += PetscAbsReal(force[i]);
      mine[SHIFT + i % 3] += PetscAbsReal(force[i]) * u[i];
      mine[FORCE + i % 3] += force[i];
      mine[WORK + i % 3] += force[i] * u[i];
    }
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscCall(VecRestoreArrayRead(est->residual, &force));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, (PetscMPIInt)(NSUM * model->nbody), MPIU_REAL,
                             MPI_SUM, model->comm));

  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &est->form2, 1, MPIU_REAL, MPI_SUM, model->comm));

  /* results of each body from its sums */
  est->total2 = 0.;
  for (PetscInt b = 0; b < model->nbody; b++) {
    const PetscReal off = sum[b][SHEAR_OFF] + sum[b][PRESSURE_OFF];

    est->strain[b] = sum[b][STRAIN];
    est->body2[b] = is_stiff(model, b) ? stiff_error(sum[b]) : off;
    est->total2 += est->body2[b];
    est->factor[b] = off > 0. ? est->body2[b] / off : 1.;
  }
  est->form2 += est->total2;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++)
    est->cell2[c] *= est->factor[mesh->cell_body[c]];
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}
