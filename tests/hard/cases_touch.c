/*
  cases_touch.c - degenerate contact: contact in points or lines, redundant constraints, cycling
  active sets, discontinuous normals, failing solves; and the same contact at the size of a cell and
  of a mountain.
*/
#include "hard.h"
#include <unistd.h>
#include "../verify/contact.h"

#define BLOCK(body, cells, at, velocity, law)                                                 \
  "-body_" body "_mesh box:0.1,0.1,0.1:" cells " -body_" body "_translate " at " -body_" body \
  "_velocity " velocity " -body_" body "_material stable_neohookean -body_" body              \
  "_poisson 0.3 -body_" body "_density 1000 -body_" body "_young " law " "

/* Two blocks of the same mesh, the upper one initially in exact contact, and moving down
   obliquely. */
#define JUST(place)                                              \
  "-bodies a,b " BLOCK("a", "2", "0,0,0", "0,0,0", "1e5") BLOCK( \
    "b", "2", place, "-0.3,-0.2,-1",                             \
    "1e5") "-effects meet -effect_meet_type contact -ts_dt 0.002 -ts_max_time 0.1 -snes_rtol 1e-9"
#define JUST_LIMITS                                                                  \
  {                                                                                  \
    {HARD_EXCESS, '<', 1e-6}, {HARD_MOMENTUM, '<', 1e-6}, {HARD_ANGULAR, '<', 0.05}, \
      {HARD_MIN_J, '>', 0.5}, {HARD_VOLUME, '<', 0.05}, {HARD_DEPTH, '<', 0.02},     \
      {HARD_NEWTON, '<', 200},                                                       \
    {                                                                                \
      HARD_REJECTED, '<', 3                                                          \
    }                                                                                \
  }

/* A block falls onto another one that stands on the floor, and slides over it. */
#define SLIDES                                                                      \
  "-bodies a,b " BLOCK("a", "3", "0,0,0", "0,0,0", "1e5")                           \
    BLOCK("b", "2", "0.02,0.01,0.102", "0.2,0,-0.5",                                \
          "1e5") "-effects gravity,floor,meet -effect_floor_type contact "          \
                 "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction 0.4 " \
                 "-effect_meet_type contact -effect_meet_friction 0.2 "             \
                 "-ts_dt 0.005 -ts_max_time 0.3"
#define SLIDES_LIMITS                                                           \
  {                                                                             \
    {HARD_EXCESS, '<', 1e-3}, {HARD_MIN_J, '>', 0.5}, {HARD_VOLUME, '<', 0.05}, \
      {HARD_DEPTH, '<', 0.01}, {HARD_SPEED, '<', 0.5}, {HARD_NEWTON, '<', 500}, \
    {                                                                           \
      HARD_REJECTED, '<', 5                                                     \
    }                                                                           \
  }

/* All lengths scale with L, and times with the same wave speed: the same solution, scaled. */
#define SCALE(L, near, at, dt, end)                                                                \
  "-bodies a,b -body_a_mesh box:" L "," L "," L ":3 -body_b_mesh box:" L "," L "," L               \
  ":2 -body_b_translate " near "," near "," at                                                     \
  " -body_a_material stable_neohookean -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density "     \
  "1000 "                                                                                          \
  "-body_b_material stable_neohookean -body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 " \
  "-body_b_velocity "                                                                              \
  "0.2,0,-1 -effects floor,meet -effect_floor_type contact "                                       \
  "-effect_floor_obstacle plane:0,0,1,0 -effect_meet_type contact "                                \
  "-effect_meet_friction 0.3 -ts_dt " dt " -ts_max_time " end
#define SCALE_LIMITS                                                            \
  {                                                                             \
    {HARD_EXCESS, '<', 1e-6}, {HARD_MIN_J, '>', 0.5}, {HARD_VOLUME, '<', 0.05}, \
      {HARD_DEPTH, '<', 0.02}, {HARD_NEWTON, '<', 100},                         \
    {                                                                           \
      HARD_REJECTED, '<', 1                                                     \
    }                                                                           \
  }

/* A fine body below a coarse one: 169 vertices of the fine surface are in contact with one face of
   the coarse one. */
