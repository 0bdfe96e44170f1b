/*
  contact.h - what the verification of contact shares: history columns by name, sums over each body, an account of energy and
  momentum around each step, balls made of boxes.
*/
#pragma once
#include "verify.h"

#define CONTACT_BODIES 64
#define CONTACT_NAMES 4

static inline SbEffect contact_effect(SbModel m, const char *name)
{
  for (PetscInt e = 0; e < m->neffect; e++) {
    if (!strcmp(m->effect[e]->name, name)) return m->effect[e];
  }
  return NULL;
}

/* A column of the history of an effect for the residual R (N, without constraints), on every rank. */
static inline PetscErrorCode contact_column_of(SbRun run, PetscReal t, Vec R, const char *effect,
                                               const char *column, PetscReal *value)
{
  SbModel m = run->model;
  SbEffect e = contact_effect(m, effect);
  SbStage stage = {.t = t, .shift_k = 1};
  PetscReal *values;
  PetscInt at = -1;
  const PetscReal *r;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < e->ncolumn; k++) at = strcmp(e->column[k], column) ? at : k;
  PetscCheck(at >= 0 && R, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No column %s_%s", effect, column);
  PetscCall(PetscCalloc1(e->ncolumn, &values));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  PetscCall(SbSpaceGetLocalRead(m->space, run->U, &stage.u));
  PetscCall((*e->ops.history)(e, m->space, &stage, r, values));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->U, &stage.u));
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  *value = values[at];
  PetscCall(PetscFree(values));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same as history.csv has it after a step: for monitors of a run with want_energies, and after it. */
