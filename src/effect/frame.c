/*
  frame.c - the forces of inertia in a frame that accelerates and turns: a vehicle, a centrifuge, a
  head that is hit. Displacements and velocities are those in the frame.

  With r the place relative to a point on the axis n, w the angular velocity and a_0 the
  acceleration of that point,

    f = -M (a_0 + dw/dt n x r + w^2 n x (n x r) + 2 w n x v):

  M is the mass matrix of the run, so that a body that nothing holds moves as it does outside. dw/dt
  is a difference of the formula; in a static run it is zero, and so is v. The tangent does
  not know these forces, which change little within a step: Newton's method converges by w dt, in a
  static run by w^2 over that of the lowest mode.
*/
#include "effect_impl.h"

typedef struct {
  SbFormula acceleration[3], speed; /* m/s^2, rad/s */
  PetscReal axis[3], point[3];
  PetscReal *a; /* [nnode][3] minus the acceleration, m/s^2 */
} Frame;

static const SbOption rows[] = {
  {"acceleration", SB_OPTION_FORMULA, 3, "m/s^2", "0;0;0", "",
   "of the frame, three formulas of the time t"},
  {"speed", SB_OPTION_FORMULA, 1, "rad/s", "0", "",
   "angular velocity of the frame about the axis, right-handed, a formula of the time t"},
  {"axis", SB_OPTION_REALS, 3, "", "0,0,1", "", "direction of the axis"},
  {"axis_point", SB_OPTION_REALS, 3, "m", "0,0,0", "", "a point on the axis"},
};

static PetscErrorCode options_frame(SbEffect e, const SbScope *scope)
{
  Frame *f = (Frame *)e->data;
  PetscBool given[2];

  PetscFunctionBeginUser;
  PetscCall(SbOptionGiven(scope, "acceleration", &given[0]));
  PetscCall(SbOptionGiven(scope, "speed", &given[1]));
  PetscCheck(given[0] || given[1], PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_acceleration (m/s^2, three formulas) or "
             "-effect_%s_speed (rad/s)",
             e->name, e->name, e->name);
  PetscCall(SbEffectFormulas(e, scope, "acceleration", 3, PETSC_FALSE, f->acceleration));
  PetscCall(SbEffectFormulas(e, scope, "speed", 1, PETSC_FALSE, &f->speed));
  PetscCall(SbOptionReals(scope, "axis", f->axis));
  PetscCall(SbOptionReals(scope, "axis_point", f->point));
  PetscCheck(SbNormalise(f->axis) > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_axis has no direction", e->name);
  e->linear = e->steady = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_frame(SbEffect e, SbSpace space)
{
  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * space->nnode, &((Frame *)e->data)->a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_frame(SbEffect e, SbSpace space, const SbStage *stage, PetscReal to[])
{
  const Frame *f = (const Frame *)e->data;
  PetscReal origin[3], w, rate;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    PetscCall(SbEffectValueAt(e, f->acceleration[k], stage->t, &origin[k]));
  PetscCall(SbEffectValueAt(e, f->speed, stage->t, &w));
  PetscCall(SbEffectRateAt(e, f->speed, stage->t, &rate));
  for (PetscInt i = 0; i < space->nnode; i++) {
    PetscReal r[3], turn[3], centre[3];
    PetscReal coriolis[3] = {0};

    for (int k = 0; k < 3; k++)
      r[k] = space->node_x[3 * i + k] + stage->u[3 * i + k] - f->point[k];
    SbCross(f->axis, r, turn);
    SbCross(f->axis, turn, centre);
    if (stage->v)
      SbCross(f->axis, stage->v + 3 * i, coriolis);
    for (int k = 0; k < 3; k++)
      f->a[3 * i + k] = -origin[k] - rate * turn[k] - w * w * centre[k] - 2 * w * coriolis[k];
  }
  SbSpaceAddInertia(space, &(SbStage){.a = f->a}, to);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_frame(SbEffect e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(((Frame *)e->data)->a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectFrame = {
  .name = "frame",
  .size = sizeof(Frame),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_frame,
          .setup = setup_frame,
          .force = force_frame,
          .destroy = destroy_frame},
};
