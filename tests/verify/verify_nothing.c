// @ranks 1 2
/*
  Features that a scene does not use cost nothing.

    lists       without effects the model has no effect, all lists of operations are empty, and the
    log events of effects
                and contact are never begun, while that of forces is
    memory      a scene allocates the same number of bytes whether the program has an unused effect
    type or not, and
                the type's options are not read
    trajectory  bitwise the same motion with that type in the program; with effects that do nothing
    too elements    with P1 only there are no data of CR and DG: no neighbours, no face terms, no
    second node list; the node arrays
                are those of the mesh. With or without the option, the run is the same in every bit
                and byte. Next to a body of another element a P1 body moves as alone, up to rounding
    linear      a linear run assembles its tangent once; a static run has no mass, no velocity and
    no integrator
*/
#include "../../src/fem/fem_impl.h"
#include "verify.h"

/* An effect type that no scene names. Its options must not be read. */
static int storms;

static PetscErrorCode options_storm(SbEffect e, const SbScope *scope)
{
  PetscFunctionBeginUser;
  (void)e;
  (void)scope;
  storms++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbEffectType storm_type = {.name = "storm", .ops = {.setfromoptions = options_storm}};

typedef struct {
  PetscInt n;
  PetscReal *u, *v;
  PetscInt events[SB_EVENT_COUNT]; /* number of times that each phase began */
  PetscLogDouble bytes;            /* allocated by the scene, before and after the run */
} Trace;

static PetscErrorCode count_events(PetscInt count[])
{
  PetscInt nstage = 3; /* the main stage of PETSc and those of SbLogInitialize() */

  PetscFunctionBeginUser;
  for (int e = 0; e < SB_EVENT_COUNT; e++) {
    count[e] = 0;
    for (PetscInt stage = 0; stage <= nstage; stage++) {
      PetscEventPerfInfo info;

      PetscCall(PetscLogEventGetPerfInfo((int)stage, SbEvents[e], &info));
      count[e] += info.count;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode run(const char *options, PetscBool storm, Trace *trace)
{
  TestScene t;
  PetscLogDouble before, after;
  PetscInt first[SB_EVENT_COUNT];

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  if (storm)
    PetscCall(SbEffectRegister(&storm_type));
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(count_events(first));
  PetscCall(PetscMallocGetCurrentUsage(&before));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &t.model));
  PetscCall(test_scene_run(&t));
  PetscCall(SbModelSetUp(t.model));
  PetscCall(SbRunSetUp(t.run));
  PetscCall(verify_solve(&t, options));
  PetscCall(PetscMallocGetCurrentUsage(&after));
  PetscCall(count_events(trace->events));
  for (int e = 0; e < SB_EVENT_COUNT; e++)
    trace->events[e] -= first[e];
  trace->bytes = after - before;
  trace->n = verify_numbers(t.model);
  trace->v = NULL;
  PetscCall(verify_gather(t.model, t.run->state.U, &trace->u));
  if (t.run->state.V)
    PetscCall(verify_gather(t.model, t.run->state.V, &trace->v));
  if (!strstr(options, "-effects")) {
    const SbModel m = t.model;

    SB_CHECK(!m->neffect && !m->nprescribe && !m->nforce && !m->ntangent && !m->naccept &&
               !m->nhistory,
             "a scene without effects has entries in its lists");
    SB_CHECK(!m->space->nfixed && !t.run->solve.damped && !t.run->monitors.n &&
               !t.run->monitors.output && !t.run->state.loads && !t.run->state.reaction,
             "something else exists");
  }
  if (strstr(options, "static"))
    SB_CHECK(!t.run->state.V && !t.run->state.A && !t.run->solve.ts,
             "a static run has an integrator");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy(Trace *trace)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(trace->u));
  PetscCall(PetscFree(trace->v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define FREE                                                                        \
  "-bodies a -body_a_mesh box:0.3,0.2,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 " \
  "-body_a_density 1000 "                                                           \
  "-body_a_velocity 0.3,-0.2,0.1 -body_a_angular_velocity 1,2,6 -ts_dt 0.01 -ts_max_time 0.2 "

/* A free body with and without an effect type that is not named. */
static PetscErrorCode check_unnamed(const char *law, const char *time)
{
  Trace plain, with;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), FREE "-body_a_material %s -time %s", law, time));
  PetscCall(run(text, PETSC_FALSE, &plain));
  PetscCall(run(text, PETSC_TRUE, &with));
  SB_CHECK(!storms, "the constructor of a type that is not named was called");
  SB_CHECK(plain.events[SB_EVENT_EFFECTS] == 0, "effects were begun %d times",
           (int)plain.events[SB_EVENT_EFFECTS]);
  SB_CHECK(plain.events[SB_EVENT_CONTACT] == 0, "contact was begun %d times",
           (int)plain.events[SB_EVENT_CONTACT]);
  SB_CHECK(plain.events[SB_EVENT_RESIDUAL] > 0, "forces were never begun: the log is off");
  SB_CHECK(!plain.events[SB_EVENT_ENERGY] && !plain.events[SB_EVENT_OUTPUT] &&
             !plain.events[SB_EVENT_CHECKPOINT],
           "energies, output or checkpoints that nobody asked for");
  SB_CHECK(plain.bytes == with.bytes, "%g bytes, and %g with another type in the program",
           plain.bytes, with.bytes);
  SB_CHECK(!memcmp(plain.u, with.u, sizeof(PetscReal) * 3 * (size_t)plain.n) &&
             !memcmp(plain.v, with.v, sizeof(PetscReal) * 3 * (size_t)plain.n),
           "%s, %s: the trajectory changes with a type that is not named", law, time);
  for (int e = 0; e < SB_EVENT_COUNT; e++) {
    SB_CHECK(plain.events[e] == with.events[e], "event %d: %d and %d", e, (int)plain.events[e],
             (int)with.events[e]);
  }
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  %-10s %-16s: %d evaluations of forces, %d tangents, no effect, %.0f bytes\n", law, time,
    (int)plain.events[SB_EVENT_RESIDUAL], (int)plain.events[SB_EVENT_TANGENT], plain.bytes));
  if (!strcmp(law, "linear") && strncmp(time, "euler_s", 7))
    SB_CHECK(plain.events[SB_EVENT_TANGENT] == 1, "%d tangents of a linear run",
             (int)plain.events[SB_EVENT_TANGENT]);
  PetscCall(destroy(&plain));
  PetscCall(destroy(&with));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Effects that are named but do nothing. */
