/*
  check.c - validity checks of a body's mesh, before anything is computed on it.

  Repaired and counted: unused vertices are removed; tets with negative orientation have two
  vertices swapped. Errors: a tet of zero volume, a duplicate tet, a face of three tets; each would
  make the mass or the stiffness matrix wrong. Counted: group triangles that are not a face of any
  tet; surface edges with more than two facets, which connect parts of the body like hinges.

  A tet is flat when its height over the longest edge L is below 1e-12 L, or below the rounding of
  its coordinates: |det| <= (1e-12 L + 8 eps max|x|) L^2. The thinnest slivers worth simulating are
  nine orders above the first term.
*/
#include "mesh_impl.h"

PetscErrorCode SbImportDropUnused(SbImport *im)
{
  const PetscInt before = im->nvert;
  PetscInt *keep;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(im->nvert, &keep));
  for (PetscInt i = 0; i < 4 * im->item[3].n; i++)
    keep[im->item[3].vert[i]] = 1;
  SbImportDropVertices(im, keep);
  im->nunused = before - im->nvert;
  PetscCall(PetscFree(keep));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscReal longest_edge2(const PetscReal x[], const PetscInt v[4])
{
  PetscReal L2 = 0;

  for (int e = 0; e < 6; e++)
    L2 = PetscMax(L2, SbDistance2(x + 3 * v[SbTetEdge[e][0]], x + 3 * v[SbTetEdge[e][1]]));
  return L2;
}

PetscBool SbTetFlat(const PetscReal x[], const PetscInt v[4], PetscReal largest, PetscReal *det)
{
  const PetscReal L2 = longest_edge2(x, v);
  const PetscReal L = PetscSqrtReal(L2);

  *det = SbTetDeterminant(x, v);
  return (PetscBool) !(PetscAbsReal(*det) > (1e-12 * L + 8 * PETSC_MACHINE_EPSILON * largest) * L2);
}

PetscReal SbImportLargest(const SbImport *im)
{
  PetscReal largest = 0;

  for (PetscInt i = 0; i < 3 * im->nvert; i++)
    largest = PetscMax(largest, PetscAbsReal(im->x[i]));
  return largest;
}

PetscErrorCode SbImportTwice(const SbImport *im, int64_t a, int64_t b)
{
  PetscFunctionBeginUser;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "%s: tetrahedra %lld and %lld have the same four nodes; remove one", im->where,
          (long long)PetscMin(a, b), (long long)PetscMax(a, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportOverlap(const SbImport *im, const int64_t number[3], PetscInt nshared)
{
  PetscFunctionBeginUser;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "%s: tetrahedra %lld, %lld and %lld share one face (of %" PetscInt_FMT
          " such faces); a face has at most two, remove what overlaps",
          im->where, (long long)number[0], (long long)number[1], (long long)number[2], nshared);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportCheckCells(SbImport *im, PetscReal largest, SbFaces *faces)
{
  const int64_t *number = im->item[3].number;
  PetscReal det;

  PetscFunctionBeginUser;

  // swap two vertices of inverted tets; a flat tet is an error
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    PetscInt *v = im->item[3].vert + 4 * c;

    // a flat tet, perhaps because it has the same node twice
    if (SbTetFlat(im->x, v, largest, &det)) {
      for (int i = 0; i < 4; i++) {
        for (int j = 0; j < i; j++)
          PetscCheck(v[i] != v[j], PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                     "%s: tetrahedron %lld uses node %lld twice; remove it", im->where,
                     (long long)number[c], (long long)im->vert_number[v[i]]);
      }
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
              "%s: tetrahedron %lld is flat (volume %.3g m^3 with an edge of %.3g m); repair the "
              "mesh (gmsh: "
              "Mesh.Optimize = 1)",
              im->where, (long long)number[c], (double)PetscAbsReal(det) / 6,
              (double)PetscSqrtReal(longest_edge2(im->x, v)));
    }
    if (det < 0) {
      const PetscInt keep = v[3];

      v[3] = v[2];
      v[2] = keep;
      im->nreoriented++;
    }
  }
  PetscCall(SbFacesCreate(im->nvert, im->item[3].n, im->item[3].vert, faces));

  /* cells with equal vertices share all four faces; with a third cell at one of them it is a face
     of three */
  if (faces->nshared) {
    const PetscInt *s = faces->shared;

    for (int i = 0; i < 3; i++) {
      PetscInt vert[2][4];

      for (int k = 0; k < 2; k++) {
        PetscCall(PetscArraycpy(vert[k], im->item[3].vert + 4 * s[(i + k) % 3], 4));
        PetscCall(PetscSortInt(4, vert[k]));
      }
      if (!memcmp(vert[0], vert[1], sizeof(vert[0])))
        PetscCall(SbImportTwice(im, number[s[i]], number[s[(i + 1) % 3]]));
    }
    PetscCall(SbImportOverlap(im, (const int64_t[3]){number[s[0]], number[s[1]], number[s[2]]},
                              faces->nshared));
  }
  for (PetscInt c = 0; c < faces->ncell; c++) {
    const PetscInt *n = faces->neighbour + 4 * c;

    if (n[0] >= 0 && n[0] == n[1] && n[0] == n[2] && n[0] == n[3])
      PetscCall(SbImportTwice(im, number[c], number[n[0]]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbBoundaryEdges(const SbImport *im, const SbFaces *faces, const PetscInt number[],
                     PetscInt64 edge[])
{
  for (PetscInt s = 0; s < 4 * faces->ncell; s++) {
    const PetscInt *v = im->item[3].vert + 4 * (s / 4);

    for (int i = 0; faces->neighbour[s] < 0 && i < 3; i++) {
      const PetscInt a = v[SbFaceVertex[s % 4][i]];
      const PetscInt b = v[SbFaceVertex[s % 4][(i + 1) % 3]];

      *edge++ = (PetscInt64)SbKeyOfPair(number ? number[a] : a, number ? number[b] : b);
    }
  }
}

PetscErrorCode SbCountPinched(PetscInt n, PetscInt64 edge[], PetscInt *npinched)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSortInt64(n, edge));
  for (PetscInt i = 0, m; i < n; i += m) {
    for (m = 1; i + m < n && edge[i + m] == edge[i];)
      m++;
    *npinched += m > 2;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportCheck(SbImport *im, SbFaces *faces)
{
  PetscInt slots[2];
  PetscInt64 *edge;

  PetscFunctionBeginUser;
  PetscCall(SbImportDropUnused(im));
  PetscCall(SbImportCheckCells(im, SbImportLargest(im), faces));

  // group triangles that are not a face of any tet
  for (PetscInt t = 0; t < im->item[2].n; t++)
    im->nlost += !SbFacesFind(faces, im->item[2].vert + 3 * t, slots);

  // on a closed surface each edge has two facets
  PetscCall(PetscMalloc1(3 * faces->nboundary, &edge));
  SbBoundaryEdges(im, faces, NULL, edge);
  PetscCall(SbCountPinched(3 * faces->nboundary, edge, &im->npinched));
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}
