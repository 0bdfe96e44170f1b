/*
  joint.c - a joint between two bodies, rigid or soft, or a body and the ground: ball, hinge, slider
  or weld, with springs, motors and limits.

  Each side has a frame of four points, P_0 the place of the joint, P_1 on its axis, P_2 and P_3
  across, which the affine map of least squares through its nodes carries,

    x(P) = sum_a w_a(P) x_a,   w_a = m_a (1 / M + (P - c) . C^-1 (X_a - c)),

  c the centre of the nodes at rest, C = sum m_a (X_a - c)(X_a - c)^T. A rigid body has four nodes:
  the map is its motion. The frame of the ground stays. With D_i = x_A(P_i) - x_B(P_i),

    ball    E = k/2 |D_0|^2
    hinge   E = k/2 (|D_0|^2 + |D_1|^2) + e(q),          q the angle of A about the axis of B
    slider  E = k/2 (|D_0|^2 - q^2 + sum_i |D_i - D_0|^2) + e(q),   q = D_0 along the axis of B
    weld    E = k/2 sum_i |D_i|^2

  so that no rigid motion of both has a force. The coordinate q of the joint has the energy

    e(q) = spring / 2 q^2 - drive(t) q + K/2 (q - given(t))^2 + K/2 (its excess over the limits)^2,

  and a damper; K = k, times the square of the frame's size for an angle. An angle is followed from
  step to step beyond half a turn; its difference from a given one is that of a turn or less. E is
  no multiplier: the joint yields as k says, by default FACTOR times the stiffness of the softer
  body of the two.

  Tangent: the exact second derivative, but of the damper's direction.
*/
#include "effect_impl.h"
#include "sbgeometry.h"
#include "sbkernel.h"

#define FACTOR 100. /* stiffness of the joint over that of a soft body, E L */
#define THIN 1e-3   /* thickness of a set over its size, below which it has no frame across */
#define MANY 2000   /* nodes whose dense block is large: 300 MB */
#define FAR 2.      /* of the size of a set: a joint that is farther from it is said */

enum {
  POINTS = 4,
  SIDES = 2,
  PLACES = SIDES * POINTS, /* points of A, then of B */
  SIZE = 3 * PLACES        /* numbers of a state */
};
typedef enum {
  BALL,
  HINGE,
  SLIDER,
  WELD
} Kind;

typedef struct {
  Kind kind;
  SbFormula given, drive;               /* of q: degrees or m, NULL: free; N m or N, NULL: none */
  PetscReal at[3], axis[3], radius;     /* m, unit vector, m; 0: all nodes */
  PetscReal stiffness, spring, damping; /* k, N/m; of q: N m/rad and N m s, or N/m and N s/m */
  PetscBool limited;
  PetscReal limit[2];        /* of q, rad or m */
  PetscReal kept;            /* q at the end of the last step, of a hinge, rad */
  PetscReal size;            /* of the frame, m */
  PetscReal rest[POINTS][3]; /* the frame at rest, m */
  PetscInt number;           /* of the coupling; -1: none of its nodes is owned here */
  PetscInt n;                /* its nodes */
  PetscReal *weight;         /* [PLACES][n] of the nodes in the points */
  PetscReal *work;           /* [SIZE][3 n], then [3 n][3 n]: of the tangent */
} Joint;

/* A node of a side, as ranks send it. */
typedef struct {
  PetscInt gnode, body;
  PetscReal mass, x[3]; /* kg; at rest, m */
} Node;

/* A joint at a stage: energy, J, with its derivatives by the places of the points. */
typedef struct {
  PetscReal x[PLACES][3], v[PLACES][3]; /* m, m/s */
  PetscReal q, rate;                    /* rad or m, and per s */
  PetscReal energy;
  PetscReal g[SIZE], H[SIZE][SIZE];
  PetscReal dq[SIZE];
} State;

