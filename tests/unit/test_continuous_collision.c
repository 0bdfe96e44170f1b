// @ranks 1
/*
  Passages of moving points through moving triangles: against the signs of many small steps, and cubics that degenerate.
*/
#include "detect_fixture.h"

#define STEPS 4000

/* Height of the point above the triangle and how far its foot is inside, both over length; at time t. */
static void look(const PetscReal p0[3], const PetscReal p1[3], PetscReal x0[3][3], PetscReal x1[3][3],
                 PetscReal t, PetscReal *height, PetscReal *inside)
{
  PetscReal u[3], v[3], w[3], n[3], a[3], b[3], n2, beta, gamma;

  for (int k = 0; k < 3; k++) {
    const PetscReal c = x0[0][k] + t * (x1[0][k] - x0[0][k]);

    u[k] = p0[k] + t * (p1[k] - p0[k]) - c;
    v[k] = x0[1][k] + t * (x1[1][k] - x0[1][k]) - c;
    w[k] = x0[2][k] + t * (x1[2][k] - x0[2][k]) - c;
  }
  SbCross(v, w, n);
  n2 = SbDot3(n, n);
  SbCross(u, w, a);
  SbCross(v, u, b);
  beta = SbDot3(a, n) / n2;
  gamma = SbDot3(b, n) / n2;
  *height = SbDot3(u, n) / PetscSqrtReal(n2);
  *inside = PetscMin(PetscMin(beta, gamma), 1 - beta - gamma);
}

/* What small steps see: 1 through and stays behind, 0 not, -1 too close to say. */
static int stepwise(const PetscReal p0[3], const PetscReal p1[3], PetscReal x0[3][3], PetscReal x1[3][3],
                    PetscReal *time)
{
  PetscReal older, before, after, inside;
  int through = 0;

  look(p0, p1, x0, x1, 0, &before, &inside);
  if (PetscAbsReal(before) < 0.02) return -1;
  older = before;
  for (int i = 1; i <= STEPS; i++) {
    look(p0, p1, x0, x1, (PetscReal)i / STEPS, &after, &inside);
    if ((before < 0) != (after < 0)) {
      if (PetscAbsReal(inside) < 0.02) return -1;
      if (inside > 0) {
        through = after < 0;
        *time = (i - 0.5) / STEPS;
      }
    }
    /* it turns around close to the plane */
    if ((after - before) * (before - older) < 0 && PetscAbsReal(before) < 5e-3) return -1;
    older = before;
    before = after;
  }
  return PetscAbsReal(after) < 0.02 ? -1 : after < 0 ? through : 0;
}

static void check_random(void)
{
  const PetscReal tolerance[2] = {0, 1e-12};
  PetscInt seen[3] = {0};
  unsigned state = 17;

  for (int i = 0; i < 8000; i++) {
    PetscReal x[2][3][3], p[2][3], time = -1, expected_time = -1;
    const PetscReal *const x0[3] = {x[0][0], x[0][1], x[0][2]}, *const x1[3] = {x[1][0], x[1][1], x[1][2]};
    PetscBool behind, through;
    int expected;

    for (int s = 0; s < 2; s++) {
      for (int k = 0; k < 3; k++) {
        p[s][k] = 0.6 * number(&state);
        for (int c = 0; c < 3; c++) x[s][c][k] = s && i % 4 == 0 ? x[0][c][k] : number(&state);
      }
    }
    for (int c = 0; c < 3; c++) {
      for (int k = 0; k < 3; k++) {
        if (i % 4 == 1) x[1][c][k] = x[0][c][k] + p[0][k] * p[1][k]; /* shifted: f is linear */
        if (i % 4 == 2) x[1][c][k] = x[0][c][k] + 0.4 * number(&state);
      }
    }
    expected = stepwise(p[0], p[1], x[0], x[1], &expected_time);
    if (expected < 0) continue;
    seen[expected]++;
    through = SbCCDPointTriangle(p[0], p[1], x0, x1, tolerance, &time, &behind);
    SB_CHECK(through == (expected > 0), "motion %d: %s", i,
             expected ? "a passage is missed" : "there is no passage");
    if (through && expected) SB_CHECK_NEAR(time, expected_time, 1. / STEPS, "time of the passage");
  }
  SB_CHECK(seen[0] > 1000 && seen[1] > 300, "%d passages, %d without", (int)seen[1], (int)seen[0]);
}

