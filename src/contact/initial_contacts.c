/*
  initial_contacts.c - bodies that touch when a run begins are moved apart rigidly, before the first
  step; those that cannot, by the vertices of their surfaces.

  Static runs. Bodies that overlap are moved out of each other, too, as far as their supports let
  them (part_free()). What is left overlaps between supports: it is moved apart as if nothing held
  it (SbContactSetShift()), and the supports push it together again.
*/
#include "contact_impl.h"

#define ROUNDS 20   /* most iterations of the separation of initial contacts */
#define SWEEPS 1000 /* Gauss-Seidel sweeps over the contacts in each round */
#define FAR 2.      /* largest displacement of a body per iteration, over the target gap */
#define CLOSE 0.9   /* gap over the target gap below which there is contact, in a dynamic run */
#define FREE 0.99   /* gap over the width of a force above which it does not count */
#define ASIDE 0.05  /* gap over that width to which free bodies leave others; then they touch */
#define MISSED 1e-3 /* tolerance of the sweeps over the target gap */

/* Order of initial contacts: bodies, direction, gap, target gap. */
static int by_value(const void *a, const void *b)
{
  const SbInitialContact *p = a;
  const SbInitialContact *q = b;
  const PetscInt body =
    p->body[0] != q->body[0] ? p->body[0] - q->body[0] : p->body[1] - q->body[1];
  const PetscReal difference[6] = {
    body, p->n[0] - q->n[0], p->n[1] - q->n[1], p->n[2] - q->n[2], p->gap - q->gap, p->to - q->to};

  for (int i = 0; i < 6; i++)
    if (difference[i] != 0.)
      return difference[i] < 0. ? -1 : 1;
  return 0;
}

/* Gap of a contact after the displacements `way` of its two bodies, m. */
static PetscReal gap_after(const SbInitialContact *t, const PetscReal way[])
{
  return t->gap + SbDot3(t->n, way + 3 * t->body[0]) - SbDot3(t->n, way + 3 * t->body[1]);
}

/* Squared length of the part of a contact's normal along which its two bodies are not fixed. */
static PetscReal free_part(const SbInitialContact *t, const uint8_t fixed[])
{
  PetscReal sum = 0.;

  for (int k = 0; k < 6; k++)
    if (!(fixed[t->body[k / 3]] >> (k % 3) & 1))
      sum += PetscSqr(t->n[k % 3]);
  return sum;
}

/* Gauss-Seidel: each contact moves its bodies along it, except fixed components; way[nbody + 1][3],
   m. */
static void sweep_touches(PetscInt n, const SbInitialContact touch[], PetscInt nbody,
                          const uint8_t fixed[], PetscReal way[])
{
  PetscReal worst = 1.;

  for (PetscInt k = 0; k < 3 * (nbody + 1); k++)
    way[k] = 0.;
  for (int sweep = 0; sweep < SWEEPS && worst > MISSED; sweep++) {
    worst = 0.;
    for (PetscInt i = 0; i < n; i++) {
      const SbInitialContact *t = &touch[i];
      const PetscReal missing = t->to - gap_after(t, way);
      const PetscReal sum = free_part(t, fixed);

      if (missing <= 0. || sum < MISSED)
        continue;
      worst = PetscMax(worst, missing / t->to);
      for (int k = 0; k < 6; k++) {
        const PetscInt b = t->body[k / 3];

        if (!(fixed[b] >> (k % 3) & 1))
          way[3 * b + k % 3] += (k < 3 ? 1. : -1.) * missing / sum * t->n[k % 3];
      }
    }
  }
}

/* Finds displacements of bodies that open all contacts to their target gaps, as far as prescribed
   components allow. Bodies enclosed by others without enough space are fixed. Displacements are
   limited to a few gaps, the distance within which contacts were searched. A gap below the part
   `close` of its target is a contact. fixed[nbody + 1]: bit c, component c is prescribed or was
   fixed here; way[nbody + 1][3], m. Returns whether some body moves. */
