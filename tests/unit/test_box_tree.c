// @ranks 1
/*
  Box tree against all boxes one by one: boxes that overlap one, pairs of two trees and within one,
  the nearest; initially and after motion of the boxes. Merging of points against all pairs of
  points.
*/
#include <sbgeometry.h>
#include <math.h>
#include "test.h"

/* Whether two boxes share a point. */
static PetscBool overlap(const PetscReal a[6], const PetscReal b[6])
{
  return (PetscBool)(a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] &&
                     b[2] <= a[5]);
}

#define MOST 700

static unsigned state = 7;

/* Boxes of a kind: random, on a lattice (many touch exactly), nested, points, all the same, a few
   that are empty or not finite. */
static void make_boxes(int kind, PetscInt n, PetscReal (*box)[6])
{
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal size = kind == 3 ? 0 : 0.2 * PetscAbsReal(test_random(&state));

    for (int k = 0; k < 3; k++) {
      const PetscReal x = kind == 1   ? PetscFloorReal(4 * test_random(&state))
                          : kind == 4 ? 0.5
                                      : test_random(&state);

      box[i][k] = kind == 2 ? -(PetscReal)i / (PetscReal)n : x - (kind == 1 ? 0.5 : size);
      box[i][3 + k] = kind == 2 ? (PetscReal)i / (PetscReal)n
                                : x + (kind == 1   ? 0.5
                                       : kind == 4 ? 0.25
                                                   : size);
    }
    if (kind == 5 && i % 7 == 0)
      SbBoxClear(box[i]);
    if (kind == 5 && i % 11 == 0)
      box[i][i % 6] = NAN;
  }
}

/* A query returns each overlapping box once: marks[i] counts box i. */
static void check_query(const SbBoxTree *tree, PetscInt n, const PetscReal (*box)[6])
{
  static PetscInt marks[MOST];
  PetscReal b[6];
  SbBoxNearest query;
  PetscInt i;
  PetscInt wrong = 0;

  make_boxes(0, 1, &b);
  if (n && state % 3 == 0)
    (void)PetscArraycpy(b, box[state % (unsigned)n], 6);
  (void)PetscArrayzero(marks, MOST);
  for (SbBoxNearestBegin(tree, b, 0, &query); SbBoxNearestNext(&query, &i);)
    marks[i]++;
  for (i = 0; i < n; i++)
    wrong += marks[i] != (PetscInt)overlap(box[i], b);
  SB_CHECK(wrong == 0, "%d of %d boxes are given that do not meet, twice, or not though they do",
           (int)wrong, (int)n);
}

static PetscReal distance2(const PetscReal a[6], const PetscReal b[6])
{
  PetscReal d2 = 0;

  for (int k = 0; k < 3; k++)
    d2 += PetscSqr(PetscMax(0, PetscMax(a[k] - b[3 + k], b[k] - a[3 + k])));
  return d2;
}

static void check_nearest(const SbBoxTree *tree, PetscInt n, const PetscReal (*box)[6],
                          PetscInt *tests)
{
  const PetscReal limit2 = state % 2 ? PETSC_MAX_REAL : 0.01;
  PetscReal b[6];
  PetscReal best = limit2;
  SbBoxNearest nearest;
  PetscInt i;
  PetscInt found = -1;
  PetscInt within = 0;
  PetscInt given = 0;

  make_boxes(state % 5 < 2 ? 0 : 3, 1, &b);
  for (i = 0; i < n; i++)
    best = PetscMin(best, distance2(box[i], b));
  for (SbBoxNearestBegin(tree, b, limit2, &nearest); SbBoxNearestNext(&nearest, &i); ++*tests) {
    if (distance2(box[i], b) < nearest.limit2) {
      nearest.limit2 = distance2(box[i], b);
      found = i;
    }
  }
  SB_CHECK(nearest.limit2 == best && (found >= 0) == (best < limit2),
           "the nearest box is %g away, not %g", best, nearest.limit2);

  /* if the limit is not reduced, all boxes within it are returned */
  for (SbBoxNearestBegin(tree, b, 0.01, &nearest); SbBoxNearestNext(&nearest, &i);)
    given++;
  for (i = 0; i < n; i++)
    within += distance2(box[i], b) <= 0.01;
  SB_CHECK(given == within, "%d boxes are given within the limit, there are %d", (int)given,
           (int)within);
}

