// @ranks 1 2
/*
  Two cubes that begin half in each other, which no reach of contact sees at once: the depth is found, all points get the same separation direction (a smaller cube
  in a face: ways to one side), the depth is taken back by the option's steps, and
  the bodies part with no more than twice the energy M v^2 of a bar that is pushed with the speed v at which it is taken back. Momentum stays. A
  body that begins within reach of the other but not in it is not touched. No point is inside for long without a pair.

  A finger ten layers of cells deep in a block has one separation direction, along itself, and so have the ends of a bar that is bent into itself.
*/
#include "../../src/effect/collision.h"
#include "contact.h"

#define SIZE 0.1
#define DEPTH 0.05
#define STEP 0.004
#define STEPS 30 /* of recovery */

typedef struct {
  PetscReal first, depth, energy, momentum, torque; /* depth after a step and after STEPS of them, m */
  PetscReal contacts, agreement, pairs;
  PetscInt alone;   /* most steps that a point has been inside without a pair */
  PetscInt *inside; /* [npoint] the part that it is in */
  PetscInt *steps;  /* [npoint] how long so */
  SbInside look;
} Overlap;

/* How long points have been inside that no pair holds. */
static PetscErrorCode watch_alone(SbRun run, const SbStep *step, Overlap *o)
{
  const Collision *c = (const Collision *)contact_effect(run->model, "meet")->data;
  const PetscInt n = c->surface->scene.npoint;
  const PetscReal *u;

  PetscFunctionBeginUser;
  if (!o->look) {
    PetscCall(SbInsideCreate(c->surface, &o->look));
    PetscCall(PetscCalloc2(n, &o->inside, n, &o->steps));
  }
  PetscCall(SbSpaceGetLocalRead(run->model->space, step->U, &u));
  PetscCall(SbInsideFind(o->look, u, PETSC_FALSE, o->inside));
  PetscCall(SbSpaceRestoreLocalRead(run->model->space, step->U, &u));
  for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
    if (c->hit[i].part == o->inside[c->hit[i].point]) o->inside[c->hit[i].point] = -1;
  }
  for (PetscInt i = 0; i < n; i++) {
    o->steps[i] = o->inside[i] < 0 ? 0 : o->steps[i] + 1;
    o->alone = PetscMax(o->alone, o->steps[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The least cosine between the normal of a pair that is behind and the mean one of the same body, after the first step. */
static PetscErrorCode agreement(SbRun run, PetscReal *least, PetscReal *pairs)
{
  const Collision *c = (const Collision *)contact_effect(run->model, "meet")->data;
  PetscReal mean[6] = {0};

  PetscFunctionBeginUser;
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
      const Hit *hit = &c->hit[i];
      PetscReal *m = mean + 3 * c->surface->scene.point_part[hit->point];

      if (hit->gap > -0.1 * DEPTH) continue;
      *pairs += !pass;
      if (pass)
        *least = PetscMin(*least, SbDot3(m, hit->normal) / PetscSqrtReal(SbDot3(m, m)));
      else
        for (int k = 0; k < 3; k++) m[k] += hit->normal[k];
    }
    if (!pass) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mean, 6, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, least, 1, MPIU_REAL, MPI_MIN, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, pairs, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Overlap *o = (Overlap *)ctx;
  PetscReal depth, contacts;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  o->energy = PetscMax(o->energy, e.kinetic + e.strain);
  for (int k = 0; k < 3; k++) o->momentum = PetscMax(o->momentum, PetscAbsReal(e.momentum[k]));
  PetscCall(contact_column(run, step->t, "meet", "penetration", &depth));
  PetscCall(contact_column(run, step->t, "meet", "contacts", &contacts));
  if (step->step == 1) {
    o->first = depth;
    PetscCall(agreement(run, &o->agreement, &o->pairs));
  }
  if (step->step == STEPS) o->depth = depth;
  o->contacts = contacts;
  PetscCall(watch_alone(run, step, o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, const char *detection, PetscReal shift, const char *turn)
{
  const PetscReal v = DEPTH * (1 - PetscExpReal(-1. / STEPS)) / STEP, mass = 2 * 1000 * PetscPowReal(SIZE, 3);
  const PetscBool apart = (PetscBool)(shift >= SIZE), vertices = (PetscBool)(element[0] == 'p');
  Overlap o = {.agreement = 1};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:3 -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate %g,0,0 %s "
    "-body_a_material corotated -body_a_young 1e5 -body_a_poisson 0.3 -body_a_element %s "
    "-body_b_material corotated -body_b_young 1e5 -body_b_poisson 0.3 -body_b_element %s -effects meet "
    "-effect_meet_type contact -effect_meet_response projected -effect_meet_detection %s "
    "-effect_meet_separation_steps %d -time euler_implicit -ts_dt %g -ts_max_time 0.48 -snes_rtol 1e-9",
    (double)shift, turn, element, element, detection, STEPS, STEP));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &o, NULL));
  PetscCall(verify_solve(&t, "overlap"));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  %s, %s, %g m apart: %.3f of the depth after a step, %.3f after %d, energy %.3g J of %.3g "
                "allowed, momentum %.1e, cosine %.2f, %g pairs at the end, alone for %d steps\n",
                element, detection, (double)shift, (double)(o.first / DEPTH), (double)(o.depth / DEPTH),
                STEPS, (double)o.energy, (double)(mass * v * v), (double)o.momentum, (double)o.agreement,
                (double)o.contacts, (int)o.alone));
  SB_CHECK(o.alone <= 3, "a point is inside without a pair for %d steps", (int)o.alone);
  PetscCall(SbInsideDestroy(&o.look));
  PetscCall(PetscFree2(o.inside, o.steps));
  SB_CHECK(o.contacts == 0, "%g pairs still touch", (double)o.contacts);
  SB_CHECK(o.momentum < 1e-9, "momentum %g kg m/s", (double)o.momentum);
  if (apart)
    SB_CHECK(o.energy < 1e-20, "bodies that do not touch get %g J", (double)o.energy);
  else {
    /* corners move out by the sides, too: less than the whole depth is left */
    /* separation directions lead to one side; the nearest places do to all */
    SB_CHECK(o.agreement > 0.2 && o.pairs > 4, "normals differ: cosine %g", (double)o.agreement);
    if (vertices && !turn[0])
      SB_CHECK_NEAR(o.first / DEPTH, PetscExpReal(-1. / STEPS), 0.02, "depth after a step");
    SB_CHECK(o.first > 0.5 * DEPTH && o.depth < 0.6 * o.first, "%g m, then %g m deep", (double)o.first,
             (double)o.depth);
    SB_CHECK(o.energy < 2 * mass * v * v && o.energy > 0.01 * mass * v * v, "energy %g J", (double)o.energy);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is deep inside, and how it is separated. */
typedef struct {
  PetscInt inside, led,
    behind; /* points in tets; with a separation direction of there; with a pair that is behind along it */
  PetscReal deepest,
    least; /* of these, m; the least cosine between a way of the first body and the given one */
} Ways;

/* Looks for overlap at displacements u. `out`: the separation direction for points of the first body. */
static PetscErrorCode look_for_ways(SbModel m, const PetscReal u[], const PetscReal out[3], Ways *w)
{
  SbEffect e = contact_effect(m, "meet");
  Collision *c = (Collision *)e->data;
  const SbDetectScene *s = &c->surface->scene;
  PetscInt *part, count[3] = {0};
  PetscReal most[2] = {0, -1};

  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(c->u0, u, 3 * m->space->nnode));
  PetscCall(SbCollisionFindOverlap(e, u));
  PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
  PetscCall(PetscMalloc1(s->npoint, &part));
  PetscCall(SbInsideFind(c->inside, u, c->self, part));
  for (PetscInt i = 0; i < s->npoint; i++) {
    if (part[i] < 0) continue;
    count[0]++;
    if (!c->way || c->way_part[i] != part[i]) continue;
    count[1]++;
    if (!s->point_part[i]) most[1] = PetscMax(most[1], -SbDot3(c->way + 3 * i, out));
  }
  for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
    if (part[c->hit[i].point] != c->hit[i].part || c->hit[i].gap >= 0) continue;
    count[2]++;
    most[0] = PetscMax(most[0], -c->hit[i].gap);
  }
  PetscCall(PetscFree(part));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, m->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPI_MAX, m->comm));
  *w = (Ways){count[0], count[1], count[2], most[0], -most[1]};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A finger of 2 x 2 x 20 cells, half of it in a block, through its top. */
