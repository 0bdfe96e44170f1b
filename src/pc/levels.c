/*
  A fixed symmetric approximation of A^-1, A the tangent of CR and DG elements without its
  volumetric part: without the bulk stiffness P1 elements do not lock, and serve as a coarse space
  for CR.

  DG: with the mean m and the jump d of the two nodes of a face, u = m + (1 - w) d on one side, the
  cells' energy depends on m only, as the energy of CR does, and d has the stiffness of the face
  terms. Only the penalty of jumps couples m and d, and it is no larger than either stiffness: the
  cycle for CR approximates the inverse for m, a diagonal that for d.

  CR: a backward Gauss-Seidel sweep, a correction by P1, a forward sweep (between ranks: block
  Jacobi). A P1 function has at the centroid of a face the mean of its values at the three vertices;
  its jumps vanish and its strains are the same, so the Galerkin product is the P1 matrix, which is
  assembled by the same kernels. The vertices of a face with a prescribed unknown are prescribed. A
  DG cell that shares only a vertex with this rank's cells may have neighbours unknown here; its
  strain is then that of its own nodes, so that in a strained body the P1 matrix is slightly
  nonsymmetric at interfaces between ranks, which GMRES allows. Springs of effects are added to the
  P1 matrix by the Galerkin product: they may be a body's only support. The P1 matrix is inverted by
  one cycle of algebraic multigrid. With a P2 body: two_level.c. Hiptmair and Xu (2007), Nodal
  auxiliary space preconditioning; Brenner (2003), Poincare-Friedrichs inequalities for piecewise H1
  functions.
*/
#include "pressure.h"
#include "coarse.h"
#include "gauss_seidel.h"

/* Threshold of multigrid's coarsening: zero couplings of P1, of which boxes have many, are ignored.
   Bar of CR, nu 0.49, 53,000 tets: 59 iterations on 1, 2, 3 and 4 ranks; with PETSc's default -1,
   which keeps all, 59, 81, 59 and 79, depending on the partition. */
#define WEAK 0.

/* Prescribes in `to` the components prescribed in `from`: at the same node, or all vertices of the
   face. */
static PetscErrorCode fix_like(SbSpace from, SbSpace to)
{
  PetscReal *mark;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * to->nnode, &mark));
  for (PetscInt i = 0; i < 4 * from->mesh->ncell; i++) {
    const PetscInt *node = to->cell_node + 4 * (i / 4);
    const PetscInt a = i % 4;
    const PetscInt support = from->dirichlet_node ? from->dirichlet_node[i] : -1;
    const uint8_t fixed = from->fixed[support < 0 ? from->cell_node[i] : support];
    const PetscBool face = (PetscBool)(SbSpaceCellElement(to, i / 4)->nodes_per[0] &&
                                       !SbSpaceCellElement(from, i / 4)->nodes_per[0]);

    for (PetscInt c = 0; c < 9 && fixed; c++)
      if (fixed & (1 << (c % 3)))
        mark[3 * node[face ? (a + 1 + c / 3) % 4 : a] + c % 3] = 1.;
  }

  /* owners know all cells of their nodes, and send the marks to the other ranks */
  PetscCall(SbSpaceUpdateGhosts(to, mark));
  for (PetscInt k = 0; k < 3 * to->nnode; k++)
    if (mark[k] > 0.)
      PetscCall(SbSpacePrescribe(to, k / 3, 1 << (k % 3)));
  PetscCall(SbSpacePrescribeDone(to));
  PetscCall(PetscFree(mark));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A level with P1 everywhere, or with CR instead of DG. */
