// @ranks 1
/*
  Detection by trees of bounding volumes: all pairs that are near each other are candidates, and the contacts are those of the
  detector by brute force, with boxes and k-DOPs, on random, degenerate and moving scenes; refitting and building
  again; what self-contact costs; how the number of visits grows.
*/
#include "bvh_scene.h"
#include "sbbvh.h"
#include "../../src/contact/detect.h"

enum { NVOLUME = 2 };
static const PetscInt planes[NVOLUME] = {6, 14};

/* The edges of a finished scene. */
static PetscErrorCode add_edges(Scene *c)
{
  PetscFunctionBeginUser;
  PetscCall(SbEdgesDestroy(&c->edges));
  PetscCall(SbEdgesCreate(&c->s, &c->edges));
  c->s.edges = &c->edges;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two to four bodies of all sorts that overlap a little. */
static PetscErrorCode random_scene(Scene *c, unsigned seed)
{
  unsigned state = seed;
  const PetscInt nbody = 2 + below(&state, 3);
  const PetscReal scale = seed % 7 == 0 ? 1e-6 : seed % 7 == 1 ? 1e3 : 1;
  const PetscReal speed = seed % 2 ? scale * (below(&state, 2) ? 2 : 0.1) : 0;

  PetscFunctionBeginUser;
  scene_clear(c);
  for (PetscInt part = 0; part < nbody; part++) {
    const PetscInt v0 = c->s.ncorner, f0 = c->s.nfacet, kind = below(&state, 7);
    PetscReal size = 0.4 + 0.2 * number(&state);

    if (kind == 0)
      add_box(c, part);
    else if (kind == 1)
      add_sphere(c, part, 1 + below(&state, 4));
    else if (kind == 2)
      add_soup(c, part, 20 + below(&state, 40), &state);
    else if (kind == 3) {
      /* one facet much larger than all others */
      (void)add_vertex(c, -3, -3, 0);
      (void)add_vertex(c, 3, -3, 0);
      (void)add_vertex(c, 0, 3, 0);
      add_facet(c, part, v0, v0 + 1, v0 + 2);
    } else if (kind == 4) {
      /* crumpled: closed, with ridges, saddles and folds */
      add_sphere(c, part, 2 + below(&state, 5));
      for (PetscInt i = 3 * v0; i < 3 * c->s.ncorner; i++) c->x[i] += 0.15 * number(&state);
    } else if (kind == 5) {
      /* thin plates in a stack: facets on far sides are within reach of each other */
      for (int plate = 0; plate < 3; plate++) {
        const PetscInt first = c->s.ncorner;

        add_sphere(c, part, 3);
        for (PetscInt v = first; v < c->s.ncorner; v++)
          c->x[3 * v + 2] = 0.01 * c->x[3 * v + 2] + 0.03 * plate + 0.1 * PetscSqr(c->x[3 * v]);
      }
    } else {
      add_box(c, part);
      if (!below(&state, 4)) size *= 1e-3;
    }
    if (part == 1 && kind == 0 && below(&state, 2)) {
      /* the same box at the same place: faces that coincide */
      add_points(c, part, v0, f0, 2);
      continue;
    }
    move(c, v0, scale * size, scale * (part == 3 ? 1e4 : 0.5), speed, &state);
    add_points(c, part, v0, f0, 2);
  }
  c->s.self = (PetscBool)(seed % 3 == 0);
  c->s.reach = scale * (seed % 5 == 0 ? 1e-9 : seed % 5 == 1 ? 0.5 : 0.05);
  if (seed % 2) {
    c->s.x0 = c->x0;
    c->s.p0 = c->p0;
  }
  /* everything was far apart at rest, so that all pairs of self-contact count */
  for (PetscInt i = 0; i < 3 * c->s.ncorner && c->s.self; i++) c->X[i] *= 1e3;
  PetscCall(scene_finish(c));
  PetscCall(add_edges(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ what must be found */

/* Squared distance of p from the segment a b. */
static PetscReal from_segment(const PetscReal p[3], const PetscReal a[3], const PetscReal b[3])
{
  PetscReal e[3], r[3], t;

  for (int i = 0; i < 3; i++) {
    e[i] = b[i] - a[i];
    r[i] = p[i] - a[i];
  }
  t = SbDot3(e, e) > 0 ? PetscMax(0, PetscMin(1, SbDot3(e, r) / SbDot3(e, e))) : 0;
  for (int i = 0; i < 3; i++) r[i] -= t * e[i];
  return SbDot3(r, r);
}

/* Distance of point and facet now: to the three edges, or to the plane where the foot is inside. inside: it is. */
static PetscReal distance(const Scene *c, PetscInt point, PetscInt facet, PetscBool *inside)
{
  const PetscReal *p = c->p + 3 * point, *x[3];
  PetscReal n[3], d2 = PETSC_MAX_REAL, n2;
  int left = 0;

  for (int k = 0; k < 3; k++) x[k] = c->x + 3 * c->facet[3 * facet + k];
  facet_normal(c, facet, n);
  n2 = SbDot3(n, n);
  for (int k = 0; k < 3; k++) {
    const PetscReal *a = x[k], *b = x[(k + 1) % 3];
    PetscReal e[3], r[3], side[3];

    for (int i = 0; i < 3; i++) {
      e[i] = b[i] - a[i];
      r[i] = p[i] - a[i];
    }
    SbCross(e, r, side);
    left += SbDot3(side, n) > 0;
    d2 = PetscMin(d2, from_segment(p, a, b));
  }
  *inside = (PetscBool)(left == 3 && n2 > 0);
  if (*inside) {
    const PetscReal r[3] = {p[0] - x[0][0], p[1] - x[0][1], p[2] - x[0][2]};

    return PetscAbsReal(SbDot3(r, n)) / PetscSqrtReal(n2);
  }
  return PetscSqrtReal(d2);
}

typedef struct {
  PetscInt64 near, candidates, contacts, crossed, culled, edges;
} Totals;

/*
  Each pair within reach must be a candidate. With self-contact and no motion those that do not face each other need not be; whether
  one that is left out matters is told by the contacts.
*/
static void check_candidates(const Scene *c, SbDetector d, const char *what, Totals *sum)
{
  PetscInt missing = 0, twice = 0;
  PetscBool *seen;

  if (PetscCalloc1(c->s.nfacet, &seen)) return;
  for (PetscInt p = 0; p < c->s.npoint; p++) {
    for (PetscInt k = d->start[p]; k < d->start[p + 1]; k++) {
      if (seen[d->candidate[k]]) twice++;
      seen[d->candidate[k]] = PETSC_TRUE;
    }
    sum->candidates += d->start[p + 1] - d->start[p];
    for (PetscInt f = 0; f < c->s.nfacet; f++) {
      PetscBool inside;
      PetscReal n[3];

      if (!SbDetectPairWanted(&c->s, p, f) || distance(c, p, f, &inside) > c->s.reach) continue;
      facet_normal(c, f, n);
      sum->near++;
      if (seen[f]) continue;
      if (!c->s.self || SbDot3(n, c->normal + 3 * p) < 0)
        missing++;
      else
        sum->culled++;
    }
    for (PetscInt k = d->start[p]; k < d->start[p + 1]; k++) seen[d->candidate[k]] = PETSC_FALSE;
  }
  SB_CHECK(!missing && !twice, "%s: %d pairs within reach are no candidates, %d are twice", what,
           (int)missing, (int)twice);
  (void)PetscFree(seen);
}

static PetscInt differences(PetscInt n, const SbNear a[], PetscInt m, const SbNear b[])
{
  PetscInt sum = PetscAbsInt(n - m);

  for (PetscInt i = 0; i < PetscMin(n, m); i++)
    sum += a[i].point != b[i].point || a[i].facet != b[i].facet || a[i].gap != b[i].gap ||
           a[i].crossed != b[i].crossed;
  return sum;
}

/* Whether two lists of pairs of edges are the same. */
static PetscBool same_edges(PetscInt n, const SbEdgePair a[], PetscInt m, const SbEdgePair b[])
{
  for (PetscInt i = 0; i < PetscMin(n, m); i++) {
    if (a[i].edge[0] != b[i].edge[0] || a[i].edge[1] != b[i].edge[1] || a[i].gap != b[i].gap ||
        a[i].crossed != b[i].crossed)
      return PETSC_FALSE;
  }
  return (PetscBool)(n == m);
}

static PetscErrorCode check_random(Scene *c)
{
  SbDetector brute, bvh[NVOLUME];
  Totals sum = {0};

  PetscFunctionBeginUser;
  PetscCall(SbDetectorCreate(SB_DETECT_BRUTE, &brute));
  for (int i = 0; i < NVOLUME; i++) {
    PetscCall(SbDetectorCreate(SB_DETECT_BVH, &bvh[i]));
    PetscCall(SbBvhSet(bvh[i], planes[i]));
  }
  for (unsigned seed = 1; seed <= 240; seed++) {
    const SbEdgePair *expected_edges, *edges;
    const SbNear *expected, *near;
    PetscInt n, m, nedges, medges;
    char what[64];

    PetscCall(random_scene(c, seed));
    PetscCall(SbDetectorFind(brute, &c->s, &n, &expected));
    PetscCall(SbDetectorFindEdges(brute, &c->s, &nedges, &expected_edges));
    sum.contacts += n;
    sum.edges += nedges;
    for (PetscInt i = 0; i < n; i++) sum.crossed += expected[i].crossed ? 1 : 0;
    for (int i = 0; i < NVOLUME; i++) {
      PetscCall(SbDetectorFind(bvh[i], &c->s, &m, &near));
      PetscCall(PetscSNPrintf(what, sizeof(what), "scene %u, %d planes", seed, (int)planes[i]));
      SB_CHECK(!differences(n, expected, m, near), "%s: %d contacts, brute force finds %d, or they differ",
               what, (int)m, (int)n);
      PetscCall(SbDetectorFindEdges(bvh[i], &c->s, &medges, &edges));
      SB_CHECK(same_edges(nedges, expected_edges, medges, edges),
               "%s: %d pairs of edges, brute force finds %d, or they differ", what, (int)medges, (int)nedges);
      check_candidates(c, bvh[i], what, &sum);
    }
  }
  SB_CHECK(sum.contacts > 1000 && sum.crossed > 50 && sum.culled > 1000,
           "few contacts (%d), crossings (%d), culled pairs (%d)", (int)sum.contacts, (int)sum.crossed,
           (int)sum.culled);
  PetscCall(SbDetectorDestroy(&brute));
  for (int i = 0; i < NVOLUME; i++) PetscCall(SbDetectorDestroy(&bvh[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ motion */

/* Two spheres that roll on each other: refitted trees find what new ones find; scattered vertices make the trees again. */
static PetscErrorCode check_refit(Scene *c, PetscInt k)
{
  SbDetector kept, fresh;
  SbDetectStats stats;
  unsigned state = 5;
  PetscInt found = 0;

  PetscFunctionBeginUser;
  scene_clear(c);
  for (PetscInt part = 0; part < 2; part++) {
    const PetscInt v0 = c->s.ncorner, f0 = c->s.nfacet;

    add_sphere(c, part, 6);
    for (PetscInt v = v0; v < c->s.ncorner; v++) c->x[3 * v] += 1.95 * (PetscReal)part;
    add_points(c, part, v0, f0, 3);
  }
  c->s.reach = 0.1;
  PetscCall(SbDetectorCreate(SB_DETECT_BVH, &kept));
  PetscCall(SbBvhSet(kept, k));
  for (int step = 0; step < 20; step++) {
    const SbNear *a, *b;
    PetscInt n, m;

    /* turns about z and a flattening that grows; the last steps throw all vertices about */
    for (PetscInt v = 0; v < c->s.ncorner; v++) {
      PetscReal *x = c->x + 3 * v;
      const PetscReal angle = v < c->s.ncorner / 2 ? 0.1 : -0.13, centre = v < c->s.ncorner / 2 ? 0 : 1.95;
      const PetscReal y[2] = {x[0] - centre, x[1]};

      x[0] = centre + y[0] * PetscCosReal(angle) - y[1] * PetscSinReal(angle);
      x[1] = y[0] * PetscSinReal(angle) + y[1] * PetscCosReal(angle);
      for (int i = 0; i < 3 && step >= 15; i++) x[i] = 2 * number(&state);
    }
    PetscCall(scene_finish(c));
    PetscCall(SbDetectorFind(kept, &c->s, &n, &a));
    PetscCall(SbDetectorCreate(SB_DETECT_BVH, &fresh));
    PetscCall(SbBvhSet(fresh, k));
    PetscCall(SbDetectorFind(fresh, &c->s, &m, &b));
    SB_CHECK(!differences(n, a, m, b),
             "step %d: refitted trees find %d contacts, new ones %d, or they differ", step, (int)n, (int)m);
    PetscCall(SbDetectorDestroy(&fresh));
    PetscCall(SbDetectorGetStats(kept, &stats));
    if (step < 15) {
      found += n;
      SB_CHECK(stats.rebuilt == 1, "step %d: the trees are built %d times", step, (int)stats.rebuilt);
    }
  }
  SB_CHECK(found > 100, "the spheres hardly touch: %d contacts", (int)found);
  PetscCall(SbDetectorDestroy(&kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Many small bodies of one part that change places: the tree over them no longer fits, and is rebuilt once. */
static PetscErrorCode check_rebuild(Scene *c)
{
  enum { NBODY = 200 };
  SbDetector d;
  SbDetectStats stats;
  SbBvhCounts counts;
  PetscInt64 visits[3] = {0, 0, 0};
  unsigned state = 11;

  PetscFunctionBeginUser;
  scene_clear(c);
  for (PetscInt body = 0; body < NBODY; body++) {
    const PetscInt v0 = c->s.ncorner, f0 = c->s.nfacet, part = body % 2, row = body / 20;

    add_box(c, part);
    for (PetscInt v = v0; v < c->s.ncorner; v++) {
      c->x[3 * v] = 0.6 * c->X[3 * v] + (PetscReal)(body % 20);
      c->x[3 * v + 1] = 0.6 * c->X[3 * v + 1] + (PetscReal)row;
    }
    add_points(c, part, v0, f0, 0);
  }
  c->s.reach = 0.5;
  PetscCall(SbDetectorCreate(SB_DETECT_BVH, &d));
  for (int round = 0; round < 3; round++) {
    const SbNear *near;
    PetscInt n;

    /* the second time they have changed places */
    for (PetscInt body = NBODY - 1; body > 0 && round == 1; body--) {
      const PetscInt other = below(&state, body + 1);

      for (PetscInt i = 0; i < 24; i++) {
        const PetscReal x = c->x[24 * body + i];

        c->x[24 * body + i] = c->x[24 * other + i];
        c->x[24 * other + i] = x;
      }
    }
    PetscCall(scene_finish(c));
    PetscCall(SbDetectorFind(d, &c->s, &n, &near));
    PetscCall(SbDetectorGetStats(d, &stats));
    PetscCall(SbBvhGetCounts(d, &counts));
    visits[round] = counts.visits;
    SB_CHECK(stats.rebuilt == (round ? 2 : 1), "round %d: the trees are built %d times", round,
             (int)stats.rebuilt);
  }
  SB_CHECK(visits[1] < 2 * visits[0] && visits[2] == visits[1], "visits: %ld, rebuilt %ld, then %ld",
           (long)visits[0], (long)visits[1], (long)visits[2]);
  SB_CHECK(strstr(stats.text, "boxes") && stats.memory > 0, "text %s, %ld bytes", stats.text,
           (long)stats.memory);
  PetscCall(SbDetectorDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ self-contact */

/* A strip folded to a hairpin: two legs 0.02 apart, outsides outwards, and an arc of 0.8 between them. */
static void hairpin(PetscReal u, PetscReal v, PetscReal x[3])
{
  const PetscReal s = 3 * u - 1.5, R = 0.01, half = R * PETSC_PI / 2;

  x[1] = 0.3 * v;
  if (PetscAbsReal(s) < half) {
    x[0] = R * PetscCosReal(s / R);
    x[2] = R * PetscSinReal(s / R);
  } else {
    x[0] = half - PetscAbsReal(s);
    x[2] = s > 0 ? R : -R;
  }
}

static void flat_strip(PetscReal u, PetscReal v, PetscReal x[3])
{
  x[0] = 3 * u - 1.5;
  x[1] = 0.3 * v;
  x[2] = 0;
}

/* What a tree of volumes of k planes does in a scene; its contacts are checked against brute force. */
typedef struct {
  PetscInt found, inside; /* contacts, those with a negative gap */
  PetscInt64 candidates, visits;
} Outcome;

static PetscErrorCode find_both(const Scene *c, PetscInt k, Outcome *out)
{
  SbDetector brute, d;
  SbBvhCounts counts;
  const SbNear *a, *b;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbDetectorCreate(SB_DETECT_BRUTE, &brute));
  PetscCall(SbDetectorCreate(SB_DETECT_BVH, &d));
  PetscCall(SbBvhSet(d, k));
  PetscCall(SbDetectorFind(brute, &c->s, &n, &a));
  PetscCall(SbDetectorFind(d, &c->s, &out->found, &b));
  SB_CHECK(!differences(n, a, out->found, b), "%d contacts by brute force, %d by the tree, or they differ",
           (int)n, (int)out->found);
  PetscCall(SbBvhGetCounts(d, &counts));
  out->inside = 0;
  for (PetscInt i = 0; i < out->found; i++) out->inside += b[i].gap < 0;
  out->candidates = d->start[c->s.npoint];
  out->visits = counts.visits;
  PetscCall(SbDetectorDestroy(&brute));
  PetscCall(SbDetectorDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A strip with the normals towards the other leg: two sides that touch; or away from it: each leg is behind the other one. */
static PetscErrorCode check_folded(Scene *c, PetscBool towards)
{
  Outcome out;

  PetscFunctionBeginUser;
  scene_clear(c);
  add_sheet(c, 0, 30, (PetscBool)!towards, flat_strip);
  for (PetscInt v = 0; v < c->s.ncorner; v++)
    hairpin((c->X[3 * v] + 1.5) / 3, c->X[3 * v + 1] / 0.3, c->x + 3 * v);
  add_points(c, 0, 0, 0, 0);
  c->s.self = PETSC_TRUE;
  c->s.reach = 0.03;
  PetscCall(scene_finish(c));
  PetscCall(find_both(c, 6, &out));
  /* of the 31 rows of points the one on the fold is too close to its neighbours at rest */
  SB_CHECK(out.found >= 29 * 31 && out.found <= 31 * 31 && out.inside == (towards ? 0 : out.found),
           "folded strip: %d contacts, %d of them inside", (int)out.found, (int)out.inside);
  SB_CHECK(out.candidates < 70 * (PetscInt64)out.found, "folded strip: %ld candidates", (long)out.candidates);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A sphere at rest that may meet itself: finer, and the visits per point fall, since whole regions cannot face each other. */
static PetscErrorCode check_sphere(Scene *c, PetscInt k)
{
  static const PetscInt sizes[] = {4, 8, 16, 32};
  PetscReal each[4];

  PetscFunctionBeginUser;
  for (int i = 0; i < 4; i++) {
    Outcome out;

    scene_clear(c);
    add_sphere(c, 0, sizes[i]);
    add_points(c, 0, 0, 0, 0);
    c->s.self = PETSC_TRUE;
    c->s.reach = 0.5 / (PetscReal)sizes[i];
    PetscCall(scene_finish(c));
    PetscCall(find_both(c, k, &out));
    each[i] = (PetscReal)out.visits / (PetscReal)c->s.npoint;
    SB_CHECK(!out.found, "sphere of %d facets at rest: %d contacts with itself", (int)c->s.nfacet,
             (int)out.found);
    SB_CHECK(out.candidates <= (i ? 0 : 7 * c->s.npoint), "sphere of %d facets at rest: %ld candidates",
             (int)c->s.nfacet, (long)out.candidates);
  }
  SB_CHECK(each[3] < 0.5 * each[2] && each[2] < 0.8 * each[1] && each[3] < 1.5,
           "visits per point, finer and finer: %g %g %g %g", (double)each[0], (double)each[1],
           (double)each[2], (double)each[3]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ cost */

static void wavy(PetscReal u, PetscReal v, PetscReal x[3])
{
  x[0] = u;
  x[1] = v;
  x[2] = 0.1 * PetscSinReal(9 * u) * PetscCosReal(7 * v);
}

#define FULL 1.4 /* times as many nodes as there would be if all had all children */

/* Two wavy sheets face to face: visits and candidates per point hardly grow with the number of facets. */
static PetscErrorCode check_growth(Scene *c, PetscInt k)
{
  static const PetscInt sizes[] = {10, 40, 130};
  PetscReal each[3], per_near[3];
  SbDetector d;

  PetscFunctionBeginUser;
  PetscCall(SbDetectorCreate(SB_DETECT_BVH, &d));
  PetscCall(SbBvhSet(d, k));
  for (int i = 0; i < 3; i++) {
    const SbNear *near;
    SbBvhCounts counts;
    PetscInt n;

    scene_clear(c);
    add_sheet(c, 0, sizes[i], PETSC_FALSE, wavy);
    add_points(c, 0, 0, 0, 0);
    const PetscInt v0 = c->s.ncorner;

    add_sheet(c, 1, sizes[i], PETSC_TRUE, wavy);
    for (PetscInt v = v0; v < c->s.ncorner; v++) {
      c->x[3 * v] += 0.3 / (PetscReal)sizes[i];
      c->x[3 * v + 2] += 0.3 / (PetscReal)sizes[i];
    }
    add_points(c, 1, v0, 0, 0);
    c->s.reach = 0.6 / (PetscReal)sizes[i];
    PetscCall(scene_finish(c));
    PetscCall(SbDetectorFind(d, &c->s, &n, &near));
    PetscCall(SbBvhGetCounts(d, &counts));
    each[i] = (PetscReal)counts.visits / (PetscReal)c->s.npoint;
    per_near[i] = (PetscReal)d->start[c->s.npoint] / (PetscReal)n;
    /* full nodes are the fewest */
    SB_CHECK(counts.nodes * 7 < FULL * c->s.nfacet, "%d nodes with up to 8 children over %d facets",
             (int)counts.nodes, (int)c->s.nfacet);
    SB_CHECK(n > c->s.npoint * 8 / 10, "only %d of %d points meet the other sheet", (int)n, (int)c->s.npoint);
  }
  /* below a few levels all boxes look alike; growth with the square root would be 3.2 */
  SB_CHECK(each[2] < 1.4 * each[1], "%d planes: visits per point %g, %g, %g", (int)k, (double)each[0],
           (double)each[1], (double)each[2]);
  SB_CHECK(per_near[2] < 12, "%d planes: %g candidates per contact", (int)k, (double)per_near[2]);
  PetscCall(SbDetectorDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_errors(void)
{
  SbDetector d;

  PetscFunctionBeginUser;
  PetscCall(SbDetectorCreate(SB_DETECT_BVH, &d));
  SB_CHECK_ERROR(SbBvhSet(d, 12), PETSC_ERR_ARG_OUTOFRANGE, "12|14");
  PetscCall(SbDetectorDestroy(&d));
  PetscCall(SbDetectorCreate(SB_DETECT_BRUTE, &d));
  SB_CHECK_ERROR(SbBvhSet(d, 6), PETSC_ERR_ARG_WRONG, "brute|bvh");
  PetscCall(SbDetectorDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing to search for, and a single facet and point. */
static PetscErrorCode check_small(Scene *c)
{
  Outcome out;

  PetscFunctionBeginUser;
  scene_clear(c);
  c->s.reach = 0.1;
  PetscCall(find_both(c, 6, &out));
  SB_CHECK(!out.found && !out.visits, "an empty scene: %d contacts, %ld visits", (int)out.found,
           (long)out.visits);
  (void)add_vertex(c, 0, 0, 0);
  (void)add_vertex(c, 1, 0, 0);
  (void)add_vertex(c, 0, 1, 0);
  (void)add_vertex(c, 0.2, 0.2, 0.05);
  add_point(c, 1, 3, -1);
  PetscCall(scene_finish(c));
  PetscCall(find_both(c, 6, &out));
  SB_CHECK(!out.found, "a point without facets: %d contacts", (int)out.found);
  add_facet(c, 0, 0, 1, 2);
  PetscCall(scene_finish(c));
  c->normal[2] = -1;
  PetscCall(find_both(c, 6, &out));
  SB_CHECK(out.found == 1 && out.candidates == 1 && out.visits == 1, "one facet, one point: %d contacts",
           (int)out.found);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Scene c;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(scene_create(&c));
  PetscCall(check_random(&c));
  PetscCall(check_rebuild(&c));
  PetscCall(check_folded(&c, PETSC_TRUE));
  PetscCall(check_folded(&c, PETSC_FALSE));
  for (int i = 0; i < NVOLUME; i++) {
    PetscCall(check_refit(&c, planes[i]));
    PetscCall(check_sphere(&c, planes[i]));
    PetscCall(check_growth(&c, planes[i]));
  }
  PetscCall(check_small(&c));
  PetscCall(check_errors());
  PetscCall(scene_destroy(&c));
  SB_TEST_END();
}
