/*
  Time and memory from a mesh file to the distributed mesh, phase by phase.

    mesh -mesh big.msh
    mesh -mesh big.h5 -slabs      (all ranks read)
    mesh -mesh box:0.4,0.1,0.1:36 -petsc

  Seconds are wall time, and as NAME_cpu the largest CPU time of a rank (including waiting for
  messages).

  read: the file to arrays on rank 0; read_and_check: with the checks of a run, all bodies in the
  merged mesh; distribute: partition and migration; number: local numbering; plex: the DMPLEX of
  the numbered cells. With -petsc, on several ranks, also petsc_...: the same by PETSc's own
  distribution, before; peaks count it then.
  Memory is the largest resident size within a phase (VmHWM, reset before it), of rank 0 and of the
  largest other rank, less that of the process at its start. One run per process: freed pages may
  remain.
*/
#include "perf.h"
#include <petscdmplex.h>
#include <sbsurface.h>
#include "../../src/mesh/mesh_impl.h"

/* A line of /proc/self/status in MiB. */
static double status(const char *name)
{
  FILE *file = fopen("/proc/self/status", "r");
  char line[256];
  double kib = 0.;

  while (file && fgets(line, sizeof(line), file))
    if (!strncmp(line, name, strlen(name)))
      kib = strtod(line + strlen(name) + 1, NULL);
  if (file)
    (void)fclose(file);
  return kib / 1024;
}

/* From here on VmHWM counts again. */
static void forget_peak(void)
{
  FILE *file = fopen("/proc/self/clear_refs", "w");

  if (!file)
    return;
  (void)fputs("5", file);
  (void)fclose(file);
}

typedef struct {
  PerfClock start;
  double base, most[2]; /* MiB: at the start; of the phases so far, rank 0 and others */
} Phase;

static void phase_begin(Phase *p)
{
  forget_peak();
  p->start = perf_start();
}

