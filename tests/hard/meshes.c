/*
  meshes.c - meshes of very poor quality, of the unit cube.

  Slivers: two layers of cubes, whose diagonals do not match between the layers. The vertices there
  are moved alternately up and down, and a tet fills each gap between four nearly coplanar vertices.
*/
#include "hard.h"
#include "../verify/verify.h"

#define SLIVER_CELLS 4
#define SLIVER_LIFT 5e-4 /* m; the smallest dihedral angle is about 4 lift / edge */
#define GRADED_CELLS 6
#define GRADED_RATIO 1e4

static void needle(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  x[0] *= 0.02;
  x[1] *= 0.02;
}

PetscErrorCode HardMeshNeedle(char path[512])
{
  const PetscInt n[3] = {4, 4, 2};

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, needle, NULL, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Grading by cubic shells around the corner at the origin, with sizes in geometric progression: x
   times r(s) / s, s = max x. */
static void graded(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal s = PetscMax(x[0], PetscMax(x[1], x[2]));
  const PetscReal inner = (1. - s) * (PetscReal)place->n[0] /
                          (PetscReal)(place->n[0] - 1); /* 0 outside, 1 at the smallest shell */

  for (int k = 0; k < 3 && s > 0.; k++)
    x[k] *= PetscPowReal(GRADED_RATIO, -inner) / s;
}

PetscErrorCode HardMeshGraded(char path[512])
{
  const PetscInt n[3] = {GRADED_CELLS, GRADED_CELLS, GRADED_CELLS};

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, graded, NULL, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertex i, j of plane z = 0..2. */
static PetscInt sliver_vertex(PetscInt i, PetscInt j, PetscInt z)
{
  return (z * (SLIVER_CELLS + 1) + j) * (SLIVER_CELLS + 1) + i + 1;
}

static void write_tet(FILE *f, PetscInt *count, const PetscInt v[4])
{
  fprintf(f, "%d 4 2 0 1 %d %d %d %d\n", (int)++*count, (int)v[0], (int)v[1], (int)v[2], (int)v[3]);
}

/* Six tets of a cube of layer z around the diagonal from corner `from`; the mesh check orients
   them. */
static void write_cube(FILE *f, PetscInt *count, PetscInt i, PetscInt j, PetscInt z, int from)
{
  static const int ways[6][4] = {{0, 1, 3, 7}, {0, 2, 3, 7}, {0, 1, 5, 7},
                                 {0, 4, 5, 7}, {0, 2, 6, 7}, {0, 4, 6, 7}};

  for (int w = 0; w < 6; w++) {
    PetscInt v[4];

    for (int a = 0; a < 4; a++) {
      const int corner = ways[w][a] ^ from;

      v[a] = sliver_vertex(i + (corner & 1), j + (corner >> 1 & 1), z + (corner >> 2));
    }
    write_tet(f, count, v);
  }
}

static void write_slivers(FILE *f)
{
  const PetscInt n = SLIVER_CELLS;
  PetscInt count = 0;

  fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n", (int)(3 * (n + 1) * (n + 1)));
  for (PetscInt z = 0; z < 3; z++) {
    for (PetscInt j = 0; j <= n; j++) {
      for (PetscInt i = 0; i <= n; i++) {
        const PetscReal lift = z != 1 ? 0. : (i + j) & 1 ? -SLIVER_LIFT : SLIVER_LIFT;

        fprintf(f, "%d %.17g %.17g %.17g\n", (int)sliver_vertex(i, j, z), (double)i / (double)n,
                (double)j / (double)n, 0.5 * (double)z + lift);
      }
    }
  }
  fprintf(f, "$EndNodes\n$Elements\n%d\n", (int)(13 * n * n));
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt i = 0; i < n; i++) {
      const PetscInt corner[4] = {sliver_vertex(i, j, 1), sliver_vertex(i + 1, j, 1),
                                  sliver_vertex(i, j + 1, 1), sliver_vertex(i + 1, j + 1, 1)};
      const int odd = (int)((i & 1) | (j & 1) << 1);

      /* below, the diagonal of the face between joins the vertices that went down; above, those
         that went up */
      write_cube(f, &count, i, j, 0, odd ^ 1);
      write_cube(f, &count, i, j, 1, odd);
      write_tet(f, &count, corner);
    }
  }
  fprintf(f, "$EndElements\n");
}

PetscErrorCode HardMeshSliver(char path[512])
{
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &f));
  if (f)
    write_slivers(f);
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
