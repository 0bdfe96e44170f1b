/*
  barrier.c - contact by a barrier, with friction: surfaces never touch, and no step lets them through each other.

  Below the width w pairs of features push each other by the barrier of src/contact/barrier.c, an energy that is infinite where they touch. It joins the
  potential that Newton's method lowers (src/time/newton.c), and no iteration goes farther than the pairs allow (src/contact/contact_pairs.c). So a state that is accepted can be reached
  from the one before it without surfaces passing through each other.

  What moves by order, an obstacle on its path, goes on straight ways from where it is at the start of a step to where it is at its end, and as far on these as
  `progress` says: Newton's method raises it to one as fast as the surfaces let it.

  Friction: Coulomb's law with the normal forces N and nearest places that the pairs have when the step begins (Li et al., "Incremental potential contact",
  ACM TOG 39(4), 2020, section 4): the energy mu N f0(|u_t|) of the slip u_t since then, whose slope rises from 0 to 1 within the slip e = dt times a small speed:

    f0 = u^2/e - u^3/(3 e^2) + e/3,   f0' = 2 u/e - u^2/e^2   for u < e;   f0 = u, f0' = 1   beyond.

  Touching starts. Surfaces that touch when a run begins are moved apart, by less than the width; those that are in each other end the run.
*/
#include "barrier.h"

#define WIDTH 1e-3       /* of the size of the smallest body: default of w */
#define PRESSURE 0.1     /* of Young's modulus of the softer side */
#define SLIP 1e-3        /* of the size of the smallest body per second: speed below which friction sticks */
#define SLIP_STATIC 1e-5 /* of the size: the same in a static run, as a length */
#define APART 0.5        /* of w: how far touching surfaces are moved apart at the start */
#define PASSES 200       /* over all pairs for that */

/* A pair below its width, at the places that the effect knows. */
typedef struct {
  PetscInt pair;
  PetscReal gap; /* m */
  SbDistance at;
} Active;

/* A pair that friction acts on in this step. */
typedef struct {
  SbContactPair pair;
  PetscReal weight[4], n[3], force; /* mu N, N */
} Rub;

typedef struct {
  SbBarrierScene scene;
  void *data; /* of the type */
  PetscErrorCode (*destroy)(SbEffect e);
  SbContactMesh mesh;
  SbContactPairs pairs;
  PetscReal width, pressure; /* as given; 0: by body */
  PetscReal *w, *k;          /* [nbody+1] of each body, m, Pa; the obstacle's: none smaller */
  PetscBool verify, begun;
  PetscReal *x, *u;        /* [nvertex][3] places, m; [nnode_owned][3] displacement that they belong to */
  PetscReal *start;        /* [nvertex][3] when the step began */
  PetscReal *from, *to;    /* [obstacle's vertices][3] at the start and the end of the step */
  PetscReal progress, now; /* how far on that way it is; at which x was made */
  PetscReal *other;        /* [nvertex][3] where a motion leads */
  PetscBool known;         /* x and active are up to date for u and progress */
  PetscInt nactive, size;
  Active *active;
  PetscInt nrub, rub_size;
  Rub *rub;
  PetscReal slip;            /* e of friction, m */
  PetscReal least, shortest; /* smallest gap and shortest safe part of the run */
  PetscInt most;             /* pairs */
} Barrier;

/* ------------------------------------------------------------------ set-up */

