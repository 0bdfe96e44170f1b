/*
  fields.xmf, and contacts.xmf: what ParaView and VTK open to find the frames of fields.h5.

  Only the part of XDMF that vtkXdmfReader and vtkXdmf3Reader both read rightly: one temporal collection of uniform grids,
  every array named by its full path in the HDF5 file, no references, no hyperslabs. The text of all frames so far is kept,
  so that the file is whole after every frame: it is written beside its target and renamed.

  Points are a mesh of one vertex per cell, said explicitly: without that vtkXdmf3Reader finds no cells. Neither reader takes a
  grid without points (vtkXdmf3Reader ends with a signal); a frame without any has a single one, which belongs to nobody.
*/
#include <stdarg.h>
#include <unistd.h>
#include "output_impl.h"

struct _p_SbXdmf {
  char path[PETSC_MAX_PATH_LEN];
  PetscInt npoint, ncell;
  char *mesh; /* topology, geometry and constant arrays of the frames that come next */
  char *text; /* [size] frames so far; capacity grows by doubling */
  size_t size, capacity;
};

PetscErrorCode SbXdmfCreate(const char *path, SbXdmf *x)
{
  PetscFunctionBeginUser;
  PetscCall(PetscNew(x));
  PetscCall(PetscStrncpy((*x)->path, path, sizeof((*x)->path)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { ROOM = 768 }; /* letters for one array of the mesh */

typedef struct {
  SbXdmf xdmf;
  const char *group;
  size_t n, size; /* letters of xdmf->mesh, and room for them */
} List;

/* Whole numbers of points (set_NAME) and cells (tets_NAME, body, rank); the others are the mesh itself. */
static herr_t list_array(hid_t where, const char *name, const H5L_info_t *info, void *ctx)
{
  List *l = (List *)ctx;
  const PetscBool points = (PetscBool)!strncmp(name, "set_", 4);

  (void)where, (void)info;
  if (!points && strncmp(name, "tets_", 5) != 0 && strcmp(name, "body") != 0 && strcmp(name, "rank") != 0)
    return 0;
  if (l->size - l->n < ROOM) return -1;
  l->n += (size_t)snprintf(
    l->xdmf->mesh + l->n, l->size - l->n,
    "<Attribute Name=\"%s\" AttributeType=\"Scalar\" Center=\"%s\">"
    "<DataItem Dimensions=\"%" PetscInt_FMT "\" NumberType=\"Int\" Precision=\"4\" Format=\"HDF\">"
    "fields.h5:/%s/%s</DataItem></Attribute>\n",
    name, points ? "Node" : "Cell", points ? l->xdmf->npoint : l->xdmf->ncell, l->group, name);
  return 0;
}

PetscErrorCode SbXdmfSetMesh(SbXdmf xdmf, hid_t mesh, const char *group)
{
  const PetscInt npoint = (PetscInt)SbH5Rows(mesh, "x"), ncell = (PetscInt)SbH5Rows(mesh, "cells");
  H5G_info_t info = {.nlinks = 0};
  List list = {.xdmf = xdmf, .group = group};

  PetscFunctionBeginUser;
  xdmf->npoint = npoint;
  xdmf->ncell = ncell;
  if (mesh >= 0) (void)H5Gget_info(mesh, &info);
  list.size = (size_t)(info.nlinks + 2) * ROOM;
  PetscCall(PetscFree(xdmf->mesh));
  PetscCall(PetscMalloc1(list.size, &xdmf->mesh));
  list.n = (size_t)snprintf(
    xdmf->mesh, list.size,
    "<Topology TopologyType=\"Tetrahedron\" NumberOfElements=\"%" PetscInt_FMT "\">"
    "<DataItem Dimensions=\"%" PetscInt_FMT " 4\" NumberType=\"Int\" Precision=\"4\" Format=\"HDF\">"
    "fields.h5:/%s/cells</DataItem></Topology>\n"
    "<Geometry GeometryType=\"XYZ\">"
    "<DataItem Dimensions=\"%" PetscInt_FMT " 3\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">"
    "fields.h5:/%s/x</DataItem></Geometry>\n",
    ncell, ncell, group, npoint, group);
  if (mesh >= 0) (void)H5Literate(mesh, H5_INDEX_NAME, H5_ITER_INC, NULL, list_array, &list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfDestroy(SbXdmf *x)
{
  PetscFunctionBeginUser;
  if (!*x) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*x)->mesh));
  PetscCall(PetscFree((*x)->text));
  PetscCall(PetscFree(*x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfRemove(SbXdmf x)
{
  PetscFunctionBeginUser;
  (void)unlink(x->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode append_text(SbXdmf x, size_t n, const char *text)
{
  PetscFunctionBeginUser;
  if (x->size + n + 1 > x->capacity) {
    const size_t capacity = 2 * (x->size + n + 1);
    char *grown;

    PetscCall(PetscMalloc1(capacity, &grown));
    if (x->size) PetscCall(PetscArraycpy(grown, x->text, x->size));
    PetscCall(PetscFree(x->text));
    x->text = grown;
    x->capacity = capacity;
  }
  PetscCall(PetscArraycpy(x->text + x->size, text, n + 1));
  x->size += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode append(SbXdmf x, const char *format, ...)
{
  char chunk[2048];
  size_t n;
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  n = (size_t)vsnprintf(chunk, sizeof(chunk), format, args);
  va_end(args);
  PetscCheck(n < sizeof(chunk), PETSC_COMM_SELF, PETSC_ERR_PLIB, "A chunk of %s has %zu letters", x->path, n);
  PetscCall(append_text(x, n, chunk));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode begin_grid(SbXdmf x, const char *name, PetscReal time)
{
  PetscFunctionBeginUser;
  PetscCall(
    append(x, "<Grid Name=\"%s\" GridType=\"Uniform\">\n<Time Value=\"%.17g\"/>\n", name, (double)time));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfAdd(SbXdmf x, PetscReal time, const char *group, PetscInt n,
                         const SbField *const field[], const PetscInt bytes[])
{
  PetscFunctionBeginUser;
  PetscCall(begin_grid(x, "bodies", time));
  PetscCall(append_text(x, strlen(x->mesh), x->mesh));
  for (PetscInt i = 0; i < n; i++) {
    const SbField *f = field[i];
    const char *type = f->ncomp == 1 ? "Scalar" : f->ncomp == 3 ? "Vector" : "Tensor6";
    char components[16] = "";

    if (f->ncomp > 1) (void)snprintf(components, sizeof(components), " %d", (int)f->ncomp);
    PetscCall(append(x,
                     "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">"
                     "<DataItem Dimensions=\"%" PetscInt_FMT
                     "%s\" NumberType=\"Float\" Precision=\"%" PetscInt_FMT
                     "\" Format=\"HDF\">fields.h5:%s/%s</DataItem></Attribute>\n",
                     f->name, type, f->cell ? "Cell" : "Node", f->cell ? x->ncell : x->npoint, components,
                     bytes[i], group, f->name));
  }
  PetscCall(append(x, "</Grid>\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values at points below `group`, or without a group those of a single point, as they are. */
static PetscErrorCode point_item(SbXdmf x, const char *group, const SbXdmfValues *v, PetscInt n,
                                 const PetscReal single[])
{
  const char *type = v->whole ? "Int" : "Float", *format = group ? "HDF" : "XML";
  char components[16] = "";

  PetscFunctionBeginUser;
  if (v->ncomp > 1) (void)snprintf(components, sizeof(components), " %d", v->ncomp);
  PetscCall(append(
    x, "<DataItem Dimensions=\"%" PetscInt_FMT "%s\" NumberType=\"%s\" Precision=\"%d\" Format=\"%s\">",
    group ? n : 1, components, type, v->whole ? 4 : v->bytes, format));
  if (group) PetscCall(append(x, "fields.h5:%s/%s", group, v->name));
  for (int k = 0; k < v->ncomp && !group; k++)
    PetscCall(append(x, "%s%.17g", k ? " " : "", (double)single[k]));
  PetscCall(append(x, "</DataItem>"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfAddPoints(SbXdmf x, PetscReal time, const char *group, PetscInt n,
                               const PetscReal nowhere[3], PetscInt nvalues, const SbXdmfValues values[])
{
  static const PetscReal none[3] = {0., 0., 0.}, nobody[1] = {-1.};
  const char *where = n ? group : NULL;

  PetscFunctionBeginUser;
  PetscCall(begin_grid(x, "contacts", time));
  PetscCall(append(
    x, "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"%" PetscInt_FMT "\" NodesPerElement=\"1\">",
    PetscMax(n, 1)));
  PetscCall(point_item(x, where, &values[0], n, none));
  PetscCall(append(x, "</Topology>\n<Geometry GeometryType=\"XYZ\">"));
  PetscCall(point_item(x, where, &values[1], n, nowhere));
  PetscCall(append(x, "</Geometry>\n"));
  for (PetscInt k = 2; k < nvalues; k++) {
    PetscCall(append(x, "<Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"Node\">", values[k].name,
                     values[k].ncomp > 1 ? "Vector" : "Scalar"));
    PetscCall(point_item(x, where, &values[k], n, values[k].whole ? nobody : none));
    PetscCall(append(x, "</Attribute>\n"));
  }
  PetscCall(append(x, "</Grid>\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbXdmfWrite(SbXdmf x, size_t nmessage, char message[])
{
  static const char head[] = "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
                             "<Grid Name=\"frames\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  static const char tail[] = "</Grid>\n</Domain>\n</Xdmf>\n";
  const SbChunk chunks[3] = {{head, sizeof(head) - 1}, {x->text, x->size}, {tail, sizeof(tail) - 1}};

  SbFileReplace(x->path, 3, chunks, nmessage, message);
}
