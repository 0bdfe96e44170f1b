/*
  choice.h - what the choice of a solver depends on, and the choice as a function of that alone.
*/
#pragma once
#include "sbsolver.h"

typedef struct {
  /* the system */
  PetscInt unknowns;
  PetscMPIInt ranks;
  PetscBool rigid;       /* some body is rigid */
  PetscBool p2;          /* some body is P2, none is CR, DG or rigid */
  PetscBool cr_dg;       /* some body is CR or DG, none is P2 */
  PetscBool faces;       /* some body is CR or DG */
  PetscBool dg;          /* some body is DG */
  PetscBool constraints; /* contact constrains nodes */
  PetscBool coupled;     /* the tangent couples nodes that share no cell */

  /* the bodies */
  PetscReal nu;          /* largest Poisson's ratio */
  PetscReal face_nu;     /* the same of CR and DG bodies, -1: there are none */
  PetscReal sliver_part; /* fraction of tets with an angle below SB_SLIVER */
  PetscBool slivers;     /* they are enough to matter */

  /* Some law always uses its exact tangent, which is indefinite in compression, so that CHOLMOD
     fails. Where Newton's method chooses the tangent (auto), such a failure makes it project the
     cells' tangents. */
  PetscBool indefinite;
  const char *package; /* the fastest factorisation for the system; NULL: there is none */

  SbSolverProblem problem;

  /* the user's options of PETSc */
  const SbSolverPreset *given; /* the row that a -pc_type or package asks for; NULL: none */
  const char *given_by;        /* the name of that option */
  PetscBool minres;            /* -ksp_type minres */

  /* where the rotated factorisation may be taken: nodes on the interface between ranks, and the
     largest number of them that it takes; else 0 and 0 */
  PetscInt interface, interface_most;
} SbSolverFacts;

/* The facts of the system and the bodies; the others are zero. Collective. */
PetscErrorCode SbSolverFindFacts(SbSpace space, SbSolverFacts *facts);

/* The solver for these facts, NULL where it is a factorisation and this PETSc has none; the reason
   in words. Not collective. */
const SbSolverPreset *SbSolverChooseByFacts(const SbSolverFacts *facts, size_t size, char reason[]);
