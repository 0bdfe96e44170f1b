/*
  repeated.c - contacts that treat the same surfaces twice, so that forces would count twice or
  fight each other: an error, before anything is computed.

  Two contacts between bodies may share a pair of bodies if they share no surface of one of them, as
  where two sides of a body have different friction. Two contacts with obstacles may share a surface
  if the obstacles are different ones.
*/
#include "contact_impl.h"

/* Two effects, and how many facets of each body are in both. */
typedef struct {
  SbSpace space;
  const SbEffect *effect; /* [2] */
  PetscInt *shared;       /* [nbody] */
} Pair;

static int by_place(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a;
  const PetscInt y = *(const PetscInt *)b;

  return (x > y) - (x < y);
}

/* place[n]: 4 cell + face of the facets of owned cells of an effect, sorted; the caller frees. */
static PetscErrorCode find_places(SbSpace s, SbEffect e, PetscInt *n, PetscInt **place)
{
  SbFacet *facet;
  PetscInt all;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(s, &e->on, &all, &facet));
  PetscCall(PetscMalloc1(all, place));
  *n = 0;
  for (PetscInt i = 0; i < all; i++)
    if (facet[i].cell < s->mesh->ncell_owned)
      (*place)[(*n)++] = 4 * facet[i].cell + facet[i].face;
  if (*n)
    qsort(*place, (size_t)*n, sizeof(**place), by_place);
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* pair->shared of two effects. Collective. */
static PetscErrorCode find_shared(const Pair *pair)
{
  const SbMesh mesh = pair->space->mesh;
  PetscInt n[2], *place[2];

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(pair->shared, mesh->nbody));
  for (int k = 0; k < 2; k++)
    PetscCall(find_places(pair->space, pair->effect[k], &n[k], &place[k]));
  for (PetscInt i = 0, j = 0; i < n[0] && j < n[1];) {
    if (place[0][i] == place[1][j])
      pair->shared[mesh->cell_body[place[0][i] / 4]]++;
    if (place[0][i] <= place[1][j])
      i++;
    else
      j++;
  }
  for (int k = 0; k < 2; k++)
    PetscCall(PetscFree(place[k]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, pair->shared, (PetscMPIInt)mesh->nbody, MPIU_INT,
                             MPI_SUM, pair->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SAMPLES 64 /* times at which paths are compared, evenly over the run */
#define EQUAL 1e-9 /* difference of places that are the same, over their size */

/* Whether numbers are the same but for rounding. */
static PetscBool alike(PetscInt n, const PetscReal a[], const PetscReal b[])
{
  PetscReal size = 0.;
  PetscReal far = 0.;

  for (PetscInt k = 0; k < n; k++) {
    size = PetscMax(size, PetscMax(PetscAbsReal(a[k]), PetscAbsReal(b[k])));
    far = PetscMax(far, PetscAbsReal(a[k] - b[k]));
  }
  return (PetscBool)(far <= EQUAL * size);
}

/* Whether both obstacles are the same at rest: by their numbers, of capsules and cylinders with
   either end first, and by the file of a mesh. */
static PetscBool same_shape(const SbPartner *one, const SbPartner *two)
{
  const SbObstacle a = one->obstacle;
  const SbObstacle b = two->obstacle;
  const PetscReal turned[7] = {b->p[3], b->p[4], b->p[5], b->p[0], b->p[1], b->p[2], b->p[6]};

  if (a->shape != b->shape)
    return PETSC_FALSE;
  if (a->shape == MESH)
    return (PetscBool)(!strcmp(a->file, b->file) && alike(1, &one->scale, &two->scale) &&
                       alike(3, one->at, two->at));
  return (PetscBool)(alike(7, a->p, b->p) ||
                     ((a->shape == CAPSULE || a->shape == CYLINDER) && alike(7, a->p, turned)));
}

/* Whether the obstacles of two effects are the same shape on the same path: at SAMPLES times of the
   run four points of one are where those of the other are, however paths are written. */
static PetscErrorCode same_obstacle(const Pair *pair, PetscReal size, PetscBool *same)
{
  const SbPartner *one = &((const Contact *)pair->effect[0]->data)->partner;
  const SbPartner *two = &((const Contact *)pair->effect[1]->data)->partner;
  PetscReal end = 1.;

  PetscFunctionBeginUser;
  if (pair->effect[0]->dynamic) /* else the load factor goes to 1 */
    PetscCall(PetscOptionsGetReal(NULL, NULL, "-ts_max_time", &end, NULL));
  *same = same_shape(one, two);
  for (int k = 0; *same && k <= SAMPLES; k++) {
    PetscReal x[2][12];
    SbPose pose[2];

    PetscCall(SbPartnerPose(one, end * k / SAMPLES, &pose[0]));
    PetscCall(SbPartnerPose(two, end * k / SAMPLES, &pose[1]));
    for (int i = 0; i < 8; i++) {
      PetscReal X[3] = {0., 0., 0.};

      if (i % 4)
        X[i % 4 - 1] = size;
      SbPoseApply(&pose[i / 4], X, x[i / 4] + 3 * (i % 4));
    }
    *same = alike(12, x[0], x[1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error if both effects treat contact of the same surfaces of bodies. */
static PetscErrorCode check_bodies(const Pair *pair)
{
  const SbMesh mesh = pair->space->mesh;
  PetscBool self[2];
  PetscInt body[2] = {-1, -1};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    SbScope scope;

    SbScopeSet(&scope, "effect", "contact", pair->effect[k]->name);
    PetscCall(SbOptionBool(&scope, "self", &self[k]));
  }
  for (PetscInt b = 0; b < mesh->nbody && body[1] < 0; b++)
    if (pair->shared[b])
      body[body[0] >= 0] = b;
  PetscCheck(body[1] < 0, pair->space->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_on and -effect_%s_on: both effects treat contact of body %s with body %s, "
             "so that its forces count twice: leave one of the effects out, or let them name "
             "different bodies or surfaces",
             pair->effect[0]->name, pair->effect[1]->name, mesh->body[body[0]].name,
             mesh->body[body[1]].name);
  PetscCheck(body[0] < 0 || !self[0] || !self[1], pair->space->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_self and -effect_%s_self: both effects treat contact of body %s with "
             "itself, so that its forces count twice: leave one of them out",
             pair->effect[0]->name, pair->effect[1]->name, mesh->body[body[0]].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error if both effects treat contact of the same surface with the same obstacle. */
static PetscErrorCode check_obstacle(const Pair *pair)
{
  const SbMesh mesh = pair->space->mesh;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    PetscCheck(
      !pair->shared[b], pair->space->comm, PETSC_ERR_USER_INPUT,
      "-effect_%s_obstacle and -effect_%s_obstacle are the same obstacle, and %" PetscInt_FMT
      " facets of body %s are in both effects, so that its forces count twice: leave one "
      "of the effects out, or let their -effect_NAME_on name different surfaces",
      pair->effect[0]->name, pair->effect[1]->name, pair->shared[b], mesh->body[b].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* in[n][nbody]: bodies with facets in each of n contacts. Collective. */
static PetscErrorCode find_bodies(const SbContactSet *contacts, PetscBool in[])
{
  const SbMesh mesh = contacts->space->mesh;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < contacts->n; k++) {
    PetscInt n, *place;

    PetscCall(find_places(contacts->space, contacts->contact[k]->effect, &n, &place));
    for (PetscInt i = 0; i < n; i++)
      in[k * mesh->nbody + mesh->cell_body[place[i] / 4]] = PETSC_TRUE;
    PetscCall(PetscFree(place));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, in, (PetscMPIInt)(contacts->n * mesh->nbody),
                             SB_MPI_BOOL, MPI_LOR, contacts->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetCheckRepeated(const SbContactSet *contacts)
{
  const PetscInt nbody = contacts->space->mesh->nbody;
  Pair pair = {.space = contacts->space};
  PetscBool *in;

  PetscFunctionBeginUser;
  if (contacts->n < 2)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc2(contacts->n * nbody, &in, nbody, &pair.shared));
  PetscCall(find_bodies(contacts, in));
  for (PetscInt k = 0; k < contacts->n; k++) {
    for (PetscInt l = k + 1; l < contacts->n; l++) {
      const SbEffect effect[2] = {contacts->contact[k]->effect, contacts->contact[l]->effect};
      const PetscBool obstacle =
        (PetscBool)(((Contact *)effect[0]->data)->partner.obstacle != NULL);
      PetscBool same =
        (PetscBool)(obstacle == (((Contact *)effect[1]->data)->partner.obstacle != NULL));
      PetscInt both = 0;

      pair.effect = effect;
      for (PetscInt b = 0; b < nbody; b++)
        both += in[k * nbody + b] && in[l * nbody + b];
      if (same && obstacle)
        PetscCall(same_obstacle(&pair, SbBodySmallest(nbody, contacts->space->mesh->body), &same));
      if (!same || !both)
        continue;
      PetscCall(find_shared(&pair));
      PetscCall(obstacle ? check_obstacle(&pair) : check_bodies(&pair));
    }
  }
  PetscCall(PetscFree2(in, pair.shared));
  PetscFunctionReturn(PETSC_SUCCESS);
}
