/*
  periodic.c - ties opposite sides of a body, a cell of a material that repeats, with a mean strain:
  homogenisation of a microstructure.

  The sides of the box around the facets, at distances L_D along the axes D. For a place X on the
  upper side of D, with X - L_D e_D on the lower one, j = u(X) - u(X - L_D e_D) and the mean
  displacement gradient H = F - I,

    j_i = H_iD L_D.

  As in a tie (tie.c), by a stiffness k per area on patches of facets, whose meshes need not match
  (facing.c): with S_ab = integral k s_a s_b dA and m_a = integral s_a dA of a patch,

    f_a = -sum_b S_ab u_b + (k d + q) m_a + g_a,   d = H_iD L_D.

  A component is given, or free: then its d is the mean of j on one patch of the side, the reference
  patch, whose nodes each patch is coupled with. E = 1/2 integral k |j - d|^2 has no other stiffness
  in the way of that H_iD, so that the mean stress of the component vanishes: what all other patches
  bear, the reference patch bears the opposite of.

  q is a mean traction, g_a further forces. In a static run these are multipliers, so that the mean
  strain is exact: a load step is solved again with the forces of the springs added to g (method of
  multipliers) until the jumps are below TOLERANCE of the strain. It begins with q that of the last
  step and g = 0. Which jumps go to zero:

    facets match, nodes at vertices (P1, P2)   all
    facets match (CR, DG)                      their mean on each facet
    else                                       their mean on the side: more would lock both traces

  What is left to k is the part of the tractions that varies in between. In a dynamic run q = g = 0:
  the sides yield as in a tie.

  The mean first Piola-Kirchhoff stress is P_iD = (force_i on the upper side of D) / (area of that
  side of the box); its work is V integral P : dH by the trapezoidal rule over steps.

  Nothing of this resists a translation: without supports a place of the body is held in a static
  run, by a spring whose force is that of loads that do not balance.
*/
#include "facing.h"
#include "sbgeometry.h"

#define FACTOR 100.              /* stiffness over that of a cell, as of ties */
#define FLAT 1e-6                /* of the box's diagonal: facets nearer to its sides are on them */
#define NORMAL 0.9999            /* cosine of their normals with the axis, at least */
#define MATCH 0.01               /* of a side's area: how much of it may have nothing opposite */
#define SAME 1e-9                /* relative rounding of areas of patches */
#define ROUNDING 1e-9            /* basis functions below it are those of nodes off the facet */
#define TOLERANCE 1e-7           /* of the mean strain: jumps of the sides over their distance */
#define REPEATED 40              /* solves of a load step, at most: 3 to 6 are usual */
#define MOST (4 * SB_CELL_NODES) /* nodes of a patch, with those of the reference patch */

/* Which jumps become zero. */
typedef enum {
  ALL,
  FACETS,
  MEAN
} Jumps;

typedef struct {
  PetscInt coupling, n; /* its number here, and of its nodes */
  PetscReal *S;         /* [2][n][n] of components that are given, and free, N/m */
  PetscReal *mean;      /* [2][n] likewise, m^2 */
  PetscReal *g;         /* [n][3] N */
  PetscReal pull[3];    /* of g, on the upper side, N */
  PetscReal k, area;    /* Pa/m, m^2 */
  int axis;
} Patch;

/* One of the sides, with its opposite one. */
typedef struct {
  PetscBool tied;
  Jumps exact;
  PetscReal length, area, held, stiffness; /* m; of the box, and that is tied, m^2; mean k, Pa/m */
} Side;

/* Sums over all patches. */
typedef struct {
  PetscReal jump[9]; /* integral (j - d) of given components, j of free ones, m^3 */
  PetscReal pull[9]; /* force on the upper sides but that of q, of given components, N */
} Sums;

typedef struct {
  SbFormula gradient[9];
  int axes; /* bits 0..2 */
  PetscBool free[9];
  PetscReal stiffness, wave; /* Pa/m, 0: by default; largest lambda + 2 mu, Pa */
  Side side[3];
  PetscInt n, size;
  Patch *patch;               /* [n] */
  PetscReal *work;            /* [9 most^2] of the tangent */
  PetscReal q[9];             /* Pa */
  PetscReal H[9], P[9], done; /* of the last step: strain, stress, Pa, work, J */
  PetscInt solves;
  PetscBool warned;

  /* the spring that holds a place */
  PetscInt hold, nhold;                                 /* its coupling, -1: none here; nodes */
  PetscReal hold_weight[SB_CELL_NODES], hold_stiffness; /* N/m */
  PetscBool looked, held[3];                            /* for supports; by it */
} Periodic;

