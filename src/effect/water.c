/*
  water.c - water around bodies, or another fluid: buoyancy below a level, and drag.

  Up is against gravity, k; d = level - k . x is the depth of a place x. On the wet part of a facet,
  where d > 0, with its current outward normal n,

    f_a = integral phi_a (-p n + q) dA,   p = rho g d.

  Facets that the level cuts are cut there, so that integrals are exact for flat facets; those of P2
  are cut as four flat ones in the coordinates of the facet. On a closed surface, and on one whose
  rim is dry or held, the pressure has a potential, the integral of p over the volume V inside it
  that is wet,

    E = integral_V p dV = - integral rho g d^2 / 2 n . k dA:

  with the body's weight it gives draught, heave and metacentric height, and needs no damping to
  be kept. The matrix gets the symmetric part of the derivative, facet by facet, as that of
  pressure.c does: it is exact where there is a potential.

  Drag per current area by the velocity r = v - w of the surface relative to the water's, w(x, t),
  with r_n = r . n and r_t = r - r_n n,

    q = - rho / 2 (C_n |r_n| r_n n + C_t |r_t| r_t) - c r:

  both sides of a body count, so C_n is half of the drag coefficient of a plate, that of a sphere,
  and 3/4 of that of a cylinder (Morison, O'Brien, Johnson and Schaaf, "The force exerted by surface
  waves on piles", 1950). The derivative by v is symmetric and in the matrix; that by the places is
  not: it is small in a time step, and in a static run Newton's method converges linearly.

  Not handled: water that bodies move or shield, the inertia of water (mass.c has a mass that goes
  along), waves that move the level, flow into openings.
*/
#include "facet_point.h"
#include "pressure.h"
#include "sbgeometry.h"

typedef struct {
  PetscBool has_level, has_drag;
  SbFormula level, velocity[3];      /* m, m/s */
  PetscReal density, g, up[3];       /* kg/m^3, m/s^2, unit vector */
  PetscReal normal, tangent, linear; /* C_n, C_t, c, Pa s/m */
  PetscInt n;
  SbFacet *facet; /* [n] of owned and ghost cells */

  /* work of drag up to the end of the last step, J, and its power there, W, of this rank's cells */
  PetscReal work, power;
} Water;

#define PARTS 8 /* triangles of the wet part of a facet at most: two of each of four */

/* Triangles in a facet, by the barycentric coordinates of their corners. */
typedef struct {
  PetscInt n;
  PetscReal corner[PARTS][3][3];
} Wet;

/* A point of the rule in the wet part of a facet. */
typedef struct {
  FacetPoint at;
  PetscReal side[2][3], N[3]; /* X, Y, and X x Y, m^2 */
  PetscReal x[3], depth;      /* m */
} Point;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "boundary", "",
   "sets whose boundary facets the water touches; default: all"},
  {"level", SB_OPTION_FORMULA, 1, "m", "", "",
   "height of the water line: how far it is from the origin, against gravity; a formula of the "
   "time t; without it there is no buoyancy, and everything is wet"},
  {"density", SB_OPTION_REAL, 1, "kg/m^3", "1000", "(0, inf)", "density of the water"},
  {"gravity", SB_OPTION_REALS, 3, "m/s^2", "0,0,-9.81", "",
   "acceleration that makes the pressure of the water: that of the effect gravity"},
  {"drag_normal", SB_OPTION_REAL, 1, "", "0", "[0, inf)",
   "coefficient of drag normal to the surface: 0.5 for a sphere, 1 for a plate or a cylinder"},
  {"drag_tangent", SB_OPTION_REAL, 1, "", "0", "[0, inf)",
   "coefficient of drag along the surface, of friction: 0.002 to 0.01"},
  {"drag_linear", SB_OPTION_REAL, 1, "Pa s/m", "0", "[0, inf)",
   "force per area over velocity, besides, in slow or viscous flow"},
  {"velocity", SB_OPTION_FORMULA, 3, "m/s", "0;0;0", "",
   "velocity of the water, three formulas of t and the current place x, y, z"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on all forces of the water, a formula of the time t, at least 0"},
};

