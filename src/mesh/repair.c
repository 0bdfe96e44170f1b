/*
  repair.c - repair of a mesh file by merging vertices, dropping and reorienting tets, until a run accepts it, if possible.

  In this order: vertices within a tolerance are merged into the first of them; tets that then use a vertex twice are dropped (they have collapsed and leave
  no gap); duplicate tets are dropped, and their groups go to the first one; flat tets are dropped and counted, and each one with a neighbour
  at every face leaves a slit of zero width, counted too; inverted tets are reoriented; group triangles and lines that have
  collapsed, are duplicates or are no face of a tet are dropped, and so are unused vertices. Overlapping tets cannot be repaired: the check of a run
  reports them.
*/
#include "sbgeometry.h"
#include "mesh_impl.h"

/* ------------------------------------------------------------------ welding */

/* Replaces each vertex in items by the first vertex within the tolerance; the others become unused. */
static PetscErrorCode weld(SbImport *im, PetscReal tolerance, SbRepair *done)
{
  PetscReal box[6], diagonal;
  PetscInt *map;

  PetscFunctionBeginUser;
  if (!im->nvert) PetscFunctionReturn(PETSC_SUCCESS);
  SbBoxClear(box);
  for (PetscInt v = 0; v < im->nvert; v++) SbBoxAdd(box, im->x + 3 * v);
  diagonal = SbBoxDiagonal(box);
  done->merge_tolerance = tolerance < 0 ? 1e-9 * diagonal : tolerance;
  if (done->merge_tolerance == 0 || !(diagonal > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(im->nvert, &map));
  PetscCall(SbWeld(im->nvert, im->x, done->merge_tolerance, PETSC_FALSE, map));
  for (PetscInt v = 0; v < im->nvert; v++) done->nwelded += map[v] != v;
  for (int d = 0; d < 4; d++)
    for (PetscInt i = 0; i < (d + 1) * im->item[d].n; i++) im->item[d].vert[i] = map[im->item[d].vert[i]];
  for (PetscInt i = 0; i < im->nmiddle.n; i++) {
    const PetscInt a = map[im->middle[i].end[0]], b = map[im->middle[i].end[1]];

    im->middle[i].end[0] = PetscMin(a, b);
    im->middle[i].end[1] = PetscMax(a, b);
  }
  PetscCall(PetscFree(map));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ single items */

/* Removes the marked items and counts them. */
static void drop_marked(SbItems *item, int dim, const PetscBool drop[], PetscInt *ndropped)
{
  PetscInt kept = 0;

  for (PetscInt i = 0; i < item->n; i++) {
    if (drop[i]) continue;
    SbItemsMove(item, dim, kept++, i);
  }
  *ndropped += item->n - kept;
  item->n = kept;
}

static PetscErrorCode drop_collapsed(SbImport *im, int dim, PetscInt *ndropped)
{
  SbItems *item = &im->item[dim];
  PetscBool *drop;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(item->n, &drop));
  for (PetscInt i = 0; i < item->n; i++) {
    const PetscInt *v = item->vert + (dim + 1) * (size_t)i;

    for (int a = 1; a <= dim; a++)
      for (int b = 0; b < a; b++) drop[i] = (PetscBool)(drop[i] || v[a] == v[b]);
  }
  drop_marked(item, dim, drop, ndropped);
  PetscCall(PetscFree(drop));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ flat tets, and triangles that are no face */

PetscErrorCode SbMeshFileRepair(SbImport *im, PetscReal tolerance, SbRepair *done)
{
  SbFaces faces;
  PetscErrorCode ierr;
  PetscInt turned, nitem = im->item[0].n + im->item[1].n + im->item[2].n, ndropped = 0, slots[2];
  PetscBool *drop, any = PETSC_FALSE;
  SbItems *item = &im->item[3];
  const PetscReal largest = SbImportLargest(im);
  PetscReal det, off;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(done, sizeof(*done)));
  PetscCall(PetscMemzero(&faces, sizeof(faces)));
  PetscCall(weld(im, tolerance, done));
  PetscCall(drop_collapsed(im, 3, &done->ncollapsed));
  PetscCall(SbImportJoinRepeats(im, 3, PETSC_TRUE, &done->nduplicate));
  for (int d = 0; d < 3; d++) {
    PetscCall(drop_collapsed(im, d, &ndropped));
    PetscCall(SbImportJoinRepeats(im, d, PETSC_TRUE, &ndropped));
  }
  // flat tets; one with a neighbour at every face leaves a slit
  PetscCall(PetscCalloc1(item->n, &drop));
  for (PetscInt c = 0; c < item->n; c++) {
    drop[c] = SbTetFlat(im->x, item->vert + 4 * c, largest, &det);
    any = (PetscBool)(any || drop[c]);
  }
  if (any) {
    PetscCall(SbFacesCreate(im->nvert, item->n, item->vert, &faces));
    for (PetscInt c = 0; c < item->n; c++) {
      const PetscInt *n = faces.neighbour + 4 * c;

      done->nslit += drop[c] && n[0] >= 0 && n[1] >= 0 && n[2] >= 0 && n[3] >= 0;
    }
    PetscCall(SbFacesDestroy(&faces));
    drop_marked(item, 3, drop, &done->nflat);
  }
  PetscCall(PetscFree(drop));
  PetscCheck(im->item[3].n, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: nothing is left: every tetrahedron is flat or uses a vertex twice; check -merge_tolerance "
             "and the scale of the file",
             im->where);
  turned = im->nreoriented;
  ierr = SbImportCheck(im, &faces);
  done->nturned = im->nreoriented - turned;
  done->nunused = im->nunused - done->nwelded;
  // triangles that are not a face of any tet
  PetscCall(PetscCalloc1(im->item[2].n, &drop));
  for (PetscInt i = 0; i < im->item[2].n && !ierr; i++)
    drop[i] = (PetscBool)!SbFacesFind(&faces, im->item[2].vert + 3 * i, slots);
  if (!ierr) drop_marked(&im->item[2], 2, drop, &ndropped);
  PetscCall(PetscFree(drop));
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(ierr);
  PetscCall(SbImportMiddles(im, NULL, &off)); /* curved edges of the remaining tets */
  for (PetscInt v = 0; v < im->nvert; v++) im->vert_number[v] = v + 1;
  done->nitem = nitem - im->item[0].n - im->item[1].n - im->item[2].n;
  im->nunused = im->nreoriented = im->nlost = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
