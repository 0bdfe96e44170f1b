/*
  halo_plan.c - which facets go to which rank.

  What looks are own points and own edges; the latter with the box of their motion. A rank tells all others the boxes of what looks and of
  its facets, part by part; two ranks whose boxes, grown by reach and margin, meet
  are neighbours, and both see it. A rank cuts what looks and lies within the facet boxes of neighbours, again part by part, by a
  recursive median split into at most 64 boxes, and sends these. It gets every facet whose own box meets one of them: a contact of
  small extent moves few facets, however large the surface. Ranks that share nothing say nothing to each other.

  At an edge or a vertex a detector asks for all facets there. The nearest place q of a facet is within reach of the point; a
  facet that shares the edge or vertex has q in its box, so it comes too, whoever owns it. The same holds for the place of an edge that is
  near an own edge: both its facets come. With CR and DG the copies of a vertex lie
  apart: there the box of a facet holds all copies of its vertices.
*/
#include "surface_impl.h"

#define SPLITS 6 /* what looks of a part is cut into 2^6 boxes at most */
#define LEAST 4  /* points and edges that are not cut further */
#define ENTRY 13 /* part, box of what looks, box of facets */

/* What is needed while the list is made. */
typedef struct {
  PetscReal grown;    /* reach and margin, m */
  PetscReal *facet;   /* [nfacet_owned][6] boxes of own facets */
  PetscInt nlook;     /* own points and own edges */
  PetscReal *look;    /* [nlook][6] their boxes */
  PetscInt nmine;     /* parts that have facets or points here */
  PetscReal *mine;    /* [nmine][ENTRY] */
  PetscReal *entry;   /* [start[size]][ENTRY] those of all ranks */
  PetscMPIInt *start; /* [size+1] */
  PetscInt nnear;
  PetscReal (*near)[7]; /* [nnear] part and box of what looks within the facet boxes of neighbours */
} Plan;