#define JOINT_KINDS "ball|hinge|slider|weld"

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "the body that is joined, or sets of it around the joint"},
  {"to", SB_OPTION_NAMES, 1, "", "", "",
   "the other body, or sets of it around the joint; default: the ground"},
  {"kind", SB_OPTION_CHOICE, 1, "", "hinge", JOINT_KINDS,
   "ball: one place is common; hinge: turns about the axis; slider: moves along it; weld: moves as "
   "one"},
  {"at", SB_OPTION_REALS, 3, "m", NULL, "", "place of the joint at rest"},
  {"radius", SB_OPTION_REAL, 1, "m", "0", "[0, inf)",
   "of soft bodies only nodes nearer to the joint at rest are held; 0: all of `on` and `to`"},
  {"axis", SB_OPTION_REALS, 3, "", "0,0,1", "", "of a hinge or slider: its direction at rest"},
  {"angle", SB_OPTION_FORMULA, 1, "degrees", "", "",
   "motor of a hinge: angle of `on` about the axis, right-handed, a formula of the time t; "
   "default: free"},
  {"displacement", SB_OPTION_FORMULA, 1, "m", "", "",
   "motor of a slider: way of `on` along the axis, a formula of the time t; default: free"},
  {"torque", SB_OPTION_FORMULA, 1, "N m", "", "",
   "of a hinge: moment on `on` about the axis, its opposite on `to`, a formula of the time t"},
  {"force", SB_OPTION_FORMULA, 1, "N", "", "",
   "of a slider: force on `on` along the axis, its opposite on `to`, a formula of the time t"},
  {"spring", SB_OPTION_REAL, 1, "N m/rad, N/m", "0", "[0, inf)",
   "of a hinge or slider: moment over angle, or force over way, back to where it is at rest"},
  {"damping", SB_OPTION_REAL, 1, "N m s/rad, N s/m", "0", "[0, inf)",
   "of a hinge or slider: moment over angular velocity, or force over speed"},
  {"limits", SB_OPTION_REALS, 2, "degrees, m", "", "",
   "of a hinge or slider: least and largest angle or way"},
  {"stiffness", SB_OPTION_REAL, 1, "N/m", "0", "[0, inf)",
   "force over the distance by which the joint yields; 0: 100 times Young's modulus of the softer "
   "body by its size, or that of two rigid ones"},
};

static const char *const kinds[] = {"ball", "hinge", "slider", "weld"};

