/*
  hard.h - hard cases: scenarios in which simulations of soft bodies fail, each with limits on
  measured quantities.

  To add a case: one row in a table cases_*.c,
    {.name = "spin.p1", .what = "spin at 1000 rad/s, P1", .options = "-bodies a ...", .quick = 1,
     .limits = {{HARD_ANGULAR, '<', 1e-3}, {HARD_MIN_J, '>', 0.1}}}
  and, for a new table, one line in hard.c. Every run of a case must reach its end (or end early
  with the text `stops`), with finite results, and satisfy every limit. A case has `runs` runs: the
  first one as given, the others with the initial state perturbed by `jitter` and `jitter_speed`;
  the worst result of all runs counts. Callbacks beyond options: `mesh` writes a mesh, `start`
  changes the state before the first step, `look` is called after each step (and may measure
  HARD_OWN...), `solve` replaces SbRunSolve(). These functions use limits for verdicts, not
  SB_CHECK(), which counts in hard.c only.

  `make build/tests/hard/hard`, then
    scripts/mpi 2 build/tests/hard/hard -case spin.p1     all runs of a case; -runs 1: the first
    only; -verbose: each step; -more "OPTIONS": further options tests/run --build build --group hard
    --match spin     cases with `quick` runs, on two ranks: as in `make check` tests/run --build
    build --group hard --all            everything, on the ranks of each case: as in `make
    check-hard` scripts/stability                                     table of the safety factors of
    the last runs; --write: into docs/reports/stability.md
*/
#pragma once
#include <sb.h>

#define HARD_LIMITS 10
#define HARD_TEXT 4096

/* Measured quantities. Energies are relative to the largest energy of the run: initial energy,
   kinetic plus strain energy, or work done. */
typedef enum {
  HARD_EXCESS, /* largest energy above the initial one plus work of loads and prescribed motion less damping */
  HARD_ACCOUNT, /* largest absolute value of this difference: energy gained or lost by the integrator */
  HARD_RISE, /* largest increase of kinetic plus strain energy in a step: for bodies without loads and prescribed motion */
  HARD_DRIFT,    /* largest change of kinetic plus strain energy since the start: for the same */
  HARD_LEFT,     /* kinetic plus strain energy at the end */
  HARD_MOMENTUM, /* largest change of the momentum over mass times the largest speed */
  HARD_ANGULAR,  /* largest change of the angular momentum about the origin over the initial one */
  HARD_MIN_J,    /* smallest det F at the end */
  HARD_MIN_J_EVER, /* smallest det F in any step */
  HARD_MAX_J,      /* largest det F at the end */
  HARD_INVERTED,   /* cells with det F <= 0 in the worst step, except the first */
  HARD_VOLUME,     /* |V / V0 - 1| of all bodies at the end */
  HARD_SHAPE,      /* largest |l / l0 - 1| of the distances between nodes of a cell at the end */
  HARD_PLACE,      /* largest displacement at the end over the size */
  HARD_MOVED,      /* largest displacement in any step over the size */
  HARD_SPEED,      /* largest speed of a node at the end, m/s */
  HARD_DEPTH,      /* largest penetration in any step (history column) over the size */
  HARD_NEWTON,     /* largest number of Newton iterations in a step */
  HARD_LINEAR,     /* largest number of linear iterations in a step */
  HARD_REJECTED,   /* total number of rejected steps */
  HARD_STEPS,      /* number of steps taken */
  HARD_OWN,        /* measured by `look`: value[HARD_OWN] */
  HARD_OWN2,
  HARD_OWN3,
  HARD_QUANTITIES
} HardQuantity;

typedef struct {
  HardQuantity quantity;
  char relation; /* '<' or '>'; 0: end of the list */
  PetscReal bound;
  const char *name, *unit; /* name and unit of HARD_OWN...; else NULL */
} HardLimit;

typedef struct _HardCase HardCase;

