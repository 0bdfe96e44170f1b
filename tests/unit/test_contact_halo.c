// @ranks 1 2 3 5
/*
  Surfaces on several ranks: the pairs of each rank are, in the order of numbers, those of a search
  over all vertices, triangles and edges that have a node of it; random motions, surfaces crossed
  and in one plane, coinciding vertices, with vertices added and dropped; what comes from other
  ranks is what their owners have. A rank holds, and searches, less than all.
*/
#include "../scene.h"
#include "../../src/contact/pairs.h"

#define NBODY 10
#define REACH 4e-3
#define WIDTH 5 /* numbers of a pair: kind, vertices */

/* Positions that no partition changes: rows of boxes that nearly touch, shaken; flat: all in one
   plane; merged: on a coarse lattice, so that vertices coincide. */
static void place(SbContactSurface m, unsigned seed, PetscReal shake, PetscBool flat,
                  PetscBool merged, PetscReal x[])
{
  for (PetscInt v = 0; v < m->nkept_vertex; v++) {
    unsigned state = 7919 * seed + 104729 * (unsigned)(m->number[v] + 1);

    for (int k = 0; k < 3; k++) {
      x[3 * v + k] = m->X[3 * v + k] + shake * test_random(&state);
      if (merged)
        x[3 * v + k] = 0.02 * PetscFloorReal(x[3 * v + k] / 0.02);
    }
    if (flat)
      x[3 * v + 2] = 0.;
  }
}

/* Adds a pair of the whole surface if its gap is within the reach and it has a node here. */
static PetscErrorCode try_pair(SbContactSurface w, const PetscReal x[], const SbContactPair *pair,
                               PetscInt *n, PetscInt *size, PetscInt **list)
{
  const int split = SbContactPairSplit(pair);
  PetscBool mine = PETSC_FALSE;
  SbDistance d;

  PetscFunctionBeginUser;
  if (w->part[pair->v[0]] == w->part[pair->v[split]] && !w->self)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 4; k++) {
    mine = (PetscBool)(mine || w->mine[pair->v[k]] || w->remote[pair->v[k]].rank == w->space->rank);
    for (int l = split; k < split && l < 4; l++)
      if (pair->v[k] == pair->v[l])
        PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!mine || SbContactPairSweptApart(w, pair, x, x, REACH) ||
      SbContactPairGap(w, pair, x, &d) >= REACH)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(WIDTH * (*n + 1), sizeof(**list), size, list));
  (*list)[WIDTH * *n] = pair->kind;
  PetscCall(PetscArraycpy(*list + WIDTH * *n + 1, pair->v, 4));
  (*n)++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All of them, sorted. */
