/*
  Nodes constrained along directions of their own for the moment: what contact needs beside prescribed unknowns.

  A node has up to three directions n_k with values c_k: n_k . u = c_k. Q is the orthogonal projector onto their span and d
  the displacement in it that has these values, so the node's displacement must be (I - Q) u + d. The solution vector is
  put there before a solve; the solve then changes the rest only:

    r <- (I - Q) r,   A_ij <- (I - Q_i) A_ij (I - Q_j),   A_ii += s_i Q_i

  (Baraff and Witkin 1998 for the projection), with s_i the size of the diagonal block. What the constraints must exert is
  the part Q r of the residual before the projection. Every solver works on the projected matrix as it does on any.

  The owner of a node decides; other ranks learn Q from it.
*/
#include "fem_impl.h"
#include "sbconstraint.h"
#include "sbkernel.h"

struct _p_SbNodalConstraints {
  PetscInt *count;   /* [nnode_owned] directions */
  PetscReal *normal; /* [nnode_owned][3][3] directions as given, without prescribed components */
  PetscReal *d;      /* [nnode_owned][3] m */
  PetscReal *rate;   /* [nnode_owned][3] speeds along the directions, m/s */
  PetscReal *Q;      /* [nnode][9] */
  PetscInt ntotal;   /* constrained nodes of all ranks */
  Vec row;           /* a row of Q of every node, for the other ranks */
};

