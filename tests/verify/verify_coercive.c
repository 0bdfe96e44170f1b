// @ranks 1
/*
  Positive semi-definiteness of the stiffness of CR, DG and P2 for all meshes, Poisson ratios and
  penalties. All eigenvalues of D^-1/2 K D^-1/2, D the diagonal of K, of free bodies on small meshes
  by LAPACK: exactly six are zero, the rigid modes, none is negative. The scaling removes mesh size:
  the largest eigenvalue is between 1 and the number of entries of a row.

    meshes    random perturbations of vertices; size ratios of tets of 1000 to 1; tets with angles
    of 0.06 degrees gammas    CR and DG with default penalties, and DG with both gammas at 0.01:
    positive for every positive gamma state     at rest, where all materials are linear elastic, and
    rotated by two rad, where K is the rotated one at rest
    pressed   nu = 0.499, uniformly compressed or stretched to a pressure of half the shear modulus,
    with fixed boundary: still
              positive. Face terms are as stiff as the shear modulus, so that CR and DG are unstable
              at a larger pressure where the solid is stable, as neo-Hookean P2; the limits are
              printed
    not so    with gamma1 = 1e-12 CR has many zero-energy modes (Falk 1991): the test detects them

  Rounding: matrix entries are accurate to 1e-15 of the largest one, so eigenvalues to about 1e-14
  of the largest one.
*/
#include "verify.h"

#include <petscblaslapack.h>

#define ROUNDING 1e-13

typedef enum {
  MOVED,
  GRADED,
  SLIVERS
} Shape;
static const char *const shapes[] = {"moved", "graded", "slivers"};

typedef struct {
  Shape shape;
  PetscRandom random;
} MeshContext;

static void place_vertex(const VerifyPlace *place, PetscReal x[3])
{
  const MeshContext *m = (const MeshContext *)place->ctx;
  PetscReal r[3];

  for (int k = 0; k < 3; k++)
    (void)PetscRandomGetValueReal(m->random, &r[k]);
  if (m->shape == MOVED) {
    for (int k = 0; k < 3; k++)
      x[k] += (0.5 * r[k] - 0.25) / (PetscReal)place->n[k];
  } else if (m->shape == GRADED) {
    /* a cone truncated at a thousandth of its length */
    const PetscReal size = PetscPowReal(10., 3. * (x[0] - 1.));

    x[0] = size;
    x[1] *= size * (1. + 0.1 * r[1]);
    x[2] *= size * (1. + 0.1 * r[2]);
  } else if (place->at[0] == 1 && place->at[1] == 0) {
    /* a line of vertices moved to within a thousandth of the plane of faces */
    const PetscReal part = 0.499 * (1. - 0.002 * r[0]);

    x[0] -= part / (PetscReal)place->n[0];
    x[1] += part / (PetscReal)place->n[1];
  }
}

