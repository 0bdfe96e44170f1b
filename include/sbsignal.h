/*
  sbsignal.h - holds signals back while a library has handlers of its own.

  METIS catches SIGTERM and SIGABRT: a request to stop that arrives meanwhile would be an error of
  METIS, and lost. Held back, it is delivered afterwards.
*/
#pragma once
#include <signal.h>

/* before: the mask to give back to SbSignalsRelease(). */
static inline void SbSignalsHold(sigset_t *before)
{
  sigset_t held;

  (void)sigemptyset(&held);
  (void)sigaddset(&held, SIGTERM);
  (void)sigprocmask(SIG_BLOCK, &held, before);
}

static inline void SbSignalsRelease(const sigset_t *before)
{
  (void)sigprocmask(SIG_SETMASK, before, NULL);
}
