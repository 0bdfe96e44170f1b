/*
  cases_contact.c - contact in extreme cases: impacts at wave speed, deep overlap, bodies compressed
  flat, large ratios of mass and stiffness, and very small and large sizes.
*/
#include "hard.h"

/* A material for a body: modulus (Pa) and density (kg/m^3). */
#define FLESH(body, young, density)                                                      \
  "-body_" body "_material stable_neohookean -body_" body "_young " young " -body_" body \
  "_poisson 0.3 -body_" body "_density " density " "
#define FLOOR                                                                           \
  "-effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle " \
  "plane:0,0,1,0 "
#define MEET "-effect_meet_type contact "
#define GROUND "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 "

/* A block of 64 g hits a plate of a tenth of its thickness; wave speed 1000 m/s. */
#define PLATE(element)                                                                     \
  "-bodies block,plate -body_block_mesh box:0.04,0.04,0.04:2 -body_block_element " element \
  " -body_block_translate 0.03,0.03,0.0061 -body_block_velocity 0,0,-100 " FLESH(          \
    "block", "1e9",                                                                        \
    "1000") "-body_plate_mesh box:0.1,0.1,0.004:6,6,1 -body_plate_element " element        \
            " " FLESH("plate", "1e9", "1000") "-effects rim,meet -effect_rim_type fixed "  \
                                              "-effect_rim_on plate.xmin,plate.xmax " MEET \
                                              "-ts_dt 1e-5 -ts_max_time 6e-4"
/* A block falls on its corner onto a rigid floor. */
#define CORNER(element)                                                                         \
  "-bodies a -body_a_mesh box:0.04,0.04,0.04:2 -body_a_element " element                        \
  " -body_a_rotate 1,-1,0,54.7356 -body_a_translate 0,0,0.05 -body_a_velocity 0,0,-100 " FLESH( \
    "a", "1e9", "1000") "-effects floor " FLOOR "-ts_dt 1e-5 -ts_max_time 1e-3"
#define HALF(element)                                                                            \
  "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.1,0.1:3 -body_b_translate " \
  "0.05,0,0 "                                                                                    \
  "-body_a_element " element " -body_b_element " element " " FLESH("a", "1e5", "1000")           \
    FLESH("b", "1e5",                                                                            \
          "1000") "-effects damping,meet -effect_damping_beta 0.01 " MEET                        \
                  "-effect_meet_separation_steps 30 -ts_dt 0.004 -ts_max_time 0.6 -snes_rtol 1e-9"
/* With jitter some vertices are initially inside the plates by up to 1e-5 of the size, which counts
   as penetration. P1: edges at the corners snap through within a step, and the plates' work in it
   is known from its two ends only: 0.16 % of the energy in steps of 20 ms, 0.02 % in steps of 10
   ms, 0.006 % in steps of 5 ms. */
#define SQUEEZED(element, mesh, excess)                                                         \
  {                                                                                             \
    .name = "squeeze." element, .seconds = 600,                                                 \
    .what = "squeezed to 20 % between plates and let go, " element,                             \
    .options =                                                                                  \
      "-bodies a -body_a_mesh box:0.1,0.1,0.1:" mesh " -body_a_element " element " " FLESH(     \
        "a", "1e4",                                                                             \
        "1000") "-effects top,floor -effect_top_type contact -effect_top_response projected "   \
                "-effect_top_obstacle "                                                         \
                "plane:0,0,-1,-0.1 -effect_top_displacement 0;0;-0.08*min(t,max(0,2-t)) " FLOOR \
                "-ts_dt 0.02 -ts_max_time 4 -snes_rtol 1e-9",                                   \
    .jitter = 1e-5, .limits = {                                                                 \
      {HARD_EXCESS, '<', excess},                                                               \
      {HARD_MIN_J, '>', 0.9},                                                                   \
      {HARD_SHAPE, '<', 1e-2},                                                                  \
      {HARD_DEPTH, '<', 2e-5},                                                                  \
      {HARD_NEWTON, '<', 500},                                                                  \
      {HARD_REJECTED, '<', 50}                                                                  \
    }                                                                                           \
  }
/* A block of 1000 kg on one of 0.1 kg, whose weight is a thousandth of its stiffness. */
#define STACK                                                                                    \
  "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.1,0.1:3 -body_b_translate " \
  "0,0,0.1 " FLESH("a", "1e8", "100")                                                            \
    FLESH("b", "1e8", "1e6") "-effects gravity,floor,meet " GROUND                               \
                             "-effect_floor_friction 0.3 " MEET                                  \
                             "-effect_meet_friction 0.3 -ts_dt 0.01 -ts_max_time 0.5"
#define IMPACT(name_, on, scene, element, quick_runs)                                              \
  {                                                                                                \
    .name = "impact." name_ "." element, .seconds = 600,                                           \
    .what = "a block hits " on " at 100 m/s, " element, .options = scene(element), .jitter = 1e-5, \
    .jitter_speed = 0.1, .quick = quick_runs, .limits = {                                          \
      {HARD_EXCESS, '<', 1e-6},                                                                    \
      {HARD_MIN_J, '>', 0.5},                                                                      \
      {HARD_VOLUME, '<', 0.05},                                                                    \
      {HARD_DEPTH, '<', 0.01},                                                                     \
      {HARD_NEWTON, '<', 100},                                                                     \
      {HARD_REJECTED, '<', 5}                                                                      \
    }                                                                                              \
  }
