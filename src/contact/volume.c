/*
  volume.c - k-DOPs (Klosowski, Held, Mitchell, Sowizral, Zikan 1998, "Efficient collision detection using bounding volume hierarchies of
  k-DOPs") and spheres.

  The directions of a k-DOP are the axes, then the four diagonals of the cube (14), or the six of its faces (18), or both (26). They are
  not unit vectors: a projection then is sums and differences only. Two k-DOPs are apart when they are so along one direction. A test
  is a comparison of four children at once for each bound, without a branch.

  Bounds are rounded outwards by two units in the last place of their own size, so that they are sharp near the origin; the caller puts
  that where the scene is.
*/
#include <float.h>
#include "volume.h"

#if defined(__SSE__)
  #include <xmmintrin.h>
#endif

enum { NSLAB = 13 };

static const int direction[NSLAB][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1}, {1, 1, 1},  {1, 1, -1},
                                        {1, -1, 1}, {-1, 1, 1}, {1, 1, 0}, {1, -1, 0}, {1, 0, 1},
                                        {1, 0, -1}, {0, 1, 1},  {0, 1, -1}};

/* Which row of the table slab s is: an 18-DOP has the diagonals of the faces and not those of the cube. */
static int direction_of(const SbVolume *v, int s)
{
  return v->nslab == 9 && s > 2 ? s + 4 : s;
}

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
#define ROW(f, r) (*(const Four *)((f) + (r)*lanes))

SB_INLINE FourBits slabs_out(const int from, const int to, const int lanes, const float a[], const float f[])
{
  FourBits out = {0, 0, 0, 0};

  for (int s = from; s < to; s++)
    out |= (ROW(f, 2 * s) > all(a[2 * s + 1])) | (ROW(f, 2 * s + 1) < all(a[2 * s]));
  return out;
}

SB_INLINE FourBits spheres_out(const int lanes, const float a[], const float f[])
{
  const Four x = ROW(f, 0) - all(a[0]), y = ROW(f, 1) - all(a[1]), z = ROW(f, 2) - all(a[2]);
  const Four r = ROW(f, 3) + all(a[3]);

  return x * x + y * y + z * z > r * r;
}

/* cos(alpha + beta) > 0 and product of the axes > sin(alpha + beta); a[3], a[4]: cosine and sine. */
SB_INLINE FourBits cones_out(const int lanes, const float a[], const float f[])
{
  const Four dot = all(a[0]) * ROW(f, 0) + all(a[1]) * ROW(f, 1) + all(a[2]) * ROW(f, 2);
  const Four sum_sine = all(a[4]) * ROW(f, 3) + all(a[3]) * ROW(f, 4);
  const Four sum_cosine = all(a[3]) * ROW(f, 3) - all(a[4]) * ROW(f, 4);

  return (dot > sum_sine + all(SB_CONE_GUARD)) & (sum_cosine > all(SB_CONE_GUARD));
}

SB_INLINE unsigned four_lanes(const int nslab, const int lanes, const int cull, const float a[],
                              const float f[])
{
  const int cone = nslab ? 2 * nslab : 4;
  FourBits out;

  if (nslab) {
    out = slabs_out(0, 3, lanes, a, f);
    /* most pairs that are apart are so along an axis */
    if (nslab > 3) {
      if (!in_lanes(out)) return 0;
      out |= slabs_out(3, nslab, lanes, a, f);
    }
  } else
    out = spheres_out(lanes, a, f);
  if (cull) out |= cones_out(lanes, a + cone, f + cone * lanes);
  return in_lanes(out);
}

/* No branch but over the pairs of eight lanes: which children meet cannot be foreseen. */
SB_INLINE SbMeets meet(const int nslab, const int lanes, const int cull, const float a[], PetscInt rows,
                       SbMeets wanted, const float f[])
{
  SbMeets in = 0;

  for (int c = 0; c < lanes; c++) {
    if (lanes > 4 && !(wanted >> lanes * c & 255)) continue;
    for (int l = 0; l < lanes; l += 4)
      in |= (SbMeets)four_lanes(nslab, lanes, cull, a + c * rows, f + l) << (lanes * c + l);
  }
  return in & wanted;
}

#define MEET(nslab, lanes, cull)                                                                 \
  static SbMeets meet_##nslab##_##lanes##_##cull(const float a[], PetscInt rows, SbMeets wanted, \
                                                 const float f[])                                \
  {                                                                                              \
    return meet(nslab, lanes, cull, a, rows, wanted, f);                                         \
  }
#define MEETS(nslab) MEET(nslab, 4, 0) MEET(nslab, 8, 0) MEET(nslab, 4, 1) MEET(nslab, 8, 1)
MEETS(0)
MEETS(3)
MEETS(7)
MEETS(9)
MEETS(13)

#define ENTRY(nslab, cull)                           \
  {                                                  \
    meet_##nslab##_4_##cull, meet_##nslab##_8_##cull \
  }
#define ENTRIES(nslab)               \
  {                                  \
    ENTRY(nslab, 0), ENTRY(nslab, 1) \
  }
