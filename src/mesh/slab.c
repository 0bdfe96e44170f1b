/*
  slab.c - parallel import of one body: each rank reads a slab, that is a block of the file's tets
  and one of its vertices.

  Rendezvous algorithm: vertices are assigned to home ranks by blocks of their numbers. The home
  rank of a vertex has its position and knows the ranks whose tets use it; there unused vertices are
  found and vertex data of several ranks is combined. A face between tets of two ranks is matched at
  the home rank of its lowest vertex; so are the edges of the surface. A group triangle or a curved
  edge goes to the home rank of its lowest vertex and from there to all ranks that use this vertex,
  one of which has the tet. Connected parts are found by the lowest number of a vertex that reaches
  all of theirs, through the parts on each rank and the vertices that ranks share.

  Memory per rank is proportional to the size of its slab, apart from 4 bytes for each vertex number
  between the lowest and the highest one of its tets. The result is the same as that of a serial
  import (merge.c) on any number of ranks; volumes may differ by rounding.
*/
#include "mesh_impl.h"

typedef struct {
  MPI_Comm comm;
  PetscMPIInt rank, size;
  SbImport *im;
  SbPart *part;
  SbSlabRows rows; /* block of vertices for which this rank is the home */
  PetscInt nkept;
  PetscReal *x;      /* [nkept][3] position, m */
  PetscInt *number;  /* [nkept] original number, -1: unused by tets */
  uint64_t *mask;    /* [nkept] sets of each vertex */
  PetscSF vert;      /* from vertices at their home ranks to those of this rank's tets */
  PetscInt *used;    /* [im->nvert] file numbers of these vertices, ascending */
  PetscInt *start;   /* [nkept + 1] offsets into user[] */
  PetscMPIInt *user; /* [start[nkept]] ranks that use a vertex */
  PetscInt *nuser;   /* [im->nvert] number of ranks that use the vertex */
} Slab;

static inline PetscMPIInt home(const Slab *s, PetscInt vert)
{
  return (PetscMPIInt)(vert / s->rows.block);
}

static PetscErrorCode sum(const Slab *s, PetscInt n, PetscInt value[])
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, (PetscMPIInt)n, MPIU_INT, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Record i begins with a vertex. */
static inline PetscInt first_vertex(const void *record, size_t unit, PetscInt i)
{
  return *(const PetscInt *)(const void *)((const char *)record + unit * (size_t)i);
}

/* Sends records of `unit` bytes to the home ranks of the vertices with which they begin. */
static PetscErrorCode send_home(const Slab *s, PetscInt n, size_t unit, const void *record,
                                SbRoute *route, void *received)
{
  PetscMPIInt *dest;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, &dest));
  for (PetscInt i = 0; i < n; i++)
    dest[i] = home(s, first_vertex(record, unit, i));
  PetscCall(SbRouteCreate(s->comm, n, NULL, dest, route));
  PetscCall(SbRouteSend(route, unit, NULL, record, received));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions and original numbers of the vertices of this rank's tets; ranks that use each of its
   block. */
