/*
  coupling.c - groups of nodes that effects couple, which need not share a cell: springs, ties,
  joints, cables.

  A rank that owns a node of a group needs all of them: those that no cell of its brings become
  ghosts, behind the others, so that nothing of the cells is numbered anew. Forces on owned nodes
  and rows of the matrix are then complete without communication, as for cells. The plan (plan.c)
  adds the groups to its graph and stores the positions of their blocks.
*/
#include "fem_impl.h"

PetscErrorCode SbSpaceCouple(SbSpace s, PetscInt n, const PetscInt gnode[], PetscInt *number)
{
  SbCouplings *c = &s->couplings;
  PetscBool mine = PETSC_FALSE;

  PetscFunctionBeginUser;
  *number = -1;
  PetscCheck(!s->plan, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "Couplings are declared before the assembly plan is made");
  for (PetscInt k = 0; k < n; k++) {
    PetscCheck(gnode[k] >= 0 && gnode[k] < s->Nnode, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "A coupling names node %" PetscInt_FMT ", and there are nodes 0 to %" PetscInt_FMT,
               gnode[k], s->Nnode - 1);
    mine = (PetscBool)(mine ||
                       (gnode[k] >= s->gnode_start && gnode[k] < s->gnode_start + s->nnode_owned));
  }
  if (!mine)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(c->n + 2, sizeof(*c->start), &c->nstart, &c->start));
  if (c->n == 0)
    c->start[0] = 0;
  PetscCall(SbReserve(c->start[c->n] + n, sizeof(*c->node), &c->nnode, &c->node));
  PetscCall(PetscArraycpy(c->node + c->start[c->n], gnode, n));
  c->start[c->n + 1] = c->start[c->n] + n;
  *number = c->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The local number of a global node, -1: not known here. */
