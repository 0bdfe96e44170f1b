/*
  How bad the tets of a body are now, and its momenta.

  A tet is examined where its corners are now; of CR and DG these are the means of the cells around, as vertex fields have them.

  Velocities on another mesh have other momenta, by as much as the mesh is wrong. With p = M v, the six rigid velocities w_k (three translations,
  three rotations about the origin at the positions of now) and D, which leaves out what is prescribed, the momenta are w_k . p, and v + sum_l c_l D w_l
  has those that are wanted when

    sum_l (w_k . M D w_l) c_l = wanted_k - w_k . M v.

  The rotations are about the middle of the body and lengths in its size, so that this small system is solved to rounding; once more with what is left.
*/
#include "remesh_impl.h"
#include "sbkernel.h"

/* ------------------------------------------------------------------ quality */

/* Where all corners of owned cells are now, x[nvert][3], for bodies with their nodes at faces: their cells are all local. */
static PetscErrorCode corner_positions(SbSpace s, const PetscReal u[], PetscReal x[])
{
  const SbMesh mesh = s->mesh;
  PetscReal *weight;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(mesh->nvert, &weight));
  PetscCall(PetscArrayzero(x, 3 * mesh->nvert));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;
      const SbElement e = SbSpaceCellElement(s, c);

      for (int v = 0; v < 4; v++) {
        const PetscInt vertex = mesh->cell[4 * c + v];

        weight[vertex] += s->batch_V[b][l];
        for (int i = 0; i < 12; i++)
          x[3 * vertex + i % 3] +=
            s->batch_V[b][l] * e->ops.vertex[v][i / 3] * u[3 * s->cell_node[4 * c + i / 3] + i % 3];
      }
    }
  }
  for (PetscInt i = 0; i < 3 * mesh->nvert; i++)
    x[i] = mesh->x[i] + (weight[i / 3] > 0. ? x[i] / weight[i / 3] : 0.);
  PetscCall(PetscFree(weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBodyQualities(SbModel m, Vec U, const PetscBool named[], PetscReal worst[])
{
  const SbSpace s = m->space;
  const SbMesh mesh = m->mesh;
  PetscReal *at_vertices = NULL;
  const PetscReal *u;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++) worst[b] = 1.;
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  if (s->faces) {
    PetscCall(PetscMalloc1(3 * mesh->nvert, &at_vertices));
    PetscCall(corner_positions(s, u, at_vertices));
  }
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt body = mesh->cell_body[c];
    const PetscBool p1 = (PetscBool)(m->element[body]->nodes_per[0] > 0);
    PetscReal x[4][3], quality;

    if (!named[body]) continue;
    for (int i = 0; i < 12; i++) {
      const PetscInt v = mesh->cell[4 * c + i / 3];

      x[i / 3][i % 3] =
        p1 ? mesh->x[3 * v + i % 3] + u[3 * s->cell_node[4 * c + i / 3] + i % 3] : at_vertices[3 * v + i % 3];
    }
    quality = SbTetQuality((const PetscReal(*)[3])x);
    worst[body] = PetscMin(worst[body], quality);
  }
  PetscCall(PetscFree(at_vertices));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, (PetscMPIInt)m->nbody, MPIU_REAL, MPI_MIN, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ momenta */

static PetscErrorCode momenta_about(SbModel m, Vec U, const PetscReal v[], const PetscReal about[][3],
                                    PetscReal momenta[][6])
{
  const PetscReal *u;
  PetscReal *p;
  const SbStage stage = {.a = v};
  const SbSpace s = m->space;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * m->space->nnode, &p));
  // p = M v
  PetscCall(PetscArrayzero(p, 3 * m->space->nnode));
  PetscCall(SbSpaceAddInertia(m->space, &stage, p));
  PetscCall(PetscArrayzero(&momenta[0][0], 6 * m->nbody));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  // momenta of this rank's part of each body
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt b = s->node_body[i];
    PetscReal r[3], L[3];

    for (int k = 0; k < 3; k++) r[k] = s->node_x[3 * i + k] + u[3 * i + k] - (about ? about[b][k] : 0.);
    SbCross(r, p + 3 * i, L);
    for (int k = 0; k < 3; k++) {
      momenta[b][k] += p[3 * i + k];
      momenta[b][3 + k] += L[k];
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, &momenta[0][0], (PetscMPIInt)(6 * m->nbody), MPIU_REAL, MPI_SUM, m->comm));
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

