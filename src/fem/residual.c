/*
  Internal forces, inertia and the state of cells.

  f_a = V P grad phi_a with P from the law, and beta (dP/dF : H) for stiffness-proportional damping, H = grad v. Ghost cells are
  evaluated too: every owned node then has all its contributions. Energies sum over owned cells only.
*/
#include "fem_impl.h"
#include "sbkernel.h"
#include "sblog.h"

/*
  P2. Each point has its part of the volume; the volumetric part is that of the mean of the cell. Damping alike: mu (H + R H^T R) at the points, lambda times the
  mean of R : H.
*/
static void add_quadratic_force(SbSpace s, const SbRegion *region, const SbStage *stage, PetscReal f[])
{
  const SbMaterial m = region->pointwise;
  const PetscReal beta = stage->v ? region->beta : 0.,
                  lambda = region->material->ops.volumetric_modulus(region->material);
  const PetscBool mean = (PetscBool)(m != region->material);

  for (PetscInt b = region->bstart; b < region->bend; b++) {
    const SbPoints at = SbBatchPoints(s, region, b);
    SbPack U[30], F[SB_POINTS][9], H[SB_POINTS][9], P[9], dP[9], R[9], W, fe[12], f10[30] = {{0}}, b10[30], p;

    sb_gather_nodes(10, sb_quadratic_nodes(s, b), stage->u, U);
    SbQuadraticGradients(&at, (const SbPack *)U, PETSC_FALSE, F);
    if (mean) {
      SbQuadraticVolume(region->material, &at, (const SbPack *)U, (const SbPack(*)[9])F, p, b10);
      for (int k = 0; k < 30; k++) {
        for (int l = 0; l < SB_BATCH; l++) f10[k][l] = p[l] * b10[k][l];
      }
    }
    if (beta != 0.) {
      sb_gather_nodes(10, sb_quadratic_nodes(s, b), stage->v, U);
      SbQuadraticGradients(&at, (const SbPack *)U, PETSC_TRUE, H);
      for (int l = 0; l < SB_BATCH; l++) p[l] = 0.;
      for (int q = 0; q < at.n && mean; q++) {
        if (m->linear)
          m->ops.frame(m, (const SbPack *)F[q], R);
        else
          SbPolar((const SbPack *)F[q], R);
        for (int k = 0; k < 9; k++) {
          for (int l = 0; l < SB_BATCH; l++) p[l] += at.weight[q][l] * beta * lambda * R[k][l] * H[q][k][l];
        }
      }
    }
    for (int q = 0; q < at.n; q++) {
      m->ops.stress(m, (const SbPack *)F[q], P);
      if (beta != 0.) {
        SbMaterialDampingStress(m, (const SbPack *)F[q], (const SbPack *)H[q], dP);
        if (mean && m->linear)
          m->ops.frame(m, (const SbPack *)F[q], R);
        else if (mean)
          SbPolar((const SbPack *)F[q], R);
        for (int k = 0; k < 9; k++) {
          for (int l = 0; l < SB_BATCH; l++) P[k][l] += beta * dP[k][l] + (mean ? p[l] * R[k][l] : 0.);
        }
      }
      SbPointVolume(&at, q, W);
      SbCellForce(at.g + at.step * q, W, (const SbPack *)P, fe);
      SbQuadraticAdd(at.rule->L[q], (const SbPack *)fe, f10);
    }
    sb_scatter_nodes(10, sb_quadratic_nodes(s, b), s->batch_n[b], (const SbPack *)f10, f);
  }
}

/* P1, CR and DG: one point in a cell. */
static void add_linear_force(SbSpace s, const SbRegion *region, const SbStage *stage, PetscReal f[])
{
  const SbMaterial m = region->material;
  const PetscReal beta = stage->v ? region->beta : 0.;

  for (PetscInt b = region->bstart; b < region->bend; b++) {
    const SbPack *g = s->batch_g + 9 * b;
    SbPack u[12], F[9], P[9], fe[12];

    sb_gather_strain(s, region, b, stage->u, u);
    SbCellGradient(g, (const SbPack *)u, F);
    m->ops.stress(m, (const SbPack *)F, P);
    if (beta != 0.) {
      SbPack H[9], dP[9];

      sb_gather_strain(s, region, b, stage->v, u);
      SbCellGradientRate(g, (const SbPack *)u, H);
      SbMaterialDampingStress(m, (const SbPack *)F, (const SbPack *)H, dP);
      for (int k = 0; k < 9; k++) {
        for (int l = 0; l < SB_BATCH; l++) P[k][l] += beta * dP[k][l];
      }
    }
    SbCellForce(g, s->batch_V[b], (const SbPack *)P, fe);
    sb_scatter_strain(s, region, b, fe, f);
  }
}

