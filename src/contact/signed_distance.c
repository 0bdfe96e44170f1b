/*
  signed_distance.c - signed distance from a closed surface of triangles: exact near it, of the right sign everywhere.

  A grid of cubes around the surface, of edge c and half diagonal h = sqrt(3)/2 c, is filled once. For a cell whose centre is not farther
  than BAND c from the surface, the *band*, it lists all triangles that can be nearest to a point of the cell: with d the
  distance of the centre, a point in the cell is at most d + h away from the surface, so these are the triangles at most d + 2 h from the
  centre. A distance then is that of the nearest one of some forty triangles, most of which a ball around each rules out
  once the first is known. The sign is that of the angle-weighted pseudonormal at the nearest point (Baerentzen and Aanaes, IEEE
  TVCG 11(3), 2005). So within (BAND - sqrt(3)/2) c of the surface distance and normal are those of the triangles to rounding.

  Why not interpolate distances that are sampled on the grid? A trilinear distance has jumps of its gradient at all faces of the cells, and
  rounds edges off within a cell; contact takes its normals from it, and would push along directions that the obstacle
  does not have. The exact query costs about half a microsecond more and needs no finer grid than the triangles are.

  Elsewhere a cell has its sign and one triangle: that nearest to its centre as far as sweeps over the grid find it (neighbours hand on
  theirs, as in the vector distance transform of Danielsson 1980). The distance from that triangle is not smaller than the true one
  and less than 2 h larger, but for a rare miss of the sweeps; its direction leads to the surface. That is
  enough to rule contact out, and to bring out what lies deep inside. Points beyond the grid take the nearest cell's triangle.

  The sign of a cell out of the band is that of its neighbours: between their centres there is no surface.
*/
#include "detect.h"
#include "signed_distance.h"

#define BAND 2.    /* cells: how far the exact band reaches from the surface */
#define USUAL 1e6  /* cells: a default cell size makes no more */
#define TOUCH 1e-6 /* cells: nearer than this to an edge or corner the pseudonormal is the direction */
#define ROUND 1e-9 /* of the lengths that decide which triangles a cell lists */

struct _p_SbShell {
  SbTriangles t;
  PetscReal *normal; /* [ntri][3] of the faces */
  PetscReal *corner; /* [nvert][3] weighted by angles */
  PetscReal *ball;   /* [ntri][4] centroid and radius of what holds a triangle */
  PetscReal lo[3], cell;
  PetscInt n[3], ncell;
  PetscInt *start, *item; /* [ncell + 1], [start[ncell]] triangles of a cell */
  int8_t *side;           /* [ncell] out of the band: 1 outside, -1 inside; 0 in the band */
};

/* What is known of the cells while the grid is filled. */
typedef struct {
  PetscReal *d;      /* [ncell] distance of the centre, m */
  PetscInt *nearest; /* [ncell] triangle, -1: none yet */
  PetscInt npair, size;
  PetscInt (*pair)[2]; /* [npair] cell, triangle */
} Filling;

/* ------------------------------------------------------------------ triangles */

static inline void corners(SbSignedDistance s, PetscInt f, const PetscReal *c[3])
{
  for (int k = 0; k < 3; k++) c[k] = s->t.x + 3 * s->t.tri[3 * f + k];
}

static inline PetscReal height(SbSignedDistance s, PetscInt f, const PetscReal x[3])
{
  const PetscReal *a = s->t.x + 3 * s->t.tri[3 * f], r[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};

  return SbDot3(s->normal + 3 * f, r);
}

/* Whether a triangle may be nearer than r, by its ball. */
static inline PetscBool may_reach(SbSignedDistance s, PetscInt f, const PetscReal x[3], PetscReal r)
{
  const PetscReal *b = s->ball + 4 * f, away[3] = {x[0] - b[0], x[1] - b[1], x[2] - b[2]}, most = r + b[3];

  return (PetscBool)(SbDot3(away, away) <= most * most);
}

static PetscReal angle(const PetscReal *const x[3], int k)
{
  PetscReal a[3], b[3], c[3];

  for (int i = 0; i < 3; i++) {
    a[i] = x[(k + 1) % 3][i] - x[k][i];
    b[i] = x[(k + 2) % 3][i] - x[k][i];
  }
  SbCross(a, b, c);
  return atan2(PetscSqrtReal(SbDot3(c, c)), SbDot3(a, b));
}

