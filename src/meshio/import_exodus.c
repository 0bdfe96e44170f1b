/*
  import_exodus.c - reader of Exodus II files, .exo, .e, .ex2, .g, .gen (Sandia, "EXODUS II: A
  Finite Element Data Model"; written by Cubit, Coreform, MOOSE, libMesh, meshio), which are netCDF:
  of the classic format or HDF5.

  coordx, coordy, coordz (or coord) are the nodes; connectN the nodes of the elements of block N,
  whose type is its attribute elem_type. Elements count through all blocks. elem_ssN and side_ssN
  are a side set, node_nsN a node set, elem_elsN a set of elements. eb_names, ss_names, ns_names and
  els_names name them; without a name the number in eb_prop1, ss_prop1, ... counts.

  Results, edge and face blocks and their sets are left out. Errors: blocks of volumes other than
  tetrahedra, meshes in a plane.
*/
#include <strings.h>
#include "foreign.h"

typedef struct {
  int type;
  int64_t first, n, nnode; /* elements from `first` on, from 0; nodes of one in the file */
  double *node;            /* [n][nnode] */
  PetscInt *item;          /* [n] item of each element, -1: none */
} Block;

typedef struct {
  SbForeign *f;
  SbCount nblock;
  Block *block; /* [nblock] */
} Exodus;

