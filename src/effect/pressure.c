/*
  pressure.c - a pressure on part of the surface, positive in compression.

  The triangle with the derivatives of a facet's map at a point has the corners x0, x1, x2,
  counter-clockwise seen from outside: those of the facet itself, but of P2, whose facets have six
  nodes and are curved once they move. With X = x1 - x0, Y = x2 - x0, derivatives along two
  coordinates, phi_a the basis of the cell,

    f_a = -p int phi_a X x Y,   p = value(t) time(t).

  On a closed surface this is -p dV/dx_a, V the enclosed volume: force and moment vanish, the work
  is -p dV.

  Tangent: -df_a/dx_b is not symmetric facet by facet; the matrix gets the symmetric part, with [c]x
  w = c x w

    p/2 int (phi_a phi_b,Y - phi_b phi_a,Y) [X]x - (phi_a phi_b,X - phi_b phi_a,X) [Y]x.

  On a closed surface, or one whose rim is constrained, the other part cancels and the tangent is
  the exact derivative (Bufler, "Pressure loaded structures under large deformations", 1984). What
  is left of it is an integral along the rim R, counter-clockwise,

    -df_a = -p/2 int_R phi_a dx x w.

  Where the rim is free the operator of the linear solver applies it, and the matrix is the
  preconditioner. Without it Newton's method converges linearly, and not at all for large rotations.

  Integrals are exact: one point for linear elements, a rule of degree 5 for P2 (polynomials of
  degree 4).

  The facets of CR and DG bodies do not meet at their edges, and stretch with the centre of their
  cell instead of the wall: with forces facet by facet a bar in a fluid becomes stiffer by h p /
  (mu H). Their pressure has two parts,

    f = -p s dV/du - p sum_F (c_F - s) dV_F,   c_F = 1 on facets under pressure, else 0,

  V the volume of the body's cells (src/fem/body_volume.c), V_F the part of a facet in the volume
  inside the continuous surface of mean_surface.c, with the prism between it and the facet's node at
  x: with a triangle X, Y of that surface, its area vector A = X x Y / 2 and its centre z,

    V_F = A . z / 3 + A . (x - z),   dV_F = A . dx + (dX x Y + X x dY) / 2 . (x - z).

  Where strains are even x = z, and each facet's force acts at its node, which equilibrates the even
  stress. The second term of dV_F makes the potential: it is left out where the surface is open, and
  there is none. Facets whose support prescribes the normal
  displacement count as if they were under pressure, as no work is done there: their second part is
  only added to the reaction. s is the part of the other facets, by area, that are under pressure,
  if at least half of them are, else 0; it is 1 where all of them are. Then the first part alone is
  left, which the even stress P = -p cof F balances exactly in each cell, so that pressure all
  around does not bend or stiffen anything. The pressure on a patch has no force far inside. On a
  closed surface both parts have a potential, and force and moment vanish.

  The matrix has the derivative of the first part; that of the second one, which couples nodes that
  share no cell, is applied by the operator of the linear solver, and the matrix is the
  preconditioner.

  The header of a run says of each pressure whether its surface is closed, and the volume inside, or
  where its rim is. Of a closed one the current volume is a column of the history.

  With follower = no the pressure acts on the rest area and normal, as small strains have it: no
  tangent.
*/
#include "facet_point.h"
#include "pressure.h"
#include "sbgeometry.h"

#define MOST \
  0.5 /* least part of the surface for which s is not zero: else the matrix is positive */
#define STRAIGHT \
  1e-9 /* relative: components of an edge below which it has none, as in a plane of symmetry */

/* Of the effect `pressure`. */
typedef struct {
  SbPressure surface;
  SbFormula value;
} Pressure;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose boundary facets are under pressure"},
  {"value", SB_OPTION_FORMULA, 1, "Pa", NULL, "",
   "pressure, a formula of the time t; positive is compressive"},
  {"follower", SB_OPTION_BOOL, 1, "", "true", "",
   "follower load, on the current area and normal; if not, a dead load on those of the reference "
   "configuration"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the pressure, a formula of the time t"},
};

