/*
  The active contact points, with normals, gaps and forces: -output_contacts.

  Each frame of fields.h5 then has a group `contacts` with one dataset per quantity and one row per
  point, in an order that no partition changes. Their number differs from frame to frame, so they
  have their own indices, contacts.xmf and contacts.vtkhdf.

  A point is sent to the rank that has its share of the numbers of points and edges, and sorted
  there: by the number that it begins with, then by effect, kind, and the number of the other side.
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
  const SbContactPoint *p = (const SbContactPoint *)a;
  const SbContactPoint *q = (const SbContactPoint *)b;
  const PetscInt of_p[4] = {p->id[1], p->effect, p->id[0], p->id[2]};
  const PetscInt of_q[4] = {q->id[1], q->effect, q->id[0], q->id[2]};

  for (int k = 0; k < 4; k++)
    if (of_p[k] != of_q[k])
      return of_p[k] < of_q[k] ? -1 : 1;
  return 0;
}

PetscErrorCode SbContactsFind(SbRun run, SbOutput out, const SbStep *step, PetscInt64 *bytes)
{
  SbContacts *c = &out->contacts;
  PetscInt bound = 0;
  PetscMPIInt *dest;
  SbRoute route;

  PetscFunctionBeginUser;
  *bytes = 0;
  if (!out->contact_points)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(out->event.contacts, 0, 0, 0, 0));
  c->list.n = 0;
  PetscCall(SbContactSetPoints(&run->model->contacts, step->t, step->U, &c->list));

  /* Sends this rank's contact points to the ranks of their slices; sorts the received ones. */
  for (PetscInt i = 0; i < c->list.n; i++)
    bound = PetscMax(bound, c->list.point[i].id[1]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &bound, 1, MPIU_INT, MPI_MAX, out->comm));
  PetscCall(PetscMalloc1(c->list.n, &dest));
  for (PetscInt i = 0; i < c->list.n; i++)
    dest[i] =
      (PetscMPIInt)((PetscInt64)c->list.point[i].id[1] * out->size / ((PetscInt64)bound + 1));
  PetscCall(PetscFree(c->point));
  PetscCall(SbRouteCreate(out->comm, c->list.n, NULL, dest, &route));
  PetscCall(SbRouteSend(&route, sizeof(SbContactPoint), NULL, c->list.point, &c->point));
  c->share.n = route.nrecv;
  PetscCall(SbRouteDestroy(&route));
  if (c->share.n)
    qsort(c->point, (size_t)c->share.n, sizeof(SbContactPoint), by_keys);
  PetscCallMPI(MPI_Scan(&c->share.n, &c->share.start, 1, MPIU_INT, MPI_SUM, out->comm));
  c->share.start -= c->share.n;
  PetscCallMPI(MPI_Allreduce(&c->share.n, &c->share.N, 1, MPIU_INT, MPI_SUM, out->comm));
  for (int k = 0; k < NTABLE; k++)
    *bytes += 8 * (PetscInt64)c->share.N * table[k].ncomp + 8192;
  PetscCall(PetscLogEventEnd(out->event.contacts, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactsWrite(SbOutput out, SbH5 *h, hid_t frame)
{
  SbContacts *c = &out->contacts;
  PetscReal *column;
  hid_t group;

  PetscFunctionBeginUser;
  if (!out->contact_points)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(out->event.contacts, 0, 0, 0, 0));
  PetscCall(PetscMalloc1(3 * c->share.n, &column));
  PetscCall(SbH5GroupCreate(h, (unsigned)NTABLE, 14, &group));
  PetscCall(SbH5PutInt(h, group, "count", c->share.N));
  for (int k = 0; k < NTABLE && c->share.N; k++) {
    const int ncomp = table[k].ncomp;
    const hid_t real = out->precise ? H5T_IEEE_F64LE : H5T_IEEE_F32LE;
    const hid_t type = table[k].whole ? H5T_STD_I32LE : real;

    /* this rank's rows, as numbers of the file */
    for (PetscInt i = 0; i < c->share.n * ncomp; i++) {
      const SbContactPoint *p = c->point + i / ncomp;
      const PetscReal push = SbDot3(p->force, p->normal);

      if (table[k].from == ROW)
        column[i] = (PetscReal)(c->share.start + i);
      else if (table[k].from == NORMAL)
        column[i] = push;
      else if (table[k].from == FRICTION)
        column[i] = p->force[i % ncomp] - push * p->normal[i % ncomp];
      else if (table[k].whole)
        column[i] = (PetscReal)(*(const PetscInt *)((const char *)p + table[k].from));
      else
        column[i] = ((const PetscReal *)((const char *)p + table[k].from))[i % ncomp];
    }
    (void)H5Tconvert(H5T_NATIVE_DOUBLE, SbH5TypeInMemory(type), (size_t)c->share.n * ncomp, column,
                     NULL, H5P_DEFAULT);
    PetscCall(
      SbH5WriteSlice(h, group, table[k].name, table[k].unit, &c->share, ncomp, type, column));
  }
  PetscCall(PetscFree(column));
  PetscCall(SbH5GroupLink(h, group, frame, "contacts"));
  (void)H5Gclose(group);
  PetscCall(PetscLogEventEnd(out->event.contacts, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactsList(SbOutput out, hid_t frame, PetscReal time, const char *path)
{
  const hid_t group = SbH5OpenGroup(frame, "contacts");
  SbArray array[NTABLE];
  PetscInt bytes = out->precise ? 8 : 4;
  int64_t n = 0;
  PetscBool ok;
  char name[64];

  PetscFunctionBeginUser;
  if (group < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbH5GetInt(group, "count", &n, &ok);
  if (n)
    (void)SbH5Rows(group, "gap", &bytes);
  (void)H5Gclose(group);
  if (!out->contact_index)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < NTABLE; k++)
    array[k] = (SbArray){.name = table[k].name,
                         .ncomp = table[k].ncomp,
                         .bytes = table[k].whole ? 4 : (int)bytes,
                         .whole = table[k].whole};
  (void)snprintf(name, sizeof(name), "%s/contacts", path);
  PetscCall(SbIndexAdd(out->contact_index, time, name, (PetscInt)n, NTABLE - 1, array + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}