static PetscErrorCode find_normals(SbSignedDistance s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * (size_t)s->t.ntri, &s->normal));
  PetscCall(PetscCalloc1(3 * (size_t)s->t.nvert, &s->corner));
  PetscCall(PetscMalloc1(4 * (size_t)s->t.ntri, &s->ball));
  for (PetscInt f = 0; f < s->t.ntri; f++) {
    const PetscReal *x[3];
    PetscReal a[3], b[3], *n = s->normal + 3 * f, *ball = s->ball + 4 * f, length;

    corners(s, f, x);
    for (int i = 0; i < 3; i++) {
      a[i] = x[1][i] - x[0][i];
      b[i] = x[2][i] - x[0][i];
    }
    SbCross(a, b, n);
    length = PetscSqrtReal(SbDot3(n, n));
    for (int i = 0; i < 3; i++) n[i] /= length;
    for (int k = 0; k < 3; k++) {
      const PetscReal w = angle(x, k);

      for (int i = 0; i < 3; i++) s->corner[3 * s->t.tri[3 * f + k] + i] += w * n[i];
    }
    for (int i = 0; i < 3; i++) ball[i] = (x[0][i] + x[1][i] + x[2][i]) / 3;
    ball[3] = 0;
    for (int k = 0; k < 3; k++) {
      const PetscReal r[3] = {x[k][0] - ball[0], x[k][1] - ball[1], x[k][2] - ball[2]};

      ball[3] = PetscMax(ball[3], PetscSqrtReal(SbDot3(r, r)) * (1 + ROUND));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of the normals around a place of a triangle; its sign against a direction is the side, its length means nothing. */
static void pseudonormal(SbSignedDistance s, PetscInt f, SbTriangleFeature place, PetscReal n[3])
{
  const PetscReal *face = s->normal + 3 * f;

  for (int i = 0; i < 3; i++) {
    if (place == SB_FEATURE_FACE)
      n[i] = face[i];
    else if (place >= SB_FEATURE_EDGE_0)
      n[i] = face[i] + s->normal[3 * s->t.across[3 * f + (place - SB_FEATURE_EDGE_0)] + i];
    else
      n[i] = s->corner[3 * s->t.tri[3 * f + place] + i];
  }
}

/* ------------------------------------------------------------------ the grid */

static inline void centre_of(SbSignedDistance s, PetscInt i, PetscInt j, PetscInt k, PetscReal x[3])
{
  x[0] = s->lo[0] + ((PetscReal)i + 0.5) * s->cell;
  x[1] = s->lo[1] + ((PetscReal)j + 0.5) * s->cell;
  x[2] = s->lo[2] + ((PetscReal)k + 0.5) * s->cell;
}

static inline PetscInt cell_at(SbSignedDistance s, PetscInt i, PetscInt j, PetscInt k)
{
  return (k * s->n[1] + j) * s->n[0] + i;
}

/* Cells that a box of this size takes, with a margin on all sides that lies out of the band. */
static PetscReal count_cells(const PetscReal size[3], PetscReal cell, PetscReal n[3])
{
  for (int i = 0; i < 3; i++) n[i] = PetscCeilReal(size[i] / cell) + 2 * (BAND + 1);
  return n[0] * n[1] * n[2];
}

static PetscErrorCode lay_grid(SbSignedDistance s, const char *option, PetscReal cell)
{
  PetscReal lo[3], hi[3], size[3], n[3], most = 0;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) {
    lo[i] = PETSC_MAX_REAL;
    hi[i] = -PETSC_MAX_REAL;
    for (PetscInt v = 0; v < s->t.nvert; v++) {
      lo[i] = PetscMin(lo[i], s->t.x[3 * v + i]);
      hi[i] = PetscMax(hi[i], s->t.x[3 * v + i]);
    }
    size[i] = hi[i] - lo[i];
    most = PetscMax(most, size[i]);
  }
  if (cell > 0) {
    PetscReal least = cell;

    while (count_cells(size, least, n) > SB_SIGNED_DISTANCE_CELLS) least *= 1.1;
    PetscCheck(
      least == cell, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
      "%s: cells of %g m around an obstacle of %g x %g x %g m are more than %d: give cells of %.2g m or "
      "more, or none",
      option, (double)cell, (double)size[0], (double)size[1], (double)size[2], SB_SIGNED_DISTANCE_CELLS,
      (double)(1.05 * least));
  } else
    for (cell = PetscMin(s->t.edge, most); count_cells(size, cell, n) > USUAL;) cell *= 1.1;
  (void)count_cells(size, cell, n);
  s->cell = cell;
  for (int i = 0; i < 3; i++) {
    s->n[i] = (PetscInt)n[i];
    s->lo[i] = 0.5 * (lo[i] + hi[i] - n[i] * cell);
  }
  s->ncell = s->n[0] * s->n[1] * s->n[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells whose centre may be nearer than r to the triangle f: first and last along each axis. */
static void cells_around(SbSignedDistance s, PetscInt f, PetscReal r, PetscInt first[3], PetscInt last[3])
{
  const PetscReal *x[3];

  corners(s, f, x);
  for (int i = 0; i < 3; i++) {
    const PetscReal lo = PetscMin(PetscMin(x[0][i], x[1][i]), x[2][i]);
    const PetscReal hi = PetscMax(PetscMax(x[0][i], x[1][i]), x[2][i]);

    first[i] = PetscMax(0, (PetscInt)PetscCeilReal((lo - r - s->lo[i]) / s->cell - 0.5));
    last[i] = PetscMin(s->n[i] - 1, (PetscInt)PetscFloorReal((hi + r - s->lo[i]) / s->cell - 0.5));
  }
}

static PetscErrorCode add_pair(Filling *g, PetscInt cell, PetscInt f)
{
  PetscFunctionBeginUser;
  if (g->npair == g->size) {
    g->size = PetscMax(1024, 2 * g->size);
    PetscCall(PetscRealloc((size_t)g->size * sizeof(*g->pair), &g->pair));
  }
  g->pair[g->npair][0] = cell;
  g->pair[g->npair++][1] = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  One pass over the triangles and the cells around them. Without `list`: nearest triangle and distance of each centre up to the radius. With it:
  the pairs of a cell in the band and a triangle that can be nearest in it.
*/
static PetscErrorCode visit(SbSignedDistance s, Filling *g, PetscBool list)
{
  const PetscReal twice = PetscSqrtReal(3.) * s->cell, band = BAND * s->cell, r = band + twice;

  PetscFunctionBeginUser;
  for (PetscInt f = 0; f < s->t.ntri; f++) {
    const PetscReal *x[3];
    PetscInt a[3], b[3];

    corners(s, f, x);
    cells_around(s, f, r, a, b);
    for (PetscInt k = a[2]; k <= b[2]; k++) {
      for (PetscInt j = a[1]; j <= b[1]; j++) {
        for (PetscInt i = a[0]; i <= b[0]; i++) {
          const PetscInt c = cell_at(s, i, j, k);
          const PetscReal most = list ? (g->d[c] + twice) * (1 + ROUND) : g->d[c];
          PetscReal p[3], w[3], d2;

          centre_of(s, i, j, k, p);
          if ((list && g->d[c] > band) || !may_reach(s, f, p, most)) continue;
          (void)SbTriangleClosestPoint(p, x, w, &d2);
          if (d2 > most * most) continue;
          if (list)
            PetscCall(add_pair(g, c, f));
          else if (d2 < most * most || g->nearest[c] < 0) {
            g->d[c] = PetscSqrtReal(d2);
            g->nearest[c] = f;
          }
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distance and sign of the centre of a cell from one triangle. */
static PetscReal from_one(SbSignedDistance s, PetscInt f, const PetscReal p[3], PetscBool *inside)
{
  const PetscReal *x[3];
  PetscReal w[3], n[3], r[3], d2;
  SbTriangleFeature place;

  corners(s, f, x);
  place = SbTriangleClosestPoint(p, x, w, &d2);
  pseudonormal(s, f, place, n);
  for (int i = 0; i < 3; i++) r[i] = p[i] - w[0] * x[0][i] - w[1] * x[1][i] - w[2] * x[2][i];
  *inside = (PetscBool)(SbDot3(n, r) < 0);
  return PetscSqrtReal(d2);
}

/* A cell out of reach takes triangle and sign from a neighbour, if that is nearer than what it has. */
static inline void take_from(SbSignedDistance s, Filling *g, PetscInt c, PetscInt from, const PetscReal p[3])
{
  const PetscInt f = g->nearest[from];
  const PetscReal *x[3];
  PetscReal w[3], d2;

  if (f < 0) return;
  if (!s->side[c]) s->side[c] = s->side[from];
  if (f == g->nearest[c]) return;
  corners(s, f, x);
  (void)SbTriangleClosestPoint(p, x, w, &d2);
  if (d2 >= g->d[c] * g->d[c]) return;
  g->d[c] = PetscSqrtReal(d2);
  g->nearest[c] = f;
}

/* Eight sweeps, one from each corner of the grid, twice: each cell examines the three before it. reached: it is not to be changed. */
static void sweep(SbSignedDistance s, Filling *g, const int8_t reached[])
{
  for (int way = 0; way < 16; way++) {
    const PetscInt dir[3] = {way & 1 ? -1 : 1, way & 2 ? -1 : 1, way & 4 ? -1 : 1};

    for (PetscInt kk = 0; kk < s->n[2]; kk++) {
      for (PetscInt jj = 0; jj < s->n[1]; jj++) {
        for (PetscInt ii = 0; ii < s->n[0]; ii++) {
          const PetscInt i = dir[0] > 0 ? ii : s->n[0] - 1 - ii, j = dir[1] > 0 ? jj : s->n[1] - 1 - jj,
                         k = dir[2] > 0 ? kk : s->n[2] - 1 - kk, c = cell_at(s, i, j, k);
          PetscReal p[3];

          if (reached[c]) continue;
          centre_of(s, i, j, k, p);
          if (ii) take_from(s, g, c, cell_at(s, i - dir[0], j, k), p);
          if (jj) take_from(s, g, c, cell_at(s, i, j - dir[1], k), p);
          if (kk) take_from(s, g, c, cell_at(s, i, j, k - dir[2]), p);
        }
      }
    }
  }
}

/* Signs where the nearest triangle is known, then both for the rest. In the band the sign is not kept. */
static PetscErrorCode spread(SbSignedDistance s, Filling *g)
{
  int8_t *reached;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(s->ncell, &reached));
  for (PetscInt k = 0; k < s->n[2]; k++) {
    for (PetscInt j = 0; j < s->n[1]; j++) {
      for (PetscInt i = 0; i < s->n[0]; i++) {
        const PetscInt c = cell_at(s, i, j, k);
        PetscReal p[3];
        PetscBool inside;

        if (g->nearest[c] < 0) continue;
        centre_of(s, i, j, k, p);
        (void)from_one(s, g->nearest[c], p, &inside);
        s->side[c] = inside ? -1 : 1;
        reached[c] = 1;
      }
    }
  }
  sweep(s, g, reached);
  PetscCall(PetscFree(reached));
  for (PetscInt c = 0; c < s->ncell; c++) {
    if (g->d[c] <= BAND * s->cell) s->side[c] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pairs sorted by cell; cells out of the band have their one triangle. */
static PetscErrorCode make_lists(SbSignedDistance s, const Filling *g)
{
  PetscInt64 total = 0;
  PetscInt *next;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(s->ncell + 1, &s->start));
  for (PetscInt c = 0; c < s->ncell; c++) s->start[c + 1] = s->side[c] ? 1 : 0;
  for (PetscInt p = 0; p < g->npair; p++) s->start[g->pair[p][0] + 1]++;
  for (PetscInt c = 0; c < s->ncell; c++) {
    total += s->start[c + 1];
    s->start[c + 1] += s->start[c];
  }
  PetscCheck(total < PETSC_MAX_INT, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "%" PetscInt64_FMT " entries in the grid of an obstacle", total);
  PetscCall(PetscMalloc1(total, &s->item));
  for (PetscInt c = 0; c < s->ncell; c++) {
    if (s->side[c]) s->item[s->start[c]] = g->nearest[c];
  }
  PetscCall(PetscMalloc1(s->ncell, &next));
  PetscCall(PetscArraycpy(next, s->start, s->ncell));
  for (PetscInt p = 0; p < g->npair; p++) {
    const PetscInt c = g->pair[p][0], first = s->start[c], at = next[c]++;

    s->item[at] = g->pair[p][1];
    /* what is nearest to the centre comes first: a good guess rules out the rest */
    if (g->pair[p][1] == g->nearest[c]) {
      s->item[at] = s->item[first];
      s->item[first] = g->pair[p][1];
    }
  }
  PetscCall(PetscFree(next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fill(SbSignedDistance s)
{
  const PetscReal reach = (BAND + PetscSqrtReal(3.)) * s->cell;
  Filling g = {0};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->ncell, &g.d));
  PetscCall(PetscMalloc1(s->ncell, &g.nearest));
  PetscCall(PetscCalloc1(s->ncell, &s->side));
  for (PetscInt c = 0; c < s->ncell; c++) {
    g.d[c] = reach;
    g.nearest[c] = -1;
  }
  PetscCall(visit(s, &g, PETSC_FALSE));
  PetscCall(visit(s, &g, PETSC_TRUE));
  for (PetscInt c = 0; c < s->ncell; c++) {
    if (g.nearest[c] < 0) g.d[c] = PETSC_MAX_REAL;
  }
  PetscCall(spread(s, &g));
  PetscCall(make_lists(s, &g));
  PetscCall(PetscFree(g.d));
  PetscCall(PetscFree(g.nearest));
  PetscCall(PetscFree(g.pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSignedDistanceCreate(const char *option, SbTriangles *triangles, PetscReal cell,
                                      SbSignedDistance *shell)
{
  SbSignedDistance s;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  *shell = s;
  s->t = *triangles;
  PetscCall(PetscMemzero(triangles, sizeof(*triangles)));
  PetscCall(lay_grid(s, option, cell));
  PetscCall(find_normals(s));
  PetscCall(fill(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSignedDistanceDestroy(SbSignedDistance *shell)
{
  SbSignedDistance s = *shell;

  PetscFunctionBeginUser;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbTrianglesDestroy(&s->t));
  PetscCall(PetscFree(s->normal));
  PetscCall(PetscFree(s->corner));
  PetscCall(PetscFree(s->ball));
  PetscCall(PetscFree(s->start));
  PetscCall(PetscFree(s->item));
  PetscCall(PetscFree(s->side));
  PetscCall(PetscFree(*shell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSignedDistanceGetSize(SbSignedDistance s, PetscInt cells[3], PetscReal *cell, PetscInt64 *bytes,
                             PetscInt *ntri)
{
  for (int i = 0; i < 3; i++) cells[i] = s->n[i];
  *cell = s->cell;
  *ntri = s->t.ntri;
  *bytes = (PetscInt64)(6 * (size_t)s->t.nvert * sizeof(PetscReal) +
                        (size_t)s->t.ntri * (7 * sizeof(PetscReal) + 6 * sizeof(PetscInt)) +
                        (size_t)(s->ncell + 1 + s->start[s->ncell]) * sizeof(PetscInt) + (size_t)s->ncell);
}

/* ------------------------------------------------------------------ queries */

/* The cell of a point; beyond the grid, the nearest. */
static inline PetscInt find_cell(SbSignedDistance s, const PetscReal x[3])
{
  PetscInt at[3];

  for (int i = 0; i < 3; i++) {
    const PetscReal place = (x[i] - s->lo[i]) / s->cell;

    at[i] = place > 0 ? (place < (PetscReal)s->n[i] ? (PetscInt)place : s->n[i] - 1) : 0;
  }
  return cell_at(s, at[0], at[1], at[2]);
}

PetscReal SbSignedDistanceEvaluate(SbSignedDistance s, const PetscReal x[3], PetscReal n[3])
{
  const PetscInt c = find_cell(s, x);
  PetscReal best = PETSC_MAX_REAL, root = PETSC_MAX_REAL, d, r[3] = {0}, pseudo[3], length, sign;
  PetscInt nearest = s->item[s->start[c]];
  SbTriangleFeature where = SB_FEATURE_FACE;

  for (PetscInt q = s->start[c]; q < s->start[c + 1]; q++) {
    const PetscInt f = s->item[q];
    const PetscReal *p[3];
    PetscReal w[3], d2;
    SbTriangleFeature place;

    if (q > s->start[c] && !may_reach(s, f, x, root)) continue;
    corners(s, f, p);
    place = SbTriangleClosestPoint(x, p, w, &d2);
    if (d2 >= best) continue;
    best = d2;
    root = PetscSqrtReal(d2);
    nearest = f;
    where = place;
    for (int i = 0; i < 3; i++)
      r[i] = w[0] * (x[i] - p[0][i]) + w[1] * (x[i] - p[1][i]) + w[2] * (x[i] - p[2][i]);
  }
  if (!s->side[c] && where == SB_FEATURE_FACE) { /* smooth through the surface */
    for (int i = 0; i < 3; i++) n[i] = s->normal[3 * nearest + i];
    return height(s, nearest, x);
  }
  d = PetscSqrtReal(SbDot3(r, r));
  pseudonormal(s, nearest, where, pseudo);
  sign = s->side[c] ? (PetscReal)s->side[c] : SbDot3(pseudo, r) < 0 ? -1 : 1;
  if (d > TOUCH * s->cell) {
    for (int i = 0; i < 3; i++) n[i] = sign * r[i] / d;
    return sign * d;
  }
  length = PetscSqrtReal(SbDot3(pseudo, pseudo));
  for (int i = 0; i < 3; i++) n[i] = length > 0 ? pseudo[i] / length : s->normal[3 * nearest + i];
  return sign * d;
}
