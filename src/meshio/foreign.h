/*
  foreign.h - shared by the readers of MED, Exodus and CGNS: named arrays of a file in HDF5 or in
  netCDF's classic format, and groups by their names.
*/
#pragma once
#include <ctype.h>
#include "meshio_impl.h"

/* A variable of netCDF's classic format. */
typedef struct {
  char name[SB_NAME_MAX];
  char element_type[SB_NAME_MAX]; /* its attribute elem_type, "": none */
  SbNumberType type;              /* kind 'c': characters */
  int ndim;
  int64_t size[2]; /* of the first two dimensions */
  int64_t n;       /* numbers in all */
  int64_t begin;   /* byte in the file */
} SbVariable;

typedef struct {
  SbImport *im;
  hid_t file;   /* -1: netCDF's classic format, in im->scan */
  size_t bytes; /* file size */
  SbCount nvariable, nname;
  SbVariable *variable;       /* [nvariable] */
  char (*name)[SB_GROUP_MAX]; /* [nname] of groups */
  PetscInt *point;            /* [nvert] item of each node that is in a set, -1: none */
  int64_t nelement;           /* elements so far */
} SbForeign;

#define SB_FOREIGN_ERROR(f, ...)                                                            \
  do {                                                                                      \
    char sb_text[512];                                                                      \
    (void)snprintf(sb_text, sizeof(sb_text), __VA_ARGS__);                                  \
    SbCleanName(sb_text, ' ');                                                              \
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: %s", (f)->im->where, sb_text); \
  } while (0)

/*
  SbForeignRead - opens a file of HDF5, or of netCDF's classic format where `classic`, and calls
  work(); HDF5 in a child process, as it may crash where the file is damaged.

  Not collective; rank 0.
*/
typedef PetscErrorCode (*SbForeignWork)(SbForeign *file);
PetscErrorCode SbForeignRead(const char *path, const char *kind, PetscBool classic,
                             SbForeignWork work, SbImport *import);

/* Whether there is an array, or in HDF5 a group. */
PetscBool SbForeignHas(const SbForeign *file, const char *name);
/* Numbers of an array as doubles; n: how many it must have, or -1, then returned. Scratch. */
PetscErrorCode SbForeignNumbers(SbForeign *file, const char *name, int64_t *n, double **value);
/* First dimension of an array. */
PetscErrorCode SbForeignRows(SbForeign *file, const char *name, int64_t *rows);
/* Texts of one length: n of them, each of `width` bytes without a terminating zero. */
PetscErrorCode SbForeignTexts(SbForeign *file, const char *name, int64_t *n, size_t *width,
                              char **text);
/* Copies text k of these, trimmed and clean. */
static inline void SbForeignText(const char *text, size_t width, int64_t k, size_t size,
                                 char name[])
{
  const char *from = text + (size_t)k * width;
  size_t n = 0;

  while (n < width && n + 1 < size && from[n])
    n++;
  memcpy(name, from, n);
  while (n && isspace((unsigned char)name[n - 1]))
    n--;
  name[n] = 0;
  SbCleanName(name, '?');
}
/* Attributes of an object of HDF5; false and `value` as it was if there is none. */
PetscBool SbForeignNumberOf(const SbForeign *file, const char *object, const char *name,
                            double *value);
PetscBool SbForeignTextOf(const SbForeign *file, const char *object, const char *name, size_t size,
                          char value[]);
/* Names of what is in a group of HDF5, in the order of the names; scratch. */
PetscErrorCode SbForeignList(SbForeign *file, const char *group, PetscInt *n,
                             char (**name)[SB_GROUP_MAX]);

/* The group of this name, or, where it is "", the one with this number. */
PetscErrorCode SbForeignGroup(SbForeign *file, PetscInt dim, int64_t number, const char *name,
                              PetscInt *group);
/* Vertices from coordinates x[3][n] (`rows`: x[n][3]). */
PetscErrorCode SbForeignVertices(SbForeign *file, PetscInt n, const double x[], PetscBool rows);
/* Adds an element of gmsh's type from its nodes, from 1 on, at node[k]; second-order tets
   have Abaqus' order. item: its index among those of its dimension, -1 where it has none. */
PetscErrorCode SbForeignElement(SbForeign *file, int type, const double node[], PetscInt tags,
                                PetscInt *item);
/* Adds node v, from 0 on, to a group of points. */
PetscErrorCode SbForeignAddNode(SbForeign *file, PetscInt v, PetscInt group);

/* netcdf.c: reads the header of netCDF's classic format, 1, 2 and 5, from import->scan. */
PetscErrorCode SbNetcdfHeader(SbForeign *file);
/* Variable of this name; NULL: there is none. */
const SbVariable *SbNetcdfFind(const SbForeign *file, const char *name);
