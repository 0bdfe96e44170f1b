// @ranks 1 2
/*
  Edge-edge contact.

    bars     two crossed bars, each rotated by 45 degrees about its axis so that only edges are in
    contact, come to rest on each other:
             no penetration, the force is the weight; the same on all ranks together and on one
    fast     thin bars so fast that one would pass through the other within a step
    box      a box falls on a thin plate at 5 m/s, corner first and edge first: no penetration in
    any step rings    two linked coarse rings with interior edges are pulled apart: they stay linked

  Penetration is measured independently of the detector: many sample points on all edges of one
  surface; for those inside the other one, by its solid angle, the distance from it.
*/
#include <sbgeometry.h>
#include "contact.h"

enum {
  CONTACTS,
  DEEPEST,
  MEAN,
  NORMAL,
  FRICTION,
  WORK,
  LOSS,
  GAP,
  ENERGY,
  LAG,
  UNGUARDED,
  NVALUE
};
enum {
  ROW = 10,
  SAMPLES = 6
}; /* a facet's row: part and corners; sample points per edge */

/* History columns of the contact effect, on every rank. */
static PetscErrorCode contact_values(SbRun run, PetscReal values[NVALUE])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(values, NVALUE));
  PetscCall(contact_columns(run, 0, NULL, contact_effect(run->model, "meet"), values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ penetration depth */

/* Facets of set 0 of all ranks in the deformed configuration: [n][ROW]. */
static PetscErrorCode gather_skin(SbModel m, Vec U, PetscInt *n, PetscReal **all)
{
  const SbSpace s = m->space;
  PetscMPIInt size;
  PetscMPIInt count = 0;
  PetscMPIInt *counts, *start;
  const PetscReal *u;
  PetscReal *mine;
  SbFacet *facet;
  PetscInt nfacet;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetSetFacets(s, 0, &nfacet, &facet));
  PetscCall(PetscMalloc1(ROW * nfacet, &mine));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt i = 0; i < nfacet; i++) {
    if (facet[i].cell >= s->mesh->ncell_owned)
      continue;
    mine[count++] = (PetscReal)s->mesh->cell_body[facet[i].cell];
    for (int k = 0; k < 9; k++) {
      const PetscInt node = s->cell_node[4 * facet[i].cell + facet[i].corner[k / 3]];

      mine[count++] = s->node_x[3 * node + k % 3] + u[3 * node + k % 3];
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscFree(facet));
  PetscCallMPI(MPI_Comm_size(m->comm, &size));
  PetscCall(PetscMalloc2(size, &counts, size + 1, &start));
  PetscCallMPI(MPI_Allgather(&count, 1, MPI_INT, counts, 1, MPI_INT, m->comm));
  start[0] = 0;
  for (PetscMPIInt r = 0; r < size; r++)
    start[r + 1] = start[r] + counts[r];
  *n = start[size] / ROW;
  PetscCall(PetscMalloc1(start[size], all));
  PetscCallMPI(MPI_Allgatherv(mine, count, MPIU_REAL, *all, counts, start, MPIU_REAL, m->comm));
  PetscCall(PetscFree2(counts, start));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solid angle of a triangle (van Oosterom and Strackee 1983). */
static PetscReal solid_angle(const PetscReal p[3], const PetscReal x[9])
{
  PetscReal r[3][3], length[3], n[3];

  for (int c = 0; c < 3; c++) {
    for (int k = 0; k < 3; k++)
      r[c][k] = x[3 * c + k] - p[k];
    length[c] = PetscSqrtReal(SbDot3(r[c], r[c]));
  }
  SbCross(r[1], r[2], n);
  return 2 *
         atan2(SbDot3(r[0], n), length[0] * length[1] * length[2] + SbDot3(r[0], r[1]) * length[2] +
                                  SbDot3(r[1], r[2]) * length[0] + SbDot3(r[2], r[0]) * length[1]);
}

/* Penetration depth of a point in the surface of a body, m; 0 outside. */
static PetscReal depth_at(const PetscReal p[3], PetscReal part, PetscInt n, const PetscReal row[])
{
  PetscReal angle = 0;
  PetscReal nearest = PETSC_MAX_REAL;

  for (PetscInt i = 0; i < n; i++, row += ROW) {
    const PetscReal *const x[3] = {row + 1, row + 4, row + 7};
    PetscReal w[3], d2;

    if (row[0] != part)
      continue;
    angle += solid_angle(p, row + 1);
    (void)SbTriangleClosestPoint(p, x, w, &d2);
    nearest = PetscMin(nearest, d2);
  }
  return PetscAbsReal(angle) > 2 * PETSC_PI ? PetscSqrtReal(nearest) : 0;
}

/* Largest penetration depth of the sample points on the facet edges of two bodies in the other
   body, m. */
static PetscErrorCode depth_of(SbModel m, Vec U, PetscReal *depth)
{
  PetscReal *row, body[2][6];
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(gather_skin(m, U, &n, &row));
  for (int k = 0; k < 12; k++)
    body[k / 6][k % 6] = k % 6 < 3 ? PETSC_MAX_REAL : -PETSC_MAX_REAL;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal *all = body[(int)row[ROW * i]];

    for (int k = 0; k < 9; k++) {
      all[k % 3] = PetscMin(all[k % 3], row[ROW * i + 1 + k]);
      all[3 + k % 3] = PetscMax(all[3 + k % 3], row[ROW * i + 1 + k]);
    }
  }
  *depth = 0;
  for (PetscInt i = 0; i < 3 * n; i++) {
    const PetscReal *x = row + ROW * (i / 3) + 1;
    const PetscReal *a = x + 3 * (i % 3);
    const PetscReal *b = x + 3 * ((i + 1) % 3);
    const PetscReal other = 1 - row[ROW * (i / 3)];
    const PetscReal *all = body[(int)other];

    for (int q = 0; q < SAMPLES; q++) {
      PetscReal p[3];
      PetscBool inside = PETSC_TRUE;

      for (int k = 0; k < 3; k++) {
        p[k] = a[k] + (PetscReal)q / SAMPLES * (b[k] - a[k]);
        if (p[k] < all[k] || p[k] > all[3 + k])
          inside = PETSC_FALSE;
      }
      if (inside)
        *depth = PetscMax(*depth, depth_at(p, other, n, row));
    }
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Extreme values over the steps of a run. */
typedef struct {
  PetscReal depth, deepest,
    force;           /* depth by sample points and by the history, m; largest force, N */
  PetscReal above;   /* least height of the second body's centre above a vertex of the first, m */
  PetscReal at[3];   /* reference position of that vertex */
  PetscReal kinetic; /* kinetic energy of the last step, J */
  PetscInt steps, touching;
  int linked; /* rings: number of steps with linking number 1 */
} Seen;

/* Height of the second body's centre above a vertex of the first. */
static PetscErrorCode height_over(SbModel m, Vec U, const PetscReal at[3], PetscReal *height)
{
  PetscReal sum[2] = {0, 0};
  PetscReal u[3];
  const PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(test_value_at(m, U, at, u));
  PetscCall(VecGetArrayRead(U, &x));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) {
    if (m->space->node_body[i] != 1)
      continue;
    sum[0] += m->space->node_x[3 * i + 2] + x[3 * i + 2];
    sum[1]++;
  }
  PetscCall(VecRestoreArrayRead(U, &x));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, m->comm));
  *height = sum[0] / sum[1] - at[2] - u[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Seen *seen = (Seen *)ctx;
  PetscReal values[NVALUE];
  PetscReal depth = 0;
  PetscReal height = 0;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(contact_values(run, values));
  if (!run->model->space->faces)
    PetscCall(depth_of(run->model, step->U, &depth)); /* vertices are nodes */
  PetscCall(height_over(run->model, step->U, seen->at, &height));
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  seen->depth = PetscMax(seen->depth, depth);
  seen->deepest = PetscMax(seen->deepest, values[DEEPEST]);
  seen->force = PetscMax(seen->force, values[NORMAL]);
  seen->above = PetscMin(seen->above, height);
  seen->kinetic = e.kinetic;
  seen->touching += values[CONTACTS] > 0;
  seen->steps++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bars */

#define LAWS(young)                                                                           \
  " -body_a_material corotated -body_a_young " young                                          \
  " -body_a_poisson 0.3 -body_a_density 1000 -body_b_material corotated -body_b_young " young \
  " -body_b_poisson 0.3 -body_b_density 1000 "
/* The ends of the lower bar are fixed, those of the upper one are guided vertically. */
#define ENDS                                                                          \
  "-sets skin,a0,a1,b0,b1 -set_skin_at boundary -set_a0_at plane:1,0,0,0 -set_a1_at " \
  "plane:1,0,0,0.21 "                                                                 \
  "-set_b0_at plane:0,1,0,-0.105 -set_b1_at plane:0,1,0,0.105 -effect_a0_type fixed " \
  "-effect_a0_on a0 "                                                                 \
  "-effect_a1_type fixed -effect_a1_on a1 -effect_b0_type fixed -effect_b0_on b0 "    \
  "-effect_b0_components xy "                                                         \
  "-effect_b1_type fixed -effect_b1_on b1 -effect_b1_components xy -effect_meet_type contact "
#define BARS                                                                                     \
  "-bodies a,b -body_a_mesh box:0.21,0.03,0.03:7,1,1 -body_a_rotate 1,0,0,45 -body_b_mesh "      \
  "box:0.03,0.21,0.03:1,7,1 -body_b_rotate 0,1,0,-45 -body_b_translate 0.105,-0.105,0.0434264 "  \
  "-effects "                                                                                    \
  "gravity,a0,a1,b0,b1,meet,calm -effect_gravity_type gravity -effect_calm_type damping "        \
  "-effect_calm_beta "                                                                           \
  "0.02 -effect_calm_alpha 5 -time euler_implicit -ts_dt 0.01 -ts_max_time 0.5 -ksp_rtol 1e-10 " \
  "-snes_rtol "                                                                                  \
  "1e-8 " LAWS("1e5") ENDS

/* Solves on the ranks of comm; returns the last history values and the displacement of the centre
   of the upper bar. */
static PetscErrorCode lay_bars(MPI_Comm comm, const char *more, Seen *seen,
                               PetscReal values[NVALUE], PetscReal u[3])
{
  const PetscReal middle[3] = {0.105, 0.015, 0.0434264};
  TestScene t;

  PetscFunctionBeginUser;
  *seen = (Seen){.above = PETSC_MAX_REAL, .at = {0.09, 0, 0.0424264}};
  PetscCall(test_open_on(comm, NULL, &t, BARS "%s", more));
  PetscCall(SbRunAddMonitor(t.run, watch, seen));
  PetscCall(verify_solve(&t, "bars"));
  PetscCall(contact_values(t.run, values));
  PetscCall(test_value_at(t.model, t.run->state.U, middle, u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With one cell in the section the edges of CR and DG are inclined at the contact: the guides take
   part of the force. */
static PetscErrorCode check_bars(const char *more, PetscReal tolerance)
{
  const PetscReal weight = 0.21 * 0.03 * 0.03 * 1000 * 9.81;
  PetscReal values[NVALUE], alone[NVALUE], u[3], v[3];
  Seen seen, other;

  PetscFunctionBeginUser;
  PetscCall(lay_bars(PETSC_COMM_WORLD, more, &seen, values, u));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  bars%s: %d contacts, force %.6f of the weight, depth %.1e m (history "
                        "%.1e), moving with %.1e J\n",
                        more, (int)values[CONTACTS], values[NORMAL] / weight, seen.depth,
                        seen.deepest, seen.kinetic));
  SB_CHECK(values[CONTACTS] >= 1, "the bars do not touch");
  SB_CHECK_NEAR(values[NORMAL], weight, tolerance * weight, "the lower bar carries the upper one");
  SB_CHECK(seen.depth < 1e-6 * 0.21 && seen.deepest < 1e-6 * 0.21,
           "the bars are %g m in each other, they say %g", seen.depth, seen.deepest);
  SB_CHECK(seen.kinetic < 1e-8, "the bars still move with %g J", seen.kinetic);
  if (test_size > 1) {
    PetscCall(lay_bars(PETSC_COMM_SELF, more, &other, alone, v));
    SB_CHECK(alone[CONTACTS] == values[CONTACTS], "%g contacts, on one rank %g", values[CONTACTS],
             alone[CONTACTS]);
    SB_CHECK_NEAR(values[NORMAL], alone[NORMAL], 1e-6 * weight, "force on one rank");
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(u[k], v[k], 1e-8, "displacement on one rank");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Thin bars that would pass each other by more than their thicknesses within the first step. */
static PetscErrorCode check_fast(void)
{
  Seen seen = {.above = PETSC_MAX_REAL, .at = {0.09, 0, 0.0084853}};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t, "-bodies a,b -body_a_mesh box:0.21,0.006,0.006:7,1,1 -body_a_rotate 1,0,0,45 "
        "-body_b_mesh box:0.006,0.21,0.006:1,7,1 -body_b_rotate 0,1,0,-45 -body_b_translate "
        "0.105,-0.105,0.0105 -body_b_velocity 0,0,-5 -effects a0,a1,b0,b1,meet -time "
        "euler_implicit -ts_dt 0.004 -ts_max_time 0.04 " LAWS("1e7") ENDS));
  PetscCall(SbRunAddMonitor(t.run, watch, &seen));
  PetscCall(verify_solve(&t, "fast bars"));
  test_print("  fast bars: in touch in %d of %d steps, force up to %.3g N, depth %.1e m (history "
             "%.1e), middle at least %.4f m over the other\n",
             (int)seen.touching, (int)seen.steps, seen.force, seen.depth, seen.deepest, seen.above);
  SB_CHECK(seen.touching > 0 && seen.force > 0.1, "the bars do not meet");
  SB_CHECK(seen.depth < 1e-5, "the bars are %g m in each other", seen.depth);
  SB_CHECK(seen.above > 0, "the bars went through each other by %g m", -seen.above);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ box on a plate */

static PetscErrorCode check_box(const char *what, const char *turn, PetscReal most)
{
  Seen seen = {.above = PETSC_MAX_REAL, .at = {0.1, 0.1, 0.006}};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies plate,cube -body_plate_mesh box:0.2,0.2,0.006:10,10,1 -body_plate_material corotated "
    "-body_plate_young 1e6 -body_plate_poisson 0.3 -body_plate_density 1000 -body_cube_mesh "
    "box:0.04,0.04,0.04:2 -body_cube_material corotated -body_cube_young 1e6 -body_cube_poisson "
    "0.3 "
    "-body_cube_density 1000 %s -body_cube_velocity 0,0,-5 -sets skin,x0,x1,y0,y1 -set_skin_at "
    "boundary "
    "-set_x0_at plane:1,0,0,0 -set_x1_at plane:1,0,0,0.2 -set_y0_at plane:0,1,0,0 -set_y1_at "
    "plane:0,1,0,0.2 "
    "-effects x0,x1,y0,y1,meet -effect_x0_type fixed -effect_x0_on x0 -effect_x1_type fixed "
    "-effect_x1_on x1 "
    "-effect_y0_type fixed -effect_y0_on y0 -effect_y1_type fixed -effect_y1_on y1 "
    "-effect_meet_type contact "
    "-time euler_implicit -ts_dt 0.001 -ts_max_time 0.03",
    turn));
  PetscCall(SbRunAddMonitor(t.run, watch, &seen));
  PetscCall(verify_solve(&t, what));
  test_print("  box, %s: in touch in %d of %d steps, force up to %.3g N, depth %.1e m (history "
             "%.1e), middle at least %.3f m over the plate\n",
             what, (int)seen.touching, (int)seen.steps, seen.force, seen.depth, seen.deepest,
             seen.above);
  SB_CHECK(seen.touching > 3 && seen.force > 1, "%s: the box does not hit the plate", what);
  SB_CHECK(seen.depth < most, "%s: the box is %g m in the plate", what, seen.depth);
  SB_CHECK_NEAR(seen.deepest, seen.depth, 1e-4, "the depth that the history says");
  SB_CHECK(seen.above > 0.01, "%s: the box went through the plate: its middle is %g m over it",
           what, seen.above);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ rings */

#define SEGMENTS 12
#define RADIUS 0.1 /* radius of the centre line at the vertices, m */
#define TUBE 0.02  /* half the diagonal of the square section, which stands on an edge, m */

/* Writes a ring in the plane z = 0 as a gmsh file; segment 0 is symmetric to the x axis.
   Collective. */
static PetscErrorCode write_ring(char path[512])
{
  static const int ways[6][4] = {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7},
                                 {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 4, 6, 7}};
  const PetscReal corner[4][2] = {{-TUBE, 0}, {0, -TUBE}, {0, TUBE}, {TUBE, 0}}; /* radial, axial */
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &f));
  if (f) {
    int count = 0;

    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n", 4 * SEGMENTS);
    for (int i = 0; i < 4 * SEGMENTS; i++) {
      const int section = i / 4;
      const PetscReal angle = 2 * PETSC_PI * (section - 0.5) / SEGMENTS;
      const PetscReal r = RADIUS + corner[i % 4][0];

      fprintf(f, "%d %.17g %.17g %.17g\n", i + 1, r * PetscCosReal(angle), r * PetscSinReal(angle),
              corner[i % 4][1]);
    }
    fprintf(f, "$EndNodes\n$Elements\n%d\n", 6 * SEGMENTS);
    for (int i = 0; i < 6 * SEGMENTS; i++) {
      fprintf(f, "%d 4 2 0 1", ++count);
      for (
        int a = 0; a < 4;
        a++) { /* corners: bit 0 the next section, bits 1 and 2 in the section; every second cell mirrored */
        const PetscBool swap = (PetscBool)((i / 6 & 1) ^ (i % 6 < 3));
        const int c = ways[i % 6][swap && a >= 2 ? 5 - a : a] ^ (i / 6 & 1);
        const int section = (i / 6 + (c & 1)) % SEGMENTS;

        fprintf(f, " %d", 4 * section + (c >> 1) + 1);
      }
      fprintf(f, "\n");
    }
    fprintf(f, "$EndElements\n");
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Centre of each section of both rings, from the vertices by their original numbers. */
static PetscErrorCode middle_lines(SbModel m, Vec U, PetscReal line[2][SEGMENTS][3])
{
  const SbSpace s = m->space;
  const PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(line, 6 * SEGMENTS * sizeof(PetscReal)));
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt b = s->node_body[i];
    const PetscInt v = s->node_orig[i] - 4 * SEGMENTS * b;

    for (int k = 0; k < 3; k++)
      line[b][v / 4][k] += 0.25 * (s->node_x[3 * i + k] + u[3 * i + k]);
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, line, 6 * SEGMENTS, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Linking number of two closed polygons: sum over all pairs of segments of the solid angle of the
   quadrilateral b - a, over 4 pi. */
static PetscReal linking(PetscReal line[2][SEGMENTS][3])
{
  const PetscReal origin[3] = {0, 0, 0};
  PetscReal sum = 0;

  for (int i = 0; i < SEGMENTS; i++) {
    for (int j = 0; j < SEGMENTS; j++) {
      PetscReal x[2][9];

      for (int k = 0; k < 3; k++) {
        const PetscReal a0 = line[0][i][k];
        const PetscReal a1 = line[0][(i + 1) % SEGMENTS][k];
        const PetscReal b0 = line[1][j][k];
        const PetscReal b1 = line[1][(j + 1) % SEGMENTS][k];

        x[0][k] = x[1][k] = b0 - a0;
        x[0][3 + k] = b0 - a1;
        x[0][6 + k] = x[1][3 + k] = b1 - a1;
        x[1][6 + k] = b1 - a0;
      }
      sum += solid_angle(origin, x[0]) + solid_angle(origin, x[1]);
    }
  }
  return sum / (4 * PETSC_PI);
}

static PetscErrorCode watch_rings(SbRun run, const SbStep *step, void *ctx)
{
  PetscReal line[2][SEGMENTS][3], number;

  PetscFunctionBeginUser;
  PetscCall(watch(run, step, ctx));
  PetscCall(middle_lines(run->model, step->U, line));
  number = PetscAbsReal(linking(line));
  SB_CHECK_NEAR(number, PetscFloorReal(number + 0.5), 1e-6, "a linking number");
  ((Seen *)ctx)->linked += PetscAbsReal(number - 1) < 1e-6;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The second ring is perpendicular to the first and is pulled along x; the first ring is fixed at
   its far side. */
static PetscErrorCode check_rings(PetscReal most)
{
  const PetscReal inner = (RADIUS - TUBE) * PetscCosReal(PETSC_PI / SEGMENTS);
  const PetscReal away = 2 * inner - 0.002;
  Seen seen = {.above = PETSC_MAX_REAL};
  char path[512];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(write_ring(path));
  PetscCall(test_open(
    &t,
    "-bodies a,b -body_a_mesh %s -body_b_mesh %s -body_b_rotate 1,0,0,90 -body_b_translate "
    "%.15g,0,0 -sets "
    "skin,far,end -set_skin_at boundary -set_far_at halfspace:1,0,0,-0.09 -set_end_at "
    "halfspace:-1,0,0,%.15g "
    "-effects hold,pull,meet -effect_hold_type fixed -effect_hold_on far -effect_pull_type "
    "prescribed_displacement -effect_pull_on end -effect_pull_displacement 0.08*ramp(t/0.4);0;0 "
    "-effect_meet_type contact -time euler_implicit -ts_dt 0.01 -ts_max_time 0.5" LAWS("1e5"),
    path, path, away, -away - 0.09));
  PetscCall(SbRunAddMonitor(t.run, watch_rings, &seen));
  PetscCall(verify_solve(&t, "rings"));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  rings: linked in %d of %d steps, in touch in %d, force up to %.3g N, "
                        "depth %.1e m (history %.1e)\n",
                        seen.linked, (int)seen.steps, (int)seen.touching, seen.force, seen.depth,
                        seen.deepest));
  SB_CHECK(seen.linked == seen.steps, "the rings are linked in %d of %d steps only", seen.linked,
           (int)seen.steps);
  SB_CHECK(seen.touching > seen.steps / 2 && seen.force > 0.5, "the rings do not pull");
  SB_CHECK(seen.depth < most && seen.deepest < most,
           "the rings are %g m in each other, they say %g", seen.depth, seen.deepest);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_bars("", 1e-3));
  if (test_size == 1) {
    PetscCall(check_bars(" -effect_meet_friction 0.3", 1e-3));
    PetscCall(check_bars(" -body_a_element cr -body_b_element dg -ts_max_time 2", 1e-2));
  }
  PetscCall(check_fast());
  PetscCall(check_rings(2e-4));
  PetscCall(check_box("corner first",
                      "-body_cube_rotate 1,-1,0,54.7356 -body_cube_translate 0.107,0.094,0.009",
                      1e-3));
  PetscCall(check_box("edge first",
                      "-body_cube_rotate 1,0,0,45 -body_cube_translate 0.08,0.1,0.009", 1e-3));
  SB_TEST_END();
}
