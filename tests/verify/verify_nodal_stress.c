// @ranks 1 2 4
/*
  Cauchy stress at nodes, recovered from the cells around (src/fem/nodal_stress.c).

  - P2 reproduces a stress that is linear in the position at every node, on perturbed tets up to the
    corners of a cube; P1, CR and DG a constant one.
  - Where two materials meet, each side has its own.
  - Lame's thick-walled sphere under pressure (locking.h): the hoop stress at the inner wall, its
    peak, beside the mean of the tets around each vertex: element, nu, root mean square of the
    relative error of mean and recovered value, largest of both. -mesh FILE: another mesh of it.
  - One rank and all give the same.
*/
#include "locking.h"

#define CUBE                                                                            \
  "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material linear -body_a_young 1e5 " \
  "-body_a_density 1000 -effects hold -effect_hold_type fixed -effect_hold_on xmin -time static "

/* u = A x + q(x), the second part with a factor, of which strains are linear. */
static void displacement(PetscReal quadratic, const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.01 * x[0] + 0.02 * x[1] + quadratic * (x[0] * x[1] + 0.5 * x[2] * x[2]);
  u[1] = -0.01 * x[2] + quadratic * (0.7 * x[1] * x[1] - x[0] * x[2]);
  u[2] = 0.03 * x[0] - 0.02 * x[2] + quadratic * (0.4 * x[2] * x[1] + 0.9 * x[0] * x[0]);
}

/* Stress of Hooke's law, of the derivatives of that. */
static void exact_stress(SbMaterial law, PetscReal quadratic, const PetscReal x[3],
                         PetscReal sigma[6])
{
  const PetscReal mu = SbMaterialShearModulus(law);
  const PetscReal lambda = SbMaterialBulkModulus(law) - 2. / 3. * mu;
  const PetscReal q = quadratic;
  const PetscReal G[9] = {0.01 + q * x[1],
                          0.02 + q * x[0],
                          q * x[2],
                          -q * x[2],
                          1.4 * q * x[1],
                          -0.01 - q * x[0],
                          0.03 + 1.8 * q * x[0],
                          0.4 * q * x[2],
                          -0.02 + 0.4 * q * x[1]};
  const PetscReal p = lambda * (G[0] + G[4] + G[8]);

  for (int k = 0; k < 3; k++)
    sigma[k] = 2. * mu * G[4 * k] + p;
  sigma[3] = mu * (G[1] + G[3]);
  sigma[4] = mu * (G[5] + G[7]);
  sigma[5] = mu * (G[2] + G[6]);
}

