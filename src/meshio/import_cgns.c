/*
  import_cgns.c - reader of CGNS files in HDF5, .cgns (CGNS Standard Interface Data Structures, and
  "HDF5 Implementation"; written by Pointwise, ICEM, STAR-CCM+, gmsh).

  Each node of CGNS is a group with the attribute label and the dataset " data". Read: the zone of
  the base, its GridCoordinates, its sections of elements (TETRA_4, TETRA_10, TRI, BAR, NODE, MIXED)
  and its boundary conditions. A section is a group of its name; a boundary condition is one of
  facets, tets or points, by its GridLocation, of its name, of that of its family, and of the names
  within that family. A family of the zone is a group of all tets.

  Errors: several bases or zones, structured ones, volumes other than tetrahedra (NGON_n, NFACE_n
  too), coordinates other than x, y, z. Solutions are left out.
*/
#include "foreign.h"

typedef struct {
  int64_t first, last; /* numbers of its elements */
  PetscInt *item;      /* [last - first + 1] */
  signed char *dim;    /* likewise */
} Section;

typedef struct {
  SbForeign *f;
  char base[SB_GROUP_MAX + 2], zone[2 * SB_GROUP_MAX + 4]; /* paths */
  PetscInt family;                                         /* group of all tets, -1: none */
  SbCount nsection;
  Section *section; /* [nsection] */
} CGNS;

/* gmsh's types by those of CGNS; nnode: of the file. */
static const struct {
  int type, nnode;
} types[] = {{0, 0},
             {0, 0},
             {SB_GMSH_POINT, 1},
             {SB_GMSH_LINE, 2},
             {SB_GMSH_LINE3, 3},
             {SB_GMSH_TRIANGLE, 3},
             {SB_GMSH_TRIANGLE6, 6},
             {3, 4},
             {16, 8},
             {10, 9},
             {SB_GMSH_TET, 4},
             {SB_GMSH_TET10, 10},
             {7, 5},
             {14, 14},
             {6, 6},
             {18, 15},
             {13, 18},
             {5, 8},
             {17, 20},
             {12, 27},
             {0, 0},
             {19, 13}};
enum {
  MIXED = 20,
  NTYPE = (int)PETSC_STATIC_ARRAY_LENGTH(types)
};

