// Surfaces from files: each format gives the same cube on every rank; errors of surfaces without
// volume name the triangle. @ranks 1 3
#include "mesh_test.h"
#include "sbsurface.h"
#include "surface_files.h"

static const PetscReal zero[3] = {0, 0, 0}, unit[3] = {1, 1, 1};

static void cube(PetscBool inwards, TestSurface *s)
{
  memset(s, 0, sizeof(*s));
  test_surface_box(zero, unit, inwards, s);
}

/* Adjacent triangles refer to each other and have their common edge in opposite directions. */
static void check_across(const SbTriangles *t)
{
  PetscInt bad = 0;

  for (PetscInt i = 0; i < 3 * t->ntri; i++) {
    const PetscInt a = t->tri[i];
    const PetscInt b = t->tri[i % 3 == 2 ? i - 2 : i + 1];
    const PetscInt g = t->across[i];
    PetscBool found = PETSC_FALSE;

    for (int k = 0; k < 3; k++)
      if (t->tri[3 * g + k] == b && t->tri[3 * g + (k + 1) % 3] == a)
        found = (PetscBool)(t->across[3 * g + k] == i / 3);
    bad += !found;
  }
  SB_CHECK(!bad, "%d edges without their neighbour", (int)bad);
}

static PetscErrorCode check_cube(const char *extension, PetscBool binary, PetscBool inwards)
{
  const PetscReal at[3] = {5, 6, 7};
  TestSurface s;
  SbTriangles t;
  char path[512];

  PetscFunctionBeginUser;
  cube(inwards, &s);
  PetscCall(test_file_write(extension, binary, &s, NULL, path));
  PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 2, at, &t));
  SB_CHECK(t.nvert == 8 && t.ntri == 12, "%s: %d vertices, %d triangles", extension, (int)t.nvert,
           (int)t.ntri);
  SB_CHECK_NEAR(t.volume, 8, 1e-14, extension);
  SB_CHECK(t.turned == inwards, "%s: turned %d", extension, (int)t.turned);
  for (PetscInt i = 0; i < 3 * t.nvert; i++)
    SB_CHECK(t.x[i] == at[i % 3] || t.x[i] == at[i % 3] + 2, "%s: coordinate %g", extension,
             t.x[i]);
  check_across(&t);
  PetscCall(SbTrianglesDestroy(&t));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quadrilateral faces; a cavity; two separate parts. */
static PetscErrorCode check_more(void)
{
  const PetscReal lo[3] = {0.25, 0.25, 0.25};
  const PetscReal hi[3] = {0.75, 0.75, 0.75};
  const PetscReal far[3] = {3, 3, 3};
  const PetscReal out[3] = {4, 4, 4};
  TestSurface s;
  SbTriangles t;
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_file_write(".off", PETSC_FALSE, NULL,
                            "OFF 8 6 12\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n"
                            "4 0 4 6 2\n4 1 3 7 5\n4 0 1 5 4\n4 2 6 7 3\n4 0 2 3 1\n4 4 5 7 6\n",
                            path));
  PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 1, zero, &t));
  SB_CHECK(t.ntri == 12, "%d triangles of six squares", (int)t.ntri);
  SB_CHECK_NEAR(t.volume, 1, 1e-14, "squares");
  PetscCall(SbTrianglesDestroy(&t));
  cube(PETSC_FALSE, &s);
  test_surface_box(lo, hi, PETSC_TRUE, &s);
  test_surface_box(far, out, PETSC_FALSE, &s);
  PetscCall(test_file_write(".obj", PETSC_FALSE, &s, NULL, path));
  PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 1, zero, &t));
  SB_CHECK_NEAR(t.volume, 2 - 0.125, 1e-14, "a hollow cube and another one");
  SB_CHECK(!t.turned, "nothing to turn");
  PetscCall(SbTrianglesDestroy(&t));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A tetrahedron of 1/6 m^3 as an STL text: its first and last line, the case of its keywords and
   its line ends. */
