/*
  measure.c - measures the limited quantities of hard cases, after each step and at the end of a
  run.
*/
#include "hard.h"
#include "../verify/contact.h"

static const char *const names[HARD_QUANTITIES] = {
  [HARD_EXCESS] = "energy above start and work",
  [HARD_ACCOUNT] = "energy off start and work",
  [HARD_RISE] = "rise of energy in a step",
  [HARD_DRIFT] = "drift of energy",
  [HARD_LEFT] = "energy left",
  [HARD_MOMENTUM] = "change of momentum",
  [HARD_ANGULAR] = "change of angular momentum",
  [HARD_MIN_J] = "min J at the end",
  [HARD_MIN_J_EVER] = "min J of all steps",
  [HARD_MAX_J] = "max J at the end",
  [HARD_INVERTED] = "inverted cells",
  [HARD_VOLUME] = "change of volume",
  [HARD_SHAPE] = "off the rest shape",
  [HARD_PLACE] = "off the rest place",
  [HARD_MOVED] = "largest displacement / size",
  [HARD_SPEED] = "speed at the end",
  [HARD_DEPTH] = "penetration / size",
  [HARD_NEWTON] = "Newton iterations of a step",
  [HARD_LINEAR] = "linear iterations of a step",
  [HARD_REJECTED] = "rejected steps",
  [HARD_STEPS] = "steps",
  [HARD_OWN] = "own",
  [HARD_OWN2] = "own 2",
  [HARD_OWN3] = "own 3",
};

const char *HardQuantityName(HardQuantity q)
{
  return names[q];
}

static PetscReal distance(const PetscReal a[3], const PetscReal b[3])
{
  return PetscSqrtReal(PetscSqr(a[0] - b[0]) + PetscSqr(a[1] - b[1]) + PetscSqr(a[2] - b[2]));
}

static PetscReal length(const PetscReal a[3])
{
  const PetscReal zero[3] = {0., 0., 0.};

  return distance(a, zero);
}

