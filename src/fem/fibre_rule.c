/*
  Directions of fibres and sheets in a ventricle by the rule of Bayer, Blake, Plank and Trayanova,
  Ann. Biomed. Eng. 40, 2243-2254, 2012, from the solutions of Laplace problems between surfaces, by
  linear tets on the rest state of a body:

    psi  0 at the apex, 1 at the base; epi 1 on the outer surface, 0 on the inner ones; lv and, with
    a right ventricle, rv: 1 on one inner surface, 0 on all other ones.

  In a tet, with constant gradients and the values at its centre, and columns e0 around, e1 to the
  base, e2 to the outside (axis()), turned by alpha about e2 and then by beta about the fibre
  (orient()):

    d = rv / (lv + rv),  Q_lv = orient(axis(grad psi, -grad lv), as(d), bs(d)),
    Q_rv = orient(axis(grad psi, grad rv), as(d), bs(d)),  Q_in = bislerp(Q_lv, Q_rv, d),
    Q_out = orient(axis(grad psi, grad epi), aw(epi), bw(epi)),  Q = bislerp(Q_in, Q_out, epi),
    as(d) = a_in (1 - 2 d), aw(d) = a_in (1 - d) + a_out d, and b alike.

  The fibre is the first column, the sheet's direction the third one, along the normal of the wall
  where beta is 0. bislerp() interpolates rotations along the shortest way between any of those that
  differ by half turns about the axes, as fibres and sheets have no sign.

  A tet of which all vertices are on one surface has no gradient of its own: it takes the mean
  gradient of the tets around its vertices, by volume. Errors: sets within each other between which
  a problem is solved; tets without a gradient that their axes need, those around them included;
  gradients that are parallel in most tets. Where they are parallel in a few, as on the axis of a
  ventricle at the apex, any perpendicular direction serves, and a warning says how many there are.
  Not handled: the holes of valves but the base.
*/
#include "fem_impl.h"
#include "sbgeometry.h"

#define SMALL 1e-8    /* angle and sine below which two rotations are one */
#define PARALLEL 1e-4 /* sine of the angle below which two gradients are parallel */
#define FLAT 1e-7     /* difference in a tet below which a solution, from 0 to 1, is constant */
#define ACCURACY 1e-10

enum {
  OUTER,
  INNER,
  BASE,
  APEX,
  RIGHT
};

void SbCellCentre(SbMesh mesh, PetscInt cell, PetscReal x[3])
{
  for (int k = 0; k < 3; k++)
    x[k] = 0.;
  for (int k = 0; k < 12; k++)
    x[k % 3] += mesh->x[3 * mesh->cell[4 * cell + k / 3] + k % 3] / 4.;
}

/* Volume of a tet, and the gradients of its four basis functions. */
static PetscReal gradients(SbMesh mesh, PetscInt cell, PetscReal g[4][3])
{
  const PetscInt *v = mesh->cell + 4 * cell;
  PetscReal e[3][3];

  for (int i = 0; i < 3; i++)
    SbSubtract(mesh->x + 3 * v[i + 1], mesh->x + 3 * v[0], e[i]);
  SbCross(e[1], e[2], g[1]);
  SbCross(e[2], e[0], g[2]);
  SbCross(e[0], e[1], g[3]);
  const PetscReal six = SbDot3(e[0], g[1]);
  for (int k = 0; k < 3; k++) {
    for (int i = 1; i < 4; i++)
      g[i][k] /= six;
    g[0][k] = -g[1][k] - g[2][k] - g[3][k];
  }
  return six / 6.;
}

