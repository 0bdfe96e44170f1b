// @ranks 1 2 3 4
/*
  Rotated factor: exact (up to its 16-bit rounding) for the original operator and for the one of the
  rigidly rotated body; few iterations in a bent body; independence of the number of ranks; every
  kind of operator.
*/
#include "sbpc.h"
#include "sbsolver.h"
#include "../scene.h"

static const char *const bar =
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:16,4,4 -body_bar_material %s -body_bar_young 5e4 "
  "-body_bar_poisson 0.4 -body_bar_density 1000 -sets left -set_left_at plane:1,0,0,0 %s";
static const char *const held = "-effects clamp -effect_clamp_type fixed -effect_clamp_on left";
static const char *const guided =
  "-effects clamp -effect_clamp_type fixed -effect_clamp_on left -effect_clamp_components x";

#define WARPED "corotated -body_bar_tangent warped"
#define WARPED_P2 WARPED " -body_bar_element p2 -body_bar_mesh box:0.4,0.1,0.1:8,2,2"

static PetscReal turn_angle, bend_angle; /* of the states below, rad */

/* Rigid rotation of the bar about the y axis. */
static void turned(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal c = PetscCosReal(turn_angle);
  const PetscReal s = PetscSinReal(turn_angle);

  u[0] = (c - 1.) * x[0] + s * x[2];
  u[1] = 0.;
  u[2] = -s * x[0] + (c - 1.) * x[2];
}

/* Bar bent to an arc of bend_angle, with constant length of its axis. */
static void bent(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal radius = 0.4 / bend_angle;
  const PetscReal phi = x[0] / radius;
  const PetscReal z = x[2] - 0.05;

  u[0] = (radius + z) * PetscSinReal(phi) - x[0];
  u[1] = 0.;
  u[2] = (radius + z) * PetscCosReal(phi) - radius - z;
}

static void push(const PetscReal x[3], PetscReal f[3])
{
  f[0] = PetscSinReal(9. * x[2]) * x[0];
  f[1] = PetscCosReal(7. * x[0]) * x[0];
  f[2] = x[0] * (1. + x[1]);
}

typedef struct {
  TestScene t;
  Vec U, b, x;
  Mat A;
  KSP ksp;
  PetscBool frames;
} Case;

