/*
  The stress of each cell in the rest frame, and the cell's rotation. For DG F is computed from the means of
  the two sides. P2 has one stress at each point: the stress of a cell is their mean.
*/
#include "fem_impl.h"
#include "sbkernel.h"

void SbSpaceCellPiola(SbSpace s, const PetscReal x[], PetscReal P[], PetscReal R[], PetscReal psi[],
                      PetscReal point[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack F[SB_POINTS][9], stress[SB_POINTS][9], energy[SB_POINTS], rotation[9], all;

    SbBatchState(s, b, x, F, stress, energy, NULL);
    for (PetscInt i = 0; point && region->quadratic && !at.step && i < 4 * s->batch_n[b]; i++)
      SbPackGet(9, (const SbPack *)stress[i % 4], (int)(i / 4), point + 9 * (4 * s->batch_cell[b] + i));
    /* a curved cell: the linear function of l next to P (L2 projection on the straight tet) at the points
         of SbRuleQuadratic; with b_i = sum_q w_q l_i P_q it has 20 b_i - 4 sum_j b_j at corner i */
    for (PetscInt i = 0; point && at.step && i < 36 * s->batch_n[b]; i++) {
      PetscReal *to = point + 36 * s->batch_cell[b] + i;

      *to = 0.;
      for (int q = 0; q < at.n; q++) {
        PetscReal value = -4.;

        for (int c = 0; c < 4; c++) value += 20. * SbRuleQuadratic.L[i / 9 % 4][c] * at.rule->L[q][c];
        *to += at.rule->weight[q] * value * stress[q][i % 9][i / 36];
      }
    }

    /* means over the points */
    for (int l = 0; l < SB_BATCH; l++) all[l] = at.weight[0][l];
    for (int q = 1; q < at.n; q++) {
      for (int l = 0; l < SB_BATCH; l++) {
        const PetscReal part = at.weight[q][l];

        all[l] += part;
        for (int k = 0; k < 9; k++) {
          F[0][k][l] += (F[q][k][l] - F[0][k][l]) * part / all[l];
          stress[0][k][l] += (stress[q][k][l] - stress[0][k][l]) * part / all[l];
        }
        energy[0][l] += (energy[q][l] - energy[0][l]) * part / all[l];
      }
    }
    if (R) SbMaterialRotation(region->material, (const SbPack *)F[0], rotation);
    for (int l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;

      SbPackGet(9, (const SbPack *)stress[0], l, P + 9 * c);
      if (R) SbPackGet(9, (const SbPack *)rotation, l, R + 9 * c);
      psi[c] = energy[0][l];
    }
  }
}
