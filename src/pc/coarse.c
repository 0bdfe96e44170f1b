/*
  The coarse space of two-level preconditioners: units by which nodes move, restriction and
  prolongation.

  Modes that vanish, as the rotations of an aggregate of one node, are the eigenvectors of the Gram
  matrix sum Z_i^T Z_i with eigenvalues near zero. Only they can make E = Z^T A Z singular
  (coarse_operator.c).
*/
#include "coarse.h"
#include <petscblaslapack.h>

#define VANISHING \
  1e-8 /* squared size of a mode, over the largest of its aggregate, that counts as zero */

PetscErrorCode SbCoarseCreate(SbSpace s, PetscInt wanted, PetscBool vertices, SbCoarse *coarse)
{
  SbCoarse c;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&c));
  *coarse = c;
  c->space = s;
  c->aggregated = (PetscBool)(wanted >= 0);
  PetscCall(PetscMalloc1(s->nnode_owned, &c->agg));
  if (c->aggregated)
    PetscCall(SbAggregate(s, wanted, &c->nagg, c->agg));
  if (!vertices || !s->edge_node)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * s->nnode + 1, &c->parent));
  for (PetscInt k = 0; k < 2 * s->nnode; k++)
    c->parent[k] = k / 2;
  for (PetscInt k = 0; k < 12 * s->mesh->ncell; k++) {
    const PetscInt edge = k / 2;
    const PetscInt i = s->edge_node[edge];

    if (i >= 0)
      c->parent[2 * i + k % 2] = s->cell_node[4 * (edge / 6) + SbTetEdge[edge % 6][k % 2]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode free_pattern(SbCoarse c)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree5(c->way, c->moved, c->unit, c->d, c->other));
  PetscCall(PetscFree3(c->centre, c->null, c->row_of));
  PetscCall(PetscFree2(c->weight, c->ia));
  PetscCall(PetscFree(c->ja));
  PetscCall(PetscFree(c->value));
  PetscCall(VecDestroy(&c->c));
  PetscCall(VecDestroy(&c->y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseDestroy(SbCoarse *coarse)
{
  SbCoarse c = *coarse;

  PetscFunctionBeginUser;
  if (!c)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(free_pattern(c));
  PetscCall(SbBlockSolverDestroy(&c->direct));
  PetscCall(PCDestroy(&c->solver));
  PetscCall(MatDestroy(&c->E));
  PetscCall(VecDestroy(&c->s));
  PetscCall(VecDestroy(&c->t));
  PetscCall(VecDestroy(&c->w));
  PetscCall(PetscFree(c->agg));
  PetscCall(PetscFree(c->parent));
  PetscCall(PetscFree(*coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* c += Z_i^T f for one node: force and torque. */
SB_INLINE void add_moments(const PetscReal d[3], const PetscReal f[3], PetscReal m[6])
{
  for (int k = 0; k < 3; k++)
    m[k] += f[k];
  m[3] += d[1] * f[2] - d[2] * f[1];
  m[4] += d[2] * f[0] - d[0] * f[2];
  m[5] += d[0] * f[1] - d[1] * f[0];
}

/* u = Z_i m for one node. */
SB_INLINE void motion(const PetscReal d[3], const PetscReal m[6], PetscReal u[3])
{
  u[0] = m[0] + m[4] * d[2] - m[5] * d[1];
  u[1] = m[1] + m[5] * d[0] - m[3] * d[2];
  u[2] = m[2] + m[3] * d[1] - m[4] * d[0];
}

/* How a node moves. Edge nodes of P2 have two vertices, other nodes are their own vertex. */
static SbWay way_of(SbCoarse c, PetscInt i, const uint8_t contact[])
{
  const SbSpace s = c->space;
  const PetscInt *v = c->parent ? c->parent + 2 * i : NULL;
  const PetscBool edge = (PetscBool)(v && v[0] != v[1]);
  const PetscBool p2_vertex = (PetscBool)(v && s->element[s->node_body[i]]->nodes_per[1]);

  if ((contact && contact[i]) || (c->aggregated && c->agg[i] < 0))
    return SB_ITSELF;
  if (!c->aggregated)
    return edge ? SB_MEAN : SB_ITSELF;

  /* among aggregates, no node moves by vertices of other ranks */
  if (edge)
    return v[0] < s->nnode_owned && v[1] < s->nnode_owned ? SB_MEAN : SB_ITSELF;
  return p2_vertex ? SB_ITSELF : SB_MEMBER;
}

/* The units of own nodes, by their numbers over all ranks; the nodes' relative positions. */
static PetscErrorCode find_units(SbCoarse c, const uint8_t contact[])
{
  const SbSpace s = c->space;
  const PetscInt n = s->nnode_owned;
  PetscReal *number;
  PetscInt *count;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc5(c->nall, &c->way, c->nall, &c->moved, 2 * c->nall, &c->unit, 3 * c->nall,
                         &c->d, 2 * c->nall, &c->other));
  PetscCall(PetscCalloc3(4 * c->nagg, &c->centre, 36 * c->nagg, &c->null, c->nagg, &c->row_of));
  PetscCall(PetscCalloc2(c->nagg, &count, 3 * s->nnode, &number));

  /* block rows of nodes that move by themselves, then of aggregates, which lack nodes in contact;
     centres */
  c->n = 0;
  for (PetscInt i = 0; i < n; i++) {
    c->way[i] = (uint8_t)way_of(c, i, contact);
    c->unit[2 * i] = c->way[i] == SB_ITSELF && (!c->aggregated || c->agg[i] >= 0) ? c->n++ : -1;
    c->unit[2 * i + 1] = -1;
    if (c->way[i] != SB_MEMBER)
      continue;
    for (int k = 0; k < 3; k++)
      c->centre[4 * c->agg[i] + k] += s->node_x[3 * i + k];
    count[c->agg[i]]++;
  }
  for (PetscInt a = 0; a < c->nagg; a++) {
    for (int k = 0; k < 3; k++)
      c->centre[4 * a + k] /= (PetscReal)PetscMax(1, count[a]);
    c->row_of[a] = count[a] ? c->n : -1;
    c->n += count[a] ? 2 : 0;
  }
  PetscCallMPI(MPI_Scan(&c->n, &c->first, 1, MPIU_INT, MPI_SUM, s->comm));
  PetscCallMPI(MPI_Allreduce(&c->n, &c->N, 1, MPIU_INT, MPI_SUM, s->comm));
  c->first -= c->n;
  PetscCall(PetscMalloc2(c->n, &c->weight, c->n + 1, &c->ia));
  for (PetscInt k = 0; k < c->n; k++)
    c->weight[k] = 1.;

  /* their radii; positions over them */
  for (PetscInt k = 0; k < 3 * n; k++) {
    const PetscInt a = c->way[k / 3] == SB_MEMBER ? c->agg[k / 3] : -1;

    c->d[k] = a < 0 ? 0. : s->node_x[k] - c->centre[4 * a + k % 3];
    if (a >= 0)
      c->centre[4 * a + 3] += PetscSqr(c->d[k]) / (PetscReal)count[a];
  }
  for (PetscInt a = 0; a < c->nagg; a++) {
    c->centre[4 * a + 3] = count[a] > 1 ? PetscSqrtReal(c->centre[4 * a + 3]) : 0.;
    if (count[a])
      c->weight[c->row_of[a]] = c->weight[c->row_of[a] + 1] = 1. / (PetscReal)count[a];
  }
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal radius = c->way[i] == SB_MEMBER ? c->centre[4 * c->agg[i] + 3] : 0.;

    for (int k = 0; k < 3; k++)
      c->d[3 * i + k] = radius > 0. ? c->d[3 * i + k] / radius : 0.;
    if (c->way[i] == SB_MEMBER)
      c->unit[2 * i] = c->row_of[c->agg[i]];
    if (c->unit[2 * i] >= 0)
      c->unit[2 * i] += c->first;
    number[3 * i] = (PetscReal)c->unit[2 * i];
  }

  /* edge nodes have those of their vertices */
  if (c->parent)
    PetscCall(SbSpaceUpdateGhosts(s, number));
  for (PetscInt i = 0; i < n; i++) {
    c->moved[i] = 0;
    for (int q = 0; q < 2 && c->way[i] == SB_MEAN; q++) {
      const PetscInt v = c->parent[2 * i + q];

      c->unit[2 * i + q] = (PetscInt)number[3 * v];
      c->moved[i] |= (uint8_t)((7 & ~(s->fixed[i] | s->fixed[v])) << (3 * q));
    }
  }
  PetscCall(PetscFree2(count, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modes that vanish: eigenvectors of the aggregates' Gram matrices. */
static PetscErrorCode find_vanishing(SbCoarse c)
{
  const SbSpace s = c->space;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (int m = 0; m < 6 && c->way[i] == SB_MEMBER; m++) {
      PetscReal unit[6] = {0.};
      PetscReal u[3];

      unit[m] = 1.;
      motion(c->d + 3 * i, unit, u);
      for (int q = 0; q < 3; q++)
        u[q] = s->fixed[i] & (1 << q) ? 0. : u[q];
      add_moments(c->d + 3 * i, u, c->null + 36 * c->agg[i] + 6 * m);
    }
  }
  for (PetscInt a = 0; a < c->nagg; a++) {
    PetscReal gram[36], eigen[6], work[64];
    PetscReal *projector = c->null + 36 * a;
    PetscBLASInt six = 6;
    PetscBLASInt nwork = 64;
    PetscBLASInt info;

    PetscCall(PetscArraycpy(gram, projector, 36));
    PetscCall(PetscArrayzero(projector, 36));
    PetscCallBLAS("LAPACKsyev",
                  LAPACKsyev_("V", "U", &six, gram, &six, eigen, work, &nwork, &info));
    PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev failed with %d", (int)info);
    for (int v = 0; v < 6 && eigen[v] <= VANISHING * eigen[5]; v++)
      for (int e = 0; e < 36; e++)
        projector[e] += gram[6 * v + e / 6] * gram[6 * v + e % 6];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The units of the ghosts in the rows of A, from their owners; then units are renumbered, own ones
   first. */
static PetscErrorCode find_ghosts(SbCoarse c, const PetscInt ghost[])
{
  const PetscInt n = c->space->nnode_owned;
  const PetscInt nghost = c->nall - n;
  PetscReal(*share)[6];
  Vec all;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(c->nall, &share));
  for (PetscInt i = 0; i < n; i++) {
    for (int q = 0; q < 2; q++)
      share[i][q] = (PetscReal)c->unit[2 * i + q];
    share[i][2] = (PetscReal)(64 * c->way[i] + c->moved[i]);
    for (int q = 0; q < 3; q++)
      share[i][3 + q] = c->d[3 * i + q];
  }
  if (c->space->ghosted) {
    PetscCall(VecCreateGhostBlockWithArray(c->space->comm, 6, 6 * n, PETSC_DECIDE, nghost, ghost,
                                           share[0], &all));
    PetscCall(VecGhostUpdateBegin(all, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGhostUpdateEnd(all, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecDestroy(&all));
  }
  for (PetscInt i = n; i < c->nall; i++) {
    for (int q = 0; q < 2; q++)
      c->unit[2 * i + q] = (PetscInt)share[i][q];
    c->way[i] = (uint8_t)((PetscInt)share[i][2] / 64);
    c->moved[i] = (uint8_t)((PetscInt)share[i][2] % 64);
    for (int q = 0; q < 3; q++)
      c->d[3 * i + q] = share[i][3 + q];
  }
  PetscCall(PetscFree(share));

  /* block rows of other ranks, ascending */
  c->nother = 0;
  for (PetscInt k = 0; k < 2 * c->nall; k++) {
    const PetscInt u = c->unit[k];

    if (u >= 0 && (u < c->first || u >= c->first + c->n))
      c->other[c->nother++] = u;
  }
  PetscCall(PetscSortRemoveDupsInt(&c->nother, c->other));
  for (PetscInt k = 0; k < 2 * c->nall; k++) {
    if (c->unit[k] >= c->first && c->unit[k] < c->first + c->n)
      c->unit[k] -= c->first;
    else if (c->unit[k] >= 0) {
      PetscCall(PetscFindInt(c->unit[k], c->nother, c->other, &c->unit[k]));
      c->unit[k] += c->n;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of a unit have the units of its nodes' neighbours; ia, column: rows of A, own nodes and
   ghosts. */
static PetscErrorCode find_pattern(SbCoarse c, const PetscInt ia[], const PetscInt column[])
{
  PetscInt *start, *member, *mark;
  PetscInt nz = 0;
  PetscInt size = 0;

  PetscFunctionBeginUser;

  /* nodes by unit; each is listed for each of its units */
  PetscCall(SbBucketByKey(2 * c->space->nnode_owned, c->unit, c->n, &start, &member));
  PetscCall(PetscCalloc1(c->n + c->nother, &mark));
  for (PetscInt u = 0; u < c->n; u++) {
    const PetscInt stamp = 1 + u;

    c->ia[u] = nz;
    for (PetscInt m = start[u]; m < start[u + 1]; m++) {
      for (PetscInt k = 2 * ia[member[m] / 2]; k < 2 * ia[member[m] / 2 + 1]; k++) {
        const PetscInt v = 2 * column[k / 2] + k % 2;
        const PetscInt b = c->unit[v];

        if (b < 0 || mark[b] == stamp)
          continue;
        mark[b] = stamp;
        PetscCall(SbReserve(nz + 2, sizeof(*c->ja), &size, &c->ja));
        for (int q = 0; q < (c->way[v / 2] == SB_MEMBER ? 2 : 1); q++)
          c->ja[nz++] = (b < c->n ? c->first + b : c->other[b - c->n]) + q;
      }
    }
    PetscCall(PetscSortInt(nz - c->ia[u], c->ja + c->ia[u]));

    /* the rotation of an aggregate has the members of its translation */
    if (start[u + 1] > start[u] && c->way[member[start[u]] / 2] == SB_MEMBER) {
      const PetscInt length = nz - c->ia[u];

      PetscCall(SbReserve(nz + length, sizeof(*c->ja), &size, &c->ja));
      PetscCall(PetscArraycpy(c->ja + nz, c->ja + nz - length, length));
      c->ia[++u] = nz;
      nz += length;
    }
  }
  c->ia[c->n] = nz;
  PetscCall(PetscMalloc1(9 * (size_t)nz, &c->value));
  PetscCall(PetscFree(mark));
  PetscCall(PetscFree(member));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseSetPattern(SbCoarse c, Mat A, const SbContactRows *rows)
{
  const SbSpace s = c->space;
  const PetscInt n = s->nnode_owned;
  const PetscInt *ghost = NULL;
  PetscInt *ia = NULL;
  PetscInt *ja = NULL;
  PetscInt *column;
  PetscInt nghost = 0;
  Mat far;

  PetscFunctionBeginUser;
  PetscCall(free_pattern(c));
  if (s->ghosted) {
    PetscCall(MatMPIBAIJGetSeqBAIJ(A, NULL, &far, &ghost));
    PetscCall(MatGetLocalSize(far, NULL, &nghost));
  }
  c->nall = n + nghost / 3;
  PetscCall(find_units(c, rows ? rows->contact : NULL));
  PetscCall(find_vanishing(c));
  PetscCall(find_ghosts(c, ghost));

  /* the rows of A with columns of own nodes and ghosts */
  if (rows) {
    ia = rows->ia;
    ja = rows->ja;
  } else
    PetscCall(SbSpaceGetGraph(s, &ia, &ja));
  PetscCall(PetscMalloc1(ia[n], &column));
  for (PetscInt k = 0; k < ia[n]; k++) {
    column[k] = ja[k] - s->gnode_start;
    if (column[k] >= 0 && column[k] < n)
      continue;
    PetscCall(PetscFindInt(ja[k], nghost / 3, ghost, &column[k]));
    column[k] += n;
  }
  c->widest = 1;
  for (PetscInt i = 0; i < n; i++)
    c->widest = PetscMax(c->widest, 2 * (ia[i + 1] - ia[i]));
  PetscCall(find_pattern(c, ia, column));
  PetscCall(PetscFree(column));
  if (!rows)
    PetscCall(PetscFree2(ia, ja));
  c->changed = PETSC_TRUE;

  /* vectors, with ghosts where nodes move by units of other ranks */
  c->wide = (PetscBool)(!c->aggregated && s->ghosted);
  if (s->ghosted)
    PetscCall(VecCreateGhostBlock(s->comm, 3, 3 * c->n, PETSC_DECIDE, c->wide ? c->nother : 0,
                                  c->other, &c->c));
  else
    PetscCall(VecCreateSeq(s->comm, 3 * c->n, &c->c));
  PetscCall(VecDuplicate(c->c, &c->y));
  if (c->s)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(A, &c->s, &c->t));
  PetscCall(VecDuplicate(c->s, &c->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseRestrict(SbCoarse c, Vec R, PetscReal *share)
{
  const SbSpace s = c->space;
  PetscReal norm2[2] = {0., 0.}; /* squared norm of c, weighted; of r on the units */
  const PetscScalar *r;
  PetscScalar *m;
  Vec to;

  PetscFunctionBeginUser;
  PetscCall(VecGhostGetLocalForm(c->c, &to));
  PetscCall(VecZeroEntries(to));
  PetscCall(VecGetArray(to, &m));
  PetscCall(VecGetArrayRead(R, &r));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt *unit = c->unit + 2 * i;
    PetscReal f[3];
    PetscReal moment[6] = {0.};

    for (int e = 0; e < 6 && c->way[i] == SB_MEAN; e++)
      if (unit[e / 3] >= 0 && c->moved[i] & (1 << e))
        m[3 * unit[e / 3] + e % 3] += 0.5 * r[3 * i + e % 3];
    if (unit[0] < 0 || c->way[i] == SB_MEAN)
      continue;
    for (int q = 0; q < 3; q++) {
      f[q] = c->way[i] == SB_MEMBER && s->fixed[i] & (1 << q) ? 0. : r[3 * i + q];
      norm2[1] += f[q] * f[q];
    }
    add_moments(c->d + 3 * i, f, moment);
    for (int q = 0; q < (c->way[i] == SB_MEMBER ? 6 : 3); q++)
      m[3 * unit[0] + q] += moment[q];
  }
  for (PetscInt k = 0; k < 3 * c->n; k++)
    norm2[0] += PetscSqr(m[k]) * c->weight[k / 3];
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscCall(VecRestoreArray(to, &m));
  PetscCall(VecGhostRestoreLocalForm(c->c, &to));
  PetscCall(VecGhostUpdateBegin(c->c, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecGhostUpdateEnd(c->c, ADD_VALUES, SCATTER_REVERSE));
  if (!share)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, norm2, 2, MPIU_REAL, MPI_SUM, s->comm));
  *share = norm2[1] > 0. ? PetscSqrtReal(norm2[0] / norm2[1]) : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseAdd(SbCoarse c, Vec Z)
{
  const SbSpace s = c->space;
  const PetscScalar *x;
  PetscScalar *z;
  Vec from;

  PetscFunctionBeginUser;

  /* without a solver, as where the first matrix is not finite: its owner reports that */
  if (!c->N || (!c->direct && !c->ready))
    PetscFunctionReturn(PETSC_SUCCESS);
  if (c->direct)
    PetscCall(SbBlockSolverSolve(c->direct, c->c, c->y));
  else
    PetscCall(PCApply(c->solver, c->c, c->y));
  PetscCall(VecGhostUpdateBegin(c->y, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGhostUpdateEnd(c->y, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGhostGetLocalForm(c->y, &from));
  PetscCall(VecGetArrayRead(from, &x));
  PetscCall(VecGetArray(Z, &z));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt *unit = c->unit + 2 * i;
    PetscReal u[3];

    for (int e = 0; e < 6 && c->way[i] == SB_MEAN; e++)
      if (unit[e / 3] >= 0 && c->moved[i] & (1 << e))
        z[3 * i + e % 3] += 0.5 * x[3 * unit[e / 3] + e % 3];
    for (int q = 0; q < 3 && unit[0] >= 0 && c->way[i] == SB_ITSELF; q++)
      z[3 * i + q] += x[3 * unit[0] + q];
    if (c->way[i] != SB_MEMBER)
      continue;
    motion(c->d + 3 * i, x + 3 * unit[0], u);
    for (int q = 0; q < 3; q++)
      z[3 * i + q] += s->fixed[i] & (1 << q) ? 0. : u[q];
  }
  PetscCall(VecRestoreArray(Z, &z));
  PetscCall(VecRestoreArrayRead(from, &x));
  PetscCall(VecGhostRestoreLocalForm(c->y, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseCorrect(SbCoarse c, Mat A, Vec b, Vec x)
{
  PetscFunctionBeginUser;
  PetscCall(MatMult(A, x, c->t));
  PetscCall(VecAYPX(c->t, -1., b));
  PetscCall(SbCoarseRestrict(c, c->t, NULL));
  PetscCall(SbCoarseAdd(c, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
