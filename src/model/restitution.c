/*
  The relative speed after an impact within a step, and a limit on it so that no step gains energy.

  Newton's law in Moreau's form (Moreau 1988; Jean, "The non-smooth contact dynamics method", CMAME
  177, 1999) for the normal velocity of a point of a body relative to an obstacle or to its position
  on another body: v+ + e v- >= 0, force >= 0, and one of them zero, for pairs that would penetrate
  at the end of the step, by extrapolation with v- or in a solve. v- is the velocity at the start of
  the step. Implicit Euler has v+ = (gap1 - gap0) / h: the pair is constrained at

      gap1 = gap0 + h e |v-|,

  or released if that needs a tensile force; in the next step it is not constrained. Contact forces
  and deformation are solved together, so the whole body bounces if it is stiff relative to its
  inertia, sqrt(k/m) h >> 1. In a soft one e acts only on the neighbourhood of the point, and the
  body rebounds by its elasticity (Doyen, Ern, Piperno, SIAM J. Sci. Comput. 33, 2011).
  (contact_impl.h, separation.c)

  Energy. With W = sum h N v+ over these pairs, D = 1/2 |v1 - v0|^2 in the mass norm and S the
  strain energy, a step of implicit Euler gains W - D + C plus the work of the loads, C = S(u1) -
  S(u0) - f_int(u1) . (u1 - u0); friction and persistent pairs only dissipate. C <= 0 where S is
  convex (except for rotations under stress), and is then neglected. After each solve W + C <= D is
  checked, W of all effects, in the frame of the obstacle: if this is violated, all e are reduced
  and the step is solved again. For two unstressed stiff bodies, or a body and an obstacle, W / D =
  2 e / (1 + e) <= 1, so e is not reduced.
*/
#include "model_impl.h"

#define REDUCTIONS 8 /* most reductions of e within a step; then e = 0 */
#define SAFE 0.9     /* safety factor on the reduced e; most / W is exact for W proportional to e */
#define STEEP \
  2.1 /* factor on the excess 1 - most / W: a stiff body's W / D grows with the root of e */
#define ROUND 1e-9 /* relative tolerance of W <= D */

PetscErrorCode SbModelRestitutionUpdate(SbModel m, Vec U, PetscBool *again)
{
  PetscReal W = 0.;
  PetscReal before, after, work, most;
  PetscInt inverted;
  SbEnergies e;
  Vec change, F;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->nrestitution; k++)
    SbEffectCall(m->restitution[k], restitution, &W);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &W, 1, MPIU_REAL, MPI_SUM, m->comm));
  if (W <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* C, and D less its positive part */
  PetscCall(VecDuplicate(U, &F));
  PetscCall(VecDuplicate(U, &change));
  PetscCall(VecWAXPY(change, -1., m->bounce.U0, U));
  PetscCall(SbModelStrainEnergy(m, m->bounce.U0, NULL, &before, &inverted));
  PetscCall(SbModelStrainEnergy(m, U, F, &after, &inverted));
  PetscCall(VecDot(F, change, &work));
  PetscCall(VecAXPBY(change, -1., 1. / m->bounce.dt, m->bounce.V0));
  PetscCall(SbModelEnergies(m, U, change, &e));
  PetscCall(VecDestroy(&change));
  PetscCall(VecDestroy(&F));
  most = PetscMax(0., e.kinetic - PetscMax(0., after - before - work));
  if (W <= most * (1. + ROUND))
    PetscFunctionReturn(PETSC_SUCCESS);
  m->bounce.left *= ++m->bounce.reductions < REDUCTIONS
                      ? PetscMax(SAFE * most / W, 1. - STEEP * (1. - most / W))
                      : 0.;
  for (PetscInt k = 0; k < m->nrestitution; k++)
    SbEffectCall(m->restitution[k], scale_restitution, m->bounce.left);
  PetscCall(PetscInfo(NULL, "bounces do %g J, %g J may be: coefficients reduced to %g of them\n",
                      (double)W, (double)most, (double)m->bounce.left));
  *again = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