static PetscErrorCode pressure_at(SbEffect e, SbSpace space, const SbStage *stage, PetscReal *p)
{
  PetscReal factor;

  PetscFunctionBeginUser;
  (void)space;
  PetscCall(SbFormulaEval(((const Pressure *)e->data)->value, stage->t, NULL, p));
  PetscCall(SbFormulaEval(e->time, stage->t, NULL, &factor));
  *p *= factor;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_pressure(SbEffect e, const SbScope *scope)
{
  SbPressure *p = (SbPressure *)e->data;

  PetscFunctionBeginUser;
  p->at = pressure_at;
  PetscCall(SbEffectFormulas(e, scope, "value", 1, PETSC_FALSE, &((Pressure *)e->data)->value));
  PetscCall(SbOptionBool(scope, "follower", &p->follower));
  e->linear = (PetscBool)!p->follower;
  if (p->follower)
    PetscFunctionReturn(PETSC_SUCCESS);
  e->ops.tangent = NULL;
  e->ops.nonsymmetric = NULL;
  e->ops.volume_pressure = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether it does not share edges with other facets (CR, DG). */
static inline PetscBool apart(SbSpace space, const SbFacet *facet)
{
  return SbElementHasFaces(SbSpaceCellElement(space, facet->cell));
}

/* Side c of a facet of P1 or P2. */
static SbRimEdge side_of(SbSpace space, const SbFacet *facet, PetscInt c)
{
  const PetscInt a = facet->corner[c];
  const PetscInt b = facet->corner[(c + 1) % 3];
  SbRimEdge e = {
    {SbSpaceCellNode(space, facet->cell, a), SbSpaceCellNode(space, facet->cell, b), -1}};

  /* edges of a tet: 01 02 03 12 13 23 */
  if (SbSpaceCellElement(space, facet->cell)->nodes_per[1])
    e.node[2] = SbSpaceCellNode(space, facet->cell, a && b ? 4 + a + b : 3 + a + b);
  return e;
}

/* Whether the tangent has a part along the edge, not eliminated by supports. */
static PetscBool is_free(SbSpace space, const SbRimEdge *edge)
{
  PetscReal e[3];
  PetscReal longest = 0;
  int components = 0; /* free ones of some node */

  for (int i = 0; i < 3; i++) {
    e[i] = space->node_x[3 * edge->node[1] + i] - space->node_x[3 * edge->node[0] + i];
    longest = PetscMax(longest, PetscAbsReal(e[i]));
  }
  for (int a = 0; a < 3 && edge->node[a] >= 0; a++)
    components |= ~space->fixed[edge->node[a]];

  /* e_k couples the other two components */
  for (int k = 0; k < 3; k++)
    if (PetscAbsReal(e[k]) > STRAIGHT * longest &&
        components >> (k + 1) % 3 & components >> (k + 2) % 3 & 1)
      return PETSC_TRUE;
  return PETSC_FALSE;
}

/* The free rim of the facets of P1 and P2: edges that facets go along one way more often than the
   other. */
static PetscErrorCode find_rim(SbPressure *p, SbSpace space)
{
  PetscInt n = 0;
  SbKey *edge; /* slot 3 facet + side */

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * p->nfacet, &edge));
  for (PetscInt i = 0; i < 3 * p->nfacet; i++) {
    SbRimEdge e;

    if (apart(space, &p->facet[i / 3]))
      continue;
    e = side_of(space, &p->facet[i / 3], i % 3);
    edge[n++] = (SbKey){SbKeyOfPair(e.node[0], e.node[1]), i};
  }
  SbKeysSort(n, edge);
  PetscCall(PetscMalloc1(n, &p->rim));
  for (PetscInt i = 0, m; i < n; i += m) {
    PetscInt ways[2] = {0, 0}; /* from the lower node to the higher one, and back */
    SbRimEdge e[2] = {{{0}}};
    PetscBool owned = PETSC_FALSE;

    m = SbKeysAlike(n, edge, i);
    for (PetscInt k = i; k < i + m; k++) {
      const SbRimEdge side = side_of(space, &p->facet[edge[k].slot / 3], edge[k].slot % 3);
      const int back = side.node[0] > side.node[1];

      e[back] = side;
      ways[back]++;
    }
    if (ways[0] == ways[1])
      continue;

    /* all facets of an edge with an owned node are here */
    e[0] = e[ways[1] > ways[0]];
    for (int a = 0; a < 3; a++)
      owned = (PetscBool)(owned || (e[0].node[a] >= 0 && e[0].node[a] < space->nnode_owned));
    if (owned && is_free(space, &e[0]))
      p->rim[p->nedge++] = e[0];
  }
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureRim(const SbPressure *p, SbMesh mesh, PetscInt nrim[2], PetscReal at[3])
{
  PetscInt n = p->nall; /* facets under pressure, then held ones */
  const SbFacet **facet;
  SbKey *edge;                /* slot 3 facet + side */
  uint64_t mine = UINT64_MAX; /* the first edge here: its original vertices */
  uint64_t first;

  PetscFunctionBeginUser;
  nrim[0] = nrim[1] = 0;
  at[0] = at[1] = at[2] = 0;
  PetscCall(PetscMalloc1(n + (p->surface ? p->surface->nfacet : 0), &facet));
  for (PetscInt i = 0; i < n; i++)
    facet[i] = &p->facet[i];
  for (PetscInt i = 0; p->surface && i < p->surface->nfacet; i++)
    if (p->weight[i] + p->share[mesh->cell_body[p->surface->facet[i].cell]] < 0.5 &&
        SbMeanSurfaceHeld(p->surface, i))
      facet[n++] = &p->surface->facet[i];
  PetscCall(PetscMalloc1(3 * n, &edge));
  for (PetscInt i = 0; i < 3 * n; i++) {
    const PetscInt *v = facet[i / 3]->vertex;

    edge[i] = (SbKey){SbKeyOfPair(mesh->gvert[v[i % 3]], mesh->gvert[v[(i + 1) % 3]]), i};
  }
  SbKeysSort(3 * n, edge);
  for (PetscInt i = 0, m; i < 3 * n; i += m) {
    PetscInt ways = 0; /* from the lower vertex to the higher one, less those back */
    PetscInt all = 0;  /* with those of held facets */
    PetscInt v[2];
    uint64_t original;

    m = SbKeysAlike(3 * n, edge, i);
    for (PetscInt k = i; k < i + m; k++) {
      const PetscInt *corner = facet[edge[k].slot / 3]->vertex;
      int way;

      for (int a = 0; a < 2; a++)
        v[a] = corner[(edge[k].slot + a) % 3];
      way = mesh->gvert[v[0]] < mesh->gvert[v[1]] ? 1 : -1;
      all += way;
      ways += edge[k].slot / 3 < p->nall ? way : 0;
    }

    // all facets at an owned vertex are here; the rank of the lower one counts the edge
    if (!ways || v[mesh->gvert[v[0]] > mesh->gvert[v[1]]] >= mesh->nvert_owned)
      continue;
    nrim[0]++;
    nrim[1] += all != 0;
    original = SbKeyOfPair(mesh->vert_orig[v[0]], mesh->vert_orig[v[1]]);
    if (original >= mine)
      continue;
    mine = original;
    for (int k = 0; k < 3; k++)
      at[k] = 0.5 * (mesh->x[3 * v[0] + k] + mesh->x[3 * v[1] + k]);
  }
  PetscCall(PetscFree(facet));
  PetscCall(PetscFree(edge));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, nrim, 2, MPIU_INT, MPI_SUM, mesh->comm));
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_UINT64_T, MPI_MIN, mesh->comm));
  for (int k = 0; k < 3 && mine != first; k++)
    at[k] = 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, at, 3, MPIU_REAL, MPI_SUM, mesh->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f += factor times the weight and the basis at the point times N. */
