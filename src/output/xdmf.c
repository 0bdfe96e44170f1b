/*
  fields.xmf: what ParaView and VTK open to find the frames of fields.h5.

  Only the part of XDMF that vtkXdmfReader and vtkXdmf3Reader both read rightly: one temporal collection of uniform grids,
  every array named by its full path in the HDF5 file, no references, no hyperslabs. The text of all frames so far is kept,
  so that the file is whole after every frame: it is written beside its place and renamed.
*/
#include <stdarg.h>
#include <unistd.h>
#include "output_impl.h"

struct _p_SbXdmf {
  char path[PETSC_MAX_PATH_LEN];
  PetscInt npoint, ncell;
  char mesh[1024]; /* topology, geometry and constant arrays: the same in every frame */
  char *text;      /* [size] frames so far; capacity grows by doubling */
  size_t size, capacity;
};

PetscErrorCode SbXdmfCreate(const char *path, PetscInt npoint, PetscInt ncell, PetscBool with_rank, SbXdmf *x)
{
  SbXdmf xdmf;
  const char *numbers[2] = {"body", "rank"};
  size_t n;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&xdmf));
  PetscCall(PetscStrncpy(xdmf->path, path, sizeof(xdmf->path)));
  xdmf->npoint = npoint;
  xdmf->ncell = ncell;
  n = (size_t)snprintf(
    xdmf->mesh, sizeof(xdmf->mesh),
    "<Topology TopologyType=\"Tetrahedron\" NumberOfElements=\"%" PetscInt_FMT "\">"
    "<DataItem Dimensions=\"%" PetscInt_FMT " 4\" NumberType=\"Int\" Precision=\"4\" Format=\"HDF\">"
    "fields.h5:/mesh/cells</DataItem></Topology>\n"
    "<Geometry GeometryType=\"XYZ\">"
    "<DataItem Dimensions=\"%" PetscInt_FMT " 3\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">"
    "fields.h5:/mesh/x</DataItem></Geometry>\n",
    ncell, ncell, npoint);
  for (int i = 0; i < (with_rank ? 2 : 1); i++) {
    n += (size_t)snprintf(xdmf->mesh + n, sizeof(xdmf->mesh) - n,
                          "<Attribute Name=\"%s\" AttributeType=\"Scalar\" Center=\"Cell\">"
                          "<DataItem Dimensions=\"%" PetscInt_FMT
                          "\" NumberType=\"Int\" Precision=\"4\" Format=\"HDF\">"
                          "fields.h5:/mesh/%s</DataItem></Attribute>\n",
                          numbers[i], ncell, numbers[i]);
  }
  *x = xdmf;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfDestroy(SbXdmf *x)
{
  PetscFunctionBeginUser;
  if (!*x) PetscFunctionReturn(PETSC_SUCCESS);
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

static PetscErrorCode append(SbXdmf x, const char *format, ...)
{
  char piece[2048];
  size_t n;
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  n = (size_t)vsnprintf(piece, sizeof(piece), format, args);
  va_end(args);
  PetscCheck(n < sizeof(piece), PETSC_COMM_SELF, PETSC_ERR_PLIB, "A piece of %s has %zu letters", x->path, n);
  if (x->size + n + 1 > x->capacity) {
    const size_t capacity = 2 * (x->size + n + 1);
    char *grown;

    PetscCall(PetscMalloc1(capacity, &grown));
    if (x->size) PetscCall(PetscArraycpy(grown, x->text, x->size));
    PetscCall(PetscFree(x->text));
    x->text = grown;
    x->capacity = capacity;
  }
  PetscCall(PetscArraycpy(x->text + x->size, piece, n + 1));
  x->size += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXdmfAdd(SbXdmf x, PetscReal time, const char *group, PetscInt n,
                         const SbField *const field[], const PetscInt bytes[])
{
  PetscFunctionBeginUser;
  PetscCall(
    append(x, "<Grid Name=\"bodies\" GridType=\"Uniform\">\n<Time Value=\"%.17g\"/>\n", (double)time));
  PetscCall(append(x, "%s", x->mesh));
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

void SbXdmfWrite(SbXdmf x, size_t nmessage, char message[])
{
  static const char head[] = "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
                             "<Grid Name=\"frames\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  static const char tail[] = "</Grid>\n</Domain>\n</Xdmf>\n";
  const SbPiece pieces[3] = {{head, sizeof(head) - 1}, {x->text, x->size}, {tail, sizeof(tail) - 1}};

  SbFileReplace(x->path, 3, pieces, nmessage, message);
}
