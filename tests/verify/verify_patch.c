// @ranks 1 2
/*
  Patch test (MacNeal and Harder, "A proposed standard set of problems to test finite element
  accuracy", 1985): if the boundary displacements or tractions of a body are those of a homogeneous
  deformation x = F X, the interior must have it too, on any mesh. Small strains with the
  displacement of that paper, and a large strain with every material: the stress is compared with
  the formula of the material, implemented here independently. The linear system is solved directly.
  The same for P2, CR and DG: boundary nodes are prescribed or loaded, and the interior ones, with
  all jumps, must follow.

  Tolerances: displacements 1e-10 of the largest; 1e-9 with CR and DG at nu = 0.4999, because of the
  condition number. Stresses 1e-9 of the largest times the condition number of the material:
  rounding of the strain is multiplied by lambda / mu.
*/
#include "../laws.h"
#include "verify.h"

typedef enum {
  REGULAR,
  DISTORTED,
  SLIVERS
} Shape;
static const char *const shapes[] = {"regular", "distorted", "slivers"};
static const char *laws[SB_MATERIAL_TYPES]; /* of the registry */
static PetscInt nlaw;

typedef struct {
  Shape shape;
  PetscRandom random;
} MeshContext;

/*
  Interior vertices of the unit cube: moved at random by up to 0.3 cells; or a line of them moved to
  within a thousandth of the plane of faces, which leaves flat tets.
*/
static void move_vertex(const VerifyPlace *place, PetscReal x[3])
{
  const MeshContext *m = (const MeshContext *)place->ctx;
  PetscReal r[3];

  for (int k = 0; k < 3; k++)
    (void)PetscRandomGetValueReal(m->random, &r[k]);
  for (int k = 0; k < 3; k++)
    if (place->at[k] == 0 || place->at[k] == place->n[k])
      return;
  if (m->shape == DISTORTED) {
    for (int k = 0; k < 3; k++)
      x[k] += (0.6 * r[k] - 0.3) / (PetscReal)place->n[k];
  } else if (m->shape == SLIVERS && place->at[0] == 3 && place->at[1] == 2 && place->at[2] > 1 &&
             place->at[2] < place->n[2] - 1) {
    const PetscReal part = 0.499 * (1. - 0.002 * r[0]);

    x[0] -= part / (PetscReal)place->n[0];
    x[1] += part / (PetscReal)place->n[1];
  }
}

static PetscErrorCode write_mesh(Shape shape, PetscInt cells, char path[512])
{
  const PetscInt n[3] = {cells, cells, cells};
  MeshContext m = {.shape = shape};

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &m.random));
  PetscCall(PetscRandomSetSeed(m.random, 20));
  PetscCall(PetscRandomSeed(m.random));
  PetscCall(verify_mesh_write(n, move_vertex, &m, path));
  PetscCall(PetscRandomDestroy(&m.random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C = A^T B if transposed, else A B. */
static void product(const PetscReal A[9], PetscBool transposed, const PetscReal B[9],
                    PetscReal C[9])
{
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      C[3 * i + j] = 0.;
      for (int k = 0; k < 3; k++)
        C[3 * i + j] += (transposed ? A[3 * k + i] : A[3 * i + k]) * B[3 * k + j];
    }
  }
}

/* Cofactor, J F^-T; returns J. */
static PetscReal cofactor(const PetscReal F[9], PetscReal c[9])
{
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      const int i1 = (i + 1) % 3;
      const int i2 = (i + 2) % 3;
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;

      c[3 * i + j] = F[3 * i1 + j1] * F[3 * i2 + j2] - F[3 * i1 + j2] * F[3 * i2 + j1];
    }
  }
  return F[0] * c[0] + F[1] * c[1] + F[2] * c[2];
}

/* First Piola-Kirchhoff stress by the formulas of linear, corotated, stvk, neohookean and
   stable_neohookean. */
