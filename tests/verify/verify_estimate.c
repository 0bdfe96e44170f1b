// @ranks 1
/*
  Effectivity of the spatial error estimate: estimate over true error in the energy norm
  (sbestimate.h), for P1, CR, DG and P2, on problems with known stress, or with a reference on a
  mesh at least twice as fine.

    cube      manufactured.h, n perturbed cells along an edge; at nu = 0.49999 P1 has a thousandth
    of the exact displacement shell     Lame's hollow sphere (locking.h), edge length 0.3
    bar       clamped at one end, under its weight, n cells across; the stress is singular at the
    edge of the clamp cook      Cook's membrane, clamped on its left, sheared on its right, plane
    strain, 4 n cells in each direction two       the bar with an upper half forty times as stiff:
    the stress jumps at the interface turned    the bar with a nonlinear material, its end rotated
    by more than half a radian
    squeeze   a plate tied to two stiff ones that approach each other: no loads, so a locked
    solution has too much energy, not too
              little
    sphere    a rigid sphere that indents a quarter of a block
    wave      axial vibration of a rod: half of its load is inertia

  Each ratio must be between 0.6 and 1.3 (measured: 0.65 to 1.26). The last two columns are other
  estimators on P1: recovery only (Zienkiewicz and Zhu 1992), which does not detect locking; and
  traction jumps (Verfuerth 1996), eta^2 = c sum_F h |F| |[P N]|^2 / mu with c calibrated for the
  cube, n = 16 and nu = 0.3, which exceed the error if the pressure oscillates.
*/
#include "../../src/ledger/ledger_impl.h"
#include "locking.h"

typedef struct {
  const char *problem, *element;
  PetscInt n;
  PetscReal nu;
} Case;

/* Stress of the continuum at a reference position, Pa. */
typedef void (*Exact)(PetscReal nu, const PetscReal x[3], PetscReal S[9]);

static void exact_cube(PetscReal nu, const PetscReal x[3], PetscReal S[9])
{
  const PetscReal mu = 3. / (2. * (1. + nu));
  PetscReal u[3], G[9];

  manufactured_exact(x, u, G);
  for (int k = 0; k < 9; k++)
    S[k] = mu * (G[k] + G[3 * (k % 3) + k / 3]);
}

static void exact_shell(PetscReal nu, const PetscReal x[3], PetscReal S[9])
{
  const PetscReal r = PetscSqrtReal(SbDot3(x, x));
  const PetscReal radial = (1. - 8. / (r * r * r)) / 7.;
  const PetscReal hoop = (1. + 4. / (r * r * r)) / 7.;

  (void)nu;
  for (int k = 0; k < 9; k++)
    S[k] = (k % 4 == 0) * hoop + (radial - hoop) * x[k / 3] * x[k % 3] / (r * r);
}

/* Rod of length 1, E = 1, rho = 1, nu = 0, fixed at x = 0: u_x = (1 - cos(k t)) sin(k x), k = pi/2,
   at k t = pi. */
static void exact_wave(PetscReal nu, const PetscReal x[3], PetscReal S[9])
{
  (void)nu;
  for (int k = 0; k < 9; k++)
    S[k] = 0.;
  S[0] = PETSC_PI * PetscCosReal(0.5 * PETSC_PI * x[0]);
}

/* Deviatoric energy density of the symmetric part of R^T T (R NULL: of T), J/m^3; *trace: its
   trace, with the volumetric energy density trace^2 / (18 K). */
static PetscReal energy(SbMaterial m, const PetscReal R[9], const PetscReal T[9], PetscReal *trace)
{
  PetscReal s[9];
  PetscReal square = 0.;

  if (R)
    SbMatTransposeMul(R, T, s);
  else
    memcpy(s, T, sizeof(s));
  for (int k = 0; k < 9; k++)
    square += PetscSqr(0.5 * (s[k] + s[3 * (k % 3) + k / 3]));
  *trace = s[0] + s[4] + s[8];
  return (square - *trace * *trace / 3.) / (4. * SbMaterialShearModulus(m));
}

