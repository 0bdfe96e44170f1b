/*
  triangles_check.c - whether a surface of triangles has an inside: no flat or doubled triangle, two at each edge that run along it in
  opposite directions, a volume.

  Parts that hang together at no vertex are examined one by one: a part turned outwards must lie in the open, one turned inwards is a
  cavity and must lie in a solid part. Where a part lies is told by the winding number of the other parts around one of its vertices (sum
  of solid angles, van Oosterom and Strackee 1983). That triangles cut through each other elsewhere is not searched for.
*/
#include <stdlib.h>
#include "sbkernel.h"
#include "triangles.h"

static const PetscReal *corner(const SbTriangles *t, PetscInt f, int k)
{
  return t->x + 3 * t->tri[3 * f + k];
}

static void difference(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  for (int i = 0; i < 3; i++) c[i] = a[i] - b[i];
}

PetscReal SbTriangleMeasure(const SbTriangles *t, PetscInt f, PetscReal *longest2, PetscReal *around)
{
  PetscReal e[3][3], n[3];

  *longest2 = *around = 0;
  for (int k = 0; k < 3; k++) {
    PetscReal l2;

    difference(corner(t, f, (k + 1) % 3), corner(t, f, k), e[k]);
    l2 = SbDot3(e[k], e[k]);
    *longest2 = PetscMax(*longest2, l2);
    *around += PetscSqrtReal(l2);
  }
  SbCross(e[0], e[1], n);
  return PetscSqrtReal(SbDot3(n, n));
}

static PetscErrorCode check_triangles(SbTriangleFile *f)
{
  SbTriangles *t = f->t;
  PetscReal longest2, around, sum = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < t->ntri; i++) {
    const PetscReal area2 = SbTriangleMeasure(t, i, &longest2, &around);

    PetscCheck(area2 > SB_TRIANGLE_FLAT * longest2, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: triangle %lld at (%.6g, %.6g, %.6g) m has no area; collapse it (gmsh, meshlab: remove "
               "degenerate faces)",
               f->where, (long long)f->number[i], (double)corner(t, i, 0)[0], (double)corner(t, i, 0)[1],
               (double)corner(t, i, 0)[2]);
    sum += around;
  }
  t->edge = sum / (3 * (PetscReal)t->ntri);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ edges */

static int compare_edges(const void *a, const void *b)
{
  const SbTriangleEdge *p = (const SbTriangleEdge *)a, *q = (const SbTriangleEdge *)b;

  if (p->key != q->key) return p->key < q->key ? -1 : 1;
  return (p->slot > q->slot) - (p->slot < q->slot);
}

PetscErrorCode SbTrianglesEdges(const SbTriangles *t, SbTriangleEdge edge[])
{
  const PetscInt n = 3 * t->ntri;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt a = t->tri[i], b = t->tri[i % 3 == 2 ? i - 2 : i + 1];

    edge[i].key = (uint64_t)PetscMin(a, b) << 32 | (uint64_t)PetscMax(a, b);
    edge[i].slot = i;
  }
  if (n) qsort(edge, (size_t)n, sizeof(*edge), compare_edges);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbTrianglesAtEdge(PetscInt n, const SbTriangleEdge edge[], PetscInt i)
{
  PetscInt m = 1;

  for (; i + m < n && edge[i + m].key == edge[i].key;) m++;
  return m;
}

/* The vertex of a triangle opposite to an edge of it. */
static PetscInt opposite(const SbTriangles *t, PetscInt slot)
{
  return t->tri[3 * (slot / 3) + (slot % 3 + 2) % 3];
}

/* What is wrong where n triangles meet at an edge. */
static PetscErrorCode check_edge(const SbTriangleFile *f, PetscInt n, const SbTriangleEdge edge[])
{
  const SbTriangles *t = f->t;
  const PetscInt a = edge[0].slot / 3, b = edge[PetscMin(n - 1, 1)].slot / 3;
  const int k = (int)(edge[0].slot % 3);
  const PetscReal *p = corner(t, a, k), *q = corner(t, a, (k + 1) % 3);
  char at[160];

  PetscFunctionBeginUser;
  (void)snprintf(at, sizeof(at), "from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g) m", (double)p[0],
                 (double)p[1], (double)p[2], (double)q[0], (double)q[1], (double)q[2]);
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < i; j++)
      PetscCheck(opposite(t, edge[i].slot) != opposite(t, edge[j].slot), PETSC_COMM_SELF,
                 PETSC_ERR_USER_INPUT, "%s: triangles %lld and %lld have the same corners; remove one",
                 f->where, (long long)f->number[edge[j].slot / 3], (long long)f->number[edge[i].slot / 3]);
  }
  PetscCheck(
    n > 1, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: the surface is open: triangle %lld has no neighbour at its edge %s; close it, or join vertices "
    "that differ by rounding",
    f->where, (long long)f->number[a], at);
  PetscCheck(n == 2, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %lld triangles meet at the edge %s, %lld and %lld among them; an edge has two, take parts "
             "that touch apart",
             f->where, (long long)n, at, (long long)f->number[a], (long long)f->number[b]);
  PetscCheck(
    t->tri[edge[0].slot] != t->tri[edge[1].slot], PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: triangles %lld and %lld at the edge %s are turned to opposite sides; orient the surface (gmsh: "
    "Reverse Surface, meshlab: re-orient all faces)",
    f->where, (long long)f->number[a], (long long)f->number[b], at);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode join_edges(const SbTriangleFile *f, PetscInt n, SbTriangleEdge edge[])
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  PetscCall(SbTrianglesEdges(t, edge));
  for (PetscInt i = 0, m; i < n; i += m) {
    m = SbTrianglesAtEdge(n, edge, i);
    PetscCall(check_edge(f, m, edge + i));
    t->across[edge[i].slot] = edge[i + 1].slot / 3;
    t->across[edge[i + 1].slot] = edge[i].slot / 3;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode find_neighbours(const SbTriangleFile *f)
{
  SbTriangles *t = f->t;
  SbTriangleEdge *edge;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &t->across));
  PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &edge));
  ierr = join_edges(f, 3 * t->ntri, edge);
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(ierr);
}

