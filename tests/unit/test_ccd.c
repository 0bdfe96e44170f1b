// @ranks 1
/*
  Time of impact: never later than the true one, and its accuracy, on random and degenerate motions;
  against roots of the cubic, the smallest distance over the step in extended precision, and times
  from another library.
*/
#include "pair_reference.h"

#define NRANDOM 300000

static const SbCCDLimits usual = {0, 0, 0.1, 0};

/* ------------------------------------------------------------------ reference solutions */

typedef struct {
  SbPairKind kind;
  long double x[12], q[12]; /* start and displacement, relative to the first vertex */
  long double speed;        /* bound of the rate of change of the distance */
} Motion;

static void make_motion(SbPairKind kind, const PetscReal x0[], const PetscReal x1[], Motion *m)
{
  const int n = pair_vertices(kind);
  const int first = pair_first(kind);

  m->kind = kind;
  m->speed = 0;
  for (int i = 0; i < 3 * n; i++) {
    m->x[i] = (long double)x0[i] - x0[i % 3];
    m->q[i] = ((long double)x1[i] - x1[i % 3]) - m->x[i];
  }
  for (int i = 0; i < first; i++) {
    for (int j = first; j < n; j++)
      m->speed =
        fmaxl(m->speed, hypotl(hypotl(m->q[3 * i] - m->q[3 * j], m->q[3 * i + 1] - m->q[3 * j + 1]),
                               m->q[3 * i + 2] - m->q[3 * j + 2]));
  }
}

static long double distance_at(const Motion *m, long double t)
{
  long double x[12];

  for (int i = 0; i < 3 * pair_vertices(m->kind); i++)
    x[i] = m->x[i] + t * m->q[i];
  return pair_distance(m->kind, x);
}

/* First time in [from, to] at which the distance is at most `level`, within 1e-6; above 1:
   never. */
static long double first_below(const Motion *m, long double level, long double from, long double to)
{
  const long double middle = 0.5L * (from + to);
  const long double half = 0.5L * (to - from);
  const long double d = distance_at(m, middle);
  long double t;

  if (d - m->speed * half > level)
    return 2;
  if (half < 5e-7L)
    return d <= level ? from : distance_at(m, to) <= level ? to : 2;
  t = first_below(m, level, from, middle);
  return t <= 1 ? t : first_below(m, level, middle, to);
}

