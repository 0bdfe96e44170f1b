/*
  Matrix-free tangent, for laws whose tangent is Hooke's tensor rotated by R.

  With rotated gradients h_a = R grad phi_a the product A p of a cell is
    H = sum_a p_a h_a^T,  T = 2 mu sym(H) + lambda tr(H) I,  q_a = V T h_a,
  linear elasticity in the rotated frame; R enters only h. A new state costs a rotation and nine
  products per cell, an application about as much as a product with a stored matrix, and no blocks
  are formed: with few iterations per step this is several times cheaper than assembly.

  A cell of P2 has the rotated gradients of its four points, and lambda acts on the mean of tr(H)
  over them (quadratic.c). With far and near the two coordinates of the points, point q sees a
  linear cell; i moves by
    (4 far - 1) p_i + 4 far sum_j p_ij + 4 (near - far) p_iq,   p_ii = p_i:
  all terms but the last are the same at the four points.

  Vectors are copied to four doubles per node, so that a node is one vector load or store. Eight
  cells are evaluated at a time: 4x4 transposes turn eight loads of a node into lanes.

  Prescribed unknowns: p is zero there, and their rows are a multiple of the identity.
  Not handled: the consistent mass, tangents of effects.
*/
#include "fem_impl.h"

typedef struct {
  SbSpace space;
  void *memory; /* allocation that contains R and h */
  SbPack *R;    /* [nbatch][sb_rotation_points()][9] rotations */
  SbPack *h;    /* [nbatch][sb_rotation_points()][9] rotated gradients of nodes 1..3, 1/m */
  PetscReal *lambda, *mu; /* [nregion] Lame constants times the factor of the stiffness, Pa, */
  PetscReal *mean;        /* and of P2 what acts on the mean, besides lambda at the points */
  PetscReal *inertia;     /* [nnode_owned] diagonal from mass and its damping, kg/s^2 */
  PetscReal prescribed_diagonal; /* diagonal of prescribed unknowns, kg/s^2 or N/m */
  Vec ghosted;                   /* ghosted work vector; NULL on one rank */
  PetscReal *p, *q;              /* [nnode][4] input and output of the product */
} Operator;

typedef double Four __attribute__((vector_size(32)));
typedef double Eight __attribute__((vector_size(64)));

/* lanes[c] = component c of eight nodes. */
SB_INLINE void gather(const PetscReal *p, const PetscInt node[SB_BATCH], Eight lanes[3])
{
  Eight t[4];

  for (int k = 0; k < 4; k++) {
    const Four low = *(const Four *)(p + 4 * node[k]);
    const Four high = *(const Four *)(p + 4 * node[k + 4]);

    t[k] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
  }
  const Eight even01 = __builtin_shufflevector(t[0], t[1], 0, 8, 2, 10, 4, 12, 6, 14);
  const Eight even23 = __builtin_shufflevector(t[2], t[3], 0, 8, 2, 10, 4, 12, 6, 14);
  const Eight odd01 = __builtin_shufflevector(t[0], t[1], 1, 9, 3, 11, 5, 13, 7, 15);
  const Eight odd23 = __builtin_shufflevector(t[2], t[3], 1, 9, 3, 11, 5, 13, 7, 15);
  lanes[0] = __builtin_shufflevector(even01, even23, 0, 1, 8, 9, 4, 5, 12, 13);
  lanes[1] = __builtin_shufflevector(odd01, odd23, 0, 1, 8, 9, 4, 5, 12, 13);
  lanes[2] = __builtin_shufflevector(even01, even23, 2, 3, 10, 11, 6, 7, 14, 15);
}