PetscErrorCode SbSpaceCreateNodalConstraints(SbSpace s)
{
  SbNodalConstraints h;

  PetscFunctionBeginUser;
  if (s->nodal) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&h));
  PetscCall(PetscCalloc5(s->nnode_owned, &h->count, 9 * s->nnode_owned, &h->normal, 3 * s->nnode_owned, &h->d,
                         3 * s->nnode_owned, &h->rate, 9 * s->nnode, &h->Q));
  PetscCall(SbSpaceCreateVec(s, &h->row));
  s->nodal = h;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNodalConstraintsDestroy(SbNodalConstraints *nodal)
{
  SbNodalConstraints h = *nodal;

  PetscFunctionBeginUser;
  if (!h) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree5(h->count, h->normal, h->d, h->rate, h->Q));
  PetscCall(VecDestroy(&h->row));
  PetscCall(PetscFree(*nodal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpaceClearNodalConstraints(SbSpace s)
{
  SbNodalConstraints h = s->nodal;

  memset(h->count, 0, (size_t)s->nnode_owned * sizeof(*h->count));
  memset(h->d, 0, 3 * (size_t)s->nnode_owned * sizeof(*h->d));
  memset(h->rate, 0, 3 * (size_t)s->nnode_owned * sizeof(*h->rate));
  memset(h->Q, 0, 9 * (size_t)s->nnode * sizeof(*h->Q));
}

/* y = Q x */
static inline void project(const PetscReal Q[9], const PetscReal x[3], PetscReal y[3])
{
  for (int i = 0; i < 3; i++) y[i] = Q[3 * i] * x[0] + Q[3 * i + 1] * x[1] + Q[3 * i + 2] * x[2];
}

PetscInt SbSpaceAddNodalConstraint(SbSpace s, PetscInt node, const PetscReal n[3], PetscReal value)
{
  const SbNodalConstraints h = s->nodal;
  PetscReal *Q = h->Q + 9 * node, *d = h->d + 3 * node, inside[3], rest[3], length;
  const PetscInt k = h->count[node];

  project(Q, n, inside);
  for (int i = 0; i < 3; i++) rest[i] = s->fixed[node] & (1 << i) ? 0. : n[i] - inside[i];
  length = PetscSqrtReal(SbDot3(rest, rest));
  if (k == 3 || length < 1e-6) return -1;
  for (int i = 0; i < 3; i++) rest[i] /= length;
  value = (value - SbDot3(inside, d)) / length;
  for (int i = 0; i < 3; i++) {
    h->normal[9 * node + 3 * k + i] = s->fixed[node] & (1 << i) ? 0. : n[i];
    d[i] += value * rest[i];
    for (int j = 0; j < 3; j++) Q[3 * i + j] += rest[i] * rest[j];
  }
  h->count[node]++;
  return k;
}

PetscErrorCode SbSpaceAssembleNodalConstraints(SbSpace s)
{
  const SbNodalConstraints h = s->nodal;
  PetscInt mine = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++) mine += h->count[i] > 0;
  PetscCallMPI(MPI_Allreduce(&mine, &h->ntotal, 1, MPIU_INT, MPI_SUM, s->comm));
  for (int r = 0; s->ghosted && r < 3; r++) {
    const PetscReal *all;
    PetscReal *own;

    PetscCall(SbSpaceGetLocalWrite(s, h->row, &own));
    for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) own[i] = h->Q[9 * (i / 3) + 3 * r + i % 3];
    PetscCall(SbSpaceRestoreLocalWrite(s, h->row, &own));
    PetscCall(SbSpaceGetLocalRead(s, h->row, &all));
    for (PetscInt i = 3 * s->nnode_owned; i < 3 * s->nnode; i++) h->Q[9 * (i / 3) + 3 * r + i % 3] = all[i];
    PetscCall(SbSpaceRestoreLocalRead(s, h->row, &all));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbSpaceIsConstrained(SbSpace s)
{
  return (PetscBool)((s->nodal && s->nodal->ntotal) || (s->constraints && s->constraints->ntotal));
}

void SbNodalConstraintsPrescribe(SbSpace s, PetscReal u[])
{
  const SbNodalConstraints h = s->nodal;

  for (PetscInt i = 0; h->ntotal && i < s->nnode_owned; i++) {
    PetscReal inside[3];

    if (!h->count[i]) continue;
    project(h->Q + 9 * i, u + 3 * i, inside);
    for (int c = 0; c < 3; c++) u[3 * i + c] += h->d[3 * i + c] - inside[c];
  }
}

void SbNodalConstraintsProject(SbSpace s, PetscReal f[])
{
  const SbNodalConstraints h = s->nodal;

  for (PetscInt i = 0; h->ntotal && i < s->nnode_owned; i++) {
    PetscReal inside[3];

    if (!h->count[i]) continue;
    project(h->Q + 9 * i, f + 3 * i, inside);
    for (int c = 0; c < 3; c++) f[3 * i + c] -= inside[c];
  }
}

void SbNodalConstraintsReaction(SbSpace s, PetscReal f[])
{
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal inside[3];

    project(s->nodal->Q + 9 * i, f + 3 * i, inside);
    for (int c = 0; c < 3; c++) {
      if (!(s->fixed[i] & (1 << c))) f[3 * i + c] = inside[c];
    }
  }
}

/* x[k] of the Gram matrix of the at most three directions of a node, x = (N N^T)^-1 b. */
static void solve_directions(SbNodalConstraints h, PetscInt node, const PetscReal b[3], PetscReal x[3])
{
  const PetscReal *n = h->normal + 9 * node;
  const PetscInt m = h->count[node];
  PetscReal G[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, C[9], det;

  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt j = 0; j < m; j++) G[3 * i + j] = SbDot3(n + 3 * i, n + 3 * j);
  }
  SbMatCofactor(G, C);
  det = SbDot3(G, C);
  for (int k = 0; k < 3; k++) x[k] = SbDot3(C + 3 * k, b) / det;
}

/* Least squares. */
PetscReal SbSpaceGetNodalConstraintForce(SbSpace s, PetscInt node, PetscInt k, const PetscReal r[3])
{
  const SbNodalConstraints h = s->nodal;
  PetscReal b[3] = {0}, x[3];

  for (PetscInt i = 0; i < h->count[node]; i++) b[i] = SbDot3(h->normal + 9 * node + 3 * i, r);
  solve_directions(h, node, b, x);
  return x[k];
}

