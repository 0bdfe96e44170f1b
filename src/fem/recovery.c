/*
  Recovery of stresses: values at vertices, and at nodes of P2, from those of cells.

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
#include "fem_impl.h"
#include "sbgeometry.h"
#include <petscblaslapack.h>

#define RIDGE 0.05        /* factor in r above */
#define RIDGE_SLOPE 0.01  /* factor on slopes of the pressure, over the number of cells */
#define RIDGE_SECOND 1e-3 /* the same for second derivatives */
#define NFIT SB_FIT_MONOMIALS
#define NVALUE SB_FIT_VALUES

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
    struct SbFit *fit = r->fit + r->slot[i];
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

PetscReal SbRecoveryNode(SbRecovery r, PetscInt cell, int a, PetscReal P[9])
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
    const struct SbFit *fit = r->fit + slot[from];
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

PetscErrorCode SbRecoveryCreate(SbSpace space, SbRecovery *recovery)
{
  SbRecovery r;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&r));
  r->mesh = space->mesh;
  r->element = space->element;
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    r->quadratic = (PetscBool)(r->quadratic || r->element[b]->nodes_per[1]);
  PetscCall(create_slots(r));
  PetscCall(create_weights(r));
  if (r->quadratic)
    PetscCall(create_quadratic(r));
  *recovery = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRecoveryFit(SbRecovery r, PetscReal P[], SbPointStress point[])
{
  const SbMesh mesh = r->mesh;

  PetscFunctionBeginUser;
  if (r->quadratic)
    PetscCall(fit_quadratic(r, point));
  PetscCall(SbForestBroadcast(mesh->cell_sf, 9, MPIU_REAL, P, P));
  PetscCall(PetscArrayzero(r->value, 9 * (size_t)r->nlayer * mesh->nvert));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++)
    for (int k = 0; k < 9; k++)
      r->value[9 * r->slot[i] + k] += r->weight[i] * P[9 * (i / 4) + k];
  PetscCall(SbForestBroadcast(mesh->vert_sf, 9 * r->nlayer, MPIU_REAL, r->value, r->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRecoveryDestroy(SbRecovery *recovery)
{
  PetscFunctionBeginUser;
  if (!*recovery)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree3((*recovery)->slot, (*recovery)->weight, (*recovery)->value));
  PetscCall(PetscFree2((*recovery)->fit, (*recovery)->factor));
  PetscCall(PetscFree(*recovery));
  PetscFunctionReturn(PETSC_SUCCESS);
}
