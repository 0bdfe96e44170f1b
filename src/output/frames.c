/*
  fields.h5: one group per frame, one dataset per field, written by all ranks together in original
  order.

  Where a body is of P2, its nodes at edges are points behind the vertices, and each of its cells is
  cut into eight linear tets: one at each corner, and the octahedron between them in four around one
  of its diagonals. With -output_quadratic it is one tet of ten points. With -output_discontinuous
  each cell has points of its own, and /mesh/vertices says which of them coincide.

  A frame gets its name in the file when it is complete (h5.c), and is then listed in the indices
  fields.xmf and fields.vtkhdf. After a restart in the same folder frames up to the restart stay,
  later ones are removed and their space in the file is used again.
*/
#include <ctype.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbgeometry.h"

#define ATTRIBUTE_BYTES 60000 /* HDF5 holds an attribute of up to 64 KB in an object header */

struct _p_SbFrames {
  SbH5 h5;
  hid_t top;             /* /step */
  hid_t node;            /* group of the current hundred frames; negative before the first frame */
  PetscInt nnode, nlink; /* groups of a hundred frames so far; links in the current one */
  PetscInt last_step;    /* of the last frame in the file, or -1 */
  PetscInt mesh; /* of frames that are written: the step after which it was made, 0: the first */
  SbIndex index; /* rank 0 only */
  PetscReal *owned, *slice; /* work: three numbers per point, or those of a field per cell or tet */
};

/* Writes values of points or cells, from fr->owned: each of a cell's tets gets the cell's
   values. */
