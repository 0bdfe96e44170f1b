/*
  locate.c - point location: the tet that contains a point, or the nearest one.

  A point is in a tet if none of its barycentric coordinates w is negative. For a point outside,
  negative ones are set to zero and the others scaled to the sum 1; the distance to that point
  bounds the distance to the tet from above, and limits the search in the box tree.

  In a curved tet, x(l) = sum_a phi_a(l) x_a, l is found by Newton's method from the coordinates in
  the straight tet: with the corners c_i of the P1 tet that has the derivatives of the map at l
  (quadratic_map.c), the next l are the barycentric coordinates in it of p - x(l) + sum l_i c_i. Its
  box is that of the corners and the edge midpoints shifted by twice the offsets of the edge nodes
  (Bernstein form).
*/
#include "sbgeometry.h"

PetscReal SbTetDeterminant(const PetscReal x[], const PetscInt v[4])
{
  PetscReal e[9];

  for (int k = 0; k < 3; k++)
    SbSubtract(x + 3 * v[k + 1], x + 3 * v[0], e + 3 * k);
  return SbMatDet(e);
}

struct _p_SbLocator {
  const PetscInt *cell;
  const PetscReal *x, *edge_off;
  SbBoxTree tree; /* boxes of the tets; those of flat and inverted tets are empty */
};

#define STEPS 20    /* largest number of Newton iterations; 3 to 6 are needed */
#define CLOSE 1e-14 /* tolerance of Newton's method over the diagonal of the tet */

void SbTetNodes(const PetscReal x[], const PetscInt v[4], const PetscReal off[18],
                PetscReal node[SB_CELL_NODES][3])
{
  for (int k = 0; k < 12; k++)
    node[k / 3][k % 3] = x[3 * v[k / 3] + k % 3];
  for (int k = 0; k < 18; k++)
    node[4 + k / 3][k % 3] =
      0.5 * (x[3 * v[SbTetEdge[k / 3][0]] + k % 3] + x[3 * v[SbTetEdge[k / 3][1]] + k % 3]) +
      off[k];
}

/* Edge offsets of a curved cell; NULL: straight. */
static const PetscReal *off_of(SbLocator l, PetscInt cell)
{
  const PetscReal *off = l->edge_off ? l->edge_off + 18 * (size_t)cell : NULL;

  for (int k = 0; off && k < 18; k++)
    if (off[k] != 0)
      return off;
  return NULL;
}

/* r = p - x(w), relative to the first corner for accuracy far from the origin. */
static void remainder_at(const PetscReal node[SB_CELL_NODES][3], const PetscReal p[3],
                         const PetscReal w[4], PetscReal r[3])
{
  PetscReal phi[SB_CELL_NODES];

  SbQuadraticBasis(w, phi);
  for (int k = 0; k < 3; k++) {
    r[k] = p[k] - node[0][k];
    for (int a = 1; a < SB_CELL_NODES; a++)
      r[k] -= phi[a] * (node[a][k] - node[0][k]);
  }
}

PetscBool SbTetCurvedBarycentric(const PetscReal x[], const PetscInt v[4], const PetscReal off[18],
                                 const PetscReal p[3], PetscReal w[4])
{
  static const PetscInt own[4] = {0, 1, 2, 3};
  PetscReal node[SB_CELL_NODES][3], box[6];

  SbTetNodes(x, v, off, node);
  SbBoxClear(box);
  for (int a = 0; a < SB_CELL_NODES; a++)
    SbBoxAdd(box, node[a]);
  SbTetBarycentric(x, v, p, w);
  for (int i = 0; i < STEPS; i++) {
    PetscReal corner[4][3], r[3];

    remainder_at((const PetscReal(*)[3])node, p, w, r);
    if (SbDot3(r, r) <= PetscSqr(CLOSE * SbBoxDiagonal(box)))
      return PETSC_TRUE;
    SbQuadraticCorners(w, (const PetscReal(*)[3])node, corner);
    for (int k = 0; k < 3; k++)
      for (int a = 0; a < 4; a++)
        r[k] += w[a] * corner[a][k];
    SbTetBarycentric(&corner[0][0], own, r, w);
  }
  return PETSC_FALSE;
}

