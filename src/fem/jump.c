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

    int_F |[u]|^2 = |F| / 12 (sum |J_i|^2 + |sum J_i|^2),   [u]_0 = sum J_i / 3.

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
#define NEEDLE 3.8 /* 1 for the narrowest face of a cube cut into six tets */
#define LONG 1.9   /* length over width of cells beyond which a run warns */
#define FLAT 2.5   /* width over height, likewise: meshes of gmsh have tets of up to 2 */
#define MANY 0.1   /* part of the tets of a body, likewise: few slivers do no harm */
#define UNBORNE \
  2. /* new penalty over the old one from which that is too small for the stress, by up to \
        SB_FOLLOW */
#define EQUAL 1e-9 /* relative difference of aspects that are the same */
#define SAME 1e-12 /* relative change that is rounding */

struct _p_SbJump {
  SbFace *face;       /* those with an owned node, in the order of batches and lanes */
  PetscReal *V;       /* [ncell] rest volume, m^3 */
  PetscReal *modulus; /* [ncell] modulus m above, Pa */
  PetscInt nface;
  uint8_t *slides;    /* [nbody] those without gaps around edges; NULL until a load step asks */
  SbEdgeGaps gaps;    /* NULL until a load step has a pressure that the penalty does not bear */
  PetscReal *tension; /* [ncell] mean of the gaps' tension at the cell's edges, Pa; NULL: no gaps on
                         any rank */
  PetscInt nbatch;
  PetscInt *body;  /* [nbatch] */
  PetscInt *n;     /* [nbatch] number of faces in the batch */
  PetscInt *node;  /* [nbatch][8][SB_BATCH] nodes; padding lanes repeat the first face */
  SbPack *c0, *c1; /* [nbatch] factors above, N/m; zero in padding */
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

/* c0 and c1 of a face; `rest`: with m = mu. */
static void face_factors(SbSpace s, SbJump j, const SbFace *face, PetscBool rest, PetscReal *c0,
                         PetscReal *c1)
{
  const PetscInt *v = s->mesh->cell + 4 * face->cell[0];
  const PetscInt f = face->face[0];
  const PetscReal *x = s->mesh->x;
  const PetscReal *corner = x + 3 * v[(f + 1) % 4];
  const SbElement e = SbSpaceCellElement(s, face->cell[0]);
  PetscReal k0[2], k1[2], p[3], q[3], n[3], area;

  SbSubtract(x + 3 * v[(f + 2) % 4], corner, p);
  SbSubtract(x + 3 * v[(f + 3) % 4], corner, q);
  SbCross(p, q, n);
  area = 0.5 * PetscSqrtReal(SbDot3(n, n));
  for (int side = 0; side < (face->cell[1] == SB_SUPPORT ? 1 : 2); side++) {
    const PetscInt cell = face->cell[side];
    const SbMaterial law = s->material[s->mesh->cell_material[cell]];

    k1[side] = 2. * (rest ? SbMaterialShearModulus(law) : j->modulus[cell]) * area / j->V[cell];
    k0[side] = SbMaterialWaveModulus(law) * area / j->V[cell];
  }
  if (face->cell[1] == SB_SUPPORT) {
    *c1 = 0.;
    *c0 = e->gamma0 * 2. * k0[0] * area / 9.;
  } else {
    *c1 = e->gamma1 * harmonic(k1[0], k1[1]) * area / 12.;
    *c0 = e->gamma0 * harmonic(k0[0], k0[1]) * area / 9.;
  }
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
    j->modulus[c] = SbMaterialShearModulus(s->material[mesh->cell_material[c]]);

  /* list the faces with an owned node, sorted by body */
  for (PetscInt body = 0; body < mesh->nbody; body++) {
    for (PetscInt i = 0; i < 4 * mesh->ncell && !s->element[body]->nodes_per[0]; i++) {
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
  for (PetscInt i = 0; i < nface; i++) {
    const SbFace *face = &j->face[i];
    const PetscInt body = mesh->cell_body[face->cell[0]];
    PetscInt node[8], l;

    if (i == 0 || j->n[b] == SB_BATCH || body != j->body[b]) {
      j->body[++b] = body;
      j->n[b] = 0;
    }
    l = j->n[b]++;
    face_nodes(s, face, node);
    for (int k = 0; k < 8; k++)
      for (PetscInt lane = l; lane < (l ? l + 1 : SB_BATCH); lane++)
        j->node[(8 * b + k) * SB_BATCH + lane] = node[k];
    face_factors(s, j, face, PETSC_TRUE, &j->c0[b][l], &j->c1[b][l]);
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
  PetscReal c0;

  PetscFunctionBeginUser;
  PetscCall(SbWallsFind(s, &j->walls));
  for (PetscInt w = 0; w < j->walls.n; w++)
    face_factors(s, j, &j->walls.wall[w].face, PETSC_TRUE, &c0, &j->walls.wall[w].c1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates the modulus m of each cell of a batch from x: at least `factor` times the negative
   stiffness of twist modes under the pressure `even` of loads; keep: m may not decrease. Returns
   whether some m changed. */
static PetscBool follow_batch(SbSpace s, PetscInt b, const PetscReal x[], PetscReal even,
                              PetscReal factor, PetscBool keep)
{
  const SbMaterial m = s->batch_region[b]->material;
  const PetscReal *tension = s->jump->tension;
  const PetscReal mu = SbMaterialShearModulus(m);
  const PetscInt n = s->batch_n[b];
  PetscReal *modulus = s->jump->modulus + s->batch_cell[b];
  PetscReal before[SB_BATCH];
  PetscReal largest = 0.;
  PetscBool changed = PETSC_FALSE;
  SbPack u[30], F[9], P[9], U[9], stretch[3], V[9];

  for (PetscInt l = 0; l < n; l++) {
    before[l] = modulus[l];
    if (!keep)
      modulus[l] = mu;
  }
  sb_gather_strain(s, b, x, u);
  SbCellGradient(s->batch_g + 9 * b, (const SbPack *)u, 1., F);
  m->ops.stress(m, (const SbPack *)F, P);
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
  if (largest >= 0.5 * PetscSqr(mu / factor))
    SbStretches((const SbPack *)F, U, stretch, V);
  for (PetscInt l = 0; l < n && largest >= 0.5 * PetscSqr(mu / factor); l++) {
    PetscReal principal[3] = {0.}; /* principal stresses in the axes of F */

    for (int k = 0; k < 27; k++)
      principal[k % 3] += U[3 * (k / 9) + k % 3][l] * P[k / 3][l] * V[3 * (k / 3 % 3) + k % 3][l];
    for (int k = 0; k < 3; k++) {
      const PetscReal sum = stretch[k][l] + stretch[(k + 1) % 3][l];
      const PetscReal twist = sum > LEAST ? (principal[k] + principal[(k + 1) % 3]) / sum : 0.;

      modulus[l] = PetscMax(modulus[l], -factor * twist);
    }
  }
  for (PetscInt l = 0; l < n; l++)
    changed = (PetscBool)(changed || modulus[l] != before[l]);
  return changed;
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

/* |J|^2 + |sum J|^2 of J less r. */
static PetscReal squares_of(const PetscReal J[9])
{
  PetscReal squares = 0.;

  for (int k = 0; k < 9; k++)
    squares += J[k] * J[k];
  for (int k = 0; k < 3; k++)
    squares += PetscSqr(J[k] + J[3 + k] + J[6 + k]);
  return squares;
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
  const PetscReal square = SbWallJumps(s, wall, x, SB_JUMP_STIFFNESS, J);
  PetscReal along = 0.;

  for (int i = 0; i < 3; i++)
    along += (J[i] - wall->r[i]) * J[i];
  return square > 0. ? PetscMax(along / square, 0.) : 1.;
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
      PetscReal J[9], sum[3], c0, c1;

      gather_jumps(j->node + 8 * SB_BATCH * b, x, zero, (int)l, J, sum);
      face_factors(s, j, &j->face[i], PETSC_FALSE, &c0, &c1);
      change += 0.5 * j->share[b][l] * PetscAbsReal(c1 - j->c1[b][l]) * squares_of(J);
      *unborne = (PetscBool)(*unborne || c1 > UNBORNE * j->c1[b][l]);
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    const SbWall *wall = &j->walls.wall[w];
    PetscReal J[3], c0, c1;

    face_factors(s, j, &wall->face, PETSC_FALSE, &c0, &c1);
    change +=
      wall->share * PetscAbsReal(c1 - wall->c1) * SbWallJumps(s, wall, x, SB_JUMP_STIFFNESS, J);
  }
  return change;
}

/* Part of its jumps that a face keeps with a new penalty, so that it keeps its energy or, in the
   first step, its force. part: kept before; kept: its old penalty over the new one; least: that at
   rest over the new one. */
static PetscReal new_part(PetscReal part, PetscReal kept, PetscReal least, PetscBool first)
{
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
      const PetscReal before = j->c1[b][l];
      const PetscReal part = keep ? held_part(j, b, l, x, J) : 1.;
      PetscReal c0, least, held;

      face_factors(s, j, &j->face[i], PETSC_FALSE, &j->c0[b][l], &j->c1[b][l]);
      if (!keep || j->c1[b][l] == 0.)
        continue;

      face_factors(s, j, &j->face[i], PETSC_TRUE, &c0, &least);
      held = new_part(part, before / j->c1[b][l], least / j->c1[b][l], first);
      for (int k = 0; k < 9; k++)
        j->r[9 * b + k][l] = (1. - held) * J[k];
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    SbWall *wall = &j->walls.wall[w];
    const PetscReal before = wall->c1;
    const PetscReal part = keep ? held_part_of_wall(s, wall, x, J) : 1.;
    PetscReal c0, least, held;

    face_factors(s, j, &wall->face, PETSC_FALSE, &c0, &wall->c1);
    if (!keep)
      continue;
    face_factors(s, j, &wall->face, PETSC_TRUE, &c0, &least);
    held = new_part(part, before / wall->c1, least / wall->c1, first);
    for (int k = 0; k < 3; k++)
      wall->r[k] = (1. - held) * J[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A face as its sides see it. */
typedef struct {
  PetscReal area;        /* m^2 */
  PetscReal length[2];   /* of the face over its width or the height of the cell */
  PetscReal flatness[2]; /* the shorter extent of the face over the height of the cell */
} FaceShape;

static FaceShape face_shape(SbSpace s, SbJump j, const SbFace *face)
{
  const PetscInt *v = s->mesh->cell + 4 * face->cell[0];
  const PetscInt f = face->face[0];
  const PetscReal *x = s->mesh->x;
  const PetscReal *corner = x + 3 * v[(f + 1) % 4];
  PetscReal p[3], q[3], r[3], n[3], trace, largest;
  FaceShape shape;

  SbSubtract(x + 3 * v[(f + 2) % 4], corner, p);
  SbSubtract(x + 3 * v[(f + 3) % 4], corner, q);
  SbSubtract(p, q, r);
  SbCross(p, q, n);
  shape.area = 0.5 * PetscSqrtReal(SbDot3(n, n));

  /* eigenvalues of the mean of (x - centroid) (x - centroid)^T: their product is area^2 / 108 */
  trace = (SbDot3(p, p) + SbDot3(q, q) + SbDot3(r, r)) / 36.;
  largest =
    trace / 2. + PetscSqrtReal(PetscMax(0., PetscSqr(trace / 2.) - PetscSqr(shape.area) / 108.));
  for (int side = 0; side < (face->cell[1] == SB_SUPPORT ? 1 : 2); side++) {
    const PetscReal h = 3. * j->V[face->cell[side]] / shape.area;
    const PetscReal square = PetscMax(NEEDLE * (trace - largest), PetscSqr(h) / 12.) / largest;

    shape.length[side] = 1. / PetscSqrtReal(square);
    shape.flatness[side] = PetscSqrtReal(12. * (trace - largest)) / h;
  }
  return shape;
}

/* Length over width, width over height of the cells of a box whose tets have such faces; by a fit
   to boxes of 1 to 20, right to 3 %. */
static void aspects_of(const FaceShape *shape, int side, PetscReal aspect[2])
{
  aspect[0] = PetscSqrtReal(PetscMax(PetscSqr(shape->length[side]) - 0.64, 0.) / 0.352);
  aspect[1] = PetscSqrtReal(PetscMax(PetscSqr(shape->flatness[side]) - 0.5, 0.) / 0.335);
}

/* By how much bars or plates with two and four such cells across bend too little, percent;
   measured, docs/reports/locking.md. The last row for all beyond. */
static void cost_of(PetscReal aspect, PetscBool flat, PetscReal percent[2])
{
  static const PetscReal at[7] = {1., 1.5, 2., 3., 4., 6., 10.};
  static const PetscReal of_long[7][2] = {{3., 2.},   {13., 5.},  {24., 9.}, {45., 19.},
                                          {59., 30.}, {77., 49.}, {90., 74.}};
  static const PetscReal of_flat[7][2] = {{3., 2.},   {10., 5.},  {18., 8.}, {34., 15.},
                                          {48., 24.}, {67., 41.}, {84., 65.}};
  int k = 0;

  while (k < 5 && aspect > at[k + 1])
    k++;
  for (int n = 0; n < 2; n++) {
    const PetscReal from = flat ? of_flat[k][n] : of_long[k][n];
    const PetscReal to = flat ? of_flat[k + 1][n] : of_long[k + 1][n];

    percent[n] =
      from + (to - from) * PetscClipInterval((aspect - at[k]) / (at[k + 1] - at[k]), 0., 1.);
  }
}

/* The tet that is farthest out of range, flat or long, of a body; of equal ones that with the
   lowest number. */
typedef struct {
  PetscReal excess;    /* aspect over the largest one that is verified */
  PetscReal aspect[2]; /* of length and width, of width and height */
  PetscReal place[3];  /* its centroid, m */
  PetscInt orig;
} WorstShape;

/* The worst of all ranks. */
static PetscErrorCode reduce_worst(SbSpace s, WorstShape *worst)
{
  PetscReal most = worst->excess;
  PetscInt orig;
  PetscMPIInt has;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, s->comm));
  orig = worst->excess > most * (1. - EQUAL) ? worst->orig : PETSC_MAX_INT;
  has = orig == PETSC_MAX_INT ? -1 : s->rank;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &orig, 1, MPIU_INT, MPI_MIN, s->comm));
  has = orig == worst->orig ? has : -1;
  PetscCallMPI(MPI_Allreduce(&has, &rank, 1, MPI_INT, MPI_MAX, s->comm));
  PetscCallMPI(MPI_Bcast(worst->aspect, 5, MPIU_REAL, rank, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceWarnShapes(SbSpace s)
{
  const SbJump j = s->jump;
  const SbMesh mesh = s->mesh;
  WorstShape *worst; /* [nbody] */
  PetscInt *count;   /* [nbody][2] tets out of range, tets */
  uint8_t *out;      /* [ncell] */

  PetscFunctionBeginUser;
  if (!j)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc3(mesh->nbody, &worst, 2 * mesh->nbody, &count, mesh->ncell, &out));
  for (PetscInt b = 0, i = 0; b < j->nbatch; b++) {
    for (PetscInt l = 0; l < j->n[b]; l++, i++) {
      const FaceShape shape = face_shape(s, j, &j->face[i]);

      for (int side = 0; side < (j->face[i].cell[1] == SB_SUPPORT ? 1 : 2); side++) {
        const PetscInt cell = j->face[i].cell[side];
        WorstShape *most = &worst[j->body[b]];
        PetscReal aspect[2], excess;

        aspects_of(&shape, side, aspect);
        excess = PetscMax(aspect[0] / LONG, aspect[1] / FLAT);
        if (excess > 1.)
          out[cell] = 1;
        if (excess < most->excess * (1. - EQUAL) ||
            (excess < most->excess * (1. + EQUAL) && mesh->cell_orig[cell] >= most->orig))
          continue;
        *most = (WorstShape){excess, {aspect[0], aspect[1]}, {0.}, mesh->cell_orig[cell]};
        for (int k = 0; k < 12; k++)
          most->place[k % 3] += 0.25 * mesh->x[3 * mesh->cell[4 * cell + k / 3] + k % 3];
      }
    }
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    count[2 * mesh->cell_body[c]] += out[c];
    count[2 * mesh->cell_body[c] + 1]++;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)(2 * mesh->nbody), MPIU_INT, MPI_SUM, s->comm));
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    PetscReal percent[2];
    PetscBool flat;

    if ((PetscReal)count[2 * b] <= MANY * (PetscReal)count[2 * b + 1])
      continue;
    PetscCall(reduce_worst(s, &worst[b]));
    flat = (PetscBool)(worst[b].aspect[1] / FLAT > worst[b].aspect[0] / LONG);
    cost_of(worst[b].aspect[flat], flat, percent);
    PetscCall(SbWarning(
      s->comm,
      "body %s, element %s: %" PetscInt_FMT " of %" PetscInt_FMT
      " tets are long or flat, the worst one at (%.4g, %.4g, %.4g) m as in cells %.2g times as %s: "
      "%s of such cells bend too little, by %.0f %% with two cells across and by %.0f %% with "
      "four. Take p2, or rounder tets (docs/reports/locking.md)",
      mesh->body[b].name, s->element[b]->name, count[2 * b], count[2 * b + 1],
      (double)worst[b].place[0], (double)worst[b].place[1], (double)worst[b].place[2],
      (double)worst[b].aspect[flat], flat ? "wide as high" : "long as wide",
      flat ? "plates" : "bars", (double)percent[0], (double)percent[1]));
  }
  PetscCall(PetscFree3(worst, count, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceGetJumps(SbSpace s, Vec U, PetscReal k[])
{
  const SbJump j = s->jump;
  const PetscReal *x;
  PetscReal J[9];

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &x));
  for (PetscInt i = 0; i < 5 * s->mesh->ncell_owned; i++)
    k[i] = i % 5 == 4 ? j->modulus[i / 5] : 0.;
  for (PetscInt b = 0, i = 0; b < j->nbatch; b++) {
    for (PetscInt l = 0; l < j->n[b]; l++, i++) {
      for (int side = 0; side < (j->face[i].cell[1] == SB_SUPPORT ? 1 : 2); side++) {
        const PetscInt cell = j->face[i].cell[side];

        if (cell < s->mesh->ncell_owned)
          k[5 * cell + j->face[i].face[side]] = j->c1[b][l] * PetscSqr(held_part(j, b, l, x, J));
      }
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    const SbWall *wall = &j->walls.wall[w];

    if (wall->share > 0.)
      k[5 * wall->face.cell[0] + wall->face.face[0]] =
        wall->c1 * PetscSqr(held_part_of_wall(s, wall, x, J));
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

      if (face->cell[1] == SB_SUPPORT)
        continue;

      /* the owner of a cell may not have each of its faces */
      j->c1[b][l] =
        PetscMax(k[5 * face->cell[0] + face->face[0]], k[5 * face->cell[1] + face->face[1]]);
      if (PetscAbsReal(j->c1[b][l] - before) > SAME * before)
        j->renew = PETSC_TRUE;
    }
  }
  for (PetscInt w = 0; w < j->walls.n; w++) {
    SbWall *wall = &j->walls.wall[w];
    const PetscReal before = wall->c1;
    const PetscReal saved = k[5 * wall->face.cell[0] + wall->face.face[0]];

    /* 0: of a state whose walls had no penalty */
    wall->c1 = saved > 0. ? saved : before;
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

/* Updates the moduli m of the penalty from x. Returns whether one changed, or faces have offsets
   r. */
static PetscBool follow(SbSpace s, const PetscReal x[], const PetscReal even[], SbStepsOf steps)
{
  const PetscReal factor = is_in_time(steps) ? RATE * SB_FOLLOW : SB_FOLLOW;
  PetscBool any = (PetscBool)(s->jump->renew || (is_in_time(steps) && s->jump->r));

  s->jump->renew = PETSC_FALSE;
  for (PetscInt b = 0; b < s->nbatch; b++) {
    if (s->batch_region[b]->element->nodes_per[0] || s->batch_region[b]->material->linear)
      continue;
    if (follow_batch(s, b, x, even ? even[s->batch_region[b]->body] : 0., factor,
                     (PetscBool)(steps == SB_STEPS_UNDAMPED)))
      any = PETSC_TRUE;
  }
  return any;
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
                                  const PetscReal c1[restrict SB_BATCH], const SbPack r[restrict 9],
                                  const PetscReal x[restrict], SbPack t[restrict 12])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal J[9], sum[3];

    gather_jumps(node, x, r, l, J, sum);
    for (int c = 0; c < 3; c++) {
      const PetscReal common = c1[l] * (J[c] + J[3 + c] + J[6 + c]) + c0[l] * sum[c];
      const PetscReal t0 = c1[l] * J[c] + common;
      const PetscReal t1 = c1[l] * J[3 + c] + common;
      const PetscReal t2 = c1[l] * J[6 + c] + common;
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
    jump_forces(node, j->c0[b], j->c1[b], left_out(j, b, factor), x, t);
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
      PetscReal J[9], sum[3];

      gather_jumps(j->node + 8 * SB_BATCH * b, x, r, l, J, sum);
      energy += 0.5 * scale * j->share[b][l] *
                (j->c1[b][l] * squares_of(J) + j->c0[b][l] * SbDot3(sum, sum));
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

/* Entry (a, b) of the 8x8 matrix of a face, sum_i d_ia d_ib c1 + (c1 + c0) D_a D_b. */
void SbJumpMatrix(SbSpace s, PetscInt b, PetscInt l, PetscReal K[8][8])
{
  static const PetscReal d[3][4] = {{1, -2, 1, 1}, {1, 1, -2, 1}, {1, 1, 1, -2}};
  static const PetscReal D[4] = {3, 0, 0, 0};
  const PetscReal c1 = s->jump->c1[b][l];
  const PetscReal c0 = s->jump->c0[b][l];

  for (int p = 0; p < 8; p++) {
    for (int q = 0; q < 8; q++) {
      const PetscReal sign = p / 4 == q / 4 ? 1. : -1.;
      PetscReal sum = (c1 + c0) * D[p % 4] * D[q % 4];

      for (int i = 0; i < 3; i++)
        sum += c1 * d[i][p % 4] * d[i][q % 4];
      K[p][q] = sign * sum;
    }
  }
}