PetscErrorCode SbSpaceAddInternalForce(SbSpace s, const SbStage *stage, PetscReal f[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_RESIDUAL], 0, 0, 0, 0));
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    PetscCall(PetscLogEventBegin(region->material->event, 0, 0, 0, 0));
    if (region->quadratic)
      add_quadratic_force(s, region, stage, f);
    else
      add_linear_force(s, region, stage, f);
    PetscCall(PetscLogEventEnd(region->material->event, 0, 0, 0, 0));
  }
  if (s->jump) {
    SbJumpAdd(s, stage->u, SB_JUMP_STIFFNESS, f);
    if (stage->v) SbJumpAdd(s, stage->v, SB_JUMP_DAMPING, f);
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_RESIDUAL], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mass-proportional damping of a region with the lumped mass. */
static void add_lumped_damping(SbSpace s, const SbRegion *region, const PetscReal v[], PetscReal f[])
{
  const PetscReal damping = region->alpha * region->material->density;

  for (PetscInt b = region->bstart; b < region->bend; b++) {
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      for (PetscInt a = 0; a < (region->quadratic ? 10 : 4); a++) {
        const PetscInt node = s->batch_clique[(s->width * b + a) * SB_BATCH + l];

        const PetscReal share = damping * SbQuadraticLumped(region, b, a, l);

        for (PetscInt i = 0; i < 3; i++) f[3 * node + i] += share * s->batch_V[b][l] * v[3 * node + i];
      }
    }
  }
}

/* Consistent mass of a P2 region times w = a + alpha v. */
static void add_quadratic_inertia(SbSpace s, const SbRegion *region, const SbStage *stage, PetscReal f[])
{
  const PetscReal alpha = stage->v ? region->alpha : 0.;
  PetscReal mass[SB_CELL_NODES][SB_CELL_NODES];

  for (int k = 0; k < 100; k++)
    mass[k / 10][k % 10] = region->material->density * SbQuadraticMass(k / 10, k % 10);
  for (PetscInt b = region->bstart; b < region->bend; b++) {
    const PetscInt *node = sb_quadratic_nodes(s, b);
    SbPack w[30] = {{0}}, v[30], fe[30] = {{0}};

    if (stage->a) sb_gather_nodes(10, node, stage->a, w);
    if (alpha != 0.) sb_gather_nodes(10, node, stage->v, v);
    for (int k = 0; alpha != 0. && k < 30; k++) {
      for (int l = 0; l < SB_BATCH; l++) w[k][l] += alpha * v[k][l];
    }
    for (int q = 0; region->curve_g && q < SB_POINTS; q++) {
      const SbPoints at = SbBatchPoints(s, region, b);
      PetscReal phi[SB_CELL_NODES];
      SbPack here[3] = {{0}}, W;

      SbQuadraticBasis(at.rule->L[q], phi);
      SbPointVolume(&at, q, W);
      for (int k = 0; k < 30; k++) {
        for (int l = 0; l < SB_BATCH; l++) here[k % 3][l] += phi[k / 3] * w[k][l];
      }
      for (int k = 0; k < 30; k++) {
        for (int l = 0; l < SB_BATCH; l++)
          fe[k][l] += region->material->density * W[l] * phi[k / 3] * here[k % 3][l];
      }
    }
    for (int k = 0; !region->curve_g && k < 300; k++) {
      for (int l = 0; l < SB_BATCH; l++)
        fe[k / 30 * 3 + k % 3][l] += mass[k / 30][k / 3 % 10] * s->batch_V[b][l] * w[k % 30][l];
    }
    sb_scatter_nodes(10, node, s->batch_n[b], (const SbPack *)fe, f);
  }
}

