/*
  tie.c - holds two surfaces together whose meshes need not match: glue, a tendon on a bone, an
  electrode on a tissue.

  With u_A and u_B the displacements of two bodies at a place x of the rest surface A that lies on
  the rest surface B, and k a stiffness per area,

    E = 1/2 integral k |u_A(x) - u_B(x)|^2 dA.

  Both are taken from the bases of the cells behind the facets at one and the same place, so that a
  gap between the surfaces at rest, as of two meshes of a curved wall, is kept: no rigid motion has
  a force, sum and moment of the forces vanish. Each facet of A is cut by those of B over it, in A's
  plane, and the rule SbRuleFacet taken in each of the triangles, so that sums over plane surfaces
  are exact on both sides: an even stress passes through any two meshes.

  E is quadratic. Each patch, the part of a facet of A under one of B, has one number for each pair
  of its nodes, found at set-up: with s_a the basis of A's nodes and minus that of B's,

    S_ab = integral k s_a s_b dA,   f_a = -sum_b S_ab u_b,   mean_a = integral k s_a dA,

  and the force on A is -sum_a mean_a u_a. A patch is a coupling. Without a stiffness given it is
  FACTOR E / h, E Young's modulus of the softer body, h the longest side of A's facet: the tie
  yields as a layer of the body of h / FACTOR does.

  A facet of B may lie inside of A's body by a part of the cells behind both: else the far side of a
  sheet would be tied through it.

  With a strength patches part for good where their mean traction is above it: in a dynamic run at
  the end of a step, whose state still has their forces; a load step of a static run is solved again
  without them, until no more of them part.

  Every rank has the facets of both surfaces at set-up, and keeps the patches with a node of its
  own.
*/
#include "facing.h"
#include "sbgeometry.h"

#define FACTOR 100.   /* stiffness of the tie over that of a cell: see docs/reference/effects.md */
#define NEAR 0.1      /* of a facet's longest side: how far the other surface may be, by default */
#define FACING -0.5   /* cosine of two outward normals, at most: facets that look at each other */
#define ROUNDING 1e-9 /* basis functions below it are those of nodes off the facet */
#define MISSED 0.01   /* of the area that is held: if more of them are there, that is said */

typedef struct {
  PetscInt coupling, n; /* its number here, and of its nodes */
  PetscReal *S;         /* [n][n] N/m */
  PetscReal *mean;      /* [n] N/m */
  PetscReal area;       /* m^2 */
  PetscInt facet[2];    /* SbFacing.number of both */
  PetscBool parted;
  PetscBool kept; /* parted at the end of the last step that was accepted */
} Patch;

typedef struct {
  PetscReal stiffness, distance, strength; /* Pa/m, m, Pa; 0: by default, none */
  PetscInt n, size;
  Patch *patch;    /* [n] */
  PetscReal *work; /* [9 most^2] of the tangent */
} Tie;

/* What a search found. */
typedef struct {
  PetscReal held, missed; /* areas that are tied, and that face the other surface beyond, m^2 */
  PetscReal farthest;     /* how far these are, m */
} Found;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "",
   "sets of boundary facets that are held: the smaller or finer surface"},
  {"to", SB_OPTION_NAMES, 1, "", NULL, "", "sets of the boundary facets that hold them"},
  {"stiffness", SB_OPTION_REAL, 1, "Pa/m", "0", "[0, inf)",
   "stress over the distance by which the surfaces part; 0: a hundred times that of a cell of the "
   "softer body, E / h"},
  {"distance", SB_OPTION_REAL, 1, "m", "0", "[0, inf)",
   "largest gap at rest of what is tied, and overlap, up to a quarter of the cells; 0: a tenth of "
   "a facet's longest side"},
  {"strength", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)",
   "traction above which places part for good; 0: never"},
};

