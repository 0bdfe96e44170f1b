/*
  cavity.c - a closed cavity that is filled: a chamber of a soft robot, a ventricle, an eye, a ball.

  V the current volume inside the surface, V_0 that at rest, V_f = V_0 + added(t) that of the fluid
  without pressure, the pressure above that outside is

    p = M ((V_f / V)^n - 1),   f = -p dV/dx (pressure.c).

  n = 1 and M its bulk modulus is a liquid, whose volume is given; M the pressure outside and n = 1
  or 1.4 is a gas at constant temperature, or without exchange of heat. The energy of the fluid,
  zero at V = V_f, is

    n = 1:  M (V - V_f - V_f ln(V / V_f)),
    else    M (V_f / (n - 1) ((V_f / V)^(n - 1) - 1) + V - V_f).

  Tangent: that of the pressure p, and -dp/dV g g^T with g = dV/dx, which couples all nodes of the
  surface: one coupling. It is positive semi-definite. The volume of an iterate may be off by a
  percent, the pressure of a liquid by a percent of its modulus then, which would make the first
  part indefinite: as long as it is far from that at the end of the last step, that one is taken
  (with nothing of the kind, a gripper of two fingers took 7 times as long).

  In a static run an `added` without t grows with the load factor. Bodies have nodes at vertices: P1
  and P2.
*/
#include "pressure.h"
#include "sbgeometry.h"

#define WATER 2.2e9 /* Pa, bulk modulus */
#define STIFFER \
  1e5 /* default over Young's modulus of the wall: V is that of the fluid to 1e-6 or so */
#define STIFFEST \
  1e7 /* the same at most: in tests/verify/cavity.py 1e8 changes p by 1e-4, 1e10 by a quarter */
#define NEARLY \
  0.1 /* of the wall's modulus: difference of pressures below which that of an iterate is taken: 0.01, \
         1 and 10 take as many, 1.1 and 1.6 times as many iterations in the gripper */
#define MANY 2000 /* nodes whose dense block is large: 300 MB */

typedef struct {
  SbPressure surface;
  SbFormula added; /* m^3 */
  PetscReal modulus, exponent;
  PetscReal rest;  /* volume at rest, m^3 */
  PetscInt number; /* of the coupling; -1: none of its nodes is owned here */
  PetscInt n;      /* its nodes */
  PetscReal *g;    /* [nnode][3] dV/dx, m^2 */
  PetscReal *K;    /* [3 n][3 n] */
  PetscReal wall;  /* its Young's modulus, Pa */
  PetscReal kept;  /* pressure at the end of the last step, Pa */
  PetscBool bends; /* the pressure of the geometric stiffness is asked for */
} Cavity;

/* What fills it at a stage. */
typedef struct {
  PetscReal V, fluid; /* m^3 */
  PetscReal p;        /* Pa */
} Filling;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose boundary facets are the wall: a closed surface"},
  {"added", SB_OPTION_FORMULA, 1, "m^3", "0", "",
   "fluid that is pumped in, its volume without pressure, a formula of the time t; negative: drawn "
   "out"},
  {"modulus", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "bulk modulus of a liquid; of a gas the pressure outside, 101325 in air; 0: a liquid, 1e5 times "
   "as stiff as the wall, at most 2.2e9, water"},
  {"exponent", SB_OPTION_REAL, 1, "", "1", "[1, 10]",
   "n of p V^n: 1 for liquids and gases at constant temperature, 1.4 for air that exchanges no "
   "heat"},
};

