// @ranks 1 3
/*
  Face terms of CR and DG against their formula: for each face the jump at three points of a
  quadrature rule that is exact for squares, from the functions of the two cells at these positions,
  without the face nodes used in jump.c. Constrained DG faces add the difference of the mean to that
  of their support.
*/
#include "../../src/fem/fem_impl.h"
#include "../scene.h"

/* Two bodies, one of them with tets of many shapes; gammas other than the defaults. */
static const char *const scene =
  "-bodies a,b -body_a_mesh box:0.5,0.4,0.3:2 -body_a_material corotated -body_a_young 1e5 "
  "-body_a_poisson 0.3 -body_a_density 1000 -body_a_element %s -body_a_gamma1 0.7 %s "
  "-body_b_mesh tests/data/two_cubes_41.msh -body_b_scale 0.1 -body_b_translate 0,0,2 "
  "-body_b_material stable_neohookean -body_b_young 3e5 -body_b_poisson 0.45 -body_b_density 500 "
  "-body_b_element %s "
  "-effects damping,clamp -effect_damping_beta 0.02 -effect_clamp_type fixed -effect_clamp_on "
  "a.xmin";

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.05 * PetscSinReal(30. * x[0] + x[1]);
  v[1] = 0.04 * PetscCosReal(20. * x[1] - x[2]) * x[0];
  v[2] = 0.06 * PetscSinReal(x[0] + 40. * x[2]) * x[0];
}

static void affine(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.3 + 0.1 * x[0] - 0.7 * x[1];
  v[1] = 0.2 * x[2] - 0.4 * x[1] + 0.1 * x[0];
  v[2] = 0.1 - 0.3 * x[2] + 0.5 * x[0];
}

/* Adds a different value to every node, the same on any number of ranks. */
static PetscErrorCode roughen(SbSpace s, PetscReal size, Vec U)
{
  PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(U, &u));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    u[i] += size * PetscSinReal(17. * (PetscReal)(3 * s->node_orig[i / 3] + i % 3));
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Value of a cell's function at a point: nodal values times 1 - 3 times a ratio of volumes. */
static void cell_value(SbSpace s, PetscInt cell, const PetscReal u[], const PetscReal at[3],
                       PetscReal value[3])
{
  const PetscInt *v = s->mesh->cell + 4 * cell;

  for (int k = 0; k < 3; k++)
    value[k] = 0.;
  for (int a = 0; a < 4; a++) {
    const PetscReal *o = s->mesh->x + 3 * v[(a + 1) % 4];
    const PetscReal *p = s->mesh->x + 3 * v[(a + 2) % 4];
    const PetscReal *q = s->mesh->x + 3 * v[(a + 3) % 4];
    const PetscReal *top = s->mesh->x + 3 * v[a];
    PetscReal e[3], f[3], n[3], here[3], there[3];

    for (int k = 0; k < 3; k++) {
      e[k] = p[k] - o[k];
      f[k] = q[k] - o[k];
      here[k] = at[k] - o[k];
      there[k] = top[k] - o[k];
    }
    SbCross(e, f, n);
    for (int k = 0; k < 3; k++)
      value[k] +=
        (1. - 3. * SbDot3(here, n) / SbDot3(there, n)) * u[3 * s->cell_node[4 * cell + a] + k];
  }
}

static PetscReal cell_volume(SbMesh mesh, PetscInt cell)
{
  PetscReal e[9], n[3];

  for (int k = 0; k < 9; k++)
    e[k] = mesh->x[3 * mesh->cell[4 * cell + 1 + k / 3] + k % 3] -
           mesh->x[3 * mesh->cell[4 * cell] + k % 3];
  SbCross(e + 3, e + 6, n);
  return SbDot3(e, n) / 6.;
}

/* Vertices of the face i % 4 of cell i / 4; returns its area. */
static PetscReal face_corners(SbMesh mesh, PetscInt i, const PetscReal *corner[3])
{
  PetscReal edge[6], n[3];

  for (PetscInt a = 0, k = 0; a < 4; a++)
    if (a != i % 4)
      corner[k++] = mesh->x + 3 * mesh->cell[4 * (i / 4) + a];
  for (int k = 0; k < 6; k++)
    edge[k] = corner[1 + k / 3][k % 3] - corner[0][k % 3];
  SbCross(edge, edge + 3, n);
  return 0.5 * PetscSqrtReal(SbDot3(n, n));
}

