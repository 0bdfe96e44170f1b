/*
  repair.c - repair of a mesh file by merging vertices, dropping and reorienting tets, until a run
  accepts it, if possible.

  In this order: vertices within a tolerance are merged into the first of them; tets that then use a
  vertex twice are dropped (they have collapsed and leave no gap); duplicate tets are dropped, and
  their groups go to the first one; flat tets are dropped and counted, and each one with a neighbour
  at every face leaves a slit of zero width, counted too; inverted tets are reoriented; group
  triangles and lines that have collapsed, are duplicates or are no face of a tet are dropped, and
  so are unused vertices. Overlapping tets cannot be repaired: the check of a run reports them.
*/
#include "mesh_impl.h"

/* Replaces each vertex in items by the first vertex within the tolerance; the others become
   unused. */
static PetscErrorCode weld(SbImport *im, PetscReal tolerance, SbRepair *done)
{
  PetscReal box[6], diagonal;
  PetscInt *map;

  PetscFunctionBeginUser;
  if (!im->nvert)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbBoxClear(box);
  for (PetscInt v = 0; v < im->nvert; v++)
    SbBoxAdd(box, im->x + 3 * v);
  diagonal = SbBoxDiagonal(box);
  done->merge_tolerance = tolerance < 0 ? 1e-9 * diagonal : tolerance;
  if (done->merge_tolerance == 0 || !(diagonal > 0))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(im->nvert, &map));
  PetscCall(SbWeld(im->nvert, im->x, done->merge_tolerance, PETSC_FALSE, map));
  for (PetscInt v = 0; v < im->nvert; v++)
    done->nwelded += map[v] != v;
  for (int d = 0; d < 4; d++)
    for (PetscInt i = 0; i < (d + 1) * im->item[d].n; i++)
      im->item[d].vert[i] = map[im->item[d].vert[i]];
  for (PetscInt i = 0; i < im->nmiddle.n; i++) {
    const PetscInt a = map[im->middle[i].end[0]];
    const PetscInt b = map[im->middle[i].end[1]];

    im->middle[i].end[0] = PetscMin(a, b);
    im->middle[i].end[1] = PetscMax(a, b);
  }
  PetscCall(PetscFree(map));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drops the items of a dimension that use a vertex twice. */
static void drop_collapsed(SbImport *im, int dim, PetscInt *ndropped)
{
  SbItems *item = &im->item[dim];
  PetscInt kept = 0;

  for (PetscInt i = 0; i < item->n; i++) {
    const PetscInt *v = item->vert + (dim + 1) * (size_t)i;
    PetscBool twice = PETSC_FALSE;

    for (int a = 1; a <= dim; a++)
      for (int b = 0; b < a; b++)
        twice = (PetscBool)(twice || v[a] == v[b]);
    if (!twice)
      SbItemsMove(item, dim, kept++, i);
  }
  *ndropped += item->n - kept;
  item->n = kept;
}

PetscErrorCode SbMeshFileRepair(SbImport *im, PetscReal tolerance, SbRepair *done)
{
  SbFaces faces = {0};
  PetscErrorCode ierr;
  PetscInt turned;
  PetscInt nitem = im->item[0].n + im->item[1].n + im->item[2].n;
  PetscInt ndropped = 0;
  PetscInt slots[2];
  PetscInt kept = 0;
  PetscBool *flat;
  SbItems *item = &im->item[3];
  SbItems *tri = &im->item[2];
  const PetscReal largest = SbImportLargest(im);
  PetscReal det, off;
  SbStraightened straightened;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(done, sizeof(*done)));
  PetscCall(weld(im, tolerance, done));
  drop_collapsed(im, 3, &done->ncollapsed);
  PetscCall(SbImportJoinRepeats(im, 3, PETSC_TRUE, &done->nduplicate));
  for (int d = 0; d < 3; d++) {
    drop_collapsed(im, d, &ndropped);
    PetscCall(SbImportJoinRepeats(im, d, PETSC_TRUE, &ndropped));
  }

  // flat tets; one with a neighbour at every face leaves a slit
  PetscCall(PetscMalloc1(item->n, &flat));
  for (PetscInt c = 0; c < item->n; c++) {
    flat[c] = SbTetFlat(im->x, item->vert + 4 * c, largest, &det);
    done->nflat += flat[c];
  }
  if (done->nflat) {
    PetscCall(SbFacesCreate(im->nvert, item->n, item->vert, &faces));
    for (PetscInt c = 0; c < item->n; c++) {
      const PetscInt *n = faces.neighbour + 4 * c;

      done->nslit += flat[c] && n[0] >= 0 && n[1] >= 0 && n[2] >= 0 && n[3] >= 0;
      if (!flat[c])
        SbItemsMove(item, 3, kept++, c);
    }
    item->n = kept;
    PetscCall(SbFacesDestroy(&faces));
  }
  PetscCall(PetscFree(flat));
  PetscCheck(
    im->item[3].n, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: nothing is left: every tetrahedron is flat or uses a vertex twice; check -merge_tolerance "
    "and the scale of the file",
    im->where);
  turned = im->nreoriented;
  ierr = SbImportCheck(im, &faces);
  done->nturned = im->nreoriented - turned;
  done->nunused = im->nunused - done->nwelded;

  // triangles that are not a face of any tet
  kept = 0;
  for (PetscInt i = 0; i < tri->n && !ierr; i++)
    if (SbFacesFind(&faces, tri->vert + 3 * i, slots))
      SbItemsMove(tri, 2, kept++, i);
  if (!ierr)
    tri->n = kept;
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(ierr);
  PetscCall(SbImportMiddles(im, NULL, &off)); /* curved edges of the remaining tets */
  PetscCall(SbImportStraighten(PETSC_COMM_SELF, im, &straightened));
  done->nfolded = straightened.ntet;
  done->folded = straightened.number;
  PetscCall(PetscArraycpy(done->folded_at, straightened.at, 3));
  for (PetscInt v = 0; v < im->nvert; v++)
    im->vert_number[v] = v + 1;
  done->nitem = nitem - im->item[0].n - im->item[1].n - im->item[2].n;
  im->nunused = im->nreoriented = im->nlost = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