/* Eigenvalues of the scaled tangent, ascending; the caller frees them. */
static PetscErrorCode spectrum(TestScene *t, PetscInt *count, PetscReal **w)
{
  PetscBLASInt n, lwork, info;
  PetscScalar *a, *work;
  PetscReal *d;
  Mat K, dense;

  PetscFunctionBeginUser;
  *count = 3 * t->model->space->Nnode;
  PetscCall(PetscBLASIntCast(*count, &n));
  PetscCall(PetscBLASIntCast(40 * *count, &lwork));
  PetscCall(SbSpaceCreateMatrix(t->model->space, SB_MATRIX_AIJ, &K));
  PetscCall(SbModelTangent(t->model, 0., 0., 0., 1., t->run->state.U, NULL, K));
  PetscCall(MatConvert(K, MATDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(PetscMalloc1(*count, w));
  PetscCall(PetscMalloc2(*count, &d, lwork, &work));
  PetscCall(MatDenseGetArray(dense, &a));

  /* a negative diagonal entry keeps its sign, and so does the lowest eigenvalue */
  for (PetscInt i = 0; i < *count; i++)
    d[i] = PetscSqrtReal(PetscAbsReal(a[i + *count * i]));
  for (PetscInt i = 0; i < *count * *count; i++)
    a[i] /= d[i % *count] * d[i / *count];
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("N", "U", &n, a, &n, *w, work, &lwork, &info));
  SB_CHECK(info == 0, "LAPACK: %d", (int)info);
  PetscCall(MatDenseRestoreArray(dense, &a));
  PetscCall(PetscFree2(d, work));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  const char *element, *law, *gammas;
  PetscReal nu, angle;
} Case;

/* Zero eigenvalues are those at the level of rounding; spurious modes add more of them, or hardly
   stiffer ones. */
static PetscErrorCode check_case(Shape shape, const char *path, const Case *c, PetscBool sound)
{
  TestScene t;
  PetscInt n;
  PetscInt zeros = 0;
  PetscInt soft = 0;
  PetscReal *w;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material %s "
              "-body_a_young 1e5 -body_a_poisson %.17g -body_a_density 1 -solver cg_jacobi %s",
              path, c->element, c->law, c->nu, c->gammas));
  PetscCall(
    verify_turn(&t, (const PetscReal[3]){1., 2., 3.}, c->angle, (const PetscReal[3]){0., 0., 0.}));
  PetscCall(spectrum(&t, &n, &w));
  for (PetscInt i = 0; i < n; i++) {
    zeros += w[i] <= ROUNDING * w[n - 1];
    soft += w[i] <= 1e-9 * w[n - 1];
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  %s %-10s %-7s nu %-8g %s: %4d unknowns, eigenvalues %9.1e .. %8.1e | "
                        "%.3e .. %.2f, %d zero\n",
                        c->element, c->law, shapes[shape], c->nu, c->gammas, (int)n, w[0], w[5],
                        w[6], w[n - 1], (int)zeros));
  if (shape == SLIVERS)
    SB_CHECK(t.model->body[0].min_dihedral < 1., "the flattest tet has %g degrees",
             t.model->body[0].min_dihedral);
  if (sound) {
    SB_CHECK(w[0] > -ROUNDING * w[n - 1], "%s, %s, nu %g %s: eigenvalue %g", c->element,
             shapes[shape], c->nu, c->gammas, w[0]);
    SB_CHECK(zeros == 6, "%s, %s, nu %g %s: %d motions without energy", c->element, shapes[shape],
             c->nu, c->gammas, (int)zeros);
  } else {
    SB_CHECK(soft > 30, "%s, %s %s: %d soft motions, which the test should see", c->element,
             shapes[shape], c->gammas, (int)soft);
  }
  PetscCall(PetscFree(w));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smallest eigenvalue, relative to the largest, of a cube under a uniform pressure of `ratio` times
   mu. */
