// Face connectivity against a comparison of all pairs, on a box and on a fan with vertices of high
// degree. @ranks 1
#include "mesh_test.h"

/* Number of vertices that two cells share. */
static int common(const PetscInt a[4], const PetscInt b[4])
{
  int n = 0;

  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++)
      n += a[i] == b[j];
  return n;
}

/* Every cell against every other one: neighbours share three vertices, the face is opposite the
   fourth. */
static PetscErrorCode test_all_pairs(const char *what, PetscInt nvert, PetscInt ncell,
                                     const PetscInt cell[])
{
  SbFaces faces;
  PetscInt nboundary = 0;
  PetscInt slots[2];

  PetscFunctionBeginUser;
  PetscCall(SbFacesCreate(nvert, ncell, cell, &faces));
  for (PetscInt c = 0; c < ncell; c++) {
    for (int f = 0; f < 4; f++) {
      const PetscInt *v = cell + 4 * c;
      const PetscInt vert[3] = {v[SbFaceVertex[f][2]], v[SbFaceVertex[f][0]],
                                v[SbFaceVertex[f][1]]};
      PetscInt neighbour = -1;
      PetscInt nfound;

      for (PetscInt d = 0; d < ncell; d++) {
        const PetscInt *w = cell + 4 * d;

        if (d != c && common(v, w) == 3 && v[f] != w[0] && v[f] != w[1] && v[f] != w[2] &&
            v[f] != w[3])
          neighbour = d;
      }
      nboundary += neighbour < 0;
      SB_CHECK(faces.neighbour[4 * c + f] == neighbour,
               "%s: cell %d face %d: neighbour %d instead of %d", what, (int)c, f,
               (int)faces.neighbour[4 * c + f], (int)neighbour);
      nfound = SbFacesFind(&faces, vert, slots);
      SB_CHECK(nfound == (neighbour < 0 ? 1 : 2), "%s: %d slots", what, (int)nfound);
      SB_CHECK(slots[0] == 4 * c + f || (nfound == 2 && slots[1] == 4 * c + f),
               "%s: the face was not found", what);
    }
  }
  SB_CHECK(faces.nboundary == nboundary && !faces.nshared, "%s: %d boundary faces, %d shared", what,
           (int)faces.nboundary, (int)faces.nshared);
  PetscCall(SbFacesDestroy(&faces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_box(void)
{
  const SbBody body = test_body("b", "box:1,1,1:3");
  SbImport im = {0};

  PetscFunctionBeginUser;
  PetscCall(SbImportRead(&body, &im));
  PetscCall(test_all_pairs("box", im.nvert, im.item[3].n, im.item[3].vert));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three tets at the face 1 2 3; a face that does not exist. */
static PetscErrorCode test_shared(void)
{
  const PetscInt cell[12] = {0, 1, 2, 3, 1, 2, 3, 4, 5, 3, 2, 1};
  SbFaces faces;
  PetscInt slots[2];

  PetscFunctionBeginUser;
  PetscCall(SbFacesCreate(6, 3, cell, &faces));
  SB_CHECK(faces.nshared == 1, "%d shared faces", (int)faces.nshared);
  SB_CHECK(faces.shared[0] + faces.shared[1] + faces.shared[2] == 3, "cells %d %d %d",
           (int)faces.shared[0], (int)faces.shared[1], (int)faces.shared[2]);
  SB_CHECK(faces.nboundary == 9, "%d boundary faces", (int)faces.nboundary);
  SB_CHECK(SbFacesFind(&faces, (PetscInt[]){0, 1, 4}, slots) == 0,
           "a face that does not exist was found");
  SB_CHECK(SbFacesFind(&faces, (PetscInt[]){4, 3, 5}, slots) == 0,
           "a face behind all others was found");
  PetscCall(SbFacesDestroy(&faces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  enum {
    N = 90
  };
  PetscInt cell[4 * N];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_box());

  /* a ring of tets around the edge from vertex 0 to 1: hundreds of faces with the same lowest
     vertex */
  for (PetscInt c = 0; c < N; c++) {
    cell[4 * c] = 1;
    cell[4 * c + 1] = 2 + (c + 1) % N;
    cell[4 * c + 2] = 0;
    cell[4 * c + 3] = 2 + c;
  }
  PetscCall(test_all_pairs("ring", N + 2, N, cell));
  PetscCall(test_shared());
  SB_TEST_END();
}
