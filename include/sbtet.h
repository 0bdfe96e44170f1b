/*
  sbtet.h - layer 2: tets as arrays on one rank: faces, shape, checks. Not collective throughout.
*/
#pragma once
#include "sbmeshio.h"
#include "sbgeometry.h"

/* faces.c: which cells share a face */
typedef struct {
  PetscInt ncell;
  PetscInt *start; /* [nvert + 1] into `face`: faces by lowest vertex */
  SbKey
    *face; /* [4 ncell] of the two other vertices, ascending for each lowest; slots 4 cell + face */
  PetscInt *neighbour; /* [ncell][4] cell across face f (opposite vertex f), -1 on the boundary */
  PetscInt nboundary;
  PetscInt nshared;   /* faces of more than two cells */
  PetscInt shared[3]; /* three cells at the first one of these */
} SbFaces;

/* of face f, counter-clockwise seen from outside a positively oriented tet */
extern const int SbFaceVertex[4][3];

PetscErrorCode SbFacesCreate(PetscInt nvert, PetscInt ncell, const PetscInt cell[], SbFaces *faces);
PetscErrorCode SbFacesDestroy(SbFaces *faces);
/* Slots of the face with these vertices: 0 (no such face), 1 (boundary) or 2. */
PetscInt SbFacesFind(const SbFaces *faces, const PetscInt vert[3], PetscInt slots[2]);

/* check.c, quality.c */

/* Adds "what: n" to a note, unless n is 0. */
static inline void SbNoteCount(size_t size, char note[], const char *what, PetscInt n)
{
  if (n)
    SbAppend(size, note, "%s%s: %" PetscInt_FMT, note[0] ? ", " : "", what, n);
}

/* Leaves out vertices that no tet uses, and items with such a one; counts them in nunused and
   nlost. */
PetscErrorCode SbImportDropUnused(SbImport *import);
/* Removes unused vertices, orients cells, checks for defects; builds the faces. */
PetscErrorCode SbImportCheck(SbImport *import, SbFaces *faces);
/* Sums and maxima over tets and vertices; neutral where there are none. */
typedef struct {
  PetscInt nsliver;  /* tets with a dihedral angle below that wanted */
  PetscReal volume;  /* m^3 */
  PetscReal most[8]; /* cosine of a dihedral angle, radius ratio, -x, -y, -z, x, y, z */
} SbShape;
void SbImportShape(const SbImport *import, PetscReal degrees, SbShape *shape);

/*
  SbTetQuality - shape of a tet, positions in m: 3 r / R with the radii of the spheres in it and
  around it, 1 for the regular one, 0 for a flat one, negative when it is inverted. Not collective.
*/
PetscReal SbTetQuality(const PetscReal x[], const PetscInt vert[4]);
/* curve.c: of a tet with its edges off their middles by off[6][3], its volume, and the least
   Jacobian, where P2 uses it and at its nodes, over that of the straight tet. */
PetscReal SbTetCurvedVolume(const PetscReal x[], const PetscInt vert[4], const PetscReal off[18]);
PetscReal SbTetCurvedLeast(const PetscReal x[], const PetscInt vert[4], const PetscReal off[18]);
