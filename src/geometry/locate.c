/*
  locate.c - which tet holds a point.

  The box around all tets is cut into about as many equal bins as there are tets, each with the list of tets whose boxes meet it. A point asks its own
  bin, then the rings of bins around it until one more ring than the first that had a tet: of a point in no tet the nearest place
  is then found but for a small error, which does not matter to what lies outside by rounding or between two
  triangulations of a curved surface.

  With the weights w of the corners of a tet (barycentric coordinates) the point lies in it when none is negative. Outside, negative ones are set to
  zero and the others scaled to the sum 1; the distance is that from the place so found.
*/
#include "sbgeometry.h"

PetscReal SbTetDeterminant(const PetscReal x[], const PetscInt v[4])
{
  const PetscReal *p = x + 3 * v[0], *q = x + 3 * v[1], *r = x + 3 * v[2], *s = x + 3 * v[3];
  const PetscReal a[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
  const PetscReal b[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
  const PetscReal c[3] = {s[0] - p[0], s[1] - p[1], s[2] - p[2]};

  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

struct _p_SbLocator {
  PetscInt ncell;
  const PetscInt *cell;
  const PetscReal *x;
  PetscInt n[3];          /* bins */
  PetscReal low[3], h[3]; /* m */
  PetscInt *start, *item; /* [bins + 1] into item: cells */
};

static PetscInt bin_of(const SbLocator l, int k, PetscReal x)
{
  const PetscReal at = (x - l->low[k]) / l->h[k];

  return at > 0 ? PetscMin((PetscInt)PetscMin(at, 1e6), l->n[k] - 1) : 0;
}

/* The bins that the box of a cell meets: from[3] to to[3]. */
static void bins_of(const SbLocator l, PetscInt c, PetscInt from[3], PetscInt to[3])
{
  for (int k = 0; k < 3; k++) {
    PetscReal low = l->x[3 * l->cell[4 * c] + k], high = low;

    for (int a = 1; a < 4; a++) {
      low = PetscMin(low, l->x[3 * l->cell[4 * c + a] + k]);
      high = PetscMax(high, l->x[3 * l->cell[4 * c + a] + k]);
    }
    from[k] = bin_of(l, k, low);
    to[k] = bin_of(l, k, high);
  }
}

static inline PetscInt bin(const SbLocator l, PetscInt i, PetscInt j, PetscInt k)
{
  return (k * l->n[1] + j) * l->n[0] + i;
}

/* Adds the cells to their bins: counts them, or writes them. */
static void visit_bins(SbLocator l, PetscBool write)
{
  for (PetscInt c = 0; c < l->ncell; c++) {
    PetscInt from[3], to[3];

    if (!(SbTetDeterminant(l->x, l->cell + 4 * c) > 0)) continue;
    bins_of(l, c, from, to);
    for (PetscInt k = from[2]; k <= to[2]; k++) {
      for (PetscInt j = from[1]; j <= to[1]; j++) {
        for (PetscInt i = from[0]; i <= to[0]; i++) {
          const PetscInt b = bin(l, i, j, k);

          if (write)
            l->item[l->start[b]++] = c;
          else
            l->start[b + 1]++;
        }
      }
    }
  }
}

/* About one bin for each cell, nearest to cubes. */
static void choose_bins(SbLocator l)
{
  PetscReal high[3] = {0, 0, 0}, size[3], volume = 1, side;

  for (PetscInt i = 0; i < 4 * l->ncell; i++) {
    for (int k = 0; k < 3; k++) {
      const PetscReal x = l->x[3 * l->cell[i] + k];

      l->low[k] = i ? PetscMin(l->low[k], x) : x;
      high[k] = i ? PetscMax(high[k], x) : x;
    }
  }
  for (int k = 0; k < 3; k++) {
    size[k] = PetscMax(high[k] - l->low[k], PETSC_MACHINE_EPSILON * (1 + PetscAbsReal(high[k])));
    volume *= size[k];
  }
  side = PetscPowReal(volume / (PetscReal)PetscMax(l->ncell, 1), 1. / 3);
  for (int k = 0; k < 3; k++) {
    l->n[k] = (PetscInt)PetscMax(1, PetscMin(size[k] / side, 400));
    l->h[k] = size[k] / (PetscReal)l->n[k];
  }
}

PetscErrorCode SbLocatorCreate(PetscInt ncell, const PetscInt cell[], const PetscReal x[], SbLocator *locator)
{
  SbLocator l;
  PetscInt nbin;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&l));
  l->ncell = ncell;
  l->cell = cell;
  l->x = x;
  choose_bins(l);
  nbin = l->n[0] * l->n[1] * l->n[2];
  PetscCall(PetscCalloc1(nbin + 1, &l->start));
  visit_bins(l, PETSC_FALSE);
  for (PetscInt b = 0; b < nbin; b++) l->start[b + 1] += l->start[b];
  PetscCall(PetscMalloc1(l->start[nbin], &l->item));
  visit_bins(l, PETSC_TRUE);
  /* writing has moved every start to the next one */
  for (PetscInt b = nbin; b > 0; b--) l->start[b] = l->start[b - 1];
  l->start[0] = 0;
  *locator = l;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLocatorDestroy(SbLocator *locator)
{
  PetscFunctionBeginUser;
  if (!*locator) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*locator)->start));
  PetscCall(PetscFree((*locator)->item));
  PetscCall(PetscFree(*locator));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volumes of the tets that the point makes with the faces, over that of the tet. */
