/*
  estimate_space.c - the discretisation error in space, by stress recovery.

  Recovery. P_h is the first Piola-Kirchhoff stress, constant in each cell; for DG that of the
  gradient of the means. P* is linear in each cell, with the recovered values at the vertices
  (below). The error of a cell is estimated by the difference:

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

  Limits. The norm is that of Hooke's law in the rotated frame of the cell: for strains of order one
  it is not the tangent's. theta counts supports that rotate by large angles as doing work, and
  contact between bodies as a support: the estimate of a locked body is too low then. Features that
  the mesh does not resolve at all are not detected. In a dynamic run the error is that of the
  current state, against the continuum under the current loads and inertia (elliptic reconstruction,
  Makridakis and Nochetto, SIAM J. Numer. Anal. 41, 2003), not one accumulated since the start.

  Values at the vertices, by least squares over the cells around each (superconvergent patch
  recovery, Zienkiewicz and Zhu, IJNME 33, 1992, parts 1 and 2). At a vertex v the recovered value
  is p(X_v) of the linear polynomial p that minimises

    sum_c |p(X_c) - P_c|^2 + r |grad p|^2,   r = 0.05 sum_c |X_c - X_v|^2,

  over the cells c around v, X_c their centroids. r regularises the slope where cells are too few,
  at corners and edges of a body; constants are recovered for any r. Only cells of one material are
  fitted together, as stress jumps at interfaces: a vertex has one value for each material around
  it. Bodies share no vertices.

  p(X_v) is a linear combination of the P_c with constant weights, which are stored. All cells of an
  owned vertex are local: only ghosts of the P_c, before, and of the values, after, are
  communicated.

  For P2 p has degree two and is fitted to the stresses at the four points of each cell; another one
  is fitted by its means over the cells to their mean pressures. Slopes of the pressure and second
  derivatives are regularised like slopes above. The recovered stress is quadratic in a cell, p(X_v)
  at its vertices and, at the middle of an edge, the mean of the polynomials of its ends.
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

/* Stress of a P2 cell, Pa: Piola's at the points of SbRuleQuadratic, mean pressure in the rotated
   frame. */
typedef struct SbPointStress {
  PetscReal P[4][9], pressure;
} SbPointStress;

typedef struct _p_SbRecovery *SbRecovery;
struct _p_SbRecovery {
  SbMesh mesh;              /* borrowed */
  const SbElement *element; /* [nbody] borrowed */
  PetscInt nlayer;          /* largest number of materials around a vertex, all ranks */
  PetscInt
    *slot; /* [ncell][4] index of the value of each corner of a cell: nlayer vertex + layer */
  PetscReal
    *weight; /* [ncell][4] weight of a cell's P in the value of a corner; 0: vertex not owned */
  PetscReal *value; /* [nvert nlayer][9] recovered values */

  /* for P2; NULL without a P2 body */
  PetscReal (*factor)[2][NFIT * NFIT]; /* [nvert_owned nlayer] Cholesky factors for P, pressure */
  struct Fit {
    PetscReal c[NVALUE][NFIT]; /* coefficients of the monomials of (X - X_v) / size */
    PetscReal size;            /* length scale, m */
  } * fit;                     /* [nvert nlayer] */
};

/* Lists the materials around each vertex on its owner, and finds the slot of each corner of each
   cell. */
static PetscErrorCode create_slots(SbRecovery r)
{
  SbMesh mesh = r->mesh;
  PetscInt *start, *at, *found, *count, *material;
  PetscInt most = 1;

  PetscFunctionBeginUser;

  /* corners 4 c + a at each vertex: at[start[v]..start[v + 1]); count[v] materials, ascending, in
     found */
  PetscCall(SbBucketByKey(4 * mesh->ncell, mesh->cell, mesh->nvert, &start, &at));
  PetscCall(PetscMalloc2(4 * mesh->ncell, &found, mesh->nvert_owned, &count));
  for (PetscInt i = 0; i < start[mesh->nvert_owned]; i++)
    found[i] = mesh->cell_material[at[i] / 4];
  for (PetscInt v = 0; v < mesh->nvert_owned; v++) {
    count[v] = start[v + 1] - start[v];
    PetscCall(PetscSortRemoveDupsInt(&count[v], found + start[v]));
    most = PetscMax(most, count[v]);
  }
  PetscCallMPI(MPI_Allreduce(&most, &r->nlayer, 1, MPIU_INT, MPI_MAX, mesh->comm));
  PetscCall(PetscMalloc1(r->nlayer * (size_t)mesh->nvert, &material));
  for (PetscInt i = 0; i < r->nlayer * mesh->nvert; i++)
    material[i] = -1;
  for (PetscInt v = 0; v < mesh->nvert_owned; v++)
    PetscCall(PetscArraycpy(material + r->nlayer * v, found + start[v], count[v]));
  PetscCall(SbForestBroadcast(mesh->vert_sf, r->nlayer, MPIU_INT, material, material));
  PetscCall(PetscCalloc3(4 * (size_t)mesh->ncell, &r->slot, 4 * (size_t)mesh->ncell, &r->weight,
                         9 * (size_t)r->nlayer * mesh->nvert, &r->value));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    r->slot[i] = r->nlayer * mesh->cell[i];
    for (PetscInt k = 1; k < r->nlayer && material[r->slot[i]] != mesh->cell_material[i / 4]; k++)
      r->slot[i]++;
  }
  PetscCall(PetscFree(material));
  PetscCall(PetscFree2(found, count));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1 and the centroid of a cell relative to its corner a. */
