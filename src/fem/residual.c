/*
  Internal forces, inertial forces, and stresses and strains of cells.

  f_a = V P grad phi_a with P from the law, and beta (dP/dF : H) for stiffness-proportional damping,
  H = grad v. Ghost cells are evaluated, too, so that forces on owned nodes are complete. Energies
  are of owned ones.

  The volumetric pressure is p = -lambda theta(F), theta the law's measure of the change of volume:
  for a Poisson's ratio near 0.5 lambda is large and theta small. P1 has fewer displacements than
  volume constraints of cells: it locks, and p alternates between neighbours. CR and DG satisfy the
  constraints in the mean of each cell and p converges (Crouzeix and Raviart 1973; Hansbo and Larson
  2002). P2 has one stress at each point: the stress of a cell is their mean.
*/
#include "fem_impl.h"
#include "sbkernel.h"

/* The pressure of P2's mean with the history of a viscoelastic material. */
static void add_mean_history(const SbRegion *region, PetscInt b, SbPack p)
{
  const PetscReal *constant;
  PetscReal factor;

  SbViscousMean(region, b, PETSC_FALSE, &factor, &constant);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = factor * p[l] + constant[l];
}

/* P2: each point with its fraction of the volume; most of the volumetric part by the mean of the
   cell. Damping likewise: mu (H + R H^T R) + lambda_p (R : H) R at the points, lambda_m times the
   mean of R : H. */
void SbRegionForces(SbSpace s, const SbRegion *region, PetscBool elastic, PetscReal beta,
                    const SbStage *stage, PetscReal f[])
{
  const SbMaterial m = region->pointwise;
  const PetscReal lambda = SbMaterialMeanModulus(region->material);
  const PetscBool mean = (PetscBool)(m != region->material);

  for (PetscInt b = region->bstart; b < region->bend; b++) {
    const SbPoints at = SbBatchPoints(s, b);
    SbPack U[30], F[SB_POINTS][9], H[SB_POINTS][9], P[9], dP[9], R[9], fe[30], b10[30];
    SbPack p = {0};
    struct _p_SbMaterial own, whole;
    const struct _p_SbMaterial *law = SbBatchLaw(region, m, b, &own);

    if (at.rule)
      memset(fe, 0, sizeof(fe));
    SbBatchGradients(s, b, stage->u, PETSC_FALSE, U, F);
    if (mean && elastic) {
      SbQuadraticVolume(SbBatchVolumeLaw(region, b, &whole), &at, (const SbPack *)U,
                        (const SbPack(*)[9])F, p, b10);
      if (region->history)
        add_mean_history(region, b, p);
      for (int k = 0; k < 30; k++)
        for (int l = 0; l < SB_BATCH; l++)
          fe[k][l] = p[l] * b10[k][l];
    }
    if (beta != 0.) {
      SbBatchGradients(s, b, stage->v, PETSC_TRUE, U, H);
      for (int l = 0; l < SB_BATCH; l++)
        p[l] = 0.;
      for (int q = 0; q < at.n && mean; q++) {
        SbMaterialRotation(m, (const SbPack *)F[q], R);
        for (int k = 0; k < 9; k++)
          for (int l = 0; l < SB_BATCH; l++)
            p[l] += at.weight[q][l] * beta * lambda * R[k][l] * H[q][k][l];
      }
    }
    for (int q = 0; q < at.n; q++) {
      SbPointLaw(region, b, q, &own);
      if (elastic)
        law->ops.stress(law, (const SbPack *)F[q], P);
      if (elastic && region->history)
        SbViscousStress(region, law, b, q, (const SbPack *)F[q], P);
      if (elastic && region->contraction)
        SbActiveStress(region, b, q, (const SbPack *)F[q], P);
      if (beta != 0.) {
        SbMaterialDampingStress(m, (const SbPack *)F[q], (const SbPack *)H[q], dP);
        if (mean)
          SbMaterialRotation(m, (const SbPack *)F[q], R);
        for (int k = 0; k < 9; k++)
          for (int l = 0; l < SB_BATCH; l++)
            P[k][l] = (elastic ? P[k][l] : 0.) + beta * dP[k][l] + (mean ? p[l] * R[k][l] : 0.);
      }
      SbPointForce(&at, q, (const SbPack *)P, fe);
    }
    sb_scatter_strain(s, b, fe, f);
  }
}

