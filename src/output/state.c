/*
  Initial state from another run: -body_<name>_state RUN[,STEP] or CHECKPOINT.

  Displacement and velocity are those of a frame of that run's fields.h5, evaluated at the nodes of
  this run: u(X) = sum_a w_a u_a with the weights of the tet that contains X at rest there, or of
  the nearest one; ten weights in a tet of P2. So element, mesh, material, effects and integrator
  may differ. Every rank reads the body's part of the file. A checkpoint has no mesh, but all
  unknowns in full precision, and the largest energies of materials that soften: for scenes with the
  same meshes and elements; other scenes take the frame of its step.
*/
#include <sys/stat.h>
#include <unistd.h>
#include "output_impl.h"
#include "sbgeometry.h"
#include "sbmeshio.h"

#define WIDEST 4096  /* more numbers of a cell than any history has */
#define OUTSIDE 0.05 /* of the body's diagonal: warn of nodes farther from the other run's body */

/* The body of another run. */
typedef struct {
  char path[PETSC_MAX_PATH_LEN];
  hid_t file, frame, mesh;
  PetscInt npoint, ncell;
  PetscReal *x, *u,
    *v; /* [npoint][3] at rest, m; displacement, m; velocity, m/s, NULL: the frame has none */
  PetscInt *cell;   /* [ncell][4] those of the body */
  PetscInt *cell10; /* [ncell][10] with nodes at the edges (SbTetEdge), -1: none; NULL without P2 */
} Other;

/* A whole dataset, [n] or [n][ncomp], of a type as in files; NULL when it is not there.
   PetscFree. */
