/*
  The face terms of CR and DG: an interior penalty on the jump across a face.

  On a face F between cells + and -, with [u] the jump and [u]_0 its mean,

    W_F = 1/2 kappa1 int_F |[u]|^2 + 1/2 kappa0 |F| |[u]_0|^2,
    kappa1 = gamma1 H(2 mu |F| / V),   kappa0 = gamma0 H((2 mu + lambda) |F| / V)  (DG only),

  H(k) = 2 k+ k- / (k+ + k-) the harmonic mean of the two sides; for one material H(mu |F| / V) = mu
  / h with h = (V+ + V-) / (2 |F|) (Hansbo and Larson 2002). The terms act on displacements, are
  isotropic and constant within a step: they are invariant under rotations, and rigid motions have
  no jumps.

  A cell's function at vertex v is S - 3 u_v, S the sum of its four nodes and u_v the one opposite
  v. So the jump at the three vertices i of the face is J_i = (S+ - 3 u+_i) - (S- - 3 u-_i), and
  since J is linear there

    int_F |[u]|^2 = |F| / 12 (sum |J_i|^2 + |sum J_i|^2),   [u]_0 = sum J_i / 3,

  less the sum of less_i |J_i - J_(i + 1)|^2 between long or flat cells (face_shape.c).

  dW/dJ_i = c1 J_i + (c1 + c0) sum J,  c1 = kappa1 |F| / 12,  c0 = kappa0 |F| / 9, is distributed to
  the eight nodes by the transpose of this map. For CR both sides share the face's node, whose parts
  cancel.

  Under compression kappa1 with mu is too small. A law whose energy depends on det F, or on another
  non-convex function of F, has twist modes with a negative stiffness (P_i + P_j) / (s_i + s_j), P_i
  and s_i principal values of the first Piola stress and of F: under a hydrostatic pressure p it is
  mu - p. For continuous displacements the sum over the cells vanishes but for the boundary. In load
  steps the gaps around edges take the hydrostatic part beyond mu / SB_FOLLOW (edge_gap.c); the
  penalty balances the rest. So

    kappa1 = gamma1 H(2 m |F| / V),   m = max(mu, SB_FOLLOW max_ij -(P_i + P_j) / (s_i + s_j)),

  P less the part p cof F that the gaps have, evaluated at the start of the step, so that the terms
  are constant within a solve and their energy is quadratic. A dependence on the current state would
  have to be differentiated: jumps would add a spurious pressure. A load step is solved again, with
  m and the gaps of its end, until they have settled.

  A follower pressure on the body (src/effect/pressure.c) works on the volume of its cells with a
  part p of itself, -p dV: that part of the load has the second variation which the stress -p cof F
  lacks, and P_i is taken of P + p cof F.

  Between long or flat cells smooth bending has large slopes of the jump: of these the penalty keeps
  a part only (face_shape.c), another one of what it is at rest than of what stress adds to it. It
  bears the part `bears` of the stress then, and

    m = mu + max(0, SB_FOLLOW max_ij -(P_i + P_j) / (s_i + s_j) - bears mu).

  In time steps kappa1 is twice as large, and acts on [u] - r, with an offset r of the jump that
  keeps the energy of a face when kappa1 changes at the start of a step. With r = 0 every change of
  kappa1 would add 1/2 (kappa1' - kappa1) int |[u]|^2, and pressure waves would pump energy. [u] - r
  is parallel to [u], so that a body at rest has no force, with a factor between (kappa1 with m = mu
  / kappa1)^2 and one. The upper bound dissipates, the lower one adds little. Load steps, which may
  be long, have r = 0, so that their result depends on the loads alone; so has the start of a
  dynamic run from a given state. With Newmark, without damping, m never decreases: near nu = 1/2 it
  would change a hundredfold with each wave.

  A boundary face with a support node (layout.c): the other side is rigid and has the displacement
  of that node. H(k) is 2 k then; kappa1 = 0, because the support prescribes the mean only.
*/
#include "fem_impl.h"
#include "sbkernel.h"

#define RATE \
  2. /* further one in time steps: the secant of a growing penalty is about half its tangent */
#define LEAST \
  1e-3 /* sum of two stretches below which a cell counts as degenerate: no twist stiffness */
#define UNBORNE \
  2. /* new penalty over the old one from which that is too small for the stress, by up to \
        SB_FOLLOW */
#define SAME 1e-12 /* relative change that is rounding */

struct _p_SbJump {
  SbFace *face;       /* those with an owned node, in the order of batches and lanes */
  PetscReal *V;       /* [ncell] rest volume, m^3 */
  PetscReal *modulus; /* [ncell] SB_FOLLOW max_ij -(P_i + P_j) / (s_i + s_j), >= 0, Pa */
  PetscInt nface;
  uint8_t *slides;    /* [nbody] those without gaps around edges; NULL until a load step asks */
  SbEdgeGaps gaps;    /* NULL until a load step has a pressure that the penalty does not bear */
  PetscReal *tension; /* [ncell] mean of the gaps' tension at the cell's edges, Pa; NULL: no gaps on
                         any rank */
  PetscInt nbatch;
  PetscInt *body;   /* [nbatch] */
  PetscInt *n;      /* [nbatch] number of faces in the batch */
  PetscInt *node;   /* [nbatch][8][SB_BATCH] nodes; padding lanes repeat the first face */
  SbPack *c0, *c1;  /* [nbatch] factors above, N/m; zero in padding */
  SbPack *less;     /* [nbatch][3] of the slopes, N/m */
  SbSlopes *slopes; /* [nface] */
  PetscReal bears;  /* the smallest one of this rank's faces */
  SbPack *r; /* [nbatch][9] offsets of the jumps, m; NULL before kappa1 changes in a dynamic run */
  SbWalls walls;   /* facets on smooth walls */
  PetscBool began; /* the run has made time steps, or its checkpoint has */
  PetscBool renew; /* penalties restored from a checkpoint differ from those of the rest state */
  SbPack *
    share; /* [nbatch] fraction of a face's energy that this rank counts: 1, or 1/2 between ranks */
};