static PetscErrorCode check_finger(const char *element)
{
  const PetscReal up[3] = {0, 0, 1};
  PetscReal *u;
  TestScene t;
  Ways w;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.02,0.02,0.2:2,2,20 -body_a_translate 0.041,0.0392,0.1 "
    "-body_b_mesh box:0.1,0.1,0.2:4,4,8 -body_a_material corotated -body_a_young 1e5 -body_a_poisson 0.3 "
    "-body_b_material corotated -body_b_young 1e5 -body_b_poisson 0.3 -body_a_element %s -body_b_element %s "
    "-effects meet -effect_meet_type contact -effect_meet_response projected "
    "-effect_meet_search_radius 0.005 -ts_dt 1e-3",
    element, element));
  PetscCall(PetscCalloc1(3 * t.run->model->space->nnode, &u));
  PetscCall(look_for_ways(t.run->model, u, up, &w));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  finger, %s: %d points inside, %d with a separation direction, %d seen along it, "
                        "deepest %g m, cosine %.3f\n",
                        element, (int)w.inside, (int)w.led, (int)w.behind, (double)w.deepest,
                        (double)w.least));
  SB_CHECK(w.inside > 80 && w.led == w.inside && w.behind == w.inside, "%d inside, %d led, %d seen",
           (int)w.inside, (int)w.led, (int)w.behind);
  SB_CHECK(w.least > 0.9 && w.deepest > 0.095 && w.deepest < 0.11, "deepest %g m, cosine %g",
           (double)w.deepest, (double)w.least);
  PetscCall(PetscFree(u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar bent to more than a ring, wider on one side, so that its ends are in each other. */
static PetscErrorCode check_ring(const char *element)
{
  PetscReal *u;
  SbSpace space;
  TestScene t;
  Ways w;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:2,0.2,0.1:40,4,2 -body_a_material corotated -body_a_young 1e5 "
    "-body_a_poisson 0.3 -body_a_element %s -effects meet -effect_meet_type contact "
    "-effect_meet_response projected -effect_meet_self yes -effect_meet_search_radius 0.02 -ts_dt 1e-3",
    element));
  space = t.run->model->space;
  PetscCall(PetscCalloc1(3 * space->nnode, &u));
  for (PetscInt i = 0; i < space->nnode; i++) {
    const PetscReal *X = space->node_x + 3 * i, turn = (2 * PETSC_PI + 0.7) / 2;
    const PetscReal r = 1 / turn + X[2] + 0.03 * X[0];

    u[3 * i] = r * PetscSinReal(turn * X[0]) - X[0];
    u[3 * i + 2] = r * PetscCosReal(turn * X[0]) - X[2];
  }
  PetscCall(look_for_ways(t.run->model, u, (const PetscReal[3]){0, 0, 0}, &w));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  ring, %s: %d points inside, %d with a separation direction, %d seen along it\n",
                        element, (int)w.inside, (int)w.led, (int)w.behind));
  /* what lies less deep than half the reach has the nearest place */
  SB_CHECK(w.inside > 20 && 2 * w.led > w.inside && w.behind > 0.9 * (PetscReal)w.inside,
           "%d inside, %d led, %d seen", (int)w.inside, (int)w.led, (int)w.behind);
  PetscCall(PetscFree(u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a run may begin with: `inside`, whether points are in the other body; else it would be an error that they are and have no separation direction. */
static PetscErrorCode check_begins(const char *name, const char *options, PetscBool inside)
{
  PetscReal *u;
  TestScene t;
  Ways w;

  PetscFunctionBeginUser;
  PetscCall(verify_open(&t,
                        "-bodies a,b -body_a_material corotated -body_a_young 1e5 -body_a_poisson 0.3 "
                        "-body_b_material corotated -body_b_young 1e5 -body_b_poisson 0.3 -effects meet "
                        "-effect_meet_type contact -effect_meet_response projected -ts_dt 1e-3 %s",
                        options));
  PetscCall(PetscCalloc1(3 * t.run->model->space->nnode, &u));
  PetscCall(look_for_ways(t.run->model, u, (const PetscReal[3]){0, 0, 0}, &w));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %s: %d points inside\n", name, (int)w.inside));
  SB_CHECK((w.inside > 0) == inside, "%s: %d points inside", name, (int)w.inside);
  PetscCall(PetscFree(u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("p1", "tree", DEPTH, ""));
  PetscCall(
    check("p1", "brute", 0.07,
          "-body_b_mesh box:0.06,0.06,0.06:2 -body_b_translate 0.06,0.02,0.03 -body_b_rotate 1,2,3,5"));
  PetscCall(check("p1", "brute", DEPTH, "-effect_meet_self yes"));
  PetscCall(check("cr", "tree", DEPTH, ""));
  PetscCall(check("p1", "tree", SIZE + 0.001, ""));
  PetscCall(check_finger("p1"));
  PetscCall(check_finger("dg"));
  PetscCall(check_ring("p1"));
  PetscCall(check_ring("cr"));
  PetscCall(check_begins("beside each other, tops only",
                         "-body_a_mesh box:1,1,1:4 -body_b_mesh box:1,1,0.6:4,4,3 -body_b_translate 1,0.1,0 "
                         "-sets high,low -set_high_at plane:0,0,1,1 -set_low_at plane:0,0,1,0.6 "
                         "-effect_meet_on high,low",
                         PETSC_FALSE));
  PetscCall(check_begins(
    "a little in each other, tops only",
    "-body_a_mesh box:1,1,1:4 -body_b_mesh box:1,1,0.6:4,4,3 -body_b_translate 0.9999,0.1,0 -sets high,low "
    "-set_high_at plane:0,0,1,1 -set_low_at plane:0,0,1,0.6 -effect_meet_on high,low",
    PETSC_TRUE));
  PetscCall(
    check_begins("a coarse tip, which does not look",
                 "-body_a_mesh box:1,1,1:12 -body_b_mesh box:1,1,1:1 -body_b_rotate 1,-1,0,54.7356 "
                 "-body_b_translate 0.53,0.52,0.99 -effect_meet_passes one -effect_meet_search_radius 0.01",
                 PETSC_TRUE));
  SB_TEST_END();
}
