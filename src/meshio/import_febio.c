/*
  import_febio.c - reader of FEBio's input files, .feb, versions 1.2 to 4.0 (FEBio User's Manual,
  "Geometry" and "Mesh" sections; also written by PreView, FEBio Studio and GIBBON).

  Read: Nodes, Elements, NodeSet, Surface and ElementSet of the section Geometry (1.2, 2.0, 2.5) or
  Mesh (3.0, 4.0), and the names of materials. Each Elements with a name (2.0: elset) is a group of
  that name; without one the elements are a group by the number of their material, with the name of
  that. Sets become groups of their names. In version 1.2 the tags within Elements are the types
  (<tet4 id="1" mat="1">), later they are all <elem>. Sets list <node id="1"/> or <n id="1"/>, or
  hold numbers between commas, with first:last:step.

  The nodes of a tet10 have Abaqus' order. Those of a tet15 in its faces and its middle are left
  out. Sections of materials, loads, contact and steps, and sets without nodes or elements (edges,
  discrete sets, pairs of surfaces, data of elements) are skipped and counted. Errors: parts and
  instances of 2.5, meshes in other files.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "meshio_impl.h"

/* A facet of a surface. */
typedef struct {
  PetscInt surface;
  int64_t node[3];
  const char *at;
} Facet;

typedef struct {
  SbDeck deck;
  SbXml xml;
  SbScan *scan;
  SbCount nsurface, nfacet, nmaterial;
  char (*surface)[SB_GROUP_MAX];
  Facet *facet; /* [nfacet] */
  struct {
    int64_t number;
    char name[SB_GROUP_MAX];
  } * material;         /* [nmaterial] */
  PetscInt nface_nodes; /* nodes of tet15 that are left out */
} FEBio;

/* Types of elements, by the beginning of their name in any case; gmsh's types. */
static const struct {
  const char *name;
  int type, nnode;
} types[] = {{"tet4", SB_GMSH_TET, 4},
             {"ut4", SB_GMSH_TET, 4},
             {"tet10", SB_GMSH_TET10, 10},
             {"tet15", SB_GMSH_TET10, 15},
             {"tet20", 29, 20},
             {"hex8", 5, 8},
             {"hex20", 17, 20},
             {"hex27", 12, 27},
             {"penta6", 6, 6},
             {"penta15", 18, 15},
             {"pyra5", 7, 5},
             {"pyra13", 19, 13},
             {"tri3", SB_GMSH_TRIANGLE, 3},
             {"tri6", SB_GMSH_TRIANGLE6, 6},
             {"tri7", SB_GMSH_TRIANGLE6, 7},
             {"tri10", 21, 10},
             {"quad4", 3, 4},
             {"q4", 3, 4},
             {"quad8", 16, 8},
             {"quad9", 10, 9},
             {"truss2", SB_GMSH_LINE, 2},
             {"line2", SB_GMSH_LINE, 2},
             {"line3", SB_GMSH_LINE3, 3},
             {"beam2", SB_GMSH_LINE, 2},
             {"beam3", SB_GMSH_LINE3, 3}};

