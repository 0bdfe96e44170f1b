/*
  The coarse space of the two-level preconditioner: modes of the aggregates, their distribution over ranks, restriction and
  prolongation.

  Modes that vanish, as the rotations of an aggregate of one node, are the eigenvectors of the Gram matrix sum Z_i^T Z_i
  with eigenvalues near zero. Only they can make E = Z^T A Z singular (coarse_operator.c).
*/
#include "coarse.h"
#include <petscblaslapack.h>

#define SB_VANISHING 1e-8 /* squared size of a mode, over the largest of its aggregate, that counts as zero */

/* ------------------------------------------------------------------ set-up, once */

/* Positions relative to the aggregate's centre, over its radius. */
static void find_positions(SbCoarse c)
{
  SbSpace s = c->space;

  for (PetscInt a = 0; a < c->n; a++) {
    const PetscInt n = c->member_start[a + 1] - c->member_start[a], *node = c->member + c->member_start[a];
    PetscReal x0[3] = {0., 0., 0.}, r2 = 0.;

    for (PetscInt k = 0; k < 3 * n; k++) x0[k % 3] += s->node_x[3 * node[k / 3] + k % 3] / (PetscReal)n;
    for (PetscInt k = 0; k < 3 * n; k++) {
      const PetscReal d = s->node_x[3 * node[k / 3] + k % 3] - x0[k % 3];

      c->d[3 * node[k / 3] + k % 3] = d;
      r2 += d * d / (PetscReal)n;
    }
    for (PetscInt k = 0; k < 3 * n && n > 1; k++) c->d[3 * node[k / 3] + k % 3] /= PetscSqrtReal(r2);
    for (PetscInt q = 0; q < 3; q++) c->centre[4 * a + q] = x0[q];
    c->centre[4 * a + 3] = n > 1 ? PetscSqrtReal(r2) : 0.;
  }
}

