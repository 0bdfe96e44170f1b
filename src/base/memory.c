/*
  memory.c - looks at limits of memory, and makes the allocator return large arrays to the operating
  system when they are freed.

  OpenBLAS takes a working buffer of 128 MiB when it is first used, and asks for it again and again,
  for ever, where it gets none; MPI and PETSc end with pages of errors. So a limit of the address
  space or of the data (ulimit -v, -d) is looked at before these begin, and OpenBLAS gets its
  buffer, which it keeps, while there is certainly room. Without such a limit nothing is done.

  By default glibc allocates large arrays by mmap and unmaps them when freed. A library that PETSc
  loads switches this off for the whole process; freed arrays then remain in the heap until an
  allocation fits. The set-up of a mesh allocates and frees many large arrays of different sizes: on
  rank 0 of two, five million tets took 1565 MiB, also afterwards; with a threshold of 32 MiB at
  most 1337 MiB, and 823 MiB afterwards.
*/
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include "sbbase.h"
#include <petscblaslapack.h>

#define LEAST 400 /* MiB of address space that a small run takes beyond the loaded libraries: 370 */
#define LEAST_DATA 224 /* the same of data: 200 */

#define LARGE \
  (32 << 20) /* threshold, bytes; a time step allocates less, except for very large meshes */

void SbMemoryReturnLarge(void)
{
#ifdef M_MMAP_THRESHOLD
  (void)mallopt(M_MMAP_MAX, 65536);
  (void)mallopt(M_MMAP_THRESHOLD, LARGE);
#endif
}

/* A limit of memory, KiB, 0: there is none. */
static unsigned long limit_of(int resource)
{
  struct rlimit limit;

  if (getrlimit(resource, &limit) || limit.rlim_cur == RLIM_INFINITY)
    return 0;
  return (unsigned long)(limit.rlim_cur >> 10);
}

/* Whether this process may have so many more MiB. */
static PetscBool is_room(size_t size, int protection)
{
  void *room =
    mmap(NULL, size << 20, protection, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);

  if (room == MAP_FAILED)
    return PETSC_FALSE;
  (void)munmap(room, size << 20);
  return PETSC_TRUE;
}

PetscBool SbMemoryIsEnough(const char *program)
{
  const unsigned long space = limit_of(RLIMIT_AS);
  const unsigned long data = limit_of(RLIMIT_DATA);
  PetscBLASInt one = 1;
  PetscBLASInt info;
  PetscScalar number = 1;

  if (!space && !data)
    return PETSC_TRUE;

  // is there room for a run at all
  if (!is_room(LEAST, PROT_NONE) || !is_room(LEAST_DATA, PROT_READ | PROT_WRITE)) {
    (void)fprintf(stderr, "%s: error: memory is limited (", program);
    if (space)
      (void)fprintf(stderr, "ulimit -v %lu", space);
    if (data)
      (void)fprintf(stderr, "%sulimit -d %lu", space ? ", " : "", data);
    (void)fprintf(
      stderr,
      " kB) to less than a small run needs: %d MB beyond the loaded libraries, %d MB of "
      "them data; raise the limits\n",
      LEAST, LEAST_DATA);
    return PETSC_FALSE;
  }

  // OpenBLAS takes its buffer
  LAPACKpotrf_("L", &one, &number, &one, &info);
  return PETSC_TRUE;
}
