/*
  Two-level preconditioner for K + C: the tangent of the bodies and the contact stiffness, which may be a million times larger.

      P^-1 = Q + (1 - Q A) M (1 - A Q),   Q = Z E^-1 Z^T,   E = Z^T A Z,   A = K + C

  Z contains the unknowns of the nodes in contact, and six rigid-body modes for each aggregate of the other nodes: one coarse space holds the stiff contact
  modes and the slow modes. A coarse space of only one kind takes five to twenty times the iterations. M is the Chebyshev iteration of degree
  DEGREE with the block diagonal D of A, on the nodes without contact, where A is K. There the eigenvalues of D^-1 A are at most four, the number of nodes of a cell (Wathen, "Realistic eigenvalue
  bounds for the Galerkin mass matrix", 1987, whose argument holds for sums of any semi-definite matrices; for the face terms, c [P, -P; -P, P] with P = 1 - 1/3 (1, 1, 1) (1, 1, 1)^T
  for jumps and c [1, -1; -1, 1] for their mean, the bounds are three and two), so no eigenvalue is estimated, and M depends neither on the number of ranks nor on the contact stiffness. After an initial guess with Z^T r = 0 the residuals keep this property, and the factor 1 - A Q is left out, as in pc_coarse.c.

  For P2 bodies aggregates are too coarse a space, and D^-1 A has eigenvalues above four near nu = 1/2. Bodies with up to VERTICES vertices have the vertices in Z instead of
  aggregates: an edge node without contact moves by the mean of its two vertices if its rank owns them, otherwise it is in Z itself. Before and after the coarse correction a
  Gauss-Seidel sweep over all rows smooths, as in pc_p_multigrid.c, at half the cost of a product with A; any initial guess is allowed.

  E consists of 3x3 blocks: one block row for a node in contact or a vertex, two for an aggregate, translation and rotation. One rank factors it (block_solver.c). Modes that vanish
  on the nodes of an aggregate without contact get the mean diagonal, as in coarse_operator.c.
*/
#include "coarse.h"
#include "contact_coarse.h"
#include "gauss_seidel.h"
#include "solver_impl.h"
#include <petscblaslapack.h>

#define NODES 60        /* nodes per aggregate */
#define NODES_FACES 15  /* the same for nodes at faces: two per tet, P1 has a fifth */
#define AGGREGATES 1500 /* largest number of aggregates, unless each has NODES nodes: one rank factors E */
#define LARGEST 4.      /* upper bound of the eigenvalues of D^-1 A */
#define RANGE 8.        /* ratio of the largest to the smallest eigenvalue that the smoother reduces */
#define DEGREE 2        /* degree of the smoother's polynomial */
#define IN_SPAN 1e-5    /* relative size of the residual in the span of Z that counts as rounding */
#define VERTICES 16000  /* largest number of P2 vertices in Z: larger systems were not measured */
#define VANISHING 1e-8  /* squared size of a mode over that of the largest one of its aggregate */

/* Motion of a node by Z: as a member of an aggregate; by unknowns of its own; by the mean of two vertices. */
typedef enum { MEMBER, ITSELF, MEAN } Way;

typedef struct {
  SbSpace space;
  const SbContactRows *rows;
  PetscInt *parent; /* [nnode][2] end vertices of an edge node (SbSpaceEdgeParents()); NULL: P2 aggregated */
  uint8_t *vertex;  /* [nnode] the node is a vertex of a P2 body; NULL likewise */
  PetscInt nagg, *body; /* number of aggregates; [n] aggregate of each own node, -1: fully prescribed */
  PetscBool stale[2];   /* the values, the pattern are out of date */
  PetscBool ok;
  /* rows of the block matrix A: */
  PetscInt n, nghost, *ghost,
    *column; /* number of own nodes; number and [nghost] global numbers of the other nodes in the rows, ascending; [ia[n]] columns: own node or n + ghost */
  VecScatter scatter;
  Vec local;      /* [nghost][3] values at ghosts */
  PetscInt *unit; /* [n+nghost][2] global block rows in E by which the node moves, -1: none; two for MEAN */
  uint8_t *way;   /* [n+nghost] Way of each node */
  uint8_t *moved; /* [n+nghost] for MEAN: bits of the components that move by the two vertices */
  PetscReal *d;   /* [n+nghost][3] position relative to the centre of its aggregate, over its radius */
  PetscInt nrow, first; /* number of own block rows of E, global number of the first one */
  PetscInt *ia, *ja;    /* pattern of E */
  PetscReal *value;     /* [ia[nrow]][9] blocks of E */
  int stride;           /* places per block in slot: 4 with parents, else 1 */
  PetscInt *slot;       /* [rows->ia[n]][stride] position in E's row of the block that a block of A adds to */
  PetscReal *null;      /* [nagg][36] projector onto the modes that vanish */
  PetscInt *row_of;     /* [nagg] first own row in E, -1: it has no nodes without contact */
  PetscReal *weight;    /* [nrow] 1 / number of nodes of the row's aggregate, vertex or node */
  SbBlockSolver solver;
  PetscReal *inverse; /* [n][9] inverse diagonal blocks of A; without parents zero at nodes in contact */
  PetscReal *extra;   /* [n][3] diagonal added in the sweeps (gauss_seidel.c) */
  PetscReal *c;       /* [nrow][3] coarse vector */
  Vec p, s, t, w;
} Contact;