/* Projector onto the vanishing modes of one aggregate: eigenvectors of the Gram matrix. */
static PetscErrorCode find_vanishing(SbCoarse c, PetscInt a, PetscReal projector[36])
{
  SbSpace s = c->space;
  PetscReal gram[36] = {0.}, eigen[6], work[64];
  PetscBLASInt n = 6, nwork = 64, info;

  PetscFunctionBeginUser;
  for (PetscInt k = c->member_start[a]; k < c->member_start[a + 1]; k++) {
    const PetscInt i = c->member[k];

    for (int m = 0; m < 6; m++) {
      PetscReal unit[6] = {0.}, u[3];

      unit[m] = 1.;
      SbCoarseMotion(c->d + 3 * i, unit, u);
      for (int q = 0; q < 3; q++) u[q] = s->fixed[i] & (1 << q) ? 0. : u[q];
      SbCoarseAddMoments(c->d + 3 * i, u, gram + 6 * m);
    }
  }
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &n, gram, &n, eigen, work, &nwork, &info));
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev failed with %d", (int)info);
  PetscCall(PetscArrayzero(projector, 36));
  for (int v = 0; v < 6 && eigen[v] <= SB_VANISHING * eigen[5]; v++) {
    for (int e = 0; e < 36; e++) projector[e] += gram[6 * v + e / 6] * gram[6 * v + e % 6];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adjacency of aggregates: the aggregate itself, then those of the neighbours of its nodes. */
static PetscErrorCode find_pattern(SbCoarse c)
{
  SbPlan p = c->space->plan;
  PetscInt lowest = c->N, highest = c->first + c->n, *mark, nz = 0;

  PetscFunctionBeginUser;
  /* marks for the range of aggregates that this rank knows */
  for (PetscInt i = 0; i < c->space->nnode; i++) {
    if (c->agg[i] >= 0) lowest = PetscMin(lowest, c->agg[i]);
    highest = PetscMax(highest, c->agg[i] + 1);
  }
  PetscCall(PetscMalloc1(PetscMax(0, highest - lowest), &mark));
  PetscCall(PetscMalloc1(c->n + 1, &c->start));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt b = lowest; b < highest; b++) mark[b - lowest] = -1;
    nz = 0;
    for (PetscInt a = 0; a < c->n; a++) {
      c->start[a] = nz;
      mark[c->first + a - lowest] = a;
      if (pass) c->column[nz] = c->first + a;
      nz++;
      for (PetscInt k = c->member_start[a]; k < c->member_start[a + 1]; k++) {
        const PetscInt i = c->member[k], nd = p->di[i + 1] - p->di[i], no = p->oi[i + 1] - p->oi[i];

        for (PetscInt e = 0; e < nd + no; e++) {
          const PetscInt b = c->agg[e < nd ? p->dj[p->di[i] + e] : p->oj[p->oi[i] + e - nd]];

          if (b < 0 || mark[b - lowest] == a) continue;
          mark[b - lowest] = a;
          if (pass) c->column[nz] = b;
          nz++;
        }
      }
      if (pass) PetscCall(PetscSortInt(nz - c->start[a] - 1, c->column + c->start[a] + 1));
    }
    if (!pass) PetscCall(PetscMalloc1(nz, &c->column));
  }
  c->start[c->n] = nz;
  PetscCall(PetscCalloc1(36 * nz, &c->value));
  PetscCall(PetscFree(mark));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseCreate(SbSpace s, PetscInt wanted, PetscBool spread, SbCoarse *coarse)
{
  PetscInt nfree = 0, total;
  PetscReal *number;
  SbCoarse c;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&c));
  c->space = s;
  c->spread = spread;
  PetscCall(PetscMalloc1(s->nnode, &c->agg));
  PetscCall(PetscCalloc1(3 * s->nnode, &c->d));
  for (PetscInt i = 0; i < s->nnode_owned; i++) nfree += s->fixed[i] != 7;
  PetscCallMPI(MPI_Allreduce(&nfree, &total, 1, MPIU_INT, MPI_SUM, s->comm));
  wanted = (PetscInt)(0.5 + (PetscReal)wanted * (PetscReal)nfree / (PetscReal)PetscMax(1, total));
  PetscCall(SbAggregate(s, wanted, &c->n, c->agg));
  PetscCallMPI(MPI_Allreduce(&c->n, &c->N, 1, MPIU_INT, MPI_SUM, s->comm));
  PetscCallMPI(MPI_Scan(&c->n, &c->first, 1, MPIU_INT, MPI_SUM, s->comm));
  c->first -= c->n;
  /* own nodes by aggregate: agg is still numbered from 0 on this rank */
  PetscCall(SbBucketByKey(s->nnode_owned, c->agg, c->n, &c->member_start, &c->member));
  PetscCall(PetscMalloc1(4 * c->n, &c->centre));
  find_positions(c);
  PetscCall(PetscMalloc1(36 * c->n, &c->null));
  for (PetscInt a = 0; a < c->n; a++) PetscCall(find_vanishing(c, a, c->null + 36 * a));

  /* aggregates and positions of the nodes on every rank that has them */
  PetscCall(PetscCalloc1(3 * s->nnode, &number));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    number[3 * i] = c->agg[i] < 0 ? -1. : (PetscReal)(c->first + c->agg[i]);
  PetscCall(SbSpaceUpdateGhosts(s, number));
  PetscCall(SbSpaceUpdateGhosts(s, c->d));
  for (PetscInt i = 0; i < s->nnode; i++) c->agg[i] = (PetscInt)number[3 * i];
  PetscCall(PetscFree(number));
  PetscCall(find_pattern(c));
  if (c->N) PetscCall(SbCoarseCreateSolver(c));
  *coarse = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseDestroy(SbCoarse *coarse)
{
  SbCoarse c = *coarse;

  PetscFunctionBeginUser;
  if (!c) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCDestroy(&c->solver));
  PetscCall(MatDestroy(&c->E));
  PetscCall(VecDestroy(&c->c));
  PetscCall(VecDestroy(&c->y));
  PetscCall(PetscFree(c->value));
  PetscCall(PetscFree(c->column));
  PetscCall(PetscFree(c->start));
  PetscCall(PetscFree(c->member_start));
  PetscCall(PetscFree(c->member));
  PetscCall(PetscFree(c->null));
  PetscCall(PetscFree(c->centre));
  PetscCall(PetscFree(c->d));
  PetscCall(PetscFree(c->agg));
  PetscCall(PetscFree(*coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ application */

PetscErrorCode SbCoarseRestrict(SbCoarse c, Vec R, PetscReal *share)
{
  SbSpace s = c->space;
  PetscReal norm2[2] = {0., 0.}; /* squared norm of c, weighted; of r on the aggregates */
  const PetscScalar *r;
  PetscScalar *m;

  PetscFunctionBeginUser;
  *share = c->N ? 1. : 0.;
  if (!c->N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecZeroEntries(c->c));
  PetscCall(VecGetArray(c->c, &m));
  PetscCall(VecGetArrayRead(R, &r));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal f[3];

    if (c->agg[i] < 0) continue;
    for (int q = 0; q < 3; q++) {
      f[q] = s->fixed[i] & (1 << q) ? 0. : r[3 * i + q];
      norm2[1] += f[q] * f[q];
    }
    SbCoarseAddMoments(c->d + 3 * i, f, m + 6 * (c->agg[i] - c->first));
  }
  for (PetscInt a = 0; a < c->n; a++) {
    for (int q = 0; q < 6; q++)
      norm2[0] += PetscSqr(m[6 * a + q]) / (PetscReal)(c->member_start[a + 1] - c->member_start[a]);
  }
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscCall(VecRestoreArray(c->c, &m));
  if (c->spread) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, norm2, 2, MPIU_REAL, MPI_SUM, s->comm));
  *share = norm2[1] > 0. ? PetscSqrtReal(norm2[0] / norm2[1]) : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseAdd(SbCoarse c, Vec Z)
{
  SbSpace s = c->space;
  const PetscScalar *y;
  PetscScalar *z;

  PetscFunctionBeginUser;
  if (!c->N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCApply(c->solver, c->c, c->y));
  PetscCall(VecGetArrayRead(c->y, &y));
  PetscCall(VecGetArray(Z, &z));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal u[3];

    if (c->agg[i] < 0) continue;
    SbCoarseMotion(c->d + 3 * i, y + 6 * (c->agg[i] - c->first), u);
    for (int q = 0; q < 3; q++) z[3 * i + q] += s->fixed[i] & (1 << q) ? 0. : u[q];
  }
  PetscCall(VecRestoreArray(Z, &z));
  PetscCall(VecRestoreArrayRead(c->y, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}