static void add_area(const FacetPoint *p, PetscReal factor, const PetscReal N[3], PetscReal f[])
{
  for (int a = 0; a < p->n; a++)
    for (int i = 0; i < 3; i++)
      f[3 * p->node[a] + i] += factor * p->weight * p->phi[a] * N[i];
}

/* Facet i of a mean surface with its vertices at y[nvert][3]: sides X and Y, and the vector from
   its centre to the node on the facet, which is at u[3], plus rest[3] unless that is NULL. */
typedef struct {
  PetscReal X[3], Y[3], gap[3];
} MeanFacet;

static MeanFacet mean_facet(const SbMeanSurface *surface, PetscInt i, const PetscReal y[],
                            const PetscReal rest[], const PetscReal u[])
{
  const PetscInt *v = surface->facet[i].vertex;
  const PetscInt node = surface->node[i];
  MeanFacet m;

  SbSubtract(y + 3 * v[1], y + 3 * v[0], m.X);
  SbSubtract(y + 3 * v[2], y + 3 * v[0], m.Y);
  for (int c = 0; c < 3; c++)
    m.gap[c] = (rest ? rest[3 * node + c] : 0) + (u ? u[3 * node + c] : 0) -
               (y[3 * v[0] + c] + y[3 * v[1] + c] + y[3 * v[2] + c]) / 3;
  return m;
}

