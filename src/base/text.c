/*
  text.c - formatted texts of fixed size, truncated if too long; numbers in a text.
*/
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include "sbbase.h"

void SbFormat(size_t size, char text[], const char *format, ...)
{
  va_list args;

  va_start(args, format);
  (void)vsnprintf(text, size, format, args);
  va_end(args);
}

void SbAppend(size_t size, char text[], const char *format, ...)
{
  const size_t n = strlen(text);
  va_list args;

  va_start(args, format);
  (void)vsnprintf(text + n, size - n, format, args);
  va_end(args);
}

int SbParseNumbers(const char *text, int most, PetscReal p[])
{
  int n = 0;

  for (;;) {
    char *end;
    const double value = strtod(text, &end);

    if (end == text || n == most || !isfinite(value))
      return -1;
    p[n++] = (PetscReal)value;
    if (!*end)
      return n;
    if (*end != ',')
      return -1;
    text = end + 1;
  }
}
