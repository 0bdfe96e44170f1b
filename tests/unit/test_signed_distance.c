/*
  Obstacles from meshes: distance, normal and side of a cube against the box: obstacle, of a fine
  sphere against the exact ones, of non-convex shapes against all triangles and the winding number;
  the note; errors.
*/
// @ranks 1 3
#include "mesh_test.h"
#include "surface_files.h"
#include "../../src/contact/obstacle.h"
#include <sbkernel.h>

static const PetscReal zero[3] = {0, 0, 0};

/* Creates the obstacle mesh:FILE of a surface. */
static PetscErrorCode make(const TestSurface *s, SbObstacle *o, size_t size, char note[])
{
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(test_file_write(".off", PETSC_FALSE, s, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(SbObstacleCreate("-o", text, o));
  note[0] = 0;
  PetscCall(SbObstacleSetUp(*o, PETSC_COMM_WORLD, 1, zero, size, note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ cube */

/* Same distances as the box. */
static PetscErrorCode check_cube(void)
{
  const PetscReal lo[3] = {-0.5, -0.4, -0.3};
  const PetscReal hi[3] = {0.6, 0.5, 0.7};
  TestSurface s = {0};
  SbObstacle o, box;
  PetscInt inside = 0;
  PetscReal off = 0;
  PetscReal turned = 0;
  unsigned state = 5;
  char note[256] = "";

  PetscFunctionBeginUser;
  test_surface_box(lo, hi, PETSC_FALSE, &s);
  PetscCall(make(&s, &o, sizeof(note), note));
  PetscCall(SbObstacleCreate("-o", "box:-0.5,-0.4,-0.3,0.6,0.5,0.7", &box));
  for (int i = 0; i < 20000; i++) {
    PetscReal x[3], n[3], m[3], d, exact;

    for (int k = 0; k < 3; k++)
      x[k] = 1.5 * test_random(&state);
    d = SbObstacleDistance(o, x, n);
    exact = SbObstacleDistance(box, x, m);
    inside += exact < 0;
    off = PetscMax(off, PetscAbsReal(d - exact));
    if (PetscAbsReal(exact) > 1e-3)
      turned = PetscMax(turned, 1 - SbDot3(n, m));
  }
  SB_CHECK(inside > 200, "%d inside", (int)inside);
  SB_CHECK(off < 1e-14, "distances from the cube are off by %g", off);
  SB_CHECK(turned < 1e-12, "normals of the cube are turned: 1 - cos = %g", turned);
  SB_CHECK(strstr(note, "12 triangles around 0.99 m^3"), "note: %s", note);
  PetscCall(SbObstacleDestroy(&o));
  PetscCall(SbObstacleDestroy(&box));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At a corner, on an edge and on a face: zero distance, and a normal between those of the adjacent
   faces. */
static PetscErrorCode check_on(void)
{
  static const PetscReal at[4][3] = {{1, 1, 1}, {1, 1, 0.3}, {1, 0.2, 0.3}, {1 - 1e-13, 0.2, 0.3}};
  const PetscReal unit[3] = {1, 1, 1};
  TestSurface s = {0};
  SbObstacle o;
  char note[256];

  PetscFunctionBeginUser;
  test_surface_box(zero, unit, PETSC_FALSE, &s);
  PetscCall(make(&s, &o, sizeof(note), note));
  for (int i = 0; i < 4; i++) {
    PetscReal n[3];
    PetscReal d = SbObstacleDistance(o, at[i], n);

    SB_CHECK_NEAR(d, i < 3 ? 0 : -1e-13, 1e-15, "on the surface");
    SB_CHECK_NEAR(SbDot3(n, n), 1, 1e-14, "length of the normal");
    for (int k = 0; k < 3; k++) {
      /* normals of the triangles at a corner are weighted by their angles: the three faces count
         equally */
      const PetscReal exact = i == 0   ? 1 / PetscSqrtReal(3.)
                              : i == 1 ? (k < 2) / PETSC_SQRT2
                                       : k == 0;

      SB_CHECK_NEAR(n[k], exact, 1e-14, "normal on the surface");
    }
  }
  PetscCall(SbObstacleDestroy(&o));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ arbitrary surfaces */

static PetscReal solid_angle(const TestSurface *s, PetscInt f, const PetscReal x[3])
{
  PetscReal a[3][3], l[3], c[3];

  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++)
      a[k][i] = s->x[s->tri[f][k]][i] - x[i];
    l[k] = PetscSqrtReal(SbDot3(a[k], a[k]));
  }
  SbCross(a[0], a[1], c);
  return 2 * atan2(SbDot3(c, a[2]), l[0] * l[1] * l[2] + SbDot3(a[0], a[1]) * l[2] +
                                      SbDot3(a[1], a[2]) * l[0] + SbDot3(a[2], a[0]) * l[1]);
}

/* Distance between a point and a triangle by brute force: its interior and its three edges. */
static PetscReal from_triangle(const TestSurface *s, PetscInt f, const PetscReal x[3])
{
  const PetscReal *p[3] = {s->x[s->tri[f][0]], s->x[s->tri[f][1]], s->x[s->tri[f][2]]};
  PetscReal best = PETSC_MAX_REAL;
  PetscReal n[3], a[3], b[3], area, h, w[3];
  PetscBool over = PETSC_TRUE;

  for (int i = 0; i < 3; i++) {
    a[i] = p[1][i] - p[0][i];
    b[i] = p[2][i] - p[0][i];
  }
  SbCross(a, b, n);
  area = SbDot3(n, n);
  for (int k = 0; k < 3; k++) {
    PetscReal e[3], r[3], c[3], t;
    PetscReal d2 = 0;

    for (int i = 0; i < 3; i++) {
      e[i] = p[(k + 1) % 3][i] - p[k][i];
      r[i] = x[i] - p[k][i];
    }
    t = PetscMax(0, PetscMin(1, SbDot3(e, r) / SbDot3(e, e)));
    for (int i = 0; i < 3; i++)
      d2 += PetscSqr(r[i] - t * e[i]);
    best = PetscMin(best, PetscSqrtReal(d2));
    SbCross(e, r, c);
    w[k] = SbDot3(c, n) / area;
    if (w[k] < 0)
      over = PETSC_FALSE;
  }
  h = 0;
  for (int i = 0; i < 3; i++)
    h += (x[i] - p[0][i]) * n[i] / PetscSqrtReal(area);
  return over ? PetscMin(best, PetscAbsReal(h)) : best;
}

/* Against all triangles: distances, signs, closest points on the surface. */
static PetscErrorCode check_surface(const TestSurface *s, PetscReal box, const char *what)
{
  SbObstacle o;
  PetscInt wrong = 0;
  PetscInt inside = 0;
  PetscReal off = 0;
  PetscReal foot = 0;
  unsigned state = 11;
  char note[256];

  PetscFunctionBeginUser;
  PetscCall(make(s, &o, sizeof(note), note));
  for (int i = 0; i < 1500; i++) {
    PetscReal x[3], n[3], y[3], m[3], d;
    PetscReal exact = PETSC_MAX_REAL;
    PetscReal around = 0;

    for (int k = 0; k < 3; k++)
      x[k] = box * test_random(&state);
    d = SbObstacleDistance(o, x, n);
    for (PetscInt f = 0; f < s->ntri; f++) {
      exact = PetscMin(exact, from_triangle(s, f, x));
      around += solid_angle(s, f, x);
    }
    wrong += (around > 2 * PETSC_PI) != (d < 0);
    inside += d < 0;
    off = PetscMax(off, PetscAbsReal(PetscAbsReal(d) - exact));
    for (int k = 0; k < 3; k++)
      y[k] = x[k] - d * n[k];
    foot = PetscMax(foot, PetscAbsReal(SbObstacleDistance(o, y, m)));
  }
  SB_CHECK(inside > 50 && !wrong, "%s: %d inside, %d on the wrong side", what, (int)inside,
           (int)wrong);
  SB_CHECK(off < 1e-13, "%s: distances are off by %g", what, off);
  SB_CHECK(foot < 1e-13, "%s: the nearest point is off the surface by %g", what, foot);
  PetscCall(SbObstacleDestroy(&o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cube with a cavity and a separate thin plate. */
static PetscErrorCode check_parts(void)
{
  const PetscReal a[3] = {-0.5, -0.5, -0.5};
  const PetscReal b[3] = {0.5, 0.5, 0.5};
  const PetscReal c[3] = {-0.3, -0.3, -0.3};
  const PetscReal d[3] = {0.4, 0.4, 0.4};
  const PetscReal p[3] = {-0.8, -0.8, 0.7};
  const PetscReal q[3] = {0.8, 0.8, 0.72};
  TestSurface s = {0};

  PetscFunctionBeginUser;
  test_surface_box(a, b, PETSC_FALSE, &s);
  test_surface_box(c, d, PETSC_TRUE, &s);
  test_surface_box(p, q, PETSC_FALSE, &s);
  PetscCall(check_surface(&s, 1, "parts"));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal longest_edge(const TestSurface *s)
{
  PetscReal longest = 0;

  for (PetscInt i = 0; i < 3 * s->ntri; i++) {
    const PetscReal *a = s->x[s->tri[i / 3][i % 3]];
    const PetscReal *b = s->x[s->tri[i / 3][(i + 1) % 3]];
    const PetscReal e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};

    longest = PetscMax(longest, PetscSqrtReal(SbDot3(e, e)));
  }
  return longest;
}

/* A triangle in the unit sphere with edges up to h is at most h^2 / 6 away from it, and its normal
   deviates by less than h. */
static PetscErrorCode check_sphere(int split)
{
  TestSurface s = {0};
  SbObstacle o;
  PetscReal off = 0;
  PetscReal turned = 0;
  PetscReal h;
  PetscInt near = 0;
  PetscInt inside = 0;
  unsigned state = 3;
  char note[256];

  PetscFunctionBeginUser;
  test_surface_sphere(split, &s);
  h = longest_edge(&s);
  PetscCall(make(&s, &o, sizeof(note), note));
  for (int i = 0; i < 20000; i++) {
    PetscReal x[3], n[3], d, r;

    for (int k = 0; k < 3; k++)
      x[k] = 1.2 * test_random(&state);
    r = PetscSqrtReal(SbDot3(x, x));
    if (PetscAbsReal(r - 1) > 0.7 * h)
      continue;
    d = SbObstacleDistance(o, x, n);
    near++;
    inside += d < 0;
    off = PetscMax(off, PetscAbsReal(d - (r - 1)));
    turned = PetscMax(turned, PetscSqrtReal(PetscMax(0, 2 - 2 * SbDot3(n, x) / r)));
  }
  SB_CHECK(near > 500 && inside > 200, "%d near the sphere", (int)near);
  SB_CHECK(off < h * h / 6 * (1 + h), "sphere of edges %g: distances are off by %g", h, off);
  SB_CHECK(turned < h, "sphere of edges %g: normals are off by %g", h, turned);
  PetscCall(SbObstacleDestroy(&o));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ errors, cost */

/* Time of building the tree and of a query, for information: nothing is checked. */
static PetscErrorCode measure(void)
{
  TestSurface s = {0};
  SbObstacle o;
  PetscLogDouble t0, t1, t2;
  PetscReal sum = 0;
  unsigned state = 3;
  char note[256];

  PetscFunctionBeginUser;
  test_surface_sphere(5, &s);
  PetscCall(PetscTime(&t0));
  PetscCall(make(&s, &o, sizeof(note), note));
  PetscCall(PetscTime(&t1));
  for (int i = 0; i < 200000; i++) {
    PetscReal x[3], n[3], r;

    for (int k = 0; k < 3; k++)
      x[k] = test_random(&state);
    r = PetscSqrtReal(SbDot3(x, x)) / (1 + 0.05 * test_random(&state));
    for (int k = 0; k < 3; k++)
      x[k] /= r;
    sum += SbObstacleDistance(o, x, n);
  }
  PetscCall(PetscTime(&t2));
  test_print("  %s: made in %.3f s, %.2f us per distance (mean %.3f)\n", note, t1 - t0,
             (t2 - t1) / 200000 * 1e6, sum / 200000);
  PetscCall(SbObstacleDestroy(&o));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscInt n[2] = {24, 12};
  TestSurface s = {0};
  SbObstacle o = NULL;
  char note[256];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_cube());
  PetscCall(check_on());
  test_surface_torus(1, 0.4, n, &s);
  PetscCall(check_surface(&s, 1.5, "torus"));
  test_surface_free(&s);
  PetscCall(check_parts());
  PetscCall(check_sphere(3));
  PetscCall(check_sphere(4));
  SB_CHECK_ERROR(SbObstacleCreate("-o", "mesh:", &o), PETSC_ERR_USER_INPUT, "mesh:FILE");
  PetscCall(SbObstacleDestroy(&o));
  PetscCall(SbObstacleCreate("-o", "mesh:no,such.stl", &o));
  SB_CHECK_ERROR(SbObstacleSetUp(o, PETSC_COMM_WORLD, 1, zero, sizeof(note), note),
                 PETSC_ERR_FILE_OPEN, "-o|no,such.stl");
  PetscCall(SbObstacleDestroy(&o));
  PetscCall(measure());
  SB_TEST_END();
}
