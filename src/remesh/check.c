/*
  Quality of the tets of a body in the current configuration, and conservation of its momenta.

  The corners of a tet are at their current positions; for CR and DG these are means over the cells
  around, as in vertex fields.

  Interpolation to another mesh changes momenta by a discretisation error. With p = M v, the six
  rigid velocities w_k (three translations, three rotations about the origin in the current
  configuration) and D, which is zero on prescribed unknowns, the momenta are w_k . p, and v + sum_l
  c_l D w_l has the wanted ones if

    sum_l (w_k . M D w_l) c_l = wanted_k - w_k . M v.

  Rotations are taken about the centre of the body and lengths relative to its size, so that this
  small system is well conditioned; one refinement step follows.
*/
#include "remesh_impl.h"
#include <petscblaslapack.h>

PetscErrorCode SbBodyQualities(SbModel m, Vec U, const PetscBool named[], PetscReal worst[])
{
  const SbMesh mesh = m->mesh;
  PetscReal *at;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++)
    worst[b] = 1.;
  PetscCall(PetscMalloc1(3 * mesh->nvert, &at));
  PetscCall(SbSpaceVertexPositions(m->space, U, at));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt body = mesh->cell_body[c];
    const PetscReal quality = named[body] ? SbTetQuality(at, mesh->cell + 4 * c) : 1.;

    worst[body] = PetscMin(worst[body], quality);
  }
  PetscCall(PetscFree(at));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, worst, (PetscMPIInt)m->nbody, MPIU_REAL, MPI_MIN, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Momenta of the bodies with the velocities v, about these points or the origin. */
