/*
  Cost of the material laws on the same mesh of P1: microseconds per tet of the residual, of the
  exact tangent and of the one projected for CG, assembled; the smallest of several rounds. One line
  for each law of the registry, or for one of them.

    laws -mesh box:0.4,0.1,0.1:16 -rounds 7 -law ogden

  The bar is bent, with strains of a tenth, and a Poisson's ratio of 0.45. Laws with moduli of their
  own have the constants of tests/laws.h.
*/
#include "../laws.h"
#include "perf.h"

#define REPEAT 3

static void bend(const PetscReal x[3], PetscReal v[3])
{
  const PetscReal angle = 2. * x[0];

  v[0] = 0.1 * x[2] * x[0];
  v[1] = (PetscCosReal(angle) - 1.) * (x[1] - 0.05) - PetscSinReal(angle) * (x[2] - 0.05);
  v[2] = PetscSinReal(angle) * (x[1] - 0.05) + (PetscCosReal(angle) - 1.) * (x[2] - 0.05);
}

static PetscErrorCode residual(SbSpace s, SbStage *stage, Vec F)
{
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalWrite(s, F, &f));
  PetscCall(PetscArrayzero(f, 3 * s->nnode));
  PetscCall(SbSpaceAddInternalForce(s, stage, f));
  PetscCall(SbSpaceRestoreLocalWrite(s, F, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* us per tet of the residual, and of the tangent exact and projected. */
static PetscErrorCode measure(const char *mesh, const char *law, PetscInt rounds, double best[3])
{
  char text[PERF_TEXT];
  TestScene scene;
  SbSpace s;
  SbStage stage = {.shift_k = 1.};
  Vec U, F;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "-bodies bar -body_bar_mesh %s -body_bar_material %s -body_bar_young 5e4 "
                          "-body_bar_poisson 0.45 -body_bar_density 1000 -time euler_implicit "
                          "-ts_dt 0.01 -solver cg_pbjacobi %s",
                          mesh, law, law_moduli(law, "bar", 5e4, 0.45)));
  PetscCall(perf_read(text, &scene));
  PetscCall(SbModelSetUp(scene.model));
  s = scene.model->space;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(SbSpaceCreateVec(s, &F));
  PetscCall(test_fill(scene.model, bend, U));
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_SBAIJ, &A));
  for (PetscInt round = 0; round < rounds; round++) {
    for (int what = 0; what < 3; what++) {
      PerfClock start;
      double value;

      if (what && !scene.model->material[0]->linear)
        PetscCall(SbMaterialSetTangent(scene.model->material[0],
                                       what == 1 ? SB_TANGENT_EXACT : SB_TANGENT_EXACT_SPD));
      start = perf_start();
      for (int i = 0; i < REPEAT; i++) {
        if (what) {
          PetscCall(SbSpaceAssembleTangent(s, &stage, A));
          PetscCall(SbSpaceFinishTangent(s, A));
        } else {
          PetscCall(residual(s, &stage, F));
        }
      }
      value = 1e6 * perf_stop(start).cpu / (REPEAT * (double)scene.model->mesh->Ncell);
      best[what] = round ? PetscMin(best[what], value) : value;
    }
  }
  PetscCall(MatDestroy(&A));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&F));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:16";
  char only[SB_NAME_MAX] = "";
  const char *laws[SB_MATERIAL_TYPES];
  PetscInt rounds = 7;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-law", sizeof(only), only));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(SbRegisterAll());
  n = SbMaterialTypes(laws);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-22s %10s %10s %10s  us/tet\n", "law", "residual",
                        "exact", "exact_spd"));
  for (PetscInt i = 0; i < n; i++) {
    double best[3];

    if (only[0] && strcmp(only, laws[i]))
      continue;
    PetscCall(measure(mesh, laws[i], rounds, best));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-22s %10.3f %10.3f %10.3f\n", laws[i], best[0],
                          best[1], best[2]));
  }
  PetscCall(PetscFinalize());
  return 0;
}
