/*
  cases_time.c - steps that are too long, and very long runs.

  The cube of 0.1 m oscillates with a period of about 0.05 s.
*/
#include "hard.h"

#define CUBE                                                                                \
  "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_young 5e4 -body_a_poisson 0.3 "         \
  "-body_a_density 1000 "                                                                   \
  "-effects clamp,gravity -effect_clamp_type fixed -effect_clamp_on zmin -body_a_velocity " \
  "1,0,0.5 "
#define TIGHT "-ksp_rtol 1e-14 -snes_rtol 1e-14 "

#define COARSE(ELEMENT, TIME, LAW, QUICK)                                              \
  {                                                                                    \
    .name = "coarse." TIME "." ELEMENT "." LAW,                                        \
    .what = "steps of 1 s, the period is 0.05 s; " TIME ", " ELEMENT ", " LAW,         \
    .options = CUBE "-ts_dt 1 -ts_max_time 50 -time " TIME " -body_a_element " ELEMENT \
                    " -body_a_material " LAW,                                          \
    .jitter = 0.01, .runs = 10, .quick = QUICK, .limits = {                            \
      {HARD_EXCESS, '<', 1e-3},                                                        \
      {HARD_MIN_J, '>', 0.5},                                                          \
      {HARD_NEWTON, '<', 100},                                                         \
      {HARD_SPEED, '<', 1e-3}                                                          \
    }                                                                                  \
  }

/* Vertices finally move apart without bound, and the run stops with the reason. */
#define BEYOND(TIME)                                                                             \
  {                                                                                              \
    .name = "beyond." TIME, .what = "five times the stable step of " TIME,                       \
    .options = "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_young 5e4 -body_a_poisson 0.3 " \
               "-body_a_density 1000 "                                                           \
               "-body_a_material corotated -body_a_angular_velocity 1,0,0 -ts_dt 0.02 "          \
               "-ts_max_time 20 -time " TIME,                                                    \
    .quick = 1, .stops = "beyond the stable one", .limits = {                                    \
      {HARD_STEPS, '<', 900}                                                                     \
    }                                                                                            \
  }

const HardCase HardCasesTime[] = {
  COARSE("p1", "euler_implicit", "corotated", 1),
  COARSE("p1", "euler_implicit", "stable_neohookean", 0),
  COARSE("cr", "euler_implicit", "corotated", 0),
  COARSE("dg", "euler_implicit", "corotated", 0),
  COARSE("p2", "euler_implicit", "corotated", 0),
  {.name = "coarse.newmark.p1.linear",
   .what = "steps of 1 s, the period is 0.05 s; newmark, p1, linear",
   .options = CUBE TIGHT
   "-effect_gravity_vector 0,0,0 -ts_dt 1 -ts_max_time 200 -time newmark -body_a_material linear",
   .jitter = 0.01,
   .quick = 1,
   .limits = {{HARD_DRIFT, '<', 1e-9}}},
  BEYOND("euler_explicit"),
  BEYOND("euler_symplectic"),
  {.name = "million.newmark",
   .what = "1e6 steps of six tets, newmark, linear",
   .options =
     "-bodies a -body_a_mesh box:0.1,0.1,0.1:1 -body_a_young 1e5 -body_a_poisson 0.3 "
     "-body_a_density 1000 "
     "-body_a_material linear -body_a_velocity 0.1,0,0.3 -effects clamp -effect_clamp_type fixed "
     "-effect_clamp_on xmin -time newmark -ts_dt 0.003 -ts_max_time 3000 " TIGHT,
   .ranks = {1},
   .seconds = 900,
   .limits = {{HARD_DRIFT, '<', 1e-9}, {HARD_STEPS, '>', 999999}}},
  {.name = NULL},
};
