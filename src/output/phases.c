/*
  Times of the phases for the closing table: of the slowest rank; the last phase is the rest of the wall time.
*/
#include <sys/resource.h>
#include <time.h>
#include "output_impl.h"

PetscErrorCode SbPhasesGet(SbOutput out, SbPhases *p)
{
  static const char *const names[SB_PHASE_COUNT] = {"mesh",         "set-up",  "residual",       "tangent",
                                                    "linear solve", "contact", "contact search", "energies",
                                                    "output",       "other"};
  PetscReal mine[SB_PHASE_COUNT], most[SB_PHASE_COUNT], memory, cpu;
  struct rusage usage;

  PetscFunctionBeginUser;
  PetscCall(SbLogSeconds(mine));
  PetscCall(PetscTime(&p->total));
  p->total -= out->wall_start;
  mine[SB_PHASE_OTHER] = p->total;
  PetscCallMPI(MPI_Allreduce(mine, most, SB_PHASE_COUNT, MPIU_REAL, MPI_MAX, out->comm));
  p->total = most[SB_PHASE_OTHER];
  for (int i = 0; i < SB_PHASE_OTHER; i++) most[SB_PHASE_OTHER] -= most[i];
  for (int i = 0; i < SB_PHASE_COUNT; i++) {
    p->phase[i].name = names[i];
    p->phase[i].seconds = PetscMax(most[i], 0.);
  }
  cpu = SB_CPU_SECONDS - out->cpu_start;
  PetscCallMPI(MPI_Allreduce(&cpu, &p->cpu, 1, MPIU_REAL, MPI_MAX, out->comm));
  (void)getrusage(RUSAGE_SELF, &usage);
  memory = 1024. * (PetscReal)usage.ru_maxrss;
  PetscCallMPI(MPI_Allreduce(&memory, &p->memory_max, 1, MPIU_REAL, MPI_MAX, out->comm));
  PetscCallMPI(MPI_Allreduce(&memory, &p->memory_sum, 1, MPIU_REAL, MPI_SUM, out->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
