/*
  inputs.h - inputs of a run other than meshes, one at a time through what reads them: formulas,
  tables, files of copies, states of bodies, checkpoints.

  States and checkpoints are files that a run of one cube has written, with edits that the bytes of
  the fuzzer describe, as HDF5 itself breaks where the container is damaged (h5.h). An edit is:
    object, what to do, and
      0: place (two bytes), value    one number is replaced
      1:                             the array is removed
      2: type, dimensions, values    another array in its place, as in h5.h
      3: number, value               an attribute gets another value, 127: it is removed
*/
#pragma once
#include "h5.h"
#include "../scene.h"
#include "../../src/output/output_impl.h"
#include "../../src/scene/scene_impl.h"

#define FUZZ_CUBE                                                                     \
  "-bodies a -body_a_mesh box:1,1,1:1 -body_a_material linear -body_a_young 1000 "    \
  "-body_a_poisson 0.25 -body_a_density 10 -effects g -effect_g_type gravity -quiet " \
  "-ts_dt 0.1 -ts_max_time 0.2 -output_fields displacement,velocity "                 \
  "-checkpoint_every_steps 1 "

/* Objects of a file, by their paths. */
typedef struct {
  int n;
  char name[64][128];
} FuzzObjects;

static TestScene fuzz_scene; /* the cube, with the state of the input */

static inline herr_t fuzz_add_object(hid_t file, const char *name, const H5L_info_t *info,
                                     void *ctx)
{
  FuzzObjects *all = (FuzzObjects *)ctx;

  (void)file, (void)info;
  if (all->n < 64)
    (void)snprintf(all->name[all->n++], sizeof(all->name[0]), "/%.120s", name);
  return 0;
}

/* Copies a whole file. */
static inline void fuzz_copy(const char *from, const char *to)
{
  FILE *in = fopen(from, "rb");
  FILE *out = fopen(to, "wb");
  char block[1 << 14];
  size_t n;

  while (in && out && (n = fread(block, 1, sizeof(block), in)) > 0)
    (void)fwrite(block, 1, n, out);
  if (in)
    (void)fclose(in);
  if (out)
    (void)fclose(out);
}

/* Replaces one number of an array. */
static inline void fuzz_set_number(hid_t file, const char *name, int place, double value)
{
  const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t space = set < 0 ? -1 : H5Dget_space(set);
  const hid_t one = H5Screate(H5S_SCALAR);
  const int ndim = space < 0 ? -1 : H5Sget_simple_extent_ndims(space);
  const hssize_t n = space < 0 ? 0 : H5Sget_simple_extent_npoints(space);
  hsize_t size[H5S_MAX_RANK], at[H5S_MAX_RANK];

  if (n > 0 && ndim > 0) {
    hsize_t flat = (hsize_t)place % (hsize_t)n;

    (void)H5Sget_simple_extent_dims(space, size, NULL);
    for (int d = ndim - 1; d >= 0; d--) {
      at[d] = flat % size[d];
      flat /= size[d];
    }
    (void)H5Sselect_elements(space, H5S_SELECT_SET, 1, at);
  }
  if (n > 0)
    (void)H5Dwrite(set, H5T_NATIVE_DOUBLE, ndim > 0 ? one : H5S_ALL, ndim > 0 ? space : H5S_ALL,
                   H5P_DEFAULT, &value);
  (void)H5Sclose(one);
  if (space >= 0)
    (void)H5Sclose(space);
  if (set >= 0)
    (void)H5Dclose(set);
}

/* Replaces the number in an attribute, or removes it. */
static inline void fuzz_set_attribute(hid_t file, const char *name, int number, int value)
{
  const hid_t object = H5Oopen(file, name, H5P_DEFAULT);
  const hid_t a = object < 0 ? -1
                             : H5Aopen_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC,
                                              (hsize_t)number % 8, H5P_DEFAULT, H5P_DEFAULT);
  const double real = value == -128 ? INFINITY : value == -127 ? NAN : value;
  char key[128] = "";

  if (a >= 0) {
    (void)H5Aget_name(a, sizeof(key), key);
    (void)H5Awrite(a, H5T_NATIVE_DOUBLE, &real);
    (void)H5Aclose(a);
  }
  if (a >= 0 && value == 127)
    (void)H5Adelete(object, key);
  if (object >= 0)
    (void)H5Oclose(object);
}

