/*
  edge_meet.c - when two edges meet: the narrow phase of edge-edge pairs.

  Edges a + s e and b + t f have one normal n = +- e x f / |e x f|, along which the lines through them are nearest at some s and t; the
  gap is n . (a - b). n points away from the second edge's part. Two convex edges support each other only when n is in the normal cone of the
  second and -n in that of the first: the arcs of their facets' normals on the unit sphere cross (Gregorius, "The separating axis test
  between convex polyhedra", GDC 2013). The cone is the polar of the wedge: n makes no acute angle with the two directions that lead
  from the edge into its facets. Elsewhere a vertex or a facet is nearer, and points see that.

  A gap that is negative by more than rounding is a penetration only if the edges are in each other's part: it is less than the parts are
  thick there, or one of them pierces a facet at the other one. Without that, the edges of the far sides of two thin bars would be a
  pair. When bodies overlap far, the separation direction past edges is seldom the
  shortest: then points part them first. Edges that went through each other
  within the step are found at any depth (cross.c).

  One of the two is sharp, the other at least bent: where surfaces are smooth, vertices hold them apart. Two surfaces of edges h that
  bend by an angle theta at each edge, edge on edge, are in each other by (h / 2) tan(theta / 2) before a vertex notices: an eighth of h
  where both are hardly sharp, 1 % where a sharp one lies on one that is hardly bent. Edges that are nearly parallel have no normal; their ends are seen by points, but for 2.5 % of h.
*/
#include "detect.h"
#include "edge.h"

#define SHARP \
  0.9 /* cosine between the normals of an edge's facets, above which it is not sharp: 26 degrees */
#define BENT 0.9986   /* the same, above which it is flat: 3 degrees */
#define PARALLEL 0.05 /* sine between two edges, below which they have no normal */
#define CONE \
  0.05 /* so far, 3 degrees, the normal may leave the cones: edges flush with a face are pairs also when all bends a little */
#define END \
  1e-9 /* of an edge: nearer to its ends it is a vertex, which points see; so rounding does not decide who does */
#define DEEP \
  0.25 /* of the reach: the largest depth at which edges that are in each other are a pair without a motion */
#define SHALLOW 1e-3 /* of the reach: a depth that is taken for touching */
#define THICK 0.25 /* of the rest thickness of both parts: a depth within them, also when they are squeezed */
#define START \
  0.1 /* of the reach: so deep a pair may begin the step and be in front: it lay in contact (near.c) */
#define FLAT 1e-8  /* height over length of a facet, below which it has no normal */
#define TOUCH 1e-9 /* of the reach: depth that counts after a passage */

static inline void subtract(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  for (int k = 0; k < 3; k++) c[k] = a[k] - b[k];
}

SbEdgeKind SbEdgeKindOf(const PetscReal *const x[4])
{
  PetscReal e[3], u[3], v[3], n[3], m[3], dot, nn, mm, ee;

  subtract(x[1], x[0], e);
  subtract(x[2], x[0], u);
  subtract(x[3], x[0], v);
  SbCross(e, u, n);
  if (!(SbDot3(v, n) < 0)) return SB_EDGE_FLAT;
  SbCross(v, e, m);
  dot = SbDot3(n, m);
  nn = SbDot3(n, n);
  mm = SbDot3(m, m);
  if (dot > 0 && dot * dot >= BENT * BENT * nn * mm) return SB_EDGE_FLAT;
  ee = FLAT * FLAT * SbDot3(e, e);
  if (!(nn > ee * SbDot3(u, u) && mm > ee * SbDot3(v, v))) return SB_EDGE_FLAT;
  return dot > 0 && dot * dot >= SHARP * SHARP * nn * mm ? SB_EDGE_BENT : SB_EDGE_SHARP;
}

void SbEdgeInto(SbEdgePlace *p)
{
  PetscReal e[3], e2;

  subtract(p->x[1], p->x[0], e);
  e2 = SbDot3(e, e);
  for (int i = 0; i < 2; i++) {
    PetscReal *t = p->into[i], along, length;

    subtract(p->x[2 + i], p->x[0], t);
    along = SbDot3(t, e) / e2;
    for (int k = 0; k < 3; k++) t[k] -= along * e[k];
    length = PetscSqrtReal(SbDot3(t, t));
    for (int k = 0; k < 3; k++) t[k] /= length;
  }
}