PetscErrorCode SbLocatorCreate(PetscInt ncell, const PetscInt cell[], const PetscReal x[],
                               const PetscReal edge_off[], SbLocator *locator)
{
  SbLocator l;
  PetscReal(*box)[6];

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&l));
  *locator = l;
  l->cell = cell;
  l->x = x;
  l->edge_off = edge_off;
  PetscCall(PetscMalloc1(ncell, &box));
  for (PetscInt c = 0; c < ncell; c++) {
    SbBoxClear(box[c]);
    if (!(SbTetDeterminant(x, cell + 4 * c) > 0))
      continue;
    for (int a = 0; a < 4; a++)
      SbBoxAdd(box[c], x + 3 * cell[4 * c + a]);
    if (off_of(l, c)) {
      PetscReal node[SB_CELL_NODES][3], twice[18];

      for (int k = 0; k < 18; k++)
        twice[k] = 2 * edge_off[18 * (size_t)c + k];
      SbTetNodes(x, cell + 4 * c, twice, node);
      for (int a = 4; a < SB_CELL_NODES; a++)
        SbBoxAdd(box[c], node[a]);
    }
  }
  PetscCall(SbBoxTreeCreate(ncell, (const PetscReal(*)[6])box, &l->tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLocatorDestroy(SbLocator *locator)
{
  PetscFunctionBeginUser;
  if (*locator)
    PetscCall(SbBoxTreeDestroy(&(*locator)->tree));
  PetscCall(PetscFree(*locator));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ratios of determinants: signed volumes of the tets of the point and each face, over that of the
   tet. */
void SbTetBarycentric(const PetscReal x[], const PetscInt v[4], const PetscReal p[3],
                      PetscReal w[4])
{
  PetscReal e[3][3], r[3], n[3], det;

  for (int k = 0; k < 3; k++)
    SbSubtract(x + 3 * v[k + 1], x + 3 * v[0], e[k]);
  SbSubtract(p, x + 3 * v[0], r);
  SbCross(e[1], e[2], n);
  det = SbDot3(e[0], n);
  w[1] = SbDot3(r, n) / det;
  SbCross(r, e[2], n);
  w[2] = SbDot3(e[0], n) / det;
  SbCross(e[1], r, n);
  w[3] = SbDot3(e[0], n) / det;
  w[0] = 1 - w[1] - w[2] - w[3];
}

PetscReal SbLocatorFind(SbLocator l, const PetscReal p[3], PetscInt *cell, PetscReal weight[4])
{
  const PetscReal box[6] = {p[0], p[1], p[2], p[0], p[1], p[2]};
  PetscReal deepest = 0;
  SbBoxNearest nearest;
  PetscInt c;

  *cell = -1;
  for (int a = 0; a < 4; a++)
    weight[a] = 0;
  for (SbBoxNearestBegin(&l->tree, box, PETSC_MAX_REAL, &nearest);
       SbBoxNearestNext(&nearest, &c);) {
    const PetscReal *off = off_of(l, c);
    const PetscInt *v = l->cell + 4 * c;
    PetscReal w[4], node[SB_CELL_NODES][3], r[3], depth;
    PetscReal sum = 0;
    PetscReal d2 = 0;
    PetscBool found = PETSC_TRUE;

    if (off)
      found = SbTetCurvedBarycentric(l->x, v, off, p, w);
    else
      SbTetBarycentric(l->x, v, p, w);
    depth = PetscMin(PetscMin(w[0], w[1]), PetscMin(w[2], w[3]));
    if (!found || depth < 0) {
      // outside: the place of the clipped coordinates, near the closest one
      for (int a = 0; a < 4; a++)
        sum += w[a] = PetscIsInfOrNanReal(w[a]) ? 1 : PetscMax(w[a], 0);
      for (int a = 0; a < 4; a++)
        w[a] /= sum;
      for (int k = 0; k < 3 && !off; k++) {
        r[k] = p[k];
        for (int a = 0; a < 4; a++)
          r[k] -= w[a] * l->x[3 * v[a] + k];
      }
      if (off) {
        SbTetNodes(l->x, v, off, node);
        remainder_at((const PetscReal(*)[3])node, p, w, r);
      }
      d2 = SbDot3(r, r);
    }
    if (!(d2 <= nearest.limit2))
      continue;

    // of equally near ones the deepest, of equally deep ones the first
    if (*cell >= 0 && d2 == nearest.limit2) {
      if (depth < deepest || (depth == deepest && c > *cell))
        continue;
    }
    nearest.limit2 = d2;
    deepest = depth;
    *cell = c;
    for (int a = 0; a < 4; a++)
      weight[a] = w[a];
  }
  return *cell < 0 ? PETSC_MAX_REAL : PetscSqrtReal(nearest.limit2);
}
