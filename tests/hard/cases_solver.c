/*
  cases_solver.c - failing solvers: forced to fail, or without a solution.

  A forced failure counts calls of a convergence test: `ctx` is the number of calls until it reports
  divergence.
*/
#include "hard.h"

#define BEAM                                                                                \
  "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 "         \
  "-body_a_density 1000 "                                                                   \
  "-effects clamp,gravity -effect_clamp_type fixed -effect_clamp_on xmin -body_a_material " \
  "corotated "                                                                              \
  "-ts_dt 0.02 -ts_max_time 0.4 "

/* Number of calls until the next failure, and of remaining failures. */
typedef struct {
  PetscInt until, failures;
} Saboteur;

static PetscBool now(Saboteur *s)
{
  if (!s->failures || s->until-- > 0)
    return PETSC_FALSE;
  s->failures--;
  s->until = 0;
  return PETSC_TRUE;
}

static PetscErrorCode linear_fails(KSP ksp, PetscInt it, PetscReal norm, KSPConvergedReason *reason,
                                   void *ctx)
{
  void **both = (void **)ctx;

  PetscFunctionBeginUser;
  if (now((Saboteur *)both[0]))
    *reason = KSP_DIVERGED_BREAKDOWN;
  else
    PetscCall(KSPConvergedDefault(ksp, it, norm, reason, both[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode forget_linear(void *ctx)
{
  void **both = SB_DESTROY_CTX(void *, ctx);

  PetscFunctionBeginUser;
  PetscCall(PetscFree(both[0]));
  PetscCall(KSPConvergedDefaultDestroy(SB_CTX_TO_DESTROY(both[1])));
  PetscCall(PetscFree(both));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode make_linear_fail(HardRun *r, PetscInt until, PetscInt failures)
{
  Saboteur *s;
  void **both;
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  PetscCall(PetscMalloc1(2, &both));
  *s = (Saboteur){until, failures};
  both[0] = s;
  PetscCall(KSPConvergedDefaultCreate(&both[1]));
  PetscCall(SNESGetKSP(r->run->solve.snes, &ksp));
  PetscCall(KSPSetConvergenceTest(ksp, linear_fails, both, forget_linear));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode linear_fails_once(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(make_linear_fail(r, 20, 2)); /* with the exact and with the projected tangent */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode linear_fails_always(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(make_linear_fail(r, 20, PETSC_MAX_INT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode newton_fails(SNES snes, PetscInt it, PetscReal x, PetscReal y, PetscReal f,
                                   SNESConvergedReason *reason, void *ctx)
{
  PetscFunctionBeginUser;
  if (now((Saboteur *)ctx))
    *reason = SB_SNES_DIVERGED_NAN;
  else
    PetscCall(SNESConvergedDefault(snes, it, x, y, f, reason, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode forget_newton(void *ctx)
{
  Saboteur *s = SB_DESTROY_CTX(Saboteur, ctx);

  PetscFunctionBeginUser;
  PetscCall(PetscFree(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three failures: the step is halved to an eighth. */
static PetscErrorCode newton_fails_often(HardRun *r)
{
  Saboteur *s;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  *s = (Saboteur){30, 3};
  PetscCall(SNESSetConvergenceTest(r->run->solve.snes, newton_fails, s, forget_newton));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define FREE(ELEMENT, LAW, QUICK)                                                                \
  {                                                                                              \
    .name = "free." ELEMENT "." LAW,                                                             \
    .what = "static under its weight without a support, " ELEMENT ", " LAW,                      \
    .options = "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 " \
               "-body_a_density 1000 "                                                           \
               "-effects gravity -time static -ksp_max_it 300 -body_a_element " ELEMENT          \
               " -body_a_material " LAW,                                                         \
    .stops = "nothing holds the body a against", .quick = QUICK                                  \
  }

#define PULLED(ELEMENT, LAW, QUICK)                                                               \
  {                                                                                               \
    .name = "pulled." ELEMENT "." LAW,                                                            \
    .what = "static, pulled at both ends without a support, " ELEMENT ", " LAW,                   \
    .options = "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 "  \
               "-body_a_density 1000 "                                                            \
               "-effects left,right -effect_left_type traction -effect_left_on xmin "             \
               "-effect_left_vector -1000;0;0 "                                                   \
               "-effect_right_type traction -effect_right_on xmax -effect_right_vector 1000;0;0 " \
               "-time static "                                                                    \
               "-body_a_element " ELEMENT " -body_a_material " LAW,                               \
    .stops = "nothing holds the body a against", .quick = QUICK                                   \
  }

const HardCase HardCasesSolver[] = {
  {.name = "linear.once",
   .what = "a linear solve that breaks down once: another solver takes over, the step is not cut",
   .options = BEAM,
   .start = linear_fails_once,
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3}, {HARD_REJECTED, '<', 0.5}, {HARD_MIN_J, '>', 0.5}}},
  {.name = "linear.cut",
   .what = "the same with a method of the user's: the step is cut",
   .options = BEAM "-ksp_type cg",
   .start = linear_fails_once,
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3},
              {HARD_REJECTED, '>', 0.5},
              {HARD_REJECTED, '<', 1.5},
              {HARD_MIN_J, '>', 0.5}}},
  {.name = "linear.always",
   .what = "linear solves that break down always: the run ends and says so",
   .options = BEAM "-ksp_type cg",
   .start = linear_fails_always,
   .quick = 1,
   .stops = "linear solver: DIVERGED_BREAKDOWN",
   .limits = {{HARD_REJECTED, '<', 11.5}, {HARD_MIN_J, '>', 0.5}}},
  {.name = "linear.iterations",
   .what = "a linear solver that may take one iteration: the run ends and says so",
   .options = BEAM "-solver cg -ksp_type cg -ksp_max_it 1",
   .quick = 1,
   .stops = "linear solver: DIVERGED_ITS",
   .limits = {{HARD_REJECTED, '<', 11.5}}},
  {.name = "step.thrice",
   .what = "Newton's method made to fail in three attempts: the step is cut to an eighth, and "
           "grows again",
   .options = BEAM,
   .start = newton_fails_often,
   .quick = 1,
   .limits = {{HARD_EXCESS, '<', 1e-3},
              {HARD_REJECTED, '>', 2.5},
              {HARD_REJECTED, '<', 3.5},
              {HARD_MIN_J, '>', 0.5},
              {HARD_STEPS, '<', 40}}},
  FREE("p1", "linear", 1),
  FREE("p1", "corotated", 1),
  FREE("p1", "stable_neohookean", 0),
  FREE("cr", "linear", 0),
  FREE("dg", "corotated", 0),
  FREE("p2", "corotated", 0),
  PULLED("p1", "linear", 1),
  PULLED("p1", "corotated", 0),
  PULLED("cr", "linear", 0),
  PULLED("p2", "linear", 0),
  {.name = NULL},
};