static PetscErrorCode read_all(hid_t where, const char *name, hid_t type, PetscInt ncomp,
                               PetscInt *n, void *array)
{
  const PetscInt64 rows = SbH5Rows(where, name, NULL);
  const hid_t file = rows ? H5Iget_file_id(where) : -1;
  hsize_t bytes = 0;

  PetscFunctionBeginUser;
  *(void **)array = NULL;
  *n = (PetscInt)rows;
  if (file >= 0) {
    (void)H5Fget_filesize(file, &bytes);
    (void)H5Fclose(file);
  }

  // more than the file can hold, compressed: it is damaged
  if (!*n || (double)rows * ncomp > 1000. * (double)bytes)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
    PetscMalloc((size_t)*n * (size_t)ncomp * H5Tget_size(SbH5TypeInMemory(type)), (void **)array));
  if (!SbH5Read(where, name, type, *n, ncomp, *(void **)array))
    PetscCall(PetscFree(*(void **)array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether each of n numbers is that of one of npoint points. */
static PetscBool are_points(const PetscInt number[], PetscInt n, PetscInt npoint)
{
  for (PetscInt i = 0; i < n; i++)
    if (number[i] < 0 || number[i] >= npoint)
      return PETSC_FALSE;
  return PETSC_TRUE;
}

/* The points, and the tets of body number `which`; ok: the arrays are there and fit each other. */
static PetscErrorCode read_tets(Other *o, PetscInt which, PetscBool *ok)
{
  PetscInt n = 0;
  PetscInt nbody, nten, nparent, *body, *parent;

  PetscFunctionBeginUser;
  PetscCall(read_all(o->mesh, "x", H5T_IEEE_F64LE, 3, &o->npoint, &o->x));
  PetscCall(read_all(o->mesh, "cells", H5T_STD_I64LE, 4, &o->ncell, &o->cell));
  PetscCall(read_all(o->mesh, "body", H5T_STD_I64LE, 1, &nbody, &body));
  PetscCall(read_all(o->mesh, "cells10", H5T_STD_I64LE, 10, &nten, &o->cell10));
  PetscCall(read_all(o->mesh, "parent", H5T_STD_I64LE, 1, &nparent, &parent));

  // every array that has rows could be read
  *ok = (PetscBool)(o->x && o->cell && (!nbody || body) && (!nten || o->cell10) &&
                    (!nparent || parent));

  // a body for each tet; for each a P2 tet that it is part of, else as many P2 tets as tets
  if (nbody && nbody != o->ncell)
    *ok = PETSC_FALSE;
  if (nparent && (nparent != o->ncell || nten > nparent))
    *ok = PETSC_FALSE;
  if (!nparent && nten && nten != o->ncell)
    *ok = PETSC_FALSE;
  if (*ok && nparent)
    *ok = are_points(parent, nparent, nten);

  /* replace parts of P2 tets by the tets, corners first */
  for (PetscInt i = 0; *ok && body && i < nparent; i++)
    body[parent[i]] = body[i];
  if (nten)
    o->ncell = nten;
  for (PetscInt c = 0; *ok && c < nten; c++) {
    PetscInt *point = o->cell10 + 10 * c;
    const PetscInt middle12 = point[5]; /* the file has the edges 01 12 02 03 13 23 */

    PetscCall(PetscArraymove(point + 5, point + 6, 2));
    point[7] = middle12;
    PetscCall(PetscArraycpy(o->cell + 4 * c, point, 4));
    if (point[4] >= 0)
      *ok = are_points(point + 4, 6, o->npoint);
  }
  *ok = (PetscBool)(*ok && are_points(o->cell, 4 * o->ncell, o->npoint));

  /* the cells of the body */
  for (PetscInt c = 0; *ok && c < o->ncell; c++) {
    if (body && body[c] != which)
      continue;
    PetscCall(PetscArraymove(o->cell + 4 * n, o->cell + 4 * c, 4));
    if (o->cell10)
      PetscCall(PetscArraymove(o->cell10 + 10 * n, o->cell10 + 10 * c, 10));
    n++;
  }
  o->ncell = n;
  PetscCall(PetscFree(body));
  PetscCall(PetscFree(parent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_other(const char *option, const char *text, const SbBody *body, Other *o)
{
  char name[SB_MESH_NAME], *comma, *names, *rest;
  char why[PETSC_MAX_PATH_LEN + 256];
  struct stat info;
  SbH5Frames frames = {.wanted = -1};
  PetscInt which = -1;
  PetscInt n = 0;
  PetscInt nu;
  int64_t mesh = 0;
  PetscBool ok;

  PetscFunctionBeginUser;

  /* RUN[,STEP]: a folder or its fields.h5 */
  PetscCall(PetscStrncpy(o->path, text, sizeof(o->path)));
  comma = strrchr(o->path, ',');
  if (comma && comma[1] && !comma[1 + strspn(comma + 1, "0123456789")]) {
    frames.wanted = strtoll(comma + 1, NULL, 10);
    *comma = 0;
  }
  if (!stat(o->path, &info) && S_ISDIR(info.st_mode))
    PetscCall(PetscStrlcat(o->path, "/fields.h5", sizeof(o->path)));
  PetscCheck(SbH5IsOwn(o->path, sizeof(why), why), PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s %s: %s", option, text, why);
  o->file = stat(o->path, &info) ? -1 : H5Fopen(o->path, H5F_ACC_RDONLY, H5P_DEFAULT);
  PetscCheck(o->file >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN,
             "%s %s: %s %s; give the folder of a run that wrote fields, displacement among them",
             option, text, o->path, access(o->path, F_OK) ? "is not there" : "holds no results");
  SbH5FindFrame(o->file, &frames);
  PetscCheck(frames.n, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s %s: %s has no frame", option,
             text, o->path);
  if (frames.found[0])
    o->frame = H5Gopen2(o->file, frames.found, H5P_DEFAULT);
  PetscCheck(o->frame >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s %s: %s has no frame of step %lld; its last one is of step %lld", option, text,
             o->path, (long long)frames.wanted, (long long)frames.last);

  /* the mesh of that frame, which may be one of a re-meshing */
  SbH5GetInt(o->frame, "mesh", &mesh, &ok);
  o->mesh = SbH5OpenGroup(o->file, SbOutputMeshName((PetscInt)mesh, name));

  /* number of the body of this name, or of the one that it is a copy of; the only body, if there is
     one */
  if (o->mesh >= 0) {
    PetscCall(SbH5BodyNames(o->file, name, &names));
    rest = names;
    for (char *other = strsep(&rest, ","); other; other = strsep(&rest, ","), n++)
      if (!strcmp(other, body->name) || (which < 0 && !strcmp(other, body->copy_of)))
        which = n;
    if (which < 0 && n == 1)
      which = 0;
    PetscCall(PetscFree(names));
  }
  PetscCheck(which >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s %s: %s has no body '%s'",
             option, text, o->path, body->name);
  PetscCall(read_tets(o, which, &ok));
  PetscCall(read_all(o->frame, "displacement", H5T_IEEE_F64LE, 3, &nu, &o->u));
  PetscCall(read_all(o->frame, "velocity", H5T_IEEE_F64LE, 3, &n, &o->v));
  PetscCheck(ok && o->u && nu == o->npoint && (!o->v || n == nu), PETSC_COMM_SELF,
             PETSC_ERR_FILE_UNEXPECTED,
             "%s %s: %s has no complete mesh with displacements; -output_fields "
             "displacement,velocity there, "
             "or it is damaged",
             option, text, o->path);
  PetscCheck(SbLengthsFit(3 * o->npoint, o->x) && SbLengthsFit(3 * o->npoint, o->u) &&
               (!o->v || SbLengthsFit(3 * o->npoint, o->v)),
             PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s %s: %s holds positions, displacements or velocities that are not finite or beyond "
             "%g m (m/s): that run went astray, or the file is damaged",
             option, text, o->path, (double)SB_LENGTH_MAX);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The initial velocity: of the state, or of the options if it has none. */
static PetscErrorCode tell_velocity(SbModel m, const char *option, PetscInt b, const char *path,
                                    PetscBool has)
{
  const SbBody *body = &m->body[b];
  PetscBool given = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    given = (PetscBool)(given || m->start[b].velocity[k] || body->velocity[k] != 0. ||
                        body->angular_velocity[k] != 0.);
  if (has && given)
    PetscCall(SbWarning(
      m->comm, "%s: the velocity that options give the body is unused in this run: %s has one",
      option, path));
  else if (!has && !given)
    PetscCall(SbWarning(m->comm, "%s: %s has no velocity, the body begins at rest", option, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values at the nodes of body b. */
static PetscErrorCode take_over(SbRun run, const char *option, PetscInt b, Other *o)
{
  const SbSpace s = run->model->space;
  PetscReal far = 0.;
  SbLocator locator;
  PetscScalar *u, *v;
  PetscReal *off = NULL;

  PetscFunctionBeginUser;

  // offsets of that run's edge nodes from the midpoints, at rest
  if (o->cell10)
    PetscCall(PetscCalloc1(18 * (size_t)o->ncell, &off));
  for (PetscInt i = 0; o->cell10 && i < 6 * o->ncell; i++) {
    const PetscInt *point = o->cell10 + 10 * (i / 6);
    const int *e = SbTetEdge[i % 6];

    for (int k = 0; k < 3 && point[4] >= 0; k++)
      off[3 * i + k] = o->x[3 * point[4 + i % 6] + k] -
                       0.5 * (o->x[3 * point[e[0]] + k] + o->x[3 * point[e[1]] + k]);
  }
  PetscCall(SbLocatorCreate(o->ncell, o->cell, o->x, off, &locator));
  PetscCall(VecGetArray(run->state.U, &u));
  PetscCall(VecGetArray(run->state.V, &v));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal L[4], Q[SB_CELL_NODES];
    const PetscReal *weight = L;
    const PetscInt *point;
    PetscInt cell;
    PetscInt n = 4;

    if (s->node_body[i] != b)
      continue;
    far = PetscMax(far, SbLocatorFind(locator, s->node_x + 3 * i, &cell, L));
    PetscCheck(cell >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "%s: no tetrahedron of the body in %s has a volume at rest; the file is damaged",
               option, o->path);
    point = o->cell + 4 * cell;
    if (o->cell10 && o->cell10[10 * cell + 4] >= 0) {
      point = o->cell10 + 10 * cell;
      n = SB_CELL_NODES;
      SbQuadraticBasis(L, Q);
      weight = Q;
    }
    for (int k = 0; k < 3; k++) {
      u[3 * i + k] = 0.;
      if (o->v)
        v[3 * i + k] = 0.;
      for (PetscInt a = 0; a < n; a++) {
        u[3 * i + k] += weight[a] * o->u[3 * point[a] + k];
        if (o->v)
          v[3 * i + k] += weight[a] * o->v[3 * point[a] + k];
      }
      if (s->fixed[i] & (1 << k))
        v[3 * i + k] = 0.;
    }
  }
  PetscCall(VecRestoreArray(run->state.U, &u));
  PetscCall(VecRestoreArray(run->state.V, &v));
  PetscCall(SbLocatorDestroy(&locator));
  PetscCall(PetscFree(off));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &far, 1, MPIU_REAL, MPI_MAX, run->model->comm));
  if (far > OUTSIDE * SbBoxDiagonal(run->model->body[b].bbox))
    PetscCall(
      SbWarning(run->model->comm,
                "%s: nodes are up to %g m outside of the body in %s, and take the values of the "
                "nearest place: is it the same body, at the same place?",
                option, far, o->path));
  PetscCall(tell_velocity(run->model, option, b, o->path, (PetscBool)(o->v != NULL)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The row of each owned node in a checkpoint with n nodes of the same meshes and elements, as an
  order. Supports of dg may differ: each of this run's takes the row of its face's node. ok: n
  agrees. Collective.
*/
static PetscErrorCode order_of_file(SbRun run, PetscInt n, SbOrder *order, PetscBool *ok)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  const SbSpace s = run->model->space;
  const PetscInt support = s->mesh->Nvert + 4 * s->mesh->Ncell;
  const PetscInt edge = support + 4 * s->mesh->Ncell;
  PetscInt nsupport = 0;
  PetscInt *number, *row;
  PetscBool weak = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < run->model->nbody; b++)
    weak = (PetscBool)(weak || s->element[b]->weak);
  PetscCall(PetscMalloc2(out->node.n, &number, s->nnode_owned, &row));
  for (PetscInt i = 0; i < out->node.n; i++)
    number[i] = out->node.start + i;
  PetscCall(SbForestBroadcast(out->node.sf, 1, MPIU_INT, number, row));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    nsupport += s->node_orig[i] >= support && s->node_orig[i] < edge;
    if (s->node_orig[i] >= edge)
      row[i] += n - out->node.N;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nsupport, 1, MPIU_INT, MPI_SUM, out->comm));
  for (PetscInt i = 0; n != out->node.N && s->dirichlet_node && i < 4 * s->mesh->ncell; i++)
    if (s->dirichlet_node[i] >= 0 && s->dirichlet_node[i] < s->nnode_owned)
      row[s->dirichlet_node[i]] = row[s->cell_node[i]];
  *ok = (PetscBool)(*ok && (n == out->node.N || (weak && n >= out->node.N - nsupport)));
  if (*ok)
    PetscCall(SbOrderCreate(out->comm, n, s->nnode_owned, row, order));
  PetscCall(PetscFree2(number, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a material, of the run and of the options of a checkpoint, softens. */
static PetscBool softens_in(SbModel m, PetscInt k, const char *options)
{
  const SbMaterial material = m->material[k];
  const SbBody *body = k < m->nbody ? &m->body[k] : NULL;
  const char *name = body && body->copy_of[0] ? body->copy_of : material->name;
  char line[3 * SB_NAME_MAX];
  const char *value;

  if (!material->mullins)
    return PETSC_FALSE;
  SbFormat(sizeof(line), line, "-%s_%s_mullins_r ", body ? "body" : "inclusion", name);
  value = strstr(options, line);
  return (PetscBool)(value && strtod(value + strlen(line), NULL) > 1.);
}

/* Numbers of a cell in the history of a checkpoint; 0: there is none. */
static PetscInt width_of_history(const SbH5 *h)
{
  const hid_t dataset =
    H5Lexists(h->file, "history", H5P_DEFAULT) > 0 ? H5Dopen(h->file, "history", H5P_DEFAULT) : -1;
  const hid_t space = dataset < 0 ? -1 : H5Dget_space(dataset);
  const int rank = space < 0 ? 0 : H5Sget_simple_extent_ndims(space);
  hsize_t n[2] = {0, rank == 1};

  if (rank == 1 || rank == 2)
    (void)H5Sget_simple_extent_dims(space, n, NULL);
  if (space >= 0)
    (void)H5Sclose(space);
  if (dataset >= 0)
    (void)H5Dclose(dataset);
  return n[1] > WIDEST ? 0 : (PetscInt)n[1];
}

/* The largest energies of the shape in cells of body b that soften, here and in the checkpoint. */
static PetscErrorCode take_softening(SbRun run, PetscInt b, SbH5 *h, const char *options,
                                     PetscBool *ok)
{
  const SbModel m = run->model;
  const SbOutput out = (SbOutput)run->monitors.output;
  const SbMesh mesh = m->mesh;
  const PetscInt n = m->space->softening ? width_of_history(h) : 0;
  const PetscInt width = m->space->nhistory;
  PetscReal *slice, *theirs, *ours;
  PetscBool *both;

  PetscFunctionBeginUser;
  if (!n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m->nmaterial, &both));
  for (PetscInt k = 0; k < m->nmaterial; k++)
    both[k] = softens_in(m, k, options);
  PetscCall(PetscMalloc3(n * out->cell.n, &slice, n * mesh->ncell_owned, &theirs,
                         width * mesh->ncell_owned, &ours));
  PetscCall(SbH5ReadSlice(h, "history", &out->cell, n, slice, ok));
  if (*ok) {
    PetscCall(SbForestBroadcast(out->cell.sf, n, MPIU_REAL, slice, theirs));
    PetscCall(SbSpaceGetHistory(m->space, ours));
  }
  for (PetscInt c = 0; *ok && c < mesh->ncell_owned; c++) {
    if (mesh->cell_body[c] != b || !both[mesh->cell_material[c]])
      continue;
    for (PetscInt k = 0; k < PetscMin(n, width); k++) {
      const PetscReal most = theirs[n * c + k];

      if (PetscIsInfOrNanReal(most) || most < 0.)
        *ok = PETSC_FALSE;
      ours[width * c + k] = most;
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, out->comm));
  if (*ok)
    PetscCall(SbSpaceSetHistory(m->space, ours));
  m->space->viscous_began = PETSC_FALSE; // viscoelastic bodies begin relaxed
  PetscCall(PetscFree3(slice, theirs, ours));
  PetscCall(PetscFree(both));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns of body b from a checkpoint; is: the file is one of the same bodies, meshes and
   elements. For another checkpoint frame[] names the frame of its step in its run's folder.
   Collective. */
static PetscErrorCode take_checkpoint(SbRun run, const char *option, PetscInt b, const char *path,
                                      size_t size, char frame[], PetscBool *is)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  const SbSpace s = run->model->space;
  const Vec target[2] = {run->state.U, run->state.V};
  struct stat info;
  SbH5 h;
  int64_t hash = 0;
  int64_t step = 0;
  PetscBool ok = PETSC_TRUE;
  PetscBool same;
  SbOrder order;
  char *options = NULL;

  PetscFunctionBeginUser;
  *is = (PetscBool)(!stat(path, &info) && S_ISREG(info.st_mode));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, is, 1, SB_MPI_BOOL, MPI_LAND, out->comm));
  if (*is)
    PetscCall(SbH5Open(out->comm, path, PETSC_FALSE, &h, is));
  if (!*is)
    PetscFunctionReturn(PETSC_SUCCESS);
  *is = (PetscBool)(H5Lexists(h.file, "u", H5P_DEFAULT) > 0);
  if (!*is)
    PetscCall(SbH5Close(&h));
  if (!*is)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* compare meshes and elements */
  PetscCall(SbOutputOrder(run, out));
  SbH5GetInt(h.file, "mesh_hash", &hash, &ok);
  SbH5GetInt(h.file, "step", &step, &ok);
  PetscCall(SbH5ReadText(&h, "options", &options, &ok));
  same = (PetscBool)(!ok || (uint64_t)hash == out->mesh_hash);
  for (PetscInt i = 0; ok && same && i < run->model->nbody; i++) {
    char line[3 * SB_NAME_MAX];
    const SbBody *body = &run->model->body[i];

    // a rigid body has no element in the options
    if (body->rigid) {
      SbFormat(sizeof(line), line, "-body_%s_element ",
               body->copy_of[0] ? body->copy_of : body->name);
      same = (PetscBool)!strstr(options, line);
      continue;
    }

    SbFormat(sizeof(line), line, "-body_%s_element %s\n",
             body->copy_of[0] ? body->copy_of : body->name, body->element);
    same = (PetscBool)(strstr(options, line) != NULL);
  }
  if (!same) {
    const char *name = strrchr(path, '/');

    SbFormat(size, frame, "%.*s,%lld", name ? (int)(name - path) : 1, name ? path : ".",
             (long long)step);
    PetscCall(
      SbWarning(out->comm,
                "%s: %s is of other bodies, meshes or elements: the frame %s is taken in its place",
                option, path, frame));
    PetscCall(SbH5Close(&h));
    PetscCall(PetscFree(options));
    *is = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* displacement and velocity of its nodes; supports, behind the faces' nodes there, may be other
     ones */
  PetscCall(order_of_file(run, (PetscInt)SbH5Rows(h.file, "u", NULL), &order, &ok));
  if (ok) {
    PetscReal *slice, *owned;

    PetscCall(PetscMalloc2(3 * order.n, &slice, 3 * s->nnode_owned, &owned));
    for (int k = 0; k < 2 && ok; k++) {
      const PetscBool has = (PetscBool)(H5Lexists(h.file, k ? "v" : "u", H5P_DEFAULT) > 0);
      PetscScalar *x;

      if (k)
        PetscCall(tell_velocity(run->model, option, b, path, has));
      if (!has)
        continue;
      PetscCall(SbH5ReadSlice(&h, k ? "v" : "u", &order, 3, slice, &ok));
      ok = (PetscBool)(ok && SbLengthsFit(3 * order.n, slice));
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &ok, 1, SB_MPI_BOOL, MPI_LAND, out->comm));
      if (!ok)
        break;
      PetscCall(SbForestBroadcast(order.sf, 3, MPIU_REAL, slice, owned));
      PetscCall(VecGetArray(target[k], &x));
      for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
        if (s->node_body[i / 3] == b)
          x[i] = k && s->fixed[i / 3] & (1 << i % 3) ? 0. : owned[i];
      PetscCall(VecRestoreArray(target[k], &x));
    }
    PetscCall(PetscFree2(slice, owned));
    PetscCall(SbOrderDestroy(&order));
  }
  if (ok)
    PetscCall(take_softening(run, b, &h, options, &ok));
  PetscCall(PetscFree(options));
  PetscCall(SbH5Close(&h));
  PetscCheck(
    ok, out->comm, PETSC_ERR_USER_INPUT,
    "%s %s: this checkpoint is damaged; give the folder of its run, whose frames serve as well",
    option, path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a body or one of its inclusions softens. */
static PetscBool softens(SbModel m, PetscInt b)
{
  PetscBool any = (PetscBool)(m->material[b]->mullins != NULL);

  for (PetscInt i = 0; i < m->body[b].ninclusion; i++)
    any = (PetscBool)(any || m->material[m->body[b].inclusion[i].material]->mullins);
  return any;
}

PetscErrorCode SbOutputLoadState(SbRun run)
{
  const SbModel m = run->model;
  const SbOutput out = (SbOutput)run->monitors.output;
  PetscBool any = PETSC_FALSE;
  PetscBool checkpoint;

  PetscFunctionBeginUser;
  if (out->restart[0])
    PetscFunctionReturn(PETSC_SUCCESS); /* a restart has its own state */
  for (PetscInt b = 0; b < m->nbody; b++) {
    Other o = {.file = -1, .frame = -1, .mesh = -1};
    SbCaughtError caught = {0, ""};
    char option[2 * SB_NAME_MAX], frame[PETSC_MAX_PATH_LEN + 24];

    if (!m->start[b].state[0])
      continue;
    any = PETSC_TRUE;
    PetscCall(PetscSNPrintf(option, sizeof(option), "-body_%s_state", m->body[b].name));
    PetscCall(PetscStrncpy(frame, m->start[b].state, sizeof(frame)));
    PetscCall(
      take_checkpoint(run, option, b, m->start[b].state, sizeof(frame), frame, &checkpoint));
    if (checkpoint)
      continue;
    PetscCheck(!m->body[b].rigid, out->comm, PETSC_ERR_USER_INPUT,
               "%s: a rigid body takes its state from a checkpoint of the same bodies, meshes and "
               "elements, not from a frame",
               option);
    if (softens(m, b))
      PetscCall(SbWarning(out->comm,
                          "%s: a frame does not know how far the body %s was stretched: it softens "
                          "from its stretch there on; a checkpoint of the same bodies, meshes and "
                          "elements knows",
                          option, m->body[b].name));
    SB_CATCH(&caught, read_other(option, frame, &m->body[b], &o));
    if (!caught.code)
      PetscCall(take_over(run, option, b, &o));
    PetscCall(PetscFree(o.x));
    PetscCall(PetscFree(o.u));
    PetscCall(PetscFree(o.v));
    PetscCall(PetscFree(o.cell));
    PetscCall(PetscFree(o.cell10));
    if (o.mesh >= 0)
      (void)H5Gclose(o.mesh);
    if (o.frame >= 0)
      (void)H5Gclose(o.frame);
    if (o.file >= 0)
      (void)H5Fclose(o.file);
    PetscCall(SbCaughtRaise(m->comm, &caught));
  }
  if (any)
    PetscCall(SbModelPrescribe(m, 0., run->state.U));
  PetscFunctionReturn(PETSC_SUCCESS);
}
