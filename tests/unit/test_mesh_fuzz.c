// Files that once broke a reader, and every damaged file of tests/data: each gives a mesh or an
// error as documented. @ranks 1
#include <dirent.h>
#include <stdlib.h>
#include "../fuzz/readers.h"
#include "../test.h"

static int nfile; /* replayed */

static PetscErrorCode replay(int reader, const char *scratch, const char *path)
{
  SbScan scan;
  char text[1024];
  const char *broken;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  ierr = SbScanOpen("replay", path, &scan);
  if (!ierr) {
    const PetscErrorCode code =
      fuzz_read(reader, scratch, scan.data, (size_t)(scan.end - scan.data), text);

    broken = fuzz_broken_promise(code, text);
    SB_CHECK(!broken, "%s: %s: '%s' (code %d)", path, broken, text, (int)code);
    nfile++;
  }
  PetscCall(PetscFree(scan.data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All files of a folder with this extension; NULL: any. */
static PetscErrorCode replay_folder(int reader, const char *scratch, const char *folder,
                                    const char *ending)
{
  DIR *dir = opendir(folder);
  struct dirent *entry;
  char path[512];

  PetscFunctionBeginUser;
  while (dir && (entry = readdir(dir))) {
    const size_t n = strlen(entry->d_name);
    const size_t m = ending ? strlen(ending) : 0;

    if (entry->d_name[0] == '.' || n < m || (ending && strcmp(entry->d_name + n - m, ending) != 0))
      continue;
    (void)snprintf(path, sizeof(path), "%s/%s", folder, entry->d_name);
    PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
    PetscCall(replay(reader, scratch, path));
    PetscCall(PetscPopErrorHandler());
  }
  if (dir)
    closedir(dir);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The valid meshes that h5.h makes are read: fuzzing starts from them. */
static PetscErrorCode test_sound(const char *scratch)
{
  static const char *const names[] = {"own", "packed", "no_members", "run", "last_step", "split"};
  int reader = 0;

  PetscFunctionBeginUser;
  while (fuzz_readers[reader].read != SbImportRead_H5)
    reader++;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(names); i++) {
    char path[64];
    char text[1024] = "";
    SbScan scan;
    PetscErrorCode code;

    (void)snprintf(path, sizeof(path), "tests/fuzz/h5/%s", names[i]);
    PetscCall(SbScanOpen("sound", path, &scan));
    code = fuzz_read(reader, scratch, scan.data, (size_t)(scan.end - scan.data), text);
    SB_CHECK(!code, "%s: %s", path, text);
    PetscCall(PetscFree(scan.data));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char scratch[] = "/tmp/sbfuzz_XXXXXX";
  char folder[64], command[64];

  SB_TEST_BEGIN(argc, argv);
  SB_CHECK(mkdtemp(scratch), "no folder %s", scratch);
  for (int r = 0; r < NFUZZ; r++) {
    (void)snprintf(folder, sizeof(folder), "tests/fuzz/%s", fuzz_readers[r].name);
    PetscCall(replay_folder(r, scratch, folder, NULL));
    PetscCall(replay_folder(r, scratch, "tests/data", fuzz_readers[r].ending));
  }
  PetscCall(test_sound(scratch));
  SB_CHECK(nfile >= 30, "only %d files were replayed", nfile);
  (void)snprintf(command, sizeof(command), "rm -rf %s", scratch);
  SB_CHECK(!system(command), "%s stays", scratch);
  SB_TEST_END();
}
