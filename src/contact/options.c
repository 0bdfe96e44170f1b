/*
  options.c - the effect `contact`: its options, and which response a scene gets.

  Without an obstacle: contact between the bodies of the sets, and self-contact on request, by
  `barrier`. With an obstacle: contact of the surfaces `on` with it, by `barrier` or by responses of
  nodes (nodes.c).

  Response `auto` is the same for all effects of a scene, as Newton's method has one potential and
  one set of constraints: `barrier`, which has no active set that could fail to settle, unless the
  scene needs what it lacks, or -snes_type ksponly asks for one linear solve a step against
  half-spaces and bowls, where the surface is outside whenever its vertices are.
*/
#include "surfaces.h"
#include "nodes.h"

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "boundary", "", "sets whose surfaces may be in contact"},
  {"obstacle", SB_OPTION_STRING, 1, "", "", "",
   "rigid obstacle (m): plane:nx,ny,nz,d (half-space n.x <= d), sphere:x,y,z,r, "
   "box:x0,y0,z0,x1,y1,z1, "
   "capsule:x0,y0,z0,x1,y1,z1,r, cylinder:x0,y0,z0,x1,y1,z1,r, bowl:x,y,z,r (everything outside "
   "the sphere), "
   "mesh:FILE (inside of a closed surface: .stl, .obj, .off, .msh); without it: contact between "
   "bodies"},
  {"obstacle_scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "mesh: factor on the coordinates of the file; 0.001 for a file in mm"},
  {"obstacle_at", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)",
   "mesh: translation, after scaling"},
  {"displacement", SB_OPTION_FORMULA, 3, "m", "0;0;0", "",
   "path of the obstacle, three formulas of the time t; live: interactive, as the file live.txt "
   "says during "
   "the run"},
  {"angle", SB_OPTION_FORMULA, 1, "degrees", "0", "",
   "rotation of the obstacle about the axis, a formula of t"},
  {"axis", SB_OPTION_REALS, 3, "", "0,0,1", "", "direction of the axis of rotation; right-handed"},
  {"axis_point", SB_OPTION_REALS, 3, "m", "0,0,0", "", "a point on the axis; torques are about it"},
  {"self", SB_OPTION_BOOL, 1, "", "false", "", "without an obstacle: self-contact as well"},
  {"friction", SB_OPTION_REAL, 1, "", "0", "[0, inf)", "static coefficient of friction"},
  {"response", SB_OPTION_CHOICE, 1, "", "auto",
   "auto|projected|multiplier|augmented|penalty|barrier",
   "how contact is enforced. auto: barrier; projected with -snes_type ksponly where all obstacles "
   "are half-spaces or bowls, and where -time, -mass or an option needs it. projected: active set, "
   "constraints eliminated by solving in their null space; "
   "multiplier: Lagrange multipliers; "
   "augmented: "
   "augmented Lagrangian, penalty with multipliers updated by Uzawa's method; penalty: springs; "
   "barrier: a "
   "potential that grows without bound as the gap closes (incremental potential contact), so that "
   "surfaces "
   "never pass through each other. Between bodies and in self-contact, all five act on the same "
   "pairs of features, and collision detection limits their steps"},
  {"barrier_width", SB_OPTION_REAL, 1, "m", "0", "[0, inf)",
   "between surfaces: response barrier: activation distance, the gap below which surfaces repel "
   "each "
   "other; other responses: the gap that surfaces keep as their constraint; 0: a "
   "thousandth of "
   "the diagonal of the smallest body, at most 0.003 times the cube root of its volume and half of "
   "its "
   "shortest edge"},
  {"barrier_pressure", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "response barrier: stiffness of the barrier as a pressure; 0: a tenth of Young's modulus of the "
   "softer "
   "body"},
  {"weights", SB_OPTION_CHOICE, 1, "", "each", "each|once",
   "response barrier: what of the surfaces several pairs share, as the side of two triangles: "
   "each: each pair counts; once: they count once, as in the convergent formulation: contact "
   "pressure is more even, and a vertex that slides from triangle to triangle is not pushed "
   "sideways"},
  {"search", SB_OPTION_CHOICE, 1, "", "auto", "auto|hash|tree",
   "response barrier: search for the pairs of features that may meet; both find the same. auto: "
   "tree "
   "against an obstacle, else hash. hash: the cells of an infinite grid in a hash table; tree: "
   "trees of "
   "boxes"},
  {"verify", SB_OPTION_BOOL, 1, "", "false", "",
   "response barrier: after each step, search for edges that intersect triangles; an intersection "
   "ends the "
   "run"},
  {"sticking", SB_OPTION_CHOICE, 1, "", "exact", "exact|smooth",
   "friction between bodies, and of the barrier: exact: pairs below Coulomb's limit come to rest; "
   "smooth: they creep, at a ten-thousandth of the speed of a step at most"},
  {"slip_speed", SB_OPTION_REAL, 1, "m/s", "0", "[0, inf)",
   "sticking smooth, time steps: the speed below which friction falls to zero, so that what sticks "
   "creeps more slowly; 0: a ten-thousandth of the speed of a step"},
  {"friction_solves", SB_OPTION_INT, 1, "", "0", "[0, inf)",
   "response barrier: largest number of lagged-friction iterations of a step, each with the normal "
   "forces "
   "and slip directions at the end of the one before; 0: one, or two if friction changes by more "
   "than half, "
   "in static runs 100"},
  {"friction_tolerance", SB_OPTION_REAL, 1, "", "1e-3", "(0, inf)",
   "response barrier: tolerance of lagged friction, its change in an iteration relative to "
   "Coulomb's limit"},
  {"friction_kinetic", SB_OPTION_REAL, 1, "", "-1", "[-1, inf)",
   "kinetic coefficient of friction; negative: equal to the static one; only for nodes "
   "against obstacles, not with barrier"},
  {"stiffness", SB_OPTION_REAL, 1, "", "20", "(0, inf)",
   "penalty, augmented and friction: factor on the stiffness min(lambda + 2 mu, 11 mu) area / "
   "height of the "
   "tet behind the surface; between bodies and in self-contact area / mean edge, where projected "
   "and multiplier take 10 times as much"},
  {"multiplier_tolerance", SB_OPTION_REAL, 1, "", "0", "[0, inf)",
   "between bodies and of the barrier: tolerance of the gaps of augmented, projected and "
   "multiplier, "
   "and of slips of what sticks, over the barrier's width; 0: projected and multiplier 1e-10 in "
   "static "
   "runs and 1e-5 in time steps, augmented 1e-3, barrier and penalty 1e-3 in static runs, and no "
   "further solves in time steps"},
  {"unsettled", SB_OPTION_CHOICE, 1, "", "auto", "auto|fail|barrier",
   "between bodies: what happens to a step in which the forces of augmented, projected and "
   "multiplier do not settle: fail: it is halved, and where that does not help the run ends; "
   "barrier: it is repeated with the response barrier, with a warning; auto: fail, as these "
   "responses are never the choice of -effect_<name>_response auto"},
  {"damping", SB_OPTION_REAL, 1, "s", "0", "[0, inf)",
   "response penalty: dashpot in parallel with each spring, of stiffness times this time; acts on "
   "penetrating points, without tension"},
  {"restitution", SB_OPTION_REAL, 1, "", "0", "[0, 1]",
   "coefficient of restitution, the ratio of normal relative velocities after and before impact; "
   "needs -time "
   "euler_implicit, and steps in which elastic waves cross the body; projected, multiplier and "
   "barrier"},
  {"time_of_impact", SB_OPTION_CHOICE, 1, "", "no", "no|yes",
   "yes: a step in which contact begins is cut at the first time of impact; only for nodes "
   "against obstacles, not with barrier"},
  {"separation_steps", SB_OPTION_REAL, 1, "steps", "30", "[1, inf)",
   "penetration that is there at the start is resolved gradually: number of steps in which its "
   "depth falls "
   "to 1/e; 1, and in static runs: at once"},
  {"pairs", SB_OPTION_BOOL, 1, "", "false", "",
   "between bodies: columns in history.csv for each pair of bodies: force of the first on the "
   "second, number "
   "of contacts"},
};

