/*
  The penalty on jumps of CR and DG at smooth walls, as at planes of symmetry.

  A smooth wall is a boundary facet across an axis n, whose displacement is prescribed along that
  axis alone. What is behind it is the mirror image of the body: the displacement R u of the image
  of a cell has the same components in the wall and the opposite one across it, relative to the
  wall. So the jump from the image to the cell is 2 (u_n - d_n), d_n the displacement of the wall;
  its mean over the facet is zero, since that of u_n is prescribed. Of the penalty (jump.c)

    W = 1/2 kappa1 int_F |2 (u_n - d_n)|^2

  half is the body's, half that of the image, so that a body cut at its planes of symmetry has the
  energy of its part of the whole one. With the nodes u_i of the cell opposite the corners i of the
  facet, the jump at a corner is 2 J_i,

    J_i = (u_1 + u_2 + u_3 - 3 u_i)_n - (d_i - (d_1 + d_2 + d_3) / 3)_n,    W/2 = c1 sum J_i^2,  c1
    = kappa1 |F| / 12,

  less sum less_i (J_i - J_(i + 1))^2 in long and flat cells, as for other faces (face_shape.c).

  The sum of J_i is zero: the wall gets no force, and the node on the facet has no part. A wall that
  moves as a whole has d_i alike. One that tilts is no plane of symmetry, but d keeps its slope from
  costing energy; damping, which acts on velocities, resists the tilting itself.
*/
#include "fem_impl.h"

#define SLANT 1e-10 /* square of the sine of the angle of a wall with an axis: rounding */

PetscBool SbFaceIsHeld(SbSpace s, PetscInt face, PetscInt *node)
{
  const PetscBool supported = (PetscBool)(s->dirichlet_node && s->dirichlet_node[face] >= 0);

  *node = supported ? s->dirichlet_node[face] : s->cell_node[face];
  return (PetscBool)((s->mesh->face_set[face] & SB_ON_BOUNDARY) && s->fixed[*node] == 7);
}

PetscInt SbFaceWallAxis(SbSpace s, PetscInt face, PetscInt *node)
{
  const PetscInt *v = s->mesh->cell + 4 * (face / 4);
  const PetscReal *corner = s->mesh->x + 3 * v[SbFaceVertex[face % 4][0]];
  PetscReal a[3], b[3], n[3];
  PetscInt axis = 0;

  if (SbFaceIsHeld(s, face, node) || !(s->mesh->face_set[face] & SB_ON_BOUNDARY))
    return SB_NO_WALL;
  while (axis < 3 && s->fixed[*node] != 1 << axis)
    axis++;
  if (axis == 3)
    return SB_NO_WALL;
  SbSubtract(s->mesh->x + 3 * v[SbFaceVertex[face % 4][1]], corner, a);
  SbSubtract(s->mesh->x + 3 * v[SbFaceVertex[face % 4][2]], corner, b);
  SbCross(a, b, n);
  return PetscSqr(n[axis]) > (1. - SLANT) * SbDot3(n, n) ? axis : SB_NO_WALL;
}

