/*
  Set-up seconds per million tets, by phase: reading (or generating) and checking the mesh,
  distributing and numbering it, the space, the assembly plan, the matrices; compared with
  DMCreateMatrix() on a DMPlex of the same tets.

    setup -mesh box:0.4,0.1,0.1:8 -rounds 3

  The phases of the mesh are timed by PETSc's log events; the matrices are timed here. The plan is
  made with the first matrix of a space: the difference to a second one of the same kind (SBAIJ, on
  several ranks BAIJ) is its time.
*/
#include "perf.h"

/* Seconds of an event so far on this rank. */
static double event_seconds(SbEvent e)
{
  PetscEventPerfInfo info;

  if (PetscLogEventGetPerfInfo(PETSC_DETERMINE, SbEvents[e], &info))
    return 0.;
  return info.time;
}

/* What DMPlex does for three unknowns per vertex. */
static PetscErrorCode dm_matrix(SbMesh mesh, PerfClock *seconds)
{
  PetscSection section;
  PetscInt pStart, pEnd, vStart, vEnd;
  PerfClock start;
  DM dm;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(perf_plex(mesh, &dm));
  PetscCall(DMPlexGetChart(dm, &pStart, &pEnd));
  PetscCall(DMPlexGetDepthStratum(dm, 0, &vStart, &vEnd));
  PetscCall(PetscSectionCreate(PETSC_COMM_WORLD, &section));
  PetscCall(PetscSectionSetChart(section, pStart, pEnd));
  for (PetscInt v = vStart; v < vEnd; v++)
    PetscCall(PetscSectionSetDof(section, v, 3));
  PetscCall(PetscSectionSetUp(section));
  PetscCall(DMSetLocalSection(dm, section));
  PetscCall(PetscSectionDestroy(&section));
  PetscCall(DMSetMatType(dm, MATAIJ));
  start = perf_start();
  PetscCall(DMCreateMatrix(dm, &A));
  *seconds = perf_stop(start);
  PetscCall(MatDestroy(&A));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode own_matrix(SbSpace s, SbMatrixKind kind, PerfClock *seconds)
{
  PerfClock start;
  Mat A;

  PetscFunctionBeginUser;
  start = perf_start();
  PetscCall(SbSpaceCreateMatrix(s, kind, &A));
  *seconds = perf_stop(start);
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mesh and space of the scene, by events. */
static PetscErrorCode make_model(SbModel m, double *per_million)
{
  static const SbEvent events[3] = {SB_EVENT_MESH_READ, SB_EVENT_MESH_DISTRIBUTE,
                                    SB_EVENT_SPACE_SETUP};
  static const char *const names[3] = {"read", "distribute", "space"};
  double seconds[3];

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    seconds[k] = event_seconds(events[k]);
  PetscCall(SbModelSetUp(m));
  *per_million = 1e6 / (double)m->mesh->Ncell;
  for (int k = 0; k < 3; k++)
    seconds[k] = event_seconds(events[k]) - seconds[k];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, seconds, 3, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  for (int k = 0; k < 3; k++)
    PetscCall(perf_sample(names[k], "s/Mtet", *per_million * seconds[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode matrices(SbModel m, double per_million)
{
  PerfClock first = {0., 0.};
  PerfClock second = first;
  PerfClock aij = first;
  PerfClock dm = first;
  SbMatrixKind kind;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  kind = size > 1 ? SB_MATRIX_BAIJ : SB_MATRIX_SBAIJ;
  PetscCall(own_matrix(m->space, kind, &first));
  PetscCall(own_matrix(m->space, kind, &second));
  PetscCall(own_matrix(m->space, SB_MATRIX_AIJ, &aij));
  PetscCall(dm_matrix(m->mesh, &dm));
  PetscCall(perf_sample("plan_and_blocks", "s/Mtet", per_million * first.cpu));
  PetscCall(perf_sample("matrix_blocks", "s/Mtet", per_million * second.cpu));
  PetscCall(perf_sample("matrix_aij", "s/Mtet", per_million * aij.cpu));
  PetscCall(perf_sample("dmcreatematrix_aij", "s/Mtet", per_million * dm.cpu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:8";
  char text[PERF_TEXT];
  PetscInt rounds = 3;
  double per_million = 0.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(perf_bar(mesh, "", text));
  for (PetscInt r = 0; r < rounds; r++) {
    TestScene t;

    PetscCall(perf_read(text, &t));
    PetscCall(make_model(t.model, &per_million));
    PetscCall(matrices(t.model, per_million));
    if (!r)
      PetscCall(perf_fact("tets", 1e6 / per_million));
    if (!r)
      PetscCall(perf_fact("nodes", (double)t.model->space->Nnode));
    PetscCall(test_scene_close(&t));
  }
  PetscCall(PetscFinalize());
  return 0;
}
