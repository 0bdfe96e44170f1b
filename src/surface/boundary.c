/*
  boundary.c - the surface of a mesh of tets, or of one of its groups, as a file of triangles.

  A facet is a face of a tet whose neighbour is missing or not in the group; its corners are
  counter-clockwise seen from outside. In a mesh with curved edges each facet is four triangles,
  with the nodes of its edges. Writes .stl (binary, single precision), .obj (groups of triangles as
  lines g) and .ply (binary, double precision).
*/
#include <ctype.h>
#include <errno.h>
#include <strings.h>
#include <unistd.h>
#include "surface_impl.h"

#define ROUGH 1e-6 /* largest rounding of an .stl without a warning, of the diagonal */

/* Tag sets with the group of this name, by their dimension: in[dim][ntags]. */
static PetscErrorCode find_group(const SbImport *im, const char *name, PetscBool *in[4], int *dim)
{
  const char **names;
  char near[1024] = "";
  PetscInt n = 0;

  PetscFunctionBeginUser;
  *dim = -1;
  PetscCall(PetscMalloc1(im->ngroup, &names));
  for (PetscInt g = 0; g < im->ngroup; g++) {
    const SbGroup *group = &im->group[g];

    if (group->dim < 2)
      continue;
    names[n++] = group->name;
    if (!SbGroupIsNamed(group, name))
      continue;

    // a region rather than a surface of the same name
    *dim = PetscMax(*dim, (int)group->dim);
    for (PetscInt t = 0; t < im->ntags; t++)
      for (PetscInt k = im->tags_start[t]; k < im->tags_start[t + 1]; k++)
        if (im->tags_group[k] == g)
          in[group->dim][t] = PETSC_TRUE;
  }
  if (*dim < 0)
    SbSuggestName(name, n, names, sizeof(near), near);
  PetscCall(PetscFree(names));
  PetscCheck(*dim >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: -group %s: there is no region or surface of this name; there are: %s", im->where,
             name, near[0] ? near : "none");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a facet with the tag set of its triangle in the file, in four parts if edges is not NULL. */
static PetscErrorCode add_facet(const SbImport *im, const SbImportEdges *edges, const PetscInt v[3],
                                PetscInt tags, SbImport *out)
{
  PetscInt m[3], part[4][3];

  PetscFunctionBeginUser;
  if (!edges) {
    PetscCall(SbImportAddItem(out, 2, v, tags, 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int k = 0; k < 3; k++)
    m[k] = im->nvert + SbImportEdgesFind(edges, v[k], v[(k + 1) % 3]);
  for (int k = 0; k < 3; k++) {
    part[k][0] = v[k];
    part[k][1] = m[k];
    part[k][2] = m[(k + 2) % 3];
    part[3][k] = m[k];
  }
  for (int k = 0; k < 4; k++)
    PetscCall(SbImportAddItem(out, 2, part[k], tags, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets as items of `out`, which has positions of its own. */
static PetscErrorCode find_facets(const SbImport *im, const SbFaces *faces, const char *group,
                                  const SbImportEdges *edges, SbImport *out, PetscBool *closed)
{
  PetscBool *in[4] = {NULL, NULL, NULL, NULL};
  PetscInt *tags, slots[2];
  int dim = 3;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(im->ntags, &in[2], im->ntags, &in[3]));
  if (group[0]) {
    const PetscErrorCode ierr = find_group(im, group, in, &dim);

    if (ierr)
      PetscCall(PetscFree2(in[2], in[3]));
    PetscCall(ierr);
  } else {
    for (PetscInt t = 0; t < im->ntags; t++)
      in[3][t] = PETSC_TRUE;
  }

  *closed = (PetscBool)(dim == 3);

  // triangles of the file give their faces tag sets
  PetscCall(PetscCalloc1(4 * (size_t)faces->ncell, &tags));
  for (PetscInt t = 0; t < im->item[2].n; t++) {
    const PetscInt n = SbFacesFind(faces, im->item[2].vert + 3 * t, slots);

    for (PetscInt k = 0; k < n; k++)
      tags[slots[k]] = im->item[2].tags[t];
  }
  for (PetscInt s = 0; s < 4 * faces->ncell; s++) {
    const PetscInt other = faces->neighbour[s];
    const PetscInt *v = im->item[3].vert + 4 * (s / 4);
    const int *f = SbFaceVertex[s % 4];
    PetscBool is;

    // of a surface within the body the side of the first tet
    if (dim == 3)
      is = (PetscBool)(in[3][im->item[3].tags[s / 4]] &&
                       (other < 0 || !in[3][im->item[3].tags[other]]));
    else
      is = (PetscBool)(in[2][tags[s]] && (other < 0 || other > s / 4));
    if (is)
      PetscCall(add_facet(im, edges, (const PetscInt[3]){v[f[0]], v[f[1]], v[f[2]]}, tags[s], out));
  }
  PetscCall(PetscFree(tags));
  PetscCall(PetscFree2(in[2], in[3]));
  PetscCheck(out->item[2].n, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %s%s has no face of a tet as its surface", im->where, group[0] ? "-group " : "",
             group[0] ? group : "the mesh");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Little endian on every machine. */
static void put(FILE *file, int bytes, uint64_t bits)
{
  for (int k = 0; k < bytes; k++)
    (void)putc((int)(bits >> (8 * k) & 255), file);
}

static void put_float(FILE *file, PetscReal x)
{
  const float value = (float)x;
  uint32_t bits;

  memcpy(&bits, &value, sizeof(bits));
  put(file, 4, bits);
}

static void put_double(FILE *file, PetscReal x)
{
  const double value = (double)x;
  uint64_t bits;

  memcpy(&bits, &value, sizeof(bits));
  put(file, 8, bits);
}

static void write_stl(const SbImport *out, FILE *file)
{
  (void)fprintf(file, "%-80s", "surface of a mesh of tets");
  put(file, 4, (uint64_t)out->item[2].n);
  for (PetscInt i = 0; i < out->item[2].n; i++) {
    const PetscInt *v = out->item[2].vert + 3 * i;
    PetscReal a[3], b[3], normal[3], length;

    SbSubtract(out->x + 3 * v[1], out->x + 3 * v[0], a);
    SbSubtract(out->x + 3 * v[2], out->x + 3 * v[0], b);
    SbCross(a, b, normal);
    length = PetscSqrtReal(SbDot3(normal, normal));
    for (int k = 0; k < 3; k++)
      put_float(file, normal[k] / (length > 0 ? length : 1));
    for (int k = 0; k < 9; k++)
      put_float(file, out->x[3 * v[k / 3] + k % 3]);
    put(file, 2, 0);
  }
}

static void write_ply(const SbImport *out, FILE *file)
{
  (void)fprintf(file,
                "ply\nformat binary_little_endian 1.0\nelement vertex %" PetscInt_FMT
                "\nproperty double x\nproperty double y\nproperty double z\nelement face "
                "%" PetscInt_FMT "\nproperty list uchar int vertex_indices\nend_header\n",
                out->nvert, out->item[2].n);
  for (PetscInt i = 0; i < 3 * out->nvert; i++)
    put_double(file, out->x[i]);
  for (PetscInt i = 0; i < out->item[2].n; i++) {
    put(file, 1, 3);
    for (int k = 0; k < 3; k++)
      put(file, 4, (uint64_t)out->item[2].vert[3 * i + k]);
  }
}

static void write_obj(const SbImport *im, const SbImport *out, FILE *file)
{
  PetscInt last = 0;

  for (PetscInt v = 0; v < out->nvert; v++)
    (void)fprintf(file, "v %.17g %.17g %.17g\n", (double)out->x[3 * v], (double)out->x[3 * v + 1],
                  (double)out->x[3 * v + 2]);

  // by tag set, each with a line g with its surfaces; those without one come first
  for (PetscInt t = 0; t < im->ntags; t++) {
    for (PetscInt i = 0; i < out->item[2].n; i++) {
      const PetscInt *v = out->item[2].vert + 3 * i;

      if (out->item[2].tags[i] != t)
        continue;
      if (t != last) {
        (void)fprintf(file, "g");
        for (PetscInt k = im->tags_start[t]; k < im->tags_start[t + 1]; k++) {
          (void)putc(' ', file);
          for (const char *c = im->group[im->tags_group[k]].name; *c; c++)
            (void)putc(isspace((unsigned char)*c) ? '_' : *c, file);
        }
        (void)putc('\n', file);
        last = t;
      }
      (void)fprintf(file, "f %" PetscInt_FMT " %" PetscInt_FMT " %" PetscInt_FMT "\n", v[0] + 1,
                    v[1] + 1, v[2] + 1);
    }
  }
}

/* Under another name until it is whole. */
static PetscErrorCode write_file(const SbImport *im, const SbImport *out, const char *path,
                                 const char *extension)
{
  char part[PETSC_MAX_PATH_LEN + 32];
  PetscBool failed;
  FILE *file;

  PetscFunctionBeginUser;
  (void)snprintf(part, sizeof(part), "%s.part", path);
  errno = 0;
  file = SbFileCreate(part);
  PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", part,
             strerror(errno));
  (void)setvbuf(file, NULL, _IOFBF, 1 << 20);
  if (!strcasecmp(extension, ".stl"))
    write_stl(out, file);
  else if (!strcasecmp(extension, ".ply"))
    write_ply(out, file);
  else
    write_obj(im, out, file);
  failed = (PetscBool)(ferror(file) != 0);
  failed = (PetscBool)(fclose(file) || failed || rename(part, path));
  if (failed) {
    const int error = errno;

    (void)unlink(part);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", path,
            strerror(error));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshFileSurface(SbImport *im, const char *group, const char *path,
                                 SbSurfaceFacts *facts)
{
  const char *dot = strrchr(path, '.');
  SbImport out = {0};
  SbImportEdges edges = {0};
  SbFaces faces = {0};
  PetscErrorCode ierr;
  PetscReal box[6];
  PetscReal rounding = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(facts, sizeof(*facts)));
  PetscCheck(dot &&
               (!strcasecmp(dot, ".stl") || !strcasecmp(dot, ".obj") || !strcasecmp(dot, ".ply")),
             PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: surfaces are written as .stl, .obj (with groups) or .ply", path);
  (void)snprintf(out.where, sizeof(out.where), "%s", im->where);
  ierr = SbImportCheck(im, &faces);
  facts->curved = (PetscBool)(!ierr && im->nmiddle.n);
  if (facts->curved)
    ierr = SbImportEdgesCreate(im, &edges);
  if (!ierr)
    ierr = find_facets(im, &faces, group, facts->curved ? &edges : NULL, &out, &facts->closed);
  PetscCall(SbFacesDestroy(&faces));

  // positions, of the nodes of edges behind the vertices; then those that no triangle uses go
  if (!ierr)
    ierr = SbImportSetVertices(&out, im->nvert + edges.nedge);
  if (!ierr) {
    PetscCall(PetscArraycpy(out.x, im->x, 3 * (size_t)im->nvert));
    if (facts->curved)
      SbImportEdgeNodes(im, &edges, out.x + 3 * (size_t)im->nvert);
    ierr = SbDropUnusedPoints(&out.nvert, out.x, 3 * out.item[2].n, out.item[2].vert);
  }
  PetscCall(SbImportEdgesDestroy(&edges));
  if (!ierr)
    ierr = write_file(im, &out, path, dot);

  SbBoxClear(box);
  for (PetscInt i = 0; !ierr && i < 3 * out.nvert; i++) {
    rounding = PetscMax(rounding, PetscAbsReal(out.x[i] - (PetscReal)(float)out.x[i]));
    if (i % 3 == 0)
      SbBoxAdd(box, out.x + i);
  }
  facts->nvert = out.nvert;
  facts->ntri = out.item[2].n;
  for (PetscInt i = 0; !ierr && i < facts->ntri; i++) {
    const PetscInt *v = out.item[2].vert + 3 * i;

    facts->volume += SbTetVolumeTo(out.x, v, out.x);
    facts->area += SbTriangleArea(out.x, v, NULL);
  }
  if (!ierr && !strcasecmp(dot, ".stl") && rounding > ROUGH * SbBoxDiagonal(box))
    ierr = SbWarning(PETSC_COMM_SELF,
                     "%s: an .stl has single precision, which moves vertices here by up to %.2g m; "
                     ".obj and .ply keep them",
                     path, (double)rounding);
  PetscCall(SbImportDestroy(&out));
  PetscFunctionReturn(ierr);
}
