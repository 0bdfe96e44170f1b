/*
  Meshes in checkpoints. A body that was re-meshed has no file any more: its mesh is in the
  checkpoint, as the group `mesh_<body>` with the arrays of SbMemoryMesh, written by rank 0. A
  restart takes it from there before the scene is set up; the mesh of the other bodies comes from
  their files.
*/
#include <unistd.h>
#include "output_impl.h"
#include "sbmeshio.h"

#define SALT 0x6d657368u

/* The arrays of a mesh in memory; on ranks other than 0 they are empty. */
typedef struct {
  const char *name;
  PetscInt n, ncomp; /* n of all ranks */
  hid_t type;        /* in the file */
  void *data;
  uint64_t salt; /* in the checksum */
} Array;

#define NARRAY 8
#define NCOUNT 4
static const char *const counts[NCOUNT] = {"vertices", "tets", "faces", "curved"};

static void arrays_of(SbMemoryMesh *g, const PetscInt count[NCOUNT], Array a[NARRAY])
{
  a[0] = (Array){"x", count[0], 3, H5T_IEEE_F64LE, g->x, 0};
  a[1] = (Array){"cells", count[1], 4, H5T_STD_I64LE, g->cell, SALT};
  a[2] = (Array){"triangles", count[2], 3, H5T_STD_I64LE, g->tri, 2 * (uint64_t)SALT};
  a[3] = (Array){"vertex_sets", count[0], 1, H5T_STD_U64LE, g->vert_set, 0};
  a[4] = (Array){"cell_sets", count[1], 1, H5T_STD_U64LE, g->cell_set, 0};
  a[5] = (Array){"triangle_sets", count[2], 1, H5T_STD_U64LE, g->tri_set, 0};
  a[6] = (Array){"curved_edges", count[3], 2, H5T_STD_I64LE, g->edge, 3 * (uint64_t)SALT};
  a[7] = (Array){"edge_offsets", count[3], 3, H5T_IEEE_F64LE, g->edge_off, 4 * (uint64_t)SALT};
}

/* Sum of positions and values, so that damage is seen. */
static uint64_t sum_of(const Array array[NARRAY])
{
  uint64_t sum = SALT;

  for (const Array *a = array; a < array + NARRAY; a++) {
    for (PetscInt i = 0; i < a->n * a->ncomp; i++) {
      if (a->type == H5T_STD_U64LE)
        sum += ((uint64_t *)a->data)[i] * (uint64_t)(2 * i + 1);
      else
        sum += SbMixReal((uint64_t)i + a->salt, a->type == H5T_IEEE_F64LE
                                                  ? ((PetscReal *)a->data)[i]
                                                  : (PetscReal)((PetscInt *)a->data)[i]);
    }
  }
  return sum;
}

