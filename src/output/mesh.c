/*
  What of the output belongs to the mesh: original orders, numbers of nodes, and one number that distinguishes it from other meshes. All of it is forgotten and made again
  when a body is re-meshed.

  The mesh's number is a sum of mixed 64-bit words (the finaliser of splitmix64; Steele, Lea and Flood 2014), which does not depend on the order of its entities.
*/
#include "output_impl.h"

static uint64_t mix(uint64_t x)
{
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/* A number at a position. Zero has one sign here. */
uint64_t SbMixReal(uint64_t position, PetscReal value)
{
  uint64_t bits;

  value += 0.;
  memcpy(&bits, &value, sizeof(bits));
  return mix(position ^ mix(bits));
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
  if (out->discontinuous)
    PetscCall(SbOrderRepeat(&out->cell, 4, &out->point));
  else if (out->quadratic)
    PetscCall(SbOrderRepeat(&out->node, 1, &out->point));
  else
    PetscCall(SbOrderRepeat(&out->vertex, 1, &out->point));

  /* the mesh in one number: a restart on another mesh is refused */
  for (PetscInt i = 0; i < mesh->nvert_owned; i++) {
    for (PetscInt c = 0; c < 3; c++)
      sum += SbMixReal(3 * (uint64_t)mesh->vert_orig[i] + (uint64_t)c, mesh->x[3 * i + c]);
  }
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
  if (out->ordered) {
    PetscCall(SbOrderDestroy(&out->vertex));
    PetscCall(SbOrderDestroy(&out->cell));
    PetscCall(SbOrderDestroy(&out->node));
    PetscCall(SbOrderDestroy(&out->point));
  }
  out->ordered = PETSC_FALSE;
  PetscCall(PetscFree(out->sigma));
  PetscCall(PetscFree(out->J));
  PetscCall(PetscFree(out->psi));
  PetscCall(PetscFree(out->pressure));
  PetscCall(PetscFree(out->body_nodes));
  PetscCall(SbPointsDestroy(out));
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