#define AXES "xyz|x|y|z|xy|xz|yz"
static const int axes_of[] = {7, 1, 2, 4, 3, 5, 6};

static const char *const names[] = {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"};

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "boundary", "",
   "sets of boundary facets: those in the sides of the box around them are tied"},
  {"axes", SB_OPTION_CHOICE, 1, "", "xyz", AXES, "along which it repeats"},
  {"gradient", SB_OPTION_FORMULA, 9, "", "0;0;0;0;0;0;0;0;0", "",
   "mean displacement gradient F - I, row by row: xx;xy;xz;yx;..., formulas of the time t; xy is "
   "the displacement along x over the distance along y"},
  {"free", SB_OPTION_NAMES, 1, "", "", "",
   "components of the gradient that are not given, and have no mean stress: xx, xy, ..."},
  {"stiffness", SB_OPTION_REAL, 1, "Pa/m", "0", "[0, inf)",
   "stress over the distance by which opposite places come off; 0: a hundred times that of a cell, "
   "(lambda + 2 mu) / h"},
};

/* Components that contradict each other. */
static PetscErrorCode check_components(SbEffect e)
{
  const Periodic *p = (const Periodic *)e->data;

  PetscFunctionBeginUser;
  for (int c = 0; c < 9; c++) {
    const PetscBool tied = (PetscBool)((p->axes >> (c % 3) & 1) != 0);
    PetscReal value;

    PetscCall(SbFormulaEval(p->gradient[c], 1., NULL, &value));
    PetscCheck(tied || (!p->free[c] && value == 0), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "effect %s: component %s of the gradient is of sides that -effect_%s_axes does not "
               "tie: it must be 0, and not in -effect_%s_free",
               e->name, names[c], e->name, e->name);
    PetscCheck(!p->free[c] || value == 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "effect %s: component %s is in -effect_%s_free, and -effect_%s_gradient gives it: "
               "leave one out",
               e->name, names[c], e->name, e->name);
    PetscCheck(
      c / 3 == c % 3 || !p->free[c] || !p->free[3 * (c % 3) + c / 3], PETSC_COMM_WORLD,
      PETSC_ERR_USER_INPUT,
      "-effect_%s_free: %s and %s are both free: the cell could turn; take one of them out",
      e->name, names[c], names[3 * (c % 3) + c / 3]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_periodic(SbEffect e, const SbScope *scope)
{
  Periodic *p = (Periodic *)e->data;
  PetscInt n;
  int choice;
  char(*name)[SB_NAME_MAX];

  PetscFunctionBeginUser;
  p->hold = -1;
  PetscCall(SbOptionChoice(scope, "axes", &choice));
  p->axes = axes_of[choice];
  PetscCall(SbEffectFormulas(e, scope, "gradient", 9, PETSC_FALSE, p->gradient));
  PetscCall(SbOptionNames(scope, "free", &n, &name));
  for (PetscInt i = 0; i < n; i++) {
    int c = 0;

    while (c < 9 && strcmp(name[i], names[c]))
      c++;
    PetscCheck(c < 9, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_free: \"%s\" is no component: xx, xy, xz, yx, yy, yz, zx, zy, zz",
               e->name, name[i]);
    p->free[c] = PETSC_TRUE;
  }
  PetscCall(PetscFree(name));
  PetscCall(check_components(e));
  PetscCall(SbOptionReal(scope, "stiffness", &p->stiffness));
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = e->holds = PETSC_TRUE;
  e->nstate = 19;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets of the upper side of an axis, and of the lower one moved onto it. */
static PetscErrorCode find_sides(SbEffect e, SbSpace space, PetscInt n, const SbFacing facet[],
                                 const PetscReal box[6], int axis, PetscInt count[2],
                                 SbFacing *to[2], PetscReal area[2])
{
  const PetscReal flat = FLAT * SbBoxDiagonal(box);

  PetscFunctionBeginUser;
  for (int s = 0; s < 2; s++) {
    const PetscReal at = box[axis + (s ? 0 : 3)];

    count[s] = 0;
    area[s] = 0;
    PetscCall(PetscMalloc1(n, &to[s]));
    for (PetscInt i = 0; i < n; i++) {
      SbFacing *one = &to[s][count[s]];
      PetscBool on = (PetscBool)((s ? -1 : 1) * facet[i].normal[axis] >= NORMAL);

      for (int c = 0; c < 3; c++)
        on = (PetscBool)(on && PetscAbsReal(facet[i].x[c][axis] - at) <= flat);
      if (!on)
        continue;
      *one = facet[i];
      for (int c = 0; c < 4 && s; c++) {
        one->corner[c][axis] += box[3 + axis] - box[axis];
        if (c < 3)
          one->x[c][axis] += box[3 + axis] - box[axis];
      }
      area[s] += one->area;
      count[s]++;
    }
    PetscCheck(count[s], space->comm, PETSC_ERR_USER_INPUT,
               "%s: no facet of these sets lies in the plane %c = %g m, the %s side of the box "
               "around them: opposite sides of a cell are plane and normal to the axes",
               e->on.option, 'x' + axis, (double)at, s ? "lower" : "upper");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The larger patch, or of two with the same area the one of lower numbers. */
static PetscBool is_before(const SbFacing *a, const SbFacing *b, PetscReal area,
                           const SbFacing *const best[2], PetscReal largest)
{
  if (!best[0] || PetscAbsReal(area - largest) > SAME * largest)
    return (PetscBool)(!best[0] || area > largest);
  if (a->number != best[0]->number)
    return (PetscBool)(a->number < best[0]->number);
  return (PetscBool)(b->number < best[1]->number);
}

/* Keeps a patch if one of its nodes is owned here. reference: that of the side, if a component is
   free there; else NULL. */
static PetscErrorCode keep(SbSpace space, Periodic *p, int axis, PetscReal k,
                           const SbFacingSum *sum, const SbFacingSum *reference)
{
  PetscReal s[2][MOST] = {{0}}; /* means of the patch, over k, and of the reference patch by area */
  PetscInt from[MOST], gnode[MOST];
  PetscReal most = 0;
  PetscInt n = 0;
  PetscInt coupling;
  Patch *patch;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < sum->n; i++)
    most = PetscMax(most, sum->S[i][i]);
  for (PetscInt i = 0; i < sum->n; i++) {
    if (sum->S[i][i] <= PetscSqr(ROUNDING) * most)
      continue;
    gnode[n] = sum->gnode[i];
    s[0][n] = sum->mean[i] / k;
    from[n++] = i;
  }
  most = 0;
  for (PetscInt i = 0; reference && i < reference->n; i++)
    most = PetscMax(most, reference->S[i][i]);
  for (PetscInt i = 0; reference && i < reference->n; i++) {
    PetscInt at = 0;

    if (reference->S[i][i] <= PetscSqr(ROUNDING) * most)
      continue;
    while (at < n && gnode[at] != reference->gnode[i])
      at++;
    if (at == n) {
      gnode[n] = reference->gnode[i];
      from[n++] = -1;
    }
    s[1][at] = reference->mean[i] / reference->area;
  }
  PetscCall(SbSpaceCouple(space, n, gnode, &coupling));
  if (coupling < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(p->n + 1, sizeof(*p->patch), &p->size, &p->patch));
  patch = &p->patch[p->n++];
  *patch = (Patch){.coupling = coupling, .n = n, .k = k, .area = sum->area, .axis = axis};
  PetscCall(PetscMalloc3(2 * n * n, &patch->S, 2 * n, &patch->mean, 3 * n, &patch->g));
  PetscCall(PetscArrayzero(patch->g, 3 * n));
  for (PetscInt i = 0; i < n; i++) {
    patch->mean[i] = s[0][i];
    patch->mean[n + i] = s[0][i] - sum->area * s[1][i];
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal S = from[i] < 0 || from[j] < 0 ? 0 : sum->S[from[i]][from[j]];

      patch->S[n * i + j] = S;
      patch->S[n * n + n * i + j] =
        S + k * (sum->area * s[1][i] * s[1][j] - s[0][i] * s[1][j] - s[1][i] * s[0][j]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The stiffness between two facets, of the stiffer cell, Pa/m: the solves that the multipliers take
   grow with the ratio of that of the cells to it. */
static PetscErrorCode stiffness_between(SbEffect e, const SbFacing *a, const SbFacing *b,
                                        PetscReal *k)
{
  const Periodic *p = (const Periodic *)e->data;

  PetscFunctionBeginUser;
  *k = p->stiffness > 0 ? p->stiffness : FACTOR * PetscMax(a->wave, b->wave) / a->size;
  PetscCheck(*k > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "effect %s ties sides of rigid bodies, which have no stiffness to compare with: give "
             "-effect_%s_stiffness (Pa/m)",
             e->name, e->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether its cell has nodes at the vertices. */
static PetscBool at_vertices(const SbFacing *facet)
{
  PetscBool all = PETSC_TRUE;

  for (int k = 0; k < 16 && facet->n < SB_CELL_NODES; k++)
    all = (PetscBool)(all && facet->basis[k / 4][k % 4] == (k / 4 == k % 4));
  return all;
}

/* A place of the facet that is held, by its cell's nodes. */
static PetscErrorCode hold_place(SbSpace space, Periodic *p, const SbFacing *facet)
{
  PetscReal phi[SB_CELL_NODES];
  PetscReal x[3] = {0};
  PetscInt gnode[SB_CELL_NODES];

  PetscFunctionBeginUser;
  for (int k = 0; k < 9; k++)
    x[k % 3] += facet->x[k / 3][k % 3] / 3;
  if (!SbFacingBasis(facet, x, phi))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt a = 0; a < facet->n; a++) {
    if (PetscAbsReal(phi[a]) <= ROUNDING)
      continue;
    gnode[p->nhold] = facet->gnode[a];
    p->hold_weight[p->nhold++] = phi[a];
  }
  PetscCall(SbSpaceCouple(space, p->nhold, gnode, &p->hold));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The patches of an axis: first the reference patch, then all of them with it. */
static PetscErrorCode tie_sides(SbEffect e, SbSpace space, int axis, const PetscInt n[2],
                                SbFacing *const facet[2], Side *side)
{
  Periodic *p = (Periodic *)e->data;
  const PetscBool any = (PetscBool)(p->free[axis] || p->free[3 + axis] || p->free[6 + axis]);
  const SbFacing *best[2] = {NULL, NULL};
  SbFacingSum reference = {.n = 0};
  PetscReal(*box)[6];
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n[1], &box));
  for (PetscInt j = 0; j < n[1]; j++) {
    SbBoxClear(box[j]);
    for (int c = 0; c < 3; c++)
      SbBoxAdd(box[j], facet[1][j].x[c]);
  }
  PetscCall(SbBoxTreeCreate(n[1], (const PetscReal(*)[6])box, &tree));
  for (int pass = 0; pass < 2; pass++)
    for (PetscInt i = 0; i < n[0]; i++) {
      const SbFacing *a = &facet[0][i];
      const PetscReal near = FLAT * a->size; /* of rounding */
      SbBoxNearest nearest;
      PetscReal around[6];
      PetscInt j;

      SbBoxClear(around);
      for (int c = 0; c < 3; c++)
        SbBoxAdd(around, a->x[c]);
      for (SbBoxNearestBegin(&tree, around, PetscSqr(near), &nearest);
           SbBoxNearestNext(&nearest, &j);) {
        const SbFacing *b = &facet[1][j];
        SbFacingSum sum;
        PetscReal k;

        PetscCall(stiffness_between(e, a, b, &k));
        SbFacingSumUp(a, b, a->size, k, &sum);
        if (sum.area <= SB_FACING_SLIVER * a->area)
          continue;
        if (pass) {
          side->held += sum.area;
          side->stiffness += k * sum.area;
          PetscCall(keep(space, p, axis, k, &sum, any ? &reference : NULL));
          continue;
        }
        p->wave = PetscMax(p->wave, PetscMax(a->wave, b->wave));
        if (sum.area < (1 - FLAT) * PetscMax(a->area, b->area))
          side->exact = MEAN;
        else if (side->exact == ALL && !(at_vertices(a) && at_vertices(b)))
          side->exact = FACETS;
        if (is_before(a, b, sum.area, best, reference.area)) {
          reference = sum;
          for (PetscInt c = 0; c < sum.n; c++)
            reference.mean[c] /= k;
          best[0] = a;
          best[1] = b;
        }
      }
    }
  side->stiffness /= PetscMax(side->held, PETSC_MIN_REAL);
  if (best[0] && p->nhold == 0)
    PetscCall(hold_place(space, p, best[0]));
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode couplings_periodic(SbEffect e, SbSpace space)
{
  Periodic *p = (Periodic *)e->data;
  PetscReal box[6];
  PetscInt n;
  PetscInt most = 0;
  SbFacing *facet;

  PetscFunctionBeginUser;
  PetscCall(SbFacingGather(space, &e->on, &n, &facet));
  SbBoxClear(box);
  for (PetscInt i = 0; i < 3 * n; i++)
    SbBoxAdd(box, facet[i / 3].x[i % 3]);
  for (int axis = 0; axis < 3; axis++) {
    Side *side = &p->side[axis];
    SbFacing *of[2];
    PetscReal area[2];
    PetscInt count[2];

    side->tied = (PetscBool)((p->axes >> axis & 1) != 0);
    side->length = box[3 + axis] - box[axis];
    side->area = 1;
    for (int k = 1; k < 3; k++)
      side->area *= box[3 + (axis + k) % 3] - box[(axis + k) % 3];
    if (!side->tied)
      continue;
    PetscCall(find_sides(e, space, n, facet, box, axis, count, of, area));
    PetscCall(tie_sides(e, space, axis, count, of, side));
    PetscCheck(side->held >= (1 - MATCH) * PetscMax(area[0], area[1]), space->comm,
               PETSC_ERR_USER_INPUT,
               "%s: the sides at %c = %g and %g m do not match: they have %.4g and %.4g m^2, of "
               "which %.4g m^2 lie opposite each other; holes and edges must be at the same places",
               e->on.option, 'x' + axis, (double)box[axis], (double)box[3 + axis], (double)area[1],
               (double)area[0], (double)side->held);
    PetscCall(PetscFree(of[0]));
    PetscCall(PetscFree(of[1]));
  }
  PetscCall(PetscFree(facet));
  p->hold_stiffness = p->wave * SbBoxDiagonal(box);
  for (PetscInt i = 0; i < p->n; i++)
    most = PetscMax(most, p->patch[i].n);
  most = PetscMax(most, p->nhold);
  PetscCall(PetscMalloc1(9 * most * most, &p->work));
  SbFormat(sizeof(e->note), e->note, "a cell of %.6g x %.6g x %.6g m", (double)p->side[0].length,
           (double)p->side[1].length, (double)p->side[2].length);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_periodic(SbEffect e, SbSpace space)
{
  Periodic *p = (Periodic *)e->data;

  PetscFunctionBeginUser;
  (void)space;
  for (int i = 0; i < 3; i++)
    p->held[i] = (PetscBool)!e->dynamic;
  if (e->dynamic)
    e->ops.settle = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the gradient prescribes, H[9]. */
static PetscErrorCode gradient_at(SbEffect e, PetscReal t, PetscReal H[9])
{
  const Periodic *p = (const Periodic *)e->data;

  PetscFunctionBeginUser;
  for (int c = 0; c < 9; c++)
    PetscCall(SbEffectValueAt(e, p->gradient[c], t, &H[c]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const PetscInt *nodes_of(SbSpace space, PetscInt coupling)
{
  return space->couplings.node + space->couplings.start[coupling];
}

/* The displacement of the place that is held, m. */
static void place_of(SbSpace space, const Periodic *p, const PetscReal u[], PetscReal way[3])
{
  const PetscInt *node = nodes_of(space, p->hold);

  way[0] = way[1] = way[2] = 0;
  for (PetscInt a = 0; a < 3 * p->nhold; a++)
    way[a % 3] += p->hold_weight[a / 3] * u[3 * node[a / 3] + a % 3];
}

static PetscErrorCode force_periodic(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Periodic *p = (const Periodic *)e->data;
  PetscReal H[9];

  PetscFunctionBeginUser;
  PetscCall(gradient_at(e, stage->t, H));
  for (const Patch *patch = p->patch; patch < p->patch + p->n; patch++) {
    const PetscInt *node = nodes_of(space, patch->coupling);
    const PetscInt n = patch->n;

    for (int i = 0; i < 3; i++) {
      const int c = 3 * i + patch->axis;
      const PetscReal *S = patch->S + p->free[c] * n * n;
      const PetscReal even =
        p->free[c] ? 0 : patch->k * H[c] * p->side[patch->axis].length + p->q[c];

      for (PetscInt a = 0; a < n; a++) {
        f[3 * node[a] + i] += even * patch->mean[a] + patch->g[3 * a + i];
        for (PetscInt b = 0; b < n; b++)
          f[3 * node[a] + i] -= S[n * a + b] * stage->u[3 * node[b] + i];
      }
    }
  }

  /* the place that is held */
  if (p->hold >= 0) {
    const PetscInt *node = nodes_of(space, p->hold);
    PetscReal way[3];

    place_of(space, p, stage->u, way);
    for (PetscInt a = 0; a < 3 * p->nhold; a++)
      f[3 * node[a / 3] + a % 3] -=
        p->held[a % 3] * p->hold_stiffness * p->hold_weight[a / 3] * way[a % 3];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_periodic(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Periodic *p = (const Periodic *)e->data;

  PetscFunctionBeginUser;
  for (const Patch *patch = p->patch; patch < p->patch + p->n; patch++) {
    const PetscInt n = patch->n;

    PetscCall(PetscArrayzero(p->work, 9 * n * n));
    for (int i = 0; i < 3; i++) {
      const PetscReal *S = patch->S + p->free[3 * i + patch->axis] * n * n;

      for (PetscInt k = 0; k < n * n; k++)
        p->work[3 * n * (3 * (k / n) + i) + 3 * (k % n) + i] = stage->shift_k * S[k];
    }
    PetscCall(SbSpaceAddCoupling(space, A, patch->coupling, p->work));
  }
  if (p->hold >= 0) {
    const PetscInt n = p->nhold;

    PetscCall(PetscArrayzero(p->work, 9 * n * n));
    for (int i = 0; i < 3; i++)
      for (PetscInt k = 0; k < n * n; k++)
        p->work[3 * n * (3 * (k / n) + i) + 3 * (k % n) + i] =
          p->held[i] * stage->shift_k * p->hold_stiffness * p->hold_weight[k / n] *
          p->hold_weight[k % n];
    PetscCall(SbSpaceAddCoupling(space, A, p->hold, p->work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's part of the sums. */
static PetscErrorCode sum_patches(SbEffect e, SbSpace space, const SbStage *stage, Sums *sums)
{
  const Periodic *p = (const Periodic *)e->data;
  PetscReal H[9];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(sums, sizeof(*sums)));
  PetscCall(gradient_at(e, stage->t, H));
  for (const Patch *patch = p->patch; patch < p->patch + p->n; patch++) {
    const PetscInt *node = nodes_of(space, patch->coupling);

    if (node[0] >= space->nnode_owned)
      continue;
    for (int i = 0; i < 3; i++) {
      const int c = 3 * i + patch->axis;
      PetscReal jump = 0;

      for (PetscInt a = 0; a < patch->n; a++)
        jump += patch->mean[a] * stage->u[3 * node[a] + i];
      if (!p->free[c])
        jump -= H[c] * p->side[patch->axis].length * patch->area;
      sums->jump[c] += jump;
      sums->pull[c] += patch->pull[i] - patch->k * jump;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mean displacement gradient and stress of sums over all ranks. */
static PetscErrorCode state_of(SbEffect e, PetscReal t, const Sums *sums, PetscReal H[9],
                               PetscReal P[9])
{
  const Periodic *p = (const Periodic *)e->data;

  PetscFunctionBeginUser;
  PetscCall(gradient_at(e, t, H));
  for (int c = 0; c < 9; c++) {
    const Side *side = &p->side[c % 3];

    H[c] = P[c] = 0;
    if (!side->tied)
      continue;
    PetscCall(SbEffectValueAt(e, p->gradient[c], t, &H[c]));
    H[c] += sums->jump[c] / (side->held * side->length);
    if (!p->free[c])
      P[c] = (p->q[c] * side->held + sums->pull[c]) / side->area;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode sum_all(SbEffect e, SbSpace space, const SbStage *stage, Sums *sums)
{
  PetscFunctionBeginUser;
  PetscCall(sum_patches(e, space, stage, sums));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, (PetscMPIInt)(sizeof(*sums) / sizeof(PetscReal)),
                             MPIU_REAL, MPI_SUM, space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Directions in which supports hold something are not held here. */
static PetscErrorCode look_for_supports(Periodic *p, SbSpace space)
{
  PetscInt n[3] = {0};

  PetscFunctionBeginUser;
  p->looked = PETSC_TRUE;
  for (PetscInt a = 0; a < space->nnode_owned; a++)
    for (int i = 0; i < 3; i++)
      n[i] += space->fixed[a] >> i & 1;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 3, MPIU_INT, MPI_SUM, space->comm));
  for (int i = 0; i < 3; i++)
    p->held[i] = (PetscBool)!n[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest jump over the distance of its side, of those that go to zero; and adds to g what the
   springs bear, if `add`. */
static void add_multipliers(PetscBool add, SbSpace space, Periodic *p, const SbStage *stage,
                            const PetscReal H[9], const Sums *sums, PetscReal *largest)
{
  for (Patch *patch = p->patch; patch < p->patch + p->n; patch++) {
    const PetscInt *node = nodes_of(space, patch->coupling);
    const Side *side = &p->side[patch->axis];
    const PetscInt n = patch->n;

    for (int i = 0; i < 3; i++) {
      const int c = 3 * i + patch->axis;
      const PetscReal d = p->free[c] ? 0 : H[c] * side->length;
      const PetscReal *S = patch->S + p->free[c] * n * n;
      const PetscReal *mean = patch->mean + p->free[c] * n;
      const PetscReal even =
        p->free[c] ? 0 : side->stiffness * sums->jump[c] / side->held; /* of MEAN, Pa */
      PetscReal off = -d * patch->area;
      PetscReal most = PetscAbsReal(even) / side->stiffness;

      for (PetscInt a = 0; a < n; a++)
        off += mean[a] * stage->u[3 * node[a] + i];
      if (side->exact == FACETS)
        most = PetscAbsReal(off) / patch->area;
      patch->pull[i] -= !add ? 0 : side->exact == MEAN ? even * patch->area : patch->k * off;
      for (PetscInt a = 0; a < n; a++) {
        PetscReal f = 0;

        if (side->exact == MEAN)
          f = even * mean[a];
        if (side->exact == FACETS)
          f = patch->k * off / patch->area * mean[a];
        if (side->exact == ALL) {
          f = -patch->k * d * mean[a];
          for (PetscInt b = 0; b < n; b++)
            f += S[n * a + b] * stage->u[3 * node[b] + i];
          most = PetscMax(most, 3 * PetscAbsReal(f) / (patch->k * patch->area));
        }
        patch->g[3 * a + i] -= add ? f : 0;
      }
      *largest = PetscMax(*largest, most / side->length);
    }
  }
}

/* The multipliers that a load step begins with. */
static PetscErrorCode begin_step(Periodic *p)
{
  PetscFunctionBeginUser;
  p->solves = 0;
  for (int c = 0; c < 9; c++)
    p->q[c] = p->side[c % 3].tied ? p->P[c] * p->side[c % 3].area / p->side[c % 3].held : 0;
  for (Patch *patch = p->patch; patch < p->patch + p->n; patch++) {
    PetscCall(PetscArrayzero(patch->g, 3 * patch->n));
    PetscCall(PetscArrayzero(patch->pull, 3));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of static runs: multipliers. */
static PetscErrorCode settle_periodic(SbEffect e, SbSpace space, const SbStage *stage,
                                      PetscBool *changed)
{
  Periodic *p = (Periodic *)e->data;
  PetscReal strain = 0;
  PetscReal stress = 0;
  PetscReal off = 0;
  PetscReal given[9], H[9], P[9];
  Sums sums;

  PetscFunctionBeginUser;
  if (!stage) {
    PetscCall(begin_step(p));
    if (!p->looked)
      PetscCall(look_for_supports(p, space));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!SbEffectActs(e, stage->t) || p->solves == REPEATED)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(gradient_at(e, stage->t, given));
  PetscCall(sum_all(e, space, stage, &sums));
  PetscCall(state_of(e, stage->t, &sums, H, P));
  for (int c = 0; c < 9; c++) {
    strain = PetscMax(strain, PetscAbsReal(p->free[c] ? H[c] : given[c]));
    stress = PetscMax(stress, PetscAbsReal(P[c]));
  }
  if (strain == 0 && p->wave > 0) /* growth in a cell that may not grow */
    strain = stress / p->wave;
  add_multipliers(PETSC_FALSE, space, p, stage, given, &sums, &off);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &off, 1, MPIU_REAL, MPI_MAX, space->comm));
  if (off <= TOLERANCE * strain)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (++p->solves < REPEATED) {
    add_multipliers(PETSC_TRUE, space, p, stage, given, &sums, &off);
    *changed = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!p->warned)
    PetscCall(SbWarning(space->comm,
                        "effect %s: at load factor %g opposite sides are off by %.2g of their "
                        "distance after %d solves; give more -static_steps, a smaller -snes_rtol, "
                        "or a larger -effect_%s_stiffness",
                        e->name, (double)stage->t, (double)off, REPEATED, e->name));
  p->warned = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_periodic(SbEffect e, SbSpace space, const SbStage *stage)
{
  Periodic *p = (Periodic *)e->data;
  PetscReal H[9], P[9];
  Sums sums;

  PetscFunctionBeginUser;
  PetscCall(sum_all(e, space, stage, &sums));
  PetscCall(state_of(e, stage->t, &sums, H, P));
  for (int c = 0; c < 9; c++) {
    const Side *side = &p->side[c % 3];

    if (!SbEffectActs(e, stage->t))
      P[c] = 0;
    p->done += side->area * side->length * (p->P[c] + P[c]) / 2 * (H[c] - p->H[c]);
    p->H[c] = H[c];
    p->P[c] = P[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One record, of the first rank. */
static PetscErrorCode save_periodic(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Periodic *p = (const Periodic *)e->data;

  PetscFunctionBeginUser;
  *n = !space->rank;
  PetscCall(PetscMalloc1(19, records));
  PetscCall(PetscArraycpy(*records, p->H, 9));
  PetscCall(PetscArraycpy(*records + 9, p->P, 9));
  (*records)[18] = p->done;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_periodic(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                    PetscInt n, const PetscReal records[])
{
  Periodic *p = (Periodic *)e->data;

  PetscFunctionBeginUser;
  (void)space;
  (void)t;
  (void)u;
  if (n < 1)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(p->H, records, 9));
  PetscCall(PetscArraycpy(p->P, records + 9, 9));
  p->done = records[18];
  if (!e->dynamic)
    PetscCall(begin_step(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean displacement gradient and stress, Pa; the work of that stress and the energy of the ties, J;
   the force of the spring that holds a place, N. */
static PetscErrorCode history_periodic(SbEffect e, SbSpace space, const SbStage *stage,
                                       const PetscReal residual[], PetscReal values[])
{
  const Periodic *p = (const Periodic *)e->data;
  const PetscBool acts = SbEffectActs(e, stage->t);
  PetscReal given[9], H[9], P[9];
  Sums sums;

  PetscFunctionBeginUser;
  (void)residual;
  PetscCall(sum_all(e, space, stage, &sums));
  PetscCall(state_of(e, stage->t, &sums, H, P));
  for (int c = 0; c < 9 && !space->rank; c++) {
    values[c] = H[c];
    values[9 + c] = acts ? P[c] : 0;
  }
  if (!space->rank)
    values[18] = p->done;
  if (!acts)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* 1/2 integral k |j - d|^2 */
  PetscCall(gradient_at(e, stage->t, given));
  for (const Patch *patch = p->patch; patch < p->patch + p->n; patch++) {
    const PetscInt *node = nodes_of(space, patch->coupling);
    const PetscInt n = patch->n;

    if (node[0] >= space->nnode_owned)
      continue;
    for (int i = 0; i < 3; i++) {
      const int c = 3 * i + patch->axis;
      const PetscReal *S = patch->S + p->free[c] * n * n;
      const PetscReal d = p->free[c] ? 0 : given[c] * p->side[patch->axis].length;

      values[19] += patch->k * patch->area * d * d / 2;
      for (PetscInt a = 0; a < n; a++) {
        const PetscReal ua = stage->u[3 * node[a] + i];

        values[19] -= patch->k * d * patch->mean[a] * ua;
        for (PetscInt b = 0; b < n; b++)
          values[19] += S[n * a + b] / 2 * ua * stage->u[3 * node[b] + i];
      }
    }
  }
  if (p->hold >= 0 && nodes_of(space, p->hold)[0] < space->nnode_owned) {
    PetscReal way[3];

    place_of(space, p, stage->u, way);
    for (int i = 0; i < 3; i++)
      values[20 + i] -= p->held[i] * p->hold_stiffness * way[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_periodic(SbEffect e)
{
  Periodic *p = (Periodic *)e->data;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < p->n; i++)
    PetscCall(PetscFree3(p->patch[i].S, p->patch[i].mean, p->patch[i].g));
  PetscCall(PetscFree(p->patch));
  PetscCall(PetscFree(p->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {
  "gradient_xx", "gradient_xy", "gradient_xz", "gradient_yx", "gradient_yy", "gradient_yz",
  "gradient_zx", "gradient_zy", "gradient_zz", "stress_xx",   "stress_xy",   "stress_xz",
  "stress_yx",   "stress_yy",   "stress_yz",   "stress_zx",   "stress_zy",   "stress_zz",
  "work",        "energy",      "hold_x",      "hold_y",      "hold_z"};

const SbEffectType SbEffectPeriodic = {
  .name = "periodic",
  .size = sizeof(Periodic),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_periodic,
          .couplings = couplings_periodic,
          .setup = setup_periodic,
          .force = force_periodic,
          .tangent = tangent_periodic,
          .settle = settle_periodic,
          .accept = accept_periodic,
          .save = save_periodic,
          .load = load_periodic,
          .history = history_periodic,
          .destroy = destroy_periodic},
};
