// @ranks 1
/*
  Point location in tets: against a search over all tets, at corners, outside, next to inverted
  tets, in curved ones. Shape quality of tets.
*/
#include "../../src/meshio/meshio_impl.h"
#include "../test.h"

#define N 6

/* Vertices of a box: mesh, with the interior ones moved. */
static PetscErrorCode make_box(PetscRandom random, SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(im, sizeof(*im)));
  PetscCall(SbImportRead_Box("box:1,2,0.5:6,6,6", im));
  for (PetscInt v = 0; v < im->nvert; v++) {
    const PetscReal size[3] = {1, 2, 0.5};

    for (int k = 0; k < 3; k++) {
      PetscReal r;

      PetscCall(PetscRandomGetValueReal(random, &r));
      if (im->x[3 * v + k] > 0 && im->x[3 * v + k] < size[k])
        im->x[3 * v + k] += 0.3 * (r - 0.5) * size[k] / N;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal depth_in(const SbImport *im, PetscInt c, const PetscReal p[3])
{
  const PetscInt *v = im->item[3].vert + 4 * c;
  const PetscReal whole = SbTetDeterminant(im->x, v);
  PetscReal depth = 1;

  for (int a = 0; a < 4; a++) {
    PetscReal x[12];
    static const PetscInt corner[4] = {0, 1, 2, 3};

    for (int i = 0; i < 12; i++)
      x[i] = i / 3 == a ? p[i % 3] : im->x[3 * v[i / 3] + i % 3];
    depth = PetscMin(depth, SbTetDeterminant(x, corner) / whole);
  }
  return depth;
}

static PetscErrorCode check_inside(PetscRandom random)
{
  SbLocator l;
  SbImport im;

  PetscFunctionBeginUser;
  PetscCall(make_box(random, &im));
  PetscCall(SbLocatorCreate(im.item[3].n, im.item[3].vert, im.x, NULL, &l));
  for (int i = 0; i < 300; i++) {
    PetscReal p[3], w[4];
    PetscReal best = -1;
    PetscReal at[3] = {0, 0, 0};
    PetscReal distance;
    PetscReal sum = 0;
    PetscInt cell;

    for (int k = 0; k < 3; k++)
      PetscCall(PetscRandomGetValueReal(random, &p[k]));
    p[1] *= 2;
    p[2] *= 0.5;
    distance = SbLocatorFind(l, p, &cell, w);
    for (PetscInt c = 0; c < im.item[3].n; c++)
      best = PetscMax(best, depth_in(&im, c, p));
    for (int a = 0; a < 4; a++) {
      sum += w[a];
      for (int k = 0; k < 3; k++)
        at[k] += w[a] * im.x[3 * im.item[3].vert[4 * cell + a] + k];
    }
    SB_CHECK(distance < 1e-12, "a point inside is %g away", distance);
    SB_CHECK_NEAR(sum, 1, 1e-14, "sum of weights");
    SB_CHECK_NEAR(depth_in(&im, cell, p), best, 1e-12, "depth in the tet that was found");
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(at[k], p[k], 1e-12, "place by the weights");
  }

  /* a vertex of the mesh */
  {
    PetscReal w[4];
    PetscReal most = 0;
    PetscInt cell;

    SB_CHECK(SbLocatorFind(l, im.x + 3 * 100, &cell, w) == 0, "a vertex is outside");
    for (int a = 0; a < 4; a++)
      most = PetscMax(most, im.item[3].vert[4 * cell + a] == 100 ? w[a] : 0);
    SB_CHECK_NEAR(most, 1, 1e-12, "weight of a vertex at its place");
  }
  PetscCall(SbLocatorDestroy(&l));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Curved tets, far from the origin too: a point with coordinates l is found in its tet, or on the
   face of a neighbour. */
static PetscErrorCode check_curved(PetscRandom random, PetscReal far)
{
  PetscReal *off;
  SbLocator l;
  SbImport im;

  PetscFunctionBeginUser;
  PetscCall(make_box(random, &im));
  for (PetscInt i = 0; i < 3 * im.nvert; i++)
    im.x[i] += far;
  PetscCall(PetscCalloc1(18 * im.item[3].n, &off));
  for (PetscInt i = 0; i < 6 * im.item[3].n; i++) {
    const PetscReal *x = im.x + 3 * im.item[3].vert[4 * (i / 6) + SbTetEdge[i % 6][0]];
    const PetscReal *y = im.x + 3 * im.item[3].vert[4 * (i / 6) + SbTetEdge[i % 6][1]];

    // the edges of a quarter of the box stay straight
    for (int k = 0; k < 3; k++) {
      const PetscReal d = x[(k + 1) % 3] - y[(k + 1) % 3];
      const PetscReal e = x[(k + 2) % 3] - y[(k + 2) % 3];

      off[3 * i + k] = x[0] + y[0] < 2 * far + 0.5 ? 0 : 0.4 * (d * d - d * e);
    }
  }
  PetscCall(SbLocatorCreate(im.item[3].n, im.item[3].vert, im.x, off, &l));
  for (PetscInt c = 0; c < im.item[3].n; c += 3) {
    PetscReal L[4], w[4];
    PetscReal sum = 0;
    PetscReal phi[SB_CELL_NODES], node[SB_CELL_NODES][3];
    PetscReal p[3] = {0};
    PetscReal at[3] = {0};
    PetscInt cell;

    for (int a = 0; a < 4; a++) {
      PetscCall(PetscRandomGetValueReal(random, &L[a]));
      sum += L[a];
    }
    for (int a = 0; a < 4; a++)
      L[a] /= sum;
    SbTetNodes(im.x, im.item[3].vert + 4 * c, off + 18 * c, node);
    SbQuadraticBasis(L, phi);
    for (int i = 0; i < 3 * SB_CELL_NODES; i++)
      p[i % 3] += phi[i / 3] * node[i / 3][i % 3];
    SB_CHECK(SbLocatorFind(l, p, &cell, w) < 1e-13 * (1 + far), "tet %d: a point of it is outside",
             (int)c);
    SB_CHECK(cell == c, "tet %d: found in %d", (int)c, (int)cell);
    for (int a = 0; a < 4; a++)
      SB_CHECK_NEAR(w[a], L[a], 1e-11 * (1 + far), "l");
    SbQuadraticBasis(w, phi);
    for (int i = 0; i < 3 * SB_CELL_NODES; i++)
      at[i % 3] += phi[i / 3] * node[i / 3][i % 3];
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(at[k], p[k], 1e-14 * (1 + far), "place by l");
  }
  PetscCall(SbLocatorDestroy(&l));
  PetscCall(PetscFree(off));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outside a box the closest point is known. */
static PetscErrorCode check_outside(void)
{
  const PetscReal p[3][3] = {{1.3, 0.7, 0.2}, {0.4, -0.5, 0.1}, {0.5, 0.9, 0.9}};
  const PetscReal expected[3] = {0.3, 0.5, 0.4};
  SbLocator l;
  SbImport im = {0};

  PetscFunctionBeginUser;
  PetscCall(SbImportRead_Box("box:1,2,0.5:6,6,6", &im));
  PetscCall(SbLocatorCreate(im.item[3].n, im.item[3].vert, im.x, NULL, &l));
  for (int i = 0; i < 3; i++) {
    PetscReal w[4];
    PetscInt cell;
    const PetscReal distance = SbLocatorFind(l, p[i], &cell, w);

    SB_CHECK(distance >= expected[i] - 1e-12 && distance < 1.1 * expected[i],
             "%g m from the box, expected %g", distance, expected[i]);
    for (int a = 0; a < 4; a++)
      SB_CHECK(w[a] >= 0 && w[a] <= 1, "weight %g", w[a]);
  }
  PetscCall(SbLocatorDestroy(&l));

  /* of two coincident tets the one that is not inverted contains the point */
  {
    const PetscReal x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal q[3] = {0.2, 0.2, 0.2};
    const PetscInt cells[8] = {0, 2, 1, 3, 0, 1, 2, 3};
    PetscReal w[4];
    PetscInt cell;

    PetscCall(SbLocatorCreate(2, cells, x, NULL, &l));
    SB_CHECK(SbLocatorFind(l, q, &cell, w) == 0 && cell == 1, "found in the tet %d", (int)cell);
    PetscCall(SbLocatorDestroy(&l));
    PetscCall(SbLocatorCreate(1, cells, x, NULL, &l));
    SB_CHECK(SbLocatorFind(l, q, &cell, w) == PETSC_MAX_REAL && cell == -1,
             "found among no tets: %d", (int)cell);
    PetscCall(SbLocatorDestroy(&l));

    // a point that is none
    PetscCall(SbLocatorCreate(1, cells + 4, x, NULL, &l));
    for (int i = 0; i < 2; i++) {
      const PetscReal none[3] = {0.2, i ? NAN : INFINITY, 0.2};

      SB_CHECK(SbLocatorFind(l, none, &cell, w) == PETSC_MAX_REAL && cell == -1 && w[0] == 0,
               "%g: found in the tet %d", none[1], (int)cell);
    }
    PetscCall(SbLocatorDestroy(&l));
  }
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void check_quality(void)
{
  const PetscReal regular[4][3] = {{1, 1, 1}, {-1, -1, 1}, {1, -1, -1}, {-1, 1, -1}};
  const PetscReal corner[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const PetscReal turned[4][3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  const PetscReal flat[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const PetscReal r = 1 / (3 + PetscSqrtReal(3));
  const PetscReal R = PetscSqrtReal(3) / 2;
  const PetscInt own[4] = {0, 1, 2, 3};

  SB_CHECK_NEAR(PetscAbsReal(SbTetQuality(regular[0], own)), 1, 1e-14,
                "quality of the regular tet");
  SB_CHECK_NEAR(SbTetQuality(corner[0], own), 3 * r / R, 1e-14, "quality of the corner of a cube");
  SB_CHECK_NEAR(SbTetQuality(turned[0], own), -3 * r / R, 1e-14, "quality of a tet inverted");
  SB_CHECK_NEAR(SbTetQuality(flat[0], own), 0, 0, "quality of a flat tet");
}

int main(int argc, char **argv)
{
  PetscRandom random;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 7));
  PetscCall(PetscRandomSeed(random));
  PetscCall(check_inside(random));
  PetscCall(check_curved(random, 0));
  PetscCall(check_curved(random, 1000));
  PetscCall(check_outside());
  check_quality();
  PetscCall(PetscRandomDestroy(&random));
  SB_TEST_END();
}
