/*
  cavity.c - a closed cavity that is filled: a chamber of a soft robot, a ventricle, an eye, a ball.

  V the current volume inside the surface, V_0 that at rest, V_f = V_0 + added(t) that of the fluid
  without pressure, the pressure above that outside is

    p = M ((V_f / V)^n - 1),   f = -p dV/dx (pressure.c).

  n = 1 and M its bulk modulus is a liquid, whose volume is given; M the pressure outside and n = 1
  or 1.4 is a gas at constant temperature, or without exchange of heat. The energy of the fluid,
  zero at V = V_f, is

    n = 1:  M (V - V_f - V_f ln(V / V_f)),
    else    M (V_f / (n - 1) ((V_f / V)^(n - 1) - 1) + V - V_f).

  Tangent: that of the pressure p, and -dp/dV g g^T with g = dV/dx, which couples all nodes of the
  surface: one coupling. It is positive semi-definite. The volume of an iterate may be off by a
  percent, the pressure of a liquid by a percent of its modulus then, which would make the first
  part indefinite: as long as it is far from that at the end of the last step, that one is taken
  (with nothing of the kind, a gripper of two fingers took 7 times as long).

  With an outlet the fluid leaves by the flow Q, the windkessel of a ventricle: R resists it, behind
  that is a vessel that yields by the compliance C and has the pressure p_c, drained by R_d to the
  pressure p_0 (all above that outside),

    R Q = p - p_c (a valve: Q >= 0),   C dp_c/dt = Q - (p_c - p_0) / R_d,
    dV_f/dt = d(added)/dt - Q,

  by the implicit Euler method from the end of the last step: p_c is linear in Q, Q in p, and the
  equation for p above has one root.

  Openings may be closed by lids: each rim of the wall gets a fan of triangles around the mean of
  its vertices, which moves with them and bears nothing but the pressure. They are facets like those
  of pressure.c, with that mean in the place of a node.

  In a static run an `added` without t grows with the load factor. Bodies have nodes at vertices: P1
  and P2.
*/
#include "lid.h"
#include "pressure.h"
#include "sbgeometry.h"

#define WATER 2.2e9 /* Pa, bulk modulus */
#define STIFFER \
  1e5 /* default over Young's modulus of the wall: V is that of the fluid to 1e-6 or so */
#define STIFFEST \
  1e7 /* the same at most: in tests/verify/cavity.py 1e8 changes p by 1e-4, 1e10 by a quarter */
#define NEARLY \
  0.1 /* of the wall's modulus: difference of pressures below which that of an iterate is taken: 0.01, \
         1 and 10 take as many, 1.1 and 1.6 times as many iterations in the gripper */
#define MANY 2000 /* nodes whose dense block is large: 300 MB */

#define ITERATIONS 50 /* for the pressure of a gas with an outlet: 5 are usual */

/* What the fluid leaves by, and its state at the end of the last step. */
typedef struct {
  PetscReal resistance, compliance, drain, outside; /* R, C, R_d, p_0; 0: none, but p_0 */
  PetscBool valve;
  PetscReal t, left, vessel, flow; /* s; m^3 that has left so far; p_c, Pa; Q, m^3/s */
} Outlet;

typedef struct {
  SbPressure surface;
  PetscBool has_lids;
  SbLids lids;
  Outlet outlet;
  SbFormula added; /* m^3 */
  PetscReal modulus, exponent;
  PetscReal rest;  /* volume at rest, m^3 */
  PetscInt number; /* of the coupling; -1: none of its nodes is owned here */
  PetscInt n;      /* its nodes */
  PetscReal *g;    /* [nnode][3] dV/dx, m^2 */
  PetscReal *K;    /* [3 n][3 n] */
  PetscReal wall;  /* its Young's modulus, Pa */
  PetscReal kept;  /* pressure at the end of the last step, Pa */
  PetscBool bends; /* the pressure of the geometric stiffness is asked for */
} Cavity;

