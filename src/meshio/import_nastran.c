/*
  import_nastran.c - reader of Nastran bulk data, .bdf and .nas (MSC Nastran Quick Reference Guide,
  "Bulk Data Entries"; also written by NX, HyperMesh, ANSA, Femap, Patran, gmsh, meshio and
  pyNastran).

  An entry has ten fields per line, first its name. Fields have 8 columns, 16 if the name ends with
  a star, or commas between them; a line whose first field is empty or begins with + or * continues
  the entry. It follows at once, or anywhere with the mark of the tenth field as its first. Tabs
  advance to the next multiple of 8 columns. Reals may omit the letter of the exponent (1.5-3).

  Read: GRID, solid, shell and line elements with their property, SPC, SPC1 and SET1 as sets of
  nodes. Property N is the group volume_N, surface_N or curve_N, or has its name from a comment
  (ANSA, HyperMesh, Femap, Patran). Lines before BEGIN BULK and after ENDDATA, and other entries,
  are skipped. INCLUDE is followed everywhere, from the folder of the file that has it. Points in
  rectangular, cylindrical and spherical systems (CORD1, CORD2) become those of the basic one, once
  all systems and points are known. Errors: replication (=), points on curves, superelements.

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

/* A line that continues an entry, found by its mark. */
typedef struct {
  char mark[8];
  const char *at;
  PetscBool used;
} Line;

/* A coordinate system: origin, a point on its z axis, one in the plane of x and z; of CORD1 as
   nodes. */
typedef struct {
  int64_t number, parent, node[3];
  char kind; /* R, C, S */
  PetscBool by_nodes;
  int state; /* 0: as given, 1: being found, 2: R and o in the basic system */
  PetscReal p[3][3], R[3][3], o[3];
  const char *at;
} System;

