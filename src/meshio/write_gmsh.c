/*
  write_gmsh.c - writer of gmsh's .msh files, versions 4.1 and 2.2, text and binary (gmsh manual,
  "File formats").

  Version 4.1 assigns groups to entities of the geometry: each tag set of a dimension becomes one
  entity, and all nodes belong to the first entity of the highest dimension. Blocks follow the order
  of the items, and a new one begins where the tag set changes: reading the file gives the same
  order. Version 2.2 has one group per element: an element of several groups is written once for
  each; supple's reader merges them.

  A mesh with curved edges is written as one of second order: every edge has a node, after the
  vertices.

  Numbers count from 1. A double is written as text with 17 digits, so that it is read back exactly.
*/
#include "meshio_impl.h"
#include "sbgeometry.h"

typedef struct {
  const SbImport *im;
  FILE *file;
  PetscBool binary, version22;
  int64_t *number;        /* [ngroup] numbers of the groups in the file */
  PetscInt64 total, done; /* numbers of items to write and written, for progress reports */
  SbImportEdges edges;    /* edges of a mesh with curved edges, else empty */
} Out;

/* gmsh's element types by order and dimension. */
static const int gmsh_type[2][4] = {
  {SB_GMSH_POINT, SB_GMSH_LINE, SB_GMSH_TRIANGLE, SB_GMSH_TET},
  {SB_GMSH_POINT, SB_GMSH_LINE3, SB_GMSH_TRIANGLE6, SB_GMSH_TET10}};
/* Edges of an item by dimension, in gmsh's order. */
static const int nedge_of[4] = {0, 1, 3, 6},
                 edge_of[6][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}};

