/*
  Constraints of single nodes, for contact with rigid obstacles: n . u = c exactly, or by a spring
  (penalty).

  A node has up to three exact constraints, the rows of G, with the values c, and constraint forces
  along the rows of F: F = G unless the node slides with friction mu, with a row n - mu d, d along
  the slip. Node by node, with

    Q = F^T (G F^T)^-1 G,   P = I - Q

  lambda = (G F^T)^-1 G r are the multipliers for a residual r, P r is the projected residual, G P x
  = 0, and u + F^T (G F^T)^-1 (c - G u) satisfies the constraints. Prescribed components are removed
  from G and F. The solution is projected onto the constraints before a solve, which then stays in
  their null space. Redundant ones are removed.

  Linear solves treat them in one of two ways.

  Projected into the matrix, where F = G (Baraff and Witkin 1998), with s the size of the diagonal
  block:

    A_ij <- P_i A_ij P_j,   A_ii += s_i Q_i

  Outside the matrix K, with springs F^T k G and where F is not G (Gould, Hribar, Nocedal 2001, On
  the solution of equality constrained quadratic programming problems arising in optimization): A =
  P (K + F^T k G) P, M_A^-1 = P M^-1 P. Any preconditioner M of K can be used, and neither K nor M
  changes with the active set. (src/solver/constraint_operator.c; by a factorisation:
  saddle_factor.c.)
*/
#include "fem_impl.h"
#include "sbkernel.h"

#define SAID \
  1e-6 /* squared distance from the span of the node's others below which one is redundant */
#define NO_SAY 1e-12 /* squared length of the free part of a direction that counts as zero */

PetscErrorCode SbSpaceCreateConstraints(SbSpace s, PetscBool beside, PetscBool nonsymmetric)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (!c) {
    PetscCall(PetscNew(&c));
    PetscCall(PetscCalloc2(s->nnode_owned, &c->first, 9 * s->nnode, &c->Q));
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      c->first[i] = -1;
    s->constraints = c;
  }
  c->beside = (PetscBool)(c->beside || beside || nonsymmetric);
  c->nonsymmetric = (PetscBool)(c->nonsymmetric || nonsymmetric);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsDestroy(SbConstraints *constraints)
{
  SbConstraints c = *constraints;

  PetscFunctionBeginUser;
  if (!c)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCDestroy(&c->factored));
  PetscCall(PetscFree(c->constraint));
  PetscCall(PetscFree2(c->first, c->Q));
  PetscCall(PetscFree(c->added));
  PetscCall(PetscFree(*constraints));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpaceClearConstraints(SbSpace s)
{
  SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->constraint[i].node;

    c->first[node] = -1;
    memset(c->Q + 9 * node, 0, 9 * sizeof(*c->Q));
  }
  c->n = 0;
}

/* v without prescribed components. */
static void free_part(SbSpace s, PetscInt node, const PetscReal v[3], PetscReal part[3])
{
  for (int k = 0; k < 3; k++)
    part[k] = s->fixed[node] & (1 << k) ? 0. : v[k];
}

/* The exact constraints of a node: numbers and free parts of their directions. Returns 0..3. */
static int exact_constraints(SbSpace s, PetscInt node, PetscInt number[3], PetscReal G[9],
                             PetscReal F[9])
{
  const SbConstraints c = s->constraints;
  int n = 0;

  for (PetscInt i = c->first[node]; i >= 0; i = c->constraint[i].next) {
    if (c->constraint[i].spring)
      continue;
    number[n] = i;
    free_part(s, node, c->constraint[i].n, G + 3 * n);
    if (F)
      free_part(s, node, c->constraint[i].push, F + 3 * n);
    n++;
  }
  return n;
}