static PetscErrorCode put(SbOutput out, hid_t where, const char *name, const char *unit,
                          PetscBool cell, PetscInt ncomp, hid_t type)
{
  const SbOrder *order = cell ? &out->tet : &out->point;
  SbFrames fr = out->frames;
  PetscInt n = out->tet.n;

  PetscFunctionBeginUser;
  PetscCall(
    SbForestReduce((cell ? &out->cell : &out->point)->sf, ncomp, MPIU_REAL, fr->owned, fr->slice));

  /* in place, from the end on */
  for (PetscInt i = out->cell.n - 1; cell && out->split && i >= 0; i--) {
    for (int k = 0; k < (out->split[i] ? 8 : 1); k++) {
      n--;
      PetscCall(PetscArraymove(fr->slice + ncomp * n, fr->slice + ncomp * i, ncomp));
    }
  }
  (void)H5Tconvert(H5T_NATIVE_DOUBLE, SbH5TypeInMemory(type), (size_t)order->n * ncomp, fr->slice,
                   NULL, H5P_DEFAULT);
  PetscCall(SbH5WriteSlice(&fr->h5, where, name, unit, order, ncomp, type, fr->slice));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of P2: of the tets at the corners; ends of each diagonal of the octahedron, and the other
   four. */
static const int corner_tet[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};
static const int around[3][6] = {{4, 9, 5, 6, 8, 7}, {5, 8, 7, 9, 6, 4}, {6, 7, 4, 5, 9, 8}};

/* Corner j of tet k of the eight. */
static int child_corner(int diagonal, int k, int j)
{
  if (k < 4)
    return corner_tet[k][j];
  return j < 2 ? around[diagonal][j] : around[diagonal][2 + (k + j - 6) % 4];
}

/* The diagonal whose smallest tet has the largest volume over its length cubed; the shortest if
   straight. */
static int best_diagonal(SbSpace s, PetscInt cell)
{
  PetscReal x[SB_CELL_NODES][3];
  PetscReal best = PETSC_MIN_REAL;
  int found = 0;

  SbSpaceCellPositions(s, cell, x);
  for (int d = 0; d < 3; d++) {
    PetscReal along[3], length;
    PetscReal worst = PETSC_MAX_REAL;

    SbSubtract(x[around[d][0]], x[around[d][1]], along);
    length = PetscSqrtReal(SbDot3(along, along));
    for (int k = 4; k < 8; k++) {
      PetscInt vert[4];

      for (int j = 0; j < 4; j++)
        vert[j] = child_corner(d, k, j);
      worst = PetscMin(worst, SbTetDeterminant(x[0], vert) / (length * length * length));
    }

    // of diagonals equal within rounding the first one
    if (worst > best + 1e-9 * PetscAbsReal(best)) {
      best = worst;
      found = d;
    }
  }
  return found;
}

/* The tets by their points; with points per cell, also the vertex of each. With P2 the ten points
   of its cells in the order of VTK (corners, then the edges 01 12 02 03 13 23), and the cell that
   each tet is part of. */
static PetscErrorCode write_cells(SbRun run, SbOutput out, hid_t group)
{
  static const int to_vtk[SB_CELL_NODES] = {0, 1, 2, 3, 4, 7, 5, 6, 8, 9};
  SbFrames fr = out->frames;
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;
  const PetscInt wide = s->edge_node ? SB_CELL_NODES + 1 : 4;
  const PetscInt ncut = (out->tet.start - out->cell.start) / 7;
  int32_t *corner, *vertex, *ten, *parent;
  int32_t first = (int32_t)(4 * out->cell.start + 6 * ncut);
  PetscInt t = 0;

  PetscFunctionBeginUser;

  /* numbers of vertices, of nodes at edges (-1: the cell has none), and the diagonal (-1: it is one
     tet) */
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal *number = fr->owned + wide * c;
    const PetscBool ten_nodes = (PetscBool)(wide > 4 && SbSpaceCellNode(s, c, 4) >= 0);

    for (PetscInt a = 0; a < 4; a++)
      number[a] = (PetscReal)mesh->vert_orig[mesh->cell[4 * c + a]];
    for (PetscInt a = 4; a < wide; a++)
      number[a] = -1.;
    for (PetscInt a = 4; ten_nodes && a < SB_CELL_NODES; a++)
      number[a] = (PetscReal)out->edge_number[SbSpaceCellNode(s, c, a)];
    if (ten_nodes && !out->quadratic)
      number[SB_CELL_NODES] = best_diagonal(s, c);
  }
  PetscCall(SbForestReduce(out->cell.sf, wide, MPIU_REAL, fr->owned, fr->slice));

  /* the rows of this rank; points of cells are numbered one cell behind the other */
  PetscCall(PetscMalloc4(4 * out->tet.n, &corner, 4 * out->tet.n, &vertex,
                         wide > 4 ? SB_CELL_NODES * out->cell.n : 0, &ten, out->tet.n, &parent));
  for (PetscInt i = 0; i < out->cell.n; i++) {
    const PetscReal *number = fr->slice + wide * i;
    const int n = wide > 4 && number[4] >= 0. ? SB_CELL_NODES : 4;
    const int cut = out->split && out->split[i];
    int32_t point[SB_CELL_NODES];

    for (int a = 0; a < n; a++)
      point[a] = out->discontinuous ? first + a : (int32_t)number[a];
    for (int a = n; a < SB_CELL_NODES; a++)
      point[a] = -1;
    first += n;
    for (int a = 0; a < SB_CELL_NODES && wide > 4; a++)
      ten[SB_CELL_NODES * i + a] = point[to_vtk[a]];
    for (int k = 0; k < (cut ? 8 : 1); k++) {
      for (int j = 0; j < 4; j++) {
        const int a = cut ? child_corner((int)number[SB_CELL_NODES], k, j) : j;

        corner[4 * t + j] = point[a];
        vertex[4 * t + j] = (int32_t)number[a];
      }
      parent[t++] = (int32_t)(out->cell.start + i);
    }
  }
  if (out->discontinuous)
    PetscCall(SbH5WriteSlice(&fr->h5, group, "vertices", "1", &out->tet, 4, H5T_STD_I32LE, vertex));
  PetscCall(SbH5WriteSlice(&fr->h5, group, "cells", "1", &out->tet, 4, H5T_STD_I32LE, corner));
  if (wide > 4)
    PetscCall(SbH5WriteSlice(&fr->h5, group, "cells10", "1", &out->cell, SB_CELL_NODES,
                             H5T_STD_I32LE, ten));
  if (wide > 4 && !out->quadratic)
    PetscCall(SbH5WriteSlice(&fr->h5, group, "parent", "1", &out->tet, 1, H5T_STD_I32LE, parent));
  PetscCall(PetscFree4(corner, vertex, ten, parent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Indicator, 0 or 1, of one set: at points, and of tets if it has any. */
static PetscErrorCode write_set(SbRun run, SbOutput out, PetscInt k, hid_t group)
{
  const SbMesh mesh = run->model->mesh;
  char name[SB_NAME_MAX + 8];

  PetscFunctionBeginUser;
  for (int cell = 0; cell < (mesh->set[k].ncell ? 2 : 1); cell++) {
    /* "set_fat_tissue": characters special in paths or XML become underscores */
    SbFormat(sizeof(name), name, "%s_%s", cell ? "tets" : "set", mesh->set[k].name);
    for (char *p = name; *p; p++)
      if (!isalnum((unsigned char)*p) && !strchr("_-.", *p))
        *p = '_';
    if (H5Lexists(group, name, H5P_DEFAULT) > 0)
      PetscFunctionReturn(
        PETSC_SUCCESS); /* another set has this name: "fat tissue" and "fat_tissue" */
    for (PetscInt i = 0; i < (cell ? mesh->ncell_owned : out->point.nowned); i++) {
      const SbPlace at = cell ? (SbPlace){-1, -1, -1} : SbPointsPlace(run, out, i);
      uint64_t sets;

      if (cell)
        sets = mesh->cell_set[i];
      else if (at.node >= 0)
        sets = run->model->space->node_set[at.node];
      else
        sets = mesh->vert_set[at.vertex];
      out->frames->owned[i] = (sets & SB_SET_BIT(k)) != 0;
    }
    PetscCall(put(out, group, name, "1", (PetscBool)cell, 1, H5T_STD_I32LE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode write_mesh(SbRun run, SbOutput out)
{
  SbFrames fr = out->frames;
  char name[SB_MESH_NAME], *names;
  hid_t group;
  const size_t size = (size_t)run->model->nbody * SB_NAME_MAX + 1;

  PetscFunctionBeginUser;
  SbOutputMeshName(fr->mesh, name);

  /* a run that was restarted before a re-meshing repeats it: its mesh is replaced */
  if (H5Lexists(fr->h5.file, name, H5P_DEFAULT) > 0)
    (void)H5Ldelete(fr->h5.file, name, H5P_DEFAULT);

  /* disk space for points and cells */
  PetscCall(SbH5Reserve(&fr->h5, (PetscInt64)out->point.N * 24 + (PetscInt64)out->tet.N * 40 +
                                   (out->edge_number ? (PetscInt64)out->cell.N * 40 : 0) + 65536));
  PetscCall(SbH5GroupCreate(&fr->h5, 8, 8, &group));
  PetscCall(SbH5PutInt(&fr->h5, group, "hash", (int64_t)out->mesh_hash));

  /* the bodies that the numbers of /mesh/body stand for: "liver,stone"; an attribute, or a dataset
     where they are too long for one */
  PetscCall(PetscCalloc1(size, &names));
  for (PetscInt b = 0; b < run->model->nbody; b++)
    SbAppend(size, names, "%s%s", b ? "," : "", run->model->body[b].name);
  if (strlen(names) < ATTRIBUTE_BYTES)
    PetscCall(SbH5PutText(&fr->h5, group, "bodies", names));
  else
    PetscCall(SbH5WriteText(&fr->h5, group, "bodies", names));
  PetscCall(PetscFree(names));

  /* points at rest, and cells */
  for (PetscInt i = 0; i < out->point.nowned; i++)
    PetscCall(PetscArraycpy(fr->owned + 3 * i, SbPointsRest(run, out, i), 3));
  PetscCall(put(out, group, "x", "m", PETSC_FALSE, 3, H5T_IEEE_F64LE));
  PetscCall(write_cells(run, out, group));

  /* fields that do not change in a run: numbers of bodies and ranks, sets */
  for (PetscInt i = 0; i < out->nfield; i++) {
    if (!out->field[i]->constant)
      continue;
    PetscCall(PetscLogEventBegin(out->field_event[i], 0, 0, 0, 0));
    if (out->field[i]->compute) {
      PetscCall(out->field[i]->compute(out->field[i], run, NULL, fr->owned));
      PetscCall(put(out, group, out->field[i]->name, "1", PETSC_TRUE, 1, H5T_STD_I32LE));
    } else {
      /* sets: one array each */
      PetscCall(SbH5Reserve(&fr->h5, (PetscInt64)run->model->mesh->nset *
                                       (4 * ((PetscInt64)out->point.N + out->tet.N) + 8192)));
      for (PetscInt k = 0; k < run->model->mesh->nset; k++)
        PetscCall(write_set(run, out, k, group));
    }
    PetscCall(PetscLogEventEnd(out->field_event[i], 0, 0, 0, 0));
  }

  /* the complete mesh gets its name */
  PetscCall(SbH5GroupLink(&fr->h5, group, fr->h5.file, name));
  (void)H5Gclose(group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a frame of the file, with the fields that it has, to the indices. All ranks read, as HDF5
   wants its metadata used alike on all. */
static PetscErrorCode list_frame(SbOutput out, hid_t group, const char *path)
{
  SbArray array[SB_FIELD_MAX];
  PetscReal time = 0.;
  PetscBool ok = PETSC_TRUE;
  PetscInt bytes;
  PetscInt n = 0;
  PetscInt nfield;
  const SbField *fields = SbFieldGetAll(&nfield);

  PetscFunctionBeginUser;
  SbH5GetReal(group, "time", &time, &ok);
  if (!ok)
    PetscFunctionReturn(PETSC_SUCCESS); /* the frame is damaged */
  for (const SbField *f = fields; f < fields + nfield; f++) {
    (void)SbH5Rows(group, f->name, &bytes);
    if (bytes)
      array[n++] =
        (SbArray){.name = f->name, .ncomp = (int)f->ncomp, .bytes = (int)bytes, .cell = f->cell};
  }
  if (out->frames->index)
    PetscCall(SbIndexAdd(out->frames->index, time, path, 0, n, array));
  PetscCall(SbContactsList(out, group, time, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode monitor(SbRun run, const SbStep *step, void *ctx)
{
  SbOutput out = (SbOutput)ctx;
  SbFrames fr = out->frames;
  PetscInt64 room;
  char path[48];
  char message[SB_MESSAGE_MAX] = "";
  char name[16], hundred[16];

  /* along an arc length the load factor may fall, viewers expect times that rise: the step is the
     time */
  const PetscReal time = run->state.path ? (PetscReal)step->step : step->t;
  const PetscBool full = (PetscBool)(fr->node < 0 || fr->nlink == SB_H5_NODE_LINKS);
  hid_t group;

  PetscFunctionBeginUser;

  /* frames at intervals of time or of steps, at the start and at the end */
  if (step->step != run->clock.step0 && !step->last &&
      (out->every > 0. ? !SbOutputDue(out->every, step->t, step->dt)
                       : step->step % out->every_steps))
    PetscFunctionReturn(PETSC_SUCCESS);

  /* after a restart the first frame may be in the file */
  if (fr->last_step >= step->step)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogStagePush(SbLogStageOutput));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(out->event.fields, 0, 0, 0, 0));

  /* reserve disk space for the frame and its metadata: a full disk is an error before anything is
     written */
  PetscCall(SbContactsFind(run, out, step, &room));
  room += 65536 + 8192 * out->nfield;
  for (PetscInt i = 0; i < out->nfield; i++)
    room += (PetscInt64)(out->field[i]->cell ? out->tet.N : out->point.N) * out->field[i]->ncomp *
            (out->precise ? 8 : 4);
  PetscCall(SbH5Reserve(&fr->h5, room));

  /* an anonymous group, linked under its name when it is complete, with its time */
  PetscCall(SbH5GroupCreate(&fr->h5, (unsigned)out->nfield + 1, 14, &group));
  PetscCall(SbH5PutReal(&fr->h5, group, "time", time));
  if (run->state.path)
    PetscCall(SbH5PutReal(&fr->h5, group, "load_factor", step->t));
  PetscCall(SbH5PutInt(&fr->h5, group, "step", step->step));
  if (fr->mesh)
    PetscCall(SbH5PutInt(&fr->h5, group, "mesh", fr->mesh));

  /* the fields, and the points of contact */
  out->state_valid = out->nodal_valid = PETSC_FALSE;
  for (PetscInt i = 0; i < out->nfield; i++) {
    const SbField *f = out->field[i];

    if (f->constant)
      continue;
    PetscCall(PetscLogEventBegin(out->field_event[i], 0, 0, 0, 0));
    PetscCall(f->compute(f, run, step, fr->owned));
    PetscCall(put(out, group, f->name, f->unit, f->cell, f->ncomp,
                  out->precise ? H5T_IEEE_F64LE : H5T_IEEE_F32LE));
    PetscCall(PetscLogEventEnd(out->field_event[i], 0, 0, 0, 0));
  }
  PetscCall(SbContactsWrite(out, &fr->h5, group));

  /* the frame gets its name, and then its entry in the index */
  (void)snprintf(name, sizeof(name), "%06" PetscInt_FMT, step->step);
  if (full) {
    if (fr->node >= 0)
      (void)H5Gclose(fr->node);
    PetscCall(SbH5GroupCreate(&fr->h5, SB_H5_NODE_LINKS, 6, &fr->node));
    PetscCall(SbH5GroupLink(&fr->h5, group, fr->node, name));
    fr->nnode++;
    fr->nlink = 0;
  }
  (void)snprintf(hundred, sizeof(hundred), "%04" PetscInt_FMT, fr->nnode - 1);
  PetscCall(SbH5Flush(&fr->h5)); /* all data on disk before the link */
  if (full)
    PetscCall(SbH5GroupLink(&fr->h5, fr->node, fr->top, hundred));
  else
    PetscCall(SbH5GroupLink(&fr->h5, group, fr->node, name));
  PetscCall(SbH5Flush(&fr->h5));
  fr->nlink++;
  (void)snprintf(path, sizeof(path), "/step/%s/%s", hundred, name);
  fr->last_step = step->step;
  PetscCall(list_frame(out, group, path));
  (void)H5Gclose(group);
  SbIndexWrite(fr->index, step->last, message);
  SbIndexWrite(out->contact_index, step->last, message);
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscCall(PetscLogEventEnd(out->event.fields, 0, 0, 0, 0));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscCall(PetscLogStagePop());
  if (step->last)
    PetscCall(SbFramesClose(out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an open file of frames has this run's mesh as that of a step. */
static PetscBool has_mesh(SbOutput out, hid_t file, PetscInt step)
{
  PetscBool ok = PETSC_TRUE;
  int64_t hash = 0;
  char name[SB_MESH_NAME];
  const hid_t mesh = SbH5OpenGroup(file, SbOutputMeshName(step, name));

  if (mesh < 0)
    return PETSC_FALSE;
  SbH5GetInt(mesh, "hash", &hash, &ok);
  (void)H5Gclose(mesh);
  return (PetscBool)(ok && (uint64_t)hash == out->mesh_hash);
}

/* The step of this run's mesh in an open file: that of its last re-meshing, or 0; ok: the file has
   it. */
static PetscInt find_mesh(SbRun run, SbOutput out, hid_t file, PetscBool *ok)
{
  const PetscInt step = has_mesh(out, file, SbOutputMeshStep(run)) ? SbOutputMeshStep(run) : 0;

  *ok = has_mesh(out, file, step);
  return step;
}

/* The frames of a file. */
typedef struct {
  struct {
    PetscInt step; /* sorted by it */
    char group[48];
  } * frame; /* [n] */
  PetscInt n, size, nhundred;
  PetscErrorCode ierr;
} List;

/* Adds a frame: a group in that of a hundred, named by its step. */
static herr_t add_frame(hid_t top, const char *name, const H5L_info_t *info, void *ctx)
{
  List *l = (List *)ctx;
  const char *slash = strchr(name, '/');

  (void)top, (void)info;
  l->nhundred += !slash;
  if (!slash || strchr(slash + 1, '/'))
    return 0;
  l->ierr = SbReserve(l->n + 1, sizeof(*l->frame), &l->size, &l->frame);
  if (l->ierr)
    return -1;
  l->frame[l->n].step = (PetscInt)strtol(slash + 1, NULL, 10);
  SbFormat(sizeof(l->frame->group), l->frame[l->n++].group, "/step/%s", name);
  return 0;
}

/* A file that cannot be continued stays, under another name; one that is not there, though the
   checkpoint is, is said to be lost. Collective. */
static PetscErrorCode keep_aside(SbRun run, SbOutput out, const char *path)
{
  const char *slash = strrchr(out->restart, '/');
  char other[SB_OTHER_MAX], checkpoint[PETSC_MAX_PATH_LEN];
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  SbOutputPath(out, slash ? slash + 1 : out->restart, checkpoint);
  if (!out->rank && run->clock.step0 && access(path, F_OK) &&
      (!strcmp(out->restart, "latest") || !access(checkpoint, F_OK)))
    PetscCall(SbWarning(PETSC_COMM_SELF,
                        "there is no %s with the frames up to step %" PetscInt_FMT
                        ", where the run goes on: frames go on in a new file",
                        path, run->clock.step0));
  if (!out->rank && !access(path, F_OK)) {
    SbFileKeep(path, run->clock.step0, other, message);
    if (!message[0])
      PetscCall(SbWarning(PETSC_COMM_SELF,
                          "%s is damaged, truncated or of another mesh: kept as %s; frames go on "
                          "in a new file, from step %" PetscInt_FMT,
                          path, other, run->clock.step0));
  }
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens the file of the run that is continued; ok is false when there is none, or one that is
   damaged or of another mesh. */
static PetscErrorCode resume(SbRun run, SbOutput out, const char *path, PetscBool *ok)
{
  SbFrames fr = out->frames;
  List l = {0};
  PetscInt k = 0;
  int64_t mesh = 0;   /* mesh of a frame, as in fr->mesh */
  int64_t shown = -1; /* and of the one before */
  PetscBool other;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;

  /* the file must have this mesh and frames */
  PetscCall(SbH5Open(out->comm, path, PETSC_TRUE, &fr->h5, ok));
  if (!*ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  fr->mesh = find_mesh(run, out, fr->h5.file, ok);
  if (*ok)
    fr->top = SbH5OpenGroup(fr->h5.file, "step");
  *ok = (PetscBool)(fr->top >= 0);
  if (!*ok) {
    PetscCall(SbH5Close(&fr->h5));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* its frames; damage in their lists is seen before anything is written */
  *ok = (PetscBool)(H5Lvisit(fr->top, H5_INDEX_NAME, H5_ITER_INC, add_frame, &l) >= 0);
  PetscCall(l.ierr);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, out->comm));
  if (!*ok) {
    PetscCall(PetscFree(l.frame));
    PetscCall(SbFramesClose(out));
    fr->top = -1;
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* the index has those up to the restart, so that it never lists a frame that is removed */
  PetscCall(SbSortByKeys(l.n, sizeof(*l.frame), 1, l.frame));
  fr->nnode = l.nhundred;
  for (; k < l.n && l.frame[k].step <= run->clock.step0; k++, shown = mesh) {
    const hid_t group = H5Gopen2(fr->h5.file, l.frame[k].group, H5P_DEFAULT);

    fr->last_step = l.frame[k].step;
    if (group < 0) {
      PetscCall(SbWarning(out->comm,
                          "%s is damaged: the frame of step %" PetscInt_FMT " cannot be read", path,
                          l.frame[k].step));
      continue;
    }
    mesh = 0;
    SbH5GetInt(group, "mesh", &mesh, &other);
    if (fr->index && mesh != shown)
      PetscCall(SbIndexSetMesh(fr->index, fr->h5.file, (PetscInt)mesh));
    PetscCall(list_frame(out, group, l.frame[k].group));
    (void)H5Gclose(group);
  }
  if (fr->index && shown != fr->mesh)
    PetscCall(SbIndexSetMesh(fr->index, fr->h5.file, fr->mesh));
  SbIndexWrite(fr->index, PETSC_TRUE, message);
  SbIndexWrite(out->contact_index, PETSC_TRUE, message);
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));

  /* then later frames are removed */
  for (; k < l.n; k++)
    (void)H5Ldelete(fr->h5.file, l.frame[k].group, H5P_DEFAULT);
  PetscCall(PetscFree(l.frame));
  PetscCall(SbH5Flush(&fr->h5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesCheck(SbRun run, SbOutput out)
{
  SbH5 h;
  char path[PETSC_MAX_PATH_LEN];
  PetscBool ok, corners, edges, linear;

  PetscFunctionBeginUser;
  if (!out->nfield)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbOutputPath(out, "fields.h5", path);
  PetscCall(SbH5Open(out->comm, path, PETSC_FALSE, &h, &ok));
  if (!ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  (void)find_mesh(run, out, h.file, &ok);
  corners = (PetscBool)(ok && H5Lexists(h.file, "mesh/vertices", H5P_DEFAULT) > 0);
  linear = (PetscBool)(ok && H5Lexists(h.file, "mesh/parent", H5P_DEFAULT) > 0);
  edges = (PetscBool)(ok && !linear && H5Lexists(h.file, "mesh/cells10", H5P_DEFAULT) > 0);
  PetscCall(SbH5Close(&h));

  /* a file of another mesh is replaced, one of this mesh continued */
  PetscCheck(
    !ok || corners == out->discontinuous, out->comm, PETSC_ERR_USER_INPUT,
    "-output_discontinuous is %s, but the frames in %s were written with %s: go on with the same, "
    "or give another -output_dir",
    out->discontinuous ? "true" : "false", path, corners ? "true" : "false");
  PetscCheck(!ok || (edges == out->quadratic && linear == (out->edge_number && !edges)), out->comm,
             PETSC_ERR_USER_INPUT,
             "-output_quadratic is %s, but the frames in %s have tets of p2 otherwise: go on with "
             "the same, or "
             "give another -output_dir",
             out->quadratic ? "true" : "false", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesAttach(SbRun run, SbOutput out)
{
  static const PetscReal origin[3] = {0., 0., 0.};
  const SbMesh mesh = run->model->mesh;
  char path[PETSC_MAX_PATH_LEN];
  SbFrames fr = out->frames;
  PetscBool has = PETSC_FALSE; /* the file has the mesh */
  PetscInt most = 1;           /* components of a cell field */
  PetscInt nvalue = 3;         /* and of a point field */
  PetscInt wide;               /* points of a cell */

  PetscFunctionBeginUser;
  if (!out->nfield)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbOutputOrder(run, out));

  /* the index, on rank 0; a file that is continued, or a new one without an index until it has a
     frame */
  if (fr) {
    has = has_mesh(out, fr->h5.file, fr->mesh);
    if (!has)
      fr->mesh = run->clock.step0; /* beside the earlier ones */
  } else {
    PetscCall(PetscNew(&fr));
    *fr = (struct _p_SbFrames){.h5.file = -1, .top = -1, .node = -1, .last_step = -1};
    out->frames = fr;
    if (!out->rank)
      PetscCall(SbIndexCreate(out, "fields", NULL, &fr->index));

    // after a restart frames that are kept may have contact points, which stay in the index
    if (!out->rank && (out->contact_points || out->restart[0]))
      PetscCall(
        SbIndexCreate(out, "contacts", mesh->nvert ? mesh->x : origin, &out->contact_index));
    SbOutputPath(out, "fields.h5", path);
    if (out->restart[0])
      PetscCall(resume(run, out, path, &has));
    if (!has) {
      fr->mesh = fr->nnode = 0;
      fr->last_step = -1;
      if (out->restart[0])
        PetscCall(keep_aside(run, out, path));
      PetscCall(SbH5Create(out->comm, path, &fr->h5));
      PetscCall(SbH5PutText(&fr->h5, fr->h5.file, "program", "supple " SB_VERSION));
    }
  }

  /* work arrays and monitor for the mesh, which is written if it is new */
  for (PetscInt i = 0; i < out->nfield; i++) {
    if (out->field[i]->cell)
      most = PetscMax(most, out->field[i]->ncomp);
    else
      nvalue = PetscMax(nvalue, out->field[i]->ncomp);
    PetscCall(SbFieldPrepare(run, out, out->field[i]));
  }
  wide = PetscMax(most, out->edge_number ? SB_CELL_NODES + 1 : 4);
  PetscCall(PetscFree2(fr->owned, fr->slice));
  PetscCall(PetscMalloc2(
    PetscMax(nvalue * out->point.nowned, wide * out->cell.nowned), &fr->owned,
    PetscMax(PetscMax(nvalue * out->point.n, wide * out->cell.n), most * out->tet.n), &fr->slice));
  if (out->contact_points)
    run->monitors.want_residual = PETSC_TRUE;
  if (!has) {
    PetscCall(write_mesh(run, out));
    if (fr->top < 0) {
      PetscCall(SbH5GroupCreate(&fr->h5, SB_H5_NODE_LINKS, 4, &fr->top));
      PetscCall(SbH5GroupLink(&fr->h5, fr->top, fr->h5.file, "step"));
    }
    PetscCall(SbH5Flush(&fr->h5));
    if (fr->index)
      PetscCall(SbIndexSetMesh(fr->index, fr->h5.file, fr->mesh));
  }
  PetscCall(SbRunAddMonitor(run, monitor, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesClose(SbOutput out)
{
  SbFrames fr = out->frames;

  PetscFunctionBeginUser;
  if (!fr || fr->h5.file < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (fr->node >= 0)
    (void)H5Gclose(fr->node);
  if (fr->top >= 0)
    (void)H5Gclose(fr->top);
  PetscCall(SbH5Close(&fr->h5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesDestroy(SbOutput out)
{
  PetscFunctionBeginUser;
  if (!out->frames)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbFramesClose(out));
  PetscCall(SbIndexDestroy(&out->frames->index));
  PetscCall(SbIndexDestroy(&out->contact_index));
  PetscCall(PetscFree(out->contacts.list.point));
  PetscCall(PetscFree(out->contacts.point));
  PetscCall(PetscFree2(out->frames->owned, out->frames->slice));
  PetscCall(PetscFree(out->frames));
  PetscFunctionReturn(PETSC_SUCCESS);
}
