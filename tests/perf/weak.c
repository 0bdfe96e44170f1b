/*
  Weak scaling in counts, not seconds: cost of a static solve per rank when the mesh grows with the
  number of ranks. A bar under gravity, clamped at one end, linear material, relative residual 1e-8,
  of about -tets tets for each rank. scripts/many_ranks makes the table.

    scripts/mpi 64 build/tests/perf/weak -tets 5000 -element p1 -poisson 0.3 -solver cg_two_level
    -length 4

  Printed are the iterations; the messages, bytes sent, reductions and bytes received in gathers of
  the solve and, within it, of the set-up of the preconditioner, largest of a rank and mean; the
  aggregates that a rank solves for; the largest memory of a rank since its start, and that of rank
  0, which distributes the mesh.
*/
#include "perf.h"
#include <sbsolver.h>

typedef struct {
  double messages, bytes, reductions, gathered;
} Counts;

/* Bytes that this rank has received in gathers: PETSc counts the calls only. */
static double gathered;

#undef MPI_Allgatherv
int MPI_Allgatherv(const void *send, int nsend, MPI_Datatype sendtype, void *receive,
                   const int count[], const int at[], MPI_Datatype type, MPI_Comm comm)
{
  int size, bytes;

  (void)MPI_Comm_size(comm, &size);
  (void)MPI_Type_size(type, &bytes);
  for (int p = 0; p < size; p++)
    gathered += (double)count[p] * bytes;
  return PMPI_Allgatherv(send, nsend, sendtype, receive, count, at, type, comm);
}

static Counts counts(void)
{
  return (Counts){petsc_isend_ct + petsc_send_ct, petsc_isend_len + petsc_send_len,
                  petsc_allreduce_ct + petsc_gather_ct, gathered};
}

/* The largest resident size of this process so far, kB. */
static double peak(void)
{
  char line[256];
  long value = 0;
  FILE *f = fopen("/proc/self/status", "r");

  while (f && fgets(line, sizeof(line), f))
    if (!strncmp(line, "VmHWM:", 6))
      value = strtol(line + 6, NULL, 10);
  if (f)
    (void)fclose(f);
  return (double)value;
}

/* Largest and mean over the ranks. */
static PetscErrorCode print_spread(const char *name, const char *unit, double mine)
{
  double most, sum;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCallMPI(MPI_Allreduce(&mine, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(&mine, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "sample %s %s %.6g\nsample %s_mean %s %.6g\n", name, unit,
                        most, name, unit, sum / size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode print_counts(const char *of, Counts c)
{
  const char *const name[] = {"messages", "bytes", "reductions", "gathered"};
  const double value[] = {c.messages, c.bytes, c.reductions, c.gathered};
  char text[32];

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    PetscCall(PetscSNPrintf(text, sizeof(text), "%s%s", of, name[k]));
    PetscCall(print_spread(text, k % 2 ? "B" : "1", value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Aggregates that a rank solves for at most, and those of all, from the view of the
   preconditioner. */
static PetscErrorCode find_solved(PC pc, PetscMPIInt size, double *most, double *total)
{
  char text[4096];
  const char *at;

  PetscFunctionBeginUser;
  PetscCall(test_pc_view(pc, sizeof(text), text));
  at = strstr(text, " aggregates");
  while (at && at > text && at[-1] != ' ')
    at--;
  *most = *total = at ? atof(at) : 0.;
  at = strstr(text, "at most ");
  if (at && size > 1)
    *most = atof(at + 8);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char element[16] = "p1";
  char solver[64] = "cg_two_level";
  char more[1024] = "";
  char text[PERF_TEXT];
  PetscReal tets = 5000.;
  PetscReal nu = 0.3;
  PetscReal length = 4.;
  double most = 0.;
  double total = 0.;
  PetscInt k;
  PetscEventPerfInfo setup;
  PetscMPIInt size;
  Counts before, after;
  TestScene t;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(perf_argument("-element", sizeof(element), element));
  PetscCall(perf_argument("-solver", sizeof(solver), solver));
  PetscCall(perf_argument("-more", sizeof(more), more));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-tets", &tets, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-poisson", &nu, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-length", &length, NULL));
  k = (PetscInt)(0.5 + PetscPowReal(tets * size / (6. * length), 1. / 3.));
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "-bodies bar -body_bar_mesh box:%g,0.1,0.1:%d,%d,%d -body_bar_material "
                          "linear -body_bar_young 5e5 "
                          "-body_bar_poisson %g "
                          "-body_bar_element %s -sets end -set_end_at plane:1,0,0,0 -effects "
                          "gravity,clamp -effect_gravity_vector "
                          "0,0,-9.81 -effect_clamp_type fixed -effect_clamp_on end -time static "
                          "-ksp_rtol 1e-8 -solver %s %s",
                          0.1 * (double)length, (int)(0.5 + length * (PetscReal)k), (int)k, (int)k,
                          (double)nu, element, solver, more));
  PetscCall(perf_open(text, &t));
  PetscCall(PetscLogDefaultBegin());
  before = counts();
  PetscCall(SbRunSolve(t.run));
  after = counts();
  PetscCheck(!t.run->clock.stop_reason[0], PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "%s",
             t.run->clock.stop_reason);
  PetscCall(PetscLogEventGetPerfInfo(0, SbEvents[SB_EVENT_SOLVER_SETUP], &setup));
  PetscCall(SNESGetKSP(t.run->solve.snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  if (!strcmp(t.run->solve.solver, "cg_two_level"))
    PetscCall(find_solved(pc, size, &most, &total));
  PetscCall(perf_fact("ranks", size));
  PetscCall(perf_fact("tets", (double)t.model->mesh->Ncell));
  PetscCall(perf_fact("unknowns", 3. * (double)t.model->space->Nnode));
  PetscCall(perf_sample("iterations", "1", (double)t.run->counters.linear));
  PetscCall(print_counts("", (Counts){after.messages - before.messages, after.bytes - before.bytes,
                                      after.reductions - before.reductions,
                                      after.gathered - before.gathered}));
  PetscCall(print_counts(
    "setup_", (Counts){setup.numMessages, setup.messageLength, setup.numReductions, 0.}));
  PetscCall(perf_sample("aggregates", "1", most));
  PetscCall(perf_sample("aggregates_mean", "1", total / size));
  PetscCall(perf_fact("memory_rank0", peak()));
  PetscCall(print_spread("memory", "kB", peak()));
  PetscCall(test_scene_close(&t));
  PetscCall(PetscFinalize());
  return 0;
}
