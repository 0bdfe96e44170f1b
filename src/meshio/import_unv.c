/*
  import_unv.c - universal files, .unv (SDRC I-DEAS; data set 15 or 2411: nodes, 2412: elements,
  2429 to 2477: groups).

  A data set is enclosed by two lines of -1 and begins with its number. Read: nodes with their
  coordinates (units are said where they are not m; local coordinate systems are errors); tets,
  triangles, lines. An element belongs to the group volume_N, surface_N or curve_N of its physical
  property N, and to the named groups that list it. Groups of nodes are kept too. Errors: volume
  elements other than tets of 4 or 10 nodes.
*/
#include <stdlib.h>
#include "meshio_impl.h"

/* FE descriptor ids, and gmsh's types. Others (springs, masses) are skipped. */
static const struct {
  int id, type;
} types[] = {
  {11, 1},   {21, 1},  {22, 1},  {31, 1},   {23, 8},   {24, 8},   {32, 8},  {41, 2},  {51, 2},
  {61, 2},   {74, 2},  {81, 2},  {91, 2},   {42, 9},   {52, 9},   {62, 9},  {72, 9},  {82, 9},
  {92, 9},   {44, 3},  {54, 3},  {64, 3},   {71, 3},   {84, 3},   {94, 3},  {45, 16}, {55, 16},
  {65, 16},  {75, 16}, {85, 16}, {95, 16},  {111, 4},  {118, 11}, {101, 6}, {112, 6}, {102, 18},
  {113, 18}, {104, 5}, {115, 5}, {105, 17}, {116, 17},
};

/* Whether this line is a delimiter: -1 and nothing else. */
static PetscBool is_mark(const SbScan *s)
{
  const char *p = s->at + strspn(s->at, " \t");

  if (strncmp(p, "-1", 2))
    return PETSC_FALSE;
  p += 2 + strspn(p + 2, " \t\r\v\f");
  return (PetscBool)(*p == '\n' || p == s->end);
}

