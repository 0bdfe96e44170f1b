/*
  import.c - a body on rank 0: the reader chosen by the name of its mesh, its groups, its placement.

  A new format is one file with one SbReader and one row in the table below.

  Groups: an entity of a file may belong to several physical groups. The set of groups of an item is stored once (a "tag
  set") and items refer to it; set 0 is the empty one.

  Placement: x <- R (s x) + t, with the rotation R by Rodrigues' formula about an axis through the origin of the file.
*/
#include <strings.h>
#include "format_impl.h"
#include "sbskin.h"

/* ------------------------------------------------------------------ the parts of an import */

/* Room for at least `need` elements of `unit` bytes; doubles, so that appending is cheap. */
static PetscErrorCode reserve(PetscInt need, PetscInt *capacity, size_t unit, void *array)
{
  PetscInt grown = PetscMax(need, 2 * *capacity);

  PetscFunctionBeginUser;
  if (need <= *capacity) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscRealloc((size_t)PetscMax(grown, 16) * unit, (void **)array));
  *capacity = PetscMax(grown, 16);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSetVertices(SbImport *im, PetscInt n)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * (size_t)n, &im->x));
  PetscCall(PetscMalloc1(n, &im->vert_number));
  im->nvert = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportAddItem(SbImport *im, int dim, const PetscInt vert[], PetscInt tags, int64_t number)
{
  SbItems *item = &im->item[dim];

  PetscFunctionBeginUser;
  if (item->n == item->capacity) {
    const PetscInt grown = PetscMax(64, 2 * item->capacity);

    PetscCall(PetscRealloc((size_t)grown * (size_t)(dim + 1) * sizeof(PetscInt), &item->vert));
    PetscCall(PetscRealloc((size_t)grown * sizeof(PetscInt), &item->tags));
    PetscCall(PetscRealloc((size_t)grown * sizeof(int64_t), &item->number));
    item->capacity = grown;
  }
  for (int i = 0; i <= dim; i++) item->vert[(dim + 1) * item->n + i] = vert[i];
  item->tags[item->n] = tags;
  item->number[item->n++] = number;
  if (im->progress && !(item->n & 0xffff))
    PetscCall(im->progress(dim == 3 ? "tets" : "triangles", item->n, 0, im->progress_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSetItems(SbImport *im, int dim, PetscInt n)
{
  SbItems *item = &im->item[dim];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1((size_t)n * (size_t)(dim + 1), &item->vert));
  PetscCall(PetscMalloc1(n, &item->tags));
  PetscCall(PetscMalloc1(n, &item->number));
  for (PetscInt i = 0; i < n; i++) item->number[i] = i + 1;
  item->n = item->capacity = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slot of a group, or the free one where it belongs. */
static PetscInt find_slot(const SbImport *im, PetscInt dim, int64_t tag)
{
  const uint64_t hash = ((uint64_t)tag * 4 + (uint64_t)dim) * 0x9e3779b97f4a7c15u;
  PetscInt s = (PetscInt)(hash >> 33) & (im->nslot - 1);

  for (; im->slot[s] >= 0; s = (s + 1) & (im->nslot - 1)) {
    const SbGroup *group = &im->group[im->slot[s]];

    if (group->dim == dim && group->tag == tag) break;
  }
  return s;
}

/* Slots for all groups and one more, at most half of them taken. */
static PetscErrorCode hash_groups(SbImport *im)
{
  PetscFunctionBeginUser;
  if (2 * (im->ngroup + 1) <= im->nslot) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(im->slot));
  for (im->nslot = 64; im->nslot < 4 * (im->ngroup + 1);) im->nslot *= 2;
  PetscCall(PetscMalloc1(im->nslot, &im->slot));
  for (PetscInt s = 0; s < im->nslot; s++) im->slot[s] = -1;
  for (PetscInt g = 0; g < im->ngroup; g++) im->slot[find_slot(im, im->group[g].dim, im->group[g].tag)] = g;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportGroup(SbImport *im, PetscInt dim, int64_t tag, const char *name, PetscInt *group)
{
  static const char *const kind[4] = {"point", "curve", "surface", "volume"};
  PetscInt s, g;

  PetscFunctionBeginUser;
  PetscCall(hash_groups(im));
  s = find_slot(im, dim, tag);
  g = im->slot[s];
  if (g < 0) {
    g = im->slot[s] = im->ngroup;
    PetscCall(reserve(g + 1, &im->capacity[0], sizeof(SbGroup), &im->group));
    im->group[g].dim = dim;
    im->group[g].tag = tag;
    im->group[g].alone = -1;
    (void)snprintf(im->group[g].name, SB_GROUP_MAX, "%s_%lld", kind[dim], (long long)tag);
    im->ngroup++;
  }
  if (name) PetscCall(PetscStrncpy(im->group[g].name, name, SB_GROUP_MAX));
  *group = g;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends a tag set. */
static PetscErrorCode add_tag_set(SbImport *im, PetscInt n, const PetscInt groups[], PetscInt *tags)
{
  const PetscInt start = im->tags_start[im->ntags];

  PetscFunctionBeginUser;
  PetscCall(reserve(start + n, &im->capacity[2], sizeof(PetscInt), &im->tags_group));
  PetscCall(reserve(im->ntags + 2, &im->capacity[1], sizeof(PetscInt), &im->tags_start));
  for (PetscInt i = 0; i < n; i++) im->tags_group[start + i] = groups[i];
  *tags = im->ntags;
  im->tags_start[++im->ntags] = start + n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportTagsAlone(SbImport *im, PetscInt dim, int64_t tag, const char *name, PetscInt *tags)
{
  PetscInt group;

  PetscFunctionBeginUser;
  PetscCall(SbImportGroup(im, dim, tag, name, &group));
  if (im->group[group].alone < 0) PetscCall(add_tag_set(im, 1, &group, &im->group[group].alone));
  *tags = im->group[group].alone;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportTagSet(SbImport *im, PetscInt n, PetscInt groups[], PetscInt *tags)
{
  PetscInt start;

  PetscFunctionBeginUser;
  PetscCall(PetscSortRemoveDupsInt(&n, groups));
  /* Set 0 exists from the first call on. */
  if (!im->ntags) {
    PetscCall(reserve(2, &im->capacity[1], sizeof(PetscInt), &im->tags_start));
    im->tags_start[0] = im->tags_start[1] = 0;
    im->ntags = 1;
  }
  if (n == 1 && im->group) {
    PetscInt *alone = &im->group[groups[0]].alone;

    if (*alone < 0) PetscCall(add_tag_set(im, 1, groups, alone));
    *tags = *alone;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (*tags = 0; *tags < im->ntags; (*tags)++) {
    start = im->tags_start[*tags];
    if (im->tags_start[*tags + 1] - start != n) continue;
    if (!n || !memcmp(groups, im->tags_group + start, (size_t)n * sizeof(PetscInt)))
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(add_tag_set(im, n, groups, tags));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *SbImportOption(const SbImport *im, const char *key, char name[SB_OPTION_NAME_MAX])
{
  if (im->body[0])
    (void)snprintf(name, SB_OPTION_NAME_MAX, "-body_%s_%s", im->body, key);
  else
    (void)snprintf(name, SB_OPTION_NAME_MAX, "-%s", strncmp(key, "tet_", 4) ? key : key + 4);
  return name;
}

PetscErrorCode SbImportDestroy(SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(im->x));
  PetscCall(PetscFree(im->vert_number));
  for (int d = 0; d < 4; d++) {
    PetscCall(PetscFree(im->item[d].vert));
    PetscCall(PetscFree(im->item[d].tags));
    PetscCall(PetscFree(im->item[d].number));
  }
  PetscCall(PetscFree(im->group));
  PetscCall(PetscFree(im->tags_start));
  PetscCall(PetscFree(im->tags_group));
  PetscCall(PetscFree(im->slot));
  PetscCall(PetscMemzero(im, sizeof(*im)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ placement */

/* Rotation by `degrees` about `axis`; exact for quarter turns about the axes of the frame. */
static PetscErrorCode rotation(const SbBody *body, PetscReal R[3][3])
{
  const PetscReal *w = body->rotate;
  const PetscReal angle = body->rotate[3] * PETSC_PI / 180,
                  length = PetscSqrtReal(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  PetscReal c = PetscCosReal(angle), s = PetscSinReal(angle), a[3];

  PetscFunctionBeginUser;
  PetscCheck(length > 0 && isfinite(length) && isfinite(angle), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "body '%s': rotation by %g degrees about (%g, %g, %g): the axis must have a length above zero",
             body->name, (double)w[3], (double)w[0], (double)w[1], (double)w[2]);
  if (PetscAbsReal(c) < 1e-15) c = 0;
  if (PetscAbsReal(s) < 1e-15) s = 0;
  for (int i = 0; i < 3; i++) a[i] = w[i] / length;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) R[i][j] = (1 - c) * a[i] * a[j] + (i == j ? c : 0);
    R[i][(i + 1) % 3] -= s * a[(i + 2) % 3];
    R[i][(i + 2) % 3] += s * a[(i + 1) % 3];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode place(const SbBody *body, SbImport *im)
{
  PetscReal R[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  char scale[SB_OPTION_NAME_MAX], translate[SB_OPTION_NAME_MAX];

  PetscFunctionBeginUser;
  if (body->rotate[3] != 0) PetscCall(rotation(body, R));
  for (PetscInt v = 0; v < im->nvert; v++) {
    PetscReal *x = im->x + 3 * v, y[3];

    for (int i = 0; i < 3; i++) y[i] = im->scale * x[i];
    for (int i = 0; i < 3; i++) {
      x[i] = R[i][0] * y[0] + R[i][1] * y[1] + R[i][2] * y[2] + body->translate[i];
      PetscCheck(isfinite(x[i]), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                 "%s: node %lld leaves the range of numbers when scaled by %g; check %s and %s", im->where,
                 (long long)im->vert_number[v], (double)body->scale, SbImportOption(im, "scale", scale),
                 SbImportOption(im, "translate", translate));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ choice of the reader */

/* Files by their extension. */
static const struct {
  const char *extension;
  SbReader read;
} readers[] = {
  {".msh", SbImportRead_Msh},      {".vtk", SbImportRead_VTK},
  {".vtu", SbImportRead_VTU},      {".mesh", SbImportRead_Mesh},
  {".node", SbImportRead_TetGen},  {".ele", SbImportRead_TetGen},
  {".face", SbImportRead_TetGen},  {".edge", SbImportRead_TetGen},
  {".vol", SbImportRead_Netgen},   {".neu", SbImportRead_NetgenNeutral},
  {".inp", SbImportRead_Abaqus},   {".unv", SbImportRead_UNV},
  {".bdf", SbImportRead_Nastran},  {".nas", SbImportRead_Nastran},
  {".stl", SbImportRead_Surface},  {".obj", SbImportRead_Surface},
  {".off", SbImportRead_Surface},  {".ply", SbImportRead_Surface},
  {".h5", SbImportRead_H5},        {".xmf", SbImportRead_Xdmf},
  {".poly", SbImportRead_Surface}, {".smesh", SbImportRead_Surface},
};

/* The reader of a file with this ending; NULL when there is none: then `known` lists all endings. */
static SbReader reader_of(const char *mesh, size_t size, char known[])
{
  const char *dot = strrchr(mesh, '.');
  size_t used = 0;

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(readers); i++) {
    if (dot && !strcasecmp(dot, readers[i].extension)) return readers[i].read;
    (void)snprintf(known + used, size - used, "%s%s", i ? " " : "", readers[i].extension);
    used = strlen(known);
  }
  return NULL;
}

/* The name may be what the files of TetGen have in common. */
static PetscErrorCode find_reader(const SbBody *body, SbReader *read)
{
  char known[256] = "", node[PETSC_MAX_PATH_LEN + 8];
  PetscBool tetgen;

  PetscFunctionBeginUser;
  if (!strncmp(body->mesh, "box:", 4)) {
    *read = SbImportRead_Box;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  *read = reader_of(body->mesh, sizeof(known), known);
  if (*read) PetscFunctionReturn(PETSC_SUCCESS);
  (void)snprintf(node, sizeof(node), "%s.node", body->mesh);
  PetscCall(PetscTestFile(node, 'r', &tetgen));
  PetscCheck(
    tetgen, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s%s%smesh '%s' is of no known kind; give a file that ends in %s (or the name of TetGen's files "
    "without an ending), or box:lx,ly,lz:n",
    body->name[0] ? "body '" : "", body->name, body->name[0] ? "': " : "", body->mesh, known);
  *read = SbImportRead_TetGen;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is given about a body before it is read. */
static PetscErrorCode begin(const SbBody *body, SbImport *im)
{
  PetscInt none;

  PetscFunctionBeginUser;
  if (body->name[0])
    (void)snprintf(im->where, sizeof(im->where), "body '%s': %s", body->name, body->mesh);
  else
    (void)snprintf(im->where, sizeof(im->where), "%s", body->mesh);
  PetscCall(PetscStrncpy(im->body, body->name, sizeof(im->body)));
  im->step = body->mesh_step;
  PetscCall(SbImportTagSet(im, 0, NULL, &none));
  im->tet = body->tet;
  im->scale = body->scale;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead(const SbBody *body, SbImport *im)
{
  SbReader read;

  PetscFunctionBeginUser;
  PetscCall(find_reader(body, &read));
  PetscCall(begin(body, im));
  PetscCall(read(body->mesh, im));
  PetscCall(place(body, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSlabs(const SbBody *body, PetscInt *ncell)
{
  char known[256];

  PetscFunctionBeginUser;
  *ncell = 0;
  if (!body->given && !body->mesh_step && reader_of(body->mesh, sizeof(known), known) == SbImportRead_H5)
    PetscCall(SbImportSlabs_H5(body->mesh, ncell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSlab(const SbBody *body, PetscInt k, PetscInt n, SbImport *im, SbSlabRows *rows)
{
  PetscFunctionBeginUser;
  PetscCall(begin(body, im));
  PetscCall(SbImportSlab_H5(body->mesh, k, n, im, rows));
  PetscCall(place(body, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
