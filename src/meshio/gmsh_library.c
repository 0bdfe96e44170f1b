/*
  gmsh_library.c - the gmsh library, loaded in a child process when it is needed, and a mesh taken out of it.

  It is found by its name, with the version in it: gmshInitialize() has another list of arguments from 4.9 on. Its output is off; its
  messages are kept by its logger, whose last error (or warning) becomes our message.
*/
#include <dlfcn.h>
#include <stddef.h>
#include <stdlib.h>
#include "meshio_impl.h"
#include "sbgmsh.h"

enum { OLDEST = 8, NEWEST = 30 }; /* 4.8 to 4.30 */

/* A gmsh that holds METIS and others within itself must find those, not the ones of this program. The address sanitizer forbids that. */
#if defined(__has_feature)
  #if __has_feature(address_sanitizer)
    #define SANITIZED /* as clang says it */
  #endif
#endif
#if defined(SANITIZED) || defined(__SANITIZE_ADDRESS__) || !defined(RTLD_DEEPBIND)
  #define BIND (RTLD_NOW | RTLD_LOCAL)
#else
  #define BIND (RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND)
#endif

/* ------------------------------------------------------------------ loading */

static const struct {
  const char *name;
  size_t offset;
} functions[] = {{"gmshFree", offsetof(SbGmsh, Free)},
#define ROW(type, name, arguments) {"gmsh" #name, offsetof(SbGmsh, name)},
                 SB_GMSH_FUNCTIONS(ROW)
#undef ROW
};

