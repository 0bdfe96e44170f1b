/*
  hertz.h - Hertz contact of two elastic bodies (Hertz 1882; Johnson, Contact Mechanics, 1985,
  chapter 4):

    F = 4/3 E* sqrt(R) d^(3/2),   1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2,   1/R = 1/R1 + 1/R2,   a =
    sqrt(R d),

  for a sphere on a half-space of another material, and for two equal spheres; d is the approach of
  distant points, a the contact radius. Quarters of both bodies, non-matching meshes, graded towards
  the contact point. The materials are linear and a is at most R/80, so that the discretisation
  error dominates.

  The blocks are finite: their far faces have the displacement of half-spaces under a point force F
  (Boussinesq), whose relative error is of order (a/r)^2, r > 8 a. F is taken from the formula. This
  cannot hide an error of the contact force: the displacement there is at most a tenth of d, so an
  error of 5 % in F changes the approach by 0.5 % of d.
*/
#pragma once
#include "contact.h"

enum {
  CONTACTS,
  DEEPEST,
  MEAN,
  NORMAL,
  FRICTION,
  WORK,
  LOSS,
  NVALUE = 16
};

#define SIZE 1.0 /* edge length of the blocks, m */
#define POISSON 0.3
#define RADIUS 10.0 /* R, m */
#define CELLS 20    /* cells along an edge of the finest mesh */

/*
  One body above (side 1) or below (side -1) the plane z = 0: cells at the contact are `fine` times
  those of a uniform mesh; the surface has the radius `radius` (0: flat).
*/
typedef struct {
  PetscReal fine, side, radius;
} Block;

static inline void bend(const VerifyPlace *place, PetscReal x[3])
{
  const Block *b = (const Block *)place->ctx;
  PetscReal depth;
  PetscReal cap = 0;

  if (b->side < 0)
    x[2] = 1 - x[2];
  for (int k = 0; k < 3; k++)
    x[k] = SIZE * (b->fine * x[k] + (1 - b->fine) * PetscPowRealInt(x[k], 6));
  depth = x[2];
  if (b->radius > 0)
    cap = b->radius - PetscSqrtReal(PetscSqr(b->radius) - PetscSqr(x[0]) - PetscSqr(x[1]));
  x[2] = b->side * (depth + (1 - depth / SIZE) * cap);
}

/* Two bodies. The barrier width is d / 100; the gap of other responses, which is taken from d. */
typedef struct {
  const char *name;
  PetscReal young[2];  /* below, above, Pa */
  PetscReal radius[2]; /* 0: flat, m */
} Pair;

typedef struct {
  PetscInt cells;
  PetscReal a;      /* contact radius, m */
  PetscReal honest; /* tolerance of the force in the history, relative to the acting force */
  const char *element;
  const char *response; /* between the bodies; NULL: barrier */
} Case;

