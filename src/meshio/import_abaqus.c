/*
  import_abaqus.c - reader of Abaqus input files, .inp (Abaqus Analysis User's Guide, "Input syntax
  rules"; also written by CalculiX, PrePoMax, Cubit, meshio and gmsh).

  Lines that begin with * and a word are keywords with parameters between commas; a line that ends
  with a comma goes on; two stars are a comment; the lines after a keyword are its data. Read: *NODE
  (also cylindrical, spherical, and in a *SYSTEM), *ELEMENT (C3D4..., S3 and other triangles,
  two-node lines), the rules of abaqus_generate.c, *NSET, *ELSET (also GENERATE, and sets by name),
  *SURFACE of elements with sides S1 to S4. The parameters ELSET of *ELEMENT and NSET of *NODE
  define sets too. Sets become groups of the same names; undefined elements of a set are ignored.
  Other keywords that change nodes or elements are errors.

  Parts and instances: a part is read once for each of its instances, moved and turned as that says;
  where there are none, once as it stands. Labels count within an instance, or within the rest of
  the file: they get its number above their 40 bits. A set is called instance.set there, and set
  alone in the body, unless another one has that name. Of several instances each is a group of tets.

  Elements that a mesh does not need (springs, masses, connectors) are skipped and counted.
  Everything is collected first and converted at the end, since sets may refer to later definitions.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "abaqus.h"

enum {
  WORD = SB_ABAQUS_WORD
};

/* Number of the instance of this name, which has n bytes; -1: none. */
static PetscInt find_instance(const SbAbaqus *a, const char *name, size_t n)
{
  for (PetscInt i = 0; i < a->ninstance.n; i++)
    if (strlen(a->instance[i].name) == n && !strncasecmp(a->instance[i].name, name, n))
      return i;
  return -1;
}

/* Parses a label, or the name of a set; *set is -1 for a label. Before a dot stands the instance;
   `instance` is that of the keyword, -1: the current scope. */
