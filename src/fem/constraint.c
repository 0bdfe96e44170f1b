/*
  Constraints on nodes anywhere: what contact with obstacles needs where it has friction or springs. G u = c exactly, S u = s by springs.

  Solves run in the null space of G (Gould, Hribar, Nocedal 2001, On the solution of equality constrained quadratic programming
  problems arising in optimization): with D a diagonal, one number per node, about the inverse of K's,

    P = I - D G^T (G D G^T)^-1 G,   A = P^T (K + S^T k S) P,   M_A^-1 = P M^-1 P^T

  D makes the projection blind to units and to stiffness. Every preconditioner M
  of K serves, and neither the matrix nor M are renewed when constraints come and go. What the constraints exert is the least-squares
  multiplier lambda = (G D G^T)^-1 G D r of the residual r. Constraints that repeat others (a node in the corner of two obstacles) leave
  P right; constraint_select.c leaves most of them out.

  G D G^T has the constraints of all ranks, which are few, and is factored on each of them.

  A constraint may push along other coefficients F than those of its sum: what slides with friction mu is pushed along n - mu d, d the
  direction of the slip. Then P = I - D F^T (G D F^T)^-1 G, forces are projected by I - F^T (G D F^T)^-1 G D, springs give F^T k G,
  and A is not symmetric.

  Where an effect asks for it, the saddle-point system itself is factored instead of A: saddle_factor.c.

  Nodes that are prescribed or constrained (nodal_constraint.c) have no say: their columns are cleared or projected.
*/
#include "fem_impl.h"
#include "sbconstraint.h"

#define NOTHING \
  1e-20 /* of the largest on that diagonal: constraints below it have no free node but for rounding */

PetscErrorCode SbSpaceCreateConstraints(SbSpace s, PetscBool nonsymmetric)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (!c) {
    PetscCall(PetscNew(&c));
    PetscCall(PetscCalloc1(1, &c->start));
    s->constraints = c;
  }
  c->nonsymmetric = (PetscBool)(c->nonsymmetric || nonsymmetric);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbSpaceHasNonsymmetricConstraints(SbSpace s)
{
  return (PetscBool)(s->constraints && s->constraints->nonsymmetric);
}

