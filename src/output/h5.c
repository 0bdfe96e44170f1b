/*
  HDF5 through MPI-IO, laid out so that a kill at any moment leaves every completed frame readable.

  HDF5 changes its metadata in place, and half-written metadata is unreadable. Here all metadata
  that leads to completed frames is changed by single writes:
  - A frame is written as a group without a name: new objects at new positions, to which nothing
  points yet.
    It is flushed, all ranks meet, and only then does it get its name in the group of its hundred.
  - Such a group keeps its links in its own object header, in the old format (no checksum), with
  room for all
    of them from the start: at most 4096 bytes, aligned to 4096 bytes. Naming a frame is one write
    in a page.
  - The superblock (96 bytes) is one write within one page, too. It says where the file ends, and a
  file that
    ends earlier counts as truncated: SbH5Reserve() makes it longer than a frame needs before the
    frame.

  Reference: HDF5 File Format Specification Version 3.0, sections II.A (superblock version 0),
  IV.A.1.a (object header version 1), IV.A.2.g (link message). The old format is asked for
  explicitly; newer ones would write checksums and flags that mark the file as being in use.
*/
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbmeshio.h"

/* After a failed write HDF5 1.10 cannot be closed: it frees the file, keeps its identifier, and
   crashes when MPI_Finalize() makes it end. The error has been reported; the remainder of the
   program's end is skipped. */
static int leave_at_once(MPI_Comm comm, int key, void *attribute, void *state)
{
  (void)comm;
  (void)key;
  (void)attribute;
  (void)state;
  (void)fflush(NULL);
  _exit(1);
}

/* The innermost message of the error that HDF5 has on its stack. */
static herr_t take_message(unsigned n, const H5E_error2_t *error, void *ctx)
{
  if (!n && error->desc)
    (void)snprintf((char *)ctx, 160, "%s", error->desc);
  return 0;
}

/* Keeps the first error message of this rank. */
static void note(SbH5 *h, PetscBool bad)
{
  if (!bad || h->reason[0])
    return;
  SbFormat(sizeof(h->reason), h->reason, "the reason is unknown");
  (void)H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, take_message, h->reason);
}

