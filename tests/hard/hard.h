/*
  hard.h - hard cases: scenarios in which simulations of soft bodies fail, each with limits on measured quantities.

  To add a case: one row in a table cases_*.c,
    {.name = "spin.p1", .what = "spin at 1000 rad/s, P1", .options = "-bodies a ...", .quick = 1,
     .limits = {{HARD_ANGULAR, '<', 1e-3}, {HARD_MIN_J, '>', 0.1}}}
  and, for a new table, one line in hard.c. Every run of a case must reach its end (or end early with the text `stops`), with
  finite results, and satisfy every limit. A case has `runs` runs: the first one as given, the others with the initial state perturbed
  by `jitter` and `jitter_speed`; the worst result of all runs counts. Callbacks beyond options: `mesh` writes a mesh, `start` changes
  the state before the first step, `look` is called after each step (and may measure HARD_OWN...), `solve` replaces SbRunSolve().
  These functions use limits for verdicts, not SB_CHECK(), which counts in hard.c only.

  `make build/tests/hard/hard`, then
    scripts/mpi 2 build/tests/hard/hard -case spin.p1     all runs of a case; -runs 1: the first only; -verbose: each step; -more "OPTIONS": further options
    tests/run --build build --group hard --match spin     cases with `quick` runs, on two ranks: as in `make check`
    tests/run --build build --group hard --all            everything, on the ranks of each case: as in `make check-hard`
    scripts/stability                                     table of the safety factors of the last runs; --write: into docs/reports/stability.md
*/
#pragma once
#include <sb.h>

#define HARD_LIMITS 10
#define HARD_TEXT 4096

/* What can be measured. Energies are divided by the most that was ever there: at the start, in motion and strain, or put in. */
typedef enum {
  HARD_EXCESS,  /* energy above start plus work of loads and drives less damping, largest of all steps */
  HARD_ACCOUNT, /* the same or below it, whichever is more: what the integrator makes and takes */
  HARD_RISE,    /* largest rise of kinetic plus strain energy in a step: of bodies without loads and drives */
  HARD_DRIFT,   /* largest change of kinetic plus strain energy since the start: of the same */
  HARD_LEFT,    /* kinetic plus strain energy at the end */
  HARD_MOMENTUM,   /* largest change of the momentum, of mass times the largest speed */
  HARD_ANGULAR,    /* largest change of the angular momentum about the origin, of that at the start */
  HARD_MIN_J,      /* smallest det F at the end */
  HARD_MIN_J_EVER, /* smallest det F in any step */
  HARD_MAX_J,      /* largest det F at the end */
  HARD_INVERTED,   /* cells with det F <= 0 in the worst step, but for the first */
  HARD_VOLUME,     /* |V / V0 - 1| of all bodies at the end */
  HARD_SHAPE,      /* |l / l0 - 1| of the lines between the nodes of each cell at the end, the largest */
  HARD_PLACE,      /* largest displacement at the end, of the size */
  HARD_MOVED,      /* largest displacement in any step, of the size */
  HARD_SPEED,      /* largest speed of a node at the end, m/s */
  HARD_DEPTH,      /* deepest penetration in any step (column of the history), of the size */
  HARD_NEWTON,     /* most Newton iterations in a step */
  HARD_LINEAR,     /* most linear iterations in a step */
  HARD_REJECTED,   /* rejected attempts at steps, all together */
  HARD_STEPS,      /* steps taken */
  HARD_OWN,        /* what `look` measures: value[HARD_OWN] */
  HARD_OWN2,
  HARD_OWN3,
  HARD_QUANTITIES
} HardQuantity;

typedef struct {
  HardQuantity quantity;
  char relation; /* '<' or '>'; 0 ends the list */
  PetscReal bound;
  const char *name, *unit; /* of HARD_OWN...; else NULL */
} HardLimit;

typedef struct _HardCase HardCase;

/* One run of a case. */
typedef struct {
  const HardCase *c;
  SbModel model;
  SbRun run;
  PetscInt k;           /* number of the run; 0 has no jitter */
  PetscBool verbose;    /* print a line per step */
  PetscRandom random;   /* alike on all ranks, another one for each run */
  PetscReal size;       /* longest side of a box around all bodies at rest, m */
  PetscReal rest;       /* volume at rest, m^3 */
  SbEnergies start;     /* of the first state */
  PetscReal most, gain; /* largest energy ever there; largest excess, J */
  PetscReal last;       /* kinetic plus strain energy of the last step, J */
  PetscReal speed;      /* largest ever, m/s */
  PetscBool wild;       /* something was not finite */
  PetscBool extra;      /* for `start`, `look` and `solve` */
  void *ctx;            /* the same; freed by them, or with PetscFree() */
  PetscReal value[HARD_QUANTITIES];
} HardRun;

struct _HardCase {
  const char *name;    /* case.variant; unique */
  const char *what;    /* what is hard about it */
  const char *options; /* the scenario; with `mesh`, %s stands for the path */
  PetscErrorCode (*mesh)(
    char path[512]);                   /* writes a mesh (verify_mesh_write()); removed behind the last run */
  PetscErrorCode (*start)(HardRun *r); /* after set-up and jitter */
  PetscErrorCode (*look)(HardRun *r, const SbStep *step); /* after each step, and once before the first */
  PetscErrorCode (*solve)(HardRun *r);                    /* NULL: SbRunSolve() */
  const char *stops;      /* the run must end early, and this be in its stop_reason */
  int ranks[3];           /* {0}: 1, 2 and 3 */
  int runs;               /* 0: 1 without jitter, 10 with */
  int quick;              /* runs in `make check`, on 2 ranks; 0: only in `make check-hard` */
  int seconds;            /* of processor time that all runs may take on each rank; 0: 300 */
  PetscReal jitter;       /* of the displacement at the start, of the size */
  PetscReal jitter_speed; /* of the velocity at the start, m/s */
  HardLimit limits[HARD_LIMITS + 1];
};

/* measure.c: begin before the run; a monitor; end when it has ended. Collective. */
PetscErrorCode HardMeasureBegin(HardRun *r);
PetscErrorCode HardMeasureStep(SbRun run, const SbStep *step, void *ctx);
PetscErrorCode HardMeasureEnd(HardRun *r);
const char *HardQuantityName(HardQuantity q);

/* start.c: adds noise to the unknowns that nothing prescribes, alike on any number of ranks. amplitude: m, or m/s. Collective. */
PetscErrorCode HardNoise(HardRun *r, PetscReal amplitude, Vec X);
/* Displacements, which start hooks are made of. Collective. */
PetscErrorCode HardPlace(HardRun *r, void (*place)(const HardRun *r, const PetscReal x[3], PetscReal to[3]));
PetscErrorCode HardStartRandom(HardRun *r);     /* every vertex anywhere in the bounding box */
PetscErrorCode HardStartPoint(HardRun *r);      /* every vertex at one point, but for 1e-4 of the size */
PetscErrorCode HardStartExactPoint(HardRun *r); /* the same, exactly */
PetscErrorCode HardStartMirror(HardRun *r);     /* mirrored at x = 0: every tet inverted */
PetscErrorCode HardStartFlat(HardRun *r);       /* in the plane z = 0 */

/* meshes.c: unit cubes but for what their names say. */
PetscErrorCode HardMeshSliver(
  char path[512]); /* layer of slivers between two layers of cubes, dihedral angles below 1 degree */
PetscErrorCode HardMeshNeedle(char path[512]); /* cells of 1 : 1 : 100 */
PetscErrorCode HardMeshGraded(char path[512]); /* edges from 1e-4 to 1, towards a corner */
