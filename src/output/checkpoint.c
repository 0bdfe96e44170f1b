/*
  Checkpoints: the state of a run in one HDF5 file, from which it goes on as if it had not stopped.

  Displacement, velocity and acceleration (the integrator's own) of all nodes in original order and
  double precision, the step, its time, the next step's length, work and dissipation so far, and the
  history variables of effects. A file is written beside its target, flushed and renamed; the newest
  ones are kept. It is accepted by a run with the same hash of the mesh (every coordinate and cell
  by its original number), and the same text of the options that determine the mechanics. Checksums
  detect a file that was damaged later: one over the vectors and records, one over every number and
  text beside them (both sums: mesh.c). Format 1 lacks the second; its step, times and energies must
  be plausible.

  Effects have active contact constraints and friction states. Each gives records of numbers, whose
  entities have numbers that no partition changes (SbEffectOps.save); they are one dataset per
  effect, `state_<name>`, in any order. Every rank reads all; the effect takes its entities'.
  Without such a dataset (no contact, or an older file) the effects begin as at the start of a run.
*/
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>
#include "output_impl.h"

#define FORMAT 2
#define FORMAT_WITHOUT_SCALARS 1 /* older files: no checksum over scalars */
#define SALT 0x5bd1e995u         /* in the checksums of effects */
#define SHORTEST 1e-9            /* of -ts_dt: a next step that an adaptive run may have */

/* An array of the state. Those with a checksum of their own may be missing in a file. */
typedef struct {
  const char *name, *unit, *sum; /* sum: name of its own checksum; NULL: part of the file's */
  const SbOrder *order;
  PetscInt ncomp;
  uint64_t salt;
  Vec vec;        /* NULL: penalty data of faces, or */
  PetscBool past; /* the history of cells */
} Part;

/* Those of a run: arc length has `path`; penalty data of faces are there where they are history
   variables. */
#define NPART 6
static PetscInt parts_of(SbRun run, SbOutput out, Part part[NPART])
{
  const SbModel m = run->model;
  const PetscBool implicit =
    (PetscBool)(m->dynamic && run->solve.J && run->solve.preset != SB_TIME_ALPHA2);
  const PetscBool remember = (PetscBool)(implicit && m->space->jump && !m->space->linear);
  const PetscBool past = (PetscBool)(m->space->softening || (m->dynamic && m->space->viscous));
  const Part all[NPART] = {
    {"u", "SI", NULL, &out->node, 3, 0, run->state.U, PETSC_FALSE},
    {"v", "SI", NULL, &out->node, 3, 1, run->state.V, PETSC_FALSE},
    {"a", "SI", NULL, &out->node, 3, 2, run->state.A, PETSC_FALSE},
    {"path", "SI", "path_checksum", &out->node, 3, 3, run->state.path, PETSC_FALSE},
    {"jumps", "N/m, Pa", "jumps_checksum", &out->cell, 5, 0, NULL, PETSC_FALSE},
    {"history", "Pa, 1", NULL, &out->cell, m->space->nhistory, 4, NULL, PETSC_TRUE}};
  PetscInt n = 0;

  for (int k = 0; k < NPART; k++)
    if (all[k].vec || (k == NPART - 2 && remember) || (k == NPART - 1 && past))
      part[n++] = all[k];
  return n;
}

