/*
  import_h5.c - reader of HDF5: supple's own meshes (layout in write_h5.c) and the output of a run,
  fields.h5.

  Both have /mesh/x and /mesh/cells. A mesh has groups; in the output of a run each body,
  /mesh/body, becomes a group of tets. For P2 bodies /mesh/cells10 has the nodes of the tets,
  /mesh/cells has the linear tets into which they are subdivided, and /mesh/parent the P2 tet of
  each. If each tet of the output has its own points (-output_discontinuous), /mesh/vertices is the
  vertex of each point: positions are averaged there. For a given step, its displacement is added.

  An .xmf file refers to the .h5 file of the mesh.

  Of a mesh file a block of rows of each array under /mesh may be read: in parallel one by each rank
  (mesh/slab.c).

  Files are not trusted: shape and type of every array and the range of every index are checked, and
  no array is allocated that is larger than the file can hold (uncompressed, as written here, at
  most the file size; compressed by others, at most a thousand times that).
*/
#include <stdlib.h>
#include <strings.h>
#include "meshio_impl.h"

typedef struct {
  SbImport *im;
  hid_t file;
  size_t bytes;   /* file size in bytes */
  char frame[64]; /* HDF5 group of the wanted step; "": rest positions */
  char mesh[32]; /* path that replaces "/mesh" in names: "/mesh", after re-meshing "/mesh_000123" */
  PetscInt part, nparts; /* block to read, and number of blocks; nparts 0: all rows */
  PetscInt nvert;        /* number of vertices in the file */
} File;

