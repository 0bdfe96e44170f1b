/*
  supports.c - the supports `fixed`, nodes with zero displacement, and `prescribed_displacement`,
  nodes moved along a given path: a translation, a rotation about an axis, or both; in all
  directions or in some.

  With r = X - c the rest position relative to a point c of the axis, k the unit direction and
  theta(t) the angle, the prescribed displacement is (Rodrigues 1840)

    u(X, t) = d(t, X) + sin(theta) k x r + 2 sin^2(theta/2) k x (k x r).

  This form has no cancellation at small angles. Reaction: the unbalanced force M a + C v + f_int -
  f_ext of the prescribed unknowns, which the support exerts on the body: one that hangs at rest is
  pulled up by +m g. Torque: moment of that force about the axis at rest, taken with the current
  positions.

  X is a vertex, or with CR and DG the centroid of a triangle: they are constrained at the triangles
  of their surface, in the mean; one triangle alone, or two, leave rotations free. A DG face that is
  prescribed in all directions has a node of its own, to which its cell is tied by a penalty
  (src/fem/layout.c; -body_X_dirichlet strong: the mean itself is prescribed). Single directions are
  constrained in the mean itself. Of several effects that prescribe one unknown, the first in the
  scenario counts; once the others have another value there, a warning names both.
*/
#include "effect_impl.h"
#include "sbgeometry.h"

#define COMPONENTS "x|y|z|xy|yz|xz|xyz"

typedef struct {
  int components;     /* bits 0..2 */
  SbPath path;        /* zero: fixed */
  PetscInt n, nowned; /* nodes with unknowns that it prescribes */
  PetscInt *node;     /* [n] local, ascending, owned ones first */
  uint8_t *bits;      /* [n] bit c: component c is prescribed by this effect */
  PetscInt ncorner;   /* vertices of faces whose nodes are among them */
  PetscInt *corner;   /* [ncorner]; NULL without face nodes */

  /* owned nodes where an earlier effect prescribes what this one would */
  PetscInt nlost;
  PetscInt *lost;      /* [nlost] local, ascending */
  uint8_t *lost_bits;  /* [nlost] */
  PetscBool watched;   /* some rank has such nodes, and their values have been alike so far */
  PetscInt conflict;   /* the first of lost[] whose value differs, -1: none so far */
  int component;       /* there */
  PetscReal differ[2]; /* what the earlier effect and this one say, m */
} Support;

static const SbOption fixed_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose nodes are fixed: vertices, p2 also edge midpoints, cr and dg the means over "
   "boundary faces"},
  {"components", SB_OPTION_CHOICE, 1, "", "xyz", COMPONENTS, "directions that are fixed"},
};

static const SbOption moved_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose nodes are moved: vertices, p2 also edge midpoints, cr and dg the means over "
   "boundary faces"},
  {"components", SB_OPTION_CHOICE, 1, "", "xyz", COMPONENTS, "directions that are prescribed"},
  {"displacement", SB_OPTION_FORMULA, 3, "m", "0;0;0", "",
   "translation, three formulas of t and the reference position x, y, z; live: interactive, as the "
   "file "
   "live.txt says during the run"},
  {"angle", SB_OPTION_FORMULA, 1, "degrees", "0", "",
   "angle of rotation about the axis, a formula of the time t"},
  {"axis", SB_OPTION_REALS, 3, "", "0,0,1", "", "direction of the axis of rotation; right-handed"},
  {"axis_point", SB_OPTION_REALS, 3, "m", "0,0,0", "", "a point on the axis of rotation"},
};

