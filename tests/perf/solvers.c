/*
  One linear solve of a nearly incompressible body, for scripts/solvers: cost and convergence of a
  solver.

    solvers -mesh box:0.4,0.1,0.1:6 -hold plane:1,0,0,0 -element cr -nu 0.4999 -with " -solver
    pressure"

  A body under its weight, clamped at the set -hold, small strains, relative residual 1e-8. -with:
  further options, which must begin with a blank, or PETSc takes them for another option. -plain:
  algebraic multigrid without the rigid-body modes. -star: on the matrix of -solver cg_gamg,
  additive Schwarz with one block per vertex, all nodes of the faces at the vertex, and P1 as a
  coarse space, both solved exactly. P1 is the Galerkin product: a CR or DG function that is P1 has
  on a face the mean of its three vertices. Schoeberl (1999), Multigrid methods for a parameter
  dependent problem in primal variables: such blocks contain the local divergence-free functions,
  which a smoother needs for nu near 1/2.

  Prints `fact NAME VALUE`: tets, unknowns, iterations, reason (PETSc's KSPConvergedReason,
  negative: failure), residual (|b - K x| / |b|, recomputed), simpler (1: the fine level of
  cg_two_level is the diagonal), setup and solve (CPU seconds of the slower rank), memory (MB of the
  larger rank). Set-up: plan, matrices, tangent, preconditioner. A rank that waits for another one
  sleeps, so that its CPU time does not include waiting on a busy machine. After -limit CPU seconds
  of a rank it prints `fact late` and exits with a non-zero code.
*/
#ifdef __linux__
  #include <sys/prctl.h>
#endif
#include <sys/resource.h>
#include <sbsolver.h>
#include "perf.h"
/* after the others: it uses what it does not include */
#include <petscblaslapack.h>

/* What Open MPI calls in its loop while a message is awaited, if told so (mpi_yield_when_idle). */
int sched_yield(void);
int sched_yield(void)
{
  const struct timespec nap = {0, 100000};

  (void)nanosleep(&nap, NULL);
  return 0;
}

/* ------------------------------------------------------------------ vertex stars and P1 */

static int by_number(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a;
  const PetscInt y = *(const PetscInt *)b;

  return (x > y) - (x < y);
}

/* Sorts, drops what comes twice, returns how many are left. */
static PetscInt sort_unique(PetscInt n, PetscInt x[])
{
  PetscInt left = 0;

  qsort(x, (size_t)n, sizeof(*x), by_number);
  for (PetscInt k = 0; k < n; k++)
    if (!k || x[k] != x[k - 1])
      x[left++] = x[k];
  return left;
}

/* Global nodes of the faces that contain each owned vertex: from start[v] to start[v + 1], some
   twice; PetscFree() both. */
static PetscErrorCode list_stars(SbSpace s, PetscInt **start, PetscInt **node)
{
  const SbMesh mesh = s->mesh;
  PetscInt *at, *list;
  PetscInt sum = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(mesh->nvert_owned + 1, &at));
  for (PetscInt k = 0; k < 4 * mesh->ncell; k++)
    if (mesh->cell[k] < mesh->nvert_owned)
      at[mesh->cell[k]] += 6; /* three faces, each perhaps with a support */
  for (PetscInt v = 0; v <= mesh->nvert_owned; v++) {
    const PetscInt n = v < mesh->nvert_owned ? at[v] : 0;

    at[v] = sum;
    sum += n;
  }
  PetscCall(PetscMalloc1(sum, &list));
  for (PetscInt k = 0; k < 4 * mesh->ncell; k++) {
    const PetscInt v = mesh->cell[k];
    const PetscInt a = k % 4;

    if (v >= mesh->nvert_owned)
      continue;
    for (PetscInt f = 0; f < 4; f++) {
      const PetscInt slot = k - a + f;
      const PetscInt support = s->dirichlet_node ? s->dirichlet_node[slot] : -1;

      if (f == a)
        continue;
      list[at[v]++] = s->gnode[s->cell_node[slot]];
      list[at[v]++] = s->gnode[support < 0 ? s->cell_node[slot] : support];
    }
  }
  for (PetscInt v = mesh->nvert_owned; v > 0; v--)
    at[v] = at[v - 1];
  at[0] = 0;
  *start = at;
  *node = list;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks of this rank, each a dense Cholesky factor. */
typedef struct {
  PetscInt n, *start,
    *node; /* nodes of block v: node[start[v]] .. node[start[v] + length[v] - 1], places in `local` */
  PetscInt *length;
  PetscScalar **factor, *work;
  VecScatter scatter;
  Vec local;
} Stars;

