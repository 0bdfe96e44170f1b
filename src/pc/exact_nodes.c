/*
  Nodes that are solved exactly within the rotated preconditioner (method: rotated.h).

  A bar of 32,000 tets swinging freely: 75 such nodes in the mean, 176 at most, all in the crease at
  the support; iterations per step 7.6 in the mean and 11 at most; without exact nodes 18 and 65.

  Only nodes whose neighbours are all owned are chosen: no communication here.
*/
#include "rotated.h"

#define MOST_NODES \
  600 /* largest number of nodes: with more their factorisation costs more than it saves */

PetscErrorCode SbExactNodesDestroy(SbExactNodes *e)
{
  PetscFunctionBeginUser;
  PetscCall(SbFactorDestroy(&e->factor));
  PetscCall(PetscFree5(e->index, e->node, e->ia, e->x, e->y));
  PetscCall(PetscFree2(e->ja, e->value));
  e->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbExactNodesSetUp(SbExactNodes *e, SbSpace s, Mat A, const PetscReal spread[],
                                 PetscReal limit)
{
  const SbPlan p = s->plan;
  PetscInt nz = 0;
  PetscInt *ia, *ja;
  PetscReal *block;
  PetscBool ok = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(SbExactNodesDestroy(e));
  PetscCall(PetscMalloc5(s->nnode_owned, &e->index, MOST_NODES, &e->node, MOST_NODES + 1, &e->ia,
                         3 * MOST_NODES, &e->x, 3 * MOST_NODES, &e->y));

  /* the nodes above the limit, which is raised while they are too many */
  while (PETSC_TRUE) {
    e->n = 0;
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      e->index[i] = spread[i] > limit && !s->fixed[i] && p->oi[i] == p->oi[i + 1] ? e->n++ : -1;
    if (e->n <= MOST_NODES)
      break;
    limit *= 1.3;
  }
  if (!e->n)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (e->index[i] < 0)
      continue;
    e->node[e->index[i]] = i;
    nz += p->di[i + 1] - p->di[i];
  }
  PetscCall(PetscMalloc2(nz, &e->ja, 9 * nz, &e->value));
  PetscCall(PetscMalloc3(e->n + 1, &ia, nz, &ja, 9 * nz, &block));
  PetscCall(SbSpaceGetRows(s, A, e->n, e->node, e->ia, e->ja, block));
  for (PetscInt k = 0; k < 9 * nz; k++)
    e->value[k] = (float)block[k];

  /* the blocks between exact nodes, moved to the front */
  ia[0] = nz = 0;
  for (PetscInt k = 0, at = 0; k < e->n; k++) {
    for (; at < e->ia[k + 1]; at++) {
      if (e->index[e->ja[at]] < 0)
        continue;
      for (int c = 0; c < 9; c++)
        block[9 * nz + c] = block[9 * at + c];
      ja[nz++] = e->index[e->ja[at]];
    }
    ia[k + 1] = nz;
  }
  PetscCall(SbFactorCreate(e->n, 0, ia, ja, NULL, &e->factor));
  PetscCall(SbFactorNumeric(e->factor, ia, ja, block, NULL, &ok));
  PetscCall(PetscFree3(ia, ja, block));

  /* an indefinite block: no node is solved exactly */
  if (!ok)
    PetscCall(SbExactNodesDestroy(e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbExactNodesBefore(SbExactNodes *e, float r[])
{
  if (!e->n)
    return;
  for (PetscInt k = 0; k < 3 * e->n; k++)
    e->x[k] = r[3 * e->node[k / 3] + k % 3];
  SbFactorForward(e->factor, e->x, NULL);
  SbFactorBackward(e->factor, NULL, e->y);
  for (PetscInt k = 0; k < e->n; k++) {
    const float *y = e->y + 3 * k;

    for (PetscInt at = e->ia[k]; at < e->ia[k + 1]; at++) {
      const float *a = e->value + 9 * at;
      float *to = r + 3 * e->ja[at];

      for (int c = 0; c < 3; c++)
        to[c] -= a[c] * y[0] + a[3 + c] * y[1] + a[6 + c] * y[2];
    }
  }
}

void SbExactNodesAfter(SbExactNodes *e, const float r[], float z[])
{
  if (!e->n)
    return;
  for (PetscInt k = 0; k < 3 * e->n; k++)
    z[3 * e->node[k / 3] + k % 3] += e->y[k];
  for (PetscInt k = 0; k < e->n; k++) {
    float sum[3];

    for (int c = 0; c < 3; c++)
      sum[c] = r[3 * e->node[k] + c];
    for (PetscInt at = e->ia[k]; at < e->ia[k + 1]; at++) {
      const float *a = e->value + 9 * at;
      const float *x = z + 3 * e->ja[at];

      for (int c = 0; c < 3; c++)
        sum[c] -= a[3 * c] * x[0] + a[3 * c + 1] * x[1] + a[3 * c + 2] * x[2];
    }
    for (int c = 0; c < 3; c++)
      e->x[3 * k + c] = sum[c];
  }
  SbFactorForward(e->factor, e->x, NULL);
  SbFactorBackward(e->factor, NULL, e->y);
  for (PetscInt k = 0; k < 3 * e->n; k++)
    z[3 * e->node[k / 3] + k % 3] += e->y[k];
}
