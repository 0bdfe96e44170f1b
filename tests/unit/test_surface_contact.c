// @ranks 1 2 3 4
/*
  A distributed surface and a detector on each rank find the contacts and the pairs of edges of one rank: between bodies of all elements, sliding, going
  through each other, and of a body with itself.
*/
#include "surface_fixture.h"

#define CONTACT 11 /* point, facet, part, weight 3, gap 6, normal 7, crossed 10 */

/* All contacts of all ranks. */
static PetscErrorCode find(const Case *c, SbDetector detector, PetscInt *n, PetscReal **all)
{
  const SbDetectScene *g = &c->s->scene;
  const SbNear *near;
  PetscReal *mine;

  PetscFunctionBeginUser;
  PetscCall(SbDetectorFind(detector, g, n, &near));
  PetscCall(PetscMalloc1(CONTACT * *n, &mine));
  for (PetscInt i = 0; i < *n; i++) {
    PetscReal *row = mine + CONTACT * i;

    row[0] = (PetscReal)g->point_id[near[i].point];
    row[1] = (PetscReal)g->facet_id[near[i].facet];
    row[2] = (PetscReal)g->facet_part[near[i].facet];
    for (int k = 0; k < 3; k++) row[3 + k] = near[i].weight[k];
    row[6] = near[i].gap;
    for (int k = 0; k < 3; k++) row[7 + k] = near[i].normal[k];
    row[10] = near[i].crossed;
  }
  PetscCall(gather_numbers(c->m->comm, CONTACT * *n, mine, n, all));
  *n /= CONTACT;
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts of all ranks are those of one rank. Counts those found and those crossed. */
static PetscErrorCode compare_contacts(const Case x[2], const SbDetector detector[2], PetscInt count[2])
{
  const PetscInt nbody = x[0].m->nbody, nid = x[0].m->mesh->Nvert + 8 * x[0].m->mesh->Ncell;
  PetscInt n[2], *where;
  PetscReal *all[2];

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) PetscCall(find(&x[k], detector[k], &n[k], &all[k]));
  SB_CHECK(n[0] == n[1], "%d contacts, %d on one rank", (int)n[0], (int)n[1]);
  PetscCall(PetscMalloc1(nbody * nid, &where));
  for (PetscInt i = 0; i < nbody * nid; i++) where[i] = -1;
  for (PetscInt i = 0; i < n[1]; i++)
    where[nbody * (PetscInt)all[1][CONTACT * i] + (PetscInt)all[1][CONTACT * i + 2]] = i;
  for (PetscInt i = 0; i < n[0]; i++) {
    const PetscReal *row = all[0] + CONTACT * i;
    const PetscInt j = where[nbody * (PetscInt)row[0] + (PetscInt)row[2]];

    SB_CHECK(j >= 0, "point %d meets nothing on one rank", (int)row[0]);
    if (j < 0) continue;
    for (int k = 0; k < CONTACT; k++)
      SB_CHECK_NEAR(row[k], all[1][CONTACT * j + k], k < 3 ? 0 : 1e-12, "contact");
    count[0]++;
    count[1] += row[10] > 0;
  }
  PetscCall(PetscFree(where));
  for (int k = 0; k < 2; k++) PetscCall(PetscFree(all[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define PAIR_ROW 9 /* edges, places 2, gap 4, normal 5, crossed 8 */

/* All pairs of edges of all ranks. */
static PetscErrorCode find_pairs(const Case *c, SbDetector detector, PetscInt *n, PetscReal **all)
{
  const SbDetectScene *g = &c->s->scene;
  const SbEdgePair *pair;
  PetscReal *mine;

  PetscFunctionBeginUser;
  PetscCall(SbDetectorFindEdges(detector, g, n, &pair));
  PetscCall(PetscMalloc1(PAIR_ROW * *n, &mine));
  for (PetscInt i = 0; i < *n; i++) {
    PetscReal *row = mine + PAIR_ROW * i;

    for (int k = 0; k < 2; k++) {
      row[k] = (PetscReal)g->edges->id[pair[i].edge[k]];
      row[2 + k] = pair[i].at[k];
    }
    row[4] = pair[i].gap;
    for (int k = 0; k < 3; k++) row[5 + k] = pair[i].normal[k];
    row[8] = pair[i].crossed;
  }
  PetscCall(gather_numbers(c->m->comm, PAIR_ROW * *n, mine, n, all));
  *n /= PAIR_ROW;
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of edges: each pair is found by one rank. */
static PetscErrorCode compare_pairs(const Case x[2], const SbDetector detector[2], PetscInt *count)
{
  PetscInt n[2];
  PetscReal *all[2];

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) PetscCall(find_pairs(&x[k], detector[k], &n[k], &all[k]));
  SB_CHECK(n[0] == n[1], "%d pairs of edges, %d on one rank", (int)n[0], (int)n[1]);
  for (PetscInt i = 0; i < n[0]; i++) {
    const PetscReal *row = all[0] + PAIR_ROW * i;
    PetscInt j = 0;

    while (j < n[1] && (all[1][PAIR_ROW * j] != row[0] || all[1][PAIR_ROW * j + 1] != row[1])) j++;
    SB_CHECK(j < n[1], "edges %d and %d are no pair on one rank", (int)row[0], (int)row[1]);
    for (int k = 0; k < PAIR_ROW && j < n[1]; k++)
      SB_CHECK_NEAR(row[k], all[1][PAIR_ROW * j + k], 1e-12, "pair of edges");
    ++*count;
  }
  for (int k = 0; k < 2; k++) PetscCall(PetscFree(all[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies pressed into each other with wrinkled surfaces, sliding; then jumps through each other. */
static PetscErrorCode test_contacts(const char *options, PetscReal noisy)
{
  Case x[2]; /* on all ranks, on one */
  SbDetector detector[2];
  PetscInt count[3][2] = {{0, 0}}, pairs = 0;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscCall(open_on(k ? PETSC_COMM_SELF : PETSC_COMM_WORLD, options, 0, &x[k]));
    PetscCall(SbDetectorCreate(SB_DETECT_TREE, &detector[k]));
  }
  for (int step = 0; step < 12; step++) {
    const PetscBool jump = (PetscBool)(step % 4 == 3), self = (PetscBool)(step >= 8);
    PetscBool close;

    for (int k = 0; k < 2; k++) {
      PetscCall(PetscArraycpy(x[k].u0, x[k].u, 3 * x[k].m->space->nnode));
      PetscCall(fill(&x[k], step, noisy, 0.03 * step, jump ? -0.3 : -0.03, x[k].u));
      PetscCall(SbContactSurfaceUpdate(x[k].s, step % 4 == 2 ? NULL : x[k].u0, x[k].u, self ? 0.03 : 0.06,
                                       self, &close));
      SB_CHECK(close, "the bodies are close");
    }
    PetscCall(compare_contacts(x, detector, count[self ? 2 : jump]));
    PetscCall(compare_pairs(x, detector, &pairs));
  }
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  contacts: %d sliding, %d after jumps (%d crossed), %d with self-contact; %d pairs of edges\n",
    (int)count[0][0], (int)count[1][0], (int)count[1][1], (int)count[2][0], (int)pairs));
  SB_CHECK(pairs > 10, "too few pairs of edges");
  SB_CHECK(count[0][0] > 100 && count[1][1] > 10 && count[2][0] > 100, "too few contacts");
  for (int k = 0; k < 2; k++) {
    PetscCall(SbDetectorDestroy(&detector[k]));
    PetscCall(close_case(&x[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar bent to a ring that is open by `gap` radians; its ends meet each other, with self-contact alone. */
static void bend(const Case *c, PetscReal gap, PetscReal u[])
{
  const PetscReal length = 2, turn = (2 * PETSC_PI - gap) / length;

  for (PetscInt i = 0; i < c->m->space->nnode; i++) {
    const PetscReal *X = c->m->space->node_x + 3 * i, r = 1 / turn + X[2], angle = turn * X[0];

    u[3 * i] = r * PetscSinReal(angle) - X[0];
    u[3 * i + 1] = 0;
    u[3 * i + 2] = r * PetscCosReal(angle) - X[2];
  }
}

static PetscErrorCode test_ring(const char *element)
{
  char options[1024];
  Case x[2];
  SbDetector detector[2];
  PetscInt count[2] = {0, 0};

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options),
                          SETS "-bodies a" BODY("a", "%s", "box:2,0.2,0.1:24,3,2", "0,0,0"), element));
  for (int k = 0; k < 2; k++) {
    PetscCall(open_on(k ? PETSC_COMM_SELF : PETSC_COMM_WORLD, options, 0, &x[k]));
    PetscCall(SbDetectorCreate(SB_DETECT_TREE, &detector[k]));
    bend(&x[k], 0.2, x[k].u);
  }
  for (int step = 0; step < 8; step++) {
    PetscBool close;

    for (int k = 0; k < 2; k++) {
      PetscCall(PetscArraycpy(x[k].u0, x[k].u, 3 * x[k].m->space->nnode));
      bend(&x[k], 0.16 - 0.04 * step, x[k].u);
      PetscCall(SbContactSurfaceUpdate(x[k].s, x[k].u0, x[k].u, 0.02, PETSC_TRUE, &close));
      SB_CHECK(!close, "one part");
    }
    PetscCall(compare_contacts(x, detector, count));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  ring: %d contacts, %d crossed\n", (int)count[0], (int)count[1]));
  SB_CHECK(count[0] > 20, "too few contacts");
  for (int k = 0; k < 2; k++) {
    PetscCall(SbDetectorDestroy(&detector[k]));
    PetscCall(close_case(&x[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_contacts(PAIR("p1", "p1"), 0.03));
  PetscCall(test_contacts(PAIR("cr", "cr"), 0.01));
  PetscCall(test_contacts(PAIR("dg", "p1"), 0.01));
  PetscCall(test_contacts(CROSS("p1", "dg"), 0.02));
  PetscCall(test_contacts(CROSS("cr", "p1"), 0.01));
  PetscCall(test_ring("p1"));
  PetscCall(test_ring("cr"));
  PetscCall(test_ring("dg"));
  SB_TEST_END();
}
