/*
  The nodes of a space, their owners, and the nodes of each cell: a PetscSection on the mesh's
  DMPLEX.

  P1 has its nodes at the vertices: when every body is P1, nodes are the mesh's vertices, and its
  arrays are borrowed. P2 also has nodes at the edges. CR has one node per face, DG four per cell,
  on its faces; node a of a cell lies opposite vertex a. A rigid body has four nodes, at the first
  of its cells, which all of them share (rigid.c).

  A boundary face of a DG cell that an effect prescribes in all directions has an additional node,
  the support node, which the effect prescribes. It acts as a rigid neighbour: the mean of the two
  sides is the support's displacement, and the face terms (jump.c) connect the cell to it. The
  cell's force on it is the reaction. It is at the face, behind the face's own node, if any.

  The section has three unknowns per node, at the points of the plex: vertices, edges, faces, cells.
  Its points are in the order in which the cells meet them, which keeps the nodes of a cell close
  to each other; the point star forest says whose they are. Owned nodes follow from the global
  section; copies get local numbers behind them, by global number.
*/
#include <petscdmplex.h>
#include "fem_impl.h"

#define UNKNOWN (-1)
/* Where the node of a slot of a cell is: its point, and its number among the nodes of the point. */
typedef struct {
  PetscInt point, nth;
} Place;

/* The face of cell `other` that it shares with `cell`. */
static inline PetscInt face_towards(SbSpace s, PetscInt other, PetscInt cell)
{
  PetscInt f = 0;

  while (f < 3 && s->mesh->neighbour[4 * other + f] != cell)
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

/* The place of a slot, point UNKNOWN if the cell has no such node. A support is that of a face in
   one of the `prescribed` sets. */
static Place place_of(SbSpace s, uint64_t prescribed, PetscInt c, PetscInt slot)
{
  const SbMesh mesh = s->mesh;
  const SbElement e = SbSpaceCellElement(s, c);
  const PetscInt face = 4 * c + slot / 2;
  const Place none = {UNKNOWN, 0};

  // rigid bodies
  if (e->rigid)
    return slot < 8 && slot % 2 == 0 ? (Place){s->rigid_first[mesh->cell_body[c]], slot / 2} : none;

  // edges
  if (slot >= 8)
    return e->nodes_per[1] ? (Place){mesh->edge_point[6 * c + slot - 8], 0} : none;

  // supports
  if (slot % 2) {
    const PetscBool supported = (PetscBool)(e->weak && (mesh->face_set[face] & SB_ON_BOUNDARY) &&
                                            (mesh->face_set[face] & prescribed));

    return supported ? (Place){mesh->face_point[face], e->nodes_per[2] ? 1 : 0} : none;
  }

  // vertices, faces, cells
  if (e->nodes_per[0])
    return (Place){mesh->ncell + mesh->cell[face], 0};
  if (e->nodes_per[2])
    return (Place){mesh->face_point[face], 0};
  return (Place){c, slot / 2};
}

/* A section with three unknowns, "displacement", per node: count[pEnd - pStart]. perm: NULL, or the
   points in the order of their unknowns; taken over. */
static PetscErrorCode create_section(MPI_Comm comm, PetscInt pStart, PetscInt pEnd,
                                     const PetscInt count[], PetscInt perm[], PetscSection *section)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSectionCreate(comm, section));
  PetscCall(PetscSectionSetNumFields(*section, 1));
  PetscCall(PetscSectionSetFieldName(*section, 0, ""));
  PetscCall(PetscSectionSetFieldComponents(*section, 0, 3));
  PetscCall(PetscSectionSetChart(*section, pStart, pEnd));
  for (PetscInt p = pStart; p < pEnd; p++) {
    const PetscInt n = 3 * (count ? count[p - pStart] : 1);

    if (!n)
      continue;
    PetscCall(PetscSectionSetDof(*section, p, n));
    PetscCall(PetscSectionSetFieldDof(*section, p, 0, n));
  }
  if (perm) {
    IS order;

    PetscCall(ISCreateGeneral(PETSC_COMM_SELF, pEnd - pStart, perm, PETSC_OWN_POINTER, &order));
    PetscCall(PetscSectionSetPermutation(*section, order));
    PetscCall(ISDestroy(&order));
  }
  PetscCall(PetscSectionSetUp(*section));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM of the space: that of the mesh with a section. Takes the section over. */
