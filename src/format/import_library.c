/*
  import_library.c - files that the gmsh library reads for us: gmsh's own format 4.0, and Nastran.

  gmsh takes what it does not know for a script of its own, and would run it: only what is known by its content (.msh) or
  by its extension in the spelling gmsh knows gets there.
*/
#include <strings.h>
#include "format_impl.h"
#include "sbgmsh.h"

static const PetscReal read_seconds = 900; /* s; a file that takes longer is beyond this program's memory */

static PetscErrorCode open_file(const SbGmsh *g, const char *path, SbGmshGroups groups, SbImport *im)
{
  int *entity;
  size_t n;

  PetscFunctionBeginUser;
  SB_GMSH(g, Open, path);
  SB_GMSH(g, ModelGetEntities, &entity, &n, -1);
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: gmsh finds no mesh in it; it is empty, damaged, or not what its ending says", g->where);
  g->Free(entity);
  PetscCall(SbGmshCollect(g, groups, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode open_msh(const SbGmsh *g, void *ctx, SbImport *im)
{
  return open_file(g, (const char *)ctx, SB_GMSH_PHYSICAL, im);
}

static PetscErrorCode open_other(const SbGmsh *g, void *ctx, SbImport *im)
{
  return open_file(g, (const char *)ctx, SB_GMSH_ENTITIES, im);
}

static PetscErrorCode read_by_library(const char *path, SbGmshWork work, SbImport *im)
{
  char copy[PETSC_MAX_PATH_LEN];
  const SbGmshJob job = {im->where, "read the file", read_seconds, work, copy};
  SbScan scan;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  /* What cannot be opened, or is empty, has the same message as everywhere. */
  ierr = SbScanOpen(im->where, path, &scan);
  PetscCall(SbScanClose(&scan));
  PetscCall(ierr);
  PetscCall(PetscStrncpy(copy, path, sizeof(copy)));
  PetscCall(SbGmshRun(&job, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether it is of version 4.0, which the own reader does not know. */
static PetscErrorCode foreign_msh(const char *path, const char *where, PetscBool *foreign)
{
  SbScan s;
  char word[32] = "", version[16] = "";
  PetscErrorCode ierr = SbScanOpen(where, path, &s);

  PetscFunctionBeginUser;
  if (!ierr) ierr = SbScanWord(&s, sizeof(word), word);
  if (!ierr) ierr = SbScanWord(&s, sizeof(version), version);
  PetscCall(SbScanClose(&s));
  PetscCall(ierr);
  *foreign = (PetscBool)(!strcmp(word, "$MeshFormat") && (!strcmp(version, "4") || !strcmp(version, "4.0")));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Msh(const char *path, SbImport *im)
{
  PetscBool foreign = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(foreign_msh(path, im->where, &foreign));
  if (foreign)
    PetscCall(read_by_library(path, open_msh, im));
  else
    PetscCall(SbImportRead_Gmsh(path, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *im)
{
  const char *dot = strrchr(path, '.');

  PetscFunctionBeginUser;
  PetscCheck(
    dot && (!strcmp(dot, ".bdf") || !strcmp(dot, ".BDF") || !strcmp(dot, ".nas") || !strcmp(dot, ".NAS")),
    PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: gmsh knows Nastran files by the endings .bdf and .nas, in lower or upper case; rename the file",
    im->where);
  PetscCall(read_by_library(path, open_other, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
