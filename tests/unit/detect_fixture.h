/*
  detect_fixture.h - worlds of triangulated bodies for the tests of contact detection: boxes, spheres, where they are now and were.
*/
#pragma once
#include <sbcontact.h>
#include <sbdetect.h>
#include <test.h>
#include "../../src/contact/edge.h"

#define WORLD_MAX 20000 /* most vertices, and facets */

/* Bodies as vertices and facets; the arrays of the scene are made from them by world_scene(). */
typedef struct {
  PetscInt nvertex, nfacet, npart;
  PetscReal (*X)[3], (*x)[3], (*x0)[3]; /* [nvertex] at rest, now, at the start of the step */
  PetscInt *vertex_part;
  PetscInt (*facet)[3], *facet_part;
  /* owned by the world, borrowed by the scene */
  PetscReal *corner[3], *point[3], *normal;
  PetscInt *corners, *corner_vertex, *part, *facet_id, *point_part, *point_id, *point_vertex, *point_facet;
  SbEdges edges;
  SbDetectScene scene;
} World;

/* Numbers in -1..1 that are the same everywhere. */
static inline PetscReal number(unsigned *state)
{
  *state = *state * 1664525u + 1013904223u;
  return (PetscReal)(*state >> 8) / (1 << 23) - 1;
}

/* One of 0..n-1. */
static inline PetscInt choice(unsigned *state, PetscInt n)
{
  *state = *state * 1664525u + 1013904223u;
  return (PetscInt)((*state >> 8) % (unsigned)n);
}

