// @ranks 1 2 3
/*
  Laws with fibres in runs. A bar between smooth plates along z, pulled or pressed, whose fibres are
  symmetric about the axes: the state is uniform, and its two lateral stretches leave the sides
  without stress. Energy and volume are those of the law at that state, found here from the law's
  stress by Newton's method. With fibres of random directions, one per tet: the tangent of the body
  is the derivative of its residual, and energies are alike on any number of ranks.

  The beam of Land et al. 2015, problem 1: 10 x 1 x 1 mm, fixed at one end, of the law of Guccione
  with fibres along it, bent by a follower pressure of 4 Pa in one load step. The height of the tip,
  the upper edge of the free end, is 4.0 to 4.2 mm in the codes that took part.
*/
#include "../laws.h"
#include "verify.h"
#include "../remesh.h"

#define LAWS 4
static const char *const laws[LAWS][2] = {
  {"holzapfel_gasser_ogden",
   "-body_cube_mu 3e3 -body_cube_k1 5e3 -body_cube_k2 2 -body_cube_kappa 0.1 -body_cube_angles "
   "35,-35 -body_cube_fibre 0,0,1 -body_cube_sheet 0,1,0"},
  {"guccione",
   "-body_cube_c 2e3 -body_cube_bf 8 -body_cube_bt 2 -body_cube_bfs 4 -body_cube_fibre 0,0,1"},
  {"holzapfel_ogden",
   "-body_cube_a 3e3 -body_cube_b 2 -body_cube_a_f 4e3 -body_cube_b_f 3 -body_cube_a_s 2e3 "
   "-body_cube_b_s 1 -body_cube_a_fs 1e3 -body_cube_b_fs 2 -body_cube_fibre 0,0,2 "
   "-body_cube_sheet 0,3,1"},
  {"transversely_isotropic",
   "-body_cube_mu 3e3 -body_cube_mu_fibre 5e3 -body_cube_young_fibre 3e4 -body_cube_fibre 0,0,1"},
};

/* Lateral stretches at the stretch l along z; psi there. */
static void find_state(SbMaterial m, PetscReal l, PetscReal r[2], PetscReal *psi)
{
  const PetscReal x[3] = {0., 0., 0.};
  PetscReal Q[9];
  SbPack axes[9], F[9], P[9], W;
  struct _p_SbMaterial turned = *m;

  (void)SbMaterialAxes(m, x, NULL, Q);
  for (int k = 0; k < 9; k++)
    for (int n = 0; n < SB_BATCH; n++)
      axes[k][n] = Q[k];
  turned.axes = (const SbPack *)axes;
  r[0] = r[1] = 1. / PetscSqrtReal(l);

  /* Newton's method; derivatives by differences in the lanes 1 and 2 */
  for (int i = 0; i < 60; i++) {
    const PetscReal d = 1e-7;

    for (int n = 0; n < SB_BATCH; n++) {
      for (int k = 0; k < 9; k++)
        F[k][n] = 0.;
      F[0][n] = r[0] + (n == 1 ? d : 0.);
      F[4][n] = r[1] + (n == 2 ? d : 0.);
      F[8][n] = l;
    }
    m->ops.stress(&turned, (const SbPack *)F, P);
    m->ops.energy(&turned, (const SbPack *)F, W);
    const PetscReal a = (P[0][1] - P[0][0]) / d;
    const PetscReal b = (P[0][2] - P[0][0]) / d;
    const PetscReal c = (P[4][1] - P[4][0]) / d;
    const PetscReal e = (P[4][2] - P[4][0]) / d;
    const PetscReal det = a * e - b * c;

    r[0] -= (e * P[0][0] - b * P[4][0]) / det;
    r[1] -= (a * P[4][0] - c * P[0][0]) / det;
  }
  *psi = W[0];
}

static PetscErrorCode check_bar(int law, const char *element, PetscReal nu, PetscReal l)
{
  PetscReal r[2], psi;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies cube -body_cube_mesh box:0.1,0.1,0.1:2 -body_cube_material %s %s "
              "-body_cube_density 1000 -body_cube_poisson %.17g -body_cube_element %s "
              "-effects x,y,z,pull -effect_x_type fixed -effect_x_on xmin -effect_x_components x "
              "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed "
              "-effect_z_on zmin -effect_z_components z -effect_pull_type prescribed_displacement "
              "-effect_pull_on zmax -effect_pull_components z -effect_pull_displacement 0,0,%.17g "
              "-time static -static_steps 2 -solver direct -snes_rtol 1e-11",
              laws[law][0], laws[law][1], nu, element, 0.1 * (l - 1.)));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, element));
  find_state(t.model->material[0], l, r, &psi);
  const PetscReal J = l * r[0] * r[1];

  test_print("  %s, %s, nu %g, stretch %g: volume %.9f (exact %.9f), energy %.9f J (%.9f), %d "
             "iterations\n",
             laws[law][0], element, nu, l, 1e3 * t.run->state.energies.volume, J,
             t.run->state.energies.strain, 1e-3 * psi, (int)t.run->counters.newton);
  SB_CHECK_NEAR(1e3 * t.run->state.energies.volume, J, 1e-7, "volume");
  SB_CHECK_NEAR(t.run->state.energies.strain, 1e-3 * psi, 1e-8 * 1e-3 * psi, "energy");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void along(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(20. * x[1]);
  v[1] = PetscCosReal(30. * x[2] + x[0]);
  v[2] = PetscSinReal(40. * x[0]);
}