#define HUNDRED(friction)                                                                          \
  "-bodies a,b -body_a_mesh box:0.1,0.1,0.02:12,12,1 -body_b_mesh box:0.1,0.1,0.1:1 "              \
  "-body_b_translate "                                                                             \
  "0,0,0.0201 -body_a_material stable_neohookean -body_a_young 1e5 -body_a_poisson 0.3 "           \
  "-body_a_density "                                                                               \
  "1000 "                                                                                          \
  "-body_b_material stable_neohookean -body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 " \
  "-effects "                                                                                      \
  "gravity,floor,meet -effect_floor_type contact -effect_floor_obstacle "                          \
  "plane:0,0,1,0 -effect_floor_friction 0.3 -effect_meet_type contact "                            \
  "-effect_meet_friction " friction " -ts_dt 0.005 -ts_max_time 0.03"
#define HUNDRED_LIMITS                                                         \
  {                                                                            \
    {HARD_EXCESS, '<', 1e-6}, {HARD_MIN_J, '>', 0.9}, {HARD_DEPTH, '<', 3e-3}, \
      {HARD_NEWTON, '<', 300}, {HARD_REJECTED, '<', 3},                        \
    {                                                                          \
      HARD_OWN, '>', 100, "pairs", ""                                          \
    }                                                                          \
  }

/* A band over a rising triangulated saddle: two facets are in contact in its transverse valleys. %s
   is the path of the saddle. */
#define SADDLE                                                                                   \
  "-bodies a -body_a_mesh box:0.12,0.024,0.01:16,4,1 -body_a_material corotated -body_a_young "  \
  "2e4 "                                                                                         \
  "-body_a_poisson 0.4 -body_a_density 1000 -effects gravity,ends,tool -effect_ends_type fixed " \
  "-effect_ends_on xmin,xmax -effect_tool_type contact -effect_tool_response projected "         \
  "-effect_tool_obstacle mesh:%s -effect_tool_obstacle_at 0.06,0.012,-0.004 "                    \
  "-effect_tool_displacement 0;0;0.02*ramp(t/0.4) -ts_dt 0.02 -ts_max_time 0.6"
/* A block with a rigid plate inside, whose midplane contains a layer of nodes: both separation
   directions have equal length. */
#define MIDDLE                                                                           \
  "-bodies a " BLOCK(                                                                    \
    "a", "2", "0,0,0", "0,0,0",                                                          \
    "1e5") "-effects plate -effect_plate_type contact -effect_plate_response projected " \
           "-effect_plate_obstacle box:-0.05,-0.05,0.045,0.15,0.15,0.055 -ts_dt 0.005 "  \
           "-ts_max_time 0.4"
/* Steps in which the block moves by six times its height, with a limit on Newton iterations. */
#define LONG_STEPS(most)                                                                  \
  "-bodies a " BLOCK(                                                                     \
    "a", "2", "0,0,0.02", "1,0,-10",                                                      \
    "1e5") "-effects floor -effect_floor_type contact -effect_floor_response projected "  \
           "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction 0.3 -ts_dt 0.06 " \
           "-ts_max_time 0.18 -snes_max_it " most

/* A thick saddle, 8 x 8 squares of two triangles: z = h (y / b)^2 - h (x / a)^2 above, flat
   below. */
