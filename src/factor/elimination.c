/*
  Order of elimination and structure of the factor, on nodes (3x3 blocks) throughout.

  1. Nested dissection of the graph by METIS.
  2. Elimination tree (Liu, "The role of elimination trees in sparse factorization", 1990, algorithm
  4.2), in
     postorder: children come before their parent.
  3. Structure of column j: its own entries and those of its children's structures, below j. A
  column whose
     structure is that of the previous column without itself joins its group (a supernode).
  4. Groups are merged with their parent while this adds few explicit zeros: dense kernels on wider
  panels
     outweigh them. The limits are those of CHOLMOD (Chen, Davis, Hager, Rajamanickam 2008), in
     nodes.
*/
#include <metis.h>
#include "elimination.h"
#include "sbsignal.h"

/* Largest fraction of explicit zeros in a group of columns, by its number of nodes. */
static const struct {
  PetscInt nodes;
  PetscReal share;
} limits[] = {{2, 1.}, {6, 0.8}, {16, 0.1}, {PETSC_MAX_INT, 0.05}};

static PetscErrorCode dissect(PetscInt n, const PetscInt ia[], const PetscInt ja[],
                              PetscInt order[])
{
  idx_t nvtxs = (idx_t)n;
  idx_t options[METIS_NOPTIONS], *xadj, *adj, *perm, *iperm;
  idx_t k = 0;
  int status = METIS_OK;
  sigset_t before;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(n + 1, &xadj, ia[n] + 1, &adj, n, &perm, n, &iperm));
  for (PetscInt i = 0; i < n; i++) {
    xadj[i] = k;
    for (PetscInt e = ia[i]; e < ia[i + 1]; e++)
      if (ja[e] != i && ja[e] < n)
        adj[k++] = (idx_t)ja[e];
  }
  xadj[n] = k;
  METIS_SetDefaultOptions(options);
  SbSignalsHold(&before);
  if (n > 0)
    status = METIS_NodeND(&nvtxs, xadj, adj, NULL, options, perm, iperm);
  SbSignalsRelease(&before);
  PetscCheck(status == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_NodeND failed with %d",
             status);
  for (PetscInt i = 0; i < n; i++)
    order[i] = (PetscInt)perm[i];
  PetscCall(PetscFree4(xadj, adj, perm, iperm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds parent[] of the elimination tree of the free nodes, by positions; ancestor[] is work
   space. */
static void elimination_tree(const SbElimination *e, const PetscInt ia[], const PetscInt ja[],
                             PetscInt parent[], PetscInt ancestor[])
{
  for (PetscInt j = 0; j < e->nfree; j++) {
    const PetscInt node = e->order[j];

    parent[j] = ancestor[j] = -1;
    for (PetscInt k = ia[node]; k < ia[node + 1]; k++) {
      PetscInt i = e->inverse[ja[k]];

      while (i >= 0 && i < j) {
        const PetscInt next = ancestor[i];

        ancestor[i] = j;
        if (next < 0)
          parent[i] = j;
        i = next;
      }
    }
  }
}

/* Renumbers the positions and parent[] in postorder: every subtree is consecutive and ends with its
   root. */
static PetscErrorCode postorder(SbElimination *e, PetscInt parent[])
{
  const PetscInt n = e->nfree;
  PetscInt *size, *end, *fresh, *old;
  PetscInt last = n;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(n, &size, n, &end, n, &fresh, n, &old));

  // sizes of the subtrees; a parent comes after its children
  for (PetscInt j = 0; j < n; j++)
    size[j] = 1;
  for (PetscInt j = 0; j < n; j++)
    if (parent[j] >= 0)
      size[parent[j]] += size[j];

  // from the last root on: each subtree before those of later siblings; end[]: where the next
  // child's ends
  for (PetscInt j = n - 1; j >= 0; j--) {
    PetscInt *place = parent[j] < 0 ? &last : &end[parent[j]];

    fresh[j] = end[j] = *place - 1;
    *place -= size[j];
  }

  // order, parents and inverse in the new numbers
  PetscCall(PetscArraycpy(old, e->order, n));
  PetscCall(PetscArraycpy(end, parent, n));
  for (PetscInt j = 0; j < n; j++) {
    e->order[fresh[j]] = old[j];
    parent[fresh[j]] = end[j] < 0 ? -1 : fresh[end[j]];
  }
  for (PetscInt j = 0; j < n; j++)
    e->inverse[e->order[j]] = j;
  PetscCall(PetscFree4(size, end, fresh, old));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A group of columns under construction, on a stack with the open group last. */
typedef struct {
  PetscInt first, ncol, nrow; /* first column, number of columns, number of rows below them */
  PetscInt *row;              /* [nrow] positions, ascending; owned */
  PetscReal zeros;            /* number of zero blocks in the lower triangle */
} Group;

static PetscReal blocks_of(PetscInt ncol, PetscInt nrow)
{
  return 0.5 * (PetscReal)ncol * (PetscReal)(ncol + 1) + (PetscReal)ncol * (PetscReal)nrow;
}

/* Merges groups at the end of the list into their parent, the last one, while explicit zeros are
   few. */
static PetscErrorCode merge_groups(PetscInt *ngroup, Group group[])
{
  PetscFunctionBeginUser;
  while (*ngroup >= 2) {
    Group *p = &group[*ngroup - 1];
    Group *c = &group[*ngroup - 2];
    const PetscInt ncol = p->ncol + c->ncol;
    const PetscReal blocks = blocks_of(ncol, p->nrow);
    const PetscReal zeros =
      blocks - (blocks_of(p->ncol, p->nrow) - p->zeros) - (blocks_of(c->ncol, c->nrow) - c->zeros);
    size_t k = 0;

    /* the first row of a child is a column of its parent */
    if (!c->nrow || c->row[0] < p->first || c->row[0] >= p->first + p->ncol)
      break;
    while (ncol > limits[k].nodes)
      k++;
    if (zeros > limits[k].share * blocks)
      break;
    PetscCall(PetscFree(c->row));
    *c = (Group){.first = c->first, .ncol = ncol, .nrow = p->nrow, .row = p->row, .zeros = zeros};
    (*ngroup)--;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends to out[n] the positions above j among i that are not marked by j yet. */
static inline void append(PetscInt j, PetscInt i, PetscInt mark[], PetscInt *n, PetscInt out[])
{
  if (i <= j || mark[i] == j)
    return;
  mark[i] = j;
  out[(*n)++] = i;
}

/* Finds the groups of columns and their rows. */
static PetscErrorCode find_groups(SbElimination *e, const PetscInt ia[], const PetscInt ja[],
                                  const PetscInt parent[], PetscInt *ngroup, Group group[])
{
  const PetscInt n = e->nfree;
  PetscInt *child, *sibling, *nrows, *mark, *out, **rows;

  PetscFunctionBeginUser;

  /* rows[j], nrows[j]: structure of column j, kept for the last column of a group only; lists of
     children */
  PetscCall(PetscMalloc6(n, &child, n, &sibling, n, &nrows, e->n, &mark, e->n, &out, n, &rows));
  for (PetscInt j = 0; j < n; j++)
    child[j] = -1;
  for (PetscInt i = 0; i < e->n; i++)
    mark[i] = -1;
  *ngroup = 0;
  for (PetscInt j = 0; j < n; j++) {
    const PetscInt node = e->order[j];
    Group *g;

    /* structure of column j without j, sorted: own entries and those of its children */
    nrows[j] = 0;
    for (PetscInt k = ia[node]; k < ia[node + 1]; k++)
      append(j, e->inverse[ja[k]], mark, &nrows[j], out);
    for (PetscInt c = child[j]; c >= 0; c = sibling[c])
      for (PetscInt k = 0; k < nrows[c]; k++)
        append(j, rows[c][k], mark, &nrows[j], out);
    PetscCall(PetscSortInt(nrows[j], out));
    PetscCall(PetscMalloc1(nrows[j], &rows[j]));
    PetscCall(PetscArraycpy(rows[j], out, nrows[j]));

    /* it continues the group of the column before, or begins one */
    if (j > 0 && parent[j - 1] == j && nrows[j - 1] == nrows[j] + 1) {
      group[*ngroup - 1].ncol++;
      PetscCall(PetscFree(rows[j - 1]));
    } else {
      PetscCall(merge_groups(ngroup, group));
      group[(*ngroup)++] = (Group){.first = j, .ncol = 1};
    }

    /* the rows of a group are those of its last column */
    g = &group[*ngroup - 1];
    g->nrow = nrows[j];
    g->row = rows[j];
    if (parent[j] < 0)
      continue;
    sibling[j] = child[parent[j]];
    child[parent[j]] = j;
  }
  PetscCall(merge_groups(ngroup, group));
  PetscCall(PetscFree6(child, sibling, nrows, mark, out, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEliminationCreate(PetscInt n, PetscInt nkeep, const PetscInt ia[],
                                   const PetscInt ja[], const PetscInt order[], SbElimination *e)
{
  PetscInt *parent, *ancestor, *owner;
  PetscInt ngroup = 0;
  PetscInt total = 0;
  Group *group;

  PetscFunctionBeginUser;
  e->n = n;
  e->nfree = n - nkeep;
  PetscCall(PetscMalloc2(n, &e->order, n, &e->inverse));
  if (order)
    PetscCall(PetscArraycpy(e->order, order, e->nfree));
  else
    PetscCall(dissect(e->nfree, ia, ja, e->order));
  for (PetscInt k = e->nfree; k < n; k++)
    e->order[k] = k;
  for (PetscInt k = 0; k < n; k++)
    e->inverse[e->order[k]] = k;
  PetscCall(
    PetscMalloc4(e->nfree, &parent, e->nfree, &ancestor, e->nfree, &owner, e->nfree, &group));
  elimination_tree(e, ia, ja, parent, ancestor);
  PetscCall(postorder(e, parent));
  PetscCall(find_groups(e, ia, ja, parent, &ngroup, group));
  for (PetscInt g = 0; g < ngroup; g++)
    total += group[g].ncol + group[g].nrow;
  e->nsuper = ngroup;
  PetscCall(PetscMalloc4(ngroup + 1, &e->first, ngroup + 1, &e->start, total, &e->list, ngroup,
                         &e->parent));
  e->start[0] = 0;
  for (PetscInt g = 0; g < ngroup; g++) {
    PetscInt *list = e->list + e->start[g];

    e->first[g] = group[g].first;
    e->start[g + 1] = e->start[g] + group[g].ncol + group[g].nrow;
    for (PetscInt k = 0; k < group[g].ncol; k++) {
      list[k] = group[g].first + k;
      owner[list[k]] = g;
    }
    PetscCall(PetscArraycpy(list + group[g].ncol, group[g].row, group[g].nrow));
  }
  e->first[ngroup] = e->nfree;
  for (PetscInt g = 0; g < ngroup; g++) {
    e->parent[g] = group[g].nrow && group[g].row[0] < e->nfree ? owner[group[g].row[0]] : -1;
    PetscCall(PetscFree(group[g].row));
  }
  PetscCall(PetscFree4(parent, ancestor, owner, group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEliminationDestroy(SbElimination *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(e->order, e->inverse));
  PetscCall(PetscFree4(e->first, e->start, e->list, e->parent));
  PetscFunctionReturn(PETSC_SUCCESS);
}
