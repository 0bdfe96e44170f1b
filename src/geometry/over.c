/*
  over.c - what part of a triangle lies over another one.
*/
#include "sbgeometry.h"

int SbTriangleOver(const PetscReal *const v[3], const PetscReal n[3], const PetscReal *const w[3],
                   PetscReal corner[SB_OVER][3])
{
  PetscReal p[2][SB_OVER][3];
  int count = 3;
  int from = 0;

  for (int k = 0; k < 9; k++)
    p[0][k / 3][k % 3] = w[k / 3][k % 3];

  /* cut by the three planes through v's sides, one after the other */
  for (int side = 0; side < 3; side++, from = !from) {
    PetscReal edge[3], inwards[3];
    int kept = 0;

    SbSubtract(v[(side + 1) % 3], v[side], edge);
    SbCross(n, edge, inwards);
    for (int k = 0; k < count; k++) {
      const PetscReal *q = p[from][k];
      const PetscReal *r = p[from][(k + 1) % count];
      PetscReal to_q[3], to_r[3];

      SbSubtract(q, v[side], to_q);
      SbSubtract(r, v[side], to_r);

      const PetscReal in_q = SbDot3(inwards, to_q);
      const PetscReal in_r = SbDot3(inwards, to_r);

      for (int i = 0; in_q >= 0 && i < 3; i++)
        p[!from][kept][i] = q[i];
      kept += in_q >= 0;
      for (int i = 0; (in_q >= 0) != (in_r >= 0) && i < 3; i++)
        p[!from][kept][i] = q[i] + in_q / (in_q - in_r) * (r[i] - q[i]);
      kept += (in_q >= 0) != (in_r >= 0);
    }
    count = kept;
  }
  for (int k = 0; k < 3 * count; k++)
    corner[k / 3][k % 3] = p[from][k / 3][k % 3];
  return count;
}
