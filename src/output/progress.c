/*
  The line of progress of a run: rewritten in place on a terminal, else a plain line now and then.

  Open MPI gives its ranks a pseudo-terminal whatever its own output is: there the launcher's output
  decides.
*/
#include <stdlib.h>
#include <unistd.h>
#include "output_impl.h"

#define WIDTH 79

#define LONG 5. /* s between lines within a long step */

static PetscBool is_terminal(void)
{
  char link[64], target[64];
  ssize_t n;

  if (!isatty(STDOUT_FILENO) || !getenv("OMPI_COMM_WORLD_SIZE"))
    return (PetscBool)isatty(STDOUT_FILENO);
  (void)snprintf(link, sizeof(link), "/proc/%ld/fd/1", (long)getppid());
  n = readlink(link, target, sizeof(target) - 1);
  if (n <= 0)
    return PETSC_FALSE;
  target[n] = 0;
  return (PetscBool)(!strncmp(target, "/dev/pts/", 9) || !strncmp(target, "/dev/tty", 8));
}

/* On rank 0 only. */
static PetscErrorCode monitor(SbRun run, const SbStep *step, void *ctx)
{
  const SbOutput out = (SbOutput)ctx;
  SbProgress *p = &out->line;
  char line[160], count[32];
  char left[16] = "-";
  char times[16] = "-";
  PetscReal done, speed;

  PetscFunctionBeginUser;

  /* already printed: first step after a re-meshing, or the last one again */
  if ((p->titled && step->step == run->clock.step0) || step->again)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!p->titled) {
    p->titled = PETSC_TRUE;
    p->t_start = step->t;
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n%13s %10s %6s %7s %10s %10s %8s %8s\n", "step",
                          run->model->dynamic ? "t (s)" : "load", "newton", "linear", "kinetic J",
                          "strain J", "speed", "left"));
  } else {
    p->newton += step->newton;
    p->linear += step->linear;
    p->steps++;
    if (!step->last && step->wall - p->last < (p->terminal ? .2 : 2.))
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscLogEventBegin(out->event.progress, 0, 0, 0, 0));

  // the line: step, time, iterations, energies, speed, time left
  done = step->t - p->t_start;
  speed = step->wall > 0. ? done / step->wall : 0.;
  SbFormat(sizeof(count), count, "%" PetscInt_FMT, step->step);
  if (step->step_end > 0)
    SbAppend(sizeof(count), count, "/%" PetscInt_FMT, step->step_end);
  if (speed > 0.) {
    const long s = (long)PetscMin(PetscMax(step->t_end - step->t, 0.) / speed + .5, 359999.);

    /* 75 s as "1:15", 2 h as "2:00:00" */
    if (s >= 3600)
      SbFormat(sizeof(left), left, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
    else
      SbFormat(sizeof(left), left, "%ld:%02ld", s / 60, s % 60);
    if (run->model->dynamic)
      (void)snprintf(times, sizeof(times), "%.3gx", speed);
  }
  (void)snprintf(line, sizeof(line), "%13s %10.4g %6.1f %7.1f %10.3e %10.3e %8s %8s", count,
                 step->t, p->steps ? (double)p->newton / (double)p->steps : 0.,
                 p->steps ? (double)p->linear / (double)p->steps : 0., step->energies.kinetic,
                 step->energies.strain, times, left);
  PetscCall(PetscPrintf(PETSC_COMM_SELF, p->terminal ? "\r%-*s" : "%.*s\n", WIDTH, line));
  (void)fflush(PETSC_STDOUT);
  p->open = p->terminal;
  p->last = step->wall;
  p->newton = p->linear = p->steps = 0;
  PetscCall(PetscLogEventEnd(out->event.progress, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A line within a step that takes long, by rank 0; linear: iteration of the solve within that of
   Newton's method, -1: none. Not collective. */
static PetscErrorCode say_within(SbRun run, PetscInt newton, PetscInt linear, PetscReal residual)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  const PetscReal now = MPI_Wtime();
  const PetscReal begun = run->clock.stop.step_begun;
  PetscReal dt = run->clock.dt;
  char contact[32] = "";
  char solve[40] = "";

  PetscFunctionBeginUser;
  if (!out->line.on || begun == 0. || now - begun < LONG || now - out->line.within < LONG)
    PetscFunctionReturn(PETSC_SUCCESS);
  out->line.within = now;
  if (run->solve.ts)
    PetscCall(TSGetTimeStep(run->solve.ts, &dt));
  if (run->model->contacts.nactive_set)
    (void)snprintf(contact, sizeof(contact), ", contact round %" PetscInt_FMT,
                   run->counters.contact_rounds);
  if (linear >= 0)
    (void)snprintf(solve, sizeof(solve), ", linear iteration %" PetscInt_FMT, linear);
  SbProgressEnd(out);
  PetscCall(PetscPrintf(PETSC_COMM_SELF,
                        "  step %" PetscInt_FMT " has taken %.0f s: Newton iteration %" PetscInt_FMT
                        "%s, residual %.2e N%s, length %.3g%s\n",
                        run->clock.step + 1, (now - begun), newton, solve, residual, contact, dt,
                        run->model->dynamic ? " s" : ""));
  (void)fflush(PETSC_STDOUT);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode within_newton(SNES snes, PetscInt iteration, PetscReal residual, void *run)
{
  PetscFunctionBeginUser;
  (void)snes;
  PetscCall(say_within((SbRun)run, iteration, -1, residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode within_linear(KSP ksp, PetscInt iteration, PetscReal residual, void *run)
{
  PetscInt newton;

  PetscFunctionBeginUser;
  (void)ksp;
  PetscCall(SNESGetIterationNumber(((SbRun)run)->solve.snes, &newton));
  if (iteration % 10 == 0)
    PetscCall(say_within((SbRun)run, newton, iteration, residual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProgressAttach(SbRun run, SbOutput out)
{
  KSP ksp;

  PetscFunctionBeginUser;
  if (!out->progress || out->quiet)
    PetscFunctionReturn(PETSC_SUCCESS);
  run->monitors.want_energies = PETSC_TRUE;
  out->line.on = (PetscBool)!out->rank;
  out->line.terminal = (PetscBool)(out->line.on && is_terminal());

  /* of the run on rank 0, of its solvers on all, as a solver computes some norms only for a
     monitor */
  if (out->line.on)
    PetscCall(SbRunAddMonitor(run, monitor, out));
  if (!run->solve.snes)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(run->solve.snes, &ksp));
  PetscCall(SNESMonitorSet(run->solve.snes, within_newton, run, NULL));
  PetscCall(KSPMonitorSet(ksp, within_linear, run, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbProgressEnd(SbOutput out)
{
  if (out->line.open)
    (void)PetscPrintf(PETSC_COMM_SELF, "\n");
  out->line.open = PETSC_FALSE;
}
