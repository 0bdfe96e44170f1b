/*
  Values at output points for all elements: for vertex fields and probes.

  P1 has the values at vertices as its unknowns. Of CR and DG the value at vertex v of a cell is
  sum_a vertex[v][a] u_a (SbElementOps), another one in each cell around the vertex: a vertex field
  holds their mean, weighted with the volumes of the cells and summed by the cells' original
  numbers, so that it does not depend on the partition. With -output_discontinuous nothing is
  averaged.

  A nodal force of CR or DG acts at the centroid of a face. One third of it goes to each vertex of
  the face, which keeps its resultant and its moment. Where a node belongs to several cells and
  these have points of their own, each has an equal part. What a DG cell does to the support of a
  face is a force of that face, too. P2 has points at its nodes, with the values there.

  The vertices of a rigid body move with its four nodes. Of a force on it the resultant is known:
  each corner of each of its cells has the same part of it.
*/
#include "output_impl.h"

PetscErrorCode SbPointsPrepare(SbRun run, SbOutput out, PetscBool forces)
{
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;
  SbPoints *p = &out->points;
  PetscInt *key;
  PetscReal *count;

  PetscFunctionBeginUser;
  if (!s->vertices && !p->start) {
    // the cells around each owned vertex: all of them are local
    PetscCall(SbBucketByKey(4 * mesh->ncell, mesh->cell, mesh->nvert_owned, &p->start, &p->corner));
    PetscCall(PetscMalloc1(p->start[mesh->nvert_owned], &key));
    for (PetscInt i = 0; i < p->start[mesh->nvert_owned]; i++)
      key[i] = mesh->cell_orig[p->corner[i] / 4];
    for (PetscInt v = 0; v < mesh->nvert_owned; v++)
      PetscCall(PetscSortIntWithArray(p->start[v + 1] - p->start[v], key + p->start[v],
                                      p->corner + p->start[v]));
    PetscCall(PetscFree(key));

    /* weights of the means over cells */
    PetscCall(PetscMalloc1(mesh->ncell, &p->V));
    for (PetscInt b = 0; b < s->nbatch; b++)
      PetscCall(PetscArraycpy(p->V + s->batch_cell[b], s->batch_V[b], s->batch_n[b]));
  }
  if (!forces || p->valence)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* cells of each node: a rank has all those of its own nodes; ghosts get the number from their
     owners */
  PetscCall(PetscCalloc1(3 * s->nnode, &count));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++)
    count[3 * s->cell_node[i]] += 1.;
  for (PetscInt i = 0; s->edge_node && i < 6 * mesh->ncell; i++)
    if (s->edge_node[i] >= 0)
      count[3 * s->edge_node[i]] += 1.;
  PetscCall(SbSpaceUpdateGhosts(s, count));
  PetscCall(PetscMalloc1(s->nnode, &p->valence));
  for (PetscInt i = 0; i < s->nnode; i++)
    p->valence[i] = count[3 * i];
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SbPlace SbPointsPlace(SbRun run, SbOutput out, PetscInt i)
{
  const SbMesh mesh = run->model->mesh;
  const PetscInt place = out->place ? out->place[i] : i;
  const PetscInt cell = place / SB_CELL_NODES;
  const PetscInt a = place % SB_CELL_NODES;

  if (!out->discontinuous)
    return i < mesh->nvert_owned ? (SbPlace){i, -1, -1} : (SbPlace){-1, place, -1};
  return a < 4 ? (SbPlace){mesh->cell[4 * cell + a], -1, 4 * cell + a}
               : (SbPlace){-1, SbSpaceCellNode(run->model->space, cell, a), -1};
}

const PetscReal *SbPointsRest(SbRun run, SbOutput out, PetscInt i)
{
  const SbPlace p = SbPointsPlace(run, out, i);

  return p.node < 0 ? run->model->mesh->x + 3 * p.vertex : run->model->space->node_x + 3 * p.node;
}

/* The cell's value of x at its corner; corner = 4 cell + a. */
static void corner_value(SbSpace s, PetscInt corner, const PetscReal x[], PetscReal value[3])
{
  const SbElement e = SbSpaceCellElement(s, corner / 4);
  const PetscInt *node = s->cell_node + 4 * (corner / 4);
  const PetscReal *basis = SbSpaceCornerBasis(s, corner / 4, corner % 4);

  for (int k = 0; k < 3; k++) {
    if (e->nodes_per[0]) {
      value[k] = x[3 * node[corner % 4] + k];
      continue;
    }
    value[k] = 0.;
    for (int a = 0; a < 4; a++)
      value[k] += basis[a] * x[3 * node[a] + k];
  }
}

/* The node at an owned vertex, or -1 where the body has its nodes at faces. */
static PetscInt vertex_node(SbSpace s, const SbPoints *p, PetscInt vertex)
{
  PetscInt corner;

  if (s->vertices)
    return vertex;
  corner = p->corner[p->start[vertex]];
  return SbSpaceCellElement(s, corner / 4)->nodes_per[0] ? s->cell_node[corner] : -1;
}

void SbPointsVertex(SbRun run, SbOutput out, PetscInt vertex, const PetscReal x[],
                    PetscReal value[3])
{
  const SbSpace s = run->model->space;
  const SbPoints *p = &out->points;
  const PetscInt node = vertex_node(s, p, vertex);
  PetscReal V = 0.;

  for (int k = 0; k < 3; k++)
    value[k] = node < 0 ? 0. : x[3 * node + k];
  if (node >= 0)
    return;
  for (PetscInt i = p->start[vertex]; i < p->start[vertex + 1]; i++) {
    PetscReal there[3];

    corner_value(s, p->corner[i], x, there);
    for (int k = 0; k < 3; k++)
      value[k] += p->V[p->corner[i] / 4] * there[k];
    V += p->V[p->corner[i] / 4];
  }
  for (int k = 0; k < 3; k++)
    value[k] /= V;
}