/* What fills it at a stage. */
typedef struct {
  PetscReal V, fluid;     /* m^3 */
  PetscReal p, slope;     /* Pa, and its derivative by V */
  PetscReal flow, vessel; /* Q, m^3/s, p_c, Pa */
} Filling;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose boundary facets are the wall: a closed surface"},
  {"added", SB_OPTION_FORMULA, 1, "m^3", "0", "",
   "fluid that is pumped in, its volume without pressure, a formula of the time t; negative: drawn "
   "out"},
  {"modulus", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "bulk modulus of a liquid; of a gas the pressure outside, 101325 in air; 0: a liquid, 1e5 times "
   "as stiff as the wall, at most 2.2e9, water"},
  {"exponent", SB_OPTION_REAL, 1, "", "1", "[1, 10]",
   "n of p V^n: 1 for liquids and gases at constant temperature, 1.4 for air that exchanges no "
   "heat"},
  {"lids", SB_OPTION_BOOL, 1, "", "false", "",
   "openings of the wall are closed by lids that bear nothing: its rims bear their pressure"},
  {"outlet_resistance", SB_OPTION_REAL, 1, "Pa s/m^3", "0", "[0, inf)",
   "pressure over the flow that leaves by an outlet; 0: there is none"},
  {"outlet_compliance", SB_OPTION_REAL, 1, "m^3/Pa", "0", "[0, inf)",
   "volume over pressure of the vessel behind the outlet; 0: it does not yield"},
  {"outlet_drain", SB_OPTION_REAL, 1, "Pa s/m^3", "0", "[0, inf)",
   "pressure over the flow that leaves the vessel; 0: nothing resists it, or with a compliance "
   "nothing leaves it"},
  {"outlet_pressure", SB_OPTION_REAL, 1, "Pa", "0", "(-inf, inf)",
   "pressure to which it drains, above that outside; the vessel begins with it"},
  {"outlet_valve", SB_OPTION_BOOL, 1, "", "false", "", "the fluid leaves, and does not come back"},
};

/* The pressure for a fluid that has V_f = fluid - leak p: p / M + 1 = (V_f / V)^n. */
static void solve_pressure(const Cavity *c, PetscReal fluid, PetscReal leak, Filling *now)
{
  PetscReal p = c->modulus * (PetscPowReal(fluid / now->V, c->exponent) - 1);
  PetscReal part = fluid / now->V;

  for (int i = 0; i < ITERATIONS && leak > 0; i++) {
    PetscReal off, slope, step;

    /* the root is below a pressure that nothing leaves by, and where V_f is positive */
    part = (fluid - leak * p) / now->V;
    if (part <= 0) {
      p = (i ? p / 2 : fluid / leak * (1 - 1e-6));
      continue;
    }
    off = p / c->modulus + 1 - PetscPowReal(part, c->exponent);
    slope = 1 / c->modulus + c->exponent * PetscPowReal(part, c->exponent - 1) * leak / now->V;
    step = off / slope;
    p -= step;
    if (PetscAbsReal(step) <= 4 * PETSC_MACHINE_EPSILON * (PetscAbsReal(p) + c->wall))
      break;
  }
  now->p = p;
  now->fluid = fluid - leak * p;
  part = now->fluid / now->V;
  now->slope = -c->exponent * PetscPowReal(part, c->exponent) / now->V /
               (1 / c->modulus + c->exponent * PetscPowReal(part, c->exponent - 1) * leak / now->V);
}