static PetscErrorCode momenta_about(SbModel m, Vec U, const PetscReal v[],
                                    const PetscReal about[][4], PetscReal momenta[][6])
{
  const PetscReal *u;
  PetscReal *p;
  const SbStage stage = {.a = v};
  const SbSpace s = m->space;

  PetscFunctionBeginUser;

  // p = M v
  PetscCall(PetscCalloc1(3 * s->nnode, &p));
  SbSpaceAddInertia(s, &stage, p);
  PetscCall(PetscArrayzero(&momenta[0][0], 6 * m->nbody));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));

  // momenta of this rank's part of each body
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt b = s->node_body[i];
    PetscReal r[3], L[3];

    for (int k = 0; k < 3; k++)
      r[k] = s->node_x[3 * i + k] + u[3 * i + k] - (about ? about[b][k] : 0.);
    SbCross(r, p + 3 * i, L);
    for (int k = 0; k < 3; k++) {
      momenta[b][k] += p[3 * i + k];
      momenta[b][3 + k] += L[k];
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &momenta[0][0], (PetscMPIInt)(6 * m->nbody), MPIU_REAL,
                             MPI_SUM, m->comm));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBodyMomenta(SbModel m, Vec U, Vec V, PetscReal momenta[][6])
{
  const PetscReal *v;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, V, &v));
  PetscCall(momenta_about(m, U, v, NULL, momenta));
  PetscCall(SbSpaceRestoreLocalRead(m->space, V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v[nnode][3] += sum_l c[b][l] D w_l; rotations about the centres, lengths over the sizes. Returns
   the largest speed added on this rank. */
static PetscReal add_rigid(SbModel m, const PetscReal u[], const PetscReal middle[][4],
                           const PetscReal size[], const PetscReal c[][6], PetscReal v[])
{
  const SbSpace s = m->space;
  PetscReal largest = 0.;

  for (PetscInt i = 0; i < s->nnode; i++) {
    const PetscInt b = s->node_body[i];
    PetscReal r[3], turn[3];
    PetscReal speed = 0.;

    for (int k = 0; k < 3; k++)
      r[k] = (s->node_x[3 * i + k] + u[3 * i + k] - middle[b][k]) / size[b];
    SbCross(c[b] + 3, r, turn);
    for (int k = 0; k < 3; k++) {
      if (s->fixed[i] & (1 << k))
        continue;
      v[3 * i + k] += c[b][k] + turn[k];
      speed += PetscSqr(c[b][k] + turn[k]);
    }
    largest = PetscMax(largest, PetscSqrtReal(speed));
  }
  return largest;
}

PetscErrorCode SbBodySetMomenta(SbModel m, Vec U, Vec V, const PetscBool named[],
                                const PetscReal momenta[][6], PetscReal *largest)
{
  /* components removed by supports stay zero: the minimum norm solution */
  PetscBLASInt six = 6;
  PetscBLASInt one = 1;
  PetscBLASInt rank;
  PetscBLASInt nwork = 64;
  PetscBLASInt info = 0;
  PetscReal(*middle)[4], (*now)[6], (*c)[6], (*G)[6][6], *size, *v, *w, *array, speed, singular[6],
    work[64];
  PetscReal least = 1e-11;
  const PetscReal *in_memory, *u, (*centre)[4];

  PetscFunctionBeginUser;
  *largest = 0.;
  PetscCall(
    PetscCalloc5(m->nbody, &middle, m->nbody, &size, m->nbody, &now, m->nbody, &c, m->nbody, &G));
  PetscCall(PetscMalloc2(3 * m->space->nnode, &v, 3 * m->space->nnode, &w));
  PetscCall(SbModelCentres(m, U, middle));
  centre = (const PetscReal(*)[4])middle;
  for (PetscInt b = 0; b < m->nbody; b++)
    size[b] = PetscPowReal(m->body[b].volume, 1. / 3);
  PetscCall(SbSpaceGetLocalRead(m->space, V, &in_memory));
  PetscCall(PetscArraycpy(v, in_memory, 3 * m->space->nnode));
  PetscCall(SbSpaceRestoreLocalRead(m->space, V, &in_memory));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));

  // the correction, and one refinement
  for (int i = 0; i < 2; i++) {
    for (int l = 0; l < 6; l++) {
      PetscCall(PetscArrayzero(&c[0][0], 6 * m->nbody));
      PetscCall(PetscArrayzero(w, 3 * m->space->nnode));
      for (PetscInt b = 0; b < m->nbody; b++)
        c[b][l] = 1.;
      (void)add_rigid(m, u, centre, size, (const PetscReal(*)[6])c, w);
      PetscCall(momenta_about(m, U, w, centre, now));
      for (PetscInt b = 0; b < m->nbody; b++)
        for (int k = 0; k < 6; k++)
          G[b][l][k] = now[b][k] / (k < 3 ? 1. : size[b]);
    }
    PetscCall(momenta_about(m, U, v, centre, now));
    for (PetscInt b = 0; b < m->nbody; b++) {
      PetscReal moved[3];

      SbCross(middle[b], momenta[b], moved);
      for (int k = 0; k < 3; k++) {
        c[b][k] = momenta[b][k] - now[b][k];
        c[b][3 + k] = (momenta[b][3 + k] - moved[k] - now[b][3 + k]) / size[b];
      }
      PetscCallBLAS("LAPACKgelss", LAPACKgelss_(&six, &six, &one, &G[b][0][0], &six, c[b], &six,
                                                singular, &least, &rank, work, &nwork, &info));
      PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK gelss failed with %d", (int)info);
      for (int k = 0; k < 6 && !named[b]; k++)
        c[b][k] = 0.;
    }
    speed = add_rigid(m, u, centre, size, (const PetscReal(*)[6])c, v);
    *largest = PetscMax(*largest, speed);
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(SbSpaceGetLocalWrite(m->space, V, &array));
  PetscCall(PetscArraycpy(array, v, 3 * m->space->nnode_owned));
  PetscCall(SbSpaceRestoreLocalWrite(m->space, V, &array));
  PetscCall(PetscFree2(v, w));
  PetscCall(PetscFree5(middle, size, now, c, G));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPIU_REAL, MPI_MAX, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
