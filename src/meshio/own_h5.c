/*
  own_h5.c - whether an HDF5 file is complete in itself.

  HDF5 follows links into other files, and reads datasets whose numbers are in other files, at once
  and without a word. supple writes neither (the indices fields.vtkhdf and contacts.vtkhdf, which it
  does not read, have virtual datasets), so what it reads may not have them: every link of the file
  is visited, and the layout of every dataset.
*/
#include <sys/stat.h>
#include "meshio_impl.h"

typedef struct {
  size_t size;
  char *why; /* [size] */
  const char *path;
} Reason;

/* Checks one link; a positive number ends the visit. */
static herr_t visit(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  const Reason *r = (const Reason *)ctx;
  const char *what = NULL;
  hid_t object;

  if (info->type != H5L_TYPE_HARD)
    what = "is a link to another place";
  object = what ? -1 : H5Oopen(where, name, H5P_DEFAULT);
  if (object >= 0 && H5Iget_type(object) == H5I_DATASET) {
    const hid_t list = H5Dget_create_plist(object);

    if (H5Pget_external_count(list) > 0 || H5Pget_layout(list) == H5D_VIRTUAL)
      what = "has its numbers in other files";
    (void)H5Pclose(list);
  }
  if (object >= 0)
    (void)H5Oclose(object);
  if (what)
    (void)snprintf(r->why, r->size,
                   "%s: /%s %s; a file that supple reads holds all of its own, so this "
                   "one is not read",
                   r->path, name, what);
  return what != NULL;
}

PetscBool SbH5FileIsOwn(hid_t file, const char *path, size_t size, char why[])
{
  Reason reason = {size, why, path};

  why[0] = 0;
  H5E_BEGIN_TRY(void) H5Lvisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, visit, &reason);
  H5E_END_TRY
  return (PetscBool)!why[0];
}

PetscBool SbH5IsOwn(const char *path, size_t size, char why[])
{
  struct stat info;
  hid_t file, access;

  why[0] = 0;
  if (stat(path, &info))
    return PETSC_TRUE;
  if (!S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode))
    (void)snprintf(why, size, "%s: it is not a regular file", path);
  if (!S_ISREG(info.st_mode))
    return (PetscBool)!why[0];

  /* through MPI-IO: HDF5 1.10's buffer of metadata, which that has not, crashes on damaged
     addresses */
  access = H5Pcreate(H5P_FILE_ACCESS);
  (void)H5Pset_fapl_mpio(access, MPI_COMM_SELF, MPI_INFO_NULL);
  H5E_BEGIN_TRY file = H5Fopen(path, H5F_ACC_RDONLY, access);
  if (file >= 0) {
    (void)SbH5FileIsOwn(file, path, size, why);
    (void)H5Fclose(file);
  }
  H5E_END_TRY(void) H5Pclose(access);
  return (PetscBool)!why[0];
}