static PetscErrorCode check_idle(const char *effects, const char *options)
{
  Trace plain, with;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(run(FREE "-body_a_material corotated -time newmark", PETSC_FALSE, &plain));
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          FREE "-body_a_material corotated -time newmark -effects %s %s", effects,
                          options));
  PetscCall(run(text, PETSC_FALSE, &with));
  SB_CHECK(!memcmp(plain.u, with.u, sizeof(PetscReal) * 3 * (size_t)plain.n) &&
             !memcmp(plain.v, with.v, sizeof(PetscReal) * 3 * (size_t)plain.n),
           "%s changes the trajectory by %g", effects,
           verify_difference(3 * plain.n, plain.u, with.u));
  test_print("  idle %-8s: trajectory the same to the last bit; effects begun %d times\n", effects,
             (int)with.events[SB_EVENT_EFFECTS]);
  PetscCall(destroy(&plain));
  PetscCall(destroy(&with));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Space of a P1 scene, with its plan. */
static PetscErrorCode check_plain_space(void)
{
  TestScene t;
  SbSpace s;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(FREE "-body_a_material corotated -time newmark", &t));
  s = t.model->space;
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A));
  SB_CHECK(!s->faces && !s->mesh->neighbour && !s->dirichlet_node && !s->jump && !s->batch_weight &&
             s->width == 4,
           "a space of vertices holds something of faces");
  SB_CHECK(s->node_body == s->mesh->vert_body && s->node_set == s->mesh->vert_set &&
             s->node_orig == s->mesh->vert_orig,
           "a space of vertices has copies of what the mesh holds");
  SB_CHECK(s->plan && !s->plan->face_term[0] && !s->plan->face_term[1], "the plan has face terms");
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An explicit run: no solver tolerance affects the comparison. */
static PetscErrorCode check_elements(const char *law, const char *other)
{
  Trace plain, named, beside;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          FREE "-body_a_material %s -time euler_symplectic -ts_dt 0.0005", law));
  PetscCall(run(text, PETSC_FALSE, &plain));
  PetscCall(PetscStrlcat(text, " -body_a_element p1", sizeof(text)));
  PetscCall(run(text, PETSC_FALSE, &named));
  SB_CHECK(plain.bytes == named.bytes, "%g bytes, and %g with the element named", plain.bytes,
           named.bytes);
  SB_CHECK(!memcmp(plain.u, named.u, sizeof(PetscReal) * 3 * (size_t)plain.n) &&
             !memcmp(plain.v, named.v, sizeof(PetscReal) * 3 * (size_t)plain.n),
           "%s: the trajectory changes when the element is named", law);
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    FREE "-body_a_material %s -time euler_symplectic -ts_dt 0.0005 -bodies a,b "
         "-body_b_mesh box:0.1,0.1,0.1:1 -body_b_translate 0,0,9 -body_b_material linear "
         "-body_b_young 1e3 -body_b_poisson 0.3 -body_b_density 1000 -body_b_element %s",
    law, other));
  PetscCall(run(text, PETSC_FALSE, &beside));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  %-10s beside %s: the p1 body moves as alone, but for %.1e and %.1e\n",
                        law, other, verify_difference(3 * plain.n, plain.u, beside.u),
                        verify_difference(3 * plain.n, plain.v, beside.v)));
  SB_CHECK(verify_difference(3 * plain.n, plain.u, beside.u) < 1e-12 &&
             verify_difference(3 * plain.n, plain.v, beside.v) < 1e-12,
           "%s: a body of %s changes the trajectory of one of p1", law, other);
  PetscCall(destroy(&plain));
  PetscCall(destroy(&named));
  PetscCall(destroy(&beside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Trace first, named, trace;

  /* the count of bytes requires PETSc's own malloc */
  (void)setenv("PETSC_OPTIONS", "-malloc_dump", 1);
  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscLogDefaultBegin());

  /* the first run that needs them sets up parts of PETSc, linear or with Newton's method, and the
     log event of each material */
  PetscCall(
    run(FREE "-body_a_material linear -time newmark -solver cg_jacobi", PETSC_FALSE, &first));
  PetscCall(destroy(&first));
  PetscCall(run(FREE "-body_a_material corotated -time euler_implicit", PETSC_FALSE, &first));
  PetscCall(destroy(&first));
  PetscCall(run(FREE "-body_a_material stable_neohookean -time genalpha", PETSC_FALSE, &first));
  PetscCall(destroy(&first));
  PetscCall(
    run(FREE "-body_a_material stvk -time euler_symplectic -ts_dt 0.002", PETSC_FALSE, &first));
  PetscCall(destroy(&first));

  /* MUMPS distributes its work anew in each run: the last bits differ */
  PetscCall(check_unnamed("linear", "newmark -solver cg_jacobi"));
  PetscCall(check_unnamed("corotated", "euler_implicit"));
  PetscCall(check_unnamed("stable_neohookean", "genalpha"));
  PetscCall(check_unnamed("stvk", "euler_symplectic -ts_dt 0.002"));
  PetscCall(check_idle("gravity", "-effect_gravity_vector 0,0,0"));
  PetscCall(check_idle("damping", ""));
  PetscCall(check_idle(
    "pull", "-effect_pull_type traction -effect_pull_on xmin -effect_pull_vector 0;0;0"));
  PetscCall(check_idle("air", "-effect_air_type pressure -effect_air_on zmax -effect_air_value 0"));

  /* contact search occurs only if contact is named: its log event counts there, so that a count of
     zero elsewhere is meaningful */
  PetscCall(run(FREE "-body_a_material corotated -time euler_implicit -effects floor "
                     "-effect_floor_type contact -effect_floor_response projected "
                     "-effect_floor_obstacle plane:0,0,1,-9",
                PETSC_FALSE, &named));
  SB_CHECK(named.events[SB_EVENT_CONTACT] > 0, "contact is named and was never begun");
  PetscCall(destroy(&named));
  PetscCall(
    run("-bodies a -body_a_mesh box:0.3,0.2,0.1:2 -body_a_material linear -body_a_young 1e5 "
        "-body_a_poisson 0.3 -body_a_density 1000 -effects clamp -effect_clamp_type fixed "
        "-effect_clamp_on xmin -time static",
        PETSC_FALSE, &trace));
  SB_CHECK(trace.events[SB_EVENT_EFFECTS] == 0,
           "a support is no force: effects were begun %d times",
           (int)trace.events[SB_EVENT_EFFECTS]);
  PetscCall(destroy(&trace));
  PetscCall(check_plain_space());
  PetscCall(check_elements("stable_neohookean", "cr"));
  PetscCall(check_elements("corotated", "dg"));
  PetscCall(check_elements("stable_neohookean", "p2"));
  SB_TEST_END();
}
