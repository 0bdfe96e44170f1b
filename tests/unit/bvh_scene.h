/*
  bvh_scene.h - scenes for tests of contact detection: a container that owns its arrays, and bodies to put into it.
*/
#pragma once
#include "../../src/contact/edge.h"
#include "test.h"
#include <sbdetect.h>
#include <sbkernel.h>

/* Numbers in -1..1 that are the same everywhere. */
static inline PetscReal number(unsigned *state)
{
  *state = *state * 1664525u + 1013904223u;
  return (PetscReal)(*state >> 8) / (1 << 23) - 1;
}

static inline PetscInt below(unsigned *state, PetscInt n)
{
  return PetscMin(n - 1, (PetscInt)((number(state) + 1) / 2 * (PetscReal)n));
}

/* A scene that owns its arrays. Corners are vertices (P1), or apart by facet (DG); points are the vertices and centroids of some facets. */
typedef struct {
  SbDetectScene s;
  PetscInt nvertex, nfacet;
  PetscReal *X, *x, *x0, *P, *p, *p0, *normal;
  PetscInt *facet, *vertex, *part, *id, *point_part, *point_id, *point_vertex, *point_facet;
  SbEdges edges;
} Scene;

enum { MOST_FACETS = 70000, MOST_POINTS = 140000 };

