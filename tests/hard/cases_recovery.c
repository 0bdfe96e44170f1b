/*
  cases_recovery.c - bodies that start far from anything physical, and have to come back to their rest shape.
*/
#include "hard.h"

#define CUBE                                                                                          \
  "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_young 1e4 -body_a_density 1000 -effects damping " \
  "-effect_damping_alpha 5 -ts_dt 0.01 -ts_max_time 4 "

const HardCase HardCasesRecovery[] = {
  {.name = "random.p1.corotated",
   .what = "every vertex anywhere in the box, P1, co-rotated",
   .options = CUBE "-body_a_poisson 0.3 -body_a_material corotated",
   .start = HardStartRandom,
   .runs = 10,
   .quick = 1,
   .limits =
     {{HARD_EXCESS, '<', 1e-6}, {HARD_MIN_J, '>', 0.99}, {HARD_SHAPE, '<', 1e-3}, {HARD_NEWTON, '<', 500}}},
  {.name = NULL},
};