/* The same of a P1, CR or DG region. */
static void add_linear_inertia(SbSpace s, const SbRegion *region, const SbStage *stage, PetscReal f[])
{
  const SbElementOps *e = &region->element->ops;
  const PetscReal alpha = stage->v ? region->alpha : 0.;

  for (PetscInt b = region->bstart; b < region->bend; b++) {
    const PetscInt *node = s->batch_node + 4 * SB_BATCH * b;
    SbPack w[12] = {{0}}, v[12], fe[12];

    if (stage->a) sb_gather(node, stage->a, w);
    if (alpha != 0.) sb_gather(node, stage->v, v);
    for (int k = 0; alpha != 0. && k < 12; k++) {
      for (int l = 0; l < SB_BATCH; l++) w[k][l] += alpha * v[k][l];
    }
    for (int k = 0; k < 12; k++) {
      for (int l = 0; l < SB_BATCH; l++) {
        const PetscReal sum = w[k % 3][l] + w[3 + k % 3][l] + w[6 + k % 3][l] + w[9 + k % 3][l];

        fe[k][l] = region->material->density * s->batch_V[b][l] *
                   ((e->mass_diagonal - e->mass_coupling) * w[k][l] + e->mass_coupling * sum);
      }
    }
    sb_scatter_add(node, s->batch_n[b], (const SbPack *)fe, f);
  }
}

void SbSpaceAddInertia(SbSpace s, const SbStage *stage, PetscReal f[])
{
  if (s->consistent_mass) {
    for (PetscInt r = 0; r < s->nregion; r++) {
      if (s->region[r].quadratic)
        add_quadratic_inertia(s, &s->region[r], stage, f);
      else
        add_linear_inertia(s, &s->region[r], stage, f);
    }
    return;
  }
  for (PetscInt i = 0; stage->a && i < 3 * s->nnode_owned; i++) f[i] += s->node_mass[i / 3] * stage->a[i];
  for (PetscInt r = 0; stage->v && r < s->nregion; r++) {
    if (s->region[r].alpha != 0.) add_lumped_damping(s, &s->region[r], stage->v, f);
  }
}

/* Cauchy stress P F^T / J of one lane, in the order xx yy zz xy yz xz. */
static void cauchy(const SbPack P[9], const SbPack F[9], PetscInt l, PetscReal J, PetscReal sigma[6])
{
  static const int row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};

  for (int k = 0; k < 6; k++) {
    PetscReal sum = 0.;

    for (int j = 0; j < 3; j++) sum += P[3 * row[k] + j][l] * F[3 * column[k] + j][l];
    sigma[k] = sum / J;
  }
}

static PetscReal lane_det(const SbPack F[9], PetscInt l)
{
  return F[0][l] * (F[4][l] * F[8][l] - F[5][l] * F[7][l]) -
         F[1][l] * (F[3][l] * F[8][l] - F[5][l] * F[6][l]) +
         F[2][l] * (F[3][l] * F[7][l] - F[4][l] * F[6][l]);
}

void SbSpaceCellState(SbSpace s, const PetscReal x[], PetscReal sigma[], PetscReal J[], PetscReal psi[])
{
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    for (PetscInt b = region->bstart; region->owned && b < region->bend; b++) {
      const SbPoints at = SbBatchPoints(s, region, b);
      SbPack F[SB_POINTS][9], P[SB_POINTS][9], energy[SB_POINTS];

      /* means over the points */
      SbBatchState(s, region, b, x, F, sigma ? P : NULL, psi ? energy : NULL, NULL);
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        const PetscInt c = s->batch_cell[b] + l;

        if (J) J[c] = 0.;
        if (psi) psi[c] = 0.;
        for (int k = 0; sigma && k < 6; k++) sigma[6 * c + k] = 0.;
        for (int q = 0; q < at.n; q++) {
          const PetscReal det = lane_det((const SbPack *)F[q], l), part = at.weight[q][l];
          PetscReal stress[6];

          if (J) J[c] += part * det;
          if (psi) psi[c] += part * energy[q][l];
          if (!sigma) continue;
          /* small strain has one stress: P itself */
          if (region->material->linear) {
            const int entry[6] = {0, 4, 8, 1, 5, 2};

            for (int k = 0; k < 6; k++) stress[k] = P[q][entry[k]][l];
          } else
            cauchy((const SbPack *)P[q], (const SbPack *)F[q], l, det, stress);
          for (int k = 0; k < 6; k++) sigma[6 * c + k] += part * stress[k];
        }
      }
    }
  }
}

