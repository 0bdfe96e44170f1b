/*
  prescribed_displacement.c - nodes moved along a given path: a translation, a rotation about an axis, or both.

  With r = X - c the rest position relative to a point c of the axis, k the unit direction and theta(t) the
  angle, the prescribed displacement is (Rodrigues 1840)

    u(X, t) = d(t, X) + sin(theta) k x r + 2 sin^2(theta/2) k x (k x r).

  X being a vertex, or with CR and DG the centroid of a triangle. This form has no cancellation at small angles. Reaction: force of the effect on the body (prescribed.c has the
  sign); torque: moment of that force about the axis at rest, taken with the current positions.
*/
#include "effect_impl.h"

typedef struct {
  int components; /* bits 0..2 */
  SbFormula displacement[3], angle;
  PetscReal point[3], axis[3]; /* m; unit vector */
  SbPrescribed prescribed;
  PetscReal *value; /* [p.n][3] m */
} PrescribedDisplacement;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose nodes are moved: vertices, p2 also edge midpoints, cr and dg the means over boundary faces"},
  {"components", SB_OPTION_CHOICE, 1, "", "xyz", SB_COMPONENT_CHOICES, "directions that are prescribed"},
  {"displacement", SB_OPTION_FORMULA, 3, "m", "0;0;0", "",
   "translation, three formulas of t and the reference position x, y, z; live: interactive, as the file "
   "live.txt says during the run"},
  {"angle", SB_OPTION_FORMULA, 1, "degrees", "0", "",
   "angle of rotation about the axis, a formula of the time t"},
  {"axis", SB_OPTION_REALS, 3, "", "0,0,1", "", "direction of the axis of rotation; right-handed"},
  {"axis_point", SB_OPTION_REALS, 3, "m", "0,0,0", "", "a point on the axis of rotation"},
};