/* Motions over the triangle (0,0,0) (1,0,0) (0,1,0). */
static void check_special(void)
{
  /* start, end, tolerated start, then whether it goes through, when, and whether it lay behind */
  static const PetscReal way[][10] = {
    {0.3, 0.3, 1, 0.3, 0.3, -1, 0, 1, 0.5, 0},
    {0.3, 0.3, -1, 0.3, 0.3, 1, 0, 0, 0, 0},        /* from behind */
    {0.3, 0.3, 0, 0.3, 0.3, -1, 0, 1, 0, 0},        /* lay on it */
    {0.3, 0.3, 1, 0.3, 0.3, 0, 0, 0, 0, 0},         /* arrives */
    {0.3, 0.3, -0.1, 0.3, 0.3, -1, 0, 0, 0, 0},     /* behind all the time */
    {0.3, 0.3, -0.1, 0.3, 0.3, -1, 0.2, 1, 0, 1},   /* the same, where that much is tolerated */
    {0.3, 0.3, -0.3, 0.3, 0.3, -1, 0.2, 0, 0, 1},   /* further behind */
    {0.3, 0.3, 0, 0.1, 0.4, 0, 0, 0, 0, 0},         /* within its plane */
    {0.7, 0.7, 1, 0.7, 0.7, -1, 0, 0, 0, 0},        /* beside it */
    {0.5, 0, 1, 0.5, 0, -1, 0, 1, 0.5, 0},          /* through an edge */
    {0, 0, 1, 0, 0, -3, 0, 1, 0.25, 0},             /* through a corner */
    {0.3, 0.3, 1e-9, 0.3, 0.3, -1e-9, 0, 1, 0.5, 0} /* hardly moves */
  };
  PetscReal c[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, up[3][3], time = -1;
  const PetscReal *const x[3] = {c[0], c[1], c[2]}, *const x1[3] = {up[0], up[1], up[2]};
  PetscBool behind, through;

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(way); i++) {
    const PetscReal tolerance[2] = {way[i][6], 1e-12};

    through = SbCCDPointTriangle(way[i], way[i] + 3, x, x, tolerance, &time, &behind);
    SB_CHECK(through == (way[i][7] > 0), "way %d", (int)i);
    if (!through) continue;
    SB_CHECK_NEAR(time, way[i][8], 1e-12, "time of a passage");
    SB_CHECK(behind == (way[i][9] > 0), "way %d: behind is %d", (int)i, (int)behind);
  }
  /* a triangle without area, and one that is turned over around the point while that rests */
  for (int k = 0; k < 3; k++) {
    up[0][k] = c[0][k];
    up[1][k] = c[0][k];
    up[2][k] = c[2][k];
  }
  through = SbCCDPointTriangle(way[0], way[0] + 3, x1, x1, (PetscReal[2]){0, 1e-12}, &time, &behind);
  SB_CHECK(!through, "through a triangle without area");
  for (int k = 0; k < 3; k++) {
    up[0][k] = c[0][k];
    up[1][k] = k == 2 ? 0.5 : c[1][k];
    up[2][k] = k == 2 ? 0.5 : c[2][k];
  }
  through = SbCCDPointTriangle((PetscReal[3]){0.3, 0.3, 0.1}, (PetscReal[3]){0.3, 0.3, 0.1}, x, x1,
                               (PetscReal[2]){0, 1e-12}, &time, &behind);
  SB_CHECK(through, "a triangle that is lifted past a resting point");
  SB_CHECK_NEAR(time, 1. / 3, 1e-12, "time at which the triangle is as high as the point");
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  check_random();
  check_special();
  SB_TEST_END();
}