/* Exact volumes of the cells of a P2 batch, and the least det F at the points of the rule for them. */
static void quadratic_volume(SbSpace s, PetscInt b, const SbPoints *at, const PetscReal x[], SbPack volume,
                             SbPack least)
{
  const SbPointRule *rule = SbVolumeRule(at);
  SbPack U[30], u[12], F[9];

  sb_gather_nodes(10, sb_quadratic_nodes(s, b), x, U);
  for (int q = 0; q < rule->n; q++) {
    SbQuadraticAt(rule->L[q], (const SbPack *)U, u);
    SbCellGradient(at->g + at->step * q, (const SbPack *)u, F);
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal det = lane_det((const SbPack *)F, l),
                      part = (at->step ? at->weight[q][l] : rule->weight[q]) * s->batch_V[b][l] * det;

      volume[l] = q ? volume[l] + part : part;
      least[l] = q ? PetscMin(least[l], det) : det;
    }
  }
}

void SbSpaceStrainEnergy(SbSpace s, const PetscReal x[], PetscReal body[], PetscReal *energy, PetscReal *minJ,
                         PetscInt *ninverted, PetscReal *volume)
{
  *energy = 0.;
  *volume = 0.;
  *minJ = PETSC_MAX_REAL;
  *ninverted = 0;
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    const PetscReal before = *energy;

    for (PetscInt b = region->bstart; region->owned && b < region->bend; b++) {
      const SbPoints at = SbBatchPoints(s, region, b);
      SbPack F[SB_POINTS][9], psi[SB_POINTS], exact = {0}, lowest;

      SbBatchState(s, region, b, x, F, NULL, psi, NULL);
      if (region->quadratic) quadratic_volume(s, b, &at, x, exact, lowest);
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal least = region->quadratic ? lowest[l] : PETSC_MAX_REAL;

        for (int q = 0; q < at.n; q++) {
          const PetscReal det = lane_det((const SbPack *)F[q], l), part = s->batch_V[b][l] * at.weight[q][l];

          *energy += part * psi[q][l];
          *volume += region->quadratic ? 0. : part * det;
          least = PetscMin(least, det);
        }
        *volume += exact[l];
        *minJ = PetscMin(*minJ, least);
        *ninverted += least <= 0.;
      }
    }
    if (body) body[region->body] += *energy - before;
  }
  if (s->jump) *energy += SbJumpEnergy(s, x, SB_JUMP_STIFFNESS, body);
}

/* The power of a P2 region's damping: its force times the velocity. */
static PetscErrorCode quadratic_power(SbSpace s, const SbRegion *region, const PetscReal x[],
                                      const PetscReal v[], PetscReal *power)
{
  const SbStage damped = {.u = x, .v = v}, still = {.u = x};
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(6 * s->nnode, &f));
  add_quadratic_force(s, region, &damped, f);
  add_quadratic_force(s, region, &still, f + 3 * s->nnode);
  add_lumped_damping(s, region, v, f);
  for (PetscInt i = 0; i < 3 * s->nnode; i++) *power += v[i] * (f[i] - f[3 * s->nnode + i]);
  PetscCall(PetscFree(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceDampingPower(SbSpace s, const PetscReal x[], const PetscReal v[], PetscReal *power)
{
  PetscFunctionBeginUser;
  *power = 0.;
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    const SbMaterial m = region->material;

    if (!region->owned || (region->alpha == 0. && region->beta == 0.)) continue;
    if (region->quadratic) {
      PetscCall(quadratic_power(s, region, x, v, power));
      continue;
    }
    for (PetscInt b = region->bstart; b < region->bend; b++) {
      SbPack u[12], F[9], H[9], dP[9];

      sb_gather_strain(s, region, b, x, u);
      SbCellGradient(s->batch_g + 9 * b, (const SbPack *)u, F);
      sb_gather_strain(s, region, b, v, u);
      SbCellGradientRate(s->batch_g + 9 * b, (const SbPack *)u, H);
      SbMaterialDampingStress(m, (const SbPack *)F, (const SbPack *)H, dP);
      sb_gather(s->batch_node + 4 * SB_BATCH * b, v, u);
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal hooke = 0., inertia = 0.;

        for (int k = 0; k < 9; k++) hooke += H[k][l] * dP[k][l];
        for (int k = 0; k < 12; k++) inertia += u[k][l] * u[k][l];
        *power += s->batch_V[b][l] * (region->beta * hooke + region->alpha * m->density *
                                                               region->element->ops.mass_lumped * inertia);
      }
    }
  }
  if (s->jump) *power += 2. * SbJumpEnergy(s, v, SB_JUMP_DAMPING, NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}