/* The bit of a set, by its name. */
static PetscErrorCode find_bit(SbMesh mesh, const char *name, uint64_t *bit)
{
  PetscFunctionBeginUser;
  *bit = 0;
  for (PetscInt k = 0; k < mesh->nset; k++)
    if (!strcmp(mesh->set[k].name, name))
      *bit = SB_SET_BIT(k);
  PetscCheck(*bit, mesh->comm, PETSC_ERR_PLIB, "There is no set '%s'", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The Laplacian of a body; one on the diagonal of vertices of others. */
static PetscErrorCode create_matrix(SbMesh mesh, PetscInt body, Mat *A)
{
  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(mesh->comm, mesh->nvert_owned, mesh->nvert_owned, mesh->Nvert, mesh->Nvert,
                         30, NULL, 30, NULL, A));
  PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal g[4][3], K[16];
    PetscInt row[4];

    if (mesh->cell_body[c] != body)
      continue;
    const PetscReal V = gradients(mesh, c, g);
    for (int i = 0; i < 4; i++)
      row[i] = mesh->gvert[mesh->cell[4 * c + i]];
    for (int i = 0; i < 16; i++)
      K[i] = V * SbDot3(g[i / 4], g[i % 4]);
    PetscCall(MatSetValues(*A, 4, row, 4, row, K, ADD_VALUES));
  }
  for (PetscInt v = 0; v < mesh->nvert_owned; v++)
    if (mesh->vert_body[v] != body)
      PetscCall(MatSetValue(*A, mesh->gvert[v], mesh->gvert[v], 1., ADD_VALUES));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u[nvert], ghosts too: 1 on the sets `one`, else 0 on the sets `zero`, harmonic between. */
static PetscErrorCode solve(SbMesh mesh, PetscInt body, Mat laplacian, uint64_t one, uint64_t zero,
                            PetscReal u[])
{
  PetscInt *row;
  PetscInt n = 0;
  Mat A;
  Vec x, b;
  KSP ksp;
  PC pc;
  KSPConvergedReason reason;
  const PetscReal *value;

  PetscFunctionBeginUser;
  PetscCall(MatDuplicate(laplacian, MAT_COPY_VALUES, &A));
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(PetscMalloc1(mesh->nvert_owned, &row));
  for (PetscInt v = 0; v < mesh->nvert_owned; v++) {
    if (mesh->vert_body[v] != body || !(mesh->vert_set[v] & (one | zero)))
      continue;
    row[n++] = mesh->gvert[v];
    if (mesh->vert_set[v] & one)
      PetscCall(VecSetValue(x, mesh->gvert[v], 1., INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(x));
  PetscCall(VecAssemblyEnd(x));
  PetscCall(MatZeroRowsColumns(A, n, row, 1., x, b));
  PetscCall(KSPCreate(mesh->comm, &ksp));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSetTolerances(ksp, ACCURACY, 0., PETSC_DEFAULT, 100000));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCheck(
    reason > 0, mesh->comm, PETSC_ERR_NOT_CONVERGED,
    "body '%s': a Laplace problem for directions of fibres does not converge; is each part "
    "of the body connected to the surfaces of the rule?",
    mesh->body[body].name);
  PetscCall(VecGetArrayRead(x, &value));
  for (PetscInt v = 0; v < mesh->nvert; v++)
    u[v] = v < mesh->nvert_owned ? value[v] : 0.;
  PetscCall(PetscSFBcastBegin(mesh->vert_sf, MPIU_REAL, value, u, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(mesh->vert_sf, MPIU_REAL, value, u, MPI_REPLACE));
  PetscCall(VecRestoreArrayRead(x, &value));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(PetscFree(row));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&b));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns around, to the base, to the outside; false where the gradients are parallel. */
static PetscBool axis(const PetscReal psi[3], const PetscReal phi[3], PetscReal Q[9])
{
  PetscReal e[3][3];

  for (int k = 0; k < 3; k++)
    e[1][k] = psi[k];
  if (SbNormalise(e[1]) == 0.)
    e[1][2] = 1.;
  for (int k = 0; k < 3; k++)
    e[2][k] = phi[k];
  (void)SbNormalise(e[2]);
  const PetscReal along = SbDot3(e[1], e[2]);
  for (int k = 0; k < 3; k++)
    e[2][k] -= along * e[1][k];
  const PetscBool across = (PetscBool)(SbNormalise(e[2]) >= PARALLEL);
  if (!across) {
    const int least = PetscAbsReal(e[1][0]) < PetscAbsReal(e[1][1]) ? 0 : 1;

    for (int k = 0; k < 3; k++)
      e[2][k] = (k == least) - e[1][least] * e[1][k];
    (void)SbNormalise(e[2]);
  }
  SbCross(e[1], e[2], e[0]);
  for (int k = 0; k < 9; k++)
    Q[k] = e[k % 3][k / 3];
  return across;
}

/* Q turned by alpha about its third column, then by beta about its first one. */
static void orient(PetscReal Q[9], PetscReal alpha, PetscReal beta)
{
  const PetscReal c = PetscCosReal(alpha);
  const PetscReal s = PetscSinReal(alpha);
  const PetscReal d = PetscCosReal(beta);
  const PetscReal t = PetscSinReal(beta);
  const PetscReal A[9] = {c, -s, 0., s, c, 0., 0., 0., 1.};
  const PetscReal B[9] = {1., 0., 0., 0., d, t, 0., -t, d};
  PetscReal turned[9];

  SbMatMul(Q, A, turned);
  SbMatMul(turned, B, Q);
}

/* The unit quaternion w, x, y, z of a rotation, from the largest of its four squares. */
static void quaternion(const PetscReal Q[9], PetscReal q[4])
{
  const PetscReal square[4] = {1. + Q[0] + Q[4] + Q[8], 1. + Q[0] - Q[4] - Q[8],
                               1. - Q[0] + Q[4] - Q[8], 1. - Q[0] - Q[4] + Q[8]};

  /* 4 q_i q_j */
  const PetscReal p[4][4] = {
    {square[0], Q[7] - Q[5], Q[2] - Q[6], Q[3] - Q[1]},
    {Q[7] - Q[5], square[1], Q[3] + Q[1], Q[2] + Q[6]},
    {Q[2] - Q[6], Q[3] + Q[1], square[2], Q[7] + Q[5]},
    {Q[3] - Q[1], Q[2] + Q[6], Q[7] + Q[5], square[3]},
  };
  int most = 0;

  for (int i = 1; i < 4; i++)
    most = square[i] > square[most] ? i : most;
  for (int i = 0; i < 4; i++)
    q[i] = p[most][i] / (2. * PetscSqrtReal(square[most]));
}

static void rotation(const PetscReal q[4], PetscReal Q[9])
{
  const PetscReal w = q[0];
  const PetscReal x = q[1];
  const PetscReal y = q[2];
  const PetscReal z = q[3];
  const PetscReal R[9] = {
    1. - 2. * (y * y + z * z), 2. * (x * y - w * z),      2. * (x * z + w * y),
    2. * (x * y + w * z),      1. - 2. * (x * x + z * z), 2. * (y * z - w * x),
    2. * (x * z - w * y),      2. * (y * z + w * x),      1. - 2. * (x * x + y * y)};

  for (int k = 0; k < 9; k++)
    Q[k] = R[k];
}

/* Q becomes the rotation a part t of the way from Q to `to`. */
static void bislerp(PetscReal Q[9], const PetscReal to[9], PetscReal t)
{
  PetscReal a[4], b[4], from[4], q[4];
  PetscReal best = -1.;

  quaternion(Q, a);
  quaternion(to, b);

  /* a, and a times i, j, k: half turns about the columns */
  const PetscReal same[4][4] = {{a[0], a[1], a[2], a[3]},
                                {-a[1], a[0], a[3], -a[2]},
                                {-a[2], -a[3], a[0], a[1]},
                                {-a[3], a[2], -a[1], a[0]}};
  for (int i = 0; i < 4; i++) {
    PetscReal dot = 0.;

    for (int k = 0; k < 4; k++)
      dot += same[i][k] * b[k];
    if (PetscAbsReal(dot) <= best)
      continue;
    best = PetscAbsReal(dot);
    for (int k = 0; k < 4; k++)
      from[k] = dot < 0. ? -same[i][k] : same[i][k];
  }
  const PetscReal angle = PetscAcosReal(PetscMin(best, 1.));
  const PetscReal sine = PetscSinReal(angle);
  const PetscReal left = sine > SMALL ? PetscSinReal((1. - t) * angle) / sine : 1. - t;
  const PetscReal right = sine > SMALL ? PetscSinReal(t * angle) / sine : t;
  PetscReal length = 0.;
  for (int k = 0; k < 4; k++) {
    q[k] = left * from[k] + right * b[k];
    length += q[k] * q[k];
  }
  for (int k = 0; k < 4; k++)
    q[k] /= PetscSqrtReal(length);
  rotation(q, Q);
}

/* What a tet lacks. */
typedef enum {
  NOTHING,
  ACROSS,  /* its gradients are parallel */
  GRADIENT /* one that its axes need vanishes */
} Lack;

/* The axes of a tet from the gradients and means of psi, epi, lv, rv, with numbers of unknowns
   whose gradient vanishes as bits. */
static Lack rule(const PetscReal grad[4][3], const PetscReal mean[4], const PetscReal angle[4],
                 unsigned flat, PetscReal Q[9])
{
  PetscReal other[9];
  PetscBool across = PETSC_TRUE;
  const PetscReal sum = mean[2] + mean[3];
  const PetscReal d = sum > 0. ? PetscMax(0., PetscMin(1., mean[3] / sum)) : 0.;
  const PetscReal out = PetscMax(0., PetscMin(1., mean[1]));
  const PetscReal inside[3] = {-grad[2][0], -grad[2][1], -grad[2][2]};

  /* the parts that epi, lv and rv have in the result */
  const PetscReal part[4] = {1., out, (1. - out) * (1. - d), (1. - out) * d};
  unsigned needed = 0;

  for (unsigned p = 0; p < 4; p++)
    needed |= part[p] > FLAT ? 1U << p : 0;
  if (!axis(grad[0], inside, Q) && needed & 4U)
    across = PETSC_FALSE;
  orient(Q, angle[0] * (1. - 2. * d), angle[2] * (1. - 2. * d));
  if (d > 0.) {
    if (!axis(grad[0], grad[3], other) && needed & 8U)
      across = PETSC_FALSE;
    orient(other, angle[0] * (1. - 2. * d), angle[2] * (1. - 2. * d));
    bislerp(Q, other, d);
  }
  if (!axis(grad[0], grad[1], other) && needed & 2U)
    across = PETSC_FALSE;
  orient(other, angle[0] * (1. - out) + angle[1] * out, angle[2] * (1. - out) + angle[3] * out);
  bislerp(Q, other, out);
  if (needed & flat)
    return GRADIENT;
  return across ? NOTHING : ACROSS;
}

/* Sum over the tets around each vertex of the body of the volume times the gradient of u[nvert],
   sum[nvert][3], ghosts too. */
static PetscErrorCode sum_gradients(SbMesh mesh, PetscInt body, const PetscReal u[],
                                    PetscReal sum[])
{
  PetscReal *all;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(sum, 3 * mesh->nvert));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal g[4][3];
    PetscReal grad[3] = {0., 0., 0.};

    if (mesh->cell_body[c] != body)
      continue;
    const PetscReal V = gradients(mesh, c, g);
    for (int i = 0; i < 12; i++)
      grad[i % 3] += V * u[mesh->cell[4 * c + i / 3]] * g[i / 3][i % 3];
    for (int i = 0; i < 12; i++)
      sum[3 * mesh->cell[4 * c + i / 3] + i % 3] += grad[i % 3];
  }

  // ghosts add to their owners, and get the sums
  PetscCall(PetscMalloc1(3 * mesh->nvert_owned, &all));
  PetscCall(PetscArraycpy(all, sum, 3 * mesh->nvert_owned));
  MPI_Datatype three;
  PetscCallMPI(MPI_Type_contiguous(3, MPIU_REAL, &three));
  PetscCallMPI(MPI_Type_commit(&three));
  PetscCall(PetscSFReduceBegin(mesh->vert_sf, three, sum, all, MPI_SUM));
  PetscCall(PetscSFReduceEnd(mesh->vert_sf, three, sum, all, MPI_SUM));
  PetscCall(PetscArraycpy(sum, all, 3 * mesh->nvert_owned));
  PetscCall(PetscSFBcastBegin(mesh->vert_sf, three, all, sum, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(mesh->vert_sf, three, all, sum, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&three));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets between which a problem is solved, of which one has vertices that the other has not. */
static PetscErrorCode check_sets(SbMesh mesh, PetscInt body, const uint64_t bit[], SbFibres f)
{
  static const int pairs[][2] = {{OUTER, INNER}, {BASE, APEX}, {OUTER, RIGHT}, {INNER, RIGHT}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(pairs); k++) {
    const int a = pairs[k][0];
    const int b = pairs[k][1];
    PetscInt count[3] = {0, 0, 0}; // in a, in b, in both

    if (!bit[b])
      continue;
    for (PetscInt v = 0; v < mesh->nvert_owned; v++) {
      const PetscBool in[2] = {(PetscBool)((mesh->vert_set[v] & bit[a]) != 0),
                               (PetscBool)((mesh->vert_set[v] & bit[b]) != 0)};

      if (mesh->vert_body[v] != body)
        continue;
      count[0] += in[0];
      count[1] += in[1];
      count[2] += in[0] && in[1];
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, mesh->comm));
    const int inner = count[2] < count[0]; // which of the two may be within the other one
    PetscCheck(count[2] < count[inner], mesh->comm, PETSC_ERR_USER_INPUT,
               "%s_surfaces: all %" PetscInt_FMT
               " vertices that the set '%s' has of the body '%s' are in '%s', too, which has "
               "%" PetscInt_FMT
               "; the rule goes from one of these sets to the other one, so they must be apart",
               f->option[0], count[inner], f->surface[pairs[k][inner]], mesh->body[body].name,
               f->surface[pairs[k][!inner]], count[!inner]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors and a warning of tets that lack something: n[kind] of them on this rank, the first ones
   at x[kind]. */
static PetscErrorCode judge(SbMesh mesh, PetscInt body, SbFibres f, const PetscInt n[3],
                            PetscReal x[3][3])
{
  PetscMPIInt rank, size;
  PetscInt all[3];
  char sets[SB_FIBRE_SURFACES * (SB_NAME_MAX + 2)] = "";

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(mesh->comm, &rank));
  PetscCallMPI(MPI_Comm_size(mesh->comm, &size));
  PetscCallMPI(MPI_Allreduce(n, all, 3, MPIU_INT, MPI_SUM, mesh->comm));
  for (int i = 0; i < SB_FIBRE_SURFACES && f->surface[i][0]; i++)
    SbAppend(sizeof(sets), sets, "%s%s", i ? ", " : "", f->surface[i]);
  for (int kind = ACROSS; kind <= GRADIENT; kind++) {
    PetscMPIInt first = n[kind] ? rank : size;

    if (!all[kind])
      continue;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, mesh->comm));
    PetscCallMPI(MPI_Bcast(x[kind], 3, MPIU_REAL, first, mesh->comm));
  }
  PetscCheck(!all[GRADIENT], mesh->comm, PETSC_ERR_USER_INPUT,
             "%s_surfaces: the surfaces %s of the body '%s' give %" PetscInt_FMT
             " of %" PetscInt_FMT
             " tets no direction, the first one at (%.4g, %.4g, %.4g) m, as a solution of the rule "
             "does not change there; do sets overlap, or does a part touch only one of them?",
             f->option[0], sets, mesh->body[body].name, all[GRADIENT],
             all[NOTHING] + all[ACROSS] + all[GRADIENT], (double)x[GRADIENT][0],
             (double)x[GRADIENT][1], (double)x[GRADIENT][2]);
  PetscCheck(all[ACROSS] <= all[NOTHING], mesh->comm, PETSC_ERR_USER_INPUT,
             "%s_surfaces: with the surfaces %s of the body '%s' the way to the base is that "
             "through the wall in %" PetscInt_FMT " of %" PetscInt_FMT
             " tets, the first one at (%.4g, %.4g, %.4g) m, so they have no direction around; are "
             "outer and inner surface, base and apex four different sets?",
             f->option[0], sets, mesh->body[body].name, all[ACROSS], all[NOTHING] + all[ACROSS],
             (double)x[ACROSS][0], (double)x[ACROSS][1], (double)x[ACROSS][2]);
  if (all[ACROSS])
    PetscCall(SbWarning(mesh->comm,
                        "%s_surfaces: in %" PetscInt_FMT " of %" PetscInt_FMT
                        " tets of the body '%s', the first one at (%.4g, %.4g, %.4g) m, the way to "
                        "the base is that through the wall; their directions are any across it",
                        f->option[0], all[ACROSS], all[NOTHING] + all[ACROSS],
                        mesh->body[body].name, (double)x[ACROSS][0], (double)x[ACROSS][1],
                        (double)x[ACROSS][2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFibresByRule(SbMesh mesh, PetscInt body, PetscInt k, SbFibres f)
{
  uint64_t bit[SB_FIBRE_SURFACES] = {0};
  PetscInt count[SB_FIBRE_SURFACES] = {0};
  PetscInt lacking[3] = {0, 0, 0};
  PetscReal place[3][3] = {{0.}};
  PetscReal *u[4], *sum[4];
  Mat A;

  PetscFunctionBeginUser;
  for (int i = 0; i < SB_FIBRE_SURFACES && f->surface[i][0]; i++) {
    PetscCall(find_bit(mesh, f->surface[i], &bit[i]));
    for (PetscInt v = 0; v < mesh->nvert_owned; v++)
      count[i] += mesh->vert_body[v] == body && (mesh->vert_set[v] & bit[i]);
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, count, SB_FIBRE_SURFACES, MPIU_INT, MPI_SUM, mesh->comm));
  for (int i = 0; i < SB_FIBRE_SURFACES && f->surface[i][0]; i++)
    PetscCheck(count[i], mesh->comm, PETSC_ERR_USER_INPUT,
               "%s_surfaces: the set '%s' has no vertex of the body '%s'", f->option[0],
               f->surface[i], mesh->body[body].name);
  PetscCall(check_sets(mesh, body, bit, f));
  for (int p = 0; p < 4; p++)
    PetscCall(PetscCalloc2(mesh->nvert, &u[p], 3 * mesh->nvert, &sum[p]));
  PetscCall(create_matrix(mesh, body, &A));
  PetscCall(solve(mesh, body, A, bit[BASE], bit[APEX], u[0]));
  PetscCall(solve(mesh, body, A, bit[OUTER], bit[INNER] | bit[RIGHT], u[1]));
  PetscCall(solve(mesh, body, A, bit[INNER], bit[OUTER] | bit[RIGHT], u[2]));
  if (bit[RIGHT])
    PetscCall(solve(mesh, body, A, bit[RIGHT], bit[OUTER] | bit[INNER], u[3]));
  PetscCall(MatDestroy(&A));
  for (int p = 0; p < (bit[RIGHT] ? 4 : 3); p++)
    PetscCall(sum_gradients(mesh, body, u[p], sum[p]));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscInt *v = mesh->cell + 4 * c;
    PetscReal g[4][3], Q[9];
    PetscReal grad[4][3] = {{0.}};
    PetscReal mean[4] = {0.};
    PetscReal size = 0.;
    unsigned flat = 0;

    if (mesh->cell_body[c] != body || mesh->cell_material[c] != k)
      continue;
    const PetscReal V = gradients(mesh, c, g);
    for (int i = 0; i < 4; i++)
      size = PetscMax(size, PetscSqrtReal(SbDot3(g[i], g[i])));
    for (int p = 0; p < 4; p++) {
      PetscReal low = u[p][v[0]];
      PetscReal high = low;

      for (int i = 0; i < 4; i++) {
        low = PetscMin(low, u[p][v[i]]);
        high = PetscMax(high, u[p][v[i]]);
        mean[p] += u[p][v[i]] / 4.;
        for (int j = 0; j < 3; j++)
          grad[p][j] += u[p][v[i]] * g[i][j];
      }
      if (high - low > FLAT)
        continue;

      // of the tets around it, as long as the gradient of a change by 1 in this one
      for (int j = 0; j < 3; j++)
        grad[p][j] = (sum[p][3 * v[0] + j] + sum[p][3 * v[1] + j] + sum[p][3 * v[2] + j] +
                      sum[p][3 * v[3] + j]) /
                     V;
      if (SbDot3(grad[p], grad[p]) <= PetscSqr(FLAT * size))
        flat |= 1U << p;
    }
    const Lack lack =
      rule((const PetscReal(*)[3])grad, mean, f->angle, bit[RIGHT] ? flat : flat & 7U, Q);
    if (c < mesh->ncell_owned && !lacking[lack]++)
      SbCellCentre(mesh, c, place[lack]);
    for (int e = 0; e < 3; e++) {
      mesh->direction[6 * c + e] = Q[3 * e];
      mesh->direction[6 * c + 3 + e] = Q[3 * e + 2];
    }
  }
  for (int p = 0; p < 4; p++)
    PetscCall(PetscFree2(u[p], sum[p]));
  PetscCall(judge(mesh, body, f, lacking, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}
