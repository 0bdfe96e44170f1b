/*
  Plain files: written whole beside their target and renamed into it, so that a reader, or a kill, never meets
  half a file; failures of one rank reported by all.
*/
#include <errno.h>
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

void SbFileReplace(const char *path, const void *text, size_t size, char message[SB_MESSAGE_MAX])
{
  char tmp[PETSC_MAX_PATH_LEN + 8];
  FILE *file;
  int bad = 1;

  (void)snprintf(tmp, sizeof(tmp), "%s.tmp", path);
  errno = 0;
  file = fopen(tmp, "w");
  if (file) {
    bad = fwrite(text, 1, size, file) != size;
    bad = fclose(file) || bad || rename(tmp, path);
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