typedef struct {
  SbDeck deck;
  SbScan *scan;
  SbCount nline, nloose, nsystem, ncp;
  Line *line;         /* [nline] lines with a mark, by their marks; found when first needed */
  const char **loose; /* [nloose] such lines that were passed over */
  PetscBool sorted;   /* line[] is there */
  System *system;     /* [nsystem] */
  struct {
    int64_t system; /* 0: the basic one, -1: that of GRDSET */
    const char *at;
  } * cp;             /* [ncp] of each node */
  int64_t default_cp; /* of GRDSET */
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

static int compare_lines(const void *a, const void *b)
{
  const Line *p = (const Line *)a;
  const Line *q = (const Line *)b;
  const int order = strcmp(p->mark, q->mark);

  if (order)
    return order;
  return (p->at > q->at) - (p->at < q->at);
}

/* The mark in a field, without its + or *. */
static void mark_of(const char *field, char mark[8])
{
  (void)snprintf(mark, 8, "%.7s", field + (*field == '+' || *field == '*'));
}

/* Line that begins with this mark; NULL: there is none. */
static PetscErrorCode find_line(Nastran *b, const char *mark, Line **line)
{
  SbScan *s = b->scan;
  Line key = {.at = NULL};

  PetscFunctionBeginUser;
  *line = NULL;
  for (const char *p = s->data, *end; p && p < s->end && !b->sorted; p = end ? end + 1 : NULL) {
    char word[WORD];

    end = (const char *)memchr(p, '\n', (size_t)(s->end - p));
    if (*p != '+' && *p != '*')
      continue;
    (void)snprintf(word, 9, "%.8s", p);
    word[strcspn(word, ", \t\r\n")] = 0;
    PetscCall(SbImportGrow(b->deck.im, &b->nline, sizeof(*b->line), &b->line));
    b->line[b->nline.n - 1] = (Line){.at = p};
    mark_of(word, b->line[b->nline.n - 1].mark);
  }
  if (!b->sorted && b->nline.n)
    qsort(b->line, (size_t)b->nline.n, sizeof(*b->line), compare_lines);
  b->sorted = PETSC_TRUE;
  (void)snprintf(key.mark, sizeof(key.mark), "%s", mark);

  // the first one that is not smaller
  for (PetscInt low = 0, high = b->nline.n; low < b->nline.n;) {
    const PetscInt middle = low + (high - low) / 2;

    if (low < high && strcmp(b->line[middle].mark, mark) < 0)
      low = middle + 1;
    else if (low < high)
      high = middle;
    else {
      if (!strcmp(b->line[low].mark, mark))
        *line = &b->line[low];
      break;
    }
  }
  if (*line && *line + 1 < b->line + b->nline.n && !strcmp((*line)[1].mark, mark))
    SB_SCAN_ERROR(s, "the entry goes on at the mark '%s', with which two lines begin", mark);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First field of the next line that is no comment; false at the end of the file. */
static PetscBool peek(const Nastran *b, char word[WORD])
{
  const SbScan *s = b->scan;
  const char *p = s->at;
  char text[10];

  while (p < s->end && (*p == '$' || strchr("\r\n", p[strspn(p, " \t")]))) {
    p = (const char *)memchr(p, '\n', (size_t)(s->end - p));
    p = p ? p + 1 : s->end;
  }
  (void)snprintf(text, 9, "%.*s", (int)PetscMin(8, s->end - p), p);
  text[strcspn(text, "\t\r\n")] = 0;
  (void)take_field(text, 8, word);
  return (PetscBool)(p < s->end);
}

/* Reads the fields of the next entry, which has none at the end of the file. */
static PetscErrorCode next_entry(Nastran *b)
{
  SbScan *s = b->scan;
  const char *after = s->at; /* end of the lines of this entry */
  const char *resume = NULL; /* where the next entry is looked for, once it went on elsewhere */

  PetscFunctionBeginUser;
  b->nfield.n = 0;
  b->next = 1;

  /* most often another entry begins on the next line with its name, in the first column */
  while (s->at < s->end && !(b->nfield.n && isalpha((unsigned char)*s->at))) {
    const char *end = (const char *)memchr(s->at, '\n', (size_t)(s->end - s->at));
    const char *from, *p;
    char text[LINE], word[WORD], field[WORD], mark[8], other[8];
    Line *target;
    PetscBool there;
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
    if (!b->nfield.n && word[0] && strchr("+*", word[0])) {
      // it continues an entry that stands elsewhere
      PetscCall(SbImportGrow(b->deck.im, &b->nloose, sizeof(*b->loose), &b->loose));
      b->loose[b->nloose.n - 1] = s->token;
      continue;
    }
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
    p = take_field(p, width, field);
    mark_of(field, mark);
    word[0] = 0;
    if (width == LINE)
      (void)take_field(p, LINE, word);
    if (width == LINE && word[0])
      SB_SCAN_ERROR(s, "the line has more than %d fields; go on with the entry on a next line",
                    per_line + 2);
    after = s->at;
    if (!strncasecmp(b->field[0].word, "ENDDATA", 7))
      break;

    // goes on in the next line, or in the one with the mark
    there = peek(b, word);
    mark_of(word, other);
    if (there &&
        (!strcmp(mark, other) || (mark[0] && word[0] && !other[0] && strchr("+*", word[0])) ||
         (mark[0] && !word[0])))
      continue;
    resume = resume ? resume : after;
    if (!mark[0])
      break;
    PetscCall(find_line(b, mark, &target));
    if (!target && field[0] == '+' && strchr("CGScgs", b->field[0].word[0]))
      SB_SCAN_ERROR(s, "the entry goes on at the mark '%s', with which no line begins", field);
    if (target && target->used)
      SB_SCAN_ERROR(s, "two entries go on at the mark '%s'", field);
    if (!target)
      break;
    target->used = PETSC_TRUE;
    s->at = after = target->at;
  }
  if (!b->nfield.n)
    PetscFunctionReturn(PETSC_SUCCESS);
  s->at = resume ? resume : after;
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

/* A real number: 1.5, 1.5E-3, 1.5D-3, 1.5-3; an empty field is 0. */
static PetscErrorCode next_real(Nastran *b, const char *what, int64_t number, PetscReal *x)
{
  const char *word = next_field(b);
  char full[WORD + 1], *end;
  size_t n = 0;

  PetscFunctionBeginUser;
  for (const char *p = word; *p && n < WORD; p++) {
    const PetscBool sign = (PetscBool)(*p == '-' || *p == '+');

    if (sign && p > word && (isdigit((unsigned char)p[-1]) || p[-1] == '.'))
      full[n++] = 'E';
    full[n++] = *p == 'D' || *p == 'd' ? 'E' : *p;
  }
  full[PetscMin(n, WORD)] = 0;
  *x = strtod(full, &end);
  if (*end || full[strspn(full, "0123456789.+-Ee")] || !isfinite(*x))
    SB_SCAN_ERROR(b->scan, "expected the coordinate of %s %lld, found '%.24s'", what,
                  (long long)number, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_grid(Nastran *b)
{
  SbImport *im = b->deck.im;
  int64_t label, system;
  PetscReal *x;
  PetscBool given;

  PetscFunctionBeginUser;
  PetscCall(next_number(b, PETSC_TRUE, "number of a node", &label));
  given = (PetscBool)(b->next < b->nfield.n && b->field[b->next].word[0]);
  PetscCall(next_number(b, PETSC_FALSE, "coordinate system of a node", &system));
  PetscCall(SbDeckAddNode(&b->deck, label, &x));
  for (int i = 0; i < 3; i++)
    PetscCall(next_real(b, "node", label, &x[i]));
  PetscCall(SbImportGrow(im, &b->ncp, sizeof(*b->cp), &b->cp));
  b->cp[im->nvert - 1].system = given ? system : -1;
  b->cp[im->nvert - 1].at = b->field[0].at;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a coordinate system, whose number is the next field. */
static PetscErrorCode add_system(Nastran *b, char kind, PetscBool by_nodes, System **system)
{
  System *c;

  PetscFunctionBeginUser;
  PetscCall(SbImportGrow(b->deck.im, &b->nsystem, sizeof(*c), &b->system));
  c = &b->system[b->nsystem.n - 1];
  *c = (System){.kind = kind, .by_nodes = by_nodes, .at = b->field[0].at};
  PetscCall(next_number(b, PETSC_TRUE, "number of a coordinate system", &c->number));
  for (PetscInt k = 0; k + 1 < b->nsystem.n; k++)
    if (b->system[k].number == c->number)
      SB_SCAN_ERROR(b->scan, "coordinate system %lld is given twice", (long long)c->number);
  *system = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* CORD2R, CORD2C, CORD2S: number, reference system, three points; CORD1R, ...: once or twice a
   number and three nodes. */
static PetscErrorCode read_system(Nastran *b, const char *name)
{
  System *c;

  PetscFunctionBeginUser;
  if (name[4] == '2') {
    PetscCall(add_system(b, (char)toupper((unsigned char)name[5]), PETSC_FALSE, &c));
    PetscCall(next_number(b, PETSC_FALSE, "reference coordinate system", &c->parent));
    for (int k = 0; k < 9; k++)
      PetscCall(next_real(b, "coordinate system", c->number, &c->p[k / 3][k % 3]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int i = 0; i < 2 && b->next < b->nfield.n && b->field[b->next].word[0]; i++) {
    PetscCall(add_system(b, (char)toupper((unsigned char)name[5]), PETSC_TRUE, &c));
    for (int k = 0; k < 3; k++)
      PetscCall(next_number(b, PETSC_TRUE, "node of a coordinate system", &c->node[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Index of a system by its number. */
static PetscErrorCode find_system(Nastran *b, int64_t number, const char *at, System **c)
{
  PetscFunctionBeginUser;
  *c = NULL;
  for (PetscInt k = 0; k < b->nsystem.n; k++)
    if (b->system[k].number == number)
      *c = &b->system[k];
  b->scan->token = at;
  if (!*c)
    SB_SCAN_ERROR(b->scan, "coordinate system %lld is not there (CORD1 or CORD2)",
                  (long long)number);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From coordinates of a system whose place is known to basic ones. Spherical: radius, angle from
   z, angle about z. */
static void to_basic(const System *c, PetscReal x[3])
{
  PetscReal y[3] = {x[0], x[1], x[2]};
  const PetscReal a = x[1] * PETSC_PI / 180;
  const PetscReal p = x[2] * PETSC_PI / 180;

  if (c->kind == 'C') {
    y[0] = x[0] * PetscCosReal(a);
    y[1] = x[0] * PetscSinReal(a);
  } else if (c->kind == 'S') {
    y[0] = x[0] * PetscSinReal(a) * PetscCosReal(p);
    y[1] = x[0] * PetscSinReal(a) * PetscSinReal(p);
    y[2] = x[0] * PetscCosReal(a);
  }
  for (int i = 0; i < 3; i++)
    x[i] = c->o[i] + c->R[i][0] * y[0] + c->R[i][1] * y[1] + c->R[i][2] * y[2];
}

/* Finds the place of a system, after those that it needs; `depth` of them wait for it. */
static PetscErrorCode place_system(Nastran *b, System *c, int depth);

/* Makes a node basic, once. */
static PetscErrorCode place_node(Nastran *b, PetscInt v, int depth)
{
  System *c;

  PetscFunctionBeginUser;
  if (!b->cp[v].system)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_system(b, b->cp[v].system, b->cp[v].at, &c));
  PetscCall(place_system(b, c, depth));
  to_basic(c, b->deck.im->x + 3 * v);
  b->cp[v].system = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode place_system(Nastran *b, System *c, int depth)
{
  PetscReal z[3], e[3];
  PetscReal length[2] = {0, 0};
  PetscReal along = 0;
  System *parent;

  PetscFunctionBeginUser;
  if (c->state == 2)
    PetscFunctionReturn(PETSC_SUCCESS);
  b->scan->token = c->at;
  if (c->state == 1 || depth > 100)
    SB_SCAN_ERROR(b->scan, "coordinate system %lld refers to itself, or through more than 100",
                  (long long)c->number);
  c->state = 1;
  for (int k = 0; k < 3; k++) {
    const PetscInt v = c->by_nodes ? SbNumbersFind(&b->deck.im->nodes, c->node[k]) : -1;

    if (c->by_nodes && v < 0)
      SB_SCAN_ERROR(b->scan, "coordinate system %lld uses node %lld, which is not there",
                    (long long)c->number, (long long)c->node[k]);
    if (c->by_nodes) {
      PetscCall(place_node(b, v, depth + 1));
      PetscCall(PetscArraycpy(c->p[k], b->deck.im->x + 3 * v, 3));
    } else if (c->parent) {
      PetscCall(find_system(b, c->parent, c->at, &parent));
      PetscCall(place_system(b, parent, depth + 1));
      to_basic(parent, c->p[k]);
    }
  }

  // z to the second point, x in the plane of the third one
  for (int i = 0; i < 3; i++) {
    c->o[i] = c->p[0][i];
    z[i] = c->p[1][i] - c->p[0][i];
    e[i] = c->p[2][i] - c->p[0][i];
    length[0] += PetscSqr(z[i]);
  }
  length[0] = PetscSqrtReal(length[0]);
  for (int i = 0; i < 3 && length[0] > 0; i++) {
    z[i] /= length[0];
    along += z[i] * e[i];
  }
  for (int i = 0; i < 3; i++) {
    e[i] -= along * z[i];
    length[1] += PetscSqr(e[i]);
  }
  length[1] = PetscSqrtReal(length[1]);
  b->scan->token = c->at;
  if (!(length[0] > 0 && length[1] > 1e-12 * length[0]))
    SB_SCAN_ERROR(b->scan, "the three points of coordinate system %lld lie on a line",
                  (long long)c->number);
  for (int i = 0; i < 3; i++) {
    c->R[i][0] = e[i] / length[1];
    c->R[i][2] = z[i];
  }
  for (int i = 0; i < 3; i++)
    c->R[i][1] =
      c->R[(i + 1) % 3][2] * c->R[(i + 2) % 3][0] - c->R[(i + 2) % 3][2] * c->R[(i + 1) % 3][0];
  c->state = 2;
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

/* Entries that would change nodes or elements are errors; elements that a mesh does not need are
   counted. */
static PetscErrorCode check_name(Nastran *b, const char *name)
{
  static const char *const refused[] = {
    "GRIDG",  "GRIDF",   "GRIDB", "GRIDA",  "CORD3",  "SELOC",  "SEBULK", "SEMPLN",
    "CSUPER", "CSUPEXT", "CHEX8", "CHEX20", "CWEDGE", "BEGIN",  "CIHEX",  "CSOLID",
    "CPYRM",  "CTET",    "CHEX",  "CPENT",  "CIFHEX", "CIFPEN", "CTQUAD", "CRAC3D"};
  static const char *const skipped[] = {
    "CELAS",  "CDAMP",  "CMASS",  "CONM",    "CBUSH",  "CGAP",    "CVISC",  "CWELD",  "CFAST",
    "RBE",    "RBAR",   "RROD",   "RSPLINE", "CBEND",  "CSHEAR",  "MPC",    "CRAC2D", "CSEAM",
    "CTRIA",  "CTRIAX", "CTRAX",  "CQUAD",   "CQUADX", "CPLSTN",  "CPLSTS", "CHBDY",  "CHACAB",
    "CHACBR", "CACINF", "CINTC",  "CCONEAX", "CDUM",   "GENEL",   "PLOTEL", "RJOINT", "RTRPLT",
    "RSSCON", "SPOINT", "EPOINT", "CYSYM",   "BOLT",   "CIFQUAD", "CSPR"};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(kinds); k++)
    if (!strcasecmp(name, kinds[k].name))
      PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(refused); i++)
    if (!strncasecmp(name, refused[i], strlen(refused[i])))
      SB_SCAN_ERROR(b->scan,
                    "%s changes nodes or elements in a way that supple does not know; write GRID "
                    "and CTETRA instead",
                    name);
  if (name[0] == '=')
    SB_SCAN_ERROR(b->scan, "a line of replication (=); write every entry in full");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(skipped); i++) {
    if (strncasecmp(name, skipped[i], strlen(skipped[i])) || !strcasecmp(name, "MPCADD"))
      continue;
    PetscCall(SbImportSkip(b->deck.im, "%.10s", name));
    break;
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

  // default coordinate system of points, and the systems
  if (!strcasecmp(name, "GRDSET")) {
    b->next++;
    PetscCall(next_number(b, PETSC_FALSE, "coordinate system of the nodes", &b->default_cp));
  }
  if (!strncasecmp(name, "CORD", 4) && name[4] && strchr("12", name[4]) && name[5] &&
      strchr("RCSrcs", name[5]) && !name[6])
    PetscCall(read_system(b, name));
  PetscCall(check_name(b, name));

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

/* INCLUDE 'file', in quotes of either kind, of which the name may go on in the next lines, or
   without. */
static PetscErrorCode included(SbScan *s, const char *line, SbIncludeFile *file)
{
  const char *p = line + strspn(line, " \t");
  char quote = 0;
  size_t n = 0;

  PetscFunctionBeginUser;
  file->stop = (PetscBool)!strncasecmp(p, "ENDDATA", 7);
  if (strncasecmp(p, "INCLUDE", 7) != 0 || !strchr(" \t\r\n,='\"", p[7]))
    PetscFunctionReturn(PETSC_SUCCESS);
  file->whole = PETSC_TRUE;
  p += 7;
  p += strspn(p, " \t");
  p += *p == ',' || *p == '=';
  p += strspn(p, " \t");
  if (*p == '\'' || *p == '"')
    quote = *p++;

  // blanks at the beginning and end of each of its lines do not count
  for (const char *word = p; p < s->end && *p != quote; p++) {
    if (*p == '\n' || (!quote && *p == '$')) {
      while (n && isspace((unsigned char)file->name[n - 1]))
        n--;
      if (!quote)
        break;
      word = p + 1;
    } else if (p > word || !isspace((unsigned char)*p)) {
      if (n + 1 >= sizeof(file->name) || !*p)
        SB_SCAN_ERROR(s, "the name of the file after INCLUDE has no end within %zu characters",
                      sizeof(file->name) - 1);
      file->name[n++] = *p;
    } else
      word = p + 1;
  }
  if (quote && p >= s->end)
    SB_SCAN_ERROR(s, "the name of the file after INCLUDE begins with %c and does not end", quote);
  while (n && isspace((unsigned char)file->name[n - 1]))
    n--;
  file->name[n] = 0;
  if (!n)
    SB_SCAN_ERROR(s, "INCLUDE names no file");
  p = p < s->end ? (const char *)memchr(p, '\n', (size_t)(s->end - p)) : NULL;
  file->end = p ? p + 1 : s->end;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *im)
{
  Nastran b = {.scan = &im->scan,
               .deck = {.im = im, .compare = strcasecmp, .cure = "renumber the nodes"}};

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, b.scan));
  PetscCall(SbImportExpand(im, path, PETSC_TRUE, included));

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

  // an included file that ends all of them was meant to stand alone
  if (b.nfield.n && SbScanWhere(b.scan) != im->where) {
    char word[WORD];

    if (peek(&b, word))
      SB_SCAN_ERROR(b.scan, "ENDDATA ends the file that includes this one, too, whose lines after "
                            "INCLUDE would be lost; take it out");
  }
  if (!im->nvert) {
    b.scan->token = b.scan->end;
    SB_SCAN_ERROR(
      b.scan, "there is no GRID up to here; this is no bulk data of Nastran, or it is truncated");
  }

  // lines that begin with a mark belong to an entry
  for (PetscInt k = 0; k < b.nloose.n; k++) {
    char word[WORD], mark[8];
    Line *line;

    b.scan->token = b.scan->at = b.loose[k];
    (void)peek(&b, word);
    mark_of(word, mark);
    PetscCall(find_line(&b, mark, &line));
    if (!line || !line->used)
      SB_SCAN_ERROR(b.scan, "a line begins with the mark '%s', at which no entry goes on", word);
  }

  // all coordinates basic
  for (PetscInt v = 0; v < im->nvert; v++)
    if (b.cp[v].system < 0)
      b.cp[v].system = b.default_cp;
  for (PetscInt v = 0; v < im->nvert; v++)
    PetscCall(place_node(&b, v, 0));
  PetscCall(SbDeckBuild(&b.deck));
  PetscCall(SbImportJoinGroups(im));

  /* name the groups of properties that elements use */
  for (PetscInt i = 0; i < b.nname.n; i++)
    for (PetscInt dim = 1; dim < 4; dim++)
      SbImportNameGroup(im, dim, b.name[i].number, b.name[i].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}
