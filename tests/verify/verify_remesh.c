// @ranks 1 2 3
/*
  Transfer of a state to another mesh of the same body.

    linear     linear displacements and accelerations are reproduced, for every element, on a body
    deformed by them; for P2 a
               quadratic velocity too
    same       values at surface nodes are bitwise the same; so are those of a body that is not
    re-meshed curved     all of this on a body of curved tets, whose surface keeps its shape to the
    last bit momenta    mass, momentum and angular momentum of each body are conserved to 1e-12,
    free and supported, with both mass matrices energy     the change of energy of a smooth motion
    decreases with the square of the edge length run        a run with re-meshing: steps, time,
    totals; the energy balance closes with remesh_loss; Newmark and symplectic Euler continue
    refused    a mesher that fails: the run is bitwise the same as without re-meshing sets
    groups of a file and shapes hold the same triangles, vertices of the surface and volume
*/
#include "../../src/remesh/remesh_impl.h"
#include "../remesh.h"
#include "curved.h"

#define TWO                                                                                   \
  "-bodies a,b -body_a_mesh box:0.4,0.1,0.2:4,2,2 -body_a_material stable_neohookean "        \
  "-body_a_young 1e4 "                                                                        \
  "-body_a_poisson 0.3 -body_a_density 900 -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate " \
  "0,1,0 "                                                                                    \
  "-body_b_material corotated -body_b_young 2e4 -body_b_poisson 0.3 -body_b_density 700 "
#define EULER "-time euler_implicit -ts_dt 0.01 -ts_max_time 0.05 "

/* Two scenes: the second one is the first one on other meshes. */
typedef struct {
  TestScene a, b;
  SbRemeshOutcome outcome[2];
} Pair;

static void linear(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.1 + 0.4 * x[0] - 0.3 * x[1] + 0.2 * x[2];
  u[1] = -0.2 + 0.2 * x[0] - 0.1 * x[1] - 0.3 * x[2];
  u[2] = 0.5 * x[0] + 0.1 * x[1] - 0.4 * x[2];
}

static void quadratic(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.3 * x[0] * x[0] + 0.1 * x[1];
  u[1] = x[0] * x[2] - 0.2 * x[1];
  u[2] = 0.3 * x[1] * x[1] - 0.5 * x[0] * x[1];
}

static void curved(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 0.3 * x[0] * x[0] + 0.1 * x[1];
  u[1] = x[0] * x[2] - 0.2 * x[1];
  u[2] = PetscSinReal(5 * x[0]) * 0.05 + 0.3 * x[1] * x[1];
}