/* Adds component c of eight nodes, lanes[c], to q. */
SB_INLINE void scatter_add(const Eight lanes[3], const PetscInt node[SB_BATCH], PetscReal *q)
{
  const Eight zero = {0};
  const Eight x = lanes[0];
  const Eight y = lanes[1];
  const Eight z = lanes[2];
  const Eight xy0 = __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14);
  const Eight xy1 = __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15);
  const Eight z0 = __builtin_shufflevector(z, zero, 0, 8, 2, 10, 4, 12, 6, 14);
  const Eight z1 = __builtin_shufflevector(z, zero, 1, 9, 3, 11, 5, 13, 7, 15);
  const Eight t[4] = {__builtin_shufflevector(xy0, z0, 0, 1, 8, 9, 4, 5, 12, 13),
                      __builtin_shufflevector(xy1, z1, 0, 1, 8, 9, 4, 5, 12, 13),
                      __builtin_shufflevector(xy0, z0, 2, 3, 10, 11, 6, 7, 14, 15),
                      __builtin_shufflevector(xy1, z1, 2, 3, 10, 11, 6, 7, 14, 15)};

  for (int k = 0; k < 4; k++) {
    *(Four *)(q + 4 * node[k]) += __builtin_shufflevector(t[k], t[k], 0, 1, 2, 3);
    *(Four *)(q + 4 * node[k + 4]) += __builtin_shufflevector(t[k], t[k], 4, 5, 6, 7);
  }
}

/* H = sum_a u_a h_a^T */
SB_INLINE void gradient(const Eight u[4][3], const Eight h[9], Eight H[9])
{
  for (int i = 0; i < 3; i++) {
    const Eight d1 = u[1][i] - u[0][i];
    const Eight d2 = u[2][i] - u[0][i];
    const Eight d3 = u[3][i] - u[0][i];

    for (int j = 0; j < 3; j++)
      H[3 * i + j] = d1 * h[j] + d2 * h[3 + j] + d3 * h[6 + j];
  }
}

/* Forces of T = 2 mu sym(H) + lambda tr(H) I + p I on the vertices; pv = p V or NULL. */
SB_INLINE void forces(const Eight H[9], const Eight h[9], const Eight *V, PetscReal lambda,
                      PetscReal mu, const Eight *pv, Eight f[4][3])
{
  const Eight mv = mu * *V;
  const Eight m2 = mv + mv;
  const Eight sum = lambda * *V * (H[0] + H[4] + H[8]);
  const Eight pressure = pv ? sum + *pv : sum;
  const Eight xx = m2 * H[0] + pressure;
  const Eight yy = m2 * H[4] + pressure;
  const Eight zz = m2 * H[8] + pressure;
  const Eight xy = mv * (H[1] + H[3]);
  const Eight xz = mv * (H[2] + H[6]);
  const Eight yz = mv * (H[5] + H[7]);

  for (int a = 0; a < 3; a++) {
    const Eight *g = h + 3 * a;

    f[a + 1][0] = xx * g[0] + xy * g[1] + xz * g[2];
    f[a + 1][1] = xy * g[0] + yy * g[1] + yz * g[2];
    f[a + 1][2] = xz * g[0] + yz * g[1] + zz * g[2];
  }
  for (int i = 0; i < 3; i++)
    f[0][i] = -(f[1][i] + f[2][i] + f[3][i]);
}

/* q += A p for the batches of one region, gradients `stride` apart. Padding lanes have volume
   zero. */
SB_KERNEL static void apply_region(PetscInt nbatch, PetscInt width, const PetscInt *node,
                                   PetscInt stride, const SbPack *gradients, const SbPack *volume,
                                   PetscReal lambda, PetscReal mu, const PetscReal *p, PetscReal *q)
{
  for (PetscInt b = 0; b < nbatch; b++, node += width * SB_BATCH) {
    const Eight *h = (const Eight *)(gradients + stride * b);
    const Eight *V = (const Eight *)(volume + b);
    Eight u[4][3], H[9], f[4][3];

    for (int a = 0; a < 4; a++)
      gather(p, node + a * SB_BATCH, u[a]);
    gradient((const Eight(*)[3])u, h, H);
    forces(H, h, V, lambda, mu, NULL, f);
    for (int a = 0; a < 4; a++)
      scatter_add(f[a], node + a * SB_BATCH, q);
  }
}

