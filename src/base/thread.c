/*
  thread.c - limits each rank to one thread: the program is parallel by MPI ranks only.

  CHOLMOD's OpenMP regions use a number of threads fixed when it was compiled, whatever
  OMP_NUM_THREADS is, and idle threads of GNU's OpenMP spin: two ranks on four cores then compete
  for them. With a maximum of 0 active levels every region runs on its own thread. Threaded BLAS
  libraries are limited separately. Functions are looked up in the loaded libraries: the build needs
  no OpenMP; a library without them has no threads.
*/
#include <dlfcn.h>
#include <link.h>
#include "sbbase.h"

/* Functions of a library that set its number of threads, and get it unless another one returns
   0. */
static const struct {
  const char *set;
  int one; /* argument for one thread */
  const char *ask, *unless;
} controls[] = {
  {"omp_set_max_active_levels", 0, "omp_get_max_threads", "omp_get_max_active_levels"},
  {"openblas_set_num_threads", 1, "openblas_get_num_threads", NULL},
  {"MKL_Set_Num_Threads", 1, "MKL_Get_Max_Threads", NULL},
  {"bli_thread_set_num_threads", 1, NULL, NULL},
};

/* Callback for one loaded library: limits its threads, and finds the largest number that
   remains. */
static int set_library(struct dl_phdr_info *info, size_t size, void *most)
{
  void *library = dlopen(info->dlpi_name[0] ? info->dlpi_name : NULL, RTLD_LAZY | RTLD_NOLOAD);
  int *threads = (int *)most;

  (void)size;
  if (!library)
    return 0;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(controls); k++) {
    void (*set)(int) = NULL;
    int (*ask)(void) = NULL, (*unless)(void) = NULL;

    /* conversion to a function pointer as described by POSIX */
    *(void **)&set = dlsym(library, controls[k].set);
    if (controls[k].ask)
      *(void **)&ask = dlsym(library, controls[k].ask);
    if (controls[k].unless)
      *(void **)&unless = dlsym(library, controls[k].unless);
    if (set)
      (*set)(controls[k].one);
    if (ask && (!unless || (*unless)() > 0))
      *threads = PetscMax(*threads, (*ask)());
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
