/*
  cases_touch.c - contact that is hard to decide: what touches in a point or a line or says the same many times, who touches wants to cycle, normals
  that jump, solves that fail; and the same contact by all responses, in the size of a cell and of a mountain.
*/
#include "hard.h"
#include "../verify/contact.h"

#define BLOCK(body, cells, at, velocity, law)                                                        \
  "-body_" body "_mesh box:0.1,0.1,0.1:" cells " -body_" body "_translate " at " -body_" body        \
  "_velocity " velocity " -body_" body "_material neohookean -body_" body "_poisson 0.3 -body_" body \
  "_density 1000 -body_" body "_young " law " "

/* Two blocks of the same mesh, the upper one at a place where surfaces just touch, and coming down obliquely. */
#define JUST(place)                                       \
  "-bodies a,b " BLOCK("a", "2", "0,0,0", "0,0,0", "1e5") \
    BLOCK("b", "2", place, "-0.3,-0.2,-1",                \
          "1e5") "-effects meet -effect_meet_type collision -ts_dt 0.002 -ts_max_time 0.1 -snes_rtol 1e-9"
#define JUST_LIMITS                                                                                          \
  {                                                                                                          \
    {HARD_EXCESS, '<', 1e-6}, {HARD_MOMENTUM, '<', 1e-6}, {HARD_ANGULAR, '<', 0.05}, {HARD_MIN_J, '>', 0.5}, \
      {HARD_VOLUME, '<', 0.05}, {HARD_DEPTH, '<', 0.02}, {HARD_NEWTON, '<', 200},                            \
    {                                                                                                        \
      HARD_REJECTED, '<', 3                                                                                  \
    }                                                                                                        \
  }

/* A block falls onto another one that stands on the floor and slides over it. */
#define RESPONSE(response)                                                                                \
  "-bodies a,b " BLOCK("a", "3", "0,0,0", "0,0,0", "1e5") BLOCK(                                          \
    "b", "2", "0.02,0.01,0.102", "0.2,0,-0.5",                                                            \
    "1e5") "-effects gravity,floor,meet -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 " \
           "-effect_floor_friction 0.4 "                                                                  \
           "-effect_meet_type collision -effect_meet_friction 0.2 -ts_dt 0.005 -ts_max_time 0.3 " response
#define RESPONSE_LIMITS(depth)                                                                            \
  {                                                                                                       \
    {HARD_EXCESS, '<', 1e-3}, {HARD_MIN_J, '>', 0.5}, {HARD_VOLUME, '<', 0.05}, {HARD_DEPTH, '<', depth}, \
      {HARD_SPEED, '<', 0.5}, {HARD_NEWTON, '<', 500},                                                    \
    {                                                                                                     \
      HARD_REJECTED, '<', 5                                                                               \
    }                                                                                                     \
  }

/* Length L in all of it, waves as fast as the times are long: the same solution but for L. */
#define SCALE(L, near, at, dt, end)                                                                \
  "-bodies a,b -body_a_mesh box:" L "," L "," L ":3 -body_b_mesh box:" L "," L "," L               \
  ":2 -body_b_translate " near "," near "," at                                                     \
  " -body_a_material neohookean -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 "       \
  "-body_b_material neohookean "                                                                   \
  "-body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 -body_b_velocity 0.2,0,-1 -effects " \
  "floor,meet "                                                                                    \
  "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_meet_type collision "   \
  "-effect_meet_friction 0.3 "                                                                     \
  "-ts_dt " dt " -ts_max_time " end
#define SCALE_LIMITS                                                                                     \
  {                                                                                                      \
    {HARD_EXCESS, '<', 1e-6}, {HARD_MIN_J, '>', 0.5}, {HARD_VOLUME, '<', 0.05}, {HARD_DEPTH, '<', 0.02}, \
      {HARD_NEWTON, '<', 100},                                                                           \
    {                                                                                                    \
      HARD_REJECTED, '<', 1                                                                              \
    }                                                                                                    \
  }

