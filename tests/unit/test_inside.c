// @ranks 1 2 3 4
/*
  Points in tets: those that the tree finds, on any number of ranks, are those of a loop over all tets on one: bodies of all elements in each other, one bent
  into itself, and bodies whose meshes coincide.
*/
#include "../../src/contact/surface_impl.h"
#include "surface_fixture.h"

#define RING SETS "-bodies a" BODY("a", "%s", "box:2,0.2,0.1:24,3,2", "0,0,0")

/* Solves A w = b by Cramer's rule; A by columns. */
static void solve(const PetscReal A[3][3], const PetscReal b[3], PetscReal w[3])
{
  PetscReal n[3], all;

  SbCross(A[1], A[2], n);
  all = SbDot3(A[0], n);
  w[0] = SbDot3(b, n) / all;
  SbCross(A[2], A[0], n);
  w[1] = SbDot3(b, n) / all;
  SbCross(A[0], A[1], n);
  w[2] = SbDot3(b, n) / all;
}

/* The part whose tet a point is in, by a loop over all tets; `near`: within so much of a face, where rounding decides. */
static PetscInt loop(const Case *c, PetscInt point, PetscBool self, PetscReal reach, PetscBool *near)
{
  const SbSpace space = c->m->space;
  const SbMesh mesh = space->mesh;
  const SbDetectScene *g = &c->s->scene;
  PetscInt part = -1;

  *near = PETSC_FALSE;
  for (PetscInt cell = 0; cell < mesh->ncell_owned; cell++) {
    PetscReal x[4][3], A[3][3], b[3], w[4], far = -1;

    if (mesh->cell_body[cell] == g->point_part[point]) {
      if (!self) continue;
      for (int k = 0; k < 3; k++) {
        PetscReal low = 1e30, high = -1e30;

        for (int q = 0; q < 4; q++) {
          low = PetscMin(low, mesh->x[3 * mesh->cell[4 * cell + q] + k]);
          high = PetscMax(high, mesh->x[3 * mesh->cell[4 * cell + q] + k]);
        }
        far = PetscMax(far, PetscMax(low - g->P[3 * point + k], g->P[3 * point + k] - high));
      }
      if (far <= 2 * reach) continue;
    }
    for (int q = 0; q < 4; q++) SbContactSurfacePosition(space, 4 * cell + q, c->u, x[q]);
    for (int k = 0; k < 3; k++) {
      for (int q = 0; q < 3; q++) A[q][k] = x[q + 1][k] - x[0][k];
      b[k] = g->p[3 * point + k] - x[0][k];
    }
    solve((const PetscReal(*)[3])A, b, w);
    w[3] = 1 - w[0] - w[1] - w[2];
    if (w[0] < -1e-5 || w[1] < -1e-5 || w[2] < -1e-5 || w[3] < -1e-5) continue;
    if (w[0] < 1e-5 || w[1] < 1e-5 || w[2] < 1e-5 || w[3] < 1e-5)
      *near = PETSC_TRUE;
    else if (part < 0 || mesh->cell_body[cell] < part)
      part = mesh->cell_body[cell];
  }
  return part;
}

/* On all ranks, and on one by the loop; counts the points inside. */
static PetscErrorCode compare(const Case x[2], SbInside inside, PetscBool self, PetscReal reach,
                              PetscInt *count)
{
  const SbDetectScene *g = &x[0].s->scene, *one = &x[1].s->scene;
  PetscInt *part, *at, most = 0, in = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < one->npoint; i++) most = PetscMax(most, one->point_id[i]);
  PetscCall(PetscMalloc2(g->npoint, &part, most + 1, &at));
  for (PetscInt i = 0; i < one->npoint; i++) at[one->point_id[i]] = i;
  PetscCall(SbInsideFind(inside, x[0].u, self, part));
  for (PetscInt i = 0; i < g->npoint; i++) {
    PetscBool near;
    const PetscInt is = loop(&x[1], at[g->point_id[i]], self, reach, &near);

    SB_CHECK(part[i] == is || near, "point %d is in part %d, by a loop in %d", (int)g->point_id[i],
             (int)part[i], (int)is);
    in += part[i] >= 0;
  }
  PetscCall(PetscFree2(part, at));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &in, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  *count += in;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two bodies ever deeper in each other. */