/* Ends the run on all ranks when a call has failed on one of them. Collective. */
static PetscErrorCode agree(SbH5 *h)
{
  char message[SB_MESSAGE_MAX] = "";
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  if (h->reason[0])
    SbFormat(sizeof(message), message,
             "cannot write %" PetscInt64_FMT " bytes to %s: HDF5 says '%s'", h->bytes, h->path,
             h->reason);
  ierr = SbAgree(h->comm, PETSC_ERR_FILE_WRITE, message);
  if (ierr) {
    int key;

    // skip HDF5's cleanup at exit: MPI_Finalize() first deletes attributes of MPI_COMM_SELF, new
    // ones first
    if (!h->failed && !MPI_Comm_create_keyval(MPI_COMM_NULL_COPY_FN, leave_at_once, &key, NULL)) {
      h->failed = PETSC_TRUE;
      (void)MPI_Comm_set_attr(MPI_COMM_SELF, key, NULL);
    }
  }
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A call that changes metadata: it needs no communication and fails on all ranks alike. */
#define H5_CALL(h, call)   \
  do {                     \
    if ((call) < 0) {      \
      note(h, PETSC_TRUE); \
      PetscCall(agree(h)); \
    }                      \
  } while (0)

/* Opens a file, or creates it; h->file is negative when that fails. */
static PetscErrorCode open_file(MPI_Comm comm, const char *path, unsigned flags, SbH5 *h)
{
  const hid_t list = H5Pcreate(H5P_FILE_ACCESS);
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  *h = (SbH5){.comm = comm};
  PetscCall(PetscStrncpy(h->path, path, sizeof(h->path)));

  // A new file is one: what has its name is removed, and a link is not followed.
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (flags == H5F_ACC_EXCL && !rank)
    (void)unlink(path);
  if (flags == H5F_ACC_EXCL)
    PetscCallMPI(MPI_Barrier(comm));

  // Errors become one line of ours; HDF5 prints its whole stack otherwise.
  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  (void)H5Pset_fapl_mpio(list, comm, MPI_INFO_NULL);
  (void)H5Pset_alignment(list, 3000, 4096);
  (void)H5Pset_libver_bounds(list, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
  h->file =
    flags == H5F_ACC_EXCL ? H5Fcreate(path, flags, H5P_DEFAULT, list) : H5Fopen(path, flags, list);
  (void)H5Pclose(list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5Create(MPI_Comm comm, const char *path, SbH5 *h)
{
  PetscFunctionBeginUser;
  PetscCall(open_file(comm, path, H5F_ACC_EXCL, h));
  H5_CALL(h, h->file);
  SbFileRemember(path, &h->on_disk);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5Open(MPI_Comm comm, const char *path, PetscBool writable, SbH5 *h, PetscBool *ok)
{
  char why[SB_MESSAGE_MAX] = "";
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank)
    (void)SbH5IsOwn(path, sizeof(why), why);
  PetscCall(SbAgree(comm, PETSC_ERR_FILE_UNEXPECTED, why));
  PetscCall(open_file(comm, path, writable ? H5F_ACC_RDWR : H5F_ACC_RDONLY, h));
  *ok = (PetscBool)(h->file >= 0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, comm));
  if (!*ok && h->file >= 0)
    (void)H5Fclose(h->file);
  if (!*ok)
    h->file = -1;
  if (writable)
    SbFileRemember(path, &h->on_disk);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5Close(SbH5 *h)
{
  hid_t file = h->file;

  PetscFunctionBeginUser;
  if (file < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  h->file = -1;
  H5_CALL(h, H5Fclose(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5Flush(SbH5 *h)
{
  PetscFunctionBeginUser;
  note(h, (PetscBool)(H5Fflush(h->file, H5F_SCOPE_GLOBAL) < 0));
  PetscCall(agree(h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5Reserve(SbH5 *h, PetscInt64 bytes)
{
  PetscMPIInt rank;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  h->bytes = bytes;
  PetscCallMPI(MPI_Comm_rank(h->comm, &rank));
  if (!rank && !SbFileLost(h->path, &h->on_disk)) {
    const int fd = open(h->path, O_WRONLY);
    struct stat info;
    int error = errno;

    if (fd >= 0) {
      error = fstat(fd, &info) ? errno : posix_fallocate(fd, info.st_size, (off_t)bytes);

      // What was reserved before the disk was full goes back, so that other files can be ended
      // properly.
      if (error && ftruncate(fd, info.st_size))
        error = errno;
      (void)close(fd);
    }

    // A file system that cannot reserve is not full.
    if (error && (fd < 0 || (error != EINVAL && error != EOPNOTSUPP && error != ENOSYS))) {
      SbFormat(sizeof(message), message,
               "cannot write %" PetscInt64_FMT " bytes to %s: %s; " SB_NO_ROOM, bytes, h->path,
               strerror(error));
    }
  }
  PetscCall(SbAgree(h->comm, PETSC_ERR_FILE_WRITE, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

hid_t SbH5OpenGroup(hid_t where, const char *name)
{
  return H5Lexists(where, name, H5P_DEFAULT) > 0 ? H5Gopen2(where, name, H5P_DEFAULT) : -1;
}

PetscErrorCode SbH5GroupCreate(SbH5 *h, unsigned links, unsigned letters, hid_t *group)
{
  const hid_t list = H5Pcreate(H5P_GROUP_CREATE);

  PetscFunctionBeginUser;

  // Tracking the order of creation is what selects links in the object header under the old format.
  (void)H5Pset_link_creation_order(list, H5P_CRT_ORDER_TRACKED);
  (void)H5Pset_link_phase_change(list, 60000, 59999);
  (void)H5Pset_est_link_info(list, links, letters);
  (void)H5Pset_obj_track_times(list, 0);
  *group = H5Gcreate_anon(h->file, list, H5P_DEFAULT);
  (void)H5Pclose(list);
  H5_CALL(h, *group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5GroupLink(SbH5 *h, hid_t group, hid_t parent, const char *name)
{
  PetscFunctionBeginUser;
  H5_CALL(h, H5Olink(group, parent, name, H5P_DEFAULT, H5P_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Selects this rank's rows in the file; the memory holds just them. */
static void select_slice(const SbOrder *order, PetscInt ncomp, hid_t *filespace, hid_t *memspace)
{
  const hsize_t all[2] = {(hsize_t)order->N, (hsize_t)ncomp};
  const hsize_t count[2] = {(hsize_t)order->n, (hsize_t)ncomp};
  const hsize_t start[2] = {(hsize_t)order->start, 0};
  const int rank = ncomp > 1 ? 2 : 1;

  *filespace = H5Screate_simple(rank, all, NULL);
  *memspace = H5Screate_simple(rank, count, NULL);
  if (order->n) {
    (void)H5Sselect_hyperslab(*filespace, H5S_SELECT_SET, start, NULL, count, NULL);
  } else {
    (void)H5Sselect_none(*filespace);
    (void)H5Sselect_none(*memspace);
  }
}

static hid_t collective_list(void)
{
  const hid_t list = H5Pcreate(H5P_DATASET_XFER);

  (void)H5Pset_dxpl_mpio(list, H5FD_MPIO_COLLECTIVE);
  return list;
}

hid_t SbH5TypeInMemory(hid_t type)
{
  const hid_t pair[][2] = {
    {H5T_STD_I64LE, sizeof(PetscInt) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32},
    {H5T_STD_I32LE, H5T_NATIVE_INT32},
    {H5T_STD_U64LE, H5T_NATIVE_UINT64},
    {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE},
    {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT}};

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(pair); i++)
    if (type == pair[i][0])
      return pair[i][1];
  return type;
}

/* An attribute. */
static PetscErrorCode put(SbH5 *h, hid_t where, const char *name, hid_t filetype, hid_t memtype,
                          const void *value)
{
  const hid_t space = H5Screate(H5S_SCALAR);
  const hid_t attribute = H5Acreate2(where, name, filetype, space, H5P_DEFAULT, H5P_DEFAULT);

  PetscFunctionBeginUser;
  H5_CALL(h, attribute);
  H5_CALL(h, H5Awrite(attribute, memtype, value));
  (void)H5Aclose(attribute);
  (void)H5Sclose(space);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5PutText(SbH5 *h, hid_t where, const char *name, const char *text)
{
  const hid_t type = H5Tcopy(H5T_C_S1);

  PetscFunctionBeginUser;
  (void)H5Tset_size(type, strlen(text) + 1);
  PetscCall(put(h, where, name, type, type, text));
  (void)H5Tclose(type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A dataset, of which this rank has the part `mine` in memory and `part` in the file; unit: NULL
   for none. */
static PetscErrorCode write_dataset(SbH5 *h, hid_t where, const char *name, const char *unit,
                                    hid_t type, hid_t mine, hid_t part, const void *data)
{
  const hid_t create = H5Pcreate(H5P_DATASET_CREATE);
  const hid_t transfer = collective_list();
  hid_t dataset;

  PetscFunctionBeginUser;
  (void)H5Pset_fill_time(create, H5D_FILL_TIME_NEVER);
  (void)H5Pset_alloc_time(create, H5D_ALLOC_TIME_EARLY);
  (void)H5Pset_obj_track_times(create, 0); // the same run writes the same bytes
  dataset = H5Dcreate2(where, name, type, part, H5P_DEFAULT, create, H5P_DEFAULT);
  H5_CALL(h, dataset);
  if (unit)
    PetscCall(SbH5PutText(h, dataset, "unit", unit));
  note(h, (PetscBool)(H5Dwrite(dataset, SbH5TypeInMemory(type), mine, part, transfer, data) < 0));
  (void)H5Dclose(dataset);
  (void)H5Sclose(mine);
  (void)H5Sclose(part);
  (void)H5Pclose(create);
  (void)H5Pclose(transfer);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5WriteSlice(SbH5 *h, hid_t where, const char *name, const char *unit,
                              const SbOrder *order, PetscInt ncomp, hid_t type, const void *slice)
{
  hid_t filespace, memspace;

  PetscFunctionBeginUser;
  select_slice(order, ncomp, &filespace, &memspace);
  PetscCall(write_dataset(h, where, name, unit, type, memspace, filespace, slice));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5WriteText(SbH5 *h, hid_t where, const char *name, const char *text)
{
  const hid_t type = H5Tcopy(H5T_C_S1);

  PetscFunctionBeginUser;
  (void)H5Tset_size(type, strlen(text) + 1);
  PetscCall(
    write_dataset(h, where, name, NULL, type, H5Screate(H5S_SCALAR), H5Screate(H5S_SCALAR), text));
  (void)H5Tclose(type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of values of an attribute or dataset; -1: it cannot be said. */
static hssize_t values_of(hid_t space)
{
  const hssize_t n = space < 0 ? -1 : H5Sget_simple_extent_npoints(space);

  if (space >= 0)
    (void)H5Sclose(space);
  return n;
}

/* Opens a dataset and says its shape, [n][1] for a list; negative when it is not there. */
static hid_t open_dataset(hid_t where, const char *name, hsize_t n[2])
{
  const hid_t dataset =
    where >= 0 && H5Lexists(where, name, H5P_DEFAULT) > 0 ? H5Dopen2(where, name, H5P_DEFAULT) : -1;

  n[0] = 0;
  n[1] = 1;
  if (dataset >= 0) {
    const hid_t space = H5Dget_space(dataset);

    if (H5Sget_simple_extent_ndims(space) <= 2)
      (void)H5Sget_simple_extent_dims(space, n, NULL);
    (void)H5Sclose(space);
  }
  return dataset;
}

PetscInt64 SbH5Rows(hid_t where, const char *name, PetscInt *bytes)
{
  hsize_t n[2];
  const hid_t dataset = open_dataset(where, name, n);
  const hid_t type = dataset < 0 ? -1 : H5Dget_type(dataset);

  if (bytes)
    *bytes = dataset < 0 ? 0 : (PetscInt)H5Tget_size(type);
  if (dataset >= 0)
    (void)H5Tclose(type);
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  return (PetscInt64)n[0];
}

PetscBool SbH5Read(hid_t where, const char *name, hid_t type, PetscInt rows, PetscInt ncomp,
                   void *values)
{
  hsize_t n[2];
  const hid_t dataset = open_dataset(where, name, n);
  PetscBool ok = (PetscBool)(dataset >= 0 && n[0] == (hsize_t)rows && n[1] == (hsize_t)ncomp);

  // of more dimensions there may be more
  if (ok)
    ok = (PetscBool)(values_of(H5Dget_space(dataset)) == (hssize_t)rows * ncomp);
  if (ok)
    ok = (PetscBool)(H5Dread(dataset, SbH5TypeInMemory(type), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                             values) >= 0);
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  return ok;
}

PetscErrorCode SbH5ReadSlice(SbH5 *h, const char *name, const SbOrder *order, PetscInt ncomp,
                             PetscReal slice[], PetscBool *ok)
{
  hsize_t n[2];
  const hid_t dataset = open_dataset(h->file, name, n);

  PetscFunctionBeginUser;
  *ok = (PetscBool)(dataset >= 0 && n[0] == (hsize_t)order->N && n[1] == (hsize_t)ncomp);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, h->comm));
  if (*ok) {
    const hid_t transfer = collective_list();
    hid_t filespace, memspace;

    select_slice(order, ncomp, &filespace, &memspace);
    *ok =
      (PetscBool)(H5Dread(dataset, H5T_NATIVE_DOUBLE, memspace, filespace, transfer, slice) >= 0);
    (void)H5Sclose(filespace);
    (void)H5Sclose(memspace);
    (void)H5Pclose(transfer);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, h->comm));
  }
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5PutReal(SbH5 *h, hid_t where, const char *name, PetscReal value)
{
  PetscFunctionBeginUser;
  PetscCall(put(h, where, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbH5PutInt(SbH5 *h, hid_t where, const char *name, int64_t value)
{
  PetscFunctionBeginUser;
  PetscCall(put(h, where, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbH5IsScalar(hid_t attribute)
{
  return (PetscBool)(values_of(H5Aget_space(attribute)) == 1);
}

/* The value of a scalar attribute whose type is of this class. */
static PetscBool get(hid_t where, const char *name, H5T_class_t klass, hid_t memtype, void *value)
{
  const hid_t attribute = H5Aexists(where, name) > 0 ? H5Aopen(where, name, H5P_DEFAULT) : -1;
  PetscBool good = PETSC_FALSE;

  if (attribute >= 0) {
    const hid_t type = H5Aget_type(attribute);

    good = (PetscBool)(H5Tget_class(type) == klass && SbH5IsScalar(attribute) &&
                       H5Aread(attribute, memtype, value) >= 0);
    (void)H5Tclose(type);
    (void)H5Aclose(attribute);
  }
  return good;
}

void SbH5GetReal(hid_t where, const char *name, PetscReal *value, PetscBool *ok)
{
  if (!get(where, name, H5T_FLOAT, H5T_NATIVE_DOUBLE, value))
    *ok = PETSC_FALSE;
}

void SbH5GetInt(hid_t where, const char *name, int64_t *value, PetscBool *ok)
{
  if (!get(where, name, H5T_INTEGER, H5T_NATIVE_INT64, value))
    *ok = PETSC_FALSE;
}

PetscErrorCode SbH5ReadText(SbH5 *h, const char *name, char **text, PetscBool *ok)
{
  const hid_t dataset = H5Dopen2(h->file, name, H5P_DEFAULT);
  PetscBool good = PETSC_FALSE;

  PetscFunctionBeginUser;
  *text = NULL;
  if (dataset >= 0) {
    const hid_t type = H5Dget_type(dataset);

    if (H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) <= 0 &&
        H5Tget_size(type) < 1 << 28 && values_of(H5Dget_space(dataset)) == 1) {
      PetscCall(PetscCalloc1(H5Tget_size(type) + 1, text));
      good = (PetscBool)(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, *text) >= 0);
    }
    (void)H5Tclose(type);
    (void)H5Dclose(dataset);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &good, 1, SB_MPI_BOOL, MPI_LAND, h->comm));
  if (!good)
    PetscCall(PetscFree(*text));
  if (!good)
    *ok = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