static PetscErrorCode ask_home_ranks(Slab *s)
{
  SbImport *im = s->im;
  const PetscInt *nuser;
  PetscInt n = 0;
  PetscInt before;

  PetscFunctionBeginUser;
  PetscCall(SbForestCreate(s->comm, s->nkept, im->nvert, s->used, &s->vert));
  PetscCall(SbForestRanks(s->vert, &s->start, &s->user));
  PetscCall(PetscSFComputeDegreeBegin(s->vert, &nuser));
  PetscCall(PetscSFComputeDegreeEnd(s->vert, &nuser));

  // original numbers of used vertices
  for (PetscInt v = 0; v < s->nkept; v++)
    n += nuser[v] > 0;
  PetscCallMPI(MPI_Scan(&n, &before, 1, MPIU_INT, MPI_SUM, s->comm));
  before -= n;
  im->nunused = s->nkept - n;
  PetscCall(PetscCalloc2(s->nkept, &s->number, s->nkept, &s->mask));
  for (PetscInt v = 0; v < s->nkept; v++)
    s->number[v] = nuser[v] > 0 ? before++ : -1;

  // vertex arrays of this rank
  PetscCall(SbImportSetVertices(im, im->nvert));
  for (PetscInt v = 0; v < im->nvert; v++)
    im->vert_number[v] = s->used[v] + 1;
  PetscCall(PetscMalloc1(im->nvert, &s->part->orig));
  PetscCall(SbForestBroadcast(s->vert, 3, MPIU_REAL, s->x, im->x));
  PetscCall(SbForestBroadcast(s->vert, 1, MPIU_INT, s->number, s->part->orig));
  PetscCall(SbForestBroadcast(s->vert, 1, MPIU_INT, nuser, s->nuser));
  PetscCall(PetscFree(s->x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A face that may be between tets of two ranks, and the tet across it. */
typedef struct {
  PetscInt vert[3], at; /* ascending; slot at the sender, position in the received array */
  PetscInt rank, cell;  /* as in SbPart.remote: index here plus the cells of earlier bodies */
  int64_t number;       /* file number of the tet */
} Face;
typedef struct {
  PetscInt rank, cell;
  int64_t number;
} Across;

/* Finds pairs of equal faces among those received, and the cell across each face. */
static PetscErrorCode match_faces(const Slab *s, const SbRoute *route, Face face[], Across across[])
{
  PetscInt nshared = 0;
  PetscInt first = -1;
  PetscInt m;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < route->nrecv; i++) {
    face[i].at = i;
    across[i] = (Across){-1, -1, 0};
  }
  PetscCall(SbSortByKeys(route->nrecv, sizeof(*face), 4, face));
  for (PetscInt i = 0; i < route->nrecv; i += m) {
    const Face *f = face + i;

    for (m = 1; i + m < route->nrecv && !memcmp(f->vert, f[m].vert, sizeof(f->vert));)
      m++;
    if (m == 2)
      for (int k = 0; k < 2; k++)
        across[f[k].at] = (Across){f[1 - k].rank, f[1 - k].cell, f[1 - k].number};
    else if (m > 2 && !nshared++)
      first = i;
  }
  if (nshared)
    PetscCall(SbImportOverlap(
      s->im, (const int64_t[3]){face[first].number, face[first + 1].number, face[first + 2].number},
      nshared));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes cells of other ranks neighbours; one that is across all four faces is a duplicate tet. */
static PetscErrorCode link_faces(Slab *s, PetscInt nsend, const Face face[], const Across across[])
{
  SbFaces *faces = &s->part->faces;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(nsend, &s->part->remote));
  for (PetscInt i = 0; i < nsend; i++) {
    if (across[i].rank < 0 || across[i].rank == s->rank)
      continue;
    faces->neighbour[face[i].at] = s->im->item[3].n + n;
    s->part->remote[n++] = (PetscSFNode){across[i].rank, across[i].cell};
    faces->nboundary--;
  }
  s->part->nremote = n;
  for (PetscInt i = 3; i < nsend; i++) {
    if (face[i].at != face[i - 3].at + 3 || face[i].at % 4 != 3)
      continue;
    if (across[i].rank < 0 || across[i].rank == s->rank)
      continue;
    if (across[i].number == across[i - 1].number && across[i].number == across[i - 2].number &&
        across[i].number == across[i - 3].number)
      PetscCall(SbImportTwice(s->im, s->im->item[3].number[face[i].at / 4], across[i].number));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Matches all faces with three shared vertices, also those of two local tets, to find a third
   one. */
static PetscErrorCode join_faces(Slab *s, PetscInt before)
{
  const SbItems *tets = &s->im->item[3];
  SbCaughtError caught = {0, ""};
  PetscInt n = 0;
  PetscInt room = 0;
  SbRoute route;
  Face *face = NULL;
  Face *got;
  Across *across, *result;

  PetscFunctionBeginUser;

  // faces with three shared vertices, sent to the home rank of the lowest one
  for (PetscInt i = 0; i < 4 * tets->n; i++) {
    PetscInt v[3];
    PetscBool all = PETSC_TRUE;

    for (int k = 0; k < 3; k++) {
      v[k] = tets->vert[4 * (i / 4) + SbFaceVertex[i % 4][k]];
      all = (PetscBool)(all && s->nuser[v[k]] > 1);
    }
    if (!all)
      continue;
    PetscCall(PetscSortInt(3, v));
    PetscCall(SbReserve(n + 1, sizeof(*face), &room, &face));
    face[n++] = (Face){{s->used[v[0]], s->used[v[1]], s->used[v[2]]},
                       i,
                       s->rank,
                       before + i / 4,
                       tets->number[i / 4]};
  }

  // home ranks match the faces and reply with the cell across
  PetscCall(send_home(s, n, sizeof(Face), face, &route, &got));
  PetscCall(PetscMalloc2(route.nrecv, &across, n, &result));
  SB_CATCH(&caught, match_faces(s, &route, got, across));
  PetscCall(SbRouteReply(&route, sizeof(Across), across, result));
  if (!caught.code)
    SB_CATCH(&caught, link_faces(s, n, face, result));

  // an error of one rank is raised on all ranks
  PetscCall(PetscFree(got));
  PetscCall(PetscFree2(across, result));
  PetscCall(PetscFree(face));
  PetscCall(SbRouteDestroy(&route));
  PetscCall(SbCaughtRaise(s->comm, &caught));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of connected parts of the body: each gets the lowest number of its vertices. */
static PetscErrorCode count_parts(const Slab *s, PetscInt *npart)
{
  const PetscInt n = s->im->nvert;
  PetscInt *part, *label, *got, *lowest, changed;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(n, &part, n, &label, n, &got, s->nkept, &lowest));
  SbImportJoin(s->im, part, npart);
  for (PetscInt v = 0; v < n; v++)
    label[v] = s->part->orig[part[v]];
  do {
    // over the ranks at the home ranks, then over the vertices of each part on this rank
    for (PetscInt v = 0; v < s->nkept; v++)
      lowest[v] = PETSC_MAX_INT;
    PetscCall(PetscSFReduceBegin(s->vert, MPIU_INT, label, lowest, MPI_MIN));
    PetscCall(PetscSFReduceEnd(s->vert, MPIU_INT, label, lowest, MPI_MIN));
    PetscCall(SbForestBroadcast(s->vert, 1, MPIU_INT, lowest, got));
    changed = 0;
    for (PetscInt v = 0; v < n; v++) {
      changed |= got[v] < label[part[v]];
      label[part[v]] = PetscMin(label[part[v]], got[v]);
    }
    for (PetscInt v = 0; v < n; v++)
      label[v] = label[part[v]];
    PetscCall(sum(s, 1, &changed));
  } while (changed);
  *npart = 0;
  for (PetscInt v = 0; v < s->nkept; v++)
    *npart += s->number[v] >= 0 && lowest[v] == s->number[v];
  PetscCall(sum(s, 1, npart));
  PetscCall(PetscFree4(part, label, got, lowest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds set bits of items to the masks of their vertices at the home ranks, unless one of these is
   unused. */
static PetscErrorCode mark_items(Slab *s, const uint64_t bits[])
{
  SbImport *im = s->im;
  PetscSF forest;
  uint64_t *mark;
  PetscInt n = 0;
  PetscInt *vert, *number;

  PetscFunctionBeginUser;

  // vertices of all items
  for (int d = 0; d < 3; d++)
    n += (d + 1) * im->item[d].n;
  PetscCall(PetscMalloc3(n, &vert, n, &mark, n, &number));
  n = 0;
  for (int d = 0; d < 3; d++)
    for (PetscInt i = 0; i < (d + 1) * im->item[d].n; i++)
      vert[n++] = im->item[d].vert[i];

  // their numbers, from the home ranks: -1 if no tet uses them
  PetscCall(SbForestCreate(s->comm, s->nkept, n, vert, &forest));
  PetscCall(SbForestBroadcast(forest, 1, MPIU_INT, s->number, number));

  // mark the vertices of items whose vertices are all used; then drop points and lines
  n = 0;
  for (int d = 0; d < 3; d++) {
    for (PetscInt i = 0; i < im->item[d].n; i++) {
      PetscBool all = PETSC_TRUE;

      for (int k = 0; k <= d; k++)
        all = (PetscBool)(all && number[n + k] >= 0);
      for (int k = 0; k <= d; k++)
        mark[n++] = all ? bits[im->item[d].tags[i]] : 0;
    }
    if (d < 2)
      im->item[d].n = 0;
  }

  // combine the marks of all ranks at the home ranks
  PetscCall(PetscSFReduceBegin(forest, MPI_UINT64_T, mark, s->mask, MPI_BOR));
  PetscCall(PetscSFReduceEnd(forest, MPI_UINT64_T, mark, s->mask, MPI_BOR));
  PetscCall(PetscSFDestroy(&forest));
  PetscCall(PetscFree3(vert, mark, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A triangle of a group, or an edge with its node off the middle. */
typedef struct {
  PetscInt vert[3], tags; /* vertices ascending; tag set, -1: an edge */
  SbMiddle middle;
} Item;

/* Sends group triangles and curved edges to the home ranks of their lowest vertices, and from there
   to all ranks that use these; the ranks whose tets have them keep them. */
static PetscErrorCode find_items(Slab *s)
{
  SbImport *im = s->im;
  SbItems *tri = &im->item[2];
  const PetscInt ntri = tri->n;
  const PetscInt nmine = ntri + im->nmiddle.n;
  SbCaughtError caught = {0, ""};
  SbRouteList list = {0};
  SbRoute there, on;
  Item *mine, *got, *in;
  PetscInt total = im->nmiddle.n;
  PetscInt slots[2];
  PetscBool *found, *answered, *any, *anywhere;
  PetscReal largest = 0;

  PetscFunctionBeginUser;
  PetscCall(sum(s, 1, &total));
  PetscCall(PetscMalloc1(nmine, &mine));
  for (PetscInt i = 0; i < ntri; i++) {
    const PetscInt *v = tri->vert + 3 * (size_t)i;

    mine[i] = (Item){{v[0], v[1], v[2]}, tri->tags[i], {.node = -1}};
    PetscCall(PetscSortInt(3, mine[i].vert));
  }
  for (PetscInt i = ntri; i < nmine; i++) {
    const SbMiddle *m = &im->middle[i - ntri];

    mine[i] = (Item){{m->end[0], m->end[1], 0}, -1, *m};
  }
  PetscCall(send_home(s, nmine, sizeof(*mine), mine, &there, &got));
  for (PetscInt i = 0; i < there.nrecv; i++) {
    const PetscInt v = got[i].vert[0] - s->rows.first;

    for (PetscInt k = s->start[v]; k < s->start[v + 1]; k++)
      PetscCall(SbRouteAdd(&list, i, s->user[k]));
  }
  PetscCall(SbRouteCreate(s->comm, list.n, list.item, list.rank, &on));
  PetscCall(SbRouteSend(&on, sizeof(*got), on.which, got, &in));

  // edges of this rank's tets; triangles take part without ends
  PetscCall(
    PetscCalloc4(on.nrecv, &found, on.nsend, &answered, there.nrecv, &any, nmine, &anywhere));
  PetscCall(PetscFree(im->middle));
  PetscCall(PetscMalloc1(on.nrecv, &im->middle));
  im->nmiddle = (SbCount){total ? on.nrecv : 0, on.nrecv};
  for (PetscInt i = 0; i < on.nrecv; i++) {
    const int n = in[i].tags < 0 ? 2 : 3;

    for (int k = 0; k < n; k++)
      PetscCall(
        PetscFindInt(in[i].vert[k], im->nvert, s->used, &in[i].vert[k])); /* below 0: not here */
    im->middle[i] = in[i].middle;
    for (int k = 0; k < 2; k++)
      im->middle[i].end[k] = n == 2 ? in[i].vert[k] : -1;
  }
  SB_CATCH(&caught, SbImportMiddles(im, found, &largest));

  // triangles that are faces of this rank's tets
  tri->n = 0;
  for (PetscInt i = 0; i < on.nrecv; i++) {
    const PetscInt *v = in[i].vert;

    if (in[i].tags < 0)
      continue;
    found[i] =
      (PetscBool)(v[0] >= 0 && v[1] >= 0 && v[2] >= 0 && SbFacesFind(&s->part->faces, v, slots));
    if (found[i])
      PetscCall(SbImportAddItem(im, 2, v, in[i].tags, 0));
  }

  // whether some rank has found each; an edge in the file that no tet has is an error
  PetscCall(SbRouteReply(&on, sizeof(PetscBool), found, answered));
  for (PetscInt i = 0; i < on.nsend; i++)
    any[on.which[i]] |= answered[i];
  PetscCall(SbRouteReply(&there, sizeof(PetscBool), any, anywhere));
  for (PetscInt i = 0; i < nmine; i++) {
    im->nlost += i < ntri && !anywhere[i];
    if (i >= ntri && !anywhere[i] && !caught.code)
      SB_CATCH(&caught, SbImportLostMiddle(im, &mine[i].middle));
  }
  PetscCall(PetscFree4(found, answered, any, anywhere));
  PetscCall(PetscFree(mine));
  PetscCall(PetscFree(got));
  PetscCall(PetscFree(in));
  PetscCall(SbRouteDestroy(&on));
  PetscCall(SbRouteDestroy(&there));
  PetscCall(SbCaughtRaise(s->comm, &caught));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPI_MAX, s->comm));
  SbImportNoteMiddles(im, total, largest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode prepare(Slab *s, PetscInt before, PetscInt nbody, SbBody body[], PetscInt b,
                              PetscInt nset, SbSet set[])
{
  SbImport *im = s->im;
  SbCaughtError caught = {0, ""};
  PetscReal largest;
  SbItems *tets = &im->item[3];
  PetscInt low = PETSC_MAX_INT;
  PetscInt high = -1;
  PetscInt n = 0;
  PetscInt *map;
  PetscInt64 *edge, *got;
  SbMasks *m = &s->part->masks;
  uint64_t *bits;
  PetscMPIInt *dest;
  SbRoute route;
  SbTouching touching;

  PetscFunctionBeginUser;
  SB_CATCH(&caught, SbImportSlab(&body[b], s->rank, s->size, im, &s->rows));
  PetscCall(SbCaughtRaise(s->comm, &caught));
  s->part->first = tets->n ? (PetscInt)tets->number[0] - 1 : 0;

  // vertices used by this rank's tets, ascending; renumber the tets
  for (PetscInt i = 0; i < 4 * tets->n; i++) {
    low = PetscMin(low, tets->vert[i]);
    high = PetscMax(high, tets->vert[i]);
  }
  PetscCall(PetscCalloc1(PetscMax(0, high - low + 1), &map));
  for (PetscInt i = 0; i < 4 * tets->n; i++) {
    n += !map[tets->vert[i] - low];
    map[tets->vert[i] - low] = 1;
  }
  PetscCall(PetscMalloc2(n, &s->used, n, &s->nuser));
  n = 0;
  for (PetscInt v = low; v <= high; v++) {
    if (!map[v - low])
      continue;
    s->used[n] = v;
    map[v - low] = n++;
  }
  for (PetscInt i = 0; i < 4 * tets->n; i++)
    tets->vert[i] = map[tets->vert[i] - low];
  PetscCall(PetscFree(map));

  /* the vertices that were read are this rank's block */
  s->nkept = im->nvert;
  s->x = im->x;
  im->x = NULL;
  PetscCall(PetscFree(im->vert_number));
  im->nvert = n;
  PetscCall(ask_home_ranks(s));
  largest = SbImportLargest(im);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPI_MAX, s->comm));
  SB_CATCH(&caught, SbImportCheckCells(im, largest, &s->part->faces));
  PetscCall(SbCaughtRaise(s->comm, &caught));
  PetscCall(join_faces(s, before));
  PetscCall(sum(s, 1, &im->nunused));
  PetscCall(sum(s, 1, &im->nreoriented));
  PetscCall(SbImportMeasure(s->comm, im, &s->part->faces, &body[b]));
  body[b].nvert = s->rows.N - im->nunused;
  PetscCall(count_parts(s, &body[b].npart));
  PetscCall(SbSlabTouching(s->comm, before, im, s->part, s->used, &touching));
  PetscCall(SbTouchingReport(s->comm, &touching, im->where, &body[b]));

  // surface edges with more than two facets; the home rank of the lower vertex has all facets of an
  // edge
  n = 3 * s->part->faces.nboundary;
  PetscCall(PetscMalloc1(n, &edge));
  PetscCall(PetscMalloc1(n, &dest));
  SbBoundaryEdges(im, &s->part->faces, s->used, edge);
  for (PetscInt i = 0; i < n; i++)
    dest[i] = home(s, (PetscInt)(edge[i] >> 32));
  PetscCall(SbRouteCreate(s->comm, n, NULL, dest, &route));
  PetscCall(SbRouteSend(&route, sizeof(*edge), NULL, edge, &got));
  PetscCall(PetscFree(edge));
  PetscCall(SbCountPinched(route.nrecv, got, &im->npinched));
  PetscCall(PetscFree(got));
  PetscCall(SbRouteDestroy(&route));

  // members of sets: groups of points, lines and triangles, then shapes and groups of tets
  PetscCall(PetscMalloc1(im->ntags, &bits));
  SbSetsBits(im, nbody, body, b, nset, set, bits);
  PetscCall(mark_items(s, bits));
  PetscCall(PetscFree(bits));
  PetscCall(find_items(s));
  PetscCall(SbSetsMark(im, &s->part->faces, nbody, body, b, nset, set, m));

  // combine the set bits of shared vertices over all ranks; count vertices at their home ranks
  PetscCall(PetscSFReduceBegin(s->vert, MPI_UINT64_T, m->vert, s->mask, MPI_BOR));
  PetscCall(PetscSFReduceEnd(s->vert, MPI_UINT64_T, m->vert, s->mask, MPI_BOR));
  PetscCall(SbForestBroadcast(s->vert, 1, MPI_UINT64_T, s->mask, m->vert));
  PetscCall(
    SbSetsCount(s->comm, s->nkept, tets->n, &(SbMasks){s->mask, m->cell, m->face}, nset, set));
  PetscCall(sum(s, 1, &im->npinched));
  PetscCall(sum(s, 1, &im->nlost));
  SbImportNote(im, &body[b]);
  PetscCall(SbImportCurve(s->comm, im, &body[b], m->cell, &s->part->edge_off));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSlabPrepare(MPI_Comm comm, PetscInt before, PetscInt nbody, SbBody body[],
                             PetscInt b, PetscInt nset, SbSet set[], SbImport *im, SbPart *part)
{
  Slab s = {.comm = comm, .im = im, .part = part};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &s.rank));
  PetscCallMPI(MPI_Comm_size(comm, &s.size));
  ierr = prepare(&s, before, nbody, body, b, nset, set);
  PetscCall(PetscFree(s.x));
  PetscCall(PetscFree2(s.number, s.mask));
  PetscCall(PetscSFDestroy(&s.vert));
  PetscCall(PetscFree2(s.used, s.nuser));
  PetscCall(PetscFree(s.start));
  PetscCall(PetscFree(s.user));
  PetscFunctionReturn(ierr);
}