PetscErrorCode SbSpaceAddInternalForce(SbSpace s, const SbStage *stage, PetscReal f[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_RESIDUAL], 0, 0, 0, 0));
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    PetscCall(PetscLogEventBegin(region->material->event, 0, 0, 0, 0));
    SbRegionForces(s, region, PETSC_TRUE, stage->v ? s->beta[region->body] : 0., stage, f);
    PetscCall(PetscLogEventEnd(region->material->event, 0, 0, 0, 0));
  }
  if (s->jump) {
    SbJumpAdd(s, stage->u, SB_JUMP_STIFFNESS, f);
    if (stage->v)
      SbJumpAdd(s, stage->v, SB_JUMP_DAMPING, f);
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_RESIDUAL], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpaceAddInertia(SbSpace s, const SbStage *stage, PetscReal f[])
{
  for (PetscInt i = 0; !s->consistent_mass && i < 3 * s->nnode_owned; i++) {
    if (stage->a)
      f[i] += s->node_mass[i / 3] * stage->a[i];
    if (stage->v)
      f[i] += s->alpha[s->node_body[i / 3]] * s->node_mass[i / 3] * stage->v[i];
  }

  /* the consistent mass times w = a + alpha v */
  for (PetscInt b = 0; s->consistent_mass && b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const PetscReal alpha = stage->v ? s->alpha[region->body] : 0.;
    const PetscReal density = region->material->density;
    const int n = (int)region->nnode;
    const int npair = region->quadratic ? SB_PAIRS : 10;
    const PetscInt *node = sb_batch_nodes(s, b);
    SbPack w[30] = {{0}};
    SbPack v[30];
    SbPack fe[30] = {{0}};
    SbPack mass[SB_PAIRS];

    if (stage->a)
      sb_gather_nodes(n, node, stage->a, w);
    if (alpha != 0.)
      sb_gather_nodes(n, node, stage->v, v);
    for (int k = 0; alpha != 0. && k < 3 * n; k++)
      for (int l = 0; l < SB_BATCH; l++)
        w[k][l] += alpha * v[k][l];
    SbBatchMass(s, b, mass);
    for (int k = 0; k < 3 * npair; k++) {
      const int p = k / 3;
      const int i = 3 * SbPairA[p] + k % 3;
      const int j = 3 * SbPairB[p] + k % 3;

      for (int l = 0; l < SB_BATCH; l++) {
        fe[i][l] += density * mass[p][l] * w[j][l];
        fe[j][l] += i == j ? 0. : density * mass[p][l] * w[i][l];
      }
    }
    sb_scatter_nodes(n, node, s->batch_n[b], (const SbPack *)fe, f);
  }
}

static PetscReal lane_det(const SbPack F[9], PetscInt l)
{
  return F[0][l] * (F[4][l] * F[8][l] - F[5][l] * F[7][l]) -
         F[1][l] * (F[3][l] * F[8][l] - F[5][l] * F[6][l]) +
         F[2][l] * (F[3][l] * F[7][l] - F[4][l] * F[6][l]);
}

/* Factor of the value at point q of the rule of curved cells in that of the linear function next to
   it (L2 projection on the straight tet) at point i of SbRuleQuadratic: with b_c = sum_q w_q l_c
   P_q it has 20 b_c - 4 sum_j b_j at corner c. */
static PetscReal linear_part(const SbPointRule *rule, int q, int i)
{
  PetscReal value = -4.;

  for (int c = 0; c < 4; c++)
    value += 20. * SbRuleQuadratic.L[i][c] * rule->L[q][c];
  return value;
}

/* Cauchy stress P F^T / J at a point in lane l; for small strain it is P itself. */
static void lane_cauchy(const SbMaterial law, const SbPack F[9], const SbPack P[9], PetscInt l,
                        PetscReal T[9])
{
  const PetscReal det = law->linear ? 1. : lane_det(F, l);

  for (int k = 0; k < 9; k++) {
    const SbPack *p = P + 3 * (k / 3);
    const SbPack *f = F + 3 * (k % 3);

    T[k] =
      law->linear ? p[k % 3][l] : (p[0][l] * f[0][l] + p[1][l] * f[1][l] + p[2][l] * f[2][l]) / det;
  }
}

