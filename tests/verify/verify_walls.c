// @ranks 1,2,3
/*
  CR and DG at planes of symmetry: a body cut there has its part of the energy of the whole one,
  which the mesh of a box with an even number of cells mirrors. Facets on the plane have half of the
  penalty on the jump to their image (src/fem/wall.c).

    bodies   half, quarter and eighth; linear and finite strains, static and in time, with damping
    CR       equal to rounding, and to the tolerance of the solver
    DG       the mean of a cell's own face is prescribed across the wall, which in the whole body
    the
             penalty on means ties to that of the other side: no more than a thousandth; 1 % without
             the penalty at the wall, where a body is pressed 30 %

  Walls that tilt have no energy of their own: they turn a body without strains.

  A cube confined by smooth walls is in an even state, without jumps. Pressed by a tenth, or near nu
  = 1/2 until the pressure is several times the shear modulus, it is stable, and takes one load
  step: the penalty of the start of a load step that is too small for the pressure at its end is
  adapted, although the energy of the jumps does not change.
*/
#include "contact.h"

typedef struct {
  const char *element, *law;
  PetscReal nu;
  int walls; /* 1 to 3 planes of symmetry */
  PetscBool dynamic;
  PetscReal tolerance;
  PetscReal length; /* of cells along z, times */
} Case;