PetscErrorCode SbPointsValues(SbRun run, SbOutput out, Vec x, PetscReal values[])
{
  const SbSpace s = run->model->space;
  const PetscReal *array;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, x, &array));
  for (PetscInt i = 0; i < out->point.nowned; i++) {
    const SbPlace p = SbPointsPlace(run, out, i);

    if (p.node >= 0)
      PetscCall(PetscArraycpy(values + 3 * i, array + 3 * p.node, 3));
    else if (p.corner >= 0)
      corner_value(s, p.corner, array, values + 3 * i);
    else
      SbPointsVertex(run, out, p.vertex, array, values + 3 * i);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, x, &array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value += factor times the force at a node */
static void add_force(const PetscReal r[], PetscInt node, PetscReal factor, PetscReal value[3])
{
  for (int k = 0; k < 3; k++)
    value[k] += factor * r[3 * node + k];
}

/* Adds a cell's share of the forces r at its nodes to one of its corners. */
static void add_corner_force(SbSpace s, const PetscReal r[], const PetscReal valence[],
                             PetscInt corner, PetscReal value[3])
{
  const PetscInt *node = s->cell_node + 4 * (corner / 4);

  if (SbSpaceCellElement(s, corner / 4)->nodes_per[0]) {
    add_force(r, node[corner % 4], 1. / valence[node[corner % 4]], value);
    return;
  }

  // a rigid body: each corner has the same part of the resultant
  for (int a = 0; a < 4 && SbSpaceCellElement(s, corner / 4)->rigid; a++)
    add_force(r, node[a], 1. / (4. * valence[node[a]]), value);
  if (SbSpaceCellElement(s, corner / 4)->rigid)
    return;

  // node a lies opposite vertex a: this corner belongs to the faces of the others
  for (int a = 0; a < 4; a++) {
    const PetscInt support = s->dirichlet_node ? s->dirichlet_node[corner - corner % 4 + a] : -1;

    if (a == corner % 4)
      continue;
    add_force(r, node[a], 1. / (3. * valence[node[a]]), value);
    if (support >= 0)
      add_force(r, support, 1. / 3., value);
  }
}

PetscErrorCode SbPointsForces(SbRun run, SbOutput out, PetscBool prescribed, Vec R,
                              PetscReal values[])
{
  const SbSpace s = run->model->space;
  const SbPoints *p = &out->points;
  const PetscReal *all;
  PetscReal *r;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(values, 3 * out->point.nowned));
  PetscCall(PetscMalloc1(3 * s->nnode, &r));
  PetscCall(SbSpaceGetLocalRead(s, R, &all));
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    r[i] = !prescribed || s->fixed[i / 3] & (1 << i % 3) ? all[i] : 0.;
  PetscCall(SbSpaceRestoreLocalRead(s, R, &all));
  for (PetscInt i = 0; i < out->point.nowned; i++) {
    const SbPlace at = SbPointsPlace(run, out, i);
    PetscInt node;

    if (at.corner >= 0) {
      add_corner_force(s, r, p->valence, at.corner, values + 3 * i);
      continue;
    }
    node = at.vertex < 0 ? at.node : vertex_node(s, p, at.vertex);
    if (node >= 0)
      add_force(r, node, out->discontinuous ? 1. / p->valence[node] : 1., values + 3 * i);
    else
      for (PetscInt k = p->start[at.vertex]; k < p->start[at.vertex + 1]; k++)
        add_corner_force(s, r, p->valence, p->corner[k], values + 3 * i);
  }
  PetscCall(PetscFree(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPointsStress(SbRun run, SbOutput out, PetscReal sigma[])
{
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;
  PetscReal *V, here[6];
  PetscInt *point; /* [nnode] of own nodes at edges, -1: of others */

  PetscFunctionBeginUser;
  if (out->discontinuous) {
    for (PetscInt i = 0; i < out->point.nowned; i++)
      SbNodalStressAt(out->nodal, out->place[i] / SB_CELL_NODES,
                      (int)(out->place[i] % SB_CELL_NODES), sigma + 6 * i);
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // means over the cells around, which are all local
  PetscCall(PetscMalloc2(out->point.nowned, &V, s->nnode, &point));
  PetscCall(PetscArrayzero(V, out->point.nowned));
  PetscCall(PetscArrayzero(sigma, 6 * out->point.nowned));
  for (PetscInt i = 0; i < s->nnode; i++)
    point[i] = -1;
  for (PetscInt i = mesh->nvert_owned; i < out->point.nowned; i++)
    point[out->place[i]] = i;
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscReal volume = SbTetDeterminant(mesh->x, mesh->cell + 4 * c);

    for (int a = 0; a < SB_CELL_NODES; a++) {
      PetscInt i = -1;

      if (a < 4 && mesh->cell[4 * c + a] < mesh->nvert_owned)
        i = mesh->cell[4 * c + a];
      else if (a >= 4 && s->edge_node && s->edge_node[6 * c + a - 4] >= 0)
        i = point[s->edge_node[6 * c + a - 4]];
      if (i < 0)
        continue;
      SbNodalStressAt(out->nodal, c, a, here);
      V[i] += volume;
      for (int k = 0; k < 6; k++)
        sigma[6 * i + k] += volume * here[k];
    }
  }
  for (PetscInt i = 0; i < 6 * out->point.nowned; i++)
    sigma[i] /= V[i / 6];
  PetscCall(PetscFree2(V, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}
