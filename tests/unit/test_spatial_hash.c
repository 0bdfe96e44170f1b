// @ranks 1
/*
  Spatial hash against all boxes one by one: pairs of two sets and within one, each once; one cell,
  borders of cells, huge and tiny boxes together, far outliers, any unit, far from the origin.
  Nothing is allocated by a second fill; work grows with the boxes and pairs alone.
*/
#include <sbgeometry.h>
#include <math.h>
#include <time.h>
#include "test.h"

#define MOST 400

static unsigned state = 7;
enum {
  RANDOM,
  ONE_CELL,
  BORDERS,
  SIZES,
  POINTS,
  EQUAL,
  EMPTY,
  OUTLIERS,
  PLATES,
  LONG,
  INFINITE,
  KINDS
};

/* Boxes of a kind, for cells of width 1. */
static void make_boxes(int kind, PetscInt n, PetscReal (*box)[6])
{
  for (PetscInt i = 0; i < n; i++) {
    PetscReal size = 0.5 * PetscAbsReal(test_random(&state));
    PetscReal wide = 4.;

    if (kind == ONE_CELL)
      wide = size = 0.05;
    if (kind == SIZES)
      size = PetscPowReal(10., 6. * test_random(&state));
    if (kind == POINTS)
      size = 0.;
    if (kind == OUTLIERS && i % 10 == 0)
      wide = i % 20 ? 1e30 : 1e7;
    for (int k = 0; k < 3; k++) {
      PetscReal x = wide * test_random(&state);
      PetscReal half = size;

      if (kind == BORDERS || kind == POINTS) { /* many touch exactly */
        x = PetscFloorReal(x);
        half = kind == POINTS ? 0. : 0.5 * PetscFloorReal(3. * PetscAbsReal(test_random(&state)));
      }
      if (kind == EQUAL)
        x = half = 0.5;
      if (kind == PLATES && i % 50 == 0)
        half = k == 2 ? 0. : 1e4;
      if (kind == LONG && k == (int)(i % 3))
        half = 300. * PetscAbsReal(test_random(&state));
      box[i][k] = x - half;
      box[i][3 + k] = x + half;
    }
    if (kind == EMPTY && i % 7 == 0)
      SbBoxClear(box[i]);
    if (kind == EMPTY && i % 11 == 0)
      box[i][i % 6] = NAN;
    if (kind == INFINITE && i % 13 == 0) {
      box[i][i % 3] = i % 2 ? -INFINITY : -PETSC_MAX_REAL;
      box[i][3 + i % 3] = i % 2 ? INFINITY : PETSC_MAX_REAL;
    }
  }
}

static PetscBool overlap(const PetscReal a[6], const PetscReal b[6])
{
  return (PetscBool)(a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] &&
                     b[2] <= a[5]);
}

