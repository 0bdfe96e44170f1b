/*
  cases_mesh.c - meshes of very poor quality: a block on the floor under sudden gravity.
*/
#include "hard.h"

#define BLOCK(NAME, WHAT, MESH, YOUNG, ELEMENT, LAW, QUICK)                                  \
  {                                                                                          \
    .name = NAME "." ELEMENT "." LAW, .what = WHAT ", " ELEMENT ", " LAW,                    \
    .options =                                                                               \
      "-bodies a -body_a_mesh %s -body_a_density 1000 -body_a_young " YOUNG                  \
      " -body_a_poisson 0.3 -sets base "                                                     \
      "-set_base_at plane:0,0,1,0 -effects clamp,gravity -effect_clamp_type fixed "          \
      "-effect_clamp_on "                                                                    \
      "base -ts_dt 0.02 -ts_max_time 0.3 -body_a_element " ELEMENT " -body_a_material " LAW, \
    .mesh = MESH, .quick = QUICK, .limits = {                                                \
      {HARD_EXCESS, '<', 1e-3},                                                              \
      {HARD_MIN_J, '>', 0.5},                                                                \
      {HARD_NEWTON, '<', 30},                                                                \
      {HARD_REJECTED, '<', 0.5}                                                              \
    }                                                                                        \
  }

#define SLIVER "smallest dihedral angle 0.5 degrees"
#define NEEDLE "needles of 1 : 1 : 100"
#define GRADED "edges from 1e-4 to 1 of the size"

const HardCase HardCasesMesh[] = {
  BLOCK("sliver", SLIVER, HardMeshSliver, "2e5", "p1", "corotated", 1),
  BLOCK("sliver", SLIVER, HardMeshSliver, "2e5", "p1", "stable_neohookean", 0),
  BLOCK("sliver", SLIVER, HardMeshSliver, "2e5", "cr", "corotated", 0),
  BLOCK("sliver", SLIVER, HardMeshSliver, "2e5", "dg", "corotated", 0),
  BLOCK("sliver", SLIVER, HardMeshSliver, "2e5", "p2", "corotated", 0),
  BLOCK("needle", NEEDLE, HardMeshNeedle, "2e5", "p1", "corotated", 1),
  BLOCK("needle", NEEDLE, HardMeshNeedle, "2e5", "cr", "corotated", 0),
  BLOCK("needle", NEEDLE, HardMeshNeedle, "2e5", "dg", "corotated", 0),
  BLOCK("needle", NEEDLE, HardMeshNeedle, "2e5", "p2", "corotated", 0),
  BLOCK("graded", GRADED, HardMeshGraded, "2e6", "p1", "corotated", 0),
  BLOCK("graded", GRADED, HardMeshGraded, "2e6", "cr", "corotated", 0),
  BLOCK("graded", GRADED, HardMeshGraded, "2e6", "p2", "corotated", 0),
  {.name = NULL},
};
