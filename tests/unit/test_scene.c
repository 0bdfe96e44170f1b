/*
  test_scene.c - from options to a model; errors before anything is computed.
*/
// @ranks 1 3
#include "file.h"
#include "test.h"
#include "sbscene.h"

#define LAW " -body_liver_material corotated -body_liver_young 5e3 -body_liver_poisson 0.45"
#define LIVER "-bodies liver -body_liver_mesh box:1,1,1:2" LAW

static const char two_bodies[] =
  "-bodies liver,big_stone -body_liver_mesh box:1,1,1:2" LAW
  " -body_liver_rotate 1,0,0,90 -body_liver_translate 0,0,2 -body_liver_scale 0.1 "
  "-body_liver_angular_velocity 0,0,3 -body_big_stone_mesh box:1,1,1:3 -body_big_stone_material "
  "linear "
  "-body_big_stone_young 1e6 -body_big_stone_poisson 0.2 -body_big_stone_density 2500 "
  "-body_big_stone_velocity 1,2,3 -sets left,tip -set_left_at plane:2,0,0,1 -set_tip_at "
  "sphere:1,1,1,0.5 "
  "-effects gravity,hold,press,damp -effect_gravity_vector 0,0,-1 -effect_hold_type fixed "
  "-effect_hold_on left,big_stone,liver.xmin -effect_press_type pressure -effect_press_on "
  "boundary,left,zmax "
  "-effect_press_value 100*t -effect_damp_type damping -effect_damp_on all -effect_damp_alpha 0.1";

static PetscOptions database;

static PetscErrorCode begin(const char *options)
{
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsCreate(&database));
  PetscCall(PetscOptionsPush(database));
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(SbRegisterAll());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode end(SbModel *model)
{
  PetscFunctionBeginUser;
  PetscCall(SbModelDestroy(model));
  PetscCall(SbOptionsReset());
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&database));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model of two_bodies; `where` names the source of the options. */
static void check_two_bodies(SbModel m, const char *where)
{
  const SbBody *liver = &m->body[0];
  const SbBody *stone = &m->body[1];
  static const struct {
    const char *name, *group;
    SbSetShape shape;
  } sets[] = {
    {"left", "", SB_SET_PLANE},
    {"tip", "", SB_SET_SPHERE},
    {"big_stone", "big_stone", SB_SET_BODY},
    {"liver.xmin", "liver.xmin", SB_SET_GROUP},
    {"boundary", "", SB_SET_BOUNDARY},
    {"zmax", "zmax", SB_SET_GROUP},
    {"all", "", SB_SET_HALFSPACE},
  };

  SB_CHECK(m->nbody == 2 && m->neffect == 4, "%s: %d bodies, %d effects", where, (int)m->nbody,
           (int)m->neffect);
  SB_CHECK(!strcmp(liver->name, "liver") && !strcmp(stone->name, "big_stone"), "%s: names", where);
  SB_CHECK(!strcmp(liver->mesh, "box:1,1,1:2") && liver->scale == 0.1, "%s: mesh and scale", where);
  SB_CHECK(liver->rotate[0] == 1 && liver->rotate[3] == 90 && liver->translate[2] == 2,
           "%s: placement", where);
  SB_CHECK(liver->angular_velocity[2] == 3 && stone->velocity[1] == 2 &&
             stone->angular_velocity[0] == 0,
           "%s: motion", where);
  SB_CHECK(liver->density == 1000 && stone->density == 2500, "%s: density", where);
  SB_CHECK(!strcmp(m->material[0]->type->name, "corotated") &&
             SbMaterialYoungModulus(m->material[0]) == 5e3,
           "%s: material", where);
  SB_CHECK(!strcmp(stone->material, "linear") && SbMaterialPoisson(m->material[1]) == 0.2,
           "%s: second material", where);
  SB_CHECK(!strcmp(liver->element, "p1") && m->element[1], "%s: elements", where);
  SB_CHECK(!strcmp(m->effect[2]->name, "press") && !strcmp(m->effect[2]->type, "pressure"),
           "%s: effects", where);
  SB_CHECK(m->nset == 7, "%s: %d sets", where, (int)m->nset);
  for (PetscInt i = 0; i < PetscMin(m->nset, 7); i++) {
    const SbSet *s = &m->set[i];

    SB_CHECK(!strcmp(s->name, sets[i].name) && s->shape == sets[i].shape &&
               !strcmp(s->group, sets[i].group),
             "%s: set %d is %s, shape %d, group %s", where, (int)i, s->name, (int)s->shape,
             s->group);
  }
  SB_CHECK(!m->mesh && !m->space, "%s: something was computed", where);
}

