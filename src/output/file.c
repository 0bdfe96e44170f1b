/*
  Plain files: written whole beside their target and renamed into it, so that a reader, or a kill, never meets
  half a file; space reserved before a file is touched; failures of one rank reported by all.
*/
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include "output_impl.h"

PetscErrorCode SbAgree(MPI_Comm comm, PetscErrorCode code, const char *message)
{
  SbCaughtError caught = {message[0] ? (int)code : 0, ""};

  PetscFunctionBeginUser;
  SbFormat(sizeof(caught.text), caught.text, "%s", message);
  PetscCall(SbCaughtRaise(comm, &caught));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFileReserve(MPI_Comm comm, const char *path, PetscInt64 bytes)
{
  PetscMPIInt rank;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    const int fd = open(path, O_WRONLY | O_CREAT, 0666);
    struct stat info;
    int error = errno;

    if (fd >= 0) {
      error = fstat(fd, &info) ? errno : posix_fallocate(fd, info.st_size, (off_t)bytes);
      // What was reserved before the disk was full goes back, so that other files can be ended properly.
      if (error && ftruncate(fd, info.st_size)) error = errno;
      (void)close(fd);
    }
    // A file system that cannot reserve is not full.
    if (error && (fd < 0 || (error != EINVAL && error != EOPNOTSUPP && error != ENOSYS))) {
      SbFormat(sizeof(message), message, "cannot write %" PetscInt64_FMT " bytes to %s: %s; " SB_NO_ROOM,
               bytes, path, strerror(error));
    }
  }
  PetscCall(SbAgree(comm, PETSC_ERR_FILE_WRITE, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbFileReplace(const char *path, int nchunk, const SbChunk chunk[], char message[SB_MESSAGE_MAX])
{
  char tmp[PETSC_MAX_PATH_LEN + 8];
  FILE *file;
  size_t size = 0, written = 0;
  int bad = 1;

  (void)snprintf(tmp, sizeof(tmp), "%s.tmp", path);
  for (int i = 0; i < nchunk; i++) size += chunk[i].size;
  errno = 0;
  file = fopen(tmp, "w");
  if (file) {
    for (int i = 0; i < nchunk; i++)
      written += chunk[i].size ? fwrite(chunk[i].text, 1, chunk[i].size, file) : 0;
    bad = fclose(file) || written != size || rename(tmp, path);
  }
  if (!bad) return;
  SbFormat(SB_MESSAGE_MAX, message, "cannot write %zu bytes to %s: %s; " SB_NO_ROOM, size, path,
           strerror(errno ? errno : EIO));
  (void)unlink(tmp);
}

PetscErrorCode SbFileRead(const char *path, char **text, size_t *size)
{
  FILE *file = fopen(path, "r");
  long end;

  PetscFunctionBeginUser;
  *text = NULL;
  *size = 0;
  if (!file) PetscFunctionReturn(PETSC_SUCCESS);
  if (!fseek(file, 0, SEEK_END) && (end = ftell(file)) >= 0 && !fseek(file, 0, SEEK_SET)) {
    PetscCall(PetscMalloc1((size_t)end + 1, text));
    *size = fread(*text, 1, (size_t)end, file);
    (*text)[*size] = 0;
  }
  (void)fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}
