/*
  number.c - own local numbering of what DMPlex brought to this rank.

  Vertices: owned ones first, in reverse Cuthill-McKee order, then ghosts by global number. The owned ones of all ranks,
  one rank after the other, are the global numbers. Cells: owned ones first, then ghosts; both sorted by body and inclusion, then by
  lowest local vertex, so that a loop over cells walks through the vertices.

  Overlap 1 brings every cell that touches a cell of this rank. Where all nodes are vertices, a ghost cell that touches no
  owned vertex adds to no row of this rank and is left out here, with its vertices; the DM keeps it.
*/
#include <petscdmplex.h>
#include "mesh_impl.h"

/* The local part of the DM and the way to the own numbers. */
typedef struct {
  const SbPoint *point; /* [npoint] data of each point */
  PetscInt cStart, cEnd, vStart, vEnd, npoint;
  PetscInt ncell, nvert; /* in the DM */
  PetscSF sf;            /* points that others own; NULL on one rank */
  PetscBool *ghost;      /* [npoint] */
  PetscInt *cone;        /* [ncell][4] DM vertices from 0 on */
  PetscInt *global;      /* [npoint] global number of a vertex */
  PetscInt *local;       /* [nvert] own number of a DM vertex, -1: not needed */
  PetscBool *kept;       /* [ncell] */
} Work;