/* A fine body under a coarse one: 169 places of the fine surface push on the four vertices of a face of the coarse one. */
#define HUNDRED(response, friction)                                                                          \
  "-bodies a,b -body_a_mesh box:0.1,0.1,0.02:12,12,1 -body_b_mesh box:0.1,0.1,0.1:1 -body_b_translate "      \
  "0,0,0.0201 "                                                                                              \
  "-body_a_material neohookean -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 -body_b_material " \
  "neohookean "                                                                                              \
  "-body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 -effects gravity,floor,meet "                  \
  "-effect_floor_type contact "                                                                              \
  "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction 0.3 -effect_meet_type collision "             \
  "-effect_meet_response " response " -effect_meet_friction " friction " -ts_dt 0.005 -ts_max_time 0.03"
#define HUNDRED_LIMITS                                                                                  \
  {                                                                                                     \
    {HARD_EXCESS, '<', 1e-6}, {HARD_MIN_J, '>', 0.9}, {HARD_DEPTH, '<', 3e-3}, {HARD_NEWTON, '<', 300}, \
      {HARD_REJECTED, '<', 3},                                                                          \
    {                                                                                                   \
      HARD_OWN, '>', 100, "pairs", ""                                                                   \
    }                                                                                                   \
  }

/* Most pairs that touch at a time. */
static PetscErrorCode count_pairs(HardRun *r, const SbStep *step)
{
  PetscReal pairs;

  PetscFunctionBeginUser;
  if (!step->step) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(contact_column(r->run, step->t, "meet", "contacts", &pairs));
  r->value[HARD_OWN] = PetscMax(r->value[HARD_OWN], pairs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const HardCase HardCasesTouch[] = {
  {.name = "just.face",
   .what = "faces coplanar, vertices on vertices",
   .options = JUST("0,0,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "just.half",
   .what = "vertices exactly on edges",
   .options = JUST("0.025,0.05,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "just.edge",
   .what = "edge on edge: contact without area",
   .options = JUST("0.1,0,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "just.corner",
   .what = "corner on corner: contact in a point",
   .options = JUST("0.1,0.1,0.1"),
   .jitter = 1e-10,
   .quick = 1,
   .limits = JUST_LIMITS},
  {.name = "hundred.projected",
   .what = "a hundred contacts on one vertex, projected",
   .options = HUNDRED("projected", "0"),
   .look = count_pairs,
   .runs = 1,
   .quick = 1,
   .limits = HUNDRED_LIMITS},
  {.name = "hundred.multiplier",
   .what = "a hundred contacts on one vertex, multiplier",
   .options = HUNDRED("multiplier", "0"),
   .look = count_pairs,
   .runs = 1,
   .limits = HUNDRED_LIMITS},
  {.name = "hundred.friction",
   .what = "a hundred contacts on one vertex, friction",
   .options = HUNDRED("projected", "0.3"),
   .look = count_pairs,
   .runs = 1,
   .limits = HUNDRED_LIMITS},
  {.name = "response.projected",
   .what = "falls and slides: projected",
   .options = RESPONSE(""),
   .jitter = 1e-5,
   .jitter_speed = 1e-3,
   .quick = 1,
   .limits = RESPONSE_LIMITS(0.01)},
  {.name = "response.multiplier",
   .what = "falls and slides: multiplier",
   .options = RESPONSE("-effect_floor_response multiplier -effect_meet_response multiplier"),
   .jitter = 1e-5,
   .jitter_speed = 1e-3,
   .limits = RESPONSE_LIMITS(0.01)},
  {.name = "response.augmented",
   .what = "falls and slides: augmented",
   .options = RESPONSE("-effect_floor_response augmented -effect_meet_response augmented"),
   .jitter = 1e-5,
   .jitter_speed = 1e-3,
   .limits = RESPONSE_LIMITS(0.01)},
  {.name = "response.penalty",
   .what = "falls and slides: penalty",
   .options = RESPONSE("-effect_floor_response penalty -effect_meet_response penalty"),
   .jitter = 1e-5,
   .jitter_speed = 1e-3,
   .limits = RESPONSE_LIMITS(0.05)},
  {.name = "scale.micro",
   .what = "contact in a micrometre",
   .options = SCALE("1e-6", "1e-7", "1.05e-6", "1e-8", "1e-6"),
   .jitter = 1e-6,
   .quick = 1,
   .limits = SCALE_LIMITS},
  {.name = "scale.kilo",
   .what = "contact in a kilometre",
   .options = SCALE("1000", "100", "1050", "10", "1000"),
   .jitter = 1e-6,
   .quick = 1,
   .limits = SCALE_LIMITS},
  {.name = NULL},
};
