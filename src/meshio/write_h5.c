/*
  write_h5.c - writer of supple's own mesh, HDF5, and its .xmf for ParaView. Layout:
  docs/reference/meshes.md.

  Written by one rank in one piece, without compression: reading is limited by the disk only.
*/
#include <errno.h>
#include <stdarg.h>
#include <unistd.h>
#include "meshio_impl.h"

const char *const SbH5Items[4] = {"point", "line", "triangle", "cell"};

/* An open file; remembers the first failed call. */
typedef struct {
  hid_t file;
  PetscBool failed;
} H5;

/* Records a failure; invalid HDF5 handles are negative, and further calls with them fail too. */
static hid_t keep(H5 *h, hid_t id)
{
  if (id < 0)
    h->failed = PETSC_TRUE;
  return id;
}

static void write_array(H5 *h, const char *name, int ncomp, size_t n, hid_t filetype, hid_t memtype,
                        const void *data)
{
  const hsize_t size[2] = {(hsize_t)n, (hsize_t)ncomp};
  const hid_t space = keep(h, H5Screate_simple(ncomp > 1 ? 2 : 1, size, NULL));
  const hid_t set =
    keep(h, H5Dcreate2(h->file, name, filetype, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));

  if (n)
    (void)keep(h, H5Dwrite(set, memtype, H5S_ALL, H5S_ALL, H5P_DEFAULT, data));
  if (set >= 0)
    (void)H5Dclose(set);
  if (space >= 0)
    (void)H5Sclose(space);
}

/* Writes an array of PetscInt as 32-bit integers. */
static void write_ints(H5 *h, const char *name, int ncomp, size_t n, const PetscInt data[])
{
  write_array(h, name, ncomp, n, H5T_STD_I32LE,
              sizeof(PetscInt) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32, data);
}