void SbSpaceSetNodalConstraintVelocity(SbSpace s, PetscInt node, PetscInt k, PetscReal rate)
{
  s->nodal->rate[3 * node + k] = rate;
}

void SbNodalConstraintsVelocity(SbSpace s, PetscReal v[])
{
  const SbNodalConstraints h = s->nodal;

  for (PetscInt i = 0; h->ntotal && i < s->nnode_owned; i++) {
    const PetscReal *n = h->normal + 9 * i;
    PetscReal b[3] = {0}, x[3];

    if (!h->count[i]) continue;
    for (PetscInt k = 0; k < h->count[i]; k++) b[k] = h->rate[3 * i + k] - SbDot3(n + 3 * k, v + 3 * i);
    solve_directions(h, i, b, x);
    for (PetscInt k = 0; k < h->count[i]; k++) {
      for (int c = 0; c < 3; c++) v[3 * i + c] += x[k] * n[3 * k + c];
    }
  }
}

/* B <- (I - Qi) B (I - Qj), rows rs apart, columns cs; Q NULL: not constrained. */
static void project_block(const PetscReal *Qi, const PetscReal *Qj, size_t rs, size_t cs, PetscScalar *v)
{
  PetscReal B[9], X[9];

  for (size_t i = 0; i < 3; i++) {
    for (size_t j = 0; j < 3; j++) B[3 * i + j] = v[i * rs + j * cs];
  }
  if (Qi) {
    SbMatMul(Qi, B, X);
    for (int k = 0; k < 9; k++) B[k] -= X[k];
  }
  if (Qj) {
    SbMatMul(B, Qj, X);
    for (int k = 0; k < 9; k++) B[k] -= X[k];
  }
  for (size_t i = 0; i < 3; i++) {
    for (size_t j = 0; j < 3; j++) v[i * rs + j * cs] = B[3 * i + j];
  }
}

static PetscBool is_constrained(const PetscReal Q[9])
{
  return (PetscBool)(Q[0] + Q[4] + Q[8] > 0.5);
}

void SbNodalConstraintsProjectMatrix(SbSpace s, const SbValues *x)
{
  const SbNodalConstraints h = s->nodal;
  const SbPlan p = s->plan;

  for (PetscInt i = 0; h->ntotal && i < s->nnode_owned; i++) {
    const PetscReal *Qi = is_constrained(h->Q + 9 * i) ? h->Q + 9 * i : NULL;

    for (int q = 0; q < (x->value[1] ? 2 : 1); q++) {
      const PetscInt *ptr = q ? p->oi : p->di, *col = q ? p->oj : p->dj;
      const PetscInt first = x->kind == SB_MATRIX_SBAIJ ? p->diagonal[i] : ptr[i];

      for (PetscInt k = first; k < ptr[i + 1]; k++) {
        const PetscReal *Qj = is_constrained(h->Q + 9 * col[k]) ? h->Q + 9 * col[k] : NULL;
        PetscScalar *v;
        size_t rs, cs;

        if (!Qi && !Qj) continue;
        v = sb_block(x, p, i, q ? ~k : k, &rs, &cs);
        if (!q && col[k] == i) {
          const PetscReal size =
            (PetscAbsReal(v[0]) + PetscAbsReal(v[rs + cs]) + PetscAbsReal(v[2 * (rs + cs)])) / 3.;

          project_block(Qi, Qj, rs, cs, v);
          for (size_t a = 0; a < 9; a++) v[a / 3 * rs + a % 3 * cs] += size * Qi[a];
        } else
          project_block(Qi, Qj, rs, cs, v);
      }
    }
  }
}

PetscBool SbNodalConstraintsExist(SbSpace s)
{
  return (PetscBool)(s->nodal && s->nodal->ntotal);
}

const PetscReal *SbNodalConstraintsProjector(SbSpace s, PetscInt node)
{
  return s->nodal && s->nodal->ntotal ? s->nodal->Q + 9 * node : NULL;
}
