/*
  fields.vtkhdf, and contacts.vtkhdf: an index of fields.h5 in VTK's own format, which ParaView, VTK
  and PyVista open without choosing a reader.

  Every array is a virtual dataset: a list of places in fields.h5, so that nothing is stored twice.
  Bodies are an UnstructuredGrid with one part per mesh (there are several in a run that was
  re-meshed); steps name the part that they show and where their values begin. Their points are the
  field `position`, so that bodies move; frames without it show the rest shape. Contact points are
  PolyData, one part per frame.

  The file is built in memory and replaced as a whole, in a time that grows with the number of
  frames. So it is rebuilt after BETWEEN times the seconds of the last time, at most a twentieth of
  the run, and at its end.

  Reference: VTKHDF file format, version 2.0 (docs.vtk.org, "VTK File Formats"): Steps of
  UnstructuredGrid and PolyData. Symmetric tensors have the order xx yy zz xy yz xz there.
*/
#include "output_impl.h"

#define BETWEEN 20

static void write_attribute(hid_t where, const char *name, hid_t filetype, hid_t memtype,
                            hid_t space, const void *value, PetscBool *ok)
{
  const hid_t attribute = H5Acreate2(where, name, filetype, space, H5P_DEFAULT, H5P_DEFAULT);

  if (H5Awrite(attribute, memtype, value) < 0)
    *ok = PETSC_FALSE;
  (void)H5Aclose(attribute);
  (void)H5Sclose(space);
}

/* Rows of an array in a frame, or in a part for what does not change with time. */
static PetscInt rows_of(SbIndex v, const SbArray *a, PetscInt block)
{
  const SbPart *p = &v->part[a->constant ? block : v->frame[block].part];

  return a->cell ? p->ncell : p->npoint;
}

/* The virtual dataset of an array: all frames or parts in sequence; corners of cells as one
   list. */
static void write_array(SbIndex v, hid_t where, const SbArray *a, PetscBool *ok)
{
  static const hsize_t to_vtk[6] = {0, 3, 5,
                                    1, 4, 2}; // column in fields.h5 of each of xx yy zz xy yz xz
  const hid_t real = a->bytes == 8 ? H5T_IEEE_F64LE : H5T_IEEE_F32LE;
  const hid_t type = a->whole ? H5T_STD_I32LE : real;
  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
  const PetscInt nblock = a->constant ? v->npart : v->nframe;
  const int columns = a->ncomp == 6 ? 6 : 1; // that are placed one by one
  const hsize_t ncomp = (hsize_t)a->ncomp;
  const hsize_t each = ncomp == 4 || ncomp == 10 ? ncomp : 1;
  const double nothing = a->whole ? 0. : NAN;
  hsize_t total[2] = {0, ncomp};
  hsize_t at = 0;
  hid_t space, dataset;

  /* its size, and the value where a frame or a part has none */
  for (PetscInt b = 0; b < nblock; b++)
    total[0] += each * (hsize_t)rows_of(v, a, b);
  space = H5Screate_simple(ncomp > 1 && each == 1 ? 2 : 1, total, NULL);
  (void)H5Pset_obj_track_times(list, 0);
  (void)H5Pset_fill_value(list, H5T_NATIVE_DOUBLE, &nothing);

  /* its pieces */
  for (PetscInt b = 0, i = 0; b < nblock; b++) {
    const hsize_t n = (hsize_t)rows_of(v, a, b);
    const hsize_t extent[2] = {n, ncomp};

    if (i < a->npiece && a->piece[i].block == b) {
      const hid_t source = H5Screate_simple(ncomp > 1 ? 2 : 1, extent, NULL);

      for (int k = 0; k < columns && n; k++) {
        const hsize_t width = columns > 1 ? 1 : ncomp;
        const hsize_t from[2] = {0, columns > 1 ? to_vtk[k] : 0};
        const hsize_t to[2] = {at, (hsize_t)k};
        const hsize_t take[2] = {n, width};
        const hsize_t put[2] = {each * n, width};

        (void)H5Sselect_hyperslab(source, H5S_SELECT_SET, from, NULL, take, NULL);
        (void)H5Sselect_hyperslab(space, H5S_SELECT_SET, to, NULL, put, NULL);
        if (H5Pset_virtual(list, space, "fields.h5", a->piece[i].path, source) < 0)
          *ok = PETSC_FALSE;
      }
      (void)H5Sclose(source);
      i++;
    }
    at += each * n;
  }
  (void)H5Sselect_all(space);
  dataset = H5Dcreate2(where, a->name, type, space, H5P_DEFAULT, list, H5P_DEFAULT);
  if (dataset < 0)
    *ok = PETSC_FALSE;
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  (void)H5Sclose(space);
  (void)H5Pclose(list);
}

/* A dataset [n], or [n][m] when m > 0, of that type, from 64-bit numbers in memory; compressed when
   large. */
