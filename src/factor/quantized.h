/*
  quantized.h - dense panels in 16-bit integers, for triangular solves limited by memory bandwidth:
  factor.c, interface.c.

  Entries are 16-bit integers times a scale per column. Two entries share a 32-bit word, so that
  reading them costs little more than a conversion: the word shifted up is the lower entry; the
  unshifted word is HALF times the upper entry, with the lower entry as a fraction that rounding has
  accounted for. A panel has at most 3 PANEL columns; its rows lie in blocks of ROWS, each
  [column][row], so that both products read memory in order.
*/
#pragma once
#if defined(__linux__)
  #include <sys/mman.h>
#endif
#include "sbkernel.h"

#define PANEL 32 /* nodes per panel */
#define ROWS 64  /* unknowns in a block of rows */
#define WIDTH 16 /* words per vector operation */
#define PAIR 32  /* entries in WIDTH words */
#define LANES \
  8 /* floats in a vector of AVX2; compilers spill wider ones on processors without AVX-512 */
#define HALF 65536    /* value of a word over its upper entry */
#define AHEAD 512     /* prefetch distance in words */
#define LARGEST 32767 /* largest magnitude of a stored entry */
#define HUGE_PAGE ((size_t)1 << 21)

typedef float Lanes __attribute__((vector_size(4 * LANES)));
typedef int IntLanes __attribute__((vector_size(4 * LANES)));

/* Number of rows stored for n rows: a multiple of PAIR. */
static inline size_t round_up(PetscInt n)
{
  return ((size_t)n + PAIR - 1) / PAIR * PAIR;
}

/* Zeroed memory; large blocks on pages of 2 MB if the system has them, for fewer misses of the
   TLB. */
static inline PetscErrorCode allocate_pages(size_t bytes, void *memory)
{
  void *p = NULL;

  PetscFunctionBeginUser;
  const PetscBool large = (PetscBool)(bytes >= HUGE_PAGE);
  const size_t page = large ? HUGE_PAGE : 64;

  bytes = (bytes + page) / page * page;
  PetscCheck(!posix_memalign(&p, page, bytes), PETSC_COMM_SELF, PETSC_ERR_MEM,
             "No memory for a factor of %g MB", 1e-6 * (double)bytes);
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  if (large)
    (void)madvise(p, bytes, MADV_HUGEPAGE);
#endif
  memset(p, 0, bytes);
  *(void **)memory = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Word of row i of column j in a panel of ncol columns: blocks of ROWS rows, each [column][row]. */
static inline int32_t *panel_word(int32_t *panel, size_t height, size_t ncol, size_t i, size_t j)
{
  const size_t top = i / ROWS * ROWS;
  const size_t tall = PetscMin(ROWS, height - top);
  const size_t pair = (i - top) / PAIR;

  return panel + (top * ncol + j * tall + pair * PAIR) / 2 + i % WIDTH;
}

/* Rounds column j, whose entries from..n-1 are nonzero, and returns its scale. */
static float store_column(size_t n, size_t from, const PetscScalar y[], size_t ncol, size_t j,
                          int32_t *panel)
{
  const size_t height = round_up((PetscInt)n);
  PetscScalar largest = PETSC_MACHINE_EPSILON * PETSC_MACHINE_EPSILON;
  PetscScalar unit;

  for (size_t i = from; i < n; i++)
    largest = PetscMax(largest, PetscAbsScalar(y[i]));
  unit = LARGEST / largest;
  for (size_t top = from / PAIR * PAIR; top < n; top += PAIR) {
    for (size_t i = top; i < top + WIDTH; i++) {
      const PetscScalar upper = i < n ? unit * y[i] : 0.;
      const PetscScalar lower = i + WIDTH < n ? unit * y[i + WIDTH] : 0.;
      const uint16_t fraction = (uint16_t)(int16_t)rint(lower);

      *panel_word(panel, height, ncol, i, j) =
        (int32_t)rint(upper - (PetscScalar)fraction / HALF) * HALF + fraction;
    }
  }
  return (float)(largest / LARGEST / HALF);
}

/* The upper and the lower entries of LANES words, times HALF. */
#define UPPER(w) __builtin_convertvector(w, Lanes)
#define LOWER(w) __builtin_convertvector((w) << 16, Lanes)

SB_INLINE float sum_lanes(const Lanes lanes[2])
{
  Lanes v = lanes[0] + lanes[1];

  v += __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3);
  v += __builtin_shufflevector(v, v, 2, 3, 0, 1, 6, 7, 4, 5);
  return v[0] + v[1];
}