static PetscErrorCode options_fixed(SbEffect e, const SbScope *scope)
{
  static const int bits[] = {1, 2, 4, 3, 6, 5, 7};
  Support *d = (Support *)e->data;
  int choice;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(scope, "components", &choice));
  d->components = bits[choice];
  e->prescribed = (PetscBool)(d->components == 7);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_moved(SbEffect e, const SbScope *scope)
{
  Support *d = (Support *)e->data;
  PetscBool move, turn;

  PetscFunctionBeginUser;
  PetscCall(options_fixed(e, scope));
  PetscCall(SbOptionGiven(scope, "displacement", &move));
  PetscCall(SbOptionGiven(scope, "angle", &turn));
  PetscCheck(move || turn, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_displacement (m, three formulas) or -effect_%s_angle "
             "(degrees, one formula)",
             e->name, e->name, e->name);
  PetscCall(SbPathRead(e, scope, PETSC_TRUE, &d->path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the vertices of faces whose nodes the effect prescribes. */
static PetscErrorCode list_corners(Support *d, SbSpace space)
{
  const SbMesh mesh = space->mesh;
  PetscBool *in, *seen;

  PetscFunctionBeginUser;
  if (!space->vertex_value)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc2(space->nnode, &in, mesh->nvert, &seen));
  PetscCall(PetscMalloc1(mesh->nvert, &d->corner));
  for (PetscInt i = 0; i < d->n; i++)
    in[d->node[i]] = PETSC_TRUE;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt support = space->dirichlet_node ? space->dirichlet_node[i] : -1;

    if (!SbElementHasFaces(SbSpaceCellElement(space, i / 4)) ||
        !in[support >= 0 ? support : space->cell_node[i]])
      continue;
    for (int k = 0; k < 3; k++) {
      const PetscInt v = mesh->cell[4 * (i / 4) + SbFaceVertex[i % 4][k]];

      if (!seen[v])
        d->corner[d->ncorner++] = v;
      seen[v] = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree2(in, seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_support(SbEffect e, SbSpace space)
{
  Support *d = (Support *)e->data;
  PetscInt n, owned[2];

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(space, &e->on, SB_ON_NODES, &n, &d->node));
  PetscCall(PetscMalloc1(n, &d->bits));
  for (PetscInt i = 0; i < n; i++)
    d->nlost +=
      d->node[i] < space->nnode_owned && (d->components & (int)space->fixed[d->node[i]]) != 0;
  PetscCall(PetscMalloc2(d->nlost, &d->lost, d->nlost, &d->lost_bits));
  d->nlost = 0;
  d->conflict = -1;

  /* an earlier effect keeps what it has; all ranks see a node with the same bits, so they decide
     alike */
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt node = d->node[i];
    const int free = d->components & ~(int)space->fixed[node];

    if (node < space->nnode_owned && free != d->components) {
      d->lost[d->nlost] = node;
      d->lost_bits[d->nlost++] = (uint8_t)(d->components & ~free);
    }
    if (!free)
      continue;
    PetscCall(SbSpacePrescribe(space, node, free));
    d->node[d->n] = node;
    d->bits[d->n++] = (uint8_t)free;
    if (node < space->nnode_owned)
      d->nowned = d->n;
  }
  PetscCall(list_corners(d, space));
  owned[0] = d->nowned;
  owned[1] = d->nlost;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, owned, 2, MPIU_INT, MPI_SUM, space->comm));
  d->watched = (PetscBool)(owned[1] > 0);
  PetscCheck(owned[0], space->comm, PETSC_ERR_USER_INPUT,
             "%s: every displacement of %s is already prescribed by an earlier effect: remove one "
             "of the two",
             e->on.option, e->on.n == 1 ? e->on.name[0] : "these sets");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement that the effect prescribes at a rest position, m; of the angle: sine, and sine of
   half of it. */
static PetscErrorCode displacement_at(const Support *d, PetscReal t, const PetscReal X[3],
                                      const PetscReal sine[2], PetscReal u[3])
{
  PetscReal r[3], kr[3], kkr[3];

  PetscFunctionBeginUser;
  SbSubtract(X, d->path.point, r);
  SbCross(d->path.axis, r, kr);
  SbCross(d->path.axis, kr, kkr);
  for (int c = 0; c < 3; c++) {
    u[c] = 0;
    if (!d->path.angle)
      continue;
    PetscCall(SbFormulaEval(d->path.displacement[c], t, X, &u[c]));
    u[c] += sine[0] * kr[c] + 2 * sine[1] * sine[1] * kkr[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode prescribe_support(SbEffect e, SbSpace space, PetscReal t)
{
  Support *d = (Support *)e->data;
  PetscReal theta = 0;
  PetscReal sine[2], u[3];

  PetscFunctionBeginUser;
  if (d->path.angle)
    PetscCall(SbFormulaEval(d->path.angle, t, NULL, &theta));
  theta *= PETSC_PI / 180;
  sine[0] = PetscSinReal(theta);
  sine[1] = PetscSinReal(theta / 2);
  for (PetscInt i = 0, row = 0; i < d->n; i++) {
    while (space->fixed_node[row] != d->node[i])
      row++; /* both ascend, and it is among them */
    PetscCall(displacement_at(d, t, &space->node_x[3 * d->node[i]], sine, u));
    for (int c = 0; c < 3; c++)
      if (d->bits[i] & (1 << c))
        space->fixed_value[3 * row + c] = u[c];
  }
  for (PetscInt i = 0; i < d->ncorner; i++) {
    PetscCall(displacement_at(d, t, space->mesh->x + 3 * d->corner[i], sine, u));
    for (int c = 0; c < 3; c++)
      if (d->components & (1 << c))
        space->vertex_value[3 * d->corner[i] + c] = u[c];
  }

  // what an earlier effect has there
  for (PetscInt i = 0, row = 0; d->watched && d->conflict < 0 && i < d->nlost; i++) {
    while (space->fixed_node[row] != d->lost[i])
      row++;
    PetscCall(displacement_at(d, t, &space->node_x[3 * d->lost[i]], sine, u));
    for (int c = 0; c < 3 && d->conflict < 0; c++) {
      const PetscReal its = space->fixed_value[3 * row + c];

      if (!(d->lost_bits[i] & (1 << c)) ||
          PetscAbsReal(its - u[c]) <= 1e-9 * PetscMax(PetscAbsReal(its), PetscAbsReal(u[c])))
        continue;
      d->conflict = i;
      d->component = c;
      d->differ[0] = its;
      d->differ[1] = u[c];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode moments_support(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1,
                                      const PetscReal factor[2], PetscReal sum[16])
{
  const Support *d = (Support *)e->data;
  const PetscReal t[2] = {t0, t1};
  PetscReal sine[2][2] = {{0.}};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscReal theta = 0.;

    if (d->path.angle)
      PetscCall(SbFormulaEval(d->path.angle, t[k], NULL, &theta));
    sine[k][0] = PetscSinReal(theta * PETSC_PI / 180.);
    sine[k][1] = PetscSinReal(theta * PETSC_PI / 360.);
  }
  for (PetscInt i = 0; i < d->nowned; i++) {
    const PetscReal *X = &space->node_x[3 * d->node[i]];
    PetscReal x[2][3];

    if (d->bits[i] != 7)
      continue;
    for (int k = 0; k < 2; k++) {
      PetscCall(displacement_at(d, t[k], X, sine[k], x[k]));
      for (int c = 0; c < 3; c++)
        x[k][c] = X[c] - d->path.point[c] + factor[k] * x[k][c];
    }
    sum[0] += 1.;
    for (int c = 0; c < 3; c++) {
      sum[1 + c] += x[0][c];
      sum[4 + c] += x[1][c];
      for (int q = 0; q < 3; q++)
        sum[7 + 3 * c + q] += x[1][c] * x[0][q];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Name of the first effect that prescribes a component of a node. */
static const char *owner(PetscInt n, SbEffect effect[], PetscInt node, int component)
{
  for (PetscInt k = 0; k < n; k++) {
    const Support *d = (const Support *)effect[k]->data;

    for (PetscInt i = 0; i < d->n && effect[k]->ops.prescribe == prescribe_support; i++)
      if (d->node[i] == node && d->bits[i] & (1 << component))
        return effect[k]->name;
  }
  return "";
}

PetscErrorCode SbSupportsWarn(SbSpace space, PetscInt n, SbEffect effect[], PetscReal t)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n; k++) {
    Support *d = (Support *)effect[k]->data;
    PetscMPIInt rank, lowest;
    char text[512] = "";

    if (effect[k]->ops.prescribe != prescribe_support || !d->watched)
      continue;

    // the lowest rank that has found a node describes it
    PetscCallMPI(MPI_Comm_rank(space->comm, &rank));
    lowest = d->conflict >= 0 ? rank : INT32_MAX;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_INT, MPI_MIN, space->comm));
    if (lowest == INT32_MAX)
      continue;
    d->watched = PETSC_FALSE;
    if (rank == lowest) {
      const PetscInt node = d->lost[d->conflict];
      const PetscReal *x = space->node_x + 3 * node;
      const char *first = owner(n, effect, node, d->component);

      (void)snprintf(text, sizeof(text),
                     "effects %s and %s prescribe different displacements of one node, at (%.6g, "
                     "%.6g, %.6g) m: %g and %g m in direction %c at t = %g; %s counts, which "
                     "comes first: take such nodes out of the sets of one of them",
                     first, effect[k]->name, (double)x[0], (double)x[1], (double)x[2],
                     (double)d->differ[0], (double)d->differ[1], "xyz"[d->component], (double)t,
                     first);
    }
    PetscCallMPI(MPI_Bcast(text, (int)sizeof(text), MPI_CHAR, lowest, space->comm));
    PetscCall(SbWarning(space->comm, "%s", text));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces rotate with the body, so their work is moment times angle; along the chord a constant
   moment would give only the factor sin(angle). */
static PetscErrorCode turning_work_support(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1,
                                           const PetscReal r0[], const PetscReal r1[],
                                           PetscReal *work)
{
  const Support *d = (const Support *)e->data;
  PetscReal theta[2];
  const PetscReal *r[2] = {r0, r1};
  const PetscReal still[3] = {0};
  SbPose pose[2];

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscCall(SbFormulaEval(d->path.angle, k ? t1 : t0, NULL, &theta[k]));
    theta[k] *= PETSC_PI / 180;
  }
  if (theta[0] == theta[1])
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 2; k++)
    SbPoseSet(d->path.axis, theta[k], d->path.point, still, &pose[k]);
  for (PetscInt i = 0; i < d->nowned; i++) {
    const PetscInt node = 3 * d->node[i];
    PetscReal x[2][3], way[3];

    for (int k = 0; k < 2; k++)
      SbPoseApply(&pose[k], space->node_x + node, x[k]);
    for (int k = 0; k < 2; k++) {
      SbPoseWay(&pose[0], &pose[1], &pose[k], x[k], way);
      for (int c = 0; c < 3; c++)
        if (d->bits[i] & (1 << c))
          *work += 0.5 * r[k][node + c] * (way[c] - (x[1][c] - x[0][c]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_support(SbEffect e, SbSpace space, const SbStage *stage,
                                      const PetscReal residual[], PetscReal values[])
{
  const Support *d = (const Support *)e->data;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < e->ncolumn; k++)
    values[k] = 0;
  for (PetscInt i = 0; i < d->nowned; i++) {
    const PetscInt node = 3 * d->node[i];
    PetscReal arm[3], force[3], moment[3];

    for (int c = 0; c < 3; c++) {
      force[c] = d->bits[i] & (1 << c) ? residual[node + c] : 0;
      values[c] += force[c];
    }
    if (!d->path.angle)
      continue;
    for (int c = 0; c < 3; c++)
      arm[c] = space->node_x[node + c] + stage->u[node + c] - d->path.point[c];
    SbCross(arm, force, moment);
    values[3] += SbDot3(d->path.axis, moment);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_support(SbEffect e)
{
  Support *d = (Support *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(d->node));
  PetscCall(PetscFree(d->bits));
  PetscCall(PetscFree(d->corner));
  PetscCall(PetscFree2(d->lost, d->lost_bits));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"reaction_x", "reaction_y", "reaction_z", "torque"};

const SbEffectType SbEffectFixed = {
  .name = "fixed",
  .size = sizeof(Support),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(fixed_rows),
  .row = fixed_rows,
  .ncolumn = 3,
  .column = columns,
  .ops = {.setfromoptions = options_fixed,
          .setup = setup_support,
          .prescribe = prescribe_support,
          .history = history_support,
          .destroy = destroy_support},
};

const SbEffectType SbEffectPrescribedDisplacement = {
  .name = "prescribed_displacement",
  .size = sizeof(Support),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(moved_rows),
  .row = moved_rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_moved,
          .setup = setup_support,
          .prescribe = prescribe_support,
          .turning_work = turning_work_support,
          .moments = moments_support,
          .history = history_support,
          .destroy = destroy_support},
};
