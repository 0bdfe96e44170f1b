/*
  fields.xmf, and contacts.xmf: what ParaView and VTK open to find the frames of fields.h5.

  Only the part of XDMF that both vtkXdmfReader and vtkXdmf3Reader support: one temporal collection of uniform
  grids, every array named by its full path in the HDF5 file, no references, no hyperslabs. The text of all
  frames so far is kept, so that the file is whole after every frame: written beside its target and renamed.

  Points are a mesh of one vertex per cell, said explicitly: without that vtkXdmf3Reader finds no cells. As
  neither reader takes a grid without points (vtkXdmf3Reader crashes), a frame without any gets a dummy one.
*/
#include "index.h"
#include "sbmeshio.h"

/* n rows of an array; for n = 0 the single row given. */
static void put_item(SbIndex x, const SbArray *a, const SbPiece *piece, PetscInt n, const PetscReal single[])
{
  const char *type = a->whole ? "Int" : "Float";

  if (n) {
    SbXdmfArray(x->file, n, a->ncomp, type, piece->bytes, "fields.h5:%s", piece->path);
    return;
  }
  (void)fprintf(x->file, "<DataItem Dimensions=\"1%s\" NumberType=\"%s\" Precision=\"%d\" Format=\"XML\">",
                a->ncomp > 1 ? " 3" : "", type, piece->bytes);
  for (int k = 0; k < a->ncomp; k++) (void)fprintf(x->file, "%s%.17g", k ? " " : "", (double)single[k]);
  (void)fputs("</DataItem>", x->file);
}

void SbXdmfAdd(SbIndex x)
{
  static const PetscReal none[3] = {0., 0., 0.}, nobody[1] = {-1.};
  const PetscInt f = x->nframe - 1, p = x->frame[f].part, n = x->part[p].npoint, ncell = x->part[p].ncell;
  const SbArray whole = {.ncomp = x->points ? 1 : (int)x->corners, .whole = PETSC_TRUE},
                vector = {.ncomp = 3};
  SbPiece cells = {.bytes = 4}, places = {.bytes = 8};

  /* points: vertices at rest, or those of contact */
  SbFormat(sizeof(cells.path), cells.path, "%s/%s", x->part[p].group,
           x->points        ? "point"
           : x->corners > 4 ? "cells10"
                            : "cells");
  SbFormat(sizeof(places.path), places.path, "%s/x", x->part[p].group);
  for (PetscInt i = 0; i < x->narray && x->points; i++)
    if (!strcmp(x->array[i].name, "Points")) places.bytes = x->array[i].piece[f].bytes;
  (void)fprintf(x->file, "<Grid Name=\"%s\" GridType=\"Uniform\">\n<Time Value=\"%.17g\"/>\n",
                x->points ? "contacts" : "bodies", (double)x->frame[f].time);
  (void)fprintf(x->file, "<Topology TopologyType=\"%s\" NumberOfElements=\"%" PetscInt_FMT "\"%s>",
                x->points        ? "Polyvertex"
                : x->corners > 4 ? "Tetrahedron_10"
                                 : "Tetrahedron",
                PetscMax(ncell, 1), x->points ? " NodesPerElement=\"1\"" : "");
  put_item(x, &whole, &cells, ncell, none);
  (void)fputs("</Topology>\n<Geometry GeometryType=\"XYZ\">", x->file);
  put_item(x, &vector, &places, n, x->nowhere);
  (void)fputs("</Geometry>\n", x->file);

  /* values of the mesh and of the frame */
  for (PetscInt i = 0; i < x->narray; i++) {
    const SbArray *a = &x->array[i];
    const SbPiece *piece = &a->piece[a->npiece - 1];
    const char *name = strrchr(piece->path, '/') + 1; // "position" of what are points in VTK's own format

    if (piece->block != (a->constant ? p : f) || !strcmp(a->name, "cells") || !strcmp(name, "x")) continue;
    (void)fprintf(x->file, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">", name,
                  a->ncomp == 1   ? "Scalar"
                  : a->ncomp == 3 ? "Vector"
                                  : "Tensor6",
                  a->cell ? "Cell" : "Node");
    put_item(x, a, piece, a->cell ? ncell : n, a->whole ? nobody : none);
    (void)fputs("</Attribute>\n", x->file);
  }
  (void)fputs("</Grid>\n", x->file);
}

void SbXdmfWrite(SbIndex x, char message[SB_MESSAGE_MAX])
{
  static const char tail[] = "</Grid>\n</Domain>\n</Xdmf>\n";

  (void)fputs(tail, x->file);
  (void)fflush(x->file);
  SbFileReplace(x->xmf, x->text, x->size, message);
  (void)fseek(x->file, -(long)strlen(tail), SEEK_CUR); // the next grid goes before it
}
