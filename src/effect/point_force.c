/*
  point_force.c - a total force shared equally by the vertices of the named sets.

  Each of the n vertices, counted once over all ranks, has s(t) F(t) / n. With P1 that is the force on its
  node. With CR and DG the displacement of vertex v is the mean over the cells c around it, weighted by their
  volumes w_c, and the force goes the same way back: node a of cell c has w_c psi_a(v) / sum w of it, psi_a(v)
  being 1 or -2. Since both the mean and the elements reproduce linear functions, total force and moment are
  those of the force on the vertices.

  A force on a single vertex has no limit under mesh refinement (the displacement under it grows like 1/h);
  use a traction where the area matters.
*/
#include "effect_impl.h"

typedef struct {
  SbFormula vector[3];
  PetscInt n, *node; /* [n] owned nodes that have a part */
  PetscReal *share;  /* [nnode] part of the total force, right on owned nodes */
} PointForce;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose vertices share the force equally"},
  {"vector", SB_OPTION_FORMULA, 3, "N", NULL, "", "total force, three formulas of the time t"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "amplitude: factor on the force, a formula of the time t"},
};

static PetscErrorCode options_point_force(SbEffect e, const SbScope *scope)
{
  PointForce *p = (PointForce *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(scope, "vector", 3, PETSC_FALSE, p->vector, &e->steady));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_point_force(SbEffect e, SbSpace space)
{
  PointForce *p = (PointForce *)e->data;
  PetscInt n, total = 0, *vertices;
  const SbMesh mesh = space->mesh;
  PetscReal *volume; /* of the cells around each selected vertex, m^3 */
  PetscReal share;   /* of the total force that a vertex has */
  PetscBool *chosen;

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(space, &e->on, SB_ON_VERTICES, &n, &vertices));
  while (total < n && vertices[total] < mesh->nvert_owned) total++;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, space->comm));
  share = 1. / (PetscReal)total;
  /* the volume around each vertex first, then what its cells pass on to their nodes */
  PetscCall(PetscCalloc1(space->nnode, &p->share));
  PetscCall(PetscCalloc2(mesh->nvert, &volume, mesh->nvert, &chosen));
  for (PetscInt i = 0; i < n; i++) chosen[vertices[i]] = PETSC_TRUE;
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < 4 * SB_BATCH * space->nbatch; i++) {
      const PetscInt b = i / (4 * SB_BATCH), l = i % SB_BATCH, cell = space->batch_cell[b] + l;
      const int k = (int)(i / SB_BATCH % 4);
      const PetscInt v = l < space->batch_n[b] ? mesh->cell[4 * cell + k] : -1;

      if (v < 0 || !chosen[v]) continue;
      if (pass) {
        const SbElement element = SbSpaceCellElement(space, cell);

        /* a P1 or P2 node at the vertex is the vertex: the parts of its cells add up to one */
        if (element->nodes_per[0]) p->share[space->cell_node[4 * cell + k]] = share;
        for (int a = 0; a < 4 && !element->nodes_per[0]; a++)
          p->share[space->cell_node[4 * cell + a]] +=
            share * space->batch_V[b][l] / volume[v] * element->ops.vertex[k][a];
      } else
        volume[v] += space->batch_V[b][l];
    }
  }
  PetscCall(PetscFree2(volume, chosen));
  PetscCall(PetscFree(vertices));

  /* a force on few nodes costs little in a large mesh */
  for (PetscInt i = 0; i < space->nnode_owned; i++) p->n += p->share[i] != 0;
  PetscCall(PetscMalloc1(p->n, &p->node));
  for (PetscInt i = space->nnode_owned - 1, k = p->n; i >= 0; i--)
    if (p->share[i] != 0) p->node[--k] = i;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_point_force(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const PointForce *p = (const PointForce *)e->data;
  const PetscReal s = SbFormulaEval(e->time, stage->t, NULL);
  PetscReal F[3];

  PetscFunctionBeginUser;
  for (int c = 0; c < 3; c++) F[c] = s * SbFormulaEval(p->vector[c], stage->t, NULL);
  (void)space;
  for (PetscInt i = 0; i < p->n; i++)
    for (int c = 0; c < 3; c++) f[3 * p->node[i] + c] += p->share[p->node[i]] * F[c];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_point_force(SbEffect e)
{
  PointForce *p = (PointForce *)e->data;

  PetscFunctionBeginUser;
  for (int c = 0; c < 3; c++) PetscCall(SbFormulaDestroy(&p->vector[c]));
  PetscCall(PetscFree(p->node));
  PetscCall(PetscFree(p->share));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectPointForce = {
  .name = "point_force",
  .size = sizeof(PointForce),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_point_force,
          .setup = setup_point_force,
          .force = force_point_force,
          .destroy = destroy_point_force},
};