/* Boxes of own corners, points, edges and facets; a facet's holds all copies of its vertices. */
static PetscErrorCode sweep(SbContactSurface s, const PetscReal u0[], const PetscReal u[], Plan *plan)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  PetscReal *swept = d->halo.swept, *vertex, x[3];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < d->ncorner_owned + s->scene.npoint; i++) {
    const PetscInt j = i - d->ncorner_owned;

    SbBoxClear(swept + 6 * i);
    SbBoxAdd(swept + 6 * i, j < 0 ? d->x + 3 * i : d->p + 3 * j);
    SbBoxAdd(swept + 6 * i, j < 0 ? d->x0 + 3 * i : d->p0 + 3 * j);
  }
  plan->nlook = s->scene.npoint + d->edges.nown;
  PetscCall(PetscMalloc1(6 * plan->nlook, &plan->look));
  PetscCall(PetscArraycpy(plan->look, swept + 6 * d->ncorner_owned, 6 * s->scene.npoint));
  for (PetscInt i = 0; i < d->edges.nown; i++) {
    PetscReal *box = plan->look + 6 * (s->scene.npoint + i);

    SbBoxClear(box);
    for (int k = 0; k < 2; k++) SbBoxMerge(box, swept + 6 * d->edges.corner[4 * i + k]);
  }
  PetscCall(PetscMalloc1(6 * s->nfacet_owned, &plan->facet));
  PetscCall(PetscMalloc1(6 * d->nvertex, &vertex));
  for (PetscInt v = 0; v < d->nvertex; v++) SbBoxClear(vertex + 6 * v);
  for (PetscInt i = 0; i < 3 * d->nlocal; i++) {
    const SbContactSurfaceFacet *f = &d->local[i / 3];

    SbContactSurfacePosition(s->space, f->at[i % 3], u, x);
    SbBoxAdd(vertex + 6 * f->vertex[i % 3], x);
    if (u0) SbContactSurfacePosition(s->space, f->at[i % 3], u0, x);
    SbBoxAdd(vertex + 6 * f->vertex[i % 3], x);
  }
  for (PetscInt i = 0; i < d->nlocal; i++) {
    const SbContactSurfaceFacet *f = &d->local[i];

    if (f->own < 0) continue;
    SbBoxClear(plan->facet + 6 * f->own);
    for (int k = 0; k < 3; k++) SbBoxMerge(plan->facet + 6 * f->own, vertex + 6 * f->vertex[k]);
  }
  PetscCall(PetscFree(vertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of what looks. */
static inline PetscInt look_part(SbContactSurface s, PetscInt i)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;

  return i < s->scene.npoint ? d->point_part[i] : d->edges.part[i - s->scene.npoint];
}

/* The parts on each rank, with the boxes of what looks and of their facets there. */
static PetscErrorCode gather_parts(SbContactSurface s, Plan *plan)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbHalo *h = &d->halo;
  PetscMPIInt *count, mine;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(ENTRY * d->npart, &plan->mine));
  for (PetscInt b = 0; b < d->npart; b++) {
    plan->mine[ENTRY * b] = -1;
    SbBoxClear(plan->mine + ENTRY * b + 1);
    SbBoxClear(plan->mine + ENTRY * b + 7);
  }
  for (PetscInt i = 0; i < plan->nlook; i++) {
    const PetscInt part = look_part(s, i);

    plan->mine[ENTRY * part] = (PetscReal)part;
    SbBoxMerge(plan->mine + ENTRY * part + 1, plan->look + 6 * i);
  }
  for (PetscInt f = 0; f < s->nfacet_owned; f++) {
    plan->mine[ENTRY * d->facet_part[f]] = (PetscReal)d->facet_part[f];
    SbBoxMerge(plan->mine + ENTRY * d->facet_part[f] + 7, plan->facet + 6 * f);
  }
  for (PetscInt b = 0; b < d->npart; b++) {
    if (plan->mine[ENTRY * b] < 0) continue;
    if (b != plan->nmine)
      PetscCall(PetscArraycpy(plan->mine + ENTRY * plan->nmine, plan->mine + ENTRY * b, ENTRY));
    plan->nmine++;
  }
  PetscCall(PetscMPIIntCast(ENTRY * plan->nmine, &mine));
  PetscCall(PetscMalloc1(h->size, &count));
  PetscCall(PetscMalloc1(h->size + 1, &plan->start));
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, count, 1, MPI_INT, h->comm));
  plan->start[0] = 0;
  for (PetscMPIInt r = 0; r < h->size; r++) plan->start[r + 1] = plan->start[r] + count[r];
  PetscCall(PetscMalloc1(plan->start[h->size], &plan->entry));
  PetscCallMPI(
    MPI_Allgatherv(plan->mine, mine, MPIU_REAL, plan->entry, count, plan->start, MPIU_REAL, h->comm));
  for (PetscMPIInt r = 0; r <= h->size; r++) plan->start[r] /= ENTRY;
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether points of one part may meet facets of the other. */
static inline PetscBool wanted(const SbHalo *h, PetscReal point_part, PetscReal facet_part)
{
  return (PetscBool)(h->self || point_part != facet_part);
}

