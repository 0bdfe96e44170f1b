/*
  quality.c - size and shape quality of a body's mesh.

  With outward area vectors n_i of the faces opposite vertex i, the dihedral angle at the edge that
  faces i and j share is acos(-n_i . n_j / (|n_i| |n_j|)). The radius ratio is R / (3 r), 1 for the
  regular tet: r = 3 V / sum |n_i| and R = | |a|^2 b x c + |b|^2 c x a + |c|^2 a x b | / (12 V) with
  the edges a, b, c from vertex 0 (Shewchuk, "What is a good linear finite element?", 2002).
*/
#include "mesh_impl.h"

void SbTetShape(const PetscReal x[], const PetscInt v[4], PetscReal *V, PetscReal cosine[6],
                PetscReal *ratio)
{
  PetscReal a[3], b[3], c[3], n[4][3], area[4], to_centre[3];
  PetscReal sum = 0;
  PetscReal det;
  int edge = 0;

  SbSubtract(x + 3 * v[1], x + 3 * v[0], a);
  SbSubtract(x + 3 * v[2], x + 3 * v[0], b);
  SbSubtract(x + 3 * v[3], x + 3 * v[0], c);

  /* twice the area vectors; their sum is zero */
  SbCross(c, b, n[1]);
  SbCross(a, c, n[2]);
  SbCross(b, a, n[3]);
  for (int i = 0; i < 3; i++)
    n[0][i] = -n[1][i] - n[2][i] - n[3][i];
  det = -SbDot3(a, n[1]);
  for (int i = 0; i < 4; i++) {
    area[i] = PetscSqrtReal(SbDot3(n[i], n[i]));
    sum += area[i];
  }
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < i; j++)
      cosine[edge++] = -SbDot3(n[i], n[j]) / (area[i] * area[j]);
  for (int i = 0; i < 3; i++)
    to_centre[i] = SbDot3(a, a) * n[1][i] + SbDot3(b, b) * n[2][i] + SbDot3(c, c) * n[3][i];
  *V = det / 6;
  *ratio = PetscSqrtReal(SbDot3(to_centre, to_centre)) / (2 * det) * sum / (3 * det);
}

PetscReal SbTetQuality(const PetscReal x[], const PetscInt v[4])
{
  PetscReal V, cosine[6], ratio;

  SbTetShape(x, v, &V, cosine, &ratio);
  if (!(PetscAbsReal(V) > 0) || PetscIsInfOrNanReal(ratio))
    return 0;
  return (V > 0 ? 1 : -1) / ratio;
}

/* Connected parts by union-find: the vertices of each tet are joined. */
void SbImportJoin(const SbImport *im, PetscInt parent[], PetscInt *npart)
{
  for (PetscInt v = 0; v < im->nvert; v++)
    parent[v] = v;
  *npart = im->nvert;
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;

    for (int i = 1; i < 4; i++)
      *npart -= SbUnionJoin(parent, v[0], v[i]);
  }

  /* parents have lower numbers than their children */
  for (PetscInt v = 0; v < im->nvert; v++)
    parent[v] = parent[parent[v]];
}

void SbImportNote(const SbImport *im, SbBody *body)
{
  const size_t size = sizeof(body->note);

  SbFormat(size, body->note, "%s", im->note);
  SbNoteCount(size, body->note, "unused vertices left out", im->nunused);
  SbNoteCount(size, body->note, "inverted tets turned", im->nreoriented);
  SbNoteCount(size, body->note, "parts that share no vertex", body->npart > 1 ? body->npart : 0);
  SbNoteCount(size, body->note, "surface edges with more than two facets", im->npinched);
  SbNoteCount(size, body->note, "triangles of groups that are no face of a tet", im->nlost);
}

void SbImportShape(const SbImport *im, PetscReal degrees, SbShape *s)
{
  PetscReal V, cosine[6], ratio;
  const PetscReal sliver = PetscCosReal(degrees * PETSC_PI / 180);

  *s = (SbShape){.most = {-1, 0}};
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    PetscReal largest = -1;

    SbTetShape(im->x, im->item[3].vert + 4 * c, &V, cosine, &ratio);
    s->volume += V;
    for (int e = 0; e < 6; e++)
      largest = PetscMax(largest, cosine[e]);
    s->nsliver += largest > sliver;
    s->most[0] = PetscMax(s->most[0], largest);
    s->most[1] = PetscMax(s->most[1], ratio);
  }
  for (int i = 0; i < 6; i++)
    s->most[2 + i] = -PETSC_MAX_REAL;
  for (PetscInt v = 0; v < im->nvert; v++) {
    for (int i = 0; i < 3; i++) {
      s->most[2 + i] = PetscMax(s->most[2 + i], -im->x[3 * v + i]);
      s->most[5 + i] = PetscMax(s->most[5 + i], im->x[3 * v + i]);
    }
  }
}

PetscErrorCode SbImportMeasure(MPI_Comm comm, const SbImport *im, const SbFaces *faces,
                               SbBody *body)
{
  SbShape s;
  PetscInt n[3];

  PetscFunctionBeginUser;
  SbImportShape(im, SB_SLIVER, &s);
  n[0] = im->item[3].n;
  n[1] = faces->nboundary;
  n[2] = s.nsliver;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 3, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &s.volume, 1, MPIU_REAL, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, s.most, 8, MPIU_REAL, MPI_MAX, comm));
  body->ncell = n[0];
  body->nfacet = n[1];
  body->nsliver = n[2];
  body->volume = s.volume;
  body->min_dihedral = acos(PetscMin(s.most[0], 1)) * 180 / PETSC_PI;
  body->max_radius_ratio = s.most[1];
  for (int i = 0; i < 6; i++)
    body->bbox[i] = i < 3 ? -s.most[2 + i] : s.most[2 + i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportQuality(const SbImport *im, const SbFaces *faces, SbBody *body)
{
  PetscInt *parent;

  PetscFunctionBeginUser;
  PetscCall(SbImportMeasure(PETSC_COMM_SELF, im, faces, body));
  body->nvert = im->nvert;
  PetscCall(PetscMalloc1(im->nvert, &parent));
  SbImportJoin(im, parent, &body->npart);
  PetscCall(PetscFree(parent));
  SbImportNote(im, body);
  PetscFunctionReturn(PETSC_SUCCESS);
}
