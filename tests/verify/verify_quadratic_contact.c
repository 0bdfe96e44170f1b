// @ranks 1 2
/*
  Barrier contact of p2 bodies, whose surface has four flat triangles per facet.

    press   two blocks, the upper one smaller, sharp edges: no intersections, forces balance, and
    the force is that of P1 on meshes with the same nodes
    patch   compressed blocks of equal cross-section with different meshes: correct force, and
    uniform stress except in cells at the surface, as pressures
            that are linear in the four triangles are not distributed like the nodal forces of a
            quadratic facet; smaller gaps do not change that
    hertz   hertz.h: two spheres, a sphere on a half-space
*/
#include "hertz.h"

static PetscErrorCode press(const char *element, PetscInt cells, PetscReal *force)
{
  Record r = {0};
  PetscReal pushed, stood;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("press, %s", element);
  PetscCall(test_open(
    &t,
    "-bodies low,high -body_low_mesh box:0.2,0.2,0.1:%d -body_high_mesh box:0.1,0.1,0.1:%d "
    "-body_high_translate 0.053,0.047,0.101 -body_low_element %s -body_high_element %s "
    "-body_low_material "
    "stable_neohookean -body_high_material stable_neohookean -body_low_young 1e5 -body_high_young "
    "1e5 "
    "-body_low_poisson "
    "0.3 -body_high_poisson 0.3 -sets floor,top -set_floor_at plane:0,0,1,0 -set_top_at "
    "plane:0,0,-1,-0.201 "
    "-effects stand,press,meet -effect_stand_type fixed -effect_stand_on floor -effect_press_type "
    "prescribed_displacement -effect_press_on top -effect_press_displacement 0;0;-0.02*t "
    "-effect_meet_type "
    "contact -effect_meet_response barrier -effect_meet_verify true -time static -static_steps 4",
    (int)(4 * cells), (int)(3 * cells), element, element));
  PetscCall(record_solve(&t, &r));
  *force = record_last(&r, "meet_normal_force");
  PetscCall(contact_column(t.run, 1, "press", "reaction_z", &pushed));
  PetscCall(contact_column(t.run, 1, "stand", "reaction_z", &stood));
  PetscCall(test_scene_close(&t));
  VERIFY_LESS(PetscAbsReal(pushed + stood), 1e-5 * *force, "sum of what holds both, N");
  VERIFY_MORE(record_min(&r, "min_J"), 0, "least det F");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ patch */

/* Two blocks, Poisson's ratio 0, the upper one pressed down by 0.1 mm: axial stress of the cells,
   and its largest deviation from the mean. */
static PetscErrorCode patch(void)
{
  PetscReal *sigma;
  PetscReal mean = 0;
  PetscReal away = 0;
  PetscReal worst = 0;
  const PetscReal *u;
  SbSpace s;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("patch");
  PetscCall(test_open(
    &t,
    "-bodies low,high -body_low_mesh box:0.1,0.1,0.1:3 -body_high_mesh box:0.1,0.1,0.1:2 "
    "-body_high_translate 0,0,0.10001 -body_low_element p2 -body_high_element p2 "
    "-body_low_material linear "
    "-body_high_material linear -body_low_young 1e5 -body_high_young 1e5 -body_low_poisson 0 "
    "-body_high_poisson 0 -sets floor,top,meet -set_floor_at plane:0,0,1,0 -set_top_at "
    "plane:0,0,-1,-0.20001 "
    "-set_meet_at box:-1,-1,0.09999,1,1,0.10002 -effects stand,press,meet -effect_stand_type fixed "
    "-effect_stand_on floor -effect_press_type prescribed_displacement -effect_press_on top "
    "-effect_press_displacement 0;0;-1e-4*t -effect_meet_type contact -effect_meet_response "
    "barrier "
    "-effect_meet_verify true -effect_meet_on meet -effect_meet_barrier_width 1e-5 -time static"));
  PetscCall(verify_solve(&t, "patch"));
  s = t.model->space;
  PetscCall(PetscMalloc1(6 * s->mesh->ncell_owned, &sigma));
  PetscCall(SbSpaceGetLocalRead(s, t.run->state.U, &u));
  SbSpaceCellState(s, u, sigma, NULL, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, t.run->state.U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++)
    mean += sigma[6 * c + 2] / (PetscReal)s->mesh->Ncell;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &mean, 1, MPIU_REAL, MPI_SUM, t.model->comm));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    const PetscReal off = sigma[6 * c + 2] / mean - 1.;

    worst = PetscMax(worst, PetscAbsReal(off));
    away += PetscSqr(off) / (PetscReal)s->mesh->Ncell;
  }
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPI_MAX, t.model->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &away, 1, MPIU_REAL, MPI_SUM, t.model->comm));

  /* both are 0.1 m high; the gap reduces the compression of 0.1 mm */
  VERIFY_NEAR(mean, -50, 1, "mean stress, Pa");
  VERIFY_LESS(PetscSqrtReal(away), 0.03, "root mean square of its deviation, of it");
  VERIFY_LESS(worst, 0.15, "largest deviation, of it");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const Pair pairs[] = {{"sphere on a half-space", {1e5, 3e5}, {0, RADIUS}},
                               {"two spheres", {1e5, 1e5}, {2 * RADIUS, 2 * RADIUS}}};
  PetscReal force[2];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(press("p2", 1, &force[0]));
  PetscCall(press("p1", 2, &force[1]));

  /* P1 is too stiff on these meshes */
  VERIFY_NEAR(force[0] / force[1], 0.97, 0.02, "force of p2, of that of P1");
  PetscCall(patch());
  for (int i = 0; i < 2 && test_size == 1; i++) {
    const Case c = {i ? 8 : 5, 0.12, 0.1, "p2", NULL};

    PetscCall(hertz(&pairs[i], &c, &force[0]));
    SB_CHECK_NEAR(force[0], 1, 0.02, "force against that of Hertz");
  }
  SB_TEST_END();
}
