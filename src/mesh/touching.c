/*
  touching.c - boundary facets of a body that lie on each other without being one face: parts of a
  mesh that touch but do not join.

  They come from diagonals that cross on a face of two neighbouring cubes, from vertices on one side
  only (hanging nodes) and from vertices that are there twice. P1 and P2 hold such parts together at
  the vertices they share; CR and DG have their unknowns at faces, and such a body falls apart.

  Two facets lie on each other when their outward normals are opposite, the corners of one are in
  the plane of the other to 1e-6 of their longest edges, and they overlap by more than a thousandth
  of the smaller area. Facets with the same corners on the same side are of parts that the file has
  twice: tets lie in each other, and their mass counts twice. Candidates are pairs of boxes in a
  tree. Curved facets are taken as flat.

  Of a mesh in slabs every rank gets the boundary facets of all, and searches for those that lie on
  its own ones: 96 bytes for each, a hundredth or so of the mesh where that is large.
*/
#include "mesh_impl.h"
#include "sbgeometry.h"

typedef struct {
  PetscReal n[3]; /* outward, its length is twice the area */
  PetscReal area2, longest;
} Facet;

/* A boundary facet, as ranks send it. */
typedef struct {
  PetscReal x[9]; /* its corners, m */
  int64_t number; /* of its tet in the file */
  PetscInt vert[3];
} Record;

/* A cell with a neighbour on another rank, as SbPart.remote counts them, and the part of its rank
   to which it belongs. */
typedef struct {
  PetscInt rank, cell, remote_rank, remote_cell, root;
} Link;

static void facet_of(const PetscReal x[], const PetscInt v[3], Facet *f)
{
  PetscReal a[3], b[3];

  SbSubtract(x + 3 * v[1], x + 3 * v[0], a);
  SbSubtract(x + 3 * v[2], x + 3 * v[0], b);
  SbCross(a, b, f->n);
  f->area2 = PetscSqrtReal(SbDot3(f->n, f->n));
  f->longest = 0;
  for (int k = 0; k < 3; k++)
    f->longest = PetscMax(f->longest, SbDistance2(x + 3 * v[k], x + 3 * v[(k + 1) % 3]));
  f->longest = PetscSqrtReal(f->longest);
}

/* Twice the area that triangle w has in common with triangle v, whose normal is n, both in one
   plane. */
static PetscReal overlap2(const PetscReal x[], const PetscInt v[3], const PetscReal n[3],
                          const PetscInt w[3])
{
  const PetscReal *const of_v[3] = {x + 3 * v[0], x + 3 * v[1], x + 3 * v[2]};
  const PetscReal *const of_w[3] = {x + 3 * w[0], x + 3 * w[1], x + 3 * w[2]};
  PetscReal p[SB_OVER][3];
  PetscReal sum[3] = {0, 0, 0};
  const int count = SbTriangleOver(of_v, n, of_w, p);

  for (int k = 1; k + 1 < count; k++) {
    PetscReal a[3], b[3], c[3];

    SbSubtract(p[k], p[0], a);
    SbSubtract(p[k + 1], p[0], b);
    SbCross(a, b, c);
    for (int i = 0; i < 3; i++)
      sum[i] += c[i];
  }
  return PetscSqrtReal(SbDot3(sum, sum));
}

/* Whether two facets lie on each other, vertices up to `rounding` apart being at one place. */
static PetscBool on_each_other(const PetscReal x[], const PetscInt v[3], const PetscInt w[3],
                               PetscReal rounding)
{
  Facet f, g;
  PetscReal tolerance;

  facet_of(x, v, &f);
  facet_of(x, w, &g);
  if (!(SbDot3(f.n, g.n) < -(1 - 1e-9) * f.area2 * g.area2))
    return PETSC_FALSE;
  tolerance = 1e-6 * PetscMin(f.longest, g.longest) + rounding;
  for (int k = 0; k < 3; k++) {
    PetscReal to[3];

    SbSubtract(x + 3 * w[k], x + 3 * v[0], to);
    if (PetscAbsReal(SbDot3(f.n, to)) > tolerance * f.area2)
      return PETSC_FALSE;
  }
  return (PetscBool)(overlap2(x, v, f.n, w) > 1e-3 * PetscMin(f.area2, g.area2));
}

