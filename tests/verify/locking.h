/*
  locking.h - problems for the comparison of elements near nu = 1/2: each is a function of the mesh,
  Poisson's ratio and further options (element, penalties, solver). Results are evaluated from the
  element's own functions.
*/
#pragma once
#include <time.h>
#include "manufactured.h"
#include "modes.h"

#define LOCKING_TEXT (2 * VERIFY_TEXT)

/* Cost of a run. */
typedef struct {
  PetscInt cells, unknowns, newton, linear;
  double
    seconds; /* CPU time of the solution on this rank, with matrix and factorisation, without mesh and set-up */
} LockingCost;

static inline double locking_clock(void)
{
  struct timespec t;

  (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Opens and solves a scene of options in printf format and of `more`; the caller closes it. */
static inline PetscErrorCode PETSC_ATTRIBUTE_FORMAT(4, 5)
  locking_run(TestScene *t, LockingCost *cost, const char *more, const char *format, ...)
{
  char text[LOCKING_TEXT];
  size_t length;
  double start;
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(PetscVSNPrintf(text, sizeof(text), format, &length, args));
  va_end(args);
  PetscCall(PetscStrlcat(text, " ", sizeof(text)));
  PetscCall(PetscStrlcat(text, more, sizeof(text)));
  PetscCall(test_scene_open(text, t));
  start = locking_clock();
  PetscCall(verify_solve(t, more));
  cost->seconds = locking_clock() - start;
  cost->cells = t->model->mesh->Ncell;
  cost->unknowns = 3 * t->model->space->Nnode;
  cost->newton = t->run->counters.newton;
  cost->linear = t->run->counters.linear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Manufactured solution on n^3 perturbed cells, or on the mesh of a file: relative errors in L2 and
   H1. */
static inline PetscErrorCode locking_cube(PetscInt n, const char *file, PetscReal nu,
                                          const char *more, PetscReal error[2], LockingCost *cost)
{
  TestScene t;
  char scene[VERIFY_TEXT], mesh[512];

  PetscFunctionBeginUser;
  if (!file[0])
    PetscCall(
      verify_distorted_box((const PetscInt[3]){n, n, n}, (const PetscReal[3]){1., 1., 1.}, mesh));
  PetscCall(manufactured_scene(nu, scene, sizeof(scene)));
  PetscCall(locking_run(&t, cost, more, "%s -body_a_mesh %s", scene, file[0] ? file : mesh));
  PetscCall(manufactured_errors(t.model, t.run->state.U, error));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Bar of 0.4 x 0.1 x 0.1 m, x = 0 clamped, under its weight, small strains, n perturbed cells
  across: u_z at the centre of the end face, strain energy.
*/
static inline PetscErrorCode locking_bar(PetscInt n, PetscReal nu, const char *more,
                                         PetscReal value[2], LockingCost *cost)
{
  const PetscReal end[3] = {0.4, 0.05, 0.05};
  PetscReal u[3];
  SbEnergies e;
  TestScene t;
  char mesh[512];

  PetscFunctionBeginUser;
  PetscCall(verify_distorted_box((const PetscInt[3]){4 * n, n, n},
                                 (const PetscReal[3]){0.4, 0.1, 0.1}, mesh));
  PetscCall(locking_run(
    &t, cost, more,
    "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young 5e4 -body_a_poisson %.17g "
    "-body_a_density 1000 -sets root -set_root_at plane:1,0,0,0 -effects clamp,gravity "
    "-effect_clamp_type fixed -effect_clamp_on root -effect_gravity_vector 0,0,-9.81 -time static",
    mesh, nu));
  PetscCall(verify_value_at(t.model, t.run->state.U, end, u));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &e));
  value[0] = u[2];
  value[1] = e.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cook's membrane on a mesh of meshes/cook.geo, left side held, shear 1/16 on the right one, E = 1,
   plane strain: u_y at (48, 60) and (48, 52). */
static inline PetscErrorCode locking_cook(const char *mesh, PetscReal nu, const char *more,
                                          PetscReal value[2], LockingCost *cost)
{
  const PetscReal at[2][3] = {{48., 60., 0.}, {48., 52., 0.}};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(locking_run(
    &t, cost, more,
    "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young 1 -body_a_poisson %.17g "
    "-body_a_density 1 -effects hold,plane,pull -effect_hold_type fixed -effect_hold_on left "
    "-effect_plane_type fixed -effect_plane_on all -effect_plane_components z -effect_pull_type "
    "traction "
    "-effect_pull_on right -effect_pull_vector 0;1/16;0 -time static",
    mesh, nu));
  for (int k = 0; k < 2; k++) {
    PetscReal u[3];

    PetscCall(verify_value_at(t.model, t.run->state.U, at[k], u));
    value[k] = u[1];
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lame's hollow sphere, radii 1 and 2, pressure 1 inside, E = 1. */
static inline PetscReal locking_shell_displacement(PetscReal nu, PetscReal r)
{
  return ((1. - 2. * nu) * r + (1. + nu) * 8. / (2. * r * r)) / 7.;
}

/*
  Adds the squares of one cell: radial and hoop stress, error and exact value, sum[0..3];
  displacement at the centroid, error and exact value, sum[4..5]; sum[6] is the volume.
*/
static inline void locking_shell_cell(const VerifyCell *cell, const PetscReal sigma[6],
                                      PetscReal nu, PetscReal sum[7])
{
  static const int entry[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  const PetscReal centre[4] = {0.25, 0.25, 0.25, 0.25};
  PetscReal p[3] = {0., 0., 0.};
  PetscReal u[3], H[9], r;
  PetscReal radial = 0.;
  PetscReal exact[2], difference[3];

  for (int k = 0; k < 12; k++)
    p[k % 3] += 0.25 * cell->x[k / 3][k % 3];
  verify_cell_at(cell, centre, u, H);
  r = PetscSqrtReal(SbDot3(p, p));
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++)
      radial += p[i] * p[j] * sigma[entry[i][j]] / (r * r);
    difference[i] = u[i] - locking_shell_displacement(nu, r) * p[i] / r;
  }
  exact[0] = (1. - 8. / (r * r * r)) / 7.;
  exact[1] = (1. + 4. / (r * r * r)) / 7.;
  sum[0] += cell->V * PetscSqr(radial - exact[0]);
  sum[1] += cell->V * PetscSqr(exact[0]);
  sum[2] += cell->V * PetscSqr(0.5 * (sigma[0] + sigma[1] + sigma[2] - radial) - exact[1]);
  sum[3] += cell->V * PetscSqr(exact[1]);
  sum[4] += cell->V * SbDot3(difference, difference);
  sum[5] += cell->V * PetscSqr(locking_shell_displacement(nu, r));
  sum[6] += cell->V;
}

typedef struct {
  PetscReal u;         /* relative rms error of the displacement at centroids */
  PetscReal stress[2]; /* relative rms error of radial and hoop stress, all cells */
  PetscReal wall[2];   /* the same, cells with a facet on the inner wall */
  PetscReal at_wall;   /* radial displacement of (1,0,0) / exact */
} LockingShell;

/* Errors of a solved shell. */
static inline PetscErrorCode locking_shell_errors(SbModel m, Vec U, PetscReal nu, LockingShell *e)
{
  const PetscReal at[3] = {1., 0., 0.};
  SbSpace s = m->space;
  PetscReal sum[2][7] = {{0.}, {0.}};
  PetscReal *sigma;
  PetscReal value[3] = {0., 0., 0.};
  const PetscReal *u;
  PetscInt inside;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceFindSet(s, "inside", "locking_shell", &inside));
  PetscCall(PetscMalloc1(6 * s->mesh->ncell, &sigma));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  SbSpaceCellState(s, u, sigma, NULL, NULL, NULL);
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    VerifyCell cell;
    PetscBool wall = PETSC_FALSE;

    for (int f = 0; f < 4; f++)
      wall = (PetscBool)(wall || (s->mesh->face_set[4 * c + f] & SB_SET_BIT(inside)) != 0);
    verify_cell(s, u, c, &cell);
    locking_shell_cell(&cell, sigma + 6 * c, nu, sum[0]);
    if (wall)
      locking_shell_cell(&cell, sigma + 6 * c, nu, sum[1]);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 14, MPIU_REAL, MPI_SUM, m->comm));
  PetscCall(verify_value_at(m, U, at, value));
  e->u = PetscSqrtReal(sum[0][4] / sum[0][5]);
  for (int k = 0; k < 2; k++) {
    e->stress[k] = PetscSqrtReal(sum[0][2 * k] / sum[0][2 * k + 1]);
    e->wall[k] = PetscSqrtReal(sum[1][2 * k] / sum[1][2 * k + 1]);
  }
  e->at_wall = value[0] / locking_shell_displacement(nu, 1.);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene: mesh, nu. */
#define LOCKING_SHELL                                                                        \
  "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young 1 -body_a_poisson %.17g " \
  "-body_a_density 1 -effects x,y,z,push -effect_x_type fixed -effect_x_on x0 "              \
  "-effect_x_components x -effect_y_type fixed -effect_y_on y0 -effect_y_components y "      \
  "-effect_z_type fixed -effect_z_on z0 -effect_z_components z -effect_push_type pressure "  \
  "-effect_push_on inside -effect_push_value 1 -effect_push_follower no -time static"

/* On a mesh of meshes/shell.geo. */
static inline PetscErrorCode locking_shell(const char *mesh, PetscReal nu, const char *more,
                                           LockingShell *e, LockingCost *cost)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(locking_run(&t, cost, more, LOCKING_SHELL, mesh, nu));
  PetscCall(locking_shell_errors(t.model, t.run->state.U, nu, e));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Maps a box to Cook's membrane, (0,0) (48,44) (48,60) (0,44); cells as thick as wide. */
static inline void locking_cook_map(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal bottom = 44. * x[0];
  const PetscReal top = 44. + 16. * x[0];

  x[0] *= 48.;
  x[1] = bottom + x[1] * (top - bottom);
  x[2] *= 48. * (PetscReal)place->n[2] / (PetscReal)place->n[0];
}

/* Maps a box to the beam of Turek and Hron, its left side to the circle (0.2, 0.2) of radius 0.05
   m; one layer in z. */
static inline void locking_beam_map(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal y = 0.19 + 0.02 * x[1];
  const PetscReal root = 0.2 + PetscSqrtReal(0.0025 - PetscSqr(y - 0.2));

  x[0] = root + x[0] * (0.6 - root);
  x[1] = y;
  x[2] *= 0.35 / (PetscReal)place->n[0];
}

/* Turek and Hron's CSM1 (mu 0.5e6 Pa) and CSM2 (2e6 Pa), n cells through the thickness:
   displacement of (0.6, 0.2). */
static inline PetscErrorCode locking_beam(PetscInt n, PetscReal mu, const char *more,
                                          PetscReal u[3], LockingCost *cost)
{
  const PetscInt cells[3] = {35 * n / 2, n, 1};
  const double half = 0.175 / (double)cells[0]; /* of the thickness */
  const PetscReal tip[3] = {0.6, 0.2, 0.};
  TestScene t;
  char mesh[512];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(cells, locking_beam_map, NULL, mesh));
  PetscCall(locking_run(
    &t, cost, more,
    "-bodies a -body_a_mesh %s -body_a_tangent exact -body_a_young %.17g -body_a_poisson 0.4 "
    "-body_a_density 1000 -sets arc -set_arc_at sphere:0.2,0.2,%.17g,%.17g -effects "
    "root,plane,gravity "
    "-effect_root_type fixed -effect_root_on arc -effect_plane_type fixed -effect_plane_on all "
    "-effect_plane_components z -effect_gravity_vector 0,-2,0 -time static",
    mesh, 2.8 * mu, half, PetscSqrtReal(0.0025 + half * half)));
  PetscCall(verify_value_at(t.model, t.run->state.U, tip, u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A run of scenarios/swing.opts to 0.3 s, n cells across, nu: displacement of the end, strain
   energy. */
static inline PetscErrorCode locking_swing(PetscInt n, PetscReal nu, const char *more,
                                           PetscReal value[4], LockingCost *cost)
{
  const PetscReal end[3] = {0.4, 0.05, 0.05};
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(locking_run(
    &t, cost, more,
    "-bodies a -body_a_mesh box:0.4,0.1,0.1:%d -body_a_material corotated -body_a_young 1e5 "
    "-body_a_poisson %.17g -body_a_density 1000 -effects gravity,clamp -effect_gravity_vector "
    "0,0,-9.81 "
    "-effect_clamp_type fixed -effect_clamp_on xmin -time genalpha -time_spectral_radius 0.8 "
    "-ts_dt 0.01 "
    "-ts_max_time 0.3",
    (int)n, nu));
  PetscCall(verify_value_at(t.model, t.run->state.U, end, value));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &e));
  value[3] = e.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar as in scenarios/twist.opts, its end turned by 90 degrees, static: displacement of the
   middle of an edge, strain energy. */
static inline PetscErrorCode locking_twist(PetscInt n, PetscReal nu, const char *more,
                                           PetscReal value[4], LockingCost *cost)
{
  const PetscReal edge[3] = {0.2, 0., 0.};
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(locking_run(
    &t, cost, more,
    "-bodies a -body_a_mesh box:0.4,0.1,0.1:%d -body_a_material stable_neohookean -body_a_young "
    "1e5 "
    "-body_a_poisson %.17g -body_a_density 1000 -effects held,turned -effect_held_type fixed "
    "-effect_held_on xmin -effect_turned_type prescribed_displacement -effect_turned_on xmax "
    "-effect_turned_axis 1,0,0 -effect_turned_axis_point 0,0.05,0.05 -effect_turned_angle 90*t "
    "-time static -static_steps 16 -ksp_max_it 20",
    (int)n, nu));
  PetscCall(verify_value_at(t.model, t.run->state.U, edge, value));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &e));
  value[3] = e.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A soft block, 0.1 x 0.1 x 0.2 m, hangs from its top under gravity, n perturbed cells across;
  `more` has the material and Young's modulus: largest displacement (m), relative change of volume,
  smallest J.
*/
static inline PetscErrorCode locking_hang(PetscInt n, PetscReal nu, const char *more,
                                          PetscReal value[3], LockingCost *cost)
{
  SbEnergies e;
  TestScene t;
  char mesh[512];

  PetscFunctionBeginUser;
  PetscCall(verify_distorted_box((const PetscInt[3]){n, n, 2 * n},
                                 (const PetscReal[3]){0.1, 0.1, 0.2}, mesh));
  PetscCall(locking_run(
    &t, cost, more,
    "-bodies a -body_a_mesh %s -body_a_poisson %.17g -body_a_density 1000 -sets top "
    "-set_top_at plane:0,0,1,0.2 -effects clamp,gravity -effect_clamp_type fixed "
    "-effect_clamp_on top -effect_gravity_vector 0,0,-9.81 -time static -static_steps 4",
    mesh, nu));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &e));
  value[0] = e.max_displacement;
  value[1] = (e.volume - t.model->body[0].volume) / t.model->body[0].volume;
  value[2] = e.min_J;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The same block without support: number of zero eigenvalues (below 1e-6 of E / (rho L^2), L = 0.2
  m), and the lowest two nonzero ones, in that unit.
*/
static inline PetscErrorCode locking_modes(PetscInt n, PetscReal nu, const char *more,
                                           PetscReal value[3])
{
  const PetscReal unit = 5e3 / (1000. * 0.2 * 0.2);
  PetscReal w2[MODES_BLOCK];
  PetscInt zero = 0;
  TestScene t;
  char mesh[512];

  PetscFunctionBeginUser;
  PetscCall(verify_distorted_box((const PetscInt[3]){n, n, 2 * n},
                                 (const PetscReal[3]){0.1, 0.1, 0.2}, mesh));
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young 5e3 "
                      "-body_a_poisson %.17g -body_a_density 1000 -time newmark %s",
                      mesh, nu, more));
  PetscCall(modes_lowest(t.model, unit, w2));
  while (zero < MODES_BLOCK - 2 && w2[zero] < 1e-6 * unit)
    zero++;
  value[0] = (PetscReal)zero;
  value[1] = w2[zero] / unit;
  value[2] = w2[zero + 1] / unit;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar on n cells across: displacement of a point, m, and strain energy, J. */