static PetscErrorCode fill(SbEffect e, SbSpace space, const SbStage *stage, Filling *now)
{
  const Cavity *c = (const Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectValueAt(e, c->added, stage->t, &now->fluid));
  now->fluid += c->rest;
  PetscCheck(
    now->fluid > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "-effect_%s_added is %g m^3 at t = %g: no more than the volume at rest, %g m^3, can be "
    "drawn out",
    e->name, (double)(now->fluid - c->rest), (double)stage->t, (double)c->rest);
  PetscCall(SbPressureInside(&c->surface, space, stage->u, &now->V));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &now->V, 1, MPIU_REAL, MPI_SUM, space->comm));
  now->V *= c->surface.sign;

  /* without volume: no finite pressure */
  now->p =
    c->modulus * (now->V > 0 ? PetscPowReal(now->fluid / now->V, c->exponent) - 1 : PETSC_INFINITY);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode pressure_at(SbEffect e, SbSpace space, const SbStage *stage, PetscReal *p)
{
  const Cavity *c = (const Cavity *)e->data;
  Filling now;

  PetscFunctionBeginUser;
  PetscCall(fill(e, space, stage, &now));
  *p = now.p;
  if (c->bends && !(PetscAbsReal(now.p - c->kept) < NEARLY * c->wall))
    *p = c->kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_cavity(SbEffect e, const SbScope *scope)
{
  Cavity *c = (Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(e, scope, "added", 1, PETSC_FALSE, &c->added));
  PetscCall(SbOptionReal(scope, "modulus", &c->modulus));
  PetscCall(SbOptionReal(scope, "exponent", &c->exponent));
  c->surface.at = pressure_at;
  c->surface.follower = PETSC_TRUE;
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modulus, from that of the wall. */
static PetscErrorCode choose_modulus(SbEffect e, SbSpace space, PetscReal wall)
{
  Cavity *c = (Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &wall, 1, MPIU_REAL, MPI_MAX, space->comm));
  c->wall = wall;
  if (c->modulus == 0)
    c->modulus = PetscMin(WATER, STIFFER * wall);
  PetscCheck(
    c->modulus <= STIFFEST * wall, space->comm, PETSC_ERR_USER_INPUT,
    "-effect_%s_modulus is %g Pa, %.2g times Young's modulus of the wall, %g Pa: rounding "
    "of the volume would decide the pressure; give at most %g Pa, or leave it out: a liquid "
    "whose volume changes by a millionth or less",
    e->name, (double)c->modulus, (double)(c->modulus / wall), (double)wall,
    (double)(STIFFEST * wall));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All nodes of the surface are one coupling. */
static PetscErrorCode couplings_cavity(SbEffect e, SbSpace space)
{
  Cavity *c = (Cavity *)e->data;
  SbFacet *facets;
  PetscInt *mine, *all;
  PetscInt nfacet;
  PetscInt n = 0;
  PetscReal wall = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &nfacet, &facets));
  PetscCall(PetscMalloc1(SB_CELL_NODES * nfacet, &mine));
  for (PetscInt i = 0; i < nfacet; i++) {
    const PetscInt cell = facets[i].cell;
    const SbElement element = SbSpaceCellElement(space, cell);

    PetscCheck(!SbElementHasFaces(element) && !element->rigid, PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT,
               "%s: body '%s' is %s: a cavity is in bodies with element p1 or p2", e->on.option,
               space->mesh->body[space->mesh->cell_body[cell]].name,
               element->rigid ? "rigid" : element->name);

    wall =
      PetscMax(wall, SbMaterialYoungModulus(space->material[space->mesh->cell_material[cell]]));

    /* the nodes on the facet */
    for (PetscInt a = 0; a < (element->nodes_per[1] ? SB_CELL_NODES : 4); a++) {
      PetscReal L[4] = {1. / 3, 1. / 3, 1. / 3, 1. / 3};
      PetscReal phi[SB_CELL_NODES];

      L[facets[i].face] = 0;
      (void)SbCellBasis(space, cell, L, phi);
      if (phi[a] != 0)
        mine[n++] = space->gnode[SbSpaceCellNode(space, cell, a)];
    }
  }
  PetscCall(PetscFree(facets));
  PetscCall(choose_modulus(e, space, wall));
  PetscCall(PetscSortRemoveDupsInt(&n, mine));
  PetscCall(SbAllgatherv(space->comm, MPIU_INT, n, mine, &c->n, &all, NULL));
  PetscCall(PetscFree(mine));
  PetscCall(PetscSortRemoveDupsInt(&c->n, all));
  if (c->n > MANY)
    PetscCall(SbWarning(space->comm,
                        "effect %s: the cavity has %" PetscInt_FMT
                        " nodes, which its fluid couples "
                        "all with each other: %.2g GB in the matrix; a coarser wall, or a pressure "
                        "in its place, is faster",
                        e->name, c->n, 72e-9 * (double)c->n * (double)c->n));
  PetscCall(SbSpaceCouple(space, c->n, all, &c->number));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A facet of the wall, as ranks send it. */
typedef struct {
  PetscInt vertex[3]; /* gvert */
  PetscReal x[3][3];  /* m, counter-clockwise seen from outside of its body */
} Facet;

/* A closed surface among them. */
typedef struct {
  PetscReal volume; /* m^3, negative around a cavity */
  PetscReal box[6]; /* m */
} Wall;

/* The facets of all ranks. */
static PetscErrorCode gather(const SbPressure *surface, SbSpace space, PetscInt *n, Facet **facet)
{
  const SbMesh mesh = space->mesh;
  PetscInt nmine = 0;
  Facet *mine;
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(surface->nfacet, &mine));
  for (const SbFacet *f = surface->facet; f < surface->facet + surface->nfacet; f++) {
    if (f->cell >= mesh->ncell_owned)
      continue;
    for (int c = 0; c < 3; c++) {
      mine[nmine].vertex[c] = mesh->gvert[f->vertex[c]];
      for (int k = 0; k < 3; k++)
        mine[nmine].x[c][k] = mesh->x[3 * f->vertex[c] + k];
    }
    nmine++;
  }
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(Facet), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(SbAllgatherv(space->comm, type, nmine, mine, n, facet, NULL));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The closed surfaces, apart from each other, of n facets: wall[n], of which those with a root have
   a volume; root[n] of each facet. */
static PetscErrorCode find_walls(PetscInt n, const Facet facet[], PetscInt root[], Wall wall[])
{
  SbKey *corner; /* slot: 3 facet + corner */

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * n, &corner));
  for (PetscInt i = 0; i < 3 * n; i++)
    corner[i] = (SbKey){(uint64_t)facet[i / 3].vertex[i % 3], i};
  SbKeysSort(3 * n, corner);
  for (PetscInt i = 0; i < n; i++)
    root[i] = i;
  for (PetscInt i = 0; i + 1 < 3 * n; i++)
    if (corner[i].key == corner[i + 1].key)
      (void)SbUnionJoin(root, corner[i].slot / 3, corner[i + 1].slot / 3);
  PetscCall(PetscFree(corner));
  for (PetscInt i = 0; i < n; i++) {
    wall[i].volume = 0;
    SbBoxClear(wall[i].box);
  }
  for (PetscInt i = 0; i < n; i++) {
    PetscReal normal[3];

    root[i] = SbUnionRoot(root, i);
    SbCross(facet[i].x[1], facet[i].x[2], normal);
    wall[root[i]].volume += SbDot3(facet[i].x[0], normal) / 6;
    for (int c = 0; c < 3; c++)
      SbBoxAdd(wall[root[i]].box, facet[i].x[c]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a wall lies within the box of another one, around a cavity. */
static PetscBool is_within(PetscInt n, const Wall wall[], const Wall *which)
{
  for (PetscInt j = 0; j < n; j++) {
    PetscBool in = (PetscBool)(wall[j].volume < 0);

    for (int k = 0; k < 3; k++)
      in = (PetscBool)(in && which->box[k] >= wall[j].box[k] &&
                       which->box[3 + k] <= wall[j].box[3 + k]);
    if (in)
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Surfaces apart from each other: chambers with one filling, in the note, and what is in them; an
   error if one is around a body elsewhere. */
static PetscErrorCode check_walls(SbEffect e, SbSpace space)
{
  const Cavity *c = (const Cavity *)e->data;
  PetscInt nchamber = 0;
  PetscInt n, *root;
  Facet *facet;
  Wall *wall;

  PetscFunctionBeginUser;
  PetscCall(gather(&c->surface, space, &n, &facet));
  PetscCall(PetscMalloc2(n, &root, n, &wall));
  PetscCall(find_walls(n, facet, root, wall));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *box = wall[i].box;

    if (root[i] != i)
      continue;
    nchamber += wall[i].volume < 0;
    PetscCheck(
      wall[i].volume < 0 || is_within(n, wall, &wall[i]), space->comm, PETSC_ERR_USER_INPUT,
      "%s: a closed part of this surface, from (%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g) m, "
      "is around bodies of %.4g m^3, not around a cavity or in it: leave its sets out",
      e->on.option, (double)box[0], (double)box[1], (double)box[2], (double)box[3], (double)box[4],
      (double)box[5], (double)wall[i].volume);
  }
  if (nchamber > 1)
    SbAppend(sizeof(e->note), e->note, ", %" PetscInt_FMT " chambers with one pressure", nchamber);
  PetscCall(PetscFree2(root, wall));
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_cavity(SbEffect e, SbSpace space)
{
  Cavity *c = (Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbPressureSetUp(e, space));
  PetscCheck(!c->surface.nrim, space->comm, PETSC_ERR_USER_INPUT,
             "%s: a cavity needs a closed surface, and this one has a rim of %" PetscInt_FMT
             " edges, the first at (%.4g, %.4g, %.4g) m: add the facets that close it",
             e->on.option, c->surface.nrim, (double)c->surface.rim_at[0],
             (double)c->surface.rim_at[1], (double)c->surface.rim_at[2]);
  PetscCheck(c->surface.sign < 0, space->comm, PETSC_ERR_USER_INPUT,
             "%s: this surface is around bodies, not around a cavity: take the facets of the wall "
             "inside",
             e->on.option);
  PetscCall(check_walls(e, space));
  PetscCall(SbPressureInside(&c->surface, space, NULL, &c->rest));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &c->rest, 1, MPIU_REAL, MPI_SUM, space->comm));
  c->rest *= c->surface.sign;
  PetscCall(PetscMalloc1(3 * space->nnode, &c->g));
  if (c->number >= 0)
    PetscCall(PetscMalloc1(9 * c->n * c->n, &c->K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_cavity(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  Cavity *c = (Cavity *)e->data;
  const PetscInt *node;
  PetscReal factor;
  Filling now;

  PetscFunctionBeginUser;
  c->bends = PETSC_TRUE;
  PetscCall(SbPressureTangent(e, space, stage, A));
  c->bends = PETSC_FALSE;

  /* dV/dx, up to its sign, and -dp/dV */
  PetscCall(fill(e, space, stage, &now));
  factor = stage->shift_k * c->exponent * (now.p + c->modulus) / now.V;
  PetscCall(PetscArrayzero(c->g, 3 * space->nnode));
  PetscCall(SbPressureAddForce(&c->surface, space, 1., stage->u, c->g));
  PetscCall(SbSpaceUpdateGhosts(space, c->g));
  if (c->number < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  node = space->couplings.node + space->couplings.start[c->number];
  for (PetscInt i = 0; i < 3 * c->n; i++)
    for (PetscInt j = 0; j < 3 * c->n; j++)
      c->K[3 * c->n * i + j] =
        factor * c->g[3 * node[i / 3] + i % 3] * c->g[3 * node[j / 3] + j % 3];
  PetscCall(SbSpaceAddCoupling(space, A, c->number, c->K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_cavity(SbEffect e, SbSpace space, const SbStage *stage)
{
  Filling now;

  PetscFunctionBeginUser;
  PetscCall(fill(e, space, stage, &now));
  ((Cavity *)e->data)->kept = now.p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The volume, m^3, on all ranks; the pressure, Pa, and the fluid's energy, J, on the first one. */
static PetscErrorCode history_cavity(SbEffect e, SbSpace space, const SbStage *stage,
                                     const PetscReal residual[], PetscReal values[])
{
  const Cavity *c = (const Cavity *)e->data;
  const PetscReal n = c->exponent;
  Filling now;

  PetscFunctionBeginUser;
  (void)residual;
  PetscCall(fill(e, space, stage, &now));
  if (space->rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  values[0] = now.V;
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  values[1] = now.p;
  if (n == 1)
    values[2] = c->modulus * (now.V - now.fluid - now.fluid * PetscLogReal(now.V / now.fluid));
  else
    values[2] = c->modulus * (now.fluid / (n - 1) * (PetscPowReal(now.fluid / now.V, n - 1) - 1) +
                              now.V - now.fluid);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_cavity(SbEffect e)
{
  Cavity *c = (Cavity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(c->g));
  PetscCall(PetscFree(c->K));
  PetscCall(SbPressureDestroy(e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"volume", "pressure", "energy"};

const SbEffectType SbEffectCavity = {
  .name = "cavity",
  .size = sizeof(Cavity),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_cavity,
          .couplings = couplings_cavity,
          .setup = setup_cavity,
          .force = SbPressureForce,
          .tangent = tangent_cavity,
          .accept = accept_cavity,
          .history = history_cavity,
          .destroy = destroy_cavity},
};
