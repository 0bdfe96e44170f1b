// @ranks 1 2 3
/*
  Directions of fibres, and temperatures, that do not come from formulas: arrays of gmsh, VTK and
  .h5 files, of bodies that are scaled, turned, moved, copied and refined; and the rule of Bayer et
  al., on a block, whose Laplace problems have linear solutions.
*/
#include <sbmeshio.h>
#include "../verify/verify.h"

static void cube(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  x[0] *= 2.;
}

/* The direction that a tet of the file has: of its centre there. */
static void direction(const PetscReal x[3], int what, PetscReal v[3])
{
  v[0] = 1. + x[1] + what;
  v[1] = x[0] - 0.4 * what;
  v[2] = 0.3 - x[2];
}

/* Likewise its temperature, K. */
static PetscReal heat(const PetscReal x[3])
{
  return 5. + x[0] - 2. * x[1] + 3. * x[2];
}

/* Centre of a tet of the file, before the body is placed. */
static void centre(const PetscInt n[3], PetscInt tet, PetscReal x[3])
{
  const PetscInt cell = tet / 6;
  const PetscInt at[3] = {cell % n[0], cell / n[0] % n[1], cell / n[0] / n[1]};
  PetscInt v[4];

  verify_tet(n, at, (int)(tet % 6), v);
  for (int k = 0; k < 3; k++)
    x[k] = 0.;
  for (int i = 0; i < 4; i++) {
    x[0] += 2. * (PetscReal)(v[i] % (n[0] + 1)) / (PetscReal)n[0] / 4.;
    x[1] += (PetscReal)(v[i] / (n[0] + 1) % (n[1] + 1)) / (PetscReal)n[1] / 4.;
    x[2] += (PetscReal)(v[i] / (n[0] + 1) / (n[1] + 1)) / (PetscReal)n[2] / 4.;
  }
}

static const PetscInt n3[3] = {3, 2, 2};
#define TETS 72

