// Meshes in HDF5, written by supple-mesh and by a run: the same distributed mesh as from other
// files; each kind of damage has its message. @ranks 1 2 3
#include <hdf5.h>
#include "mesh_same.h"
#include <sbsurface.h>

#define DATA "tests/data/"

/* Writes a mesh in the program's own format. */
static PetscErrorCode write_mesh(const char *mesh, const char *path)
{
  SbImport *im;

  PetscFunctionBeginUser;
  PetscCall(test_read(mesh, 0, &im));
  PetscCall(SbMeshFileWrite(im, path, SB_MESH_AUTO));
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums over owned cells that do not depend on the partition: volume, original numbers with their
   vertices, sets. */
static PetscErrorCode fingerprint(const char *mesh_path, PetscReal sum[4])
{
  SbBody body = test_body("b", mesh_path);
  SbSet set[2];
  SbMesh mesh;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(sum, 4));
  PetscCall(test_set("w", "group:wall", &set[0]));
  PetscCall(test_set("l", "group:left", &set[1]));
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, 2, set, &mesh));
  PetscCall(SbMeshValidate(mesh));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt *v = mesh->cell + 4 * c;

    sum[0] += SbTetDeterminant(mesh->x, v) / 6;
    for (int a = 0; a < 4; a++)
      sum[1] +=
        (PetscReal)(mesh->cell_orig[c] + 1) * (a + 1) * (PetscReal)(mesh->vert_orig[v[a]] + 1);
    sum[2] += (mesh->cell_set[c] & SB_SET_BIT(1)) != 0;
    for (int f = 0; f < 4; f++)
      sum[3] += (mesh->face_set[4 * c + f] & SB_SET_BIT(0)) != 0;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ files written by the test */

static void put_array(hid_t file, const char *name, int ndim, const hsize_t size[], hid_t type,
                      const void *data)
{
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  const hid_t space = H5Screate_simple(ndim, size, NULL);
  hid_t set;

  (void)H5Pset_create_intermediate_group(links, 1);
  set = H5Dcreate2(file, name, type, space, links, H5P_DEFAULT, H5P_DEFAULT);
  if (data)
    (void)H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
  (void)H5Dclose(set);
  (void)H5Sclose(space);
  (void)H5Pclose(links);
}

