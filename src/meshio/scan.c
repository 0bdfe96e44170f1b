/*
  scan.c - scanner: a file is read into memory in one piece, then parsed token by token, as text or
  binary.

  Every read is checked against the end of the file. Line numbers are counted only when an error
  occurs. A number of items announced in a file is compared with the number that the rest of the
  file can hold before memory is allocated.
*/
#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <strings.h>
#include <sys/stat.h>
#include "meshio_impl.h"

PetscErrorCode SbScanOpenFile(const char *where, const char *path, FILE **file, size_t *size)
{
  struct stat info;
  const char *why;

  PetscFunctionBeginUser;
  PetscCheck(stat(path, &info) || S_ISREG(info.st_mode), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "%s: is not a regular file; give a mesh file", where);
  why = SbFileOpen(path, 0, file);
  PetscCheck(*file && !fstat(fileno(*file), &info), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "%s: cannot open the file (%s); check the name and the folder the run starts in",
             where, why);
  *size = (size_t)info.st_size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanOpen(const char *where, const char *path, SbScan *s)
{
  FILE *file;
  size_t size, got;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  s->where = where;
  PetscCall(SbScanOpenFile(where, path, &file, &size));
  PetscCall(PetscMalloc1(size + 1, &s->data));
  got = fread(s->data, 1, size, file);
  (void)fclose(file);
  s->data[got] = 0;

  /* skip the UTF-8 byte order mark */
  if (got >= 3 && !memcmp(s->data, "\xef\xbb\xbf", 3)) {
    got -= 3;
    size -= 3;
    memmove(s->data, s->data + 3, got + 1);
  }
  s->at = s->token = s->data;
  s->end = s->data + got;

  /* lines of old Macintosh programs end with a carriage return alone */
  if (!memchr(s->data, '\n', got) && !memchr(s->data, 0, got))
    for (char *p = s->data; p < s->end; p++)
      *p = *p == '\r' ? '\n' : *p;
  PetscCheck(got == size, PETSC_COMM_SELF, PETSC_ERR_FILE_READ,
             "%s: only %zu of %zu bytes could be read", where, got, size);
  PetscCheck(size, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: is empty (0 bytes); write the mesh again", where);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Piece of the last token; NULL: there are none. */
static const SbScanPiece *piece_of(const SbScan *s)
{
  PetscInt k = s->npiece - 1;

  while (k > 0 && s->data + s->piece[k].at > s->token)
    k--;
  return k < 0 ? NULL : &s->piece[k];
}

const char *SbScanWhere(const SbScan *s)
{
  const SbScanPiece *piece = piece_of(s);

  return piece ? piece->where : s->where;
}

const char *SbScanPosition(const SbScan *s, char position[64])
{
  const SbScanPiece *piece = piece_of(s);
  size_t n = piece ? piece->line : 1;

  for (const char *p = s->data + (piece ? piece->at : 0); p < s->token; p++)
    n += s->bytes || *p == '\n' || *p == '\v'; /* a vertical tabulator joins two lines */
  (void)snprintf(position, 64, "%s %zu", s->bytes ? "byte" : "line", n);
  return position;
}

void SbCleanName(char name[], char instead)
{
  for (unsigned char *p = (unsigned char *)name; *p;) {
    int more = -1; /* bytes of a letter of UTF-8 behind its first one; -1: no letter */
    int k = 0;

    if (*p < 0x80 && isprint(*p))
      more = 0;
    else if (*p >= 0xc2 && *p < 0xf5)
      more = *p < 0xe0 ? 1 : 2 + (*p >= 0xf0);
    while (k < more && p[1 + k] >= 0x80 && p[1 + k] < 0xc0)
      k++;

    // the second byte of 0xc2 is a control character below 0xa0
    if (more < 0 || k < more || (*p == 0xc2 && p[1] < 0xa0))
      *p++ = (unsigned char)instead;
    else
      p += 1 + more;
  }
}

void SbScanNext(SbScan *s)
{
  for (;; SbScanEndOfLine(s)) {
    while (s->at < s->end && isspace((unsigned char)*s->at))
      s->at++;
    s->token = s->at;
    if (!s->comment || s->at >= s->end || *s->at != s->comment)
      return;
  }
}

static inline PetscBool ends_token(const SbScan *s, const char *p)
{
  return (PetscBool)(p >= s->end || isspace((unsigned char)*p));
}

/* Raises the error of an unexpected token. */
static PetscErrorCode unexpected(SbScan *s, const char *what, int64_t number)
{
  char found[24];
  char of[32] = "";

  PetscFunctionBeginUser;
  if (number)
    (void)snprintf(of, sizeof(of), " of node %lld", (long long)number);
  if (s->at >= s->end)
    SB_SCAN_ENDS(s, "the %s%s", what, of);
  (void)SbScanWord(s, sizeof(found), found);
  SB_SCAN_ERROR(s, "expected the %s%s, found '%s'", what, of, found);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanText(SbScan *s, const char *what, int64_t *value)
{
  const char *p;
  PetscBool minus;
  int64_t v = 0;
  int ndigit = 0;

  PetscFunctionBeginUser;
  SbScanNext(s);
  p = s->at;
  minus = (PetscBool)(p < s->end && *p == '-');
  if (p < s->end && (*p == '-' || *p == '+'))
    p++;
  for (; p < s->end && *p >= '0' && *p <= '9' && ndigit < 18; p++, ndigit++)
    v = 10 * v + (*p - '0');
  if (!ndigit || !ends_token(s, p))
    PetscCall(unexpected(s, what, 0));
  *value = minus ? -v : v;
  s->at = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes n bytes, converted to the byte order of this machine. */
static inline PetscErrorCode take(SbScan *s, const char *what, size_t n, void *value)
{
  PetscFunctionBeginUser;
  s->token = s->at;
  if ((size_t)(s->end - s->at) < n)
    SB_SCAN_ENDS(s, "the %s", what);
  memcpy(value, s->at, n);
  for (size_t i = 0; s->swap && i < n; i++)
    ((char *)value)[i] = s->at[n - 1 - i];
  s->at += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanInt(SbScan *s, int bytes, const char *what, int64_t *value)
{
  int32_t v = 0;

  PetscFunctionBeginUser;
  if (!s->binary)
    PetscCall(SbScanText(s, what, value));
  else if (bytes == 8)
    PetscCall(take(s, what, 8, value));
  else {
    PetscCall(take(s, what, 4, &v));
    *value = v;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanCount(SbScan *s, const char *what, int text_bytes, int binary_bytes,
                           int64_t *n)
{
  char number[64];

  PetscFunctionBeginUser;
  (void)snprintf(number, sizeof(number), "number of %s", what);
  PetscCall(SbScanInt(s, 8, number, n));
  PetscCall(SbScanRoom(s, what, *n, text_bytes, binary_bytes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanReal(SbScan *s, const char *what, int64_t number, PetscReal *value)
{
  char *p;

  PetscFunctionBeginUser;
  if (s->binary) {
    PetscCall(take(s, what, sizeof(*value), value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SbScanNext(s);
  *value = strtod(s->at, &p);
  if (s->at < s->end && p > s->at && (*p == 'D' || *p == 'd')) {
    // exponent letter of Fortran, 1.5D+00
    char copy[64], *end;
    size_t n = 0;

    for (; n + 1 < sizeof(copy) && !ends_token(s, s->at + n); n++)
      copy[n] = s->at[n] == 'D' || s->at[n] == 'd' ? 'E' : s->at[n];
    copy[n] = 0;
    *value = strtod(copy, &end);
    if (end == copy + n)
      p = (char *)s->at + n;
  }
  if (p > s->at && p + 1 < s->end && *p == ',' && isdigit((unsigned char)p[1]))
    SB_SCAN_ERROR(s, "the %s, %.*s, has a decimal comma; write the file with decimal points", what,
                  (int)PetscMin(24, p + strspn(p, ",0123456789") - s->at), s->at);
  if (s->at >= s->end || p == s->at || !ends_token(s, p))
    PetscCall(unexpected(s, what, number));
  s->at = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanPoint(SbScan *s, const char *what, int64_t number, PetscReal x[3])
{
  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) {
    PetscCall(SbScanReal(s, what, number, &x[i]));
    if (isfinite(x[i]))
      continue;
    if (number)
      SB_SCAN_ERROR(s, "%s of node %lld is not a finite number; repair the file", what,
                    (long long)number);
    SB_SCAN_ERROR(s, "the %s is not a finite number; repair the file", what);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanRoom(SbScan *s, const char *what, int64_t n, int64_t text_bytes,
                          int64_t binary_bytes)
{
  const int64_t room = (s->end - s->at) / (s->binary ? binary_bytes : text_bytes) + 1;

  PetscFunctionBeginUser;
  if (n < 0)
    SB_SCAN_ERROR(s, "%lld %s are announced; a count cannot be negative", (long long)n, what);
  if (n > room)
    SB_SCAN_ERROR(s,
                  "%lld %s are announced, the rest of the file cannot hold more than %lld; it is "
                  "damaged or truncated",
                  (long long)n, what, (long long)room);
  if (n > PETSC_MAX_INT / 8)
    SB_SCAN_ERROR(s, "%lld %s are more than this build can number", (long long)n, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanQuoted(SbScan *s, const char *what, size_t size, char value[])
{
  size_t n;

  PetscFunctionBeginUser;
  SbScanNext(s);
  n = *s->at == '"' ? strcspn(s->at + 1, "\"") : 0; /* the data ends with a zero */
  if (*s->at != '"' || s->at[n + 1] != '"')
    PetscCall(unexpected(s, what, 0));
  if (n >= size)
    SB_SCAN_ERROR(s, "the %s is longer than %zu characters", what, size - 1);
  memcpy(value, s->at + 1, n);
  value[n] = 0;
  SbCleanName(value, ' ');
  s->at += n + 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScanRestOfLine(SbScan *s, size_t size, char name[])
{
  size_t n = 0;

  PetscFunctionBeginUser;
  (void)SbScanMore(s, '\n');
  for (; s->at < s->end && *s->at != '\n'; s->at++) {
    if (n + 1 >= size)
      SB_SCAN_ERROR(s, "the name is longer than %zu characters", size - 1);
    name[n++] = *s->at;
  }
  while (n && isspace((unsigned char)name[n - 1]))
    n--;
  name[n] = 0;
  SbCleanName(name, ' ');
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbScanWord(SbScan *s, size_t size, char word[])
{
  size_t n = 0;

  SbScanNext(s);
  for (; n + 1 < size && !ends_token(s, s->at + n); n++)
    word[n] = s->at[n];
  word[n] = 0;
  SbCleanName(word, '?');
  s->at += n;
  return (PetscBool)(n > 0);
}

PetscErrorCode SbScanType(SbScan *s, SbNumberType *type)
{
  static const struct {
    const char *name[3];
    SbNumberType type;
  } types[] = {
    {{"char", "int8", ""}, {'i', 1}},          {{"uchar", "uint8", "unsigned_char"}, {'u', 1}},
    {{"short", "int16", ""}, {'i', 2}},        {{"ushort", "uint16", "unsigned_short"}, {'u', 2}},
    {{"int", "int32", "vtkidtype"}, {'i', 4}}, {{"uint", "uint32", "unsigned_int"}, {'u', 4}},
    {{"float", "float32", ""}, {'f', 4}},      {{"double", "float64", ""}, {'f', 8}},
    {{"long", "vtktypeint64", ""}, {'i', 8}},  {{"unsigned_long", "vtktypeuint64", ""}, {'u', 8}}};
  char word[32];

  PetscFunctionBeginUser;
  (void)SbScanWord(s, sizeof(word), word);
  for (size_t i = 0; i < 3 * PETSC_STATIC_ARRAY_LENGTH(types) && word[0]; i++) {
    if (strcasecmp(word, types[i / 3].name[i % 3]))
      continue;
    *type = types[i / 3].type;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SB_SCAN_ERROR(s, "expected a type of numbers, as float or int, found '%s'", word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbNumbersConvert(SbNumberType type, PetscBool big_endian, size_t n, const void *bytes,
                      double value[])
{
  const unsigned char *from = (const unsigned char *)bytes;

  for (size_t i = 0; i < n; i++) {
    uint64_t bits = 0;

    for (int b = 0; b < type.size; b++)
      bits |= (uint64_t)from[i * (size_t)type.size + (size_t)b]
              << 8 * (big_endian ? type.size - 1 - b : b);
    if (type.kind == 'f' && type.size == 4) {
      const uint32_t half = (uint32_t)bits;
      float x;

      memcpy(&x, &half, 4);
      value[i] = (double)x;
    } else if (type.kind == 'f')
      memcpy(&value[i], &bits, 8);
    else if (type.kind == 'u')
      value[i] = (double)bits;
    else {
      const int unused = 64 - 8 * type.size;

      value[i] = (double)((int64_t)(bits << unused) >> unused);
    }
  }
}

PetscBool SbScanMore(SbScan *s, char comment)
{
  while (s->at < s->end && *s->at != '\n' && isspace((unsigned char)*s->at))
    s->at++;
  s->token = s->at;
  return (PetscBool)(s->at < s->end && *s->at != '\n' && *s->at != comment);
}

void SbScanEndOfLine(SbScan *s)
{
  const char *line = (const char *)memchr(s->at, '\n', (size_t)(s->end - s->at));

  s->at = line ? line + 1 : s->end;
}

PetscBool SbScanFind(SbScan *s, const char *text)
{
  const char *found = (const char *)memmem(s->at, (size_t)(s->end - s->at), text, strlen(text));

  if (found)
    s->at = found;
  return found ? PETSC_TRUE : PETSC_FALSE;
}