/* Creates the second scene of a pair, with body a remeshed. */
static PetscErrorCode make_second(Pair *p, SbMesher mesher)
{
  const SbRemeshing how = {.mesher = mesher, .size = 1., .quality = 1e-3};
  const PetscBool due[2] = {PETSC_TRUE, PETSC_FALSE};
  SbRemeshResult result;
  SbGathered g;

  PetscFunctionBeginUser;
  PetscCall(SbGather(p->a.run, &g));
  PetscCall(SbRemeshResultCreate(&g, &result));
  if (!test_rank)
    PetscCall(SbRemeshBodies(p->a.model, &g, due, 1, &how, &result));
  PetscCall(PetscArraycpy(p->outcome, result.outcome, 2));
  PetscCallMPI(MPI_Bcast(p->outcome, (int)sizeof(p->outcome), MPI_BYTE, 0, PETSC_COMM_WORLD));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &p->b.model));
  PetscCall(SbRunCreate(p->b.model, &p->b.run));
  for (int b = 0; b < 2; b++) {
    if (test_rank)
      PetscCall(SbMemoryMeshCreate(0, 0, 0, 0, &result.in_memory[b]));
    if (test_rank && b == 0)
      result.in_memory[b]->mass = g.mass[0];
    p->b.model->body[b].in_memory = result.in_memory[b];
    result.in_memory[b] = NULL;
  }
  PetscCall(SbModelSetUp(p->b.model));
  PetscCall(SbMeshValidate(p->b.model->mesh));
  PetscCall(SbSpaceValidate(p->b.model->space));
  PetscCall(SbRunSetUp(p->b.run));
  PetscCall(SbScatter(&result.next, p->b.run));
  PetscCall(SbGatheredDestroy(&g));
  PetscCall(SbRemeshResultDestroy(&result));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode close_pair(Pair *p)
{
  PetscFunctionBeginUser;
  PetscCall(test_scene_close(&p->a));
  PetscCall(test_scene_close(&p->b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest difference between a vector and a function of the reference position. */
static PetscErrorCode difference(SbModel m, void (*f)(const PetscReal x[3], PetscReal value[3]),
                                 Vec U, PetscReal *worst)
{
  const PetscScalar *u;

  PetscFunctionBeginUser;
  *worst = 0;
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) {
    PetscReal expected[3];

    f(m->space->node_x + 3 * i, expected);
    for (int k = 0; k < 3; k++)
      *worst = PetscMax(*worst, PetscAbsReal(u[3 * i + k] - expected[k]));
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The second one on a body of curved tets. */
static PetscErrorCode check_linear(const char *element, const char *mesh)
{
  SbEnergies e[2];
  PetscReal worst;
  Pair p = {0};

  PetscFunctionBeginUser;
  PetscCall(test_open(&p.a, TWO EULER "-body_a_element %s -body_b_element p1 %s %s", element,
                      mesh ? "-body_a_mesh" : "", mesh ? mesh : ""));
  PetscCall(test_fill(p.a.model, linear, p.a.run->state.U));
  PetscCall(test_fill(p.a.model, quadratic, p.a.run->state.V));
  PetscCall(test_fill(p.a.model, linear, p.a.run->state.A));
  PetscCall(make_second(&p, fixture_cone));
  SB_CHECK(!p.outcome[0].message[0], "%s: %s", element, p.outcome[0].message);
  SB_CHECK(p.b.model->body[0].ncell == p.a.model->body[0].nfacet && p.a.model->body[0].ncell == 96,
           "%s: %d tets, then %d", element, (int)p.a.model->body[0].ncell,
           (int)p.b.model->body[0].ncell);
  PetscCall(difference(p.b.model, linear, p.b.run->state.U, &worst));
  SB_CHECK(worst < 1e-13, "%s: a linear displacement is wrong by %g m", element, worst);
  PetscCall(difference(p.b.model, linear, p.b.run->state.A, &worst));
  if (!strcmp(element, "p2") && !mesh) {
    PetscReal wrong;

    PetscCall(difference(p.b.model, quadratic, p.b.run->state.V, &wrong));
    SB_CHECK(wrong < 1e-13, "a quadratic velocity is wrong by %g m/s", wrong);
  }
  SB_CHECK(worst < 1e-13, "%s: a linear acceleration is wrong by %g m/s^2", element, worst);
  PetscCall(SbModelEnergies(p.a.model, p.a.run->state.U, p.a.run->state.V, &e[0]));
  PetscCall(SbModelEnergies(p.b.model, p.b.run->state.U, p.b.run->state.V, &e[1]));
  SB_CHECK_NEAR(e[1].strain, e[0].strain, 1e-12 * e[0].strain,
                "strain energy of a linear displacement");
  SB_CHECK_NEAR(e[1].volume, e[0].volume, 1e-13 * e[0].volume, "volume now");
  SB_CHECK_NEAR(p.b.model->body[0].volume, p.a.model->body[0].volume, 1e-15, "volume at rest");
  PetscCall(close_pair(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of the bits of positions and values over the nodes of a body, of its surface or all,
   independent of their order. */
static PetscErrorCode bits_of(SbModel m, Vec U, PetscInt body, PetscBool surface, uint64_t *sum)
{
  const SbSpace s = m->space;
  const PetscScalar *u;
  PetscBool *on;

  PetscFunctionBeginUser;
  *sum = 0;
  PetscCall(PetscCalloc1(s->nnode, &on));
  for (PetscInt i = 0; i < 4 * m->mesh->ncell; i++) {
    if (!(m->mesh->face_set[i] & SB_ON_BOUNDARY))
      continue;
    for (int a = 0; a < (s->edge_node ? SB_CELL_NODES : 4); a++) {
      const PetscInt node = SbSpaceCellNode(s, i / 4, a);
      const PetscBool off =
        (PetscBool)(a < 4 ? a == i % 4
                          : SbTetEdge[a - 4][0] == i % 4 || SbTetEdge[a - 4][1] == i % 4);

      if (node >= 0 && !off)
        on[node] = PETSC_TRUE;
    }
  }
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (s->node_body[i] != body || (surface && !on[i]))
      continue;
    for (int k = 0; k < 6; k++) {
      uint64_t bits;

      memcpy(&bits, k < 3 ? &u[3 * i + k] : &s->node_x[3 * i + k - 3], sizeof(bits));
      *sum += bits * (uint64_t)(2 * k + 1);
    }
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(PetscFree(on));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 1, MPI_UINT64_T, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_same(const char *element, const char *mesh)
{
  Pair p = {0};
  uint64_t a, b;

  PetscFunctionBeginUser;
  PetscCall(test_open(&p.a, TWO EULER "-body_a_element %s -body_b_element %s %s %s", element,
                      element, mesh ? "-body_a_mesh" : "", mesh ? mesh : ""));
  PetscCall(test_fill(p.a.model, curved, p.a.run->state.U));
  PetscCall(test_fill(p.a.model, linear, p.a.run->state.V));
  PetscCall(make_second(&p, fixture_cone));
  for (int body = 0; body < 2; body++) {
    PetscCall(bits_of(p.a.model, p.a.run->state.U, body, (PetscBool)!body, &a));
    PetscCall(bits_of(p.b.model, p.b.run->state.U, body, (PetscBool)!body, &b));
    SB_CHECK(a == b, "%s: displacements of %s have changed", element,
             body ? "a body that is as it was" : "the surface");
  }
  PetscCall(close_pair(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_momenta(const char *more)
{
  PetscReal before[2][6], after[2][6], corrected[2][6];
  PetscReal mass[2] = {0, 0};
  PetscReal speed;
  const PetscBool named[2] = {PETSC_TRUE, PETSC_FALSE};
  Pair p = {0};

  PetscFunctionBeginUser;
  PetscCall(test_open(&p.a, TWO EULER "%s", more));
  PetscCall(test_fill(p.a.model, curved, p.a.run->state.U));
  PetscCall(test_fill(p.a.model, curved, p.a.run->state.V));
  PetscCall(make_second(&p, fixture_cone));
  PetscCall(SbBodyMomenta(p.a.model, p.a.run->state.U, p.a.run->state.V, before));
  PetscCall(SbBodyMomenta(p.b.model, p.b.run->state.U, p.b.run->state.V, after));
  PetscCall(SbBodySetMomenta(p.b.model, p.b.run->state.U, p.b.run->state.V, named,
                             (const PetscReal(*)[6])before, &speed));
  PetscCall(SbBodyMomenta(p.b.model, p.b.run->state.U, p.b.run->state.V, corrected));
  for (int b = 0; b < 2; b++) {
    PetscReal moved = 0;

    for (int k = 0; k < 6; k++) {
      const PetscReal scale =
        PetscAbsReal(before[b][0]) + PetscAbsReal(before[b][1]) + PetscAbsReal(before[b][2]);

      SB_CHECK(PetscAbsReal(corrected[b][k] - before[b][k]) <= 1e-12 * scale,
               "'%s', body %d: momentum %d is %.15g, was %.15g, without correction %.15g", more, b,
               k, corrected[b][k], before[b][k], after[b][k]);
      moved = PetscMax(moved, PetscAbsReal(after[b][k] - before[b][k]) / scale);
    }
    SB_CHECK((moved > 1e-6) == (b == 0),
             "%s: the momenta of body %d differ by %g before they are put right", more, b, moved);
  }
  SB_CHECK(speed > 0 && speed < 0.1, "a rigid speed of %g m/s", speed);
  for (PetscInt i = 0; i < p.b.model->space->nnode_owned; i++)
    mass[p.b.model->space->node_body[i]] += p.b.model->space->node_mass[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mass, 2, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(mass[0], 900 * p.a.model->body[0].volume, 1e-13 * mass[0], "mass");
  SB_CHECK_NEAR(mass[1], 0.7, 1e-13, "mass of the other body");
  PetscCall(close_pair(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Relative change of the strain energy of a smooth motion on a new mesh, with n cells along the
   shortest side. */
static PetscErrorCode energy_change(int n, PetscBool bent, PetscReal *part)
{
  SbEnergies e[2];
  char mesh[512];
  Pair p = {0};

  PetscFunctionBeginUser;
  (void)snprintf(mesh, sizeof(mesh), "box:0.4,0.1,0.2:%d,%d,%d", 4 * n, n, 2 * n);
  if (bent)
    PetscCall(curved_mesh_write(n, n, curved_wobble, PETSC_TRUE, mesh));
  PetscCall(
    test_open(&p.a, TWO EULER "-body_a_mesh %s %s", mesh, bent ? "-body_a_element p2" : ""));
  PetscCall(test_fill(p.a.model, curved, p.a.run->state.U));
  PetscCall(make_second(&p, SbMesherDefault));
  SB_CHECK(!p.outcome[0].message[0], "%d cells: %s", n, p.outcome[0].message);
  PetscCall(SbModelEnergies(p.a.model, p.a.run->state.U, p.a.run->state.V, &e[0]));
  PetscCall(SbModelEnergies(p.b.model, p.b.run->state.U, p.b.run->state.V, &e[1]));
  *part = PetscAbsReal(e[1].strain - e[0].strain) / e[0].strain;
  PetscCall(close_pair(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The change is proportional to the squared edge length: a factor of four per halving. P2, curved
   or straight, on finer meshes: 7.8e-4, 2.9e-4. */
static PetscErrorCode check_energy(PetscBool bent)
{
  PetscReal coarse, fine;

  PetscFunctionBeginUser;
  PetscCall(energy_change(bent ? 6 : 3, bent, &coarse));
  PetscCall(energy_change(bent ? 12 : 6, bent, &fine));
  test_print("  energy, %s: changed by %.2e, %.2e\n", bent ? "curved tets of p2" : "p1", coarse,
             fine);
  SB_CHECK(coarse < 0.1 && fine < 0.4 * coarse,
           "a new mesh changes the energy by %g, with edges half as long by %g", coarse, fine);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ runs */

static PetscErrorCode check_run(const char *more, const char *element, PetscBool explicit)
{
  SbEnergies e;
  PetscReal sum, scale, mass;
  TestScene s;
  int calls = 0;

  PetscFunctionBeginUser;
  PetscCall(test_open(&s,
                      TWO
                      "-body_a_element %s -body_a_angular_velocity 0,3,1 -body_a_velocity 1,0,0 "
                      "-remesh_times 0.02,0.03 -remesh_bodies a %s",
                      element, more));
  s.run->monitors.want_energies = PETSC_TRUE;
  mass = 900 * s.model->body[0].volume;
  SbRemeshSetMesher(s.remesh, fixture_cone, &calls);
  PetscCall(test_scene_solve(&s));
  PetscCallMPI(MPI_Bcast(&calls, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  SB_CHECK(calls == 2 && !s.run->clock.stop_reason[0], "%s %s: meshed %d times; %s", more, element,
           calls, s.run->clock.stop_reason);
  SB_CHECK_NEAR(s.run->clock.t, 0.05, 1e-10, "end");
  SB_CHECK(explicit || (s.run->counters.steps == 5 && s.run->clock.step == 5),
           "%d steps, the last one is %d", (int)s.run->counters.steps, (int)s.run->clock.step);
  e = s.run->state.energies;
  sum = e.kinetic + e.strain + e.integrator_loss + e.remesh_loss - s.run->state.energy_start;
  scale = s.run->state.energy_start;
  SB_CHECK_NEAR(sum, 0, 1e-12 * scale, "account");
  SB_CHECK(e.remesh_loss != 0 && PetscAbsReal(e.remesh_loss) < 0.2 * scale,
           "remesh_loss %g of %g J", e.remesh_loss, scale);
  SB_CHECK_NEAR(e.momentum[0], mass, 2e-6 * mass, "momentum along x");
  SB_CHECK_NEAR(e.momentum[1], 0, 2e-6 * mass, "momentum along y");
  SB_CHECK(e.ninverted == 0, "%d tets are inverted", (int)e.ninverted);
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of squares of the final displacement. */
static PetscErrorCode refused_run(SbMesher mesher, const char *more, PetscReal *norm)
{
  TestScene s;

  PetscFunctionBeginUser;
  PetscCall(test_open(&s, TWO EULER "-body_a_angular_velocity 0,3,1 %s", more));
  if (s.remesh)
    SbRemeshSetMesher(s.remesh, mesher, NULL);
  PetscCall(test_scene_solve(&s));
  PetscCall(VecNorm(s.run->state.U, NORM_2, norm));
  SB_CHECK(s.run->counters.steps == 5, "%d steps", (int)s.run->counters.steps);
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ sets */

static PetscErrorCode check_sets(void)
{
  static const char text[] = TWO EULER
    "-sets left,top,part -set_left_at group:a.xmin -set_top_at plane:0,0,1,0.2 "
    "-set_part_at box:0,0,0,0.2,0.1,0.2 -effects hold,pull -effect_hold_type fixed "
    "-effect_hold_on left -effect_pull_type traction -effect_pull_on top -effect_pull_vector 0;0;1";
  PetscReal area[2][2] = {{0, 0}, {0, 0}};
  Pair p = {0};

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(text, &p.a));
  PetscCall(test_fill(p.a.model, curved, p.a.run->state.U));
  PetscCall(make_second(&p, fixture_cone));
  for (int i = 0; i < 2; i++) {
    const SbModel m = i ? p.b.model : p.a.model;

    for (int k = 0; k < 2; k++) {
      SbFacet *facet;
      PetscInt n;

      PetscCall(SbSpaceGetSetFacets(m->space, k, &n, &facet));
      for (PetscInt f = 0; f < n; f++)
        area[i][k] += facet[f].cell < m->mesh->ncell_owned ? facet[f].area : 0;
      PetscCall(PetscFree(facet));
    }
    SB_CHECK(m->set[0].nvert == 9 && m->set[0].nfacet == 8,
             "the group holds %d vertices, %d facets", (int)m->set[0].nvert, (int)m->set[0].nfacet);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, area, 4, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  for (int k = 0; k < 2; k++)
    SB_CHECK_NEAR(area[1][k], area[0][k], 1e-15, k ? "area of the shape" : "area of the group");
  SB_CHECK(p.a.model->set[2].nfacet == p.b.model->set[2].nfacet, "facets of the box: %d, then %d",
           (int)p.a.model->set[2].nfacet, (int)p.b.model->set[2].nfacet);
  PetscCall(close_pair(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512], more[600];
  PetscReal with, without;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_linear("p1", NULL));
  PetscCall(check_linear("cr", NULL));
  PetscCall(check_linear("dg", NULL));
  PetscCall(check_linear("p2", NULL));
  PetscCall(check_energy(PETSC_FALSE));
  PetscCall(check_energy(PETSC_TRUE));
  PetscCall(check_same("p1", NULL));
  PetscCall(check_same("p2", NULL));
  PetscCall(curved_mesh_write(2, 8, curved_wobble, PETSC_TRUE, mesh));
  PetscCall(check_linear("p2", mesh));
  PetscCall(check_same("p2", mesh));
  for (int k = 0; k < 2; k++) {
    (void)snprintf(more, sizeof(more), "-body_a_mesh %s -body_a_element p2 %s", mesh,
                   k ? "-mass consistent" : "");
    PetscCall(check_momenta(more));
  }
  (void)snprintf(more, sizeof(more), "%s -body_a_mesh %s", EULER, mesh);
  PetscCall(check_run(more, "p2", PETSC_FALSE));
  PetscCall(check_momenta(""));
  PetscCall(check_momenta("-mass consistent"));
  PetscCall(check_momenta("-body_a_element cr"));
  PetscCall(check_momenta("-body_a_element dg -mass consistent"));
  PetscCall(check_momenta("-body_a_element p2"));
  PetscCall(check_momenta("-body_a_element p2 -mass consistent"));
  PetscCall(check_momenta("-sets end -set_end_at plane:1,0,0,0 -effects hold -effect_hold_type "
                          "fixed -effect_hold_on end"));
  PetscCall(check_run(EULER, "p1", PETSC_FALSE));
  PetscCall(check_run(EULER, "cr", PETSC_FALSE));
  PetscCall(check_run(EULER, "dg", PETSC_FALSE));
  PetscCall(check_run(EULER, "p2", PETSC_FALSE));
  PetscCall(check_run("-time newmark -ts_dt 0.01 -ts_max_time 0.05", "p1", PETSC_FALSE));
  PetscCall(check_run("-time genalpha -ts_dt 0.01 -ts_max_time 0.05", "p1", PETSC_FALSE));
  PetscCall(check_run("-time euler_symplectic -ts_max_time 0.05", "p1", PETSC_TRUE));
  PetscCall(refused_run(fixture_refuse, "", &without));
  PetscCall(refused_run(fixture_refuse, "-remesh_times 0.02", &with));
  SB_CHECK(with == without,
           "a run that could not be re-meshed moves otherwise: %.17g, without %.17g", with,
           without);
  PetscCall(check_sets());
  SB_TEST_END();
}
