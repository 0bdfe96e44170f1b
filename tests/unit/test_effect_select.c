/*
  Selection of cells, facets and nodes by named sets on a unit cube: exact counts and areas over all ranks, each item once
  if sets overlap, and error messages for invalid sets.
*/
// @ranks 1 3
#include "../../src/effect/effect_impl.h"
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"bottom", "plane:0,0,1,0"},    {"west", "plane:1,0,0,0"},         {"all", "box:-1,-1,-1,2,2,2"},
  {"corner", "sphere:0,0,0,0.1"}, {"lower", "box:-1,-1,-1,2,2,0.5"},
};

/* List of sets without an option. */
static PetscErrorCode make_on(const char *a, const char *b, SbEffectOn *on)
{
  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(on->option, "-effect_test_on", sizeof(on->option)));
  on->n = b ? 2 : a ? 1 : 0;
  PetscCall(PetscCalloc1(2, &on->name));
  if (a) PetscCall(PetscStrncpy(on->name[0], a, SB_NAME_MAX));
  if (b) PetscCall(PetscStrncpy(on->name[1], b, SB_NAME_MAX));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_facets(Fixture *x, const char *a, const char *b, PetscReal area, PetscInt count)
{
  SbEffectOn on;
  SbFacet *facets;
  PetscInt n;
  PetscReal sum[2] = {0, 0}, all[2];

  PetscFunctionBeginUser;
  PetscCall(make_on(a, b, &on));
  PetscCall(SbEffectFacets(x->space, &on, &n, &facets));
  for (PetscInt i = 0; i < n; i++) {
    if (facets[i].cell >= x->mesh->ncell_owned) continue;
    sum[0] += facets[i].area;
    sum[1] += 1;
  }
  PetscCallMPI(MPI_Allreduce(sum, all, 2, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all[0], area, 1e-13, "area of the facets");
  SB_CHECK_NEAR(all[1], count, 0, "number of facets");
  PetscCall(PetscFree(facets));
  PetscCall(PetscFree(on.name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_nodes(Fixture *x, const char *a, const char *b, PetscInt count)
{
  SbEffectOn on;
  PetscInt n, *nodes, owned = 0, all;

  PetscFunctionBeginUser;
  PetscCall(make_on(a, b, &on));
  PetscCall(SbEffectNodes(x->space, &on, &n, &nodes));
  for (PetscInt i = 0; i < n; i++) {
    owned += nodes[i] < x->space->nnode_owned;
    SB_CHECK(!i || nodes[i] > nodes[i - 1], "nodes ascend");
  }
  PetscCallMPI(MPI_Allreduce(&owned, &all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all, count, 0, "number of nodes");
  PetscCall(PetscFree(nodes));
  PetscCall(PetscFree(on.name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_cells(Fixture *x, const char *a, const char *b, PetscReal volume)
{
  SbEffectOn on;
  PetscInt n, *cells;
  PetscReal sum = 0, all;

  PetscFunctionBeginUser;
  PetscCall(make_on(a, b, &on));
  PetscCall(SbEffectCells(x->space, &on, &n, &cells));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal e[3][3];
    const PetscInt *v = &x->mesh->cell[4 * cells[i]];
    const PetscReal *X = x->mesh->x;

    if (cells[i] >= x->mesh->ncell_owned) continue;
    for (int k = 0; k < 9; k++) e[k / 3][k % 3] = X[3 * v[k / 3 + 1] + k % 3] - X[3 * v[0] + k % 3];
    for (int k = 0; k < 3; k++) {
      sum += e[0][k] * (e[1][(k + 1) % 3] * e[2][(k + 2) % 3] - e[1][(k + 2) % 3] * e[2][(k + 1) % 3]) / 6;
    }
  }
  PetscCallMPI(MPI_Allreduce(&sum, &all, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all, volume, 1e-13, "volume of the cells");
  PetscCall(PetscFree(cells));
  PetscCall(PetscFree(on.name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_errors(Fixture *x)
{
  SbEffectOn on;
  SbFacet *facets;
  PetscInt n, *items;

  PetscFunctionBeginUser;
  // One vertex, no facet, no cell: the message names set and counts.
  PetscCall(make_on("bottom", "corner", &on));
  SB_CHECK_ERROR(SbEffectFacets(x->space, &on, &n, &facets), PETSC_ERR_USER_INPUT, "1 vertices|0");
  SB_CHECK_ERROR(SbEffectCells(x->space, &on, &n, &items), PETSC_ERR_USER_INPUT,
                 "-effect_test_on|set bottom");
  PetscCall(PetscFree(on.name));
  PetscCall(make_on("botom", NULL, &on));
  SB_CHECK_ERROR(SbEffectNodes(x->space, &on, &n, &items), PETSC_ERR_USER, "bottom");
  PetscCall(PetscFree(on.name));
  PetscCall(make_on(NULL, NULL, &on));
  SB_CHECK_ERROR(SbEffectNodes(x->space, &on, &n, &items), PETSC_ERR_USER_INPUT, "-effect_test_on");
  PetscCall(PetscFree(on.name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets and cells are independent of the element; the nodes of CR and DG are at faces. */
static PetscErrorCode check_faces(const char *element, PetscInt all, PetscInt bottom)
{
  Fixture x;
  SbEffectOn on;
  PetscInt n, *items;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:4", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(check_facets(&x, "all", "west", 6, 192));
  PetscCall(check_cells(&x, "lower", "all", 1));
  PetscCall(check_nodes(&x, "bottom", NULL, bottom));
  PetscCall(check_nodes(&x, "bottom", "west", 2 * bottom));
  PetscCall(check_nodes(&x, "west", "bottom", 2 * bottom));
  PetscCall(check_nodes(&x, "all", "corner", all));
  PetscCall(check_errors(&x));
  PetscCall(make_on("corner", NULL, &on));
  SB_CHECK_ERROR(SbEffectNodes(x.space, &on, &n, &items), PETSC_ERR_USER_INPUT,
                 "-effect_test_on|1 vertices|body block");
  PetscCall(PetscFree(on.name));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Fixture x;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  // 64 cubes of six tets: 192 faces on the boundary, (6 * 64 * 4 - 192) / 2 inside.
  PetscCall(check_faces("cr", 864, 32));
  PetscCall(check_faces("dg", 1536, 32));
  fixture_use("p1", "p1", PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:4", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(check_facets(&x, "bottom", NULL, 1, 32));
  PetscCall(check_facets(&x, "bottom", "west", 2, 64));
  PetscCall(check_facets(&x, "bottom", "bottom", 1, 32));
  PetscCall(check_facets(&x, "all", "west", 6, 192));
  PetscCall(check_facets(&x, "west", "all", 6, 192));
  PetscCall(check_nodes(&x, "bottom", NULL, 25));
  PetscCall(check_nodes(&x, "bottom", "west", 45));
  PetscCall(check_nodes(&x, "all", "corner", 125));
  PetscCall(check_cells(&x, "lower", NULL, 0.5));
  PetscCall(check_cells(&x, "lower", "all", 1));
  PetscCall(check_cells(&x, "all", "lower", 1));
  PetscCall(check_cells(&x, NULL, NULL, 1));
  PetscCall(check_errors(&x));
  PetscCall(fixture_destroy(&x));
  SB_TEST_END();
}