/* Children of a node with this label; scratch. */
static PetscErrorCode list_label(CGNS *c, const char *node, const char *label, PetscInt *n,
                                 char (**name)[SB_GROUP_MAX])
{
  PetscInt all;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(SbForeignList(c->f, node, &all, name));
  for (PetscInt i = 0; i < all; i++) {
    char path[2048], found[40];

    SbFormat(sizeof(path), path, "%s/%s", node[1] ? node : "", (*name)[i]);
    if (SbForeignTextOf(c->f, path, "label", sizeof(found), found) && !strcmp(found, label))
      memmove((*name)[(*n)++], (*name)[i], SB_GROUP_MAX);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The only child with this label. */
static PetscErrorCode only_one(CGNS *c, const char *node, const char *label,
                               char name[SB_GROUP_MAX])
{
  char(*names)[SB_GROUP_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(list_label(c, node, label, &n, &names));
  if (n != 1)
    SB_FOREIGN_ERROR(c->f, "has %lld nodes %s in %s; supple reads one%s", (long long)n, label, node,
                     n ? ": join them, or save one alone" : ": it is no mesh of CGNS, or damaged");
  memcpy(name, names[0], SB_GROUP_MAX);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Text of a node; "" if it has none. */
static PetscErrorCode text_of(CGNS *c, const char *node, size_t size, char name[])
{
  char path[2048];
  int64_t n;
  size_t width;
  char *text;

  PetscFunctionBeginUser;
  name[0] = 0;
  SbFormat(sizeof(path), path, "%s/ data", node);
  if (!SbForeignHas(c->f, path))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbForeignTexts(c->f, path, &n, &width, &text));
  if (n > 0)
    SbForeignText(text, width * (size_t)n, 0, size, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers of the child `name` of a node, or of the node itself. */
static PetscErrorCode numbers_of(CGNS *c, const char *node, const char *name, int64_t *n,
                                 double **value)
{
  char path[2048];

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s%s%s/ data", node, name ? "/" : "", name ? name : "");
  PetscCall(SbForeignNumbers(c->f, path, n, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A range: first and last of whole numbers from 1 on. */
static PetscErrorCode range_of(CGNS *c, const char *node, const char *name, int64_t *first,
                               int64_t *last)
{
  int64_t n = 2;
  double *range;

  PetscFunctionBeginUser;
  PetscCall(numbers_of(c, node, name, &n, &range));
  if (!(range[0] >= 1 && range[1] >= range[0] - 1 && range[1] < 1e12))
    SB_FOREIGN_ERROR(c->f, "%s/%s is from %g to %g", node, name, range[0], range[1]);
  *first = (int64_t)range[0];
  *last = (int64_t)range[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_coordinates(CGNS *c)
{
  static const char *const names[3] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  SbForeign *f = c->f;
  char node[2048];
  int64_t n = -1;
  double *all = NULL;

  PetscFunctionBeginUser;
  SbFormat(sizeof(node), node, "%s/GridCoordinates", c->zone);
  for (int k = 0; k < 3; k++) {
    double *one;

    PetscCall(numbers_of(c, node, names[k], &n, &one));
    if (n > PETSC_MAX_INT / 8)
      SB_FOREIGN_ERROR(f, "%lld nodes are more than this build can number", (long long)n);
    if (!k)
      PetscCall(SbImportScratch(f->im, 3 * (size_t)n * sizeof(*all), &all));
    PetscCall(PetscArraycpy(all + k * n, one, n));
  }
  PetscCall(SbForeignVertices(f, (PetscInt)n, all, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One section of elements. */
static PetscErrorCode read_section(CGNS *c, const char *name)
{
  SbForeign *f = c->f;
  Section section = {.item = NULL};
  char node[2048];
  int64_t n = -1;
  int64_t at = 0;
  double *kind, *connect;

  PetscFunctionBeginUser;
  SbFormat(sizeof(node), node, "%s/%s", c->zone, name);
  PetscCall(numbers_of(c, node, NULL, &n, &kind));
  PetscCall(range_of(c, node, "ElementRange", &section.first, &section.last));
  if (n < 1 || !(kind[0] >= 2 && kind[0] < NTYPE))
    SB_FOREIGN_ERROR(f,
                     "the section '%s' has elements of CGNS' type %g; supple takes TETRA_4 and "
                     "TETRA_10: mesh the part with them",
                     name, n < 1 ? 0. : kind[0]);
  n = -1;
  PetscCall(numbers_of(c, node, "ElementConnectivity", &n, &connect));
  if (section.last - section.first >= n)
    SB_FOREIGN_ERROR(f, "the section '%s' announces %lld elements, and lists %lld nodes", name,
                     (long long)(section.last - section.first + 1), (long long)n);
  f->nelement = section.first - 1;
  PetscCall(SbImportScratch(
    f->im, (size_t)(section.last - section.first + 1) * sizeof(*section.item), &section.item));
  PetscCall(SbImportScratch(f->im, (size_t)(section.last - section.first + 1), &section.dim));
  for (int64_t e = section.first; e <= section.last; e++) {
    const double type = kind[0] != MIXED ? kind[0] : at < n ? connect[at++] : 0;
    PetscInt group[2];
    PetscInt tags;
    int k, dim;

    if (!(type >= 2 && type < NTYPE) || type == MIXED)
      SB_FOREIGN_ERROR(f,
                       "element %lld in the section '%s' is of CGNS' type %g; supple takes "
                       "TETRA_4 and TETRA_10: mesh the part with them",
                       (long long)e, name, type);
    k = (int)type;
    if (at + types[k].nnode > n)
      SB_FOREIGN_ERROR(f, "the section '%s' lists %lld nodes; its elements have more", name,
                       (long long)n);
    dim = SbGmshTypes[types[k].type].dim;
    PetscCall(SbForeignGroup(f, dim, 0, name, &group[0]));
    group[1] = dim == 3 && c->family >= 0 ? c->family : group[0];
    PetscCall(SbImportTagSet(f->im, 2, group, &tags));
    section.dim[e - section.first] = (signed char)dim;
    PetscCall(
      SbForeignElement(f, types[k].type, connect + at, tags, &section.item[e - section.first]));
    at += types[k].nnode;
  }
  if (at < n)
    SB_FOREIGN_ERROR(f, "the section '%s' lists %lld nodes; its elements have %lld", name,
                     (long long)n, (long long)at);
  PetscCall(SbImportGrow(f->im, &c->nsection, sizeof(section), &c->section));
  c->section[c->nsection.n - 1] = section;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds an element or a node to the group of this name. */
static PetscErrorCode add_member(CGNS *c, const char *condition, const char *name,
                                 PetscBool of_nodes, double number)
{
  SbForeign *f = c->f;
  PetscInt group;
  PetscInt k = 0;
  int64_t e;

  PetscFunctionBeginUser;
  if (!(number >= 1 && number < 1e12) || number != PetscFloorReal(number) ||
      (of_nodes && number > f->im->nvert))
    SB_FOREIGN_ERROR(f, "the boundary condition '%s' lists %s %g, which is not there", condition,
                     of_nodes ? "node" : "element", number);
  if (of_nodes) {
    PetscCall(SbForeignGroup(f, 0, 0, name, &group));
    PetscCall(SbForeignAddNode(f, (PetscInt)number - 1, group));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  e = (int64_t)number;
  while (k < c->nsection.n && (e < c->section[k].first || e > c->section[k].last))
    k++;
  if (k == c->nsection.n)
    SB_FOREIGN_ERROR(f, "the boundary condition '%s' lists element %lld, which is not there",
                     condition, (long long)e);
  e -= c->section[k].first;
  if (c->section[k].item[e] < 0)
    PetscFunctionReturn(PETSC_SUCCESS); /* of a kind that is not kept */
  PetscCall(SbForeignGroup(f, c->section[k].dim[e], 0, name, &group));
  PetscCall(SbImportAddMember(f->im, c->section[k].dim[e], c->section[k].item[e], group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Name of a node's family, "": none, and the names that the family lists. */
static PetscErrorCode family_of(CGNS *c, const char *node, char name[SB_GROUP_MAX], PetscInt *n,
                                char (**names)[SB_GROUP_MAX])
{
  char path[2048];

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/FamilyName", node);
  PetscCall(text_of(c, path, SB_GROUP_MAX, name));
  *n = 0;
  if (!name[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  SbFormat(sizeof(path), path, "%s/%s", c->base, name);
  PetscCall(list_label(c, path, "FamilyName_t", n, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One boundary condition. */
static PetscErrorCode read_condition(CGNS *c, const char *parent, const char *name)
{
  static const char *const lists[] = {"PointList", "PointRange", "ElementList", "ElementRange"};
  SbForeign *f = c->f;
  char node[2048], path[2048], location[64], family[SB_GROUP_MAX];
  char(*names)[SB_GROUP_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  SbFormat(sizeof(node), node, "%s/%s", parent, name);
  SbFormat(sizeof(path), path, "%s/GridLocation", node);
  PetscCall(text_of(c, path, sizeof(location), location));
  PetscCall(family_of(c, node, family, &n, &names));
  for (int k = 0; k < 4; k++) {
    const PetscBool of_nodes = (PetscBool)(k < 2 && (!location[0] || !strcmp(location, "Vertex")));
    double *number = NULL;
    int64_t first = 0;
    int64_t last = -1;

    SbFormat(sizeof(path), path, "%s/%s", node, lists[k]);
    if (!SbForeignHas(f, path))
      continue;
    if (k % 2) {
      PetscCall(range_of(c, node, lists[k], &first, &last));

      // no more than there are
      if (last - first >= PetscMax((int64_t)f->im->nvert, f->nelement))
        SB_FOREIGN_ERROR(f, "the boundary condition '%s' is from %lld to %lld, more than there are",
                         name, (long long)first, (long long)last);
    } else {
      last = -1;
      PetscCall(numbers_of(c, node, lists[k], &last, &number));
      last--;
    }
    for (int64_t i = first; i <= last; i++) {
      const double one = number ? number[i] : (double)i;

      PetscCall(add_member(c, name, name, of_nodes, one));
      if (family[0])
        PetscCall(add_member(c, name, family, of_nodes, one));
      for (PetscInt j = 0; j < n; j++)
        PetscCall(add_member(c, name, names[j], of_nodes, one));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode work(SbForeign *f)
{
  CGNS c = {.f = f, .family = -1};
  char name[SB_GROUP_MAX], path[2048], kind[64];
  char(*names)[SB_GROUP_MAX], (*conditions)[SB_GROUP_MAX];
  PetscInt n, m;
  int64_t most = 0;

  PetscFunctionBeginUser;
  PetscCall(only_one(&c, "/", "CGNSBase_t", name));
  SbFormat(sizeof(c.base), c.base, "/%s", name);
  PetscCall(only_one(&c, c.base, "Zone_t", name));
  SbFormat(sizeof(c.zone), c.zone, "%s/%s", c.base, name);
  SbFormat(sizeof(path), path, "%s/ZoneType", c.zone);
  PetscCall(text_of(&c, path, sizeof(kind), kind));
  if (strcmp(kind, "Unstructured") != 0)
    SB_FOREIGN_ERROR(f, "the zone '%s' is of the type '%s'; supple reads Unstructured", name, kind);
  PetscCall(read_coordinates(&c));
  PetscCall(family_of(&c, c.zone, name, &n, &names));
  if (name[0])
    PetscCall(SbForeignGroup(f, 3, 0, name, &c.family));
  PetscCall(list_label(&c, c.zone, "Elements_t", &n, &names));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(read_section(&c, names[i]));
    most = PetscMax(most, f->nelement);
  }
  f->nelement = most;
  PetscCall(SbImportCheckTypes(f->im));
  PetscCall(list_label(&c, c.zone, "ZoneBC_t", &n, &names));
  for (PetscInt i = 0; i < n; i++) {
    SbFormat(sizeof(path), path, "%s/%s", c.zone, names[i]);
    PetscCall(list_label(&c, path, "BC_t", &m, &conditions));
    for (PetscInt k = 0; k < m; k++)
      PetscCall(read_condition(&c, path, conditions[k]));
  }
  PetscCall(SbImportJoinGroups(f->im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_CGNS(const char *path, SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(SbForeignRead(path, "CGNS", PETSC_FALSE, work, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