static PetscErrorCode check_stl(const char *first, const char *last, PetscBool capitals,
                                const char *line_end)
{
  static const char *const corner[4][3] = {{"0 0 0", "0 1 0", "1 0 0"},
                                           {"0 0 0", "1 0 0", "0 0 1"},
                                           {"0 0 0", "0 0 1", "0 1 0"},
                                           {"1 0 0", "0 1 0", "0 0 1"}};
  char text[4096], path[512];
  size_t n;
  SbTriangles t;

  PetscFunctionBeginUser;
  n = (size_t)snprintf(text, sizeof(text), "%s%s", first, line_end);
  for (int f = 0; f < 4; f++) {
    n += (size_t)snprintf(text + n, sizeof(text) - n, "\tfacet normal 0 0 1%souter loop%s",
                          line_end, line_end);
    for (int k = 0; k < 3; k++)
      n += (size_t)snprintf(text + n, sizeof(text) - n, "vertex   %s%s", corner[f][k], line_end);
    n +=
      (size_t)snprintf(text + n, sizeof(text) - n,
                       f % 2 ? "endloop%sendfacet%s" : "end loop%send facet%s", line_end, line_end);
  }
  (void)snprintf(text + n, sizeof(text) - n, "%s", last);
  for (char *c = text; *c && capitals; c++)
    if (*c >= 'a' && *c <= 'z')
      *c = (char)(*c - 'a' + 'A');
  PetscCall(test_file_write(".stl", PETSC_FALSE, NULL, text, path));
  PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 1, zero, &t));
  SB_CHECK(t.ntri == 4 && t.nvert == 4, "'%s' ... '%s': %d triangles, %d vertices", first, last,
           (int)t.ntri, (int)t.nvert);
  SB_CHECK_NEAR(t.volume, 1. / 6, 1e-14, last);
  PetscCall(SbTrianglesDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Deviations from the STL format that exporters write. */
static PetscErrorCode check_stl_variants(void)
{
  TestSurface s;
  SbTriangles t;
  char path[512];
  FILE *file;

  PetscFunctionBeginUser;
  PetscCall(check_stl("solid name", "endsolid name\n", PETSC_FALSE, "\n"));
  PetscCall(check_stl("solid name", "end solid\n", PETSC_FALSE, "\n"));
  PetscCall(check_stl("solid name", "end solid name", PETSC_FALSE, "\n"));
  PetscCall(check_stl("solid", "endsolid", PETSC_FALSE, "\n"));
  PetscCall(check_stl("solid name", "EndSolid other name\r\n\r\n\x1a", PETSC_FALSE, "\r\n"));
  PetscCall(check_stl("solid name", "endsolid name\n", PETSC_TRUE, "\n\n \n"));
  PetscCall(check_stl("\xef\xbb\xbfsolid name", "end solid\n\n", PETSC_FALSE, "\n"));

  /* several solids; the last one is empty */
  PetscCall(check_stl("solid none\nend solid\nsolid name",
                      "endsolid name\nsolid more\nend solid more\n", PETSC_FALSE, "\n"));

  /* a binary file with data after its triangles; its header begins with `solid` */
  cube(PETSC_FALSE, &s);
  PetscCall(test_file_open(".stl", path, &file));
  if (file) {
    write_stl_binary(file, &s);
    fprintf(file, "written by somebody");
  }
  PetscCall(test_file_close(file));
  PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 1, zero, &t));
  SB_CHECK(t.ntri == 12, "%d triangles", (int)t.ntri);
  SB_CHECK_NEAR(t.volume, 1, 1e-14, "bytes behind the triangles");
  PetscCall(SbTrianglesDestroy(&t));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ errors */

