/*
  The history of viscoelastic cells (src/material/viscous.c has the law).

  At each point a cell keeps, of the end of the last step, the second Piola-Kirchhoff stress S of
  the part of the law that changes shape and the dilatation theta; and for each term i of the series
  what is left of their changes, H_i and p_i. P2 cells with the mean dilatation m (quadratic.c)
  have that, too, once for all points: with lambda_p the modulus at the points and K_p = lambda_p +
  2/3 mu their energy is, point by point and in the mean,

    psi_mu + (lambda_p - K_p)/2 theta^2   relaxes with g, by S
    K_p/2 (theta^2 - m^2)                 with g, by theta and m
    K/2 m^2                               with k, by m

  which is the law of the other elements where theta is even. A time d after the last step the
  energy of a cell is that of `scale` times the law `step`, and

    T : E + p theta + z m,   E = (F^T F - 1) / 2 (law linear: sym F - 1),

  T, p and z constant within the step (`dead`). So it has an energy, a symmetric tangent, and turns
  with the cell.

  Kelvin-Voigt: a stress D : dE/dt with D Hooke's tensor of the viscosities. In a step from E_0 and
  its rate R_0, by the velocities, dE/dt at its end is (E - E_0) / d (implicit Euler), or 2 (E -
  E_0) / d - R_0, of second order for the others: a Hooke's tensor on E with moduli D / d or 2 D /
  d, and a constant in T. At the end of a step: D : R, by the velocities.

  A run begins relaxed, whatever its initial displacement: H_i = 0. Static runs are relaxed, too.
  Ghosts have the history of their owners to the last bit, as lanes do not depend on each other.
*/
#include "viscous.h"

static PetscBool has_viscosity(const SbRegion *region)
{
  const PetscReal *eta = region->material->viscous->viscosity;

  return (PetscBool)(eta[0] != 0. || eta[1] != 0.);
}

/* What of number k relaxes with term i: g_i of S, a modulus times a fraction of theta and m, Pa. */
static PetscReal coefficient(const SbRegion *region, PetscInt i, int k)
{
  const SbMaterial m = region->material;
  const SbViscous v = m->viscous;
  const PetscReal at_points = SbMaterialBulkModulus(region->pointwise);

  if (k < 6)
    return v->shear[i];
  if (!region->history->mean)
    return v->bulk[i] * SbMaterialBulkModulus(m);
  return k == 6 ? v->shear[i] * at_points
                : v->bulk[i] * SbMaterialBulkModulus(m) - v->shear[i] * at_points;
}

/* Its rate with the gradient of the velocity h. */
SB_INLINE void rate_of(PetscBool linear, const PetscReal f[9], const PetscReal h[9],
                       PetscReal rate[6])
{
  for (int k = 0; k < 6; k++) {
    const int i = SbHistoryRow[k];
    const int j = SbHistoryColumn[k];

    rate[k] = 0.5 * (h[3 * i + j] + h[3 * j + i]);
    for (int n = 0; n < 9 && !linear; n += 3)
      rate[k] = (n ? rate[k] : 0.) + 0.5 * (f[n + i] * h[n + j] + h[n + i] * f[n + j]);
  }
}

/* The numbers of a law at the points of batch b, and F there. */
static void measure(SbSpace s, PetscInt b, const PetscReal x[], SbPack F[SB_POINTS][9],
                    SbPack now[SB_POINTS][SB_WIDTH])
{
  const SbRegion *region = s->batch_region[b];
  const struct _p_SbStressHistory *h = region->history;
  const SbPoints at = SbBatchPoints(s, b);
  const PetscReal lambda = SbMaterialMeanModulus(region->material);
  const PetscReal K = SbMaterialBulkModulus(region->pointwise);
  struct _p_SbMaterial own;
  const struct _p_SbMaterial *law = SbBatchAxes(region, region->pointwise, b, &own);
  SbPack U[30], P[9], D[9], p;

  SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
  if (h->mean)
    SbQuadraticVolume(region->material, &at, (const SbPack *)U, (const SbPack(*)[9])F, p, NULL);
  for (int q = 0; q < at.n; q++) {
    law->ops.stress(law, (const SbPack *)F[q], P);
    law->ops.dilatation(law, (const SbPack *)F[q], now[q][6]);
    law->ops.dilatation_gradient(law, (const SbPack *)F[q], D);
    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal f[9], c[9], t[9], S[9];

      /* S = F^-1 (P - K theta D) */
      SbPackGet(9, (const SbPack *)F[q], l, f);
      for (int k = 0; k < 9; k++)
        t[k] = P[k][l] - K * now[q][6][l] * D[k][l];
      SbMatCofactor(f, c);
      SbMatTransposeMul(c, t, S);
      const PetscReal J = SbDot3(f, c);
      for (int k = 0; k < 6; k++) {
        const int i = 3 * SbHistoryRow[k] + SbHistoryColumn[k];
        const int j = 3 * SbHistoryColumn[k] + SbHistoryRow[k];

        now[q][k][l] = law->linear ? 0.5 * (t[i] + t[j]) : 0.5 * (S[i] + S[j]) / J;
      }
      if (h->mean)
        now[q][7][l] = p[l] / lambda;
    }
  }
}