static PetscBool find_ways(PetscInt n, const SbInitialContact touch[], PetscReal close,
                           PetscInt nbody, uint8_t fixed[], PetscReal way[])
{
  PetscReal longest = 0.;
  PetscReal most = PETSC_MAX_REAL;
  PetscBool again = PETSC_FALSE;

  for (PetscInt i = 0; i < n; i++) {
    const SbInitialContact *t = &touch[i];

    again = (PetscBool)(again || (t->gap < close * t->to && free_part(t, fixed) >= MISSED));
    most = PetscMin(most, FAR * t->to);
  }
  if (!again)
    return PETSC_FALSE;

  /* fix the bodies of contacts whose gap would decrease */
  while (again) {
    again = PETSC_FALSE;
    sweep_touches(n, touch, nbody, fixed, way);
    for (PetscInt i = 0; i < n; i++) {
      const SbInitialContact *t = &touch[i];

      if (gap_after(t, way) >= PetscMin(t->gap, t->to) - MISSED * t->to)
        continue;
      for (int k = 0; k < 2; k++) {
        const PetscInt b = t->body[k];

        again = (PetscBool)(again || fixed[b] != 7);
        fixed[b] = 7;
      }
    }
  }

  /* limit the displacement */
  for (PetscInt b = 0; b <= nbody; b++)
    longest = PetscMax(longest, PetscSqrtReal(SbDot3(way + 3 * b, way + 3 * b)));
  for (PetscInt k = 0; longest > most && k < 3 * (nbody + 1); k++)
    way[k] *= most / longest;
  return (PetscBool)(longest > MISSED * most);
}

/* Components in which there is a supported body on either side of a body: bit c, component c. */
typedef struct {
  uint8_t above, below;
} Sides;

/* held[nbody + 1]: fixed[], and the components in which a body is between supported ones, which
   would push it together: contacts lead to them on both of its sides, maybe by way of others. A
   body without supports that is so in one component has friction, or its shape, in the others. */
static PetscErrorCode find_held(PetscInt n, const SbInitialContact touch[], PetscInt nbody,
                                const uint8_t fixed[], uint8_t held[])
{
  Sides *sides; /* [nbody + 1] */
  PetscBool again = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(nbody + 1, &sides));
  for (PetscInt b = 0; b <= nbody; b++)
    sides[b] = (Sides){fixed[b], fixed[b]};
  while (again) {
    again = PETSC_FALSE;
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal *normal = touch[i].n; /* from the second body to the first */

      for (int c = 0; c < 3; c++) {
        Sides *upper = &sides[touch[i].body[normal[c] > 0. ? 0 : 1]];
        Sides *lower = &sides[touch[i].body[normal[c] > 0. ? 1 : 0]];
        const uint8_t above = upper->above & (1 << c) & ~lower->above;
        const uint8_t below = lower->below & (1 << c) & ~upper->below;

        if (PetscAbsReal(normal[c]) <= MISSED)
          continue;
        lower->above |= above;
        upper->below |= below;
        again = (PetscBool)(again || above || below);
      }
    }
  }
  for (PetscInt b = 0; b <= nbody; b++) {
    held[b] = fixed[b] | (sides[b].above & sides[b].below);
    if (!fixed[b] && held[b])
      held[b] = 7;
  }
  PetscCall(PetscFree(sides));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether both sides of a contact are pushed together by supports: each component that its normal
   has is in fixed[], or, of bodies between others, in that of find_held(). Of an obstacle all
   are. */
static PetscBool is_pushed(const SbInitialContact *t, const uint8_t fixed[])
{
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++)
      if (PetscAbsReal(t->n[c]) > MISSED && !(fixed[t->body[k]] & (1 << c)))
        return PETSC_FALSE;
  return PETSC_TRUE;
}

