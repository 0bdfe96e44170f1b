/*
  collision.c - bodies against each other and themselves, with Coulomb friction.

  Points (vertices of P1, centroids of boundary faces of CR and DG) of one surface meet facets of another. What a detector finds (src/contact)
  becomes a row: with n the normal and b the weights of the nearest point on the facet,

      gap = n . (x_p - sum_k b_k x_k) >= 0,     linear in u while n and b stay.

  A sharp edge and one that is at least bent of different bodies that cross each other are a pair, too: with places s and t on them gap = n . (x(s) - y(t)).

  Forces act along n at p and, by the same weights, on the facet: momentum is kept, and so is angular momentum where the gap is closed.

  Response `projected`: rows that touch are exact (src/fem/constraint.c); their multiplier is the force. `multiplier`: the same, the
  multipliers being unknowns of the solves. After each solve the
  surfaces are examined again: a pulling row leaves, a penetrated point enters, n and b are taken again, until nothing changes.
  A row that has come several times within a step stays, and n and b are kept after some searches: the loop ends. `penalty`: springs
  N = <-k g>. `augmented`: N = <lambda - k g> with a multiplier that is raised after each solve (Simo and Laursen 1992).

  Friction is in friction.c.

  With one surface searching for the other (`passes one`), the finer one looks: rows then are not more than the surface can take. A thin
  or much coarser partner wants both.
*/
#include "collision.h"

#define TOGGLES 3    /* how often a row may come within a step before it stays */
#define SLOW 25      /* solves of a step, after which the tolerance of multipliers is raised, twice */
#define EDGE_PAIRS 8 /* of one edge, that have identities of their own */
#define PULLING 1e-6 /* of the largest contact force: what a row must pull with to leave */

