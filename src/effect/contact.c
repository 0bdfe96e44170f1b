/*
  contact.c - the effect `contact`: its options, and which response a scene gets.

  Without an obstacle: contact between the bodies of the sets, and self-contact on request, by `barrier`. With an obstacle: contact of the surfaces `on` with it,
  by `barrier` or by responses of nodes (contact_node.c).

  Response `auto` is the same for all effects of a scene, as Newton's method has one potential and one set of constraints: `barrier` with contact between bodies. `projected` is exact, and
  safe for half-spaces and bowls, where the surface is outside whenever its vertices are. Other obstacles can penetrate edges and faces, or be passed within a step: there
  it is `barrier`, unless the scene needs an option of the other responses.
*/
#include "contact.h"

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "boundary", "", "sets whose surfaces may be in contact"},
  {"obstacle", SB_OPTION_STRING, 1, "", "", "",
   "rigid obstacle (m): plane:nx,ny,nz,d (half-space n.x <= d), sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1, "
   "capsule:x0,y0,z0,x1,y1,z1,r, cylinder:x0,y0,z0,x1,y1,z1,r, bowl:x,y,z,r (everything outside the sphere), "
   "mesh:FILE (inside of a closed surface: .stl, .obj, .off, .msh); without it: contact between bodies"},
  {"obstacle_scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "mesh: factor on the coordinates of the file; 0.001 for a file in mm"},
  {"obstacle_at", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)", "mesh: translation, after scaling"},
  {"displacement", SB_OPTION_FORMULA, 3, "m", "0;0;0", "",
   "path of the obstacle, three formulas of the time t; live: interactive, as the file live.txt says during "
   "the run"},
  {"angle", SB_OPTION_FORMULA, 1, "degrees", "0", "",
   "rotation of the obstacle about the axis, a formula of t"},
  {"axis", SB_OPTION_REALS, 3, "", "0,0,1", "", "direction of the axis of rotation; right-handed"},
  {"axis_point", SB_OPTION_REALS, 3, "m", "0,0,0", "", "a point on the axis; torques are about it"},
  {"self", SB_OPTION_BOOL, 1, "", "false", "", "without an obstacle: self-contact as well"},
  {"friction", SB_OPTION_REAL, 1, "", "0", "[0, inf)", "static coefficient of friction"},
  {"response", SB_OPTION_CHOICE, 1, "", "auto", "auto|projected|multiplier|augmented|penalty|barrier",
   "how contact is enforced. auto: barrier between bodies; with an obstacle projected where it is a "
   "half-space or bowl, or where an option needs it, else barrier. projected: active "
   "set, constraints eliminated by solving in their null space; multiplier: Lagrange multipliers; augmented: "
   "augmented Lagrangian, penalty with multipliers updated by Uzawa's method; penalty: springs; barrier: a "
   "potential that grows without bound as the gap closes (incremental potential contact), so that surfaces "
   "never pass through each other"},
  {"barrier_width", SB_OPTION_REAL, 1, "m", "0", "[0, inf)",
   "response barrier: activation distance, the gap below which surfaces repel each other; 0: a thousandth of "
   "the diagonal of the smallest body, at most 0.003 times the cube root of its volume and half of its "
   "shortest edge"},
  {"barrier_pressure", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "response barrier: stiffness of the barrier as a pressure; 0: a tenth of Young's modulus of the softer "
   "body"},
  {"verify", SB_OPTION_BOOL, 1, "", "false", "",
   "response barrier: after each step, search for edges that intersect triangles; an intersection ends the "
   "run"},
  {"friction_solves", SB_OPTION_INT, 1, "", "0", "[0, inf)",
   "response barrier: largest number of lagged-friction iterations of a step, each with the normal forces "
   "and slip directions at the end of the one before; 0: one, or two if friction changes by more than half, "
   "in static runs 100"},
  {"friction_tolerance", SB_OPTION_REAL, 1, "", "1e-3", "(0, inf)",
   "response barrier: tolerance of lagged friction, its change in an iteration relative to Coulomb's limit"},
  {"friction_kinetic", SB_OPTION_REAL, 1, "", "-1", "[-1, inf)",
   "kinetic coefficient of friction; negative: equal to the static one; not with barrier"},
  {"stiffness", SB_OPTION_REAL, 1, "", "20", "(0, inf)",
   "penalty, augmented and friction: factor on the stiffness min(lambda + 2 mu, 11 mu) area / height of the "
   "tet behind "
   "the surface"},
  {"damping", SB_OPTION_REAL, 1, "s", "0", "[0, inf)",
   "response penalty: dashpot in parallel with each spring, of stiffness times this time; acts on "
   "penetrating points, without tension"},
  {"restitution", SB_OPTION_REAL, 1, "", "0", "[0, 1]",
   "coefficient of restitution, the ratio of normal relative velocities after and before impact; needs -time "
   "euler_implicit, and steps in which elastic waves cross the body; projected, multiplier and barrier"},
  {"time_of_impact", SB_OPTION_CHOICE, 1, "", "no", "no|yes",
   "yes: a step in which contact begins is cut at the first time of impact; not with barrier"},
  {"separation_steps", SB_OPTION_REAL, 1, "steps", "30", "[1, inf)",
   "penetration that is there at the start is resolved gradually: number of steps in which its depth falls "
   "to 1/e; 1, and in static runs: at once"},
  {"pairs", SB_OPTION_BOOL, 1, "", "false", "",
   "between bodies: columns in history.csv for each pair of bodies: force of the first on the second, number "
   "of contacts"},
};