/* gmsh's type of a block. */
static PetscErrorCode find_type(Exodus *x, const char *name, int64_t nnode, const char *array,
                                int *type)
{
  static const struct {
    const char *name;
    int nnode, type;
  } types[] = {{"TET", 4, SB_GMSH_TET},
               {"TET", 10, SB_GMSH_TET10},
               {"TET", 11, SB_GMSH_TET10},
               {"TET", 14, SB_GMSH_TET10},
               {"TET", 15, SB_GMSH_TET10},
               {"TRI", 3, SB_GMSH_TRIANGLE},
               {"SHELL", 3, SB_GMSH_TRIANGLE},
               {"TRI", 6, SB_GMSH_TRIANGLE6},
               {"TRI", 7, SB_GMSH_TRIANGLE6},
               {"SHELL", 6, SB_GMSH_TRIANGLE6},
               {"SHELL", 4, 3},
               {"QUAD", 4, 3},
               {"QUAD", 8, 16},
               {"QUAD", 9, 10},
               {"SHELL", 8, 16},
               {"SHELL", 9, 10},
               {"HEX", 8, 5},
               {"HEX", 20, 17},
               {"HEX", 27, 12},
               {"WEDGE", 6, 6},
               {"WEDGE", 15, 18},
               {"PYR", 5, 7},
               {"PYR", 13, 19},
               {"BAR", 2, SB_GMSH_LINE},
               {"BEAM", 2, SB_GMSH_LINE},
               {"TRUSS", 2, SB_GMSH_LINE},
               {"EDGE", 2, SB_GMSH_LINE},
               {"ROD", 2, SB_GMSH_LINE},
               {"BAR", 3, SB_GMSH_LINE3},
               {"BEAM", 3, SB_GMSH_LINE3},
               {"TRUSS", 3, SB_GMSH_LINE3},
               {"EDGE", 3, SB_GMSH_LINE3},
               {"SPHERE", 1, SB_GMSH_POINT},
               {"CIRCLE", 1, SB_GMSH_POINT},
               {"POINT", 1, SB_GMSH_POINT}};

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types); i++) {
    if (types[i].nnode != nnode || strncasecmp(name, types[i].name, strlen(types[i].name)) != 0)
      continue;
    *type = types[i].type;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SB_FOREIGN_ERROR(x->f,
                   "%s has elements of type '%.40s' with %lld nodes; supple takes tetrahedra "
                   "of 4 and 10 nodes (TETRA4, TETRA10): mesh the part with them",
                   array, name, (long long)nnode);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers and names of blocks or sets, by their letters: eb, ss, ns, els. */
typedef struct {
  const char *array; /* of the members, without its number */
  int64_t n;
  double *number; /* [n] or NULL */
  double *status; /* [n] or NULL; 0: empty */
  char *name;     /* [n][width] or NULL */
  size_t width;
} List;

static PetscErrorCode read_list(Exodus *x, const char *letters, const char *array, List *list)
{
  char path[64];
  int64_t n;

  PetscFunctionBeginUser;
  *list = (List){.array = array, .n = -1};
  SbFormat(sizeof(path), path, "%s_prop1", letters);
  if (SbForeignHas(x->f, path))
    PetscCall(SbForeignNumbers(x->f, path, &list->n, &list->number));
  while (list->n < 0 || !list->number) {
    SbFormat(sizeof(path), path, "%s%lld", array, (long long)list->n + 2);
    list->n++;
    if (!SbForeignHas(x->f, path))
      break;
  }
  SbFormat(sizeof(path), path, "%s_status", letters);
  if (SbForeignHas(x->f, path))
    PetscCall(SbForeignNumbers(x->f, path, &list->n, &list->status));
  SbFormat(sizeof(path), path, "%s_names", letters);
  if (!SbForeignHas(x->f, path))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbForeignTexts(x->f, path, &n, &list->width, &list->name));
  if (n != list->n)
    SB_FOREIGN_ERROR(x->f, "%s has %lld names; expected %lld", path, (long long)n,
                     (long long)list->n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers of entry k of a list, and the name of their array, as connect2. An empty one, with n = 0,
   has none. */
static PetscErrorCode members_of(Exodus *x, const List *list, int64_t k, size_t size, char array[],
                                 int64_t *n, double **number)
{
  PetscFunctionBeginUser;
  *n = 0;
  *number = NULL;
  SbFormat(size, array, "%s%lld", list->array, (long long)k + 1);
  if (SbForeignHas(x->f, array)) {
    *n = -1;
    PetscCall(SbForeignNumbers(x->f, array, n, number));
  } else if (list->status && list->status[k] != 0)
    SB_FOREIGN_ERROR(x->f,
                     "there is no array %s in it, and its status says that it is not empty: "
                     "the file is damaged, write or copy it again",
                     array);
  else if (!list->status)
    SbImportRemark(x->f->im, "there is no array %s, taken as empty", array);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The group of entry k of a list. */
static PetscErrorCode group_of(Exodus *x, const List *list, int64_t k, int dim, PetscInt *group)
{
  char name[SB_GROUP_MAX] = "";
  int64_t number = k + 1;

  PetscFunctionBeginUser;
  if (list->name)
    SbForeignText(list->name, list->width, k, sizeof(name), name);
  if (list->number && PetscAbsReal(list->number[k]) < 1e12)
    number = (int64_t)list->number[k];
  PetscCall(SbForeignGroup(x->f, dim, number, name, group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_coordinates(Exodus *x)
{
  static const char *const names[3] = {"coordx", "coordy", "coordz"};
  SbForeign *f = x->f;
  int64_t n = -1;
  double *all = NULL;
  double *one;

  PetscFunctionBeginUser;
  if (!SbForeignHas(f, "coordx")) {
    PetscCall(SbForeignNumbers(f, "coord", &n, &all));
    if (n % 3)
      SB_FOREIGN_ERROR(f, "coord has %lld numbers; expected three for each node", (long long)n);
    n /= 3;
  }
  for (int k = 0; k < 3 && SbForeignHas(f, "coordx"); k++) {
    if (k == 2 && !SbForeignHas(f, names[k]))
      SB_FOREIGN_ERROR(f, "the mesh lies in a plane: there is no coordz in it");
    PetscCall(SbForeignNumbers(f, names[k], &n, &one));
    if (!k)
      PetscCall(SbImportScratch(f->im, 3 * (size_t)n * sizeof(*all), &all));
    PetscCall(PetscArraycpy(all + k * n, one, n));
  }
  if (n > PETSC_MAX_INT / 8)
    SB_FOREIGN_ERROR(f, "%lld nodes are more than this build can number", (long long)n);
  PetscCall(SbForeignVertices(f, (PetscInt)n, all, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_blocks(Exodus *x)
{
  SbForeign *f = x->f;
  List list;

  PetscFunctionBeginUser;
  PetscCall(read_list(x, "eb", "connect", &list));
  for (int64_t b = 0; b < list.n; b++) {
    Block block = {.first = f->nelement};
    char path[64], name[SB_NAME_MAX];
    int64_t all;
    PetscInt group, tags;

    PetscCall(members_of(x, &list, b, sizeof(path), path, &all, &block.node));
    if (all)
      PetscCall(SbForeignRows(f, path, &block.n));
    if (!block.n)
      continue;
    block.nnode = all / block.n;
    if (!SbForeignTextOf(f, path, "elem_type", sizeof(name), name))
      SB_FOREIGN_ERROR(f, "%s has no attribute elem_type", path);
    PetscCall(find_type(x, name, block.nnode, path, &block.type));
    PetscCall(group_of(x, &list, b, SbGmshTypes[block.type].dim, &group));
    PetscCall(SbImportTagSet(f->im, 1, &group, &tags));
    PetscCall(SbImportScratch(f->im, (size_t)block.n * sizeof(*block.item), &block.item));
    for (int64_t i = 0; i < block.n; i++)
      PetscCall(
        SbForeignElement(f, block.type, block.node + i * block.nnode, tags, &block.item[i]));
    PetscCall(SbImportGrow(f->im, &x->nblock, sizeof(block), &x->block));
    x->block[x->nblock.n - 1] = block;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Block of an element, whose index there replaces its number. */
static PetscErrorCode find_element(Exodus *x, const char *array, double number, const Block **block,
                                   int64_t *index)
{
  PetscInt b = 0;

  PetscFunctionBeginUser;
  if (!(number >= 1 && number <= (double)x->f->nelement) || number != PetscFloorReal(number))
    SB_FOREIGN_ERROR(x->f, "%s lists element %g; there are %lld, from 1 on", array, number,
                     (long long)x->f->nelement);
  *index = (int64_t)number - 1;
  while (*index >= x->block[b].first + x->block[b].n)
    b++;
  *block = &x->block[b];
  *index -= x->block[b].first;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_side_sets(Exodus *x)
{
  static const int corners[4][3] = {{0, 1, 3}, {1, 2, 3}, {0, 3, 2}, {0, 2, 1}}; /* of tets */
  SbForeign *f = x->f;
  List list;

  PetscFunctionBeginUser;
  PetscCall(read_list(x, "ss", "elem_ss", &list));
  for (int64_t s = 0; s < list.n; s++) {
    char elements[64], sides[64];
    int64_t n;
    double *element, *side;
    PetscInt group, tags;

    PetscCall(members_of(x, &list, s, sizeof(elements), elements, &n, &element));
    if (!n)
      continue;
    SbFormat(sizeof(sides), sides, "side_ss%lld", (long long)s + 1);
    PetscCall(SbForeignNumbers(f, sides, &n, &side));
    PetscCall(group_of(x, &list, s, 2, &group));
    for (int64_t i = 0; i < n; i++) {
      const Block *block;
      PetscInt vert[3];
      int64_t k;
      int dim;

      PetscCall(find_element(x, elements, element[i], &block, &k));
      dim = SbGmshTypes[block->type].dim;
      if (dim == 2 && side[i] <= 2 && block->item[k] >= 0)
        PetscCall(SbImportAddMember(f->im, 2, block->item[k], group));
      if (dim < 3)
        continue; /* of a shell, or its edge */
      if (!(side[i] >= 1 && side[i] <= 4) || side[i] != PetscFloorReal(side[i]))
        SB_FOREIGN_ERROR(f, "%s lists side %g of element %g; a tetrahedron has 1 to 4", sides,
                         side[i], element[i]);
      for (int c = 0; c < 3; c++)
        vert[c] = (PetscInt)block->node[k * block->nnode + corners[(int)side[i] - 1][c]] - 1;
      PetscCall(SbImportTagSet(f->im, 1, &group, &tags));
      PetscCall(SbImportAddItem(f->im, 2, vert, tags, (int64_t)element[i]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_node_sets(Exodus *x)
{
  SbForeign *f = x->f;
  List list;

  PetscFunctionBeginUser;
  PetscCall(read_list(x, "ns", "node_ns", &list));
  for (int64_t s = 0; s < list.n; s++) {
    char path[64];
    int64_t n;
    double *node;
    PetscInt group;

    PetscCall(members_of(x, &list, s, sizeof(path), path, &n, &node));
    PetscCall(group_of(x, &list, s, 0, &group));
    for (int64_t i = 0; i < n; i++) {
      if (!(node[i] >= 1 && node[i] <= f->im->nvert) || node[i] != PetscFloorReal(node[i]))
        SB_FOREIGN_ERROR(f, "%s lists node %g; there are %lld, from 1 on", path, node[i],
                         (long long)f->im->nvert);
      PetscCall(SbForeignAddNode(f, (PetscInt)node[i] - 1, group));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_element_sets(Exodus *x)
{
  SbForeign *f = x->f;
  List list;

  PetscFunctionBeginUser;
  PetscCall(read_list(x, "els", "elem_els", &list));
  for (int64_t s = 0; s < list.n; s++) {
    char path[64];
    int64_t n;
    double *element;

    PetscCall(members_of(x, &list, s, sizeof(path), path, &n, &element));
    for (int64_t i = 0; i < n; i++) {
      const Block *block;
      PetscInt group;
      int64_t k;

      PetscCall(find_element(x, path, element[i], &block, &k));
      if (block->item[k] < 0)
        continue;
      PetscCall(group_of(x, &list, s, SbGmshTypes[block->type].dim, &group));
      PetscCall(SbImportAddMember(f->im, SbGmshTypes[block->type].dim, block->item[k], group));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode work(SbForeign *f)
{
  static const char *const skipped[][2] = {{"ed_prop1", "edge blocks"},
                                           {"fa_prop1", "face blocks"},
                                           {"es_prop1", "edge sets"},
                                           {"fs_prop1", "face sets"}};
  Exodus x = {.f = f};

  PetscFunctionBeginUser;
  if (!SbForeignHas(f, "coordx") && !SbForeignHas(f, "coord"))
    SB_FOREIGN_ERROR(f, "there are no nodes in it, coordx or coord; it is no mesh of Exodus, or "
                        "damaged");
  PetscCall(read_coordinates(&x));
  PetscCall(read_blocks(&x));
  PetscCall(SbImportCheckTypes(f->im));
  PetscCall(read_side_sets(&x));
  PetscCall(read_node_sets(&x));
  PetscCall(read_element_sets(&x));
  PetscCall(SbImportJoinGroups(f->im));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(skipped); i++)
    if (SbForeignHas(f, skipped[i][0]))
      PetscCall(SbImportSkip(f->im, "%s", skipped[i][1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Exodus(const char *path, SbImport *im)
{
  char magic[3] = "";
  size_t size;
  FILE *file;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpenFile(im->where, path, &file, &size));
  if (fread(magic, 1, sizeof(magic), file) < sizeof(magic))
    magic[0] = 0;
  (void)fclose(file);
  PetscCall(SbForeignRead(path, "Exodus", (PetscBool)!memcmp(magic, "CDF", 3), work, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
