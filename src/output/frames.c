/*
  fields.h5: one group per frame, one dataset per field, written by all ranks together in original order.

  Where a body is of P2, its nodes at edges are points behind the vertices, and each of its cells is cut into eight linear tets: one at each corner, and the octahedron between them in four around one
  of its diagonals. With -output_quadratic it is one tet of ten points. With -output_discontinuous each cell has points of its own, and /mesh/vertices says which of them coincide.

  A frame gets its name in the file when it is complete (h5.c), and is then listed in the indices fields.xmf and fields.vtkhdf. After a restart in
  the same folder frames up to the restart stay, later ones are removed and their space in the file is used again.
*/
#include <ctype.h>
#include "output_impl.h"
#include "sbgeometry.h"

typedef struct {
  PetscReal time;
  PetscInt step;
  char group[48];
  PetscInt nfield;
  const SbField *field[SB_FIELD_MAX];
  PetscInt bytes[SB_FIELD_MAX];
  PetscInt npoint, point_bytes; /* contact points, -1: not written; bytes of their numbers */
  PetscInt mesh;                /* step after which its mesh was made, 0: the first one */
} SbFrame;

struct _p_SbFrames {
  SbH5 h5;
  hid_t top;             /* /step */
  hid_t node;            /* group of the current hundred frames; negative before the first frame */
  PetscInt nnode, nlink; /* groups of a hundred frames so far; links in the current one */
  PetscInt last_step;    /* of the last frame in the file, or -1 */
  PetscInt nframe;
  PetscInt mesh;            /* of frames that are written, as in SbFrame */
  SbIndex index;            /* rank 0 only */
  PetscReal *owned, *slice; /* work: three numbers per point, or those of a field per cell or tet */
  void *packed;             /* slice in the type of the file; NULL when that is double */
};

/* ------------------------------------------------------------------ the mesh */

static void mesh_name(PetscInt step, size_t size, char name[])
{
  if (step)
    SbFormat(size, name, "mesh_%06" PetscInt_FMT, step);
  else
    SbFormat(size, name, "mesh");
}

