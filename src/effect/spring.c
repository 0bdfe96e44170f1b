/*
  spring.c - the effects `spring` and `cable`: a line through points of bodies and of the ground,
  with a tension that its length decides.

  With x_p the current places of the points, L = sum |x_p+1 - x_p| the length, g = dL/dx and s = 1,
  or the load factor where a static run has a formula without t,

    T = s T_0(t) + k (L - L_0) + c dL/dt,   f_p = -T g_p,   L_0 = (1 - s) L_rest + s length(t).

  A cable, or a spring with `slack`, does not push: T is at least 0. The line slides through the
  points between its ends without friction, so that T is the same all along. A point of a body moves
  with the nodes around it (place.c), which get its force by the same weights: sum and moment are
  those of the force at the point. The nodes of all points are one coupling.

  Tangent: (k + c shift_v) g g^T + T dg/dx, without the change of dL/dt by the turn of g.
*/
#include <ctype.h>
#include "effect_impl.h"
#include "sbgeometry.h"

#define POINTS 64 /* most points of a line */
#define GROUND "ground"
#define OUTSIDE 1e-6 /* of a body's diagonal: distance of a point from it that is said */

typedef struct {
  char body[SB_NAME_MAX]; /* GROUND; "": the one that holds the point */
  PetscReal x[3];         /* place at rest, m */
  PetscBool ground;       /* it is not of a body */
} LinePoint;

typedef struct {
  SbFormula length, tension, displacement[3]; /* m, N, m; length NULL: that at rest */
  PetscReal stiffness, damping;               /* N/m, N s/m */
  PetscBool slack;
  PetscBool given; /* a tension, or the length */
  PetscInt n;
  LinePoint *point; /* [n] */
  PetscReal rest;   /* length at rest, m */
  PetscInt number;  /* of the coupling; -1: none of its nodes is owned here */
  PetscInt nnode;
  PetscReal *weight; /* [n][nnode] of the coupling's nodes in the points */
  PetscReal *work;   /* [3 n][3 nnode], then [3 nnode][3 nnode]: of the tangent */
} Line;

/* What a line is at a stage. */
typedef struct {
  PetscReal length, extension, tension; /* m, m, N */
  PetscBool tight;                      /* it is not slack */
  PetscReal segment[POINTS];            /* lengths, m */
  PetscReal along[POINTS][3];           /* unit vectors along the segments; zero: no length */
  PetscReal g[POINTS][3];               /* dL/dx of the points */
} LineState;

#define LINE_ROWS(SLACK, WORD)                                                               \
  {"points",                                                                                 \
   SB_OPTION_STRING,                                                                         \
   1,                                                                                        \
   "m",                                                                                      \
   NULL,                                                                                     \
   "",                                                                                       \
   "rest positions of the points, `x,y,z; x,y,z`, two or more; `BODY: x,y,z` where several " \
   "bodies "                                                                                 \
   "hold a point, `ground: x,y,z` for one in space"},                                        \
    {"stiffness", SB_OPTION_REAL, 1, "N/m", "0", "[0, inf)", "tension over extension"},      \
    {"damping",                                                                              \
     SB_OPTION_REAL,                                                                         \
     1,                                                                                      \
     "N s/m",                                                                                \
     "0",                                                                                    \
     "[0, inf)",                                                                             \
     "tension over the speed of the extension"},                                             \
    {"length",                                                                               \
     SB_OPTION_FORMULA,                                                                      \
     1,                                                                                      \
     "m",                                                                                    \
     "",                                                                                     \
     "",                                                                                     \
     "length without tension, a formula of the time t; default: that at rest"},              \
    {"tension",                                                                              \
     SB_OPTION_FORMULA,                                                                      \
     1,                                                                                      \
     "N",                                                                                    \
     "0",                                                                                    \
     "",                                                                                     \
     "tension besides, a formula of the time t: an actuator"},                               \
    {"displacement",                                                                         \
     SB_OPTION_FORMULA,                                                                      \
     3,                                                                                      \
     "m",                                                                                    \
     "0;0;0",                                                                                \
     "",                                                                                     \
     "of the points of the ground, three formulas of the time t"},                           \
  {                                                                                          \
    "slack", SB_OPTION_BOOL, 1, "", SLACK, "", "the " WORD " pulls, but does not push"       \
  }

