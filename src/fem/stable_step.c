/*
  Critical time step of explicit integration.

  An undamped oscillator of frequency w is stable up to h w = 2; with the damping ratio zeta =
  (alpha/w + beta w)/2, whose force uses the old velocity, up to h w = 2 (sqrt(1 + zeta^2) - zeta).
  Stiffness-proportional damping can reduce this step many times.

  The highest frequency of the mesh at rest comes from the power method on M^-1 K: the growth of y =
  M^-1 K x in the norm of M converges to w^2 from below. After n steps from a random start the
  relative error is about ln(unknowns) / (2 n): a few percent of w, which callers cover by a safety
  factor. Each step costs one evaluation of forces. The start rotates with the body, so that the
  result does not depend on its orientation, nor on the number of ranks.

  The consistent mass matrix of a tet is at least 1/5 of its lumped one for P1, 9/70 for P2, and 1
  for CR and DG, which bounds w for a consistent mass.

  Fibres that contract make a body stiffer across them: their largest tensions are part of K.

  Not handled: frequencies that increase where a body is compressed, or its fibres are stretched.
*/
#include "fem_impl.h"
#include "sbkernel.h"

#define POWER_STEPS 100

PetscErrorCode SbSpaceStableStep(SbSpace s, PetscReal *dt)
{
  const PetscInt n = 3 * s->nnode_owned;
  Vec X;
  PetscReal *x, *f, square;
  PetscReal centre[4] = {0., 0., 0., 0.};
  PetscReal damping[2] = {0., 0.};
  PetscReal w = 0.;
  PetscReal least = 1.;
  PetscReal zeta;
  SbStage stage = {0};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &X));
  PetscCall(PetscCalloc1(3 * s->nnode, &f));

  /* the start: each node along its radius, by a pseudorandom amount */
  for (PetscInt i = 0; i < 4 * s->nnode_owned; i++)
    centre[i % 4] += s->node_mass[i / 4] * (i % 4 == 3 ? 1. : s->node_x[3 * (i / 4) + i % 4]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, centre, 4, MPIU_REAL, MPI_SUM, s->comm));
  for (PetscInt i = 0; i < n; i++)
    f[i] = PetscSinReal(12.9898 * (PetscReal)(s->node_orig[i / 3] % 10007) + 1.) *
           (s->node_x[i] - centre[i % 3] / centre[3]);

  /* w: lower bound of the highest angular frequency of K x = w^2 M x, M lumped; 0 if nothing can
     move */
  for (int step = 0; step <= POWER_STEPS; step++) {
    /* y . M y, with zeros at prescribed unknowns */
    square = 0.;
    for (PetscInt i = 0; i < n; i++) {
      if (s->fixed[i / 3] & (1 << i % 3))
        f[i] = 0.;
      square += s->node_mass[i / 3] * f[i] * f[i];
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &square, 1, MPIU_REAL, MPI_SUM, s->comm));
    if (square <= 0.)
      break;

    /* x had unit length: the growth of |y| is w^2 */
    if (step)
      w = PetscMax(w, PetscPowReal(square, 0.25));
    PetscCall(VecGetArray(X, &x));
    for (PetscInt i = 0; i < n; i++)
      x[i] = f[i] / PetscSqrtReal(square);
    PetscCall(VecRestoreArray(X, &x));
    PetscCall(PetscArrayzero(f, 3 * s->nnode));

    /* f = K x at rest, with Hooke's tensor of every law: the force of damping with beta = 1 */
    PetscCall(SbSpaceGetLocalRead(s, X, &stage.v));
    for (PetscInt r = 0; r < s->nregion; r++) {
      SbRegion region = s->region[r];

      /* with fibres: as stiff in all directions as along them */
      PetscCall(SbMaterialGetStiffest(region.material, &region.material));
      if (region.material != s->region[r].material) {
        region.pointwise = region.material;
        if (region.quadratic && region.element->mean_volume)
          PetscCall(SbMaterialGetPointwise(region.material, &region.pointwise));
      }
      SbRegionForces(s, &region, PETSC_FALSE, 1., &stage, f);
      if (region.contraction && !s->region[r].material->linear) {
        region.material = s->region[r].material;
        SbActiveStiffest(s, &region, stage.v, f);
      }
    }
    if (s->jump)
      SbJumpAdd(s, stage.v, SB_JUMP_STIFFNESS, f);
    PetscCall(SbSpaceRestoreLocalRead(s, X, &stage.v));

    /* supports have no mass, and do not move */
    for (PetscInt i = 0; i < n; i++)
      f[i] = s->node_mass[i / 3] > 0. ? f[i] / s->node_mass[i / 3] : 0.;
  }
  PetscCall(PetscFree(f));
  PetscCall(VecDestroy(&X));

  for (PetscInt b = 0; b < s->mesh->nbody; b++) {
    const SbElementOps *e = &s->element[b]->ops;

    damping[0] = PetscMax(damping[0], s->alpha[b]);
    damping[1] = PetscMax(damping[1], s->beta[b]);

    /* the smallest eigenvalue of a cell's consistent mass relative to the lumped one, or 1 */
    if (s->consistent_mass)
      least = PetscMin(least, s->element[b]->nodes_per[1]
                                ? 9. / 70.
                                : (e->mass_diagonal - e->mass_coupling) / e->mass_lumped);
  }
  w /= PetscSqrtReal(least);
  *dt = PETSC_MAX_REAL;
  if (w <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  zeta = 0.5 * (damping[0] / w + damping[1] * w);

  /* form without cancellation for strong damping */
  *dt = 2. / (w * (PetscSqrtReal(1. + zeta * zeta) + zeta));
  PetscFunctionReturn(PETSC_SUCCESS);
}
