/*
  file.h - temporary files of one test run: written by rank 0, read by any rank, with names unique to the run.
*/
#pragma once
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <sbbase.h>

/*
  A new file in the folder for temporary files, under a name that no other run has and that ends with `ending` (".msh"). Collective; the
  name is the same on all ranks, `file` is open for writing on rank 0 and NULL on the others. Close it with test_file_close().
*/
static inline PetscErrorCode test_file_open(const char ending[], char path[512], FILE **file)
{
  const char *folder = getenv("TMPDIR");
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  *file = NULL;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank) {
    int fd;

    PetscCall(PetscSNPrintf(path, 512, "%s/supple-XXXXXX%s", folder && folder[0] ? folder : "/tmp", ending));
    fd = mkstemps(path, (int)strlen(ending));
    *file = fd < 0 ? NULL : fdopen(fd, "wb");
    PetscCheck(*file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot write %s", path);
  }
  PetscCallMPI(MPI_Bcast(path, 512, MPI_CHAR, 0, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Closes the file: afterwards every rank can read what rank 0 wrote. Collective. */
static inline PetscErrorCode test_file_close(FILE *file)
{
  PetscFunctionBeginUser;
  if (file) PetscCheck(!fclose(file), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write the file");
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the file after all ranks have read it. Collective. */
static inline PetscErrorCode test_file_remove(const char path[])
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank) (void)unlink(path);
  PetscFunctionReturn(PETSC_SUCCESS);
}