static const char *const names_of_responses[] = {"auto",      "projected", "multiplier",
                                                 "augmented", "penalty",   "barrier"};
/* Options for which `auto` takes another response than `barrier`; those from NODES_ONLY on are for
   nodes against obstacles only. */
static const char *const barrier_lacks[] = {"restitution", "stiffness", "time_of_impact", "damping",
                                            "friction_kinetic"};
#define NODES_ONLY 2

/* What contact effects ask for, one or several of them. */
typedef struct {
  PetscBool bodies;    /* some is contact between bodies */
  PetscBool facets;    /* some obstacle is neither a half-space nor a bowl */
  PetscBool lacks;     /* some obstacle has an option that `barrier` lacks */
  SbResponse response; /* the option of the last one that gives it; AUTO: none does */
} Wishes;

/* Adds what one effect of the scene asks for, nothing if it is of another type. */
static PetscErrorCode add_wishes(const char *name, Wishes *wishes)
{
  char text[PETSC_MAX_PATH_LEN];
  int response;
  SbScope scope;

  PetscFunctionBeginUser;
  SbScopeSet(&scope, "effect", "", name);
  PetscCall(SbOptionString(&scope, "type", SB_NAME_MAX, text));
  if (strcmp(text[0] ? text : name, "contact"))
    PetscFunctionReturn(PETSC_SUCCESS);
  SbScopeSet(&scope, "effect", "contact", name);
  PetscCall(SbOptionChoice(&scope, "response", &response));
  if (response != AUTO)
    wishes->response = (SbResponse)response;
  PetscCall(SbOptionString(&scope, "obstacle", sizeof(text), text));
  if (!text[0]) {
    wishes->bodies = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (strncmp(text, "plane", 5) && strncmp(text, "bowl", 4))
    wishes->facets = PETSC_TRUE;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(barrier_lacks); k++) {
    PetscBool given;

    PetscCall(SbOptionGiven(&scope, barrier_lacks[k], &given));
    wishes->lacks = (PetscBool)(wishes->lacks || given);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether `barrier` goes with -time and -mass, where the program has them. */
static PetscErrorCode integrator_has_barrier(PetscBool *has)
{
  PetscBool consistent = PETSC_FALSE;
  int time;

  PetscFunctionBeginUser;
  *has = PETSC_TRUE;
  if (!SbOptionFind(&SbRunScope, "time"))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbOptionChoice(&SbRunScope, "time", &time));
  if (SbOptionFind(&SbRunScope, "mass"))
    PetscCall(SbOptionSecond(&SbRunScope, "mass", &consistent));

  /* euler_implicit and static; newmark and genalpha */
  *has = (PetscBool)(time == 0 || time == 6 || ((time == 1 || time == 2) && !consistent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The response of an effect; why: the reason of `auto`, NULL: the response is given; surfaces: on
   pairs of features, not of nodes with the obstacle. */
static PetscErrorCode choose(SbEffect e, SbResponse *response, PetscBool *surfaces,
                             const char **why)
{
  PetscBool possible = PETSC_TRUE;
  PetscBool once = PETSC_FALSE;
  Wishes wishes = {0};
  char snes[SB_NAME_MAX] = "";

  PetscFunctionBeginUser;

  /* the effect's own option */
  PetscCall(add_wishes(e->name, &wishes));
  *response = wishes.response;

  /* what all effects of the scene ask for, and the integrator, where the program has them */
  if (SbOptionFind(&SbRunScope, "effects")) {
    PetscInt n;
    char(*names)[SB_NAME_MAX];

    PetscCall(SbOptionNames(&SbRunScope, "effects", &n, &names));
    for (PetscInt i = 0; i < n; i++)
      PetscCall(add_wishes(names[i], &wishes));
    PetscCall(PetscFree(names));
  }
  *surfaces = (PetscBool)(wishes.bodies || *response == BARRIER);
  if (*response != AUTO)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(integrator_has_barrier(&possible));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-snes_type", snes, sizeof(snes), NULL));
  once = (PetscBool)!strcmp(snes, SNESKSPONLY);

  /* the first rule that holds */
  {
    const struct {
      PetscBool holds;
      SbResponse response;
      const char *why;
    } rule[] = {
      {wishes.bodies, BARRIER, "bodies meet each other"},
      {(PetscBool)(wishes.response == BARRIER), BARRIER, "the same as another effect"},
      {(PetscBool)(wishes.response != AUTO), PROJECTED, "the same as another effect"},
      {(PetscBool)!possible, PROJECTED, "-time or -mass"},
      {wishes.lacks, PROJECTED, "an option that barrier lacks"},
      {wishes.facets, BARRIER, "edges and corners may touch"},
      {once, PROJECTED, "one linear solve a step, half-spaces and bowls only"},
      {PETSC_TRUE, BARRIER, "no active set has to settle in a step"},
    };
    size_t k = 0;

    while (!rule[k].holds)
      k++;
    *response = rule[k].response;
    *surfaces = (PetscBool)(*surfaces || *response == BARRIER);
    *why = rule[k].why;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_contact(SbEffect e, const SbScope *scope)
{
  Contact *c = (Contact *)e->data;
  const char *why = NULL;
  PetscBool given;
  PetscBool surfaces = PETSC_FALSE;
  PetscReal steps;

  PetscFunctionBeginUser;
  e->contact = &c->base;
  c->base.effect = e;
  PetscCall(choose(e, &c->response, &surfaces, &why));
  if (why)
    SbFormat(sizeof(e->note), e->note, "response %s: %s", names_of_responses[c->response], why);

  /* the obstacle and its path; surfaces have none of the options of nodes */
  PetscCall(SbPartnerRead(e, scope, &c->partner));
  for (size_t k = NODES_ONLY; surfaces && k < PETSC_STATIC_ARRAY_LENGTH(barrier_lacks); k++) {
    PetscCall(SbOptionGiven(scope, barrier_lacks[k], &given));
    PetscCheck(!given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_%s is for nodes against obstacles in scenes without contact between "
               "bodies, and not with barrier: leave it out",
               e->name, barrier_lacks[k]);
  }
  PetscCall(SbOptionGiven(scope, "stiffness", &given));
  PetscCheck(!given || c->response != BARRIER, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_stiffness is of springs, which barrier has not: use "
             "-effect_%s_barrier_pressure, or another -effect_%s_response",
             e->name, e->name, e->name);
  PetscCall(SbOptionGiven(scope, "weights", &given));
  PetscCheck(!given || c->response == BARRIER, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_weights is of response barrier: leave it out, or take "
             "-effect_%s_response barrier",
             e->name, e->name);
  PetscCall(SbOptionGiven(scope, "multiplier_tolerance", &given));
  PetscCheck(
    !given || surfaces, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_multiplier_tolerance is of contact between bodies and of barrier: leave it "
    "out",
    e->name);
  PetscCall(SbOptionGiven(scope, "unsettled", &given));
  PetscCheck(!given || surfaces, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_unsettled is of contact between bodies: leave it out", e->name);
  PetscCall(SbOptionReal(scope, "friction", &c->friction.mu));
  PetscCall(SbOptionReal(scope, "restitution", &c->bounce.e));
  PetscCall(SbOptionReal(scope, "separation_steps", &steps));
  c->overlap.recovery = steps > 1 ? PetscExpReal(-1 / steps) : 0;
  e->steady = PETSC_FALSE; /* a load factor does not make an obstacle softer */
  c->base.restitution = c->bounce.e;
  if (surfaces)
    PetscCall(SbSurfacesCreate(e, scope));
  else
    PetscCall(SbContactNodesCreate(e, scope));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectContact = {
  .name = "contact",
  .size = PetscMax(sizeof(Surfaces), sizeof(Nodes)),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_contact},
};