/* Middle and size of each body now. */
static PetscErrorCode find_middles(SbModel m, Vec U, PetscReal middle[][3], PetscReal size[])
{
  const SbSpace s = m->space;
  const PetscReal *u;
  PetscReal *mass;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(m->nbody, &mass));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt b = s->node_body[i];

    mass[b] += s->node_mass[i];
    for (int k = 0; k < 3; k++) middle[b][k] += s->node_mass[i] * (s->node_x[3 * i + k] + u[3 * i + k]);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, &middle[0][0], (PetscMPIInt)(3 * m->nbody), MPIU_REAL, MPI_SUM, m->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mass, (PetscMPIInt)m->nbody, MPIU_REAL, MPI_SUM, m->comm));
  for (PetscInt b = 0; b < m->nbody; b++) {
    for (int k = 0; k < 3; k++) middle[b][k] /= mass[b];
    size[b] = PetscPowReal(m->body[b].volume, 1. / 3);
  }
  PetscCall(PetscFree(mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v[nnode][3] += sum_l c[b][l] D w_l; rotations about the middles, lengths in sizes. Returns the largest speed added here. */
static PetscReal add_rigid(SbModel m, const PetscReal u[], const PetscReal middle[][3],
                           const PetscReal size[], const PetscReal c[][6], PetscReal v[])
{
  const SbSpace s = m->space;
  PetscReal largest = 0.;

  for (PetscInt i = 0; i < s->nnode; i++) {
    const PetscInt b = s->node_body[i];
    PetscReal r[3], turn[3], speed = 0.;

    for (int k = 0; k < 3; k++) r[k] = (s->node_x[3 * i + k] + u[3 * i + k] - middle[b][k]) / size[b];
    SbCross(c[b] + 3, r, turn);
    for (int k = 0; k < 3; k++) {
      if (s->fixed[i] & (1 << k)) continue;
      v[3 * i + k] += c[b][k] + turn[k];
      speed += PetscSqr(c[b][k] + turn[k]);
    }
    largest = PetscMax(largest, PetscSqrtReal(speed));
  }
  return largest;
}

/* G[6][6] x = y by elimination with full pivots; unknowns of pivots below rounding are zero: motions that are constrained. */
static void solve6(PetscReal G[6][6], PetscReal y[6], PetscReal x[6])
{
  int column[6] = {0, 1, 2, 3, 4, 5}, rank = 0;
  PetscReal largest = 0.;

  for (int i = 0; i < 36; i++) largest = PetscMax(largest, PetscAbsReal(G[i / 6][i % 6]));
  for (; rank < 6; rank++) {
    int p = rank, q = rank;

    for (int i = rank; i < 6; i++) {
      for (int j = rank; j < 6; j++) {
        if (PetscAbsReal(G[i][j]) > PetscAbsReal(G[p][q])) p = i, q = j;
      }
    }
    if (!(PetscAbsReal(G[p][q]) > 1e-11 * largest)) break;
    for (int j = 0; j < 6; j++) {
      const PetscReal swap = G[p][j];

      G[p][j] = G[rank][j];
      G[rank][j] = swap;
    }
    for (int i = 0; i < 6; i++) {
      const PetscReal swap = G[i][q];

      G[i][q] = G[i][rank];
      G[i][rank] = swap;
    }
    {
      const PetscReal swap = y[p];
      const int keep = column[q];

      y[p] = y[rank];
      y[rank] = swap;
      column[q] = column[rank];
      column[rank] = keep;
    }
    for (int i = rank + 1; i < 6; i++) {
      const PetscReal f = G[i][rank] / G[rank][rank];

      for (int j = rank; j < 6; j++) G[i][j] -= f * G[rank][j];
      y[i] -= f * y[rank];
    }
  }
  for (int i = 0; i < 6; i++) x[i] = 0.;
  for (int i = rank - 1; i >= 0; i--) {
    PetscReal sum = y[i];

    for (int j = i + 1; j < rank; j++) sum -= G[i][j] * x[column[j]];
    x[column[i]] = sum / G[i][i];
  }
}

/* One correction. wanted: about the origin. */
static PetscErrorCode correct(SbModel m, Vec U, const PetscBool named[], const PetscReal middle[][3],
                              const PetscReal size[], const PetscReal wanted[][6], PetscReal v[],
                              PetscReal *largest)
{
  PetscReal(*now)[6], (*c)[6], (*G)[6][6], *w, speed;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(m->nbody, &now, m->nbody, &c, m->nbody, &G));
  PetscCall(PetscMalloc1(3 * m->space->nnode, &w));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  for (int l = 0; l < 6; l++) {
    PetscCall(PetscArrayzero(&c[0][0], 6 * m->nbody));
    PetscCall(PetscArrayzero(w, 3 * m->space->nnode));
    for (PetscInt b = 0; b < m->nbody; b++) c[b][l] = 1.;
    (void)add_rigid(m, u, middle, size, (const PetscReal(*)[6])c, w);
    PetscCall(momenta_about(m, U, w, middle, now));
    for (PetscInt b = 0; b < m->nbody; b++) {
      for (int k = 0; k < 6; k++) G[b][k][l] = now[b][k] / (k < 3 ? 1. : size[b]);
    }
  }
  PetscCall(momenta_about(m, U, v, middle, now));
  for (PetscInt b = 0; b < m->nbody; b++) {
    PetscReal y[6], moved[3];

    SbCross(middle[b], wanted[b], moved);
    for (int k = 0; k < 3; k++) {
      y[k] = wanted[b][k] - now[b][k];
      y[3 + k] = (wanted[b][3 + k] - moved[k] - now[b][3 + k]) / size[b];
    }
    solve6(G[b], y, c[b]);
    for (int k = 0; k < 6 && !named[b]; k++) c[b][k] = 0.;
  }
  speed = add_rigid(m, u, middle, size, (const PetscReal(*)[6])c, v);
  *largest = PetscMax(*largest, speed);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(PetscFree(w));
  PetscCall(PetscFree3(now, c, G));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBodySetMomenta(SbModel m, Vec U, Vec V, const PetscBool named[],
                                const PetscReal momenta[][6], PetscReal *largest)
{
  const PetscReal *in_memory;
  PetscReal(*middle)[3], *size, *v, *array;

  PetscFunctionBeginUser;
  *largest = 0.;
  PetscCall(PetscCalloc2(m->nbody, &middle, m->nbody, &size));
  PetscCall(PetscMalloc1(3 * m->space->nnode, &v));
  PetscCall(find_middles(m, U, middle, size));
  PetscCall(SbSpaceGetLocalRead(m->space, V, &in_memory));
  PetscCall(PetscArraycpy(v, in_memory, 3 * m->space->nnode));
  PetscCall(SbSpaceRestoreLocalRead(m->space, V, &in_memory));
  for (int i = 0; i < 2; i++)
    PetscCall(correct(m, U, named, (const PetscReal(*)[3])middle, size, momenta, v, largest));
  PetscCall(SbSpaceGetLocalWrite(m->space, V, &array));
  PetscCall(PetscArraycpy(array, v, 3 * m->space->nnode_owned));
  PetscCall(SbSpaceRestoreLocalWrite(m->space, V, &array));
  PetscCall(PetscFree(v));
  PetscCall(PetscFree2(middle, size));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPIU_REAL, MPI_MAX, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
