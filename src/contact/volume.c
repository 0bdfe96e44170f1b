/*
  volume.c - boxes, and k-DOPs (Klosowski, Held, Mitchell, Sowizral, Zikan 1998, "Efficient collision detection using bounding volume
  hierarchies of k-DOPs") of 14 planes.

  The directions of a k-DOP are the axes and the four diagonals of the cube. They are not unit vectors: a projection then is sums and
  differences only. Two k-DOPs are apart when they are so along one direction. A test is a comparison of four children at once for each
  bound, without a branch.

  Bounds are rounded outwards by two units in the last place of their own size, so that they are sharp near the origin; the caller puts
  that where the scene is.
*/
#include <float.h>
#include "volume.h"

#if defined(__SSE__)
  #include <xmmintrin.h>
#endif

static const int direction[7][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1}, {1, 1, 1},
                                    {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};

/* ------------------------------------------------------------------ the test, for every choice of constants */

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));
typedef int FourBits __attribute__((vector_size(16)));

/* Lanes that are not out. */
SB_INLINE unsigned in_lanes(FourBits out)
{
#if defined(__SSE__)
  return (unsigned)_mm_movemask_ps((__m128)out) ^ 15u;
#else
  return ((unsigned)out[0] & 1u) ^ 1u | ((unsigned)out[1] & 2u) ^ 2u | ((unsigned)out[2] & 4u) ^ 4u |
         ((unsigned)out[3] & 8u) ^ 8u;
#endif
}

SB_INLINE Four all(float a)
{
  return (Four){a, a, a, a};
}

/* Row r of four lanes. */
#define ROW(f, r) (*(const Four *)((f) + (r)*SB_TREE_WIDTH))

SB_INLINE FourBits slabs_out(const int from, const int to, const float a[], const float f[])
{
  FourBits out = {0, 0, 0, 0};

  for (int s = from; s < to; s++)
    out |= (ROW(f, 2 * s) > all(a[2 * s + 1])) | (ROW(f, 2 * s + 1) < all(a[2 * s]));
  return out;
}

/* cos(alpha + beta) > 0 and product of the axes > sin(alpha + beta); a[3], a[4]: cosine and sine. */
SB_INLINE FourBits cones_out(const float a[], const float f[])
{
  const Four dot = all(a[0]) * ROW(f, 0) + all(a[1]) * ROW(f, 1) + all(a[2]) * ROW(f, 2);
  const Four sum_sine = all(a[4]) * ROW(f, 3) + all(a[3]) * ROW(f, 4);
  const Four sum_cosine = all(a[3]) * ROW(f, 3) - all(a[4]) * ROW(f, 4);

  return (dot > sum_sine + all(SB_CONE_GUARD)) & (sum_cosine > all(SB_CONE_GUARD));
}

SB_INLINE unsigned four_lanes(const int nslab, const int cull, const float a[], const float f[])
{
  FourBits out = slabs_out(0, 3, a, f);

  /* most pairs that are apart are so along an axis */
  if (nslab > 3) {
    if (!in_lanes(out)) return 0;
    out |= slabs_out(3, nslab, a, f);
  }
  if (cull) out |= cones_out(a + 2 * nslab, f + 2 * nslab * SB_TREE_WIDTH);
  return in_lanes(out);
}

/* No branch but over the pairs of eight lanes: which children meet cannot be foreseen. */
SB_INLINE SbMeets meet(const int nslab, const int cull, const float a[], PetscInt rows, SbMeets wanted,
                       const float f[])
{
  SbMeets in = 0;

  for (int c = 0; c < SB_TREE_WIDTH; c++) {
    if (!(wanted >> SB_TREE_WIDTH * c & 255)) continue;
    for (int l = 0; l < SB_TREE_WIDTH; l += 4)
      in |= (SbMeets)four_lanes(nslab, cull, a + c * rows, f + l) << (SB_TREE_WIDTH * c + l);
  }
  return in & wanted;
}

#define MEET(nslab, cull)                                                                               \
  static SbMeets meet_##nslab##_##cull(const float a[], PetscInt rows, SbMeets wanted, const float f[]) \
  {                                                                                                     \
    return meet(nslab, cull, a, rows, wanted, f);                                                       \
  }
