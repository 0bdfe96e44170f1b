/*
  Cost of the elements on the same mesh: microseconds per tet of residual and tangent, seconds per
  million tets to plan and create the matrix, bytes and unknowns per tet.

    elements -element cr -mesh box:0.4,0.1,0.1:8 -rounds 5

  Matrix: symmetric on one rank, blocks on several. The displacement bends and twists the bar. For
  p2 also the kernel alone: gradients, material and blocks of P1 at the four points, and the 55
  blocks of each tet from them, written repeatedly to the same small buffer; without the mean
  volume.
*/
#include "perf.h"

typedef struct {
  TestScene scene;
  SbSpace s;
  Vec U, F;
  SbStage stage;
  Mat A;
} Case;

static void bend(const PetscReal x[3], PetscReal v[3])
{
  const PetscReal angle = 6. * x[0];

  v[0] = 0.1 * x[2] * x[0];
  v[1] = (PetscCosReal(angle) - 1.) * (x[1] - 0.05) - PetscSinReal(angle) * (x[2] - 0.05);
  v[2] = PetscSinReal(angle) * (x[1] - 0.05) + (PetscCosReal(angle) - 1.) * (x[2] - 0.05);
}

static PetscErrorCode residual(Case *c)
{
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalWrite(c->s, c->F, &f));
  PetscCall(PetscArrayzero(f, 3 * c->s->nnode));
  PetscCall(SbSpaceAddInternalForce(c->s, &c->stage, f));
  PetscCall(SbSpaceRestoreLocalWrite(c->s, c->F, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void bare_kernel(Case *c, const PetscReal u[])
{
  static SbPack K[SB_PAIRS][9] __attribute__((aligned(64)));
  const SbSpace s = c->s;

  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbMaterial m = s->region[0].pointwise;
    const PetscInt *node = s->batch_clique + s->width * SB_BATCH * b;
    const SbPack *g = s->batch_g + 9 * b;
    SbPack B[4][10][9] __attribute__((aligned(64))), U[30], W, none[30] = {{0}};

    for (int k = 0; k < 30 * SB_BATCH; k++)
      U[k / SB_BATCH][k % SB_BATCH] =
        u[3 * node[k / (3 * SB_BATCH) * SB_BATCH + k % SB_BATCH] + k / SB_BATCH % 3];
    for (int l = 0; l < SB_BATCH; l++)
      W[l] = 0.25 * s->batch_V[b][l];
    for (int q = 0; q < 4; q++) {
      SbPack at[12], F[9], R[9];

      SbQuadraticAt(SbRuleQuadratic.L[q], (const SbPack *)U, at);
      SbCellGradient(g, (const SbPack *)at, 1., F);
      m->ops.frame(m, (const SbPack *)F, R);
      SbCellBlocksIsotropic(g, W, SbMaterialVolumetricModulus(m), SbMaterialShearModulus(m),
                            (const SbPack *)R, B[q]);
    }
    SbQuadraticBlocks(&SbRuleQuadratic, (const SbPack(*)[10][9])B, W, (const SbPack *)none, K);
  }
}

static PetscErrorCode measure(Case *c, PetscInt rounds)
{
  const double tets = (double)c->scene.model->mesh->Ncell;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < rounds; k++) {
    PerfClock start = perf_start();

    for (int i = 0; i < 3; i++)
      PetscCall(residual(c));
    PetscCall(perf_sample("residual", "us/tet", 1e6 * perf_stop(start).cpu / (3. * tets)));
    start = perf_start();
    for (int i = 0; i < 3; i++) {
      PetscCall(SbSpaceAssembleTangent(c->s, &c->stage, c->A));
      PetscCall(SbSpaceFinishTangent(c->s, c->A));
    }
    PetscCall(perf_sample("tangent", "us/tet", 1e6 * perf_stop(start).cpu / (3. * tets)));
    if (!c->s->edge_node)
      continue;
    start = perf_start();
    for (int i = 0; i < 3; i++)
      bare_kernel(c, c->stage.u);
    PetscCall(perf_sample("kernel", "us/tet", 1e6 * perf_stop(start).cpu / (3. * tets)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:8";
  char element[64] = "p1";
  char more[256], text[PERF_TEXT];
  PetscInt rounds = 5;
  PetscMPIInt size;
  PerfClock start;
  MatInfo info;
  Case c;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-element", sizeof(element), element));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(PetscSNPrintf(more, sizeof(more), "-solver cg_pbjacobi -body_bar_element %s", element));
  PetscCall(perf_bar(mesh, more, text));
  PetscCall(perf_read(text, &c.scene));
  start = perf_start();
  PetscCall(SbModelSetUp(c.scene.model));
  c.s = c.scene.model->space;
  PetscCall(perf_fact("tets", (double)c.scene.model->mesh->Ncell));
  PetscCall(perf_fact("setup_s", perf_stop(start).cpu));
  PetscCall(SbSpaceCreateVec(c.s, &c.U));
  PetscCall(SbSpaceCreateVec(c.s, &c.F));
  PetscCall(test_fill(c.scene.model, bend, c.U));
  PetscCall(SbSpaceGetLocalRead(c.s, c.U, &c.stage.u));
  c.stage = (SbStage){.u = c.stage.u, .shift_k = 1.};
  start = perf_start();
  PetscCall(SbSpaceCreateMatrix(c.s, size > 1 ? SB_MATRIX_BAIJ : SB_MATRIX_SBAIJ, &c.A));
  PetscCall(perf_sample("plan_and_matrix", "s/Mtet",
                        1e6 * perf_stop(start).cpu / (double)c.scene.model->mesh->Ncell));
  PetscCall(measure(&c, rounds));
  PetscCall(MatGetInfo(c.A, MAT_GLOBAL_SUM, &info));

  /* a number and, for each block of nine, its column */
  PetscCall(perf_sample("matrix", "B/tet",
                        info.nz_used * (8. + 4. / 9.) / (double)c.scene.model->mesh->Ncell));
  PetscCall(
    perf_sample("unknowns", "1/tet", 3. * (double)c.s->Nnode / (double)c.scene.model->mesh->Ncell));
  PetscCall(MatDestroy(&c.A));
  PetscCall(SbSpaceRestoreLocalRead(c.s, c.U, &c.stage.u));
  PetscCall(VecDestroy(&c.U));
  PetscCall(VecDestroy(&c.F));
  PetscCall(test_scene_close(&c.scene));
  PetscCall(PetscFinalize());
  return 0;
}
