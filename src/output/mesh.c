/*
  What depends on the mesh, rebuilt after a re-meshing: original orders, numbers of nodes, a hash of
  the mesh.

  Original order: vertices, cells and nodes by their number in the scenario, whatever the partition.
  Rank r of p holds the slice of numbers [N r / p, N (r + 1) / p) (PETSc's usual layout). A star
  forest connects each owned entity (a leaf) with its position in a slice (a root); for any number
  of components.

  Numbers of nodes at faces have gaps. They are closed once, when an order is made: every number
  that is taken marks its position among all possible ones; the count of marks from the lowest rank
  on is its new number.

  The hash is a sum of mixed 64-bit words (the finaliser of splitmix64; Steele, Lea and Flood 2014),
  which does not depend on the order of its entities.
*/
#include "output_impl.h"

PetscErrorCode SbOrderCreate(MPI_Comm comm, PetscInt N, PetscInt nowned, const PetscInt original[],
                             SbOrder *order)
{
  PetscLayout layout;
  PetscInt end;

  PetscFunctionBeginUser;
  PetscCall(PetscLayoutCreate(comm, &layout));
  PetscCall(PetscLayoutSetSize(layout, N));
  PetscCall(PetscLayoutSetUp(layout));
  PetscCall(PetscLayoutGetRange(layout, &order->start, &end));
  order->N = N;
  order->n = end - order->start;
  order->nowned = nowned;
  PetscCall(PetscSFCreate(comm, &order->sf));
  PetscCall(PetscSFSetGraphLayout(order->sf, layout, nowned, NULL, PETSC_COPY_VALUES, original));
  PetscCall(PetscSFSetUp(order->sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderCreateSparse(MPI_Comm comm, PetscInt bound, PetscInt nowned,
                                   const PetscInt key[], SbOrder *order)
{
  SbOrder all;
  PetscInt *mark, *number;
  PetscInt before = 0;
  PetscInt N;

  PetscFunctionBeginUser;
  PetscCall(SbOrderCreate(comm, bound, nowned, key, &all));
  PetscCall(PetscCalloc1(all.n, &mark));
  PetscCall(PetscMalloc1(nowned, &number));
  for (PetscInt i = 0; i < nowned; i++)
    number[i] = 1;
  PetscCall(SbForestReduce(all.sf, 1, MPIU_INT, number, mark));
  for (PetscInt i = 0; i < all.n; i++)
    before += mark[i];
  PetscCallMPI(MPI_Allreduce(&before, &N, 1, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Scan(MPI_IN_PLACE, &before, 1, MPIU_INT, MPI_SUM, comm));
  for (PetscInt i = all.n - 1; i >= 0; i--)
    before = mark[i] ? mark[i] = before - 1 : before;
  PetscCall(SbForestBroadcast(all.sf, 1, MPIU_INT, mark, number));
  PetscCall(SbOrderCreate(comm, N, nowned, number, order));
  PetscCall(PetscFree(mark));
  PetscCall(PetscFree(number));
  PetscCall(SbOrderDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderDestroy(SbOrder *order)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSFDestroy(&order->sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static uint64_t mix(uint64_t x)
{
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/* Hash of a number at a position; -0 counts as 0. */
uint64_t SbMixReal(uint64_t position, PetscReal value)
{
  uint64_t bits;

  value += 0.;
  memcpy(&bits, &value, sizeof(bits));
  return mix(position ^ mix(bits));
}

uint64_t SbHashBytes(uint64_t start, size_t n, const char bytes[])
{
  uint64_t sum = mix(start ^ n);

  for (size_t i = 0; i < n; i++)
    sum = mix(sum ^ (unsigned char)bytes[i]);
  return sum;
}

/* Points: vertices and P2's nodes at edges, or each cell's own; tets: a cell of P2 is eight, unless
   -output_quadratic. */
static PetscErrorCode order_points(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;
  const SbSpace s = run->model->space;
  const PetscInt first = mesh->Nvert + 8 * mesh->Ncell; /* of the numbers of nodes at edges */
  const PetscInt size =
    out->discontinuous ? SB_CELL_NODES * mesh->ncell_owned : mesh->nvert_owned + s->nnode_owned;
  PetscInt *key, *node, *slice;
  PetscInt nedge = 0;
  PetscInt n = 0;
  PetscInt before, all;
  PetscReal *number;
  PetscBool *cut;
  SbOrder edges = {0};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(PetscMax(size, s->nnode_owned), &key, s->nnode_owned, &node,
                         mesh->ncell_owned, &cut));

  /* numbers of the nodes at edges, behind those of the vertices; ghosts have them, too */
  if (s->edge_node) {
    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      if (s->node_orig[i] < first)
        continue;
      node[nedge] = i;
      key[nedge++] = s->node_orig[i] - first;
    }
    PetscCall(SbOrderCreateSparse(out->comm, 6 * mesh->Ncell, nedge, key, &edges));
    PetscCall(PetscCalloc2(edges.n, &slice, 3 * s->nnode, &number));
    for (PetscInt i = 0; i < edges.n; i++)
      slice[i] = mesh->Nvert + edges.start + i;
    PetscCall(SbForestBroadcast(edges.sf, 1, MPIU_INT, slice, key));
    for (PetscInt i = 0; i < nedge; i++)
      number[3 * node[i]] = (PetscReal)key[i];
    PetscCall(SbSpaceUpdateGhosts(s, number));
    PetscCall(PetscMalloc1(s->nnode + 1, &out->edge_number)); /* also without nodes not NULL */
    for (PetscInt i = 0; i < s->nnode; i++)
      out->edge_number[i] = (PetscInt)number[3 * i];
    PetscCall(PetscFree2(slice, number));
  }

  /* the points */
  PetscCall(PetscMalloc1(size, &out->place));
  if (out->discontinuous) {
    for (PetscInt i = 0; i < size; i++) {
      const PetscInt cell = i / SB_CELL_NODES;
      const PetscInt a = i % SB_CELL_NODES;

      if (a >= 4 && (!s->edge_node || SbSpaceCellNode(s, cell, a) < 0))
        continue;
      out->place[n] = i;
      key[n++] = SB_CELL_NODES * mesh->cell_orig[cell] + a;
    }
    PetscCall(SbOrderCreateSparse(out->comm, SB_CELL_NODES * mesh->Ncell, n, key, &out->point));
  } else {
    for (n = 0; n < mesh->nvert_owned + nedge; n++) {
      const PetscInt edge = n - mesh->nvert_owned;

      out->place[n] = edge < 0 ? n : node[edge];
      key[n] = edge < 0 ? mesh->vert_orig[n] : out->edge_number[node[edge]];
    }
    PetscCall(SbOrderCreate(out->comm, mesh->Nvert + edges.N, n, key, &out->point));
  }

  /* the cells that are cut, and where their tets begin */
  PetscCall(PetscMalloc1(out->cell.n, &out->split));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++)
    cut[c] = (PetscBool)(s->edge_node && !out->quadratic && SbSpaceCellNode(s, c, 4) >= 0);
  PetscCall(SbForestReduce(out->cell.sf, 1, SB_MPI_BOOL, cut, out->split));
  n = 0;
  for (PetscInt i = 0; i < out->cell.n; i++)
    n += out->split[i];
  PetscCallMPI(MPI_Scan(&n, &before, 1, MPIU_INT, MPI_SUM, out->comm));
  PetscCallMPI(MPI_Allreduce(&n, &all, 1, MPIU_INT, MPI_SUM, out->comm));
  out->tet.N += 7 * all;
  out->tet.n += 7 * n;
  out->tet.start += 7 * (before - n);
  PetscCall(PetscFree3(key, node, cut));
  PetscCall(SbOrderDestroy(&edges));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputOrder(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;
  const SbSpace s = run->model->space;
  uint64_t sum = 0;

  PetscFunctionBeginUser;
  if (out->cell.sf)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the positions of cells, points and nodes in a file, whatever the partition */
  PetscCall(SbOrderCreate(out->comm, mesh->Ncell, mesh->ncell_owned, mesh->cell_orig, &out->cell));
  out->tet = out->cell;
  out->tet.sf = NULL;
  if (s->edge_node || out->discontinuous)
    PetscCall(order_points(run, out));
  else
    PetscCall(
      SbOrderCreate(out->comm, mesh->Nvert, mesh->nvert_owned, mesh->vert_orig, &out->point));
  if (!s->vertices) {
    PetscCall(SbOrderCreateSparse(out->comm, mesh->Nvert + (s->edge_node ? 14 : 8) * mesh->Ncell,
                                  s->nnode_owned, s->node_orig, &out->node));
  } else if (out->discontinuous) {
    PetscCall(
      SbOrderCreate(out->comm, mesh->Nvert, mesh->nvert_owned, mesh->vert_orig, &out->node));
  } else {
    out->node = out->point;
    PetscCall(PetscObjectReference((PetscObject)out->node.sf));
  }

  /* the mesh in one number: a restart on another mesh is refused */
  for (PetscInt i = 0; i < mesh->nvert_owned; i++)
    for (PetscInt c = 0; c < 3; c++)
      sum += SbMixReal(3 * (uint64_t)mesh->vert_orig[i] + (uint64_t)c, mesh->x[3 * i + c]);
  for (PetscInt k = 0; k < mesh->ncell_owned; k++) {
    for (PetscInt a = 0; a < 4; a++)
      sum +=
        mix(mix((uint64_t)mesh->cell_orig[k]) ^ (uint64_t)mesh->vert_orig[mesh->cell[4 * k + a]]);
    for (PetscInt i = 0; mesh->cell_set[k] & SB_CURVED && i < 18; i++)
      sum += SbMixReal(mix((uint64_t)mesh->cell_orig[k]) + (uint64_t)i, mesh->edge_off[18 * k + i]);
  }
  PetscCallMPI(MPI_Allreduce(&sum, &out->mesh_hash, 1, MPI_UINT64_T, MPI_SUM, mesh->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputCountNodes(SbSpace space, SbOutput out)
{
  PetscMPIInt n;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(space->mesh->nbody, &out->body_nodes));
  for (PetscInt i = 0; i < space->nnode_owned; i++)
    out->body_nodes[space->node_body[i]]++;
  PetscCall(PetscMPIIntCast(space->mesh->nbody, &n));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, out->body_nodes, n, MPIU_INT, MPI_SUM, out->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputForgetMesh(SbOutput out)
{
  PetscFunctionBeginUser;
  PetscCall(SbOrderDestroy(&out->cell));
  PetscCall(SbOrderDestroy(&out->node));
  PetscCall(SbOrderDestroy(&out->point));
  PetscCall(PetscFree(out->split));
  PetscCall(PetscFree(out->edge_number));
  PetscCall(PetscFree(out->place));
  PetscCall(PetscFree(out->sigma));
  PetscCall(PetscFree(out->J));
  PetscCall(PetscFree(out->psi));
  PetscCall(PetscFree(out->pressure));
  PetscCall(SbNodalStressDestroy(&out->nodal));
  PetscCall(PetscFree(out->body_nodes));
  PetscCall(PetscFree(out->points.start));
  PetscCall(PetscFree(out->points.corner));
  PetscCall(PetscFree(out->points.V));
  PetscCall(PetscFree(out->points.valence));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbOutputMeshStep(SbRun run)
{
  PetscInt step = 0;

  for (PetscInt b = 0; b < run->model->nbody; b++) {
    const SbMemoryMesh *in_memory = run->model->body[b].in_memory;

    if (in_memory)
      step = PetscMax(step, in_memory->step);
  }
  return step;
}

const char *SbOutputMeshName(PetscInt step, char name[SB_MESH_NAME])
{
  SbFormat(SB_MESH_NAME, name, step ? "mesh_%06" PetscInt_FMT : "mesh", step);
  return name;
}