/* Nodes of a face: for each side that on the face, then those opposite its vertices, in the same
   order. */
static void face_nodes(SbSpace s, const SbFace *face, PetscInt node[8])
{
  const PetscInt plus = 4 * face->cell[0];
  const PetscInt minus = 4 * face->cell[1];

  for (PetscInt i = 0; i < 4; i++)
    node[i] = s->cell_node[plus + (face->face[0] + i) % 4];
  if (face->cell[1] == SB_SUPPORT) {
    for (int i = 4; i < 8; i++)
      node[i] = s->dirichlet_node[plus + face->face[0]];
    return;
  }
  node[4] = s->cell_node[minus + face->face[1]];
  for (PetscInt i = 1; i < 4; i++) {
    const PetscInt v = s->mesh->cell[plus + (face->face[0] + i) % 4];
    PetscInt b = 0;

    while (b < 3 && s->mesh->cell[minus + b] != v)
      b++;
    node[4 + i] = s->cell_node[minus + b];
  }
}

static inline PetscReal harmonic(PetscReal a, PetscReal b)
{
  return a + b > 0. ? 2. * a * b / (a + b) : 0.;
}

/* What a face's energy is made of: 1/2 of c1 (sum |J_i|^2 + |sum J_i|^2) - sum less_i |J_i - J_(i +
   1)|^2, and c0 |sum J_i|^2; N/m. */
typedef struct {
  PetscReal c0, c1, less[3];
} FaceTerms;

/* Those of a face that stress demands now. */
static FaceTerms face_terms(SbSpace s, SbJump j, const SbFace *face, const SbSlopes *slopes)
{
  const PetscInt *v = s->mesh->cell + 4 * face->cell[0];
  const PetscInt f = face->face[0];
  const PetscReal *x = s->mesh->x;
  const PetscReal *corner = x + 3 * v[(f + 1) % 4];
  const SbElement e = SbSpaceCellElement(s, face->cell[0]);
  PetscReal k0[2], k1[2], p[3], q[3], n[3], area;
  FaceTerms t = {0};

  SbSubtract(x + 3 * v[(f + 2) % 4], corner, p);
  SbSubtract(x + 3 * v[(f + 3) % 4], corner, q);
  SbCross(p, q, n);
  area = 0.5 * PetscSqrtReal(SbDot3(n, n));
  for (int side = 0; side < (face->cell[1] == SB_SUPPORT ? 1 : 2); side++) {
    const PetscInt cell = face->cell[side];
    const SbMaterial law = s->material[s->mesh->cell_material[cell]];
    const PetscReal mu = SbMaterialShearModulus(law);
    const PetscReal m = mu + PetscMax(0., j->modulus[cell] - slopes->bears * mu);

    k1[side] = 2. * m * area / j->V[cell];
    k0[side] = SbMaterialWaveModulus(law) * area / j->V[cell];
  }
  if (face->cell[1] == SB_SUPPORT) {
    t.c0 = e->gamma0 * 2. * k0[0] * area / 9.;
    return t;
  }
  t.c1 = e->gamma1 * harmonic(k1[0], k1[1]) * area / 12.;
  t.c0 = e->gamma0 * harmonic(k0[0], k0[1]) * area / 9.;
  SbSlopesLess(slopes, t.c1, t.less);
  return t;
}

/* Those in lane l of batch b. */
static FaceTerms get_terms(SbJump j, PetscInt b, PetscInt l)
{
  return (FaceTerms){
    j->c0[b][l], j->c1[b][l], {j->less[3 * b][l], j->less[3 * b + 1][l], j->less[3 * b + 2][l]}};
}

static void put_terms(SbJump j, PetscInt b, PetscInt l, const FaceTerms *t)
{
  j->c0[b][l] = t->c0;
  j->c1[b][l] = t->c1;
  for (int i = 0; i < 3; i++)
    j->less[3 * b + i][l] = t->less[i];
}

/* At rest, before stress has moduli. */
static void find_slopes(SbSpace s, SbJump j, const SbFace *face, SbSlopes *slopes)
{
  const int n = face->cell[1] == SB_SUPPORT ? 0 : 1;

  *slopes = SbFaceSlopes(s, face, (j->V[face->cell[0]] + j->V[face->cell[n]]) / 2.);
  slopes->rest = face_terms(s, j, face, slopes).c1;
  j->bears = PetscMin(j->bears, slopes->bears);
}

