/*
  History variables of effects in checkpoints: active contact constraints, friction states. Each effect gives
  records of numbers, whose entities have numbers that no partition changes (SbEffectOps.save); they are one
  dataset per effect, `state_<name>`, in any order. Every rank reads all; the effect takes its entities'.

  Without such a dataset (no contact, or an older file) the effects begin as at the start of a run.
*/
#include "output_impl.h"

#define SALT 0x5bd1e995u

/* Checksum: depends on the order within a record, not on the order of records. */
static uint64_t sum_of(PetscInt n, PetscInt width, const PetscReal record[])
{
  uint64_t sum = 0;

  for (PetscInt i = 0; i < n; i++) {
    uint64_t one = SALT;

    for (PetscInt k = 0; k < width; k++) one = SbMixReal(one, record[width * i + k]);
    sum += one;
  }
  return sum;
}

PetscErrorCode SbCheckpointWriteEffects(SbRun run, SbH5 *h, uint64_t *sum)
{
  const SbModel m = run->model;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->neffect; k++) {
    SbEffect e = m->effect[k];
    SbOrder order = {0};
    char name[2 * SB_NAME_MAX];
    PetscReal *record;
    uint64_t mine, all;

    if (!e->ops.save) continue;
    SbEffectCall(e, save, m->space, &order.n, &record);
    PetscCallMPI(MPI_Allreduce(&order.n, &order.N, 1, MPIU_INT, MPI_SUM, m->comm));
    PetscCallMPI(MPI_Scan(&order.n, &order.start, 1, MPIU_INT, MPI_SUM, m->comm));
    order.start -= order.n;
    mine = sum_of(order.n, e->nstate, record);
    PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPI_UINT64_T, MPI_SUM, m->comm));
    SbFormat(sizeof(name), name, "state_%s", e->name);
    if (order.N) {
      PetscCall(SbH5PutInt(h, h->file, name, order.N));
      PetscCall(SbH5WriteSlice(h, h->file, name, "SI", &order, e->nstate, H5T_IEEE_F64LE, record));
      *sum += all;
    }
    PetscCall(PetscFree(record));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCheckpointReadEffects(SbRun run, SbH5 *h, PetscReal t, uint64_t *sum, PetscBool *ok)
{
  const SbModel m = run->model;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, run->U, &u));
  for (PetscInt k = 0; k < m->neffect && *ok; k++) {
    SbEffect e = m->effect[k];
    SbOrder order = {0};
    char name[2 * SB_NAME_MAX];
    PetscBool there = PETSC_TRUE;
    PetscReal *record;
    int64_t n = 0;

    if (!e->ops.load) continue;
    SbFormat(sizeof(name), name, "state_%s", e->name);
    SbH5GetInt(h->file, name, &n, &there);
    if (!there || n <= 0) continue;
    order.n = order.N = (PetscInt)n;
    PetscCall(PetscMalloc1(e->nstate * order.n, &record));
    PetscCall(SbH5ReadSlice(h, name, &order, e->nstate, record, ok));
    if (*ok && sum) *sum += sum_of(order.n, e->nstate, record);
    if (*ok && !sum) SbEffectCall(e, load, m->space, t, u, order.n, record);
    PetscCall(PetscFree(record));
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->U, &u));
  if (!sum) PetscCall(SbModelContactResume(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}
