/*
  sbmaterial.h - layer 1: material laws on batches of deformation gradients.

  A batch holds SB_BATCH tets side by side: every quantity is an array over lanes, so the compiler vectorises each loop.
  Laws know neither meshes nor elements. Sign and frame: F = dx/dX, P = dPsi/dF first Piola-Kirchhoff stress (Pa), row = current,
  column = reference; F[3*i+j] is F_ij.
*/
#pragma once
#include "sbbase.h"
#include "sbkernel.h"

typedef struct _p_SbMaterial *SbMaterial;

typedef struct {
  /* reads -body_<name>_...; scope = {"body", <law>, <name>} */
  PetscErrorCode (*setfromoptions)(SbMaterial m, const SbScope *scope);
  /* psi = energy per rest volume, J/m^3 */
  void (*energy)(const struct _p_SbMaterial *m, const SbLane F[9], SbLane psi);
  /* P = dPsi/dF, Pa */
  void (*stress)(const struct _p_SbMaterial *m, const SbLane F[9], SbLane P[9]);
  /* The tangent is the isotropic Hooke tensor (lambda, mu) turned by R: fills R. NULL when the law needs the full tangent.
     Set or cleared by setfromoptions (co-rotated: warped sets it). */
  void (*frame)(const struct _p_SbMaterial *m, const SbLane F[9], SbLane R[9]);
  /* C[9*(3*i+j) + 3*k+l] = dP_ij/dF_kl, Pa; symmetric in the pairs */
  void (*tangent)(const struct _p_SbMaterial *m, const SbLane F[9], SbLane C[81]);
  PetscErrorCode (*destroy)(SbMaterial m);
} SbMaterialOps;

struct _p_SbMaterial {
  char          law[SB_NAME_MAX];
  SbMaterialOps ops;
  PetscReal     E, nu;      /* Young's modulus, Pa; Poisson's ratio, [0, 0.5) or (-1, 0.5) */
  PetscReal     lambda, mu; /* Lame parameters, Pa */
  PetscReal     density;    /* kg/m^3 */
  PetscBool     linear;     /* stress is linear in F: K is constant */
  PetscBool     symmetric;  /* always true for hyperelastic laws */
  void         *data;
};

extern PetscFunctionList SbMaterialList;
PetscErrorCode SbMaterialRegister(const char *law, PetscErrorCode (*create)(SbMaterial), PetscInt nrows, const SbOption rows[]);
PetscErrorCode SbMaterialRegisterAll(void);
/* Creates the law by name and reads young, poisson, density and the law's own options. Not collective, same on all ranks. */
PetscErrorCode SbMaterialCreate(const char *law, const SbScope *body, SbMaterial *m);
PetscErrorCode SbMaterialDestroy(SbMaterial *m);
/* Largest wave speed sqrt((lambda + 2 mu) / rho) at rest, m/s. */
PetscReal      SbMaterialWaveSpeed(SbMaterial m);
