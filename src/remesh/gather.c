/*
  Gathers a scene and its state on rank 0, scatters vectors back, hands history variables over.

  A star forest connects the cells of each rank (leaves) with their positions on rank 0 (roots), by
  their original numbers. Each cell is sent with its vertices, its sets, and the values of the
  vectors at its nodes: the same for every element; a node of several cells is sent with each of
  them.

  History variables of effects (active contact, friction) go to the new model like a checkpoint with
  renumbered nodes. Records of effects that do not say so (SbEffect.by_node) name no nodes.
*/
#include "remesh_impl.h"

/* Vectors of a run: U, then V, A if it has them; returns their number. */
static PetscInt vectors_of(SbRun run, Vec vec[3])
{
  PetscInt n = 0;

  vec[n++] = run->state.U;
  if (run->state.V)
    vec[n++] = run->state.V;
  if (run->state.A)
    vec[n++] = run->state.A;
  return n;
}

static PetscInt node_at(SbSpace s, PetscInt cell, PetscInt k)
{
  if (k < 4)
    return s->cell_node[4 * cell + k];
  if (k < SB_EDGES)
    return s->dirichlet_node ? s->dirichlet_node[4 * cell + k - 4] : -1;
  return s->edge_node[6 * cell + k - SB_EDGES];
}