/* The newest version that is there. */
static PetscErrorCode load(const char *where, void **library, int *minor)
{
  char name[64], why[256] = "";

  PetscFunctionBeginUser;
  for (*minor = NEWEST; *minor >= OLDEST; (*minor)--) {
    const char *error;

    (void)snprintf(name, sizeof(name), "libgmsh.so.4.%d", *minor);
    *library = dlopen(name, BIND);
    if (*library) PetscFunctionReturn(PETSC_SUCCESS);
    /* A library that is there but lacks another one says more than those that are not there. */
    error = dlerror();
    if (error && !strstr(error, name)) (void)snprintf(why, sizeof(why), "; %s", error);
  }
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "%s: needs the gmsh library (libgmsh.so.4.%d or later), which cannot be loaded; install the "
          "package gmsh (Debian, Ubuntu), which brings it, or add its folder to LD_LIBRARY_PATH%s",
          where, OLDEST, why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ messages */

/* The last line of the log that begins like this, without that; "" when there is none. */
static void last_line(const SbGmsh *g, const char *level, size_t size, char text[])
{
  char **log = NULL;
  size_t n = 0;
  int error = 0;

  text[0] = 0;
  g->LoggerGet(&log, &n, &error);
  for (size_t i = 0; !error && i < n; i++) {
    if (!strncmp(log[i], level, strlen(level))) {
      const char *line = log[i] + strlen(level);

      (void)snprintf(text, size, "%s", line + strspn(line, " :"));
    }
  }
  for (char *p = text; *p; p++) {
    if (*p == '\n') *p = ' ';
  }
}

PetscErrorCode SbGmshError(const SbGmsh *g, const char *function)
{
  char text[256];

  PetscFunctionBeginUser;
  last_line(g, "Error", sizeof(text), text);
  if (!text[0]) last_line(g, "Warning", sizeof(text), text);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: gmsh failed: %s (%s)", g->where,
          text[0] ? text : "no reason given", function);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the mesh of the model */

typedef struct {
  size_t tag;
  size_t from;
} Order;

static int compare_tags(const void *a, const void *b)
{
  const Order *p = (const Order *)a, *q = (const Order *)b;

  return (p->tag > q->tag) - (p->tag < q->tag);
}

/* The elements of one entity: those of use are kept, all are counted by type. */
static PetscErrorCode collect_entity(const SbGmsh *g, int dim, int entity, PetscBool itself, SbImport *im)
{
  int *types;
  size_t ntype, **number, *nnumber, nn, **node, *nnode, nnn;
  PetscInt tags;

  PetscFunctionBeginUser;
  SB_GMSH(g, ModelMeshGetElements, &types, &ntype, &number, &nnumber, &nn, &node, &nnode, &nnn, dim, entity);
  if (ntype) {
    int *physical = NULL;
    size_t n = 0;
    PetscInt *group;
    char *name;

    // tag set of an entity: its physical groups with their names, or itself
    if (!itself) SB_GMSH(g, ModelGetPhysicalGroupsForEntity, dim, entity, &physical, &n);
    PetscCall(PetscMalloc1(n + 1, &group));
    for (size_t i = 0; i < n; i++) {
      SB_GMSH(g, ModelGetPhysicalName, dim, physical[i], &name);
      PetscCall(SbImportGroup(im, dim, physical[i], name && name[0] ? name : NULL, &group[i]));
      g->Free(name);
    }
    if (itself) {
      PetscCall(SbImportGroup(im, dim, entity, NULL, &group[0]));
      n = 1;
    }
    PetscCall(SbImportTagSet(im, (PetscInt)n, group, &tags));
    PetscCall(PetscFree(group));
    g->Free(physical);
  }
  for (size_t t = 0; t < ntype; t++) {
    const int type = types[t];

    PetscCheck(type > 0 && type < SB_GMSH_NTYPES, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s: holds elements of gmsh's type %d; supple simulates 4-node tetrahedra only", g->where,
               type);
    for (size_t i = 0; i < nnumber[t]; i++) {
      const int n = SbGmshTypes[type].nnode;
      PetscInt vert[4] = {0, 0, 0, 0};

      for (int k = 0; k < PetscMin(n, 4); k++) {
        const size_t tag = node[t][i * (size_t)n + (size_t)k];

        vert[k] = SbNumbersFind(&im->nodes, (int64_t)tag);
        PetscCheck(vert[k] >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
                   "%s: element %zu uses node %zu, which is not there", g->where, number[t][i], tag);
      }
      PetscCall(SbImportAddElement(im, type, vert, tags, (int64_t)number[t][i]));
    }
    g->Free(number[t]);
    g->Free(node[t]);
  }
  g->Free(types);
  g->Free(number);
  g->Free(nnumber);
  g->Free(node);
  g->Free(nnode);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGmshCollect(const SbGmsh *g, SbGmshGroups groups, SbImport *im)
{
  int *entity, *physical;
  size_t n, nphysical;
  PetscBool itself = PETSC_FALSE;
  size_t *tag, ntag, nx, nparameter;
  double *x, *parameter;
  Order *order;

  PetscFunctionBeginUser;
  // all nodes, ascending tags
  SB_GMSH(g, ModelMeshGetNodes, &tag, &ntag, &x, &nx, &parameter, &nparameter, -1, -1, 0, 0);
  PetscCheck(ntag < PETSC_MAX_INT / 8, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: %zu nodes are more than this build can number", g->where, ntag);
  PetscCall(PetscMalloc1(ntag + 1, &order));
  for (size_t i = 0; i < ntag; i++) order[i] = (Order){tag[i], i};
  qsort(order, ntag, sizeof(*order), compare_tags);
  PetscCall(SbImportSetVertices(im, (PetscInt)ntag));
  for (size_t i = 0; i < ntag; i++) {
    im->vert_number[i] = (int64_t)order[i].tag;
    for (int k = 0; k < 3; k++) {
      im->x[3 * i + k] = x[3 * order[i].from + k];
      PetscCheck(isfinite(im->x[3 * i + k]), PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
                 "%s: coordinate of node %zu is not a finite number; repair the file", g->where,
                 order[i].tag);
    }
  }
  PetscCall(PetscFree(order));
  g->Free(tag);
  g->Free(x);
  g->Free(parameter);
  PetscCall(SbNumbersCreate(im->nvert, im->vert_number, &im->nodes));
  if (groups == SB_GMSH_ENTITIES) {
    SB_GMSH(g, ModelGetPhysicalGroups, &physical, &nphysical, -1);
    itself = (PetscBool)(nphysical == 0);
    g->Free(physical);
  }
  SB_GMSH(g, ModelGetEntities, &entity, &n, -1);
  for (size_t i = 0; i + 1 < n; i += 2) PetscCall(collect_entity(g, entity[i], entity[i + 1], itself, im));
  g->Free(entity);
  // items in the order of their numbers: entities had torn that of the file
  for (int d = 0; d < 4; d++) {
    SbItems *item = &im->item[d], old = *item;

    PetscCall(PetscMalloc1(old.n, &order));
    for (PetscInt i = 0; i < old.n; i++) order[i] = (Order){(size_t)old.number[i], (size_t)i};
    if (old.n) qsort(order, (size_t)old.n, sizeof(*order), compare_tags);
    PetscCall(SbImportSetItems(im, d, old.n));
    for (PetscInt i = 0; i < old.n; i++) {
      const PetscInt from = (PetscInt)order[i].from;

      for (int k = 0; k <= d; k++) item->vert[(d + 1) * i + k] = old.vert[(d + 1) * from + k];
      item->tags[i] = old.tags[from];
      item->number[i] = old.number[from];
    }
    PetscCall(SbItemsFree(&old));
    PetscCall(PetscFree(order));
  }
  PetscCall(SbImportCheckTypes(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the job */

static PetscErrorCode in_child(void *ctx, SbImport *im)
{
  const SbGmshJob *job = (const SbGmshJob *)ctx;
  SbGmsh g;
  void *library, (*before_9)(int, char **, int, int *);
  int minor, error = 1;
  void (*from_9)(int, char **, int, int, int *);
  void *start;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&g, sizeof(g)));
  g.where = job->where;
  PetscCall(load(g.where, &library, &minor));
  // the functions of the library, by name
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(functions); i++) {
    void *address = dlsym(library, functions[i].name);

    PetscCheck(address, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: the gmsh library has no function %s; install a version from 4.8 on", g.where,
               functions[i].name);
    memcpy((char *)&g + functions[i].offset, &address, sizeof(address));
  }
  // the library starts: quiet, on one thread, with an empty model
  start = dlsym(library, "gmshInitialize");
  if (start && minor < 9) {
    memcpy(&before_9, &start, sizeof(start));
    (*before_9)(0, NULL, 0, &error);
  } else if (start) {
    memcpy(&from_9, &start, sizeof(start));
    (*from_9)(0, NULL, 0, 0, &error);
  }
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_LIB, "%s: gmshInitialize() of version 4.%d failed", g.where,
             minor);
  SB_GMSH(&g, OptionSetNumber, "General.Terminal", 0);
  SB_GMSH(&g, OptionSetNumber, "General.NumThreads", 1);
  SB_GMSH(&g, OptionSetNumber, "General.Verbosity", 4);
  SB_GMSH0(&g, LoggerStart);
  SB_GMSH(&g, ModelAdd, "supple");
  PetscCall((*job->work)(&g, job->ctx, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGmshRun(const SbGmshJob *job, SbImport *im)
{
  SbGmshJob mine = *job;

  PetscFunctionBeginUser;
  PetscCall(SbChildRun("gmsh", job->doing, job->seconds, in_child, &mine, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
