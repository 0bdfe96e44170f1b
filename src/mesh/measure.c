/*
  measure.c - statistics of a mesh file: measures of groups, size of the mesh, shape of its tets.
*/
#include "mesh_impl.h"

#define FAR 0.05 /* of a body's diagonal, outside of its box */

const PetscReal SbRatioBinEdges[SB_RATIO_BINS] = {1, 1.25, 1.5, 2, 3, 5, 10, 100};

/* Length, area or signed volume of a simplex with straight edges. */
static PetscReal straight(const PetscReal x[], int dim, const PetscInt v[])
{
  PetscReal a[2][3], n[3];

  if (dim == 3)
    return SbTetDeterminant(x, v) / 6;
  if (!dim)
    return 0;
  for (int k = 0; k < dim; k++)
    SbSubtract(x + 3 * v[k + 1], x + 3 * v[0], a[k]);
  if (dim == 1)
    return PetscSqrtReal(SbDot3(a[0], a[0]));
  SbCross(a[0], a[1], n);
  return PetscSqrtReal(SbDot3(n, n)) / 2;
}

/* Length, area or volume of a simplex with curved edges: the integral of the Jacobian by Gauss
   quadrature. */
static PetscReal measure(const SbImport *im, int dim, const PetscInt v[])
{
  static const SbPointRule line = {3, /* Gauss, degree 5 */
                                   {{0.88729833462074169, 0.11270166537925831},
                                    {0.5, 0.5},
                                    {0.11270166537925831, 0.88729833462074169}},
                                   {5. / 18, 8. / 18, 5. / 18}};
  static const SbPointRule *const rules[4] = {NULL, &line, &SbRuleFacet, &SbRuleQuintic};
  const PetscInt own[4] = {0, 1, 2, 3};
  const PetscInt all[4] = {v[0], v[PetscMin(dim, 1)], v[PetscMin(dim, 2)], v[dim]};
  PetscReal off[18], node[SB_CELL_NODES][3], corner[4][3];
  PetscReal sum = 0;

  if (!SbImportOffsets(im, dim, v, off))
    return PetscAbsReal(straight(im->x, dim, v));
  SbTetNodes(im->x, all, off, node);
  for (int q = 0; q < rules[dim]->n; q++) {
    SbQuadraticCorners(rules[dim]->L[q], (const PetscReal(*)[3])node, corner);
    sum += rules[dim]->weight[q] * straight(&corner[0][0], dim, own);
  }
  return PetscAbsReal(sum);
}

PetscErrorCode SbMeshFileGroup(const SbImport *im, PetscInt i, PetscInt *n, PetscReal *size)
{
  const int dim = (int)im->group[i].dim;
  const SbItems *item = &im->item[dim];
  PetscBool *in;

  PetscFunctionBeginUser;
  *n = 0;
  *size = 0;
  PetscCall(PetscCalloc1(im->ntags, &in));
  for (PetscInt t = 0; t < im->ntags; t++)
    for (PetscInt k = im->tags_start[t]; k < im->tags_start[t + 1]; k++)
      if (im->tags_group[k] == i)
        in[t] = PETSC_TRUE;
  for (PetscInt k = 0; k < item->n; k++) {
    if (!in[item->tags[k]])
      continue;
    ++*n;
    *size += measure(im, dim, item->vert + (dim + 1) * (size_t)k);
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshFileMeasure(SbImport *im, SbMeshStatistics *facts)
{
  SbFaces faces = {0};
  PetscErrorCode ierr;
  PetscReal V, cosine[6], ratio;
  PetscReal min_cosine = 1;
  PetscReal sum = 0;
  SbImportEdges edges;
  SbImport tets;
  SbTouching touching;
  char text[512];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(facts, sizeof(*facts)));
  ierr = SbImportCheck(im, &faces);
  if (!ierr)
    ierr = SbImportQuality(im, &faces, &facts->body);
  if (!ierr)
    ierr = SbImportTouching(im, &faces, &touching);
  if (!ierr && touching.n) {
    SbTouchingText(&touching, "FILE", sizeof(text), text);
    SbAppend(sizeof(facts->body.note), facts->body.note, "%s%s", facts->body.note[0] ? ", " : "",
             text);
  }
  facts->body.edge_nodes = PETSC_TRUE;
  if (!ierr)
    ierr = SbImportCurve(PETSC_COMM_SELF, im, &facts->body, NULL, NULL);

  // number of faces, and surface area
  facts->nface = (4 * faces.ncell - faces.nboundary) / 2 + faces.nboundary;
  for (PetscInt s = 0; !ierr && s < 4 * faces.ncell; s++) {
    const PetscInt *v = im->item[3].vert + 4 * (s / 4);
    const int *f = SbFaceVertex[s % 4];

    if (faces.neighbour[s] < 0)
      facts->area += measure(im, 2, (const PetscInt[3]){v[f[0]], v[f[1]], v[f[2]]});
  }
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(ierr);

  // edges of the tets only: lines and triangles of groups may have others
  tets = *im;
  tets.item[1].n = tets.item[2].n = 0;
  PetscCall(SbImportEdgesCreate(&tets, &edges));
  facts->nedge = edges.nedge;
  facts->edge[0] = PETSC_MAX_REAL;
  for (PetscInt a = 0; a < edges.nvert; a++) {
    for (PetscInt e = edges.start[a]; e < edges.start[a + 1]; e++) {
      const PetscReal length = measure(im, 1, (const PetscInt[2]){a, edges.high[e]});

      facts->edge[0] = PetscMin(facts->edge[0], length);
      facts->edge[2] = PetscMax(facts->edge[2], length);
      sum += length;
    }
  }
  facts->edge[1] = edges.nedge ? sum / edges.nedge : 0;
  PetscCall(SbImportEdgesDestroy(&edges));

  // dihedral angles and radius ratios of the tets
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    int bin = SB_RATIO_BINS - 1;

    SbTetShape(im->x, im->item[3].vert + 4 * c, &V, cosine, &ratio);
    for (int e = 0; e < 6; e++) {
      const PetscReal degrees = acos(PetscMax(-1, PetscMin(1, cosine[e]))) * 180 / PETSC_PI;

      facts->angle[PetscMin((int)(degrees * SB_ANGLE_BINS / 180), SB_ANGLE_BINS - 1)]++;
      min_cosine = PetscMin(min_cosine, cosine[e]);
    }
    while (bin && ratio < SbRatioBinEdges[bin])
      bin--;
    facts->ratio[bin]++;
  }
  facts->max_dihedral = acos(PetscMax(-1, min_cosine)) * 180 / PETSC_PI;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbBodyFarFrom(PetscInt nbody, const SbBody body[], const PetscReal point[3],
                        PetscReal *nearest)
{
  PetscBool far = PETSC_TRUE;

  *nearest = PETSC_MAX_REAL;
  for (PetscInt b = 0; b < nbody; b++) {
    const PetscReal *box = body[b].bbox;
    PetscReal r[3], d;

    for (int k = 0; k < 3; k++)
      r[k] = PetscMax(0., PetscMax(box[k] - point[k], point[k] - box[3 + k]));
    d = PetscSqrtReal(SbDot3(r, r));
    *nearest = PetscMin(*nearest, d);
    far = (PetscBool)(far && d > FAR * SbBoxDiagonal(box));
  }
  return far;
}

PetscReal SbBodySmallest(PetscInt nbody, const SbBody body[])
{
  PetscReal size = PETSC_MAX_REAL;

  for (PetscInt b = 0; b < nbody; b++)
    size = PetscMin(size, SbBoxDiagonal(body[b].bbox));
  return size;
}
