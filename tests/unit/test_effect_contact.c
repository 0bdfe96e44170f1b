/*
  Contact effect: options and their errors, incompatible settings, a scene without contact, the
  tangent of contact springs against finite differences of the force, and Coulomb's law in the
  friction constraints.
*/
// @ranks 1 3
#include "../scene.h"
#include "effect_fixture.h"

#define FLOOR                                                                           \
  "-effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle " \
  "plane:0,0,1,0.01 "

static const char *const hull[][2] = {{"boundary", "boundary"}};

/* ------------------------------------------------------------------ options */

static PetscErrorCode check_options(void)
{
  static const struct {
    const char *options, *names;
    PetscErrorCode code;
  } refused[] = {
    {"-effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle "
     "ball:1,2,3,4",
     "-effect_floor_obstacle ball:1,2,3,4", PETSC_ERR_USER_INPUT},
    {FLOOR "-effect_floor_response glue", "-effect_floor_response glue|projected", PETSC_ERR_USER},
    {FLOOR "-effect_floor_friction -1", "-effect_floor_friction -1", PETSC_ERR_USER},
    {FLOOR "-effect_floor_friction 0.2 -effect_floor_friction_kinetic 0.3",
     "-effect_floor_friction_kinetic 0.3", PETSC_ERR_USER_INPUT},
    {FLOOR "-effect_floor_restitution 1.5", "-effect_floor_restitution 1.5", PETSC_ERR_USER},
    {FLOOR "-effect_floor_damping 0.01", "-effect_floor_damping 0.01 s", PETSC_ERR_USER_INPUT},
    {FLOOR "-effect_floor_restitution 0.5 -effect_floor_response penalty",
     "-effect_floor_restitution 0.5|-effect_floor_response projected", PETSC_ERR_USER_INPUT},
    {FLOOR "-effect_floor_separation_steps 0.5", "-effect_floor_separation_steps 0.5",
     PETSC_ERR_USER},
    {"-effect_floor_type contact -effect_floor_obstacle mesh:no.stl",
     "-effect_floor_obstacle|no.stl", PETSC_ERR_FILE_OPEN},
    {FLOOR "-effect_floor_time_of_impact yes -effect_floor_restitution 0.5",
     "-effect_floor_restitution 0.5|-effect_floor_time_of_impact yes", PETSC_ERR_USER_INPUT},
    {FLOOR "-effect_floor_axis 0,0,0", "-effect_floor_axis|0,0,0", PETSC_ERR_USER_INPUT},
    {FLOOR "-effect_floor_displacement x;0;0", "-effect_floor_displacement", PETSC_ERR_USER_INPUT},
  };
  Fixture x;
  SbEffect e = NULL;

  PetscFunctionBeginUser;
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", 1, hull, &x));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(refused); k++) {
    SB_CHECK_ERROR(effect_create(&x, "floor", refused[k].options, &e), refused[k].code,
                   refused[k].names);
    PetscCall(SbEffectDestroy(&e));
    PetscCall(PetscOptionsClear(NULL));
  }
  PetscCall(effect_create(&x, "floor", FLOOR, &e));
  SB_CHECK(e->linear && !e->steady && !e->ops.tangent && e->contact->ops->assemble_constraints &&
             e->contact->ops->update_active_set && x.space->constraints &&
             !SbConstraintsSeparate(x.space),
           "projected, without friction");
  SB_CHECK(e->ncolumn == 8, "columns");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(fixture_destroy(&x));

  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", 1, hull, &x));
  PetscCall(effect_create(&x, "floor", FLOOR "-effect_floor_response multiplier", &e));
  SB_CHECK(e->linear && e->contact->saddle && !e->ops.tangent &&
             e->contact->ops->assemble_constraints && SbConstraintsSeparate(x.space),
           "multiplier, without friction");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(fixture_destroy(&x));

  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", 1, hull, &x));
  PetscCall(effect_create(&x, "floor", FLOOR "-effect_floor_response penalty", &e));
  SB_CHECK(!e->linear && e->ops.tangent && !e->contact->ops->assemble_constraints &&
             !e->contact->ops->update_active_set && !x.space->constraints,
           "penalty");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(effect_create(&x, "floor", FLOOR "-effect_floor_friction 0.2", &e));
  SB_CHECK(e->linear && !e->ops.tangent && e->contact->ops->assemble_constraints &&
             SbConstraintsSeparate(x.space) && x.space->constraints->nonsymmetric,
           "friction has constraints");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ forces and tangent */

/* Shear and a slight twist with a displacement into the obstacle: some nodes slip, some stick. */
static void push(Fixture *x, PetscReal amplitude)
{
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];

    x->u[3 * i] = amplitude * (0.3 * X[1] * X[1] + 0.01 * X[0]);
    x->u[3 * i + 1] = amplitude * 0.2 * X[0] * X[1];
    x->u[3 * i + 2] = -0.02 - 0.01 * X[0];
  }
}

