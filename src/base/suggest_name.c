/*
  suggest_name.c - names similar to a misspelt one.

  Distance between words: optimal string alignment (Levenshtein's distance, in which a transposition
  of neighbours is one edit; Damerau, Communications of the ACM 7, 1964). Case-insensitive, as in
  PETSc.
*/
#include <ctype.h>
#include <stdlib.h>
#include "option.h"

static PetscInt edit_distance(const char *a, const char *b)
{
  PetscInt row[3][SB_OPTION_NAME_MAX + 1];
  const size_t na = PetscMin(strlen(a), SB_OPTION_NAME_MAX);
  const size_t nb = PetscMin(strlen(b), SB_OPTION_NAME_MAX);

  for (size_t j = 0; j <= nb; j++)
    row[0][j] = (PetscInt)j;
  for (size_t i = 1; i <= na; i++) {
    PetscInt *now = row[i % 3];
    PetscInt *before = row[(i + 2) % 3];
    PetscInt *older = row[(i + 1) % 3];

    now[0] = (PetscInt)i;
    for (size_t j = 1; j <= nb; j++) {
      const int same = tolower((unsigned char)a[i - 1]) == tolower((unsigned char)b[j - 1]);

      now[j] = PetscMin(PetscMin(before[j], now[j - 1]) + 1, before[j - 1] + !same);
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        now[j] = PetscMin(now[j], older[j - 2] + 1);
    }
  }
  return row[na % 3][nb];
}

/* Whether a word of three letters or more is one of those that underscores join in a name. */
static PetscBool is_part(const char *word, const char *name)
{
  const size_t n = strlen(word);

  for (const char *part = name; n > 2 && part; part = strchr(part, '_')) {
    part += part[0] == '_';
    if (!strncasecmp(part, word, n) && (!part[n] || part[n] == '_'))
      return (PetscBool)(strlen(name) > n);
  }
  return PETSC_FALSE;
}

/* Whether one of the first n names is this one. */
static PetscBool is_among(const char *name, PetscInt n, const char *const names[])
{
  for (PetscInt j = 0; j < n; j++)
    if (names[j] && !strcmp(name, names[j]))
      return PETSC_TRUE;
  return PETSC_FALSE;
}

void SbSuggestNames(const char *word, PetscInt n, const char *const names[], size_t size,
                    char text[])
{
  const PetscInt farthest = strlen(word) < 6 ? 1 : 2; /* largest edit distance of a similar name */
  PetscInt best = farthest + 1;
  PetscInt nbest = 0;

  text[0] = 0;
  for (PetscInt i = 0; i < n; i++)
    if (names[i])
      best = PetscMin(best, edit_distance(word, names[i]));

  // the most similar names, or those of which it is a word: hypre of cg_hypre
  for (PetscInt i = 0; i < n && nbest < 3; i++) {
    const PetscBool takes =
      (PetscBool)(names[i] && (best > farthest ? is_part(word, names[i])
                                               : edit_distance(word, names[i]) == best));

    if (takes && !is_among(names[i], i, names))
      SbAppend(size, text, "%s%s", nbest++ ? " or " : "", names[i]);
  }
}

void SbSuggestName(const char *word, PetscInt n, const char *const names[], size_t size,
                   char text[])
{
  char near[256];

  text[0] = 0;
  for (PetscInt i = 0; i < n; i++)
    SbAppend(size, text, "%s%s", i ? ", " : "", names[i]);
  SbSuggestNames(word, n, names, sizeof(near), near);
  if (near[0])
    SbAppend(size, text, "; did you mean %s?", near);
}

static int compare_texts(const void *a, const void *b)
{
  return strcmp(*(const char *const *)a, *(const char *const *)b);
}

void SbAdviseSorted(const char *word, PetscInt n, const char *names[], size_t size, char text[])
{
  qsort(names, (size_t)n, sizeof(*names), compare_texts);
  SbSuggestName(word, n, names, size, text);
}

PetscBool SbHasPrefix(const char *word, const char *beginnings)
{
  size_t n;

  for (const char *p = beginnings; *p; p += n + strspn(p + n, " ")) {
    n = strcspn(p, " ");
    if (!strncasecmp(word, p, n))
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}
