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

#define SAMPLES 1000              /* times of the run at which paths are compared, */
#define APART 0.61803398874989485 /* so far from each other, over the run, and modulo its length */
#define EQUAL 1e-9                /* difference of places that are the same, over their size */

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

/* Where the surface of an obstacle is at a time, m: the same numbers however shape and path are
   written, and wherever a plane or a sphere turns or slides in itself. */
static PetscErrorCode place(const SbPartner *partner, PetscReal t, PetscReal size, PetscReal x[12])
{
  const SbObstacle o = partner->obstacle;
  const PetscReal *p = o->p;
  PetscReal X[4][3] = {{0.}};
  SbPose pose;
  int n = 1;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    X[0][k] = o->shape == MESH ? partner->at[k] : o->shape == PLANE ? p[3] * p[k] : p[k];
  if (o->shape == PLANE || o->shape == CAPSULE || o->shape == CYLINDER) {
    n = 2;
    for (int k = 0; k < 3; k++)
      X[1][k] = o->shape == PLANE ? X[0][k] + size * p[k] : p[3 + k];
  } else if (o->shape == BOX || o->shape == MESH) {
    n = 4; // a corner and its neighbours, or the origin and points on the axes
    for (int i = 1; i < n; i++) {
      PetscCall(PetscArraycpy(X[i], X[0], 3));
      X[i][i - 1] = o->shape == BOX ? p[2 + i] : X[0][i - 1] + partner->scale * size;
    }
  }
  PetscCall(PetscArrayzero(x, 12));
  PetscCall(SbPartnerPose(partner, t, &pose));
  for (int i = 0; i < n; i++)
    SbPoseApply(&pose, X[i], x + 3 * i);

  // of a plane its normal, and its distance from the origin
  if (o->shape == PLANE) {
    SbSubtract(x + 3, x, x + 3);
    x[6] = SbDot3(x, x + 3) / size;
    PetscCall(PetscArrayzero(x, 3));
  } else if (n < 4)
    x[6] = o->shape == SPHERE || o->shape == BOWL ? p[3] : p[6];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the obstacles of two effects are the same shape on the same path: their surfaces are in
   one place at SAMPLES irregular times of the run. */
static PetscErrorCode same_obstacle(const Pair *pair, PetscReal size, PetscBool *same)
{
  const SbPartner *one = &((const Contact *)pair->effect[0]->data)->partner;
  const SbPartner *two = &((const Contact *)pair->effect[1]->data)->partner;
  const Shape shape = one->obstacle->shape;
  PetscReal end = 1.;

  PetscFunctionBeginUser;
  if (pair->effect[0]->dynamic) /* else the load factor goes to 1 */
    PetscCall(PetscOptionsGetReal(NULL, NULL, "-ts_max_time", &end, NULL));
  *same = (PetscBool)(shape == two->obstacle->shape &&
                      (shape != MESH || !strcmp(one->obstacle->file, two->obstacle->file)));
  for (int k = 0; *same && k <= SAMPLES; k++) {
    const PetscReal t = k < SAMPLES ? end * fmod(APART * k, 1.) : end;
    PetscReal x[12], y[12];

    PetscCall(place(one, t, size, x));
    PetscCall(place(two, t, size, y));
    *same = alike(12, x, y);
    if (!*same && (shape == CAPSULE || shape == CYLINDER)) { // with either end first
      const PetscReal turned[7] = {y[3], y[4], y[5], y[0], y[1], y[2], y[6]};

      *same = alike(7, x, turned);
    }
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
    SbFacet *facet;
    PetscInt n;

    PetscCall(SbEffectFacets(contacts->space, &contacts->contact[k]->effect->on, &n, &facet));
    for (PetscInt i = 0; i < n; i++)
      in[k * mesh->nbody + mesh->cell_body[facet[i].cell]] = PETSC_TRUE;
    PetscCall(PetscFree(facet));
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
      const PetscBool obstacle = SbContactHasObstacle(contacts->contact[k]);
      PetscBool same = (PetscBool)(obstacle == SbContactHasObstacle(contacts->contact[l]));
      PetscInt both = 0;

      pair.effect = effect;
      for (PetscInt b = 0; b < nbody; b++)
        both += in[k * nbody + b] && in[l * nbody + b];
      if (same && obstacle)
        PetscCall(same_obstacle(&pair, SbBodySmallest(nbody, contacts->space->mesh->body), &same));
      if (!same || !both)
        continue;
      PetscCall(SbEffectShared(pair.space, &effect[0]->on, &effect[1]->on, pair.shared));
      PetscCall(obstacle ? check_obstacle(&pair) : check_bodies(&pair));
    }
  }
  PetscCall(PetscFree2(in, pair.shared));
  PetscFunctionReturn(PETSC_SUCCESS);
}