/* The part of the mean of |J|^2 over a face that is due to the slopes of J, J[3] at the middles of
   its edges, as long and flat cells of a height h have it; src/fem/face_shape.c. */
static PetscReal slope_square(const PetscReal *const corner[3], PetscReal h,
                              const PetscReal J[3][3])
{
  PetscReal e[3], g[3], n[3], f[3], x[3][2];
  PetscReal M[3] = {0.};
  PetscReal moment[2], part[2];
  PetscReal square = 0.;

  SbSubtract(corner[1], corner[0], e);
  SbSubtract(corner[2], corner[0], g);
  SbCross(e, g, n);
  (void)SbNormalise(n);
  (void)SbNormalise(e);
  SbCross(n, e, f);
  for (int k = 0; k < 3; k++) {
    PetscReal middle[3];

    for (int c = 0; c < 3; c++)
      middle[c] = (corner[k][c] + corner[(k + 1) % 3][c]) / 2. -
                  (corner[0][c] + corner[1][c] + corner[2][c]) / 3.;
    x[k][0] = SbDot3(middle, e);
    x[k][1] = SbDot3(middle, f);
    M[0] += x[k][0] * x[k][0] / 3.;
    M[1] += x[k][0] * x[k][1] / 3.;
    M[2] += x[k][1] * x[k][1] / 3.;
  }
  const PetscReal angle = 0.5 * atan2(2. * M[1], M[0] - M[2]);
  const PetscReal axis[2][2] = {{PetscCosReal(angle), PetscSinReal(angle)},
                                {-PetscSinReal(angle), PetscCosReal(angle)}};

  for (int k = 0; k < 2; k++)
    moment[k] = M[0] * PetscSqr(axis[k][0]) + 2. * M[1] * axis[k][0] * axis[k][1] +
                M[2] * PetscSqr(axis[k][1]);
  const PetscReal a = PetscSqrtReal(12. * moment[0]);
  const PetscReal b = PetscMin(a, 1.9494 * PetscSqrtReal(12. * moment[1]));
  const PetscReal H = PetscMin(a, PetscMax(b, 1.78 * h));
  const PetscReal flat = PetscSqr(PetscMin(1., 1.78 * h / b));

  part[0] = flat * PetscSqr(H * b / (a * a));
  part[1] = flat * PetscSqr(H / a);
  for (int k = 0; k < 2; k++) {
    for (int c = 0; c < 3; c++) {
      const PetscReal p = J[1][c] - J[0][c];
      const PetscReal q = J[2][c] - J[0][c];
      const PetscReal dx[4] = {x[1][0] - x[0][0], x[1][1] - x[0][1], x[2][0] - x[0][0],
                               x[2][1] - x[0][1]};
      const PetscReal slope[2] = {(p * dx[3] - q * dx[1]) / (dx[0] * dx[3] - dx[1] * dx[2]),
                                  (q * dx[0] - p * dx[2]) / (dx[0] * dx[3] - dx[1] * dx[2])};

      square += part[k] * moment[k] * PetscSqr(slope[0] * axis[k][0] + slope[1] * axis[k][1]);
    }
  }
  return square;
}

/* Energy of an interior face. */
static PetscReal face_energy(SbModel m, PetscInt i, const PetscReal u[])
{
  const SbSpace s = m->space;
  const SbElement e = SbSpaceCellElement(s, i / 4);
  const SbMaterial law = m->material[s->mesh->cell_body[i / 4]];
  const PetscReal *corner[3];
  const PetscReal area = face_corners(s->mesh, i, corner);
  PetscReal h;
  PetscReal mean[3] = {0., 0., 0.};
  PetscReal J[3][3], square;

  h = (cell_volume(s->mesh, i / 4) + cell_volume(s->mesh, s->mesh->neighbour[i])) / (2. * area);
  for (int k = 0; k < 3; k++) {
    PetscReal at[3], a[3], b[3];

    for (int c = 0; c < 3; c++)
      at[c] = 0.5 * (corner[k][c] + corner[(k + 1) % 3][c]);
    cell_value(s, i / 4, u, at, a);
    cell_value(s, s->mesh->neighbour[i], u, at, b);
    for (int c = 0; c < 3; c++) {
      J[k][c] = a[c] - b[c];
      mean[c] += J[k][c] / 3.;
    }
  }
  square = SbDot3(mean, mean) + slope_square(corner, 3. * h, J);
  return 0.5 * area / h *
         (e->gamma1 * 2. * SbMaterialShearModulus(law) * square +
          e->gamma0 * (2. * SbMaterialShearModulus(law) + SbMaterialVolumetricModulus(law)) *
            SbDot3(mean, mean));
}

