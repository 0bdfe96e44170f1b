/*
  Error by gaps or penetration in contact. Closing a gap takes the work force times gap: half of it
  (forces grow from zero) bounds the energy of the error, but includes rigid displacements as
  springs deflect.

  So the estimate for springs is sharper. With F their forces, one step of Uzawa's iteration, (K +
  springs) delta = F, moves the body to its position with exact contact, up to the ratio of its
  stiffness to theirs; the elastic energy of delta is that of the error.

  The gaps of a barrier are proportional to its width: (K + H) delta = sum b'' g n
  (src/contact/pair_terms.c) is the error of the state. In a dynamic run K includes inertia: the
  error is relative to the same step without gaps.
*/
#include "ledger_impl.h"
#include "sbkernel.h"

#define CLOSELY \
  1e-3 /* tolerance of delta: mostly rigid, by the gap, while strains are differences */

/* Elastic energy of the displacement of bodies in contact under the forces F. */
static PetscErrorCode moved_energy(SbLedger l, Vec U, Vec F, PetscReal *energy)
{
  PetscInt its = 0;
  Vec D, R;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &D));
  PetscCall(VecDuplicate(U, &R));
  PetscCall(SbProbeSolve(l, CLOSELY, F, D, &its));
  PetscCall(SbStiffnessTimes(l, 0., U, D, PETSC_TRUE, R));
  PetscCall(VecDot(R, D, energy));
  *energy = 0.5 * PetscAbsReal(*energy);
  l->own_work += 2. + 2. * (PetscReal)its;
  PetscCall(VecDestroy(&D));
  PetscCall(VecDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEstimateGaps(SbLedger l, Vec U, PetscReal enough, PetscReal *error)
{
  PetscReal energy, strained;
  Vec F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &F));
  PetscCall(SbContactSetGapForces(&l->run->model->contacts, U, F, &energy));
  if (energy > PetscSqr(enough)) {
    PetscCall(moved_energy(l, U, F, &strained));
    energy = PetscMin(energy, strained);
  }
  PetscCall(VecDestroy(&F));
  *error = PetscSqrtReal(energy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEstimateContact(SbLedger l, const SbStep *step, PetscReal *error)
{
  const SbModel m = l->run->model;
  PetscReal energy, strained;
  PetscBool springs = PETSC_FALSE;
  SbContactPoints list = {0};

  PetscFunctionBeginUser;
  if (m->contacts.npotential) {
    PetscCall(SbEstimateGaps(l, step->U, 0., error));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* half the force times gap of all points, J */
  energy = 0.;
  PetscCall(SbContactSetPoints(&m->contacts, step->t, step->U, &list));
  for (PetscInt i = 0; i < list.n; i++)
    energy +=
      0.5 * PetscAbsReal(list.point[i].gap * SbDot3(list.point[i].force, list.point[i].normal));
  PetscCall(PetscFree(list.point));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPIU_REAL, MPI_SUM, m->comm));
  for (PetscInt e = 0; e < m->contacts.nactive_set; e++)
    springs = (PetscBool)(springs || m->contacts.active_set[e]->springs);
  if (springs && !m->dynamic && energy > 0.) {
    Vec F;

    PetscCall(VecDuplicate(step->U, &F));
    PetscCall(SbContactSetForce(&m->contacts, step->t, step->U, F));
    PetscCall(moved_energy(l, step->U, F, &strained));
    PetscCall(VecDestroy(&F));
    energy = PetscMin(energy, strained);
  }
  *error = PetscSqrtReal(energy);
  PetscFunctionReturn(PETSC_SUCCESS);
}
