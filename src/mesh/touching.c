/*
  touching.c - boundary facets of a body that lie on each other without being one face: parts of a
  mesh that touch but do not join.

  They come from diagonals that cross on a face of two neighbouring cubes, from vertices on one side
  only (hanging nodes) and from vertices that are there twice. P1 and P2 hold such parts together at
  the vertices they share; CR and DG have their unknowns at faces, and such a body falls apart.

  Two facets lie on each other when their outward normals are opposite, the corners of one are in
  the plane of the other to 1e-6 of their longest edges, and they overlap by more than a thousandth
  of the smaller area. Candidates are pairs of boxes in a tree. Curved facets are taken as flat.
*/
#include "mesh_impl.h"
#include "sbgeometry.h"

typedef struct {
  PetscReal n[3]; /* outward, its length is twice the area */
  PetscReal area2, longest;
} Facet;

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
   plane: w is cut by the three sides of v (Sutherland and Hodgman, 1974). */
static PetscReal overlap2(const PetscReal x[], const PetscInt v[3], const PetscReal n[3],
                          const PetscInt w[3])
{
  PetscReal p[2][8][3];
  PetscReal sum[3] = {0, 0, 0};
  int count = 3;
  int from = 0;

  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 3; i++)
      p[0][k][i] = x[3 * w[k] + i];
  for (int side = 0; side < 3; side++, from = !from) {
    const PetscReal *a = x + 3 * v[side];
    PetscReal edge[3], inwards[3];
    int kept = 0;

    SbSubtract(x + 3 * v[(side + 1) % 3], a, edge);
    SbCross(n, edge, inwards);
    for (int k = 0; k < count; k++) {
      const PetscReal *q = p[from][k];
      const PetscReal *r = p[from][(k + 1) % count];
      PetscReal to_q[3], to_r[3], in_q, in_r;

      SbSubtract(q, a, to_q);
      SbSubtract(r, a, to_r);
      in_q = SbDot3(inwards, to_q);
      in_r = SbDot3(inwards, to_r);
      for (int i = 0; in_q >= 0 && i < 3; i++)
        p[!from][kept][i] = q[i];
      kept += in_q >= 0;
      for (int i = 0; (in_q >= 0) != (in_r >= 0) && i < 3; i++)
        p[!from][kept][i] = q[i] + in_q / (in_q - in_r) * (r[i] - q[i]);
      kept += (in_q >= 0) != (in_r >= 0);
    }
    count = kept;
  }
  for (int k = 1; k + 1 < count; k++) {
    PetscReal a[3], b[3], c[3];

    SbSubtract(p[from][k], p[from][0], a);
    SbSubtract(p[from][k + 1], p[from][0], b);
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

/* Number of parts that hang together by faces. */
static PetscErrorCode parts_by_faces(const SbFaces *faces, PetscInt *npart)
{
  PetscInt *parent;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(faces->ncell, &parent));
  for (PetscInt c = 0; c < faces->ncell; c++)
    parent[c] = c;
  *npart = faces->ncell;
  for (PetscInt s = 0; s < 4 * faces->ncell; s++)
    if (faces->neighbour[s] > s / 4)
      *npart -= SbUnionJoin(parent, s / 4, faces->neighbour[s]);
  PetscCall(PetscFree(parent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportTouching(const SbImport *im, const SbFaces *faces, SbTouching *t)
{
  PetscReal rounding;
  SbBoxTree tree = {0};
  SbBoxPairs pairs;
  PetscInt *vert, *cell, pair[128];
  PetscInt n = 0;
  PetscInt m;

  PetscFunctionBeginUser;
  *t = (SbTouching){.n = 0};
  PetscCall(PetscMalloc2(3 * (size_t)faces->nboundary, &vert, faces->nboundary, &cell));
  for (PetscInt s = 0; s < 4 * faces->ncell; s++) {
    if (faces->neighbour[s] >= 0)
      continue;
    for (int k = 0; k < 3; k++)
      vert[3 * n + k] = im->item[3].vert[4 * (s / 4) + SbFaceVertex[s % 4][k]];
    cell[n++] = s / 4;
  }
  PetscCall(SbBoxTreeCreateTriangles(n, vert, im->x, &tree));
  rounding = 1e-9 * SbBoxDiagonal(tree.hull); // the tolerance of supple-mesh repair
  SbBoxPairsBegin(&tree, &tree, rounding, &pairs);
  while ((m = SbBoxPairsNext(&pairs, 64, pair)) > 0) {
    for (PetscInt i = 0; i < m; i++) {
      const PetscInt *v = vert + 3 * pair[2 * i];
      const PetscInt *w = vert + 3 * pair[2 * i + 1];
      int nequal = 0;
      int nshared = 0;

      if (pair[2 * i] == pair[2 * i + 1] || !on_each_other(im->x, v, w, rounding))
        continue;

      // corners at one position, of which some are two vertices
      for (int a = 0; a < 9; a++) {
        nequal += SbDistance2(im->x + 3 * v[a / 3], im->x + 3 * w[a % 3]) <= PetscSqr(rounding);
        nshared += v[a / 3] == w[a % 3];
      }
      t->ndoubled += nequal == 3 && nshared < 3;
      if (!t->n++) {
        for (int k = 0; k < 2; k++)
          t->number[k] = im->item[3].number[cell[pair[2 * i + k]]];
        for (int k = 0; k < 3; k++)
          t->at[k] = (im->x[3 * v[0] + k] + im->x[3 * v[1] + k] + im->x[3 * v[2] + k]) / 3;
      }
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree2(vert, cell));
  if (t->n)
    PetscCall(parts_by_faces(faces, &t->npart));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbTouchingText(const SbTouching *t, const char *file, size_t size, char text[])
{
  SbFormat(size, text,
           "pairs of facets that lie on each other without joining: %" PetscInt_FMT
           " (the first: of tetrahedra %lld and %lld, at (%.6g, %.6g, %.6g) m)",
           t->n, (long long)t->number[0], (long long)t->number[1], (double)t->at[0],
           (double)t->at[1], (double)t->at[2]);
  if (!file)
    return;
  if (t->ndoubled == t->n)
    SbAppend(size, text,
             "; vertices are there twice: join them by supple-mesh repair %s OUT, or let "
             "contact act between them",
             file);
  else
    SbAppend(size, text,
             "; both sides need the same triangles: mesh the parts as one (gmsh: "
             "BooleanFragments, Coherence), or as bodies of their own with contact");
}

PetscErrorCode SbImportCheckTouching(const SbImport *im, const SbFaces *faces, SbBody *body)
{
  char text[1024];
  SbTouching t;

  PetscFunctionBeginUser;
  PetscCall(SbImportTouching(im, faces, &t));
  if (!t.n)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbTouchingText(&t, body->mesh, sizeof(text), text);
  PetscCheck(t.npart <= body->npart || (strcmp(body->element, "cr") && strcmp(body->element, "dg")),
             PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: with the element %s, whose unknowns are at faces, the body falls apart into "
             "%" PetscInt_FMT " parts; %s",
             im->where, body->element, t.npart, text);
  PetscCall(SbWarning(PETSC_COMM_SELF, "%s: %s", im->where, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}
