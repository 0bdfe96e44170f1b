/*
  Rigid motions without resistance (free motions) of a part of a body, which make a static problem
  singular for any length of the load steps.

  A part is a set of nodes connected by cells, Z its six rigid motions, P the projection onto
  admissible displacements (SbSpaceProjectAdmissible()). Two eigenvalue problems of size six decide:

  1. (Z - P Z)^T (Z - P Z) x = l Z^T Z x: by geometry, Z x is admissible if l is zero up to
  rounding. 2. (P Z x)^T A (P Z x) y = l (P Z x)^T D (P Z x) y of admissible motions, A the last
  solve's operator, D the
     diagonal of its matrix: free if l is zero, as neither springs nor friction nor stress resist.
     Contact between bodies, which A lacks, counts as a row for each active pair, with the largest
     entry of D as its stiffness.

  Parts that effects join, as joints and ties, may be free only together: where no part alone is,
  those with common couplings are examined as one. Not found: parts that contact connects. A part on
  springs whose stiffness is within the rounding of that of its cells counts as free.
*/
#include "sbgeometry.h"
#include "time_impl.h"
#include <petscblaslapack.h>

#define ALLOWED 1e-13 /* largest l of an admissible motion: rounding */
#define FREE 1e-13    /* largest l of a free motion: sums over the nodes have rounding of 1e-15 */
#define FAR 1e6 /* displacement over the body's size beyond which a static system was singular */

/* label[nnode_owned]: the lowest global number of a node's part; joined: with what couplings join
   to it. Collective; the caller frees it. */
