// @ranks 1
// @long
// @timeout 1800
/*
  The frame of Lee, Manuel and Rossow ("Large deflections and stability of elastic frames", J. Eng. Mech. Div. ASCE 94, 1968) as a slender solid: a column and a
  beam of the length 120 each, section 2 deep and 3 wide, E = 720, joined rigidly at a right angle and hinged at both ends, with a load on the beam at 24 from the
  corner. The load has a maximum of 1.855 and a minimum of -0.940, and between them the point under the load turns back at 61.01 and at 50.74: snap-through and snap-back.

  References are those of a geometrically exact beam with shear (Reissner 1972), extrapolated from 20 and 40 elements in each member. The mesh is one layer of CR
  tets in plane stress, with an odd number of cells through the depth: a hinge is one triangle in the middle of an end, whose mean is constrained while it turns. It is
  a depth / 18 n off the middle, and the load is shared by two vertices beside it. Bending is extrapolated from two meshes (order 2).
*/
#include "verify.h"

#define LENGTH 120.
#define DEPTH 2.
#define WIDTH 3.
#define AT 24.

/* A bar along the frame, mitred at the corner: x[0] along the middle, x[1] across it, outside first. */
static void frame(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  const PetscReal across = DEPTH * (0.5 - x[1]), s = 2. * x[0];

  (void)at;
  (void)ctx;
  if (s <= 1.) {
    x[0] = -across;
    x[1] = s * (LENGTH + across);
  } else {
    x[0] = LENGTH - (2. - s) * (LENGTH + across);
    x[1] = LENGTH + across;
  }
  x[2] *= DEPTH / (PetscReal)n[1];
}

typedef struct {
  PetscReal full, point[3];
  PetscReal P[4], v[4]; /* the last steps: loads and ways down */
  PetscInt n;
  PetscInt nload, nturn; /* extrema of the load and of the way down so far */
  PetscReal load[4], turn[4];
} Frame;

/* The extremum of the parabola through three points at equal distances in the middle of which it is. */
static PetscReal peak(PetscReal a, PetscReal b, PetscReal c)
{
  return b - PetscSqr(c - a) / (8. * (a - 2. * b + c));
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Frame *f = (Frame *)ctx;
  PetscReal u[3];

  PetscFunctionBeginUser;
  PetscCall(test_value_at(run->model, step->U, f->point, u));
  for (int i = 0; i < 2; i++) {
    f->P[i] = f->P[i + 1];
    f->v[i] = f->v[i + 1];
  }
  f->P[2] = step->t * f->full;
  f->v[2] = -u[1];
  if (++f->n < 3 || step->last) PetscFunctionReturn(PETSC_SUCCESS);
  if ((f->P[2] - f->P[1]) * (f->P[1] - f->P[0]) < 0. && f->nload < 4)
    f->load[f->nload++] = peak(f->P[0], f->P[1], f->P[2]);
  if ((f->v[2] - f->v[1]) * (f->v[1] - f->v[0]) < 0. && f->nturn < 4)
    f->turn[f->nturn++] = peak(f->v[0], f->v[1], f->v[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(PetscInt ny, Frame *f)
{
  const PetscInt n[3] = {80 * ny, ny, 1};
  const PetscReal width = DEPTH / (PetscReal)ny,
                  sixth = width / 6.; /* of a cell, which is half as long again */
  /* which of the two triangles of a square has three vertices near the middle: the mesh is mirrored from cell to cell */
  const PetscReal sign[2] = {ny % 4 == 3 ? -1. : 1., ny % 4 == 3 ? 1. : -1.};
  char mesh[512];
  TestScene t;

  PetscFunctionBeginUser;
  *f = (Frame){.full = 2.5, .point = {AT, LENGTH, 0.}};
  PetscCall(verify_mesh_write(n, frame, NULL, mesh));
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element cr -body_a_material stvk -body_a_young 720 -body_a_poisson 0 "
    "-body_a_density 1 -sets foot,end,point -set_foot_at sphere:%.17g,0,%.17g,%.17g "
    "-set_end_at sphere:120,%.17g,%.17g,%.17g -set_point_at box:23.5,119.5,-1,24.5,120.5,0.001 "
    "-effects foot,end,plane,load -effect_foot_type fixed -effect_foot_on foot -effect_end_type fixed "
    "-effect_end_on end -effect_plane_type fixed -effect_plane_on all -effect_plane_components z "
    "-effect_load_type point_force -effect_load_on point -effect_load_vector 0;%.17g;0 -time static "
    "-static_control arc_length -static_steps 20 -static_longest_step 4 -static_max_steps 300",
    mesh, (double)(sign[0] * sixth), (double)(2. * sixth), (double)(0.8 * width),
    (double)(LENGTH + sign[1] * sixth), (double)(2. * sixth), (double)(0.8 * width),
    (double)(-f->full * width / WIDTH)));
  PetscCall(test_file_remove(mesh));
  PetscCall(SbRunAddMonitor(t.run, watch, f, NULL));
  PetscCall(verify_solve(&t, "frame"));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  %d cells through the depth: %d steps, %d rejected, %d Newton iterations; load "
                        "%.5f, %.5f; way down %.4f, %.4f\n",
                        (int)ny, (int)t.run->steps_total, (int)t.run->rejected_total,
                        (int)t.run->newton_total, (double)f->load[0], (double)f->load[1], (double)f->turn[0],
                        (double)f->turn[1]));
  SB_CHECK(t.run->t_now == 1., "the path ended at the load factor %g", (double)t.run->t_now);
  SB_CHECK(f->nload == 2 && f->nturn == 2, "%d extrema of the load, %d of the way down", (int)f->nload,
           (int)f->nturn);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const PetscReal load[2] = {1.85473, -0.93974}, turn[2] = {61.0125, 50.7382};
  static const PetscInt cells[2] = {3, 5};
  Frame f[2];

  SB_TEST_BEGIN(argc, argv);
  for (int k = 0; k < 2; k++) PetscCall(solve(cells[k], &f[k]));
  for (int i = 0; i < 2; i++) {
    const PetscReal ratio = 1. / (PetscSqr((PetscReal)cells[1] / (PetscReal)cells[0]) - 1.);
    const PetscReal P = f[1].load[i] + ratio * (f[1].load[i] - f[0].load[i]);
    const PetscReal v = f[1].turn[i] + ratio * (f[1].turn[i] - f[0].turn[i]);

    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "  extrapolated: load %.5f (beam %.5f), way down %.4f (beam %.4f)\n", (double)P,
                          (double)load[i], (double)v, (double)turn[i]));
    SB_CHECK_NEAR(P, load[i], 0.02 * PetscAbsReal(load[i]), "load");
    SB_CHECK_NEAR(v, turn[i], 0.01 * turn[i], "way down");
  }
  SB_TEST_END();
}