PetscErrorCode SbWrite_H5(const SbImport *im, const char *path)
{
  static const char *const groups[3] = {"/mesh", "/groups", "/tag_sets"};
  H5 h = {-1, PETSC_FALSE};
  char array[64];
  const int version = im->nmiddle.n ? 2 : 1;
  hid_t space, mark;
  const hid_t text = H5Tcopy(H5T_C_S1);
  char(*title)[SB_GROUP_MAX];
  PetscInt *dim, *end;
  int64_t *number;
  PetscReal *off;

  PetscFunctionBeginUser;
  PetscCheck(im->nvert <= INT32_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: more vertices than the 32 bits of an .h5 mesh can number", im->where);
  (void)H5Eset_auto2(H5E_DEFAULT, NULL,
                     NULL); /* HDF5's error stack is replaced by one line of ours */
  (void)unlink(path);       /* a link is not followed */
  errno = 0;
  h.file = keep(&h, H5Fcreate(path, H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT));
  PetscCheck(!h.failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", path,
             errno ? strerror(errno) : "HDF5 cannot make it");

  // layout version
  space = keep(&h, H5Screate(H5S_SCALAR));
  mark =
    keep(&h, H5Acreate2(h.file, "supple_mesh", H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT));
  (void)keep(&h, H5Awrite(mark, H5T_NATIVE_INT, &version));
  if (mark >= 0)
    (void)H5Aclose(mark);
  if (space >= 0)
    (void)H5Sclose(space);
  for (int k = 0; k < 3; k++) {
    const hid_t group =
      keep(&h, H5Gcreate2(h.file, groups[k], H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));

    if (group >= 0)
      (void)H5Gclose(group);
  }
  write_array(&h, "/mesh/x", 3, (size_t)im->nvert, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, im->x);

  // simplices and their tag sets
  for (int d = 3; d >= 0; d--) {
    const SbItems *item = &im->item[d];

    if (!item->n && d < 3)
      continue;
    (void)snprintf(array, sizeof(array), "/mesh/%ss", SbH5Items[d]);
    write_ints(&h, array, d + 1, (size_t)item->n, item->vert);
    (void)snprintf(array, sizeof(array), "/mesh/%s_tags", SbH5Items[d]);
    write_ints(&h, array, 1, (size_t)item->n, item->tags);
  }

  // curved edges
  if (im->nmiddle.n) {
    PetscCall(PetscMalloc2(2 * (size_t)im->nmiddle.n, &end, 3 * (size_t)im->nmiddle.n, &off));
    for (PetscInt i = 0; i < im->nmiddle.n; i++) {
      PetscCall(PetscArraycpy(end + 2 * i, im->middle[i].end, 2));
      PetscCall(PetscArraycpy(off + 3 * i, im->middle[i].off, 3));
    }
    write_ints(&h, "/mesh/curved_edges", 2, (size_t)im->nmiddle.n, end);
    write_array(&h, "/mesh/edge_offsets", 3, (size_t)im->nmiddle.n, H5T_IEEE_F64LE,
                H5T_NATIVE_DOUBLE, off);
    PetscCall(PetscFree2(end, off));
  }

  // groups and tag sets
  PetscCall(PetscCalloc3(im->ngroup, &title, im->ngroup, &dim, im->ngroup, &number));
  for (PetscInt g = 0; g < im->ngroup; g++) {
    (void)snprintf(title[g], SB_GROUP_MAX, "%s", im->group[g].name);
    dim[g] = im->group[g].dim;
    number[g] = im->group[g].tag;
  }
  (void)H5Tset_size(text, SB_GROUP_MAX);
  write_array(&h, "/groups/name", 1, (size_t)im->ngroup, text, text, title);
  write_ints(&h, "/groups/dim", 1, (size_t)im->ngroup, dim);
  write_array(&h, "/groups/number", 1, (size_t)im->ngroup, H5T_STD_I64LE, H5T_NATIVE_INT64, number);
  write_ints(&h, "/tag_sets/start", 1, (size_t)im->ntags + 1, im->tags_start);
  write_ints(&h, "/tag_sets/group", 1, (size_t)im->tags_start[im->ntags], im->tags_group);
  (void)H5Tclose(text);
  PetscCall(PetscFree3(title, dim, number));
  (void)keep(&h, H5Fclose(h.file));
  PetscCheck(!h.failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
             "%s cannot be written: %s; is there room on the disk?", path,
             errno ? strerror(errno) : "HDF5 failed");
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbXdmfArray(FILE *file, PetscInt64 n, int ncomp, const char *type, int bytes,
                 const char *format, ...)
{
  char components[16] = "";
  va_list args;

  if (ncomp > 1)
    (void)snprintf(components, sizeof(components), " %d", ncomp);
  (void)fprintf(file,
                "<DataItem Dimensions=\"%" PetscInt64_FMT
                "%s\" NumberType=\"%s\" Precision=\"%d\" Format=\"HDF\">",
                n, components, type, bytes);
  va_start(args, format);
  (void)vfprintf(file, format, args);
  va_end(args);
  (void)fputs("</DataItem>", file);
}

/* Writes one grid: the simplices of a dimension, coloured by tag set. */
static void write_grid(FILE *file, const SbImport *im, int dim, const char *h5)
{
  static const char *const grid[4] = {"points", "lines", "surface", "tets"};
  static const char *const kind[4] = {"Polyvertex\" NodesPerElement=\"1",
                                      "Polyline\" NodesPerElement=\"2", "Triangle", "Tetrahedron"};
  const PetscInt n = im->item[dim].n;

  (void)fprintf(file,
                "<Grid Name=\"%s\" GridType=\"Uniform\">\n<Topology TopologyType=\"%s\" "
                "NumberOfElements=\"%" PetscInt_FMT "\">",
                grid[dim], kind[dim], n);
  SbXdmfArray(file, n, dim + 1, "Int", 4, "%s:/mesh/%ss", h5, SbH5Items[dim]);
  (void)fputs("</Topology>\n<Geometry GeometryType=\"XYZ\">", file);
  SbXdmfArray(file, im->nvert, 3, "Float", 8, "%s:/mesh/x", h5);
  (void)fputs("</Geometry>\n<Attribute Name=\"tag_set\" AttributeType=\"Scalar\" Center=\"Cell\">",
              file);
  SbXdmfArray(file, n, 1, "Int", 4, "%s:/mesh/%s_tags", h5, SbH5Items[dim]);
  (void)fputs("</Attribute>\n</Grid>\n", file);
}

void SbWrite_Xdmf(const SbImport *im, const char *h5, FILE *file)
{
  const char *slash = strrchr(h5, '/');
  const char *name = slash ? slash + 1 : h5;

  (void)fprintf(file, "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n");

  // names of the groups of each tag set
  for (PetscInt t = 1; t < im->ntags; t++) {
    (void)fprintf(file, "<Information Name=\"tag_set %d\" Value=\"", (int)t);
    for (PetscInt k = im->tags_start[t]; k < im->tags_start[t + 1]; k++) {
      if (k > im->tags_start[t])
        (void)fprintf(file, ", ");
      for (const char *text = im->group[im->tags_group[k]].name; *text; text++)
        (void)fprintf(file, strchr("<>&\"", *text) ? "&#%d;" : "%c", *text);
    }
    (void)fprintf(file, "\"/>\n");
  }
  if (im->item[3].n)
    write_grid(file, im, 3, name);
  if (im->item[2].n)
    write_grid(file, im, 2, name);
  (void)fprintf(file, "</Domain>\n</Xdmf>\n");
}