PetscErrorCode SbGather(SbRun run, SbGathered *g)
{
  const SbModel m = run->model;
  const SbMesh mesh = m->mesh;
  const SbSpace s = m->space;
  PetscMPIInt rank;
  PetscMPIInt supports = s->dirichlet_node ? 1 : 0;
  PetscReal(*centre)[4], *now;
  Vec vec[3];
  PetscSF sf;
  const PetscInt n = mesh->ncell_owned;
  PetscInt *cell, each;
  uint64_t *set;
  const PetscReal *array;
  PetscReal *value;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(g, sizeof(*g)));
  PetscCallMPI(MPI_Comm_rank(m->comm, &rank));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &supports, 1, MPI_INT, MPI_MAX, m->comm));
  g->nbody = m->nbody;
  g->nvert = mesh->Nvert;
  g->ncell = mesh->Ncell;
  g->nfield = vectors_of(run, vec);
  if (s->edge_node)
    g->width = SB_EDGES + 6;
  else
    g->width = supports ? 8 : 4;
  PetscCall(PetscCalloc3(m->nbody + 1, &g->vert0, m->nbody + 1, &g->cell0, m->nbody, &g->mass));
  for (PetscInt b = 0; b < m->nbody; b++) {
    g->vert0[b + 1] = g->vert0[b] + m->body[b].nvert;
    g->cell0[b + 1] = g->cell0[b] + m->body[b].ncell;
  }

  // masses of the bodies
  PetscCall(PetscMalloc1(m->nbody, &centre));
  PetscCall(SbModelCentres(m, NULL, centre));
  for (PetscInt b = 0; b < m->nbody; b++)
    g->mass[b] = centre[b][3];
  PetscCall(PetscFree(centre));

  // vertices and their sets to rank 0
  if (!rank)
    PetscCall(PetscMalloc3(3 * (size_t)g->nvert, &g->X, 3 * (size_t)g->nvert, &g->x, g->nvert,
                           &g->vert_set));
  PetscCall(
    SbForestCreate(mesh->comm, rank ? 0 : mesh->Nvert, mesh->nvert_owned, mesh->vert_orig, &sf));
  PetscCall(PetscMalloc1(3 * (size_t)mesh->nvert, &now));
  PetscCall(SbSpaceVertexPositions(s, run->state.U, now));
  PetscCall(SbForestReduce(sf, 3, MPIU_REAL, mesh->x, g->X));
  PetscCall(SbForestReduce(sf, 3, MPIU_REAL, now, g->x));
  PetscCall(PetscFree(now));
  PetscCall(SbForestReduce(sf, 1, MPI_UINT64_T, mesh->vert_set, g->vert_set));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(
    SbForestCreate(m->comm, rank ? 0 : mesh->Ncell, mesh->ncell_owned, mesh->cell_orig, &sf));

  // cells with their vertices, materials and sets
  if (!rank)
    PetscCall(PetscMalloc3(4 * (size_t)g->ncell, &g->cell, g->ncell, &g->cell_material,
                           5 * (size_t)g->ncell, &g->cell_set));
  PetscCall(PetscMalloc2(4 * (size_t)n, &cell, 5 * (size_t)n, &set));
  for (PetscInt c = 0; c < n; c++) {
    for (int a = 0; a < 4; a++) {
      cell[4 * c + a] = mesh->vert_orig[mesh->cell[4 * c + a]];
      set[5 * c + 1 + a] = mesh->face_set[4 * c + a];
    }
    set[5 * c] = mesh->cell_set[c];
  }
  PetscCall(SbForestReduce(sf, 4, MPIU_INT, cell, g->cell));
  PetscCall(SbForestReduce(sf, 1, MPIU_INT, mesh->cell_material, g->cell_material));
  PetscCall(SbForestReduce(sf, 5, MPI_UINT64_T, set, g->cell_set));
  PetscCall(PetscFree2(cell, set));

  // offsets of the nodes of curved edges
  if (mesh->edge_off) {
    if (!rank)
      PetscCall(PetscMalloc1(18 * (size_t)g->ncell, &g->edge_off));
    PetscCall(SbForestReduce(sf, 18, MPIU_REAL, mesh->edge_off, g->edge_off));
  }

  // the values of the vectors at the nodes of each cell
  each = g->width * g->nfield * 3;
  if (!rank)
    PetscCall(PetscMalloc1((size_t)each * (size_t)g->ncell, &g->value));
  PetscCall(PetscMalloc1((size_t)each * (size_t)n, &value));
  for (PetscInt f = 0; f < g->nfield; f++) {
    PetscCall(SbSpaceGetLocalRead(s, vec[f], &array));
    for (PetscInt i = 0; i < n * g->width; i++) {
      const PetscInt node = node_at(s, i / g->width, i % g->width);

      for (int k = 0; k < 3; k++)
        value[(g->nfield * i + f) * 3 + k] = node < 0 ? PETSC_MAX_REAL : array[3 * node + k];
    }
    PetscCall(SbSpaceRestoreLocalRead(s, vec[f], &array));
  }
  PetscCall(SbForestReduce(sf, each, MPIU_REAL, value, g->value));
  PetscCall(PetscFree(value));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGatheredDestroy(SbGathered *g)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree3(g->vert0, g->cell0, g->mass));
  PetscCall(PetscFree3(g->X, g->x, g->vert_set));
  PetscCall(PetscFree3(g->cell, g->cell_material, g->cell_set));
  PetscCall(PetscFree(g->edge_off));
  PetscCall(PetscFree(g->value));
  PetscCall(PetscMemzero(g, sizeof(*g)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbScatter(const SbGathered *g, SbRun run)
{
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;
  const PetscInt each = g->width * g->nfield * 3;
  PetscReal *value, *array;
  PetscMPIInt rank;
  Vec vec[3];
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  PetscCall(PetscMalloc1((size_t)each * (size_t)mesh->ncell, &value));
  PetscCall(SbForestCreate(mesh->comm, rank ? 0 : mesh->Ncell, mesh->ncell, mesh->cell_orig, &sf));
  PetscCall(SbForestBroadcast(sf, each, MPIU_REAL, g->value, value));
  PetscCall(PetscSFDestroy(&sf));
  (void)vectors_of(run, vec);
  for (PetscInt f = 0; f < g->nfield; f++) {
    PetscCall(SbSpaceGetLocalWrite(s, vec[f], &array));
    for (PetscInt i = 0; i < mesh->ncell * g->width; i++) {
      const PetscInt node = node_at(s, i / g->width, i % g->width);
      const PetscReal *from = value + (g->nfield * i + f) * 3;

      for (int k = 0; k < 3 && node >= 0 && from[0] < PETSC_MAX_REAL; k++)
        array[3 * node + k] = from[k];
    }

    // a new support node has the displacement of its face
    for (PetscInt i = 0; i < 4 * mesh->ncell && s->dirichlet_node; i++) {
      const PetscInt node = s->dirichlet_node[i];
      const PetscInt k = 4 + i % 4;
      const PetscReal *from = value + (g->nfield * (i / 4 * g->width + k) + f) * 3;

      if (node >= 0 && (k >= g->width || from[0] >= PETSC_MAX_REAL))
        PetscCall(PetscArraycpy(array + 3 * node, array + 3 * s->cell_node[i], 3));
    }
    PetscCall(SbSpaceRestoreLocalWrite(s, vec[f], &array));
  }
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectsHandOver(SbRun from, SbRun to, const SbRenamed *renamed)
{
  const SbModel a = from->model;
  const SbModel b = to->model;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(b->space, to->state.U, &u));
  for (PetscInt k = 0; k < a->neffect; k++) {
    SbEffect e = a->effect[k];
    PetscReal *records, *own;
    PetscInt n, nown, total;

    if (!e->ops.save)
      continue;

    // gather the records of all ranks on each rank
    SbEffectCall(e, save, a->space, &nown, &own);
    PetscCall(
      SbAllgatherv(a->space->comm, MPIU_REAL, nown * e->nstate, own, &total, &records, NULL));
    n = e->nstate ? total / e->nstate : 0;
    PetscCall(PetscFree(own));

    // renumber the nodes that they begin with; drop those of removed nodes
    if (e->by_node) {
      total = n;
      n = 0;
      for (PetscInt i = 0; i < total; i++) {
        PetscReal *record = records + e->nstate * i;
        PetscInt place;

        PetscCall(PetscFindInt((PetscInt)record[0], renamed->n, renamed->from, &place));
        if (place < 0)
          continue;
        record[0] = (PetscReal)renamed->to[place];
        PetscCall(PetscArraymove(records + e->nstate * n, record, e->nstate));
        n++;
      }
    }
    SbEffectCall(b->effect[k], load, b->space, from->clock.t, u, n, records);
    PetscCall(PetscFree(records));
  }
  PetscCall(SbSpaceRestoreLocalRead(b->space, to->state.U, &u));
  PetscCall(SbContactSetResume(&b->contacts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHistoryHandOver(SbRun from, SbRun to, const SbRemeshResult *result,
                                 const PetscBool due[])
{
  const SbModel a = from->model;
  const SbModel b = to->model;
  const PetscInt n = PetscMax(a->space->nhistory, b->space->nhistory);
  PetscReal *own, *record, *all[2];
  PetscMPIInt rank;
  PetscSF sf;

  PetscFunctionBeginUser;
  if (!n || (!a->dynamic && !a->space->softening))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(a->comm, &rank));
  PetscCall(
    PetscCalloc2(rank ? 0 : n * a->mesh->Ncell, &all[0], rank ? 0 : n * b->mesh->Ncell, &all[1]));

  // a record of n numbers per cell; of bodies with a new mesh the mean over the points of a cell
  PetscCall(PetscMalloc1(a->space->nhistory * a->mesh->ncell_owned, &own));
  PetscCall(PetscCalloc1(n * a->mesh->ncell_owned, &record));
  PetscCall(SbSpaceGetHistory(a->space, own));
  for (PetscInt c = 0; c < a->mesh->ncell_owned; c++)
    PetscCall(PetscArraycpy(record + n * c, own + a->space->nhistory * c, a->space->nhistory));
  PetscCall(PetscFree(own));
  PetscCall(SbSpaceMeanHistory(a->space, due, PETSC_FALSE, n, record));

  // by original numbers on rank 0, and to the cells of the new mesh
  PetscCall(SbForestCreate(a->comm, rank ? 0 : a->mesh->Ncell, a->mesh->ncell_owned,
                           a->mesh->cell_orig, &sf));
  PetscCall(SbForestReduce(sf, n, MPIU_REAL, record, all[0]));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree(record));
  for (PetscInt c = 0; c < b->mesh->Ncell && !rank; c++)
    PetscCall(PetscArraycpy(all[1] + n * c, all[0] + n * result->from[c], n));

  // to their owners
  PetscCall(PetscMalloc1(n * b->mesh->ncell_owned, &record));
  PetscCall(SbForestCreate(b->comm, rank ? 0 : b->mesh->Ncell, b->mesh->ncell_owned,
                           b->mesh->cell_orig, &sf));
  PetscCall(SbForestBroadcast(sf, n, MPIU_REAL, all[1], record));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(SbSpaceMeanHistory(b->space, due, PETSC_TRUE, n, record));
  PetscCall(PetscMalloc1(b->space->nhistory * b->mesh->ncell_owned, &own));
  for (PetscInt c = 0; c < b->mesh->ncell_owned; c++)
    PetscCall(PetscArraycpy(own + b->space->nhistory * c, record + n * c, b->space->nhistory));
  PetscCall(SbSpaceSetHistory(b->space, own));
  PetscCall(PetscFree(own));
  PetscCall(PetscFree(record));
  PetscCall(PetscFree2(all[0], all[1]));

  // the law at the last step is that of the new mesh, the same bit for bit where that is the old
  // one
  if (b->dynamic) {
    b->space->viscous_began = PETSC_FALSE;
    PetscCall(SbSpaceViscousStart(b->space, to->state.U));
  }

  // where the new mesh stretches more than the old one did, what that loses is lost by re-meshing
  PetscCall(SbSpaceMullinsAdvance(b->space, to->state.U, NULL));
  for (PetscInt k = 0; k < a->nmaterial; k++)
    if (a->material[k]->viscous)
      PetscCall(PetscArraycpy(b->material[k]->viscous->stored, a->material[k]->viscous->stored,
                              SB_PRONY_TERMS));
  PetscFunctionReturn(PETSC_SUCCESS);
}
