/*
  hash.c - contact detection by spatial hashing.

  Teschner, Heidelberger, Mueller, Pomeranets, Gross, "Optimized spatial hashing for collision detection of deformable objects", VMV
  2003: space is cut into cubic cells, and (i p1 xor j p2 xor k p3) mod n says where in a table a cell is. Points are put into the slots of
  the cells that they passed through; each facet then looks up the cells of its box. Two things are done for the cache: instead of chains
  the entries lie in one array sorted by slot (counting sort), and what is hashed are blocks of 4 x 4 x 4 cells, whose 64 slots lie
  together.

  The cells are as wide as the boxes of the facets on average, which hold the reach and the motion; the table has two to four slots per
  entry. What would cover very many cells is not put into them: a facet is then tested against all points, a point against all facets.
  Before that, points outside the boxes around the other parts' facets are left out, and facets outside the boxes around the others'
  points. Time and memory grow linearly with points and facets. All is rebuilt at each call.
*/
#include "detect.h"

#define CELL_WIDTH 1.0     /* of the mean extent of the facets' boxes; half and twice that are slower */
#define POINT_CELLS 64     /* a point that passed through more is tested against all facets */
#define CELL_FAR (1 << 28) /* cells beyond are one; boxes decide there */
#define SLOTS_MIN 64
#define PARTS_MAX 64 /* with more parts they are not told apart by their boxes */
#define BLOCK 4      /* cells along each side of what is hashed; a power of two */

/* A point in one of the cells that it passed through. */
typedef struct {
  int cell[3];
  PetscInt point, part;
  unsigned above; /* bit k: not in the lowest of its cells along axis k */
} Entry;

typedef struct {
  PetscReal facets[6], points[6]; /* boxes around them */
} Part;

typedef struct {
  PetscReal origin[3], per_cell; /* cell = (x - origin) per_cell */
  int last[3];                   /* highest cell of a point along each axis; the lowest is 0 */
  unsigned mask;                 /* slots - 1 */
  PetscInt nentry;
  PetscInt *slot; /* [slots+1] offsets into entry */
  Entry *entry;
  PetscInt nkept, nlone, nfacet;
  PetscInt *kept;  /* [nkept] points in cells; from the end, [nlone] points in too many */
  PetscInt *facet; /* [nfacet] that are examined */
  PetscInt *pair;  /* [npair][2] point, facet */
  PetscInt64 npair, wide;
  PetscInt npart;
  Part *part;
  PetscInt64 slot_size, entry_size, kept_size, facet_size, pair_size, part_size; /* allocated */
} Hash;

/* Room for n items of `size` bytes; what is there is lost. */
static PetscErrorCode reserve(PetscInt64 n, size_t size, PetscInt64 *have, void *array)
{
  void **a = (void **)array;

  PetscFunctionBeginUser;
  if (n <= *have) PetscFunctionReturn(PETSC_SUCCESS);
  *have = 0;
  PetscCall(PetscFree(*a));
  PetscCall(PetscMalloc(size * (size_t)(n + n / 2), a));
  *have = n + n / 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ what can meet at all */

static inline void box_none(PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = PETSC_MAX_REAL;
    box[3 + k] = -PETSC_MAX_REAL;
  }
}

static inline void box_add(const PetscReal a[6], PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = PetscMin(box[k], a[k]);
    box[3 + k] = PetscMax(box[3 + k], a[3 + k]);
  }
}

/* Number of the part in h->part; all are one when there are too many. */
static inline PetscInt part_of(const Hash *h, PetscInt part)
{
  return h->npart > 1 ? part : 0;
}