static PetscErrorCode read_element(SbDeck *d)
{
  static const char *const what[6] = {
    "label of an element",    "kind of an element",   "physical property of an element",
    "material of an element", "colour of an element", "number of nodes of an element"};

  /* quadratic simplices, by dimension: around the first face, corners and edge nodes in turn, then
     upwards */
  static const int around[4][10] = {
    {0}, {0, 2, 1}, {0, 3, 1, 4, 2, 5}, {0, 4, 1, 5, 2, 6, 7, 8, 9, 3}};
  SbScan *s = &d->im->scan;
  int64_t head[6], n, other;
  SbDeckElement e = {.type = 0};
  int dim;

  PetscFunctionBeginUser;
  for (int i = 0; i < 6; i++)
    PetscCall(SbScanText(s, what[i], &head[i]));
  e.label = head[0];
  e.property = head[2];
  n = head[5];
  PetscCall(SbScanRoom(s, "nodes of an element", n, 2, 2));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types); i++)
    if (types[i].id == head[1])
      e.type = types[i].type;
  if (e.type && SbGmshTypes[e.type].dim == 1 && (n == 2 || n == 3))
    e.type = n == 2 ? SB_GMSH_LINE : SB_GMSH_LINE3; // Salome writes quadratic beams as kind 22
  if (!e.type && head[1] > 100 && head[1] < 120)
    SB_SCAN_ERROR(s, "element %lld of kind %lld; supple simulates tetrahedra of kind 111 and 118",
                  (long long)e.label, (long long)head[1]);
  if (!e.type)
    PetscCall(SbImportSkip(d->im, "elements of kind %lld", (long long)head[1]));
  if (e.type && SbGmshTypes[e.type].nnode != n)
    SB_SCAN_ERROR(s, "element %lld of kind %lld has %lld nodes; expected %d", (long long)e.label,
                  (long long)head[1], (long long)n, SbGmshTypes[e.type].nnode);
  for (int i = 0; i < 3 && (e.type == 1 || e.type == 8); i++) /* beams have an additional record */
    PetscCall(SbScanText(s, "section of a beam", &other));
  dim = SbGmshTypes[e.type].dim;
  for (int64_t k = 0; k < n; k++) {
    const PetscBool quadratic = (PetscBool)(SbGmshIsSimplex(e.type) && n > dim + 1);
    int64_t *node = &other;

    if (k < 10)
      node = &e.node[quadratic ? around[dim][k] : k];
    PetscCall(SbScanText(s, "node of an element", node));
    if (!k)
      e.at = s->token;
  }
  if (e.type)
    PetscCall(SbDeckAddElement(d, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a group. A member has nvalue values: kind (7 a node, 8 an element), label, since 2435 two
   more. */
static PetscErrorCode read_group(SbDeck *d, int nvalue)
{
  SbScan *s = &d->im->scan;
  int64_t number;
  int64_t n = 0;
  int64_t value[4];
  char name[SB_GROUP_MAX];
  PetscInt set[2] = {-1, -1};

  PetscFunctionBeginUser;
  PetscCall(SbScanText(s, "number of a group", &number));
  while (SbScanMore(s, '\n'))
    PetscCall(SbScanText(s, "number of members of a group", &n));
  PetscCall(SbScanRoom(s, "members of a group", n, 4, 4));
  SbScanEndOfLine(s);
  PetscCall(SbScanRestOfLine(s, sizeof(name), name));
  if (!name[0])
    (void)snprintf(name, sizeof(name), "group_%lld", (long long)number);
  for (int64_t i = 0; i < n; i++) {
    PetscCall(SbScanText(s, "kind of a member of a group", &value[0]));
    PetscCall(SbScanText(s, "label of a member of a group", &value[1]));
    if (value[0] == 7 || value[0] == 8) {
      PetscInt *mine = &set[value[0] - 7];

      if (*mine < 0)
        PetscCall(SbDeckFindSet(d, (PetscBool)(value[0] == 7), name, mine));
      PetscCall(SbDeckAddRange(d, *mine, -1, value[1], value[1], 1));
    }
    for (int k = 2; k < nvalue; k++)
      PetscCall(SbScanText(s, "value of a member of a group", &value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data set 2420: systems of coordinates. One that is not the global one is refused once a node
   uses it. */
static PetscErrorCode read_systems(SbDeck *d, SbNumbers *local)
{
  SbScan *s = &d->im->scan;
  int64_t label, kind, other;
  PetscReal x;

  PetscFunctionBeginUser;
  SbScanEndOfLine(s); /* part */
  SbScanEndOfLine(s); /* its name */
  while (s->at < s->end && !is_mark(s)) {
    PetscBool global;

    PetscCall(SbScanText(s, "number of a coordinate system", &label));
    PetscCall(SbScanText(s, "kind of a coordinate system", &kind));
    PetscCall(SbScanText(s, "colour of a coordinate system", &other));
    SbScanEndOfLine(s);
    SbScanEndOfLine(s); /* its name */
    global = (PetscBool)!kind;
    for (int i = 0; i < 12; i++) {
      PetscCall(SbScanReal(s, "number of a coordinate system", 0, &x));
      global = (PetscBool)(global && PetscAbsReal(x - (i < 9 && i % 4 == 0)) < 1e-12);
    }
    SbScanEndOfLine(s);
    if (!global)
      PetscCall(SbNumbersAdd(local, label));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Units: a line of their code and name, then the unit of length per m. It is said only: bodies have
   a scale. */
static void read_units(SbDeck *d)
{
  SbScan *s = &d->im->scan;
  char text[41] = "";
  double factor;

  SbScanEndOfLine(s);
  (void)snprintf(text, sizeof(text), "%.*s", (int)PetscMin(40, s->end - s->at), s->at);
  for (char *c = text; *c; c++)
    *c = (char)(*c == 'D' || *c == 'd' ? 'e' : *c);
  factor = strtod(text, NULL);
  if (factor > 0. && isfinite(factor) && PetscAbsReal(factor - 1.) > 1e-12)
    SbImportRemark(d->im, "lengths are in units of %g m, taken as m: give this as scale",
                   1. / factor);
}

/* Reads the data sets; the numbers of `local` are the caller's to free. */
static PetscErrorCode read_sets(SbDeck *d, SbNumbers *local)
{
  static const int64_t refused[] = {71, 780};
  SbImport *im = d->im;
  SbScan *s = &im->scan;
  int nset = 0;

  PetscFunctionBeginUser;
  for (SbScanNext(s); s->at < s->end; SbScanNext(s)) {
    int64_t id;

    while (s->at > s->data && s->at[-1] != '\n')
      s->at--; /* back to the beginning of the line */
    if (!is_mark(s)) {
      SbScanEndOfLine(s); /* text before and between data sets */
      continue;
    }
    nset++;
    SbScanEndOfLine(s);

    // a data set: its number, then its records
    PetscCall(SbScanText(s, "number of a data set", &id));
    SbScanEndOfLine(s);
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(refused); i++)
      if (id == refused[i])
        SB_SCAN_ERROR(s, "data set %lld, of old files, holds elements; write them as data set 2412",
                      (long long)id);
    if (id == 752 || id == 2417)
      PetscCall(SbImportSkip(im, "groups of data set %lld", (long long)id));
    if (id == 2420)
      PetscCall(read_systems(d, local));
    if (id == 2412 && !im->nvert)
      SB_SCAN_ERROR(s, "elements before the nodes");
    if (id == 164)
      read_units(d);
    for (;;) {
      // the data set ends at a delimiter; the end of the file is an error
      while (s->at < s->end && (*s->at == '\n' || *s->at == '\r'))
        s->at++;
      s->token = s->at;
      if (s->at >= s->end)
        SB_SCAN_ENDS(s, "a line of %d", -1);
      if (is_mark(s))
        break;

      // data set 2411 has the coordinates on a line of their own, data set 15 on the same line
      if (id == 2411 || id == 781 || id == 15) {
        int64_t label, other;
        PetscReal *x;

        PetscCall(SbScanText(s, "label of a node", &label));
        PetscCall(SbDeckAddNode(d, label, &x));
        for (int i = 0; i < 3; i++) {
          PetscCall(SbScanText(s, "coordinate system or colour of a node", &other));
          if (!i && SbNumbersFind(local, other) >= 0)
            SB_SCAN_ERROR(s,
                          "node %lld is given in coordinate system %lld, which is not the global "
                          "one; write all nodes in that",
                          (long long)label, (long long)other);
        }
        PetscCall(SbScanPoint(s, "coordinate", label, x));
      }
      if (id == 2412)
        PetscCall(read_element(d));
      if (id == 2429 || id == 2430 || id == 2432)
        PetscCall(read_group(d, 2));
      if (id == 2435 || id == 2452 || id == 2467 || id == 2477)
        PetscCall(read_group(d, 4));
      SbScanEndOfLine(s); /* other data sets are skipped */
    }
    SbScanEndOfLine(s);
  }
  s->token = s->data;
  if (!nset)
    SB_SCAN_ERROR(s, "expected a line of -1; this is no universal file, or it is damaged");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_UNV(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  SbDeck d = {.im = im, .cure = "renumber the nodes", .compare = strcmp, .strict = PETSC_TRUE};
  SbNumbers local = {0};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  ierr = read_sets(&d, &local);
  PetscCall(SbNumbersDestroy(&local));
  PetscCall(ierr);
  if (!im->nvert)
    SB_SCAN_ERROR(s, "there are no nodes (data set 2411 or 15)");
  PetscCall(SbDeckBuild(&d));
  PetscCall(SbImportJoinGroups(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
