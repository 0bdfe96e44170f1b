// @ranks 1 2
/*
  Inflation of a thick sphere and a thick cylinder (plane strain), radii A = 1 and B = 2, by a
  follower pressure on the inner wall, to 1.5 times its radius: CR and DG, both neo-Hookean
  materials, and P2 for the sphere of the classical one, mu = 1, nu = 0.499, between symmetry
  planes. The pressure acts on part of the surface,
  whose facets are discontinuous at their edges.

  Without change of volume the hoop stretch decreases from la = a/A inside to lb, lb^k = 1 + (la^k -
  1) (A/B)^k, and radial equilibrium gives

    p = int_lb^la dW/dl / (l^k - 1) dl,   k = 3 for the sphere, 2 for the cylinder, W(l) the energy
    at that stretch.

  W = mu/2 (I1 - 3) gives mu/2 [(4/lb + lb^-4) - (4/la + la^-4)] for the sphere, mu [ln(la/lb) +
  (lb^-2 - la^-2)/2] for the cylinder. This is `neohookean`; `stable_neohookean` has

    W = 2/3 mu [(I1 - 3) - log((I1 + 1)/4)],   dW/dI1 = 2/3 mu I1/(I1 + 1):

  mu/2 at rest, and up to a third stiffer when stretched. At the pressure that inflates the
  classical sphere by 0.500 it is inflated by 0.447. The quadrature is checked with the classical
  energy.

    pressure   of the closed form at the computed stretch, against the applied one: four layers of
               tets through the wall, all of the same thickness, give 0.7 % and eight 0.06 %. A
               facet of CR has the area at the centre of its tet, h/4 behind the wall, where the
               hoop stretch is less: forces of a follower pressure from these areas would be off by
               16 and 10 %
    iterations are bounded, with CHOLMOD, which fails if the tangent is indefinite, and with MUMPS,
               which only counts negative pivots
    order      the error of a perturbed solution is squared by one iteration of Newton's method

  Beyond the largest pressure of the closed form there is no equilibrium on the path, but there are
  others: the inner wall may go through the centre. A run to 1.3 times that pressure, in one load
  step and in several, ends at the limit with an error, and what it has reached is inflated.
*/
#include "verify.h"

#define NU 0.499
#define STRETCH 1.5
#define WALLS "-set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -set_z0_at plane:0,0,1,0 "

/* (dW/dl) / (l^k - 1) by dW/dI1 with mu = 1; I1 - 3 >= 0 has a double zero at l = 1. */
static PetscReal integrand(PetscInt k, PetscBool classical, PetscReal l)
{
  const PetscReal I1 = k == 3 ? 2. * l * l + PetscPowReal(l, -4.) : 1. + l * l + 1. / (l * l);
  const PetscReal slope = k == 3 ? 4. * (1. + PetscPowReal(l, -3.)) * PetscPowReal(l, -2.)
                                 : 2. * (l * l + 1.) / (l * l * l); /* (dI1/dl) / (l^k - 1) */

  return slope * (classical ? 0.5 : 2. / 3. * I1 / (I1 + 1.));
}

/* Pressure at the inner stretch la, by Simpson's rule. */
static PetscReal closed_form(PetscInt k, PetscBool classical, PetscReal la)
{
  const PetscReal power = (PetscReal)k;
  const PetscReal lb =
    PetscPowReal(1. + (PetscPowReal(la, power) - 1.) / PetscPowReal(2., power), 1. / power);
  const PetscInt n = 200;
  PetscReal sum = 0.;

  for (PetscInt i = 0; i <= n; i++)
    sum += (i % n == 0 ? 1.
            : i % 2    ? 4.
                       : 2.) *
           integrand(k, classical, lb + (la - lb) * (PetscReal)i / (PetscReal)n);
  return sum * (la - lb) / (3. * (PetscReal)n);
}

static void check_quadrature(void)
{
  const PetscReal a = STRETCH;
  const PetscReal b3 = PetscCbrtReal(1. + (a * a * a - 1.) / 8.);
  const PetscReal b2 = PetscSqrtReal(1. + (a * a - 1.) / 4.);

  SB_CHECK_NEAR(closed_form(3, PETSC_TRUE, a),
                0.5 * (4. / b3 + PetscPowReal(b3, -4.) - 4. / a - PetscPowReal(a, -4.)), 1e-9,
                "sphere, classical energy");
  SB_CHECK_NEAR(closed_form(2, PETSC_TRUE, a),
                PetscLogReal(a / b2) + 0.5 * (1. / (b2 * b2) - 1. / (a * a)), 1e-9,
                "cylinder, classical energy");
}