/* The model from options, from the scenario printed from them, and from YAML. */
static PetscErrorCode test_model(const char *folder)
{
  static const char yaml[] =
    "bodies: [liver, big_stone]\n"
    "body:\n"
    "  liver: {mesh: \"box:1,1,1:2\", material: corotated, young: 5e3, poisson: "
    "0.45, rotate: [1, 0, 0, 90],\n"
    "          translate: [0, 0, 2], scale: 0.1, angular_velocity: [0, 0, 3]}\n"
    "  big_stone:\n"
    "    mesh: box:1,1,1:3\n"
    "    material: linear\n"
    "    young: 1e6\n"
    "    poisson: 0.2\n"
    "    density: 2500\n"
    "    velocity: 1,2,3\n"
    "sets: [left, tip]\n"
    "set: {left: {at: \"plane:2,0,0,1\"}, tip: {at: \"sphere:1,1,1,0.5\"}}\n"
    "effects: [gravity, hold, press, damp]\n"
    "effect:\n"
    "  gravity: {vector: [0, 0, -1]}\n"
    "  hold: {type: fixed, on: [left, big_stone, liver.xmin]}\n"
    "  press: {type: pressure, on: [boundary, left, zmax], value: 100*t}\n"
    "  damp: {type: damping, on: all, alpha: 0.1}\n";
  char view[PETSC_MAX_PATH_LEN], file[PETSC_MAX_PATH_LEN];
  PetscViewer viewer;
  SbModel model;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(view, sizeof(view), "%s/view.opts", folder));
  PetscCall(PetscSNPrintf(file, sizeof(file), "%s/scene.yml", folder));

  PetscCall(begin(two_bodies));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &model));
  check_two_bodies(model, "options");
  model->dynamic = PETSC_TRUE;
  PetscCall(SbSceneCheck(model));
  PetscCall(SbOptionsCheck());
  PetscCall(SbViewerOpen(PETSC_COMM_WORLD, view, &viewer));
  PetscCall(SbOptionsView(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(end(&model));

  PetscCall(test_file_put(file, yaml));
  for (int i = 0; i < 2; i++) {
    PetscCall(begin(""));
    PetscCall(PetscOptionsInsertFile(PETSC_COMM_WORLD, NULL, i ? file : view, PETSC_TRUE));
    PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &model));
    check_two_bodies(model, i ? "YAML" : "printed scenario");
    PetscCall(SbOptionsCheck());
    PetscCall(end(&model));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_and_check(SbModel *model)
{
  PetscFunctionBeginUser;
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, model));
  PetscCall(SbOptionsCheck());
  PetscCall(SbSceneCheck(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creation, or the check after it, must fail with a message that contains these names. */
static PetscErrorCode refused(const char *options, const char *names)
{
  SbModel model = NULL;

  PetscFunctionBeginUser;
  PetscCall(begin(options));
  SB_CHECK_ERROR(create_and_check(&model), PETSC_ERR_USER, names);
  PetscCall(end(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_names(void)
{
  PetscFunctionBeginUser;
  PetscCall(refused("", "-bodies"));
  PetscCall(refused("-bodies \" \"", "-bodies"));
  PetscCall(refused("-bodies liver,stone,liver", "-bodies|'liver'"));
  PetscCall(refused("-bodies liver,LIVER", "-bodies|'LIVER'"));
  PetscCall(refused("-bodies 1liver", "-bodies|name '1liver'"));
  PetscCall(refused("-bodies my-liver", "-bodies|name 'my-liver'"));
  PetscCall(refused("-bodies liver_", "-bodies|name 'liver_'"));
  PetscCall(refused("-bodies a__b", "-bodies|name 'a__b'"));
  PetscCall(refused("-bodies liver_1", "-bodies|name 'liver_1'"));
  PetscCall(refused("-bodies a_12_b", "-bodies|name 'a_12_b'"));
  PetscCall(refused("-bodies a23456789_123456789_123456789_12",
                    "-bodies|name 'a23456789_123456789_123456789_12'"));
  PetscCall(refused("-bodies all", "-bodies|name 'all'"));
  PetscCall(refused(LIVER " -effects gravity,gravity", "-effects|'gravity'"));
  PetscCall(refused(LIVER " -sets boundary", "-sets|name 'boundary'"));
  PetscCall(refused(LIVER " -sets liver -set_liver_at boundary", "-sets|'liver'"));
  PetscCall(refused(LIVER " -sets a", "-set_a_at"));
  PetscCall(refused(LIVER " -sets a -set_a_at body:lver", "-set_a_at body:lver|body lver"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_check(const char *folder)
{
  char options[2 * PETSC_MAX_PATH_LEN], message[2 * PETSC_MAX_PATH_LEN];
  SbModel model;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options), "%s/liver.msh", folder));
  if (!test_rank) {
    FILE *f = fopen(options, "w");

    if (f)
      (void)fclose(f);
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCall(PetscSNPrintf(options, sizeof(options),
                          "-bodies liver -body_liver_mesh %s/livr.msh" LAW, folder));
  PetscCall(PetscSNPrintf(message, sizeof(message), "-body_liver_mesh %s/livr.msh|%s/liver.msh",
                          folder, folder));
  PetscCall(refused(options, message));
  PetscCall(
    refused("-bodies liver -body_liver_mesh nowhere.msh" LAW, "-body_liver_mesh nowhere.msh"));

  /* a static run of a body without supports */
  PetscCall(refused(LIVER " -effects gravity", "-time static"));
  PetscCall(begin(LIVER " -effects hold -effect_hold_type fixed -effect_hold_on xmin"));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &model));
  PetscCall(SbSceneCheck(model));
  SB_CHECK(model->nset == 1 && model->set[0].shape == SB_SET_GROUP, "the set of the support");
  PetscCall(end(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_command(void)
{
  char *argv[] = {"supple",
                  "nix.opts",
                  "-ts_dt",
                  "-1",
                  "-Help",
                  "-version",
                  "-scenario_view",
                  "v.opts",
                  "-flag",
                  "-vector",
                  "0,",
                  "0,",
                  "-help",
                  "petsc",
                  "-options_file",
                  "/nonexistent/a.yml",
                  NULL};
  const char *const expected[] = {"supple", "nix.opts", "-ts_dt", "-1",
                                  "-flag",  "-vector",  "0,",     "-help"};
  char *only[] = {"supple", "-options_table", NULL};
  int argc = 16;
  SbCommand command;

  PetscFunctionBeginUser;
  PetscCall(SbCommandLine(PETSC_COMM_WORLD, &argc, argv, &command));
  SB_CHECK(argc == 8 && !argv[8], "%d words are left", argc);
  for (int i = 0; i < PetscMin(argc, 8); i++)
    SB_CHECK(!strcmp(argv[i], expected[i]), "word %d is %s", i, argv[i]);
  SB_CHECK(command.help && command.version && command.view && !strcmp(command.view, "v.opts"),
           "requests");
  SB_CHECK(!command.scenario && !command.table, "a scenario or a table nobody asked for");
  SB_CHECK(
    !strcmp(command.problem, "cannot read the option file nix.opts: No such file or directory"),
    "%s", command.problem);
  argc = 2;
  PetscCall(SbCommandLine(PETSC_COMM_WORLD, &argc, only, &command));
  SB_CHECK(argc == 1 && !strcmp(command.table, "-") && !command.problem[0], "-options_table alone");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each rank is a run of its own: rank 0 names a file that is not there, the others one that is. */
static PetscErrorCode test_communicator(void)
{
  char *argv[] = {"supple", test_rank ? "scenarios/cantilever.opts" : "nix.opts", NULL};
  int argc = 2;
  SbCommand command;

  PetscFunctionBeginUser;
  PetscCall(SbCommandLine(PETSC_COMM_SELF, &argc, argv, &command));
  SB_CHECK(!command.problem[0] == (test_rank > 0), "rank %d: '%s'", (int)test_rank,
           command.problem);
  SB_CHECK(command.nfile == (test_rank > 0), "rank %d has %d files", (int)test_rank,
           (int)command.nfile);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char folder[512];
  char options[4096] = LIVER " -effects hold -effect_hold_type fixed -effect_hold_on s0";
  char name[8];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(folder));
  PetscCall(test_model(folder));
  PetscCall(test_names());
  PetscCall(test_communicator());
  PetscCall(refused("-bodies liver", "-body_liver_mesh"));
  PetscCall(refused("-bodies liver -body_liver_mesh box:1,1,1:2", "-body_liver_material"));
  PetscCall(
    refused(LIVER " -body_liver_material corotate", "-body_liver_material corotate|corotated"));
  PetscCall(refused(LIVER " -body_liver_element p7", "-body_liver_element p7|p1"));
  PetscCall(refused(LIVER " -body_liver_scale 0", "-body_liver_scale 0|(0, inf)"));
  PetscCall(refused(LIVER " -body_liver_rotate 0,0,0,10", "-body_liver_rotate|0,0,0"));
  PetscCall(refused(LIVER " -body_liver_young -1", "-body_liver_young -1 Pa|(0, inf) Pa"));
  PetscCall(refused(LIVER " -body_liver_poisson 0.5", "-body_liver_poisson 0.5|(-1, 0.5)"));
  PetscCall(
    refused(LIVER " -body_liver_density 0", "-body_liver_density 0 kg/m^3|(0, inf) kg/m^3"));
  PetscCall(refused(LIVER " -mass lump", "-mass lump|lumped"));
  PetscCall(refused(LIVER " -body_stone_young 1", "-body_stone_young"));
  PetscCall(test_check(folder));

  /* 70 sets are more than one bit each; they must not be written beyond the array. */
  for (int i = 1; i < 70; i++) {
    (void)snprintf(name, sizeof(name), ",s%d", i);
    PetscCall(PetscStrlcat(options, name, sizeof(options)));
  }
  PetscCall(refused(options, "63 sets|0|-sets"));
  PetscCall(test_command());
  SB_TEST_END();
}