static void exact_stress(const char *law, PetscReal E, PetscReal nu, const PetscReal F[9],
                         PetscReal P[9])
{
  const PetscReal mu = E / (2. * (1. + nu));
  const PetscReal lambda = E * nu / ((1. + nu) * (1. - 2. * nu));
  PetscReal S[9], R[9], C[9];
  PetscReal trace = 0.;
  PetscReal I1 = 0.;

  for (int k = 0; k < 9; k++)
    R[k] = F[k];
  if (!strcmp(law, "stable_neohookean")) {
    const PetscReal a = 4. * mu / 3.;
    const PetscReal b = lambda + 5. * mu / 6.;
    const PetscReal J = cofactor(F, C);

    for (int k = 0; k < 9; k++)
      I1 += F[k] * F[k];
    for (int k = 0; k < 9; k++)
      P[k] = a * (1. - 1. / (I1 + 1.)) * F[k] + (b * (J - 1.) - 0.75 * a) * C[k];
    return;
  }

  if (!strcmp(law, "neohookean")) {
    const PetscReal J = cofactor(F, C);

    for (int k = 0; k < 9; k++)
      P[k] = mu * F[k] + (lambda * PetscLogReal(J) - mu) * C[k] / J;
    return;
  }

  /* polar rotation as the mean of a matrix and its inverse transpose (Higham 1986) */
  for (int i = 0; i < 30 && !strcmp(law, "corotated"); i++) {
    const PetscReal J = cofactor(R, C);

    for (int k = 0; k < 9; k++)
      R[k] = 0.5 * (R[k] + C[k] / J);
  }
  if (!strcmp(law, "linear")) {
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) {
        R[3 * i + j] = i == j;
        S[3 * i + j] = 0.5 * (F[3 * i + j] + F[3 * j + i]) - (i == j);
      }
    }
  } else if (!strcmp(law, "corotated")) {
    product(R, PETSC_TRUE, F, S);
    for (int k = 0; k < 9; k += 4)
      S[k] -= 1.;
  } else {
    product(F, PETSC_TRUE, F, S);
    for (int k = 0; k < 9; k++)
      S[k] = 0.5 * (S[k] - (k % 4 == 0));
  }
  trace = S[0] + S[4] + S[8];
  for (int k = 0; k < 9; k++)
    S[k] = 2. * mu * S[k] + (k % 4 == 0) * lambda * trace;
  product(R, PETSC_FALSE, S, P);
}

/* The same by the operation of the law, for one without a formula above; it is the derivative of
   the energy (tests/unit/test_material_laws.c). */
