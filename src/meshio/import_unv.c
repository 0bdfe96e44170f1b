/*
  import_unv.c - reader of universal files, .unv (SDRC I-DEAS; data set 15 or 2411: nodes, 2412: elements, 2429 to 2477: groups).

  A data set stands between two lines of -1 and begins with its number. Read: nodes with their coordinates, as they are (units and
  coordinate systems are not applied); tets, triangles, lines. An element belongs to volume_N, surface_N or curve_N by the number N of its
  physical property, and to the groups that list it, by name. Groups of nodes are kept too. Refused: volume elements other than 4-node tets.
*/
#include <ctype.h>
#include "gmsh_types.h"

typedef struct {
  SbScan scan;
  SbImport *im;
  SbNumbers nodes, elements;
  SbGroupMembership members;
  PetscInt nelement, capacity;
  int64_t *label;      /* [nelement] of every kept element */
  SbGroupMember *item; /* [nelement] where it is; group is not used */
  int64_t count[SB_GMSH_NTYPES];
} Unv;

/* FE descriptor ids: what gmsh calls them. Others (springs, masses) have no place in a body and are passed over. */
static const struct {
  int id, type;
} types[] = {
  {11, 1},   {21, 1},  {22, 1},  {31, 1},   {23, 8},   {24, 8},   {32, 8},  {41, 2},  {51, 2},
  {61, 2},   {74, 2},  {81, 2},  {91, 2},   {42, 9},   {52, 9},   {62, 9},  {72, 9},  {82, 9},
  {92, 9},   {44, 3},  {54, 3},  {64, 3},   {71, 3},   {84, 3},   {94, 3},  {45, 16}, {55, 16},
  {65, 16},  {75, 16}, {85, 16}, {95, 16},  {111, 4},  {118, 11}, {101, 6}, {112, 6}, {102, 18},
  {113, 18}, {104, 5}, {115, 5}, {105, 17}, {116, 17},
};

/* ------------------------------------------------------------------ lines */

