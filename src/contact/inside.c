/*
  inside.c - a body that lies wholly inside an obstacle when a run begins is an error, whatever the
  obstacle and the response: no direction out of it is better than another one, of a half-space
  neither, behind which a body has been put by a wrong sign or unit. A body of which some point is
  outside is moved out.

  A body is inside if all vertices of its mesh are, one of them by more than rounding: of convex
  obstacles that is exact. Only bodies of -effect_X_on count, and those with a node that is not
  prescribed.
*/
#include "contact_impl.h"

#define ON 1e-5 /* of a body's diagonal: a vertex this near to the surface is on it */

/* least[nbody], most[nbody]: gaps of each body's vertices at x[nvert][3] from the obstacle in a
   pose, m. Collective. */
static PetscErrorCode find_gaps(SbSpace s, SbObstacle obstacle, const SbPose *pose,
                                const PetscReal x[], PetscReal least[], PetscReal most[])
{
  const SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < mesh->nbody; b++) {
    least[b] = PETSC_MAX_REAL;
    most[b] = -PETSC_MAX_REAL;
  }
  for (PetscInt k = 0; k < 4 * mesh->ncell_owned; k++) {
    const PetscInt b = mesh->cell_body[k / 4];
    PetscReal X[3], n[3], gap;

    SbPoseInvert(pose, x + 3 * mesh->cell[k], X);
    gap = SbObstacleDistance(obstacle, X, n);
    least[b] = PetscMin(least[b], gap);
    most[b] = PetscMax(most[b], gap);
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, least, (PetscMPIInt)mesh->nbody, MPIU_REAL, MPI_MIN, s->comm));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, most, (PetscMPIInt)mesh->nbody, MPIU_REAL, MPI_MAX, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* tested[nbody]: 3 where a body has a facet of e->on and a node that is not prescribed.
   Collective. */
static PetscErrorCode find_tested(SbEffect e, SbSpace s, uint8_t tested[])
{
  SbFacet *facet;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(s, &e->on, &n, &facet));
  for (PetscInt i = 0; i < n; i++)
    tested[s->mesh->cell_body[facet[i].cell]] |= 1;
  PetscCall(PetscFree(facet));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    if (s->fixed[i] != 7)
      tested[s->node_body[i]] |= 2;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, tested, (PetscMPIInt)s->mesh->nbody, MPI_UINT8_T,
                             MPI_BOR, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetDistances(const SbContactSet *contacts, PetscInt k, PetscReal t, Vec U,
                                     PetscReal least[])
{
  const SbSpace s = contacts->space;
  const PetscInt nbody = s->mesh->nbody;
  const SbEffect e = contacts->contact[k]->effect;
  const SbPartner *partner = &((const Contact *)contacts->contact[k])->partner;
  PetscReal *x, *most;
  uint8_t *tested;
  SbPose pose;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(3 * s->mesh->nvert, &x, nbody, &most));
  PetscCall(PetscCalloc1(nbody, &tested));
  PetscCall(SbSpaceVertexPositions(s, U, x));
  PetscCall(find_tested(e, s, tested));
  PetscCall(SbPartnerPose(partner, t, &pose));
  PetscCall(find_gaps(s, partner->obstacle, &pose, x, least, most));
  for (PetscInt b = 0; b < nbody; b++)
    least[b] = tested[b] & 1 ? least[b] : PETSC_MAX_REAL;
  PetscCall(PetscFree(tested));
  PetscCall(PetscFree2(x, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetCheckInside(const SbContactSet *contacts, PetscReal t, Vec U)
{
  const SbSpace s = contacts->space;
  const PetscInt nbody = s->mesh->nbody;
  PetscReal *x, *least, *most;
  uint8_t *tested;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(3 * s->mesh->nvert, &x, nbody, &least, nbody, &most));
  PetscCall(PetscMalloc1(nbody, &tested));
  PetscCall(SbSpaceVertexPositions(s, U, x));
  for (PetscInt k = 0; k < contacts->n; k++) {
    const SbEffect e = contacts->contact[k]->effect;
    const SbPartner *partner = &((const Contact *)contacts->contact[k])->partner;
    SbPose pose;

    if (!partner->obstacle)
      continue;
    PetscCall(PetscArrayzero(tested, nbody));
    PetscCall(find_tested(e, s, tested));
    PetscCall(SbPartnerPose(partner, t, &pose));
    PetscCall(find_gaps(s, partner->obstacle, &pose, x, least, most));
    for (PetscInt b = 0; b < nbody; b++) {
      const SbBody *body = &s->mesh->body[b];
      PetscReal size[3], on;

      SbSubtract(body->bbox + 3, body->bbox, size);
      on = ON * PetscSqrtReal(SbDot3(size, size));
      PetscCheck(tested[b] < 3 || most[b] > on || least[b] > -on, s->comm, PETSC_ERR_USER_INPUT,
                 "The effect %s: all of the body %s is inside the obstacle when the run begins, up "
                 "to %g m deep, and which way leads out is not known; move the body by "
                 "-body_%s_translate, or change %s",
                 e->name, body->name, -(double)least[b], body->name, partner->obstacle->option);
    }
  }
  PetscCall(PetscFree(tested));
  PetscCall(PetscFree3(x, least, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}
