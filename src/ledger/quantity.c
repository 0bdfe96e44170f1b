/*
  The quantity of interest of the user, and its error.

  In a static run by duality (Becker and Rannacher, Acta Numerica 10, 2001): with z the dual
  solution, K z = dQ/du, the error by the mesh is a(e_u, e_z), the energy product of the errors of u
  and z, by the form f of the space estimate: (f(u + s z) - f(u - s z)) / 2 s; the error by the
  solver is dQ/du . delta. Else the error is the relative error in the energy norm times the range
  of values of the quantity.

  In a dynamic run that is an order of magnitude too large for the time step. Better: one step of a
  method of order p is that of exp(h A + c (h A)^(p+1)) for u' = A u, by its modified equation
  (Hairer, Lubich and Wanner, Geometric Numerical Integration, IX.1). A commutes with itself, so
  errors of steps propagate without change of form, and at time t

    Q(u_h) - Q(u) = sum_n c h_n^(p+1) d^(p+1) Q / dt^(p+1):

  duality in time without a dual run. The derivative is a divided difference of the last p + 2
  values: of an oscillation that the steps do not resolve it is at most a multiple of its amplitude.
  The error is the largest one of the run: at a single time it may be zero by chance. Exact for
  small errors of linear motion under constant loads; elsewhere the smaller of both estimates is
  taken.
*/
#include "ledger_impl.h"
#include "sbkernel.h"

#define ADJOINT 1e-2 /* relative tolerance of the dual solve */
#define MIX 1e-3     /* s above: size of s z over that of u, in the energy norm */