/* The file `seed` with the edits, as `path`. */
static inline void fuzz_edit(const char *seed, const char *path, const char *data, size_t n)
{
  FuzzBytes b = {(const unsigned char *)data, (const unsigned char *)data + n};
  static FuzzObjects all;
  hid_t file;

  (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  fuzz_copy(seed, path);
  file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
  all.n = 0;
  (void)H5Lvisit(file, H5_INDEX_NAME, H5_ITER_INC, fuzz_add_object, &all);
  while (b.at < b.end && all.n) {
    const char *name = all.name[fuzz_byte(&b) % all.n];
    const int what = fuzz_byte(&b) % 4;

    if (what == 0) {
      const int place = fuzz_byte(&b) + 256 * fuzz_byte(&b);
      const int v = fuzz_signed(&b);

      fuzz_set_number(file, name, place, v == 127 ? NAN : v == -128 ? INFINITY : v);
    } else if (what == 1)
      (void)H5Ldelete(file, name, H5P_DEFAULT);
    else if (what == 2)
      fuzz_h5_put(&b, file, name);
    else {
      const int number = fuzz_byte(&b);

      fuzz_set_attribute(file, name, number, fuzz_signed(&b));
    }
  }
  (void)H5Fclose(file);
}

/* Runs the cube in FOLDER/run, and opens it again. */
static inline PetscErrorCode fuzz_open(const char *folder)
{
  char text[TEST_TEXT], dir[256], seed[600];

  PetscFunctionBeginUser;
  if (fuzz_scene.run)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbFormat(sizeof(dir), dir, "%s/run", folder);
  PetscCall(test_scene_open_in(dir, FUZZ_CUBE, &fuzz_scene));
  PetscCall(test_scene_solve(&fuzz_scene));
  PetscCall(test_scene_close(&fuzz_scene));
  SbFormat(sizeof(seed), seed, "%s/fields.h5", dir);
  SbFormat(sizeof(text), text, "%s/state.h5", folder);
  fuzz_copy(seed, text);
  SbFormat(sizeof(seed), seed, "%s/checkpoint_000002.h5", dir);
  SbFormat(sizeof(text), text, "%s/checkpoint.h5", folder);
  fuzz_copy(seed, text);
  SbFormat(sizeof(dir), dir, "%s/again", folder);
  PetscCall(test_scene_open_in(dir, FUZZ_CUBE, &fuzz_scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode fuzz_formula_text(const char *text)
{
  const PetscReal x[3] = {0.5, -2, 3};
  SbFormula f;
  SbScope scope;
  PetscReal value;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsSetValue(NULL, "-effect_g_time", text));
  SbScopeSet(&scope, "effect", "gravity", "g");
  PetscCall(SbOptionFormulas(&scope, "time", &f));
  ierr = SbFormulaEval(f, 4, x, &value);
  if (!ierr)
    ierr = SbFormulaEval(f, -1e9, x, &value);
  PetscCall(SbFormulaDestroy(&f));
  PetscFunctionReturn(ierr);
}

/* A formula in a file, as the text of an option. */
static inline PetscErrorCode fuzz_formula(const char *folder, const char *path)
{
  char text[1024];
  FILE *file = fopen(path, "rb");

  (void)folder;
  PetscFunctionBeginUser;
  text[file ? fread(text, 1, sizeof(text) - 1, file) : 0] = 0;
  if (file)
    (void)fclose(file);

  // that reads another file, as PETSc's option database would
  if (!strncmp(text, "table:", 6))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(fuzz_formula_text(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode fuzz_table(const char *folder, const char *path)
{
  char text[600];

  (void)folder;
  PetscFunctionBeginUser;
  SbFormat(sizeof(text), text, "table:%s", path);
  PetscCall(fuzz_formula_text(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode fuzz_copies(const char *folder, const char *path)
{
  SbPlacement *place;
  PetscInt n;

  (void)folder;
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsSetValue(NULL, "-body_a_copies", path));
  PetscCall(SbSceneReadCopies(PETSC_COMM_WORLD, "a", &n, &place));
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode fuzz_state(const char *folder, const char *path)
{
  SbStart *start = &fuzz_scene.model->start[0];
  PetscErrorCode ierr;

  (void)folder;
  PetscFunctionBeginUser;
  (void)snprintf(start->state, sizeof(start->state), "%s", path);
  ierr = SbOutputLoadState(fuzz_scene.run);
  start->state[0] = 0;
  PetscFunctionReturn(ierr);
}

static inline PetscErrorCode fuzz_checkpoint(const char *folder, const char *path)
{
  SbOutput out = (SbOutput)fuzz_scene.run->monitors.output;
  PetscErrorCode ierr;

  (void)folder;
  PetscFunctionBeginUser;
  (void)snprintf(out->restart, sizeof(out->restart), "%s", path);
  ierr = SbCheckpointLoad(fuzz_scene.run);
  out->restart[0] = 0;
  PetscFunctionReturn(ierr);
}

/* seed: of edits, in the folder; NULL: the input is the file. */
static const struct {
  const char *name, *ending, *seed;
  PetscErrorCode (*use)(const char *folder, const char *path);
} fuzz_inputs[] = {
  {"formula", ".formula", NULL, fuzz_formula},
  {"table", ".table", NULL, fuzz_table},
  {"copies", ".copies", NULL, fuzz_copies},
  {"state", ".h5", "state.h5", fuzz_state},
  {"checkpoint", ".h5", "checkpoint.h5", fuzz_checkpoint},
};
enum {
  NINPUT = (int)PETSC_STATIC_ARRAY_LENGTH(fuzz_inputs)
};

/* One input; text: of the error. Returns its code. */
static inline PetscErrorCode fuzz_use(int input, const char *folder, const char *data, size_t n,
                                      char text[1024])
{
  char path[300], seed[300];
  PetscErrorCode ierr;
  FILE *file;

  text[0] = 0;
  SbFormat(sizeof(path), path, "%s/in%s", folder, fuzz_inputs[input].ending);
  ierr = fuzz_open(folder);
  if (ierr)
    return ierr;
  if (fuzz_inputs[input].seed) {
    SbFormat(sizeof(seed), seed, "%s/%s", folder, fuzz_inputs[input].seed);
    fuzz_edit(seed, path, data, n);
  } else {
    file = fopen(path, "wb");
    if (file && n)
      (void)fwrite(data, 1, n, file);
    if (file)
      (void)fclose(file);
  }
  (void)PetscPushErrorHandler(fuzz_keep_error, text);
  ierr = (*fuzz_inputs[input].use)(folder, path);
  (void)PetscPopErrorHandler();

  // as the program's handler of errors does with an option that it quotes
  for (char *c = strchr(text, '\n'); c; c = strchr(c, '\n'))
    *c = ' ';
  return ierr;
}
