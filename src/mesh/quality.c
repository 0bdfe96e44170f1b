/*
  quality.c - size and shape quality of a body's mesh.

  With outward area vectors n_i of the faces opposite vertex i, the dihedral angle at the edge that faces i
  and j share is acos(-n_i . n_j / (|n_i| |n_j|)). The radius ratio is R / (3 r), 1 for the regular tet: r = 3
  V / sum |n_i| and R = | |a|^2 b x c + |b|^2 c x a + |c|^2 a x b | / (12 V) with the edges a, b, c from
  vertex 0 (Shewchuk, "What is a good linear finite element?", 2002).
*/
#include "mesh_impl.h"

void SbTetShape(const PetscReal x[], const PetscInt v[4], PetscReal *V, PetscReal cosine[6], PetscReal *ratio)
{
  PetscReal a[3], b[3], c[3], n[4][3], area[4], to_centre[3], sum = 0, det;
  int edge = 0;

  SbSubtract(x + 3 * v[1], x + 3 * v[0], a);
  SbSubtract(x + 3 * v[2], x + 3 * v[0], b);
  SbSubtract(x + 3 * v[3], x + 3 * v[0], c);
  /* twice the area vectors; their sum is zero */
  SbCross(c, b, n[1]);
  SbCross(a, c, n[2]);
  SbCross(b, a, n[3]);
  for (int i = 0; i < 3; i++) n[0][i] = -n[1][i] - n[2][i] - n[3][i];
  det = -SbDot3(a, n[1]);
  for (int i = 0; i < 4; i++) {
    area[i] = PetscSqrtReal(SbDot3(n[i], n[i]));
    sum += area[i];
  }
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < i; j++) cosine[edge++] = -SbDot3(n[i], n[j]) / (area[i] * area[j]);
  for (int i = 0; i < 3; i++)
    to_centre[i] = SbDot3(a, a) * n[1][i] + SbDot3(b, b) * n[2][i] + SbDot3(c, c) * n[3][i];
  *V = det / 6;
  *ratio = PetscSqrtReal(SbDot3(to_centre, to_centre)) / (2 * det) * sum / (3 * det);
}

PetscReal SbTetQuality(const PetscReal x[], const PetscInt v[4])
{
  PetscReal V, cosine[6], ratio;

  SbTetShape(x, v, &V, cosine, &ratio);
  if (!(PetscAbsReal(V) > 0) || PetscIsInfOrNanReal(ratio)) return 0;
  return (V > 0 ? 1 : -1) / ratio;
}

/* Connected parts by union-find: the vertices of each tet are joined. */
void SbImportJoin(const SbImport *im, PetscInt parent[], PetscInt *npart)
{
  for (PetscInt v = 0; v < im->nvert; v++) parent[v] = v;
  *npart = im->nvert;
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;

    for (int i = 1; i < 4; i++) *npart -= SbUnionJoin(parent, v[0], v[i]);
  }
  /* parents have lower numbers than their children */
  for (PetscInt v = 0; v < im->nvert; v++) parent[v] = parent[parent[v]];
}

void SbImportNote(const SbImport *im, SbBody *body)
{
  const struct {
    PetscInt n;
    const char *text;
  } notes[] = {
    {im->nunused, "unused vertices left out"},
    {im->nreoriented, "inverted tets turned"},
    {body->npart > 1 ? body->npart : 0, "parts that share no vertex"},
    {im->npinched, "surface edges with more than two facets"},
    {im->nlost, "triangles of groups that are no face of a tet"},
  };

  SbFormat(sizeof(body->note), body->note, "%s", im->note);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(notes); i++)
    if (notes[i].n)
      SbAppend(sizeof(body->note), body->note, "%s%s: %" PetscInt_FMT, body->note[0] ? ", " : "",
               notes[i].text, notes[i].n);
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
    for (int e = 0; e < 6; e++) largest = PetscMax(largest, cosine[e]);
    s->nsliver += largest > sliver;
    s->most[0] = PetscMax(s->most[0], largest);
    s->most[1] = PetscMax(s->most[1], ratio);
  }
  for (int i = 0; i < 6; i++) s->most[2 + i] = -PETSC_MAX_REAL;
  for (PetscInt v = 0; v < im->nvert; v++) {
    for (int i = 0; i < 3; i++) {
      s->most[2 + i] = PetscMax(s->most[2 + i], -im->x[3 * v + i]);
      s->most[5 + i] = PetscMax(s->most[5 + i], im->x[3 * v + i]);
    }
  }
}

void SbShapeKeep(const SbShape *s, SbBody *body)
{
  body->nsliver = s->nsliver;
  body->volume = s->volume;
  body->min_dihedral = acos(PetscMin(s->most[0], 1)) * 180 / PETSC_PI;
  body->max_radius_ratio = s->most[1];
  for (int i = 0; i < 3; i++) {
    body->bbox[i] = -s->most[2 + i];
    body->bbox[3 + i] = s->most[5 + i];
  }
}

PetscErrorCode SbImportQuality(const SbImport *im, const SbFaces *faces, SbBody *body)
{
  SbShape shape;
  PetscInt *parent;

  PetscFunctionBeginUser;
  SbImportShape(im, SB_SLIVER, &shape);
  SbShapeKeep(&shape, body);
  body->nvert = im->nvert;
  body->ncell = im->item[3].n;
  body->nfacet = faces->nboundary;
  PetscCall(PetscMalloc1(im->nvert, &parent));
  SbImportJoin(im, parent, &body->npart);
  PetscCall(PetscFree(parent));
  SbImportNote(im, body);
  PetscFunctionReturn(PETSC_SUCCESS);
}
