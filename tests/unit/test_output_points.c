// Vectors at the points of vertex fields, by element: exact for affine functions, else the
// volume-weighted mean of adjacent cells; values per cell; reactions keep resultant and moment;
// probes. Bodies of all elements in one scene. @ranks 1 2 3 4
#include "output_fixture.h"

#define ELASTIC(b)                                                                        \
  " -body_" b "_material linear -body_" b "_young 1000 -body_" b "_poisson 0.25 -body_" b \
  "_density 10"
#define BODIES                                                                                   \
  "-bodies a,b,c -body_a_mesh box:0.4,0.1,0.2:4,1,2 -body_b_mesh box:0.3,0.2,0.2:3,2,2 "         \
  "-body_b_translate "                                                                           \
  "0,0.2,0 -body_c_mesh box:0.2,0.2,0.2:2,2,2 -body_c_translate 0,0.5,0 -body_a_element p1 "     \
  "-body_b_element "                                                                             \
  "cr -body_c_element dg -sets left -set_left_at plane:1,0,0,0 -effects hold -effect_hold_type " \
  "fixed "                                                                                       \
  "-effect_hold_on left" ELASTIC("a") ELASTIC("b") ELASTIC("c")
#define FIELDS                                                                                \
  " -output_fields displacement,velocity,acceleration,reaction,J,pressure -output_precision " \
  "double"

static char dir[512];

/* Every point of every body has the motion, which all elements represent exactly. */
static PetscErrorCode test_affine(const char *more)
{
  static const char *const names[] = {"displacement", "velocity", "acceleration"};
  TestScene scene;
  SbOutput out;
  SbH5 h;
  PetscReal *x, *field;
  PetscBool ok;
  char name[64];

  PetscFunctionBeginUser;
  PetscCall(test_open_in(dir, &scene, BODIES EULER FIELDS "%s", more));
  for (PetscInt k = 0; k <= 2; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 2)));
  out = (SbOutput)scene.run->monitors.output;
  SB_CHECK(out->point.N == (more[0] ? 4 * (48 + 72 + 48) : 30 + 36 + 27), "%d points",
           (int)out->point.N);
  PetscCall(fixture_fields(dir, &h));
  PetscCall(PetscMalloc2(3 * out->point.n, &x, PetscMax(3 * out->point.n, out->cell.n), &field));
  PetscCall(SbH5ReadSlice(&h, "/mesh/x", &out->point, 3, x, &ok));
  SB_CHECK(ok, "no /mesh/x");
  for (int k = 0; k < 3; k++) {
    PetscReal worst = 0.;

    SbFormat(sizeof(name), name, "/step/0000/000002/%s", names[k]);
    PetscCall(SbH5ReadSlice(&h, name, &out->point, 3, field, &ok));
    SB_CHECK(ok, "no %s", name);
    for (PetscInt i = 0; i < out->point.n; i++) {
      PetscReal m[3][3];

      motion(x + 3 * i, 0.2, m[0], m[1], m[2]);
      for (int c = 0; c < 3; c++)
        worst = PetscMax(worst, PetscAbsReal(field[3 * i + c] - m[k][c]));
    }
    SB_CHECK_NEAR(worst, 0., 1e-15, name); // a few roundings of numbers below 0.1
  }
  PetscCall(SbH5ReadSlice(&h, "/step/0000/000002/pressure", &out->cell, 1, field, &ok));
  for (PetscInt c = 0; ok && c < out->cell.n; c++)
    SB_CHECK_NEAR(field[c], -400. * 0.2 * (G00 + G11), 1e-11, "pressure, lambda = 400 Pa");
  PetscCall(PetscFree2(x, field));
  PetscCall(SbH5Close(&h));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal bump(const PetscReal x[3])
{
  return x[0] * x[0] - 3. * x[1] * x[2] + x[2];
}

static void bumps(const PetscReal x[3], PetscReal value[3])
{
  value[0] = bump(x);
  value[1] = 2. * bump(x);
  value[2] = -bump(x);
}

/* Contribution of a cell with nodes at its faces to `bump` at corner v, from the vertex positions
   only; its volume. */