static PetscErrorCode destroy_matrix(SbConstraintMatrix *r)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&r->full));
  PetscCall(MatDestroy(&r->free));
  PetscCall(MatDestroy(&r->push));
  PetscCall(MatDestroy(&r->push_free));
  PetscCall(VecDestroy(&r->value));
  PetscCall(VecDestroy(&r->force));
  PetscCall(VecDestroy(&r->work));
  PetscCall(VecDestroy(&r->step));
  r->n = r->N = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_matrices(SbConstraints c)
{
  PetscFunctionBeginUser;
  PetscCall(destroy_matrix(&c->exact));
  PetscCall(destroy_matrix(&c->spring));
  PetscCall(VecDestroy(&c->k));
  PetscCall(VecDestroy(&c->constants));
  PetscCall(MatDestroy(&c->DFt));
  PetscCall(MatDestroy(&c->gram));
  PetscCall(KSPDestroy(&c->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsDestroy(SbConstraints *constraints)
{
  SbConstraints c = *constraints;

  PetscFunctionBeginUser;
  if (!c) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(destroy_matrices(c));
  if (c->factored) PetscCall((c->destroy_factored)(&c->factored));
  PetscCall(VecDestroy(&c->anchor));
  PetscCall(VecDestroy(&c->added));
  PetscCall(VecDestroy(&c->free));
  PetscCall(VecDestroy(&c->d));
  PetscCall(VecDestroy(&c->w[0]));
  PetscCall(VecDestroy(&c->w[1]));
  PetscCall(VecDestroy(&c->w[2]));
  PetscCall(PetscFree(c->redundant));
  PetscCall(PetscFree(c->rate));
  PetscCall(PetscFree(c->start));
  PetscCall(PetscFree(c->gnode));
  PetscCall(PetscFree(c->coef));
  PetscCall(PetscFree(c->along));
  PetscCall(PetscFree(c->value));
  PetscCall(PetscFree(c->stiffness));
  PetscCall(PetscFree(c->constant));
  PetscCall(PetscFree(c->position));
  PetscCall(PetscFree(c->force));
  PetscCall(PetscFree(c->sum));
  PetscCall(PetscFree(c->id));
  PetscCall(PetscFree(*constraints));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ constraints */

void SbSpaceClearConstraints(SbSpace s)
{
  s->constraints->n = 0;
  s->constraints->nentry = 0;
  s->constraints->tilted = PETSC_FALSE;
  s->constraints->nrate = 0;
}

static PetscErrorCode make_room(SbConstraints c, PetscInt more)
{
  PetscFunctionBeginUser;
  if (c->n == c->size) {
    const PetscInt size = PetscMax(64, 2 * c->size);
    void *const numbers[] = {&c->value, &c->stiffness, &c->constant, &c->force, &c->sum};
    void *const whole[] = {&c->position, &c->id};

    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(numbers); k++)
      PetscCall(PetscRealloc((size_t)size * sizeof(PetscReal), (void **)numbers[k]));
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(whole); k++)
      PetscCall(PetscRealloc((size_t)size * sizeof(PetscInt), (void **)whole[k]));
    PetscCall(PetscRealloc((size_t)size * sizeof(PetscBool), &c->redundant));
    c->size = size;
    PetscCall(PetscRealloc((size_t)(size + 1) * sizeof(PetscInt), &c->start));
  }
  if (c->nentry + more > c->entry_size) {
    c->entry_size = PetscMax(256, 2 * (c->nentry + more));
    PetscCall(PetscRealloc((size_t)c->entry_size * sizeof(PetscInt), &c->gnode));
    PetscCall(PetscRealloc(3 * (size_t)c->entry_size * sizeof(PetscReal), &c->coef));
    PetscCall(PetscRealloc(3 * (size_t)c->entry_size * sizeof(PetscReal), &c->along));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddPenaltyConstraint(SbSpace s, PetscInt n, const PetscInt gnode[],
                                           const PetscReal coef[], const PetscReal push[], PetscReal value,
                                           PetscReal stiffness, PetscReal constant, PetscInt *constraint)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  PetscCall(make_room(c, n));
  PetscCall(PetscArraycpy(c->gnode + c->nentry, gnode, n));
  PetscCall(PetscArraycpy(c->coef + 3 * c->nentry, coef, 3 * n));
  PetscCall(PetscArraycpy(c->along + 3 * c->nentry, push ? push : coef, 3 * n));
  if (push) c->tilted = PETSC_TRUE;
  c->start[c->n] = c->nentry;
  c->value[c->n] = value;
  c->stiffness[c->n] = stiffness;
  c->constant[c->n] = constant;
  c->force[c->n] = c->sum[c->n] = 0.;
  c->id[c->n] = 0;
  c->nentry += n;
  c->start[c->n + 1] = c->nentry;
  *constraint = c->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddConstraint(SbSpace s, PetscInt id, PetscInt n, const PetscInt gnode[],
                                    const PetscReal coef[], const PetscReal push[], PetscReal value,
                                    PetscInt *constraint)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceAddPenaltyConstraint(s, n, gnode, coef, push, value, -1., 0., constraint));
  s->constraints->id[*constraint] = id;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool of_kind(SbConstraints c, PetscInt i, PetscBool exact)
{
  return (PetscBool)((c->stiffness[i] < 0.) == exact && !c->redundant[i]);
}

/* The constraints of one kind as a matrix, with the coefficients coef[][3]. */
static PetscErrorCode create_matrix(SbSpace s, PetscBool exact, const SbConstraintMatrix *r, PetscInt widest,
                                    const PetscReal coef[], Mat *A)
{
  SbConstraints c = s->constraints;
  PetscInt first;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(s->comm, r->n, 3 * s->nnode_owned, PETSC_DETERMINE, 3 * s->Nnode, widest, NULL,
                         widest, NULL, A));
  PetscCall(MatGetOwnershipRange(*A, &first, NULL));
  for (PetscInt i = 0; i < c->n; i++) {
    if (!of_kind(c, i, exact)) continue;
    for (PetscInt e = c->start[i]; e < c->start[i + 1]; e++) {
      const PetscInt row = first + c->position[i], g = 3 * c->gnode[e], column[3] = {g, g + 1, g + 2};

      PetscCall(MatSetValues(*A, 1, &row, 3, column, coef + 3 * e, ADD_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constraints of one kind; c->tilted is alike on all ranks. */
static PetscErrorCode create_kind(SbSpace s, PetscBool exact, SbConstraintMatrix *r)
{
  SbConstraints c = s->constraints;
  PetscInt widest = 1;
  PetscScalar *value;

  PetscFunctionBeginUser;
  r->n = 0;
  for (PetscInt i = 0; i < c->n; i++) {
    if (!of_kind(c, i, exact)) continue;
    widest = PetscMax(widest, 3 * (c->start[i + 1] - c->start[i]));
    c->position[i] = r->n++;
  }
  PetscCallMPI(MPI_Allreduce(&r->n, &r->N, 1, MPIU_INT, MPI_SUM, s->comm));
  if (!r->N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(create_matrix(s, exact, r, widest, c->coef, &r->full));
  if (c->tilted)
    PetscCall(create_matrix(s, exact, r, widest, c->along, &r->push));
  else {
    PetscCall(PetscObjectReference((PetscObject)r->full));
    r->push = r->full;
  }
  PetscCall(MatCreateVecs(r->full, NULL, &r->value));
  PetscCall(VecDuplicate(r->value, &r->force));
  PetscCall(VecDuplicate(r->value, &r->work));
  PetscCall(VecDuplicate(r->value, &r->step));
  PetscCall(VecGetArrayWrite(r->value, &value));
  for (PetscInt i = 0; i < c->n; i++) {
    if (of_kind(c, i, exact)) value[c->position[i]] = c->value[i];
  }
  PetscCall(VecRestoreArrayWrite(r->value, &value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* I - Q on the nodes' blocks. */
static PetscErrorCode create_projector(SbSpace s, Mat *H)
{
  PetscInt first;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(s->comm, 3 * s->nnode_owned, 3 * s->nnode_owned, 3 * s->Nnode, 3 * s->Nnode, 3, NULL,
                         0, NULL, H));
  PetscCall(MatGetOwnershipRange(*H, &first, NULL));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal *Q = SbNodalConstraintsProjector(s, i);
    PetscScalar block[9];
    PetscInt at[3];

    for (PetscInt k = 0; k < 9; k++) block[k] = (k % 4 ? 0. : 1.) - Q[k];
    for (PetscInt k = 0; k < 3; k++) at[k] = first + 3 * i + k;
    PetscCall(MatSetValues(*H, 3, at, 3, at, block, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*H, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*H, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Clears what prescribed unknowns and constrained directions (I - Q in H, NULL: none) would say in a matrix of constraints. */
static PetscErrorCode create_free(SbSpace s, Mat full, Mat H, Mat *free)
{
  PetscFunctionBeginUser;
  if (H)
    PetscCall(MatMatMult(full, H, MAT_INITIAL_MATRIX, PETSC_DEFAULT, free));
  else
    PetscCall(MatDuplicate(full, MAT_COPY_VALUES, free));
  PetscCall(MatDiagonalScale(*free, NULL, s->constraints->free));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_free_parts(SbSpace s, SbConstraintMatrix *r)
{
  Mat H = NULL;

  PetscFunctionBeginUser;
  if (!r->N) PetscFunctionReturn(PETSC_SUCCESS);
  if (SbNodalConstraintsExist(s)) PetscCall(create_projector(s, &H));
  PetscCall(create_free(s, r->full, H, &r->free));
  if (r->push == r->full) {
    PetscCall(PetscObjectReference((PetscObject)r->free));
    r->push_free = r->free;
  } else
    PetscCall(create_free(s, r->push, H, &r->push_free));
  PetscCall(MatDestroy(&H));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the projection */

/* One vector each that the solves work with, and which unknowns are free. */
static PetscErrorCode create_vectors(SbSpace s)
{
  SbConstraints c = s->constraints;
  PetscScalar *x;

  PetscFunctionBeginUser;
  if (c->free) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceCreateVec(s, &c->free));
  PetscCall(VecDuplicate(c->free, &c->d));
  PetscCall(VecDuplicate(c->free, &c->w[0]));
  PetscCall(VecDuplicate(c->free, &c->w[1]));
  PetscCall(VecDuplicate(c->free, &c->w[2]));
  PetscCall(VecGetArray(c->free, &x));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) x[i] = s->fixed[i / 3] & (1 << (i % 3)) ? 0. : 1.;
  PetscCall(VecRestoreArray(c->free, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D: inverse of the mean of K's diagonal at each node; before there is a K, of the mass, which keeps momentum. */
static PetscErrorCode weigh_nodes(SbSpace s)
{
  SbConstraints c = s->constraints;
  PetscReal largest = 0.;
  PetscBool known;
  PetscScalar *d;

  PetscFunctionBeginUser;
  if (c->K) { /* it begins as zero */
    PetscCall(MatGetDiagonal(c->K, c->d));
    PetscCall(VecNorm(c->d, NORM_INFINITY, &largest));
  }
  known = (PetscBool)(largest > 0.);
  PetscCall(VecGetArray(c->d, &d));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal mean = known ? 0. : s->node_mass[i];

    for (PetscInt k = 0; k < 3 && known; k++) mean += PetscAbsScalar(d[3 * i + k]) / 3.;
    for (PetscInt k = 0; k < 3; k++) d[3 * i + k] = mean > 0. ? 1. / mean : 0.;
  }
  PetscCall(VecRestoreArray(c->d, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the factorisation solvable: constraints that depend on others. Constraints without a free direction can do nothing and are redundant. */
static PetscErrorCode regularise(SbConstraints c)
{
  PetscReal largest;
  PetscScalar *x;
  Vec d;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(c->gram, &d, NULL));
  PetscCall(MatGetDiagonal(c->gram, d));
  PetscCall(VecNorm(d, NORM_INFINITY, &largest));
  PetscCall(VecGetArray(d, &x));
  for (PetscInt i = 0; i < c->n; i++) {
    if (!of_kind(c, i, PETSC_TRUE)) continue;
    if (x[c->position[i]] > NOTHING * largest)
      x[c->position[i]] *= 1. + SB_CONSTRAINT_REGULARIZATION;
    else {
      x[c->position[i]] = largest > 0. ? largest : 1.;
      c->redundant[i] = PETSC_TRUE;
    }
  }
  PetscCall(VecRestoreArray(d, &x));
  PetscCall(MatDiagonalSet(c->gram, d, INSERT_VALUES));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A body that only constraints support makes K singular, which no factorisation takes. In a static run the matrix gets s_i times the squares
  of the constraints' coefficients on its diagonal, s_i the size of the node's block; the operator takes it away again, so that only M
  knows of it.
*/
static PetscErrorCode find_anchors(SbSpace s)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (!c->anchor) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecZeroEntries(c->anchor));
  for (PetscInt e = 0; e < 3 * c->nentry; e++)
    PetscCall(VecSetValue(c->anchor, 3 * c->gnode[e / 3] + e % 3, c->coef[e] * c->coef[e], ADD_VALUES));
  PetscCall(VecAssemblyBegin(c->anchor));
  PetscCall(VecAssemblyEnd(c->anchor));
  PetscCall(VecPointwiseMult(c->anchor, c->anchor, c->free));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsRegularize(SbSpace s, const SbValues *x)
{
  SbConstraints c = s->constraints;
  const PetscScalar *a;
  PetscScalar *added;

  PetscFunctionBeginUser;
  if (!c->anchor) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(c->anchor, &a));
  PetscCall(VecGetArray(c->added, &added));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    size_t rs, cs;
    PetscScalar *v;
    PetscReal size;

    for (PetscInt k = 0; k < 3; k++) added[3 * i + k] = 0.;
    if (a[3 * i] + a[3 * i + 1] + a[3 * i + 2] == 0.) continue;
    v = sb_block(x, s->plan, i, s->plan->diagonal[i], &rs, &cs);
    size = (PetscAbsReal(v[0]) + PetscAbsReal(v[rs + cs]) + PetscAbsReal(v[2 * (rs + cs)])) / 3.;
    for (size_t k = 0; k < 3; k++) {
      added[3 * (size_t)i + k] = size * a[3 * (size_t)i + k];
      v[k * (rs + cs)] += added[3 * (size_t)i + k];
    }
  }
  PetscCall(VecRestoreArray(c->added, &added));
  PetscCall(VecRestoreArrayRead(c->anchor, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* G D F^T of the exact constraints, and its factorisation. */
static PetscErrorCode create_gram(SbSpace s)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (!c->exact.N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(weigh_nodes(s));
  PetscCall(MatTranspose(c->exact.push_free, MAT_INITIAL_MATRIX, &c->DFt));
  PetscCall(MatDiagonalScale(c->DFt, c->d, NULL));
  PetscCall(MatMatMult(c->exact.free, c->DFt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &c->gram));
  PetscCall(regularise(c));
  PetscCall(SbConstraintsCreateGramSolver(s, c->gram, &c->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stiffness and constant force of the springs. */
static PetscErrorCode create_springs(SbConstraints c)
{
  PetscScalar *k, *constant;

  PetscFunctionBeginUser;
  if (!c->spring.N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(c->spring.value, &c->k));
  PetscCall(VecDuplicate(c->spring.value, &c->constants));
  PetscCall(VecGetArray(c->k, &k));
  PetscCall(VecGetArray(c->constants, &constant));
  for (PetscInt i = 0; i < c->n; i++) {
    if (c->stiffness[i] < 0.) continue;
    k[c->position[i]] = c->stiffness[i];
    constant[c->position[i]] = c->constant[i];
  }
  PetscCall(VecRestoreArray(c->k, &k));
  PetscCall(VecRestoreArray(c->constants, &constant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAssembleConstraints(SbSpace s)
{
  SbConstraints c = s->constraints;
  PetscInt count[2];

  PetscFunctionBeginUser;
  PetscCall(destroy_matrices(c));
  c->version++;
  count[0] = c->n;
  count[1] = c->tilted;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, s->comm));
  c->ntotal = count[0];
  c->tilted = (PetscBool)(count[1] > 0);
  if (!c->ntotal) { /* bodies are apart: nothing more is exchanged or made */
    if (c->anchor) PetscCall(VecZeroEntries(c->anchor));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(create_vectors(s));
  PetscCall(SbConstraintsFindRedundant(s));
  PetscCall(find_anchors(s));
  PetscCall(create_kind(s, PETSC_TRUE, &c->exact));
  PetscCall(create_kind(s, PETSC_FALSE, &c->spring));
  PetscCall(create_free_parts(s, &c->exact));
  PetscCall(create_free_parts(s, &c->spring));
  PetscCall(create_gram(s));
  PetscCall(create_springs(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = (G D F^T)^-1 w, but for SB_CONSTRAINT_REGULARIZATION; every use is repeated with what the first left. */
static PetscErrorCode solve_gram(SbConstraints c)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSolve(c->solver, c->exact.work, c->exact.step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsProject(SbConstraints c, Vec x)
{
  PetscFunctionBeginUser;
  for (int pass = 0; c->exact.N && pass < c->passes; pass++) {
    PetscCall(MatMult(c->exact.free, x, c->exact.work));
    PetscCall(VecScale(c->exact.work, -1.));
    PetscCall(solve_gram(c));
    PetscCall(MatMultAdd(c->DFt, c->exact.step, x, x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  r <- r - F^T lambda, lambda into c->exact.force. They may be much larger than what is left: the later passes also take away
  their rounding, which would be a residual that no iteration lowers.
*/
PetscErrorCode SbConstraintsProjectForce(SbConstraints c, Vec r)
{
  PetscFunctionBeginUser;
  if (c->exact.N) PetscCall(VecZeroEntries(c->exact.force));
  for (int pass = 0; c->exact.N && pass < c->passes; pass++) {
    PetscCall(VecPointwiseMult(c->w[2], c->d, r));
    PetscCall(MatMult(c->exact.free, c->w[2], c->exact.work));
    PetscCall(VecScale(c->exact.work, -1.));
    PetscCall(solve_gram(c));
    PetscCall(MatMultTransposeAdd(c->exact.push_free, c->exact.step, r, r));
    PetscCall(VecAXPY(c->exact.force, -1., c->exact.step));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsPrescribe(SbSpace s, Vec U)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  for (int pass = 0; c->exact.N && pass < c->passes; pass++) {
    PetscCall(MatMult(c->exact.full, U, c->exact.work));
    PetscCall(VecAYPX(c->exact.work, -1., c->exact.value));
    PetscCall(solve_gram(c));
    PetscCall(MatMultAdd(c->DFt, c->exact.step, U, U));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceProjectAdmissible(SbSpace s, Vec z)
{
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(z, &x));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    if (s->fixed[i / 3] & (1 << (i % 3))) x[i] = 0.;
  }
  if (s->nodal) SbNodalConstraintsProject(s, x);
  PetscCall(VecRestoreArray(z, &x));
  if (s->constraints) PetscCall(SbConstraintsProject(s->constraints, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces of the springs into c->spring.force, where they are into c->spring.work. */
static PetscErrorCode stretch(SbConstraints c, Vec U)
{
  PetscFunctionBeginUser;
  PetscCall(MatMult(c->spring.full, U, c->spring.work));
  PetscCall(VecWAXPY(c->spring.force, -1., c->spring.work, c->spring.value));
  PetscCall(VecPointwiseMult(c->spring.force, c->spring.force, c->k));
  PetscCall(VecAXPY(c->spring.force, 1., c->constants));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsResidual(SbSpace s, Vec U, PetscBool constrain, Vec F)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (c->spring.N) {
    PetscCall(stretch(c, U));
    PetscCall(VecScale(c->spring.force, -1.));
    PetscCall(MatMultTransposeAdd(constrain ? c->spring.push_free : c->spring.push, c->spring.force, F, F));
  }
  if (constrain) PetscCall(SbConstraintsProjectForce(c, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values of a kind's constraints for the effect that made them. */
static PetscErrorCode hand_out(SbConstraints c, PetscBool exact, Vec from, PetscReal to[])
{
  const PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(from, &x));
  for (PetscInt i = 0; i < c->n; i++) {
    if (of_kind(c, i, exact)) to[i] = x[c->position[i]];
  }
  PetscCall(VecRestoreArrayRead(from, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceComputeConstraintForces(SbSpace s, Vec U, Vec R)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (c->exact.N) {
    PetscCall(VecPointwiseMult(c->w[0], R, c->free));
    PetscCall(SbConstraintsProjectForce(c, c->w[0]));
    PetscCall(hand_out(c, PETSC_TRUE, c->exact.force, c->force));
    /* the rest is what supports and obstacles exert */
    PetscCall(VecAXPBY(c->exact.work, -1., 0., c->exact.force));
    PetscCall(MatMultTransposeAdd(c->exact.push, c->exact.work, R, R));
    PetscCall(MatMult(c->exact.full, U, c->exact.work));
    PetscCall(hand_out(c, PETSC_TRUE, c->exact.work, c->sum));
  }
  if (c->spring.N) {
    PetscCall(stretch(c, U));
    PetscCall(hand_out(c, PETSC_FALSE, c->spring.force, c->force));
    PetscCall(hand_out(c, PETSC_FALSE, c->spring.work, c->sum));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddConstraintReactions(SbSpace s, Vec R)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (c->exact.N) PetscCall(MatMultTransposeAdd(c->exact.push_free, c->exact.force, R, R));
  if (c->spring.N) PetscCall(MatMultTransposeAdd(c->spring.push_free, c->spring.force, R, R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddConstraintForces(SbSpace s, Vec U, Vec F)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (c->exact.N) PetscCall(MatMultTransposeAdd(c->exact.push, c->exact.force, F, F));
  if (c->spring.N) {
    PetscCall(stretch(c, U));
    PetscCall(MatMultTransposeAdd(c->spring.push, c->spring.force, F, F));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbSpaceIsConstraintRedundant(SbSpace s, PetscInt constraint)
{
  return s->constraints->redundant[constraint];
}

void SbSpaceGetConstraint(SbSpace s, PetscInt constraint, PetscReal *force, PetscReal *sum)
{
  *force = s->constraints->force[constraint];
  *sum = s->constraints->sum[constraint];
}
