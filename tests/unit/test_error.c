/*
  test_error.c - errors on some ranks: one line per run, the same exit code on all ranks, no hang.

  The result is known after MPI_Finalize(), so this test counts its checks itself: all ranks write
  their stderr to one file, which rank 0 reads.
*/
// @ranks 1 3
#include "test.h"
#include <fcntl.h>
#include <unistd.h>

static PetscErrorCode fails(const char *what)
{
  PetscFunctionBeginUser;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s", what);
}

/* The last rank fails alone, after the last common operation; PetscFinalize() would be another
   one. */
static PetscErrorCode program(int argc, char **argv, PetscMPIInt rank, PetscMPIInt size)
{
  PetscFunctionBeginUser;
  PetscCall(SbErrorHandlerInstall(MPI_COMM_WORLD, "supple"));
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(SbWarning(PETSC_COMM_WORLD, "a warning of %d rank%s", (int)size, size == 1 ? "" : "s"));
  if (rank == size - 1)
    PetscCall(fails("the last rank failed"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int spoken;

static void farewell(const char *message, void *ctx)
{
  (void)ctx;
  if (!strcmp(message, "the last rank failed"))
    spoken++;
}

/* Lines of the file that are exactly `line`, and all its lines. */
static void count_lines(const char *file, const char *line, int *matches, int *all)
{
  char text[512];
  FILE *f = fopen(file, "r");

  *matches = *all = 0;
  while (f && fgets(text, sizeof(text), f)) {
    (*all)++;
    text[strcspn(text, "\n")] = 0;
    if (!strcmp(text, line))
      (*matches)++;
  }
  if (f)
    (void)fclose(f);
}

int main(int argc, char **argv)
{
  char file[] = "/tmp/sb_test_error_XXXXXX";
  char warning[64];
  PetscMPIInt rank, size;
  int fd, matches, all, code;

  (void)MPI_Init(&argc, &argv);
  (void)MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  (void)MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (!rank) {
    fd = mkstemp(file);
    if (fd >= 0)
      (void)close(fd);
  }
  (void)MPI_Bcast(file, sizeof(file), MPI_CHAR, 0, MPI_COMM_WORLD);
  fd = open(file, O_WRONLY | O_APPEND);
  if (fd < 0 || dup2(fd, STDERR_FILENO) < 0)
    return 2;

  SbErrorSetFailureHandler(farewell, NULL);
  code = SbErrorFinish(program(argc, argv, rank, size));
  SB_CHECK(code == 1, "exit code %d on rank %d", code, rank);
  SB_CHECK(spoken == (rank == size - 1), "rank %d said farewell %d times", rank, spoken);
  if (!rank) {
    (void)usleep(500000); /* waits for output that the other ranks must not write */
    count_lines(file, "supple: error: the last rank failed", &matches, &all);
    SB_CHECK(matches == 1, "%d error lines", matches);
    SB_CHECK(all == 2, "%d lines on stderr", all);
    (void)snprintf(warning, sizeof(warning), "supple: warning: a warning of %d rank%s", size,
                   size == 1 ? "" : "s");
    count_lines(file, warning, &matches, &all);
    SB_CHECK(matches == 1, "%d warnings", matches);
    (void)unlink(file);
    printf("%d passed, %d failed\n", sb_test_passed, sb_test_failed);
  }
  return sb_test_failed ? 1 : 0;
}