#define H5_ERROR(f, ...)                                                                    \
  do {                                                                                      \
    char sb_text[512];                                                                      \
    (void)snprintf(sb_text, sizeof(sb_text), __VA_ARGS__);                                  \
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: %s", (f)->im->where, sb_text); \
  } while (0)

/* Full path of an object in the mesh of the wanted step. */
static void path_of(const File *f, const char *name, char path[256])
{
  const PetscBool mesh = (PetscBool)!strncmp(name, "/mesh/", strlen("/mesh/"));

  (void)snprintf(path, 256, "%s%s", mesh ? f->mesh : "", mesh ? name + strlen("/mesh") : name);
}

/* Whether an object exists; without a group on its path HDF5 fails. */
static PetscBool is_there(const File *f, const char *name)
{
  char path[256];

  path_of(f, name, path);
  return (PetscBool)(H5Lexists(f->file, path, H5P_DEFAULT) > 0);
}

/* Expected type and shape of an array, then the actual ones. */
typedef struct {
  const char *name;
  H5T_class_t klass;
  hsize_t ncomp;   /* number of columns; 1: a list */
  int64_t bound;   /* integers are in [0, bound); -1: any 64-bit integer */
  PetscBool block; /* only the rows of the wanted block are read */
  hid_t set, type;
  hsize_t n;    /* number of rows to read */
  size_t width; /* bytes per value in the file */
  SbSlabRows rows;
} Array;

/* Opens an array and checks its type and shape. */
static PetscErrorCode open_array(const File *f, Array *a)
{
  hsize_t size[2] = {0, 1};
  hid_t space, plist;
  int ndim;
  PetscBool packed;
  const char *holds = "texts of one length";
  double want;
  char path[256];

  PetscFunctionBeginUser;
  path_of(f, a->name, path);
  a->set = is_there(f, a->name) ? H5Dopen2(f->file, path, H5P_DEFAULT) : -1;
  if (a->set < 0)
    H5_ERROR(f, "has no array %s; it is no mesh of supple, or damaged", a->name);
  a->type = H5Dget_type(a->set);
  a->width = H5Tget_size(a->type);
  space = H5Dget_space(a->set);
  ndim = H5Sget_simple_extent_ndims(space);
  if (ndim == 1 || ndim == 2)
    (void)H5Sget_simple_extent_dims(space, size, NULL);
  (void)H5Sclose(space);
  plist = H5Dget_create_plist(a->set);
  packed = (PetscBool)(plist >= 0 && H5Pget_nfilters(plist) > 0);
  if (plist >= 0)
    (void)H5Pclose(plist);
  if (a->klass == H5T_FLOAT)
    holds = "real numbers";
  else if (a->klass == H5T_INTEGER)
    holds = "whole numbers";
  if (H5Tget_class(a->type) != a->klass ||
      (a->klass == H5T_STRING && H5Tis_variable_str(a->type) > 0))
    H5_ERROR(f, "%s does not hold %s", a->name, holds);
  if ((ndim != 1 && ndim != 2) || size[1] != a->ncomp)
    H5_ERROR(f, "%s has %d dimensions and %llu columns; expected %llu columns", a->name, ndim,
             (unsigned long long)size[1], (unsigned long long)a->ncomp);
  if (size[0] > (hsize_t)PETSC_MAX_INT / 8)
    H5_ERROR(f, "%s has %llu rows, more than this build can number", a->name,
             (unsigned long long)size[0]);

  // an array larger than the file can hold is an error, before anything is allocated
  want = (double)size[0] * (double)a->ncomp * (double)a->width;
  if (want > (packed ? 1000. : 1.) * (double)f->bytes)
    H5_ERROR(
      f,
      "%s announces %llu x %llu numbers, more than the %zu bytes of the file hold; it is damaged",
      a->name, (unsigned long long)size[0], (unsigned long long)a->ncomp, f->bytes);

  // rows of the block
  a->rows = (SbSlabRows){(PetscInt)size[0], (PetscInt)size[0], 0};
  a->n = size[0];
  if (a->block && f->nparts) {
    a->rows.block = a->rows.N / f->nparts + 1;
    a->rows.first = (PetscInt)PetscMin((PetscInt64)a->rows.N, (PetscInt64)a->rows.block * f->part);
    a->n = (hsize_t)PetscMin(a->rows.block, a->rows.N - a->rows.first);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the rows of an open array; an error names the position of a value out of range. */
static PetscErrorCode read_values(const File *f, const Array *a, void *values)
{
  const PetscBool number = (PetscBool)(a->bound >= 0 && sizeof(PetscInt) == 4);
  hid_t type = a->type;
  const hsize_t first[2] = {(hsize_t)a->rows.first, 0};
  const hsize_t n[2] = {a->n, a->ncomp};
  herr_t status = 0;

  PetscFunctionBeginUser;
  if (a->klass == H5T_FLOAT)
    type = H5T_NATIVE_DOUBLE;
  else if (a->klass == H5T_INTEGER)
    type = number ? H5T_NATIVE_INT32 : H5T_NATIVE_INT64;
  if (a->n) {
    const hid_t in_file = H5Dget_space(a->set);
    const hid_t in_memory = H5Screate_simple(H5Sget_simple_extent_ndims(in_file), n, NULL);

    status = H5Sselect_hyperslab(in_file, H5S_SELECT_SET, first, NULL, n, NULL);
    if (status >= 0)
      status = H5Dread(a->set, type, in_memory, in_file, H5P_DEFAULT, values);
    (void)H5Sclose(in_file);
    (void)H5Sclose(in_memory);
  }
  if (status < 0)
    H5_ERROR(f, "%s cannot be read; the file is damaged, write or copy it again", a->name);
  for (size_t i = 0; i < (size_t)(a->n * a->ncomp) && a->klass != H5T_STRING; i++) {
    const size_t row = (size_t)a->rows.first + i / (size_t)a->ncomp + 1;

    if (a->klass == H5T_FLOAT && !isfinite(((PetscReal *)values)[i]))
      H5_ERROR(f, "%s holds no finite number in row %zu", a->name, row);
    if (a->klass == H5T_FLOAT || a->bound < 0)
      continue;
    if (((PetscInt *)values)[i] < 0 || ((PetscInt *)values)[i] >= a->bound)
      H5_ERROR(f, "%s holds %lld in row %zu; it must be from 0 to %lld", a->name,
               (long long)((PetscInt *)values)[i], row, (long long)a->bound - 1);
  }
  (void)H5Tclose(a->type);
  (void)H5Dclose(a->set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens and reads an array into scratch memory. n: number of rows that it must have; -1: any,
   returned. */
static PetscErrorCode read_array(const File *f, Array *a, PetscInt *n, void *values)
{
  PetscFunctionBeginUser;
  PetscCall(open_array(f, a));
  if (*n >= 0 && *n != (PetscInt)a->n)
    H5_ERROR(
      f, "%s has %lld rows; %lld are needed to fit /mesh/cells, /mesh/x or what else it describes",
      a->name, (long long)a->n, (long long)*n);
  *n = (PetscInt)a->n;
  *(void **)values = NULL;
  PetscCall(SbImportScratch(f->im, (size_t)(a->n * a->ncomp) * PetscMax(a->width, 8), values));
  PetscCall(read_values(f, a, *(void **)values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an array of integers in [0, bound), as PetscInt; bound -1: any, as int64_t. */
static PetscErrorCode read_table(const File *f, const char *name, hsize_t ncomp, int64_t bound,
                                 PetscInt *n, void *values)
{
  return read_array(f, &(Array){.name = name, .klass = H5T_INTEGER, .ncomp = ncomp, .bound = bound},
                    n, values);
}

/* Reads the simplices of one dimension, without groups. */
static PetscErrorCode read_items(const File *f, int dim, const char *name)
{
  SbItems *item = &f->im->item[dim];
  Array a = {.name = name,
             .klass = H5T_INTEGER,
             .ncomp = (hsize_t)dim + 1,
             .bound = f->nvert,
             .block = PETSC_TRUE};

  PetscFunctionBeginUser;
  PetscCall(open_array(f, &a));
  PetscCall(SbImportSetItems(f->im, dim, (PetscInt)a.n));
  PetscCall(read_values(f, &a, item->vert));
  for (PetscInt i = 0; i < item->n; i++)
    item->number[i] += a.rows.first;
  PetscCall(PetscArrayzero(item->tags, item->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the curved edges: vertices, and offsets of the edge nodes from the midpoints; layout 2
   only. */
static PetscErrorCode read_curved(const File *f, int layout)
{
  SbImport *im = f->im;
  Array edges = {.name = "/mesh/curved_edges",
                 .klass = H5T_INTEGER,
                 .ncomp = 2,
                 .bound = f->nvert,
                 .block = PETSC_TRUE};
  Array off = {.name = "/mesh/edge_offsets", .klass = H5T_FLOAT, .ncomp = 3, .block = PETSC_TRUE};
  PetscInt n = -1;
  PetscInt noff = -1;
  PetscInt *end;
  PetscReal *x;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    const char *name = k ? off.name : edges.name;

    if (is_there(f, name) != (layout == 2))
      H5_ERROR(
        f,
        "is a mesh of layout %d and has %s %s; layout 2 has it, layout 1 has not; write it again",
        layout, layout == 2 ? "no array" : "the array", name);
  }
  if (layout == 1)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(read_array(f, &edges, &n, &end));
  PetscCall(read_array(f, &off, &noff, &x));
  if (edges.rows.N != off.rows.N)
    H5_ERROR(f, "%s has %lld rows; %lld are needed to fit %s", off.name, (long long)off.rows.N,
             (long long)edges.rows.N, edges.name);
  PetscCall(PetscMalloc1(n, &im->middle));
  im->nmiddle = (SbCount){n, n};
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt a = end[2 * i];
    const PetscInt b = end[2 * i + 1];
    const PetscInt row = edges.rows.first + i + 1;

    if (a == b)
      H5_ERROR(f, "%s holds %lld twice in row %lld; an edge has two vertices", edges.name,
               (long long)a, (long long)row);
    im->middle[i] = (SbMiddle){.end = {PetscMin(a, b), PetscMax(a, b)},
                               .node = -1 - row,
                               .off = {x[3 * i], x[3 * i + 1], x[3 * i + 2]}};
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Groups of a mesh file. */
static PetscErrorCode read_own(const File *f)
{
  PetscInt nset;
  PetscInt *map = NULL;
  PetscInt *set;
  PetscInt ngroup = -1;
  PetscInt nmember = -1;
  PetscInt nstart = -1;
  PetscInt *group = NULL;
  PetscInt *member, *start, *dim;
  int64_t *number;
  char *title;
  Array text = {.name = "/groups/name", .klass = H5T_STRING, .ncomp = 1};

  PetscFunctionBeginUser;

  // group[] and map[]: numbers of the file's groups and tag sets in the import
  PetscCall(read_array(f, &text, &ngroup, &title));
  PetscCall(read_table(f, "/groups/dim", 1, 4, &ngroup, &dim));
  PetscCall(read_table(f, "/groups/number", 1, -1, &ngroup, &number));
  PetscCall(SbImportScratch(f->im, (size_t)ngroup * sizeof(*group), &group));
  for (PetscInt i = 0; i < ngroup; i++) {
    char name[SB_GROUP_MAX];

    (void)snprintf(name, sizeof(name), "%.*s", (int)PetscMin(text.width, sizeof(name) - 1),
                   title + text.width * (size_t)i);
    PetscCall(SbImportGroup(f->im, dim[i], number[i], name[0] ? name : NULL, &group[i]));
  }
  PetscCall(read_table(f, "/tag_sets/group", 1, ngroup, &nmember, &member));
  PetscCall(read_table(f, "/tag_sets/start", 1, (int64_t)nmember + 1, &nstart, &start));
  nset = PetscMax(nstart - 1, 0);
  PetscCall(SbImportScratch(f->im, (size_t)nset * sizeof(*map), &map));
  for (PetscInt i = 0; i < nmember; i++)
    member[i] = group[member[i]];
  for (PetscInt t = 0; t < nset; t++) {
    if (start[t] > start[t + 1])
      H5_ERROR(f, "/tag_sets/start falls from %lld to %lld; the file is damaged",
               (long long)start[t], (long long)start[t + 1]);
    PetscCall(
      SbImportTagSet(f->im, start[t + 1] - start[t], nmember ? member + start[t] : NULL, &map[t]));
  }
  for (int d = 0; d < 4; d++) {
    SbItems *item = &f->im->item[d];
    char items[32], tags[32];
    Array a = {.name = tags, .klass = H5T_INTEGER, .ncomp = 1, .bound = nset, .block = PETSC_TRUE};

    (void)snprintf(items, sizeof(items), "/mesh/%ss", SbH5Items[d]);
    (void)snprintf(tags, sizeof(tags), "/mesh/%s_tags", SbH5Items[d]);
    if (d < 3 && !is_there(f, items))
      continue;
    if (d < 3)
      PetscCall(read_items(f, d, items));
    PetscCall(read_array(f, &a, &item->n, &set));
    for (PetscInt i = 0; i < item->n; i++)
      item->tags[i] = map[set[i]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the frames of a run. */
static herr_t visit_frame(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  SbH5Frames *s = (SbH5Frames *)ctx;
  const int64_t step = strtoll(name, NULL, 10);

  (void)where, (void)info;
  if (!s->n++)
    s->first = step;
  s->first = PetscMin(s->first, step);
  if (s->wanted == step || (s->wanted < 0 && (s->n == 1 || step >= s->last)))
    (void)snprintf(s->found, sizeof(s->found), "/step/%.20s/%.20s", s->hundred, name);
  s->last = s->n == 1 ? step : PetscMax(s->last, step);
  return 0;
}

static herr_t visit_hundred(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  const hid_t group = H5Gopen2(where, name, H5P_DEFAULT);

  (void)info;
  if (group < 0)
    return 0;
  ((SbH5Frames *)ctx)->hundred = name;
  (void)H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, visit_frame, ctx);
  (void)H5Gclose(group);
  return 0;
}

void SbH5FindFrame(hid_t file, SbH5Frames *frames)
{
  if (H5Lexists(file, "step", H5P_DEFAULT) > 0)
    (void)H5Literate_by_name(file, "step", H5_INDEX_NAME, H5_ITER_INC, NULL, visit_hundred, frames,
                             H5P_DEFAULT);
}

/* Opens an attribute of one value; negative if there is none. */
static hid_t open_attribute(hid_t file, const char *object, const char *name)
{
  hid_t attribute, space;
  hssize_t n;

  if (H5Aexists_by_name(file, object, name, H5P_DEFAULT) <= 0)
    return -1;
  attribute = H5Aopen_by_name(file, object, name, H5P_DEFAULT, H5P_DEFAULT);
  space = attribute < 0 ? -1 : H5Aget_space(attribute);
  n = space < 0 ? -1 : H5Sget_simple_extent_npoints(space);
  if (space >= 0)
    (void)H5Sclose(space);
  if (n == 1 || attribute < 0)
    return attribute;
  (void)H5Aclose(attribute);
  return -1;
}

/* Value of an integer attribute; 0 if there is none. */
static int number_of(hid_t file, const char *object, const char *name)
{
  const hid_t attribute = open_attribute(file, object, name);
  int value = 0;

  if (attribute >= 0 && H5Aread(attribute, H5T_NATIVE_INT, &value) < 0)
    value = 0;
  if (attribute >= 0)
    (void)H5Aclose(attribute);
  return value;
}

PetscErrorCode SbH5BodyNames(hid_t file, const char *mesh, char **names)
{
  const hid_t attribute = open_attribute(file, mesh, "bodies");
  const hid_t group = attribute < 0 ? H5Gopen2(file, mesh, H5P_DEFAULT) : -1;
  const hid_t dataset = group >= 0 && H5Lexists(group, "bodies", H5P_DEFAULT) > 0
                          ? H5Dopen2(group, "bodies", H5P_DEFAULT)
                          : -1;
  const hid_t space = dataset >= 0 ? H5Dget_space(dataset) : -1;
  const hid_t object = attribute >= 0 ? attribute : dataset;
  hid_t type = -1;
  PetscBool text;

  PetscFunctionBeginUser;
  if (object >= 0)
    type = attribute >= 0 ? H5Aget_type(object) : H5Dget_type(object);
  text = (PetscBool)(type >= 0 && H5Tget_class(type) == H5T_STRING &&
                     H5Tis_variable_str(type) <= 0 && H5Tget_size(type) < 1 << 24);
  PetscCall(PetscCalloc1(text ? H5Tget_size(type) + 1 : 1, names));
  if (text && attribute >= 0)
    (void)H5Aread(attribute, type, *names);
  else if (text && H5Sget_simple_extent_npoints(space) == 1)
    (void)H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, *names);
  if (type >= 0)
    (void)H5Tclose(type);
  if (attribute >= 0)
    (void)H5Aclose(attribute);
  if (space >= 0)
    (void)H5Sclose(space);
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  if (group >= 0)
    (void)H5Gclose(group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes each body a group of tets. */
static PetscErrorCode read_bodies(const File *f)
{
  SbImport *im = f->im;
  PetscInt *body;
  PetscInt nbody = 0;
  PetscInt *tags;
  char *names, *name, *rest;

  PetscFunctionBeginUser;
  if (!is_there(f, "/mesh/body"))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(read_table(f, "/mesh/body", 1, 1 << 16, &im->item[3].n, &body));
  for (PetscInt c = 0; c < im->item[3].n; c++)
    nbody = PetscMax(nbody, body[c] + 1);

  // names of the bodies; old files have none
  PetscCall(SbH5BodyNames(f->file, f->mesh, &names));
  rest = names;
  PetscCall(PetscMalloc1(nbody, &tags));
  for (PetscInt b = 0; b < nbody; b++) {
    char plain[32];

    name = strsep(&rest, ",");
    (void)snprintf(plain, sizeof(plain), "body_%d", (int)b + 1);
    PetscCall(SbImportTagsAlone(im, 3, b + 1, name && name[0] ? name : plain, &tags[b]));
  }
  for (PetscInt c = 0; c < im->item[3].n; c++)
    im->item[3].tags[c] = tags[body[c]];
  PetscCall(PetscFree(tags));
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the linear tets of P2 bodies by the P2 tets, with edge nodes. at[f->nvert]: vertex of
   each point of the file; NULL: identity. */
static PetscErrorCode read_quadratic(const File *f, const PetscInt at[])
{
  SbItems *item = &f->im->item[3];
  PetscInt n = -1;
  PetscInt *parent;
  PetscInt last = -1;
  int64_t *node;

  PetscFunctionBeginUser;
  PetscCall(read_table(f, "/mesh/cells10", 10, -1, &n, &node));
  if (is_there(f, "/mesh/parent")) {
    PetscCall(read_table(f, "/mesh/parent", 1, n, &item->n, &parent));
    for (PetscInt i = 0; i < item->n; i++) {
      if (parent[i] != last && parent[i] != ++last)
        H5_ERROR(f, "/mesh/parent jumps in row %lld; the file is damaged", (long long)i + 1);
      SbItemsMove(item, 3, parent[i], i);
    }
    item->n = last + 1;
  }
  if (n != item->n)
    H5_ERROR(f, "/mesh/cells10 does not fit /mesh/cells; the file is damaged");
  for (PetscInt c = 0; c < n; c++) {
    PetscInt vert[10];

    for (int k = 0; k < 10; k++) {
      const int64_t point = node[10 * c + SbGmshNode(k)];

      // edge nodes may be -1, for tets of other elements; corners may not
      if (point < (k < 4 ? 0 : -1) || point >= f->nvert)
        H5_ERROR(f, "/mesh/cells10 holds %lld in row %lld; the file is damaged", (long long)point,
                 (long long)c + 1);
      vert[k] = point >= 0 && at ? at[point] : (PetscInt)point;
    }
    PetscCall(PetscArraycpy(item->vert + 4 * c, vert, 4));
    item->number[c] = c + 1;
    PetscCall(SbImportAddMiddles(f->im, vert));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_output(const File *f)
{
  SbImport *im = f->im;
  PetscInt *at = NULL;

  PetscFunctionBeginUser;

  // positions at the wanted step
  if (f->frame[0]) {
    char name[96];
    PetscReal *u;

    (void)snprintf(name, sizeof(name), "%s/displacement", f->frame);
    if (!is_there(f, name))
      H5_ERROR(f, "has no displacement at the step; the run needs it among its -output_fields");
    PetscCall(
      read_array(f, &(Array){.name = name, .klass = H5T_FLOAT, .ncomp = 3}, &im->nvert, &u));
    for (PetscInt i = 0; i < 3 * im->nvert; i++)
      im->x[i] += u[i];
  }
  if (is_there(f, "/mesh/vertices")) {
    const PetscInt n = im->item[3].n;
    PetscInt *vertex, *share;
    PetscInt nvert = 0;
    PetscReal *x;

    // merge the points of each vertex, at their mean position
    PetscCall(read_table(f, "/mesh/vertices", 4, im->nvert, &im->item[3].n, &vertex));
    for (PetscInt i = 0; i < 4 * n; i++)
      nvert = PetscMax(nvert, vertex[i] + 1);
    PetscCall(PetscCalloc2(3 * (size_t)nvert, &x, nvert, &share));
    PetscCall(SbImportScratch(im, (size_t)f->nvert * sizeof(*at), &at));
    PetscCall(PetscArrayzero(at, f->nvert));
    for (PetscInt i = 0; i < 4 * n; i++) {
      for (int k = 0; k < 3; k++)
        x[3 * vertex[i] + k] += im->x[3 * im->item[3].vert[i] + k];
      share[vertex[i]]++;
      at[im->item[3].vert[i]] = vertex[i];
    }
    for (PetscInt v = 0; v < nvert; v++) {
      for (int k = 0; k < 3; k++)
        im->x[3 * v + k] = share[v] ? x[3 * v + k] / share[v] : 0;
      im->vert_number[v] = v + 1;
    }
    PetscCall(PetscArraycpy(im->item[3].vert, vertex, 4 * n));
    im->nvert = nvert;
    PetscCall(PetscFree2(x, share));
  }
  PetscCall(read_bodies(f));
  if (is_there(f, "/mesh/cells10") || is_there(f, "/mesh/parent"))
    PetscCall(read_quadratic(f, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the contents of the file, for an error message. */
static herr_t list_name(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  char *text = (char *)ctx;

  (void)where, (void)info;
  if (strlen(text) < 160)
    SbAppend(256, text, "%s%.60s", text[0] ? ", " : "", name);
  return 0;
}

static PetscErrorCode read_mesh(File *f, SbSlabRows *rows)
{
  SbImport *im = f->im;
  const int layout =
    number_of(f->file, "/", "supple_mesh"); /* version; 0 for the output of a run */
  Array x = {.name = "/mesh/x", .klass = H5T_FLOAT, .ncomp = 3, .block = PETSC_TRUE};
  SbH5Frames s = {.wanted = f->im->step};
  char content[256] = "";
  int number;

  PetscFunctionBeginUser;
  if (H5Aexists(f->file, "supple_mesh") > 0 && layout != 1 && layout != 2)
    H5_ERROR(f, "is a mesh of layout %d; this supple reads layouts 1 and 2", layout);
  if (!is_there(f, "/mesh/x") || !is_there(f, "/mesh/cells")) {
    (void)H5Literate(f->file, H5_INDEX_NAME, H5_ITER_INC, NULL, list_name, content);
    H5_ERROR(f,
             "holds no mesh: /mesh/x and /mesh/cells are missing%s%s; give an .h5 mesh of "
             "supple-mesh, or the "
             "fields.h5 of a run",
             content[0] ? "; it holds " : "", content);
  }

  // HDF5 group of the wanted step
  if (im->step) {
    if (!is_there(f, "/step"))
      H5_ERROR(f, "holds a mesh, no steps of a run; leave out the step %lld", (long long)s.wanted);
    SbH5FindFrame(f->file, &s);
    if (!s.n)
      H5_ERROR(f, "has no step yet");
    if (!s.found[0])
      H5_ERROR(f, "has no step %lld; it has %lld of them, from %lld to %lld (-1: the last one)",
               (long long)s.wanted, (long long)s.n, (long long)s.first, (long long)s.last);
    (void)snprintf(f->frame, sizeof(f->frame), "%s", s.found);
    number = number_of(f->file, f->frame, "mesh");
    if (number)
      (void)snprintf(f->mesh, sizeof(f->mesh), "/mesh_%06d", number);
  }
  PetscCall(open_array(f, &x));
  PetscCall(SbImportSetVertices(im, (PetscInt)x.n));
  PetscCall(read_values(f, &x, im->x));
  *rows = x.rows;
  f->nvert = rows->N;
  for (PetscInt v = 0; v < im->nvert; v++)
    im->vert_number[v] = rows->first + v + 1;
  PetscCall(read_items(f, 3, "/mesh/cells"));
  PetscCall(layout ? read_own(f) : read_output(f));
  if (layout)
    PetscCall(read_curved(f, layout));
  if (im->field[0]) {
    PetscInt rows_of = -1;
    char name[SB_NAME_MAX + 8];
    double *value;

    (void)snprintf(name, sizeof(name), "/mesh/%s", im->field);
    if (is_there(f, name)) {
      PetscCall(
        read_array(f, &(Array){.name = name, .klass = H5T_FLOAT, .ncomp = (hsize_t)im->field_width},
                   &rows_of, &value));
      PetscCall(SbImportKeep(im, rows_of, NULL, 1, value));
    }
  }
  if (!im->item[3].n && !f->nparts && !(im->surface && im->item[2].n))
    H5_ERROR(f, "holds no tetrahedra; mesh the volume (supple-mesh tet)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSlab_H5(const char *path, PetscInt k, PetscInt n, SbImport *im,
                               SbSlabRows *rows)
{
  File f = {.im = im, .file = -1, .mesh = "/mesh", .part = k, .nparts = n};
  PetscErrorCode ierr;
  char why[PETSC_MAX_PATH_LEN + 256];
  hid_t access;
  htri_t is_hdf5;
  FILE *file;

  PetscFunctionBeginUser;

  // error: missing file, not an HDF5 file, or truncated
  PetscCheck(SbH5IsOwn(path, sizeof(why), why), PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s",
             why);
  access = H5Pcreate(H5P_FILE_ACCESS);
  PetscCall(SbScanOpenFile(f.im->where, path, &file, &f.bytes));
  (void)fclose(file);
  (void)H5Eset_auto2(H5E_DEFAULT, NULL,
                     NULL); /* HDF5's error stack is replaced by one line of ours */
  is_hdf5 = H5Fis_hdf5(path);
  (void)H5Pset_fclose_degree(access, H5F_CLOSE_STRONG); /* with all objects, also after an error */
  f.file = is_hdf5 > 0 ? H5Fopen(path, H5F_ACC_RDONLY, access) : -1;
  (void)H5Pclose(access);
  if (is_hdf5 <= 0)
    H5_ERROR(
      &f, "is no HDF5 file (%zu bytes); give an .h5 mesh of supple-mesh, or the fields.h5 of a run",
      f.bytes);
  if (f.file < 0)
    H5_ERROR(&f,
             "HDF5 cannot open it (%zu bytes); it is truncated, damaged or being written: write or "
             "copy it again",
             f.bytes);
  ierr = read_mesh(&f, rows);
  (void)H5Fclose(f.file);
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbImportRead_H5(const char *path, SbImport *im)
{
  SbSlabRows rows;

  PetscFunctionBeginUser;
  PetscCall(SbImportSlab_H5(path, 0, 0, im, &rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbImportSlabs(const SbBody *body, PetscInt *ncell)
{
  const char *dot = strrchr(body->mesh, '.');
  hid_t file, set, space;
  hssize_t n;
  char why[PETSC_MAX_PATH_LEN + 256];

  *ncell = 0;
  if (body->in_memory || body->mesh_step || body->refine || !dot || strcasecmp(dot, ".h5"))
    return;
  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  file = SbH5IsOwn(body->mesh, sizeof(why), why) ? H5Fopen(body->mesh, H5F_ACC_RDONLY, H5P_DEFAULT)
                                                 : -1; /* the reader says why not */
  if (file < 0)
    return;
  set = H5Aexists(file, "supple_mesh") > 0 ? H5Dopen2(file, "/mesh/cells", H5P_DEFAULT) : -1;
  space = H5Dget_space(set);
  n = H5Sget_simple_extent_npoints(space); /* negative without the array */
  if (n > 0 && n <= PETSC_MAX_INT / 2)
    *ncell = (PetscInt)(n / 4);
  (void)H5Sclose(space);
  (void)H5Dclose(set);
  (void)H5Fclose(file);
}

/* Reads the .h5 file to which the first array of an .xmf refers, relative to the folder of the
   .xmf. */
PetscErrorCode SbImportRead_Xdmf(const char *path, SbImport *im)
{
  static const char mark[] = ".h5:/mesh/";
  const char *slash = strrchr(path, '/');
  const char *begin;
  SbScan *s = &im->scan;
  char h5[2 * PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  if (!SbScanFind(s, mark))
    SB_SCAN_ERROR(
      s, "names no mesh in an .h5 file; supple reads the .xmf of its own output and meshes");
  for (begin = s->at; begin > s->data && !strchr(" \t\r\n>\"", begin[-1]); begin--) {
  }
  (void)snprintf(h5, sizeof(h5), "%.*s%.*s", slash && *begin != '/' ? (int)(slash + 1 - path) : 0,
                 path, (int)(s->at + 3 - begin), begin);
  PetscCall(SbImportRead_H5(h5, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
