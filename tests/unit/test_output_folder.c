// Folder of a run: created with its parents, an error if not writable, only files of supple are
// removed; scenario.opts; names of fields; when a multiple of a time is due.
#include "output_fixture.h"

static char dir[512];

static PetscErrorCode write_text(const char *name, const char *text)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/%s", dir, name);
  PetscCall(test_file_put(path, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_folder(void)
{
  TestScene scene;
  char deep[PETSC_MAX_PATH_LEN + 16];

  PetscFunctionBeginUser;
  SbFormat(sizeof(deep), deep, "%s/a//b/", dir);
  PetscCall(test_scene_open_in(deep, BOX EULER, &scene));
  SB_CHECK(fixture_exists(dir, "a/b/history.csv") && fixture_exists(dir, "a/b/scenario.opts"),
           "no results in a/b");
  PetscCall(test_scene_close(&scene));
  PetscCall(write_text("a/b/notes.txt", "mine"));
  PetscCall(write_text("a/b/checkpoint_000007.h5", "of an earlier run"));
  PetscCall(test_scene_open_in(deep, BOX EULER, &scene));
  SB_CHECK(fixture_exists(dir, "a/b/notes.txt"), "a file that is not ours is gone");
  SB_CHECK(!fixture_exists(dir, "a/b/checkpoint_000007.h5"),
           "a checkpoint of an earlier run is still there");
  PetscCall(test_scene_close(&scene));
  SbFormat(sizeof(deep), deep, "%s/a/b/notes.txt/c", dir);
  SB_CHECK_ERROR(test_scene_open_in(deep, BOX EULER, &scene), PETSC_ERR_FILE_OPEN, "-output_dir");
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scenario.opts contains the given options and the default values of the others. */
static PetscErrorCode test_scenario(void)
{
  TestScene scene;
  char *text;

  PetscFunctionBeginUser;
  PetscCall(
    test_scene_open_in(dir, BOX EULER "-output_every 0.5 -probes p -probe_p_at 1,2,3", &scene));
  PetscCall(fixture_read(dir, "scenario.opts", &text));
  SB_CHECK(strstr(text, "-output_every 0.5 "), "a given option is missing");
  SB_CHECK(strstr(text, "-output_fields position,displacement,velocity,von_mises "),
           "a default is missing");
  SB_CHECK(strstr(text, "-probe_p_at 1,2,3 "), "the probe is missing");
  PetscCall(PetscFree(text));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_fields(void)
{
  PetscInt n;
  const SbField *const fields = SbFieldGetAll(&n);
  const SbField *found;
  TestScene scene;
  SbOutput out;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(SbFieldFind("-output_fields", fields[i].name, &found));
    SB_CHECK(found == &fields[i], "field %s is not found by its name", fields[i].name);

    /* `sets` are several arrays, which a separate function writes */
    SB_CHECK((fields[i].compute || !strcmp(fields[i].name, "sets")) && fields[i].unit[0] &&
               fields[i].help[0],
             "field %s is not complete", fields[i].name);
  }
  SB_CHECK_ERROR(SbFieldFind("-output_fields", "von_mizes", &found), PETSC_ERR_USER,
                 "-output_fields|'von_mizes'|von_mises");
  PetscCall(test_scene_open_in(dir, BOX EULER "-output_fields J,J,stress", &scene));
  out = (SbOutput)scene.run->monitors.output;
  SB_CHECK(out->nfield == 3 && !strcmp(out->field[2]->name, "body"),
           "a field named twice: %d fields", (int)out->nfield);
  SB_CHECK(out->sigma && out->J && !out->psi, "storage for cell quantities that nobody asked for");
  PetscCall(test_scene_close(&scene));

  // a static run has no velocity
  PetscCall(test_scene_open_in(dir, HELD " -time static -quiet", &scene));
  out = (SbOutput)scene.run->monitors.output;
  SB_CHECK(out->nfield == 4 && !strcmp(out->field[2]->name, "von_mises"),
           "a static run has %d fields", (int)out->nfield);
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void test_due(void)
{
  PetscInt n = 0;
  PetscReal t = 0.;

  // a step that ends at the multiple but for rounding has reached it; the next one has not
  SB_CHECK(SbOutputDue(0.1, 0.3 * (1. - 1e-13), 0.01), "0.3 s less a rounding is not due");
  SB_CHECK(!SbOutputDue(0.1, 0.3 * (1. - 1e-13) + 0.01, 0.01), "0.3 s is due twice");

  // a million steps, times summed up with their rounding: due 100 times
  for (PetscInt k = 1; k <= 1000000; k++) {
    t += 1e-4;
    n += SbOutputDue(1., t, 1e-4);
  }
  SB_CHECK(n == 100, "%d multiples of 1 s in 100 s", (int)n);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_folder());
  PetscCall(test_scenario());
  PetscCall(test_fields());
  test_due();
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
