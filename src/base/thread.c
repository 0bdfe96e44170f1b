/*
  thread.c - one thread per rank: ranks are the parallelism of this program.

  CHOLMOD's OpenMP regions ask for a number of threads that was fixed when it was compiled, whatever OMP_NUM_THREADS says, and idle
  threads of GNU's OpenMP spin: two ranks on four cores then fight for them. A largest nesting level of 0 makes every
  region run on its own thread. Threaded BLAS libraries are set separately. The functions are looked up among the libraries of the
  process, so nothing of OpenMP is needed to build; where a library has none of them it has no threads either.
*/
#include <dlfcn.h>
#include <link.h>
#include "sbbase.h"

/* Functions of a library that set and get its number of threads. */
static const struct {
  const char *set, *ask;
  int one; /* the argument that stands for one thread */
} controls[] = {
  {"omp_set_max_active_levels", NULL, 0},
  {"openblas_set_num_threads", "openblas_get_num_threads", 1},
  {"MKL_Set_Num_Threads", "MKL_Get_Max_Threads", 1},
  {"bli_thread_set_num_threads", NULL, 1},
};

/* One library of the process: set its threads, and count those that it would still use. */
static int set_library(struct dl_phdr_info *info, size_t size, void *most)
{
  void *library = dlopen(info->dlpi_name[0] ? info->dlpi_name : NULL, RTLD_LAZY | RTLD_NOLOAD);
  int *threads = (int *)most;

  (void)size;
  if (!library) return 0;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(controls); k++) {
    void (*set)(int) = NULL;
    int (*ask)(void) = NULL;

    /* the conversion that POSIX describes for functions */
    *(void **)&set = dlsym(library, controls[k].set);
    if (controls[k].ask) *(void **)&ask = dlsym(library, controls[k].ask);
    if (set) (*set)(controls[k].one);
    if (ask) *threads = PetscMax(*threads, (*ask)());
  }

  /* OpenMP without nested levels to switch off, or one that did not obey */
  {
    int (*levels)(void) = NULL, (*ask)(void) = NULL;

    *(void **)&levels = dlsym(library, "omp_get_max_active_levels");
    *(void **)&ask = dlsym(library, "omp_get_max_threads");
    if (ask && (!levels || (*levels)() > 0)) *threads = PetscMax(*threads, (*ask)());
  }
  (void)dlclose(library);
  return 0;
}

int SbThreadsSetOne(void)
{
  int most = 1;

  (void)dl_iterate_phdr(set_library, &most);
  return most;
}