static PetscErrorCode write_saddle(char path[512])
{
  const int n = 8;
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".off", path, &f));
  if (f) {
    fprintf(f, "OFF\n%d %d 0\n", 2 * (n + 1) * (n + 1), 4 * n * n + 8 * n);
    for (int v = 0; v < 2 * (n + 1) * (n + 1); v++) {
      const double x = 2. * (v % (n + 1)) / n - 1;
      const double y = 2. * (v / (n + 1) % (n + 1)) / n - 1;

      fprintf(f, "%.17g %.17g %.17g\n", 0.02 * x, 0.016 * y,
              v < (n + 1) * (n + 1) ? 0.006 * (y * y - x * x) - 0.006 : -0.03);
    }
    for (int i = 0; i < n * n; i++) {
      const int a = i / n * (n + 1) + i % n;
      const int b = a + n + 1;
      const int down = (n + 1) * (n + 1);

      fprintf(f, "3 %d %d %d\n3 %d %d %d\n", a, a + 1, b + 1, a, b + 1, b);
      fprintf(f, "3 %d %d %d\n3 %d %d %d\n", down + a, down + b + 1, down + a + 1, down + a,
              down + b, down + b + 1);
    }
    for (int i = 0; i < 4 * n; i++) {
      const int k = i % n;
      const int down = (n + 1) * (n + 1);
      const int a = i < n       ? k
                    : i < 2 * n ? k * (n + 1) + n
                    : i < 3 * n ? n * (n + 1) + n - k
                                : (n - k) * (n + 1);
      const int b = a + (i < n ? 1 : i < 2 * n ? n + 1 : i < 3 * n ? -1 : -n - 1);

      fprintf(f, "3 %d %d %d\n3 %d %d %d\n", a, down + b, b, a, down + a, down + b);
    }
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest number of simultaneous contact pairs. */
static PetscErrorCode count_pairs(HardRun *r, const SbStep *step)
{
  PetscReal pairs;

  PetscFunctionBeginUser;
  if (!step->step)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(contact_column(r->run, step->t, "meet", "contacts", &pairs));
  r->value[HARD_OWN] = PetscMax(r->value[HARD_OWN], pairs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const HardCase HardCasesTouch[] = {
  {.name = "just.face",
   .seconds = 600,
   .what = "faces coplanar, vertices on vertices",
   .options = JUST("0,0,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "just.half",
   .seconds = 600,
   .what = "vertices exactly on edges",
   .options = JUST("0.025,0.05,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "just.edge",
   .seconds = 600,
   .what = "edge on edge: contact without area",
   .options = JUST("0.1,0,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "just.corner",
   .seconds = 600,
   .what = "corner on corner: contact in a point",
   .options = JUST("0.1,0.1,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "hundred.smooth",
   .seconds = 600,
   .what = "a hundred contacts on one vertex",
   .options = HUNDRED("0"),
   .look = count_pairs,
   .runs = 1,
   .quick = 1,
   .limits = HUNDRED_LIMITS},
  {.name = "hundred.friction",
   .seconds = 600,
   .what = "a hundred contacts on one vertex, friction",
   .options = HUNDRED("0.3"),
   .look = count_pairs,
   .runs = 1,
   .limits = HUNDRED_LIMITS},
  {.name = "slides",
   .seconds = 600,
   .what = "falls on another block and slides over it",
   .options = SLIDES,
   .jitter = 1e-5,
   .jitter_speed = 1e-3,
   .quick = 1,
   .limits = SLIDES_LIMITS},
  {.name = "scale.micro",
   .seconds = 600,
   .what = "contact in a micrometre",
   .options = SCALE("1e-6", "1e-7", "1.05e-6", "1e-8", "1e-6"),
   .jitter = 1e-6,
   .quick = 1,
   .limits = SCALE_LIMITS},
  {.name = "scale.kilo",
   .seconds = 600,
   .what = "contact in a kilometre",
   .options = SCALE("1000", "100", "1050", "10", "1000"),
   .jitter = 1e-6,
   .quick = 1,
   .limits = SCALE_LIMITS},
  {.name = "cycle.saddle",
   .seconds = 600,
   .what = "a band without friction in the valleys of a faceted saddle",
   .options = SADDLE,
   .mesh = write_saddle,
   .jitter = 1e-5,
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3},
              {HARD_MIN_J, '>', 0.5},
              {HARD_DEPTH, '<', 1e-3},
              {HARD_NEWTON, '<', 150},
              {HARD_REJECTED, '<', 3}}},
  {.name = "cycle.middle",
   .seconds = 600,
   .what = "nodes in the middle of a rigid plate, where both separation directions are as long",
   .options = MIDDLE,
   .jitter = 1e-9,
   .quick = 1,
   .limits = {{HARD_MIN_J, '>', 0.3}, {HARD_NEWTON, '<', 300}, {HARD_REJECTED, '<', 3}}},
  {.name = "fails.repeated",
   .seconds = 600,
   .what = "steps that fail are repeated, shorter",
   .options = LONG_STEPS("6"),
   .jitter = 1e-5,
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3},
              {HARD_MIN_J, '>', 0.3},
              {HARD_DEPTH, '<', 1e-3},
              {HARD_REJECTED, '>', 0},
              {HARD_REJECTED, '<', 30}}},
  {.name = "fails.stops",
   .seconds = 600,
   .what = "all attempts at a step fail: said, and what there is stays",
   .options = LONG_STEPS("1"),
   .stops = "DIVERGED_MAX_IT",
   .quick = 1,
   .limits = {{HARD_MIN_J, '>', 0.3}, {HARD_DEPTH, '<', 1e-3}, {HARD_REJECTED, '>', 5}}},
  {.name = NULL},
};
