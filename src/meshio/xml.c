/*
  xml.c - the tags of an XML file, one after the other, with the text between them.

  Known are elements, attributes, text, CDATA, comments, processing instructions and a document type
  without declarations. Tags must nest. The five entities of XML are replaced in attributes; nothing
  is looked up outside of the file.
*/
#include <ctype.h>
#include "meshio_impl.h"

/* Passes over "<!-- -->", "<? ?>", "<! >", of which blanks remain in the text, and over CDATA, of
   which its text remains. */
static PetscErrorCode pass_over(SbXml *x, PetscBool *passed)
{
  static const char *const kinds[][2] = {
    {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}};
  SbScan *s = x->scan;
  int k = 0;
  char *from = s->data + (s->at - s->data);
  char *to;

  PetscFunctionBeginUser;
  while (k < 4 && strncmp(from, kinds[k][0], strlen(kinds[k][0])) != 0)
    k++;
  *passed = (PetscBool)(k < 4);
  if (!*passed)
    PetscFunctionReturn(PETSC_SUCCESS);
  to = strstr(from, kinds[k][1]);
  if (!to)
    SB_SCAN_ERROR(s, "'%s' has no end '%s'; the file is truncated or damaged", kinds[k][0],
                  kinds[k][1]);
  to += strlen(kinds[k][1]);
  for (char *p = from; p < to; p++)
    if ((k != 1 || p < from + 9 || p >= to - 3) && *p != '\n')
      *p = ' ';
  s->at = to;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbXmlNext(SbXml *x, PetscBool *more)
{
  SbScan *s = x->scan;
  PetscBool passed = PETSC_TRUE;
  char quote = 0;
  size_t n = 0;

  PetscFunctionBeginUser;
  *more = PETSC_FALSE;
  x->text = x->text_end = s->at;

  // the end of an element without content, <name/>
  if (x->empty) {
    x->empty = x->opens = PETSC_FALSE;
    x->depth--;
    *more = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  while (passed) {
    const char *p = (const char *)memchr(s->at, '<', (size_t)(s->end - s->at));

    s->token = s->at = p ? p : s->end;
    x->text_end = s->at;
    if (!p && x->depth)
      SB_SCAN_ERROR(s, "the element %s has no end; the file is truncated, write or copy it again",
                    x->open[x->depth - 1]);
    if (!p)
      PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(pass_over(x, &passed));
  }

  // from the < to the >, which may stand in quotes
  x->begin = s->at++;
  for (; s->at < s->end && (quote || *s->at != '>'); s->at++)
    if (quote)
      quote = *s->at == quote ? 0 : quote;
    else if (*s->at == '"' || *s->at == '\'')
      quote = *s->at;
    else if (*s->at == '<')
      break;
  if (s->at >= s->end || *s->at != '>')
    SB_SCAN_ERROR(s, "a tag has no end '>'; the file is truncated or damaged");
  x->end = s->at++;
  x->opens = (PetscBool)(x->begin[1] != '/');
  x->empty = (PetscBool)(x->opens && x->end[-1] == '/');
  for (const char *p = x->begin + (x->opens ? 1 : 2);
       p < x->end && !isspace((unsigned char)*p) && *p != '/'; p++)
    if (n + 1 < sizeof(x->name))
      x->name[n++] = *p;
  x->name[n] = 0;
  SbCleanName(x->name, '?');

  // tags nest
  if (!x->opens) {
    if (!x->depth || strcmp(x->open[x->depth - 1], x->name) != 0)
      SB_SCAN_ERROR(s, "the end of an element %s, where that of %s is expected", x->name,
                    x->depth ? x->open[x->depth - 1] : "none");
    x->depth--;
  } else {
    if (x->depth == SB_XML_DEPTH)
      SB_SCAN_ERROR(s, "more than %d elements in each other", SB_XML_DEPTH);
    memcpy(x->open[x->depth++], x->name, sizeof(x->name));
  }
  *more = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbXmlAttribute(const SbXml *x, const char *name, size_t size, char value[])
{
  static const struct {
    const char *entity;
    char letter;
  } entities[] = {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
  const size_t length = strlen(name);
  const char *p = x->begin + 1;
  size_t n = 0;

  value[0] = 0;
  while (p < x->end && !isspace((unsigned char)*p))
    p++;
  while (p < x->end) {
    const char *key, *key_end;
    char quote;

    while (p < x->end && (isspace((unsigned char)*p) || *p == '/'))
      p++;
    key = p;
    while (p < x->end && *p != '=' && !isspace((unsigned char)*p))
      p++;
    key_end = p;
    while (p < x->end && (isspace((unsigned char)*p) || *p == '='))
      p++;
    if (p >= x->end || (*p != '"' && *p != '\''))
      return PETSC_FALSE;
    quote = *p++;
    if ((size_t)(key_end - key) != length || strncmp(key, name, length) != 0) {
      while (p < x->end && *p != quote)
        p++;
      p += p < x->end;
      continue;
    }
    while (p < x->end && *p != quote && n + 1 < size) {
      size_t step = 1;

      value[n] = *p;
      for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(entities) && *p == '&'; i++) {
        if (strncmp(p, entities[i].entity, strlen(entities[i].entity)) != 0)
          continue;
        step = strlen(entities[i].entity);
        value[n] = entities[i].letter;
      }
      n++;
      p += step;
    }
    value[n] = 0;
    SbCleanName(value, '?');
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode SbXmlSkip(SbXml *x)
{
  const int depth = x->depth;
  PetscBool more;

  PetscFunctionBeginUser;
  do
    PetscCall(SbXmlNext(x, &more));
  while (x->depth >= depth);
  PetscFunctionReturn(PETSC_SUCCESS);
}
