/*
  file.h - temporary files of one test run: written by rank 0, read by any rank, with names unique
  to the run, removed when the program ends.
*/
#pragma once
#include <ftw.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <sbbase.h>

static char (*test_file_list)[512]; /* [test_file_count] files and folders */
static size_t test_file_count;

static inline int test_file_remove(const char *path, const struct stat *status, int kind,
                                   struct FTW *place)
{
  (void)status, (void)kind, (void)place;
  return remove(path);
}

static inline PetscErrorCode test_file_remove_all(void)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD)); /* all ranks have read them */
  for (size_t k = 0; k < test_file_count && !rank; k++)
    (void)nftw(test_file_list[k], test_file_remove, 8, FTW_DEPTH | FTW_PHYS);
  free(test_file_list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives all ranks the path that rank 0 made, and removes it with what is in it when the program
   ends. Collective. */
static inline PetscErrorCode test_file_keep(char path[512])
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Bcast(path, 512, MPI_CHAR, 0, PETSC_COMM_WORLD));
  if (!test_file_count)
    PetscCall(PetscRegisterFinalize(test_file_remove_all));
  test_file_list =
    (char(*)[512])realloc(test_file_list, (test_file_count + 1) * sizeof(*test_file_list));
  memcpy(test_file_list[test_file_count++], path, sizeof(*test_file_list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A new file in the folder for temporary files, under a name that no other run has and that ends
  with `ending` (".msh"). Collective; the name is the same on all ranks, `file` is open for writing
  on rank 0 and NULL on the others. Close it with test_file_close().
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

    PetscCall(PetscSNPrintf(path, 512, "%s/supple-XXXXXX%s", folder && folder[0] ? folder : "/tmp",
                            ending));
    fd = mkstemps(path, (int)strlen(ending));
    *file = fd < 0 ? NULL : fdopen(fd, "wb");
    PetscCheck(*file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot write %s", path);
  }
  PetscCall(test_file_keep(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Closes the file: afterwards every rank can read what rank 0 wrote. Collective. */
static inline PetscErrorCode test_file_close(FILE *file)
{
  PetscFunctionBeginUser;
  if (file)
    PetscCheck(!fclose(file), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write the file");
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A new folder in the folder for temporary files. Collective; its name is the same on all ranks. */
static inline PetscErrorCode test_file_folder(char path[512])
{
  const char *folder = getenv("TMPDIR");
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank) {
    PetscCall(PetscSNPrintf(path, 512, "%s/supple-XXXXXX", folder && folder[0] ? folder : "/tmp"));
    PetscCheck(mkdtemp(path), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "No folder %s", path);
  }
  PetscCall(test_file_keep(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 writes a file with this text. Collective. */
static inline PetscErrorCode test_file_put(const char *path, const char *text)
{
  FILE *file = NULL;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank) {
    file = fopen(path, "wb");
    PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot write %s", path);
    (void)fputs(text, file);
  }
  PetscCall(test_file_close(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