static PetscErrorCode label_of(SbAbaqus *a, PetscBool of_nodes, PetscInt instance, const char *word,
                               int64_t *label, PetscInt *set)
{
  const char *dot = strrchr(word, '.');
  char prefix[WORD + 2];

  PetscFunctionBeginUser;
  *set = -1;
  if (dot && a->instances && !isdigit((unsigned char)word[0])) {
    instance = find_instance(a, word, (size_t)(dot - word));
    if (instance < 0)
      SB_SCAN_ERROR(a->scan, "'%.60s' is of an instance that no line above gives", word);
    word = dot + 1;
  } else if (dot && isdigit((unsigned char)dot[1]))
    word = dot + 1; /* of the only part of a file that has no instances */
  if (isdigit((unsigned char)word[0])) {
    PetscCall(SbAbaqusParse(a, word, "label of a node or element", label));
    *label += instance < 0 ? a->scope : (int64_t)instance << SB_ABAQUS_SCOPE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  (void)snprintf(prefix, sizeof(prefix), "%s%s", instance < 0 ? a->prefix : "",
                 instance < 0 ? "" : a->instance[instance].name);
  if (instance >= 0)
    SbAppend(sizeof(prefix), prefix, ".");
  PetscCall(SbAbaqusPrefixedSet(a, of_nodes, prefix, word, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Instance that the keyword names, or -1. */
static PetscErrorCode keyword_instance(SbAbaqus *a, PetscInt *instance)
{
  const char *name = SbAbaqusParameter(a, "INSTANCE");

  PetscFunctionBeginUser;
  *instance = name && a->instances ? find_instance(a, name, strlen(name)) : -1;
  if (name && a->instances && *instance < 0)
    SB_SCAN_ERROR(a->scan, "there is no instance '%.60s' above", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_set(SbAbaqus *a, PetscBool of_nodes)
{
  char word[WORD];
  const char *name = SbAbaqusParameter(a, of_nodes ? "NSET" : "ELSET");
  const char *elements = of_nodes ? SbAbaqusParameter(a, "ELSET") : NULL;
  const PetscBool generated = (PetscBool)(SbAbaqusParameter(a, "GENERATE") != NULL);
  PetscInt set, other, instance;
  int64_t label = 0;

  PetscFunctionBeginUser;
  if (!name || !name[0])
    SB_SCAN_ERROR(a->scan, "a set without a name");
  PetscCall(SbAbaqusSet(a, of_nodes, name, &set));
  PetscCall(keyword_instance(a, &instance));
  if (elements) {
    // nodes of a set of elements
    PetscCall(SbImportGrow(a->deck.im, &a->npair, sizeof(*a->pair), &a->pair));
    PetscCall(label_of(a, PETSC_FALSE, instance, elements, &label, &other));
    if (other < 0)
      SB_SCAN_ERROR(a->scan, "expected the name of a set of elements, found '%.24s'", elements);
    a->pair[a->npair.n - 1][0] = set;
    a->pair[a->npair.n - 1][1] = other;
  }
  while (SbAbaqusDataLine(a)) {
    int64_t value[3] = {0, 0, 1};

    if (generated) {
      const int64_t scope = instance < 0 ? a->scope : (int64_t)instance << SB_ABAQUS_SCOPE;

      for (int i = 0; i < 3; i++)
        PetscCall(SbAbaqusNumber(a, "first, last or step of a set", &value[i]));
      if (value[2] < 1 || value[1] < value[0])
        SB_SCAN_ERROR(a->scan, "a set from %lld to %lld by %lld; it is empty", (long long)value[0],
                      (long long)value[1], (long long)value[2]);
      PetscCall(SbDeckAddRange(&a->deck, set, -1, scope + value[0], scope + value[1], value[2]));
    }
    while (!generated && SbAbaqusNext(a, word)) {
      if (!word[0])
        continue;
      PetscCall(label_of(a, of_nodes, instance, word, &label, &other));
      PetscCall(SbDeckAddRange(&a->deck, set, other, label, label, 1));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y <- A y + b */
static void affine(const PetscReal A[3][3], const PetscReal b[3], PetscReal y[3])
{
  PetscReal x[3];

  for (int i = 0; i < 3; i++)
    x[i] = y[i];
  for (int i = 0; i < 3; i++)
    y[i] = A[i][0] * x[0] + A[i][1] * x[1] + A[i][2] * x[2] + b[i];
}

/* *SYSTEM: origin, a point on the first axis, on the next line one on the side of the second
   axis. */
static PetscErrorCode read_system(SbAbaqus *a)
{
  PetscReal p[9] = {0};
  PetscReal *e0 = p + 3;
  PetscReal *e1 = p + 6;
  PetscReal n[2];
  int nline = 0;

  PetscFunctionBeginUser;
  while (nline < 2 && SbAbaqusDataLine(a)) {
    PetscCall(SbAbaqusReals(a, "a coordinate", nline ? 3 : 6, p + (nline ? 6 : 0)));
    nline++;
  }
  for (int i = 0; i < 3; i++) {
    a->o[i] = p[i];
    for (int j = 0; j < 3; j++)
      a->S[i][j] = i == j;
    e0[i] -= nline > 1 ? p[i] : 0;
    e1[i] -= nline > 1 ? p[i] : 0;
  }
  a->scan->token = a->line;
  if (nline == 1 && (e0[0] != 0 || e0[1] != 0 || e0[2] != 0))
    SB_SCAN_ERROR(a->scan, "*SYSTEM with two points; give a third one on a second line, to say "
                           "where the second axis points");
  if (nline < 2)
    PetscFunctionReturn(PETSC_SUCCESS);
  n[0] = PetscSqrtReal(PetscSqr(e0[0]) + PetscSqr(e0[1]) + PetscSqr(e0[2]));
  for (int i = 0; i < 3; i++)
    e0[i] /= n[0];
  n[1] = e0[0] * e1[0] + e0[1] * e1[1] + e0[2] * e1[2];
  for (int i = 0; i < 3; i++)
    e1[i] -= n[1] * e0[i];
  n[1] = PetscSqrtReal(PetscSqr(e1[0]) + PetscSqr(e1[1]) + PetscSqr(e1[2]));
  if (!(n[0] > 0 && n[1] > 1e-12 * n[0]))
    SB_SCAN_ERROR(a->scan, "the three points of *SYSTEM lie on a line");
  for (int i = 0; i < 3; i++) {
    a->S[i][0] = e0[i];
    a->S[i][1] = e1[i] / n[1];
  }
  for (int i = 0; i < 3; i++)
    a->S[i][2] =
      a->S[(i + 1) % 3][0] * a->S[(i + 2) % 3][1] - a->S[(i + 2) % 3][0] * a->S[(i + 1) % 3][1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_nodes(SbAbaqus *a)
{
  const char *name = SbAbaqusParameter(a, "NSET");
  const char *system = SbAbaqusParameter(a, "SYSTEM");
  char word[WORD], what[64];
  char kind = 'R';
  PetscInt set = -1;
  int64_t label;
  PetscReal *x;

  PetscFunctionBeginUser;
  if (system)
    kind = (char)toupper((unsigned char)system[0]);
  if (system && (!kind || !strchr("RCS", kind) || system[1]))
    SB_SCAN_ERROR(a->scan, "*NODE with SYSTEM=%.24s; expected R, C or S", system);
  if (name)
    PetscCall(SbAbaqusSet(a, PETSC_TRUE, name, &set));
  while (SbAbaqusDataLine(a)) {
    (void)SbAbaqusNext(a, word);
    PetscCall(SbAbaqusParse(a, word, "label of a node", &label));
    PetscCall(SbDeckAddNode(&a->deck, a->scope + label, &x));
    if (set >= 0)
      PetscCall(SbDeckAddRange(&a->deck, set, -1, a->scope + label, a->scope + label, 1));
    (void)snprintf(what, sizeof(what), "a coordinate of node %lld", (long long)label);
    PetscCall(SbAbaqusReals(a, what, 3, x));

    // radius, angle from the first axis, and height or angle from the equator; degrees
    if (kind != 'R') {
      const PetscReal r = x[0];
      const PetscReal theta = x[1] * PETSC_PI / 180;
      const PetscReal phi = kind == 'S' ? x[2] * PETSC_PI / 180 : 0;

      x[0] = r * PetscCosReal(phi) * PetscCosReal(theta);
      x[1] = r * PetscCosReal(phi) * PetscSinReal(theta);
      if (kind == 'S')
        x[2] = r * PetscSinReal(phi);
    }
    affine((const PetscReal(*)[3])a->S, a->o, x);
    affine((const PetscReal(*)[3])a->R, a->t, x);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gmsh's type of a type of elements; 0: one that a mesh does not need. */
static PetscErrorCode element_type(SbAbaqus *a, const char *name, int *type)
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
  static const char *const solids[] = {"C3D",   "DC3D", "AC3D", "Q3D",  "CIN3D", "ACIN3D", "EC3D",
                                       "COH3D", "SC6",  "SC8",  "GK3D", "PC3D",  "CSS8",   "F3D"};

  PetscFunctionBeginUser;
  *type = 0;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types) && !*type; i++) {
    const size_t n = strlen(types[i].name);

    if (!strncasecmp(name, types[i].name, n) && !isdigit((unsigned char)name[n]))
      *type = types[i].type;
  }
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(solids) && !*type; i++)
    if (!strncasecmp(name, solids[i], strlen(solids[i])))
      SB_SCAN_ERROR(a->scan,
                    "volume elements of type '%.24s'; supple simulates tetrahedra only, C3D4 and "
                    "C3D10: mesh the part with them",
                    name);
  if (!name[0])
    SB_SCAN_ERROR(a->scan, "*ELEMENT without a TYPE");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_elements(SbAbaqus *a)
{
  const char *set_name = SbAbaqusParameter(a, "ELSET");
  const char *type_name = SbAbaqusParameter(a, "TYPE");
  char word[WORD];
  PetscInt set = -1;
  int type;
  int nnode;

  PetscFunctionBeginUser;
  PetscCall(element_type(a, type_name ? type_name : "", &type));
  nnode = SbGmshTypes[type].nnode;
  if (set_name)
    PetscCall(SbAbaqusSet(a, PETSC_FALSE, set_name, &set));
  while (SbAbaqusDataLine(a)) {
    SbDeckElement e = {.type = type, .property = -1, .at = a->scan->token};

    // one element, continued on further lines until it has all nodes; of one that is skipped a
    // line may be such a continuation
    (void)SbAbaqusNext(a, word);
    if (!type && !isdigit((unsigned char)word[0]))
      continue;
    PetscCall(SbAbaqusParse(a, word, "label of an element", &e.label));
    for (int k = 0; k < nnode; k++) {
      int64_t node;

      if (!SbAbaqusNext(a, word) && !(SbAbaqusDataLine(a) && SbAbaqusNext(a, word)))
        SB_SCAN_ERROR(a->scan, "element %lld ends after %d of %d nodes", (long long)e.label, k,
                      nnode);
      PetscCall(SbAbaqusParse(a, word, "node of an element", &node));
      if (k < 10)
        e.node[k] = a->scope + node;
    }
    if (SbGmshTypes[type].dim == 3 && SbAbaqusNext(a, word) && word[0])
      SB_SCAN_ERROR(a->scan, "element %lld goes on behind its %d nodes", (long long)e.label, nnode);
    e.label += a->scope;
    if (!type)
      PetscCall(SbImportSkip(a->deck.im, "elements %.24s", type_name));
    if (!type && SbNumbersFind(&a->deck.im->elements, e.label) >= 0)
      continue;
    PetscCall(SbDeckAddElement(&a->deck, &e));
    if (set >= 0)
      PetscCall(SbDeckAddRange(&a->deck, set, -1, e.label, e.label, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_surface(SbAbaqus *a)
{
  const char *name = SbAbaqusParameter(a, "NAME");
  const char *kind = SbAbaqusParameter(a, "TYPE");
  char word[WORD];
  PetscInt instance;

  PetscFunctionBeginUser;
  if (!name || !name[0])
    SB_SCAN_ERROR(a->scan, "a surface without a name");
  PetscCall(keyword_instance(a, &instance));

  // surfaces of nodes, of a rigid shape or made of others have no facets
  if ((kind && strcasecmp(kind, "ELEMENT") != 0) || SbAbaqusParameter(a, "COMBINE")) {
    PetscCall(SbImportSkip(a->deck.im, "surface %.40s without elements", name));
    SbScanEndOfLine(a->scan);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbImportGrow(a->deck.im, &a->nsurface, sizeof(*a->surface), &a->surface));
  if (strlen(a->prefix) + strlen(name) >= SB_GROUP_MAX)
    SB_SCAN_ERROR(a->scan, "the name '%.40s...' is longer than %d bytes", name, SB_GROUP_MAX - 1);
  (void)snprintf(a->surface[a->nsurface.n - 1], SB_GROUP_MAX, "%s", a->prefix);
  SbAppend(SB_GROUP_MAX, a->surface[a->nsurface.n - 1], "%s", name);
  while (SbAbaqusDataLine(a)) {
    char side[WORD] = "";
    SbAbaqusSide one = {.surface = a->nsurface.n - 1, .side = -1, .at = a->scan->token};

    (void)SbAbaqusNext(a, word);
    PetscCall(label_of(a, PETSC_FALSE, instance, word, &one.element, &one.set));
    (void)SbAbaqusNext(a, side);
    if ((side[0] == 'S' || side[0] == 's') && side[1] >= '1' && side[1] <= '6' && !side[2])
      one.side = side[1] - '1';
    else if ((side[0] == 'E' || side[0] == 'e') && side[1] >= '1' && side[1] <= '4' && !side[2])
      continue; /* an edge of a shell */
    else if (strcasecmp(side, "SPOS") && strcasecmp(side, "SNEG"))
      SB_SCAN_ERROR(a->scan, "side '%.24s' of a surface; expected S1 to S4, or SPOS, SNEG", side);
    PetscCall(SbImportGrow(a->deck.im, &a->nside, sizeof(one), &a->side));
    a->side[a->nside.n - 1] = one;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds one side of an element as a triangle of the surface's group. */
static PetscErrorCode use_side(SbAbaqus *a, const SbAbaqusSide *side, const SbDeckElement *e)
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
  if (SbGmshTypes[e->type].dim < 3)
    PetscFunctionReturn(PETSC_SUCCESS); /* of an element that is no tetrahedron */
  if (side->side > 3)
    SB_SCAN_ERROR(a->scan, "surface '%s' has side S%d of element %lld; a tetrahedron has S1 to S4",
                  a->surface[side->surface], side->side + 1, SbDeckShown(&a->deck, e->label));
  for (int k = 0; k < 3; k++)
    vert[k] = im->item[3].vert[4 * e->item + corners[side->side][k]];
  PetscCall(SbImportTagsAlone(im, 2, tag, NULL, &tags));
  PetscCall(SbImportAddItem(im, 2, vert, tags, SbDeckShown(&a->deck, e->label)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A keyword that is not followed and would change the mesh is an error; one that joins nodes, or
   changes the mesh during an analysis, is counted. */
static PetscErrorCode check_keyword(SbAbaqus *a)
{
  static const struct {
    const char *keyword, *parameter, *why;
  } refused[] = {
    {"*INCLUDE", NULL, "it needs INPUT=FILE on the same line"},
    {"*ELEMENT", "FILE", "the elements are in another file; put them behind the line"},
    {"*ELEMENT", "OFFSET", "supple knows no offset of nodes; write the elements without"},
    {"*NMAP", NULL, "it moves nodes; let Abaqus write the mapped ones"},
    {"*ADJUST", NULL, "it moves nodes; let Abaqus write the moved ones"},
    {"*IMPERFECTION", NULL, "it moves nodes; let Abaqus write the moved ones"},
    {"*IMPORT", NULL, "the mesh is that of another analysis; write its nodes and elements"},
    {"*SYMMETRIC MODEL GENERATION", NULL,
     "it makes nodes and elements; let Abaqus write those of the whole model"},
    {"*PARAMETER", NULL, "values of the file are formulas; write it with numbers"},
    {"*INSTANCE", "LIBRARY", "the mesh is that of another analysis; write its nodes and elements"},
    {"*INSTANCE", "INSTANCE", "the mesh is that of another analysis; write its nodes and elements"},
    {"*PARAMETER SHAPE VARIATION", NULL, "it moves nodes; let Abaqus write the moved ones"},
    {"*MODEL CHANGE", "REMOVE", "it takes elements away; write the mesh without them"},
    {"*MODEL CHANGE", "ADD", "it adds elements during the analysis; write the mesh that is meant"},
    {"*REFINE MESH", NULL, "it makes nodes and elements; write the mesh that CalculiX refined"},
    {"*SUBSTRUCTURE GENERATE", NULL, "the mesh becomes a matrix; write its nodes and elements"}};
  static const char *const said[] = {"*MODEL CHANGE",
                                     "*ADAPTIVE MESH",
                                     "*TIE",
                                     "*CLEARANCE",
                                     "*EMBEDDED ELEMENT",
                                     "*FASTENER",
                                     "*RIGID BODY",
                                     "*CYCLIC SYMMETRY MODEL",
                                     "*EQUATION",
                                     "*MPC",
                                     "*COUPLING",
                                     "*KINEMATIC COUPLING",
                                     "*CONTACT PAIR",
                                     "*PARTICLE GENERATOR",
                                     "*CRACK PROPAGATION",
                                     "*SHELL TO SOLID COUPLING"};

  const char *kind = SbAbaqusParameter(a, "TYPE");

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(refused); i++) {
    const char *parameter = refused[i].parameter;

    if (strcasecmp(a->keyword, refused[i].keyword) != 0 ||
        (parameter && !SbAbaqusParameter(a, parameter)))
      continue;

    // of contact pairs only
    if (!strcasecmp(a->keyword, "*MODEL CHANGE") && kind && !strncasecmp(kind, "CONTACT", 7))
      continue;
    a->scan->token = a->line;
    SB_SCAN_ERROR(a->scan, "%s%s%s: %s", refused[i].keyword, parameter ? " with " : "",
                  parameter ? parameter : "", refused[i].why);
  }

  // what joins or holds nodes, or changes the mesh while an analysis runs
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(said); i++)
    if (!strcasecmp(a->keyword, said[i]))
      PetscCall(SbImportSkip(a->deck.im, "%s", said[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Begins an instance, in place, with a number of its own. */
static PetscErrorCode begin_instance(SbAbaqus *a, const char *name)
{
  PetscInt k = a->ninstance.n;

  PetscFunctionBeginUser;
  if (k >= 1 << 19)
    SB_SCAN_ERROR(a->scan, "more than %d parts or instances", 1 << 19);
  if (find_instance(a, name, strlen(name)) >= 0)
    SB_SCAN_ERROR(a->scan, "a second part or instance '%.60s'; give it another name", name);
  PetscCall(SbImportGrow(a->deck.im, &a->ninstance, sizeof(*a->instance), &a->instance));
  a->instance[k] = (SbAbaqusPart){.text = NULL};
  (void)snprintf(a->instance[k].name, WORD, "%s", name);
  a->deck.nscope = k + 1;
  a->scope = (int64_t)k << SB_ABAQUS_SCOPE;
  if (strlen(name) + 2 > WORD)
    SB_SCAN_ERROR(a->scan, "the name '%.40s...' is longer than %d bytes", name, WORD - 2);
  (void)snprintf(a->prefix, WORD, "%s", name);
  SbAppend(WORD, a->prefix, ".");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outside all parts: labels of their own, nothing is moved. */
static PetscErrorCode begin_model(SbAbaqus *a)
{
  PetscFunctionBeginUser;
  a->prefix[0] = 0;
  a->scope = a->ninstance.n ? (int64_t)1 << 60 : 0;
  PetscCall(PetscArrayzero(a->t, 3));
  PetscCall(PetscArrayzero(a->o, 3));
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      a->R[i][j] = a->S[i][j] = i == j;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Place of an instance: a shift; on a second line two points of an axis, about which it is turned
   by an angle in degrees. */
static PetscErrorCode read_place(SbAbaqus *a)
{
  PetscReal shift[3] = {0, 0, 0};
  PetscReal turn[7] = {0};
  PetscReal length = 0;
  PetscReal e[3], c, s;

  PetscFunctionBeginUser;
  if (SbAbaqusDataLine(a)) {
    PetscCall(SbAbaqusReals(a, "a shift of the instance", 3, shift));
    if (SbAbaqusDataLine(a))
      PetscCall(SbAbaqusReals(a, "a rotation of the instance", 7, turn));
  }
  for (int i = 0; i < 3; i++)
    length += PetscSqr(turn[3 + i] - turn[i]);
  length = PetscSqrtReal(length);
  if (turn[6] != 0 && !(length > 0))
    SB_SCAN_ERROR(a->scan, "the two points of the axis of an instance are one");
  c = PetscCosReal(turn[6] * PETSC_PI / 180);
  s = PetscSinReal(turn[6] * PETSC_PI / 180);
  for (int i = 0; i < 3; i++)
    e[i] = length > 0 ? (turn[3 + i] - turn[i]) / length : 0;
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;

    a->R[i][i] = c + (1 - c) * e[i] * e[i];
    a->R[i][j] = (1 - c) * e[i] * e[j] - s * e[k];
    a->R[i][k] = (1 - c) * e[i] * e[k] + s * e[j];
  }

  // R (x + shift - p) + p
  for (int i = 0; i < 3; i++)
    a->t[i] = shift[i] - turn[i];
  affine((const PetscReal(*)[3])a->R, turn, a->t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the keyword ends the block that is read. */
static PetscBool ends(const SbAbaqus *a, const char *what)
{
  return (PetscBool)(!strncasecmp(a->keyword, "*END ", 5) && !strcasecmp(a->keyword + 5, what));
}

/* Reads the lines of a part, an instance or the whole model, up to the line *END PART or *END
   INSTANCE. */
static PetscErrorCode read_block(SbAbaqus *a)
{
  SbScan *s = a->scan;
  PetscBool known;

  PetscFunctionBeginUser;
  while (SbAbaqusNextLine(s)) {
    // data lines of ignored keywords
    if (*s->at != '*') {
      SbScanEndOfLine(s);
      continue;
    }
    SbAbaqusKeyword(a);
    PetscCall(check_keyword(a));
    PetscCall(SbAbaqusGenerate(a, &known));
    if (known)
      continue;
    if (!strcasecmp(a->keyword, "*NODE"))
      PetscCall(read_nodes(a));
    else if (!strcasecmp(a->keyword, "*SYSTEM"))
      PetscCall(read_system(a));
    else if (!strcasecmp(a->keyword, "*ELEMENT"))
      PetscCall(read_elements(a));
    else if (!strcasecmp(a->keyword, "*NSET") || !strcasecmp(a->keyword, "*ELSET"))
      PetscCall(read_set(a, (PetscBool)!strcasecmp(a->keyword, "*NSET")));
    else if (!strcasecmp(a->keyword, "*SURFACE"))
      PetscCall(read_surface(a));
    else if (!strcasecmp(a->keyword, "*PART") || !strcasecmp(a->keyword, "*INSTANCE")) {
      // one that has no end ends where the next one begins
      if (a->prefix[0])
        s->at = a->line;
      break;
    } else if (ends(a, "PART") || ends(a, "INSTANCE"))
      break;
    else
      SbScanEndOfLine(s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Behind the line *PART: keeps its place, or reads it where there are no instances. */
static PetscErrorCode read_part(SbAbaqus *a)
{
  const char *name = SbAbaqusParameter(a, "NAME");
  SbAbaqusPart part = {.name = ""};

  PetscFunctionBeginUser;
  (void)snprintf(part.name, WORD, "%s", name ? name : "");
  SbScanEndOfLine(a->scan);
  part.text = a->scan->at;
  if (!a->instances) {
    PetscCall(begin_instance(a, part.name));
    PetscCall(read_block(a));
    PetscCall(begin_model(a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbImportGrow(a->deck.im, &a->npart, sizeof(part), &a->part));
  a->part[a->npart.n - 1] = part;
  while (SbAbaqusNextLine(a->scan)) {
    if (*a->scan->at == '*') {
      SbAbaqusKeyword(a);
      if (!strcasecmp(a->keyword, "*PART"))
        a->scan->at = a->line;
      if (ends(a, "PART") || !strcasecmp(a->keyword, "*PART"))
        break;
    }
    SbScanEndOfLine(a->scan);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Behind the line *INSTANCE: reads its part at its place, then what is in the instance itself. */
static PetscErrorCode read_instance(SbAbaqus *a)
{
  const char *name = SbAbaqusParameter(a, "NAME");
  const char *part = SbAbaqusParameter(a, "PART");
  const char *at;
  PetscInt k = 0;

  PetscFunctionBeginUser;
  PetscCall(begin_instance(a, name ? name : ""));
  while (k < a->npart.n && (!part || strcasecmp(a->part[k].name, part) != 0))
    k++;
  if (part && k == a->npart.n)
    SB_SCAN_ERROR(a->scan, "an instance of the part '%.60s', which no line above gives", part);
  PetscCall(read_place(a));
  at = a->scan->at;
  if (k < a->npart.n) {
    a->scan->at = a->part[k].text;
    PetscCall(read_block(a));
  }
  a->scan->at = at;
  PetscCall(read_block(a));
  PetscCall(begin_model(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a line of the file begins with *INSTANCE. */
static PetscBool has_instances(const SbScan *s)
{
  for (const char *p = s->data; p && p < s->end;) {
    if (!strncasecmp(p, "*INSTANCE", 9))
      return PETSC_TRUE;
    p = (const char *)memchr(p, '\n', (size_t)(s->end - p));
    p = p ? p + 1 : NULL;
  }
  return PETSC_FALSE;
}

/* Name without its instance, or all of it. */
static const char *bare(const SbAbaqus *a, const char *name)
{
  const char *dot = strchr(name, '.');

  return dot && find_instance(a, name, (size_t)(dot - name)) >= 0 ? dot + 1 : name;
}

/* Drops the instance from names of sets and surfaces that stay different without it. */
static void shorten_names(SbAbaqus *a)
{
  SbDeck *d = &a->deck;

  for (PetscInt i = 0; i < d->nset.n + a->nsurface.n; i++) {
    char *name = i < d->nset.n ? d->set[i].name : a->surface[i - d->nset.n];
    const char *alone = bare(a, name);
    PetscBool other = PETSC_FALSE;

    for (PetscInt k = 0; k < d->nset.n + a->nsurface.n && alone > name && !other; k++) {
      const char *its = k < d->nset.n ? d->set[k].name : a->surface[k - d->nset.n];
      const PetscBool set = (PetscBool)(i < d->nset.n);
      const PetscBool kind =
        (PetscBool)(set == (k < d->nset.n) && (!set || d->set[i].of_nodes == d->set[k].of_nodes));

      other = (PetscBool)(k != i && kind && !strcasecmp(bare(a, its), alone));
    }
    if (!other)
      memmove(name, alone, strlen(alone) + 1);
  }
}

/* Adds what refers to elements that are known only now: nodes of sets of elements, and a set of
   the elements of each of several instances. */
static PetscErrorCode finish_sets(SbAbaqus *a)
{
  SbDeck *d = &a->deck;
  PetscInt set;

  PetscFunctionBeginUser;
  for (PetscInt p = 0; p < a->npair.n; p++) {
    PetscCall(SbDeckFind(d, a->pair[p][1]));
    for (PetscInt i = 0; i < d->nfound.n; i++) {
      const SbDeckElement *e = &d->element[d->found[i]];

      for (int k = 0; k < PetscMin(10, SbGmshTypes[e->type].nnode); k++)
        PetscCall(SbDeckAddRange(d, a->pair[p][0], -1, e->node[k], e->node[k], 1));
    }
  }
  for (PetscInt k = 0; k < a->ninstance.n && a->ninstance.n > 1; k++) {
    const int64_t scope = (int64_t)k << SB_ABAQUS_SCOPE;

    if (!a->instance[k].name[0])
      continue;
    PetscCall(SbDeckFindSet(d, PETSC_FALSE, a->instance[k].name, &set));
    PetscCall(SbDeckAddRange(d, set, -1, scope, scope + INT32_MAX, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Abaqus(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  SbAbaqus a = {.scan = s,
                .deck = {.im = im,
                         .compare = strcasecmp,
                         .cure = "renumber them",
                         .unique = PETSC_TRUE,
                         .mask = ((int64_t)1 << SB_ABAQUS_SCOPE) - 1}};
  SbDeck *d = &a.deck;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  PetscCall(SbImportExpand(im, path, PETSC_FALSE, SbAbaqusIncluded));
  a.instances = has_instances(s);
  PetscCall(begin_model(&a));
  do {
    a.keyword[0] = 0;
    PetscCall(read_block(&a));
    if (!strcasecmp(a.keyword, "*PART"))
      PetscCall(read_part(&a));
    else if (!strcasecmp(a.keyword, "*INSTANCE"))
      PetscCall(read_instance(&a));
    else
      SbScanEndOfLine(s);
  } while (s->at < s->end);

  // find the nodes of elements and sets
  s->token = s->end;
  if (!im->nvert)
    SB_SCAN_ERROR(s, "there is no *NODE in it; this is no input file of Abaqus");
  PetscCall(finish_sets(&a));
  shorten_names(&a);
  PetscCall(SbDeckBuild(&a.deck));
  for (PetscInt v = 0; v < im->nvert; v++)
    im->vert_number[v] = SbDeckShown(d, im->vert_number[v]);

  // convert element sides to triangles
  for (PetscInt k = 0; k < a.nside.n; k++) {
    const SbAbaqusSide *side = &a.side[k];
    const PetscInt e = SbNumbersFind(&im->elements, side->element);
    const PetscBool one = (PetscBool)(side->set < 0);

    if (!one)
      PetscCall(SbDeckFind(d, side->set));
    s->token = side->at;
    if (one && e < 0)
      SB_SCAN_ERROR(s, "surface '%s' has a side of element %lld, which is not there",
                    a.surface[side->surface], SbDeckShown(d, side->element));
    for (PetscInt i = 0; i < (one ? 1 : d->nfound.n); i++)
      PetscCall(use_side(&a, side, &d->element[one ? e : d->found[i]]));
  }
  PetscCall(SbImportJoinGroups(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
