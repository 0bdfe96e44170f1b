/*
  include.c - other files that are a part of a text file, as Abaqus' *INCLUDE and Nastran's INCLUDE.

  Their text takes the place of the lines that name them, or follows these; messages name the file
  and line where it stands. A relative name counts from the folder of the first file, or of the one
  that names it and then of the first; where no file has a name with backslashes, they count as
  slashes. Errors: files within themselves (device and number of the file are compared, whatever its
  name), more than DEPTH within each other, more than FILES in all.
*/
#include <sys/stat.h>
#include "meshio_impl.h"

enum {
  DEPTH = 10, /* files within files, at most */
  FILES = 1000
};

/* The text that is made, and the files that are open. */
typedef struct {
  SbImport *im;
  SbIncludeLine line;
  const char *path;            /* of the first file */
  PetscBool nested;            /* names count from the folder of the file that has them */
  struct stat open[DEPTH + 1]; /* files that are within each other */
  int nfile;
  SbCount nbyte, npiece;
  char *text;
  SbScanPiece *piece;
} Expand;

/* Appends lines from..end of a file, the first of which is number `line`. */
static PetscErrorCode append(Expand *x, const SbScan *s, const char *from, const char *end,
                             size_t line)
{
  const PetscInt n = (PetscInt)(end - from);

  PetscFunctionBeginUser;
  if (n <= 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (n > PETSC_MAX_INT / 2 - x->nbyte.n)
    SB_SCAN_ERROR(s, "the files are larger than this build can number");
  PetscCall(SbImportGrow(x->im, &x->npiece, sizeof(*x->piece), &x->piece));
  x->piece[x->npiece.n - 1] = (SbScanPiece){(size_t)x->nbyte.n, s->where, line};
  if (x->nbyte.n + n + 2 > x->nbyte.capacity) {
    x->nbyte.capacity = 2 * (x->nbyte.n + n + 2);
    PetscCall(PetscRealloc((size_t)x->nbyte.capacity, &x->text));
  }
  PetscCall(PetscArraycpy(x->text + x->nbyte.n, from, n));
  x->nbyte.n += n;
  if (x->text[x->nbyte.n - 1] != '\n')
    x->text[x->nbyte.n++] = '\n';
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportBeside(SbImport *im, const char *folder, const char *name, char **path)
{
  const size_t room = strlen(folder) + strlen(name) + 1;
  struct stat info;

  PetscFunctionBeginUser;
  PetscCall(SbImportScratch(im, room, path));
  (void)snprintf(*path, room, "%s%s", *name == '/' ? "" : folder, name);
  if (!strchr(name, '\\') || !stat(*path, &info))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (char *p = *path + room - 1 - strlen(name); *p; p++)
    *p = *p == '\\' ? '/' : *p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportFolder(SbImport *im, const char *path, char **folder)
{
  const char *slash = strrchr(path, '/');
  const size_t n = slash ? (size_t)(slash + 1 - path) : 0;

  PetscFunctionBeginUser;
  *folder = NULL;
  PetscCall(SbImportScratch(im, n + 1, folder));
  (void)snprintf(*folder, n + 1, "%s", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends the file of a scan, which has this path, with those in it. */
static PetscErrorCode expand(Expand *x, SbScan *s, const char *path, int depth)
{
  const char *from = s->data; // lines not appended yet
  size_t first = 1;
  size_t number = 1;
  char *folder;
  PetscBool stop = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(SbImportFolder(x->im, x->nested ? path : x->path, &folder));
  (void)stat(path, &x->open[depth - 1]);
  for (const char *line = s->data, *end; line < s->end && !stop; line = end) {
    SbIncludeFile file; // not cleared: its name is long, the lines are many
    struct stat info;
    char *other_path = NULL;
    char *where = NULL;
    SbScan other;
    PetscErrorCode ierr;
    size_t room;

    end = (const char *)memchr(line, '\n', (size_t)(s->end - line));
    end = file.end = end ? end + 1 : s->end;
    file.name[0] = 0;
    file.whole = file.stop = PETSC_FALSE;
    number++;
    s->token = line;
    PetscCall((*x->line)(s, line, &file));
    stop = file.stop;
    if (!file.name[0])
      continue;
    for (; end < file.end; end++)
      number += *end == '\n';

    // where it is, and whether it may be read
    PetscCall(SbImportBeside(x->im, folder, file.name, &other_path));
    if (x->nested && depth > 1 && stat(other_path, &info)) {
      char *beside = NULL;
      char *first_folder;

      PetscCall(SbImportFolder(x->im, x->path, &first_folder));
      PetscCall(SbImportBeside(x->im, first_folder, file.name, &beside));
      if (!stat(beside, &info))
        other_path = beside;
    }
    for (int k = 0; k < depth && !stat(other_path, &info); k++)
      if (info.st_dev == x->open[k].st_dev && info.st_ino == x->open[k].st_ino)
        SB_SCAN_ERROR(s, "the file '%.200s' includes itself", file.name);
    if (depth == DEPTH || ++x->nfile > FILES)
      SB_SCAN_ERROR(s, "more than %d files, or %d within each other", FILES, DEPTH);
    PetscCall(append(x, s, from, file.whole ? line : end, first));
    from = end;
    first = number;

    // its text
    room = sizeof(x->im->where) + strlen(other_path) + 4;
    PetscCall(SbImportScratch(x->im, room, &where));
    (void)snprintf(where, room, "%s: %s", x->im->where, other_path);
    ierr = SbScanOpen(where, other_path, &other);
    if (!ierr)
      ierr = expand(x, &other, other_path, depth + 1);
    PetscCall(PetscFree(other.data));
    PetscCall(ierr);
  }
  PetscCall(append(x, s, from, s->end, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportExpand(SbImport *im, const char *path, PetscBool nested, SbIncludeLine line)
{
  Expand x = {.im = im, .path = path, .nested = nested, .line = line};
  SbScan *s = &im->scan;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = expand(&x, s, path, 1);
  if (ierr || !x.nfile) {
    PetscCall(PetscFree(x.text));
    s->at = s->token = s->data;
    PetscFunctionReturn(ierr);
  }
  PetscCall(PetscFree(s->data));
  PetscCall(PetscRealloc((size_t)x.nbyte.n + 1, &x.text));
  x.text[x.nbyte.n] = 0;
  s->data = x.text;
  s->at = s->token = s->data;
  s->end = s->data + x.nbyte.n;
  s->piece = x.piece;
  s->npiece = x.npiece.n;
  PetscFunctionReturn(PETSC_SUCCESS);
}
