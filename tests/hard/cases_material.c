/*
  cases_material.c - materials at their limits.
*/
#include "hard.h"

const HardCase HardCasesMaterial[] = {
  {.name = "light.p1",
   .what = "density of 1e-9 kg/m^3 under traction, co-rotated, P1",
   .options =
     "-bodies a -body_a_mesh box:0.5,0.1,0.1:2 -body_a_density 1e-9 -body_a_young 1e5 -body_a_poisson 0.3 "
     "-body_a_material corotated -effects clamp,pull -effect_clamp_type support -effect_clamp_on xmin "
     "-effect_pull_type traction -effect_pull_on xmax -effect_pull_vector 0;0;-100 -ts_dt 0.02 -ts_max_time "
     "0.4",
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3}, {HARD_MIN_J, '>', 0.5}, {HARD_NEWTON, '<', 50}}},
  {.name = NULL},
};
