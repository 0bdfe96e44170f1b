/*
  overlap.c - warns of bodies that lie in each other though no contact is named between them: they
  pass through each other without a word, and nothing in the results says so.

  Boxes first; the rest is only for pairs of bodies whose boxes overlap. Of such a pair vertices and
  centroids of tets of one body are looked for in the tets of the other one, and so are the middles
  of what edges of its surface have between the facets of the other one through which they go: bars
  that cross have neither a vertex nor a centroid in each other. The depth of those found is their
  distance from its surface. Bodies that share a face, and rounded surfaces whose facets cut into
  each other, stay below SHALLOW.
*/
#include "sbgeometry.h"
#include "scene_impl.h"

#define SHALLOW 0.05 /* depth over the larger mean size of tets, up to which surfaces may cross */
#define SAMPLES 1000 /* most points, and edges, of a body in the common box that a rank looks at */
#define PAIRS 256    /* most pairs that are looked at */

/* Two bodies whose boxes overlap by more than `shallow`, m. */
typedef struct {
  PetscInt body[2];
  PetscReal box[6], shallow;
} Pair;

/* A point of body[side] of a pair. */
typedef struct {
  PetscInt pair, side; /* sorted by these */
  PetscReal x[3];
} Sample;

/* An edge of the surface of body[side] of a pair. */
typedef struct {
  PetscInt pair, side; /* sorted by these */
  PetscReal x[2][3];
} Edge;

/* Boxes of all bodies at the vertices x[nvert][3]. Collective. */
static PetscErrorCode find_boxes(SbMesh mesh, const PetscReal x[], PetscReal box[][6])
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    SbBoxClear(box[b]);
  for (PetscInt v = 0; v < mesh->nvert_owned; v++)
    SbBoxAdd(box[mesh->vert_body[v]], x + 3 * v);
  for (PetscInt i = 0; i < 6 * mesh->nbody; i++)
    box[i / 6][i % 6] *= i % 6 < 3 ? -1 : 1;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box, (PetscMPIInt)(6 * mesh->nbody), MPIU_REAL, MPI_MAX,
                             mesh->comm));
  for (PetscInt i = 0; i < 6 * mesh->nbody; i++)
    box[i / 6][i % 6] *= i % 6 < 3 ? -1 : 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* in[effect * nbody + b]: whether a contact between bodies acts on body b, or a joint has it.
   Collective. */
