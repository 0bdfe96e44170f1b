/*
  Long and flat cells as their faces see them: the part of the penalty on jumps that a slope of the
  jump keeps (jump.c), and the warning of cells beyond those that are verified.

  Between long cells smooth bending has slopes of the jump as large as the curvature times the
  length, and the penalty on them must not cost more than the strain that the bending causes. A face
  has the extents a >= b, a^2 / 12 and b^2 / 12 the eigenvalues of the mean of (x - c) (x - c)^T,
  and its cells the height h across it. A curvature k of the fibres along a costs, of the penalty mu
  / h, mu / h |F| k^2 a^4, and k^2 a^2 b^2 of the slope across; it causes the energy mu k^2 e^2 h
  |F|, e the extent in whose direction it bends. So, with H = h, but at least b and at most a, the
  slopes keep the parts

    at rest    (H b / a^2)^2 along,  (H / a)^2 across,
    by stress  (H / a)^2     along,  1         across:

  the latter are what it takes to bear a stress, as the twist of a cell against its neighbours has
  slopes of a times the angle in the volume h |F|. The penalty at rest bears (b / a)^2 of what it
  does between round cells.

  Faces of flat cells, h < b, keep (h / b)^2 of all this: bending has slopes of k a across the face,
  which cost a^2 / h^2 times as much as it causes even so, and changes of strain through the height
  have slopes of k h in it, which cost as much as they cause.

  b and h are those of the face times what makes them a for the faces of cubes cut into six tets,
  which keep all.

  The energy 1/2 kappa tr(G A G^T), A = |F| times the means above with their parts, G the gradient
  of the jump in the face, is 1/2 sum_ij J_i . J_j g_i . A g_j with the jumps J at the corners and
  g_i the gradients of the barycentric coordinates: 1/2 sum_(i < j) w_ij |J_i - J_j|^2, w_ij = -g_i
  . A g_j. Where slopes keep all, w_ij = kappa |F| / 36.
*/
#include "fem_impl.h"
#include "sbkernel.h"

#define WIDTH 1.9494 /* b of the narrowest face of a cube cut into six tets, to a */
#define HEIGHT 1.78  /* H of its flattest tets, likewise */
#define MANY 0.1     /* part of the tets of a body, likewise: few slivers do no harm */
#define EQUAL 1e-9   /* relative difference of aspects that are the same */

/* Length over width and width over height of cells beyond which a run warns: of the linear law, and
   of others, whose columns of longer cells fold where they are pressed by a fifth. */
static const PetscReal verified[2][2] = {{10.5, 6.5}, {2.4, 2.5}};

/* A face in a frame of its own. */
typedef struct {
  PetscReal area;         /* m^2 */
  PetscReal side[3][2];   /* from the next corner to the one before, m */
  PetscReal mean[3];      /* of (x - c) (x - c)^T: 00, 01, 11, m^2 */
  PetscReal large, small; /* its eigenvalues: their product is area^2 / 108 */
} FaceShape;

static FaceShape face_shape(SbSpace s, const SbFace *face)
{
  const PetscInt *v = s->mesh->cell + 4 * face->cell[0];
  const PetscReal *corner[3];
  PetscReal side[3][3], n[3], e[3], f[3], trace, root;
  FaceShape shape = {0};

  for (int i = 0; i < 3; i++)
    corner[i] = s->mesh->x + 3 * v[(face->face[0] + 1 + i) % 4];
  for (int i = 0; i < 3; i++)
    SbSubtract(corner[(i + 2) % 3], corner[(i + 1) % 3], side[i]);
  SbCross(side[0], side[1], n);
  shape.area = 0.5 * SbNormalise(n);
  for (int k = 0; k < 3; k++)
    e[k] = side[0][k];
  (void)SbNormalise(e);
  SbCross(n, e, f);
  for (int i = 0; i < 3; i++) {
    PetscReal *at = shape.side[i];

    at[0] = SbDot3(side[i], e);
    at[1] = SbDot3(side[i], f);
    shape.mean[0] += at[0] * at[0] / 36.;
    shape.mean[1] += at[0] * at[1] / 36.;
    shape.mean[2] += at[1] * at[1] / 36.;
  }
  trace = (shape.mean[0] + shape.mean[2]) / 2.;
  root = PetscSqrtReal(PetscSqr((shape.mean[0] - shape.mean[2]) / 2.) + PetscSqr(shape.mean[1]));
  shape.large = trace + root;
  shape.small = PetscMin(shape.large, PetscSqr(shape.area) / (108. * shape.large));
  return shape;
}

/* What slopes are spared: 1/3 less the weight of a pair of corners, for parts along and across. */
static void spare(const FaceShape *shape, PetscReal along, PetscReal across, PetscReal spared[3])
{
  const PetscReal split = shape->large - shape->small;
  const PetscReal *M = shape->mean;
  PetscReal A[3];

  /* E = (M - small) / split projects on the long axis; M = large E + small (1 - E) */
  for (int k = 0; k < 3; k++) {
    const PetscReal one = k == 1 ? 0. : 1.;
    const PetscReal E = split > 0. ? (M[k] - one * shape->small) / split : one / 2.;

    A[k] = along * shape->large * E + across * shape->small * (one - E);
  }
  for (int i = 0; i < 3; i++) {
    const PetscReal *p = shape->side[i];
    const PetscReal *q = shape->side[(i + 1) % 3];
    const PetscReal dot =
      p[1] * q[1] * A[0] - (p[1] * q[0] + p[0] * q[1]) * A[1] + p[0] * q[0] * A[2];

    spared[i] = 1. / 3. + 3. * dot / PetscSqr(shape->area);
  }
}

