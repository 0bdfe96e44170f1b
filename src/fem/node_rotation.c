/*
  Rotations of cells and of nodes.

  A node's rotation is the proper rotation next to sum_T V_T R_T over the cells around it (Markley 2007, "Averaging
  quaternions", gives the same maximiser of sum_T V_T R : R_T). All cells that touch an owned node are local, so owned nodes
  need no communication. Where rotations cancel out (cells turned against each other by pi) the result is some rotation.
*/
#include "fem_impl.h"

void SbSpaceCellRotations(SbSpace s, const PetscReal x[], SbPack R[])
{
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbMaterial m = s->region[r].material;

    for (PetscInt b = s->region[r].bstart; b < s->region[r].bend; b++) {
      SbPack u[12], F[9];

      if (!x || m->linear) {
        for (int k = 0; k < 9; k++) {
          for (int l = 0; l < SB_BATCH; l++) R[9 * b + k][l] = k % 4 == 0;
        }
        continue;
      }
      sb_gather(s->batch_node + 4 * SB_BATCH * b, x, u);
      SbCellGradient(s->batch_g + 9 * b, (const SbPack *)u, F);
      if (m->ops.frame)
        m->ops.frame(m, (const SbPack *)F, R + 9 * b);
      else
        SbPolar((const SbPack *)F, R + 9 * b);
    }
  }
}

/* Nodes that have part in the rotation of their cell. */
static inline PetscInt batch_nodes(SbSpace s, PetscInt b)
{
  return s->edge_node && s->edge_node[6 * s->batch_cell[b]] >= 0 ? SB_CELL_NODES : 4;
}

PetscErrorCode SbSpaceAverageRotations(SbSpace s, const SbPack R[], PetscReal node_R[], PetscReal spread[])
{
  PetscReal *sum;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(9 * s->nnode, &sum));
  /* sum[nnode][9] += V R of every cell at its nodes. */
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const PetscInt n = batch_nodes(s, b), *node = s->batch_clique + s->width * SB_BATCH * b;

    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      PetscReal VR[9];

      for (int k = 0; k < 9; k++) VR[k] = s->batch_V[b][l] * R[9 * b + k][l];
      for (PetscInt a = 0; a < n; a++) {
        PetscReal *to = sum + 9 * node[a * SB_BATCH + l];

        for (int k = 0; k < 9; k++) to[k] += VR[k];
      }
    }
  }
  for (PetscInt first = 0; first < s->nnode_owned; first += SB_BATCH) {
    const PetscInt n = PetscMin(SB_BATCH, s->nnode_owned - first);
    SbPack M[9], Q[9];

    /* the volume around the node is the scale: SbPolar() wants numbers near one */
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      const PetscReal *from = sum + 9 * (first + (l < n ? l : 0));
      const PetscReal size = PetscSqrtReal(SbDot9(from, from) / 3.);

      for (int k = 0; k < 9; k++) M[k][l] = size > 0. ? from[k] / size : 0.;
    }
    SbPolar((const SbPack *)M, Q);
    for (PetscInt l = 0; l < n; l++) SbPackGet(9, (const SbPack *)Q, (int)l, node_R + 9 * (first + l));
  }
  if (spread) {
    for (PetscInt i = 0; i < s->nnode_owned; i++) spread[i] = 0.;
    for (PetscInt b = 0; b < s->nbatch; b++) {
      const PetscInt n = batch_nodes(s, b), *node = s->batch_clique + s->width * SB_BATCH * b;

      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal r[9];

        for (int k = 0; k < 9; k++) r[k] = R[9 * b + k][l];
        for (PetscInt a = 0; a < n; a++) {
          const PetscInt i = node[a * SB_BATCH + l];

          /* |R - Q|^2 = 6 - 2 R : Q for rotations */
          if (i < s->nnode_owned) spread[i] = PetscMax(spread[i], 6. - 2. * SbDot9(r, node_R + 9 * i));
        }
      }
    }
  }
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceNodeRotations(SbSpace s, const PetscReal u[], PetscReal R[], PetscReal spread[])
{
  SbPack *cells;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(9 * s->nbatch, &cells));
  SbSpaceCellRotations(s, u, cells);
  PetscCall(SbSpaceAverageRotations(s, (const SbPack *)cells, R, spread));
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}