/* g += factor times the derivative of gap . (X x Y) / 2 by the vertices v, the gap fixed. */
static void add_prism(const PetscInt v[3], PetscReal factor, const PetscReal X[3],
                      const PetscReal Y[3], const PetscReal gap[3], PetscReal g[])
{
  PetscReal one[3], two[3];

  SbCross(Y, gap, one);
  SbCross(gap, X, two);
  for (int c = 0; c < 3; c++) {
    g[3 * v[1] + c] += factor / 2 * one[c];
    g[3 * v[2] + c] += factor / 2 * two[c];
    g[3 * v[0] + c] -= factor / 2 * (one[c] + two[c]);
  }
}

PetscErrorCode SbPressureInside(const SbPressure *load, SbSpace space, const PetscReal u[],
                                PetscReal *inside)
{
  PetscFunctionBeginUser;
  *inside = 0;
  for (PetscInt k = 0; k < load->nfacet; k++) {
    if (load->facet[k].cell >= space->mesh->ncell_owned)
      continue;
    for (int q = first_point(space, &load->facet[k]); q < SbRuleFacet.n; q++) {
      PetscReal side[2][3] = {{0}};
      PetscReal x[3] = {0, 0, 0};
      PetscReal N[3];
      FacetPoint at;

      facet_point(space, &load->facet[k], q, &at);
      add_sides(&at, space->node_x, side);
      add_sides(&at, u, side);
      for (int a = 0; a < at.n; a++)
        for (int i = 0; i < 3; i++)
          x[i] += at.phi[a] * (space->node_x[3 * at.node[a] + i] + (u ? u[3 * at.node[a] + i] : 0));
      SbCross(side[0], side[1], N);
      *inside += at.weight * SbDot3(x, N) / 3;
    }
  }
  if (!load->surface)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* of bodies with nodes at faces the volume on which the pressure works */
  PetscCall(SbMeanSurfaceMove(load->surface, PETSC_FALSE, u, load->vertex[0]));
  for (PetscInt i = 0; i < load->surface->nfacet; i++) {
    PetscReal N[3];
    MeanFacet m;

    if (load->surface->facet[i].cell >= space->mesh->ncell_owned ||
        SbMeanSurfaceHeld(load->surface, i))
      continue;
    m = mean_facet(load->surface, i, load->vertex[0], space->node_x, u);
    SbCross(m.X, m.Y, N);
    *inside +=
      load->weight[i] / 2 *
      (SbDot3(load->vertex[0] + 3 * load->surface->facet[i].vertex[0], N) / 3 + SbDot3(m.gap, N));
  }
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    if (load->share[b] > 0)
      *inside += load->share[b] * SbSpaceVolume(space, b, u);
  *inside += load->volume;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The surface of bodies with nodes at faces, and s and the weights of facets there. Collective. */
static PetscErrorCode setup_surface(SbPressure *p, SbSpace space)
{
  const SbMesh mesh = space->mesh;
  PetscBool *in;       /* [nbody] */
  uint8_t *loaded;     /* [ncell][4] */
  PetscReal(*area)[3]; /* [nbody] under pressure, not, number of the latter facets */
  PetscBool any = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(mesh->nbody, &in, 4 * mesh->ncell, &loaded, mesh->nbody, &area));
  for (PetscInt k = p->nfacet; k < p->nall; k++) {
    in[mesh->cell_body[p->facet[k].cell]] = PETSC_TRUE;
    loaded[4 * p->facet[k].cell + p->facet[k].face] = 1;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, in, (PetscMPIInt)mesh->nbody, SB_MPI_BOOL, MPI_LOR, space->comm));
  for (PetscInt b = 0; b < mesh->nbody; b++)
    any = (PetscBool)(any || in[b]);
  if (any) {
    PetscCall(SbMeanSurfaceCreate(space, in, &p->surface));
    PetscCall(PetscMalloc1(p->surface->nfacet, &p->weight));
    for (int k = 0; k < 3; k++)
      PetscCall(PetscMalloc1(3 * (size_t)mesh->nvert, &p->vertex[k]));
    for (PetscInt i = 0; i < p->surface->nfacet; i++) {
      const SbFacet *facet = &p->surface->facet[i];
      PetscReal *sum = area[mesh->cell_body[facet->cell]];

      p->weight[i] = loaded[4 * facet->cell + facet->face];
      if (facet->cell >= mesh->ncell_owned || SbMeanSurfaceHeld(p->surface, i))
        continue;
      sum[p->weight[i] > 0 ? 0 : 1] += facet->area;
      sum[2] += p->weight[i] > 0 ? 0 : 1;
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, area, (PetscMPIInt)(3 * mesh->nbody), MPIU_REAL,
                               MPI_SUM, space->comm));
    for (PetscInt b = 0; b < mesh->nbody; b++) {
      if (area[b][0] > 0)
        p->share[b] = area[b][2] > 0 ? area[b][0] / (area[b][0] + area[b][1]) : 1;
      if (p->share[b] < MOST)
        p->share[b] = 0;
      p->some = (PetscBool)(p->some || (in[b] && area[b][0] > 0 && area[b][2] > 0));
    }
    for (PetscInt i = 0; i < p->surface->nfacet; i++)
      p->weight[i] -= p->share[mesh->cell_body[p->surface->facet[i].cell]];
  }
  PetscCall(PetscFree3(in, loaded, area));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of the volume inside the surface, at rest, of bodies with nodes at faces here, m^3. */
