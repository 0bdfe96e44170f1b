// Reverse Cuthill-McKee order: a permutation, small bandwidth for slender bodies, components one
// after the other. @ranks 1
#include "../../src/mesh/mesh_impl.h"
#include "mesh_test.h"

/* Largest difference between the numbers of two vertices of a cell. */
static PetscErrorCode bandwidth(PetscInt nvert, PetscInt ncell, const PetscInt cell[],
                                PetscInt *width)
{
  PetscInt *order, *number;
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(nvert, &order, nvert, &number));
  PetscCall(SbOrderRCM(nvert, ncell, cell, order));
  for (PetscInt v = 0; v < nvert; v++)
    number[v] = -1;
  for (PetscInt i = 0; i < nvert; i++) {
    wrong += order[i] < 0 || order[i] >= nvert || number[order[i]] >= 0;
    if (order[i] >= 0 && order[i] < nvert)
      number[order[i]] = i;
  }
  SB_CHECK(!wrong, "%d of %d entries are no permutation", (int)wrong, (int)nvert);
  *width = 0;
  for (PetscInt c = 0; c < ncell; c++) {
    for (int a = 0; a < 4; a++) {
      for (int b = 0; b < a; b++) {
        const PetscInt v = cell[4 * c + a];
        const PetscInt w = cell[4 * c + b];

        if (v >= 0 && w >= 0)
          *width = PetscMax(*width, PetscAbsInt(number[v] - number[w]));
      }
    }
  }
  PetscCall(PetscFree2(order, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbImport im;
  PetscInt width, n;
  PetscInt two[16] = {0, 2, 4, 6, 2, 4, 6, 8, 1, 3, 5, 7, 3, 5, 7, 9};
  PetscInt order[10];

  SB_TEST_BEGIN(argc, argv);

  /* A bar of 3 x 3 x 40 vertices, numbered across: levels start at a corner and are oblique, within
     three layers of 9 vertices. */
  PetscCall(test_import("box:2,2,39:2,2,39", &im));
  PetscCall(bandwidth(im.nvert, im.item[3].n, im.item[3].vert, &width));
  SB_CHECK(width <= 3 * 9, "bandwidth %d of the upright bar", (int)width);
  PetscCall(SbImportDestroy(&im));
  PetscCall(
    test_import("box:39,2,2:39,2,2", &im)); /* with the original numbers the bandwidth is 161 */
  PetscCall(bandwidth(im.nvert, im.item[3].n, im.item[3].vert, &width));
  SB_CHECK(width <= 3 * 9, "bandwidth %d of the lying bar", (int)width);

  /* Vertices that are excluded: the far half of the bar. */
  n = 0;
  for (PetscInt i = 0; i < 4 * im.item[3].n; i++) {
    PetscInt *v = &im.item[3].vert[i];

    if (im.x[3 * *v] < 20)
      *v = (*v / 40) * 20 + *v % 40, n = PetscMax(n, *v + 1);
    else
      *v = -1;
  }
  SB_CHECK(n == 180, "%d vertices in the near half", (int)n);
  PetscCall(bandwidth(n, im.item[3].n, im.item[3].vert, &width));
  SB_CHECK(width <= 3 * 9, "bandwidth %d of half the bar", (int)width);
  PetscCall(SbImportDestroy(&im));

  /* Two parts with alternating numbers are numbered one after the other, the part of vertex 0
     first. */
  PetscCall(SbOrderRCM(10, 4, two, order));
  for (int i = 0; i < 10; i++)
    SB_CHECK(order[i] % 2 == i / 5, "vertex %d at place %d", (int)order[i], i);
  PetscCall(SbOrderRCM(0, 0, NULL, order)); /* a rank without vertices */
  SB_TEST_END();
}