static PetscErrorCode open_case(const char *law, const char *extra, PetscBool frames, Case *c)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(test_open(&c->t, bar, law, extra));
  PetscCall(SbSpaceCreateVec(c->t.model->space, &c->U));
  PetscCall(SbSpaceCreateVec(c->t.model->space, &c->b));
  PetscCall(SbSpaceCreateVec(c->t.model->space, &c->x));
  PetscCall(SbModelProjectTangent(c->t.model, PETSC_TRUE)); /* positive semidefinite at any state */
  c->frames = frames;
  if (frames)
    PetscCall(SbSpaceCreateMatrixFree(c->t.model->space, &c->A));
  else {
    PetscCall(SbSpaceCreateMatrix(c->t.model->space, SB_MATRIX_BAIJ, &c->A));
    PetscCall(PetscObjectCompose((PetscObject)c->A, "sb_state", (PetscObject)c->U));
  }
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &c->ksp));
  PetscCall(KSPSetOperators(c->ksp, c->A, c->A));
  PetscCall(KSPSetType(c->ksp, KSPCG));
  PetscCall(KSPSetNormType(c->ksp, KSP_NORM_UNPRECONDITIONED));
  PetscCall(KSPGetPC(c->ksp, &pc));
  PetscCall(SbPCRotatedCreate(c->t.model->space, pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode close_case(Case *c)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&c->ksp));
  PetscCall(MatDestroy(&c->A));
  PetscCall(VecDestroy(&c->U));
  PetscCall(VecDestroy(&c->b));
  PetscCall(VecDestroy(&c->x));
  PetscCall(test_scene_close(&c->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterations at a state for h = 1/60 s; the true residual is checked. -1 if the solve failed. */
static PetscErrorCode solve(Case *c, void (*state)(const PetscReal x[3], PetscReal u[3]),
                            PetscReal rtol, PetscInt *its)
{
  SbModel m = c->t.model;
  SbStage stage = {.shift_a = 3600., .shift_v = 60., .shift_k = 1.};
  KSPConvergedReason reason;
  PetscReal norm, error;
  Vec r;

  PetscFunctionBeginUser;
  if (state)
    PetscCall(test_fill(m, state, c->U));
  else
    PetscCall(VecZeroEntries(c->U));
  if (c->frames) {
    PetscCall(SbSpaceGetLocalRead(m->space, c->U, &stage.u));
    PetscCall(SbSpaceAssembleTangent(m->space, &stage, c->A));
    PetscCall(SbSpaceRestoreLocalRead(m->space, c->U, &stage.u));
  } else
    PetscCall(SbModelTangent(m, 0., stage.shift_v, stage.shift_a, 1., c->U, c->U, c->A));
  PetscCall(test_fill(m, push, c->b));
  PetscCall(KSPSetTolerances(c->ksp, rtol, PETSC_DEFAULT, PETSC_DEFAULT, 300));
  PetscCall(
    KSPSetOperators(c->ksp, c->A, c->A)); /* signals a change of A to the solver, as SNES does */
  PetscCall(KSPSolve(c->ksp, c->b, c->x));
  PetscCall(KSPGetIterationNumber(c->ksp, its));
  PetscCall(KSPGetConvergedReason(c->ksp, &reason));
  if (reason < 0)
    *its = -1;
  PetscCall(VecDuplicate(c->b, &r));
  PetscCall(MatMult(c->A, c->x, r));
  PetscCall(VecAYPX(r, -1., c->b));
  PetscCall(VecNorm(r, NORM_2, &error));
  PetscCall(VecNorm(c->b, NORM_2, &norm));
  PetscCall(VecDestroy(&r));
  SB_CHECK(reason < 0 || error < 1.01 * rtol * norm, "residual %g, allowed %g", error, rtol * norm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Free body: after a rigid rotation the preconditioner is still the exact inverse. */
static PetscErrorCode check_turn(const char *law, PetscBool frames)
{
  PetscInt fresh, its;
  double nfactor;
  Case c;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(open_case(law, "", frames, &c));
  PetscCall(solve(&c, NULL, 1e-8, &fresh));
  SB_CHECK(fresh > 0 && fresh <= 4,
           "%s: %" PetscInt_FMT " iterations with the operator that was factored", law, fresh);
  for (turn_angle = 0.5; turn_angle < 3.2; turn_angle += 0.85) {
    PetscCall(solve(&c, turned, 1e-8, &its));
    SB_CHECK(its > 0 && its <= fresh + 1,
             "%s: %" PetscInt_FMT " iterations turned by %g, %" PetscInt_FMT " before", law, its,
             turn_angle, fresh);
  }
  PetscCall(KSPGetPC(c.ksp, &pc));
  PetscCall(test_pc_number(pc, "turned with the nodes: ", &nfactor));
  SB_CHECK(nfactor == 1., "%s: %g factorisations", law, nfactor);
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Clamped bar bent to an arc. Without rotation of the factor it needs three times as many
   iterations. */
static PetscErrorCode check_bent(const char *law, const char *extra, PetscBool frames,
                                 PetscReal angle, PetscInt most, PetscInt *its)
{
  PetscInt fresh;
  double nfactor;
  Case c;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(open_case(law, extra, frames, &c));
  bend_angle = angle;
  PetscCall(solve(&c, NULL, 1e-4, &fresh));
  PetscCall(solve(&c, bent, 1e-4, its));
  SB_CHECK(*its > 0 && *its <= most,
           "%s%s: %" PetscInt_FMT " iterations bent, allowed %" PetscInt_FMT, law, extra, *its,
           most);

  /* a failed solve renews the factor: then one or two iterations suffice; one more factorisation
     was made */
  PetscCall(KSPSetTolerances(c.ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 1));
  PetscCall(KSPSolve(c.ksp, c.b, c.x));
  PetscCall(KSPGetPC(c.ksp, &pc));
  PetscCall(solve(&c, bent, 1e-4, &fresh));
  SB_CHECK(fresh > 0 && fresh <= 2, "%s: %" PetscInt_FMT " iterations after renewal", law, fresh);
  PetscCall(test_pc_number(pc, "turned with the nodes: ", &nfactor));
  SB_CHECK(nfactor == 2., "%s: %g factorisations", law, nfactor);
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An operator that is not positive definite fails the solve; the next definite one is factored. */
static PetscErrorCode check_indefinite(void)
{
  PetscInt its;
  Case c;

  PetscFunctionBeginUser;
  PetscCall(open_case("linear", held, PETSC_FALSE, &c));
  PetscCall(SbModelTangent(c.t.model, 0., 60., 3600., 1., c.U, c.U, c.A));
  PetscCall(MatScale(c.A, -1.));
  PetscCall(VecSet(c.b, 1.));
  PetscCall(KSPSolve(c.ksp, c.b, c.x));
  KSPConvergedReason reason;
  PetscCall(KSPGetConvergedReason(c.ksp, &reason));
  SB_CHECK(reason < 0, "a solve with a negative operator returned %d", (int)reason);
  PetscCall(solve(&c, NULL, 1e-8, &its));
  SB_CHECK(its > 0 && its <= 4, "%" PetscInt_FMT " iterations after a failure", its);
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work of an application is distributed: all ranks together read little more than a single
   rank, and none much more than its share. */
static PetscErrorCode check_work(PetscMPIInt size)
{
  const char *options =
    "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:24,7,7 -body_bar_material linear "
    "-body_bar_young 5e4 -body_bar_poisson 0.4 -body_bar_density 1000";
  double alone = 0.;
  double all = 0.;
  double most = 0.;
  double nface;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    MPI_Comm comm = k ? PETSC_COMM_WORLD : PETSC_COMM_SELF;
    SbStage stage = {.shift_a = 3600., .shift_v = 60., .shift_k = 1.};
    TestScene t;
    Mat A;
    PC pc;

    PetscCall(test_scene_open_on(comm, NULL, options, &t));
    PetscCall(SbSpaceCreateMatrixFree(t.model->space, &A));
    PetscCall(SbSpaceAssembleTangent(t.model->space, &stage, A));
    PetscCall(PCCreate(comm, &pc));
    PetscCall(PCSetOperators(pc, A, A));
    PetscCall(SbPCRotatedCreate(t.model->space, pc));
    PetscCall(PCSetUp(pc));
    PetscCall(test_pc_number(pc, "interface of ", &nface));
    PetscCall(test_pc_number(pc, "reads ", k ? &all : &alone));
    PetscCall(test_pc_number(pc, "at most ", &most));
    SB_CHECK(most > 0. && (nface > 0.) == (k && size > 1), "%g nodes between ranks", nface);
    PetscCall(PCDestroy(&pc));
    PetscCall(MatDestroy(&A));
    PetscCall(test_scene_close(&t));
  }
  test_print("work on %d ranks: %.3f of that on one, busiest rank %.3f\n", (int)size, all / alone,
             most / alone);
  SB_CHECK(all <= 1.15 * alone, "%d ranks read %g times what one reads", (int)size, all / alone);
  SB_CHECK(most <= 1.3 * alone / size, "the busiest of %d ranks has %g of the work", (int)size,
           most / alone);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt its[2];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_turn(WARPED, PETSC_TRUE));
  PetscCall(check_turn(WARPED, PETSC_FALSE));
  PetscCall(check_turn(WARPED_P2, PETSC_TRUE));
  PetscCall(check_bent(WARPED_P2, held, PETSC_TRUE, 2., 13, &its[0]));
  PetscCall(check_bent(WARPED_P2, held, PETSC_FALSE, 2., 13, &its[1]));
  SB_CHECK(PetscAbsInt(its[0] - its[1]) <= 1,
           "%" PetscInt_FMT " iterations without, %" PetscInt_FMT " with a matrix", its[0], its[1]);
  PetscCall(check_bent(WARPED, held, PETSC_TRUE, 2., 13, &its[0]));
  PetscCall(check_bent(WARPED, held, PETSC_FALSE, 2., 13, &its[1]));
  SB_CHECK(PetscAbsInt(its[0] - its[1]) <= 1,
           "%" PetscInt_FMT " iterations without, %" PetscInt_FMT " with a matrix", its[0], its[1]);
  test_print("bent bar on %d ranks: %" PetscInt_FMT " iterations\n", (int)test_size, its[0]);
  PetscCall(check_bent(WARPED, guided, PETSC_TRUE, 2., 13, &its[0]));
  PetscCall(
    check_bent("corotated", held, PETSC_FALSE, 2., 25, &its[0])); /* exact tangent, projected */
  PetscCall(check_bent("stable_neohookean", held, PETSC_FALSE, 0.5, 15, &its[0]));
  PetscCall(check_indefinite());
  PetscCall(check_work(test_size));
  SB_TEST_END();
}
