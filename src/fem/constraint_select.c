/*
  Which exact constraints are worth having. A node in the corner of two obstacles that sticks to both has its place said twice, which makes
  G D G^T as good as singular. So a constraint that is, but for a small part, a combination of earlier ones nearby is redundant.

  Constraints of all ranks are examined in the order of their identities, so that no partition changes the choice. A constraint is compared with
  those accepted before it that share a node with it: a few, whose Gram matrix is factored for it. (Rank-revealing Cholesky
  factorisation, kept local.)
*/
#include "fem_impl.h"
#include "sbconstraint.h"

#define SAID \
  1e-4 /* squared part of a constraint outside the span of its neighbours; below it the constraint is redundant */
#define NEARLY 0.05 /* below it the projection is repeated once more: normals within 13 degrees */
#define NEAR 48     /* neighbours that are examined */

/* Constraints of all ranks, alike on each. */
typedef struct {
  PetscInt n;
  PetscInt *id, *start, *node; /* [n], [n+1], [start[n]] nodes as 0..nnode-1 */
  PetscReal *coef;             /* [start[n]][3] of free directions */
  PetscInt first;              /* of this rank */
  PetscInt nnode;
  PetscInt *head, *next,
    *row; /* accepted constraints by node: entry e of a row is e, next[e] the following one at its node */
} All;