/* The same with an outlet, a time dt after the end of the last step. */
static void flow_out(const Cavity *c, PetscReal dt, Filling *now)
{
  const Outlet *out = &c->outlet;
  const PetscReal yields = dt > 0 ? out->compliance / dt : 0;
  const PetscReal drains = out->drain > 0 ? 1 / out->drain : 0;
  const PetscReal all = yields + drains;
  const PetscReal fluid = now->fluid - out->left;

  /* p_c without flow, and all that resists a flow */
  const PetscReal empty =
    all > 0 ? (yields * out->vessel + drains * out->outside) / all : out->outside;
  const PetscReal resists = out->resistance + (all > 0 ? 1 / all : 0);
  const PetscReal leak = dt > 0 ? dt / resists : 0;

  now->flow = dt > 0 ? 0 : out->flow;
  now->vessel = dt > 0 ? empty : out->vessel;
  solve_pressure(c, fluid, 0, now);
  if (leak == 0 || (out->valve && now->p <= empty))
    return;
  solve_pressure(c, fluid + leak * empty, leak, now);
  now->flow = (now->p - empty) / resists;
  now->vessel = now->p - out->resistance * now->flow;
}

static PetscErrorCode fill(SbEffect e, SbSpace space, const SbStage *stage, Filling *now)
{
  const Cavity *c = (const Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectValueAt(e, c->added, stage->t, &now->fluid));
  now->fluid += c->rest;
  PetscCheck(
    now->fluid > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "-effect_%s_added is %g m^3 at t = %g: no more than the volume at rest, %g m^3, can be "
    "drawn out",
    e->name, (double)(now->fluid - c->rest), (double)stage->t, (double)c->rest);
  PetscCall(SbPressureInside(&c->surface, space, stage->u, &now->V));
  now->V += SbLidsInside(&c->lids, space, c->number, stage->u);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &now->V, 1, MPIU_REAL, MPI_SUM, space->comm));
  now->V *= c->surface.sign;

  now->flow = now->vessel = 0;
  if (now->V <= 0) { /* no finite pressure */
    now->p = PETSC_INFINITY;
    now->slope = -PETSC_INFINITY;
  } else if (c->outlet.resistance > 0)
    flow_out(c, stage->t - c->outlet.t, now);
  else
    solve_pressure(c, now->fluid, 0, now);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode pressure_at(SbEffect e, SbSpace space, const SbStage *stage, PetscReal *p)
{
  const Cavity *c = (const Cavity *)e->data;
  Filling now;

  PetscFunctionBeginUser;
  PetscCall(fill(e, space, stage, &now));
  *p = now.p;
  if (c->bends && !(PetscAbsReal(now.p - c->kept) < NEARLY * c->wall))
    *p = c->kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_cavity(SbEffect e, const SbScope *scope)
{
  static const char *const keys[] = {"outlet_compliance", "outlet_drain", "outlet_pressure",
                                     "outlet_valve"};
  static const char *const outlet_columns[] = {"volume", "pressure", "energy", "flow",
                                               "vessel_pressure"};
  Cavity *c = (Cavity *)e->data;
  Outlet *out = &c->outlet;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(e, scope, "added", 1, PETSC_FALSE, &c->added));
  PetscCall(SbOptionReal(scope, "modulus", &c->modulus));
  PetscCall(SbOptionReal(scope, "exponent", &c->exponent));
  PetscCall(SbOptionBool(scope, "lids", &c->has_lids));
  c->surface.at = pressure_at;
  c->surface.follower = PETSC_TRUE;
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  e->nstate = 5;

  /* the outlet */
  PetscCall(SbOptionReal(scope, "outlet_resistance", &out->resistance));
  PetscCall(SbOptionReal(scope, "outlet_compliance", &out->compliance));
  PetscCall(SbOptionReal(scope, "outlet_drain", &out->drain));
  PetscCall(SbOptionReal(scope, "outlet_pressure", &out->outside));
  PetscCall(SbOptionBool(scope, "outlet_valve", &out->valve));
  out->vessel = out->outside;
  if (out->resistance > 0) {
    e->column = outlet_columns;
    e->ncolumn = PETSC_STATIC_ARRAY_LENGTH(outlet_columns);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(keys); k++) {
    PetscBool given;

    PetscCall(SbOptionGiven(scope, keys[k], &given));
    PetscCheck(!given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_%s is of an outlet, and there is none: give "
               "-effect_%s_outlet_resistance (Pa s/m^3)",
               e->name, keys[k], e->name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modulus, from that of the wall. */
static PetscErrorCode choose_modulus(SbEffect e, SbSpace space, PetscReal wall)
{
  Cavity *c = (Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &wall, 1, MPIU_REAL, MPI_MAX, space->comm));
  c->wall = wall;
  if (c->modulus == 0)
    c->modulus = PetscMin(WATER, STIFFER * wall);
  PetscCheck(
    c->modulus <= STIFFEST * wall, space->comm, PETSC_ERR_USER_INPUT,
    "-effect_%s_modulus is %g Pa, %.2g times Young's modulus of the wall, %g Pa: rounding "
    "of the volume would decide the pressure; give at most %g Pa, or leave it out: a liquid "
    "whose volume changes by a millionth or less",
    e->name, (double)c->modulus, (double)(c->modulus / wall), (double)wall,
    (double)(STIFFEST * wall));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All nodes of the surface are one coupling. */
static PetscErrorCode couplings_cavity(SbEffect e, SbSpace space)
{
  Cavity *c = (Cavity *)e->data;
  SbFacet *facets;
  SbWallFacet *facet;
  PetscInt *mine, *all;
  PetscInt nfacet, nall;
  PetscInt n = 0;
  PetscReal wall = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &nfacet, &facets));
  PetscCall(PetscMalloc1(SB_CELL_NODES * nfacet, &mine));
  for (PetscInt i = 0; i < nfacet; i++) {
    const PetscInt cell = facets[i].cell;
    const SbElement element = SbSpaceCellElement(space, cell);

    PetscCheck(!SbElementHasFaces(element) && !element->rigid, PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT,
               "%s: body '%s' is %s: a cavity is in bodies with element p1 or p2", e->on.option,
               space->mesh->body[space->mesh->cell_body[cell]].name,
               element->rigid ? "rigid" : element->name);

    wall =
      PetscMax(wall, SbMaterialYoungModulus(space->material[space->mesh->cell_material[cell]]));

    /* the nodes on the facet */
    for (PetscInt a = 0; a < (element->nodes_per[1] ? SB_CELL_NODES : 4); a++) {
      PetscReal L[4] = {1. / 3, 1. / 3, 1. / 3, 1. / 3};
      PetscReal phi[SB_CELL_NODES];

      L[facets[i].face] = 0;
      (void)SbCellBasis(space, cell, L, phi);
      if (phi[a] != 0)
        mine[n++] = space->gnode[SbSpaceCellNode(space, cell, a)];
    }
  }
  PetscCall(SbWallGather(space, nfacet, facets, &nall, &facet));
  PetscCall(PetscFree(facets));
  PetscCall(choose_modulus(e, space, wall));
  PetscCall(PetscSortRemoveDupsInt(&n, mine));
  PetscCall(SbAllgatherv(space->comm, MPIU_INT, n, mine, &c->n, &all, NULL));
  PetscCall(PetscFree(mine));
  PetscCall(PetscSortRemoveDupsInt(&c->n, all));
  if (c->n > MANY)
    PetscCall(SbWarning(space->comm,
                        "effect %s: the cavity has %" PetscInt_FMT
                        " nodes, which its fluid couples "
                        "all with each other: %.2g GB in the matrix; a coarser wall, or a pressure "
                        "in its place, is faster",
                        e->name, c->n, 72e-9 * (double)c->n * (double)c->n));
  if (c->has_lids)
    PetscCall(SbLidsFind(&c->lids, e, space->comm, nall, facet, c->n, all));
  PetscCall(SbSpaceCouple(space, c->n, all, &c->number));
  PetscCall(PetscFree(all));
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A closed surface among them. */
typedef struct {
  PetscReal volume; /* m^3, negative around a cavity */
  PetscReal box[6]; /* m */
} Wall;

/* The closed surfaces, apart from each other, of n facets: wall[n], of which those with a root have
   a volume; root[n] of each facet. */
static PetscErrorCode find_walls(PetscInt n, const SbWallFacet facet[], PetscInt root[],
                                 Wall wall[])
{
  SbKey *corner; /* slot: 3 facet + corner */

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * n, &corner));
  for (PetscInt i = 0; i < 3 * n; i++)
    corner[i] = (SbKey){(uint64_t)facet[i / 3].vertex[i % 3], i};
  SbKeysSort(3 * n, corner);
  for (PetscInt i = 0; i < n; i++)
    root[i] = i;
  for (PetscInt i = 0; i + 1 < 3 * n; i++)
    if (corner[i].key == corner[i + 1].key)
      (void)SbUnionJoin(root, corner[i].slot / 3, corner[i + 1].slot / 3);
  PetscCall(PetscFree(corner));
  for (PetscInt i = 0; i < n; i++) {
    wall[i].volume = 0;
    SbBoxClear(wall[i].box);
  }
  for (PetscInt i = 0; i < n; i++) {
    PetscReal normal[3];

    root[i] = SbUnionRoot(root, i);
    SbCross(facet[i].x[1], facet[i].x[2], normal);
    wall[root[i]].volume += SbDot3(facet[i].x[0], normal) / 6;
    for (int c = 0; c < 3; c++)
      SbBoxAdd(wall[root[i]].box, facet[i].x[c]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solid angle of a wall seen from a place, in turns of 4 pi: -1 in the cavity that it is
   around, 0 outside. Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983). */
static PetscReal angle_of(PetscInt n, const SbWallFacet facet[], const PetscInt root[],
                          PetscInt wall, const PetscReal at[3])
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscReal r[3][3], length[3], cross[3];
    PetscReal below = 1;

    if (root[i] != wall)
      continue;
    for (int c = 0; c < 3; c++) {
      SbSubtract(facet[i].x[c], at, r[c]);
      length[c] = PetscSqrtReal(SbDot3(r[c], r[c]));
      below *= length[c];
    }
    for (int c = 0; c < 3; c++)
      below += SbDot3(r[c], r[(c + 1) % 3]) * length[(c + 2) % 3];
    SbCross(r[1], r[2], cross);
    sum += 2 * PetscAtan2Real(SbDot3(r[0], cross), below);
  }
  return sum / (4 * PETSC_PI);
}

