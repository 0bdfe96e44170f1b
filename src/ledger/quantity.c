/*
  The quantity of interest of the user, and its error.

  In a static run the error by the mesh is the difference from a run of the same scene with P2, on
  the same tets where all bodies are P1, else on tets of half the edges, which an outer layer solves
  (src/remesh/finer.c): P2 has errors below 1 / 3 of those of P1 on the same tets, and of P2, CR and
  DG on coarser ones. Where there is none, by duality (Becker and Rannacher, Acta Numerica 10,
  2001): with z the dual solution, K z = dQ/du, the error by the mesh is a(e_u, e_z), the energy
  product of the errors of u and z, by the form f of the space estimate: (f(u + s z) - f(u - s z)) /
  2 s; the error by the solver is dQ/du . delta. Else the error is the relative error in the energy
  norm times the range of values of the quantity.

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
#include "sbgeometry.h"
#include "sbkernel.h"

#define ADJOINT 1e-2 /* relative tolerance of the dual solve */
#define MIX 1e-3     /* s above: size of s z over that of u, in the energy norm */

PetscErrorCode SbQuantitySetFromOptions(SbLedger l)
{
  SbQuantity *q = &l->quantity;
  PetscReal length;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(&SbRunScope, "ledger_quantity", &q->kind));
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

/* The owned vertex, or node at an edge of P2, nearest to q->at, on all ranks; of equally near ones
   that with the lowest original number. *vertex, *node: its local number on its owner, else -1. */
static PetscErrorCode find_nearest(SbQuantity *q, SbSpace s, PetscInt *vertex, PetscInt *node)
{
  const SbMesh mesh = s->mesh;
  const PetscInt n = mesh->nvert_owned + (s->edge_node ? s->nnode_owned : 0);
  PetscReal least = PETSC_MAX_REAL;
  PetscReal nearest;
  PetscInt first = PETSC_MAX_INT;
  PetscInt at = -1;
  PetscInt winner;

  PetscFunctionBeginUser;
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < n; i++) {
      const PetscInt k = i - mesh->nvert_owned;
      const PetscReal *x = k < 0 ? mesh->x + 3 * i : s->node_x + 3 * k;
      const PetscInt number = k < 0 ? mesh->vert_orig[i] : s->node_orig[k];
      const PetscReal d2 = SbDistance2(x, q->at);

      if (k >= 0 && number < mesh->Nvert + 8 * mesh->Ncell)
        continue; /* not at an edge */
      if (!pass)
        least = PetscMin(least, d2);
      else if (d2 <= nearest * (1. + 1e-12) && number < first) {
        first = number;
        at = i;
      }
    }
    if (!pass)
      PetscCallMPI(MPI_Allreduce(&least, &nearest, 1, MPIU_REAL, MPI_MIN, s->comm));
  }
  PetscCallMPI(MPI_Allreduce(&first, &winner, 1, MPIU_INT, MPI_MIN, s->comm));
  if (first != winner)
    at = -1;
  *vertex = at < mesh->nvert_owned ? at : -1;
  *node = at < mesh->nvert_owned ? -1 : at - mesh->nvert_owned;
  for (int j = 0; j < 3; j++) {
    q->x[j] = 0.;
    if (at >= 0)
      q->x[j] = *node < 0 ? mesh->x[3 * at + j] : s->node_x[3 * *node + j];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, q->x, 3, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w[nnode][3]: weights of the displacement at a vertex, -1: none here; of CR and DG it is the mean
   of the cells around, by volume, as SbSpaceVertexPositions() has it. */
static void add_vertex(const SbQuantity *q, SbSpace s, PetscInt vertex, PetscReal w[])
{
  PetscReal volume = 0.;

  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt c = 0; c < s->mesh->ncell; c++) {
      const SbElement e = SbSpaceCellElement(s, c);
      const PetscReal V = SbTetDeterminant(s->mesh->x, s->mesh->cell + 4 * c) / 6.;

      for (int v = 0; v < 4; v++) {
        if (s->mesh->cell[4 * c + v] != vertex)
          continue;
        if (!pass)
          volume += V;
        for (int i = 0; pass && i < 12; i++) {
          PetscReal *to = w + 3 * s->cell_node[4 * c + i / 3] + i % 3;

          if (!e->nodes_per[0])
            *to += V / volume * e->ops.vertex[v][i / 3] * q->direction[i % 3];
          else if (i / 3 == v)
            *to = q->direction[i % 3];
        }
      }
    }
  }
}

