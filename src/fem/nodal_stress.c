/*
  Cauchy stress at nodes, for output.

  The stress of a cell is constant, of P2 linear with a constant pressure (but for a part of small
  weight): at a vertex the mean of the cells around it is off by the slope times the distance of
  their centroids, most where it matters, at the surface. So at a vertex v it is the value p(X_v) of
  a polynomial p fitted to the cells around it (superconvergent patch recovery, Zienkiewicz and Zhu,
  IJNME 33, 1992): linear through the means of the cells at their centroids; of P2 the deviator of
  recovery.c, of degree two through the stresses at the points of the cells, and the mean stress of
  the former. At a node at an edge: the mean of the polynomials of its ends. Of P1, whose stresses
  oscillate from cell to cell, it is the mean: slopes of one-sided fits made it two to five times as
  wrong (docs/reports/error_estimates.md).

  The linear fit needs cells on all sides. Where their centroids are nearly in one plane, at edges
  and corners of a body, p(X_v) is the mean of the polynomials of the vertices around v that have
  enough (as in the reference, 3.1). If none has, p is the mean.

  P2 reproduces stresses that are linear in the rest position, the others as well, if the cells have
  the mean of it. Only cells of one material are fitted together: where materials meet, each side
  has its own value.
*/
#include "fem_impl.h"
#include "sbgeometry.h"

#define FLAT \
  0.04 /* least pivot of the scaled second moments of centroids for which a slope is fitted */

/* The linear fit at a vertex, for one material. */
typedef struct {
  PetscReal c[9][4]; /* value and slopes times size, Pa */
  PetscReal size;    /* root mean square of the distances of centroids, m */
  PetscReal volume;  /* of the cells, the weights of the fit, m^3 */
  PetscReal fitted;  /* 1: with slopes; 0: too few cells or P1, c is their mean */
} Fit;

struct _p_SbNodalStress {
  SbSpace space; /* borrowed */
  SbRecovery recovery;
  PetscReal (*factor)[4][4]; /* [nvert_owned nlayer] Cholesky factors, lower */
  Fit *fit;                  /* [nvert nlayer] */
  PetscReal *value;          /* [nvert nlayer][9] at the vertex, Pa */
  PetscReal *T;              /* [ncell][9] of the cells, Pa */
  SbPointStress *point;      /* [ncell] of P2; NULL without a body of it */
};

/* 1 and the centroid of a cell relative to its corner a, over a length. */
static void monomials(SbMesh mesh, PetscInt cell, int a, PetscReal size, PetscReal p[4])
{
  const PetscInt *v = mesh->cell + 4 * cell;

  p[0] = 1.;
  for (int k = 0; k < 3; k++) {
    PetscReal mean = 0.;

    for (int b = 0; b < 4; b++)
      mean += 0.25 * mesh->x[3 * v[b] + k];
    p[k + 1] = (mean - mesh->x[3 * v[a] + k]) / size;
  }
}

PetscErrorCode SbNodalStressCreate(SbSpace space, SbNodalStress *stress)
{
  const SbMesh mesh = space->mesh;
  SbNodalStress s;
  PetscInt n;
  PetscReal p[4], V;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  s->space = space;
  PetscCall(SbRecoveryCreate(space, &s->recovery));
  n = s->recovery->nlayer * mesh->nvert;
  PetscCall(PetscCalloc4(s->recovery->nlayer * mesh->nvert_owned, &s->factor, n, &s->fit, 9 * n,
                         &s->value, 9 * mesh->ncell, &s->T));
  if (s->recovery->fit)
    PetscCall(PetscCalloc1(mesh->ncell, &s->point));

  // length scales, then sums of products of monomials, over their number
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
      Fit *fit = s->fit + s->recovery->slot[i];
      PetscReal(*A)[4];

      if (mesh->cell[i] >= mesh->nvert_owned)
        continue;
      A = s->factor[s->recovery->slot[i]];
      monomials(mesh, i / 4, (int)(i % 4), pass ? fit->size : 1., p);
      V = SbTetDeterminant(mesh->x, mesh->cell + 4 * (i / 4)) / 6.;
      if (!pass) {
        fit->size += V * SbDot3(p + 1, p + 1);
        fit->volume += V;
        fit->fitted = SbSpaceCellElement(space, i / 4)->nodes_per[0] &&
                          !SbSpaceCellElement(space, i / 4)->nodes_per[1]
                        ? 0.
                        : 1.;
      }
      for (int k = 0; pass && k < 16; k++)
        A[k / 4][k % 4] += V * p[k / 4] * p[k % 4] / fit->volume;
    }
    for (PetscInt k = 0; !pass && k < n; k++)
      if (s->fit[k].volume > 0.)
        s->fit[k].size = PetscSqrtReal(s->fit[k].size / s->fit[k].volume);
  }

  // factors; a small pivot: centroids nearly in a plane
  for (PetscInt k = 0; k < s->recovery->nlayer * mesh->nvert_owned; k++) {
    PetscReal(*A)[4] = s->factor[k];

    for (int j = 0; j < 4 && s->fit[k].fitted > 0.; j++) {
      for (int i = j; i < 4; i++)
        for (int m = 0; m < j; m++)
          A[i][j] -= A[i][m] * A[j][m];
      if (A[j][j] < FLAT) {
        s->fit[k].fitted = 0.;
        break;
      }
      A[j][j] = PetscSqrtReal(A[j][j]);
      for (int i = j + 1; i < 4; i++)
        A[i][j] /= A[j][j];
    }
  }
  *stress = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves A c = b with the Cholesky factor of A. */
