// @ranks 1 2
/*
  Initially overlapping bodies are separated: cubes that overlap by half, rotated ones, crossed bars
  without a vertex inside the other, a finger deep inside a block, bodies in rigid obstacles. The
  penetration is removed in the number of steps of the option, with at most twice the energy M v^2
  of a bar pushed with that speed v; momentum is conserved. At the end there are no intersections
  and all pairs are included in the barrier; -effect_NAME_verify checks the rest. A neighbouring
  body is not affected. A self-intersecting bent bar has separation directions.
*/
#include "contact.h"
#include "../../src/contact/pairs.h"

#define DEPTH 0.05
#define STEP 0.004
#define STEPS 30    /* of separation */
#define PAIRS 192   /* of convex bodies */
#define SHALLOW 0.5 /* least depth that is reported over the true one: edges that cross */
#define MEET "-effects meet -effect_meet_type contact -effect_meet_verify yes "
#define STEPPING "-time euler_implicit -ts_dt %g -ts_max_time %g -snes_rtol 1e-9 "
#define SOFT(b, mesh) VERIFY_BODY(b, mesh, "corotated", "1e5", "0.3")

/* Mass (kg) times the square of the initial separation speed for a depth (m), J. */
static PetscReal parting_energy(PetscReal mass, PetscReal depth)
{
  return mass * PetscSqr(depth * (1 - PetscExpReal(-1. / STEPS)) / STEP);
}