/* Writes an integer: text and a separator, or 4 or 8 bytes; fprintf() takes four times as long. */
static void put(Out *out, int bytes, int64_t value, char after)
{
  const int32_t small = (int32_t)value;
  char digits[24];
  char *p = digits + sizeof(digits);

  if (out->binary)
    (void)fwrite(bytes == 8 ? (const void *)&value : &small, (size_t)bytes, 1, out->file);
  else {
    *--p = after;
    do
      *--p = (char)('0' + value % 10);
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

/* Writes four integers on a line, in binary three of these bytes and one of 8. */
static void put_row(Out *out, int bytes, int64_t a, int64_t b, int64_t c, int64_t d)
{
  put(out, bytes, a, ' ');
  put(out, bytes, b, ' ');
  put(out, bytes, c, ' ');
  put(out, 8, d, '\n');
}

/* Writes the nodes of an item of dimension d. */
static void put_nodes(Out *out, int d, const PetscInt v[], int bytes)
{
  const int nedge = out->edges.nedge ? nedge_of[d] : 0;

  for (int a = 0; a <= d; a++)
    put(out, bytes, v[a] + 1, a < d || nedge ? ' ' : '\n');
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

    if (im->group[g].dim == dim)
      return g;
  }
  return -1;
}

static PetscInt count_groups(const SbImport *im, PetscInt tags, int dim)
{
  PetscInt n = 0;
  PetscInt k = im->tags_start[tags];

  while (next_group(im, tags, dim, &k) >= 0)
    n++;
  return n;
}

/* Version 4.1: an entity, which has the groups of a tag set. */
static void write_entity(Out *out, int dim, PetscInt tags)
{
  const SbImport *im = out->im;
  PetscReal box[6];
  PetscInt k = im->tags_start[tags];
  PetscInt g;
  const SbItems *item = &im->item[dim];

  // bounding box of the items of this tag set
  SbBoxClear(box);
  for (PetscInt j = 0; j < item->n; j++) {
    if (item->tags[j] != tags)
      continue;
    for (int a = 0; a <= dim; a++)
      SbBoxAdd(box, im->x + 3 * item->vert[(dim + 1) * j + a]);
  }
  put(out, 4, tags + 1, ' ');
  for (int i = 0; i < (dim ? 6 : 3); i++)
    put_real(out, box[i], ' ');
  put(out, 8, count_groups(im, tags, dim), ' ');
  while ((g = next_group(im, tags, dim, &k)) >= 0)
    put(out, 4, out->number[g], ' ');
  if (dim)
    put(out, 8, 0, ' ');
  if (!out->binary)
    (void)fputc('\n', out->file);
}

static PetscErrorCode write_elements(Out *out)
{
  const SbImport *im = out->im;
  const PetscBool v22 = out->version22;
  int64_t nblock = 0;
  int64_t n = 0;
  int64_t number = 1;

  PetscFunctionBeginUser;
  for (int d = 0; d < 4; d++) {
    const PetscInt *tags = im->item[d].tags;

    for (PetscInt i = 0; i < im->item[d].n; i++) {
      nblock += !i || tags[i] != tags[i - 1];
      n += v22 ? PetscMax(1, count_groups(im, tags[i], d)) : 1;
    }
  }
  PetscCheck(!v22 || n <= INT32_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: %lld elements are more than a file of version 2.2 can number; write version 4.1",
             im->where, (long long)n);
  (void)fprintf(out->file, v22 ? "$Elements\n%lld\n" : "$Elements\n", (long long)n);
  if (!v22)
    put_row(out, 8, nblock, n, 1, n);
  for (int d = 0; d < 4; d++) {
    const SbItems *item = &im->item[d];
    const int type = gmsh_type[out->edges.nedge > 0][d];

    for (PetscInt i = 0, end = 0; i < item->n; i++) {
      const PetscInt tags = item->tags[i];
      PetscInt k = im->tags_start[tags];
      PetscInt g = next_group(im, tags, d, &k);

      // 4.1: a block of items of one tag set
      if (!v22 && i == end) {
        while (end < item->n && item->tags[end] == tags)
          end++;
        put_row(out, 4, d, tags + 1, type, end - i);
      }

      // an element, in 2.2 once for each of its groups, or once with group 0. In binary each has a
      // header
      do {
        if (!v22 || !out->binary)
          put(out, v22 ? 4 : 8, number, ' ');
        if (v22) {
          put(out, 4, type, ' ');
          if (out->binary)
            put(out, 4, 1, ' ');
          put(out, 4, 2, ' ');
          if (out->binary)
            put(out, 4, number, ' ');
          put(out, 4, g < 0 ? 0 : out->number[g], ' ');
          put(out, 4, tags + 1, ' ');
        }
        put_nodes(out, d, item->vert + (size_t)(d + 1) * (size_t)i, v22 ? 4 : 8);
        number++;
        g = g < 0 ? -1 : next_group(im, tags, d, &k);
      } while (v22 && g >= 0);
      if (im->progress && !(out->done++ & 0xffff))
        PetscCall(im->progress("elements", out->done, out->total, im->progress_ctx));
    }
  }
  (void)fprintf(out->file, "%s$EndElements\n", out->binary ? "\n" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbWrite_Gmsh(const SbImport *im, SbMeshFormat format, FILE *file)
{
  int64_t highest[4] = {0, 0, 0, 0};
  Out out = {.im = im,
             .file = file,
             .version22 = (PetscBool)(format == SB_MESH_MSH22 || format == SB_MESH_MSH22_BINARY),
             .binary =
               (PetscBool)(format == SB_MESH_MSH41_BINARY || format == SB_MESH_MSH22_BINARY)};
  const int32_t one = 1;
  PetscInt n[4] = {0, 0, 0, 0};
  PetscInt nname = 0;
  PetscInt nnode;
  PetscInt home = 0;
  PetscBool(*used)[4]; /* [ntags] whether items of each dimension have the tag set */
  PetscReal *x;        /* [nnode][3] vertices, and a node of each edge if there are curved ones */
  int home_dim = 3;

  PetscFunctionBeginUser;
  if (im->nmiddle.n)
    PetscCall(SbImportEdgesCreate(im, &out.edges));
  nnode = im->nvert + out.edges.nedge;
  PetscCall(PetscCalloc3(im->ntags, &used, im->ngroup, &out.number, 3 * (size_t)nnode, &x));
  PetscCall(PetscArraycpy(x, im->x, 3 * (size_t)im->nvert));
  if (im->nmiddle.n)
    SbImportEdgeNodes(im, &out.edges, x + 3 * im->nvert);

  // tag sets of each dimension; nodes belong to the first entity of the highest dimension
  for (int d = 0; d < 4; d++) {
    for (PetscInt i = 0; i < im->item[d].n; i++)
      used[im->item[d].tags[i]][d] = PETSC_TRUE;
    for (PetscInt t = 0; t < im->ntags; t++)
      n[d] += used[t][d];
    if (im->item[d].n) {
      home_dim = d;
      home = im->item[d].tags[0];
    }
    out.total += im->item[d].n;
  }

  // group numbers from 1 to INT32_MAX are kept; others are invalid in gmsh and get the next free
  // numbers
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
  (void)fprintf(file, "$MeshFormat\n%s %d 8\n", out.version22 ? "2.2" : "4.1", (int)out.binary);
  if (out.binary) {
    (void)fwrite(&one, 4, 1, file);
    (void)fputc('\n', file);
  }
  (void)fprintf(file, "$EndMeshFormat\n");

  // names of the groups, except default names
  for (PetscInt g = 0; g < im->ngroup; g++)
    nname += has_name(&out, g);
  if (nname)
    (void)fprintf(file, "$PhysicalNames\n%lld\n", (long long)nname);
  for (PetscInt g = 0; g < im->ngroup; g++)
    if (has_name(&out, g))
      (void)fprintf(file, "%d %lld \"%s\"\n", (int)im->group[g].dim, (long long)out.number[g],
                    im->group[g].name);
  if (nname)
    (void)fprintf(file, "$EndPhysicalNames\n");

  // 4.1: entities, one for each tag set of each dimension
  if (!out.version22) {
    (void)fprintf(file, "$Entities\n");
    put_row(&out, 8, n[0], n[1], n[2], n[3]);
    for (int d = 0; d < 4; d++)
      for (PetscInt t = 0; t < im->ntags; t++)
        if (used[t][d])
          write_entity(&out, d, t);
    (void)fprintf(file, "%s$EndEntities\n", out.binary ? "\n" : "");
  }

  // nodes; in 4.1 one block: all numbers, then all coordinates
  (void)fprintf(file, out.version22 ? "$Nodes\n%lld\n" : "$Nodes\n", (long long)nnode);
  if (!out.version22) {
    put_row(&out, 8, 1, nnode, 1, nnode);
    put_row(&out, 4, home_dim, home + 1, 0, nnode);
    for (PetscInt v = 0; v < nnode; v++)
      put(&out, 8, v + 1, '\n');
  }
  for (PetscInt v = 0; v < nnode; v++) {
    if (out.version22)
      put(&out, 4, v + 1, ' ');
    for (int i = 0; i < 3; i++)
      put_real(&out, x[3 * v + i], i < 2 ? ' ' : '\n');
  }
  (void)fprintf(file, "%s$EndNodes\n", out.binary ? "\n" : "");
  PetscCall(write_elements(&out));
  PetscCall(PetscFree3(used, out.number, x));
  PetscCall(SbImportEdgesDestroy(&out.edges));
  PetscFunctionReturn(PETSC_SUCCESS);
}