static PetscInt check_pairs(const SbBoxTree *tree[2], const PetscInt n[2],
                            const PetscReal (*box[2])[6], PetscReal grown, PetscInt room)
{
  static signed char marks[MOST][MOST];
  static PetscInt pair[2 * 4096];
  const PetscBool self = (PetscBool)(tree[0] == tree[1]);
  SbBoxPairs pairs;
  PetscInt wrong = 0;
  PetscInt total = 0;

  (void)PetscMemzero(marks, sizeof(marks));
  SbBoxPairsBegin(tree[0], tree[1], grown, &pairs);
  for (PetscInt m; (m = SbBoxPairsNext(&pairs, room, pair)) > 0; total += m) {
    for (PetscInt i = 0; i < m; i++) {
      const PetscInt a = pair[2 * i];
      const PetscInt b = pair[2 * i + 1];

      marks[self ? PetscMin(a, b) : a][self ? PetscMax(a, b) : b]++;
    }
    SB_CHECK(m <= room, "%d pairs are written where there is room for %d", (int)m, (int)room);
  }
  for (PetscInt i = 0; i < n[0]; i++) {
    PetscReal b[6];

    for (int k = 0; k < 6; k++)
      b[k] = box[0][i][k] + (k < 3 ? -grown : grown);
    for (PetscInt j = 0; j < n[1]; j++) {
      const PetscBool meet = (PetscBool)(overlap(b, box[1][j]) && (!self || i < j));

      wrong += marks[i][j] != (PetscInt)meet;
    }
  }
  SB_CHECK(wrong == 0, "%d pairs of %d and %d boxes are wrong", (int)wrong, (int)n[0], (int)n[1]);
  return total;
}