/* Values of points or cells from fr->owned to rows of the file, in fr->slice: each of a cell's tets gets the cell's values. */
static PetscErrorCode gather(SbOutput out, PetscBool cell, PetscInt ncomp)
{
  SbFrames fr = out->frames;
  PetscInt n = out->tet.n;

  PetscFunctionBeginUser;
  PetscCall(SbOrderGather(cell ? &out->cell : &out->point, ncomp, fr->owned, fr->slice));
  /* in place, from the end on */
  for (PetscInt i = out->cell.n - 1; cell && out->split && i >= 0; i--) {
    for (int k = 0; k < (out->split[i] ? 8 : 1); k++) {
      n--;
      PetscCall(PetscArraymove(fr->slice + ncomp * n, fr->slice + ncomp * i, ncomp));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A constant integer per point or cell. */
static PetscErrorCode write_whole(SbOutput out, hid_t where, const char *name, PetscBool cell)
{
  const SbOrder *order = cell ? &out->tet : &out->point;
  SbFrames fr = out->frames;
  int32_t *whole;

  PetscFunctionBeginUser;
  PetscCall(gather(out, cell, 1));
  PetscCall(PetscMalloc1(order->n, &whole));
  for (PetscInt i = 0; i < order->n; i++) whole[i] = (int32_t)fr->slice[i];
  PetscCall(SbH5WriteSlice(&fr->h5, where, name, "1", order, 1, H5T_STD_I32LE, H5T_NATIVE_INT32, whole));
  PetscCall(PetscFree(whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of P2: of the tets at the corners of a cell; the ends of each diagonal of the octahedron between them, and the other four. */
static const int corner_tet[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};
static const int around[3][6] = {{4, 9, 5, 6, 8, 7}, {5, 8, 7, 9, 6, 4}, {6, 7, 4, 5, 9, 8}};

/* Corner j of tet k of the eight. */
static int child_corner(int diagonal, int k, int j)
{
  if (k < 4) return corner_tet[k][j];
  return j < 2 ? around[diagonal][j] : around[diagonal][2 + (k + j - 6) % 4];
}

/* The diagonal whose smallest tet has the largest volume over the diagonal's length, at rest. In straight cells volumes are equal: the shortest. */
static int best_diagonal(SbSpace s, PetscInt cell)
{
  PetscReal x[SB_CELL_NODES][3], best = PETSC_MIN_REAL;
  int found = 0;

  SbSpaceCellPositions(s, cell, x);
  for (int d = 0; d < 3; d++) {
    const PetscReal *p = x[around[d][0]], *q = x[around[d][1]];
    const PetscReal length =
      PetscSqrtReal(PetscSqr(p[0] - q[0]) + PetscSqr(p[1] - q[1]) + PetscSqr(p[2] - q[2]));
    PetscReal worst = PETSC_MAX_REAL;

    for (int k = 4; k < 8; k++) {
      PetscInt vert[4];

      for (int j = 0; j < 4; j++) vert[j] = child_corner(d, k, j);
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

/*
  The tets by their points; with points per cell, also the vertex of each. With P2 the ten points of its cells in the order of VTK (corners, then the edges 01 12 02 03 13 23), and
  the cell that each tet is part of.
*/
static PetscErrorCode write_cells(SbRun run, SbOutput out, hid_t group)
{
  static const int to_vtk[SB_CELL_NODES] = {0, 1, 2, 3, 4, 7, 5, 6, 8, 9};
  SbFrames fr = out->frames;
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;
  const PetscInt wide = s->edge_node ? SB_CELL_NODES + 1 : 4, ncut = (out->tet.start - out->cell.start) / 7;
  int32_t *corner, *vertex, *ten, *parent, first = (int32_t)(4 * out->cell.start + 6 * ncut);
  PetscInt t = 0;

  PetscFunctionBeginUser;
  /* numbers of vertices, of nodes at edges (-1: the cell has none), and the diagonal (-1: it is one tet) */
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal *number = fr->owned + wide * c;
    const PetscBool ten_nodes = (PetscBool)(wide > 4 && SbSpaceCellNode(s, c, 4) >= 0);

    for (PetscInt a = 0; a < wide; a++)
      number[a] = a < 4                            ? (PetscReal)mesh->vert_orig[mesh->cell[4 * c + a]]
                  : ten_nodes && a < SB_CELL_NODES ? (PetscReal)out->edge_number[SbSpaceCellNode(s, c, a)]
                                                   : -1.;
    if (ten_nodes && !out->quadratic) number[SB_CELL_NODES] = best_diagonal(s, c);
  }
  PetscCall(SbOrderGather(&out->cell, wide, fr->owned, fr->slice));

  /* the rows of this rank; points of cells are numbered one cell behind the other */
  PetscCall(PetscMalloc4(4 * out->tet.n, &corner, 4 * out->tet.n, &vertex,
                         wide > 4 ? SB_CELL_NODES * out->cell.n : 0, &ten, out->tet.n, &parent));
  for (PetscInt i = 0; i < out->cell.n; i++) {
    const PetscReal *number = fr->slice + wide * i;
    const int n = wide > 4 && number[4] >= 0. ? SB_CELL_NODES : 4, cut = out->split && out->split[i];
    int32_t point[SB_CELL_NODES];

    for (int a = 0; a < SB_CELL_NODES; a++)
      point[a] = a >= n ? -1 : out->discontinuous ? first + a : (int32_t)number[a];
    first += n;
    for (int a = 0; a < SB_CELL_NODES && wide > 4; a++) ten[SB_CELL_NODES * i + a] = point[to_vtk[a]];
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
    PetscCall(
      SbH5WriteSlice(&fr->h5, group, "vertices", "1", &out->tet, 4, H5T_STD_I32LE, H5T_NATIVE_INT32, vertex));
  PetscCall(
    SbH5WriteSlice(&fr->h5, group, "cells", "1", &out->tet, 4, H5T_STD_I32LE, H5T_NATIVE_INT32, corner));
  if (wide > 4)
    PetscCall(SbH5WriteSlice(&fr->h5, group, "cells10", "1", &out->cell, SB_CELL_NODES, H5T_STD_I32LE,
                             H5T_NATIVE_INT32, ten));
  if (wide > 4 && !out->quadratic)
    PetscCall(
      SbH5WriteSlice(&fr->h5, group, "parent", "1", &out->tet, 1, H5T_STD_I32LE, H5T_NATIVE_INT32, parent));
  PetscCall(PetscFree4(corner, vertex, ten, parent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reference positions of the points. */
static PetscErrorCode write_points(SbRun run, SbOutput out, hid_t group)
{
  SbFrames fr = out->frames;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < out->point.nowned; i++)
    PetscCall(PetscArraycpy(fr->owned + 3 * i, SbPointsRest(run, out, i), 3));
  PetscCall(gather(out, PETSC_FALSE, 3));
  PetscCall(
    SbH5WriteSlice(&fr->h5, group, "x", "m", &out->point, 3, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, fr->slice));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "set_fat_tissue": characters special in paths or XML become underscores. */
static void array_of_set(const char *prefix, const char *set, size_t size, char name[])
{
  SbFormat(size, name, "%s_%s", prefix, set);
  for (char *p = name; *p; p++)
    if (!isalnum((unsigned char)*p) && !strchr("_-.", *p)) *p = '_';
}

/* Indicator, 0 or 1, of one set: at points, and of tets if it has any. */
static PetscErrorCode write_set(SbRun run, SbOutput out, PetscInt k, hid_t group)
{
  SbFrames fr = out->frames;
  const SbMesh mesh = run->model->mesh;
  char name[SB_NAME_MAX + 8];

  PetscFunctionBeginUser;
  array_of_set("set", mesh->set[k].name, sizeof(name), name);
  if (H5Lexists(group, name, H5P_DEFAULT) > 0)
    PetscFunctionReturn(PETSC_SUCCESS); /* another set has this name: "fat tissue" and "fat_tissue" */
  for (PetscInt i = 0; i < out->point.nowned; i++) {
    const SbPlace at = SbPointsPlace(run, out, i);

    fr->owned[i] =
      ((at.node < 0 ? mesh->vert_set[at.vertex] : run->model->space->node_set[at.node]) & SB_SET_BIT(k)) != 0;
  }
  PetscCall(write_whole(out, group, name, PETSC_FALSE));
  if (!mesh->set[k].ncell) PetscFunctionReturn(PETSC_SUCCESS);
  array_of_set("tets", mesh->set[k].name, sizeof(name), name);
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) fr->owned[c] = (mesh->cell_set[c] & SB_SET_BIT(k)) != 0;
  PetscCall(write_whole(out, group, name, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode write_mesh(SbRun run, SbOutput out)
{
  SbFrames fr = out->frames;
  char name[32];
  hid_t group;
  char *names;
  const size_t size = (size_t)run->model->nbody * SB_NAME_MAX + 1;

  PetscFunctionBeginUser;
  mesh_name(fr->mesh, sizeof(name), name);
  /* a run that was restarted before a re-meshing repeats it: its mesh is replaced */
  if (H5Lexists(fr->h5.file, name, H5P_DEFAULT) > 0) (void)H5Ldelete(fr->h5.file, name, H5P_DEFAULT);

  /* reserve disk space, then write points and cells */
  PetscCall(SbH5Reserve(&fr->h5, (PetscInt64)out->point.N * 24 + (PetscInt64)out->tet.N * 40 +
                                   (out->place ? (PetscInt64)out->cell.N * 40 : 0) + 65536));
  PetscCall(SbH5GroupCreate(&fr->h5, 8, 8, &group));
  PetscCall(SbH5PutInt(&fr->h5, group, "hash", (int64_t)out->mesh_hash));

  /* the bodies that the numbers of /mesh/body stand for: "liver,stone" */
  PetscCall(PetscCalloc1(size, &names));
  for (PetscInt b = 0; b < run->model->nbody; b++)
    SbAppend(size, names, "%s%s", b ? "," : "", run->model->body[b].name);
  PetscCall(SbH5PutText(&fr->h5, group, "bodies", names));
  PetscCall(PetscFree(names));
  PetscCall(write_points(run, out, group));
  PetscCall(write_cells(run, out, group));

  /* fields that do not change in a run: numbers of bodies and ranks, sets */
  for (PetscInt i = 0; i < out->nfield; i++) {
    if (!out->field[i]->constant) continue;
    PetscCall(PetscLogEventBegin(out->field_event[i], 0, 0, 0, 0));
    if (out->field[i]->compute) {
      PetscCall(out->field[i]->compute(out->field[i], run, NULL, fr->owned));
      PetscCall(write_whole(out, group, out->field[i]->name, PETSC_TRUE));
    } else {
      /* sets: one array each */
      PetscCall(SbH5Reserve(&fr->h5, (PetscInt64)run->model->mesh->nset *
                                       (4 * ((PetscInt64)out->point.N + out->tet.N) + 8192)));
      for (PetscInt k = 0; k < run->model->mesh->nset; k++) PetscCall(write_set(run, out, k, group));
    }
    PetscCall(PetscLogEventEnd(out->field_event[i], 0, 0, 0, 0));
  }

  /* the complete mesh gets its name */
  PetscCall(SbH5GroupLink(&fr->h5, group, fr->h5.file, name));
  (void)H5Gclose(group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ a frame */

/* One field of the frame, in the order and precision of the file. */
static PetscErrorCode write_field(SbRun run, SbOutput out, const SbStep *step, const SbField *f, hid_t group)
{
  SbFrames fr = out->frames;
  const SbOrder *order = f->cell ? &out->tet : &out->point;
  const PetscInt n = order->n * f->ncomp;

  PetscFunctionBeginUser;
  PetscCall(f->compute(f, run, step, fr->owned));
  PetscCall(gather(out, f->cell, f->ncomp));
  if (out->precise) {
    PetscCall(SbH5WriteSlice(&fr->h5, group, f->name, f->unit, order, f->ncomp, H5T_IEEE_F64LE,
                             H5T_NATIVE_DOUBLE, fr->slice));
  } else {
    float *packed = (float *)fr->packed;

    for (PetscInt i = 0; i < n; i++) packed[i] = (float)fr->slice[i];
    PetscCall(SbH5WriteSlice(&fr->h5, group, f->name, f->unit, order, f->ncomp, H5T_IEEE_F32LE,
                             H5T_NATIVE_FLOAT, packed));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the index files for viewers, with all frames so far. Rank 0. */
static void write_indices(SbOutput out, PetscBool last, char message[SB_MESSAGE_MAX])
{
  SbIndexWrite(out->frames->index, last, message);
  if (!message[0] && out->contact_index) SbIndexWrite(out->contact_index, last, message);
}

static PetscErrorCode write_frame(SbRun run, SbOutput out, const SbStep *step)
{
  SbFrames fr = out->frames;
  const SbField *field[SB_FIELD_MAX];
  PetscInt bytes[SB_FIELD_MAX], n = 0;
  PetscInt64 room;
  char path[48], message[SB_MESSAGE_MAX] = "", name[16], hundred[16];
  /* along an arc length the load factor may fall, while viewers expect times that rise: the step is the time */
  const PetscReal time = run->path ? (PetscReal)step->step : step->t;
  hid_t group;

  PetscFunctionBeginUser;
  /* reserve disk space for the frame and its metadata: a full disk is an error before anything is written */
  PetscCall(SbContactsFind(run, out, step, &room));
  room += 65536 + 8192 * out->nfield;
  for (PetscInt i = 0; i < out->nfield; i++)
    room += (PetscInt64)(out->field[i]->cell ? out->tet.N : out->point.N) * out->field[i]->ncomp *
            (out->precise ? 8 : 4);
  PetscCall(SbH5Reserve(&fr->h5, room));

  /* an anonymous group, linked under its name when it is complete, with its time */
  PetscCall(SbH5GroupCreate(&fr->h5, (unsigned)out->nfield + 1, 14, &group));
  PetscCall(SbH5PutReal(&fr->h5, group, "time", time));
  if (run->path) PetscCall(SbH5PutReal(&fr->h5, group, "load_factor", step->t));
  PetscCall(SbH5PutInt(&fr->h5, group, "step", step->step));
  if (fr->mesh) PetscCall(SbH5PutInt(&fr->h5, group, "mesh", fr->mesh));

  /* the fields, and the points of contact */
  out->state_valid = PETSC_FALSE;
  for (PetscInt i = 0; i < out->nfield; i++) {
    if (out->field[i]->constant) continue;
    PetscCall(PetscLogEventBegin(out->field_event[i], 0, 0, 0, 0));
    PetscCall(write_field(run, out, step, out->field[i], group));
    PetscCall(PetscLogEventEnd(out->field_event[i], 0, 0, 0, 0));
    bytes[n] = out->precise ? 8 : 4;
    field[n++] = out->field[i];
  }
  PetscCall(SbContactsWrite(out, &fr->h5, group));

  /* the frame gets its name, and then its entry in the index */
  (void)snprintf(name, sizeof(name), "%06" PetscInt_FMT, step->step);
  if (fr->node >= 0 && fr->nlink < SB_H5_NODE_LINKS) {
    /* all data on disk before the link */
    PetscCall(SbH5Flush(&fr->h5));
    PetscCall(SbH5GroupLink(&fr->h5, group, fr->node, name));
    (void)snprintf(hundred, sizeof(hundred), "%04" PetscInt_FMT, fr->nnode - 1);
  } else {
    if (fr->node >= 0) (void)H5Gclose(fr->node);
    PetscCall(SbH5GroupCreate(&fr->h5, SB_H5_NODE_LINKS, 6, &fr->node));
    PetscCall(SbH5GroupLink(&fr->h5, group, fr->node, name));
    PetscCall(SbH5Flush(&fr->h5));
    (void)snprintf(hundred, sizeof(hundred), "%04" PetscInt_FMT, fr->nnode);
    PetscCall(SbH5GroupLink(&fr->h5, fr->node, fr->top, hundred));
    fr->nnode++;
    fr->nlink = 0;
  }
  PetscCall(SbH5Flush(&fr->h5));
  fr->nlink++;
  (void)snprintf(path, sizeof(path), "/step/%s/%s", hundred, name);
  (void)H5Gclose(group);
  fr->last_step = step->step;
  fr->nframe++;
  if (fr->index) {
    PetscCall(SbIndexAdd(fr->index, time, path, n, field, bytes));
    PetscCall(SbContactsList(out, time, path, SbContactsCount(out), out->precise ? 8 : 4));
    write_indices(out, step->last, message);
  }
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode monitor(SbRun run, const SbStep *step, void *ctx)
{
  SbOutput out = (SbOutput)ctx;
  const PetscBool first = (PetscBool)(step->step == run->step0);
  PetscBool due;

  PetscFunctionBeginUser;
  /* frames at intervals of time or of steps, at the start and at the end */
  if (out->every > 0.)
    due = SbOutputDue(out->every, step->t, step->dt);
  else
    due = (PetscBool)(step->step % out->every_steps == 0);
  if (!first && !due && !step->last) PetscFunctionReturn(PETSC_SUCCESS);
  /* after a restart the first frame may be in the file */
  if (out->frames->last_step >= step->step) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogStagePush(SbLogStageOutput));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(out->event.fields, 0, 0, 0, 0));
  PetscCall(write_frame(run, out, step));
  PetscCall(PetscLogEventEnd(out->event.fields, 0, 0, 0, 0));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscCall(PetscLogStagePop());
  if (step->last) PetscCall(SbFramesClose(out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ restart */

/* Step, time and fields of the frame `name` in an open hundred; ok is false when it is not one of ours. */
static PetscErrorCode read_frame(hid_t hundred, const char *name, SbFrame *frame, PetscBool *ok)
{
  const hid_t group = SbH5OpenGroup(hundred, name);
  int64_t step = 0, mesh = 0;
  PetscBool other = PETSC_TRUE;
  PetscInt n;
  const SbField *fields = SbFieldGetAll(&n);

  PetscFunctionBeginUser;
  *ok = (PetscBool)(group >= 0);
  if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
  SbH5GetInt(group, "step", &step, ok);
  SbH5GetReal(group, "time", &frame->time, ok);
  SbH5GetInt(group, "mesh", &mesh, &other);
  frame->step = (PetscInt)step;
  frame->mesh = other ? (PetscInt)mesh : 0;
  frame->nfield = 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt bytes = SbH5NumberBytes(group, fields[i].name);

    if (!bytes) continue;
    frame->field[frame->nfield] = &fields[i];
    frame->bytes[frame->nfield++] = bytes;
  }
  SbContactsRead(group, &frame->npoint, &frame->point_bytes);
  (void)H5Gclose(group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt count_links(hid_t group)
{
  H5G_info_t info;

  return H5Gget_info(group, &info) < 0 ? 0 : (PetscInt)info.nlinks;
}

static PetscBool link_name(hid_t group, PetscInt i, size_t size, char name[])
{
  return (PetscBool)(H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, (hsize_t)i, name, size,
                                        H5P_DEFAULT) > 0);
}

/* Visits every frame of the file: those up to step0 are counted and put into `frames`; without it later ones are removed. */
static PetscErrorCode scan(SbFrames fr, PetscInt step0, SbFrame **frames)
{
  PetscInt size = 0;

  PetscFunctionBeginUser;
  fr->nframe = 0;
  fr->nnode = count_links(fr->top);
  for (PetscInt h = 0; h < fr->nnode; h++) {
    char name[16], frame[16];
    const hid_t hundred =
      link_name(fr->top, h, sizeof(name), name) ? H5Gopen2(fr->top, name, H5P_DEFAULT) : -1;

    /* backwards: removing a link moves those after it */
    for (PetscInt i = hundred < 0 ? -1 : count_links(hundred) - 1; i >= 0; i--) {
      PetscBool ok;
      SbFrame found;

      if (!link_name(hundred, i, sizeof(frame), frame)) continue;
      PetscCall(read_frame(hundred, frame, &found, &ok));
      if (ok && found.step <= step0) {
        (void)snprintf(found.group, sizeof(found.group), "/step/%s/%s", name, frame);
        if (frames) PetscCall(SbReserve(fr->nframe + 1, sizeof(found), &size, frames));
        if (frames) (*frames)[fr->nframe] = found;
        fr->nframe++;
      } else if (ok && !frames) {
        (void)H5Ldelete(hundred, frame, H5P_DEFAULT);
      }
    }
    if (hundred >= 0) (void)H5Gclose(hundred);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int by_step(const void *a, const void *b)
{
  const PetscInt p = ((const SbFrame *)a)->step, q = ((const SbFrame *)b)->step;

  return (p > q) - (p < q);
}

/* Whether an open file of frames has this run's mesh as that of a step. */
static PetscBool has_mesh(SbOutput out, hid_t file, PetscInt step)
{
  PetscBool ok = PETSC_TRUE;
  int64_t hash = 0;
  char name[32];
  hid_t mesh;

  mesh_name(step, sizeof(name), name);
  mesh = SbH5OpenGroup(file, name);
  if (mesh < 0) return PETSC_FALSE;
  SbH5GetInt(mesh, "hash", &hash, &ok);
  (void)H5Gclose(mesh);
  return (PetscBool)(ok && (uint64_t)hash == out->mesh_hash);
}

/* The step of this run's mesh in an open file: that of its last re-meshing, or 0; ok: the file has it. */
static PetscInt find_mesh(SbRun run, SbOutput out, hid_t file, PetscBool *ok)
{
  const PetscInt step = SbOutputMeshStep(run);

  *ok = has_mesh(out, file, step);
  if (*ok || !step) return step;
  *ok = has_mesh(out, file, 0);
  return 0;
}

/* Entries of the index that follow refer to this mesh of the file. Rank 0. */
static PetscErrorCode index_mesh(SbFrames fr, PetscInt step)
{
  char name[32];

  PetscFunctionBeginUser;
  mesh_name(step, sizeof(name), name);
  PetscCall(SbIndexSetMesh(fr->index, fr->h5.file, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens the file of the run that is continued; ok is false when there is none, or one of another mesh. */
static PetscErrorCode resume(SbRun run, SbOutput out, const char *path, PetscBool *ok)
{
  SbFrames fr = out->frames;
  SbFrame *frames = NULL;
  char message[SB_MESSAGE_MAX] = "";

  PetscFunctionBeginUser;
  /* the file must have this mesh and frames */
  PetscCall(SbH5Open(out->comm, path, PETSC_TRUE, &fr->h5, ok));
  if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
  fr->mesh = find_mesh(run, out, fr->h5.file, ok);
  fr->top = SbH5OpenGroup(fr->h5.file, "step");
  if (!*ok || fr->top < 0) {
    *ok = PETSC_FALSE;
    if (fr->top >= 0) (void)H5Gclose(fr->top);
    PetscCall(SbH5Close(&fr->h5));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* its frames up to the restart, by step */
  PetscCall(scan(fr, run->step0, &frames));
  if (fr->nframe) qsort(frames, (size_t)fr->nframe, sizeof(*frames), by_step);
  if (fr->nframe) fr->last_step = frames[fr->nframe - 1].step;

  /* the index first, so that it never lists a frame that is removed */
  for (PetscInt i = 0; fr->index && i < fr->nframe; i++) {
    if (!i || frames[i].mesh != frames[i - 1].mesh) PetscCall(index_mesh(fr, frames[i].mesh));
    PetscCall(SbIndexAdd(fr->index, frames[i].time, frames[i].group, frames[i].nfield, frames[i].field,
                         frames[i].bytes));
    PetscCall(SbContactsList(out, frames[i].time, frames[i].group, frames[i].npoint, frames[i].point_bytes));
  }
  if (fr->index && (!fr->nframe || frames[fr->nframe - 1].mesh != fr->mesh))
    PetscCall(index_mesh(fr, fr->mesh));
  if (fr->index) write_indices(out, PETSC_TRUE, message);
  PetscCall(PetscFree(frames));
  PetscCall(SbAgree(out->comm, PETSC_ERR_FILE_WRITE, message));

  /* then later frames are removed */
  PetscCall(scan(fr, run->step0, NULL));
  PetscCall(SbH5Flush(&fr->h5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesCheck(SbRun run, SbOutput out)
{
  SbH5 h;
  char path[PETSC_MAX_PATH_LEN];
  PetscBool ok, corners, edges, linear;

  PetscFunctionBeginUser;
  if (!out->nfield) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbOutputOrder(run, out));
  PetscCall(SbOutputPath(out, "fields.h5", sizeof(path), path));
  PetscCall(SbH5Open(out->comm, path, PETSC_FALSE, &h, &ok));
  if (!ok) PetscFunctionReturn(PETSC_SUCCESS);
  (void)find_mesh(run, out, h.file, &ok);
  corners = (PetscBool)(ok && H5Lexists(h.file, "mesh/vertices", H5P_DEFAULT) > 0);
  linear = (PetscBool)(ok && H5Lexists(h.file, "mesh/parent", H5P_DEFAULT) > 0);
  edges = (PetscBool)(ok && !linear && H5Lexists(h.file, "mesh/cells10", H5P_DEFAULT) > 0);
  PetscCall(SbH5Close(&h));
  /* a file of another mesh is replaced, one of this mesh continued */
  PetscCheck(!ok || corners == out->discontinuous, out->comm, PETSC_ERR_USER_INPUT,
             "-output_discontinuous is %s, but the frames in %s were written with %s: go on with the same, "
             "or give another -output_dir",
             out->discontinuous ? "true" : "false", path, corners ? "true" : "false");
  PetscCheck(
    !ok || (edges == out->quadratic && linear == (out->place && !edges)), out->comm, PETSC_ERR_USER_INPUT,
    "-output_quadratic is %s, but the frames in %s have tets of p2 otherwise: go on with the same, or "
    "give another -output_dir",
    out->quadratic ? "true" : "false", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ life */

/* Work arrays, whose sizes are those of the mesh. */
static PetscErrorCode allocate(SbRun run, SbOutput out)
{
  SbFrames fr = out->frames;
  PetscInt most = 1,
           wide = out->place ? SB_CELL_NODES + 1 : 4; /* components of a cell field; points of a cell */
  PetscInt nowned, nslice;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < out->nfield; i++)
    if (out->field[i]->cell) most = PetscMax(most, out->field[i]->ncomp);
  wide = PetscMax(wide, most);
  nowned = PetscMax(3 * out->point.nowned, wide * out->cell.nowned);
  nslice = PetscMax(PetscMax(3 * out->point.n, wide * out->cell.n), most * out->tet.n);
  PetscCall(PetscMalloc1(nowned, &fr->owned));
  PetscCall(PetscMalloc1(nslice, &fr->slice));
  if (!out->precise) PetscCall(PetscMalloc((size_t)nslice * sizeof(float), &fr->packed));
  for (PetscInt i = 0; i < out->nfield; i++) PetscCall(SbFieldPrepare(run, out, out->field[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode free_work(SbFrames fr)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(fr->owned));
  PetscCall(PetscFree(fr->slice));
  PetscCall(PetscFree(fr->packed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesAttach(SbRun run, SbOutput out)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool resumed = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (!out->nfield) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&out->frames));
  out->frames->h5.file = -1;
  out->frames->top = -1;
  out->frames->node = -1;
  out->frames->last_step = -1;
  PetscCall(SbOutputOrder(run, out));
  PetscCall(allocate(run, out));

  /* the index for viewers, on rank 0 */
  if (!out->rank) PetscCall(SbIndexCreate(out, "fields", NULL, &out->frames->index));
  PetscCall(SbContactsCreate(run, out));
  PetscCall(SbOutputPath(out, "fields.h5", sizeof(path), path));
  if (out->restarted) PetscCall(resume(run, out, path, &resumed));

  /* else a new file with the mesh, without an index until it has a frame */
  if (!resumed) {
    SbFrames fr = out->frames;

    if (fr->index) SbIndexRemove(fr->index);
    if (out->contact_index) SbIndexRemove(out->contact_index);
    PetscCall(SbH5Create(out->comm, path, &fr->h5));
    PetscCall(SbH5PutText(&fr->h5, fr->h5.file, "program", "supple " SB_VERSION));
    PetscCall(write_mesh(run, out));
    PetscCall(SbH5GroupCreate(&fr->h5, SB_H5_NODE_LINKS, 4, &fr->top));
    PetscCall(SbH5GroupLink(&fr->h5, fr->top, fr->h5.file, "step"));
    PetscCall(SbH5Flush(&fr->h5));
    if (fr->index) PetscCall(index_mesh(fr, fr->mesh));
  }
  PetscCall(SbRunAddMonitor(run, monitor, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesReattach(SbRun run, SbOutput out)
{
  PetscFunctionBeginUser;
  if (!out->frames) PetscFunctionReturn(PETSC_SUCCESS);
  /* work arrays and monitor for the new mesh, which is written beside the earlier ones */
  PetscCall(free_work(out->frames));
  PetscCall(allocate(run, out));
  if (out->contact_points) run->want_residual = PETSC_TRUE;
  if (!has_mesh(out, out->frames->h5.file, out->frames->mesh)) {
    out->frames->mesh = run->step0;
    PetscCall(write_mesh(run, out));
    PetscCall(SbH5Flush(&out->frames->h5));
    if (out->frames->index) PetscCall(index_mesh(out->frames, out->frames->mesh));
  }
  PetscCall(SbRunAddMonitor(run, monitor, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesClose(SbOutput out)
{
  SbFrames fr = out->frames;

  PetscFunctionBeginUser;
  if (!fr || fr->h5.file < 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (fr->node >= 0) (void)H5Gclose(fr->node);
  if (fr->top >= 0) (void)H5Gclose(fr->top);
  PetscCall(SbH5Close(&fr->h5));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFramesDestroy(SbOutput out)
{
  PetscFunctionBeginUser;
  if (!out->frames) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbFramesClose(out));
  PetscCall(SbContactsDestroy(out));
  PetscCall(SbIndexDestroy(&out->frames->index));
  PetscCall(free_work(out->frames));
  PetscCall(PetscFree(out->frames));
  PetscFunctionReturn(PETSC_SUCCESS);
}