static PetscErrorCode own_stress(const char *law, PetscReal E, PetscReal nu, const PetscReal F[9],
                                 PetscReal P[9])
{
  SbPack f[9], p[9];
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(law_create(law, E, nu, 1., &m));
  for (int l = 0; l < SB_BATCH; l++)
    SbPackPut(9, F, l, f);
  m->ops.stress(m, (const SbPack *)f, p);
  SbPackGet(9, (const SbPack *)p, 0, P);
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Small-strain stress of the linear material, Cauchy stress P F^T / J of the others; in the order
   of SbSpaceCellState(). */
static void exact_cauchy(const char *law, const PetscReal F[9], const PetscReal P[9],
                         PetscReal sigma[6])
{
  static const int row[6] = {0, 1, 2, 0, 1, 0};
  static const int column[6] = {0, 1, 2, 1, 2, 2};
  PetscReal C[9];
  const PetscReal J = cofactor(F, C);

  for (int k = 0; k < 6; k++) {
    sigma[k] = 0.;
    for (int j = 0; j < 3; j++)
      sigma[k] += P[3 * row[k] + j] * F[3 * column[k] + j] / J;
    if (!strcmp(law, "linear"))
      sigma[k] = P[3 * row[k] + column[k]];
  }
}

/* Largest error of displacements and of stresses, each relative to the largest exact value. */
static PetscErrorCode errors(TestScene *t, const PetscReal F[9], const PetscReal sigma[6],
                             PetscReal error[2])
{
  SbSpace s = t->model->space;
  const PetscReal *u;
  PetscReal *cell;
  PetscReal size[2] = {0., 0.};

  PetscFunctionBeginUser;
  error[0] = error[1] = 0.;
  PetscCall(PetscMalloc1(6 * s->mesh->ncell_owned, &cell));
  PetscCall(SbSpaceGetLocalRead(s, t->run->state.U, &u));
  SbSpaceCellState(s, u, cell, NULL, NULL, NULL);
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal x[3];

    verify_apply(F, s->node_x + 3 * i, x);
    for (int k = 0; k < 3; k++) {
      const PetscReal exact = x[k] - s->node_x[3 * i + k];

      error[0] = PetscMax(error[0], PetscAbsReal(u[3 * i + k] - exact));
      size[0] = PetscMax(size[0], PetscAbsReal(exact));
    }
  }
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    for (int k = 0; k < 6; k++) {
      error[1] = PetscMax(error[1], PetscAbsReal(cell[6 * c + k] - sigma[k]));
      size[1] = PetscMax(size[1], PetscAbsReal(sigma[k]));
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->state.U, &u));
  PetscCall(PetscFree(cell));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, error, 2, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, size, 2, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  for (int k = 0; k < 2; k++)
    error[k] /= size[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prescribed displacement of the boundary, or of x = 0 only with the traction P N on the other five
   sides. */
static PetscErrorCode load_options(PetscBool pulled, const PetscReal F[9], const PetscReal P[9],
                                   char text[], size_t size)
{
  char more[512];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    text, size,
    " -effect_move_type prescribed_displacement -effect_move_on %s -effect_move_displacement "
    "(%.17g)*x+(%.17g)*y+(%.17g)*z;(%.17g)*x+(%.17g)*y+(%.17g)*z;(%.17g)*x+(%.17g)*y+(%.17g)*z",
    pulled ? "side0" : "boundary", F[0] - 1., F[1], F[2], F[3], F[4] - 1., F[5], F[6], F[7],
    F[8] - 1.));
  PetscCall(PetscStrlcat(
    text, pulled ? " -effects move,pull1,pull2,pull3,pull4,pull5" : " -effects move", size));
  PetscCall(PetscStrlcat(
    text, pulled ? " -sets side0,side1,side2,side3,side4,side5" : " -sets side0", size));
  for (int side = 0; side < (pulled ? 6 : 1); side++) {
    const int d = side / 2;

    PetscCall(PetscSNPrintf(more, sizeof(more), " -set_side%d_at plane:%d,%d,%d,%d", side, d == 0,
                            d == 1, d == 2, side % 2));
    PetscCall(PetscStrlcat(text, more, size));
    if (!side)
      continue;
    PetscCall(PetscSNPrintf(more, sizeof(more),
                            " -effect_pull%d_type traction -effect_pull%d_on side%d "
                            "-effect_pull%d_vector %.17g;%.17g;%.17g",
                            side, side, side, side, P[d] * (side % 2 ? 1. : -1.),
                            P[3 + d] * (side % 2 ? 1. : -1.), P[6 + d] * (side % 2 ? 1. : -1.)));
    PetscCall(PetscStrlcat(text, more, size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mesh and the element that is tested on it. */
typedef struct {
  Shape shape;
  const char *element;
  char path[512];
} Patch;

/* known: normal and shear stress of the paper; NULL: not checked. */
static PetscErrorCode check_patch(const Patch *p, const char *law, PetscReal nu, PetscBool pulled,
                                  const PetscReal F[9], const PetscReal known[2])
{
  static const char *const with_formula[] = {"linear", "corotated", "stvk", "neohookean",
                                             "stable_neohookean"};
  const PetscReal E = 1e6;
  const PetscReal stiff = PetscMax(1., nu / (1. - 2. * nu));
  TestScene t;
  PetscReal P[9], sigma[6], error[2];
  PetscBool formula = PETSC_FALSE;
  char loads[VERIFY_TEXT];

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(with_formula); i++)
    formula = (PetscBool)(formula || !strcmp(law, with_formula[i]));
  if (formula)
    exact_stress(law, E, nu, F, P);
  else
    PetscCall(own_stress(law, E, nu, F, P));
  exact_cauchy(law, F, P, sigma);
  for (int k = 0; k < 6 && known; k++)
    SB_CHECK_NEAR(sigma[k], k < 3 ? known[0] : known[1], 1e-9 * known[0], "stress of the paper");
  PetscCall(load_options(pulled, F, P, loads, sizeof(loads)));
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material %s "
    "-body_a_young %g -body_a_poisson %g "
    "-body_a_density 1 -time static -ksp_rtol 1e-13 -snes_rtol 1e-13 -snes_atol "
    "0 -snes_stol 1e-13 %s %s %s %s",
    p->path, p->element, law, E, nu, SbMaterialFind(law)->ops.spin ? "-body_a_tangent exact" : "",
    !strcmp(p->element, "p1") ? "" : "-solver direct", law_moduli(law, "a", E, nu), loads));
  PetscCall(verify_solve(&t, law));
  PetscCall(errors(&t, F, sigma, error));
  test_print(
    "  %s %-10s %-10s nu %-6g %-9s smallest angle %7.3f deg: u %.1e, stress %.1e, Newton %d\n",
    p->element, shapes[p->shape], law, nu, pulled ? "tractions" : "moved",
    t.model->body[0].min_dihedral, error[0], error[1], (int)t.run->counters.newton);
  SB_CHECK(error[0] <= (nu > 0.4 && strcmp(p->element, "p1") ? 1e-9 : 1e-10),
           "%s, %s, %s, nu %g: displacement off by %g", p->element, shapes[p->shape], law, nu,
           error[0]);
  SB_CHECK(error[1] <= 1e-9 * stiff, "%s, %s, %s, nu %g: stress off by %g", p->element,
           shapes[p->shape], law, nu, error[1]);
  if (p->shape == SLIVERS) {
    SB_CHECK(t.model->body[0].min_dihedral > 0.05 && t.model->body[0].min_dihedral < 1.,
             "smallest dihedral angle of the mesh of slivers is %g degrees",
             t.model->body[0].min_dihedral);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All checks of an element on one mesh. */
static PetscErrorCode check_mesh(const Patch *p)
{
  const PetscReal small[9] = {1. + 1e-3, 5e-4, 5e-4, 5e-4, 1. + 1e-3, 5e-4, 5e-4, 5e-4, 1. + 1e-3};

  /* a stretch by a quarter with shear and rotation, nearly isochoric */
  const PetscReal large[9] = {1.25, 0.1, 0.05, -0.2, 0.9, 0.1, 0.1, -0.15, 0.9};

  /* CR and DG with nonlinear materials are unstable under pressures above their shear modulus:
     isochoric */
  const PetscReal even[9] = {1. + 2e-3, 5e-4, 5e-4, 5e-4, 1. - 1e-3, 5e-4, 5e-4, 5e-4, 1. - 1e-3};
  const PetscReal paper[2] = {2000., 400.};

  PetscFunctionBeginUser;
  for (int pulled = 0; pulled < 2; pulled++) {
    PetscCall(check_patch(p, "linear", 0.25, (PetscBool)pulled, small, paper));
    PetscCall(check_patch(p, "linear", 0.4999, (PetscBool)pulled, small, NULL));
  }

  /* the materials need many solves, and the mesh of slivers is the largest */
  for (PetscInt law = 0; law < nlaw; law++) {
    const PetscBool linear = (PetscBool)!strcmp(laws[law], "linear");

    if (p->shape == SLIVERS && strcmp(p->element, "p1") && !linear)
      continue;
    PetscCall(check_patch(p, laws[law], 0.25, PETSC_FALSE, large, NULL));

    /* flat tets of nearly incompressible material: hundreds of Newton steps are needed, for the
       same digits */
    if ((p->shape == SLIVERS && !linear) || law_is_compressible(laws[law]))
      continue;
    PetscCall(check_patch(p, laws[law], 0.4999, PETSC_FALSE,
                          strcmp(p->element, "p1") ? even : large, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  Patch p;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbRegisterAll());
  nlaw = SbMaterialTypes(laws);
  for (p.shape = REGULAR; p.shape <= SLIVERS; p.shape++) {
    PetscCall(write_mesh(p.shape, p.shape == SLIVERS ? 5 : 3, p.path));
    for (int e = 0; e < 4; e++) {
      /* other elements: one mesh without slivers is enough */
      if (e > 0 && p.shape == REGULAR)
        continue;
      p.element = elements[e];
      PetscCall(check_mesh(&p));
    }
  }
  SB_TEST_END();
}