/* An option that only some kinds have. */
static PetscErrorCode given_for(SbEffect e, const SbScope *scope, const char *key, Kind one,
                                Kind other, PetscBool *given)
{
  const Joint *joint = (const Joint *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionGiven(scope, key, given));
  PetscCheck(!*given || joint->kind == one || joint->kind == other, PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT, "-effect_%s_%s is for a %s%s%s, and -effect_%s_kind is %s",
             e->name, key, kinds[one], one == other ? "" : " or a ",
             one == other ? "" : kinds[other], e->name, kinds[joint->kind]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_joint(SbEffect e, const SbScope *scope)
{
  static const char *const free_columns[] = {"force_x",  "force_y",  "force_z", "torque_x",
                                             "torque_y", "torque_z", "gap",     "energy"};
  static const char *const hinge_columns[] = {
    "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "gap", "energy", "angle"};
  static const char *const slider_columns[] = {"force_x",  "force_y",  "force_z",
                                               "torque_x", "torque_y", "torque_z",
                                               "gap",      "energy",   "displacement"};
  Joint *joint = (Joint *)e->data;
  const struct {
    const char *key;
    Kind kind;
    SbFormula *to;
  } motors[] = {{"angle", HINGE, &joint->given},
                {"displacement", SLIDER, &joint->given},
                {"torque", HINGE, &joint->drive},
                {"force", SLIDER, &joint->drive}};
  PetscReal length;
  PetscBool given;
  Kind kind;

  PetscFunctionBeginUser;
  joint->number = -1;
  PetscCall(SbOptionChoice(scope, "kind", &joint->kind));
  kind = joint->kind;
  PetscCall(SbOptionReals(scope, "at", joint->at));
  PetscCall(SbOptionReal(scope, "radius", &joint->radius));
  PetscCall(SbOptionReals(scope, "axis", joint->axis));
  PetscCall(given_for(e, scope, "axis", HINGE, SLIDER, &given));
  PetscCheck(given || joint->kind == BALL || joint->kind == WELD, PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT, "a %s needs its axis: -effect_%s_axis x,y,z", kinds[kind],
             e->name);
  length = SbNormalise(joint->axis);
  PetscCheck(length > 0 && !PetscIsInfOrNanReal(length), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_axis has no direction", e->name);

  /* of the coordinate */
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(motors); k++) {
    PetscCall(given_for(e, scope, motors[k].key, motors[k].kind, motors[k].kind, &given));
    if (given)
      PetscCall(SbEffectFormulas(e, scope, motors[k].key, 1, PETSC_FALSE, motors[k].to));
  }
  PetscCall(given_for(e, scope, "spring", HINGE, SLIDER, &given));
  PetscCall(given_for(e, scope, "damping", HINGE, SLIDER, &given));
  PetscCall(given_for(e, scope, "limits", HINGE, SLIDER, &given));
  PetscCall(SbOptionReal(scope, "spring", &joint->spring));
  PetscCall(SbOptionReal(scope, "damping", &joint->damping));
  joint->limit[0] = PETSC_MIN_REAL;
  joint->limit[1] = PETSC_MAX_REAL;
  if (given)
    PetscCall(SbOptionReals(scope, "limits", joint->limit));
  PetscCheck(joint->limit[0] < joint->limit[1], PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_limits: %g is not below %g", e->name, (double)joint->limit[0],
             (double)joint->limit[1]);
  PetscCheck(joint->limit[0] <= 0 && joint->limit[1] >= 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_limits %g,%g do not hold the state at rest, 0", e->name,
             (double)joint->limit[0], (double)joint->limit[1]);
  PetscCheck(!given || !joint->given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_limits and a motor by -effect_%s_%s: what is given needs no limits",
             e->name, e->name, kind == HINGE ? "angle" : "displacement");
  PetscCheck(!joint->drive || !joint->given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_%s and -effect_%s_%s: a motor gives the motion or the effort, not both",
             e->name, kind == HINGE ? "angle" : "displacement", e->name,
             kind == HINGE ? "torque" : "force");
  for (int k = 0; k < 2 && given && kind == HINGE; k++)
    joint->limit[k] *= PETSC_PI / 180;
  joint->limited = given;
  PetscCall(SbOptionReal(scope, "stiffness", &joint->stiffness));

  e->column = kind == HINGE ? hinge_columns : kind == SLIDER ? slider_columns : free_columns;
  e->ncolumn = PETSC_STATIC_ARRAY_LENGTH(free_columns) + (kind == HINGE || kind == SLIDER);
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  e->holds = (PetscBool)!e->to.n;
  if (kind == HINGE) {
    e->nstate = 1;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  e->ops.accept = NULL;
  e->ops.save = NULL;
  e->ops.load = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of a side on all ranks. */
static PetscErrorCode gather(SbEffect e, SbSpace space, const SbEffectOn *on, PetscInt *n,
                             Node **node)
{
  const Joint *joint = (const Joint *)e->data;
  PetscInt *item;
  PetscInt nitem;
  PetscInt nmine = 0;
  Node *mine;
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(space, on, SB_ON_NODES, &nitem, &item));
  PetscCall(PetscMalloc1(nitem, &mine));
  for (PetscInt i = 0; i < nitem && item[i] < space->nnode_owned; i++) {
    const PetscReal *x = space->node_x + 3 * item[i];
    Node *to = &mine[nmine];

    if (joint->radius > 0 && !space->element[space->node_body[item[i]]]->rigid &&
        SbDistance2(x, joint->at) > PetscSqr(joint->radius))
      continue;
    nmine++;
    *to = (Node){.gnode = space->gnode[item[i]],
                 .body = space->node_body[item[i]],
                 .mass = space->node_mass[item[i]]};
    PetscCall(PetscArraycpy(to->x, x, 3));
  }
  PetscCall(PetscFree(item));
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(Node), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(SbAllgatherv(space->comm, type, nmine, mine, n, node, NULL));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(mine));
  PetscCheck(*n > 3, space->comm, PETSC_ERR_USER_INPUT,
             "%s: %" PetscInt_FMT
             " of its nodes are within %g m of the joint at (%g, %g, %g) m, and "
             "a joint needs four or more",
             on->option, *n, (double)joint->radius, (double)joint->at[0], (double)joint->at[1],
             (double)joint->at[2]);
  PetscCheck(*n <= MANY, space->comm, PETSC_ERR_USER_INPUT,
             "%s: %" PetscInt_FMT
             " nodes, which a joint couples all with each other, and at most %d may be: give "
             "-effect_%s_radius (m), or name a set around the joint",
             on->option, *n, MANY, e->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Centre, size and C^-1 of the nodes of a side. */
static PetscErrorCode measure_side(SbEffect e, SbSpace space, const SbEffectOn *on, PetscInt n,
                                   const Node node[], PetscReal c[3], PetscReal *size,
                                   PetscReal inverse[9])
{
  const Joint *joint = (const Joint *)e->data;
  PetscReal C[9] = {0};
  PetscReal mass = 0;
  PetscReal det, trace, far;
  PetscReal box[6], off[3];

  PetscFunctionBeginUser;
  c[0] = c[1] = c[2] = 0;
  SbBoxClear(box);
  for (PetscInt i = 0; i < n; i++) {
    PetscCheck(
      node[i].body == node[0].body, space->comm, PETSC_ERR_USER_INPUT,
      "%s: these nodes are of two bodies, %s and %s; a joint has one on each side, `on` and "
      "`to`",
      on->option, space->mesh->body[node[0].body].name, space->mesh->body[node[i].body].name);
    mass += node[i].mass;
    for (int k = 0; k < 3; k++)
      c[k] += node[i].mass * node[i].x[k];
    SbBoxAdd(box, node[i].x);
  }
  for (int k = 0; k < 3; k++)
    c[k] /= mass;
  for (PetscInt i = 0; i < n; i++)
    for (int k = 0; k < 9; k++)
      C[k] += node[i].mass / mass * (node[i].x[k / 3] - c[k / 3]) * (node[i].x[k % 3] - c[k % 3]);
  trace = C[0] + C[4] + C[8];
  det = SbMatDet(C);
  PetscCheck(
    det > PetscSqr(THIN) * trace * trace * trace / 27, space->comm, PETSC_ERR_USER_INPUT,
    "%s: the %" PetscInt_FMT
    " nodes of this set lie in a plane, or nearly, and do not tell how it turns: name a set "
    "with tets in it, such as a body or a box",
    on->option, n);
  SbMatCofactor(C, inverse);
  for (int k = 0; k < 9; k++)
    inverse[k] /= det; /* C is symmetric */
  *size = PetscSqrtReal(trace);

  /* a frame that reaches far outside */
  for (int k = 0; k < 3; k++)
    off[k] = PetscMax(0, PetscMax(box[k] - joint->at[k], joint->at[k] - box[3 + k]));
  far = PetscSqrtReal(SbDot3(off, off));
  if (far > FAR * SbBoxDiagonal(box))
    PetscCall(
      SbWarning(space->comm,
                "effect %s: the joint at (%g, %g, %g) m is %.3g m away from the nodes of %s, "
                "which are %.3g m wide: small motions of these move it far",
                e->name, (double)joint->at[0], (double)joint->at[1], (double)joint->at[2],
                (double)far, on->option, (double)SbBoxDiagonal(box)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The frame at rest. */
static void set_frame(Joint *joint)
{
  PetscReal across[2][3];
  PetscReal other[3] = {0};
  int least = 0;

  for (int k = 1; k < 3; k++)
    if (PetscAbsReal(joint->axis[k]) < PetscAbsReal(joint->axis[least]))
      least = k;
  other[least] = 1;
  SbCross(joint->axis, other, across[0]);
  (void)SbNormalise(across[0]);
  SbCross(joint->axis, across[0], across[1]);
  for (int i = 0; i < POINTS; i++)
    for (int k = 0; k < 3; k++) {
      const PetscReal *way = i == 1 ? joint->axis : across[PetscMax(0, i - 2)];

      joint->rest[i][k] = joint->at[k] + (i ? joint->size * way[k] : 0);
    }
}

static PetscErrorCode couplings_joint(SbEffect e, SbSpace space)
{
  Joint *joint = (Joint *)e->data;
  const SbEffectOn *const on[SIDES] = {&e->on, &e->to};
  const int nside = e->to.n ? SIDES : 1;
  PetscReal centre[SIDES][3], size[SIDES], inverse[SIDES][9], young[SIDES], mass;
  PetscInt n[SIDES], *gnode;
  PetscBool rigid[SIDES];
  Node *node[SIDES];

  PetscFunctionBeginUser;
  for (int s = 0; s < nside; s++) {
    PetscCall(gather(e, space, on[s], &n[s], &node[s]));
    PetscCall(measure_side(e, space, on[s], n[s], node[s], centre[s], &size[s], inverse[s]));
    rigid[s] = space->element[node[s][0].body]->rigid;
    young[s] = SbMaterialYoungModulus(space->material[node[s][0].body]);
  }
  PetscCheck(nside == 1 || node[0][0].body != node[1][0].body, space->comm, PETSC_ERR_USER_INPUT,
             "%s and %s are of one body, %s: a joint is between two", on[0]->option, on[1]->option,
             space->mesh->body[node[0][0].body].name);

  e->njoined = nside;
  for (int s = 0; s < nside; s++)
    e->joined[s] = node[s][0].body;

  /* the frame, and the stiffness */
  joint->size = nside == 1 ? size[0] : PetscMin(size[0], size[1]);
  set_frame(joint);
  if (joint->stiffness == 0) {
    const PetscBool soft = (PetscBool) !(rigid[0] && (nside == 1 || rigid[1]));
    PetscReal E = PETSC_MAX_REAL;

    for (int s = 0; s < nside; s++)
      if (!soft || !rigid[s])
        E = PetscMin(E, young[s]);
    joint->stiffness = (soft ? FACTOR : 1) * E * joint->size;
  }

  /* the nodes of both sides, and their weights in the points */
  PetscCall(PetscMalloc1(n[0] + (nside > 1 ? n[1] : 0), &gnode));
  joint->n = 0;
  for (int s = 0; s < nside; s++)
    for (PetscInt i = 0; i < n[s]; i++)
      gnode[joint->n++] = node[s][i].gnode;
  PetscCall(PetscSortRemoveDupsInt(&joint->n, gnode));
  PetscCall(PetscCalloc1(PLACES * joint->n, &joint->weight));
  for (int s = 0; s < nside; s++) {
    mass = 0;
    for (PetscInt i = 0; i < n[s]; i++)
      mass += node[s][i].mass;
    for (int p = 0; p < POINTS; p++) {
      PetscReal to[3], way[3];

      SbSubtract(joint->rest[p], centre[s], to);
      for (int k = 0; k < 3; k++)
        way[k] = SbDot3(inverse[s] + 3 * k, to);
      for (PetscInt i = 0; i < n[s]; i++) {
        PetscReal r[3];
        PetscInt at;

        SbSubtract(node[s][i].x, centre[s], r);
        PetscCall(PetscFindInt(node[s][i].gnode, joint->n, gnode, &at));
        joint->weight[joint->n * (POINTS * s + p) + at] =
          node[s][i].mass / mass * (1 + SbDot3(way, r));
      }
    }
    PetscCall(PetscFree(node[s]));
  }
  PetscCall(SbSpaceCouple(space, joint->n, gnode, &joint->number));
  PetscCall(PetscFree(gnode));
  if (joint->number >= 0)
    PetscCall(PetscMalloc1(3 * joint->n * (SIZE + 3 * joint->n), &joint->work));
  SbFormat(sizeof(e->note), e->note, "%s, %.4g N/m", kinds[joint->kind], (double)joint->stiffness);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warnings of what the options come to. */
static PetscErrorCode setup_joint(SbEffect e, SbSpace space)
{
  const Joint *joint = (const Joint *)e->data;
  PetscInt nfree = 0;
  int time = 0;

  PetscFunctionBeginUser;
  if (joint->number >= 0) {
    const PetscInt *node = space->couplings.node + space->couplings.start[joint->number];

    for (PetscInt a = 0; a < joint->n; a++)
      nfree += node[a] < space->nnode_owned && (space->fixed[node[a]] & 7) != 7;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nfree, 1, MPIU_INT, MPI_SUM, space->comm));
  if (!nfree)
    PetscCall(
      SbWarning(space->comm,
                "effect %s: supports hold all that this joint joins: its motor, springs and "
                "forces move nothing; leave a side free, or the joint out",
                e->name));

  /* newmark, genalpha */
  if (SbOptionFind(&SbRunScope, "time"))
    PetscCall(SbOptionChoice(&SbRunScope, "time", &time));
  if (joint->limited && e->dynamic && (time == 1 || time == 2))
    PetscCall(SbWarning(space->comm,
                        "effect %s: a stop of -effect_%s_limits that is hit at speed makes energy "
                        "with this -time, as it is stiff and comes within a step; take "
                        "euler_implicit, or watch load_work",
                        e->name, e->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places and velocities of the points. */
static void place_points(SbSpace space, const Joint *joint, const SbStage *stage, State *now)
{
  const PetscInt *node = space->couplings.node + space->couplings.start[joint->number];

  for (int p = 0; p < PLACES; p++) {
    const PetscReal *w = joint->weight + joint->n * p;

    for (int k = 0; k < 3; k++) {
      now->x[p][k] = joint->rest[p % POINTS][k];
      now->v[p][k] = 0;
    }
    for (PetscInt a = 0; a < 3 * joint->n; a++) {
      now->x[p][a % 3] += w[a / 3] * stage->u[3 * node[a / 3] + a % 3];
      now->v[p][a % 3] += stage->v ? w[a / 3] * stage->v[3 * node[a / 3] + a % 3] : 0;
    }
  }
}

/* Adds k / 2 |d|^2, d the sum of factors times the places of the points. */
static void add_square(const PetscReal factor[PLACES], PetscReal k, State *now)
{
  PetscReal d[3] = {0};

  for (int p = 0; p < PLACES; p++)
    for (int i = 0; i < 3; i++)
      d[i] += factor[p] * now->x[p][i];
  now->energy += k / 2 * SbDot3(d, d);
  for (int p = 0; p < PLACES; p++)
    for (int i = 0; i < 3; i++) {
      now->g[3 * p + i] += k * factor[p] * d[i];
      for (int r = 0; r < PLACES; r++)
        now->H[3 * p + i][3 * r + i] += k * factor[p] * factor[r];
    }
}

/* The difference of two points, m. */
static void between(const State *now, int to, int from, PetscReal d[3])
{
  SbSubtract(now->x[to], now->x[from], d);
}

/* q of a slider, and its derivatives by d = A_0 - B_0 and a = B_1 - B_0: dq[2][3], ddq[6][6]. */
static PetscReal slide(const State *now, PetscReal dq[], PetscReal ddq[])
{
  PetscReal d[3], n[3], length, q;

  between(now, 0, POINTS, d);
  between(now, POINTS + 1, POINTS, n);
  length = SbNormalise(n);
  q = SbDot3(d, n);
  for (int i = 0; i < 3; i++) {
    dq[i] = n[i];
    dq[3 + i] = (d[i] - q * n[i]) / length;
    for (int j = 0; j < 3; j++) {
      ddq[6 * i + j] = 0;
      ddq[6 * i + 3 + j] = ddq[6 * (3 + i) + j] = ((i == j) - n[i] * n[j]) / length;
      ddq[6 * (3 + i) + 3 + j] =
        (3 * q * n[i] * n[j] - d[i] * n[j] - n[i] * d[j] - q * (i == j)) / PetscSqr(length);
    }
  }
  return q;
}

/* q of a hinge up to a turn, the angle of a = A_2 - A_0 among b = B_2 - B_0 and B_3 - B_0, and its
   derivatives by these: dq[3][3], ddq[9][9]. */
static PetscReal turn(const State *now, PetscReal dq[], PetscReal ddq[])
{
  PetscReal a[3], b[2][3], c, s, r2;
  PetscReal dc[9] = {0};
  PetscReal ds[9] = {0};

  between(now, 2, 0, a);
  between(now, POINTS + 2, POINTS, b[0]);
  between(now, POINTS + 3, POINTS, b[1]);
  c = SbDot3(a, b[0]);
  s = SbDot3(a, b[1]);
  r2 = c * c + s * s;
  for (int i = 0; i < 3; i++) {
    dc[i] = b[0][i];
    ds[i] = b[1][i];
    dc[3 + i] = ds[6 + i] = a[i];
  }
  for (int i = 0; i < 9; i++) {
    dq[i] = (c * ds[i] - s * dc[i]) / r2;
    for (int j = 0; j < 9; j++) {
      const PetscReal mixed = dc[i] * ds[j] + ds[i] * dc[j];
      const int blocks = 3 * PetscMin(i / 3, j / 3) + PetscMax(i / 3, j / 3);

      ddq[9 * i + j] =
        (2 * c * s * (dc[i] * dc[j] - ds[i] * ds[j]) + (s * s - c * c) * mixed) / (r2 * r2);
      if (i % 3 == j % 3 && blocks == 1) /* c = a . b_0 */
        ddq[9 * i + j] -= s / r2;
      if (i % 3 == j % 3 && blocks == 2) /* s = a . b_1 */
        ddq[9 * i + j] += c / r2;
    }
  }
  return PetscAtan2Real(s, c);
}

/* Adds the energy e(q), with its derivatives by q, and the force of the damper. */
static PetscErrorCode add_coordinate(SbEffect e, const SbStage *stage, State *now)
{
  static const int ends[2][3][2] = {{{2, 0}, {POINTS + 2, POINTS}, {POINTS + 3, POINTS}},
                                    {{0, POINTS}, {POINTS + 1, POINTS}, {0, 0}}};
  const Joint *joint = (const Joint *)e->data;
  const PetscBool slides = (PetscBool)(joint->kind == SLIDER);
  const PetscReal K = joint->stiffness * (slides ? 1 : PetscSqr(joint->size));
  const int n = slides ? 6 : 9;
  const int(*end)[2] = ends[slides];
  PetscReal dq[9], ddq[81], first, second, value;

  PetscFunctionBeginUser;
  now->q = slides ? slide(now, dq, ddq) : turn(now, dq, ddq);
  if (!slides)
    now->q += 2 * PETSC_PI * PetscFloorReal((joint->kept - now->q) / (2 * PETSC_PI) + 0.5);
  first = joint->spring * now->q;
  second = joint->spring;
  now->energy += joint->spring / 2 * PetscSqr(now->q);
  if (slides) { /* of k / 2 |D_0|^2 the part along the axis */
    first -= joint->stiffness * now->q;
    second -= joint->stiffness;
    now->energy -= joint->stiffness / 2 * PetscSqr(now->q);
  }
  if (joint->drive) {
    PetscCall(SbEffectValueAt(e, joint->drive, stage->t, &value));
    first -= value;
  }
  if (joint->given) {
    PetscReal off;

    PetscCall(SbEffectValueAt(e, joint->given, stage->t, &value));
    off = now->q - (slides ? value : value * PETSC_PI / 180);
    if (!slides)
      off -= 2 * PETSC_PI * PetscFloorReal(off / (2 * PETSC_PI) + 0.5);
    first += K * off;
    second += K;
    now->energy += K / 2 * PetscSqr(off);
  }
  for (int k = 0; k < 2; k++) {
    const PetscReal over = now->q - joint->limit[k];

    if (k ? over <= 0 : over >= 0)
      continue;
    first += K * over;
    second += K;
    now->energy += K / 2 * PetscSqr(over);
  }

  /* to the points: each vector of q is the difference of two */
  PetscCall(PetscArrayzero(now->dq, SIZE));
  for (int i = 0; i < 2 * n; i++)
    now->dq[3 * end[i / 6][i / 3 % 2] + i % 3] += (i / 3 % 2 ? -1 : 1) * dq[3 * (i / 6) + i % 3];
  now->rate = 0;
  for (int i = 0; i < SIZE; i++)
    now->rate += now->dq[i] * now->v[i / 3][i % 3];
  first += joint->damping * now->rate;
  if (stage->shift_k > 0)
    second += joint->damping * stage->shift_v / stage->shift_k;
  for (int i = 0; i < SIZE; i++) {
    now->g[i] += first * now->dq[i];
    for (int j = 0; j < SIZE; j++)
      now->H[i][j] += second * now->dq[i] * now->dq[j];
  }
  for (int i = 0; i < 2 * n; i++)
    for (int j = 0; j < 2 * n; j++)
      now->H[3 * end[i / 6][i / 3 % 2] + i % 3][3 * end[j / 6][j / 3 % 2] + j % 3] +=
        first * (i / 3 % 2 == j / 3 % 2 ? 1 : -1) *
        ddq[n * (3 * (i / 6) + i % 3) + 3 * (j / 6) + j % 3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode find_state(SbEffect e, SbSpace space, const SbStage *stage, State *now)
{
  const Joint *joint = (const Joint *)e->data;
  const Kind kind = joint->kind;
  const int last = kind == BALL ? 0 : kind == HINGE ? 1 : 3;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(now, sizeof(*now)));
  place_points(space, joint, stage, now);

  /* the points that are common; those of a slider relative to the first one */
  for (int i = 0; i <= last; i++) {
    PetscReal factor[PLACES] = {0};

    factor[i] = 1;
    factor[POINTS + i] = -1;
    if (i && kind == SLIDER) {
      factor[0] = -1;
      factor[POINTS] = 1;
    }
    add_square(factor, joint->stiffness, now);
  }
  if (kind == HINGE || kind == SLIDER)
    PetscCall(add_coordinate(e, stage, now));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_joint(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Joint *joint = (const Joint *)e->data;
  const PetscInt *node;
  State now;

  PetscFunctionBeginUser;
  if (joint->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  node = space->couplings.node + space->couplings.start[joint->number];
  PetscCall(find_state(e, space, stage, &now));
  for (int p = 0; p < PLACES; p++)
    for (PetscInt a = 0; a < 3 * joint->n; a++)
      f[3 * node[a / 3] + a % 3] -= joint->weight[joint->n * p + a / 3] * now.g[3 * p + a % 3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_joint(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Joint *joint = (const Joint *)e->data;
  const PetscInt n = 3 * joint->n;
  PetscReal *half = joint->work;  /* [SIZE][n] */
  PetscReal *K = half + SIZE * n; /* [n][n] */
  State now;

  PetscFunctionBeginUser;
  if (joint->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_state(e, space, stage, &now));
  PetscCall(PetscArrayzero(half, n * (SIZE + n)));
  for (int r = 0; r < SIZE; r++)
    for (PetscInt a = 0; a < n; a++)
      for (int p = 0; p < PLACES; p++)
        half[n * r + a] +=
          stage->shift_k * now.H[r][3 * p + a % 3] * joint->weight[joint->n * p + a / 3];
  for (PetscInt a = 0; a < n; a++)
    for (int p = 0; p < PLACES; p++)
      for (PetscInt b = 0; b < n; b++)
        K[n * a + b] += joint->weight[joint->n * p + a / 3] * half[n * (3 * p + a % 3) + b];
  PetscCall(SbSpaceAddCoupling(space, A, joint->number, K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of hinges: the angle is followed. */
static PetscErrorCode accept_joint(SbEffect e, SbSpace space, const SbStage *stage)
{
  Joint *joint = (Joint *)e->data;
  State now;

  PetscFunctionBeginUser;
  if (joint->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_state(e, space, stage, &now));
  joint->kept = now.q;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One record, of the owner of the first node. */
static PetscErrorCode save_joint(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Joint *joint = (const Joint *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(1, records));
  (*records)[0] = joint->kept;
  *n = joint->number >= 0 &&
       space->couplings.node[space->couplings.start[joint->number]] < space->nnode_owned;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_joint(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                 PetscInt n, const PetscReal records[])
{
  PetscFunctionBeginUser;
  (void)space;
  (void)t;
  (void)u;
  if (n > 0)
    ((Joint *)e->data)->kept = records[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force, N, and moment about the joint, N m, on the first body; by how much it has come apart, m;
   energy, J; angle, degrees, or way, m. Counted by the owner of the first node. */
static PetscErrorCode history_joint(SbEffect e, SbSpace space, const SbStage *stage,
                                    const PetscReal residual[], PetscReal values[])
{
  const Joint *joint = (const Joint *)e->data;
  PetscReal apart[3];
  State now;

  PetscFunctionBeginUser;
  (void)residual;
  if (joint->number < 0 ||
      space->couplings.node[space->couplings.start[joint->number]] >= space->nnode_owned)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_state(e, space, stage, &now));
  if (joint->kind == HINGE || joint->kind == SLIDER)
    values[8] += joint->kind == HINGE ? now.q * 180 / PETSC_PI : now.q;
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int p = 0; p < POINTS; p++) {
    const PetscReal f[3] = {-now.g[3 * p], -now.g[3 * p + 1], -now.g[3 * p + 2]};
    PetscReal r[3], m[3];

    between(&now, p, 0, r);
    SbCross(r, f, m);
    for (int k = 0; k < 3; k++) {
      values[k] += f[k];
      values[3 + k] += m[k];
    }
  }
  between(&now, 0, POINTS, apart);
  values[6] += PetscSqrtReal(
    PetscMax(0, SbDot3(apart, apart) - (joint->kind == SLIDER ? PetscSqr(now.q) : 0)));
  values[7] += now.energy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_joint(SbEffect e)
{
  Joint *joint = (Joint *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(joint->weight));
  PetscCall(PetscFree(joint->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectJoint = {
  .name = "joint",
  .size = sizeof(Joint),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_joint,
          .couplings = couplings_joint,
          .setup = setup_joint,
          .force = force_joint,
          .tangent = tangent_joint,
          .accept = accept_joint,
          .save = save_joint,
          .load = load_joint,
          .history = history_joint,
          .destroy = destroy_joint},
};
