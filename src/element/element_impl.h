/*
  element_impl.h - constructors of the elements.
*/
#pragma once
#include <sbelement.h>

PetscErrorCode SbElementCreate_P1(SbElement e);
PetscErrorCode SbElementCreate_P2(SbElement e);
PetscErrorCode SbElementCreate_CR(SbElement e);
PetscErrorCode SbElementCreate_DG(SbElement e);
/* Gradients of the barycentric coordinates 1..3 of a tet and its volume: SbElementOps.tabulate of P1. */
void SbTabulateP1(const PetscReal x[4][3], PetscReal g[3][3], PetscReal *V);