static PetscErrorCode by_enumeration(SbContactSurface w, const PetscReal x[], PetscInt *n,
                                     PetscInt **list)
{
  PetscInt size = 0;

  PetscFunctionBeginUser;
  *n = 0;
  *list = NULL;
  for (PetscInt v = 0; v < w->nbody_vertex; v++) {
    for (PetscInt t = 0; t < w->ntriangle; t++) {
      const PetscInt *c = w->triangle + 3 * t;
      const SbContactPair pair = {.kind = SB_PAIR_VERTEX_TRIANGLE, .v = {v, c[0], c[1], c[2]}};

      PetscCall(try_pair(w, x, &pair, n, &size, list));
    }
  }
  for (PetscInt e = 0; e < w->nedge; e++) {
    for (PetscInt f = e + 1; f < w->nedge; f++) {
      const SbContactPair pair = {
        .kind = SB_PAIR_EDGE_EDGE,
        .v = {w->edge[2 * e], w->edge[2 * e + 1], w->edge[2 * f], w->edge[2 * f + 1]}};

      PetscCall(try_pair(w, x, &pair, n, &size, list));
    }
  }
  PetscCall(SbSortByKeys(*n, WIDTH * sizeof(PetscInt), WIDTH, *list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices and edges that are held, against the whole surface. */
static void check_held(SbContactSurface m, SbContactSurface w, const PetscReal x[],
                       const PetscReal y[])
{
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    const PetscInt k = m->number[v];
    PetscBool same = (PetscBool)(m->area[v] == w->area[k] && m->part[v] == w->part[k] &&
                                 m->remote[v].rank == w->remote[k].rank);

    for (int i = 0; i < 3; i++)
      same =
        (PetscBool)(same && x[3 * v + i] == y[3 * k + i] && m->X[3 * v + i] == w->X[3 * k + i]);
    for (PetscInt e = 0; e < m->start[v + 1] - m->start[v]; e++)
      same = (PetscBool)(same && m->gnode[m->start[v] + e] == w->gnode[w->start[k] + e] &&
                         m->weight[m->start[v] + e] == w->weight[w->start[k] + e]);
    SB_CHECK(same, "vertex %d is not that of its owner", (int)k);
  }
  for (PetscInt e = 0; e < m->nedge; e++) {
    const PetscInt k = m->edge_number[e];

    SB_CHECK(m->number[m->edge[2 * e]] == w->edge[2 * k] &&
               m->number[m->edge[2 * e + 1]] == w->edge[2 * k + 1] &&
               m->edge_area[e] == w->edge_area[k] && m->edge_share[2 * e] == w->edge_share[2 * k] &&
               m->edge_share[2 * e + 1] == w->edge_share[2 * k + 1],
             "edge %d is not that of its owner", (int)k);
  }
  for (PetscInt t = 0; t < m->ntriangle; t++)
    for (int i = 0; i < 6; i++)
      SB_CHECK(m->share[6 * t + i] == w->share[6 * m->triangle_number[t] + i] &&
                 m->share[6 * t + i] > 0.,
               "triangle %d has another part of its sides", (int)m->triangle_number[t]);
}

/* States of a row of boxes, and what a rank holds in the first of them. */
static PetscErrorCode check_scene(const char *element, PetscBool self, SbContactSearch search)
{
  PetscReal *x[2];
  PetscInt most[3] = {0, 0, 0}; /* vertices held, candidates, pairs of a rank */
  PetscInt all = 0;
  char bodies[NBODY * 200] = "";
  SbContactPairs pairs;
  SbContactSurface m;
  SbFacet *facet;
  PetscInt nfacet, set;
  SbSpace s;
  TestScene t;

  PetscFunctionBeginUser;
  for (int b = 0; b < NBODY; b++)
    SbAppend(sizeof(bodies), bodies,
             "-body_b%d_mesh box:0.1,0.1,0.1:2 -body_b%d_material linear -body_b%d_young 1e5 "
             "-body_b%d_poisson 0.3 -body_b%d_density 1000 -body_b%d_translate %g,0,0 ",
             b, b, b, b, b, b, 0.102 * b);
  PetscCall(
    test_open(&t,
              "-bodies b0,b1,b2,b3,b4,b5,b6,b7,b8,b9 -body_default_element %s -effects meet "
              "-effect_meet_type contact -ts_dt 1e-3 %s",
              element, bodies));
  s = t.run->model->space;
  PetscCall(SbSpaceFindSet(s, "boundary", "the test", &set));
  PetscCall(SbSpaceGetSetFacets(s, set, &nfacet, &facet));
  PetscCall(SbContactSurfaceCreate(s, nfacet, facet, NULL, &m));
  PetscCall(SbContactSurfaceMarkDriven(m));
  m->self = self;
  for (int k = 0; k < 2; k++)
    PetscCall(SbContactSurfaceCreateArray(m, &x[k]));
  PetscCall(SbContactPairsCreate(m, REACH, search, &pairs));
  for (unsigned state = 0; state < 6; state++) {
    const PetscBool flat = (PetscBool)(state == 3);
    const PetscBool merged = (PetscBool)(state == 4);
    PetscInt *wanted, *found;
    PetscInt nwanted;
    PetscInt n = 0;
    PetscReal *y;
    SbContactSurface w;
    PetscBool same;

    place(m, state, state == 2 ? 0.05 : 2e-3, flat, merged, x[0]);
    place(m, state + (state == 5), 2e-3, flat, merged, x[1]);
    for (int k = 0; k < 2; k++)
      PetscCall(SbContactSurfaceUpdate(m, x[k]));
    if (state == 3)
      SbContactPairsForget(pairs);
    PetscCall(SbContactPairsFind(pairs, x[0], x[1]));

    /* those within the reach at the end, and in order */
    PetscCall(PetscMalloc1(WIDTH * pairs->n, &found));
    for (PetscInt i = 0; i < pairs->n; i++) {
      const SbContactPair *pair = &pairs->pair[i];
      SbDistance d;

      if (SbContactPairGap(m, pair, x[1], &d) >= REACH)
        continue;
      found[WIDTH * n] = pair->kind;
      for (int k = 0; k < 4; k++)
        found[WIDTH * n + 1 + k] = m->number[pair->v[k]];
      for (int k = 0; n && k < 3; k++) {
        const PetscInt step = found[WIDTH * n + k] - found[WIDTH * (n - 1) + k];

        SB_CHECK(step >= 0 || (k == 0 && pair->kind == SB_PAIR_EDGE_EDGE), "pair %d is too late",
                 (int)i);
        if (step)
          break;
      }
      n++;
    }
    PetscCall(SbSortByKeys(n, WIDTH * sizeof(PetscInt), WIDTH, found));
    PetscCall(SbContactSurfaceGather(m, x[1], &w, &y));
    w->self = self;
    PetscCall(by_enumeration(w, y, &nwanted, &wanted));
    SB_CHECK(n == nwanted && (n > 0 || s->size > 1), "state %u, %s: %d pairs, not %d", state,
             element, (int)n, (int)nwanted);
    PetscCall(PetscArraycmp(found, wanted, WIDTH * PetscMin(n, nwanted), &same));
    SB_CHECK(same, "state %u, %s: other pairs", state, element);
    check_held(m, w, x[1], y);
    if (state == 0) {
      most[0] = m->nbody_vertex;
      most[1] = pairs->ncandidate;
      most[2] = n;
      for (PetscInt i = 0; i < pairs->n; i++) {
        SbDistance d;

        all +=
          m->own[pairs->pair[i].v[0]] && SbContactPairGap(m, &pairs->pair[i], x[1], &d) < REACH;
      }
    }
    PetscCall(PetscFree(wanted));
    PetscCall(PetscFree(found));
    PetscCall(PetscFree(y));
    PetscCall(SbContactSurfaceDestroy(&w));
  }

  /* counts */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 3, MPIU_INT, MPI_MAX, s->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPIU_INT, MPI_SUM, s->comm));
  test_print("%s, self %d, %d ranks: at most %d of %d vertices, %d candidates, %d of %d pairs\n",
             element, (int)self, s->size, (int)most[0], (int)m->Nbody_vertex, (int)most[1],
             (int)most[2], (int)all);
  if (s->size == 5) {
    SB_CHECK(5 * most[0] < 3 * m->Nbody_vertex && 5 * most[2] < 3 * all,
             "%d vertices of %d, %d pairs of %d on a rank", (int)most[0], (int)m->Nbody_vertex,
             (int)most[2], (int)all);
  }
  PetscCall(SbContactPairsDestroy(&pairs));
  PetscCall(SbContactSurfaceDestroy(&m));
  PetscCall(PetscFree(facet));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_scene("p1", PETSC_FALSE, SB_SEARCH_HASH));
  PetscCall(check_scene("p1", PETSC_TRUE, SB_SEARCH_HASH));
  PetscCall(check_scene("p1", PETSC_FALSE, SB_SEARCH_TREE));
  PetscCall(check_scene("cr", PETSC_FALSE, SB_SEARCH_HASH));
  SB_TEST_END();
}
