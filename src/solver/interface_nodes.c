/*
  Which nodes make the interface between the parts of several ranks (interface.c): few of them.

  They have to cover all edges of the graph between two ranks. For a pair of ranks a smallest cover follows from a largest matching
  of these edges (Koenig 1931; Schrijver, "Combinatorial Optimization", 2003, theorem 16.2), found by augmenting paths:
  from the unmatched nodes of one side along alternating paths; what is not reached there and what is reached on the other
  side covers everything. Starting on the side with more nodes takes as many as possible from it, which evens out the interiors. Pairs
  are taken in turn, each covering the remainder of its edges.

  The edges are few, all ranks have all of them and find the same nodes.
*/
#include "rotated.h"

/* Edges between two ranks, and what is known of their ends; the same on all ranks. */
typedef struct {
  PetscInt nedge, nnode;
  PetscInt *edge;    /* [nedge][2] global nodes */
  PetscInt *node;    /* [nnode] global nodes, ascending */
  PetscMPIInt *rank; /* [nnode] their owners */
  PetscInt *ia, *ja; /* graph of the edges, by positions in node */
  PetscBool *chosen; /* [nnode] */
  PetscInt *mate;    /* [nnode] matched node in the present pair of ranks, -1: none */
  PetscInt *from;    /* [nnode] node before it on an alternating path */
  PetscInt *seen;    /* [nnode] last search that came here */
  PetscInt *queue;   /* [nnode] */
  PetscInt nsearch;
} Cut;

