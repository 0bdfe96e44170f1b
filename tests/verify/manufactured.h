/*
  manufactured.h - a divergence-free displacement of the unit cube: with phi = (sin pi x sin pi y
  sin pi z)^2,

    u = (phi_y - phi_z, phi_z - phi_x, phi_x - phi_y),   u = 0 on the boundary,   f = -mu Lap u,   E
    = 3.

  The force does not depend on lambda, so the exact solution is the same for every Poisson's ratio,
  and any dependence on it is due to the element. Locking shows on meshes with perturbed interior
  vertices: on the mirrored cells of a box linear tets have enough divergence-free displacements.

  Errors are those of the element's own function in each cell, by a quadrature rule of degree 5
  (Walkington 2000), relative to the norm of u.
*/
#pragma once
#include "cells.h"

/* Values a, a', a'', a''' of sin^2(pi x). */
static inline void manufactured_factor(PetscReal x, PetscReal a[4])
{
  const PetscReal s = PetscSinReal(2. * PETSC_PI * x);
  const PetscReal c = PetscCosReal(2. * PETSC_PI * x);

  a[0] = 0.5 * (1. - c);
  a[1] = PETSC_PI * s;
  a[2] = 2. * PETSC_PI * PETSC_PI * c;
  a[3] = -4. * PETSC_PI * PETSC_PI * PETSC_PI * s;
}

/* u[3] and its gradient G[3*i+j] = du_i/dx_j. */
static inline void manufactured_exact(const PetscReal x[3], PetscReal u[3], PetscReal G[9])
{
  PetscReal a[3][4];

  for (int k = 0; k < 3; k++)
    manufactured_factor(x[k], a[k]);
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;

    u[i] = a[i][0] * (a[j][1] * a[k][0] - a[j][0] * a[k][1]);
    G[3 * i + i] = a[i][1] * (a[j][1] * a[k][0] - a[j][0] * a[k][1]);
    G[3 * i + j] = a[i][0] * (a[j][2] * a[k][0] - a[j][1] * a[k][1]);
    G[3 * i + k] = a[i][0] * (a[j][1] * a[k][1] - a[j][0] * a[k][2]);
  }
}

/* Formula of -mu Lap u_i as text, with sin^2 written in the variables. */
static inline PetscErrorCode manufactured_force(PetscReal mu, int i, char text[], size_t size)
{
  static const char *const name = "xyz";
  const char p = name[i];
  const char q = name[(i + 1) % 3];
  const char r = name[(i + 2) % 3];
  char a[4][3][64];

  PetscFunctionBeginUser;
  for (int v = 0; v < 3; v++) {
    const char c = v == 0 ? p : v == 1 ? q : r;

    PetscCall(PetscSNPrintf(a[0][v], 64, "sin(pi*%c)^2", c));
    PetscCall(PetscSNPrintf(a[1][v], 64, "pi*sin(2*pi*%c)", c));
    PetscCall(PetscSNPrintf(a[2][v], 64, "2*pi^2*cos(2*pi*%c)", c));
    PetscCall(PetscSNPrintf(a[3][v], 64, "(-4*pi^3*sin(2*pi*%c))", c));
  }
  PetscCall(PetscSNPrintf(text, size, "-%.17g*(%s*(%s*%s-%s*%s)+%s*(%s*%s+%s*%s-%s*%s-%s*%s))", mu,
                          a[2][0], a[1][1], a[0][2], a[0][1], a[1][2], a[0][0], a[3][1], a[0][2],
                          a[1][1], a[2][2], a[2][1], a[1][2], a[0][1], a[3][2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quadrature rule of degree 5: barycentric points, weights of sum 1. */
static inline void manufactured_rule(PetscReal b[14][4], PetscReal w[14])
{
  const PetscReal a[2] = {0.31088591926330060980, 0.092735250310891226402};
  const PetscReal e = 0.045503704125649649492;
  const PetscReal wa[2] = {0.11268792571801585080, 0.073493043116361949544};
  const PetscReal we = 0.042546020777081466438;
  int n = 0;

  for (int orbit = 0; orbit < 2; orbit++) {
    for (int c = 0; c < 4; c++, n++) {
      for (int d = 0; d < 4; d++)
        b[n][d] = c == d ? 1. - 3. * a[orbit] : a[orbit];
      w[n] = wa[orbit];
    }
  }
  for (int c = 0; c < 4; c++) {
    for (int d = c + 1; d < 4; d++, n++) {
      for (int i = 0; i < 4; i++)
        b[n][i] = i == c || i == d ? 0.5 - e : e;
      w[n] = we;
    }
  }
}

/* Adds the squares of a tet: L2 error, H1 error, and norms of u. */
static inline void manufactured_add_cell(const VerifyCell *cell, PetscReal sum[4])
{
  PetscReal b[14][4], w[14];

  manufactured_rule(b, w);
  for (int q = 0; q < 14; q++) {
    PetscReal p[3] = {0., 0., 0.};
    PetscReal uh[3], H[9], ue[3], G[9];

    for (int k = 0; k < 12; k++)
      p[k % 3] += b[q][k / 3] * cell->x[k / 3][k % 3];
    verify_cell_at(cell, b[q], uh, H);
    manufactured_exact(p, ue, G);
    for (int k = 0; k < 3; k++) {
      sum[0] += w[q] * cell->V * PetscSqr(uh[k] - ue[k]);
      sum[2] += w[q] * cell->V * PetscSqr(ue[k]);
    }
    for (int k = 0; k < 9; k++) {
      sum[1] += w[q] * cell->V * PetscSqr(H[k] - G[k]);
      sum[3] += w[q] * cell->V * PetscSqr(G[k]);
    }
  }
}

/* Relative errors in L2 and in the (broken) H1 seminorm. Collective. */
static inline PetscErrorCode manufactured_errors(SbModel m, Vec U, PetscReal error[2])
{
  SbSpace s = m->space;
  const PetscReal *u;
  PetscReal sum[4] = {0., 0., 0., 0.};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    VerifyCell cell;

    verify_cell(s, u, c, &cell);
    manufactured_add_cell(&cell, sum);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, m->comm));
  error[0] = PetscSqrtReal(sum[0] / sum[2]);
  error[1] = PetscSqrtReal(sum[1] / sum[3]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of the scene except mesh and element. */
static inline PetscErrorCode manufactured_scene(PetscReal nu, char text[], size_t size)
{
  const PetscReal mu = 3. / (2. * (1. + nu));
  char f[3][512];

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++)
    PetscCall(manufactured_force(mu, i, f[i], sizeof(f[i])));
  PetscCall(PetscSNPrintf(
    text, size,
    "-bodies a -body_a_material linear -body_a_young 3 -body_a_poisson %.17g -body_a_density 1 "
    "-effects hold,load -effect_hold_type fixed -effect_hold_on boundary -effect_load_type "
    "body_force "
    "-effect_load_density %s;%s;%s -time static ",
    nu, f[0], f[1], f[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