/* y = A x for a block of m * PAIR rows, [column][row]; m is a compile-time constant. */
SB_INLINE const int32_t *multiply(int m, PetscInt ncol, const int32_t *a, const float x[],
                                  float y[])
{
  Lanes sum[8] = {{0}};

  for (PetscInt j = 0; j < ncol; j++, a += m * WIDTH) {
    const Lanes xj = x[j] - (Lanes){0};

    __builtin_prefetch(a + AHEAD);
    __builtin_prefetch(a + AHEAD + WIDTH);
    for (int i = 0; i < m; i++) {
      for (int h = 0; h < 2; h++) {
        const IntLanes w = *(const IntLanes *)(a + i * WIDTH + h * LANES);

        sum[4 * i + h] += UPPER(w) * xj;
        sum[4 * i + 2 + h] += LOWER(w) * xj;
      }
    }
  }
  for (int i = 0; i < 4 * m; i++)
    ((Lanes *)y)[i] = sum[i];
  return a;
}

/* sum[j][2] += A^T x for the same block. */
SB_INLINE const int32_t *multiply_transposed(int m, PetscInt ncol, const int32_t *a,
                                             const float x[], Lanes (*sum)[2])
{
  Lanes v[8];

  for (int i = 0; i < 4 * m; i++)
    v[i] = ((const Lanes *)x)[i];
  for (PetscInt j = 0; j < ncol; j++, a += m * WIDTH) {
    __builtin_prefetch(a + AHEAD);
    __builtin_prefetch(a + AHEAD + WIDTH);
    for (int i = 0; i < m; i++) {
      for (int h = 0; h < 2; h++) {
        const IntLanes w = *(const IntLanes *)(a + i * WIDTH + h * LANES);

        sum[j][h] += UPPER(w) * v[4 * i + h] + LOWER(w) * v[4 * i + 2 + h];
      }
    }
  }
  return a;
}

/* y[height] = A (s x), x and s by column; s holds two scales per column. */
SB_INLINE const int32_t *panel_multiply(size_t height, PetscInt ncol, const int32_t *a,
                                        const float x[], const float s[], float y[])
{
  float sx[3 * PANEL];
  size_t i = 0;

  for (PetscInt j = 0; j < ncol; j++)
    sx[j] = s[2 * j] * x[j];
  for (; i + ROWS <= height; i += ROWS)
    a = multiply(2, ncol, a, sx, y + i);
  return i < height ? multiply(1, ncol, a, sx, y + i) : a;
}

/* y[ncol] = s A^T x[height] */
SB_INLINE void panel_transposed(size_t height, PetscInt ncol, const int32_t *a, const float x[],
                                const float s[], float y[])
{
  Lanes sum[3 * PANEL][2];
  size_t i = 0;

  for (PetscInt j = 0; j < ncol; j++)
    sum[j][0] = sum[j][1] = (Lanes){0};
  for (; i + ROWS <= height; i += ROWS)
    a = multiply_transposed(2, ncol, a, x + i, sum);
  if (i < height)
    multiply_transposed(1, ncol, a, x + i, sum);
  for (PetscInt j = 0; j < ncol; j++)
    y[j] = s[2 * j] * sum_lanes(sum[j]);
}
