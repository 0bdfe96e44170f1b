/*
  The nodes of a space, their owners, and the four nodes of each cell.

  P1 has its nodes at the vertices: when every body is P1, nodes are the mesh's vertices, and its arrays are
  borrowed. P2 also has nodes at the edges; one of the cells around an edge decides the owner, and all ranks
  with a cell there make the same choice. CR has one node per face, DG four per cell, on its faces; node a of
  a cell lies opposite vertex a. A rank owns all nodes of its DG cells and, of the CR faces between it and
  another rank, about every second one.

  A boundary face of a DG cell that an effect prescribes in all directions has an additional node, the support
  node, which the effect prescribes. It acts as a rigid neighbour: the mean of the two sides is the support's
  displacement, and the face terms (jump.c) connect the cell to it. The cell's force on it is the reaction.

  Owned nodes are numbered in the order of the cells. Each rank numbers its own nodes; two broadcasts over the
  cells distribute the numbers: the first gives a cell the numbers owned by the rank of its neighbour, the
  second sends complete cells to the ghosts, including faces whose other side is not on this rank.
*/
#include "fem_impl.h"
#include "sbtet.h"

#define UNKNOWN (-1)

/* The face of cell `other` that it shares with `cell`. */
static inline PetscInt face_towards(SbSpace s, PetscInt other, PetscInt cell)
{
  PetscInt f = 0;

  while (f < 3 && s->neighbour[4 * other + f] != cell) f++;
  return f;
}

/* Edges of the local cells, and numbers of nodes at vertices and edges. */
typedef struct {
  PetscInt n, *edge;     /* number of edges; [ncell][6] edges of each cell */
  PetscBool *own;        /* [n] this rank numbers its node */
  PetscInt *at, *vertex; /* [n], [nvert] number of its node, UNKNOWN: not yet */
} Edges;

/* Finds the edges; every second one belongs to the rank of its lowest cell, others to that of the highest. */
static PetscErrorCode find_edges(SbSpace s, Edges *edges)
{
  SbMesh mesh = s->mesh;
  PetscInt *first, *last;

  PetscFunctionBeginUser;
  if (s->edge_node) PetscCall(SbMeshEdges(mesh, &edges->n, &edges->edge));
  PetscCall(PetscMalloc3(edges->n, &edges->own, edges->n, &edges->at, mesh->nvert, &edges->vertex));
  PetscCall(PetscMalloc2(edges->n, &first, edges->n, &last));
  for (PetscInt v = 0; v < mesh->nvert; v++) edges->vertex[v] = UNKNOWN;
  for (PetscInt e = 0; e < edges->n; e++) {
    edges->at[e] = last[e] = UNKNOWN;
    first[e] = PETSC_MAX_INT;
    edges->own[e] = PETSC_FALSE;
  }
  for (PetscInt i = 0; s->edge_node && i < 6 * mesh->ncell; i++) {
    const PetscInt e = edges->edge[i], orig = mesh->cell_orig[i / 6];

    first[e] = PetscMin(first[e], orig);
    last[e] = PetscMax(last[e], orig);
  }
  for (PetscInt i = 0; s->edge_node && i < 6 * mesh->ncell_owned; i++) {
    const PetscInt e = edges->edge[i];

    if (mesh->cell_orig[i / 6] == ((first[e] + last[e]) % 2 ? first[e] : last[e])) edges->own[e] = PETSC_TRUE;
  }
  PetscCall(PetscFree2(first, last));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of nodes, and how many per cell; those at edges and of supports may be NULL. */
static const PetscInt per_cell[3] = {4, 6, 4};
static PetscInt *numbers(SbSpace s, int table)
{
  return table == 0 ? s->cell_node : table == 1 ? s->edge_node : s->dirichlet_node;
}

/* Numbers the owned nodes from zero, a support node for faces in these sets; UNKNOWN elsewhere. */
static void number_owned(SbSpace s, uint64_t prescribed, Edges *edges)
{
  SbMesh mesh = s->mesh;
  PetscInt *node = s->cell_node, n = 0;

  for (int k = 0; k < 3; k++)
    for (PetscInt i = 0; numbers(s, k) && i < per_cell[k] * mesh->ncell; i++) numbers(s, k)[i] = UNKNOWN;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt *per = SbSpaceCellElement(s, c)->nodes_per;

    for (PetscInt a = 0; a < 4; a++) {
      const PetscInt v = mesh->cell[4 * c + a];

      if (per[3]) {
        const uint64_t sets = mesh->face_set[4 * c + a];

        node[4 * c + a] = n++;
        if (SbSpaceCellElement(s, c)->weak && (sets & SB_ON_BOUNDARY) && (sets & prescribed))
          s->dirichlet_node[4 * c + a] = n++;
      } else if (per[2]) {
        const PetscInt other = s->neighbour[4 * c + a], orig = mesh->cell_orig[c],
                       its = other < mesh->ncell_owned ? 0 : mesh->cell_orig[other];

        /* of the faces between an owned cell and a ghost every second one: both ranks agree */
        if (other >= 0 && other < c)
          node[4 * c + a] = node[4 * other + face_towards(s, other, c)];
        else if (other < mesh->ncell_owned || (orig < its) == ((orig + its) % 2 != 0))
          node[4 * c + a] = n++;
      } else if (v < mesh->nvert_owned) {
        if (edges->vertex[v] == UNKNOWN) edges->vertex[v] = n++;
        node[4 * c + a] = edges->vertex[v];
      }
    }
    for (PetscInt i = 6 * c; per[1] && i < 6 * (c + 1); i++) {
      const PetscInt e = edges->edge[i];

      if (edges->own[e] && edges->at[e] == UNKNOWN) edges->at[e] = n++;
      s->edge_node[i] = edges->at[e];
    }
  }
  s->nnode_owned = n;
}

