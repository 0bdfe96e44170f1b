/*
  Selection of cells, facets and nodes by named sets on a unit cube: exact counts and areas over all
  ranks, each item once if sets overlap, and error messages for invalid sets.
*/
// @ranks 1 3
#include "../../src/effect/effect_impl.h"
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"bottom", "plane:0,0,1,0"},    {"west", "plane:1,0,0,0"},         {"all", "box:-1,-1,-1,2,2,2"},
  {"corner", "sphere:0,0,0,0.1"}, {"lower", "box:-1,-1,-1,2,2,0.5"},
};

/* List of sets (NULL: fewer), valid until the next call. */
static const SbEffectOn *on_sets(const char *a, const char *b)
{
  static char names[2][SB_NAME_MAX];
  static SbEffectOn on = {.option = "-effect_test_on", .name = names};

  on.n = b ? 2 : a ? 1 : 0;
  (void)snprintf(names[0], SB_NAME_MAX, "%s", a ? a : "");
  (void)snprintf(names[1], SB_NAME_MAX, "%s", b ? b : "");
  return &on;
}

static PetscErrorCode check_facets(Fixture *x, const char *a, const char *b, PetscReal area,
                                   PetscInt count)
{
  SbFacet *facets;
  PetscInt n;
  PetscReal sum[2] = {0, 0};
  PetscReal all[2];

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(x->space, on_sets(a, b), &n, &facets));
  for (PetscInt i = 0; i < n; i++) {
    if (facets[i].cell >= x->mesh->ncell_owned)
      continue;
    sum[0] += facets[i].area;
    sum[1] += 1;
  }
  PetscCallMPI(MPI_Allreduce(sum, all, 2, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all[0], area, 1e-13, "area of the facets");
  SB_CHECK_NEAR(all[1], count, 0, "number of facets");
  PetscCall(PetscFree(facets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_nodes(Fixture *x, const char *a, const char *b, PetscInt count)
{
  PetscInt n, *nodes;
  PetscInt owned = 0;
  PetscInt all;

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(x->space, on_sets(a, b), SB_ON_NODES, &n, &nodes));
  for (PetscInt i = 0; i < n; i++) {
    owned += nodes[i] < x->space->nnode_owned;
    SB_CHECK(!i || nodes[i] > nodes[i - 1], "nodes ascend");
  }
  PetscCallMPI(MPI_Allreduce(&owned, &all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all, count, 0, "number of nodes");
  PetscCall(PetscFree(nodes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_cells(Fixture *x, const char *a, const char *b, PetscReal volume)
{
  PetscInt n, *cells;
  PetscReal sum = 0;
  PetscReal all;

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(x->space, on_sets(a, b), SB_ON_CELLS, &n, &cells));
  for (PetscInt i = 0; i < n; i++)
    if (cells[i] < x->mesh->ncell_owned)
      sum += SbTetDeterminant(x->mesh->x, x->mesh->cell + 4 * cells[i]) / 6;
  PetscCallMPI(MPI_Allreduce(&sum, &all, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all, volume, 1e-13, "volume of the cells");
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_errors(Fixture *x)
{
  SbFacet *facets;
  PetscInt n, *items;

  PetscFunctionBeginUser;

  // One vertex, no facet, no cell: the message names set and counts.
  SB_CHECK_ERROR(SbEffectFacets(x->space, on_sets("bottom", "corner"), &n, &facets),
                 PETSC_ERR_USER_INPUT, "1 vertices|0");
  SB_CHECK_ERROR(SbEffectItems(x->space, on_sets("bottom", "corner"), SB_ON_CELLS, &n, &items),
                 PETSC_ERR_USER_INPUT, "-effect_test_on|set bottom");
  SB_CHECK_ERROR(SbEffectItems(x->space, on_sets("botom", NULL), SB_ON_NODES, &n, &items),
                 PETSC_ERR_USER, "bottom");
  SB_CHECK_ERROR(SbEffectItems(x->space, on_sets(NULL, NULL), SB_ON_NODES, &n, &items),
                 PETSC_ERR_USER_INPUT, "-effect_test_on");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets and cells are independent of the element; the nodes of CR and DG are at faces. */
static PetscErrorCode check_faces(const char *element, PetscInt all, PetscInt bottom)
{
  Fixture x;
  PetscInt n, *items;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:4", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(check_facets(&x, "all", "west", 6, 192));
  PetscCall(check_cells(&x, "lower", "all", 1));
  PetscCall(check_nodes(&x, "bottom", NULL, bottom));
  PetscCall(check_nodes(&x, "bottom", "west", 2 * bottom));
  PetscCall(check_nodes(&x, "west", "bottom", 2 * bottom));
  PetscCall(check_nodes(&x, "all", "corner", all));
  PetscCall(check_errors(&x));
  SB_CHECK_ERROR(SbEffectItems(x.space, on_sets("corner", NULL), SB_ON_NODES, &n, &items),
                 PETSC_ERR_USER_INPUT, "-effect_test_on|1 vertices|body block");
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
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:4", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
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