static PetscErrorCode setup_barrier(SbEffect e, SbSpace s)
{
  Barrier *b = (Barrier *)e->data;
  const PetscInt nbody = s->mesh->nbody;
  SbFacet *facet;
  PetscInt n;

  PetscFunctionBeginUser;
  if (b->scene.setup_obstacle) PetscCall((*b->scene.setup_obstacle)(e, s, b->data));
  s->coupled = PETSC_TRUE;
  PetscCall(SbEffectFacets(s, b->scene.on, &n, &facet));
  PetscCall(SbContactMeshCreate(s, n, facet, b->scene.obstacle, &b->mesh));
  PetscCall(PetscFree(facet));

  /* width and pressure of each body */
  PetscCall(PetscMalloc2(nbody + 1, &b->w, nbody + 1, &b->k));
  b->w[nbody] = b->k[nbody] = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < nbody; i++) {
    b->w[i] = b->width > 0. ? b->width : PetscMin(WIDTH * b->mesh->size, 0.5 * b->mesh->shortest);
    b->k[i] = b->pressure > 0. ? b->pressure : PRESSURE * s->material[i]->E;
  }
  PetscCheck(b->w[0] <= b->mesh->shortest, s->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_barrier_width %g m is larger than the shortest edge of the surface, %g m: take at "
             "most half of that",
             e->name, (double)b->width, (double)b->mesh->shortest);
  PetscCall(SbContactPairsCreate(b->mesh, b->scene.self, (PetscBool)!b->scene.obstacle, b->w[0], &b->pairs));
  PetscCall(PetscMalloc3(3 * b->mesh->nvertex, &b->x, 3 * b->mesh->nvertex, &b->start, 3 * b->mesh->nvertex,
                         &b->other));
  PetscCall(PetscMalloc3(3 * s->nnode_owned, &b->u, 3 * (b->mesh->nvertex - b->mesh->nbody_vertex), &b->from,
                         3 * (b->mesh->nvertex - b->mesh->nbody_vertex), &b->to));
  b->least = PETSC_MAX_REAL;
  b->shortest = 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ where things are */

/* Places of the obstacle's vertices after the part `progress` of its way. */
static void place_obstacle(const Barrier *b, PetscReal progress, PetscReal x[])
{
  const PetscInt first = 3 * b->mesh->nbody_vertex;

  for (PetscInt k = first; k < 3 * b->mesh->nvertex; k++)
    x[k] = progress == 1. ? b->to[k - first]
                          : b->from[k - first] + progress * (b->to[k - first] - b->from[k - first]);
}

static inline PetscReal width_of(const Barrier *b, const SbContactPair *pair)
{
  const PetscInt *part = b->mesh->part;

  return PetscMin(b->w[part[pair->v[0]]], b->w[part[pair->v[pair->side ? 1 : 2]]]);
}

static inline PetscReal pressure_of(const Barrier *b, const SbContactPair *pair)
{
  const PetscInt *part = b->mesh->part;

  return PetscMin(b->k[part[pair->v[0]]], b->k[part[pair->v[pair->side ? 1 : 2]]]);
}

/* Whether this rank counts the pair. */
static inline PetscBool counts(const Barrier *b, const SbContactPair *pair)
{
  return (PetscBool)b->mesh->own[pair->v[pair->v[0] < b->mesh->nbody_vertex ? 0 : 1]];
}

static int compare_active(const void *x, const void *y, void *ctx)
{
  const SbContactPair *pair = ((const Barrier *)ctx)->pairs->pair, *p = &pair[((const Active *)x)->pair],
                      *q = &pair[((const Active *)y)->pair];

  if (p->side != q->side) return p->side ? 1 : -1;
  if (p->kind != q->kind) return p->kind < q->kind ? -1 : 1;
  for (int k = 0; k < 4; k++) {
    if (p->v[k] != q->v[k]) return p->v[k] < q->v[k] ? -1 : 1;
  }
  return 0;
}

