/*
  How far Newton's method goes along its steps.

  Full steps first, a search for a smaller residual when they fail. In bending and in rotation a full step has a residual thousands of
  times larger than before, because it stretches what it should turn, and the next one removes that: a search for a smaller residual
  creeps along where full steps need five.

  When the shortest step that a run may take has failed with both, a search that goes downhill. Residuals of an implicit step are the gradient of a potential (inertia, strain, dead loads), and the positive definite tangents
  make each Newton step y one down its slope. A search for a smaller residual may end at a point that is no solution, and does where
  forces jump (co-rotated tets that are mirrored or flat). The potential has no such points: along x - s y its slope is -g(s),
  g = F(x - s y) . y, and s is taken where g has fallen to half of g(0) or less, found by halving between a place that still goes down and one
  that goes up (the curvature condition of Wolfe; Nocedal and Wright, Numerical Optimization, 2006, section 3.1). A step that goes up
  at once, as with follower loads and the exact tangent, is taken whole.
*/
#include "time_impl.h"

#define DOWN_ITERATIONS 1000 /* limited tangents are slow near such places: a mirrored cube takes hundreds */
#define TRIES 12
#define ENOUGH 0.5 /* of the slope at the start */

/* The next length between one that goes down (low, slope g_low) and one that goes up or is not finite (high). */
static PetscReal between(PetscReal low, PetscReal g_low, PetscReal high, PetscReal g_high)
{
  PetscReal part = 0.5;

  if (!PetscIsInfOrNanReal(g_high)) part = PetscMax(0.1, PetscMin(0.9, g_low / (g_low - g_high)));
  return low + part * (high - low);
}

static PetscErrorCode go_down(SNESLineSearch search, void *ctx)
{
  Vec X, F, Y, W, G;
  SNES snes;
  PetscReal start, g = 0., low = 0., high = 0., g_low, g_high = 0., s = 1.;

  PetscFunctionBeginUser;
  (void)ctx;
  PetscCall(SNESLineSearchGetVecs(search, &X, &F, &Y, &W, &G));
  PetscCall(SNESLineSearchGetSNES(search, &snes));
  PetscCall(SNESLineSearchSetReason(search, SNES_LINESEARCH_SUCCEEDED));
  PetscCall(VecDot(F, Y, &start));
  g_low = start;
  for (int k = 0; k < TRIES; k++) {
    PetscCall(VecWAXPY(W, -s, Y, X));
    PetscCall(SNESComputeFunction(snes, W, G));
    PetscCall(VecDot(G, Y, &g));
    if (start <= 0. || PetscAbsReal(g) <= ENOUGH * start || (g > 0. && high == 0.)) break;
    if (g > 0.) {
      low = s;
      g_low = g;
    } else {
      high = s;
      g_high = g;
    }
    s = between(low, g_low, high, g_high);
  }
  PetscCall(VecCopy(W, X));
  PetscCall(VecCopy(G, F));
  PetscCall(SNESLineSearchSetLambda(search, s));
  PetscCall(SNESLineSearchComputeNorms(search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSearch(SbRun run, SbSearch kind)
{
  static const char *const types[] = {SB_LINESEARCH_NONE, SNESLINESEARCHBT, SNESLINESEARCHSHELL};
  SNESLineSearch search;
  PetscReal atol, rtol, stol;
  PetscInt max_f;
  PetscBool asked;

  PetscFunctionBeginUser;
  PetscCall(SNESGetLineSearch(run->snes, &search));
  PetscCall(SNESLineSearchSetType(search, types[kind]));
  if (kind == SB_SEARCH_DOWN) PetscCall(SbLineSearchShellSet(search, go_down, NULL));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_max_it", &asked));
  if (asked) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetTolerances(run->snes, &atol, &rtol, &stol, NULL, &max_f));
  PetscCall(SNESSetTolerances(run->snes, atol, rtol, stol,
                              kind == SB_SEARCH_DOWN ? DOWN_ITERATIONS : SB_NEWTON_ITERATIONS, max_f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