MEET(3, 0)
MEET(3, 1)
MEET(7, 0)
MEET(7, 1)

void SbVolumeSet(PetscInt k, PetscBool cones, SbVolume *v)
{
  *v = (SbVolume){.nslab = (int)k / 2, .cone = (int)k, .rows = (int)k + (cones ? SB_VOLUME_CONE : 0)};
  v->meet[0] = k == 6 ? meet_3_0 : meet_7_0;
  v->meet[1] = k == 6 ? meet_3_1 : meet_7_1;
}

/* ------------------------------------------------------------------ columns */

static inline float rounded(PetscReal x, float to)
{
  const float f = (float)x;

  return f + to * (2 * FLT_EPSILON * fabsf(f) + FLT_MIN);
}

/* Room for the rounding of a projection: three terms, each below the largest coordinate. */
static PetscReal rounding(const PetscReal box[6], PetscReal grow)
{
  PetscReal most = grow;

  for (int i = 0; i < 6; i++) most = PetscMax(most, PetscAbsReal(box[i]));
  return 16 * PETSC_MACHINE_EPSILON * most;
}

static void slanted_slabs(const SbVolume *v, int n, const PetscReal *const corner[], const PetscReal box[6],
                          PetscReal grow, SbBound column[])
{
  const PetscReal room = rounding(box, grow), *o = v->origin;

  for (int s = 3; s < v->nslab; s++) {
    const int *d = direction[s];
    const PetscReal o_at = d[0] * o[0] + d[1] * o[1] + d[2] * o[2],
                    wider = PetscSqrtReal(3) * grow + 2 * room;
    PetscReal low = PETSC_MAX_REAL, high = PETSC_MIN_REAL;

    for (int c = 0; c < n; c++) {
      const PetscReal at = d[0] * corner[c][0] + d[1] * corner[c][1] + d[2] * corner[c][2] - o_at;

      low = PetscMin(low, at);
      high = PetscMax(high, at);
    }
    column[2 * s] = rounded(low - wider, -1);
    column[2 * s + 1] = rounded(high + wider, 1);
  }
}

void SbVolumeOf(const SbVolume *v, int n, const PetscReal *const corner[], const PetscReal box[6],
                PetscReal grow, SbBound column[])
{
  for (int i = 0; i < 3; i++) {
    column[2 * i] = rounded(box[i] - v->origin[i], -1);
    column[2 * i + 1] = rounded(box[3 + i] - v->origin[i], 1);
  }
  if (v->nslab > 3) slanted_slabs(v, n, corner, box, grow, column);
}

void SbVolumeNone(const SbVolume *v, SbBound column[])
{
  const float far = 1e30f;

  for (int r = 0; r < v->rows; r++) column[r] = 0;
  for (int s = 0; s < v->nslab; s++) {
    column[2 * s] = far;
    column[2 * s + 1] = -far;
  }
}

/* ------------------------------------------------------------------ around several */

/* The number of slabs is a constant in each use. */
SB_INLINE void merge_slabs(const int nslab, const SbBound block[], PetscInt row, PetscInt lane,
                           SbBound column[])
{
  for (int s = 0; s < nslab; s++) {
    const SbBound *low = block + row * 2 * s, *high = low + row;
    float least = low[0], most = high[0];

    for (int l = 1; l < SB_TREE_WIDTH; l++) {
      least = PetscMin(least, low[lane * l]);
      most = PetscMax(most, high[lane * l]);
    }
    column[2 * s] = least;
    column[2 * s + 1] = most;
  }
}

void SbVolumeMerge(const SbVolume *v, const SbBound block[], PetscInt row, PetscInt lane, SbBound column[])
{
  if (v->nslab == 3)
    merge_slabs(3, block, row, lane, column);
  else
    merge_slabs(7, block, row, lane, column);
}

PetscReal SbVolumeSize(const SbBound column[])
{
  PetscReal e[3];

  for (int i = 0; i < 3; i++) e[i] = (PetscReal)(column[2 * i + 1] - column[2 * i]);
  return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}
