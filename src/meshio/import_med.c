/*
  import_med.c - reader of MED files, .med (MED file library of EDF and CEA, versions 2.3 to 4.1;
  written by Salome, Code_Aster, gmsh, meshio), which are HDF5.

  /ENS_MAA/MESH/STEP/NOE/COO are the coordinates, all x first, and MAI/TYPE/NOD the nodes of the
  elements of a type, all first ones first; FAM beside them has the family of each. Version 2 has no
  STEP. /FAS/MESH/ELEME and NOEUD list the families; GRO/NOM of a family are the groups to which its
  members belong: these are kept with their names. A family without groups is a group itself.

  Errors: several meshes, or steps of one that changes; structured grids; coordinates other than
  Cartesian ones in space. Fields are left out, polygons skipped and counted.
*/
#include "foreign.h"

/* MED's types; nnode: of the file, of which gmsh's type may know the first ones. */
static const struct {
  const char *name;
  int type, nnode;
} types[] = {{"PO1", SB_GMSH_POINT, 1},
             {"SE2", SB_GMSH_LINE, 2},
             {"SE3", SB_GMSH_LINE3, 3},
             {"TR3", SB_GMSH_TRIANGLE, 3},
             {"TR6", SB_GMSH_TRIANGLE6, 6},
             {"TR7", SB_GMSH_TRIANGLE6, 7},
             {"QU4", 3, 4},
             {"QU8", 16, 8},
             {"QU9", 10, 9},
             {"TE4", SB_GMSH_TET, 4},
             {"T10", SB_GMSH_TET10, 10},
             {"PY5", 7, 5},
             {"P13", 19, 13},
             {"PE6", 6, 6},
             {"P15", 18, 15},
             {"P18", 13, 18},
             {"HE8", 5, 8},
             {"H20", 17, 20},
             {"H27", 12, 27}};

typedef struct {
  size_t width;
  int64_t n;
  char *name;       /* [n][width] of groups */
  PetscInt tags[4]; /* tag set of these, by dimension; -1: not made yet */
} Family;

typedef struct {
  SbForeign *f;
  char mesh[SB_GROUP_MAX]; /* its name */
  char base[512];          /* path of NOE and MAI */
  SbCount nfamily;
  Family *family; /* [nfamily], by the numbers import->elements */
} MED;