/* ------------------------------------------------------------------ parts */

typedef struct {
  PetscInt first; /* triangle */
  PetscReal volume, area;
} Part;

static PetscInt root_of(PetscInt up[], PetscInt v)
{
  for (; up[v] != v; v = up[v]) up[v] = up[up[v]];
  return v;
}

/* Part of each triangle, by the vertices it hangs together with. */
static PetscErrorCode find_parts(const SbTriangles *t, PetscInt *npart, PetscInt part[])
{
  PetscInt *up, *number;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(t->nvert, &up, t->nvert, &number));
  for (PetscInt v = 0; v < t->nvert; v++) {
    up[v] = v;
    number[v] = -1;
  }
  for (PetscInt i = 0; i < 3 * t->ntri; i++) up[root_of(up, t->tri[i])] = root_of(up, t->tri[3 * (i / 3)]);
  *npart = 0;
  for (PetscInt f = 0; f < t->ntri; f++) {
    const PetscInt v = root_of(up, t->tri[3 * f]);

    if (number[v] < 0) number[v] = (*npart)++;
    part[f] = number[v];
  }
  PetscCall(PetscFree2(up, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbTetVolumeTo(const SbTriangles *t, PetscInt f, const PetscReal o[3])
{
  PetscReal a[3][3], n[3];

  for (int k = 0; k < 3; k++) difference(corner(t, f, k), o, a[k]);
  SbCross(a[0], a[1], n);
  return SbDot3(n, a[2]) / 6;
}

PetscReal SbTriangleSolidAngle(const SbTriangles *t, PetscInt f, const PetscReal o[3])
{
  PetscReal a[3][3], l[3], n[3], down;

  for (int k = 0; k < 3; k++) {
    difference(corner(t, f, k), o, a[k]);
    l[k] = PetscSqrtReal(SbDot3(a[k], a[k]));
  }
  SbCross(a[0], a[1], n);
  down =
    l[0] * l[1] * l[2] + SbDot3(a[0], a[1]) * l[2] + SbDot3(a[1], a[2]) * l[0] + SbDot3(a[2], a[0]) * l[1];
  return 2 * atan2(SbDot3(n, a[2]), down);
}

static void turn(SbTriangles *t)
{
  for (PetscInt f = 0; f < t->ntri; f++) {
    PetscInt *v = t->tri + 3 * f, *n = t->across + 3 * f, keep = v[1];

    v[1] = v[2];
    v[2] = keep;
    keep = n[0]; /* the edges are walked the other way */
    n[0] = n[2];
    n[2] = keep;
  }
  t->turned = PETSC_TRUE;
}

/* Each part against all others. */
static PetscErrorCode check_nesting(const SbTriangleFile *f, PetscInt npart, const PetscInt part[],
                                    const Part p[])
{
  const SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; npart > 1 && k < npart; k++) {
    const PetscReal *o = corner(t, p[k].first, 0);
    PetscReal around = 0;

    for (PetscInt i = 0; i < t->ntri; i++) {
      if (part[i] != k) around += SbTriangleSolidAngle(t, i, o);
    }
    around /= 4 * PETSC_PI;
    PetscCheck(PetscAbsReal(around - (p[k].volume < 0)) < 0.25, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: the part with triangle %lld is turned %s; %s", f->where, (long long)f->number[p[k].first],
               p[k].volume > 0 ? "outwards and lies in another part" : "inwards and lies in no other part",
               p[k].volume > 0 ? "turn it if it is a cavity, else join or remove it" : "turn it");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_parts(const SbTriangleFile *f, PetscInt npart, const PetscInt part[], Part p[])
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < npart; k++) p[k] = (Part){.first = -1};
  for (PetscInt i = 0; i < t->ntri; i++) {
    Part *mine = &p[part[i]];
    PetscReal longest2, around;

    if (mine->first < 0) mine->first = i;
    mine->volume += SbTetVolumeTo(t, i, corner(t, mine->first, 0));
    mine->area += 0.5 * SbTriangleMeasure(t, i, &longest2, &around);
  }
  for (PetscInt k = 0; k < npart; k++) {
    PetscCheck(PetscAbsReal(p[k].volume) > SB_TRIANGLE_EMPTY * PetscPowReal(p[k].area / 6, 1.5),
               PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: the part with triangle %lld encloses no volume; give it a thickness", f->where,
               (long long)f->number[p[k].first]);
    t->volume += p[k].volume;
  }
  if (t->volume < 0) {
    turn(t);
    t->volume = -t->volume;
    for (PetscInt k = 0; k < npart; k++) p[k].volume = -p[k].volume;
  }
  PetscCall(check_nesting(f, npart, part, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesCheck(SbTriangleFile *f)
{
  PetscInt npart = 0, *part;
  Part *p;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(check_triangles(f));
  PetscCall(find_neighbours(f));
  PetscCall(PetscMalloc1(f->t->ntri, &part));
  PetscCall(find_parts(f->t, &npart, part));
  PetscCall(PetscMalloc1(npart, &p));
  ierr = check_parts(f, npart, part, p);
  PetscCall(PetscFree(p));
  PetscCall(PetscFree(part));
  PetscFunctionReturn(ierr);
}