SbSlopes SbFaceSlopes(SbSpace s, const SbFace *face, PetscReal volume)
{
  const FaceShape shape = face_shape(s, face);
  const PetscReal a = PetscSqrtReal(12. * shape.large);
  const PetscReal b = PetscMin(a, WIDTH * PetscSqrtReal(12. * shape.small));
  const PetscReal h = HEIGHT * 3. * volume / shape.area;
  const PetscReal H = PetscMin(a, PetscMax(b, h));
  const PetscReal flat = PetscSqr(PetscMin(1., h / b));
  SbSlopes slopes = {.bears = PetscSqr(b / a)};

  /* all of it where nothing is long or flat: no rounding */
  if (b == a && flat == 1.)
    return slopes;
  spare(&shape, flat * PetscSqr(H * b / (a * a)), flat * PetscSqr(H / a), slopes.spared[0]);
  spare(&shape, flat * PetscSqr(H / a), flat, slopes.spared[1]);
  return slopes;
}

/* Length over width, width over height of the cells of a box whose tets have such faces; by a fit
   to boxes of 1 to 20, right to 3 %. */
static void aspects_of(const FaceShape *shape, PetscReal volume, PetscReal aspect[2])
{
  const PetscReal h = 3. * volume / shape->area;
  const PetscReal width = PetscMax(PetscSqr(WIDTH) * shape->small, PetscSqr(h) / 12.);
  const PetscReal length2 = shape->large / width;
  const PetscReal flatness2 = 12. * shape->small / PetscSqr(h);

  aspect[0] = PetscSqrtReal(PetscMax(length2 - 0.64, 0.) / 0.352);
  aspect[1] = PetscSqrtReal(PetscMax(flatness2 - 0.5, 0.) / 0.335);
}

/* The tet that is farthest out of range, flat or long, of a body; of equal ones that with the
   lowest number. */
typedef struct {
  PetscReal excess;    /* aspect over the largest one that is verified */
  PetscReal aspect[2]; /* of length and width, of width and height */
  PetscReal place[3];  /* its centroid, m */
  PetscReal to;        /* up to which that aspect is verified */
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
  PetscCallMPI(MPI_Bcast(worst->aspect, 6, MPIU_REAL, rank, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFacesWarn(SbSpace s, PetscInt n, const SbFace face[], const PetscReal V[])
{
  const SbMesh mesh = s->mesh;
  WorstShape *worst; /* [nbody] */
  PetscInt *count;   /* [nbody][2] tets out of range, tets */
  uint8_t *out;      /* [ncell] */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(mesh->nbody, &worst, 2 * mesh->nbody, &count, mesh->ncell, &out));
  for (PetscInt i = 0; i < n; i++) {
    const FaceShape shape = face_shape(s, &face[i]);

    for (int side = 0; side < (face[i].cell[1] == SB_SUPPORT ? 1 : 2); side++) {
      const PetscInt cell = face[i].cell[side];
      const PetscReal *to = verified[!s->material[mesh->cell_material[cell]]->linear];
      WorstShape *most = &worst[mesh->cell_body[cell]];
      PetscReal aspect[2], excess;

      aspects_of(&shape, V[cell], aspect);
      excess = PetscMax(aspect[0] / to[0], aspect[1] / to[1]);
      if (excess > 1.)
        out[cell] = 1;
      if (excess < most->excess * (1. - EQUAL) ||
          (excess < most->excess * (1. + EQUAL) && mesh->cell_orig[cell] >= most->orig))
        continue;
      *most = (WorstShape){excess,
                           {aspect[0], aspect[1]},
                           {0.},
                           aspect[1] / to[1] > aspect[0] / to[0] ? to[1] : to[0],
                           mesh->cell_orig[cell]};
      for (int k = 0; k < 12; k++)
        most->place[k % 3] += 0.25 * mesh->x[3 * mesh->cell[4 * cell + k / 3] + k % 3];
    }
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    count[2 * mesh->cell_body[c]] += out[c];
    count[2 * mesh->cell_body[c] + 1]++;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)(2 * mesh->nbody), MPIU_INT, MPI_SUM, s->comm));
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    PetscBool flat;

    if ((PetscReal)count[2 * b] <= MANY * (PetscReal)count[2 * b + 1])
      continue;
    PetscCall(reduce_worst(s, &worst[b]));
    flat = (PetscBool)(worst[b].to == verified[0][1] || worst[b].to == verified[1][1]);
    PetscCall(SbWarning(
      s->comm,
      "body %s, element %s: %" PetscInt_FMT " of %" PetscInt_FMT
      " tets are long or flat, the worst one at (%.4g, %.4g, %.4g) m as in cells %.2g times as "
      "%s: bending is verified to %.2g times only (docs/reports/locking.md). Take p2, or rounder "
      "tets",
      mesh->body[b].name, s->element[b]->name, count[2 * b], count[2 * b + 1],
      (double)worst[b].place[0], (double)worst[b].place[1], (double)worst[b].place[2],
      (double)worst[b].aspect[flat], flat ? "wide as high" : "long as wide",
      PetscFloorReal(2. * (double)worst[b].to) / 2.));
  }
  PetscCall(PetscFree3(worst, count, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}
