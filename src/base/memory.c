/*
  memory.c - makes the allocator return large arrays to the operating system when they are freed.

  By default glibc allocates large arrays by mmap and unmaps them when freed. A library that PETSc
  loads switches this off for the whole process; freed arrays then remain in the heap until an
  allocation fits. The set-up of a mesh allocates and frees many large arrays of different sizes: on
  rank 0 of two, five million tets took 1565 MiB, also afterwards; with a threshold of 32 MiB at
  most 1337 MiB, and 823 MiB afterwards.
*/
#include <malloc.h>
#include "sbbase.h"

#define LARGE \
  (32 << 20) /* threshold, bytes; a time step allocates less, except for very large meshes */

void SbMemoryReturnLarge(void)
{
#ifdef M_MMAP_THRESHOLD
  (void)mallopt(M_MMAP_MAX, 65536);
  (void)mallopt(M_MMAP_THRESHOLD, LARGE);
#endif
}