static PetscErrorCode refuse_file(const char *path, PetscErrorCode code, const char *words)
{
  SbTriangles t;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(SbTrianglesRead(PETSC_COMM_WORLD, "-effect_tool_obstacle", path, 1, zero, &t),
                 code, words);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refuse_text(const char *extension, const char *text, const char *words)
{
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_file_write(extension, PETSC_FALSE, NULL, text, path));
  PetscCall(refuse_file(path, PETSC_ERR_FILE_UNEXPECTED, words));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refuse(TestSurface *s, const char *words)
{
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_file_write(".off", PETSC_FALSE, s, NULL, path));
  PetscCall(refuse_file(path, PETSC_ERR_USER_INPUT, words));
  test_surface_free(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A repairable surface is accepted, with this number of triangles and this volume. */
static PetscErrorCode accept(TestSurface *s, PetscInt ntri, PetscReal volume, const char *what)
{
  SbTriangles t;
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_file_write(".off", PETSC_FALSE, s, NULL, path));
  PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-o", path, 1, zero, &t));
  SB_CHECK(t.ntri == ntri, "%s: %d triangles", what, (int)t.ntri);
  SB_CHECK_NEAR(t.volume, volume, 1e-14, what);
  check_across(&t);
  PetscCall(SbTrianglesDestroy(&t));
  test_surface_free(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_surfaces(void)
{
  const PetscReal lo[3] = {0.25, 0.25, 0.25};
  const PetscReal hi[3] = {0.75, 0.75, 0.75};
  const PetscReal beside[3] = {1, 0, 0};
  const PetscReal end[3] = {2, 2, 1};
  TestSurface s;

  PetscFunctionBeginUser;
  cube(PETSC_FALSE, &s); /* a hole */
  s.ntri = 11;
  PetscCall(refuse(&s, "3 edges"));
  cube(PETSC_FALSE, &s); /* one inverted triangle */
  s.tri[4][0] = s.tri[4][1];
  s.tri[4][1] = 0;
  PetscCall(accept(&s, 12, 1, "one triangle turned"));
  cube(PETSC_FALSE, &s); /* a duplicate triangle */
  test_surface_grow(&s, 0, 1);
  for (int k = 0; k < 3; k++)
    s.tri[12][k] = s.tri[3][k];
  s.ntri = 13;
  PetscCall(accept(&s, 12, 1, "one triangle twice"));
  cube(PETSC_FALSE, &s); /* a repeated corner, and therefore a hole */
  s.tri[6][1] = s.tri[6][0];
  PetscCall(refuse(&s, "3 edges"));
  cube(PETSC_FALSE, &s); /* two cubes with a common edge */
  test_surface_box((PetscReal[3]){1, 1, 0}, end, PETSC_FALSE, &s);
  PetscCall(refuse(&s, "4 triangles|1"));
  cube(PETSC_FALSE, &s); /* two cubes, each with its own face at the interface */
  test_surface_box(beside, (PetscReal[3]){2, 1, 1}, PETSC_FALSE, &s);
  PetscCall(accept(&s, 20, 2, "two cubes side by side"));
  cube(PETSC_FALSE, &s); /* a solid within a solid */
  test_surface_box(lo, hi, PETSC_FALSE, &s);
  PetscCall(accept(&s, 12, 1, "a solid within a solid"));
  cube(PETSC_FALSE, &s); /* an inverted part */
  test_surface_box((PetscReal[3]){3, 3, 3}, (PetscReal[3]){3.5, 3.5, 3.5}, PETSC_TRUE, &s);
  PetscCall(accept(&s, 24, 1.125, "a part inverted"));
  cube(PETSC_FALSE, &s); /* flat: the side faces collapse, top and bottom coincide */
  for (int v = 0; v < 8; v++)
    s.x[v][2] = 0;
  PetscCall(refuse(&s, "4 edges"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_files(void)
{
  TestSurface s;
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(refuse_file("no/such/file.stl", PETSC_ERR_FILE_OPEN, "no/such/file.stl"));
  PetscCall(refuse_file("Makefile", PETSC_ERR_USER_INPUT, "-effect_tool_obstacle"));
  PetscCall(refuse_text(".stl", "hello\n", "line 1|'solid'"));
  PetscCall(refuse_text(".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2\nvertex",
                        "line 5|'vertex'"));
  PetscCall(
    refuse_text(".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\n", "'vertex'"));
  PetscCall(refuse_text(".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 1,5 2,5 3,5\n",
                        "line 4|1,5"));
  PetscCall(refuse_text(".stl", "solid a\nend facet\n", "'facet'|'endsolid'|'endfacet'"));
  PetscCall(refuse_text(".stl", "solid a\n", "'endsolid'"));
  PetscCall(refuse_text(".stl", "solid a\nendsolid a\n", "-effect_tool_obstacle"));
  PetscCall(
    refuse_text(".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2 inf\n", "line 4"));
  PetscCall(refuse_text(".obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n", "line 3|face 1|2"));
  PetscCall(refuse_text(".obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "line 3|face 1|2 corners"));
  PetscCall(refuse_text(".obj", "v 0 0 0\nf 1 x 2\n", "line 2"));
  PetscCall(refuse_text(".obj", "v 0 0\nf 1 2 3\n", "line 2|'f'"));
  PetscCall(refuse_text(".off", "4OFF\n1 1 1\n", "line 1|'OFF'|'4OFF'"));
  PetscCall(refuse_text(".off", "OFF\n9999999 3 0\n", "9999999 vertices"));
  PetscCall(refuse_text(".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n",
                        "-effect_tool_obstacle|line 7"));
  PetscCall(
    refuse_text(".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "line 6|face 1|2 corners"));
  PetscCall(refuse_text(".msh",
                        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n",
                        "-effect_tool_obstacle"));

  /* a truncated binary file is read as text, and is invalid */
  cube(PETSC_FALSE, &s);
  s.ntri = 11;
  PetscCall(test_file_write(".stl", PETSC_TRUE, &s, "lost", path));
  PetscCall(refuse_file(path, PETSC_ERR_FILE_UNEXPECTED, "'solid'"));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const kinds[] = {".stl", ".obj", ".off", ".msh"};
  SbTriangles t;

  SB_TEST_BEGIN(argc, argv);
  for (int k = 0; k < 4; k++) {
    PetscCall(check_cube(kinds[k], PETSC_FALSE, PETSC_FALSE));
    PetscCall(check_cube(kinds[k], PETSC_FALSE, PETSC_TRUE));
  }
  PetscCall(check_cube(".stl", PETSC_TRUE, PETSC_FALSE));

  /* surface of a mesh of tets: two unit cubes side by side, without the triangles between them */
  PetscCall(
    SbTrianglesRead(PETSC_COMM_WORLD, "-o", "tests/data/two_cubes_41_bin.msh", 1, zero, &t));
  SB_CHECK(t.ntri == 40, "%d triangles", (int)t.ntri);
  SB_CHECK_NEAR(t.volume, 2, 1e-14, "two cubes");
  check_across(&t);
  PetscCall(SbTrianglesDestroy(&t));
  PetscCall(check_more());
  PetscCall(check_stl_variants());
  PetscCall(check_surfaces());
  PetscCall(check_files());
  SB_TEST_END();
}
