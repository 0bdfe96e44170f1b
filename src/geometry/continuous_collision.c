/*
  continuous_collision.c - a moving point goes through a moving triangle, a moving edge through another one.

  Point and corners move on straight lines x0 + t (x1 - x0). With u = p - a, v = b - a, w = c - a the four lie in one plane where
  f(t) = u . (v x w) = 0, a cubic (Provot, "Collision and self-collision handling in cloth model dedicated to design garments", 1997;
  Bridson, Fedkiw, Anderson, "Robust treatment of collisions, contact and friction for cloth animation", 2002). f > 0 in front. The
  zeros of f' cut [0, 1] into pieces where f is monotone: each change of sign has a root of its own, found by bisection, whatever the
  cubic degenerates to. A root counts when the point then is in the triangle; a zero that is only touched does not.

  Two edges a + s v and b + r w are the same cubic with u = a - b; a root counts when s and r then are in [0, 1].
*/
#include "sbgeometry.h"

#define INSIDE_SLACK \
  1e-6 /* of barycentric coordinates: what goes through an edge is found by one of its two facets */
#define PARALLEL 1e-3 /* sine between two edges, below which they do not cross anywhere */
#define FLAT 1e-10    /* area over squared length, below which a triangle has none */

/* u, v, w at the start, and by how much they change. */
typedef struct {
  PetscReal u[2][3], v[2][3], w[2][3];
} Motion;

static void at(const Motion *m, PetscReal t, PetscReal u[3], PetscReal v[3], PetscReal w[3])
{
  for (int k = 0; k < 3; k++) {
    u[k] = m->u[0][k] + t * m->u[1][k];
    v[k] = m->v[0][k] + t * m->v[1][k];
    w[k] = m->w[0][k] + t * m->w[1][k];
  }
}

static PetscReal volume(const Motion *m, PetscReal t)
{
  PetscReal u[3], v[3], w[3], n[3];

  at(m, t, u, v, w);
  SbCross(v, w, n);
  return SbDot3(u, n);
}

/* Whether the foot of the point lies in the triangle at time t. */
static PetscBool inside(const Motion *m, PetscReal t)
{
  PetscReal u[3], v[3], w[3], n[3], a[3], b[3], n2, beta, gamma;

  at(m, t, u, v, w);
  SbCross(v, w, n);
  n2 = SbDot3(n, n);
  if (n2 <= FLAT * FLAT * SbDot3(v, v) * SbDot3(w, w)) return PETSC_FALSE;
  SbCross(u, w, a);
  SbCross(v, u, b);
  beta = SbDot3(a, n) / n2;
  gamma = SbDot3(b, n) / n2;
  return (PetscBool)(beta >= -INSIDE_SLACK && gamma >= -INSIDE_SLACK && beta + gamma <= 1 + INSIDE_SLACK);
}

/* Whether the edges a + s v and b + r w, u = a - b, cross between their ends at time t. */
static PetscBool on_both(const Motion *m, PetscReal t)
{
  PetscReal u[3], v[3], w[3], n[3], a[3], b[3], n2, s, r;

  at(m, t, u, v, w);
  SbCross(v, w, n);
  n2 = SbDot3(n, n);
  if (n2 <= PARALLEL * PARALLEL * SbDot3(v, v) * SbDot3(w, w)) return PETSC_FALSE;
  SbCross(w, u, a);
  SbCross(v, u, b);
  s = SbDot3(a, n) / n2;
  r = SbDot3(b, n) / n2;
  return (PetscBool)(s >= -INSIDE_SLACK && s <= 1 + INSIDE_SLACK && r >= -INSIDE_SLACK &&
                     r <= 1 + INSIDE_SLACK);
}

/* Zeros of c1 + 2 c2 t + 3 c3 t^2 inside (0, 1), ascending; how many. */
static int turning_points(const PetscReal c[4], PetscReal t[2])
{
  const PetscReal a = 3 * c[3], b = c[2], disc = b * b - a * c[1];
  PetscReal q, r[2];
  int n = 0;

  if (!(disc > 0)) return 0;
  q = -(b + (b < 0 ? -1 : 1) * PetscSqrtReal(disc));
  r[0] = a != 0 ? q / a : -1;
  r[1] = q != 0 ? c[1] / q : -1;
  for (int i = 0; i < 2; i++) {
    if (r[i] > 0 && r[i] < 1) t[n++] = r[i];
  }
  if (n == 2 && t[0] > t[1]) {
    q = t[0];
    t[0] = t[1];
    t[1] = q;
  }
  return n;
}

/* The root of f between t0 and t1, where it has different signs and is monotone. */
static PetscReal bisect(const Motion *m, PetscReal t0, PetscReal t1, PetscBool front)
{
  for (int i = 0; i < 60; i++) {
    const PetscReal t = 0.5 * (t0 + t1);

    if (t <= t0 || t >= t1) break;
    if ((volume(m, t) >= 0) == front)
      t0 = t;
    else
      t1 = t;
  }
  return 0.5 * (t0 + t1);
}