/* Whether two facets have one centre. */
static PetscBool one_centre(const PetscReal x[], const PetscInt v[3], const PetscInt w[3],
                            PetscReal rounding)
{
  PetscReal d[3] = {0, 0, 0};

  for (int k = 0; k < 9; k++)
    d[k % 3] += (x[3 * v[k / 3] + k % 3] - x[3 * w[k / 3] + k % 3]) / 3;
  return (PetscBool)(SbDot3(d, d) <= PetscSqr(rounding));
}

/* Number of parts that hang together by faces of this rank; parent[ncell]. */
static PetscInt parts_by_faces(const SbFaces *faces, PetscInt parent[])
{
  PetscInt npart = faces->ncell;

  for (PetscInt c = 0; c < faces->ncell; c++)
    parent[c] = c;
  for (PetscInt s = 0; s < 4 * faces->ncell; s++)
    if (faces->neighbour[s] > s / 4 && faces->neighbour[s] < faces->ncell)
      npart -= SbUnionJoin(parent, s / 4, faces->neighbour[s]);
  return npart;
}

static int64_t key_of(PetscInt rank, PetscInt cell)
{
  return (int64_t)rank << 32 | cell;
}

/* The same of all ranks: the parts of each are joined through cells beside each other.
   Collective. */
static PetscErrorCode parts_of_ranks(MPI_Comm comm, PetscInt before, const SbPart *part,
                                     PetscInt *npart)
{
  const SbFaces *faces = &part->faces;
  SbNumbers cells = {0};
  SbNumbers parts = {0};
  PetscInt *parent, *at, *up;
  PetscInt n = 0;
  PetscInt room = 0;
  Link *mine, *all;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(PetscMalloc2(faces->ncell, &parent, part->nremote, &mine));
  *npart = parts_by_faces(faces, parent);
  for (PetscInt s = 0; s < 4 * faces->ncell; s++) {
    const PetscInt r = faces->neighbour[s] - faces->ncell;

    if (r >= 0)
      mine[n++] = (Link){rank, before + s / 4, (PetscInt)part->remote[r].rank,
                         part->remote[r].index, before + SbUnionRoot(parent, s / 4)};
  }
  PetscCall(SbAllgatherv(comm, MPI_BYTE, n * (PetscInt)sizeof(*mine), mine, &room, &all, NULL));
  PetscCall(PetscFree2(parent, mine));
  n = room / (PetscInt)sizeof(*all);

  // parts of ranks that have such cells, and the part of each cell
  PetscCall(PetscMalloc2(n, &at, n, &up));
  for (PetscInt i = 0; i < n; i++) {
    const int64_t root = key_of(all[i].rank, all[i].root);

    at[i] = SbNumbersFind(&parts, root);
    if (at[i] < 0) {
      at[i] = parts.n;
      up[at[i]] = at[i];
      PetscCall(SbNumbersAdd(&parts, root));
    }
    PetscCall(SbNumbersAdd(&cells, key_of(all[i].rank, all[i].cell)));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, npart, 1, MPIU_INT, MPI_SUM, comm));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt j = SbNumbersFind(&cells, key_of(all[i].remote_rank, all[i].remote_cell));

    if (j >= 0)
      *npart -= SbUnionJoin(up, at[i], at[j]);
  }
  PetscCall(PetscFree2(at, up));
  PetscCall(PetscFree(cells.number));
  PetscCall(PetscFree(cells.slot));
  PetscCall(PetscFree(parts.number));
  PetscCall(PetscFree(parts.slot));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The boundary facets of this rank; number[nvert]: file numbers of its vertices, NULL: 0, 1, ... */