static PetscErrorCode find_local(SbSpace s, PetscInt gnode, PetscInt *node)
{
  const PetscInt first[2] = {s->nnode_owned, s->nnode_cell};
  const PetscInt last[2] = {s->nnode_cell, s->nnode};

  PetscFunctionBeginUser;
  *node = gnode - s->gnode_start;
  if (*node >= 0 && *node < s->nnode_owned)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 2; k++) {
    PetscCall(PetscFindInt(gnode, last[k] - first[k], s->gnode + first[k], node));
    if (*node >= 0) {
      *node += first[k];
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  *node = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values of the new ghosts from their owners, three numbers per node at a time. */
static PetscErrorCode describe_ghosts(SbSpace s)
{
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * (size_t)s->nnode, &x));
  PetscCall(PetscArraycpy(x, s->node_x, 3 * s->nnode_owned));
  PetscCall(SbSpaceUpdateGhosts(s, x));
  PetscCall(PetscArraycpy(s->node_x + 3 * s->nnode_cell, x + 3 * s->nnode_cell,
                          3 * (s->nnode - s->nnode_cell)));

  /* body, number and mass */
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    x[3 * i] = (PetscReal)s->node_body[i];
    x[3 * i + 1] = (PetscReal)s->node_orig[i];
    x[3 * i + 2] = s->node_mass[i];
  }
  PetscCall(SbSpaceUpdateGhosts(s, x));
  for (PetscInt i = s->nnode_cell; i < s->nnode; i++) {
    s->node_body[i] = (PetscInt)x[3 * i];
    s->node_orig[i] = (PetscInt)x[3 * i + 1];
    s->node_mass[i] = x[3 * i + 2];
  }

  /* sets, 22 bits in each number, which a real holds exactly */
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    x[i] = (PetscReal)(s->node_set[i / 3] >> (22 * (i % 3)) & 0x3fffff);
  PetscCall(SbSpaceUpdateGhosts(s, x));
  for (PetscInt i = s->nnode_cell; i < s->nnode; i++) {
    s->node_set[i] = 0;
    for (int k = 0; k < 3; k++)
      s->node_set[i] |= (uint64_t)x[3 * i + k] << (22 * k);
  }

  /* of P2: the integral of the density */
  if (s->node_share != s->node_mass) {
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      x[3 * i] = s->node_share[i];
    PetscCall(SbSpaceUpdateGhosts(s, x));
    for (PetscInt i = s->nnode_cell; i < s->nnode; i++)
      s->node_share[i] = x[3 * i];
  }
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends n ghosts with these global numbers, ascending, to all arrays over nodes. */
static PetscErrorCode append_ghosts(SbSpace s, PetscInt n, const PetscInt ghost[])
{
  const PetscInt old = s->nnode;
  const PetscInt nbody = s->mesh->nbody;
  struct _p_SbSpace before = *s;

  PetscFunctionBeginUser;
  s->nnode += n;
  PetscCall(PetscMalloc1(s->nnode, &s->gnode));
  PetscCall(PetscCalloc4(3 * (size_t)s->nnode, &s->node_x, s->nnode, &s->node_body, s->nnode,
                         &s->node_set, s->nnode, &s->node_orig));
  PetscCall(PetscCalloc1(s->nnode, &s->fixed));
  PetscCall(PetscCalloc3(s->nnode, &s->node_mass, nbody, &s->alpha, nbody, &s->beta));
  PetscCall(PetscArraycpy(s->gnode, before.gnode, old));
  PetscCall(PetscArraycpy(s->gnode + old, ghost, n));
  PetscCall(PetscArraycpy(s->node_x, before.node_x, 3 * old));
  PetscCall(PetscArraycpy(s->node_body, before.node_body, old));
  PetscCall(PetscArraycpy(s->node_set, before.node_set, old));
  PetscCall(PetscArraycpy(s->node_orig, before.node_orig, old));
  PetscCall(PetscArraycpy(s->fixed, before.fixed, old));
  PetscCall(PetscArraycpy(s->node_mass, before.node_mass, old));
  PetscCall(PetscArraycpy(s->alpha, before.alpha, nbody));
  PetscCall(PetscArraycpy(s->beta, before.beta, nbody));
  s->node_share = s->node_mass;
  if (before.node_share != before.node_mass) {
    PetscCall(PetscCalloc1(s->nnode, &s->node_share));
    PetscCall(PetscArraycpy(s->node_share, before.node_share, old));
    PetscCall(PetscFree(before.node_share));
  }

  /* the old ones, unless they are the mesh's */
  if (!s->vertices) {
    PetscCall(PetscFree(before.gnode));
    PetscCall(PetscFree4(before.node_x, before.node_body, before.node_set, before.node_orig));
  }
  PetscCall(PetscFree(before.fixed));
  PetscCall(PetscFree3(before.node_mass, before.alpha, before.beta));

  PetscCall(VecDestroy(&s->template_vec));
  PetscCall(VecCreateGhostBlock(s->comm, 3, 3 * s->nnode_owned, PETSC_DECIDE,
                                s->nnode - s->nnode_owned, s->gnode + s->nnode_owned,
                                &s->template_vec));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceCoupleDone(SbSpace s)
{
  SbCouplings *c = &s->couplings;
  const PetscInt total = c->n ? c->start[c->n] : 0;
  PetscInt n = 0;
  PetscInt most[2];
  PetscInt *ghost;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(total, &ghost));
  for (PetscInt k = 0; k < total; k++) {
    PetscInt node;

    PetscCall(find_local(s, c->node[k], &node));
    if (node < 0)
      ghost[n++] = c->node[k];
  }
  PetscCall(PetscSortRemoveDupsInt(&n, ghost));
  most[0] = n;
  most[1] = c->n;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_INT, MPI_MAX, s->comm));
  if (most[1])
    s->coupled = PETSC_TRUE;
  if (most[0]) {
    PetscCall(append_ghosts(s, n, ghost));
    s->own_nodes = PETSC_TRUE;
    PetscCall(describe_ghosts(s));
  }
  PetscCall(PetscFree(ghost));

  /* local numbers from here on */
  for (PetscInt k = 0; k < total; k++)
    PetscCall(find_local(s, c->node[k], &c->node[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAddCoupling(SbSpace s, Mat A, PetscInt number, const PetscReal K[])
{
  const SbCouplings *c = &s->couplings;
  const PetscInt n = c->start[number + 1] - c->start[number];
  const PetscInt *node = c->node + c->start[number];
  const PetscInt *position = s->plan->coupling + s->plan->coupling_start[number];
  SbMatBlocks x;

  PetscFunctionBeginUser;
  PetscCall(SbMatGetBlocks(A, PETSC_TRUE, &x));
  for (PetscInt k = 0; k < n * n; k++) {
    const PetscInt a = k / n;
    const PetscInt b = k % n;
    PetscReal block[9];

    for (PetscInt e = 0; e < 9; e++)
      block[e] = K[3 * n * (3 * a + e / 3) + 3 * b + e % 3];
    sb_insert_block(s, &x, node[a], node[b], position[k], s->block_scale, PETSC_FALSE, block);
  }
  PetscCall(SbMatRestoreBlocks(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