static PetscErrorCode check_trees(void)
{
  static const PetscInt sizes[] = {0, 1, 2, 3, 4, 5, 15, 16, 17, 63, 64, 65, 100, 257, MOST};
  static PetscReal box[2][MOST][6];
  const PetscReal(*both[2])[6] = {(const PetscReal(*)[6])box[0], (const PetscReal(*)[6])box[1]};
  PetscInt total = 0;
  PetscInt tests = 0;
  PetscInt asked = 0;

  PetscFunctionBeginUser;
  for (int kind = 0; kind < 6; kind++) {
    for (size_t s = 0; s < PETSC_STATIC_ARRAY_LENGTH(sizes); s++) {
      const PetscInt n[2] = {sizes[s],
                             sizes[(s * 7 + (size_t)kind) % PETSC_STATIC_ARRAY_LENGTH(sizes)]};
      SbBoxTree tree[2];
      const SbBoxTree *ab[2] = {&tree[0], &tree[1]};
      const SbBoxTree *aa[2] = {&tree[0], &tree[0]};

      for (int t = 0; t < 2; t++) {
        make_boxes(kind, n[t], box[t]);
        PetscCall(SbBoxTreeCreate(n[t], both[t], &tree[t]));
      }
      for (int moved = 0; moved < 2; moved++) {
        const PetscReal(*aabox[2])[6] = {both[0], both[0]};
        const PetscInt nn[2] = {n[0], n[0]};

        for (int i = 0; i < 20; i++)
          check_query(&tree[0], n[0], both[0]);
        for (int i = 0; i < 20 && kind != 5; i++, asked++)
          check_nearest(&tree[0], n[0], both[0], &tests);
        total += check_pairs(ab, n, both, 0, 4096);
        total += check_pairs(ab, n, both, 0.05, 16);
        total += check_pairs(aa, nn, aabox, 0, 4096);
        total += check_pairs(aa, nn, aabox, 0.05, 100);
        if (moved)
          continue;
        for (int t = 0; t < 2; t++) {
          make_boxes(kind ? 0 : 5, n[t], box[t]);
          PetscCall(SbBoxTreeRefit(&tree[t], both[t]));
        }
        if (!kind)
          break;
      }
      for (int t = 0; t < 2; t++)
        PetscCall(SbBoxTreeDestroy(&tree[t]));
    }
  }
  SB_CHECK(total > 500000, "%d pairs in all", (int)total);
  SB_CHECK(tests < 25 * asked, "%d boxes were looked at for %d nearest ones", (int)tests,
           (int)asked);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cloud that moves, is inverted and grows keeps its tree; if its halves move apart, the tree is
   rebuilt, few times. */
static PetscErrorCode check_refit(void)
{
  static PetscReal box[MOST][6], moved[MOST][6];
  const PetscReal(*b)[6] = (const PetscReal(*)[6])moved;
  SbBoxTree tree;
  PetscReal size;
  PetscInt built = 0;

  PetscFunctionBeginUser;
  make_boxes(0, MOST, box);
  PetscCall(SbBoxTreeCreate(MOST, (const PetscReal(*)[6])box, &tree));
  for (int step = 0; step < 20; step++) {
    for (PetscInt i = 0; i < MOST; i++) {
      for (int k = 0; k < 6; k++)
        moved[i][k] = (1 + 0.5 * step) * (step % 2 ? box[i][k]
                                          : k < 3  ? -box[i][k + 3]
                                                   : -box[i][k - 3]) +
                      10 * step;
    }
    size = tree.size;
    PetscCall(SbBoxTreeRefit(&tree, b));
    built += tree.size != size;
  }
  SB_CHECK(built == 0, "the tree was made %d times again", (int)built);
  for (int step = 0; step < 20; step++) {
    for (PetscInt i = 0; i < MOST; i++)
      for (int k = 0; k < 6; k++)
        moved[i][k] = box[i][k] + (k % 3 == 0 && i % 2 ? step : 0);
    size = tree.size;
    PetscCall(SbBoxTreeRefit(&tree, b));
    built += tree.size != size;
    check_query(&tree, MOST, b);
  }
  SB_CHECK(built > 0 && built < 4, "the tree was made %d times again", (int)built);
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points in clusters, in chains and coincident, far from the origin too; against all pairs,
   repeated until chains are complete. */
static PetscErrorCode check_weld(void)
{
  static PetscReal x[3 * MOST];
  PetscInt map[MOST], first[MOST];
  PetscInt welded = 0;

  PetscFunctionBeginUser;
  for (int i = 0; i < 40; i++) {
    const PetscReal tolerance = i % 4 ? 0.01 : 0;
    const PetscReal far = i % 3 ? 0 : 4096;
    const PetscInt n = i == 0 ? 0 : MOST;
    const PetscBool chains = (PetscBool)(i / 4 % 2);
    PetscBool changed = chains;
    PetscInt wrong = 0;

    for (PetscInt k = 0; k < 3 * n; k++) {
      x[k] = far + (i % 4 ? test_random(&state) : PetscFloorReal(5 * test_random(&state)));
      if (i % 2 && k / 3 % 5)
        x[k] = x[k - 3] + 0.008 * test_random(&state);
    }
    PetscCall(SbWeld(n, x, tolerance, chains, map));
    for (PetscInt v = 0; v < n; v++) {
      first[v] = v;
      for (PetscInt w = v - 1; w >= 0 && !chains; w--) {
        const PetscReal r[3] = {x[3 * v] - x[3 * w], x[3 * v + 1] - x[3 * w + 1],
                                x[3 * v + 2] - x[3 * w + 2]};

        if (first[w] == w && SbDot3(r, r) <= tolerance * tolerance)
          first[v] = w;
      }
    }
    while (changed) {
      changed = PETSC_FALSE;
      for (PetscInt v = 0; v < n; v++) {
        for (PetscInt w = 0; w < v; w++) {
          const PetscReal r[3] = {x[3 * v] - x[3 * w], x[3 * v + 1] - x[3 * w + 1],
                                  x[3 * v + 2] - x[3 * w + 2]};

          if (first[v] == first[w] || SbDot3(r, r) > tolerance * tolerance)
            continue;
          first[v] = first[w] = PetscMin(first[v], first[w]);
          changed = PETSC_TRUE;
        }
      }
    }
    for (PetscInt v = 0; v < n; v++) {
      wrong += map[v] != first[v];
      welded += map[v] != v;
    }
    SB_CHECK(wrong == 0, "%d of %d points are welded to others than they should", (int)wrong,
             (int)n);
  }
  SB_CHECK(welded > 2000, "%d points are welded", (int)welded);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_trees());
  PetscCall(check_refit());
  PetscCall(check_weld());
  SB_TEST_END();
}
