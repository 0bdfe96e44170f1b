/*
  abaqus_lines.c - lines of an Abaqus input file: keywords with parameters, values between commas,
  labels and names of sets.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "abaqus.h"

enum {
  WORD = SB_ABAQUS_WORD
};

PetscBool SbAbaqusNextLine(SbScan *s)
{
  for (SbScanNext(s); s->at[0] == '*' && s->at[1] == '*'; SbScanNext(s))
    SbScanEndOfLine(s);
  return (PetscBool)(s->at < s->end);
}

PetscBool SbAbaqusDataLine(SbAbaqus *a)
{
  SbScanEndOfLine(a->scan);
  return (PetscBool)(SbAbaqusNextLine(a->scan) && *a->scan->at != '*');
}

PetscBool SbAbaqusNext(SbAbaqus *a, char word[WORD])
{
  SbScan *s = a->scan;
  size_t n = 0;

  if (!SbScanMore(s, '\n'))
    return PETSC_FALSE;
  for (; s->at < s->end && *s->at != '\n' && *s->at != ','; s->at++)
    if (n + 1 < WORD && *s->at != '"')
      word[n++] = *s->at;
  s->at += *s->at == ',';
  while (n && isspace((unsigned char)word[n - 1]))
    n--;
  word[n] = 0;
  SbCleanName(word, ' ');
  return PETSC_TRUE;
}

void SbAbaqusKeyword(SbAbaqus *a)
{
  SbScan *s = a->scan;
  char word[WORD];

  a->line = s->token = s->at;
  a->nparameter = 0;
  (void)SbAbaqusNext(a, a->keyword);
  for (;;) {
    const char *at = s->at;

    if (!SbAbaqusNext(a, word)) {
      // the line goes on behind a comma at its end
      if (s->at[-1] != ',' && at[-1] != ',')
        break;
      SbScanEndOfLine(s);
      if (!SbAbaqusNextLine(s) || *s->at == '*') {
        s->at = at;
        break;
      }
      (void)SbAbaqusNext(a, word);
    }
    if (a->nparameter < SB_ABAQUS_PARAMETERS) {
      char *name = a->parameter[a->nparameter][0];
      char *value = a->parameter[a->nparameter++][1];
      const size_t n = strcspn(word, "=");

      // blanks around the equals sign mean nothing
      (void)snprintf(name, WORD, "%.*s", (int)n, word);
      for (char *end = name + strlen(name); end > name && end[-1] == ' ';)
        *--end = 0;
      (void)snprintf(value, WORD, "%s", word[n] ? word + n + 1 + strspn(word + n + 1, " ") : "");
    }
  }
  s->token = a->line;
}

const char *SbAbaqusParameter(const SbAbaqus *a, const char *name)
{
  for (int i = 0; i < a->nparameter; i++)
    if (!strcasecmp(a->parameter[i][0], name))
      return a->parameter[i][1];
  return NULL;
}

PetscErrorCode SbAbaqusParse(SbAbaqus *a, const char *word, const char *what, int64_t *value)
{
  char *end;

  PetscFunctionBeginUser;
  *value = strtoll(word, &end, 10);
  if (!word[0] || *end || *value < 0 || *value > INT32_MAX)
    SB_SCAN_ERROR(a->scan, "expected the %s, found '%.24s'", what, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusNumber(SbAbaqus *a, const char *what, int64_t *value)
{
  char word[WORD];

  PetscFunctionBeginUser;
  if (SbAbaqusNext(a, word) && word[0])
    PetscCall(SbAbaqusParse(a, word, what, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusReals(SbAbaqus *a, const char *what, int n, PetscReal x[])
{
  char word[WORD];

  PetscFunctionBeginUser;
  for (int i = 0; i < n; i++) {
    char *end = word;

    x[i] = 0;
    if (!SbAbaqusNext(a, word) || !word[0])
      continue;
    for (char *p = word; *p; p++) // exponents of Fortran
      *p = *p == 'D' || *p == 'd' ? 'E' : *p;
    x[i] = strtod(word, &end);
    if (*end || !isfinite(x[i]))
      SB_SCAN_ERROR(a->scan, "expected %s, found '%.24s'", what, word);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusPrefixedSet(SbAbaqus *a, PetscBool of_nodes, const char *prefix,
                                   const char *name, PetscInt *set)
{
  char full[2 * WORD];

  PetscFunctionBeginUser;
  (void)snprintf(full, sizeof(full), "%s%s", prefix, name);
  if (strlen(full) >= SB_GROUP_MAX)
    SB_SCAN_ERROR(a->scan, "the name '%.40s...' is longer than %d bytes", full, SB_GROUP_MAX - 1);
  PetscCall(SbDeckFindSet(&a->deck, of_nodes, full, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusSet(SbAbaqus *a, PetscBool of_nodes, const char *name, PetscInt *set)
{
  PetscFunctionBeginUser;
  PetscCall(SbAbaqusPrefixedSet(a, of_nodes, a->prefix, name, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusIncluded(SbScan *s, const char *line, SbIncludeFile *file)
{
  const size_t word = *line == '*' ? strcspn(line, ", \t\r\n") : 0;
  const char *p = line;
  const char *end = file->end;

  PetscFunctionBeginUser;
  (void)s;
  file->whole = (PetscBool)(word == 8 && !strncasecmp(line, "*INCLUDE", 8));
  if (!file->whole && !(word == 5 && !strncasecmp(line, "*NODE", 5)) &&
      !(word == 8 && !strncasecmp(line, "*ELEMENT", 8)))
    PetscFunctionReturn(PETSC_SUCCESS);
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
    for (; p < end && *p != ',' && n + 1 < sizeof(file->name); p++)
      if (*p != '"')
        file->name[n++] = *p;
    while (n && isspace((unsigned char)file->name[n - 1]))
      n--;
    file->name[n] = 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
