/*
  Two-level preconditioners for CG: a smoother on the nodes, and a coarse correction (coarse.c).

  "two-level" and "two-level with contact" combine them as in balancing,

      P^-1 = Q + (1 - Q A) M (1 - A Q),   Q = Z E^-1 Z^T,   E = Z^T A Z

  with M the smoother, Z six rigid-body modes for each of some hundred or thousand aggregates of
  nodes. It is symmetric and positive definite when M and A are. Mandel (1993), Balancing domain
  decomposition; Tang, Nabben, Vuik, Erlangga (2009), Comparison of two-level preconditioners
  derived from deflation, domain decomposition and multigrid methods, J. Sci. Comput. 39.

  PCPreSolve corrects the initial guess so that Z^T r = 0. All residuals keep this property, the
  factor 1 - A Q is left out, and P is A-DEF2 there, with one product by A and one coarse solve per
  application. Each application tests this; a residual with a part in the span of Z gets the
  complete P^-1.

  While E is small compared with a rank's part of A, one rank factors it for all, and few aggregates
  are best. On many ranks that would be most of the work, and the incomplete factorisation, which is
  block diagonal by ranks, is weaker. Then E stays distributed, a multigrid cycle C approximates
  E^-1 (coarse_solver.c), and there are more aggregates, of NODES_PER_SPREAD nodes each. Q = Z C Z^T
  is no exact coarse solve, so that the complete form is used, with two coarse corrections:

      P^-1 = 2 Q - Q A Q + (1 - Q A) M (1 - A Q),

  symmetric, and positive definite if the eigenvalues of C E are below 2. Iterations, messages and
  memory: docs/reports/many_ranks.md.

  Smoother without contact: ICC(0) of the diagonal block of each rank, from the SBAIJ matrix of the
  fast product (product.h): for BAIJ PETSc would first convert. Where ICC(0) is not positive
  definite (at Poisson's ratio 0.45, not yet at 0.4; very flat tets), the diagonal: twice the
  iterations, each at half the cost. Bar of 192,000 tets, one rank, residual 1e-8, iterations and
  CPU s: at nu 0.3 ICC 39, 0.37 and diagonal 84, 0.48; at 0.45 diagonal 143, 0.70. PETSc's
  PCDEFLATION on the same aggregates takes AIJ only: 0.64 s on one rank, 0.83 on two (this: 0.37,
  0.54). On a bar sixty times as long as thick CG with PCDEFLATION stopped with an indefinite
  preconditioner after 41 iterations (cause unknown); this one converges in 49.

  Contact: A = K + C, the tangent of the bodies and the contact stiffness, which may be a million
  times larger. Z also contains the unknowns of the nodes in contact: one coarse space holds the
  stiff contact modes and the slow modes. A coarse space of only one kind takes five to twenty times
  the iterations. M is the Chebyshev iteration of degree DEGREE with the block diagonal D of A, on
  the nodes without contact, where A is K. There the eigenvalues of D^-1 A are at most four, the
  number of nodes of a cell (Wathen, "Realistic eigenvalue bounds for the Galerkin mass matrix",
  1987, whose argument holds for sums of any semi-definite matrices; for the face terms, c [P, -P;
  -P, P] with P = 1 - 1/3 (1, 1, 1) (1, 1, 1)^T for jumps and c [1, -1; -1, 1] for their mean, the
  bounds are three and two), so no eigenvalue is estimated, and M depends neither on the number of
  ranks nor on the contact stiffness.

  P2: aggregates are too coarse a space, and D^-1 A has eigenvalues above four near nu = 1/2.
  "p-multigrid" has P1 on the vertices as coarse level, edge nodes moving by the mean of their two
  vertices (coarse.h), and other bodies' nodes unchanged on it: a backward Gauss-Seidel sweep, the
  coarse correction, a forward sweep (gauss_seidel.c); between ranks block Jacobi. So does
  "two-level with contact" for P2 bodies of up to VERTICES vertices, with edge nodes in contact, or
  of vertices of other ranks, in Z themselves. A sweep takes half the time of a product with A; any
  initial guess is allowed. E of p-multigrid is factored by the fastest package up to FACTORED
  unknowns; beyond that one cycle of algebraic multigrid approximates E^-1. Symmetric, and positive
  definite when A is. The number of iterations does not depend on the mesh size. It grows towards nu
  = 1/2, where the sweeps do not reduce errors with a change of volume of cells
  (docs/reports/solvers.md). Ronquist and Patera (1987), Spectral element multigrid I, J. Sci.
  Comput. 2; Helenbrook, Mavriplis, Atkins (2003), Analysis of p-multigrid.
*/
#include "coarse.h"
#include "gauss_seidel.h"

