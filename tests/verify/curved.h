/*
  curved.h - second-order meshes: a triangular prism, n cells along its sides, m layers, three tets
  per cell, mapped at all ten nodes of each tet (curved) or at the four vertices only (straight).
*/
#pragma once
#include "verify.h"

/* Map of the point x = (s, t, h) of the prism s, t >= 0, s + t <= 1, 0 <= h <= 1. */
typedef void (*CurvedMap)(PetscReal x[3]);

/* Number of a point at half steps, row by row in each layer. */
static inline PetscInt curved_number(PetscInt n, const PetscInt at[3])
{
  const PetscInt row = 2 * n + 1;

  return at[2] * row * (row + 1) / 2 + at[1] * row - at[1] * (at[1] - 1) / 2 + at[0];
}

/* Writes tet w of the prism over base[3], ascending, from layer k; positively oriented if the base
   is counter-clockwise. */
static inline void curved_tet(FILE *f, PetscInt n, const PetscInt base[3][2], PetscInt k, int w,
                              PetscInt number, PetscBool second)
{
  static const int vertex[3][4][2] = {{{0, 0}, {1, 0}, {2, 0}, {2, 1}},
                                      {{0, 0}, {1, 0}, {2, 1}, {1, 1}},
                                      {{0, 0}, {1, 1}, {2, 1}, {0, 1}}};
  static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {2, 3}, {1, 3}}; /* gmsh's order */
  PetscInt at[4][3];

  fprintf(f, "%d %d 2 0 1", (int)number, second ? 11 : 4);
  for (int a = 0; a < 4; a++) {
    at[a][0] = 2 * base[vertex[w][a][0]][0];
    at[a][1] = 2 * base[vertex[w][a][0]][1];
    at[a][2] = 2 * (k + vertex[w][a][1]);
    fprintf(f, " %d", (int)curved_number(n, at[a]) + 1);
  }
  for (int e = 0; e < 6 && second; e++) {
    PetscInt middle[3];

    for (int i = 0; i < 3; i++)
      middle[i] = (at[edge[e][0]][i] + at[edge[e][1]][i]) / 2;
    fprintf(f, " %d", (int)curved_number(n, middle) + 1);
  }
  fprintf(f, "\n");
}

/* See verify_mesh_write(). */
static inline PetscErrorCode curved_mesh_write(PetscInt n, PetscInt m, CurvedMap map,
                                               PetscBool second, char path[512])
{
  PetscInt number = 0;
  PetscInt at[3];
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &f));
  if (f) {
    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n",
            (int)((2 * m + 1) * (2 * n + 1) * (n + 1)));
    for (at[2] = 0; at[2] <= 2 * m; at[2]++) {
      for (at[1] = 0; at[1] <= 2 * n; at[1]++) {
        for (at[0] = 0; at[0] <= 2 * n - at[1]; at[0]++) {
          PetscReal x[3] = {0.5 * (PetscReal)at[0] / (PetscReal)n,
                            0.5 * (PetscReal)at[1] / (PetscReal)n,
                            0.5 * (PetscReal)at[2] / (PetscReal)m};

          map(x);
          fprintf(f, "%d %.17g %.17g %.17g\n", (int)curved_number(n, at) + 1, x[0], x[1], x[2]);
        }
      }
    }
    fprintf(f, "$EndNodes\n$Elements\n%d\n", (int)(3 * n * n * m));
    for (PetscInt k = 0; k < m; k++) {
      for (PetscInt j = 0; j < n; j++) {
        for (PetscInt i = 0; i < n - j; i++) {
          for (int w = 0; w < 6; w++) {
            const PetscInt up[3][2] = {{i, j}, {i + 1, j}, {i, j + 1}};
            const PetscInt down[3][2] = {{i + 1, j}, {i, j + 1}, {i + 1, j + 1}};

            if (w >= 3 && i == n - j - 1)
              continue;
            curved_tet(f, n, w < 3 ? up : down, k, w % 3, ++number, second);
          }
        }
      }
    }
    fprintf(f, "$EndElements\n");
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of a box of n[3] cells, x in the unit cube, with curved tets. */
static inline PetscErrorCode curved_box_write(const PetscInt n[3], CurvedMap map, char path[512])
{
  static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {2, 3}, {1, 3}}; /* gmsh's order */
  const PetscInt half[3] = {2 * n[0], 2 * n[1], 2 * n[2]};
  PetscInt at[3], c[3];
  PetscInt number = 0;
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &f));
  if (f) {
    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n",
            (int)((half[0] + 1) * (half[1] + 1) * (half[2] + 1)));
    for (at[2] = 0; at[2] <= half[2]; at[2]++) {
      for (at[1] = 0; at[1] <= half[1]; at[1]++) {
        for (at[0] = 0; at[0] <= half[0]; at[0]++) {
          PetscReal x[3];

          for (int k = 0; k < 3; k++)
            x[k] = (PetscReal)at[k] / (PetscReal)half[k];
          map(x);
          fprintf(f, "%d %.17g %.17g %.17g\n", (int)verify_vertex(half, at) + 1, x[0], x[1], x[2]);
        }
      }
    }
    fprintf(f, "$EndNodes\n$Elements\n%d\n", (int)(6 * n[0] * n[1] * n[2]));
    for (c[2] = 0; c[2] < n[2]; c[2]++) {
      for (c[1] = 0; c[1] < n[1]; c[1]++) {
        for (c[0] = 0; c[0] < n[0]; c[0]++) {
          for (int w = 0; w < 6; w++) {
            PetscInt v[4], place[4][3];

            verify_tet(n, c, w, v);
            fprintf(f, "%d 11 2 0 1", (int)++number);
            for (int a = 0; a < 4; a++) {
              place[a][0] = 2 * (v[a] % (n[0] + 1));
              place[a][1] = 2 * (v[a] / (n[0] + 1) % (n[1] + 1));
              place[a][2] = 2 * (v[a] / ((n[0] + 1) * (n[1] + 1)));
              fprintf(f, " %d", (int)verify_vertex(half, place[a]) + 1);
            }
            for (int e = 0; e < 6; e++) {
              PetscInt middle[3];

              for (int k = 0; k < 3; k++)
                middle[k] = (place[edge[e][0]][k] + place[edge[e][1]][k]) / 2;
              fprintf(f, " %d", (int)verify_vertex(half, middle) + 1);
            }
            fprintf(f, "\n");
          }
        }
      }
    }
    fprintf(f, "$EndElements\n");
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Map without any straight edge. */
static inline void curved_wobble(PetscReal x[3])
{
  const PetscReal s = x[0];
  const PetscReal t = x[1];
  const PetscReal h = x[2];

  x[0] += 0.06 * PetscSinReal(3. * t + 2. * h) + 0.1 * h * h;
  x[1] += 0.05 * PetscSinReal(4. * s - 3. * h);
  x[2] += 0.07 * PetscCosReal(2. * s + 3. * t);
}

/* Map to an eighth of the hollow sphere of radii 1 and 2. */
static inline void curved_shell(PetscReal x[3])
{
  PetscReal d[3] = {x[0], x[1], 1. - x[0] - x[1]};
  PetscReal length;

  length = PetscSqrtReal(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (int k = 0; k < 3; k++)
    d[k] *= (1. + x[2]) / length;
  for (int k = 0; k < 3; k++)
    x[k] = d[k];
}