/* Edges of free nodes with those of lower ranks, of all ranks. */
static PetscErrorCode gather_edges(SbSpace s, Cut *cut)
{
  const SbPlan p = s->plan;
  PetscInt *mine, count = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(2 * p->oi[s->nnode_owned], &mine));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (PetscInt k = p->oi[i]; k < p->oi[i + 1] && s->fixed[i] != 7; k++) {
      const PetscInt j = p->oj[k];

      if (s->gnode[j] >= s->gnode_start || s->fixed[j] == 7) continue;
      mine[count++] = s->gnode[j];
      mine[count++] = s->gnode[i];
    }
  }
  PetscCall(SbAllgatherv(s->comm, MPIU_INT, count, mine, &cut->nedge, &cut->edge, NULL));
  cut->nedge /= 2;
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers the ends of the edges and makes their graph. start[size+1]: first global node of each rank. */
static PetscErrorCode make_graph(Cut *cut, const PetscInt start[])
{
  PetscMPIInt r = 0;

  PetscFunctionBeginUser;
  cut->nnode = 2 * cut->nedge;
  PetscCall(PetscMalloc1(cut->nnode, &cut->node));
  PetscCall(PetscArraycpy(cut->node, cut->edge, cut->nnode));
  PetscCall(PetscSortRemoveDupsInt(&cut->nnode, cut->node));
  PetscCall(PetscMalloc2(cut->nnode, &cut->rank, cut->nnode, &cut->chosen));
  PetscCall(PetscMalloc4(cut->nnode, &cut->mate, cut->nnode, &cut->from, cut->nnode, &cut->seen, cut->nnode,
                         &cut->queue));
  for (PetscInt k = 0; k < cut->nnode; k++) {
    while (cut->node[k] >= start[r + 1]) r++;
    cut->rank[k] = r;
    cut->chosen[k] = PETSC_FALSE;
    cut->seen[k] = -1;
  }
  for (PetscInt e = 0; e < 2 * cut->nedge; e++)
    PetscCall(PetscFindInt(cut->edge[e], cut->nnode, cut->node, &cut->edge[e]));
  PetscCall(SbBucketByKey(2 * cut->nedge, cut->edge, cut->nnode, &cut->ia, &cut->ja));
  for (PetscInt e = 0; e < 2 * cut->nedge; e++) cut->ja[e] = cut->edge[cut->ja[e] ^ 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Follows alternating paths from queue[0..n-1], unmatched nodes, to nodes of `rank` that no other pair has covered. Ends at an
  unmatched one and returns it, or returns -1 when there is none: then seen marks all that is reached.
*/
static PetscInt search(Cut *cut, PetscInt n, PetscMPIInt rank)
{
  cut->nsearch++;
  for (PetscInt k = 0; k < n; k++) cut->seen[cut->queue[k]] = cut->nsearch;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = cut->queue[k];

    for (PetscInt e = cut->ia[i]; e < cut->ia[i + 1]; e++) {
      const PetscInt j = cut->ja[e];

      if (cut->rank[j] != rank || cut->chosen[j] || cut->seen[j] == cut->nsearch) continue;
      cut->seen[j] = cut->nsearch;
      cut->from[j] = i;
      if (cut->mate[j] < 0) return j;
      cut->seen[cut->mate[j]] = cut->nsearch;
      cut->queue[n++] = cut->mate[j];
    }
  }
  return -1;
}

/* A smallest cover of the edges between two ranks that nothing covers yet, with as much of it as possible on the first one. */
static void cover_pair(Cut *cut, PetscMPIInt first, PetscMPIInt second, PetscInt left[])
{
  PetscInt n = 0;

  for (PetscInt k = 0; k < cut->nnode; k++) cut->mate[k] = -1;
  /* the largest matching */
  for (PetscInt k = 0; k < cut->nnode; k++) {
    if (cut->rank[k] != first || cut->chosen[k]) continue;
    cut->queue[0] = k;
    for (PetscInt j = search(cut, 1, second), next; j >= 0; j = next) {
      const PetscInt i = cut->from[j];

      next = cut->mate[i];
      cut->mate[i] = j;
      cut->mate[j] = i;
    }
  }
  /* what unmatched nodes reach; those without such edges reach nothing */
  for (PetscInt k = 0; k < cut->nnode; k++) {
    if (cut->rank[k] == first && !cut->chosen[k] && cut->mate[k] < 0) cut->queue[n++] = k;
  }
  (void)search(cut, n, second);
  for (PetscInt k = 0; k < cut->nnode; k++) {
    const PetscBool reached = (PetscBool)(cut->seen[k] == cut->nsearch);

    if (cut->mate[k] < 0 || reached != (PetscBool)(cut->rank[k] == second)) continue;
    cut->chosen[k] = PETSC_TRUE;
    left[cut->rank[k]]--;
  }
}

PetscErrorCode SbInterfaceChooseNodes(SbSpace s, PetscInt index[], PetscInt *nmine, PetscInt *n)
{
  Cut cut = {0};
  PetscMPIInt size, rank;
  PetscInt *start, *left, free_nodes = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  PetscCallMPI(MPI_Comm_rank(s->comm, &rank));
  for (PetscInt i = 0; i < s->nnode; i++) index[i] = -1;
  *nmine = *n = 0;
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(size + 1, &start, size, &left));
  start[size] = s->Nnode;
  PetscCallMPI(MPI_Allgather(&s->gnode_start, 1, MPIU_INT, start, 1, MPIU_INT, s->comm));
  for (PetscInt i = 0; i < s->nnode_owned; i++) free_nodes += s->fixed[i] != 7;
  PetscCallMPI(MPI_Allgather(&free_nodes, 1, MPIU_INT, left, 1, MPIU_INT, s->comm));
  PetscCall(gather_edges(s, &cut));
  PetscCall(make_graph(&cut, start));
  for (PetscMPIInt a = 0; a < size; a++) {
    for (PetscMPIInt b = a + 1; b < size; b++) {
      const PetscBool more = (PetscBool)(left[a] >= left[b]);

      cover_pair(&cut, more ? a : b, more ? b : a, left);
    }
  }
  /* numbered over all ranks: the nodes of a rank are consecutive */
  for (PetscInt k = 0; k < cut.nnode; k++) {
    if (!cut.chosen[k]) continue;
    if (cut.rank[k] == rank) {
      index[cut.node[k] - s->gnode_start] = *n;
      (*nmine)++;
    }
    cut.seen[k] = (*n)++;
  }
  for (PetscInt i = s->nnode_owned; i < s->nnode; i++) {
    PetscInt k;

    PetscCall(PetscFindInt(s->gnode[i], cut.nnode, cut.node, &k));
    if (k >= 0 && cut.chosen[k]) index[i] = cut.seen[k];
  }
  PetscCall(PetscFree2(start, left));
  PetscCall(PetscFree(cut.edge));
  PetscCall(PetscFree(cut.node));
  PetscCall(PetscFree(cut.ia));
  PetscCall(PetscFree(cut.ja));
  PetscCall(PetscFree2(cut.rank, cut.chosen));
  PetscCall(PetscFree4(cut.mate, cut.from, cut.seen, cut.queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}
