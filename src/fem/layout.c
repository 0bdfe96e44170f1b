/*
  The nodes of a space, their owners, and the four nodes of each cell.

  P1 has its nodes at the vertices: when every body is P1, nodes are the mesh's vertices, and its
  arrays are borrowed. P2 also has nodes at the edges; one of the cells around an edge decides the
  owner, and all ranks with a cell there make the same choice. CR has one node per face, DG four per
  cell, on its faces; node a of a cell lies opposite vertex a. A rank owns all nodes of its DG cells
  and, of the CR faces between it and another rank, about every second one.

  A boundary face of a DG cell that an effect prescribes in all directions has an additional node,
  the support node, which the effect prescribes. It acts as a rigid neighbour: the mean of the two
  sides is the support's displacement, and the face terms (jump.c) connect the cell to it. The
  cell's force on it is the reaction.

  Owned nodes are numbered in the order of the cells. Each rank numbers its own nodes; two
  broadcasts over the cells distribute the numbers: the first gives a cell the numbers owned by the
  rank of its neighbour, the second sends complete cells to the ghosts, including faces whose other
  side is not on this rank.
*/
#include "fem_impl.h"
#include "sbtet.h"

#define UNKNOWN (-1)
#define OWN (-2) /* this rank numbers it */

/* The face of cell `other` that it shares with `cell`. */
static inline PetscInt face_towards(SbSpace s, PetscInt other, PetscInt cell)
{
  PetscInt f = 0;

  while (f < 3 && s->neighbour[4 * other + f] != cell)
    f++;
  return f;
}

/* Slots of a cell: node a and its support (2 a, 2 a + 1), a = 0..3, then the nodes at the edges, if
   any. */
static PetscInt slots_per_cell(SbSpace s)
{
  return s->edge_node ? 14 : 8;
}

/* The slot in the tables of the space; NULL: it has no such nodes. */
static PetscInt *table_entry(SbSpace s, PetscInt cell, PetscInt slot)
{
  if (slot >= 8)
    return s->edge_node ? &s->edge_node[6 * cell + slot - 8] : NULL;
  if (slot % 2 == 0)
    return &s->cell_node[4 * cell + slot / 2];
  return s->dirichlet_node ? &s->dirichlet_node[4 * cell + slot / 2] : NULL;
}

/* What has the node of each slot: vertex, face, support or edge, counted through; UNKNOWN: there is
   none. A support is that of a face in one of the `prescribed` sets. */
