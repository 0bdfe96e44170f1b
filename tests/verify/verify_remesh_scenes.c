// @ranks 1 2
/*
  Re-meshing with contact, supports, several materials, and failures.

    touch      the same nodes are in contact before and after, with the same forces, friction and
    normals: a plane and another body runs       bodies that are re-meshed during contact: momentum,
    penetration, energy, final state
    inclusion  the mass of each material is unchanged, also if the inclusion is a shape whose
    boundary new tets would cross held       cr, dg and p2 on a support, with adaptive steps
    ledger     error estimates continue, and -accuracy selects time steps
    failed     -remesh_failed: one attempt for each state, then the run stops with the reason; not
    if the first step fails
*/
#include "../../src/ledger/ledger_impl.h"
#include "../../src/remesh/remesh_impl.h"
#include "../remesh.h"

#define STUFF(b)                                                              \
  " -body_" #b "_material stable_neohookean -body_" #b "_young 2e4 -body_" #b \
  "_poisson 0.3 -body_" #b "_density 1000 "
#define FLOOR                                                                           \
  "-bodies a -body_a_mesh box:0.2,0.15,0.1:4,3,2 -body_a_translate 0,0,0.002" STUFF(    \
    a) "-body_a_velocity 0.5,0,-0.3 -effects weight,floor -effect_weight_type gravity " \
       "-effect_floor_type contact -effect_floor_response projected "                   \
       "-effect_floor_obstacle plane:0,0,1,0 -ts_dt 0.005 "
#define PAIR                                                                                       \
  "-bodies a,b -body_a_mesh box:0.2,0.2,0.2:3,3,3 -body_b_mesh box:0.2,0.2,0.2:4,4,4 "             \
  "-body_b_translate 0.202,0.03,0.02" STUFF(a) STUFF(                                              \
    b) "-body_a_velocity 0.5,0,0 -body_b_velocity -0.5,0,0 -effects hit -effect_hit_type contact " \
       "-ts_dt 0.005 "
#define BEAM                                                                               \
  "-bodies a -body_a_mesh box:0.4,0.1,0.1:6,2,2" STUFF(                                    \
    a) "-sets end -set_end_at plane:1,0,0,0 -effects hold,weight -effect_hold_type fixed " \
       "-effect_hold_on end -effect_weight_type gravity "

/* ------------------------------------------------------------------ contact nodes */

/* Checkpoint records of an effect from all ranks, sorted, without its sums. */
typedef struct {
  PetscInt n;
  PetscReal *r; /* [n][nstate] */
} Records;

static int by_name(const void *a, const void *b)
{
  const PetscReal p = *(const PetscReal *)a;
  const PetscReal q = *(const PetscReal *)b;

  return p < q ? -1 : p > q;
}

static PetscErrorCode gather(SbEffect e, SbSpace space, Records *all)
{
  PetscMPIInt size, mine, count[16], offset[16];
  PetscMPIInt total = 0;
  PetscReal *own;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(space->comm, &size));
  PetscCheck(size <= 16, space->comm, PETSC_ERR_SUP, "at most 16 ranks");
  SbEffectCall(e, save, space, &n, &own);
  mine = (PetscMPIInt)(n * e->nstate);
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, count, 1, MPI_INT, space->comm));
  for (PetscMPIInt k = 0; k < size; total += count[k++])
    offset[k] = total;
  PetscCall(PetscMalloc1(total, &all->r));
  PetscCallMPI(MPI_Allgatherv(own, mine, MPIU_REAL, all->r, count, offset, MPIU_REAL, space->comm));
  PetscCall(PetscFree(own));
  all->n = total / e->nstate;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sorts the records by their names. */
static void put_in_order(SbEffect e, Records *all)
{
  qsort(all->r, (size_t)all->n, (size_t)e->nstate * sizeof(PetscReal), by_name);
}

