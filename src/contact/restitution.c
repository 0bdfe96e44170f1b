/*
  restitution.c - the relative speed after an impact within a step, and a limit on it so that no
  step gains energy.

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
#include "contact_impl.h"

#define REDUCTIONS 8 /* most reductions of e within a step; then e = 0 */
#define SAFE 0.9     /* safety factor on the reduced e; most / W is exact for W proportional to e */
#define STEEP \
  2.1 /* factor on the excess 1 - most / W: a stiff body's W / D grows with the root of e */
#define ROUND 1e-9 /* relative tolerance of W <= D */
#define CROSSINGS \
  10. /* of a body by waves in a step: with less than this an impact with e = 1 loses more than 6 % */

/* Kinetic energy of the velocity V, J, over all ranks. */
static PetscErrorCode kinetic_energy(SbSpace s, Vec V, PetscReal *energy)
{
  const PetscReal *v;
  PetscReal sum = 0.;
  PetscReal *p;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * s->nnode, &p));
  PetscCall(SbSpaceGetLocalRead(s, V, &v));
  SbSpaceAddInertia(s, &(SbStage){.a = v}, p);
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    sum += 0.5 * SbDot3(v + 3 * i, p + 3 * i);
  PetscCall(SbSpaceRestoreLocalRead(s, V, &v));
  PetscCall(PetscFree(p));
  PetscCallMPI(MPI_Allreduce(&sum, energy, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Strain energy at U, J, over all ranks; F: internal forces there, N, or NULL. */
static PetscErrorCode strain_energy(SbSpace s, Vec U, Vec F, PetscReal *energy)
{
  SbStage stage = {.shift_k = 1.};
  PetscReal sum, unused[2];
  PetscInt ninverted;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  SbSpaceStrainEnergy(s, stage.u, NULL, &sum, &unused[0], &ninverted, &unused[1]);
  if (F) {
    PetscReal *f;

    PetscCall(SbSpaceGetLocalWrite(s, F, &f));
    PetscCall(PetscArrayzero(f, 3 * s->nnode));
    PetscCall(SbSpaceAddInternalForce(s, &stage, f));
    PetscCall(SbSpaceRestoreLocalWrite(s, F, &f));
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCallMPI(MPI_Allreduce(&sum, energy, 1, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetCheckRestitution(SbContactSet *contacts, Vec U, PetscBool *again)
{
  const SbSpace s = contacts->space;
  PetscReal W = 0.;
  PetscReal before, after, work, kinetic, most;
  Vec change, F;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < contacts->n; k++)
    if (contacts->contact[k]->restitution > 0.)
      CONTACT_CALL(contacts->contact[k], impact_work, &W);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &W, 1, MPIU_REAL, MPI_SUM, s->comm));
  if (W <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* C, and D less its positive part */
  PetscCall(VecDuplicate(U, &F));
  PetscCall(VecDuplicate(U, &change));
  PetscCall(VecWAXPY(change, -1., contacts->bounce.U0, U));
  PetscCall(strain_energy(s, contacts->bounce.U0, NULL, &before));
  PetscCall(strain_energy(s, U, F, &after));
  PetscCall(VecDot(F, change, &work));
  PetscCall(VecAXPBY(change, -1., 1. / contacts->bounce.dt, contacts->bounce.V0));
  PetscCall(kinetic_energy(s, change, &kinetic));
  PetscCall(VecDestroy(&change));
  PetscCall(VecDestroy(&F));
  most = PetscMax(0., kinetic - PetscMax(0., after - before - work));
  if (W <= most * (1. + ROUND))
    PetscFunctionReturn(PETSC_SUCCESS);

  /* all coefficients are reduced, and the step is solved again */
  contacts->bounce.left *= ++contacts->bounce.reductions < REDUCTIONS
                             ? PetscMax(SAFE * most / W, 1. - STEEP * (1. - most / W))
                             : 0.;
  for (PetscInt k = 0; k < contacts->n; k++)
    if (contacts->contact[k]->restitution > 0.)
      CONTACT_CALL(contacts->contact[k], scale_restitution, contacts->bounce.left);
  PetscCall(PetscInfo(NULL, "bounces do %g J, %g J may be: coefficients reduced to %g of them\n",
                      (double)W, (double)most, (double)contacts->bounce.left));
  *again = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbRestitutionCrossings(SbSpace s, PetscInt body, PetscReal dt)
{
  const SbMaterial m = s->material[body];

  return PetscSqrtReal(SbMaterialYoungModulus(m) / m->density) * dt /
         PetscCbrtReal(s->mesh->body[body].volume);
}

PetscErrorCode SbRestitutionWarnSoft(SbEffect e, SbRestitution *bounce, SbSpace s, PetscReal dt,
                                     PetscReal crossings, PetscInt body)
{
  struct {
    double crossings;
    int body;
  } least = {crossings, (int)body};

  PetscFunctionBeginUser;
  if (bounce->said)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPI_DOUBLE_INT, MPI_MINLOC, s->comm));
  if (least.crossings >= CROSSINGS)
    PetscFunctionReturn(PETSC_SUCCESS);
  bounce->said = PETSC_TRUE;
  PetscCall(SbWarning(
    s->comm,
    "effect %s: restitution is for bodies that are stiff within a step, which elastic waves cross "
    "%g times or more; they cross body %s %.2g times in %g s: it rebounds more slowly, the rest is "
    "vibrations that -time euler_implicit dissipates; a longer -ts_dt, or without restitution a "
    "shorter one that resolves the impact; said once",
    e->name, CROSSINGS, s->mesh->body[least.body].name, least.crossings, (double)dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}