void SbSpaceCellState(SbSpace s, const PetscReal x[], PetscReal sigma[], PetscReal J[],
                      PetscReal psi[], PetscReal pressure[])
{
  static const int row[6] = {0, 1, 2, 0, 1, 0};
  static const int column[6] = {0, 1, 2, 1, 2, 2};

  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack F[SB_POINTS][9], P[SB_POINTS][9], energy[SB_POINTS], pressures[SB_POINTS];

    /* means over the points */
    SbBatchState(s, b, x, F, sigma ? P : NULL, psi ? energy : NULL, pressure ? pressures : NULL);
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;

      if (J)
        J[c] = 0.;
      if (psi)
        psi[c] = 0.;
      if (pressure)
        pressure[c] = 0.;
      for (int k = 0; sigma && k < 6; k++)
        sigma[6 * c + k] = 0.;
      for (int q = 0; q < at.n; q++) {
        const PetscReal det = lane_det((const SbPack *)F[q], l);
        const PetscReal part = at.weight[q][l];
        PetscReal T[9];

        if (J)
          J[c] += part * det;
        if (psi)
          psi[c] += part * energy[q][l];
        if (pressure)
          pressure[c] += part * pressures[q][l];

        if (!sigma)
          continue;
        lane_cauchy(region->material, (const SbPack *)F[q], (const SbPack *)P[q], l, T);
        for (int k = 0; k < 6; k++)
          sigma[6 * c + k] += part * T[3 * row[k] + column[k]];
      }
    }
  }
}

void SbSpaceCellCauchy(SbSpace s, const PetscReal x[], PetscReal T[], SbPointStress point[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack F[SB_POINTS][9], P[SB_POINTS][9];

    SbBatchState(s, b, x, F, P, NULL, NULL);
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;
      PetscReal here[9];

      // means over the points, and what is at these
      memset(T + 9 * c, 0, 9 * sizeof(*T));
      if (point)
        memset(&point[c], 0, sizeof(point[c]));
      for (int q = 0; q < at.n; q++) {
        lane_cauchy(region->material, (const SbPack *)F[q], (const SbPack *)P[q], l, here);
        for (int k = 0; k < 9; k++)
          T[9 * c + k] += at.weight[q][l] * here[k];
        if (point && region->quadratic && !at.step)
          memcpy(point[c].P[q], here, sizeof(here));
        for (int i = 0; point && at.step && i < 36; i++)
          point[c].P[i / 9][i % 9] +=
            at.rule->weight[q] * linear_part(at.rule, q, i / 9) * here[i % 9];
      }
      if (point)
        point[c].pressure = (T[9 * c] + T[9 * c + 4] + T[9 * c + 8]) / 3.;
    }
  }
}

void SbSpaceCellPiola(SbSpace s, const PetscReal x[], PetscReal P[], PetscReal R[], PetscReal psi[],
                      PetscReal point[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack F[SB_POINTS][9], stress[SB_POINTS][9], energy[SB_POINTS], rotation[9], all;

    SbBatchState(s, b, x, F, stress, energy, NULL);
    for (PetscInt i = 0; point && region->quadratic && !at.step && i < 4 * s->batch_n[b]; i++)
      SbPackGet(9, (const SbPack *)stress[i % 4], (int)(i / 4),
                point + 9 * (4 * s->batch_cell[b] + i));

    // a curved cell: of the linear function next to P
    for (PetscInt i = 0; point && at.step && i < 36 * s->batch_n[b]; i++) {
      PetscReal *to = point + 36 * s->batch_cell[b] + i;

      *to = 0.;
      for (int q = 0; q < at.n; q++)
        *to +=
          at.rule->weight[q] * linear_part(at.rule, q, (int)(i / 9 % 4)) * stress[q][i % 9][i / 36];
    }

    /* means over the points */
    for (int l = 0; l < SB_BATCH; l++)
      all[l] = at.weight[0][l];
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
    if (R)
      SbMaterialRotation(region->material, (const SbPack *)F[0], rotation);
    for (int l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;

      SbPackGet(9, (const SbPack *)stress[0], l, P + 9 * c);
      if (R)
        SbPackGet(9, (const SbPack *)rotation, l, R + 9 * c);
      psi[c] = energy[0][l];
    }
  }
}

/* Exact volumes of the cells of a P2 batch, and the smallest det F at the points of the exact
   rule. */