PetscErrorCode SbViscousCreate(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    const SbViscous v = region->material->viscous;
    struct _p_SbStressHistory *h;
    size_t points;

    if (!v)
      continue;
    PetscCall(PetscNew(&h));
    region->history = h;
    h->npoint = SbBatchPoints(s, region->bstart).n;
    h->mean = (PetscBool)(region->pointwise != region->material);
    h->width = h->mean ? 8 : 7;
    for (PetscInt i = 0; i < v->n; i++)
      h->pressures = (PetscBool)(h->pressures || h->mean || v->bulk[i] > 0.);
    points = (size_t)h->npoint * (size_t)(region->bend - region->bstart);
    PetscCall(PetscCalloc3(points * (size_t)h->width, &h->last,
                           points * (size_t)h->width * (size_t)v->n, &h->branch,
                           points * (size_t)h->width, &h->dead));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbViscousDestroy(SbRegion *region)
{
  struct _p_SbStressHistory *h = region->history;

  PetscFunctionBeginUser;
  if (!h)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree3(h->last, h->branch, h->dead));
  PetscCall(PetscFree(region->history));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceViscousStart(SbSpace s, Vec U)
{
  const PetscReal *u;

  PetscFunctionBeginUser;
  if (!s->viscous || s->viscous_began)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const struct _p_SbStressHistory *h = region->history;
    SbPack F[SB_POINTS][9], now[SB_POINTS][SB_WIDTH];

    if (!h)
      continue;
    measure(s, b, u, F, now);
    for (int q = 0; q < h->npoint; q++)
      memcpy(h->last + h->width * SbHistoryPoint(region, b, q), now[q],
             (size_t)h->width * sizeof(SbPack));
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  s->viscous_began = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law of every viscoelastic region at a time after the last step. */
static void set_elapsed(SbSpace s, PetscReal elapsed)
{
  for (PetscInt r = 0; r < s->nregion; r++)
    if (s->region[r].history)
      SbViscousSetElapsed(s->region[r].material, elapsed);
}

/* T += the constant part of the stress of viscosities. */
static void add_viscosity(SbSpace s, PetscInt b, PetscReal elapsed, PetscBool second,
                          const PetscReal u[], const PetscReal v[])
{
  const SbRegion *region = s->batch_region[b];
  const struct _p_SbStressHistory *h = region->history;
  const PetscReal *eta = region->material->viscous->viscosity;
  const PetscReal lambda = eta[1] - 2. / 3. * eta[0];
  const PetscBool linear = region->material->linear;
  SbPack U[30], F[SB_POINTS][9], H[SB_POINTS][9];

  SbBatchGradients(s, b, u, PETSC_FALSE, U, F);
  SbBatchGradients(s, b, v, PETSC_TRUE, U, H);
  for (int q = 0; q < h->npoint; q++) {
    SbPack *dead = h->dead + h->width * SbHistoryPoint(region, b, q);

    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal f[9], g[9], E[6], rate[6];
      PetscReal S[6] = {0.};

      SbPackGet(9, (const SbPack *)F[q], l, f);
      SbPackGet(9, (const SbPack *)H[q], l, g);
      rate_of(linear, f, g, rate);
      SbHistoryAddHooke(lambda, eta[0], rate, S);
      if (elapsed > 0.) {
        for (int k = 0; k < 6; k++)
          S[k] *= second ? -1. : 0.;
        SbHistoryStrain(linear, f, E);
        SbHistoryAddHooke(-h->hooke[0], -h->hooke[1], E, S);
      }
      for (int k = 0; k < 6; k++)
        dead[k][l] += S[k];
    }
  }
}

PetscErrorCode SbSpaceViscousAt(SbSpace s, PetscReal elapsed, PetscBool second, Vec U, Vec V)
{
  const PetscReal *u = NULL;
  const PetscReal *v = NULL;

  PetscFunctionBeginUser;
  if (!s->viscous)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(s->viscous_event, 0, 0, 0, 0));
  set_elapsed(s, elapsed);
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(SbSpaceGetLocalRead(s, V, &v));
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    struct _p_SbStressHistory *h = region->history;
    const SbViscous series = region->material->viscous;
    PetscReal of_last[SB_WIDTH];

    if (!h)
      continue;
    h->acting = PETSC_TRUE;

    /* moduli of viscosities on E */
    h->hooke[1] = elapsed > 0. ? (second ? 2. : 1.) * series->viscosity[0] / elapsed : 0.;
    h->hooke[0] = (elapsed > 0. ? (second ? 2. : 1.) * series->viscosity[1] / elapsed : 0.) -
                  2. / 3. * h->hooke[1];

    /* what is left of the branches, and what the law had at the last step */
    for (int k = 0; k < h->width; k++) {
      of_last[k] = 0.;
      for (PetscInt i = 0; i < series->n; i++)
        of_last[k] += coefficient(region, i, k) * series->mean[i];
    }
    for (PetscInt p = 0; p < h->npoint * (region->bend - region->bstart); p++) {
      const SbPack *last = (const SbPack *)h->last + h->width * p;
      SbPack *dead = h->dead + h->width * p;

      for (int k = 0; k < h->width; k++) {
        for (int l = 0; l < SB_BATCH; l++)
          dead[k][l] = -of_last[k] * last[k][l];
        for (PetscInt i = 0; i < series->n; i++) {
          const SbPack *branch = (const SbPack *)h->branch + h->width * (series->n * p + i);

          for (int l = 0; l < SB_BATCH; l++)
            dead[k][l] += series->decay[i] * branch[k][l];
        }
      }
    }
    for (PetscInt b = region->bstart; has_viscosity(region) && b < region->bend; b++)
      add_viscosity(s, b, elapsed, second, u, v);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, V, &v));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscLogEventEnd(s->viscous_event, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work of the branches in lane l at a point on the way from f0 to f1, J/m^3. */
static PetscReal work_of(PetscBool linear, int width, const PetscReal f0[9], const PetscReal f1[9],
                         const PetscReal last[], const PetscReal now[], const PetscReal sum[])
{
  PetscReal E[2][6];
  PetscReal work = 0.;

  SbHistoryStrain(linear, f0, E[0]);
  SbHistoryStrain(linear, f1, E[1]);
  for (int k = 0; k < 6; k++)
    work += SbHistoryOften[k] * 0.5 * sum[k] * (E[1][k] - E[0][k]);
  for (int k = 6; k < width; k++)
    work += 0.5 * sum[k] * (now[k] - last[k]);
  return work;
}

/* The history of a batch goes on by a step; work[term]: that of the branches of owned cells, J. */
static void advance(SbSpace s, PetscInt b, const PetscReal u0[], const PetscReal u1[],
                    PetscReal work[])
{
  const SbRegion *region = s->batch_region[b];
  const struct _p_SbStressHistory *h = region->history;
  const SbPoints at = SbBatchPoints(s, b);
  const SbViscous v = region->material->viscous;
  const PetscBool linear = region->material->linear;
  SbPack U[30], F0[SB_POINTS][9], F[SB_POINTS][9], now[SB_POINTS][SB_WIDTH];

  if (v->n)
    measure(s, b, u1, F, now);
  if (v->n && work)
    SbBatchGradients(s, b, u0, PETSC_FALSE, U, F0);
  for (int q = 0; q < h->npoint && v->n; q++) {
    SbPack *last = h->last + h->width * SbHistoryPoint(region, b, q);

    for (PetscInt i = 0; i < v->n; i++) {
      SbPack *branch = h->branch + h->width * (v->n * SbHistoryPoint(region, b, q) + i);
      SbPack sum[SB_WIDTH];

      for (int k = 0; k < h->width; k++) {
        const PetscReal c = coefficient(region, i, k) * v->mean[i];

        for (int l = 0; l < SB_BATCH; l++) {
          const PetscReal before = branch[k][l];

          branch[k][l] = v->decay[i] * before + c * (now[q][k][l] - last[k][l]);
          sum[k][l] = before + branch[k][l];
        }
      }
      for (PetscInt l = 0; work && l < s->batch_n[b]; l++) {
        PetscReal f0[9], f1[9], one[SB_WIDTH], then[SB_WIDTH], stress[SB_WIDTH];

        SbPackGet(9, (const SbPack *)F0[q], (int)l, f0);
        SbPackGet(9, (const SbPack *)F[q], (int)l, f1);
        SbPackGet(h->width, (const SbPack *)last, (int)l, then);
        SbPackGet(h->width, (const SbPack *)now[q], (int)l, one);
        SbPackGet(h->width, (const SbPack *)sum, (int)l, stress);
        work[i] +=
          at.weight[q][l] * (*at.V)[l] * work_of(linear, h->width, f0, f1, then, one, stress);
      }
    }
    memcpy(last, now[q], (size_t)h->width * sizeof(SbPack));
  }
}

PetscErrorCode SbSpaceViscousAdvance(SbSpace s, PetscReal dt, Vec U0, Vec U1, PetscReal *loss)
{
  const PetscReal *u0, *u1;
  PetscReal(*work)[SB_PRONY_TERMS];
  PetscInt nmaterial = s->mesh->nbody;

  PetscFunctionBeginUser;
  if (!s->viscous)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt b = 0; b < s->mesh->nbody; b++)
    nmaterial += s->mesh->body[b].ninclusion;
  PetscCall(PetscLogEventBegin(s->viscous_event, 0, 0, 0, 0));
  PetscCall(PetscCalloc1(nmaterial, &work));
  PetscCall(SbSpaceGetLocalRead(s, U0, &u0));
  PetscCall(SbSpaceGetLocalRead(s, U1, &u1));
  set_elapsed(s, dt);
  for (PetscInt b = 0; b < s->nbatch; b++)
    if (s->batch_region[b]->history)
      advance(s, b, u0, u1,
              loss && b < s->nbatch_owned ? work[s->mesh->cell_material[s->batch_cell[b]]] : NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, U1, &u1));
  PetscCall(SbSpaceRestoreLocalRead(s, U0, &u0));
  s->viscous_began = PETSC_TRUE;

  /* the energy w of a branch: dw = H : dE - 2 w dt / tau, what it loses */
  if (loss)
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, work, (PetscMPIInt)(nmaterial * SB_PRONY_TERMS),
                               MPIU_REAL, MPI_SUM, s->comm));
  for (PetscInt m = 0; loss && m < nmaterial; m++) {
    const SbViscous v = s->material[m]->viscous;

    for (PetscInt i = 0; v && i < v->n; i++) {
      const PetscReal x = 2. * dt / v->time[i];
      const PetscReal before = v->stored[i];

      v->stored[i] = PetscExpReal(-x) * before - expm1(-x) / x * work[m][i];
      *loss += work[m][i] - (v->stored[i] - before);
    }
  }
  PetscCall(PetscFree(work));
  PetscCall(PetscLogEventEnd(s->viscous_event, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbSpaceViscousStored(SbSpace s, PetscInt body)
{
  PetscReal sum = 0.;

  for (PetscInt b = 0; b < s->mesh->nbody && s->viscous; b++) {
    for (PetscInt k = -1; k < s->mesh->body[b].ninclusion && (body < 0 || body == b); k++) {
      const SbViscous v = s->material[k < 0 ? b : s->mesh->body[b].inclusion[k].material]->viscous;

      for (PetscInt i = 0; v && i < v->n; i++)
        sum += v->stored[i];
    }
  }
  return sum;
}

/* The stress D : R of viscosities in lane l, and E. */
static void viscosity_stress(const SbRegion *region, const SbPack F[9], const SbPack H[9], int l,
                             PetscReal S[6], PetscReal strain[6])
{
  const PetscReal *eta = region->material->viscous->viscosity;
  PetscReal f[9], h[9], rate[6];

  SbPackGet(9, F, l, f);
  SbPackGet(9, H, l, h);
  rate_of(region->material->linear, f, h, rate);
  memset(S, 0, 6 * sizeof(*S));
  SbHistoryAddHooke(eta[1] - 2. / 3. * eta[0], eta[0], rate, S);
  SbHistoryStrain(region->material->linear, f, strain);
}

PetscErrorCode SbSpaceViscousWork(SbSpace s, const Vec U[2], const Vec V[2], PetscReal *loss)
{
  const PetscReal *u[2], *v[2];
  PetscReal sum = 0.;

  PetscFunctionBeginUser;
  if (!s->viscous)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 2; k++) {
    PetscCall(SbSpaceGetLocalRead(s, U[k], &u[k]));
    PetscCall(SbSpaceGetLocalRead(s, V[k], &v[k]));
  }
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack x[30], F[2][SB_POINTS][9], H[2][SB_POINTS][9];

    if (!region->history || !has_viscosity(region))
      continue;
    for (int k = 0; k < 2; k++) {
      SbBatchGradients(s, b, u[k], PETSC_FALSE, x, F[k]);
      SbBatchGradients(s, b, v[k], PETSC_TRUE, x, H[k]);
    }
    for (int q = 0; q < at.n; q++) {
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        PetscReal S[2][6], strain[2][6];

        for (int k = 0; k < 2; k++)
          viscosity_stress(region, (const SbPack *)F[k][q], (const SbPack *)H[k][q], (int)l, S[k],
                           strain[k]);
        for (int k = 0; k < 6; k++)
          sum += at.weight[q][l] * (*at.V)[l] * SbHistoryOften[k] * 0.5 * (S[0][k] + S[1][k]) *
                 (strain[1][k] - strain[0][k]);
      }
    }
  }
  for (int k = 0; k < 2; k++) {
    PetscCall(SbSpaceRestoreLocalRead(s, V[k], &v[k]));
    PetscCall(SbSpaceRestoreLocalRead(s, U[k], &u[k]));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPIU_REAL, MPI_SUM, s->comm));
  *loss += sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}
