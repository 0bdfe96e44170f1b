/*
  write.c - writes a mesh in the format of its extension, under a temporary name until it is complete.
*/
#include <errno.h>
#include <strings.h>
#include <unistd.h>
#include "meshio_impl.h"

PetscErrorCode SbMeshFileRead(const SbBody *body, SbMeshProgress progress, void *ctx, SbImport **import)
{
  SbImport *im;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&im));
  im->progress = progress;
  im->progress_ctx = ctx;
  ierr = SbImportRead(body, im);
  if (ierr) PetscCall(SbMeshFileDestroy(&im));
  *import = im;
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbMeshFileDestroy(SbImport **import)
{
  PetscFunctionBeginUser;
  if (!*import) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbImportDestroy(*import));
  PetscCall(PetscFree(*import));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *SbMeshFileNote(const SbImport *im)
{
  return im->note;
}

void SbMeshFileCount(const SbImport *im, PetscInt *nvert, PetscInt n[4])
{
  *nvert = im->nvert;
  for (int d = 0; d < 4; d++) n[d] = im->item[d].n;
}

/* Renames a file that has been written, or removes it after an error. */
static PetscErrorCode finish(PetscErrorCode ierr, const char *part, const char *path)
{
  const int failed = !ierr && rename(part, path) ? errno : 0;

  PetscFunctionBeginUser;
  if (ierr || failed) (void)unlink(part);
  PetscCall(ierr);
  PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", path,
             strerror(failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshFileWrite(const SbImport *im, const char *path, SbMeshFormat format)
{
  char part[PETSC_MAX_PATH_LEN + 32], index[PETSC_MAX_PATH_LEN + 8];
  const char *dot = strrchr(path, '.');

  PetscFunctionBeginUser;
  // format by the extension of the name
  if (format == SB_MESH_AUTO) {
    if (dot && !strcasecmp(dot, ".msh"))
      format = SB_MESH_MSH41;
    else if (dot && !strcasecmp(dot, ".h5"))
      format = SB_MESH_H5;
    else
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: meshes are written as .msh (gmsh) or .h5 (supple)",
              path);
  }
  (void)snprintf(part, sizeof(part), "%s.part", path);
  PetscCall(finish(format == SB_MESH_H5 ? SbWrite_H5(im, part) : SbWrite_Gmsh(im, part, format), part, path));
  if (format != SB_MESH_H5) PetscFunctionReturn(PETSC_SUCCESS);
  // mesh.h5 -> mesh.xmf, for ParaView
  (void)snprintf(index, sizeof(index), "%.*s.xmf",
                 (int)(dot && !strchr(dot, '/') ? dot - path : (ptrdiff_t)strlen(path)), path);
  (void)snprintf(part, sizeof(part), "%s.part", index);
  PetscCall(finish(SbWrite_Xdmf(im, part, path), part, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}
