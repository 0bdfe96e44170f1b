/*
  Cells of P2: strains at the four points of SbRuleQuadratic, and the volumetric energy.

  A law is psi = psi_mu(F) + lambda/2 theta(F)^2 (SbMaterialOps). With theta at each of the
  points all of them would be constrained near nu = 1/2, and the element would lock. Here the energy
  of a cell is

    W = sum_q w_q V (psi_mu(F_q) + lambda_p/2 theta(F_q)^2) + V lambda_m/2 m^2,
    m = (1/V) int theta dV,   lambda_p = min(lambda, SB_POINT_MODULUS mu),   lambda_m = lambda -
    lambda_p:

  one constraint and one constant pressure per cell (P2/P0; Simo, Taylor and Pister 1985 for J - 1).
  With all of lambda by the mean, what theta varies by within a cell would have no stiffness but
  that of the shape, and the cell would be too soft in bending: lambda_p is of the points.
  Force, tangent and stress follow from W. Where theta is J - 1, m is the exact change of the volume
  of the cell: det F is cubic. Otherwise m is that of the four points, exact for linear and stvk.

  Pressures of single cells may oscillate on coarse meshes supported all around; means at vertices
  do not.

  Cells that are curved at rest form separate regions, with gradients and a fraction of the volume
  at each of the points of SbRuleQuintic, whose degree suffices: constant stress and pressure are in
  equilibrium.
*/
#include "fem_impl.h"

SbPoints SbBatchPoints(SbSpace s, PetscInt b)
{
  static const SbPack one[1] = {{[0 ... SB_BATCH - 1] = 1.}};
  static const SbPack quarter[4] = {[0 ... 3] = {[0 ... SB_BATCH - 1] = 0.25}};
  const SbRegion *region = s->batch_region[b];
  const PetscInt k = SB_POINTS * (b - region->bstart);
  SbPoints at = {1,  0, NULL, (const SbPack *)s->batch_g + 9 * b, (const SbPack *)s->batch_V + b,
                 one};

  if (region->curve_g)
    at = (SbPoints){SB_POINTS,      9,
                    &SbRuleQuintic, (const SbPack *)region->curve_g + 9 * k,
                    at.V,           (const SbPack *)region->curve_weight + k};
  else if (region->quadratic)
    at = (SbPoints){4, 0, &SbRuleQuadratic, at.g, at.V, quarter};
  return at;
}

void SbBatchGradients(SbSpace s, PetscInt b, const PetscReal x[], PetscBool rate, SbPack U[30],
                      SbPack F[SB_POINTS][9])
{
  const SbPoints at = SbBatchPoints(s, b);

  if (x)
    sb_gather_strain(s, b, x, U);
  else
    memset(U, 0, 30 * sizeof(SbPack));
  for (int q = 0; q < at.n; q++) {
    const SbPack *g = at.g + at.step * q;
    SbPack here[12];
    SbPack *u = at.rule ? here : U;

    if (at.rule)
      SbQuadraticAt(at.rule->L[q], (const SbPack *)U, here);
    SbCellGradient(g, (const SbPack *)u, rate ? 0. : 1., F[q]);
  }
}

void SbPointForce(const SbPoints *at, int q, const SbPack P[9], SbPack f[30])
{
  SbPack W, corner[12];

  if (!at->rule) {
    SbCellForce(at->g, *at->V, P, f);
    return;
  }
  SbPointVolume(at, q, W);
  SbCellForce(at->g + at->step * q, W, P, corner);
  SbQuadraticAdd(at->rule->L[q], (const SbPack *)corner, f);
}

void SbQuadraticVolume(const struct _p_SbMaterial *m, const SbPoints *at, const SbPack U[30],
                       const SbPack F[SB_POINTS][9], SbPack pressure, SbPack b[30])
{
  const PetscBool cubic =
    (PetscBool)(m->jacobian && !at->step); /* det F is cubic: more points than the law's */
  const SbPointRule *rule = cubic ? &SbRuleCubic : at->rule;
  const PetscReal lambda = SbMaterialMeanModulus(m);

  for (int l = 0; l < SB_BATCH; l++)
    pressure[l] = 0.;
  if (b)
    memset(b, 0, 30 * sizeof(SbPack));
  for (int q = 0; q < rule->n; q++) {
    const SbPack *g = at->g + at->step * q;
    const SbPack *here = cubic ? NULL : F[q];
    struct _p_SbMaterial copy;
    const struct _p_SbMaterial *law = SbLawAt(m, q, &copy);
    SbPack u[12], own[9], D[9], p, W, f[12];

    if (cubic) {
      SbQuadraticAt(rule->L[q], U, u);
      SbCellGradient(g, (const SbPack *)u, 1., own);
      here = (const SbPack *)own;
    }
    if (!law->inner && (law->linear || law->ops.frame || law->ops.spin)) {
      // theta = R : F - 3, with its derivative
      law->ops.dilatation_gradient(law, here, D);
      for (int l = 0; l < SB_BATCH; l++)
        p[l] = 3. * lambda;
      for (int k = 0; k < 9; k++)
        for (int l = 0; l < SB_BATCH; l++)
          p[l] -= lambda * D[k][l] * here[k][l];
    } else {
      law->ops.dilatation(law, here, p);
      for (int l = 0; l < SB_BATCH; l++)
        p[l] *= -lambda;
      if (b)
        law->ops.dilatation_gradient(law, here, D);
    }
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal weight = cubic ? rule->weight[q] : at->weight[q][l];

      pressure[l] -= weight * p[l];
      W[l] = weight * (*at->V)[l];
    }
    if (!b)
      continue;
    SbCellForce(g, W, (const SbPack *)D, f);
    SbQuadraticAdd(rule->L[q], (const SbPack *)f, b);
  }
}

