/*
  write_gmsh.c - writer of gmsh's .msh files, versions 4.1 and 2.2, text and binary (gmsh manual, "File
  formats").

  Version 4.1 assigns groups to entities of the geometry: each tag set of a dimension becomes one entity, and
  all nodes belong to the first entity of the highest dimension. Blocks follow the order of the items, and a
  new one begins where the tag set changes: reading the file gives the same order. Version 2.2 has one group
  per element: an element of several groups is written once for each; supple's reader merges them.

  A mesh with curved edges is written as one of second order: every edge has a node, after the vertices.

  Numbers count from 1. A double is written as text with 17 digits, so that it is read back exactly.
*/
#include <errno.h>
#include "meshio_impl.h"
#include "sbgeometry.h"

typedef struct {
  const SbImport *im;
  FILE *file;
  PetscBool binary;
  PetscBool (*used)[4];   /* [ntags] whether items of each dimension have the tag set */
  int home_dim;           /* dimension of the entity that has the nodes */
  PetscInt home;          /* tag set of that entity */
  int64_t *number;        /* [ngroup] numbers of the groups in the file */
  PetscInt64 total, done; /* numbers of items to write and written, for progress reports */
  PetscInt nnode;
  SbImportEdges edges; /* edges of a mesh with curved edges, else empty */
  PetscReal *x;        /* [nnode][3] coordinates: vertices, then edge nodes */
} Out;

/* gmsh's element types by order and dimension. */
static const int gmsh_type[2][4] = {{SB_GMSH_POINT, SB_GMSH_LINE, SB_GMSH_TRIANGLE, SB_GMSH_TET},
                                    {SB_GMSH_POINT, SB_GMSH_LINE3, SB_GMSH_TRIANGLE6, SB_GMSH_TET10}};
/* Edges of an item by dimension, in gmsh's order. */
static const int nedge_of[4] = {0, 1, 3, 6}, edge_of[6][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}};

/* Writes an integer: text and a separator, or 4 or 8 bytes; fprintf() takes four times as long. */
static void put(Out *out, int bytes, int64_t value, char after)
{
  const int32_t small = (int32_t)value;
  char digits[24], *p = digits + sizeof(digits);

  if (out->binary)
    (void)fwrite(bytes == 8 ? (const void *)&value : &small, (size_t)bytes, 1, out->file);
  else {
    *--p = after;
    do *--p = (char)('0' + value % 10);
    while (value /= 10);
    (void)fwrite(p, 1, (size_t)(digits + sizeof(digits) - p), out->file);
  }
}

static void put_real(Out *out, PetscReal value, char after)
{
  const double x = (double)value;

  if (out->binary)
    (void)fwrite(&x, 8, 1, out->file);
  else
    (void)fprintf(out->file, "%.17g%c", x, after);
}

