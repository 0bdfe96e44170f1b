/*
  import_h5.c - reader of HDF5 meshes: supple's own (write_h5.c has the layout) and what a run writes, fields.h5.

  Both hold /mesh/x and /mesh/cells. Own meshes have groups; in a run's output /mesh/body says which body a tet belongs to,
  and the bodies become groups of tets. When each tet of the output has points of its own (-output_discontinuous),
  /mesh/vertices tells which of them are one vertex: positions are averaged there. With a step, its displacement is added.

  An .xmf names the .h5 that its mesh is in.

  Of own meshes a block of rows may be wanted of each array under /mesh: several ranks read one each (mesh/slab.c).

  A file is not trusted: shape and type of every array, every number of a vertex, group or tag set is checked, and nothing
  is allocated for an array that the file is too short to hold (stored without compression, as here, it takes its full size;
  compressed by others, at most a thousandth of it).
*/
#include <errno.h>
#include <hdf5.h>
#include <stdlib.h>
#include <sys/stat.h>
#include "meshio_impl.h"

typedef struct {
  SbImport *im;
  hid_t file;
  uint64_t bytes;        /* length of the file */
  char frame[64];        /* group of the wanted step; "" at rest */
  PetscInt part, nparts; /* which block of rows of how many; nparts 0: all rows */
  PetscInt nvert;        /* of the file */
} File;

#define H5_ERROR(f, ...)                                                                    \
  do {                                                                                      \
    char sb_text[512];                                                                      \
    (void)snprintf(sb_text, sizeof(sb_text), __VA_ARGS__);                                  \
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: %s", (f)->im->where, sb_text); \
  } while (0)

/* ------------------------------------------------------------------ the file */

static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};

/* Says why HDF5 cannot open it: not there, no HDF5, or cut off. */
static PetscErrorCode open_file(const char *path, File *f)
{
  unsigned char begin[8] = {0};
  struct stat info;
  FILE *file = fopen(path, "rb");
  size_t got;

  PetscFunctionBeginUser;
  PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "%s: cannot open the file (%s); check the name and the folder the run starts in", f->im->where,
             strerror(errno));
  if (fstat(fileno(file), &info) || !S_ISREG(info.st_mode)) {
    (void)fclose(file);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "%s: is not a regular file; give a mesh file",
            f->im->where);
  }
  f->bytes = (uint64_t)info.st_size;
  got = fread(begin, 1, sizeof(begin), file);
  (void)fclose(file);
  if (got < sizeof(begin) || memcmp(begin, signature, sizeof(begin)))
    H5_ERROR(f, "is no HDF5 file (%llu bytes); give an .h5 mesh of supple-mesh, or the fields.h5 of a run",
             (unsigned long long)f->bytes);
  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* its stack of errors becomes one line of ours */
  f->file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (f->file < 0)
    H5_ERROR(
      f,
      "HDF5 cannot open it (%llu bytes); it is truncated, damaged or being written: write or copy it again",
      (unsigned long long)f->bytes);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether every group on the way to a path exists. */
static PetscBool is_there(const File *f, const char *path)
{
  char part[256];

  for (const char *p = strchr(path + 1, '/'); p; p = strchr(p + 1, '/')) {
    (void)snprintf(part, sizeof(part), "%.*s", (int)(p - path), path);
    if (H5Lexists(f->file, part, H5P_DEFAULT) <= 0) return PETSC_FALSE;
  }
  return (PetscBool)(H5Lexists(f->file, path, H5P_DEFAULT) > 0);
}

/* ------------------------------------------------------------------ arrays */

typedef struct {
  const char *name;
  hid_t set, type;
  hsize_t n, ncomp; /* ncomp 1: a list */
  hsize_t first;    /* row of the file that is read first */
  PetscBool block;  /* n rows from there, not all */
} Array;

