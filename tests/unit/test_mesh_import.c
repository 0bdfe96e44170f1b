// Groups and tag sets of an import, placement of a body.
// @ranks 1
#include "mesh_test.h"

static PetscErrorCode test_groups(void)
{
  SbImport im = {0};
  PetscInt a, b, c, tags[5];

  PetscFunctionBeginUser;
  PetscCall(SbImportGroup(&im, 2, 12, NULL, &a));
  PetscCall(SbImportGroup(&im, 3, 12, "flesh", &b));
  PetscCall(SbImportGroup(&im, 2, 12, NULL, &c));
  SB_CHECK(a == c && a != b, "groups %d %d %d", (int)a, (int)b, (int)c);
  SB_CHECK(!strcmp(im.group[a].name, "surface_12"), "'%s'", im.group[a].name);
  PetscCall(SbImportGroup(&im, 2, 12, "skin", &c));
  SB_CHECK(a == c && !strcmp(im.group[a].name, "skin"), "'%s'", im.group[a].name);
  PetscCall(SbImportTagSet(&im, 0, NULL, &tags[0]));
  PetscCall(SbImportTagSet(&im, 1, (PetscInt[]){a}, &tags[1]));
  PetscCall(SbImportTagSet(&im, 2, (PetscInt[]){b, a}, &tags[2]));
  PetscCall(SbImportTagSet(&im, 3, (PetscInt[]){a, b, a}, &tags[3]));
  PetscCall(SbImportTagSet(&im, 1, (PetscInt[]){b}, &tags[4]));
  SB_CHECK(tags[0] == 0, "the empty set is %d", (int)tags[0]);
  SB_CHECK(tags[2] == tags[3], "order and repeats make a difference");
  SB_CHECK(tags[1] != tags[2] && tags[1] != tags[4] && tags[2] != tags[4] && tags[4],
           "different sets are one");
  SB_CHECK(im.ntags == 4, "%d tag sets", (int)im.ntags);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Many items of every dimension are preserved when the arrays grow. */
static PetscErrorCode test_growth(void)
{
  SbImport im = {0};
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 1000; i++)
    for (int d = 0; d < 4; d++)
      PetscCall(SbImportAddItem(&im, d, (PetscInt[]){i, i + 1, i + 2, i + 3}, i % 7, i + d));
  for (int d = 0; d < 4; d++) {
    for (PetscInt i = 0; i < im.item[d].n; i++) {
      for (int k = 0; k <= d; k++)
        wrong += im.item[d].vert[(d + 1) * i + k] != i + k;
      wrong += im.item[d].tags[i] != i % 7;
      wrong += im.item[d].number[i] != i + d;
    }
    SB_CHECK(im.item[d].n == 1000, "%d items of dimension %d", (int)im.item[d].n, d);
  }
  SB_CHECK(!wrong, "%d wrong entries", (int)wrong);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertex (1, 1, 1) of a unit box, scaled, then rotated, then translated. */
static PetscErrorCode test_place(PetscReal scale, const PetscReal rotate[4],
                                 const PetscReal translate[3], const PetscReal expected[3],
                                 PetscReal tolerance)
{
  SbImport im = {0};
  SbBody body = test_body("b", "box:1,1,1:1");

  PetscFunctionBeginUser;
  body.scale = scale;
  PetscCall(PetscArraycpy(body.rotate, rotate, 4));
  PetscCall(PetscArraycpy(body.translate, translate, 3));
  PetscCall(SbImportRead(&body, &im));
  for (int i = 0; i < 3; i++)
    SB_CHECK_NEAR(im.x[3 * 7 + i], expected[i], tolerance, "placed coordinate");
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_bad_place(SbBody body)
{
  SbImport im = {0};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = SbImportRead(&body, &im);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(ierr);
}

int main(int argc, char **argv)
{
  const PetscReal none[4] = {0, 0, 0, 0};
  const PetscReal zero[3] = {0, 0, 0};
  const PetscReal c = PetscCosReal(0.5);
  const PetscReal s = PetscSinReal(0.5);
  SbBody body = test_body("b", "box:1,1,1:1");

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_groups());
  PetscCall(test_growth());
  PetscCall(test_place(1, none, zero, (PetscReal[]){1, 1, 1}, 0));
  PetscCall(test_place(0.01, none, (PetscReal[]){1, 2, 3}, (PetscReal[]){1.01, 2.01, 3.01}, 0));

  /* quarter rotations are exact; counter-clockwise as seen from the tip of the axis, whatever its
     length */
  PetscCall(test_place(1, (PetscReal[]){0, 0, 5, 90}, zero, (PetscReal[]){-1, 1, 1}, 0));
  PetscCall(test_place(2, (PetscReal[]){0.1, 0, 0, 90}, (PetscReal[]){0, 0, 1},
                       (PetscReal[]){2, -2, 3}, 0));
  PetscCall(test_place(1, (PetscReal[]){0, 1, 0, -90}, zero, (PetscReal[]){-1, 1, 1}, 0));
  PetscCall(test_place(1, (PetscReal[]){1, 1, 1, 120}, zero, (PetscReal[]){1, 1, 1}, 1e-15));
  PetscCall(test_place(1, (PetscReal[]){0, 0, 1, 90 / PETSC_PI}, zero,
                       (PetscReal[]){c - s, s + c, 1}, 1e-15));
  body.rotate[3] = 30;
  SB_CHECK_ERROR(test_bad_place(body), PETSC_ERR_USER_INPUT, "body 'b'");
  body.rotate[3] = 0;
  body.scale = 1e308;
  PetscCall(PetscStrncpy(body.mesh, "box:9,9,9:1", sizeof(body.mesh)));
  SB_CHECK_ERROR(test_bad_place(body), PETSC_ERR_USER_INPUT, "1e+308");
  SB_TEST_END();
}