/* Appends the touches of all ranks. Collective. */
static PetscErrorCode gather_touches(SbSpace s, const SbInitialContacts *mine,
                                     SbInitialContacts *touches)
{
  SbInitialContact *touch;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbAllgatherv(s->comm, MPI_BYTE, mine->n * (PetscInt)sizeof(*touch), mine->touch, &n,
                         &touch, NULL));
  n /= (PetscInt)sizeof(*touch);
  PetscCall(SbReserve(touches->n + n, sizeof(*touch), &touches->size, &touches->touch));
  PetscCall(PetscArraycpy(touches->touch + touches->n, touch, n));
  touches->n += n;
  PetscCall(PetscFree(touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds touches of supported bodies that are to be opened until they bear no force. */
static PetscErrorCode add_touches(const uint8_t fixed[], SbInitialContacts *touches,
                                  SbInitialContacts *all)
{
  PetscBool closed = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (touches->n)
    qsort(touches->touch, (size_t)touches->n, sizeof(*touches->touch), by_value);
  for (PetscInt i = 0; i < touches->n; i++) {
    SbInitialContact *t = &touches->touch[i];

    t->to = PetscMax(t->to, t->width);
    closed = (PetscBool)(closed || (is_pushed(t, fixed) && t->gap < FREE * t->to));
  }
  for (PetscInt i = 0; i < touches->n && closed; i++) {
    if (!is_pushed(&touches->touch[i], fixed))
      continue;
    PetscCall(SbReserve(all->n + 1, sizeof(*all->touch), &all->size, &all->touch));
    all->touch[all->n++] = touches->touch[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* fixed[nbody + 1]: bit c, component c of some node of the body is prescribed; of the obstacle all
   are. Collective. */
static PetscErrorCode find_supported(SbSpace s, uint8_t fixed[])
{
  const PetscInt nbody = s->mesh->nbody;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    fixed[s->node_body[i]] |= s->fixed[i];
  fixed[nbody] = 7;
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, fixed, (PetscMPIInt)(nbody + 1), MPI_UINT8_T, MPI_BOR, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies when a static run begins, which are moved rigidly, and the contacts that were found. */
typedef struct {
  const SbContactSet *contacts; /* borrowed */
  PetscReal t, dt;              /* of the first step, s */
  PetscReal *u;                 /* [nnode][3] displacements, m; borrowed */
  PetscReal *shift;             /* [nbody + 1][3] by which bodies were moved so far, m */
  uint8_t *fixed;               /* [nbody + 1] find_supported() */
  SbInitialContacts all;        /* overlaps, and touches to be opened, as they were before */
  PetscInt nknown;              /* of these: those of earlier rounds */
  SbInitialContacts touches;    /* of this round */
  SbContact first;              /* the first potential with some of `all`; NULL: there is none */
  PetscBool directed;           /* all overlaps of this round have a direction */
  PetscBool overlapping;        /* some bodies were in each other */
} Start;

static PetscErrorCode create_start(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                   PetscReal u[], Start *start)
{
  const PetscInt nbody = contacts->space->mesh->nbody;

  PetscFunctionBeginUser;
  *start = (Start){.contacts = contacts, .t = t, .dt = dt, .u = u};
  PetscCall(PetscCalloc2(3 * (nbody + 1), &start->shift, nbody + 1, &start->fixed));
  PetscCall(find_supported(contacts->space, start->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_start(Start *start)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(start->all.touch));
  PetscCall(PetscFree(start->touches.touch));
  PetscCall(PetscFree2(start->shift, start->fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds what overlaps where the bodies are, or else, with `touching`, supported bodies that touch.
   Collective. */
static PetscErrorCode find_contacts(Start *start, PetscBool touching)
{
  const SbContactSet *contacts = start->contacts;
  const SbSpace s = contacts->space;
  SbInitialContacts *all = &start->all;
  const PetscInt before = all->n;
  SbContact first = NULL;

  PetscFunctionBeginUser;
  start->nknown = before;
  start->touches.n = 0;
  start->directed = PETSC_TRUE;
  for (PetscInt i = 0; i < contacts->npotential; i++) {
    const PetscInt n = all->n + start->touches.n;
    SbInitialContacts mine = {0};
    PetscBool begins = PETSC_FALSE;

    PHASE_CALL(contacts->potential[i], initial_contacts, s, start->t, start->dt, start->u, &begins,
               &mine);
    if (begins) {
      PHASE_CALL(contacts->potential[i], overlaps, s, &start->directed, all);
      PetscCall(gather_touches(s, &mine, &start->touches));
    }
    PetscCall(PetscFree(mine.touch));
    if (!first && all->n + start->touches.n > n)
      first = contacts->potential[i];
  }
  start->overlapping = (PetscBool)(start->overlapping || !start->directed || all->n > before);
  if (touching && start->directed && all->n == before)
    PetscCall(add_touches(start->fixed, &start->touches, all));
  if (!start->first && all->n > before)
    start->first = first;

  /* their gaps before bodies were moved */
  if (all->n > before)
    qsort(all->touch + before, (size_t)(all->n - before), sizeof(*all->touch), by_value);
  for (PetscInt i = before; i < all->n; i++)
    all->touch[i].gap -= gap_after(&all->touch[i], start->shift) - all->touch[i].gap;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves the bodies on, so that their shift is way[nbody + 1][3], m. */
static void move_bodies(Start *start, const PetscReal way[])
{
  const SbSpace s = start->contacts->space;

  for (PetscInt i = 0; i < 3 * s->nnode; i++) {
    const PetscInt k = 3 * s->node_body[i / 3] + i % 3;

    start->u[i] += way[k] - start->shift[k];
  }
  for (PetscInt k = 0; k < 3 * (s->mesh->nbody + 1); k++)
    start->shift[k] = way[k];
}

/* Moves bodies out of others that they overlap, rigidly, where their supports let them; what has no
   room for that, as between two held bodies, stays: with `all` all of them do, if there is some.
   moved: some were. Collective. */
static PetscErrorCode part_free(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                PetscReal u[], PetscBool all, PetscBool *moved)
{
  const PetscInt nbody = contacts->space->mesh->nbody;
  PetscReal *way;
  uint8_t *still; /* fixed[], and bodies without room */
  Start start;

  PetscFunctionBeginUser;
  *moved = PETSC_FALSE;
  PetscCall(create_start(contacts, t, dt, u, &start));
  PetscCall(PetscCalloc2(nbody + 1, &still, 3 * (nbody + 1), &way));
  PetscCall(PetscArraycpy(still, start.fixed, nbody + 1));
  for (int round = 0; round < ROUNDS; round++) {
    PetscBool open = PETSC_FALSE;
    PetscBool again = PETSC_TRUE;
    PetscBool closed = PETSC_FALSE;

    PetscCall(find_contacts(&start, PETSC_FALSE));
    for (PetscInt i = start.nknown; i < start.all.n; i++) {
      SbInitialContact *touch = &start.all.touch[i];

      touch->to *= ASIDE;
      open = (PetscBool)(open || free_part(touch, still) >= MISSED);
    }
    if (!open)
      break;
    *moved = PETSC_TRUE;

    /* the bodies of contacts that stay closed are without room */
    while (again) {
      again = PETSC_FALSE;
      sweep_touches(start.all.n, start.all.touch, nbody, still, way);
      for (PetscInt i = 0; i < start.all.n; i++) {
        const SbInitialContact *touch = &start.all.touch[i];

        for (int k = 0; k < 2 && gap_after(touch, way) < (1. - 2. * MISSED) * touch->to; k++) {
          again = (PetscBool)(again || still[touch->body[k]] != 7);
          still[touch->body[k]] = 7;
          closed = PETSC_TRUE;
        }
      }
    }
    if (all && closed) {
      PetscCall(PetscArrayzero(way, 3 * (nbody + 1)));
      *moved = PETSC_FALSE;
    }
    move_bodies(&start, way);
    if (!*moved)
      break;
  }
  PetscCall(PetscFree2(still, way));
  PetscCall(destroy_start(&start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Separates bodies in initial contact by rigid displacements, until the barrier is inactive.
   Collective. */
static PetscErrorCode open_touches(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                   PetscReal u[])
{
  const SbSpace s = contacts->space;
  const PetscInt nbody = s->mesh->nbody;
  const PetscReal close = contacts->potential[0]->effect->dynamic ? CLOSE : FREE;
  uint8_t *fixed;
  PetscReal *way;
  PetscBool go_on = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(nbody + 1, &fixed, 3 * (nbody + 1), &way));
  PetscCall(find_supported(s, fixed));
  for (int round = 0; go_on && round < ROUNDS; round++) {
    SbInitialContacts list = {0};
    SbInitialContact *touch;
    PetscInt n;

    go_on = PETSC_FALSE;
    for (PetscInt k = 0; k < contacts->n; k++)
      PHASE_CALL(contacts->contact[k], initial_contacts, s, t, dt, u, &go_on, &list);
    if (!go_on)
      break;
    PetscCall(SbAllgatherv(s->comm, MPI_BYTE, list.n * (PetscInt)sizeof(*touch), list.touch, &n,
                           &touch, NULL));
    n /= (PetscInt)sizeof(*touch);
    if (n)
      qsort(touch, (size_t)n, sizeof(*touch), by_value);
    PetscCall(PetscFree(list.touch));
    go_on = find_ways(n, touch, close, nbody, fixed, way);
    PetscCall(PetscFree(touch));
    for (PetscInt i = 0; go_on && i < 3 * s->nnode; i++)
      u[i] += way[3 * s->node_body[i / 3] + i % 3];
  }
  PetscCall(PetscFree2(fixed, way));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetStart(const SbContactSet *contacts, PetscReal t, PetscReal dt, Vec U)
{
  const SbSpace s = contacts->space;
  PetscReal *u;
  PetscBool moved;

  PetscFunctionBeginUser;
  if (t == 0. && contacts->n)
    PetscCall(SbContactSetCheckInside(contacts, t, U));
  if (!contacts->npotential)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalWrite(s, U, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
  if (!contacts->potential[0]->effect->dynamic)
    PetscCall(part_free(contacts, t, dt, u, PETSC_TRUE, &moved));
  PetscCall(open_touches(contacts, t, dt, u));
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves supported bodies that touch or overlap, and those between them, apart rigidly, if supports
   will push all of them together again; of: the first potential with some, NULL: nothing was moved.
   shift[nbody + 1][3], m. overlapping: some bodies are in each other. Collective. */
static PetscErrorCode shift_apart(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                  PetscReal u[], PetscReal shift[], SbContact *of,
                                  PetscBool *overlapping)
{
  const PetscInt nbody = contacts->space->mesh->nbody;
  PetscReal *way;
  uint8_t *none, *held;
  PetscBool apart = PETSC_FALSE;
  SbInitialContacts *all;
  Start start;

  PetscFunctionBeginUser;
  PetscCall(create_start(contacts, t, dt, u, &start));
  PetscCall(PetscCalloc3(nbody + 1, &none, 3 * (nbody + 1), &way, nbody + 1, &held));
  all = &start.all;

  /* as if nothing held them */
  none[nbody] = 7;
  for (int round = 0; round < ROUNDS; round++) {
    PetscCall(find_contacts(&start, PETSC_TRUE));
    apart = (PetscBool)(start.directed && all->n == start.nknown);
    if (apart || !start.directed)
      break;
    sweep_touches(all->n, all->touch, nbody, none, way);
    move_bodies(&start, way);
  }
  *overlapping = start.overlapping;

  /* supports have to push all of them together again */
  PetscCall(SbReserve(all->n + start.touches.n, sizeof(*all->touch), &all->size, &all->touch));
  PetscCall(PetscArraycpy(all->touch + all->n, start.touches.touch, start.touches.n));
  PetscCall(find_held(all->n + start.touches.n, all->touch, nbody, start.fixed, held));
  for (PetscInt i = 0; i < all->n; i++)
    apart = (PetscBool)(apart && is_pushed(&all->touch[i], held));

  /* where some stay in each other all stay, and springs have to part them */
  *of = apart ? start.first : NULL;
  if (!*of) {
    PetscCall(PetscArrayzero(way, 3 * (nbody + 1)));
    move_bodies(&start, way);
  }
  PetscCall(PetscArraycpy(shift, start.shift, 3 * (nbody + 1)));
  PetscCall(PetscFree3(none, way, held));
  PetscCall(destroy_start(&start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetShift(const SbContactSet *contacts, PetscReal t, PetscReal dt, Vec U,
                                 Vec S, SbContact *of)
{
  const SbSpace s = contacts->space;
  PetscReal *u, *shift;
  PetscScalar *way;
  PetscBool overlapping;
  PetscBool moved = PETSC_FALSE;
  SbParted how = SB_PARTED_RIGIDLY;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(3 * (s->mesh->nbody + 1), &shift));
  PetscCall(SbSpaceGetLocalWrite(s, U, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
  PetscCall(shift_apart(contacts, t, dt, u, shift, of, &overlapping));

  /* without those that leave by themselves */
  if (!*of && overlapping)
    PetscCall(part_free(contacts, t, dt, u, PETSC_FALSE, &moved));
  if (moved) {
    PetscCall(open_touches(contacts, t, dt, u));
    PetscCall(shift_apart(contacts, t, dt, u, shift, of, &overlapping));
  }
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &u));
  PetscCall(VecGetArray(S, &way));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    way[i] = shift[3 * s->node_body[i / 3] + i % 3];
  PetscCall(VecRestoreArray(S, &way));
  if (*of)
    how = SB_PARTED_BY_SUPPORTS;
  else if (overlapping)
    how = SB_PARTED_BY_SPRINGS;
  for (PetscInt k = 0; k < contacts->npotential; k++)
    PHASE_CALL(contacts->potential[k], warn_overlaps, s, how);
  PetscCall(PetscFree(shift));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetPart(const SbContactSet *contacts, PetscInt k, PetscReal t, Vec U,
                                PetscBool *moved)
{
  const SbSpace s = contacts->space;
  PetscReal *u;

  PetscFunctionBeginUser;
  *moved = PETSC_FALSE;
  PetscCall(SbSpaceGetLocalWrite(s, U, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
  PHASE_CALL(contacts->potential[k], part, s, t, u, moved);
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetFindPenetrated(const SbContactSet *contacts, PetscReal t, Vec U,
                                          SbContact *found)
{
  const SbSpace s = contacts->space;
  SbStage stage = {.t = t, .shift_k = 1.};
  PetscReal *gap, *normal;
  PetscInt first = contacts->n;
  PetscBool held = PETSC_TRUE;
  uint8_t *fixed;

  PetscFunctionBeginUser;
  *found = NULL;

  /* what is not held needs its loads to stay in contact */
  PetscCall(PetscCalloc1(s->mesh->nbody + 1, &fixed));
  PetscCall(find_supported(s, fixed));
  for (PetscInt b = 0; b < s->mesh->nbody; b++)
    held = (PetscBool)(held && fixed[b] == 7);
  PetscCall(PetscFree(fixed));
  if (!held)
    PetscFunctionReturn(PETSC_SUCCESS);

  PetscCall(PetscCalloc2(s->nnode, &gap, 3 * s->nnode, &normal));
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  for (PetscInt k = 0; k < contacts->n && first == contacts->n; k++) {
    if (!contacts->contact[k]->ops->start_active_set)
      continue;
    CONTACT_CALL(contacts->contact[k], gap, s, &stage, gap, normal);
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      first = gap[i] < 0. ? k : first;
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCall(PetscFree2(gap, normal));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPIU_INT, MPI_MIN, s->comm));
  if (first < contacts->n)
    *found = contacts->contact[first];
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbContactGive(SbContact c, SbSpace s, PetscReal energy, PetscReal counted)
{
  c->work = s->rank ? 0. : energy;
  c->given = s->rank ? 0. : energy - counted;
}
