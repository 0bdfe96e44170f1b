/*
  import_nastran.c - reader of Nastran bulk data, .bdf and .nas (MSC Nastran Quick Reference Guide,
  "Bulk Data Entries"; also written by NX, HyperMesh, ANSA, Femap, Patran, gmsh, meshio and
  pyNastran).

  An entry has ten fields per line, first its name. Fields have 8 columns, 16 if the name ends with
  a star, or commas between them; a line whose first field is empty or begins with + or * continues
  the entry. Tabs advance to the next multiple of 8 columns. Reals may omit the letter of the
  exponent (1.5-3).

  Read: GRID, solid, shell and line elements with their property, SPC, SPC1 and SET1 as sets of
  nodes. Property N is the group volume_N, surface_N or curve_N, or has its name from a comment
  (ANSA, HyperMesh, Femap, Patran). Lines before BEGIN BULK and after ENDDATA, and other entries,
  are skipped. Errors: points in a local coordinate system, INCLUDE.

  Elements may precede their points: everything is collected first and converted at the end.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "meshio_impl.h"

enum {
  LINE = 256,
  WORD = 64
};

typedef struct {
  int64_t number;
  char name[SB_GROUP_MAX];
} Name;

typedef struct {
  char word[WORD];
  const char *at; /* its line, for messages */
} Field;

typedef struct {
  SbDeck deck;
  SbScan *scan;
  SbCount nfield, nname;
  Field *field;               /* [nfield] of the current entry; field 0 is its name */
  PetscInt next;              /* field to be read */
  Name *name;                 /* [nname] names of properties */
  char pending[SB_GROUP_MAX]; /* name that a Patran comment gives to the next property */
} Nastran;

/* Copies the text from `p` to a delimiter or the end, trimmed; blanks in it become underscores. */
static void copy_name(const char *p, const char *end, char delimiter, char name[SB_GROUP_MAX])
{
  size_t n = 0;

  while (p < end && isspace((unsigned char)*p))
    p++;
  for (; p < end && *p != delimiter && n + 1 < SB_GROUP_MAX; p++)
    name[n++] = isgraph((unsigned char)*p) ? *p : '_';
  while (n && name[n - 1] == '_')
    n--;
  name[n] = 0;
}

