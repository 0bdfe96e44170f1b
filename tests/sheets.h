/*
  sheets.h - wavy sheets of triangles as surfaces in contact, without a mesh of tets: for tests and
  measurements of the search for pairs.
*/
#pragma once
#include <math.h>
#include <sbbase.h>
#include "../src/contact/pairs.h"
#include "test.h"

typedef struct {
  struct _p_SbMesh mesh;
  struct _p_SbSpace space;
  struct _p_SbContactSurface surface;
} Sheets;

/*
  Two sheets above each other, of about nfacet triangles in all, with edges of length 1 and waves of
  height 1 and length 12. self: both are one body in contact with itself. shuffled: vertices and
  triangles are in random order. plate: the lower one is two large triangles. rank, size: vertices
  of the ranks are in stripes along x.
*/
typedef struct {
  PetscInt nfacet;
  PetscBool self, shuffled, plate;
  PetscMPIInt rank, size;
} SheetsShape;

static inline PetscInt sheets_random(unsigned *state, PetscInt n)
{
  return PetscMin(n - 1, (PetscInt)(0.5 * (1. + test_random(state)) * (PetscReal)n));
}

static inline PetscErrorCode sheets_create(const SheetsShape *shape, Sheets *s)
{
  const SbContactSurface m = &s->surface;
  const PetscInt side =
    PetscMax(1, (PetscInt)PetscSqrtReal((PetscReal)shape->nfacet / (shape->plate ? 2. : 4.)));
  unsigned state = 5;
  PetscInt *number, *at;

  PetscFunctionBeginUser;
  *s = (Sheets){.mesh = {.nbody = 2}};
  s->space.mesh = &s->mesh;
  m->space = &s->space;
  m->self = shape->self;
  m->mean_edge = (2. + PetscSqrtReal(2.)) / 3.;
  for (int sheet = 0; sheet < 2; sheet++) {
    const PetscInt n = sheet == 0 && shape->plate ? 1 : side;

    m->nvertex += (n + 1) * (n + 1);
    m->ntriangle += 2 * n * n;
  }
  m->nbody_vertex = m->nvertex;
  m->nbody_triangle = m->ntriangle;
  PetscCall(PetscMalloc2(m->nvertex, &number, m->ntriangle, &at));
  PetscCall(PetscCalloc7(3 * m->nvertex, &m->X, m->nvertex, &m->part, m->nvertex, &m->mine,
                         m->nvertex, &m->own, m->nvertex, &m->driven, m->nvertex, &m->area,
                         3 * m->ntriangle, &m->triangle));
  PetscCall(PetscCalloc2(6 * m->ntriangle, &m->edge, 3 * m->ntriangle, &m->edge_area));

  /* the order of vertices and triangles */
  for (PetscInt v = 0; v < m->nvertex; v++)
    number[v] = v;
  for (PetscInt t = 0; t < m->ntriangle; t++)
    at[t] = t;
  for (PetscInt k = m->nvertex - 1; shape->shuffled && k > 0; k--) {
    const PetscInt l = sheets_random(&state, k + 1);
    const PetscInt keep = number[k];

    number[k] = number[l];
    number[l] = keep;
  }
  for (PetscInt k = m->ntriangle - 1; shape->shuffled && k > 0; k--) {
    const PetscInt l = sheets_random(&state, k + 1);
    const PetscInt keep = at[k];

    at[k] = at[l];
    at[l] = keep;
  }
  for (PetscInt sheet = 0, v = 0, t = 0; sheet < 2; sheet++) {
    const PetscInt n = sheet == 0 && shape->plate ? 1 : side;
    const PetscReal step = (PetscReal)side / (PetscReal)n;
    const PetscInt first = v;

    for (PetscInt j = 0; j <= n; j++) {
      for (PetscInt i = 0; i <= n; i++, v++) {
        const PetscInt w = number[v];
        const PetscReal x = step * (PetscReal)i + (sheet ? 0.3 : 0.);
        const PetscReal y = step * (PetscReal)j + (sheet ? 0.4 : 0.);

        m->X[3 * w] = x;
        m->X[3 * w + 1] = y;
        m->X[3 * w + 2] =
          (shape->plate ? 0. : PetscSinReal(x / 2.) * PetscCosReal(y / 2.)) + (sheet ? 0.15 : 0.);
        m->part[w] = shape->self ? 0 : (PetscInt)sheet;
        m->area[w] = 1.;
        m->own[w] = m->mine[w] =
          (uint8_t)(i * shape->size / (n + 1) == shape->rank || shape->size <= 1);
      }
    }
    for (PetscInt q = 0; q < 2 * n * n; q++, t++) {
      const PetscInt corner = first + (q / 2) / n * (n + 1) + (q / 2) % n;
      PetscInt *to = m->triangle + 3 * at[t];

      to[0] = number[corner];
      to[1] = number[corner + (q % 2 ? n + 2 : 1)];
      to[2] = number[corner + (q % 2 ? n + 1 : n + 2)];
    }
  }
  PetscCall(PetscFree2(number, at));

  /* edges, each once */
  {
    SbKey *key;

    PetscCall(PetscMalloc1(3 * m->ntriangle, &key));
    for (PetscInt k = 0; k < 3 * m->ntriangle; k++)
      key[k] = (SbKey){.key = SbKeyOfPair(m->triangle[k], m->triangle[k - k % 3 + (k + 1) % 3]),
                       .slot = k};
    SbKeysSort(3 * m->ntriangle, key);
    for (PetscInt k = 0; k < 3 * m->ntriangle; k += SbKeysAlike(3 * m->ntriangle, key, k)) {
      m->edge[2 * m->nedge] = (PetscInt)(key[k].key >> 32);
      m->edge[2 * m->nedge + 1] = (PetscInt)(key[k].key & 0xffffffffU);
      m->edge_area[m->nedge++] = 1.;
    }
    PetscCall(PetscFree(key));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode sheets_destroy(Sheets *s)
{
  const SbContactSurface m = &s->surface;

  PetscFunctionBeginUser;
  PetscCall(PetscFree7(m->X, m->part, m->mine, m->own, m->driven, m->area, m->triangle));
  PetscCall(PetscFree2(m->edge, m->edge_area));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions at time t of a motion: the upper sheet slides and sinks, all ripple. */
static inline void sheets_move(const Sheets *s, PetscReal t, PetscReal x[])
{
  for (PetscInt v = 0; v < s->surface.nvertex; v++) {
    const PetscReal *X = s->surface.X + 3 * v;

    x[3 * v] = X[0] + 0.3 * t;
    x[3 * v + 1] = X[1] + 0.2 * t * PetscSinReal(X[0]);
    x[3 * v + 2] = X[2] + 0.1 * t * PetscSinReal(X[0] + X[1]);
  }
}