/* Radius of the surface below a layer, of nlayer in all. */
static PetscReal radius(PetscInt layer, PetscInt nlayer)
{
  return 1. + (PetscReal)layer / (PetscReal)nlayer;
}

/*
  An eighth of the sphere: nlayer layers, each with the n^2 triangles of an octahedron's face, whose
  prisms are cut into three tets along the diagonals to the vertex with the higher number.
  Collective.
*/
static PetscErrorCode write_sphere(PetscInt n, PetscInt nlayer, char path[512])
{
  const PetscInt per_layer = (n + 1) * (n + 2) / 2;
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &f));
  if (f) {
    PetscInt count = 0;

    /* number of vertex (i, j) of a layer: rows j of n + 1 - j vertices */
    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n",
            (int)((nlayer + 1) * per_layer));
    for (PetscInt layer = 0; layer <= nlayer; layer++) {
      const PetscReal r = radius(layer, nlayer);

      for (PetscInt j = 0; j <= n; j++) {
        for (PetscInt i = 0; i + j <= n; i++) {
          const PetscReal q = 0.5 * PETSC_PI / (PetscReal)n;
          const PetscReal x = PetscSinReal(q * (PetscReal)(n - i - j));
          const PetscReal y = PetscSinReal(q * (PetscReal)i);
          const PetscReal z = PetscSinReal(q * (PetscReal)j);
          const PetscReal scale = r / PetscSqrtReal(x * x + y * y + z * z);

          fprintf(f, "%d %.17g %.17g %.17g\n", (int)++count, scale * x, scale * y, scale * z);
        }
      }
    }
    fprintf(f, "$EndNodes\n$Elements\n%d\n", (int)(3 * n * n * nlayer));
    count = 0;
    for (PetscInt layer = 0; layer < nlayer; layer++) {
      PetscInt row = layer * per_layer;

      for (PetscInt j = 0; j < n; row += n + 1 - j, j++) {
        for (PetscInt c = 0; c < 2 * (n - j) - 1; c++) {
          const PetscInt a = row + c / 2 + 1,
                         b = a + n + 1 - j; /* in this row; in the next, shorter one */
          const PetscInt low[3] = {c % 2 ? a + 1 : a, c % 2 ? b : a + 1, c % 2 ? b + 1 : b};
          const PetscInt way =
            c % 2 ? 1 : 0; /* the two kinds of triangles have opposite orientations */

          for (PetscInt k = 0; k < 3; k++) {
            PetscInt v[4];

            for (PetscInt m = 0; m < 4; m++)
              v[m] = m <= 2 - k ? low[m] : low[m - 1] + per_layer;
            if (way != k % 2) {
              const PetscInt first = v[0];

              v[0] = v[1];
              v[1] = first;
            }
            fprintf(f, "%d 4 2 0 1 %d %d %d %d\n", (int)++count, (int)v[0], (int)v[1], (int)v[2],
                    (int)v[3]);
          }
        }
      }
    }
    fprintf(f, "$EndElements\n");
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Map of a quarter of a ring, one layer in z. */
static void ring(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal r = radius(place->at[0], place->n[0]);
  const PetscReal angle = 0.5 * PETSC_PI * x[1];

  x[0] = place->at[1] == place->n[1] ? 0. : r * PetscCosReal(angle);
  x[1] = r * PetscSinReal(angle);
  x[2] *= 0.1;
}

/* Mean stretch of the inner wall, from the radii of its facets' centroids. */
static PetscErrorCode inner_stretch(TestScene *t, PetscInt k, PetscReal *stretch)
{
  const SbSpace s = t->model->space;
  PetscReal sum[2] = {0., 0.};
  const PetscReal *u;
  PetscInt inside;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceFindSet(s, "inside", "verify_inflate", &inside));
  PetscCall(SbSpaceGetLocalRead(s, t->run->state.U, &u));
  for (PetscInt i = 0; i < 4 * s->mesh->ncell_owned; i++) {
    const PetscInt node = s->cell_node[i];
    PetscReal rest = 0.;
    PetscReal now = 0.;

    if (!(s->mesh->face_set[i] & SB_SET_BIT(inside)))
      continue;
    for (PetscInt c = 0; c < k; c++) {
      rest += PetscSqr(s->node_x[3 * node + c]);
      now += PetscSqr(s->node_x[3 * node + c] + u[3 * node + c]);
    }
    SB_CHECK(rest < 1. + 1e-9, "node at radius %g is not on the inner wall", PetscSqrtReal(rest));
    sum[0] += PetscSqrtReal(now / rest);
    sum[1] += 1.;
  }
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, s->comm));
  *stretch = sum[0] / sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void ripple(const PetscReal x[3], PetscReal v[3])
{
  v[0] = x[0] * PetscSinReal(3. * x[1]);
  v[1] = x[1] * PetscCosReal(2. * x[2] + x[0]);
  v[2] = x[2] * PetscSinReal(2. * x[0] + 1.);
}