/* The same for P2. lambda[2]: at the points, and for their mean. */
SB_KERNEL static void apply_quadratic(PetscInt nbatch, PetscInt width, const PetscInt *node,
                                      const SbPack *gradients, const SbPack *volume,
                                      const PetscReal lambda[2], PetscReal mu, const PetscReal *p,
                                      PetscReal *q)
{
  static const int between[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};
  const PetscReal far4 = 4. * SbRuleQuadratic.L[0][1];
  const PetscReal step = 4. * SbRuleQuadratic.L[0][0] - far4;

  for (PetscInt b = 0; b < nbatch; b++, node += width * SB_BATCH) {
    const Eight *h = (const Eight *)(gradients + 36 * b);
    const Eight V = 0.25 * *(const Eight *)(volume + b);
    Eight u[10][3], same[4][3], H[4][9], f[4][4][3];
    Eight mean = {0};

    for (int a = 0; a < 10; a++)
      gather(p, node + a * SB_BATCH, u[a]);

    // terms of the vertices that are the same at all points; then the gradients at each point
    for (int i = 0; i < 3; i++) {
      for (int a = 0; a < 4; a++) {
        same[a][i] = (far4 - 1.) * u[a][i];
        for (int c = 0; c < 4; c++)
          if (c != a)
            same[a][i] += far4 * u[between[a][c]][i];
      }
    }
    for (int k = 0; k < 4; k++) {
      Eight here[4][3];

      for (int i = 0; i < 3; i++)
        for (int a = 0; a < 4; a++)
          here[a][i] = same[a][i] + step * u[between[a][k]][i];
      gradient((const Eight(*)[3])here, h + 9 * k, H[k]);
      mean += H[k][0] + H[k][4] + H[k][8];
    }
    mean *= 0.25 * lambda[1] * V;

    // forces of the points on the vertices
    for (int k = 0; k < 4; k++)
      forces(H[k], h + 9 * k, &V, lambda[0], mu, &mean, f[k]);

    // adjoint of the above: back to vertices and edge nodes
    for (int i = 0; i < 3; i++) {
      for (int a = 0; a < 4; a++)
        same[a][i] = f[0][a][i] + f[1][a][i] + f[2][a][i] + f[3][a][i];
      for (int a = 0; a < 4; a++) {
        u[a][i] = (far4 - 1.) * same[a][i] + step * f[a][a][i];
        for (int c = a + 1; c < 4; c++)
          u[between[a][c]][i] = far4 * (same[a][i] + same[c][i]) + step * (f[c][a][i] + f[a][c][i]);
      }
    }
    for (int a = 0; a < 10; a++)
      scatter_add(u[a], node + a * SB_BATCH, q);
  }
}