/* After the first broadcast: owned cells get the numbers that their ghost neighbours have. */
static PetscErrorCode complete_owned(SbSpace s, Edges *edges)
{
  SbMesh mesh = s->mesh;
  PetscInt *node = s->cell_node;

  PetscFunctionBeginUser;
  for (PetscInt i = 4 * mesh->ncell_owned; i < 4 * mesh->ncell; i++)
    if (SbSpaceCellElement(s, i / 4)->nodes_per[0] && node[i] != UNKNOWN)
      edges->vertex[mesh->cell[i]] = node[i];
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++) {
    const PetscInt other = s->neighbour ? s->neighbour[i] : -1;

    if (node[i] != UNKNOWN) continue;
    if (SbSpaceCellElement(s, i / 4)->nodes_per[0])
      node[i] = edges->vertex[mesh->cell[i]];
    else
      node[i] = node[4 * other + face_towards(s, other, i / 4)];
    PetscCheck(node[i] != UNKNOWN, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No rank has numbered node %d of cell %d",
               (int)(i % 4), (int)(i / 4));
  }
  for (PetscInt i = 0; s->edge_node && i < 6 * mesh->ncell; i++)
    if (s->edge_node[i] != UNKNOWN) edges->at[edges->edge[i]] = s->edge_node[i];
  for (PetscInt i = 0; s->edge_node && i < 6 * mesh->ncell_owned; i++) {
    if (!SbSpaceCellElement(s, i / 6)->nodes_per[1]) continue;
    s->edge_node[i] = edges->at[edges->edge[i]];
    PetscCheck(s->edge_node[i] != UNKNOWN, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "No rank has numbered the node at edge %d of cell %d", (int)(i % 6), (int)(i / 6));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the ghosts, by global number behind the owned nodes, and converts global numbers to local ones. */
static PetscErrorCode localise(SbSpace s)
{
  PetscInt *ghost, nghost = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(14 * (size_t)s->mesh->ncell, &ghost));
  for (int k = 0; k < 3; k++) {
    const PetscInt *number = numbers(s, k);

    for (PetscInt i = 0; number && i < per_cell[k] * s->mesh->ncell; i++) {
      const PetscInt own = number[i] - s->gnode_start;

      if (number[i] != UNKNOWN && (own < 0 || own >= s->nnode_owned)) ghost[nghost++] = number[i];
    }
  }
  PetscCall(PetscSortRemoveDupsInt(&nghost, ghost));
  s->nnode = s->nnode_owned + nghost;
  PetscCall(PetscMalloc1(s->nnode, &s->gnode));
  for (PetscInt i = 0; i < s->nnode_owned; i++) s->gnode[i] = s->gnode_start + i;
  PetscCall(PetscArraycpy(s->gnode + s->nnode_owned, ghost, nghost));
  for (int k = 0; k < 3; k++) {
    PetscInt *number = numbers(s, k);

    for (PetscInt i = 0; number && i < per_cell[k] * s->mesh->ncell; i++) {
      const PetscInt own = number[i] - s->gnode_start;
      PetscInt at;

      if (number[i] == UNKNOWN) continue;
      PetscCall(PetscFindInt(number[i], nghost, ghost, &at));
      number[i] = at < 0 ? own : s->nnode_owned + at;
    }
  }
  PetscCall(PetscFree(ghost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position, body and sets of the nodes at edges. A geometric set, or a group without triangles and tets,
   contains an edge if it contains both vertices; other groups contain the edges of their triangles and tets,
   so that no edge through a thin body is in the group of its surface. Owners have all cells around their
   edges, and send the result to the ghosts. */
static PetscErrorCode describe_edges(SbSpace s, const Edges *edges)
{
  SbMesh mesh = s->mesh;
  uint64_t *set, *cell_set, by_items = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) by_items |= mesh->face_set[i] | mesh->cell_set[i / 4];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &by_items, 1, MPI_UINT64_T, MPI_BOR, s->comm));
  for (PetscInt k = 0; k < mesh->nset; k++) {
    const SbSetShape shape = mesh->set[k].shape;

    if (shape != SB_SET_GROUP && shape != SB_SET_BODY && shape != SB_SET_BOUNDARY) by_items &= ~SB_SET_BIT(k);
  }
  PetscCall(PetscCalloc2(edges->n, &set, 6 * (size_t)mesh->ncell, &cell_set));
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    const PetscInt c = i / 6, a = SbTetEdge[i % 6][0], b = SbTetEdge[i % 6][1];
    uint64_t items = mesh->cell_set[c];

    for (PetscInt f = 0; f < 4; f++) items |= f != a && f != b ? mesh->face_set[4 * c + f] : 0;
    set[edges->edge[i]] |= (items & by_items) | (mesh->vert_set[mesh->cell[4 * c + a]] &
                                                 mesh->vert_set[mesh->cell[4 * c + b]] & ~by_items);
  }
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) cell_set[i] = set[edges->edge[i]] & ~SB_ON_BOUNDARY;
  PetscCall(SbForestBroadcast(mesh->cell_sf, 6, MPI_UINT64_T, cell_set, cell_set));
  for (PetscInt i = 0; i < 6 * mesh->ncell; i++) {
    const PetscInt node = s->edge_node[i], *v = mesh->cell + 4 * (i / 6);

    if (node == UNKNOWN) continue;
    s->node_body[node] = mesh->cell_body[i / 6];
    s->node_set[node] = cell_set[i];
    s->node_orig[node] =
      PetscMin(s->node_orig[node], mesh->Nvert + 8 * mesh->Ncell + 6 * mesh->cell_orig[i / 6] + i % 6);
    for (int k = 0; k < 3; k++)
      s->node_x[3 * node + k] =
        0.5 * (mesh->x[3 * v[SbTetEdge[i % 6][0]] + k] + mesh->x[3 * v[SbTetEdge[i % 6][1]] + k]) +
        (mesh->edge_off ? mesh->edge_off[3 * i + k] : 0.);
  }
  PetscCall(PetscFree2(set, cell_set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position, body and sets of every node. */
static PetscErrorCode describe_nodes(SbSpace s, const Edges *edges)
{
  SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(3 * (size_t)s->nnode, &s->node_x, s->nnode, &s->node_body, s->nnode, &s->node_set,
                         s->nnode, &s->node_orig));
  for (PetscInt i = 0; i < s->nnode; i++) s->node_orig[i] = PETSC_MAX_INT;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt *v = mesh->cell + 4 * (i / 4), node = s->cell_node[i], face = i % 4;
    PetscReal *x = s->node_x + 3 * node;

    s->node_body[node] = mesh->cell_body[i / 4];
    if (SbSpaceCellElement(s, i / 4)->nodes_per[0]) {
      s->node_set[node] = mesh->vert_set[v[face]];
      s->node_orig[node] = mesh->vert_orig[v[face]];
      for (int k = 0; k < 3; k++) x[k] = mesh->x[3 * v[face] + k];
    } else {
      const PetscInt a = v[(face + 1) % 4], b = v[(face + 2) % 4], c = v[(face + 3) % 4];
      const uint64_t own = mesh->face_set[i],
                     common = mesh->vert_set[a] & mesh->vert_set[b] & mesh->vert_set[c];

      /* on the boundary the sets of the face; inside those of the triangle or its three vertices */
      s->node_set[node] = own & SB_ON_BOUNDARY ? own & ~SB_ON_BOUNDARY : own | common;
      s->node_orig[node] = PetscMin(s->node_orig[node], mesh->Nvert + 4 * mesh->cell_orig[i / 4] + face);
      for (int k = 0; k < 3; k++) x[k] = (mesh->x[3 * a + k] + mesh->x[3 * b + k] + mesh->x[3 * c + k]) / 3.;
    }
  }
  if (s->edge_node) PetscCall(describe_edges(s, edges));
  /* a support node has position and sets of the face's node: effects that prescribe the face act on it */
  for (PetscInt i = 0; s->dirichlet_node && i < 4 * mesh->ncell; i++) {
    const PetscInt own = s->cell_node[i], node = s->dirichlet_node[i];

    if (node == UNKNOWN) continue;
    s->node_body[node] = s->node_body[own];
    s->node_set[node] = s->node_set[own];
    s->node_set[own] = 0;
    s->node_orig[node] = mesh->Nvert + 4 * (mesh->Ncell + mesh->cell_orig[i / 4]) + i % 4;
    for (int k = 0; k < 3; k++) s->node_x[3 * node + k] = s->node_x[3 * own + k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLayoutNodes(SbSpace s)
{
  const SbMesh mesh = s->mesh;
  PetscBool quadratic = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    if (!s->element[b]->nodes_per[0]) s->faces = PETSC_TRUE;
    if (s->element[b]->nodes_per[1]) quadratic = PETSC_TRUE;
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
    Edges edges = {0};

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
    if (quadratic) PetscCall(PetscMalloc1(6 * (size_t)mesh->ncell, &s->edge_node));
    if (prescribed) PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell, &s->dirichlet_node));
    PetscCall(find_edges(s, &edges));
    number_owned(s, prescribed, &edges);
    PetscCallMPI(MPI_Scan(&s->nnode_owned, &s->gnode_start, 1, MPIU_INT, MPI_SUM, s->comm));
    PetscCallMPI(MPI_Allreduce(&s->nnode_owned, &s->Nnode, 1, MPIU_INT, MPI_SUM, s->comm));
    s->gnode_start -= s->nnode_owned;
    for (int round = 0; round < 2; round++) {
      if (round) PetscCall(complete_owned(s, &edges));
      for (int k = 0; k < 3; k++) {
        PetscInt *number = numbers(s, k);

        for (PetscInt i = 0; !round && number && i < per_cell[k] * mesh->ncell_owned; i++)
          if (number[i] != UNKNOWN) number[i] += s->gnode_start;
        if (number) PetscCall(SbForestBroadcast(mesh->cell_sf, per_cell[k], MPIU_INT, number, number));
      }
    }
    PetscCall(localise(s));
    PetscCall(describe_nodes(s, &edges));
    PetscCall(PetscFree(edges.edge));
    PetscCall(PetscFree3(edges.own, edges.at, edges.vertex));
  }
  PetscCall(PetscCalloc1(s->nnode, &s->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLayoutDestroy(SbSpace s)
{
  PetscFunctionBeginUser;
  if (!s->vertices) {
    PetscCall(PetscFree(s->gnode));
    PetscCall(PetscFree(s->cell_node));
    PetscCall(PetscFree4(s->node_x, s->node_body, s->node_set, s->node_orig));
  }
  PetscCall(PetscFree(s->edge_node));
  PetscCall(PetscFree(s->neighbour));
  PetscCall(PetscFree(s->dirichlet_node));
  PetscCall(PetscFree(s->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opposite nodes across the faces of DG cells, and the weights of both sides. The mean of the two sides of a
   face is weighted by (2 mu + lambda) / |T|: then the constant in the bound of the lifting does not depend on
   the volumes and moduli on the two sides (docs/reference/theory.md). */
PetscErrorCode SbLayoutCliques(SbSpace s)
{
  PetscReal *stiffness;
  PetscBool broken = PETSC_FALSE;

  PetscFunctionBeginUser;
  s->width = s->edge_node ? SB_CELL_NODES : 4;
  s->batch_clique = s->batch_node;
  for (PetscInt b = 0; b < s->mesh->nbody; b++) {
    if (!s->element[b]->nodes_per[3]) continue;
    broken = PETSC_TRUE;
    s->width = PetscMax(8, s->width);
  }
  if (s->width == 4) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(s->nbatch * s->width * SB_BATCH, &s->batch_clique));
  for (PetscInt k = 0; k < s->width * SB_BATCH * s->nbatch; k++) {
    const PetscInt b = k / (s->width * SB_BATCH), a = k / SB_BATCH % s->width, l = k % SB_BATCH,
                   cell = s->batch_cell[b] + (l < s->batch_n[b] ? l : 0);

    s->batch_clique[k] = s->edge_node && a >= 4 && s->edge_node[6 * cell] != UNKNOWN
                           ? s->edge_node[6 * cell + a - 4]
                           : s->cell_node[4 * cell + a % 4];
  }
  if (!broken) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(s->mesh->ncell, &stiffness));
  for (PetscInt b = 0; b < s->nbatch; b++)
    for (PetscInt l = 0, c = s->batch_cell[b]; l < s->batch_n[b]; l++, c++)
      stiffness[c] = SbMaterialWaveModulus(s->material[s->mesh->cell_material[c]]) / s->batch_V[b][l];
  PetscCall(PetscMalloc1(s->nbatch * 4, &s->batch_weight));
  for (PetscInt k = 0; k < 4 * SB_BATCH * s->nbatch; k++) {
    const PetscInt b = k / (4 * SB_BATCH), a = k / SB_BATCH % 4, l = k % SB_BATCH,
                   cell = s->batch_cell[b] + (l < s->batch_n[b] ? l : 0);

    PetscInt *node = &s->batch_clique[(s->width * b + 4 + a) * SB_BATCH + l];
    PetscReal *weight = &s->batch_weight[4 * b + a][l];

    /* the node opposite across face a, and the weight of the cell's own node in the mean */
    *weight = 1.;
    if (!SbSpaceCellElement(s, cell)->nodes_per[3]) continue;
    *node = s->cell_node[4 * cell + a];
    if (s->neighbour[4 * cell + a] >= 0) {
      const PetscInt other = s->neighbour[4 * cell + a];

      *node = s->cell_node[4 * other + face_towards(s, other, cell)];
      *weight = stiffness[cell] / (stiffness[cell] + stiffness[other]);
    } else if (s->dirichlet_node && s->dirichlet_node[4 * cell + a] != UNKNOWN) {
      *node = s->dirichlet_node[4 * cell + a];
      *weight = 0.;
    }
  }
  PetscCall(PetscFree(stiffness));
  PetscFunctionReturn(PETSC_SUCCESS);
}