static PetscErrorCode options_water(SbEffect e, const SbScope *scope)
{
  static const char *const of[][2] = {{"gravity", "level"}, {"velocity", "drag_normal"}};
  Water *w = (Water *)e->data;
  PetscReal gravity[3];

  PetscFunctionBeginUser;
  PetscCall(SbOptionGiven(scope, "level", &w->has_level));
  if (w->has_level)
    PetscCall(SbEffectFormulas(e, scope, "level", 1, PETSC_FALSE, &w->level));
  PetscCall(SbOptionReal(scope, "density", &w->density));
  PetscCall(SbOptionReals(scope, "gravity", gravity));
  PetscCall(SbOptionReal(scope, "drag_normal", &w->normal));
  PetscCall(SbOptionReal(scope, "drag_tangent", &w->tangent));
  PetscCall(SbOptionReal(scope, "drag_linear", &w->linear));
  PetscCall(SbEffectFormulas(e, scope, "velocity", 3, PETSC_TRUE, w->velocity));
  w->has_drag = (PetscBool)(w->normal > 0 || w->tangent > 0 || w->linear > 0);
  PetscCheck(w->has_level || w->has_drag, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: the water has no force: give its -effect_%s_level (m), or a drag, "
             "-effect_%s_drag_normal, _drag_tangent (numbers) or _drag_linear (Pa s/m)",
             e->name, e->name, e->name);
  for (int k = 0; k < 2; k++) {
    PetscBool given;

    PetscCall(SbOptionGiven(scope, of[k][0], &given));
    PetscCheck(!given || (k ? w->has_drag : w->has_level), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-effect_%s_%s does nothing without %s: give -effect_%s_%s, too", e->name, of[k][0],
               k ? "a drag" : "a level", e->name, of[k][1]);
  }
  for (int k = 0; k < 3; k++)
    w->up[k] = -gravity[k];
  w->g = SbNormalise(w->up);
  PetscCheck(!w->has_level || w->g > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_gravity is 0,0,0 m/s^2: water has a level by its weight only; leave "
             "-effect_%s_level out for drag alone",
             e->name, e->name);
  e->linear = PETSC_FALSE;
  e->stiff = w->has_drag;
  e->nstate = 2;
  if (w->has_drag)
    PetscFunctionReturn(PETSC_SUCCESS);
  e->ops.accept = NULL;
  e->ops.save = NULL;
  e->ops.load = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The height of the water line, m, and the factor on all forces. */
static PetscErrorCode water_at(SbEffect e, PetscReal t, PetscReal *level, PetscReal *factor)
{
  const Water *w = (const Water *)e->data;

  PetscFunctionBeginUser;
  *level = 0;
  if (w->has_level)
    PetscCall(SbFormulaEval(w->level, t, NULL, level));
  PetscCall(SbFormulaEval(e->time, t, NULL, factor));
  PetscCheck(*factor >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "-effect_%s_time is %g at t = %g: a factor on the forces of the water has to be at "
             "least 0",
             e->name, (double)*factor, (double)t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of a triangle L, with the depths d at its corners, that is wet. */
static void add_wet(const PetscReal L[3][3], const PetscReal d[3], Wet *wet)
{
  PetscReal polygon[4][3];
  int n = 0;

  for (int a = 0; a < 3; a++) {
    const int b = (a + 1) % 3;

    for (int c = 0; c < 3 && d[a] > 0; c++)
      polygon[n][c] = L[a][c];
    n += d[a] > 0;
    if ((d[a] > 0) == (d[b] > 0))
      continue;
    for (int c = 0; c < 3; c++)
      polygon[n][c] = L[a][c] + d[a] / (d[a] - d[b]) * (L[b][c] - L[a][c]);
    n++;
  }
  for (int k = 2; k < n; k++, wet->n++)
    for (int c = 0; c < 3; c++) {
      wet->corner[wet->n][0][c] = polygon[0][c];
      wet->corner[wet->n][1][c] = polygon[k - 1][c];
      wet->corner[wet->n][2][c] = polygon[k][c];
    }
}

/* The current place, m, of the point with these barycentric coordinates in a facet. */
static void place_at(SbSpace space, const SbFacet *facet, const PetscReal at[3],
                     const PetscReal u[], PetscReal x[3])
{
  PetscReal phi[SB_CELL_NODES];
  PetscReal L[4] = {0};
  PetscInt n;

  for (int c = 0; c < 3; c++)
    L[facet->corner[c]] = at[c];
  n = SbCellBasis(space, facet->cell, L, phi);
  x[0] = x[1] = x[2] = 0;
  for (PetscInt a = 0; a < n; a++) {
    const PetscInt node = 3 * SbSpaceCellNode(space, facet->cell, a);

    for (int i = 0; i < 3; i++)
      x[i] += phi[a] * (space->node_x[node + i] + (u ? u[node + i] : 0));
  }
}

/* The wet part of a facet: all of it without a level. Of P2 it is found in the four triangles
   between corners and middles of edges. */
static void find_wet(const Water *w, SbSpace space, const SbFacet *facet, PetscReal level,
                     const PetscReal u[], Wet *wet)
{
  static const PetscReal L[6][3] = {{1, 0, 0},     {0, 1, 0},     {0, 0, 1},
                                    {0.5, 0.5, 0}, {0, 0.5, 0.5}, {0.5, 0, 0.5}};
  static const int part[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
  static const PetscReal deep[3] = {1, 1, 1};
  const int n = SbSpaceCellElement(space, facet->cell)->nodes_per[1] ? 6 : 3;
  PetscReal d[6];
  int nwet = 0;

  wet->n = 0;
  for (int k = 0; k < n && w->has_level; k++) {
    PetscReal x[3];

    place_at(space, facet, L[k], u, x);
    d[k] = level - SbDot3(w->up, x);
    nwet += d[k] > 0;
  }
  if (!w->has_level || nwet == n)
    add_wet(L, deep, wet);
  else if (n == 3)
    add_wet(L, d, wet);
  else if (nwet)
    for (int k = 0; k < 4; k++) {
      PetscReal corner[3][3], depth[3];

      for (int c = 0; c < 3; c++) {
        depth[c] = d[part[k][c]];
        for (int i = 0; i < 3; i++)
          corner[c][i] = L[part[k][c]][i];
      }
      add_wet((const PetscReal(*)[3])corner, depth, wet);
    }
}

/* The points of the rule in the wet part of a facet, u NULL: at rest; returns their number. */
static PetscInt find_points(const Water *w, SbSpace space, const SbFacet *facet, PetscReal level,
                            const PetscReal u[], Point point[PARTS * SB_POINTS])
{
  PetscInt n = 0;
  Wet wet;

  find_wet(w, space, facet, level, u, &wet);
  for (PetscInt k = 0; k < wet.n; k++) {
    const PetscReal(*c)[3] = (const PetscReal(*)[3])wet.corner[k];
    PetscReal cross[3];

    SbCross(c[1], c[2], cross);
    for (int q = 0; q < SbRuleFacet.n; q++, n++) {
      const PetscReal *b = SbRuleFacet.L[q];
      Point *p = &point[n];
      PetscReal L[3];

      for (int i = 0; i < 3; i++)
        L[i] = b[0] * c[0][i] + b[1] * c[1][i] + b[2] * c[2][i];
      facet_point_at(space, facet, L, &p->at);
      p->at.weight = 0.5 * SbRuleFacet.weight[q] * PetscAbsReal(SbDot3(c[0], cross));
      for (int i = 0; i < 6; i++)
        p->side[i / 3][i % 3] = 0;
      add_sides(&p->at, space->node_x, p->side);
      add_sides(&p->at, u, p->side);
      SbCross(p->side[0], p->side[1], p->N);
      place_at(space, facet, L, u, p->x);
      p->depth = level - SbDot3(w->up, p->x);
    }
  }
  return n;
}

/* Drag at a point: the force per area, Pa; D[9], if not NULL, minus its derivative by v, Pa s/m;
   the area of the point, m^2; v, if not NULL, its velocity. */
static PetscErrorCode find_drag(const Water *w, const Point *p, const SbStage *stage,
                                PetscReal drag[3], PetscReal D[9], PetscReal *area, PetscReal v[3])
{
  const PetscReal half = w->density / 2;
  PetscReal n[3] = {p->N[0], p->N[1], p->N[2]};
  PetscReal r[3] = {0};
  PetscReal along[3], normal, speed;

  PetscFunctionBeginUser;
  *area = p->at.weight * SbNormalise(n);
  for (int a = 0; stage->v && a < p->at.n; a++)
    for (int i = 0; i < 3; i++)
      r[i] += p->at.phi[a] * stage->v[3 * p->at.node[a] + i];
  for (int i = 0; i < 3; i++) {
    PetscReal of_water;

    if (v)
      v[i] = r[i];
    PetscCall(SbFormulaEval(w->velocity[i], stage->t, p->x, &of_water));
    r[i] -= of_water;
  }
  normal = SbDot3(r, n);
  for (int i = 0; i < 3; i++)
    along[i] = r[i] - normal * n[i];
  speed = PetscSqrtReal(SbDot3(along, along));
  for (int i = 0; i < 3; i++)
    drag[i] =
      -half * (w->normal * PetscAbsReal(normal) * normal * n[i] + w->tangent * speed * along[i]) -
      w->linear * r[i];
  for (int k = 0; D && k < 9; k++) {
    const int i = k / 3;
    const int j = k % 3;

    D[k] = 2 * half * w->normal * PetscAbsReal(normal) * n[i] * n[j] +
           half * w->tangent * speed * ((i == j) - n[i] * n[j]) + w->linear * (i == j);
    if (speed > 0)
      D[k] += half * w->tangent * along[i] * along[j] / speed;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_water(SbEffect e, SbSpace space)
{
  Water *w = (Water *)e->data;
  PetscReal sum[3] = {0}; /* area, volume inside, that below the level */
  PetscReal at[3], level, factor;
  PetscInt nrim[2];
  SbPressure surface;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &w->n, &w->facet));
  surface = (SbPressure){.nall = w->n, .facet = w->facet};
  PetscCall(SbPressureRim(&surface, space->mesh, nrim, at));
  PetscCall(water_at(e, 0, &level, &factor));
  for (PetscInt k = 0; k < w->n; k++) {
    Point point[PARTS * SB_POINTS];
    PetscInt n;

    if (w->facet[k].cell >= space->mesh->ncell_owned)
      continue;
    n = find_points(w, space, &w->facet[k], level, NULL, point);
    sum[0] += w->facet[k].area;
    sum[1] +=
      w->facet[k].area / 3 * SbDot3(space->mesh->x + 3 * w->facet[k].vertex[0], w->facet[k].normal);
    for (PetscInt q = 0; q < n; q++)
      sum[2] -= point[q].at.weight * point[q].depth * SbDot3(w->up, point[q].N);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPI_SUM, space->comm));
  e->no_potential = (PetscBool)(w->has_level && nrim[0] > 0);
  if (!w->has_level)
    SbFormat(sizeof(e->note), e->note, "drag on %.6g m^2; there is no water line, and no buoyancy",
             (double)sum[0]);
  else if (nrim[0])
    SbFormat(sizeof(e->note), e->note,
             "on %.6g m^2, an open surface: its rim has %" PetscInt_FMT
             " edges, the first at (%.4g, %.4g, %.4g); where that is wet and free, buoyancy has no "
             "potential",
             (double)sum[0], nrim[0], (double)at[0], (double)at[1], (double)at[2]);
  else
    SbFormat(sizeof(e->note), e->note, "around %.6g m^3, of which %.6g are below the level at rest",
             (double)sum[1], (double)sum[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_water(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Water *w = (const Water *)e->data;
  PetscReal level, factor;

  PetscFunctionBeginUser;
  PetscCall(water_at(e, stage->t, &level, &factor));
  for (PetscInt k = 0; k < w->n; k++) {
    Point point[PARTS * SB_POINTS];
    const PetscInt n = find_points(w, space, &w->facet[k], level, stage->u, point);

    for (PetscInt q = 0; q < n; q++) {
      const Point *p = &point[q];
      const PetscReal pressure = w->has_level ? w->density * w->g * p->depth : 0;
      PetscReal drag[3] = {0};
      PetscReal area = 0;

      if (w->has_drag)
        PetscCall(find_drag(w, p, stage, drag, NULL, &area, NULL));
      for (int a = 0; a < p->at.n; a++)
        for (int i = 0; i < 3; i++)
          f[3 * p->at.node[a] + i] +=
            factor * p->at.phi[a] * (area * drag[i] - p->at.weight * pressure * p->N[i]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* block += what a point gives for the nodes a and b. */
static void add_block(const Water *w, const Point *p, int a, int b, PetscReal stiff,
                      PetscReal block[9])
{
  const FacetPoint *at = &p->at;
  const PetscReal y = at->phi[a] * at->along[1][b] - at->phi[b] * at->along[1][a];
  const PetscReal x = at->phi[a] * at->along[0][b] - at->phi[b] * at->along[0][a];
  const PetscReal slope = stiff * w->density * w->g * at->weight / 2;
  PetscReal d[3];

  /* the facet turns and stretches under the pressure, which grows with the depth */
  for (int i = 0; i < 3; i++)
    d[i] = slope * p->depth * (y * p->side[0][i] - x * p->side[1][i]);
  block[1] -= d[2];
  block[2] += d[1];
  block[3] += d[2];
  block[5] -= d[0];
  block[6] -= d[1];
  block[7] += d[0];
  for (int k = 0; k < 9; k++)
    block[k] -=
      slope * at->phi[a] * at->phi[b] * (p->N[k / 3] * w->up[k % 3] + w->up[k / 3] * p->N[k % 3]);
}

static PetscErrorCode tangent_water(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Water *w = (const Water *)e->data;
  PetscReal level, factor;

  PetscFunctionBeginUser;
  PetscCall(water_at(e, stage->t, &level, &factor));
  for (PetscInt k = 0; k < w->n; k++) {
    PetscReal block[SB_CELL_NODES][SB_CELL_NODES][9] = {{{0}}};
    Point point[PARTS * SB_POINTS];
    const PetscInt n = find_points(w, space, &w->facet[k], level, stage->u, point);

    for (PetscInt q = 0; q < n; q++) {
      const Point *p = &point[q];
      PetscReal D[9] = {0};
      PetscReal area = 0;
      PetscReal drag[3];

      if (w->has_drag && stage->shift_v != 0)
        PetscCall(find_drag(w, p, stage, drag, D, &area, NULL));
      for (int a = 0; a < p->at.n; a++)
        for (int b = 0; b < p->at.n; b++) {
          if (w->has_level)
            add_block(w, p, a, b, stage->shift_k * factor, block[a][b]);
          for (int i = 0; i < 9; i++)
            block[a][b][i] += stage->shift_v * factor * area * p->at.phi[a] * p->at.phi[b] * D[i];
        }
    }
    for (int a = 0; n && a < point[0].at.n; a++)
      for (int b = 0; b < point[0].at.n; b++)
        PetscCall(SbSpaceAddCellBlock(space, A, w->facet[k].cell, a, b, block[a][b]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of this rank's cells: force, N, wet volume, m^3, energy of buoyancy, J, power of drag, W. */
static PetscErrorCode measure(SbEffect e, SbSpace space, const SbStage *stage, PetscReal values[6])
{
  const Water *w = (const Water *)e->data;
  PetscReal level, factor;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(values, 6));
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(water_at(e, stage->t, &level, &factor));
  factor *= e->steady && !e->dynamic ? stage->t : 1; /* the load factor of a static run */
  for (PetscInt k = 0; k < w->n; k++) {
    Point point[PARTS * SB_POINTS];
    PetscInt n;

    if (w->facet[k].cell >= space->mesh->ncell_owned)
      continue;
    n = find_points(w, space, &w->facet[k], level, stage->u, point);
    for (PetscInt q = 0; q < n; q++) {
      const Point *p = &point[q];
      const PetscReal weight = factor * p->at.weight * w->density * w->g;
      const PetscReal rises = SbDot3(w->up, p->N);
      PetscReal drag[3] = {0};
      PetscReal v[3] = {0};
      PetscReal area = 0;

      if (w->has_drag)
        PetscCall(find_drag(w, p, stage, drag, NULL, &area, v));
      for (int i = 0; i < 3; i++)
        values[i] += factor * area * drag[i] - (w->has_level ? weight * p->depth * p->N[i] : 0);
      values[5] += factor * area * SbDot3(drag, v);
      if (!w->has_level)
        continue;
      values[3] -= p->at.weight * p->depth * rises;
      values[4] -= weight * p->depth * p->depth / 2 * rises;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_water(SbEffect e, SbSpace space, const SbStage *stage)
{
  Water *w = (Water *)e->data;
  PetscReal values[6];

  PetscFunctionBeginUser;
  PetscCall(measure(e, space, stage, values));
  w->work += stage->dt / 2 * (w->power + values[5]);
  w->power = values[5];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One record for each rank, of which the first rank takes the sum. */
static PetscErrorCode save_water(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Water *w = (const Water *)e->data;

  PetscFunctionBeginUser;
  (void)space;
  *n = 1;
  PetscCall(PetscMalloc1(2, records));
  (*records)[0] = w->work;
  (*records)[1] = w->power;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_water(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                 PetscInt n, const PetscReal records[])
{
  Water *w = (Water *)e->data;

  PetscFunctionBeginUser;
  (void)t;
  (void)u;
  w->work = w->power = 0;
  for (PetscInt k = 0; k < n && !space->rank; k++) {
    w->work += records[2 * k];
    w->power += records[2 * k + 1];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_water(SbEffect e, SbSpace space, const SbStage *stage,
                                    const PetscReal residual[], PetscReal values[])
{
  Water *w = (Water *)e->data;
  PetscReal now[6];

  PetscFunctionBeginUser;
  (void)residual;
  PetscCall(measure(e, space, stage, now));
  for (int k = 0; k < 5; k++)
    values[k] += now[k];

  /* the power when a run begins, too */
  w->power = now[5];
  values[5] += w->work;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_water(SbEffect e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(((Water *)e->data)->facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"force_x", "force_y", "force_z",
                                      "volume",  "energy",  "drag_work"};

const SbEffectType SbEffectWater = {
  .name = "water",
  .size = sizeof(Water),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_water,
          .setup = setup_water,
          .force = force_water,
          .tangent = tangent_water,
          .accept = accept_water,
          .save = save_water,
          .load = load_water,
          .history = history_water,
          .destroy = destroy_water},
};
