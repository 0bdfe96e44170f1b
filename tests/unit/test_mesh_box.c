// Box generator: counts, volumes, conformity, sides, quality, errors.
// @ranks 1
#include "mesh_test.h"

typedef struct {
  SbImport im;
  SbFaces faces;
  SbBody body;
} Box;

static PetscErrorCode make_box(const char *text, Box *box)
{
  SbMeshStatistics facts;

  PetscFunctionBeginUser;
  memset(box, 0, sizeof(*box));
  box->body = test_body("b", text);
  PetscCall(SbImportRead(&box->body, &box->im));
  PetscCall(SbMeshFileMeasure(&box->im, &facts));
  box->body = facts.body;
  PetscCall(SbFacesCreate(box->im.nvert, box->im.item[3].n, box->im.item[3].vert, &box->faces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode free_box(Box *box)
{
  PetscFunctionBeginUser;
  PetscCall(SbImportDestroy(&box->im));
  PetscCall(SbFacesDestroy(&box->faces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A conforming box has two boundary facets per cell side on its six sides, and no others. */
static PetscErrorCode test_box(const char *text, PetscInt nx, PetscInt ny, PetscInt nz,
                               PetscReal volume)
{
  Box box;
  const PetscInt nfacet = 4 * (nx * ny + ny * nz + nz * nx);

  PetscFunctionBeginUser;
  PetscCall(make_box(text, &box));
  SB_CHECK(box.body.nvert == (nx + 1) * (ny + 1) * (nz + 1), "%s: %d vertices", text,
           (int)box.body.nvert);
  SB_CHECK(box.body.ncell == 6 * nx * ny * nz, "%s: %d cells", text, (int)box.body.ncell);
  SB_CHECK(box.body.nfacet == nfacet, "%s: %d boundary facets instead of %d", text,
           (int)box.body.nfacet, (int)nfacet);
  SB_CHECK(box.body.npart == 1, "%s: %d parts", text, (int)box.body.npart);
  SB_CHECK(!box.body.note[0], "%s: '%s'", text,
           box.body.note); /* no tet reoriented, removed or pinched */
  SB_CHECK(box.im.item[2].n == nfacet, "%s: %d triangles in the sides", text,
           (int)box.im.item[2].n);
  SB_CHECK_NEAR(box.body.volume, volume, 1e-13 * volume, text); /* rounding of some hundred sums */
  PetscCall(free_box(&box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every triangle of a side is in the plane of the side and on the boundary. */
static PetscErrorCode test_sides(void)
{
  Box box;
  const char *text = "box:3,2,1:3,2,1";
  const PetscReal l[3] = {3, 2, 1};
  PetscInt found[6] = {0};

  PetscFunctionBeginUser;
  PetscCall(make_box(text, &box));
  for (PetscInt t = 0; t < box.im.item[2].n; t++) {
    const PetscInt group = box.im.tags_group[box.im.tags_start[box.im.item[2].tags[t]]];
    PetscInt slots[2];

    SB_CHECK(SbFacesFind(&box.faces, box.im.item[2].vert + 3 * t, slots) == 1,
             "triangle %d is no boundary facet", (int)t);
    found[group]++;
    for (int k = 0; k < 3; k++) {
      const PetscReal x = box.im.x[3 * box.im.item[2].vert[3 * t + k] + group / 2];

      SB_CHECK(x == (group % 2 ? l[group / 2] : 0), "triangle %d of %s lies at %g", (int)t,
               box.im.group[group].name, x);
    }
  }
  SB_CHECK(found[0] == 4 && found[1] == 4 && found[2] == 6 && found[3] == 6 && found[4] == 12 &&
             found[5] == 12,
           "sides of %d %d %d facets", (int)found[0], (int)found[2], (int)found[4]);
  SB_CHECK(!strcmp(box.im.group[0].name, "xmin") && !strcmp(box.im.group[5].name, "zmax"),
           "names of the sides");
  PetscCall(free_box(&box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tets of a cube: dihedral angles 45, 60, 90 degrees; edges 1, sqrt 2, sqrt 3: R = sqrt 3 / 2,
   r = 1 / (2 + 2 sqrt 2). */
static PetscErrorCode test_quality(void)
{
  Box box;

  PetscFunctionBeginUser;
  PetscCall(make_box("box:1,1,1:2", &box));
  SB_CHECK_NEAR(box.body.min_dihedral, 45, 1e-10, "smallest dihedral angle");
  SB_CHECK_NEAR(box.body.max_radius_ratio, PetscSqrtReal(3.) / 2 * (2 + 2 * PetscSqrtReal(2.)) / 3,
                1e-12, "radius ratio");
  PetscCall(free_box(&box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mirrored neighbours: with even numbers of cells the edges are symmetric about the centre of the
   box. */
static PetscErrorCode test_symmetry(void)
{
  Box box;
  const PetscInt n = 4;
  PetscInt *valence;
  PetscInt v = 0;

  PetscFunctionBeginUser;
  PetscCall(make_box("box:1,1,1:4", &box));
  PetscCall(PetscCalloc1(box.im.nvert, &valence));
  for (PetscInt i = 0; i < 4 * box.im.item[3].n; i++)
    valence[box.im.item[3].vert[i]]++;
  for (PetscInt k = 0; k <= n; k++) {
    for (PetscInt j = 0; j <= n; j++) {
      for (PetscInt i = 0; i <= n; i++, v++) {
        const PetscInt mirror = (k * (n + 1) + j) * (n + 1) + n - i;

        SB_CHECK(valence[v] == valence[mirror], "vertex %d has %d cells, its mirror image %d",
                 (int)v, (int)valence[v], (int)valence[mirror]);
      }
    }
  }
  PetscCall(PetscFree(valence));
  PetscCall(free_box(&box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refusals(void)
{
  static const char *const bad[] = {"box:",          "box:1,1:2",       "box:1,1,1",
                                    "box:1,1,1:",    "box:1,1,1:2,2",   "box:1,1,1:2,2,2,2",
                                    "box:1,0,1:2",   "box:1,1,-1:2",    "box:1,1,1:0",
                                    "box:1,1,1:1.5", "box:1,1,1:2,0,2", "box:1,1,nan:2",
                                    "box:1,1,1:2x",  "box:a,1,1:2",     "box:1,1,1:-2",
                                    "box:inf,1,1:2"};
  Box box;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(bad); i++) {
    SB_CHECK_ERROR(make_box(bad[i], &box), PETSC_ERR_USER_INPUT, "box:lx,ly,lz");
    PetscCall(free_box(&box));
  }
  SB_CHECK_ERROR(make_box("box:1,1,1:100000", &box), PETSC_ERR_USER_INPUT,
                 "body 'b'|box:1,1,1|100000");
  PetscCall(free_box(&box));
  SB_CHECK_ERROR(make_box("bax.step", &box), PETSC_ERR_USER_INPUT, "body 'b'|'bax.step'");
  PetscCall(free_box(&box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_box("box:1,1,1:1", 1, 1, 1, 1));
  PetscCall(test_box("box:0.4,0.1,0.1:2", 8, 2, 2, 0.004));
  PetscCall(test_box("box:0.1,0.36,0.2:3", 3, 11, 6, 0.0072)); /* 10.8 cells become 11 */
  PetscCall(test_box("box:2,3,4:3,2,5", 3, 2, 5, 24));
  PetscCall(test_box("box:1e-6,1e-6,1e-3:1", 1, 1, 1000, 1e-15));
  PetscCall(test_sides());
  PetscCall(test_quality());
  PetscCall(test_symmetry());
  PetscCall(test_refusals());
  SB_TEST_END();
}