static PetscErrorCode report_progress(Out *out)
{
  PetscFunctionBeginUser;
  if (out->im->progress && !(out->done++ & 0xffff))
    PetscCall(out->im->progress("elements", out->done, out->total, out->im->progress_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the nodes of an item of dimension d. */
static void put_nodes(Out *out, int d, const PetscInt v[], int bytes)
{
  const int nedge = out->edges.nedge ? nedge_of[d] : 0;

  for (int a = 0; a <= d; a++) put(out, bytes, v[a] + 1, a < d || nedge ? ' ' : '\n');
  for (int e = 0; e < nedge; e++) {
    const PetscInt at = SbImportEdgesFind(&out->edges, v[edge_of[e][0]], v[edge_of[e][1]]);

    put(out, bytes, out->im->nvert + at + 1, e + 1 < nedge ? ' ' : '\n');
  }
}

/* Whether the name of a group differs from the default for its number. */
static PetscBool has_name(const Out *out, PetscInt g)
{
  char text[SB_GROUP_MAX];

  (void)snprintf(text, sizeof(text), "%s_%lld", SbGroupKinds[out->im->group[g].dim],
                 (long long)out->number[g]);
  return (PetscBool)(strcmp(text, out->im->group[g].name) != 0);
}

/* Next group of dimension dim in a tag set, from position *k on; -1 if there is none. */
static PetscInt next_group(const SbImport *im, PetscInt tags, int dim, PetscInt *k)
{
  while (*k < im->tags_start[tags + 1]) {
    const PetscInt g = im->tags_group[(*k)++];

    if (im->group[g].dim == dim) return g;
  }
  return -1;
}

static PetscInt count_groups(const SbImport *im, PetscInt tags, int dim)
{
  PetscInt n = 0, k = im->tags_start[tags];

  while (next_group(im, tags, dim, &k) >= 0) n++;
  return n;
}

/* Version 4.1: an entity, which has the groups of a tag set. */
static void write_entity(Out *out, int dim, PetscInt tags)
{
  const SbImport *im = out->im;
  PetscReal box[6];
  PetscInt k = im->tags_start[tags], g;
  const SbItems *item = &im->item[dim];

  // bounding box of the items of this tag set
  SbBoxClear(box);
  for (PetscInt j = 0; j < item->n; j++) {
    if (item->tags[j] != tags) continue;
    for (int a = 0; a <= dim; a++) SbBoxAdd(box, im->x + 3 * item->vert[(dim + 1) * j + a]);
  }
  put(out, 4, tags + 1, ' ');
  for (int i = 0; i < (dim ? 6 : 3); i++) put_real(out, box[i], ' ');
  put(out, 8, count_groups(im, tags, dim), ' ');
  while ((g = next_group(im, tags, dim, &k)) >= 0) put(out, 4, out->number[g], ' ');
  if (dim) put(out, 8, 0, ' ');
  if (!out->binary) (void)fputc('\n', out->file);
}

/* Number of consecutive items from i on with the same tag set. */
static PetscInt run_length(const SbItems *item, PetscInt i)
{
  PetscInt n = 1;

  while (i + n < item->n && item->tags[i + n] == item->tags[i]) n++;
  return n;
}

static PetscErrorCode write_elements_41(Out *out)
{
  int64_t nrun = 0, number = 1;

  PetscFunctionBeginUser;
  for (int d = 0; d < 4; d++) {
    const SbItems *item = &out->im->item[d];

    for (PetscInt i = 0; i < item->n; i += run_length(item, i)) nrun++;
  }
  (void)fprintf(out->file, "$Elements\n");
  put(out, 8, nrun, ' ');
  put(out, 8, out->total, ' ');
  put(out, 8, 1, ' ');
  put(out, 8, out->total, '\n');
  for (int d = 0; d < 4; d++) {
    const SbItems *item = &out->im->item[d];

    for (PetscInt i = 0, n; i < item->n; i += n) {
      n = run_length(item, i);
      // a block of items of one tag set
      put(out, 4, d, ' ');
      put(out, 4, item->tags[i] + 1, ' ');
      put(out, 4, gmsh_type[out->edges.nedge > 0][d], ' ');
      put(out, 8, n, '\n');
      for (PetscInt k = i; k < i + n; k++) {
        put(out, 8, number++, ' ');
        put_nodes(out, d, item->vert + (size_t)(d + 1) * (size_t)k, 8);
        PetscCall(report_progress(out));
      }
    }
  }
  (void)fprintf(out->file, "%s$EndElements\n", out->binary ? "\n" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode write_elements_22(Out *out)
{
  const SbImport *im = out->im;
  int64_t n = 0, number = 1;

  PetscFunctionBeginUser;
  for (int d = 0; d < 4; d++)
    for (PetscInt i = 0; i < im->item[d].n; i++) n += PetscMax(1, count_groups(im, im->item[d].tags[i], d));
  PetscCheck(n <= INT32_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %lld elements are more than a file of version 2.2 can number; write version 4.1", im->where,
             (long long)n);
  (void)fprintf(out->file, "$Elements\n%lld\n", (long long)n);
  for (int d = 0; d < 4; d++) {
    for (PetscInt i = 0; i < im->item[d].n; i++) {
      const PetscInt *v = im->item[d].vert + (size_t)(d + 1) * (size_t)i, tags = im->item[d].tags[i];
      PetscInt k = im->tags_start[tags], g = next_group(im, tags, d, &k);

      // an element, once for each of its groups, or once with group 0. In binary each has a header
      do {
        if (!out->binary) put(out, 4, number, ' ');
        put(out, 4, gmsh_type[out->edges.nedge > 0][d], ' ');
        if (out->binary) put(out, 4, 1, ' ');
        put(out, 4, 2, ' ');
        if (out->binary) put(out, 4, number, ' ');
        put(out, 4, g < 0 ? 0 : out->number[g], ' ');
        put(out, 4, tags + 1, ' ');
        put_nodes(out, d, v, 4);
        number++;
        g = g < 0 ? -1 : next_group(im, tags, d, &k);
      } while (g >= 0);
      PetscCall(report_progress(out));
    }
  }
  (void)fprintf(out->file, "%s$EndElements\n", out->binary ? "\n" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode write_all(Out *out, PetscBool version22)
{
  const SbImport *im = out->im;
  const int32_t one = 1;
  PetscInt nname = 0;

  PetscFunctionBeginUser;
  (void)fprintf(out->file, "$MeshFormat\n%s %d 8\n", version22 ? "2.2" : "4.1", (int)out->binary);
  if (out->binary) {
    (void)fwrite(&one, 4, 1, out->file);
    (void)fputc('\n', out->file);
  }
  (void)fprintf(out->file, "$EndMeshFormat\n");
  // names of the groups, except default names
  for (PetscInt g = 0; g < im->ngroup; g++) nname += has_name(out, g);
  if (nname) (void)fprintf(out->file, "$PhysicalNames\n%lld\n", (long long)nname);
  for (PetscInt g = 0; g < im->ngroup; g++)
    if (has_name(out, g))
      (void)fprintf(out->file, "%d %lld \"%s\"\n", (int)im->group[g].dim, (long long)out->number[g],
                    im->group[g].name);
  if (nname) (void)fprintf(out->file, "$EndPhysicalNames\n");
  if (version22) {
    (void)fprintf(out->file, "$Nodes\n%lld\n", (long long)out->nnode);
    for (PetscInt v = 0; v < out->nnode; v++) {
      put(out, 4, v + 1, ' ');
      for (int i = 0; i < 3; i++) put_real(out, out->x[3 * v + i], i < 2 ? ' ' : '\n');
    }
    (void)fprintf(out->file, "%s$EndNodes\n", out->binary ? "\n" : "");
    PetscCall(write_elements_22(out));
  } else {
    PetscInt n[4] = {0, 0, 0, 0};

    // entities: one for each tag set of each dimension
    for (int d = 0; d < 4; d++)
      for (PetscInt t = 0; t < im->ntags; t++) n[d] += out->used[t][d];
    (void)fprintf(out->file, "$Entities\n");
    for (int d = 0; d < 4; d++) put(out, 8, n[d], d < 3 ? ' ' : '\n');
    for (int d = 0; d < 4; d++)
      for (PetscInt t = 0; t < im->ntags; t++)
        if (out->used[t][d]) write_entity(out, d, t);
    (void)fprintf(out->file, "%s$EndEntities\n", out->binary ? "\n" : "");
    // one block of nodes: all numbers, then all coordinates
    (void)fprintf(out->file, "$Nodes\n");
    put(out, 8, 1, ' ');
    put(out, 8, out->nnode, ' ');
    put(out, 8, 1, ' ');
    put(out, 8, out->nnode, '\n');
    put(out, 4, out->home_dim, ' ');
    put(out, 4, out->home + 1, ' ');
    put(out, 4, 0, ' ');
    put(out, 8, out->nnode, '\n');
    for (PetscInt v = 0; v < out->nnode; v++) put(out, 8, v + 1, '\n');
    for (PetscInt v = 0; v < out->nnode; v++)
      for (int i = 0; i < 3; i++) put_real(out, out->x[3 * v + i], i < 2 ? ' ' : '\n');
    (void)fprintf(out->file, "%s$EndNodes\n", out->binary ? "\n" : "");
    PetscCall(write_elements_41(out));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbWriteEnd(FILE *file, const char *path)
{
  int error = ferror(file) ? errno : 0;

  PetscFunctionBeginUser;
  if (fclose(file) && !error) error = errno;
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", path,
             strerror(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbWrite_Gmsh(const SbImport *im, const char *path, SbMeshFormat format)
{
  const PetscBool version22 = (PetscBool)(format == SB_MESH_MSH22 || format == SB_MESH_MSH22_BINARY);
  int64_t highest[4] = {0, 0, 0, 0};
  Out out = {.im = im,
             .home_dim = 3,
             .binary = (PetscBool)(format == SB_MESH_MSH41_BINARY || format == SB_MESH_MSH22_BINARY)};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  out.file = fopen(path, "wb");
  PetscCheck(out.file, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s cannot be written: %s", path,
             strerror(errno));
  (void)setvbuf(out.file, NULL, _IOFBF, 1 << 20);
  if (im->nmiddle.n) PetscCall(SbImportEdgesCreate(im, &out.edges));
  out.nnode = im->nvert + out.edges.nedge;
  PetscCall(PetscCalloc3(im->ntags, &out.used, im->ngroup, &out.number, 3 * (size_t)out.nnode, &out.x));
  // tag sets of each dimension; nodes belong to the first entity of the highest dimension
  for (int d = 0; d < 4; d++) {
    for (PetscInt i = 0; i < im->item[d].n; i++) out.used[im->item[d].tags[i]][d] = PETSC_TRUE;
    if (im->item[d].n) {
      out.home_dim = d;
      out.home = im->item[d].tags[0];
    }
    out.total += im->item[d].n;
  }
  // group numbers from 1 to INT32_MAX are kept; others are invalid in gmsh and get the next free numbers
  for (int later = 0; later < 2; later++) {
    for (PetscInt g = 0; g < im->ngroup; g++) {
      const SbGroup *p = &im->group[g];
      const PetscBool fits = (PetscBool)(p->tag > 0 && p->tag < INT32_MAX - im->ngroup);

      if (fits) {
        out.number[g] = p->tag;
        highest[p->dim] = PetscMax(highest[p->dim], p->tag);
      } else if (later)
        out.number[g] = ++highest[p->dim];
    }
  }
  // nodes: the vertices and, if there are curved edges, a node for each edge
  PetscCall(PetscArraycpy(out.x, im->x, 3 * (size_t)im->nvert));
  if (im->nmiddle.n) SbImportEdgeNodes(im, &out.edges, out.x + 3 * im->nvert);
  errno = 0;
  ierr = write_all(&out, version22);
  if (ierr)
    (void)fclose(out.file);
  else
    ierr = SbWriteEnd(out.file, path);
  PetscCall(PetscFree3(out.used, out.number, out.x));
  PetscCall(SbImportEdgesDestroy(&out.edges));
  PetscFunctionReturn(ierr);
}
