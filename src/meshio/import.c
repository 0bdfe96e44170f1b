/*
  import.c - import of a body on rank 0: its reader is chosen by the mesh name; then it is placed.

  A new format needs one file with one SbReader and one row in the table below.

  Placement: x <- R (s x) + t, with the rotation R by Rodrigues' formula about an axis through the
  origin.
*/
#include <strings.h>
#include "meshio_impl.h"
#include "sbsurface.h"

/* Rotation about an axis; exact for multiples of 90 degrees about the coordinate axes. */
static PetscErrorCode rotation(const SbBody *body, PetscReal R[3][3])
{
  PetscFunctionBeginUser;
  for (int i = 0; i < 9; i++)
    R[i / 3][i % 3] = i % 4 == 0;
  if (body->rotate[3] != 0) {
    const PetscReal *w = body->rotate;
    const PetscReal angle = body->rotate[3] * PETSC_PI / 180;
    const PetscReal length = PetscSqrtReal(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    PetscReal c = PetscCosReal(angle);
    PetscReal s = PetscSinReal(angle);
    PetscReal a[3];

    PetscCheck(length > 0 && isfinite(length) && isfinite(angle), PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT,
               "body '%s': rotation by %g degrees about (%g, %g, %g): the axis must have a length "
               "above zero",
               body->name, (double)w[3], (double)w[0], (double)w[1], (double)w[2]);
    if (PetscAbsReal(c) < 1e-15)
      c = 0;
    if (PetscAbsReal(s) < 1e-15)
      s = 0;
    for (int i = 0; i < 3; i++)
      a[i] = w[i] / length;
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++)
        R[i][j] = (1 - c) * a[i] * a[j] + (i == j ? c : 0);
      R[i][(i + 1) % 3] -= s * a[(i + 2) % 3];
      R[i][(i + 2) % 3] += s * a[(i + 1) % 3];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode transform_body(const SbBody *body, SbImport *im)
{
  PetscReal R[3][3];
  char scale[SB_IMPORT_OPTION_MAX], translate[SB_IMPORT_OPTION_MAX];

  PetscFunctionBeginUser;
  PetscCall(rotation(body, R));
  for (PetscInt m = 0; m < im->nmiddle.n; m++) {
    PetscReal *off = im->middle[m].off;
    PetscReal y[3];

    for (int i = 0; i < 3; i++)
      y[i] = im->scale * off[i];
    for (int i = 0; i < 3; i++) {
      off[i] = R[i][0] * y[0] + R[i][1] * y[1] + R[i][2] * y[2];
      PetscCheck(PetscAbsReal(off[i]) <= SB_LENGTH_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                 "%s: an edge node is %g m from the middle of its edge; the largest length is %g m",
                 im->where, (double)off[i], (double)SB_LENGTH_MAX);
    }
  }
  for (PetscInt f = 0; im->field_width == 3 && f < im->nfield; f++) {
    PetscReal *a = im->field_value + 3 * f;
    const PetscReal y[3] = {a[0], a[1], a[2]};

    for (int i = 0; i < 3; i++)
      a[i] = R[i][0] * y[0] + R[i][1] * y[1] + R[i][2] * y[2];
  }
  for (PetscInt v = 0; v < im->nvert; v++) {
    PetscReal *x = im->x + 3 * v;
    PetscReal y[3];

    for (int i = 0; i < 3; i++)
      y[i] = im->scale * x[i];
    for (int i = 0; i < 3; i++) {
      x[i] = R[i][0] * y[0] + R[i][1] * y[1] + R[i][2] * y[2] + body->translate[i];
      PetscCheck(PetscAbsReal(x[i]) <= SB_LENGTH_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                 "%s: node %lld is beyond %g m, the largest length, when scaled by %g; check the "
                 "file, %s and %s",
                 im->where, (long long)im->vert_number[v], (double)SB_LENGTH_MAX,
                 (double)body->scale, SbImportOption(im, "scale", scale),
                 SbImportOption(im, "translate", translate));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* File readers by extension. */
static const struct {
  const char *extension;
  SbReader read;
} readers[] = {
  {".msh", SbImportRead_Gmsh},      {".vtk", SbImportRead_VTK},
  {".vtu", SbImportRead_VTU},       {".mesh", SbImportRead_Medit},
  {".node", SbImportRead_TetGen},   {".ele", SbImportRead_TetGen},
  {".face", SbImportRead_TetGen},   {".edge", SbImportRead_TetGen},
  {".vol", SbImportRead_Netgen},    {".neu", SbImportRead_NetgenNeutral},
  {".inp", SbImportRead_Abaqus},    {".unv", SbImportRead_UNV},
  {".bdf", SbImportRead_Nastran},   {".nas", SbImportRead_Nastran},
  {".fem", SbImportRead_Nastran},   {".stl", SbImportRead_Surface},
  {".obj", SbImportRead_Surface},   {".off", SbImportRead_Surface},
  {".ply", SbImportRead_Surface},   {".h5", SbImportRead_H5},
  {".xmf", SbImportRead_Xdmf},      {".poly", SbImportRead_Surface},
  {".smesh", SbImportRead_Surface}, {".feb", SbImportRead_FEBio},
  {".med", SbImportRead_MED},       {".exo", SbImportRead_Exodus},
  {".e", SbImportRead_Exodus},      {".ex2", SbImportRead_Exodus},
  {".g", SbImportRead_Exodus},      {".gen", SbImportRead_Exodus},
  {".cgns", SbImportRead_CGNS},     {".pvtu", SbImportRead_VTU},
};

/* What the first lines of a file say of its format, whatever its name: the reader, or none. */
static const struct {
  const char *text, *kind;
  PetscBool anywhere; /* not only at the beginning */
  SbReader read;
} contents[] = {
  {"$MeshFormat", "gmsh", PETSC_FALSE, SbImportRead_Gmsh},
  {"$NOD", "gmsh", PETSC_FALSE, SbImportRead_Gmsh},
  {"# vtk DataFile", "VTK (legacy)", PETSC_FALSE, SbImportRead_VTK},
  {"type=\"UnstructuredGrid\"", "VTK (XML)", PETSC_TRUE, SbImportRead_VTU},
  {"type=\"PUnstructuredGrid\"", "VTK (XML)", PETSC_TRUE, SbImportRead_VTU},
  {"MeshVersionFormatted", "Medit", PETSC_FALSE, SbImportRead_Medit},
  {"mesh3d", "Netgen", PETSC_FALSE, SbImportRead_Netgen},
  {"\x89HDF\r\n", "HDF5", PETSC_FALSE, SbImportRead_H5},
  {"<Xdmf", "XDMF", PETSC_TRUE, SbImportRead_Xdmf},
  {"CONTROL INFO", "GAMBIT (neutral file)", PETSC_FALSE, NULL},
  {"CDF\x01", "netCDF (Exodus)", PETSC_FALSE, SbImportRead_Exodus},
  {"CDF\x02", "netCDF (Exodus)", PETSC_FALSE, SbImportRead_Exodus},
  {"CDF\x05", "netCDF (Exodus)", PETSC_FALSE, SbImportRead_Exodus},
  {"@(#)ADF", "CGNS in the format ADF (cgnsconvert -h writes HDF5)", PETSC_FALSE, NULL},
  {"\x1f\x8b", "gzip (unpack it)", PETSC_FALSE, NULL},
  {"PK\x03\x04", "zip (unpack it)", PETSC_FALSE, NULL},
  {"<febio_spec", "FEBio", PETSC_TRUE, SbImportRead_FEBio},
  {"ISO-10303-21", "STEP (geometry)", PETSC_FALSE, NULL},
};

/* Contents beat the ending of the name. */
static PetscErrorCode check_contents(const SbBody *body, SbImport *im, SbReader *read)
{
  char text[1024];
  const char *begin = text;
  FILE *file;
  size_t n;

  PetscFunctionBeginUser;
  if (SbFileOpen(body->mesh, 0, &file) || !file)
    PetscFunctionReturn(PETSC_SUCCESS);
  n = fread(text, 1, sizeof(text) - 1, file);
  (void)fclose(file);
  text[n] = 0;
  if (!strncmp(begin, "\xef\xbb\xbf", 3))
    begin += 3;
  begin += strspn(begin, " \t\r\n");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(contents); i++) {
    const char *found =
      contents[i].anywhere && *begin == '<' ? strstr(begin, contents[i].text) : NULL;

    if (!found &&
        (contents[i].anywhere || strncmp(begin, contents[i].text, strlen(contents[i].text)) != 0))
      continue;
    PetscCheck(contents[i].read, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s: is a file of %s, which supple does not read; convert it to .msh, .vtu or .inp "
               "(gmsh, meshio)",
               im->where, contents[i].kind);
    if (*read == contents[i].read)
      break;

    // several formats are written in HDF5
    if (contents[i].read == SbImportRead_H5 &&
        (*read == SbImportRead_MED || *read == SbImportRead_Exodus || *read == SbImportRead_CGNS))
      break;
    SbImportRemark(im, "read as a file of %s, which it is in spite of its name", contents[i].kind);
    *read = contents[i].read;
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the inputs of a reader from the body. */
static PetscErrorCode begin(const SbBody *body, SbImport *im)
{
  PetscReal R[3][3];
  PetscInt none;

  PetscFunctionBeginUser;
  (void)snprintf(im->where, sizeof(im->where), "%s%s%s%s", body->name[0] ? "body '" : "",
                 body->name, body->name[0] ? "': " : "", body->mesh);
  PetscCall(PetscStrncpy(im->body, body->name, sizeof(im->body)));
  im->step = body->mesh_step;
  PetscCall(SbImportTagSet(im, 0, NULL, &none));
  im->tet = body->tet;
  im->scale = body->scale;

  // places with finer tets, where they are before the body is placed: x <- R^T (x - t)
  if (im->tet.nnear)
    PetscCall(rotation(body, R));
  for (SbTetNear *near = im->tet.near; near < im->tet.near + im->tet.nnear; near++) {
    PetscReal away[3];

    SbSubtract(near->x, body->translate, away);
    for (int i = 0; i < 3; i++) {
      near->x[i] = R[0][i] * away[0] + R[1][i] * away[1] + R[2][i] * away[2];
      PetscCall(PetscArraycpy(near->axes[i], R[i], 3));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the mesh of a body, without placing it. */
static PetscErrorCode read_body(const SbBody *body, SbImport *im)
{
  char known[512] = "";
  char node[PETSC_MAX_PATH_LEN + 8];
  char step[SB_IMPORT_OPTION_MAX];
  const char *dot = strrchr(body->mesh, '.');
  SbReader read = strncmp(body->mesh, "box:", 4) ? NULL : SbImportRead_Box;
  PetscBool tetgen = PETSC_TRUE;
  PetscReal largest;
  PetscInt given;

  PetscFunctionBeginUser;
  PetscCall(begin(body, im));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(readers) && !read; i++) {
    if (dot && !strcasecmp(dot, readers[i].extension))
      read = readers[i].read;
    SbAppend(sizeof(known), known, "%s%s", i ? " " : "", readers[i].extension);
  }

  // a name without a known ending may be what TetGen's files have in common
  (void)snprintf(node, sizeof(node), "%s.node", body->mesh);
  if (!read)
    PetscCall(PetscTestFile(node, 'r', &tetgen));
  PetscCheck(
    tetgen, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: '%s' is a mesh of no known kind; give a file that ends in %s (or the name of TetGen's "
    "files without an ending), or box:lx,ly,lz:n",
    im->where, body->mesh, known);
  if (!read)
    read = SbImportRead_TetGen;
  if (read != SbImportRead_Box && read != SbImportRead_TetGen)
    PetscCall(check_contents(body, im, &read));
  PetscCheck(!im->step || read == SbImportRead_H5 || read == SbImportRead_Xdmf, PETSC_COMM_SELF,
             PETSC_ERR_USER_INPUT,
             "%s: %s %lld is of the files of a run, .h5 and .xmf: this mesh has no steps",
             im->where, SbImportOption(im, body->name[0] ? "mesh_step" : "step", step),
             (long long)im->step);
  PetscCall((*read)(body->mesh, im));
  given = im->nmiddle.n;
  PetscCall(SbImportMiddles(im, NULL, &largest));
  SbImportNoteMiddles(im, im->nmiddle.n, largest);
  if (given && !im->nmiddle.n && !body->name[0])
    SbImportRemark(im, "straight tets of second order, taken as those of first order");
  SbImportNoteSkipped(im);
  PetscCall(SbImportForget(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Deep copy of an import, before it is placed. */
static PetscErrorCode copy_import(const SbImport *from, SbImport *to)
{
  SbImportPart part[SB_IMPORT_NPART];

  PetscFunctionBeginUser;
  *to = *from;
  SbImportParts(to, part);
  for (int i = 0; i < SB_IMPORT_NPART; i++) {
    const void *array = *part[i].array;

    PetscCall(PetscMalloc(part[i].bytes, part[i].array));
    PetscCall(PetscMemcpy(*part[i].array, array, part[i].bytes));
  }
  to->nmiddle.capacity = from->nmiddle.n;
  for (int d = 0; d < 4; d++)
    to->item[d].capacity = from->item[d].n;
  to->capacity[0] = from->ngroup;
  to->capacity[1] = from->ntags + 1;
  to->capacity[2] = from->tags_start[from->ntags];
  to->groups.capacity = from->groups.n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two copies come from the same file, read in the same way. memcmp(): padding is 0. */
static PetscBool same_source(const SbBody *a, const SbBody *b)
{
  if (strcmp(a->copy_of, b->copy_of) || strcmp(a->mesh, b->mesh))
    return PETSC_FALSE;
  if (a->mesh_step != b->mesh_step || a->scale != b->scale)
    return PETSC_FALSE;

  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
  return (PetscBool)!memcmp(&a->tet, &b->tet, sizeof(b->tet));
}

PetscErrorCode SbImportReadCopy(const SbBody *body, const SbBody *before, SbImport *shared,
                                SbImport *im)
{
  PetscFunctionBeginUser;
  if (!body->copy_of[0] || !strncmp(body->mesh, "box:", 4)) {
    PetscCall(SbImportRead(body, im));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* the first copy of a body keeps the unplaced mesh for the next ones */
  if (!shared->x || !before || !same_source(before, body)) {
    PetscCall(SbImportDestroy(shared));
    PetscCall(read_body(body, shared));
  }
  PetscCall(copy_import(shared, im));
  PetscCall(begin(body, im));
  im->scale = shared->scale; /* 1 if its reader has scaled */
  PetscCall(transform_body(body, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead(const SbBody *body, SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(read_body(body, im));
  PetscCall(transform_body(body, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSlab(const SbBody *body, PetscInt k, PetscInt n, SbImport *im,
                            SbSlabRows *rows)
{
  PetscFunctionBeginUser;
  PetscCall(begin(body, im));
  PetscCall(SbImportSlab_H5(body->mesh, k, n, im, rows));
  PetscCall(SbImportForget(im));
  PetscCall(transform_body(body, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
