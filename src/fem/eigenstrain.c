/*
  Strains without stress of the cells (src/material/eigenstrain.c has the law): growth, thermal
  expansion, prestrain, active strain.

  They are evaluated for owned cells and ghosts alike, and only when evaluations are of another time
  than before: of P1, CR and DG at the centre of a tet, of P2 at each point of its rule where they
  depend on the place, so that a linear temperature is exact. An active strain is that of the
  centre. In a static run strains without t grow with the load factor, as loads do. There is no
  history.

  A load step begins with the stresses of the last equilibrium (linear_stress.c): those of its
  displacement with the new strains are far from any near nu = 1/2, and a tangent with them is
  indefinite. So the strains of the last equilibrium are kept for the first tangent.

  They change the law of a batch (SbBatchAxes()) and the energy that it stores. Their work in a step
  is that of the forces q on the logarithms of the stretches, (q_0 + q_1)/2 . (ln l_1 - ln l_0).
*/
#include "fem_impl.h"

/* What a region keeps at a point: of the work the two forces, J, and the logarithms at its end. */
#define LAST 5

/* Points of a cell with strains of their own. */
static PetscInt own_points(const SbRegion *region)
{
  return region->eigen->step ? region->eigen->npoint : 1;
}

PetscErrorCode SbEigenCreate(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < s->mesh->nbody; b++) {
    for (PetscInt i = -1; i < s->mesh->body[b].ninclusion; i++) {
      const SbEigenstrain e =
        s->material[i < 0 ? b : s->mesh->body[b].inclusion[i].material]->eigen;

      s->eigen = (PetscBool)(s->eigen || e);
      s->grows = (PetscBool)(s->grows || (e && e->grows));
      s->active_strain = (PetscBool)(s->active_strain || (e && e->formula[SB_EIGEN_ACTIVE]));
    }
  }
  if (!s->eigen)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbLogNamed("Mat", "eigenstrain", &s->eigen_event));
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    const PetscInt n = region->bend - region->bstart;
    struct _p_SbEigenState *e;

    if (!region->material->eigen)
      continue;
    PetscCall(PetscNew(&e));
    region->eigen = e;
    e->npoint = SbBatchPoints(s, region->bstart).n;
    e->step = region->quadratic && region->material->eigen->varies ? 3 : 0;
    PetscCall(PetscMalloc1(3 * own_points(region) * n, &e->stretch));
    PetscCall(
      PetscCalloc2(3 * own_points(region) * n, &e->log, LAST * own_points(region) * n, &e->last));
    for (PetscInt k = 0; k < 3 * own_points(region) * n * SB_BATCH; k++)
      e->stretch[k / SB_BATCH][k % SB_BATCH] = 1.;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEigenDestroyRegion(SbRegion *region)
{
  PetscFunctionBeginUser;
  if (!region->eigen)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(region->eigen->stretch));
  PetscCall(PetscFree(region->eigen->kept));
  PetscCall(PetscFree2(region->eigen->log, region->eigen->last));
  PetscCall(PetscFree(region->eigen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Point q of lane l of a batch of P2 at rest, m. */
static void place_of(SbSpace s, PetscInt b, int q, PetscInt l, PetscReal x[3])
{
  const PetscInt *node = sb_batch_nodes(s, b);
  PetscReal phi[SB_CELL_NODES];

  SbQuadraticBasis(SbBatchPoints(s, b).rule->L[q], phi);
  for (int k = 0; k < 3; k++) {
    x[k] = 0.;
    for (int a = 0; a < SB_CELL_NODES; a++)
      x[k] += phi[a] * s->node_x[3 * node[a * SB_BATCH + l] + k];
  }
}

/* The strains of a region. */
static PetscErrorCode evaluate(SbSpace s, const SbRegion *region, PetscReal t, PetscReal load)
{
  const struct _p_SbEigenState *e = region->eigen;
  const SbFormula active = region->material->eigen->formula[SB_EIGEN_ACTIVE];
  const PetscBool field = (PetscBool)(region->material->eigen->field[0] != 0);
  const PetscBool everywhere = (PetscBool) !(region->material->eigen->varies || field ||
                                             (active && SbFormulaUses(active, 'x')));
  const PetscInt n = own_points(region);
  SbEigenPlace place = {.t = t, .load = load, .field = 1.};
  SbEigenstretch at;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n * SB_BATCH * (region->bend - region->bstart); i++) {
    const PetscInt k = i / SB_BATCH; /* batch and point */
    const PetscInt b = region->bstart + k / n;
    const PetscInt l = i % SB_BATCH < s->batch_n[b] ? i % SB_BATCH : 0;

    if (!i || !everywhere) {
      SbCellCentre(s->mesh, s->batch_cell[b] + l, place.centre);
      memcpy(place.x, place.centre, sizeof(place.x));
      if (e->step)
        place_of(s, b, (int)(k % n), l, place.x);
      if (field)
        place.field = s->mesh->temperature[s->batch_cell[b] + l];
      PetscCall(SbEigenstrainAt(region->material, &place, &at));
    }
    e->stretch[3 * k][i % SB_BATCH] = at.along;
    e->stretch[3 * k + 1][i % SB_BATCH] = at.across;
    e->stretch[3 * k + 2][i % SB_BATCH] = at.root;
    e->log[3 * k][i % SB_BATCH] = at.log[0];
    e->log[3 * k + 1][i % SB_BATCH] = at.log[1];
    e->log[3 * k + 2][i % SB_BATCH] = at.active;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceEigenAt(SbSpace s, PetscReal t, PetscReal load)
{
  PetscFunctionBeginUser;
  if (!s->eigen)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt r = 0; r < s->nregion; r++) {
    struct _p_SbEigenState *e = s->region[r].eigen;
    const PetscReal at = e && s->region[r].material->eigen->changes ? t : 0.;

    if (!e || (e->known && e->at[0] == at && e->at[1] == load))
      continue;
    PetscCall(PetscLogEventBegin(s->eigen_event, 0, 0, 0, 0));
    PetscCall(evaluate(s, &s->region[r], t, load));
    PetscCall(PetscLogEventEnd(s->eigen_event, 0, 0, 0, 0));
    e->known = PETSC_TRUE;
    e->at[0] = at;
    e->at[1] = load;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceEigenKeep(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < s->nregion; r++) {
    const PetscInt n = s->region[r].bend - s->region[r].bstart;
    struct _p_SbEigenState *e = s->region[r].eigen;

    if (!e)
      continue;
    if (!e->kept)
      PetscCall(PetscMalloc1(3 * own_points(&s->region[r]) * n, &e->kept));
    PetscCall(PetscArraycpy(e->kept, e->stretch, 3 * own_points(&s->region[r]) * n));
    e->fresh = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbEigenExchangeKept(SbSpace s)
{
  for (PetscInt r = 0; r < s->nregion; r++) {
    struct _p_SbEigenState *e = s->region[r].eigen;
    SbPack *now = e ? e->stretch : NULL;

    if (!e || !e->fresh)
      continue;
    e->stretch = e->kept;
    e->kept = now;
  }
}

void SbEigenForgetKept(SbSpace s)
{
  for (PetscInt r = 0; r < s->nregion; r++)
    if (s->region[r].eigen)
      s->region[r].eigen->fresh = PETSC_FALSE;
}

/* Forces on the strains of a batch, J, [own points][2]. */
static void batch_force(SbSpace s, PetscInt b, const PetscReal u[], SbPack force[SB_POINTS][2])
{
  const SbRegion *region = s->batch_region[b];
  const SbPoints at = SbBatchPoints(s, b);
  const PetscInt n = own_points(region);
  struct _p_SbMaterial own, whole;
  const struct _p_SbMaterial *law = SbBatchLaw(region, region->pointwise, b, &own);
  SbPack U[30], F[SB_POINTS][9], one[2];
  SbPack p = {0};

  memset(force, 0, 2 * (size_t)n * sizeof(SbPack));
  SbBatchGradients(s, b, u, PETSC_FALSE, U, F);
  if (region->pointwise != region->material)
    SbQuadraticVolume(SbBatchVolumeLaw(region, b, &whole), &at, (const SbPack *)U,
                      (const SbPack(*)[9])F, p, NULL);
  for (int q = 0; q < at.n; q++) {
    SbPointLaw(region, b, q, &own);
    SbEigenForce(law, (const SbPack *)F[q], p, one);
    for (int k = 0; k < 2; k++)
      for (int l = 0; l < SB_BATCH; l++)
        force[n == 1 ? 0 : q][k][l] += at.weight[q][l] * (*at.V)[l] * one[k][l];
  }
}

void SbSpaceEigenWork(SbSpace s, const PetscReal u[], PetscBool first, PetscReal work[2])
{
  work[0] = work[1] = 0.;
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const struct _p_SbEigenState *e = region->eigen;
    SbPack force[SB_POINTS][2];

    if (!e)
      continue;
    batch_force(s, b, u, force);
    for (PetscInt q = 0; q < own_points(region); q++) {
      const PetscInt k = own_points(region) * (b - region->bstart) + q;
      SbPack *last = e->last + LAST * k;
      SbPack *now = e->log + 3 * k;

      for (PetscInt l = 0; !first && l < s->batch_n[b]; l++) {
        const PetscReal along = (last[0][l] + force[q][0][l]) / 2.;
        const PetscReal across = (last[1][l] + force[q][1][l]) / 2.;
        const PetscReal active = (along - across / 2.) * (now[2][l] - last[4][l]);

        work[0] += active;
        work[1] += along * (now[0][l] - last[2][l]) + across * (now[1][l] - last[3][l]) - active;
      }
      memcpy(last, force[q], 2 * sizeof(SbPack));
      memcpy(last + 2, now, 3 * sizeof(SbPack));
    }
  }
}

void SbSpaceCellGrowth(SbSpace s, PetscReal value[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);

    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      PetscReal *J = &value[s->batch_cell[b] + l];

      *J = region->eigen ? 0. : 1.;
      for (int q = 0; region->eigen && q < at.n; q++) {
        const PetscInt k =
          own_points(region) * (b - region->bstart) + (region->eigen->step ? q : 0);
        const SbPack *log = (const SbPack *)region->eigen->log + 3 * k;

        *J += at.weight[q][l] * PetscExpReal(log[0][l] + 2. * log[1][l]);
      }
    }
  }
}