static PetscReal corner_of(SbMesh mesh, PetscInt cell, int v, PetscReal *V)
{
  const PetscInt *p = mesh->cell + 4 * cell;
  PetscReal e[3][3], n[3];
  PetscReal sum = 0.;

  for (int a = 0; a < 4; a++) {
    PetscReal x[3] = {0., 0., 0.};

    for (int b = 0; b < 4; b++)
      for (int k = 0; k < 3 && b != a; k++)
        x[k] += mesh->x[3 * p[b] + k] / 3.;
    sum += (a == v ? -2. : 1.) * bump(x);
  }
  for (int a = 0; a < 3; a++)
    for (int k = 0; k < 3; k++)
      e[a][k] = mesh->x[3 * p[a + 1] + k] - mesh->x[3 * p[0] + k];
  SbCross(e[0], e[1], n);
  *V = SbDot3(n, e[2]) / 6.;
  return sum;
}

/* A function that CR and DG do not represent exactly: vertex values against a mean over all
   cells. */
static PetscErrorCode test_mean(PetscBool discontinuous)
{
  TestScene scene;
  SbOutput out;
  SbMesh mesh;
  PetscReal *value;
  PetscReal worst = 0.;
  PetscReal jump = 0.;
  PetscReal V;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir, discontinuous ? BODIES EULER FIELDS " -output_discontinuous" : BODIES EULER FIELDS,
    &scene));
  out = (SbOutput)scene.run->monitors.output;
  mesh = scene.model->mesh;
  PetscCall(test_fill(scene.model, bumps, scene.run->state.U));
  PetscCall(PetscMalloc1(3 * out->point.nowned, &value));
  PetscCall(SbPointsValues(scene.run, out, scene.run->state.U, value));
  for (PetscInt i = 0; i < out->point.nowned; i++) {
    PetscReal mean = 0.;
    PetscReal sum = 0.;
    const PetscInt vertex = discontinuous ? mesh->cell[i] : i;

    if (mesh->vert_body[vertex] == 0) {
      mean = bump(mesh->x + 3 * vertex);
    } else if (discontinuous) {
      mean = corner_of(mesh, i / 4, (int)(i % 4), &V);
      jump = PetscMax(jump, PetscAbsReal(mean - bump(mesh->x + 3 * vertex)));
    } else {
      for (PetscInt k = 0; k < 4 * mesh->ncell; k++) {
        if (mesh->cell[k] != i)
          continue;
        mean += corner_of(mesh, k / 4, (int)(k % 4), &V) * V;
        sum += V;
      }
      mean /= sum;
    }
    worst = PetscMax(worst, PetscAbsReal(value[3 * i] - mean));
    worst = PetscMax(worst, PetscAbsReal(value[3 * i + 1] - 2. * mean));
    worst = PetscMax(worst, PetscAbsReal(value[3 * i + 2] + mean));
  }
  SB_CHECK_NEAR(worst, 0., 1e-14, "vertex values"); // roundings of numbers below 1
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &jump, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  SB_CHECK(!discontinuous || jump > 1e-3, "nothing has jumps: %g", jump);
  PetscCall(PetscFree(value));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half a newton in each component at every constrained node: same sum and same moment as at the
   nodes, zero elsewhere. */
