/*
  triangles.c - a closed surface from a file: the reader by the name of the file, scale and place, the checks, and all of it to all ranks.

  The boundary of a gmsh file is that of its tets; without tets its triangles are the surface.
*/
#include <ctype.h>
#include <strings.h>
#include "sbtet.h"
#include "triangles.h"

PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *f, const PetscReal x[3])
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  if (t->nvert == f->vert_size) {
    f->vert_size = PetscMax(256, 2 * f->vert_size);
    PetscCall(PetscRealloc(3 * (size_t)f->vert_size * sizeof(PetscReal), &t->x));
  }
  for (int i = 0; i < 3; i++) t->x[3 * t->nvert + i] = x[i];
  t->nvert++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesAdd(SbTriangleFile *f, PetscInt a, PetscInt b, PetscInt c, int64_t number)
{
  SbTriangles *t = f->t;
  PetscInt *v;

  PetscFunctionBeginUser;
  if (t->ntri == f->tri_size) {
    f->tri_size = PetscMax(256, 2 * f->tri_size);
    PetscCall(PetscRealloc(3 * (size_t)f->tri_size * sizeof(PetscInt), &t->tri));
    PetscCall(PetscRealloc((size_t)f->tri_size * sizeof(int64_t), &f->number));
    if (f->groups) PetscCall(PetscRealloc((size_t)f->tri_size * sizeof(PetscInt), &f->tags));
  }
  if (f->groups) f->tags[t->ntri] = f->now;
  v = t->tri + 3 * t->ntri;
  v[0] = a;
  v[1] = b;
  v[2] = c;
  f->number[t->ntri++] = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesGroups(SbTriangleFile *f, PetscInt n, const char *const names[])
{
  PetscInt group[16];

  PetscFunctionBeginUser;
  if (!f->groups) PetscFunctionReturn(PETSC_SUCCESS);
  n = PetscMin(n, 16);
  for (PetscInt i = 0; i < n; i++) {
    char name[SB_GROUP_MAX];
    uint64_t hash = 0xcbf29ce484222325u; /* stands for the name where groups have numbers (FNV-1a) */

    PetscCall(PetscStrncpy(name, names[i], sizeof(name)));
    for (char *c = name; *c; c++) {
      if (isspace((unsigned char)*c)) *c = '_';
      hash = (hash ^ (unsigned char)*c) * 0x100000001b3u;
    }
    PetscCall(SbImportGroup(f->groups, 2, (int64_t)(hash >> 2), name, &group[i]));
  }
  PetscCall(SbImportTagSet(f->groups, n, group, &f->now));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ gmsh */

/* The faces of tets without a tet beyond; they have no number in the file. */
static PetscErrorCode add_boundary(SbImport *im, SbTriangleFile *f)
{
  SbFaces faces;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&faces, sizeof(faces)));
  ierr = SbImportCheck(im, &faces);
  for (PetscInt s = 0; !ierr && s < 4 * im->item[3].n; s++) {
    const PetscInt *v = im->item[3].vert + 4 * (s / 4);
    const int *a = SbFaceVertex[s % 4];

    if (faces.neighbour[s] >= 0) continue;
    ierr = SbTrianglesAdd(f, v[a[0]], v[a[1]], v[a[2]], f->t->ntri + 1);
  }
  PetscCall(SbFacesDestroy(&faces));
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbTrianglesRead_Gmsh(const char *path, SbTriangleFile *f)
{
  SbImport im;
  PetscInt none;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&im, sizeof(im)));
  (void)snprintf(im.where, sizeof(im.where), "%s", f->where);
  im.surface = PETSC_TRUE;
  PetscCall(SbImportTagSet(&im, 0, NULL, &none));
  ierr = SbImportRead_Msh(path, &im);
  if (!ierr && im.item[3].n)
    ierr = add_boundary(&im, f);
  else if (!ierr) {
    const SbItems *tri = &im.item[2];

    for (PetscInt i = 0; !ierr && i < tri->n; i++)
      ierr = SbTrianglesAdd(f, tri->vert[3 * i], tri->vert[3 * i + 1], tri->vert[3 * i + 2], tri->number[i]);
  }
  for (PetscInt v = 0; !ierr && v < im.nvert; v++) ierr = SbTrianglesAddVertex(f, im.x + 3 * v);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(ierr);
}

/* ------------------------------------------------------------------ from file to all ranks */

static const struct {
  const char *extension;
  SbTriangleReader read;
  PetscBool obstacle; /* tells inside from outside */
} readers[] = {
  {".stl", SbTrianglesRead_STL, PETSC_TRUE},     {".obj", SbTrianglesRead_OBJ, PETSC_TRUE},
  {".off", SbTrianglesRead_OFF, PETSC_TRUE},     {".ply", SbTrianglesRead_PLY, PETSC_TRUE},
  {".msh", SbTrianglesRead_Gmsh, PETSC_TRUE},    {".poly", SbTrianglesRead_Poly, PETSC_FALSE},
  {".smesh", SbTrianglesRead_Poly, PETSC_FALSE},
};

