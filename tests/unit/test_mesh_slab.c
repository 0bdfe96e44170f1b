// A mesh read in slabs by all ranks equals the one read by rank 0 exactly: vertices, tets, curved
// edges, sets, parts, notes, errors. @ranks 1 2 3 4
#include "../../src/meshio/meshio_impl.h"
#include "../../src/mesh/mesh_impl.h"
#include "mesh_same.h"
#include <sbsurface.h>

enum {
  NSET = 8
};

/* Shuffles the tets. */
static PetscErrorCode shuffle(SbImport *im)
{
  PetscRandom r;
  PetscReal value;

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &r));
  PetscCall(PetscRandomSetSeed(r, 7));
  PetscCall(PetscRandomSeed(r));
  for (PetscInt c = im->item[3].n - 1; c > 0; c--) {
    PetscInt k;

    PetscCall(PetscRandomGetValueReal(r, &value));
    k = PetscMin(c, (PetscInt)(value * (PetscReal)(c + 1)));
    for (int a = 0; a < 4; a++) {
      const PetscInt keep = im->item[3].vert[4 * c + a];

      im->item[3].vert[4 * c + a] = im->item[3].vert[4 * k + a];
      im->item[3].vert[4 * k + a] = keep;
    }
    value = im->item[3].tags[c];
    im->item[3].tags[c] = im->item[3].tags[k];
    im->item[3].tags[k] = (PetscInt)value;
  }
  PetscCall(PetscRandomDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_group(SbImport *im, int dim, const char *name, PetscInt n,
                                const PetscInt vert[])
{
  PetscInt tags;

  PetscFunctionBeginUser;
  PetscCall(SbImportTagsAlone(im, dim, 77 + dim, name, &tags));
  PetscCall(SbImportAddItem(im, dim, vert, tags, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Two separate boxes with some curved edges, the second one with its first tets inverted; unused
  vertices between them; an interior triangle and one that is no face; a line, a point; lines and
  triangles at unused vertices.
*/
static PetscErrorCode make_mesh(const char *path, PetscBool random)
{
  SbImport *im, *other;
  PetscInt nvert, v[4], none;

  PetscFunctionBeginUser;
  PetscCall(test_read("box:2,1,1:2", 0, &im));
  PetscCall(test_read("box:1,1,1:3", 0, &other));
  nvert = im->nvert;
  PetscCall(PetscRealloc(3 * (size_t)(nvert + 3 + other->nvert) * sizeof(PetscReal), &im->x));
  PetscCall(PetscRealloc((size_t)(nvert + 3 + other->nvert) * sizeof(int64_t), &im->vert_number));
  for (PetscInt i = 0; i < 9; i++)
    im->x[3 * nvert + i] = 40.;
  for (PetscInt i = 0; i < 3 * other->nvert; i++)
    im->x[3 * (nvert + 3) + i] = other->x[i] + (i % 3 ? 0. : 5.);
  im->nvert += 3 + other->nvert;
  for (PetscInt i = nvert; i < im->nvert; i++)
    im->vert_number[i] = i + 1;
  PetscCall(SbImportTagSet(im, 0, NULL, &none));
  for (PetscInt c = 0; c < other->item[3].n; c++) {
    for (int a = 0; a < 4; a++)
      v[a] = other->item[3].vert[4 * c + (c < 5 && a > 1 ? 5 - a : a)] + nvert + 3;
    PetscCall(SbImportAddItem(im, 3, v, none, im->item[3].n + 1));
  }
  PetscCall(SbImportTagsAlone(im, 3, 12, "core", &none));
  for (PetscInt c = 7; c < im->item[3].n; c += 5)
    im->item[3].tags[c] = none;
  if (random)
    PetscCall(shuffle(im));
  for (PetscInt c = 3; c < im->item[3].n; c += 11)
    PetscCall(add_group(im, 2, "inner", c, im->item[3].vert + 4 * c));
  PetscCall(add_group(im, 2, "inner", 1, (const PetscInt[]){0, 1, nvert + 5}));
  PetscCall(add_group(im, 2, "inner", 1, (const PetscInt[]){0, 1, nvert + 1}));
  PetscCall(add_group(im, 1, "edge", 1, (const PetscInt[]){2, nvert + 4}));
  PetscCall(add_group(im, 1, "edge", 1, (const PetscInt[]){3, nvert + 2}));
  PetscCall(add_group(im, 0, "corner", 1, (const PetscInt[]){nvert + 6}));
  PetscCall(add_group(im, 0, "corner", 1, (const PetscInt[]){nvert}));
  PetscCall(test_curve(im));
  PetscCall(SbMeshFileWrite(im, path, SB_MESH_H5));
  PetscCall(test_free(&im));
  PetscCall(test_free(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode make_scene(const char *path, SbBody body[3], SbSet set[NSET])
{
  static const char *const text[NSET] = {"group:inner", "group:edge",    "group:corner",
                                         "group:core",  "plane:1,0,0,0", "sphere:6,0,0,0.7",
                                         "boundary",    "group:a.xmax"};

  PetscFunctionBeginUser;
  body[0] = test_body("first", "box:1,1,1:1");
  body[1] = test_body("a", path);
  body[2] = test_body("b", path);
  body[2].edge_nodes = PETSC_TRUE;
  body[2].translate[1] = 3.;
  body[2].rotate[0] = 1.;
  body[2].rotate[3] = 30.;
  for (int k = 0; k < NSET; k++)
    PetscCall(test_set("s", text[k], &set[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create(const char *path, const char *reading, SbBody body[3], SbSet set[NSET],
                             SbMesh *mesh)
{
  PetscFunctionBeginUser;
  PetscCall(make_scene(path, body, set));
  PetscCall(PetscOptionsSetValue(NULL, "-mesh_reading", reading));
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 3, body, NSET, set, mesh));
  PetscCall(SbMeshValidate(*mesh));
  PetscCall(PetscOptionsClearValue(NULL, "-mesh_reading"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SAME(array, n) \
  SB_CHECK(!memcmp(a->array, b->array, (size_t)(n) * sizeof(*a->array)), "%s: other " #array, what)

static PetscErrorCode test_same_mesh(PetscBool random, const char *partitioner)
{
  const char *what = random ? "in random order" : "in order";
  SbBody body[2][3];
  SbSet set[2][NSET];
  SbMesh a, b;
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_path_of_all("slab.h5", path));
  if (!test_rank)
    PetscCall(make_mesh(path, random));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", partitioner));
  PetscCall(create(path, "rank0", body[0], set[0], &a));
  PetscCall(create(path, "slabs", body[1], set[1], &b));
  SB_CHECK(a->Nvert == b->Nvert && a->Ncell == b->Ncell && a->nvert == b->nvert &&
             a->ncell == b->ncell && a->ncell_owned == b->ncell_owned &&
             a->nvert_owned == b->nvert_owned,
           "%s: %d, %d vertices, %d, %d cells and %d, %d, %d, %d", what, (int)a->nvert_owned,
           (int)a->nvert, (int)a->ncell_owned, (int)a->ncell, (int)b->nvert_owned, (int)b->nvert,
           (int)b->ncell_owned, (int)b->ncell);
  if (a->nvert == b->nvert && a->ncell == b->ncell) {
    SAME(vert_orig, a->nvert);
    SAME(gvert, a->nvert);
    SAME(vert_body, a->nvert);
    SAME(vert_set, a->nvert);
    SAME(x, 3 * a->nvert);
    SAME(cell, 4 * a->ncell);
    SAME(cell_orig, a->ncell);
    SAME(cell_set, a->ncell);
    SAME(face_set, 4 * a->ncell);
    SAME(edge_off, 18 * a->ncell);
  }
  for (int k = 0; k < NSET; k++)
    SB_CHECK(set[0][k].nvert == set[1][k].nvert && set[0][k].nfacet == set[1][k].nfacet &&
               set[0][k].ncell == set[1][k].ncell,
             "%s: set %d holds %d, %d, %d and %d, %d, %d", what, k, (int)set[0][k].nvert,
             (int)set[0][k].nfacet, (int)set[0][k].ncell, (int)set[1][k].nvert,
             (int)set[1][k].nfacet, (int)set[1][k].ncell);
  for (int k = 0; k < 3; k++) {
    const SbBody *p = &body[0][k];
    const SbBody *q = &body[1][k];

    SB_CHECK(p->nvert == q->nvert && p->ncell == q->ncell && p->nfacet == q->nfacet &&
               p->npart == q->npart && p->nsliver == q->nsliver &&
               p->min_dihedral == q->min_dihedral && p->max_radius_ratio == q->max_radius_ratio &&
               !memcmp(p->bbox, q->bbox, sizeof(p->bbox)),
             "%s: other findings of body %d", what, k);
    SB_CHECK(!strcmp(p->note, q->note), "%s: '%s' and '%s'", what, p->note, q->note);
    SB_CHECK_NEAR(q->volume, p->volume, 1e-14 * p->volume, "volume");
  }
  SB_CHECK(strstr(body[1][1].note, "taken as straight: ") &&
             strstr(body[1][2].note, ", curved tets: "),
           "'%s', '%s'", body[1][1].note, body[1][2].note);
  SB_CHECK(body[1][1].npart == 2 && strstr(body[1][1].note, "inverted") &&
             strstr(body[1][1].note, "unused"),
           "%d parts, '%s'", (int)body[1][1].npart, body[1][1].note);
  PetscCall(SbMeshDestroy(&a));
  PetscCall(SbMeshDestroy(&b));
  PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_type"));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD)); /* all ranks have read the file */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ errors */

/* The first `ncell` tets of a box of 48, and one more: all ranks raise the error, whichever ranks
   read. The last coordinate is moved by x. */
static PetscErrorCode test_refused(PetscInt ncell, const PetscInt vert[4], PetscReal x,
                                   const char *words)
{
  SbBody body;
  SbMergedMesh whole;
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(test_path_of_all("slab_bad.h5", path));
  if (!test_rank) {
    SbImport *im;

    PetscCall(test_read("box:1,1,1:2", 0, &im));
    im->item[3].n = ncell;
    if (vert)
      PetscCall(SbImportAddItem(im, 3, vert[0] < 0 ? im->item[3].vert : vert, 0, ncell + 1));
    im->x[3 * im->nvert - 1] += x;
    PetscCall(SbMeshFileWrite(im, path, SB_MESH_H5));
    PetscCall(test_free(&im));
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  for (int k = 0; k < 2; k++) {
    body = test_body("b", path);
    SB_CHECK_ERROR(SbMergedMeshCreate(PETSC_COMM_WORLD, k ? SB_READING_SLABS : SB_READING_RANK0, 1,
                                      &body, 0, NULL, &whole),
                   (isfinite(x) ? PETSC_ERR_USER_INPUT : PETSC_ERR_FILE_UNEXPECTED), words);
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD)); /* all ranks have read the file */
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(SbOptionsRegister("body", "", PETSC_DECIDE, SbTetRows));
  PetscCall(test_same_mesh(PETSC_FALSE, "metis"));
  PetscCall(test_same_mesh(PETSC_FALSE, "bisection"));
  PetscCall(test_same_mesh(PETSC_TRUE, "metis"));
  PetscCall(test_same_mesh(PETSC_TRUE, "bisection"));
  PetscCall(test_refused(1, (const PetscInt[]){-1, 0, 0, 0}, 0, "1|2"));
  PetscCall(test_refused(48, (const PetscInt[]){-1, 0, 0, 0}, 0, "49"));
  PetscCall(test_refused(48, (const PetscInt[]){0, 1, 2, 2}, 0, "49"));
  PetscCall(test_refused(48, NULL, (PetscReal)INFINITY, "row 27"));
  SB_TEST_END();
}
