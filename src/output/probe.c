/*
  Probes: points of the bodies whose displacement the history follows. Each sits at the vertex nearest to the point asked
  for in the rest state; of equally near ones, at that with the smallest original number. It shows what vertex fields show
  there: the unknown of P1, the mean of the cells around it for CR and DG.

  It follows the material that is there. When its body is re-meshed and the vertex is gone, it shows what the tet has that holds the position at
  rest: sum_a w_a u_a with the weights of its corners. Checkpoints carry the position (SbProbesWrite).
*/
#include <math.h>
#include "output_impl.h"
#include "sbtet.h"

#define NNUMBER 4 /* of a probe in a checkpoint: the position, the body */

/* The nearest vertex that this rank owns, of a body unless that is -1: squared distance, local number (-1 when it owns none). */
static void nearest_owned(const SbMesh mesh, PetscInt body, const PetscReal at[3], PetscReal *best,
                          PetscInt *local)
{
  *best = PETSC_MAX_REAL;
  *local = -1;
  for (PetscInt i = 0; i < mesh->nvert_owned; i++) {
    const PetscReal *x = mesh->x + 3 * i;
    const PetscReal d2 = PetscSqr(x[0] - at[0]) + PetscSqr(x[1] - at[1]) + PetscSqr(x[2] - at[2]);

    if (body >= 0 && mesh->vert_body[i] != body) continue;
    if (d2 < *best || (d2 == *best && *local >= 0 && mesh->vert_orig[i] < mesh->vert_orig[*local])) {
      *best = d2;
      *local = i;
    }
  }
}

/* Of all ranks the one that has the best, with the lowest number: its local number there, -1 on the others. */
static PetscErrorCode agree(SbOutput out, PetscReal mine, PetscInt original, PetscInt *local,
                            PetscInt *winner, PetscReal *best)
{
  PetscInt candidate = PETSC_MAX_INT;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(&mine, best, 1, MPIU_REAL, MPI_MIN, out->comm));
  if (*local >= 0 && mine == *best) candidate = original;
  PetscCallMPI(MPI_Allreduce(&candidate, winner, 1, MPIU_INT, MPI_MIN, out->comm));
  if (candidate != *winner || *winner == PETSC_MAX_INT) *local = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The owned cell of the probe's body in which its point lies deepest: how far outside (negative: how deep), and the weights. */
static PetscReal deepest_owned(const SbMesh mesh, const SbProbe *probe, PetscInt *cell, PetscReal weight[4])
{
  PetscReal best = PETSC_MAX_REAL;

  *cell = -1;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal w[4], outside;

    if (mesh->cell_body[c] != probe->body) continue;
    SbTetBarycentric(mesh->x, mesh->cell + 4 * c, probe->x, w);
    outside = -PetscMin(PetscMin(w[0], w[1]), PetscMin(w[2], w[3]));
    if (outside > best || (outside == best && mesh->cell_orig[c] > mesh->cell_orig[*cell])) continue;
    best = outside;
    *cell = c;
    for (int a = 0; a < 4; a++) weight[a] = w[a];
  }
  return best;
}

/* Another mesh: the vertex at the position that it followed, or the tet around it. */
static PetscErrorCode find_again(const SbMesh mesh, SbOutput out, SbProbe *probe)
{
  PetscReal mine, best;
  PetscInt tet;

  PetscFunctionBeginUser;
  probe->cell = -1;
  nearest_owned(mesh, probe->body, probe->x, &mine, &probe->local);
  PetscCall(agree(out, mine, probe->local < 0 ? 0 : mesh->vert_orig[probe->local], &probe->local,
                  &probe->original, &best));
  if (best == 0.) PetscFunctionReturn(PETSC_SUCCESS);
  probe->local = probe->original = -1;
  mine = deepest_owned(mesh, probe, &probe->cell, probe->weight);
  PetscCall(agree(out, mine, probe->cell < 0 ? 0 : mesh->cell_orig[probe->cell], &probe->cell, &tet, &best));
  if (best > 1e-6)
    PetscCall(SbWarning(out->comm,
                        "probe '%s': no tet of the re-meshed body holds its position any more; it follows "
                        "the nearest one, from %.2g of its size outside",
                        probe->name, (double)best));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first time: where it goes. */
static PetscErrorCode find_first(const SbMesh mesh, SbOutput out, SbProbe *probe)
{
  PetscReal mine, best, here[3] = {0., 0., 0.};
  PetscInt body = -1;

  PetscFunctionBeginUser;
  probe->cell = -1;
  nearest_owned(mesh, -1, probe->at, &mine, &probe->local);
  PetscCall(agree(out, mine, probe->local < 0 ? 0 : mesh->vert_orig[probe->local], &probe->local,
                  &probe->original, &best));
  if (probe->local >= 0) {
    PetscCall(PetscArraycpy(here, mesh->x + 3 * probe->local, 3));
    body = mesh->vert_body[probe->local];
  }
  PetscCallMPI(MPI_Allreduce(here, probe->x, 3, MPIU_REAL, MPI_SUM, out->comm));
  PetscCallMPI(MPI_Allreduce(&body, &probe->body, 1, MPIU_INT, MPI_MAX, out->comm));
  probe->found = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesFind(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;

  PetscFunctionBeginUser;
  if (out->nprobe) PetscCall(SbPointsPrepare(run, out));
  for (PetscInt p = 0; p < out->nprobe; p++) {
    if (out->probe[p].found)
      PetscCall(find_again(mesh, out, &out->probe[p]));
    else
      PetscCall(find_first(mesh, out, &out->probe[p]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbProbeValue(SbRun run, SbOutput out, const SbProbe *probe, const PetscReal u[], PetscReal value[3])
{
  if (probe->local >= 0) SbPointsVertex(run, out, probe->local, u, value);
  for (int a = 0; a < 4 && probe->cell >= 0; a++) {
    PetscReal corner[3];

    SbPointsCorner(run, 4 * probe->cell + a, u, corner);
    for (int k = 0; k < 3; k++) value[k] += probe->weight[a] * corner[k];
  }
}

/* ------------------------------------------------------------------ in checkpoints */

static PetscErrorCode number_name(const SbProbe *probe, int k, size_t size, char name[])
{
  static const char *const what[NNUMBER] = {"x", "y", "z", "body"};

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(name, size, "probe_%s_%s", probe->name, what[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesWrite(SbRun run, SbOutput out, SbH5 *h)
{
  char name[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  if (!SbOutputMeshStep(run)) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < out->nprobe; p++) {
    const SbProbe *probe = &out->probe[p];

    for (int k = 0; k < NNUMBER && probe->found; k++) {
      PetscCall(number_name(probe, k, sizeof(name), name));
      PetscCall(SbH5PutReal(h, h->file, name, k < 3 ? probe->x[k] : (PetscReal)probe->body));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesRead(SbRun run, SbOutput out, SbH5 *h)
{
  char name[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  for (PetscInt p = 0; p < out->nprobe; p++) {
    SbProbe *probe = &out->probe[p];
    PetscReal number[NNUMBER];
    PetscBool there = PETSC_TRUE;

    for (int k = 0; k < NNUMBER; k++) {
      PetscCall(number_name(probe, k, sizeof(name), name));
      PetscCall(SbH5GetReal(h->file, name, &number[k], &there));
    }
    if (!there || number[3] < 0. || number[3] >= (PetscReal)run->model->nbody) continue;
    PetscCall(PetscArraycpy(probe->x, number, 3));
    probe->body = (PetscInt)number[3];
    probe->found = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