/* Largest error at nodes of the owned cells for that displacement, over the largest stress. */
static PetscErrorCode exact(const char *what, PetscReal quadratic, const char *scene)
{
  PetscReal worst[2] = {0., 0.};
  SbNodalStress stress;
  PetscScalar *u;
  TestScene t;
  SbSpace s;
  Vec U;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "%s", scene));
  s = t.model->space;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(VecGetArray(U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    displacement(quadratic, s->node_x + 3 * i, u + 3 * i);
  PetscCall(VecRestoreArray(U, &u));
  PetscCall(SbNodalStressCreate(s, &stress));
  PetscCall(SbNodalStressCompute(stress, U));
  for (PetscInt i = 0; i < SB_CELL_NODES * s->mesh->ncell_owned; i++) {
    const PetscInt cell = i / SB_CELL_NODES;
    const int a = (int)(i % SB_CELL_NODES);
    PetscReal sigma[6], here[6];
    PetscReal x[3];

    if (a >= 4 && !SbSpaceCellElement(s, cell)->nodes_per[1])
      continue;
    for (int k = 0; k < 3; k++)
      x[k] = a < 4 ? s->mesh->x[3 * s->mesh->cell[4 * cell + a] + k]
                   : s->node_x[3 * SbSpaceCellNode(s, cell, a) + k];
    exact_stress(t.model->material[s->mesh->cell_material[cell]], quadratic, x, sigma);
    SbNodalStressAt(stress, cell, a, here);
    for (int k = 0; k < 6; k++) {
      worst[0] = PetscMax(worst[0], PetscAbsReal(here[k] - sigma[k]));
      worst[1] = PetscMax(worst[1], PetscAbsReal(sigma[k]));
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, 2, MPIU_REAL, MPI_MAX, t.model->comm));
  SB_CHECK(worst[0] < 1e-9 * worst[1], "%s: stress at nodes is off by %g of %g Pa", what, worst[0],
           worst[1]);
  PetscCall(SbNodalStressDestroy(&stress));
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum over the cells around each vertex of volume times stress, and volume: [number][7]; mean: that
   of the cells instead of that at nodes. */
static PetscErrorCode at_vertices(SbModel m, Vec U, PetscBool mean, PetscReal **sums)
{
  const SbMesh mesh = m->mesh;
  const PetscReal *u;
  PetscReal *cell, *sum;
  SbNodalStress stress;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(7 * mesh->Nvert, &sum));
  PetscCall(PetscMalloc1(6 * mesh->ncell_owned, &cell));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  SbSpaceCellState(m->space, u, cell, NULL, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(SbNodalStressCreate(m->space, &stress));
  PetscCall(SbNodalStressCompute(stress, U));
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++) {
    const PetscReal V = SbTetDeterminant(mesh->x, mesh->cell + 4 * (i / 4));
    PetscReal *to = sum + 7 * mesh->vert_orig[mesh->cell[i]];
    PetscReal here[6];

    SbNodalStressAt(stress, i / 4, (int)(i % 4), here);
    for (int k = 0; k < 6; k++)
      to[k] += V * (mean ? cell[6 * (i / 4) + k] : here[k]);
    to[6] += V;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, sum, (PetscMPIInt)(7 * mesh->Nvert), MPIU_REAL, MPI_SUM, m->comm));
  for (PetscInt i = 0; i < 7 * mesh->Nvert; i++)
    if (i % 7 < 6 && sum[7 * (i / 7) + 6] > 0.)
      sum[i] /= sum[7 * (i / 7) + 6];
  PetscCall(SbNodalStressDestroy(&stress));
  PetscCall(PetscFree(cell));
  *sums = sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Root mean square and largest error of the hoop stress at vertices of the inner wall, over its
   exact value 5/7. */
static PetscErrorCode sphere(const char *mesh, const char *element, PetscReal nu,
                             PetscReal error[2][2])
{
  char more[256];
  LockingCost cost;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s -solver direct", element));
  PetscCall(locking_run(&t, &cost, more, LOCKING_SHELL, mesh, nu));
  for (int which = 0; which < 2; which++) {
    PetscReal sums[2] = {0., 0.};
    PetscReal worst = 0.;
    PetscReal *sigma;
    PetscReal *x;
    const PetscInt n = t.model->mesh->Nvert;

    PetscCall(at_vertices(t.model, t.run->state.U, (PetscBool)!which, &sigma));
    PetscCall(PetscCalloc1(3 * n, &x));
    for (PetscInt i = 0; i < t.model->mesh->nvert_owned; i++)
      PetscCall(PetscArraycpy(x + 3 * t.model->mesh->vert_orig[i], t.model->mesh->x + 3 * i, 3));
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, x, (PetscMPIInt)(3 * n), MPIU_REAL, MPI_SUM, t.model->comm));
    for (PetscInt i = 0; i < n; i++) {
      static const int entry[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
      const PetscReal r = PetscSqrtReal(SbDot3(x + 3 * i, x + 3 * i));
      PetscReal hoop = 0.;

      if (r > 1.0001)
        continue;
      for (int k = 0; k < 9; k++)
        hoop += ((k % 4 == 0) - x[3 * i + k / 3] * x[3 * i + k % 3] / (r * r)) *
                sigma[7 * i + entry[k / 3][k % 3]] / 2.;
      hoop = hoop * 7. / 5. - 1.;
      sums[0] += PetscSqr(hoop);
      sums[1] += 1.;
      worst = PetscMax(worst, PetscAbsReal(hoop));
    }
    error[which][0] = PetscSqrtReal(sums[0] / sums[1]);
    error[which][1] = worst;
    PetscCall(PetscFree(x));
    PetscCall(PetscFree(sigma));
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One rank and all. */
static PetscErrorCode ranks(void)
{
  static const char scene[] =
    "-bodies a,b -body_a_mesh box:0.4,0.1,0.1:2 -body_b_mesh box:0.4,0.1,0.1:2 -body_b_element p2 "
    "-body_b_translate 0,0.3,0 -body_a_element cr -body_a_inclusions hard "
    "-sets hard -set_hard_at box:0.1,0,0,0.3,0.1,0.1 -inclusion_hard_material linear "
    "-inclusion_hard_young 1e6 -inclusion_hard_poisson 0.3 -body_a_young 1e5 -body_b_young 1e5 "
    "-body_a_poisson 0.3 -body_b_poisson 0.49 -body_a_density 1000 -body_b_density 1000 "
    "-body_a_material linear -body_b_material neohookean "
    "-effects gravity,hold -effect_hold_type fixed -effect_hold_on xmin -time static "
    "-snes_rtol 1e-12 -solver direct";
  PetscReal *sigma[2];
  PetscReal worst = 0.;
  PetscReal most = 0.;
  TestScene t;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (int all = 0; all < 2; all++) {
    PetscCall(test_open_on(all ? PETSC_COMM_WORLD : PETSC_COMM_SELF, NULL, &t, "%s", scene));
    PetscCall(verify_solve(&t, "ranks"));
    PetscCall(at_vertices(t.model, t.run->state.U, PETSC_FALSE, &sigma[all]));
    n = 7 * t.model->mesh->Nvert;
    PetscCall(test_scene_close(&t));
  }
  for (PetscInt i = 0; i < n; i++) {
    worst = PetscMax(worst, PetscAbsReal(sigma[0][i] - sigma[1][i]));
    most = PetscMax(most, PetscAbsReal(sigma[0][i]));
  }
  SB_CHECK(worst <= 1e-9 * most, "on %d ranks the stress differs by %g of %g Pa", test_size, worst,
           most);
  PetscCall(PetscFree(sigma[0]));
  PetscCall(PetscFree(sigma[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const struct {
    const char *element;
    PetscReal nu, most; /* root mean square of the error at the wall */
  } of[] = {{"p1", 0.3, 0.2},   {"cr", 0.3, 0.15},    {"dg", 0.3, 0.15},
            {"p2", 0.3, 0.045}, {"cr", 0.4999, 0.16}, {"p2", 0.4999, 0.045}};
  char mesh[256] = "meshes/shell.msh";

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscOptionsGetString(NULL, NULL, "-mesh", mesh, sizeof(mesh), NULL));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    PetscReal error[2][2];

    PetscCall(sphere(mesh, of[i].element, of[i].nu, error));
    test_print("  | %s | %g | %.3f | %.3f | %.3f | %.3f |\n", of[i].element, of[i].nu, error[0][0],
               error[1][0], error[0][1], error[1][1]);
    SB_CHECK(error[1][0] < of[i].most, "%s, nu %g: hoop stress at the wall is off by %g",
             of[i].element, (double)of[i].nu, (double)error[1][0]);
  }
  PetscCall(exact("p2", 1., CUBE "-body_a_poisson 0.3 -body_a_element p2"));
  PetscCall(exact("p2, 0.4999", 1., CUBE "-body_a_poisson 0.4999 -body_a_element p2"));
  PetscCall(exact("p1", 0., CUBE "-body_a_poisson 0.3 -body_a_element p1"));
  PetscCall(exact("cr", 0., CUBE "-body_a_poisson 0.3 -body_a_element cr"));
  PetscCall(exact("dg", 0., CUBE "-body_a_poisson 0.3 -body_a_element dg"));
  PetscCall(exact("p2, two materials", 0.,
                  CUBE "-body_a_element p2 -body_a_poisson 0.3 -body_a_inclusions hard -sets hard "
                       "-set_hard_at box:0,0,0,0.04,1,1 -inclusion_hard_material linear "
                       "-inclusion_hard_young 1e7 -inclusion_hard_poisson 0.4"));
  PetscCall(ranks());
  SB_TEST_END();
}
