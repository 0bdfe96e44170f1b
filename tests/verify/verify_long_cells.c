// @ranks 1
/*
  Long and flat cells with CR and DG: strain energies by the length of cells over their width, or
  their width over their height, relative to those of P2 on round cells.

    bar    2 x 0.1 x 0.1 m, clamped, traction across its end
    plate  0.6 x 0.3 x 0.05 m, likewise: flat cells
    twist  0.8 x 0.1 x 0.1 m, its end turned by 45 degrees, as much per length as 90 degrees of
    twice
           the length
    cook   Cook's membrane, plane strain, 8 cells across
    bend   an arc of 45 degrees and radius 100 m, 1 x 1 m, E = 10 MPa, nu 0, 600 N across its plane
           at the end (Bathe and Bolourchi 1979): large rotations
    column 0.4 x 0.2 x 0.2 m, 2 to 8 x 4 x 4 cells, its ends pressed together by a fifth, or one
    moved
           to the side by as much: stresses that the penalty has to bear

  With one penalty for all slopes of the jump, bars and plates of cells 10 times as long bent by a
  tenth of what they should; docs/reports/locking.md has the table that this test prints.
*/
#include "verify.h"

#define LENGTHS 8
#define PULLED                                                                            \
  "-body_a_material linear -body_a_young 5e6 -effects hold,pull -effect_hold_type fixed " \
  "-effect_hold_on xmin -effect_pull_type traction -effect_pull_on xmax -effect_pull_vector "

/* Strain energy at the end of a static run, J. */
static PetscErrorCode energy_of(const char *mesh, const char *element, const char *scene,
                                PetscReal *energy)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t, "-bodies a -body_a_mesh %s -body_a_element %s -body_a_density 1000 -time static %s", mesh,
    element, scene));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, element));
  SB_CHECK(t.run->clock.t == 1., "%s, %s: load factor %g", mesh, element, t.run->clock.t);
  *energy = t.run->state.energies.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A box of `size`, n cells along its shortest edge, cells of lengths[] along the others that
   stretch[] names; most: bounds of the error, too small and too large. */
