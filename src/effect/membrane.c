/*
  membrane.c - a skin on part of the surface: a thin incompressible layer that resists stretching
  and has no stiffness in bending, and a tension in it, as surface tension has it.

  At a point of a facet F = dx/dX, 3 by 2, X along two orthogonal directions of its plane at rest,
  C = F^T F, J^2 = det C the change of area, squared. With the modulus mu = E / 3 of the layer, its
  thickness h, J its stretch of area and so 1 / J that of the thickness, and a tension s, N/m,

    W = h mu / 2 (tr C + 1 / J^2 - 3) + s J                          J/m^2 at rest
    P = dW/dF = h mu (F - F C^-1 / J^2) + s J F C^-1,   f_a = - integral P dphi_a/dX dA.

  The tangent is the exact second derivative. Under compression P is negative: nothing but the body
  below keeps the skin from wrinkles. Facets of P1 are flat, with one point; those of P2 have six
  nodes, and a rule of degree 5. Adkins and Rivlin, Large elastic deformations of isotropic
  materials IX, Phil. Trans. R. Soc. A 244 (1952).
*/
#include "facet_point.h"
#include "sbgeometry.h"

typedef struct {
  PetscInt cell, n;
  PetscInt node[SB_CELL_NODES];
  PetscReal B[SB_CELL_NODES][2]; /* dphi/dX, 1/m */
  PetscReal area;                /* at rest, m^2, times the weight of the rule */
} Point;

typedef struct {
  PetscReal modulus, thickness; /* E, Pa, m */
  SbFormula tension;            /* N/m */
  PetscInt n;
  Point *point; /* [n] of owned and ghost cells */
} Membrane;

/* At a stage: C^-1 and J^2 of a point with its F. */
typedef struct {
  PetscReal F[3][2], inverse[2][2], J2;
} Stretch;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose boundary facets have the skin"},
  {"young", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "Young's modulus of the skin, which is incompressible (neo-Hookean)"},
  {"thickness", SB_OPTION_REAL, 1, "m", "0", "[0, inf)", "its thickness at rest"},
  {"tension", SB_OPTION_FORMULA, 1, "N/m", "0", "",
   "tension besides, of any stretch, as surface tension; a formula of the time t"},
};

static PetscErrorCode options_membrane(SbEffect e, const SbScope *scope)
{
  Membrane *m = (Membrane *)e->data;
  PetscBool given;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "young", &m->modulus));
  PetscCall(SbOptionReal(scope, "thickness", &m->thickness));
  PetscCall(SbEffectFormulas(e, scope, "tension", 1, PETSC_FALSE, &m->tension));
  PetscCheck((m->modulus > 0) == (m->thickness > 0), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: -effect_%s_young and -effect_%s_thickness belong together", e->name,
             e->name, e->name);
  PetscCall(SbOptionGiven(scope, "tension", &given));
  PetscCheck(given || m->modulus > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_young (Pa) and -effect_%s_thickness (m), or "
             "-effect_%s_tension (N/m)",
             e->name, e->name, e->name, e->name);
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point of a facet at rest. */
static void set_point(SbSpace space, const SbFacet *facet, int q, Point *at)
{
  FacetPoint p;
  PetscReal side[2][3] = {{0}};
  PetscReal normal[3], along, up, across;

  facet_point(space, facet, q, &p);
  add_sides(&p, space->node_x, side);
  SbCross(side[0], side[1], normal);
  along = PetscSqrtReal(SbDot3(side[0], side[0]));
  across = SbDot3(side[0], side[1]) / along;
  up = PetscSqrtReal(SbDot3(normal, normal)) / along;
  *at = (Point){.cell = facet->cell, .n = p.n, .area = p.weight * along * up};
  for (PetscInt a = 0; a < p.n; a++) {
    at->node[a] = p.node[a];
    at->B[a][0] = p.along[0][a] / along;
    at->B[a][1] = (p.along[1][a] - p.along[0][a] * across / along) / up;
  }
}

