/*
  fuzz.c - runs a reader, or another input of a run (inputs.h), with clang's libFuzzer:
  SB_FUZZ_READER=tetgen build-fuzz/tests/fuzz/fuzz FOLDER (called by scripts/fuzz).

  In addition to sanitizer errors, it stops at memory leaks of a reader, and at errors that violate
  the guarantees of readers.h. Memory is counted by functions below PetscMalloc(); what a run leaves
  at an error, with which it ends, does not count.
*/
#include <stdlib.h>
#include "readers.h"
#include "inputs.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

static int reader = -1; /* from NFUZZ on: an input */
static long blocks;     /* allocated and not freed */
static char folder[64];

static PetscErrorCode count_malloc(size_t size, PetscBool clear, int line, const char *function,
                                   const char *file, void **memory)
{
  (void)line, (void)function, (void)file;
  *memory = size ? (clear ? calloc(1, size) : malloc(size)) : NULL;
  blocks += *memory != NULL;
  return size && !*memory ? PETSC_ERR_MEM : PETSC_SUCCESS;
}

static PetscErrorCode count_free(void *memory, int line, const char *function, const char *file)
{
  (void)line, (void)function, (void)file;
  blocks -= memory != NULL;
  free(memory);
  return PETSC_SUCCESS;
}

static PetscErrorCode count_realloc(size_t size, int line, const char *function, const char *file,
                                    void **memory)
{
  const PetscBool had = (PetscBool)(*memory != NULL);

  (void)line, (void)function, (void)file;
  if (!size) {
    (void)count_free(*memory, 0, NULL, NULL);
    *memory = NULL;
    return PETSC_SUCCESS;
  }
  *memory = realloc(*memory, size);
  blocks += *memory && !had;
  return *memory ? PETSC_SUCCESS : PETSC_ERR_MEM;
}

static void leave(void)
{
  char command[96];

  (void)snprintf(command, sizeof(command), "rm -rf %s", folder);
  if (system(command))
    fprintf(stderr, "%s stays\n", folder);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  const char *name = getenv("SB_FUZZ_READER");
  int none = 1;

  (void)argc;
  for (int i = 0; name && i < NFUZZ; i++)
    if (!strcmp(name, fuzz_readers[i].name))
      reader = i;
  for (int i = 0; name && i < NINPUT; i++)
    if (!strcmp(name, fuzz_inputs[i].name))
      reader = NFUZZ + i;
  if (reader < 0) {
    fprintf(stderr, "fuzz: set SB_FUZZ_READER to one of:");
    for (int i = 0; i < NFUZZ; i++)
      fprintf(stderr, " %s", fuzz_readers[i].name);
    for (int i = 0; i < NINPUT; i++)
      fprintf(stderr, " %s", fuzz_inputs[i].name);
    fprintf(stderr, "\n");
    exit(2);
  }
  (void)PetscMallocSet(count_malloc, count_free, count_realloc);
  if (PetscInitialize(&none, argv, NULL, NULL) || SbLogInitialize())
    exit(2);
  (void)PetscPopSignalHandler(); /* crashes are the fuzzer's */
  (void)snprintf(folder, sizeof(folder), "%s/supple-fuzz-XXXXXX",
                 access("/dev/shm", W_OK) ? "/tmp" : "/dev/shm");
  if (!mkdtemp(folder))
    exit(2);
  (void)atexit(leave);
  return 0;
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
  const long before = blocks;
  char text[1024];
  const PetscBool input = (PetscBool)(reader >= NFUZZ);
  const PetscErrorCode ierr = input
                                ? fuzz_use(reader - NFUZZ, folder, (const char *)data, size, text)
                                : fuzz_read(reader, folder, (const char *)data, size, text);
  const char *broken = fuzz_broken_promise(ierr, text);

  if (broken)
    fprintf(stderr, "fuzz: %s: %s (code %d)\n", broken, text, (int)ierr);
  if (!input && blocks != before)
    fprintf(stderr, "fuzz: %ld blocks of memory were not given back; %s\n", blocks - before, text);
  if (broken || (!input && blocks != before))
    abort();
  return 0;
}