/* Bodies with a total mass of `mass` (kg); deepest: bounds of the initial depth, m. */
static PetscErrorCode check_bodies(const char *what, const char *bodies, PetscReal mass,
                                   PetscReal time, const PetscReal deepest[2])
{
  Record r = {0};
  PetscReal most;

  PetscFunctionBeginUser;
  verify_case("%s", what);
  PetscCall(record_run(&r, MEET STEPPING "%s", STEP, (double)time, bodies));
  most = parting_energy(mass, deepest[1]);
  VERIFY_MORE(record_at(&r, "meet_penetration", 1), 0.9 * deepest[0], "depth after a step, m");
  VERIFY_LESS(record_at(&r, "meet_penetration", 1), deepest[1], "depth after a step, m");
  VERIFY_LESS(record_at(&r, "meet_penetration", STEPS), 0.6 * record_at(&r, "meet_penetration", 1),
              "depth after the steps of recovery, m");
  VERIFY_MORE(record_at(&r, "meet_unguarded", 1), 0, "edges through triangles at first");
  VERIFY_NEAR(record_last(&r, "meet_unguarded"), 0, 0, "edges through triangles at the end");
  VERIFY_LESS(record_max(&r, "kinetic"), 2 * most, "kinetic energy, J");
  VERIFY_MORE(record_max(&r, "kinetic"), 1e-4 * most, "kinetic energy, J");
  VERIFY_LESS(record_last(&r, "strain"), 0.01 * record_last(&r, "kinetic"),
              "strain energy at the end, J");
  VERIFY_LESS(record_size(&r, "momentum", PETSC_FALSE),
              1e-4 * PetscSqrtReal(mass * record_last(&r, "kinetic")), "momentum, kg m/s");
  VERIFY_LESS(record_size(&r, "angular", PETSC_FALSE),
              1e-2 * 0.1 * PetscSqrtReal(mass * record_last(&r, "kinetic")),
              "angular momentum, kg m^2/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Faces in common planes, where rounding decides what is inside: the bodies are separated all the
   same. */
static PetscErrorCode check_aligned(void)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("aligned");
  PetscCall(record_run(&r,
                       MEET STEPPING "-bodies a,b -body_b_translate 0.05,0,0" SOFT(
                         "a", "box:0.1,0.1,0.1:3") SOFT("b", "box:0.1,0.1,0.1:2"),
                       STEP, 0.4));
  VERIFY_NEAR(record_last(&r, "meet_unguarded"), 0, 0, "edges through triangles at the end");
  VERIFY_LESS(record_max(&r, "kinetic"), 2 * parting_energy(2, DEPTH), "kinetic energy, J");
  VERIFY_MORE(record_last(&r, "b_vx") - record_last(&r, "a_vx"), 0.1, "speed of parting, m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cube under its weight that initially overlaps an obstacle below it by a tenth of its height
   rises and comes to rest on it. */
static PetscErrorCode check_obstacle(const char *obstacle)
{
  const PetscReal weight = 9.81;
  Record r = {.g = 9.81};

  PetscFunctionBeginUser;
  verify_case("in %s", obstacle);
  PetscCall(record_run(
    &r,
    STEPPING
    "-bodies a -body_a_translate 0,0,-0.01 -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_response barrier -effect_floor_verify yes -effect_floor_obstacle %s" SOFT(
      "a", "box:0.1,0.1,0.1:3"),
    STEP, 0.6, obstacle));
  VERIFY_NEAR(record_at(&r, "floor_penetration", 1), 0.01, 0.1, "depth after a step, m");
  VERIFY_NEAR(record_last(&r, "floor_penetration"), 0, 0, "depth at the end, m");
  VERIFY_NEAR(record_last(&r, "floor_unguarded"), 0, 0, "what is behind at the end");
  VERIFY_NEAR(record_last(&r, "floor_force_z"), weight, 1e-3, "force at the end, N");
  VERIFY_LESS(record_last(&r, "kinetic"), 1e-5, "kinetic energy at the end, J");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar bent beyond a full ring, wider on one side, so that its ends overlap. */
static PetscErrorCode check_ring(const char *element)
{
  SbContactOverlap o = {0};
  PetscReal *x;
  PetscReal radial = 0;
  SbContactSurface m;
  SbFacet *facet;
  PetscInt nfacet, set;
  SbSpace s;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("ring, %s", element);
  PetscCall(test_open(&t,
                      "-bodies a -body_a_element %s " MEET
                      "-effect_meet_self yes -ts_dt 1e-3" SOFT("a", "box:2,0.2,0.1:40,4,2"),
                      element));
  s = t.run->model->space;
  PetscCall(SbSpaceFindSet(s, "boundary", "the test", &set));
  PetscCall(SbSpaceGetSetFacets(s, set, &nfacet, &facet));
  PetscCall(SbContactSurfaceCreate(s, nfacet, facet, NULL, &m));
  m->self = PETSC_TRUE;
  PetscCall(SbContactSurfaceCreateArray(m, &x));
  for (PetscInt i = 0; i < m->nvertex; i++) {
    const PetscReal *X = m->X + 3 * i;
    const PetscReal turn = (2 * PETSC_PI + 0.7) / 2;
    const PetscReal r = 1 / turn + X[2] + 0.03 * X[0];

    x[3 * i] = r * PetscSinReal(turn * X[0]);
    x[3 * i + 1] = X[1];
    x[3 * i + 2] = r * PetscCosReal(turn * X[0]);
  }
  PetscCall(SbContactOverlapFind(m, x, PETSC_FALSE, &o));
  for (PetscInt i = 0; i < o.n; i++) {
    const PetscReal *p = x + 3 * o.point[i].v[0];
    const PetscReal *n = o.point[i].normal;

    radial += PetscAbsReal(n[0] * p[0] + n[2] * p[2]) / PetscSqrtReal(p[0] * p[0] + p[2] * p[2]) /
              (PetscReal)o.n;
  }
  VERIFY_MORE(o.ncrossing, 20, "edges through triangles");
  VERIFY_MORE(o.npoint, 8, "points that know the way out");
  VERIFY_MORE(radial, 0.5, "mean part of the ways along the radius");
  VERIFY_LESS(o.deepest, 0.11, "depth, m");
  PetscCall(SbContactOverlapFree(&o));
  PetscCall(PetscFree(facet));
  PetscCall(SbContactSurfaceDestroy(&m));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two cubes in each other by 0.05 m down to 1e-17 m, turned at random or aligned: whether they only
   touch, and how deep. */
static PetscErrorCode check_touch_depths(void)
{
  const PetscReal size = 0.1 * PetscSqrtReal(3.);
  SbContactOverlap o = {0};
  PetscReal *x;
  PetscRandom random;
  SbContactSurface m;
  SbFacet *facet;
  PetscInt nfacet, set;
  PetscInt ntouch = 0;
  SbSpace s;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("depth of what touches");
  PetscCall(test_open(&t, "-bodies a,b " MEET "-ts_dt 1e-3" SOFT("a", "box:0.1,0.1,0.1:3")
                            SOFT("b", "box:0.1,0.1,0.1:2")));
  s = t.run->model->space;
  PetscCall(SbSpaceFindSet(s, "boundary", "the test", &set));
  PetscCall(SbSpaceGetSetFacets(s, set, &nfacet, &facet));
  PetscCall(SbContactSurfaceCreate(s, nfacet, facet, NULL, &m));
  PetscCall(SbContactSurfaceCreateArray(m, &x));
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 7));
  PetscCall(PetscRandomSeed(random));
  for (int k = 0; k < 136; k++) {
    const PetscReal depth = 0.05 * PetscPowReal(10., -(k / 8));
    const PetscBool aligned = (PetscBool)(k % 4 == 3);
    PetscReal r[4], turn, shift[2];

    for (int i = 0; i < 4; i++)
      PetscCall(PetscRandomGetValueReal(random, &r[i]));
    turn = aligned ? 0. : 2. * PETSC_PI * r[0];
    for (int i = 0; i < 2; i++)
      shift[i] = aligned && k % 8 == 3 ? 0. : 0.08 * (r[1 + i] - 0.5);
    for (PetscInt v = 0; v < m->nvertex; v++) {
      const PetscReal X[3] = {m->X[3 * v] - 0.05, m->X[3 * v + 1] - 0.05, m->X[3 * v + 2]};
      const PetscBool upper = (PetscBool)(m->part[v] == 1);

      x[3 * v] = upper ? PetscCosReal(turn) * X[0] - PetscSinReal(turn) * X[1] + shift[0] : X[0];
      x[3 * v + 1] =
        upper ? PetscSinReal(turn) * X[0] + PetscCosReal(turn) * X[1] + shift[1] : X[1];
      x[3 * v + 2] = X[2] + (upper ? 0.1 - depth : 0.);
    }
    o.touch = 1e-3 * size;
    PetscCall(SbContactOverlapFind(m, x, PETSC_FALSE, &o));
    SB_CHECK(!o.ncrossing || o.touches == (depth < o.touch), "%g m in each other: %s",
             (double)depth, o.touches ? "only touch" : "do not only touch");
    SB_CHECK(!o.touches || o.farthest <= depth + 1e-15, "%g m in each other, touching by %g m",
             (double)depth, (double)o.farthest);
    ntouch += o.touches;
  }
  VERIFY_MORE(ntouch, 20, "overlaps that only touch");
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(SbContactOverlapFree(&o));
  PetscCall(PetscFree(facet));
  PetscCall(SbContactSurfaceDestroy(&m));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rotation by random angles, R[9] row by row, times a random shear and stretch of up to
   `bend`. */
static PetscErrorCode random_map(PetscRandom random, PetscReal bend, PetscReal R[9])
{
  PetscReal q[4], r[9], B[9];
  PetscReal length = 0.;

  PetscFunctionBeginUser;
  for (int i = 0; i < 4; i++) {
    PetscCall(PetscRandomGetValueReal(random, &q[i]));
    q[i] = 2. * q[i] - 1.;
    length += q[i] * q[i];
  }
  for (int i = 0; i < 4; i++)
    q[i] /= PetscSqrtReal(length);
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      const int k = 3 - i - j;

      r[3 * i + j] = i == j ? 1. - 2. * (SbDot3(q, q) - q[i] * q[i])
                            : 2. * q[i] * q[j] + ((j - i + 3) % 3 == 1 ? -2. : 2.) * q[k] * q[3];
    }
  }
  for (int i = 0; i < 9; i++) {
    PetscReal value;

    PetscCall(PetscRandomGetValueReal(random, &value));
    B[i] = (i % 4 ? 0. : 1.) + bend * (2. * value - 1.);
  }
  for (int i = 0; i < 9; i++)
    R[i] =
      r[i / 3 * 3] * B[i % 3] + r[i / 3 * 3 + 1] * B[3 + i % 3] + r[i / 3 * 3 + 2] * B[6 + i % 3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A pair of convex bodies: boxes, spheres of facets or parallelepipeds about the origin, the second
   one moved by `way`. */
typedef struct {
  PetscBool round[2];
  PetscReal R[2][9], way[3];
} Convex;

static void place_convex(const Convex *c, int part, const PetscReal X[3], PetscReal x[3])
{
  PetscReal p[3] = {X[0] - 0.05, X[1] - 0.05, X[2] - 0.05};

  if (c->round[part]) {
    const PetscReal most =
      PetscMax(PetscAbsReal(p[0]), PetscMax(PetscAbsReal(p[1]), PetscAbsReal(p[2])));
    const PetscReal length = PetscSqrtReal(SbDot3(p, p));

    for (int i = 0; i < 3; i++)
      p[i] *= most / length;
  }
  for (int i = 0; i < 3; i++)
    x[i] = SbDot3(c->R[part] + 3 * i, p) + (part ? c->way[i] : 0.);
}

/* By how far both overlap along n, m. */
static PetscReal overlap_along(SbContactSurface m, const PetscReal x[], const PetscReal n[3])
{
  PetscReal high = PETSC_MIN_REAL;
  PetscReal low = PETSC_MAX_REAL;

  for (PetscInt v = 0; v < m->nvertex; v++)
    if (m->part[v])
      low = PetscMin(low, SbDot3(n, x + 3 * v));
    else
      high = PetscMax(high, SbDot3(n, x + 3 * v));
  return high - low;
}

/* The shortest motion that separates two convex bodies, by all directions in which it may be: the
   normals of all triangles, and those of all pairs of edges. */
static PetscReal brute_depth(SbContactSurface m, const PetscReal x[])
{
  PetscReal least = PETSC_MAX_REAL;
  PetscReal n[3], a[3], b[3];

  for (PetscInt t = 0; t < m->ntriangle; t++) {
    const PetscReal sign = m->part[m->triangle[3 * t]] ? -1. : 1.;

    (void)SbContactTriangleArea(x, m->triangle + 3 * t, n);
    (void)SbNormalise(n);
    for (int i = 0; i < 3; i++)
      n[i] *= sign;
    least = PetscMin(least, overlap_along(m, x, n));
  }
  for (PetscInt e = 0; e < m->nedge; e++) {
    for (PetscInt f = 0; f < m->nedge; f++) {
      PetscReal length;

      if (m->part[m->edge[2 * e]] || !m->part[m->edge[2 * f]])
        continue;
      SbSubtract(x + 3 * m->edge[2 * e], x + 3 * m->edge[2 * e + 1], a);
      SbSubtract(x + 3 * m->edge[2 * f], x + 3 * m->edge[2 * f + 1], b);
      SbCross(a, b, n);
      length = SbDot3(n, n);
      if (length <= 1e-6 * SbDot3(a, a) * SbDot3(b, b))
        continue;
      (void)SbNormalise(n);
      least = PetscMin(least, overlap_along(m, x, n));
      for (int i = 0; i < 3; i++)
        n[i] = -n[i];
      least = PetscMin(least, overlap_along(m, x, n));
    }
  }
  return least;
}

/* The depth that is reported of random pairs of convex bodies, from 3e-13 m to a third of their
   size: never more than the shortest motion that separates them, and not much less. */
static PetscErrorCode check_depths(void)
{
  SbContactOverlap o = {0};
  PetscReal *x, *y;
  PetscRandom random;
  SbContactSurface m, whole;
  SbFacet *facet;
  PetscInt nfacet, set;
  PetscReal least = 1.;
  PetscReal most = 0.;
  PetscInt nfound = 0;
  PetscInt ndeep = 0;
  SbSpace s;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("depth of convex bodies");
  PetscCall(test_open(&t, "-bodies a,b " MEET "-ts_dt 1e-3" SOFT("a", "box:0.1,0.1,0.1:2")
                            SOFT("b", "box:0.1,0.1,0.1:1")));
  s = t.run->model->space;
  PetscCall(SbSpaceFindSet(s, "boundary", "the test", &set));
  PetscCall(SbSpaceGetSetFacets(s, set, &nfacet, &facet));
  PetscCall(SbContactSurfaceCreate(s, nfacet, facet, NULL, &m));
  PetscCall(SbContactSurfaceCreateArray(m, &x));
  whole = m;
  if (m->sf)
    PetscCall(SbContactSurfaceGather(m, x, &whole, &y));
  else
    PetscCall(PetscMalloc1(3 * m->nvertex, &y));
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 11));
  PetscCall(PetscRandomSeed(random));
  o.touch = PETSC_MACHINE_EPSILON * PETSC_MACHINE_EPSILON;
  o.coplanar = PETSC_TRUE;
  for (int k = 0; k < PAIRS; k++) {
    const PetscReal depth = 0.03 * PetscPowReal(10., -(PetscReal)(k % 12));
    const int kind = k / 12 % 4; /* aligned boxes, boxes, parallelepipeds, spheres */
    PetscReal low = 0.;
    PetscReal high = 0.4;
    PetscReal u[3] = {1., 0., 0.};
    PetscReal truth;
    Convex c = {.round = {kind == 3, kind == 3}};

    for (int part = 0; part < 2; part++)
      PetscCall(random_map(random, kind == 2 ? 0.2 : 0., c.R[part]));
    for (int i = 0; i < 3 && kind; i++) {
      PetscCall(PetscRandomGetValueReal(random, &u[i]));
      u[i] = 2. * u[i] - 1.;
    }
    (void)SbNormalise(u);
    for (int i = 0; i < 18 && !kind; i++)
      c.R[i / 9][i % 9] = i % 9 % 4 ? 0. : 1.;

    /* halves the motion along u at which they overlap by the depth */
    for (int step = 0; step < 60; step++) {
      const PetscReal at = step ? 0.5 * (low + high) : high;

      for (int i = 0; i < 3; i++)
        c.way[i] = at * u[i] + (kind || !i || k % 24 < 12 ? 0. : 0.03);
      for (PetscInt v = 0; v < whole->nvertex; v++)
        place_convex(&c, (int)whole->part[v], whole->X + 3 * v, y + 3 * v);
      truth = brute_depth(whole, y);
      if (PetscAbsReal(truth - depth) < 1e-3 * depth)
        break;
      if (truth > depth)
        low = at;
      else
        high = at;
    }
    for (PetscInt v = 0; v < m->nvertex; v++)
      place_convex(&c, (int)m->part[v], m->X + 3 * v, x + 3 * v);
    PetscCall(SbContactOverlapFind(m, x, PETSC_FALSE, &o));
    ndeep += truth > 1e-6;
    nfound += truth > 1e-6 && o.ncrossing;
    SB_CHECK(o.farthest <= (1. + 1e-6) * truth + 1e-16, "kind %d, %g m deep: %g m are reported",
             kind, (double)truth, (double)o.farthest);
    if (!o.ncrossing || truth < 1e-14)
      continue;
    SB_CHECK(o.farthest >= SHALLOW * truth - 1e-16, "kind %d, %g m deep: only %g m are reported",
             kind, (double)truth, (double)o.farthest);
    least = PetscMin(least, o.farthest / truth);
    most = PetscMax(most, o.farthest / truth);
  }
  VERIFY_NEAR(nfound, ndeep, 0, "overlaps of more than 1e-6 m that are found");
  VERIFY_MORE(least, SHALLOW, "least depth over the true one");
  VERIFY_LESS(most, 1.001, "largest depth over the true one");
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(SbContactOverlapFree(&o));
  PetscCall(PetscFree(y));
  PetscCall(PetscFree(facet));
  if (whole != m)
    PetscCall(SbContactSurfaceDestroy(&whole));
  PetscCall(SbContactSurfaceDestroy(&m));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cube on another one, in it or above it by less than the width of the barrier, as parts from
   files are: both are moved apart by that width at most, and stay there. */
static PetscErrorCode check_touching(const char *response, PetscReal depth, const char *turn)
{
  const PetscReal width = 1e-3 * 0.1 * PetscSqrtReal(3.);
  const PetscReal angle = turn[0] ? PETSC_PI / 18. : 0.;
  const PetscReal shift = 0.5 * (0.013 + 0.05 * (PetscCosReal(angle) - PetscSinReal(angle)) -
                                 0.05); /* of the centre, m */
  PetscReal most;
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("touching, %s, %g m, %s", response, (double)depth, turn);
  PetscCall(record_run(
    &r,
    MEET STEPPING "-bodies a,b -body_b_translate 0.013,0.007,%.17g %s -effect_meet_response %s "
                  "-effects meet,held -effect_held_type fixed -effect_held_on a.zmin" SOFT(
                    "a", "box:0.1,0.1,0.1:2") SOFT("b", "box:0.1,0.1,0.1:3"),
    0.01, 0.1, (double)(0.1 - depth), turn, response));
  most = PetscMax(0., depth) / 0.01;
  VERIFY_NEAR(record_max(&r, "meet_unguarded"), 0, 0, "edges through triangles");
  VERIFY_LESS(2. * PetscAbsReal(record_at(&r, "centre_z", 1) - 0.1 + 0.5 * depth),
              1.01 * (width + most * 0.01), "displacement upwards in a step, m");
  VERIFY_LESS(2. * PetscAbsReal(record_at(&r, "centre_x", 1) - 0.05 - shift), 0.01 * width,
              "displacement to the side, m");
  VERIFY_LESS(record_max(&r, "speed"), 2. * most + 1e-9, "speed, m/s");
  VERIFY_LESS(record_max(&r, "strain"), 1e5 * 0.1 * PetscSqr(most * 0.01) + 1e-15,
              "strain energy, J");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscReal half[2] = {DEPTH, 0.13};
  const PetscReal small[2] = {0.04, 0.05};
  const PetscReal bars[2] = {0.008, 0.012};
  const PetscReal finger[2] = {0.1, 0.11};
  Record r = {0};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_touch_depths());
  PetscCall(check_depths());
  for (int k = 0; k < 5; k++) {
    static const char *const responses[] = {"barrier", "projected", "multiplier", "augmented",
                                            "penalty"};

    PetscCall(check_touching(responses[k], 1e-9, ""));
    PetscCall(check_touching(responses[k], 1e-6, "-body_b_rotate 0,0,1,10"));
  }
  PetscCall(check_touching("barrier", -1e-9, ""));
  PetscCall(check_touching("barrier", 1e-17, ""));
  PetscCall(check_touching("barrier", 1e-4, "-body_b_rotate 0,0,1,10"));
  PetscCall(check_bodies("cubes",
                         "-bodies a,b " SOFT("a", "box:0.1,0.1,0.1:3")
                           SOFT("b", "box:0.1,0.1,0.1:2") "-body_b_translate 0.05,0.003,0.004",
                         2, 0.4, half));
  PetscCall(check_bodies("cubes, CR, and themselves",
                         "-bodies a,b " SOFT("a", "box:0.1,0.1,0.1:3")
                           SOFT("b", "box:0.1,0.1,0.1:2") "-body_b_translate 0.05,0.003,0.004 "
                                                          "-body_a_element cr -body_b_element cr "
                                                          "-effect_meet_self yes",
                         2, 0.4, half));
  PetscCall(check_bodies(
    "a smaller one in a face, turned",
    "-bodies a,b " SOFT("a", "box:0.1,0.1,0.1:3")
      SOFT("b", "box:0.06,0.06,0.06:2") "-body_b_translate 0.06,0.02,0.03 -body_b_rotate 1,2,3,5",
    1.216, 0.4, small));
  PetscCall(check_bodies("crossed bars",
                         "-bodies a,b " SOFT("a", "box:0.2,0.02,0.02:10,1,1") SOFT(
                           "b", "box:0.02,0.2,0.02:1,10,1") "-body_b_translate 0.093,-0.0931,0.012",
                         0.16, 0.4, bars));
  PetscCall(check_bodies("finger",
                         "-bodies a,b " SOFT("a", "box:0.02,0.02,0.2:2,2,20") SOFT(
                           "b", "box:0.1,0.1,0.2:4,4,8") "-body_a_translate 0.041,0.0392,0.1 "
                                                         "-body_a_element cr -body_b_element dg",
                         2.08, 0.4, finger));
  PetscCall(check_aligned());

  /* bodies without contact do not move */
  verify_case("apart");
  PetscCall(record_run(&r,
                       MEET STEPPING "-bodies a,b -body_b_translate 0.101,0,0" SOFT(
                         "a", "box:0.1,0.1,0.1:3") SOFT("b", "box:0.1,0.1,0.1:2"),
                       STEP, 0.04));
  VERIFY_LESS(record_max(&r, "kinetic") + record_max(&r, "strain"), 1e-20, "energy, J");
  VERIFY_NEAR(record_max(&r, "meet_unguarded"), 0, 0, "edges through triangles");
  PetscCall(check_obstacle("plane:0,0,1,0"));
  PetscCall(check_obstacle("box:-0.1,-0.1,-0.05,0.2,0.2,0"));
  PetscCall(check_ring("p1"));
  PetscCall(check_ring("cr"));
  PetscCall(check_ring("p2"));
  SB_TEST_END();
}