static void solve(const PetscReal A[4][4], PetscReal b[4])
{
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < i; j++)
      b[i] -= A[i][j] * b[j];
    b[i] /= A[i][i];
  }
  for (int i = 3; i >= 0; i--) {
    for (int j = i + 1; j < 4; j++)
      b[i] -= A[j][i] * b[j];
    b[i] /= A[i][i];
  }
}

/* Adds to value the polynomial of corner b of a cell, if it has slopes, at corner a; returns their
   number. */
static PetscReal add_polynomial(SbNodalStress s, PetscInt cell, int b, int a, PetscReal value[9])
{
  const SbMesh mesh = s->space->mesh;
  const Fit *fit = s->fit + s->recovery->slot[4 * cell + b];
  const PetscReal *from = mesh->x + 3 * mesh->cell[4 * cell + b];
  const PetscReal *to = mesh->x + 3 * mesh->cell[4 * cell + a];

  for (int k = 0; k < 9 && fit->fitted > 0.; k++) {
    value[k] += fit->c[k][0];
    for (int j = 0; j < 3; j++)
      value[k] += fit->c[k][j + 1] * (to[j] - from[j]) / fit->size;
  }
  return fit->fitted;
}

PetscErrorCode SbNodalStressCompute(SbNodalStress s, Vec U)
{
  const SbMesh mesh = s->space->mesh;
  const SbRecovery r = s->recovery;
  const PetscInt n = r->nlayer * mesh->nvert_owned;
  const PetscReal *u;
  PetscReal *count;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s->space, U, &u));
  SbSpaceCellCauchy(s->space, u, s->T, s->point);
  PetscCall(SbSpaceRestoreLocalRead(s->space, U, &u));
  PetscCall(SbRecoveryFit(r, s->T, s->point));

  // linear fits at owned vertices, or means
  for (PetscInt k = 0; k < n; k++)
    memset(s->fit[k].c, 0, sizeof(s->fit[k].c));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    Fit *fit = s->fit + r->slot[i];
    PetscReal p[4], part;

    if (mesh->cell[i] >= mesh->nvert_owned)
      continue;
    monomials(mesh, i / 4, (int)(i % 4), fit->size, p);
    part = SbTetDeterminant(mesh->x, mesh->cell + 4 * (i / 4)) / (6. * fit->volume);
    for (int k = 0; k < 9; k++)
      for (int m = 0; m < 4; m++)
        fit->c[k][m] += part * p[m] * s->T[9 * (i / 4) + k];
  }
  for (PetscInt j = 0; j < n; j++) {
    for (int k = 0; k < 9; k++)
      if (s->fit[j].fitted > 0.)
        solve((const PetscReal(*)[4])s->factor[j], s->fit[j].c[k]);
  }
  PetscCall(SbForestBroadcast(mesh->vert_sf, r->nlayer * (sizeof(Fit) / sizeof(PetscReal)),
                              MPIU_REAL, s->fit, s->fit));

  // values: of the own fit, or the mean of those around
  PetscCall(PetscCalloc1(n, &count));
  PetscCall(PetscArrayzero(s->value, 9 * (size_t)r->nlayer * mesh->nvert));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++)
    for (int b = 0; b < 4 && mesh->cell[i] < mesh->nvert_owned; b++)
      if (b != i % 4 && !(s->fit[r->slot[i]].fitted > 0.))
        count[r->slot[i]] += add_polynomial(s, i / 4, b, (int)(i % 4), s->value + 9 * r->slot[i]);
  for (PetscInt j = 0; j < n; j++)
    for (int k = 0; k < 9; k++)
      s->value[9 * j + k] = count[j] > 0. ? s->value[9 * j + k] / count[j] : s->fit[j].c[k][0];
  PetscCall(PetscFree(count));
  PetscCall(SbForestBroadcast(mesh->vert_sf, 9 * r->nlayer, MPIU_REAL, s->value, s->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbNodalStressAt(SbNodalStress s, PetscInt cell, int a, PetscReal sigma[6])
{
  static const int entry[6] = {0, 4, 8, 1, 5, 2};
  const PetscInt *slot = s->recovery->slot + 4 * cell;
  const PetscReal *end[2];
  PetscReal T[9];
  PetscReal more = 0.;

  end[0] = s->value + 9 * slot[a < 4 ? a : SbTetEdge[a - 4][0]];
  end[1] = s->value + 9 * slot[a < 4 ? a : SbTetEdge[a - 4][1]];
  for (int k = 0; k < 9; k++)
    T[k] = 0.5 * (end[0][k] + end[1][k]);
  if (SbSpaceCellElement(s->space, cell)->nodes_per[1]) {
    more = (T[0] + T[4] + T[8]) / 3.;
    (void)SbRecoveryNode(s->recovery, cell, a, T);
    more -= (T[0] + T[4] + T[8]) / 3.;
  }
  for (int k = 0; k < 6; k++)
    sigma[k] = T[entry[k]] + (k < 3 ? more : 0.);
}

PetscErrorCode SbNodalStressDestroy(SbNodalStress *stress)
{
  SbNodalStress s = *stress;

  PetscFunctionBeginUser;
  if (!s)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbRecoveryDestroy(&s->recovery));
  PetscCall(PetscFree4(s->factor, s->fit, s->value, s->T));
  PetscCall(PetscFree(s->point));
  PetscCall(PetscFree(*stress));
  PetscFunctionReturn(PETSC_SUCCESS);
}
