// Checks, repairs and quality of the mesh of one body.
// @ranks 1
#include "mesh_test.h"

#define DATA "tests/data/"

/* Repaired defects, and defects that are only counted. */
static PetscErrorCode test_repairs(void)
{
  TestMesh m;

  PetscFunctionBeginUser;
  PetscCall(test_mesh_read(test_body("b", DATA "odd.msh"), &m));
  SB_CHECK(m.im.nunused == 2 && m.im.nvert == 8, "%d unused vertices, %d left", (int)m.im.nunused,
           (int)m.im.nvert);
  SB_CHECK(m.im.vert_number[0] == 1 && m.im.vert_number[4] == 60,
           "numbers of the vertices that stay");
  SB_CHECK(m.im.x[3 * 4] == 5 && m.im.x[3 * 7 + 2] == 1, "places of the vertices that stay");
  SB_CHECK(m.im.nreoriented == 1, "%d tets turned", (int)m.im.nreoriented);
  SB_CHECK(m.im.nlost == 2, "%d triangles beside the tets", (int)m.im.nlost);
  SB_CHECK(m.im.item[0].n == 0 && m.im.item[2].n == 2, "%d points and %d triangles left",
           (int)m.im.item[0].n, (int)m.im.item[2].n);
  SB_CHECK_NEAR(m.facts.body.volume, 2. / 6, 1e-15, "volume of two tets, one of which was turned");
  SB_CHECK(m.facts.body.npart == 2, "%d parts", (int)m.facts.body.npart);
  SB_CHECK(!strcmp(m.facts.body.note,
                   "unused vertices left out: 2, inverted tets turned: 1, parts that "
                   "share no vertex: 2, triangles of groups that are no face of a tet: 2"),
           "'%s'", m.facts.body.note);
  PetscCall(SbImportDestroy(&m.im));
  PetscCall(test_mesh_read(test_body("b", DATA "odd_edge.msh"), &m));
  SB_CHECK(m.im.npinched == 1 && m.facts.body.npart == 1,
           "%d edges with more than two facets, %d parts", (int)m.im.npinched,
           (int)m.facts.body.npart);
  SB_CHECK(m.facts.body.nfacet == 8, "%d facets", (int)m.facts.body.nfacet);
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refusals(void)
{
  static const struct {
    const char *file, *words;
  } bad[] = {
    {"bad_flat.msh", "body 'b'|tests/data/bad_flat.msh|tetrahedron 1|1.67e-15 m|1.41 m"},
    {"bad_vertex_twice.msh", "tetrahedron 1|node 3"},
    {"bad_twice.msh", "1|3"},
    {"bad_twins.msh", "1|2"},
    {"bad_three.msh", "1|2|3"},
  };
  TestMesh m;
  SbBody body;
  char path[256];

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(bad); i++) {
    (void)snprintf(path, sizeof(path), DATA "%s", bad[i].file);
    SB_CHECK_ERROR(test_mesh_read(test_body("b", path), &m), PETSC_ERR_USER_INPUT, bad[i].words);
    PetscCall(SbImportDestroy(&m.im));
  }

  /* Moved so far away that a tet is below the rounding of its coordinates. */
  body = test_body("b", "box:1e-6,1e-6,1e-6:1");
  body.translate[0] = 1e9;
  SB_CHECK_ERROR(test_mesh_read(body, &m), PETSC_ERR_USER_INPUT,
                 "body 'b'|box:1e-6,1e-6,1e-6|tetrahedron 1");
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sizes from a nanometre to a thousand kilometres and a mirrored body are valid; shape measures are
   independent of size. */
static PetscErrorCode test_scales(void)
{
  TestMesh m;
  SbBody body = test_body("b", "box:1,1,1:2");

  PetscFunctionBeginUser;
  for (int e = -9; e <= 6; e += 3) {
    body.scale = PetscPowRealInt(10, e);
    PetscCall(test_mesh_read(body, &m));
    SB_CHECK_NEAR(m.facts.body.volume / PetscPowRealInt(10, 3 * e), 1, 1e-13,
                  "volume of the scaled cube");
    SB_CHECK_NEAR(m.facts.body.min_dihedral, 45, 1e-10, "smallest dihedral angle");
    PetscCall(SbImportDestroy(&m.im));
  }
  body.scale = -1;
  PetscCall(test_mesh_read(body, &m));
  SB_CHECK(m.im.nreoriented == 48, "%d tets turned in a mirrored cube", (int)m.im.nreoriented);
  SB_CHECK_NEAR(m.facts.body.volume, 1, 1e-14, "volume of the mirrored cube");
  SB_CHECK(m.facts.body.bbox[0] == -1 && m.facts.body.bbox[3] == 0, "extent from %g to %g",
           m.facts.body.bbox[0], m.facts.body.bbox[3]);
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Known shapes: the regular tet (70.53 degrees, ratio 1), the corner of a cube, a sliver of height
   h over a square. */
static PetscErrorCode test_shape(const PetscReal x[12], PetscReal dihedral, PetscReal ratio)
{
  TestMesh m;
  const SbBody *body = &m.facts.body;
  PetscReal worst = 0;

  PetscFunctionBeginUser;
  memset(&m, 0, sizeof(m));
  PetscCall(SbImportSetVertices(&m.im, 4));
  PetscCall(PetscArraycpy(m.im.x, x, 12));
  PetscCall(SbImportAddItem(&m.im, 3, (PetscInt[]){0, 1, 2, 3}, 0, 1));
  PetscCall(SbMeshFileMeasure(&m.im, &m.facts));
  SB_CHECK_NEAR(body->min_dihedral, dihedral, 1e-9 * dihedral,
                "smallest dihedral angle"); /* acos near 1 loses digits */
  SB_CHECK_NEAR(body->max_radius_ratio, ratio, 1e-9 * ratio, "radius ratio");
  for (int i = 0; i < 3; i++)
    worst = PetscMax(worst, PetscAbsReal(body->bbox[i] - PetscMin(PetscMin(x[i], x[3 + i]),
                                                                  PetscMin(x[6 + i], x[9 + i]))));
  SB_CHECK(worst == 0, "extent wrong by %g", worst);
  PetscCall(SbImportDestroy(&m.im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscReal h = 0.01;
  const PetscReal degree = PETSC_PI / 180;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_repairs());
  PetscCall(test_refusals());
  PetscCall(test_scales());
  PetscCall(
    test_shape((PetscReal[]){1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1}, acos(1. / 3) / degree, 1));

  /* edges 1, 1, 1, sqrt 2 three times: R = sqrt 3 / 2, r = 1 / (3 + sqrt 3) */
  PetscCall(test_shape((PetscReal[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1},
                       acos(1 / PetscSqrtReal(3.)) / degree,
                       PetscSqrtReal(3.) / 2 * (3 + PetscSqrtReal(3.)) / 3));

  /* diagonals of a unit square, one lifted by h; four equal faces of area sqrt(1 + 2 h^2) / 2 */
  PetscCall(test_shape((PetscReal[]){0, 0, 0, 1, 1, 0, 1, 0, h, 0, 1, h},
                       acos(1 / (1 + 2 * h * h)) / degree,
                       PetscSqrtReal((2 + h * h) * (1 + 2 * h * h)) / (3 * h)));
  SB_TEST_END();
}
