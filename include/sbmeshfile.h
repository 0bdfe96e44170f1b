/*
  sbmeshfile.h - layer 2: a mesh read by SbImportRead(), on one rank: measured, repaired, refined,
  written.

  Not collective. Errors: PETSC_ERR_USER_INPUT / PETSC_ERR_FILE_*, a line that names the file and
  what to do.
*/
#pragma once
#include "sbmesh.h"

typedef struct _p_SbImport SbImport; /* vertices, simplices of every dimension and their groups */

/* Whether a file holds a surface by its name: reading it fills it with tets, as body->tet says. */
PetscBool SbMeshFileIsSurface(const char *path);
/* Simplices of group i of a mesh, and their length, area or volume; m, m^2, m^3; 0 for points. */
PetscErrorCode SbMeshFileGroup(const SbImport *import, PetscInt i, PetscInt *n, PetscReal *size);

#define SB_ANGLE_BINS 18 /* of ten degrees */
#define SB_RATIO_BINS 8
extern const PetscReal SbRatioBinEdges[SB_RATIO_BINS]; /* lower ends of the bins of radius ratios */

typedef struct {
  SbBody body;                     /* the fields that SbMeshCreate() finds */
  PetscInt nedge, nface;           /* of the tets; nface counts each face once */
  PetscReal area;                  /* of the boundary, m^2 */
  PetscReal edge[3];               /* shortest, mean, longest, m */
  PetscReal max_dihedral;          /* degrees */
  PetscInt64 angle[SB_ANGLE_BINS]; /* dihedral angles, six for each tet */
  PetscInt64 ratio[SB_RATIO_BINS]; /* radius ratios of the tets, 1 for the regular tet */
} SbMeshStatistics;
/*
  SbMeshFileMeasure - statistics, after checks and repairs (unused vertices, orientation) as those
  of a run.

  Errors: what SbMeshCreate() refuses.
*/
PetscErrorCode SbMeshFileMeasure(SbImport *import, SbMeshStatistics *facts);

typedef struct {
  PetscReal merge_tolerance; /* vertices at most so far apart became one, m */
  PetscInt nwelded;          /* vertices that went into another one */
  PetscInt ncollapsed;       /* tets that used a vertex twice, dropped */
  PetscInt nflat;            /* flat tets, dropped */
  PetscInt nslit; /* those of them that had no face on the boundary: a slit without width is left */
  PetscInt nduplicate; /* duplicate tets, removed; their groups are joined */
  PetscInt nturned;    /* inverted tets, reoriented */
  PetscInt nunused;    /* vertices that no tet uses, dropped */
  PetscInt nitem; /* duplicate, collapsed or unused triangles, lines, points of groups, removed */
} SbRepair;
/*
  SbMeshFileRepair - makes a mesh that a run accepts, where dropping, turning and welding can do it.

  Input:
    merge_tolerance - vertices at most so far apart become one, m; 0: none; below 0: 1e-9 of the
    diagonal
  Output:
    done - counts of repairs
  Errors: remaining defects that SbMeshCreate() would refuse: overlapping tets, no tets.
*/
PetscErrorCode SbMeshFileRepair(SbImport *import, PetscReal merge_tolerance, SbRepair *done);

/* Cuts every tet into eight, every triangle into four, every line into two; groups are carried
   over. */
PetscErrorCode SbMeshFileRefine(SbImport *import);

typedef enum {
  SB_MESH_AUTO, /* by the name: .msh is text of version 4.1 */
  SB_MESH_MSH41,
  SB_MESH_MSH41_BINARY,
  SB_MESH_MSH22,
  SB_MESH_MSH22_BINARY,
  SB_MESH_H5
} SbMeshFormat;
/*
  SbMeshFileWrite - writes a mesh with all its groups: gmsh's .msh, or supple's .h5 with an .xmf
  beside it.

  The file is written beside its target and renamed when it is whole.
*/
PetscErrorCode SbMeshFileWrite(const SbImport *import, const char *path, SbMeshFormat format);
