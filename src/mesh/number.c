/*
  number.c - local and global numbering of the distributed mesh.

  Vertices: owned ones first, in reverse Cuthill-McKee order, then ghosts by global number. Global
  numbers count the owned vertices of rank 0, then those of rank 1 and so on. Cells: owned ones
  first, then ghosts; each sorted by body, inclusion, curved or straight, and lowest local vertex,
  so that a loop over cells accesses vertices nearly in order.
*/
#include "mesh_impl.h"

/* Inclusion of its body that a cell belongs to: 0 for the bulk, else its position in the list plus
   one. */
static PetscInt inclusion_of(SbMesh mesh, const SbCellData *cell)
{
  const SbBody *body = &mesh->body[cell->body];

  for (PetscInt k = 0; k < body->ninclusion; k++)
    if (cell->set & SB_SET_BIT(body->inclusion[k].set))
      return k + 1;
  return 0;
}

/* Star forest from items of this rank, number[nowned], to copies on others, which follow in the
   arrays. */
static PetscErrorCode create_forest(MPI_Comm comm, PetscInt N, PetscInt nowned, PetscInt n,
                                    const PetscInt number[], PetscSF *sf)
{
  PetscLayout blocks;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (size == 1) { /* no copies, and no need of 0.1 s per million tets to find that out */
    PetscCall(PetscSFCreate(comm, sf));
    PetscCall(PetscSFSetGraph(*sf, nowned, 0, NULL, PETSC_COPY_VALUES, NULL, PETSC_COPY_VALUES));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscLayoutCreateFromSizes(comm, PETSC_DECIDE, N, 1, &blocks));
  PetscCall(PetscSFCreateByMatchingIndices(blocks, nowned, number, NULL, 0, n - nowned,
                                           number + nowned, NULL, nowned, NULL, sf));
  PetscCall(PetscLayoutDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells in their new order; local[]: new numbers of the vertices. */
static PetscErrorCode fill_cells(const SbLocalMesh *p, const PetscInt local[], SbMesh mesh)
{
  PetscInt *order, *key, *some, *at, *start;

  PetscFunctionBeginUser;

  // order of the cells: two bucket sorts, by lowest vertex, then by body, inclusion and curved or
  // straight
  PetscCall(PetscMalloc2(p->ncell, &order, p->ncell, &key));
  for (PetscInt c = 0; c < p->ncell; c++) {
    const PetscInt *v = p->cell + 4 * (size_t)c;

    key[c] = PetscMin(PetscMin(local[v[0]], local[v[1]]), PetscMin(local[v[2]], local[v[3]]));
  }
  PetscCall(SbBucketByKey(p->ncell, key, mesh->nvert, &start, &some));
  PetscCall(PetscFree(start));
  for (PetscInt i = 0; i < p->ncell; i++) {
    const PetscInt c = some[i];

    key[i] =
      2 * ((SB_INCLUSION_MAX + 1) * (p->data[c].body + (c < p->ncell_owned ? 0 : mesh->nbody)) +
           inclusion_of(mesh, &p->data[c])) +
      (p->data[c].set & SB_CURVED ? 1 : 0);
  }
  PetscCall(SbBucketByKey(p->ncell, key, 4 * (SB_INCLUSION_MAX + 1) * mesh->nbody, &start, &at));
  for (PetscInt i = 0; i < p->ncell; i++)
    order[i] = some[at[i]];
  PetscCall(PetscFree(some));
  PetscCall(PetscFree(at));
  PetscCall(PetscFree(start));
  PetscCall(PetscMalloc6(4 * (size_t)mesh->ncell, &mesh->cell, mesh->ncell, &mesh->cell_orig,
                         mesh->ncell, &mesh->cell_body, mesh->ncell, &mesh->cell_material,
                         mesh->ncell, &mesh->cell_set, 4 * (size_t)mesh->ncell, &mesh->face_set));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const SbCellData *data = &p->data[order[c]];
    const PetscInt inclusion = inclusion_of(mesh, data);

    mesh->cell_orig[c] = data->orig;
    mesh->cell_body[c] = data->body;
    mesh->cell_set[c] = data->set;
    mesh->cell_material[c] =
      inclusion ? mesh->body[data->body].inclusion[inclusion - 1].material : data->body;
    for (int a = 0; a < 4; a++) {
      mesh->cell[4 * (size_t)c + a] = local[p->cell[4 * (size_t)order[c] + a]];
      mesh->face_set[4 * (size_t)c + a] = data->face[a];
    }
  }
  PetscCall(PetscFree2(order, key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshNumber(SbMesh mesh, SbLocalMesh *p)
{
  PetscInt *local, *compact, *back, *cell, *order, *ghost, *orig, *global;
  PetscInt n = 0;
  PetscInt mine[2];
  PetscInt sum[2] = {0, 0};
  PetscMPIInt rank;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  PetscCall(PetscMalloc4(p->nvert, &local, p->nvert, &ghost, p->nvert, &orig, p->nvert, &global));

  // local numbers of owned vertices
  PetscCall(PetscMalloc4(p->nvert, &compact, p->nvert, &back, 4 * (size_t)p->ncell, &cell, p->nvert,
                         &order));
  for (PetscInt v = 0; v < p->nvert; v++) {
    compact[v] = -1;
    if (p->owner[v] != rank)
      continue;
    back[n] = v;
    compact[v] = n++;
  }
  for (PetscInt i = 0; i < 4 * p->ncell; i++)
    cell[i] = compact[p->cell[i]];
  PetscCall(SbOrderRCM(n, p->ncell, cell, order));
  for (PetscInt i = 0; i < n; i++)
    local[back[order[i]]] = i;
  PetscCall(PetscFree4(compact, back, cell, order));

  // counts, and global numbers of owned vertices
  mesh->nvert_owned = n;
  mesh->nvert = p->nvert;
  mesh->ncell_owned = p->ncell_owned;
  mesh->ncell = p->ncell;
  mine[0] = n;
  mine[1] = p->ncell_owned;
  PetscCallMPI(MPI_Scan(mine, sum, 1, MPIU_INT, MPI_SUM, mesh->comm));
  mesh->gvert_start = sum[0] - n;
  PetscCallMPI(MPI_Allreduce(mine, sum, 2, MPIU_INT, MPI_SUM, mesh->comm));
  mesh->Nvert = sum[0];
  mesh->Ncell = sum[1];

  // ghost vertices get the global numbers of their original ones, and local numbers in this order
  for (PetscInt v = 0, m = mesh->nvert_owned; v < p->nvert; v++) {
    const PetscInt at = p->owner[v] == rank ? local[v] : m++;

    ghost[at] = v;
    orig[at] = p->vertex[v].orig;
    global[at] = mesh->gvert_start + at;
  }
  PetscCall(create_forest(mesh->comm, mesh->Nvert, n, p->nvert, orig, &sf));
  PetscCall(SbForestBroadcast(sf, 1, MPIU_INT, global, global));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscSortIntWithArray(p->nvert - n, global + n, ghost + n));
  for (PetscInt i = n; i < p->nvert; i++)
    local[ghost[i]] = i;

  // vertex arrays in the new order
  PetscCall(PetscMalloc5(mesh->nvert, &mesh->gvert, mesh->nvert, &mesh->vert_orig, mesh->nvert,
                         &mesh->vert_body, mesh->nvert, &mesh->vert_set, 3 * (size_t)mesh->nvert,
                         &mesh->x));
  for (PetscInt v = 0; v < mesh->nvert; v++) {
    const PetscInt l = local[v];

    mesh->gvert[l] = global[l];
    mesh->vert_orig[l] = p->vertex[v].orig;
    mesh->vert_body[l] = p->vertex[v].body;
    mesh->vert_set[l] = p->vertex[v].set;
    PetscCall(PetscArraycpy(mesh->x + 3 * l, p->vertex[v].x, 3));
  }
  PetscCall(PetscFree(p->vertex));
  PetscCall(fill_cells(p, local, mesh));
  PetscCall(PetscFree4(local, ghost, orig, global));
  PetscCall(SbLocalMeshDestroy(p));
  PetscCall(create_forest(mesh->comm, mesh->Ncell, mesh->ncell_owned, mesh->ncell, mesh->cell_orig,
                          &mesh->cell_sf));
  PetscCall(create_forest(mesh->comm, mesh->Nvert, n, mesh->nvert, mesh->gvert, &mesh->vert_sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}
