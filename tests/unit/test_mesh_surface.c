// Bodies from closed surfaces: regions, cavities and groups of each file format; notes of repairs;
// errors name the triangle. @ranks 1 3
#include "../../src/surface/surface_impl.h"
#include "mesh_test.h"
#include "surface_files.h"

/*
  Writes a surface or a text to a file, and reads it on rank 0 as a measured body; with `words`
  reading must fail with this message. Returns whether there is a mesh, which SbImportDestroy()
  frees.
*/
static PetscErrorCode import(const char *extension, const TestSurface *s, const char *text,
                             const SbTetOptions *options, const char *words, TestMesh *m,
                             PetscBool *here)
{
  const PetscErrorCode code = text ? PETSC_ERR_FILE_UNEXPECTED : PETSC_ERR_USER_INPUT;
  char path[512];

  PetscFunctionBeginUser;
  memset(m, 0, sizeof(*m));
  PetscCall(test_file_write(extension, PETSC_FALSE, s, text, path));
  *here = (PetscBool)(!test_rank && !words);
  if (!test_rank) {
    SbBody body = test_body("b", path);

    if (options)
      body.tet = *options;
    else
      SbTetDefaults(&body.tet);
    if (words)
      SB_CHECK_ERROR(SbImportRead(&body, &m->im), code, words);
    else
      PetscCall(SbImportRead(&body, &m->im));
    if (words)
      PetscCall(SbImportDestroy(&m->im));
    else
      PetscCall(SbMeshFileMeasure(&m->im, &m->facts));
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refuse(const char *extension, const TestSurface *s, const char *text,
                             const SbTetOptions *options, const char *words)
{
  TestMesh m;
  PetscBool here;

  PetscFunctionBeginUser;
  PetscCall(import(extension, s, text, options, words, &m, &here));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume of the tets or number of triangles of a group; -1 if there is no such group. */
static PetscReal of_group(const SbImport *im, int dim, const char *name)
{
  PetscReal sum = -1;

  for (PetscInt g = 0; g < im->ngroup; g++) {
    if (im->group[g].dim != dim || strcmp(im->group[g].name, name))
      continue;
    sum = 0;
    for (PetscInt i = 0; i < im->item[dim].n; i++) {
      const PetscInt set = im->item[dim].tags[i];

      for (PetscInt k = im->tags_start[set]; k < im->tags_start[set + 1]; k++)
        if (im->tags_group[k] == g)
          sum += dim == 3 ? SbTetDeterminant(im->x, im->item[3].vert + 4 * i) / 6 : 1;
    }
  }
  return sum;
}

static PetscReal volume_of(const TestSurface *s)
{
  PetscReal sum = 0;

  for (PetscInt f = 0; f < s->ntri; f++) {
    const PetscReal *a = s->x[s->tri[f][0]];
    const PetscReal *b = s->x[s->tri[f][1]];
    const PetscReal *c = s->x[s->tri[f][2]];

    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

static void clear(TestSurface *s)
{
  test_surface_free(s);
  memset(s, 0, sizeof(*s));
}

static void cube_at(PetscReal at, PetscReal side, PetscBool inwards, TestSurface *s)
{
  const PetscReal lo[3] = {at, at, at};
  const PetscReal hi[3] = {at + side, at + side, at + side};

  test_surface_box(lo, hi, inwards, s);
}

/* ------------------------------------------------------------------ regions and groups */

/* Appends the triangles first..last-1 of a surface to an STL text as a solid. */
static void append_solid(const TestSurface *s, PetscInt first, PetscInt last, const char *name,
                         char **text)
{
  char *grown = (char *)realloc(*text, strlen(*text) + 400 * (size_t)(last - first) + 200);

  *text = grown;
  grown += strlen(grown);
  grown += sprintf(grown, "solid %s\n", name);
  for (PetscInt f = first; f < last; f++) {
    grown += sprintf(grown, "facet normal 0 0 0\nouter loop\n");
    for (int k = 0; k < 3; k++) {
      const PetscReal *x = s->x[s->tri[f][k]];

      grown += sprintf(grown, "vertex %.17g %.17g %.17g\n", x[0], x[1], x[2]);
    }
    grown += sprintf(grown, "endloop\nendfacet\n");
  }
  (void)sprintf(grown, "endsolid %s\n", name);
}

/* Sphere in a sphere: solids of an STL text name surfaces and regions; a region's volume is that
   between the surfaces. */
static PetscErrorCode check_nested(void)
{
  TestSurface s = {0};
  TestSurface outer;
  TestMesh m;
  PetscBool here;
  PetscInt n;
  char *text = (char *)calloc(1, 1);

  PetscFunctionBeginUser;
  memset(&outer, 0, sizeof(outer));
  test_surface_sphere(2, &s);
  test_surface_sphere(2, &outer);
  n = s.ntri;
  test_surface_shifted_copy(&s, 0.5, 0.1);
  append_solid(&s, 0, n, "skin of it", &text);
  append_solid(&s, n, 2 * n, "bone", &text);
  PetscCall(import(".stl", NULL, text, NULL, NULL, &m, &here));
  if (here) {
    const PetscReal all = volume_of(&outer);

    SB_CHECK_NEAR(m.facts.body.volume, all, 1e-12, "all");
    SB_CHECK_NEAR(of_group(&m.im, 3, "skin_of_it_region"), all * 7 / 8, 1e-12, "outer region");
    SB_CHECK_NEAR(of_group(&m.im, 3, "bone_region"), all / 8, 1e-12, "inner region");
    SB_CHECK_NEAR(of_group(&m.im, 3, "region_1") + of_group(&m.im, 3, "region_2"), all, 1e-12,
                  "regions");
    SB_CHECK(of_group(&m.im, 2, "skin_of_it") == (PetscReal)n &&
               of_group(&m.im, 2, "bone") == (PetscReal)n,
             "%g and %g triangles", of_group(&m.im, 2, "skin_of_it"), of_group(&m.im, 2, "bone"));
    SB_CHECK(m.facts.body.nfacet == n && m.facts.body.npart == 1, "%d facets, %d parts",
             (int)m.facts.body.nfacet, (int)m.facts.body.npart);
    PetscCall(SbImportDestroy(&m.im));
  }
  free(text);
  test_surface_free(&s);
  test_surface_free(&outer);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Box on a box, each with its own copy of the common face: two regions with an interface; groups of
   an OBJ. */
static PetscErrorCode check_wall(void)
{
  static const char text[] =
    "o low\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\ng low "
    "bottom\nf 4 3 2 1\n"
    "g low\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\no high\nv 0 0 3\nv 1 0 3\nv 1 1 "
    "3\nv 0 1 "
    "3\ng\n"
    "f 8 7 6 5\nf 9 10 11 12\nf 5 6 10 9\nf 6 7 11 10\nf 7 8 12 11\nf 8 5 9 12\n";
  SbTetOptions options;
  TestMesh m;
  PetscBool here;

  PetscFunctionBeginUser;
  SbTetDefaults(&options);
  options.surface = SB_TET_KEEP;
  PetscCall(import(".obj", NULL, text, &options, NULL, &m, &here));
  if (!here)
    PetscFunctionReturn(PETSC_SUCCESS);
  SB_CHECK_NEAR(of_group(&m.im, 3, "low_region"), 1, 1e-12, "low");
  SB_CHECK_NEAR(of_group(&m.im, 3, "high_region"), 2, 1e-12, "high");
  SB_CHECK(of_group(&m.im, 2, "bottom") == 2, "bottom: %g", of_group(&m.im, 2, "bottom"));
  SB_CHECK(of_group(&m.im, 2, "low") == 12 && of_group(&m.im, 2, "high") == 12, "sides: %g, %g",
           of_group(&m.im, 2, "low"), of_group(&m.im, 2, "high"));
  SB_CHECK(m.facts.body.nfacet == 20, "%d facets", (int)m.facts.body.nfacet);
  SB_CHECK(strstr(m.facts.body.note, "triangles back to back kept once as a wall: 2"), "'%s'",
           m.facts.body.note);
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Box with a cavity that contains a box; turned: all orientations inverted. */
static PetscErrorCode check_cavity(PetscBool turned)
{
  TestSurface s = {0};
  TestMesh m;
  PetscBool here;
  PetscInt keep;

  PetscFunctionBeginUser;
  cube_at(0, 3, turned, &s);
  cube_at(1, 1, (PetscBool)!turned, &s);
  cube_at(1.25, 0.5, turned, &s);
  keep = s.tri[2][0];
  s.tri[2][0] = s.tri[2][1];
  s.tri[2][1] = keep;
  PetscCall(import(".off", &s, NULL, NULL, NULL, &m, &here));
  if (here) {
    SB_CHECK_NEAR(m.facts.body.volume, 27 - 1 + 0.125, 1e-12, "with a cavity");
    SB_CHECK(m.facts.body.npart == 2, "%d parts", (int)m.facts.body.npart);
    SB_CHECK(
      strstr(m.facts.body.note, "triangles turned to the side of their neighbours: 1, cavities: 1"),
      "'%s'", m.facts.body.note);
    SB_CHECK(!strstr(m.facts.body.note, "inverted") == !turned, "'%s'", m.facts.body.note);
    PetscCall(SbImportDestroy(&m.im));
  }
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Box in a box, distinguished only by the region and hole points of TetGen's file; numbers from 0
   or 1. */
static PetscErrorCode check_smesh(PetscInt first, PetscBool hole)
{
  char text[4096] = "# nodes\n16 3 0 0\n";
  char *at = text + strlen(text);
  TestMesh m;
  PetscBool here;

  PetscFunctionBeginUser;
  for (int v = 0; v < 16; v++)
    at += sprintf(at, "%d %d %d %d\n", v + (int)first, v & 1 ? 3 - v / 8 : v / 8,
                  v & 2 ? 3 - v / 8 : v / 8, v & 4 ? 3 - v / 8 : v / 8);
  at += sprintf(at, "12 1 # facets\n");
  for (int f = 0; f < 12; f++) {
    at += sprintf(at, "4");
    for (int k = 0; k < 4; k++)
      at += sprintf(at, " %d", test_box_side[f % 6][k] + 8 * (f / 6) + (int)first);
    at += sprintf(at, " %d\n", f / 6 ? 7 : f == 4 ? 5 : 0);
  }
  at += sprintf(at, hole ? "1\n1 1.5 1.5 1.5\n1\n1 0.5 0.5 0.5 33 0.1\n"
                         : "0\n2\n1 0.5 0.5 0.5 33\n2 1.5 1.5 1.5 4\n");
  PetscCall(import(".smesh", NULL, text, NULL, NULL, &m, &here));
  if (!here)
    PetscFunctionReturn(PETSC_SUCCESS);
  SB_CHECK_NEAR(m.facts.body.volume, hole ? 26 : 27, 1e-12, "box");
  SB_CHECK_NEAR(of_group(&m.im, 3, "volume_33"), 26, 1e-12, "around");
  if (!hole)
    SB_CHECK_NEAR(of_group(&m.im, 3, "volume_4"), 1, 1e-12, "inner box");
  SB_CHECK(of_group(&m.im, 2, "surface_5") > 0 && of_group(&m.im, 2, "surface_7") > 0, "markers");
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Box with a square through hole: two facets have an inner polygon and a hole point; an L-shaped
   prism. */
static PetscErrorCode check_poly(void)
{
  static const char text[] =
    "16 3\n1 0 0 0\n2 3 0 0\n3 3 3 0\n4 0 3 0\n5 0 0 1\n6 3 0 1\n7 3 3 1\n8 0 3 1\n9 1 1 0\n10 2 1 "
    "0\n11 2 2 "
    "0\n"
    "12 1 2 0\n13 1 1 1\n14 2 1 1\n15 2 2 1\n16 1 2 1\n10 1\n2 1 3\n4 1 2 3 4\n4 9 10 11 12\n1 1.5 "
    "1.5 0\n"
    "2 1 4\n4 5 6 7 8\n4 13 16 15 14\n1 1.5 1.5 1\n1 0 1\n4 1 2 6 5\n1 0 1\n4 2 3 7 6\n1\n4 3 4 8 "
    "7\n1\n4 4 "
    "1 5 8\n"
    "1 0 2\n4 9 10 14 13\n1 0 2\n4 10 11 15 14\n1 0 2\n4 11 12 16 15\n1 0 2\n4 12 9 13 16\n0\n";
  static const char bent[] = /* L-shaped prism with two nonconvex facets */
    "12 3 0 0\n0 0 0 0\n1 2 0 0\n2 2 1 0\n3 1 1 0\n4 1 2 0\n5 0 2 0\n6 0 0 1\n7 2 0 1\n8 2 1 1\n9 "
    "1 1 1\n10 "
    "1 2 1\n11 0 2 1\n"
    "8 0\n1\n6 0 1 2 3 4 5\n1\n6 6 7 8 9\n10 11\n1\n4 0 1 7 6\n1\n4 1 2 8 7\n1\n4 2 3 9 8\n1\n4 3 "
    "4 10 "
    "9\n1\n4 4 5 11 10\n"
    "1\n4 5 0 6 11\n0\n0\n";
  TestMesh m;
  PetscBool here;

  PetscFunctionBeginUser;
  PetscCall(import(".poly", NULL, text, NULL, NULL, &m, &here));
  if (here) {
    SB_CHECK_NEAR(m.facts.body.volume, 8, 1e-12, "a box with a way through");
    SB_CHECK(of_group(&m.im, 2, "surface_2") > 0, "walls of the way");
    PetscCall(SbImportDestroy(&m.im));
  }
  PetscCall(import(".poly", NULL, bent, NULL, NULL, &m, &here));
  if (here) {
    SB_CHECK_NEAR(m.facts.body.volume, 3, 1e-12, "an L");
    PetscCall(SbImportDestroy(&m.im));
  }
  PetscCall(refuse(".poly", NULL, "4 3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n1 0\n1\n2 1 2\n", NULL,
                   "line 8|1|2 corners"));
  PetscCall(refuse(".smesh", NULL, "4 3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n1 0\n3 1 2 9\n", NULL,
                   "line 7|1|point 9"));
  PetscCall(refuse(".smesh", NULL, "2 3\n1 0 0 0\n1 1 0 0\n0\n", NULL, "point 1"));
  PetscCall(refuse(".smesh", NULL, "99999 3\n1 0 0 0\n", NULL, "99999"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ PLY */

static void put(char **at, const void *data, int size, PetscBool turned)
{
  for (int i = 0; i < size; i++)
    *(*at)++ = ((const char *)data)[turned ? size - 1 - i : i];
}

/* Cube of six squares with properties that the reader ignores. */
static size_t write_ply(int kind, char text[])
{
  static const char *const kinds[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  const uint16_t one = 1;
  const PetscBool turned = (PetscBool)((*(const char *)&one == 1) == (kind == 2));
  char *at = text;

  at += sprintf(
    at,
    "ply\nformat %s 1.0\ncomment by hand\nelement vertex 8\nproperty float x\nproperty double y\n"
    "property uchar red\nproperty short z\nelement face 6\nproperty list uchar int vertex_indices\n"
    "property float quality\nend_header\n",
    kinds[kind]);
  for (int v = 0; v < 8; v++) {
    const float x = (float)(v & 1);
    const float quality = 0;
    const double y = v >> 1 & 1;
    const unsigned char red = 200;
    const int16_t z = (int16_t)(v & 4 ? -1 : -2);

    (void)quality;
    if (!kind) {
      at += sprintf(at, "%g %g 200 %d\n", x, y, z);
      continue;
    }
    put(&at, &x, 4, turned);
    put(&at, &y, 8, turned);
    put(&at, &red, 1, turned);
    put(&at, &z, 2, turned);
  }
  for (int f = 0; f < 6; f++) {
    const unsigned char n = 4;
    const float quality = 0.5;

    if (!kind) {
      at += sprintf(at, "4 %d %d %d %d 0.5\n", test_box_side[f][0], test_box_side[f][1],
                    test_box_side[f][2], test_box_side[f][3]);
      continue;
    }
    put(&at, &n, 1, turned);
    for (int k = 0; k < 4; k++)
      put(&at, &test_box_side[f][k], 4, turned);
    put(&at, &quality, 4, turned);
  }
  return (size_t)(at - text);
}

static PetscErrorCode check_ply(void)
{
  char text[4096];

  PetscFunctionBeginUser;
  for (int kind = 0; kind < 3; kind++) {
    const size_t n = write_ply(kind, text);
    SbTriangles t;
    char path[512];
    FILE *f;

    PetscCall(test_file_write(".ply", PETSC_FALSE, NULL, "", path));
    f = test_rank ? NULL : fopen(path, "wb");
    if (f)
      (void)fwrite(text, 1, n, f);
    if (f)
      (void)fclose(f);
    PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 1, (PetscReal[3]){0, 0, 0}, &t));
    SB_CHECK(t.ntri == 12 && t.nvert == 8, "kind %d: %d triangles", kind, (int)t.ntri);
    SB_CHECK_NEAR(t.volume, 1, 1e-14, "cube");
    SB_CHECK(t.x[2] == -2, "z = %g", t.x[2]);
    PetscCall(SbTrianglesDestroy(&t));
  }
  (void)write_ply(0, text);
  PetscCall(refuse(".ply", NULL, "stl\n", NULL, "line 1|'ply'|'stl'"));
  PetscCall(refuse(".ply", NULL, "ply\nformat text 1.0\n", NULL, "line 2|'text'"));
  PetscCall(
    refuse(".ply", NULL, "ply\nelement vertex 3\nproperty word x\n", NULL, "line 3|'word'"));
  PetscCall(refuse(".ply", NULL,
                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n", NULL,
                   "body 'b'|line 5"));
  PetscCall(refuse(".ply", NULL,
                   "ply\nformat binary_little_endian 1.0\nelement vertex 999999\nproperty float "
                   "x\nproperty float y\n"
                   "property float z\nend_header\n",
                   NULL, "999999 vertex"));
  *strstr(text, "4 4 5 7 6") = '2';
  PetscCall(refuse(".ply", NULL, text, NULL, "face 6|2 corners"));
  *strstr(text, "2 4 5 7 6") = '4';
  *strstr(text, "7 6 0.5") = '8';
  PetscCall(refuse(".ply", NULL, text, NULL, "face 6|8|0"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ repaired surfaces */

/* A cube with repairable defects has this volume and this note. */
static PetscErrorCode mend(TestSurface *s, const SbTetOptions *options, PetscReal volume,
                           const char *words)
{
  TestMesh m;
  PetscBool here;

  PetscFunctionBeginUser;
  PetscCall(import(".off", s, NULL, options, NULL, &m, &here));
  if (here) {
    SB_CHECK_NEAR(m.facts.body.volume, volume, 1e-5, words);
    SB_CHECK(strstr(m.facts.body.note, words), "'%s' instead of '%s'", m.facts.body.note, words);
    PetscCall(SbImportDestroy(&m.im));
  }
  clear(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_mended(void)
{
  SbTetOptions options;
  TestSurface s = {0};

  PetscFunctionBeginUser;
  SbTetDefaults(&options);
  cube_at(0, 1, PETSC_FALSE, &s); /* a duplicate corner, displaced by 1e-6 */
  test_surface_grow(&s, 1, 0);
  for (int k = 0; k < 3; k++)
    s.x[8][k] = s.x[7][k] + 1e-6;
  s.nvert = 9;
  s.tri[3][1] = s.tri[3][1] == 7 ? 8 : s.tri[3][1];
  s.tri[2][2] = s.tri[2][2] == 7 ? 8 : s.tri[2][2];
  PetscCall(refuse(".off", &s, NULL, NULL, "triangle 3|-body_b_merge_tolerance 1.9e-06"));
  options.merge_tolerance = 1e-5;
  PetscCall(mend(&s, &options, 1, "vertices joined within 1e-05 m: 1 (by up to 1.7e-06 m)"));
  cube_at(0, 1, PETSC_FALSE, &s); /* a merge tolerance close to the edge length */
  options.merge_tolerance = 0.9;
  PetscCall(refuse(".off", &s, NULL, &options, "-body_b_merge_tolerance 0.9 m"));
  test_surface_grow(&s, 1, 2); /* a duplicate triangle, and one with a repeated corner */
  for (int k = 0; k < 3; k++) {
    s.tri[12][k] = s.tri[3][(k + 1) % 3];
    s.tri[13][k] = k / 2;
  }
  s.ntri = 14;
  PetscCall(
    mend(&s, NULL, 1,
         "triangles with two corners at one place left out: 1, triangles given twice left out: 1"));
  cube_at(0, 1, PETSC_FALSE, &s); /* a face split at an edge, with a triangle of zero area */
  test_surface_grow(&s, 1, 2);
  for (int k = 0; k < 3; k++)
    s.x[8][k] = 0.5 * (s.x[s.tri[0][0]][k] + s.x[s.tri[0][1]][k]);
  s.nvert = 9;
  for (int k = 0; k < 3; k++)
    s.tri[12][k] = s.tri[13][k] = s.tri[0][k];
  s.tri[12][1] = 8;
  s.tri[13][0] = 8;
  s.tri[0][2] = 8; /* its corners are collinear */
  s.ntri = 14;
  PetscCall(mend(&s, NULL, 1, "triangles without area taken into their neighbours: 1"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ refused surfaces */

/* Klein bottle of n x m squares: a closed surface with one side. */
static void one_sided(TestSurface *s)
{
  const PetscInt n = 24, m = 12; /* squares along the circle, around the tube */

  test_surface_grow(s, n * m, 2 * n * m);
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < m; j++) {
      const PetscReal a = 2 * PETSC_PI * (PetscReal)i / (PetscReal)n;
      const PetscReal b = 2 * PETSC_PI * (PetscReal)j / (PetscReal)m;
      const PetscReal r =
        3 + PetscCosReal(a / 2) * PetscSinReal(b) - PetscSinReal(a / 2) * PetscSinReal(2 * b);
      const PetscInt j1 = (j + 1) % m;
      const PetscInt i1 = (i + 1) % n;
      const PetscInt k = i1 ? j : (m - j) % m,
                     k1 =
                       i1 ? j1 : (m - j1) % m; /* the seam reverses the direction around the tube */
      PetscInt *t = s->tri[s->ntri++];
      PetscInt *u = s->tri[s->ntri++];
      PetscReal *x = s->x[s->nvert++];

      x[0] = r * PetscCosReal(a);
      x[1] = r * PetscSinReal(a);
      x[2] = PetscSinReal(a / 2) * PetscSinReal(b) + PetscCosReal(a / 2) * PetscSinReal(2 * b);
      t[0] = i * m + j;
      t[1] = i1 * m + k;
      t[2] = i1 * m + k1;
      u[0] = i * m + j;
      u[1] = i1 * m + k1;
      u[2] = i * m + j1;
    }
  }
}

static PetscErrorCode check_refused(void)
{
  SbTetOptions options;
  TestSurface s = {0};
  SbTriangles t = {0};
  int64_t number[1000];
  PetscInt tags[1000] = {0};
  SbImport im = {.where = "test"};
  SbTriangleFile file = {.im = &im, .where = im.where, .t = &t, .number = number, .tags = tags};
  SbSurfaceRepairs mended = {0};
  SbSurface body_surface = {0};

  PetscFunctionBeginUser;
  cube_at(0, 1, PETSC_FALSE, &s);
  s.ntri = 11;
  PetscCall(refuse(".off", &s, NULL, NULL, "body 'b'|3 edges"));
  clear(&s);
  cube_at(0, 1, PETSC_FALSE, &s); /* two intersecting boxes */
  cube_at(0.5, 1, PETSC_FALSE, &s);
  PetscCall(refuse(".off", &s, NULL, NULL, "body 'b'|18 pairs|12 of 24"));
  clear(&s);
  cube_at(0, 1, PETSC_FALSE, &s); /* adjacent boxes with a common plane but no common corner */
  test_surface_box((PetscReal[3]){1, 0.25, 0.25}, (PetscReal[3]){2, 0.75, 0.75}, PETSC_FALSE, &s);
  PetscCall(refuse(".off", &s, NULL, NULL, "body 'b'|18 pairs|3 and 13"));
  clear(&s);
  cube_at(0, 1, PETSC_FALSE, &s); /* two nearly coincident sheets */
  for (int v = 0; v < 8; v++)
    s.x[v][2] *= 1.5e-10;
  SbTetDefaults(&options);
  options.merge_tolerance = 0;
  PetscCall(refuse(".off", &s, NULL, &options, "body 'b'"));
  clear(&s);
  for (int i = 0; i < 1001; i++)
    cube_at(2 * i, 1, PETSC_FALSE, &s); /* separate parts */
  PetscCall(refuse(".off", &s, NULL, NULL, "1001 parts|1000"));
  clear(&s);
  PetscCall(refuse(".obj", NULL, "v 0 0 0\nv 1 0 0\n", NULL, "body 'b'"));

  /* one side only: the surface also intersects itself, so only the search for regions is called */
  one_sided(&s);
  t.nvert = s.nvert;
  t.ntri = s.ntri;
  t.x = &s.x[0][0];
  t.tri = &s.tri[0][0];
  for (int i = 0; i < 1000; i++)
    number[i] = i + 1;
  SB_CHECK_ERROR(SbSurfaceFindRegions(&file, &mended, &body_surface), PETSC_ERR_USER_INPUT, "test");
  clear(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A small fold of a fine sphere is smoothed; if the untangling distance is zero or too small, the
   surface is refused. */
static PetscErrorCode check_fold(void)
{
  SbTetOptions options;
  TestSurface s = {0};
  TestMesh m;
  PetscReal volume;
  PetscBool here;
  PetscInt v;

  PetscFunctionBeginUser;
  SbTetDefaults(&options);
  test_surface_sphere(4, &s);
  volume = volume_of(&s);
  v = s.tri[777][0];
  for (int k = 0; k < 3; k++)
    s.x[v][k] = 2.2 * s.x[s.tri[777][1]][k] - 1.2 * s.x[s.tri[777][0]][k];
  options.untangle = 0;
  PetscCall(refuse(".off", &s, NULL, &options, "-body_b_untangle 0"));
  options.untangle = 0.01;
  PetscCall(refuse(".off", &s, NULL, &options, "0.01 m"));
  options.untangle = 0.3;
  options.size = 0.4;
  PetscCall(import(".off", &s, NULL, &options, NULL, &m, &here));
  if (here) {
    SB_CHECK(strstr(m.facts.body.note, "pairs of triangles that cut each other smoothed apart: "),
             "'%s'", m.facts.body.note);
    SB_CHECK_NEAR(m.facts.body.volume, volume, 0.1 * volume, "sphere");
    PetscCall(SbImportDestroy(&m.im));
  }
  clear(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_nested());
  PetscCall(check_wall());
  PetscCall(check_cavity(PETSC_FALSE));
  PetscCall(check_cavity(PETSC_TRUE));
  PetscCall(check_smesh(0, PETSC_FALSE));
  PetscCall(check_smesh(1, PETSC_TRUE));
  PetscCall(check_poly());
  PetscCall(check_ply());
  PetscCall(check_mended());
  PetscCall(check_refused());
  PetscCall(check_fold());
  SB_TEST_END();
}
