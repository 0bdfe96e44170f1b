/*
  cases_recovery.c - bodies with unphysical initial positions, which have to return to their rest
  shape.

  A free cube of 0.1 m without damping except by implicit Euler: it may return at any position and
  orientation, which HARD_SHAPE ignores. There are other equilibria, with folds: tets that wind
  twice around an edge, or a flat one. Short steps keep enough motion to overcome them; with longer
  ones the body loses its energy before. Of 30 starts so many end in a fold, with steps of a tenth,
  a twentieth, a fortieth of the slowest period (0.06 s):

    point, corotated            5, 3, 0
    random, corotated           1, 0, 0
    point, stable_neohookean    1, 1, 1
*/
#include "hard.h"

#define CUBE                                                                           \
  "-bodies a -body_a_young 1e4 -body_a_poisson 0.3 -body_a_density 1000 -ts_dt 0.005 " \
  "-ts_max_time 2 "
#define SHORT " -ts_dt 0.00125"

#define RECOVERY(NAME, WHAT, START, ELEMENT, LAW, CELLS, QUICK, MORE)                 \
  {                                                                                   \
    .name = NAME "." ELEMENT "." LAW, .what = WHAT ", " ELEMENT ", " LAW,             \
    .options = CUBE "-body_a_mesh box:0.1,0.1,0.1:" CELLS " -body_a_element " ELEMENT \
                    " -body_a_material " LAW MORE,                                    \
    .start = START, .jitter = 1e-3, .quick = QUICK, .limits = {                       \
      {HARD_EXCESS, '<', 1e-5},                                                       \
      {HARD_MIN_J, '>', 0.99},                                                        \
      {HARD_MAX_J, '<', 1.01},                                                        \
      {HARD_SHAPE, '<', 0.01},                                                        \
      {HARD_NEWTON, '<', 2500}                                                        \
    }                                                                                 \
  }

/* Equilibria with inverted or flat tets: there is no motion, and the tets are counted. */
#define STAYS(NAME, WHAT, START, LAW)                                                             \
  {                                                                                               \
    .name = NAME ".p1." LAW,                                                                      \
    .what = WHAT ", p1, " LAW ": an equilibrium of this law, in which inverted tets are counted", \
    .options = CUBE "-body_a_mesh box:0.1,0.1,0.1:3 -ts_max_time 0.1 -body_a_material " LAW,      \
    .start = START, .quick = 1, .limits = {                                                       \
      {HARD_EXCESS, '<', 1e-5},                                                                   \
      {HARD_INVERTED, '>', 0.5},                                                                  \
      {HARD_SPEED, '<', 1e-9}                                                                     \
    }                                                                                             \
  }

/* Guarantee for CR and DG from this state: no inverted cells at the end, and decreasing energy. The
   shape may differ. */
#define UNFOLDS(NAME, WHAT, START, ELEMENT, LAW, CELLS, QUICK)                        \
  {                                                                                   \
    .name = NAME "." ELEMENT "." LAW, .what = WHAT ", " ELEMENT ", " LAW,             \
    .options = CUBE "-body_a_mesh box:0.1,0.1,0.1:" CELLS " -body_a_element " ELEMENT \
                    " -body_a_material " LAW,                                         \
    .start = START, .jitter = 1e-3, .runs = 3, .quick = QUICK, .limits = {            \
      {HARD_EXCESS, '<', 1e-5},                                                       \
      {HARD_LEFT, '<', 0.2},                                                          \
      {HARD_MIN_J, '>', 0.1},                                                         \
                                                                                      \
      {HARD_NEWTON, '<', 2500}                                                        \
    }                                                                                 \
  }

#define RANDOM "every vertex anywhere in the box"
#define POINT "all vertices at one point, but for 1e-4 of the size"
#define MIRROR "mirrored, every tet inverted"
#define FLAT "all vertices in a plane"

const HardCase HardCasesRecovery[] = {
  RECOVERY("random", RANDOM, HardStartRandom, "p1", "corotated", "3", 1, SHORT),
  RECOVERY("random", RANDOM, HardStartRandom, "p1", "stable_neohookean", "3", 0, SHORT),
  UNFOLDS("random", RANDOM, HardStartRandom, "cr", "corotated", "2", 0),
  UNFOLDS("random", RANDOM, HardStartRandom, "dg", "corotated", "2", 0),
  RECOVERY("point", POINT, HardStartPoint, "p1", "corotated", "3", 0, SHORT),
  RECOVERY("point", POINT, HardStartPoint, "p1", "stable_neohookean", "3", 0, ""),
  RECOVERY("mirror", MIRROR, HardStartMirror, "p1", "corotated", "3", 0, ""),
  RECOVERY("mirror", MIRROR, HardStartMirror, "p1", "stable_neohookean", "3", 1, ""),
  UNFOLDS("mirror", MIRROR, HardStartMirror, "cr", "corotated", "2", 0),
  UNFOLDS("mirror", MIRROR, HardStartMirror, "dg", "corotated", "2", 1),
  STAYS("mirror", MIRROR, HardStartMirror, "stvk"),
  STAYS("point", "all vertices at exactly one point", HardStartExactPoint, "stvk"),
  RECOVERY("flat", FLAT, HardStartFlat, "p1", "corotated", "3", 1, ""),
  RECOVERY("flat", FLAT, HardStartFlat, "p1", "stable_neohookean", "3", 0, ""),
  RECOVERY("flat", FLAT, HardStartFlat, "cr", "corotated", "2", 1, ""),
  RECOVERY("flat", FLAT, HardStartFlat, "cr", "stable_neohookean", "2", 0, ""),
  RECOVERY("flat", FLAT, HardStartFlat, "dg", "corotated", "2", 0, ""),
  RECOVERY("flat", FLAT, HardStartFlat, "p2", "corotated", "2", 0, ""),
  UNFOLDS("mirror", MIRROR, HardStartMirror, "p2", "corotated", "2", 0),
  {.name = NULL},
};
