/*
  file.h - temporary files of one test run: written by rank 0, read by any rank, with names unique to the run, removed at its end.
*/
#pragma once
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <sbbase.h>

static char (*test_files)[512]; /* [test_nfile] */
static size_t test_nfile;

static inline PetscErrorCode test_files_remove(void)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD)); /* all ranks have read them */
  for (; test_nfile > 0 && !rank; test_nfile--) (void)unlink(test_files[test_nfile - 1]);
  free(test_files);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A new file in the folder for temporary files, under a name that no other run has and that ends with `ending`
  (".msh"). Collective; the name is the same on all ranks, `file` is open for writing on rank 0 and NULL on the
  others. Close it with test_file_close(); it is removed when the program ends.
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
  if (!test_nfile) PetscCall(PetscRegisterFinalize(test_files_remove));
  test_files = (char(*)[512])realloc(test_files, (test_nfile + 1) * sizeof(*test_files));
  memcpy(test_files[test_nfile++], path, sizeof(*test_files));
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
