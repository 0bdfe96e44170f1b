/*
  test.h - what a test program needs: counted checks that go on after a failure, the same verdict on every rank.

  A test is `SB_TEST_BEGIN(argc, argv); ... SB_CHECK(...); ... SB_TEST_END();` inside main(). A failed check prints its
  place and values; the closing line is "N passed, N failed", and the exit code is 1 when any rank had a failure.
*/
#pragma once
#include <sbbase.h>
#include <math.h>

static int sb_test_passed, sb_test_failed;

static inline void sb_test_record(PetscBool ok, const char *file, int line, const char *format, ...)
{
  va_list args;
  PetscMPIInt rank = 0;

  if (ok) {
    sb_test_passed++;
    return;
  }
  sb_test_failed++;
  (void)MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  printf("%s:%d: [%d] failed: ", file, line, (int)rank);
  va_start(args, format);
  vprintf(format, args);
  va_end(args);
  printf("\n");
  fflush(stdout);
}

#define SB_CHECK(cond, ...) sb_test_record((cond) ? PETSC_TRUE : PETSC_FALSE, __FILE__, __LINE__, __VA_ARGS__)
#define SB_CHECK_NEAR(value, expected, tolerance, what)                                         \
  do {                                                                                          \
    const double sb_v = (double)(value), sb_e = (double)(expected), sb_t = (double)(tolerance); \
    sb_test_record(fabs(sb_v - sb_e) <= sb_t ? PETSC_TRUE : PETSC_FALSE, __FILE__, __LINE__,    \
                   "%s is %.15g, expected %.15g within %.3g", what, sb_v, sb_e, sb_t);          \
  } while (0)

/* The call must fail; its error output is swallowed. */
#define SB_CHECK_ERROR(call, what)                                                                \
  do {                                                                                            \
    PetscErrorCode sb_ierr;                                                                       \
    PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));                              \
    sb_ierr = call;                                                                               \
    PetscCall(PetscPopErrorHandler());                                                            \
    sb_test_record(sb_ierr ? PETSC_TRUE : PETSC_FALSE, __FILE__, __LINE__, "no error: %s", what); \
  } while (0)

#define SB_TEST_BEGIN(argc, argv)                             \
  do {                                                        \
    PetscFunctionBeginUser;                                   \
    PetscCall(PetscInitialize(&(argc), &(argv), NULL, NULL)); \
    (void)SbThreadsSetOne();                                  \
  } while (0)

static inline int sb_test_end(void)
{
  int sums[2] = {0, 0}, mine[2] = {sb_test_passed, sb_test_failed};
  PetscMPIInt rank = 0;

  (void)MPI_Allreduce(mine, sums, 2, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  (void)MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (!rank) printf("%d passed, %d failed\n", sums[0], sums[1]);
  (void)PetscFinalize();
  return sums[1] ? 1 : 0;
}
#define SB_TEST_END() return sb_test_end()
