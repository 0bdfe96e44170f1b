/*
  effect_fixture.h - a small scene for the tests of effects: boxes, sets, the space; and comparison
  functions.

  The unit box "block" is box:1,1,1:2, or a mesh given by the test. Materials come from the options
  -body_<name>_young and so on, which fixture_create() sets. The same scene can be created on
  PETSC_COMM_SELF next to the parallel one: their fields are compared by original node number.

  fixture_use() sets the element of the next scenes, and whether their first set is constrained:
  then DG faces in it have supports.
*/
#pragma once
#include "test.h"
#include <sbeffect.h>
#include <sbsurface.h>

typedef struct {
  PetscInt nbody, nset;
  SbBody *body; /* [nbody] */
  SbSet *set;   /* [nset] */
  SbMaterial material[2];
  SbElement element[2];
  SbMesh mesh;
  SbSpace space;
  PetscReal *u, *f; /* [nnode][3] displacement and force, local */
} Fixture;

/* Elements of "block" and "other" in the scenes to come. */
static const char *fixture_element[2] = {"p1", "p1"};
static PetscBool fixture_held = PETSC_FALSE;

static inline void fixture_use(const char *block, const char *other, PetscBool held)
{
  fixture_element[0] = block;
  fixture_element[1] = other;
  fixture_held = held;
}

#define DENSITY 1200.0 /* kg/m^3, of every body */

static inline PetscErrorCode fixture_register(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbLogInitialize());
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(SbOptionsRegister("body", "", PETSC_DECIDE, SbTetRows));
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbSpaceRows));
  PetscCall(SbMaterialRegisterAll());
  PetscCall(SbElementRegisterAll());
  PetscCall(SbEffectRegister(&SbEffectGravity));
  PetscCall(SbEffectRegister(&SbEffectBodyForce));
  PetscCall(SbEffectRegister(&SbEffectTraction));
  PetscCall(SbEffectRegister(&SbEffectPressure));
  PetscCall(SbEffectRegister(&SbEffectCavity));
  PetscCall(SbEffectRegister(&SbEffectPointForce));
  PetscCall(SbEffectRegister(&SbEffectFoundation));
  PetscCall(SbEffectRegister(&SbEffectWater));
  PetscCall(SbEffectRegister(&SbEffectTie));
  PetscCall(SbEffectRegister(&SbEffectSpring));
  PetscCall(SbEffectRegister(&SbEffectCable));
  PetscCall(SbEffectRegister(&SbEffectFixed));
  PetscCall(SbEffectRegister(&SbEffectPrescribedDisplacement));
  PetscCall(SbEffectRegister(&SbEffectDamping));
  PetscCall(SbEffectRegister(&SbEffectTorque));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scene of bodies "block" and "other" (at a distance of 3 m along x), and the sets given as "name
   shape" texts. */