static void put_text(hid_t file, const char *where, const char *name, const char *text)
{
  const hid_t type = H5Tcopy(H5T_C_S1);
  const hid_t space = H5Screate(H5S_SCALAR);
  hid_t a;

  (void)H5Tset_size(type, strlen(text) + 1);
  a = H5Acreate_by_name(file, where, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  (void)H5Awrite(a, type, text);
  (void)H5Aclose(a);
  (void)H5Sclose(space);
  (void)H5Tclose(type);
}

static const double corner[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const int tet[4] = {0, 1, 2, 3};
static const hsize_t four_by_three[2] = {4, 3}, one_by_four[2] = {1, 4}, one[1] = {1};

/* fields.h5 of a run with one tet: displacement at steps 3 and 120, in single precision. */
static void write_output(const char *path)
{
  const hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const int body[1] = {1};
  float u[12];

  put_array(file, "/mesh/x", 2, four_by_three, H5T_NATIVE_DOUBLE, corner);
  put_array(file, "/mesh/cells", 2, one_by_four, H5T_NATIVE_INT, tet);
  put_array(file, "/mesh/body", 1, one, H5T_NATIVE_INT, body);
  put_text(file, "/mesh", "bodies", "stone,liver");
  for (int i = 0; i < 12; i++)
    u[i] = 0.5f;
  put_array(file, "/step/0000/000003/displacement", 2, four_by_three, H5T_NATIVE_FLOAT, u);
  for (int i = 0; i < 12; i++)
    u[i] = 2.f;
  put_array(file, "/step/0001/000120/displacement", 2, four_by_three, H5T_NATIVE_FLOAT, u);
  (void)H5Fclose(file);
}

static PetscErrorCode test_output(void)
{
  static const struct {
    PetscInt step;
    PetscReal shift;
  } cases[] = {{0, 0}, {3, 0.5}, {120, 2}, {-1, 2}};
  char path[512], text[256];
  SbImport *im;

  PetscFunctionBeginUser;
  PetscCall(test_path("fields.h5", path));
  write_output(path);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    PetscCall(test_read(path, cases[i].step, &im));
    SB_CHECK(im->nvert == 4 && im->item[3].n == 1, "%d vertices", (int)im->nvert);
    SB_CHECK(im->x[0] == cases[i].shift && im->x[3] == 1 + cases[i].shift, "step %d: x = %g",
             (int)cases[i].step, im->x[0]);
    test_groups_of(im, 3, 0, sizeof(text), text);
    SB_CHECK(!strcmp(text, "3 2 liver"), "the tet is of '%s'", text);
    PetscCall(test_free(&im));
  }
  SB_CHECK_ERROR(test_read(path, 7, &im), PETSC_ERR_FILE_UNEXPECTED, "step 7|3|120|-1");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -output_discontinuous: two tets with separate points; a shared vertex is at the mean of its
   points. */
static PetscErrorCode test_discontinuous(void)
{
  const double x[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  const int cells[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  const int vertices[8] = {0, 1, 2, 3, 1, 2, 3, 4};
  const hsize_t points[2] = {8, 3};
  const hsize_t tets[2] = {2, 4};
  double u[24] = {0};
  char path[512];
  SbImport *im;
  hid_t file;

  PetscFunctionBeginUser;
  PetscCall(test_path("split.h5", path));
  file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  put_array(file, "/mesh/x", 2, points, H5T_NATIVE_DOUBLE, x);
  put_array(file, "/mesh/cells", 2, tets, H5T_NATIVE_INT, cells);
  put_array(file, "/mesh/vertices", 2, tets, H5T_NATIVE_INT, vertices);
  u[3 * 1] = 0.5; /* vertex 1, in the first tet only */
  put_array(file, "/step/0000/000001/displacement", 2, points, H5T_NATIVE_DOUBLE, u);
  (void)H5Fclose(file);
  PetscCall(test_read(path, 1, &im));
  SB_CHECK(im->nvert == 5 && im->item[3].n == 2, "%d vertices", (int)im->nvert);
  SB_CHECK(im->item[3].vert[4] == 1 && im->item[3].vert[7] == 4, "vertices of the second tet");
  SB_CHECK(im->x[3] == 1.25 && im->x[4] == 0, "x = %g", im->x[3]);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A linear tet and a P2 tet that is cut into eight: both are read, with six edge nodes, one of them
   off its midpoint; damaged arrays are reported. */
static PetscErrorCode test_cut(void)
{
  static const struct {
    int nparent, at, parent, nten, where, ten;
    const char *words; /* NULL: valid */
  } cases[] = {
    {9, 0, 0, 2, 0, 0, NULL},
    {8, 0, 0, 2, 0, 0, "/mesh/parent|/mesh/cells"},
    {9, 8, 2, 2, 0, 0, "/mesh/parent|2|row 9|0|1"},
    {9, 0, 1, 2, 0, 0, "/mesh/parent|row 1"},
    {-1, 0, 0, 10, 0, 0, "/mesh/cells10|/mesh/cells"},
    {-1, 0, 0, 2, 0, 0, "/mesh/cells10|/mesh/cells"},
    {9, 0, 0, 3, 0, 0, "/mesh/cells10|/mesh/cells"},
    {9, 8, 0, 2, 0, 0, "/mesh/parent|row 9"},
    {9, 0, 0, -1, 0, 0, "/mesh/cells10"},
    {9, 0, 0, 2, 3, -1, "/mesh/cells10|-1|row 1"},
    {9, 0, 0, 2, 19, -2, "/mesh/cells10|-2|row 2"},
    {9, 0, 0, 2, 19, 14, "/mesh/cells10|14|row 2"},
  };
  const double x[42] = {5, 0, 0, 6,  0, 0, 5,  1,  0, 5, 0,  1,  0, 0, 0,  1,  0, 0,  0, 1,  0,
                        0, 0, 1, .5, 0, 0, .5, .5, 0, 0, .5, .1, 0, 0, .5, .5, 0, .5, 0, .5, .5};
  const int cells[36] = {0,  1, 2, 3,  4,  8,  10, 11, 8,  5,  9, 12, 10, 9, 6, 13, 11, 12,
                         13, 7, 8, 13, 10, 11, 8,  13, 11, 12, 8, 13, 12, 9, 8, 13, 9,  10};
  const hsize_t points[2] = {14, 3};
  const hsize_t tets[2] = {9, 4};
  char path[512];
  SbImport *im;

  PetscFunctionBeginUser;
  PetscCall(test_path("cut.h5", path));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    const hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    int body[9] = {0, 1, 1, 1, 1, 1, 1, 1, 1};
    int parent[9] = {0, 1, 1, 1, 1, 1, 1, 1, 1};
    int ten[100] = {0, 1, 2, 3, -1, -1, -1, -1, -1, -1, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13};
    const hsize_t nbody[1] = {9};
    const hsize_t nparent[1] = {(hsize_t)PetscMax(cases[i].nparent, 0)};
    const hsize_t nten[2] = {(hsize_t)PetscMax(cases[i].nten, 0), 10};

    if (cases[i].at || cases[i].parent)
      parent[cases[i].at] = cases[i].parent;
    if (cases[i].where)
      ten[cases[i].where] = cases[i].ten;
    put_array(file, "/mesh/x", 2, points, H5T_NATIVE_DOUBLE, x);
    put_array(file, "/mesh/cells", 2, tets, H5T_NATIVE_INT, cells);
    put_array(file, "/mesh/body", 1, nbody, H5T_NATIVE_INT, body);
    if (cases[i].nten >= 0)
      put_array(file, "/mesh/cells10", 2, nten, H5T_NATIVE_INT, ten);
    if (cases[i].nparent >= 0)
      put_array(file, "/mesh/parent", 1, nparent, H5T_NATIVE_INT, parent);
    (void)H5Fclose(file);
    if (cases[i].words) {
      SB_CHECK_ERROR(test_read(path, 0, &im), PETSC_ERR_FILE_UNEXPECTED, cases[i].words);
      continue;
    }
    PetscCall(test_read(path, 0, &im));
    SB_CHECK(im->nvert == 8 && im->item[3].n == 2, "%d vertices, %d tets", (int)im->nvert,
             (int)im->item[3].n);
    SB_CHECK(im->nmiddle.n == 1 && PetscAbsReal(im->middle[0].off[2] - 0.1) < 1e-15,
             "%d nodes off the middle", (int)im->nmiddle.n);
    SB_CHECK(im->item[3].vert[4] == 4 && im->item[3].number[1] == 2, "the tet of ten nodes");
    PetscCall(test_free(&im));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ damaged files */

/* Reading must fail with these words (NULL: it succeeds), with both -mesh_reading types and in
   supple-mesh; with a note, supple-mesh succeeds and gives the note. */
static PetscErrorCode refuse(const char *path, PetscErrorCode code, const char *words,
                             const char *note)
{
  static const char *const reading[] = {"rank0", "slabs"};
  SbMeshStatistics facts;
  SbImport *im;
  SbMesh mesh;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  for (int k = 0; k < 2; k++) {
    SbBody body = test_body("b", path);

    body.edge_nodes = PETSC_TRUE;
    PetscCall(PetscOptionsSetValue(NULL, "-mesh_reading", reading[k]));
    if (words) {
      SB_CHECK_ERROR(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, 0, NULL, &mesh), code, words);
    } else {
      PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, 0, NULL, &mesh));
      PetscCall(SbMeshDestroy(&mesh));
    }
  }
  PetscCall(PetscOptionsClearValue(NULL, "-mesh_reading"));
  if (note) {
    PetscCall(test_read(path, 0, &im));
    PetscCall(SbMeshFileMeasure(im, &facts));
    SB_CHECK(strstr(facts.body.note, note) != NULL, "'%s' in '%s'", note, facts.body.note);
    PetscCall(test_free(&im));
  } else {
    SB_CHECK_ERROR(test_read(path, 0, &im), code, words);
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces one array of a file; ndim 0 removes it. */
static void replace(const char *path, const char *name, int ndim, const hsize_t size[], hid_t type,
                    const void *data)
{
  const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);

  (void)H5Ldelete(file, name, H5P_DEFAULT);
  if (ndim)
    put_array(file, name, ndim, size, type, data);
  (void)H5Fclose(file);
}

static PetscErrorCode test_damage(void)
{
  const hsize_t lie[2] = {100000000, 4};
  const hsize_t few[1] = {3};
  const hsize_t pair[2] = {2, 2};
  const hsize_t groups[1] = {8};
  const hsize_t two[1] = {2};
  const hsize_t vertices[2] = {23, 3};
  const hsize_t tets[1] = {48};
  const double bad[4] = {0};
  const double reals[69] = {[68] = NAN};
  const int wild[4] = {0, 1, 2, 4711};
  const int below[4] = {0, -1, 2, 3};
  const int high[8] = {0, 1, 2, 3, 4, 3, 3, 3};
  const int falling[2] = {1, 0};
  const int tags[48] = {[47] = 4711};
  const struct {
    const char *name;
    int ndim; /* 0: the array is removed */
    const hsize_t *size;
    hid_t type;
    const void *data;
    const char *words;
  } cases[] = {
    {"/mesh/x", 0, NULL, 0, NULL, "/mesh/x|/mesh/cells"},
    {"/mesh/x", 2, vertices, H5T_NATIVE_DOUBLE, reals, "/mesh/x|row 23"},
    {"/mesh/x", 2, pair, H5T_NATIVE_DOUBLE, bad, "/mesh/x|2 dimensions|2 columns|3"},
    {"/mesh/cells", 2, one_by_four, H5T_NATIVE_DOUBLE, bad, "/mesh/cells"},
    {"/mesh/cells", 2, one_by_four, H5T_NATIVE_INT, wild, "/mesh/cells|4711|row 1|0|22"},
    {"/mesh/cells", 2, one_by_four, H5T_NATIVE_INT, below, "/mesh/cells|-1|row 1"},
    {"/mesh/cells", 2, lie, H5T_NATIVE_INT, NULL, "/mesh/cells|100000000|4 numbers"},
    {"/mesh/cell_tags", 1, few, H5T_NATIVE_INT, tet, "/mesh/cell_tags|rows"},
    {"/mesh/cell_tags", 1, tets, H5T_NATIVE_INT, tags, "/mesh/cell_tags|4711|row 48"},
    {"/groups/dim", 1, groups, H5T_NATIVE_INT, high, "/groups/dim|4|row 5|0|3"},
    {"/groups/dim", 1, two, H5T_NATIVE_INT, high, "/groups/dim|2 rows"},
    {"/tag_sets/start", 1, two, H5T_NATIVE_INT, falling, "/tag_sets/start|1|0"},
    {"/groups/name", 0, NULL, 0, NULL, "/groups/name"},
  };
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_path_of_all("bad.h5", path));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    if (!test_rank) {
      PetscCall(write_mesh(DATA "two_cubes_41.msh", path));
      replace(path, cases[i].name, cases[i].ndim, cases[i].size, cases[i].type, cases[i].data);
    }
    PetscCall(refuse(path, PETSC_ERR_FILE_UNEXPECTED, cases[i].words, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Layout 2 of a cube of six tets around its diagonal 0-7, with two unused vertices: rows of both
   arrays (-1: absent), and the expected message. */
static PetscErrorCode test_curved_damage(void)
{
  static const struct {
    int layout, nedge, noff, edge[3][2];
    double off[3][3];
    const char *words, *note;
  } cases[] = {
    {2, 2, 2, {{7, 0}, {0, 1}}, {{0.1}, {0, -0.1}}, NULL, ", curved tets: 6"},
    {2, 0, 0, {{0}}, {{0}}, NULL, ""},
    {1, 2, 2, {{0, 7}, {0, 1}}, {{0.1}, {0.1}}, "layout 1|/mesh/curved_edges", NULL},
    {1, -1, 1, {{0}}, {{0.1}}, "layout 1|/mesh/edge_offsets", NULL},
    {2, -1, -1, {{0}}, {{0}}, "layout 2|/mesh/curved_edges", NULL},
    {2, 1, -1, {{0, 7}}, {{0}}, "layout 2|/mesh/edge_offsets", NULL},
    {2, -1, 1, {{0}}, {{0.1}}, "layout 2|/mesh/curved_edges", NULL},
    {2, 2, 3, {{0, 7}, {0, 1}}, {{0.1}, {0.1}, {0.1}}, "/mesh/edge_offsets|3 rows|2 are", NULL},
    {2,
     2,
     2,
     {{0, 7}, {0, 10}},
     {{0.1}, {0.1}},
     "/mesh/curved_edges|holds 10|row 2|from 0 to 9",
     NULL},
    {2,
     2,
     2,
     {{-1, 7}, {0, 1}},
     {{0.1}, {0.1}},
     "/mesh/curved_edges|holds -1|row 1|from 0 to 9",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {0, 1}, {4, 4}},
     {{0.1}, {0.1}, {0}},
     "/mesh/curved_edges|holds 4 twice|row 3",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {6, 1}, {0, 1}},
     {{0.1}, {0.1}, {0}},
     "/mesh/curved_edges|1 and 6|row 2",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {0, 1}, {1, 6}},
     {{0.1}, {0.1}, {0}},
     "/mesh/curved_edges|1 and 6|row 3",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {0, 1}, {8, 9}},
     {{0.1}, {0.1}, {0.1}},
     "/mesh/curved_edges|8 and 9|row 3",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {8, 0}, {0, 1}},
     {{0.1}, {0.1}, {0.1}},
     "/mesh/curved_edges|0 and 8|row 2",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {0, 1}, {7, 0}},
     {{0.1}, {0.1}, {0.1}},
     "/mesh/curved_edges|rows 1 and 3",
     NULL},
    {2,
     3,
     3,
     {{0, 7}, {1, 7}, {1, 7}},
     {{0.1}, {0.1}, {0.2}},
     "/mesh/curved_edges|rows 2 and 3",
     NULL},
    {2, 3, 3, {{1, 0}, {0, 1}, {0, 7}}, {{0}, {0}, {0.1}}, "/mesh/curved_edges|rows 1 and 2", NULL},
    {2, 2, 2, {{0, 7}, {0, 1}}, {{0.1}, {0, INFINITY}}, "/mesh/edge_offsets|row 2", NULL},
    {2, 2, 2, {{0, 7}, {0, 1}}, {{0.1}, {0, 0, NAN}}, "/mesh/edge_offsets|row 2", NULL},
    {2, 1, 1, {{0, 7}}, {{0.9}}, NULL, "made straight: 2"},
    {2, 1, 1, {{0, 7}}, {{1e300}}, "1e+300 m|1e+15 m", NULL},
    {2, 1, 1, {{0, 1}}, {{0.9}}, NULL, "made straight: 2"},
  };
  static const double x[30] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1,
                               1, 0, 1, 0, 1, 1, 1, 1, 1, 3, 0, 0, 4, 0, 0};
  const hsize_t vertices[2] = {10, 3};
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_path_of_all("curved.h5", path));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    const hsize_t edges[2] = {(hsize_t)PetscMax(cases[i].nedge, 0), 2};
    const hsize_t offs[2] = {(hsize_t)PetscMax(cases[i].noff, 0), 3};

    if (!test_rank) {
      hid_t file, a;

      PetscCall(write_mesh("box:1,1,1:1", path));
      replace(path, "/mesh/x", 2, vertices, H5T_NATIVE_DOUBLE, x);
      replace(path, "/mesh/curved_edges", cases[i].nedge < 0 ? 0 : 2, edges, H5T_NATIVE_INT,
              cases[i].edge);
      replace(path, "/mesh/edge_offsets", cases[i].noff < 0 ? 0 : 2, offs, H5T_NATIVE_DOUBLE,
              cases[i].off);
      file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
      a = H5Aopen(file, "supple_mesh", H5P_DEFAULT);
      (void)H5Awrite(a, H5T_NATIVE_INT, &cases[i].layout);
      (void)H5Aclose(a);
      (void)H5Fclose(file);
    }
    PetscCall(refuse(path,
                     cases[i].note || strstr(cases[i].words, "1e+15 m") ? PETSC_ERR_USER_INPUT
                                                                        : PETSC_ERR_FILE_UNEXPECTED,
                     cases[i].words, cases[i].note));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A truncated file is refused: no read past its end, no partial mesh. */
