/*
  P1 tetrahedron: nodes at the vertices, linear basis. With edges e_a = x_a - x_0 and d = e_1 . (e_2 x e_3):

    grad phi_1 = e_2 x e_3 / d, and cyclic;   V = d / 6;
    mass / (density V): consistent M_aa = 1/10, M_ab = 1/20; lumped (row sums) 1/4.
*/
#include "element_impl.h"

void SbTabulateP1(const PetscReal x[4][3], PetscReal g[3][3], PetscReal *V)
{
  PetscReal e[3][3];

  for (int a = 0; a < 3; a++) {
    for (int i = 0; i < 3; i++) e[a][i] = x[a + 1][i] - x[0][i];
  }
  for (int a = 0; a < 3; a++) SbCross(e[(a + 1) % 3], e[(a + 2) % 3], g[a]);
  const PetscReal d = SbDot3(e[0], g[0]);
  for (int a = 0; a < 3; a++) {
    for (int i = 0; i < 3; i++) g[a][i] /= d;
  }
  *V = d / 6;
}

PetscErrorCode SbElementCreate_P1(SbElement e)
{
  PetscFunctionBeginUser;
  e->nodes_per[0] = 1;
  e->ops.tabulate = SbTabulateP1;
  e->ops.mass_lumped = 1. / 4;
  e->ops.mass_diagonal = 1. / 10;
  e->ops.mass_coupling = 1. / 20;
  for (int a = 0; a < 4; a++) e->ops.vertex[a][a] = 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}
