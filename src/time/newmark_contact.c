/*
  Newmark's method with contact: the trapezoidal rule with implicit contact forces.

  With a the acceleration without contact, M a = f_ext - f_int(u) - C v, and G^T lambda the contact forces at
  the end of the step (Kane, Repetto, Ortiz and Marsden, "Finite element analysis of nonsmooth contact", CMAME
  180, 1999: beta = 1/4, gamma = 1/2 there, 1/2 and 1 for contact)

    u1 = u0 + h v0 + h^2/4 (a0 + a1) + h^2/2 M^-1 G^T lambda,    v* = v0 + h/2 (a0 + a1) + h M^-1 G^T lambda.

  So u1 - u0 = h (v0 + v*) / 2, and a linear body gains lambda . (g1 - g0), g the gaps: active nodes have g1 =
  0, so an impact dissipates energy and persistent contact conserves it. But G v* is not zero: a node with g0
  = 0 has v* = -v0, and separates in the next step or its force oscillates. Hence the velocity at the end is

    v1 = v* + M^-1 G^T mu  with  G v1 = w,

  w the velocities of obstacles: the persistency condition of Laursen and Love (IJNME 53, 2002). As the
  closest velocity in the mass norm it dissipates energy, too, m v^2 / 2 of each impacting node with the nodal
  mass m: an impact of the nodes without restitution, which vanishes with the size of the cells. In the next
  step their a0 and contact force are in balance, and forces are steady. (Deuflhard, Krause and Ertel, IJNME
  73, 2008, project the predictor instead; their nodes keep the velocities from before the impact until they
  separate.)

  As s = u1 - u0 Newmark's own formula with a0 gives A = a1 + 2 M^-1 G^T lambda, and M A + C v* + f_int(u1) -
  f_ext = 2 G^T lambda: the solvers need no change. The stored acceleration is a1 + M^-1 G^T (lambda + mu /
  h), with the mean contact force over the step, whose product with h is the change of momentum.
*/
#include "time_impl.h"

PetscErrorCode SbNewmarkContact(SbRun run, PetscReal t, PetscReal dt, Vec U, Vec V, Vec A, Vec own)
{
  const SbModel m = run->model;
  Vec change;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(V, &change));
  PetscCall(VecCopy(V, change));
  if (SbSpaceIsConstrained(m->space)) PetscCall(SbModelContactVelocity(m, t, dt, U, V));
  PetscCall(VecAYPX(change, -1., V));
  PetscCall(VecCopy(A, own));
  PetscCall(SbFormAcceleration(run, t, U, V, PETSC_FALSE, own));
  PetscCall(VecAXPBY(A, 0.5, 0.5, own));
  PetscCall(VecAXPY(A, 1. / dt, change));
  PetscCall(VecDestroy(&change));
  PetscFunctionReturn(PETSC_SUCCESS);
}
