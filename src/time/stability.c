/*
  Stability of static equilibria: the number of negative eigenvalues of the tangent.

  Newton's method finds saddle points of the energy as well as minima: a straight column above
  Euler's load is in equilibrium, and so is a state between a limit point of displacement and the
  next one. Such a state is never found in nature, as the smallest disturbance leads away from it.
  So each load step that was solved is examined once, before it is reported: K is the exact tangent
  there, not filtered or shifted, in the space that supports and active constraints of contact
  leave, with springs, barriers and pressures. The pressures of P2, CR and DG are condensed in K;
  as that part is positive, K has the inertia of the whole.

  Negative eigenvalues are counted by Lanczos' method (src/solver/negative_modes.c) with the last
  preconditioner or factor of Newton's method, if it is known to be positive definite; else it is
  made anew, from the tangent whose cells are positive semi-definite. So a stable state costs one
  assembly and a few solves. Barriers count with the positive semi-definite part of each pair: over
  a vertex or an edge of the other mesh a pair pushes sideways, a ridge as narrow as the gap, which
  is the mesh's and not the bodies' (patch test of two blocks: -1e-4 of the diagonal).

  Not symmetric. Of a pressure with a free rim K is the symmetric part of the tangent. If it is
  positive definite, no motion gains energy, and the state is stable; else nothing follows, and
  nothing is reported. Linear runs are not examined: their tangent is
  that of the rest state.
*/
#include "sbfactor.h"
#include "time_impl.h"

#define MOST 6 /* largest number of negative eigenvalues that is counted */
#define FACTORED \
  60000 /* unknowns up to which a matrix is factored for this alone, where the solver has none */

/* The tangent at an equilibrium; all Mats are symmetric. */
typedef struct {
  SbRun run;
  Mat K;                  /* exact; borrowed from run->stability */
  Mat whole;              /* K, or K with barriers; borrowed */
  PC pc;                  /* preconditioner; borrowed */
  SbContactSystem last;   /* whose preconditioner is taken; borrowed; NULL: pc */
  SbContactSystem sum;    /* K with barriers, for `whole`; owned; NULL without */
  SbContactSystem factor; /* the same, positive definite, factored; owned; NULL: none */
  SbBlocks blocks;
} Tangent;

