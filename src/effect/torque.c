/*
  torque.c - a torque on bodies, such as that of a motor or a wind, in fixed directions of space.

  A torque T on a body with the masses m_a at x_a, centre c and moments of inertia I = sum of m_a
  (|r|^2 1 - r r^T), r = x_a - c, is the force density of an angular acceleration,

    f_a = m_a (w x r_a),    I w = T,

  whose resultant is zero and whose moment is T, on a rigid body and on a soft one in its current
  shape. Its power is T times the body's mean angular velocity. The force follows the motion, which
  the tangent does not know: in time steps it changes little, and Newton's method converges all the
  same. Hence not for static runs.
*/
#include "effect_impl.h"
#include "sbkernel.h"

typedef struct {
  SbFormula vector[3];
  PetscBool *in;  /* [nbody] it acts on the body */
  PetscReal *sum; /* [nbody][10] mass, mass x, mass x x^T, its upper triangle */
} Torque;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "", "", "bodies that the torque turns, each; default: all"},
  {"vector", SB_OPTION_FORMULA, 3, "N m", NULL, "",
   "torque about the centre of mass, three formulas of the time t"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the torque, a formula of the time t"},
};

static PetscErrorCode options_torque(SbEffect e, const SbScope *scope)
{
  Torque *q = (Torque *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(e, scope, "vector", 3, PETSC_FALSE, q->vector));
  e->linear = PETSC_FALSE;
  e->no_potential = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_torque(SbEffect e, SbSpace space)
{
  Torque *q = (Torque *)e->data;

  PetscFunctionBeginUser;
  PetscCheck(e->dynamic, space->comm, PETSC_ERR_USER_INPUT,
             "effect %s: a torque turns bodies in time: take another -time than static, or a "
             "traction",
             e->name);
  PetscCall(PetscMalloc2(space->mesh->nbody, &q->in, 10 * space->mesh->nbody, &q->sum));
  PetscCall(SbEffectBodies(space, &e->on, q->in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the sums of a body its centre, sum[0..2], and its angular acceleration by a torque T,
   sum[3..5]. */
static void find_acceleration(PetscReal sum[10], const PetscReal T[3])
{
  static const int at[9] = {4, 5, 6, 5, 7, 8, 6, 8, 9};
  PetscReal centre[3], S[9], inertia[9], cofactor[9], trace;

  for (int k = 0; k < 3; k++)
    centre[k] = sum[1 + k] / sum[0];
  for (int k = 0; k < 9; k++)
    S[k] = sum[at[k]] - sum[0] * centre[k / 3] * centre[k % 3];
  trace = S[0] + S[4] + S[8];
  for (int k = 0; k < 9; k++)
    inertia[k] = (k % 4 ? 0. : trace) - S[k];
  SbMatCofactor(inertia, cofactor);
  for (int k = 0; k < 3; k++) {
    sum[k] = centre[k];
    sum[3 + k] = SbDot3(cofactor + 3 * k, T) / SbMatDet(inertia);
  }
}

static PetscErrorCode force_torque(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Torque *q = (const Torque *)e->data;
  PetscReal factor;
  PetscReal T[3];

  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(e->time, stage->t, NULL, &factor));
  for (int k = 0; k < 3; k++) {
    PetscCall(SbFormulaEval(q->vector[k], stage->t, NULL, &T[k]));
    T[k] *= factor;
  }

  // sums over the nodes of all ranks
  PetscCall(PetscArrayzero(q->sum, 10 * space->mesh->nbody));
  for (PetscInt i = 0; i < space->nnode_owned; i++) {
    const PetscReal m = space->node_mass[i];
    PetscReal *sum = q->sum + 10 * space->node_body[i];
    PetscReal x[3];

    if (!q->in[space->node_body[i]])
      continue;
    for (int k = 0; k < 3; k++) {
      x[k] = space->node_x[3 * i + k] + stage->u[3 * i + k];
      sum[1 + k] += m * x[k];
    }
    sum[0] += m;
    for (int j = 0, n = 4; j < 3; j++)
      for (int k = j; k < 3; k++)
        sum[n++] += m * x[j] * x[k];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, q->sum, (PetscMPIInt)(10 * space->mesh->nbody),
                             MPIU_REAL, MPI_SUM, space->comm));

  // centre and angular acceleration of each body in the place of its sums
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    if (q->in[b])
      find_acceleration(q->sum + 10 * b, T);
  for (PetscInt i = 0; i < space->nnode_owned; i++) {
    const PetscReal *centre = q->sum + 10 * space->node_body[i];
    PetscReal r[3], a[3];

    if (!q->in[space->node_body[i]])
      continue;
    for (int k = 0; k < 3; k++)
      r[k] = space->node_x[3 * i + k] + stage->u[3 * i + k] - centre[k];
    SbCross(centre + 3, r, a);
    for (int k = 0; k < 3; k++)
      f[3 * i + k] += space->node_mass[i] * a[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_torque(SbEffect e)
{
  Torque *q = (Torque *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree2(q->in, q->sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectTorque = {
  .name = "torque",
  .size = sizeof(Torque),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_torque,
          .setup = setup_torque,
          .force = force_torque,
          .destroy = destroy_torque},
};
