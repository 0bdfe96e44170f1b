/*
  box.c - structured tet mesh of a box from the origin on: box:lx,ly,lz:n or box:lx,ly,lz:nx,ny,nz.

  n is the number of cells along the shortest side; the numbers along the other sides make the cells
  nearest to cubes. Each cell is divided into six tets around one of its diagonals (Kuhn, 1960), and
  adjacent cells are mirror images of each other. Without mirroring all tets have the same shapes,
  but the mesh has a preferred direction: on a clamped bar of 32 x 8 x 8 cells under its weight it
  recovers 93.3 % of the strain energy at a Poisson ratio of 0.3 and 60 % at 0.49, the mirrored one
  95.6 % and 93 %, with the same number of unknowns and matrix entries; and a symmetric load on an
  even number of cells gives a symmetric solution.

  The sides are the groups xmin, xmax, ymin, ymax, zmin, zmax.
*/
#include "meshio_impl.h"

#define BOX_HELP                                                                                  \
  "write box:lx,ly,lz:n or box:lx,ly,lz:nx,ny,nz with lengths in m above 0 and numbers of cells " \
  "from 1 on"

/* Vertex in a box of n[] cells; x fastest. */
static inline PetscInt vertex(const PetscInt n[3], PetscInt i, PetscInt j, PetscInt k)
{
  return (k * (n[1] + 1) + j) * (n[0] + 1) + i;
}

/* Six tets of a cell; corners as bits (1: far in x, 2: in y, 4: in z), each tet along one of the
   six edge paths from corner 0 to corner 7. `mirror`: bits of the directions in which the cell is
   reflected. An odd permutation and an odd number of reflections each change the orientation of the
   tet. */
static PetscErrorCode add_cell(const PetscInt n[3], const PetscInt at[3], SbImport *im)
{
  static const int ways[6][4] = {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7},
                                 {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 4, 6, 7}};
  const int mirror = (int)((at[0] & 1) | (at[1] & 1) << 1 | (at[2] & 1) << 2);
  const int odd = (int)((at[0] + at[1] + at[2]) & 1);

  PetscFunctionBeginUser;
  for (int w = 0; w < 6; w++) {
    PetscInt vert[4];

    for (int a = 0; a < 4; a++) {
      const int corner = ways[w][a] ^ mirror;
      const int position = odd ^ (w >= 3) && a >= 2 ? 5 - a : a; /* swap the last two vertices */

      vert[position] =
        vertex(n, at[0] + (corner & 1), at[1] + (corner >> 1 & 1), at[2] + (corner >> 2));
    }
    PetscCall(SbImportAddItem(im, 3, vert, 0, im->item[3].n + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Box(const char *text, SbImport *im)
{
  PetscInt n[3], at[3];
  PetscInt v = 0;
  const char *sides = text + strlen("box:");
  const char *colon = strchr(sides, ':');
  char lengths[PETSC_MAX_PATH_LEN];
  PetscReal l[3]; /* side lengths, m */
  PetscReal ncell[3];
  PetscReal total = 6;
  int count;

  PetscFunctionBeginUser;

  // side lengths and numbers of cells
  (void)snprintf(lengths, sizeof(lengths), "%.*s", (int)strcspn(sides, ":"), sides);
  count = colon ? SbParseNumbers(colon + 1, 3, ncell) : 0;
  PetscCheck((count == 1 || count == 3) && SbParseNumbers(lengths, 3, l) == 3, PETSC_COMM_SELF,
             PETSC_ERR_USER_INPUT, "%s: " BOX_HELP, im->where);
  for (int i = 0; i < 3; i++)
    PetscCheck(l[i] > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: length %g m; " BOX_HELP,
               im->where, l[i]);
  if (count == 1) {
    const double n0 = ncell[0];
    const double shortest = PetscMin(PetscMin(l[0], l[1]), l[2]);

    for (int i = 0; i < 3; i++)
      ncell[i] = l[i] == shortest ? n0 : PetscMax(1., floor(l[i] / shortest * n0 + 0.5));
  }
  for (int i = 0; i < 3; i++) {
    PetscCheck(ncell[i] >= 1 && ncell[i] == floor(ncell[i]), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: %g cells; " BOX_HELP, im->where, ncell[i]);
    total *= ncell[i];
    PetscCheck(total <= PETSC_MAX_INT / 8, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: %g tets or more are more than this build can number; take fewer cells",
               im->where, total);
    n[i] = (PetscInt)ncell[i];
  }

  // vertices, then tets
  PetscCall(SbImportSetVertices(im, (n[0] + 1) * (n[1] + 1) * (n[2] + 1)));
  for (at[2] = 0; at[2] <= n[2]; at[2]++) {
    for (at[1] = 0; at[1] <= n[1]; at[1]++)
      for (at[0] = 0; at[0] <= n[0]; at[0]++, v++)
        for (int d = 0; d < 3; d++)
          im->x[3 * v + d] = l[d] * (PetscReal)at[d] / (PetscReal)n[d];
  }
  for (at[2] = 0; at[2] < n[2]; at[2]++) {
    for (at[1] = 0; at[1] < n[1]; at[1]++)
      for (at[0] = 0; at[0] < n[0]; at[0]++)
        PetscCall(add_cell(n, at, im));
  }
  for (int side = 0; side < 6; side++) {
    static const char *const names[6] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
    const int d = side / 2;
    const int e = (d + 1) % 3;
    const int f = (d + 2) % 3;
    PetscInt tags;

    // two triangles for each cell on the side `side` of the box, with the diagonals of the tets
    PetscCall(SbImportTagsAlone(im, 2, side + 1, names[side], &tags));
    at[d] = side % 2 ? n[d] : 0;
    for (PetscInt i = 0; i < n[e]; i++) {
      for (PetscInt j = 0; j < n[f]; j++) {
        PetscInt c[4];

        /* corners by bits; the diagonals of adjacent mirrored cells alternate */
        for (int corner = 0; corner < 4; corner++) {
          at[e] = i + ((corner & 1) ^ (i & 1));
          at[f] = j + ((corner >> 1) ^ (j & 1));
          c[corner] = vertex(n, at[0], at[1], at[2]);
        }
        PetscCall(SbImportAddItem(im, 2, (PetscInt[3]){c[0], c[1], c[3]}, tags, im->item[2].n + 1));
        PetscCall(SbImportAddItem(im, 2, (PetscInt[3]){c[0], c[2], c[3]}, tags, im->item[2].n + 1));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