/* A body: of k dimensions, law and element; `more` options. */
typedef struct {
  PetscInt k;
  PetscBool classical;
  const char *element, *more;
} Body;

static PetscErrorCode check(const Body *body, const char *mesh, const char *solver,
                            PetscReal *wrong)
{
  const PetscInt k = body->k;
  const PetscBool classical = body->classical;
  const char *element = body->element;
  const char *name = k == 3 ? "sphere" : "cylinder";
  const char *law = classical ? "neohookean" : "stable_neohookean";
  const PetscReal p = closed_form(k, classical, STRETCH);
  PetscReal stretch = 0.;
  PetscReal error[2];
  PetscReal order = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material %s -body_a_young %.17g "
    "-body_a_poisson %.17g -body_a_density 1 %s -effects x,y,z,push -effect_x_type fixed "
    "-effect_x_on x0 "
    "-effect_x_components x -effect_y_type fixed -effect_y_on y0 -effect_y_components y "
    "-effect_z_type "
    "fixed -effect_z_components z -effect_push_type pressure -effect_push_on inside "
    "-effect_push_value %.17g -time static -static_steps 4 -solver %s -ksp_rtol 1e-11 -snes_rtol "
    "1e-9",
    mesh, element, law, 2. * (1. + NU), NU, body->more, p, solver));
  PetscCall(verify_solve(&t, name));
  if (!strcmp(element, "p2")) {
    static const PetscReal corner[3] = {1., 0., 0.};
    PetscReal u[3];

    PetscCall(test_value_at(t.model, t.run->state.U, corner, u));
    stretch = 1. + u[0];
  } else
    PetscCall(inner_stretch(&t, k, &stretch));

  /* the state with the penalty on jumps of the end */
  PetscCall(SNESSolve(t.run->solve.snes, NULL, t.run->state.U));
  PetscCall(verify_newton(&t, ripple, 1e-4, error, &order));
  test_print(
    "  %s, %s, %s, %s: %d load steps, %d Newton and %d linear iterations; stretch %.4f, there p "
    "%.5f, applied %.5f: %+.2f %%; order %.2f\n",
    name, law, element, solver, (int)t.run->counters.steps, (int)t.run->counters.newton,
    (int)t.run->counters.linear, stretch, closed_form(k, classical, stretch), p,
    100. * (closed_form(k, classical, stretch) / p - 1.), order);
  SB_CHECK(stretch > 1.35, "%s: stretch %g only", name, stretch);
  *wrong = closed_form(k, classical, stretch) / p - 1.;
  SB_CHECK_NEAR(order, 2., 0.15, "order of Newton's method");
  SB_CHECK(t.run->counters.steps == 4 && t.run->counters.newton <= 40,
           "%s, %s: %d steps, %d iterations", name, solver, (int)t.run->counters.steps,
           (int)t.run->counters.newton);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares two meshes. */
