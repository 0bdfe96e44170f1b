/*
  import_abaqus.c - reader of Abaqus input files, .inp (Abaqus Analysis User's Guide, "Input syntax
  rules"; also written by CalculiX, PrePoMax, Cubit, meshio and gmsh).

  Lines that begin with * and a word are keywords with parameters between commas; two stars are a
  comment; the lines after a keyword are its data. Read: *NODE, *ELEMENT (C3D4..., S3 and other
  triangles, two-node lines), *NSET, *ELSET (also GENERATE, and sets by name), *SURFACE of elements
  with sides S1 to S4. The parameters ELSET of *ELEMENT and NSET of *NODE define sets too. Sets
  become groups of the same names; undefined elements of a set are ignored. Only one part with one
  untransformed instance is supported.

  Everything is collected first and converted at the end, since sets may refer to later definitions.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "meshio_impl.h"

enum {
  WORD = 128
};

/* A side of an element, or of all elements of a set, in a surface. */
typedef struct {
  PetscInt surface, set; /* index of the surface; set of elements, -1: a single element */
  int64_t element;
  int side; /* side 0 to 3; -1: the element itself, a triangle */
  const char *at;
} Side;

typedef struct {
  SbDeck deck;
  SbScan *scan;
  SbCount nside, nsurface;
  Side *side;
  char (*surface)[SB_GROUP_MAX];
} Abaqus;

/* Goes to the next line that is not a comment; false at the end of the file. */
static PetscBool next_line(SbScan *s)
{
  for (SbScanNext(s); s->at[0] == '*' && s->at[1] == '*'; SbScanNext(s))
    SbScanEndOfLine(s);
  return (PetscBool)(s->at < s->end);
}

/* Goes to the next data line of the keyword; false at the next keyword and at the end of the
   file. */
static PetscBool data_line(Abaqus *a)
{
  SbScanEndOfLine(a->scan);
  return (PetscBool)(next_line(a->scan) && *a->scan->at != '*');
}

/* Next comma-separated value on this line, trimmed; false if there is none. */
static PetscBool next_word(Abaqus *a, char word[WORD])
{
  SbScan *s = a->scan;
  size_t n = 0;

  if (!SbScanMore(s, '\n'))
    return PETSC_FALSE;
  for (; s->at < s->end && *s->at != '\n' && *s->at != ','; s->at++)
    if (n + 1 < WORD && *s->at != '"')
      word[n++] = isprint((unsigned char)*s->at) ? *s->at : ' ';
  s->at += *s->at == ',';
  while (n && word[n - 1] == ' ')
    n--;
  word[n] = 0;
  return PETSC_TRUE;
}