/* Replaces global nodes by their places among all that occur; these, as unknowns. */
static PetscErrorCode number_stars(Stars *t, IS *all)
{
  PetscInt *list;
  PetscInt n = 0;
  PetscInt total = 0;

  PetscFunctionBeginUser;
  for (PetscInt v = 0; v < t->n; v++)
    total += t->length[v];
  PetscCall(PetscMalloc1(total, &list));
  for (PetscInt v = 0; v < t->n; v++) {
    PetscCall(PetscArraycpy(list + n, t->node + t->start[v], t->length[v]));
    n += t->length[v];
  }
  n = sort_unique(n, list);
  for (PetscInt v = 0; v < t->n; v++)
    for (PetscInt k = t->start[v]; k < t->start[v] + t->length[v]; k++)
      PetscCall(PetscFindInt(t->node[k], n, list, &t->node[k]));
  PetscCall(ISCreateBlock(PETSC_COMM_SELF, 3, n, list, PETSC_COPY_VALUES, all));
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode factor_stars(Stars *t, Mat A)
{
  PetscInt most = 0;
  PetscInt *row;

  PetscFunctionBeginUser;
  for (PetscInt v = 0; v < t->n; v++)
    most = PetscMax(most, 3 * t->length[v]);
  PetscCall(PetscMalloc1(most, &t->work));
  PetscCall(PetscMalloc1(most, &row));
  PetscCall(PetscMalloc1(t->n, &t->factor));
  for (PetscInt v = 0; v < t->n; v++) {
    const PetscInt n = 3 * t->length[v];
    PetscBLASInt size, info;

    for (PetscInt k = 0; k < n; k++)
      row[k] = 3 * t->node[t->start[v] + k / 3] + k % 3;
    PetscCall(PetscMalloc1((size_t)n * (size_t)n, &t->factor[v]));
    PetscCall(MatGetValues(A, n, row, n, row, t->factor[v]));
    PetscCall(PetscBLASIntCast(n, &size));
    LAPACKpotrf_("L", &size, t->factor[v], &size, &info);
    PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_MAT_LU_ZRPVT,
               "Star %" PetscInt_FMT " is not positive definite", v);
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApply_Stars(PC pc, Vec r, Vec z)
{
  const PetscBLASInt one = 1;
  const PetscScalar *x;
  PetscScalar *y;
  Stars *t;
  Vec sum;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &t));
  PetscCall(VecDuplicate(t->local, &sum));
  PetscCall(VecScatterBegin(t->scatter, r, t->local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(t->scatter, r, t->local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(t->local, &x));
  PetscCall(VecGetArray(sum, &y));
  for (PetscInt v = 0; v < t->n; v++) {
    const PetscInt *node = t->node + t->start[v];
    const PetscBLASInt n = (PetscBLASInt)(3 * t->length[v]);
    PetscBLASInt info;

    for (PetscInt k = 0; k < n; k++)
      t->work[k] = x[3 * node[k / 3] + k % 3];
    LAPACKpotrs_("L", &n, &one, t->factor[v], &n, t->work, &n, &info);
    for (PetscInt k = 0; k < n; k++)
      y[3 * node[k / 3] + k % 3] += t->work[k];
  }
  PetscCall(VecRestoreArray(sum, &y));
  PetscCall(VecRestoreArrayRead(t->local, &x));
  PetscCall(VecZeroEntries(z));
  PetscCall(VecScatterBegin(t->scatter, sum, z, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(t->scatter, sum, z, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecDestroy(&sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Stars(PC pc)
{
  Stars *t;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &t));
  for (PetscInt v = 0; v < t->n; v++)
    PetscCall(PetscFree(t->factor[v]));
  PetscCall(PetscFree(t->factor));
  PetscCall(PetscFree(t->work));
  PetscCall(PetscFree(t->start));
  PetscCall(PetscFree(t->node));
  PetscCall(PetscFree(t->length));
  PetscCall(VecScatterDestroy(&t->scatter));
  PetscCall(VecDestroy(&t->local));
  PetscCall(PetscFree(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCASM with as many blocks takes the matrix apart in hundreds of rounds of messages; here it is
   one. */
static PetscErrorCode set_stars(SbSpace s, Mat K, PC pc)
{
  Mat *around;
  Stars *t;
  Vec x;
  IS all;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&t));
  t->n = s->mesh->nvert_owned;
  PetscCall(list_stars(s, &t->start, &t->node));
  PetscCall(PetscMalloc1(t->n, &t->length));
  for (PetscInt v = 0; v < t->n; v++)
    t->length[v] = sort_unique(t->start[v + 1] - t->start[v], t->node + t->start[v]);
  PetscCall(number_stars(t, &all));
  PetscCall(MatCreateSubMatrices(K, 1, &all, &all, MAT_INITIAL_MATRIX, &around));
  PetscCall(factor_stars(t, around[0]));
  PetscCall(MatCreateVecs(around[0], &t->local, NULL));
  PetscCall(MatDestroySubMatrices(1, &around));
  PetscCall(MatCreateVecs(K, &x, NULL));
  PetscCall(VecScatterCreate(x, all, t->local, NULL, &t->scatter));
  PetscCall(VecDestroy(&x));
  PetscCall(ISDestroy(&all));
  PetscCall(PCShellSetContext(pc, t));
  PetscCall(PCShellSetApply(pc, PCApply_Stars));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_Stars));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From P1 to the nodes at faces; rows of prescribed unknowns are zero. */
static PetscErrorCode create_interpolation(SbSpace s, Mat *P)
{
  const SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(mesh->comm, 3 * s->nnode_owned, 3 * mesh->nvert_owned, PETSC_DETERMINE,
                         PETSC_DETERMINE, 3, NULL, 3, NULL, P));
  PetscCall(MatSetBlockSizes(*P, 3, 3));
  for (PetscInt slot = 0; slot < 4 * mesh->ncell; slot++) {
    const PetscInt i = s->cell_node[slot];
    const PetscInt *vertex = mesh->cell + slot - slot % 4;

    if (i >= s->nnode_owned)
      continue;
    for (PetscInt k = 0; k < 9; k++) {
      const PetscInt v = vertex[(slot + 1 + k / 3) % 4];
      const PetscInt c = k % 3;

      if (s->fixed[i] & (1 << c))
        continue;
      PetscCall(
        MatSetValue(*P, 3 * s->gnode[i] + c, 3 * mesh->gvert[v] + c, 1. / 3., INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* pc = sum over the stars + P (P^T K P)^-1 P^T. */
static PetscErrorCode set_star_preconditioner(SbSpace s, Mat K, PC pc)
{
  Mat P, coarse;
  KSP ksp;
  PC part;

  PetscFunctionBeginUser;
  PetscCall(PCSetType(pc, PCCOMPOSITE));
  PetscCall(PCCompositeSetType(pc, PC_COMPOSITE_ADDITIVE));
  PetscCall(PCCompositeAddPCType(pc, PCSHELL));
  PetscCall(PCCompositeAddPCType(pc, PCGALERKIN));
  PetscCall(PCCompositeGetPC(pc, 0, &part));
  PetscCall(set_stars(s, K, part));
  PetscCall(create_interpolation(s, &P));
  PetscCall(MatPtAP(K, P, MAT_INITIAL_MATRIX, 2., &coarse));
  PetscCall(MatSetOption(coarse, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(PCCompositeGetPC(pc, 1, &part));
  PetscCall(PCGalerkinSetInterpolation(part, P));
  PetscCall(PCGalerkinGetKSP(part, &ksp));
  PetscCall(KSPSetOperators(ksp, coarse, coarse));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &part));
  PetscCall(PCSetType(part, PCREDUNDANT));
  PetscCall(PCRedundantGetKSP(part, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &part));
  PetscCall(PCSetType(part, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(part, MATSOLVERCHOLMOD));
  PetscCall(MatDestroy(&P));
  PetscCall(MatDestroy(&coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the solve */

typedef struct {
  TestScene scene;
  PetscBool star, plain;
  Vec b, x; /* K x = b */
} Case;

/* Residual, tangent, preconditioner. */
static PetscErrorCode set_up(Case *c, KSP *ksp)
{
  SbRun run = c->scene.run;
  Vec U;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SbRunSetUp(run));
  PetscCall(SNESSetUp(run->solve.snes));
  PetscCall(SNESGetKSP(run->solve.snes, ksp));
  PetscCall(VecDuplicate(run->state.U, &U));
  PetscCall(VecDuplicate(run->state.U, &c->x));
  PetscCall(VecDuplicate(run->state.U, &c->b));
  c->scene.model->load = 1.;
  PetscCall(SbModelPrescribe(c->scene.model, 1., U));
  PetscCall(SNESComputeFunction(run->solve.snes, U, c->b));
  PetscCall(VecScale(c->b, -1.));
  PetscCall(SNESComputeJacobian(run->solve.snes, U, run->solve.J, run->solve.J));
  if (c->plain)
    PetscCall(MatSetNearNullSpace(run->solve.J, NULL));
  PetscCall(KSPSetOperators(*ksp, run->solve.J, run->solve.J));
  PetscCall(KSPGetPC(*ksp, &pc));
  if (c->star)
    PetscCall(set_star_preconditioner(c->scene.model->space, run->solve.J, pc));
  PetscCall(KSPSetUp(*ksp));
  PetscCall(KSPSetUpOnBlocks(*ksp));
  if (c->star)
    PetscCall(PCApply(pc, c->b, c->x)); /* PCCOMPOSITE sets its parts up when they are needed */
  PetscCall(VecZeroEntries(c->x));
  PetscCall(VecDestroy(&U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode report(Case *c, KSP ksp)
{
  KSPConvergedReason reason;
  PetscReal size, residual;
  PetscInt its;
  struct rusage use;
  double mb, most;
  char text[4096];
  PetscBool simple = PETSC_FALSE;
  Vec r;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(VecDuplicate(c->b, &r));
  PetscCall(MatMult(c->scene.run->solve.J, c->x, r));
  PetscCall(VecAYPX(r, -1., c->b));
  PetscCall(VecNorm(c->b, NORM_2, &size));
  PetscCall(VecNorm(r, NORM_2, &residual));
  PetscCall(VecDestroy(&r));
  (void)getrusage(RUSAGE_SELF, &use);
  mb = (double)use.ru_maxrss / 1024.;
  PetscCallMPI(MPI_Allreduce(&mb, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(perf_fact("tets", (double)c->scene.model->mesh->Ncell));
  PetscCall(perf_fact("unknowns", 3. * (double)c->scene.model->space->Nnode));
  PetscCall(perf_fact("iterations", (double)its));
  PetscCall(perf_fact("reason", (double)reason));
  PetscCall(perf_fact("residual", (double)(residual / size)));
  PetscCall(perf_fact("memory", most));
  if (!strcmp(c->scene.run->solve.solver, "cg_two_level")) {
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(test_pc_view(pc, sizeof(text), text));
    simple = (PetscBool)!strstr(text, "type: icc");
  }
  PetscCall(perf_fact("simpler", (double)simple));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ends the program after *ctx CPU seconds of some rank. */
static PetscErrorCode watch(KSP ksp, PetscInt it, PetscReal norm, void *ctx)
{
  double used = perf_seconds(CLOCK_PROCESS_CPUTIME_ID);
  double most;

  PetscFunctionBeginUser;
  (void)norm;
  if (it % 10)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(
    MPI_Allreduce(&used, &most, 1, MPI_DOUBLE, MPI_MAX, PetscObjectComm((PetscObject)ksp)));
  if (most > *(PetscReal *)ctx) {
    PetscCall(perf_fact("late", most));
    (void)fflush(stdout);
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCallMPI(MPI_Abort(PETSC_COMM_WORLD, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:6";
  char hold[256] = "plane:1,0,0,0";
  char element[64] = "cr";
  char with[1024] = "";
  char text[PERF_TEXT];
  PetscReal nu = 0.4999;
  PetscReal limit = 1e9;
  PerfClock start;
  Case c = {0};
  KSP ksp;

  PetscFunctionBeginUser;
#ifdef PR_SET_TIMERSLACK
  (void)prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL); /* ns: short naps are short */
#endif
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-hold", sizeof(hold), hold));
  PetscCall(perf_argument("-element", sizeof(element), element));
  PetscCall(perf_argument("-with", sizeof(with), with));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-nu", &nu, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-limit", &limit, NULL));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-star", &c.star));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-plain", &c.plain));
  PetscCall(
    PetscSNPrintf(text, sizeof(text),
                  "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material linear "
                  "-body_a_young 1e6 -body_a_poisson %.17g -body_a_density 1000 -sets held "
                  "-set_held_at %s -effects gravity,clamp -effect_gravity_vector 0,0,-9.81 "
                  "-effect_clamp_type fixed -effect_clamp_on held -time static -ksp_rtol 1e-8 %s",
                  mesh, element, (double)nu, hold, with));
  PetscCall(perf_read(text, &c.scene));
  PetscCall(SbModelSetUp(c.scene.model));
  start = perf_start();
  PetscCall(set_up(&c, &ksp));
  PetscCall(perf_fact("setup", perf_stop(start).cpu));
  start = perf_start();
  PetscCall(KSPMonitorSet(ksp, watch, &limit, NULL));
  PetscCall(KSPSolve(ksp, c.b, c.x));
  PetscCall(perf_fact("solve", perf_stop(start).cpu));
  PetscCall(report(&c, ksp));
  PetscCall(VecDestroy(&c.b));
  PetscCall(VecDestroy(&c.x));
  PetscCall(test_scene_close(&c.scene));
  PetscCall(PetscFinalize());
  return 0;
}