/* The places at the local displacements u, and the pairs below their width, in the order of their numbers. Collective. */
static PetscErrorCode look(Barrier *b, const PetscReal u[])
{
  const PetscInt n = 3 * b->mesh->space->nnode_owned;
  PetscBool same;

  PetscFunctionBeginUser;
  PetscCall(PetscArraycmp(u, b->u, b->known ? n : 0, &same));
  same = (PetscBool)(b->known && same && b->now == b->progress);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, SB_MPI_BOOL, MPI_LAND, b->mesh->space->comm));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(b->u, u, n));
  b->now = b->progress;
  b->known = PETSC_TRUE;
  PetscCall(SbContactMeshMove(b->mesh, u, NULL, b->x));
  place_obstacle(b, b->progress, b->x);
  PetscCall(SbContactPairsFind(b->pairs, b->x, b->x));
  b->nactive = 0;
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    Active a = {.pair = i};

    if (SbContactPairApart(b->mesh, &b->pairs->pair[i], b->x, b->x, b->w[0])) continue;
    a.gap = SbContactPairGap(b->mesh, &b->pairs->pair[i], b->x, &a.at);
    if (a.gap >= width_of(b, &b->pairs->pair[i])) continue;
    if (b->nactive == b->size) {
      b->size = PetscMax(64, 2 * b->size);
      PetscCall(PetscRealloc((size_t)b->size * sizeof(*b->active), &b->active));
    }
    b->active[b->nactive++] = a;
  }
  if (b->nactive > 1) PetscCall(PetscTimSort(b->nactive, b->active, sizeof(*b->active), compare_active, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ forces */

/* The tangential slip of a pair since the step began, m. */
static PetscReal slip_of(const Barrier *b, const Rub *rub, PetscReal u[3])
{
  PetscReal normal = 0.;

  for (int i = 0; i < 3; i++) {
    u[i] = 0.;
    for (int k = 0; k < 4; k++)
      u[i] += rub->weight[k] * (b->x[3 * rub->pair.v[k] + i] - b->start[3 * rub->pair.v[k] + i]);
    normal += u[i] * rub->n[i];
  }
  for (int i = 0; i < 3; i++) u[i] -= normal * rub->n[i];
  return PetscSqrtReal(SbDot3(u, u));
}

/* Energy of friction, J, its gradient by the pair's vertices, N. */
static PetscReal rub_pair(const Barrier *b, const Rub *rub, PetscReal gradient[12])
{
  PetscReal u[3];
  const PetscReal y = slip_of(b, rub, u), e = b->slip, slope = y < e ? 2. / e - y / (e * e) : 1. / y;

  for (int k = 0; k < 12; k++) gradient[k] = rub->force * slope * rub->weight[k / 3] * u[k % 3];
  return rub->force * (y < e ? y * y / e - y * y * y / (3. * e * e) + e / 3. : y);
}

/* f += sign times the force with which each of the pair's vertices pushes its owned nodes. */
static void spread(const Barrier *b, const SbContactPair *pair, PetscReal sign, const PetscReal gradient[12],
                   PetscReal f[])
{
  const SbContactMesh m = b->mesh;

  for (int k = 0; k < (pair->side ? 1 : 4); k++) {
    const PetscInt v = pair->v[k];

    if (v >= m->nbody_vertex) continue;
    for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
      if (m->node[j] < 0 || m->node[j] >= m->space->nnode_owned) continue;
      for (int i = 0; i < 3; i++) f[3 * m->node[j] + i] += sign * m->weight[j] * gradient[3 * k + i];
    }
  }
}

/* f += sign times the gradient of all energies at the places known, N; their sum over the pairs that this rank counts, J. */
static PetscReal add_gradient(const Barrier *b, PetscReal sign, PetscReal f[])
{
  PetscReal sum = 0., energy, gradient[12];

  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];

    SbBarrierPair(b->mesh, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), &energy,
                  gradient, PETSC_FALSE, NULL);
    spread(b, pair, sign, gradient, f);
    if (counts(b, pair)) sum += energy;
  }
  for (PetscInt i = 0; i < b->nrub; i++) {
    energy = rub_pair(b, &b->rub[i], gradient);
    spread(b, &b->rub[i].pair, sign, gradient, f);
    if (counts(b, &b->rub[i].pair)) sum += energy;
  }
  return sum;
}

