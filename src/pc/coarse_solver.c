/*
  Solver for the coarse operator E, which is distributed by rows like its units.

  While E is small, one rank gathers and factors it for all (SbPCDirectSet(); SbBlockSolver where
  its pattern changes often). Otherwise a V-cycle of PETSc's algebraic multigrid approximates E^-1,
  so that a rank's work for it is bounded by its own units.

  The near null space of E is known exactly: a rigid-body mode t + w x (x - x_b) is itself at a
  node; on an aggregate with centre x_a and radius r it has the six coefficients t + w x (x_a - x_b)
  and r w. Smoothed aggregation coarsens further (Vanek, Mandel, Brezina 1996, Algebraic multigrid
  by smoothed aggregation); it agglomerates small levels on fewer ranks; one rank factors the
  coarsest one. On aggregates the smoother is Chebyshev with 6x6 diagonal blocks, independent of the
  number of ranks. The cycle is symmetric and positive definite.
*/
#include "coarse.h"

/* Unknowns of the coarsest level, which one rank factors, and least unknowns per rank on finer
   levels. Bar of 332,000 tets on 64 ranks, aggregates: 35 iterations with 114 messages of a rank
   each; with PETSc's defaults 50 and 50: 43 and 290. Bar of CR, nu 0.49, 53,000 tets on 64 ranks:
   333 messages of a rank per iteration; with PETSc's 556. */
#define LAST_LEVEL 600
#define PER_RANK 300

PetscErrorCode SbPCMultigridSet(PC pc, PetscReal threshold)
{
  PetscFunctionBeginUser;
  PetscCall(PCSetType(pc, PCGAMG));
  PetscCall(PCGAMGSetReuseInterpolation(pc, PETSC_TRUE));
  PetscCall(PCGAMGSetThreshold(pc, &threshold, 1));
  PetscCall(PCGAMGSetCoarseEqLim(pc, LAST_LEVEL));
  PetscCall(PCGAMGSetProcEqLim(pc, PER_RANK));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCMultigridAvoid(SbSpace s, PC pc)
{
  PetscBool gamg, all;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCGAMG, &gamg));
  if (!gamg)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceAllPrescribed(s, &all));
  if (all)
    PetscCall(PCSetType(pc, PCJACOBI));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills v with rigid-body mode m of the bodies; zero at prescribed unknowns of nodes. */
static PetscErrorCode fill_mode(PetscInt m, PetscScalar v[], const void *ctx)
{
  const struct _p_SbCoarse *c = ctx;
  const SbSpace s = c->space;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal *box = s->mesh->body[s->node_body[i]].bbox;
    PetscScalar *at;

    if (c->unit[2 * i] < 0 || c->way[i] == SB_MEAN)
      continue;
    at = v + 3 * c->unit[2 * i];
    if (c->way[i] == SB_ITSELF) {
      SbRigidMode(m, s->node_x + 3 * i, box, at);
      for (PetscInt q = 0; q < 3; q++)
        at[q] = s->fixed[i] & (1 << q) ? 0. : at[q];
    } else {
      SbRigidMode(m, c->centre + 4 * c->agg[i], box, at);
      for (PetscInt q = 3; q < 6; q++)
        at[q] = q == m ? c->centre[4 * c->agg[i] + 3] / SbRigidSize(box) : 0.;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseCreateSolver(SbCoarse c, PetscBool factored)
{
  PetscInt *own, *foreign;
  const char *package;

  PetscFunctionBeginUser;

  // entries of each row in columns of this rank and of others
  PetscCall(PetscCalloc2(3 * c->n, &own, 3 * c->n, &foreign));
  for (PetscInt row = 0; row < 3 * c->n; row++)
    for (PetscInt k = c->ia[row / 3]; k < c->ia[row / 3 + 1]; k++)
      (c->ja[k] >= c->first && c->ja[k] < c->first + c->n ? own : foreign)[row] += 3;

  // the matrix E, of 6x6 blocks for aggregates
  PetscCall(MatCreate(c->space->comm, &c->E));
  PetscCall(MatSetSizes(c->E, 3 * c->n, 3 * c->n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(c->E, c->aggregated ? 6 : 3));
  PetscCall(MatSetType(c->E, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(c->E, 0, own));
  PetscCall(MatMPIAIJSetPreallocation(c->E, 0, own, 0, foreign));
  PetscCall(PetscFree2(own, foreign));
  PetscCall(MatSetOption(c->E, MAT_SPD, PETSC_TRUE));

  // its solver: a factorisation if one rank factors E, else algebraic multigrid with rigid-body
  // modes
  PetscCall(PCCreate(c->space->comm, &c->solver));
  PetscCall(PCSetOptionsPrefix(c->solver, "pc_coarse_"));
  PetscCall(SbDirectPackage(c->space->comm, 3 * c->N, PETSC_TRUE, &package));
  c->spread = (PetscBool)(!factored || !package);
  if (!c->spread)
    PetscCall(SbPCDirectSet(c->solver, package, PETSC_TRUE));
  else {
    PetscCall(SbAttachModes(c->E, fill_mode, c));
    PetscCall(SbPCMultigridSet(c->solver, c->aggregated ? -1. : 0.));

    /* PETSc's first coarsening, by the square of the graph: 50 iterations instead of 38 on 16
       ranks */
    if (c->aggregated)
      PetscCall(SbOptionsSetDefaults(
        "pc_coarse_", "-pc_gamg_aggressive_coarsening 0 -mg_levels_pc_type pbjacobi", PETSC_FALSE));
  }
  PetscCall(PCSetFromOptions(c->solver));
  PetscCall(SbPCCheckPivots(c->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseSetUpSolver(SbCoarse c)
{
  PCFailedReason reason;
  PetscInt negative;

  PetscFunctionBeginUser;
  if (c->direct) {
    PetscCall(SbBlockSolverSetUp(c->direct, c->n, c->ia, c->ja, c->value, c->changed, &c->ok));
    c->changed = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* the blocks into E; not ok: a diagonal not positive, unless parts are on other ranks; not a
     number */
  for (PetscInt u = 0; u < c->n; u++) {
    for (PetscInt k = c->ia[u]; k < c->ia[u + 1]; k++) {
      const PetscInt i = 3 * (c->first + u);
      const PetscInt j = 3 * c->ja[k];
      const PetscReal *block = c->value + 9 * (size_t)k;

      PetscCall(MatSetValues(c->E, 3, (const PetscInt[]){i, i + 1, i + 2}, 3,
                             (const PetscInt[]){j, j + 1, j + 2}, block, ADD_VALUES));
      for (int e = 0; e < 9 && !c->wide; e++)
        if (PetscIsInfOrNanReal(block[e]) || (i == j && e % 4 == 0 && block[e] <= 0.))
          c->ok = PETSC_FALSE;
    }
  }
  PetscCall(MatAssemblyBegin(c->E, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->E, MAT_FINAL_ASSEMBLY));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &c->ok, 1, SB_MPI_BOOL, MPI_LAND, c->space->comm));
  if (!c->ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCSetOperators(c->solver, c->E, c->E));
  PetscCall(PCSetUp(c->solver));
  c->ready = PETSC_TRUE;
  PetscCall(PCGetFailedReason(c->solver, &reason));
  PetscCall(SbPCDirectCountNegative(c->solver, &negative));
  c->ok = (PetscBool)(reason == PC_NOERROR && negative <= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