static void write_numbers(hid_t where, const char *name, PetscInt n, PetscInt m, hid_t type,
                          const void *values, PetscBool *ok)
{
  const hsize_t size[2] = {(hsize_t)n, (hsize_t)m};
  const hsize_t chunk[1] = {(hsize_t)PetscMin(n, 1 << 16)};
  const hid_t space = H5Screate_simple(m ? 2 : 1, size, NULL);
  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
  const hid_t memtype = type == H5T_IEEE_F64LE ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64;
  hid_t dataset;

  (void)H5Pset_obj_track_times(list, 0);
  if (!m && n > 1024 && H5Zfilter_avail(H5Z_FILTER_DEFLATE) > 0) {
    (void)H5Pset_chunk(list, 1, chunk);
    (void)H5Pset_shuffle(list);
    (void)H5Pset_deflate(list, 1);
  }
  dataset = H5Dcreate2(where, name, type, space, H5P_DEFAULT, list, H5P_DEFAULT);
  if (dataset < 0 || H5Dwrite(dataset, memtype, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
    *ok = PETSC_FALSE;
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  (void)H5Pclose(list);
  (void)H5Sclose(space);
}

/* Cells: their numbers in each part, where their corners begin, and the corners. */
static void write_cells(SbIndex v, hid_t root, int64_t *work, PetscBool *ok)
{
  static const char *const kind[4] = {"Vertices", "Lines", "Polygons", "Strips"};
  PetscInt n = 0;
  PetscInt ncell = 0;
  PetscInt most = 0;

  for (PetscInt p = 0; p < v->npart; p++) {
    ncell += v->part[p].ncell;
    most = PetscMax(most, v->part[p].ncell);
  }
  for (int k = 0; k < (v->points ? 4 : 1); k++) {
    const hid_t group =
      v->points ? H5Gcreate2(root, kind[k], H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT) : root;

    for (PetscInt p = 0; p < v->npart; p++)
      work[p] = k ? 0 : v->part[p].ncell;
    write_numbers(group, "NumberOfCells", v->npart, 0, H5T_STD_I64LE, work, ok);
    for (PetscInt p = 0; p < v->npart; p++)
      work[p] *= v->corners;
    write_numbers(group, "NumberOfConnectivityIds", v->npart, 0, H5T_STD_I64LE, work, ok);
    if (!v->points)
      continue;

    /* one vertex per point: all frames share the numbers 0, 1, 2, ... */
    for (PetscInt c = 0; c <= most; c++)
      work[c] = c;
    write_numbers(group, "Connectivity", k ? 0 : most, 0, H5T_STD_I64LE, work, ok);
    write_numbers(group, "Offsets", k ? 1 : most + 1, 0, H5T_STD_I64LE, work, ok);
    (void)H5Gclose(group);
  }
  if (v->points)
    return;
  for (PetscInt c = 0; c < ncell; c++)
    work[c] = v->corners > 4 ? 24 : 10; // VTK's numbers of tets
  write_numbers(root, "Types", ncell, 0, H5T_STD_U8LE, work, ok);
  for (PetscInt p = 0; p < v->npart; p++)
    for (PetscInt c = 0; c <= v->part[p].ncell; c++)
      work[n++] = v->corners * (int64_t)c;

  /* with the integer type of the corners: ParaView 5.13 accepts no other */
  write_numbers(root, "Offsets", n, 0, H5T_STD_I32LE, work, ok);
}

/* Times of the frames, the part that each of them shows, and where its points, cells and arrays
   begin. */
static void write_steps(SbIndex v, hid_t root, int64_t *work, PetscBool *ok)
{
  const hid_t group = H5Gcreate2(root, "Steps", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const PetscInt kinds = v->points ? 4 : 1;
  const int64_t n = v->nframe;
  double *times = (double *)work;
  hid_t where[2]; /* of arrays at points, of cells */

  write_attribute(group, "NSteps", H5T_STD_I64LE, H5T_NATIVE_INT64, H5Screate(H5S_SCALAR), &n, ok);
  for (PetscInt f = 0; f < v->nframe; f++)
    times[f] = v->frame[f].time;
  write_numbers(group, "Values", v->nframe, 0, H5T_IEEE_F64LE, times, ok);
  for (PetscInt f = 0; f < v->nframe; f++)
    work[f] = 1;
  write_numbers(group, "NumberOfParts", v->nframe, 0, H5T_STD_I64LE, work, ok);
  for (PetscInt f = 0; f < v->nframe; f++)
    work[f] = v->frame[f].part;
  write_numbers(group, "PartOffsets", v->nframe, 0, H5T_STD_I64LE, work, ok);

  /* cells are those of the part; contact points share theirs */
  for (int corners = 0; corners < 2; corners++) {
    for (PetscInt i = 0; i < kinds * v->nframe; i++) {
      work[i] = 0;
      for (PetscInt p = 0; !v->points && p < v->frame[i].part; p++)
        work[i] += (corners ? v->corners : 1) * (int64_t)v->part[p].ncell;
    }
    write_numbers(group, corners ? "ConnectivityIdOffsets" : "CellOffsets", v->nframe, kinds,
                  H5T_STD_I64LE, work, ok);
  }

  /* arrays, one frame or one part behind the other */
  where[0] = H5Gcreate2(group, "PointDataOffsets", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  where[1] = H5Gcreate2(group, "CellDataOffsets", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  for (PetscInt i = 0; i < v->narray; i++) {
    const SbArray *a = &v->array[i];
    int64_t at = 0;

    if (!strcmp(a->name, "Connectivity"))
      continue;
    for (PetscInt f = 0; f < v->nframe; f++) {
      if (a->constant) {
        at = 0;
        for (PetscInt p = 0; p < v->frame[f].part; p++)
          at += rows_of(v, a, p);
      }
      work[f] = at;
      if (!a->constant)
        at += rows_of(v, a, f);
    }
    if (!strcmp(a->name, "Points"))
      write_numbers(group, "PointOffsets", v->nframe, 0, H5T_STD_I64LE, work, ok);
    else
      write_numbers(where[a->cell], a->name, v->nframe, 0, H5T_STD_I64LE, work, ok);
  }
  (void)H5Gclose(where[0]);
  (void)H5Gclose(where[1]);
  (void)H5Gclose(group);
}

void SbVtkhdfWrite(SbIndex v, PetscBool last, char message[SB_MESSAGE_MAX])
{
  const char *kind = v->points ? "PolyData" : "UnstructuredGrid";
  const hsize_t two = 2;
  const int64_t version[2] = {2, 0};
  size_t nwork = 4 * (size_t)v->nframe + (size_t)v->npart + 1;
  size_t size = 0;
  PetscBool ok = PETSC_TRUE;
  int64_t *work;
  const double begun = MPI_Wtime();
  void *text = NULL;
  hid_t file, list, root, type, data[2];

  if (v->nframe == v->nwritten || (!last && begun < v->next))
    return;
  for (PetscInt p = 0; p < v->npart; p++)
    nwork += (size_t)v->part[p].ncell + 1;
  work = (int64_t *)malloc(nwork * sizeof(*work));

  /* made in memory, then replaced in one step */
  list = H5Pcreate(H5P_FILE_ACCESS);
  (void)H5Pset_fapl_core(list, 1 << 16, 0);
  file = work ? H5Fcreate(v->vtkhdf, H5F_ACC_TRUNC, H5P_DEFAULT, list) : -1;
  if (file >= 0) {
    /* what it is */
    root = H5Gcreate2(file, "VTKHDF", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    type = H5Tcopy(H5T_C_S1);
    (void)H5Tset_size(type, strlen(kind));
    (void)H5Tset_strpad(type, H5T_STR_NULLPAD);
    write_attribute(root, "Version", H5T_STD_I64LE, H5T_NATIVE_INT64,
                    H5Screate_simple(1, &two, NULL), version, &ok);
    write_attribute(root, "Type", type, type, H5Screate(H5S_SCALAR), kind, &ok);
    (void)H5Tclose(type);

    /* parts, cells, arrays, steps */
    for (PetscInt p = 0; p < v->npart; p++)
      work[p] = v->part[p].npoint;
    write_numbers(root, "NumberOfPoints", v->npart, 0, H5T_STD_I64LE, work, &ok);
    write_cells(v, root, work, &ok);
    data[0] = H5Gcreate2(root, "PointData", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    data[1] = H5Gcreate2(root, "CellData", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    for (const SbArray *a = v->array; a < v->array + v->narray; a++)
      write_array(
        v, strcmp(a->name, "Points") && strcmp(a->name, "Connectivity") ? data[a->cell] : root, a,
        &ok);
    write_steps(v, root, work, &ok);
    (void)H5Gclose(data[0]);
    (void)H5Gclose(data[1]);
    (void)H5Gclose(root);

    (void)H5Fflush(file, H5F_SCOPE_GLOBAL);
    size = (size_t)PetscMax(H5Fget_file_image(file, NULL, 0), 0);
    text = malloc(size + 1);
    ok = (PetscBool)(ok && text && H5Fget_file_image(file, text, size) == (ssize_t)size);
    (void)H5Fclose(file);
  }
  if (file < 0 || !ok)
    SbFormat(SB_MESSAGE_MAX, message, "cannot write %s: HDF5 fails to make it in memory",
             v->vtkhdf);
  else
    SbFileReplace(v->vtkhdf, text, size, message);
  v->nwritten = v->nframe;
  v->next = MPI_Wtime() + BETWEEN * (MPI_Wtime() - begun);
  free(text);
  free(work);
  (void)H5Pclose(list);
}
