/*
  body.c - a new mesh of a body in its current state, on rank 0.

  The hull is kept: all triangles of the surface and of interfaces between regions, with their
  vertices. Its interior is tetrahedralised again, in the current or the reference configuration. A
  new vertex y in the current configuration lies in a tet of the old mesh with barycentric
  coordinates w, y = sum w_a x_a; its rest position is X = sum w_a X_a, that of the same material
  point. So the volume at rest is the same, and the old motion from X to x is interpolated at other
  points.

  The motion is not linear between these points, so a new tet may be inverted at rest but not in the
  current configuration. Inverted and flat tets are repaired by moving their inner vertices through
  the material towards the mean of their neighbours: of a few positions on the way the one with the
  best worst tet is chosen, until all are good or nothing helps. A tet with four vertices on a face
  that was plane at rest and bulges now has no volume at rest, and no inner vertex: one of its inner
  edges is split at the middle, with all tets around, and the new vertex moves inwards.

  In a body with curved tets the triangles of the hull keep their curved edges, so its shape is the
  same. The flat triangles enclose the tetrahedralised volume. The old tets define a map from it, at
  rest, to the body: from the point with barycentric coordinates w in a straight tet to that with l
  = w in the curved tet. New vertices, and nodes at the middles of new edges, are mapped, so that
  inner edges follow the curvature of the surface. A new tet may still have a negative Jacobian, and
  is repaired like a flat one.
*/
#include "remesh_impl.h"

#define SWEEPS 30
#define GROWTH 2      /* largest number of tets by edge splits, over the initial number */
#define ROUNDS 6      /* rounds of moving vertices and splitting edges */
#define PLACES 6      /* trial positions of a vertex, each half as far as the one before */
#define STRAIGHT 1e-6 /* offset of an edge node over the edge length that counts as zero */

/* Tets around each vertex: cells[start[v]] to cells[start[v + 1]]. */
typedef struct {
  PetscInt *start, *cells;
} Stars;

/* The old mesh, with what a new one is made of. */
typedef struct {
  const SbOldMesh *old;
  SbLocator flat; /* among straight tets, for a body with curved ones, else NULL */
  PetscInt ncurved;
  SbKey *
    curved; /* [ncurved] curved edges between kept vertices, by new numbers; old slots 6 cell + edge */
  SbLocator now;    /* of current places; what follows is here to be freed after an error, too */
  SbKey *hull_edge; /* edges of the hull, sorted: they are never split */
  Stars stars;      /* of the new mesh, of a round of repairs */
  PetscBool *moved; /* vertices that were, in this round */
} Material;

/* Whether face f of tet c belongs to the hull; each triangle once. */
static PetscBool in_hull(const SbOldMesh *old, const PetscInt component[], PetscInt c, int f)
{
  const PetscInt other = old->faces.neighbour[4 * c + f];

  return (PetscBool)(other < 0 || (c < other && component[other] != component[c]));
}

/* Material points of new vertices. */
static void mix(const SbOldMesh *old, const PetscReal at[], PetscInt cell, const PetscReal w[4],
                PetscReal value[3])
{
  for (int k = 0; k < 3; k++) {
    value[k] = 0;
    for (int a = 0; a < 4; a++)
      value[k] += w[a] * at[3 * old->cell[4 * cell + a] + k];
  }
}

/* Rest position X of the point with barycentric coordinates w in a tet. */
static void mix_rest(const SbOldMesh *old, PetscInt cell, const PetscReal w[4], PetscReal X[3])
{
  mix(old, old->X, cell, w, X);
  for (int i = 0; old->edge_off && i < 18; i++)
    X[i % 3] +=
      4 * w[SbTetEdge[i / 3][0]] * w[SbTetEdge[i / 3][1]] * old->edge_off[18 * (size_t)cell + i];
}