static PetscErrorCode MatMult_Frames(Mat A, Vec X, Vec Y)
{
  Operator *o;
  SbSpace s;
  const PetscScalar *x;
  PetscScalar *y;
  Vec from = X;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &o));
  s = o->space;

  /* p: X with ghosts, zero at prescribed unknowns */
  if (o->ghosted) {
    PetscCall(VecCopy(X, o->ghosted));
    from = o->ghosted;
  }
  PetscCall(SbSpaceGetLocalRead(s, from, &x));
  for (PetscInt i = 0; i < s->nnode; i++)
    for (PetscInt c = 0; c < 3; c++)
      o->p[4 * i + c] = x[3 * i + c];
  PetscCall(SbSpaceRestoreLocalRead(s, from, &x));
  for (PetscInt k = 0; k < 3 * s->nfixed; k++) {
    const PetscInt i = s->fixed_node[k / 3];

    if (s->fixed[i] & (1 << k % 3))
      o->p[4 * i + k % 3] = 0.;
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    for (PetscInt c = 0; c < 4; c++)
      o->q[4 * i + c] = o->inertia[i] * o->p[4 * i + c];
  PetscCall(PetscArrayzero(o->q + 4 * s->nnode_owned, 4 * (s->nnode - s->nnode_owned)));
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    const PetscInt b = region->bstart;
    const PetscInt n = region->bend - b;
    const PetscReal lambda[2] = {o->lambda[r], o->mean[r]};
    const SbPack *h = (const SbPack *)o->h + 9 * sb_rotation_points(s) * b;
    const SbPack *V = (const SbPack *)s->batch_V + b;

    if (region->quadratic)
      apply_quadratic(n, s->width, sb_batch_nodes(s, b), h, V, lambda, o->mu[r], o->p, o->q);
    else
      apply_region(n, s->width, sb_batch_nodes(s, b), 9 * sb_rotation_points(s), h, V, o->lambda[r],
                   o->mu[r], o->p, o->q);
  }
  PetscCall(VecGetArrayRead(X, &x));
  PetscCall(VecGetArray(Y, &y));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    for (PetscInt c = 0; c < 3; c++)
      y[3 * i + c] = o->q[4 * i + c];
  for (PetscInt k = 0; k < 3 * s->nfixed && s->fixed_node[k / 3] < s->nnode_owned; k++) {
    const PetscInt i = 3 * s->fixed_node[k / 3] + k % 3;

    if (s->fixed[i / 3] & (1 << k % 3))
      y[i] = o->prescribed_diagonal * x[i];
  }
  PetscCall(VecRestoreArray(Y, &y));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscCall(PetscLogFlops(170. * (PetscLogDouble)s->mesh->ncell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Frames(Mat A)
{
  Operator *o;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &o));
  PetscCall(VecDestroy(&o->ghosted));
  PetscCall(PetscFree(o->memory));
  PetscCall(PetscFree4(o->lambda, o->mean, o->mu, o->inertia));
  PetscCall(PetscFree(o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* h = R grad phi of one batch, or of one point of it. */
SB_KERNEL static void rotate_gradients(const SbPack R[restrict 9], const SbPack g[restrict 9],
                                       SbPack h[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9], e[9], t[9];

    SbPackGet(9, R, l, r);
    SbPackGet(9, g, l, e);
    SbMatMulTranspose(e, r, t);
    SbPackPut(9, t, l, h);
  }
}

/* The factors of a viscoelastic region: those of the law of the step for the stiffness. */
static void put_viscous(Operator *o, PetscInt r, const SbStage *stage)
{
  const SbRegion *region = &o->space->region[r];
  const SbMaterial m = region->material;
  const SbViscous v = m->viscous;
  const PetscReal stiffness = stage->shift_k * v->scale;
  const PetscReal damping = stage->shift_v * o->space->beta[region->body];
  const PetscReal step = SbMaterialVolumetricModulus(v->step);
  const PetscReal points = SbMaterialVolumetricModulus(region->pointwise);
  const PetscBool mean = (PetscBool)(region->pointwise != m);

  o->mu[r] = (stiffness + damping) * SbMaterialShearModulus(m);
  o->lambda[r] = stiffness * (mean ? points : step) + damping * points;
  o->mean[r] = mean ? stiffness * (step - points) + damping * SbMaterialMeanModulus(m) : 0.;
}

/* Computes rotations and factors of a stage. */
static PetscErrorCode assemble(Mat A, const SbStage *stage)
{
  Operator *o;
  SbSpace s;
  PetscReal stiffest = 0.;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &o));
  s = o->space;
  SbSpaceCellRotations(s, stage->u, o->R);
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    o->inertia[i] = (stage->shift_a + stage->shift_v * s->alpha[s->node_body[i]]) * s->node_mass[i];
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    const SbMaterial m = region->material;
    const PetscReal factor = stage->shift_k + stage->shift_v * s->beta[region->body];

    o->lambda[r] = factor * SbMaterialVolumetricModulus(region->pointwise);
    o->mean[r] = region->pointwise != m ? factor * SbMaterialMeanModulus(m) : 0.;
    o->mu[r] = factor * SbMaterialShearModulus(m);
    if (region->history)
      put_viscous(o, r, stage);
    stiffest = PetscMax(stiffest, factor * SbMaterialYoungModulus(m));
    for (PetscInt b = region->bstart; b < region->bend; b++) {
      for (int q = 0; q < (region->quadratic ? 4 : 1); q++) {
        const PetscInt at = 9 * (sb_rotation_points(s) * b + q);

        rotate_gradients((const SbPack *)o->R + at, (const SbPack *)s->batch_g + 9 * b, o->h + at);
      }
    }
  }

  /* as large as other diagonal entries: E times the edge of a typical cell; ranks may differ */
  o->prescribed_diagonal =
    s->nbatch ? stiffest * PetscCbrtReal(s->batch_V[0][0]) + (s->nnode_owned ? o->inertia[0] : 0.)
              : 1.;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceAllowsMatrixFree(SbSpace s, PetscBool *has)
{
  PetscFunctionBeginUser;
  *has = (PetscBool)(!s->consistent_mass && !s->faces && !s->mesh->edge_off);
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbMaterial m = s->region[r].material;
    const PetscReal *viscosity = m->viscous ? m->viscous->viscosity : NULL;

    *has = (PetscBool)(*has && (m->linear || (m->ops.frame && !m->active && !m->eigen)) &&
                       (!viscosity || (viscosity[0] == 0. && viscosity[1] == 0.)));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, has, 1, SB_MPI_BOOL, MPI_LAND, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceCreateMatrixFree(SbSpace s, Mat *A)
{
  static const SbAssembly assembly = {.assemble = assemble};
  const size_t packs = 9 * (size_t)(sb_rotation_points(s) * s->nbatch);
  const size_t nodes = 8 * (size_t)s->nnode;
  PetscBool has;
  Operator *o;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceAllowsMatrixFree(s, &has));
  PetscCheck(
    has, s->comm, PETSC_ERR_SUP,
    "The tangent of this law, element cr or dg, curved tets, or the consistent mass, need an "
    "assembled matrix");
  if (!s->plan)
    PetscCall(SbPlanCreate(s, &s->plan));
  PetscCall(PetscNew(&o));
  o->space = s;
  PetscCall(PetscMalloc(2 * packs * sizeof(SbPack) + nodes * sizeof(PetscReal) + 64, &o->memory));
  o->R = (SbPack *)(((uintptr_t)o->memory + 63) & ~(uintptr_t)63);
  o->h = o->R + packs;
  o->p = (PetscReal *)(o->h + packs);
  o->q = o->p + 4 * s->nnode;
  PetscCall(PetscArrayzero(o->p, 8 * s->nnode));
  PetscCall(PetscMalloc4(s->nregion, &o->lambda, s->nregion, &o->mean, s->nregion, &o->mu,
                         s->nnode_owned, &o->inertia));
  if (s->ghosted)
    PetscCall(SbSpaceCreateVec(s, &o->ghosted));
  PetscCall(MatCreateShell(s->comm, 3 * s->nnode_owned, 3 * s->nnode_owned, PETSC_DETERMINE,
                           PETSC_DETERMINE, o, A));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatShellSetOperation(*A, MATOP_MULT, SB_OPERATION(MatMult_Frames)));
  PetscCall(MatShellSetOperation(*A, MATOP_DESTROY, SB_OPERATION(MatDestroy_Frames)));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(MatSetUp(*A));
  PetscCall(SbMatrixSetAssembly(*A, &assembly));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMatrixFreeGetRotations(Mat A, const SbPack **R)
{
  const SbAssembly *own;
  Operator *o;

  PetscFunctionBeginUser;
  *R = NULL;
  PetscCall(SbMatrixGetAssembly(A, &own));
  if (!own || own->assemble != assemble)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatShellGetContext(A, &o));
  *R = (const SbPack *)o->R;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMatrixFreeAddRows(Mat A, PetscInt n, const PetscInt node[], const PetscInt ia[],
                                   PetscReal block[])
{
  Operator *o;
  SbSpace s;
  SbPlan p;
  PetscInt *wanted;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &o));
  s = o->space;
  p = s->plan;
  PetscCall(PetscMalloc1(s->nnode, &wanted));
  for (PetscInt i = 0; i < s->nnode; i++)
    wanted[i] = -1;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = node ? node[k] : k;

    wanted[i] = k;
    for (PetscInt c = 0; c < 3; c++)
      block[9 * (ia[k] + p->diagonal[i] - p->di[i]) + 4 * c] += o->inertia[i];
  }
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const SbRegion *region = s->batch_region[b];
    const PetscBool mean = (PetscBool)(region->quadratic && region->pointwise != region->material);
    const PetscInt r = (PetscInt)(region - s->region);
    const PetscInt npair = region->quadratic ? SB_PAIRS : 10;
    const PetscInt *corner = sb_batch_nodes(s, b);
    const SbPoints points = SbBatchPoints(s, b);
    PetscBool any = PETSC_FALSE;
    SbPack K[SB_PAIRS][9] __attribute__((aligned(64))), B[4][10][9] __attribute__((aligned(64)));
    SbPack factor;
    SbPack volume[30] = {{0}};

    for (PetscInt l = 0; l < region->nnode * SB_BATCH; l++)
      any = (PetscBool)(any || wanted[corner[l]] >= 0);
    if (!any)
      continue;

    // the points, and for P2 lambda/V b b^T with b = sum_q V_q h_q (quadratic.c)
    for (int q = 0; q < points.n; q++) {
      const SbPack *R = (const SbPack *)o->R + 9 * (sb_rotation_points(s) * b + q);
      SbPack V;

      SbPointVolume(&points, q, V);
      SbCellBlocksIsotropic(points.g, V, o->lambda[r], o->mu[r], R, B[q]);
      if (region->quadratic)
        SbPointForce(&points, q, R, volume);
    }
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      const PetscReal V = s->batch_V[b][l];

      factor[l] = mean && V > 0. ? o->mean[r] / V : 0.;
    }
    if (region->quadratic)
      SbQuadraticBlocks(points.rule, (const SbPack(*)[10][9])B, factor, (const SbPack *)volume, K);
    else
      memcpy(K, B[0], sizeof(B[0]));
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const size_t start = (size_t)b * s->width * s->width * SB_BATCH + l;

      for (PetscInt turn = 0; turn < 2 * npair; turn++) {
        const PetscInt pair = turn / 2;
        const PetscInt a = turn % 2 ? SbPairB[pair] : SbPairA[pair];
        const PetscInt c = turn % 2 ? SbPairA[pair] : SbPairB[pair];
        const PetscInt i = corner[a * SB_BATCH + l];
        const PetscInt k = wanted[i];

        if (k < 0 || (a == c && turn % 2))
          continue;
        const PetscInt position = p->offset[start + (size_t)(SB_BATCH * (s->width * a + c))];
        const PetscInt at =
          ia[k] +
          (position >= 0 ? position - p->di[i] : p->di[i + 1] - p->di[i] + ~position - p->oi[i]);

        for (int e = 0; e < 9; e++)
          block[9 * at + e] += K[pair][turn % 2 ? 3 * (e % 3) + e / 3 : e][l];
      }
    }
  }

  /* clear rows and columns of prescribed unknowns */
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = node[k];
    const PetscInt nd = p->di[i + 1] - p->di[i];

    for (PetscInt at = 0; at < ia[k + 1] - ia[k]; at++) {
      const PetscInt j = at < nd ? p->dj[p->di[i] + at] : p->oj[p->oi[i] + at - nd];

      for (PetscInt e = 0; e < 9; e++)
        if (s->fixed[i] & (1 << e / 3) || s->fixed[j] & (1 << e % 3))
          block[9 * (ia[k] + at) + e] = i == j && e % 4 == 0 ? o->prescribed_diagonal : 0.;
    }
  }
  PetscCall(PetscFree(wanted));
  PetscFunctionReturn(PETSC_SUCCESS);
}
