/*
  import_abaqus.c - reader of Abaqus input files, .inp (Abaqus Analysis User's Guide, "Input syntax rules"; also what CalculiX,
  PrePoMax, Cubit, meshio and gmsh write).

  Lines that begin with * and a word are keywords with parameters between commas; two stars are a comment; the lines after a
  keyword are its data. Read: *NODE, *ELEMENT (C3D4..., S3 and other triangles, two-node lines), *NSET, *ELSET (also GENERATE,
  and sets by name), *SURFACE of elements with sides S1 to S4. The parameters ELSET of *ELEMENT and NSET of *NODE make sets too. Names of sets
  are those of groups; an element of a set that the file does not define is left out. One part, with one instance that is not moved.

  Everything is collected first and put together at the end, since sets may name what comes later.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "gmsh_types.h"

enum { WORD = 128 };
enum { KIND_NODE, KIND_ELEMENT };

typedef struct {
  char name[SB_GROUP_MAX];
  int kind;
  PetscInt n, capacity;
  int64_t *label; /* [n] of nodes or elements; -1 - s: the members of set s */
} Set;

typedef struct {
  int64_t label, node[4];
  int type;
  const char *at; /* for messages */
} Element;

/* A side of a surface: of an element, or of all those of a set. */
typedef struct {
  PetscInt surface;
  int64_t element; /* as Set.label */
  int side;        /* 0 ... 3; -1: the element itself, a triangle */
  const char *at;
} Side;

typedef struct {
  SbScan scan;
  SbImport *im;
  const char *line_end; /* of the line being taken apart */
  SbCount nnode, nelement, nset, nside, nsurface;
  int64_t *node; /* [nnode] labels */
  PetscReal *x;  /* [nnode][3] */
  Element *element;
  Set *set;
  Side *side;
  char (*surface)[SB_GROUP_MAX];
  SbNumbers nodes, elements;
  SbGroupMember *item; /* [nelement] where it is; dim -1: nowhere */
  SbGroupMembership members;
  PetscInt *stack; /* [nset] of sets to look into */
  int64_t count[SB_GMSH_NTYPES];
  int npart;
  int64_t nmember; /* of all sets, as far as they are taken apart */
  PetscBool in_instance;
} Abaqus;

/* ------------------------------------------------------------------ lines and words */

/* The next line that is no comment; false at the end of the file. */
static PetscBool next_line(Abaqus *a)
{
  SbScan *s = &a->scan;

  while (s->at < s->end) {
    const char *end = (const char *)memchr(s->at, '\n', (size_t)(s->end - s->at));

    a->line_end = end ? end : s->end;
    while (s->at < a->line_end && isspace((unsigned char)*s->at)) s->at++;
    s->token = s->at;
    if (s->at < a->line_end && !(s->at[0] == '*' && s->at[1] == '*')) return PETSC_TRUE;
    s->at = end ? end + 1 : s->end;
  }
  return PETSC_FALSE;
}

static void leave_line(Abaqus *a)
{
  a->scan.at = a->line_end < a->scan.end ? a->line_end + 1 : a->scan.end;
}

/* The next value on this line, between commas, without blanks around it; false when there is none. */
static PetscBool next_word(Abaqus *a, char word[WORD])
{
  SbScan *s = &a->scan;
  size_t n = 0;

  while (s->at < a->line_end && isspace((unsigned char)*s->at)) s->at++;
  s->token = s->at;
  if (s->at >= a->line_end) return PETSC_FALSE;
  for (; s->at < a->line_end && *s->at != ','; s->at++) {
    if (n + 1 < WORD && *s->at != '"') word[n++] = isprint((unsigned char)*s->at) ? *s->at : ' ';
  }
  if (s->at < a->line_end) s->at++;
  while (n && word[n - 1] == ' ') n--;
  word[n] = 0;
  return PETSC_TRUE;
}