/* Room for one of them: in the order of the file, and of the cells of this rank. */
static PetscErrorCode part_room(PetscInt n, const Part part[], SbOutput out, PetscReal **slice,
                                PetscReal **cells)
{
  PetscInt room[2] = {0, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n; k++) {
    room[0] = PetscMax(room[0], part[k].ncomp * part[k].order->n);
    if (!part[k].vec)
      room[1] = PetscMax(room[1], part[k].ncomp * out->cell.nowned);
  }
  PetscCall(PetscMalloc2(room[0], slice, room[1], cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Step and time of the file, and the next step's length. */
typedef struct {
  PetscReal t, next, dt, t_end, paused;
} Times;

/* Scalars, by name. Optional ones are zero where they are missing: those of re-meshing, and of a
   pause. */
typedef struct {
  const char *name;
  PetscReal *value;
  PetscBool optional;
} Number;

#define NNUMBER 21
static void numbers_of(SbRun run, Times *times, Number number[NNUMBER])
{
  SbEnergies *e = &run->state.energies;
  const Number all[NNUMBER] = {
    {"time", &times->t, PETSC_FALSE},
    {"dt_next", &times->next, PETSC_FALSE},
    {"dt", &times->dt, PETSC_FALSE},
    {"t_end", &times->t_end, PETSC_FALSE},
    {"load_work", &e->load_work, PETSC_FALSE},
    {"prescribed_work", &e->prescribed_work, PETSC_FALSE},
    {"damping_loss", &e->damping_loss, PETSC_FALSE},
    {"integrator_loss", &e->integrator_loss, PETSC_FALSE},
    {"energy_start", &run->state.energy_start, PETSC_FALSE},
    {"load_factor", &run->model->load, PETSC_FALSE},
    {"remesh_loss", &e->remesh_loss, PETSC_TRUE},
    {"remesh_mass", &e->remesh_mass, PETSC_TRUE},
    {"remesh_momentum", &e->remesh_momentum, PETSC_TRUE},
    {"energy_most", &run->state.energy_most, PETSC_TRUE},
    {"paused_after", &times->paused, PETSC_TRUE},
    {"good_steps", &run->clock.good_steps, PETSC_TRUE},
    {"relaxation_loss", &e->relaxation_loss, PETSC_TRUE},
    {"viscosity_loss", &e->viscosity_loss, PETSC_TRUE},
    {"mullins_loss", &e->mullins_loss, PETSC_TRUE},
    {"active_work", &e->active_work, PETSC_TRUE},
    {"growth_work", &e->growth_work, PETSC_TRUE},
  };

  memcpy(number, all, sizeof(all));
}

static PetscErrorCode checksum_of(MPI_Comm comm, const Part *p, const PetscReal slice[],
                                  uint64_t *sum)
{
  uint64_t mine = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < p->ncomp * p->order->n; i++)
    mine += SbMixReal((uint64_t)(p->ncomp * p->order->start + i) + (p->salt << 48), slice[i]);
  PetscCallMPI(MPI_Allreduce(&mine, sum, 1, MPI_UINT64_T, MPI_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the parts of a checkpoint. */
static PetscErrorCode write_parts(SbRun run, SbOutput out, SbH5 *h, uint64_t *checksum)
{
  Part part[NPART];
  const PetscInt n = parts_of(run, out, part);
  PetscReal *slice, *cells;

  PetscFunctionBeginUser;
  *checksum = 0;
  PetscCall(part_room(n, part, out, &slice, &cells));
  for (const Part *p = part; p < part + n; p++) {
    const PetscScalar *array = cells;
    uint64_t sum;

    if (p->vec)
      PetscCall(VecGetArrayRead(p->vec, &array));
    else if (p->past)
      PetscCall(SbSpaceGetHistory(run->model->space, cells));
    else
      PetscCall(SbSpaceGetJumps(run->model->space, run->state.U, cells));
    PetscCall(SbForestReduce(p->order->sf, p->ncomp, MPIU_REAL, array, slice));
    if (p->vec)
      PetscCall(VecRestoreArrayRead(p->vec, &array));
    PetscCall(
      SbH5WriteSlice(h, h->file, p->name, p->unit, p->order, p->ncomp, H5T_IEEE_F64LE, slice));
    PetscCall(checksum_of(out->comm, p, slice, &sum));
    if (p->sum)
      PetscCall(SbH5PutInt(h, h->file, p->sum, (int64_t)sum));
    else
      *checksum += sum;
  }
  if (run->state.path)
    PetscCall(SbH5PutReal(h, h->file, "path_first", run->clock.arc.first));
  PetscCall(PetscFree2(slice, cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checksum: depends on the order within a record, not on the order of records. */
static uint64_t sum_of_records(PetscInt n, PetscInt width, const PetscReal record[])
{
  uint64_t sum = 0;

  for (PetscInt i = 0; i < n; i++) {
    uint64_t one = SALT;

    for (PetscInt k = 0; k < width; k++)
      one = SbMixReal(one, record[width * i + k]);
    sum += one;
  }
  return sum;
}

/* Writes the state of all effects; sum is raised by their checksum. Collective. */
static PetscErrorCode write_effects(SbRun run, SbH5 *h, uint64_t *sum)
{
  const SbModel m = run->model;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->neffect; k++) {
    SbEffect e = m->effect[k];
    SbOrder order = {0};
    char name[2 * SB_NAME_MAX];
    PetscReal *record;
    uint64_t mine, all;

    if (!e->ops.save)
      continue;
    SbEffectCall(e, save, m->space, &order.n, &record);
    PetscCallMPI(MPI_Allreduce(&order.n, &order.N, 1, MPIU_INT, MPI_SUM, m->comm));
    PetscCallMPI(MPI_Scan(&order.n, &order.start, 1, MPIU_INT, MPI_SUM, m->comm));
    order.start -= order.n;
    mine = sum_of_records(order.n, e->nstate, record);
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

/* Reads it: raises sum; without sum gives the state to the effects, at t. ok: it is readable.
   Collective. */
static PetscErrorCode read_effects(SbRun run, SbH5 *h, PetscReal t, uint64_t *sum, PetscBool *ok)
{
  const SbModel m = run->model;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &u));
  for (PetscInt k = 0; k < m->neffect && *ok; k++) {
    SbEffect e = m->effect[k];
    SbOrder order = {0};
    char name[2 * SB_NAME_MAX];
    PetscBool there = PETSC_TRUE;
    PetscReal *record;
    int64_t n = 0;

    if (!e->ops.load)
      continue;
    SbFormat(sizeof(name), name, "state_%s", e->name);
    SbH5GetInt(h->file, name, &n, &there);
    if (!there || n <= 0)
      continue;
    order.n = order.N = (PetscInt)n;
    PetscCall(PetscMalloc1(e->nstate * order.n, &record));
    PetscCall(SbH5ReadSlice(h, name, &order, e->nstate, record, ok));
    if (*ok && sum)
      *sum += sum_of_records(order.n, e->nstate, record);
    if (*ok && !sum)
      SbEffectCall(e, load, m->space, t, u, order.n, record);
    PetscCall(PetscFree(record));
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &u));
  if (!sum)
    PetscCall(SbContactSetResume(&m->contacts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SCALARS "scalars_checksum"

/* Adds name and value of an attribute: a number of 8 bytes, which the sums of arrays need, too. */
static herr_t add_attribute(hid_t where, const char *name, const H5A_info_t *info, void *ctx)
{
  uint64_t *sum = (uint64_t *)ctx;
  const hid_t attribute = strcmp(name, SCALARS) ? H5Aopen(where, name, H5P_DEFAULT) : -1;
  const hid_t type = attribute < 0 ? -1 : H5Aget_type(attribute);
  union {
    uint64_t bits;
    PetscReal real;
    int64_t integer;
  } value = {0};
  herr_t bad = 0;

  (void)info;
  if (attribute < 0)
    return strcmp(name, SCALARS) ? -1 : 0;
  if (H5Tget_class(type) == H5T_FLOAT)
    bad = SbH5IsScalar(attribute) ? H5Aread(attribute, H5T_NATIVE_DOUBLE, &value.real) : -1;
  else if (H5Tget_class(type) == H5T_INTEGER)
    bad = SbH5IsScalar(attribute) ? H5Aread(attribute, H5T_NATIVE_INT64, &value.integer) : -1;
  else
    bad = -1;
  *sum += SbHashBytes(value.bits, strlen(name), name);
  (void)H5Tclose(type);
  (void)H5Aclose(attribute);
  return bad;
}

/* Checksum of all numbers of an open file, of its re-meshed bodies' too, and of the text of its
   options; in any order. Collective: all ranks have the same. */
static void sum_of_scalars(SbRun run, SbH5 *h, const char *options, uint64_t *sum, PetscBool *ok)
{
  *sum = SbHashBytes(SALT, strlen(options), options);
  for (PetscInt b = -1; b < run->model->nbody && *ok; b++) {
    char name[2 * SB_NAME_MAX] = "/";
    hid_t group;

    if (b >= 0)
      SbFormat(sizeof(name), name, "mesh_%s", run->model->body[b].name);
    group = b < 0 ? H5Gopen2(h->file, name, H5P_DEFAULT) : SbH5OpenGroup(h->file, name);
    if (b >= 0 && group < 0)
      continue;
    if (group < 0 || H5Aiterate2(group, H5_INDEX_NAME, H5_ITER_INC, NULL, add_attribute, sum) < 0)
      *ok = PETSC_FALSE;
    if (group >= 0)
      (void)H5Gclose(group);
  }
}

/* Name of the energy of term i of the series of material k. */
static void branch_name(PetscInt k, PetscInt i, char name[SB_NAME_MAX])
{
  SbFormat(SB_NAME_MAX, name, "branch_energy_%" PetscInt_FMT "_%" PetscInt_FMT, k, i);
}

/* Energies of the branches of viscoelastic materials. */
static PetscErrorCode write_branches(SbRun run, SbH5 *h)
{
  const SbModel m = run->model;
  char name[SB_NAME_MAX];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->nmaterial && m->dynamic; k++) {
    const SbViscous v = m->material[k]->viscous;

    for (PetscInt i = 0; v && i < v->n; i++) {
      branch_name(k, i, name);
      PetscCall(SbH5PutReal(h, h->file, name, v->stored[i]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void read_branches(SbRun run, SbH5 *h, PetscBool *ok)
{
  const SbModel m = run->model;
  char name[SB_NAME_MAX];

  for (PetscInt k = 0; k < m->nmaterial && m->dynamic; k++) {
    const SbViscous v = m->material[k]->viscous;

    for (PetscInt i = 0; v && i < v->n && *ok; i++) {
      branch_name(k, i, name);
      SbH5GetReal(h->file, name, &v->stored[i], ok);
    }
  }
}

static PetscErrorCode monitor(SbRun run, const SbStep *step, void *ctx)
{
  SbOutput out = (SbOutput)ctx;
  const PetscBool asked = (PetscBool)(out->checkpoint_every > 0. || out->checkpoint_every_steps);
  SbH5 h;
  char name[SB_FILE_MAX], path[PETSC_MAX_PATH_LEN], tmp[PETSC_MAX_PATH_LEN];
  char message[SB_MESSAGE_MAX] = "";
  PetscBool due = PETSC_FALSE;
  PetscBool ok = PETSC_TRUE;
  uint64_t checksum, scalars;
  Times times = {step->t, run->clock.dt, run->clock.dt, run->clock.t_end,
                 run->clock.paused ? run->monitors.post_step.dt : 0.};
  Number number[NNUMBER];

  PetscFunctionBeginUser;

  /* whether this step is to be written: by time, by number, as the last one, or because the run
     stops */
  if (out->checkpoint_every > 0.)
    due = SbOutputDue(out->checkpoint_every, step->t, step->dt);
  if (out->checkpoint_every_steps && step->step % out->checkpoint_every_steps == 0)
    due = PETSC_TRUE;
  if ((step->last && asked) || run->clock.stopped)
    due = PETSC_TRUE;
  if (step->step == run->clock.step0 || !due)
    PetscFunctionReturn(PETSC_SUCCESS);

  PetscCall(SbOutputOrder(run, out));
  PetscCall(SbLogNamed("Out", "checkpoint", &out->event.checkpoint));
  PetscCall(PetscLogStagePush(SbLogStageOutput));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CHECKPOINT], 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(out->event.checkpoint, 0, 0, 0, 0));

  /* a temporary file beside its target; a full disk is an error before anything is written */
  (void)snprintf(name, sizeof(name), "checkpoint_%06" PetscInt_FMT ".h5", step->step);
  SbOutputPath(out, name, path);
  SbOutputPath(out, "checkpoint.tmp", tmp);
  PetscCall(SbH5Create(out->comm, tmp, &h));
  PetscCall(
    SbH5Reserve(&h, (PetscInt64)out->node.N * 3 * 32 + (PetscInt64)strlen(out->identity) + 65536));

  /* the state */
  PetscCall(write_parts(run, out, &h, &checksum));
  PetscCall(write_effects(run, &h, &checksum));
  PetscCall(SbCheckpointWriteMeshes(run, &h, &checksum));

  /* time, work and dissipation so far */
  if (run->solve.ts)
    PetscCall(TSGetTimeStep(run->solve.ts, &times.next));
  numbers_of(run, &times, number);
  for (int i = 0; i < NNUMBER; i++)
    if (!number[i].optional || *number[i].value != 0.)
      PetscCall(SbH5PutReal(&h, h.file, number[i].name, *number[i].value));
  PetscCall(SbH5PutInt(&h, h.file, "step", step->step));
  PetscCall(write_branches(run, &h));

  /* accumulated error estimates, and the material points of probes */
  for (PetscInt i = 0; i < run->monitors.ncheckpoint; i++)
    PetscCall(SbH5PutReal(&h, h.file, run->monitors.checkpoint[i].name,
                          *run->monitors.checkpoint[i].value));
  PetscCall(SbProbesWrite(run, out, &h));
  PetscCall(SbHistoryWrite(run, out, step->step, &h));

  /* values of live formulas */
  for (PetscInt i = 0; i < SbLiveCount(); i++)
    PetscCall(SbH5PutReal(&h, h.file, SbLiveColumn(i, NULL), SbLiveGet(i, step->t)));

  /* identity of the run, and the checksum */
  PetscCall(SbH5PutInt(&h, h.file, "mesh_hash", (int64_t)out->mesh_hash));
  PetscCall(SbH5PutInt(&h, h.file, "checksum", (int64_t)checksum));
  PetscCall(SbH5PutInt(&h, h.file, "format", FORMAT));
  PetscCall(SbH5WriteText(&h, h.file, "options", out->identity));
  sum_of_scalars(run, &h, out->identity, &scalars, &ok);
  PetscCheck(ok, out->comm, PETSC_ERR_PLIB, "%s: its own numbers cannot be read", h.path);
  PetscCall(SbH5PutInt(&h, h.file, SCALARS, (int64_t)scalars));
  PetscCall(SbH5Flush(&h));
  PetscCall(SbH5Close(&h));

  /* flushed: rename it, and remove the oldest ones */
  if (!out->rank) {
    if (rename(tmp, path))
      SbFormat(sizeof(message), message, "cannot rename %s to %s: %s", tmp, path, strerror(errno));
    else
      SbCheckpointPrune(out, PETSC_MAX_INT, out->checkpoint_keep);
  }
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscCall(PetscLogEventEnd(out->event.checkpoint, 0, 0, 0, 0));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CHECKPOINT], 0, 0, 0, 0));
  PetscCall(PetscLogStagePop());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCheckpointAttach(SbRun run, SbOutput out)
{
  const PetscBool asked = (PetscBool)(out->checkpoint_every > 0. || out->checkpoint_every_steps);

  PetscFunctionBeginUser;

  // a run that may be asked to stop writes one, too: work and dissipation are part of the state
  if (asked)
    run->monitors.want_energies = PETSC_TRUE;
  if (asked || run->clock.stop.listens)
    PetscCall(SbRunAddMonitor(run, monitor, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a checkpoint of other bodies, meshes or effects. */
static PetscErrorCode check_identity(SbRun run, SbOutput out, SbH5 *h, int64_t mesh_hash,
                                     int64_t format, const char *theirs)
{
  char a[200] = "";
  char b[200] = "";
  const char *ours = out->identity;

  PetscFunctionBeginUser;

  // the first lines in which the texts of options differ; older files say nothing about contents
  while (!a[0] && (*theirs || *ours)) {
    const size_t n = strcspn(theirs, "\n");
    const size_t m = strcspn(ours, "\n");

    if (format == FORMAT_WITHOUT_SCALARS && !*theirs &&
        !strncmp(ours, SB_CONTENT, strlen(SB_CONTENT)))
      break;

    if (n != m || strncmp(theirs, ours, n)) {
      SbFormat(sizeof(a), a, "%.*s", n ? (int)n : 7, n ? theirs : "nothing");
      SbFormat(sizeof(b), b, "%.*s", m ? (int)m : 7, m ? ours : "nothing");
    }
    theirs += n + (theirs[n] == '\n');
    ours += m + (ours[m] == '\n');
  }
  PetscCheck(
    !a[0], out->comm, PETSC_ERR_USER_INPUT,
    "cannot restart from %s: it was made with '%s', this run has '%s'; bodies, effects and "
    "what is in their files must be the same",
    h->path, a, b);
  PetscCheck(
    (uint64_t)mesh_hash == out->mesh_hash, out->comm, PETSC_ERR_USER_INPUT,
    "cannot restart from %s: it belongs to another mesh (other vertices, cells or placement%s); "
    "-body_<name>_state FOLDER takes the state of a run with any mesh",
    h->path, SbOutputMeshStep(run) ? ", or a body was re-meshed: name it by -restart FILE" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The arrays of an open file; all: raised by the checksums of those without one of their own. */
static PetscErrorCode read_parts(SbRun run, SbOutput out, SbH5 *h, uint64_t *all, PetscBool *ok)
{
  Part part[NPART];
  const PetscInt n = parts_of(run, out, part);
  PetscReal *slice, *cells;

  PetscFunctionBeginUser;
  PetscCall(part_room(n, part, out, &slice, &cells));
  for (const Part *p = part; p < part + n && *ok; p++) {
    PetscScalar *array = cells;
    uint64_t sum;
    int64_t own = 0;

    if (p->sum && H5Lexists(h->file, p->name, H5P_DEFAULT) <= 0 && H5Aexists(h->file, p->sum) <= 0)
      continue;
    PetscCall(SbH5ReadSlice(h, p->name, p->order, p->ncomp, slice, ok));
    if (p->sum)
      SbH5GetInt(h->file, p->sum, &own, ok);
    if (*ok && p->vec && p->vec == run->state.path)
      SbH5GetReal(h->file, "path_first", &run->clock.arc.first, ok);
    if (!*ok)
      break;
    PetscCall(checksum_of(out->comm, p, slice, &sum));
    *ok = (PetscBool)(!p->sum || own == (int64_t)sum);
    if (!p->sum)
      *all += sum;
    if (p->vec)
      PetscCall(VecGetArray(p->vec, &array));
    PetscCall(SbForestBroadcast(p->order->sf, p->ncomp, MPIU_REAL, slice, array));
    if (p->vec)
      PetscCall(VecRestoreArray(p->vec, &array));
    else if (*ok && p->past)
      PetscCall(SbSpaceSetHistory(run->model->space, cells));
    else if (*ok)
      PetscCall(SbSpaceSetJumps(run->model->space, cells));
  }
  PetscCall(PetscFree2(slice, cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether step, times and energies of a file may be those of a run. */
static PetscBool plausible(SbRun run, int64_t step, const Times *t, const PetscReal values[NNUMBER])
{
  for (int i = 0; i < NNUMBER; i++)
    if (PetscIsInfOrNanReal(values[i]))
      return PETSC_FALSE;
  if (step < 0 || step >= PETSC_MAX_INT)
    return PETSC_FALSE;

  // load factors of a static run may lie anywhere; a last step may end a little behind the end
  return (PetscBool)(!run->model->dynamic ||
                     (t->t >= 0. && t->t_end > 0. && t->dt > 0. && t->next >= SHORTEST * t->dt &&
                      t->next <= t->dt / SHORTEST &&
                      t->t <= t->t_end + PetscMax(t->dt, t->next) * (1. + 1e-9)));
}

/* Loads one file; not ok: truncated, damaged or no checkpoint. One that does not fit the run is an
   error. */
static PetscErrorCode load(SbRun run, SbOutput out, const char *path, PetscBool *ok)
{
  SbH5 h;
  Times times;
  Number number[NNUMBER];
  int64_t step, mesh_hash;
  int64_t checksum = 0;
  int64_t format, scalars;
  uint64_t sum = 0;
  uint64_t scalar_sum = 0;
  char *options = NULL;
  PetscReal values[NNUMBER] = {0.};

  PetscFunctionBeginUser;
  PetscCall(SbH5Open(out->comm, path, PETSC_FALSE, &h, ok));
  if (!*ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbH5GetInt(h.file, "format", &format, ok);
  SbH5GetInt(h.file, "step", &step, ok);
  SbH5GetInt(h.file, "mesh_hash", &mesh_hash, ok);
  SbH5GetInt(h.file, "checksum", &checksum, ok);
  numbers_of(run, &times, number);
  for (int i = 0; i < NNUMBER; i++) {
    PetscBool there = PETSC_TRUE;

    SbH5GetReal(h.file, number[i].name, &values[i], &there);
    if (!there && !number[i].optional)
      *ok = PETSC_FALSE;
  }
  if (*ok && format != FORMAT && format != FORMAT_WITHOUT_SCALARS)
    *ok = PETSC_FALSE;

  /* the numbers and texts are whole before they are compared with the run's */
  if (*ok)
    PetscCall(SbH5ReadText(&h, "options", &options, ok));
  if (*ok && format == FORMAT) {
    SbH5GetInt(h.file, SCALARS, &scalars, ok);
    sum_of_scalars(run, &h, options, &scalar_sum, ok);
    *ok = (PetscBool)(*ok && (int64_t)scalar_sum == scalars);
  }
  if (*ok)
    *ok = plausible(run, step, &(Times){values[0], values[1], values[2], values[3], 0.}, values);

  /* the identity, the state and its checksum */
  if (*ok)
    PetscCall(check_identity(run, out, &h, mesh_hash, format, options));
  PetscCall(PetscFree(options));
  if (*ok)
    PetscCall(read_parts(run, out, &h, &sum, ok));
  if (*ok)
    PetscCall(read_effects(run, &h, 0., &sum, ok));
  if (*ok)
    SbCheckpointSumMeshes(run, &h, &sum, ok);
  if (sum != (uint64_t)checksum)
    *ok = PETSC_FALSE;

  /* scalars; the next step has the length of the uninterrupted run, unless -ts_dt or -ts_max_time
     differ */
  for (int i = 0; i < NNUMBER && *ok; i++)
    *number[i].value = values[i];
  if (*ok && run->solve.ts &&
      (!run->clock.fixed || (times.dt == run->clock.dt && times.t_end == run->clock.t_end)))
    PetscCall(TSSetTimeStep(run->solve.ts, times.next));

  /* accumulated error estimates: all or none, as a run without -ledger writes none */
  if (*ok && run->monitors.ncheckpoint) {
    PetscBool all = PETSC_TRUE;

    for (PetscInt i = 0; i < run->monitors.ncheckpoint; i++)
      all = (PetscBool)(all && H5Aexists(h.file, run->monitors.checkpoint[i].name) > 0);
    for (PetscInt i = 0; i < run->monitors.ncheckpoint && all; i++)
      SbH5GetReal(h.file, run->monitors.checkpoint[i].name, run->monitors.checkpoint[i].value, ok);
    if (!all)
      PetscCall(SbWarning(
        out->comm, "%s has no errors, as it was written without -ledger: they count from there",
        h.path));
  }
  read_branches(run, &h, ok);
  if (*ok)
    PetscCall(SbProbesRead(run, out, &h));
  if (*ok)
    PetscCall(SbHistoryRead(run, out, &h));
  for (PetscInt i = 0; *ok && i < SbLiveCount(); i++) {
    PetscReal value;

    SbH5GetReal(h.file, SbLiveColumn(i, NULL), &value, ok);
    if (*ok)
      SbLiveSet(i, times.t, value);
  }

  /* history variables of effects; the run is at the file's step */
  if (*ok)
    PetscCall(read_effects(run, &h, times.t, NULL, ok));
  PetscCall(SbH5Close(&h));
  if (!*ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  run->monitors.post_step.dt = times.paused;
  run->clock.step0 = (PetscInt)step;
  run->clock.t0 = times.t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCheckpointLoad(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;
  PetscBool ok;
  char path[PETSC_MAX_PATH_LEN];
  struct stat info;

  PetscFunctionBeginUser;
  PetscCall(SbOutputOrder(run, out));
  PetscCheck(
    stat(out->restart, &info) || !S_ISDIR(info.st_mode), out->comm, PETSC_ERR_FILE_OPEN,
    "-restart %s is a folder: name a checkpoint_*.h5 in it, or go on there with -output_dir %s "
    "-restart latest",
    out->restart, out->restart);
  for (;;) {
    PetscCall(SbCheckpointFind(out, path));

    /* an unreadable one is skipped if an older one may be taken */
    PetscCheck(path[0], out->comm, PETSC_ERR_FILE_OPEN,
               "-restart latest: there is no %scheckpoint in %s", out->ndamaged ? "readable " : "",
               out->dir);
    PetscCall(load(run, out, path, &ok));
    if (ok)
      break;
    PetscCheck(!strcmp(out->restart, "latest"), out->comm, PETSC_ERR_FILE_READ,
               "cannot restart from %s: %s", path,
               access(path, R_OK) ? "there is no such file, or it may not be read"
                                  : "it is truncated, damaged or not a checkpoint");
    PetscCall(SbWarning(out->comm, SB_SKIPPED, path));
    out->ndamaged++;
  }
  if (!out->quiet)
    PetscCall(PetscPrintf(out->comm, "restart from %s: step %" PetscInt_FMT ", t = %g s\n", path,
                          run->clock.step0, run->clock.t0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
