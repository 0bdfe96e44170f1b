/*
  halo.c - facets of other ranks that are near the points and edges of this one, and where they are now.

  Each update first learns, by one reduction, the box of each part over all ranks, the motion of the step, and how far
  anything has moved since the list was made. Boxes are swept: they hold the start of the step and now. Parts whose boxes, grown
  by the reach, do not meet are not close, and without self-contact nothing else happens.

  The list is made by halo_plan.c with boxes grown by reach and margin. It stays good while nothing has left its box of that time
  by more than half the margin, in any coordinate: two boxes that meet now when grown by the reach then met when grown
  by reach and margin. Until then only positions are sent.

  A displacement that is no number makes no box larger and no list older: all ranks go on alike, and the solver refuses it.
*/
#include "surface_impl.h"

#define MARGIN 0.5  /* of the mean edge */
#define HALF 0.4999 /* of the margin: how far things may move; less than half by more than rounding */
#define NUMBERS 9   /* of a facet: identity, part, vertices, nodes */
#define REALS 22    /* weights, rest corners, height */

/* ------------------------------------------------------------------ where everything is */

/* How far x lies outside a box in any coordinate, m; negative inside. */
static inline PetscReal outside(const PetscReal box[6], const PetscReal x[3])
{
  PetscReal far = -PETSC_MAX_REAL;

  for (int k = 0; k < 3; k++) far = PetscMax(far, PetscMax(box[k] - x[k], x[k] - box[3 + k]));
  return far;
}

/* Adds n places and their starts: the parts' boxes, the motion of the step, the motion since the list was made. */
static void look_at(SbHalo *h, PetscInt npart, PetscInt n, const PetscInt part[], const PetscReal x[],
                    const PetscReal x0[], const PetscReal swept[])
{
  PetscReal *most = h->reduced + 6 * npart;

  for (PetscInt i = 0; i < n; i++) {
    PetscReal *box = h->reduced + 6 * part[i];

    SbBoxAdd(box, x + 3 * i);
    SbBoxAdd(box, x0 + 3 * i);
    for (int k = 0; k < 3; k++) most[0] = PetscMax(most[0], PetscAbsReal(x[3 * i + k] - x0[3 * i + k]));
    if (h->built)
      most[1] =
        PetscMax(most[1], PetscMax(outside(swept + 6 * i, x + 3 * i), outside(swept + 6 * i, x0 + 3 * i)));
  }
}