PetscErrorCode SbQuantitySetFromOptions(SbLedger l)
{
  SbQuantity *q = &l->quantity;
  PetscReal length;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(&SbRunScope, "ledger_quantity", &q->kind));
  q->node = -1;
  q->least = PETSC_MAX_REAL;
  q->most = PETSC_MIN_REAL;
  if (!q->kind)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (q->kind == SB_QUANTITY_DISPLACEMENT)
    PetscCall(SbOptionReals(&SbRunScope, "ledger_at", q->at));
  if (q->kind == SB_QUANTITY_REACTION)
    PetscCall(SbOptionString(&SbRunScope, "ledger_on", sizeof(q->on), q->on));
  if (q->kind == SB_QUANTITY_VOLUME)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbOptionReals(&SbRunScope, "ledger_direction", q->direction));
  length = PetscSqrtReal(SbDot3(q->direction, q->direction));
  PetscCheck(length > 0., PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-ledger_direction 0,0,0 is no direction");
  for (int k = 0; k < 3; k++)
    q->direction[k] /= length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbQuantityAttach(SbLedger l)
{
  const SbModel m = l->run->model;
  const SbSpace s = m->space;
  SbQuantity *q = &l->quantity;
  PetscScalar *w;
  PetscInt nprescribed = 0;

  PetscFunctionBeginUser;
  if (q->kind == SB_QUANTITY_NONE || q->kind == SB_QUANTITY_VOLUME)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(l->run->state.U, &q->weight));
  PetscCall(VecZeroEntries(q->weight));
  if (q->kind == SB_QUANTITY_DISPLACEMENT) {
    PetscReal least = PETSC_MAX_REAL;
    PetscReal all, nearest;
    PetscInt first = PETSC_MAX_INT;
    PetscInt winner;

    /* the node nearest to the position on all ranks; of equally near ones that with the lowest
       number */
    for (int pass = 0; pass < 2; pass++) {
      for (PetscInt k = 0; k < s->nnode_owned; k++) {
        PetscReal r[3];

        SbSubtract(s->node_x + 3 * k, q->at, r);
        if (!pass)
          least = PetscMin(least, SbDot3(r, r));
        else if (SbDot3(r, r) <= all * (1. + 1e-12) && s->node_orig[k] < first) {
          first = s->node_orig[k];
          q->node = k;
        }
      }
      if (!pass)
        PetscCallMPI(MPI_Allreduce(&least, &all, 1, MPIU_REAL, MPI_MIN, s->comm));
    }
    PetscCallMPI(MPI_Allreduce(&first, &winner, 1, MPIU_INT, MPI_MIN, s->comm));
    if (first != winner)
      q->node = -1;
    for (int j = 0; j < 3; j++)
      q->x[j] = q->node < 0 ? 0. : s->node_x[3 * q->node + j];
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, q->x, 3, MPIU_REAL, MPI_SUM, s->comm));
    if (SbBodyFarFrom(s->mesh->nbody, s->mesh->body, q->at, &nearest) && !l->run->counters.steps)
      PetscCall(SbWarning(m->comm,
                          "-ledger_at %g,%g,%g is %.3g m outside of the nearest body's box: the "
                          "quantity is of the nearest node, at (%g, %g, %g) m",
                          (double)q->at[0], (double)q->at[1], (double)q->at[2], (double)nearest,
                          (double)q->x[0], (double)q->x[1], (double)q->x[2]));
  }
  for (PetscInt k = 0; k < m->nset; k++)
    if (!strcmp(m->set[k].name, q->on))
      q->set = SB_SET_BIT(k);
  PetscCall(VecGetArray(q->weight, &w));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (int k = 0; k < 3; k++) {
      const PetscBool on = (PetscBool)(q->kind == SB_QUANTITY_DISPLACEMENT
                                         ? i == q->node
                                         : (s->node_set[i] & q->set) && (s->fixed[i] & (1 << k)));

      if (on)
        w[3 * i + k] = q->direction[k];
      nprescribed += on;
    }
  }
  PetscCall(VecRestoreArray(q->weight, &w));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nprescribed, 1, MPIU_INT, MPI_SUM, m->comm));
  PetscCheck(
    nprescribed > 0, m->comm, PETSC_ERR_USER_INPUT,
    "-ledger_on '%s': no effect prescribes displacements on a set of that name, so there is no "
    "reaction; name a set of a support or drive",
    q->on);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbQuantityContinue(SbLedger from, SbLedger to)
{
  const PetscReal *a = from->quantity.x;
  PetscReal d[3];

  PetscFunctionBeginUser;
  SbSubtract(a, to->quantity.x, d);
  if (to->quantity.kind == SB_QUANTITY_DISPLACEMENT && SbDot3(d, d) > 0.)
    PetscCall(SbWarning(
      to->run->model->comm,
      "-ledger_at: the node at (%g, %g, %g) m is gone with a mesh; from now on the nearest one, "
      "%.3g m from it, stands for it. Vertices of the surface stay: choose one of them",
      (double)a[0], (double)a[1], (double)a[2], (double)PetscSqrtReal(SbDot3(d, d))));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Derivative of the integrator's order + 1 from n = order + 2 values, newest first; 0: too few. */
static PetscReal last_derivative(PetscInt order, PetscInt n, const PetscReal value[4],
                                 const PetscReal t[4])
{
  PetscReal d[4];

  if (n < order + 2)
    return 0.;
  for (int i = 0; i < 4; i++)
    d[i] = value[i];

  // divided differences; times their number they are derivatives
  for (PetscInt k = 1; k <= order + 1; k++)
    for (PetscInt i = 0; i + k < order + 2; i++)
      d[i] = (PetscReal)k * (d[i] - d[i + 1]) / (t[i] - t[i + k]);
  return d[0];
}

/* Puts a value in front of the last ones. */
static PetscInt push(PetscInt n, PetscReal value[4], PetscReal t[4], PetscReal new_value,
                     PetscReal new_t)
{
  for (int i = 3; i > 0; i--) {
    value[i] = value[i - 1];
    t[i] = t[i - 1];
  }
  value[0] = new_value;
  t[0] = new_t;
  return PetscMin(n + 1, 4);
}

PetscErrorCode SbQuantityStepError(SbLedger l, const SbSolvedStep *step, PetscReal *error,
                                   PetscBool *known)
{
  SbQuantity *q = &l->quantity;
  PetscReal value[4], t[4], now, range;
  PetscInt n;

  PetscFunctionBeginUser;
  *known = PETSC_FALSE;
  if (q->kind != SB_QUANTITY_DISPLACEMENT)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(q->weight, step->U, &now));
  PetscCall(PetscArraycpy(value, q->last, 4));
  PetscCall(PetscArraycpy(t, q->last_t, 4));
  n = push(q->nlast, value, t, now, step->t + step->dt);
  range = PetscMax(q->most, now) - PetscMin(q->least, now);
  if (n < l->order + 2 || !(range > 0.))
    PetscFunctionReturn(PETSC_SUCCESS);
  *error = l->c * PetscPowReal(step->dt, (PetscReal)l->order + 1.) *
           PetscMax(q->steepest, PetscAbsReal(last_derivative(l->order, n, value, t))) / range;
  *known = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbQuantityValue(SbLedger l, const SbStep *step)
{
  SbQuantity *q = &l->quantity;
  PetscReal slope;

  PetscFunctionBeginUser;
  if (q->kind == SB_QUANTITY_VOLUME)
    q->value = step->energies.volume;
  else
    PetscCall(VecDot(q->weight, q->kind == SB_QUANTITY_REACTION ? step->R : step->U, &q->value));
  q->least = PetscMin(q->least, q->value);
  q->most = PetscMax(q->most, q->value);
  if (step->V) {
    q->nlast = push(q->nlast, q->last, q->last_t, q->value, step->t);
    slope = PetscAbsReal(last_derivative(l->order, q->nlast, q->last, q->last_t));
    q->steepest = PetscMax(q->steepest, slope);
    q->worst = PetscMax(q->worst, l->tau * slope);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbQuantityErrors(SbLedger l, const SbStep *step)
{
  SbQuantity *q = &l->quantity;
  const PetscReal scale = l->stored > 0. ? (q->most - q->least) / PetscSqrtReal(l->stored) : 0.;

  PetscFunctionBeginUser;
  for (int i = 0; i < SB_ERROR_COUNT; i++)
    q->error[i] = scale * SbLedgerError(l, i);
  if (step->V && q->nlast >= l->order + 2)
    q->error[SB_ERROR_TIME] = PetscMin(q->error[SB_ERROR_TIME], q->worst);
  if (!l->run->model->dynamic && q->kind != SB_QUANTITY_VOLUME) {
    const PetscReal both = PetscSqr(l->step_linear) + PetscSqr(l->step_nonlinear);
    PetscReal left, energy, s, sums[2];
    PetscInt its;
    Vec B, Z;

    PetscCall(VecDuplicate(step->U, &B));
    PetscCall(VecDuplicate(step->U, &Z));

    // right-hand side: dQ/du at free unknowns
    if (q->kind == SB_QUANTITY_REACTION)
      PetscCall(SbStiffnessTimes(l, step->t, step->U, q->weight, PETSC_FALSE, B));
    else
      PetscCall(VecCopy(q->weight, B));
    PetscCall(SbSpaceZeroPrescribed(l->run->model->space, PETSC_TRUE, B));
    PetscCall(VecDot(B, l->delta, &left));
    left = PetscAbsReal(left) / PetscSqrtReal(PetscMax(both, PETSC_MIN_REAL));
    q->error[SB_ERROR_LINEAR] = left * l->step_linear;
    q->error[SB_ERROR_NONLINEAR] = left * l->step_nonlinear;
    PetscCall(SbProbeSolve(l, ADJOINT, B, Z, &its));
    PetscCall(VecDot(B, Z, &energy));

    /* reaction: add the displacement of the support itself; Z is rigid without another support */
    if (q->kind == SB_QUANTITY_REACTION)
      PetscCall(VecAYPX(Z, -1., q->weight));

    /* error by the mesh: a(e_u, e_z) */
    q->error[SB_ERROR_SPACE] = 0.;
    if (energy > 0. && l->stored > 0.) {
      s = MIX * PetscSqrtReal(2. * l->stored / energy);
      for (int side = 0; side < 2; side++) {
        PetscCall(VecWAXPY(l->w[1], side ? s : -s, Z, step->U));
        PetscCall(SbSpaceEstimateCompute(l->space, step->t, l->w[1], NULL, NULL));
        sums[side] = l->space->form2;
      }
      q->error[SB_ERROR_SPACE] = PetscAbsReal(sums[1] - sums[0]) / (2. * s);
    }
    PetscCall(VecDestroy(&B));
    PetscCall(VecDestroy(&Z));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