/* Begins a step at zero displacement, then takes the displacement of push() as a solution. */
static PetscErrorCode press(Fixture *x, SbEffect e)
{
  PetscBool changed = PETSC_FALSE;
  PetscReal *u0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * x->space->nnode, &u0));
  PetscCall((*e->contact->ops->begin_step)(e->contact, x->space, 0, 0.1, 0, u0));
  PetscCall((*e->contact->ops->start_active_set)(e->contact, x->space, u0));
  push(x, 1);
  if (e->contact->ops->update_active_set)
    PetscCall((*e->contact->ops->update_active_set)(e->contact, x->space, x->u, &changed));
  PetscCall(PetscFree(u0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode to_vec(const Fixture *x, const PetscReal values[], Vec v)
{
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(v, &a));
  for (PetscInt i = 0; i < 3 * x->space->nnode_owned; i++)
    a[i] = values[i];
  PetscCall(VecRestoreArray(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact force at u + h w, w a smooth field. */
static PetscErrorCode force_beside(Fixture *x, SbEffect e, PetscReal h, Vec F)
{
  PetscFunctionBeginUser;
  push(x, 1);
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];

    x->u[3 * i] += h * (0.3 + X[1]);
    x->u[3 * i + 1] += h * (X[0] - 0.4 * X[1]);
    x->u[3 * i + 2] += h * (X[0] * X[1] - 0.2);
  }
  PetscCall(effect_force(x, e, 0.1));
  PetscCall(to_vec(x, x->f, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On a plane the tangent is the derivative of the force. */
static PetscErrorCode check_tangent(const char *element, const char *options)
{
  const PetscReal h = 1e-6;
  SbStage stage = {.t = 0.1, .shift_k = 1};
  Fixture x;
  SbEffect e;
  PetscReal difference, size;
  Vec w, more, less;
  Mat A;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", 1, hull, &x));
  PetscCall(effect_create(&x, "floor", options, &e));
  PetscCall(SbSpacePrescribeDone(x.space));
  PetscCall(SbSpaceCreateMatrix(x.space, SB_MATRIX_AIJ, &A));
  PetscCall(press(&x, e));
  stage.u = x.u;
  x.space->block_scale = 1;
  PetscCall(MatZeroEntries(A));
  PetscCall((*e->ops.tangent)(e, x.space, &stage, A));
  PetscCall(SbSpaceFinishTangent(x.space, A));
  PetscCall(SbSpaceCreateVec(x.space, &w));
  PetscCall(VecDuplicate(w, &more));
  PetscCall(VecDuplicate(w, &less));
  PetscCall(force_beside(&x, e, h, more));
  PetscCall(force_beside(&x, e, -h, less));
  for (PetscInt i = 0; i < x.space->nnode; i++) {
    const PetscReal *X = &x.space->node_x[3 * i];

    x.u[3 * i] = 0.3 + X[1];
    x.u[3 * i + 1] = X[0] - 0.4 * X[1];
    x.u[3 * i + 2] = X[0] * X[1] - 0.2;
  }
  PetscCall(to_vec(&x, x.u, w));
  PetscCall(VecAXPY(more, -1, less));
  PetscCall(VecScale(more, 0.5 / h));
  PetscCall(MatMult(A, w, less));
  PetscCall(VecNorm(less, NORM_2, &size));
  PetscCall(VecAXPY(less, 1, more));
  PetscCall(VecNorm(less, NORM_2, &difference));
  SB_CHECK(size > 1 && difference < 1e-6 * size,
           "%s, %s: tangent and differences are %g of %g apart", element, options, difference,
           size);
  PetscCall(VecDestroy(&w));
  PetscCall(VecDestroy(&more));
  PetscCall(VecDestroy(&less));
  PetscCall(MatDestroy(&A));
  PetscCall(SbEffectDestroy(&e));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Friction forces of the constraints at a displacement, after three updates of the active set. */
static PetscErrorCode rub(Fixture *x, const char *options)
{
  SbEffect e;
  PetscBool changed;
  PetscReal *u0;

  PetscFunctionBeginUser;
  PetscCall(effect_create(x, "floor", options, &e));
  PetscCall(SbSpacePrescribeDone(x->space));
  PetscCall(PetscCalloc1(3 * x->space->nnode, &u0));
  push(x, 0.15);
  PetscCall((*e->contact->ops->begin_step)(e->contact, x->space, 0, 0.1, 0, u0));
  PetscCall((*e->contact->ops->start_active_set)(e->contact, x->space, x->u));
  for (int solve = 0; solve < 3; solve++) {
    SbSpaceClearConstraints(x->space);
    for (int across = 0; across < 2; across++)
      PetscCall((*e->contact->ops->assemble_constraints)(e->contact, x->space, (PetscBool)across));
    PetscCall(SbSpaceAssembleConstraints(x->space));
    SbConstraintsComputeForces(x->space, x->u, x->f);
    PetscCall((*e->contact->ops->update_active_set)(e->contact, x->space, x->u, &changed));
  }
  PetscCall(PetscArrayzero(x->f, 3 * x->space->nnode));
  SbConstraintsAddForces(x->space, x->f);
  PetscCall(PetscFree(u0));
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coulomb's cone at every node, friction opposite to the motion, and the same result on any number
   of ranks. */
static PetscErrorCode check_friction(const char *element)
{
  const char *options = FLOOR "-effect_floor_response penalty -effect_floor_friction 0.4 "
                              "-effect_floor_friction_kinetic 0.4";
  Fixture x, alone;
  PetscInt count[2] = {0, 0}; /* nodes that slip, that stick */

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:3", 1, hull, &x));
  PetscCall(rub(&x, options));
  for (PetscInt i = 0; i < x.space->nnode_owned; i++) {
    const PetscReal *f = x.f + 3 * i;
    const PetscReal *u = x.u + 3 * i;
    const PetscReal t = PetscSqrtReal(f[0] * f[0] + f[1] * f[1]);
    const PetscReal s = PetscSqrtReal(u[0] * u[0] + u[1] * u[1]);

    if (f[2] <= 0) {
      SB_CHECK(t == 0 && x.space->node_x[3 * i + 2] > 1e-9, "a node off the floor feels nothing");
      continue;
    }
    SB_CHECK(t <= 0.4 * f[2] * (1 + 1e-12), "friction %g at a normal force of %g", t, f[2]);
    SB_CHECK(f[0] * u[0] + f[1] * u[1] <= -0.999999 * s * t, "friction pulls back");
    count[t <= 0.4 * f[2] * (1 - 1e-12)]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(count[0] > 0 && count[1] > 0, "%d nodes slip, %d stick", (int)count[0], (int)count[1]);
  PetscCall(fixture_create(PETSC_COMM_SELF, 1, "box:1,1,1:3", 1, hull, &alone));
  PetscCall(rub(&alone, options));
  PetscCall(check_serial(&x, &alone, 1e5, "friction"));
  PetscCall(fixture_destroy(&alone));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ in a scene */

#define BLOCK                                                                        \
  "-bodies a -body_a_mesh box:1,1,1:2 -body_a_material corotated -body_a_young 1e5 " \
  "-body_a_poisson 0.3 "                                                             \
  "-body_a_density 1000 -ts_dt 0.01 -ts_max_time 0.02 "

static PetscErrorCode open_only(const char *options)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &t));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_scene(void)
{
  PetscEventPerfInfo before, info;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscLogDefaultBegin());
  PetscCall(test_scene_open(BLOCK "-effects gravity,floor " FLOOR, &t));
  SB_CHECK(t.model->contacts.nactive_set == 1 && t.model->contacts.nconstraint == 1 &&
             t.model->contacts.active_set[0]->ops->update_active_set && t.model->space->constraints,
           "a scene with contact");
  PetscCall(SbRunSolve(t.run));
  PetscCall(PetscLogEventGetPerfInfo(PETSC_DETERMINE, SbEvents[SB_EVENT_CONTACT], &before));
  SB_CHECK(before.count > 0, "contact is logged");
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_open(BLOCK "-effects gravity", &t));
  SB_CHECK(!t.model->contacts.nactive_set && !t.model->contacts.nconstraint &&
             !t.model->contacts.n && !t.model->space->constraints,
           "a scene without contact has nothing of it");
  PetscCall(SbRunSolve(t.run));
  PetscCall(PetscLogEventGetPerfInfo(PETSC_DETERMINE, SbEvents[SB_EVENT_CONTACT], &info));
  SB_CHECK(info.count == before.count, "%d events of contact without contact",
           info.count - before.count);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_refused(void)
{
  static const char *const cases[][2] = {
    {"-time euler_symplectic ", "effect floor"},
    {"-time alpha2 ", "effect floor"},
    {"-time newmark -effect_floor_response penalty ", "-time newmark|effect floor"},
    {"-time newmark -effect_floor_friction 0.3 ", "-time newmark|effect floor"},
    {"-time newmark -mass consistent ", "-time newmark|effect floor|-mass lumped"},
    {"-time genalpha -effect_floor_restitution 0.5 ",
     "-effect_floor_restitution|-time euler_implicit"},
    {"-body_a_tangent warped -solver realtime ", "-solver realtime|effect floor"},
    {"-body_a_element cr -solver pressure ", "-solver pressure"},
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    char options[2048];

    PetscCall(PetscSNPrintf(options, sizeof(options), BLOCK "-effects gravity,floor " FLOOR "%s",
                            cases[k][0]));
    SB_CHECK_ERROR(open_only(options), PETSC_ERR_USER_INPUT, cases[k][1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(SbEffectRegister(&SbEffectContact));
  PetscCall(check_options());
  PetscCall(check_tangent("p1", FLOOR "-effect_floor_response penalty"));
  PetscCall(check_tangent("cr", FLOOR "-effect_floor_response augmented"));
  PetscCall(check_tangent("dg", FLOOR "-effect_floor_response augmented"));
  PetscCall(check_tangent("p2", FLOOR "-effect_floor_response penalty"));
  PetscCall(check_friction("p1"));
  PetscCall(check_friction("p2"));
  PetscCall(check_friction("cr"));
  PetscCall(check_scene());
  PetscCall(check_refused());
  SB_TEST_END();
}