static void list_facets(const SbImport *im, const SbFaces *faces, const PetscInt number[],
                        Record facet[])
{
  PetscInt n = 0;

  for (PetscInt s = 0; s < 4 * faces->ncell; s++) {
    if (faces->neighbour[s] >= 0)
      continue;
    facet[n].number = im->item[3].number[s / 4];
    for (int k = 0; k < 3; k++) {
      const PetscInt v = im->item[3].vert[4 * (s / 4) + SbFaceVertex[s % 4][k]];

      facet[n].vert[k] = number ? number[v] : v;
      for (int i = 0; i < 3; i++)
        facet[n].x[3 * k + i] = im->x[3 * v + i];
    }
    n++;
  }
}

/* Counts pairs of facets i < j of which i is one of first to last - 1; lowest: i n + j of the first
   of them, -1: there is none. */
static PetscErrorCode find_pairs(PetscInt n, const Record facet[], PetscInt first, PetscInt last,
                                 SbTouching *t, PetscInt64 *lowest)
{
  const PetscBool all = (PetscBool)(last - first == n);
  SbBoxTree tree = {0};
  SbBoxTree own = {0};
  SbBoxPairs pairs;
  PetscReal *x, rounding;
  PetscInt *vert, pair[128];
  PetscInt m;

  PetscFunctionBeginUser;
  *lowest = -1;
  PetscCall(PetscMalloc2(9 * (size_t)n, &x, 3 * (size_t)n, &vert));
  for (PetscInt f = 0; f < n; f++)
    PetscCall(PetscArraycpy(x + 9 * (size_t)f, facet[f].x, 9));
  for (PetscInt i = 0; i < 3 * n; i++)
    vert[i] = i;
  PetscCall(SbBoxTreeCreateTriangles(n, vert, x, &tree));
  if (!all)
    PetscCall(SbBoxTreeCreateTriangles(last - first, vert + 3 * first, x, &own));
  rounding = 1e-9 * SbBoxDiagonal(tree.hull); // the tolerance of supple-mesh repair
  SbBoxPairsBegin(all ? &tree : &own, &tree, rounding, &pairs);
  while ((m = SbBoxPairsNext(&pairs, 64, pair)) > 0) {
    for (PetscInt k = 0; k < m; k++) {
      PetscInt i = pair[2 * k] + first;
      PetscInt j = pair[2 * k + 1];
      int nequal = 0;
      int nshared = 0;
      PetscBool opposite;

      // with one tree in either order; with two the pair belongs to the rank of its lower facet
      if (all && i > j) {
        i = pair[2 * k + 1];
        j = pair[2 * k];
      }
      if (i >= j)
        continue;
      opposite = on_each_other(x, vert + 3 * i, vert + 3 * j, rounding);
      if (!opposite && !one_centre(x, vert + 3 * i, vert + 3 * j, rounding))
        continue;

      // corners at one position, of which some are two vertices
      for (int a = 0; a < 9; a++) {
        nequal +=
          SbDistance2(facet[i].x + 3 * (a / 3), facet[j].x + 3 * (a % 3)) <= PetscSqr(rounding);
        nshared += facet[i].vert[a / 3] == facet[j].vert[a % 3];
      }
      if (!opposite && nequal != 3)
        continue;
      t->n++;
      t->ndoubled += opposite && nequal == 3 && nshared < 3;
      t->ntwice += !opposite;
      if (*lowest < 0 || (PetscInt64)i * n + j < *lowest)
        *lowest = (PetscInt64)i * n + j;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(SbBoxTreeDestroy(&own));
  PetscCall(PetscFree2(x, vert));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tets and place of the first pair of n facets. */
static void tell_first(PetscInt n, const Record facet[], PetscInt64 lowest, SbTouching *t)
{
  const Record *f = &facet[lowest / n];

  t->number[0] = f->number;
  t->number[1] = facet[lowest % n].number;
  for (int k = 0; k < 3; k++)
    t->at[k] = (f->x[k] + f->x[3 + k] + f->x[6 + k]) / 3;
}

PetscErrorCode SbImportTouching(const SbImport *im, const SbFaces *faces, SbTouching *t)
{
  PetscInt *parent;
  PetscInt64 lowest;
  Record *facet;

  PetscFunctionBeginUser;
  *t = (SbTouching){.n = 0};
  PetscCall(PetscMalloc2(faces->nboundary, &facet, faces->ncell, &parent));
  list_facets(im, faces, NULL, facet);
  PetscCall(find_pairs(faces->nboundary, facet, 0, faces->nboundary, t, &lowest));
  if (t->n) {
    tell_first(faces->nboundary, facet, lowest, t);
    t->npart = parts_by_faces(faces, parent);
  }
  PetscCall(PetscFree2(facet, parent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSlabTouching(MPI_Comm comm, PetscInt before, const SbImport *im,
                              const SbPart *part, const PetscInt number[], SbTouching *t)
{
  const PetscInt nown = part->faces.nboundary;
  PetscInt n = 0;
  PetscInt first = 0;
  PetscInt count[3];
  PetscInt64 lowest;
  Record *mine, *all;
  MPI_Datatype type;

  PetscFunctionBeginUser;
  *t = (SbTouching){.n = 0};
  PetscCall(PetscMalloc1(nown, &mine));
  list_facets(im, &part->faces, number, mine);
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(*mine), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(SbAllgatherv(comm, type, nown, mine, &n, &all, &first));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(mine));
  PetscCall(find_pairs(n, all, first, first + nown, t, &lowest));
  count[0] = t->n;
  count[1] = t->ndoubled;
  count[2] = t->ntwice;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, comm));
  t->n = count[0];
  t->ndoubled = count[1];
  t->ntwice = count[2];
  lowest = lowest < 0 ? INT64_MAX : lowest;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPIU_INT64, MPI_MIN, comm));
  if (t->n) {
    tell_first(n, all, lowest, t);
    PetscCall(parts_of_ranks(comm, before, part, &t->npart));
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbTouchingText(const SbTouching *t, const char *file, size_t size, char text[])
{
  SbFormat(size, text,
           "pairs of facets that lie on each other without joining: %" PetscInt_FMT "%s"
           " (the first: of tetrahedra %lld and %lld, at (%.6g, %.6g, %.6g) m)",
           t->n, t->ntwice ? ", some on the same side, of tets in each other" : "",
           (long long)t->number[0], (long long)t->number[1], (double)t->at[0], (double)t->at[1],
           (double)t->at[2]);
  if (!file)
    return;
  if (t->ntwice)
    SbAppend(size, text,
             "; parts are there twice, and their mass counts twice: supple-mesh repair %s OUT "
             "drops the second ones",
             file);
  else if (t->ndoubled == t->n)
    SbAppend(size, text,
             "; vertices are there twice: join them by supple-mesh repair %s OUT, or let "
             "contact act between them",
             file);
  else
    SbAppend(size, text,
             "; both sides need the same triangles: mesh the parts as one (gmsh: "
             "BooleanFragments, Coherence), or as bodies of their own with contact");
}

PetscErrorCode SbTouchingReport(MPI_Comm comm, const SbTouching *t, const char *where,
                                const SbBody *body)
{
  char text[1024];

  PetscFunctionBeginUser;
  if (!t->n)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbTouchingText(t, body->mesh, sizeof(text), text);
  PetscCheck(t->npart <= body->npart ||
               (strcmp(body->element, "cr") && strcmp(body->element, "dg")),
             comm, PETSC_ERR_USER_INPUT,
             "%s: with the element %s, whose unknowns are at faces, the body falls apart into "
             "%" PetscInt_FMT " parts; %s",
             where, body->element, t->npart, text);
  PetscCall(SbWarning(comm, "%s: %s", where, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportCheckTouching(const SbImport *im, const SbFaces *faces, SbBody *body)
{
  SbTouching t;

  PetscFunctionBeginUser;
  PetscCall(SbImportTouching(im, faces, &t));
  PetscCall(SbTouchingReport(PETSC_COMM_SELF, &t, im->where, body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
