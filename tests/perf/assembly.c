/*
  Microseconds per tet: residual and tangent, compared with the element kernel alone,
  MatSetValuesBlockedLocal() and DMPlexMatSetClosure(); then MatMult() compared with the memory
  bandwidth of the machine.

    assembly -mesh box:0.4,0.1,0.1:8 -rounds 5

  The kernel alone does the work of the tangent for each batch (gather, F, polar rotation, ten
  blocks) and writes the blocks repeatedly to the same small buffer. The alternatives get their
  blocks from the same kernel; they insert the owned cells and then communicate, as programs without
  overlap do. DMPlexMatSetClosure() visits the cells in the DM's own order and adds to a matrix in
  the DM's own numbering; the values do not matter for its speed.

  The displacement bends and twists the bar, with small and large rotations.
*/
#include "perf.h"

enum {
  TRIAD = 8 << 20
}; /* numbers in each of the three arrays: 192 MB, beyond any cache */

typedef struct {
  TestScene scene;
  SbSpace s;
  Vec U, F;
  const PetscReal *u;
  SbStage stage;
  Mat A[3], set[2], closure; /* by SbMatrixKind; BAIJ and AIJ for MatSetValuesBlockedLocal() */
  DM dm;
  PetscMPIInt size;
  double per_tet; /* microseconds per second of the whole */
} Bench;

static void bend(const PetscReal x[3], PetscReal v[3])
{
  const PetscReal angle = 6. * x[0];

  v[0] = 0.1 * x[2] * x[0];
  v[1] = (PetscCosReal(angle) - 1.) * (x[1] - 0.05) - PetscSinReal(angle) * (x[2] - 0.05);
  v[2] = PetscSinReal(angle) * (x[1] - 0.05) + (PetscCosReal(angle) - 1.) * (x[2] - 0.05);
}

/* ------------------------------------------------------------------ alternatives */

/* Ten blocks of batch b, as the tangent makes them. */
static void blocks(Bench *w, const SbRegion *region, PetscInt b, SbPack K[10][9])
{
  const SbMaterial m = region->material;
  const PetscInt *node = w->s->batch_clique + w->s->width * SB_BATCH * b;
  SbPack u[12], F[9], R[9];

  for (int a = 0; a < 4; a++) {
    for (int l = 0; l < SB_BATCH; l++)
      for (int i = 0; i < 3; i++)
        u[3 * a + i][l] = w->u[3 * node[a * SB_BATCH + l] + i];
  }
  SbCellGradient(w->s->batch_g + 9 * b, (const SbPack *)u, 1., F);
  m->ops.frame(m, (const SbPack *)F, R);
  SbCellBlocksIsotropic(w->s->batch_g + 9 * b, w->s->batch_V[b], SbMaterialVolumetricModulus(m),
                        SbMaterialShearModulus(m), (const SbPack *)R, K);
}

static PetscErrorCode bare_kernel(Bench *w)
{
  static SbPack K[10][9] __attribute__((aligned(64)));

  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < w->s->nregion; r++) {
    const SbRegion *region = &w->s->region[r];

    for (PetscInt b = region->bstart; b < region->bend; b++)
      blocks(w, region, b, K);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole 12x12 matrix of lane l, row-major. */
static void whole_matrix(SbPack K[10][9], int l, PetscReal Ke[144])
{
  for (int p = 0; p < 10; p++) {
    const int a = SbPairA[p];
    const int b = SbPairB[p];

    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) {
        Ke[12 * (3 * a + i) + 3 * b + j] = K[p][3 * i + j][l];
        Ke[12 * (3 * b + j) + 3 * a + i] = K[p][3 * i + j][l];
      }
    }
  }
}

