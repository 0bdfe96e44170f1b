// Parts of a mesh that touch but do not join: crossing diagonals, hanging nodes, doubled vertices.
// @ranks 1
#include "../../src/mesh/mesh_impl.h"
#include "mesh_test.h"
#include "../file.h"

#define BEGIN "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
#define SQUARE \
  "6\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 .5 .5 1\n6 .5 .5 -1\n$EndNodes\n$Elements\n4\n"
#define UPPER "1 4 2 1 1 1 2 3 5\n2 4 2 1 1 1 3 4 5\n"
#define END "$EndElements\n"

static const struct {
  const char *text;
  PetscInt n, ndoubled, npart; /* as SbTouching has them */
  const char *advice;
} cases[] = {
  /* two pyramids on one square, with the same diagonal and with the other one */
  {BEGIN SQUARE UPPER "3 4 2 1 1 1 2 3 6\n4 4 2 1 1 1 3 4 6\n" END, 0, 0, 0, NULL},
  {BEGIN SQUARE UPPER "3 4 2 1 1 1 2 4 6\n4 4 2 1 1 2 3 4 6\n" END, 4, 0, 2, "same triangles"},
  /* a tet beside three that have a vertex within its face */
  {BEGIN "6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 .3 .3 0\n5 0 0 1\n6 0 0 -1\n$EndNodes\n$Elements\n4\n"
         "1 4 2 1 1 1 2 3 5\n2 4 2 1 1 1 2 4 6\n3 4 2 1 1 2 3 4 6\n4 4 2 1 1 3 1 4 6\n" END,
   3, 0, 2, "same triangles"},
  /* two tets at one face, each with vertices of its own */
  {BEGIN "8\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 0\n6 1 0 0\n7 0 1 0\n8 0 0 -1\n$EndNodes\n"
         "$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 1 1 5 6 7 8\n" END,
   1, 1, 2, "repair"},
  /* a tet that is there twice, each with vertices of its own */
  {BEGIN
   "8\n1 0 0 1\n2 1 0 0\n3 0 1 0\n4 -1 -1 0\n5 0 0 1\n6 1 0 0\n7 0 1 0\n8 -1 -1 0\n$EndNodes\n"
   "$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 1 1 5 6 7 8\n" END,
   4, 0, 2, "counts twice"},
  /* a gap of a thousandth; faces that meet at an edge */
  {BEGIN "8\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -.001\n6 1 0 -.001\n7 0 1 -.001\n8 0 0 -1\n"
         "$EndNodes\n$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 1 1 5 6 7 8\n" END,
   0, 0, 0, NULL},
  {BEGIN "6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 -1 0\n6 0 0 -1\n$EndNodes\n"
         "$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 1 1 1 2 5 6\n" END,
   0, 0, 0, NULL},
};

int main(int argc, char **argv)
{
  char path[512], text[1024];
  FILE *file;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_open(".msh", path, &file));
  PetscCall(test_file_close(file));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    SbBody body = test_body("b", path);
    SbFaces faces;
    SbTouching t;
    SbImport im;

    PetscCall(test_file_put(path, cases[k].text));
    PetscCall(test_import(path, &im));
    PetscCall(SbImportCheck(&im, &faces));
    PetscCall(SbImportQuality(&im, &faces, &body));
    PetscCall(SbImportTouching(&im, &faces, &t));
    SB_CHECK(t.n == cases[k].n && t.ndoubled == cases[k].ndoubled && t.npart == cases[k].npart,
             "case %d: %d pairs, %d doubled, %d parts", (int)k, (int)t.n, (int)t.ndoubled,
             (int)t.npart);
    if (t.n) {
      SB_CHECK(PetscAbsReal(t.at[2]) < 1e-12 && t.number[0] != t.number[1], "case %d: at %g, %lld",
               (int)k, (double)t.at[2], (long long)t.number[0]);
      SbTouchingText(&t, path, sizeof(text), text);
      SB_CHECK(strstr(text, cases[k].advice), "case %d: '%s'", (int)k, text);
    }

    // only bodies that fall apart are refused, and only with unknowns at faces
    for (int e = 0; e < 3; e++) {
      const char *element = (const char *const[]){"p1", "cr", "dg"}[e];
      PetscErrorCode expected = PETSC_SUCCESS;
      SbCaughtError caught = {0, ""};

      if (e && t.npart > body.npart)
        expected = PETSC_ERR_USER_INPUT;
      (void)snprintf(body.element, sizeof(body.element), "%s", element);
      SB_CATCH(&caught, SbImportCheckTouching(&im, &faces, &body));
      SB_CHECK(caught.code == expected, "case %d, %s: error %d", (int)k, element, (int)caught.code);
      SB_CHECK(!expected || strstr(caught.text, "falls apart"), "case %d: '%s'", (int)k,
               caught.text);
    }
    PetscCall(SbFacesDestroy(&faces));
    PetscCall(SbImportDestroy(&im));
  }
  SB_TEST_END();
}