PetscErrorCode SbContactOptions_Collision(SbEffect e, const SbScope *scope, const SbContactOptions *o)
{
  Collision *c = (Collision *)e->data;
  PetscInt choice;

  PetscFunctionBeginUser;
  PetscCall(SbEffectReadOn(scope, &c->on));
  PetscCall(SbOptionBool(scope, "self", &c->self));
  c->response = o->response;
  c->friction = o->friction;
  if (c->response == BARRIER) {
    SbBarrierScene scene = {.on = &c->on, .self = c->self, .friction = c->friction.mu, .restitution = o->restitution};

    PetscCall(SbOptionBool(scope, "pairs", &scene.pairs));
    PetscCall(SbBarrierCreate(e, scope, &scene));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  c->cut = o->cut;
  c->stiffness = o->stiffness;
  c->damping = o->damping;
  c->bounce.e = o->restitution;
  SbOverlapSet(&c->overlap, o->separation_steps);
  PetscCall(SbOptionChoice(scope, "detection", &choice));
  PetscCall(SbDetectorCreate((SbDetectKind)choice, &c->detector));
  PetscCall(SbOptionChoice(scope, "passes", &choice));
  c->both = (PetscBool)(choice == 1);
  PetscCall(SbOptionReal(scope, "search_radius", &c->reach));
  PetscCall(SbOptionBool(scope, "pairs", &c->pairs.wanted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ set-up */

static PetscReal facet_stiffness(const Collision *c, SbSpace space, const SbFacet *facet)
{
  const SbMaterial m = space->material[space->mesh->cell_material[facet->cell]];

  return c->stiffness * SbMaterialWaveModulus(m) * facet->area / facet->height;
}

/* Springs: (lambda + 2 mu) area / height, summed over the facets at a point; of an edge that of its first facet. */
static PetscErrorCode find_stiffness(Collision *c, SbSpace space, PetscInt n, const SbFacet facet[])
{
  PetscInt *slot;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(c->surface->scene.npoint, &c->point_k));
  PetscCall(PetscMalloc1(space->nnode, &slot));
  for (PetscInt i = 0; i < space->nnode; i++) slot[i] = -1;
  for (PetscInt i = 0; i < c->surface->scene.npoint; i++) slot[c->surface->point_node[i]] = i;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal k = facet_stiffness(c, space, &facet[i]);
    const PetscBool vertices = (PetscBool)(SbSpaceCellElement(space, facet[i].cell)->nodes_per[0] > 0);

    for (int q = 0; q < (vertices ? 3 : 1); q++) {
      const PetscInt a = vertices ? facet[i].corner[q] : facet[i].face;
      const PetscInt at = slot[space->cell_node[4 * facet[i].cell + a]];

      if (at >= 0) c->point_k[at] += vertices ? k / 3 : k;
    }
  }
  PetscCall(PetscFree(slot));
  PetscCall(PetscMalloc1(c->surface->scene.edges->nown, &c->edge_k));
  for (PetscInt i = 0; i < c->surface->scene.edges->nown; i++)
    c->edge_k[i] = facet_stiffness(c, space, &facet[c->surface->edge_facet[i]]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean edge of each body's surface: the root of its mean facet area. Output: bodies that have one. */
static PetscErrorCode find_edges(Collision *c, SbSpace space, PetscInt n, const SbFacet facet[],
                                 PetscInt *nskin)
{
  const PetscInt nbody = space->mesh->nbody;
  PetscReal *count;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(nbody, &c->edge, nbody, &c->whole));
  PetscCall(PetscCalloc1(nbody, &count));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt b = space->mesh->cell_body[facet[i].cell];

    if (facet[i].cell >= space->mesh->ncell_owned) continue;
    c->edge[b] += facet[i].area;
    count[b]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, c->edge, (PetscMPIInt)nbody, MPIU_REAL, MPI_SUM, space->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)nbody, MPIU_REAL, MPI_SUM, space->comm));
  *nskin = 0;
  for (PetscInt b = 0; b < nbody; b++) {
    *nskin += count[b] > 0;
    c->whole[b] = (PetscBool)(count[b] == (PetscReal)space->mesh->body[b].nfacet);
    c->edge[b] = count[b] > 0 ? PetscSqrtReal(c->edge[b] / count[b]) : 0;
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_collision(SbEffect e, SbSpace space)
{
  Collision *c = (Collision *)e->data;
  SbFacet *facet;
  PetscInt n, nskin;
  PetscBool *takes_part;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &c->on, &n, &facet));
  PetscCall(SbContactSurfaceCreate(space, n, facet, &c->surface));
  PetscCall(find_stiffness(c, space, n, facet));
  PetscCall(find_edges(c, space, n, facet, &nskin));
  PetscCall(SbInsideCreate(c->surface, &c->inside));
  PetscCall(PetscCalloc1(c->surface->scene.npoint, &c->alone));
  c->watched = -PETSC_MAX_REAL;
  PetscCall(PetscFree(facet));
  PetscCheck(nskin > 1 || c->self, space->comm, PETSC_ERR_USER_INPUT,
             "The effect %s has only one body to examine: give -effect_%s_self yes for a body that may meet "
             "itself, or more sets with -effect_%s_on",
             e->name, e->name, e->name);
  PetscCall(PetscMalloc1(space->mesh->nbody, &takes_part));
  for (PetscInt b = 0; b < space->mesh->nbody; b++) takes_part[b] = (PetscBool)(c->edge[b] > 0);
  PetscCall(SbPairsSetUp(e, space->mesh, takes_part, c->self, &c->pairs));
  PetscCall(PetscFree(takes_part));
  PetscCall(PetscMalloc1(3 * space->nnode, &c->u0));
  if (c->bounce.e > 0) PetscCall(PetscMalloc1(3 * space->nnode, &c->flight));
  PetscCheck(c->damping <= 0 || e->dynamic, space->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_damping %g s: a static run has no speed to damp; leave it out", e->name,
             (double)c->damping);
  if (!e->dynamic) c->overlap.recovery = 0;
  if (c->reach == 0) c->reach = 0.5 * c->surface->edge;
  PetscCall(SbSpaceCreateConstraints(space, PETSC_FALSE, (PetscBool)(c->friction.mu > 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ who touches */

/* A point that was apart when the step began and is behind now, by a motion that did not know of it: when it came. */
static void watch_arrival(Collision *c, const Hit *hit)
{
  const PetscReal gap0 = SbDot3(hit->normal, hit->start) - hit->value, small = TOLERANCE * c->surface->size;

  if (!c->cut || hit->was || gap0 <= small || SbCollisionExcess(hit) >= -small) return;
  c->arrival = PetscMin(c->arrival, gap0 / (gap0 - hit->gap));
}

static PetscErrorCode arrive_collision(SbEffect e, PetscReal *part)
{
  Collision *c = (Collision *)e->data;

  PetscFunctionBeginUser;
  *part = c->arrival;
  for (PetscInt i = 0; c->arrival < 1 && i < c->nhit; i++) { /* what arrived has pressed for a whole step */
    if (!c->hit[i].was) c->hit[i].lambda = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode touch_collision(SbEffect e, SbSpace space, PetscReal t, PetscReal dt,
                                      const PetscReal u0[], const PetscReal v0[], const PetscReal u[])
{
  Collision *c = (Collision *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(c->u0, u0, 3 * space->nnode));
  c->friction.updates = 0;
  SbOverlapBegin(&c->overlap, dt);
  c->damp = dt > 0 ? c->damping / dt : 0;
  if (c->begun)
    PetscCall(SbCollisionWatchInside(e, t, u0));
  else
    PetscCall(SbCollisionFindOverlap(e, u0));
  PetscCall(SbCollisionRestore(c));
  c->first = PETSC_TRUE;
  c->arrival = 1;
  SbRestitutionBegin(&c->bounce, dt);
  if (v0 && c->flight) {
    SbCollisionFly(c, space, u0, v0, u);
    PetscCall(SbCollisionLook(c, c->flight, PETSC_FALSE));
    SbCollisionMeet(c);
  } else
    PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const PetscBool was = hit->on;

    hit->toggles = hit->looks = 0;
    if (!hit->on) hit->lambda = 0;
    if (c->friction.mu > 0) SbFrictionBegin(&hit->grip, hit->on);
    watch_arrival(c, hit);
    if (!exact(c->response))
      hit->on =
        (PetscBool)(hit->lambda - hit->k * (SbCollisionExcess(hit) - TOLERANCE * c->surface->size) >= 0);
    else if (SbCollisionExcess(hit) <= TOLERANCE * c->surface->size)
      SbCollisionHit(c, hit);
    if (c->friction.mu > 0 && hit->on && !was) SbCollisionFrictionEnter(c, hit);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ rows */

/* Edges come after points, which so are preferred where both say the same. */
static PetscInt row_id(const Collision *c, PetscInt i)
{
  const Hit *hit = &c->hit[i];
  const SbDetectScene *s = &c->surface->scene;
  const SbMesh mesh = c->surface->space->mesh;
  const PetscInt64 points = (mesh->Nvert + 8 * (PetscInt64)mesh->Ncell) * mesh->nbody;
  PetscInt before = 0;

  if (!SbCollisionOfEdges(c, hit))
    return (PetscInt)((s->point_id[hit->point] * (PetscInt64)mesh->nbody + hit->part) % SB_COLLISION_IDS);
  while (before < i && c->hit[i - before - 1].point == hit->point) before++;
  return (PetscInt)((points + s->edges->id[hit->point - s->npoint] * (PetscInt64)EDGE_PAIRS +
                     PetscMin(before, EDGE_PAIRS - 1)) %
                    SB_COLLISION_IDS);
}

static PetscErrorCode hold_collision(SbEffect e, SbSpace space)
{
  Collision *c = (Collision *)e->data;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    PetscReal coef[3 * NODES], push[3 * NODES];
    PetscBool oblique = PETSC_FALSE;

    hit->row = hit->grip.slide[0] = hit->grip.slide[1] = -1;
    if (!hit->on) continue;
    hit->held = hit->mine;
    SbCollisionCoef(hit, hit->normal, coef);
    if (c->friction.mu > 0) SbCollisionFrictionPush(c, hit, push, &oblique);
    if (exact(c->response))
      PetscCall(SbSpaceAddConstraint(space, row_id(c, i), hit->n, hit->node, coef, oblique ? push : NULL,
                                     SbCollisionPlace(hit), &hit->row));
    else
      PetscCall(SbSpaceAddPenaltyConstraint(space, hit->n, hit->node, coef, oblique ? push : NULL,
                                            SbCollisionPlace(hit), hit->k * (1 + c->damp),
                                            hit->lambda + SbCollisionBefore(c, hit), &hit->row));
    if (c->friction.mu > 0) PetscCall(SbCollisionFrictionHold(c, space, i, row_id(c, i)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ settling */

/* Whether an exact constraint is there, or not, as it should be; changes it if not. */
static PetscBool settle_row(const Collision *c, PetscReal largest, Hit *hit)
{
  const PetscReal small = TOLERANCE * c->surface->size;

  if (!hit->on) {
    if (SbCollisionExcess(hit) >= -small) return PETSC_TRUE;
    SbCollisionHit(c, hit);
    hit->toggles++;
    return PETSC_FALSE;
  }
  if (hit->lambda < -PULLING * largest && hit->toggles < TOGGLES) {
    hit->on = PETSC_FALSE;
    hit->lambda = 0;
    return PETSC_FALSE;
  }
  hit->lambda = PetscMax(0, hit->lambda);
  if (hit->rests) return PETSC_TRUE;
  return (PetscBool)(PetscAbsReal(SbCollisionExcess(hit)) <= small);
}

/*
  The same for springs: who pushes, and with `augmented` the multiplier. Where rows say the same twice, force goes over from one to the
  other in ever smaller parts: after some solves a larger penetration will do.
*/
static PetscBool settle_spring(const Collision *c, Hit *hit)
{
  const PetscReal force = SbCollisionForce(c, hit);
  const PetscReal tolerance = TOLERANCE * c->surface->size *
                              (hit->looks < SLOW       ? 1
                               : hit->looks < 2 * SLOW ? 10
                                                       : 100);
  const PetscBool was = hit->on;

  hit->on = (PetscBool)(force > 0);
  if (c->response == AUGMENTED &&
      (force > 0 ? PetscAbsReal(SbCollisionExcess(hit)) > tolerance : hit->lambda > 0)) {
    hit->lambda = force;
    return PETSC_FALSE;
  }
  return (PetscBool)(was == hit->on);
}

/* What a solve made of the rows of a pair: its multiplier, gap and place, should its normal and weights stay. */
static void read_rows(const Collision *c, SbSpace space, Hit *hit)
{
  PetscReal force, along;

  hit->rests = PETSC_FALSE;
  if (hit->row < 0) return;
  SbSpaceGetConstraint(space, hit->row, &force, &along);
  hit->rests = SbSpaceIsConstraintRedundant(space, hit->row);
  if (hit->rests) {
    hit->lambda = 0;
    hit->gap =
      hit->leaves - hit->allowed; /* so those rows say; the next search tells more if it finds the pair */
  } else {
    if (exact(c->response)) hit->lambda = force;
    hit->gap = along - hit->value;
  }
  if (c->friction.mu > 0) SbCollisionFrictionRead(c, space, along, hit);
}

static PetscErrorCode settle_collision(SbEffect e, SbSpace space, const PetscReal u[], const PetscReal r[],
                                       PetscBool *changed)
{
  Collision *c = (Collision *)e->data;
  PetscReal largest = 0;
  PetscBool mine = PETSC_FALSE;

  PetscFunctionBeginUser;
  (void)r;
  for (PetscInt i = 0; i < c->nhit; i++) read_rows(c, space, &c->hit[i]);
  PetscCall(SbCollisionLook(c, u, PETSC_TRUE));
  for (PetscInt i = 0; i < c->nhit; i++) largest = PetscMax(largest, SbCollisionForce(c, &c->hit[i]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPI_MAX, space->comm));
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const PetscBool was = hit->on;
    PetscBool right;

    if (c->first && !hit->on) watch_arrival(c, hit);
    right = exact(c->response) ? settle_row(c, largest, hit) : settle_spring(c, hit);
    if (!right) mine = PETSC_TRUE;
    if (c->friction.mu > 0 && hit->on && !was) SbCollisionFrictionEnter(c, hit);
  }
  c->first = PETSC_FALSE;
  if (c->friction.mu > 0) SbCollisionFrictionSettle(c, largest, &mine);
  if (mine) *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ after a step */

/* The force of an exact constraint with what the end of a step of Newmark has added to it. */
static void read_impulse(const Collision *c, SbSpace space, Hit *hit)
{
  PetscReal force, along;

  if (!exact(c->response) || !hit->on || hit->row < 0 || SbSpaceIsConstraintRedundant(space, hit->row))
    return;
  SbSpaceGetConstraint(space, hit->row, &force, &along);
  hit->lambda = PetscMax(0, force);
}

/* Work of the forces on the way from the start of the step. */
static PetscErrorCode accept_collision(SbEffect e, SbSpace space, const SbStage *stage)
{
  Collision *c = (Collision *)e->data;

  PetscFunctionBeginUser;
  if (c->friction.mu > 0) PetscCall(SbCollisionFrictionAccept(c, e->name, space, stage->t));
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const PetscReal normal = hit->on ? SbCollisionForce(c, hit) : 0;

    hit->was = (PetscBool)(hit->on && hit->leaves <= 0);
    for (int k = 0; k < 3 && normal > 0; k++)
      c->work += normal * hit->normal[k] * (hit->now[k] - hit->start[k]);
    read_impulse(c, space, hit);
  }
  PetscCall(SbCollisionFollowOverlap(c));
  PetscCall(SbCollisionKeep(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_collision(SbEffect e, SbSpace space, const SbStage *stage,
                                        const PetscReal residual[], PetscReal values[])
{
  Collision *c = (Collision *)e->data;
  PetscReal deepest = 0, sum[2] = {0, 0};
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  (void)stage;
  (void)residual;
  for (PetscInt k = 0; k < e->ncolumn; k++) values[k] = 0;
  for (PetscInt i = 0; i < c->nhit; i++) {
    const Hit *hit = &c->hit[i];

    if (hit->depth > TOLERANCE * c->surface->size) {
      deepest = PetscMax(deepest, hit->depth);
      sum[0] += hit->depth;
      sum[1]++;
    }
    if (!hit->on || SbCollisionForce(c, hit) <= 0) continue;
    values[0]++;
    values[3] += SbCollisionForce(c, hit);
    values[4] += PetscSqrtReal(SbDot3(hit->grip.drag, hit->grip.drag));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &deepest, 1, MPIU_REAL, MPI_MAX, space->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, space->comm));
  PetscCallMPI(MPI_Comm_rank(space->comm, &rank));
  if (!rank) {
    values[1] = deepest;
    values[2] = sum[1] > 0 ? sum[0] / sum[1] : 0;
  }
  values[5] = c->work;
  values[6] = c->friction.loss;
  SbCollisionPairsHistory(c, space, values);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gaps of points; edges have their own. */
static PetscErrorCode near_collision(SbEffect e, SbSpace space, const SbStage *stage, PetscReal gap[],
                                     PetscReal normal[])
{
  const Collision *c = (const Collision *)e->data;

  PetscFunctionBeginUser;
  (void)space;
  (void)stage;
  for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
    const PetscInt node = c->surface->point_node[c->hit[i].point];

    if (c->hit[i].gap >= gap[node]) continue;
    gap[node] = c->hit[i].gap;
    for (int k = 0; k < 3; k++) normal[3 * node + k] = c->hit[i].normal[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How surfaces were examined; of the last search what the rank that had most to do says. */
static PetscErrorCode tell_collision(SbEffect e, SbSpace space, size_t size, char text[])
{
  const Collision *c = (const Collision *)e->data;
  PetscInt64 sum[2] = {c->candidates, 0};
  SbDetectStats stats;
  struct {
    double candidates;
    int rank;
  } most = {0, 0};

  PetscFunctionBeginUser;
  PetscCall(SbDetectorGetStats(c->detector, &stats));
  sum[1] = stats.memory;
  most.candidates = (double)stats.candidates;
  PetscCallMPI(MPI_Comm_rank(space->comm, &most.rank));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE_INT, MPI_MAXLOC, space->comm));
  PetscCallMPI(MPI_Bcast(stats.text, (PetscMPIInt)sizeof(stats.text), MPI_CHAR, most.rank, space->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_INT64, MPI_SUM, space->comm));
  if (c->looks)
    PetscCall(PetscSNPrintf(text, size,
                            "%" PetscInt64_FMT
                            " searches of surfaces, %.3g pairs of point and facet in each; %s; "
                            "%.3g kB",
                            c->looks, (double)sum[0] / (double)c->looks, stats.text, (double)sum[1] / 1e3));
  else
    PetscCall(PetscStrncpy(text, "no bodies came near each other", size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_collision(SbEffect e)
{
  Collision *c = (Collision *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFreeOn(&c->on));
  PetscCall(SbInsideDestroy(&c->inside));
  PetscCall(PetscFree(c->alone));
  PetscCall(SbContactSurfaceDestroy(&c->surface));
  PetscCall(SbDetectorDestroy(&c->detector));
  PetscCall(PetscFree2(c->way, c->way_part));
  PetscCall(PetscFree(c->point_k));
  PetscCall(PetscFree(c->edge_k));
  PetscCall(PetscFree2(c->edge, c->whole));
  PetscCall(PetscFree(c->u0));
  PetscCall(PetscFree(c->flight));
  PetscCall(PetscFree(c->hit));
  PetscCall(PetscFree(c->spare));
  PetscCall(PetscFree(c->past));
  PetscCall(SbPairsFree(&c->pairs));
  PetscCall(PetscFree(e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactCreate_Collision(SbEffect e)
{
  static const char *const columns[] = {"contacts",       "penetration", "penetration_mean", "normal_force",
                                        "friction_force", "work",        "friction_loss"};
  Collision *c;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&c));
  e->data = c;
  e->steady = PETSC_FALSE; /* a load factor does not make bodies pass through each other */
  e->ops.setup = setup_collision;
  e->ops.begin_step = touch_collision;
  e->ops.assemble_constraints = hold_collision;
  e->ops.update_active_set = settle_collision;
  e->ops.time_of_impact = arrive_collision;
  e->ops.restitution = SbEffectRestitution_Collision;
  e->ops.scale_restitution = SbEffectScaleRestitution_Collision;
  e->ops.accept = accept_collision;
  e->ops.history = history_collision;
  e->ops.save = SbEffectSave_Collision;
  e->ops.load = SbEffectLoad_Collision;
  e->ops.rename = SbEffectRename_Collision;
  e->nstate = SB_COLLISION_STATE;
  e->ops.gap = near_collision;
  e->ops.contact_points = SbEffectContactPoints_Collision;
  e->ops.summary = tell_collision;
  e->ops.destroy = destroy_collision;
  e->column = columns;
  e->ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns);
  PetscFunctionReturn(PETSC_SUCCESS);
}
