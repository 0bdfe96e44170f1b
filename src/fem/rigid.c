/*
  Rigid bodies: the nodes of a body that moves as a whole, and how much it is strained.

  The motion of all points of a rigid body is affine, x = c + F (X - C), and follows from that of
  four points. For any distribution of mass M, with centre C and second moments S = integral of rho
  (X - C) (X - C)^T, four points of mass M/4 at

    X_a = C + L s_a,    L L^T = S / M,    s_a = (1, 1, 1), (1, -1, -1), (-1, -1, 1), (-1, 1, -1)

  have the same mass, centre and moments, as the sum of s_a s_a^T is four times the identity: in any
  affine motion they have the same energy, momentum and angular momentum as the body. They are its
  nodes. A point of the body has the weights w_a = (1 + s_a . L^-1 (X - C)) / 4 of them, a fixed
  linear combination, so that what acts on vertices of P1 (loads, contact, collision detection)
  acts on a rigid body as it is.

  Its energy V mu |E|^2, E = (F^T F - I) / 2, of a stiff Saint Venant-Kirchhoff law without
  Poisson's ratio, keeps F a rotation but for a small strain: affine body dynamics, with kappa |F^T
  F - I|^2, kappa = mu / 4 (Lan, Kaufman, Li, Jiang and Yang, ACM TOG 41(4), 2022). Each cell has
  its part V_c of it. All cells of a body are on one rank (mesh/partition.c), and no rank has ghosts
  of them.

  A body that spins begins with the stretch that the stress of its spin needs, or it would vibrate
  about that without end where the integrator does not damp. With the angular velocity w, the
  positions r about the centre and w' of Euler's equations I w' = -w x I w, the acceleration of a
  rigid body without moments is A r, A = [w']x + [w]x [w]x, and its stress -A S / V, which is
  symmetric.
*/
#include "fem_impl.h"
#include "sbkernel.h"

#define NODES 4
#define STRAINED 1e-6 /* largest strain, and rate of strain over that of rotation, at the start */

/* The directions of the nodes, in the order of a tet of positive volume. */
static const PetscReal direction[NODES][3] = {
  {1., 1., 1.}, {1., -1., -1.}, {-1., -1., 1.}, {-1., 1., -1.}};

/* Centre C, m, and the Cholesky factor L of the second moments over the mass, m: lower triangle. */
typedef struct {
  PetscReal C[3], L[3][3];
} Moments;