void SbTetBarycentric(const PetscReal x[], const PetscInt v[4], const PetscReal p[3], PetscReal w[4])
{
  PetscReal a[3], b[3], d[3], r[3], det;

  for (int k = 0; k < 3; k++) {
    a[k] = x[3 * v[1] + k] - x[3 * v[0] + k];
    b[k] = x[3 * v[2] + k] - x[3 * v[0] + k];
    d[k] = x[3 * v[3] + k] - x[3 * v[0] + k];
    r[k] = p[k] - x[3 * v[0] + k];
  }
  det = a[0] * (b[1] * d[2] - b[2] * d[1]) + a[1] * (b[2] * d[0] - b[0] * d[2]) +
        a[2] * (b[0] * d[1] - b[1] * d[0]);
  w[1] = (r[0] * (b[1] * d[2] - b[2] * d[1]) + r[1] * (b[2] * d[0] - b[0] * d[2]) +
          r[2] * (b[0] * d[1] - b[1] * d[0])) /
         det;
  w[2] = (a[0] * (r[1] * d[2] - r[2] * d[1]) + a[1] * (r[2] * d[0] - r[0] * d[2]) +
          a[2] * (r[0] * d[1] - r[1] * d[0])) /
         det;
  w[3] = (a[0] * (b[1] * r[2] - b[2] * r[1]) + a[1] * (b[2] * r[0] - b[0] * r[2]) +
          a[2] * (b[0] * r[1] - b[1] * r[0])) /
         det;
  w[0] = 1 - w[1] - w[2] - w[3];
}

void SbLocatorBarycentric(SbLocator l, PetscInt c, const PetscReal p[3], PetscReal w[4])
{
  SbTetBarycentric(l->x, l->cell + 4 * c, p, w);
}

/* Moves weights into the tet; returns the distance, and how deep the point lies when it is 0. */
static PetscReal enter(const SbLocator l, PetscInt c, const PetscReal p[3], PetscReal w[4], PetscReal *depth)
{
  PetscReal sum = 0, distance = 0;

  *depth = PetscMin(PetscMin(w[0], w[1]), PetscMin(w[2], w[3]));
  if (*depth >= 0) return 0;
  for (int a = 0; a < 4; a++) sum += w[a] = PetscMax(w[a], 0);
  for (int a = 0; a < 4; a++) w[a] /= sum;
  for (int k = 0; k < 3; k++) {
    PetscReal at = 0;

    for (int a = 0; a < 4; a++) at += w[a] * l->x[3 * l->cell[4 * c + a] + k];
    distance += PetscSqr(p[k] - at);
  }
  return PetscSqrtReal(distance);
}

/* The best place so far. */
typedef struct {
  PetscInt cell;
  PetscReal distance, depth, weight[4];
} Best;

static void try_cell(const SbLocator l, PetscInt c, const PetscReal p[3], Best *best)
{
  PetscReal w[4], depth, distance;
  PetscBool better;

  SbLocatorBarycentric(l, c, p, w);
  distance = enter(l, c, p, w, &depth);
  better = (PetscBool)(best->cell < 0 || distance < best->distance ||
                       (distance == best->distance &&
                        (depth > best->depth || (depth == best->depth && c < best->cell))));
  if (!better) return;
  best->cell = c;
  best->distance = distance;
  best->depth = depth;
  for (int a = 0; a < 4; a++) best->weight[a] = w[a];
}

/* The bins at the distance `ring` from one. */
static void try_ring(const SbLocator l, const PetscInt at[3], PetscInt ring, const PetscReal p[3], Best *best)
{
  for (PetscInt k = PetscMax(0, at[2] - ring); k <= PetscMin(l->n[2] - 1, at[2] + ring); k++) {
    for (PetscInt j = PetscMax(0, at[1] - ring); j <= PetscMin(l->n[1] - 1, at[1] + ring); j++) {
      for (PetscInt i = PetscMax(0, at[0] - ring); i <= PetscMin(l->n[0] - 1, at[0] + ring); i++) {
        const PetscInt b = bin(l, i, j, k);

        if (PetscMax(PetscMax(PetscAbsInt(i - at[0]), PetscAbsInt(j - at[1])), PetscAbsInt(k - at[2])) < ring)
          continue;
        for (PetscInt m = l->start[b]; m < l->start[b + 1]; m++) try_cell(l, l->item[m], p, best);
      }
    }
  }
}

PetscReal SbLocatorFind(SbLocator l, const PetscReal p[3], PetscInt *cell, PetscReal weight[4])
{
  const PetscInt at[3] = {bin_of(l, 0, p[0]), bin_of(l, 1, p[1]), bin_of(l, 2, p[2])};
  const PetscInt most = PetscMax(PetscMax(l->n[0], l->n[1]), l->n[2]);
  Best best = {.cell = -1};
  PetscInt last = most;

  for (PetscInt ring = 0; ring <= last; ring++) {
    const PetscBool none = (PetscBool)(best.cell < 0);

    try_ring(l, at, ring, p, &best);
    if (best.cell >= 0 && best.distance == 0) break;
    if (none && best.cell >= 0) last = PetscMin(most, ring + 1);
  }
  *cell = best.cell;
  for (int a = 0; a < 4; a++) weight[a] = best.cell < 0 ? 0 : best.weight[a];
  return best.cell < 0 ? PETSC_MAX_REAL : best.distance;
}
