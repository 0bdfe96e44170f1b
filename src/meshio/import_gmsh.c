/*
  import_gmsh.c - reader of gmsh's .msh files: versions 1, 2 (2.0 to 2.2), 4.0 and 4.1, text and
  binary (gmsh reference manual, "File formats" and "Legacy formats"). Groups may overlap.

  Version 4 assigns groups to entities of the geometry, any number to each. Versions 1 and 2 assign
  one to each element and repeat it for each further group: repeated elements are merged, their
  groups joined.

  Kept: points, lines and triangles that belong to a group, and all tets; for a surface all
  triangles, and tets are optional. Other sections are skipped. Errors: other volume elements than
  4- and 10-node tets, partitions.
*/
#include "meshio_impl.h"

/* Entity of the geometry in a file of version 4. */
typedef struct {
  PetscInt dim, tags;
  int64_t tag;
} Entity;

typedef struct {
  SbImport *im;
  int version; /* file version: 1, 2, 40 or 41 */
  PetscBool binary;
  PetscBool parametric;    /* section $ParametricNodes of version 2 */
  PetscBool entities_read; /* $Entities is read */
  PetscInt nentity;
  Entity *entity; /* [nentity] */
  SbCount nname;
  struct {
    int64_t tag;
    char name[SB_GROUP_MAX];
  } * name; /* [nname] names of version 2.0, which say no dimension */
} Gmsh;

static PetscErrorCode read_format(Gmsh *g)
{
  static const struct {
    const char *name;
    int version;
  } versions[] = {{"2", 2},  {"2.0", 2},  {"2.1", 2}, {"2.2", 2},
                  {"4", 40}, {"4.0", 40}, {"4.1", 41}};
  SbScan *s = &g->im->scan;
  char version[16];
  int64_t kind, size, one;

  PetscFunctionBeginUser;
  (void)SbScanWord(s, sizeof(version), version);
  g->version = 0;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(versions); i++)
    if (!strcmp(version, versions[i].name))
      g->version = versions[i].version;
  if (!g->version)
    SB_SCAN_ERROR(
      s, "format version '%s'; supple reads 1 to 4.1 (gmsh FILE -save -format msh41 converts)",
      version);
  PetscCall(SbScanText(s, "file type 0 or 1", &kind));
  PetscCall(SbScanText(s, "data size", &size));
  if (kind != 0 && kind != 1)
    SB_SCAN_ERROR(s, "file type %lld; expected 0 (text) or 1 (binary)", (long long)kind);
  if (size != 8)
    SB_SCAN_ERROR(s, "data size %lld; expected 8", (long long)size);
  g->binary = (PetscBool)(kind == 1);
  if (!g->binary)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbScanEndOfLine(s);
  s->binary = s->bytes = PETSC_TRUE;
  PetscCall(SbScanInt(s, 4, "number one in binary", &one));
  s->swap = (PetscBool)(one == 0x01000000);
  if (one != 1 && !s->swap)
    SB_SCAN_ERROR(s, "expected the number one in binary, found %lld; the file is damaged",
                  (long long)one);
  s->binary = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the names of groups, text also in binary files. */