/* Whether a wall, one of its facets at least, lies in a cavity that another one is around. */
static PetscBool is_within(PetscInt n, const SbWallFacet facet[], const PetscInt root[],
                           const Wall wall[], PetscInt which)
{
  for (PetscInt j = 0; j < n; j++)
    if (root[j] == j && wall[j].volume < 0 && angle_of(n, facet, root, j, facet[which].x[0]) < -0.5)
      return PETSC_TRUE;
  return PETSC_FALSE;
}

/* Surfaces apart from each other: chambers with one filling, in the note, and what is in them; an
   error if one is around a body elsewhere. */
static PetscErrorCode check_walls(SbEffect e, SbSpace space)
{
  const Cavity *c = (const Cavity *)e->data;
  PetscInt nchamber = 0;
  PetscInt n, *root;
  SbWallFacet *facet;
  Wall *wall;

  PetscFunctionBeginUser;
  if (c->has_lids) /* parts that lids close are no closed surfaces by themselves */
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbWallGather(space, c->surface.nfacet, c->surface.facet, &n, &facet));
  PetscCall(PetscMalloc2(n, &root, n, &wall));
  PetscCall(find_walls(n, facet, root, wall));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *box = wall[i].box;

    if (root[i] != i)
      continue;
    nchamber += wall[i].volume < 0;
    PetscCheck(
      wall[i].volume < 0 || is_within(n, facet, root, wall, i), space->comm, PETSC_ERR_USER_INPUT,
      "%s: a closed part of this surface, from (%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g) m, "
      "is around bodies of %.4g m^3, not around a cavity or in it: leave its sets out",
      e->on.option, (double)box[0], (double)box[1], (double)box[2], (double)box[3], (double)box[4],
      (double)box[5], (double)wall[i].volume);
  }
  if (nchamber > 1)
    SbAppend(sizeof(e->note), e->note, ", %" PetscInt_FMT " chambers with one pressure", nchamber);
  PetscCall(PetscFree2(root, wall));
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_cavity(SbEffect e, SbSpace space, const SbStage *stage,
                                     const PetscReal residual[], PetscReal values[]);