static PetscErrorCode add_level(SbLevels v, PetscBool p1)
{
  const SbMesh mesh = v->at[0]->mesh;
  const PetscInt k = v->n++;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(mesh->nbody, &v->element[k]));
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    const SbElement upper = v->at[0]->element[b];

    PetscCall(SbElementCreate(p1 || upper->nodes_per[0] ? "p1" : "cr", NULL, &v->element[k][b]));
    v->element[k][b]->gamma1 = upper->gamma1;
  }
  PetscCall(SbSpaceCreate(mesh, v->at[0]->material, v->element[k], &v->at[k]));
  PetscCall(fix_like(v->at[0], v->at[k]));
  PetscCall(SbSpaceCreateMatrix(v->at[k], p1 ? SB_MATRIX_AIJ : SB_MATRIX_BAIJ, &v->A[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* DG: the CR node of each DG node, its node on the other side of the face, and the weights of
   both. */
static PetscErrorCode find_means(SbLevels v)
{
  SbSpace s = v->at[0];
  SbSpace m = v->at[1];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(s->nnode, &v->mean, s->nnode, &v->across, s->nnode, &v->weight,
                         s->nnode_owned, &v->jump));
  for (PetscInt i = 0; i < s->nnode; i++) {
    v->across[i] = -1;
    v->weight[i] = 1.;
  }
  for (PetscInt i = 0; i < 4 * s->mesh->ncell; i++) {
    v->mean[s->cell_node[i]] = m->cell_node[i];
    if (s->dirichlet_node && s->dirichlet_node[i] >= 0)
      v->mean[s->dirichlet_node[i]] = m->cell_node[i];
  }
  for (PetscInt k = 0; k < 4 * SB_BATCH * s->nbatch; k++) {
    const PetscInt *node = sb_batch_nodes(s, k / (4 * SB_BATCH)) + k % (4 * SB_BATCH);

    v->weight[node[0]] = s->batch_weight[k / SB_BATCH][k % SB_BATCH];
    if (node[4 * SB_BATCH] != node[0])
      v->across[node[0]] = node[4 * SB_BATCH];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cycle for CR. */
static PetscErrorCode cycle_faces(SbLevels v, Vec r, Vec z)
{
  const PetscInt k = v->n - 2;

  PetscFunctionBeginUser;
  PetscCall(SbGaussSeidelDown(v->A[k], v->inverse, NULL, r, z, v->t[k]));

  /* the residual of the vertices; their correction, interpolated to the faces */
  PetscCall(SbSpaceZeroPrescribed(v->at[k], PETSC_TRUE, v->t[k]));
  PetscCall(MatMultTranspose(v->P, v->t[k], v->r[k + 1]));
  PetscCall(SbSpaceZeroPrescribed(v->at[k + 1], PETSC_TRUE, v->r[k + 1]));
  PetscCall(KSPSolve(v->coarse, v->r[k + 1], v->z[k + 1]));
  PetscCall(MatMult(v->P, v->z[k + 1], v->t[k]));
  PetscCall(SbSpaceZeroPrescribed(v->at[k], PETSC_TRUE, v->t[k]));
  PetscCall(VecAXPY(z, 1., v->t[k]));
  PetscCall(SbGaussSeidelUp(v->A[k], v->inverse, NULL, r, z, v->t[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLevelsApply(SbLevels v, Vec r, Vec z)
{
  const PetscReal *x, *mean;
  const PetscScalar *diagonal;
  PetscScalar *out;
  SbSpace s = v->at[0];

  PetscFunctionBeginUser;
  if (v->multigrid)
    PetscCall(PCApply(v->multigrid, r, z));
  if (v->n == 2)
    PetscCall(cycle_faces(v, r, z));
  if (v->n < 3)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the residual of the means: the sum over the two sides of a face */
  PetscCall(VecCopy(r, v->r[0]));
  PetscCall(SbSpaceGetLocalRead(s, v->r[0], &x));
  PetscCall(VecZeroEntries(v->r[1]));
  PetscCall(VecGetArray(v->r[1], &out));
  for (PetscInt i = 0; i < s->nnode; i++) {
    const PetscInt k = v->mean[i];

    for (PetscInt c = 0; c < 3 && k < v->at[1]->nnode_owned; c++)
      out[3 * k + c] += x[3 * i + c];
  }
  PetscCall(VecRestoreArray(v->r[1], &out));
  PetscCall(SbSpaceZeroPrescribed(v->at[1], PETSC_TRUE, v->r[1]));
  PetscCall(cycle_faces(v, v->r[1], v->z[1]));
  PetscCall(SbSpaceGetLocalRead(v->at[1], v->z[1], &mean));
  PetscCall(VecGetArrayRead(v->t[0], &diagonal));
  PetscCall(VecGetArray(z, &out));

  /* u = m + (1 - w) d; the residual of the jump is (1 - w) r_own - w r_across. */
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt other = v->across[i];
    const PetscReal w = v->weight[i];

    for (PetscInt c = 0; c < 3; c++) {
      const PetscInt k = 3 * i + c;

      if (s->fixed[i] & (1 << c)) {
        out[k] = x[k] / diagonal[k];
        continue;
      }
      out[k] = mean[3 * v->mean[i] + c];
      if (other >= 0)
        out[k] += (1. - w) * v->jump[i] * ((1. - w) * x[k] - w * x[3 * other + c]);
    }
  }
  PetscCall(VecRestoreArray(z, &out));
  PetscCall(VecRestoreArrayRead(v->t[0], &diagonal));
  PetscCall(SbSpaceRestoreLocalRead(v->at[1], v->z[1], &mean));
  PetscCall(SbSpaceRestoreLocalRead(s, v->r[0], &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLevelsShareSprings(SbLevels v)
{
  const SbSpace top = v->at[0];
  PetscBool any = (PetscBool)(v->spring != NULL);
  SbSpace s, p;

  PetscFunctionBeginUser;
  if (v->multigrid)
    PetscFunctionReturn(PETSC_SUCCESS); /* created with the first matrix */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, SB_MPI_BOOL, MPI_LOR, v->at[0]->comm));
  if (!any)
    PetscFunctionReturn(PETSC_SUCCESS);
  s = v->at[v->n - 2];
  p = v->at[v->n - 1];

  /* the springs of all ranks at the nodes of at[n-2], ghosts included, one row of the blocks at a
     time */
  if (!v->shared)
    PetscCall(PetscMalloc1(9 * (size_t)s->nnode, &v->shared));
  PetscCall(PetscArrayzero(v->shared, 9 * (size_t)s->nnode));
  for (PetscInt row = 0; row < 3; row++) {
    const PetscReal *x;
    PetscScalar *own;

    PetscCall(VecGetArray(v->r[0], &own));
    for (PetscInt k = 0; k < 3 * top->nnode_owned; k++)
      own[k] = v->spring ? v->spring[9 * (k / 3) + 3 * row + k % 3] : 0.;
    PetscCall(VecRestoreArray(v->r[0], &own));
    PetscCall(SbSpaceGetLocalRead(top, v->r[0], &x));
    for (PetscInt k = 0; k < 3 * top->nnode; k++)
      v->shared[9 * (v->mean ? v->mean[k / 3] : k / 3) + 3 * row + k % 3] += x[k];
    PetscCall(SbSpaceRestoreLocalRead(top, v->r[0], &x));
  }
  for (PetscInt i = 0; i < 4 * s->mesh->ncell; i++) {
    const PetscInt c = i / 4;
    const PetscInt a = i % 4;
    const PetscBool face = (PetscBool)!SbSpaceCellElement(s, c)->nodes_per[0];
    PetscReal *d = v->shared + 9 * s->cell_node[i];
    PetscReal ninth[9];

    if (d[0] + d[4] + d[8] == 0.)
      continue;
    if (v->n == 3)
      PetscCall(SbSpaceAddCellBlock(s, v->A[v->n - 2], c, a, a, d));
    for (int k = 0; k < 9; k++)
      ninth[k] = d[k] / 9.;
    for (PetscInt k = 1; k < 4; k++) {
      for (PetscInt l = 1; l < 4; l++)
        PetscCall(SbSpaceAddCellBlock(p, v->A[v->n - 1], c, face ? (a + k) % 4 : a,
                                      face ? (a + l) % 4 : a, ninth));
    }
    PetscCall(PetscArrayzero(d, 9)); /* the node belongs to another cell, too */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLevelsSetUp(SbLevels v, PetscBool *positive)
{
  PetscFunctionBeginUser;
  if (v->multigrid) {
    PCFailedReason reason;

    PetscCall(PCSetOperators(v->multigrid, v->A[0], v->A[0]));
    PetscCall(PCSetUp(v->multigrid));
    PetscCall(PCGetFailedReason(v->multigrid, &reason));
    *positive = (PetscBool)!reason;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (v->n == 3) {
    SbSpace s = v->at[0];
    const SbPlan p = s->plan;
    const PetscReal *own;
    PetscScalar *d;

    PetscCall(MatGetDiagonal(v->A[0], v->t[0]));

    /* diagonal of the face terms and the mass matrix, without the cells */
    PetscCall(VecGetArray(v->r[0], &d));
    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      const PetscReal stiffness = v->stage.shift_k + v->stage.shift_v * s->beta[s->node_body[i]];
      const PetscReal inertia = v->stage.shift_a + v->stage.shift_v * s->alpha[s->node_body[i]];

      d[3 * i] = stiffness * p->face_term[0][p->diagonal[i]] + inertia * s->node_mass[i];
    }
    PetscCall(VecRestoreArray(v->r[0], &d));

    /* stiffness of the jumps: (1-w)^2 A_ii - 2 w (1-w) A_ij + w^2 A_jj */
    PetscCall(SbSpaceGetLocalRead(s, v->r[0], &own));
    for (PetscInt k = 0; k < 4 * SB_BATCH * s->nbatch; k++) {
      const PetscInt b = k / (4 * SB_BATCH);
      const PetscInt a = k / SB_BATCH % 4;
      const PetscInt i = sb_batch_nodes(s, b)[k % (4 * SB_BATCH)];
      const PetscInt j = v->across[i];
      const PetscInt at =
        p->offset[((size_t)b * 64 + (size_t)(8 * a + 4 + a)) * SB_BATCH + (size_t)(k % SB_BATCH)];
      const PetscReal w = v->weight[i];

      if (i >= s->nnode_owned || j < 0)
        continue;
      v->jump[i] =
        1. / ((1. - w) * (1. - w) * own[3 * i] + w * w * own[3 * j] -
              2. * w * (1. - w) * (v->stage.shift_k + v->stage.shift_v * s->beta[s->node_body[i]]) *
                p->face_term[at < 0][at < 0 ? ~at : at]);
    }
    PetscCall(SbSpaceRestoreLocalRead(s, v->r[0], &own));
  }
  PetscCall(SbGaussSeidelSetUp(v->A[v->n - 2], v->inverse, NULL, positive));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, positive, 1, SB_MPI_BOOL, MPI_LAND, v->at[0]->comm));
  if (!*positive)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetOperators(v->coarse, v->A[v->n - 1], v->A[v->n - 1]));
  PetscCall(KSPSetUp(v->coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLevelsCreate(SbSpace s, SbLevels *levels)
{
  SbLevels v;
  Mat P;
  PC pc;
  SbSpace upper, lower;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&v));
  v->at[0] = s;
  v->n = 1;
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &v->A[0]));
  *levels = v;
  if (s->edge_node) {
    PetscCall(PCCreate(s->comm, &v->multigrid));
    PetscCall(SbPCPMultigridCreate(s, v->multigrid));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (s->width > 4) {
    PetscCall(add_level(v, PETSC_FALSE));
    PetscCall(find_means(v));
  }
  PetscCall(add_level(v, PETSC_TRUE));
  upper = v->at[v->n - 2];
  lower = v->at[v->n - 1];
  PetscCall(MatCreateAIJ(s->comm, upper->nnode_owned, lower->nnode_owned, PETSC_DETERMINE,
                         PETSC_DETERMINE, 3, NULL, 3, NULL, &P));
  for (PetscInt i = 0; i < 4 * s->mesh->ncell; i++) {
    const PetscInt *vertex = lower->cell_node + 4 * (i / 4);
    const PetscInt a = i % 4;
    const PetscInt node = upper->cell_node[i];
    const PetscBool face = (PetscBool)!SbSpaceCellElement(upper, i / 4)->nodes_per[0];

    for (PetscInt k = 0; k < (face ? 3 : 1) && node < upper->nnode_owned; k++)
      PetscCall(MatSetValue(P, upper->gnode[node], lower->gnode[vertex[face ? (a + 1 + k) % 4 : a]],
                            face ? 1. / 3. : 1., INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateMAIJ(P, 3, &v->P));
  PetscCall(MatDestroy(&P));
  for (PetscInt k = 0; k < v->n; k++) {
    PetscCall(SbSpaceCreateVec(v->at[k], &v->r[k]));
    PetscCall(SbSpaceCreateVec(v->at[k], &v->z[k]));
    PetscCall(SbSpaceCreateVec(v->at[k], &v->t[k]));
  }
  PetscCall(PetscMalloc1(9 * (size_t)v->at[v->n - 2]->nnode_owned, &v->inverse));
  PetscCall(KSPCreate(s->comm, &v->coarse));
  PetscCall(KSPSetOptionsPrefix(v->coarse, "pressure_coarse_"));
  PetscCall(KSPSetType(v->coarse, KSPPREONLY));
  PetscCall(KSPGetPC(v->coarse, &pc));
  PetscCall(SbPCMultigridSet(pc, WEAK));
  PetscCall(KSPSetFromOptions(v->coarse));
  PetscCall(SbPCMultigridAvoid(lower, pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLevelsDestroy(SbLevels *levels)
{
  SbLevels v = *levels;

  PetscFunctionBeginUser;
  if (!v)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(v->inverse));
  PetscCall(PetscFree(v->spring));
  PetscCall(PetscFree(v->shared));
  for (PetscInt k = 0; k < v->n; k++) {
    PetscCall(MatDestroy(&v->A[k]));
    if (k)
      PetscCall(SbSpaceDestroy(&v->at[k]));
    for (PetscInt b = 0; k && b < v->at[0]->mesh->nbody; b++)
      PetscCall(SbElementDestroy(&v->element[k][b]));
    PetscCall(PetscFree(v->element[k]));
    PetscCall(VecDestroy(&v->r[k]));
    PetscCall(VecDestroy(&v->z[k]));
    PetscCall(VecDestroy(&v->t[k]));
  }
  PetscCall(PetscFree4(v->mean, v->across, v->weight, v->jump));
  PetscCall(MatDestroy(&v->P));
  PetscCall(KSPDestroy(&v->coarse));
  PetscCall(PCDestroy(&v->multigrid));
  PetscCall(PetscFree(*levels));
  PetscFunctionReturn(PETSC_SUCCESS);
}
