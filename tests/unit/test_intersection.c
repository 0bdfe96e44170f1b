// @ranks 1
/*
  Segments and triangles with vertices on a small lattice, with many contacts, coplanar and
  collinear cases: reported as intersecting exactly if a vertex or an edge has zero distance to the
  other, or if signs of integer volumes show that one crosses the other.
*/
#include <sbkernel.h>
#include "pair_reference.h"

static PetscReal volume(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3],
                        const PetscReal d[3])
{
  PetscReal u[3], v[3], w[3], n[3];

  for (int k = 0; k < 3; k++) {
    u[k] = a[k] - d[k];
    v[k] = b[k] - d[k];
    w[k] = c[k] - d[k];
  }
  SbCross(v, w, n);
  return SbDot3(u, n);
}

static long double distance(SbPairKind kind, const PetscReal *a, const PetscReal *b,
                            const PetscReal *c, const PetscReal *d)
{
  const PetscReal *from[4] = {a, b, c, d};
  long double x[12];

  for (int k = 0; k < 12; k++)
    x[k] = from[k / 3][k % 3];
  return pair_distance(kind, x);
}

static PetscBool meets(const PetscReal *p, const PetscReal *q, PetscReal const *const t[3])
{
  const PetscReal above = volume(t[0], t[1], t[2], p);
  const PetscReal below = volume(t[0], t[1], t[2], q);
  PetscReal side[3];
  PetscBool touch = (PetscBool)(distance(SB_PAIR_VERTEX_TRIANGLE, p, t[0], t[1], t[2]) < 1e-9L ||
                                distance(SB_PAIR_VERTEX_TRIANGLE, q, t[0], t[1], t[2]) < 1e-9L);

  for (int k = 0; k < 3; k++) {
    touch = (PetscBool)(touch || distance(SB_PAIR_EDGE_EDGE, p, q, t[k], t[(k + 1) % 3]) < 1e-9L);
    side[k] = volume(p, q, t[k], t[(k + 1) % 3]);
  }
  return (PetscBool)(touch ||
                     (above * below < 0 && side[0] * side[1] > 0 && side[1] * side[2] > 0));
}

int main(int argc, char **argv)
{
  PetscInt seen[2][2] = {{0}};

  SB_TEST_BEGIN(argc, argv);
  for (int i = 0; i < 40000; i++) {
    const PetscInt a[3] = {0, 1, 2};
    const PetscInt b[3] = {3, 4, 5};
    const PetscReal far = i % 3 ? 0 : 1 << 20;
    const PetscReal half = i % 4 ? 1 : 2.5;
    PetscReal x[18];
    PetscReal area[2] = {0, 0};
    PetscReal const *const t[2][3] = {{x, x + 3, x + 6}, {x + 9, x + 12, x + 15}};
    PetscBool expected = PETSC_FALSE;

    for (int k = 0; k < 18; k++)
      x[k] = far + PetscFloorReal(half * (1 + pair_random()));
    for (int s = 0; s < 2; s++) {
      PetscReal u[3], v[3], n[3];

      for (int k = 0; k < 3; k++) {
        u[k] = t[s][1][k] - t[s][0][k];
        v[k] = t[s][2][k] - t[s][0][k];
      }
      SbCross(u, v, n);
      area[s] = SbDot3(n, n);
    }
    if (area[0] == 0 || area[1] == 0)
      continue;
    for (int s = 0; s < 2; s++) {
      for (int k = 0; k < 3; k++) {
        const PetscBool one = meets(t[s][k], t[s][(k + 1) % 3], t[1 - s]);

        expected = (PetscBool)(expected || one);
        seen[0][one]++;
        SB_CHECK(SbSegmentMeetsTriangle(t[s][k], t[s][(k + 1) % 3], t[1 - s]) == one,
                 "case %d: edge %d of triangle %d should%s meet the other", i, k, s,
                 one ? "" : " not");
      }
    }
    seen[1][expected]++;
    SB_CHECK(SbTrianglesCross(x, a, b) == expected, "case %d: the triangles should%s meet", i,
             expected ? "" : " not");
  }
  SB_CHECK(seen[0][0] > 5000 && seen[0][1] > 5000 && seen[1][0] > 1000 && seen[1][1] > 1000,
           "%d and %d segments, %d and %d triangles", (int)seen[0][0], (int)seen[0][1],
           (int)seen[1][0], (int)seen[1][1]);
  SB_TEST_END();
}
