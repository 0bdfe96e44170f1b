/*
  text.c - texts of a fixed size, printed into; what does not fit is cut off.
*/
#include <stdarg.h>
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