/* The same over all ranks. */
static PetscErrorCode reduce_motion(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;
  const PetscInt n = 6 * d->npart;
  PetscMPIInt count;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < d->npart; b++) SbBoxClear(h->reduced + 6 * b);
  h->reduced[n] = h->reduced[n + 1] = 0;
  look_at(h, d->npart, d->ncorner_owned, d->corner_part, d->x, d->x0, h->swept);
  look_at(h, d->npart, s->scene.npoint, d->point_part, d->p, d->p0, h->swept + 6 * d->ncorner_owned);
  /* the least of lower corners is the largest of their negatives */
  for (PetscInt i = 0; i < n; i++) h->reduced[i] = i % 6 < 3 ? -h->reduced[i] : h->reduced[i];
  PetscCall(PetscMPIIntCast(n + 2, &count));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, h->reduced, count, MPIU_REAL, MPI_MAX, h->comm));
  for (PetscInt i = 0; i < n; i++) h->reduced[i] = i % 6 < 3 ? -h->reduced[i] : h->reduced[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two parts' boxes meet; they are looked through in the order of their lower x. */
static PetscErrorCode are_close(SbHalo *h, PetscInt npart, PetscReal reach, PetscBool *close)
{
  PetscFunctionBeginUser;
  *close = PETSC_FALSE;
  for (PetscInt b = 0; b < npart; b++) {
    h->low[b] = h->reduced[6 * b];
    h->order[b] = b;
  }
  PetscCall(PetscSortRealWithArrayInt(npart, h->low, h->order));
  for (PetscInt i = 0; i < npart && !*close; i++) {
    const PetscReal *a = h->reduced + 6 * h->order[i];

    for (PetscInt j = i + 1; j < npart && h->low[j] - reach <= a[3] && !*close; j++)
      *close = SbBoxesWithin(a, h->reduced + 6 * h->order[j], reach);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ facets from rank to rank */

/* What does not move of the facets in the list. */
static void pack(SbContactSurface s, PetscInt number[], PetscReal real[])
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbHalo *h = &d->halo;

  for (PetscInt i = 0; i < h->to_start[h->nto]; i++, number += NUMBERS, real += REALS) {
    const PetscInt f = h->send[i];

    number[0] = d->facet_id[f];
    number[1] = d->facet_part[f];
    for (int k = 0; k < 3; k++) number[2 + k] = d->facet_vertex[3 * f + k];
    for (int a = 0; a < 4; a++) number[5 + a] = s->facet_node[4 * f + a];
    for (int a = 0; a < 12; a++) real[a] = s->facet_weight[12 * f + a];
    for (int k = 0; k < 9; k++) real[12 + k] = d->X[3 * d->facet[3 * f + k / 3] + k % 3];
    real[21] = s->facet_height[f];
  }
}

/* The scene gets the facets of others; its version grows when they are other ones. */
static PetscErrorCode unpack(SbContactSurface s, PetscInt n, const PetscInt number[], const PetscReal real[])
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  PetscBool same = (PetscBool)(s->scene.nfacet == s->nfacet_owned + n);

  PetscFunctionBeginUser;
  PetscCall(SbContactSurfaceSetForeign(s, n));
  for (PetscInt i = 0; i < n; i++, number += NUMBERS, real += REALS) {
    const PetscInt f = s->nfacet_owned + i, c = d->ncorner_owned + 3 * i;

    same = (PetscBool)(same && d->facet_id[f] == number[0]);
    d->facet_id[f] = number[0];
    d->facet_part[f] = number[1];
    for (int k = 0; k < 3; k++) {
      d->facet_vertex[3 * f + k] = number[2 + k];
      d->facet[3 * f + k] = c + k;
    }
    for (int a = 0; a < 4; a++) s->facet_node[4 * f + a] = number[5 + a];
    for (int a = 0; a < 12; a++) s->facet_weight[12 * f + a] = real[a];
    for (int k = 0; k < 9; k++) d->X[3 * c + k] = real[12 + k];
    s->facet_height[f] = real[21];
  }
  if (!same) {
    s->scene.version++;
    PetscCall(SbContactSurfaceOtherEdges(s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends items `width` long to the ranks in `to`, or receives them from those in `from`. */
static PetscErrorCode post(SbHalo *h, PetscBool sends, PetscMPIInt tag, MPI_Datatype type, PetscInt width,
                           void *data, MPI_Request request[])
{
  const PetscInt n = sends ? h->nto : h->nfrom, *start = sends ? h->to_start : h->from_start;
  const size_t bytes = (size_t)width * (type == MPIU_INT ? sizeof(PetscInt) : sizeof(PetscReal));

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n; k++) {
    char *at = (char *)data + bytes * (size_t)start[k];
    PetscMPIInt count;

    PetscCall(PetscMPIIntCast(width * (start[k + 1] - start[k]), &count));
    if (sends)
      PetscCallMPI(MPI_Isend(at, count, type, h->to[k], tag, h->comm, &request[k]));
    else
      PetscCallMPI(MPI_Irecv(at, count, type, h->from[k], tag, h->comm, &request[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How many facets each rank in `from` sends. */
static PetscErrorCode exchange_counts(SbHalo *h)
{
  PetscInt *count;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(h->nto + h->nfrom, &count));
  for (PetscInt k = 0; k < h->nto; k++) {
    count[k] = h->to_start[k + 1] - h->to_start[k];
    PetscCallMPI(MPI_Isend(&count[k], 1, MPIU_INT, h->to[k], h->tag[1], h->comm, &h->request[k]));
  }
  for (PetscInt k = 0; k < h->nfrom; k++)
    PetscCallMPI(
      MPI_Irecv(&count[h->nto + k], 1, MPIU_INT, h->from[k], h->tag[1], h->comm, &h->request[h->nto + k]));
  PetscCallMPI(MPI_Waitall((PetscMPIInt)(h->nto + h->nfrom), h->request, MPI_STATUSES_IGNORE));
  h->from_start[0] = 0;
  for (PetscInt k = 0; k < h->nfrom; k++) h->from_start[k + 1] = h->from_start[k] + count[h->nto + k];
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves out the ranks that nothing goes to or comes from. */
static PetscInt drop_silent(PetscInt n, PetscMPIInt rank[], PetscInt start[])
{
  PetscInt m = 0;

  for (PetscInt k = 0; k < n; k++) {
    if (start[k] == start[k + 1]) continue;
    rank[m] = rank[k];
    start[m++] = start[k];
  }
  start[m] = start[n];
  return m;
}

/* Sends what does not move of the listed facets. */
static PetscErrorCode exchange_facets(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;
  PetscInt *number, nsend, nrecv;
  PetscReal *real;

  PetscFunctionBeginUser;
  PetscCall(exchange_counts(h));
  h->nto = drop_silent(h->nto, h->to, h->to_start);
  h->nfrom = drop_silent(h->nfrom, h->from, h->from_start);
  nsend = h->to_start[h->nto];
  nrecv = h->from_start[h->nfrom];
  PetscCall(PetscMalloc2(NUMBERS * (nsend + nrecv), &number, REALS * (nsend + nrecv), &real));
  pack(s, number, real);
  PetscCall(post(h, PETSC_TRUE, h->tag[2], MPIU_INT, NUMBERS, number, h->request));
  PetscCall(post(h, PETSC_TRUE, h->tag[3], MPIU_REAL, REALS, real, h->request + h->nto));
  PetscCall(
    post(h, PETSC_FALSE, h->tag[2], MPIU_INT, NUMBERS, number + NUMBERS * nsend, h->request + 2 * h->nto));
  PetscCall(post(h, PETSC_FALSE, h->tag[3], MPIU_REAL, REALS, real + REALS * nsend,
                 h->request + 2 * h->nto + h->nfrom));
  PetscCallMPI(MPI_Waitall((PetscMPIInt)(2 * (h->nto + h->nfrom)), h->request, MPI_STATUSES_IGNORE));
  PetscCall(unpack(s, nrecv, number + NUMBERS * nsend, real + REALS * nsend));
  PetscCall(PetscFree2(number, real));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the list. `motion`: largest in the step, m. */
static PetscErrorCode build(SbContactSurface s, const PetscReal u0[], const PetscReal u[], PetscReal motion)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;

  PetscFunctionBeginUser;
  h->built = PETSC_TRUE;
  h->self = s->scene.self;
  h->reach = SbDetectRange(&s->scene);
  /* what moves on as in this step is still in the list at the next one; but far ahead the list is not worth its size */
  h->margin = MARGIN * s->edge + PetscMin(2 * motion, s->edge);
  h->nbuild++;
  PetscCall(SbHaloPlan(s, u0, u, h->reach + h->margin));
  PetscCall(exchange_facets(s));
  PetscCall(PetscFree(h->buffer));
  PetscCall(PetscMalloc1(18 * (size_t)h->to_start[h->nto], &h->buffer));
  PetscCall(PetscInfo(NULL,
                      "Surface: list %" PetscInt_FMT " with a margin of %g m: %" PetscInt_FMT
                      " facets to %" PetscInt_FMT " ranks, %" PetscInt_FMT " from %" PetscInt_FMT "\n",
                      h->nbuild, (double)h->margin, h->to_start[h->nto], h->nto, h->from_start[h->nfrom],
                      h->nfrom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions of the listed facets. */
static PetscErrorCode exchange_positions(SbContactSurface s, PetscBool moving)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;
  const size_t n = 9 * (size_t)h->to_start[h->nto];
  PetscInt nrequest = 0;

  PetscFunctionBeginUser;
  for (int which = 0; which < (moving ? 2 : 1); which++) {
    PetscReal *x = which ? d->x0 : d->x, *out = h->buffer + (size_t)which * n;

    PetscCall(
      post(h, PETSC_FALSE, h->tag[which], MPIU_REAL, 9, x + 3 * d->ncorner_owned, h->request + nrequest));
    nrequest += h->nfrom;
    for (PetscInt i = 0; i < 3 * h->to_start[h->nto]; i++) {
      const PetscReal *from = x + 3 * d->facet[3 * h->send[i / 3] + i % 3];

      for (int k = 0; k < 3; k++) out[3 * i + k] = from[k];
    }
    PetscCall(post(h, PETSC_TRUE, h->tag[which], MPIU_REAL, 9, out, h->request + nrequest));
    nrequest += h->nto;
  }
  PetscCallMPI(MPI_Waitall((PetscMPIInt)nrequest, h->request, MPI_STATUSES_IGNORE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHaloUpdate(SbContactSurface s, const PetscReal u0[], const PetscReal u[], PetscBool *close)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;
  const PetscReal *most = h->reduced + 6 * d->npart;

  PetscFunctionBeginUser;
  PetscCall(reduce_motion(s));
  PetscCall(are_close(h, d->npart, s->scene.reach, close));
  if (h->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  if (!*close && !s->scene.self) {
    if (h->built) PetscCall(unpack(s, 0, NULL, NULL));
    h->built = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!h->built || SbDetectRange(&s->scene) > h->reach || (s->scene.self && !h->self) ||
      !(most[1] <= HALF * h->margin))
    PetscCall(build(s, u0, u, most[0]));
  PetscCall(exchange_positions(s, (PetscBool)(u0 != NULL)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHaloCreate(SbContactSurface s)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;

  PetscFunctionBeginUser;
  PetscCall(PetscCommDuplicate(s->space->comm, &h->comm, &h->tag[0]));
  for (int k = 1; k < 4; k++) PetscCall(PetscCommGetNewTag(h->comm, &h->tag[k]));
  PetscCallMPI(MPI_Comm_size(h->comm, &h->size));
  PetscCallMPI(MPI_Comm_rank(h->comm, &h->rank));
  PetscCall(PetscMalloc1(6 * d->npart + 2, &h->reduced));
  PetscCall(PetscMalloc2(d->npart, &h->low, d->npart, &h->order));
  PetscCall(PetscMalloc1(6 * (d->ncorner_owned + s->scene.npoint), &h->swept));
  PetscCall(PetscMalloc3(h->size, &h->to, h->size, &h->from, 4 * h->size, &h->request));
  PetscCall(PetscCalloc2(h->size + 1, &h->to_start, h->size + 1, &h->from_start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHaloDestroy(SbHalo *h)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(h->reduced));
  PetscCall(PetscFree2(h->low, h->order));
  PetscCall(PetscFree(h->swept));
  PetscCall(PetscFree3(h->to, h->from, h->request));
  PetscCall(PetscFree2(h->to_start, h->from_start));
  PetscCall(PetscFree(h->send));
  PetscCall(PetscFree(h->buffer));
  PetscCall(PetscCommDestroy(&h->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
