/*
  Solver for the coarse operator, which is distributed by rows like its aggregates.

  A few hundred aggregates: one rank gathers and factors E for all (pc_direct.c). Many: a V-cycle of PETSc's algebraic multigrid
  approximates E^-1, so that a rank's work for it is bounded by its own aggregates.

  E is a matrix of blocks of six whose near null space is known exactly: on an aggregate with centre x_a and radius r,
  a rigid-body mode t + w x (x - x_b) has the six coefficients t + w x (x_a - x_b) and r w. Smoothed aggregation coarsens further (Vanek, Mandel, Brezina 1996,
  Algebraic multigrid by smoothed aggregation); it agglomerates small levels on fewer ranks; one rank factors the coarsest one. The smoother
  is Chebyshev with 6x6 diagonal blocks, independent of the number of ranks. The cycle is symmetric and
  positive definite.
*/
#include "coarse.h"
#include "solver_impl.h"

/*
  Unknowns of the coarsest level, which one rank factors, and least unknowns per rank on finer levels. Bar of 332,000 tets on 64 ranks: 35 iterations
  with 114 messages of a rank each; with PETSc's defaults 50 and 50: 43 and 290. Coarsening by the square of the graph, PETSc's default on the
  first level, takes 50 iterations instead of 38 on 16 ranks.
*/
#define LAST_LEVEL 600
#define PER_RANK 300

/* Fills v with rigid-body mode m of a body, by the modes of its aggregates. */
static PetscErrorCode fill_mode(PetscInt m, PetscScalar v[], const void *ctx)
{
  const struct _p_SbCoarse *c = ctx;
  const SbSpace s = c->space;

  PetscFunctionBeginUser;
  for (PetscInt a = 0; a < c->n; a++) {
    const PetscReal *box = s->mesh->body[s->node_body[c->member[c->member_start[a]]]].bbox,
                    *x = c->centre + 4 * a, r = x[3];

    SbRigidMode(m, x, box, v + 6 * a);
    for (PetscInt q = 0; q < 3; q++) v[6 * a + 3 + q] = 0.;
    if (m >= 3) v[6 * a + m] = r / SbRigidSize(box);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseCreateSolver(SbCoarse c)
{
  PetscInt *own, *foreign;
  const char *package;

  PetscFunctionBeginUser;
  // entries of each row in columns of this rank and of others
  PetscCall(PetscCalloc2(6 * c->n, &own, 6 * c->n, &foreign));
  for (PetscInt a = 0; a < c->n; a++) {
    for (PetscInt k = c->start[a]; k < c->start[a + 1]; k++) {
      const PetscBool here = (PetscBool)(c->column[k] >= c->first && c->column[k] < c->first + c->n);

      for (PetscInt row = 6 * a; row < 6 * a + 6; row++) (here ? own : foreign)[row] += 6;
    }
  }
  // the matrix E, of 6x6 blocks
  PetscCall(MatCreate(c->space->comm, &c->E));
  PetscCall(MatSetSizes(c->E, 6 * c->n, 6 * c->n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(c->E, 6));
  PetscCall(MatSetType(c->E, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(c->E, 0, own));
  PetscCall(MatMPIAIJSetPreallocation(c->E, 0, own, 0, foreign));
  PetscCall(PetscFree2(own, foreign));
  PetscCall(MatSetOption(c->E, MAT_SPD, PETSC_TRUE));
  PetscCall(MatCreateVecs(c->E, &c->c, &c->y));
  // its solver: a factorisation if one rank factors E, else algebraic multigrid with rigid-body modes
  PetscCall(PCCreate(c->space->comm, &c->solver));
  PetscCall(PCSetOptionsPrefix(c->solver, "pc_coarse_"));
  PetscCall(SbDirectPackage(c->space->comm, 6 * c->N, PETSC_TRUE, &package));
  if (!package) c->spread = PETSC_TRUE;
  if (!c->spread)
    PetscCall(SbPCDirectSet(c->solver, package, PETSC_TRUE));
  else {
    PetscCall(SbAttachModes(c->E, fill_mode, c));
    PetscCall(PCSetType(c->solver, PCGAMG));
    PetscCall(PCGAMGSetReuseInterpolation(c->solver, PETSC_TRUE));
    PetscCall(PCGAMGSetCoarseEqLim(c->solver, LAST_LEVEL));
    PetscCall(PCGAMGSetProcEqLim(c->solver, PER_RANK));
    PetscCall(SbSolverSetDefault("pc_coarse_", "pc_gamg_aggressive_coarsening", "0"));
    PetscCall(SbSolverSetDefault("pc_coarse_", "mg_levels_pc_type", "pbjacobi"));
  }
  PetscCall(PCSetFromOptions(c->solver));
  PetscCall(SbPCCheckPivots(c->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseSetUpSolver(SbCoarse c)
{
  PCFailedReason reason;
  PetscInt negative;
  PetscReal least = PETSC_MAX_REAL;

  PetscFunctionBeginUser;
  for (PetscInt a = 0; a < c->n; a++) {
    const PetscInt row = c->first + a;

    for (PetscInt k = c->start[a]; k < c->start[a + 1]; k++) {
      const PetscReal *block = c->value + 36 * k;

      PetscCall(MatSetValuesBlocked(c->E, 1, &row, 1, c->column + k, block, INSERT_VALUES));
      /* also false for NaN */
      for (PetscInt e = 0; e < 36; e++) {
        if (k == c->start[a] && e % 7 == 0 && !(block[e] >= least)) least = block[e];
        if (PetscIsInfOrNanReal(block[e])) least = -1.;
      }
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_REAL, MPI_MIN, c->space->comm));
  c->ok = (PetscBool)(least > 0.);
  PetscCall(MatAssemblyBegin(c->E, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->E, MAT_FINAL_ASSEMBLY));
  if (!c->ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCSetOperators(c->solver, c->E, c->E));
  PetscCall(PCSetUp(c->solver));
  PetscCall(PCGetFailedReason(c->solver, &reason));
  PetscCall(SbPCDirectCountNegative(c->solver, &negative));
  c->ok = (PetscBool)(reason == PC_NOERROR && negative <= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