static inline void monomials(SbMesh mesh, PetscInt cell, int a, PetscReal p[4])
{
  const PetscInt *v = mesh->cell + 4 * cell;

  p[0] = 1.;
  for (int k = 0; k < 3; k++) {
    p[k + 1] = -mesh->x[3 * v[a] + k];
    for (int b = 0; b < 4; b++)
      p[k + 1] += 0.25 * mesh->x[3 * v[b] + k];
  }
}

static PetscErrorCode create_weights(SbRecovery r)
{
  SbMesh mesh = r->mesh;
  const PetscInt n = r->nlayer * mesh->nvert_owned;
  PetscBLASInt four = 4;
  PetscBLASInt one = 1;
  PetscBLASInt info;
  PetscReal(*sums)[16], (*row)[4], p[4];

  PetscFunctionBeginUser;

  /* normal equations of the fits; the first row of their inverses */
  PetscCall(PetscCalloc2(n, &sums, n, &row));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    if (mesh->cell[i] >= mesh->nvert_owned)
      continue;
    monomials(mesh, i / 4, (int)(i % 4), p);
    for (int k = 0; k < 16; k++)
      sums[r->slot[i]][k] += p[k / 4] * p[k % 4];
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal ridge = RIDGE * (sums[k][5] + sums[k][10] + sums[k][15]);

    if (sums[k][0] == 0.)
      continue;
    for (int j = 5; j < 16; j += 5)
      sums[k][j] += ridge;
    row[k][0] = 1.;
    LAPACKpotrf_("L", &four, sums[k], &four, &info);
    LAPACKpotrs_("L", &four, &one, sums[k], &four, row[k], &four, &info);
  }
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    if (mesh->cell[i] >= mesh->nvert_owned)
      continue;
    monomials(mesh, i / 4, (int)(i % 4), p);
    for (int a = 0; a < 4; a++)
      r->weight[i] += row[r->slot[i]][a] * p[a];
  }
  PetscCall(PetscFree2(sums, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool is_quadratic(SbRecovery r, PetscInt cell)
{
  return (PetscBool)(r->element[r->mesh->cell_body[cell]]->nodes_per[1] > 0);
}

static void monomials_of(const PetscReal d[3], PetscReal size, PetscReal p[NFIT])
{
  const PetscReal x = d[0] / size;
  const PetscReal y = d[1] / size;
  const PetscReal z = d[2] / size;
  const PetscReal all[NFIT] = {1., x, y, z, x * x, y * y, z * z, x * y, y * z, z * x};

  memcpy(p, all, sizeof(all));
}

/* Monomials at the points of a cell relative to its corner a, and their means over the cell. */
static void point_monomials(SbMesh mesh, PetscInt cell, int a, PetscReal size, PetscReal p[5][NFIT])
{
  const PetscInt *v = mesh->cell + 4 * cell;

  for (int k = 0; k < NFIT; k++)
    p[4][k] = 0.;
  for (int q = 0; q < 4; q++) {
    PetscReal d[3];

    for (int k = 0; k < 3; k++) {
      d[k] = -mesh->x[3 * v[a] + k];
      for (int b = 0; b < 4; b++)
        d[k] += SbRuleQuadratic.L[q][b] * mesh->x[3 * v[b] + k];
    }
    monomials_of(d, size, p[q]);
    for (int k = 0; k < NFIT; k++)
      p[4][k] += 0.25 * p[q][k];
  }
}

static PetscErrorCode create_quadratic(SbRecovery r)
{
  SbMesh mesh = r->mesh;
  const PetscInt n = r->nlayer * mesh->nvert_owned;
  PetscBLASInt order = NFIT;
  PetscBLASInt info;
  PetscInt *ncell;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(r->nlayer * mesh->nvert, &r->fit, n, &r->factor));

  // length scales: root mean square of the distances of centroids
  PetscCall(PetscCalloc1(n, &ncell));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    PetscReal p[4];

    if (mesh->cell[i] >= mesh->nvert_owned || !is_quadratic(r, i / 4))
      continue;
    monomials(mesh, i / 4, (int)(i % 4), p);
    r->fit[r->slot[i]].size += SbDot3(p + 1, p + 1);
    ncell[r->slot[i]]++;
  }
  for (PetscInt k = 0; k < n; k++)
    if (ncell[k])
      r->fit[k].size = PetscSqrtReal(r->fit[k].size / (PetscReal)ncell[k]);

  // normal equations: sums of products of monomials
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt slot = r->slot[i];
    PetscReal p[5][NFIT];

    if (mesh->cell[i] >= mesh->nvert_owned || !is_quadratic(r, i / 4))
      continue;
    point_monomials(mesh, i / 4, (int)(i % 4), r->fit[slot].size, p);
    for (int q = 0; q < 5; q++)
      for (int k = 0; k < NFIT * NFIT; k++)
        r->factor[slot][q == 4][k] += p[q][k / NFIT] * p[q][k % NFIT];
  }
  for (PetscInt s = 0; s < n; s++) {
    if (!ncell[s])
      continue;
    for (int which = 0; which < 2; which++) {
      PetscReal *A = r->factor[s][which];

      for (int k = 1; k < NFIT; k++) {
        PetscReal ridge = which ? RIDGE_SLOPE : 1e-12;

        if (k >= 4)
          ridge = RIDGE_SECOND;
        A[(NFIT + 1) * k] += ridge * A[0];
      }
      LAPACKpotrf_("L", &order, A, &order, &info);
      PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "The sums at a vertex are not definite: %d",
                 (int)info);
    }
  }
  PetscCall(PetscFree(ncell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fits polynomials of degree two to the stresses of P2 cells, set on owned ones. */
static PetscErrorCode fit_quadratic(SbRecovery r, SbPointStress stress[])
{
  SbMesh mesh = r->mesh;
  const PetscInt n = r->nlayer * mesh->nvert_owned;
  PetscBLASInt order = NFIT;
  PetscBLASInt nine = 9;
  PetscBLASInt one = 1;
  PetscBLASInt info;

  PetscFunctionBeginUser;
  PetscCall(SbForestBroadcast(mesh->cell_sf, sizeof(*stress) / sizeof(PetscReal), MPIU_REAL, stress,
                              stress));
  for (PetscInt s = 0; s < n; s++)
    memset(r->fit[s].c, 0, sizeof(r->fit[s].c));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    struct Fit *fit = r->fit + r->slot[i];
    PetscReal p[5][NFIT];

    if (mesh->cell[i] >= mesh->nvert_owned || !is_quadratic(r, i / 4))
      continue;
    point_monomials(mesh, i / 4, (int)(i % 4), fit->size, p);
    for (int m = 0; m < NFIT; m++) {
      for (int q = 0; q < 4; q++)
        for (int k = 0; k < 9; k++)
          fit->c[k][m] += p[q][m] * stress[i / 4].P[q][k];
      fit->c[9][m] += p[4][m] * stress[i / 4].pressure;
    }
  }
  for (PetscInt s = 0; s < n; s++) {
    if (!(r->fit[s].size > 0.))
      continue;
    LAPACKpotrs_("L", &order, &nine, r->factor[s][0], &order, r->fit[s].c[0], &order, &info);
    LAPACKpotrs_("L", &order, &one, r->factor[s][1], &order, r->fit[s].c[9], &order, &info);
  }
  PetscCall(SbForestBroadcast(mesh->vert_sf, r->nlayer * (sizeof(*r->fit) / sizeof(PetscReal)),
                              MPIU_REAL, r->fit, r->fit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The recovered stress and, returned, pressure at node a = 0..9 of an owned P2 cell. */
static PetscReal recovered(SbRecovery r, PetscInt cell, int a, PetscReal P[9])
{
  const PetscInt *v = r->mesh->cell + 4 * cell;
  const PetscInt *slot = r->slot + 4 * cell;
  PetscReal value[NVALUE] = {0.};

  if (a < 4) {
    for (int k = 0; k < 9; k++)
      P[k] = r->fit[slot[a]].c[k][0];
    return r->fit[slot[a]].c[9][0];
  }
  for (int end = 0; end < 2; end++) {
    const int from = SbTetEdge[a - 4][end];
    const int to = SbTetEdge[a - 4][1 - end];
    const struct Fit *fit = r->fit + slot[from];
    PetscReal d[3], p[NFIT];

    for (int k = 0; k < 3; k++)
      d[k] = 0.5 * (r->mesh->x[3 * v[to] + k] - r->mesh->x[3 * v[from] + k]);
    monomials_of(d, fit->size, p);
    for (int m = 0; m < NFIT; m++)
      for (int k = 0; k < NVALUE; k++)
        value[k] += 0.5 * p[m] * fit->c[k][m];
  }
  memcpy(P, value, 9 * sizeof(*P));
  return value[9];
}

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
  PetscCall(PetscNew(&est->recovery));
  est->recovery->mesh = model->mesh;
  est->recovery->element = model->element;
  PetscCall(create_slots(est->recovery));
  PetscCall(create_weights(est->recovery));
  if (quadratic) {
    PetscCall(create_quadratic(est->recovery));
    PetscCall(PetscMalloc1(model->mesh->ncell, &est->stress));
  }
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
  PetscCall(PetscFree3(est->recovery->slot, est->recovery->weight, est->recovery->value));
  PetscCall(PetscFree2(est->recovery->fit, est->recovery->factor));
  PetscCall(PetscFree(est->recovery));
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
    turn(R, est->recovery->value + 9 * est->recovery->slot[4 * c + a], star[a]);
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
   quadratics. */
static PetscReal quadratic_off(SbSpaceEstimate est, PetscInt c, PetscReal G, PetscReal K)
{
  const PetscReal *R = est->R ? est->R + 9 * c : NULL;
  const PetscReal V = cell_volume(est->model->mesh, c);
  const PetscReal near = SbRuleQuadratic.L[0][0];
  const PetscReal far = SbRuleQuadratic.L[0][1];
  const SbPointStress *at = est->stress + c;
  PetscReal off[SB_CELL_NODES][6];
  PetscReal pressure = 0.;
  PetscReal square = 0.;

  for (int a = 0; a < SB_CELL_NODES; a++) {
    const int i = a < 4 ? a : SbTetEdge[a - 4][0];
    const int j = a < 4 ? a : SbTetEdge[a - 4][1];
    PetscReal P[9], mean;

    pressure += (a < 4 ? -0.05 : 0.2) * recovered(est->recovery, c, a, P);
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
  const SbRecovery r = est->recovery;
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

  /* recovered stresses */
  if (est->stress)
    PetscCall(fit_quadratic(r, est->stress));
  PetscCall(SbForestBroadcast(mesh->cell_sf, 9, MPIU_REAL, est->P, est->P));
  PetscCall(PetscArrayzero(r->value, 9 * (size_t)r->nlayer * mesh->nvert));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++)
    for (int k = 0; k < 9; k++)
      r->value[9 * r->slot[i] + k] += r->weight[i] * est->P[9 * (i / 4) + k];
  PetscCall(SbForestBroadcast(mesh->vert_sf, 9 * r->nlayer, MPIU_REAL, r->value, r->value));

  /* sums over the cells of each body */
  PetscCall(PetscCalloc1(model->nbody, &sum));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const SbMaterial law = model->material[mesh->cell_material[c]];
    const PetscReal K = SbMaterialBulkModulus(law);
    const PetscInt body = mesh->cell_body[c];

    if (model->element[body]->nodes_per[1]) {
      est->cell2[c] = quadratic_off(est, c, SbMaterialShearModulus(law), K);
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

  /* results of each body from its sums */
  est->total2 = 0.;
  for (PetscInt b = 0; b < model->nbody; b++) {
    const PetscReal off = sum[b][SHEAR_OFF] + sum[b][PRESSURE_OFF];

    est->strain[b] = sum[b][STRAIN];
    est->body2[b] = is_stiff(model, b) ? stiff_error(sum[b]) : off;
    est->total2 += est->body2[b];
    est->factor[b] = off > 0. ? est->body2[b] / off : 1.;
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++)
    est->cell2[c] *= est->factor[mesh->cell_body[c]];
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}
