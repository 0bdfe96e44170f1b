/*
  h5.h - an HDF5 file generated from the bytes of a fuzzer, for the reader of meshes in HDF5.

  The bytes are not the file itself: HDF5 1.10 reads out of bounds with damaged containers
  (H5Aexists() and others, found within seconds), which this program cannot repair. They define the
  arrays in a valid file, with their types, shapes and values:

    layout, step          bit 0: a mesh file, bits 1 to 2: its version less one; step to be read,
    signed then arrays           name, type, number of dimensions, dimensions, values; the last one
    of a name counts

  A dimension is one byte, from 250 on an invalid size; a value one signed byte; 127 and -128 stand
  for the largest and the smallest number, or NaN and infinity. Missing values are zero.
*/
#pragma once
#include <hdf5.h>
#include <math.h>
#include <string.h>

typedef struct {
  const unsigned char *at, *end;
} FuzzBytes;

static inline int fuzz_byte(FuzzBytes *b)
{
  return b->at < b->end ? *b->at++ : 0;
}

static inline int fuzz_signed(FuzzBytes *b)
{
  const int byte = fuzz_byte(b);

  return byte < 128 ? byte : byte - 256;
}

static const char *const fuzz_h5_names[] = {
  "/mesh/x",
  "/mesh/cells",
  "/mesh/cell_tags",
  "/mesh/triangles",
  "/mesh/triangle_tags",
  "/mesh/lines",
  "/mesh/line_tags",
  "/mesh/points",
  "/mesh/point_tags",
  "/groups/name",
  "/groups/dim",
  "/groups/number",
  "/tag_sets/start",
  "/tag_sets/group",
  "/mesh/body",
  "/mesh/vertices",
  "/step/0000/000003/displacement",
  "/step/0001/000120/displacement",
  "/step/0001",
  "/step/000003",
  "/mesh",
  "/mesh/curved_edges",
  "/mesh/edge_offsets",
  "/mesh/cells10",
  "/mesh/parent",
};
enum {
  FUZZ_H5_NAMES = (int)(sizeof(fuzz_h5_names) / sizeof(fuzz_h5_names[0]))
};
enum {
  FUZZ_H5_VALUES = 4096
}; /* arrays of more are left without */

/* int32, double, int64, text of 6, float, uint8, text of any length, uint64; 8 and up: in
   compressed chunks. */
static inline hid_t fuzz_h5_type(int kind)
{
  const hid_t types[] = {H5T_NATIVE_INT32, H5T_NATIVE_DOUBLE, H5T_NATIVE_INT64, H5T_C_S1,
                         H5T_NATIVE_FLOAT, H5T_NATIVE_UINT8,  H5T_C_S1,         H5T_NATIVE_UINT64};
  const hid_t type = H5Tcopy(types[kind % 8]);

  if (kind % 8 == 3)
    (void)H5Tset_size(type, 6);
  if (kind % 8 == 6)
    (void)H5Tset_size(type, H5T_VARIABLE);
  return type;
}

static inline hsize_t fuzz_h5_dimension(int byte)
{
  static const hsize_t lies[] = {1000,
                                 100000000,
                                 (hsize_t)1 << 31,
                                 ((hsize_t)1 << 32) + 4,
                                 (hsize_t)1 << 40,
                                 ((hsize_t)1 << 62) + 3};

  return byte < 250 ? (hsize_t)byte : lies[byte - 250];
}