static PetscErrorCode check_box(const char *what, const PetscReal size[3], const int stretch[3],
                                const PetscReal lengths[LENGTHS], PetscInt n, const char *scene,
                                const char *element, const PetscReal most[2])
{
  PetscReal energy, right;
  char mesh[128];

  PetscFunctionBeginUser;
  for (int i = -1; i < LENGTHS; i++) {
    const PetscReal length = i < 0 ? 1. : lengths[i];
    PetscInt cells[3];

    if (length == 0.)
      continue;
    for (int k = 0; k < 3; k++)
      cells[k] = (PetscInt)PetscMax(
        1., (PetscReal)(i < 0 ? 2 : n) * size[k] / size[2] / (stretch[k] ? length : 1.) + 0.5);
    PetscCall(PetscSNPrintf(mesh, sizeof(mesh), "box:%g,%g,%g:%d,%d,%d", size[0], size[1], size[2],
                            (int)cells[0], (int)cells[1], (int)cells[2]));
    PetscCall(energy_of(mesh, i < 0 ? "p2" : element, scene, i < 0 ? &right : &energy));
    if (i < 0)
      continue;
    test_print("  %s, %s, %d cells across, %g: %+.1f %%\n", what, element, (int)n, length,
               100. * (energy / right - 1.));
    SB_CHECK(energy > (1. - most[0]) * right && energy < (1. + most[1]) * right,
             "%s, %s, %d cells across, length %g: energy %g, of p2 %g", what, element, (int)n,
             length, energy, right);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_boxes(void)
{
  const PetscReal bar[3] = {2., 0.1, 0.1};
  const PetscReal plate[3] = {0.6, 0.3, 0.05};
  const int along[3] = {1, 0, 0};
  const int flat[3] = {1, 1, 0};
  const PetscReal lengths[LENGTHS] = {1., 1.5, 2., 3., 4., 6., 8., 10.};
  const PetscReal flats[LENGTHS] = {1., 1.5, 2., 3., 4., 6.};
  const PetscReal few[LENGTHS] = {2., 6.};
  const char *const elements[3] = {"cr", "dg", "cr"};

  PetscFunctionBeginUser;
  for (int e = 0; e < 3; e++) {
    const PetscReal nu = e < 2 ? 0.3 : 0.4999;
    char pull[256], press[256];

    PetscCall(PetscSNPrintf(pull, sizeof(pull), PULLED "0;3;7 -body_a_poisson %g", (double)nu));
    PetscCall(PetscSNPrintf(press, sizeof(press), PULLED "0;0;7 -body_a_poisson %g", (double)nu));
    for (PetscInt n = 2; n <= 4; n += 2) {
      const PetscReal some[2] = {n == 2 ? 0.17 : 0.07, 0.02};
      const PetscReal more[2] = {n == 2 ? 0.21 : 0.11, 0.02};

      PetscCall(check_box("bar", bar, along, e == 1 ? few : lengths, n, pull, elements[e], some));
      PetscCall(check_box("plate", plate, flat, e == 1 ? few : flats, n, press, elements[e], more));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Torsion is harder than bending with two cells across, and hardest with cells twice as long as
   wide. */
static PetscErrorCode check_twist(void)
{
  const PetscReal bar[3] = {0.8, 0.1, 0.1};
  const int along[3] = {1, 0, 0};
  const PetscReal lengths[LENGTHS] = {1., 2., 4., 8.};
  const PetscReal few[LENGTHS] = {2.};

  PetscFunctionBeginUser;
  for (PetscInt n = 2; n <= 4; n += 2) {
    const PetscReal most[2] = {0.07, n == 2 ? 0.47 : 0.1};

    for (int e = 0; e < (n == 2 ? 2 : 1); e++)
      PetscCall(check_box(
        "twist", bar, along, e ? few : lengths, n,
        "-body_a_material stable_neohookean -body_a_young 1e6 -body_a_poisson 0.3 -effects "
        "hold,turn -effect_hold_type fixed -effect_hold_on xmin -effect_turn_type "
        "prescribed_displacement -effect_turn_on xmax -effect_turn_angle 45 -effect_turn_axis "
        "1,0,0 -effect_turn_axis_point 0,0.05,0.05",
        e ? "dg" : "cr", most));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void cook_map(const VerifyPlace *place, PetscReal x[3])
{
  x[1] = 44. * x[0] + x[1] * (44. - 28. * x[0]);
  x[0] *= 48.;
  x[2] *= 4. * (PetscReal)place->n[2];
}

static void bend_map(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  const PetscReal angle = PETSC_PI / 4. * x[0];
  const PetscReal radius = 100.5 - x[1];

  x[0] = radius * PetscSinReal(angle);
  x[1] = 100. - radius * PetscCosReal(angle);
}

/* Mapped boxes of cells[k], the first one with P2. */
static PetscErrorCode check_mapped(const char *what, VerifyMap map, PetscInt count,
                                   const PetscInt cells[][3], const char *scene,
                                   const char *element, PetscReal most)
{
  PetscReal energy;
  PetscReal right = 0.;
  char mesh[512];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < count; k++) {
    PetscCall(verify_mesh_write(cells[k], map, NULL, mesh));
    PetscCall(energy_of(mesh, k ? element : "p2", scene, k ? &energy : &right));
    if (k == 0)
      continue;
    test_print("  %s, %s, %d x %d x %d cells: %+.1f %%\n", what, element, (int)cells[k][0],
               (int)cells[k][1], (int)cells[k][2], 100. * (energy / right - 1.));
    SB_CHECK_NEAR(energy, right, most * right, what);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_column(PetscReal nu)
{
  static const PetscInt cells[3][3] = {{8, 4, 4}, {4, 4, 4}, {2, 4, 4}};
  static const char *const moves[2] = {"-0.08*t;0;0", "0;0.08*t;0"};
  static const PetscReal most[2][3] = {{0.03, 0.03, 0.03}, {0.04, 0.05, 0.16}};

  PetscFunctionBeginUser;
  for (int m = 0; m < 2; m++) {
    PetscReal right = 0.;

    for (int k = -1; k < 3; k++) {
      const PetscInt *n = cells[PetscMax(k, 0)];
      PetscReal energy;
      char mesh[64], scene[512];

      PetscCall(PetscSNPrintf(mesh, sizeof(mesh), "box:0.4,0.2,0.2:%d,%d,%d", (int)n[0], (int)n[1],
                              (int)n[2]));
      PetscCall(PetscSNPrintf(
        scene, sizeof(scene),
        "-body_a_material neohookean -body_a_young 5e6 -body_a_poisson %g -effects hold,move "
        "-effect_hold_type fixed -effect_hold_on xmin -effect_move_type prescribed_displacement "
        "-effect_move_on xmax -effect_move_displacement %s -static_steps 4",
        (double)nu, moves[m]));
      PetscCall(energy_of(mesh, k < 0 ? "p2" : "cr", scene, &energy));
      if (k < 0) {
        right = energy;
        continue;
      }
      test_print("  column, nu %g, %s, %s: %+.1f %%\n", (double)nu, moves[m], mesh,
                 100. * (energy / right - 1.));
      SB_CHECK_NEAR(energy, right, most[m][k] * right, "energy of a column");
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const PetscInt cook[4][3] = {{12, 8, 1}, {13, 8, 1}, {6, 8, 1}, {4, 8, 1}};
  static const PetscInt bend[5][3] = {{40, 2, 2}, {78, 2, 2}, {39, 2, 2}, {20, 2, 2}, {16, 2, 2}};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_boxes());
  PetscCall(check_twist());
  PetscCall(check_mapped(
    "cook", cook_map, 4, cook,
    "-body_a_material linear -body_a_young 250 -body_a_poisson 0.4999 -sets left,right "
    "-set_left_at plane:1,0,0,0 -set_right_at plane:1,0,0,48 -effects hold,plane,pull "
    "-effect_hold_type fixed -effect_hold_on left -effect_plane_type fixed -effect_plane_on all "
    "-effect_plane_components z -effect_pull_type traction -effect_pull_on right "
    "-effect_pull_vector 0;1/16;0",
    "cr", 0.06));
  PetscCall(check_mapped("bend", bend_map, 5, bend,
                         "-body_a_material stvk -body_a_young 1e7 -body_a_poisson 0 "
                         "-set_end_at plane:1,1,0,100 -sets begin,end -set_begin_at plane:1,0,0,0 "
                         "-effects hold,pull -effect_hold_type fixed -effect_hold_on begin "
                         "-effect_pull_type traction -effect_pull_on end "
                         "-effect_pull_vector 0;0;600 -static_steps 4",
                         "cr", 0.15));
  PetscCall(check_column(0.3));
  PetscCall(check_column(0.4999));
  SB_TEST_END();
}