#define NAME "two-level"
#define NU_ICC 0.4   /* largest Poisson's ratio for which the incomplete factorisation is tried */
#define IN_SPAN 1e-5 /* relative size of the residual in the span of Z that counts as rounding */

/* Number of aggregates when one rank factors E: a rank's nodes over this, within these bounds. */
#define NODES_PER_FACTORED 10
#define LEAST_FACTORED 50
#define MOST_FACTORED 1000
#define NODES_PER_SPREAD \
  16 /* nodes per aggregate; 12, 16, 24: 37, 37, 38 iterations (80,000 tets) */

/* With contact: */
#define NODES 60       /* nodes per aggregate */
#define NODES_FACES 15 /* the same for nodes at faces: two per tet, P1 has a fifth */
#define AGGREGATES \
  1500 /* largest number of aggregates, unless each has NODES nodes: one rank factors E */
#define LARGEST 4. /* upper bound of the eigenvalues of D^-1 A */
#define RANGE 8.   /* ratio of the largest to the smallest eigenvalue that the smoother reduces */
#define DEGREE 2   /* degree of the smoother's polynomial */
#define VERTICES 16000 /* largest number of P2 vertices in Z: larger systems were not measured */

#define FACTORED 200000 /* p-multigrid: largest number of unknowns of E that is factored */

typedef enum {
  INCOMPLETE,  /* two-level: incomplete Cholesky on each rank */
  DIAGONAL,    /* two-level: where that is not positive definite */
  CHEBYSHEV,   /* contact */
  GAUSS_SEIDEL /* p-multigrid; contact of P2 bodies */
} Smoother;

typedef struct {
  SbSpace space;
  SbCoarse coarse;
  Smoother smoother;
  PetscBool guess_given;

  /* two-level */
  PetscInt wanted;     /* number of aggregates, 0: by the number of nodes */
  PetscInt limit;      /* largest number of aggregates for one rank to factor, -1: by size */
  PC fine;             /* INCOMPLETE: of this rank; DIAGONAL: of all */
  Vec own_in, own_out; /* owned rows; they borrow their arrays */

  /* contact and p-multigrid */
  const SbContactRows *rows; /* NULL without contact */
  PetscObjectId pattern;     /* the matrix whose pattern E has, 0: none */
  PetscReal *inverse; /* [n][9] inverse diagonal blocks of A; CHEBYSHEV: zero at nodes in contact */
  PetscReal *extra;   /* GAUSS_SEIDEL: [n][3] diagonal added in the sweeps (gauss_seidel.h) */
  Vec p;              /* last step of Chebyshev's iteration */
} TwoLevel;