/* The only name in a group. */
static PetscErrorCode only_name(MED *m, const char *group, const char *what,
                                char name[SB_GROUP_MAX])
{
  char(*names)[SB_GROUP_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbForeignList(m->f, group, &n, &names));
  if (n != 1)
    SB_FOREIGN_ERROR(m->f, "has %lld %s in %s%s%.60s%s; supple reads one: save it alone",
                     (long long)n, what, group, n ? ", the first of them " : "", n ? names[0] : "",
                     n ? "" : ": it is no mesh of MED, or damaged");
  memcpy(name, names[0], SB_GROUP_MAX);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Families of a group of the file. */
static PetscErrorCode read_families(MED *m, const char *group)
{
  SbForeign *f = m->f;
  char(*names)[SB_GROUP_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbForeignList(f, group, &n, &names));
  for (PetscInt i = 0; i < n; i++) {
    Family family = {.tags = {-1, -1, -1, -1}};
    char path[1024], list[1100];
    double number;

    SbFormat(sizeof(path), path, "%s/%s", group, names[i]);
    if (!SbForeignNumberOf(f, path, "NUM", &number) || !(PetscAbsReal(number) < 1e15))
      continue;
    SbFormat(sizeof(list), list, "%s/GRO/NOM", path);
    if (SbForeignHas(f, list))
      PetscCall(SbForeignTexts(f, list, &family.n, &family.width, &family.name));
    else if (number != 0) {
      family.n = 1;
      family.width = SB_GROUP_MAX;
      family.name = names[i];
    }
    PetscCall(SbNumbersAdd(&f->im->elements, (int64_t)number));
    PetscCall(SbImportGrow(f->im, &m->nfamily, sizeof(family), &m->family));
    m->family[m->nfamily.n - 1] = family;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Groups of a family as a tag set of this dimension. */
static PetscErrorCode tags_of(MED *m, int dim, double number, PetscInt *tags)
{
  const PetscInt k =
    PetscAbsReal(number) < 1e15 ? SbNumbersFind(&m->f->im->elements, (int64_t)number) : -1;
  Family *family = k < 0 ? NULL : &m->family[k];
  PetscInt *group = NULL;

  PetscFunctionBeginUser;
  *tags = 0;
  if (number != 0 && !family)
    SB_FOREIGN_ERROR(m->f, "refers to family %.0f, which /FAS/%s does not list", number, m->mesh);
  if (!family)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (family->tags[dim] < 0) {
    PetscCall(SbImportScratch(m->f->im, (size_t)family->n * sizeof(*group), &group));
    for (int64_t i = 0; i < family->n; i++) {
      char name[SB_GROUP_MAX];

      SbForeignText(family->name, family->width, i, sizeof(name), name);
      PetscCall(SbForeignGroup(m->f, dim, (int64_t)number, name, &group[i]));
    }
    PetscCall(SbImportTagSet(m->f->im, (PetscInt)family->n, group, &family->tags[dim]));
  }
  *tags = family->tags[dim];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements of one type. Tets of MED have their nodes in an order of negative volume. */
static PetscErrorCode read_type(MED *m, int k)
{
  static const int turned[10] = {0, 2, 1, 3, 6, 5, 4, 7, 9, 8};
  const PetscBool tet = (PetscBool)(types[k].type == SB_GMSH_TET || types[k].type == SB_GMSH_TET10);
  SbForeign *f = m->f;
  char path[1024];
  int64_t n = -1;
  double *node;
  double *family = NULL;

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/MAI/%s/NOD", m->base, types[k].name);
  PetscCall(SbForeignNumbers(f, path, &n, &node));
  if (n % types[k].nnode)
    SB_FOREIGN_ERROR(f, "%.300s has %lld numbers, no multiple of %d", path, (long long)n,
                     types[k].nnode);
  n /= types[k].nnode;
  SbFormat(sizeof(path), path, "%s/MAI/%s/FAM", m->base, types[k].name);
  if (SbForeignHas(f, path))
    PetscCall(SbForeignNumbers(f, path, &n, &family));
  for (int64_t i = 0; i < n; i++) {
    double own[27];
    PetscInt tags = 0;

    if (family)
      PetscCall(tags_of(m, SbGmshTypes[types[k].type].dim, family[i], &tags));
    for (int a = 0; a < types[k].nnode; a++)
      own[a] = node[i + n * (tet ? turned[a] : a)];
    PetscCall(SbForeignElement(f, types[k].type, own, tags, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_elements(MED *m)
{
  SbForeign *f = m->f;
  char path[1024];
  char(*names)[SB_GROUP_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/MAI", m->base);
  PetscCall(SbForeignList(f, path, &n, &names));
  for (PetscInt i = 0; i < n; i++) {
    int k = 0;

    while (k < (int)PETSC_STATIC_ARRAY_LENGTH(types) && strcmp(names[i], types[k].name) != 0)
      k++;
    if (k < (int)PETSC_STATIC_ARRAY_LENGTH(types))
      PetscCall(read_type(m, k));
    else if (!strncmp(names[i], "POG", 3))
      PetscCall(SbImportSkip(f->im, "polygons (%.8s)", names[i]));
    else
      SB_FOREIGN_ERROR(f,
                       "holds elements of type %.40s; supple simulates tetrahedra only, TE4 and "
                       "T10: mesh the part with them",
                       names[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Groups of nodes. */
static PetscErrorCode read_nodes(MED *m)
{
  SbForeign *f = m->f;
  char path[1024];
  int64_t n = f->im->nvert;
  double *family;

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/NOE/FAM", m->base);
  if (!SbForeignHas(f, path))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbForeignNumbers(f, path, &n, &family));
  for (PetscInt v = 0; v < f->im->nvert; v++) {
    PetscInt tags;

    PetscCall(tags_of(m, 0, family[v], &tags));
    for (PetscInt i = f->im->tags_start[tags]; i < f->im->tags_start[tags + 1]; i++)
      PetscCall(SbForeignAddNode(f, v, f->im->tags_group[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode work(SbForeign *f)
{
  static const char *const kinds[] = {"", "/ELEME", "/NOEUD"};
  MED m = {.f = f};
  char path[1024], step[SB_GROUP_MAX];
  double value;
  int64_t n = -1;
  double *x;

  PetscFunctionBeginUser;
  PetscCall(only_name(&m, "/ENS_MAA", "meshes", m.mesh));
  SbFormat(sizeof(m.base), m.base, "/ENS_MAA/%s", m.mesh);
  if (SbForeignNumberOf(f, m.base, "TYP", &value) && value != 0)
    SB_FOREIGN_ERROR(f, "the mesh '%s' is a structured grid; save it as tetrahedra", m.mesh);
  if (SbForeignNumberOf(f, m.base, "ESP", &value) && value != 3)
    SB_FOREIGN_ERROR(f, "the mesh '%s' lies in %g dimensions; expected 3", m.mesh, value);
  if (SbForeignNumberOf(f, m.base, "REP", &value) && value != 0)
    SB_FOREIGN_ERROR(f, "coordinates of the mesh '%s' are not Cartesian", m.mesh);
  SbFormat(sizeof(path), path, "%s/NOE", m.base);
  if (!SbForeignHas(f, path)) {
    PetscCall(only_name(&m, m.base, "steps", step));
    SbAppend(sizeof(m.base), m.base, "/%s", step);
  }
  SbFormat(sizeof(path), path, "%s/NOE/COO", m.base);
  PetscCall(SbForeignNumbers(f, path, &n, &x));
  if (n % 3 || n / 3 > PETSC_MAX_INT / 8)
    SB_FOREIGN_ERROR(f, "%.300s has %lld numbers; expected three for each node", path,
                     (long long)n);
  PetscCall(SbForeignVertices(f, (PetscInt)(n / 3), x, PETSC_FALSE));
  for (int k = 0; k < 3; k++) {
    SbFormat(sizeof(path), path, "/FAS/%s%s", m.mesh, kinds[k]);
    PetscCall(read_families(&m, path));
  }
  PetscCall(read_elements(&m));
  PetscCall(SbImportCheckTypes(f->im));
  PetscCall(read_nodes(&m));
  PetscCall(SbImportJoinGroups(f->im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_MED(const char *path, SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(SbForeignRead(path, "MED", PETSC_FALSE, work, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