static inline PetscErrorCode world_create(World *w)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(w, sizeof(*w)));
  PetscCall(PetscMalloc6(WORLD_MAX, &w->X, WORLD_MAX, &w->x, WORLD_MAX, &w->x0, WORLD_MAX, &w->vertex_part,
                         WORLD_MAX, &w->facet, WORLD_MAX, &w->facet_part));
  for (int i = 0; i < 3; i++) {
    PetscCall(PetscMalloc1(9 * WORLD_MAX, &w->corner[i]));
    PetscCall(PetscMalloc1(3 * WORLD_MAX, &w->point[i]));
  }
  PetscCall(PetscMalloc1(3 * WORLD_MAX, &w->normal));
  PetscCall(PetscMalloc4(3 * WORLD_MAX, &w->corners, 3 * WORLD_MAX, &w->corner_vertex, WORLD_MAX, &w->part,
                         WORLD_MAX, &w->facet_id));
  PetscCall(PetscMalloc4(WORLD_MAX, &w->point_part, WORLD_MAX, &w->point_id, WORLD_MAX, &w->point_vertex,
                         WORLD_MAX, &w->point_facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode world_destroy(World *w)
{
  PetscFunctionBeginUser;
  PetscCall(SbEdgesDestroy(&w->edges));
  PetscCall(PetscFree6(w->X, w->x, w->x0, w->vertex_part, w->facet, w->facet_part));
  for (int i = 0; i < 3; i++) {
    PetscCall(PetscFree(w->corner[i]));
    PetscCall(PetscFree(w->point[i]));
  }
  PetscCall(PetscFree(w->normal));
  PetscCall(PetscFree4(w->corners, w->corner_vertex, w->part, w->facet_id));
  PetscCall(PetscFree4(w->point_part, w->point_id, w->point_vertex, w->point_facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A vertex of the last part; one that is there already is found again when `weld`. */
static inline PetscInt world_vertex(World *w, const PetscReal X[3], PetscInt first, PetscBool merge_tolerance)
{
  for (PetscInt i = first; merge_tolerance && i < w->nvertex; i++) {
    if (PetscMax(PetscAbsReal(w->X[i][0] - X[0]),
                 PetscMax(PetscAbsReal(w->X[i][1] - X[1]), PetscAbsReal(w->X[i][2] - X[2]))) < 1e-9)
      return i;
  }
  w->vertex_part[w->nvertex] = w->npart - 1;
  for (int k = 0; k < 3; k++) w->X[w->nvertex][k] = w->x[w->nvertex][k] = w->x0[w->nvertex][k] = X[k];
  return w->nvertex++;
}

static inline void world_facet(World *w, PetscInt a, PetscInt b, PetscInt c)
{
  w->facet_part[w->nfacet] = w->npart - 1;
  w->facet[w->nfacet][0] = a;
  w->facet[w->nfacet][1] = b;
  w->facet[w->nfacet++][2] = c;
}

/* A new part: the surface of the box -half..half, n[i] squares along axis i. Returns its first vertex. */
static inline PetscInt world_box(World *w, const PetscReal half[3], const PetscInt n[3])
{
  const PetscInt first = w->nvertex;

  w->npart++;
  for (int side = 0; side < 6; side++) {
    const int a = side / 2, b = (a + 1) % 3, c = (a + 2) % 3;

    for (PetscInt i = 0; i < n[b]; i++) {
      for (PetscInt j = 0; j < n[c]; j++) {
        PetscInt v[4];

        for (int k = 0; k < 4; k++) {
          PetscReal X[3];

          X[a] = side % 2 ? half[a] : -half[a];
          X[b] = half[b] * (2 * ((PetscReal)i + (k == 1 || k == 2)) / (PetscReal)n[b] - 1);
          X[c] = half[c] * (2 * ((PetscReal)j + (k >= 2)) / (PetscReal)n[c] - 1);
          v[k] = world_vertex(w, X, first, PETSC_TRUE);
        }
        world_facet(w, v[0], side % 2 ? v[1] : v[2], side % 2 ? v[2] : v[1]);
        world_facet(w, v[0], side % 2 ? v[2] : v[3], side % 2 ? v[3] : v[2]);
      }
    }
  }
  return first;
}

/* The vertex in the middle of an edge, on the unit sphere. */
static inline PetscInt world_middle(World *w, PetscInt first, PetscInt a, PetscInt b)
{
  PetscReal X[3], length;

  for (int k = 0; k < 3; k++) X[k] = w->X[a][k] + w->X[b][k];
  length = PetscSqrtReal(SbDot3(X, X));
  for (int k = 0; k < 3; k++) X[k] /= length;
  return world_vertex(w, X, first, PETSC_TRUE);
}

/* A new part: the unit sphere, an icosahedron whose 20 facets are cut into four `level` times. Returns its first vertex. */
static inline PetscInt world_sphere(World *w, PetscInt level)
{
  static const PetscInt top[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  const PetscReal g = (1 + PetscSqrtReal(5)) / 2, s = 1 / PetscSqrtReal(1 + g * g);
  const PetscInt first = w->nvertex, facets = w->nfacet;

  w->npart++;
  for (int i = 0; i < 12; i++) {
    const int a = i / 4; /* (-+1, +-g, 0), then the same with the axes moved on */
    PetscReal X[3];

    X[a] = i % 2 ? s : -s;
    X[(a + 1) % 3] = (i % 4 < 2 ? 1 : -1) * s * g;
    X[(a + 2) % 3] = 0;
    (void)world_vertex(w, X, first, PETSC_FALSE);
  }
  for (int i = 0; i < 20; i++) world_facet(w, first + top[i][0], first + top[i][1], first + top[i][2]);
  for (PetscInt l = 0; l < level; l++) {
    const PetscInt end = w->nfacet;

    for (PetscInt f = facets; f < end; f++) {
      const PetscInt a = w->facet[f][0], b = w->facet[f][1], c = w->facet[f][2];
      const PetscInt ab = world_middle(w, first, a, b), bc = world_middle(w, first, b, c),
                     ca = world_middle(w, first, c, a);

      world_facet(w, a, ab, ca);
      world_facet(w, b, bc, ab);
      world_facet(w, c, ca, bc);
      w->facet[f][0] = ab;
      w->facet[f][1] = bc;
      w->facet[f][2] = ca;
    }
  }
  return first;
}

/* x = centre + size R X of the vertices from `first` on, in all three states. */
static inline void world_place(World *w, PetscInt first, PetscReal size, const SbPose *pose)
{
  for (PetscInt i = first; i < w->nvertex; i++) {
    PetscReal y[3];

    for (int k = 0; k < 3; k++) y[k] = size * w->X[i][k];
    SbPoseApply(pose, y, w->X[i]);
    for (int k = 0; k < 3; k++) w->x[i][k] = w->x0[i][k] = w->X[i][k];
  }
}

/* Somewhere within `spread` of the origin, turned anyhow. */
static inline void random_pose(unsigned *state, PetscReal spread, SbPose *pose)
{
  const PetscReal none[3] = {0, 0, 0};
  PetscReal axis[3], d[3], length;

  for (int k = 0; k < 3; k++) axis[k] = number(state);
  length = PetscSqrtReal(SbDot3(axis, axis)) + 1e-30;
  for (int k = 0; k < 3; k++) axis[k] /= length;
  for (int k = 0; k < 3; k++) d[k] = spread * number(state);
  SbPoseSet(axis, PETSC_PI * number(state), none, d, pose);
}

/* Adds the facet's normal, weighted by its angles, at its corners, or by its area at itself. */
static inline void add_normal(const World *w, PetscInt f, PetscBool vertices, PetscReal n[])
{
  for (int k = 0; k < 3; k++) {
    const PetscInt v = w->facet[f][k];
    PetscReal a[3], b[3], c[3], area, *to = n + 3 * (vertices ? v : f);

    for (int i = 0; i < 3; i++) {
      a[i] = w->x[w->facet[f][(k + 1) % 3]][i] - w->x[v][i];
      b[i] = w->x[w->facet[f][(k + 2) % 3]][i] - w->x[v][i];
    }
    SbCross(a, b, c);
    area = PetscSqrtReal(SbDot3(c, c));
    for (int i = 0; area > 0 && i < 3; i++) to[i] += atan2(area, SbDot3(a, b)) * c[i] / area;
  }
}

/* Points: the vertices, or the centroids of the facets; unit normals of their own surface. */
static inline void world_points(World *w, PetscBool vertices)
{
  SbDetectScene *s = &w->scene;

  s->npoint = vertices ? w->nvertex : w->nfacet;
  for (PetscInt i = 0; i < 3 * s->npoint; i++) w->normal[i] = 0;
  for (PetscInt f = 0; f < w->nfacet; f++) add_normal(w, f, vertices, w->normal);
  for (PetscInt i = 0; i < s->npoint; i++) {
    const PetscReal length = PetscSqrtReal(SbDot3(w->normal + 3 * i, w->normal + 3 * i));

    for (int k = 0; k < 3; k++) {
      PetscReal(*const from[3])[3] = {w->x, w->x0, w->X};

      if (length > 0) w->normal[3 * i + k] /= length;
      for (int m = 0; m < 3; m++) {
        const PetscInt *v = w->facet[vertices ? 0 : i];

        w->point[m][3 * i + k] =
          vertices ? from[m][i][k] : (from[m][v[0]][k] + from[m][v[1]][k] + from[m][v[2]][k]) / 3;
      }
    }
    w->point_part[i] = vertices ? w->vertex_part[i] : w->facet_part[i];
    w->point_id[i] = i;
    w->point_vertex[i] = vertices ? i : -1;
    w->point_facet[i] = vertices ? -1 : i;
  }
}

/* The scene of the world as it is now; `apart` moves the corners of each facet by up to this, as CR and DG have them. */
static inline void world_scene(World *w, PetscBool vertices, PetscReal apart, PetscReal reach)
{
  SbDetectScene *s = &w->scene;
  unsigned state = 5;

  s->nfacet = w->nfacet;
  s->ncorner = 3 * w->nfacet;
  for (PetscInt f = 0; f < w->nfacet; f++) {
    for (int k = 0; k < 3; k++) {
      const PetscInt v = w->facet[f][k], c = 3 * f + k;

      w->corners[c] = c;
      w->corner_vertex[c] = v;
      for (int i = 0; i < 3; i++) {
        const PetscReal shift = apart > 0 ? apart * number(&state) : 0;

        w->corner[0][3 * c + i] = w->x[v][i] + shift;
        w->corner[1][3 * c + i] = w->x0[v][i] + shift;
        w->corner[2][3 * c + i] = w->X[v][i];
      }
    }
    w->part[f] = w->facet_part[f];
    w->facet_id[f] = f;
  }
  world_points(w, vertices);
  s->x = w->corner[0];
  s->x0 = w->corner[1];
  s->X = w->corner[2];
  s->facet = w->corners;
  s->facet_vertex = w->corner_vertex;
  s->facet_part = w->part;
  s->facet_id = w->facet_id;
  s->p = w->point[0];
  s->p0 = w->point[1];
  s->P = w->point[2];
  s->p_normal = w->normal;
  s->point_part = w->point_part;
  s->point_id = w->point_id;
  s->point_vertex = w->point_vertex;
  s->point_facet = w->point_facet;
  s->reach = reach;
  s->edges = NULL;
  s->version++;
}

/* Puts the edges of all facets into the scene. Kept until the next world_scene(). */
static inline PetscErrorCode world_edges(World *w)
{
  PetscFunctionBeginUser;
  PetscCall(SbEdgesDestroy(&w->edges));
  PetscCall(SbEdgesCreate(&w->scene, &w->edges));
  w->scene.edges = &w->edges;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Instead of the world's own points: one of a part that has no facets. Kept until the next world_scene(). */
static inline void world_probe(World *w, PetscInt n, const PetscReal p[][3], const PetscReal p0[][3],
                               const PetscReal normal[][3])
{
  w->scene.npoint = n;
  for (PetscInt i = 0; i < n; i++) {
    for (int k = 0; k < 3; k++) {
      w->point[0][3 * i + k] = w->point[2][3 * i + k] = p[i][k];
      w->point[1][3 * i + k] = p0 ? p0[i][k] : p[i][k];
      w->normal[3 * i + k] = normal[i][k];
    }
    w->point_part[i] = w->npart;
    w->point_id[i] = i;
    w->point_vertex[i] = w->nvertex + i;
    w->point_facet[i] = -1;
  }
  if (!p0) w->scene.x0 = w->scene.p0 = NULL;
}

/* Whether p is inside a closed part around the origin whose facets are all seen from there. */
static inline PetscBool inside_star(const World *w, const PetscReal p[3])
{
  for (PetscInt f = 0; f < w->nfacet; f++) {
    const PetscReal *a = w->x[w->facet[f][0]], *b = w->x[w->facet[f][1]], *c = w->x[w->facet[f][2]];
    PetscReal n[3], volume, u, v, t;

    SbCross(b, c, n);
    volume = SbDot3(a, n);
    u = SbDot3(p, n) / volume;
    SbCross(c, a, n);
    v = SbDot3(p, n) / volume;
    SbCross(a, b, n);
    t = SbDot3(p, n) / volume;
    if (u >= 0 && v >= 0 && t >= 0) return (PetscBool)(u + v + t < 1);
  }
  return PETSC_FALSE;
}
