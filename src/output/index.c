/*
  The index files of fields.h5 for viewers: fields.xmf and fields.vtkhdf, or contacts.xmf and
  contacts.vtkhdf. Rank 0 keeps the list, of which vtkhdf.c makes the one file; the text of the
  other grows with it.

  Of XDMF only what both vtkXdmfReader and vtkXdmf3Reader support: one temporal collection of
  uniform grids, every array named by its full path in the HDF5 file, no references, no hyperslabs.

  Points are a mesh of one vertex per cell, said explicitly: without that vtkXdmf3Reader finds no
  cells. As neither reader takes a grid without points (vtkXdmf3Reader crashes), a frame without any
  gets a dummy one.
*/
#include <stdlib.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbmeshio.h"

PetscErrorCode SbIndexCreate(SbOutput out, const char *name, const PetscReal *nowhere,
                             SbIndex *index)
{
  SbIndex x;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&x));
  SbFormat(sizeof(x->xmf), x->xmf, "%s/%s.xmf", out->dir, name);
  SbFormat(sizeof(x->vtkhdf), x->vtkhdf, "%s/%s.vtkhdf", out->dir, name);
  (void)unlink(x->xmf);
  (void)unlink(x->vtkhdf);
  x->points = (PetscBool)(nowhere != NULL);
  x->corners = 1;
  if (nowhere)
    PetscCall(PetscArraycpy(x->nowhere, nowhere, 3));
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
  if (!x)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < x->narray; i++) {
    PetscCall(PetscFree(x->array[i].name));
    PetscCall(PetscFree(x->array[i].piece));
  }
  PetscCall(PetscFree(x->array));
  PetscCall(PetscFree(x->part));
  PetscCall(PetscFree(x->frame));
  (void)fclose(x->file);
  free(x->text);
  PetscCall(PetscFree(*index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds group/dataset of fields.h5 as a piece of the array of this name, which is created if it is
   new. */
static PetscErrorCode add_piece(SbIndex x, const SbArray *like, PetscInt block, const char *group,
                                const char *dataset)
{
  SbArray *a = NULL;
  SbPiece *piece;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < x->narray && !a; i++)
    if (!strcmp(x->array[i].name, like->name))
      a = &x->array[i];
  if (!a) {
    PetscCall(SbReserve(x->narray + 1, sizeof(SbArray), &x->array_size, &x->array));
    a = &x->array[x->narray++];
    *a = *like;
    PetscCall(PetscStrallocpy(like->name, (char **)&a->name));
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
  SbArray a = {
    .ncomp = 1, .bytes = 4, .whole = PETSC_TRUE, .cell = PETSC_TRUE, .constant = PETSC_TRUE};

  (void)where, (void)info;
  if (!strcmp(name, "vertices") || !strcmp(name, "x") ||
      !strcmp(name, x->corners > 4 ? "cells" : "cells10"))
    return 0;
  a.name = strncmp(name, "cells", 5) ? name : "Connectivity";
  a.cell = (PetscBool)(strncmp(name, "set_", 4) != 0);
  if (a.name != name)
    a.ncomp = (int)x->corners;
  l->ierr = add_piece(x, &a, x->npart - 1, l->group, name);
  return l->ierr ? -1 : 0;
}

PetscErrorCode SbIndexSetMesh(SbIndex x, hid_t file, PetscInt step)
{
  char group[SB_MESH_NAME + 1] = "/";
  const hid_t mesh = SbH5OpenGroup(file, SbOutputMeshName(step, group + 1));
  List list = {.index = x, .group = group};

  PetscFunctionBeginUser;
  x->corners = mesh >= 0 && H5Lexists(mesh, "cells10", H5P_DEFAULT) > 0 &&
                   H5Lexists(mesh, "parent", H5P_DEFAULT) <= 0
                 ? 10
                 : 4;
  PetscCall(add_part(x, (PetscInt)SbH5Rows(mesh, "x", NULL),
                     (PetscInt)SbH5Rows(mesh, "cells", NULL), group));
  if (mesh >= 0)
    (void)H5Literate(mesh, H5_INDEX_NAME, H5_ITER_INC, NULL, list_array, &list);
  if (mesh >= 0)
    (void)H5Gclose(mesh);
  PetscCall(list.ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n rows of an array; for n = 0 the single row given. */
static void put_item(SbIndex x, const SbArray *a, const SbPiece *piece, PetscInt n,
                     const PetscReal single[])
{
  const char *type = a->whole ? "Int" : "Float";

  if (n) {
    SbXdmfArray(x->file, n, a->ncomp, type, piece->bytes, "fields.h5:%s", piece->path);
    return;
  }
  (void)fprintf(x->file,
                "<DataItem Dimensions=\"1%s\" NumberType=\"%s\" Precision=\"%d\" Format=\"XML\">",
                a->ncomp > 1 ? " 3" : "", type, piece->bytes);
  for (int k = 0; k < a->ncomp; k++)
    (void)fprintf(x->file, "%s%.17g", k ? " " : "", single[k]);
  (void)fputs("</DataItem>", x->file);
}

/* Adds the last frame to the text. */
static void put_grid(SbIndex x)
{
  static const PetscReal none[3] = {0., 0., 0.};
  static const PetscReal nobody[1] = {-1.};
  const PetscInt f = x->nframe - 1;
  const PetscInt p = x->frame[f].part;
  const PetscInt n = x->part[p].npoint;
  const PetscInt ncell = x->part[p].ncell;
  const SbArray whole = {.ncomp = (int)x->corners, .whole = PETSC_TRUE};
  const SbArray vector = {.ncomp = 3};
  SbPiece cells = {.bytes = 4};
  SbPiece places = {.bytes = 8};
  const char *items = "cells";
  const char *topology = "Tetrahedron";

  /* points: vertices at rest, or those of contact */
  if (x->points) {
    items = "point";
    topology = "Polyvertex";
  } else if (x->corners > 4) {
    items = "cells10";
    topology = "Tetrahedron_10";
  }
  SbFormat(sizeof(cells.path), cells.path, "%s/%s", x->part[p].group, items);
  SbFormat(sizeof(places.path), places.path, "%s/x", x->part[p].group);
  for (PetscInt i = 0; i < x->narray && x->points; i++)
    if (!strcmp(x->array[i].name, "Points"))
      places.bytes = x->array[i].piece[f].bytes;
  (void)fprintf(x->file, "<Grid Name=\"%s\" GridType=\"Uniform\">\n<Time Value=\"%.17g\"/>\n",
                x->points ? "contacts" : "bodies", x->frame[f].time);
  (void)fprintf(x->file, "<Topology TopologyType=\"%s\" NumberOfElements=\"%" PetscInt_FMT "\"%s>",
                topology, PetscMax(ncell, 1), x->points ? " NodesPerElement=\"1\"" : "");
  put_item(x, &whole, &cells, ncell, none);
  (void)fputs("</Topology>\n<Geometry GeometryType=\"XYZ\">", x->file);
  put_item(x, &vector, &places, n, x->nowhere);
  (void)fputs("</Geometry>\n", x->file);

  /* values of the mesh and of the frame */
  for (PetscInt i = 0; i < x->narray; i++) {
    const SbArray *a = &x->array[i];
    const SbPiece *piece = &a->piece[a->npiece - 1];
    const char *name = strrchr(piece->path, '/') + 1; // "position": points in VTK's own format
    const char *type = "Tensor6";

    if (piece->block != (a->constant ? p : f) || !strcmp(a->name, "Connectivity") ||
        !strcmp(name, "x"))
      continue;
    if (a->ncomp == 1)
      type = "Scalar";
    else if (a->ncomp == 3)
      type = "Vector";
    (void)fprintf(x->file, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">", name, type,
                  a->cell ? "Cell" : "Node");
    put_item(x, a, piece, a->cell ? ncell : n, a->whole ? nobody : none);
    (void)fputs("</Attribute>\n", x->file);
  }
  (void)fputs("</Grid>\n", x->file);
}

PetscErrorCode SbIndexAdd(SbIndex x, PetscReal time, const char *group, PetscInt npoint, PetscInt n,
                          const SbArray array[])
{
  SbArray points = {.name = "Points", .ncomp = 3, .bytes = 8};
  const char *where = NULL;

  PetscFunctionBeginUser;
  if (x->points)
    PetscCall(add_part(x, npoint, npoint, group));
  for (const SbArray *a = array; a < array + n; a++) {
    if (strcmp(a->name, x->points ? "x" : "position")) {
      PetscCall(add_piece(x, a, x->nframe, group, a->name));
    } else {
      points.bytes = a->bytes;
      where = a->name;
    }
  }
  PetscCall(add_piece(x, &points, x->nframe, where ? group : x->part[x->npart - 1].group,
                      where ? where : "x"));

  /* the last part at a time, with the pieces that were added for it */
  PetscCall(SbReserve(x->nframe + 1, sizeof(*x->frame), &x->frame_size, &x->frame));
  x->frame[x->nframe].time = time;
  x->frame[x->nframe++].part = x->npart - 1;
  put_grid(x);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbIndexWrite(SbIndex x, PetscBool last, char message[SB_MESSAGE_MAX])
{
  static const char tail[] = "</Grid>\n</Domain>\n</Xdmf>\n";

  if (!x || message[0] || (x->points && !x->nframe))
    return;
  (void)fputs(tail, x->file);
  (void)fflush(x->file);
  SbFileReplace(x->xmf, x->text, x->size, message);
  (void)fseek(x->file, -(long)strlen(tail), SEEK_CUR); // the next grid goes before it
  if (!message[0])
    SbVtkhdfWrite(x, last, message);
}
