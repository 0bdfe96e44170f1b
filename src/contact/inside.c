/*
  inside.c - which points of a surface lie in tets: of other bodies and, where that is wanted, of their own.

  A tree over the boxes of the tets gives those around a point, and barycentric coordinates decide. Its order stays while the tets move.

  Points go to the tets: each rank tells the boxes of its tets, body by body, and gets the points of others that are within them; what goes back are
  two numbers for each point. Who asks does so only while boxes of two bodies meet.

  A point on the boundary of a body is not inside, be its facets among those of the surface or not. In meshes that coincide such points are common, and so are those
  on edges and faces within a body: the tet with the boundary facet, on whichever rank, tells which it is. With CR and DG tets come apart a little, and a point in
  such a joint is in none.
*/
#include "sbgeometry.h"
#include "surface_impl.h"
#include "sblog.h"

#define ON 1e-6   /* of a barycentric coordinate, and of a tet's box: so near a face a point lies on it */
#define FLAT 1e-9 /* six times the volume over the cubed longest edge, below which nothing is in a tet */
#define BOX 7     /* a part, and the box of its tets on a rank */

#define ASK 7  /* numbers of a point that is asked for: its place now and at rest, its part */
#define REST 2 /* in reaches: tets that are nearer at rest are its own surroundings (near.c) */

struct _p_SbInside {
  SbContactSurface surface;
  PetscInt ncell;
  PetscInt *cell;      /* [ncell] own cells of the parts that have a surface anywhere */
  PetscInt *part;      /* [ncell] */
  PetscReal (*box)[6]; /* [ncell] now, m */
  SbBoxTree tree;
};

/* The part that a point is in, and one that it is on the boundary of; -1: none. Goes as MPIU_2INT. */
typedef struct {
  PetscInt in, on;
} Answer;

/* Numbers that go from rank to rank: how many, and where those of each rank begin. */
typedef struct {
  PetscMPIInt *to, *to_start, *from, *from_start; /* [size] */
  PetscInt nto, nfrom;                            /* in all */
} Mail;

/* ------------------------------------------------------------------ set-up */