static PetscErrorCode number_of(Abaqus *a, const char *word, const char *what, int64_t *value)
{
  char *end;
  const char *dot = strrchr(word, '.'); /* instance name and label: instance.12 */

  PetscFunctionBeginUser;
  if (dot && !isdigit((unsigned char)word[0]))
    word = dot + 1;
  *value = strtoll(word, &end, 10);
  if (!word[0] || *end || *value < 0 || *value > (int64_t)1 << 60)
    SB_SCAN_ERROR(a->scan, "expected the %s, found '%.24s'", what, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Value of the parameter NAME= on the keyword line that begins at `line`; false if absent. */
static PetscBool parameter(Abaqus *a, const char *line, const char *name, char value[WORD])
{
  SbScan *s = a->scan;
  const char *keep = s->at;
  char word[WORD];
  PetscBool found = PETSC_FALSE;

  s->at = line;
  (void)next_word(a, word);
  while (!found && next_word(a, word)) {
    char *equals = strchr(word, '=');
    char *end;

    if (equals)
      *equals = 0;
    for (end = word + strlen(word); end > word && end[-1] == ' ';)
      *--end = 0;
    found = (PetscBool)!strcasecmp(word, name);
    if (found)
      (void)snprintf(value, WORD, "%s", equals ? equals + 1 + strspn(equals + 1, " ") : "");
  }
  s->at = keep;
  return found;
}

/* Finds or creates the set of this kind and name; an instance name before a dot is ignored. */
static PetscErrorCode find_set(Abaqus *a, PetscBool of_nodes, const char *name, PetscInt *set)
{
  const char *dot = strrchr(name, '.');

  PetscFunctionBeginUser;
  PetscCall(SbDeckFindSet(&a->deck, of_nodes, dot && dot[1] ? dot + 1 : name, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parses a label, or the name of a set; *set is -1 for a label. */
static PetscErrorCode label_of(Abaqus *a, PetscBool of_nodes, const char *word, int64_t *label,
                               PetscInt *set)
{
  const char *dot = strrchr(word, '.');

  PetscFunctionBeginUser;
  *set = -1;
  if (isdigit((unsigned char)word[0]) || (dot && isdigit((unsigned char)dot[1])))
    PetscCall(number_of(a, word, "label of a node or element", label));
  else
    PetscCall(find_set(a, of_nodes, word, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_set(Abaqus *a, const char *line, PetscBool of_nodes)
{
  char name[WORD], word[WORD];
  const PetscBool generated = parameter(a, line, "GENERATE", word);
  PetscInt set, other;
  int64_t label = 0;

  PetscFunctionBeginUser;
  if (!parameter(a, line, of_nodes ? "NSET" : "ELSET", name))
    SB_SCAN_ERROR(a->scan, "a set without a name");
  PetscCall(find_set(a, of_nodes, name, &set));
  while (data_line(a)) {
    int64_t value[3] = {0, 0, 1};

    for (int i = 0; i < 3 && generated && next_word(a, word); i++)
      if (word[0])
        PetscCall(number_of(a, word, "first, last or step of a set", &value[i]));
    if (generated && (value[2] < 1 || value[1] < value[0]))
      SB_SCAN_ERROR(a->scan, "a set from %lld to %lld by %lld; it is empty", (long long)value[0],
                    (long long)value[1], (long long)value[2]);
    if (generated)
      PetscCall(SbDeckAddRange(&a->deck, set, -1, value[0], value[1], value[2]));
    while (!generated && next_word(a, word)) {
      if (!word[0])
        continue;
      PetscCall(label_of(a, of_nodes, word, &label, &other));
      PetscCall(SbDeckAddRange(&a->deck, set, other, label, label, 1));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_nodes(Abaqus *a, const char *line)
{
  char word[WORD];
  PetscInt set = -1;
  int64_t label;
  PetscReal *x;

  PetscFunctionBeginUser;
  if (parameter(a, line, "NSET", word))
    PetscCall(find_set(a, PETSC_TRUE, word, &set));
  while (data_line(a)) {
    (void)next_word(a, word);
    PetscCall(number_of(a, word, "label of a node", &label));
    PetscCall(SbDeckAddNode(&a->deck, label, &x));
    if (set >= 0)
      PetscCall(SbDeckAddRange(&a->deck, set, -1, label, label, 1));
    for (int i = 0; i < 3; i++) {
      char *end = word;

      if (!next_word(a, word))
        continue; /* omitted values are zero */
      x[i] = strtod(word, &end);
      if (*end || !isfinite(x[i]))
        SB_SCAN_ERROR(a->scan, "expected a coordinate of node %lld, found '%.24s'",
                      (long long)label, word);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_elements(Abaqus *a, const char *line)
{
  /* gmsh type of an Abaqus element type, by the prefix of its name, which must not be followed by a
     digit */
  static const struct {
    const char *name;
    int type;
  } types[] = {
    {"C3D4", 4},  {"C3D10", 11}, {"C3D8", 5},    {"C3D20", 17}, {"C3D6", 6},   {"C3D15", 18},
    {"C3D5", 7},  {"DC3D4", 4},  {"DC3D10", 11}, {"DC3D8", 5},  {"AC3D4", 4},  {"S3", 2},
    {"STRI3", 2}, {"S3R", 2},    {"CPS3", 2},    {"CPE3", 2},   {"CPEG3", 2},  {"M3D3", 2},
    {"R3D3", 2},  {"SFM3D3", 2}, {"DS3", 2},     {"DC2D3", 2},  {"STRI65", 9}, {"CPS6", 9},
    {"CPE6", 9},  {"M3D6", 9},   {"SFM3D6", 9},  {"S6", 9},     {"S4", 3},     {"CPS4", 3},
    {"CPE4", 3},  {"M3D4", 3},   {"R3D4", 3},    {"SFM3D4", 3}, {"S8", 16},    {"CPS8", 16},
    {"T3D2", 1},  {"B31", 1},    {"T2D2", 1},    {"B21", 1},    {"T3D3", 8},   {"B32", 8}};

  char name[WORD] = "";
  char word[WORD];
  PetscInt set = -1;
  int type = 0;

  PetscFunctionBeginUser;
  (void)parameter(a, line, "TYPE", name);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types) && !type; i++) {
    const size_t n = strlen(types[i].name);

    if (!strncasecmp(name, types[i].name, n) && !isdigit((unsigned char)name[n]))
      type = types[i].type;
  }
  a->scan->token = line;
  if (!type)
    SB_SCAN_ERROR(
      a->scan,
      "elements of type '%.24s'; supple knows C3D4 tetrahedra, with S3, CPS3, M3D3, ... "
      "triangles and two-node lines for sets",
      name);
  if (parameter(a, line, "ELSET", word))
    PetscCall(find_set(a, PETSC_FALSE, word, &set));
  while (data_line(a)) {
    SbDeckElement e = {.type = type, .property = -1, .at = a->scan->token};
    const int nnode = SbGmshTypes[type].nnode;

    // one element, continued on further lines until it has all nodes
    (void)next_word(a, word);
    PetscCall(number_of(a, word, "label of an element", &e.label));
    for (int k = 0; k < nnode; k++) {
      int64_t node;

      if (!next_word(a, word) && !(data_line(a) && next_word(a, word)))
        SB_SCAN_ERROR(a->scan, "element %lld ends after %d of %d nodes", (long long)e.label, k,
                      nnode);
      PetscCall(number_of(a, word, "node of an element", &node));
      if (k < 10)
        e.node[k] = node;
    }
    PetscCall(SbDeckAddElement(&a->deck, &e));
    if (set >= 0)
      PetscCall(SbDeckAddRange(&a->deck, set, -1, e.label, e.label, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_surface(Abaqus *a, const char *line)
{
  char name[WORD], kind[WORD], word[WORD];

  PetscFunctionBeginUser;
  if (!parameter(a, line, "NAME", name))
    SB_SCAN_ERROR(a->scan, "a surface without a name");
  if (parameter(a, line, "TYPE", kind) && strcasecmp(kind, "ELEMENT")) {
    SbScanEndOfLine(a->scan);
    PetscFunctionReturn(PETSC_SUCCESS); /* node-based or analytical surfaces have no facets */
  }
  PetscCall(SbImportGrow(a->deck.im, &a->nsurface, sizeof(*a->surface), &a->surface));
  (void)snprintf(a->surface[a->nsurface.n - 1], SB_GROUP_MAX, "%s", name);
  while (data_line(a)) {
    char side[WORD] = "";
    Side *one;

    (void)next_word(a, word);
    PetscCall(SbImportGrow(a->deck.im, &a->nside, sizeof(*one), &a->side));
    one = &a->side[a->nside.n - 1];
    *one = (Side){.surface = a->nsurface.n - 1, .side = -1, .at = a->scan->token};
    PetscCall(label_of(a, PETSC_FALSE, word, &one->element, &one->set));
    (void)next_word(a, side);
    if ((side[0] == 'S' || side[0] == 's') && side[1] >= '1' && side[1] <= '4' && !side[2])
      one->side = side[1] - '1';
    else if (strcasecmp(side, "SPOS") && strcasecmp(side, "SNEG"))
      SB_SCAN_ERROR(a->scan, "side '%.24s' of a surface; expected S1 to S4, or SPOS, SNEG", side);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds one side of an element as a triangle of the surface's group. */
static PetscErrorCode use_side(Abaqus *a, const Side *side, const SbDeckElement *e)
{
  static const int corners[4][3] = {
    {0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}; /* sides S1 to S4 */
  const int64_t tag = SB_DECK_TAG + a->deck.nset.n + side->surface;
  SbImport *im = a->deck.im;
  PetscInt group, tags, vert[3];

  PetscFunctionBeginUser;
  PetscCall(SbImportGroup(im, 2, tag, a->surface[side->surface], &group));
  if (side->side < 0) {
    if (SbGmshTypes[e->type].dim == 2 && e->item >= 0)
      PetscCall(SbImportAddMember(im, 2, e->item, group));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (e->type != SB_GMSH_TET && e->type != SB_GMSH_TET10)
    SB_SCAN_ERROR(a->scan, "surface '%s' has side S%d of element %lld, which is no tetrahedron",
                  a->surface[side->surface], side->side + 1, (long long)e->label);
  for (int k = 0; k < 3; k++)
    vert[k] = im->item[3].vert[4 * e->item + corners[side->side][k]];
  PetscCall(SbImportTagsAlone(im, 2, tag, NULL, &tags));
  PetscCall(SbImportAddItem(im, 2, vert, tags, e->label));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Abaqus(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  Abaqus a = {
    .scan = s,
    .deck = {
      .im = im, .compare = strcasecmp, .cure = "supple reads one part", .unique = PETSC_TRUE}};
  char word[WORD], rotate[SB_IMPORT_OPTION_MAX], translate[SB_IMPORT_OPTION_MAX];
  PetscBool in_instance = PETSC_FALSE;
  int npart = 0;
  SbDeck *d = &a.deck;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  while (next_line(s)) {
    const char *line = s->at;

    // data lines of ignored keywords; after *INSTANCE they are a transformation
    if (*line != '*') {
      if (in_instance)
        SB_SCAN_ERROR(
          s, "the instance is moved or turned; take these lines out and move the body by %s and %s",
          SbImportOption(im, "rotate", rotate), SbImportOption(im, "translate", translate));
      SbScanEndOfLine(s);
      continue;
    }

    // keywords that define the mesh
    (void)next_word(&a, word);
    if (!strcasecmp(word, "*NODE"))
      PetscCall(read_nodes(&a, line));
    else if (!strcasecmp(word, "*ELEMENT"))
      PetscCall(read_elements(&a, line));
    else if (!strcasecmp(word, "*NSET") || !strcasecmp(word, "*ELSET"))
      PetscCall(read_set(&a, line, (PetscBool)!strcasecmp(word, "*NSET")));
    else if (!strcasecmp(word, "*SURFACE"))
      PetscCall(read_surface(&a, line));
    else {
      // errors: mesh data in another file or in a second part
      s->token = line;
      if (!strcasecmp(word, "*INCLUDE"))
        SB_SCAN_ERROR(s, "*INCLUDE: another file holds a part of the mesh; write it in one file");
      if (!strcasecmp(word, "*PART") && ++npart > 1)
        SB_SCAN_ERROR(s, "a second *PART; supple reads one part: give each body a file of its own");
      in_instance = (PetscBool)!strcasecmp(word, "*INSTANCE");
      SbScanEndOfLine(s);
    }
  }

  // find the nodes of elements and sets
  s->token = s->end;
  if (!im->nvert)
    SB_SCAN_ERROR(s, "there is no *NODE in it; this is no input file of Abaqus");
  PetscCall(SbDeckBuild(&a.deck));

  // convert element sides to triangles
  for (PetscInt k = 0; k < a.nside.n; k++) {
    const Side *side = &a.side[k];
    const PetscInt e = SbNumbersFind(&im->elements, side->element);
    const PetscBool one = (PetscBool)(side->set < 0);

    if (!one)
      PetscCall(SbDeckFind(d, side->set));
    s->token = side->at;
    if (one && e < 0)
      SB_SCAN_ERROR(s, "surface '%s' has a side of element %lld, which is not there",
                    a.surface[side->surface], (long long)side->element);
    for (PetscInt i = 0; i < (one ? 1 : d->nfound.n); i++)
      PetscCall(use_side(&a, side, &d->element[one ? e : d->found[i]]));
  }
  PetscCall(SbImportJoinGroups(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
