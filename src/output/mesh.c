/*
  What depends on the mesh, rebuilt after a re-meshing: original orders, numbers of nodes, a hash of the mesh.

  The hash is a sum of mixed 64-bit words (the finaliser of splitmix64; Steele, Lea and Flood 2014), which
  does not depend on the order of its entities.
*/
#include "output_impl.h"

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

/* Points and tets of P2: nodes at edges are points, too; a cell is eight tets, unless -output_quadratic. */
static PetscErrorCode order_quadratic(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;
  const SbSpace s = run->model->space;
  const PetscInt first = mesh->Nvert + 8 * mesh->Ncell; /* of the numbers of nodes at edges */
  PetscInt *key, *node, nedge = 0, n = 0, size = SB_CELL_NODES * mesh->ncell_owned, before, all;
  PetscReal *number, *owned, *slice;
  SbOrder edges;

  PetscFunctionBeginUser;
  /* numbers of the nodes at edges, behind those of the vertices; ghosts have them, too */
  if (!out->discontinuous) size = mesh->nvert_owned + s->nnode_owned;
  PetscCall(PetscMalloc2(PetscMax(size, s->nnode_owned), &key, s->nnode_owned, &node));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (s->node_orig[i] < first) continue;
    node[nedge] = i;
    key[nedge++] = s->node_orig[i] - first;
  }
  PetscCall(SbOrderCreateSparse(out->comm, 6 * mesh->Ncell, nedge, key, &edges));
  PetscCall(PetscMalloc2(PetscMax(nedge, mesh->ncell_owned), &owned, PetscMax(edges.n, out->cell.n), &slice));
  for (PetscInt i = 0; i < edges.n; i++) slice[i] = (PetscReal)(mesh->Nvert + edges.start + i);
  PetscCall(SbOrderScatter(&edges, 1, slice, owned));
  PetscCall(PetscCalloc1(3 * s->nnode, &number));
  for (PetscInt i = 0; i < nedge; i++) number[3 * node[i]] = owned[i];
  PetscCall(SbSpaceUpdateGhosts(s, number));
  PetscCall(PetscMalloc1(s->nnode, &out->edge_number));
  for (PetscInt i = 0; i < s->nnode; i++) out->edge_number[i] = (PetscInt)number[3 * i];
  PetscCall(PetscFree(number));

  /* the points: each cell's own ones, or the vertices and then these nodes */
  PetscCall(PetscMalloc1(size, &out->place));
  if (out->discontinuous) {
    for (PetscInt i = 0; i < size; i++) {
      const PetscInt cell = i / SB_CELL_NODES, a = i % SB_CELL_NODES;

      if (a >= 4 && SbSpaceCellNode(s, cell, a) < 0) continue;
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
  PetscCall(PetscCalloc1(out->cell.n, &out->split));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++)
    owned[c] = !out->quadratic && SbSpaceCellNode(s, c, 4) >= 0;
  PetscCall(SbOrderGather(&out->cell, 1, owned, slice));
  n = 0;
  for (PetscInt i = 0; i < out->cell.n; i++) n += out->split[i] = slice[i] > 0.;
  PetscCallMPI(MPI_Scan(&n, &before, 1, MPIU_INT, MPI_SUM, out->comm));
  PetscCallMPI(MPI_Allreduce(&n, &all, 1, MPIU_INT, MPI_SUM, out->comm));
  out->tet.N += 7 * all;
  out->tet.n += 7 * n;
  out->tet.start += 7 * (before - n);
  PetscCall(PetscFree2(key, node));
  PetscCall(PetscFree2(owned, slice));
  PetscCall(SbOrderDestroy(&edges));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputOrder(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;
  const SbSpace space = run->model->space;
  uint64_t sum = 0;

  PetscFunctionBeginUser;
  if (out->ordered) PetscFunctionReturn(PETSC_SUCCESS);
  /* the positions of vertices, cells and nodes in a file, whatever the partition */
  PetscCall(SbOrderCreate(out->comm, mesh->Nvert, mesh->nvert_owned, mesh->vert_orig, &out->vertex));
  PetscCall(SbOrderCreate(out->comm, mesh->Ncell, mesh->ncell_owned, mesh->cell_orig, &out->cell));
  if (!space->vertices) {
    PetscCall(SbOrderCreateSparse(out->comm, mesh->Nvert + (space->edge_node ? 14 : 8) * mesh->Ncell,
                                  space->nnode_owned, space->node_orig, &out->node));
  } else {
    PetscCall(SbOrderRepeat(&out->vertex, 1, &out->node));
  }
  PetscCall(SbOrderRepeat(&out->cell, 1, &out->tet));
  if (space->edge_node)
    PetscCall(order_quadratic(run, out));
  else if (out->discontinuous)
    PetscCall(SbOrderRepeat(&out->cell, 4, &out->point));
  else
    PetscCall(SbOrderRepeat(&out->vertex, 1, &out->point));

  /* the mesh in one number: a restart on another mesh is refused */
  for (PetscInt i = 0; i < mesh->nvert_owned; i++)
    for (PetscInt c = 0; c < 3; c++)
      sum += SbMixReal(3 * (uint64_t)mesh->vert_orig[i] + (uint64_t)c, mesh->x[3 * i + c]);
  for (PetscInt k = 0; k < mesh->ncell_owned; k++) {
    for (PetscInt a = 0; a < 4; a++)
      sum += mix(mix((uint64_t)mesh->cell_orig[k]) ^ (uint64_t)mesh->vert_orig[mesh->cell[4 * k + a]]);
    for (PetscInt i = 0; mesh->cell_set[k] & SB_CURVED && i < 18; i++)
      sum += SbMixReal(mix((uint64_t)mesh->cell_orig[k]) + (uint64_t)i, mesh->edge_off[18 * k + i]);
  }
  PetscCallMPI(MPI_Allreduce(&sum, &out->mesh_hash, 1, MPI_UINT64_T, MPI_SUM, mesh->comm));
  out->ordered = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputCountNodes(SbSpace space, SbOutput out)
{
  PetscMPIInt n;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(space->mesh->nbody, &out->body_nodes));
  for (PetscInt i = 0; i < space->nnode_owned; i++) out->body_nodes[space->node_body[i]]++;
  PetscCall(PetscMPIIntCast(space->mesh->nbody, &n));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, out->body_nodes, n, MPIU_INT, MPI_SUM, out->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOutputForgetMesh(SbOutput out)
{
  PetscFunctionBeginUser;
  PetscCall(SbOrderDestroy(&out->vertex));
  PetscCall(SbOrderDestroy(&out->cell));
  PetscCall(SbOrderDestroy(&out->node));
  PetscCall(SbOrderDestroy(&out->point));
  PetscCall(SbOrderDestroy(&out->tet));
  out->ordered = PETSC_FALSE;
  PetscCall(PetscFree(out->split));
  PetscCall(PetscFree(out->edge_number));
  PetscCall(PetscFree(out->place));
  PetscCall(PetscFree(out->sigma));
  PetscCall(PetscFree(out->J));
  PetscCall(PetscFree(out->psi));
  PetscCall(PetscFree(out->pressure));
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

    if (in_memory) step = PetscMax(step, in_memory->step);
  }
  return step;
}

const char *SbOutputMeshName(PetscInt step, char name[SB_MESH_NAME])
{
  SbFormat(SB_MESH_NAME, name, step ? "mesh_%06" PetscInt_FMT : "mesh", step);
  return name;
}