/* Whether this line holds -1 and nothing else. */
static PetscBool is_mark(const SbScan *s)
{
  const char *p = s->at;

  while (p < s->end && (*p == ' ' || *p == '\t')) p++;
  if (s->end - p < 2 || p[0] != '-' || p[1] != '1') return PETSC_FALSE;
  for (p += 2; p < s->end && *p != '\n'; p++) {
    if (!isspace((unsigned char)*p)) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Whether the data set ends here: at a mark, or with the file, which is an error. */
static PetscErrorCode at_end(Unv *u, PetscBool *end)
{
  SbScan *s = &u->scan;

  PetscFunctionBeginUser;
  while (s->at < s->end && (*s->at == '\n' || *s->at == '\r')) s->at++;
  s->token = s->at;
  if (s->at >= s->end)
    SB_SCAN_ERROR(s, "the file ends where a line of -1 is expected; it is truncated, write or copy it again");
  *end = is_mark(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lines up to the next mark. */
static int64_t lines_left(const Unv *u)
{
  SbScan s = u->scan;
  int64_t n = 0;

  for (; s.at < s.end && !is_mark(&s); n++) (void)SbScanEndOfLine(&s);
  return n;
}

/* ------------------------------------------------------------------ nodes */

/* Set 2411 has the coordinates on a line of their own, set 15 on the same one. */
static PetscErrorCode read_nodes(Unv *u, int nline)
{
  SbScan *s = &u->scan;
  const int64_t n = lines_left(u) / nline;
  int64_t other;
  PetscBool end;
  PetscInt v = 0;

  PetscFunctionBeginUser;
  if (u->im->x) SB_SCAN_ERROR(s, "second set of nodes");
  PetscCall(SbScanRoom(s, "nodes", n, 8, 8));
  PetscCall(SbImportSetVertices(u->im, (PetscInt)n));
  for (;; v++) {
    PetscCall(at_end(u, &end));
    if (end) break;
    if (v >= n) SB_SCAN_ERROR(s, "a node without coordinates; the file is damaged");
    PetscCall(SbScanText(s, "label of a node", &u->im->vert_number[v]));
    for (int i = 0; i < 3; i++) PetscCall(SbScanText(s, "coordinate system or colour of a node", &other));
    PetscCall(SbScanPoint(s, "coordinate", u->im->vert_number[v], u->im->x + 3 * v));
    PetscCall(SbScanEndOfLine(s));
  }
  u->im->nvert = v;
  PetscCall(SbNumbersCreate(v, u->im->vert_number, &u->nodes));
  if (u->nodes.repeated)
    SB_SCAN_ERROR(s, "node %lld is given twice; renumber the nodes", (long long)u->nodes.twice);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ elements */

static PetscErrorCode read_element(Unv *u)
{
  SbScan *s = &u->scan;
  int64_t label, id, property, other, n, node;
  PetscInt vert[4] = {0, 0, 0, 0};
  int type = 0;

  PetscFunctionBeginUser;
  PetscCall(SbScanText(s, "label of an element", &label));
  PetscCall(SbScanText(s, "kind of an element", &id));
  PetscCall(SbScanText(s, "physical property of an element", &property));
  PetscCall(SbScanText(s, "material of an element", &other));
  PetscCall(SbScanText(s, "colour of an element", &other));
  PetscCall(SbScanText(s, "number of nodes of an element", &n));
  PetscCall(SbScanRoom(s, "nodes of an element", n, 2, 2));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types); i++) {
    if (types[i].id == id) type = types[i].type;
  }
  if (type && SbGmshTypes[type].nnode != n)
    SB_SCAN_ERROR(s, "element %lld of kind %lld has %lld nodes; expected %d", (long long)label, (long long)id,
                  (long long)n, SbGmshTypes[type].nnode);
  if (type == 1 || type == 8) { /* a beam has a record of its own */
    for (int i = 0; i < 3; i++) PetscCall(SbScanText(s, "section of a beam", &other));
  }
  for (int64_t k = 0; k < n; k++) {
    PetscCall(SbScanText(s, "node of an element", &node));
    if (k < 4) vert[k] = SbNumbersFind(&u->nodes, node);
    if (type && k < 4 && vert[k] < 0)
      SB_SCAN_ERROR(s, "element %lld uses node %lld, which is not there", (long long)label, (long long)node);
  }
  if (type) u->count[type]++;
  if (type == SB_GMSH_TET || type == SB_GMSH_TRIANGLE || type == SB_GMSH_LINE) {
    const int dim = SbGmshTypes[type].dim;
    PetscInt tags;

    // kept elements are listed for the groups that name them
    if (u->nelement == u->capacity) {
      u->capacity = PetscMax(256, 2 * u->capacity);
      PetscCall(PetscRealloc((size_t)u->capacity * sizeof(*u->label), &u->label));
      PetscCall(PetscRealloc((size_t)u->capacity * sizeof(*u->item), &u->item));
    }
    u->label[u->nelement] = label;
    u->item[u->nelement++] = (SbGroupMember){dim, u->im->item[dim].n, 0};
    PetscCall(SbImportTagsAlone(u->im, dim, property, NULL, &tags));
    PetscCall(SbImportAddItem(u->im, dim, vert, tags, label));
  }
  PetscCall(SbScanEndOfLine(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_elements(Unv *u)
{
  PetscBool end;

  PetscFunctionBeginUser;
  if (!u->im->x) SB_SCAN_ERROR(&u->scan, "elements before the nodes");
  for (;;) {
    PetscCall(at_end(u, &end));
    if (end) break;
    PetscCall(read_element(u));
  }
  PetscCall(SbNumbersCreate(u->nelement, u->label, &u->elements));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ groups */

/* A node or an element joins group `number`; what is no part of the body is left out. */
static PetscErrorCode add_member(Unv *u, int64_t kind, int64_t label, int64_t number, const char *name)
{
  const int64_t tag = number + ((int64_t)1 << 40); /* apart from the numbers of properties */
  PetscInt at, group, tags;

  PetscFunctionBeginUser;
  if (kind == 7) {
    at = SbNumbersFind(&u->nodes, label);
    if (at < 0)
      SB_SCAN_ERROR(&u->scan, "group '%s' lists node %lld, which is not there", name, (long long)label);
    PetscCall(SbImportTagsAlone(u->im, 0, tag, name, &tags));
    PetscCall(SbImportAddItem(u->im, 0, &at, tags, label));
  } else if (kind == 8) {
    at = SbNumbersFind(&u->elements, label);
    if (at < 0) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(SbImportGroup(u->im, u->item[at].dim, tag, name, &group));
    PetscCall(SbGroupMembershipAdd(&u->members, u->item[at].dim, u->item[at].item, group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_group(Unv *u, int nvalue)
{
  SbScan *s = &u->scan;
  int64_t number, n = 0, kind, label, other;
  char name[SB_GROUP_MAX];
  size_t length = 0;

  PetscFunctionBeginUser;
  PetscCall(SbScanText(s, "number of a group", &number));
  while (SbScanMore(s, '\n')) PetscCall(SbScanText(s, "number of members of a group", &n));
  PetscCall(SbScanRoom(s, "members of a group", n, 4, 4));
  PetscCall(SbScanEndOfLine(s));
  (void)SbScanMore(s, '\n');
  for (; s->at < s->end && *s->at != '\n'; s->at++) {
    if (length + 1 < sizeof(name)) name[length++] = isprint((unsigned char)*s->at) ? *s->at : ' ';
  }
  while (length && name[length - 1] == ' ') length--;
  name[length] = 0;
  if (!length) (void)snprintf(name, sizeof(name), "group_%lld", (long long)number);
  for (int64_t i = 0; i < n; i++) {
    PetscCall(SbScanText(s, "kind of a member of a group", &kind));
    PetscCall(SbScanText(s, "label of a member of a group", &label));
    for (int k = 2; k < nvalue; k++) PetscCall(SbScanText(s, "value of a member of a group", &other));
    PetscCall(add_member(u, kind, label, number, name));
  }
  PetscCall(SbScanEndOfLine(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each member has so many values: kind and label, and since set 2435 two more. */
static PetscErrorCode read_groups(Unv *u, int nvalue)
{
  PetscBool end;

  PetscFunctionBeginUser;
  for (;;) {
    PetscCall(at_end(u, &end));
    if (end) break;
    PetscCall(read_group(u, nvalue));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the file */

static PetscErrorCode read_set(Unv *u)
{
  SbScan *s = &u->scan;
  int64_t id;

  PetscFunctionBeginUser;
  PetscCall(SbScanText(s, "number of a data set", &id));
  PetscCall(SbScanEndOfLine(s));
  if (id == 2411 || id == 781) return read_nodes(u, 2);
  if (id == 15) return read_nodes(u, 1);
  if (id == 2412) return read_elements(u);
  if (id == 2429 || id == 2430 || id == 2432) return read_groups(u, 2);
  if (id == 2435 || id == 2452 || id == 2467 || id == 2477) return read_groups(u, 4);
  while (s->at < s->end && !is_mark(s)) PetscCall(SbScanEndOfLine(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_file(const char *path, Unv *u)
{
  SbScan *s = &u->scan;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(u->im->where, path, s));
  for (;;) {
    SbScanNext(s, 0);
    if (s->at >= s->end) break;
    while (s->at > s->data && s->at[-1] != '\n') s->at--; /* the whole line */
    if (!is_mark(s)) SB_SCAN_ERROR(s, "expected a line of -1; this is no universal file, or it is damaged");
    PetscCall(SbScanEndOfLine(s));
    PetscCall(read_set(u));
    if (s->at >= s->end)
      SB_SCAN_ERROR(s,
                    "the file ends where a line of -1 is expected; it is truncated, write or copy it again");
    PetscCall(SbScanEndOfLine(s));
  }
  if (!u->im->x) SB_SCAN_ERROR(s, "there are no nodes (data set 2411 or 15)");
  PetscCall(SbGmshCheckTypes(u->im, u->count));
  PetscCall(SbGroupMembershipApply(&u->members, u->im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_UNV(const char *path, SbImport *im)
{
  Unv u;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&u, sizeof(u)));
  u.im = im;
  ierr = read_file(path, &u);
  PetscCall(SbNumbersDestroy(&u.nodes));
  PetscCall(SbNumbersDestroy(&u.elements));
  PetscCall(SbGroupMembershipDestroy(&u.members));
  PetscCall(PetscFree(u.label));
  PetscCall(PetscFree(u.item));
  PetscCall(SbScanClose(&u.scan));
  PetscFunctionReturn(ierr);
}
