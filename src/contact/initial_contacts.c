/*
  initial_contacts.c - bodies that touch when a run begins are moved apart rigidly, before the first
  step; those that cannot, by the vertices of their surfaces.
*/
#include "contact_impl.h"

#define ROUNDS 20   /* most iterations of the separation of initial contacts */
#define SWEEPS 1000 /* Gauss-Seidel sweeps over the contacts in each round */
#define FAR 2.      /* largest displacement of a body per iteration, over the target gap */
#define CLOSE 0.9   /* gap over the target gap below which there is contact */
#define FREE 0.99   /* gap over the width of a force above which it does not count */
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
   limited to a few gaps, the distance within which contacts were searched. fixed[nbody + 1]: bit c,
   component c is prescribed or was fixed here; way[nbody + 1][3], m. Returns whether some body
   moves. */
static PetscBool find_ways(PetscInt n, const SbInitialContact touch[], PetscInt nbody,
                           uint8_t fixed[], PetscReal way[])
{
  PetscReal longest = 0.;
  PetscReal most = PETSC_MAX_REAL;
  PetscBool again = PETSC_FALSE;

  for (PetscInt i = 0; i < n; i++) {
    const SbInitialContact *t = &touch[i];

    again = (PetscBool)(again || (t->gap < CLOSE * t->to && free_part(t, fixed) >= MISSED));
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

/* held[nbody + 1]: fixed[], and the components in which a body is between supported ones, which
   would push it together: contacts lead to them on both of its sides, maybe by way of others. A
   body without supports that is so in one component has friction, or its shape, in the others. */
static PetscErrorCode find_held(PetscInt n, const SbInitialContact touch[], PetscInt nbody,
                                const uint8_t fixed[], uint8_t held[])
{
  uint8_t *side[2]; /* components in which there is a supported body above it, and below it */
  PetscBool again = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(nbody + 1, &side[0], nbody + 1, &side[1]));
  for (int k = 0; k < 2; k++)
    PetscCall(PetscArraycpy(side[k], fixed, nbody + 1));
  while (again) {
    again = PETSC_FALSE;
    for (PetscInt i = 0; i < 6 * n; i++) {
      const SbInitialContact *t = &touch[i / 6];
      const int c = i % 3;
      const int first = i / 3 % 2; /* this body of the contact, on the side k of the other one */
      const int k = (t->n[c] > 0.) == (first == 0);
      const uint8_t above = side[k][t->body[!first]] & (1 << c);

      if (PetscAbsReal(t->n[c]) <= MISSED || !above || side[k][t->body[first]] & above)
        continue;
      side[k][t->body[first]] |= above;
      again = PETSC_TRUE;
    }
  }
  for (PetscInt b = 0; b <= nbody; b++) {
    held[b] = fixed[b] | (side[0][b] & side[1][b]);
    if (!fixed[b] && held[b])
      held[b] = 7;
  }
  PetscCall(PetscFree2(side[0], side[1]));
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

/* Moves bodies that overlap, or else supported ones that touch, apart from where they are, u, which
   was moved by shift[nbody + 1][3] so far; *k: the first potential that has some, -1: none; *apart:
   none do any more. all: contacts that were found so far, from the first positions; touches: those
   of this round. */
static PetscErrorCode shift_once(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                 const uint8_t fixed[], PetscReal u[], PetscReal shift[],
                                 SbInitialContacts *all, SbInitialContacts *touches, PetscInt *k,
                                 PetscBool *apart)
{
  const SbSpace s = contacts->space;
  const PetscInt nbody = s->mesh->nbody;
  const PetscInt before = all->n;
  uint8_t *none;
  PetscReal *way;
  PetscInt potential = -1; /* the first one that has some */
  PetscBool directed = PETSC_TRUE;

  /* overlaps and touches */
  PetscFunctionBeginUser;
  touches->n = 0;
  for (PetscInt i = 0; i < contacts->npotential; i++) {
    const PetscInt n = all->n;
    const PetscInt ntouch = touches->n;
    SbInitialContacts mine = {0};
    PetscBool first = PETSC_FALSE;

    PHASE_CALL(contacts->potential[i], initial_contacts, s, t, dt, u, &first, &mine);
    if (first) {
      PHASE_CALL(contacts->potential[i], overlaps, s, &directed, all);
      PetscCall(gather_touches(s, &mine, touches));
    }
    PetscCall(PetscFree(mine.touch));
    potential = potential < 0 && all->n + touches->n > n + ntouch ? i : potential;
  }

  if (directed && all->n == before)
    PetscCall(add_touches(fixed, touches, all));
  *k = *k < 0 && all->n > before ? potential : *k;
  if (all->n > before)
    qsort(all->touch + before, (size_t)(all->n - before), sizeof(*all->touch), by_value);
  for (PetscInt i = before; i < all->n; i++) {
    SbInitialContact *touch = &all->touch[i];

    for (int c = 0; c < 3; c++)
      touch->gap -= touch->n[c] * (shift[3 * touch->body[0] + c] - shift[3 * touch->body[1] + c]);
  }
  *apart = (PetscBool)(directed && all->n == before);
  if (*apart || !directed) {
    all->n = before;
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* as if nothing held them */
  PetscCall(PetscCalloc2(nbody + 1, &none, 3 * (nbody + 1), &way));
  none[nbody] = 7;
  sweep_touches(all->n, all->touch, nbody, none, way);
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    u[i] += way[3 * s->node_body[i / 3] + i % 3] - shift[3 * s->node_body[i / 3] + i % 3];
  PetscCall(PetscArraycpy(shift, way, 3 * (nbody + 1)));
  PetscCall(PetscFree2(none, way));
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

PetscErrorCode SbContactSetShift(const SbContactSet *contacts, PetscReal t, PetscReal dt, Vec U,
                                 Vec S, SbContact *of)
{
  const SbSpace s = contacts->space;
  PetscInt k = -1;
  SbInitialContacts list = {0};
  SbInitialContacts touches = {0};
  PetscReal *u, *shift;
  PetscScalar *way;
  uint8_t *fixed, *held;
  PetscBool apart = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(3 * (s->mesh->nbody + 1), &shift, s->mesh->nbody + 1, &fixed,
                         s->mesh->nbody + 1, &held));
  PetscCall(find_supported(s, fixed));
  PetscCall(SbSpaceGetLocalWrite(s, U, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
  for (int round = 0; round < ROUNDS && !apart; round++) {
    const PetscInt n = list.n;

    PetscCall(shift_once(contacts, t, dt, fixed, u, shift, &list, &touches, &k, &apart));
    if (!apart && list.n == n)
      break;
  }

  /* supports have to push all of them together again */
  PetscCall(SbReserve(list.n + touches.n, sizeof(*list.touch), &list.size, &list.touch));
  PetscCall(PetscArraycpy(list.touch + list.n, touches.touch, touches.n));
  PetscCall(find_held(list.n + touches.n, list.touch, s->mesh->nbody, fixed, held));
  for (PetscInt i = 0; i < list.n; i++)
    apart = (PetscBool)(apart && is_pushed(&list.touch[i], held));

  /* where some stay in each other all stay, and springs have to part them */
  if (!apart)
    k = -1;
  *of = k < 0 ? NULL : contacts->potential[k];
  for (PetscInt i = 0; i < 3 * s->nnode && k < 0; i++)
    u[i] -= shift[3 * s->node_body[i / 3] + i % 3];
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &u));
  PetscCall(VecGetArray(S, &way));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    way[i] = k < 0 ? 0. : shift[3 * s->node_body[i / 3] + i % 3];
  PetscCall(VecRestoreArray(S, &way));
  PetscCall(PetscFree(touches.touch));
  PetscCall(PetscFree(list.touch));
  PetscCall(PetscFree3(shift, fixed, held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Separates bodies in initial contact by rigid displacements, in a dynamic run until the barrier is
   inactive. */
PetscErrorCode SbContactSetStart(const SbContactSet *contacts, PetscReal t, PetscReal dt, Vec U)
{
  const SbSpace s = contacts->space;
  const PetscInt nbody = s->mesh->nbody;
  uint8_t *fixed;
  PetscReal *way, *u;
  PetscBool go_on = PETSC_TRUE;

  PetscFunctionBeginUser;
  if (t == 0. && contacts->n)
    PetscCall(SbContactSetCheckInside(contacts, t, U));
  if (!contacts->npotential)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalWrite(s, U, &u));
  PetscCall(SbSpaceUpdateGhosts(s, u));
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
    go_on = find_ways(n, touch, nbody, fixed, way);
    PetscCall(PetscFree(touch));
    for (PetscInt i = 0; go_on && i < 3 * s->nnode; i++)
      u[i] += way[3 * s->node_body[i / 3] + i % 3];
  }
  PetscCall(PetscFree2(fixed, way));
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &u));
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