PetscErrorCode SbJumpCreate(SbSpace s, SbJump *jump)
{
  const SbMesh mesh = s->mesh;
  PetscInt nface = 0;
  PetscInt b = -1;
  SbJump j;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&j));
  PetscCall(PetscMalloc3(mesh->ncell, &j->V, mesh->ncell, &j->modulus, 4 * mesh->ncell, &j->face));
  for (PetscInt k = 0; k < s->nbatch; k++)
    for (PetscInt l = 0; l < s->batch_n[k]; l++)
      j->V[s->batch_cell[k] + l] = s->batch_V[k][l];
  for (PetscInt c = 0; c < mesh->ncell; c++)
    j->modulus[c] = 0.;

  /* list the faces with an owned node, sorted by body */
  for (PetscInt body = 0; body < mesh->nbody; body++) {
    for (PetscInt i = 0; i < 4 * mesh->ncell && SbElementHasFaces(s->element[body]); i++) {
      SbFace *face = &j->face[nface];
      const PetscBool supported = (PetscBool)(s->dirichlet_node && s->dirichlet_node[i] >= 0);
      PetscInt node[8];
      PetscInt f = 0;
      PetscBool owned = PETSC_FALSE;

      if (mesh->cell_body[i / 4] != body || (!supported && mesh->neighbour[i] < i / 4))
        continue;
      while (!supported && f < 3 && mesh->neighbour[4 * mesh->neighbour[i] + f] != i / 4)
        f++;
      *face = (SbFace){{i / 4, supported ? SB_SUPPORT : mesh->neighbour[i]}, {i % 4, f}};
      face_nodes(s, face, node);
      for (int k = 0; k < 8; k++)
        owned = (PetscBool)(owned || node[k] < s->nnode_owned);
      nface += owned;
    }
  }

  /* a batch has faces of one body: at most one more batch per body */
  j->nbatch = nface / SB_BATCH + mesh->nbody;
  PetscCall(
    PetscMalloc3(j->nbatch, &j->body, j->nbatch, &j->n, j->nbatch * 8 * SB_BATCH, &j->node));
  PetscCall(PetscCalloc3(j->nbatch, &j->c0, j->nbatch, &j->c1, j->nbatch, &j->share));
  PetscCall(PetscCalloc2(3 * j->nbatch, &j->less, nface, &j->slopes));
  j->bears = 1.;
  for (PetscInt i = 0; i < nface; i++) {
    const SbFace *face = &j->face[i];
    const PetscInt body = mesh->cell_body[face->cell[0]];
    PetscInt node[8], l;
    FaceTerms t;

    if (i == 0 || j->n[b] == SB_BATCH || body != j->body[b]) {
      j->body[++b] = body;
      j->n[b] = 0;
    }
    l = j->n[b]++;
    face_nodes(s, face, node);
    for (int k = 0; k < 8; k++)
      for (PetscInt lane = l; lane < (l ? l + 1 : SB_BATCH); lane++)
        j->node[(8 * b + k) * SB_BATCH + lane] = node[k];
    find_slopes(s, j, face, &j->slopes[i]);
    t = face_terms(s, j, face, &j->slopes[i]);
    put_terms(j, b, l, &t);
    for (int side = 0; side < 2; side++)
      j->share[b][l] +=
        face->cell[face->cell[1] == SB_SUPPORT ? 0 : side] < mesh->ncell_owned ? 0.5 : 0.;
  }
  j->nbatch = b + 1;
  j->nface = nface;
  *jump = j;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbJumpFindWalls(SbSpace s)
{
  const SbJump j = s->jump;

  PetscFunctionBeginUser;
  PetscCall(SbWallsFind(s, &j->walls));
  for (PetscInt w = 0; w < j->walls.n; w++) {
    SbWall *wall = &j->walls.wall[w];

    find_slopes(s, j, &wall->face, &wall->slopes);
    wall->c1 = wall->slopes.rest;
    SbSlopesLess(&wall->slopes, wall->c1, wall->less);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates the modulus of each cell of a batch from x: `factor` times the negative stiffness of
   twist modes under the pressure `even` of loads; keep: it may not decrease. */
static void follow_batch(SbSpace s, PetscInt b, const PetscReal x[], PetscReal even,
                         PetscReal factor, PetscBool keep)
{
  struct _p_SbMaterial own;
  const struct _p_SbMaterial *m =
    SbBatchLaw(s->batch_region[b], s->batch_region[b]->material, b, &own);
  const PetscReal *tension = s->jump->tension;
  const PetscReal borne = s->jump->bears * SbMaterialShearModulus(m) / factor;
  const PetscInt n = s->batch_n[b];
  PetscReal *modulus = s->jump->modulus + s->batch_cell[b];
  PetscReal largest = 0.;
  SbPack u[30], F[9], P[9], U[9], stretch[3], V[9];

  for (PetscInt l = 0; l < n && !keep; l++)
    modulus[l] = 0.;
  sb_gather_strain(s, b, x, u);
  SbCellGradient(s->batch_g + 9 * b, (const SbPack *)u, 1., F);
  m->ops.stress(m, (const SbPack *)F, P);
  if (s->batch_region[b]->history)
    SbViscousStress(s->batch_region[b], m, b, 0, (const SbPack *)F, P);
  if (s->batch_region[b]->contraction)
    SbActiveStress(s->batch_region[b], b, 0, (const SbPack *)F, P);
  for (PetscInt l = 0; l < n && (even != 0. || tension); l++) {
    const PetscReal less = tension ? tension[s->batch_cell[b] + l] : 0.;
    PetscReal one[9], cofactor[9];

    SbPackGet(9, (const SbPack *)F, (int)l, one);
    SbMatCofactor(one, cofactor);
    for (int k = 0; k < 9; k++)
      P[k][l] += (even - less) * cofactor[k];
  }

  /* skip most batches: sums of two principal stresses are at most sqrt(2) |P| */
  for (PetscInt l = 0; l < n; l++) {
    PetscReal square = 0.;

    for (int k = 0; k < 9; k++)
      square += P[k][l] * P[k][l];
    largest = PetscMax(largest, square);
  }
  if (largest < 0.5 * PetscSqr(borne))
    return;
  SbStretches((const SbPack *)F, U, stretch, V);
  for (PetscInt l = 0; l < n; l++) {
    PetscReal principal[3] = {0.}; /* principal stresses in the axes of F */

    for (int k = 0; k < 27; k++)
      principal[k % 3] += U[3 * (k / 9) + k % 3][l] * P[k / 3][l] * V[3 * (k / 3 % 3) + k % 3][l];
    for (int k = 0; k < 3; k++) {
      const PetscReal sum = stretch[k][l] + stretch[(k + 1) % 3][l];
      const PetscReal twist = sum > LEAST ? (principal[k] + principal[(k + 1) % 3]) / sum : 0.;

      modulus[l] = PetscMax(modulus[l], -factor * twist);
    }
  }
}

/* The offsets r of a batch; zero for damping, which acts on velocities. */
static const SbPack *left_out(SbJump j, PetscInt b, SbJumpFactor factor)
{
  static const SbPack nothing[9];

  return factor == SB_JUMP_STIFFNESS && j->r ? (const SbPack *)(j->r + 9 * b) : nothing;
}

/* Jumps at the three vertices less offsets r, J[3 i + c], and the sum of the jumps. */
SB_INLINE void gather_jumps(const PetscInt node[8 * SB_BATCH], const PetscReal x[],
                            const SbPack r[9], int l, PetscReal J[9], PetscReal sum[3])
{
  for (int c = 0; c < 3; c++) {
    PetscReal u[8], S;

    for (int k = 0; k < 8; k++)
      u[k] = x[3 * node[k * SB_BATCH + l] + c];
    S = (u[0] - u[4]) + (u[1] - u[5]) + (u[2] - u[6]) + (u[3] - u[7]);
    for (int i = 0; i < 3; i++)
      J[3 * i + c] = S - 3. * (u[1 + i] - u[5 + i]) - r[3 * i + c][l];
    sum[c] = 3. * (u[0] - u[4]);
  }
}

/* Twice the energy of jumps J, but for c0, J. */
static PetscReal penalty_of(const FaceTerms *t, const PetscReal J[9])
{
  PetscReal square = 0.;
  PetscReal spared = 0.;

  for (int k = 0; k < 9; k++) {
    square += J[k] * J[k];
    spared += t->less[k / 3] * PetscSqr(J[k] - J[(k + 3) % 9]);
  }
  for (int k = 0; k < 3; k++)
    square += PetscSqr(J[k] + J[3 + k] + J[6 + k]);
  return t->c1 * square - spared;
}

/* Projection coefficient of J - r on the jumps J of a face at x, by the energy; >= 0, 1 for J =
   0. */
static PetscReal held_part(SbJump j, PetscInt b, PetscInt l, const PetscReal x[], PetscReal J[9])
{
  static const SbPack zero[9];
  const SbPack *r = left_out(j, b, SB_JUMP_STIFFNESS);
  PetscReal sum[3];
  PetscReal square = 0.;
  PetscReal along = 0.;

  gather_jumps(j->node + 8 * SB_BATCH * b, x, zero, (int)l, J, sum);
  for (int c = 0; c < 3; c++) {
    PetscReal held = 0.;

    sum[c] = J[c] + J[3 + c] + J[6 + c];
    for (int k = c; k < 9; k += 3) {
      const PetscReal here = J[k] - r[k][l];

      square += J[k] * J[k];
      along += here * J[k];
      held += here;
    }
    square += sum[c] * sum[c];
    along += held * sum[c];
  }
  return square > 0. ? PetscMax(along / square, 0.) : 1.;
}

/* The same of a wall. */
static PetscReal held_part_of_wall(SbSpace s, const SbWall *wall, const PetscReal x[],
                                   PetscReal J[3])
{
  PetscReal square = 0.;
  PetscReal along = 0.;

  SbWallJumps(s, wall, x, SB_JUMP_STIFFNESS, J);
  for (int i = 0; i < 3; i++) {
    square += J[i] * J[i];
    along += (J[i] - wall->r[i]) * J[i];
  }
  return square > 0. ? PetscMax(along / square, 0.) : 1.;
}

/* The stress that a penalty bears, as a penalty between round cells. */
static PetscReal borne_by(const SbSlopes *slopes, PetscReal c1)
{
  return c1 - (1. - slopes->bears) * PetscMin(c1, slopes->rest);
}

/* By how much new penalties change the energy of this rank's jumps at x, J, face by face. unborne:
   some are so much larger that the old ones do not bear the stress. */
static PetscReal change_of_energy(SbSpace s, const PetscReal x[], PetscBool *unborne)
{
  const SbJump j = s->jump;
  PetscReal change = 0.;

  for (PetscInt b = 0, i = 0; b < j->nbatch; b++) {
    for (PetscInt l = 0; l < j->n[b]; l++, i++) {
      static const SbPack zero[9];
      const FaceTerms old = get_terms(j, b, l);
      const FaceTerms new = face_terms(s, j, &j->face[i], &j->slopes[i]);
      PetscReal J[9], sum[3];

      gather_jumps(j->node + 8 * SB_BATCH * b, x, zero, (int)l, J, sum);
      change += 0.5 * j->share[b][l] * PetscAbsReal(penalty_of(&new, J) - penalty_of(&old, J));
      if (borne_by(&j->slopes[i], new.c1) > UNBORNE * borne_by(&j->slopes[i], old.c1))
        *unborne = PETSC_TRUE;
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    const SbWall *wall = &j->walls.wall[w];
    const FaceTerms new = face_terms(s, j, &wall->face, &wall->slopes);
    PetscReal J[3];

    SbWallJumps(s, wall, x, SB_JUMP_STIFFNESS, J);
    change += wall->share * PetscAbsReal(SbWallPenalty(new.c1, new.less, J) -
                                         SbWallPenalty(wall->c1, wall->less, J));
  }
  return change;
}

/* Part of its jumps that a face keeps with a new penalty, so that it keeps its energy or, in the
   first step, its force. part: kept before; the energies of the jumps with the old penalty, the new
   one and that at rest. */
static PetscReal new_part(PetscReal part, PetscReal old, PetscReal new, PetscReal rest,
                          PetscBool first)
{
  const PetscReal kept = new > 0. ? old / new : 1.;
  const PetscReal least = new > 0. ? rest / new : 1.;

  return PetscClipInterval(part * (first ? kept : PetscSqrtReal(kept)), PetscSqr(least), 1.);
}

/* Updates the penalties. keep: the faces' energies at x are kept or, first, their forces; else r =
   0. */
static PetscErrorCode renew(SbSpace s, const PetscReal x[], PetscBool keep, PetscBool first)
{
  const SbJump j = s->jump;
  PetscReal J[9];

  PetscFunctionBeginUser;
  if (keep && !j->r)
    PetscCall(PetscCalloc1(9 * j->nbatch, &j->r));
  for (PetscInt b = 0, i = 0; b < j->nbatch; b++) {
    for (PetscInt l = 0; l < j->n[b]; l++, i++) {
      const SbSlopes *slopes = &j->slopes[i];
      const FaceTerms old = get_terms(j, b, l);
      const FaceTerms new = face_terms(s, j, &j->face[i], slopes);
      FaceTerms rest = {.c1 = slopes->rest};
      PetscReal part, held;

      put_terms(j, b, l, &new);
      if (!keep || new.c1 == 0.)
        continue;
      part = held_part(j, b, l, x, J);
      SbSlopesLess(slopes, rest.c1, rest.less);
      held = new_part(part, penalty_of(&old, J), penalty_of(&new, J), penalty_of(&rest, J), first);
      for (int k = 0; k < 9; k++)
        j->r[9 * b + k][l] = (1. - held) * J[k];
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    SbWall *wall = &j->walls.wall[w];
    const FaceTerms new = face_terms(s, j, &wall->face, &wall->slopes);
    const PetscReal part = held_part_of_wall(s, wall, x, J);
    const PetscReal old = SbWallPenalty(wall->c1, wall->less, J);
    PetscReal less[3], held;

    wall->c1 = new.c1;
    PetscCall(PetscArraycpy(wall->less, new.less, 3));
    if (!keep)
      continue;
    SbSlopesLess(&wall->slopes, wall->slopes.rest, less);
    held = new_part(part, old, SbWallPenalty(new.c1, new.less, J),
                    SbWallPenalty(wall->slopes.rest, less, J), first);
    for (int k = 0; k < 3; k++)
      wall->r[k] = (1. - held) * J[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether stress demands other penalties than this rank's faces have. */
static PetscBool differ(SbSpace s)
{
  const SbJump j = s->jump;
  PetscBool any = PETSC_FALSE;

  for (PetscInt b = 0, i = 0; b < j->nbatch; b++)
    for (PetscInt l = 0; l < j->n[b]; l++, i++)
      if (face_terms(s, j, &j->face[i], &j->slopes[i]).c1 != j->c1[b][l])
        any = PETSC_TRUE;
  for (PetscInt w = 0; w < j->walls.n; w++) {
    const SbWall *wall = &j->walls.wall[w];

    if (face_terms(s, j, &wall->face, &wall->slopes).c1 != wall->c1)
      any = PETSC_TRUE;
  }
  return any;
}

PetscErrorCode SbSpaceWarnShapes(SbSpace s)
{
  PetscFunctionBeginUser;
  if (s->jump)
    PetscCall(SbFacesWarn(s, s->jump->nface, s->jump->face, s->jump->V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor c1 of a face whose jumps have an energy; once, twice: theirs with c1 at rest and twice
   that. */
static PetscReal factor_of(const SbSlopes *slopes, PetscReal energy, PetscReal once,
                           PetscReal twice)
{
  if (energy <= once)
    return slopes->rest * energy / once;
  return slopes->rest * (1. + (energy - once) / (twice - once));
}

/* The factor c1 with which a face without offsets would have its energy at x, or its own one. */
static PetscReal face_factor(SbJump j, PetscInt b, PetscInt l, const SbSlopes *slopes,
                             const PetscReal x[])
{
  const FaceTerms now = get_terms(j, b, l);
  FaceTerms rest[2];
  PetscReal J[9], part, energy[2];

  part = held_part(j, b, l, x, J);
  for (int k = 0; k < 2; k++) {
    rest[k].c1 = (1. + k) * slopes->rest;
    SbSlopesLess(slopes, rest[k].c1, rest[k].less);
    energy[k] = penalty_of(&rest[k], J);
  }
  if (energy[0] <= 0. || energy[1] <= energy[0])
    return now.c1;
  return factor_of(slopes, PetscSqr(part) * penalty_of(&now, J), energy[0], energy[1]);
}

/* The same of a wall. */
static PetscReal wall_factor(SbSpace s, const SbWall *wall, const PetscReal x[])
{
  const SbSlopes *slopes = &wall->slopes;
  PetscReal J[3], less[3], part, energy[2];

  part = held_part_of_wall(s, wall, x, J);
  for (int k = 0; k < 2; k++) {
    SbSlopesLess(slopes, (1. + k) * slopes->rest, less);
    energy[k] = SbWallPenalty((1. + k) * slopes->rest, less, J);
  }
  if (energy[0] <= 0. || energy[1] <= energy[0])
    return wall->c1;
  return factor_of(slopes, PetscSqr(part) * SbWallPenalty(wall->c1, wall->less, J), energy[0],
                   energy[1]);
}

PetscErrorCode SbSpaceGetJumps(SbSpace s, Vec U, PetscReal k[])
{
  const SbJump j = s->jump;
  const PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &x));
  for (PetscInt i = 0; i < 5 * s->mesh->ncell_owned; i++)
    k[i] = i % 5 == 4 ? j->modulus[i / 5] : 0.;
  for (PetscInt b = 0, i = 0; b < j->nbatch; b++) {
    for (PetscInt l = 0; l < j->n[b]; l++, i++) {
      for (int side = 0; side < (j->face[i].cell[1] == SB_SUPPORT ? 1 : 2); side++) {
        const PetscInt cell = j->face[i].cell[side];

        if (cell < s->mesh->ncell_owned)
          k[5 * cell + j->face[i].face[side]] = face_factor(j, b, l, &j->slopes[i], x);
      }
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    const SbWall *wall = &j->walls.wall[w];

    if (wall->share > 0.)
      k[5 * wall->face.cell[0] + wall->face.face[0]] = wall_factor(s, wall, x);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceSetJumps(SbSpace s, const PetscReal own[])
{
  const SbJump j = s->jump;
  PetscReal *k;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(5 * s->mesh->ncell, &k));
  PetscCall(PetscArraycpy(k, own, 5 * s->mesh->ncell_owned));
  PetscCall(SbForestBroadcast(s->mesh->cell_sf, 5, MPIU_REAL, k, k));
  for (PetscInt b = 0, i = 0; b < j->nbatch; b++) {
    for (PetscInt l = 0; l < j->n[b]; l++, i++) {
      const SbFace *face = &j->face[i];
      const PetscReal before = j->c1[b][l];
      FaceTerms t = {.c0 = j->c0[b][l]};

      if (face->cell[1] == SB_SUPPORT)
        continue;

      /* the owner of a cell may not have each of its faces */
      t.c1 = PetscMax(k[5 * face->cell[0] + face->face[0]], k[5 * face->cell[1] + face->face[1]]);
      SbSlopesLess(&j->slopes[i], t.c1, t.less);
      put_terms(j, b, l, &t);
      if (PetscAbsReal(t.c1 - before) > SAME * before)
        j->renew = PETSC_TRUE;
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    SbWall *wall = &j->walls.wall[w];
    const PetscReal before = wall->c1;
    const PetscReal saved = k[5 * wall->face.cell[0] + wall->face.face[0]];

    /* 0: of a state whose walls had no penalty */
    wall->c1 = saved > 0. ? saved : before;
    SbSlopesLess(&wall->slopes, wall->c1, wall->less);
    if (PetscAbsReal(wall->c1 - before) > SAME * before)
      j->renew = PETSC_TRUE;
  }
  for (PetscInt c = 0; c < s->mesh->ncell; c++)
    j->modulus[c] = k[5 * c + 4];
  j->began = PETSC_TRUE;
  PetscCall(PetscFree(k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool is_in_time(SbStepsOf steps)
{
  return (PetscBool)(steps == SB_STEPS_IN_TIME || steps == SB_STEPS_UNDAMPED);
}

/* Updates the moduli of the penalty from x. Returns whether that changes a penalty, or faces have
   offsets r. */
static PetscBool follow(SbSpace s, const PetscReal x[], const PetscReal even[], SbStepsOf steps)
{
  const PetscReal factor = is_in_time(steps) ? RATE * SB_FOLLOW : SB_FOLLOW;
  const PetscBool any = (PetscBool)(s->jump->renew || (is_in_time(steps) && s->jump->r));

  s->jump->renew = PETSC_FALSE;
  for (PetscInt b = 0; b < s->nbatch; b++) {
    if (!SbElementHasFaces(s->batch_region[b]->element) || s->batch_region[b]->material->linear)
      continue;
    follow_batch(s, b, x, even ? even[s->batch_region[b]->body] : 0., factor,
                 (PetscBool)(steps == SB_STEPS_UNDAMPED));
  }
  return (PetscBool)(any || differ(s));
}

/* Index of the block of a row and a column in the part q of the plan. */
static inline PetscInt block_of(SbPlan p, int q, PetscInt row, PetscInt column)
{
  const PetscInt *j = q ? p->oj : p->dj;
  PetscInt at = (q ? p->oi : p->di)[row];

  while (j[at] != column)
    at++;
  return at;
}

PetscErrorCode SbJumpSumTerms(SbSpace s)
{
  const SbPlan p = s->plan;
  const SbEdgeGaps gaps = s->jump->gaps;
  const SbWalls *walls = &s->jump->walls;
  const PetscInt *nodes;
  const PetscInt nbatch = SbJumpCliques(s, &nodes);

  PetscFunctionBeginUser;
  if (gaps && !p->edge_term[0])
    PetscCall(PetscMalloc2(6 * (size_t)p->di[s->nnode_owned], &p->edge_term[0],
                           6 * (size_t)p->oi[s->nnode_owned], &p->edge_term[1]));
  if (walls->n && !p->wall_term[0])
    PetscCall(PetscMalloc2(3 * (size_t)p->di[s->nnode_owned], &p->wall_term[0],
                           3 * (size_t)p->oi[s->nnode_owned], &p->wall_term[1]));
  for (int q = 0; q < 2; q++) {
    const PetscInt n = (q ? p->oi : p->di)[s->nnode_owned];

    PetscCall(PetscArrayzero(p->face_term[q], n));
    if (gaps)
      PetscCall(PetscArrayzero(p->edge_term[q], 6 * n));
    if (walls->n)
      PetscCall(PetscArrayzero(p->wall_term[q], 3 * n));
  }
  for (PetscInt b = 0; b < nbatch; b++) {
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      const PetscInt *node = nodes + (size_t)b * 8 * SB_BATCH + l;
      PetscReal K[8][8];
      PetscReal v[4][4][3];

      SbJumpMatrix(s, b, l, K);
      if (K[0][0] == 0.)
        continue; // padding lanes are zero
      if (gaps)
        SbEdgeGapsMatrix(gaps, b, l, v);
      for (int k = 0; k < 64; k++) {
        const PetscInt row = node[k / 8 * SB_BATCH];
        const PetscInt column = node[k % 8 * SB_BATCH];
        const int q = column >= s->nnode_owned;
        PetscInt at;

        if (row >= s->nnode_owned)
          continue;
        at = block_of(p, q, row, column);
        p->face_term[q][at] += K[k / 8][k % 8];

        /* (v x)^T = -v x */
        for (int c = 0; gaps && k / 32 != k % 8 / 4 && c < 3; c++)
          p->edge_term[q][6 * at + c] += k / 32 ? -v[k % 8][k / 8 - 4][c] : v[k / 8][k % 8 - 4][c];
      }
    }
  }
  for (PetscInt w = 0; w < walls->n; w++) {
    const SbWall *wall = &walls->wall[w];
    PetscReal K[3][3];

    SbWallMatrix(wall, K);
    for (int k = 0; k < 9; k++) {
      const PetscInt row = wall->node[k / 3];
      const PetscInt column = wall->node[k % 3];
      const int q = column >= s->nnode_owned;

      if (row < s->nnode_owned)
        p->wall_term[q][3 * block_of(p, q, row, column) + wall->axis] += K[k / 3][k % 3];
    }
  }
  for (PetscInt i = 0; gaps && i < SbEdgeGapsMirrors(gaps); i++) {
    PetscReal v[4][4][3];
    const PetscInt *node = SbEdgeGapsMirrorMatrix(gaps, i, v);

    for (int k = 0; k < 16; k++) {
      const int q = node[k % 4] >= s->nnode_owned;
      PetscInt at;

      if (node[k / 4] >= s->nnode_owned)
        continue;
      at = block_of(p, q, node[k / 4], node[k % 4]);
      for (int c = 0; c < 3; c++)
        p->edge_term[q][6 * at + 3 + c] += v[k / 4][k % 4][c];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds tensions of the gaps around edges from x, where a rank has pressures that the penalty does
   not bear. The owner of a cell knows all cells around its edges. Collective. */
static PetscErrorCode follow_gaps(SbSpace s, const PetscReal x[], const PetscReal even[],
                                  SbGapsChange *change)
{
  const SbJump j = s->jump;
  const SbFaceBatches faces = {j->nface, j->nbatch, j->face, j->n, j->node};
  PetscBool needed;

  PetscFunctionBeginUser;
  if (!j->slides) {
    PetscCall(PetscCalloc1(s->mesh->nbody, &j->slides));
    PetscCall(SbEdgeGapsFindSliding(s, j->slides));
  }
  needed = (PetscBool)(j->gaps || SbEdgeGapsNeeded(s, j->slides, x, even));
  if (needed && !j->gaps)
    PetscCall(SbEdgeGapsCreate(s, &faces, j->slides, &j->gaps));
  if (j->gaps)
    PetscCall(SbEdgeGapsFollow(s, j->gaps, x, even, change));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &needed, 1, SB_MPI_BOOL, MPI_LOR, s->comm));
  if (!needed)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!j->tension)
    PetscCall(PetscCalloc1(s->mesh->ncell, &j->tension));
  for (PetscInt c = 0; j->gaps && c < s->mesh->ncell_owned; c++)
    j->tension[c] = SbEdgeGapsTension(j->gaps, c);
  PetscCall(SbForestBroadcast(s->mesh->cell_sf, 1, MPIU_REAL, j->tension, j->tension));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceFollowJumps(SbSpace s, Vec U, const PetscReal even[], SbStepsOf steps,
                                  PetscReal enough, PetscBool *changed)
{
  const PetscBool in_time = is_in_time(steps);
  const SbJump j = s->jump;
  const PetscReal *x;
  SbGapsChange change = {0};
  PetscBool any, first;

  PetscFunctionBeginUser;
  if (changed)
    *changed = PETSC_FALSE;
  if (!s->jump || s->linear)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(s, U, &x));

  /* the initial state of a dynamic run has the forces of a load step */
  first = (PetscBool)(in_time && !s->jump->began);
  if (in_time)
    s->jump->began = PETSC_TRUE;
  if (first && follow(s, x, even, SB_STEPS_OF_LOAD))
    PetscCall(renew(s, x, PETSC_FALSE, PETSC_FALSE));
  if (!in_time)
    PetscCall(follow_gaps(s, x, even, &change));
  any = (PetscBool)(follow(s, x, even, steps) || change.differ);
  if (changed && in_time)
    PetscCallMPI(MPI_Allreduce(&any, changed, 1, SB_MPI_BOOL, MPI_LOR, s->comm));

  /* the equilibrium at the end of a load step keeps its penalties if new ones would change little:
     an even state has no jumps and their energy does not change, but it may be unstable */
  if (changed && !in_time) {
    change.energy += any ? change_of_energy(s, x, &change.unborne) : 0.;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &change.energy, 1, MPIU_REAL, MPI_SUM, s->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &change.unborne, 1, SB_MPI_BOOL, MPI_LOR, s->comm));
    *changed = (PetscBool)(change.energy > enough || change.unborne);
    if (steps == SB_STEPS_FAILED) {
      PetscReal sum[3] = {change.even[0], change.even[1], (PetscReal)j->walls.n};

      /* the states of other failed solves say nothing: tensions of bent bodies err by far more */
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPI_SUM, s->comm));
      *changed = (PetscBool)(sum[2] > 0. && PetscAbsReal(sum[0]) > sum[1]);
    }
    s->jump->renew = (PetscBool)(any && !*changed);
    any = (PetscBool)(any && *changed);
  }
  if (any)
    PetscCall(renew(s, x, in_time, first));
  if (any && j->gaps)
    SbEdgeGapsRenew(j->gaps);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &x));
  if (s->plan && any)
    PetscCall(SbJumpSumTerms(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbJumpDestroy(SbJump *jump)
{
  SbJump j = *jump;

  PetscFunctionBeginUser;
  if (!j)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree3(j->V, j->modulus, j->face));
  PetscCall(PetscFree3(j->body, j->n, j->node));
  PetscCall(PetscFree3(j->c0, j->c1, j->share));
  PetscCall(PetscFree2(j->less, j->slopes));
  PetscCall(PetscFree(j->r));
  PetscCall(PetscFree(j->tension));
  PetscCall(PetscFree(j->slides));
  PetscCall(PetscFree(j->walls.wall));
  PetscCall(SbEdgeGapsDestroy(&j->gaps));
  PetscCall(PetscFree(*jump));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* t[4][3] of each lane: forces on the nodes of the first side, from jumps minus r. */
SB_KERNEL static void jump_forces(const PetscInt node[restrict 8 * SB_BATCH],
                                  const PetscReal c0[restrict SB_BATCH],
                                  const PetscReal c1[restrict SB_BATCH],
                                  const SbPack less[restrict 3], const SbPack r[restrict 9],
                                  const PetscReal x[restrict], SbPack t[restrict 12])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal J[9], sum[3];

    gather_jumps(node, x, r, l, J, sum);
    for (int c = 0; c < 3; c++) {
      const PetscReal common = c1[l] * (J[c] + J[3 + c] + J[6 + c]) + c0[l] * sum[c];
      const PetscReal d0 = less[0][l] * (J[c] - J[3 + c]);
      const PetscReal d1 = less[1][l] * (J[3 + c] - J[6 + c]);
      const PetscReal d2 = less[2][l] * (J[6 + c] - J[c]);
      const PetscReal t0 = c1[l] * J[c] + common - (d0 - d2);
      const PetscReal t1 = c1[l] * J[3 + c] + common - (d1 - d0);
      const PetscReal t2 = c1[l] * J[6 + c] + common - (d2 - d1);
      const PetscReal all = t0 + t1 + t2;

      t[c][l] = all;
      t[3 + c][l] = all - 3. * t0;
      t[6 + c][l] = all - 3. * t1;
      t[9 + c][l] = all - 3. * t2;
    }
  }
}

void SbJumpAdd(SbSpace s, const PetscReal x[], SbJumpFactor factor, PetscReal f[])
{
  const SbJump j = s->jump;

  for (PetscInt b = 0; b < j->nbatch; b++) {
    const PetscInt *node = j->node + 8 * SB_BATCH * b;
    const PetscReal scale = factor == SB_JUMP_STIFFNESS ? 1. : s->beta[j->body[b]];
    SbPack t[12];

    if (scale == 0.)
      continue;
    jump_forces(node, j->c0[b], j->c1[b], (const SbPack *)(j->less + 3 * b), left_out(j, b, factor),
                x, t);
    for (PetscInt l = 0; l < j->n[b]; l++) {
      for (int k = 0; k < 4; k++) {
        PetscReal *plus = f + 3 * node[k * SB_BATCH + l];
        PetscReal *minus = f + 3 * node[(4 + k) * SB_BATCH + l];

        for (int c = 0; c < 3; c++) {
          plus[c] += scale * t[3 * k + c][l];
          minus[c] -= scale * t[3 * k + c][l];
        }
      }
    }
  }
  SbWallsAdd(s, &j->walls, x, factor, f);
  if (j->gaps && factor == SB_JUMP_STIFFNESS)
    SbEdgeGapsAdd(s, j->gaps, x, f);
}

PetscReal SbJumpEnergy(SbSpace s, const PetscReal x[], SbJumpFactor factor, PetscReal body[])
{
  const SbJump j = s->jump;
  PetscReal energy = 0.;

  for (PetscInt b = 0; b < j->nbatch; b++) {
    const PetscReal scale = factor == SB_JUMP_STIFFNESS ? 1. : s->beta[j->body[b]];
    const PetscReal before = energy;
    const SbPack *r = left_out(j, b, factor);

    for (int l = 0; l < j->n[b] && scale != 0.; l++) {
      const FaceTerms t = get_terms(j, b, l);
      PetscReal J[9], sum[3];

      gather_jumps(j->node + 8 * SB_BATCH * b, x, r, l, J, sum);
      energy += 0.5 * scale * j->share[b][l] * (penalty_of(&t, J) + t.c0 * SbDot3(sum, sum));
      if (j->gaps && factor == SB_JUMP_STIFFNESS)
        energy += j->share[b][l] * SbEdgeGapsEnergy(s, j->gaps, x, b, l);
    }
    if (body)
      body[j->body[b]] += energy - before;
  }
  energy += SbWallsEnergy(s, &j->walls, x, factor, body);
  if (j->gaps && factor == SB_JUMP_STIFFNESS)
    energy += SbEdgeGapsMirrorEnergy(s, j->gaps, x, body);
  return energy;
}

PetscInt SbJumpCliques(SbSpace s, const PetscInt **node)
{
  *node = s->jump->node;
  return s->jump->nbatch;
}

/* Entry (a, b) of the 8x8 matrix of a face, sum_i (d_ia d_ib c1 - less_i (d_i - d_(i + 1))_a (d_i -
   d_(i + 1))_b) + (c1 + c0) D_a D_b. */
void SbJumpMatrix(SbSpace s, PetscInt b, PetscInt l, PetscReal K[8][8])
{
  static const PetscReal d[3][4] = {{1, -2, 1, 1}, {1, 1, -2, 1}, {1, 1, 1, -2}};
  static const PetscReal D[4] = {3, 0, 0, 0};
  const FaceTerms t = get_terms(s->jump, b, l);

  for (int p = 0; p < 8; p++) {
    for (int q = 0; q < 8; q++) {
      const PetscReal sign = p / 4 == q / 4 ? 1. : -1.;
      PetscReal sum = (t.c1 + t.c0) * D[p % 4] * D[q % 4];

      for (int i = 0; i < 3; i++) {
        const PetscReal *a = d[i];
        const PetscReal *c = d[(i + 1) % 3];

        sum += t.c1 * a[p % 4] * a[q % 4];
        sum -= t.less[i] * (a[p % 4] - c[p % 4]) * (a[q % 4] - c[q % 4]);
      }
      K[p][q] = sign * sum;
    }
  }
}
