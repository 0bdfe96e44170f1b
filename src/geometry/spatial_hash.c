/*
  spatial_hash.c - a hashed infinite grid of cells: which boxes of several sets meet.

  Method: Teschner, Heidelberger, Mueller, Pomeranets and Gross, "Optimized spatial hashing for
  collision detection of deformable objects", VMV 2003. Space is cut into cubes; a box is put into
  all cells that it overlaps, and only boxes of the same cell are compared. The grid has no bounds:
  the three integers of a cell are hashed,

    h = (i p1 xor j p2 xor k p3),   p1 = 73856093, p2 = 19349663, p3 = 83492791,

  and the cells in use stand in one array, which the table points into. A place in the table is free
  unless it bears the stamp of the present fill: nothing is cleared between two of them. Collisions
  of hashes are resolved by the next free place, and cells are compared by their integers, so a list
  holds the boxes of one cell alone.

  Boxes of different size: a grid for each size (Eitz and Gu, "Hierarchical spatial hashing for
  real-time collision detection", SMI 2007), in the same table. A level's cells are WIDER times as
  wide as those of the one below; a box is on the lowest level whose cells are at least as wide as
  its longest side, so it overlaps at most eight. Cells of a level lie within one cell of each
  higher one. A cell's boxes are compared with each other and with those of the cells around it on
  higher levels that hold any. So a plate of two triangles costs a cell or two and not a million,
  and features that are much smaller than the rest do not share cells by the thousand.

  A pair may share several cells. It is given where the lower corner of the intersection of both
  boxes is, by the cell of the finer one of both: once.

  Boxes that only matter near to others, as those of other ranks: they enter the cells where these
  are. For this the cells around those in use are put into the table, too.

  Rounding: x -> floor(x / width) is monotonic, and widths are powers of two of each other, so two
  boxes that share a point share a cell. Boxes so far from the origin that a double cannot count the
  cells are on a level where it can. Not handled: boxes that all meet; their number of pairs is
  quadratic.
*/
#include "sbgeometry.h"

#define LEVELS 64   /* the highest level is a single cell */
#define MIDDLE 32   /* level of boxes as large as the cell that the caller gives */
#define BITS 1      /* log2 of the ratio of widths */
#define MOST 50     /* log2 of the number of cells from the origin to a box */
#define TINY 1e-150 /* coordinates below this, in cells, are zero: products do not underflow */

typedef struct {
  int64_t at[3];
  int level;
  PetscInt first, n; /* its boxes in list[] */
} Cell;

typedef struct {
  PetscReal box[6];
  PetscInt number; /* in its set */
} Item;

typedef struct {
  PetscInt stamp, cell;
} Slot;

struct _p_SbSpatialHash {
  PetscReal inverse, scale[LEVELS]; /* 1 / width of a cell of level l: inverse scale[l], 1/m */
  int nset;
  PetscInt first_item[SB_HASH_SETS + 1]; /* of each set */
  PetscInt nitem, item_size;
  Item *item;      /* [nitem] by set */
  PetscBool near;  /* a set of boxes near to earlier ones was added */
  uint64_t levels; /* bit l: some box is on level l */
  PetscInt nentry, cell_of_size, item_of_size, list_size;
  PetscInt *cell_of,
    *item_of;     /* [nentry] a box in a cell: 8 times its number; bit k: along axis k the
                                  cell is the first one that it overlaps */
  PetscInt *list; /* [nentry] item_of[] by cell, ascending */
  PetscInt ncell, cell_size;
  Cell *cell; /* [ncell] in use */
  PetscInt stamp;
  int log2_slots;
  Slot *slot; /* [2^log2_slots] */
  PetscInt npair, pair_size;
  SbHashPair *pair; /* [npair] of SbHashPairsNext() */
};

