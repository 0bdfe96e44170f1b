// fields.h5 and fields.xmf: values in original order, which frames are written, paths of the
// arrays, continuation after a restart.
// @ranks 1 2 3 4
#include "output_fixture.h"

static char dir[512];

/* Vertex fields against the formula at the reference positions in the file; cell fields against the
   constant state. */
static PetscErrorCode check_values(SbOutput out, SbH5 *h, const char *group, PetscReal t,
                                   PetscReal tolerance)
{
  const PetscReal mu = 400., lambda = 400.;                            // E = 1000, nu = 1/4
  const PetscReal e[6] = {t * G00, 0., t * G02 / 2., t * G11, 0., 0.}; // xx xy xz yy yz zz
  PetscReal *x, *field, s[6];
  PetscReal worst = 0.;
  PetscBool ok;
  char name[128];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(3 * out->point.n, &x, 6 * PetscMax(out->point.n, out->cell.n), &field));
  PetscCall(SbH5ReadSlice(h, "/mesh/x", &out->point, 3, x, &ok));
  SB_CHECK(ok, "no /mesh/x");
  for (int k = 0; k < 3; k++) {
    static const char *const names[] = {"displacement", "velocity", "acceleration"};

    SbFormat(sizeof(name), name, "%s/%s", group, names[k]);
    PetscCall(SbH5ReadSlice(h, name, &out->point, 3, field, &ok));
    SB_CHECK(ok, "no %s", name);
    worst = 0.;
    for (PetscInt i = 0; i < out->point.n; i++) {
      PetscReal m[3][3];

      motion(x + 3 * i, t, m[0], m[1], m[2]);
      for (int c = 0; c < 3; c++)
        worst = PetscMax(worst, PetscAbsReal(field[3 * i + c] - m[k][c]));
    }
    SB_CHECK_NEAR(worst, 0., 0.2 * tolerance, name); // the largest value is below 0.2
  }
  SbFormat(sizeof(name), name, "%s/stress", group);
  PetscCall(SbH5ReadSlice(h, name, &out->cell, 6, field, &ok));
  SB_CHECK(ok, "no %s", name);
  for (int k = 0; k < 6; k++)
    s[k] = 2. * mu * e[k] + (k == 0 || k == 3 || k == 5 ? lambda * (e[0] + e[3] + e[5]) : 0.);
  worst = 0.;
  for (PetscInt i = 0; i < 6 * out->cell.n; i++)
    worst = PetscMax(worst, PetscAbsReal(field[i] - s[i % 6]));
  SB_CHECK_NEAR(worst, 0., 20. * tolerance, "stress");
  SbFormat(sizeof(name), name, "%s/von_mises", group);
  PetscCall(SbH5ReadSlice(h, name, &out->cell, 1, field, &ok));
  SB_CHECK(ok, "no %s", name);
  worst = 0.;
  for (PetscInt i = 0; i < out->cell.n; i++) {
    const PetscReal p = (s[0] + s[3] + s[5]) / 3.;
    const PetscReal d = PetscSqr(s[0] - p) + PetscSqr(s[3] - p) + PetscSqr(s[5] - p) +
                        2. * (PetscSqr(s[1]) + PetscSqr(s[2]) + PetscSqr(s[4]));

    worst = PetscMax(worst, PetscAbsReal(field[i] - PetscSqrtReal(1.5 * d)));
  }
  SB_CHECK_NEAR(worst, 0., 50. * tolerance, "von_mises");
  PetscCall(PetscFree2(x, field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells of the file, by its vertex numbers, fill the box; each belongs to body 0 or 1. */
static PetscErrorCode check_mesh(SbOutput out, SbH5 *h, PetscReal volume)
{
  const PetscInt nvert = out->point.N;
  SbOrder all = out->point; // every rank reads all vertices
  PetscReal *x, *cell, *body;
  PetscReal sum = 0.;
  PetscReal least = 1.;
  PetscBool ok[3];

  PetscFunctionBeginUser;
  all.start = 0;
  all.n = nvert;
  PetscCall(PetscMalloc3(3 * nvert, &x, 4 * out->cell.n, &cell, out->cell.n, &body));
  PetscCall(SbH5ReadSlice(h, "/mesh/x", &all, 3, x, &ok[0]));
  PetscCall(SbH5ReadSlice(h, "/mesh/cells", &out->cell, 4, cell, &ok[1]));
  PetscCall(SbH5ReadSlice(h, "/mesh/body", &out->cell, 1, body, &ok[2]));
  SB_CHECK(ok[0] && ok[1] && ok[2], "an array of /mesh is missing");
  for (PetscInt c = 0; c < out->cell.n; c++) {
    PetscReal d[3][3], det;

    for (int a = 0; a < 3; a++)
      for (int i = 0; i < 3; i++)
        d[a][i] = x[3 * (PetscInt)cell[4 * c + a + 1] + i] - x[3 * (PetscInt)cell[4 * c] + i];
    det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
          d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
          d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    sum += det / 6.;
    least = PetscMin(least, det);

    // bodies in scenario order: the cells of the first one come first
    SB_CHECK(body[c] == (PetscReal)(out->cell.start + c >= 48), "cell %d is in body %g",
             (int)(out->cell.start + c), body[c]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(sum, volume, 1e-13,
                "volume of the cells of the file"); // rounding of 48 volumes near 1e-4
  SB_CHECK(least > 0., "a cell of the file is negatively oriented: %g", least);
  PetscCall(PetscFree3(x, cell, body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt count(const char *text, const char *word)
{
  PetscInt n = 0;

  for (; (text = strstr(text, word)); text += strlen(word))
    n++;
  return n;
}

#define ALL          \
  " -output_fields " \
  "displacement,velocity,acceleration,stress,von_mises,J,energy_density,reaction,rank,sets"

static PetscErrorCode test_values(const char *precision, PetscReal tolerance)
{
  TestScene scene;
  SbH5 h;
  char *xmf;

  PetscFunctionBeginUser;
  PetscCall(test_open_in(dir, &scene, HELD EULER ALL " -output_precision %s", precision));
  for (PetscInt k = 0; k <= 3; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 3)));
  PetscCall(fixture_fields(dir, &h));
  PetscCall(
    check_values((SbOutput)scene.run->monitors.output, &h, "/step/0000/000002", 0.2, tolerance));
  PetscCall(
    check_values((SbOutput)scene.run->monitors.output, &h, "/step/0000/000003", 0.3, tolerance));
  PetscCall(SbH5Close(&h));
  PetscCall(fixture_read(dir, "fields.xmf", &xmf));
  SB_CHECK(count(xmf, "<Time ") == 4, "%d times in fields.xmf", (int)count(xmf, "<Time "));
  SB_CHECK(count(xmf, "/step/0000/000003/reaction") == 1, "the reaction is not in fields.xmf");
  SB_CHECK(strstr(xmf, "<Time Value=\"0.30000000000000004\"/>"), "time of step 3");
  SB_CHECK(strstr(xmf, "</Xdmf>"), "fields.xmf has no end");
  PetscCall(PetscFree(xmf));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reaction is the residual at constrained vertices and zero elsewhere. */
static PetscErrorCode test_reaction(void)
{
  TestScene scene;
  SbOutput out;
  SbH5 h;
  PetscReal *x, *r;
  PetscBool ok;
  PetscBool fine = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(dir, HELD EULER " -output_fields reaction", &scene));
  out = (SbOutput)scene.run->monitors.output;
  SB_CHECK(scene.run->monitors.want_residual, "the residual is not asked for");
  PetscCall(fixture_step(&scene, 0, 0.1, PETSC_TRUE));
  PetscCall(fixture_fields(dir, &h));
  PetscCall(PetscMalloc2(3 * out->point.n, &x, 3 * out->point.n, &r));
  PetscCall(SbH5ReadSlice(&h, "/mesh/x", &out->point, 3, x, &ok));
  PetscCall(SbH5ReadSlice(&h, "/step/0000/000000/reaction", &out->point, 3, r, &ok));
  SB_CHECK(ok, "no reaction");
  for (PetscInt i = 0; i < 3 * out->point.n; i++)
    fine = (PetscBool)(fine && r[i] == (x[i - i % 3] < 1e-9 ? 0.5 : 0.));
  SB_CHECK(fine, "reactions are not those of the held vertices");
  PetscCall(PetscFree2(x, r));
  PetscCall(SbH5Close(&h));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The field of a set is 1 at its points, and in its tets if it has any; also with separate points
   per cell. */
static PetscErrorCode check_sets(const char *more)
{
  TestScene scene;
  SbOutput out;
  SbH5 h;
  PetscReal *x, *left, *half, *tets;
  PetscReal volume = 0.;
  PetscBool ok[4];
  PetscBool fine = PETSC_TRUE;
  char *xmf;

  PetscFunctionBeginUser;
  PetscCall(test_open_in(
    dir, &scene,
    HELD EULER " -sets left,half -set_half_at halfspace:1,0,0,0.2 -output_fields sets %s", more));
  out = (SbOutput)scene.run->monitors.output;
  PetscCall(fixture_step(&scene, 0, 0.1, PETSC_TRUE));
  PetscCall(fixture_fields(dir, &h));
  PetscCall(PetscMalloc4(3 * out->point.n, &x, out->point.n, &left, out->point.n, &half,
                         out->cell.n, &tets));
  PetscCall(SbH5ReadSlice(&h, "/mesh/x", &out->point, 3, x, &ok[0]));
  PetscCall(SbH5ReadSlice(&h, "/mesh/set_left", &out->point, 1, left, &ok[1]));
  PetscCall(SbH5ReadSlice(&h, "/mesh/set_half", &out->point, 1, half, &ok[2]));
  PetscCall(SbH5ReadSlice(&h, "/mesh/tets_half", &out->cell, 1, tets, &ok[3]));
  SB_CHECK(ok[0] && ok[1] && ok[2] && ok[3], "an array of a set is missing");
  SB_CHECK(H5Lexists(h.file, "/mesh/tets_left", H5P_DEFAULT) <= 0, "tets in a plane");
  for (PetscInt i = 0; i < out->point.n; i++)
    fine = (PetscBool)(fine && left[i] == (x[3 * i] < 1e-9) && half[i] == (x[3 * i] < 0.2 + 1e-9));
  SB_CHECK(fine, "points of the sets%s", more);
  for (PetscInt c = 0; c < out->cell.n; c++)
    volume += tets[c];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &volume, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(2 * volume == out->cell.N, "%g of %d tets in one half", volume, (int)out->cell.N);
  PetscCall(PetscFree4(x, left, half, tets));
  PetscCall(SbH5Close(&h));
  PetscCall(test_scene_close(&scene));
  PetscCall(fixture_read(dir, "fields.xmf", &xmf));
  SB_CHECK(count(xmf, "\"set_left\" AttributeType=\"Scalar\" Center=\"Node\"") == 1 &&
             count(xmf, "\"tets_half\" AttributeType=\"Scalar\" Center=\"Cell\"") == 1 &&
             !strstr(xmf, "/sets"),
           "sets in fields.xmf");
  PetscCall(PetscFree(xmf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_sets(void)
{
  PetscFunctionBeginUser;
  PetscCall(check_sets(""));
  PetscCall(check_sets(" -output_discontinuous"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_two_bodies(void)
{
  TestScene scene;
  SbH5 h;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir,
    "-bodies a,b -body_a_mesh box:0.4,0.1,0.2:4,1,2 -body_b_mesh box:0.4,0.1,0.2:4,1,2 "
    "-body_b_translate "
    "0,0,1 -body_b_material linear -body_b_young 1 -body_b_poisson 0 -body_b_density 1" MATERIAL
      EULER,
    &scene));
  PetscCall(fixture_fields(dir, &h));
  PetscCall(check_mesh((SbOutput)scene.run->monitors.output, &h, 0.016));
  PetscCall(SbH5Close(&h));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks which of the steps 0..n are frames. */
static PetscErrorCode frames_of(const char *more, PetscInt n, PetscReal dt, char frames[])
{
  TestScene scene;
  char *xmf, name[64];

  PetscFunctionBeginUser;
  PetscCall(test_open_in(dir, &scene, BOX EULER "-output_fields displacement %s", more));
  for (PetscInt k = 0; k <= n; k++)
    PetscCall(fixture_step(&scene, k, dt, (PetscBool)(k == n)));
  PetscCall(fixture_read(dir, "fields.xmf", &xmf));
  for (PetscInt k = 0; k <= n; k++) {
    SbFormat(sizeof(name), name, "/%06d/displacement", (int)k);
    frames[k] = strstr(xmf, name) ? '1' : '0';
  }
  frames[n + 1] = 0;
  PetscCall(PetscFree(xmf));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_which_frames(void)
{
  static const struct {
    const char *options;
    PetscReal dt;
    const char *frames;
  } cases[] = {
    {"", 0.1, "11111111111"},
    {"-output_every_steps 4", 0.1, "10001000101"}, // the last step is always a frame
    {"-output_every 0.3", 0.1, "10010010011"},     // 3 * 0.1 exceeds 0.3 by rounding
    {"-output_every 0.25", 0.1, "10010100101"},    // the first step at or after each multiple
    {"-output_every 0.01", 0.1, "11111111111"},    // shorter than a step: every step, once
  };
  char frames[16];

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    PetscCall(frames_of(cases[i].options, 10, cases[i].dt, frames));
    SB_CHECK(!strcmp(frames, cases[i].frames), "'%s' gives frames %s, expected %s",
             cases[i].options, frames, cases[i].frames);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Address and size of the object header of a group in the file. */
static void header_of(hid_t file, const char *name, unsigned long *address, unsigned long *size)
{
  H5O_info_t info;
  const hid_t group = H5Oopen(file, name, H5P_DEFAULT);

  *address = *size = 0;
#if H5_VERSION_GE(1, 12, 0)
  {
    H5O_native_info_t native;

    if (H5Oget_info3(group, &info, H5O_INFO_BASIC) >= 0 &&
        H5Oget_native_info(group, &native, H5O_NATIVE_INFO_HDR) >= 0) {
      memcpy(address, &info.token,
             sizeof(*address)); // the token of the native format is the address
      *size = (unsigned long)native.hdr.space.total;
    }
  }
#else
  if (H5Oget_info2(group, &info, H5O_INFO_BASIC | H5O_INFO_HDR) >= 0) {
    *address = (unsigned long)info.addr;
    *size = (unsigned long)info.hdr.space.total;
  }
#endif
  (void)H5Oclose(group);
}

/* More than a hundred frames; the links of each hundred fit in one page of the file, so that a name
   is added atomically. */
static PetscErrorCode test_hundreds(void)
{
  TestScene scene;
  SbH5 h;
  char *xmf;
  unsigned long address, size;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(dir, BOX EULER "-output_fields J", &scene));
  for (PetscInt k = 0; k <= 230; k++)
    PetscCall(fixture_step(&scene, k, 0.001, (PetscBool)(k == 230)));
  PetscCall(fixture_fields(dir, &h));
  for (int i = 0; i < 3; i++) {
    char name[32];

    SbFormat(sizeof(name), name, "/step/%04d", i);
    header_of(h.file, name, &address, &size);
    SB_CHECK(size > 0 && size <= 4096 && address % 4096 == 0, "%s lies at %lu and takes %lu bytes",
             name, address, size);
  }
  header_of(h.file, "/step", &address, &size);
  SB_CHECK(size > 0 && size <= 4096 && address % 4096 == 0, "/step lies at %lu and takes %lu bytes",
           address, size);
  PetscCall(SbH5Close(&h));
  PetscCall(fixture_read(dir, "fields.xmf", &xmf));
  SB_CHECK(count(xmf, "<Time ") == 231 && strstr(xmf, "/step/0002/000230/J"),
           "%d frames in fields.xmf", (int)count(xmf, "<Time "));
  PetscCall(PetscFree(xmf));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A run to step 6 that is restarted from the checkpoint of step 4. */
static PetscErrorCode test_restart(void)
{
  TestScene scene;
  SbH5 h;
  char *xmf;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(dir, HELD EULER ALL " -checkpoint_every_steps 4", &scene));
  for (PetscInt k = 0; k <= 6; k++)
    PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
  PetscCall(test_scene_close(&scene));
  PetscCall(test_open_in(dir, &scene, HELD EULER ALL " -restart %s/checkpoint_000004.h5", dir));
  SB_CHECK(scene.run->clock.step0 == 4, "restart at step %d", (int)scene.run->clock.step0);
  PetscCall(fixture_read(dir, "fields.xmf", &xmf));
  SB_CHECK(count(xmf, "<Time ") == 5 && !strstr(xmf, "/000005/"), "after a restart at 4: %d frames",
           (int)count(xmf, "<Time "));
  PetscCall(PetscFree(xmf));
  for (PetscInt k = 4; k <= 6; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 6)));
  PetscCall(fixture_read(dir, "fields.xmf", &xmf));
  SB_CHECK(count(xmf, "<Time ") == 7, "at the end: %d frames", (int)count(xmf, "<Time "));
  SB_CHECK(count(xmf, "\"set_left\"") == 7 && count(xmf, "\"rank\"") == 7,
           "arrays of the mesh in the index");
  SB_CHECK(strstr(xmf, "/step/0001/000006/"), "the frames after the restart begin a new hundred");
  PetscCall(PetscFree(xmf));
  PetscCall(fixture_fields(dir, &h));
  SB_CHECK(H5Lexists(h.file, "/step/0000/000005", H5P_DEFAULT) <= 0,
           "the old step 5 is still there");
  PetscCall(check_values((SbOutput)scene.run->monitors.output, &h, "/step/0000/000003", 0.3, 1e-6));
  PetscCall(check_values((SbOutput)scene.run->monitors.output, &h, "/step/0001/000005", 0.5, 1e-6));
  PetscCall(SbH5Close(&h));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_nothing(void)
{
  TestScene scene;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir, BOX EULER "-output_fields none -output_history false -progress false", &scene));
  SB_CHECK(scene.run->monitors.n == 0, "%d monitors", (int)scene.run->monitors.n);
  SB_CHECK(!scene.run->monitors.want_energies && !scene.run->monitors.want_residual,
           "energies or residual are asked for");
  PetscCall(test_scene_close(&scene));
  SB_CHECK(!fixture_exists(dir, "fields.h5") && !fixture_exists(dir, "history.csv"),
           "files that nobody asked for");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A restart on a file that is cut, no HDF5, or has no list of frames: it stays as it was, beside a
   new one. */
static PetscErrorCode test_restart_damaged(void)
{
  static const char scene_text[] =
    HELD EULER "-output_fields displacement -checkpoint_every_steps 1 ";
  static const char *const ending[] = {"", "_2", "_3"};
  TestScene scene;
  char path[PETSC_MAX_PATH_LEN], kept[PETSC_MAX_PATH_LEN];
  char *text, *now;
  size_t size, kept_size;
  PetscMPIInt rank;
  SbH5 h;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  SbFormat(sizeof(path), path, "%s/fields.h5", dir);
  for (int k = 0; k < 3; k++) {
    PetscCall(test_scene_open_in(dir, scene_text, &scene));
    for (PetscInt i = 0; i <= 2; i++)
      PetscCall(fixture_step(&scene, i, 0.1, (PetscBool)(i == 2)));
    PetscCall(test_scene_close(&scene));
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(fixture_read_file(path, &text, &size));
    SB_CHECK(text && size > 2000, "no fields.h5");
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    if (k == 0)
      size--;
    if (k == 1)
      memset(text, 7, size);
    if (!rank)
      fixture_write(path, text, size);
    if (!rank && k == 2) {
      const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);

      (void)H5Ldelete(file, "step", H5P_DEFAULT);
      (void)H5Fclose(file);
    }
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));

    PetscCall(test_open_in(dir, &scene, "%s -restart latest", scene_text));
    PetscCall(fixture_step(&scene, 2, 0.1, PETSC_FALSE));
    PetscCall(fixture_step(&scene, 3, 0.1, PETSC_TRUE));
    PetscCall(test_scene_close(&scene));
    SbFormat(sizeof(kept), kept, "%s/fields_before_000002%s.h5", dir, ending[k]);
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(fixture_read_file(kept, &now, &kept_size));
    SB_CHECK(now && (k == 2 || (kept_size == size && !memcmp(now, text, size))),
             "case %d: %s is not the file that was there", k, kept);
    PetscCall(fixture_fields(dir, &h));
    SB_CHECK(H5Lexists(h.file, "step/0000/000002", H5P_DEFAULT) > 0 &&
               H5Lexists(h.file, "step/0000/000003", H5P_DEFAULT) > 0,
             "case %d: the new file lacks frames", k);
    PetscCall(SbH5Close(&h));
    PetscCall(PetscFree(text));
    PetscCall(PetscFree(now));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_values("double", 1e-13)); // rounding of a few operations
  PetscCall(test_values("float", 1.2e-7)); // half a unit in the last place of a float, twice
  PetscCall(test_reaction());
  PetscCall(test_sets());
  PetscCall(test_two_bodies());
  PetscCall(test_which_frames());
  PetscCall(test_hundreds());
  PetscCall(test_restart());
  PetscCall(test_restart_damaged());
  PetscCall(test_nothing());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