void SbBatchMass(SbSpace s, PetscInt b, SbPack mass[SB_PAIRS])
{
  const SbRegion *region = s->batch_region[b];
  const SbPoints at = SbBatchPoints(s, b);
  const int npair = region->quadratic ? SB_PAIRS : 10;

  for (int k = 0; k < npair; k++) {
    const int i = SbPairA[k];
    const int j = SbPairB[k];
    const SbElementOps *e = &region->element->ops;
    const PetscReal straight = region->quadratic ? SbQuadraticMass(i, j)
                               : i == j          ? e->mass_diagonal
                                                 : e->mass_coupling;

    for (int l = 0; l < SB_BATCH; l++)
      mass[k][l] = at.step ? 0. : straight * (*at.V)[l];
  }
  for (int q = 0; at.step && q < at.n; q++) {
    PetscReal phi[SB_CELL_NODES];
    SbPack W;

    SbQuadraticBasis(at.rule->L[q], phi);
    SbPointVolume(&at, q, W);
    for (int k = 0; k < npair; k++)
      for (int l = 0; l < SB_BATCH; l++)
        mass[k][l] += phi[SbPairA[k]] * phi[SbPairB[k]] * W[l];
  }
}

/* SbBatchState() of a viscoelastic material: what the mean dilatation, by its pressure p without
   history, contributes at n points. */
static void add_mean_history(const SbRegion *region, PetscInt b, int n, const SbPack p,
                             SbPack P[SB_POINTS][9], SbPack psi[SB_POINTS],
                             SbPack pressure[SB_POINTS], const SbPack F[SB_POINTS][9])
{
  const SbMaterial m = region->material;
  const PetscReal lambda = SbMaterialMeanModulus(m);
  const PetscReal *constant, *in_energy;
  PetscReal factor, of_energy;

  SbViscousMean(region, b, PETSC_FALSE, &factor, &constant);
  SbViscousMean(region, b, PETSC_TRUE, &of_energy, &in_energy);
  for (int q = 0; q < n; q++) {
    SbPack D[9];

    if (P)
      m->ops.dilatation_gradient(m, F[q], D);
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal tension = factor * p[l] + constant[l];

      for (int k = 0; P && k < 9; k++)
        P[q][k][l] += tension * D[k][l];
      if (psi)
        psi[q][l] += (of_energy * p[l] / 2. + in_energy[l]) * p[l] / lambda;
      if (pressure)
        pressure[q][l] -= tension;
    }
  }
}

/* The pressure of a law with strains without stress, whose dilatation is r theta, from that. */
static void per_grown_volume(const struct _p_SbMaterial *law, SbPack pressure)
{
  for (int l = 0; law->stretch && l < SB_BATCH; l++)
    pressure[l] /= law->stretch[2][l];
}

void SbBatchState(SbSpace s, PetscInt b, const PetscReal x[], SbPack F[SB_POINTS][9],
                  SbPack P[SB_POINTS][9], SbPack psi[SB_POINTS], SbPack pressure[SB_POINTS])
{
  const SbRegion *region = s->batch_region[b];
  const SbMaterial m = region->pointwise;
  const SbPoints at = SbBatchPoints(s, b);
  struct _p_SbMaterial own, whole, here;
  const struct _p_SbMaterial *law = SbBatchLaw(region, m, b, &own);
  const struct _p_SbMaterial *volume_law = SbBatchVolumeLaw(region, b, &whole);
  SbPack U[30], p;

  SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
  for (int q = 0; q < at.n; q++) {
    SbPointLaw(region, b, q, &own);
    if (P)
      law->ops.stress(law, (const SbPack *)F[q], P[q]);
    if (psi)
      law->ops.energy(law, (const SbPack *)F[q], psi[q]);
    if (pressure)
      SbMaterialPressure(region->history || region->eigen ? law : m, (const SbPack *)F[q],
                         pressure[q]);
    if (pressure)
      per_grown_volume(law, pressure[q]);
    if (region->history && P)
      SbViscousStress(region, law, b, q, (const SbPack *)F[q], P[q]);
    if (region->contraction && P)
      SbActiveStress(region, b, q, (const SbPack *)F[q], P[q]);
    if (region->history && psi)
      SbViscousEnergy(region, law, b, q, (const SbPack *)F[q], psi[q]);
    if (region->history && pressure)
      SbViscousPressure(region, b, q, pressure[q]);
  }
  if (m == region->material)
    return;

  /* contribution of the mean theta */
  const PetscReal lambda = SbMaterialMeanModulus(region->material);

  SbQuadraticVolume(volume_law, &at, (const SbPack *)U, (const SbPack(*)[9])F, p, NULL);
  if (region->history) {
    add_mean_history(region, b, at.n, p, P ? P : NULL, psi, pressure, (const SbPack(*)[9])F);
    return;
  }
  for (int q = 0; q < at.n; q++) {
    const struct _p_SbMaterial *volume = SbLawAt(volume_law, q, &here);
    SbPack D[9], mean;

    if (P)
      volume->ops.dilatation_gradient(volume, (const SbPack *)F[q], D);
    for (int k = 0; P && k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        P[q][k][l] += p[l] * D[k][l];
    for (int l = 0; l < SB_BATCH; l++)
      if (psi)
        psi[q][l] += p[l] * p[l] / (2. * lambda);
    memcpy(mean, p, sizeof(mean));
    per_grown_volume(volume, mean);
    for (int l = 0; pressure && l < SB_BATCH; l++)
      pressure[q][l] -= mean[l];
  }
}