/* Stresses of a solved run, linear in each cell; for P2 the deviator is linear and the pressure is
   constant. */
typedef struct {
  PetscInt n, npoint;    /* number of cells; sample points per cell for the sums */
  PetscReal *V;          /* [n] volumes, m^3 */
  PetscReal (*x)[4][3];  /* [n] coordinates of the sample points, m */
  PetscReal (*P)[4][9];  /* [n] Piola stresses at the sample points, Pa */
  PetscReal (*at)[4][9]; /* [n] Piola stresses at the vertices, Pa */
  PetscReal *R;          /* [n][9] rotations */
  PetscInt *material;
  PetscReal error2, *weight, *trace; /* energy of differences, J; [n] weights, traces of cells */
} Stress;

static PetscErrorCode stress_get(SbModel m, Vec U, Stress *s)
{
  const PetscInt n = m->mesh->ncell;
  const PetscReal near = SbRuleQuadratic.L[0][0];
  const PetscReal far = SbRuleQuadratic.L[0][1];
  const PetscReal *u;
  PetscReal *psi, *P, *point;

  PetscFunctionBeginUser;
  s->n = n;
  s->npoint = m->element[0]->nodes_per[1] ? 4 : 1;
  s->error2 = 0.;
  PetscCall(PetscMalloc6(n, &s->x, n, &s->V, n, &s->P, n, &s->at, 9 * n, &s->R, n, &s->material));
  PetscCall(PetscCalloc2(n, &s->weight, n, &s->trace));
  PetscCall(PetscMalloc3(n, &psi, 9 * n, &P, 36 * n, &point));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  SbSpaceCellPiola(m->space, u, P, s->R, psi, point);
  for (PetscInt c = 0; c < n; c++) {
    const PetscReal *R = s->R + 9 * c;
    PetscReal sum[9] = {0.};
    VerifyCell cell;

    verify_cell(m->space, u, c, &cell);
    s->V[c] = cell.V;
    s->material[c] = m->mesh->cell_material[c];
    for (int q = 0; q < 4; q++) {
      const PetscReal *from = s->npoint == 1 ? P + 9 * c : point + 9 * (4 * c + q);
      PetscReal more = 0.;

      for (int k = 0; k < 9; k++)
        more += R[k] * (P[9 * c + k] - from[k]) / 3.;
      for (int k = 0; k < 9; k++)
        s->P[c][q][k] = from[k] + more * R[k];
      for (int k = 0; k < 3; k++) {
        s->x[c][q][k] = 0.;
        for (int a = 0; a < 4; a++)
          s->x[c][q][k] += (s->npoint == 1 ? 0.25 : SbRuleQuadratic.L[q][a]) * cell.x[a][k];
      }
    }
    for (int i = 0; i < 36; i++)
      sum[i % 9] += s->P[c][i / 9][i % 9];
    for (int a = 0; a < 4; a++)
      for (int k = 0; k < 9; k++)
        s->at[c][a][k] =
          s->npoint == 1 ? P[9 * c + k] : (s->P[c][a][k] - far * sum[k]) / (near - far);
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(PetscFree3(psi, P, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode stress_free(Stress *s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree6(s->x, s->V, s->P, s->at, s->R, s->material));
  PetscCall(PetscFree2(s->weight, s->trace));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Subtracts from S the stress of a cell at barycentric coordinates b. */
static void subtract(const Stress *s, PetscInt cell, const PetscReal b[4], PetscReal S[9])
{
  for (int a = 0; a < 4; a++)
    for (int k = 0; k < 9; k++)
      S[k] -= b[a] * s->at[cell][a][k];
}

/* Adds the energy of a stress difference S. P2: the pressure energy is that of the mean pressure of
   a cell. */
static void add_difference(SbModel m, Stress *s, const PetscReal R[9], PetscInt cell, PetscReal w,
                           const PetscReal S[9])
{
  const SbMaterial law = m->material[s->material[cell]];
  PetscReal trace;

  s->error2 += w * energy(law, R, S, &trace);
  s->weight[cell] += w;
  if (s->npoint == 1)
    s->error2 += w * trace * trace / (18. * SbMaterialBulkModulus(law));
  else
    s->trace[cell] += w * trace;
}

/* Adds the energies of the mean pressures, gives the sum and frees the stresses. */
static PetscErrorCode sum_end(SbModel m, Stress *s, PetscReal *error2)
{
  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < s->n; c++) {
    const SbMaterial law = m->material[s->material[c]];

    if (s->weight[c] > 0.)
      s->error2 += PetscSqr(s->trace[c]) / (18. * SbMaterialBulkModulus(law) * s->weight[c]);
  }
  *error2 = s->error2;
  PetscCall(stress_free(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Squared error against an exact stress. */
static PetscErrorCode exact_error(SbModel m, Vec U, PetscReal nu, Exact exact, PetscReal *error2)
{
  PetscReal b[14][4], w[14];
  Stress s;

  PetscFunctionBeginUser;
  manufactured_rule(b, w);
  PetscCall(stress_get(m, U, &s));
  for (PetscInt c = 0; c < s.n; c++) {
    const PetscInt *v = m->mesh->cell + 4 * c;

    for (int q = 0; q < 14; q++) {
      PetscReal p[3] = {0., 0., 0.};
      PetscReal S[9];

      for (int a = 0; a < 4; a++)
        for (int k = 0; k < 3; k++)
          p[k] += b[q][a] * m->mesh->x[3 * v[a] + k];
      exact(nu, p, S);
      subtract(&s, c, b[q], S);
      add_difference(m, &s, NULL, c, w[q] * s.V[c], S);
    }
  }
  PetscCall(sum_end(m, &s, error2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Squared error against the stresses of a finer mesh at its sample points. */
static PetscErrorCode finer_error(SbModel m, Vec U, const Stress *fine, PetscReal *error2)
{
  SbMesh mesh = m->mesh;
  PetscReal(*inverse)[9]; /* rows: gradients of the barycentric coordinates of vertices 1..3 */
  Stress s;

  PetscFunctionBeginUser;
  PetscCall(stress_get(m, U, &s));
  PetscCall(PetscMalloc1(s.n, &inverse));
  for (PetscInt c = 0; c < s.n; c++) {
    const PetscInt *v = mesh->cell + 4 * c;
    PetscReal e[9];

    for (int k = 0; k < 9; k++)
      e[k] = mesh->x[3 * v[1 + k / 3] + k % 3] - mesh->x[3 * v[0] + k % 3];
    SbMatCofactor(e, inverse[c]);
    for (int k = 0; k < 9; k++)
      inverse[c][k] /= 6. * s.V[c];
  }
  for (PetscInt i = 0; i < fine->npoint * fine->n; i++) {
    const PetscInt f = i / fine->npoint;
    const PetscInt q = i % fine->npoint;
    PetscReal best = -PETSC_MAX_REAL;
    PetscReal S[9];
    PetscReal at_b[4] = {0.};
    PetscInt at = 0;

    /* the cell that contains the point, or the nearest one where the surfaces of the meshes
       differ */
    for (PetscInt c = 0; c < s.n && best < 0.; c++) {
      PetscReal d[3], b[4];
      PetscReal least = 0.;

      for (int k = 0; k < 3; k++)
        d[k] = fine->x[f][q][k] - mesh->x[3 * mesh->cell[4 * c] + k];
      for (int a = 0; a < 3; a++)
        b[a + 1] = SbDot3(inverse[c] + 3 * a, d);
      b[0] = 1. - b[1] - b[2] - b[3];
      least = PetscMin(PetscMin(b[0], b[1]), PetscMin(b[2], b[3]));
      if (least > best && s.material[c] == fine->material[f]) {
        best = least;
        at = c;
        memcpy(at_b, b, sizeof(b));
      }
    }
    memcpy(S, fine->P[f][q], sizeof(S));
    subtract(&s, at, at_b, S);
    add_difference(m, &s, s.R + 9 * at, at, fine->V[f] / (PetscReal)fine->npoint, S);
  }
  PetscCall(sum_end(m, &s, error2));
  PetscCall(PetscFree(inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum over interior faces of h |F| |[P N]|^2 / mu, with h |F| the mean of the two volumes; without
   the constant c. */
static PetscErrorCode jump_estimate(SbModel m, Vec U, PetscReal *eta2)
{
  SbMesh mesh = m->mesh;
  SbFaces faces;
  Stress s;

  PetscFunctionBeginUser;
  PetscCall(stress_get(m, U, &s));
  PetscCall(SbFacesCreate(mesh->nvert, mesh->ncell, mesh->cell, &faces));
  *eta2 = 0.;
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    const PetscInt c = i / 4;
    const PetscInt other = faces.neighbour[i];
    const PetscInt *v = mesh->cell + 4 * c;
    const SbMaterial law = m->material[s.material[c]];
    const PetscReal *x[3];
    PetscReal p[3], q[3], N[3];
    PetscReal jump = 0.;

    if (other < c)
      continue;
    for (int k = 0; k < 3; k++)
      x[k] = mesh->x + 3 * v[(i + 1 + k) % 4];
    for (int k = 0; k < 3; k++) {
      p[k] = x[1][k] - x[0][k];
      q[k] = x[2][k] - x[0][k];
    }
    SbCross(p, q, N);
    for (int k = 0; k < 3; k++)
      jump += PetscSqr(SbDot3(s.P[c][0] + 3 * k, N) - SbDot3(s.P[other][0] + 3 * k, N));
    *eta2 += 0.5 * (s.V[c] + s.V[other]) * jump / SbDot3(N, N) / SbMaterialShearModulus(law);
  }
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(stress_free(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints and checks one row of the table. */
static PetscErrorCode report(const Case *c, TestScene *t, PetscReal error2)
{
  const PetscReal jump = 0.143; /* constant c of the estimator */
  const PetscBool stiff = (PetscBool)!strcmp(c->element, "p1");
  SbRun run = t->run;
  SbSpaceEstimate est;
  PetscReal ratio;
  PetscReal other = 0.;
  char others[64] = "| |";

  PetscFunctionBeginUser;
  PetscCall(SbSpaceEstimateCreate(t->model, &est));
  PetscCall(SbSpaceEstimateCompute(est, strcmp(c->problem, "wave") ? 1. : 2., run->state.U,
                                   run->state.V, run->state.A));
  ratio = PetscSqrtReal(est->body2[0] / error2);
  if (stiff) {
    PetscCall(jump_estimate(t->model, run->state.U, &other));
    PetscCall(PetscSNPrintf(others, sizeof(others), "| %.2f | %.2f |",
                            ratio / PetscSqrtReal(est->factor[0]),
                            PetscSqrtReal(jump * other / error2)));
  }
  test_print("| %s | %s | %d | %g | %.3g | %.3g | %.2f %s\n", c->problem, c->element, (int)c->n,
             c->nu, PetscSqrtReal(est->body2[0] / est->strain[0]),
             PetscSqrtReal(error2 / est->strain[0]), ratio, others);
  SB_CHECK(ratio > 0.6 && ratio < 1.3, "%s, %s, n %d, nu %g: the estimate is %g of the error",
           c->problem, c->element, (int)c->n, c->nu, ratio);
  PetscCall(SbSpaceEstimateDestroy(&est));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ problems with a known
   stress */

static PetscErrorCode check_exact(const Case *c, const char *scene, const char *mesh, Exact exact)
{
  PetscReal error2 = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "%s -body_a_mesh %s -body_a_element %s", scene, mesh, c->element));
  PetscCall(verify_solve(&t, c->problem));
  PetscCall(exact_error(t.model, t.run->state.U, c->nu, exact, &error2));
  PetscCall(report(c, &t, error2));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_cube(const char *element, PetscInt n, PetscReal nu)
{
  const Case c = {"cube", element, n, nu};
  char scene[VERIFY_TEXT], mesh[512];

  PetscFunctionBeginUser;
  PetscCall(
    verify_distorted_box((const PetscInt[3]){n, n, n}, (const PetscReal[3]){1., 1., 1.}, mesh));
  PetscCall(manufactured_scene(nu, scene, sizeof(scene)));
  PetscCall(PetscStrlcat(scene, " -solver direct", sizeof(scene)));
  PetscCall(check_exact(&c, scene, mesh, exact_cube));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_shell(const char *element, PetscReal nu)
{
  const Case c = {"shell", element, 3, nu};
  char scene[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    scene, sizeof(scene),
    "-bodies a -body_a_material linear -body_a_young 1 -body_a_poisson %.17g -body_a_density 1 "
    "-effects x,y,z,push -effect_x_type fixed -effect_x_on x0 -effect_x_components x "
    "-effect_y_type fixed -effect_y_on y0 -effect_y_components y -effect_z_type fixed "
    "-effect_z_on z0 -effect_z_components z -effect_push_type pressure -effect_push_on inside "
    "-effect_push_value 1 -effect_push_follower no -time static -solver direct",
    nu));
  PetscCall(check_exact(&c, scene, "meshes/shell.msh", exact_shell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_wave(const char *element, PetscInt n)
{
  const Case c = {"wave", element, n, 0.};
  char mesh[512];

  PetscFunctionBeginUser;
  PetscCall(verify_distorted_box((const PetscInt[3]){4 * n, n, n},
                                 (const PetscReal[3]){1., 0.25, 0.25}, mesh));
  PetscCall(
    check_exact(&c,
                "-bodies a -body_a_material linear -body_a_young 1 -body_a_poisson 0 "
                "-body_a_density 1 -sets root -set_root_at plane:1,0,0,0 -effects hold,load "
                "-effect_hold_type fixed -effect_hold_on root -effect_load_type body_force "
                "-effect_load_density (pi/2)^2*sin(pi/2*x);0;0 -time newmark -ts_dt 0.1 "
                "-ts_max_time 2 -ksp_rtol 1e-10",
                mesh, exact_wave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ problems with a reference on a
   finer mesh */

/* Box of shape[3] n cells and the given size, deformed by `map` if not NULL; `options` of the
   scene. */
typedef struct {
  const char *name, *options;
  PetscInt shape[3];
  PetscReal size[3];
  VerifyMap map;
} Problem;

#define BAR                                                                                        \
  "-bodies a -body_a_young 5e4 -body_a_density 1000 -sets root -set_root_at plane:1,0,0,0 "        \
  "-effects hold,weight -effect_hold_type fixed -effect_hold_on root -effect_weight_type gravity " \
  "-time static "
#define WEIGHT "-effect_weight_vector 0,0,-9.81 "

static PetscErrorCode open_problem(const Problem *p, const Case *c, TestScene *t)
{
  const PetscInt n[3] = {p->shape[0] * c->n, p->shape[1] * c->n, p->shape[2] * c->n};
  char mesh[512];

  PetscFunctionBeginUser;
  if (p->map)
    PetscCall(verify_mesh_write(n, p->map, (void *)(uintptr_t)p->size, mesh));
  else
    PetscCall(verify_distorted_box(n, p->size, mesh));
  PetscCall(test_open(t, "%s -body_a_mesh %s -body_a_element %s -body_a_poisson %.17g", p->options,
                      mesh, c->element, c->nu));
  PetscCall(verify_solve(t, p->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  const char *element;
  PetscInt n;
} Level;

/* A problem on a reference mesh and on the meshes that are compared with it, ended by one without
   an element. */
typedef struct {
  const Problem *problem;
  PetscReal nu;
  Level fine, levels[5];
} Reference;

static PetscErrorCode check_finer(const Reference *r)
{
  Stress stress;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    open_problem(r->problem, &(Case){r->problem->name, r->fine.element, r->fine.n, r->nu}, &t));
  PetscCall(stress_get(t.model, t.run->state.U, &stress));
  PetscCall(test_scene_close(&t));
  for (const Level *l = r->levels; l->element; l++) {
    const Case c = {r->problem->name, l->element, l->n, r->nu};
    PetscReal error2 = 0.;

    PetscCall(open_problem(r->problem, &c, &t));
    PetscCall(finer_error(t.model, t.run->state.U, &stress, &error2));
    PetscCall(report(&c, &t, error2));
    PetscCall(test_scene_close(&t));
  }
  PetscCall(stress_free(&stress));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Map of a regular box. */
static void straight_map(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal *size = (const PetscReal *)place->ctx;

  for (int k = 0; k < 3; k++)
    x[k] *= size[k];
}

/* Map of a graded mesh: cells grow with the distance from the corner (0, 0, 0) in the top face. */
static void sphere_map(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  for (int k = 0; k < 3; k++) {
    const PetscReal from = k == 2 ? 1. - x[k] : x[k];

    x[k] = (PetscExpReal(3. * from) - 1.) / (PetscExpReal(3.) - 1.);
  }
  x[2] = -x[2];
}

static const Problem bar = {
  "bar", BAR WEIGHT "-body_a_material linear -solver direct", {4, 1, 1}, {0.4, 0.1, 0.1}, NULL};
static const Problem two = {
  "two",
  BAR WEIGHT "-body_a_material linear -body_a_inclusions far -set_far_at box:0,0,0.05,0.4,0.1,0.1 "
             "-sets root,far -inclusion_far_material linear -inclusion_far_young 2e6 "
             "-inclusion_far_poisson 0.3 -inclusion_far_density 1000 -solver direct",
  {4, 1, 1},
  {0.4, 0.1, 0.1},
  straight_map};
static const Problem cook = {
  "cook",
  "-bodies a -body_a_material linear -body_a_young 1 -body_a_density 1 -sets left,right "
  "-set_left_at plane:1,0,0,0 -set_right_at plane:1,0,0,48 -effects hold,plane,pull "
  "-effect_hold_type "
  "fixed -effect_hold_on left -effect_plane_type fixed -effect_plane_on all "
  "-effect_plane_components z "
  "-effect_pull_type traction -effect_pull_on right -effect_pull_vector 0;1/16;0 -time static "
  "-solver direct",
  {4, 4, 1},
  {1., 1., 1.},
  locking_cook_map};
static const Problem squeeze = {
  "squeeze",
  "-bodies a -body_a_material linear -body_a_young 5e4 -body_a_density 1000 -sets low,high "
  "-set_low_at plane:0,0,1,0 -set_high_at plane:0,0,1,0.1 -effects hold,press -effect_hold_type "
  "fixed "
  "-effect_hold_on low -effect_press_type prescribed_displacement -effect_press_on high "
  "-effect_press_displacement 0;0;-0.01 -time static -solver direct",
  {2, 2, 1},
  {0.2, 0.2, 0.1},
  NULL};
static const Problem corotated = {
  "turned, co-rotated",
  BAR
  "-body_a_material corotated -body_a_tangent exact -effect_weight_vector 0,0,-4 -solver direct",
  {4, 1, 1},
  {0.4, 0.1, 0.1},
  NULL};
static const Problem neohookean = {
  "turned, neo-Hookean",
  BAR "-body_a_material stable_neohookean -effect_weight_vector 0,0,-2 -solver direct",
  {4, 1, 1},
  {0.4, 0.1, 0.1},
  NULL};
/* Radius of the sphere 1 m, indentation 0.01 m: the contact radius by Hertz is 0.1 m, two or four
   cells. */
static const Problem sphere = {
  "sphere",
  "-bodies a -body_a_material linear -body_a_young 1e5 -body_a_density 1 -sets x0,y0,z1,top "
  "-set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -set_z1_at plane:0,0,1,-1 -set_top_at "
  "plane:0,0,1,0 "
  "-time static -ksp_rtol 1e-9 -effects x,y,z,ball -effect_x_type fixed -effect_x_on x0 "
  "-effect_x_components x -effect_y_type fixed -effect_y_on y0 -effect_y_components y "
  "-effect_z_type fixed "
  "-effect_z_on z1 -effect_ball_type contact -effect_ball_response projected -effect_ball_on top "
  "-effect_ball_obstacle sphere:0,0,0.99,1",
  {1, 1, 1},
  {1., 1., 1.},
  sphere_map};

static const Reference references[] = {
  {&bar, 0.3, {"cr", 6}, {{"p1", 2}, {"p1", 4}, {"cr", 2}, {"dg", 2}}},
  {&bar, 0.4999, {"cr", 6}, {{"p1", 2}, {"p1", 4}, {"cr", 2}, {"dg", 2}}},
  {&two, 0.3, {"cr", 6}, {{"p1", 2}, {"p1", 4}, {"cr", 2}, {"dg", 2}}},
  {&two, 0.4999, {"cr", 6}, {{"p1", 2}, {"p1", 4}, {"cr", 2}, {"dg", 2}}},
  {&bar, 0.3, {"p2", 4}, {{"p2", 1}, {"p2", 2}}},
  {&bar, 0.4999, {"p2", 4}, {{"p2", 1}, {"p2", 2}}},
  {&two, 0.3, {"p2", 4}, {{"p2", 2}}},
  {&cook, 0.3, {"p2", 4}, {{"p2", 1}, {"p2", 2}}},
  {&cook, 0.4999, {"p2", 4}, {{"p2", 1}, {"p2", 2}}},
  {&squeeze, 0.3, {"cr", 6}, {{"p1", 2}, {"p1", 3}, {"cr", 2}}},
  {&squeeze, 0.499, {"cr", 6}, {{"p1", 2}, {"p1", 3}, {"cr", 2}}},
  {&squeeze, 0.499, {"p2", 4}, {{"p2", 2}}},
  {&corotated, 0.3, {"cr", 4}, {{"p1", 2}, {"cr", 2}}},
  {&corotated, 0.3, {"p2", 3}, {{"p2", 1}}},
  {&neohookean, 0.3, {"cr", 4}, {{"p1", 2}, {"cr", 2}}},
  {&neohookean, 0.3, {"p2", 3}, {{"p2", 1}}},
  {&sphere, 0.3, {"p1", 16}, {{"p1", 4}, {"p1", 8}, {"cr", 4}}},
  {&sphere, 0.45, {"p1", 16}, {{"p1", 4}, {"p1", 8}, {"cr", 4}}},
};

int main(int argc, char **argv)
{
  static const PetscReal nu[4] = {0.3, 0.45, 0.499, 0.49999};

  SB_TEST_BEGIN(argc, argv);
  test_print("| problem | element | n | nu | estimate | error | ratio | recovery alone "
             "| jumps |\n|---|---|---|---|---|---|---|---|---|\n");
  for (int i = 0; i < 4; i++) {
    for (PetscInt n = 4; n <= 16; n *= 2)
      PetscCall(check_cube("p1", n, nu[i]));
    PetscCall(check_cube("cr", 4, nu[i]));
    if (i % 3 == 0)
      PetscCall(check_cube("cr", 8, nu[i]));
    PetscCall(check_cube("dg", 4, nu[i]));
    if (i % 3 == 0)
      PetscCall(check_cube("p2", 4, nu[i]));
    if (i == 3)
      PetscCall(check_cube("p2", 8, nu[i]));
  }
  for (int i = 0; i < 4; i++) {
    PetscCall(check_shell("p1", nu[i]));
    PetscCall(check_shell("cr", nu[i]));
    if (i % 3 == 0)
      PetscCall(check_shell("dg", nu[i]));
    if (i % 3 == 0)
      PetscCall(check_shell("p2", nu[i]));
  }
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(references); i++)
    PetscCall(check_finer(&references[i]));
  PetscCall(check_wave("p1", 2));
  PetscCall(check_wave("p1", 4));
  PetscCall(check_wave("cr", 2));
  PetscCall(check_wave("p2", 2));
  SB_TEST_END();
}