static PetscReal volume_at_rest(const SbPressure *p, SbMesh mesh)
{
  PetscReal sum = 0;

  for (PetscInt k = p->nfacet; k < p->nall; k++)
    if (p->facet[k].cell < mesh->ncell_owned)
      sum += p->facet[k].area / 3 * SbDot3(mesh->x + 3 * p->facet[k].vertex[0], p->facet[k].normal);
  return sum;
}

static PetscErrorCode history_pressure(SbEffect e, SbSpace space, const SbStage *stage,
                                       const PetscReal residual[], PetscReal values[])
{
  const SbPressure *load = (const SbPressure *)e->data;

  PetscFunctionBeginUser;
  (void)residual;
  PetscCall(SbPressureInside(load, space, stage->u, values));
  values[0] *= load->sign;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureSetUp(SbEffect e, SbSpace space)
{
  SbPressure *p = (SbPressure *)e->data;
  const SbMesh mesh = space->mesh;
  PetscInt nrim[2];
  PetscInt n = 0;
  PetscReal value = 1.;
  const SbStage none = {0};
  PetscReal at[3], inside, work_inside;
  SbMeanSurface *surface;
  PetscBool some, free;
  SbFacet *others;

  PetscFunctionBeginUser;
  if (e->steady)
    PetscCall((*p->at)(e, space, &none, &value));
  PetscCall(SbEffectFacets(space, &e->on, &p->nfacet, &p->facet));
  for (PetscInt k = 0; k < p->nfacet; k++)
    PetscCheck(!SbSpaceCellElement(space, p->facet[k].cell)->rigid, PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT,
               "%s: body '%s' is rigid, which has no pressure: give it a traction", e->on.option,
               mesh->body[mesh->cell_body[p->facet[k].cell]].name);
  PetscCall(PetscCalloc1(mesh->nbody, &p->share));

  /* those of bodies with nodes at faces behind the others */
  PetscCall(PetscMalloc1(p->nfacet, &others));
  p->nall = p->nfacet;
  for (PetscInt k = 0; k < p->nall; k++)
    if (p->follower && apart(space, &p->facet[k]))
      others[k - n] = p->facet[k];
    else
      p->facet[n++] = p->facet[k];
  PetscCall(PetscArraycpy(p->facet + n, others, p->nall - n));
  p->nfacet = n;
  PetscCall(PetscFree(others));
  if (p->follower && space->faces)
    PetscCall(setup_surface(p, space));
  if (!p->surface)
    e->ops.volume_pressure = NULL;
  if (p->follower && value != 0)
    PetscCall(find_rim(p, space));

  /* the second part on bodies with nodes at faces, and free rims */
  some = (PetscBool)(p->nedge > 0 || p->some);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &some, 1, SB_MPI_BOOL, MPI_LOR, space->comm));
  if (!some)
    e->ops.nonsymmetric = NULL;

  /* what the surface is, in words; a free rim is known of nodes at vertices only */
  PetscCall(SbPressureRim(p, mesh, nrim, at));
  p->nrim = nrim[0];
  PetscCall(PetscArraycpy(p->rim_at, at, 3));
  p->prisms = (PetscBool)!nrim[1];
  if (nrim[0]) {
    free = (PetscBool)(p->nedge > 0 || (p->some && !p->prisms));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &free, 1, SB_MPI_BOOL, MPI_LOR, space->comm));
    e->no_potential = free;
    e->ops.history = NULL;
    e->ncolumn = 0;
    SbFormat(sizeof(e->note), e->note,
             "on an open surface: its rim has %" PetscInt_FMT
             " edges, the first at (%.4g, %.4g, %.4g)%s",
             nrim[0], (double)at[0], (double)at[1], (double)at[2],
             !p->follower ? ""
             : free       ? "; it has no potential"
                          : "; supports hold the rim, or symmetry");
  } else {
    /* bodies with nodes at faces have the geometric volume at rest; this rank's parts */
    surface = p->surface;
    p->surface = NULL;
    PetscCall(SbPressureInside(p, space, NULL, &inside));
    inside += volume_at_rest(p, mesh);
    p->surface = surface;
    PetscCall(SbPressureInside(p, space, NULL, &work_inside));
    p->volume = inside - work_inside;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &inside, 1, MPIU_REAL, MPI_SUM, space->comm));
    p->sign = inside < 0 ? -1 : 1;
    SbFormat(sizeof(e->note), e->note, "on a closed surface, %s %.6g m^3",
             inside < 0 ? "a cavity of" : "around", (double)PetscAbsReal(inside));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f += factor dV_F times the weights of facets, and on held ones what supports bear. */