static PetscErrorCode test_truncated(void)
{
  char path[512], cut[512], *bytes;
  size_t size;
  FILE *file;
  SbImport *im;

  PetscFunctionBeginUser;
  PetscCall(test_path("whole.h5", path));
  PetscCall(test_path("cut.h5", cut));
  PetscCall(write_mesh(DATA "two_cubes_41.msh", path));
  file = fopen(path, "rb");
  (void)fseek(file, 0, SEEK_END);
  size = (size_t)ftell(file);
  rewind(file);
  PetscCall(PetscMalloc1(size, &bytes));
  SB_CHECK(fread(bytes, 1, size, file) == size, "%zu bytes of %s", size, path);
  (void)fclose(file);
  for (size_t n = 0; n < size; n += size / 7) {
    file = fopen(cut, "wb");
    (void)fwrite(bytes, 1, n, file);
    (void)fclose(file);
    SB_CHECK_ERROR(test_read(cut, 0, &im), PETSC_ERR_FILE_UNEXPECTED,
                   n < 8 ? "HDF5|0 bytes" : "body 'b'|HDF5");
  }
  PetscCall(PetscFree(bytes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_foreign(void)
{
  const int three = 3;
  char path[512];
  SbImport *im;
  hid_t file, space, a;
  FILE *text;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(test_read("tests/data/none.h5", 0, &im), PETSC_ERR_FILE_OPEN,
                 "body 'b'|tests/data/none.h5");
  PetscCall(test_path("foreign.h5", path));
  file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  put_array(file, "/weather/rain", 2, one_by_four, H5T_NATIVE_INT, tet);
  (void)H5Fclose(file);
  SB_CHECK_ERROR(test_read(path, 0, &im), PETSC_ERR_FILE_UNEXPECTED,
                 "body 'b'|/mesh/x|/mesh/cells");
  file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  space = H5Screate(H5S_SCALAR);
  a = H5Acreate2(file, "supple_mesh", H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT);
  (void)H5Awrite(a, H5T_NATIVE_INT, &three);
  (void)H5Aclose(a);
  (void)H5Sclose(space);
  (void)H5Fclose(file);
  SB_CHECK_ERROR(test_read(path, 0, &im), PETSC_ERR_FILE_UNEXPECTED, "layout 3|layouts 1 and 2");
  PetscCall(test_path("none.xmf", path));
  text = fopen(path, "w");
  (void)fprintf(text, "<Xdmf/>\n");
  (void)fclose(text);
  SB_CHECK_ERROR(test_read(path, 0, &im), PETSC_ERR_FILE_UNEXPECTED, "body 'b'|line 1");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal gmsh[4], own[4], indexed[4];
  char path[512], index[512];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(SbOptionsRegister("body", "", PETSC_DECIDE, SbTetRows));
  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);

  /* the .h5 file and its .xmf give every rank the same sums as the .msh */
  PetscCall(test_path_of_all("cubes.h5", path));
  PetscCall(test_path_of_all("cubes.xmf", index));
  if (!test_rank)
    PetscCall(write_mesh(DATA "two_cubes_41.msh", path));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCall(fingerprint(DATA "two_cubes_41.msh", gmsh));
  PetscCall(fingerprint(path, own));
  PetscCall(fingerprint(index, indexed));
  SB_CHECK_NEAR(gmsh[2], 24, 0, "tets in the region");
  SB_CHECK_NEAR(gmsh[3], 4, 0, "facets in the wall");
  for (int k = 0; k < 4; k++) {
    SB_CHECK_NEAR(own[k], gmsh[k], 1e-12 * gmsh[k], "of the .h5");
    SB_CHECK_NEAR(indexed[k], gmsh[k], 1e-12 * gmsh[k], "of the .xmf");
  }
  PetscCall(test_output());
  PetscCall(test_discontinuous());
  PetscCall(test_cut());
  PetscCall(test_damage());
  PetscCall(test_curved_damage());
  PetscCall(test_truncated());
  PetscCall(test_foreign());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