static PetscErrorCode read_names(Gmsh *g)
{
  SbScan *s = &g->im->scan;
  int64_t n, dim, tag;
  PetscInt group;
  char name[SB_GROUP_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbScanCount(s, "physical names", 6, 6, &n));
  for (int64_t i = 0; i < n; i++) {
    PetscCall(SbScanText(s, "dimension of a physical name", &dim));
    SbScanNext(s);
    if (s->at < s->end && *s->at == '"' && g->version == 2) {
      PetscCall(SbScanQuoted(s, "physical name in quotes", sizeof(name), name));
      PetscCall(SbImportGrow(g->im, &g->nname, sizeof(*g->name), &g->name));
      g->name[g->nname.n - 1].tag = dim;
      (void)snprintf(g->name[g->nname.n - 1].name, sizeof(name), "%s", name);
      continue;
    }
    if (dim < 0 || dim > 3)
      SB_SCAN_ERROR(s, "dimension %lld of a physical name; expected 0 to 3", (long long)dim);
    PetscCall(SbScanText(s, "number of a physical name", &tag));
    PetscCall(SbScanQuoted(s, "physical name in quotes", sizeof(name), name));
    PetscCall(SbImportGroup(g->im, (PetscInt)dim, tag, name, &group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the entities of each dimension: tag, bounding box, physical groups, bounding entities. */
static PetscErrorCode read_entities(Gmsh *g)
{
  SbScan *s = &g->im->scan;
  int64_t count[4];
  int64_t total = 0;
  int64_t n, tag;
  PetscInt *group = NULL;
  PetscReal box;

  PetscFunctionBeginUser;
  if (g->entities_read)
    SB_SCAN_ERROR(s, "second section $Entities");
  g->entities_read = PETSC_TRUE;
  for (int d = 0; d < 4; d++) {
    PetscCall(SbScanCount(s, "entities", 10, 28, &count[d]));
    total += count[d];
  }
  PetscCall(SbImportScratch(g->im, (size_t)total * sizeof(*g->entity), &g->entity));
  for (int d = 0; d < 4; d++) {
    for (int64_t i = 0; i < count[d]; i++) {
      Entity *e = &g->entity[g->nentity++];

      e->dim = d;
      PetscCall(SbScanInt(s, 4, "number of an entity", &e->tag));
      for (int k = 0; k < (d || g->version == 40 ? 6 : 3); k++)
        PetscCall(SbScanReal(s, "extent of an entity", 0, &box));

      // physical groups; the sign of a tag is the orientation, which is ignored
      PetscCall(SbScanCount(s, "physical groups of an entity", 2, 4, &n));
      if (n)
        PetscCall(SbImportScratch(g->im, (size_t)n * sizeof(*group), &group));
      for (int64_t k = 0; k < n; k++) {
        PetscCall(SbScanInt(s, 4, "physical group of an entity", &tag));
        PetscCall(SbImportGroup(g->im, d, tag < 0 ? -tag : tag, NULL, &group[k]));
      }
      PetscCall(SbImportTagSet(g->im, (PetscInt)n, group, &e->tags));
      if (!d)
        continue;
      PetscCall(SbScanCount(s, "bounding entities", 2, 4, &n));
      for (int64_t k = 0; k < n; k++)
        PetscCall(SbScanInt(s, 4, "bounding entity", &tag));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the numbers of blocks and of nodes or elements; before version 4 there is one block, and
   the number is text also in a binary file. */
static PetscErrorCode read_totals(Gmsh *g, const char *what, int64_t *nblock, int64_t *n)
{
  SbScan *s = &g->im->scan;
  int64_t bound;

  PetscFunctionBeginUser;
  *nblock = 1;
  if (g->version > 2) {
    PetscCall(SbScanInt(s, 8, "number of blocks", nblock));
    PetscCall(SbScanInt(s, 8, what, n));
    for (int k = 0; k < 2 && g->version == 41; k++)
      PetscCall(SbScanInt(s, 8, "bound of numbers", &bound));
  } else {
    PetscCall(SbScanText(s, what, n));
    if (g->binary)
      SbScanEndOfLine(s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the header of a block: entity, kind (nodes: parametric or not; elements: type), number. */
static PetscErrorCode read_block(Gmsh *g, int64_t *dim, int64_t *tag, int64_t *kind, int64_t *n)
{
  SbScan *s = &g->im->scan;

  PetscFunctionBeginUser;
  if (g->version == 40)
    PetscCall(SbScanInt(s, 4, "entity of a block", tag));
  PetscCall(SbScanInt(s, 4, "dimension of a block", dim));
  if (g->version == 41)
    PetscCall(SbScanInt(s, 4, "entity of a block", tag));
  PetscCall(SbScanInt(s, 4, "mark of parametric nodes, or type of elements", kind));
  PetscCall(SbScanInt(s, 8, "number of nodes or elements in a block", n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads tag and coordinates of each node; in version 4 in blocks, perhaps with parametric
   coordinates; in 4.1 all tags of a block come first. */
static PetscErrorCode read_nodes(Gmsh *g)
{
  SbImport *im = g->im;
  SbScan *s = &im->scan;
  int64_t nblock, n;
  int64_t dim = 0;
  int64_t tag = 0;
  int64_t parametric = 0;
  PetscInt v = 0;
  PetscReal parameter;

  PetscFunctionBeginUser;
  if (im->x)
    SB_SCAN_ERROR(s, "second section $Nodes");
  PetscCall(read_totals(g, "number of nodes", &nblock, &n));
  PetscCall(SbScanRoom(s, "nodes", n, 8, 28));
  PetscCall(SbImportSetVertices(im, (PetscInt)n));
  for (int64_t b = 0; b < nblock; b++) {
    if (g->version > 2)
      PetscCall(read_block(g, &dim, &tag, &parametric, &n));
    if (dim < 0 || dim > 3)
      SB_SCAN_ERROR(s, "dimension %lld of a block of nodes; expected 0 to 3", (long long)dim);
    if (n < 0 || n > im->nvert - v)
      SB_SCAN_ERROR(s, "block of %lld nodes; only %lld of those announced for the section are left",
                    (long long)n, (long long)(im->nvert - v));
    for (PetscInt i = v; i < v + n && g->version == 41; i++)
      PetscCall(SbScanInt(s, 8, "number of a node", &im->vert_number[i]));
    for (; n > 0; v++, n--) {
      if (g->version != 41)
        PetscCall(SbScanInt(s, 4, "number of a node", &im->vert_number[v]));
      if (SbNumbersFind(&im->nodes, im->vert_number[v]) >= 0)
        SB_SCAN_ERROR(s, "node %lld is given twice; renumber the nodes",
                      (long long)im->vert_number[v]);
      PetscCall(SbNumbersAdd(&im->nodes, im->vert_number[v]));
      PetscCall(SbScanPoint(s, "coordinate", im->vert_number[v], im->x + 3 * v));
      for (int k = 0; g->parametric && k < 2; k++) // the entity of the node
        PetscCall(SbScanInt(s, 4, "entity of a node", k ? &tag : &dim));
      if (g->parametric) {
        parametric = dim < 3;
        if (dim < 0 || dim > 3)
          SB_SCAN_ERROR(s, "dimension %lld of the entity of a node; expected 0 to 3",
                        (long long)dim);
      }
      if (g->parametric && !s->binary)
        SbScanEndOfLine(s);
      for (int k = 0; parametric && k < dim && !(g->parametric && !s->binary); k++)
        PetscCall(SbScanReal(s, "parameter", im->vert_number[v], &parameter));
    }
  }

  // version 4.0 may announce more nodes than it has, when only some of the entities are saved
  if (g->version == 40)
    im->nvert = v;
  if (v < im->nvert)
    SB_SCAN_ERROR(s, "%lld nodes are announced, the blocks hold %lld", (long long)im->nvert,
                  (long long)v);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the elements. In version 4 blocks have the entity and the type of their elements. In
   versions 1 and 2 type and tags stand in the line of each element, in a binary file before many of
   one type. */
static PetscErrorCode read_elements(Gmsh *g)
{
  SbScan *s = &g->im->scan;
  const PetscBool blocks = (PetscBool)(g->version > 2);
  const int width = g->version == 41 ? 8 : 4; /* bytes of the number of a node or an element */
  int64_t nblock, total, left;
  int64_t dim = 0;
  int64_t entity = 0;
  int64_t type;
  int64_t n = 1;
  int64_t ntag = 2;
  int64_t number = 0;
  int64_t nnode;
  int64_t last_tag = 0;
  int64_t last_dim = -1;
  PetscInt tags;
  PetscInt last_tags = 0; /* of the last group: usually that of the next element too */

  PetscFunctionBeginUser;
  PetscCall(read_totals(g, "number of elements", &nblock, &total));
  left = total;
  PetscCall(SbScanRoom(s, "elements", total, blocks ? 4 : 8, 8));
  for (int64_t b = 0; blocks ? b < nblock : left > 0; b++, left -= n) {
    if (blocks)
      PetscCall(read_block(g, &dim, &entity, &type, &n));
    else {
      if (!s->binary)
        PetscCall(SbScanInt(s, 4, "number of an element", &number));
      PetscCall(SbScanInt(s, 4, "type of an element", &type));
      if (s->binary)
        PetscCall(SbScanInt(s, 4, "number of elements in a block", &n));
      if (g->version == 2)
        PetscCall(SbScanInt(s, 4, "number of tags of an element", &ntag));
    }
    if (type < 1 || type >= SB_GMSH_NTYPES)
      SB_SCAN_ERROR(
        s,
        "element type %lld; supple needs 4-node tetrahedra (type 4), with points, lines and "
        "triangles for groups",
        (long long)type);
    if (n < (blocks ? 0 : 1) || n > left)
      SB_SCAN_ERROR(s,
                    "block of %lld elements; only %lld of those announced for the section are left",
                    (long long)n, (long long)left);

    // tag set of the entity; an unlisted entity has no groups
    tags = 0;
    for (PetscInt i = 0; blocks && i < g->nentity && !tags; i++)
      if (g->entity[i].dim == dim && g->entity[i].tag == entity)
        tags = g->entity[i].tags;
    if (tags && dim != SbGmshTypes[type].dim)
      SB_SCAN_ERROR(s, "%s in a block of dimension %lld; the file is damaged",
                    SbGmshTypes[type].name, (long long)dim);
    for (int64_t i = 0; i < n; i++) {
      PetscInt vert[64];

      if (blocks || s->binary)
        PetscCall(SbScanInt(s, width, "number of an element", &number));
      if (!blocks) {
        int64_t tag = 0;
        int64_t other;

        // the first tag is the physical group, 0 for none; the others are ignored
        PetscCall(SbScanRoom(s, "tags of an element", ntag, 2, 4));
        for (int64_t k = 0; k < ntag; k++)
          PetscCall(SbScanInt(s, 4, "tag of an element", k ? &other : &tag));
        dim = SbGmshTypes[type].dim;
        if (tag && (tag != last_tag || dim != last_dim)) {
          PetscCall(
            SbImportTagsAlone(g->im, (PetscInt)dim, tag < 0 ? -tag : tag, NULL, &last_tags));
          last_dim = dim;
          last_tag = tag;
        }
        tags = tag ? last_tags : 0;
      }

      // in version 1 each element line has its number of nodes
      if (g->version == 1) {
        PetscCall(SbScanText(s, "number of nodes of an element", &nnode));
        if (nnode != SbGmshTypes[type].nnode)
          SB_SCAN_ERROR(s, "an element of type %d with %lld nodes; expected %d", (int)type,
                        (long long)nnode, SbGmshTypes[type].nnode);
      }
      for (int k = 0; k < SbGmshTypes[type].nnode; k++) {
        int64_t node;

        PetscCall(SbScanInt(s, width, "node of an element", &node));
        vert[k] = SbNumbersFind(&g->im->nodes, node);
        if (vert[k] < 0)
          SB_SCAN_ERROR(s, "element %lld uses node %lld, which $Nodes does not list",
                        (long long)number, (long long)node);
      }
      PetscCall(SbImportAddElement(g->im, (int)type, vert, tags, number));
    }
  }
  if (left > 0)
    SB_SCAN_ERROR(s, "%lld elements are announced, the blocks hold %lld", (long long)total,
                  (long long)(total - left));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an array of the elements: texts, real and whole numbers that describe it, and the rows;
   kept if it is the wanted one. */
static PetscErrorCode read_data(Gmsh *g)
{
  SbScan *s = &g->im->scan;
  int64_t n;
  int64_t whole[3] = {0, 0, 0}; /* step, components, rows */
  int64_t *number;
  double *value;
  PetscReal x;
  char name[SB_NAME_MAX] = "";
  char text[SB_GROUP_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbScanCount(s, "texts of element data", 1, 1, &n));
  for (int64_t i = 0; i < n; i++) {
    PetscCall(SbScanQuoted(s, "name of element data in quotes", sizeof(text), text));
    if (!i)
      (void)snprintf(name, sizeof(name), "%.63s", text);
  }
  PetscCall(SbScanCount(s, "real numbers of element data", 1, 1, &n));
  for (int64_t i = 0; i < n; i++)
    PetscCall(SbScanReal(s, "real number of element data", 0, &x));
  PetscCall(SbScanCount(s, "whole numbers of element data", 1, 1, &n));
  for (int64_t i = 0; i < n; i++) {
    int64_t one;

    PetscCall(SbScanText(s, "whole number of element data", &one));
    if (i < 3)
      whole[i] = one;
  }
  if (!SbImportWants(g->im, name, whole[1]))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbScanRoom(s, "rows of element data", whole[2], 2 + 2 * whole[1], 4 + 8 * whole[1]));
  PetscCall(PetscMalloc2(whole[2], &number, whole[1] * whole[2], &value));
  SbScanEndOfLine(s);
  s->binary = g->binary;
  for (int64_t i = 0; i < whole[2]; i++) {
    PetscCall(SbScanInt(s, 4, "number of an element", &number[i]));
    for (int64_t k = 0; k < whole[1]; k++) {
      PetscCall(SbScanReal(s, "element data", number[i], &x));
      value[whole[1] * i + k] = x;
    }
  }
  s->binary = PETSC_FALSE;
  PetscCall(SbImportKeep(g->im, (PetscInt)whole[2], number, 0, value));
  PetscCall(PetscFree2(number, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Gmsh(const char *path, SbImport *im)
{
  Gmsh g = {.im = im};
  SbScan *s = &im->scan;
  char name[64], end[64], closing[72];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));

  // version 1 begins with its nodes
  (void)SbScanWord(s, sizeof(name), name);
  if (!strcmp(name, "$NOD"))
    g.version = 1;
  else if (strcmp(name, "$MeshFormat"))
    SB_SCAN_ERROR(s, "expected $MeshFormat; this is no gmsh mesh file");
  while (name[0]) {
    const PetscBool old = (PetscBool)(g.version == 2 && !strcmp(name, "$ParametricNodes"));
    const PetscBool nodes = (PetscBool)(old || !strcmp(name, g.version == 1 ? "$NOD" : "$Nodes"));
    const PetscBool elements = (PetscBool)!strcmp(name, g.version == 1 ? "$ELM" : "$Elements");

    // a section, read or skipped, then its end marker
    if (name[0] != '$')
      SB_SCAN_ERROR(s, "expected the beginning of a section, as $Nodes, found '%.20s'", name);
    (void)snprintf(closing, sizeof(closing), g.version == 1 ? "$END%s" : "$End%s", name + 1);
    if (!strcmp(name, "$MeshFormat"))
      PetscCall(read_format(&g));
    else if (!strcmp(name, "$PhysicalNames"))
      PetscCall(read_names(&g));
    else if (nodes || elements || (!strcmp(name, "$Entities") && !g.entities_read)) {
      g.parametric = old;
      if (elements && g.version > 2 && !g.entities_read) {
        // the groups of the elements, where that section stands behind them
        const char *at = s->at;

        if (SbScanFind(s, "\n$Entities")) {
          s->at += sizeof("\n$Entities") - 1;
          SbScanEndOfLine(s);
          s->binary = g.binary;
          PetscCall(read_entities(&g));
          s->binary = PETSC_FALSE;
        }
        s->at = at;
      }
      SbScanEndOfLine(s);
      s->binary = g.binary;
      if (elements && !im->x)
        SB_SCAN_ERROR(s, "section %s before the nodes", name);
      if (nodes)
        PetscCall(read_nodes(&g));
      else if (elements)
        PetscCall(read_elements(&g));
      else
        PetscCall(read_entities(&g));
      s->binary = PETSC_FALSE;
    } else if (!strcmp(name, "$PartitionedEntities"))
      SB_SCAN_ERROR(
        s, "the mesh is cut into partitions; save it in one piece (gmsh: Mesh, Unpartition)");
    else {
      if (!strcmp(name, "$ElementData") && im->field[0])
        PetscCall(read_data(&g));
      if (!SbScanFind(s, closing))
        SB_SCAN_ERROR(s, "section %s has no end; the file is truncated, write or copy it again",
                      name);
    }
    if (!SbScanWord(s, sizeof(end), end))
      SB_SCAN_ENDS(s, "%s", closing);
    if (strcmp(end, closing))
      SB_SCAN_ERROR(s,
                    "expected %s, found '%.20s'; the section is longer than announced or damaged",
                    closing, end);
    (void)SbScanWord(s, sizeof(name), name);
  }
  PetscCheck(im->x, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: has no section $Nodes; it is truncated or not a mesh", im->where);
  PetscCall(SbImportCheckTypes(im));
  for (PetscInt k = 0; k < g.nname.n; k++)
    for (PetscInt dim = 0; dim < 4; dim++)
      SbImportNameGroup(im, dim, g.name[k].tag, g.name[k].name);

  // merge repeated elements of several groups; duplicates in one group are left for check.c
  if (g.version <= 2 && im->ngroup > 1)
    PetscCall(SbImportJoinRepeats(im, 3, PETSC_FALSE, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}
