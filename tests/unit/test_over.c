// @ranks 1
/*
  The part of a triangle that lies over another one: in one plane its area is the same both ways,
  the sum over the pieces of a triangle is that of the whole, a triangle inside is over as a whole,
  and lifting corners out of the plane changes nothing as seen along the normal.
*/
#include <sbgeometry.h>
#include "pair_reference.h"

#define CASES 2000

/* The area of the part of w over v, seen along z; v and w counter-clockwise. */
static PetscReal over(PetscReal v[3][3], PetscReal w[3][3], int *n)
{
  static const PetscReal up[3] = {0, 0, 3};
  const PetscReal *const of_v[3] = {v[0], v[1], v[2]};
  const PetscReal *const of_w[3] = {w[0], w[1], w[2]};
  PetscReal corner[SB_OVER][3];
  PetscReal area = 0;

  *n = SbTriangleOver(of_v, up, of_w, corner);
  for (int k = 1; k + 1 < *n; k++)
    area += ((corner[k][0] - corner[0][0]) * (corner[k + 1][1] - corner[0][1]) -
             (corner[k][1] - corner[0][1]) * (corner[k + 1][0] - corner[0][0])) /
            2;
  return area;
}

/* A random triangle in the plane z = 0, counter-clockwise. */
static void triangle(PetscReal x[3][3])
{
  for (int k = 0; k < 9; k++)
    x[k / 3][k % 3] = k % 3 < 2 ? pair_random() : 0;
  if ((x[1][0] - x[0][0]) * (x[2][1] - x[0][1]) < (x[1][1] - x[0][1]) * (x[2][0] - x[0][0]))
    for (int k = 0; k < 2; k++) {
      const PetscReal swap = x[1][k];

      x[1][k] = x[2][k];
      x[2][k] = swap;
    }
}

int main(int argc, char **argv)
{
  int met = 0;
  int apart = 0;

  SB_TEST_BEGIN(argc, argv);
  for (int i = 0; i < CASES; i++) {
    PetscReal v[3][3], w[3][3], in[3][3];
    PetscReal sum = 0;
    int n, m;

    triangle(v);
    triangle(w);
    const PetscReal whole = over(v, w, &n);
    const PetscReal other = over(w, v, &m);

    met += whole > 0;
    apart += n < 3;
    SB_CHECK(whole >= 0 && n < SB_OVER && PetscAbsReal(whole - other) < 1e-13,
             "case %d: %g one way, %g the other", i, (double)whole, (double)other);

    /* w in three pieces about its centre */
    for (int k = 0; k < 3; k++) {
      PetscReal piece[3][3];

      for (int c = 0; c < 3; c++) {
        piece[0][c] = w[k][c];
        piece[1][c] = w[(k + 1) % 3][c];
        piece[2][c] = (w[0][c] + w[1][c] + w[2][c]) / 3;
      }
      sum += over(v, piece, &m);
    }
    SB_CHECK(PetscAbsReal(sum - whole) < 1e-13, "case %d: pieces %g, whole %g", i, (double)sum,
             (double)whole);

    /* v, shrunk to its half about its centre, is inside */
    for (int k = 0; k < 9; k++)
      in[k / 3][k % 3] = v[k / 3][k % 3] / 2 + (v[0][k % 3] + v[1][k % 3] + v[2][k % 3]) / 6;
    sum = over(v, in, &m) - over(in, in, &n);
    SB_CHECK(m == 3 && PetscAbsReal(sum) < 1e-14, "case %d: %d corners of a triangle inside", i, m);

    /* lifted out of the plane */
    for (int k = 0; k < 3; k++)
      w[k][2] = pair_random();
    sum = over(v, w, &m);
    SB_CHECK(PetscAbsReal(sum - whole) < 1e-13, "case %d: lifted %g, whole %g", i, (double)sum,
             (double)whole);
  }
  SB_CHECK(met > CASES / 4 && apart > CASES / 20, "%d met, %d apart", met, apart);
  SB_TEST_END();
}