static void cross(const long double a[3], const long double b[3], long double c[3])
{
  for (int k = 0; k < 3; k++)
    c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static long double dot(const long double a[3], const long double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Volume spanned by the four vertices at time t; `inside`: least barycentric coordinate of the
   intersection point in both primitives. */
static long double volume(const Motion *m, long double t, long double *inside)
{
  long double x[12], u[3], v[3], r[3], n[3], c[3], a, b, nn;

  for (int i = 0; i < 12; i++)
    x[i] = m->x[i] + t * m->q[i];
  for (int k = 0; k < 3; k++) {
    const int edges = m->kind == SB_PAIR_EDGE_EDGE;

    u[k] = edges ? x[3 + k] - x[k] : x[6 + k] - x[3 + k];
    v[k] = x[9 + k] - x[(edges ? 6 : 3) + k];
    r[k] = x[k] - x[(edges ? 6 : 3) + k];
  }
  cross(u, v, n);
  nn = dot(n, n);
  if (inside) {
    cross(v, r, c);
    a = dot(c, n) / nn;
    cross(u, r, c);
    b = dot(c, n) / nn;
    if (m->kind == SB_PAIR_EDGE_EDGE)
      *inside = fminl(fminl(a, 1 - a), fminl(b, 1 - b));
    else
      *inside = fminl(fminl(-a, b), 1 + a - b);
  }
  return dot(r, n);
}

/* First time at which the primitives cross in their interiors; above 1: never. Roots of the cubic
   between its stationary points. */
static long double first_crossing(const Motion *m)
{
  long double f[4], c[4];
  long double turn[4] = {0};
  long double disc;
  int n = 1;

  for (int i = 0; i < 4; i++)
    f[i] = volume(m, i / 3.0L, NULL);
  c[3] = 4.5L * (f[3] - 3 * f[2] + 3 * f[1] - f[0]);
  c[2] = 4.5L * (2 * f[0] - 5 * f[1] + 4 * f[2] - f[3]);
  c[1] = 0.5L * (-11 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]);
  disc = c[2] * c[2] - 3 * c[3] * c[1];
  if (disc > 0) {
    const long double q = -(c[2] + (c[2] < 0 ? -1 : 1) * sqrtl(disc));
    const long double r = c[3] != 0 ? q / (3 * c[3]) : -1;
    const long double s = q != 0 ? c[1] / q : -1;

    if (fminl(r, s) > 0 && fminl(r, s) < 1)
      turn[n++] = fminl(r, s);
    if (fmaxl(r, s) > 0 && fmaxl(r, s) < 1)
      turn[n++] = fmaxl(r, s);
  }
  turn[n] = 1;
  for (int i = 0; i < n; i++) {
    long double low = turn[i];
    long double high = turn[i + 1];
    long double inside;
    const int positive = volume(m, low, NULL) > 0;

    if ((volume(m, high, NULL) > 0) == positive)
      continue;
    for (int k = 0; k < 64; k++) {
      const long double middle = 0.5L * (low + high);

      if ((volume(m, middle, NULL) > 0) == positive)
        low = middle;
      else
        high = middle;
    }
    (void)volume(m, high, &inside);
    if (inside > 1e-9L)
      return high;
  }
  return 2;
}

/* ------------------------------------------------------------------ random motions */

static void make_random(int i, PetscReal x0[12], PetscReal x1[12])
{
  static const PetscReal sizes[] = {1, 1, 1e-6, 1e3};
  static const PetscReal fast[] = {0.3, 1, 1e-3, 1, 10, 1e-12, 1e6};
  const PetscReal size = sizes[i / 12 % 4];
  const PetscReal speed = fast[i / 48 % 7];
  const PetscReal far = i / 336 % 4 == 0 ? 1024 : 0;
  const PetscReal common = i / 1344 % 3 == 0 ? 100 * pair_random() : 0;

  for (int k = 0; k < 12; k++) {
    x0[k] = pair_random();
    x1[k] = x0[k] + speed * pair_random();
  }
  switch (i % 12) {
  case 1: /* flat configuration, normal motion slow against the tangential motion */
    for (int a = 0; a < 4; a++) {
      x0[3 * a + 2] *= 1e-3;
      x1[3 * a + 2] = x0[3 * a + 2] + 1e-3 * pair_random();
    }
    break;
  case 2: /* coplanar */
    for (int a = 0; a < 4; a++)
      x0[3 * a + 2] = x1[3 * a + 2] = 0;
    break;
  case 3: /* parallel edges */
    for (int k = 0; k < 3; k++) {
      x0[9 + k] = x0[6 + k] + 0.5 * (x0[3 + k] - x0[k]);
      x1[9 + k] = x1[6 + k] + 0.5 * (x1[3 + k] - x1[k]);
    }
    break;
  case 4: /* nearly parallel edges */
    for (int k = 0; k < 3; k++) {
      x0[9 + k] = x0[6 + k] + 0.5 * (x0[3 + k] - x0[k]) + 1e-8 * pair_random();
      x1[9 + k] = x1[6 + k] + 0.5 * (x1[3 + k] - x1[k]) + 1e-8 * pair_random();
    }
    break;
  case 5: /* head-on passage */
  case 6:
    for (int a = 0; a < 4; a++) {
      const PetscBool first = (PetscBool)(i % 12 == 6 && a == 1 ? 1 : a == 0);

      x0[3 * a + 2] = first ? 0.02 : 0;
      for (int k = 0; k < 3; k++)
        x1[3 * a + k] = x0[3 * a + k] + (k == 2 && first ? -0.25 * speed : 0);
    }
    break;
  case 7: /* initially close */
    for (int k = 0; k < 3; k++) {
      x0[k] = 0.2 * x0[3 + k] + 0.3 * x0[6 + k] + 0.5 * x0[9 + k] + 1e-5 * pair_random();
      x1[k] = x0[k] + speed * pair_random();
    }
    break;
  case 8: /* fixed triangle, moving vertex */
    for (int k = 3; k < 12; k++)
      x1[k] = x0[k];
    break;
  case 9: /* nearly collinear vertices (sliver triangle) */
    for (int k = 0; k < 3; k++) {
      x0[9 + k] = 0.4 * x0[3 + k] + 0.6 * x0[6 + k] + 1e-6 * pair_random();
      x1[9 + k] = 0.4 * x1[3 + k] + 0.6 * x1[6 + k] + 1e-6 * pair_random();
    }
    break;
  default:
    break;
  }
  for (int k = 0; k < 12; k++) {
    x0[k] = size * (x0[k] + far);
    x1[k] = size * (x1[k] + far + common);
  }
}

static int ascending(const void *a, const void *b)
{
  const float p = *(const float *)a;
  const float q = *(const float *)b;

  return (p > q) - (p < q);
}

/* The time of impact precedes the passage and is close to it; the remaining gap is as specified. */
static PetscErrorCode check_random(void)
{
  PetscInt late = 0;
  PetscInt missed = 0;
  PetscInt loose = 0;
  PetscInt touching = 0;
  PetscInt through[2] = {0, 0};
  PetscInt impacts = 0;
  float *ratio;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(NRANDOM, &ratio));
  for (int i = 0; i < NRANDOM; i++) {
    const SbPairKind kind = i % 2 ? SB_PAIR_EDGE_EDGE : SB_PAIR_VERTEX_TRIANGLE;
    PetscReal x0[12], x1[12], t;
    long double truth;
    PetscBool impact;
    Motion m;

    make_random(i / 2, x0, x1);
    make_motion(kind, x0, x1, &m);
    impact = SbTimeOfImpact(kind, x0, x1, &usual, &t);
    truth = first_crossing(&m);
    impacts += impact;
    if (truth <= 1) {
      ratio[through[kind == SB_PAIR_EDGE_EDGE] + through[kind != SB_PAIR_EDGE_EDGE]] =
        (float)(t / truth);
      through[kind == SB_PAIR_EDGE_EDGE]++;
      missed += !impact;
      late += t >= truth;
    }
    if (i % 8 < 2) {
      const long double gap = distance_at(&m, 0);
      const long double left = distance_at(&m, t);

      /* the remaining gap is positive; after an impact it is a tenth of the first gap or a little
         less */
      touching += t > 0 && !(left > 0);
      loose += impact && t > 0 && left > 0.1000001L * gap + 1e-9L * m.speed + 1e-10L * fabs(x0[0]);
      touching += impact && left < 0.0899L * gap;
    }
  }
  qsort(ratio, (size_t)(through[0] + through[1]), sizeof(*ratio), ascending);
  SB_CHECK(through[0] > NRANDOM / 50 && through[1] > NRANDOM / 50, "passages: %d and %d",
           (int)through[0], (int)through[1]);
  SB_CHECK(impacts > NRANDOM / 10 && impacts < NRANDOM / 2, "%d impacts", (int)impacts);
  SB_CHECK(missed == 0, "%d passages are not seen", (int)missed);
  SB_CHECK(late == 0, "%d impacts are later than the passage", (int)late);
  SB_CHECK(touching == 0, "at %d impacts less gap is left than should be", (int)touching);
  SB_CHECK(loose < NRANDOM / 100000, "%d impacts are early", (int)loose);

  /* in a straight passage 0.1 to 0.09 of the path remains */
  SB_CHECK(ratio[(through[0] + through[1]) / 2] >= 0.9,
           "median of the time of impact over that of the passage %g",
           ratio[(through[0] + through[1]) / 2]);
  printf(
    "time of impact over that of the passage: 1 %% %.3f, 10 %% %.3f, median %.3f, largest %.6f\n",
    ratio[(through[0] + through[1]) / 100], ratio[(through[0] + through[1]) / 10],
    ratio[(through[0] + through[1]) / 2], ratio[through[0] + through[1] - 1]);
  PetscCall(PetscFree(ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All pair kinds, with radii and separations: the time is between those at which the gap falls to
   the kept gap and to nine tenths of it. */
static void check_levels(void)
{
  PetscInt impacts = 0;
  PetscInt inside = 0;
  PetscInt seen[4] = {0};

  for (int i = 0; i < 12000; i++) {
    const SbPairKind kind = (SbPairKind)(i % 4);
    const PetscReal radius = i % 3 == 0 ? 0 : 0.2 * PetscAbsReal(pair_random());
    const SbCCDLimits limits = {radius, i % 5 ? 1e-3 * PetscAbsReal(pair_random()) : 0.5,
                                i % 7 ? 0.1 : 0.5, i % 11 ? 0 : 0.01};
    PetscReal x0[12], x1[12], t;
    long double gap, least, keep, from, to;
    PetscBool impact;
    Motion m;

    for (int k = 0; k < 12; k++) {
      x0[k] = pair_random();
      x1[k] = x0[k] + (i % 8 < 4 ? 1 : 0.3) * pair_random();
    }
    for (int k = 0; k < 3 * pair_first(kind) && i % 3 < 2; k++)
      x1[k] += x0[3 * pair_first(kind) + k % 3] - x0[k % 3]; /* towards each other */
    make_motion(kind, x0, x1, &m);
    gap = distance_at(&m, 0) - radius;
    impact = SbTimeOfImpact(kind, x0, x1, &limits, &t);
    if (gap <= 0) {
      inside++;
      SB_CHECK(impact && t == 0, "a pair in each other goes on by %g", t);
      continue;
    }
    least = fminl(limits.separation, gap / 2);
    keep = limits.keep * (gap - least);
    if (limits.most > 0)
      keep = fminl(keep, limits.most);
    from = first_below(&m, radius + least + keep, 0, 1);
    to = first_below(&m, radius + least + 0.899L * keep, 0, 1);
    impacts += impact;
    seen[kind] += impact;
    if (impact) {
      SB_CHECK(t >= from - 2e-6L && t <= to + 2e-6L, "motion %d: time %g, should be in [%Lg, %Lg]",
               i, t, from, to);
    } else
      SB_CHECK(t == 1 && to > 1, "motion %d: an impact at %Lg is missed", i, to);
  }
  SB_CHECK(impacts > 2000 && inside > 100, "%d impacts, %d in each other", (int)impacts,
           (int)inside);
  for (int k = 0; k < 4; k++)
    SB_CHECK(seen[k] > 200, "impacts of kind %d: %d", k, (int)seen[k]);
}

/* ------------------------------------------------------------------ named motions */

/*
  Times of Tight Inclusion CCD (Wang et al., "A large-scale benchmark and an inclusion-based
  algorithm for continuous collision detection", 2021), ipc-toolkit 1.6.1, tolerance 1e-9, kept gap
  a ten-thousandth; -1: no impact. The time of the degenerate triangle is computed by hand.
*/
typedef struct {
  const char *name;
  PetscReal x0[12], x1[12], time;
} Named;

/* A vertex, against the triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) at rest. */
static const struct {
  const char *name;
  PetscReal from[3], to[3], time;
} passages[] = {
  {"through the inside, 50 m/s in 5 ms", {0.3, 0.3, 0.02}, {0.3, 0.3, -0.23}, 0.079992},
  {"through an edge", {0.5, 0, 0.02}, {0.5, 0, -0.23}, 0.079992},
  {"through a corner", {0, 0, 0.02}, {0, 0, -0.23}, 0.079992},
  {"in the plane, onto an edge", {2, 0.3, 0}, {0.3, 0.3, 0}, 0.764588},
  {"in the plane, along an edge onto its end", {-1, 0, 0}, {1, 0, 0}, 0.499950},
  {"in the plane, past it", {2, 2, 0}, {-1, 2, 0}, -1.0000},
  {"past an edge", {0.5, -0.001, 0.5}, {0.5, -0.001, -0.5}, -1.0000},
  {"along the triangle", {0.3, 0.3, 0.001}, {5.3, 4.3, 0.001}, -1.0000},
  {"away", {0.3, 0.3, 1e-06}, {0.3, 0.3, 1}, -1.0000},
};
static const Named triangles[] = {
  {"a triangle turned past a resting point",
   {0.3, 0.3, 0.1, 0, 0, 0, 1, 0, 0, 0, 1, 0},
   {0.3, 0.3, 0.1, 0, 0, 0, 1, 0, 0.5, 0, 1, 0.5},
   0.333289},
  {"a triangle turned over about its edge",
   {0.3, 0.3, 0.1, 0, 0, 0, 1, 0, 0, 0, 1, 0},
   {0.3, 0.3, 0.1, 0, 0, 0, 1, 0, 0, 0, -1, 0.01},
   -1.0000},
  {"a triangle without area",
   {0.3, 0.1, 0.5, 0, 0, 0, 1, 0, 0, 0.5, 0, 0},
   {0.3, -0.1, -0.5, 0, 0, 0, 1, 0, 0, 0.5, 0, 0},
   0.499949},
  {"a triangle without extent",
   {0.3, 0.1, 0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0},
   {-0.3, -0.1, -0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0},
   0.5000},
  {"a triangle that closes on a point",
   {0.3, 0.3, 0, 2, 0, 0, 3, 0, 0, 2, 1, 0},
   {0.3, 0.3, 0, 0.3, 0.3, 0, -3, 0.3, 0, 0.3, -3, 0},
   0.999667},
  {"both fast, slow on each other",
   {0.3, 0.3, 0.02, 0, 0, 0, 1, 0, 0, 0, 1, 0},
   {1000.3, 0.3, -0.01, 1000, 0, 0, 1001, 0, 0, 1000, 1, 0},
   0.666600},
  {"far away",
   {8192.3, 8192.3, 8192.02, 8192, 8192, 8192, 8193, 8192, 8192, 8192, 8193, 8192},
   {8192.3, 8192.3, 8191.9, 8192, 8192, 8192, 8193, 8192, 8192, 8192, 8193, 8192},
   0.166650},
  {"both move",
   {0.2, 0.3, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0},
   {0.4, 0.1, -1, -0.2, 0, -0.3, 1.5, 0.2, 0.4, 0, 0.7, 0.1},
   0.505541},
};
static const Named edges[] = {
  {"through, 50 m/s in 5 ms",
   {-0.1, 0, 0.02, 0.1, 0, 0.02, 0, -0.1, 0, 0, 0.1, 0},
   {-0.1, 0, -0.23, 0.1, 0, -0.23, 0, -0.1, 0, 0, 0.1, 0},
   0.079992},
  {"parallel, onto each other",
   {-1, 0, 1, 1, 0, 1, -0.5, 0, 0, 2, 0, 0},
   {-1, 0, -1, 1, 0, -1, -0.5, 0, 0, 2, 0, 0},
   0.499947},
  {"parallel, past each other",
   {-1, 0, 1, 1, 0, 1, 1.5, 0, 0, 2, 0, 0},
   {-1, 0, -1, 1, 0, -1, 1.5, 0, 0, 2, 0, 0},
   -1.0000},
  {"on one line, end to end",
   {0, 0, 0, 1, 0, 0, 3, 0, 0, 4, 0, 0},
   {0, 0, 0, 1, 0, 0, 0.5, 0, 0, 1.5, 0, 0},
   0.799927},
  {"in one plane, an end onto an edge",
   {0, 1, 0, 0, 2, 0, -1, 0, 0, 1, 0, 0},
   {0, -1, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0},
   0.499950},
  {"through both ends",
   {0, 0, 1, 1, 0, 1, 1, 0, 0, 1, 1, 0},
   {0, 0, -1, 1, 0, -1, 1, 0, 0, 1, 1, 0},
   0.499950},
  {"just past the ends",
   {0, 0, 1, 0.999, 0, 1, 1, 0, 0, 1, 1, 0},
   {0, 0, -1, 0.999, 0, -1, 1, 0, 0, 1, 1, 0},
   -1.0000},
  {"turned through",
   {-1, 0, 0.1, 1, 0, 0.1, 0, -1, 0, 0, 1, 0},
   {-1, 0, 0.1, 1, 0, -0.4, 0, -1, 0, 0, 1, 0},
   0.399956},
  {"an edge without length",
   {0.2, 0.1, 1, 0.2, 0.1, 1, -1, 0, 0, 1, 0, 0},
   {0.2, -0.1, -1, 0.2, -0.1, -1, -1, 0, 0, 1, 0, 0},
   0.499950},
  {"two edges without length",
   {0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0},
   {0, 0, -1, 0, 0, -1, 0, 0, 0, 0, 0, 0},
   0.499950},
  {"nearly parallel",
   {-1, 0, 1, 1, 1e-08, 1, -1, 0, 0, 1, -1e-08, 1e-08},
   {-1, 0, -1, 1, 1e-08, -1, -1, 0, 0, 1, -1e-08, 1e-08},
   0.499947},
  {"away",
   {-1, 0, 1e-06, 1, 0, 1e-06, 0, -1, 0, 0, 1, 0},
   {-1, 0, 1, 1, 0, 1, 0, -1, 0, 0, 1, 0},
   -1.0000},
  {"along each other",
   {-1, 0, 0.001, 1, 0, 0.001, -1, 0.001, 0, 1, 0, 0},
   {4, 0, 0.001, 6, 0, 0.001, -1, 0.001, 0, 1, 0, 0},
   -1.0000},
  {"far away, both fast",
   {4095, 4096, 4096.02, 4097, 4096, 4096.02, 4096, 4095, 4096, 4096, 4097, 4096},
   {5095, 4096, 4095.98, 5097, 4096, 4095.98, 5096, 4095, 4096, 5096, 4097, 4096},
   0.499950},
  {"both move",
   {-1, 0.1, 0.5, 1, -0.2, 0.4, 0, -1, 0, 0.2, 1, -0.1},
   {-0.8, 0.5, -0.6, 1.3, 0.2, -0.3, 0.1, -1, 0.2, 0, 1, 0.3},
   0.416893},
};

static void check_one(SbPairKind kind, const Named *c)
{
  const SbCCDLimits limits = {0, 0, 1e-4, 0};
  PetscReal t;
  const PetscBool impact = SbTimeOfImpact(kind, c->x0, c->x1, &limits, &t);

  SB_CHECK(impact == (c->time >= 0), "%s: impact %d at %g", c->name, impact, t);
  if (impact && c->time >= 0)
    SB_CHECK_NEAR(t, c->time, 2e-4, c->name);
}

/* Units, distant positions, unbounded and zero motions, and values that are not finite. */
static void check_limits(void)
{
  const PetscReal above[12] = {0.25, 0.25, 0.5, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  SbCCDLimits limits = usual;
  PetscReal x[12], t, first;

  for (int k = 0; k < 12; k++)
    x[k] = above[k] + (k == 2 ? -1 : 0.1 * k / 11);
  SB_CHECK(SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, x, &usual, &first), "no impact");
  for (int e = -40; e <= 40; e += 8) {
    PetscReal a[12], b[12];

    for (int k = 0; k < 12; k++) {
      a[k] = PetscPowReal(2, e) * above[k];
      b[k] = PetscPowReal(2, e) * x[k];
    }
    SB_CHECK(SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, a, b, &usual, &t) && t == first,
             "in units of 2^%d the time is %.17g, not %.17g", e, t, first);
  }
  SB_CHECK(!SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, above, &usual, &t) && t == 1,
           "a pair at rest");
  for (int k = 0; k < 12; k++)
    x[k] = above[k] + 1e6;
  SB_CHECK(!SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, x, &usual, &t) && t == 1,
           "a pair that moves as one");
  for (int e = -12; e <= 6; e++) {
    const PetscReal v = PetscPowReal(10, e);

    for (int k = 0; k < 12; k++)
      x[k] = above[k] - (k == 2 ? v : 0);
    SB_CHECK(SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, x, &usual, &t) == (v > 0.46),
             "moves by %g", v);
    if (v > 0.46)
      SB_CHECK(t >= 0.9 * 0.5 / v && t <= 0.911 * 0.5 / v, "moves by %g: %g", v, t);
  }

  /* gaps below the rounding error of the coordinates */
  for (int k = 0; k < 12; k++)
    x[k] = above[k] - (k == 2);
  for (int e = 0; e < 24; e++) {
    PetscReal a[12], b[12];
    const PetscReal far = PetscPowReal(2, e);
    const PetscReal gap = PetscPowReal(2, -30);

    for (int k = 0; k < 12; k++)
      a[k] = b[k] = far + (k == 2 ? gap : k % 3 == 2 ? 0 : above[k]);
    b[2] -= 2 * gap;
    SB_CHECK(SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, a, b, &usual, &t), "no impact at %g m", far);
    if (far >= gap / (SB_CCD_ROUNDING * PETSC_MACHINE_EPSILON))
      SB_CHECK(t == 0, "a gap of rounding is let go by %g", t);
    else
      SB_CHECK(t > 0 && t <= 0.46, "at %g m the time is %g", far, t);
  }

  /* gap below the separation: half of it is kept; a receding or sliding pair moves freely */
  limits.separation = 2;
  for (int k = 0; k < 12; k++)
    x[k] = above[k] - (k == 2 ? 1 : 0);
  SB_CHECK(SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, x, &limits, &t), "no impact");
  SB_CHECK(t >= 0.2249 && t <= 0.2275, "half the gap and a tenth of the rest are not kept: time %g",
           t);
  x[0] = 0.1;
  x[2] = above[2];
  SB_CHECK(!SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, x, &limits, &t) && t == 1,
           "a pair that slides");
  x[2] = above[2] + 1;
  SB_CHECK(!SbTimeOfImpact(SB_PAIR_VERTEX_TRIANGLE, above, x, &limits, &t) && t == 1,
           "a pair that recedes");

  for (int k = 0; k < 24; k++) {
    PetscReal a[2][12];

    for (int j = 0; j < 12; j++) {
      a[0][j] = above[j];
      a[1][j] = above[j] + 0.01 * j;
    }
    a[k / 12][k % 12] = k % 5 ? NAN : INFINITY;
    for (int kind = SB_PAIR_VERTEX_TRIANGLE; kind <= SB_PAIR_EDGE_EDGE; kind++)
      SB_CHECK(SbTimeOfImpact((SbPairKind)kind, a[0], a[1], &usual, &t) && t == 0,
               "goes to no number by %g", t);
  }
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_random());
  check_levels();
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(passages); i++) {
    Named c = {.name = passages[i].name,
               .time = passages[i].time,
               .x0 = {[6] = 1, [10] = 1},
               .x1 = {[6] = 1, [10] = 1}};

    for (int k = 0; k < 3; k++) {
      c.x0[k] = passages[i].from[k];
      c.x1[k] = passages[i].to[k];
    }
    check_one(SB_PAIR_VERTEX_TRIANGLE, &c);
  }
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(triangles); i++)
    check_one(SB_PAIR_VERTEX_TRIANGLE, &triangles[i]);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(edges); i++)
    check_one(SB_PAIR_EDGE_EDGE, &edges[i]);
  check_limits();
  SB_TEST_END();
}