/* The incomplete Cholesky factorisation of this rank's diagonal block, or its replacement. */
static PetscErrorCode set_up_fine(TwoLevel *p, PC pc, Mat A, PetscBool *ok)
{
  const PetscBool diagonal = (PetscBool)(p->smoother == DIAGONAL);
  PCFailedReason reason;
  PetscBool symmetric;
  const char *prefix;

  PetscFunctionBeginUser;
  if (!p->fine) {
    PetscCall(PetscObjectTypeCompare((PetscObject)A, MATSEQSBAIJ, &symmetric));
    PetscCall(PCCreate(diagonal ? p->space->comm : PETSC_COMM_SELF, &p->fine));
    PetscCall(PCGetOptionsPrefix(pc, &prefix));
    PetscCall(PCSetOptionsPrefix(p->fine, prefix));
    PetscCall(PCAppendOptionsPrefix(p->fine, "fine_"));
    if (diagonal)
      PetscCall(PCSetType(p->fine, symmetric ? PCJACOBI : PCPBJACOBI));
    else /* PETSc 3.26 fails for an empty matrix */
      PetscCall(PCSetType(p->fine, p->space->nnode_owned ? PCICC : PCNONE));
    PetscCall(PCFactorSetShiftType(p->fine, MAT_SHIFT_POSITIVE_DEFINITE)); /* ICC's */
    PetscCall(PCSetFromOptions(p->fine));
  }
  if (!diagonal)
    PetscCall(SbProductGetSymmetric(A, &A));
  PetscCall(PCSetOperators(p->fine, A, A));
  PetscCall(PCSetReusePreconditioner(p->fine, PETSC_FALSE));
  PetscCall(PCSetUp(p->fine));

  /* else PETSc would renew it in an application after the values have changed, but not the coarse
     level */
  PetscCall(PCSetReusePreconditioner(p->fine, PETSC_TRUE));
  PetscCall(PCGetFailedReason(p->fine, &reason));
  *ok = (PetscBool)(reason == PC_NOERROR);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, p->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the incomplete factorisation by the diagonal from here on. */
static PetscErrorCode simplify(TwoLevel *p)
{
  PetscFunctionBeginUser;
  p->smoother = DIAGONAL;
  PetscCall(PCDestroy(&p->fine));
  PetscCall(SbWarning(
    p->space->comm,
    "the incomplete factorisation is not positive definite (very flat tets, or nu near 1/2): going "
    "on with the diagonal in its place, which is slower; -solver cg_gamg may be faster"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coarse space of aggregates with its solver, and the first choice of the smoother. */
static PetscErrorCode create_coarse(TwoLevel *p, Mat A)
{
  const SbSpace s = p->space;
  PetscInt wanted = p->wanted;
  PetscInt limit = p->limit;
  PetscInt nfree = 0;
  PetscInt total;
  PetscReal nu = 0.;
  PetscBool spread;

  PetscFunctionBeginUser;

  /* the number of aggregates of all ranks. 300 was best for 36,000 nodes (192,000 tets); the
     factor's cost grows faster than their number */
  if (!wanted)
    wanted = PetscMax(1, (PetscInt)(300. * PetscPowReal((PetscReal)s->Nnode / 36000., 0.7) + 0.5));
  if (limit < 0)
    limit =
      PetscMax(LEAST_FACTORED, PetscMin(MOST_FACTORED, s->Nnode / (s->size * NODES_PER_FACTORED)));
  spread = (PetscBool)(s->size > 1 && wanted > limit);
  if (spread && !p->wanted)
    wanted = s->Nnode / NODES_PER_SPREAD;

  /* this rank's share, by free nodes */
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    nfree += s->fixed[i] != 7;
  PetscCallMPI(MPI_Allreduce(&nfree, &total, 1, MPIU_INT, MPI_SUM, s->comm));
  wanted = (PetscInt)(0.5 + (PetscReal)wanted * (PetscReal)nfree / (PetscReal)PetscMax(1, total));
  PetscCall(SbCoarseCreate(s, wanted, PETSC_FALSE, &p->coarse));
  PetscCall(SbCoarseSetPattern(p->coarse, A, NULL));
  if (p->coarse->N)
    PetscCall(SbCoarseCreateSolver(p->coarse, (PetscBool)!spread));

  /* the smoother, and vectors for it */
  for (PetscInt r = 0; r < s->nregion; r++)
    nu = PetscMax(nu, SbMaterialPoisson(s->region[r].material));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nu, 1, MPIU_REAL, MPI_MAX, s->comm));
  p->smoother = nu > NU_ICC ? DIAGONAL : INCOMPLETE;
  PetscCall(VecCreateLocalVector(p->coarse->s, &p->own_in));
  PetscCall(VecCreateLocalVector(p->coarse->s, &p->own_out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_TwoLevel(PC pc)
{
  PetscBool ok;
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  if (!p->coarse)
    PetscCall(create_coarse(p, A));
  PetscCall(set_up_fine(p, pc, A, &ok));
  if (!ok && p->smoother == INCOMPLETE && !p->space->tentative) {
    PetscCall(simplify(p));
    PetscCall(set_up_fine(p, pc, A, &ok));
  }
  PetscCall(SbCoarseSetUp(p->coarse, A));
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " aggregates, %s%s\n", p->coarse->N / 2,
                      p->coarse->spread ? "spread over the ranks" : "factored by one of them",
                      p->coarse->ok ? "" : ": the coarse operator is not positive definite"));
  PetscCall(PCSetFailedReason(pc, ok && p->coarse->ok ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With contact, and p-multigrid: both have the inverse diagonal blocks of A. */
static PetscErrorCode PCSetUp_Blocks(PC pc)
{
  PetscBool ok, sweeps;
  PetscObjectId id;
  TwoLevel *p;
  SbCoarse c;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  c = p->coarse;
  sweeps = (PetscBool)(p->smoother == GAUSS_SEIDEL);
  if (!p->pattern) {
    PetscCall(PetscMalloc2(9 * (size_t)p->space->nnode_owned, &p->inverse,
                           sweeps ? 3 * p->space->nnode_owned : 0, &p->extra));
    PetscCall(MatCreateVecs(A, &p->p, NULL));
  }

  /* another matrix of contact has another pattern */
  if (!p->pattern || (p->rows && id != p->pattern))
    PetscCall(SbCoarseSetPattern(c, A, p->rows));
  if (!p->rows && !p->pattern) {
    char type[SB_NAME_MAX] = "";

    PetscCall(PetscOptionsGetString(NULL, "pc_coarse_", "-pc_type", type, sizeof(type), NULL));
    PetscCall(SbCoarseCreateSolver(c, (PetscBool)(3 * c->N <= FACTORED && strcmp(type, PCGAMG))));
  }
  p->pattern = id;
  PetscCall(SbGaussSeidelSetUp(A, p->inverse, sweeps ? p->extra : NULL, &ok));

  /* Chebyshev: positive definite where it smooths */
  if (!sweeps)
    ok = PETSC_TRUE;
  for (PetscInt i = 0; i < p->space->nnode_owned && !sweeps; i++) {
    PetscReal *B = p->inverse + 9 * (size_t)i;

    if (c->way[i] == SB_ITSELF)
      PetscCall(PetscArrayzero(B, 9));
    else if (!(B[0] > 0. && B[0] * B[4] > B[1] * B[3]))
      ok = PETSC_FALSE;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &ok, 1, SB_MPI_BOOL, MPI_LAND, p->space->comm));
  if (ok || p->rows)
    PetscCall(SbCoarseSetUp(c, A)); /* the cost of the coarse space needs it */
  c->ok = (PetscBool)(ok && c->ok);
  PetscCall(PCSetFailedReason(pc, c->ok ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One Chebyshev step: p = factor p + other D^-1 (r - t), z = z + p; t NULL: first step, z = 0. */
static PetscErrorCode advance(TwoLevel *p, PetscReal factor, PetscReal other, Vec R, Vec T, Vec Z)
{
  const PetscScalar *r;
  const PetscScalar *t = NULL;
  PetscScalar *q, *z;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(R, &r));
  if (T)
    PetscCall(VecGetArrayRead(T, &t));
  PetscCall(VecGetArray(p->p, &q));
  PetscCall(VecGetArray(Z, &z));
  for (PetscInt i = 0; i < p->space->nnode_owned; i++) {
    const PetscReal *B = p->inverse + 9 * i;
    PetscReal f[3];

    for (int k = 0; k < 3; k++)
      f[k] = t ? r[3 * i + k] - t[3 * i + k] : r[3 * i + k];
    for (int k = 0; k < 3; k++) {
      const PetscReal step = B[3 * k] * f[0] + B[3 * k + 1] * f[1] + B[3 * k + 2] * f[2];

      q[3 * i + k] = t ? factor * q[3 * i + k] + other * step : other * step;
      z[3 * i + k] = t ? z[3 * i + k] + q[3 * i + k] : q[3 * i + k];
    }
  }
  PetscCall(VecRestoreArray(Z, &z));
  PetscCall(VecRestoreArray(p->p, &q));
  if (T)
    PetscCall(VecRestoreArrayRead(T, &t));
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = M r: the fine level, or Chebyshev (Saad, Iterative Methods ..., 2003, algorithm 12.1). */
static PetscErrorCode smooth(TwoLevel *p, Mat A, Vec r, Vec z)
{
  const PetscReal middle = 0.5 * LARGEST * (1. + 1. / RANGE);
  const PetscReal half = 0.5 * LARGEST * (1. - 1. / RANGE);
  PetscReal rho = half / middle;

  PetscFunctionBeginUser;
  if (p->smoother == DIAGONAL) {
    PetscCall(PCApply(p->fine, r, z));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (p->smoother == INCOMPLETE) {
    PetscCall(VecGetLocalVectorRead(r, p->own_in));
    PetscCall(VecGetLocalVector(z, p->own_out));
    PetscCall(PCApply(p->fine, p->own_in, p->own_out));
    PetscCall(VecRestoreLocalVector(z, p->own_out));
    PetscCall(VecRestoreLocalVectorRead(r, p->own_in));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(advance(p, 0., 1. / middle, r, NULL, z));
  for (int k = 1; k < DEGREE; k++) {
    const PetscReal next = 1. / (2. * middle / half - rho);

    PetscCall(MatMult(A, z, p->coarse->t));
    PetscCall(advance(p, next * rho, 2. * next / half, r, p->coarse->t, z));
    rho = next;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApply_TwoLevel(PC pc, Vec r, Vec z)
{
  PetscReal share = 1.;
  PetscBool in_span;
  TwoLevel *p;
  SbCoarse c;
  Vec s = r;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  c = p->coarse;

  /* a sweep down, the coarse correction, a sweep up */
  if (p->smoother == GAUSS_SEIDEL) {
    PetscCall(SbGaussSeidelDown(A, p->inverse, p->extra, r, z, c->t));
    PetscCall(SbCoarseRestrict(c, c->t, NULL));
    PetscCall(SbCoarseAdd(c, z));
    PetscCall(SbGaussSeidelUp(A, p->inverse, p->extra, r, z, c->t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* z = Q r, s = r - A z, unless r has no part in the span of Z */
  PetscCall(SbCoarseRestrict(c, r, c->spread ? NULL : &share));
  in_span = (PetscBool)(share > IN_SPAN);
  if (in_span) {
    s = c->s;
    PetscCall(VecZeroEntries(z));
    PetscCall(SbCoarseAdd(c, z));
    PetscCall(MatMult(A, z, s));
    PetscCall(VecAYPX(s, -1., r));
  }

  /* w = M s + Q (s - A M s) */
  PetscCall(smooth(p, A, s, c->w));
  PetscCall(SbCoarseCorrect(c, A, s, c->w));
  if (in_span)
    PetscCall(VecAXPY(z, 1., c->w));
  else
    PetscCall(VecCopy(c->w, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corrects the initial guess, so that its residual has no part in the span of Z. */
static PetscErrorCode PCPreSolve_TwoLevel(PC pc, KSP ksp, Vec b, Vec x)
{
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, &A, NULL));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &p->guess_given));
  if (!p->coarse->ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (p->guess_given)
    PetscCall(SbCoarseCorrect(p->coarse, A, b, x));
  else {
    PetscCall(VecZeroEntries(x));
    PetscCall(SbCoarseRestrict(p->coarse, b, NULL));
    PetscCall(SbCoarseAdd(p->coarse, x));
  }
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With contact: no net force on a body remains, so that momentum is as exact as with a
   factorisation. */
static PetscErrorCode PCPostSolve_TwoLevel(PC pc, KSP ksp, Vec b, Vec x)
{
  KSPConvergedReason reason;
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, &A, NULL));
  PetscCall(KSPSetInitialGuessNonzero(ksp, p->guess_given));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (p->rows && reason > 0)
    PetscCall(SbCoarseCorrect(p->coarse, A, b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_TwoLevel(PC pc, PetscViewer viewer)
{
  PetscInt count[2] = {0, 0};
  PetscInt most;
  PetscViewer own;
  TwoLevel *p;
  SbCoarse c;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  c = p->coarse;
  if (c && !c->aggregated) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  Gauss-Seidel on P2; P1 on the vertices by:\n"));
    if (c->solver)
      PetscCall(PCView(c->solver, viewer));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (p->smoother == GAUSS_SEIDEL)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "  Gauss-Seidel, and the vertices of P2 bodies in the place of their aggregates\n"));
  count[0] = most = c ? c->nagg : 0;
  for (PetscInt i = 0; p->rows && i < p->rows->n; i++)
    count[1] += p->rows->contact[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, p->space->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_INT, MPI_MAX, p->space->comm));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "  %" PetscInt_FMT " aggregates with six rigid-body modes each", count[0]));
  if (p->rows)
    PetscCall(
      PetscViewerASCIIPrintf(viewer, ", and %" PetscInt_FMT " nodes of contact\n", count[1]));
  else if (c && c->spread)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, ", spread over the ranks, at most %" PetscInt_FMT " on one; fine level:\n", most));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, ", factored by one of the ranks; fine level:\n"));
  if (p->fine && p->smoother == DIAGONAL)
    PetscCall(PCView(p->fine, viewer));
  if (p->fine && p->smoother == INCOMPLETE) {
    PetscCall(PetscViewerGetSubViewer(viewer, PETSC_COMM_SELF, &own));
    if (!p->space->rank)
      PetscCall(PCView(p->fine, own));
    PetscCall(PetscViewerRestoreSubViewer(viewer, PETSC_COMM_SELF, &own));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_TwoLevel(PC pc)
{
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(SbCoarseDestroy(&p->coarse));
  PetscCall(PCDestroy(&p->fine));
  PetscCall(VecDestroy(&p->own_in));
  PetscCall(VecDestroy(&p->own_out));
  PetscCall(VecDestroy(&p->p));
  PetscCall(PetscFree2(p->inverse, p->extra));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create(SbSpace s, PC pc, const char *name, PetscErrorCode (*setup)(PC),
                             TwoLevel **p)
{
  PetscFunctionBeginUser;
  PetscCall(PetscNew(p));
  (*p)->space = s;
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, *p));
  PetscCall(PCShellSetName(pc, name));
  PetscCall(PCShellSetSetUp(pc, setup));
  PetscCall(PCShellSetApply(pc, PCApply_TwoLevel));
  PetscCall(PCShellSetView(pc, PCView_TwoLevel));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_TwoLevel));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCTwoLevelCreate(SbSpace s, PC pc)
{
  const char *prefix;
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCall(create(s, pc, NAME, PCSetUp_TwoLevel, &p));
  PetscCall(PCShellSetPreSolve(pc, PCPreSolve_TwoLevel));
  PetscCall(PCShellSetPostSolve(pc, PCPostSolve_TwoLevel));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  p->limit = -1;
  PetscCall(PetscOptionsGetInt(NULL, prefix, "-pc_coarse_aggregates", &p->wanted, NULL));
  PetscCall(PetscOptionsGetInt(NULL, prefix, "-pc_coarse_gathered", &p->limit, NULL));
  PetscCheck(p->wanted >= 0, s->comm, PETSC_ERR_USER,
             "-pc_coarse_aggregates %" PetscInt_FMT
             " is negative: give a number of aggregates, or 0 to choose by size",
             p->wanted);
  PetscCheck(p->limit >= -1, s->comm, PETSC_ERR_USER,
             "-pc_coarse_gathered %" PetscInt_FMT
             " is below -1: give the largest number of aggregates that "
             "one rank factors, 0 for none, or -1 to choose by size",
             p->limit);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCPMultigridCreate(SbSpace s, PC pc)
{
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCheck(
    s->edge_node, s->comm, PETSC_ERR_USER,
    "-solver cg_p_multigrid is for runs with a body of -body_<name>_element p2: choose auto, or "
    "cg_two_level");
  PetscCall(create(s, pc, "p-multigrid", PCSetUp_Blocks, &p));
  p->smoother = GAUSS_SEIDEL;
  PetscCall(SbCoarseCreate(s, -1, PETSC_TRUE, &p->coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCContactCreate(SbSpace s, const SbContactRows *rows, PC pc, SbBlockSolver *coarse)
{
  PetscInt nodes = NODES;
  PetscInt nvertex = 0;
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCall(create(s, pc, "two-level with contact", PCSetUp_Blocks, &p));
  PetscCall(PCShellSetPreSolve(pc, PCPreSolve_TwoLevel));
  PetscCall(PCShellSetPostSolve(pc, PCPostSolve_TwoLevel));
  p->rows = rows;
  if (s->plan->face_term[0])
    nodes = PetscClipInterval(s->Nnode / AGGREGATES, NODES_FACES, NODES);
  PetscCall(SbCoarseCreate(s, (s->nnode_owned + nodes - 1) / nodes, PETSC_TRUE, &p->coarse));
  PetscCall(SbBlockSolverCreate(s->comm, coarse));
  p->coarse->direct = *coarse;

  /* P2: the vertices are the coarse space while there are few */
  for (PetscInt i = 0; p->coarse->parent && i < s->nnode_owned; i++)
    nvertex += p->coarse->parent[2 * i] == i && s->element[s->node_body[i]]->nodes_per[1];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nvertex, 1, MPIU_INT, MPI_SUM, s->comm));
  if (nvertex > VERTICES)
    PetscCall(PetscFree(p->coarse->parent));
  p->smoother = p->coarse->parent ? GAUSS_SEIDEL : CHEBYSHEV;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCTwoLevelSimplify(PC pc, KSPConvergedReason reason, PetscBool *changed)
{
  PetscBool ok;
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  *changed = PETSC_FALSE;
  PetscCall(SbPCShellFind(pc, NAME, &p));
  if (!p || p->smoother == DIAGONAL || !p->coarse || !p->coarse->ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (reason != KSP_DIVERGED_INDEFINITE_PC && reason != KSP_DIVERGED_PC_FAILED &&
      reason != KSP_DIVERGED_NANORINF)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(simplify(p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(set_up_fine(p, pc, A, &ok));
  *changed = ok;
  PetscFunctionReturn(PETSC_SUCCESS);
}
