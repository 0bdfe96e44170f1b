/*
  Rotations of cells and of nodes.

  A node's rotation is the proper rotation nearest to sum_T V_T R_T over the cells around it
  (Markley 2007, "Averaging quaternions": the same maximiser of sum_T V_T R : R_T). All cells of an
  owned node are local, so owned nodes need no communication. R_T of a P2 cell is the mean over its
  points: compared with other averages it takes the fewest iterations of -solver realtime (8.0 per
  step for a bar of 1,536 tets; with the linear function through the points 10, with the rotation of
  the four vertices 11.7). Where rotations cancel (relative rotation pi) the result is an arbitrary
  rotation.
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

PetscErrorCode SbSpaceAverageRotations(SbSpace s, const SbPack R[], PetscReal node_R[],
                                       PetscReal spread[])
{
  const PetscInt stride = 9 * sb_rotation_points(s);
  PetscReal *sum;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(9 * s->nnode, &sum));
  for (PetscInt i = 0; spread && i < s->nnode_owned; i++)
    spread[i] = 0.;
  for (int pass = 0; pass < (spread ? 2 : 1); pass++) {
    /* first sum[nnode][9] += V R of every cell at its nodes; then the spread */
    for (PetscInt b = 0; b < s->nbatch; b++) {
      const SbRegion *region = s->batch_region[b];
      const SbPack *own = R + stride * b;

      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal r[9];

        /* of P2 the mean over its points */
        for (int k = 0; k < 9; k++)
          r[k] = region->quadratic
                   ? 0.25 * (own[k][l] + own[9 + k][l] + own[18 + k][l] + own[27 + k][l])
                   : own[k][l];
        for (PetscInt a = 0; a < region->nnode; a++) {
          const PetscInt i = sb_batch_nodes(s, b)[a * SB_BATCH + l];

          for (int k = 0; k < 9 && !pass; k++)
            sum[9 * i + k] += r[k] * s->batch_V[b][l];

          /* |R - Q|^2 = 6 - 2 R : Q for rotations, and its mean over the points of P2 */
          if (pass && i < s->nnode_owned)
            spread[i] = PetscMax(spread[i], 6. - 2. * SbDot9(r, node_R + 9 * i));
        }
      }
    }
    for (PetscInt first = 0; !pass && first < s->nnode_owned; first += SB_BATCH) {
      const PetscInt n = PetscMin(SB_BATCH, s->nnode_owned - first);
      SbPack M[9], Q[9];

      /* divide by the volume around the node: SbPolar() expects numbers near one */
      for (PetscInt l = 0; l < SB_BATCH; l++) {
        const PetscReal *from = sum + 9 * (first + (l < n ? l : 0));
        const PetscReal size = PetscSqrtReal(SbDot9(from, from) / 3.);

        for (int k = 0; k < 9; k++)
          M[k][l] = size > 0. ? from[k] / size : 0.;
      }
      SbPolar((const SbPack *)M, Q);
      for (PetscInt l = 0; l < n; l++)
        SbPackGet(9, (const SbPack *)Q, (int)l, node_R + 9 * (first + l));
    }
  }
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}
