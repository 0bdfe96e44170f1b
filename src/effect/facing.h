/*
  facing.h - facets of two surfaces that face each other, whose meshes need not match: sums over the
  parts of the one under the other, for ties and periodic cells.
*/
#pragma once
#include "effect_impl.h"

#define SB_FACING_SLIVER 1e-12 /* of a facet's area: smaller parts are rounding */
#define SB_FACING_BESIDE 10.   /* distances within which places that are not held are looked for */

/* A facet with the cell behind it, as ranks send it. */
typedef struct {
  PetscReal x[3][3];      /* its corners, counter-clockwise seen from outside, m */
  PetscReal normal[3];    /* outward unit vector */
  PetscReal area, size;   /* m^2; longest side, m */
  PetscReal height;       /* of the cell over it, m */
  PetscReal corner[4][3]; /* those of the cell, m */
  PetscReal off[18];      /* curved: its edges off their middles, m */
  PetscReal basis[4][4];  /* without nodes at edges: weights of the nodes in the corners */
  PetscReal young, wave;  /* E, lambda + 2 mu, Pa; 0: rigid */
  PetscInt n;             /* nodes */
  PetscInt gnode[SB_CELL_NODES];
  PetscInt number; /* 4 cell_orig + face */
  PetscBool curved;
  PetscBool both; /* the other surface has it, too */
} SbFacing;

/* A patch that is being summed. */
typedef struct {
  PetscInt n, gnode[2 * SB_CELL_NODES];
  PetscInt of_b[SB_CELL_NODES]; /* B's nodes among them */
  PetscReal S[2 * SB_CELL_NODES][2 * SB_CELL_NODES], mean[2 * SB_CELL_NODES], area;
  PetscReal missed, farthest; /* what is too far apart: area, m^2, and distance, m */
} SbFacingSum;

/* The facets of a surface, those of all ranks on each. Collective; the caller frees them. Errors as
   those of SbEffectFacets(). */
PetscErrorCode SbFacingGather(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacing **side);
/* The basis functions of a side's cell at a place, in it or beyond; false: a curved cell has none
   there. Not collective. */
PetscBool SbFacingBasis(const SbFacing *side, const PetscReal x[3], PetscReal phi[SB_CELL_NODES]);
/* Sums over the part of a's facet that lies under one of b, no farther from it than `distance`, m;
   k: stiffness, Pa/m. Not collective. */
void SbFacingSumUp(const SbFacing *a, const SbFacing *b, PetscReal distance, PetscReal k,
                   SbFacingSum *sum);
