// @ranks 1 3 4
/* Positions grouped by key, against a search for each key; items sorted by several keys; arrays of
   all ranks put together. */
#include "test.h"

int main(int argc, char **argv)
{
  enum {
    N = 50,
    NKEY = 7
  };
  PetscInt key[N], triple[N][3], *start, *item, mine[3], total, *all, before;
  PetscInt at = 0;

  SB_TEST_BEGIN(argc, argv);

  /* keys from -1 to NKEY: the lowest and the highest are ignored, key 3 has no items */
  for (PetscInt i = 0; i < N; i++)
    key[i] = i * i % 9 == 4 ? 4 : i * i % 9 - 1;
  PetscCall(SbBucketByKey(N, key, NKEY, &start, &item));
  for (PetscInt k = 0; k < NKEY; k++) {
    SB_CHECK(start[k] == at, "key %d starts at %d", (int)k, (int)start[k]);
    for (PetscInt i = 0; i < N; i++) {
      if (key[i] != k)
        continue;
      SB_CHECK(item[at] == i, "place %d holds %d", (int)at, (int)item[at]);
      at++;
    }
  }
  SB_CHECK(start[NKEY] == at && at < N, "%d positions", (int)start[NKEY]);
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(item));
  PetscCall(SbBucketByKey(0, NULL, 0, &start, &item));
  SB_CHECK(start[0] == 0, "nothing");
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(item));

  /* sorted by two keys, many of them equal; the third number is carried along */
  for (PetscInt i = 0; i < N; i++) {
    triple[i][0] = i * i % 5;
    triple[i][1] = -(i * 7 % N);
    triple[i][2] = i;
  }
  PetscCall(SbSortByKeys(N, sizeof(*triple), 2, triple));
  for (PetscInt i = 0; i < N; i++) {
    const PetscInt *a = triple[i];
    const PetscInt *b = triple[PetscMin(i + 1, N - 1)];

    SB_CHECK(a[0] < b[0] || (a[0] == b[0] && a[1] <= b[1]), "item %d", (int)i);
    SB_CHECK(a[0] == a[2] * a[2] % 5 && a[1] == -(a[2] * 7 % N), "the rest of item %d", (int)i);
  }
  PetscCall(SbSortByKeys(0, sizeof(*triple), 2, NULL));

  /* rank r has r % 3 numbers */
  for (PetscInt i = 0; i < test_rank % 3; i++)
    mine[i] = 10 * test_rank + i;
  PetscCall(SbAllgatherv(PETSC_COMM_WORLD, MPIU_INT, test_rank % 3, mine, &total, &all, &before));
  at = 0;
  for (PetscMPIInt r = 0; r < test_size; r++) {
    if (r == test_rank)
      SB_CHECK(before == at, "%d entries before", (int)before);
    for (PetscInt i = 0; i < r % 3; i++, at++)
      SB_CHECK(all[at] == 10 * r + i, "entry %d is %d", (int)at, (int)all[at]);
  }
  SB_CHECK(total == at, "%d entries", (int)total);
  PetscCall(PetscFree(all));
  SB_TEST_END();
}
