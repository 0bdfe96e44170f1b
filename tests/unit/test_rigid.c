// @ranks 1 2 3
/*
  Rigid bodies: four nodes with mass, centre and second moments of the mesh, on one rank with all
  cells; weights at the vertices that reproduce positions; sets that hold them as a whole; no force
  and no strain in rigid motions; the stretch of a spin.
*/
#include "../scene.h"

#define SCENE                                                                                \
  "-bodies soft,stone,other -body_default_density 700 -body_soft_mesh box:0.3,0.2,0.2:2 "    \
  "-body_soft_material corotated -body_soft_young 1e5 -body_soft_poisson 0.3 "               \
  "-body_soft_element cr -body_stone_mesh box:0.3,0.2,0.1:3 -body_stone_rigid yes "          \
  "-body_stone_rotate 1,2,3,40 -body_stone_translate 1,2,3 "                                 \
  "-body_stone_angular_velocity 3,4,5 -body_other_mesh box:0.1,0.1,0.1:1 "                   \
  "-body_other_rigid yes -body_other_translate -1,0,0 -sets part -set_part_at "              \
  "box:0.9,1.9,2.9,1.1,2.1,3.1 -effects hold -effect_hold_type fixed -effect_hold_on other " \
  "-effect_hold_components z"
#define STONE 1
#define VOLUME (0.3 * 0.2 * 0.1)
#define NEAR(value, expected, tolerance) SB_CHECK_NEAR(value, expected, tolerance, #value)

/* Sums over nodes and cells of the stone: mass, mass x, mass x x^T. */
static PetscErrorCode check_moments(SbModel m)
{
  const SbSpace s = m->space;
  const SbMesh mesh = m->mesh;
  PetscReal sum[2][13] = {{0.}};
  PetscInt nodes = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (s->node_body[i] != STONE)
      continue;
    nodes++;
    sum[0][0] += s->node_mass[i];
    for (int k = 0; k < 3; k++)
      sum[0][1 + k] += s->node_mass[i] * s->node_x[3 * i + k];
    for (int k = 0; k < 9; k++)
      sum[0][4 + k] += s->node_mass[i] * s->node_x[3 * i + k / 3] * s->node_x[3 * i + k % 3];
  }

  // a rule of degree two: points with one coordinate of 0.585..., others of 0.138...
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++) {
    const PetscInt *v = mesh->cell + 4 * (i / 4);
    const PetscReal mass = 700. * SbTetDeterminant(mesh->x, v) / 24.;
    PetscReal x[3] = {0.};

    if (mesh->cell_body[i / 4] != STONE)
      continue;
    for (int k = 0; k < 12; k++)
      x[k % 3] +=
        (k / 3 == i % 4 ? 0.5854101966249685 : 0.1381966011250105) * mesh->x[3 * v[k / 3] + k % 3];
    sum[1][0] += mass;
    for (int k = 0; k < 3; k++)
      sum[1][1 + k] += mass * x[k];
    for (int k = 0; k < 9; k++)
      sum[1][4 + k] += mass * x[k / 3] * x[k % 3];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 26, MPIU_REAL, MPI_SUM, m->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nodes, 1, MPIU_INT, MPI_SUM, m->comm));
  SB_CHECK(nodes == 4, "%d nodes", (int)nodes);
  NEAR(sum[0][0], 700. * VOLUME, 1e-12);
  for (int k = 0; k < 13; k++)
    NEAR(sum[0][k], sum[1][k], 1e-12 * 700. * VOLUME * 20.);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells share their nodes, on one rank; weights add up to one and give the positions. */