static void bend(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.3 * x[2] * x[1] + 0.1 * x[0];
  v[1] = 2. * x[0] * x[0];
  v[2] = 0.2 * x[0] - 0.5 * x[1] * x[0];
}

/* Residual and energy of all ranks at a displacement. */
static PetscErrorCode evaluate(SbSpace s, Vec U, Vec R, PetscReal *energy)
{
  SbStage stage = {.shift_k = 1.};
  PetscReal *f, least, volume, own;
  PetscInt inverted;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  PetscCall(SbSpaceGetLocalWrite(s, R, &f));
  PetscCall(PetscArrayzero(f, 3 * s->nnode));
  PetscCall(SbSpaceAddInternalForce(s, &stage, f));
  PetscCall(SbSpaceRestoreLocalWrite(s, R, &f));
  SbSpaceStrainEnergy(s, stage.u, NULL, &own, &least, &inverted, &volume);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCallMPI(MPI_Allreduce(&own, energy, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Directions that differ from tet to tet: the residual is the derivative of the energy, and the
   tangent that of the residual. The energy is returned. */
static PetscErrorCode check_directions(MPI_Comm comm, int law, const char *element,
                                       PetscReal *energy)
{
  const PetscReal d = 1e-6;
  SbStage stage = {.shift_k = 1.};
  TestScene t;
  Vec U, V, W, R[3], C;
  PetscReal e[3], work, size, off;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(test_open_on(
    comm, NULL, &t,
    "-bodies cube -body_cube_mesh box:0.2,0.1,0.1:3 -body_cube_material %s %s "
    "-body_cube_fibre sin(50*x)+0.1,cos(30*y),z*20 -body_cube_sheet 0.3-z,x,cos(40*x) "
    "-body_cube_density 1000 -body_cube_poisson 0.45 -body_cube_element %s -solver direct "
    "-body_cube_tangent exact -time newmark -ts_dt 1e-3 -ts_max_time 2e-3",
    laws[law][0], laws[law][1], element));
  const SbSpace s = t.model->space;

  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(SbSpaceCreateVec(s, &V));
  PetscCall(SbSpaceCreateVec(s, &W));
  PetscCall(SbSpaceCreateVec(s, &C));
  for (int k = 0; k < 3; k++)
    PetscCall(SbSpaceCreateVec(s, &R[k]));
  PetscCall(test_fill(t.model, bend, U));
  PetscCall(test_fill(t.model, along, V));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A));
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  PetscCall(SbSpaceAssembleTangent(s, &stage, A));
  PetscCall(SbSpaceFinishTangent(s, A));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCall(evaluate(s, U, R[0], &e[0]));
  for (int k = 1; k < 3; k++) {
    PetscCall(VecWAXPY(W, k == 1 ? d : -d, V, U));
    PetscCall(evaluate(s, W, R[k], &e[k]));
  }
  PetscCall(VecDot(R[0], V, &work));
  SB_CHECK_NEAR((e[1] - e[2]) / (2. * d), work, 1e-7 * PetscAbsReal(work), "work of the residual");
  PetscCall(MatMult(A, V, C));
  PetscCall(VecNorm(C, NORM_2, &size));
  PetscCall(VecAXPY(C, -1. / (2. * d), R[1]));
  PetscCall(VecAXPY(C, 1. / (2. * d), R[2]));
  PetscCall(VecNorm(C, NORM_2, &off));
  test_print("  %s, %s: energy %.12g J, tangent off by %.1e\n", laws[law][0], element, e[0],
             off / size);

  /* fibres of some points begin or cease to bear within the differences */
  SB_CHECK(off < 1e-4 * size, "%s, %s: tangent off by %g", laws[law][0], element, off / size);
  *energy = e[0];
  for (int k = 0; k < 3; k++)
    PetscCall(VecDestroy(&R[k]));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&W));
  PetscCall(VecDestroy(&C));
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_ranks(int law, const char *element)
{
  PetscReal all, one;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_directions(PETSC_COMM_WORLD, law, element, &all));
  if (size == 1)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(check_directions(PETSC_COMM_SELF, law, element, &one));
  SB_CHECK_NEAR(all, one, 1e-12 * one, "energy on one rank and on all");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a re-meshing the tets have the directions of their own places at rest. */