static const SbOption spring_rows[] = {LINE_ROWS("false", "spring")};
static const SbOption cable_rows[] = {LINE_ROWS("true", "cable")};

/* Reads the points, `[BODY:] x,y,z; ...`. */
static PetscErrorCode read_points(SbEffect e, const SbScope *scope)
{
  Line *line = (Line *)e->data;
  char text[4096];

  PetscFunctionBeginUser;
  PetscCall(SbOptionString(scope, "points", sizeof(text), text));
  PetscCall(PetscCalloc1(POINTS, &line->point));
  for (char *word = text, *next; word; word = next) {
    LinePoint *p = &line->point[line->n];
    char *colon, *end;
    int bad = 0;

    next = strchr(word, ';');
    if (next)
      *next++ = 0;
    PetscCheck(line->n < POINTS, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_points has more than %d points", e->name, POINTS);

    /* the body, and the three numbers */
    end = word;
    colon = strchr(word, ':');
    if (colon) {
      while (isspace((unsigned char)*word))
        word++;
      end = colon;
      while (end > word && isspace((unsigned char)end[-1]))
        end--;
      bad = end == word || end - word >= SB_NAME_MAX;
      SbFormat(sizeof(p->body), p->body, "%.*s", (int)(end - word), word);
      end = colon + 1;
    }
    for (int k = 0; k < 3 && !bad; k++) {
      char *begin = end;

      p->x[k] = strtod(begin, &end);
      while (isspace((unsigned char)*end))
        end++;
      bad = end == begin || PetscIsInfOrNanReal(p->x[k]) || *end != (k < 2 ? ',' : 0);
      end += k < 2 && !bad;
    }
    PetscCheck(!bad, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_points: point %" PetscInt_FMT
               " is to be `x,y,z` or `BODY: x,y,z`, three numbers in metres; points are separated "
               "by semicolons",
               e->name, line->n + 1);
    p->ground = (PetscBool)!strcmp(p->body, GROUND);
    line->n++;
  }
  PetscCheck(line->n > 1, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_points has one point; a %s needs two or more, separated by semicolons",
             e->name, e->type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_line(SbEffect e, const SbScope *scope)
{
  Line *line = (Line *)e->data;
  PetscBool given[3];
  PetscBool ground = PETSC_FALSE;

  PetscFunctionBeginUser;
  line->number = -1;
  PetscCall(read_points(e, scope));
  PetscCall(SbOptionReal(scope, "stiffness", &line->stiffness));
  PetscCall(SbOptionReal(scope, "damping", &line->damping));
  PetscCall(SbOptionBool(scope, "slack", &line->slack));
  PetscCall(SbOptionGiven(scope, "tension", &given[0]));
  PetscCall(SbOptionGiven(scope, "length", &given[1]));
  PetscCall(SbOptionGiven(scope, "displacement", &given[2]));
  PetscCheck(given[0] || line->stiffness > 0 || line->damping > 0, PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_stiffness (N/m), -effect_%s_damping (N s/m) or "
             "-effect_%s_tension (N)",
             e->name, e->name, e->name, e->name);
  PetscCheck(!given[1] || line->stiffness > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_length is the length without tension, and there is no stiffness; give "
             "-effect_%s_stiffness (N/m)",
             e->name, e->name);
  if (given[1])
    PetscCall(SbEffectFormulas(e, scope, "length", 1, PETSC_FALSE, &line->length));
  PetscCall(SbEffectFormulas(e, scope, "tension", 1, PETSC_FALSE, &line->tension));
  PetscCall(SbEffectFormulas(e, scope, "displacement", 3, PETSC_FALSE, line->displacement));
  line->given = (PetscBool)(given[0] || given[1]);
  for (PetscInt p = 0; p < line->n; p++)
    ground = (PetscBool)(ground || line->point[p].ground);
  PetscCheck(!given[2] || ground, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_displacement moves points of the ground, and -effect_%s_points has none, "
             "`ground: x,y,z`",
             e->name, e->name);
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  e->holds = (PetscBool)(line->stiffness > 0 && ground);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The body of a point by its name, -1: any. */
static PetscErrorCode find_body(SbEffect e, SbSpace space, const LinePoint *p, PetscInt *body)
{
  const SbMesh mesh = space->mesh;
  const char **names;
  char all[512];

  PetscFunctionBeginUser;
  *body = -1;
  for (PetscInt b = 0; b < mesh->nbody && p->ground; b++)
    PetscCheck(strcmp(mesh->body[b].name, GROUND), space->comm, PETSC_ERR_USER_INPUT,
               "-effect_%s_points: `" GROUND ":` is a point in space, and there is a body of that "
               "name: give the body another one",
               e->name);
  if (p->ground)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt b = 0; b < mesh->nbody && p->body[0]; b++)
    if (!strcmp(mesh->body[b].name, p->body))
      *body = b;
  if (*body >= 0 || !p->body[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(mesh->nbody + 1, &names));
  for (PetscInt b = 0; b < mesh->nbody; b++)
    names[b] = mesh->body[b].name;
  names[mesh->nbody] = GROUND;
  SbSuggestName(p->body, mesh->nbody + 1, names, sizeof(all), all);
  PetscCall(PetscFree(names));
  SETERRQ(space->comm, PETSC_ERR_USER_INPUT,
          "-effect_%s_points: there is no body \"%s\"; points are of one of %s", e->name, p->body,
          all);
}

/* Finds the nodes of the points, and couples them. */
static PetscErrorCode couplings_line(SbEffect e, SbSpace space)
{
  Line *line = (Line *)e->data;
  const SbMesh mesh = space->mesh;
  char option[3 * SB_NAME_MAX];
  SbMeanPlace *place;
  PetscInt *gnode;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  SbFormat(sizeof(option), option, "-effect_%s_points", e->name);
  PetscCall(PetscCalloc1(line->n, &place));
  for (PetscInt i = 0; i < line->n; i++) {
    LinePoint *p = &line->point[i];
    PetscInt body;

    PetscCall(find_body(e, space, p, &body));
    if (p->ground)
      continue;
    PetscCall(SbPlaceFind(space, option, body, p->x, &place[i]));
    if (place[i].off > OUTSIDE * SbBoxDiagonal(mesh->body[place[i].body].bbox))
      PetscCall(
        SbWarning(space->comm,
                  "%s: point %" PetscInt_FMT
                  ", (%g, %g, %g) m, is %.3g m outside of body %s: the %s holds its nearest "
                  "place, (%g, %g, %g) m",
                  option, i + 1, (double)p->x[0], (double)p->x[1], (double)p->x[2],
                  (double)place[i].off, mesh->body[place[i].body].name, e->type,
                  (double)place[i].x[0], (double)place[i].x[1], (double)place[i].x[2]));
    PetscCall(PetscArraycpy(p->x, place[i].x, 3));
    n += place[i].n;
  }
  PetscCheck(n > 0, space->comm, PETSC_ERR_USER_INPUT,
             "%s: all points are of the ground; at least one has to be of a body", option);

  /* the nodes of all points, and their weights */
  PetscCall(PetscMalloc1(n, &gnode));
  n = 0;
  for (PetscInt i = 0; i < line->n; i++) {
    PetscCall(PetscArraycpy(gnode + n, place[i].gnode, place[i].n));
    n += place[i].n;
  }
  PetscCall(PetscSortRemoveDupsInt(&n, gnode));
  line->nnode = n;
  PetscCall(PetscCalloc1(line->n * n, &line->weight));
  PetscCall(PetscMalloc1(9 * n * (line->n + n), &line->work));
  for (PetscInt i = 0; i < line->n; i++) {
    for (PetscInt k = 0; k < place[i].n; k++) {
      PetscInt at;

      PetscCall(PetscFindInt(place[i].gnode[k], n, gnode, &at));
      line->weight[n * i + at] = place[i].weight[k];
    }
    PetscCall(SbPlaceDestroy(&place[i]));
  }
  PetscCall(SbSpaceCouple(space, n, gnode, &line->number));
  PetscCall(PetscFree(gnode));
  PetscCall(PetscFree(place));

  /* the length at rest */
  line->rest = 0;
  for (PetscInt i = 1; i < line->n; i++) {
    const PetscReal way = PetscSqrtReal(SbDistance2(line->point[i].x, line->point[i - 1].x));

    PetscCheck(way > 0 || !line->given, space->comm, PETSC_ERR_USER_INPUT,
               "%s: points %" PetscInt_FMT " and %" PetscInt_FMT
               " are one place at rest, (%g, %g, %g) m: a tension or another length between them "
               "has no direction",
               option, i, i + 1, (double)line->point[i].x[0], (double)line->point[i].x[1],
               (double)line->point[i].x[2]);
    line->rest += way;
  }
  SbFormat(sizeof(e->note), e->note, "%" PetscInt_FMT " points, %.6g m long at rest", line->n,
           (double)line->rest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacement of the ground's points at time t. */
static PetscErrorCode ground_at(SbEffect e, PetscReal t, PetscReal d[3])
{
  const Line *line = (const Line *)e->data;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    PetscCall(SbEffectValueAt(e, line->displacement[k], t, &d[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements or velocities of the points, from those of the nodes and of the ground. */
static void points_of(SbSpace space, const Line *line, const PetscReal u[], const PetscReal d[3],
                      PetscReal moved[POINTS][3])
{
  const PetscInt *node = space->couplings.node + space->couplings.start[line->number];

  for (PetscInt p = 0; p < line->n; p++) {
    const PetscReal *w = line->weight + line->nnode * p;

    for (int k = 0; k < 3; k++)
      moved[p][k] = line->point[p].ground ? d[k] : 0;
    for (PetscInt a = 0; a < 3 * line->nnode; a++)
      moved[p][a % 3] += w[a / 3] * u[3 * node[a / 3] + a % 3];
  }
}

/* Its length, and how that depends on the places of the points. */
static PetscErrorCode measure(SbEffect e, SbSpace space, const SbStage *stage, LineState *now)
{
  const Line *line = (const Line *)e->data;
  PetscReal d[3], moved[POINTS][3];

  PetscFunctionBeginUser;
  PetscCall(ground_at(e, stage->t, d));
  points_of(space, line, stage->u, d, moved);
  PetscCall(PetscArrayzero(&now->g[0][0], 3 * line->n));
  now->length = 0;
  for (PetscInt p = 0; p + 1 < line->n; p++) {
    for (int k = 0; k < 3; k++)
      now->along[p][k] =
        line->point[p + 1].x[k] + moved[p + 1][k] - line->point[p].x[k] - moved[p][k];
    now->segment[p] = SbNormalise(now->along[p]);
    now->length += now->segment[p];
    for (int k = 0; k < 3; k++) {
      now->g[p][k] -= now->along[p][k];
      now->g[p + 1][k] += now->along[p][k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* dL/dt, m/s; 0 in a static run. */
static PetscErrorCode speed(SbEffect e, SbSpace space, const SbStage *stage, const LineState *now,
                            PetscReal *rate)
{
  const Line *line = (const Line *)e->data;
  PetscReal ground[3], moving[POINTS][3];

  PetscFunctionBeginUser;
  *rate = 0;
  if (!stage->v)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 3; k++)
    PetscCall(SbEffectRateAt(e, line->displacement[k], stage->t, &ground[k]));
  points_of(space, line, stage->v, ground, moving);
  for (PetscInt p = 0; p < line->n; p++)
    *rate += SbDot3(now->g[p], moving[p]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode find_state(SbEffect e, SbSpace space, const SbStage *stage, LineState *now)
{
  const Line *line = (const Line *)e->data;
  PetscReal rest = line->rest;
  PetscReal rate = 0;

  PetscFunctionBeginUser;
  PetscCall(measure(e, space, stage, now));
  if (line->length) {
    const PetscBool grows = (PetscBool)(!e->dynamic && !SbFormulaUses(line->length, 't'));

    PetscCall(SbFormulaEval(line->length, stage->t, NULL, &rest));
    PetscCheck(rest >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "-effect_%s_length is %g m at t = %g: a length has to be at least 0", e->name,
               (double)rest, (double)stage->t);
    if (grows)
      rest = line->rest + stage->t * (rest - line->rest);
  }
  now->extension = now->length - rest;
  PetscCall(SbEffectValueAt(e, line->tension, stage->t, &now->tension));
  now->tension += line->stiffness * now->extension;
  if (line->damping > 0)
    PetscCall(speed(e, space, stage, now, &rate));
  now->tension += line->damping * rate;
  now->tight = (PetscBool)(!line->slack || now->tension > 0);
  if (!now->tight)
    now->tension = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_line(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Line *line = (const Line *)e->data;
  const PetscInt *node;
  LineState now;

  PetscFunctionBeginUser;
  if (line->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  node = space->couplings.node + space->couplings.start[line->number];
  PetscCall(find_state(e, space, stage, &now));
  for (PetscInt p = 0; p < line->n; p++)
    for (PetscInt a = 0; a < 3 * line->nnode; a++)
      f[3 * node[a / 3] + a % 3] -=
        now.tension * line->weight[line->nnode * p + a / 3] * now.g[p][a % 3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entry (3 p + i, 3 q + j) of the tangent in the places of the points, N/m. */
static PetscReal stiffness_of(const Line *line, const LineState *now, const SbStage *stage,
                              PetscInt p, PetscInt q, int i, int j)
{
  const PetscReal pull = stage->shift_k * line->stiffness + stage->shift_v * line->damping;
  PetscReal sum = pull * now->g[p][i] * now->g[q][j];

  /* the turn of the segments that both points end; one without length has no direction */
  for (PetscInt s = PetscMax(0, PetscMax(p, q) - 1); s <= PetscMin(line->n - 2, PetscMin(p, q));
       s++) {
    const PetscReal *n = now->along[s];
    const PetscReal across =
      now->segment[s] > 0 ? stage->shift_k * now->tension / now->segment[s] : pull;

    sum += (p == q ? 1 : -1) * across * ((i == j) - n[i] * n[j]);
  }
  return sum;
}

static PetscErrorCode tangent_line(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Line *line = (const Line *)e->data;
  const PetscInt n = line->n;
  const PetscInt N = line->nnode;
  PetscReal *half = line->work;    /* [3 n][3 N] */
  PetscReal *K = half + 9 * n * N; /* [3 N][3 N] */
  LineState now;

  PetscFunctionBeginUser;
  if (line->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_state(e, space, stage, &now));
  if (!now.tight)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* from the points on the right, then on the left, to the nodes */
  PetscCall(PetscArrayzero(half, 9 * N * (n + N)));
  for (PetscInt k = 0; k < 9 * n * n; k++) {
    const PetscInt row = k / (3 * n);
    const PetscInt q = k % (3 * n) / 3;
    const int j = (int)(k % 3);
    const PetscReal value = stiffness_of(line, &now, stage, row / 3, q, (int)(row % 3), j);

    for (PetscInt a = 0; a < N; a++)
      half[3 * N * row + 3 * a + j] += value * line->weight[N * q + a];
  }
  for (PetscInt k = 0; k < 3 * n * N; k++) {
    const PetscInt p = k / (3 * N);
    const PetscInt a = k % (3 * N) / 3;
    const PetscInt i = k % 3;
    const PetscReal w = line->weight[N * p + a];

    for (PetscInt c = 0; c < 3 * N && w != 0; c++)
      K[3 * N * (3 * a + i) + c] += w * half[3 * N * (3 * p + i) + c];
  }
  PetscCall(SbSpaceAddCoupling(space, A, line->number, K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Length, m, tension, N, and the energy of the spring, J; counted by the owner of the first
   node. */
static PetscErrorCode history_line(SbEffect e, SbSpace space, const SbStage *stage,
                                   const PetscReal residual[], PetscReal values[])
{
  const Line *line = (const Line *)e->data;
  LineState now;

  PetscFunctionBeginUser;
  (void)residual;
  if (line->number < 0 ||
      space->couplings.node[space->couplings.start[line->number]] >= space->nnode_owned)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_state(e, space, stage, &now));
  values[0] += now.length;
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  values[1] += now.tension;
  if (now.extension > 0 || !line->slack)
    values[2] += line->stiffness / 2 * PetscSqr(now.extension);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_line(SbEffect e)
{
  Line *line = (Line *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(line->point));
  PetscCall(PetscFree(line->weight));
  PetscCall(PetscFree(line->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"length", "tension", "energy"};

#define LINE_OPS                                                                      \
  {                                                                                   \
    .setfromoptions = options_line, .couplings = couplings_line, .force = force_line, \
    .tangent = tangent_line, .history = history_line, .destroy = destroy_line         \
  }

const SbEffectType SbEffectSpring = {
  .name = "spring",
  .size = sizeof(Line),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(spring_rows),
  .row = spring_rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = LINE_OPS,
};

const SbEffectType SbEffectCable = {
  .name = "cable",
  .size = sizeof(Line),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(cable_rows),
  .row = cable_rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = LINE_OPS,
};