static PetscErrorCode force_barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[])
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(look(b, stage->u));
  (void)add_gradient(b, -1., f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode potential_barrier(SbEffect e, SbSpace s, const PetscReal u[], PetscReal *energy,
                                        PetscReal f[])
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  *energy = 0.;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(look(b, u));
  *energy = add_gradient(b, 1., f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* blocks += H of a pair between owned nodes and all nodes of its vertices; none at prescribed unknowns. */
static PetscErrorCode spread_blocks(const Barrier *b, const SbContactPair *pair, const PetscReal H[144],
                                    SbBlocks *blocks)
{
  const SbContactMesh m = b->mesh;
  const int n = pair->side ? 1 : 4;

  PetscFunctionBeginUser;
  for (int p = 0; p < n; p++) {
    if (pair->v[p] >= m->nbody_vertex || !m->mine[pair->v[p]]) continue;
    for (PetscInt j = m->start[pair->v[p]]; j < m->start[pair->v[p] + 1]; j++) {
      if (m->node[j] < 0 || m->node[j] >= m->space->nnode_owned) continue;
      for (int q = 0; q < n; q++) {
        if (pair->v[q] >= m->nbody_vertex) continue;
        for (PetscInt l = m->start[pair->v[q]]; l < m->start[pair->v[q] + 1]; l++) {
          PetscReal block[9];

          for (int i = 0; i < 9; i++)
            block[i] = (m->fixed[j] >> (i / 3) & 1) || (m->fixed[l] >> (i % 3) & 1)
                         ? 0.
                         : m->weight[j] * m->weight[l] * H[12 * (3 * p + i / 3) + 3 * q + i % 3];
          PetscCall(SbBlocksAdd(blocks, m->node[j], m->gnode[l], block));
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode hessian_barrier(SbEffect e, SbSpace s, const PetscReal u[], PetscBool clamp,
                                      SbBlocks *blocks)
{
  Barrier *b = (Barrier *)e->data;
  PetscReal energy, gradient[12], H[144];

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(look(b, u));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];

    SbBarrierPair(b->mesh, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), &energy,
                  gradient, clamp, H);
    PetscCall(spread_blocks(b, pair, H, blocks));
  }

  /* friction: mu N (f0'/u (I - n n - u u/u^2) + f0'' u u/u^2) */
  for (PetscInt i = 0; i < b->nrub; i++) {
    const Rub *rub = &b->rub[i];
    PetscReal d[3], T[9];
    const PetscReal y = slip_of(b, rub, d), w = b->slip, slope = y < w ? 2. / w - y / (w * w) : 1. / y,
                    curve = y < w ? 2. / w - 2. * y / (w * w) : 0.;

    for (int k = 0; k < 9; k++) {
      T[k] = slope * ((k % 4 ? 0. : 1.) - rub->n[k / 3] * rub->n[k % 3]);
      if (y > 0.) T[k] += (curve - slope) * d[k / 3] * d[k % 3] / (y * y);
    }
    for (int k = 0; k < 144; k++)
      H[k] = rub->force * rub->weight[k / 36] * rub->weight[k % 12 / 3] * T[3 * (k / 12 % 3) + k % 3];
    PetscCall(spread_blocks(b, &rub->pair, H, blocks));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ a step */

/* Unit outward normals of all vertices at rest of the step, by area. */
static PetscErrorCode vertex_normals(const Barrier *b, const PetscReal x[], PetscReal normal[])
{
  const SbContactMesh m = b->mesh;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(normal, 3 * m->nvertex));
  for (PetscInt t = 0; t < m->ntriangle; t++) {
    const PetscInt *v = m->triangle + 3 * t;
    PetscReal p[3], q[3], n[3];

    for (int i = 0; i < 3; i++) {
      p[i] = x[3 * v[1] + i] - x[3 * v[0] + i];
      q[i] = x[3 * v[2] + i] - x[3 * v[0] + i];
    }
    SbCross(p, q, n);
    for (int k = 0; k < 9; k++) normal[3 * v[k / 3] + k % 3] += n[k % 3];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Surfaces that touch are moved apart to APART of the width: each pair that is nearer moves its vertices by its weights, again and again. u: local displacements, written.
  Every rank sees its own pairs; what vertices move by is gathered.
*/
static PetscErrorCode part_touching(SbEffect e, SbSpace s, PetscReal u[], PetscBool *moved)
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;
  const PetscReal tiny = 1e-9 * m->size;
  PetscReal *push, *normal;
  PetscInt *count, crossings, where[5];

  PetscFunctionBeginUser;
  *moved = PETSC_FALSE;
  PetscCall(PetscMalloc3(3 * m->nvertex, &push, 3 * m->nvertex, &normal, m->nvertex, &count));
  for (int pass = 0; pass < PASSES; pass++) {
    PetscInt n = 0;

    PetscCall(SbContactMeshMove(m, u, NULL, b->x));
    place_obstacle(b, 0., b->x);
    PetscCall(vertex_normals(b, b->x, normal));
    PetscCall(SbContactPairsFind(b->pairs, b->x, b->x));
    PetscCall(PetscArrayzero(push, 3 * m->nvertex));
    PetscCall(PetscArrayzero(count, m->nvertex));
    for (PetscInt i = 0; i < b->pairs->n; i++) {
      const SbContactPair *pair = &b->pairs->pair[i];
      const PetscReal goal = APART * width_of(b, pair);
      PetscReal gap, sum = 0., direction[3], side = 0.;
      SbDistance d;

      if (!counts(b, pair)) continue;
      gap = SbContactPairGap(m, pair, b->x, &d);
      if (gap >= 0.9 * goal) continue;
      for (int k = 0; k < 3; k++) direction[k] = d.n[k];
      if (!pair->side && d.d < tiny) {
        /* no direction: outwards from the second side */
        for (int k = 0; k < 3; k++) {
          direction[k] = 0.;
          for (int v = pair->kind == SB_PAIR_EDGE_EDGE ? 2 : 1; v < 4; v++)
            direction[k] += normal[3 * pair->v[v] + k];
        }
        side = PetscSqrtReal(SbDot3(direction, direction));
        if (side <= 0.) continue;
        for (int k = 0; k < 3; k++) direction[k] /= side;
      }
      for (int k = 0; k < 4; k++) {
        if (!m->driven[pair->v[k]]) sum += PetscSqr(d.weight[k]);
      }
      if (sum <= 0.) continue;
      n++;
      for (int k = 0; k < 12; k++) {
        const PetscInt v = pair->v[k / 3];

        if (!m->driven[v] && d.weight[k / 3] != 0.)
          push[3 * v + k % 3] += (goal - gap) * d.weight[k / 3] / sum * direction[k % 3];
        if (!m->driven[v] && d.weight[k / 3] != 0. && k % 3 == 0) count[v]++;
      }
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, s->comm));
    if (!n) break;
    *moved = PETSC_TRUE;
    PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, push, (PetscMPIInt)(3 * m->nvertex), MPIU_REAL, MPI_SUM, s->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)m->nvertex, MPIU_INT, MPI_SUM, s->comm));
    for (PetscInt v = 0; v < m->nbody_vertex; v++) {
      for (PetscInt j = m->start[v]; count[v] && j < m->start[v + 1]; j++) {
        if (m->node[j] < 0) continue;
        for (int i = 0; i < 3; i++) {
          if (!(m->fixed[j] >> i & 1)) u[3 * m->node[j] + i] += push[3 * v + i] / (PetscReal)count[v];
        }
      }
    }
  }
  PetscCall(PetscFree3(push, normal, count));

  /* surfaces in each other cannot be parted so */
  PetscCall(SbContactMeshMove(m, u, NULL, b->x));
  place_obstacle(b, 0., b->x);
  PetscCall(SbContactMeshCrossings(m, b->scene.self, b->x, &crossings, where));
  b->known = PETSC_FALSE;
  if (crossings) {
    const PetscInt one = m->part[where[0]], two = m->part[where[2]];

    SETERRQ(s->comm, PETSC_ERR_USER_INPUT,
            "The effect %s: %s and %s are in each other when the run begins: %" PetscInt_FMT
            " edges go through triangles, one at (%g, %g, %g) m; move them apart, or take "
            "-effect_%s_response projected, which parts them slowly",
            e->name, one < s->mesh->nbody ? s->mesh->body[one].name : "the obstacle",
            two < s->mesh->nbody ? s->mesh->body[two].name : "the obstacle", crossings,
            (double)b->x[3 * where[0]], (double)b->x[3 * where[0] + 1], (double)b->x[3 * where[0] + 2],
            e->name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode begin_barrier(SbEffect e, SbSpace s, PetscReal t, PetscReal dt, PetscReal u0[],
                                    PetscBool *moved)
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;
  PetscReal side = PETSC_MAX_REAL;

  PetscFunctionBeginUser;
  *moved = PETSC_FALSE;
  if (b->scene.obstacle) {
    SbPose pose[2];

    (*b->scene.pose)(b->data, t, &pose[0]);
    (*b->scene.pose)(b->data, t + dt, &pose[1]);
    for (PetscInt v = m->nbody_vertex; v < m->nvertex; v++) {
      SbPoseApply(&pose[0], m->X + 3 * v, b->from + 3 * (v - m->nbody_vertex));
      SbPoseApply(&pose[1], m->X + 3 * v, b->to + 3 * (v - m->nbody_vertex));
    }
  }
  b->progress = 0.;
  if (!b->begun) {
    PetscCall(SbContactMeshMarkDriven(m));
    if (t == 0.) PetscCall(part_touching(e, s, u0, moved)); /* not when it goes on from a checkpoint */
  }
  b->begun = PETSC_TRUE;
  b->nrub = 0;
  PetscCall(look(b, u0));
  PetscCall(PetscArraycpy(b->start, b->x, 3 * m->nvertex));
  for (PetscInt i = 0; i < b->nactive; i++) side = PetscMin(side, b->active[i].gap);
  PetscCheck(side > 0., PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "The effect %s: a gap of %g m at the start of a step", e->name, (double)side);

  /* friction with the forces of the start */
  b->slip = dt > 0. && e->dynamic ? SLIP * m->size * dt : SLIP_STATIC * m->size;
  for (PetscInt i = 0; b->scene.friction > 0. && i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];
    PetscReal energy, gradient[12], f = 0.;
    Rub rub = {.pair = *pair};

    SbBarrierPair(m, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), &energy, gradient,
                  PETSC_FALSE, NULL);
    for (int k = 0; k < 4; k++) {
      rub.weight[k] = a->at.weight[k];
      f -= a->at.weight[k] * SbDot3(gradient + 3 * k, a->at.n);
    }
    for (int k = 0, n = 0; k < 4; k++) n += a->at.weight[k] != 0.;
    for (int k = 0; k < 3; k++) rub.n[k] = a->at.n[k];
    {
      PetscReal w2 = 0.;

      for (int k = 0; k < 4; k++) w2 += PetscSqr(a->at.weight[k]);
      rub.force = b->scene.friction * PetscMax(0., f / w2);
    }
    if (b->nrub == b->rub_size) {
      b->rub_size = PetscMax(64, 2 * b->rub_size);
      PetscCall(PetscRealloc((size_t)b->rub_size * sizeof(*b->rub), &b->rub));
    }
    b->rub[b->nrub++] = rub;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode safe_barrier(SbEffect e, SbSpace s, const PetscReal u0[], const PetscReal u1[],
                                   PetscReal progress, PetscReal *part, PetscInt *nactive)
{
  Barrier *b = (Barrier *)e->data;
  PetscInt worst, nsearch;

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(look(b, u0));
  nsearch = b->pairs->nsearch;
  *nactive = b->nactive;
  PetscCall(SbContactMeshMove(b->mesh, u1, NULL, b->other));
  place_obstacle(b, progress, b->other);
  PetscCall(SbContactPairsSafe(b->pairs, b->x, b->other, part, &worst));
  /* pairs that were found for the way are others than those of its start */
  if (b->pairs->nsearch != nsearch) b->known = PETSC_FALSE;
  b->shortest = PetscMin(b->shortest, *part);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode advance_barrier(SbEffect e, PetscReal progress)
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  b->progress = progress;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_barrier(SbEffect e, SbSpace s, const SbStage *stage)
{
  Barrier *b = (Barrier *)e->data;
  PetscInt n, where[5];

  PetscFunctionBeginUser;
  PetscCall(look(b, stage->u));
  for (PetscInt i = 0; i < b->nactive; i++) b->least = PetscMin(b->least, b->active[i].gap);
  b->most = PetscMax(b->most, b->nactive);
  if (!b->verify) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactMeshCrossings(b->mesh, b->scene.self, b->x, &n, where));
  PetscCheck(!n, s->comm, PETSC_ERR_PLIB,
             "The effect %s: at t = %g s %" PetscInt_FMT " edges go through triangles, one at (%g, %g, %g) m",
             e->name, (double)stage->t, n, (double)b->x[3 * where[0]], (double)b->x[3 * where[0] + 1],
             (double)b->x[3 * where[0] + 2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ output */

/* The force on each vertex of a pair, N: barrier and friction of the pairs known. */
static PetscErrorCode contact_force_barrier(SbEffect e, SbSpace s, const SbStage *stage, const PetscReal r[],
                                            PetscReal f[])
{
  PetscFunctionBeginUser;
  (void)r;
  PetscCall(force_barrier(e, s, stage, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode history_barrier(SbEffect e, SbSpace s, const SbStage *stage, const PetscReal r[],
                                      PetscReal values[])
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;
  const PetscInt at = b->scene.obstacle ? 6 : 0;
  PetscReal least = PETSC_MAX_REAL, gradient[12];
  PetscMPIInt rank;
  SbPose pose;

  PetscFunctionBeginUser;
  (void)r;
  for (PetscInt k = 0; k < e->ncolumn; k++) values[k] = 0.;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(look(b, stage->u));
  if (b->scene.obstacle) (*b->scene.pose)(b->data, stage->t, &pose);
  for (PetscInt i = 0; i < b->nactive + b->nrub; i++) {
    const Active *a = i < b->nactive ? &b->active[i] : NULL;
    const SbContactPair *pair = a ? &b->pairs->pair[a->pair] : &b->rub[i - b->nactive].pair;
    PetscReal energy;

    if (a) least = PetscMin(least, a->gap);
    if (!counts(b, pair)) continue;
    if (a) values[at]++;
    if (!at) continue;
    if (a)
      SbBarrierPair(m, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), &energy, gradient,
                    PETSC_FALSE, NULL);
    else
      (void)rub_pair(b, &b->rub[i - b->nactive], gradient);
    for (int k = 0; k < (pair->side ? 1 : 4); k++) {
      PetscReal arm[3], moment[3];

      if (pair->v[k] >= m->nbody_vertex) continue;
      for (int j = 0; j < 3; j++) arm[j] = b->x[3 * pair->v[k] + j] - b->scene.centre[j] - pose.d[j];
      SbCross(arm, gradient + 3 * k, moment);
      for (int j = 0; j < 3; j++) {
        values[j] -= gradient[3 * k + j];
        values[3 + j] -= moment[j];
      }
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_REAL, MPI_MIN, s->comm));
  PetscCallMPI(MPI_Comm_rank(s->comm, &rank));
  if (!rank) values[at + 2] = least < PETSC_MAX_REAL ? least : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode points_barrier(SbEffect e, SbSpace s, const SbStage *stage, const PetscReal r[],
                                     SbContactPoints *list)
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;

  PetscFunctionBeginUser;
  (void)r;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(look(b, stage->u));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];
    const int split = pair->kind == SB_PAIR_EDGE_EDGE && !pair->side ? 2 : 1;
    const PetscInt first = m->part[pair->v[0]], second = m->part[pair->v[pair->side ? 1 : 2]];
    const PetscBool turned = (PetscBool)(first == s->mesh->nbody);
    SbContactPoint p = {.gap = a->gap};
    PetscReal energy, gradient[12], force = 0., w2 = 0.;

    if (!counts(b, pair)) continue;
    SbBarrierPair(m, pair, a->gap, &a->at, b->x, width_of(b, pair), pressure_of(b, pair), &energy, gradient,
                  PETSC_FALSE, NULL);
    for (int k = 0; k < 3; k++) p.id[k] = pair->v[k];
    p.body[0] = turned ? second : first;
    p.body[1] = turned ? -1 : second == s->mesh->nbody ? -1 : second;
    for (int k = 0; k < 4; k++) {
      force -= a->at.weight[k] * SbDot3(gradient + 3 * k, a->at.n);
      w2 += PetscSqr(a->at.weight[k]);
      for (int j = 0; j < 3 && (turned ? k >= split : k < split); j++)
        p.x[j] += PetscAbsReal(a->at.weight[k]) * b->x[3 * pair->v[k] + j];
    }
    for (int j = 0; j < 3; j++) {
      p.normal[j] = turned ? -a->at.n[j] : a->at.n[j];
      p.force[j] = force / w2 * p.normal[j];
    }

    /* what friction does there */
    for (PetscInt k = 0; k < b->nrub; k++) {
      const Rub *rub = &b->rub[k];
      PetscReal u[3];
      PetscBool same;

      PetscCall(PetscArraycmp(rub->pair.v, pair->v, 4, &same));
      if (!same || rub->pair.kind != pair->kind || rub->pair.side != pair->side) continue;
      {
        const PetscReal y = slip_of(b, rub, u),
                        slope = y < b->slip ? 2. / b->slip - y / PetscSqr(b->slip) : 1. / y;

        for (int j = 0; j < 3; j++) p.force[j] -= (turned ? -1. : 1.) * rub->force * slope * u[j];
      }
      break;
    }
    PetscCall(SbContactPointsAdd(list, &p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode gap_barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal gap[],
                                  PetscReal normal[])
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;

  PetscFunctionBeginUser;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(look(b, stage->u));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];

    for (int k = 0; k < (pair->side ? 1 : 4); k++) {
      const PetscInt v = pair->v[k];

      if (v >= m->nbody_vertex || a->at.weight[k] == 0.) continue;
      for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
        const PetscInt node = m->node[j];

        if (node < 0 || node >= s->nnode_owned || a->gap >= gap[node]) continue;
        gap[node] = a->gap;
        for (int i3 = 0; i3 < 3; i3++)
          normal[3 * node + i3] = (a->at.weight[k] > 0. ? 1. : -1.) * a->at.n[i3];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode summary_barrier(SbEffect e, SbSpace s, size_t size, char text[])
{
  Barrier *b = (Barrier *)e->data;
  PetscReal value[2] = {b->least, b->shortest};
  PetscInt most = b->most;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 2, MPIU_REAL, MPI_MIN, s->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_INT, MPI_MAX, s->comm));
  if (most)
    (void)snprintf(text, size,
                   "%" PetscInt_FMT " pairs at most on a rank, smallest gap %.3g m of a width of %.3g m, "
                   "shortest safe part of an iteration %.2g",
                   most, (double)value[0], (double)b->w[0], (double)value[1]);
  else
    (void)snprintf(text, size, "nothing came nearer than %.3g m", (double)b->w[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_barrier(SbEffect e)
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbContactMeshDestroy(&b->mesh));
  PetscCall(SbContactPairsDestroy(&b->pairs));
  PetscCall(PetscFree2(b->w, b->k));
  PetscCall(PetscFree3(b->x, b->start, b->other));
  PetscCall(PetscFree3(b->u, b->from, b->to));
  PetscCall(PetscFree(b->active));
  PetscCall(PetscFree(b->rub));
  e->data = b->data;
  PetscCall((*b->destroy)(e));
  PetscCall(PetscFree(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBarrierCreate(SbEffect e, const SbScope *scope, const SbBarrierScene *scene)
{
  static const char *const columns[] = {"force_x",  "force_y",  "force_z",     "torque_x", "torque_y",
                                        "torque_z", "contacts", "penetration", "gap"};
  Barrier *b;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&b));
  b->scene = *scene;
  b->data = e->data;
  b->destroy = e->ops.destroy;
  PetscCall(SbOptionReal(scope, "barrier_width", &b->width));
  PetscCall(SbOptionReal(scope, "barrier_pressure", &b->pressure));
  PetscCall(SbOptionBool(scope, "verify", &b->verify));
  e->data = b;
  e->ops = (SbEffectOps){.setfromoptions = e->ops.setfromoptions,
                         .setup = setup_barrier,
                         .force = force_barrier,
                         .begin_guarded = begin_barrier,
                         .safe = safe_barrier,
                         .advance = advance_barrier,
                         .potential = potential_barrier,
                         .hessian = hessian_barrier,
                         .accept = accept_barrier,
                         .contact_force = contact_force_barrier,
                         .gap = gap_barrier,
                         .contact_points = points_barrier,
                         .history = history_barrier,
                         .summary = summary_barrier,
                         .destroy = destroy_barrier};
  e->linear = e->steady = PETSC_FALSE;
  e->saddle = PETSC_FALSE;
  e->springs = (PetscBool)(scene->friction > 0.);
  e->nstate = 0;
  e->column = scene->obstacle ? columns : columns + 6;
  e->ncolumn = scene->obstacle ? 9 : 3;
  PetscFunctionReturn(PETSC_SUCCESS);
}
