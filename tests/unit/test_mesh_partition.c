// Mesh partitioning: balance, cut faces, very small meshes; communication of records.
// @ranks 1 2 3 4
#include "../../src/mesh/mesh_impl.h"
#include "mesh_test.h"

/* Partitions a box of rank 0; returns the largest part, the sum over all parts, and the faces
   between parts, in cells. */
static PetscErrorCode cut(const char *mesh, const char *type, PetscInt *most, PetscInt *cells,
                          PetscInt *faces)
{
  PetscPartitioner partitioner;
  SbMergedMesh whole;
  SbBody body = test_body("b", mesh);
  PetscMPIInt *part;
  PetscInt count[64] = {0};
  PetscInt n[3] = {0, 0, 0};

  PetscFunctionBeginUser;
  PetscCall(SbMergedMeshCreate(PETSC_COMM_SELF, SB_READING_AUTO, 1, &body, 0, NULL, &whole));
  if (test_rank) /* arrays stay the caller's */
    whole.nvert = whole.ncell = 0;
  PetscCall(PetscMalloc1(whole.ncell, &part));
  if (type)
    PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", type));
  PetscCall(SbPartitionerPrepare(PETSC_COMM_WORLD));
  PetscCall(PetscPartitionerCreate(PETSC_COMM_WORLD, &partitioner));
  PetscCall(SbPartition(partitioner, &whole, part));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_type"));
  for (PetscInt c = 0; c < whole.ncell; c++) {
    SB_CHECK(part[c] >= 0 && part[c] < test_size, "cell %d goes to rank %d", (int)c, (int)part[c]);
    count[part[c]]++;
    n[1]++;
    for (int f = 0; f < 4; f++) {
      const PetscInt other = whole.neighbour[4 * c + f];

      n[2] += other > c && part[other] != part[c];
    }
  }
  for (int r = 0; r < test_size; r++)
    n[0] = PetscMax(n[0], count[r]);
  PetscCallMPI(MPI_Bcast(n, 3, MPIU_INT, 0, PETSC_COMM_WORLD));
  *most = n[0];
  *cells = n[1];
  *faces = n[2];
  PetscCall(PetscFree(part));
  PetscCall(SbMergedMeshDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A bar of 24 x 6 x 6 cells of 6 tets: cut across into as many pieces as there are ranks, each
  border has 72 faces. METIS promises parts of at most 1 % above the mean, bisection is rougher. No
  border may be longer than twice the shortest possible one.
*/
static PetscErrorCode test_bar(const char *type, PetscReal slack)
{
  PetscInt most, cells, faces;

  PetscFunctionBeginUser;
  PetscCall(cut("box:4,1,1:6", type, &most, &cells, &faces));
  SB_CHECK(cells == 5184, "%d cells", (int)cells);
  SB_CHECK(most <= (1 + slack) * cells / test_size + 1, "%d of %d cells on one rank of %d",
           (int)most, (int)cells, (int)test_size);
  SB_CHECK(faces <= 2 * 72 * (test_size - 1), "%d faces between the parts of %d ranks", (int)faces,
           (int)test_size);
  SB_CHECK(faces >= 72 * (test_size - 1), "%d faces between the parts of %d ranks", (int)faces,
           (int)test_size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank r sends i to rank (r + i) % size for i below r + 3: it arrives in order, and the answer i +
   100 r returns. */
static PetscErrorCode test_route(void)
{
  PetscMPIInt *dest;
  PetscInt number[16], *got, answer[16];
  PetscInt last = -1;
  SbRoute route;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(test_rank + 3, &dest));
  for (PetscMPIInt i = 0; i < test_rank + 3; i++) {
    number[i] = 100 * test_rank + i;
    dest[i] = (test_rank + i) % test_size;
  }
  PetscCall(SbRouteCreate(PETSC_COMM_WORLD, test_rank + 3, NULL, dest, &route));
  PetscCall(SbRouteSend(&route, sizeof(PetscInt), NULL, number, &got));
  for (PetscInt k = 0; k < route.nrecv; k++) {
    const PetscInt from = got[k] / 100;

    SB_CHECK((from + got[k] % 100) % test_size == test_rank, "%d of rank %d", (int)got[k],
             (int)from);
    SB_CHECK(got[k] > last, "%d follows %d", (int)got[k], (int)last);
    last = got[k];
    got[k] = got[k] % 100 + 100 * from;
  }
  PetscCall(SbRouteReply(&route, sizeof(PetscInt), got, answer));
  for (PetscMPIInt i = 0; i < test_rank + 3; i++)
    SB_CHECK(answer[i] == i + 100 * test_rank, "answer %d to %d", (int)answer[i], (int)i);
  PetscCall(PetscFree(got));
  PetscCall(SbRouteDestroy(&route));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt most, cells, faces;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(test_route());
  PetscCall(test_bar("metis", 0.01));
  PetscCall(test_bar(NULL, 0.01));
  PetscCall(test_bar("bisection", 0.03));

  /* with two cells each of two ranks gets one */
  PetscCall(cut("tests/data/two_tets.msh", "metis", &most, &cells, &faces));
  SB_CHECK(most == (test_size == 1 ? 2 : 1), "%d cells on one rank", (int)most);
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