PetscErrorCode SbOldTetFind(SbLocator locator, const PetscReal p[3], PetscInt *cell, PetscReal w[4])
{
  PetscFunctionBeginUser;
  (void)SbLocatorFind(locator, p, cell, w);
  PetscCheck(*cell >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "no old tetrahedron with a volume is near the place (%g, %g, %g)", (double)p[0],
             (double)p[1], (double)p[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Current position of a vertex from its rest position, by the old mesh. */
static PetscErrorCode follow(const Material *at, SbNewMesh *m, PetscInt v)
{
  PetscInt cell;
  PetscReal w[4];

  PetscFunctionBeginUser;
  PetscCall(SbOldTetFind(at->old->rest, m->X + 3 * v, &cell, w));
  mix(at->old, at->old->x, cell, w, m->x + 3 * v);
  if (m->flat)
    mix(at->old, at->old->X, cell, w, m->flat + 3 * v);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the edge nodes of a new tet, or only those at edges of one of its vertices, unless that is
   -1. */
static PetscErrorCode bend(const Material *at, SbNewMesh *m, PetscInt c, PetscInt vertex)
{
  PetscFunctionBeginUser;
  for (int e = 0; m->edge_off && e < 6; e++) {
    const PetscInt a = m->cell[4 * c + SbTetEdge[e][0]];
    const PetscInt b = m->cell[4 * c + SbTetEdge[e][1]];
    const PetscInt i = SbKeysFind(at->ncurved, at->curved, SbKeyOfPair(a, b));
    PetscReal *off = m->edge_off + 18 * (size_t)c + 3 * e;
    PetscReal middle[3], X[3], w[4];
    PetscInt cell;

    if (vertex >= 0 && a != vertex && b != vertex)
      continue;

    // a kept edge has its old node, others that of the map at the middle
    if (i >= 0) {
      for (int k = 0; k < 3; k++)
        off[k] = at->old->edge_off[3 * (size_t)at->curved[i].slot + k];
      continue;
    }
    for (int k = 0; k < 3; k++)
      middle[k] = 0.5 * (m->flat[3 * a + k] + m->flat[3 * b + k]);
    PetscCall(SbOldTetFind(at->flat, middle, &cell, w));
    mix_rest(at->old, cell, w, X);
    for (int k = 0; k < 3; k++)
      off[k] = X[k] - 0.5 * (m->X[3 * a + k] + m->X[3 * b + k]);
    if (SbDot3(off, off) <= PetscSqr(STRAIGHT) * SbDistance2(m->X + 3 * a, m->X + 3 * b))
      memset(off, 0, 3 * sizeof(*off));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rest positions of vertices created in the current configuration; their current ones by the old
   mesh. */
static PetscErrorCode find_material(Material *at, const SbRemeshing *how, SbNewMesh *m)
{
  const SbOldMesh *old = at->old;
  SbLocator filled = at->flat ? at->flat : old->rest; /* tets of the volume that has been filled */
  PetscReal *y = m->x;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * (size_t)m->nvert, &m->X));
  if (old->edge_off)
    PetscCall(PetscMalloc1(3 * (size_t)m->nvert, &m->flat));
  for (PetscInt v = 0; v < m->nkept; v++) {
    PetscCall(PetscArraycpy(m->X + 3 * v, old->X + 3 * m->kept[v], 3));
    PetscCall(PetscArraycpy(m->x + 3 * v, old->x + 3 * m->kept[v], 3));
    if (m->flat)
      PetscCall(PetscArraycpy(m->flat + 3 * v, m->X + 3 * v, 3));
  }
  if (!how->rest) {
    PetscCall(SbLocatorCreate(old->ncell, old->cell, old->x, NULL, &at->now));
    filled = at->now;
  }
  for (PetscInt v = m->nkept; v < m->nvert; v++) {
    PetscInt cell;
    PetscReal w[4];

    PetscCall(SbOldTetFind(filled, y + 3 * v, &cell, w));
    if (at->now || at->flat)
      mix_rest(old, cell, w, m->X + 3 * v);
    else
      PetscCall(PetscArraycpy(m->X + 3 * v, y + 3 * v, 3));
    if (m->flat)
      mix(old, old->X, cell, w, m->flat + 3 * v);
    mix(old, old->x, cell, w, m->x + 3 * v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quality of a tet at rest; for a curved one the worse of this and its least relative Jacobian. */
static PetscReal shape_at_rest(const SbNewMesh *m, PetscInt cell)
{
  const PetscReal shape = SbTetQuality(m->X, m->cell + 4 * cell);
  const PetscReal *off = m->edge_off ? m->edge_off + 18 * (size_t)cell : NULL;
  PetscBool curved = PETSC_FALSE;
  PetscReal least;

  for (int i = 0; off && i < 18; i++)
    curved = (PetscBool)(curved || off[i] != 0);
  if (!curved || !(shape > 0))
    return shape;
  least = SbTetCurvedLeast(m->X, m->cell + 4 * cell, off);
  return shape * PetscMin(1, least);
}

/* The worse of its qualities at rest and now. */
static PetscReal worse(const SbNewMesh *m, PetscInt cell)
{
  const PetscReal rest = shape_at_rest(m, cell);
  const PetscReal now = SbTetQuality(m->x, m->cell + 4 * cell);

  return PetscMin(rest, now);
}

static PetscReal worst_around(const SbNewMesh *m, const Stars *s, PetscInt v)
{
  PetscReal worst = 1;

  for (PetscInt i = s->start[v]; i < s->start[v + 1]; i++) {
    const PetscReal quality = worse(m, s->cells[i]);

    worst = PetscMin(worst, quality);
  }
  return worst;
}

/* Tries positions on the way to the mean of the neighbours at rest; `better`: whether one was. */
static PetscErrorCode move_vertex(const Material *at, PetscInt v, SbNewMesh *m, PetscBool *better)
{
  const Stars *s = &at->stars;
  PetscReal *const place[3] = {m->X + 3 * v, m->x + 3 * v, m->flat ? m->flat + 3 * v : NULL};
  const int nplace = m->flat ? 3 : 2;
  PetscReal middle[3] = {0, 0, 0};
  PetscReal X[3], kept[3][3];
  PetscReal best = worst_around(m, s, v);
  PetscReal part = 1;
  const PetscReal n = 4 * (PetscReal)(s->start[v + 1] - s->start[v]);

  PetscFunctionBeginUser;
  *better = PETSC_FALSE;
  for (int k = 0; k < nplace; k++)
    memcpy(kept[k], place[k], sizeof(kept[k]));
  for (int k = 0; k < 3; k++) {
    X[k] = m->X[3 * v + k];
    for (PetscInt i = s->start[v]; i < s->start[v + 1]; i++)
      for (int a = 0; a < 4; a++)
        middle[k] += m->X[3 * m->cell[4 * s->cells[i] + a] + k] / n;
  }
  for (int i = 0; i < PLACES; i++, part /= 2) {
    PetscReal now;

    for (int k = 0; k < 3; k++)
      m->X[3 * v + k] = X[k] + part * (middle[k] - X[k]) * 4 / 3;
    PetscCall(follow(at, m, v));
    for (PetscInt j = s->start[v]; j < s->start[v + 1]; j++)
      PetscCall(bend(at, m, s->cells[j], v));
    now = worst_around(m, s, v);
    if (!(now > best))
      continue;
    best = now;
    *better = PETSC_TRUE;
    for (int k = 0; k < nplace; k++)
      memcpy(kept[k], place[k], sizeof(kept[k]));
  }
  for (int k = 0; k < nplace; k++)
    memcpy(place[k], kept[k], sizeof(kept[k]));
  for (PetscInt j = s->start[v]; j < s->start[v + 1]; j++)
    PetscCall(bend(at, m, s->cells[j], v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The longest edge of a tet, in the current configuration, that is not on the hull; false: there is
   none. */
static PetscBool inner_edge(const SbSurface *hull, const SbKey edge[], const SbNewMesh *m,
                            PetscInt c, PetscInt ends[2])
{
  PetscReal longest = -1;

  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < i; j++) {
      const PetscInt p = m->cell[4 * c + i];
      const PetscInt q = m->cell[4 * c + j];
      const PetscReal length2 = SbDistance2(m->x + 3 * p, m->x + 3 * q);

      if (length2 <= longest || SbKeysFind(3 * hull->ntri, edge, SbKeyOfPair(p, q)) >= 0)
        continue;
      longest = length2;
      ends[0] = p;
      ends[1] = q;
    }
  }
  return (PetscBool)(longest >= 0);
}

/* Which corners of a tet are the two ends of an edge; false: it does not have this edge. */
static PetscBool has_edge(const SbNewMesh *m, PetscInt c, const PetscInt ends[2], int corner[2])
{
  corner[0] = corner[1] = -1;
  for (int a = 0; a < 4; a++) {
    if (m->cell[4 * c + a] == ends[0])
      corner[0] = a;
    if (m->cell[4 * c + a] == ends[1])
      corner[1] = a;
  }
  return (PetscBool)(corner[0] >= 0 && corner[1] >= 0);
}

/* Makes the arrays of a mesh long enough for so many vertices and tets. */
static PetscErrorCode reserve(PetscInt nvert, PetscInt ncell, SbNewMesh *m)
{
  PetscFunctionBeginUser;
  PetscCall(PetscRealloc(3 * (size_t)nvert * sizeof(*m->X), &m->X));
  PetscCall(PetscRealloc(3 * (size_t)nvert * sizeof(*m->x), &m->x));
  PetscCall(PetscRealloc(4 * (size_t)ncell * sizeof(*m->cell), &m->cell));
  if (m->flat)
    PetscCall(PetscRealloc(3 * (size_t)nvert * sizeof(*m->flat), &m->flat));
  if (m->edge_off)
    PetscCall(PetscRealloc(18 * (size_t)ncell * sizeof(*m->edge_off), &m->edge_off));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inserts a vertex at the middle of an edge at rest; each tet around the edge is divided in two. */
static PetscErrorCode split_edge(const Material *at, const PetscInt ends[2], SbNewMesh *m)
{
  const PetscInt middle = m->nvert;
  const PetscInt ncell = m->ncell;
  PetscInt naround = 0;
  int corner[2];

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < ncell; c++)
    naround += has_edge(m, c, ends, corner);
  PetscCall(reserve(m->nvert + 1, ncell + naround, m));

  // the new vertex
  for (int k = 0; k < 3; k++)
    m->X[3 * middle + k] = 0.5 * (m->X[3 * ends[0] + k] + m->X[3 * ends[1] + k]);
  PetscCall(follow(at, m, middle));
  m->nvert++;

  // each tet around keeps one end of the edge, its copy the other
  for (PetscInt c = 0; c < ncell; c++) {
    const PetscInt half = m->ncell;

    if (!has_edge(m, c, ends, corner))
      continue;
    PetscCall(PetscArraycpy(m->cell + 4 * half, m->cell + 4 * c, 4));
    m->cell[4 * c + corner[1]] = middle;
    m->cell[4 * half + corner[0]] = middle;
    m->ncell++;
    PetscCall(bend(at, m, c, middle));
    PetscCall(bend(at, m, half, -1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves vertices, splits edges of tets without movable ones, until all are good enough or nothing
   helps. */
static PetscErrorCode repair_tets(Material *at, const SbRemeshing *how, const SbSurface *hull,
                                  SbNewMesh *m)
{
  const PetscInt most = GROWTH * m->ncell;
  PetscBool split = PETSC_TRUE;

  PetscFunctionBeginUser;

  // edges of the hull, sorted: they are never split
  PetscCall(PetscMalloc1(3 * (size_t)hull->ntri, &at->hull_edge));
  for (PetscInt i = 0; i < 3 * hull->ntri; i++)
    at->hull_edge[i] = (SbKey){SbKeyOfPair(hull->tri[i], hull->tri[i % 3 == 2 ? i - 2 : i + 1]), i};
  SbKeysSort(3 * hull->ntri, at->hull_edge);
  for (int round = 0; round < ROUNDS && split && m->ncell <= most; round++) {
    const PetscInt ncell = m->ncell;
    PetscBool better = PETSC_TRUE;

    // move inner vertices until all tets are good enough, or nothing helps
    PetscCall(SbBucketByKey(4 * m->ncell, m->cell, m->nvert, &at->stars.start, &at->stars.cells));
    for (PetscInt i = 0; i < 4 * m->ncell; i++)
      at->stars.cells[i] /= 4;
    PetscCall(PetscCalloc1(m->nvert, &at->moved));
    for (int sweep = 0; sweep < SWEEPS && better; sweep++) {
      better = PETSC_FALSE;
      for (PetscInt c = 0; c < m->ncell; c++) {
        if (worse(m, c) >= how->quality)
          continue;
        for (int a = 0; a < 4; a++) {
          const PetscInt v = m->cell[4 * c + a];
          PetscBool done = PETSC_FALSE;

          if (v >= m->nkept)
            PetscCall(move_vertex(at, v, m, &done));
          at->moved[v] = (PetscBool)(at->moved[v] || done);
          better = (PetscBool)(better || done);
        }
      }
    }
    for (PetscInt v = 0; v < m->nvert; v++)
      m->nmoved += at->moved[v];
    PetscCall(PetscFree(at->moved));
    PetscCall(PetscFree(at->stars.start));
    PetscCall(PetscFree(at->stars.cells));

    // split an inner edge of each tet that is still bad
    split = PETSC_FALSE;
    for (PetscInt c = 0; c < ncell && round + 1 < ROUNDS && m->ncell <= most; c++) {
      PetscInt ends[2] = {-1, -1};

      if (worse(m, c) >= how->quality || !inner_edge(hull, at->hull_edge, m, c, ends))
        continue;
      PetscCall(split_edge(at, ends, m));
      split = PETSC_TRUE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error if a bad tet remains; inverted tets now are allowed if the old mesh has some. */
static PetscErrorCode check_quality(const SbOldMesh *old, const SbRemeshing *how, SbNewMesh *m)
{
  PetscInt at_rest = 0;
  PetscInt now = 0;
  PetscInt before = 0;
  PetscReal worst = 1;

  PetscFunctionBeginUser;

  // quality of the new tets, at rest and now
  m->quality = 1;
  for (PetscInt c = 0; c < m->ncell; c++) {
    const PetscReal quality = SbTetQuality(m->x, m->cell + 4 * c);

    at_rest += !(shape_at_rest(m, c) > 1e-6);
    now += !(quality > 0);
    m->quality = PetscMin(m->quality, quality);
  }

  // quality of the old tets now
  for (PetscInt c = 0; c < old->ncell; c++) {
    const PetscReal quality = SbTetQuality(old->x, old->cell + 4 * c);

    before += !(quality > 0);
    worst = PetscMin(worst, quality);
  }

  // error if worse than before, or not better where required
  PetscCheck(
    !at_rest, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%" PetscInt_FMT " of %" PetscInt_FMT
    " new tetrahedra would be inverted or flat at rest: the deformation differs too much from one "
    "old tetrahedron to the next%s",
    at_rest, m->ncell,
    m->edge_off ? ", or the surface bends too much from one triangle to the next" : "");
  PetscCheck(now <= before, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%" PetscInt_FMT " of %" PetscInt_FMT
             " new tetrahedra would be inverted, %" PetscInt_FMT " old ones are",
             now, m->ncell, before);
  PetscCheck(
    !how->better || m->quality > worst, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "a new mesh would be no better: its worst tetrahedron has the quality %.3g, now it is %.3g",
    (double)m->quality, (double)worst);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Re-meshing of a body. */
static PetscErrorCode remesh(const char *where, const SbOldMesh *old, const SbRemeshing *how,
                             SbSurface *hull, Material *at, SbNewMesh *m)
{
  SbTets tets = {0};
  PetscInt *component, nregion;
  PetscInt ntri = 0;
  PetscInt n = 0;
  PetscInt nkept;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(old->ncell, &component));

  // components: tets of one region that are connected by faces
  for (PetscInt c = 0; c < old->ncell; c++)
    component[c] = c;
  for (PetscInt s = 0; s < 4 * old->ncell; s++) {
    const PetscInt other = old->faces.neighbour[s];

    if (other >= 0 && old->region[other] == old->region[s / 4])
      (void)SbUnionJoin(component, other, s / 4);
  }
  nregion = SbUnionLabel(old->ncell, component);

  // the hull: outer surface and interfaces between regions, in the configuration to be filled
  for (PetscInt s = 0; s < 4 * old->ncell; s++)
    ntri += in_hull(old, component, s / 4, s % 4);
  PetscCall(SbSurfaceCreate(old->nvert, ntri, nregion, hull));
  for (PetscInt s = 0; s < 4 * old->ncell; s++) {
    const PetscInt other = old->faces.neighbour[s];

    if (!in_hull(old, component, s / 4, s % 4))
      continue;
    for (int k = 0; k < 3; k++)
      hull->tri[3 * n + k] = old->cell[4 * (s / 4) + SbFaceVertex[s % 4][k]];
    hull->side[2 * n] = other < 0 ? -1 : component[other];
    hull->side[2 * n + 1] = component[s / 4];
    hull->number[n] = n + 1;
    n++;
  }
  PetscCall(PetscFree(component));
  nkept = 3 * ntri;
  PetscCall(PetscMalloc1(nkept, &m->kept));
  PetscCall(PetscArraycpy(m->kept, hull->tri, nkept));
  PetscCall(PetscSortRemoveDupsInt(&nkept, m->kept));
  PetscCall(PetscArraycpy(hull->x, how->rest ? old->X : old->x, 3 * (size_t)old->nvert));
  PetscCall(SbDropUnusedPoints(&hull->nvert, hull->x, 3 * ntri, hull->tri));
  m->nkept = hull->nvert;
  PetscCall((*how->mesher)(where, hull, how->size * SbSurfaceMeasure(hull, NULL), how->ctx, &tets));
  m->nvert = tets.nvert;
  m->ncell = tets.ncell;
  m->x = tets.x;
  m->cell = tets.cell;

  // locator among straight tets; curved edges between kept vertices
  if (old->edge_off) {
    PetscCall(SbLocatorCreate(old->ncell, old->cell, old->X, NULL, &at->flat));
    PetscCall(PetscMalloc1(6 * (size_t)old->ncell, &at->curved));
    for (PetscInt i = 0; i < 6 * old->ncell; i++) {
      const PetscReal *off = old->edge_off + 3 * (size_t)i;
      PetscInt v[2];

      if (off[0] == 0 && off[1] == 0 && off[2] == 0)
        continue;
      for (int k = 0; k < 2; k++)
        PetscCall(
          PetscFindInt(old->cell[4 * (i / 6) + SbTetEdge[i % 6][k]], m->nkept, m->kept, &v[k]));
      if (v[0] >= 0 && v[1] >= 0)
        at->curved[at->ncurved++] = (SbKey){SbKeyOfPair(v[0], v[1]), i};
    }
    SbKeysSort(at->ncurved, at->curved);
  }
  PetscCall(find_material(at, how, m));
  if (m->flat)
    PetscCall(PetscMalloc1(18 * (size_t)m->ncell, &m->edge_off));
  for (PetscInt c = 0; c < m->ncell; c++)
    PetscCall(bend(at, m, c, -1));
  PetscCall(repair_tets(at, how, hull, m));
  PetscCall(check_quality(old, how, m));

  // the old tet that contains the centroid of each new one
  PetscCall(PetscMalloc1(m->ncell, &m->within));
  for (PetscInt c = 0; c < m->ncell; c++) {
    PetscReal middle[3], w[4];

    for (int k = 0; k < 3; k++) {
      middle[k] = 0;
      for (int a = 0; a < 4; a++)
        middle[k] += m->X[3 * m->cell[4 * c + a] + k] / 4;
    }
    PetscCall(SbOldTetFind(at->old->rest, middle, &m->within[c], w));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRemeshBody(const char *where, const SbOldMesh *old, const SbRemeshing *how,
                            SbNewMesh *m)
{
  SbSurface hull = {0};
  Material at = {.old = old};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(m, sizeof(*m)));
  ierr = remesh(where, old, how, &hull, &at, m);
  PetscCall(SbSurfaceDestroy(&hull));
  PetscCall(SbLocatorDestroy(&at.flat));
  PetscCall(SbLocatorDestroy(&at.now));
  PetscCall(PetscFree(at.hull_edge));
  PetscCall(PetscFree(at.stars.start));
  PetscCall(PetscFree(at.stars.cells));
  PetscCall(PetscFree(at.moved));
  PetscCall(PetscFree(at.curved));
  if (ierr)
    PetscCall(SbNewMeshDestroy(m));
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbNewMeshDestroy(SbNewMesh *m)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(m->X));
  PetscCall(PetscFree(m->x));
  PetscCall(PetscFree(m->cell));
  PetscCall(PetscFree(m->kept));
  PetscCall(PetscFree(m->within));
  PetscCall(PetscFree(m->edge_off));
  PetscCall(PetscFree(m->flat));
  PetscCall(PetscMemzero(m, sizeof(*m)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