static PetscErrorCode setup_membrane(SbEffect e, SbSpace space)
{
  Membrane *m = (Membrane *)e->data;
  SbFacet *facet;
  PetscReal area = 0;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &n, &facet));
  PetscCall(PetscMalloc1(SbRuleFacet.n * n, &m->point));
  for (PetscInt i = 0; i < n; i++) {
    const SbElement element = SbSpaceCellElement(space, facet[i].cell);
    const char *body = space->mesh->body[space->mesh->cell_body[facet[i].cell]].name;

    PetscCheck(!SbElementHasFaces(element) && !element->rigid, PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT,
               "%s: body '%s' is %s: a membrane is on bodies with element p1 or p2", e->on.option,
               body, element->rigid ? "rigid" : element->name);
    for (int q = first_point(space, &facet[i]); q < SbRuleFacet.n; q++, m->n++) {
      set_point(space, &facet[i], q, &m->point[m->n]);
      if (facet[i].cell < space->mesh->ncell_owned)
        area += m->point[m->n].area;
    }
  }
  PetscCall(PetscFree(facet));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPIU_REAL, MPI_SUM, space->comm));
  SbFormat(sizeof(e->note), e->note, "on %.6g m^2", (double)area);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void measure(SbSpace space, const Point *at, const PetscReal u[], Stretch *now)
{
  PetscReal C[2][2];

  *now = (Stretch){.J2 = 0};
  for (PetscInt a = 0; a < at->n; a++)
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 2; k++)
        now->F[i][k] += (space->node_x[3 * at->node[a] + i] + u[3 * at->node[a] + i]) * at->B[a][k];
  for (int k = 0; k < 2; k++)
    for (int l = 0; l < 2; l++)
      C[k][l] =
        now->F[0][k] * now->F[0][l] + now->F[1][k] * now->F[1][l] + now->F[2][k] * now->F[2][l];
  now->J2 = C[0][0] * C[1][1] - C[0][1] * C[0][1];
  now->inverse[0][0] = C[1][1] / now->J2;
  now->inverse[1][1] = C[0][0] / now->J2;
  now->inverse[0][1] = now->inverse[1][0] = -C[0][1] / now->J2;
}

/* out = F times a 2 by 2 matrix. */
static void times(const PetscReal F[3][2], const PetscReal A[2][2], PetscReal out[3][2])
{
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 2; k++)
      out[i][k] = F[i][0] * A[0][k] + F[i][1] * A[1][k];
}

/* P, N/m, for h mu and s. */
static void find_stress(const Stretch *now, PetscReal stiff, PetscReal tension, PetscReal P[3][2])
{
  const PetscReal part = tension * PetscSqrtReal(now->J2) - stiff / now->J2;

  times(now->F, now->inverse, P);
  for (int k = 0; k < 6; k++)
    P[k / 2][k % 2] = stiff * now->F[k / 2][k % 2] + part * P[k / 2][k % 2];
}

/* Its derivative along dF. */
static void turn_stress(const Stretch *now, PetscReal stiff, PetscReal tension,
                        const PetscReal dF[3][2], PetscReal dP[3][2])
{
  const PetscReal J = PetscSqrtReal(now->J2);
  const PetscReal part = tension * J - stiff / now->J2;
  PetscReal FC[3][2], dFC[3][2], dC[2][2], half[2][2], whole[2][2], FCC[3][2], trace;

  times(now->F, now->inverse, FC);
  times(dF, now->inverse, dFC);
  for (int k = 0; k < 2; k++)
    for (int l = 0; l < 2; l++) {
      dC[k][l] = 0;
      for (int i = 0; i < 3; i++)
        dC[k][l] += now->F[i][k] * dF[i][l] + dF[i][k] * now->F[i][l];
    }
  trace = now->inverse[0][0] * dC[0][0] + 2 * now->inverse[0][1] * dC[0][1] +
          now->inverse[1][1] * dC[1][1];

  /* d(C^-1) = -C^-1 dC C^-1 */
  for (int k = 0; k < 2; k++)
    for (int l = 0; l < 2; l++)
      half[k][l] = now->inverse[k][0] * dC[0][l] + now->inverse[k][1] * dC[1][l];
  for (int k = 0; k < 2; k++)
    for (int l = 0; l < 2; l++)
      whole[k][l] = half[k][0] * now->inverse[0][l] + half[k][1] * now->inverse[1][l];
  times(now->F, whole, FCC);
  for (int k = 0; k < 6; k++) {
    const int i = k / 2;
    const int j = k % 2;

    dP[i][j] = stiff * dF[i][j] + part * (dFC[i][j] - FCC[i][j]) +
               trace * (tension * J / 2 + stiff / now->J2) * FC[i][j];
  }
}

