// Named sets: parsing, members, messages of empty sets.
// @ranks 1
#include "../../src/mesh/mesh_impl.h"
#include "mesh_test.h"

#define DATA "tests/data/"

static PetscErrorCode parse(const char *text)
{
  SbSet set;

  PetscFunctionBeginUser;
  PetscCall(test_set("s", text, &set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_parse(void)
{
  SbSet set;

  PetscFunctionBeginUser;
  PetscCall(test_set("s", "plane:0,0,2,0.4", &set));
  SB_CHECK(set.shape == SB_SET_PLANE && set.p[2] == 1 && set.p[3] == 0.2 && set.p[4] == 0,
           "plane %g %g %g", set.p[2], set.p[3], set.p[4]);
  PetscCall(test_set("s", "plane:3,0,4,5,0.1", &set));
  SB_CHECK_NEAR(set.p[0], 0.6, 1e-15, "norm");
  SB_CHECK_NEAR(set.p[3], 1, 1e-15, "distance");
  SB_CHECK(set.p[4] == 0.1, "tolerance %g", set.p[4]);
  PetscCall(test_set("s", "box:-1,-2,-3,1,2,3", &set));
  SB_CHECK(set.shape == SB_SET_BOX && set.p[0] == -1 && set.p[5] == 3, "box");
  PetscCall(test_set("s", "sphere:1,2,3,0.5", &set));
  SB_CHECK(set.shape == SB_SET_SPHERE && set.p[3] == 0.5, "sphere");
  PetscCall(test_set("s", "halfspace:0,-1,0,1", &set));
  SB_CHECK(set.shape == SB_SET_HALFSPACE && set.p[1] == -1, "halfspace");
  PetscCall(test_set("s", "group:liver.both ends", &set));
  SB_CHECK(set.shape == SB_SET_GROUP && !strcmp(set.group, "liver.both ends"), "group '%s'",
           set.group);
  PetscCall(test_set("s", "body:liver", &set));
  SB_CHECK(set.shape == SB_SET_BODY && !strcmp(set.group, "liver"), "body '%s'", set.group);
  PetscCall(test_set("s", "boundary", &set));
  SB_CHECK(set.shape == SB_SET_BOUNDARY, "boundary");
  SB_CHECK_ERROR(parse("plan:0,0,1,0"), PETSC_ERR_USER_INPUT, "plane");
  SB_CHECK_ERROR(parse(""), PETSC_ERR_USER_INPUT, "-set ''");
  SB_CHECK_ERROR(parse("plane:0,0,1"), PETSC_ERR_USER_INPUT, "-set 'plane:0,0,1'|plane:nx,ny,nz,d");
  SB_CHECK_ERROR(parse("plane:0,0,1,0,0,0"), PETSC_ERR_USER_INPUT, "plane:nx,ny,nz,d,tolerance");
  SB_CHECK_ERROR(parse("plane:0,0,1,0,-1"), PETSC_ERR_USER_INPUT, "-set 'plane:0,0,1,0,-1'");
  SB_CHECK_ERROR(parse("plane:0,0,0,1"), PETSC_ERR_USER_INPUT, "-set 'plane:0,0,0,1'");
  SB_CHECK_ERROR(parse("plane:0,0,1,x"), PETSC_ERR_USER_INPUT, "plane:nx,ny,nz,d,tolerance");
  SB_CHECK_ERROR(parse("plane:0,0,1,nan"), PETSC_ERR_USER_INPUT, "plane:nx,ny,nz,d,tolerance");
  SB_CHECK_ERROR(parse("box:0,0,0,1,-1,1"), PETSC_ERR_USER_INPUT, "-set 'box:0,0,0,1,-1,1'");
  SB_CHECK_ERROR(parse("sphere:0,0,0,0"), PETSC_ERR_USER_INPUT, "-set 'sphere:0,0,0,0'");
  SB_CHECK_ERROR(parse("sphere"), PETSC_ERR_USER_INPUT, "-set 'sphere'|sphere:cx,cy,cz,radius");
  SB_CHECK_ERROR(parse("group:"), PETSC_ERR_USER_INPUT, "group:NAME");
  SB_CHECK_ERROR(parse("boundary:x"), PETSC_ERR_USER_INPUT, "-set 'boundary:x'");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One set on two bodies: "a" the two cubes (x from 0 to 2), "b" a unit box of 2 x 2 x 2 cells at x
   = 5. */
static PetscErrorCode build(const char *text, SbSet *set, SbMergedMesh *whole)
{
  SbBody body[2] = {test_body("a", DATA "two_cubes_41.msh"), test_body("b", "box:1,1,1:2")};

  PetscFunctionBeginUser;
  body[1].translate[0] = 5;
  PetscCall(test_set("clamp", text, set));
  PetscCall(SbMergedMeshCreate(PETSC_COMM_SELF, SB_READING_AUTO, 2, body, 1, set, whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the neighbour is in the same body and has this cell as a neighbour. */
static PetscBool sees_back(const SbMergedMesh *whole, PetscInt c, PetscInt neighbour)
{
  const PetscInt *n = whole->neighbour + 4 * neighbour;

  if (neighbour < 0)
    return PETSC_TRUE;
  return (PetscBool)(whole->data[neighbour].body == whole->data[c].body &&
                     (n[0] == c || n[1] == c || n[2] == c || n[3] == c));
}

static PetscErrorCode test_counts(const char *text, PetscInt nvert, PetscInt nfacet, PetscInt ncell)
{
  SbMergedMesh whole;
  SbSet set;
  PetscInt n[3] = {0, 0, 0};

  PetscFunctionBeginUser;
  PetscCall(build(text, &set, &whole));
  SB_CHECK(set.nvert == nvert && set.nfacet == nfacet && set.ncell == ncell,
           "%s: %d vertices, %d facets, %d cells", text, (int)set.nvert, (int)set.nfacet,
           (int)set.ncell);

  /* The masks agree. */
  for (PetscInt v = 0; v < whole.nvert; v++)
    n[0] += !!(whole.vertex[v].set & SB_SET_BIT(0));
  for (PetscInt c = 0; c < whole.ncell; c++) {
    n[2] += !!(whole.data[c].set & SB_SET_BIT(0));
    for (int f = 0; f < 4; f++) {
      const uint64_t mask = whole.data[c].face[f];

      n[1] += (mask & SB_SET_BIT(0)) && (mask & SB_ON_BOUNDARY);
      SB_CHECK(sees_back(&whole, c, whole.neighbour[4 * c + f]), "cell %d and its neighbour %d",
               (int)c, (int)whole.neighbour[4 * c + f]);
      SB_CHECK(!(mask & SB_ON_BOUNDARY) == (whole.neighbour[4 * c + f] >= 0),
               "bit of the boundary on cell %d", (int)c);
    }
  }
  SB_CHECK(n[0] == nvert && n[1] == nfacet && n[2] == ncell,
           "%s: masks of %d vertices, %d facets, %d cells", text, (int)n[0], (int)n[1], (int)n[2]);
  PetscCall(SbMergedMeshDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An interior surface is marked in the cells on both sides. */
static PetscErrorCode test_inner(void)
{
  SbMergedMesh whole;
  SbSet set;
  PetscInt nface = 0;
  PetscInt alone = 0;

  PetscFunctionBeginUser;
  PetscCall(build("group:inner", &set, &whole));
  for (PetscInt s = 0; s < 4 * whole.ncell; s++) {
    const PetscInt other = whole.neighbour[s];
    PetscBool theirs = PETSC_FALSE;

    if (!(whole.data[s / 4].face[s % 4] & SB_SET_BIT(0)))
      continue;
    nface++;
    for (int f = 0; other >= 0 && f < 4; f++)
      theirs = (PetscBool)(theirs || (whole.neighbour[4 * other + f] == s / 4 &&
                                      whole.data[other].face[f] & SB_SET_BIT(0)));
    alone += !theirs;
  }
  SB_CHECK(nface == 8 && !alone, "%d sides of inner facets, %d without the other side", (int)nface,
           (int)alone);
  PetscCall(SbMergedMeshDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fail(const char *text)
{
  SbMergedMesh whole;
  SbSet set;

  PetscFunctionBeginUser;
  PetscCall(build(text, &set, &whole));
  PetscCall(SbMergedMeshDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_parse());

  /* sides of the gmsh cubes: 5 vertices and 4 triangles each; of the box: 9 vertices and 8
     triangles */
  PetscCall(test_counts("group:wall", 5, 4, 0));
  PetscCall(test_counts("group:a.both ends", 10, 8, 0));
  PetscCall(test_counts("group:both_ends", 10, 8, 0));
  PetscCall(test_counts("group:surface_77", 5, 4, 0));
  PetscCall(test_counts("group:inner", 5, 0, 0));
  PetscCall(test_counts("group:edge", 2, 0, 0));
  PetscCall(test_counts("group:corner", 1, 0, 0));
  PetscCall(test_counts("group:left", 14, 20, 24));
  PetscCall(test_counts("group:all", 23, 40, 48));
  PetscCall(test_counts("group:b.xmax", 9, 8, 0));
  PetscCall(test_counts("group:zmin", 9, 8, 0));
  PetscCall(test_counts("body:b", 27, 48, 48));
  PetscCall(test_counts("boundary", 23 - 1 + 26, 88,
                        0)); /* all but the centres of the interior square and of the box */
  PetscCall(test_counts("plane:1,0,0,0", 5, 4, 0));
  PetscCall(test_counts("plane:-2,0,0,-12", 9, 8, 0));
  PetscCall(test_counts("plane:1,0,0,4.9,0.11", 9, 8, 0));
  PetscCall(test_counts("plane:1,0,0,1", 5, 0,
                        0)); /* the interior square: shapes contain boundary facets only */
  PetscCall(test_counts("box:5,0,0,5.5,1,1", 18, 8 + 4 * 4, 24));
  PetscCall(test_counts("box:5.0000001,0.1,0.1,5.9999999,1,1", 2 * 2 * 3, 12,
                        12)); /* within the tolerance of 1e-6 */
  PetscCall(
    test_counts("sphere:5,0,0,0.71", 7, 6, 0)); /* all corners of the cell but the far one */
  PetscCall(test_counts("halfspace:-1,0,0,-5.5", 18, 8 + 4 * 4, 24));
  PetscCall(test_inner());

  /* empty sets */
  SB_CHECK_ERROR(fail("group:wal"), PETSC_ERR_USER_INPUT, "set 'clamp'|group 'wal'|wall");
  SB_CHECK_ERROR(fail("group:xmid"), PETSC_ERR_USER_INPUT, "set 'clamp'|group 'xmid'|xmin");
  SB_CHECK_ERROR(fail("group:b.wall"), PETSC_ERR_USER_INPUT, "group 'b.wall'");
  SB_CHECK_ERROR(fail("body:c"), PETSC_ERR_USER_INPUT, "set 'clamp'|body 'c'");
  SB_CHECK_ERROR(fail("plane:0,0,1,7"), PETSC_ERR_USER_INPUT, "set 'clamp'|0|6|1");
  SB_TEST_END();
}
