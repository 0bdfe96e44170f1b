/*
  cases_motion.c - large motions and strains, and very small and large lengths.
*/
#include "hard.h"

#define BAR                                                                                        \
  "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 "                \
  "-body_a_density 1000 "                                                                          \
  "-effects left,right,damping -effect_damping_alpha 5 -effect_left_type prescribed_displacement " \
  "-effect_left_on xmin -effect_right_type prescribed_displacement -effect_right_on xmax "
#define STILL "-effect_left_displacement 0;0;0 "
#define RETURNS                                       \
  {HARD_INVERTED, '<', 0.5}, {HARD_PLACE, '<', 1e-3}, \
  {                                                   \
    HARD_SHAPE, '<', 1e-3                             \
  }

#define ROTATION(ELEMENT, LAW, QUICK)                                                             \
  {                                                                                               \
    .name = "rotation." ELEMENT "." LAW,                                                          \
    .what = "both ends turned by 720 degrees, " ELEMENT ", " LAW,                                 \
    .options = BAR                                                                                \
      "-effect_left_angle 720*ramp(t/2) -effect_left_axis 0,1,1 -effect_left_axis_point 0.1,0,0 " \
      "-effect_right_angle 720*ramp(t/2) -effect_right_axis 0,1,1 -effect_right_axis_point "      \
      "0.1,0,0 "                                                                                  \
      "-ts_dt 0.025 -ts_max_time 4 -body_a_element " ELEMENT " -body_a_material " LAW,            \
    .quick = QUICK, .limits = {                                                                   \
      RETURNS,                                                                                    \
      {HARD_MIN_J_EVER, '>', 0.7},                                                                \
      {HARD_NEWTON, '<', 30},                                                                     \
      {HARD_REJECTED, '<', 0.5}                                                                   \
    }                                                                                             \
  }

#define SPIN(ELEMENT, LAW, QUICK)                                                                \
  {                                                                                              \
    .name = "spin." ELEMENT "." LAW,                                                             \
    .what = "free spin at 1000 rad/s, newmark, " ELEMENT ", " LAW,                               \
    .options = "-bodies a -body_a_mesh box:0.02,0.02,0.02:2 -body_a_young 1e7 -body_a_poisson "  \
               "0.3 -body_a_density "                                                            \
               "1000 -body_a_angular_velocity 600,0,800 -time newmark -ts_dt 5e-5 -ts_max_time " \
               "0.02 -ksp_rtol 1e-10 "                                                           \
               "-snes_rtol 1e-10 -body_a_element " ELEMENT " -body_a_material " LAW,             \
    .jitter_speed = 0.1, .runs = 3, .quick = QUICK, .limits = {                                  \
      {HARD_MOMENTUM, '<', 1e-9},                                                                \
      {HARD_ANGULAR, '<', 3e-3},                                                                 \
      {HARD_DRIFT, '<', 0.01},                                                                   \
      {HARD_MIN_J, '>', 0.8},                                                                    \
      {HARD_NEWTON, '<', 20}                                                                     \
    }                                                                                            \
  }

/*
  Three quarters of a turn in a second while the ends come nearer by a twentieth, and back. Not two
  turns: a strip that buckles passes them around an end (Dirac's belt), and untwisting it then
  twists it.
*/
#define TWIST(ELEMENT, LAW, RUNS, QUICK)                                                           \
  {                                                                                                \
    .name = "twist." ELEMENT "." LAW,                                                              \
    .what = "strip twisted by 270 degrees until it buckles, and back; " ELEMENT ", " LAW,          \
    .options = BAR "-body_a_mesh box:0.4,0.1,0.02:10,4,1 " STILL                                   \
                   "-effect_right_angle 270*(ramp(t)-ramp(t-1.5)) -effect_right_displacement "     \
                   "-0.02*(ramp(t)-ramp(t-1.5));0;0 -effect_right_axis 1,0,0 "                     \
                   "-effect_right_axis_point 0,0.05,0.01 "                                         \
                   "-ts_dt 0.02 -ts_max_time 4 -body_a_element " ELEMENT " -body_a_material " LAW, \
    .jitter = 1e-3, .runs = RUNS, .quick = QUICK, .limits = {                                      \
      RETURNS,                                                                                     \
      {HARD_MIN_J_EVER, '>', 0.1},                                                                 \
      {HARD_NEWTON, '<', 300},                                                                     \
      {HARD_REJECTED, '<', 20}                                                                     \
    }                                                                                              \
  }

/* Stretched in one second, back in the next. */
#define STRETCH(ELEMENT, LAW, WHAT, BY, QUICK)                                             \
  {                                                                                        \
    .name = "stretch." ELEMENT "." LAW,                                                    \
    .what = "drawn to " WHAT " its length and back, " ELEMENT ", " LAW,                    \
    .options =                                                                             \
      BAR "-body_a_mesh box:0.1,0.1,0.1:2 " STILL "-effect_right_displacement " BY         \
          "*(ramp(t)-ramp(t-1.5));0;0 -ts_dt 0.02 -ts_max_time 4 -body_a_element " ELEMENT \
          " -body_a_material " LAW,                                                        \
    .jitter = 1e-3, .quick = QUICK, .limits = {                                            \
      RETURNS,                                                                             \
      {HARD_NEWTON, '<', 300},                                                             \
      {HARD_REJECTED, '<', 20}                                                             \
    }                                                                                      \
  }