static PetscErrorCode force_membrane(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Membrane *m = (const Membrane *)e->data;
  const PetscReal stiff = m->modulus / 3 * m->thickness;
  PetscReal tension;

  PetscFunctionBeginUser;
  PetscCall(SbEffectValueAt(e, m->tension, stage->t, &tension));
  for (const Point *at = m->point; at < m->point + m->n; at++) {
    PetscReal P[3][2];
    Stretch now;

    measure(space, at, stage->u, &now);
    find_stress(&now, stiff, tension, P);
    for (PetscInt a = 0; a < at->n; a++)
      for (int i = 0; i < 3; i++)
        f[3 * at->node[a] + i] -= at->area * (P[i][0] * at->B[a][0] + P[i][1] * at->B[a][1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_membrane(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Membrane *m = (const Membrane *)e->data;
  const PetscReal stiff = m->modulus / 3 * m->thickness;
  PetscReal tension;

  PetscFunctionBeginUser;
  PetscCall(SbEffectValueAt(e, m->tension, stage->t, &tension));
  for (const Point *at = m->point; at < m->point + m->n; at++) {
    const PetscReal weight = stage->shift_k * at->area;
    Stretch now;

    measure(space, at, stage->u, &now);
    for (PetscInt b = 0; b < at->n; b++) {
      PetscReal dP[3][3][2];

      if (at->B[b][0] == 0 && at->B[b][1] == 0)
        continue; /* a node off the facet */
      for (int j = 0; j < 3; j++) {
        PetscReal dF[3][2] = {{0}};

        dF[j][0] = at->B[b][0];
        dF[j][1] = at->B[b][1];
        turn_stress(&now, stiff, tension, dF, dP[j]);
      }
      for (PetscInt a = 0; a < at->n; a++) {
        PetscReal block[9];

        if (at->B[a][0] == 0 && at->B[a][1] == 0)
          continue;
        for (int k = 0; k < 9; k++)
          block[k] =
            weight * (dP[k % 3][k / 3][0] * at->B[a][0] + dP[k % 3][k / 3][1] * at->B[a][1]);
        PetscCall(SbSpaceAddCellBlock(space, A, at->cell, a, b, block));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its area, m^2, and its energy, J, without that of a tension: this rank's part. */
static PetscErrorCode history_membrane(SbEffect e, SbSpace space, const SbStage *stage,
                                       const PetscReal residual[], PetscReal values[])
{
  const Membrane *m = (const Membrane *)e->data;
  const PetscReal stiff = m->modulus / 3 * m->thickness;

  PetscFunctionBeginUser;
  (void)residual;
  for (const Point *at = m->point; at < m->point + m->n; at++) {
    PetscReal trace = 0;
    Stretch now;

    if (at->cell >= space->mesh->ncell_owned)
      continue;
    measure(space, at, stage->u, &now);
    for (int k = 0; k < 6; k++)
      trace += PetscSqr(now.F[k / 2][k % 2]);
    values[0] += at->area * PetscSqrtReal(now.J2);
    if (SbEffectActs(e, stage->t))
      values[1] += at->area * stiff / 2 * (trace + 1 / now.J2 - 3);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_membrane(SbEffect e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(((Membrane *)e->data)->point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"area", "energy"};

const SbEffectType SbEffectMembrane = {
  .name = "membrane",
  .size = sizeof(Membrane),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_membrane,
          .setup = setup_membrane,
          .force = force_membrane,
          .tangent = tangent_membrane,
          .history = history_membrane,
          .destroy = destroy_membrane},
};
