/*
  cases_material.c - materials in extreme cases: cantilevers.
*/
#include "hard.h"

#define INCOMPRESSIBLE(ELEMENT, LAW, CELLS, END, QUICK)                                          \
  {                                                                                              \
    .name = "incompressible." ELEMENT "." LAW, .what = "nu = 0.499999, " ELEMENT ", " LAW,       \
    .options = "-bodies a -body_a_density 1000 -effects clamp,gravity -effect_clamp_type fixed " \
               "-effect_clamp_on xmin -ts_dt 0.02 -body_a_young 1e6 -body_a_poisson 0.499999 "   \
               "-body_a_mesh box:0.3,0.1,0.1:" CELLS " -ts_max_time " END                        \
               " -body_a_element " ELEMENT " -body_a_material " LAW,                             \
    .quick = QUICK, .limits = {                                                                  \
      {HARD_EXCESS, '<', 1e-3},                                                                  \
      {HARD_VOLUME, '<', 1e-3},                                                                  \
      {HARD_MIN_J, '>', 0.9},                                                                    \
      {HARD_NEWTON, '<', 250},                                                                   \
      {HARD_REJECTED, '<', 2.5}                                                                  \
    }                                                                                            \
  }

/* A stiff core, Young's modulus 1e9 Pa inside 1e3 Pa, away from the ends. */
#define INCLUSION(ELEMENT, LAW, QUICK)                                                         \
  {                                                                                            \
    .name = "inclusion." ELEMENT "." LAW,                                                      \
    .what = "core a million times stiffer, " ELEMENT ", " LAW,                                 \
    .options =                                                                                 \
      "-bodies a -body_a_mesh box:0.3,0.1,0.1:3 -body_a_density 1000 -body_a_young 1e3 "       \
      "-body_a_poisson 0.3 "                                                                   \
      "-body_a_inclusions core -set_core_at box:0.1,0.03,0.03,0.2,0.07,0.07 -sets core "       \
      "-inclusion_core_young 1e9 -inclusion_core_poisson 0.3 -inclusion_core_material " LAW    \
      " -effects clamp,gravity -effect_clamp_type fixed -effect_clamp_on xmin "                \
      "-effect_gravity_vector "                                                                \
      "0,0,-0.2 -ts_dt 0.05 -ts_max_time 1 -body_a_element " ELEMENT " -body_a_material " LAW, \
    .quick = QUICK, .limits = {                                                                \
      {HARD_EXCESS, '<', 1e-3},                                                                \
      {HARD_MIN_J, '>', 0.5},                                                                  \
      {HARD_NEWTON, '<', 40},                                                                  \
      {HARD_REJECTED, '<', 0.5}                                                                \
    }                                                                                          \
  }

const HardCase HardCasesMaterial[] = {
  INCOMPRESSIBLE("p1", "corotated", "2", "0.4", 1),
  INCOMPRESSIBLE("p1", "stable_neohookean", "2", "0.4", 0),
  INCOMPRESSIBLE("cr", "corotated", "1", "0.1", 0),
  INCOMPRESSIBLE("dg", "corotated", "1", "0.1 -solver pressure", 0),
  INCOMPRESSIBLE("p2", "corotated", "1", "0.1", 0),
  INCLUSION("p1", "corotated", 1),
  INCLUSION("p1", "stable_neohookean", 0),
  INCLUSION("cr", "corotated", 0),
  INCLUSION("dg", "corotated", 0),
  INCLUSION("p2", "corotated", 0),
  {.name = "light.p1",
   .what = "density of 1e-9 kg/m^3 under traction, co-rotated, P1",
   .options =
     "-bodies a -body_a_mesh box:0.5,0.1,0.1:2 -body_a_density 1e-9 -body_a_young 1e5 "
     "-body_a_poisson 0.3 -body_a_material corotated -effects clamp,pull -effect_clamp_type fixed "
     "-effect_clamp_on xmin -effect_pull_type traction -effect_pull_on xmax "
     "-effect_pull_vector 0;0;-100 -ts_dt 0.02 -ts_max_time 0.4",
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3}, {HARD_MIN_J, '>', 0.9}, {HARD_NEWTON, '<', 40}}},
  {.name = NULL},
};
