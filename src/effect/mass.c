/*
  mass.c - mass that bodies carry besides their own: on a surface, such as a coat, a load of fat or
  entrained water, or at a point, such as a sensor.

  It moves with the nodes, which get their integrals of the basis over the surface, or their weights
  in the point (place.c), as lumped mass: it has inertia and weight, and no stiffness. Rayleigh
  damping of the body acts on it, too.
*/
#include "effect_impl.h"

typedef struct {
  PetscReal mass, density, at[3]; /* kg, kg/m^2, m */
  PetscBool point;
} Mass;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets whose boundary facets carry it; of a point: the body"},
  {"mass", SB_OPTION_REAL, 1, "kg", "0", "[0, inf)", "mass, spread evenly over the surface"},
  {"density", SB_OPTION_REAL, 1, "kg/m^2", "0", "[0, inf)", "mass per area instead"},
  {"at", SB_OPTION_REALS, 3, "m", "", "", "a point that carries all of it, at rest"},
};

static PetscErrorCode options_mass(SbEffect e, const SbScope *scope)
{
  Mass *m = (Mass *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "mass", &m->mass));
  PetscCall(SbOptionReal(scope, "density", &m->density));
  PetscCall(SbOptionGiven(scope, "at", &m->point));
  if (m->point)
    PetscCall(SbOptionReals(scope, "at", m->at));
  PetscCheck((m->mass > 0) != (m->density > 0), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_mass (kg) or -effect_%s_density (kg/m^2)", e->name,
             e->name, e->name);
  PetscCheck(!m->point || m->mass > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_density is per area, and -effect_%s_at names a point: give "
             "-effect_%s_mass (kg)",
             e->name, e->name, e->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_body(SbEffect e, SbSpace space, PetscInt body)
{
  PetscFunctionBeginUser;
  PetscCheck(!space->element[body]->rigid, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: body '%s' is rigid: give it another -body_%s_density, or weld a small rigid body "
             "to it",
             e->on.option, space->mesh->body[body].name, space->mesh->body[body].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds mass to a local node; P2 has another array for loads. */
static void add(SbSpace space, PetscInt node, PetscReal mass)
{
  space->node_mass[node] += mass;
  space->added_mass += node < space->nnode_owned ? mass : 0;
  if (space->node_share != space->node_mass)
    space->node_share[node] += mass;
}

/* At a point. */
static PetscErrorCode add_point(SbEffect e, SbSpace space)
{
  const Mass *m = (const Mass *)e->data;
  PetscInt body = -1;
  SbMeanPlace place;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    if (e->on.n == 1 && !strcmp(space->mesh->body[b].name, e->on.name[0]))
      body = b;
  PetscCheck(body >= 0, space->comm, PETSC_ERR_USER_INPUT,
             "%s: a mass at a point is on one body: give its name", e->on.option);
  PetscCall(check_body(e, space, body));
  PetscCall(SbPlaceFind(space, e->on.option, body, m->at, &place));
  for (PetscInt k = 0; k < place.n; k++) {
    const PetscInt own = place.gnode[k] - space->gnode_start;

    /* weights of P2, CR and DG may be negative: their nodes must not lose mass */
    PetscCheck(place.weight[k] > -1e-6, space->comm, PETSC_ERR_USER_INPUT,
               "-effect_%s_at: the basis of %s is negative at this point: take a vertex of the "
               "mesh, or a surface",
               e->name, space->element[body]->name);
    if (own >= 0 && own < space->nnode_owned)
      add(space, own, m->mass * PetscMax(0, place.weight[k]));
  }
  PetscCall(SbPlaceDestroy(&place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On a surface, on owned and ghost nodes. */
static PetscErrorCode add_surface(SbEffect e, SbSpace space)
{
  const Mass *m = (const Mass *)e->data;
  PetscReal density = m->density;
  PetscReal area = 0;
  SbFacet *facet;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &n, &facet));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(check_body(e, space, space->mesh->cell_body[facet[i].cell]));
    area += facet[i].cell < space->mesh->ncell_owned ? facet[i].area : 0;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPIU_REAL, MPI_SUM, space->comm));
  if (density == 0)
    density = m->mass / area;
  for (PetscInt i = 0; i < n; i++)
    for (int q = 0; q < SbRuleFacet.n; q++) {
      PetscReal L[4] = {0};
      PetscReal phi[SB_CELL_NODES];
      PetscInt nphi;

      for (int c = 0; c < 3; c++)
        L[facet[i].corner[c]] = SbRuleFacet.L[q][c];
      nphi = SbCellBasis(space, facet[i].cell, L, phi);
      for (PetscInt a = 0; a < nphi; a++)
        add(space, SbSpaceCellNode(space, facet[i].cell, a),
            density * facet[i].area * SbRuleFacet.weight[q] * phi[a]);
    }
  PetscCall(PetscFree(facet));
  SbFormat(sizeof(e->note), e->note, "%.6g kg on %.6g m^2", (double)(density * area), (double)area);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_mass(SbEffect e, SbSpace space)
{
  PetscFunctionBeginUser;
  PetscCheck(!space->consistent_mass || !e->dynamic, space->comm, PETSC_ERR_USER_INPUT,
             "effect %s: added mass is lumped at the nodes: leave -mass consistent out", e->name);
  if (((const Mass *)e->data)->point)
    PetscCall(add_point(e, space));
  else
    PetscCall(add_surface(e, space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectMass = {
  .name = "mass",
  .size = sizeof(Mass),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_mass, .setup = setup_mass},
};