/* Own cells of the parts that have a surface anywhere. */
static PetscErrorCode list_cells(SbInside in)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)in->surface->data;
  const SbMesh mesh = in->surface->space->mesh;
  PetscInt *wanted; /* [npart] */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(d->npart, &wanted));
  for (PetscInt f = 0; f < in->surface->nfacet_owned; f++) wanted[d->facet_part[f]] = 1;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, wanted, (PetscMPIInt)d->npart, MPIU_INT, MPI_MAX, d->halo.comm));
  PetscCall(PetscMalloc2(mesh->ncell_owned, &in->cell, mesh->ncell_owned, &in->part));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    if (!wanted[mesh->cell_body[c]]) continue;
    in->cell[in->ncell] = c;
    in->part[in->ncell++] = mesh->cell_body[c];
  }
  PetscCall(PetscFree(wanted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInsideCreate(SbContactSurface surface, SbInside *inside)
{
  SbInside in;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&in));
  *inside = in;
  in->surface = surface;
  PetscCall(list_cells(in));
  PetscCall(PetscMalloc1(in->ncell, &in->box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInsideDestroy(SbInside *inside)
{
  SbInside in = *inside;

  PetscFunctionBeginUser;
  if (!in) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBoxTreeDestroy(&in->tree));
  PetscCall(PetscFree(in->box));
  PetscCall(PetscFree2(in->cell, in->part));
  PetscCall(PetscFree(*inside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ from rank to rank */

static PetscErrorCode create_mail(PetscMPIInt size, Mail *mail)
{
  PetscFunctionBeginUser;
  PetscCall(PetscCalloc4(size, &mail->to, size, &mail->to_start, size, &mail->from, size, &mail->from_start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_mail(Mail *mail)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree4(mail->to, mail->to_start, mail->from, mail->from_start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All but mail->to, which is there. */
static PetscErrorCode address(const SbHalo *h, Mail *mail)
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Alltoall(mail->to, 1, MPI_INT, mail->from, 1, MPI_INT, h->comm));
  mail->nto = mail->nfrom = 0;
  for (PetscMPIInt r = 0; r < h->size; r++) {
    PetscCall(PetscMPIIntCast(mail->nto, &mail->to_start[r]));
    PetscCall(PetscMPIIntCast(mail->nfrom, &mail->from_start[r]));
    mail->nto += mail->to[r];
    mail->nfrom += mail->from[r];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The boxes of the tets of all parts on all ranks, [start[size]][BOX]; room for them is allocated. */
static PetscErrorCode gather_boxes(SbInside in, PetscMPIInt start[], PetscReal **all)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)in->surface->data;
  const SbHalo *h = &d->halo;
  PetscReal *mine;
  PetscMPIInt n = 0, *count, *at;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(BOX * d->npart, &mine));
  PetscCall(PetscMalloc2(h->size, &count, h->size, &at));
  for (PetscInt b = 0; b < d->npart; b++) {
    mine[BOX * b] = -1;
    SbBoxClear(mine + BOX * b + 1);
  }
  for (PetscInt j = 0; j < in->ncell; j++) {
    mine[BOX * in->part[j]] = (PetscReal)in->part[j];
    SbBoxMerge(mine + BOX * in->part[j] + 1, in->box[j]);
  }
  for (PetscInt b = 0; b < d->npart; b++) {
    if (mine[BOX * b] < 0) continue;
    PetscCall(PetscArraymove(mine + BOX * n, mine + BOX * b, BOX));
    n++;
  }
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, count, 1, MPI_INT, h->comm));
  start[0] = 0;
  for (PetscMPIInt r = 0; r < h->size; r++) {
    start[r + 1] = start[r] + count[r];
    count[r] *= BOX;
    at[r] = BOX * start[r];
  }
  PetscCall(PetscMalloc1(BOX * start[h->size], all));
  PetscCallMPI(MPI_Allgatherv(mine, BOX * n, MPIU_REAL, *all, count, at, MPIU_REAL, h->comm));
  PetscCall(PetscFree2(count, at));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a point is within one of n boxes of tets that it is searched for in. */
static PetscBool within(PetscInt n, const PetscReal box[], PetscBool self, PetscInt part,
                        const PetscReal x[3])
{
  for (PetscInt j = 0; j < n; j++, box += BOX) {
    if (!self && box[0] == (PetscReal)part) continue;
    if (x[0] >= box[1] && x[1] >= box[2] && x[2] >= box[3] && x[0] <= box[4] && x[1] <= box[5] &&
        x[2] <= box[6])
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/*
  Sends own points to the ranks that may have tets around them. Output, allocated: sent[mail->nto], which points these were; asked[mail->nfrom][ASK],
  those of all ranks for this one.
*/
static PetscErrorCode ask(SbInside in, const PetscReal u[], PetscBool self, Mail *mail, PetscInt **sent,
                          PetscReal **asked)
{
  const SbContactSurfaceData *d = (const SbContactSurfaceData *)in->surface->data;
  const SbHalo *h = &d->halo;
  const SbSpace space = in->surface->space;
  PetscReal *box, *x, *out;
  PetscMPIInt *start;
  MPI_Datatype type;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(h->size + 1, &start));
  PetscCall(gather_boxes(in, start, &box));
  PetscCall(PetscMalloc1(3 * in->surface->scene.npoint, &x));
  for (PetscInt i = 0; i < 3 * in->surface->scene.npoint; i++) {
    const PetscInt at = 3 * in->surface->point_node[i / 3] + i % 3;

    x[i] = space->node_x[at] + u[at];
  }
  *sent = NULL;
  for (int pass = 0; pass < 2; pass++) { /* counts, then lists */
    for (PetscMPIInt r = 0; r < h->size; r++) {
      for (PetscInt i = 0; i < in->surface->scene.npoint; i++) {
        if (!within(start[r + 1] - start[r], box + BOX * start[r], self, d->point_part[i], x + 3 * i))
          continue;
        if (pass)
          (*sent)[n++] = i;
        else
          mail->to[r]++;
      }
    }
    if (!pass) PetscCall(address(h, mail));
    if (!pass) PetscCall(PetscMalloc1(mail->nto, sent));
  }
  PetscCall(PetscMalloc1(ASK * mail->nto, &out));
  PetscCall(PetscMalloc1(ASK * mail->nfrom, asked));
  for (PetscInt j = 0; j < mail->nto; j++) {
    for (int k = 0; k < 3; k++) {
      out[ASK * j + k] = x[3 * (*sent)[j] + k];
      out[ASK * j + 3 + k] = d->P[3 * (*sent)[j] + k];
    }
    out[ASK * j + 6] = (PetscReal)d->point_part[(*sent)[j]];
  }
  PetscCallMPI(MPI_Type_contiguous(ASK, MPIU_REAL, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(
    MPI_Alltoallv(out, mail->to, mail->to_start, type, *asked, mail->from, mail->from_start, type, h->comm));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(out));
  PetscCall(PetscFree(x));
  PetscCall(PetscFree(box));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ points in tets */

/* Six times the volume of the tet of three edges from one corner. */
static inline PetscReal volume(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3])
{
  PetscReal n[3];

  SbCross(b, c, n);
  return SbDot3(a, n);
}

/* Whether the tet was so near the point at rest that they are neighbours in one body. */
static PetscBool surrounds(SbInside in, PetscInt j, const PetscReal X[3])
{
  const SbMesh mesh = in->surface->space->mesh;
  const PetscReal far = REST * in->surface->scene.reach;
  PetscReal box[6];

  SbBoxClear(box);
  for (int k = 0; k < 4; k++) SbBoxAdd(box, mesh->x + 3 * mesh->cell[4 * in->cell[j] + k]);
  for (int k = 0; k < 3; k++) {
    if (X[k] < box[k] - far || X[k] > box[3 + k] + far) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

typedef enum { OUTSIDE, WITHIN, ON_BOUNDARY } Place;

/* Where a point is in tet j. */
static Place place_in(SbInside in, PetscInt j, const PetscReal u[], const PetscReal p[3])
{
  const uint64_t *face = in->surface->space->mesh->face_set + 4 * in->cell[j];
  PetscReal x[4][3], e[4][3], weight[4] = {1}, all, longest = 0;

  for (int k = 0; k < 4; k++) SbContactSurfacePosition(in->surface->space, 4 * in->cell[j] + k, u, x[k]);
  for (int k = 1; k < 4; k++) {
    for (int i = 0; i < 3; i++) e[k][i] = x[k][i] - x[0][i];
    longest = PetscMax(longest, SbDot3(e[k], e[k]));
  }
  for (int i = 0; i < 3; i++) e[0][i] = p[i] - x[0][i];
  all = volume(e[1], e[2], e[3]);
  if (!(PetscAbsReal(all) > FLAT * longest * PetscSqrtReal(longest))) return OUTSIDE;
  weight[1] = volume(e[0], e[2], e[3]) / all;
  weight[2] = volume(e[1], e[0], e[3]) / all;
  weight[3] = volume(e[1], e[2], e[0]) / all;
  weight[0] -= weight[1] + weight[2] + weight[3];
  for (int k = 0; k < 4; k++) {
    if (weight[k] < -ON) return OUTSIDE;
  }
  for (int k = 0; k < 4; k++) {
    if (weight[k] <= ON && (face[k] & SB_ON_BOUNDARY)) return ON_BOUNDARY;
  }
  return WITHIN;
}

/*
  Of the parts of the tets around a point the lowest that it is in, and the lowest that it is on the boundary of; asked[ASK]. `mark` is another one
  for each point: seen[part][0] and [1] are set to it where the point is in a part, and on its boundary.
*/
static Answer answer_one(SbInside in, const PetscReal u[], PetscBool self, const PetscReal asked[],
                         PetscInt mark, PetscInt (*seen)[2])
{
  const PetscReal box[6] = {asked[0], asked[1], asked[2], asked[0], asked[1], asked[2]};
  const PetscInt mine = (PetscInt)asked[6];
  SbBoxQuery query;
  PetscInt j;
  Answer a = {-1, -1};

  for (SbBoxQueryBegin(&in->tree, box, &query); SbBoxQueryNext(&query, &j);) {
    Place place;

    if (in->part[j] == mine && (!self || surrounds(in, j, asked + 3))) continue;
    place = place_in(in, j, u, asked);
    if (place != OUTSIDE) seen[in->part[j]][place == ON_BOUNDARY] = mark;
  }
  for (SbBoxQueryBegin(&in->tree, box, &query); SbBoxQueryNext(&query, &j);) {
    const PetscInt b = in->part[j];

    if (seen[b][1] == mark)
      a.on = a.on < 0 ? b : PetscMin(a.on, b);
    else if (seen[b][0] == mark)
      a.in = a.in < 0 ? b : PetscMin(a.in, b);
  }
  return a;
}

/* For each of n points. The boxes of the tets are there. */
static PetscErrorCode answer(SbInside in, const PetscReal u[], PetscBool self, PetscInt n,
                             const PetscReal asked[], Answer said[])
{
  PetscInt(*seen)[2]; /* [npart] */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(((const SbContactSurfaceData *)in->surface->data)->npart, &seen));
  for (PetscInt i = 0; i < n; i++) said[i] = answer_one(in, u, self, asked + ASK * i, i + 1, seen);
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode box_tets(SbInside in, const PetscReal u[])
{
  PetscReal x[3];

  PetscFunctionBeginUser;
  for (PetscInt j = 0; j < in->ncell; j++) {
    PetscReal *box = in->box[j];

    SbBoxClear(box);
    for (int k = 0; k < 4; k++) {
      SbContactSurfacePosition(in->surface->space, 4 * in->cell[j] + k, u, x);
      SbBoxAdd(box, x);
    }
    SbBoxGrow(ON * PetscMax(box[3] - box[0], PetscMax(box[4] - box[1], box[5] - box[2])), box);
  }
  if (in->tree.n)
    PetscCall(SbBoxTreeRefit(&in->tree, (const PetscReal(*)[6])in->box));
  else
    PetscCall(SbBoxTreeCreate(in->ncell, (const PetscReal(*)[6])in->box, &in->tree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInsideFind(SbInside in, const PetscReal u[], PetscBool self, PetscInt part[])
{
  const SbHalo *h = &((const SbContactSurfaceData *)in->surface->data)->halo;
  PetscInt *sent;
  Answer *said, *back;
  PetscReal *asked;
  Mail mail;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_INSIDE], 0, 0, 0, 0));
  PetscCall(create_mail(h->size, &mail));
  PetscCall(box_tets(in, u));
  PetscCall(ask(in, u, self, &mail, &sent, &asked));
  PetscCall(PetscMalloc2(mail.nfrom, &said, mail.nto, &back));
  PetscCall(answer(in, u, self, mail.nfrom, asked, said));
  PetscCallMPI(MPI_Alltoallv(said, mail.from, mail.from_start, MPIU_2INT, back, mail.to, mail.to_start,
                             MPIU_2INT, h->comm));
  for (PetscInt i = 0; i < in->surface->scene.npoint; i++) part[i] = -1;
  for (PetscInt j = 0; j < mail.nto; j++) {
    PetscInt *of = &part[sent[j]];

    if (back[j].in >= 0 && (*of < 0 || back[j].in < *of)) *of = back[j].in;
  }
  for (PetscInt j = 0; j < mail.nto; j++) {
    if (back[j].on >= 0 && part[sent[j]] == back[j].on) part[sent[j]] = -1;
  }
  PetscCall(PetscFree2(said, back));
  PetscCall(PetscFree(asked));
  PetscCall(PetscFree(sent));
  PetscCall(destroy_mail(&mail));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_INSIDE], 0, 0, 0, 0));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
