/*
  write.c - writes a mesh in the format of its extension, under a temporary name until it is
  complete.
*/
#include <errno.h>
#include <strings.h>
#include <unistd.h>
#include "meshio_impl.h"

/* Writes one file: a mesh, or the .xmf of the mesh `h5`. */
static PetscErrorCode write_file(const SbImport *im, const char *path, SbMeshFormat format,
                                 const char *h5)
{
  char part[PETSC_MAX_PATH_LEN + 32];
  PetscErrorCode ierr = PETSC_SUCCESS;
  PetscBool failed = PETSC_FALSE;
  int error;

  PetscFunctionBeginUser;
  (void)snprintf(part, sizeof(part), "%s.part", path);
  errno = 0;
  if (format == SB_MESH_H5 && !h5)
    ierr = SbWrite_H5(im, part);
  else {
    FILE *file = SbFileCreate(part);

    PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", part,
               strerror(errno));
    (void)setvbuf(file, NULL, _IOFBF, 1 << 20);
    if (h5)
      SbWrite_Xdmf(im, h5, file);
    else
      ierr = SbWrite_Gmsh(im, format, file);
    failed = (PetscBool)(ferror(file) != 0);
    failed = (PetscBool)(fclose(file) || failed);
  }
  failed = (PetscBool)(failed || (!ierr && rename(part, path)));
  error = errno;
  if (ierr || failed)
    (void)unlink(part);
  PetscCall(ierr);
  PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", path,
             strerror(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshFileWrite(const SbImport *im, const char *path, SbMeshFormat format)
{
  char index[PETSC_MAX_PATH_LEN + 8];
  const char *dot = strrchr(path, '.');

  PetscFunctionBeginUser;

  // format by the extension of the name
  if (format == SB_MESH_AUTO) {
    PetscCheck(dot && (!strcasecmp(dot, ".msh") || !strcasecmp(dot, ".h5")), PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT, "%s: meshes are written as .msh (gmsh) or .h5 (supple)", path);
    format = strcasecmp(dot, ".h5") ? SB_MESH_MSH41 : SB_MESH_H5;
  }
  PetscCall(write_file(im, path, format, NULL));

  // mesh.h5 -> mesh.xmf, for ParaView
  (void)snprintf(index, sizeof(index), "%.*s.xmf",
                 (int)(dot && !strchr(dot, '/') ? dot - path : (ptrdiff_t)strlen(path)), path);
  if (format == SB_MESH_H5)
    PetscCall(write_file(im, index, format, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}
