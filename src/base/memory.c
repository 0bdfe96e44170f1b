/*
  memory.c - large arrays go back to the system when they are freed.

  glibc maps an array from 32 MiB on apart from its heap, so that it can be given back at once. A library that PETSc loads
  switches that off for the whole process; then the room of an array that was freed waits in the heap for one that fits.
  Setting up a mesh makes and frees many large arrays of different sizes: on rank 0 of two, five million tets took
  1565 MiB like that, also afterwards; with this they take up to 1337 MiB, and 823 MiB afterwards.
*/
#include <malloc.h>
#include "sbbase.h"

#define LARGE (32 << 20) /* bytes; more than a step allocates, but for very large meshes */

void SbMemoryReturnLarge(void)
{
#ifdef M_MMAP_THRESHOLD
  (void)mallopt(M_MMAP_MAX, 65536);
  (void)mallopt(M_MMAP_THRESHOLD, LARGE);
#endif
}
