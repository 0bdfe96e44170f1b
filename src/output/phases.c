/*
  Where the time went: the program's log events, gathered into the phases that the closing table shows.

  The seconds of a phase are those of the slowest rank. Events of a phase do not contain each other; the linear solve is
  what PETSc's KSP and PC events cover. The last phase is the remainder of the wall time.
*/
#include <sys/resource.h>
#include <time.h>
#include "output_impl.h"
#include "sblog.h"

PetscReal SbCpuSeconds(void)
{
  struct timespec t;

  (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (PetscReal)t.tv_sec + 1e-9 * (PetscReal)t.tv_nsec;
}

PetscErrorCode SbPhasesGet(SbOutput out, SbPhases *p)
{
  enum { MESH, SETUP, RESIDUAL, TANGENT, SOLVE, CONTACT, SEARCH, ENERGY, OUTPUT };
  static const char *const names[SB_PHASE_COUNT] = {"mesh",         "set-up",  "residual",       "tangent",
                                                    "linear solve", "contact", "contact search", "energies",
                                                    "output",       "other"};
  static const char *const solve[] = {"KSPSolve", "PCSetUp", "PCSetUpOnBlocks"};
  static const struct {
    int phase;
    SbEvent event;
  } ours[] = {{MESH, SB_EVENT_MESH_READ},     {MESH, SB_EVENT_MESH_DISTRIBUTE}, {SETUP, SB_EVENT_SPACE_SETUP},
              {SETUP, SB_EVENT_MATRIX_SETUP}, {SETUP, SB_EVENT_SOLVER_SETUP},   {RESIDUAL, SB_EVENT_RESIDUAL},
              {TANGENT, SB_EVENT_TANGENT},    {SOLVE, SB_EVENT_CONTACT_SOLVE},  {CONTACT, SB_EVENT_CONTACT},
              {SEARCH, SB_EVENT_SEARCH},      {ENERGY, SB_EVENT_ENERGY},        {OUTPUT, SB_EVENT_OUTPUT},
              {OUTPUT, SB_EVENT_CHECKPOINT}};
  PetscReal mine[SB_PHASE_COUNT] = {0.}, most[SB_PHASE_COUNT], memory, cpu;
  struct rusage usage;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ours); i++)
    PetscCall(SbLogSeconds(SbEvents[ours[i].event], &mine[ours[i].phase]));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(solve); i++)
    PetscCall(SbLogSecondsNamed(solve[i], &mine[SOLVE]));
  mine[CONTACT] = PetscMax(0, mine[CONTACT] - mine[SEARCH]); /* the search is a part of it */
  PetscCall(PetscTime(&p->total));
  p->total -= out->wall_start;
  mine[SB_PHASE_COUNT - 1] = p->total;
  PetscCallMPI(MPI_Allreduce(mine, most, SB_PHASE_COUNT, MPIU_REAL, MPI_MAX, out->comm));
  p->total = most[SB_PHASE_COUNT - 1];
  for (int i = 0; i < SB_PHASE_COUNT - 1; i++) most[SB_PHASE_COUNT - 1] -= most[i];
  for (int i = 0; i < SB_PHASE_COUNT; i++) {
    p->phase[i].name = names[i];
    p->phase[i].seconds = PetscMax(most[i], 0.);
  }
  cpu = SbCpuSeconds() - out->cpu_start;
  PetscCallMPI(MPI_Allreduce(&cpu, &p->cpu, 1, MPIU_REAL, MPI_MAX, out->comm));
  (void)getrusage(RUSAGE_SELF, &usage);
  memory = 1024. * (PetscReal)usage.ru_maxrss;
  PetscCallMPI(MPI_Allreduce(&memory, &p->memory_max, 1, MPIU_REAL, MPI_MAX, out->comm));
  PetscCallMPI(MPI_Allreduce(&memory, &p->memory_sum, 1, MPIU_REAL, MPI_SUM, out->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
