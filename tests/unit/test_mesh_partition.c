// The METIS partitioner: balance and cut of a box, with neighbours given and with the graph from PETSc, few cells.
// @ranks 1 2 3 4
#include <petscdmplex.h>
#include "mesh_test.h"

/* Cells per rank after distribution by the partitioner. */
static PetscErrorCode distribute(const char *mesh, PetscBool give_neighbours, PetscInt *ncell,
                                 PetscInt *total)
{
  SbWhole whole;
  SbBody body = test_body("b", mesh);
  DM dm, apart;
  PetscPartitioner part;
  PetscMPIInt rank;
  PetscInt cStart, cEnd;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(SbWholeCreate(1, &body, 0, NULL, &whole));
  *total = whole.ncell;
  PetscCall(DMCreate(PETSC_COMM_WORLD, &dm));
  PetscCall(DMSetType(dm, DMPLEX));
  PetscCall(DMSetDimension(dm, 3));
  PetscCall(DMPlexBuildFromCellList(dm, rank ? 0 : whole.ncell, rank ? 0 : whole.nvert, 4, whole.cell));
  PetscCall(DMPlexGetPartitioner(dm, &part));
  PetscCall(PetscPartitionerSetType(part, "metis"));
  if (give_neighbours) PetscCall(SbPartitionerSetNeighbours(part, rank ? 0 : whole.ncell, whole.neighbour));
  PetscCall(DMPlexDistribute(dm, 0, NULL, &apart));
  PetscCall(DMPlexGetHeightStratum(apart ? apart : dm, 0, &cStart, &cEnd));
  *ncell = cEnd - cStart;
  PetscCall(DMDestroy(&apart));
  PetscCall(DMDestroy(&dm));
  PetscCall(SbWholeDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parts are at most 1 % (and a cell) above the mean, the promise of the partitioner. */
static PetscErrorCode test_balance(PetscBool give_neighbours)
{
  PetscInt ncell, total, most, sum;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(distribute("box:2,1,1:6", give_neighbours, &ncell, &total));
  PetscCallMPI(MPI_Allreduce(&ncell, &most, 1, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(&ncell, &sum, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(sum == total, "%d of %d cells", (int)sum, (int)total);
  SB_CHECK(most <= 1.01 * total / size + 1, "%d cells on one rank of %d", (int)most, (int)size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With two cells two ranks get one each. */
static PetscErrorCode test_few(void)
{
  PetscInt ncell, total, most;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(distribute("tests/data/two_tets.msh", PETSC_TRUE, &ncell, &total));
  PetscCallMPI(MPI_Allreduce(&ncell, &most, 1, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
  SB_CHECK(most == (size == 1 ? 2 : 1), "%d cells on one rank", (int)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbPartitionerRegister());
  PetscCall(test_balance(PETSC_TRUE));
  PetscCall(test_balance(PETSC_FALSE));
  PetscCall(test_few());
  SB_TEST_END();
}