/* One run of a case. */
typedef struct {
  const HardCase *c;
  SbModel model;
  SbRun run;
  PetscInt k;           /* number of the run; 0 is without jitter */
  PetscBool verbose;    /* print a line per step */
  PetscRandom random;   /* equal on all ranks, different for each run */
  PetscReal size;       /* longest side of the bounding box of all bodies at rest, m */
  PetscReal rest;       /* volume at rest, m^3 */
  SbEnergies start;     /* initial energies */
  PetscReal most, gain; /* largest energy of the run; largest excess, J */
  PetscReal last;       /* kinetic plus strain energy of the last step, J */
  PetscReal speed;      /* largest speed of the run, m/s */
  PetscBool wild;       /* a result was NaN or infinite */
  PetscBool extra;      /* flag for use by `start`, `look` and `solve` */
  void *ctx;            /* data of these callbacks; freed by them, or with PetscFree() */
  PetscReal value[HARD_QUANTITIES];
} HardRun;

struct _HardCase {
  const char *name;    /* case.variant; unique */
  const char *what;    /* the difficulty */
  const char *options; /* the scenario; with `mesh`, %s is replaced by the path */
  PetscErrorCode (*mesh)(
    char path[512]); /* writes a mesh (verify_mesh_write()); removed after the last run */
  PetscErrorCode (*start)(HardRun *r); /* called after set-up and jitter */
  PetscErrorCode (*look)(
    HardRun *r, const SbStep *step);   /* called after each step, and once before the first */
  PetscErrorCode (*solve)(HardRun *r); /* NULL: SbRunSolve() */
  const char *stops;                   /* text of stop_reason of a run that must end early */
  int ranks[3];                        /* {0}: 1, 2 and 3 */
  int runs;         /* number of runs, the first one without jitter; 0: 1 without jitter, 10 with */
  int quick;        /* runs in `make check`, on 2 ranks; 0: only in `make check-hard` */
  int seconds;      /* limit of CPU time of all runs on each rank, s; 0: 300 */
  PetscReal jitter; /* amplitude of the initial displacement over the size */
  PetscReal jitter_speed; /* amplitude of the initial velocity, m/s */
  HardLimit limits[HARD_LIMITS + 1];
};

/* measure.c: call before the run; a monitor; call after the run. Collective. */
PetscErrorCode HardMeasureBegin(HardRun *r);
PetscErrorCode HardMeasureStep(SbRun run, const SbStep *step, void *ctx);
PetscErrorCode HardMeasureEnd(HardRun *r);
const char *HardQuantityName(HardQuantity q);

/* start.c: adds noise to the unknowns that are not prescribed, independent of the number of ranks.
   amplitude: m, or m/s. Collective. */
PetscErrorCode HardNoise(HardRun *r, PetscReal amplitude, Vec X);
/* Initial displacements for `start`. Collective. */
PetscErrorCode HardPlace(HardRun *r,
                         void (*place)(const HardRun *r, const PetscReal x[3], PetscReal to[3]));
PetscErrorCode HardStartRandom(HardRun *r); /* every vertex at a random point of the bounding box */
PetscErrorCode HardStartPoint(HardRun *r);  /* every vertex within 1e-4 of the size of one point */
PetscErrorCode HardStartExactPoint(HardRun *r); /* every vertex exactly at one point */
PetscErrorCode HardStartMirror(HardRun *r);     /* mirrored at x = 0: every tet inverted */
PetscErrorCode HardStartFlat(HardRun *r);       /* in the plane z = 0 */

/* meshes.c: unit cubes, unless the name says otherwise. */
PetscErrorCode HardMeshSliver(
  char
    path[512]); /* layer of slivers between two layers of cubes, dihedral angles below 1 degree */
PetscErrorCode HardMeshNeedle(char path[512]); /* cells of 1 : 1 : 100 */
PetscErrorCode HardMeshGraded(char path[512]); /* edge lengths from 1e-4 at one corner to 1 */