static PetscErrorCode close_array(Array *a)
{
  PetscFunctionBeginUser;
  if (a->type >= 0) (void)H5Tclose(a->type);
  if (a->set >= 0) (void)H5Dclose(a->set);
  a->set = a->type = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *class_name(H5T_class_t klass)
{
  return klass == H5T_FLOAT ? "real numbers" : klass == H5T_INTEGER ? "whole numbers" : "texts";
}

/* Opens an array of this kind and number of columns. */
static PetscErrorCode open_array(const File *f, const char *name, H5T_class_t klass, hsize_t ncomp, Array *a)
{
  hsize_t size[2] = {0, 1};
  hid_t space;
  int ndim;
  hid_t plist;
  PetscBool packed;
  double want;

  PetscFunctionBeginUser;
  a->name = name;
  a->type = -1;
  a->first = 0;
  a->block = PETSC_FALSE;
  a->ncomp = ncomp;
  a->set = is_there(f, name) ? H5Dopen2(f->file, name, H5P_DEFAULT) : -1;
  if (a->set < 0) H5_ERROR(f, "has no array %s; it is no mesh of supple, or damaged", name);
  a->type = H5Dget_type(a->set);
  space = H5Dget_space(a->set);
  ndim = H5Sget_simple_extent_ndims(space);
  if (ndim == 1 || ndim == 2) (void)H5Sget_simple_extent_dims(space, size, NULL);
  (void)H5Sclose(space);
  a->n = size[0];
  if (H5Tget_class(a->type) != klass || (klass == H5T_STRING && H5Tis_variable_str(a->type) > 0))
    H5_ERROR(f, "%s does not hold %s%s", name, class_name(klass),
             klass == H5T_STRING ? " of one length" : "");
  if ((ndim != 1 && ndim != 2) || size[1] != ncomp)
    H5_ERROR(f, "%s has %d dimensions and %llu columns; expected %llu columns", name, ndim,
             (unsigned long long)size[1], (unsigned long long)ncomp);
  if (a->n > (hsize_t)PETSC_MAX_INT / 8)
    H5_ERROR(f, "%s has %llu rows, more than this build can number", name, (unsigned long long)a->n);
  // an array larger than the file can hold is refused before anything is allocated
  plist = H5Dget_create_plist(a->set);
  packed = (PetscBool)(plist >= 0 && H5Pget_nfilters(plist) > 0);
  want = (double)a->n * (double)a->ncomp * (double)H5Tget_size(a->type);
  if (plist >= 0) (void)H5Pclose(plist);
  if (want > (packed ? 1000. : 1.) * (double)f->bytes)
    H5_ERROR(f, "%s announces %llu x %llu numbers, more than the %llu bytes of the file hold; it is damaged",
             a->name, (unsigned long long)a->n, (unsigned long long)a->ncomp, (unsigned long long)f->bytes);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of an array that belong to the block that is wanted. */
static SbSlabRows take_block(const File *f, Array *a)
{
  SbSlabRows rows = {(PetscInt)a->n, (PetscInt)a->n, 0};

  if (f->nparts) {
    rows.block = (PetscInt)a->n / f->nparts + 1;
    rows.first = (PetscInt)PetscMin((PetscInt64)rows.N, (PetscInt64)rows.block * f->part);
    a->first = (hsize_t)rows.first;
    a->n = (hsize_t)PetscMin(rows.block, rows.N - rows.first);
    a->block = PETSC_TRUE;
  }
  return rows;
}

static PetscErrorCode read_values(const File *f, const Array *a, hid_t type, void *values)
{
  const hsize_t first[2] = {a->first, 0}, n[2] = {a->n, a->ncomp};
  hid_t in_file = H5S_ALL, in_memory = H5S_ALL;
  herr_t status = 0;

  PetscFunctionBeginUser;
  if (a->block && a->n) {
    in_file = H5Dget_space(a->set);
    in_memory = H5Screate_simple(H5Sget_simple_extent_ndims(in_file), n, NULL);
    status = H5Sselect_hyperslab(in_file, H5S_SELECT_SET, first, NULL, n, NULL);
  }
  if (a->n && status >= 0) status = H5Dread(a->set, type, in_memory, in_file, H5P_DEFAULT, values);
  if (a->block && a->n) {
    (void)H5Sclose(in_file);
    (void)H5Sclose(in_memory);
  }
  if (status < 0) H5_ERROR(f, "%s cannot be read; the file is damaged, write or copy it again", a->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A list of whole numbers in [low, high); PetscFree(). What is out of range is named with its place. */
static PetscErrorCode read_ints(const File *f, const Array *a, int64_t low, int64_t high, PetscInt values[])
{
  PetscFunctionBeginUser;
  PetscCall(read_values(f, a, sizeof(PetscInt) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32, values));
  for (size_t i = 0; i < (size_t)(a->n * a->ncomp); i++) {
    if (values[i] < low || values[i] >= high)
      H5_ERROR(f, "%s holds %lld in row %llu; it must be from %lld to %lld", a->name, (long long)values[i],
               (unsigned long long)(a->first + i / a->ncomp) + 1, (long long)low, (long long)high - 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ vertices and simplices */

static PetscErrorCode check_finite(const File *f, const Array *a, const PetscReal x[])
{
  PetscFunctionBeginUser;
  for (size_t i = 0; i < 3 * (size_t)a->n; i++)
    if (!isfinite(x[i]))
      H5_ERROR(f, "%s holds no finite number in row %zu", a->name, (size_t)a->first + i / 3 + 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [n][3] of a group or of the mesh, of the block that is wanted; PetscFree(). */
static PetscErrorCode read_vectors(const File *f, const char *name, SbSlabRows *rows, PetscInt *n,
                                   PetscReal **x)
{
  Array a;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  *x = NULL;
  ierr = open_array(f, name, H5T_FLOAT, 3, &a);
  if (!ierr) {
    *rows = take_block(f, &a);
    *n = (PetscInt)a.n;
    ierr = PetscMalloc1(3 * (size_t)a.n, x);
  }
  if (!ierr) ierr = read_values(f, &a, H5T_NATIVE_DOUBLE, *x);
  if (!ierr) ierr = check_finite(f, &a, *x);
  PetscCall(close_array(&a));
  if (ierr) PetscCall(PetscFree(*x));
  PetscFunctionReturn(ierr);
}

/* An array of whole numbers in [0, high), all of it unless `rows` asks for the block that is wanted; PetscFree(). */
static PetscErrorCode read_table(const File *f, const char *name, PetscInt ncomp, int64_t high,
                                 SbSlabRows *rows, PetscInt *n, PetscInt **values)
{
  Array a;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  *values = NULL;
  ierr = open_array(f, name, H5T_INTEGER, (hsize_t)ncomp, &a);
  if (!ierr) {
    if (rows) *rows = take_block(f, &a);
    *n = (PetscInt)a.n;
    ierr = PetscMalloc1((size_t)(a.n * a.ncomp), values);
  }
  if (!ierr) ierr = read_ints(f, &a, 0, high, *values);
  PetscCall(close_array(&a));
  if (ierr) PetscCall(PetscFree(*values));
  PetscFunctionReturn(ierr);
}

/* Simplices of one dimension, without groups yet. */
static PetscErrorCode read_items(const File *f, int dim, const char *name)
{
  SbImport *im = f->im;
  SbSlabRows rows;
  Array a;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = open_array(f, name, H5T_INTEGER, (hsize_t)dim + 1, &a);
  if (!ierr) {
    rows = take_block(f, &a);
    ierr = SbImportSetItems(im, dim, (PetscInt)a.n);
  }
  if (!ierr) ierr = read_ints(f, &a, 0, f->nvert, im->item[dim].vert);
  PetscCall(close_array(&a));
  for (PetscInt i = 0; i < im->item[dim].n && !ierr; i++) im->item[dim].number[i] += rows.first;
  if (!ierr) ierr = PetscArrayzero(im->item[dim].tags, im->item[dim].n);
  PetscFunctionReturn(ierr);
}

/* ------------------------------------------------------------------ groups of an own mesh */

static PetscErrorCode read_names(const File *f, PetscInt *n, char **names, size_t *width)
{
  Array a;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  *names = NULL;
  ierr = open_array(f, "/groups/name", H5T_STRING, 1, &a);
  if (!ierr) {
    *n = (PetscInt)a.n;
    *width = H5Tget_size(a.type);
    ierr = PetscMalloc1(*width * (size_t)a.n, names);
  }
  if (!ierr) ierr = read_values(f, &a, a.type, *names);
  PetscCall(close_array(&a));
  if (ierr) PetscCall(PetscFree(*names));
  PetscFunctionReturn(ierr);
}

/* Numbers of groups may be any. */
static PetscErrorCode read_numbers(const File *f, PetscInt *n, int64_t **numbers)
{
  Array a;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = open_array(f, "/groups/number", H5T_INTEGER, 1, &a);
  if (!ierr) {
    *n = (PetscInt)a.n;
    ierr = PetscMalloc1(a.n, numbers);
  }
  if (!ierr) ierr = read_values(f, &a, H5T_NATIVE_INT64, *numbers);
  PetscCall(close_array(&a));
  PetscFunctionReturn(ierr);
}

/* The groups of a file as they lie in it. */
typedef struct {
  PetscInt n, ndim, nnumber, *dim; /* [n] */
  int64_t *number;                 /* [n] */
  char *names;                     /* [n][width] */
  size_t width;
} Groups;

/* Adds the groups of the file; map[] leads to their numbers here. */
static PetscErrorCode add_groups(const File *f, const Groups *g, PetscInt map[])
{
  PetscFunctionBeginUser;
  if (g->ndim != g->n || g->nnumber != g->n)
    H5_ERROR(f, "/groups has %lld names, %lld dimensions and %lld numbers; the file is damaged",
             (long long)g->n, (long long)g->ndim, (long long)g->nnumber);
  for (PetscInt i = 0; i < g->n; i++) {
    char name[SB_GROUP_MAX];

    (void)snprintf(name, sizeof(name), "%.*s", (int)PetscMin(g->width, sizeof(name) - 1),
                   g->names + g->width * (size_t)i);
    PetscCall(SbImportGroup(f->im, g->dim[i], g->number[i], name[0] ? name : NULL, &map[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_groups(const File *f, PetscInt *ngroup, PetscInt **map)
{
  Groups g;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&g, sizeof(g)));
  *map = NULL;
  ierr = read_names(f, &g.n, &g.names, &g.width);
  if (!ierr) ierr = read_table(f, "/groups/dim", 1, 4, NULL, &g.ndim, &g.dim);
  if (!ierr) ierr = read_numbers(f, &g.nnumber, &g.number);
  if (!ierr) ierr = PetscMalloc1(g.n, map);
  if (!ierr) ierr = add_groups(f, &g, *map);
  PetscCall(PetscFree(g.names));
  PetscCall(PetscFree(g.dim));
  PetscCall(PetscFree(g.number));
  if (ierr) PetscCall(PetscFree(*map));
  *ngroup = g.n;
  PetscFunctionReturn(ierr);
}

/* The tag sets of the file; map[] leads to their numbers here. */
static PetscErrorCode add_sets(const File *f, PetscInt n, const PetscInt start[], PetscInt nmember,
                               PetscInt member[], const PetscInt group[], PetscInt map[])
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < nmember; i++) member[i] = group[member[i]];
  for (PetscInt t = 0; t < n; t++) {
    if (start[t] > start[t + 1])
      H5_ERROR(f, "/tag_sets/start falls from %lld to %lld; the file is damaged", (long long)start[t],
               (long long)start[t + 1]);
    PetscCall(SbImportTagSet(f->im, start[t + 1] - start[t], nmember ? member + start[t] : NULL, &map[t]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_sets(const File *f, PetscInt *nset, PetscInt **map)
{
  PetscInt ngroup = 0, nmember = 0, nstart = 0, *group = NULL, *member = NULL, *start = NULL;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  *map = NULL;
  ierr = read_groups(f, &ngroup, &group);
  if (!ierr) ierr = read_table(f, "/tag_sets/group", 1, ngroup, NULL, &nmember, &member);
  if (!ierr) ierr = read_table(f, "/tag_sets/start", 1, (int64_t)nmember + 1, NULL, &nstart, &start);
  *nset = PetscMax(nstart - 1, 0);
  if (!ierr) ierr = PetscMalloc1(*nset, map);
  if (!ierr) ierr = add_sets(f, *nset, start, nmember, member, group, *map);
  PetscCall(PetscFree(group));
  PetscCall(PetscFree(member));
  PetscCall(PetscFree(start));
  if (ierr) PetscCall(PetscFree(*map));
  PetscFunctionReturn(ierr);
}

static PetscErrorCode read_tags(const File *f, int dim, const char *name, PetscInt nset, const PetscInt map[])
{
  SbItems *item = &f->im->item[dim];
  PetscInt n, *tags;
  SbSlabRows rows;

  PetscFunctionBeginUser;
  PetscCall(read_table(f, name, 1, nset, &rows, &n, &tags));
  if (n == item->n)
    for (PetscInt i = 0; i < n; i++) item->tags[i] = map[tags[i]];
  PetscCall(PetscFree(tags));
  if (n != item->n)
    H5_ERROR(f, "%s has %lld rows for %lld simplices; the file is damaged", name, (long long)n,
             (long long)item->n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_own(const File *f)
{
  static const char *const names[4] = {"point", "line", "triangle", "cell"};
  PetscInt nset, *map;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(read_sets(f, &nset, &map));
  for (int d = 0; d < 4 && !ierr; d++) {
    char items[32], tags[32];

    (void)snprintf(items, sizeof(items), "/mesh/%ss", names[d]);
    (void)snprintf(tags, sizeof(tags), "/mesh/%s_tags", names[d]);
    if (d < 3 && !is_there(f, items)) continue;
    if (d < 3) ierr = read_items(f, d, items);
    if (!ierr) ierr = read_tags(f, d, tags, nset, map);
  }
  PetscCall(PetscFree(map));
  PetscFunctionReturn(ierr);
}

/* ------------------------------------------------------------------ what a run wrote */

/* Steps of the frames: "0, 10, 20 ... 500". */
typedef struct {
  int64_t wanted, first, last;
  PetscInt n;
  char found[64];
  const char *hundred;
} Frames;

static herr_t visit_frame(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  Frames *s = (Frames *)ctx;
  const int64_t step = strtoll(name, NULL, 10);

  (void)where, (void)info;
  if (!s->n++) s->first = step;
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
  if (group < 0) return 0;
  ((Frames *)ctx)->hundred = name;
  (void)H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, visit_frame, ctx);
  (void)H5Gclose(group);
  return 0;
}

static PetscErrorCode add_displacement(const File *f)
{
  SbImport *im = f->im;
  char name[96];
  SbSlabRows rows;
  PetscInt n;
  PetscReal *u;

  PetscFunctionBeginUser;
  (void)snprintf(name, sizeof(name), "%s/displacement", f->frame);
  if (!is_there(f, name))
    H5_ERROR(f, "has no displacement at the step; the run needs it among its -output_fields");
  PetscCall(read_vectors(f, name, &rows, &n, &u));
  for (PetscInt i = 0; i < 3 * n && n == im->nvert; i++) im->x[i] += u[i];
  PetscCall(PetscFree(u));
  if (n != im->nvert)
    H5_ERROR(f, "%s has %lld rows for %lld points", name, (long long)n, (long long)im->nvert);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points of each tet become the vertices that they lie at, in their mean position. */
static PetscErrorCode join_points(const File *f)
{
  SbImport *im = f->im;
  PetscInt n, *vertex, *share, nvert = 0;
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(read_table(f, "/mesh/vertices", 4, PETSC_MAX_INT / 8, NULL, &n, &vertex));
  for (PetscInt i = 0; i < 4 * n; i++) nvert = PetscMax(nvert, vertex[i] + 1);
  if (n != im->item[3].n || nvert > im->nvert) {
    PetscCall(PetscFree(vertex));
    H5_ERROR(f, "/mesh/vertices does not fit /mesh/cells; the file is damaged");
  }
  PetscCall(PetscCalloc2(3 * (size_t)nvert, &x, nvert, &share));
  for (PetscInt i = 0; i < 4 * n; i++) {
    for (int k = 0; k < 3; k++) x[3 * vertex[i] + k] += im->x[3 * im->item[3].vert[i] + k];
    share[vertex[i]]++;
  }
  for (PetscInt v = 0; v < nvert; v++) {
    for (int k = 0; k < 3; k++) im->x[3 * v + k] = share[v] ? x[3 * v + k] / share[v] : 0;
    im->vert_number[v] = v + 1;
  }
  PetscCall(PetscArraycpy(im->item[3].vert, vertex, 4 * n));
  im->nvert = nvert;
  PetscCall(PetscFree2(x, share));
  PetscCall(PetscFree(vertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each body is a group of tets. */
static PetscErrorCode read_bodies(const File *f)
{
  SbImport *im = f->im;
  PetscInt n, *body, nbody = 0, group, *tags;
  char names[4096], *name, *rest = names;
  hid_t attribute, kind;

  PetscFunctionBeginUser;
  if (!is_there(f, "/mesh/body")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(read_table(f, "/mesh/body", 1, 1 << 16, NULL, &n, &body));
  if (n != im->item[3].n) {
    PetscCall(PetscFree(body));
    H5_ERROR(f, "/mesh/body has %lld rows for %lld tets", (long long)n, (long long)im->item[3].n);
  }
  for (PetscInt c = 0; c < n; c++) nbody = PetscMax(nbody, body[c] + 1);
  // names of the bodies; none in old files
  attribute = H5Aexists_by_name(f->file, "/mesh", "bodies", H5P_DEFAULT) > 0
                ? H5Aopen_by_name(f->file, "/mesh", "bodies", H5P_DEFAULT, H5P_DEFAULT)
                : -1;
  kind = attribute >= 0 ? H5Aget_type(attribute) : -1;
  memset(names, 0, sizeof(names));
  if (kind >= 0 && H5Tget_class(kind) == H5T_STRING && H5Tis_variable_str(kind) <= 0 &&
      H5Tget_size(kind) < sizeof(names))
    (void)H5Aread(attribute, kind, names);
  if (kind >= 0) (void)H5Tclose(kind);
  if (attribute >= 0) (void)H5Aclose(attribute);
  PetscCall(PetscMalloc1(nbody, &tags));
  for (PetscInt b = 0; b < nbody; b++) {
    char plain[32];

    name = strsep(&rest, ",");
    (void)snprintf(plain, sizeof(plain), "body_%d", (int)b + 1);
    PetscCall(SbImportGroup(im, 3, b + 1, name && name[0] ? name : plain, &group));
    PetscCall(SbImportTagSet(im, 1, &group, &tags[b]));
  }
  for (PetscInt c = 0; c < n; c++) im->item[3].tags[c] = tags[body[c]];
  PetscCall(PetscFree(tags));
  PetscCall(PetscFree(body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_output(const File *f)
{
  PetscFunctionBeginUser;
  if (f->frame[0]) PetscCall(add_displacement(f));
  if (is_there(f, "/mesh/vertices")) PetscCall(join_points(f));
  PetscCall(read_bodies(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the mesh */

/* What is in the file, for a reader who gave another one. */
static herr_t list_name(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  char *text = (char *)ctx;
  const size_t n = strlen(text);

  (void)where, (void)info;
  if (n < 160) (void)snprintf(text + n, 256 - n, "%s%.60s", n ? ", " : "", name);
  return 0;
}

static PetscErrorCode check_layout(const File *f, PetscBool *own)
{
  char content[256] = "";
  int version = 0;

  PetscFunctionBeginUser;
  *own = (PetscBool)(H5Aexists(f->file, "supple_mesh") > 0);
  if (*own) {
    const hid_t a = H5Aopen(f->file, "supple_mesh", H5P_DEFAULT);

    if (H5Aread(a, H5T_NATIVE_INT, &version) < 0) version = 0;
    (void)H5Aclose(a);
    if (version != 1) H5_ERROR(f, "is a mesh of layout %d; this supple reads layout 1", version);
  }
  if (is_there(f, "/mesh/x") && is_there(f, "/mesh/cells")) PetscFunctionReturn(PETSC_SUCCESS);
  (void)H5Literate(f->file, H5_INDEX_NAME, H5_ITER_INC, NULL, list_name, content);
  H5_ERROR(f,
           "holds no mesh: /mesh/x and /mesh/cells are missing%s%s; give an .h5 mesh of supple-mesh, or the "
           "fields.h5 of a run",
           content[0] ? "; it holds " : "", content);
}

static PetscErrorCode read_mesh(File *f, SbSlabRows *rows)
{
  SbImport *im = f->im;
  PetscBool own;
  Frames s = {.wanted = f->im->step};

  PetscFunctionBeginUser;
  PetscCall(check_layout(f, &own));
  // the group of the wanted step
  if (im->step) {
    if (!is_there(f, "/step"))
      H5_ERROR(f, "holds a mesh, no steps of a run; leave out the step %lld", (long long)s.wanted);
    (void)H5Literate_by_name(f->file, "/step", H5_INDEX_NAME, H5_ITER_INC, NULL, visit_hundred, &s,
                             H5P_DEFAULT);
    if (!s.n) H5_ERROR(f, "has no step yet");
    if (!s.found[0])
      H5_ERROR(f, "has no step %lld; it has %lld of them, from %lld to %lld (-1: the last one)",
               (long long)s.wanted, (long long)s.n, (long long)s.first, (long long)s.last);
    (void)snprintf(f->frame, sizeof(f->frame), "%s", s.found);
  }
  PetscCall(read_vectors(f, "/mesh/x", rows, &im->nvert, &im->x));
  f->nvert = rows->N;
  PetscCall(PetscMalloc1(im->nvert, &im->vert_number));
  for (PetscInt v = 0; v < im->nvert; v++) im->vert_number[v] = rows->first + v + 1;
  PetscCall(read_items(f, 3, "/mesh/cells"));
  PetscCall(own ? read_own(f) : read_output(f));
  if (!im->item[3].n && !f->nparts && !(im->surface && im->item[2].n))
    H5_ERROR(f, "holds no tetrahedra; mesh the volume (supple-mesh tet)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSlab_H5(const char *path, PetscInt k, PetscInt n, SbImport *im, SbSlabRows *rows)
{
  File f = {.im = im, .file = -1, .part = k, .nparts = n};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(open_file(path, &f));
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

PetscErrorCode SbImportSlabs_H5(const char *path, PetscInt *ncell)
{
  hid_t file, set, space;
  hsize_t size[2] = {0, 0};

  PetscFunctionBeginUser;
  *ncell = 0;
  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file < 0) PetscFunctionReturn(PETSC_SUCCESS);
  set = H5Aexists(file, "supple_mesh") > 0 ? H5Dopen2(file, "/mesh/cells", H5P_DEFAULT) : -1;
  space = set >= 0 ? H5Dget_space(set) : -1;
  if (space >= 0 && H5Sget_simple_extent_ndims(space) == 2)
    (void)H5Sget_simple_extent_dims(space, size, NULL);
  if (size[0] <= (hsize_t)PETSC_MAX_INT / 8) *ncell = (PetscInt)size[0];
  if (space >= 0) (void)H5Sclose(space);
  if (set >= 0) (void)H5Dclose(set);
  (void)H5Fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ .xmf */

/* The .h5 of the first array that an .xmf names, from the folder of the .xmf. */
static PetscErrorCode heavy_file(SbScan *s, const char *path, size_t size, char h5[])
{
  static const char mark[] = ".h5:/mesh/";
  const char *slash = strrchr(path, '/'), *end, *begin;

  PetscFunctionBeginUser;
  if (!SbScanFind(s, mark))
    SB_SCAN_ERROR(s, "names no mesh in an .h5 file; supple reads the .xmf of its own output and meshes");
  end = s->at + 3;
  for (begin = s->at; begin > s->data && !strchr(" \t\r\n>\"", begin[-1]); begin--) {
  }
  (void)snprintf(h5, size, "%.*s%.*s", slash && *begin != '/' ? (int)(slash + 1 - path) : 0, path,
                 (int)(end - begin), begin);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Xdmf(const char *path, SbImport *im)
{
  char h5[2 * PETSC_MAX_PATH_LEN] = "";
  SbScan scan;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = SbScanOpen(im->where, path, &scan);
  if (!ierr) ierr = heavy_file(&scan, path, sizeof(h5), h5);
  PetscCall(SbScanClose(&scan));
  if (!ierr) ierr = SbImportRead_H5(h5, im);
  PetscFunctionReturn(ierr);
}
