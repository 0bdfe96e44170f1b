/*
  gmsh_library.c - loads the gmsh library at run time, in a child process.

  The library is found by its versioned file name: the arguments of gmshInitialize() changed in 4.9.
  It prints nothing; its logger keeps the messages, and the last error (or warning) becomes part of
  ours.
*/
#include <dlfcn.h>
#include <stddef.h>
#include "meshio_impl.h"

enum {
  OLDEST = 8,
  NEWEST = 30
}; /* minor versions: 4.8 to 4.30 */

/* RTLD_DEEPBIND: a gmsh with its own METIS and other libraries must use those, not the ones of this
   program. The address sanitizer forbids it. */
#if defined(__has_feature)
  #if __has_feature(address_sanitizer)
    #define SANITIZED /* as clang tells it */
  #endif
#endif
#if defined(SANITIZED) || defined(__SANITIZE_ADDRESS__) || !defined(RTLD_DEEPBIND)
  #define BIND (RTLD_NOW | RTLD_LOCAL)
#else
  #define BIND (RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND)
#endif

static const struct {
  const char *name;
  size_t offset;
} functions[] = {{"gmshFree", offsetof(SbGmsh, Free)},
#define ROW(type, name, arguments) {"gmsh" #name, offsetof(SbGmsh, name)},
                 SB_GMSH_FUNCTIONS(ROW)
#undef ROW
};

/* Last line of the log with the prefix `level`, without the prefix; "" if there is none. */
static void last_line(const SbGmsh *g, const char *level, size_t size, char text[])
{
  char **log = NULL;
  size_t n = 0;
  int error = 0;

  text[0] = 0;
  g->LoggerGet(&log, &n, &error);
  for (size_t i = 0; !error && i < n; i++) {
    const char *line = strncmp(log[i], level, strlen(level)) ? NULL : log[i] + strlen(level);

    if (line)
      (void)snprintf(text, size, "%s", line + strspn(line, " :"));
  }
  for (char *p = text; *p; p++)
    if (*p == '\n')
      *p = ' ';
}

PetscErrorCode SbGmshError(const SbGmsh *g, const char *function)
{
  char text[256];

  PetscFunctionBeginUser;
  last_line(g, "Error", sizeof(text), text);
  if (!text[0])
    last_line(g, "Warning", sizeof(text), text);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s: gmsh failed: %s (%s)", g->where,
          text[0] ? text : "no reason given", function);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGmshCall(const SbGmshJob *job, SbImport *im)
{
  SbGmsh g = {.where = job->where};
  void *library = NULL, *start, (*before_9)(int, char **, int, int *),
       (*from_9)(int, char **, int, int, int *);
  char name[64];
  char why[256] = "";
  const char *message;
  int minor = NEWEST + 1;
  int error = 1;

  PetscFunctionBeginUser;

  // the newest installed version
  while (!library && minor > OLDEST) {
    (void)snprintf(name, sizeof(name), "libgmsh.so.4.%d", --minor);
    library = dlopen(name, BIND);

    /* the error of an installed library with a missing dependency is more useful than "not
       found" */
    message = library ? NULL : dlerror();
    if (message && !strstr(message, name))
      (void)snprintf(why, sizeof(why), "; %s", message);
  }
  PetscCheck(
    library, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: needs the gmsh library (libgmsh.so.4.%d or later), which cannot be loaded; install the "
    "package gmsh (Debian, Ubuntu), which brings it, or add its folder to LD_LIBRARY_PATH%s",
    g.where, OLDEST, why);

  // look up the functions of the library by name
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(functions); i++) {
    void *address = dlsym(library, functions[i].name);

    PetscCheck(address, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: the gmsh library has no function %s; install a version from 4.8 on", g.where,
               functions[i].name);
    memcpy((char *)&g + functions[i].offset, &address, sizeof(address));
  }

  // initialise the library: no output, one thread, an empty model
  start = dlsym(library, "gmshInitialize");
  if (start && minor < 9) {
    memcpy(&before_9, &start, sizeof(start));
    (*before_9)(0, NULL, 0, &error);
  } else if (start) {
    memcpy(&from_9, &start, sizeof(start));
    (*from_9)(0, NULL, 0, 0, &error);
  }
  PetscCheck(!error, PETSC_COMM_SELF, PETSC_ERR_LIB, "%s: gmshInitialize() of version 4.%d failed",
             g.where, minor);
  SB_GMSH(&g, OptionSetNumber, "General.Terminal", 0);
  SB_GMSH(&g, OptionSetNumber, "General.NumThreads", 1);
  SB_GMSH(&g, OptionSetNumber, "General.Verbosity", 4);
  SB_GMSH0(&g, LoggerStart);
  SB_GMSH(&g, ModelAdd, "supple");
  PetscCall((*job->work)(&g, job->ctx, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