static PetscErrorCode setup_cavity(SbEffect e, SbSpace space)
{
  Cavity *c = (Cavity *)e->data;
  PetscInt columns;

  PetscFunctionBeginUser;
  PetscCheck(e->dynamic || c->outlet.resistance == 0, space->comm, PETSC_ERR_USER_INPUT,
             "effect %s: fluid leaves by -effect_%s_outlet_resistance in time: take another -time "
             "than static",
             e->name, e->name);
  columns = e->ncolumn;
  PetscCall(SbPressureSetUp(e, space));
  PetscCheck(!c->surface.nrim || c->has_lids, space->comm, PETSC_ERR_USER_INPUT,
             "%s: a cavity needs a closed surface, and this one has a rim of %" PetscInt_FMT
             " edges, the first at (%.4g, %.4g, %.4g) m: add the facets that close it, or give "
             "-effect_%s_lids yes",
             e->on.option, c->surface.nrim, (double)c->surface.rim_at[0],
             (double)c->surface.rim_at[1], (double)c->surface.rim_at[2], e->name);
  PetscCall(SbPressureInside(&c->surface, space, NULL, &c->rest));
  c->rest += SbLidsInside(&c->lids, space, c->number, NULL);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &c->rest, 1, MPIU_REAL, MPI_SUM, space->comm));

  /* closed by them, it has a potential and a history */
  if (c->has_lids) {
    c->surface.sign = c->rest < 0 ? -1 : 1;
    e->no_potential = PETSC_FALSE;
    e->ops.history = history_cavity;
    e->ncolumn = columns;
    SbFormat(sizeof(e->note), e->note, "a cavity of %.6g m^3, with %" PetscInt_FMT " lid%s",
             (double)PetscAbsReal(c->rest), c->lids.n, c->lids.n > 1 ? "s" : "");
  }
  PetscCheck(c->surface.sign < 0, space->comm, PETSC_ERR_USER_INPUT,
             "%s: this surface is around bodies, not around a cavity: take the facets of the wall "
             "inside",
             e->on.option);
  PetscCall(check_walls(e, space));
  c->rest *= c->surface.sign;
  PetscCall(PetscMalloc1(3 * space->nnode, &c->g));
  if (c->number >= 0)
    PetscCall(PetscMalloc1(9 * c->n * c->n, &c->K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_cavity(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Cavity *c = (const Cavity *)e->data;
  PetscReal p = 0;

  PetscFunctionBeginUser;
  PetscCall(pressure_at(e, space, stage, &p));
  PetscCall(SbPressureAddForce(&c->surface, space, p, stage->u, f));
  SbLidsPush(&c->lids, space, c->number, p, stage->u, f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_cavity(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  Cavity *c = (Cavity *)e->data;
  const PetscInt *node;
  PetscReal bending = 0;
  PetscReal factor;
  Filling now;

  PetscFunctionBeginUser;
  c->bends = PETSC_TRUE;
  PetscCall(pressure_at(e, space, stage, &bending));
  PetscCall(SbPressureTangent(e, space, stage, A));
  c->bends = PETSC_FALSE;

  /* dV/dx, up to its sign, and -dp/dV */
  PetscCall(fill(e, space, stage, &now));
  factor = -stage->shift_k * now.slope;
  PetscCall(PetscArrayzero(c->g, 3 * space->nnode));
  PetscCall(SbPressureAddForce(&c->surface, space, 1., stage->u, c->g));
  SbLidsPush(&c->lids, space, c->number, 1., stage->u, c->g);
  PetscCall(SbSpaceUpdateGhosts(space, c->g));
  if (c->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  node = space->couplings.node + space->couplings.start[c->number];
  for (PetscInt i = 0; i < 3 * c->n; i++)
    for (PetscInt j = 0; j < 3 * c->n; j++)
      c->K[3 * c->n * i + j] =
        factor * c->g[3 * node[i / 3] + i % 3] * c->g[3 * node[j / 3] + j % 3];
  SbLidsTurn(&c->lids, space, c->number, stage->shift_k * bending, stage->u, c->n, c->K);
  PetscCall(SbSpaceAddCoupling(space, A, c->number, c->K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_cavity(SbEffect e, SbSpace space, const SbStage *stage)
{
  Cavity *c = (Cavity *)e->data;
  Filling now;

  PetscFunctionBeginUser;
  PetscCall(fill(e, space, stage, &now));
  c->kept = now.p;
  c->outlet.left += now.flow * (stage->t - c->outlet.t);
  c->outlet.vessel = now.vessel;
  c->outlet.flow = now.flow;
  c->outlet.t = stage->t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One record, on the first rank. */
static PetscErrorCode save_cavity(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Cavity *c = (const Cavity *)e->data;
  const Outlet *out = &c->outlet;

  PetscFunctionBeginUser;
  *n = !space->rank;
  PetscCall(PetscMalloc1(5, records));
  (*records)[4] = c->kept;
  (*records)[0] = out->t;
  (*records)[1] = out->left;
  (*records)[2] = out->vessel;
  (*records)[3] = out->flow;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_cavity(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                  PetscInt n, const PetscReal records[])
{
  Outlet *out = &((Cavity *)e->data)->outlet;

  PetscFunctionBeginUser;
  (void)space;
  (void)t;
  (void)u;
  if (n < 1)
    PetscFunctionReturn(PETSC_SUCCESS);
  out->t = records[0];
  out->left = records[1];
  out->vessel = records[2];
  out->flow = records[3];
  ((Cavity *)e->data)->kept = records[4];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The volume, m^3, on all ranks; the pressure, Pa, and the fluid's energy, J, on the first one; of
   an outlet the flow, m^3/s, and the pressure behind it, Pa. */
static PetscErrorCode history_cavity(SbEffect e, SbSpace space, const SbStage *stage,
                                     const PetscReal residual[], PetscReal values[])
{
  const Cavity *c = (const Cavity *)e->data;
  const PetscReal n = c->exponent;
  Filling now;

  PetscFunctionBeginUser;
  (void)residual;
  PetscCall(fill(e, space, stage, &now));
  if (space->rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  values[0] = now.V;
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  values[1] = now.p;
  if (c->outlet.resistance > 0) {
    values[3] = now.flow;
    values[4] = now.vessel;
  }
  if (n == 1)
    values[2] = c->modulus * (now.V - now.fluid - now.fluid * PetscLogReal(now.V / now.fluid));
  else
    values[2] = c->modulus * (now.fluid / (n - 1) * (PetscPowReal(now.fluid / now.V, n - 1) - 1) +
                              now.V - now.fluid);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_cavity(SbEffect e)
{
  Cavity *c = (Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbLidsDestroy(&c->lids));
  PetscCall(PetscFree(c->g));
  PetscCall(PetscFree(c->K));
  PetscCall(SbPressureDestroy(e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"volume", "pressure", "energy"};

const SbEffectType SbEffectCavity = {
  .name = "cavity",
  .size = sizeof(Cavity),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_cavity,
          .couplings = couplings_cavity,
          .setup = setup_cavity,
          .force = force_cavity,
          .tangent = tangent_cavity,
          .accept = accept_cavity,
          .save = save_cavity,
          .load = load_cavity,
          .history = history_cavity,
          .destroy = destroy_cavity},
};
