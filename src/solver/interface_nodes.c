/*
  Chooses the interface nodes between ranks (interface.c), as few as possible.

  They are a vertex cover of the graph's edges between nodes of different ranks. The greedy cover repeatedly
  takes the node with the most uncovered edges. A minimum cover, from matchings, has 2 to 5 % fewer nodes
  (docs/reports/decisions.md).

  These edges are few: each rank gathers all of them and chooses the same nodes.
*/
#include "rotated.h"

PetscErrorCode SbInterfaceChooseNodes(SbSpace s, PetscInt index[], PetscInt *nmine, PetscInt *n)
{
  const SbPlan p = s->plan;
  PetscInt count = 0, nend, nnode, most = 0, *mine, *end, *node, *left, *ia, *ja;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode; i++) index[i] = -1;
  *nmine = *n = 0;
  if (!s->ghosted) PetscFunctionReturn(PETSC_SUCCESS);

  /* global numbers of the ends of edges between free own nodes and those of lower ranks; gathered from all
     ranks */
  PetscCall(PetscMalloc1(2 * p->oi[s->nnode_owned], &mine));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (PetscInt k = p->oi[i]; k < p->oi[i + 1] && s->fixed[i] != 7; k++) {
      const PetscInt j = p->oj[k];

      if (s->gnode[j] >= s->gnode_start || s->fixed[j] == 7) continue;
      mine[count++] = s->gnode[j];
      mine[count++] = s->gnode[i];
    }
  }
  PetscCall(SbAllgatherv(s->comm, MPIU_INT, count, mine, &nend, &end, NULL));
  PetscCall(PetscFree(mine));

  /* the nodes, ascending, and their graph by positions among them; left: uncovered edges of each */
  nnode = nend;
  PetscCall(PetscMalloc2(nend, &node, nend, &left));
  PetscCall(PetscArraycpy(node, end, nend));
  PetscCall(PetscSortRemoveDupsInt(&nnode, node));
  for (PetscInt e = 0; e < nend; e++) PetscCall(PetscFindInt(end[e], nnode, node, &end[e]));
  PetscCall(SbBucketByKey(nend, end, nnode, &ia, &ja));
  for (PetscInt e = 0; e < nend; e++) ja[e] = end[ja[e] ^ 1];
  for (PetscInt k = 0; k < nnode; k++) {
    left[k] = ia[k + 1] - ia[k];
    most = PetscMax(most, left[k]);
  }

  /* taken nodes: -1 */
  for (; most > 0; most--) {
    for (PetscInt k = 0; k < nnode; k++) {
      if (left[k] < most) continue;
      left[k] = -1;
      for (PetscInt e = ia[k]; e < ia[k + 1]; e++) left[ja[e]] -= left[ja[e]] > 0;
    }
  }

  /* number them over all ranks: the nodes of a rank are consecutive */
  for (PetscInt k = 0; k < nnode; k++) left[k] = left[k] < 0 ? (*n)++ : -1;
  for (PetscInt i = 0; i < s->nnode; i++) {
    PetscInt k;

    PetscCall(PetscFindInt(s->gnode[i], nnode, node, &k));
    if (k >= 0) index[i] = left[k];
    *nmine += i < s->nnode_owned && index[i] >= 0;
  }
  PetscCall(PetscFree2(node, left));
  PetscCall(PetscFree(end));
  PetscCall(PetscFree(ia));
  PetscCall(PetscFree(ja));
  PetscFunctionReturn(PETSC_SUCCESS);
}