PetscErrorCode HardMeasureBegin(HardRun *r)
{
  PetscReal low[3] = {PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL};
  PetscReal high[3] = {PETSC_MIN_REAL, PETSC_MIN_REAL, PETSC_MIN_REAL};

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < r->model->nbody; b++) {
    const SbBody *body = &r->model->body[b];

    for (int k = 0; k < 3; k++) {
      low[k] = PetscMin(low[k], body->bbox[k]);
      high[k] = PetscMax(high[k], body->bbox[3 + k]);
    }
    r->rest += body->volume;
  }
  for (int k = 0; k < 3; k++)
    r->size = PetscMax(r->size, high[k] - low[k]);
  r->value[HARD_MIN_J_EVER] = PETSC_MAX_REAL;
  r->run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(r->run, HardMeasureStep, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode look_finite(HardRun *r, const SbStep *step)
{
  PetscReal u;
  PetscReal v = 0.;
  PetscReal a = 0.;

  PetscFunctionBeginUser;
  PetscCall(VecNorm(step->U, NORM_INFINITY, &u));
  if (step->V)
    PetscCall(VecNorm(step->V, NORM_INFINITY, &v));
  if (step->A)
    PetscCall(VecNorm(step->A, NORM_INFINITY, &a));
  if (PetscIsInfOrNanReal(u) || PetscIsInfOrNanReal(v) || PetscIsInfOrNanReal(a))
    r->wild = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Penetration as in the histories of contact: with obstacles and between bodies. */
static PetscErrorCode look_depth(HardRun *r, const SbStep *step)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; step->step && i < r->model->contacts.nactive_set; i++) {
    PetscReal depth;

    PetscCall(contact_column(r->run, step->t, r->model->contacts.active_set[i]->effect->name,
                             "penetration", &depth));
    r->value[HARD_DEPTH] = PetscMax(r->value[HARD_DEPTH], depth / r->size);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void look_energies(HardRun *r, const SbStep *step)
{
  const SbEnergies *e = &step->energies;
  const PetscReal now = e->kinetic + e->strain;
  PetscReal *value = r->value;

  if (step->step == 0) {
    r->start = *e;
    r->last = now;
  }

  /* energy that is missing in the balance may be regained later */
  r->most =
    PetscMax(r->most, PetscMax(now, r->run->state.energy_start + PetscAbsReal(e->load_work) +
                                      PetscAbsReal(e->prescribed_work)));
  r->gain = PetscMax(r->gain, -e->integrator_loss);
  value[HARD_ACCOUNT] = PetscMax(value[HARD_ACCOUNT], PetscAbsReal(e->integrator_loss));
  value[HARD_RISE] = PetscMax(value[HARD_RISE], now - r->last);
  value[HARD_DRIFT] =
    PetscMax(value[HARD_DRIFT], PetscAbsReal(now - r->start.kinetic - r->start.strain));
  value[HARD_LEFT] = now;
  value[HARD_MOMENTUM] = PetscMax(value[HARD_MOMENTUM], distance(e->momentum, r->start.momentum));
  value[HARD_ANGULAR] = PetscMax(value[HARD_ANGULAR], distance(e->angular, r->start.angular));
  value[HARD_MIN_J] = e->min_J;
  if (step->step) {
    value[HARD_MIN_J_EVER] = PetscMin(value[HARD_MIN_J_EVER], e->min_J);
    value[HARD_INVERTED] = PetscMax(value[HARD_INVERTED], (PetscReal)e->ninverted);
  }
  value[HARD_VOLUME] = PetscAbsReal(e->volume / r->rest - 1.);
  value[HARD_PLACE] = e->max_displacement / r->size;
  value[HARD_MOVED] = PetscMax(value[HARD_MOVED], e->max_displacement / r->size);
  value[HARD_SPEED] = e->max_speed;
  r->speed = PetscMax(r->speed, e->max_speed);
  r->last = now;
}

PetscErrorCode HardMeasureStep(SbRun run, const SbStep *step, void *ctx)
{
  HardRun *r = (HardRun *)ctx;
  const SbEnergies *e = &step->energies;

  PetscFunctionBeginUser;
  PetscCall(look_finite(r, step));
  look_energies(r, step);
  PetscCall(look_depth(r, step));
  r->value[HARD_NEWTON] = PetscMax(r->value[HARD_NEWTON], (PetscReal)step->newton);
  r->value[HARD_LINEAR] = PetscMax(r->value[HARD_LINEAR], (PetscReal)step->linear);
  r->value[HARD_STEPS] = (PetscReal)step->step;
  if (r->verbose)
    PetscCall(
      PetscPrintf(PETSC_COMM_WORLD,
                  "    %" PetscInt_FMT
                  " t %g kinetic %.4g strain %.4g missing %.3g min J %.4g inverted %" PetscInt_FMT
                  " displacement %.3g newton %" PetscInt_FMT " linear %" PetscInt_FMT
                  " rejected %" PetscInt_FMT "\n",
                  step->step, (double)step->t, (double)e->kinetic, (double)e->strain,
                  (double)e->integrator_loss, (double)e->min_J, e->ninverted,
                  (double)e->max_displacement, step->newton, step->linear, step->rejected));
  if (r->c->look)
    PetscCall((*r->c->look)(r, step));
  (void)run;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest relative change of the distances between nodes of a cell. */
static PetscErrorCode measure_shape(HardRun *r)
{
  const SbSpace s = r->model->space;
  const PetscReal *u;
  PetscReal worst = 0.;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, r->run->state.U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    for (int i = 0; i < 4; i++) {
      for (int j = 0; j < i; j++) {
        const PetscInt a = s->cell_node[4 * c + i];
        const PetscInt b = s->cell_node[4 * c + j];
        PetscReal x[3], y[3];

        for (int k = 0; k < 3; k++) {
          x[k] = s->node_x[3 * a + k] + u[3 * a + k];
          y[k] = s->node_x[3 * b + k] + u[3 * b + k];
        }
        worst = PetscMax(
          worst,
          PetscAbsReal(distance(x, y) / distance(s->node_x + 3 * a, s->node_x + 3 * b) - 1.));
      }
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, r->run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(&worst, &r->value[HARD_SHAPE], 1, MPIU_REAL, MPI_MAX, r->model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode measure_max_J(HardRun *r)
{
  const SbSpace s = r->model->space;
  const PetscReal *u;
  PetscReal *J;
  PetscReal most = PETSC_MIN_REAL;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->mesh->ncell_owned, &J));
  PetscCall(SbSpaceGetLocalRead(s, r->run->state.U, &u));
  SbSpaceCellState(s, u, NULL, J, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, r->run->state.U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++)
    most = PetscMax(most, J[c]);
  PetscCall(PetscFree(J));
  PetscCallMPI(MPI_Allreduce(&most, &r->value[HARD_MAX_J], 1, MPIU_REAL, MPI_MAX, r->model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal part(PetscReal value, PetscReal of)
{
  return of > 0. ? value / of : value;
}

PetscErrorCode HardMeasureEnd(HardRun *r)
{
  const PetscReal turn = length(r->start.angular);
  PetscReal *value = r->value;

  PetscFunctionBeginUser;
  PetscCall(measure_shape(r));
  PetscCall(measure_max_J(r));
  value[HARD_REJECTED] = (PetscReal)r->run->counters.rejected;
  value[HARD_EXCESS] = part(r->gain, r->most);
  value[HARD_ACCOUNT] = part(value[HARD_ACCOUNT], r->most);
  value[HARD_RISE] = part(value[HARD_RISE], r->most);
  value[HARD_DRIFT] = part(value[HARD_DRIFT], r->most);
  value[HARD_LEFT] = part(value[HARD_LEFT], r->most);
  value[HARD_MOMENTUM] = part(value[HARD_MOMENTUM], r->model->mass * r->speed);
  value[HARD_ANGULAR] = part(value[HARD_ANGULAR], turn);
  PetscFunctionReturn(PETSC_SUCCESS);
}