/* ------------------------------------------------------------------ set-up of the pattern */

static PetscErrorCode free_pattern(Contact *p)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(p->ghost, p->column));
  PetscCall(VecScatterDestroy(&p->scatter));
  PetscCall(VecDestroy(&p->local));
  PetscCall(PetscFree4(p->unit, p->way, p->moved, p->d));
  PetscCall(PetscFree2(p->ia, p->slot));
  PetscCall(PetscFree2(p->ja, p->value));
  PetscCall(PetscFree2(p->null, p->row_of));
  PetscCall(PetscFree4(p->inverse, p->extra, p->c, p->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the local numbers of the columns, and creates the scatter of ghost values. */
static PetscErrorCode find_ghosts(Contact *p)
{
  const SbContactRows *r = p->rows;
  const PetscInt first = p->space->gnode_start, nnz = r->ia[r->n];
  PetscInt *all, n = 0;
  IS is;

  PetscFunctionBeginUser;
  p->n = r->n;
  PetscCall(PetscMalloc1(nnz, &all));
  for (PetscInt k = 0; k < nnz; k++) {
    if (r->ja[k] < first || r->ja[k] >= first + r->n) all[n++] = r->ja[k];
  }
  PetscCall(PetscSortRemoveDupsInt(&n, all));
  p->nghost = n;
  PetscCall(PetscMalloc2(n, &p->ghost, nnz, &p->column));
  PetscCall(PetscArraycpy(p->ghost, all, n));
  PetscCall(PetscFree(all));
  for (PetscInt k = 0; k < nnz; k++) {
    if (r->ja[k] >= first && r->ja[k] < first + r->n)
      p->column[k] = r->ja[k] - first;
    else {
      PetscCall(PetscFindInt(r->ja[k], n, p->ghost, &p->column[k]));
      p->column[k] += r->n;
    }
  }
  PetscCall(ISCreateBlock(PETSC_COMM_SELF, 3, n, p->ghost, PETSC_USE_POINTER, &is));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 3 * n, &p->local));
  PetscCall(VecScatterCreate(p->s, is, p->local, NULL, &p->scatter));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the ghosts' values x[n+nghost][3] from their owners. */
static PetscErrorCode update_ghosts(Contact *p, PetscReal x[])
{
  const PetscScalar *ghost;
  PetscScalar *own;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(p->s, &own));
  PetscCall(PetscArraycpy(own, x, 3 * p->n));
  PetscCall(VecRestoreArray(p->s, &own));
  PetscCall(VecScatterBegin(p->scatter, p->s, p->local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(p->scatter, p->s, p->local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(p->local, &ghost));
  PetscCall(PetscArraycpy(x + 3 * p->n, ghost, 3 * p->nghost));
  PetscCall(VecRestoreArrayRead(p->local, &ghost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motion of an own node by Z; a fully prescribed node has no rows in E. */
static Way way_of(const Contact *p, PetscInt i)
{
  const PetscInt *v = p->parent ? p->parent + 2 * i : NULL;

  if (p->rows->contact[i] || p->body[i] < 0) return ITSELF;
  if (v && v[0] != v[1]) return v[0] < p->n && v[1] < p->n ? MEAN : ITSELF;
  return v && p->vertex[i] ? ITSELF : MEMBER;
}

/* Numbers the rows of E for nodes in contact, vertices and aggregates; finds the nodes' relative positions and the modes that vanish. */
static PetscErrorCode find_units(Contact *p)
{
  const SbSpace s = p->space;
  const PetscInt n = p->n, nall = n + p->nghost;
  PetscReal *centre, *share;
  PetscInt *count, total;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(2 * nall, &p->unit, nall, &p->way, nall, &p->moved, 3 * nall, &p->d));
  PetscCall(PetscCalloc2(36 * p->nagg, &p->null, p->nagg, &p->row_of));
  PetscCall(PetscCalloc2(4 * p->nagg, &centre, p->nagg, &count));

  /* centre and radius of each aggregate without its nodes in contact */
  for (PetscInt i = 0; i < n; i++) {
    p->way[i] = (uint8_t)way_of(p, i);
    if (p->way[i] != MEMBER) continue;
    for (int k = 0; k < 3; k++) centre[4 * p->body[i] + k] += s->node_x[3 * i + k];
    count[p->body[i]]++;
  }
  for (PetscInt a = 0; a < p->nagg; a++) {
    for (int k = 0; k < 3; k++) centre[4 * a + k] /= (PetscReal)PetscMax(1, count[a]);
  }
  for (PetscInt i = 0; i < n; i++) {
    for (int k = 0; k < 3; k++) {
      p->d[3 * i + k] = p->way[i] == MEMBER ? s->node_x[3 * i + k] - centre[4 * p->body[i] + k] : 0.;
      if (p->way[i] == MEMBER)
        centre[4 * p->body[i] + 3] += PetscSqr(p->d[3 * i + k]) / (PetscReal)count[p->body[i]];
    }
  }

  /* block rows */
  p->nrow = 0;
  for (PetscInt i = 0; i < n; i++) {
    p->unit[2 * i] = p->unit[2 * i + 1] = -1;
    if (p->way[i] == ITSELF && (p->rows->contact[i] || p->body[i] >= 0)) p->unit[2 * i] = p->nrow++;
  }
  for (PetscInt a = 0; a < p->nagg; a++) {
    p->row_of[a] = count[a] ? p->nrow : -1;
    if (count[a]) p->nrow += 2;
  }
  PetscCallMPI(MPI_Scan(&p->nrow, &p->first, 1, MPIU_INT, MPI_SUM, s->comm));
  p->first -= p->nrow;
  PetscCall(PetscMalloc4(9 * n, &p->inverse, p->parent ? 3 * n : 0, &p->extra, 3 * p->nrow, &p->c, p->nrow,
                         &p->weight));
  for (PetscInt k = 0; k < p->nrow; k++) p->weight[k] = 1.;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt a = p->body[i];

    if (p->way[i] == MEMBER) {
      const PetscReal radius = PetscSqrtReal(centre[4 * a + 3]);

      p->unit[2 * i] = p->row_of[a];
      p->weight[p->row_of[a]] = p->weight[p->row_of[a] + 1] = 1. / (PetscReal)count[a];
      for (int k = 0; k < 3; k++) p->d[3 * i + k] = count[a] > 1 ? p->d[3 * i + k] / radius : 0.;
    }
    p->moved[i] = 0;
    for (int q = 0; q < 2 && p->way[i] == MEAN; q++) {
      const PetscInt v = p->parent[2 * i + q];

      p->unit[2 * i + q] = p->unit[2 * v];
      p->moved[i] |= (uint8_t)((7 & ~(s->fixed[i] | s->fixed[v])) << (3 * q));
    }
  }
  for (PetscInt k = 0; k < 2 * n; k++) {
    if (p->unit[k] >= 0) p->unit[k] += p->first;
  }

  /* modes that vanish: eigenvectors of the Gram matrix */
  for (PetscInt i = 0; i < n; i++) {
    if (p->way[i] != MEMBER) continue;
    for (int m = 0; m < 6; m++) {
      PetscReal unit[6] = {0.}, u[3];

      unit[m] = 1.;
      SbCoarseMotion(p->d + 3 * i, unit, u);
      for (int q = 0; q < 3; q++) u[q] = s->fixed[i] & (1 << q) ? 0. : u[q];
      SbCoarseAddMoments(p->d + 3 * i, u, p->null + 36 * p->body[i] + 6 * m);
    }
  }
  for (PetscInt a = 0; a < p->nagg; a++) {
    PetscReal gram[36], eigen[6], work[64], *projector = p->null + 36 * a;
    PetscBLASInt six = 6, nwork = 64, info;

    if (!count[a]) continue;
    PetscCall(PetscArraycpy(gram, projector, 36));
    PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &six, gram, &six, eigen, work, &nwork, &info));
    PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev failed with %d", (int)info);
    PetscCall(PetscArrayzero(projector, 36));
    for (int v = 0; v < 6 && eigen[v] <= VANISHING * eigen[5]; v++) {
      for (int e = 0; e < 36; e++) projector[e] += gram[6 * v + e / 6] * gram[6 * v + e % 6];
    }
  }
  PetscCall(PetscFree2(centre, count));

  /* block rows and Way of the ghosts */
  PetscCall(PetscMalloc1(3 * nall, &share));
  for (PetscInt i = 0; i < n; i++) {
    share[3 * i] = (PetscReal)p->unit[2 * i];
    share[3 * i + 1] = (PetscReal)p->unit[2 * i + 1];
    share[3 * i + 2] = (PetscReal)(64 * p->way[i] + p->moved[i]);
  }
  PetscCall(update_ghosts(p, share));
  PetscCall(update_ghosts(p, p->d));
  for (PetscInt i = n; i < nall; i++) {
    for (int q = 0; q < 2; q++) p->unit[2 * i + q] = (PetscInt)share[3 * i + q];
    p->way[i] = (uint8_t)((PetscInt)share[3 * i + 2] / 64);
    p->moved[i] = (uint8_t)((PetscInt)share[3 * i + 2] % 64);
  }
  PetscCall(PetscFree(share));
  PetscCallMPI(MPI_Allreduce(&p->nrow, &total, 1, MPIU_INT, MPI_SUM, s->comm));
  p->ok = (PetscBool)(total > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pattern of E, and the block of E to which each block of A contributes. */
static PetscErrorCode find_pattern(Contact *p)
{
  const SbContactRows *r = p->rows;
  PetscInt *start, *member, *mark, *place, lowest = PETSC_MAX_INT, highest = 0, nz = 0;
  const int stride = p->stride;

  PetscFunctionBeginUser;
  /* nodes by block row; each is listed for each of its rows */
  PetscCall(PetscCalloc1(p->nrow + 2, &start));
  PetscCall(PetscMalloc1(2 * p->n, &member));
  for (PetscInt m = 0; m < 2 * p->n; m++) {
    if (p->unit[m] >= 0) start[p->unit[m] - p->first + 2]++;
  }
  for (PetscInt u = 0; u < p->nrow; u++) start[u + 2] += start[u + 1];
  for (PetscInt m = 0; m < 2 * p->n; m++) {
    if (p->unit[m] >= 0) member[start[p->unit[m] - p->first + 1]++] = m;
  }
  for (PetscInt m = 0; m < 2 * (p->n + p->nghost); m++) {
    if (p->unit[m] < 0) continue;
    lowest = PetscMin(lowest, p->unit[m]);
    highest = PetscMax(highest, p->unit[m] + 1);
  }
  if (lowest > highest) lowest = highest;
  PetscCall(PetscMalloc2(highest - lowest, &mark, highest - lowest, &place));
  PetscCall(PetscMalloc2(p->nrow + 1, &p->ia, stride * (size_t)r->ia[p->n], &p->slot));

  /* first pass: count; second pass: fill */
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt b = 0; b < highest - lowest; b++) mark[b] = -1;
    nz = 0;
    for (PetscInt u = 0; u < p->nrow; u++) {
      PetscInt length = 0;

      p->ia[u] = nz;
      for (PetscInt m = start[u]; m < start[u + 1]; m++) {
        for (PetscInt k = r->ia[member[m] / 2]; k < r->ia[member[m] / 2 + 1]; k++) {
          const PetscInt j = p->column[k];
          PetscInt *slot = p->slot + stride * (size_t)k + 2 * (member[m] % 2);

          for (int v = 0; v < (p->way[j] == MEAN ? 2 : 1); v++) {
            const PetscInt b = p->unit[2 * j + v] - lowest;

            slot[v] = -1;
            if (p->unit[2 * j + v] < 0) continue;
            if (mark[b] != u) {
              mark[b] = u;
              place[b] = length;
              for (int q = 0; q < (p->way[j] == MEMBER ? 2 : 1); q++, length++) {
                if (pass) p->ja[nz + length] = p->unit[2 * j + v] + q;
              }
            }
            slot[v] = place[b];
          }
        }
      }
      nz += length;
      /* the rotation row of an aggregate shares the members of its translation row */
      if (start[u + 1] > start[u] && p->way[member[start[u]] / 2] == MEMBER) {
        p->ia[u + 1] = nz;
        for (PetscInt q = 0; q < length && pass; q++) p->ja[nz + q] = p->ja[nz - length + q];
        nz += length;
        u++;
      }
    }
    p->ia[p->nrow] = nz;
    if (!pass) PetscCall(PetscMalloc2(nz, &p->ja, 9 * (size_t)nz, &p->value));
  }
  PetscCall(PetscFree2(mark, place));
  PetscCall(PetscFree(member));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ set-up of the values */

/* B = A^-1 of a symmetric positive definite 3x3 block; false if A is not positive definite. */
static PetscBool invert(const PetscReal A[9], PetscReal B[9])
{
  const PetscReal a = A[0], b = 0.5 * (A[1] + A[3]), c = 0.5 * (A[2] + A[6]), d = A[4],
                  e = 0.5 * (A[5] + A[7]), f = A[8];
  const PetscReal m0 = d * f - e * e, m1 = c * e - b * f, m2 = b * e - c * d, det = a * m0 + b * m1 + c * m2;

  if (!(a > 0. && a * d - b * b > 0. && det > 0.)) return PETSC_FALSE;
  B[0] = m0 / det;
  B[1] = B[3] = m1 / det;
  B[2] = B[6] = m2 / det;
  B[4] = (a * f - c * c) / det;
  B[5] = B[7] = (b * c - a * e) / det;
  B[8] = (a * d - b * b) / det;
  return PETSC_TRUE;
}

/* E += Z_i^T A_ij Z_j for a block of A. */
static inline void add_block(const Contact *p, PetscInt i, PetscInt j, const PetscReal A[9], PetscReal *to[2])
{
  const PetscReal *d = p->d + 3 * j, *x = p->d + 3 * i;
  PetscReal T[18];

  if (p->way[i] != MEMBER && p->way[j] != MEMBER) {
    for (int e = 0; e < 9; e++) to[0][e] += A[e];
    return;
  }
  /* moments of the columns about the aggregate's centre */
  for (int q = 0; q < 3; q++) {
    const PetscReal *a = A + 3 * q;

    for (int c = 0; c < 3; c++) T[3 * q + c] = a[c];
    T[9 + 3 * q] = a[2] * d[1] - a[1] * d[2];
    T[9 + 3 * q + 1] = a[0] * d[2] - a[2] * d[0];
    T[9 + 3 * q + 2] = a[1] * d[0] - a[0] * d[1];
  }
  for (int half = 0; half < (p->way[j] == MEMBER ? 2 : 1); half++) {
    const PetscReal *B = T + 9 * half;

    for (int e = 0; e < 9; e++) to[0][9 * half + e] += B[e];
    if (p->way[i] != MEMBER) continue;
    for (int c = 0; c < 3; c++) {
      to[1][9 * half + c] += x[1] * B[6 + c] - x[2] * B[3 + c];
      to[1][9 * half + 3 + c] += x[2] * B[c] - x[0] * B[6 + c];
      to[1][9 * half + 6 + c] += x[0] * B[3 + c] - x[1] * B[c];
    }
  }
}

/* E, and the inverse diagonal blocks of A. */
static PetscErrorCode set_values(Contact *p, PetscBool *ok)
{
  const SbSpace s = p->space;
  const SbContactRows *r = p->rows;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(p->value, 9 * (size_t)p->ia[p->nrow]));
  for (PetscInt i = 0; i < p->n; i++) {
    for (PetscInt k = r->ia[i]; k < r->ia[i + 1]; k++) {
      const PetscInt j = p->column[k];
      const PetscReal *A = r->value + 9 * k;
      const int ways[2] = {p->way[i] == MEAN ? 2 : 1, p->way[j] == MEAN ? 2 : 1};
      PetscReal D[9], *to[2];

      if (j == i) {
        if (p->way[i] == ITSELF)
          PetscCall(PetscArrayzero(p->inverse + 9 * i, 9));
        else if (!p->parent && !invert(A, p->inverse + 9 * i))
          *ok = PETSC_FALSE;
        /* rows of prescribed unknowns contain only their diagonal, which does not contribute to E */
        for (int e = 0; e < 9 && p->way[i] != ITSELF; e++) D[e] = s->fixed[i] & (1 << (e / 3)) ? 0. : A[e];
        if (p->way[i] != ITSELF) A = D;
      }
      for (int w = 0; w < ways[0] * ways[1]; w++) {
        const int v = w / ways[1], u = w % ways[1];
        const PetscInt row = p->unit[2 * i + v] - p->first,
                       slot = p->slot[p->stride * (size_t)k + (size_t)(2 * v + u)];
        const PetscReal factor = (ways[0] > 1 ? 0.5 : 1.) * (ways[1] > 1 ? 0.5 : 1.);
        PetscReal B[9];

        if (p->unit[2 * i + v] < 0 || slot < 0) continue;
        for (int q = 0; q < (p->way[i] == MEMBER ? 2 : 1); q++)
          to[q] = p->value + 9 * (size_t)(p->ia[row + q] + slot);
        for (int e = 0; e < 9 && factor < 1.; e++) {
          const PetscBool moved = (PetscBool)((ways[0] == 1 || p->moved[i] & (1 << (3 * v + e / 3))) &&
                                              (ways[1] == 1 || p->moved[j] & (1 << (3 * u + e % 3))));

          B[e] = moved ? factor * A[e] : 0.;
        }
        add_block(p, i, j, factor < 1. ? B : A, to);
      }
    }
  }

  /* modes that vanish: the mean diagonal */
  for (PetscInt a = 0; a < p->nagg; a++) {
    const PetscInt row = p->row_of[a];
    PetscReal trace = 0., *block[2] = {NULL, NULL};

    if (row < 0) continue;
    for (int q = 0; q < 2; q++) {
      for (PetscInt k = p->ia[row + q]; k < p->ia[row + q + 1] && !block[q]; k++) {
        if (p->ja[k] == p->first + row) block[q] = p->value + 9 * (size_t)k;
      }
      for (int e = 0; e < 3; e++) trace += block[q][9 * q + 4 * e];
    }
    for (int e = 0; e < 36; e++)
      block[e / 18][9 * (e % 6 / 3) + 3 * (e / 6 % 3) + e % 3] += trace / 6. * p->null[36 * a + e];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Contact(PC pc)
{
  PetscBool ok = PETSC_TRUE, positive;
  Contact *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  if (!p->stale[0]) PetscFunctionReturn(PETSC_SUCCESS);
  if (!p->s) {
    PetscCall(PCGetOperators(pc, NULL, &A));
    PetscCall(MatCreateVecs(A, &p->p, &p->s));
    PetscCall(VecDuplicate(p->s, &p->t));
    PetscCall(VecDuplicate(p->s, &p->w));
  }
  if (p->stale[1]) {
    PetscCall(free_pattern(p));
    PetscCall(find_ghosts(p));
    PetscCall(find_units(p));
    PetscCall(find_pattern(p));
  }
  PetscCall(set_values(p, &ok));
  if (p->parent) {
    PetscCall(PCGetOperators(pc, NULL, &A));
    PetscCall(SbGaussSeidelSetUp(A, p->inverse, p->extra, &ok));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &ok, 1, SB_MPI_BOOL, MPI_LAND, p->space->comm));
  PetscCall(SbBlockSolverSetUp(p->solver, p->nrow, p->ia, p->ja, p->value, p->stale[1], &positive));
  p->stale[0] = p->stale[1] = PETSC_FALSE;
  p->ok = (PetscBool)(ok && positive);
  PetscCall(PCSetFailedReason(pc, p->ok ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ application */

/* c = Z^T r; share: a weighted norm of c over |r|; the weights give |c| = |r| for r constant on each aggregate. */
static PetscErrorCode restrict_to(Contact *p, Vec R, PetscReal *share)
{
  PetscReal norm2[2] = {0., 0.};
  const PetscScalar *r;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(p->c, 3 * p->nrow));
  PetscCall(VecGetArrayRead(R, &r));
  for (PetscInt i = 0; i < p->n; i++) {
    const PetscInt *unit = p->unit + 2 * i;
    PetscReal f[3], m[6] = {0.};

    for (int v = 0; v < 2 && p->way[i] == MEAN; v++) {
      for (int q = 0; q < 3 && unit[v] >= 0; q++)
        p->c[3 * (unit[v] - p->first) + q] += p->moved[i] & (1 << (3 * v + q)) ? 0.5 * r[3 * i + q] : 0.;
    }
    if (unit[0] < 0 || p->way[i] == MEAN) continue;
    for (int q = 0; q < 3; q++) {
      f[q] = p->way[i] == MEMBER && p->space->fixed[i] & (1 << q) ? 0. : r[3 * i + q];
      norm2[1] += f[q] * f[q];
    }
    SbCoarseAddMoments(p->d + 3 * i, f, m);
    for (int q = 0; q < (p->way[i] == MEMBER ? 6 : 3); q++) p->c[3 * (unit[0] - p->first) + q] += m[q];
  }
  for (PetscInt k = 0; k < 3 * p->nrow; k++) norm2[0] += PetscSqr(p->c[k]) * p->weight[k / 3];
  PetscCall(VecRestoreArrayRead(R, &r));
  if (!share) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, norm2, 2, MPIU_REAL, MPI_SUM, p->space->comm));
  *share = norm2[1] > 0. ? PetscSqrtReal(norm2[0] / norm2[1]) : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z += Z E^-1 c. */
static PetscErrorCode add_coarse(Contact *p, Vec Z)
{
  PetscScalar *z;

  PetscFunctionBeginUser;
  PetscCall(SbBlockSolverSolve(p->solver, p->c, p->c));
  PetscCall(VecGetArray(Z, &z));
  for (PetscInt i = 0; i < p->n; i++) {
    const PetscInt *unit = p->unit + 2 * i;
    const PetscReal *y = p->c + 3 * (unit[0] - p->first);
    PetscReal u[3];

    for (int v = 0; v < 2 && p->way[i] == MEAN; v++) {
      for (int q = 0; q < 3 && unit[v] >= 0; q++)
        z[3 * i + q] += p->moved[i] & (1 << (3 * v + q)) ? 0.5 * p->c[3 * (unit[v] - p->first) + q] : 0.;
    }
    for (int q = 0; q < 3 && unit[0] >= 0 && p->way[i] == ITSELF; q++) z[3 * i + q] += y[q];
    if (p->way[i] != MEMBER) continue;
    SbCoarseMotion(p->d + 3 * i, y, u);
    for (int q = 0; q < 3; q++) z[3 * i + q] += p->space->fixed[i] & (1 << q) ? 0. : u[q];
  }
  PetscCall(VecRestoreArray(Z, &z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One Chebyshev step: p = factor p + other D^-1 (r - t), z = z + p; t NULL: first step, z = 0. */
static PetscErrorCode advance(Contact *p, PetscReal factor, PetscReal other, Vec R, Vec T, Vec Z)
{
  const PetscScalar *r, *t = NULL;
  PetscScalar *q, *z;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(R, &r));
  if (T) PetscCall(VecGetArrayRead(T, &t));
  PetscCall(VecGetArray(p->p, &q));
  PetscCall(VecGetArray(Z, &z));
  for (PetscInt i = 0; i < p->n; i++) {
    const PetscReal *B = p->inverse + 9 * i;
    PetscReal f[3];

    for (int k = 0; k < 3; k++) f[k] = t ? r[3 * i + k] - t[3 * i + k] : r[3 * i + k];
    for (int k = 0; k < 3; k++) {
      const PetscReal step = B[3 * k] * f[0] + B[3 * k + 1] * f[1] + B[3 * k + 2] * f[2];

      q[3 * i + k] = t ? factor * q[3 * i + k] + other * step : other * step;
      z[3 * i + k] = t ? z[3 * i + k] + q[3 * i + k] : q[3 * i + k];
    }
  }
  PetscCall(VecRestoreArray(Z, &z));
  PetscCall(VecRestoreArray(p->p, &q));
  if (T) PetscCall(VecRestoreArrayRead(T, &t));
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = M r (Saad, Iterative Methods for Sparse Linear Systems, 2003, algorithm 12.1). */
static PetscErrorCode smooth(Contact *p, Mat A, Vec r, Vec z)
{
  const PetscReal middle = 0.5 * LARGEST * (1. + 1. / RANGE), half = 0.5 * LARGEST * (1. - 1. / RANGE);
  PetscReal rho = half / middle;

  PetscFunctionBeginUser;
  PetscCall(advance(p, 0., 1. / middle, r, NULL, z));
  for (int k = 1; k < DEGREE; k++) {
    const PetscReal next = 1. / (2. * middle / half - rho);

    PetscCall(MatMult(A, z, p->t));
    PetscCall(advance(p, next * rho, 2. * next / half, r, p->t, z));
    rho = next;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApply_Contact(PC pc, Vec r, Vec z)
{
  PetscReal share;
  PetscBool whole;
  Contact *p;
  Vec s = r;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  if (p->parent) {
    PetscCall(SbGaussSeidelDown(A, p->inverse, p->extra, r, z, p->t));
    PetscCall(restrict_to(p, p->t, NULL));
    PetscCall(add_coarse(p, z));
    PetscCall(SbGaussSeidelUp(A, p->inverse, p->extra, r, z, p->t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(restrict_to(p, r, &share));
  whole = (PetscBool)(share > IN_SPAN);
  if (whole) { /* z = Q r, s = r - A z */
    s = p->s;
    PetscCall(VecZeroEntries(z));
    PetscCall(add_coarse(p, z));
    PetscCall(MatMult(A, z, s));
    PetscCall(VecAYPX(s, -1., r));
  }
  /* w = M s + Q (s - A M s) */
  PetscCall(smooth(p, A, s, p->w));
  PetscCall(MatMult(A, p->w, p->t));
  PetscCall(VecAYPX(p->t, -1., s));
  PetscCall(restrict_to(p, p->t, NULL));
  PetscCall(add_coarse(p, p->w));
  if (whole)
    PetscCall(VecAXPY(z, 1., p->w));
  else
    PetscCall(VecCopy(p->w, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCContactGuess(PC pc, Vec F, Vec X)
{
  Contact *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(VecZeroEntries(X));
  if (!p->ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(restrict_to(p, F, NULL));
  PetscCall(add_coarse(p, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCContactCorrect(PC pc, Vec F, Vec X)
{
  Contact *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  if (!p->ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMult(A, X, p->t));
  PetscCall(VecAYPX(p->t, -1., F));
  PetscCall(restrict_to(p, p->t, NULL));
  PetscCall(add_coarse(p, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ create and destroy */

static PetscErrorCode PCDestroy_Contact(PC pc)
{
  Contact *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(free_pattern(p));
  PetscCall(PetscFree(p->body));
  PetscCall(PetscFree(p->parent));
  PetscCall(PetscFree(p->vertex));
  PetscCall(SbBlockSolverDestroy(&p->solver));
  PetscCall(VecDestroy(&p->p));
  PetscCall(VecDestroy(&p->s));
  PetscCall(VecDestroy(&p->t));
  PetscCall(VecDestroy(&p->w));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_Contact(PC pc, PetscViewer viewer)
{
  PetscInt count[2] = {0, 0};
  Contact *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  if (p->parent)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "  Gauss-Seidel, and the vertices of P2 bodies in the place of their aggregates\n"));
  count[0] = p->nagg;
  for (PetscInt i = 0; i < p->rows->n; i++) count[1] += p->rows->contact[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, p->space->comm));
  PetscCall(PetscViewerASCIIPrintf(
    viewer,
    "  %" PetscInt_FMT " aggregates with six rigid-body modes each, and %" PetscInt_FMT " nodes of contact\n",
    count[0], count[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCContactCreate(SbSpace s, const SbContactRows *rows, PC pc)
{
  PetscInt nodes, nvertex = 0;
  Contact *p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  p->space = s;
  p->rows = rows;
  p->stale[0] = p->stale[1] = PETSC_TRUE;
  PetscCall(PetscMalloc1(s->nnode_owned, &p->body));
  nodes = s->plan->face_term[0] ? PetscClipInterval(s->Nnode / AGGREGATES, NODES_FACES, NODES) : NODES;
  PetscCall(SbAggregate(s, (s->nnode_owned + nodes - 1) / nodes, &p->nagg, p->body));

  /* P2: the vertices are the coarse space while there are few */
  if (s->edge_node) {
    PetscCall(SbSpaceEdgeParents(s, &p->parent));
    PetscCall(PetscCalloc1(s->nnode, &p->vertex));
    for (PetscInt k = 0; k < 2 * s->nnode; k++) {
      if (p->parent[k] != k / 2) p->vertex[p->parent[k]] = 1;
    }
    for (PetscInt i = 0; i < s->nnode_owned; i++) nvertex += p->vertex[i];
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nvertex, 1, MPIU_INT, MPI_SUM, s->comm));
    if (nvertex > VERTICES) PetscCall(PetscFree(p->parent));
  }
  p->stride = p->parent ? 4 : 1;
  PetscCall(SbBlockSolverCreate(s->comm, &p->solver));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, p));
  PetscCall(PCShellSetName(pc, "two-level with contact"));
  PetscCall(PCShellSetSetUp(pc, PCSetUp_Contact));
  PetscCall(PCShellSetApply(pc, PCApply_Contact));
  PetscCall(PCShellSetView(pc, PCView_Contact));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_Contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCContactUpdate(PC pc, PetscBool changed)
{
  Contact *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  p->stale[0] = PETSC_TRUE;
  p->stale[1] = (PetscBool)(p->stale[1] || changed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCContactCost(PC pc, PetscReal *flops, PetscReal *entries)
{
  Contact *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(SbBlockSolverCost(p->solver, flops, entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}