static void quadratic_volume(SbSpace s, PetscInt b, const SbPoints *at, const PetscReal x[],
                             SbPack volume, SbPack least)
{
  const SbPointRule *rule = SbVolumeRule(at);
  SbPack U[30], u[12], F[9];

  sb_gather_nodes(10, sb_batch_nodes(s, b), x, U);
  for (int q = 0; q < rule->n; q++) {
    SbQuadraticAt(rule->L[q], (const SbPack *)U, u);
    SbCellGradient(at->g + at->step * q, (const SbPack *)u, 1., F);
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal det = lane_det((const SbPack *)F, l);
      const PetscReal part =
        (at->step ? at->weight[q][l] : rule->weight[q]) * s->batch_V[b][l] * det;

      volume[l] = q ? volume[l] + part : part;
      least[l] = q ? PetscMin(least[l], det) : det;
    }
  }
}

void SbSpaceStrainEnergy(SbSpace s, const PetscReal x[], PetscReal body[], PetscReal *energy,
                         PetscReal *minJ, PetscInt *ninverted, PetscReal *volume)
{
  *energy = 0.;
  *volume = 0.;
  *minJ = PETSC_MAX_REAL;
  *ninverted = 0;
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    const PetscReal before = *energy;
    SbPack F[SB_POINTS][9], psi[SB_POINTS];
    SbPack exact = {0};
    SbPack lowest;

    SbBatchState(s, b, x, F, NULL, psi, NULL);
    if (region->quadratic)
      quadratic_volume(s, b, &at, x, exact, lowest);
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      PetscReal least = region->quadratic ? lowest[l] : PETSC_MAX_REAL;

      for (int q = 0; q < at.n; q++) {
        const PetscReal det = lane_det((const SbPack *)F[q], l);
        const PetscReal part = s->batch_V[b][l] * at.weight[q][l];

        *energy += part * psi[q][l];
        *volume += region->quadratic ? 0. : part * det;
        least = PetscMin(least, det);
      }
      *volume += exact[l];
      *minJ = PetscMin(*minJ, least);
      *ninverted += least <= 0.;
    }
    if (body)
      body[region->body] += *energy - before;
  }
  if (s->jump)
    *energy += SbJumpEnergy(s, x, SB_JUMP_STIFFNESS, body);
}

void SbSpaceTurned(SbSpace s, const PetscReal u[], PetscReal angle, PetscReal volume[2])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    SbPack F[SB_POINTS][9], R[9];

    if (strcmp(s->batch_region[b]->material->type->name, "linear"))
      continue;
    SbBatchState(s, b, u, F, NULL, NULL, NULL);
    SbPolar((const SbPack *)F[0], R);
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscReal cosine = (R[0][l] + R[4][l] + R[8][l] - 1.) / 2.;

      volume[0] += s->batch_V[b][l];
      volume[1] += cosine < PetscCosReal(angle) ? s->batch_V[b][l] : 0.;
    }
  }
}

void SbSpaceTurnedBetween(SbSpace s, const PetscReal u0[], const PetscReal u1[], PetscReal angle,
                          PetscReal volume[2])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    SbPack F[SB_POINTS][9], R[2][9];

    if (s->batch_region[b]->material->linear)
      continue;
    for (int k = 0; k < 2; k++) {
      SbBatchState(s, b, k ? u1 : u0, F, NULL, NULL, NULL);
      SbPolar((const SbPack *)F[0], R[k]);
    }
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      PetscReal trace = 0.;

      for (int e = 0; e < 9; e++)
        trace += R[0][e][l] * R[1][e][l];
      volume[0] += s->batch_V[b][l];
      volume[1] += (trace - 1.) / 2. < PetscCosReal(angle) ? s->batch_V[b][l] : 0.;
    }
  }
}

PetscErrorCode SbSpaceDampingPower(SbSpace s, const PetscReal x[], const PetscReal v[],
                                   PetscReal *power)
{
  const SbStage stage = {.u = x, .v = v};
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    const PetscReal beta = s->beta[region->body];

    if (region->bend <= s->nbatch_owned && beta != 0.)
      SbRegionForces(s, region, PETSC_FALSE, beta, &stage, f);
  }
  *power = s->jump ? 2. * SbJumpEnergy(s, v, SB_JUMP_DAMPING, NULL) : 0.;
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    *power += v[i] * f[i];
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    *power += s->alpha[s->node_body[i / 3]] * s->node_mass[i / 3] * v[i] * v[i];
  PetscCall(PetscFree(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