static PetscErrorCode add_surface(const SbPressure *load, SbSpace space, PetscReal factor,
                                  const PetscReal u[], PetscReal f[])
{
  const SbMeanSurface *surface = load->surface;
  PetscReal *y = load->vertex[0];
  PetscReal *g = load->vertex[1];

  PetscFunctionBeginUser;
  PetscCall(SbMeanSurfaceMove(surface, PETSC_FALSE, u, y));
  PetscCall(PetscArrayzero(g, 3 * space->mesh->nvert));
  for (PetscInt i = 0; i < surface->nfacet; i++) {
    const PetscInt node = surface->node[i];
    const PetscReal weight = factor * load->weight[i];
    const PetscBool held = SbMeanSurfaceHeld(surface, i);
    PetscReal N[3];
    MeanFacet m;

    if (weight == 0)
      continue;
    m = mean_facet(surface, i, y, space->node_x, u);
    SbCross(m.X, m.Y, N);
    for (int c = 0; c < 3; c++)
      if (!held || space->fixed[node] >> c & 1)
        f[3 * node + c] += weight / 2 * N[c];
    if (!held && load->prisms)
      add_prism(surface->facet[i].vertex, weight, m.X, m.Y, m.gap, g);
  }
  PetscCall(SbMeanSurfaceForces(surface, g, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivative of add_surface() along x, without held facets. */
static PetscErrorCode add_surface_derivative(const SbPressure *load, SbSpace space,
                                             PetscReal factor, const PetscReal u[],
                                             const PetscReal x[], PetscReal f[])
{
  const SbMeanSurface *surface = load->surface;
  PetscReal *y = load->vertex[0];
  PetscReal *g = load->vertex[1];
  PetscReal *w = load->vertex[2];

  PetscFunctionBeginUser;
  PetscCall(SbMeanSurfaceMove(surface, PETSC_FALSE, u, y));
  PetscCall(SbMeanSurfaceMove(surface, PETSC_TRUE, x, w));
  PetscCall(PetscArrayzero(g, 3 * space->mesh->nvert));
  for (PetscInt i = 0; i < surface->nfacet; i++) {
    const PetscInt *v = surface->facet[i].vertex;
    const PetscReal weight = factor * load->weight[i];
    PetscReal one[3], two[3];
    MeanFacet m, d;

    if (weight == 0 || SbMeanSurfaceHeld(surface, i))
      continue;
    m = mean_facet(surface, i, y, space->node_x, u);
    d = mean_facet(surface, i, w, NULL, x);
    SbCross(d.X, m.Y, one);
    SbCross(m.X, d.Y, two);
    for (int c = 0; c < 3; c++)
      f[3 * surface->node[i] + c] += weight / 2 * (one[c] + two[c]);
    if (!load->prisms)
      continue;
    add_prism(v, weight, d.X, d.Y, m.gap, g);
    add_prism(v, weight, m.X, m.Y, d.gap, g);
  }
  PetscCall(SbMeanSurfaceForces(surface, g, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureVolume(SbEffect e, PetscReal t, PetscReal pressure[])
{
  const SbPressure *load = (const SbPressure *)e->data;
  const SbStage stage = {.t = t};
  PetscReal p;

  PetscFunctionBeginUser;
  PetscCall((*load->at)(e, load->surface->space, &stage, &p));
  for (PetscInt b = 0; b < load->surface->space->mesh->nbody; b++)
    pressure[b] += p * load->share[b];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureAddForce(const SbPressure *load, SbSpace space, PetscReal p,
                                  const PetscReal u[], PetscReal f[])
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    if (load->share[b] > 0)
      PetscCall(SbSpaceAddVolume(space, b, u, -p * load->share[b], f, NULL));
  if (load->surface)
    PetscCall(add_surface(load, space, -p, u, f));
  for (PetscInt k = 0; k < load->nfacet; k++) {
    for (int q = first_point(space, &load->facet[k]); q < SbRuleFacet.n; q++) {
      PetscReal side[2][3] = {{0}};
      PetscReal N[3];
      FacetPoint at;

      facet_point(space, &load->facet[k], q, &at);
      add_sides(&at, space->node_x, side);
      add_sides(&at, u, side);
      SbCross(side[0], side[1], N);
      add_area(&at, -p, N, f);
    }
  }
  PetscCall(PetscLogFlops(45.0 * (PetscLogDouble)load->nfacet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureForce(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const SbPressure *load = (const SbPressure *)e->data;
  PetscReal p;

  PetscFunctionBeginUser;
  PetscCall((*load->at)(e, space, stage, &p));
  PetscCall(SbPressureAddForce(load, space, p, load->follower ? stage->u : NULL, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureTangent(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const SbPressure *load = (const SbPressure *)e->data;
  PetscReal p;

  PetscFunctionBeginUser;
  PetscCall((*load->at)(e, space, stage, &p));
  p *= stage->shift_k;
  if (p == 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    if (load->share[b] > 0)
      PetscCall(SbSpaceAddVolume(space, b, stage->u, p * load->share[b], NULL, A));
  for (PetscInt k = 0; k < load->nfacet; k++) {
    PetscReal c[SB_CELL_NODES][SB_CELL_NODES][3] = {{{0}}};
    FacetPoint at;

    for (int q = first_point(space, &load->facet[k]); q < SbRuleFacet.n; q++) {
      PetscReal side[2][3] = {{0}};

      facet_point(space, &load->facet[k], q, &at);
      add_sides(&at, space->node_x, side);
      add_sides(&at, stage->u, side);
      for (int a = 0; a < at.n; a++) {
        for (int b = 0; b < at.n; b++) {
          const PetscReal y = at.phi[a] * at.along[1][b] - at.phi[b] * at.along[1][a];
          const PetscReal x = at.phi[a] * at.along[0][b] - at.phi[b] * at.along[0][a];

          for (int i = 0; i < 3; i++)
            c[a][b][i] += 0.5 * p * at.weight * (y * side[0][i] - x * side[1][i]);
        }
      }
    }
    for (int a = 0; a < at.n; a++) {
      for (int b = 0; b < at.n; b++) {
        const PetscReal *d = c[a][b];
        const PetscReal block[9] = {0, -d[2], d[1], d[2], 0, -d[0], -d[1], d[0], 0};

        if (d[0] == 0 && d[1] == 0 && d[2] == 0)
          continue;
        PetscCall(SbSpaceAddCellBlock(space, A, load->facet[k].cell, a, b, block));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y_a -= factor int phi_a dx x w along an edge of the rim, by Gauss' rule of 3 points, exact if
   curved. */
static void add_rim(SbSpace space, const SbRimEdge *edge, PetscReal factor, const PetscReal u[],
                    const PetscReal w[], PetscReal y[])
{
  const PetscInt n = edge->node[2] < 0 ? 2 : 3;

  for (int q = -1; q < 2; q++) {
    const PetscReal s = 0.5 + q * 0.5 * PetscSqrtReal(0.6);
    const PetscReal weight = factor * (q ? 5. : 8.) / 18.;
    const PetscReal straight[2] = {1 - s, s};
    const PetscReal curved[3] = {(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)};
    const PetscReal straight_along[2] = {-1, 1};
    const PetscReal curved_along[3] = {4 * s - 3, 4 * s - 1, 4 - 8 * s};
    const PetscReal *phi = n == 2 ? straight : curved;
    const PetscReal *along = n == 2 ? straight_along : curved_along;
    PetscReal dx[3] = {0, 0, 0};
    PetscReal W[3] = {0, 0, 0};
    PetscReal turn[3];

    for (PetscInt a = 0; a < n; a++) {
      for (int i = 0; i < 3; i++) {
        const PetscInt k = 3 * edge->node[a] + i;

        dx[i] += along[a] * (space->node_x[k] + u[k]);
        W[i] += phi[a] * w[k];
      }
    }
    SbCross(dx, W, turn);
    for (PetscInt a = 0; a < n; a++)
      for (int i = 0; i < 3; i++)
        y[3 * edge->node[a] + i] -= weight * phi[a] * turn[i];
  }
}

PetscErrorCode SbPressureBeside(SbEffect e, SbSpace space, const SbStage *stage,
                                const PetscReal x[], PetscReal y[])
{
  const SbPressure *load = (const SbPressure *)e->data;
  PetscReal p;

  PetscFunctionBeginUser;
  PetscCall((*load->at)(e, space, stage, &p));
  p *= stage->shift_k;
  if (load->some)
    PetscCall(add_surface_derivative(load, space, p, stage->u, x, y));
  for (PetscInt k = 0; k < load->nedge; k++)
    add_rim(space, &load->rim[k], 0.5 * p, stage->u, x, y);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPressureDestroy(SbEffect e)
{
  SbPressure *p = (SbPressure *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(p->facet));
  PetscCall(PetscFree(p->rim));
  PetscCall(PetscFree(p->share));
  PetscCall(PetscFree(p->weight));
  for (int k = 0; k < 3; k++)
    PetscCall(PetscFree(p->vertex[k]));
  PetscCall(SbMeanSurfaceDestroy(&p->surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"volume"};

const SbEffectType SbEffectPressure = {
  .name = "pressure",
  .size = sizeof(Pressure),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_pressure,
          .setup = SbPressureSetUp,
          .force = SbPressureForce,
          .tangent = SbPressureTangent,
          .nonsymmetric = SbPressureBeside,
          .volume_pressure = SbPressureVolume,
          .history = history_pressure,
          .destroy = SbPressureDestroy},
};