/* Row of types[] for a name as "TET10G4". */
static PetscErrorCode find_type(FEBio *f, const char *name, int *k)
{
  PetscFunctionBeginUser;
  for (*k = 0; *k < (int)PETSC_STATIC_ARRAY_LENGTH(types); ++*k) {
    const size_t n = strlen(types[*k].name);

    if (!strncasecmp(name, types[*k].name, n) && !isdigit((unsigned char)name[n]))
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  SB_SCAN_ERROR(f->scan,
                "elements of type '%.24s', which supple does not know; it takes tet4, "
                "tet10 and tet15, and tri3, tri6 for surfaces",
                name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an attribute that is a positive whole number; 0: it is not there. */
static PetscErrorCode number_of(FEBio *f, const char *name, PetscBool needed, int64_t *number)
{
  char value[64], *end;

  PetscFunctionBeginUser;
  (void)SbXmlAttribute(&f->xml, name, sizeof(value), value);
  *number = strtoll(value, &end, 10);
  if (value[0] && (*end || *number < 1 || *number > (int64_t)1 << 40))
    SB_SCAN_ERROR(f->scan, "expected a number from 1 on, found %s=\"%.24s\"", name, value);
  if (needed && !value[0])
    SB_SCAN_ERROR(f->scan, "the element %s has no %s=\"...\"", f->xml.name, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Name of the element of the file that begins, or another attribute. */
static PetscErrorCode name_of(FEBio *f, const char *key, char name[SB_GROUP_MAX])
{
  char long_name[2 * SB_GROUP_MAX];

  PetscFunctionBeginUser;
  (void)SbXmlAttribute(&f->xml, key, sizeof(long_name), long_name);
  if (strlen(long_name) >= SB_GROUP_MAX)
    SB_SCAN_ERROR(f->scan, "the name '%.40s...' is longer than %d bytes", long_name,
                  SB_GROUP_MAX - 1);
  memcpy(name, long_name, strlen(long_name) + 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The beginning of a text, on one line, for messages. */
static const char *excerpt(const char *p, const char *end, char text[25])
{
  (void)snprintf(text, 25, "%.*s", (int)PetscMin(24, end - p), p);
  SbCleanName(text, ' ');
  return text;
}

/* Next number of a list between commas or blanks; false at its end. Advances *at. */
static PetscErrorCode next_number(FEBio *f, const char **at, const char *end, const char *what,
                                  int64_t *number, PetscBool *more)
{
  const char *p = *at;
  char found[25];
  char *after;

  PetscFunctionBeginUser;
  while (p < end && (isspace((unsigned char)*p) || *p == ','))
    p++;
  *more = (PetscBool)(p < end);
  *at = p;
  if (p >= end)
    PetscFunctionReturn(PETSC_SUCCESS);
  *number = strtoll(p, &after, 10);
  f->scan->token = p;
  if (after == p || after > end || *number < 1 || *number > (int64_t)1 << 40 ||
      (after < end && *after != ',' && *after != ':' && !isspace((unsigned char)*after)))
    SB_SCAN_ERROR(f->scan, "expected the number of %s, found '%s'", what, excerpt(p, end, found));
  *at = after;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the text of an element to its end tag; it may hold no others. */
static PetscErrorCode read_text(FEBio *f, const char **text, const char **end)
{
  char name[SB_NAME_MAX];
  PetscBool more;

  PetscFunctionBeginUser;
  memcpy(name, f->xml.name, sizeof(name));
  PetscCall(SbXmlNext(&f->xml, &more));
  if (f->xml.opens)
    SB_SCAN_ERROR(f->scan, "an element %s within an element %s", f->xml.name, name);
  *text = f->xml.text;
  *end = f->xml.text_end;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node: three coordinates between commas. */
static PetscErrorCode read_node(FEBio *f)
{
  static const char *const places[3] = {"first", "second", "third"};
  const char *text, *end;
  char found[25];
  int64_t label;
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(number_of(f, "id", PETSC_TRUE, &label));
  PetscCall(SbDeckAddNode(&f->deck, label, &x));
  PetscCall(read_text(f, &text, &end));
  for (int i = 0; i < 3; i++) {
    char *after;

    while (text < end && (isspace((unsigned char)*text) || (i && *text == ',')))
      text++;
    x[i] = strtod(text, &after);
    f->scan->token = text;
    if (text >= end || after == text || after > end || !isfinite(x[i]))
      SB_SCAN_ERROR(f->scan, "expected three coordinates of node %lld, found '%s' as the %s",
                    (long long)label, excerpt(text, end, found), places[i]);
    text = after;
  }
  while (text < end && isspace((unsigned char)*text))
    text++;
  if (text < end)
    SB_SCAN_ERROR(f->scan, "node %lld has more than three coordinates", (long long)label);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the nodes of an element or facet into node[10]. */
static PetscErrorCode read_connectivity(FEBio *f, const char *what, int64_t label, int k,
                                        int64_t node[10])
{
  const char *text, *end;
  PetscBool more = PETSC_TRUE;
  int n = 0;

  PetscFunctionBeginUser;
  PetscCall(read_text(f, &text, &end));
  while (more) {
    int64_t v = 0;

    PetscCall(next_number(f, &text, end, "a node", &v, &more));
    if (more && n < 10)
      node[n] = v;
    n += more;
  }
  if (n != types[k].nnode)
    SB_SCAN_ERROR(f->scan, "%s %lld has %d nodes; one of type %s has %d", what, (long long)label, n,
                  types[k].name, types[k].nnode);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements of one part. */
static PetscErrorCode read_elements(FEBio *f)
{
  const int depth = f->xml.depth;
  char name[SB_GROUP_MAX], type[SB_GROUP_MAX];
  int64_t material;
  int kind = -1;
  PetscInt set = -1;
  PetscBool more;

  PetscFunctionBeginUser;
  PetscCall(name_of(f, "name", name));
  if (!name[0])
    PetscCall(name_of(f, "elset", name));
  PetscCall(name_of(f, "type", type));
  PetscCall(number_of(f, "mat", PETSC_FALSE, &material));
  if (type[0])
    PetscCall(find_type(f, type, &kind));
  if (name[0])
    PetscCall(SbDeckFindSet(&f->deck, PETSC_FALSE, name, &set));
  for (;;) {
    SbDeckElement e = {.at = f->scan->token};
    int k = kind;

    PetscCall(SbXmlNext(&f->xml, &more));
    if (f->xml.depth < depth)
      break;
    e.at = f->scan->token;
    if (k < 0)
      PetscCall(find_type(f, f->xml.name, &k));
    else if (strcmp(f->xml.name, "elem") != 0 && strcmp(f->xml.name, "e") != 0)
      SB_SCAN_ERROR(f->scan, "an element %s in Elements; expected elem", f->xml.name);
    e.type = types[k].type;
    PetscCall(number_of(f, "id", PETSC_TRUE, &e.label));
    PetscCall(number_of(f, "mat", PETSC_FALSE, &e.property));
    if (!e.property)
      e.property = material;
    if (!e.property || set >= 0)
      e.property = -1;
    PetscCall(read_connectivity(f, "element", e.label, k, e.node));
    f->nface_nodes += types[k].nnode == 15 && e.type == SB_GMSH_TET10 ? 5 : 0;
    f->scan->token = e.at;
    PetscCall(SbDeckAddElement(&f->deck, &e));
    if (set >= 0)
      PetscCall(SbDeckAddRange(&f->deck, set, -1, e.label, e.label, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the numbers in a text, as 1,2,5:9,20:30:2. */
static PetscErrorCode add_numbers(FEBio *f, PetscInt set, const char *text, const char *end)
{
  const char *what = f->deck.set[set].of_nodes ? "a node" : "an element";
  PetscBool more = PETSC_TRUE;

  PetscFunctionBeginUser;
  while (more) {
    int64_t range[3] = {0, 0, 1};
    PetscBool another;
    int n = 1;

    PetscCall(next_number(f, &text, end, what, &range[0], &more));
    range[1] = range[0];
    for (; more && n < 3 && text < end && *text == ':'; n++) {
      text++;
      PetscCall(next_number(f, &text, end, what, &range[n], &another));
      if (!another)
        SB_SCAN_ERROR(f->scan, "a range of numbers without its end");
    }
    if (more && text < end && *text == ':')
      SB_SCAN_ERROR(f->scan, "a range of more than first:last:step");
    if (more && range[1] < range[0])
      SB_SCAN_ERROR(f->scan, "a range from %lld to %lld; it is empty", (long long)range[0],
                    (long long)range[1]);
    if (more)
      PetscCall(SbDeckAddRange(&f->deck, set, -1, range[0], range[1], range[2]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A NodeSet or ElementSet. */
static PetscErrorCode read_set(FEBio *f, PetscBool of_nodes)
{
  static const char *const members[2][2] = {{"elem", "e"}, {"node", "n"}};
  static const char *const others[2][2] = {{"ElementSet", "elem_set"}, {"NodeSet", "node_set"}};
  const int depth = f->xml.depth;
  char name[SB_GROUP_MAX];
  int64_t label;
  PetscInt set, other;
  PetscBool more;

  PetscFunctionBeginUser;
  PetscCall(name_of(f, "name", name));
  if (!name[0])
    SB_SCAN_ERROR(f->scan, "a %s without a name", f->xml.name);
  PetscCall(SbDeckFindSet(&f->deck, of_nodes, name, &set));
  for (;;) {
    PetscCall(SbXmlNext(&f->xml, &more));
    PetscCall(add_numbers(f, set, f->xml.text, f->xml.text_end));
    if (f->xml.depth < depth)
      break;
    f->scan->token = f->xml.begin;
    if (!f->xml.opens)
      continue;
    if (!strcmp(f->xml.name, members[of_nodes][0]) || !strcmp(f->xml.name, members[of_nodes][1])) {
      PetscCall(number_of(f, "id", PETSC_TRUE, &label));
      PetscCall(SbDeckAddRange(&f->deck, set, -1, label, label, 1));
    } else if (!strcmp(f->xml.name, others[of_nodes][0])) {
      PetscCall(name_of(f, others[of_nodes][1], name));
      PetscCall(SbDeckFindSet(&f->deck, of_nodes, name, &other));
      PetscCall(SbDeckAddRange(&f->deck, set, other, 0, 0, 1));
    } else if (strcmp(f->xml.name, "node_list") != 0 && strcmp(f->xml.name, "elem_list") != 0)
      SB_SCAN_ERROR(f->scan, "an element %s in the set '%s', which supple does not know",
                    f->xml.name, f->deck.set[set].name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A Surface: facets by their nodes, of which the corners count. */
static PetscErrorCode read_surface(FEBio *f)
{
  const int depth = f->xml.depth;
  char name[SB_GROUP_MAX];
  PetscInt at = 0;
  PetscBool more;

  PetscFunctionBeginUser;
  PetscCall(name_of(f, "name", name));
  if (!name[0])
    SB_SCAN_ERROR(f->scan, "a Surface without a name");

  // surfaces of one name are one
  while (at < f->nsurface.n && strcmp(f->surface[at], name) != 0)
    at++;
  if (at == f->nsurface.n) {
    PetscCall(SbImportGrow(f->deck.im, &f->nsurface, sizeof(*f->surface), &f->surface));
    memcpy(f->surface[at], name, sizeof(name));
  }
  for (;;) {
    Facet facet = {.surface = at};
    int64_t node[10], label;
    int k;

    PetscCall(SbXmlNext(&f->xml, &more));
    if (f->xml.depth < depth)
      break;
    facet.at = f->scan->token;
    PetscCall(find_type(f, f->xml.name, &k));
    PetscCall(number_of(f, "id", PETSC_FALSE, &label));
    if (types[k].type != SB_GMSH_TRIANGLE && types[k].type != SB_GMSH_TRIANGLE6)
      SB_SCAN_ERROR(f->scan,
                    "surface '%s' has a facet of type %s; those of tetrahedra are tri3, "
                    "tri6 and tri7",
                    f->surface[facet.surface], types[k].name);
    PetscCall(read_connectivity(f, "facet", label, k, node));
    PetscCall(PetscArraycpy(facet.node, node, 3));
    PetscCall(SbImportGrow(f->deck.im, &f->nfacet, sizeof(facet), &f->facet));
    f->facet[f->nfacet.n - 1] = facet;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesh, or a part of it, in another file is an error. */
static PetscErrorCode check_from(FEBio *f)
{
  char from[SB_GROUP_MAX];

  PetscFunctionBeginUser;
  PetscCall(name_of(f, "from", from));
  if (from[0])
    SB_SCAN_ERROR(f->scan,
                  "%s is in another file, '%.60s'; name that one, or put all into one file",
                  f->xml.name, from);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lengths are taken as m; others are said. */
static void read_units(FEBio *f)
{
  static const struct {
    const char *name;
    double length; /* m */
  } units[] = {{"mm-N-s", 1e-3}, {"mm-kg-s", 1e-3}, {"um-nN-s", 1e-6}, {"CGS", 1e-2}};
  char name[16] = "";

  (void)SbXmlAttribute(&f->xml, "units", sizeof(name), name);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(units); i++)
    if (!strcasecmp(name, units[i].name))
      SbImportRemark(f->deck.im, "lengths are in units of %g m, taken as m: give this as scale",
                     units[i].length);
}

/* The section Geometry or Mesh. */
static PetscErrorCode read_mesh(FEBio *f)
{
  const int depth = f->xml.depth;
  PetscBool more;

  PetscFunctionBeginUser;
  PetscCall(check_from(f));
  for (;;) {
    PetscCall(SbXmlNext(&f->xml, &more));
    if (f->xml.depth < depth)
      break;
    if (!f->xml.opens)
      continue;
    if (f->xml.depth == depth + 1)
      PetscCall(check_from(f));
    if (!strcmp(f->xml.name, "Part") || !strcmp(f->xml.name, "Instance"))
      SB_SCAN_ERROR(f->scan,
                    "%s moves nodes in a way that supple does not know; let FEBio Studio "
                    "write the file again",
                    f->xml.name);
    if (!strcmp(f->xml.name, "Nodes"))
      continue;
    if (!strcmp(f->xml.name, "node") && f->xml.depth == depth + 2)
      PetscCall(read_node(f));
    else if (!strcmp(f->xml.name, "Elements"))
      PetscCall(read_elements(f));
    else if (!strcmp(f->xml.name, "NodeSet") || !strcmp(f->xml.name, "ElementSet"))
      PetscCall(read_set(f, (PetscBool)!strcmp(f->xml.name, "NodeSet")));
    else if (!strcmp(f->xml.name, "Surface"))
      PetscCall(read_surface(f));
    else {
      PetscCall(SbImportSkip(f->deck.im, "%.40s", f->xml.name));
      PetscCall(SbXmlSkip(&f->xml));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names of materials; the rest of that section is skipped. */
static PetscErrorCode read_materials(FEBio *f)
{
  const int depth = f->xml.depth;
  PetscBool more;

  PetscFunctionBeginUser;
  for (;;) {
    int64_t number;

    PetscCall(SbXmlNext(&f->xml, &more));
    if (f->xml.depth < depth)
      break;
    if (!f->xml.opens || strcmp(f->xml.name, "material") != 0 || f->xml.depth > depth + 1)
      continue;
    PetscCall(number_of(f, "id", PETSC_FALSE, &number));
    PetscCall(SbImportGrow(f->deck.im, &f->nmaterial, sizeof(*f->material), &f->material));
    f->material[f->nmaterial.n - 1].number = number;
    PetscCall(name_of(f, "name", f->material[f->nmaterial.n - 1].name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the facets as triangles of their surfaces. */
static PetscErrorCode use_facets(FEBio *f)
{
  SbImport *im = f->deck.im;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < f->nfacet.n; k++) {
    const Facet *facet = &f->facet[k];
    PetscInt vert[3], group, tags;

    f->scan->token = facet->at;
    for (int i = 0; i < 3; i++) {
      vert[i] = SbNumbersFind(&im->nodes, facet->node[i]);
      if (vert[i] < 0)
        SB_SCAN_ERROR(f->scan, "surface '%s' uses node %lld, which is not there",
                      f->surface[facet->surface], (long long)facet->node[i]);
    }

    PetscCall(SbImportGroup(im, 2, SB_DECK_TAG + f->deck.nset.n + facet->surface,
                            f->surface[facet->surface], &group));
    PetscCall(SbImportTagsAlone(im, 2, SB_DECK_TAG + f->deck.nset.n + facet->surface, NULL, &tags));
    PetscCall(SbImportAddItem(im, 2, vert, tags, k + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_FEBio(const char *path, SbImport *im)
{
  static const char *const silent[] = {"Module", "Control",  "Globals",
                                       "Output", "LoadData", "MeshDomains"};
  FEBio f = {.scan = &im->scan,
             .xml = {.scan = &im->scan},
             .deck = {.im = im,
                      .compare = strcmp,
                      .cure = "renumber them",
                      .unique = PETSC_TRUE,
                      .strict = PETSC_TRUE}};
  PetscBool more;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, f.scan));
  PetscCall(SbXmlNext(&f.xml, &more));
  if (!more || strcmp(f.xml.name, "febio_spec") != 0)
    SB_SCAN_ERROR(f.scan, "expected an element febio_spec; this is no input file of FEBio");
  read_units(&f);
  for (;;) {
    PetscBool said = PETSC_TRUE;

    PetscCall(SbXmlNext(&f.xml, &more));
    if (!more || !f.xml.depth)
      break;
    if (!f.xml.opens)
      continue;
    if (!strcmp(f.xml.name, "Geometry") || !strcmp(f.xml.name, "Mesh")) {
      PetscCall(read_mesh(&f));
      continue;
    }
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(silent); i++)
      said = (PetscBool)(said && strcmp(f.xml.name, silent[i]) != 0);
    if (said)
      PetscCall(SbImportSkip(im, "section %.40s", f.xml.name));
    if (!strcmp(f.xml.name, "Material"))
      PetscCall(read_materials(&f));
    else
      PetscCall(SbXmlSkip(&f.xml));
  }
  f.scan->token = f.scan->end;
  if (!im->nvert)
    SB_SCAN_ERROR(f.scan, "there are no nodes in it, in a section Geometry or Mesh");
  PetscCall(SbDeckBuild(&f.deck));
  PetscCall(use_facets(&f));
  PetscCall(SbImportJoinGroups(im));
  for (PetscInt i = 0; i < f.nmaterial.n; i++)
    for (PetscInt dim = 1; dim < 4 && f.material[i].name[0]; dim++)
      SbImportNameGroup(im, dim, f.material[i].number, f.material[i].name);
  if (f.nface_nodes)
    SbImportRemark(im, "tet15 taken as tet10: nodes in their faces and middles are left out");
  PetscFunctionReturn(PETSC_SUCCESS);
}