/* Creates the second scene: the first one with body a remeshed by the default mesher. */
static PetscErrorCode hand_over(TestScene *a, TestScene *b, SbRemeshResult *result)
{
  const SbRemeshing how = {.mesher = SbMesherDefault, .size = 1., .quality = 1e-3};
  const PetscBool due[2] = {PETSC_TRUE, PETSC_FALSE};
  SbRenamed *renamed = &result->renamed;
  SbGathered g;

  PetscFunctionBeginUser;
  PetscCall(SbGather(a->run, &g));
  PetscCall(SbRemeshResultCreate(&g, result));
  if (!test_rank)
    PetscCall(SbRemeshBodies(a->model, &g, due, 1, &how, result));
  if (!test_rank)
    SB_CHECK(!result->outcome[0].message[0], "%s", result->outcome[0].message);
  PetscCallMPI(MPI_Bcast(&renamed->n, 1, MPIU_INT, 0, PETSC_COMM_WORLD));
  if (test_rank)
    PetscCall(PetscMalloc2(renamed->n, &renamed->from, renamed->n, &renamed->to));
  PetscCallMPI(MPI_Bcast(renamed->from, (PetscMPIInt)renamed->n, MPIU_INT, 0, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Bcast(renamed->to, (PetscMPIInt)renamed->n, MPIU_INT, 0, PETSC_COMM_WORLD));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &b->model));
  PetscCall(SbRunCreate(b->model, &b->run));
  for (PetscInt k = 0; k < a->model->nbody; k++) {
    if (test_rank)
      PetscCall(SbMemoryMeshCreate(0, 0, 0, 0, &result->in_memory[k]));
    if (test_rank && !k)
      result->in_memory[0]->mass = g.mass[0];
    b->model->body[k].in_memory = result->in_memory[k];
    result->in_memory[k] = NULL;
  }
  PetscCall(SbModelSetUp(b->model));
  PetscCall(SbRunSetUp(b->run));
  PetscCall(SbRunTransferState(a->run, b->run));
  PetscCall(SbScatter(&result->next, b->run));
  PetscCall(SbEffectsHandOver(a->run, b->run, renamed));
  PetscCall(SbGatheredDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Runs until bodies are in contact; the last effect is checked. */
static PetscErrorCode check_touch(const char *scene)
{
  TestScene a;
  TestScene b = {NULL, NULL, NULL, NULL};
  SbRemeshResult result;
  Records before, after;
  PetscReal worst = 0.;
  PetscReal scale = 0.;
  PetscInt last, named;
  SbEffect e;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(scene, &a));
  PetscCall(test_scene_solve(&a));
  last = a.model->neffect - 1;
  e = a.model->effect[last];
  PetscCall(hand_over(&a, &b, &result));
  PetscCall(gather(e, a.model->space, &before));
  put_in_order(e, &before);

  /* the new numbers of their nodes */
  named = 0;
  for (PetscInt i = 0, place; i < before.n; i++) {
    PetscCall(PetscFindInt((PetscInt)before.r[e->nstate * i], result.renamed.n, result.renamed.from,
                           &place));
    if (place >= 0)
      before.r[e->nstate * i] = (PetscReal)result.renamed.to[place];
    named += place >= 0;
  }
  put_in_order(e, &before);
  PetscCall(gather(b.model->effect[last], b.model->space, &after));
  put_in_order(e, &after);
  SB_CHECK(before.n > 5 && before.n == named && after.n == named,
           "'%s': %d nodes touch, %d renamed, then %d", scene, (int)before.n, (int)named,
           (int)after.n);
  for (PetscInt i = 0; i < e->nstate * PetscMin(before.n, after.n); i++) {
    worst = PetscMax(worst, PetscAbsReal(after.r[i] - before.r[i]));
    scale = PetscMax(scale, PetscAbsReal(before.r[i]));
  }
  SB_CHECK(worst <= 1e-12 * scale, "'%s': what touching nodes remember has changed by %g of %g",
           scene, worst, scale);
  PetscCall(PetscFree(before.r));
  PetscCall(PetscFree(after.r));
  PetscCall(SbRemeshResultDestroy(&result));
  PetscCall(test_scene_close(&a));
  PetscCall(test_scene_close(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ runs */

/* Largest penetration that the last effect reports, m. */
static PetscErrorCode penetration(SbRun run, const char *name, PetscReal *depth)
{
  const SbModel m = run->model;
  const SbEffect e = m->effect[m->neffect - 1];
  SbStage stage = {.shift_k = 1.};
  PetscReal *values;

  PetscFunctionBeginUser;
  *depth = -1.;
  PetscCall(PetscCalloc1(e->ncolumn, &values));
  PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &stage.u));
  PetscCall((*e->ops.history)(e, m->space, &stage, NULL, values));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &stage.u));
  for (PetscInt k = 0; k < e->ncolumn; k++)
    if (!strcmp(e->column[k], name))
      *depth = values[k];
  PetscCall(PetscFree(values));
  PetscCallMPI(MPI_Bcast(depth, 1, MPIU_REAL, 0, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest depth of a node below z = 0. */
static PetscErrorCode below(SbModel m, Vec U, PetscReal *depth)
{
  const PetscScalar *u;

  PetscFunctionBeginUser;
  *depth = 0.;
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++)
    *depth = PetscMax(*depth, -m->space->node_x[3 * i + 2] - u[3 * i + 2]);
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, depth, 1, MPIU_REAL, MPI_MAX, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* pair: two bodies without external forces, whose momenta cancel. */
static PetscErrorCode check_run(const char *scene, PetscBool pair, PetscReal end)
{
  PetscReal depth, scale, lost, drift;
  SbEnergies e;
  TestScene s;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(scene, &s));
  s.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(test_scene_solve(&s));
  e = s.run->state.energies;
  scale = s.run->state.energy_start;
  SB_CHECK(!s.run->clock.stop_reason[0] && PetscAbsReal(s.run->clock.t - end) < 1e-9,
           "'%s' ends at %g s: %s", scene, s.run->clock.t, s.run->clock.stop_reason);
  SB_CHECK(s.model->body[0].in_memory && e.remesh_loss != 0., "'%s' was not re-meshed", scene);
  SB_CHECK(PetscAbsReal(e.remesh_loss) < 0.1 * scale, "'%s': %g of %g J by re-meshing", scene,
           e.remesh_loss, scale);
  lost = scale + e.load_work + e.prescribed_work - e.kinetic - e.strain - e.remesh_loss;
  SB_CHECK(lost > -0.01 * scale && lost < scale + PetscAbsReal(e.load_work),
           "'%s' has lost %g of %g J", scene, lost, scale);
  SB_CHECK(e.ninverted == 0, "'%s': %d tets inverted", scene, (int)e.ninverted);
  if (pair)
    PetscCall(penetration(s.run, "penetration", &depth));
  else
    PetscCall(below(s.model, s.run->state.U, &depth));
  SB_CHECK(depth >= 0. && depth < (strstr(scene, " dg") ? 4e-3 : 1e-3), "'%s': %g m deep", scene,
           depth);
  drift = PetscMax(PetscAbsReal(e.momentum[0]),
                   PetscMax(PetscAbsReal(e.momentum[1]), PetscAbsReal(e.momentum[2])));
  SB_CHECK(!pair || drift < 1e-5, "'%s': momentum %g kg m/s", scene, drift);
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ inclusions */

static PetscErrorCode masses(SbModel m, PetscReal mass[3])
{
  const SbSpace s = m->space;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    mass[k] = 0.;
  for (PetscInt b = 0; b < s->nbatch; b++) {
    for (PetscInt i = 0; i < s->batch_n[b]; i++) {
      const PetscInt c = s->batch_cell[b] + i;

      if (c < m->mesh->ncell_owned)
        mass[m->mesh->cell_material[c]] += s->batch_V[b][i];
    }
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    mass[2] += s->node_mass[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mass, 3, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_inclusion(const char *more)
{
  PetscReal before[3], after[3];
  TestScene s;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &s,
    "-bodies a -body_a_mesh box:0.2,0.2,0.2:5,5,5" STUFF(
      a) "-body_a_angular_velocity 0,3,1 -sets core -set_core_at sphere:0.1,0.1,0.1,0.075 "
         "-body_a_inclusions core -inclusion_core_material stable_neohookean -inclusion_core_young "
         "1e5 "
         "-inclusion_core_poisson 0.3 -inclusion_core_density 3000 -ts_dt 0.01 -ts_max_time 0.03 "
         "-remesh_times 0.01,0.02 %s",
    more));
  PetscCall(masses(s.model, before));
  PetscCall(test_scene_solve(&s));
  PetscCall(masses(s.model, after));
  SB_CHECK(s.model->body[0].in_memory && s.model->body[0].in_memory->step == 2, "re-meshed twice");
  SB_CHECK(before[1] > 0.05 * before[0], "an inclusion of %g m^3", before[1]);
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(after[k], before[k], 1e-12 * before[k],
                  k == 2 ? "mass of the body"
                  : k    ? "volume of the inclusion"
                         : "volume around it");
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ supports, adaptive steps,
   error estimates */

static PetscErrorCode check_held(const char *more)
{
  PetscReal worst = 0.;
  const PetscScalar *u;
  TestScene s;

  PetscFunctionBeginUser;
  PetscCall(test_open(&s, BEAM "-ts_dt 0.005 -ts_max_time 0.06 -remesh_times 0.03 %s", more));
  s.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(test_scene_solve(&s));
  SB_CHECK_NEAR(s.run->clock.t, 0.06, 1e-9, "end");
  SB_CHECK(!s.run->clock.stop_reason[0] && s.model->body[0].in_memory, "%s: %s", more,
           s.run->clock.stop_reason);
  PetscCall(VecGetArrayRead(s.run->state.U, &u));
  for (PetscInt i = 0; i < s.model->space->nnode_owned; i++)
    for (int k = 0; k < 3; k++)
      worst =
        PetscMax(worst, s.model->space->fixed[i] & (1 << k) ? PetscAbsReal(u[3 * i + k]) : 0.);
  PetscCall(VecRestoreArrayRead(s.run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  SB_CHECK(worst == 0. && s.run->state.energies.max_displacement > 0.01,
           "%s: the support gives by %g m", more, worst);
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Relative errors of time steps and of the mesh at the end, and the number of steps. */
static PetscErrorCode ledger_run(const char *more, PetscReal error[2], PetscInt *steps)
{
  PetscReal stored;
  TestScene s;

  PetscFunctionBeginUser;
  PetscCall(test_open(&s, BEAM "-ts_dt 0.005 -ts_max_time 0.08 -ledger %s", more));
  PetscCall(test_scene_solve(&s));
  SB_CHECK(!s.run->clock.stop_reason[0], "%s: %s", more, s.run->clock.stop_reason);
  PetscCall(test_ledger(s.run, SB_ERROR_TIME, &error[0], &stored));
  PetscCall(test_ledger(s.run, SB_ERROR_SPACE, &error[1], &stored));
  for (int k = 0; k < 2; k++)
    error[k] /= PetscSqrtReal(stored);
  *steps = s.run->counters.steps;
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_ledger(const char *more, PetscReal accuracy)
{
  PetscReal with[2], without[2];
  PetscInt steps[2];
  char text[512];

  PetscFunctionBeginUser;
  PetscCall(ledger_run(more, without, &steps[0]));
  PetscCall(PetscSNPrintf(text, sizeof(text), "%s -remesh_times 0.06", more));
  PetscCall(ledger_run(text, with, &steps[1]));

  /* most of the run precedes re-meshing, so errors that restart at zero would be smaller; a
     re-meshed body vibrates, so errors are larger */
  SB_CHECK(with[0] > 0.9 * without[0] || (accuracy > 0. && with[0] < accuracy),
           "%s: time %g, not re-meshed %g", more, with[0], without[0]);
  SB_CHECK(with[0] < (accuracy > 0. ? accuracy : 0.5), "%s: time %g", more, with[0]);
  SB_CHECK(with[1] > 0.5 * without[1] && with[1] < 2. * without[1],
           "%s: space %g, not re-meshed %g", more, with[1], without[1]);
  SB_CHECK(steps[1] < 20 * steps[0], "%s: %d steps, not re-meshed %d", more, (int)steps[1],
           (int)steps[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ failed steps */

/* Runs with a limit on the iterations of a solve. */
static PetscErrorCode check_failed(const char *iterations, PetscBool first)
{
  TestScene s;
  int calls = 0;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &s,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3,3,3" STUFF(
      a) "-effects knead -effect_knead_type prescribed_displacement -effect_knead_on boundary "
         "-effect_knead_displacement 0.1*sin(60*t^3*y)*z;-0.6*t^3*(y-0.05);-0.6*t^3*z "
         "-time static -static_steps 10 -time_max_halvings 0 -remesh_failed -snes_max_it %s",
    iterations));
  SbRemeshSetMesher(s.remesh, fixture_cone, &calls);
  PetscCall(test_scene_solve(&s));
  PetscCallMPI(MPI_Bcast(&calls, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  SB_CHECK(s.run->clock.stop_reason[0] && s.run->clock.t < 1.,
           "a run with %s iterations comes to its end", iterations);
  SB_CHECK(first == !calls && first == !s.run->clock.step,
           "%s iterations: %d re-meshings, %d steps", iterations, calls, (int)s.run->clock.step);
  SB_CHECK(first || (s.model->body[0].in_memory && s.model->body[0].in_memory->step > 0),
           "no new mesh");
  SB_CHECK(first || s.model->load > s.run->clock.t, "the attempt has its own load factor");
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_touch(FLOOR "-ts_max_time 0.04"));
  PetscCall(check_touch(FLOOR "-ts_max_time 0.04 -effect_floor_friction 0.4"));
  PetscCall(check_touch(FLOOR "-ts_max_time 0.04 -effect_floor_friction 0.4 -body_a_element cr"));
  PetscCall(check_touch(FLOOR "-ts_max_time 0.04 -effect_floor_friction 0.4 -body_a_element p2"));
  PetscCall(check_run(FLOOR "-ts_max_time 0.07 -remesh_times 0.04", PETSC_FALSE, 0.07));
  PetscCall(check_run(FLOOR "-ts_max_time 0.07 -remesh_times 0.04 -effect_floor_friction 0.4",
                      PETSC_FALSE, 0.07));
  PetscCall(
    check_run(PAIR "-ts_max_time 0.05 -remesh_bodies a -remesh_times 0.03", PETSC_TRUE, 0.05));
  PetscCall(
    check_run(PAIR "-ts_max_time 0.05 -remesh_bodies a -remesh_times 0.03 -effect_hit_friction 0.3",
              PETSC_TRUE, 0.05));
  PetscCall(check_run(
    PAIR "-ts_max_time 0.05 -remesh_bodies a -remesh_times 0.03 -time genalpha -body_a_element dg",
    PETSC_TRUE, 0.05));
  PetscCall(check_inclusion(""));
  PetscCall(check_held("-body_a_element cr"));
  PetscCall(check_held("-body_a_element p2"));
  PetscCall(check_held("-body_a_element dg -ts_adapt_type basic"));
  PetscCall(check_held("-ts_adapt_type basic -time genalpha"));
  PetscCall(check_ledger("", 0.));
  PetscCall(check_ledger("-accuracy 0.1", 0.1));
  PetscCall(check_failed("1 -static_steps 3", PETSC_TRUE));
  PetscCall(check_failed("2", PETSC_FALSE));
  SB_TEST_END();
}
