/*
  The index files of fields.h5 for viewers: fields.xmf and fields.vtkhdf, or contacts.xmf and contacts.vtkhdf.
  Rank 0 keeps the list; xdmf.c and vtkhdf.c make the files of it.
*/
#include <stdlib.h>
#include <unistd.h>
#include "index.h"

PetscErrorCode SbIndexCreate(SbOutput out, const char *name, const PetscReal *nowhere, SbIndex *index)
{
  char file[SB_FILE_MAX];
  SbIndex x;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&x));
  SbFormat(sizeof(file), file, "%s.xmf", name);
  PetscCall(SbOutputPath(out, file, sizeof(x->xmf), x->xmf));
  SbFormat(sizeof(file), file, "%s.vtkhdf", name);
  PetscCall(SbOutputPath(out, file, sizeof(x->vtkhdf), x->vtkhdf));
  x->points = (PetscBool)(nowhere != NULL);
  if (nowhere) PetscCall(PetscArraycpy(x->nowhere, nowhere, 3));
  x->file = open_memstream(&x->text, &x->size);
  PetscCheck(x->file, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for %s", x->xmf);
  (void)fputs("<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
              "<Grid Name=\"frames\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
              x->file);
  *index = x;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbIndexDestroy(SbIndex *index)
{
  SbIndex x = *index;

  PetscFunctionBeginUser;
  if (!x) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < x->narray; i++) PetscCall(PetscFree(x->array[i].piece));
  PetscCall(PetscFree(x->array));
  PetscCall(PetscFree(x->part));
  PetscCall(PetscFree(x->frame));
  (void)fclose(x->file);
  free(x->text);
  PetscCall(PetscFree(*index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbIndexRemove(SbIndex x)
{
  (void)unlink(x->xmf);
  (void)unlink(x->vtkhdf);
}

/* Adds group/dataset of fields.h5 as a piece of the array of this name, which is created if it is new. */
static PetscErrorCode add_piece(SbIndex x, const SbArray *like, PetscInt block, const char *group,
                                const char *dataset)
{
  SbArray *a = NULL;
  SbPiece *piece;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < x->narray && !a; i++)
    if (!strcmp(x->array[i].name, like->name)) a = &x->array[i];
  if (!a) {
    PetscCall(SbReserve(x->narray + 1, sizeof(SbArray), &x->array_size, &x->array));
    a = &x->array[x->narray++];
    *a = *like;
  }
  a->bytes = PetscMax(a->bytes, like->bytes); // after a restart with another precision
  PetscCall(SbReserve(a->npiece + 1, sizeof(SbPiece), &a->size, &a->piece));
  piece = &a->piece[a->npiece++];
  piece->block = block;
  piece->bytes = like->bytes;
  SbFormat(sizeof(piece->path), piece->path, "%s/%s", group, dataset);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_part(SbIndex x, PetscInt npoint, PetscInt ncell, const char *group)
{
  PetscFunctionBeginUser;
  PetscCall(SbReserve(x->npart + 1, sizeof(SbPart), &x->part_size, &x->part));
  x->part[x->npart] = (SbPart){.npoint = npoint, .ncell = ncell};
  SbFormat(sizeof(x->part->group), x->part[x->npart++].group, "%s", group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  SbIndex index;
  const char *group;
  PetscErrorCode ierr;
} List;

/* An array of the mesh; viewers need neither `vertices` nor `cells10` beside linear tets. */
static herr_t list_array(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  List *l = (List *)ctx;
  const SbIndex x = l->index;
  SbArray a = {.ncomp = 1, .bytes = 4, .whole = PETSC_TRUE, .cell = PETSC_TRUE, .constant = PETSC_TRUE};

  (void)where, (void)info;
  if (!strcmp(name, "vertices") || !strcmp(name, "x") || !strcmp(name, x->corners > 4 ? "cells" : "cells10"))
    return 0;
  SbFormat(sizeof(a.name), a.name, "%s", !strcmp(name, "cells10") ? "cells" : name);
  a.cell = (PetscBool)(strncmp(name, "set_", 4) != 0);
  if (!strcmp(a.name, "cells")) a.ncomp = (int)x->corners;
  l->ierr = add_piece(x, &a, x->npart - 1, l->group, name);
  return l->ierr ? -1 : 0;
}

PetscErrorCode SbIndexSetMesh(SbIndex x, hid_t file, PetscInt step)
{
  char group[SB_MESH_NAME + 1] = "/";
  const hid_t mesh = SbH5OpenGroup(file, SbOutputMeshName(step, group + 1));
  List list = {.index = x, .group = group};

  PetscFunctionBeginUser;
  x->corners =
    mesh >= 0 && H5Lexists(mesh, "cells10", H5P_DEFAULT) > 0 && H5Lexists(mesh, "parent", H5P_DEFAULT) <= 0
      ? 10
      : 4;
  PetscCall(add_part(x, (PetscInt)SbH5Rows(mesh, "x", NULL), (PetscInt)SbH5Rows(mesh, "cells", NULL), group));
  if (mesh >= 0) (void)H5Literate(mesh, H5_INDEX_NAME, H5_ITER_INC, NULL, list_array, &list);
  if (mesh >= 0) (void)H5Gclose(mesh);
  PetscCall(list.ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbIndexAdd(SbIndex x, PetscReal time, const char *group, PetscInt npoint, PetscInt n,
                          const SbIndexValues values[])
{
  SbArray points = {.name = "Points", .ncomp = 3, .bytes = 8};
  const char *where = NULL;

  PetscFunctionBeginUser;
  if (x->points) PetscCall(add_part(x, npoint, npoint, group));
  for (PetscInt i = 0; i < n; i++) {
    SbArray a = {
      .ncomp = values[i].ncomp, .bytes = values[i].bytes, .whole = values[i].whole, .cell = values[i].cell};

    SbFormat(sizeof(a.name), a.name, "%s", values[i].name);
    if (!strcmp(a.name, x->points ? "x" : "position")) {
      points.bytes = a.bytes;
      where = values[i].name;
    } else {
      PetscCall(add_piece(x, &a, x->nframe, group, a.name));
    }
  }
  PetscCall(
    add_piece(x, &points, x->nframe, where ? group : x->part[x->npart - 1].group, where ? where : "x"));

  /* the last part at a time, with the pieces that were added for it */
  PetscCall(SbReserve(x->nframe + 1, sizeof(*x->frame), &x->frame_size, &x->frame));
  x->frame[x->nframe].time = time;
  x->frame[x->nframe++].part = x->npart - 1;
  SbXdmfAdd(x);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbIndexWrite(SbIndex x, PetscBool last, char message[SB_MESSAGE_MAX])
{
  if (x->points && !x->nframe) return;
  SbXdmfWrite(x, message);
  if (!message[0]) SbVtkhdfWrite(x, last, message);
}
