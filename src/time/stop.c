/*
  Early end of a run: reason of the failure, end of halving, requests to stop.

  A signal (SIGTERM, SIGHUP, SIGINT, SIGUSR1 on any rank; SIGHUP unless it was ignored, as by nohup)
  or the end of -wall_time ends the run after the current step; monitors take that step as the last
  one, so that a checkpoint and the last frame are written. A step that takes longer than
  -stop_grace, or would exceed -wall_time, is abandoned between two iterations, and the run ends
  with the step before. All ranks decide together, by a reduction after each step and iteration.
*/
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>
#include "time_impl.h"

#define WALL_TIME 1000      /* request by -wall_time, beside signal numbers */
#define RESERVE_PART 0.05   /* part of -wall_time reserved for the last files, */
#define RESERVE_LONGEST 60. /* at most so many s; plus twice the time that files have taken */
#define STEP_FACTOR 1.5     /* time reserved for the next step, over the longest recent one */
#define AGAIN 0.5 /* interval within which a second SIGINT belongs to the same key press, s */

/* State set by signal handlers, global to the process. */
static struct {
  volatile sig_atomic_t signal; /* first signal; 0: none */
  volatile double since;        /* time of the signal, s */
  int speak;                    /* this rank prints messages */
} asked;

PetscErrorCode SbRunFail(SbRun run, const char *format, ...)
{
  va_list args;

  PetscFunctionBeginUser;

  /* keep the reason of an abandoned step */
  if (run->clock.stopped && run->clock.stop_reason[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  va_start(args, format);
  PetscCall(
    PetscVSNPrintf(run->clock.stop_reason, sizeof(run->clock.stop_reason), format, NULL, args));
  va_end(args);
  PetscCall(PetscInfo(NULL, "%s\n", run->clock.stop_reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbRunSuspects(SbRun run, size_t size, char text[])
{
  char names[256];

  SbEffectsWithoutPotential(run->model->neffect, run->model->effect, sizeof(names), names);
  if (names[0])
    SbAppend(size, text,
             "%sthe pressure of %s is on an open surface, so that Newton's method has no energy to "
             "minimise: close the surface, or use shorter steps",
             text[0] ? "; " : "", names);
}

PetscBool SbRunTooShort(SbRun run, PetscReal dt)
{
  return (PetscBool)(run->solve.rejected_inverted &&
                     dt < 0.999 * PetscPowReal(0.5, (PetscReal)run->clock.max_halvings) *
                            run->clock.dt);
}

static double seconds(void)
{
  struct timespec now;

  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Signal handler: async-signal-safe calls only. */
static void note_signal(int number)
{
  static const char text[] =
    "\nsupple: a signal asks to stop: the step is being finished (a second Ctrl-C ends at once)\n";

  if (asked.signal) {
    if (number == SIGINT && seconds() > asked.since + AGAIN)
      _exit(128 + SIGINT);
    return;
  }
  asked.since = seconds();
  asked.signal = number;
  if (asked.speak && write(STDERR_FILENO, text, sizeof(text) - 1) < 0)
    asked.speak = 0;
}

PetscErrorCode SbRunCatchSignals(SbRun run)
{
  static const int signals[] = {SIGTERM, SIGHUP, SIGINT, SIGUSR1};
  struct sigaction action = {.sa_handler = note_signal, .sa_flags = SA_RESTART};
  struct sigaction before;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(run->model->comm, &rank));
  asked.speak = !rank;
  (void)sigemptyset(&action.sa_mask);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(signals); i++)
    if (signals[i] != SIGHUP || sigaction(SIGHUP, NULL, &before) || before.sa_handler != SIG_IGN)
      (void)sigaction(signals[i], &action, NULL);
  run->clock.stop.listens = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunReadStop(SbRun run)
{
  int n;
  int day = 0;
  int hour, minute, second;
  int end = 0;
  char text[SB_NAME_MAX];

  PetscFunctionBeginUser;
  run->clock.stop.begun = MPI_Wtime();
  PetscCall(SbOptionReal(&SbRunScope, "stop_grace", &run->clock.stop.grace));
  PetscCall(SbOptionString(&SbRunScope, "wall_time", sizeof(text), text));
  if (!text[0])
    PetscFunctionReturn(PETSC_SUCCESS);

  /* "h:mm:ss" or "d-hh:mm:ss", as in batch systems */
  if (strchr(text, '-'))
    n = sscanf(text, "%d-%d:%2d:%2d%n", &day, &hour, &minute, &second, &end) - 1;
  else
    n = sscanf(text, "%d:%2d:%2d%n", &hour, &minute, &second, &end);
  if (n == 3 && !text[end] && day >= 0 && hour >= 0 && minute >= 0 && minute < 60 && second >= 0 &&
      second < 60)
    run->clock.stop.wall_time = 86400. * day + 3600. * hour + 60. * minute + second;
  run->clock.stop.listens = PETSC_TRUE;
  PetscCheck(run->clock.stop.wall_time > 0., PETSC_COMM_SELF, PETSC_ERR_USER,
             "-wall_time %s is no duration: give hours:minutes:seconds, 1:30:00, or "
             "days-hours:minutes:seconds, 2-00:00:00",
             text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunStopAsked(SbRun run, PetscInt step, PetscReal t, PetscBool within)
{
  const char *why = "SIGUSR1";
  PetscMPIInt rank;
  int reason;

  PetscFunctionBeginUser;
  if (!run->clock.stop.listens || run->clock.stopped)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the signal or WALL_TIME that ends the run, the same on all ranks; 0: none */
  PetscCallMPI(MPI_Comm_rank(run->model->comm, &rank));
  reason =
    asked.signal && (!within || seconds() > asked.since + run->clock.stop.grace) ? asked.signal : 0;
  if (run->clock.stop.wall_time > 0. && !rank) {
    const PetscReal reserve = PetscMin(RESERVE_LONGEST, RESERVE_PART * run->clock.stop.wall_time) +
                              2. * run->clock.stop.longest_output;
    const PetscReal next = within ? 0. : STEP_FACTOR * run->clock.stop.longest_step;

    if (MPI_Wtime() - run->clock.stop.begun + reserve + next >= run->clock.stop.wall_time)
      reason = WALL_TIME;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &reason, 1, MPI_INT, MPI_MAX, run->model->comm));
  if (!reason)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* no step fits into -wall_time: an error, else a requeued job would repeat this forever */
  PetscCheck(reason != WALL_TIME || step > run->clock.step0, run->model->comm, PETSC_ERR_USER_INPUT,
             "-wall_time: the %.6g s are over before a step is done: give more time or ranks, or a "
             "coarser mesh",
             (double)run->clock.stop.wall_time);
  if (reason == WALL_TIME)
    why = "the end of -wall_time is near";
  if (reason == SIGTERM)
    why = "SIGTERM";
  if (reason == SIGHUP)
    why = "SIGHUP";
  if (reason == SIGINT)
    why = "SIGINT";
  run->clock.stopped = PETSC_TRUE;
  run->clock.paused = PETSC_FALSE;
  run->clock.stop_reason[0] = 0;
  PetscCall(
    SbRunFail(run, "%s%s, after step %" PetscInt_FMT " at %s %g%s; it goes on with -restart %s",
              why, within ? ", and the next step is given up" : "", step,
              run->model->dynamic ? "t =" : "load factor", (double)t,
              run->model->dynamic ? " s" : "", step > run->clock.step0 ? "latest" : "auto"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
