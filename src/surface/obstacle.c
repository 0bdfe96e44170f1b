/*
  obstacle.c - a rigid obstacle from the closed surface of a file: read by rank 0, scaled, placed, repaired and checked, then on all ranks.
*/
#include "surface_impl.h"

/* On rank 0. */
static PetscErrorCode read_file(const char *path, PetscReal scale, const PetscReal at[3], SbTriangleFile *f,
                                size_t size, char note[])
{
  const SbTriangleFormat *format = SbTrianglesFormat(path);
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  PetscCheck(format && !format->sheets, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: is a file of no known kind; give one that ends in .stl, .obj, .off, .ply or .msh",
             f->where);
  PetscCall(SbTrianglesReadFile(path, f));
  PetscCheck(t->ntri, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: holds no triangles; give a closed surface of triangles, or a mesh of tetrahedra", f->where);
  PetscCall(SbDropUnusedPoints(&t->nvert, t->x, 3 * t->ntri, t->tri));
  for (PetscInt i = 0; i < 3 * t->nvert; i++) {
    t->x[i] = scale * t->x[i] + at[i % 3];
    PetscCheck(isfinite(t->x[i]), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: vertex %lld has a coordinate that is not a finite number; repair the file", f->where,
               (long long)(i / 3 + 1));
  }
  PetscCall(SbSurfaceObstacle(f, size, note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead(MPI_Comm comm, const char *option, const char *path, PetscReal scale,
                               const PetscReal at[3], SbTriangles *t)
{
  char where[PETSC_MAX_PATH_LEN + 3 * SB_NAME_MAX], note[512] = ""; /* of rank 0, as warnings are */
  SbCaughtError caught = {0, ""};
  SbTriangles head;
  PetscMPIInt rank, n[2];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  (void)snprintf(where, sizeof(where), "%s: %s", option, path);
  // rank 0 reads; all ranks fail together
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    SbTriangleFile file = {.where = where, .t = t};

    SB_CATCH(&caught, read_file(path, scale, at, &file, sizeof(note), note));
    PetscCall(PetscFree(file.number));
    if (caught.code) PetscCall(SbTrianglesDestroy(t));
  }
  PetscCall(SbCaughtRaise(comm, &caught));
  // the surface goes to the others
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