/* Values of a file's type, by way of doubles or whole numbers in memory. */
static inline void fuzz_h5_values(FuzzBytes *b, hid_t set, int kind, hsize_t n)
{
  static double real[FUZZ_H5_VALUES];
  static long long whole[FUZZ_H5_VALUES];
  static char text[6 * FUZZ_H5_VALUES];

  if (kind % 8 == 6)
    return;
  for (hsize_t i = 0; i < n; i++) {
    const int v = fuzz_signed(b);

    real[i] = v == 127 ? NAN : v == -128 ? INFINITY : v;
    whole[i] = v == 127 ? INT64_MAX : v == -128 ? INT64_MIN : v;
    for (int k = 0; k < 6; k++)
      text[6 * i + (hsize_t)k] = k < 5 ? (char)v : 0;
  }
  if (kind % 8 == 3) {
    const hid_t type = fuzz_h5_type(3);

    (void)H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text);
    (void)H5Tclose(type);
  } else if (kind % 8 == 1 || kind % 8 == 4)
    (void)H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, real);
  else
    (void)H5Dwrite(set, H5T_NATIVE_LLONG, H5S_ALL, H5S_ALL, H5P_DEFAULT, whole);
}

/* Puts an array of this name into a file, in place of one that is there. */
static inline void fuzz_h5_put(FuzzBytes *b, hid_t file, const char *name)
{
  const int kind = fuzz_byte(b) % 16;
  const int ndim = fuzz_byte(b) % 4;
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  const hid_t type = fuzz_h5_type(kind);
  hsize_t size[3] = {1, 1, 1};
  hsize_t n = 1;
  hsize_t chunk[3];
  hid_t space, set;

  for (int d = 0; d < ndim; d++)
    size[d] = fuzz_h5_dimension(fuzz_byte(b));
  for (int d = 0; d < ndim; d++)
    chunk[d] = size[d] < 1 ? 1 : size[d] < 16 ? size[d] : 16;
  for (int d = 0; d < ndim; d++)
    n = n > FUZZ_H5_VALUES ? n : n * (size[d] < 5000 ? size[d] : 5000);
  (void)H5Pset_create_intermediate_group(links, 1);
  if (kind >= 8 && ndim) {
    (void)H5Pset_chunk(creation, ndim, chunk);
    (void)H5Pset_deflate(creation, 1);
  }
  space = ndim ? H5Screate_simple(ndim, size, NULL) : H5Screate(H5S_SCALAR);
  (void)H5Ldelete(file, name, H5P_DEFAULT);
  set = H5Dcreate2(file, name, type, space, links, creation, H5P_DEFAULT);
  if (set >= 0 && n <= FUZZ_H5_VALUES)
    fuzz_h5_values(b, set, kind, n);
  if (set >= 0)
    (void)H5Dclose(set);
  if (space >= 0)
    (void)H5Sclose(space);
  (void)H5Tclose(type);
  (void)H5Pclose(creation);
  (void)H5Pclose(links);
}

/* Names of bodies, as a run writes them. */
static inline void fuzz_h5_bodies(hid_t file)
{
  const hid_t space = H5Screate(H5S_SCALAR);
  const hid_t type = fuzz_h5_type(3);
  const hid_t a =
    H5Acreate_by_name(file, "/mesh", "bodies", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);

  if (a >= 0)
    (void)H5Awrite(a, type, "b,cow");
  if (a >= 0)
    (void)H5Aclose(a);
  (void)H5Tclose(type);
  (void)H5Sclose(space);
}

/* Makes the file; returns the step to read. */
static inline int fuzz_h5_write(const char *path, const char *data, size_t n)
{
  FuzzBytes b = {(const unsigned char *)data, (const unsigned char *)data + n};
  const int layout = fuzz_byte(&b);
  const int step = fuzz_signed(&b);
  hid_t file;

  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  if (file < 0)
    return step;
  while (b.at < b.end)
    fuzz_h5_put(&b, file, fuzz_h5_names[fuzz_byte(&b) % FUZZ_H5_NAMES]);
  if (layout & 1) {
    const int version = 1 + (layout >> 1) % 4;
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t a =
      H5Acreate2(file, "supple_mesh", H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT);

    (void)H5Awrite(a, H5T_NATIVE_INT, &version);
    (void)H5Aclose(a);
    (void)H5Sclose(space);
  } else
    fuzz_h5_bodies(file);
  (void)H5Fclose(file);
  return step;
}
