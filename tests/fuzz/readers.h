/*
  readers.h - one input through one reader, used by make fuzz millions of times and by the unit test
  once for each file of tests/fuzz.

  The input is written to a file with the extension of its format. TetGen's mesh has four files: in
  the input they follow each other, separated by lines of %%. For a mesh in HDF5 the input describes
  the contents of the file (h5.h).
*/
#pragma once
#include <sys/stat.h>
#include <unistd.h>
#include "h5.h"
#include "../../src/meshio/meshio_impl.h"
#include "../../src/surface/surface_impl.h"

/* A surface for a body: read, repaired, checked and cut into regions; it is not filled with
   tets. */
static inline PetscErrorCode fuzz_surface(const char *path, SbImport *im)
{
  SbSurface body_surface;

  PetscFunctionBeginUser;
  im->scale = 1;
  SbTetDefaults(&im->tet);
  PetscCall(SbSurfaceRead(path, im, &body_surface));
  PetscCall(SbSurfaceDestroy(&body_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* netCDF's classic format; a file in HDF5 would be read in a child process. */
static inline PetscErrorCode fuzz_exodus(const char *path, SbImport *im)
{
  FILE *file = fopen(path, "rb");
  const int first = file ? fgetc(file) : 0;

  PetscFunctionBeginUser;
  if (file)
    (void)fclose(file);
  if (first != 'C')
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: is not of the classic format",
            im->where);
  PetscCall(SbImportRead_Exodus(path, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* read NULL: a closed surface, by its ending. */
static const struct {
  const char *name, *ending;
  SbReader read;
} fuzz_readers[] = {
  {"gmsh", ".msh", SbImportRead_Gmsh},
  {"tetgen", ".ele", SbImportRead_TetGen},
  {"netgen", ".vol", SbImportRead_Netgen},
  {"neutral", ".neu", SbImportRead_NetgenNeutral},
  {"medit", ".mesh", SbImportRead_Medit},
  {"vtk", ".vtk", SbImportRead_VTK},
  {"vtu", ".vtu", SbImportRead_VTU},
  {"abaqus", ".inp", SbImportRead_Abaqus},
  {"unv", ".unv", SbImportRead_UNV},
  {"nastran", ".bdf", SbImportRead_Nastran},
  {"febio", ".feb", SbImportRead_FEBio},
  {"exodus", ".exo", fuzz_exodus},
  {"h5", ".h5", SbImportRead_H5},
  {"xmf", ".xmf", SbImportRead_Xdmf},
  {"stl", ".stl", NULL},
  {"obj", ".obj", NULL},
  {"off", ".off", NULL},
  {"ply", ".ply", NULL},
  {"poly", ".poly", fuzz_surface},
  {"smesh", ".smesh", fuzz_surface},
  {"surface", ".off", fuzz_surface},
};
enum {
  NFUZZ = (int)PETSC_STATIC_ARRAY_LENGTH(fuzz_readers)
};

/* Keeps the text of an error. */
static inline PetscErrorCode fuzz_keep_error(MPI_Comm comm, int line, const char *function,
                                             const char *file, PetscErrorCode code,
                                             PetscErrorType kind, const char *text, void *ctx)
{
  (void)comm, (void)line, (void)function, (void)file;
  if (kind == PETSC_ERROR_INITIAL)
    (void)snprintf((char *)ctx, 1024, "%s", text ? text : "");
  return code;
}

static inline void fuzz_write(const char *path, const char *data, size_t n)
{
  FILE *file = fopen(path, "wb");

  if (!file)
    return;
  (void)fwrite(data, 1, n, file);
  (void)fclose(file);
}

/* The parts of a mesh of TetGen. */
static inline void fuzz_split(const char *folder, const char *data, size_t n)
{
  static const char *const endings[] = {".node", ".ele", ".face", ".edge"};
  char path[256];

  for (int i = 0; i < 4; i++) {
    const char *mark = n ? (const char *)memmem(data, n, "%%\n", 3) : NULL;
    const size_t part = mark ? (size_t)(mark - data) : n;

    (void)snprintf(path, sizeof(path), "%s/in%s", folder, endings[i]);
    (void)unlink(path);
    if (part || i < 2)
      fuzz_write(path, data, part);
    n -= mark ? part + 3 : n;
    data += mark ? part + 3 : part;
  }
}

/* Reads and checks as a scene does; text: of the error, "" without one. Returns the error code. */
static inline PetscErrorCode fuzz_read(int reader, const char *folder, const char *data, size_t n,
                                       char text[1024])
{
  char path[256];
  const PetscReal origin[3] = {0, 0, 0};
  PetscErrorCode ierr;
  int step = 0;

  text[0] = 0;
  (void)snprintf(path, sizeof(path), "%s/in%s", folder, fuzz_readers[reader].ending);
  if (fuzz_readers[reader].read == SbImportRead_TetGen)
    fuzz_split(folder, data, n);
  else if (fuzz_readers[reader].read == SbImportRead_H5)
    step = fuzz_h5_write(path, data, n);
  else
    fuzz_write(path, data, n);
  (void)PetscPushErrorHandler(fuzz_keep_error, text);
  if (fuzz_readers[reader].read) {
    SbImport im;
    SbFaces faces;
    PetscInt none;

    memset(&im, 0, sizeof(im));
    memset(&faces, 0, sizeof(faces));
    (void)snprintf(im.where, sizeof(im.where), "%s", path);
    im.step = step;
    ierr = SbImportTagSet(&im, 0, NULL, &none);
    if (!ierr)
      ierr = (*fuzz_readers[reader].read)(path, &im);
    if (!ierr && fuzz_readers[reader].read != fuzz_surface)
      ierr = SbImportCheck(&im, &faces);
    (void)SbFacesDestroy(&faces);
    (void)SbImportDestroy(&im);
  } else {
    SbTriangles t;

    ierr = SbTrianglesRead(PETSC_COMM_SELF, "fuzz", path, 1, origin, &t);
    if (!ierr)
      (void)SbTrianglesDestroy(&t);
  }
  (void)PetscPopErrorHandler();
  return ierr;
}

/* What every error of a reader promises: it is the user's, says where, and stands on one line. NULL
   when it is kept. */
static inline const char *fuzz_broken_promise(PetscErrorCode code, const char *text)
{
  if (!code)
    return NULL;
  if (code != PETSC_ERR_USER_INPUT && code != PETSC_ERR_USER && code != PETSC_ERR_FILE_OPEN &&
      code != PETSC_ERR_FILE_READ && code != PETSC_ERR_FILE_UNEXPECTED)
    return "the error is no error of the input";
  if (!strstr(text, "/in.") && !strstr(text, "-effect_g_time"))
    return "the error names no file or option";
  return strchr(text, '\n') ? "the error has more than one line" : NULL;
}