static PetscErrorCode find_contacts(SbModel m, PetscBool in[])
{
  PetscFunctionBeginUser;
  for (PetscInt e = 0; e < m->neffect; e++) {
    const SbEffect effect = m->effect[e];
    SbScope scope;
    SbFacet *facet;
    PetscBool obstacle;
    PetscInt n;

    for (PetscInt k = 0; k < effect->njoined; k++)
      in[e * m->nbody + effect->joined[k]] = PETSC_TRUE;
    if (!effect->contact)
      continue;
    SbScopeSet(&scope, "effect", effect->type, effect->name);
    PetscCall(SbOptionGiven(&scope, "obstacle", &obstacle));
    if (obstacle)
      continue;
    if (!effect->on.n) {
      for (PetscInt b = 0; b < m->nbody; b++)
        in[e * m->nbody + b] = PETSC_TRUE;
      continue;
    }
    PetscCall(SbEffectFacets(m->space, &effect->on, &n, &facet));
    for (PetscInt k = 0; k < n; k++)
      in[e * m->nbody + m->mesh->cell_body[facet[k].cell]] = PETSC_TRUE;
    PetscCall(PetscFree(facet));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, in, (PetscMPIInt)(m->neffect * m->nbody), SB_MPI_BOOL,
                             MPI_LOR, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Up to PAIRS pairs of bodies without contact whose boxes overlap; the caller frees. Collective. */
static PetscErrorCode find_pairs(SbModel m, const PetscReal (*box)[6], PetscInt *n, Pair **pair)
{
  PetscInt *order;
  PetscReal *low;
  PetscBool *in = NULL;

  PetscFunctionBeginUser;
  *n = 0;
  *pair = NULL;

  // bodies in the order of their lowest x: a pair is one whose intervals overlap
  PetscCall(PetscMalloc2(m->nbody, &order, m->nbody, &low));
  for (PetscInt b = 0; b < m->nbody; b++) {
    order[b] = b;
    low[b] = box[b][0];
  }
  PetscCall(PetscSortRealWithArrayInt(m->nbody, low, order));
  for (PetscInt i = 0; i < m->nbody; i++) {
    for (PetscInt j = i + 1; j < m->nbody && low[j] < box[order[i]][3]; j++) {
      const PetscInt b[2] = {PetscMin(order[i], order[j]), PetscMax(order[i], order[j])};
      PetscBool meets = PETSC_TRUE;
      Pair p = {.body = {b[0], b[1]}};

      for (int s = 0; s < 2; s++)
        p.shallow = PetscMax(p.shallow, SHALLOW * PetscPowReal(6 * m->body[b[s]].volume /
                                                                 (PetscReal)m->body[b[s]].ncell,
                                                               1. / 3.));
      for (int k = 0; k < 3; k++) {
        p.box[k] = PetscMax(box[b[0]][k], box[b[1]][k]);
        p.box[3 + k] = PetscMin(box[b[0]][3 + k], box[b[1]][3 + k]);
        meets = (PetscBool)(meets && p.box[3 + k] - p.box[k] > p.shallow);
      }
      if (!meets)
        continue;
      if (!in) {
        PetscCall(PetscCalloc1(m->neffect * m->nbody, &in));
        PetscCall(find_contacts(m, in));
      }
      for (PetscInt e = 0; e < m->neffect; e++)
        meets = (PetscBool)(meets && !(in[e * m->nbody + b[0]] && in[e * m->nbody + b[1]]));
      if (!meets)
        continue;
      if (!*pair)
        PetscCall(PetscMalloc1(PAIRS, pair));
      if (*n < PAIRS)
        (*pair)[(*n)++] = p;
    }
  }
  PetscCall(PetscFree(in));
  PetscCall(PetscFree2(order, low));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool is_inside(const PetscReal box[6], const PetscReal x[3])
{
  for (int k = 0; k < 3; k++)
    if (!(x[k] >= box[k] && x[k] <= box[3 + k]))
      return PETSC_FALSE;
  return PETSC_TRUE;
}

/* Counts this rank's points of body[side] in the common box, or writes every `each`-th. */
static PetscInt list_samples(SbMesh mesh, const PetscReal x[], const Pair *p, PetscInt pair,
                             PetscInt side, PetscInt each, Sample to[])
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < mesh->nvert_owned + mesh->ncell_owned; i++) {
    const PetscInt c = i - mesh->nvert_owned;
    Sample s = {.pair = pair, .side = side};

    if ((c < 0 ? mesh->vert_body[i] : mesh->cell_body[c]) != p->body[side])
      continue;
    for (int k = 0; k < 3; k++) {
      s.x[k] = c < 0 ? x[3 * i + k] : 0.;
      for (int a = 0; c >= 0 && a < 4; a++)
        s.x[k] += 0.25 * x[3 * mesh->cell[4 * c + a] + k];
    }
    if (!is_inside(p->box, s.x))
      continue;
    if (to && n % each == 0)
      to[n / each] = s;
    n++;
  }
  return to ? (n + each - 1) / each : n;
}

/* Whether p comes before q, by the same rule on all ranks. */
static PetscBool is_before(const PetscReal p[3], const PetscReal q[3])
{
  for (int k = 0; k < 3; k++)
    if (p[k] != q[k])
      return (PetscBool)(p[k] < q[k]);
  return PETSC_FALSE;
}

/* Counts this rank's edges of the surface of body[side] that reach into the common box, or writes
   every `each`-th. An edge is that of the one of its two facets that has it upwards. */
static PetscInt list_edges(SbMesh mesh, const PetscReal x[], const Pair *p, PetscInt pair,
                           PetscInt side, PetscInt each, Edge to[])
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < 12 * mesh->ncell_owned; i++) {
    const PetscInt c = i / 12;
    const int f = (int)(i % 12) / 3;
    const int k = (int)(i % 3);
    Edge e = {.pair = pair, .side = side};
    PetscBool reaches = PETSC_TRUE;

    if (mesh->cell_body[c] != p->body[side] || !(mesh->face_set[4 * c + f] & SB_ON_BOUNDARY))
      continue;
    for (int a = 0; a < 2; a++)
      for (int j = 0; j < 3; j++)
        e.x[a][j] = x[3 * mesh->cell[4 * c + SbFaceVertex[f][(k + a) % 3]] + j];
    for (int j = 0; j < 3; j++)
      reaches = (PetscBool)(reaches && PetscMin(e.x[0][j], e.x[1][j]) <= p->box[3 + j] &&
                            PetscMax(e.x[0][j], e.x[1][j]) >= p->box[j]);
    if (!reaches || !is_before(e.x[0], e.x[1]))
      continue;
    if (to && n % each == 0)
      to[n / each] = e;
    n++;
  }
  return to ? (n + each - 1) / each : n;
}