PetscErrorCode SbCheckpointWriteMeshes(SbRun run, SbH5 *h, uint64_t *sum)
{
  SbOutput out = (SbOutput)run->monitors.output;

  PetscFunctionBeginUser;
  for (const SbBody *body = run->model->body; body < run->model->body + run->model->nbody; body++) {
    SbMemoryMesh *g = body->in_memory;
    PetscInt count[NCOUNT];
    uint64_t own = 0;
    char name[2 * SB_NAME_MAX];
    Array a[NARRAY];
    hid_t group;

    if (!g || !g->step)
      continue;
    memcpy(count, (const PetscInt[NCOUNT]){g->nvert, g->ncell, g->ntri, g->nedge}, sizeof(count));
    PetscCallMPI(MPI_Bcast(count, NCOUNT, MPIU_INT, 0, out->comm));
    arrays_of(g, count, a);
    if (!out->rank)
      own = sum_of(a);
    PetscCallMPI(MPI_Bcast(&own, 1, MPI_UINT64_T, 0, out->comm));
    PetscCall(SbH5Reserve(h, 32 * ((PetscInt64)count[0] + count[2]) +
                               40 * ((PetscInt64)count[1] + count[3]) + 65536));
    SbFormat(sizeof(name), name, "mesh_%s", body->name);
    PetscCall(SbH5GroupCreate(h, NARRAY, 16, &group));
    PetscCall(SbH5PutInt(h, group, "step", g->step));
    PetscCall(SbH5PutReal(h, group, "mass", g->mass));
    PetscCall(SbH5PutReal(h, group, "bound", g->bound));
    PetscCall(SbH5PutInt(h, group, "sum", (int64_t)own));
    for (int k = 0; k < NCOUNT; k++)
      PetscCall(SbH5PutInt(h, group, counts[k], count[k]));
    for (int k = 0; k < NARRAY; k++) {
      const PetscInt N = a[k].n;
      const PetscInt n = out->rank ? 0 : N;
      const SbOrder order = {.N = N, .n = n, .start = N - n};

      if (N)
        PetscCall(
          SbH5WriteSlice(h, group, a[k].name, "SI", &order, a[k].ncomp, a[k].type, a[k].data));
    }
    PetscCall(SbH5GroupLink(h, group, h->file, name));
    (void)H5Gclose(group);
    *sum += own;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh of a body in an open file; NULL when it has none. */
static PetscErrorCode read_mesh(hid_t file, const char *body, SbMemoryMesh **in_memory,
                                PetscBool *ok)
{
  char name[2 * SB_NAME_MAX];
  int64_t step = 0;
  int64_t sum = 0;
  PetscInt count[NCOUNT];
  Array a[NARRAY];
  hid_t group;

  PetscFunctionBeginUser;
  *in_memory = NULL;
  SbFormat(sizeof(name), name, "mesh_%s", body);
  if (!*ok || H5Lexists(file, name, H5P_DEFAULT) <= 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  group = H5Gopen2(file, name, H5P_DEFAULT);
  *ok = (PetscBool)(group >= 0);
  if (!*ok)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* older files have no curved edges */
  for (int k = 0; k < NCOUNT; k++) {
    int64_t n = 0;

    if (k < 3 || H5Aexists(group, counts[k]) > 0)
      SbH5GetInt(group, counts[k], &n, ok);
    *ok = (PetscBool)(*ok && n >= 0 && n < PETSC_MAX_INT / 8);
    count[k] = *ok ? (PetscInt)n : 0;
  }
  SbH5GetInt(group, "step", &step, ok);
  SbH5GetInt(group, "sum", &sum, ok);

  /* counts must agree with the sizes of the datasets before anything is allocated */
  arrays_of(&(SbMemoryMesh){0}, count, a);
  for (int k = 0; k < NARRAY; k++)
    *ok = (PetscBool)(*ok && (!a[k].n || SbH5Rows(group, a[k].name, NULL) == a[k].n));
  if (*ok) {
    PetscCall(SbMemoryMeshCreate(count[0], count[1], count[2], count[3], in_memory));
    (*in_memory)->step = (PetscInt)step;
    SbH5GetReal(group, "mass", &(*in_memory)->mass, ok);
    SbH5GetReal(group, "bound", &(*in_memory)->bound, ok);
    arrays_of(*in_memory, count, a);
    for (int k = 0; k < NARRAY && *ok; k++) {
      if (a[k].n)
        *ok = SbH5Read(group, a[k].name, a[k].type, a[k].n, a[k].ncomp, a[k].data);

      /* check before the mesh is compared: a damaged file is not one of another mesh */
      for (PetscInt i = 0; a[k].type == H5T_STD_I64LE && i < a[k].n * a[k].ncomp && *ok; i++)
        *ok = (PetscBool)(((PetscInt *)a[k].data)[i] >= 0 && ((PetscInt *)a[k].data)[i] < count[0]);
    }
    *ok = (PetscBool)(*ok && (int64_t)sum_of(a) == sum);
    if (!*ok)
      PetscCall(SbMemoryMeshDestroy(in_memory));
  }
  (void)H5Gclose(group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbCheckpointSumMeshes(SbRun run, SbH5 *h, uint64_t *sum, PetscBool *ok)
{
  for (PetscInt b = 0; b < run->model->nbody; b++) {
    char name[2 * SB_NAME_MAX];
    int64_t own = 0;
    hid_t group;

    SbFormat(sizeof(name), name, "mesh_%s", run->model->body[b].name);
    group = SbH5OpenGroup(h->file, name);
    if (group < 0)
      continue;
    SbH5GetInt(group, "sum", &own, ok);
    (void)H5Gclose(group);
    *sum += (uint64_t)own;
  }
}

PetscErrorCode SbOutputRestoreMeshes(SbRun run)
{
  SbOutput out = (SbOutput)run->monitors.output;
  const SbModel m = run->model;
  char path[PETSC_MAX_PATH_LEN], why[PETSC_MAX_PATH_LEN + 256];
  PetscBool ok = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (!out->restart[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  for (;;) {
    PetscCall(SbCheckpointFind(out, path));
    if (!path[0])
      break;

    /* the meshes of that file, on rank 0 */
    if (!out->rank) {
      hid_t file = -1;

      H5E_BEGIN_TRY if (SbH5IsOwn(path, sizeof(why), why)) file =
        H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
      H5E_END_TRY
      ok = (PetscBool)(file >= 0);
      for (PetscInt b = 0; b < m->nbody && file >= 0; b++)
        PetscCall(read_mesh(file, m->body[b].name, &m->body[b].in_memory, &ok));
      if (file >= 0)
        (void)H5Fclose(file);
      for (PetscInt b = 0; b < m->nbody && !ok; b++)
        PetscCall(SbMemoryMeshDestroy(&m->body[b].in_memory));
    }
    PetscCallMPI(MPI_Bcast(&ok, 1, SB_MPI_BOOL, 0, out->comm));
    if (ok || strcmp(out->restart, "latest"))
      break;
    PetscCall(SbWarning(out->comm, SB_SKIPPED, path));
    out->ndamaged++;
  }

  // broadcast which bodies have their own mesh, and its sizes
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCall(SbMemoryMeshShare(out->comm, &m->body[b].in_memory));
  PetscFunctionReturn(PETSC_SUCCESS);
}
