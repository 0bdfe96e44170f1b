// Functions below the monitors: original order, HDF5 slices and attributes, replaced files, errors
// on one rank that all ranks report.
// @ranks 1 2 4
#include "output_fixture.h"

static char dir[512];

/* Numbers dealt cyclically to the ranks, in descending order. */
static PetscErrorCode test_order(void)
{
  const PetscInt N = 23;
  SbOrder order;
  PetscInt n = 0;
  PetscInt original[23];
  PetscReal owned[46], slice[46], back[46];

  PetscFunctionBeginUser;
  for (PetscInt k = N - 1; k >= 0; k--)
    if (k % test_size == test_rank)
      original[n++] = k;
  for (PetscInt i = 0; i < n; i++) {
    owned[2 * i] = 1. + (PetscReal)original[i];
    owned[2 * i + 1] = -(PetscReal)original[i];
  }
  PetscCall(SbOrderCreate(PETSC_COMM_WORLD, N, n, original, &order));
  PetscCall(SbForestReduce(order.sf, 2, MPIU_REAL, owned, slice));
  for (PetscInt i = 0; i < order.n; i++)
    SB_CHECK(slice[2 * i] == 1. + (PetscReal)(order.start + i) &&
               slice[2 * i + 1] == -(PetscReal)(order.start + i),
             "number %d is in the place of %d", (int)slice[2 * i] - 1, (int)(order.start + i));
  PetscCall(SbForestBroadcast(order.sf, 2, MPIU_REAL, slice, back));
  for (PetscInt i = 0; i < 2 * n; i++)
    SB_CHECK(back[i] == owned[i], "%g came back as %g", owned[i], back[i]);
  PetscCall(SbOrderDestroy(&order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers 3 k^2 + k, dealt in descending order: the order has no gaps. */
static PetscErrorCode test_order_with_gaps(void)
{
  const PetscInt N = 17;
  SbOrder order;
  PetscInt n = 0;
  PetscInt key[17];
  PetscReal owned[34], slice[34];

  PetscFunctionBeginUser;
  for (PetscInt k = N - 1; k >= 0; k--) {
    if (k % test_size != test_rank)
      continue;
    owned[2 * n] = (PetscReal)k;
    owned[2 * n + 1] = k + 0.5;
    key[n++] = 3 * k * k + k;
  }
  PetscCall(SbOrderCreateSparse(PETSC_COMM_WORLD, 3 * N * N, n, key, &order));
  SB_CHECK(order.N == N && order.nowned == n, "%d numbers", (int)order.N);
  PetscCall(SbForestReduce(order.sf, 2, MPIU_REAL, owned, slice));
  for (PetscInt i = 0; i < 2 * order.n; i++)
    SB_CHECK(slice[i] == 0.5 * (PetscReal)(2 * order.start + i), "%g is in the place of %g",
             slice[i], 0.5 * (double)(2 * order.start + i));
  PetscCall(SbOrderDestroy(&order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A layout of two entities leaves some of three or more ranks without any. */
static PetscErrorCode test_h5(void)
{
  SbOrder order;
  SbH5 h;
  PetscReal slice[8], back[8];
  PetscReal time = 0.;
  int64_t step = 0;
  char path[PETSC_MAX_PATH_LEN], *text;
  PetscBool ok;

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/test.h5", dir);
  PetscCall(
    SbOrderCreate(PETSC_COMM_WORLD, 2, test_rank ? 0 : 2, (const PetscInt[]){0, 1}, &order));
  for (PetscInt i = 0; i < 3 * order.n; i++)
    slice[i] = (PetscReal)(3 * order.start + i) / 3.;
  PetscCall(SbH5Create(PETSC_COMM_WORLD, path, &h));
  PetscCall(SbH5WriteSlice(&h, h.file, "v", "m", &order, 3, H5T_IEEE_F64LE, slice));
  PetscCall(SbH5PutReal(&h, h.file, "time", 1. / 3.));
  PetscCall(SbH5PutInt(&h, h.file, "step", -((int64_t)1 << 60)));
  PetscCall(SbH5WriteText(&h, h.file, "text", "two\nlines"));
  PetscCall(SbH5Flush(&h));
  PetscCall(SbH5Close(&h));
  PetscCall(SbH5Open(PETSC_COMM_WORLD, path, PETSC_FALSE, &h, &ok));
  SB_CHECK(ok, "the file cannot be opened");
  PetscCall(SbH5ReadSlice(&h, "v", &order, 3, back, &ok));
  SB_CHECK(ok, "v cannot be read");
  for (PetscInt i = 0; i < 3 * order.n; i++)
    SB_CHECK(back[i] == slice[i], "v[%d]", (int)i);
  SbH5GetReal(h.file, "time", &time, &ok);
  SbH5GetInt(h.file, "step", &step, &ok);
  PetscCall(SbH5ReadText(&h, "text", &text, &ok));
  SB_CHECK(ok && time == 1. / 3. && step == -((int64_t)1 << 60) && !strcmp(text, "two\nlines"),
           "attributes or text");
  PetscCall(PetscFree(text));

  // an array that is absent or of another type is reported, but not an error
  PetscCall(SbH5ReadSlice(&h, "v", &order, 2, back, &ok));
  SB_CHECK(!ok, "an array of another shape was read");
  PetscCall(SbH5ReadSlice(&h, "w", &order, 3, back, &ok));
  SB_CHECK(!ok, "an array that is not there was read");
  ok = PETSC_TRUE;
  SbH5GetReal(h.file, "step", &time, &ok);
  SB_CHECK(!ok, "a whole number was read as a real one");
  ok = PETSC_TRUE;
  PetscCall(SbH5ReadText(&h, "v", &text, &ok));
  SB_CHECK(!ok && !text, "numbers were read as a text");
  PetscCall(SbH5Close(&h));
  PetscCall(SbOrderDestroy(&order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_open_failure(void)
{
  SbH5 h;
  char path[PETSC_MAX_PATH_LEN];
  PetscBool ok;

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/nothing.h5", dir);
  PetscCall(SbH5Open(PETSC_COMM_WORLD, path, PETSC_FALSE, &h, &ok));
  SB_CHECK(!ok && h.file < 0, "a file that is not there was opened");
  if (!test_rank) {
    char message[SB_MESSAGE_MAX] = "";

    SbFileReplace(path, "no HDF5", 7, message);
    SB_CHECK(!message[0], "%s", message);
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCall(SbH5Open(PETSC_COMM_WORLD, path, PETSC_TRUE, &h, &ok));
  SB_CHECK(!ok && h.file < 0, "a text was opened as HDF5");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_files(void)
{
  char path[PETSC_MAX_PATH_LEN], *text;
  char message[SB_MESSAGE_MAX] = "";
  SbH5 h = {.comm = PETSC_COMM_WORLD};
  size_t size;

  PetscFunctionBeginUser;
  if (!test_rank) {
    SbFormat(sizeof(path), path, "%s/whole.txt", dir);
    SbFileReplace(path, "one two", 7, message);
    PetscCall(fixture_read_file(path, &text, &size));
    SB_CHECK(!message[0] && size == 7 && text && !strcmp(text, "one two"), "read '%s', %s",
             text ? text : "", message);
    PetscCall(PetscFree(text));
    SB_CHECK(!fixture_exists(dir, "whole.txt.tmp"), "the temporary file is left");
    SbFormat(sizeof(path), path, "%s/no/folder", dir);
    SbFileReplace(path, "one two", 7, message);
    SB_CHECK(strstr(message, "cannot write 7 bytes to ") &&
               strstr(message, "No such file or directory"),
             "message '%s'", message);
  }

  // more than any disk has: an error, and the length of the file does not change
  SbFormat(sizeof(path), path, "%s/reserve", dir);
  PetscCall(PetscStrncpy(h.path, path, sizeof(h.path)));
  if (!test_rank)
    fixture_write(path, "", 0);
  PetscCall(SbH5Reserve(&h, 1000));
  SB_CHECK_ERROR(SbH5Reserve(&h, (PetscInt64)1 << 55), PETSC_ERR_FILE_WRITE,
                 "36028797018963968 bytes");
  if (!test_rank) {
    PetscCall(fixture_read_file(path, &text, &size));
    SB_CHECK(size == 1000, "the file has %zu bytes", size);
    PetscCall(PetscFree(text));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A message of any rank ends the call on all ranks. */
static PetscErrorCode test_agree(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbAgree(PETSC_COMM_WORLD, PETSC_ERR_FILE_WRITE, ""));
  SB_CHECK_ERROR(SbAgree(PETSC_COMM_WORLD, PETSC_ERR_FILE_WRITE,
                         test_rank == test_size - 1 ? "the last rank failed" : ""),
                 PETSC_ERR_FILE_WRITE, "the last rank failed");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_order());
  PetscCall(test_order_with_gaps());
  PetscCall(test_h5());
  PetscCall(test_open_failure());
  PetscCall(test_files());
  PetscCall(test_agree());
  SB_TEST_END();
}
