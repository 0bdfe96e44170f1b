/*
  abaqus_include.c - other files that are a part of an Abaqus input file: *INCLUDE, and the data of
  *NODE and *ELEMENT with INPUT. Their lines take the place of the line, or follow it; messages name
  the file and line where they stand. A relative name counts from the folder of the first file.
*/
#include <ctype.h>
#include <strings.h>
#include "abaqus.h"

enum {
  DEPTH = 10, /* files within files, at most */
  FILES = 1000
};

/* The text that is made, and the files that are open. */
typedef struct {
  SbImport *im;
  const char *folder; /* "" or with a slash at its end */
  const char *open[DEPTH + 1];
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

/* Name of the file that a keyword line refers to, "" for none; *whole: it is *INCLUDE. */
static void file_of(const char *line, const char *end, char name[PETSC_MAX_PATH_LEN],
                    PetscBool *whole)
{
  const char *p = line;
  const size_t word = strcspn(line, ", \t\r\n");

  name[0] = 0;
  *whole = (PetscBool)(word == 8 && !strncasecmp(line, "*INCLUDE", 8));
  if (!*whole && !(word == 5 && !strncasecmp(line, "*NODE", 5)) &&
      !(word == 8 && !strncasecmp(line, "*ELEMENT", 8)))
    return;
  while ((p = (const char *)memchr(p, ',', (size_t)(end - p))) != NULL) {
    size_t n = 0;

    for (p++; p < end && isspace((unsigned char)*p); p++)
      continue;
    if (end - p < 6 || strncasecmp(p, "INPUT", 5) != 0)
      continue;
    for (p += 5; p < end && isspace((unsigned char)*p); p++)
      continue;
    if (p >= end || *p != '=')
      continue;
    for (p++; p < end && isspace((unsigned char)*p); p++)
      continue;
    for (; p < end && *p != ',' && n + 1 < PETSC_MAX_PATH_LEN; p++)
      if (*p != '"')
        name[n++] = *p;
    while (n && isspace((unsigned char)name[n - 1]))
      n--;
    name[n] = 0;
    return;
  }
}

static PetscErrorCode expand(Expand *x, SbScan *s, int depth)
{
  const char *from = s->data; // lines not appended yet
  size_t first = 1;
  size_t number = 1;

  PetscFunctionBeginUser;
  for (const char *line = s->data, *end; line < s->end; line = end, number++) {
    char name[PETSC_MAX_PATH_LEN];
    char *where = NULL;
    char *path = NULL;
    PetscBool whole;
    SbScan other;
    PetscErrorCode ierr;
    size_t room;

    end = (const char *)memchr(line, '\n', (size_t)(s->end - line));
    end = end ? end + 1 : s->end;
    if (*line != '*')
      continue;
    file_of(line, end, name, &whole);
    if (!name[0])
      continue;
    s->token = line;
    room = strlen(x->folder) + strlen(name) + 1;
    PetscCall(SbImportScratch(x->im, room, &path));
    (void)snprintf(path, room, "%s%s", *name == '/' ? "" : x->folder, name);
    for (int k = 0; k < depth; k++)
      if (!strcmp(x->open[k], path))
        SB_SCAN_ERROR(s, "the file '%.200s' includes itself", name);
    if (depth == DEPTH || ++x->nfile > FILES)
      SB_SCAN_ERROR(s, "more than %d files, or %d within each other", FILES, DEPTH);
    PetscCall(append(x, s, from, whole ? line : end, first));
    from = end;
    first = number + 1;

    // its text
    room = sizeof(x->im->where) + strlen(path) + 4;
    PetscCall(SbImportScratch(x->im, room, &where));
    (void)snprintf(where, room, "%s: %s", x->im->where, path);
    ierr = SbScanOpen(where, path, &other);
    x->open[depth] = path;
    if (!ierr)
      ierr = expand(x, &other, depth + 1);
    PetscCall(PetscFree(other.data));
    PetscCall(ierr);
  }
  PetscCall(append(x, s, from, s->end, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusExpand(SbImport *im, const char *path)
{
  const char *slash = strrchr(path, '/');
  char folder[PETSC_MAX_PATH_LEN];
  Expand x = {.im = im, .folder = folder};
  SbScan *s = &im->scan;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  if (!strcasestr(s->data, "INPUT"))
    PetscFunctionReturn(PETSC_SUCCESS);
  (void)snprintf(folder, sizeof(folder), "%.*s", slash ? (int)(slash + 1 - path) : 0, path);
  x.open[0] = path;
  ierr = expand(&x, s, 1);
  if (ierr || !x.nfile) {
    PetscCall(PetscFree(x.text));
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
