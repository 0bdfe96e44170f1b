/*
  model_impl.h - functions shared by the files of src/model.
*/
#pragma once
#include "sbmodel.h"

/* model.c: an evaluation at t. Begin lends stage, with the arrays of U, V and A and shift_k = 1,
   and f[nnode][3], zero, of F; V, A and F may be NULL. Collective. */
typedef struct {
  Vec U, V, A, F;
  SbStage stage;
  PetscReal *f;
} SbEvaluation;
PetscErrorCode SbEvaluationBegin(SbModel model, PetscReal t, SbEvaluation *e);
PetscErrorCode SbEvaluationEnd(SbModel model, SbEvaluation *e);
/* rigid.c: the stiffness of rigid bodies, once their meshes are known. Not collective. */
PetscErrorCode SbModelStiffenRigid(SbModel model);
/* repeated.c: warns of effects that hold or fill the same surfaces, an error where they cannot.
   Collective. */
PetscErrorCode SbModelCheckRepeated(SbModel model);
/* f[nnode][3], zero before, = sign * f_ext, N; apart: without barrier contact. Not collective. */
PetscErrorCode SbModelExternalForces(SbModel model, const SbStage *stage, PetscBool apart,
                                     PetscReal sign, PetscReal f[]);