PetscErrorCode SbSpatialHashCreate(PetscReal cell, SbSpatialHash *hash)
{
  SbSpatialHash h;

  PetscFunctionBeginUser;
  PetscCheck(cell > 1e-140 && cell < 1e140, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "The cell of a spatial hash is %g m wide: it takes a positive number", (double)cell);
  PetscCall(PetscNew(&h));
  *hash = h;
  h->inverse = 1. / cell;
  for (int l = 0; l < LEVELS - 1; l++)
    h->scale[l] = ldexp(1., BITS * (MIDDLE - l));
  h->log2_slots = 10;
  PetscCall(PetscCalloc1((size_t)1 << h->log2_slots, &h->slot));
  PetscCall(SbSpatialHashClear(h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpatialHashDestroy(SbSpatialHash *hash)
{
  SbSpatialHash h = *hash;

  PetscFunctionBeginUser;
  if (!h)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(h->item));
  PetscCall(PetscFree(h->cell_of));
  PetscCall(PetscFree(h->item_of));
  PetscCall(PetscFree(h->list));
  PetscCall(PetscFree(h->cell));
  PetscCall(PetscFree(h->slot));
  PetscCall(PetscFree(h->pair));
  PetscCall(PetscFree(*hash));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpatialHashClear(SbSpatialHash h)
{
  PetscFunctionBeginUser;
  h->nset = 0;
  h->nitem = h->nentry = h->ncell = h->npair = 0;
  h->levels = 0;
  h->near = PETSC_FALSE;

  /* the stamps of all earlier fills are out of date; once in two billion fills they begin anew */
  if (h->stamp == PETSC_MAX_INT) {
    PetscCall(PetscArrayzero(h->slot, (size_t)1 << h->log2_slots));
    h->stamp = 0;
  }
  h->stamp++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A coordinate in cells of a level. */
static inline PetscReal in_cells(SbSpatialHash h, PetscReal x, int level)
{
  const PetscReal r = x * h->inverse;

  return level == LEVELS - 1 || PetscAbsReal(r) < TINY ? 0. : r * h->scale[level];
}

static inline int64_t floor_of(PetscReal r)
{
  const int64_t i = (int64_t)r;

  return i - (r < (PetscReal)i);
}

/* The level of a box: by its longest side, and by its distance from the origin. */
static inline int level_of(SbSpatialHash h, const PetscReal box[6])
{
  PetscReal side = 0.;
  PetscReal far = 0.;
  int log2_side, log2_far, level;

  for (int k = 0; k < 3; k++) {
    side = PetscMax(side, box[3 + k] - box[k]);
    far = PetscMax(far, PetscMax(-box[k], box[3 + k]));
  }
  if (!(side * h->inverse < 1e100 && far * h->inverse < 1e100))
    return LEVELS - 1;
  (void)frexp(side * h->inverse, &log2_side);
  (void)frexp(far * h->inverse, &log2_far);
  if (side * h->inverse < TINY)
    log2_side = -BITS * MIDDLE;
  log2_side = PetscMax(log2_side, log2_far - MOST) + BITS * MIDDLE;
  level = (PetscMax(log2_side, 0) + BITS - 1) / BITS;
  return PetscMin(level, LEVELS - 1);
}

/* The place of a cell in the table: where it stands, or the free one where it belongs. */
static inline Slot *find_slot(SbSpatialHash h, const int64_t at[3], int level)
{
  const size_t mask = ((size_t)1 << h->log2_slots) - 1;
  const uint64_t key = (uint64_t)at[0] * 73856093U ^ (uint64_t)at[1] * 19349663U ^
                       (uint64_t)at[2] * 83492791U ^ (uint64_t)level << 58;
  size_t k = (size_t)(key * 0x9e3779b97f4a7c15ULL >> (64 - h->log2_slots));

  for (;; k = (k + 1) & mask) {
    Slot *slot = &h->slot[k];
    const Cell *c;

    if (slot->stamp != h->stamp)
      return slot;
    c = &h->cell[slot->cell];
    if (c->at[0] == at[0] && c->at[1] == at[1] && c->at[2] == at[2] && c->level == level)
      return slot;
  }
}

/* The integers of the cell around c on a higher level. */
static inline void around(const Cell *c, int level, int64_t at[3])
{
  const int shift = PetscMin(63, BITS * (level - c->level));

  for (int k = 0; k < 3; k++)
    at[k] = level == LEVELS - 1 ? 0 : c->at[k] >> shift;
}

/* The number of a cell, which is added if it is not in use. */
static PetscErrorCode claim_cell(SbSpatialHash h, const int64_t at[3], int level, PetscInt *cell)
{
  Slot *slot = find_slot(h, at, level);

  PetscFunctionBeginUser;
  if (slot->stamp != h->stamp) {
    /* at most half of the table is in use */
    if (2 * (size_t)h->ncell >= (size_t)1 << h->log2_slots) {
      h->log2_slots++;
      PetscCall(PetscFree(h->slot));
      PetscCall(PetscCalloc1((size_t)1 << h->log2_slots, &h->slot));
      for (PetscInt c = 0; c < h->ncell; c++)
        *find_slot(h, h->cell[c].at, h->cell[c].level) = (Slot){.stamp = h->stamp, .cell = c};
      slot = find_slot(h, at, level);
    }
    PetscCall(SbReserve(h->ncell + 1, sizeof(*h->cell), &h->cell_size, &h->cell));
    h->cell[h->ncell] = (Cell){.at = {at[0], at[1], at[2]}, .level = level};
    *slot = (Slot){.stamp = h->stamp, .cell = h->ncell++};
  }
  *cell = slot->cell;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the cells around those in use, on all higher levels, empty where they are new. */
static PetscErrorCode claim_around(SbSpatialHash h)
{
  PetscInt above;

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < h->ncell; c++) { /* the new ones, too */
    const int level = h->cell[c].level + 1;
    int64_t at[3];

    if (level == LEVELS)
      continue;
    around(&h->cell[c], level, at);
    PetscCall(claim_cell(h, at, level, &above));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a cell holds boxes, may hold those of lower levels, or lies within one that holds any. */
static PetscBool is_near(SbSpatialHash h, const int64_t at[3], int level)
{
  const Cell c = {.at = {at[0], at[1], at[2]}, .level = level};

  if (find_slot(h, at, level)->stamp == h->stamp)
    return PETSC_TRUE;
  for (int l = level + 1; l < LEVELS && h->levels >> l; l++) {
    int64_t above[3];
    const Slot *slot;

    if (!(h->levels >> l & 1))
      continue;
    around(&c, l, above);
    slot = find_slot(h, above, l);
    if (slot->stamp == h->stamp && h->cell[slot->cell].n > 0)
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode SbSpatialHashAdd(SbSpatialHash h, PetscInt n, const PetscReal (*box)[6],
                                PetscBool near)
{
  PetscFunctionBeginUser;
  PetscCheck(h->nset < SB_HASH_SETS, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "A spatial hash takes at most %d sets of boxes", SB_HASH_SETS);
  h->first_item[h->nset++] = h->nitem;
  PetscCall(SbReserve(h->nitem + n, sizeof(*h->item), &h->item_size, &h->item));
  if (near && n && !h->near)
    PetscCall(claim_around(h));
  h->near = (PetscBool)(h->near || (near && n));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *b = box[i];
    const PetscInt nentry = h->nentry;
    int64_t low[3], high[3];
    int level;

    /* empty boxes, and NaN */
    if (!(b[0] <= b[3] && b[1] <= b[4] && b[2] <= b[5]))
      continue;

    /* into all cells that it overlaps, or those of them that may give a pair */
    level = level_of(h, b);
    for (int k = 0; k < 3; k++) {
      low[k] = floor_of(in_cells(h, b[k], level));
      high[k] = floor_of(in_cells(h, b[3 + k], level));
    }
    PetscCall(SbReserve(h->nentry + 27, sizeof(*h->cell_of), &h->cell_of_size, &h->cell_of));
    PetscCall(SbReserve(h->nentry + 27, sizeof(*h->item_of), &h->item_of_size, &h->item_of));
    for (int64_t z = low[2]; z <= high[2]; z++) {
      for (int64_t y = low[1]; y <= high[1]; y++) {
        for (int64_t x = low[0]; x <= high[0]; x++) {
          const int64_t at[3] = {x, y, z};

          if (near && !is_near(h, at, level))
            continue;
          PetscCall(claim_cell(h, at, level, &h->cell_of[h->nentry]));
          h->cell[h->cell_of[h->nentry]].n++;
          h->item_of[h->nentry++] =
            8 * h->nitem + (x == low[0] ? 1 : 0) + (y == low[1] ? 2 : 0) + (z == low[2] ? 4 : 0);
        }
      }
    }
    if (h->nentry == nentry)
      continue;
    h->levels |= (uint64_t)1 << level;
    PetscCall(PetscArraycpy(h->item[h->nitem].box, b, 6));
    h->item[h->nitem++].number = i;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHashPairsBegin(SbSpatialHash h, int nmeeting, const int meeting[][2],
                                SbHashPairs *pairs)
{
  PetscInt first = 0;

  PetscFunctionBeginUser;
  for (int s = h->nset; s <= SB_HASH_SETS; s++)
    h->first_item[s] = h->nitem;
  *pairs = (SbHashPairs){.hash = h, .nmeeting = nmeeting, .meeting = meeting};

  /* the boxes of each cell, in the order in which they were added */
  PetscCall(SbReserve(h->nentry, sizeof(*h->list), &h->list_size, &h->list));
  for (PetscInt c = 0; c < h->ncell; c++) {
    h->cell[c].first = first;
    first += h->cell[c].n;
    h->cell[c].n = 0;
  }
  for (PetscInt e = 0; e < h->nentry; e++) {
    Cell *c = &h->cell[h->cell_of[e]];

    h->list[c->first + c->n++] = h->item_of[e];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the boxes of each set begin in the list of a cell. */
static void find_sets(SbSpatialHash h, const Cell *c, PetscInt start[SB_HASH_SETS + 1])
{
  PetscInt k = c->first;

  for (int s = 0; s < h->nset; s++) {
    start[s] = k;
    while (k < c->first + c->n && h->list[k] / 8 < h->first_item[s + 1])
      k++;
  }
  start[h->nset] = k;
}

static inline int boxes_meet(const PetscReal x[6], const PetscReal y[6])
{
  return (x[0] <= y[3]) & (y[0] <= x[3]) & (x[1] <= y[4]) & (y[1] <= x[4]) & (x[2] <= y[5]) &
         (y[2] <= x[5]);
}

/* Pairs of a box of list[a[0]..a[1]) and one of list[b[0]..b[1]), both of one cell: for each axis
   one of both begins there. */
static PetscErrorCode compare_within(SbSpatialHash h, int meeting, const PetscInt a[2],
                                     const PetscInt b[2])
{
  PetscFunctionBeginUser;
  for (PetscInt i = a[0]; i < a[1]; i++) {
    const int begins = (int)(h->list[i] & 7);
    const Item *p = &h->item[h->list[i] / 8];
    PetscInt j = a == b ? i + 1 : b[0];

    PetscCall(SbReserve(h->npair + b[1] - j, sizeof(*h->pair), &h->pair_size, &h->pair));
    for (; j < b[1]; j++) {
      const Item *q = &h->item[h->list[j] / 8];

      if ((begins | (h->list[j] & 7)) != 7 || !boxes_meet(p->box, q->box))
        continue;
      h->pair[h->npair++] = (SbHashPair){.meeting = meeting, .a = p->number, .b = q->number};
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs of a box of list[a[0]..a[1]) of a cell and one of list[b[0]..b[1]) of the cell around it on
   a higher level: the intersection begins in the cell. With `swap` the second box comes first. */
static PetscErrorCode compare_around(SbSpatialHash h, const Cell *c, int meeting, PetscBool swap,
                                     const PetscInt a[2], const PetscInt b[2])
{
  const PetscReal corner[3] = {(PetscReal)c->at[0], (PetscReal)c->at[1], (PetscReal)c->at[2]};

  PetscFunctionBeginUser;
  for (PetscInt i = a[0]; i < a[1]; i++) {
    const Item *p = &h->item[h->list[i] / 8];

    PetscCall(SbReserve(h->npair + b[1] - b[0], sizeof(*h->pair), &h->pair_size, &h->pair));
    for (PetscInt j = b[0]; j < b[1]; j++) {
      const Item *q = &h->item[h->list[j] / 8];
      int here = boxes_meet(p->box, q->box);

      for (int k = 0; here && k < 3; k++) {
        const PetscReal at = in_cells(h, PetscMax(p->box[k], q->box[k]), c->level);

        here = at >= corner[k] && at < corner[k] + 1.;
      }
      if (!here)
        continue;
      h->pair[h->npair++] = (SbHashPair){
        .meeting = meeting, .a = swap ? q->number : p->number, .b = swap ? p->number : q->number};
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHashPairsNext(SbHashPairs *pairs, PetscInt least, PetscInt *n,
                               const SbHashPair **pair)
{
  SbSpatialHash h = pairs->hash;

  PetscFunctionBeginUser;
  h->npair = 0;
  for (; pairs->cell < h->ncell && h->npair < least; pairs->cell++) {
    const Cell *c = &h->cell[pairs->cell];
    PetscInt own[SB_HASH_SETS + 1], other[SB_HASH_SETS + 1];

    if (!c->n)
      continue;

    /* within the cell */
    find_sets(h, c, own);
    for (int m = 0; m < pairs->nmeeting; m++)
      PetscCall(compare_within(h, m, own + pairs->meeting[m][0], own + pairs->meeting[m][1]));

    /* with the cells around it */
    for (int level = c->level + 1; level < LEVELS && h->levels >> level; level++) {
      int64_t at[3];
      const Slot *slot;

      if (!(h->levels >> level & 1))
        continue;
      around(c, level, at);
      slot = find_slot(h, at, level);
      if (slot->stamp != h->stamp)
        continue;
      find_sets(h, &h->cell[slot->cell], other);
      for (int m = 0; m < pairs->nmeeting; m++) {
        const int *s = pairs->meeting[m];

        PetscCall(compare_around(h, c, m, PETSC_FALSE, own + s[0], other + s[1]));
        if (s[0] != s[1])
          PetscCall(compare_around(h, c, m, PETSC_TRUE, own + s[1], other + s[0]));
      }
    }
  }
  *n = h->npair;
  *pair = h->pair;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpatialHashCount(SbSpatialHash h, PetscInt count[3])
{
  count[0] = h->nitem;
  count[1] = h->nentry;
  count[2] = h->ncell;
}
