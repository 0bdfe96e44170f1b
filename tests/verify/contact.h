/*
  contact.h - common functions of the verification of contact: history columns by name, sums over
  each body, the history as a table, balls made of boxes.
*/
#pragma once
#include "verify.h"

#define CONTACT_BODIES 64

static inline SbEffect contact_effect(SbModel m, const char *name)
{
  for (PetscInt e = 0; e < m->neffect; e++)
    if (!strcmp(m->effect[e]->name, name))
      return m->effect[e];
  return NULL;
}

/* History columns of an effect for the residual R (N, without constraints; NULL: none), on every
   rank: value[ncolumn]. */
static inline PetscErrorCode contact_columns(SbRun run, PetscReal t, Vec R, SbEffect e,
                                             PetscReal value[])
{
  SbModel m = run->model;
  SbStage stage = {.t = t, .shift_k = 1};
  const PetscReal *r = NULL;

  PetscFunctionBeginUser;
  if (R)
    PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &stage.u));
  if (R && m->space->constraints)
    SbConstraintsComputeForces(m->space, stage.u, r);
  PetscCall((*e->ops.history)(e, m->space, &stage, r, value));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &stage.u));
  if (R)
    PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, value, (PetscMPIInt)e->ncolumn, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One of these columns by its name. */
static inline PetscErrorCode contact_column_of(SbRun run, PetscReal t, Vec R, const char *effect,
                                               const char *column, PetscReal *value)
{
  SbEffect e = contact_effect(run->model, effect);
  PetscReal values[64] = {0};
  PetscInt at = -1;

  PetscFunctionBeginUser;
  *value = 0;
  for (PetscInt k = 0; k < e->ncolumn; k++)
    at = strcmp(e->column[k], column) ? at : k;
  PetscCheck(at >= 0 && R, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No column %s_%s", effect, column);
  PetscCall(contact_columns(run, t, R, e, values));
  *value = values[at];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The value of a column in history.csv after a step: for monitors of a run with want_energies, and
   after it. */
static inline PetscErrorCode contact_column(SbRun run, PetscReal t, const char *effect,
                                            const char *column, PetscReal *value)
{
  PetscFunctionBeginUser;
  PetscCall(contact_column_of(run, t, run->state.reaction, effect, column, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of a vector over the nodes of each body, weighted by nodal mass (kg) if `weigh`:
   sum[nbody][3] on every rank. */
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
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, sum, (PetscMPIInt)(3 * m->nbody), MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mass of each body, kg, on every rank. */
static inline PetscErrorCode contact_body_masses(SbModel m, PetscReal mass[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(mass, m->nbody));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++)
    mass[m->space->node_body[i]] += m->space->node_mass[i];
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, mass, (PetscMPIInt)m->nbody, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest deviation of the stress from a uniaxial pressure along z (Pa), relative to it. */
static inline PetscErrorCode contact_stress_error(TestScene *t, PetscReal pressure,
                                                  PetscReal *worst)
{
  SbSpace s = t->model->space;
  PetscReal *sigma;
  const PetscReal *u;

  PetscFunctionBeginUser;
  *worst = 0;
  PetscCall(PetscMalloc1(6 * s->mesh->ncell_owned, &sigma));
  PetscCall(SbSpaceGetLocalRead(s, t->run->state.U, &u));
  SbSpaceCellState(s, u, sigma, NULL, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->state.U, &u));
  for (PetscInt c = 0; c < 6 * s->mesh->ncell_owned; c++)
    *worst = PetscMax(*worst, PetscAbsReal(sigma[c] + (c % 6 == 2 ? pressure : 0)) / pressure);
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Net contact force on each body after the last step, N: force[nbody][3] on every rank. For a run
   with want_energies. */
static inline PetscErrorCode contact_body_forces(SbRun run, PetscReal t, PetscReal force[])
{
  Vec F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->state.U, &F));
  PetscCall(SbContactSetForce(&run->model->contacts, t, run->state.U, F));
  PetscCall(contact_body_sums(run->model, F, PETSC_FALSE, force));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  History of a run: a row per step, initial state included, with named columns: t, dt, kinetic,
  strain, energy (total with the potential of gravity g along -z and the barrier energy),
  momentum_x, angular_x, centre_x, volume, min_J, speed, BODY_vx (of its centre), EFFECT_COLUMN of
  the contact effects, missing (largest component of the change of momentum in the step less that by
  weight and obstacle forces, kg m/s), and, if requested, net (likewise of the sum of contact forces
  on all bodies) and push (on the first body), N.
*/
typedef struct {
  PetscReal g;            /* set before the run, m/s^2 */
  PetscBool forces;       /* set before the run: record net and push */
  PetscReal from;         /* record_max, record_min, record_gain ignore rows up to this time, s */
  PetscReal mass, lowest; /* kg; lowest node at rest, z, m */
  PetscInt newton, steps, rejected; /* totals of the run */
  PetscInt n, ncolumn, room,
    at;        /* numbers of rows and columns, allocated values, next column to be set */
  size_t kept; /* place in record_kept, from 1 */
  char (*name)[2 * SB_NAME_MAX]; /* [ncolumn] */
  PetscReal *value;              /* [n][ncolumn] */
} Record;

/* Arrays of all records, which are freed when the program ends. */
static struct {
  void *name, *value;
} record_kept[256];
static size_t record_count;

static inline PetscErrorCode record_free_all(void)
{
  PetscFunctionBeginUser;
  for (size_t k = 0; k < record_count; k++) {
    PetscCall(PetscFree(record_kept[k].name));
    PetscCall(PetscFree(record_kept[k].value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Column values in every row: [n], with a stride of ncolumn. */
static inline const PetscReal *record_column(const Record *r, const char *name)
{
  static PetscReal none = NAN;

  for (PetscInt c = 0; c < r->ncolumn; c++)
    if (!strcmp(r->name[c], name))
      return r->value + c;
  SB_CHECK(0, "the run has no column %s", name);
  return &none;
}

static inline PetscReal record_at(const Record *r, const char *name, PetscInt row)
{
  const PetscReal *v = record_column(r, name);

  return isnan(*v) ? *v : v[row * r->ncolumn];
}

static inline PetscReal record_last(const Record *r, const char *name)
{
  return record_at(r, name, r->n - 1);
}

/* Extreme of sign times a column, or of its change in a step. */
static inline PetscReal record_extreme(const Record *r, const char *name, PetscReal sign,
                                       PetscBool change)
{
  const PetscReal *v = record_column(r, name);
  const PetscReal *t = record_column(r, "t");
  PetscReal most = -PETSC_MAX_REAL;

  for (PetscInt i = change; i < r->n && !isnan(*v); i++) {
    if (r->from > 0 && t[i * r->ncolumn] <= r->from)
      continue;
    most = PetscMax(most, sign * (v[i * r->ncolumn] - (change ? v[(i - 1) * r->ncolumn] : 0)));
  }
  return isnan(*v) ? *v : sign * most;
}
#define record_max(r, name) record_extreme(r, name, 1, PETSC_FALSE)
#define record_min(r, name) record_extreme(r, name, -1, PETSC_FALSE)
#define record_gain(r, name) record_extreme(r, name, 1, PETSC_TRUE) /* largest increase in a step */

/* Largest norm of the vector NAME_x, NAME_y, NAME_z, or of its change in a step. */
static inline PetscReal record_size(const Record *r, const char *name, PetscBool change)
{
  PetscReal most = 0;

  for (int k = 0; k < 3; k++) {
    char column[SB_NAME_MAX];

    (void)snprintf(column, sizeof(column), "%s_%c", name, "xyz"[k]);
    most = PetscMax(
      most, PetscMax(record_extreme(r, column, 1, change), -record_extreme(r, column, -1, change)));
  }
  return most;
}

/* Integral of a column over time. */
static inline PetscReal record_impulse(const Record *r, const char *name)
{
  PetscReal sum = 0;

  for (PetscInt i = 1; i < r->n; i++)
    sum += record_at(r, "dt", i) * record_at(r, name, i);
  return sum;
}

/* Number of times that a column rises above zero after the start. */
static inline PetscInt record_starts(const Record *r, const char *name)
{
  PetscInt starts = 0;

  for (PetscInt i = 1; i < r->n; i++)
    starts += record_at(r, name, i) > 0 && (i == 1 || record_at(r, name, i - 1) <= 0);
  return starts;
}

/* Beginning of the first and end of the last step in which a column is above `least`, s; 0 if there
   is none. */
static inline void record_span(const Record *r, const char *name, PetscReal least, PetscReal *first,
                               PetscReal *last)
{
  *first = *last = 0;
  for (PetscInt i = 0; i < r->n; i++) {
    if (!(record_at(r, name, i) > least))
      continue;
    if (*last == 0)
      *first = i ? record_at(r, "t", i - 1) : 0;
    *last = record_at(r, "t", i);
  }
}

/* Appends the next value of a row; the first row defines the columns. */
static inline PetscErrorCode record_put(Record *r, const char *first, const char *second,
                                        const char *third, PetscReal value)
{
  PetscFunctionBeginUser;
  if (!r->kept) {
    PetscCheck(record_count < PETSC_STATIC_ARRAY_LENGTH(record_kept), PETSC_COMM_SELF,
               PETSC_ERR_PLIB, "more records");
    if (!record_count)
      PetscCall(PetscRegisterFinalize(record_free_all));
    r->kept = ++record_count;
  }
  if (r->n == 0) {
    PetscCall(PetscRealloc((size_t)(r->ncolumn + 1) * sizeof(*r->name), &r->name));
    PetscCall(
      PetscSNPrintf(r->name[r->ncolumn++], sizeof(*r->name), "%s%s%s", first, second, third));
  }
  if (r->n * r->ncolumn + r->at >= r->room) {
    r->room = 2 * r->room + 256;
    PetscCall(PetscRealloc((size_t)r->room * sizeof(PetscReal), &r->value));
  }
  r->value[r->n * r->ncolumn + r->at++] = value;
  record_kept[r->kept - 1].name = r->name;
  record_kept[r->kept - 1].value = r->value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode record_step(SbRun run, const SbStep *step, void *ctx)
{
  static const char *const xyz[3] = {"x", "y", "z"};
  Record *r = (Record *)ctx;
  const SbModel m = run->model;
  const SbEnergies *e = &step->energies;
  PetscReal force[3] = {0, 0, -m->mass * r->g};
  PetscReal missing = 0;
  PetscReal sum[3 * CONTACT_BODIES], mass[CONTACT_BODIES];
  PetscReal energy = e->kinetic + e->strain + m->mass * r->g * e->centre[2];

  PetscFunctionBeginUser;
  r->at = 0;
  PetscCall(record_put(r, "t", "", "", step->t));
  PetscCall(record_put(r, "dt", "", "", step->dt));
  PetscCall(record_put(r, "kinetic", "", "", e->kinetic));
  PetscCall(record_put(r, "strain", "", "", e->strain));
  for (int k = 0; k < 3; k++)
    PetscCall(record_put(r, "momentum_", xyz[k], "", e->momentum[k]));
  for (int k = 0; k < 3; k++)
    PetscCall(record_put(r, "angular_", xyz[k], "", e->angular[k]));
  for (int k = 0; k < 3; k++)
    PetscCall(record_put(r, "centre_", xyz[k], "", e->centre[k]));
  PetscCall(record_put(r, "volume", "", "", e->volume));
  PetscCall(record_put(r, "min_J", "", "", e->min_J));
  PetscCall(record_put(r, "speed", "", "", e->max_speed));
  // velocities of the centres of the bodies
  if (step->V && m->nbody <= CONTACT_BODIES) {
    PetscCall(contact_body_sums(m, step->V, PETSC_TRUE, sum));
    PetscCall(contact_body_masses(m, mass));
    for (PetscInt i = 0; i < 3 * m->nbody; i++)
      PetscCall(record_put(r, m->body[i / 3].name, "_v", xyz[i % 3], sum[i] / mass[i / 3]));
  }
  // contact columns, with obstacle forces and barrier energy
  for (PetscInt i = 0; i < m->neffect; i++) {
    const SbEffect f = m->effect[i];
    PetscReal value[64] = {0};

    if (!f->contact)
      continue;
    if (run->state.reaction)
      PetscCall(contact_columns(run, step->t, run->state.reaction, f, value));
    for (PetscInt c = 0; c < f->ncolumn; c++) {
      PetscCall(record_put(r, f->name, "_", f->column[c], value[c]));
      if (!strcmp(f->column[c], "energy"))
        energy += value[c];
      for (int k = 0; k < 3; k++)
        force[k] +=
          !strncmp(f->column[c], "force_", 6) && f->column[c][6] == xyz[k][0] ? value[c] : 0;
    }
  }
  PetscCall(record_put(r, "energy", "", "", energy));
  if (!r->n) {
    r->mass = m->mass;
    r->lowest = PETSC_MAX_REAL;
    for (PetscInt i = 0; i < m->space->nnode_owned; i++)
      r->lowest = PetscMin(r->lowest, m->space->node_x[3 * i + 2]);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &r->lowest, 1, MPIU_REAL, MPI_MIN, m->comm));
  }
  for (int k = 0; k < 3 && r->n; k++) {
    const PetscReal before =
      r->value[(r->n - 1) * r->ncolumn + 4 + k]; // momentum_x and the two behind it

    missing = PetscMax(missing, PetscAbsReal(e->momentum[k] - before - step->dt * force[k]));
  }
  PetscCall(record_put(r, "missing", "", "", missing));
  if (r->forces) {
    PetscReal push = 0;
    PetscReal net = 0;

    PetscCall(contact_body_forces(run, step->t, sum));
    for (int k = 0; k < 3; k++) {
      push = PetscMax(push, PetscAbsReal(sum[k]));
      for (PetscInt b = 1; b < m->nbody; b++)
        sum[k] += sum[3 * b + k];
      net = PetscMax(net, PetscAbsReal(sum[k]));
    }
    PetscCall(record_put(r, "push", "", "", push));
    PetscCall(record_put(r, "net", "", "", net));
  }
  r->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode record_add(TestScene *t, Record *r)
{
  PetscFunctionBeginUser;
  t->run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t->run, record_step, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves an open scene and records it; the scene stays open. */
static inline PetscErrorCode record_solve(TestScene *t, Record *r)
{
  PetscFunctionBeginUser;
  PetscCall(record_add(t, r));
  PetscCall(verify_solve(t, verify_title));
  r->newton = t->run->counters.newton;
  r->steps = t->run->counters.steps;
  r->rejected = t->run->counters.rejected;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves and closes the scene of these options. */
static inline PetscErrorCode PETSC_ATTRIBUTE_FORMAT(2, 3)
  record_run(Record *r, const char *format, ...)
{
  TestScene t;
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(test_vopen(PETSC_COMM_WORLD, NULL, &t, format, args));
  va_end(args);
  PetscCall(record_solve(&t, r));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A ball, or its quarter x, y > 0: layers of cubes mapped to spheres. */
typedef struct {
  PetscReal radius; /* m */
  PetscBool quarter;
} ContactBall;

static inline void contact_ball(const VerifyPlace *place, PetscReal x[3])
{
  const ContactBall *b = (const ContactBall *)place->ctx;
  PetscReal layer = 0;
  PetscReal length;

  for (int k = 0; k < 3; k++) {
    if (!b->quarter || k == 2)
      x[k] = 2 * x[k] - 1;
    layer = PetscMax(layer, PetscAbsReal(x[k]));
  }
  length = PetscSqrtReal(SbDot3(x, x));
  for (int k = 0; k < 3; k++)
    x[k] *= length > 0 ? b->radius * layer / length : 0;
}

/* Writes a ball of n layers of cells across. */
static inline PetscErrorCode contact_ball_write(PetscInt n, PetscReal radius, char path[512])
{
  ContactBall ball = {.radius = radius};

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write((const PetscInt[3]){n, n, n}, contact_ball, &ball, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}