static PetscErrorCode number_of(Abaqus *a, const char *word, const char *what, int64_t *value)
{
  char *end;
  const char *dot = strrchr(word, '.'); /* instance.12 */

  PetscFunctionBeginUser;
  if (dot && !isdigit((unsigned char)word[0])) word = dot + 1;
  *value = strtoll(word, &end, 10);
  if (!word[0] || *end || *value < 0 || *value > (int64_t)1 << 60)
    SB_SCAN_ERROR(&a->scan, "expected the %s, found '%.24s'", what, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Value of parameter NAME= of the keyword line that begins at `line`; false when it is not there. */
static PetscBool parameter(Abaqus *a, const char *line, const char *name, char value[WORD])
{
  SbScan *s = &a->scan;
  const char *keep = s->at;
  char word[WORD];
  PetscBool found = PETSC_FALSE;

  s->at = line;
  (void)next_word(a, word);
  while (!found && next_word(a, word)) {
    char *equals = strchr(word, '='), *end;

    if (equals) *equals = 0;
    for (end = word + strlen(word); end > word && end[-1] == ' ';) *--end = 0;
    if (strcasecmp(word, name)) continue;
    found = PETSC_TRUE;
    (void)snprintf(value, WORD, "%s", equals ? equals + 1 + strspn(equals + 1, " ") : "");
  }
  s->at = keep;
  return found;
}

/* ------------------------------------------------------------------ sets */

/* The set of this kind and name, made when new; what stands before a dot names an instance. */
static PetscErrorCode find_set(Abaqus *a, int kind, const char *name, PetscInt *set)
{
  const char *dot = strrchr(name, '.');

  PetscFunctionBeginUser;
  if (dot && dot[1]) name = dot + 1;
  for (*set = 0; *set < a->nset.n; (*set)++) {
    if (a->set[*set].kind == kind && !strcasecmp(a->set[*set].name, name)) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbImportGrow(&a->nset, sizeof(*a->set), &a->set));
  PetscCall(PetscMemzero(&a->set[*set], sizeof(*a->set)));
  (void)snprintf(a->set[*set].name, SB_GROUP_MAX, "%s", name);
  a->set[*set].kind = kind;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_label(Set *set, int64_t label)
{
  PetscFunctionBeginUser;
  if (set->n == set->capacity) {
    set->capacity = PetscMax(16, 2 * set->capacity);
    PetscCall(PetscRealloc((size_t)set->capacity * sizeof(*set->label), &set->label));
  }
  set->label[set->n++] = label;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A label, or the name of a set as -1 - set. */
static PetscErrorCode label_of(Abaqus *a, int kind, const char *word, int64_t *label)
{
  const char *dot = strrchr(word, '.');
  PetscInt set;

  PetscFunctionBeginUser;
  if (isdigit((unsigned char)word[0]) || (dot && isdigit((unsigned char)dot[1]))) {
    PetscCall(number_of(a, word, "label of a node or element", label));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(find_set(a, kind, word, &set));
  *label = -1 - (int64_t)set;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets that count up or name each other can tell of far more members than a file of this size has use for. */
static PetscErrorCode count_members(Abaqus *a, int64_t n)
{
  PetscFunctionBeginUser;
  a->nmember += n;
  if (a->nmember > 64 * (int64_t)(a->scan.end - a->scan.data))
    SB_SCAN_ERROR(
      &a->scan, "the sets have more than %lld members, more than a file of this size can mean; it is damaged",
      (long long)a->nmember - n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_set(Abaqus *a, const char *line, int kind)
{
  char name[WORD], word[WORD];
  const PetscBool generated = parameter(a, line, "GENERATE", word);
  PetscInt set;
  int64_t label;

  PetscFunctionBeginUser;
  if (!parameter(a, line, kind == KIND_NODE ? "NSET" : "ELSET", name))
    SB_SCAN_ERROR(&a->scan, "a set without a name");
  PetscCall(find_set(a, kind, name, &set));
  for (leave_line(a); next_line(a) && *a->scan.at != '*'; leave_line(a)) {
    if (generated) {
      int64_t value[3] = {0, 0, 1};
      char number[WORD];

      for (int i = 0; i < 3 && next_word(a, number); i++)
        if (number[0]) PetscCall(number_of(a, number, "first, last or step of a set", &value[i]));
      if (value[2] < 1 || value[1] < value[0])
        SB_SCAN_ERROR(&a->scan, "a set from %lld to %lld by %lld; it is empty", (long long)value[0],
                      (long long)value[1], (long long)value[2]);
      PetscCall(count_members(a, (value[1] - value[0]) / value[2] + 1));
      for (label = value[0]; label <= value[1]; label += value[2]) PetscCall(add_label(&a->set[set], label));
    } else
      while (next_word(a, word)) {
        if (!word[0]) continue;
        PetscCall(label_of(a, kind, word, &label));
        PetscCall(add_label(&a->set[set], label));
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ nodes and elements */

static PetscErrorCode read_nodes(Abaqus *a, const char *line)
{
  char word[WORD];
  PetscInt set = -1;

  PetscFunctionBeginUser;
  if (parameter(a, line, "NSET", word)) PetscCall(find_set(a, KIND_NODE, word, &set));
  for (leave_line(a); next_line(a) && *a->scan.at != '*'; leave_line(a)) {
    const PetscInt v = a->nnode.n;
    PetscInt capacity = a->nnode.capacity;

    PetscCall(SbImportGrow(&a->nnode, sizeof(*a->node), &a->node));
    if (capacity != a->nnode.capacity)
      PetscCall(PetscRealloc(3 * (size_t)a->nnode.capacity * sizeof(*a->x), &a->x));
    (void)next_word(a, word);
    PetscCall(number_of(a, word, "label of a node", &a->node[v]));
    if (set >= 0) PetscCall(add_label(&a->set[set], a->node[v]));
    for (int i = 0; i < 3; i++) {
      char *end = word;

      a->x[3 * v + i] = 0;
      if (!next_word(a, word)) continue; /* what is left out is zero */
      a->x[3 * v + i] = strtod(word, &end);
      if (*end || !isfinite(a->x[3 * v + i]))
        SB_SCAN_ERROR(&a->scan, "expected a coordinate of node %lld, found '%.24s'", (long long)a->node[v],
                      word);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What gmsh calls an element of Abaqus: by the beginning of its name, and what follows is no digit. */
static int type_of(const char *name)
{
  static const struct {
    const char *name;
    int type;
  } types[] = {{"C3D4", 4},  {"C3D10", 11}, {"C3D8", 5},    {"C3D20", 17}, {"C3D6", 6},   {"C3D15", 18},
               {"C3D5", 7},  {"DC3D4", 4},  {"DC3D10", 11}, {"DC3D8", 5},  {"AC3D4", 4},  {"S3", 2},
               {"STRI3", 2}, {"S3R", 2},    {"CPS3", 2},    {"CPE3", 2},   {"CPEG3", 2},  {"M3D3", 2},
               {"R3D3", 2},  {"SFM3D3", 2}, {"DS3", 2},     {"DC2D3", 2},  {"STRI65", 9}, {"CPS6", 9},
               {"CPE6", 9},  {"M3D6", 9},   {"SFM3D6", 9},  {"S6", 9},     {"S4", 3},     {"CPS4", 3},
               {"CPE4", 3},  {"M3D4", 3},   {"R3D4", 3},    {"SFM3D4", 3}, {"S8", 16},    {"CPS8", 16},
               {"T3D2", 1},  {"B31", 1},    {"T2D2", 1},    {"B21", 1},    {"T3D3", 8},   {"B32", 8}};

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types); i++) {
    const size_t n = strlen(types[i].name);

    if (!strncasecmp(name, types[i].name, n) && !isdigit((unsigned char)name[n])) return types[i].type;
  }
  return 0;
}

/* One element, on as many lines as its nodes need. */
static PetscErrorCode read_element(Abaqus *a, int type, Element *e)
{
  char word[WORD];

  PetscFunctionBeginUser;
  *e = (Element){0, {0, 0, 0, 0}, type, a->scan.token};
  (void)next_word(a, word);
  PetscCall(number_of(a, word, "label of an element", &e->label));
  for (int k = 0; k < SbGmshTypes[type].nnode; k++) {
    int64_t node;

    if (!next_word(a, word)) {
      leave_line(a);
      if (!next_line(a) || *a->scan.at == '*' || !next_word(a, word))
        SB_SCAN_ERROR(&a->scan, "element %lld ends after %d of %d nodes", (long long)e->label, k,
                      SbGmshTypes[type].nnode);
    }
    PetscCall(number_of(a, word, "node of an element", &node));
    if (k < 4) e->node[k] = node;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_elements(Abaqus *a, const char *line)
{
  char name[WORD] = "", word[WORD];
  PetscInt set = -1;
  int type;

  PetscFunctionBeginUser;
  (void)parameter(a, line, "TYPE", name);
  type = type_of(name);
  a->scan.token = line;
  if (!type)
    SB_SCAN_ERROR(&a->scan,
                  "elements of type '%.24s'; supple knows C3D4 tetrahedra, with S3, CPS3, M3D3, ... "
                  "triangles and two-node lines for sets",
                  name);
  if (parameter(a, line, "ELSET", word)) PetscCall(find_set(a, KIND_ELEMENT, word, &set));
  for (leave_line(a); next_line(a) && *a->scan.at != '*'; leave_line(a)) {
    PetscCall(SbImportGrow(&a->nelement, sizeof(*a->element), &a->element));
    PetscCall(read_element(a, type, &a->element[a->nelement.n - 1]));
    a->count[type]++;
    if (set >= 0) PetscCall(add_label(&a->set[set], a->element[a->nelement.n - 1].label));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ surfaces */

static PetscErrorCode read_side(Abaqus *a, PetscInt surface)
{
  char word[WORD], side[WORD] = "";
  Side *one;

  PetscFunctionBeginUser;
  (void)next_word(a, word);
  PetscCall(SbImportGrow(&a->nside, sizeof(*a->side), &a->side));
  one = &a->side[a->nside.n - 1];
  *one = (Side){surface, 0, -1, a->scan.token};
  PetscCall(label_of(a, KIND_ELEMENT, word, &one->element));
  (void)next_word(a, side);
  if ((side[0] == 'S' || side[0] == 's') && side[1] >= '1' && side[1] <= '4' && !side[2])
    one->side = side[1] - '1';
  else if (strcasecmp(side, "SPOS") && strcasecmp(side, "SNEG"))
    SB_SCAN_ERROR(&a->scan, "side '%.24s' of a surface; expected S1 to S4, or SPOS, SNEG", side);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_surface(Abaqus *a, const char *line)
{
  char name[WORD], kind[WORD];

  PetscFunctionBeginUser;
  if (!parameter(a, line, "NAME", name)) SB_SCAN_ERROR(&a->scan, "a surface without a name");
  if (parameter(a, line, "TYPE", kind) && strcasecmp(kind, "ELEMENT")) {
    leave_line(a); /* of nodes, or analytical: nothing of the mesh */
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbImportGrow(&a->nsurface, sizeof(*a->surface), &a->surface));
  (void)snprintf(a->surface[a->nsurface.n - 1], SB_GROUP_MAX, "%s", name);
  for (leave_line(a); next_line(a) && *a->scan.at != '*'; leave_line(a))
    PetscCall(read_side(a, a->nsurface.n - 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ put together */

static PetscErrorCode build_items(Abaqus *a)
{
  int64_t *label;

  PetscFunctionBeginUser;
  PetscCall(SbImportSetVertices(a->im, a->nnode.n));
  PetscCall(PetscArraycpy(a->im->x, a->x, 3 * (size_t)a->nnode.n));
  PetscCall(PetscArraycpy(a->im->vert_number, a->node, a->nnode.n));
  PetscCall(SbNumbersCreate(a->nnode.n, a->node, &a->nodes));
  if (a->nodes.repeated)
    SB_SCAN_ERROR(&a->scan, "node %lld is given twice; supple reads one part", (long long)a->nodes.twice);
  PetscCall(PetscMalloc1(a->nelement.n, &label));
  for (PetscInt e = 0; e < a->nelement.n; e++) label[e] = a->element[e].label;
  PetscCall(SbNumbersCreate(a->nelement.n, label, &a->elements));
  PetscCall(PetscFree(label));
  if (a->elements.repeated)
    SB_SCAN_ERROR(&a->scan, "element %lld is given twice; supple reads one part",
                  (long long)a->elements.twice);
  PetscCall(PetscMalloc1(a->nelement.n, &a->item));
  for (PetscInt e = 0; e < a->nelement.n; e++) {
    const Element *el = &a->element[e];
    const int dim = SbGmshTypes[el->type].dim;
    PetscInt vert[4] = {0, 0, 0, 0};

    a->item[e] = (SbGroupMember){-1, 0, 0};
    if (el->type != SB_GMSH_TET && el->type != SB_GMSH_TRIANGLE && el->type != SB_GMSH_LINE) continue;
    a->scan.token = el->at;
    for (int k = 0; k <= dim; k++) {
      vert[k] = SbNumbersFind(&a->nodes, el->node[k]);
      if (vert[k] < 0)
        SB_SCAN_ERROR(&a->scan, "element %lld uses node %lld, which is not there", (long long)el->label,
                      (long long)el->node[k]);
    }
    a->item[e] = (SbGroupMember){dim, a->im->item[dim].n, 0};
    PetscCall(SbImportAddItem(a->im, dim, vert, 0, el->label));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Members of a set that names other sets: each of these once, whatever circles they form. */
static PetscErrorCode gather(Abaqus *a, PetscInt s, PetscBool seen[], Set *all)
{
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(seen, a->nset.n));
  all->n = 0;
  seen[s] = PETSC_TRUE;
  a->stack[n++] = s;
  while (n) {
    const Set *set = &a->set[a->stack[--n]];

    PetscCall(count_members(a, set->n));
    for (PetscInt i = 0; i < set->n; i++) {
      const int64_t other = -1 - set->label[i];

      if (set->label[i] >= 0)
        PetscCall(add_label(all, set->label[i]));
      else if (!seen[other]) {
        seen[other] = PETSC_TRUE;
        a->stack[n++] = (PetscInt)other;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The members of one set become items, or members of a group. */
static PetscErrorCode use_set(Abaqus *a, PetscInt s, const Set *all)
{
  const char *name = a->set[s].name;
  PetscInt at, tags, group;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < all->n; i++) {
    if (a->set[s].kind == KIND_NODE) {
      at = SbNumbersFind(&a->nodes, all->label[i]);
      if (at < 0) continue;
      PetscCall(SbImportTagsAlone(a->im, 0, s + 1, name, &tags));
      PetscCall(SbImportAddItem(a->im, 0, &at, tags, all->label[i]));
    } else {
      at = SbNumbersFind(&a->elements, all->label[i]);
      if (at < 0 || a->item[at].dim < 0) continue;
      PetscCall(SbImportGroup(a->im, a->item[at].dim, s + 1, name, &group));
      PetscCall(SbGroupMembershipAdd(&a->members, a->item[at].dim, a->item[at].item, group));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One side of one element: a triangle of the surface's group. */
static PetscErrorCode use_side(Abaqus *a, const Side *side, int64_t label)
{
  static const int corners[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}; /* S1 to S4 */
  const PetscInt e = SbNumbersFind(&a->elements, label);
  PetscInt group, tags, vert[3];
  const int64_t tag = (int64_t)a->nset.n + 1 + side->surface;

  PetscFunctionBeginUser;
  a->scan.token = side->at;
  if (e < 0)
    SB_SCAN_ERROR(&a->scan, "surface '%s' has a side of element %lld, which is not there",
                  a->surface[side->surface], (long long)label);
  PetscCall(SbImportGroup(a->im, 2, tag, a->surface[side->surface], &group));
  if (side->side < 0) {
    if (a->item[e].dim == 2) PetscCall(SbGroupMembershipAdd(&a->members, 2, a->item[e].item, group));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (a->item[e].dim != 3)
    SB_SCAN_ERROR(&a->scan, "surface '%s' has side S%d of element %lld, which is no tetrahedron",
                  a->surface[side->surface], side->side + 1, (long long)label);
  for (int k = 0; k < 3; k++) vert[k] = a->im->item[3].vert[4 * a->item[e].item + corners[side->side][k]];
  PetscCall(SbImportTagsAlone(a->im, 2, tag, NULL, &tags));
  PetscCall(SbImportAddItem(a->im, 2, vert, tags, label));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode use_sets(Abaqus *a)
{
  PetscBool *seen;
  Set all;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&all, sizeof(all)));
  PetscCall(PetscMalloc1(a->nset.n, &seen));
  ierr = PetscMalloc1(a->nset.n, &a->stack);
  for (PetscInt s = 0; s < a->nset.n && !ierr; s++) {
    ierr = gather(a, s, seen, &all);
    if (!ierr) ierr = use_set(a, s, &all);
  }
  for (PetscInt i = 0; i < a->nside.n && !ierr; i++) {
    const int64_t element = a->side[i].element;

    all.n = 0;
    ierr = element >= 0 ? add_label(&all, element) : gather(a, (PetscInt)(-1 - element), seen, &all);
    for (PetscInt k = 0; k < all.n && !ierr; k++) ierr = use_side(a, &a->side[i], all.label[k]);
  }
  PetscCall(PetscFree(all.label));
  PetscCall(PetscFree(seen));
  PetscCall(ierr);
  PetscCall(SbGroupMembershipApply(&a->members, a->im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the file */

static PetscErrorCode read_keyword(Abaqus *a)
{
  SbScan *s = &a->scan;
  const char *line = s->at;
  char word[WORD];

  PetscFunctionBeginUser;
  (void)next_word(a, word);
  if (!strcasecmp(word, "*NODE")) return read_nodes(a, line);
  if (!strcasecmp(word, "*ELEMENT")) return read_elements(a, line);
  if (!strcasecmp(word, "*NSET")) return read_set(a, line, KIND_NODE);
  if (!strcasecmp(word, "*ELSET")) return read_set(a, line, KIND_ELEMENT);
  if (!strcasecmp(word, "*SURFACE")) return read_surface(a, line);
  s->token = line;
  if (!strcasecmp(word, "*INCLUDE"))
    SB_SCAN_ERROR(s, "*INCLUDE: another file holds a part of the mesh; write it in one file");
  if (!strcasecmp(word, "*PART") && ++a->npart > 1)
    SB_SCAN_ERROR(s, "a second *PART; supple reads one part: give each body a file of its own");
  a->in_instance = (PetscBool)!strcasecmp(word, "*INSTANCE");
  leave_line(a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_file(const char *path, Abaqus *a)
{
  SbScan *s = &a->scan;
  char rotate[SB_OPTION_NAME_MAX], translate[SB_OPTION_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(a->im->where, path, s));
  while (next_line(a)) {
    if (*s->at == '*') {
      PetscCall(read_keyword(a));
      continue;
    }
    if (a->in_instance)
      SB_SCAN_ERROR(s, "the instance is moved or turned; take these lines out and move the body by %s and %s",
                    SbImportOption(a->im, "rotate", rotate), SbImportOption(a->im, "translate", translate));
    leave_line(a);
  }
  s->token = s->end;
  if (!a->nnode.n) SB_SCAN_ERROR(s, "there is no *NODE in it; this is no input file of Abaqus");
  PetscCall(SbGmshCheckTypes(a->im, a->count));
  PetscCall(build_items(a));
  PetscCall(use_sets(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Abaqus(const char *path, SbImport *im)
{
  Abaqus a;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&a, sizeof(a)));
  a.im = im;
  ierr = read_file(path, &a);
  PetscCall(SbNumbersDestroy(&a.nodes));
  PetscCall(SbNumbersDestroy(&a.elements));
  PetscCall(SbGroupMembershipDestroy(&a.members));
  for (PetscInt s = 0; s < a.nset.n; s++) PetscCall(PetscFree(a.set[s].label));
  PetscCall(PetscFree(a.node));
  PetscCall(PetscFree(a.x));
  PetscCall(PetscFree(a.element));
  PetscCall(PetscFree(a.set));
  PetscCall(PetscFree(a.side));
  PetscCall(PetscFree(a.surface));
  PetscCall(PetscFree(a.item));
  PetscCall(PetscFree(a.stack));
  PetscCall(SbScanClose(&a.scan));
  PetscFunctionReturn(ierr);
}
