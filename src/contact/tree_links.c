/*
  tree_links.c - which facets share an edge, where the surface is closed, and on which facet each point sits.

  All by the identities of mesh vertices. The edges are sorted by their two vertices with two passes of a counting sort; equal ones
  then lie side by side. An edge of more than two facets links each to the next, so that there are fewer links than edges.
*/
#include "tree.h"

/* order[n], rearranged by key[order[i]] in 0..nkey-1; what is equal keeps its order. start[nkey+1] is work space. */
static void counting_sort(PetscInt n, PetscInt nkey, const PetscInt key[], const PetscInt order[],
                          PetscInt start[], PetscInt sorted[])
{
  for (PetscInt k = 0; k <= nkey; k++) start[k] = 0;
  for (PetscInt i = 0; i < n; i++) start[key[i] + 1]++;
  for (PetscInt k = 0; k < nkey; k++) start[k + 1] += start[k];
  for (PetscInt i = 0; i < n; i++) sorted[start[key[order[i]]]++] = order[i];
}

/* Edge 3 facet + k begins at corner k. A vertex of one identity in two parts is two vertices. */
typedef struct {
  PetscInt n;
  PetscInt *low, *high; /* [n] vertices, low <= high */
  PetscInt *order;      /* [n] sorted by both */
  PetscInt (*link)[2];  /* [nlink] facets with a common edge */
  PetscInt nlink;
} Edges;

static PetscErrorCode sort_edges(const SbDetectRings *r, Edges *e)
{
  PetscInt *by_high, *start;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(e->n, &by_high, r->nvertex + 1, &start));
  for (PetscInt i = 0; i < e->n; i++) {
    const PetscInt a = r->vertex[i], b = r->vertex[i - i % 3 + (i + 1) % 3];

    e->low[i] = PetscMin(a, b);
    e->high[i] = PetscMax(a, b);
    e->order[i] = i;
  }
  counting_sort(e->n, r->nvertex, e->high, e->order, start, by_high);
  counting_sort(e->n, r->nvertex, e->low, by_high, start, e->order);
  PetscCall(PetscFree2(by_high, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Links facets, and marks the ends of edges that are not those of two facets, once in each direction. */
static void walk_edges(const SbDetectRings *r, Edges *e, PetscBool open[])
{
  e->nlink = 0;
  for (PetscInt v = 0; v < r->nvertex; v++) open[v] = PETSC_FALSE;
  for (PetscInt i = 0, end; i < e->n; i = end) {
    const PetscInt first = e->order[i], low = e->low[first], high = e->high[first];
    PetscInt turns = 0;

    for (end = i; end < e->n && e->low[e->order[end]] == low && e->high[e->order[end]] == high; end++) {
      turns += r->vertex[e->order[end]] == low ? 1 : -1;
      if (end == i || low == high) continue;
      e->link[e->nlink][0] = e->order[end - 1] / 3;
      e->link[e->nlink++][1] = e->order[end] / 3;
    }
    if (end - i == 2 && turns == 0 && low != high) continue;
    open[low] = open[high] = PETSC_TRUE;
  }
}

static void fill_lists(PetscInt nfacet, PetscInt n, const PetscInt link[][2], SbFacetLinks *l)
{
  for (PetscInt f = 0; f <= nfacet; f++) l->start[f] = 0;
  for (PetscInt i = 0; i < n; i++) {
    l->start[link[i][0]]++;
    l->start[link[i][1]]++;
  }
  /* ends of the lists, which move to their starts as they are filled */
  for (PetscInt f = 0; f < nfacet; f++) l->start[f + 1] += l->start[f];
  for (PetscInt i = n - 1; i >= 0; i--) {
    l->list[--l->start[link[i][0]]] = link[i][1];
    l->list[--l->start[link[i][1]]] = link[i][0];
  }
}

/* The first place in value[index[n]], in order, that holds `wanted`, or where it would be. */
static PetscInt find_first(PetscInt n, const PetscInt index[], const PetscInt value[], PetscInt wanted)
{
  PetscInt low = 0, high = n;

  while (low < high) {
    const PetscInt mid = low + (high - low) / 2;

    if (value[index[mid]] < wanted)
      low = mid + 1;
    else
      high = mid;
  }
  return low;
}

/* The facet of the point's part with the lowest number among those that carry the vertex, or the facet itself. */
static PetscErrorCode find_seats(const SbDetectScene *s, const SbDetectRings *r, PetscInt seat[])
{
  PetscInt *facet;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->nfacet, &facet));
  for (PetscInt f = 0; f < s->nfacet; f++) facet[f] = f;
  PetscCall(PetscSortIntWithPermutation(s->nfacet, s->facet_id, facet));
  for (PetscInt p = 0; p < s->npoint; p++) {
    const PetscBool vertex = (PetscBool)(s->point_vertex[p] >= 0);
    const PetscInt n = vertex ? 3 * s->nfacet : s->nfacet, *index = vertex ? r->ring : facet;
    const PetscInt *value = vertex ? s->facet_vertex : s->facet_id;
    const PetscInt wanted = vertex ? s->point_vertex[p] : s->point_facet[p];

    seat[p] = -1;
    for (PetscInt i = find_first(n, index, value, wanted); i < n && value[index[i]] == wanted; i++) {
      const PetscInt f = vertex ? index[i] / 3 : index[i];

      if (s->facet_part[f] == s->point_part[p] && (seat[p] < 0 || f < seat[p])) seat[p] = f;
    }
  }
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFacetLinksCreate(const SbDetectScene *s, const SbDetectRings *r, SbFacetLinks *l)
{
  Edges e = {.n = 3 * s->nfacet};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(e.n, &e.low, e.n, &e.high, e.n, &e.order, e.n, &e.link));
  PetscCall(PetscMalloc1(r->nvertex, &l->open));
  PetscCall(sort_edges(r, &e));
  walk_edges(r, &e, l->open);
  PetscCall(PetscMalloc3(s->nfacet + 1, &l->start, 2 * e.nlink, &l->list, s->npoint, &l->seat));
  fill_lists(s->nfacet, e.nlink, (const PetscInt(*)[2])e.link, l);
  PetscCall(find_seats(s, r, l->seat));
  PetscCall(PetscFree4(e.low, e.high, e.order, e.link));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFacetLinksDestroy(SbFacetLinks *l)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree3(l->start, l->list, l->seat));
  PetscCall(PetscFree(l->open));
  PetscFunctionReturn(PETSC_SUCCESS);
}