typedef PetscErrorCode (*LockingProblem)(PetscInt n, PetscReal nu, const char *more,
                                         PetscReal value[4], LockingCost *cost);

/* Largest difference of the displacements, m, and relative difference of the energies. */
static inline void locking_difference(const PetscReal a[4], const PetscReal b[4], PetscReal d[2])
{
  d[0] = 0.;
  for (int k = 0; k < 3; k++)
    d[0] = PetscMax(d[0], PetscAbsReal(a[k] - b[k]));
  d[1] = PetscAbsReal(a[3] - b[3]) / b[3];
}

/* `size` of the displacement, m; cells across of the finer mesh; what CR and DG may differ by, and
   CR from the finer mesh, relative to `size`. */
static inline PetscErrorCode locking_check_pair(const char *what, LockingProblem solve,
                                                const char *options, PetscReal size, PetscInt fine,
                                                const PetscReal limit[2])
{
  PetscReal value[3][4], between[2], finer[2];

  PetscFunctionBeginUser;
  for (int e = 0; e < 3; e++) {
    const char *element = e % 2 ? "dg" : "cr";
    LockingCost cost;
    char more[256];

    PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s %s", element, options));
    PetscCall(solve(e == 2 ? fine : 2, 0.499, more, value[e], &cost));
    test_print("  %s %s n %d: %.5f %.5f %.5f m, %.5f J\n", what, element, (int)(e == 2 ? fine : 2),
               value[e][0], value[e][1], value[e][2], value[e][3]);
  }
  locking_difference(value[1], value[0], between);
  locking_difference(value[0], value[2], finer);
  test_print("  %s: DG - CR %.1e m, %.1e of the energy; n 2 - finer %.1e m, %.1e\n", what,
             between[0], between[1], finer[0], finer[1]);
  SB_CHECK(between[0] < limit[0] * size && between[1] < limit[0], "%s: CR and DG differ by %g m",
           what, between[0]);
  SB_CHECK(finer[0] < limit[1] * size && finer[1] < limit[1],
           "%s: CR changes by %g m, %g of the energy", what, finer[0], finer[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