static PetscErrorCode options_displacement(SbEffect e, const SbScope *scope)
{
  PrescribedDisplacement *d = (PrescribedDisplacement *)e->data;
  PetscInt choice;
  PetscBool move, turn;
  PetscReal length = 0;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(scope, "components", &choice));
  d->components = SbPrescribedComponents(choice);
  e->prescribed = (PetscBool)(d->components == 7);
  PetscCall(SbOptionGiven(scope, "displacement", &move));
  PetscCall(SbOptionGiven(scope, "angle", &turn));
  PetscCheck(
    move || turn, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "effect %s: give -effect_%s_displacement (m, three formulas) or -effect_%s_angle (degrees, one formula)",
    e->name, e->name, e->name);
  PetscCall(SbEffectFormulas(scope, "displacement", 3, PETSC_TRUE, d->displacement, &e->steady));
  PetscCall(SbEffectFormulas(scope, "angle", 1, PETSC_FALSE, &d->angle, &e->steady));
  PetscCall(SbOptionReals(scope, "axis", d->axis));
  PetscCall(SbOptionReals(scope, "axis_point", d->point));
  for (int i = 0; i < 3; i++) length += d->axis[i] * d->axis[i];
  length = PetscSqrtReal(length);
  PetscCheck(length > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "-effect_%s_axis: 0,0,0 is no direction",
             e->name);
  for (int i = 0; i < 3; i++) d->axis[i] /= length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_displacement(SbEffect e, SbSpace space)
{
  PrescribedDisplacement *d = (PrescribedDisplacement *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbPrescribedSetUp(&d->prescribed, space, &e->on, d->components));
  PetscCall(PetscMalloc1(3 * d->prescribed.n, &d->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement of X by the rotation theta, without cancellation at small angles. */
static void turn(const PrescribedDisplacement *d, const PetscReal X[], PetscReal theta, PetscReal u[3])
{
  const PetscReal r[3] = {X[0] - d->point[0], X[1] - d->point[1], X[2] - d->point[2]};
  const PetscReal half = PetscSinReal(theta / 2);
  PetscReal kr[3], kkr[3];

  SbCross(d->axis, r, kr);
  SbCross(d->axis, kr, kkr);
  for (int c = 0; c < 3; c++) u[c] = PetscSinReal(theta) * kr[c] + 2 * half * half * kkr[c];
}

static PetscErrorCode prescribe_displacement(SbEffect e, SbSpace space, PetscReal t)
{
  PrescribedDisplacement *d = (PrescribedDisplacement *)e->data;
  const PetscReal theta = SbFormulaEval(d->angle, t, NULL) * PETSC_PI / 180;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < d->prescribed.n; i++) {
    const PetscReal *X = &space->node_x[3 * d->prescribed.node[i]];
    PetscReal *value = d->value + 3 * i;

    turn(d, X, theta, value);
    for (int c = 0; c < 3; c++) value[c] += SbFormulaEval(d->displacement[c], t, X);
  }
  PetscCall(SbPrescribedSetValues(&d->prescribed, space, d->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces rotate with the body, so their work is moment times angle; along the chord a constant moment would give only the factor sin(angle). */
static PetscErrorCode turning_work_displacement(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1,
                                                const PetscReal r0[], const PetscReal r1[], PetscReal *work)
{
  const PrescribedDisplacement *d = (const PrescribedDisplacement *)e->data;
  const PetscReal theta[2] = {SbFormulaEval(d->angle, t0, NULL) * PETSC_PI / 180,
                              SbFormulaEval(d->angle, t1, NULL) * PETSC_PI / 180};

  PetscFunctionBeginUser;
  *work = 0;
  if (theta[0] == theta[1]) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < d->prescribed.nowned; i++) {
    const PetscInt node = d->prescribed.node[i];
    const PetscReal *X = &space->node_x[3 * node], *force[2] = {r0 + 3 * node, r1 + 3 * node};
    PetscReal u[2][3], arm[3], way[2][3];

    for (int k = 0; k < 2; k++) {
      turn(d, X, theta[k], u[k]);
      for (int c = 0; c < 3; c++) arm[c] = X[c] - d->point[c] + u[k][c];
      SbCross(d->axis, arm, way[k]); // by the angle
    }
    for (int k = 0; k < 2; k++) {
      for (int c = 0; c < 3; c++) {
        if (d->prescribed.components[i] & (1 << c))
          *work += 0.5 * force[k][c] * ((theta[1] - theta[0]) * way[k][c] - u[1][c] + u[0][c]);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_displacement(SbEffect e, SbSpace space, const SbStage *stage,
                                           const PetscReal residual[], PetscReal values[])
{
  const PrescribedDisplacement *d = (const PrescribedDisplacement *)e->data;

  PetscFunctionBeginUser;
  SbPrescribedReaction(&d->prescribed, residual, values);
  values[3] = 0;
  for (PetscInt i = 0; i < d->prescribed.nowned; i++) {
    const PetscInt node = d->prescribed.node[i];
    PetscReal arm[3], force[3], moment[3];

    for (int c = 0; c < 3; c++) {
      arm[c] = space->node_x[3 * node + c] + stage->u[3 * node + c] - d->point[c];
      force[c] = d->prescribed.components[i] & (1 << c) ? residual[3 * node + c] : 0;
    }
    SbCross(arm, force, moment);
    for (int c = 0; c < 3; c++) values[3] += d->axis[c] * moment[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_displacement(SbEffect e)
{
  PrescribedDisplacement *d = (PrescribedDisplacement *)e->data;

  PetscFunctionBeginUser;
  for (int c = 0; c < 3; c++) PetscCall(SbFormulaDestroy(&d->displacement[c]));
  PetscCall(SbFormulaDestroy(&d->angle));
  PetscCall(SbPrescribedFree(&d->prescribed));
  PetscCall(PetscFree(d->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"reaction_x", "reaction_y", "reaction_z", "torque"};

const SbEffectType SbEffectPrescribedDisplacement = {
  .name = "prescribed_displacement",
  .size = sizeof(PrescribedDisplacement),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_displacement,
          .setup = setup_displacement,
          .prescribe = prescribe_displacement,
          .turning_work = turning_work_displacement,
          .history = history_displacement,
          .destroy = destroy_displacement},
};
