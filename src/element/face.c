/*
  Elements with their nodes at the centroids of the faces: Crouzeix-Raviart, and piecewise linear DG in the same basis.

  With the barycentric coordinates l_a the basis is psi_a = 1 - 3 l_a, node a on the face opposite vertex a: one at the centroid of its
  face, zero at the three others. Hence

    grad psi_a = -3 grad l_a;   psi_a(vertex v) = 1 - 3 delta_av;
    mass / (density V): consistent M_aa = 2/5, M_ab = -1/20; lumped (row sums) 1/4.

  The mean of a function over a face is its value at the node there, so the mean jump is a difference of two nodes.
  (Crouzeix and Raviart 1973; Hansbo and Larson 2003.)
*/
#include "element_impl.h"

static void tabulate_face(const PetscReal x[4][3], PetscReal g[3][3], PetscReal *V)
{
  SbTabulateP1(x, g, V);
  for (int a = 0; a < 3; a++) {
    for (int i = 0; i < 3; i++) g[a][i] *= -3.;
  }
}

static void fill_face(SbElement e)
{
  e->gamma1 = 0.6; /* chosen in docs/reports/locking.md */
  e->ops.tabulate = tabulate_face;
  e->ops.mass_lumped = 1. / 4;
  e->ops.mass_diagonal = 2. / 5;
  e->ops.mass_coupling = -1. / 20;
  for (int v = 0; v < 4; v++) {
    for (int a = 0; a < 4; a++) e->ops.vertex[v][a] = v == a ? -2. : 1.;
  }
}

PetscErrorCode SbElementCreate_CR(SbElement e)
{
  PetscFunctionBeginUser;
  fill_face(e);
  e->nodes_per[2] = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementCreate_DG(SbElement e)
{
  PetscFunctionBeginUser;
  fill_face(e);
  e->nodes_per[3] = 4;
  e->gamma0 = 4.;
  e->weak = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