SbTriangleReader SbTrianglesReader(const char *path)
{
  const char *dot = strrchr(path, '.');

  for (size_t i = 0; dot && i < PETSC_STATIC_ARRAY_LENGTH(readers); i++) {
    if (!strcasecmp(dot, readers[i].extension)) return readers[i].read;
  }
  return NULL;
}

/* They would only widen the box. */
PetscErrorCode SbTrianglesDropUnused(SbTriangles *t)
{
  PetscInt *map, n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(t->nvert, &map));
  for (PetscInt i = 0; i < 3 * t->ntri; i++) map[t->tri[i]] = 1;
  for (PetscInt v = 0; v < t->nvert; v++) {
    if (!map[v]) continue;
    PetscCall(PetscArraymove(t->x + 3 * n, t->x + 3 * v, 3));
    map[v] = n++;
  }
  t->nvert = n;
  for (PetscInt i = 0; i < 3 * t->ntri; i++) t->tri[i] = map[t->tri[i]];
  PetscCall(PetscFree(map));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode place(PetscReal scale, const PetscReal at[3], SbTriangleFile *f)
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 3 * t->nvert; i++) {
    t->x[i] = scale * t->x[i] + at[i % 3];
    PetscCheck(isfinite(t->x[i]), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: vertex %lld has a coordinate that is not a finite number; repair the file", f->where,
               (long long)(i / 3 + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0. */
static PetscErrorCode read_file(const char *path, PetscReal scale, const PetscReal at[3], SbTriangleFile *f,
                                size_t size, char note[])
{
  const char *dot = strrchr(path, '.');

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(readers); i++) {
    if (!dot || !readers[i].obstacle || strcasecmp(dot, readers[i].extension)) continue;
    PetscCall((*readers[i].read)(path, f));
    PetscCheck(f->t->ntri, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s: holds no triangles; give a closed surface of triangles, or a mesh of tetrahedra",
               f->where);
    PetscCall(SbTrianglesDropUnused(f->t));
    PetscCall(place(scale, at, f));
    PetscCall(SbSkinObstacle(f, size, note));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "%s: is a file of no known kind; give one that ends in .stl, .obj, .off, .ply or .msh", f->where);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 reads; all ranks fail together. */
static PetscErrorCode read_first(MPI_Comm comm, const char *where, const char *path, PetscReal scale,
                                 const PetscReal at[3], SbTriangles *t, size_t size, char note[])
{
  SbCaught caught = {0, ""};
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    SbTriangleFile file = {.where = where, .t = t};
    PetscErrorCode ierr;

    PetscCall(PetscPushErrorHandler(SbCatchError, &caught));
    ierr = read_file(path, scale, at, &file, size, note);
    PetscCall(PetscPopErrorHandler());
    PetscCall(PetscFree(file.number));
    if (ierr) PetscCall(SbTrianglesDestroy(t));
    caught.code = (int)ierr;
  }
  PetscCallMPI(MPI_Bcast(&caught, (int)sizeof(caught), MPI_BYTE, 0, comm));
  PetscCheck(!caught.code, comm, (PetscErrorCode)caught.code, "%s", caught.text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead(MPI_Comm comm, const char *option, const char *path, PetscReal scale,
                               const PetscReal at[3], SbTriangles *t)
{
  char where[PETSC_MAX_PATH_LEN + 3 * SB_NAME_MAX], note[512] = ""; /* of rank 0, as warnings are */
  SbTriangles head;
  PetscMPIInt rank, n[2];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  (void)snprintf(where, sizeof(where), "%s: %s", option, path);
  PetscCall(read_first(comm, where, path, scale, at, t, sizeof(note), note));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  head = *t;
  PetscCallMPI(MPI_Bcast(&head, (int)sizeof(head), MPI_BYTE, 0, comm));
  if (rank) {
    *t = head;
    t->x = NULL;
    t->tri = t->across = NULL;
    PetscCall(PetscMalloc1(3 * (size_t)t->nvert, &t->x));
    PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &t->tri));
    PetscCall(PetscMalloc1(3 * (size_t)t->ntri, &t->across));
  }
  PetscCall(PetscMPIIntCast(3 * t->nvert, &n[0]));
  PetscCall(PetscMPIIntCast(3 * t->ntri, &n[1]));
  PetscCallMPI(MPI_Bcast(t->x, n[0], MPIU_REAL, 0, comm));
  PetscCallMPI(MPI_Bcast(t->tri, n[1], MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(t->across, n[1], MPIU_INT, 0, comm));
  if (note[0]) PetscCall(SbWarning(comm, "%s: %s", where, note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesDestroy(SbTriangles *t)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(t->x));
  PetscCall(PetscFree(t->tri));
  PetscCall(PetscFree(t->across));
  PetscCall(PetscMemzero(t, sizeof(*t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