static PetscErrorCode add_name(Nastran *b, int64_t number, const char *name)
{
  PetscFunctionBeginUser;
  if (!name[0] || number <= 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbImportGrow(b->deck.im, &b->nname, sizeof(*b->name), &b->name));
  b->name[b->nname.n - 1].number = number;
  PetscCall(PetscStrncpy(b->name[b->nname.n - 1].name, name, SB_GROUP_MAX));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the name of a property: $ANSA_NAME_COMMENT;12;PSOLID;liver;   $HMNAME PROP 12"liver"
   $ Femap Property 12 : liver   $ ... Properties for region : liver */
static PetscErrorCode read_comment(Nastran *b, const char *text, const char *end)
{
  char line[LINE];
  char name[SB_GROUP_MAX] = "";
  char *p = line;
  const size_t n = PetscMin((size_t)(end - text), sizeof(line) - 1);
  int64_t number = 0;

  PetscFunctionBeginUser;
  memcpy(line, text, n);
  line[n] = 0;
  if (!strncmp(line, "$ANSA_NAME_COMMENT;", 19)) {
    number = strtoll(line + 19, &p, 10);
    p = *p == ';' && p[1] == 'P' ? strchr(p + 1, ';')
                                 : NULL; /* properties only, not materials or sets */
    if (p)
      copy_name(p + 1, line + n, ';', name);
  } else if (!strncmp(line, "$HMNAME PROP", 12)) {
    number = strtoll(line + 12, &p, 10);
    if (*p == '"')
      copy_name(p + 1, line + n, '"', name);
  } else if (!strncmp(line, "$ Femap", 7) && (p = strstr(line, " Property ")) != NULL) {
    number = strtoll(p + 10, &p, 10);
    p += strspn(p, " ");
    if (*p == ':')
      copy_name(p + 1, line + n, 0, name);
  } else if ((p = strstr(line, "Properties for region :")) != NULL) {
    copy_name(p + 23, line + n, 0, b->pending);
  }
  PetscCall(add_name(b, number, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the field at p, up to a comma or `width` columns, without blanks around it; returns the
   next one. */
static const char *take_field(const char *p, size_t width, char word[WORD])
{
  const char *next = p;
  const char *end;

  while ((size_t)(next - p) < width && *next && *next != ',')
    next++;
  for (end = next; p < end && *p == ' '; p++)
    continue;
  while (end > p && end[-1] == ' ')
    end--;
  width = PetscMin((size_t)(end - p), WORD - 1);
  memcpy(word, p, width);
  word[width] = 0;
  return next + (*next == ',');
}

/* Reads the fields of the next entry, which has none at the end of the file. */
static PetscErrorCode next_entry(Nastran *b)
{
  SbScan *s = b->scan;
  const char *after = s->at; /* end of the lines of this entry */

  PetscFunctionBeginUser;
  b->nfield.n = 0;
  b->next = 1;

  /* most often another entry begins on the next line with its name, in the first column */
  while (s->at < s->end && !(b->nfield.n && isalpha((unsigned char)*s->at))) {
    const char *end = (const char *)memchr(s->at, '\n', (size_t)(s->end - s->at));
    const char *from, *p;
    char text[LINE], word[WORD];
    size_t n, width;
    int per_line;

    s->token = s->at;
    if (!end)
      end = s->end;
    if (*s->at == '$' && !b->nfield.n)
      PetscCall(read_comment(b, s->at, end));

    // text without the comment; tabs become blanks up to the next multiple of 8 columns
    for (n = 0, from = s->at; from < end && *from != '$' && n + 1 < LINE; from++)
      do
        text[n++] = isprint((unsigned char)*from) ? *from : ' ';
      while (*from == '\t' && n % 8 && n + 1 < LINE);
    text[n] = 0;
    s->at = end < s->end ? end + 1 : s->end;
    if (!text[strspn(text, " ")])
      continue;

    // the name, which is empty or begins with + or * where the entry goes on
    width = strchr(text, ',') ? LINE : 8;
    p = take_field(text, width, word);
    if (b->nfield.n && word[0] && word[0] != '+' && word[0] != '*')
      break;
    for (const char *c = after, *line; b->nfield.n && c < s->token;
         c = line + 1) { /* comments within it */
      line = (const char *)memchr(c, '\n', (size_t)(s->token - c));
      if (*c == '$')
        PetscCall(read_comment(b, c, line));
    }
    if (width == LINE && from < end && *from != '$')
      SB_SCAN_ERROR(s, "the line is longer than %d characters; go on with the entry on a next line",
                    LINE - 1);
    per_line = strchr(word, '*') ? 4 : 8;
    for (int k = b->nfield.n > 0; k <= per_line; k++) {
      if (k)
        p = take_field(p, width == LINE ? LINE : (size_t)(64 / per_line), word);
      PetscCall(SbImportGrow(b->deck.im, &b->nfield, sizeof(*b->field), &b->field));
      b->field[b->nfield.n - 1].at = s->token;
      (void)memcpy(b->field[b->nfield.n - 1].word, word, WORD);
    }

    // behind the values there is a mark of the next line
    if (width == LINE)
      (void)take_field(take_field(p, LINE, word), LINE, word);
    if (width == LINE && word[0])
      SB_SCAN_ERROR(s, "the line has more than %d fields; go on with the entry on a next line",
                    per_line + 2);
    after = s->at;
    if (!strncasecmp(b->field[0].word, "ENDDATA", 7))
      break;
  }
  if (!b->nfield.n)
    PetscFunctionReturn(PETSC_SUCCESS);
  s->at = after;
  s->token = b->field[0].at;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Next field of the entry; "" at its end. */
static const char *next_field(Nastran *b)
{
  if (b->next >= b->nfield.n)
    return "";
  b->scan->token = b->field[b->next].at;
  return b->field[b->next++].word;
}

/* Parses an integer; an empty field is 0. */
static PetscErrorCode to_number(Nastran *b, const char *word, const char *what, int64_t *value)
{
  char *end;

  PetscFunctionBeginUser;
  *value = strtoll(word, &end, 10);
  if (*end || *value < 0 || *value > (int64_t)1 << 40)
    SB_SCAN_ERROR(b->scan, "expected the %s, found '%.24s'", what, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an integer; `needed`: it must not be missing. */
static PetscErrorCode next_number(Nastran *b, PetscBool needed, const char *what, int64_t *value)
{
  PetscFunctionBeginUser;
  PetscCall(to_number(b, next_field(b), what, value));
  if (needed && !*value)
    SB_SCAN_ERROR(b->scan, "the %s is missing", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_grid(Nastran *b)
{
  int64_t label, system;
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(next_number(b, PETSC_TRUE, "number of a node", &label));
  PetscCall(next_number(b, PETSC_FALSE, "coordinate system of a node", &system));
  if (system)
    SB_SCAN_ERROR(
      b->scan,
      "node %lld is given in coordinate system %lld; write all nodes in the basic one (field 3 "
      "of GRID empty or 0)",
      (long long)label, (long long)system);
  PetscCall(SbDeckAddNode(&b->deck, label, &x));

  // formats 1.5, 1.5E-3, 1.5D-3, 1.5-3; an empty field is 0
  for (int i = 0; i < 3; i++) {
    const char *word = next_field(b);
    char full[WORD + 1], *end;
    size_t n = 0;

    for (const char *p = word; *p && n < WORD; p++) {
      const PetscBool sign = (PetscBool)(*p == '-' || *p == '+');

      if (sign && p > word && (isdigit((unsigned char)p[-1]) || p[-1] == '.'))
        full[n++] = 'E';
      full[n++] = *p == 'D' || *p == 'd' ? 'E' : *p;
    }
    full[PetscMin(n, WORD)] = 0;
    x[i] = strtod(full, &end);
    if (*end || full[strspn(full, "0123456789.+-Ee")] || !isfinite(x[i]))
      SB_SCAN_ERROR(b->scan, "expected the coordinate of node %lld, found '%.24s'",
                    (long long)label, word);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names of elements, and gmsh's types for corner nodes only and with edge nodes. */
static const struct {
  const char *name;
  int ncorner, linear, higher, property; /* property 1: the second field is one */
} kinds[] = {
  {"CTETRA", 4, 4, 11, 1}, {"CHEXA", 8, 5, 17, 1}, {"CPENTA", 6, 6, 18, 1}, {"CPYRAM", 5, 7, 19, 1},
  {"CPYRA", 5, 7, 19, 1},  {"CTRIA3", 3, 2, 2, 1}, {"CTRIAR", 3, 2, 2, 1},  {"CTRIA6", 3, 2, 9, 1},
  {"CQUAD4", 4, 3, 3, 1},  {"CQUADR", 4, 3, 3, 1}, {"CQUAD8", 4, 3, 16, 1}, {"CBAR", 2, 1, 1, 1},
  {"CBEAM", 2, 1, 1, 1},   {"CROD", 2, 1, 1, 1},   {"CTUBE", 2, 1, 1, 1},   {"CONROD", 2, 1, 1, 0}};

static PetscErrorCode read_element(Nastran *b, int kind)
{
  SbDeckElement e = {.property = 0, .at = b->scan->token};
  const PetscBool quadratic = (PetscBool)(kinds[kind].linear != kinds[kind].higher);
  const PetscBool tet = (PetscBool)(kinds[kind].higher == SB_GMSH_TET10);
  PetscBool more = PETSC_FALSE;
  int64_t node;

  PetscFunctionBeginUser;
  PetscCall(next_number(b, PETSC_TRUE, "number of an element", &e.label));
  if (kinds[kind].property)
    PetscCall(next_number(b, PETSC_FALSE, "property of an element", &e.property));
  if (!e.property)
    e.property = -1;
  for (int k = 0; k < kinds[kind].ncorner; k++) {
    PetscCall(next_number(b, PETSC_TRUE, "node of an element", &node));
    if (k < 4)
      e.node[k] = node;
  }

  /* edge nodes; the last fields of shells and lines have other meanings */
  for (int k = 4; quadratic && b->next < b->nfield.n; k++) {
    const char *word;

    if (more && (!tet || k >= 10))
      break;
    word = next_field(b);
    if (!word[0] || word[0] == '+' || strchr(word, '.'))
      continue;
    more = PETSC_TRUE;
    if (tet)
      PetscCall(to_number(b, word, "node of an element", &e.node[PetscMin(k, 9)]));
  }
  e.type = more ? kinds[kind].higher : kinds[kind].linear;
  PetscCall(SbDeckAddElement(&b->deck, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the nodes first to last to the set KIND_NUMBER, as spc_12. */
static PetscErrorCode add_range(Nastran *b, const char *kind, int64_t number, int64_t first,
                                int64_t last)
{
  char name[SB_GROUP_MAX];
  PetscInt set;

  PetscFunctionBeginUser;
  (void)snprintf(name, sizeof(name), "%s_%lld", kind, (long long)number);
  PetscCall(SbDeckFindSet(&b->deck, PETSC_TRUE, name, &set));
  PetscCall(SbDeckAddRange(&b->deck, set, -1, first, PetscMax(first, last), 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a list of nodes, or first THRU last, after the set number and `nskip` fields. */
static PetscErrorCode read_list(Nastran *b, const char *kind, int nskip)
{
  PetscBool thru = PETSC_FALSE;
  int64_t number = 0;
  int64_t node;
  int64_t last = 0;

  PetscFunctionBeginUser;
  PetscCall(next_number(b, PETSC_TRUE, "number of a set", &number));
  b->next += nskip;
  while (b->next < b->nfield.n) {
    const char *word = next_field(b);

    if (!strcasecmp(word, "THRU")) {
      thru = PETSC_TRUE;
    } else if (word[0] && strcasecmp(word, "SKIN") != 0) {
      PetscCall(to_number(b, word, "node of a set", &node));
      PetscCall(add_range(b, kind, number, thru ? last : node, node));
      last = node;
      thru = PETSC_FALSE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_entry(Nastran *b)
{
  char *name = b->field[0].word;
  int64_t number = 0;
  int64_t node;

  PetscFunctionBeginUser;
  name[strcspn(name, "*")] = 0;
  if (!strcasecmp(name, "GRID"))
    PetscCall(read_grid(b));

  // default coordinate system of points
  if (!strcasecmp(name, "GRDSET")) {
    b->next++;
    PetscCall(next_number(b, PETSC_FALSE, "coordinate system of the nodes", &number));
    if (number)
      SB_SCAN_ERROR(b->scan,
                    "GRDSET gives the nodes in coordinate system %lld; write them in the basic one",
                    (long long)number);
  }

  // SPC: twice a node, its components and their displacement
  if (!strcasecmp(name, "SPC")) {
    PetscCall(next_number(b, PETSC_TRUE, "spc of a set", &number));
    for (int i = 0; i < 2; i++) {
      PetscCall(next_number(b, PETSC_FALSE, "node of a set", &node));
      if (node)
        PetscCall(add_range(b, "spc", number, node, node));
      b->next += 2;
    }
  }
  if (!strcasecmp(name, "SPC1"))
    PetscCall(read_list(b, "spc", 1));
  if (!strcasecmp(name, "SET1"))
    PetscCall(read_list(b, "set", 0));
  if (!strncasecmp(name, "INCLUDE", 7))
    SB_SCAN_ERROR(b->scan, "INCLUDE is not followed; put all into one file");
  for (int k = 0; k < (int)PETSC_STATIC_ARRAY_LENGTH(kinds); k++)
    if (!strcasecmp(name, kinds[k].name))
      PetscCall(read_element(b, k));
  if (b->pending[0] && (name[0] == 'P' || name[0] == 'p')) {
    PetscCall(next_number(b, PETSC_FALSE, "number of a property", &number));
    PetscCall(add_name(b, number, b->pending));
    b->pending[0] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *im)
{
  Nastran b = {.scan = &im->scan,
               .deck = {.im = im, .compare = strcasecmp, .cure = "renumber the nodes"}};

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, b.scan));

  // after the line BEGIN BULK, or from the start of a file without that line
  for (const char *p = b.scan->data, *end; p; p = end ? end + 1 : NULL) {
    const char *word = p + strspn(p, " \t");

    end = (const char *)memchr(p, '\n', (size_t)(b.scan->end - p));
    if (strncasecmp(word, "BEGIN", 5) || strncasecmp(word + 5 + strspn(word + 5, " \t"), "BULK", 4))
      continue;
    b.scan->at = end ? end + 1 : b.scan->end;
    break;
  }
  for (;;) {
    PetscCall(next_entry(&b));
    if (!b.nfield.n || !strncasecmp(b.field[0].word, "ENDDATA", 7))
      break;
    PetscCall(read_entry(&b));
  }
  if (!im->nvert) {
    b.scan->token = b.scan->end;
    SB_SCAN_ERROR(
      b.scan, "there is no GRID up to here; this is no bulk data of Nastran, or it is truncated");
  }
  PetscCall(SbDeckBuild(&b.deck));
  PetscCall(SbImportJoinGroups(im));

  /* name the groups of properties that elements use */
  for (PetscInt i = 0; i < b.nname.n; i++)
    for (PetscInt dim = 1; dim < 4; dim++)
      SbImportNameGroup(im, dim, b.name[i].number, b.name[i].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}