static PetscErrorCode phase_end(Phase *p, const char *name)
{
  const PerfClock taken = perf_stop(p->start);
  double mine[2] = {0., 0.};
  double all[2];
  char label[64];
  PetscMPIInt rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  mine[rank > 0] = status("VmHWM:") - p->base;
  PetscCallMPI(MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  for (int k = 0; k < 2; k++)
    p->most[k] = PetscMax(p->most[k], all[k]);
  PetscCall(perf_sample(name, "s", taken.wall));
  (void)snprintf(label, sizeof(label), "%s_cpu", name);
  PetscCall(perf_sample(label, "s", taken.cpu));
  (void)snprintf(label, sizeof(label), "%s_rank0", name);
  PetscCall(perf_sample(label, "MiB", all[0]));
  (void)snprintf(label, sizeof(label), "%s_others", name);
  if (size > 1)
    PetscCall(perf_sample(label, "MiB", all[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_only(const SbBody *body)
{
  SbImport im = {0};
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank)
    PetscCall(SbImportRead(body, &im));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same mesh by DMPlexDistribute() and DMPlexDistributeOverlap(), from cells and vertices on
   rank 0, with the parts of our partitioner. */
static PetscErrorCode petsc_way(const SbMergedMesh *w, Phase *p)
{
  PetscPartitioner partitioner, parts;
  PetscMPIInt *part, size;
  PetscInt *key, *start, *point, *sizes;
  PetscReal *x;
  PetscSF sf;
  DM dm, distributed, overlapped;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));

  // parts, for a partitioner that knows them
  PetscCall(PetscMalloc2(w->ncell, &part, w->ncell, &key));
  PetscCall(PetscPartitionerCreate(PETSC_COMM_WORLD, &partitioner));
  PetscCall(SbPartition(partitioner, w, part));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  for (PetscInt c = 0; c < w->ncell; c++)
    key[c] = part[c];
  PetscCall(SbBucketByKey(w->ncell, key, size, &start, &point));
  PetscCall(PetscMalloc1(size, &sizes));
  for (PetscMPIInt r = 0; r < size; r++)
    sizes[r] = start[r + 1] - start[r];
  PetscCall(PetscMalloc1(3 * (size_t)w->nvert, &x));
  for (PetscInt v = 0; v < w->nvert; v++)
    PetscCall(PetscArraycpy(x + 3 * v, w->vertex[v].x, 3));

  phase_begin(p);
  PetscCall(DMPlexCreateFromCellListParallelPetsc(PETSC_COMM_WORLD, 3, w->ncell, w->nvert,
                                                  PETSC_DECIDE, 4, PETSC_FALSE, w->cell, 3, x, &sf,
                                                  NULL, &dm));
  PetscCall(phase_end(p, "petsc_create"));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(DMPlexGetPartitioner(dm, &parts));
  PetscCall(PetscPartitionerSetType(parts, PETSCPARTITIONERSHELL));
  PetscCall(PetscPartitionerShellSetPartition(parts, size, sizes, point));
  phase_begin(p);
  PetscCall(DMPlexDistribute(dm, 0, NULL, &distributed));
  PetscCall(phase_end(p, "petsc_distribute"));
  phase_begin(p);
  PetscCall(DMPlexDistributeOverlap(distributed, 1, NULL, &overlapped));
  PetscCall(phase_end(p, "petsc_overlap"));
  PetscCall(DMDestroy(&dm));
  PetscCall(DMDestroy(&distributed));
  PetscCall(DMDestroy(&overlapped));
  PetscCall(PetscFree2(part, key));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(point));
  PetscCall(PetscFree(sizes));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode measure(SbBody *body, SbReading reading, PetscBool petsc)
{
  Phase p;
  SbMergedMesh whole, curved;
  SbMesh mesh;
  SbLocalMesh local;
  PetscPartitioner partitioner;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&p, sizeof(p)));
  p.base = status("VmRSS:");
  if (reading == SB_READING_RANK0) {
    phase_begin(&p);
    PetscCall(read_only(body));
    PetscCall(phase_end(&p, "read"));
  }
  phase_begin(&p);
  PetscCall(SbMergedMeshCreate(PETSC_COMM_WORLD, reading, 1, body, 0, NULL, &whole));
  PetscCall(phase_end(&p, "read_and_check"));
  PetscCall(SbPartitionerPrepare(PETSC_COMM_WORLD));
  if (petsc)
    PetscCall(petsc_way(&whole, &p));
  PetscCall(PetscNew(&mesh));
  mesh->comm = PETSC_COMM_WORLD;
  mesh->nbody = 1;
  mesh->body = body;
  curved = whole;
  whole.curved = NULL;
  whole.edge_off = NULL;
  phase_begin(&p);
  PetscCall(PetscPartitionerCreate(PETSC_COMM_WORLD, &partitioner));
  PetscCall(SbDistribute(partitioner, PETSC_FALSE, &whole, &local));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  PetscCall(phase_end(&p, "distribute"));
  phase_begin(&p);
  PetscCall(SbMeshNumber(mesh, &local));
  PetscCall(phase_end(&p, "number"));
  phase_begin(&p);
  PetscCall(SbPlexCreate(mesh, PETSC_FALSE));
  PetscCall(phase_end(&p, "plex"));
  phase_begin(&p);
  PetscCall(SbMeshCurve(mesh, curved.ncurved, curved.curved, curved.edge_off));
  PetscCall(PetscFree(curved.curved));
  PetscCall(PetscFree(curved.edge_off));
  PetscCall(phase_end(&p, "curve"));
  PetscCall(perf_sample("peak_rank0", "MiB", p.most[0]));
  PetscCall(perf_sample("peak_others", "MiB", p.most[1]));
  PetscCall(perf_sample("kept", "MiB", status("VmRSS:") - p.base));
  PetscCall(perf_fact("tets", mesh->Ncell));
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbBody body;
  PetscBool slabs = PETSC_FALSE;
  PetscBool petsc = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  SbMemoryReturnLarge();
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(SbOptionsRegister("body", "", PETSC_DECIDE, SbTetRows));
  PetscCall(PetscMemzero(&body, sizeof(body)));
  body.scale = 1;
  body.edge_nodes = PETSC_TRUE;
  PetscCall(PetscStrncpy(body.mesh, "box:0.4,0.1,0.1:8", sizeof(body.mesh)));
  PetscCall(perf_argument("-mesh", sizeof(body.mesh), body.mesh));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-slabs", &slabs, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-petsc", &petsc, NULL));
  PetscCall(measure(&body, slabs ? SB_READING_SLABS : SB_READING_RANK0, petsc));
  PetscCall(SbOptionsReset());
  PetscCall(PetscFinalize());
  return 0;
}