/* One fill with two sets: pairs within the first, and of both. Returns their number. */
static PetscErrorCode check_pairs(SbSpatialHash hash, PetscBool near, const PetscInt n[2],
                                  const PetscReal (*const box[2])[6], PetscInt least,
                                  const char *what, PetscInt *total)
{
  static const int meeting[2][2] = {{0, 0}, {0, 1}};
  static unsigned char marks[2][MOST][MOST];
  const SbHashPair *pair;
  SbHashPairs pairs;
  PetscInt m;
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(marks, sizeof(marks)));
  PetscCall(SbSpatialHashClear(hash));
  for (int s = 0; s < 2; s++)
    PetscCall(SbSpatialHashAdd(hash, n[s], box[s], (PetscBool)(near && s)));
  PetscCall(SbHashPairsBegin(hash, 2, meeting, &pairs));
  for (;;) {
    PetscCall(SbHashPairsNext(&pairs, least, &m, &pair));
    if (!m)
      break;
    for (PetscInt k = 0; k < m; k++) {
      const PetscBool within = (PetscBool)(pair[k].meeting == 0);
      const PetscInt a = within ? PetscMin(pair[k].a, pair[k].b) : pair[k].a;
      const PetscInt b = within ? PetscMax(pair[k].a, pair[k].b) : pair[k].b;

      marks[pair[k].meeting][a][b]++;
    }
    *total += m;
  }
  for (int q = 0; q < 2; q++)
    for (PetscInt i = 0; i < n[0]; i++)
      for (PetscInt j = q ? 0 : i + 1; j < n[q]; j++)
        wrong += marks[q][i][j] != (unsigned char)overlap(box[0][i], box[q][j]);
  SB_CHECK(wrong == 0, "%s: %d pairs of %d and %d boxes are wrong", what, (int)wrong, (int)n[0],
           (int)n[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All kinds, in cells of several widths, in several units, at several distances from the origin. */
static PetscErrorCode check_scenes(void)
{
  static const PetscReal units[] = {1., 1e-9, 1e6, 1e-30};
  static const PetscReal widths[] = {0.01, 0.5, 1., 30.};
  static PetscReal box[2][MOST][6];
  const PetscReal(*const both[2])[6] = {(const PetscReal(*)[6])box[0],
                                        (const PetscReal(*)[6])box[1]};
  PetscInt total = 0;

  PetscFunctionBeginUser;
  for (int kind = 0; kind < KINDS; kind++) {
    for (int u = 0; u < 4; u++) {
      for (int w = 0; w < 4; w++) {
        const PetscInt n[2] = {(kind + u + w) % 5 ? MOST : w, (kind + w) % 7 ? MOST / 2 : 1};
        const PetscReal away = (u + w) % 3 ? 0. : w % 2 ? 1e5 : -1e5;
        SbSpatialHash hash;
        char what[64];

        PetscCall(SbSpatialHashCreate(widths[w] * units[u], &hash));
        for (int s = 0; s < 2; s++) {
          make_boxes(kind, n[s], box[s]);
          for (PetscInt k = 0; k < 6 * n[s]; k++)
            box[s][k / 6][k % 6] = (box[s][k / 6][k % 6] + away) * units[u];
        }
        PetscCall(PetscSNPrintf(what, sizeof(what), "kind %d, unit %g, cell %g, %g away", kind,
                                (double)units[u], (double)widths[w], (double)away));
        PetscCall(check_pairs(hash, PETSC_FALSE, n, both, 1 + 100 * w, what, &total));
        PetscCall(check_pairs(hash, PETSC_TRUE, n, both, PETSC_MAX_INT, what, &total));
        PetscCall(SbSpatialHashDestroy(&hash));
      }
    }
  }
  SB_CHECK(total > 1000000, "%d pairs in all", (int)total);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Boxes that meet none are left out: of two heaps that touch, those of the second that are not near
   the first. */
static PetscErrorCode check_near(void)
{
  static const int meeting[1][2] = {{0, 1}};
  static PetscReal box[2][MOST][6];
  const SbHashPair *pair;
  SbHashPairs pairs;
  SbSpatialHash hash;
  PetscInt n[2];
  PetscInt count[2][3];

  PetscFunctionBeginUser;
  PetscCall(SbSpatialHashCreate(1., &hash));
  for (int s = 0; s < 2; s++)
    make_boxes(RANDOM, MOST, box[s]);
  for (PetscInt i = 0; i < MOST; i++) {
    box[1][i][0] += 6.;
    box[1][i][3] += 6.;
  }
  for (int s = 0; s < 2; s++) {
    PetscCall(SbSpatialHashClear(hash));
    PetscCall(SbSpatialHashAdd(hash, MOST, (const PetscReal(*)[6])box[0], PETSC_FALSE));
    PetscCall(SbSpatialHashAdd(hash, MOST, (const PetscReal(*)[6])box[1], (PetscBool)s));
    PetscCall(SbHashPairsBegin(hash, 1, meeting, &pairs));
    PetscCall(SbHashPairsNext(&pairs, PETSC_MAX_INT, &n[s], &pair));
    SbSpatialHashCount(hash, count[s]);
  }
  SB_CHECK(n[0] == n[1] && n[0] > 50, "%d and %d pairs", (int)n[0], (int)n[1]);
  SB_CHECK(count[0][0] == 2 * MOST && count[1][0] < 3 * MOST / 2 && count[1][1] < count[0][1],
           "%d and %d boxes, %d and %d entries", (int)count[0][0], (int)count[1][0],
           (int)count[0][1], (int)count[1][1]);
  PetscCall(SbSpatialHashDestroy(&hash));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills of the same size, moved each time: memory of the process grows by none of them. */
static PetscErrorCode check_memory(void)
{
  static PetscReal box[2][MOST][6];
  const PetscReal(*const both[2])[6] = {(const PetscReal(*)[6])box[0],
                                        (const PetscReal(*)[6])box[1]};
  const PetscInt n[2] = {MOST, MOST};
  PetscInt total = 0;
  PetscLogDouble before, after;
  SbSpatialHash hash;

  PetscFunctionBeginUser;
  PetscCall(SbSpatialHashCreate(1., &hash));
  for (int s = 0; s < 2; s++)
    make_boxes(RANDOM, MOST, box[s]);
  for (int fill = 0; fill < 50; fill++) {
    PetscCall(check_pairs(hash, (PetscBool)(fill % 2), n, both, 256, "again", &total));
    if (fill == 1)
      PetscCall(PetscMallocGetCurrentUsage(&before));
    for (int s = 0; s < 2; s++)
      for (PetscInt k = 0; k < 6 * MOST; k++)
        box[s][k / 6][k % 6] += 1.;
  }
  PetscCall(PetscMallocGetCurrentUsage(&after));
  SB_CHECK(after == before, "%g bytes more after 50 fills", after - before);
  PetscCall(SbSpatialHashDestroy(&hash));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A fine surface, with a box that covers all, others as long as that, an outlier and a corner a
   thousand times finer: entries and time are those of the boxes that there are. */
static PetscErrorCode check_cost(void)
{
  static const int meeting[1][2] = {{0, 0}};
  const PetscInt n = 200000;
  PetscReal(*box)[6];
  const SbHashPair *pair;
  PetscInt count[3], m;
  PetscInt total = 0;
  SbHashPairs pairs;
  SbSpatialHash hash;
  clock_t start;
  double seconds;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, &box));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal size = i % 4 ? 1. : 1e-3;
    const PetscReal at[3] = {(PetscReal)(i % 400) * size, (PetscReal)(i / 400) * size, 0.};

    for (int k = 0; k < 3; k++) {
      box[i][k] = at[k];
      box[i][3 + k] = at[k] + 0.9 * size;
    }
  }
  for (int k = 0; k < 3; k++) { /* a plate, two long ones, far away */
    box[0][k] = -1e4;
    box[0][3 + k] = 1e4;
    box[1][3 + k] += k == 0 ? 1e4 : 0.;
    box[2][3 + k] += k == 1 ? 1e4 : 0.;
    box[3][k] = box[3][3 + k] = 1e9;
  }
  PetscCall(SbSpatialHashCreate(1.5, &hash));
  start = clock();
  PetscCall(SbSpatialHashAdd(hash, n, (const PetscReal(*)[6])box, PETSC_FALSE));
  PetscCall(SbHashPairsBegin(hash, 1, meeting, &pairs));
  do {
    PetscCall(SbHashPairsNext(&pairs, 256, &m, &pair));
    total += m;
  } while (m);
  seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
  SbSpatialHashCount(hash, count);
  test_print("  %d boxes, %d entries, %d cells, %d pairs: %g s\n", (int)n, (int)count[1],
             (int)count[2], (int)total, seconds);
  SB_CHECK(count[0] == n && count[1] < 8 * n && total >= n - 2, "%d boxes, %d entries, %d pairs",
           (int)count[0], (int)count[1], (int)total);
  SB_CHECK(seconds < 20., "%g s for %d boxes", seconds, (int)n);
  PetscCall(SbSpatialHashDestroy(&hash));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  SbSpatialHash hash;

  PetscCall(check_scenes());
  PetscCall(check_near());
  PetscCall(check_memory());
  PetscCall(check_cost());
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  SB_CHECK(SbSpatialHashCreate(0., &hash) == PETSC_ERR_ARG_OUTOFRANGE, "a cell of no width");
  SB_CHECK(SbSpatialHashCreate(NAN, &hash) == PETSC_ERR_ARG_OUTOFRANGE, "a cell that is no number");
  PetscCall(PetscPopErrorHandler());
  SB_TEST_END();
}
