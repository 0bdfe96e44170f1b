/*
  meshio_impl.h - what the files of src/meshio/ share: the readers, the writers, sets that a file lists apart, a child process.
*/
#pragma once
#include "sbmeshio.h"

/* An array that grows by one at its end: unit bytes each, of which there are n. */
typedef struct {
  PetscInt n, capacity;
} SbCount;
PetscErrorCode SbImportGrow(SbCount *count, size_t unit, void *array);

/* scan.c: an integer as text or in binary of 4 or 8 bytes; `what` names what is expected there. */
PetscErrorCode SbScanInt4(SbScan *scan, const char *what, int64_t *value);
PetscErrorCode SbScanInt8(SbScan *scan, const char *what, int64_t *value);

/* A reader fills x, vert_number, items and groups from the file or description `text`. */
typedef PetscErrorCode (*SbReader)(const char *text, SbImport *body);
PetscErrorCode SbImportRead_Gmsh(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *body);
PetscErrorCode SbImportRead_TetGen(const char *path,
                                   SbImport *body); /* one of the files, or what they have in common */
PetscErrorCode SbImportRead_Netgen(const char *path, SbImport *body); /* .vol */
PetscErrorCode SbImportRead_NetgenNeutral(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Medit(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Mesh(const char *path,
                                 SbImport *body); /* .mesh: Medit, or the neutral format of Netgen */
PetscErrorCode SbImportRead_VTK(const char *path, SbImport *body);
PetscErrorCode SbImportRead_VTU(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Abaqus(const char *path, SbImport *body);
PetscErrorCode SbImportRead_UNV(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Box(const char *text, SbImport *body);
PetscErrorCode SbImportRead_H5(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Xdmf(const char *path, SbImport *body);
/* Block k of n of everything in an .h5 mesh of supple's own; its tets, without an error when there is no such mesh. */
PetscErrorCode SbImportSlab_H5(const char *path, PetscInt k, PetscInt n, SbImport *body, SbSlabRows *rows);
PetscErrorCode SbImportSlabs_H5(const char *path, PetscInt *ncell);

/* ------------------------------------------------------------------ group_membership.c: sets that are listed apart from their items */

/* Item `item` of dimension dim belongs to a group. */
typedef struct {
  PetscInt dim, item, group;
} SbGroupMember;
typedef struct {
  PetscInt n, capacity;
  SbGroupMember *row; /* [n] */
} SbGroupMembership;

PetscErrorCode SbGroupMembershipAdd(SbGroupMembership *members, PetscInt dim, PetscInt item, PetscInt group);
/* Gives every item the groups listed for it, beside those that it has; frees the list. */
PetscErrorCode SbGroupMembershipApply(SbGroupMembership *members, SbImport *im);
PetscErrorCode SbGroupMembershipDestroy(SbGroupMembership *members);

/* ------------------------------------------------------------------ write_gmsh.c, write_h5.c: one file, written to `path` as it is */

PetscErrorCode SbWrite_Gmsh(const SbImport *import, const char *path, SbMeshFormat format);
PetscErrorCode SbWrite_H5(const SbImport *import, const char *path);
/* The index for ParaView of a mesh that was written to `h5`. */
PetscErrorCode SbWrite_Xdmf(const SbImport *import, const char *path, const char *h5);

/* ------------------------------------------------------------------ child.c */

typedef PetscErrorCode (*SbChildWork)(void *ctx, SbImport *result);

/*
  SbChildRun - calls work(ctx, .) in a forked child, which sends what it filled in by a pipe. As SbGmshRun(); `who` did `doing`, for messages.
*/
PetscErrorCode SbChildRun(const char *who, const char *doing, PetscReal seconds, SbChildWork work, void *ctx,
                          SbImport *result);

/* whether another word stands on this line */
PetscBool SbScanFind(SbScan *scan, const char *text); /* moves to its beginning */

PetscErrorCode SbScanQuoted(SbScan *scan, const char *what, size_t size, char value[]); /* "in quotes" */
