/*
  effect_impl.h - shared by effects: formulas, paths, selection by sets.
*/
#pragma once
#include "sbeffect.h"

/* Names of all types. Not collective. */
#define SB_EFFECT_TYPES 32
PetscInt SbEffectTypes(const char *names[SB_EFFECT_TYPES]);

/* Reads the n formulas of an option; e owns them, and is no longer steady where one uses t.
   position: whether they may use x, y, z; an error (PETSC_ERR_USER_INPUT) if they do and may not.
   Not collective. */
PetscErrorCode SbEffectFormulas(SbEffect e, const SbScope *scope, const char *key, PetscInt n,
                                PetscBool position, SbFormula formulas[]);

/* A formula at time t; in a static run one without t grows with the load factor t. Not
   collective. */
PetscErrorCode SbEffectValueAt(SbEffect e, SbFormula formula, PetscReal t, PetscReal *value);
/* Its derivative by the time, by a difference over a millionth of the run; 0 in a static run. Not
   collective. */
PetscErrorCode SbEffectRateAt(SbEffect e, SbFormula formula, PetscReal t, PetscReal *rate);

/*
  Items of the named sets on this rank, each once even when it is in several of the sets.
  Collective; the caller releases the array with PetscFree(). Errors (PETSC_ERR_USER_INPUT, alike on
  all ranks): no such set; a set that selects nothing of the kind, with what it does select.

  SbEffectFacets - boundary facets of owned and ghost cells.
  SbEffectItems  - cells (all local ones when no set is named), vertices of the mesh, or nodes that
  can be
                   constrained; ascending, owned ones first. An error for a body with nodes at faces
                   of which the sets hold vertices but no face.
*/
PetscErrorCode SbEffectFacets(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacet **facets);
typedef enum {
  SB_ON_CELLS,
  SB_ON_VERTICES,
  SB_ON_NODES,
  SB_ON_FACETS
} SbOnKind;
PetscErrorCode SbEffectItems(SbSpace space, const SbEffectOn *on, SbOnKind kind, PetscInt *n,
                             PetscInt **items);

/*
  SbEffectPoint - a point of a cell with the barycentric coordinates L at rest: the basis functions
  phi, their number as the result, the place x, m, and the corners of the straight tet with the
  derivatives of the cell's map there, m. Not collective.
*/
PetscInt SbEffectPoint(SbSpace space, PetscInt cell, const PetscReal L[4],
                       PetscReal phi[SB_CELL_NODES], PetscReal x[3], PetscReal corner[4][3]);

/*
  SbPlaceFind - the nodes whose mean displacement is that of a point of a body, at rest. Collective;
  release it with SbPlaceDestroy(). A point outside moves to the nearest place.

  body: -1: the one that holds the point. option: for messages. Errors (PETSC_ERR_USER_INPUT, alike
  on all ranks): two bodies hold the point.
*/
typedef struct {
  PetscInt body;
  PetscReal x[3];    /* the place at rest, m */
  PetscReal off;     /* its distance from the point, m; 0: the body holds the point */
  PetscInt n;        /* its nodes */
  PetscInt *gnode;   /* [n] global numbers, ascending; alike on all ranks */
  PetscReal *weight; /* [n] of the mean, sum 1 */
} SbMeanPlace;
PetscErrorCode SbPlaceFind(SbSpace space, const char *option, PetscInt body,
                           const PetscReal point[3], SbMeanPlace *place);
PetscErrorCode SbPlaceDestroy(SbMeanPlace *place);

/* in[nbody]: whether a body is named, all if none is. Error (PETSC_ERR_USER_INPUT, alike on all
   ranks): a name is that of no body. Not collective. */
PetscErrorCode SbEffectBodies(SbSpace space, const SbEffectOn *on, PetscBool in[]);

/* Basis functions of a cell at the barycentric coordinates L; returns their number. */
static inline PetscInt SbCellBasis(SbSpace space, PetscInt cell, const PetscReal L[4],
                                   PetscReal phi[SB_CELL_NODES])
{
  if (SbSpaceCellElement(space, cell)->nodes_per[1]) {
    SbQuadraticBasis(L, phi);
    return SB_CELL_NODES;
  }
  for (int a = 0; a < 4; a++) {
    phi[a] = 0;
    for (int c = 0; c < 4; c++)
      phi[a] += L[c] * SbSpaceCornerBasis(space, cell, c)[a];
  }
  return 4;
}
