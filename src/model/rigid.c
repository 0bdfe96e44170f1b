/*
  The stiffness of rigid bodies, and how far they are strained.

  The energy that keeps a rigid body rigid (fem/rigid.c) has a Young's modulus,
  -body_<name>_rigid_stiffness. Unless given, it is STIFFER times the largest pressure that the
  scene lets expect: of soft bodies Young's modulus, for contact with them; of motions rho (v^2 +
  w^2 R^2 + 2 g H), with the velocity v and the angular velocity w at the start, half the diagonal R
  of the body, the one H of all bodies, from which something may fall, and g = 9.81 m/s^2. The
  strain is the pressure over the modulus, 1e-4 or less. Loads and supports may need more: a strain
  above STRAINED is warned of, once.

  Not stiffer: a box of 0.2 by 0.4 by 0.6 m that spins freely, 0.1 rad in each of 100 steps of
  Newmark's method, with moduli of 2e3, 2e4 and 2e5 times rho w^2 R^2, takes 4, 4 and 5 iterations
  of Newton's method a step and ends with 1 + 1e-5, 1.001 and 0.89 times its energy.
*/
#include "model_impl.h"

#define STIFFER 1e4
#define STRAINED 1e-3

PetscErrorCode SbModelStiffenRigid(SbModel m)
{
  const SbMesh mesh = m->mesh;
  PetscReal box[6];
  PetscReal soft = 0.;

  PetscFunctionBeginUser;
  SbBoxClear(box);
  for (PetscInt b = 0; b < m->nbody; b++)
    SbBoxMerge(box, mesh->body[b].bbox);
  for (PetscInt k = 0; k < m->nmaterial; k++)
    if (k >= m->nbody || !m->body[k].rigid)
      soft = PetscMax(soft, SbMaterialYoungModulus(m->material[k]));
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbBody *body = &m->body[b];
    const PetscReal size = 0.5 * SbBoxDiagonal(body->bbox);
    PetscReal speed2 = SbDot3(body->velocity, body->velocity) +
                       SbDot3(body->angular_velocity, body->angular_velocity) * PetscSqr(size) +
                       2. * 9.81 * SbBoxDiagonal(box);
    PetscReal E = body->rigid_stiffness;

    if (!body->rigid)
      continue;
    if (E == 0.)
      E = STIFFER * PetscMax(soft, body->density * speed2);
    SbMaterialSetLame(m->material[b], 0., E / 2.);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelWarnStrained(SbModel m, PetscReal t, Vec U)
{
  const SbSpace s = m->space;
  const PetscReal *u;
  struct {
    double strain;
    int rank;
  } most;
  PetscInt body;
  PetscMPIInt rank;
  PetscBool held = PETSC_TRUE;

  PetscFunctionBeginUser;
  if (!s->rigid || m->strained)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(m->comm, &rank));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  most.strain = (double)SbSpaceRigidStrain(s, u, &body);
  most.rank = rank;
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE_INT, MPI_MAXLOC, m->comm));
  if (!(most.strain > STRAINED))
    PetscFunctionReturn(PETSC_SUCCESS);
  m->strained = PETSC_TRUE;
  for (int a = 0; a < 4 && rank == most.rank; a++)
    held = (PetscBool)(held && (s->fixed[s->cell_node[4 * s->rigid_first[body] + a]] & 7) == 7);
  PetscCallMPI(MPI_Bcast(&body, 1, MPIU_INT, most.rank, m->comm));
  PetscCallMPI(MPI_Bcast(&held, 1, SB_MPI_BOOL, most.rank, m->comm));
  if (held) {
    PetscCall(SbWarning(m->comm,
                        "t = %g s: the rigid body '%s' is strained by %.2g by what prescribes its "
                        "displacement: give a translation without x, y and z, and turn it by "
                        "-effect_<name>_angle",
                        (double)t, m->body[body].name, most.strain));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbWarning(
    m->comm,
    "t = %g s: the rigid body '%s' is strained by %.2g: what acts on it is more than its stiffness "
    "of %.3g Pa is meant for; give -body_%s_rigid_stiffness a larger one, or take shorter steps "
    "(-ts_dt) if it spins fast",
    (double)t, m->body[body].name, most.strain, (double)SbMaterialYoungModulus(m->material[body]),
    m->body[body].copy_of[0] ? m->body[body].copy_of : m->body[body].name));
  PetscFunctionReturn(PETSC_SUCCESS);
}
