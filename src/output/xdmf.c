/*
  fields.xmf, and contacts.xmf: what ParaView and VTK open to find the frames of fields.h5.

  Only the part of XDMF that vtkXdmfReader and vtkXdmf3Reader both read rightly: one temporal collection of uniform grids,
  every array named by its full path in the HDF5 file, no references, no hyperslabs. The text of all frames so far is kept,
  so that the file is whole after every frame: it is written beside its target and renamed.

  Points are a mesh of one vertex per cell, said explicitly: without that vtkXdmf3Reader finds no cells. Neither reader takes a
  grid without points (vtkXdmf3Reader ends with a signal); a frame without any has a single one, which belongs to nobody.
*/
#include <stdlib.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbmeshio.h"

struct _p_SbXdmf {
  char path[PETSC_MAX_PATH_LEN];
  PetscInt npoint, ncell;
  char *mesh; /* topology, geometry and constant arrays of the frames that come next; free() */
  FILE *file; /* frames so far, in memory: text[size] once it is flushed */
  char *text;
  size_t size;
};

PetscErrorCode SbXdmfCreate(const char *path, SbXdmf *x)
{
  PetscFunctionBeginUser;
  PetscCall(PetscNew(x));
  PetscCall(PetscStrncpy((*x)->path, path, sizeof((*x)->path)));
  (*x)->file = open_memstream(&(*x)->text, &(*x)->size);
  PetscCheck((*x)->file, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for %s", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfDestroy(SbXdmf *x)
{
  PetscFunctionBeginUser;
  if (!*x) PetscFunctionReturn(PETSC_SUCCESS);
  (void)fclose((*x)->file);
  free((*x)->text);
  free((*x)->mesh);
  PetscCall(PetscFree(*x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbXdmfRemove(SbXdmf x)
{
  (void)unlink(x->path);
}

/* ------------------------------------------------------------------ the mesh */

typedef struct {
  SbXdmf xdmf;
  const char *group;
  FILE *file;
} List;

/* Whole numbers of points (set_NAME) and cells (tets_NAME, body, rank); the others are the mesh itself. */
static herr_t list_array(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  const List *l = (const List *)ctx;
  const PetscBool points = (PetscBool)!strncmp(name, "set_", 4);

  (void)where, (void)info;
  if (!points && strncmp(name, "tets_", 5) != 0 && strcmp(name, "body") != 0 && strcmp(name, "rank") != 0)
    return 0;
  (void)fprintf(l->file, "<Attribute Name=\"%s\" AttributeType=\"Scalar\" Center=\"%s\">", name,
                points ? "Node" : "Cell");
  SbXdmfArray(l->file, points ? l->xdmf->npoint : l->xdmf->ncell, 1, "Int", 4, "fields.h5:/%s/%s", l->group,
              name);
  (void)fputs("</Attribute>\n", l->file);
  return 0;
}

PetscErrorCode SbXdmfSetMesh(SbXdmf xdmf, hid_t mesh, const char *group)
{
  size_t size;
  List list = {.xdmf = xdmf, .group = group};
  const PetscBool quadratic = (PetscBool)(mesh >= 0 && H5Lexists(mesh, "cells10", H5P_DEFAULT) > 0);

  PetscFunctionBeginUser;
  xdmf->npoint = (PetscInt)SbH5Rows(mesh, "x");
  xdmf->ncell = (PetscInt)SbH5Rows(mesh, "cells");
  free(xdmf->mesh);
  list.file = open_memstream(&xdmf->mesh, &size);
  PetscCheck(list.file, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for %s", xdmf->path);
  (void)fprintf(list.file, "<Topology TopologyType=\"%s\" NumberOfElements=\"%" PetscInt_FMT "\">",
                quadratic ? "Tetrahedron_10" : "Tetrahedron", xdmf->ncell);
  SbXdmfArray(list.file, xdmf->ncell, quadratic ? 10 : 4, "Int", 4, "fields.h5:/%s/cells%s", group,
              quadratic ? "10" : "");
  (void)fputs("</Topology>\n<Geometry GeometryType=\"XYZ\">", list.file);
  SbXdmfArray(list.file, xdmf->npoint, 3, "Float", 8, "fields.h5:/%s/x", group);
  (void)fputs("</Geometry>\n", list.file);
  if (mesh >= 0) (void)H5Literate(mesh, H5_INDEX_NAME, H5_ITER_INC, NULL, list_array, &list);
  (void)fclose(list.file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ frames */

static void begin_grid(SbXdmf x, const char *name, PetscReal time)
{
  (void)fprintf(x->file, "<Grid Name=\"%s\" GridType=\"Uniform\">\n<Time Value=\"%.17g\"/>\n", name,
                (double)time);
}

void SbXdmfAdd(SbXdmf x, PetscReal time, const char *group, PetscInt n, const SbField *const field[],
               const PetscInt bytes[])
{
  begin_grid(x, "bodies", time);
  (void)fputs(x->mesh, x->file);
  for (PetscInt i = 0; i < n; i++) {
    const SbField *f = field[i];

    (void)fprintf(x->file, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">", f->name,
                  f->ncomp == 1   ? "Scalar"
                  : f->ncomp == 3 ? "Vector"
                                  : "Tensor6",
                  f->cell ? "Cell" : "Node");
    SbXdmfArray(x->file, f->cell ? x->ncell : x->npoint, (int)f->ncomp, "Float", (int)bytes[i],
                "fields.h5:%s/%s", group, f->name);
    (void)fputs("</Attribute>\n", x->file);
  }
  (void)fputs("</Grid>\n", x->file);
}

/* Values at points below `group`, or without a group those of a single point, as they are. */
static void point_item(SbXdmf x, const char *group, const SbXdmfValues *v, PetscInt n,
                       const PetscReal single[])
{
  const char *type = v->whole ? "Int" : "Float";
  const int bytes = v->whole ? 4 : v->bytes;

  if (group) {
    SbXdmfArray(x->file, n, v->ncomp, type, bytes, "fields.h5:%s/%s", group, v->name);
  } else {
    (void)fprintf(x->file, "<DataItem Dimensions=\"1%s\" NumberType=\"%s\" Precision=\"%d\" Format=\"XML\">",
                  v->ncomp > 1 ? " 3" : "", type, bytes);
    for (int k = 0; k < v->ncomp; k++) (void)fprintf(x->file, "%s%.17g", k ? " " : "", (double)single[k]);
    (void)fputs("</DataItem>", x->file);
  }
}

void SbXdmfAddPoints(SbXdmf x, PetscReal time, const char *group, PetscInt n, const PetscReal nowhere[3],
                     PetscInt nvalues, const SbXdmfValues values[])
{
  static const PetscReal none[3] = {0., 0., 0.}, nobody[1] = {-1.};
  const char *where = n ? group : NULL;

  begin_grid(x, "contacts", time);
  (void)fprintf(x->file,
                "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%" PetscInt_FMT
                "\" NodesPerElement=\"1\">",
                PetscMax(n, 1));
  point_item(x, where, &values[0], n, none);
  (void)fputs("</Topology>\n<Geometry GeometryType=\"XYZ\">", x->file);
  point_item(x, where, &values[1], n, nowhere);
  (void)fputs("</Geometry>\n", x->file);
  for (PetscInt k = 2; k < nvalues; k++) {
    (void)fprintf(x->file, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">", values[k].name,
                  values[k].ncomp > 1 ? "Vector" : "Scalar");
    point_item(x, where, &values[k], n, values[k].whole ? nobody : none);
    (void)fputs("</Attribute>\n", x->file);
  }
  (void)fputs("</Grid>\n", x->file);
}

void SbXdmfWrite(SbXdmf x, char message[SB_MESSAGE_MAX])
{
  static const char head[] = "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
                             "<Grid Name=\"frames\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  static const char tail[] = "</Grid>\n</Domain>\n</Xdmf>\n";
  SbChunk chunks[3] = {{head, sizeof(head) - 1}, {NULL, 0}, {tail, sizeof(tail) - 1}};

  (void)fflush(x->file);
  chunks[1] = (SbChunk){x->text, x->size};
  SbFileReplace(x->path, 3, chunks, message);
}