/* Compressed to a third of the length in one second, back in the next; the ends cannot widen. */
#define SHORTEN(ELEMENT, LAW, QUICK)                                                               \
  {                                                                                                \
    .name = "shorten." ELEMENT "." LAW,                                                            \
    .what = "pressed to a third of its length and back, " ELEMENT ", " LAW,                        \
    .options =                                                                                     \
      BAR "-body_a_mesh box:0.1,0.1,0.1:2 " STILL                                                  \
          "-effect_right_displacement -0.0667*(ramp(t)-ramp(t-1.5));0;0 -ts_dt 0.02 -ts_max_time " \
          "4 -body_a_element " ELEMENT " -body_a_material " LAW,                                   \
    .jitter = 1e-3, .quick = QUICK, .limits = {                                                    \
      RETURNS,                                                                                     \
      {HARD_NEWTON, '<', 300},                                                                     \
      {HARD_REJECTED, '<', 20}                                                                     \
    }                                                                                              \
  }

/* Lengths and times scale alike, so all three have the same deformation. */
#define SCALE(NAME, WHAT, BOX, STEP, END)                                                         \
  {                                                                                               \
    .name = "length." NAME, .what = WHAT,                                                         \
    .options =                                                                                    \
      "-bodies a -body_a_mesh box:" BOX                                                           \
      ":2 -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 -body_a_material corotated " \
      "-effects "                                                                                 \
      "clamp,pull -effect_clamp_type fixed -effect_clamp_on xmin -effect_pull_type traction "     \
      "-effect_pull_on xmax -effect_pull_vector 0;0;-1000 -ts_dt " STEP " -ts_max_time " END,     \
    .quick = 1, .limits = {                                                                       \
      {HARD_EXCESS, '<', 1e-3},                                                                   \
      {HARD_MIN_J, '>', 0.8},                                                                     \
      {HARD_NEWTON, '<', 20},                                                                     \
      {HARD_PLACE, '>', 0.238},                                                                   \
      {HARD_PLACE, '<', 0.242}                                                                    \
    }                                                                                             \
  }

const HardCase HardCasesMotion[] = {
  ROTATION("p1", "corotated", 1),
  ROTATION("p1", "stable_neohookean", 0),
  ROTATION("cr", "corotated", 0),
  ROTATION("dg", "corotated", 0),
  ROTATION("p2", "corotated", 0),
  SPIN("p1", "corotated", 1),
  SPIN("p1", "stable_neohookean", 0),
  SPIN("cr", "corotated", 0),
  SPIN("p2", "corotated", 0),
  TWIST("p1", "corotated", 10, 0),
  TWIST("p1", "stable_neohookean", 10, 0),
  TWIST("cr", "corotated", 2, 0),
  TWIST("p2", "corotated", 2, 0),
  STRETCH("p1", "corotated", "three times", "0.2", 0),
  STRETCH("p1", "stable_neohookean", "ten times", "0.9", 1),
  STRETCH("cr", "stable_neohookean", "ten times", "0.9", 0),
  STRETCH("dg", "stable_neohookean", "ten times", "0.9", 0),
  STRETCH("p2", "stable_neohookean", "three times", "0.2", 0),
  {.name = "overstretch.p1.corotated",
   .what = "drawn to six times its length: beyond 1 + 1/nu the law draws tets through themselves, "
           "which is counted",
   .options = BAR
   "-body_a_mesh box:0.1,0.1,0.1:2 " STILL
   "-effect_right_displacement 1*t;0;0 -ts_dt 0.02 -ts_max_time 0.5 -body_a_material corotated",
   .limits = {{HARD_INVERTED, '>', 0.5}, {HARD_EXCESS, '<', 1e-3}}},
  SHORTEN("p1", "corotated", 0),
  SHORTEN("p1", "stable_neohookean", 0),
  SHORTEN("cr", "stable_neohookean", 0),
  SCALE("micro", "a beam of 1e-6 m", "3e-6,1e-6,1e-6", "1e-6", "1e-5"),
  SCALE("unit", "a beam of 1 m, to compare with", "3,1,1", "1", "10"),
  SCALE("kilo", "a beam of 1e3 m", "3e3,1e3,1e3", "1e3", "1e4"),
  {.name = "nothing",
   .what = "no gravity, no support, no motion: nothing moves",
   .options =
     "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 "
     "-body_a_density 1000 "
     "-body_a_material corotated -effects gravity -effect_gravity_vector 0,0,0 -ts_max_time 0.2",
   .quick = 1,
   .limits = {{HARD_MOVED, '<', 1e-15}, {HARD_NEWTON, '<', 0.5}, {HARD_STEPS, '>', 19}}},
  {.name = NULL},
};
