/*
  partition.c - METIS as a PetscPartitioner: k-way partition of the graph of cells that share a face.

  Debian's PETSc knows no METIS, so the type `metis` is registered here. The whole graph is on one rank. A mesh that
  knows its neighbours hands them over and saves PETSc the search for them: 2.8 s for 200,000 tets, ten times what all the
  rest of the distribution takes.
  Reference: Karypis and Kumar, "A fast and high quality multilevel scheme for partitioning irregular graphs", 1998.
*/
#include <metis.h>
#include <petsc/private/partitionerimpl.h> /* a partitioner of our own fills the table of operations, which is private */
#include "mesh_impl.h"

typedef struct {
  PetscInt ncell;
  const PetscInt *neighbour; /* [ncell][4], borrowed */
} Metis;

/* PETSc 3.26 passes weights of edges too. */
#if PETSC_VERSION_LT(3, 23, 0)
  #define EDGE_SECTION
#else
  #define EDGE_SECTION __attribute__((unused)) PetscSection edge_weights,
#endif

/* The graph in the types of METIS: from the neighbours when they are known, else from PETSc. */
static PetscErrorCode fill_graph(const Metis *m, PetscInt n, const PetscInt start[],
                                 const PetscInt adjacency[], idx_t xadj[], idx_t adj[])
{
  idx_t k = 0;

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < n; c++) {
    xadj[c] = k;
    if (m->neighbour) {
      for (int f = 0; f < 4; f++) {
        if (m->neighbour[4 * c + f] >= 0) adj[k++] = (idx_t)m->neighbour[4 * c + f];
      }
    } else {
      for (PetscInt i = start[c]; i < start[c + 1]; i++) adj[k++] = (idx_t)adjacency[i];
    }
  }
  xadj[n] = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Part of every cell. */
static PetscErrorCode call_metis(const Metis *m, PetscInt nparts, PetscInt n, const PetscInt start[],
                                 const PetscInt adjacency[], idx_t part[])
{
  idx_t nvtxs = (idx_t)n, ncon = 1, np = (idx_t)nparts, cut, options[METIS_NOPTIONS];
  idx_t *xadj, *adj;
  int status;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(n + 1, &xadj, m->neighbour ? 4 * n : start[n], &adj));
  PetscCall(fill_graph(m, n, start, adjacency, xadj, adj));
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_UFACTOR] = 10; /* the largest part is at most 1 % above the mean */
  status =
    METIS_PartGraphKway(&nvtxs, &ncon, xadj, adj, NULL, NULL, NULL, &np, NULL, NULL, options, &cut, part);
  PetscCall(PetscFree2(xadj, adj));
  PetscCheck(status == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_PartGraphKway() failed with %d",
             status);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All ranks decide alike: the graph must be on one of them. */
static PetscErrorCode check_serial(PetscPartitioner p, PetscInt n)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)p);
  int mine = n > 0, holders = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(&mine, &holders, 1, MPI_INT, MPI_SUM, comm));
  PetscCheck(holders <= 1, comm, PETSC_ERR_SUP,
             "The metis partitioner needs the whole graph on one rank, %d hold parts of it", holders);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PetscPartitionerPartition_Metis(PetscPartitioner p, PetscInt nparts, PetscInt n,
                                                      PetscInt start[], PetscInt adjacency[],
                                                      PetscSection weights, EDGE_SECTION PetscSection target,
                                                      PetscSection section, IS *is)
{
  const Metis *m = (const Metis *)p->data;
  idx_t *part;
  PetscInt *points, *next;

  PetscFunctionBeginUser;
  (void)weights;
  (void)target;
  PetscCall(check_serial(p, n));
  PetscCheck(!m->neighbour || m->ncell == n, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "%" PetscInt_FMT " cells to partition, neighbours of %" PetscInt_FMT, n, m->ncell);
  PetscCall(PetscMalloc3(n, &part, n, &points, nparts + 1, &next));
  /* METIS wants more cells than parts. */
  if (n <= nparts) {
    for (PetscInt c = 0; c < n; c++) part[c] = (idx_t)c;
  } else
    PetscCall(call_metis(m, nparts, n, start, adjacency, part));
  PetscCall(PetscArrayzero(next, nparts + 1));
  for (PetscInt c = 0; c < n; c++) next[part[c] + 1]++;
  for (PetscInt r = 0; r < nparts; r++) {
    PetscCall(PetscSectionAddDof(section, r, next[r + 1]));
    next[r + 1] += next[r];
  }
  for (PetscInt c = 0; c < n; c++) points[next[part[c]]++] = c;
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)p), n, points, PETSC_COPY_VALUES, is));
  PetscCall(PetscFree3(part, points, next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PetscPartitionerDestroy_Metis(PetscPartitioner p)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(p->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PetscPartitionerCreate_Metis(PetscPartitioner p)
{
  Metis *m;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&m));
  p->data = m;
  p->noGraph = PETSC_FALSE;
  p->ops->partition = PetscPartitionerPartition_Metis;
  p->ops->destroy = PetscPartitionerDestroy_Metis;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPartitionerSetNeighbours(PetscPartitioner p, PetscInt ncell, const PetscInt neighbour[])
{
  PetscBool ismetis;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)p, "metis", &ismetis));
  if (!ismetis) PetscFunctionReturn(PETSC_SUCCESS);
  ((Metis *)p->data)->ncell = ncell;
  ((Metis *)p->data)->neighbour = neighbour;
  p->noGraph = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPartitionerRegister(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPartitionerRegister("metis", PetscPartitionerCreate_Metis));
  PetscFunctionReturn(PETSC_SUCCESS);
}