/* Strain energy of the whole body or the part of it, J. */
static PetscErrorCode energy_of(const Case *c, PetscBool part, PetscReal *energy)
{
  const PetscReal load = strcmp(c->law, "linear") ? 3000. : 300.;
  const PetscReal size[3] = {part ? 0.05 : 0.1, part && c->walls > 1 ? 0.1 : 0.2,
                             c->length * (part && c->walls > 2 ? 0.06 : 0.12)};
  const int n[3] = {part ? 1 : 2, part && c->walls > 1 ? 2 : 4, part && c->walls > 2 ? 1 : 2};
  char ends[512], walls[512];
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;

  /* three planes: both ends pressed together; else held at one end, a load on the other one */
  if (c->walls == 3) {
    char top[160];

    PetscCall(PetscSNPrintf(top, sizeof(top),
                            " -effect_top_type prescribed_displacement -effect_top_on zmax "
                            "-effect_top_displacement 0;0;%g*t",
                            -0.01 * c->length));
    PetscCall(PetscSNPrintf(ends, sizeof(ends),
                            "-effect_low_type prescribed_displacement -effect_low_on zmin "
                            "-effect_low_displacement 0;0;%g*t%s",
                            0.01 * c->length, part ? "" : top));
  } else
    PetscCall(PetscSNPrintf(ends, sizeof(ends),
                            "-effect_low_type fixed -effect_low_on zmin -effect_top_type traction "
                            "-effect_top_on zmax -effect_top_vector 0;%g;%g",
                            c->walls == 1 ? 0.2 * load : 0., -load));
  walls[0] = 0;
  for (int k = 0; k < c->walls && part; k++) {
    char one[128];

    PetscCall(PetscSNPrintf(one, sizeof(one),
                            " -effect_%c_type fixed -effect_%c_on %cmax -effect_%c_components %c",
                            'x' + k, 'x' + k, 'x' + k, 'x' + k, 'x' + k));
    PetscCall(PetscStrlcat(walls, one, sizeof(walls)));
  }
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:%g,%g,%g:%d,%d,%d -body_a_element %s -body_a_material %s "
    "-body_a_young 5e4 -body_a_poisson %.17g -body_a_density 1000 -effects low%s%s%s %s%s %s "
    "-snes_rtol 1e-12 -solver mumps",
    size[0], size[1], size[2], n[0], n[1], n[2], c->element, c->law, c->nu,
    c->walls < 3 || !part ? ",top" : "",
    part ? (c->walls == 1   ? ",x"
            : c->walls == 2 ? ",x,y"
                            : ",x,y,z")
         : "",
    c->dynamic ? ",damp" : "", ends, walls,
    c->dynamic ? "-time euler_implicit -ts_dt 0.005 -ts_max_time 0.05 -effect_damp_type damping "
                 "-effect_damp_on a -effect_damp_beta 0.002"
               : "-time static"));
  PetscCall(record_solve(&t, &r));
  *energy = record_last(&r, "strain");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_part(const Case *c)
{
  PetscReal whole, part;

  PetscFunctionBeginUser;
  PetscCall(energy_of(c, PETSC_FALSE, &whole));
  PetscCall(energy_of(c, PETSC_TRUE, &part));
  verify_case("%s, %s, nu %g, %d planes%s", c->element, c->law, c->nu, c->walls,
              c->dynamic ? ", in time" : "");
  VERIFY_NEAR(part * (1 << c->walls) / whole, 1, c->tolerance,
              "energy of the part, of its part of that of the whole body");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Turned a little by walls that tilt: displacements are linear, without jumps and strains. */
static PetscErrorCode check_patch(const char *element)
{
  const PetscReal mu = 5e4 / 2.6;
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_element %s -body_a_material linear "
    "-body_a_young 5e4 -body_a_poisson 0.3 -body_a_density 1000 -effects x,y,z "
    "-effect_x_type prescribed_displacement -effect_x_on xmin,xmax -effect_x_components x "
    "-effect_x_displacement 0.01*y;0;0 -effect_y_type prescribed_displacement -effect_y_on "
    "ymin,ymax -effect_y_components y -effect_y_displacement 0;-0.01*x;0 -effect_z_type "
    "fixed -effect_z_on zmin,zmax -effect_z_components z -time static",
    element));
  PetscCall(record_solve(&t, &r));
  verify_case("walls that tilt, %s", element);
  VERIFY_NEAR(record_last(&r, "strain") / mu, 0., 1e-14,
              "energy of a rotation, over mu times 1 m^3");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_confined(const char *element, PetscReal nu, PetscReal way)
{
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element %s -body_a_material "
    "stable_neohookean -body_a_young 1e5 -body_a_poisson %.17g -effects low,top,x,y "
    "-effect_low_type fixed -effect_low_on zmin -effect_low_components z -effect_x_type fixed "
    "-effect_x_on xmin,xmax -effect_x_components x -effect_y_type fixed -effect_y_on ymin,ymax "
    "-effect_y_components y -effect_top_type prescribed_displacement -effect_top_on zmax "
    "-effect_top_components z -effect_top_displacement 0;0;-%.17g -time static -static_unstable "
    "error",
    element, nu, way));
  PetscCall(record_solve(&t, &r));
  verify_case("confined, %s, nu %g, by %g", element, nu, way / 0.1);
  VERIFY_NEAR(r.steps, 1, 0, "load steps");
  VERIFY_NEAR(r.rejected, 0, 0, "rejected ones");
  SB_CHECK(t.run->clock.t == 1., "%s", t.run->clock.stop_reason);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const Case cases[] = {
    {"cr", "linear", 0.3, 1, PETSC_FALSE, 1e-8, 1},
    {"cr", "linear", 0.4999, 2, PETSC_FALSE, 1e-8, 1},
    {"cr", "linear", 0.3, 3, PETSC_FALSE, 1e-8, 1},
    {"cr", "stable_neohookean", 0.4999, 1, PETSC_FALSE, 1e-8, 1},
    {"cr", "stable_neohookean", 0.45, 2, PETSC_TRUE, 1e-8, 1},
    {"cr", "stable_neohookean", 0.4999, 3, PETSC_FALSE, 1e-8, 1},
    {"cr", "neohookean", 0.45, 3, PETSC_FALSE, 1e-8, 1},
    {"dg", "linear", 0.3, 1, PETSC_FALSE, 1e-3, 1},
    {"dg", "linear", 0.3, 3, PETSC_FALSE, 1e-3, 1},
    {"dg", "stable_neohookean", 0.4999, 2, PETSC_FALSE, 1e-3, 1},
    {"cr", "linear", 0.3, 1, PETSC_FALSE, 1e-8, 5},
    {"cr", "linear", 0.3, 3, PETSC_FALSE, 1e-8, 0.2},
    {"cr", "stable_neohookean", 0.4999, 3, PETSC_FALSE, 1e-8, 0.25},
  };

  SB_TEST_BEGIN(argc, argv);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++)
    PetscCall(check_part(&cases[k]));
  PetscCall(check_patch("cr"));
  PetscCall(check_patch("dg"));
  PetscCall(check_confined("cr", 0.45, 0.03));
  PetscCall(check_confined("cr", 0.4999, 5e-5));
  PetscCall(check_confined("dg", 0.45, 0.03));
  SB_TEST_END();
}