static PetscErrorCode create_dm(SbSpace s, PetscSection section)
{
  PetscFunctionBeginUser;
  PetscCall(DMClone(s->mesh->dm, &s->dm));
  PetscCall(DMSetLocalSection(s->dm, section));
  PetscCall(PetscSectionDestroy(&section));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers the nodes: the owned ones, then the ghosts by global number behind them. */
static PetscErrorCode number_nodes(SbSpace s, uint64_t prescribed)
{
  const SbMesh mesh = s->mesh;
  const PetscInt slots = slots_per_cell(s);
  const PetscInt nslot = slots * mesh->ncell;
  PetscInt *count, *perm, *number, *ghost;
  PetscInt npoint;
  PetscInt nmet = 0;
  PetscInt nghost = 0;
  PetscInt size;
  PetscSection section, global;

  PetscFunctionBeginUser;

  // points in the order of the cells, with the number of their nodes; then those without nodes
  PetscCall(DMPlexGetChart(mesh->dm, NULL, &npoint));
  PetscCall(PetscCalloc1(npoint, &count));
  PetscCall(PetscMalloc1(npoint, &perm));
  for (PetscInt i = 0; i < nslot; i++) {
    const Place at = place_of(s, prescribed, i / slots, i % slots);

    if (at.point == UNKNOWN)
      continue;
    if (!count[at.point])
      perm[nmet++] = at.point;
    count[at.point] = PetscMax(count[at.point], at.nth + 1);
  }
  for (PetscInt p = 0; p < npoint; p++)
    if (!count[p])
      perm[nmet++] = p;
  PetscCall(create_section(s->comm, 0, npoint, count, perm, &section));
  PetscCall(PetscFree(count));
  PetscCall(create_dm(s, section));
  PetscCall(DMGetGlobalSection(s->dm, &global));
  PetscCall(PetscSectionGetConstrainedStorageSize(global, &size));
  s->nnode_owned = size / 3;
  PetscCallMPI(MPI_Scan(&s->nnode_owned, &s->gnode_start, 1, MPIU_INT, MPI_SUM, s->comm));
  PetscCallMPI(MPI_Allreduce(&s->nnode_owned, &s->Nnode, 1, MPIU_INT, MPI_SUM, s->comm));
  s->gnode_start -= s->nnode_owned;

  // global number of each slot; those of other ranks are the ghosts
  PetscCall(PetscMalloc2(nslot, &number, nslot, &ghost));
  for (PetscInt i = 0; i < nslot; i++) {
    const Place at = place_of(s, prescribed, i / slots, i % slots);
    PetscInt offset;

    number[i] = UNKNOWN;
    if (at.point == UNKNOWN)
      continue;
    PetscCall(PetscSectionGetOffset(global, at.point, &offset));
    number[i] = (offset < 0 ? -(offset + 1) : offset) / 3 + at.nth;
    if (offset < 0)
      ghost[nghost++] = number[i];
  }
  PetscCall(PetscSortRemoveDupsInt(&nghost, ghost));
  s->nnode = s->nnode_owned + nghost;
  PetscCall(PetscMalloc1(s->nnode, &s->gnode));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    s->gnode[i] = s->gnode_start + i;
  PetscCall(PetscArraycpy(s->gnode + s->nnode_owned, ghost, nghost));

  // local numbers into the tables of the cells
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
  PetscCall(PetscFree2(number, ghost));
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

    if (SbSpaceCellElement(s, i / 4)->rigid)
      continue;
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
  PetscCall(SbRigidDescribe(s));
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
  PetscSection section;

  PetscFunctionBeginUser;
  PetscCall(SbRigidCreate(s));
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    if (SbElementHasFaces(s->element[b]))
      s->faces = PETSC_TRUE;
    if (s->element[b]->nodes_per[1])
      quadratic = PETSC_TRUE;
  }
  s->vertices = (PetscBool)(!s->faces && !quadratic && !s->rigid);
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
    PetscCall(
      create_section(s->comm, mesh->ncell, mesh->ncell + mesh->nvert, NULL, NULL, &section));
    PetscCall(create_dm(s, section));
  } else {
    uint64_t prescribed = 0; /* sets that an effect prescribes; none if no body has support nodes */

    for (PetscInt k = 0; k < mesh->nset * mesh->nbody; k++)
      if (s->element[k % mesh->nbody]->weak && mesh->set[k / mesh->nbody].prescribed)
        prescribed |= SB_SET_BIT(k / mesh->nbody);

    // one entry more: a table without entries, on a rank without cells, is not a missing one
    PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell + 1, &s->cell_node));
    if (quadratic)
      PetscCall(PetscMalloc1(6 * (size_t)mesh->ncell + 1, &s->edge_node));
    if (prescribed)
      PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell + 1, &s->dirichlet_node));
    PetscCall(number_nodes(s, prescribed));
    PetscCall(describe_nodes(s));
  }
  PetscCall(PetscCalloc1(s->nnode, &s->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLayoutDestroy(SbSpace s)
{
  PetscFunctionBeginUser;
  PetscCall(SbRigidDestroy(s));
  PetscCall(DMDestroy(&s->dm));
  if (!s->vertices)
    PetscCall(PetscFree(s->cell_node));
  if (!s->vertices || s->own_nodes) {
    PetscCall(PetscFree(s->gnode));
    PetscCall(PetscFree4(s->node_x, s->node_body, s->node_set, s->node_orig));
  }
  PetscCall(PetscFree(s->edge_node));
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
      if (s->mesh->neighbour[face] >= 0) {
        const PetscInt other = s->mesh->neighbour[face];

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
