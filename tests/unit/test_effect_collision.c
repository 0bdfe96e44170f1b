// @ranks 1 2 3
/*
  Contact between bodies as an effect: settings that are refused; rows that make no net force and have the detector's gap; who
  looks with `passes one`; what a step costs when bodies are far apart; attempts at a step that do not know of each other; a
  static scene of all elements whose numbers no partition changes, and reactions that balance.
*/
#include "../../src/effect/collision.h"
#include "sbconstraint.h"
#include "surface_fixture.h"

#define MEET \
  " -effects meet -effect_meet_type contact -effect_meet_response projected -ts_dt 0.01 -ts_max_time 0.02 "
#define APART "-bodies a,b" BODY("a", "p1", "box:1,1,1:1", "0,0,0") BODY("b", "p1", "box:1,1,1:1", "4,0,0")

/* ------------------------------------------------------------------ refused */

static PetscErrorCode open_only(const char *options)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &t));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_refused(void)
{
  static const struct {
    const char *options, *names;
    PetscErrorCode code;
  } cases[] = {
    {"-effect_meet_response glue", "-effect_meet_response glue|projected", PETSC_ERR_USER},
    {"-effect_meet_passes none", "-effect_meet_passes none|two", PETSC_ERR_USER},
    {"-effect_meet_detection eyes", "-effect_meet_detection eyes|brute", PETSC_ERR_USER},
    {"-effect_meet_friction -1", "-effect_meet_friction", PETSC_ERR_USER},
    {"-effect_meet_friction 0.2 -effect_meet_friction_kinetic 0.3",
     "-effect_meet_friction_kinetic 0.3|-effect_meet_friction 0.2", PETSC_ERR_USER_INPUT},
    {"-effect_meet_stiffness 0", "-effect_meet_stiffness", PETSC_ERR_USER},
    {"-effect_meet_search_radius -1", "-effect_meet_search_radius", PETSC_ERR_USER},
    {"-effect_meet_separation_steps 0.5", "-effect_meet_separation_steps", PETSC_ERR_USER},
    {"-effect_meet_restitution 1.5", "-effect_meet_restitution 1.5", PETSC_ERR_USER},
    {"-effect_meet_damping 0.01", "-effect_meet_damping 0.01 s", PETSC_ERR_USER_INPUT},
    {"-effect_meet_restitution 0.5 -effect_meet_response augmented",
     "-effect_meet_restitution 0.5|-effect_meet_response projected", PETSC_ERR_USER_INPUT},
    {"-effect_meet_restitution 0.5 -effect_meet_time_of_impact yes",
     "-effect_meet_restitution 0.5|-effect_meet_time_of_impact yes", PETSC_ERR_USER_INPUT},
    {"-effect_meet_restitution 0.5 -time genalpha", "-effect_meet_restitution|-time euler_implicit",
     PETSC_ERR_USER_INPUT},
    {"-sets left -set_left_at plane:1,0,0,0 -effect_meet_on left", "effect meet", PETSC_ERR_USER_INPUT},
    {"-effect_meet_time_of_impact late", "-effect_meet_time_of_impact late|no", PETSC_ERR_USER},
    {"-time genalpha -effect_meet_time_of_impact yes", "-time genalpha|-effect_meet_time_of_impact yes",
     PETSC_ERR_USER_INPUT},
    {"-time euler_symplectic", "effect meet", PETSC_ERR_USER_INPUT},
    {"-time euler_explicit", "effect meet", PETSC_ERR_USER_INPUT},
    {"-time alpha2", "effect meet", PETSC_ERR_USER_INPUT},
    {"-time newmark -effect_meet_response penalty", "-time newmark|effect meet", PETSC_ERR_USER_INPUT},
    {"-time newmark -effect_meet_response augmented", "-time newmark|effect meet", PETSC_ERR_USER_INPUT},
    {"-time newmark -effect_meet_friction 0.2", "-time newmark|effect meet", PETSC_ERR_USER_INPUT},
    {"-time newmark -effect_meet_restitution 0.5", "-effect_meet_restitution|-time euler_implicit",
     PETSC_ERR_USER_INPUT},
    {"-time newmark -time_newmark_gamma 0.6 -time_newmark_beta 0.3",
     "-time newmark|effect meet|-time_newmark_beta 0.25|-time_newmark_gamma 0.5|0.3|0.6",
     PETSC_ERR_USER_INPUT},
    {"-time newmark -mass consistent", "-time newmark|effect meet|-mass lumped", PETSC_ERR_USER_INPUT},
    {"-body_a_tangent warped -body_b_tangent warped -solver realtime", "-solver realtime|effect meet",
     PETSC_ERR_USER_INPUT},
    {"-body_a_element cr -solver pressure", "-solver pressure", PETSC_ERR_USER_INPUT},
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    char options[2048];

    PetscCall(PetscSNPrintf(options, sizeof(options), APART MEET "%s", cases[k].options));
    SB_CHECK_ERROR(open_only(options), cases[k].code, cases[k].names);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ rows */

/* A scene with one effect `meet`, and local displacements: at the start of the step none. */
typedef struct {
  TestScene t;
  SbSpace s;
  SbEffect e;
  PetscReal *u0, *u;
} Meeting;

static PetscErrorCode open_meeting(const char *elements, const char *more, Meeting *x)
{
  char options[4096];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options), "%s" MEET "%s", elements, more));
  PetscCall(test_scene_open(options, &x->t));
  x->s = x->t.model->space;
  x->e = x->t.model->begin_step[0];
  PetscCall(PetscCalloc2(3 * x->s->nnode, &x->u0, 3 * x->s->nnode, &x->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode close_meeting(Meeting *x)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(x->u0, x->u));
  PetscCall(test_scene_close(&x->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The second body comes down and tilts; both are a little rough. */
static void come_down(Meeting *x, PetscReal depth)
{
  for (PetscInt i = 0; i < x->s->nnode; i++) {
    const PetscReal *X = x->s->node_x + 3 * i;

    for (int k = 0; k < 3; k++) x->u[3 * i + k] = 1e-3 * noise(x->s->node_orig[i], k, 1);
    if (x->s->node_body[i] == 1) x->u[3 * i + 2] -= depth * (1 + X[0]);
  }
}

static PetscErrorCode attempt(Meeting *x)
{
  PetscFunctionBeginUser;
  PetscCall((*x->e->ops.begin_step)(x->e, x->s, 0, 0.01, x->u0, NULL, x->u));
  SbSpaceClearConstraints(x->s);
  PetscCall((*x->e->ops.assemble_constraints)(x->e, x->s));
  PetscCall(SbSpaceAssembleConstraints(x->s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Begins a step where the bodies are; `deep`: how deep overlap is searched for then, m. */
static PetscErrorCode begin_step(Meeting *x, PetscReal t, PetscReal *deep)
{
  PetscFunctionBeginUser;
  PetscCall((*x->e->ops.begin_step)(x->e, x->s, t, 0.01, x->u0, NULL, x->u0));
  *deep = ((Collision *)x->e->data)->deep;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Points that got into a body unseen are separated after three steps, not after three attempts at one, and as soon when the run is taken up from a
  checkpoint in between. What is taken up where one lies deep in another goes on: it was no error before.
*/
static PetscErrorCode check_patience(void)
{
  Collision *c;
  Meeting x;
  PetscInt n;
  PetscReal *records, deep = 0;

  PetscFunctionBeginUser;
  PetscCall(open_meeting(PAIR("p1", "p1"), "-effect_meet_search_radius 0.01", &x));
  c = (Collision *)x.e->data;
  PetscCall(begin_step(&x, 0, &deep));
  come_down(&x, 0.15);
  PetscCall(PetscArraycpy(x.u0, x.u, 3 * x.s->nnode));
  for (int k = 0; k < 8; k++) PetscCall(begin_step(&x, 1 + k / 4, &deep)); /* in the first their boxes meet */
  SB_CHECK(deep == 0, "after two steps overlap is searched for, %g m deep", (double)deep);
  PetscCall((*x.e->ops.save)(x.e, x.s, &n, &records));
  PetscCall(PetscArrayzero(c->alone, c->surface->scene.npoint));
  PetscCall((*x.e->ops.load)(x.e, x.s, 3, x.u0, n, records));
  PetscCall(PetscFree(records));
  PetscCall(begin_step(&x, 3, &deep));
  SB_CHECK(deep > 0.1, "after three steps overlap is searched for %g m deep", (double)deep);
  PetscCall((*x.e->ops.save)(x.e, x.s, &n, &records));
  for (PetscInt i = 0; i < 3 * x.s->nnode;
       i++) { /* small, and in the middle of the other, where no facet is within reach */
    const PetscReal middle[3] = {0.5, 0.4, 0.15}, *X = x.s->node_x + i - i % 3;

    x.u0[i] = x.s->node_body[i / 3] ? middle[i % 3] + 0.05 * (X[i % 3] - 0.5) - X[i % 3] : 0;
  }
  c->deep = 0;
  PetscCall(PetscFree2(c->way, c->way_part));
  PetscCall((*x.e->ops.load)(x.e, x.s, 4, x.u0, n, records));
  PetscCall(begin_step(&x, 4, &deep));
  PetscCall(PetscFree(records));
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points that were separated from one body and get into another before the first has gone are separated from that. */
static PetscErrorCode check_other_way(void)
{
  Collision *c;
  Meeting x;
  PetscReal deep = 0;
  PetscInt led[2] = {0, 0};

  PetscFunctionBeginUser;
  PetscCall(open_meeting(SETS "-bodies a,b,c" BODY("a", "p1", "box:1,0.8,0.3:3", "0,0,0")
                           BODY("b", "p1", "box:0.6,0.5,0.4:2", "0.2,0.1,0.32")
                             BODY("c", "p1", "box:1,0.8,0.3:3", "0,0,5"),
                         "-effect_meet_search_radius 0.01", &x));
  c = (Collision *)x.e->data;
  for (int k = 0; k < 2; k++) {
    come_down(&x, k ? -4.9 : 0.15);
    for (PetscInt i = 0; i < x.s->nnode; i++) { /* into the third, straight */
      if (k && x.s->node_body[i] == 1) x.u[3 * i + 2] -= 4.9 * x.s->node_x[3 * i];
    }
    PetscCall(PetscArraycpy(x.u0, x.u, 3 * x.s->nnode));
    for (int step = 0; step < 4; step++) PetscCall(begin_step(&x, 4 * k + step, &deep));
    SB_CHECK(deep > 0.1, "overlap is searched for %g m deep", (double)deep);
    for (PetscInt i = 0; i < c->surface->scene.npoint; i++)
      led[k] += c->surface->scene.point_part[i] == 1 && c->way_part[i] == 2 * k;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, led, 2, MPIU_INT, MPI_SUM, x.s->comm));
  SB_CHECK(led[0] > 3 && led[1] > 3, "%d points are separated from the first body, %d of the third",
           (int)led[0], (int)led[1]);
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements of all nodes by their global numbers. */
static PetscErrorCode gather_all(const Meeting *x, PetscReal **all)
{
  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * x->s->Nnode, all));
  for (PetscInt i = 0; i < 3 * x->s->nnode_owned; i++)
    (*all)[3 * (x->s->gnode_start + i / 3) + i % 3] = x->u[i];
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, *all, (PetscMPIInt)(3 * x->s->Nnode), MPIU_REAL, MPI_SUM, x->s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every row: coefficients that sum to zero, n of length one at the point, and the gap that a detector of our own finds. */
static PetscErrorCode check_rows(const char *elements, const char *more)
{
  Collision *c;
  Meeting x;
  PetscReal *all, reach;
  PetscInt total;

  PetscFunctionBeginUser;
  PetscCall(open_meeting(elements, more, &x));
  c = (Collision *)x.e->data;
  come_down(&x, 0.03);
  PetscCall(attempt(&x));
  PetscCall(gather_all(&x, &all));
  total = x.s->constraints->n;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, x.s->comm));
  SB_CHECK(total > 5, "%d rows", (int)total);
  reach = 1e-12 * c->surface->size;
  for (PetscInt i = 0; i < c->nhit; i++) {
    const Hit *hit = &c->hit[i];
    const SbConstraints rows = x.s->constraints;
    PetscReal sum[3] = {0}, at = 0;

    if (hit->row < 0) continue;
    for (PetscInt e = rows->start[hit->row]; e < rows->start[hit->row + 1]; e++) {
      for (int k = 0; k < 3; k++) {
        sum[k] += rows->coef[3 * e + k];
        at += rows->coef[3 * e + k] * all[3 * rows->gnode[e] + k];
      }
    }
    SB_CHECK(PetscSqrtReal(SbDot3(sum, sum)) < 1e-13, "a row makes a net force of %g",
             (double)PetscSqrtReal(SbDot3(sum, sum)));
    SB_CHECK_NEAR(SbDot3(hit->normal, hit->normal), 1, 1e-12, "a row's normal");
    SB_CHECK_NEAR(at - rows->value[hit->row], hit->gap + hit->allowed, reach, "a row's gap");
  }
  PetscCall(PetscFree(all));
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pairs' gaps are those of another detector on a surface of its own. */
static PetscErrorCode check_gaps(const char *elements, const char *more, PetscInt least)
{
  const SbEdgePair *pair;
  const SbNear *near;
  SbDetector detector;
  SbContactSurface surface;
  SbFacet *facet;
  Collision *c;
  Meeting x;
  PetscInt n, npair;
  PetscBool close;

  PetscFunctionBeginUser;
  PetscCall(open_meeting(elements, more, &x));
  c = (Collision *)x.e->data;
  come_down(&x, 0.03);
  PetscCall(attempt(&x));
  PetscCall(SbEffectFacets(x.s, &c->on, &n, &facet));
  PetscCall(SbContactSurfaceCreate(x.s, n, facet, &surface));
  PetscCall(PetscFree(facet));
  PetscCall(SbDetectorCreate(SB_DETECT_BRUTE, &detector));
  PetscCall(SbContactSurfaceUpdate(surface, x.u0, x.u, c->reach, PETSC_FALSE, &close));
  PetscCall(SbDetectorFind(detector, &surface->scene, &n, &near));
  PetscCall(SbDetectorFindEdges(detector, &surface->scene, &npair, &pair));
  SB_CHECK(close && n + npair == c->nhit, "%d pairs, and %d and %d by a detector of our own", (int)c->nhit,
           (int)n, (int)npair);
  for (PetscInt i = 0; i < npair && n + npair == c->nhit; i++) {
    const Hit *hit = &c->hit[n + i];

    SB_CHECK(SbCollisionOfEdges(c, hit) && hit->point - surface->scene.npoint == pair[i].edge[0] &&
               hit->part == surface->scene.edges->id[pair[i].edge[1]],
             "pair of edges %d is another one", (int)i);
    SB_CHECK_NEAR(hit->gap, pair[i].gap, 1e-14, "gap of a pair of edges");
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &npair, 1, MPIU_INT, MPI_SUM, x.s->comm));
  SB_CHECK(npair >= least, "%d pairs of edges", (int)npair);
  for (PetscInt i = 0; i < PetscMin(n, c->nhit); i++) {
    const Hit *hit = &c->hit[i];

    SB_CHECK(hit->point == near[i].point && hit->part == surface->scene.facet_part[near[i].facet],
             "pair %d is another one", (int)i);
    SB_CHECK_NEAR(hit->gap, near[i].gap, 1e-14, "gap of a pair");
  }
  PetscCall(SbContactSurfaceDestroy(&surface));
  PetscCall(SbDetectorDestroy(&detector));
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs by the body whose point looks. */
static PetscErrorCode count_looks(const char *elements, const char *more, PetscInt looks[2])
{
  Collision *c;
  Meeting x;

  PetscFunctionBeginUser;
  looks[0] = looks[1] = 0;
  PetscCall(open_meeting(elements, more, &x));
  c = (Collision *)x.e->data;
  come_down(&x, 0.03);
  PetscCall(attempt(&x));
  for (PetscInt i = 0; i < c->nhit; i++) {
    if (!SbCollisionOfEdges(c, &c->hit[i])) looks[c->surface->scene.point_part[c->hit[i].point]]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, looks, 2, MPIU_INT, MPI_SUM, x.s->comm));
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_sides(void)
{
  PetscInt both[2], one[2];

  PetscFunctionBeginUser;
  PetscCall(count_looks(PAIR("p1", "cr"), "", both));
  PetscCall(count_looks(PAIR("p1", "cr"), "-effect_meet_passes one", one));
  /* facets of b are smaller: 0.6 x 0.5 x 0.4 by 2 against 1 x 0.8 x 0.3 by 3 */
  SB_CHECK(both[0] > 0 && both[1] > 0, "both sides: %d and %d pairs", (int)both[0], (int)both[1]);
  SB_CHECK(one[0] * one[1] == 0 && one[0] + one[1] > 0, "one side: %d and %d pairs", (int)one[0],
           (int)one[1]);
  SB_CHECK((one[0] == both[0] && !one[1]) || (one[1] == both[1] && !one[0]),
           "one side: %d and %d pairs, of %d and %d", (int)one[0], (int)one[1], (int)both[0], (int)both[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ cost, and attempts */

static int nmalloc;
static PetscErrorCode (*real_malloc)(size_t, PetscBool, int, const char[], const char[], void **);
static PetscErrorCode count_malloc(size_t n, PetscBool clear, int line, const char function[],
                                   const char file[], void **p)
{
  nmalloc++;
  return (*real_malloc)(n, clear, line, function, file, p);
}

/* Bodies that are far apart cost a step a few sums over the ranks. */
static PetscErrorCode check_far(void)
{
  PetscBool changed = PETSC_FALSE;
  Meeting x;

  PetscFunctionBeginUser;
  PetscCall(open_meeting(APART, "-effect_meet_friction 0.3", &x));
  PetscCall(attempt(&x));
  real_malloc = PetscTrMalloc;
  PetscTrMalloc = count_malloc;
  nmalloc = 0;
  {
    const PetscLogDouble sums = petsc_allreduce_ct;
    const PetscLogDouble others =
      petsc_isend_ct + petsc_send_ct + petsc_irecv_ct + petsc_recv_ct + petsc_gather_ct;

    PetscCall(attempt(&x));
    PetscCall((*x.e->ops.update_active_set)(x.e, x.s, x.u, x.u, &changed));
    SB_CHECK(petsc_allreduce_ct - sums <= 5, "%g sums over ranks", petsc_allreduce_ct - sums);
    SB_CHECK(petsc_isend_ct + petsc_send_ct + petsc_irecv_ct + petsc_recv_ct + petsc_gather_ct == others,
             "bodies that are apart exchange something");
  }
  PetscTrMalloc = real_malloc;
  SB_CHECK(nmalloc == 0, "%d allocations in a step of bodies that are apart", nmalloc);
  SB_CHECK(!changed && !x.s->constraints->n, "nothing touches");
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An attempt that failed leaves nothing behind: the next one begins with the same rows as if it had been the first. */
static PetscErrorCode check_attempts(const char *response)
{
  char more[256];
  Collision *c;
  Hit *hit;
  Meeting x;
  PetscInt n;
  const SbStage stage = {.t = 0.01, .dt = 0.01};

  PetscFunctionBeginUser;
  PetscCall(
    PetscSNPrintf(more, sizeof(more), "-effect_meet_friction 0.3 -effect_meet_response %s", response));
  PetscCall(open_meeting(PAIR("p1", "cr"), more, &x));
  c = (Collision *)x.e->data;
  come_down(&x, 0.03);
  PetscCall(attempt(&x));
  for (PetscInt i = 0; i < c->nhit; i++) {
    c->hit[i].lambda = c->hit[i].grip.pressing = c->hit[i].on ? 10 : 0;
    c->hit[i].now[0] += 1e-5;
  }
  PetscCall((*x.e->ops.accept)(x.e, x.s, &stage));
  PetscCall(attempt(&x));
  n = c->nhit;
  PetscCall(PetscMalloc1(n, &hit));
  PetscCall(PetscArraycpy(hit, c->hit, n));
  come_down(&x, -0.05); /* far away: everything is lost */
  PetscCall(attempt(&x));
  come_down(&x, 0.03);
  PetscCall(attempt(&x));
  SB_CHECK(n == c->nhit, "%d pairs in the second attempt, %d in the first", (int)c->nhit, (int)n);
  for (PetscInt i = 0; i < PetscMin(n, c->nhit); i++) {
    SB_CHECK(hit[i].point == c->hit[i].point && hit[i].on == c->hit[i].on, "pair %d", (int)i);
    SB_CHECK_NEAR(c->hit[i].allowed, hit[i].allowed, 0, "overlap that is allowed");
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(c->hit[i].grip.stretch[k], hit[i].grip.stretch[k], 0, "stretch");
  }
  PetscCall(PetscFree(hit));
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ a static scene of all elements */

#define LAW(name, element)                                                                          \
  " -body_" name "_material linear -body_" name "_young 1e5 -body_" name "_poisson 0.3 -body_" name \
  "_element " element
#define PRESS                                                                                               \
  "-bodies a,b,c -body_a_mesh box:0.2,0.2,0.05:1 -body_b_mesh box:0.12,0.1,0.05:2 -body_b_translate "       \
  "0.03,0.04,0.05 -body_c_mesh box:0.08,0.06,0.05:1 -body_c_translate 0.05,0.06,0.1" LAW("a", "cr")         \
    LAW("b", "p1") LAW(                                                                                     \
      "c", "dg") " -sets low,top,side -set_side_at plane:1,0,0,0.03 -set_low_at plane:0,0,1,0 -set_top_at " \
                 "plane:0,0,1,0.15 -time static -static_steps 1 -ksp_rtol 1e-12 -snes_rtol 1e-11 "          \
                 "-effects hold,push,side,meet -effect_side_type fixed -effect_side_on side "               \
                 "-effect_side_components xy -effect_hold_type fixed -effect_hold_on low "                  \
                 "-effect_push_type prescribed_displacement -effect_push_on top "                           \
                 "-effect_push_displacement 0;0;-0.001 -effect_meet_type contact "                          \
                 "-effect_meet_response projected"

enum { CONTACTS, DEEPEST, MEAN, NORMAL, FRICTION, WORK, LOSS, HOLD, PUSH, NVALUE };

/* What the effects say of themselves, over all ranks of comm. */
static PetscErrorCode press(MPI_Comm comm, const char *more, PetscReal values[NVALUE])
{
  SbStage stage = {.t = 1, .shift_k = 1};
  PetscReal column[8];
  const PetscReal *r;
  TestScene t;
  Vec R;

  PetscFunctionBeginUser;
  for (int k = 0; k < NVALUE; k++) values[k] = 0;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  PetscCall(PetscOptionsInsertString(NULL, PRESS));
  PetscCall(PetscOptionsInsertString(NULL, more));
  PetscCall(SbSceneCreate(comm, &t.model));
  PetscCall(test_scene_run(&t));
  PetscCall(SbModelSetUp(t.model));
  PetscCall(SbRunSetUp(t.run));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->stop_reason[0], "%s", t.run->stop_reason);
  PetscCall(VecDuplicate(t.run->U, &R));
  PetscCall(SbModelResidual(t.model, 1, t.run->U, NULL, NULL, PETSC_FALSE, R));
  PetscCall(SbSpaceComputeConstraintForces(t.model->space, t.run->U, R));
  PetscCall(SbSpaceGetLocalRead(t.model->space, R, &r));
  PetscCall(SbSpaceGetLocalRead(t.model->space, t.run->U, &stage.u));
  for (PetscInt e = 0; e < t.model->neffect; e++) {
    const SbEffect effect = t.model->effect[e];

    for (int k = 0; k < 8; k++) column[k] = 0;
    PetscCall((*effect->ops.history)(effect, t.model->space, &stage, r, column));
    if (effect->ops.begin_step)
      for (int k = 0; k <= LOSS; k++) values[k] = column[k];
    else if (strcmp(effect->name, "side"))
      values[!strcmp(effect->name, "hold") ? HOLD : PUSH] = column[2];
  }
  PetscCall(SbSpaceRestoreLocalRead(t.model->space, t.run->U, &stage.u));
  PetscCall(SbSpaceRestoreLocalRead(t.model->space, R, &r));
  PetscCall(VecDestroy(&R));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, values, NVALUE, MPIU_REAL, MPI_SUM, comm));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same numbers on all ranks together and on one; what holds the stack carries what presses it. */
static PetscErrorCode check_press(const char *more)
{
  static const char *const name[NVALUE] = {"contacts",      "penetration", "mean",
                                           "normal force",  "friction",    "work",
                                           "friction loss", "fixed",       "prescribed_displacement"};
  PetscReal together[NVALUE], alone[NVALUE];

  PetscFunctionBeginUser;
  PetscCall(press(PETSC_COMM_WORLD, more, together));
  PetscCall(press(PETSC_COMM_SELF, more, alone));
  SB_CHECK(alone[CONTACTS] > 5 && alone[NORMAL] > 1, "%g contacts with %g N", (double)alone[CONTACTS],
           (double)alone[NORMAL]);
  SB_CHECK_NEAR(together[CONTACTS], alone[CONTACTS], 0, name[CONTACTS]);
  for (int k = NORMAL; k < NVALUE; k++) /* gaps are closed to 1e-7 of the size, 0.25 m */
    SB_CHECK_NEAR(together[k], alone[k],
                  (k == WORK || k == LOSS ? 2.5e-8 : 1e-7) * PetscAbsReal(alone[NORMAL]), name[k]);
  SB_CHECK_NEAR(alone[HOLD], -alone[PUSH], 1e-8 * PetscAbsReal(alone[PUSH]), "what carries the stack");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ gaps */

/* Two blocks, the upper one 4 mm lower than at rest, 6 mm above the other: gaps of its lower side and of the upper side there. */
static PetscErrorCode check_gap_field(void)
{
  const PetscReal *g, z0 = 0.06, down = 0.004;
  PetscInt seen[3] = {0, 0, 0};
  PetscScalar *u;
  Meeting x;
  Vec U, G;

  PetscFunctionBeginUser;
  PetscCall(open_meeting("-bodies a,b -body_a_mesh box:0.1,0.1,0.05:2 -body_b_mesh box:0.06,0.06,0.05:2 "
                         "-body_b_translate 0.02,0.02,0.06" LAW("a", "p1") LAW("b", "p1"),
                         " -effects meet,floor -effect_floor_type contact -effect_floor_response projected "
                         "-effect_floor_on b -effect_floor_obstacle plane:0,0,1,-1",
                         &x));
  for (PetscInt i = 0; i < x.s->nnode; i++) x.u[3 * i + 2] = x.s->node_body[i] == 1 ? -down : 0;
  PetscCall(attempt(&x));
  PetscCall(SbSpaceCreateVec(x.s, &U));
  PetscCall(VecDuplicate(U, &G));
  PetscCall(VecGetArray(U, &u));
  PetscCall(PetscArraycpy(u, x.u, 3 * x.s->nnode_owned));
  PetscCall(VecRestoreArray(U, &u));
  PetscCall(SbModelContactGap(x.t.model, 0, U, G));
  PetscCall(VecGetArrayRead(G, &g));
  for (PetscInt i = 0; i < x.s->nnode_owned; i++) {
    const PetscReal *X = x.s->node_x + 3 * i;
    const PetscBool upper = (PetscBool)(x.s->node_body[i] == 1), low = (PetscBool)(X[2] < z0 + 1e-9);
    const PetscBool under = (PetscBool)(X[0] > 0.03 && X[0] < 0.07 && X[1] > 0.03 && X[1] < 0.07);

    SB_CHECK_NEAR(PetscSqrtReal(SbDot3(g + 3 * i, g + 3 * i)), PetscAbsReal(g[3 * i + 2]), 1e-12,
                  "a gap is along z");
    if (upper && low) {
      seen[0]++;
      SB_CHECK_NEAR(g[3 * i + 2], z0 - down - 0.05, 1e-12, "gap of the lower side");
    } else if (upper && X[2] > z0 + 0.02 &&
               X[0] < 0.02 + 1e-9) { /* of the floor, which sees the whole body */
      seen[1]++;
      SB_CHECK_NEAR(g[3 * i + 2], X[2] - down + 1, 1e-12, "gap from the floor");
    } else if (!upper && under && X[2] > 0.05 - 1e-9) {
      seen[2]++;
      SB_CHECK_NEAR(g[3 * i + 2], -(z0 - down - 0.05), 1e-12, "gap of the upper side");
    }
  }
  PetscCall(VecRestoreArrayRead(G, &g));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, seen, 3, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(seen[0] == 9 && seen[1] > 0 && seen[2] > 0, "%d, %d, %d nodes with a gap", (int)seen[0],
           (int)seen[1], (int)seen[2]);
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&G));
  PetscCall(close_meeting(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_refused());
  PetscCall(check_rows(PAIR("p1", "cr"), ""));
  PetscCall(check_rows(PAIR("dg", "p1"), "-effect_meet_passes one"));
  PetscCall(check_rows(CROSS("p1", "dg"), ""));
  PetscCall(check_gaps(PAIR("cr", "dg"), "", 0));
  PetscCall(check_gaps(CROSS("p1", "cr"), "", 3));
  PetscCall(check_gaps(CROSS("p1", "cr"), "-effect_meet_detection brute", 3));
  PetscCall(check_sides());
  PetscCall(check_far());
  PetscCall(check_patience());
  PetscCall(check_other_way());
  PetscCall(check_attempts("projected"));
  PetscCall(check_attempts("penalty"));
  PetscCall(check_gap_field());
  PetscCall(check_press(""));
  PetscCall(check_press("-effect_meet_response multiplier"));
  SB_TEST_END();
}
