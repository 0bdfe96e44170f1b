// The mesher of re-meshing: results independent of the last bits, surface vertices first, exact
// positions where rounded ones cannot be meshed. @ranks 1
#include "../test.h"
#include "../../src/remesh/remesh_impl.h"

#define N 4 /* squares along an edge of the box */
#define NVERT (6 * N * N + 2)
#define NTRI (12 * N * N)

/* Number of a lattice point on the surface, -1 in the interior. */
static PetscInt number_of(const PetscInt at[3])
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < (N + 1) * (N + 1) * (N + 1); i++) {
    const PetscInt p[3] = {i % (N + 1), i / (N + 1) % (N + 1), i / ((N + 1) * (N + 1))};
    PetscBool outer = PETSC_FALSE;

    for (int k = 0; k < 3; k++)
      outer = (PetscBool)(outer || p[k] == 0 || p[k] == N);
    if (p[0] == at[0] && p[1] == at[1] && p[2] == at[2])
      return outer ? n : -1;
    n += outer;
  }
  return -1;
}

/* A box whose sides have N x N squares of two triangles; vertices are moved by up to twice
   `bits`. */
static PetscErrorCode make_hull(const PetscReal size[3], PetscReal bits, SbSurface *hull)
{
  PetscInt at[3];
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbSurfaceCreate(NVERT, NTRI, 1, hull));
  for (at[2] = 0; at[2] <= N; at[2]++) {
    for (at[1] = 0; at[1] <= N; at[1]++) {
      for (at[0] = 0; at[0] <= N; at[0]++) {
        const PetscInt v = number_of(at);

        for (int k = 0; k < 3 && v >= 0; k++)
          hull->x[3 * v + k] =
            size[k] * (PetscReal)at[k] / N + bits * (PetscReal)((7 * (3 * v + k)) % 5 - 2);
      }
    }
  }
  for (int side = 0; side < 6; side++) {
    for (PetscInt square = 0; square < N * N; square++) {
      const int d = side % 3;
      const int a = (d + 1) % 3;
      const int b = (d + 2) % 3;
      PetscInt v[4];

      for (int k = 0; k < 4; k++) {
        at[d] = side < 3 ? 0 : N;
        at[a] = square % N + (k == 1 || k == 2);
        at[b] = square / N + (k > 1);
        v[side < 3 ? 3 - k : k] = number_of(at);
      }
      for (int k = 0; k < 6; k++)
        hull->tri[3 * n + k] = v[k < 3 ? k : k == 3 ? 0 : k - 2];
      n += 2;
    }
  }
  for (int t = 0; t < NTRI; t++) {
    hull->side[2 * t] = -1;
    hull->side[2 * t + 1] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fill(const PetscReal size[3], PetscReal bits, PetscReal *volume, SbTets *tets)
{
  SbSurface hull;

  PetscFunctionBeginUser;
  PetscCall(make_hull(size, bits, &hull));
  PetscCall(SbMesherDefault("the test's hull", &hull, 0.6 / N, NULL, tets));
  *volume = 0.;
  for (PetscInt c = 0; c < tets->ncell; c++) {
    const PetscReal six = SbTetDeterminant(tets->x, tets->cell + 4 * c);

    SB_CHECK(six > 0., "tet %d is inverted", (int)c);
    *volume += six / 6.;
  }
  for (int i = 0; i < 3 * NVERT; i++)
    SB_CHECK(PetscAbsReal(tets->x[i] - hull.x[i]) < 1e-3, "coordinate %d of the hull is %g, was %g",
             i, tets->x[i], hull.x[i]);
  PetscCall(SbSurfaceDestroy(&hull));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode free_tets(SbTets *tets)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(tets->x));
  PetscCall(PetscFree(tets->cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_same(void)
{
  const PetscReal size[3] = {1., 1.1, 0.9};
  PetscReal volume[2];
  SbTets a, b;

  PetscFunctionBeginUser;
  PetscCall(fill(size, 0., &volume[0], &a));
  PetscCall(fill(size, 1e-12, &volume[1], &b));
  SB_CHECK(a.ncell > NTRI && a.nvert > NVERT, "%d tets, %d vertices", (int)a.ncell, (int)a.nvert);
  SB_CHECK(a.nvert == b.nvert && a.ncell == b.ncell &&
             !memcmp(a.cell, b.cell, 4 * (size_t)a.ncell * sizeof(*a.cell)) &&
             !memcmp(a.x, b.x, 3 * (size_t)a.nvert * sizeof(*a.x)),
           "%d tets, and %d of a surface with other last bits", (int)a.ncell, (int)b.ncell);
  SB_CHECK_NEAR(volume[0], 0.99, 3e-3, "volume of the rounded box");
  PetscCall(free_tets(&a));
  PetscCall(free_tets(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Thinner than the rounding unit: after rounding it has no volume. */
static PetscErrorCode check_thin(void)
{
  const PetscReal size[3] = {1., 1., 2e-4};
  PetscReal volume;
  SbTets tets;

  PetscFunctionBeginUser;
  PetscCall(fill(size, 0., &volume, &tets));
  SB_CHECK_NEAR(volume, 2e-4, 1e-12, "volume of a thin box");
  PetscCall(free_tets(&tets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesher that adds a vertex in the middle of a tet. */
static PetscErrorCode divide(const char *where, const SbSurface *hull, PetscReal size, void *ctx,
                             SbTets *tets)
{
  PetscFunctionBeginUser;
  (void)where, (void)size;
  *tets = (SbTets){.nvert = 5, .ncell = 4};
  PetscCall(PetscMalloc1(15, &tets->x));
  PetscCall(PetscMalloc1(16, &tets->cell));
  PetscCall(PetscArraycpy(tets->x, hull->x, 12));
  for (int k = 0; k < 3; k++)
    tets->x[12 + k] = 0.25;
  for (int i = 0; i < 16; i++)
    tets->cell[i] = i % 5 ? ((const PetscInt *)ctx)[i % 4] : 4;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A tet that is inverted at rest holds no place: an error, no use of the tet -1, whose vertices
   are far outside of all arrays here. */
static PetscErrorCode check_no_place(void)
{
  const PetscReal now[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const PetscReal rest[12] = {0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0, 1};
  const PetscInt far = PETSC_MAX_INT / 4;
  PetscInt cells[8] = {far, far, far, far, 0, 1, 2, 3};
  PetscInt region = 0;
  SbOldMesh old = {
    .nvert = 4, .ncell = 1, .X = rest, .x = now, .cell = cells + 4, .region = &region};
  SbRemeshing how = {.mesher = divide, .ctx = cells + 4, .size = 1, .quality = 0.1};
  SbNewMesh mesh;

  PetscFunctionBeginUser;
  PetscCall(SbFacesCreate(4, 1, old.cell, &old.faces));
  PetscCall(SbLocatorCreate(1, old.cell, rest, NULL, &old.rest));
  SB_CHECK_ERROR(SbRemeshBody("a tet", &old, &how, &mesh), PETSC_ERR_USER_INPUT, "volume");
  PetscCall(SbLocatorDestroy(&old.rest));
  PetscCall(SbFacesDestroy(&old.faces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_same());
  PetscCall(check_thin());
  PetscCall(check_no_place());
  SB_TEST_END();
}