static inline PetscErrorCode write_meshes(const Pair *p, PetscInt cells, char path[2][512])
{
  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    const PetscInt m = cells - (k ? 0 : 1);
    const PetscInt n[3] = {m, m, m};
    Block block = {.fine = k ? 0.25 : 0.27, .side = k ? 1 : -1, .radius = p->radius[k]};

    PetscCall(verify_mesh_write(n, bend, &block, path[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Formulas of the displacement of a half-space on the given side of z = 0 under the force P at the
   origin; `shift` is added along z. */
static inline PetscErrorCode boussinesq(PetscReal P, PetscReal E, PetscReal side, PetscReal shift,
                                        size_t size, char text[])
{
  const char *r = "sqrt(x^2+y^2+z^2)";
  const PetscReal c = P * (1 + POISSON) / (2 * PETSC_PI * E);
  char sideways[256];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(sideways, sizeof(sideways), "%.15g*(abs(z)/%s^3-%.15g/(%s*(%s+abs(z))))",
                          c, r, 1 - 2 * POISSON, r, r));
  PetscCall(PetscSNPrintf(text, size, "x*%s;y*%s;%.15g+%.15g*(%.15g/%s+z^2/%s^3)", sideways,
                          sideways, shift, side * c, 2 * (1 - POISSON), r, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Both bodies between the symmetry planes x = 0 and y = 0. The contact surface is the part within a
  few d of z = 0: up to a few a, without the sides, whose first layer of cells is thicker.
*/
static inline PetscErrorCode open_pair(const Pair *p, const Case *c, PetscReal d, PetscReal P,
                                       char path[2][512], TestScene *t)
{
  char far[2][VERIFY_TEXT / 4];

  PetscFunctionBeginUser;
  PetscCall(boussinesq(P, p->young[0], -1, 0, sizeof(far[0]), far[0]));
  PetscCall(
    boussinesq(P, p->young[1], 1, (c->response ? 0.01 * d : 0.) - d, sizeof(far[1]), far[1]));
  PetscCall(test_open(
    t,
    "-bodies a,b -body_a_mesh %s -body_b_mesh %s -body_a_element %s -body_b_element %s "
    "-body_a_material linear -body_b_material linear -body_a_young %g -body_b_young %g "
    "-body_a_poisson %g "
    "-body_b_poisson %g -sets x0,y0,meet,ax,ay,az,bx,by,bz -set_x0_at plane:1,0,0,0 -set_y0_at "
    "plane:0,1,0,0 "
    "-set_meet_at plane:0,0,1,0,%g -set_ax_at box:1,0,-1,1,1,0 -set_ay_at box:0,1,-1,1,1,0 "
    "-set_az_at plane:0,0,1,-1 -set_bx_at box:1,0,0.01,1,1,1 -set_by_at box:0,1,0.01,1,1,1 "
    "-set_bz_at plane:0,0,1,1 -time static -ksp_rtol 1e-8 -solver cg_two_level -effects "
    "x,y,low,high,meet "
    "-effect_x_type fixed -effect_x_on x0 -effect_x_components x -effect_y_type fixed -effect_y_on "
    "y0 "
    "-effect_y_components y -effect_low_type prescribed_displacement -effect_low_on ax,ay,az "
    "-effect_low_displacement %s -effect_high_type prescribed_displacement -effect_high_on "
    "bx,by,bz "
    "-effect_high_displacement %s -effect_meet_type contact -effect_meet_on meet "
    "-effect_meet_barrier_width "
    "%.9g -effect_meet_response %s ",
    path[0], path[1], c->element, c->element, p->young[0], p->young[1], POISSON, POISSON, 3 * d,
    far[0], far[1], 0.01 * d, c->response ? c->response : "barrier"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* History columns of the contact effect, and the force along z of the prescribed displacement
   `high` on the upper body. */
static inline PetscErrorCode read_forces(SbRun run, PetscReal values[NVALUE], PetscReal *reaction)
{
  SbModel m = run->model;
  SbStage stage = {.t = 1, .shift_k = 1};
  PetscReal pull[4] = {0};
  const PetscReal *r;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->state.U, &R));
  PetscCall(SbModelResidual(m, 1, run->state.U, run->state.V, run->state.A, PETSC_FALSE, R));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &stage.u));
  for (PetscInt i = 0; i < m->neffect; i++) {
    SbEffect e = m->effect[i];

    if (!strcmp(e->name, "meet"))
      PetscCall((*e->ops.history)(e, m->space, &stage, r, values));
    if (!strcmp(e->name, "high"))
      PetscCall((*e->ops.history)(e, m->space, &stage, r, pull));
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &stage.u));
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCall(VecDestroy(&R));
  *reaction = pull[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Force of a case on the far face of the upper body, over that of the formula. The force in the
  history is a sum over pairs, those of edges being slightly inclined; it must be equal within the
  tolerance.
*/
static inline PetscErrorCode hertz(const Pair *p, const Case *c, PetscReal *force)
{
  const PetscReal d = PetscSqr(c->a) / RADIUS;
  const PetscReal plane =
    (1 - PetscSqr(POISSON)) * (1 / p->young[0] + 1 / p->young[1]); /* 1/E*, 1/Pa */
  const PetscReal P = 4. / 3 / plane * PetscSqrtReal(RADIUS) * PetscPowReal(d, 1.5);
  PetscReal values[NVALUE] = {0};
  PetscReal reaction = 0;
  char path[2][512];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(write_meshes(p, c->cells, path));
  PetscCall(open_pair(p, c, d, P, path, &t));
  PetscCall(verify_solve(&t, p->name));
  PetscCall(read_forces(t.run, values, &reaction));
  *force = -4 * reaction / P;
  test_print("  %s, %s, %d^3 cells, d = %.3e m: %g points touch, force %.4f "
             "(history %.4f) of the formula's, penetration %.1e d, %d solves\n",
             p->name, c->element, (int)c->cells, d, values[CONTACTS], *force,
             4 * values[NORMAL] / P, values[DEEPEST] / d, (int)t.run->counters.newton);
  SB_CHECK_NEAR(4 * values[NORMAL] / P, *force, c->honest * *force,
                "force in the history against the one that acts");
  SB_CHECK(values[DEEPEST] < 0.01 * d, "penetration %g m of %g m", values[DEEPEST], d);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}