static const char *const names_of_responses[] = {"auto",      "projected", "multiplier",
                                                 "augmented", "penalty",   "barrier"};
/* Options that contact between bodies does not have. */
static const char *const obstacles_only[] = {"time_of_impact", "damping", "stiffness", "friction_kinetic"};
/* Options that need another response than `barrier` against an obstacle. */
static const char *const exact_only[] = {"restitution", "time_of_impact", "damping", "stiffness",
                                         "friction_kinetic"};

/* Criteria of the response of an effect, its option `response` among them. */
typedef struct {
  SbResponse response;
  PetscBool bodies, vertices,
    others; /* contact between bodies; half-spaces and bowls only; options that `barrier` lacks */
} Needs;

static PetscErrorCode examine(const char *name, Needs *needs)
{
  SbScope scope;
  PetscInt choice;
  char text[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  *needs = (Needs){0};
  PetscCall(SbScopeSet(&scope, "effect", "contact", name));
  PetscCall(SbOptionChoice(&scope, "response", &choice));
  needs->response = (SbResponse)choice;
  PetscCall(SbOptionString(&scope, "obstacle", sizeof(text), text));
  needs->bodies = (PetscBool)!text[0];
  needs->vertices = (PetscBool)(!strncmp(text, "plane", 5) || !strncmp(text, "bowl", 4));
  for (size_t k = 0; text[0] && k < PETSC_STATIC_ARRAY_LENGTH(exact_only); k++) {
    PetscBool given;

    PetscCall(SbOptionGiven(&scope, exact_only[k], &given));
    needs->others = (PetscBool)(needs->others || given);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The response of an effect; why: the reason of `auto`, NULL: the response is given. */
static PetscErrorCode choose(SbEffect e, SbResponse *response, const char **why)
{
  PetscBool possible = PETSC_TRUE;
  PetscInt n = 0, method;
  char(*names)[SB_NAME_MAX] = NULL;
  SbResponse other = AUTO;
  SbScope scope;
  Needs needs;

  PetscFunctionBeginUser;
  PetscCall(examine(e->name, &needs));
  *response = needs.response;
  PetscCheck(
    !needs.bodies || *response == AUTO || *response == BARRIER, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_response %s is for obstacles: bodies meet each other by barrier; leave it out, or give "
    "-effect_%s_obstacle",
    e->name, names_of_responses[*response], e->name);
  if (*response != AUTO) PetscFunctionReturn(PETSC_SUCCESS);

  /* the integrator, where the program has one */
  if (SbOptionExists(&SbRunScope, "time")) {
    PetscCall(SbOptionChoice(&SbRunScope, "time", &method));
    possible = (PetscBool)(method == 0 || method == 6); /* euler_implicit, static */
  }

  /* the other effects */
  if (SbOptionExists(&SbRunScope, "effects")) PetscCall(SbOptionNames(&SbRunScope, "effects", &n, &names));
  for (PetscInt i = 0; i < n; i++) {
    char type[SB_NAME_MAX];
    Needs more;

    PetscCall(SbScopeSet(&scope, "effect", "", names[i]));
    PetscCall(SbOptionString(&scope, "type", sizeof(type), type));
    if (strcmp(type[0] ? type : names[i], "contact")) continue;
    PetscCall(examine(names[i], &more));
    if (more.response != AUTO) other = more.response;
    needs.bodies = (PetscBool)(needs.bodies || more.bodies);
    needs.vertices = (PetscBool)(needs.vertices && more.vertices);
    needs.others = (PetscBool)(needs.others || more.others);
  }
  PetscCall(PetscFree(names));

  if (needs.bodies) {
    *response = BARRIER;
    *why = "bodies meet each other";
  } else if (other != AUTO) {
    *response = other == BARRIER ? BARRIER : PROJECTED;
    *why = "the same as another effect";
  } else if (!possible || needs.others || needs.vertices) {
    *response = PROJECTED;
    *why = !possible ? "-time" : needs.others ? "an option that barrier lacks" : "half-spaces and bowls only";
  } else {
    *response = BARRIER;
    *why = "edges and corners may touch";
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_common(SbEffect e, const SbScope *scope, SbContactOptions *o)
{
  PetscInt choice;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "friction", &o->friction.mu));
  o->friction.mu_kinetic = o->friction.mu;
  PetscCall(SbOptionReal(scope, "restitution", &o->restitution));
  if (o->response == BARRIER) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbOptionReal(scope, "friction_kinetic", &o->friction.mu_kinetic));
  if (o->friction.mu_kinetic < 0) o->friction.mu_kinetic = o->friction.mu;
  PetscCheck(o->friction.mu_kinetic <= o->friction.mu, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_friction_kinetic %g is above -effect_%s_friction %g: sliding would "
             "start and stop in turn",
             e->name, (double)o->friction.mu_kinetic, e->name, (double)o->friction.mu);
  o->friction.exact = SbResponseIsExact(o->response);
  PetscCall(SbOptionChoice(scope, "time_of_impact", &choice));
  o->cut = (PetscBool)(choice == 1);
  PetscCall(SbOptionReal(scope, "stiffness", &o->stiffness));
  PetscCall(SbOptionReal(scope, "damping", &o->damping));
  PetscCheck(o->damping <= 0 || o->response == PENALTY, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_damping %g s is for springs that give: it needs -effect_%s_response penalty",
             e->name, (double)o->damping, e->name);
  PetscCheck(o->restitution <= 0 || SbResponseIsExact(o->response), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_restitution %g needs -effect_%s_response projected, multiplier or barrier", e->name,
             (double)o->restitution, e->name);
  PetscCheck(o->restitution <= 0 || !o->cut, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_restitution %g and -effect_%s_time_of_impact yes do not go together: a step "
             "that ends at the impact has no rebound; leave one of them out",
             e->name, (double)o->restitution, e->name);
  PetscCall(SbOptionReal(scope, "separation_steps", &o->separation_steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_contact(SbEffect e, const SbScope *scope)
{
  SbContactOptions o = {0};
  const char *why = NULL;
  char text[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(choose(e, &o.response, &why));
  PetscCall(SbOptionString(scope, "obstacle", sizeof(text), text));
  PetscCall(read_common(e, scope, &o));
  if (why) (void)snprintf(e->note, sizeof(e->note), "response %s: %s", names_of_responses[o.response], why);
  e->linear = PETSC_TRUE;
  e->steady = PETSC_FALSE; /* contact is not scaled by the load factor */
  e->euler = (PetscBool)(o.restitution > 0);
  if (!text[0]) { /* contact between bodies */
    SbBarrierScene scene = {.on = &e->on, .friction = o.friction.mu, .restitution = o.restitution};

    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(obstacles_only); k++) {
      PetscBool given;

      PetscCall(SbOptionGiven(scope, obstacles_only[k], &given));
      PetscCheck(
        !given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
        "-effect_%s_%s is for responses to obstacles: bodies meet each other by barrier; leave it out",
        e->name, obstacles_only[k]);
    }
    PetscCall(SbOptionBool(scope, "self", &scene.self));
    PetscCall(SbOptionBool(scope, "pairs", &scene.pairs));
    PetscCall(SbBarrierCreate(e, scope, &scene));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbContactCreate_Node(e));
  e->saddle = (PetscBool)(o.response == MULTIPLIER);
  e->springs = (PetscBool)(!SbResponseIsExact(o.response) || o.friction.mu > 0);
  if (!o.cut) e->ops.time_of_impact = NULL;
  if (!e->euler) e->ops.restitution = NULL;
  PetscCall(SbContactOptions_Node(e, scope, &o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectContact = {
  .name = "contact",
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_contact},
};