static PetscErrorCode pressed(const char *element, const char *law, PetscReal ratio,
                              PetscReal *smallest)
{
  TestScene t;
  PetscInt n;
  SbMaterial m;
  PetscReal *w, eps;
  PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:1,1,1:2 -body_a_element %s -body_a_material %s "
              "-body_a_tangent exact -body_a_young 1e5 -body_a_poisson 0.499 -body_a_density 1 "
              "-solver cg_jacobi -effects hold -effect_hold_type fixed -effect_hold_on boundary",
              element, law));
  m = t.model->material[0];
  eps = ratio * SbMaterialShearModulus(m) / (3. * SbMaterialBulkModulus(m));
  PetscCall(VecGetArray(t.run->state.U, &u));
  for (PetscInt i = 0; i < 3 * t.model->space->nnode_owned; i++)
    u[i] = -eps * t.model->space->node_x[i];
  PetscCall(VecRestoreArray(t.run->state.U, &u));
  PetscCall(SbSpaceFollowJumps(t.model->space, t.run->state.U, NULL, SB_STEPS_OF_LOAD, 0., NULL));
  PetscCall(spectrum(&t, &n, &w));
  *smallest = w[0] / w[n - 1];
  PetscCall(PetscFree(w));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_pressed(const char *element, const char *law)
{
  static const PetscReal ratios[] = {0.5, 1., 2., 5., 10., 50.};
  PetscReal smallest = 0.;
  PetscReal reached[2] = {0., 0.};

  PetscFunctionBeginUser;
  for (int stretched = 0; stretched < 2; stretched++) {
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(ratios); k++) {
      PetscCall(pressed(element, law, stretched ? -ratios[k] : ratios[k], &smallest));
      if (smallest <= 0.)
        break;
      reached[stretched] = ratios[k];
    }
  }
  test_print("  %s %-10s squeezed: positive up to %g mu; stretched: up to %g mu\n", element, law,
             reached[0], reached[1]);

  /* the energy of the mean volume, summed over the body, is that of its boundary */
  if (!strcmp(element, "p2") && !strcmp(law, "stable_neohookean"))
    SB_CHECK(reached[0] == 50. && reached[1] == 50., "P2 is not stable under even pressures");

  /* the jump penalty adapts to the pressure */
  if ((!strcmp(element, "cr") || !strcmp(element, "dg")) && !strcmp(law, "stable_neohookean"))
    SB_CHECK(reached[0] == 50., "%s is not stable under even pressures", element);
  SB_CHECK(reached[0] >= 0.5 && reached[1] >= 0.5,
           "%s, %s: not stable under a pressure of half the shear modulus", element, law);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_mesh(Shape shape)
{
  static const PetscReal nus[] = {0.3, 0.4999, 0.499999};
  static const char *const laws[] = {"corotated -body_a_tangent warped",
                                     "corotated -body_a_tangent exact", "stvk",
                                     "stable_neohookean"};
  static const PetscInt cells[][3] = {{2, 2, 2}, {6, 1, 1}, {2, 2, 2}};
  static const char *const little = "-body_a_gamma0 0.01 -body_a_gamma1 0.01";
  MeshContext m = {.shape = shape};
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &m.random));
  PetscCall(PetscRandomSetSeed(m.random, 7));
  PetscCall(PetscRandomSeed(m.random));
  PetscCall(verify_mesh_write(cells[shape], place_vertex, &m, path));
  PetscCall(PetscRandomDestroy(&m.random));
  for (int k = 0; k < 3; k++) {
    PetscCall(check_case(shape, path, &(Case){"cr", "linear", "", nus[k], 0.}, PETSC_TRUE));
    PetscCall(check_case(shape, path, &(Case){"dg", "linear", "", nus[k], 0.}, PETSC_TRUE));
    PetscCall(check_case(shape, path, &(Case){"p2", "linear", "", nus[k], 0.}, PETSC_TRUE));
  }
  PetscCall(check_case(shape, path, &(Case){"dg", "linear", little, 0.3, 0.}, PETSC_TRUE));
  PetscCall(
    check_case(shape, path, &(Case){"cr", "linear", "-body_a_gamma1 1e-12", 0.3, 0.}, PETSC_FALSE));
  PetscCall(
    check_case(shape, path, &(Case){"dg", "linear", "-body_a_gamma1 1e-12", 0.3, 0.}, PETSC_FALSE));
  for (int law = 0; law < 4 && shape == MOVED; law++) {
    PetscCall(check_case(shape, path, &(Case){"cr", laws[law], "", 0.4999, 2.}, PETSC_TRUE));
    PetscCall(check_case(shape, path, &(Case){"dg", laws[law], "", 0.4999, 2.}, PETSC_TRUE));
    PetscCall(check_case(shape, path, &(Case){"p2", laws[law], "", 0.4999, 2.}, PETSC_TRUE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  for (Shape shape = MOVED; shape <= SLIVERS; shape++)
    PetscCall(check_mesh(shape));
  for (int e = 0; e < 4; e++) {
    static const char *const elements[] = {"p1", "cr", "dg", "p2"};

    PetscCall(check_pressed(elements[e], "corotated"));
    PetscCall(check_pressed(elements[e], "stvk"));
    PetscCall(check_pressed(elements[e], "stable_neohookean"));
  }
  SB_TEST_END();
}