static PetscErrorCode test_reactions(const char *more)
{
  TestScene scene;
  SbSpace s;
  SbOutput out;
  PetscReal *r;
  PetscReal sums[14] = {0.};
  PetscReal away = 0.;

  PetscFunctionBeginUser;
  PetscCall(test_open_in(dir, &scene, BODIES EULER FIELDS "%s", more));
  PetscCall(fixture_step(&scene, 0, 0.1, PETSC_FALSE));
  s = scene.model->space;
  out = (SbOutput)scene.run->monitors.output;
  PetscCall(PetscMalloc1(3 * out->point.nowned, &r));
  PetscCall(SbPointsForces(scene.run, out, PETSC_TRUE, scene.run->state.reaction, r));
  for (PetscInt i = 0; i < out->point.nowned; i++) {
    const PetscReal *x = s->mesh->x + 3 * (out->discontinuous ? s->mesh->cell[i] : i);

    if (x[0] > 1e-9)
      away = PetscMax(away, PetscAbsReal(r[3 * i]) + PetscAbsReal(r[3 * i + 2]));
    for (int k = 0; k < 3; k++)
      sums[k] += r[3 * i + k];
    sums[3] += x[1] * r[3 * i + 2] - x[2] * r[3 * i + 1];
    sums[4] += x[1] * r[3 * i];
    sums[5] += x[2] * r[3 * i];
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal *x = s->node_x + 3 * i;

    if (!s->fixed[i])
      continue;
    for (int k = 0; k < 3; k++)
      sums[7 + k] += 0.5;
    sums[10] += 0.5 * (x[1] - x[2]);
    sums[11] += 0.5 * x[1];
    sums[12] += 0.5 * x[2];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 14, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(sums[7] == 0.5 * (6 + 8 + 8), "%g N at the nodes",
           sums[7]); // vertices, faces, supports of faces
  for (int k = 0; k < 6; k++)
    SB_CHECK_NEAR(sums[k], sums[7 + k], 1e-13, "resultant or moment of the reactions");
  SB_CHECK(away == 0., "a reaction away from the support: %g", away);
  PetscCall(PetscFree(r));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A probe has the vertex field at the nearest vertex, in any body, with and without fields. */
static PetscErrorCode test_probes(const char *fields)
{
  static const PetscReal at[3][3] = {{0.4, 0.1, 0.2}, {0.3, 0.3, 0.1}, {0.1, 0.6, 0.1}};
  TestScene scene;
  SbOutput out;
  char *text, *row;
  PetscReal u[3], v[3], a[3];

  PetscFunctionBeginUser;
  PetscCall(test_open_in(
    dir, &scene,
    BODIES EULER
    "-probes p,q,r -probe_p_at 0.4,0.1,0.2 -probe_q_at 0.31,0.29,0.11 -probe_r_at 0.1,0.6,0.1 %s",
    fields));
  out = (SbOutput)scene.run->monitors.output;
  for (PetscInt k = 0; k <= 1; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 1)));
  PetscCall(fixture_read(dir, "history.csv", &text));
  row = strrchr(text, ',');
  for (int c = 8; c >= 0; c--) { // nine columns from the end
    const PetscReal value = strtod(row + 1, NULL);

    motion(at[c / 3], 0.1, u, v, a);
    SB_CHECK_NEAR(value, u[c % 3], 1e-16 + 1e-15 * PetscAbsReal(u[c % 3]), out->probe[c / 3].name);
    *row = 0;
    row = strrchr(text, ',');
  }
  PetscCall(PetscFree(text));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A restart keeps the type of points of the first run, or is an error; an error leaves the folder
   unchanged. */
static PetscErrorCode test_restart(void)
{
  TestScene scene;
  char *xmf;

  PetscFunctionBeginUser;
  for (int other = 0; other < 2; other++) {
    const char *first = other ? "" : " -output_discontinuous";
    const char *second = other ? " -output_discontinuous" : "";

    PetscCall(test_open_in(dir, &scene, BODIES EULER FIELDS " -checkpoint_every_steps 1%s", first));
    for (PetscInt k = 0; k <= 2; k++)
      PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
    PetscCall(test_scene_close(&scene));
    SB_CHECK_ERROR(test_open_in(dir, &scene,
                                BODIES EULER FIELDS " -restart %s/checkpoint_000001.h5%s", dir,
                                second),
                   PETSC_ERR_USER_INPUT, "-output_discontinuous|-output_dir");
    PetscCall(test_scene_close(&scene));
    SB_CHECK(fixture_exists(dir, "checkpoint_000002.h5"), "refused, but the folder was cleared");
    PetscCall(test_open_in(dir, &scene, BODIES EULER FIELDS " -restart %s/checkpoint_000001.h5%s",
                           dir, first));
    for (PetscInt k = 1; k <= 3; k++)
      PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 3)));
    PetscCall(test_scene_close(&scene));
    PetscCall(fixture_read(dir, "fields.xmf", &xmf));
    SB_CHECK(strstr(xmf, "/step/0000/000000/") && strstr(xmf, "/step/0000/000001/") &&
               strstr(xmf, "/000003/"),
             "frames after the restart:\n%s", xmf);
    PetscCall(PetscFree(xmf));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P1 without vertex fields needs no additional data. */
static PetscErrorCode test_nothing(void)
{
  TestScene scene;
  SbOutput out;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(dir, BOX EULER "-output_fields J", &scene));
  out = (SbOutput)scene.run->monitors.output;
  SB_CHECK(!out->points.V && !out->points.valence,
           "something is kept for vertex fields that nobody asked for");
  SB_CHECK(out->node.sf == out->point.sf, "P1 has an order of nodes of its own");
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_affine(""));
  PetscCall(test_affine(" -output_discontinuous"));
  PetscCall(test_mean(PETSC_FALSE));
  PetscCall(test_mean(PETSC_TRUE));
  PetscCall(test_reactions(""));
  PetscCall(test_reactions(" -body_c_dirichlet strong"));
  PetscCall(test_reactions(" -output_discontinuous"));
  PetscCall(test_probes(""));
  PetscCall(test_probes("-output_fields none"));
  PetscCall(test_restart());
  PetscCall(test_nothing());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