#define STIFF(newton, linear, rejected, jitter_, quick_runs)                                \
  {                                                                                         \
    .name = "stiff", .seconds = 600, .what = "a million times stiffer body on a soft one",  \
    .options = "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.1,0.1:3 " \
               "-body_b_translate "                                                         \
               "0,0,0.1 " FLESH("a", "1e4", "1000")                                         \
                 FLESH("b", "1e10", "1000") "-effects gravity,floor,meet " GROUND MEET      \
                                            "-ts_dt 0.01 -ts_max_time 0.5",                 \
    .jitter = jitter_, .quick = quick_runs, .limits = {                                     \
      {HARD_EXCESS, '<', 1e-6},                                                             \
      {HARD_MIN_J, '>', 0.5},                                                               \
      {HARD_DEPTH, '<', 1e-4},                                                              \
      {HARD_NEWTON, '<', newton},                                                           \
      {HARD_LINEAR, '<', linear},                                                           \
      {HARD_REJECTED, '<', rejected}                                                        \
    }                                                                                       \
  }

/* Largest energy of HALF relative to that of bars pushed with the speed of the separation, M v^2 =
   2 kg (50 mm / 30 / 4 ms)^2. */
static PetscErrorCode measure_push(HardRun *r, const SbStep *step)
{
  PetscFunctionBeginUser;
  if (step->step)
    r->value[HARD_OWN] =
      PetscMax(r->value[HARD_OWN], (step->energies.kinetic + step->energies.strain) /
                                     (2. * PetscSqr(0.05 / 30. / 0.004)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define OVERLAP(title, element, always)                                              \
  {                                                                                  \
    .name = "overlap." element, .seconds = 600,                                      \
    .what = "two blocks begin half in each other, their sides in one plane, " title, \
    .options = HALF(element), .look = measure_push, .quick = always, .limits = {     \
      {HARD_MOMENTUM, '<', 1e-6},                                                    \
      {HARD_MIN_J, '>', 0.99},                                                       \
      {HARD_MIN_J_EVER, '>', 0.5},                                                   \
      {HARD_SHAPE, '<', 1e-2},                                                       \
      {HARD_OWN, '<', 2, "energy / M v^2 of the recovery", ""},                      \
      {HARD_NEWTON, '<', 100},                                                       \
      {HARD_REJECTED, '<', 1}                                                        \
    }                                                                                \
  }

const HardCase HardCasesContact[] = {
  IMPACT("plate", "a thin plate", PLATE, "p1", 1),
  IMPACT("plate", "a thin plate", PLATE, "cr", 0),
  IMPACT("corner", "the floor with a corner", CORNER, "p1", 1),
  IMPACT("corner", "the floor with a corner", CORNER, "dg", 0),
  IMPACT("plate", "a thin plate", PLATE, "p2", 0),
  IMPACT("corner", "the floor with a corner", CORNER, "p2", 0),
  OVERLAP("P1", "p1", 1),
  OVERLAP("CR", "cr", 1),
  OVERLAP("P2", "p2", 1),
  {.name = "overlap.askew",
   .seconds = 600,
   .what = "a block begins with half of its width in another one, P1",
   .options = HALF("p1") " -body_b_mesh box:0.06,0.06,0.06:2 -body_b_translate 0.07,0.02,0.03 "
                         "-body_b_rotate 1,2,3,5",
   .look = measure_push,
   .jitter = 1e-3,
   .quick = 1,
   .limits = {{HARD_MOMENTUM, '<', 1e-6},
              {HARD_MIN_J, '>', 0.99},
              {HARD_MIN_J_EVER, '>', 0.5},
              {HARD_SHAPE, '<', 1e-2},
              {HARD_OWN, '<', 2, "energy / M v^2 of the recovery", ""},
              {HARD_NEWTON, '<', 100},
              {HARD_REJECTED, '<', 1}}},
  {.name = "overlap.sides",
   .seconds = 600,
   .what = "two blocks begin half in each other, their sides within 0.15 mm, P1",
   .options = HALF("p1"),
   .look = measure_push,
   .jitter = 1e-3,
   .limits = {{HARD_MOMENTUM, '<', 1e-6},
              {HARD_MIN_J, '>', 0.99},
              {HARD_MIN_J_EVER, '>', 0.3},
              {HARD_SHAPE, '<', 1e-2},
              {HARD_OWN, '<', 15, "energy / M v^2 of the recovery", ""},
              {HARD_NEWTON, '<', 300},
              {HARD_REJECTED, '<', 1}}},
  {.name = "overlap.floor",
   .seconds = 600,
   .what = "a block begins half in the floor",
   .options = "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 " FLESH(
     "a", "1e5",
     "1000") "-effects damping,floor -effect_damping_beta 0.01 -effect_floor_type contact "
             "-effect_floor_response projected "
             "-effect_floor_obstacle plane:0,0,1,0.05 -ts_dt 0.004 -ts_max_time 0.6",
   .jitter = 1e-3,
   .quick = 1,
   .limits = {{HARD_MIN_J, '>', 0.99},
              {HARD_MIN_J_EVER, '>', 0.5},
              {HARD_SHAPE, '<', 1e-2},
              {HARD_SPEED, '<', 1},
              {HARD_NEWTON, '<', 100},
              {HARD_REJECTED, '<', 1}}},
  SQUEEZED("p1", "3", 5e-3),
  SQUEEZED("cr", "2", 1e-6),
  SQUEEZED("dg", "2", 1e-6),
  {.name = "mass.stack",
   .seconds = 600,
   .what = "ten thousand times its mass rests on a block",
   .options = STACK,
   .jitter = 1e-6,
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-6},
              {HARD_MIN_J, '>', 0.98},
              {HARD_SPEED, '<', 1e-3},
              {HARD_DEPTH, '<', 2e-3},
              {HARD_NEWTON, '<', 100},
              {HARD_REJECTED, '<', 1}}},
  STIFF(200, 500, 1, 1e-7, 1),
  {.name = NULL},
};