static PetscErrorCode find_items(SbSpace s, uint64_t prescribed, PetscInt item[], PetscInt *nitem)
{
  const SbMesh mesh = s->mesh;
  const PetscInt nface = 4 * mesh->ncell;
  const PetscInt slots = slots_per_cell(s);
  PetscInt nedge = 0;
  PetscInt *edge = NULL;

  PetscFunctionBeginUser;
  if (s->edge_node)
    PetscCall(SbMeshEdges(mesh, &nedge, &edge));
  for (PetscInt i = 0; i < slots * mesh->ncell; i++) {
    const PetscInt c = i / slots;
    const PetscInt slot = i % slots;
    const PetscInt face = 4 * c + slot / 2;
    const SbElement e = SbSpaceCellElement(s, c);

    item[i] = UNKNOWN;
    if (slot >= 8) {
      if (e->nodes_per[1])
        item[i] = mesh->nvert + 2 * nface + edge[6 * c + slot - 8];
    } else if (slot % 2) {
      if (e->weak && (mesh->face_set[face] & SB_ON_BOUNDARY) && (mesh->face_set[face] & prescribed))
        item[i] = mesh->nvert + nface + face;
    } else if (e->nodes_per[0]) {
      item[i] = mesh->cell[face];
    } else {
      const PetscInt other = e->nodes_per[2] ? s->neighbour[face] : -1;

      item[i] =
        mesh->nvert + (other >= 0 && other < c ? 4 * other + face_towards(s, other, c) : face);
    }
  }
  *nitem = mesh->nvert + 2 * nface + nedge;
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers the nodes: the owned ones, then the ghosts by global number behind them. */
static PetscErrorCode number_nodes(SbSpace s, uint64_t prescribed)
{
  const SbMesh mesh = s->mesh;
  const PetscInt slots = slots_per_cell(s);
  const PetscInt nslot = slots * mesh->ncell;
  const PetscInt nslot_owned = slots * mesh->ncell_owned;
  PetscInt *item, *number, *first, *last, *at, *ghost;
  PetscInt nitem = 0;
  PetscInt nghost = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(nslot, &item, nslot, &number));
  PetscCall(find_items(s, prescribed, item, &nitem));
  PetscCall(PetscMalloc3(nitem, &first, nitem, &last, nitem, &at));
  for (PetscInt e = 0; e < nitem; e++) {
    first[e] = PETSC_MAX_INT;
    last[e] = -1;
    at[e] = e < mesh->nvert_owned ? OWN : UNKNOWN;
  }

  /* of faces and edges every second one belongs to the rank of its lowest cell, others to that of
     the highest: all ranks agree */
  for (PetscInt i = 0; i < nslot; i++) {
    if (item[i] < mesh->nvert)
      continue;
    first[item[i]] = PetscMin(first[item[i]], mesh->cell_orig[i / slots]);
    last[item[i]] = PetscMax(last[item[i]], mesh->cell_orig[i / slots]);
  }
  for (PetscInt i = 0; i < nslot_owned; i++) {
    const PetscInt e = item[i];
    const PetscInt orig = mesh->cell_orig[i / slots];

    if (e >= mesh->nvert && orig == ((first[e] + last[e]) % 2 ? first[e] : last[e]))
      at[e] = OWN;
  }

  for (PetscInt i = 0; i < nslot_owned; i++)
    if (item[i] != UNKNOWN && at[item[i]] == OWN)
      at[item[i]] = s->nnode_owned++;
  PetscCallMPI(MPI_Scan(&s->nnode_owned, &s->gnode_start, 1, MPIU_INT, MPI_SUM, s->comm));
  PetscCallMPI(MPI_Allreduce(&s->nnode_owned, &s->Nnode, 1, MPIU_INT, MPI_SUM, s->comm));
  s->gnode_start -= s->nnode_owned;
  for (PetscInt e = 0; e < nitem; e++)
    if (at[e] >= 0)
      at[e] += s->gnode_start;

  /* the first broadcast completes owned cells by numbers of other ranks, the second one the
     ghosts */
  for (int round = 0; round < 2; round++) {
    for (PetscInt i = 0; i < nslot_owned; i++) {
      number[i] = item[i] == UNKNOWN ? UNKNOWN : at[item[i]];
      PetscCheck(!round || item[i] == UNKNOWN || number[i] != UNKNOWN, PETSC_COMM_SELF,
                 PETSC_ERR_PLIB, "No rank has numbered node %d of cell %d", (int)(i % slots),
                 (int)(i / slots));
    }
    PetscCall(SbForestBroadcast(mesh->cell_sf, slots, MPIU_INT, number, number));
    for (PetscInt i = 0; i < nslot; i++)
      if (number[i] != UNKNOWN)
        at[item[i]] = number[i];
  }

  /* the ghosts; local numbers in the place of global ones */
  ghost = item;
  for (PetscInt i = 0; i < nslot; i++) {
    const PetscInt own = number[i] - s->gnode_start;

    if (number[i] != UNKNOWN && (own < 0 || own >= s->nnode_owned))
      ghost[nghost++] = number[i];
  }
  PetscCall(PetscSortRemoveDupsInt(&nghost, ghost));
  s->nnode = s->nnode_owned + nghost;
  PetscCall(PetscMalloc1(s->nnode, &s->gnode));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    s->gnode[i] = s->gnode_start + i;
  PetscCall(PetscArraycpy(s->gnode + s->nnode_owned, ghost, nghost));
  for (PetscInt i = 0; i < nslot; i++) {
    PetscInt *node = table_entry(s, i / slots, i % slots);
    PetscInt own = number[i] - s->gnode_start;

    if (!node)
      continue;
    if (number[i] == UNKNOWN) {
      own = UNKNOWN;
    } else if (own < 0 || own >= s->nnode_owned) {
      PetscCall(PetscFindInt(number[i], nghost, ghost, &own));
      own += s->nnode_owned;
    }
    *node = own;
  }
  PetscCall(PetscFree2(item, number));
  PetscCall(PetscFree3(first, last, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position, body and sets of the nodes at edges. A geometric set, or a group without triangles and
   tets, contains an edge if it contains both vertices; other groups contain the edges of their
   triangles and tets, so that no edge through a thin body is in the group of its surface. Owners
   have all cells around their edges, and send the result to the ghosts. */
static PetscErrorCode describe_edges(SbSpace s)
{
  SbMesh mesh = s->mesh;
  uint64_t *cell_set;
  uint64_t by_items = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++)
    by_items |= mesh->face_set[i] | mesh->cell_set[i / 4];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &by_items, 1, MPI_UINT64_T, MPI_BOR, s->comm));
  for (PetscInt k = 0; k < mesh->nset; k++) {
    const SbSetShape shape = mesh->set[k].shape;

    if (shape != SB_SET_GROUP && shape != SB_SET_BODY && shape != SB_SET_BOUNDARY)
      by_items &= ~SB_SET_BIT(k);
  }
  PetscCall(PetscMalloc1(6 * (size_t)mesh->ncell, &cell_set));
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    const PetscInt c = i / 6;
    const PetscInt a = SbTetEdge[i % 6][0];
    const PetscInt b = SbTetEdge[i % 6][1];
    uint64_t items = mesh->cell_set[c];

    if (s->edge_node[i] == UNKNOWN)
      continue;
    for (PetscInt f = 0; f < 4; f++)
      items |= f != a && f != b ? mesh->face_set[4 * c + f] : 0;
    s->node_set[s->edge_node[i]] |=
      (items & by_items) |
      (mesh->vert_set[mesh->cell[4 * c + a]] & mesh->vert_set[mesh->cell[4 * c + b]] & ~by_items);
  }
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++)
    cell_set[i] = s->edge_node[i] == UNKNOWN ? 0 : s->node_set[s->edge_node[i]] & ~SB_ON_BOUNDARY;
  PetscCall(SbForestBroadcast(mesh->cell_sf, 6, MPI_UINT64_T, cell_set, cell_set));
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    const PetscInt node = s->edge_node[i];
    const PetscInt *v = mesh->cell + 4 * (i / 6);

    if (node == UNKNOWN)
      continue;
    s->node_body[node] = mesh->cell_body[i / 6];
    s->node_set[node] = cell_set[i];
    s->node_orig[node] = PetscMin(s->node_orig[node], mesh->Nvert + 8 * mesh->Ncell +
                                                        6 * mesh->cell_orig[i / 6] + i % 6);
    for (int k = 0; k < 3; k++)
      s->node_x[3 * node + k] =
        0.5 * (mesh->x[3 * v[SbTetEdge[i % 6][0]] + k] + mesh->x[3 * v[SbTetEdge[i % 6][1]] + k]) +
        (mesh->edge_off ? mesh->edge_off[3 * i + k] : 0.);
  }
  PetscCall(PetscFree(cell_set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position, body and sets of every node. */
static PetscErrorCode describe_nodes(SbSpace s)
{
  SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc4(3 * (size_t)s->nnode, &s->node_x, s->nnode, &s->node_body, s->nnode,
                         &s->node_set, s->nnode, &s->node_orig));
  for (PetscInt i = 0; i < s->nnode; i++)
    s->node_orig[i] = PETSC_MAX_INT;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt *v = mesh->cell + 4 * (i / 4);
    const PetscInt node = s->cell_node[i];
    const PetscInt face = i % 4;
    PetscReal *x = s->node_x + 3 * node;

    s->node_body[node] = mesh->cell_body[i / 4];
    if (SbSpaceCellElement(s, i / 4)->nodes_per[0]) {
      s->node_set[node] = mesh->vert_set[v[face]];
      s->node_orig[node] = mesh->vert_orig[v[face]];
      for (int k = 0; k < 3; k++)
        x[k] = mesh->x[3 * v[face] + k];
    } else {
      const PetscInt a = v[(face + 1) % 4];
      const PetscInt b = v[(face + 2) % 4];
      const PetscInt c = v[(face + 3) % 4];
      const uint64_t own = mesh->face_set[i];
      const uint64_t common = mesh->vert_set[a] & mesh->vert_set[b] & mesh->vert_set[c];

      /* on the boundary the sets of the face; inside those of the triangle or its three vertices */
      s->node_set[node] = own & SB_ON_BOUNDARY ? own & ~SB_ON_BOUNDARY : own | common;
      s->node_orig[node] =
        PetscMin(s->node_orig[node], mesh->Nvert + 4 * mesh->cell_orig[i / 4] + face);
      for (int k = 0; k < 3; k++)
        x[k] = (mesh->x[3 * a + k] + mesh->x[3 * b + k] + mesh->x[3 * c + k]) / 3.;
    }
  }
  if (s->edge_node)
    PetscCall(describe_edges(s));

  /* a support node has position and sets of the face's node: effects that prescribe the face act on
     it */
  for (PetscInt i = 0; s->dirichlet_node && i < 4 * mesh->ncell; i++) {
    const PetscInt own = s->cell_node[i];
    const PetscInt node = s->dirichlet_node[i];

    if (node == UNKNOWN)
      continue;
    s->node_body[node] = s->node_body[own];
    s->node_set[node] = s->node_set[own];
    s->node_set[own] = 0;
    s->node_orig[node] = mesh->Nvert + 4 * (mesh->Ncell + mesh->cell_orig[i / 4]) + i % 4;
    for (int k = 0; k < 3; k++)
      s->node_x[3 * node + k] = s->node_x[3 * own + k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLayoutNodes(SbSpace s)
{
  const SbMesh mesh = s->mesh;
  PetscBool quadratic = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    if (!s->element[b]->nodes_per[0])
      s->faces = PETSC_TRUE;
    if (s->element[b]->nodes_per[1])
      quadratic = PETSC_TRUE;
  }
  s->vertices = (PetscBool)(!s->faces && !quadratic);
  if (s->vertices) {
    s->Nnode = mesh->Nvert;
    s->nnode_owned = mesh->nvert_owned;
    s->nnode = mesh->nvert;
    s->gnode_start = mesh->gvert_start;
    s->gnode = mesh->gvert;
    s->cell_node = mesh->cell;
    s->node_x = mesh->x;
    s->node_body = mesh->vert_body;
    s->node_set = mesh->vert_set;
    s->node_orig = mesh->vert_orig;
  } else {
    uint64_t prescribed = 0; /* sets that an effect prescribes; none if no body has support nodes */

    for (PetscInt k = 0; k < mesh->nset * mesh->nbody; k++)
      if (s->element[k % mesh->nbody]->weak && mesh->set[k / mesh->nbody].prescribed)
        prescribed |= SB_SET_BIT(k / mesh->nbody);
    if (s->faces) {
      SbFaces faces;

      PetscCall(SbFacesCreate(mesh->nvert, mesh->ncell, mesh->cell, &faces));
      s->neighbour = faces.neighbour;
      faces.neighbour = NULL;
      PetscCall(SbFacesDestroy(&faces));
    }
    PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell, &s->cell_node));
    if (quadratic)
      PetscCall(PetscMalloc1(6 * (size_t)mesh->ncell, &s->edge_node));
    if (prescribed)
      PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell, &s->dirichlet_node));
    PetscCall(number_nodes(s, prescribed));
    PetscCall(describe_nodes(s));
  }
  PetscCall(PetscCalloc1(s->nnode, &s->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLayoutDestroy(SbSpace s)
{
  PetscFunctionBeginUser;
  if (!s->vertices)
    PetscCall(PetscFree(s->cell_node));
  if (!s->vertices || s->own_nodes) {
    PetscCall(PetscFree(s->gnode));
    PetscCall(PetscFree4(s->node_x, s->node_body, s->node_set, s->node_orig));
  }
  PetscCall(PetscFree(s->edge_node));
  PetscCall(PetscFree(s->neighbour));
  PetscCall(PetscFree(s->dirichlet_node));
  PetscCall(PetscFree(s->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of the batches, for DG with those opposite across the faces, and the weights of both sides.
   The mean of the two sides of a face is weighted by (2 mu + lambda) / |T|: then the constant in
   the bound of the lifting does not depend on the volumes and moduli on the two sides
   (docs/reference/theory.md). */
PetscErrorCode SbLayoutCliques(SbSpace s)
{
  PetscReal *stiffness = NULL;
  PetscBool broken = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < s->mesh->nbody; b++)
    if (s->element[b]->nodes_per[3])
      broken = PETSC_TRUE;
  s->width = s->edge_node ? SB_CELL_NODES : broken ? 8 : 4;
  PetscCall(PetscMalloc1(s->nbatch * s->width * SB_BATCH, &s->batch_clique));
  if (broken)
    PetscCall(PetscMalloc1(s->nbatch * 4, &s->batch_weight));
  if (broken)
    PetscCall(PetscMalloc1(s->mesh->ncell, &stiffness));
  for (PetscInt b = 0; broken && b < s->nbatch; b++)
    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      stiffness[s->batch_cell[b] + l] =
        SbMaterialWaveModulus(s->batch_region[b]->material) / s->batch_V[b][l];
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];

    for (PetscInt k = 0; k < s->width * SB_BATCH; k++) {
      const PetscInt a = k / SB_BATCH;
      const PetscInt l = k % SB_BATCH;
      const PetscInt cell = s->batch_cell[b] + (l < s->batch_n[b] ? l : 0);
      const PetscInt face = 4 * cell + a % 4;
      PetscInt *node = &s->batch_clique[s->width * SB_BATCH * b + k];

      *node = region->quadratic && a >= 4 ? s->edge_node[6 * cell + a - 4] : s->cell_node[face];
      if (broken && a < 4)
        s->batch_weight[4 * b + a][l] = 1.;
      if (!region->broken || a / 4 != 1)
        continue;

      /* the node opposite across the face, and the weight of the cell's own node in the mean */
      if (s->neighbour[face] >= 0) {
        const PetscInt other = s->neighbour[face];

        *node = s->cell_node[4 * other + face_towards(s, other, cell)];
        s->batch_weight[4 * b + a - 4][l] = stiffness[cell] / (stiffness[cell] + stiffness[other]);
      } else if (s->dirichlet_node && s->dirichlet_node[face] != UNKNOWN) {
        *node = s->dirichlet_node[face];
        s->batch_weight[4 * b + a - 4][l] = 0.;
      }
    }
  }
  PetscCall(PetscFree(stiffness));
  PetscFunctionReturn(PETSC_SUCCESS);
}
