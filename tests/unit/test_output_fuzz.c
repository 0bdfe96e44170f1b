// Formulas, tables, files of copies, states and checkpoints as make fuzz makes them: each is taken,
// or refused with one line that says where. @ranks 1
#include <dirent.h>
#include "../fuzz/readers.h"
#include "../fuzz/inputs.h"
#include "../file.h"

static PetscErrorCode replay(int input, const char *folder, const char *path, PetscBool sound)
{
  char text[1024];
  const char *broken;
  PetscErrorCode code;
  char *data = NULL;
  size_t n = 0;
  FILE *file = fopen(path, "rb");

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(1 << 16, &data));
  if (file)
    n = fread(data, 1, 1 << 16, file);
  if (file)
    (void)fclose(file);
  code = fuzz_use(input, folder, data, n, text);
  broken = fuzz_broken_promise(code, text);
  SB_CHECK(!broken, "%s: %s: '%s' (code %d)", path, broken ? broken : "", text, (int)code);
  SB_CHECK(!sound || !code, "%s: '%s' (code %d)", path, text, (int)code);
  PetscCall(PetscFree(data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const sound[] = {"functions", "separators", "windows", "all", "whole"};
  char folder[512];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(folder));
  for (int input = 0; input < NINPUT; input++) {
    char path[512];
    DIR *dir;
    struct dirent *entry;

    (void)snprintf(path, sizeof(path), "tests/fuzz/%s", fuzz_inputs[input].name);
    dir = opendir(path);
    SB_CHECK(dir != NULL, "no folder %s", path);
    while (dir && (entry = readdir(dir))) {
      PetscBool good = PETSC_FALSE;

      if (entry->d_name[0] == '.')
        continue;
      for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(sound); k++)
        good = (PetscBool)(good || !strcmp(entry->d_name, sound[k]));
      (void)snprintf(path, sizeof(path), "tests/fuzz/%s/%.200s", fuzz_inputs[input].name,
                     entry->d_name);
      PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
      PetscCall(replay(input, folder, path, good));
      PetscCall(PetscPopErrorHandler());
    }
    if (dir)
      closedir(dir);
  }
  PetscCall(test_scene_close(&fuzz_scene));
  SB_TEST_END();
}