/* Coefficients of f; false when it cannot have been positive: no Bernstein coefficient is above -slack. */
static PetscBool coefficients(const Motion *m, PetscReal slack, PetscReal c[4])
{
  PetscReal n00[3], n01[3], n10[3], n11[3];

  SbCross(m->v[0], m->w[0], n00);
  SbCross(m->v[0], m->w[1], n01);
  SbCross(m->v[1], m->w[0], n10);
  SbCross(m->v[1], m->w[1], n11);
  c[0] = SbDot3(m->u[0], n00);
  c[1] = SbDot3(m->u[0], n01) + SbDot3(m->u[0], n10) + SbDot3(m->u[1], n00);
  c[2] = SbDot3(m->u[0], n11) + SbDot3(m->u[1], n01) + SbDot3(m->u[1], n10);
  c[3] = SbDot3(m->u[1], n11);
  slack *= PetscSqrtReal(SbDot3(n00, n00));
  return (PetscBool)(c[0] >= -slack || c[0] + c[1] / 3 >= -slack || c[0] + (2 * c[1] + c[2]) / 3 >= -slack);
}

/* How far the origin of u is in front of the plane of v and w at time t, m; and the length of v x w. */
static PetscReal height(const Motion *m, PetscReal t, PetscReal *length)
{
  PetscReal u[3], v[3], w[3], n[3];

  at(m, t, u, v, w);
  SbCross(v, w, n);
  *length = PetscSqrtReal(SbDot3(n, n));
  return SbDot3(u, n);
}

/* Whether the last passage leads from the front to the back; `inside` tells where passages count. */
static PetscBool passes(const Motion *m, PetscBool (*within)(const Motion *, PetscReal),
                        const PetscReal tolerance[2], PetscReal *time, PetscBool *behind)
{
  PetscReal c[4], t[4] = {0}, length;
  PetscBool front, through = PETSC_FALSE;
  int pieces;

  if (!(height(m, 1, &length) < -tolerance[1] * length)) return PETSC_FALSE;
  if (!coefficients(m, tolerance[0], c)) return PETSC_FALSE;

  /* a start just behind is one in front that goes through at once */
  front = (PetscBool)(c[0] >= 0);
  *behind = PETSC_FALSE;
  (void)height(m, 0, &length);
  if (!front && c[0] >= -tolerance[0] * length && within(m, 0)) {
    through = *behind = PETSC_TRUE;
    *time = 0;
  }

  /* the last passage counts: out again is not through */
  pieces = turning_points(c, t + 1) + 1;
  t[pieces] = 1;
  for (int i = 0; i < pieces; i++) {
    const PetscBool next = (PetscBool)(i + 1 < pieces && volume(m, t[i + 1]) >= 0);
    PetscReal root;

    if (next == front) continue;
    root = bisect(m, t[i], t[i + 1], front);
    if (within(m, root)) {
      through = front;
      *time = root;
      *behind = PETSC_FALSE;
    }
    front = next;
  }
  return through;
}

PetscBool SbCCDPointTriangle(const PetscReal p0[3], const PetscReal p1[3], const PetscReal *const x0[3],
                             const PetscReal *const x1[3], const PetscReal tolerance[2], PetscReal *time,
                             PetscBool *behind)
{
  Motion m;

  for (int k = 0; k < 3; k++) {
    m.u[0][k] = p0[k] - x0[0][k];
    m.v[0][k] = x0[1][k] - x0[0][k];
    m.w[0][k] = x0[2][k] - x0[0][k];
    m.u[1][k] = p1[k] - x1[0][k] - m.u[0][k];
    m.v[1][k] = x1[1][k] - x1[0][k] - m.v[0][k];
    m.w[1][k] = x1[2][k] - x1[0][k] - m.w[0][k];
  }
  return passes(&m, inside, tolerance, time, behind);
}

PetscBool SbCCDEdgeEdge(const PetscReal *const e0[2], const PetscReal *const e1[2],
                        const PetscReal *const f0[2], const PetscReal *const f1[2],
                        const PetscReal tolerance[2], PetscReal *time, PetscBool *behind)
{
  Motion m;

  for (int k = 0; k < 3; k++) {
    m.u[0][k] = e0[0][k] - f0[0][k];
    m.v[0][k] = e0[1][k] - e0[0][k];
    m.w[0][k] = f0[1][k] - f0[0][k];
    m.u[1][k] = e1[0][k] - f1[0][k] - m.u[0][k];
    m.v[1][k] = e1[1][k] - e1[0][k] - m.v[0][k];
    m.w[1][k] = f1[1][k] - f1[0][k] - m.w[0][k];
  }
  return passes(&m, on_both, tolerance, time, behind);
}