static PetscErrorCode multiply(void *ctx, Vec x, Vec y)
{
  const Tangent *t = (Tangent *)ctx;
  const SbRun run = t->run;
  const SbConstraints beside = SbConstraintsSeparate(run->model->space);

  PetscFunctionBeginUser;
  if (beside) {
    const Mat whole = beside->whole;

    beside->whole = t->K;
    PetscCall(MatMult(run->solve.system, x, y));
    beside->whole = whole;
  } else
    PetscCall(MatMult(t->whole, x, y));
  PetscCall(SbSpaceProjectAdmissible(run->model->space, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(void *ctx, Vec r, Vec z)
{
  const Tangent *t = (Tangent *)ctx;

  PetscFunctionBeginUser;
  if (t->last)
    PetscCall(SbContactSystemPrecondition(t->last, r, z));
  else
    PetscCall(PCApply(t->pc, r, z));
  PetscCall(SbSpaceProjectAdmissible(t->run->model->space, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All laws take the tangent `kind`, or (`saved`) get theirs back. */
static PetscErrorCode set_tangents(SbModel m, SbTangentKind kind, const SbTangentKind saved[])
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->nmaterial; k++)
    if (!m->material[k]->linear)
      PetscCall(SbMaterialSetTangent(m->material[k], saved ? saved[k] : kind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The k-th right-hand side, the same on any number of ranks: noise by the rest positions of the
   nodes. */
static PetscErrorCode make_noise(void *ctx, PetscInt k, Vec start)
{
  const SbSpace s = ((Tangent *)ctx)->run->model->space;
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayWrite(start, &x));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    uint64_t state = 0x9e3779b97f4a7c15U * (uint64_t)(k + 1);

    for (int c = 0; c < 3; c++) {
      float at = (float)s->node_x[3 * i + c] + 0.f; /* no negative zero */
      uint32_t bits;

      PetscCall(PetscMemcpy(&bits, &at, sizeof(bits)));
      state = (state ^ bits) * 0xbf58476d1ce4e5b9U;
      state ^= state >> 29;
    }
    for (int c = 0; c < 3; c++) {
      state = state * 0x94d049bb133111ebU + 0x9e3779b97f4a7c15U;
      x[3 * i + c] = (PetscReal)(state >> 40) / 16777216. - 0.5;
    }
  }
  PetscCall(VecRestoreArrayWrite(start, &x));
  PetscCall(SbSpaceProjectAdmissible(s, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the preconditioner of the last solve is certainly positive definite. */
static PetscErrorCode is_definite(SbRun run, PetscBool *is)
{
  const SbSolverPreset *used = run->solve.solver_used;
  PetscInt negative;

  PetscFunctionBeginUser;
  PetscCall(SbSolverCountNegativeEigenvalues(run->solve.snes, run->model->space, &negative));
  *is = (PetscBool)(negative == 0 ||
                    (!SbConstraintsFactored(run->model->space) &&
                     (used->precondition || (used->direct && !strcmp(used->package, "cholmod")))));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J: the tangent whose cells are positive semi-definite. */
static PetscErrorCode assemble_definite(SbRun run)
{
  const SbModel m = run->model;

  PetscFunctionBeginUser;
  PetscCall(set_tangents(m, SB_TANGENT_EXACT_SPD, NULL));
  PetscCall(
    SbFormStaticJacobian(run->solve.snes, run->state.U, run->solve.system, run->solve.J, run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sum with barriers, each pair's part positive semi-definite. */
static PetscErrorCode add_barriers(Tangent *t, Vec work)
{
  const SbModel m = t->run->model;

  PetscFunctionBeginUser;
  t->blocks.n = 0;
  PetscCall(VecZeroEntries(work));
  PetscCall(
    SbContactSetHessian(&m->contacts, t->run->state.U, SB_HESSIAN_PROJECTED, &t->blocks, work));
  PetscCall(SbContactSystemCreate(m->space, 2, &t->sum));
  PetscCall(SbContactSystemGetMatrix(t->sum, t->K, &t->blocks, &t->whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The positive definite sum with barriers, factored. */
static PetscErrorCode factor_barriers(Tangent *t, Vec work)
{
  const SbRun run = t->run;
  const SbModel m = run->model;
  KSPConvergedReason reason;
  PetscInt its;
  Vec z;

  PetscFunctionBeginUser;
  PetscCall(assemble_definite(run));
  t->blocks.n = 0;
  PetscCall(VecDuplicate(work, &z));
  PetscCall(VecZeroEntries(z));
  PetscCall(SbContactSetHessian(&m->contacts, run->state.U, SB_HESSIAN_PROJECTED, &t->blocks, z));
  PetscCall(SbContactSystemCreate(m->space, 1, &t->factor));
  PetscCall(
    SbContactSystemSolve(t->factor, run->solve.J, &t->blocks, PETSC_TRUE, work, z, &reason, &its));
  if (reason < 0)
    PetscCall(SbContactSystemDestroy(&t->factor));
  t->last = t->factor;
  PetscCall(VecDestroy(&z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A factorisation of its own, where the solver's preconditioner does not do. */
static PetscErrorCode factor_apart(Tangent *t, Mat *P)
{
  const SbSpace s = t->run->model->space;
  const char *package;

  PetscFunctionBeginUser;
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, PETSC_TRUE, &package));
  if (!package)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_AIJ, P));
  PetscCall(set_tangents(t->run->model, SB_TANGENT_EXACT_SPD, NULL));
  PetscCall(
    SbModelTangent(t->run->model, t->run->model->load, 0., 0., 1., t->run->state.U, NULL, *P));
  PetscCall(PCCreate(s->comm, &t->pc));
  PetscCall(PCSetOptionsPrefix(t->pc, "stability_"));
  PetscCall(PCSetOperators(t->pc, *P, *P));
  PetscCall(SbPCDirectSet(t->pc, package, PETSC_TRUE));
  PetscCall(PCSetFromOptions(t->pc));
  PetscCall(SbPCCheckPivots(t->pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inertia of the tangent at the equilibrium run->state.U, with `most` negative eigenvalues at
   most. */
static PetscErrorCode examine(SbRun run, PetscInt most, Vec mode, SbInertia *found)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  const PetscBool shell = (PetscBool)(run->solve.solver_used->create != NULL);
  Tangent t = {.run = run};
  const SbPencil pencil = {multiply, solve, make_noise, &t};
  SbTangentKind *kinds;
  PetscBool definite = PETSC_FALSE;
  Vec work, scale;
  Mat P = NULL;
  KSP ksp;

  PetscFunctionBeginUser;
  *found = (SbInertia){0};
  PetscCall(SbSpaceCreateVec(s, &work));
  PetscCall(SbSpaceCreateVec(s, &scale));
  PetscCall(PetscMalloc1(m->nmaterial, &kinds));
  for (PetscInt k = 0; k < m->nmaterial; k++)
    kinds[k] = m->material[k]->tangent;

  /* the exact tangent */
  if (!run->stability.K)
    PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &run->stability.K));
  t.K = t.whole = run->stability.K;
  PetscCall(set_tangents(m, SB_TANGENT_EXACT, NULL));
  PetscCall(SbModelTangent(m, m->load, 0., 0., 1., run->state.U, NULL, t.K));

  if (m->contacts.npotential)
    PetscCall(add_barriers(&t, scale));
  PetscCall(MatGetDiagonal(t.whole, scale));
  PetscCall(VecAbs(scale));

  /* a positive definite one: of the last solve, or made for the purpose */
  PetscCall(SNESGetKSP(run->solve.snes, &ksp));
  PetscCall(KSPGetPC(ksp, &t.pc));
  t.last = SbPotentialContactSystem(run->solve.potential);
  if (shell)
    t.pc = NULL;
  else if (!t.last) {
    PetscCall(is_definite(run, &definite));
    if (!definite)
      PetscCall(assemble_definite(run));
  }
  if (t.pc || t.last)
    PetscCall(SbNegativeModes(&pencil, scale, most, mode, found));

  /* it may have been of another state, or not definite after all */
  if (!found->known && !found->definite && !t.last && !shell) {
    PetscCall(assemble_definite(run));
    PetscCall(SbNegativeModes(&pencil, scale, most, mode, found));
  }

  /* or too far from the tangent */
  if (!found->known && 3 * s->Nnode <= FACTORED) {
    if (m->contacts.npotential)
      PetscCall(factor_barriers(&t, work));
    else if (!SbConstraintsSeparate(s))
      PetscCall(factor_apart(&t, &P));
    if (t.factor || P)
      PetscCall(SbNegativeModes(&pencil, scale, most, mode, found));
  }
  PetscCall(PetscInfo(run->solve.snes,
                      "stability: %" PetscInt_FMT " negative eigenvalues (%s), %" PetscInt_FMT
                      " solves\n",
                      found->negative, found->known ? "known" : "unknown", found->solves));
  PetscCall(set_tangents(m, SB_TANGENT_EXACT, kinds));
  PetscCall(PetscFree(kinds));
  if (P)
    PetscCall(PCDestroy(&t.pc));
  PetscCall(MatDestroy(&P));
  PetscCall(SbContactSystemDestroy(&t.sum));
  PetscCall(SbContactSystemDestroy(&t.factor));
  PetscCall(PetscFree(t.blocks.block));
  PetscCall(VecDestroy(&scale));
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all ranks: the node with the largest displacement in the mode, its body and rest position,
   m. */
static PetscErrorCode find_place(SbRun run, Vec mode, PetscInt *body, PetscReal place[3],
                                 PetscReal way[3])
{
  const SbSpace s = run->model->space;
  struct {
    double size;
    int rank;
  } most = {-1., 0};
  double found[7] = {0.};
  PetscMPIInt rank;
  const PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(s->comm, &rank));
  most.rank = rank;
  PetscCall(VecGetArrayRead(mode, &x));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal size = PetscSqrtReal(SbDot3(x + 3 * i, x + 3 * i));

    if (size <= most.size)
      continue;
    most.size = size;
    found[6] = (double)s->node_body[i];
    for (int c = 0; c < 3; c++) {
      found[c] = s->node_x[3 * i + c];
      found[3 + c] = x[3 * i + c] / size;
    }
  }
  PetscCall(VecRestoreArrayRead(mode, &x));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE_INT, MPI_MAXLOC, s->comm));
  PetscCallMPI(MPI_Bcast(found, 7, MPI_DOUBLE, most.rank, s->comm));
  for (int c = 0; c < 3; c++) {
    place[c] = found[c];
    way[c] = found[3 + c];
  }
  *body = (PetscInt)found[6];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "the equilibrium ... is unstable ...", in run->stability.text. */
static PetscErrorCode describe(SbRun run, PetscReal factor, const SbInertia *found, Vec mode)
{
  PetscReal x[3], n[3];
  PetscInt body;

  PetscFunctionBeginUser;
  PetscCall(find_place(run, mode, &body, x, n));
  SbFormat(sizeof(run->stability.text), run->stability.text,
           "load factor %.6g: the equilibrium is unstable, the tangent has %s%" PetscInt_FMT
           " negative eigenvalue%s: the least disturbance moves the body %s away from it, most of "
           "all around (%.4g, %.4g, %.4g) m along (%.2f, %.2f, %.2f)",
           (double)factor, found->more ? "at least " : "", found->negative,
           found->negative == 1 ? "" : "s", run->model->body[body].name, (double)x[0], (double)x[1],
           (double)x[2], (double)n[0], (double)n[1], (double)n[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunCheckStable(SbRun run, PetscReal factor, PetscBool last, PetscBool may_cut,
                                PetscBool *again, PetscBool *stop)
{
  SbRunStability *st = &run->stability;
  SbInertia found;
  Vec mode;

  PetscFunctionBeginUser;
  *stop = *again = PETSC_FALSE;
  if (st->action == SB_UNSTABLE_IGNORE || run->model->linear || run->model->contacts.nexact ||
      !run->counters.newton_step)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_STABILITY], 0, 0, 0, 0));
  PetscCall(VecDuplicate(run->state.U, &mode));
  PetscCall(examine(run, st->warned && !last ? 1 : MOST, mode, &found));
  run->solve.tangent_known = PETSC_FALSE;

  /* forces without a potential: the symmetric part decides only where it is definite */
  if (run->solve.nonsymmetric.U && found.negative)
    found = (SbInertia){0};
  *again = (PetscBool)(may_cut && found.negative && !st->warned);
  if (*again) {
    PetscCall(VecDestroy(&mode));
    PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_STABILITY], 0, 0, 0, 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  st->nknown += found.known;
  st->nunknown += !found.known;
  if (found.negative) {
    st->nunstable++;
    PetscCall(describe(run, factor, &found, mode));
    *stop = (PetscBool)(st->action == SB_UNSTABLE_ERROR);
    if (!*stop && (!st->warned || (last && st->since < factor)))
      PetscCall(SbWarning(run->model->comm,
                          "%s%s. A small imperfection of the shape or the load, a lateral force "
                          "or a dynamic run with damping lead to a stable one "
                          "(docs/guides/when_it_fails.md; -static_unstable warn|error|ignore)",
                          st->text, st->warned ? ", as since an earlier load step" : ""));
    if (!st->warned)
      st->since = factor;
    st->warned = PETSC_TRUE;
  } else if (st->warned && found.known && st->since >= 0.) {
    PetscCall(SbWarning(run->model->comm, "load factor %.6g: the equilibrium is stable again",
                        (double)factor));
    st->warned = PETSC_FALSE;
  }
  PetscCall(VecDestroy(&mode));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_STABILITY], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