static PetscErrorCode check_body(PetscInt k, PetscBool classical, const char *more)
{
  const Body cr = {k, classical, "cr", more};
  const Body dg = {k, classical, "dg", more};
  const Body p2 = {k, classical, "p2", more};
  PetscReal error[2], again;
  PetscBool mumps;

  PetscFunctionBeginUser;
  PetscCall(SbHasPackage("mumps", &mumps));
  for (PetscInt i = 0; i < 2; i++) {
    const PetscInt n = i ? 8 : 4;
    const PetscInt nlayer = i ? 8 : 4;
    char mesh[512];

    if (k == 3)
      PetscCall(write_sphere(n, nlayer, mesh));
    else
      PetscCall(verify_mesh_write((const PetscInt[3]){nlayer, n + n / 2, 1}, ring, NULL, mesh));
    PetscCall(check(&cr, mesh, "direct", &error[i]));
    if (mumps && !i)
      PetscCall(check(&cr, mesh, "mumps", &again));
    if (classical && k == 3 && !i) {
      PetscCall(check(&p2, mesh, "direct", &again));
      SB_CHECK_NEAR(again, 0., 0.03, "pressure of the closed form, P2, flat facets");
    }
    if (!i)
      PetscCall(check(&dg, mesh, "direct", &again));
    if (!i)
      SB_CHECK_NEAR(again, error[0], 1e-3, "pressure of the closed form, DG and CR");
  }
  SB_CHECK_NEAR(error[0], 0., 0.025, "pressure of the closed form, four layers");
  SB_CHECK_NEAR(error[1], 0., 0.005, "pressure of the closed form, eight layers");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A run to 1.3 times the largest pressure. nu: of P1, which locks, where its own limit is below
   that. */
static PetscErrorCode check_beyond(const char *element, PetscReal nu, PetscInt steps)
{
  PetscReal limit = 0.;
  PetscReal least = PETSC_MAX_REAL;
  PetscReal *x;
  char mesh[512];
  TestScene t;
  SbMesh m;

  PetscFunctionBeginUser;
  for (PetscInt i = 1; i < 300; i++)
    limit = PetscMax(limit, closed_form(3, PETSC_TRUE, 1. + 0.01 * (PetscReal)i));
  PetscCall(write_sphere(!strcmp(element, "cr") ? 3 : 2, 2, mesh)); /* 24 tets of cr are too few */
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material neohookean -body_a_young %.17g "
    "-body_a_poisson %.17g -body_a_density 1 -sets x0,y0,z0,inside " WALLS
    "-set_inside_at sphere:0,0,0,1.001 -effects x,y,z,push -effect_x_type fixed -effect_x_on x0 "
    "-effect_x_components x -effect_y_type fixed -effect_y_on y0 -effect_y_components y "
    "-effect_z_type fixed -effect_z_on z0 -effect_z_components z -effect_push_type pressure "
    "-effect_push_on inside -effect_push_value %.17g -time static -static_steps %d",
    mesh, element, 2. * (1. + nu), nu, 1.3 * limit, (int)steps));
  PetscCall(SbRunSolve(t.run));
  m = t.model->mesh;
  PetscCall(PetscMalloc1(3 * (size_t)m->nvert, &x));
  PetscCall(SbSpaceVertexPositions(t.model->space, t.run->state.U, x));
  for (PetscInt v = 0; v < m->nvert_owned; v++)
    if (SbDot3(m->x + 3 * v, m->x + 3 * v) < 1.001)
      least = PetscMin(least, SbDot3(m->x + 3 * v, x + 3 * v));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_REAL, MPI_MIN, m->comm));
  PetscCall(PetscFree(x));
  test_print("  1.3 times the limit, %s, %d load steps: %.4f of it in %d steps, softening %.0f, "
             "inner radius %.3f\n    %s\n",
             element, (int)steps, 1.3 * t.run->clock.t, (int)t.run->counters.steps,
             t.run->solve.softening, least, t.run->clock.stop_reason);
  SB_CHECK(t.run->clock.stop_reason[0] && t.run->clock.t < 1.,
           "%s, %d load steps: the load factor %g was reached", element, (int)steps,
           t.run->clock.t);
  SB_CHECK(t.run->clock.t > 0.65 && t.run->clock.t < 0.95, "%s: ended at %g of the load", element,
           t.run->clock.t);
  SB_CHECK(t.run->solve.softening > 5., "%s: softening %g", element, t.run->solve.softening);
  SB_CHECK(least > 1.4, "%s, %d load steps: the inner wall is at radius %g", element, (int)steps,
           least);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  check_quadrature();
  for (PetscInt steps = 1; steps < 6; steps += 4) {
    PetscCall(check_beyond("p2", NU, steps));
    if (test_size > 1)
      continue; /* many short steps of small systems */
    PetscCall(check_beyond("cr", NU, steps));
    PetscCall(check_beyond("p1", 0.3, steps));
  }
  for (int classical = 0; classical < 2; classical++) {
    PetscCall(check_body(3, (PetscBool)classical,
                         "-sets x0,y0,z0,inside " WALLS
                         "-set_inside_at sphere:0,0,0,1.001 -effect_z_on z0"));
    PetscCall(check_body(2, (PetscBool)classical,
                         "-sets x0,y0,z0,z1,inside " WALLS "-set_z1_at plane:0,0,1,0.1 "
                         "-set_inside_at sphere:0,0,0.05,1.01 -effect_z_on z0,z1"));
  }
  SB_TEST_END();
}
