/*
  import_library.c - files that the gmsh library reads for us: gmsh's own format 4.0.

  gmsh takes what it does not know for a script of its own, and would run it: only what is known by its content gets there.
*/
#include "meshio_impl.h"
#include "sbgmsh.h"

static const PetscReal read_seconds = 900; /* s; a file that takes longer is beyond this program's memory */

static PetscErrorCode open_msh(const SbGmsh *g, void *ctx, SbImport *im)
{
  int *entity;
  size_t n;

  PetscFunctionBeginUser;
  SB_GMSH(g, Open, (const char *)ctx);
  SB_GMSH(g, ModelGetEntities, &entity, &n, -1);
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: gmsh finds no mesh in it; it is empty, damaged, or not what its ending says", g->where);
  g->Free(entity);
  PetscCall(SbGmshCollect(g, SB_GMSH_PHYSICAL, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Msh(const char *path, SbImport *im)
{
  static const char begin[] = "$MeshFormat";
  PetscBool foreign;
  SbScan s;
  char word[32] = "", version[16] = "";
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  // whether it is of version 4.0, which the own reader does not know
  ierr = SbScanOpen(im->where, path, &s);
  if (!ierr) ierr = SbScanWord(&s, sizeof(word), word);
  if (!ierr) ierr = SbScanWord(&s, sizeof(version), version);
  PetscCall(SbScanClose(&s));
  PetscCall(ierr);
  foreign = (PetscBool)(!strcmp(word, begin) && (!strcmp(version, "4") || !strcmp(version, "4.0")));
  if (foreign) {
    char copy[PETSC_MAX_PATH_LEN], text[sizeof(begin)] = "";
    const SbGmshJob job = {im->where, "read the file", read_seconds, open_msh, copy};
    FILE *file = fopen(path, "rb");

    // gmsh knows the format by the very first letters; with a blank line or the mark of UTF-8 in front it would run the file
    if (file) {
      (void)fread(text, 1, sizeof(begin) - 1, file);
      (void)fclose(file);
    }
    PetscCheck(!strcmp(text, begin), PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s line 1: a file of version 4.0 must begin with %s; remove what stands before it", im->where,
               begin);
    PetscCall(PetscStrncpy(copy, path, sizeof(copy)));
    PetscCall(SbGmshRun(&job, im));
  } else
    PetscCall(SbImportRead_Gmsh(path, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