/* What this rank has of a body, in the arrays of the mesh: tets, and triangles of the surface. */
static PetscErrorCode list_body(SbMesh mesh, PetscInt body, PetscInt *ncell, PetscInt **cell,
                                PetscInt *ntri, PetscInt **tri)
{
  PetscInt n = 0;
  PetscInt m = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(4 * mesh->ncell_owned, cell, 12 * mesh->ncell_owned, tri));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    if (mesh->cell_body[c] != body)
      continue;
    PetscCall(PetscArraycpy(*cell + 4 * n, mesh->cell + 4 * c, 4));
    n++;
    for (int f = 0; f < 4; f++) {
      if (!(mesh->face_set[4 * c + f] & SB_ON_BOUNDARY))
        continue;
      for (int k = 0; k < 3; k++)
        (*tri)[3 * m + k] = mesh->cell[4 * c + SbFaceVertex[f][k]];
      m++;
    }
  }
  *ncell = n;
  *ntri = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distances of points in body b from its surface, negative: not in it, of what this rank has; of
   samples first to last - 1. */
static PetscErrorCode find_depths(SbMesh mesh, const PetscReal x[], PetscInt b, PetscInt first,
                                  PetscInt last, const Sample sample[], PetscReal inside[],
                                  PetscReal distance2[])
{
  PetscInt ncell = 0;
  PetscInt ntri = 0;
  PetscInt *cell, *tri;
  SbBoxTree tree;
  SbLocator locator;

  PetscFunctionBeginUser;
  PetscCall(list_body(mesh, b, &ncell, &cell, &ntri, &tri));
  PetscCall(SbLocatorCreate(ncell, cell, x, NULL, &locator));
  PetscCall(SbBoxTreeCreateTriangles(ntri, tri, x, &tree));
  for (PetscInt i = first; i < last; i++) {
    const PetscReal *p = sample[i].x;
    const PetscReal box[6] = {p[0], p[1], p[2], p[0], p[1], p[2]};
    SbBoxNearest nearest;
    PetscReal w[4];
    PetscInt at;

    inside[i] = SbLocatorFind(locator, p, &at, w) == 0. ? 1. : 0.;
    for (SbBoxNearestBegin(&tree, box, PETSC_MAX_REAL, &nearest);
         SbBoxNearestNext(&nearest, &at);) {
      PetscReal four[4][3];
      SbDistance d;

      PetscCall(PetscArraycpy(four[0], p, 3));
      for (int k = 0; k < 3; k++)
        PetscCall(PetscArraycpy(four[1 + k], x + 3 * tri[3 * at + k], 3));
      SbDistanceFind(SB_PAIR_VERTEX_TRIANGLE, four[0], &d);
      nearest.limit2 = PetscMin(nearest.limit2, PetscSqr(d.d));
    }
    distance2[i] = -nearest.limit2;
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(SbLocatorDestroy(&locator));
  PetscCall(PetscFree2(cell, tri));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where edges first to last - 1 go through facets of body b of this rank: -(the lowest), and the
   highest part of their length; unchanged without one. */
static PetscErrorCode find_crossings(SbMesh mesh, const PetscReal x[], PetscInt b, PetscInt first,
                                     PetscInt last, const Edge edge[], PetscReal low[],
                                     PetscReal high[])
{
  PetscInt ncell = 0;
  PetscInt ntri = 0;
  PetscInt *cell, *tri;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(list_body(mesh, b, &ncell, &cell, &ntri, &tri));
  PetscCall(SbBoxTreeCreateTriangles(ntri, tri, x, &tree));
  for (PetscInt i = first; i < last; i++) {
    const PetscReal *p = edge[i].x[0];
    const PetscReal *q = edge[i].x[1];
    PetscReal box[6];
    SbBoxNearest nearest;
    PetscInt at;

    SbBoxClear(box);
    SbBoxAdd(box, p);
    SbBoxAdd(box, q);
    for (SbBoxNearestBegin(&tree, box, 0, &nearest); SbBoxNearestNext(&nearest, &at);) {
      const PetscReal *const corner[3] = {x + 3 * tri[3 * at], x + 3 * tri[3 * at + 1],
                                          x + 3 * tri[3 * at + 2]};
      PetscReal a[3], c[3], n[3], to_p[3], to_q[3];
      PetscReal above, below;

      if (!SbSegmentMeetsTriangle(p, q, corner))
        continue;
      SbSubtract(corner[1], corner[0], a);
      SbSubtract(corner[2], corner[0], c);
      SbCross(a, c, n);
      SbSubtract(p, corner[0], to_p);
      SbSubtract(q, corner[0], to_q);
      above = SbDot3(n, to_p);
      below = SbDot3(n, to_q);
      if (above == below)
        continue; /* in the plane of the facet */
      low[i] = PetscMax(low[i], -above / (above - below));
      high[i] = PetscMax(high[i], above / (above - below));
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree2(cell, tri));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends to sample[n] the middles between the crossings of edges with the other body of each pair.
   Collective. */
static PetscErrorCode add_crossings(SbMesh mesh, const PetscReal x[], PetscInt npair,
                                    const Pair pair[], PetscInt *n, Sample **sample)
{
  Edge *mine, *edge;
  Sample *all;
  PetscReal *place;
  PetscInt m = 0;
  PetscInt room = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(2 * npair * (SAMPLES + 1), &mine));
  for (PetscInt k = 0; k < 2 * npair; k++) {
    const Pair *p = &pair[k / 2];
    const PetscInt count = list_edges(mesh, x, p, k / 2, k % 2, 1, NULL);

    m += list_edges(mesh, x, p, k / 2, k % 2, 1 + count / SAMPLES, mine + m);
  }
  PetscCall(
    SbAllgatherv(mesh->comm, MPI_BYTE, m * (PetscInt)sizeof(*mine), mine, &room, &edge, NULL));
  PetscCall(PetscFree(mine));
  m = room / (PetscInt)sizeof(*edge);
  PetscCall(SbSortByKeys(m, sizeof(*edge), 2, edge));
  PetscCall(PetscMalloc1(2 * m, &place));
  for (PetscInt i = 0; i < 2 * m; i++)
    place[i] = -2.;
  for (PetscInt i = 0, end; i < m; i = end) {
    for (end = i + 1; end < m && edge[end].pair == edge[i].pair && edge[end].side == edge[i].side;)
      end++;
    PetscCall(find_crossings(mesh, x, pair[edge[i].pair].body[1 - edge[i].side], i, end, edge,
                             place, place + m));
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, place, (PetscMPIInt)(2 * m), MPIU_REAL, MPI_MAX, mesh->comm));

  PetscCall(PetscMalloc1(*n + m, &all));
  PetscCall(PetscArraycpy(all, *sample, *n));
  for (PetscInt i = 0; i < m; i++) {
    const PetscReal middle = 0.5 * (place[m + i] - place[i]);

    if (!(place[m + i] > -place[i]))
      continue;
    all[*n] = (Sample){.pair = edge[i].pair, .side = edge[i].side};
    for (int k = 0; k < 3; k++)
      all[*n].x[k] = edge[i].x[0][k] + middle * (edge[i].x[1][k] - edge[i].x[0][k]);
    ++*n;
  }
  PetscCall(PetscFree(*sample));
  *sample = all;
  PetscCall(PetscFree(place));
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One warning: the pair that overlaps most, and how many more there are. */
static PetscErrorCode warn(SbModel m, const char *when, PetscInt npair, const Pair pair[],
                           PetscInt n, const Sample sample[], const PetscReal depth[],
                           PetscBool *found)
{
  PetscInt worst = -1;
  PetscInt count = 0;
  PetscBool *overlaps;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(npair, &overlaps));
  for (PetscInt i = 0; i < n; i++) {
    if (depth[i] <= pair[sample[i].pair].shallow)
      continue;
    overlaps[sample[i].pair] = PETSC_TRUE;
    if (worst < 0 || depth[i] > depth[worst])
      worst = i;
  }
  for (PetscInt k = 0; k < npair; k++)
    count += overlaps[k];
  PetscCall(PetscFree(overlaps));
  *found = (PetscBool)(count > 0);
  if (count) {
    const Pair *p = &pair[sample[worst].pair];
    const PetscReal *x = sample[worst].x;
    char more[64] = "";

    if (count > 1)
      SbFormat(sizeof(more), more, " (and %" PetscInt_FMT " more pairs of bodies)", count - 1);
    PetscCall(SbWarning(
      m->comm,
      "%s the bodies '%s' and '%s' overlap, %.3g m deep at (%.4g, %.4g, %.4g)%s, and no contact is "
      "named between them: they pass through each other; name an effect of type contact, or move "
      "one of them (-body_%s_translate)",
      when, m->body[p->body[0]].name, m->body[p->body[1]].name, (double)depth[worst], (double)x[0],
      (double)x[1], (double)x[2], more,
      m->body[p->body[1]].copy_of[0] ? m->body[p->body[1]].copy_of : m->body[p->body[1]].name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneWarnOverlap(SbRun run, const char *when, PetscBool *found)
{
  const SbModel m = run->model;
  const SbMesh mesh = m->mesh;
  PetscReal *x, (*box)[6], *inside;
  Pair *pair;
  Sample *mine, *sample;
  PetscInt npair;
  PetscInt n = 0;
  PetscInt room = 0;

  PetscFunctionBeginUser;
  *found = PETSC_FALSE;
  if (m->nbody < 2)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(3 * mesh->nvert, &x, m->nbody, &box));
  PetscCall(SbSpaceVertexPositions(m->space, run->state.U, x));
  PetscCall(find_boxes(mesh, x, box));
  PetscCall(find_pairs(m, (const PetscReal(*)[6])box, &npair, &pair));
  if (npair) {
    // the points of all ranks, by pair and side
    PetscCall(PetscMalloc1(2 * npair * (SAMPLES + 1), &mine));
    for (PetscInt k = 0; k < 2 * npair; k++) {
      const Pair *p = &pair[k / 2];
      const PetscInt all = list_samples(mesh, x, p, k / 2, k % 2, 1, NULL);

      n += list_samples(mesh, x, p, k / 2, k % 2, 1 + all / SAMPLES, mine + n);
    }
    PetscCall(
      SbAllgatherv(m->comm, MPI_BYTE, n * (PetscInt)sizeof(*mine), mine, &room, &sample, NULL));
    PetscCall(PetscFree(mine));
    n = room / (PetscInt)sizeof(*sample);
    PetscCall(add_crossings(mesh, x, npair, pair, &n, &sample));
    PetscCall(SbSortByKeys(n, sizeof(*sample), 2, sample));

    // depth of each in the other body
    PetscCall(PetscMalloc1(2 * n, &inside));
    for (PetscInt i = 0, end; i < n; i = end) {
      for (end = i + 1;
           end < n && sample[end].pair == sample[i].pair && sample[end].side == sample[i].side;)
        end++;
      PetscCall(find_depths(mesh, x, pair[sample[i].pair].body[1 - sample[i].side], i, end, sample,
                            inside, inside + n));
    }
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, inside, (PetscMPIInt)(2 * n), MPIU_REAL, MPI_MAX, m->comm));
    for (PetscInt i = 0; i < n; i++)
      inside[i] = inside[i] > 0. ? PetscSqrtReal(-inside[n + i]) : -1.;
    PetscCall(warn(m, when, npair, pair, n, sample, inside, found));
    PetscCall(PetscFree(inside));
    PetscCall(PetscFree(sample));
  }
  PetscCall(PetscFree(pair));
  PetscCall(PetscFree2(x, box));
  PetscFunctionReturn(PETSC_SUCCESS);
}
