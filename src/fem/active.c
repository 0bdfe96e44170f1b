/*
  Fibres that contract (src/material/active.c has the law): the tension of each cell, its energy,
  force and work. active_stress.c has the stress and the tangent. An active strain is one of
  eigenstrain.c.

  A tension is evaluated at the centre of a tet, where its fibre is, of owned cells and ghosts
  alike, and only when evaluations are of another time than before. In a static run one without t
  grows with the load factor, as loads do. It is a function of time and place: there is no history.

  The energy T phi is that of the incremental potential, and no energy that a body stores: fibres do
  work, as loads do (src/time/energy_balance.c).

  With a relation of force and velocity a step begins with the stretch l_0 and the rate r_0 of its
  fibres, from displacement and velocity. A time d later the rate is (l - l_0) / d (implicit Euler),
  or 2 (l - l_0) / d - r_0, of second order for the others; at the end of a step that of the
  velocities. Static runs have none.
*/
#include "active.h"

#define SAMPLES 200 /* times of a run at which the largest tension is looked for */

PetscErrorCode SbActiveCreate(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < s->mesh->nbody; b++) {
    for (PetscInt i = -1; i < s->mesh->body[b].ninclusion; i++) {
      const SbActive a = s->material[i < 0 ? b : s->mesh->body[b].inclusion[i].material]->active;

      s->active = (PetscBool)(s->active || a);
      s->active_rates = (PetscBool)(s->active_rates || (a && a->velocity > 0.));
    }
  }
  if (!s->active)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbLogNamed("Mat", "active", &s->active_event));
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    struct _p_SbContraction *a;

    if (!region->material->active)
      continue;
    PetscCall(PetscNew(&a));
    region->contraction = a;
    a->npoint = SbBatchPoints(s, region->bstart).n;
    if (region->material->active->velocity > 0.)
      PetscCall(PetscCalloc1(a->npoint * (region->bend - region->bstart), &a->rate));
    PetscCall(PetscCalloc2(region->bend - region->bstart, &a->tension,
                           region->bend - region->bstart, &a->most));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbActiveDestroyRegion(SbRegion *region)
{
  PetscFunctionBeginUser;
  if (!region->contraction)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree2(region->contraction->tension, region->contraction->most));
  PetscCall(PetscFree(region->contraction->rate));
  PetscCall(PetscFree(region->contraction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tensions of a region. */
static PetscErrorCode evaluate(SbSpace s, const SbRegion *region, PetscReal t, PetscReal load)
{
  const SbActive a = region->material->active;
  const PetscBool everywhere = (PetscBool)!SbFormulaUses(a->tension, 'x');
  PetscReal tension = 0.;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < SB_BATCH * (region->bend - region->bstart); k++) {
    const PetscInt b = region->bstart + k / SB_BATCH;
    const PetscInt l = k % SB_BATCH;
    PetscReal x[3];

    if (!k || !everywhere) {
      SbCellCentre(s->mesh, s->batch_cell[b] + (l < s->batch_n[b] ? l : 0), x);
      PetscCall(SbActiveTension(a, t, x, &tension));
    }
    region->contraction->tension[k / SB_BATCH][l] = (a->steady ? load : 1.) * tension;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceActiveAt(SbSpace s, PetscReal t, PetscReal load)
{
  PetscFunctionBeginUser;
  if (!s->active)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    struct _p_SbContraction *a = region->contraction;
    const PetscReal at = a && region->material->active->steady ? load : t;

    if (!a || (a->known && a->at == at))
      continue;
    PetscCall(PetscLogEventBegin(s->active_event, 0, 0, 0, 0));
    PetscCall(evaluate(s, region, t, load));
    PetscCall(PetscLogEventEnd(s->active_event, 0, 0, 0, 0));
    a->known = PETSC_TRUE;
    a->at = at;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rate of the fibres at a point whose step began with F and dF/dt = H. */
static void find_rate(const struct _p_SbActive *law, PetscReal elapsed, PetscBool second,
                      const SbPack Q[9], const SbPack F[9], const SbPack H[9], SbFibreRate *x)
{
  const PetscReal power = second ? 2. : 1.;

  x->slope = elapsed > 0. ? power / (elapsed * law->velocity) : 0.;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal v[3], dv[3];

    for (int i = 0; i < 3; i++) {
      v[i] = F[3 * i][l] * Q[0][l] + F[3 * i + 1][l] * Q[3][l] + F[3 * i + 2][l] * Q[6][l];
      dv[i] = H[3 * i][l] * Q[0][l] + H[3 * i + 1][l] * Q[3][l] + H[3 * i + 2][l] * Q[6][l];
    }
    const PetscReal stretch = PetscSqrtReal(SbDot3(v, v));
    const PetscReal rate = stretch > 0. ? SbDot3(v, dv) / stretch : 0.;
    x->start[l] = stretch;
    x->expected[l] = PetscMax(0., stretch + elapsed * rate);
    x->v[l] = (elapsed > 0. ? 1. - power : 1.) * rate / law->velocity;
  }
}

PetscErrorCode SbSpaceActiveRates(SbSpace s, PetscReal elapsed, PetscBool second, Vec U, Vec V)
{
  const PetscReal *u, *v;

  PetscFunctionBeginUser;
  if (!s->active_rates)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(s->active_event, 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(SbSpaceGetLocalRead(s, V, &v));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    struct _p_SbContraction *a = region->contraction;
    const PetscInt k = b - region->bstart;
    SbPack x[30], F[SB_POINTS][9], H[SB_POINTS][9];

    if (!a || !a->rate)
      continue;
    a->moving = PETSC_TRUE;
    SbBatchGradients(s, b, u, PETSC_FALSE, x, F);
    SbBatchGradients(s, b, v, PETSC_TRUE, x, H);
    for (int q = 0; q < a->npoint; q++)
      find_rate(region->material->active, elapsed, second, (const SbPack *)region->axes + 9 * k,
                (const SbPack *)F[q], (const SbPack *)H[q], &a->rate[a->npoint * k + q]);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, V, &v));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscLogEventEnd(s->active_event, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceActiveMost(SbSpace s, PetscReal from, PetscReal to)
{
  PetscFunctionBeginUser;
  for (int k = 0; k <= SAMPLES && s->active; k++) {
    PetscCall(SbSpaceActiveAt(s, from + (PetscReal)k / SAMPLES * (to - from), 1.));
    for (PetscInt r = 0; r < s->nregion; r++) {
      const struct _p_SbContraction *a = s->region[r].contraction;
      const PetscInt n = s->region[r].bend - s->region[r].bstart;

      for (PetscInt i = 0; a && i < SB_BATCH * n; i++)
        a->most[i / SB_BATCH][i % SB_BATCH] =
          PetscMax(a->most[i / SB_BATCH][i % SB_BATCH], a->tension[i / SB_BATCH][i % SB_BATCH]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbActiveStiffest(SbSpace s, const SbRegion *region, const PetscReal x[], PetscReal f[])
{
  for (PetscInt b = region->bstart; b < region->bend; b++) {
    const SbPoints at = SbBatchPoints(s, b);
    const PetscReal *T = region->contraction->most[b - region->bstart];
    SbPack U[30], H[SB_POINTS][9], P[9], fe[30];
    SbPack rest = {0};
    SbPack phi, G, c;

    SbActiveFactors(region->material->active, rest, NULL, phi, G, c);
    if (at.rule)
      memset(fe, 0, sizeof(fe));
    SbBatchGradients(s, b, x, PETSC_TRUE, U, H);
    for (int q = 0; q < at.n; q++) {
      SbFibrePoint fibres;

      SbFibresStrain(PETSC_FALSE, (const SbPack *)region->axes + 9 * (b - region->bstart),
                     (const SbPack *)H[q], &fibres);
      for (int k = 0; k < 9; k++)
        for (int l = 0; l < SB_BATCH; l++)
          P[k][l] = T[l] * PetscMax(1., G[l] + c[l]) * fibres.v[k / 3][l] * fibres.f[k % 3][l];
      SbPointForce(&at, q, (const SbPack *)P, fe);
    }
    sb_scatter_strain(s, b, fe, f);
  }
}

PetscReal SbSpaceActiveEnergy(SbSpace s, const PetscReal u[])
{
  PetscReal sum = 0.;

  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack U[30], F[SB_POINTS][9];
    SbFibrePoint x;

    if (!region->contraction)
      continue;
    SbBatchGradients(s, b, u, PETSC_FALSE, U, F);
    for (int q = 0; q < at.n; q++) {
      const PetscReal *T = SbFibresAt(region, b, q, (const SbPack *)F[q], &x);

      for (PetscInt l = 0; l < s->batch_n[b]; l++)
        sum += at.weight[q][l] * (*at.V)[l] * T[l] * x.phi[l];
    }
  }
  return sum;
}

void SbSpaceAddActiveForce(SbSpace s, const PetscReal u[], PetscReal f[])
{
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack U[30], F[SB_POINTS][9], fe[30];

    if (!region->contraction)
      continue;
    if (at.rule)
      memset(fe, 0, sizeof(fe));
    SbBatchGradients(s, b, u, PETSC_FALSE, U, F);
    for (int q = 0; q < at.n; q++) {
      SbPack P[9] = {{0.}};

      SbActiveStress(region, b, q, (const SbPack *)F[q], P);
      SbPointForce(&at, q, (const SbPack *)P, fe);
    }
    for (int k = 0; k < 3 * (at.rule ? 10 : 4); k++)
      for (int l = 0; l < SB_BATCH; l++)
        fe[k][l] = -fe[k][l];
    sb_scatter_strain(s, b, fe, f);
  }
}

void SbSpaceActiveTension(SbSpace s, const PetscReal u[], PetscReal value[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack U[30], F[SB_POINTS][9];
    SbFibrePoint x;

    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      value[s->batch_cell[b] + l] = 0.;
    if (!region->contraction)
      continue;
    SbBatchGradients(s, b, u, PETSC_FALSE, U, F);
    for (int q = 0; q < at.n; q++) {
      const PetscReal *T = SbFibresAt(region, b, q, (const SbPack *)F[q], &x);

      for (PetscInt l = 0; l < s->batch_n[b]; l++)
        value[s->batch_cell[b] + l] += at.weight[q][l] * T[l] * x.G[l];
    }
  }
}