static PetscErrorCode find_moments(SbSpace s, PetscInt body, Moments *m)
{
  const SbMesh mesh = s->mesh;
  const PetscReal *origin = mesh->x + 3 * mesh->cell[4 * s->rigid_first[body]];
  PetscReal V = 0.;
  PetscReal first[3] = {0.};
  PetscReal S[3][3] = {{0.}};

  PetscFunctionBeginUser;

  // integrals of 1, x and x x^T, x from a vertex: of a tet V, V mean and V / 20 (sum of x x^T + sum
  // of x times its transpose)
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    PetscReal x[4][3], volume;
    PetscReal sum[3] = {0.};

    if (mesh->cell_body[c] != body)
      continue;
    for (int a = 0; a < 4; a++) {
      SbSubtract(mesh->x + 3 * mesh->cell[4 * c + a], origin, x[a]);
      for (int i = 0; i < 3; i++)
        sum[i] += x[a][i];
    }
    volume = SbTetDeterminant(mesh->x, mesh->cell + 4 * c) / 6.;
    V += volume;
    for (int i = 0; i < 3; i++) {
      first[i] += volume * sum[i] / 4.;
      for (int k = 0; k <= i; k++) {
        S[i][k] += volume / 20. * sum[i] * sum[k];
        for (int a = 0; a < 4; a++)
          S[i][k] += volume / 20. * x[a][i] * x[a][k];
      }
    }
  }

  // about the centre, over the mass
  for (int i = 0; i < 3; i++) {
    m->C[i] = origin[i] + first[i] / V;
    for (int k = 0; k <= i; k++)
      S[i][k] = (S[i][k] - first[i] * first[k] / V) / V;
  }
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++)
      m->L[i][k] = 0.;
    for (int k = 0; k <= i; k++) {
      PetscReal rest = S[i][k];

      for (int j = 0; j < k; j++)
        rest -= m->L[i][j] * m->L[k][j];
      PetscCheck(
        i != k || rest > 0., PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
        "-body_%s_rigid: the moments of inertia of the body are zero within rounding; it is "
        "flat, or a line",
        mesh->body[body].name);
      m->L[i][k] = i == k ? PetscSqrtReal(rest) : rest / m->L[k][k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRigidCreate(SbSpace s)
{
  const SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    s->rigid = (PetscBool)(s->rigid || s->element[b]->rigid);
  if (!s->rigid)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(mesh->nbody, &s->rigid_first));
  PetscCall(PetscCalloc1(mesh->nvert + 1, &s->rigid_basis));
  for (PetscInt b = 0; b < mesh->nbody; b++)
    s->rigid_first[b] = -1;
  for (PetscInt c = mesh->ncell - 1; c >= 0; c--)
    if (SbSpaceCellElement(s, c)->rigid)
      s->rigid_first[mesh->cell_body[c]] = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRigidDescribe(SbSpace s)
{
  const SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; s->rigid && b < mesh->nbody; b++) {
    const PetscInt *node;
    PetscInt lowest = PETSC_MAX_INT;
    uint64_t all = ~(uint64_t)0;
    Moments m;

    if (s->rigid_first[b] < 0)
      continue;
    node = s->cell_node + 4 * s->rigid_first[b];
    PetscCall(find_moments(s, b, &m));

    // the nodes are in the sets that hold the whole surface
    for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
      if (mesh->cell_body[i / 4] != b)
        continue;
      lowest = PetscMin(lowest, mesh->cell_orig[i / 4]);
      for (int k = 0; k < 3 && (mesh->face_set[i] & SB_ON_BOUNDARY); k++)
        all &= mesh->vert_set[mesh->cell[4 * (i / 4) + SbFaceVertex[i % 4][k]]];
    }
    for (int a = 0; a < NODES; a++) {
      s->node_body[node[a]] = b;
      s->node_set[node[a]] = all & ~SB_ON_BOUNDARY;
      s->node_orig[node[a]] = mesh->Nvert + 4 * lowest + a;
      for (int i = 0; i < 3; i++) {
        PetscReal *x = &s->node_x[3 * node[a] + i];

        *x = m.C[i];
        for (int k = 0; k <= i; k++)
          *x += m.L[i][k] * direction[a][k];
      }
    }

    // weights at the vertices: y = L^-1 (X - C)
    for (PetscInt v = 0; v < mesh->nvert; v++) {
      PetscReal y[3];

      if (mesh->vert_body[v] != b)
        continue;
      SbSubtract(mesh->x + 3 * v, m.C, y);
      for (int i = 0; i < 3; i++) {
        for (int k = 0; k < i; k++)
          y[i] -= m.L[i][k] * y[k];
        y[i] /= m.L[i][i];
      }
      for (int a = 0; a < NODES; a++)
        s->rigid_basis[v][a] = (1. + SbDot3(direction[a], y)) / 4.;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRigidDestroy(SbSpace s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(s->rigid_first));
  PetscCall(PetscFree(s->rigid_basis));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* G = one I + sum_a u_a grad w_a^T of a body. */
static void gradient(SbSpace s, PetscInt body, const PetscReal u[], PetscReal one, PetscReal G[9])
{
  const PetscInt *node = s->cell_node + 4 * s->rigid_first[body];
  PetscReal x[4][3], g[3][3], V;

  for (int k = 0; k < 12; k++)
    x[k / 3][k % 3] = s->node_x[3 * node[k / 3] + k % 3];
  s->element[body]->ops.tabulate((const PetscReal(*)[3])x, g, &V);
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      G[3 * i + j] = i == j ? one : 0.;
      for (int a = 1; a < NODES; a++)
        G[3 * i + j] += (u[3 * node[a] + i] - u[3 * node[0] + i]) * g[a - 1][j];
    }
  }
}

/* |E| of a deformation gradient F. */
static PetscReal strain(const PetscReal F[9])
{
  PetscReal C[9];

  SbMatTransposeMul(F, F, C);
  for (int i = 0; i < 3; i++)
    C[4 * i] -= 1.;
  return 0.5 * PetscSqrtReal(SbDot9(C, C));
}

PetscReal SbSpaceRigidStrain(SbSpace s, const PetscReal u[], PetscInt *body)
{
  PetscReal most = 0.;

  *body = -1;
  for (PetscInt b = 0; s->rigid && b < s->mesh->nbody; b++) {
    PetscReal F[9], here;

    if (s->rigid_first[b] < 0)
      continue;
    gradient(s, b, u, 1., F);
    here = strain(F);
    if (*body < 0 || here > most) {
      most = here;
      *body = b;
    }
  }
  return most;
}

/* B = [w]x */
static void cross_matrix(const PetscReal w[3], PetscReal B[9])
{
  const PetscReal b[9] = {0., -w[2], w[1], w[2], 0., -w[0], -w[1], w[0], 0.};

  for (int k = 0; k < 9; k++)
    B[k] = b[k];
}

/* The angular velocity w of a rigid body at u, with the velocities v (NULL: none). Errors: u or v
   strains it. */
static PetscErrorCode find_spin(SbSpace s, PetscInt body, const PetscReal u[], const PetscReal v[],
                                PetscReal w[3])
{
  const char *name = s->mesh->body[body].name;
  PetscReal F[9], D[9], H[9], W[9];

  PetscFunctionBeginUser;
  w[0] = w[1] = w[2] = 0.;
  gradient(s, body, u, 1., F);
  PetscCheck(strain(F) <= STRAINED, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "-body_%s_displacement: it strains the rigid body by %.3g; give a translation, and "
             "turn the body by -body_%s_rotate",
             name, (double)strain(F), name);
  if (!v)
    PetscFunctionReturn(PETSC_SUCCESS);

  // H = dv/dx = dv/dX F^T of a rotation F; what is not skew would strain the body
  gradient(s, body, v, 0., D);
  SbMatMulTranspose(D, F, H);
  w[0] = 0.5 * (H[7] - H[5]);
  w[1] = 0.5 * (H[2] - H[6]);
  w[2] = 0.5 * (H[3] - H[1]);
  cross_matrix(w, W);
  for (int k = 0; k < 9; k++)
    D[k] = H[k] - W[k];
  PetscCheck(SbDot9(D, D) <= PetscSqr(2. * STRAINED) * SbDot9(H, H), PETSC_COMM_SELF,
             PETSC_ERR_USER_INPUT,
             "-body_%s_velocity: these formulas strain the rigid body; give a translation, and "
             "-body_%s_angular_velocity",
             name, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u += the stretch of a spin w. */
static void add_stretch(SbSpace s, PetscInt body, const PetscReal w[3], PetscReal u[])
{
  const PetscInt *node = s->cell_node + 4 * s->rigid_first[body];
  const PetscReal modulus =
    2. * SbMaterialShearModulus(s->material[body]) * s->mesh->body[body].volume;
  PetscReal r[NODES][3], inertia[9], cofactor[9], W[9], A[9], T[9], momentum[3], torque[3], dw[3];
  PetscReal centre[3] = {0.};
  PetscReal S[9] = {0.};

  // positions about the centre, second moments S, inertia tr(S) 1 - S
  for (int k = 0; k < 3 * NODES; k++)
    centre[k % 3] += (s->node_x[3 * node[k / 3] + k % 3] + u[3 * node[k / 3] + k % 3]) / NODES;
  for (int a = 0; a < NODES; a++) {
    for (int i = 0; i < 3; i++)
      r[a][i] = s->node_x[3 * node[a] + i] + u[3 * node[a] + i] - centre[i];
    for (int k = 0; k < 9; k++)
      S[k] += s->node_mass[node[a]] * r[a][k / 3] * r[a][k % 3];
  }
  for (int k = 0; k < 9; k++)
    inertia[k] = (k % 4 ? 0. : S[0] + S[4] + S[8]) - S[k];

  // Euler's equations
  SbMatCofactor(inertia, cofactor);
  for (int i = 0; i < 3; i++)
    momentum[i] = SbDot3(inertia + 3 * i, w);
  SbCross(momentum, w, torque);
  for (int i = 0; i < 3; i++)
    dw[i] = SbDot3(cofactor + 3 * i, torque) / SbMatDet(inertia);

  // the stress -A S / V, and the strain that has it
  cross_matrix(w, W);
  SbMatMul(W, W, A);
  cross_matrix(dw, W);
  for (int k = 0; k < 9; k++)
    A[k] += W[k];
  SbMatMul(A, S, T);
  for (int a = 0; a < NODES; a++)
    for (int k = 0; k < 9; k++)
      u[3 * node[a] + k / 3] -= 0.5 * (T[k] + T[3 * (k % 3) + k / 3]) / modulus * r[a][k % 3];
}

PetscErrorCode SbSpaceRigidStart(SbSpace s, PetscReal u[], const PetscReal v[])
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; s->rigid && b < s->mesh->nbody; b++) {
    PetscBool held = PETSC_FALSE;
    PetscReal w[3];

    if (s->rigid_first[b] < 0)
      continue;
    for (int a = 0; a < NODES; a++)
      held = (PetscBool)(held || s->fixed[s->cell_node[4 * s->rigid_first[b] + a]]);
    if (held)
      continue;
    PetscCall(find_spin(s, b, u, v, w));
    if (SbDot3(w, w) > 0.)
      add_stretch(s, b, w, u);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
