/*
  The active contact points, with normals, gaps and forces: -output_contacts.

  Each frame of fields.h5 then has a group `contacts` with one dataset per quantity and one row per point, in
  an order that no partition changes. Their number differs from frame to frame, so they have their own
  indices, contacts.xmf and contacts.vtkhdf.

  A point is sent to the rank that has its share of the numbers of points and edges, and sorted there: by the
  number that it begins with, then by effect, kind, and the number of the other side.
*/
#include <stddef.h>
#include "output_impl.h"

/* Quantities written for a point: their offset in SbContactPoint, or one of the two below. */
#define ROW ((size_t)-1)    /* the number of the row itself: VTK needs a cell for each point */
#define NORMAL ((size_t)-2) /* the force along the normal */
#define FRICTION ((size_t)-3)
#define AT(member) offsetof(SbContactPoint, member)

static const struct {
  const char *name, *unit;
  int ncomp;
  size_t from;
  PetscBool whole;
} table[] = {
  // the first one is the topology of the index
  {"point", "1", 1, ROW, PETSC_TRUE},
  {"x", "m", 3, AT(x), PETSC_FALSE},
  {"effect", "1", 1, AT(effect), PETSC_TRUE},
  {"body", "1", 1, AT(body[0]), PETSC_TRUE},
  {"other", "1", 1, AT(body[1]), PETSC_TRUE},
  {"normal", "1", 3, AT(normal), PETSC_FALSE},
  {"gap", "m", 1, AT(gap), PETSC_FALSE},
  {"force", "N", 3, AT(force), PETSC_FALSE},
  {"normal_force", "N", 1, NORMAL, PETSC_FALSE},
  {"friction_force", "N", 3, FRICTION, PETSC_FALSE},
};
#define NTABLE ((int)PETSC_STATIC_ARRAY_LENGTH(table))

static int by_keys(const void *a, const void *b)
{
  const SbContactPoint *p = (const SbContactPoint *)a, *q = (const SbContactPoint *)b;
  const PetscInt of_p[4] = {p->id[1], p->effect, p->id[0], p->id[2]};
  const PetscInt of_q[4] = {q->id[1], q->effect, q->id[0], q->id[2]};

  for (int k = 0; k < 4; k++)
    if (of_p[k] != of_q[k]) return of_p[k] < of_q[k] ? -1 : 1;
  return 0;
}