static inline PetscErrorCode scene_create(Scene *c)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(c, sizeof(*c)));
  PetscCall(PetscMalloc7(9 * MOST_FACETS, &c->X, 9 * MOST_FACETS, &c->x, 9 * MOST_FACETS, &c->x0,
                         3 * MOST_POINTS, &c->P, 3 * MOST_POINTS, &c->p, 3 * MOST_POINTS, &c->p0,
                         3 * MOST_POINTS, &c->normal));
  PetscCall(PetscMalloc4(3 * MOST_FACETS, &c->facet, 3 * MOST_FACETS, &c->vertex, MOST_FACETS, &c->part,
                         MOST_FACETS, &c->id));
  PetscCall(PetscMalloc4(MOST_POINTS, &c->point_part, MOST_POINTS, &c->point_id, MOST_POINTS,
                         &c->point_vertex, MOST_POINTS, &c->point_facet));
  c->s = (SbDetectScene){.x = c->x,
                         .X = c->X,
                         .facet = c->facet,
                         .facet_vertex = c->vertex,
                         .facet_part = c->part,
                         .facet_id = c->id,
                         .p = c->p,
                         .P = c->P,
                         .p_normal = c->normal,
                         .point_part = c->point_part,
                         .point_id = c->point_id,
                         .point_vertex = c->point_vertex,
                         .point_facet = c->point_facet};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode scene_destroy(Scene *c)
{
  PetscFunctionBeginUser;
  PetscCall(SbEdgesDestroy(&c->edges));
  PetscCall(PetscFree7(c->X, c->x, c->x0, c->P, c->p, c->p0, c->normal));
  PetscCall(PetscFree4(c->facet, c->vertex, c->part, c->id));
  PetscCall(PetscFree4(c->point_part, c->point_id, c->point_vertex, c->point_facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline void scene_clear(Scene *c)
{
  c->s.ncorner = c->s.nfacet = c->s.npoint = c->nvertex = c->nfacet = 0;
  c->s.self = PETSC_FALSE;
  c->s.x0 = c->s.p0 = NULL;
  c->s.version++;
}

static inline PetscInt add_vertex(Scene *c, PetscReal x, PetscReal y, PetscReal z)
{
  const PetscInt v = c->s.ncorner++;
  const PetscReal at[3] = {x, y, z};

  for (int i = 0; i < 3; i++) c->X[3 * v + i] = c->x[3 * v + i] = c->x0[3 * v + i] = at[i];
  return v;
}

static inline void add_facet(Scene *c, PetscInt part, PetscInt a, PetscInt b, PetscInt d)
{
  const PetscInt f = c->s.nfacet++, v[3] = {a, b, d};

  for (int k = 0; k < 3; k++) c->facet[3 * f + k] = c->vertex[3 * f + k] = v[k];
  c->part[f] = part;
  c->id[f] = f;
}

static inline void add_point(Scene *c, PetscInt part, PetscInt vertex, PetscInt facet)
{
  const PetscInt p = c->s.npoint++;

  c->point_part[p] = part;
  c->point_id[p] = p;
  c->point_vertex[p] = vertex;
  c->point_facet[p] = facet;
}

/* Where the points are, from their vertex or facet; the normal is the sum of the facets' there. */
static inline void place_points(Scene *c)
{
  for (PetscInt p = 0; p < c->s.npoint; p++) {
    const PetscInt v = c->point_vertex[p], *f = c->facet + 3 * c->point_facet[p];

    for (int i = 0; i < 3; i++) {
      c->P[3 * p + i] =
        v >= 0 ? c->X[3 * v + i] : (c->X[3 * f[0] + i] + c->X[3 * f[1] + i] + c->X[3 * f[2] + i]) / 3;
      c->p[3 * p + i] =
        v >= 0 ? c->x[3 * v + i] : (c->x[3 * f[0] + i] + c->x[3 * f[1] + i] + c->x[3 * f[2] + i]) / 3;
      c->p0[3 * p + i] =
        v >= 0 ? c->x0[3 * v + i] : (c->x0[3 * f[0] + i] + c->x0[3 * f[1] + i] + c->x0[3 * f[2] + i]) / 3;
      c->normal[3 * p + i] = 0;
    }
  }
}

static inline void facet_normal(const Scene *c, PetscInt f, PetscReal n[3])
{
  const PetscInt *v = c->facet + 3 * f;
  PetscReal a[3], b[3];

  for (int i = 0; i < 3; i++) {
    a[i] = c->x[3 * v[1] + i] - c->x[3 * v[0] + i];
    b[i] = c->x[3 * v[2] + i] - c->x[3 * v[0] + i];
  }
  SbCross(a, b, n);
}

/* point_of[vertex]: its point, -1: none */
static inline PetscErrorCode scene_finish(Scene *c)
{
  PetscInt *point_of;
  PetscReal n[3];

  PetscFunctionBeginUser;
  place_points(c);
  PetscCall(PetscMalloc1(c->s.ncorner, &point_of));
  for (PetscInt v = 0; v < c->s.ncorner; v++) point_of[v] = -1;
  for (PetscInt p = 0; p < c->s.npoint; p++) {
    if (c->point_vertex[p] >= 0)
      point_of[c->point_vertex[p]] = p;
    else {
      facet_normal(c, c->point_facet[p], n);
      for (int i = 0; i < 3; i++) c->normal[3 * p + i] = n[i];
    }
  }
  for (PetscInt f = 0; f < c->s.nfacet; f++) {
    facet_normal(c, f, n);
    for (int k = 0; k < 3; k++) {
      const PetscInt p = point_of[c->vertex[3 * f + k]];

      for (int i = 0; i < 3 && p >= 0; i++) c->normal[3 * p + i] += n[i];
    }
  }
  for (PetscInt p = 0; p < c->s.npoint; p++) {
    PetscReal *m = c->normal + 3 * p;
    const PetscReal length = PetscSqrtReal(SbDot3(m, m));

    for (int i = 0; i < 3; i++) m[i] = length > 0 ? m[i] / length : (i == 2);
  }
  PetscCall(PetscFree(point_of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points at the vertices from v0 on and, some of them, at centroids of the facets from f0 on. */
static inline void add_points(Scene *c, PetscInt part, PetscInt v0, PetscInt f0, PetscInt every)
{
  for (PetscInt v = v0; v < c->s.ncorner; v++) add_point(c, part, v, -1);
  for (PetscInt f = f0; every && f < c->s.nfacet; f += every) add_point(c, part, -1, f);
}

/* ------------------------------------------------------------------ bodies */

/* Sphere of unit radius: an octahedron whose n x n grids on the eight faces are pushed outwards. Vertices by their place are one. */
static inline void add_sphere(Scene *c, PetscInt part, PetscInt n)
{
  const PetscInt v0 = c->s.ncorner;

  for (PetscInt face = 0; face < 8; face++) {
    const PetscInt sx = face & 1 ? -1 : 1, sy = face & 2 ? -1 : 1, sz = face & 4 ? -1 : 1;
    PetscInt grid[33][33];

    for (PetscInt i = 0; i <= n; i++) {
      for (PetscInt j = 0; j <= n - i; j++) {
        const PetscReal at[3] = {(PetscReal)(sx * i), (PetscReal)(sy * j), (PetscReal)(sz * (n - i - j))};
        const PetscReal length = PetscSqrtReal(SbDot3(at, at));
        PetscInt v = v0;

        for (; v < c->s.ncorner; v++) {
          if (PetscAbsReal(c->X[3 * v] - at[0] / length) + PetscAbsReal(c->X[3 * v + 1] - at[1] / length) +
                PetscAbsReal(c->X[3 * v + 2] - at[2] / length) <
              1e-9)
            break;
        }
        if (v == c->s.ncorner) (void)add_vertex(c, at[0] / length, at[1] / length, at[2] / length);
        grid[i][j] = v;
      }
    }
    for (PetscInt i = 0; i < n; i++) {
      for (PetscInt j = 0; j < n - i; j++) {
        const PetscInt a = grid[i][j], b = grid[i + 1][j], d = grid[i][j + 1];

        if (sx * sy * sz > 0)
          add_facet(c, part, a, b, d);
        else
          add_facet(c, part, a, d, b);
        if (i + j + 2 > n) continue;
        if (sx * sy * sz > 0)
          add_facet(c, part, b, grid[i + 1][j + 1], d);
        else
          add_facet(c, part, b, d, grid[i + 1][j + 1]);
      }
    }
  }
}

static inline void add_box(Scene *c, PetscInt part)
{
  static const int quad[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                 {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const PetscInt v0 = c->s.ncorner;

  for (int v = 0; v < 8; v++) (void)add_vertex(c, (v & 1) - 0.5, (v >> 1 & 1) - 0.5, (v >> 2) - 0.5);
  for (int q = 0; q < 6; q++) {
    add_facet(c, part, v0 + quad[q][0], v0 + quad[q][1], v0 + quad[q][2]);
    add_facet(c, part, v0 + quad[q][0], v0 + quad[q][2], v0 + quad[q][3]);
  }
}

/* Triangles at random, some without area, some joined to earlier ones, also three at one edge. */
static inline void add_soup(Scene *c, PetscInt part, PetscInt n, unsigned *state)
{
  const PetscInt v0 = c->s.ncorner;

  for (PetscInt f = 0; f < n; f++) {
    PetscInt v[3];

    for (int k = 0; k < 3; k++) {
      if (f && below(state, 2))
        v[k] = v0 + below(state, c->s.ncorner - v0);
      else
        v[k] = add_vertex(c, number(state), number(state), number(state));
    }
    if (!below(state, 10)) v[2] = v[1];
    if (!below(state, 10)) {
      for (int i = 0; i < 3; i++)
        c->X[3 * v[2] + i] = c->x[3 * v[2] + i] = c->x0[3 * v[2] + i] = c->x[3 * v[0] + i];
    }
    add_facet(c, part, v[0], v[1], v[2]);
  }
}

/* A sheet of n x n squares over the unit square, bent by place(). */
static inline void add_sheet(Scene *c, PetscInt part, PetscInt n, PetscBool down,
                             void (*place)(PetscReal, PetscReal, PetscReal[3]))
{
  const PetscInt v0 = c->s.ncorner;

  for (PetscInt j = 0; j <= n; j++) {
    for (PetscInt i = 0; i <= n; i++) {
      PetscReal x[3];

      place((PetscReal)i / (PetscReal)n, (PetscReal)j / (PetscReal)n, x);
      (void)add_vertex(c, x[0], x[1], x[2]);
    }
  }
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++) {
      const PetscInt a = v0 + j * (n + 1) + i, b = a + 1, d = a + n + 1, e = d + 1;

      if (down) {
        add_facet(c, part, a, e, b);
        add_facet(c, part, a, d, e);
      } else {
        add_facet(c, part, a, b, e);
        add_facet(c, part, a, e, d);
      }
    }
  }
}

/* Scales, turns and shifts the vertices from v0 on; with motion, they come from somewhere else, each a little differently. */
static inline void move(Scene *c, PetscInt v0, PetscReal size, PetscReal far, PetscReal speed,
                        unsigned *state)
{
  PetscReal axis[3], shift[3], velocity[3], length, angle = PETSC_PI * number(state);

  for (int i = 0; i < 3; i++) {
    axis[i] = number(state) + (i == 2) * 0.01;
    shift[i] = far * number(state);
    velocity[i] = speed * number(state);
  }
  length = PetscSqrtReal(SbDot3(axis, axis));
  for (PetscInt v = v0; v < c->s.ncorner; v++) {
    PetscReal *x = c->x + 3 * v, cross[3], y[3], dot;

    for (int i = 0; i < 3; i++) y[i] = axis[i] / length;
    dot = SbDot3(y, x);
    SbCross(y, x, cross);
    for (int i = 0; i < 3; i++) {
      y[i] =
        x[i] * PetscCosReal(angle) + cross[i] * PetscSinReal(angle) + y[i] * dot * (1 - PetscCosReal(angle));
    }
    for (int i = 0; i < 3; i++) {
      x[i] = size * y[i] + shift[i];
      c->X[3 * v + i] = x[i];
      c->x0[3 * v + i] = x[i] - velocity[i] - 0.1 * speed * number(state);
    }
  }
}