static PetscErrorCode label_parts(SbSpace s, PetscBool joined, PetscInt **label)
{
  PetscInt *parent, *lowest;
  PetscBool changed = PETSC_TRUE;
  PetscReal *all;

  PetscFunctionBeginUser;

  /* union of the nodes of each local cell, with their supports */
  PetscCall(PetscMalloc2(s->nnode, &parent, s->nnode, &lowest));
  for (PetscInt i = 0; i < s->nnode; i++)
    parent[i] = i;
  for (PetscInt k = 0; k < 4 * s->mesh->ncell; k++) {
    (void)SbUnionJoin(parent, s->cell_node[k - k % 4], s->cell_node[k]);
    if (s->dirichlet_node && s->dirichlet_node[k] >= 0)
      (void)SbUnionJoin(parent, s->cell_node[k], s->dirichlet_node[k]);
  }

  /* the cells of DG have separate nodes: united across faces; edge nodes of P2 follow */
  for (PetscInt i = 0; s->edge_node && i < 6 * s->mesh->ncell; i++)
    if (s->edge_node[i] >= 0)
      (void)SbUnionJoin(parent, s->cell_node[4 * (i / 6)], s->edge_node[i]);
  for (PetscInt b = 0; s->batch_weight && b < s->nbatch; b++) {
    for (PetscInt k = 0; k < 4 * SB_BATCH; k++) {
      if (k % SB_BATCH < s->batch_n[b])
        (void)SbUnionJoin(parent, s->batch_clique[s->width * b * SB_BATCH + k],
                          s->batch_clique[(s->width * b + 4) * SB_BATCH + k]);
    }
  }

  /* with those that a coupling joins */
  for (PetscInt c = 0; c < s->couplings.n && joined; c++)
    for (PetscInt k = s->couplings.start[c] + 1; k < s->couplings.start[c + 1]; k++)
      (void)SbUnionJoin(parent, s->couplings.node[k - 1], s->couplings.node[k]);

  /* the lowest number in parts on several ranks: exchanged with the owners until it does not
     change */
  for (PetscInt i = 0; i < s->nnode; i++)
    lowest[i] = s->gnode[i];
  PetscCall(PetscCalloc1(3 * s->nnode, &all));
  while (changed) {
    changed = PETSC_FALSE;
    for (PetscInt i = 0; i < s->nnode; i++) {
      const PetscInt root = SbUnionRoot(parent, i);

      lowest[root] = PetscMin(lowest[root], lowest[i]);
    }
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      all[3 * i] = (PetscReal)lowest[SbUnionRoot(parent, i)];
    PetscCall(SbSpaceUpdateGhosts(s, all));
    for (PetscInt i = 0; i < s->nnode; i++) {
      const PetscInt other = (PetscInt)all[3 * i];
      const PetscInt root = SbUnionRoot(parent, i);

      changed = (PetscBool)(changed || other < lowest[root]);
      lowest[i] = PetscMin(lowest[root], other);
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changed, 1, SB_MPI_BOOL, MPI_LOR, s->comm));
  }
  PetscCall(PetscMalloc1(s->nnode_owned, label));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    (*label)[i] = lowest[SbUnionRoot(parent, i)];
  PetscCall(PetscFree(all));
  PetscCall(PetscFree2(parent, lowest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A part of a body and its free motions. */
typedef struct {
  PetscInt label, body;
  PetscReal centre[3], size; /* centre and size of its nodes, m */
  PetscInt nfree;            /* number of free motions */
  PetscReal motion[6]; /* one of them: translations; rotations about the centre times size; m */
} Part;

/* Coordinate of a node in the configuration of the tangent: the reference configuration for linear
   laws. */
static inline PetscReal coordinate(SbSpace s, const PetscScalar u[], PetscInt k)
{
  return s->node_x[k] + (s->linear ? 0. : u[k]);
}

/* Finds body, centre and size of a part. */
static PetscErrorCode measure(SbRun run, const PetscInt label[], Part *part)
{
  SbSpace s = run->model->space;
  PetscReal sum[5] = {0.}; /* sums: nodes, coordinates, squares */
  const PetscScalar *u;

  PetscFunctionBeginUser;
  part->body = run->model->nbody;
  PetscCall(VecGetArrayRead(run->state.U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (label[i] != part->label)
      continue;
    part->body = PetscMin(part->body, s->node_body[i]);
    sum[0] += 1.;
    for (PetscInt c = 0; c < 3; c++)
      sum[1 + c] += coordinate(s, u, 3 * i + c);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &part->body, 1, MPIU_INT, MPI_MIN, s->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 5, MPIU_REAL, MPI_SUM, s->comm));
  for (int c = 0; c < 3; c++)
    part->centre[c] = sum[1 + c] / sum[0];
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (label[i] != part->label)
      continue;
    for (PetscInt c = 0; c < 3; c++)
      sum[4] += PetscSqr(coordinate(s, u, 3 * i + c) - part->centre[c]);
  }
  PetscCall(VecRestoreArrayRead(run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum[4], 1, MPIU_REAL, MPI_SUM, s->comm));
  part->size = PetscSqrtReal(sum[4] / sum[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Eigenvalues of E x = value M x, n <= 6, ascending; M-orthonormal eigenvectors in E. ok: M is
   definite. */
static PetscErrorCode eigen(PetscInt n, PetscReal E[36], PetscReal M[36], PetscReal value[6],
                            PetscBool *ok)
{
  PetscBLASInt one = 1;
  PetscBLASInt six = 6;
  PetscBLASInt m;
  PetscBLASInt lwork = 64;
  PetscBLASInt info = 0;
  PetscScalar work[64];

  PetscFunctionBeginUser;
  PetscCall(PetscBLASIntCast(n, &m));
  LAPACKsygv_(&one, "V", "U", &m, E, &six, M, &six, value, work, &lwork, &info);
  *ok = (PetscBool)!info;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C: rows of contact between bodies at the state of the run, NULL without it. Collective; the
   caller destroys it. */
static PetscErrorCode find_rows(SbRun run, Mat *C)
{
  const SbModel m = run->model;
  SbConstraintRows rows = {0};
  PetscReal *length;

  PetscFunctionBeginUser;
  *C = NULL;
  if (!m->contacts.npotential)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactSetHolding(&m->contacts, run->state.U, &rows));
  PetscCall(SbConstraintRowsReserve(&rows, 1, 0));
  PetscCall(PetscMalloc1(rows.n, &length));
  PetscCall(SbConstraintRowsMatrix(&rows, m->comm, 3 * m->space->nnode_owned, length, C));
  PetscCall(PetscFree(length));
  PetscCall(SbConstraintRowsFree(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = A z, with contact between bodies: + k C^T C z. */
static PetscErrorCode multiply(SbRun run, Mat C, PetscReal k, Vec z, Vec w)
{
  Vec g, f;

  PetscFunctionBeginUser;
  PetscCall(MatMult(run->solve.system, z, w));
  if (!C)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(C, NULL, &g));
  PetscCall(VecDuplicate(w, &f));
  PetscCall(MatMult(C, z, g));
  PetscCall(MatMultTranspose(C, g, f));
  PetscCall(VecAXPY(w, k, f));
  PetscCall(VecDestroy(&f));
  PetscCall(VecDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of several free motions the message describes the first along or about an axis, if any. lost: Z -
   P Z. */
static PetscErrorCode choose_axis(SbRun run, Vec d, Mat C, Vec lost[6], Vec z[6], Part *part)
{
  PetscReal off, on, stiffness, size, most;
  Vec w;

  PetscFunctionBeginUser;
  PetscCall(VecMax(d, NULL, &most));
  PetscCall(VecDuplicate(d, &w));
  for (int k = 0; k < 6; k++) {
    PetscCall(VecNorm(lost[k], NORM_2, &off));
    PetscCall(VecNorm(z[k], NORM_2, &on));
    if (off * off > ALLOWED * on * on)
      continue;
    PetscCall(VecPointwiseMult(w, d, z[k]));
    PetscCall(VecDot(w, z[k], &size));
    PetscCall(multiply(run, C, most, z[k], w));
    PetscCall(VecDot(w, z[k], &stiffness));
    if (PetscAbsReal(stiffness) > FREE * size)
      continue;
    for (int c = 0; c < 6; c++)
      part->motion[c] = c == k;
    break;
  }
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the free motions of a part; along: displacements of one of them (may be NULL). */
static PetscErrorCode examine(SbRun run, const PetscInt label[], Vec d, Mat C, Part *part,
                              Vec along)
{
  const SbSpace s = run->model->space;
  const PetscScalar *u;
  PetscReal x[36], E[36], M[36], value[6];
  PetscReal most;
  PetscInt n = 0;
  PetscBool ok;
  Vec *Z, *z;

  PetscFunctionBeginUser;
  part->nfree = 0;
  PetscCall(VecMax(d, NULL, &most));
  PetscCall(measure(run, label, part));
  PetscCall(VecDuplicateVecs(d, 6, &Z));
  PetscCall(VecDuplicateVecs(d, 6, &z));
  PetscCall(VecGetArrayRead(run->state.U, &u));
  for (PetscInt k = 0; k < 6; k++) {
    PetscScalar *to;

    /* motion 0..2: translation along an axis, 3..5: rotation about one; z: its admissible part */
    PetscCall(VecZeroEntries(Z[k]));
    PetscCall(VecGetArray(Z[k], &to));
    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      PetscReal r[3];

      if (label[i] != part->label)
        continue;
      for (PetscInt c = 0; c < 3; c++)
        r[c] = (coordinate(s, u, 3 * i + c) - part->centre[c]) / part->size;
      if (k < 3)
        to[3 * i + k] = 1.;
      else {
        to[3 * i + (k + 1) % 3] = -r[(k + 2) % 3];
        to[3 * i + (k + 2) % 3] = r[(k + 1) % 3];
      }
    }
    PetscCall(VecRestoreArray(Z[k], &to));
    PetscCall(VecCopy(Z[k], z[k]));
    PetscCall(SbSpaceProjectAdmissible(s, z[k]));
  }
  PetscCall(VecRestoreArrayRead(run->state.U, &u));

  /* n admissible motions (problem 1), by coefficients of the six in the columns of x; Z becomes Z -
     P Z */
  for (int j = 0; j < 6; j++)
    PetscCall(VecMDot(Z[j], j + 1, Z, M + 6 * j));
  for (int k = 0; k < 6; k++)
    PetscCall(VecAXPY(Z[k], -1., z[k]));
  for (int j = 0; j < 6; j++)
    PetscCall(VecMDot(Z[j], j + 1, Z, x + 6 * j));
  PetscCall(eigen(6, x, M, value, &ok));
  while (ok && n < 6 && value[n] <= ALLOWED)
    n++;
  if (n) {
    Vec *y, w;

    /* free ones among them (problem 2): y = P Z x */
    PetscCall(VecDuplicate(d, &w));
    PetscCall(VecDuplicateVecs(d, n, &y));
    for (PetscInt j = 0; j < n; j++) {
      PetscCall(VecZeroEntries(y[j]));
      PetscCall(VecMAXPY(y[j], 6, x + 6 * j, z));
    }

    /* M = y^T D y, E = y^T A y */
    for (PetscInt j = 0; j < n; j++) {
      PetscCall(VecPointwiseMult(w, d, y[j]));
      PetscCall(VecMDot(w, j + 1, y, M + 6 * j));
      PetscCall(multiply(run, C, most, y[j], w));
      PetscCall(VecMDot(w, j + 1, y, E + 6 * j));
    }
    PetscCall(eigen(n, E, M, value, &ok));
    while (ok && part->nfree < n && PetscAbsReal(value[part->nfree]) <= FREE)
      part->nfree++;
    PetscCall(PetscInfo(
      NULL, "part of body %s: softest of %" PetscInt_FMT " motions %g of the cells' stiffness\n",
      run->model->body[part->body].name, n, ok ? (double)value[0] : -1.));

    /* coefficients of the softest one */
    for (int c = 0; c < 6 && part->nfree; c++) {
      part->motion[c] = 0.;
      for (PetscInt i = 0; i < n; i++)
        part->motion[c] += E[i] * x[6 * i + c];
    }
    PetscCall(VecDestroyVecs(n, &y));
    PetscCall(VecDestroy(&w));
  }
  if (part->nfree > 1)
    PetscCall(choose_axis(run, d, C, Z, z, part));
  if (part->nfree && along) {
    PetscCall(VecZeroEntries(along));
    PetscCall(VecMAXPY(along, 6, part->motion, z));
  }
  PetscCall(VecDestroyVecs(6, &Z));
  PetscCall(VecDestroyVecs(6, &z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* e: the direction of v with its largest component positive, small ones zero. */
static void direction(const PetscReal v[3], PetscReal e[3])
{
  const PetscReal length = PetscSqrtReal(SbDot3(v, v));
  int largest = 0;

  for (int c = 1; c < 3; c++)
    largest = PetscAbsReal(v[c]) > PetscAbsReal(v[largest]) + 1e-9 * length ? c : largest;
  for (int c = 0; c < 3; c++) {
    e[c] = (v[largest] < 0. ? -v[c] : v[c]) / length;
    if (PetscAbsReal(e[c]) < 5e-3)
      e[c] = 0.;
  }
}

/* "moving along (1, 0, 0)", or "turning about the axis along (0, 0, 1) through (x, y, z)"; the
   number of other free motions, which of several parts it is, and a hint for nodes at centroids of
   facets. */
static PetscErrorCode describe(SbRun run, const PetscInt label[], const Part *part,
                               PetscInt nbrother, size_t size, char text[])
{
  const SbSpace s = run->model->space;
  const PetscReal *t = part->motion;
  const PetscReal *w = part->motion + 3;
  const PetscReal w2 = SbDot3(w, w);
  PetscInt nfixed = 0;
  PetscReal e[3], p[3];

  PetscFunctionBeginUser;
  if (w2 <= 1e-10 * SbDot3(t, t)) {
    direction(t, e);
    SbFormat(size, text, "moving along (%.2f, %.2f, %.2f)", (double)e[0], (double)e[1],
             (double)e[2]);
  } else {
    /* point where t + w / size x (p - centre) has no component normal to w */
    direction(w, e);
    SbCross(w, t, p);
    for (int c = 0; c < 3; c++) {
      p[c] = part->centre[c] + part->size * p[c] / w2;
      if (PetscAbsReal(p[c]) < 1e-9 * part->size)
        p[c] = 0.;
    }
    SbFormat(size, text,
             "turning about the axis along (%.2f, %.2f, %.2f) through (%.4g, %.4g, %.4g) m",
             (double)e[0], (double)e[1], (double)e[2], (double)p[0], (double)p[1], (double)p[2]);
  }
  if (part->nfree > 1)
    SbAppend(size, text, " and %" PetscInt_FMT " more motion%s", part->nfree - 1,
             part->nfree > 2 ? "s" : "");
  if (nbrother > 1)
    SbAppend(size, text, " (one of its %" PetscInt_FMT " parts, around (%.4g, %.4g, %.4g) m)",
             nbrother, (double)part->centre[0], (double)part->centre[1], (double)part->centre[2]);

  /* one or two constrained facets of CR or DG leave rotations free */
  for (PetscInt k = 0; k < s->nfixed; k++)
    nfixed += s->fixed_node[k] < s->nnode_owned && label[s->fixed_node[k]] == part->label;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nfixed, 1, MPIU_INT, MPI_SUM, s->comm));
  if (nfixed && nfixed <= 2 && SbElementHasFaces(s->element[part->body]))
    SbAppend(size, text,
             "; %s is constrained at the centres of facets, here of %" PetscInt_FMT
             ": three that are not in line hold it",
             s->element[part->body]->name, nfixed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Among parts, or joined ones, the first with a free motion. */
static PetscErrorCode find_free(SbRun run, PetscBool joined, Vec d, Mat C, PetscInt *body,
                                size_t size, char motion[], Vec along)
{
  const SbSpace s = run->model->space;
  PetscInt *label, *own, *list;
  PetscInt mine = 0;
  PetscInt npart = 0;
  PetscInt nbrother = 0;
  Part part;

  PetscFunctionBeginUser;

  /* the labels of all parts are sorted, the same on all ranks */
  PetscCall(label_parts(s, joined, &label));
  PetscCall(PetscMalloc1(s->nnode_owned, &own));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    if (label[i] == s->gnode[i])
      own[mine++] = label[i];
  PetscCall(SbAllgatherv(s->comm, MPIU_INT, mine, own, &npart, &list, NULL));
  PetscCall(PetscSortInt(npart, list));
  for (PetscInt k = 0; k < npart && *body < 0; k++) {
    part.label = list[k];
    PetscCall(examine(run, label, d, C, &part, along));
    if (part.nfree)
      *body = part.body;
  }

  /* its description, with the number of parts of that body */
  if (*body >= 0) {
    for (PetscInt k = 0; k < npart; k++) {
      Part other = {.label = list[k]};

      PetscCall(measure(run, label, &other));
      nbrother += other.body == *body;
    }
    PetscCall(describe(run, label, &part, nbrother, size, motion));
    if (joined)
      SbAppend(size, motion, ", with all that effects join to it");
  }
  PetscCall(PetscFree(label));
  PetscCall(PetscFree(own));
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunFreeBody(SbRun run, PetscInt *body, size_t size, char motion[], Vec along)
{
  const SbSpace s = run->model->space;
  PetscBool diagonal;
  PetscBool coupled = (PetscBool)(s->couplings.n > 0);
  Vec d;
  Mat C;

  PetscFunctionBeginUser;
  *body = -1;
  PetscCall(MatHasOperation(run->solve.J, MATOP_GET_DIAGONAL, &diagonal));
  if (!diagonal)
    PetscFunctionReturn(PETSC_SUCCESS); /* realtime is for dynamic runs */
  PetscCall(SbSpaceCreateVec(s, &d));
  PetscCall(MatGetDiagonal(run->solve.J, d));
  PetscCall(VecAbs(d));
  PetscCall(find_rows(run, &C));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &coupled, 1, SB_MPI_BOOL, MPI_LOR, s->comm));
  for (int joined = 0; joined <= (int)coupled && *body < 0; joined++)
    PetscCall(find_free(run, (PetscBool)joined, d, C, body, size, motion, along));
  PetscCall(MatDestroy(&C));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunFreeWays(SbRun run, Vec from, Vec to, PetscReal way[], PetscReal *carried)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  const PetscInt nbody = m->nbody;
  const PetscScalar *x, *u;
  PetscReal *sum; /* of each body: displacements, nodes, prescribed ones */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(5 * nbody, &sum));
  PetscCall(PetscArrayzero(way, nbody));
  PetscCall(VecGetArrayRead(to, &x));
  PetscCall(VecGetArrayRead(from, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt b = s->node_body[i];

    for (int k = 0; k < 3; k++)
      sum[5 * b + k] += PetscRealPart(x[3 * i + k] - u[3 * i + k]);
    sum[5 * b + 3] += 1.;
    sum[5 * b + 4] += s->fixed[i] != 0;
    way[b] = PetscMax(way[b], PetscSqrtReal(SbDistance2(x + 3 * i, u + 3 * i)));
  }
  PetscCall(VecRestoreArrayRead(from, &u));
  PetscCall(VecRestoreArrayRead(to, &x));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, sum, (PetscMPIInt)(5 * nbody), MPIU_REAL, MPI_SUM, s->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, way, (PetscMPIInt)nbody, MPIU_REAL, MPI_MAX, s->comm));
  if (carried)
    *carried = 0.;
  for (PetscInt b = 0; b < nbody; b++) {
    const PetscReal *of = sum + 5 * b;

    if (of[4] > 0. && carried)
      *carried = PetscMax(*carried, way[b]);
    way[b] = of[4] > 0. ? 0. : PetscSqrtReal(SbDot3(of, of)) / of[3];
  }
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunLostBody(SbRun run, Vec X, const char **name, PetscReal *way)
{
  const SbModel m = run->model;
  PetscReal *moved;
  PetscReal carried;

  PetscFunctionBeginUser;
  *name = NULL;
  *way = 0.;
  PetscCall(PetscMalloc1(m->nbody, &moved));
  PetscCall(SbRunFreeWays(run, run->state.U, X, moved, &carried));
  for (PetscInt b = 0; b < m->nbody && !*name; b++) {
    const PetscReal size = PetscSqrtReal(SbDistance2(m->body[b].bbox, m->body[b].bbox + 3));

    if (moved[b] <= size + carried + SbContactSetObstacleWay(&m->contacts, size))
      continue;
    *name = m->body[b].name;
    *way = moved[b];
  }
  PetscCall(PetscFree(moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunTooFar(SbRun run, Vec X, PetscBool *far)
{
  const SbModel m = run->model;
  PetscReal size = 0.;
  PetscReal most;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++)
    for (int c = 0; c < 3; c++)
      size = PetscMax(size, m->body[b].bbox[3 + c] - m->body[b].bbox[c]);
  PetscCall(VecNorm(X, NORM_INFINITY, &most));
  *far = (PetscBool)(most > FAR * size);
  PetscFunctionReturn(PETSC_SUCCESS);
}