/* By MatSetValuesBlockedLocal(), or with a DM by DMPlexMatSetClosure(). */
static PetscErrorCode insert(Bench *w, DM dm, Mat A)
{
  PetscFunctionBeginUser;
  PetscCall(MatZeroEntries(A));
  for (PetscInt r = 0; r < w->s->nregion; r++) {
    const SbRegion *region = &w->s->region[r];

    for (PetscInt b = region->bstart; b < region->bend && b < w->s->nbatch_owned; b++) {
      SbPack K[10][9] __attribute__((aligned(64)));

      blocks(w, region, b, K);
      for (int l = 0; l < w->s->batch_n[b]; l++) {
        const PetscInt cell = w->s->batch_cell[b] + l;
        const PetscInt *node = w->s->cell_node + 4 * cell;
        PetscReal Ke[144];

        whole_matrix(K, l, Ke);
        if (dm)
          PetscCall(DMPlexMatSetClosure(dm, NULL, NULL, A, cell, Ke, ADD_VALUES));
        else
          PetscCall(MatSetValuesBlockedLocal(A, 4, node, 4, node, Ke, ADD_VALUES));
      }
    }
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent(Bench *w, Mat A)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceAssembleTangent(w->s, &w->stage, A));
  PetscCall(SbSpaceFinishTangent(w->s, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode residual(Bench *w)
{
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalWrite(w->s, w->F, &f));
  PetscCall(PetscArrayzero(f, 3 * w->s->nnode));
  PetscCall(SbSpaceAddInternalForce(w->s, &w->stage, f));
  PetscCall(SbSpaceRestoreLocalWrite(w->s, w->F, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ set-up */

/* Three unknowns per vertex, laid out and preallocated by DMPlex. */
static PetscErrorCode create_closure(Bench *w)
{
  PetscSection section;
  PetscInt pStart, pEnd, vStart, vEnd;

  PetscFunctionBeginUser;
  PetscCall(perf_plex(w->scene.model->mesh, &w->dm));
  PetscCall(DMPlexGetChart(w->dm, &pStart, &pEnd));
  PetscCall(DMPlexGetDepthStratum(w->dm, 0, &vStart, &vEnd));
  PetscCall(PetscSectionCreate(PETSC_COMM_WORLD, &section));
  PetscCall(PetscSectionSetChart(section, pStart, pEnd));
  for (PetscInt v = vStart; v < vEnd; v++)
    PetscCall(PetscSectionSetDof(section, v, 3));
  PetscCall(PetscSectionSetUp(section));
  PetscCall(DMSetLocalSection(w->dm, section));
  PetscCall(PetscSectionDestroy(&section));
  PetscCall(DMSetMatType(w->dm, MATAIJ));
  PetscCall(DMCreateMatrix(w->dm, &w->closure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_matrices(Bench *w)
{
  ISLocalToGlobalMapping map;

  PetscFunctionBeginUser;
  PetscCall(ISLocalToGlobalMappingCreate(PETSC_COMM_WORLD, 3, w->s->nnode, w->s->gnode,
                                         PETSC_COPY_VALUES, &map));
  for (int k = 0; k < 2; k++) {
    PetscCall(SbSpaceCreateMatrix(w->s, k ? SB_MATRIX_AIJ : SB_MATRIX_BAIJ, &w->set[k]));
    PetscCall(MatSetLocalToGlobalMapping(w->set[k], map, map));
  }
  PetscCall(ISLocalToGlobalMappingDestroy(&map));
  PetscCall(SbSpaceCreateMatrix(w->s, SB_MATRIX_AIJ, &w->A[SB_MATRIX_AIJ]));
  PetscCall(SbSpaceCreateMatrix(w->s, SB_MATRIX_BAIJ, &w->A[SB_MATRIX_BAIJ]));
  if (w->size == 1)
    PetscCall(SbSpaceCreateMatrix(w->s, SB_MATRIX_SBAIJ, &w->A[SB_MATRIX_SBAIJ]));
  PetscCall(create_closure(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode bench_create(const char *mesh, Bench *w)
{
  char text[PERF_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(w, sizeof(*w)));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &w->size));
  PetscCall(perf_bar(mesh, "-solver cg_pbjacobi", text));
  PetscCall(perf_open(text, &w->scene));
  w->s = w->scene.model->space;
  w->per_tet = 1e6 / (double)w->scene.model->mesh->Ncell;
  PetscCall(SbSpaceCreateVec(w->s, &w->U));
  PetscCall(SbSpaceCreateVec(w->s, &w->F));
  PetscCall(test_fill(w->scene.model, bend, w->U));
  PetscCall(SbSpaceGetLocalRead(w->s, w->U, &w->u));
  w->stage = (SbStage){.u = w->u, .shift_k = 1.};
  PetscCall(create_matrices(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode bench_destroy(Bench *w)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceRestoreLocalRead(w->s, w->U, &w->u));
  for (int k = 0; k < 3; k++)
    PetscCall(MatDestroy(&w->A[k]));
  for (int k = 0; k < 2; k++)
    PetscCall(MatDestroy(&w->set[k]));
  PetscCall(MatDestroy(&w->closure));
  PetscCall(DMDestroy(&w->dm));
  PetscCall(VecDestroy(&w->U));
  PetscCall(VecDestroy(&w->F));
  PetscCall(test_scene_close(&w->scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ rounds */

#define TIME_PER_TET(w, name, call)                                              \
  do {                                                                           \
    const PerfClock start_ = perf_start();                                       \
    PetscCall(call);                                                             \
    PetscCall(perf_sample(name, "us/tet", (w)->per_tet *perf_stop(start_).cpu)); \
  } while (0)

static PetscErrorCode assembly_round(Bench *w)
{
  PetscFunctionBeginUser;
  TIME_PER_TET(w, "kernel", bare_kernel(w));
  TIME_PER_TET(w, "residual", residual(w));
  if (w->A[SB_MATRIX_SBAIJ])
    TIME_PER_TET(w, "tangent_sbaij", tangent(w, w->A[SB_MATRIX_SBAIJ]));
  TIME_PER_TET(w, "tangent_baij", tangent(w, w->A[SB_MATRIX_BAIJ]));
  TIME_PER_TET(w, "tangent_aij", tangent(w, w->A[SB_MATRIX_AIJ]));
  TIME_PER_TET(w, "setvalues_baij", insert(w, NULL, w->set[0]));
  TIME_PER_TET(w, "setvalues_aij", insert(w, NULL, w->set[1]));
  TIME_PER_TET(w, "closure_aij", insert(w, w->dm, w->closure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The two ways of assembly must have made the same matrix, or their times say nothing. */
static PetscErrorCode compare(Bench *w)
{
  PetscReal difference, size;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < w->s->nfixed; k++)
    w->s->fixed[w->s->fixed_node[k]] = 0;
  PetscCall(SbSpaceAssembleTangent(w->s, &w->stage, w->A[SB_MATRIX_AIJ]));
  PetscCall(MatAssemblyBegin(w->A[SB_MATRIX_AIJ], MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(w->A[SB_MATRIX_AIJ], MAT_FINAL_ASSEMBLY));
  PetscCall(insert(w, NULL, w->set[1]));
  PetscCall(MatNorm(w->set[1], NORM_FROBENIUS, &size));
  PetscCall(MatAXPY(w->set[1], -1., w->A[SB_MATRIX_AIJ], SAME_NONZERO_PATTERN));
  PetscCall(MatNorm(w->set[1], NORM_FROBENIUS, &difference));
  PetscCheck(difference < 1e-13 * size, PETSC_COMM_WORLD, PETSC_ERR_PLIB,
             "The matrices differ by %g of %g", (double)difference, (double)size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* a = b + 3 c, as the STREAM benchmark counts: three numbers moved per entry (McCalpin 1995). */
static PetscErrorCode triad_rounds(PetscInt rounds)
{
  PetscReal *a, *b, *c;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscMalloc3(TRIAD, &a, TRIAD, &b, TRIAD, &c));
  for (PetscInt i = 0; i < TRIAD; i++) {
    a[i] = 0.;
    b[i] = 1.;
    c[i] = (PetscReal)i;
  }
  for (PetscInt r = 0; r < rounds; r++) {
    const PerfClock start = perf_start();

    for (PetscInt i = 0; i < TRIAD; i++)
      a[i] = b[i] + 3. * c[i];
    PetscCall(perf_sample("triad", "GB/s", 24e-9 * TRIAD * size / perf_stop(start).cpu));
    PetscCheck(a[rounds] == 1. + 3. * (PetscReal)rounds, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "Wrong sum");
  }
  PetscCall(PetscFree3(a, b, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Bytes that one product must move: values, column numbers, the two vectors once. Of BAIJ the blocks
  below the diagonal stay where they are.
*/
static PetscErrorCode matmult_bytes(Mat A, PetscInt kind, double *bytes)
{
  MatInfo info;
  PetscInt n;
  double blocks;

  PetscFunctionBeginUser;
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(A, &n, NULL));
  blocks = info.nz_used / 9.;
  if (kind == SB_MATRIX_BAIJ)
    blocks = 0.5 * (blocks + (double)n / 3.);
  *bytes =
    blocks * (72. + (kind == SB_MATRIX_AIJ ? 9. : 1.) * (double)sizeof(PetscInt)) + 16. * (double)n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode matmult_round(Bench *w)
{
  static const char *const names[] = {"matmult_aij", "matmult_baij", "matmult_sbaij"};

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    const PetscInt times = 1 + (PetscInt)(4e6 / (double)w->scene.model->mesh->Ncell);
    PerfClock start;
    double bytes = 0.;
    double seconds;
    char name[64];

    if (!w->A[k])
      continue;
    PetscCall(matmult_bytes(w->A[k], k, &bytes));
    start = perf_start();
    for (PetscInt i = 0; i < times; i++)
      PetscCall(MatMult(w->A[k], w->U, w->F));
    seconds = perf_stop(start).cpu / (double)times;
    PetscCall(PetscSNPrintf(name, sizeof(name), "%s_time", names[k]));
    PetscCall(perf_sample(name, "ns/tet", 1e3 * w->per_tet * seconds));
    PetscCall(perf_sample(names[k], "GB/s", 1e-9 * bytes / seconds));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:8";
  PetscInt rounds = 5;
  Bench w;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(bench_create(mesh, &w));
  PetscCall(perf_fact("tets", (double)w.scene.model->mesh->Ncell));
  PetscCall(perf_fact("nodes", (double)w.s->Nnode));
  for (PetscInt r = 0; r < rounds; r++)
    PetscCall(assembly_round(&w));
  PetscCall(triad_rounds(rounds));
  for (PetscInt r = 0; r < rounds; r++)
    PetscCall(matmult_round(&w));
  PetscCall(compare(&w));
  PetscCall(bench_destroy(&w));
  PetscCall(PetscFinalize());
  return 0;
}