/*
  Takes from the constraints what prescribed and constrained directions would say: along a symmetry plane a constraint of friction may be left with a
  sliver of the direction that the normal's constraint has whole. sorted: global numbers of the nodes.
*/
static PetscErrorCode project_constrained(SbSpace s, const PetscInt sorted[], All *a)
{
  const PetscBool constrained = SbNodalConstraintsExist(s);
  PetscReal *free;
  PetscMPIInt n;

  PetscFunctionBeginUser;
  PetscCall(PetscMPIIntCast(9 * a->nnode, &n));
  PetscCall(
    PetscCalloc1(n, &free)); /* [nnode][3][3] by its owner: columns of I - Q that are not prescribed */
  for (PetscInt i = 0; i < a->nnode; i++) {
    const PetscInt node = sorted[i] - s->gnode_start;
    const PetscReal *Q =
      constrained && node >= 0 && node < s->nnode_owned ? SbNodalConstraintsProjector(s, node) : NULL;

    for (PetscInt k = 0; k < 9 && node >= 0 && node < s->nnode_owned; k++) {
      if (!(s->fixed[node] & (1 << (k % 3)))) free[9 * i + k] = (k % 4 ? 0. : 1.) - (Q ? Q[k] : 0.);
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, free, n, MPIU_REAL, MPI_SUM, s->comm));
  for (PetscInt e = 0; e < a->start[a->n]; e++) {
    const PetscReal *P = free + 9 * (size_t)a->node[e], *row = a->coef + 3 * (size_t)e;
    PetscReal left[3];

    for (int k = 0; k < 3; k++) left[k] = row[0] * P[k] + row[1] * P[3 + k] + row[2] * P[6 + k];
    PetscCall(PetscArraycpy(a->coef + 3 * (size_t)e, left, 3));
  }
  PetscCall(PetscFree(free));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode gather_constraints(SbSpace s, All *a)
{
  SbConstraints c = s->constraints;
  PetscInt n = 0, nentry = 0, total, *id, *length, *node, *sorted, *lengths;
  PetscReal *coef;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(c->n, &id, c->n, &length, c->nentry, &node, 3 * c->nentry, &coef));
  for (PetscInt i = 0; i < c->n; i++) {
    if (c->stiffness[i] >= 0.) continue;
    id[n] = c->id[i];
    length[n++] = c->start[i + 1] - c->start[i];
    for (PetscInt e = c->start[i]; e < c->start[i + 1]; e++, nentry++) {
      node[nentry] = c->gnode[e];
      for (int k = 0; k < 3; k++) coef[3 * nentry + k] = c->coef[3 * e + k];
    }
  }
  PetscCall(SbGatherAll(s->comm, MPIU_INT, n, id, &a->n, &a->id, &a->first));
  PetscCall(SbGatherAll(s->comm, MPIU_INT, n, length, &total, &lengths, NULL));
  PetscCall(SbGatherAll(s->comm, MPIU_INT, nentry, node, &total, &a->node, NULL));
  PetscCall(SbGatherAll(s->comm, MPIU_REAL, 3 * nentry, coef, &nentry, &a->coef, NULL));
  PetscCall(PetscFree4(id, length, node, coef));
  PetscCall(PetscMalloc1(a->n + 1, &a->start));
  a->start[0] = 0;
  for (PetscInt i = 0; i < a->n; i++) a->start[i + 1] = a->start[i] + lengths[i];
  PetscCall(PetscFree(lengths));
  /* nodes by consecutive numbers */
  PetscCall(PetscMalloc1(total, &sorted));
  PetscCall(PetscArraycpy(sorted, a->node, total));
  a->nnode = total;
  PetscCall(PetscSortRemoveDupsInt(&a->nnode, sorted));
  for (PetscInt e = 0; e < total; e++) PetscCall(PetscFindInt(a->node[e], a->nnode, sorted, &a->node[e]));
  PetscCall(project_constrained(s, sorted, a));
  PetscCall(PetscFree(sorted));
  PetscCall(PetscMalloc3(a->nnode, &a->head, total, &a->next, total, &a->row));
  for (PetscInt i = 0; i < a->nnode; i++) a->head[i] = -1;
  for (PetscInt i = 0; i < a->n; i++) {
    for (PetscInt e = a->start[i]; e < a->start[i + 1]; e++) a->row[e] = i;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal product(const All *a, PetscInt i, PetscInt j)
{
  PetscReal sum = 0.;

  for (PetscInt e = a->start[i]; e < a->start[i + 1]; e++) {
    for (PetscInt f = a->start[j]; f < a->start[j + 1]; f++) {
      if (a->node[e] != a->node[f]) continue;
      for (int k = 0; k < 3; k++) sum += a->coef[3 * e + k] * a->coef[3 * f + k];
    }
  }
  return sum;
}

/* Accepted constraints that share a node with constraint i. */
static PetscInt neighbours(const All *a, PetscInt i, PetscInt near[NEAR])
{
  PetscInt n = 0;

  for (PetscInt e = a->start[i]; e < a->start[i + 1]; e++) {
    for (PetscInt f = a->head[a->node[e]]; f >= 0 && n < NEAR; f = a->next[f]) {
      PetscInt k = 0;

      while (k < n && near[k] != a->row[f]) k++;
      if (k == n) near[n++] = a->row[f];
    }
  }
  return n;
}

/* Squared part of constraint i outside the span of its accepted neighbours, relative; by the Cholesky factor of their Gram matrix. */
static PetscReal outside(const All *a, PetscInt i)
{
  const PetscReal full = product(a, i, i);
  PetscInt near[NEAR], n = neighbours(a, i, near);
  PetscReal L[NEAR][NEAR], y[NEAR], rest = full;

  for (PetscInt j = 0; j < n && full > 0.; j++) {
    y[j] = product(a, i, near[j]);
    for (PetscInt k = 0; k <= j; k++) {
      L[j][k] = product(a, near[j], near[k]);
      for (PetscInt m = 0; m < k; m++) L[j][k] -= L[j][m] * L[k][m];
      L[j][k] = k < j ? L[j][k] / L[k][k] : PetscSqrtReal(PetscMax(L[j][j], 1e-12 * full));
      if (k < j) y[j] -= L[j][k] * y[k];
    }
    y[j] /= L[j][j];
    rest -= y[j] * y[j];
  }
  return full > 0. ? rest / full : 0.;
}

/* Constraints of the same identity are of one point, so of one rank: there in the order in which they were written. */
static void sort_equals(const All *a, PetscInt order[])
{
  for (PetscInt q = 1; q < a->n; q++) {
    for (PetscInt k = q; k > 0 && a->id[order[k]] == a->id[order[k - 1]] && order[k] < order[k - 1]; k--) {
      const PetscInt swap = order[k];

      order[k] = order[k - 1];
      order[k - 1] = swap;
    }
  }
}

PetscErrorCode SbConstraintsFindRedundant(SbSpace s)
{
  SbConstraints c = s->constraints;
  PetscInt *order, mine = 0;
  PetscBool *rests;
  All a;

  PetscFunctionBeginUser;
  PetscCall(gather_constraints(s, &a));
  c->passes = 2;
  PetscCall(PetscMalloc2(a.n, &order, a.n, &rests));
  for (PetscInt i = 0; i < a.n; i++) order[i] = i;
  PetscCall(PetscSortIntWithPermutation(a.n, a.id, order));
  sort_equals(&a, order);
  for (PetscInt q = 0; q < a.n; q++) {
    const PetscInt i = order[q];
    const PetscReal part = outside(&a, i);

    rests[i] = (PetscBool)(part < SAID);
    if (!rests[i] && part < NEARLY) c->passes = 4;
    for (PetscInt e = a.start[i]; !rests[i] && e < a.start[i + 1]; e++) {
      a.next[e] = a.head[a.node[e]];
      a.head[a.node[e]] = e;
    }
  }
  for (PetscInt i = 0; i < c->n; i++)
    c->redundant[i] = c->stiffness[i] < 0. ? rests[a.first + mine++] : PETSC_FALSE;
  PetscCall(PetscFree2(order, rests));
  PetscCall(PetscFree3(a.head, a.next, a.row));
  PetscCall(PetscFree(a.id));
  PetscCall(PetscFree(a.start));
  PetscCall(PetscFree(a.node));
  PetscCall(PetscFree(a.coef));
  PetscFunctionReturn(PETSC_SUCCESS);
}