PetscErrorCode SbContactsFind(SbRun run, SbOutput out, const SbStep *step, PetscInt *n, PetscInt64 *bytes)
{
  SbContacts *c = &out->contacts;
  PetscInt bound = 0;
  PetscMPIInt *dest;
  SbRoute route;

  PetscFunctionBeginUser;
  *n = -1;
  *bytes = 0;
  if (!out->contact_points) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(out->event.contacts, 0, 0, 0, 0));
  c->list.n = 0;
  PetscCall(SbModelContactPoints(run->model, step->t, step->U, &c->list));
  /* Sends this rank's contact points to the ranks of their slices; sorts the received ones. */
  for (PetscInt i = 0; i < c->list.n; i++) bound = PetscMax(bound, c->list.point[i].id[1]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &bound, 1, MPIU_INT, MPI_MAX, c->share.comm));
  PetscCall(PetscMalloc1(c->list.n, &dest));
  for (PetscInt i = 0; i < c->list.n; i++)
    dest[i] = (PetscMPIInt)((PetscInt64)c->list.point[i].id[1] * out->size / ((PetscInt64)bound + 1));
  PetscCall(PetscFree(c->point));
  PetscCall(SbRouteCreate(c->share.comm, c->list.n, NULL, dest, &route));
  PetscCall(SbRouteSend(&route, sizeof(SbContactPoint), NULL, c->list.point, &c->point));
  c->share.n = route.nrecv;
  PetscCall(SbRouteDestroy(&route));
  if (c->share.n) qsort(c->point, (size_t)c->share.n, sizeof(SbContactPoint), by_keys);
  PetscCall(PetscFree(c->column));
  PetscCall(PetscMalloc1(3 * c->share.n, &c->column));
  PetscCallMPI(MPI_Scan(&c->share.n, &c->share.start, 1, MPIU_INT, MPI_SUM, out->comm));
  c->share.start -= c->share.n;
  PetscCallMPI(MPI_Allreduce(&c->share.n, &c->share.N, 1, MPIU_INT, MPI_SUM, out->comm));
  *n = c->share.N;
  for (int k = 0; k < NTABLE; k++) *bytes += 8 * (PetscInt64)c->share.N * table[k].ncomp + 8192;
  PetscCall(PetscLogEventEnd(out->event.contacts, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactsWrite(SbOutput out, SbH5 *h, hid_t frame)
{
  SbContacts *c = &out->contacts;
  hid_t group;

  PetscFunctionBeginUser;
  if (!out->contact_points) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(out->event.contacts, 0, 0, 0, 0));
  PetscCall(SbH5GroupCreate(h, (unsigned)NTABLE, 14, &group));
  PetscCall(SbH5PutInt(h, group, "count", c->share.N));
  for (int k = 0; k < NTABLE && c->share.N; k++) {
    const int ncomp = table[k].ncomp;
    const hid_t type = table[k].whole ? H5T_STD_I32LE : out->precise ? H5T_IEEE_F64LE : H5T_IEEE_F32LE;

    /* this rank's rows, as numbers of the file */
    for (PetscInt i = 0; i < c->share.n * ncomp; i++) {
      const SbContactPoint *p = c->point + i / ncomp;
      const PetscReal push = SbDot3(p->force, p->normal);

      if (table[k].from == ROW)
        c->column[i] = (PetscReal)(c->share.start + i);
      else if (table[k].from == NORMAL)
        c->column[i] = push;
      else if (table[k].from == FRICTION)
        c->column[i] = p->force[i % ncomp] - push * p->normal[i % ncomp];
      else if (table[k].whole)
        c->column[i] = (PetscReal)(*(const PetscInt *)((const char *)p + table[k].from));
      else
        c->column[i] = ((const PetscReal *)((const char *)p + table[k].from))[i % ncomp];
    }
    (void)H5Tconvert(H5T_NATIVE_DOUBLE, SbH5TypeInMemory(type), (size_t)c->share.n * ncomp, c->column, NULL,
                     H5P_DEFAULT);
    PetscCall(SbH5WriteSlice(h, group, table[k].name, table[k].unit, &c->share, ncomp, type, c->column));
  }
  PetscCall(SbH5GroupLink(h, group, frame, "contacts"));
  (void)H5Gclose(group);
  PetscCall(PetscLogEventEnd(out->event.contacts, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbContactsRead(hid_t frame, PetscInt *n, PetscInt *bytes)
{
  const hid_t group = SbH5OpenGroup(frame, "contacts");
  int64_t count = 0;
  PetscBool ok = PETSC_TRUE;

  *n = -1;
  *bytes = 8;
  if (group < 0) return;
  SbH5GetInt(group, "count", &count, &ok);
  if (ok) *n = (PetscInt)count;
  if (ok && count) (void)SbH5Rows(group, "gap", bytes);
  (void)H5Gclose(group);
}

PetscErrorCode SbContactsList(SbOutput out, PetscReal time, const char *frame, PetscInt n, PetscInt bytes)
{
  SbIndexValues values[NTABLE];
  char group[64];

  PetscFunctionBeginUser;
  if (!out->contact_index || n < 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < NTABLE; k++)
    values[k] = (SbIndexValues){.name = table[k].name,
                                .ncomp = table[k].ncomp,
                                .bytes = table[k].whole ? 4 : (int)bytes,
                                .whole = table[k].whole};
  (void)snprintf(group, sizeof(group), "%s/contacts", frame);
  PetscCall(SbIndexAdd(out->contact_index, time, group, n, NTABLE - 1, values + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactsCreate(SbRun run, SbOutput out)
{
  const SbMesh mesh = run->model->mesh;
  PetscReal nowhere[3] = {0., 0., 0.}; /* position of the dummy point of a frame without contact */

  PetscFunctionBeginUser;
  // After a restart frames that are kept may have contact points, which stay in the index.
  if (!out->contact_points && !out->restarted) PetscFunctionReturn(PETSC_SUCCESS);
  out->contacts.share.comm = out->comm;
  if (out->rank) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 3 && mesh->nvert; k++) nowhere[k] = mesh->x[k];
  PetscCall(SbIndexCreate(out, "contacts", nowhere, &out->contact_index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactsDestroy(SbOutput out)
{
  PetscFunctionBeginUser;
  PetscCall(SbIndexDestroy(&out->contact_index));
  PetscCall(PetscFree(out->contacts.list.point));
  PetscCall(PetscFree(out->contacts.point));
  PetscCall(PetscFree(out->contacts.column));
  PetscFunctionReturn(PETSC_SUCCESS);
}
