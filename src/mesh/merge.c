/*
  merge.c - all bodies in one piece, on rank 0: read, placed, checked, marked by sets, numbered one after the other.

  Reading a mesh takes the most memory here, on one rank: what is no longer needed is freed before the next thing is made.

  Original numbers follow from here: bodies in the order of the scenario, vertices and cells in the order of their files.
*/
#include "mesh_impl.h"

/* A body before the merge. */
typedef struct {
  SbFaces faces;
  SbMasks masks;
} Part;

static PetscErrorCode prepare(PetscInt nbody, SbBody body[], PetscInt b, PetscInt nset, SbSet set[],
                              SbImport *im, Part *part)
{
  PetscFunctionBeginUser;
  if (body[b].in_memory)
    PetscCall(SbImportMemoryMesh(&body[b], im));
  else
    PetscCall(SbImportRead(&body[b], im));
  PetscCall(SbImportCheck(im, &part->faces));
  PetscCall(SbImportQuality(im, &part->faces, &body[b]));
  PetscCall(PetscCalloc1(im->nvert, &part->masks.vert));
  PetscCall(PetscCalloc1(im->item[3].n, &part->masks.cell));
  PetscCall(PetscCalloc1(4 * (size_t)im->item[3].n, &part->masks.face));
  PetscCall(SbSetsMark(im, &part->faces, nbody, body, b, nset, set, &part->masks));
  PetscCall(PetscFree(part->faces.face)); /* the neighbours are found */
  PetscCall(PetscFree(part->faces.start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the tets of a body behind those already there, and frees them. */
static PetscErrorCode append_cells(SbImport *im, Part *part, PetscInt vert0, PetscInt cell0, SbMergedMesh *w)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 4 * im->item[3].n; i++) {
    const PetscInt n = part->faces.neighbour[i];

    w->cell[4 * cell0 + i] = vert0 + im->item[3].vert[i];
    w->neighbour[4 * cell0 + i] = n < 0 ? -1 : cell0 + n;
  }
  PetscCall(SbFacesDestroy(&part->faces));
  for (int d = 0; d < 4; d++) {
    PetscCall(PetscFree(im->item[d].vert));
    PetscCall(PetscFree(im->item[d].tags));
    PetscCall(PetscFree(im->item[d].number));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What travels with the points of body b. */
static PetscErrorCode append_points(const SbImport *im, const Part *part, PetscInt b, PetscInt vert0,
                                    PetscInt cell0, SbMergedMesh *w)
{
  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    SbCellData *p = &w->data[cell0 + c];

    p->orig = cell0 + c;
    p->body = b;
    p->set = part->masks.cell[c];
    for (int f = 0; f < 4; f++) p->face[f] = part->masks.face[4 * c + f];
  }
  for (PetscInt v = 0; v < im->nvert; v++) {
    SbVertexData *p = &w->vertex[vert0 + v];

    p->orig = vert0 + v;
    p->body = b;
    p->set = part->masks.vert[v];
    for (int i = 0; i < 3; i++) p->x[i] = im->x[3 * v + i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All bodies one after the other. */
static PetscErrorCode merge(PetscInt nbody, const SbBody body[], SbImport im[], Part part[], SbMergedMesh *w)
{
  PetscInt vert0 = 0, cell0 = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(4 * (size_t)w->ncell, &w->cell));
  PetscCall(PetscMalloc1(4 * (size_t)w->ncell, &w->neighbour));
  for (PetscInt b = 0; b < nbody; b++) {
    PetscCall(append_cells(&im[b], &part[b], vert0, cell0, w));
    vert0 += body[b].nvert;
    cell0 += body[b].ncell;
  }
  PetscCall(PetscMalloc1(w->ncell, &w->data));
  PetscCall(PetscMalloc1(w->nvert, &w->vertex));
  vert0 = cell0 = 0;
  for (PetscInt b = 0; b < nbody; b++) {
    PetscCall(append_points(&im[b], &part[b], b, vert0, cell0, w));
    vert0 += body[b].nvert;
    cell0 += body[b].ncell;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode build(PetscInt nbody, SbBody body[], PetscInt nset, SbSet set[], SbImport im[],
                            Part part[], SbMergedMesh *w)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < nset; k++) set[k].nvert = set[k].nfacet = set[k].ncell = 0;
  for (PetscInt b = 0; b < nbody; b++) {
    PetscCall(prepare(nbody, body, b, nset, set, &im[b], &part[b]));
    PetscCheck(w->ncell <= PETSC_MAX_INT / 8 - body[b].ncell && w->nvert <= PETSC_MAX_INT / 8 - body[b].nvert,
               PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "body '%s': all bodies together have more tets than this build can number", body[b].name);
    w->ncell += body[b].ncell;
    w->nvert += body[b].nvert;
  }
  PetscCall(SbSetsCheck(nbody, body, im, nset, set));
  w->Nvert = w->nvert;
  w->Ncell = w->ncell;
  PetscCall(merge(nbody, body, im, part, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMergedMeshCreate(PetscInt nbody, SbBody body[], PetscInt nset, SbSet set[], SbMergedMesh *w)
{
  SbImport *im;
  Part *part;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(w, sizeof(*w)));
  PetscCall(PetscCalloc2(nbody, &im, nbody, &part));
  ierr = build(nbody, body, nset, set, im, part, w);
  for (PetscInt b = 0; b < nbody; b++) {
    PetscCall(SbImportDestroy(&im[b]));
    PetscCall(SbFacesDestroy(&part[b].faces));
    PetscCall(PetscFree(part[b].masks.vert));
    PetscCall(PetscFree(part[b].masks.cell));
    PetscCall(PetscFree(part[b].masks.face));
  }
  PetscCall(PetscFree2(im, part));
  if (ierr) PetscCall(SbMergedMeshDestroy(w));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMergedMeshDestroy(SbMergedMesh *w)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(w->cell));
  PetscCall(PetscFree(w->neighbour));
  PetscCall(PetscFree(w->remote));
  PetscCall(PetscFree(w->data));
  PetscCall(PetscFree(w->vertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}
