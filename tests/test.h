/*
  test.h - framework of test programs: checks are counted and continue after a failure; the verdict
  is the same on every rank.

  A test is `SB_TEST_BEGIN(argc, argv); ... SB_CHECK(...); ... SB_TEST_END();` inside main(). A
  failed check prints its position and values; the last line is "N passed, N failed", and the exit
  code is 1 if a check failed on any rank. SB_TEST_BEGIN sets test_rank and test_size.
*/
#pragma once
#include <sbbase.h>
#include <ctype.h>
#include <math.h>

static int sb_test_passed, sb_test_failed;
static PETSC_UNUSED PetscMPIInt test_rank, test_size; /* of PETSC_COMM_WORLD */

static inline void PETSC_ATTRIBUTE_FORMAT(4, 5)
  sb_test_record(PetscBool ok, const char *file, int line, const char *format, ...)
{
  va_list args;

  if (ok) {
    sb_test_passed++;
    return;
  }
  sb_test_failed++;
  printf("%s:%d: [%d] failed: ", file, line, (int)test_rank);
  va_start(args, format);
  vprintf(format, args);
  va_end(args);
  printf("\n");
  fflush(stdout);
}

#define SB_CHECK(cond, ...) \
  sb_test_record((cond) ? PETSC_TRUE : PETSC_FALSE, __FILE__, __LINE__, __VA_ARGS__)
#define SB_CHECK_NEAR(value, expected, tolerance, what)                                         \
  do {                                                                                          \
    const double sb_v = (double)(value), sb_e = (double)(expected), sb_t = (double)(tolerance); \
    sb_test_record(fabs(sb_v - sb_e) <= sb_t ? PETSC_TRUE : PETSC_FALSE, __FILE__, __LINE__,    \
                   "%s is %.15g, expected %.15g within %.3g", what, sb_v, sb_e, sb_t);          \
  } while (0)

/* Prints once for all ranks. */
#define test_print(...) (void)PetscPrintf(PETSC_COMM_WORLD, __VA_ARGS__)

/* Text of the last error. */
static char sb_test_text[2048];

static inline PetscErrorCode sb_test_keep(MPI_Comm comm, int line, const char *function,
                                          const char *file, PetscErrorCode code,
                                          PetscErrorType kind, const char *text, void *ctx)
{
  (void)comm, (void)line, (void)function, (void)file, (void)ctx;
  if (kind == PETSC_ERROR_INITIAL)
    (void)snprintf(sb_test_text, sizeof(sb_test_text), "%s", text ? text : "");
  return code;
}

/* Whether the text contains each part of `names`, separated by |, as a whole word or number. */
static inline PetscBool sb_test_names(const char *text, const char *names)
{
#define SB_WORD(c) (isalnum((unsigned char)(c)) || (c) == '_')
  for (const char *end; *names; names = end + (*end == '|')) {
    const char *at;
    size_t n;

    end = names + strcspn(names, "|");
    n = (size_t)(end - names);
    for (at = text; *at; at++) {
      if (strncmp(at, names, n))
        continue;
      if (at > text && SB_WORD(at[-1]) && SB_WORD(names[0]))
        continue;
      if (!SB_WORD(at[n]) || !SB_WORD(end[-1]))
        break;
    }
    if (n && !*at)
      return PETSC_FALSE;
  }
  return PETSC_TRUE;
#undef SB_WORD
}

/*
  The call must fail with the code `expected`, in one line that names all of `names`: option, file,
  line, value, with | between them. How the sentence reads is not checked.
*/
#define SB_CHECK_ERROR(call, expected, names)                                                     \
  do {                                                                                            \
    PetscErrorCode sb_ierr;                                                                       \
    sb_test_text[0] = 0;                                                                          \
    PetscCall(PetscPushErrorHandler(sb_test_keep, NULL));                                         \
    sb_ierr = call;                                                                               \
    PetscCall(PetscPopErrorHandler());                                                            \
    SB_CHECK(sb_ierr == (expected), "code %d instead of %d: '%s'", (int)sb_ierr, (int)(expected), \
             sb_test_text);                                                                       \
    SB_CHECK(sb_test_names(sb_test_text, names), "'%s' does not name %s", sb_test_text, names);   \
    SB_CHECK(!strchr(sb_test_text, '\n'), "more than one line: '%s'", sb_test_text);              \
  } while (0)

/* Reproducible numbers in -1..1. */
static inline PetscReal test_random(unsigned *state)
{
  *state = *state * 1664525u + 1013904223u;
  return (PetscReal)(*state >> 8) / (1 << 23) - 1;
}

#define SB_TEST_BEGIN(argc, argv)                              \
  do {                                                         \
    PetscFunctionBeginUser;                                    \
    PetscCall(PetscInitialize(&(argc), &(argv), NULL, NULL));  \
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &test_rank)); \
    PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &test_size)); \
    (void)SbThreadsSetOne();                                   \
  } while (0)

static inline int sb_test_end(void)
{
  int sums[2] = {0, 0};
  int mine[2] = {sb_test_passed, sb_test_failed};

  (void)MPI_Allreduce(mine, sums, 2, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  test_print("%d passed, %d failed\n", sums[0], sums[1]);
  (void)SbOptionsReset();
  (void)PetscFinalize();
  return sums[1] ? 1 : 0;
}
#define SB_TEST_END() return sb_test_end()
