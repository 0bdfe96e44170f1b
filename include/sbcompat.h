/*
  sbcompat.h - every difference between the PETSc releases that supple builds with, in one place.

  Supported: 3.18 (Debian 12) and 3.25 or newer. The callback conventions changed one by one in 3.23
  and 3.24, so these (and the untested releases between 3.18 and them) are refused here instead of
  failing later.
*/
#pragma once
#include <petscsys.h>
#include <string.h>

#if PETSC_VERSION_LT(3, 18, 0) || (PETSC_VERSION_GE(3, 19, 0) && PETSC_VERSION_LT(3, 25, 0))
  #error \
    "supple needs PETSc 3.18.x, or 3.25 and newer: point PETSC_DIR/PETSC_ARCH or PKG_CONFIG_PATH at one"
#endif
#if defined(PETSC_USE_COMPLEX) || !defined(PETSC_USE_REAL_DOUBLE)
  #error "supple needs a PETSc with real double-precision scalars"
#endif

/* "3.18.5" */
#define SB_PETSC_VERSION                                                                          \
  PetscStringize(PETSC_VERSION_MAJOR) "." PetscStringize(PETSC_VERSION_MINOR) "." PetscStringize( \
    PETSC_VERSION_SUBMINOR)

#ifndef PETSC_SUCCESS
  #define PETSC_SUCCESS ((PetscErrorCode)0)
#endif

/* MPI datatype of PetscBool. */
#if PETSC_VERSION_LT(3, 23, 0)
  #define SB_MPI_BOOL MPIU_BOOL
#else
  #define SB_MPI_BOOL MPI_C_BOOL
#endif

/*
  Context of a destroy callback of a MATSHELL, PCSHELL, KSP, SNES: 3.18 hands over ctx, newer
  releases &ctx, of the same C type. SB_DESTROY_CTX(type, arg): the struct in both;
  SB_CTX_TO_DESTROY(ctx): what it passes. Of a PetscContainer, whose callback gets its pointer
  likewise: SbContainerSetDestroy().
*/
#if PETSC_VERSION_LT(3, 24, 0)
  #define SB_DESTROY_CTX(type, arg) ((type *)(arg))
  #define SB_CTX_TO_DESTROY(ctx) (ctx)
  #define SbContainerSetDestroy(container, f) PetscContainerSetUserDestroy(container, f)
#else
  #define SB_DESTROY_CTX(type, arg) (*(type **)(arg))
  #define SB_CTX_TO_DESTROY(ctx) (&(ctx))
  #define SbContainerSetDestroy(container, f) PetscContainerSetCtxDestroy(container, f)
#endif

/* "No limit" of an iteration count, and of a tolerance: -1 means PETSc's own default since 3.22. */
#if PETSC_VERSION_LT(3, 22, 0)
  #define SB_UNLIMITED PETSC_MAX_INT
  #define SB_UNLIMITED_REAL (-1.)
#else
  #define SB_UNLIMITED PETSC_UNLIMITED
  #define SB_UNLIMITED_REAL ((PetscReal)PETSC_UNLIMITED)
#endif

/* Any function, as MatShellSetOperation() takes it: SB_OPERATION(f). Newton's method met what is
   not a number. */
#if PETSC_VERSION_LT(3, 25, 0)
  #define SB_OPERATION(f) ((void (*)(void))(f))
  #define SB_SNES_DIVERGED_NAN SNES_DIVERGED_FNORM_NAN
#else
  #define SB_OPERATION(f) ((PetscErrorCodeFn *)(f))
  #define SB_SNES_DIVERGED_NAN SNES_DIVERGED_FUNCTION_NANORINF
#endif

/* The convergence test of a SNES, which sets its reason; for a SNESType of one's own. */
#if PETSC_VERSION_LT(3, 20, 0)
  #define SbSNESConverged(snes, iteration, xnorm, ynorm, fnorm) \
    (*(snes)->ops->converged)(snes, iteration, xnorm, ynorm, fnorm, &(snes)->reason, (snes)->cnvP)
#else
  #define SbSNESConverged(snes, iteration, xnorm, ynorm, fnorm) \
    SNESConverged(snes, iteration, xnorm, ynorm, fnorm)
#endif

/* Newton without a line search. Gram-Schmidt of GMRES is repeated where it loses digits. Whether
   PETSc calls -ts_dt deprecated, in favour of -ts_time_step; here both names always work. */
#if PETSC_VERSION_LT(3, 26, 0)
  #define SB_LINESEARCH_NONE SNESLINESEARCHBASIC
  #define SbKSPRefineOrthogonalization(ksp) \
    KSPGMRESSetCGSRefinementType(ksp, KSP_GMRES_CGS_REFINE_IFNEEDED)
  #define SB_TS_DT_RENAMED 0
#else
  #define SB_LINESEARCH_NONE SNESLINESEARCHNONE
  #define SbKSPRefineOrthogonalization(ksp) \
    KSPOrthogonalizationSetCGSRefinementType(ksp, KSP_ORTHOGONALIZATION_CGS_REFINE_IFNEEDED)
  #define SB_TS_DT_RENAMED 1
#endif

/* The partition operation of a PetscPartitioner, as SB_PARTITION_SIGNATURE(f) { ... } with these
   names of its arguments, and its call; graphs have no weights here. */
#if PETSC_VERSION_LT(3, 19, 0)
  #define SB_PARTITION_SIGNATURE(f)                                                   \
    PetscErrorCode f(PetscPartitioner partitioner, PetscInt nparts, PetscInt n,       \
                     PETSC_UNUSED PetscInt start[], PETSC_UNUSED PetscInt adjacent[], \
                     PETSC_UNUSED PetscSection vertex_weights,                        \
                     PETSC_UNUSED PetscSection part_weights, PetscSection section, IS *points)
  #define SbPartitionerPartition(part, nparts, n, start, adjacent, section, points) \
    PetscPartitionerPartition(part, nparts, n, start, adjacent, NULL, NULL, section, points)
#else
  #define SB_PARTITION_SIGNATURE(f)                                                   \
    PetscErrorCode f(PetscPartitioner partitioner, PetscInt nparts, PetscInt n,       \
                     PETSC_UNUSED PetscInt start[], PETSC_UNUSED PetscInt adjacent[], \
                     PETSC_UNUSED PetscSection vertex_weights,                        \
                     PETSC_UNUSED PetscSection edge_weights,                          \
                     PETSC_UNUSED PetscSection part_weights, PetscSection section, IS *points)
  #define SbPartitionerPartition(part, nparts, n, start, adjacent, section, points) \
    PetscPartitionerPartition(part, nparts, n, start, adjacent, NULL, NULL, NULL, section, points)
#endif

/* PetscHasExternalPackage(), also where CHOLMOD and UMFPACK are only known as SuiteSparse as a
   whole. */
static inline PetscErrorCode SbHasPackage(const char name[], PetscBool *has)
{
  PetscFunctionBeginUser;
  PetscCall(PetscHasExternalPackage(name, has));
  if (!*has && (!strcmp(name, "cholmod") || !strcmp(name, "umfpack")))
    PetscCall(PetscHasExternalPackage("suitesparse", has));
  PetscFunctionReturn(PETSC_SUCCESS);
}