static PetscErrorCode options_tie(SbEffect e, const SbScope *scope)
{
  Tie *tie = (Tie *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "stiffness", &tie->stiffness));
  PetscCall(SbOptionReal(scope, "distance", &tie->distance));
  PetscCall(SbOptionReal(scope, "strength", &tie->strength));
  e->linear = e->steady = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  e->nstate = 2;
  if (tie->strength > 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  e->ops.settle = NULL;
  e->ops.accept = NULL;
  e->ops.save = NULL;
  e->ops.load = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the facets that both surfaces have. */
static PetscErrorCode mark_both(PetscInt na, SbFacing a[], PetscInt nb, SbFacing b[])
{
  SbKey *key;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(nb, &key));
  for (PetscInt j = 0; j < nb; j++)
    key[j] = (SbKey){(uint64_t)b[j].number, j};
  SbKeysSort(nb, key);
  for (PetscInt i = 0; i < na; i++) {
    const PetscInt at = SbKeysFind(nb, key, (uint64_t)a[i].number);

    if (at < 0)
      continue;
    a[i].both = PETSC_TRUE;
    b[key[at].slot].both = PETSC_TRUE;
  }
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps a patch if one of its nodes is owned here. */
static PetscErrorCode keep(SbSpace space, Tie *tie, const SbFacing *a, const SbFacing *b,
                           const SbFacingSum *sum)
{
  Patch *patch;
  PetscInt node[2 * SB_CELL_NODES], gnode[2 * SB_CELL_NODES];
  PetscReal most = 0;
  PetscInt n = 0;
  PetscInt coupling;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < sum->n; i++)
    most = PetscMax(most, sum->S[i][i]);
  for (PetscInt i = 0; i < sum->n; i++) {
    if (sum->S[i][i] <= PetscSqr(ROUNDING) * most)
      continue;
    gnode[n] = sum->gnode[i];
    node[n++] = i;
  }
  PetscCall(SbSpaceCouple(space, n, gnode, &coupling));
  if (coupling < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(tie->n + 1, sizeof(*tie->patch), &tie->size, &tie->patch));
  patch = &tie->patch[tie->n++];
  *patch =
    (Patch){.coupling = coupling, .n = n, .area = sum->area, .facet = {a->number, b->number}};
  PetscCall(PetscMalloc2(n * n, &patch->S, n, &patch->mean));
  for (PetscInt i = 0; i < n; i++) {
    patch->mean[i] = sum->mean[node[i]];
    for (PetscInt j = 0; j < n; j++)
      patch->S[n * i + j] = sum->S[node[i]][node[j]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The stiffness between two facets, Pa/m. */
static PetscErrorCode stiffness_between(SbEffect e, const SbFacing *a, const SbFacing *b,
                                        PetscReal *k)
{
  const Tie *tie = (const Tie *)e->data;
  const PetscReal soft = PetscMin(a->young, b->young);

  PetscFunctionBeginUser;
  *k = tie->stiffness;
  if (*k == 0)
    *k = FACTOR * (soft > 0 ? soft : PetscMax(a->young, b->young)) / a->size;
  PetscCheck(*k > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "effect %s ties two rigid bodies, which have no stiffness to compare with: give "
             "-effect_%s_stiffness (Pa/m)",
             e->name, e->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The distance between two surfaces, from the corners of the first, m. */
static PetscReal distance_between(PetscInt n, const SbFacing a[], const SbBoxTree *tree,
                                  const SbFacing b[])
{
  PetscReal least = PETSC_MAX_REAL;

  for (PetscInt i = 0; i < 3 * n; i++) {
    const PetscReal *x = a[i / 3].x[i % 3];
    SbBoxNearest nearest;
    PetscInt j;

    for (SbBoxNearestBegin(tree, (const PetscReal[6]){x[0], x[1], x[2], x[0], x[1], x[2]}, least,
                           &nearest);
         SbBoxNearestNext(&nearest, &j);) {
      const PetscReal *const corner[3] = {b[j].x[0], b[j].x[1], b[j].x[2]};
      PetscReal weight[3], d2;

      (void)SbTriangleClosestPoint(x, corner, weight, &d2);
      nearest.limit2 = least = PetscMin(least, d2);
    }
  }
  return PetscSqrtReal(least);
}

/* All patches of two surfaces; a pair of facets that both of them have is one patch. */
static PetscErrorCode find_patches(SbEffect e, SbSpace space, PetscInt na, const SbFacing a[],
                                   const SbBoxTree *tree, const SbFacing b[], Found *found)
{
  Tie *tie = (Tie *)e->data;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < na; i++) {
    const PetscReal distance = tie->distance > 0 ? tie->distance : NEAR * a[i].size;
    SbBoxNearest nearest;
    PetscReal box[6];
    PetscInt j;

    SbBoxClear(box);
    for (int c = 0; c < 3; c++)
      SbBoxAdd(box, a[i].x[c]);
    for (SbBoxNearestBegin(tree, box, PetscSqr(SB_FACING_BESIDE * distance), &nearest);
         SbBoxNearestNext(&nearest, &j);) {
      PetscReal k;
      SbFacingSum sum;

      if (SbDot3(a[i].normal, b[j].normal) > FACING)
        continue;
      if (a[i].both && b[j].both && a[i].number >= b[j].number)
        continue;
      PetscCall(stiffness_between(e, &a[i], &b[j], &k));
      SbFacingSumUp(&a[i], &b[j], distance, k, &sum);
      found->missed += sum.missed;
      found->farthest = PetscMax(found->farthest, sum.farthest);
      if (sum.area <= SB_FACING_SLIVER * a[i].area)
        continue;
      found->held += sum.area;
      PetscCall(keep(space, tie, &a[i], &b[j], &sum));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error if nothing is tied, a warning if more could be, and the note of the set-up. */
static PetscErrorCode report(SbEffect e, SbSpace space, PetscInt na, const SbFacing a[],
                             const SbBoxTree *tree, const SbFacing b[], const Found *found)
{
  const Tie *tie = (const Tie *)e->data;

  PetscFunctionBeginUser;
  PetscCheck(found->held > 0, space->comm, PETSC_ERR_USER_INPUT,
             "%s: nothing of these surfaces lies on those of %s: the nearest place is %.4g m away, "
             "and -effect_%s_distance allows %.4g m; they must also face each other, seen along "
             "their normals, and overlap by less than a quarter of a cell",
             e->on.option, e->to.option, (double)distance_between(na, a, tree, b), e->name,
             (double)(tie->distance > 0 ? tie->distance : NEAR * a[0].size));
  if (found->missed > MISSED * found->held)
    PetscCall(
      SbWarning(space->comm,
                "%s: %.3g m^2 are held; %.3g m^2 more face %s at up to %.3g m, and are free: "
                "set -effect_%s_distance to hold them",
                e->on.option, (double)found->held, (double)found->missed, e->to.option,
                (double)found->farthest, e->name));
  SbFormat(sizeof(e->note), e->note, "%.6g m^2 held", (double)found->held);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode couplings_tie(SbEffect e, SbSpace space)
{
  Tie *tie = (Tie *)e->data;
  Found found = {0};
  PetscReal(*box)[6];
  PetscInt na, nb;
  PetscInt most = 0;
  SbBoxTree tree;
  SbFacing *a, *b;

  PetscFunctionBeginUser;
  PetscCall(SbFacingGather(space, &e->on, &na, &a));
  PetscCall(SbFacingGather(space, &e->to, &nb, &b));
  PetscCall(mark_both(na, a, nb, b));

  /* the patches, by a tree over the facets of B */
  PetscCall(PetscMalloc1(nb, &box));
  for (PetscInt j = 0; j < nb; j++) {
    SbBoxClear(box[j]);
    for (int c = 0; c < 3; c++)
      SbBoxAdd(box[j], b[j].x[c]);
  }
  PetscCall(SbBoxTreeCreate(nb, (const PetscReal(*)[6])box, &tree));
  PetscCall(find_patches(e, space, na, a, &tree, b, &found));
  PetscCall(report(e, space, na, a, &tree, b, &found));
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscCall(PetscFree(a));
  PetscCall(PetscFree(b));

  for (PetscInt p = 0; p < tie->n; p++)
    most = PetscMax(most, tie->patch[p].n);
  PetscCall(PetscMalloc1(9 * most * most, &tie->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of a patch. */
static const PetscInt *nodes_of(SbSpace space, const Patch *patch)
{
  return space->couplings.node + space->couplings.start[patch->coupling];
}

/* Whether this rank counts a patch. */
static PetscBool counts(SbSpace space, const Patch *patch)
{
  return (PetscBool)(!patch->parted && nodes_of(space, patch)[0] < space->nnode_owned);
}

/* The force on A, N. */
static void force_on(SbSpace space, const Patch *patch, const PetscReal u[], PetscReal f[3])
{
  const PetscInt *node = nodes_of(space, patch);

  f[0] = f[1] = f[2] = 0;
  for (PetscInt k = 0; k < 3 * patch->n; k++)
    f[k % 3] -= patch->mean[k / 3] * u[3 * node[k / 3] + k % 3];
}

static PetscErrorCode force_tie(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Tie *tie = (const Tie *)e->data;

  PetscFunctionBeginUser;
  for (const Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++) {
    const PetscInt *node = nodes_of(space, patch);

    for (PetscInt k = 0; k < patch->n * patch->n && !patch->parted; k++)
      for (int i = 0; i < 3; i++)
        f[3 * node[k / patch->n] + i] -= patch->S[k] * stage->u[3 * node[k % patch->n] + i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_tie(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Tie *tie = (const Tie *)e->data;

  PetscFunctionBeginUser;
  for (const Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++) {
    const PetscInt n = patch->n;

    if (patch->parted)
      continue;
    PetscCall(PetscArrayzero(tie->work, 9 * n * n));
    for (PetscInt k = 0; k < n * n; k++)
      for (int i = 0; i < 3; i++)
        tie->work[3 * n * (3 * (k / n) + i) + 3 * (k % n) + i] = stage->shift_k * patch->S[k];
    PetscCall(SbSpaceAddCoupling(space, A, patch->coupling, tie->work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parts what is torn, of all ranks. */
static PetscErrorCode tear(SbEffect e, SbSpace space, const SbStage *stage, PetscInt *n)
{
  Tie *tie = (Tie *)e->data;

  PetscFunctionBeginUser;
  *n = 0;
  for (Patch *patch = tie->patch; patch < tie->patch + tie->n && SbEffectActs(e, stage->t);
       patch++) {
    PetscReal f[3];

    force_on(space, patch, stage->u, f);
    if (patch->parted || PetscSqrtReal(SbDot3(f, f)) <= tie->strength * patch->area)
      continue;
    patch->parted = PETSC_TRUE;
    ++*n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a strength, of load steps. */
static PetscErrorCode settle_tie(SbEffect e, SbSpace space, const SbStage *stage,
                                 PetscBool *changed)
{
  Tie *tie = (Tie *)e->data;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  if (!stage) {
    for (Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++)
      patch->parted = patch->kept;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(tear(e, space, stage, &n));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, space->comm));
  *changed = (PetscBool)(n > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a strength. */
static PetscErrorCode accept_tie(SbEffect e, SbSpace space, const SbStage *stage)
{
  Tie *tie = (Tie *)e->data;
  PetscInt n;

  PetscFunctionBeginUser;
  if (e->dynamic)
    PetscCall(tear(e, space, stage, &n));
  for (Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++)
    patch->kept = patch->parted;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A record: the facets of a patch that has parted. */
static PetscErrorCode save_tie(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Tie *tie = (const Tie *)e->data;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscMalloc1(2 * tie->n, records));
  for (const Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++) {
    if (!patch->parted || nodes_of(space, patch)[0] >= space->nnode_owned)
      continue;
    (*records)[2 * *n] = (PetscReal)patch->facet[0];
    (*records)[2 * *n + 1] = (PetscReal)patch->facet[1];
    ++*n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_tie(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                               PetscInt n, const PetscReal records[])
{
  Tie *tie = (Tie *)e->data;
  PetscInt found = 0;
  SbKey *key;

  PetscFunctionBeginUser;
  (void)t;
  (void)u;
  PetscCall(PetscMalloc1(n, &key));
  for (PetscInt i = 0; i < n; i++)
    key[i] = (SbKey){SbKeyOfPair((PetscInt)records[2 * i], (PetscInt)records[2 * i + 1]), i};
  SbKeysSort(n, key);
  for (Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++) {
    patch->parted = patch->kept =
      (PetscBool)(SbKeysFind(n, key, SbKeyOfPair(patch->facet[0], patch->facet[1])) >= 0);
    found += patch->parted && nodes_of(space, patch)[0] < space->nnode_owned;
  }
  PetscCall(PetscFree(key));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, space->comm));
  PetscCheck(found == n, space->comm, PETSC_ERR_USER,
             "effect %s: %" PetscInt_FMT
             " places of the tie had parted, and the mesh has %" PetscInt_FMT
             " of them now: a tie with -effect_%s_strength needs the mesh that it began with",
             e->name, n, found, e->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The force on A, N, the area that holds, m^2, and its energy, J. */
static PetscErrorCode history_tie(SbEffect e, SbSpace space, const SbStage *stage,
                                  const PetscReal residual[], PetscReal values[])
{
  const Tie *tie = (const Tie *)e->data;

  PetscFunctionBeginUser;
  (void)residual;
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (const Patch *patch = tie->patch; patch < tie->patch + tie->n; patch++) {
    const PetscInt *node = nodes_of(space, patch);
    PetscReal f[3];

    if (!counts(space, patch))
      continue;
    force_on(space, patch, stage->u, f);
    for (int i = 0; i < 3; i++)
      values[i] += f[i];
    values[3] += patch->area;
    for (PetscInt k = 0; k < patch->n * patch->n; k++)
      values[4] += patch->S[k] / 2 *
                   SbDot3(stage->u + 3 * node[k / patch->n], stage->u + 3 * node[k % patch->n]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_tie(SbEffect e)
{
  Tie *tie = (Tie *)e->data;

  PetscFunctionBeginUser;
  for (PetscInt p = 0; p < tie->n; p++)
    PetscCall(PetscFree2(tie->patch[p].S, tie->patch[p].mean));
  PetscCall(PetscFree(tie->patch));
  PetscCall(PetscFree(tie->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"force_x", "force_y", "force_z", "area", "energy"};

const SbEffectType SbEffectTie = {
  .name = "tie",
  .size = sizeof(Tie),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_tie,
          .couplings = couplings_tie,
          .force = force_tie,
          .tangent = tangent_tie,
          .settle = settle_tie,
          .accept = accept_tie,
          .save = save_tie,
          .load = load_tie,
          .history = history_tie,
          .destroy = destroy_tie},
};