PetscErrorCode SbWallsFind(SbSpace s, SbWalls *walls)
{
  const SbMesh mesh = s->mesh;
  PetscInt room = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(walls->wall));
  walls->n = 0;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt *node = s->cell_node + 4 * (i / 4);
    PetscBool owned = PETSC_FALSE;
    PetscInt axis, own;
    SbWall *wall;

    if (mesh->neighbour[i] >= 0 || !SbElementHasFaces(SbSpaceCellElement(s, i / 4)))
      continue;
    axis = SbFaceWallAxis(s, i, &own);
    for (int a = 0; a < 4; a++)
      owned = (PetscBool)(owned || node[a] < s->nnode_owned);
    if (axis == SB_NO_WALL || !owned)
      continue;
    PetscCall(SbReserve(walls->n + 1, sizeof(SbWall), &room, &walls->wall));
    wall = &walls->wall[walls->n++];
    *wall = (SbWall){.face = {{i / 4, i / 4}, {i % 4, i % 4}},
                     .axis = axis,
                     .share = i / 4 < mesh->ncell_owned ? 1. : 0.};
    for (int k = 0; k < 3; k++) {
      wall->node[k] = node[(i + 1 + k) % 4];
      wall->vertex[k] = mesh->cell[4 * (i / 4) + (i + 1 + k) % 4];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbWallJumps(SbSpace s, const SbWall *wall, const PetscReal x[], SbJumpFactor factor,
                 PetscReal J[3])
{
  const PetscReal *d = s->vertex_value;
  PetscReal sum = 0.;

  for (int i = 0; i < 3; i++)
    sum += x[3 * wall->node[i] + wall->axis];
  for (int i = 0; i < 3; i++) {
    J[i] = sum - 3. * x[3 * wall->node[i] + wall->axis];
    for (int k = 1; k < 3 && factor == SB_JUMP_STIFFNESS; k++)
      J[i] -=
        (d[3 * wall->vertex[i] + wall->axis] - d[3 * wall->vertex[(i + k) % 3] + wall->axis]) / 3.;
  }
}

PetscReal SbWallPenalty(PetscReal c1, const PetscReal less[3], const PetscReal J[3])
{
  PetscReal energy = 0.;

  for (int i = 0; i < 3; i++)
    energy += c1 * J[i] * J[i] - less[i] * PetscSqr(J[i] - J[(i + 1) % 3]);
  return energy;
}

/* J less the offsets. */
static void held_jumps(SbSpace s, const SbWall *wall, const PetscReal x[], SbJumpFactor factor,
                       PetscReal J[3])
{
  SbWallJumps(s, wall, x, factor, J);
  for (int i = 0; i < 3; i++)
    J[i] -= factor == SB_JUMP_STIFFNESS ? wall->r[i] : 0.;
}

/* 1, or the damping of the body of a wall, s. */
static PetscReal scale_of(SbSpace s, const SbWall *wall, SbJumpFactor factor)
{
  return factor == SB_JUMP_STIFFNESS ? 1. : s->beta[s->mesh->cell_body[wall->face.cell[0]]];
}

void SbWallsAdd(SbSpace s, const SbWalls *walls, const PetscReal x[], SbJumpFactor factor,
                PetscReal f[])
{
  for (PetscInt w = 0; w < walls->n; w++) {
    const SbWall *wall = &walls->wall[w];
    const PetscReal scale = 2. * scale_of(s, wall, factor);
    const PetscReal *less = wall->less;
    PetscReal J[3], t[3];

    if (scale == 0.)
      continue;
    held_jumps(s, wall, x, factor, J);
    for (int i = 0; i < 3; i++)
      t[i] = scale * (wall->c1 * J[i] - less[i] * (J[i] - J[(i + 1) % 3]) +
                      less[(i + 2) % 3] * (J[(i + 2) % 3] - J[i]));
    for (int i = 0; i < 3; i++)
      f[3 * wall->node[i] + wall->axis] += t[0] + t[1] + t[2] - 3. * t[i];
  }
}

PetscReal SbWallsEnergy(SbSpace s, const SbWalls *walls, const PetscReal x[], SbJumpFactor factor,
                        PetscReal body[])
{
  PetscReal energy = 0.;

  for (PetscInt w = 0; w < walls->n; w++) {
    const SbWall *wall = &walls->wall[w];
    PetscReal J[3], one;

    held_jumps(s, wall, x, factor, J);
    one = scale_of(s, wall, factor) * wall->share * SbWallPenalty(wall->c1, wall->less, J);
    energy += one;
    if (body)
      body[s->mesh->cell_body[wall->face.cell[0]]] += one;
  }
  return energy;
}

void SbWallMatrix(const SbWall *wall, PetscReal K[3][3])
{
  for (int k = 0; k < 9; k++)
    K[k / 3][k % 3] = 2. * wall->c1 * (k / 3 == k % 3 ? 6. : -3.);

  /* J_i - J_k = 3 (u_k - u_i) */
  for (int i = 0; i < 3; i++) {
    const int k = (i + 1) % 3;

    K[i][i] -= 18. * wall->less[i];
    K[k][k] -= 18. * wall->less[i];
    K[i][k] += 18. * wall->less[i];
    K[k][i] += 18. * wall->less[i];
  }
}