/* Whether the segment from p to q meets the triangle. */
static PetscBool pierces(const PetscReal p[3], const PetscReal q[3], const PetscReal *const x[3])
{
  PetscReal a[3], b[3], n[3], r[3], hp, hq, n2, t;

  subtract(x[1], x[0], a);
  subtract(x[2], x[0], b);
  SbCross(a, b, n);
  n2 = SbDot3(n, n);
  subtract(p, x[0], a);
  subtract(q, x[0], b);
  hp = SbDot3(a, n);
  hq = SbDot3(b, n);
  if (hp == hq || (hp > 0) == (hq > 0)) return PETSC_FALSE;
  t = hp / (hp - hq);
  for (int k = 0; k < 3; k++) r[k] = p[k] + t * (q[k] - p[k]);
  for (int i = 0; i < 3; i++) {
    PetscReal side[3];

    subtract(x[(i + 1) % 3], x[i], a);
    subtract(r, x[i], b);
    SbCross(a, b, side);
    if (SbDot3(side, n) < -1e-9 * n2) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Whether an edge pierces one of the two facets of the other. */
static PetscBool is_in(const SbEdgePlace *e, const SbEdgePlace *f)
{
  for (int i = 0; i < 2; i++) {
    const PetscReal *const x[3] = {f->x[i], f->x[1 - i], f->x[2 + i]};

    if (pierces(e->x[0], e->x[1], x)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The unit normal, and where on both lines they are nearest; false when there is no normal or it is in no cone. */
static PetscBool normal_of(const SbEdgePlace *first, const SbEdgePlace *second, PetscReal n[3],
                           PetscReal at[2])
{
  PetscReal e[3], f[3], d[3], c[3], n2, length, side;

  subtract(first->x[1], first->x[0], e);
  subtract(second->x[1], second->x[0], f);
  SbCross(e, f, n);
  n2 = SbDot3(n, n);
  if (!(n2 > PARALLEL * PARALLEL * SbDot3(e, e) * SbDot3(f, f))) return PETSC_FALSE;
  subtract(second->x[0], first->x[0], d);
  SbCross(d, f, c);
  at[0] = SbDot3(c, n) / n2;
  SbCross(d, e, c);
  at[1] = SbDot3(c, n) / n2;
  side = SbDot3(n, second->into[0]) + SbDot3(n, second->into[1]);
  length = PetscSqrtReal(n2) * (side > 0 ? -1 : 1);
  for (int k = 0; k < 3; k++) n[k] /= length;
  for (int i = 0; i < 2; i++) {
    if (SbDot3(n, second->into[i]) > CONE || SbDot3(n, first->into[i]) < -CONE) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Whether the first edge went through the second one against the normal. */
static PetscBool went_through(const SbEdgePlace *first, const SbEdgePlace *second, const PetscReal n[3],
                              PetscReal reach)
{
  const PetscReal tolerance[2] = {START * reach, TOUCH * reach};
  const PetscReal *f0[2] = {second->x0[0], second->x0[1]}, *f1[2] = {second->x[0], second->x[1]}, *t;
  PetscReal e[3], f[3], c[3], time;
  PetscBool behind;

  subtract(first->x[1], first->x[0], e);
  subtract(second->x[1], second->x[0], f);
  SbCross(e, f, c);
  if (SbDot3(c, n) < 0) {
    t = f0[0];
    f0[0] = f0[1];
    f0[1] = t;
    t = f1[0];
    f1[0] = f1[1];
    f1[1] = t;
  }
  return SbCCDEdgeEdge(first->x0, first->x, f0, f1, tolerance, &time, &behind);
}

/* The least cosine between a normal of the edge and those of its facets: of a way along it the part that leads away from a facet. */
static PetscReal steepest(const SbEdgePlace *e, const PetscReal n[3])
{
  const PetscReal a = SbDot3(n, e->into[0]), b = SbDot3(n, e->into[1]);

  return PetscSqrtReal(PetscMax(0, 1 - PetscMax(a * a, b * b)));
}

PetscBool SbEdgesMeet(const SbEdgePlace *first, const SbEdgePlace *second, PetscReal reach, SbEdgePair *pair)
{
  PetscReal gap = 0;
  PetscBool between;

  if (!normal_of(first, second, pair->normal, pair->at)) return PETSC_FALSE;
  between =
    (PetscBool)(PetscMin(pair->at[0], pair->at[1]) > END && PetscMax(pair->at[0], pair->at[1]) < 1 - END);
  for (int i = 0; i < 2; i++) pair->at[i] = PetscMax(0, PetscMin(1, pair->at[i]));
  for (int k = 0; k < 3; k++) {
    const PetscReal a = first->x[0][k] + pair->at[0] * (first->x[1][k] - first->x[0][k]);

    gap += pair->normal[k] * (a - second->x[0][k] - pair->at[1] * (second->x[1][k] - second->x[0][k]));
  }
  pair->gap = gap;
  pair->depth = gap < 0 ? -gap * PetscMin(steepest(first, pair->normal), steepest(second, pair->normal)) : 0;
  pair->crossed = PETSC_FALSE;
  if (between && gap <= reach && gap >= -DEEP * reach &&
      (gap >= -PetscMax(SHALLOW * reach, THICK * (first->thick + second->thick)) || is_in(first, second) ||
       is_in(second, first)))
    return PETSC_TRUE;
  pair->crossed = (PetscBool)(gap < 0 && first->x0[0] && went_through(first, second, pair->normal, reach));
  return pair->crossed;
}

static PetscReal clamp(PetscReal t)
{
  return PetscMax(0, PetscMin(1, t));
}

PetscReal SbEdgesDistance2(const PetscReal *const a[2], const PetscReal *const b[2])
{
  PetscReal u[3], v[3], w[3], uu, vv, uv, uw, vw, s, t;

  /* Ericson, "Real-Time Collision Detection", 5.1.9 */
  subtract(a[1], a[0], u);
  subtract(b[1], b[0], v);
  subtract(a[0], b[0], w);
  uu = SbDot3(u, u);
  vv = SbDot3(v, v);
  uv = SbDot3(u, v);
  uw = SbDot3(u, w);
  vw = SbDot3(v, w);
  s = uu * vv - uv * uv > 1e-14 * uu * vv ? clamp((uv * vw - uw * vv) / (uu * vv - uv * uv)) : 0;
  t = vv > 0 ? (uv * s + vw) / vv : 0;
  if (!(t >= 0 && t <= 1)) {
    t = clamp(t);
    s = uu > 0 ? clamp((t * uv - uw) / uu) : 0;
  } else if (!(vv > 0))
    s = uu > 0 ? clamp(-uw / uu) : 0;
  for (int k = 0; k < 3; k++) w[k] += s * u[k] - t * v[k];
  return SbDot3(w, w);
}
