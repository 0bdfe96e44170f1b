/*
  ccd.c - how far two simplices may move before they meet: conservative advancement, for all kinds of pairs alike.

  Vertices move on straight lines, x_a(t) = x_a + t q_a. Let n be the direction of the distance d at time t. Each side lies behind a
  plane with the normal n, and the planes are d apart: for all i of the first side and j of the second, n . (x_i - x_j) >= d. So the distance
  is at least the least of n . (x_i - x_j) + (s - t) n . (q_i - q_j) at a later time s, and t may grow until this is the gap that is to
  be kept. Repeated, t converges from below to the time at which that gap is reached.

  This is additive CCD (Li, Kaufman, Jiang, "Codimensional Incremental Potential Contact", 2021, section 4), which bounds the approach by the
  lengths of q, with the bound of Mirtich ("Impulse-based dynamic simulation", 1996, section 2.3): sliding and receding pairs are done after one distance.

  Rounding: the bound holds for any unit vector, thus for a wrong one, too. Differences are taken of coordinates of one time, so they are right but
  for their own rounding, however far from the origin or however fast both move. What the caller's coordinates are rounded to
  when it goes a part of the step, eps |x| at first and eps |x1 - x0| in addition for the whole step, is kept free: SB_CCD_ROUNDING times that.
*/
#include "sbgeometry.h"

#define STEPS 1024 /* most iterations; the time reached by then is returned, which is safe */
#define AIM 0.9    /* of the gap to be kept, aimed at: then a few steps get below it */
#define CLOSER 0.5 /* of a gap that is below the separation already, to be kept */

PetscBool SbTimeOfImpact(SbPairKind kind, const PetscReal x0[], const PetscReal x1[],
                         const SbCCDLimits *limits, PetscReal *time)
{
  const int nfirst = kind == SB_PAIR_EDGE_EDGE ? 2 : 1;
  const int n = kind == SB_PAIR_EDGE_EDGE ? 4 : 2 + (int)kind;
  PetscReal y[12], q[12], x[12], at = 0, speed = 0, far = 0, fast = 0, aim = 0, stop = 0;

  // positions and motions relative to the first vertex
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
      const PetscReal r[3] = {q[3 * i] - q[3 * j], q[3 * i + 1] - q[3 * j + 1], q[3 * i + 2] - q[3 * j + 2]};
      const PetscReal square = SbDot3(r, r);

      if (!(square <= PETSC_MAX_REAL)) {
        *time = 0;
        return PETSC_TRUE;
      }
      speed = PetscMax(speed, square);
    }
  }
  speed = PetscSqrtReal(speed);
  if (speed == 0) return PETSC_FALSE;
  far *= SB_CCD_ROUNDING * PETSC_MACHINE_EPSILON;
  fast *= SB_CCD_ROUNDING * PETSC_MACHINE_EPSILON;
  for (int step = 0; step < STEPS; step++) {
    SbDistance s;
    PetscReal first[2][2], second[3][2], gap, length = PETSC_MAX_REAL;

    for (int i = 0; i < 3 * n; i++) x[i] = y[i] + at * q[i];
    SbDistanceFind(kind, x, &s);
    gap = s.d - limits->radius;
    if (step == 0) {
      const PetscReal least = PetscMax(far, PetscMin(limits->separation, CLOSER * gap));

      if (!(gap > least)) {
        *time = 0;
        return PETSC_TRUE;
      }
      stop = limits->keep * (gap - least);
      if (limits->most > 0) stop = PetscMin(stop, limits->most);
      aim = least + AIM * stop;
      stop += least;
    } else if (!(gap - at * fast > stop))
      break;

    // how long each vertex of one side stays away from each of the other, along n; at the least as long as speed tells
    for (int a = 0; a < n; a++) {
      PetscReal *p = a < nfirst ? first[a] : second[a - nfirst];

      p[0] = SbDot3(s.n, x + 3 * a);
      p[1] = SbDot3(s.n, q + 3 * a);
    }
    for (int i = 0; i < nfirst; i++) {
      for (int j = 0; j < n - nfirst; j++) {
        const PetscReal above = first[i][0] - second[j][0] - limits->radius - aim - at * fast;
        const PetscReal approach = second[j][1] - first[i][1] + fast;

        if (above < 0)
          length = 0; // n is wrong by rounding
        else if (approach > 0 && above < length * approach)
          length = above / approach;
      }
    }
    at += PetscMax(length, (gap - aim - at * fast) / (speed + fast));
    if (at >= 1) return PETSC_FALSE;
  }
  *time = at;
  return PETSC_TRUE;
}
