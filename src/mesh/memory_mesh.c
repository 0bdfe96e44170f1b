/*
  memory_mesh.c - import of a mesh in memory, which is on rank 0: after re-meshing, or from a
  checkpoint.

  Such a mesh has no groups: members of sets that are groups are stored as bits. Sets that are
  shapes are evaluated again on the new mesh, except the tets of inclusions, which keep their
  material even where a new tet crosses the shape.
*/
#include "mesh_impl.h"

PetscErrorCode SbMemoryMeshCreate(PetscInt nvert, PetscInt ncell, PetscInt ntri, PetscInt nedge,
                                  SbMemoryMesh **in_memory)
{
  SbMemoryMesh *g;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&g));
  *g = (SbMemoryMesh){.nvert = nvert, .ncell = ncell, .ntri = ntri, .nedge = nedge};
  PetscCall(PetscCalloc6(3 * (size_t)nvert, &g->x, 4 * (size_t)ncell, &g->cell, 3 * (size_t)ntri,
                         &g->tri, nvert, &g->vert_set, ntri, &g->tri_set, ncell, &g->cell_set));
  PetscCall(PetscCalloc2(2 * (size_t)nedge, &g->edge, 3 * (size_t)nedge, &g->edge_off));
  *in_memory = g;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMemoryMeshDestroy(SbMemoryMesh **in_memory)
{
  SbMemoryMesh *g = *in_memory;

  PetscFunctionBeginUser;
  if (!g)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree6(g->x, g->cell, g->tri, g->vert_set, g->tri_set, g->cell_set));
  PetscCall(PetscFree2(g->edge, g->edge_off));
  PetscCall(PetscFree(*in_memory));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMemoryMeshShare(MPI_Comm comm, SbMemoryMesh **in_memory)
{
  SbMemoryMesh head = {.nvert = -1};

  PetscFunctionBeginUser;
  if (*in_memory)
    head = **in_memory;
  PetscCallMPI(MPI_Bcast(&head, (int)sizeof(head), MPI_BYTE, 0, comm));
  if (head.nvert < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!*in_memory)
    PetscCall(SbMemoryMeshCreate(0, 0, 0, 0, in_memory));
  (*in_memory)->mass = head.mass;
  (*in_memory)->bound = head.bound;
  (*in_memory)->step = head.step;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportMemoryMesh(const SbBody *body, SbImport *im)
{
  const SbMemoryMesh *g = body->in_memory;
  PetscInt none;

  PetscFunctionBeginUser;
  if (g->step)
    (void)snprintf(im->where, sizeof(im->where), "body '%s', re-meshed after step %lld", body->name,
                   (long long)g->step);
  else
    (void)snprintf(im->where, sizeof(im->where), "body '%s': %s", body->name, body->mesh);
  PetscCall(SbImportTagSet(im, 0, NULL, &none));
  PetscCall(SbImportSetVertices(im, g->nvert));
  PetscCall(PetscArraycpy(im->x, g->x, 3 * (size_t)g->nvert));
  for (PetscInt c = 0; c < g->ncell; c++)
    PetscCall(SbImportAddItem(im, 3, g->cell + 4 * (size_t)c, none, c + 1));
  PetscCall(PetscMalloc1(g->nedge, &im->middle));
  im->nmiddle = (SbCount){g->nedge, g->nedge};
  for (PetscInt i = 0; i < g->nedge; i++) {
    im->middle[i] = (SbMiddle){.end = {g->edge[2 * i], g->edge[2 * i + 1]}, .node = -1};
    PetscCall(PetscArraycpy(im->middle[i].off, g->edge_off + 3 * i, 3));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbMemoryMeshMark(const SbBody *body, const SbFaces *faces, SbMasks *m)
{
  const SbMemoryMesh *g = body->in_memory;
  uint64_t inclusions = 0;
  PetscInt slots[2];

  for (PetscInt k = 0; k < body->ninclusion; k++)
    inclusions |= SB_SET_BIT(body->inclusion[k].set);
  for (PetscInt v = 0; v < g->nvert; v++)
    m->vert[v] |= g->vert_set[v];
  for (PetscInt c = 0; c < g->ncell; c++)
    m->cell[c] = (m->cell[c] & ~inclusions) | g->cell_set[c];
  for (PetscInt t = 0; t < g->ntri; t++) {
    const PetscInt n = SbFacesFind(faces, g->tri + 3 * (size_t)t, slots);

    for (PetscInt k = 0; k < n; k++)
      m->face[slots[k]] |= g->tri_set[t];
  }
}