static PetscErrorCode find_parts(Hash *h, SbDetector d, const SbDetectScene *s)
{
  PetscInt low = 0, high = 0;

  PetscFunctionBeginUser;
  for (PetscInt f = 0; f < s->nfacet; f++) {
    low = PetscMin(low, s->facet_part[f]);
    high = PetscMax(high, s->facet_part[f]);
  }
  for (PetscInt i = 0; i < s->npoint; i++) {
    low = PetscMin(low, s->point_part[i]);
    high = PetscMax(high, s->point_part[i]);
  }
  h->npart = low < 0 || high >= PARTS_MAX ? 1 : high + 1;
  PetscCall(reserve(h->npart, sizeof(*h->part), &h->part_size, &h->part));
  for (PetscInt k = 0; k < h->npart; k++) {
    box_none(h->part[k].facets);
    box_none(h->part[k].points);
  }
  for (PetscInt f = 0; f < s->nfacet; f++)
    box_add(d->facet_box + 6 * f, h->part[part_of(h, s->facet_part[f])].facets);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a box of `part` meets what there is of a part that it may meet. */
static PetscBool wanted(const Hash *h, const SbDetectScene *s, PetscInt part, PetscBool facets,
                        const PetscReal box[6])
{
  const PetscInt own = s->self || h->npart == 1 ? -1 : part;

  for (PetscInt k = 0; k < h->npart; k++) {
    if (k != own && SbBoxesOverlap(box, facets ? h->part[k].facets : h->part[k].points)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The points that may meet facets, then the facets that may meet those points; h->facet, and h->kept with the cells still open. */
static PetscErrorCode choose(Hash *h, SbDetector d, const SbDetectScene *s)
{
  PetscFunctionBeginUser;
  PetscCall(find_parts(h, d, s));
  PetscCall(reserve(s->npoint, sizeof(*h->kept), &h->kept_size, &h->kept));
  PetscCall(reserve(s->nfacet, sizeof(*h->facet), &h->facet_size, &h->facet));
  h->nkept = h->nlone = h->nfacet = 0;
  for (PetscInt i = 0; i < s->npoint; i++) {
    if (!wanted(h, s, s->point_part[i], PETSC_TRUE, d->point_box + 6 * i)) continue;
    h->kept[h->nkept++] = i;
    box_add(d->point_box + 6 * i, h->part[part_of(h, s->point_part[i])].points);
  }
  for (PetscInt f = 0; f < s->nfacet; f++) {
    if (wanted(h, s, s->facet_part[f], PETSC_FALSE, d->facet_box + 6 * f)) h->facet[h->nfacet++] = f;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ cells */

/* Ascending in x also where it is cut off, so that boxes that meet share a cell. */
static inline int cell_of(const Hash *h, PetscReal x, int axis)
{
  const PetscReal c = (x - h->origin[axis]) * h->per_cell;

  return c >= 0 ? c < CELL_FAR ? (int)c : CELL_FAR : 0;
}

static inline unsigned slot_of(const Hash *h, int i, int j, int k)
{
  const unsigned block =
    ((unsigned)i / BLOCK * 73856093u) ^ ((unsigned)j / BLOCK * 19349663u) ^ ((unsigned)k / BLOCK * 83492791u);

  return (block * (BLOCK * BLOCK * BLOCK) & h->mask) +
         (((unsigned)k % BLOCK * BLOCK + (unsigned)j % BLOCK) * BLOCK + (unsigned)i % BLOCK);
}

/* Cells of a box; how many, at most `most` + 1. */
static PetscInt64 cells_of(const Hash *h, const PetscReal box[6], PetscInt64 most, int lo[3], int hi[3])
{
  PetscInt64 n = 1;

  for (int k = 0; k < 3; k++) {
    lo[k] = cell_of(h, box[k], k);
    hi[k] = PetscMin(cell_of(h, box[3 + k], k), h->last[k]);
    n = PetscMin(n * PetscMax(0, (PetscInt64)hi[k] - lo[k] + 1), most + 1);
  }
  return n;
}

/* Width and place of the cells. */
static void set_cells(Hash *h, SbDetector d)
{
  PetscReal sum = 0, all[6];

  box_none(all);
  for (PetscInt k = 0; k < h->npart; k++) box_add(h->part[k].points, all);
  for (PetscInt j = 0; j < h->nfacet; j++) {
    const PetscReal *b = d->facet_box + 6 * h->facet[j];

    sum += PetscMax(b[3] - b[0], PetscMax(b[4] - b[1], b[5] - b[2]));
  }
  h->per_cell = h->nfacet / (CELL_WIDTH * sum);
  for (int k = 0; k < 3; k++) {
    h->origin[k] = all[k];
    h->last[k] = CELL_FAR;
    h->last[k] = cell_of(h, all[3 + k], k);
  }
}

/* Calls for each cell of the kept points: counts the slots, or puts the points into them. */
static void enter(Hash *h, SbDetector d, const SbDetectScene *s, PetscBool put)
{
  for (PetscInt n = 0; n < h->nkept; n++) {
    const PetscInt point = h->kept[n];
    int lo[3], hi[3];

    (void)cells_of(h, d->point_box + 6 * point, POINT_CELLS, lo, hi);
    for (int k = lo[2]; k <= hi[2]; k++) {
      for (int j = lo[1]; j <= hi[1]; j++) {
        for (int i = lo[0]; i <= hi[0]; i++) {
          PetscInt *slot = h->slot + slot_of(h, i, j, k);

          if (put) {
            const unsigned above = (i > lo[0]) | (unsigned)(j > lo[1]) << 1 | (unsigned)(k > lo[2]) << 2;

            h->entry[--*slot] = (Entry){{i, j, k}, point, s->point_part[point], above};
          } else
            ++*slot;
        }
      }
    }
  }
}

/* Sorts the kept points by slot. */
static PetscErrorCode fill(Hash *h, SbDetector d, const SbDetectScene *s)
{
  PetscInt64 total = 0, slots = SLOTS_MIN;
  PetscInt kept = 0;
  int lo[3], hi[3];

  PetscFunctionBeginUser;
  for (PetscInt n = 0; n < h->nkept; n++) {
    const PetscInt point = h->kept[n];
    const PetscInt64 cells = cells_of(h, d->point_box + 6 * point, POINT_CELLS, lo, hi);

    /* swapped, so that those in too many cells gather behind */
    if (cells > POINT_CELLS) continue;
    h->kept[n] = h->kept[kept];
    h->kept[kept++] = point;
    total += cells;
  }
  h->nlone = h->nkept - kept;
  h->nkept = kept;
  PetscCall(PetscIntCast(total, &h->nentry));
  while (slots < 2 * total) slots *= 2;
  h->mask = (unsigned)(slots - 1);
  PetscCall(reserve(slots + 1, sizeof(*h->slot), &h->slot_size, &h->slot));
  PetscCall(reserve(total, sizeof(*h->entry), &h->entry_size, &h->entry));
  PetscCall(PetscArrayzero(h->slot, slots + 1));
  enter(h, d, s, PETSC_FALSE);
  for (PetscInt64 i = 1; i <= slots; i++) h->slot[i] += h->slot[i - 1];
  enter(h, d, s, PETSC_TRUE);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ pairs */

/* Room for n pairs more. */
static PetscErrorCode reserve_pairs(Hash *h, PetscInt64 n)
{
  PetscFunctionBeginUser;
  if (h->npair + n <= h->pair_size) PetscFunctionReturn(PETSC_SUCCESS);
  h->pair_size = h->npair + n + h->npair / 2;
  PetscCall(PetscRealloc(2 * sizeof(*h->pair) * (size_t)h->pair_size, &h->pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline void pair(Hash *h, SbDetector d, PetscInt point, PetscInt facet)
{
  h->pair[2 * h->npair] = point;
  h->pair[2 * h->npair + 1] = facet;
  h->npair++;
  d->start[point + 1]++;
}

/* Points of a list against one facet, or those in too many cells against it. */
static PetscErrorCode test_all(Hash *h, SbDetector d, const SbDetectScene *s, PetscInt n,
                               const PetscInt point[], PetscInt facet)
{
  PetscFunctionBeginUser;
  PetscCall(reserve_pairs(h, n));
  for (PetscInt i = 0; i < n; i++) {
    if (SbBoxesOverlap(d->point_box + 6 * point[i], d->facet_box + 6 * facet) &&
        SbDetectPairWanted(s, point[i], facet))
      pair(h, d, point[i], facet);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The points in cells first..last, j, k of a box, all in one block. A point in several cells of the box counts in the lowest of those that
  both have. Others that are only in the same slots have another cell.
*/
static PetscErrorCode look_up(Hash *h, SbDetector d, const SbDetectScene *s, PetscInt facet, const int lo[3],
                              int first, int last, int j, int k)
{
  const unsigned slot = slot_of(h, first, j, k), above = (unsigned)(j > lo[1]) << 1 | (unsigned)(k > lo[2])
                                                                                        << 2;
  const PetscInt begin = h->slot[slot], end = h->slot[slot + (unsigned)(last - first) + 1];
  const PetscInt own = s->self ? PETSC_MIN_INT : s->facet_part[facet];

  PetscFunctionBeginUser;
  if (begin == end) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(reserve_pairs(h, end - begin));
  for (PetscInt e = begin; e < end; e++) {
    const Entry *a = h->entry + e;
    const int i = a->cell[0];

    if (a->part != own && i >= first && i <= last && a->cell[1] == j && a->cell[2] == k &&
        !(a->above & (above | (i > lo[0]))) &&
        SbBoxesOverlap(d->point_box + 6 * a->point, d->facet_box + 6 * facet))
      pair(h, d, a->point, facet);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode find_pairs(Hash *h, SbDetector d, const SbDetectScene *s)
{
  PetscFunctionBeginUser;
  for (PetscInt n = 0; n < h->nfacet; n++) {
    const PetscInt facet = h->facet[n];
    int lo[3], hi[3];

    if (h->nlone) PetscCall(test_all(h, d, s, h->nlone, h->kept + h->nkept, facet));
    if (cells_of(h, d->facet_box + 6 * facet, h->nkept, lo, hi) > h->nkept) {
      h->wide++;
      PetscCall(test_all(h, d, s, h->nkept, h->kept, facet));
      continue;
    }
    for (int k = lo[2]; k <= hi[2]; k++) {
      for (int j = lo[1]; j <= hi[1]; j++) {
        for (int i = lo[0], last; i <= hi[0]; i = last + 1) {
          last = PetscMin(hi[0], i | (BLOCK - 1));
          PetscCall(look_up(h, d, s, facet, lo, i, last, j, k));
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs, which come by facet, as candidates by point. d->start[i + 1] holds how many point i has. */
static PetscErrorCode sort_pairs(Hash *h, SbDetector d, PetscInt npoint)
{
  PetscInt64 sum = 0;

  PetscFunctionBeginUser;
  PetscCall(SbCandidatesReserve(d, h->npair));
  for (PetscInt i = 0; i < npoint; i++) {
    const PetscInt n = d->start[i + 1];

    d->start[i + 1] = (PetscInt)sum; /* where the next one goes; in the end where the point's end is */
    sum += n;
  }
  for (PetscInt64 n = 0; n < h->npair; n++) d->candidate[d->start[h->pair[2 * n] + 1]++] = h->pair[2 * n + 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode search_hash(SbDetector d, const SbDetectScene *s)
{
  Hash *h = (Hash *)d->data;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(d->start, s->npoint + 1));
  h->npair = h->wide = h->nentry = 0;
  PetscCall(choose(h, d, s));
  if (h->nfacet) {
    set_cells(h, d);
    PetscCall(fill(h, d, s));
    PetscCall(find_pairs(h, d, s));
    d->stats.rebuilt++;
  }
  PetscCall(sort_pairs(h, d, s->npoint));
  d->stats.memory = (PetscInt64)(h->slot_size * sizeof(*h->slot) + h->entry_size * sizeof(*h->entry) +
                                 h->kept_size * sizeof(*h->kept) + h->facet_size * sizeof(*h->facet) +
                                 2 * h->pair_size * sizeof(*h->pair) + h->part_size * sizeof(*h->part));
  if (!h->nfacet)
    PetscCall(PetscSNPrintf(d->stats.text, sizeof(d->stats.text), "hash, nothing is near"));
  else
    PetscCall(PetscSNPrintf(d->stats.text, sizeof(d->stats.text),
                            "hash, cells of %.3g m, %" PetscInt_FMT " entries in %u slots, %" PetscInt_FMT
                            " points and %" PetscInt64_FMT " facets too wide for cells",
                            (double)(1 / h->per_cell), h->nentry, h->mask + 1, h->nlone, h->wide));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_hash(SbDetector d)
{
  Hash *h = (Hash *)d->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(h->slot));
  PetscCall(PetscFree(h->entry));
  PetscCall(PetscFree(h->kept));
  PetscCall(PetscFree(h->facet));
  PetscCall(PetscFree(h->pair));
  PetscCall(PetscFree(h->part));
  PetscCall(PetscFree(d->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectorCreate_Hash(SbDetector d)
{
  Hash *h;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&h));
  d->data = h;
  d->ops = (SbDetectorOps){.name = "hash", .search = search_hash, .destroy = destroy_hash};
  PetscFunctionReturn(PETSC_SUCCESS);
}