static PetscErrorCode work_create(DM dm, const SbPoint point[], Work *w)
{
  PetscMPIInt size;
  const PetscInt *leaf;
  PetscInt nleaf;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(w, sizeof(*w)));
  w->point = point;
  PetscCall(DMPlexGetHeightStratum(dm, 0, &w->cStart, &w->cEnd));
  PetscCall(DMPlexGetDepthStratum(dm, 0, &w->vStart, &w->vEnd));
  PetscCall(DMPlexGetChart(dm, NULL, &w->npoint));
  w->ncell = w->cEnd - w->cStart;
  w->nvert = w->vEnd - w->vStart;
  PetscCall(PetscCalloc5(w->npoint, &w->ghost, 4 * w->ncell, &w->cone, w->npoint, &w->global, w->nvert,
                         &w->local, w->ncell, &w->kept));
  for (PetscInt c = 0; c < w->ncell; c++) {
    const PetscInt *cone;

    PetscCall(DMPlexGetCone(dm, w->cStart + c, &cone));
    for (int a = 0; a < 4; a++) w->cone[4 * c + a] = cone[a] - w->vStart;
  }
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)dm), &size));
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DMGetPointSF(dm, &w->sf));
  PetscCall(PetscSFGetGraph(w->sf, NULL, &nleaf, &leaf, NULL));
  for (PetscInt i = 0; i < nleaf; i++) w->ghost[leaf ? leaf[i] : i] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode work_destroy(Work *w)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree5(w->ghost, w->cone, w->global, w->local, w->kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ vertices */

/* Own numbers of owned vertices. */
static PetscErrorCode number_owned(Work *w, SbMesh mesh)
{
  PetscInt *compact, *back, *cell, *order, n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(w->nvert, &compact, w->nvert, &back, 4 * w->ncell, &cell, w->nvert, &order));
  for (PetscInt v = 0; v < w->nvert; v++) {
    compact[v] = -1;
    if (w->ghost[w->vStart + v]) continue;
    back[n] = v;
    compact[v] = n++;
  }
  for (PetscInt i = 0; i < 4 * w->ncell; i++) cell[i] = compact[w->cone[i]];
  PetscCall(SbOrderRCM(n, w->ncell, cell, order));
  for (PetscInt v = 0; v < w->nvert; v++) w->local[v] = -1;
  for (PetscInt i = 0; i < n; i++) w->local[back[order[i]]] = i;
  PetscCall(PetscFree4(compact, back, cell, order));
  mesh->nvert_owned = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Global numbers of all local vertices. */
static PetscErrorCode number_globally(Work *w, SbMesh mesh)
{
  PetscInt mine[2] = {mesh->nvert_owned, 0}, sum[2] = {0, 0};

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < w->ncell; c++) mine[1] += !w->ghost[w->cStart + c];
  mesh->ncell_owned = mine[1];
  PetscCallMPI(MPI_Scan(mine, sum, 1, MPIU_INT, MPI_SUM, mesh->comm));
  mesh->gvert_start = sum[0] - mine[0];
  PetscCallMPI(MPI_Allreduce(mine, sum, 2, MPIU_INT, MPI_SUM, mesh->comm));
  mesh->Nvert = sum[0];
  mesh->Ncell = sum[1];
  for (PetscInt v = 0; v < w->nvert; v++) w->global[w->vStart + v] = mesh->gvert_start + w->local[v];
  if (w->sf) {
    PetscCall(PetscSFBcastBegin(w->sf, MPIU_INT, w->global, w->global, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(w->sf, MPIU_INT, w->global, w->global, MPI_REPLACE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps cells that are owned or touch an owned vertex, all with face nodes; ghost vertices of these get own numbers. */
static PetscErrorCode number_ghosts(Work *w, SbMesh mesh)
{
  PetscInt *ghost, *key, n = 0;
  PetscBool all = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) all = (PetscBool)(all || mesh->body[b].face_nodes);
  mesh->ncell = 0;
  PetscCall(PetscMalloc2(w->nvert, &ghost, w->nvert, &key));
  for (PetscInt c = 0; c < w->ncell; c++) {
    const PetscInt *v = w->cone + 4 * c;

    w->kept[c] = (PetscBool)(all || !w->ghost[w->cStart + c]);
    for (int a = 0; a < 4; a++) w->kept[c] = (PetscBool)(w->kept[c] || !w->ghost[w->vStart + v[a]]);
    mesh->ncell += w->kept[c];
    for (int a = 0; w->kept[c] && a < 4; a++) {
      if (w->local[v[a]] != -1) continue;
      w->local[v[a]] = -2; /* needed, number to come */
      key[n] = w->global[w->vStart + v[a]];
      ghost[n++] = v[a];
    }
  }
  PetscCall(PetscSortIntWithArray(n, key, ghost));
  for (PetscInt i = 0; i < n; i++) w->local[ghost[i]] = mesh->nvert_owned + i;
  PetscCall(PetscFree2(ghost, key));
  mesh->nvert = mesh->nvert_owned + n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fill_vertices(const Work *w, SbMesh mesh)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(mesh->nvert, &mesh->gvert));
  PetscCall(PetscMalloc1(mesh->nvert, &mesh->vert_orig));
  PetscCall(PetscMalloc1(mesh->nvert, &mesh->vert_body));
  PetscCall(PetscMalloc1(mesh->nvert, &mesh->vert_set));
  PetscCall(PetscMalloc1(3 * (size_t)mesh->nvert, &mesh->x));
  for (PetscInt v = 0; v < w->nvert; v++) {
    const SbPoint *p = &w->point[w->vStart + v];
    const PetscInt l = w->local[v];

    if (l < 0) continue;
    mesh->gvert[l] = w->global[w->vStart + v];
    mesh->vert_orig[l] = p->orig;
    mesh->vert_body[l] = p->body;
    mesh->vert_set[l] = p->set;
    for (int i = 0; i < 3; i++) mesh->x[3 * l + i] = p->u.x[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ cells */

/* Stable counting sort of the entries of `from` by key[entry] in [0, nkey). */
static PetscErrorCode sort_by_key(PetscInt n, const PetscInt from[], PetscInt nkey, const PetscInt key[],
                                  PetscInt to[])
{
  PetscInt *next;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(nkey + 1, &next));
  for (PetscInt i = 0; i < n; i++) next[key[from[i]] + 1]++;
  for (PetscInt k = 0; k < nkey; k++) next[k + 1] += next[k];
  for (PetscInt i = 0; i < n; i++) to[next[key[from[i]]]++] = from[i];
  PetscCall(PetscFree(next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inclusion of its body that a cell belongs to: 0 for the bulk, else one more than its place in the list. */
static PetscInt inclusion_of(SbMesh mesh, const SbPoint *cell)
{
  const SbBody *body = &mesh->body[cell->body];

  for (PetscInt k = 0; k < body->ninclusion; k++) {
    if (cell->set & SB_SET_BIT(body->inclusion[k].set)) return k + 1;
  }
  return 0;
}

/* The kept DM cells in the order of their own numbers. */
static PetscErrorCode order_cells(const Work *w, SbMesh mesh, PetscInt order[])
{
  PetscInt *key, *some, n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(w->ncell, &key, mesh->ncell, &some));
  for (PetscInt c = 0; c < w->ncell; c++) {
    const PetscInt *v = w->cone + 4 * c;

    if (!w->kept[c]) continue;
    key[c] = PetscMin(PetscMin(w->local[v[0]], w->local[v[1]]), PetscMin(w->local[v[2]], w->local[v[3]]));
    order[n++] = c;
  }
  PetscCall(sort_by_key(n, order, mesh->nvert, key, some));
  for (PetscInt c = 0; c < w->ncell; c++) {
    const SbPoint *p = &w->point[w->cStart + c];

    key[c] = (SB_INCLUSION_MAX + 1) * (p->body + (w->ghost[w->cStart + c] ? mesh->nbody : 0)) +
             inclusion_of(mesh, p);
  }
  PetscCall(sort_by_key(n, some, 2 * (SB_INCLUSION_MAX + 1) * mesh->nbody, key, order));
  PetscCall(PetscFree2(key, some));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fill_cells(const Work *w, SbMesh mesh)
{
  PetscInt *order;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(mesh->ncell, &order));
  PetscCall(order_cells(w, mesh, order));
  PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell, &mesh->cell));
  PetscCall(PetscMalloc1(mesh->ncell, &mesh->cell_orig));
  PetscCall(PetscMalloc2(mesh->ncell, &mesh->cell_body, mesh->ncell, &mesh->cell_material));
  PetscCall(PetscMalloc1(mesh->ncell, &mesh->cell_point));
  PetscCall(PetscMalloc1(mesh->ncell, &mesh->cell_set));
  PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell, &mesh->face_set));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const SbPoint *p = &w->point[w->cStart + order[c]];
    const PetscInt inclusion = inclusion_of(mesh, p);

    mesh->cell_point[c] = w->cStart + order[c];
    mesh->cell_orig[c] = p->orig;
    mesh->cell_body[c] = p->body;
    mesh->cell_material[c] = inclusion ? mesh->body[p->body].inclusion[inclusion - 1].material : p->body;
    mesh->cell_set[c] = p->set;
    for (int a = 0; a < 4; a++) {
      mesh->cell[4 * c + a] = w->local[w->cone[4 * order[c] + a]];
      mesh->face_set[4 * c + a] = p->u.face[a];
    }
  }
  PetscCall(PetscFree(order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshNumber(SbMesh mesh, const SbPoint point[])
{
  Work w;

  PetscFunctionBeginUser;
  PetscCall(work_create(mesh->dm, point, &w));
  PetscCall(number_owned(&w, mesh));
  PetscCall(number_globally(&w, mesh));
  PetscCall(number_ghosts(&w, mesh));
  PetscCall(fill_vertices(&w, mesh));
  PetscCall(fill_cells(&w, mesh));
  PetscCall(work_destroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}