static PetscErrorCode write_gmsh(char path[512], PetscBool lacks)
{
  static const char *const names[2] = {"fibre", "sheet"};
  char other[512];
  FILE *f;
  FILE *from = NULL;

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n3, cube, NULL, other));
  PetscCall(test_file_open(".msh", path, &f));
  if (f) {
    from = fopen(other, "r");
    for (int c = fgetc(from); c != EOF; c = fgetc(from))
      (void)fputc(c, f);
    (void)fclose(from);
    for (int what = 0; what < 2; what++) {
      fprintf(f, "$ElementData\n1\n\"%s\"\n1\n0.0\n3\n0\n3\n%d\n", names[what], TETS - lacks);
      for (PetscInt t = TETS - 1; t >= (lacks ? 1 : 0); t--) {
        PetscReal x[3], v[3];

        centre(n3, t, x);
        direction(x, what, v);
        fprintf(f, "%d %.17g %.17g %.17g\n", (int)t + 1, v[0], v[1], v[2]);
      }
      fprintf(f, "$EndElementData\n");
    }
    fprintf(f, "$ElementData\n1\n\"heat\"\n1\n0.0\n3\n0\n1\n%d\n", TETS);
    for (PetscInt t = 0; t < TETS; t++) {
      PetscReal x[3];

      centre(n3, t, x);
      fprintf(f, "%d %.17g\n", (int)t + 1, heat(x));
    }
    fprintf(f, "$EndElementData\n");
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode write_vtk(char path[512])
{
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".vtk", path, &f));
  if (f) {
    fprintf(f, "# vtk DataFile Version 3.0\nfibres\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 36 "
               "double\n");
    for (PetscInt v = 0; v < 36; v++)
      fprintf(f, "%.17g %g %g\n", 2. * (double)(v % 4) / 3., (double)(v / 4 % 3) / 2.,
              (double)(v / 12) / 2.);
    fprintf(f, "CELLS %d %d\n", TETS, 5 * TETS);
    for (PetscInt t = 0; t < TETS; t++) {
      const PetscInt at[3] = {t / 6 % 3, t / 18 % 2, t / 36};
      PetscInt v[4];

      verify_tet(n3, at, (int)(t % 6), v);
      fprintf(f, "4 %d %d %d %d\n", (int)v[0], (int)v[1], (int)v[2], (int)v[3]);
    }
    fprintf(f, "CELL_TYPES %d\n", TETS);
    for (PetscInt t = 0; t < TETS; t++)
      fprintf(f, "10\n");
    fprintf(f, "CELL_DATA %d\n", TETS);
    for (int what = 0; what < 2; what++) {
      fprintf(f, "VECTORS %s double\n", what ? "sheet" : "fibre");
      for (PetscInt t = 0; t < TETS; t++) {
        PetscReal x[3], v[3];

        centre(n3, t, x);
        direction(x, what, v);
        fprintf(f, "%.17g %.17g %.17g\n", v[0], v[1], v[2]);
      }
    }
    fprintf(f, "SCALARS heat double 1\nLOOKUP_TABLE default\n");
    for (PetscInt t = 0; t < TETS; t++) {
      PetscReal x[3];

      centre(n3, t, x);
      fprintf(f, "%.17g\n", heat(x));
    }
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The values of an array, by the number of the tet. */
static void fill_array(int what, PetscReal value[3 * TETS])
{
  for (PetscInt t = 0; t < TETS; t++) {
    PetscReal x[3];

    centre(n3, t, x);
    direction(x, what, value + 3 * t);
  }
}

/* In pieces of TETS / npiece tets, each with all points. */
static PetscErrorCode write_vtu(int npiece, char path[512])
{
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".vtu", path, &f));
  if (f) {
    fprintf(f, "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
               "byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n");
  }
  for (int piece = 0; f && piece < npiece; piece++) {
    const PetscInt n = TETS / npiece;
    const PetscInt first = piece * n;

    fprintf(f,
            "<Piece NumberOfPoints=\"36\" NumberOfCells=\"%d\">\n<Points><DataArray "
            "type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n",
            (int)n);
    for (PetscInt v = 0; v < 36; v++)
      fprintf(f, "%.17g %g %g\n", 2. * (double)(v % 4) / 3., (double)(v / 4 % 3) / 2.,
              (double)(v / 12) / 2.);
    fprintf(f, "</DataArray></Points>\n<Cells><DataArray type=\"Int32\" Name=\"connectivity\" "
               "format=\"ascii\">\n");
    for (PetscInt t = first; t < first + n; t++) {
      const PetscInt at[3] = {t / 6 % 3, t / 18 % 2, t / 36};
      PetscInt v[4];

      verify_tet(n3, at, (int)(t % 6), v);
      fprintf(f, "%d %d %d %d\n", (int)v[0], (int)v[1], (int)v[2], (int)v[3]);
    }
    fprintf(f, "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n");
    for (PetscInt t = 0; t < n; t++)
      fprintf(f, "%d\n", (int)(4 * t + 4));
    fprintf(f, "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n");
    for (PetscInt t = 0; t < n; t++)
      fprintf(f, "10\n");
    fprintf(f, "</DataArray></Cells>\n<CellData>\n");
    for (int what = 0; what < 2; what++) {
      PetscReal value[3 * TETS];

      fill_array(what, value);
      fprintf(f,
              "<DataArray type=\"Float64\" Name=\"%s\" NumberOfComponents=\"3\" "
              "format=\"ascii\">\n",
              what ? "sheet" : "fibre");
      for (PetscInt k = 3 * first; k < 3 * (first + n); k++)
        fprintf(f, "%.17g\n", value[k]);
      fprintf(f, "</DataArray>\n");
    }
    fprintf(f, "<DataArray type=\"Float64\" Name=\"heat\" format=\"ascii\">\n");
    for (PetscInt t = first; t < first + n; t++) {
      PetscReal x[3];

      centre(n3, t, x);
      fprintf(f, "%.17g\n", heat(x));
    }
    fprintf(f, "</DataArray></CellData></Piece>\n");
  }
  if (f)
    fprintf(f, "</UnstructuredGrid></VTKFile>\n");
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh of a .msh as an .h5 of supple's, with the arrays added to it. */
static PetscErrorCode write_h5(const char *msh, char path[512])
{
  SbBody body = {.name = "a", .scale = 1., .density = 1.};
  SbImport im = {0};
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".h5", path, &f));
  const PetscBool first = (PetscBool)(f != NULL);

  PetscCall(test_file_close(f));
  if (first) {
    (void)snprintf(body.mesh, sizeof(body.mesh), "%s", msh);
    PetscCall(SbImportRead(&body, &im));
    PetscCall(SbMeshFileWrite(&im, path, SB_MESH_H5));
    const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    for (int what = 0; what < 2; what++) {
      const hsize_t size[2] = {TETS, 3};
      const hid_t space = H5Screate_simple(2, size, NULL);
      const hid_t set = H5Dcreate2(file, what ? "/mesh/sheet" : "/mesh/fibre", H5T_NATIVE_DOUBLE,
                                   space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      PetscReal value[3 * TETS];

      fill_array(what, value);
      SB_CHECK(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0,
               "an array is not written");
      (void)H5Dclose(set);
      (void)H5Sclose(space);
    }
    const hsize_t size = TETS;
    const hid_t space = H5Screate_simple(1, &size, NULL);
    const hid_t set = H5Dcreate2(file, "/mesh/heat", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT,
                                 H5P_DEFAULT, H5P_DEFAULT);
    PetscReal value[TETS];

    for (PetscInt t = 0; t < TETS; t++) {
      PetscReal x[3];

      centre(n3, t, x);
      value[t] = heat(x);
    }
    SB_CHECK(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0,
             "an array is not written");
    (void)H5Dclose(set);
    (void)H5Sclose(space);
    (void)H5Fclose(file);
    PetscCall(SbImportDestroy(&im));
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define LAW                                                                                        \
  "-body_a_material holzapfel_ogden -body_a_a 1e3 -body_a_b 1 -body_a_a_f 1e3 -body_a_b_f 1 "      \
  "-body_a_a_s 1e2 -body_a_b_s 1 -body_a_bulk 1e5 -body_a_density 1000 -time newmark -ts_dt 1e-3 " \
  "-ts_max_time 1e-3 "

/* Largest difference of the axes and temperatures from those of the file, for a body that is scaled
   by 0.1 and turned by 90 degrees about z, all copies alike. */
static PetscErrorCode check_file(const char *path, const char *more)
{
  TestScene t;
  PetscReal worst = 0.;
  PetscReal hottest = 0.;
  PetscReal *value[2];

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh %s -body_a_scale 0.1 -body_a_rotate 0,0,1,90 "
                      "-body_a_translate 1,2,3 -body_a_fibre_field fibre -body_a_sheet_field sheet "
                      "-body_a_thermal_expansion 1e-5 -body_a_temperature 2 "
                      "-body_a_temperature_field heat %s %s",
                      path, LAW, more));
  const SbMesh mesh = t.model->mesh;
  for (int i = 0; i < 2; i++) {
    PetscCall(PetscMalloc1(3 * mesh->ncell_owned, &value[i]));
    SbSpaceCellAxis(t.model->space, i, value[i]);
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const SbBody *body = &mesh->body[mesh->cell_body[c]];
    PetscReal x[3] = {0., 0., 0.};
    PetscReal v[2][3];

    /* back to the file: x = R (s X) + t, R X = (-Y, X, Z) */
    for (int k = 0; k < 12; k++)
      x[k % 3] += mesh->x[3 * mesh->cell[4 * c + k / 3] + k % 3] / 4.;
    for (int k = 0; k < 3; k++)
      x[k] = (x[k] - body->translate[k]) / 0.1;
    const PetscReal X[3] = {x[1], -x[0], x[2]};
    hottest = PetscMax(hottest, PetscAbsReal(mesh->temperature[c] - heat(X)));
    for (int i = 0; i < 2; i++) {
      PetscReal a[3];

      direction(X, i, a);
      v[i][0] = -a[1];
      v[i][1] = a[0];
      v[i][2] = a[2];
      if (i) {
        const PetscReal along = SbDot3(v[0], v[1]);

        for (int k = 0; k < 3; k++)
          v[1][k] -= along * v[0][k];
      }
      (void)SbNormalise(v[i]);
      for (int k = 0; k < 3; k++)
        worst = PetscMax(worst, PetscAbsReal(v[i][k] - value[i][3 * c + k]));
    }
  }
  SB_CHECK(worst < 1e-12, "%s %s: axes off by %g", path, more, worst);
  SB_CHECK(hottest < 1e-12, "%s %s: temperatures off by %g K", path, more, hottest);
  for (int i = 0; i < 2; i++)
    PetscCall(PetscFree(value[i]));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_files(void)
{
  char path[512], bad[512];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(write_gmsh(path, PETSC_FALSE));
  PetscCall(check_file(path, ""));
  PetscCall(check_file(path, "-body_a_element p2"));
  PetscCall(check_file(path, "-body_a_copies grid:2,1,1,3,0,0"));
  SB_CHECK_ERROR(test_open(&t, "-bodies a -body_a_mesh %s -body_a_fibre_field fiber %s", path,
                           LAW "-body_a_sheet 0,1,0"),
                 PETSC_ERR_USER_INPUT, "-body_a_fibre_field|fiber");
  PetscCall(test_scene_close(&t));
  SB_CHECK_ERROR(test_open(&t,
                           "-bodies a -body_a_mesh %s -body_a_thermal_expansion 1e-5 "
                           "-body_a_temperature 1 -body_a_temperature_field fibre "
                           "-body_a_fibre 1,0,0 %s",
                           path, LAW "-body_a_sheet 0,1,0"),
                 PETSC_ERR_USER_INPUT, "-body_a_temperature_field|fibre|one number");
  PetscCall(test_scene_close(&t));
  PetscCall(write_gmsh(bad, PETSC_TRUE));
  SB_CHECK_ERROR(test_open(&t, "-bodies a -body_a_mesh %s -body_a_fibre_field fibre %s", bad,
                           LAW "-body_a_sheet 0,1,0"),
                 PETSC_ERR_USER_INPUT, "-body_a_fibre_field|fibre|tet 1");
  PetscCall(test_scene_close(&t));
  PetscCall(write_vtk(path));
  PetscCall(check_file(path, ""));
  for (int npiece = 1; npiece < 4; npiece++) {
    PetscCall(write_vtu(npiece, path));
    PetscCall(check_file(path, ""));
  }
  PetscCall(write_gmsh(bad, PETSC_FALSE));
  PetscCall(write_h5(bad, path));
  PetscCall(check_file(path, ""));
  PetscCall(check_file(path, "-mesh_reading slabs"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A wall of thickness 1 along x, its base above: psi = z, epi = x. With the same beta on both sides
   the fibre is turned by a_in (1 - d) + d (a_in (1 - d) + a_out d) from y to z. */
static PetscErrorCode test_rule(void)
{
  const PetscReal beta = 20. * PETSC_PI / 180.;
  PetscReal worst = 0.;
  PetscReal *value[2];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:1,1,1:4 -body_a_fibre_surfaces "
                      "xmax,xmin,zmax,zmin -body_a_fibre_angles 50,-30,20,20 %s",
                      LAW));
  const SbMesh mesh = t.model->mesh;
  for (int i = 0; i < 2; i++) {
    PetscCall(PetscMalloc1(3 * mesh->ncell_owned, &value[i]));
    SbSpaceCellAxis(t.model->space, i, value[i]);
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal d = 0.;

    for (int i = 0; i < 4; i++)
      d += mesh->x[3 * mesh->cell[4 * c + i]] / 4.;
    const PetscReal a = (50. * (1. - d) + d * (50. * (1. - d) - 30. * d)) * PETSC_PI / 180.;
    const PetscReal f[3] = {0., cos(a), sin(a)};
    const PetscReal s[3] = {cos(beta), -sin(beta) * sin(a), sin(beta) * cos(a)};

    for (int k = 0; k < 3; k++) {
      worst = PetscMax(worst, PetscAbsReal(value[0][3 * c + k] - f[k]));
      worst = PetscMax(worst, PetscAbsReal(value[1][3 * c + k] - s[k]));
    }
  }
  test_print("  rule: axes off by %.2e\n", (double)worst);
  SB_CHECK(worst < 1e-7, "axes by the rule are off by %g", worst);
  for (int i = 0; i < 2; i++)
    PetscCall(PetscFree(value[i]));
  PetscCall(test_scene_close(&t));
  SB_CHECK_ERROR(test_open(&t, "-bodies a -body_a_mesh box:1,1,1:2 -body_a_fibre_surfaces "
                               "xmax,xmin,zmax " LAW),
                 PETSC_ERR_USER, "-body_a_fibre_surfaces|3");
  PetscCall(test_scene_close(&t));
  SB_CHECK_ERROR(
    test_open(&t, "-bodies a,b -body_a_mesh box:1,1,1:2 -body_b_mesh box:1,1,1:2 "
                  "-body_b_translate 2,0,0 -body_b_material yeoh -body_b_c1 1 -body_b_bulk 1 "
                  "-body_a_fibre_surfaces xmax,xmin,zmax,b " LAW),
    PETSC_ERR_USER_INPUT, "-body_a_fibre_surfaces|b|a");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a right ventricle: two cavities in a block, alike but for a mirror. Its axes are mirrored,
   but for signs: at the middle of the septum the angle is 0, and at outer walls of both sides it
   has the opposite sign. */
static PetscErrorCode test_two(void)
{
  PetscReal *value[2];
  PetscReal worst[2] = {0., 0.};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:4,1,1:16,4,4 -sets l,r,o,septum -set_l_at "
                      "box:-1,-1,-1,0.01,2,2 -set_r_at box:3.99,-1,-1,5,2,2 -set_o_at "
                      "plane:0,1,0,1 -set_septum_at plane:1,0,0,2 -body_a_fibre_surfaces "
                      "o,l,zmax,zmin,r -body_a_fibre_angles 60,-40,0,0 %s",
                      LAW));
  const SbMesh mesh = t.model->mesh;
  for (int i = 0; i < 2; i++) {
    PetscCall(PetscMalloc1(3 * mesh->ncell_owned, &value[i]));
    SbSpaceCellAxis(t.model->space, i, value[i]);
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal x[3] = {0., 0., 0.};

    for (int k = 0; k < 12; k++)
      x[k % 3] += mesh->x[3 * mesh->cell[4 * c + k / 3] + k % 3] / 4.;
    worst[0] = PetscMax(worst[0], PetscAbsReal(SbDot3(value[0] + 3 * c, value[1] + 3 * c)));

    /* at both cavities the fibre is at 60 degrees to the circumference, y, far from the outside */
    if ((x[0] < 0.25 || x[0] > 3.75) && x[1] < 0.25)
      worst[1] = PetscMax(
        worst[1], PetscAbsReal(PetscAbsReal(value[0][3 * c + 2]) - sin(60. * PETSC_PI / 180.)));
  }
  SB_CHECK(worst[0] < 1e-12, "fibre and sheet are not orthogonal: %g", worst[0]);
  SB_CHECK(worst[1] < 0.2, "fibres at the cavities are off by %g", worst[1]);
  for (int i = 0; i < 2; i++)
    PetscCall(PetscFree(value[i]));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets and options that would give any directions, or be without effect. */
static PetscErrorCode test_rule_faults(void)
{
  static const struct {
    const char *options, *words;
    PetscErrorCode code;
  } bad[] = {
    {"-body_a_fibre_surfaces xmax,xmax,zmax,zmin", "-body_a_fibre_surfaces|'xmax'|'a'|25 ",
     PETSC_ERR_USER_INPUT},
    /* one within another one */
    {"-sets o -set_o_at box:-1,-1,-1,2,2,2 -body_a_fibre_surfaces o,xmin,zmax,zmin",
     "-body_a_fibre_surfaces|'xmin'|'a'|'o'", PETSC_ERR_USER_INPUT},
    {"-sets o -set_o_at box:-1,-1,0.9,2,2,2 -body_a_fibre_surfaces xmax,xmin,o,zmax",
     "'zmax'|'a'|'o'", PETSC_ERR_USER_INPUT},
    {"-body_a_fibre_surfaces xmax,xmin,zmax,zmin,xmin", "'xmin'|'a'", PETSC_ERR_USER_INPUT},
    /* the way to the base is that through the wall */
    {"-body_a_fibre_surfaces zmax,zmin,zmax,zmin", "'a'|zmax, zmin, zmax, zmin|384 of 384",
     PETSC_ERR_USER_INPUT},
    /* half of the block is within a set */
    {"-sets o -set_o_at box:0.4,-1,-1,2,2,2 -body_a_fibre_surfaces o,xmin,zmax,zmin",
     "'a'|o, xmin, zmax, zmin| of 384 tets no direction", PETSC_ERR_USER_INPUT},
    {"-body_a_fibre_angles 1,2,3,4", "-body_a_fibre_angles|-body_a_fibre_surfaces", PETSC_ERR_USER},
    {"-body_a_fibre_surfaces xmax,xmin,zmax,zmin -body_a_fibre 1,0,0",
     "-body_a_fibre |-body_a_fibre_surfaces", PETSC_ERR_USER},
    {"-body_a_fibre_surfaces xmax,xmin,zmax,zmin -body_a_sheet 1,0,0",
     "-body_a_sheet |-body_a_fibre_surfaces", PETSC_ERR_USER},
    {"-body_default_fibre_surfaces xmax,xmin,zmax,zmin -body_default_fibre 1,0,0",
     "-body_default_fibre |-body_default_fibre_surfaces", PETSC_ERR_USER},
    {"-body_a_fibre_field f -body_a_fibre 1,0,0", "-body_a_fibre |-body_a_fibre_field",
     PETSC_ERR_USER},
  };
  TestScene t;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(bad); k++) {
    SB_CHECK_ERROR(test_open(&t, "-bodies a -body_a_mesh box:1,1,1:4 %s %s", bad[k].options, LAW),
                   bad[k].code, bad[k].words);
    PetscCall(test_scene_close(&t));
  }

  /* what holds for all bodies does not meet a body with a rule of its own */
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:1,1,1:4 -body_a_fibre_surfaces "
                      "xmax,xmin,zmax,zmin -body_default_fibre 1,0,0 %s",
                      LAW));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last layer of tets has all vertices in the outer set, and goes by those beside it: sheets are
   through the wall. */
static PetscErrorCode test_layer(void)
{
  PetscReal least = 1.;
  PetscReal *value;
  PetscInt n = 0;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:1,1,1:4 -sets o -set_o_at box:0.7,-1,-1,2,2,2 "
                      "-body_a_fibre_surfaces o,xmin,zmax,zmin -body_a_fibre_angles 0,0,0,0 %s",
                      LAW));
  const SbMesh mesh = t.model->mesh;
  PetscCall(PetscMalloc1(3 * mesh->ncell_owned, &value));
  SbSpaceCellAxis(t.model->space, 1, value);
  for (PetscInt c = 0; c < mesh->ncell_owned; c++, n++)
    least = PetscMin(least, PetscAbsReal(value[3 * c]));
  SB_CHECK(!n || least > 1. - 1e-6, "a sheet is not through the wall: %g", (double)least);
  PetscCall(PetscFree(value));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_files());
  PetscCall(test_rule());
  PetscCall(test_two());
  PetscCall(test_layer());
  PetscCall(test_rule_faults());
  SB_TEST_END();
}