static const SbVolumeMeet meets[5][2][2] = {ENTRIES(0), ENTRIES(3), ENTRIES(7), ENTRIES(9), ENTRIES(13)};

void SbVolumeSet(PetscInt k, PetscInt width, PetscBool cones, SbVolume *v)
{
  const int kind = k == 0 ? 0 : k == 6 ? 1 : k == 14 ? 2 : k == 18 ? 3 : 4;

  v->k = k;
  v->width = width;
  v->lanes = PetscMax(width, 4);
  v->nslab = (int)k / 2;
  v->cone = k ? (int)k : 4;
  v->rows = v->cone + (cones ? SB_VOLUME_CONE : 0);
  for (int i = 0; i < 3; i++) v->origin[i] = 0;
  for (int cull = 0; cull < 2; cull++) v->meet[cull] = meets[kind][cull][width == 8 ? 1 : 0];
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

/* The radius has room for the rounding of its centre and of the test. */
static void sphere_of(const SbVolume *v, int n, const PetscReal *const corner[], const PetscReal box[6],
                      PetscReal grow, SbBound column[])
{
  PetscReal most = 0, centre[3], far = 0;

  for (int i = 0; i < 3; i++) {
    centre[i] = (box[i] + box[3 + i]) / 2;
    column[i] = (float)(centre[i] - v->origin[i]);
    far = PetscMax(far, PetscAbsReal(centre[i] - v->origin[i]));
  }
  for (int c = 0; c < n; c++) {
    PetscReal d2 = 0;

    for (int i = 0; i < 3; i++) d2 += PetscSqr(corner[c][i] - centre[i]);
    most = PetscMax(most, d2);
  }
  column[3] = (float)((PetscSqrtReal(most) + grow) * (1 + 16 * (PetscReal)FLT_EPSILON) +
                      2 * rounding(box, grow) + 4 * (PetscReal)FLT_EPSILON * far);
}

static void slanted_slabs(const SbVolume *v, int n, const PetscReal *const corner[], const PetscReal box[6],
                          PetscReal grow, SbBound column[])
{
  const PetscReal room = rounding(box, grow), *o = v->origin;

  for (int s = 3; s < v->nslab; s++) {
    const int *d = direction[direction_of(v, s)];
    const PetscReal length = d[0] && d[1] && d[2] ? PetscSqrtReal(3) : PETSC_SQRT2;
    const PetscReal o_at = d[0] * o[0] + d[1] * o[1] + d[2] * o[2], wider = length * grow + 2 * room;
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
  if (!v->nslab) {
    sphere_of(v, n, corner, box, grow, column);
    return;
  }
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
  if (v->nslab) {
    for (int s = 0; s < v->nslab; s++) {
      column[2 * s] = far;
      column[2 * s + 1] = -far;
    }
  } else
    column[0] = far;
}

/* ------------------------------------------------------------------ around several */

static void merge_spheres(const SbBound block[], PetscInt row, PetscInt lane, PetscInt n, SbBound column[])
{
  float most = 0;

  for (int i = 0; i < 3; i++) {
    float low = FLT_MAX, high = -FLT_MAX;

    for (PetscInt l = 0; l < n; l++) {
      const float x = block[row * i + lane * l], r = block[row * 3 + lane * l];

      low = PetscMin(low, x - r);
      high = PetscMax(high, x + r);
    }
    column[i] = (low + high) / 2;
  }
  for (PetscInt l = 0; l < n; l++) {
    float d2 = 0;

    for (int i = 0; i < 3; i++) d2 += PetscSqr(block[row * i + lane * l] - column[i]);
    most = PetscMax(most, sqrtf(d2) + block[row * 3 + lane * l]);
  }
  column[3] = most * (1 + 8 * FLT_EPSILON);
}

/* Of all lanes: those without a child are as SbVolumeNone() has them, and change nothing. */
SB_INLINE void merge_slabs(const int nslab, const int lanes, const SbBound block[], PetscInt row,
                           PetscInt lane, SbBound column[])
{
  for (int s = 0; s < nslab; s++) {
    const SbBound *low = block + row * 2 * s, *high = low + row;
    float least = low[0], most = high[0];

    for (int l = 1; l < lanes; l++) {
      least = PetscMin(least, low[lane * l]);
      most = PetscMax(most, high[lane * l]);
    }
    column[2 * s] = least;
    column[2 * s + 1] = most;
  }
}

void SbVolumeMerge(const SbVolume *v, const SbBound block[], PetscInt row, PetscInt lane, PetscInt n,
                   SbBound column[])
{
  if (!v->nslab)
    merge_spheres(block, row, lane, n, column);
  else if (v->nslab == 3 && v->lanes == 4)
    merge_slabs(3, 4, block, row, lane, column);
  else
    merge_slabs(v->nslab, (int)v->lanes, block, row, lane, column);
}

PetscReal SbVolumeSize(const SbVolume *v, const SbBound column[])
{
  PetscReal e[3];

  if (!v->nslab) return PetscSqr((PetscReal)column[3]);
  for (int i = 0; i < 3; i++) e[i] = (PetscReal)(column[2 * i + 1] - column[2 * i]);
  return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}
