// Map from file numbers to indices, and groups assigned to items by number: against a linear
// search. @ranks 1
#include <stdlib.h>
#include "../../src/meshio/meshio_impl.h"
#include "mesh_test.h"

/* Every number is found at its position, and its neighbours if they are numbers too. */
static PetscErrorCode test_find(PetscInt n, const int64_t number[])
{
  SbNumbers index = {0};
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++)
    PetscCall(SbNumbersAdd(&index, number[i]));
  for (PetscInt i = 0; i < n; i++) {
    for (int64_t d = -1; d <= 1; d++) {
      const int64_t wanted = (int64_t)((uint64_t)number[i] + (uint64_t)d);
      PetscInt at = -1;

      for (PetscInt k = 0; k < n; k++)
        at = number[k] == wanted ? k : at;
      wrong += SbNumbersFind(&index, wanted) != at;
    }
  }
  SB_CHECK(!wrong, "%d of %d wrong", (int)wrong, (int)(3 * n));
  PetscCall(SbNumbersDestroy(&index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool has_group(const SbImport *im, int dim, PetscInt item, PetscInt group)
{
  const PetscInt tags = im->item[dim].tags[item];

  for (PetscInt t = im->tags_start[tags]; t < im->tags_start[tags + 1]; t++)
    if (im->tags_group[t] == group)
      return PETSC_TRUE;
  return PETSC_FALSE;
}

/* Random group memberships, some repeated, beside one group that the items have from the
   beginning. */
static PetscErrorCode test_members(void)
{
  enum {
    NITEM = 40,
    NGROUP = 9
  };
  static PetscBool expected[4][NITEM][NGROUP + 1];
  SbImport im = {0};
  PetscInt group[NGROUP + 1], tags;
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  PetscCall(SbImportTagSet(&im, 0, NULL, &tags));
  for (int g = 0; g <= NGROUP; g++)
    PetscCall(SbImportGroup(&im, g % 4, 100 + g, NULL, &group[g]));
  PetscCall(SbImportTagSet(&im, 1, &group[NGROUP], &tags));
  for (int d = 0; d < 4; d++) {
    for (PetscInt i = 0; i < NITEM; i++) {
      const PetscBool first = (PetscBool)(i % 3 == 0);

      PetscCall(SbImportAddItem(&im, d, (PetscInt[]){0, 1, 2, 3}, first ? tags : 0, i));
      expected[d][i][NGROUP] = first;
    }
  }
  srand(7);
  for (int k = 0; k < 700; k++) {
    const int d = rand() % 4;
    const int i = rand() % NITEM;
    const int g = rand() % NGROUP;

    PetscCall(SbImportAddMember(&im, d, i, group[g]));
    expected[d][i][g] = PETSC_TRUE;
  }
  PetscCall(SbImportJoinGroups(&im));
  for (int d = 0; d < 4; d++) {
    for (PetscInt i = 0; i < NITEM; i++)
      for (int g = 0; g <= NGROUP; g++)
        wrong += has_group(&im, d, i, group[g]) != expected[d][i][g];
  }
  SB_CHECK(!wrong, "%d wrong memberships", (int)wrong);
  SB_CHECK(!im.nmember.n, "the list is not empty");
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Many groups are found again, each with a separate tag set. */
static PetscErrorCode test_many_groups(void)
{
  enum {
    N = 5000
  };
  SbImport im = {0};
  PetscInt group, tags, again;
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  PetscCall(SbImportTagSet(&im, 0, NULL, &tags));
  for (int round = 0; round < 2; round++) {
    for (int64_t k = 0; k < N; k++) {
      PetscCall(SbImportGroup(&im, (PetscInt)(k % 4), (k - N / 2) * 1000003, NULL, &group));
      wrong += group != k;
      PetscCall(SbImportTagsAlone(&im, (PetscInt)(k % 4), (k - N / 2) * 1000003, NULL, &tags));
      PetscCall(SbImportTagSet(&im, 1, &group, &again));
      wrong += tags != again || tags == 0;
    }
  }
  SB_CHECK(!wrong && im.ngroup == N && im.ntags == N + 1, "%d wrong; %d groups, %d tag sets",
           (int)wrong, (int)im.ngroup, (int)im.ntags);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const int64_t dense[] = {7, 3, -2, 5, 4};
  const int64_t far[] = {INT64_MAX, 1, INT64_MIN, 1000000000000, -5};
  const int64_t consecutive[] = {-2, -1, 0, 1};
  const int64_t round[] = {INT64_MAX - 1, INT64_MAX, INT64_MIN};
  const int64_t twice[] = {1, INT64_MAX, 5, INT64_MAX};
  SbNumbers index = {0};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_find(5, dense));
  PetscCall(test_find(5, far));
  PetscCall(test_find(4, consecutive));
  PetscCall(test_find(3, round));
  SB_CHECK(SbNumbersFind(&index, 0) == -1, "found in nothing");
  for (int i = 0; i < 4; i++)
    PetscCall(SbNumbersAdd(&index, twice[i]));
  SB_CHECK(SbNumbersFind(&index, INT64_MAX) == 3 && SbNumbersFind(&index, 5) == 2,
           "not the last one");
  PetscCall(SbNumbersDestroy(&index));
  PetscCall(test_members());
  PetscCall(test_many_groups());
  SB_TEST_END();
}