static PetscErrorCode check_remesh(void)
{
  TestScene t;
  PetscReal *value;
  PetscReal worst = 0.;
  int calls = 0;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t, "-bodies cube -body_cube_mesh box:0.1,0.1,0.1:3 -body_cube_material guccione -body_cube_c "
        "2e3 -body_cube_bf 8 -body_cube_bt 2 -body_cube_bfs 4 -body_cube_fibre 1,20*z,x "
        "-body_cube_bulk 2e4 -body_cube_density 1000 -body_cube_angular_velocity 0,3,1 -time "
        "newmark -ts_dt 0.01 -ts_max_time 0.03 -remesh_times 0.02"));
  SbRemeshSetMesher(t.remesh, fixture_cone, &calls);
  PetscCall(test_scene_solve(&t));
  PetscCallMPI(MPI_Bcast(&calls, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  const SbMesh mesh = t.model->mesh;

  SB_CHECK(calls == 1 && PetscAbsReal(t.run->clock.t - 0.03) < 1e-12, "meshed %d times, end at %g",
           calls, t.run->clock.t);
  PetscCall(PetscMalloc1(3 * mesh->ncell_owned, &value));
  SbSpaceCellAxis(t.model->space, 0, value);
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal x[3] = {0., 0., 0.};

    for (int k = 0; k < 12; k++)
      x[k % 3] += mesh->x[3 * mesh->cell[4 * c + k / 3] + k % 3] / 4.;
    const PetscReal f[3] = {1., 20. * x[2], x[0]};
    for (int k = 0; k < 3; k++)
      worst = PetscMax(worst, PetscAbsReal(value[3 * c + k] - f[k] / PetscSqrtReal(SbDot3(f, f))));
  }
  SB_CHECK(worst < 1e-14, "directions are off by %g", worst);
  PetscCall(PetscFree(value));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Explicit steps of the length that the program chooses, with fibres a thousand times as stiff as
   the matrix, which a velocity stretches: the energy stays what it was at first. */
static PetscErrorCode check_explicit(const char *element)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies cube -body_cube_mesh box:0.1,0.1,0.2:2 -body_cube_material holzapfel_gasser_ogden "
    "-body_cube_mu 1e3 -body_cube_k1 1e6 -body_cube_k2 1 -body_cube_fibre 0,0,1 -body_cube_poisson "
    "0.4 -body_cube_density 1000 -body_cube_velocity 0,0,z -body_cube_element %s "
    "-time euler_symplectic -ts_max_time 0.02",
    element));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(test_scene_solve(&t));
  const PetscReal energy = t.run->state.energies.strain + t.run->state.energies.kinetic;
  const PetscReal first = 0.5 * 2. * 0.04 / 3.; /* 2 kg, mean of z^2; lumped masses have more */

  test_print("  explicit, %s: %g J after %d steps, %g J at first\n", element, energy,
             (int)t.run->clock.step, first);
  SB_CHECK(energy > 0.9 * first && energy < 1.3 * first, "%s: energy %g J, at first %g J", element,
           energy, first);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_beam(const char *element)
{
  TestScene t;
  PetscReal height = 0.;
  PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies beam -body_beam_mesh box:0.01,0.001,0.001:40,4,4 -body_beam_element %s "
    "-body_beam_material guccione -body_beam_c 2e3 -body_beam_bf 8 -body_beam_bt 2 -body_beam_bfs "
    "4 "
    "-body_beam_bulk 1e6 -effects clamp,press -effect_clamp_type fixed -effect_clamp_on xmin "
    "-effect_press_type pressure -effect_press_on zmin -effect_press_value 4 -time static "
    "-static_steps 1 -solver direct",
    element));
  PetscCall(verify_solve(&t, element));
  PetscCall(verify_gather(t.model, t.run->state.U, &u));
  for (PetscInt i = 0; i < t.model->mesh->nvert_owned; i++) {
    const PetscReal *x = t.model->mesh->x + 3 * i;

    if (PetscAbsReal(x[0] - 0.01) < 1e-9 && PetscAbsReal(x[1]) < 1e-9 &&
        PetscAbsReal(x[2] - 0.001) < 1e-9)
      height = x[2] + u[3 * t.model->mesh->vert_orig[i] + 2];
  }
  PetscCall(PetscFree(u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &height, 1, MPIU_REAL, MPI_MAX, t.model->comm));
  test_print("  beam of Land et al., %s: tip at %.4f mm, %d iterations\n", element, 1e3 * height,
             (int)t.run->counters.newton);
  SB_CHECK(height > 4.0e-3 && height < 4.2e-3, "tip at %g mm", (double)(1e3 * height));
  SB_CHECK(t.run->counters.newton <= 12, "%d iterations", (int)t.run->counters.newton);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};

  SB_TEST_BEGIN(argc, argv);
  for (int law = 0; law < LAWS; law++) {
    for (int e = 0; e < 4; e++) {
      PetscCall(check_bar(law, elements[e], 0.3, 0.8));
      PetscCall(check_bar(law, elements[e], 0.499, 1.3));
      PetscCall(check_ranks(law, elements[e]));
    }
  }
  for (int e = 0; e < 4; e++)
    PetscCall(check_explicit(elements[e]));
  PetscCall(check_remesh());
  PetscCall(check_beam("p2"));
  SB_TEST_END();
}
