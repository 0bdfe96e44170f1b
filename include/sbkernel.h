/*
  sbkernel.h - layer 0: what batch kernels are made of: lanes, 3x3 algebra, tets with ten nodes.

  A kernel works on SB_BATCH tets side by side. Every quantity is an array over lanes, and a kernel
  is a loop over lanes around straight-line code, so that the compiler turns each scalar of the text
  into one vector register. The functions below are that code on one lane; matrices are row-major,
  A[3*i+j] is A_ij.

  A batch is 8 wide: one AVX-512 register of doubles, two of AVX2. Measured on Zen 4, co-rotated
  cell with gradient, rotation, ten blocks, stress and force: 0.071 us per tet with 4, 0.043 with 8,
  0.042 with 16, where the general tangent gets slower.
*/
#pragma once
#include <petscsys.h>
#include <math.h>

/* lanes */

#define SB_BATCH 8
typedef PetscReal SbPack[SB_BATCH]; /* 64-byte aligned where the program allocates it */

/*
  SB_KERNEL in front of a function compiles it for AVX-512, for AVX2 and for the baseline; the
  loader picks one when the program starts. All three give the same bits: -std=c11 keeps
  multiplications and additions apart (fusing them was measured to gain 5 %, and would make results
  depend on the processor). Off where it cannot work or is in the way: other compilers and
  processors, debug and sanitizer builds.
*/
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__) && \
  !defined(SB_DEBUG) && !defined(SB_SANITIZE) && !defined(__SANITIZE_ADDRESS__) &&               \
  !defined(__SANITIZE_THREAD__)
  #define SB_KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#else
  #define SB_KERNEL
#endif
/* The helpers must end up inside the kernel that calls them, or nothing is vectorised. */
#if defined(__GNUC__) && !defined(SB_DEBUG)
  #define SB_INLINE static inline __attribute__((always_inline))
#else
  #define SB_INLINE static inline
#endif

/* Copies n numbers of lane l out of and into a batch. */
SB_INLINE void SbPackGet(int n, const SbPack a[], int l, PetscReal x[])
{
  for (int k = 0; k < n; k++)
    x[k] = a[k][l];
}

SB_INLINE void SbPackPut(int n, const PetscReal x[], int l, SbPack a[])
{
  for (int k = 0; k < n; k++)
    a[k][l] = x[k];
}

/* 3x3 algebra on one lane */

SB_INLINE PetscReal SbDot3(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A : B */
SB_INLINE PetscReal SbDot9(const PetscReal A[9], const PetscReal B[9])
{
  return SbDot3(A, B) + SbDot3(A + 3, B + 3) + SbDot3(A + 6, B + 6);
}

/* c = a - b */
SB_INLINE void SbSubtract(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  for (int k = 0; k < 3; k++)
    c[k] = a[k] - b[k];
}

/* |a - b|^2 */
SB_INLINE PetscReal SbDistance2(const PetscReal a[3], const PetscReal b[3])
{
  return PetscSqr(a[0] - b[0]) + PetscSqr(a[1] - b[1]) + PetscSqr(a[2] - b[2]);
}

/* Makes a a unit vector, unless it is zero; returns its length. */
SB_INLINE PetscReal SbNormalise(PetscReal a[3])
{
  const PetscReal length = PetscSqrtReal(SbDot3(a, a));

  for (int k = 0; k < 3 && length > 0; k++)
    a[k] /= length;
  return length;
}

/* c = a x b */
SB_INLINE void SbCross(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

/* C = A B */
SB_INLINE void SbMatMul(const PetscReal A[9], const PetscReal B[9], PetscReal C[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* C = A^T B */
SB_INLINE void SbMatTransposeMul(const PetscReal A[9], const PetscReal B[9], PetscReal C[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      C[3 * i + j] = A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
}

/* C = A B^T */
SB_INLINE void SbMatMulTranspose(const PetscReal A[9], const PetscReal B[9], PetscReal C[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      C[3 * i + j] = SbDot3(A + 3 * i, B + 3 * j);
}

/* cof A = d(det A)/dA, the transposed adjugate; its rows are cross products of the rows of A. */
SB_INLINE void SbMatCofactor(const PetscReal A[9], PetscReal C[9])
{
  SbCross(A + 3, A + 6, C);
  SbCross(A + 6, A, C + 3);
  SbCross(A, A + 3, C + 6);
}

SB_INLINE PetscReal SbMatDet(const PetscReal A[9])
{
  PetscReal c[3];

  SbCross(A + 3, A + 6, c);
  return SbDot3(A, c);
}

/* two and four numbers at a time: unaligned, and allowed to examine any array */

typedef double SbTwo __attribute__((vector_size(16), aligned(8), may_alias));
typedef double SbFour __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t SbFourMask __attribute__((vector_size(32), aligned(8), may_alias));
#define SB_SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)

/* tets with ten nodes, at corners and edges: basis, map, rules (src/base/quadratic_map.c) */

#define SB_CELL_NODES 10 /* of a cell at most: P2 has them at its vertices, then at its edges */
/* Vertices of the edges of a cell: P2's node 4 + e is at the middle of edge e. */
static const int SbTetEdge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

/* Points by their barycentric coordinates, with their parts of the volume. */
#define SB_POINTS 14 /* of a rule at most */
typedef struct {
  int n;
  PetscReal L[SB_POINTS][4], weight[SB_POINTS];
} SbPointRule;
extern const SbPointRule SbRuleQuintic; /* degree 5, positive weights: stresses of curved tets */
extern const SbPointRule SbRuleFacet;   /* degree 5 on a triangle, L[3] (Radon 1948) */
/* The ten basis functions at L. */
void SbQuadraticBasis(const PetscReal L[4], PetscReal phi[SB_CELL_NODES]);
/* Corners of the P1 tet with the derivatives of the map x of ten nodes at L, but for a
   translation. */
void SbQuadraticCorners(const PetscReal L[4], const PetscReal x[SB_CELL_NODES][3],
                        PetscReal corner[4][3]);