/* x = (G F^T)^-1 b of the n exact constraints of a node. */
static void solve_forces(int n, const PetscReal G[9], const PetscReal F[9], const PetscReal b[3],
                         PetscReal x[3])
{
  PetscReal A[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  PetscReal C[9], det;

  for (int k = 0; k < n; k++)
    for (int l = 0; l < n; l++)
      A[3 * k + l] = SbDot3(G + 3 * k, F + 3 * l);
  SbMatCofactor(A, C);
  det = SbDot3(A, C);
  for (int k = 0; k < n; k++) {
    x[k] = 0.;
    for (int l = 0; l < n; l++)
      x[k] += C[3 * l + k] * b[l] / det;
  }
}

PetscErrorCode SbSpaceAddConstraint(SbSpace s, const SbConstraint *constraint, PetscInt *number)
{
  const PetscInt node = constraint->node;
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  *number = -1;
  if (!constraint->spring) {
    PetscInt others[3];
    PetscReal G[9], g[3];
    PetscReal b[3] = {0};
    PetscReal x[3], full;
    const int n = exact_constraints(s, node, others, G, NULL);

    /* its component orthogonal to the node's other constraints */
    free_part(s, node, constraint->n, g);
    full = SbDot3(g, g);
    if (n == 3 || full < NO_SAY)
      PetscFunctionReturn(PETSC_SUCCESS);
    for (int k = 0; k < n; k++)
      b[k] = SbDot3(G + 3 * k, g);
    solve_forces(n, G, G, b, x);
    for (int k = 0; k < 3 * n; k++)
      g[k % 3] -= x[k / 3] * G[k];
    if (SbDot3(g, g) < SAID * full)
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbReserve(c->n + 1, sizeof(*c->constraint), &c->size, &c->constraint));
  c->constraint[c->n] = *constraint;
  c->constraint[c->n].next = c->first[node];
  c->first[node] = *number = c->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAssembleConstraints(SbSpace s)
{
  SbConstraints c = s->constraints;
  PetscInt count[3] = {c->n, 0, 0};

  PetscFunctionBeginUser;
  c->version++;
  for (PetscInt i = 0; i < c->n; i++) {
    const SbConstraint *a = &c->constraint[i];

    count[1] += !a->spring;
    count[2] += a->push[0] != a->n[0] || a->push[1] != a->n[1] || a->push[2] != a->n[2];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, s->comm));
  c->ntotal = count[0];
  c->nexact = count[1];
  c->tilted = (PetscBool)(count[2] > 0);
  if (!c->nexact)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* Q of each node, column by column */
  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->constraint[i].node;
    PetscInt number[3];
    PetscReal G[9], F[9];
    int n;

    if (c->first[node] != i)
      continue; /* once per node */
    n = exact_constraints(s, node, number, G, F);
    for (int j = 0; j < 3 && n; j++) {
      const PetscReal b[3] = {G[j], n > 1 ? G[3 + j] : 0., n > 2 ? G[6 + j] : 0.};
      PetscReal x[3];

      solve_forces(n, G, F, b, x);
      for (int k = 0; k < n; k++)
        for (int l = 0; l < 3; l++)
          c->Q[9 * node + 3 * l + j] += F[3 * k + l] * x[k];
    }
  }

  /* Q of ghosts, for the columns of a matrix */
  if (s->ghosted) {
    PetscReal *row;

    PetscCall(PetscMalloc1(3 * s->nnode, &row));
    for (int r = 0; r < 3; r++) {
      for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
        row[i] = c->Q[9 * (i / 3) + 3 * r + i % 3];
      PetscCall(SbSpaceUpdateGhosts(s, row));
      for (PetscInt i = 3 * s->nnode_owned; i < 3 * s->nnode; i++)
        c->Q[9 * (i / 3) + 3 * r + i % 3] = row[i];
    }
    PetscCall(PetscFree(row));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbConstraintsProject(SbSpace s, PetscReal x[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->constraint[i].node;
    PetscReal y[3];

    if (c->first[node] != i)
      continue;
    for (int k = 0; k < 3; k++)
      y[k] = SbDot3(c->Q + 9 * node + 3 * k, x + 3 * node);
    for (int k = 0; k < 3; k++)
      x[3 * node + k] -= y[k];
  }
}

PetscErrorCode SbSpaceProjectAdmissible(SbSpace s, Vec z)
{
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, z));
  if (!s->constraints)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArray(z, &x));
  SbConstraintsProject(s, x);
  PetscCall(VecRestoreArray(z, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbConstraintsPrescribe(SbSpace s, PetscBool velocities, PetscReal x[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->constraint[i].node;
    PetscInt number[3];
    PetscReal G[9], F[9], b[3], step[3];
    int n;

    if (c->first[node] != i)
      continue;
    n = exact_constraints(s, node, number, G, F);
    for (int k = 0; k < n; k++) {
      const SbConstraint *a = &c->constraint[number[k]];

      b[k] = (velocities ? a->velocity : a->value) - SbDot3(a->n, x + 3 * node);
    }
    solve_forces(n, G, F, b, step);
    for (int k = 0; k < 3 * n; k++)
      x[3 * node + k % 3] += step[k / 3] * F[k];
  }
}

/* Force of a spring at the displacement u of its node, N. */
static inline PetscReal spring_force(const SbConstraint *a, const PetscReal u[3])
{
  return a->constant + a->stiffness * (a->value - SbDot3(a->n, u));
}

void SbConstraintsResidual(SbSpace s, const PetscReal u[], PetscBool constrain, PetscReal f[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < c->n; i++) {
    const SbConstraint *a = &c->constraint[i];
    PetscReal push[3], force;

    if (!a->spring)
      continue;
    force = spring_force(a, u + 3 * a->node);
    free_part(s, a->node, a->push, push);
    for (int k = 0; k < 3; k++)
      f[3 * a->node + k] -= force * (constrain ? push[k] : a->push[k]);
  }
  if (constrain)
    SbConstraintsProject(s, f);
}

void SbConstraintsComputeForces(SbSpace s, const PetscReal u[], const PetscReal r[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < c->n; i++) {
    SbConstraint *a = &c->constraint[i];
    PetscInt number[3];
    PetscReal G[9], F[9], b[3], x[3];
    int n;

    a->sum = SbDot3(a->n, u + 3 * a->node);
    if (a->spring)
      a->force = spring_force(a, u + 3 * a->node);
    if (c->first[a->node] != i)
      continue;
    n = exact_constraints(s, a->node, number, G, F);
    for (int k = 0; k < n; k++)
      b[k] = SbDot3(G + 3 * k, r + 3 * a->node);
    solve_forces(n, G, F, b, x);
    for (int k = 0; k < n; k++)
      c->constraint[number[k]].force = x[k];
  }
}

void SbConstraintsAddForces(SbSpace s, PetscReal f[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < c->n; i++) {
    const SbConstraint *a = &c->constraint[i];

    for (int k = 0; k < 3; k++)
      f[3 * a->node + k] += a->force * a->push[k];
  }
}

void SbConstraintsReactions(SbSpace s, PetscReal r[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (!(s->fixed[i / 3] & (1 << i % 3)))
      r[i] = 0.;
  for (PetscInt i = 0; i < c->n; i++) {
    const SbConstraint *a = &c->constraint[i];

    for (int k = 0; k < 3; k++) {
      const PetscReal force = a->force * a->push[k];

      if (!(s->fixed[a->node] & (1 << k)))
        r[3 * a->node + k] += force;
      else if (!a->spring) /* spring forces are part of the residual */
        r[3 * a->node + k] -= force;
    }
  }
}

/* Size of a diagonal block. */
static inline PetscReal block_size(const PetscScalar v[], size_t rs, size_t cs)
{
  return (PetscAbsReal(v[0]) + PetscAbsReal(v[rs + cs]) + PetscAbsReal(v[2 * (rs + cs)])) / 3.;
}

void SbConstraintsProjectBlock(SbSpace s, PetscInt i, PetscInt j, size_t rs, size_t cs,
                               PetscScalar *v)
{
  const PetscReal *Qi = s->constraints->Q + 9 * i;
  const PetscReal *Qj = s->constraints->Q + 9 * j;
  PetscReal size, B[9], X[9];

  if (Qi[0] + Qi[4] + Qi[8] < 0.5)
    Qi = NULL;
  if (Qj[0] + Qj[4] + Qj[8] < 0.5)
    Qj = NULL;
  if (!Qi && !Qj)
    return;
  size = block_size(v, rs, cs);

  /* B <- P_i B P_j, rows rs apart, columns cs; Q NULL: not constrained. */
  for (size_t k = 0; k < 9; k++)
    B[k] = v[k / 3 * rs + k % 3 * cs];
  if (Qi) {
    SbMatMul(Qi, B, X);
    for (int k = 0; k < 9; k++)
      B[k] -= X[k];
  }
  if (Qj) {
    SbMatMul(B, Qj, X);
    for (int k = 0; k < 9; k++)
      B[k] -= X[k];
  }
  for (size_t k = 0; k < 9; k++)
    v[k / 3 * rs + k % 3 * cs] = B[k];
  for (size_t k = 0; k < 9 && i == j; k++)
    v[k / 3 * rs + k % 3 * cs] += size * Qi[k];
}

/* If only constraints support a body K is singular. In a static run s_i times the squared
   components of the constraint directions are added to its diagonal, s_i the size of the node's
   block; the operator subtracts them again, so that only M contains them. */
static void anchor(SbSpace s, const SbMatBlocks *x)
{
  const SbConstraints c = s->constraints;

  memset(c->added, 0, 3 * (size_t)s->nnode_owned * sizeof(*c->added));
  for (PetscInt i = 0; i < c->n; i++) {
    const SbConstraint *a = &c->constraint[i];
    PetscReal n[3];

    free_part(s, a->node, a->n, n);
    for (int k = 0; k < 3; k++)
      c->added[3 * a->node + k] += n[k] * n[k];
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    size_t rs, cs;
    PetscReal size;
    PetscScalar *v;

    if (c->first[i] < 0)
      continue;
    v = sb_block(x, s->plan, i, s->plan->diagonal[i], &rs, &cs);
    size = block_size(v, rs, cs);
    for (size_t k = 0; k < 3; k++) {
      c->added[3 * (size_t)i + k] *= size;
      v[k * (rs + cs)] += c->added[3 * (size_t)i + k];
    }
  }
}

void SbConstraintsFinishTangent(SbSpace s, const SbMatBlocks *x)
{
  const SbConstraints c = s->constraints;
  const SbPlan p = s->plan;

  if (c->added)
    anchor(s, x);
  if (c->beside || !c->nexact)
    return;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (int q = 0; q < (x->value[1] ? 2 : 1); q++) {
      const PetscInt *ptr = q ? p->oi : p->di;
      const PetscInt *col = q ? p->oj : p->dj;

      for (PetscInt k = x->symmetric ? p->diagonal[i] : ptr[i]; k < ptr[i + 1]; k++) {
        size_t rs, cs;
        PetscScalar *v = sb_block(x, p, i, q ? ~k : k, &rs, &cs);

        SbConstraintsProjectBlock(s, i, col[k], rs, cs, v);
      }
    }
  }
}

void SbConstraintsAddSprings(SbSpace s, PetscInt node, PetscReal block[9])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = c->first[node]; i >= 0; i = c->constraint[i].next) {
    const SbConstraint *a = &c->constraint[i];
    PetscReal n[3], push[3];

    if (!a->spring)
      continue;
    free_part(s, node, a->n, n);
    free_part(s, node, a->push, push);
    for (int k = 0; k < 9; k++)
      block[k] += a->stiffness * push[k / 3] * n[k % 3];
  }
}

void SbConstraintsAddTangent(SbSpace s, const PetscReal x[], PetscReal y[])
{
  const SbConstraints c = s->constraints;

  for (PetscInt i = 0; i < 3 * s->nnode_owned && c->added; i++)
    y[i] -= c->added[i] * x[i];
  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->constraint[i].node;
    PetscReal block[9] = {0};

    if (c->first[node] != i)
      continue;
    SbConstraintsAddSprings(s, node, block);
    for (int k = 0; k < 3; k++)
      y[3 * node + k] += SbDot3(block + 3 * k, x + 3 * node);
  }
}

void SbSpaceSetPrescribed(SbSpace s, PetscScalar u[])
{
  for (PetscInt k = 0; k < 3 * s->nfixed && s->fixed_node[k / 3] < s->nnode_owned; k++) {
    const PetscInt node = s->fixed_node[k / 3];

    if (s->fixed[node] & (1 << k % 3))
      u[3 * node + k % 3] = s->fixed_value[k];
  }
  if (s->constraints)
    SbConstraintsPrescribe(s, PETSC_FALSE, u);
}