static inline PetscErrorCode contact_column(SbRun run, PetscReal t, const char *effect, const char *column,
                                            PetscReal *value)
{
  PetscFunctionBeginUser;
  PetscCall(contact_column_of(run, t, run->reaction, effect, column, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of a vector over the nodes of each body, each times its mass (kg) when `weigh`: sum[nbody][3] on every rank. */
static inline PetscErrorCode contact_body_sums(SbModel m, Vec V, PetscBool weigh, PetscReal sum[])
{
  const SbSpace s = m->space;
  const PetscScalar *v;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(sum, 3 * m->nbody));
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    sum[3 * s->node_body[i / 3] + i % 3] += (weigh ? s->node_mass[i / 3] : 1) * v[i];
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, (PetscMPIInt)(3 * m->nbody), MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mass of each body, kg, on every rank. */
static inline PetscErrorCode contact_body_masses(SbModel m, PetscReal mass[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(mass, m->nbody));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) mass[m->space->node_body[i]] += m->space->node_mass[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mass, (PetscMPIInt)m->nbody, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Net force of contact on each body after the last step, N: force[nbody][3] on every rank. For a run with want_energies. */
static inline PetscErrorCode contact_body_forces(SbRun run, PetscReal t, PetscReal force[])
{
  Vec F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->U, &F));
  PetscCall(SbModelContactForce(run->model, t, run->U, run->reaction, F));
  PetscCall(contact_body_sums(run->model, F, PETSC_FALSE, force));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  What a run does in its steps: energy with the potential of gravity, momentum against weight and the forces of obstacles, how deep
  things are. Set the names (NULL: there is none) and g, then contact_watch_add().
*/
typedef struct {
  const char *obstacle[CONTACT_NAMES], *meet; /* names of the effects */
  PetscReal g;                                /* m/s^2, along -z */
  PetscReal start, energy;                    /* at the start and now, J */
  PetscReal most, gain;      /* above the start, and gained in a step, the largest of all steps, J */
  PetscReal momentum[3];     /* now, kg m/s */
  PetscReal missing;         /* largest change of momentum that no force explains, kg m/s */
  PetscReal impulse;         /* of the obstacles, z, N s */
  PetscReal force;           /* largest force of the obstacles, z, N */
  PetscReal behind, deepest; /* deepest penetration of obstacles and of bodies, m */
  PetscReal contacts;        /* most pairs of `meet` at a time */
  PetscReal min_J;
  PetscInt landings, meetings; /* how often the first obstacle and bodies came to touch */
  PetscBool lands, meets;      /* they touch now */
} ContactWatch;

/* Sum of the forces of the obstacles; notes depth and landings. */
static inline PetscErrorCode contact_watch_obstacles(SbRun run, const SbStep *step, ContactWatch *w,
                                                     PetscReal force[3])
{
  static const char *const columns[3] = {"force_x", "force_y", "force_z"};

  PetscFunctionBeginUser;
  force[0] = force[1] = force[2] = 0;
  for (int o = 0; o < CONTACT_NAMES && w->obstacle[o]; o++) {
    PetscReal value;

    for (int k = 0; k < 3; k++) {
      PetscCall(contact_column(run, step->t, w->obstacle[o], columns[k], &value));
      force[k] += value;
    }
    PetscCall(contact_column(run, step->t, w->obstacle[o], "penetration", &value));
    w->behind = PetscMax(w->behind, value);
    if (o) continue;
    PetscCall(contact_column(run, step->t, w->obstacle[o], "contacts", &value));
    if (value > 0 && !w->lands) w->landings++;
    w->lands = (PetscBool)(value > 0);
  }
  w->force = PetscMax(w->force, force[2]);
  w->impulse += step->dt * force[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode contact_watch_bodies(SbRun run, const SbStep *step, ContactWatch *w)
{
  PetscReal value;

  PetscFunctionBeginUser;
  PetscCall(contact_column(run, step->t, w->meet, "penetration", &value));
  w->deepest = PetscMax(w->deepest, value);
  PetscCall(contact_column(run, step->t, w->meet, "contacts", &value));
  w->contacts = PetscMax(w->contacts, value);
  if (value > 0 && !w->meets) w->meetings++;
  w->meets = (PetscBool)(value > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode contact_watch(SbRun run, const SbStep *step, void *ctx)
{
  ContactWatch *w = (ContactWatch *)ctx;
  const SbEnergies *e = &step->energies;
  const PetscReal weight = run->model->mass * w->g;
  const PetscReal energy = e->kinetic + e->strain + weight * e->centre[2];
  PetscReal force[3];

  PetscFunctionBeginUser;
  if (step->step == 0) {
    w->start = energy;
    w->min_J = 1;
  } else {
    PetscCall(contact_watch_obstacles(run, step, w, force));
    force[2] -= weight;
    for (int k = 0; k < 3; k++)
      w->missing = PetscMax(w->missing, PetscAbsReal(e->momentum[k] - w->momentum[k] - step->dt * force[k]));
    w->gain = PetscMax(w->gain, energy - w->energy);
    w->most = PetscMax(w->most, energy - w->start);
    if (w->meet) PetscCall(contact_watch_bodies(run, step, w));
  }
  w->energy = energy;
  w->min_J = PetscMin(w->min_J, e->min_J);
  for (int k = 0; k < 3; k++) w->momentum[k] = e->momentum[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode contact_watch_add(TestScene *t, ContactWatch *w)
{
  PetscFunctionBeginUser;
  t->run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t->run, contact_watch, w, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A ball, or its quarter x, y > 0: the layers of a cube become spheres. */
typedef struct {
  PetscReal radius; /* m */
  PetscBool quarter;
} ContactBall;

static inline void contact_ball(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  const ContactBall *b = (const ContactBall *)ctx;
  PetscReal layer = 0, length;

  (void)n;
  (void)at;
  for (int k = 0; k < 3; k++) {
    if (!b->quarter || k == 2) x[k] = 2 * x[k] - 1;
    layer = PetscMax(layer, PetscAbsReal(x[k]));
  }
  length = PetscSqrtReal(SbDot3(x, x));
  for (int k = 0; k < 3; k++) x[k] *= length > 0 ? b->radius * layer / length : 0;
}
