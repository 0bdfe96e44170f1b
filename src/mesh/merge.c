/*
  merge.c - merges all bodies into one mesh: reads, places and checks each body, marks its sets,
  numbers bodies one after the other.

  Rank 0 reads a body alone, unless its file format can be read in slabs: then each rank reads one
  slab (slab.c). An error on one rank is caught, sent to all ranks and raised by all of them, so
  that no rank waits for one that has failed.

  Peak memory of a run is reached while a mesh is read: arrays are freed before the next ones are
  allocated.

  Original numbers are assigned here: bodies in the order of the scenario, vertices and cells in the
  order of their files.
*/
#include "mesh_impl.h"

#define FEW 50000 /* tets of the largest body that rank 0 reads alone, in 0.02 s */

static PetscErrorCode prepare(PetscInt nbody, SbBody body[], PetscInt b, PetscInt nset, SbSet set[],
                              SbImport *shared, SbImport *im, SbPart *part)
{
  PetscFunctionBeginUser;
  if (body[b].in_memory)
    PetscCall(SbImportMemoryMesh(&body[b], im));
  else
    PetscCall(SbImportReadCopy(&body[b], b ? &body[b - 1] : NULL, shared, im));
  for (PetscInt i = 0; i < body[b].refine; i++)
    PetscCall(SbMeshFileRefine(im));
  PetscCall(SbImportCheck(im, &part->faces));
  PetscCall(SbImportQuality(im, &part->faces, &body[b]));
  if (!body[b].in_memory && strncmp(body[b].mesh, "box:", 4) != 0)
    PetscCall(SbImportCheckTouching(im, &part->faces, &body[b]));
  PetscCall(SbSetsMark(im, &part->faces, nbody, body, b, nset, set, &part->masks));
  PetscCall(SbImportCurve(PETSC_COMM_SELF, im, &body[b], part->masks.cell, &part->edge_off));
  PetscCall(SbSetsCount(PETSC_COMM_SELF, im->nvert, im->item[3].n, &part->masks, nset, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends all bodies to the merged mesh. */
static PetscErrorCode merge(PetscInt nbody, SbImport im[], SbPart part[], SbMergedMesh *w)
{
  PetscInt ncurved = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(4 * (size_t)w->ncell, &w->cell));
  PetscCall(PetscMalloc2(4 * (size_t)w->ncell, &w->neighbour, w->nremote, &w->remote));
  for (PetscInt b = 0; b < nbody; b++) {
    const PetscInt ncell = im[b].item[3].n;
    SbPart *q = &part[b];

    // append the tets of the body, then free its items
    for (PetscInt i = 0; i < 4 * ncell; i++) {
      const PetscInt n = q->faces.neighbour[i];

      w->cell[4 * q->cell0 + i] = q->vert0 + im[b].item[3].vert[i];
      w->neighbour[4 * q->cell0 + i] = n < 0       ? -1
                                       : n < ncell ? q->cell0 + n
                                                   : w->ncell + q->remote0 + n - ncell;
    }
    PetscCall(PetscArraycpy(w->remote + q->remote0, q->remote, q->nremote));
    PetscCall(SbFacesDestroy(&q->faces));
    for (int d = 0; d < 4; d++)
      PetscCall(SbItemsFree(&im[b].item[d]));
    im[b].item[3].n = ncell; /* the count is used below */
    for (PetscInt c = 0; c < ncell; c++)
      w->ncurved += q->masks.cell[c] & SB_CURVED ? 1 : 0;
  }
  PetscCall(PetscMalloc1(w->ncell, &w->data));
  PetscCall(PetscMalloc1(w->nvert, &w->vertex));
  PetscCall(PetscMalloc2(w->ncurved, &w->curved, 18 * (size_t)w->ncurved, &w->edge_off));
  for (PetscInt b = 0; b < nbody; b++) {
    const SbPart *q = &part[b];
    const PetscInt before = ncurved;

    // data of the cells and vertices of body b
    for (PetscInt c = 0; c < im[b].item[3].n; c++) {
      SbCellData *p = &w->data[q->cell0 + c];

      *p = (SbCellData){.orig = q->orig_cell + q->first + c, .body = b, .set = q->masks.cell[c]};
      PetscCall(PetscArraycpy(p->face, q->masks.face + 4 * c, 4));
      if (p->set & SB_CURVED)
        w->curved[ncurved++] = p->orig;
    }
    PetscCall(PetscArraycpy(w->edge_off + 18 * (size_t)before, q->edge_off,
                            18 * (size_t)(ncurved - before)));
    PetscCall(PetscFree(part[b].edge_off));
    for (PetscInt v = 0; v < im[b].nvert; v++) {
      const PetscReal *x = im[b].x + 3 * v;

      w->vertex[q->vert0 + v] = (SbVertexData){
        q->orig_vert + (q->orig ? q->orig[v] : v), b, q->masks.vert[v], {x[0], x[1], x[2]}};
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode build(MPI_Comm comm, const PetscBool slabs[], PetscInt nbody, SbBody body[],
                            PetscInt nset, SbSet set[], SbImport *shared, SbImport im[],
                            SbPart part[], SbMergedMesh *w)
{
  SbCaughtError caught = {0, ""};
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  for (PetscInt k = 0; k < nset; k++)
    set[k].nvert = set[k].nfacet = set[k].ncell = 0;
  for (PetscInt b = 0; b < nbody; b++) {
    if (slabs[b]) {
      PetscCall(SbSlabPrepare(comm, w->ncell, nbody, body, b, nset, set, &im[b], &part[b]));
    } else {
      if (!rank)
        SB_CATCH(&caught, prepare(nbody, body, b, nset, set, shared, &im[b], &part[b]));
      PetscCall(SbCaughtRaise(comm, &caught));
    }
    PetscCall(PetscFree2(part[b].faces.start, part[b].faces.face)); /* neighbours are known */
    part[b].vert0 = w->nvert;
    part[b].cell0 = w->ncell;
    part[b].remote0 = w->nremote;
    w->ncell += im[b].item[3].n;
    w->nvert += im[b].nvert;
    w->nremote += part[b].nremote;
  }
  if (!rank)
    SB_CATCH(&caught, SbSetsCheck(nbody, body, im, nset, set));
  PetscCall(SbCaughtRaise(comm, &caught));

  // broadcast bodies and sets of rank 0; pointers to meshes in memory are local to each rank
  PetscCallMPI(MPI_Bcast(set, (int)((size_t)nset * sizeof(*set)), MPI_BYTE, 0, comm));
  for (PetscInt b = 0; b < nbody; b++) {
    SbMemoryMesh *const own = body[b].in_memory;

    PetscCallMPI(MPI_Bcast(&body[b], (int)sizeof(*body), MPI_BYTE, 0, comm));
    body[b].in_memory = own;
    PetscCheck(w->Ncell <= PETSC_MAX_INT / 8 - body[b].ncell &&
                 w->Nvert <= PETSC_MAX_INT / 8 - body[b].nvert,
               comm, PETSC_ERR_USER_INPUT,
               "body '%s': all bodies together have more tets than this build can number",
               body[b].name);
    part[b].orig_vert = w->Nvert;
    part[b].orig_cell = w->Ncell;
    w->Nvert += body[b].nvert;
    w->Ncell += body[b].ncell;
  }
  PetscCall(merge(nbody, im, part, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMergedMeshCreate(MPI_Comm comm, SbReading reading, PetscInt nbody, SbBody body[],
                                  PetscInt nset, SbSet set[], SbMergedMesh *w)
{
  SbImport *im;
  SbImport shared = {0};
  SbPart *part;
  PetscBool *slabs;
  PetscErrorCode ierr;
  PetscMPIInt rank, size;
  PetscInt ncell;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(w, sizeof(*w)));
  w->nbody = nbody;
  w->body = body;
  PetscCall(PetscCalloc3(nbody, &im, nbody, &part, nbody, &slabs));

  // bodies that are read in slabs, decided on rank 0
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  for (PetscInt b = 0; b < nbody; b++) {
    if (size == 1 || rank || reading == SB_READING_RANK0)
      continue;
    SbImportSlabs(&body[b], &ncell);
    slabs[b] = (PetscBool)(ncell > (reading == SB_READING_SLABS ? 0 : FEW));
  }
  PetscCallMPI(MPI_Bcast(slabs, (PetscMPIInt)nbody, SB_MPI_BOOL, 0, comm));
  ierr = build(comm, slabs, nbody, body, nset, set, &shared, im, part, w);
  PetscCall(SbImportDestroy(&shared));
  for (PetscInt b = 0; b < nbody; b++) {
    PetscCall(SbImportDestroy(&im[b]));
    PetscCall(SbFacesDestroy(&part[b].faces));
    PetscCall(PetscFree3(part[b].masks.vert, part[b].masks.cell, part[b].masks.face));
    PetscCall(PetscFree(part[b].orig));
    PetscCall(PetscFree(part[b].edge_off));
    PetscCall(PetscFree(part[b].remote));
  }
  PetscCall(PetscFree3(im, part, slabs));
  if (ierr)
    PetscCall(SbMergedMeshDestroy(w));
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbMergedMeshDestroy(SbMergedMesh *w)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(w->cell));
  PetscCall(PetscFree2(w->neighbour, w->remote));
  PetscCall(PetscFree(w->data));
  PetscCall(PetscFree(w->vertex));
  PetscCall(PetscFree2(w->curved, w->edge_off));
  PetscFunctionReturn(PETSC_SUCCESS);
}
