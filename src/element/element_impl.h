/*
  element_impl.h - constructors of the elements.
*/
#pragma once
#include <sbelement.h>

PetscErrorCode SbElementCreate_P1(SbElement e);
