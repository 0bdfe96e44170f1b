/*
  sbgmsh.h - layer 2: the gmsh library at work in a process of its own: it makes tetrahedra. Rank 0
  only.

  SbGmshRun() forks; the child loads libgmsh and calls a function of type SbGmshWork with a fresh,
  empty model. What this puts into its SbImport comes back to the caller. It sees all memory of the
  caller as it was (its ctx may point anywhere), but what it changes there stays in the child. A
  PETSc error in the function is raised in the caller with the same code and text. A crash of gmsh,
  or one that does not end in time, is an error of the caller too; the memory of gmsh goes with the
  child. A scene that does not call SbGmshRun() never loads the library. For an example see
  src/surface/tet_gmsh.c.

  The functions are those of gmshc.h without the prefix `gmsh` (reference manual of gmsh, "Gmsh
  API"; one that is missing below is a line more), with the same arguments but the last, the error
  code, which SB_GMSH() adds and checks. Arrays of gmsh go back by gmsh->Free(). It prints nothing;
  with its one thread the same input gives the same mesh.
*/
#pragma once
#include "sbmeshio.h"

/* type, name, arguments: as in gmshc.h from 4.8 to 4.15, alike (gmshModelAddPhysicalGroup() is
   not). */
#define SB_GMSH_FUNCTIONS(X)                                                                    \
  X(void, OptionSetNumber, (const char *, double, int *))                                       \
  X(void, ModelAdd, (const char *, int *))                                                      \
  X(void, ModelGetEntities, (int **, size_t *, int, int *))                                     \
  X(int, ModelAddDiscreteEntity, (int, int, int *, size_t, int *))                              \
  X(void, ModelMeshGenerate, (int, int *))                                                      \
  X(void, ModelMeshOptimize, (const char *, int, int, int *, size_t, int *))                    \
  X(void, ModelMeshClassifySurfaces, (double, int, int, double, int, int *))                    \
  X(void, ModelMeshCreateGeometry, (int *, size_t, int *))                                      \
  X(void, ModelMeshAddNodes,                                                                    \
    (int, int, size_t *, size_t, double *, size_t, double *, size_t, int *))                    \
  X(void, ModelMeshAddElementsByType, (int, int, size_t *, size_t, size_t *, size_t, int *))    \
  X(void, ModelMeshGetNodes,                                                                    \
    (size_t **, size_t *, double **, size_t *, double **, size_t *, int, int, int, int, int *)) \
  X(void, ModelMeshGetElementsByType,                                                           \
    (int, size_t **, size_t *, size_t **, size_t *, int, size_t, size_t, int *))                \
  X(int, ModelGeoAddSurfaceLoop, (int *, size_t, int, int *))                                   \
  X(int, ModelGeoAddVolume, (int *, size_t, int, int *))                                        \
  X(void, ModelGeoSynchronize, (int *))                                                         \
  X(void, LoggerStart, (int *))                                                                 \
  X(void, LoggerGet, (char ***, size_t *, int *))

typedef struct {
  const char *where; /* begins every message */
  void (*Free)(void *);
#define SB_GMSH_MEMBER(type, name, arguments) type(*name) arguments;
  SB_GMSH_FUNCTIONS(SB_GMSH_MEMBER)
#undef SB_GMSH_MEMBER
} SbGmsh;

/* Calls a function of gmsh; its error becomes one of PETSc with its message. SB_GMSH0(): no
   arguments. */
#define SB_GMSH(gmsh, function, ...)                  \
  do {                                                \
    int sb_error = 0;                                 \
    (void)(gmsh)->function(__VA_ARGS__, &sb_error);   \
    if (sb_error)                                     \
      PetscCall(SbGmshError(gmsh, "gmsh" #function)); \
  } while (0)
#define SB_GMSH0(gmsh, function)                      \
  do {                                                \
    int sb_error = 0;                                 \
    (void)(gmsh)->function(&sb_error);                \
    if (sb_error)                                     \
      PetscCall(SbGmshError(gmsh, "gmsh" #function)); \
  } while (0)

typedef PetscErrorCode (*SbGmshWork)(const SbGmsh *gmsh, void *ctx, SbImport *result);

typedef struct {
  const char *where; /* begins every message, as SbImport.where */
  const char *doing; /* "read the file": for "gmsh crashed while it read the file" */
  PetscReal seconds; /* it is stopped after that time, s */
  SbGmshWork work;
  void *ctx;
} SbGmshJob;

/*
  SbGmshRun - runs job->work in a child process with the gmsh library, and brings back what it
  filled in.

  Not collective; for rank 0. Replaces vertices and items of `result`; groups do not come back.

  Errors: those of the work function; PETSC_ERR_USER_INPUT: no library; PETSC_ERR_FILE_UNEXPECTED:
  gmsh crashes or takes longer than job->seconds; PETSC_ERR_SYS: no child process.
*/
PetscErrorCode SbGmshRun(const SbGmshJob *job, SbImport *result);

/* The error of a function of gmsh that failed. */
PetscErrorCode SbGmshError(const SbGmsh *gmsh, const char *function);
