/*
  ccd.c - continuous collision detection of vertices, edges and triangles by conservative
  advancement.

  Vertices move linearly, x_a(t) = x_a + t q_a. Let n be the unit vector along the shortest
  connection, of length d, at time t. Each side is behind a plane with normal n, and the planes are
  d apart: for all i of the first side and j of the second, n . (x_i - x_j) >= d. So the distance at
  a later time s is at least the minimum of n . (x_i - x_j) + (s - t) n . (q_i - q_j), and t can be
  advanced until this bound equals the gap to be kept. The iteration converges from below to the
  time at which that gap is reached.

  This is additive CCD (Li, Kaufman, Jiang, "Codimensional Incremental Potential Contact", 2021,
  section 4), which bounds the approach by norms of q, with the bound of Mirtich ("Impulse-based
  dynamic simulation", 1996, section 2.3): sliding and separating pairs need one distance only.

  Rounding: the bound holds for any unit vector n. Differences are formed between coordinates at the
  same time, so their relative error is small, far from the origin and for fast motion too. The
  rounding of the caller's coordinates at a fraction of the step, eps |x| initially plus eps |x1 -
  x0| for the full step, is added to the gap: SB_CCD_ROUNDING times that.
*/
#include "sbgeometry.h"

#define STEPS \
  1024 /* largest number of iterations; then the time reached is returned, which is safe */
#define AIM \
  0.9 /* iterations aim at this fraction of the gap to be kept, so that few of them are enough */
#define CLOSER 0.5 /* fraction to keep of a gap that is below the separation already */

PetscBool SbTimeOfImpact(SbPairKind kind, const PetscReal x0[], const PetscReal x1[],
                         const SbCCDLimits *limits, PetscReal *time)
{
  const int nfirst = kind == SB_PAIR_EDGE_EDGE ? 2 : 1;
  const int n = kind == SB_PAIR_EDGE_EDGE ? 4 : 2 + (int)kind;
  PetscReal y[12], q[12], x[12];
  PetscReal at = 0;
  PetscReal speed = 0;
  PetscReal far = 0;
  PetscReal fast = 0;
  PetscReal aim = 0;
  PetscReal stop = 0;

  // positions and displacements relative to the first vertex
  for (int a = 0; a < n; a++) {
    for (int k = 0; k < 3; k++) {
      const int i = 3 * a + k;

      y[i] = x0[i] - x0[k];
      q[i] = (x1[i] - x1[k]) - y[i];
      far = PetscMax(far, PetscAbsReal(x0[i]));
      fast = PetscMax(fast, PetscAbsReal(x1[i] - x0[i]));
    }
  }
  *time = 1;
  for (int i = 0; i < nfirst; i++) {
    for (int j = nfirst; j < n; j++) {
      const PetscReal square = SbDistance2(q + 3 * i, q + 3 * j);

      if (!(square <= PETSC_MAX_REAL)) {
        *time = 0;
        return PETSC_TRUE;
      }
      speed = PetscMax(speed, square);
    }
  }
  speed = PetscSqrtReal(speed);
  if (speed == 0)
    return PETSC_FALSE;
  far *= SB_CCD_ROUNDING * PETSC_MACHINE_EPSILON;
  fast *= SB_CCD_ROUNDING * PETSC_MACHINE_EPSILON;
  for (int step = 0; step < STEPS; step++) {
    SbDistance s;
    PetscReal along[4][2], gap;
    PetscReal length = PETSC_MAX_REAL;

    for (int i = 0; i < 3 * n; i++)
      x[i] = y[i] + at * q[i];
    SbDistanceFind(kind, x, &s);
    gap = s.d - limits->radius;
    if (step == 0) {
      const PetscReal least = PetscMax(far, PetscMin(limits->separation, CLOSER * gap));

      if (!(gap > least)) {
        *time = 0;
        return PETSC_TRUE;
      }
      stop = limits->keep * (gap - least);
      if (limits->most > 0)
        stop = PetscMin(stop, limits->most);
      aim = least + AIM * stop;
      stop += least;
    } else if (!(gap - at * fast > stop))
      break;

    // time until a vertex of one side may reach one of the other along n; at least that by the
    // largest speed
    for (int a = 0; a < n; a++) {
      along[a][0] = SbDot3(s.n, x + 3 * a);
      along[a][1] = SbDot3(s.n, q + 3 * a);
    }
    for (int i = 0; i < nfirst; i++) {
      for (int j = nfirst; j < n; j++) {
        const PetscReal above = along[i][0] - along[j][0] - limits->radius - aim - at * fast;
        const PetscReal approach = along[j][1] - along[i][1] + fast;

        if (above < 0)
          length = 0; // rounding of n
        else if (approach > 0 && above < length * approach)
          length = above / approach;
      }
    }
    at += PetscMax(length, (gap - aim - at * fast) / (speed + fast));
    if (at >= 1)
      return PETSC_FALSE;
  }
  *time = at;
  return PETSC_TRUE;
}