PetscErrorCode SbQuantityLocate(SbQuantity *q, SbRun run)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  PetscInt vertex = -1;
  PetscInt node = -1;
  PetscInt nprescribed = 0;
  PetscScalar *w;

  PetscFunctionBeginUser;
  q->weight = NULL;
  if (q->kind == SB_QUANTITY_NONE || q->kind == SB_QUANTITY_VOLUME)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceCreateVec(s, &q->weight));
  PetscCall(SbSpaceGetLocalWrite(s, q->weight, &w));
  PetscCall(PetscArrayzero(w, 3 * s->nnode));
  if (q->kind == SB_QUANTITY_DISPLACEMENT) {
    PetscCall(find_nearest(q, s, &vertex, &node));
    if (vertex >= 0)
      add_vertex(q, s, vertex, w);
    for (int k = 0; k < 3 && node >= 0; k++)
      w[3 * node + k] = q->direction[k];
  } else {
    q->set = 0;
    for (PetscInt k = 0; k < m->nset; k++)
      if (!strcmp(m->set[k].name, q->on))
        q->set = SB_SET_BIT(k);
    for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
      if (!(s->node_set[i / 3] & q->set) || !(s->fixed[i / 3] & (1 << i % 3)))
        continue;
      w[i] = q->direction[i % 3];
      nprescribed++;
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nprescribed, 1, MPIU_INT, MPI_SUM, m->comm));
  }
  PetscCall(SbSpaceRestoreLocalWrite(s, q->weight, &w));

  // nodes around a vertex may be another rank's
  if (s->ghosted) {
    PetscCall(VecGhostUpdateBegin(q->weight, ADD_VALUES, SCATTER_REVERSE));
    PetscCall(VecGhostUpdateEnd(q->weight, ADD_VALUES, SCATTER_REVERSE));
  }
  PetscCheck(
    q->kind != SB_QUANTITY_REACTION || nprescribed > 0, m->comm, PETSC_ERR_USER_INPUT,
    "-ledger_on '%s': no effect prescribes displacements on a set of that name, so there is no "
    "reaction; name a set of a support or drive",
    q->on);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbQuantityAttach(SbLedger l)
{
  const SbMesh mesh = l->run->model->mesh;
  SbQuantity *q = &l->quantity;
  PetscReal nearest;

  PetscFunctionBeginUser;
  PetscCall(SbQuantityLocate(q, l->run));
  if (q->kind == SB_QUANTITY_DISPLACEMENT && !l->run->counters.steps &&
      SbBodyFarFrom(mesh->nbody, mesh->body, q->at, &nearest))
    PetscCall(SbWarning(l->run->model->comm,
                        "-ledger_at %g,%g,%g is %.3g m outside of the nearest body's box: the "
                        "quantity is of the nearest node, at (%g, %g, %g) m",
                        (double)q->at[0], (double)q->at[1], (double)q->at[2], (double)nearest,
                        (double)q->x[0], (double)q->x[1], (double)q->x[2]));
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

/* Why there is no finer run; "": there may be one. */
static const char *why_not_finer(SbLedger l, PetscReal ncell)
{
  const SbRun run = l->run;
  const SbModel m = run->model;

  if (run->clock.stop_reason[0] || run->clock.t < 1. - 1e-9)
    return "this run did not reach its whole load";
  if (run->clock.arc.on)
    return "arc length control may end on a part of the path that load steps do not reach";
  for (PetscInt b = 0; b < m->nbody; b++)
    if (m->body[b].in_memory)
      return "a body was re-meshed";
  for (PetscInt e = 0; e < m->neffect; e++)
    if (m->effect[e]->ops.prescribe && (m->effect[e]->from > 0. || m->effect[e]->until < 1.))
      return "supports come or go";
  if (ncell > (PetscReal)l->finer_most)
    return "it takes more than -ledger_finer_most tets";
  return "";
}

PetscErrorCode SbLedgerWantsFiner(SbLedger l, PetscInt *refine, PetscBool *wanted)
{
  const char *why;
  SbModel m;

  PetscFunctionBeginUser;
  *wanted = PETSC_FALSE;
  *refine = 0;
  if (!l || l->run->model->dynamic || !l->quantity.kind || !l->finer_most)
    PetscFunctionReturn(PETSC_SUCCESS);
  m = l->run->model;
  for (PetscInt b = 0; b < m->nbody; b++)
    if (!m->element[b]->nodes_per[0] || m->element[b]->nodes_per[1])
      *refine = 1;
  why = why_not_finer(l, (*refine ? 8. : 1.) * (PetscReal)m->mesh->Ncell);
  PetscCall(PetscStrncpy(l->finer.why, why, sizeof(l->finer.why)));
  *wanted = (PetscBool)!why[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLedgerSetFiner(SbLedger l, SbRun finer, const PetscReal seconds[SB_PHASE_COUNT])
{
  SbQuantity *q = &l->quantity;
  SbQuantity other = *q;

  PetscFunctionBeginUser;
  for (int i = 0; i < SB_PHASE_COUNT; i++) {
    l->finer.phase[i] = seconds[i];
    l->seconds += seconds[i];
  }
  if (finer->clock.stop_reason[0]) {
    PetscCall(PetscSNPrintf(l->finer.why, sizeof(l->finer.why), "it %s: %s",
                            finer->clock.stopped ? "was stopped" : "found no equilibrium",
                            finer->clock.stop_reason));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int k = 0; k < 3; k++)
    other.at[k] = q->x[k];
  PetscCall(SbQuantityLocate(&other, finer));
  if (q->kind == SB_QUANTITY_DISPLACEMENT &&
      SbDistance2(other.x, q->x) >
        PetscSqr(1e-6 * SbBodySmallest(finer->model->nbody, finer->model->body)))
    PetscCall(PetscStrncpy(l->finer.why,
                           "its mesh is another one, without the vertex of the quantity",
                           sizeof(l->finer.why)));
  else {
    if (q->kind == SB_QUANTITY_VOLUME)
      l->finer.value = finer->state.energies.volume;
    else
      PetscCall(VecDot(other.weight,
                       q->kind == SB_QUANTITY_REACTION ? finer->state.reaction : finer->state.U,
                       &l->finer.value));
    l->finer.ncell = finer->model->mesh->Ncell;
    q->error[SB_ERROR_SPACE] = PetscAbsReal(q->value - l->finer.value);
  }
  PetscCall(VecDestroy(&other.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}