/* Neighbours: whose points are near own facets (to), whose facets are near own points (from). The other side finds the same. */
static PetscErrorCode find_neighbours(SbHalo *h, const Plan *plan)
{
  PetscFunctionBeginUser;
  h->nto = h->nfrom = 0;
  for (PetscMPIInt r = 0; r < h->size; r++) {
    PetscBool gives = PETSC_FALSE, takes = PETSC_FALSE;

    for (PetscMPIInt j = plan->start[r]; j < plan->start[r + 1] && r != h->rank; j++) {
      const PetscReal *theirs = plan->entry + ENTRY * j;

      for (PetscInt i = 0; i < plan->nmine; i++) {
        const PetscReal *own = plan->mine + ENTRY * i;

        if (!wanted(h, own[0], theirs[0])) continue;
        if (SbBoxesWithin(theirs + 1, own + 7, plan->grown)) gives = PETSC_TRUE;
        if (SbBoxesWithin(own + 1, theirs + 7, plan->grown)) takes = PETSC_TRUE;
      }
    }
    if (gives) h->to[h->nto++] = r;
    if (takes) h->from[h->nfrom++] = r;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a box of points of a part is near a part's facets on rank r. */
static PetscBool near_rank(const SbHalo *h, const Plan *plan, PetscMPIInt r, PetscReal part,
                           const PetscReal box[6])
{
  for (PetscMPIInt j = plan->start[r]; j < plan->start[r + 1]; j++) {
    const PetscReal *theirs = plan->entry + ENTRY * j;

    if (wanted(h, part, theirs[0]) && SbBoxesWithin(box, theirs + 7, plan->grown)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Puts the `half` boxes with the lowest middles along an axis first (Hoare's selection). */
static void select_low(const PetscReal swept[], int axis, PetscInt half, PetscInt n, PetscInt index[])
{
  PetscInt from = 0, to = n - 1;

  while (from < to) {
    const PetscReal *middle = swept + 6 * index[(from + to) / 2];
    const PetscReal pivot = middle[axis] + middle[3 + axis];
    PetscInt i = from, j = to;

    while (i <= j) {
      while (swept[6 * index[i] + axis] + swept[6 * index[i] + 3 + axis] < pivot) i++;
      while (swept[6 * index[j] + axis] + swept[6 * index[j] + 3 + axis] > pivot) j--;
      if (i > j) break;
      const PetscInt keep = index[i];

      index[i++] = index[j];
      index[j--] = keep;
    }
    if (half <= j)
      to = j;
    else if (half >= i)
      from = i;
    else
      break;
  }
}

/* Appends the boxes of n points of a part, cut at most `depth` times along the longest side. */
static void split(const PetscReal swept[], PetscReal part, int depth, PetscInt n, PetscInt index[],
                  Plan *plan)
{
  PetscReal box[6];
  int axis = 0;

  SbBoxClear(box);
  for (PetscInt i = 0; i < n; i++) SbBoxMerge(box, swept + 6 * index[i]);
  if (!depth || n <= LEAST) {
    plan->near[plan->nnear][0] = part;
    for (int k = 0; k < 6; k++) plan->near[plan->nnear][1 + k] = box[k];
    plan->nnear++;
    return;
  }
  for (int k = 1; k < 3; k++) {
    if (box[3 + k] - box[k] > box[3 + axis] - box[axis]) axis = k;
  }
  select_low(swept, axis, n / 2, n, index);
  split(swept, part, depth - 1, n / 2, index, plan);
  split(swept, part, depth - 1, n - n / 2, index + n / 2, plan);
}

/* Boxes of what looks within the facet boxes of neighbours. */
static PetscErrorCode find_near(SbContactSurface s, Plan *plan)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  const SbHalo *h = &d->halo;
  PetscInt n = 0, *index, *part;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(plan->nlook, &index, plan->nlook, &part));
  for (PetscInt i = 0; i < plan->nlook; i++) {
    for (PetscInt k = 0; k < h->nfrom; k++) {
      if (!near_rank(h, plan, h->from[k], (PetscReal)look_part(s, i), plan->look + 6 * i)) continue;
      index[n] = i;
      part[n++] = look_part(s, i);
      break;
    }
  }
  PetscCall(PetscSortIntWithArray(n, part, index));
  PetscCall(PetscMalloc1(PetscMin(n, plan->nmine << SPLITS), &plan->near));
  for (PetscInt i = 0, end; i < n; i = end) {
    for (end = i + 1; end < n && part[end] == part[i]; end++)
      ;
    split(plan->look, (PetscReal)part[i], SPLITS, end - i, index + i, plan);
  }
  PetscCall(PetscFree2(index, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends the own facets that are near n boxes of points; room for all is there. */
static void choose(SbContactSurface s, const Plan *plan, PetscInt n, PetscReal (*box)[7], PetscInt *nsend,
                   PetscInt send[])
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)s->data;
  PetscReal all[6];

  SbBoxClear(all);
  for (PetscInt j = 0; j < n; j++) SbBoxMerge(all, box[j] + 1);
  for (PetscInt f = 0; f < s->nfacet_owned; f++) {
    if (!SbBoxesWithin(plan->facet + 6 * f, all, plan->grown)) continue;
    for (PetscInt j = 0; j < n; j++) {
      if (!wanted(&d->halo, box[j][0], (PetscReal)d->facet_part[f])) continue;
      if (!SbBoxesWithin(plan->facet + 6 * f, box[j] + 1, plan->grown)) continue;
      send[(*nsend)++] = f;
      break;
    }
  }
}

/* Receives the points' boxes of each rank in `to` and lists the facets for it. */
static PetscErrorCode choose_all(SbContactSurface s, const Plan *plan)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;
  PetscInt n = 0, room = 0;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < h->nto; k++) {
    PetscReal(*box)[7];
    PetscMPIInt count;
    MPI_Status status;

    PetscCallMPI(MPI_Probe(h->to[k], h->tag[0], h->comm, &status));
    PetscCallMPI(MPI_Get_count(&status, MPIU_REAL, &count));
    PetscCall(PetscMalloc1(count / 7, &box));
    PetscCallMPI(MPI_Recv(box, count, MPIU_REAL, h->to[k], h->tag[0], h->comm, MPI_STATUS_IGNORE));
    if (room < n + s->nfacet_owned) {
      room = 2 * n + s->nfacet_owned;
      PetscCall(PetscRealloc((size_t)room * sizeof(*h->send), &h->send));
    }
    h->to_start[k] = n;
    choose(s, plan, count / 7, box, &n, h->send);
    PetscCall(PetscFree(box));
  }
  h->to_start[h->nto] = n;
  /* what was set aside for whole surfaces goes back */
  PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(*h->send), &h->send));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Own boxes of points to those who have the facets, theirs to the list of what to send. */
static PetscErrorCode agree(SbContactSurface s, Plan *plan)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  SbHalo *h = &d->halo;
  PetscReal(*out)[7];
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(find_near(s, plan));
  PetscCall(PetscMalloc1(h->nfrom * plan->nnear, &out));
  for (PetscInt k = 0; k < h->nfrom; k++) {
    const PetscInt first = n;
    PetscMPIInt count;

    for (PetscInt j = 0; j < plan->nnear; j++) {
      if (!near_rank(h, plan, h->from[k], plan->near[j][0], plan->near[j] + 1)) continue;
      PetscCall(PetscArraycpy(out[n], plan->near[j], 7));
      n++;
    }
    PetscCall(PetscMPIIntCast(7 * (n - first), &count));
    PetscCallMPI(MPI_Isend(out + first, count, MPIU_REAL, h->from[k], h->tag[0], h->comm, &h->request[k]));
  }
  PetscCall(choose_all(s, plan));
  PetscCallMPI(MPI_Waitall((PetscMPIInt)h->nfrom, h->request, MPI_STATUSES_IGNORE));
  PetscCall(PetscFree(out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHaloPlan(SbContactSurface s, const PetscReal u0[], const PetscReal u[], PetscReal grown)
{
  SbContactSurfaceData *d = (SbContactSurfaceData *)s->data;
  Plan plan = {.grown = grown};

  PetscFunctionBeginUser;
  PetscCall(sweep(s, u0, u, &plan));
  PetscCall(gather_parts(s, &plan));
  PetscCall(find_neighbours(&d->halo, &plan));
  PetscCall(agree(s, &plan));
  PetscCall(PetscFree(plan.facet));
  PetscCall(PetscFree(plan.look));
  PetscCall(PetscFree(plan.mine));
  PetscCall(PetscFree(plan.entry));
  PetscCall(PetscFree(plan.start));
  PetscCall(PetscFree(plan.near));
  PetscFunctionReturn(PETSC_SUCCESS);
}