static PetscErrorCode test_pair(const char *options)
{
  Case x[2];
  SbInside inside;
  PetscInt count = 0, apart = 0;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) PetscCall(open_on(k ? PETSC_COMM_SELF : PETSC_COMM_WORLD, options, 0, &x[k]));
  PetscCall(SbInsideCreate(x[0].s, &inside));
  for (int step = 0; step < 6; step++) {
    PetscBool close;

    for (int k = 0; k < 2; k++) {
      PetscCall(fill(&x[k], step, 0.02, 0.02 * step, step ? -0.06 * step : 0.2, x[k].u));
      PetscCall(SbContactSurfaceUpdate(x[k].s, NULL, x[k].u, 0.03, PETSC_FALSE, &close));
    }
    PetscCall(compare(x, inside, PETSC_FALSE, 0.03, step ? &count : &apart));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  pair: %d points inside\n", (int)count));
  SB_CHECK(count > 30 && !apart, "%d points inside, %d when apart", (int)count, (int)apart);
  PetscCall(SbInsideDestroy(&inside));
  for (int k = 0; k < 2; k++) PetscCall(close_case(&x[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar bent to more than a ring: its ends are in each other. */
static PetscErrorCode test_ring(const char *element)
{
  char options[1024];
  Case x[2];
  SbInside inside;
  PetscInt count[2] = {0, 0};

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options), RING, element));
  for (int k = 0; k < 2; k++) PetscCall(open_on(k ? PETSC_COMM_SELF : PETSC_COMM_WORLD, options, 0, &x[k]));
  PetscCall(SbInsideCreate(x[0].s, &inside));
  for (int step = 0; step < 4; step++) {
    PetscBool close;

    for (int k = 0; k < 2; k++) {
      for (PetscInt i = 0; i < x[k].m->space->nnode; i++) {
        const PetscReal *X = x[k].m->space->node_x + 3 * i, turn = (2 * PETSC_PI + 0.11 * step) / 2,
                        r = 1 / turn + X[2] + 0.01 * X[0];

        x[k].u[3 * i] = r * PetscSinReal(turn * X[0]) - X[0];
        x[k].u[3 * i + 1] = 0.02 * X[0];
        x[k].u[3 * i + 2] = r * PetscCosReal(turn * X[0]) - X[2];
      }
      PetscCall(SbContactSurfaceUpdate(x[k].s, NULL, x[k].u, 0.02, PETSC_TRUE, &close));
    }
    PetscCall(compare(x, inside, PETSC_TRUE, 0.02, &count[step > 0]));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  ring: %d points inside\n", (int)count[1]));
  SB_CHECK(count[1] > 10, "too few points inside");
  PetscCall(SbInsideDestroy(&inside));
  for (int k = 0; k < 2; k++) PetscCall(close_case(&x[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points of a set of two bodies whose meshes meet in vertices, edges or faces, the second moved along x and z. */
static PetscErrorCode test_coincident(const char *options, PetscInt set, PetscReal shift, PetscReal lift,
                                      PetscInt expected)
{
  Case c;
  SbInside inside;
  PetscInt *part, n = 0;
  PetscBool close;

  PetscFunctionBeginUser;
  PetscCall(open_on(PETSC_COMM_WORLD, options, set, &c));
  PetscCall(SbInsideCreate(c.s, &inside));
  PetscCall(fill(&c, 0, 0, shift, lift, c.u));
  PetscCall(SbContactSurfaceUpdate(c.s, NULL, c.u, 0.1, PETSC_FALSE, &close));
  PetscCall(PetscMalloc1(c.s->scene.npoint, &part));
  PetscCall(SbInsideFind(inside, c.u, PETSC_FALSE, part));
  for (PetscInt i = 0; i < c.s->scene.npoint; i++) n += part[i] >= 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(n == expected, "%d points of set %d inside, not %d, moved by %g and %g m", (int)n, (int)set,
           (int)expected, (double)shift, (double)lift);
  PetscCall(PetscFree(part));
  PetscCall(SbInsideDestroy(&inside));
  PetscCall(close_case(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define CUBES \
  SETS "-bodies a,b" BODY("a", "p1", "box:1,1,1:4", "0,0,0") BODY("b", "p1", "box:1,1,1:4", "0,0,0")

/* Of one layer: all vertices are on the surface, and edges and faces within the body have no others. */
#define PLATES                                                      \
  SETS "-bodies a,b" BODY("a", "p1", "box:1,1,0.25:4,4,1", "0,0,0") \
    BODY("b", "p1", "box:1,1,0.25:4,4,1", "0,0.125,0")

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_pair(PAIR("p1", "p1")));
  PetscCall(test_pair(PAIR("cr", "dg")));
  PetscCall(test_pair(CROSS("p1", "cr")));
  PetscCall(test_ring("p1"));
  PetscCall(test_ring("dg"));
  PetscCall(test_coincident(CUBES, 0, 1, 0, 0));         /* face on face */
  PetscCall(test_coincident(CUBES, 0, 0, 0, 0));         /* in one place: all on the surface */
  PetscCall(test_coincident(CUBES, 0, 0.5, 0, 2 * 9));   /* the middle of one face of each, not its sides */
  PetscCall(test_coincident(CUBES, 0, 0.625, 0, 2 * 9)); /* the same between vertices */
  PetscCall(test_coincident(PLATES, 0, 0.125, 0.125, 2 * 16)); /* vertices in the middle of cells */
  PetscCall(test_coincident(CUBES, 1, 1, 0.3, 0));             /* on a face that the set does not have */
  SB_TEST_END();
}
