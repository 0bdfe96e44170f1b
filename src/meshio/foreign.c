/*
  foreign.c - named arrays of a mesh file in HDF5 or in netCDF's classic format, and groups by their
  names, for the readers of MED, Exodus and CGNS.

  Files are not trusted: no array is allocated that is larger than the file can hold (compressed: a
  thousand times that), numbers are finite, nodes are there. HDF5 1.10 itself reads beyond its
  memory where a file is damaged: it works in a child process, with plain input and output.
*/
#include "foreign.h"

enum {
  SECONDS = 3600
}; /* time limit of the child process */

typedef struct {
  const char *path, *kind;
  SbForeignWork work;
} Job;

/* Work of the child process. */
static PetscErrorCode read_hdf5(void *ctx, SbImport *im)
{
  const Job *job = (const Job *)ctx;
  SbForeign f = {.im = im, .file = -1};
  PetscInt none;
  FILE *file;
  char why[PETSC_MAX_PATH_LEN + 256];

  PetscFunctionBeginUser;
  PetscCall(SbImportTagSet(im, 0, NULL, &none));
  PetscCall(SbScanOpenFile(im->where, job->path, &file, &f.bytes));
  (void)fclose(file);
  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  f.file = H5Fopen(job->path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (f.file < 0)
    SB_FOREIGN_ERROR(&f,
                     "HDF5 cannot open it as a file of %s (%zu bytes); it is truncated, damaged or "
                     "of another kind: write or copy it again",
                     job->kind, f.bytes);
  PetscCheck(SbH5FileIsOwn(f.file, job->path, sizeof(why), why), PETSC_COMM_SELF,
             PETSC_ERR_FILE_UNEXPECTED, "%s", why);
  PetscCall((*job->work)(&f));
  SbImportNoteSkipped(im);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignRead(const char *path, const char *kind, PetscBool classic,
                             SbForeignWork work, SbImport *im)
{
  Job job = {path, kind, work};
  const SbChildJob child = {.where = im->where,
                            .who = "HDF5",
                            .doing = "read the file",
                            .seconds = SECONDS,
                            .npart = SB_IMPORT_NPART,
                            .work = read_hdf5,
                            .ctx = &job};
  SbForeign f = {.im = im, .file = -1};
  FILE *file;

  PetscFunctionBeginUser;
  if (!classic) {
    PetscCall(SbScanOpenFile(im->where, path, &file, &f.bytes)); /* no waits for pipes */
    (void)fclose(file);
    PetscCall(SbChildRun(&child, im));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbScanOpen(im->where, path, &im->scan));
  f.bytes = (size_t)(im->scan.end - im->scan.data);
  PetscCall(SbNetcdfHeader(&f));
  PetscCall((*work)(&f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether each part of a path exists; HDF5 fails where one is missing. */
PetscBool SbForeignHas(const SbForeign *f, const char *name)
{
  char path[1024];

  if (f->file < 0)
    return (PetscBool)(SbNetcdfFind(f, name) != NULL);
  (void)snprintf(path, sizeof(path), "%s", name);
  for (char *p = strchr(path + (path[0] == '/'), '/'); p; p = strchr(p + 1, '/')) {
    *p = 0;
    if (H5Lexists(f->file, path, H5P_DEFAULT) <= 0)
      return PETSC_FALSE;
    *p = '/';
  }
  return (PetscBool)(H5Lexists(f->file, path, H5P_DEFAULT) > 0);
}

/* Opens an array of HDF5: its number of values, checked, and its first dimension. */
static PetscErrorCode open_array(const SbForeign *f, const char *name, hid_t *set, int64_t *n,
                                 int64_t *first)
{
  hsize_t size[H5S_MAX_RANK] = {1};
  hid_t space, list, type;
  PetscBool packed;
  double want = 1;

  PetscFunctionBeginUser;
  *set = SbForeignHas(f, name) ? H5Dopen2(f->file, name, H5P_DEFAULT) : -1;
  if (*set < 0)
    SB_FOREIGN_ERROR(f, "there is no array %s in it; the file is damaged, or of another kind",
                     name);
  space = H5Dget_space(*set);
  type = H5Dget_type(*set);
  list = H5Dget_create_plist(*set);
  packed = (PetscBool)(list >= 0 && H5Pget_nfilters(list) > 0);
  for (int d = 0, ndim = H5Sget_simple_extent_dims(space, size, NULL); d < ndim; d++)
    want *= (double)size[d];
  *first = (int64_t)size[0];
  if (!(want * (double)H5Tget_size(type) <= (packed ? 1000. : 1.) * (double)f->bytes))
    SB_FOREIGN_ERROR(f, "%s announces %.0f values, more than the %zu bytes of the file hold", name,
                     want, f->bytes);
  *n = (int64_t)want;
  (void)H5Tclose(type);
  (void)H5Sclose(space);
  (void)H5Pclose(list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bytes of a variable of netCDF. */
static PetscErrorCode variable_bytes(const SbForeign *f, const char *name, const SbVariable **v,
                                     const char **bytes)
{
  const SbScan *s = &f->im->scan;

  PetscFunctionBeginUser;
  *v = SbNetcdfFind(f, name);
  if (!*v)
    SB_FOREIGN_ERROR(f, "there is no array %s in it; the file is damaged, or of another kind",
                     name);
  if ((*v)->begin < 0 || (*v)->begin > s->end - s->data ||
      (*v)->n > (s->end - s->data - (*v)->begin) / (*v)->type.size)
    SB_FOREIGN_ERROR(f, "%s announces %lld values, which the file does not hold; it is truncated",
                     name, (long long)(*v)->n);
  *bytes = s->data + (*v)->begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignNumbers(SbForeign *f, const char *name, int64_t *n, double **value)
{
  const SbVariable *v = NULL;
  const char *bytes = NULL;
  int64_t found, first;
  hid_t set = -1;
  hid_t type = -1;
  PetscBool number;

  PetscFunctionBeginUser;
  if (f->file < 0) {
    PetscCall(variable_bytes(f, name, &v, &bytes));
    found = v->n;
    number = (PetscBool)(v->type.kind != 'c');
  } else {
    PetscCall(open_array(f, name, &set, &found, &first));
    type = H5Dget_type(set);
    number = (PetscBool)(H5Tget_class(type) == H5T_INTEGER || H5Tget_class(type) == H5T_FLOAT);
  }
  if (!number)
    SB_FOREIGN_ERROR(f, "%s does not hold numbers", name);
  if (*n >= 0 && found != *n)
    SB_FOREIGN_ERROR(f, "%s has %lld numbers; expected %lld", name, (long long)found,
                     (long long)*n);
  *n = found;
  *value = NULL;
  PetscCall(SbImportScratch(f->im, (size_t)found * sizeof(**value), value));
  if (f->file < 0)
    SbNumbersConvert(v->type, PETSC_TRUE, (size_t)found, bytes, *value);
  else {
    if (found && H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, *value) < 0)
      SB_FOREIGN_ERROR(f, "%s cannot be read; the file is damaged, write or copy it again", name);
    (void)H5Tclose(type);
    (void)H5Dclose(set);
  }
  for (int64_t i = 0; i < found; i++)
    if (!isfinite((*value)[i]))
      SB_FOREIGN_ERROR(f, "%s holds no finite number at place %lld", name, (long long)i + 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignRows(SbForeign *f, const char *name, int64_t *rows)
{
  const SbVariable *v;
  const char *bytes;
  int64_t n;
  hid_t set;

  PetscFunctionBeginUser;
  if (f->file < 0) {
    PetscCall(variable_bytes(f, name, &v, &bytes));
    *rows = v->size[0];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(open_array(f, name, &set, &n, rows));
  (void)H5Dclose(set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignTexts(SbForeign *f, const char *name, int64_t *n, size_t *width,
                              char **text)
{
  const SbVariable *v;
  const char *bytes;
  int64_t values;
  hid_t set, type;
  size_t size;
  H5T_class_t klass;

  PetscFunctionBeginUser;
  *text = NULL;
  if (f->file < 0) {
    PetscCall(variable_bytes(f, name, &v, &bytes));
    if (v->type.size != 1 || v->ndim > 2)
      SB_FOREIGN_ERROR(f, "%s does not hold texts", name);
    *n = v->ndim == 2 ? v->size[0] : 1;
    *width = (size_t)(*n ? v->n / *n : 0);
    PetscCall(SbImportScratch(f->im, (size_t)v->n + 1, text));
    memcpy(*text, bytes, (size_t)v->n);
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // texts of one length, rows of characters or bytes, or arrays of bytes
  PetscCall(open_array(f, name, &set, &values, n));
  type = H5Dget_type(set);
  size = H5Tget_size(type);
  klass = H5Tget_class(type);
  if (H5Tdetect_class(type, H5T_VLEN) > 0 || H5Tis_variable_str(type) > 0 ||
      (klass != H5T_STRING && klass != H5T_ARRAY && !(klass == H5T_INTEGER && size == 1)))
    SB_FOREIGN_ERROR(f, "%s does not hold texts of one length", name);

  // one text, where there are bytes in a single row
  if (klass != H5T_ARRAY && size == 1) {
    const hid_t space = H5Dget_space(set);

    if (H5Sget_simple_extent_ndims(space) < 2)
      *n = 1;
    (void)H5Sclose(space);
  }
  *width = *n > 0 ? (size_t)(values / *n) * size : 0;
  PetscCall(SbImportScratch(f->im, (size_t)values * size + 1, text));
  if (values && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, *text) < 0)
    SB_FOREIGN_ERROR(f, "%s cannot be read; the file is damaged, write or copy it again", name);
  (void)H5Tclose(type);
  (void)H5Dclose(set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens an attribute of one value; negative: there is none. */
static hid_t open_attribute(const SbForeign *f, const char *object, const char *name)
{
  hid_t attribute, space;
  hssize_t n;

  if (f->file < 0 || H5Aexists_by_name(f->file, object, name, H5P_DEFAULT) <= 0)
    return -1;
  attribute = H5Aopen_by_name(f->file, object, name, H5P_DEFAULT, H5P_DEFAULT);
  space = H5Aget_space(attribute);
  n = H5Sget_simple_extent_npoints(space);
  (void)H5Sclose(space);
  if (n == 1)
    return attribute;
  (void)H5Aclose(attribute);
  return -1;
}

PetscBool SbForeignNumberOf(const SbForeign *f, const char *object, const char *name, double *value)
{
  const hid_t attribute = open_attribute(f, object, name);
  herr_t status;

  if (attribute < 0)
    return PETSC_FALSE;
  status = H5Aread(attribute, H5T_NATIVE_DOUBLE, value);
  (void)H5Aclose(attribute);
  return (PetscBool)(status >= 0);
}

PetscBool SbForeignTextOf(const SbForeign *f, const char *object, const char *name, size_t size,
                          char value[])
{
  const SbVariable *v = f->file < 0 ? SbNetcdfFind(f, object) : NULL;
  const hid_t attribute = open_attribute(f, object, name);
  char text[256] = "";
  char *long_text = NULL;
  hid_t type;

  value[0] = 0;
  if (v && !strcmp(name, "elem_type"))
    (void)snprintf(value, size, "%s", v->element_type);
  if (attribute < 0)
    return (PetscBool)(value[0] != 0);
  type = H5Aget_type(attribute);
  if (H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) > 0) {
    if (H5Aread(attribute, type, &long_text) >= 0 && long_text)
      (void)snprintf(text, sizeof(text), "%s", long_text);
    if (long_text)
      (void)H5free_memory(long_text);
  } else if (H5Tget_class(type) == H5T_STRING && H5Tget_size(type) < sizeof(text))
    (void)H5Aread(attribute, type, text);
  (void)H5Tclose(type);
  (void)H5Aclose(attribute);
  SbForeignText(text, strlen(text), 0, size, value);
  return (PetscBool)(value[0] != 0);
}

typedef struct {
  SbForeign *file;
  SbCount n;
  char (*name)[SB_GROUP_MAX];
  PetscErrorCode ierr;
} Names;

static herr_t add_name(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  Names *names = (Names *)ctx;

  (void)where, (void)info;
  if (strlen(name) >= SB_GROUP_MAX) // its path would lead nowhere
    return 0;
  names->ierr = SbImportGrow(names->file->im, &names->n, sizeof(*names->name), &names->name);
  if (!names->ierr)
    (void)snprintf(names->name[names->n.n - 1], SB_GROUP_MAX, "%s", name);
  return names->ierr ? -1 : 0;
}

PetscErrorCode SbForeignList(SbForeign *f, const char *group, PetscInt *n,
                             char (**name)[SB_GROUP_MAX])
{
  Names names = {.file = f};
  const hid_t object =
    !group[1] || SbForeignHas(f, group) ? H5Gopen2(f->file, group, H5P_DEFAULT) : -1;

  PetscFunctionBeginUser;
  if (object >= 0 && H5Literate(object, H5_INDEX_NAME, H5_ITER_INC, NULL, add_name, &names) < 0)
    SB_FOREIGN_ERROR(f, "the group %s cannot be read; the file is damaged", group);
  if (object >= 0)
    (void)H5Gclose(object);
  PetscCall(names.ierr);
  *n = names.n.n;
  *name = names.name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignGroup(SbForeign *f, PetscInt dim, int64_t number, const char *name,
                              PetscInt *group)
{
  PetscInt k = 0;

  PetscFunctionBeginUser;
  if (!name[0]) {
    PetscCall(SbImportGroup(f->im, dim, number, NULL, group));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  while (k < f->nname.n && strcmp(f->name[k], name) != 0)
    k++;
  if (k == f->nname.n) {
    PetscCall(SbImportGrow(f->im, &f->nname, sizeof(*f->name), &f->name));
    (void)snprintf(f->name[k], SB_GROUP_MAX, "%s", name);
  }
  PetscCall(SbImportGroup(f->im, dim, SB_DECK_TAG + k, name, group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignVertices(SbForeign *f, PetscInt n, const double x[], PetscBool rows)
{
  PetscFunctionBeginUser;
  PetscCall(SbImportSetVertices(f->im, n));
  for (PetscInt v = 0; v < n; v++)
    for (int k = 0; k < 3; k++)
      f->im->x[3 * v + k] = rows ? x[3 * v + k] : x[(size_t)k * (size_t)n + (size_t)v];
  PetscCall(SbImportScratch(f->im, (size_t)n * sizeof(*f->point), &f->point));
  for (PetscInt v = 0; v < n; v++)
    f->point[v] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignElement(SbForeign *f, int type, const double node[], PetscInt tags,
                                PetscInt *item)
{
  SbImport *im = f->im;
  const int dim = SbGmshTypes[type].dim;
  const int n = PetscMin(SbGmshTypes[type].nnode, 10);
  const PetscInt before = im->item[dim].n;
  PetscInt vert[10] = {0};

  PetscFunctionBeginUser;
  f->nelement++;
  for (int k = 0; k < n; k++) {
    const double v = node[k];

    if (!(v >= 1 && v <= im->nvert) || v != PetscFloorReal(v))
      SB_FOREIGN_ERROR(f, "element %lld uses node %g; there are %lld, from 1 on",
                       (long long)f->nelement, v, (long long)im->nvert);
    vert[type == SB_GMSH_TET10 ? SbGmshNode(k) : k] = (PetscInt)v - 1;
  }
  PetscCall(SbImportAddElement(im, type, vert, tags, f->nelement));
  if (item)
    *item = im->item[dim].n > before ? before : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForeignAddNode(SbForeign *f, PetscInt v, PetscInt group)
{
  PetscFunctionBeginUser;
  if (f->point[v] < 0) {
    f->point[v] = f->im->item[0].n;
    PetscCall(SbImportAddItem(f->im, 0, &v, 0, f->im->vert_number[v]));
  }
  PetscCall(SbImportAddMember(f->im, 0, f->point[v], group));
  PetscFunctionReturn(PETSC_SUCCESS);
}
