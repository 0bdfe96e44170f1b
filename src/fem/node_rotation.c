/*
  Rotations of cells and of nodes.

  A node's rotation is the proper rotation nearest to sum_T V_T R_T over the cells around it (Markley 2007,
  "Averaging quaternions": the same maximiser of sum_T V_T R : R_T). All cells of an owned node are local, so
  owned nodes need no communication. R_T of a P2 cell is the mean over its points: compared with other
  averages it takes the fewest iterations of -solver realtime (8.0 per step for a bar of 1,536 tets; with the
  linear function through the points 10, with the rotation of the four vertices 11.7). Where rotations cancel
  (relative rotation pi) the result is an arbitrary rotation.
*/
#include "fem_impl.h"

void SbSpaceCellRotations(SbSpace s, const PetscReal x[], SbPack R[])
{
  const PetscInt stride = 9 * sb_rotation_points(s);

  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    SbPack U[30], F[SB_POINTS][9];

    SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
    /* for a curved cell at the first four of its points */
    for (int q = 0; q < (region->quadratic ? 4 : 1); q++)
      SbMaterialRotation(region->material, (const SbPack *)F[q], R + stride * b + 9 * q);
  }
}

/* Rotation r of the cell in lane l, for P2 the mean over its points; returns the number of its nodes. */
static PetscInt cell_rotation(SbSpace s, const SbPack *R, PetscInt b, PetscInt l, PetscReal r[9])
{
  const PetscBool quadratic = (PetscBool)(s->edge_node && s->edge_node[6 * s->batch_cell[b]] >= 0);

  R += 9 * sb_rotation_points(s) * b;
  for (int k = 0; k < 9; k++)
    r[k] = quadratic ? 0.25 * (R[k][l] + R[9 + k][l] + R[18 + k][l] + R[27 + k][l]) : R[k][l];
  return quadratic ? SB_CELL_NODES : 4;
}

PetscErrorCode SbSpaceAverageRotations(SbSpace s, const SbPack R[], PetscReal node_R[], PetscReal spread[])
{
  PetscReal *sum, r[9];

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(9 * s->nnode, &sum));
  /* sum[nnode][9] += V R of every cell at its nodes. */
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const PetscInt *node = sb_batch_nodes(s, b);

    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt n = cell_rotation(s, R, b, l, r);

      for (int k = 0; k < 9; k++) r[k] *= s->batch_V[b][l];
      for (PetscInt a = 0; a < n; a++) {
        PetscReal *to = sum + 9 * node[a * SB_BATCH + l];

        for (int k = 0; k < 9; k++) to[k] += r[k];
      }
    }
  }
  for (PetscInt first = 0; first < s->nnode_owned; first += SB_BATCH) {
    const PetscInt n = PetscMin(SB_BATCH, s->nnode_owned - first);
    SbPack M[9], Q[9];

    /* divide by the volume around the node: SbPolar() expects numbers near one */
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
      const PetscInt *node = sb_batch_nodes(s, b);

      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        const PetscInt n = cell_rotation(s, R, b, l, r);

        for (PetscInt a = 0; a < n; a++) {
          const PetscInt i = node[a * SB_BATCH + l];

          /* |R - Q|^2 = 6 - 2 R : Q for rotations, and its mean over the points of P2 */
          if (i < s->nnode_owned) spread[i] = PetscMax(spread[i], 6. - 2. * SbDot9(r, node_R + 9 * i));
        }
      }
    }
  }
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}