static PetscErrorCode check_basis(SbModel m)
{
  const SbSpace s = m->space;
  const SbMesh mesh = m->mesh;
  PetscInt ranks = 0;
  PetscInt cells[2] = {0, 0};

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    if (mesh->cell_body[c] != STONE)
      continue;
    cells[c >= mesh->ncell_owned]++;
    ranks = 1;
    for (PetscInt v = 0; v < 4; v++) {
      const PetscReal *w = SbSpaceCornerBasis(s, c, v);

      NEAR(w[0] + w[1] + w[2] + w[3], 1., 1e-13);
      for (int k = 0; k < 3; k++) {
        PetscReal x = 0.;

        for (int a = 0; a < 4; a++)
          x += w[a] * s->node_x[3 * s->cell_node[4 * c + a] + k];
        NEAR(x, mesh->x[3 * mesh->cell[4 * c + v] + k], 1e-12);
      }
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &ranks, 1, MPIU_INT, MPI_SUM, m->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, cells, 2, MPIU_INT, MPI_SUM, m->comm));
  SB_CHECK(ranks == 1, "on %d ranks", (int)ranks);
  SB_CHECK(cells[0] == m->body[STONE].ncell && !cells[1], "%d cells, %d ghosts", (int)cells[0],
           (int)cells[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets with all of the surface hold the nodes, others do not. */
static PetscErrorCode check_sets(SbModel m)
{
  const SbSpace s = m->space;
  PetscInt k[2];

  PetscFunctionBeginUser;
  PetscCall(SbSpaceFindSet(s, "part", "test", &k[0]));
  PetscCall(SbSpaceFindSet(s, "other", "test", &k[1]));
  for (PetscInt i = 0; i < s->nnode; i++) {
    if (s->node_body[i] == 0)
      continue;
    SB_CHECK(!(s->node_set[i] & SB_SET_BIT(k[0])), "a node is in a set with part of the body");
    SB_CHECK(!!(s->node_set[i] & SB_SET_BIT(k[1])) == (s->node_body[i] == 2),
             "a node is not in the set of its body");
    SB_CHECK(s->fixed[i] == (s->node_body[i] == 2 ? 4 : 0), "fixed %d", (int)s->fixed[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rotation about x has neither force nor strain, a stretch has. */
static PetscErrorCode check_strain(SbModel m)
{
  const SbSpace s = m->space;
  const PetscReal angle = 0.7;
  const PetscReal E = SbMaterialYoungModulus(m->material[STONE]);
  PetscReal *u, *f, most;
  PetscInt body;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(3 * s->nnode, &u, 3 * s->nnode, &f));
  for (PetscInt i = 0; i < s->nnode; i++) {
    const PetscReal *x = s->node_x + 3 * i;

    u[3 * i + 1] = (PetscCosReal(angle) - 1.) * x[1] - PetscSinReal(angle) * x[2];
    u[3 * i + 2] = PetscSinReal(angle) * x[1] + (PetscCosReal(angle) - 1.) * x[2];
  }
  SB_CHECK(SbSpaceRigidStrain(s, u, &body) < 1e-12, "strain of a rotation");
  PetscCall(SbSpaceAddInternalForce(s, &(SbStage){.shift_k = 1., .u = u}, f));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (s->node_body[i / 3])
      NEAR(f[i], 0., 1e-12 * E * 0.03);
  for (PetscInt i = 0; i < s->nnode; i++)
    for (int k = 0; k < 3; k++)
      u[3 * i + k] = k == 0 && s->node_body[i] == STONE ? 1e-3 * s->node_x[3 * i] : 0.;
  most = SbSpaceRigidStrain(s, u, &body);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, m->comm));
  NEAR(most, 1.0005e-3, 1e-9);
  PetscCall(PetscFree2(u, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The acceleration at the start is that of a spin: kinetic energy and angular momentum do not
   change. */
static PetscErrorCode check_spin(SbModel m)
{
  const SbSpace s = m->space;
  Vec U, V;
  const PetscReal *u, *v;
  PetscReal *f;
  PetscReal sum[3] = {0.}; /* f . x, m v . v, f . v */

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(SbSpaceCreateVec(s, &V));
  PetscCall(SbModelInitialState(m, U, V));
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(SbSpaceGetLocalRead(s, V, &v));
  PetscCall(SbSpaceAddInternalForce(s, &(SbStage){.shift_k = 1., .u = u}, f));

  // f is minus mass times the acceleration w' x r + w x (w x r): the sum of f . x is that of m v .
  // v, and that of f . v zero, as the energy does not change
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (s->node_body[i] != STONE)
      continue;
    sum[0] += SbDot3(f + 3 * i, s->node_x + 3 * i);
    sum[1] += s->node_mass[i] * SbDot3(v + 3 * i, v + 3 * i);
    sum[2] += SbDot3(f + 3 * i, v + 3 * i);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(SbSpaceRestoreLocalRead(s, V, &v));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPI_SUM, m->comm));
  SB_CHECK(sum[1] > 0.1, "the stone spins with m v^2 of %g J", (double)sum[1]);
  NEAR(sum[0], sum[1], 1e-3 * sum[1]);
  NEAR(sum[2], 0., 1e-3 * sum[1]);
  PetscCall(PetscFree(f));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbModel m;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_options(SCENE));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &m));
  m->dynamic = PETSC_TRUE;
  PetscCall(SbModelSetUp(m));
  PetscCall(check_moments(m));
  PetscCall(check_basis(m));
  PetscCall(check_sets(m));
  PetscCall(check_strain(m));
  PetscCall(check_spin(m));
  PetscCall(SbModelDestroy(&m));
  SB_TEST_END();
}
