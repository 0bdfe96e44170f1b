// @ranks 1 2
/*
  What a scenario does not name costs nothing and changes nothing: no call of an effect, no memory, and the same trajectory to the
  last bit whether or not effects exist that it does not name, or whose load is zero.
*/
#include "../scene.h"

#define FREE                                                                                                 \
  "-bodies a -body_a_mesh box:0.3,0.1,0.1:3 -body_a_material corotated -body_a_young 1e4 "                   \
  "-body_a_poisson 0.3 -body_a_density 1000 -body_a_velocity 0.1,0,0.2 -body_a_spin 0,3,1 -ts_max_time 0.2 " \
  "-ts_dt 0.01 "

static PetscInt calls_of(PetscLogEvent event)
{
  PetscEventPerfInfo info;

  if (PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info)) return -1;
  return info.count;
}

/* Runs the scene; its end state is left in `end` (created here), and what it allocated at most in `bytes`. */
static PetscErrorCode run_scene(const char *options, Vec *end, PetscLogDouble *bytes, PetscInt *effect_calls)
{
  TestScene t;
  const PetscInt before = calls_of(SbEvents[SB_EVENT_EFFECTS]);

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &t));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->stop_reason[0] && t.run->steps_total == 20, "%s: %s", options, t.run->stop_reason);
  PetscCall(PetscMallocGetCurrentUsage(bytes));
  PetscCall(VecDuplicate(t.run->U, end));
  PetscCall(VecCopy(t.run->U, *end));
  *effect_calls = calls_of(SbEvents[SB_EVENT_EFFECTS]) - before;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An effect type that the program does not have: registered by this test, never named. */
static PetscErrorCode create_stranger(SbEffect e)
{
  PetscFunctionBeginUser;
  (void)e;
  SB_CHECK(0, "an effect that is not named was created");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_same(Vec x, Vec y, const char *what)
{
  PetscBool same;

  PetscFunctionBeginUser;
  PetscCall(VecEqual(x, y, &same));
  SB_CHECK(same, "%s: the trajectory changed", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Vec plain, again, zero;
  PetscLogDouble bytes[3];
  PetscInt calls[3];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscLogDefaultBegin());
  PetscCall(run_scene(FREE, &plain, &bytes[0], &calls[0]));
  SB_CHECK(calls[0] == 0, "%" PetscInt_FMT " calls of effects in a scene without any", calls[0]);
  PetscCall(SbRegisterAll());
  PetscCall(SbEffectRegister("stranger", create_stranger, 0, NULL));
  PetscCall(run_scene(FREE, &again, &bytes[1], &calls[1]));
  PetscCall(check_same(plain, again, "an effect that is registered and not named"));
  SB_CHECK(calls[1] == 0, "%" PetscInt_FMT " calls of effects that are not named", calls[1]);
  PetscCall(run_scene(FREE "-effects gravity -effect_gravity_vector 0,0,0", &zero, &bytes[2], &calls[2]));
  PetscCall(check_same(plain, zero, "gravity of zero"));
  SB_CHECK(calls[2] > 0, "the event of effects does not count");
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "calls of effects: %d none named, %d one named; bytes at the end %.0f, %.0f, %.0f\n",
                        (int)calls[0], (int)calls[2], bytes[0], bytes[1], bytes[2]));
  PetscCall(VecDestroy(&plain));
  PetscCall(VecDestroy(&again));
  PetscCall(VecDestroy(&zero));
  SB_TEST_END();
}