/* Energy of a constrained DG face: its mean against that of the rigid support. */
static PetscReal support_energy(SbModel m, PetscInt i, const PetscReal u[])
{
  const SbSpace s = m->space;
  const SbMaterial law = m->material[s->mesh->cell_body[i / 4]];
  const PetscReal *corner[3];
  const PetscReal area = face_corners(s->mesh, i, corner);
  const PetscReal k = (2. * SbMaterialShearModulus(law) + SbMaterialVolumetricModulus(law)) * area /
                      cell_volume(s->mesh, i / 4);
  PetscReal square = 0.;

  for (int c = 0; c < 3; c++)
    square += PetscSqr(u[3 * s->cell_node[i] + c] - u[3 * s->dirichlet_node[i] + c]);
  return SbSpaceCellElement(s, i / 4)->gamma0 * k * area * square;
}

/* Sum over all faces; each rank counts half of a face for each of its cells. */
static PetscErrorCode formula(SbModel m, const PetscReal u[], PetscReal *energy)
{
  const SbSpace s = m->space;

  PetscFunctionBeginUser;
  *energy = 0.;
  for (PetscInt i = 0; i < 4 * s->mesh->ncell_owned; i++) {
    if (!SbSpaceCellElement(s, i / 4)->nodes_per[0] && s->mesh->neighbour[i] >= 0)
      *energy += 0.5 * face_energy(m, i, u);
    if (s->dirichlet_node && s->dirichlet_node[i] >= 0)
      *energy += support_energy(m, i, u);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode energy_of(SbSpace s, const PetscReal u[], SbJumpFactor factor,
                                PetscReal *energy)
{
  PetscFunctionBeginUser;
  *energy = SbJumpEnergy(s, u, factor, NULL);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sum over owned unknowns */
static PetscErrorCode dot(SbSpace s, const PetscReal f[], const PetscReal u[], PetscReal *sum)
{
  PetscFunctionBeginUser;
  *sum = 0.;
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    *sum += f[i] * u[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest difference between K u by the face matrices and the forces f, relative to the largest
   force. */
static PetscErrorCode by_matrix(SbSpace s, const PetscReal u[], const PetscReal f[],
                                PetscReal *worst)
{
  const PetscInt *node;
  const PetscInt nbatch = SbJumpCliques(s, &node);
  PetscReal *g;
  PetscReal largest = 0.;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &g));
  for (PetscInt k = 0; k < nbatch * SB_BATCH; k++) {
    const PetscInt *face = node + k / SB_BATCH * 8 * SB_BATCH + k % SB_BATCH;
    PetscReal K[8][8];

    SbJumpMatrix(s, k / SB_BATCH, k % SB_BATCH, K);
    for (int p = 0; p < 8; p++) {
      PetscReal sum = 0.;
      PetscReal size = 0.;

      for (int q = 0; q < 8; q++) {
        SB_CHECK(K[p][q] == K[q][p], "the matrix of a face is not symmetric");
        sum += K[p][q];
        size += PetscAbsReal(K[p][q]);
        for (int c = 0; c < 3; c++)
          g[3 * face[p * SB_BATCH] + c] += K[p][q] * u[3 * face[q * SB_BATCH] + c];
      }
      SB_CHECK_NEAR(sum, 0., 1e-15 * size, "force of a translation");
    }
  }
  *worst = 0.;
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    largest = PetscMax(largest, PetscAbsReal(f[i]));
    *worst = PetscMax(*worst, PetscAbsReal(f[i] - g[i]));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPI_MAX, s->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, 1, MPIU_REAL, MPI_MAX, s->comm));
  *worst /= largest;
  PetscCall(PetscFree(g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy, force and matrix of one state, and the force on another one: the form is symmetric. */
static PetscErrorCode check_state(SbModel m, const char *what, const PetscReal u[],
                                  const PetscReal w[])
{
  const SbSpace s = m->space;
  PetscReal *f, *fw, energy, exact, product, other, damping, worst, beta;
  PetscReal largest = 0.;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(PetscCalloc1(3 * s->nnode, &fw));
  SbJumpAdd(s, u, SB_JUMP_STIFFNESS, f);
  SbJumpAdd(s, w, SB_JUMP_STIFFNESS, fw);
  PetscCall(formula(m, u, &exact));
  PetscCall(energy_of(s, u, SB_JUMP_STIFFNESS, &energy));
  PetscCall(
    PetscPrintf(m->comm, "  %s: energy %.12g J, by the formula %.12g J\n", what, energy, exact));
  SB_CHECK(energy > 0., "%s: energy %g", what, energy);
  SB_CHECK_NEAR(energy, exact, 1e-12 * exact, "energy against the formula");
  PetscCall(dot(s, f, u, &product));
  SB_CHECK_NEAR(0.5 * product, energy, 1e-13 * energy, "1/2 x . K x");
  PetscCall(dot(s, f, w, &product));
  PetscCall(dot(s, fw, u, &other));
  SB_CHECK_NEAR(product, other, 1e-13 * energy, "w . K x and x . K w");
  PetscCall(by_matrix(s, u, f, &worst));
  SB_CHECK(worst < 1e-14, "%s: matrices and forces differ by %g", what, worst);
  PetscCall(PetscArrayzero(fw, 3 * s->nnode));
  SbJumpAdd(s, u, SB_JUMP_DAMPING, fw);
  beta = s->beta[s->region[0].body];
  SB_CHECK(beta == 0.02, "beta is %g", beta);
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    largest = PetscMax(largest, PetscAbsReal(f[i]));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    SB_CHECK_NEAR(fw[i], beta * f[i], 1e-14 * beta * largest, "force of damping");
  PetscCall(energy_of(s, u, SB_JUMP_DAMPING, &damping));
  SB_CHECK_NEAR(damping, beta * energy, 1e-13 * beta * energy, "power of damping");
  PetscCall(PetscFree(f));
  PetscCall(PetscFree(fw));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A field without jumps: only rounding, relative to the nodal stiffness times the displacement. */
static PetscErrorCode check_affine(SbModel m, const PetscReal u[])
{
  const SbSpace s = m->space;
  PetscReal *f, energy;
  PetscReal worst = 0.;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  SbJumpAdd(s, u, SB_JUMP_STIFFNESS, f);
  PetscCall(energy_of(s, u, SB_JUMP_STIFFNESS, &energy));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    worst = PetscMax(worst, PetscAbsReal(f[i]));
  SB_CHECK(worst < 1e-11 * 1e5 && energy < 1e-24 * 1e5, "affine: force %g N, energy %g J", worst,
           energy);
  PetscCall(PetscFree(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_scene(const char *first, const char *second)
{
  TestScene t;
  char what[64];
  const PetscReal *u, *w;
  Vec U, W;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(what, sizeof(what), "%s and %s", first, second));
  PetscCall(test_open(&t, scene, first, strcmp(first, "dg") ? "" : "-body_a_gamma0 3", second));
  PetscCall(SbSpaceCreateVec(t.model->space, &U));
  PetscCall(SbSpaceCreateVec(t.model->space, &W));
  PetscCall(test_fill(t.model, affine, U));
  PetscCall(SbSpaceGetLocalRead(t.model->space, U, &u));
  PetscCall(check_affine(t.model, u));
  PetscCall(SbSpaceRestoreLocalRead(t.model->space, U, &u));
  PetscCall(test_fill(t.model, wave, U));
  PetscCall(roughen(t.model->space, 0.01, U));
  PetscCall(test_fill(t.model, affine, W));
  PetscCall(roughen(t.model->space, 0.003, W));
  PetscCall(SbSpaceGetLocalRead(t.model->space, U, &u));
  PetscCall(SbSpaceGetLocalRead(t.model->space, W, &w));
  PetscCall(check_state(t.model, what, u, w));
  PetscCall(SbSpaceRestoreLocalRead(t.model->space, W, &w));
  PetscCall(SbSpaceRestoreLocalRead(t.model->space, U, &u));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&W));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_scene("cr", "cr"));
  PetscCall(check_scene("dg", "dg"));
  PetscCall(check_scene("cr", "dg"));
  PetscCall(check_scene("dg", "p1"));
  SB_TEST_END();
}