static inline PetscErrorCode fixture_create(MPI_Comm comm, PetscInt nbody, const char *mesh,
                                            PetscInt nset, const char *const sets[][2], Fixture *x)
{
  static const char *const names[] = {"block", "other"};

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(x, sizeof(*x)));
  x->nbody = nbody;
  x->nset = nset;
  PetscCall(PetscCalloc1(nbody, &x->body));
  PetscCall(PetscCalloc1(nset, &x->set));
  for (PetscInt b = 0; b < nbody; b++) {
    SbBody *body = &x->body[b];
    SbScope scope;
    char options[256];

    PetscCall(PetscStrncpy(body->name, names[b], sizeof(body->name)));
    PetscCall(PetscStrncpy(body->mesh, mesh, sizeof(body->mesh)));
    PetscCall(PetscStrncpy(body->element, fixture_element[b], sizeof(body->element)));
    PetscCall(PetscStrncpy(body->material, "linear", sizeof(body->material)));
    body->scale = 1;
    body->rotate[2] = 1;
    body->translate[0] = 3 * (PetscReal)b;
    body->density = DENSITY;
    PetscCall(PetscSNPrintf(options, sizeof(options),
                            "-body_%s_young 1e5 -body_%s_poisson 0.3 -body_%s_density %g", names[b],
                            names[b], names[b], DENSITY));
    PetscCall(PetscOptionsInsertString(NULL, options));
    SbScopeSet(&scope, "body", "linear", names[b]);
    PetscCall(SbMaterialCreate("linear", &scope, &x->material[b]));
    PetscCall(SbElementCreate(body->element, NULL, &x->element[b]));
    body->other_nodes = (PetscBool)(!x->element[b]->nodes_per[0] || x->element[b]->nodes_per[1]);
  }
  for (PetscInt k = 0; k < nset; k++) {
    PetscCall(SbSetParse(sets[k][0], sets[k][1], &x->set[k]));
    PetscCall(PetscStrncpy(x->set[k].name, sets[k][0], sizeof(x->set[k].name)));
    x->set[k].prescribed = (PetscBool)(fixture_held && k == 0);
  }
  PetscCall(SbMeshCreate(comm, nbody, x->body, nset, x->set, &x->mesh));
  PetscCall(SbSpaceCreate(x->mesh, x->material, x->element, &x->space));
  PetscCall(PetscCalloc2(3 * x->space->nnode, &x->u, 3 * x->space->nnode, &x->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Destroys the scene, and clears the options of it and of its effects. */
static inline PetscErrorCode fixture_destroy(Fixture *x)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(x->u, x->f));
  PetscCall(SbSpaceDestroy(&x->space));
  PetscCall(SbMeshDestroy(&x->mesh));
  for (PetscInt b = 0; b < x->nbody; b++) {
    PetscCall(SbMaterialDestroy(&x->material[b]));
    PetscCall(SbElementDestroy(&x->element[b]));
  }
  PetscCall(PetscFree(x->body));
  PetscCall(PetscFree(x->set));
  PetscCall(PetscOptionsClear(NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates an effect from options and sets it up. */
static inline PetscErrorCode effect_create(Fixture *x, const char *name, const char *options,
                                           SbEffect *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(SbEffectCreate(name, e));
  if ((*e)->ops.setup)
    PetscCall((*(*e)->ops.setup)(*e, x->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x->f = force of the effect at time t and displacement x->u. */
static inline PetscErrorCode effect_force(Fixture *x, SbEffect e, PetscReal t)
{
  const SbStage stage = {.t = t, .shift_k = 1, .u = x->u};

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(x->f, 3 * x->space->nnode));
  PetscCall((*e->ops.force)(e, x->space, &stage, x->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Total force F, N, and moment M about the origin at the current positions, N m: owned nodes of all
   ranks. */
static inline PetscErrorCode resultant(const Fixture *x, PetscReal F[3], PetscReal M[3])
{
  PetscReal sum[6] = {0};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < x->space->nnode_owned; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];
    const PetscReal *u = &x->u[3 * i];
    const PetscReal *f = &x->f[3 * i];
    const PetscReal p[3] = {X[0] + u[0], X[1] + u[1], X[2] + u[2]};

    for (int c = 0; c < 3; c++) {
      sum[c] += f[c];
      sum[3 + c] += p[(c + 1) % 3] * f[(c + 2) % 3] - p[(c + 2) % 3] * f[(c + 1) % 3];
    }
  }
  PetscCallMPI(MPI_Allreduce(sum, F, 3, MPIU_REAL, MPI_SUM, x->space->comm));
  PetscCallMPI(MPI_Allreduce(sum + 3, M, 3, MPIU_REAL, MPI_SUM, x->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks force and moment against exact values; `scale` is the size of the single contributions,
   N. */
static inline PetscErrorCode check_resultant(const Fixture *x, const PetscReal F[3],
                                             const PetscReal M[3], PetscReal scale,
                                             const char *what)
{
  PetscReal sum[3], moment[3];

  PetscFunctionBeginUser;
  PetscCall(resultant(x, sum, moment));
  // Some hundred additions of numbers of this size: rounding stays far below 1e-12 of it.
  for (int c = 0; c < 3; c++) {
    SB_CHECK_NEAR(sum[c], F[c], 1e-12 * scale, what);
    SB_CHECK_NEAR(moment[c], M[c], 1e-12 * scale, what);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The owned part of `parallel` (f of a scene on all ranks) equals that of the same scene on one
   rank. */
static inline PetscErrorCode check_serial(const Fixture *parallel, const Fixture *serial,
                                          PetscReal scale, const char *what)
{
  PetscInt *where;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(serial->mesh->Nvert + 14 * serial->mesh->Ncell, &where));
  for (PetscInt i = 0; i < serial->space->nnode; i++)
    where[serial->space->node_orig[i]] = i;
  for (PetscInt i = 0; i < parallel->space->nnode_owned; i++) {
    const PetscInt j = where[parallel->space->node_orig[i]];

    for (int c = 0; c < 3; c++)
      SB_CHECK_NEAR(parallel->f[3 * i + c], serial->f[3 * j + c], 1e-12 * scale, what);
  }
  PetscCall(PetscFree(where));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A smooth displacement that bends, twists and stretches, m; amplitude 1 gives strains of about a
   half. */
static inline void deform(Fixture *x, PetscReal amplitude)
{
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];

    x->u[3 * i + 0] = amplitude * (0.3 * X[1] * X[2] + 0.2 * X[0] + 0.1 * PetscSinReal(3 * X[1]));
    x->u[3 * i + 1] = amplitude * (-0.4 * X[0] * X[2] + 0.2 * PetscCosReal(2 * X[0]));
    x->u[3 * i + 2] = amplitude * (0.25 * X[0] * X[0] - 0.15 * X[2] + 0.1 * X[1] * X[0]);
  }
}

/* A scene of one body on all ranks, and the same on each rank alone. */
typedef struct {
  Fixture all, alone;
} FixturePair;

static inline PetscErrorCode fixture_pair_create(PetscInt nbody, PetscInt nset,
                                                 const char *const sets[][2], FixturePair *p)
{
  PetscFunctionBeginUser;
  PetscCall(fixture_create(PETSC_COMM_WORLD, nbody, "box:1,1,1:2", nset, sets, &p->all));
  PetscCall(fixture_create(PETSC_COMM_SELF, nbody, "box:1,1,1:2", nset, sets, &p->alone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode fixture_pair_destroy(FixturePair *p)
{
  PetscFunctionBeginUser;
  PetscCall(fixture_destroy(&p->all));
  PetscCall(fixture_destroy(&p->alone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A load and what it sums to. Its options stay set for the cases behind it. */
typedef struct {
  const char *name, *options;
  PetscBool steady;
  PetscReal t, scale; /* s; size of the contributions, N */
  PetscReal F[3], M[3];
  PetscReal amplitude; /* of the displacement at which it acts: a dead load does not follow it */
} LoadCase;

/* Dead loads: linear, steady or not, their force and moment, the same at each node on any number of
   ranks; also after other times. */
static inline PetscErrorCode check_loads(FixturePair *p, size_t n, const LoadCase cases[])
{
  PetscFunctionBeginUser;
  for (const LoadCase *c = cases; c < cases + n; c++) {
    SbEffect e, alone;

    PetscCall(effect_create(&p->all, c->name, c->options, &e));
    PetscCall(effect_create(&p->alone, c->name, "", &alone));
    SB_CHECK(e->linear && e->steady == c->steady && !e->ops.tangent, "%s: linear %d, steady %d",
             c->options, e->linear, e->steady);
    PetscCall(effect_force(&p->all, e, c->t + 0.25));
    PetscCall(effect_force(&p->all, e, c->t));
    PetscCall(effect_force(&p->alone, alone, c->t));
    PetscCall(check_resultant(&p->all, c->F, c->M, c->scale, c->options));
    PetscCall(check_serial(&p->all, &p->alone, c->scale, c->options));
    if (c->amplitude > 0) {
      deform(&p->all, c->amplitude);
      PetscCall(effect_force(&p->all, e, c->t));
      PetscCall(check_serial(&p->all, &p->alone, c->scale, "dead load"));
      deform(&p->all, 0);
    }
    PetscCall(SbEffectDestroy(&e));
    PetscCall(SbEffectDestroy(&alone));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An effect that its options or its sets refuse. */
static inline PetscErrorCode check_effect_refused(Fixture *x, const char *name, const char *options,
                                                  const char *names)
{
  SbEffect e;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(effect_create(x, name, options, &e), PETSC_ERR_USER_INPUT, names);
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y[owned nodes][3] = A w. Collective. */
static inline PetscErrorCode fixture_apply(Fixture *x, Mat A, const PetscReal w[], PetscReal y[])
{
  Vec W, Y;
  PetscReal *array;
  const PetscReal *result;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(x->space, &W));
  PetscCall(SbSpaceCreateVec(x->space, &Y));
  PetscCall(VecGetArray(W, &array));
  PetscCall(PetscArraycpy(array, w, 3 * x->space->nnode_owned));
  PetscCall(VecRestoreArray(W, &array));
  PetscCall(MatMult(A, W, Y));
  PetscCall(VecGetArrayRead(Y, &result));
  PetscCall(PetscArraycpy(y, result, 3 * x->space->nnode_owned));
  PetscCall(VecRestoreArrayRead(Y, &result));
  PetscCall(VecDestroy(&W));
  PetscCall(VecDestroy(&Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}
