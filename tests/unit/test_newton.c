// @ranks 1
/*
  Newton's method (src/newton) on problems of two unknowns without a mesh: Rosenbrock's valley, with
  and without provisional steps; two wells from an indefinite start, with and without filtered
  tangents and the count of negative eigenvalues; a truss that snaps through; a barrier that limits
  steps, and that a prescribed motion pushes; lagged friction; warm starts and interruptions.
*/
#include <sbnewton.h>
#include "test.h"

#define VALLEY_HIGH 10. /* energy above which Rosenbrock's "tets" are inverted, where asked for */
#define WIDTH 0.5       /* of the barrier, m */
#define STIFF 10.       /* of the barrier, N/m */
#define SPRING 2.       /* stiffness of the particle's spring, N/m */
#define HEIGHT 0.3      /* of the truss, over its half width */

typedef struct _Problem Problem;
struct _Problem {
  SbNewtonProblem newton;
  SbNewtonBarrier barrier;
  void (*energy)(const Problem *p, const PetscReal x[2], PetscReal *E, PetscReal g[2],
                 PetscReal H[4]); /* but for the barrier */
  PetscReal load;                 /* of the truss; rest position of the particle's spring */
  PetscBool prescribed;           /* the second unknown is a wall, whose position is prescribed */
  PetscBool limit_energy;         /* tets are inverted above VALLEY_HIGH */
  PetscBool filtered;
  PetscReal friction;      /* lagged */
  PetscReal least;         /* smallest gap of all evaluations, m */
  PetscInt updates, calls; /* of friction; of `interrupted` */
  PetscInt stop_at;        /* call of `interrupted` at which it stops; 0: never */
  PetscReal H;             /* of the barrier, at the last linear solve */
};

/* (1 - x)^2 + 100 (y - x^2)^2 */
static void valley(const Problem *p, const PetscReal x[2], PetscReal *E, PetscReal g[2],
                   PetscReal H[4])
{
  const PetscReal r = x[1] - x[0] * x[0];

  (void)p;
  *E = PetscSqr(1. - x[0]) + 100. * r * r;
  g[0] = -2. * (1. - x[0]) - 400. * r * x[0];
  g[1] = 200. * r;
  H[0] = 2. - 400. * r + 800. * x[0] * x[0];
  H[1] = H[2] = -400. * x[0];
  H[3] = 200.;
}

/* (x^2 - 1)^2 / 4 + y^2 / 2 */
static void two_wells(const Problem *p, const PetscReal x[2], PetscReal *E, PetscReal g[2],
                      PetscReal H[4])
{
  (void)p;
  *E = 0.25 * PetscSqr(x[0] * x[0] - 1.) + 0.5 * x[1] * x[1];
  g[0] = x[0] * (x[0] * x[0] - 1.);
  g[1] = x[1];
  H[0] = 3. * x[0] * x[0] - 1.;
  H[1] = H[2] = 0.;
  H[3] = 1.;
}

/* Von Mises' truss, shallow: strain (w^2 - 2 h w) / 2, w the deflection of its top; its load. */
static void truss(const Problem *p, const PetscReal x[2], PetscReal *E, PetscReal g[2],
                  PetscReal H[4])
{
  const PetscReal strain = 0.5 * x[0] * x[0] - HEIGHT * x[0];
  const PetscReal slope = x[0] - HEIGHT;

  *E = 0.5 * strain * strain - p->load * x[0] + 0.5 * x[1] * x[1];
  g[0] = strain * slope - p->load;
  g[1] = x[1];
  H[0] = slope * slope + strain;
  H[1] = H[2] = 0.;
  H[3] = 1.;
}

/* A particle at x on a spring; the wall's position y is prescribed. */
static void particle(const Problem *p, const PetscReal x[2], PetscReal *E, PetscReal g[2],
                     PetscReal H[4])
{
  const PetscReal stretch = x[0] - p->load - p->friction;

  *E = 0.5 * SPRING * stretch * stretch;
  g[0] = SPRING * stretch;
  g[1] = 0.;
  H[0] = SPRING;
  H[1] = H[2] = 0.;
  H[3] = 1.;
}

/* The barrier -STIFF (d - w)^2 log(d / w) of the gap d < w, w its width. */
static void repel(Problem *p, const PetscReal x[2], PetscReal *E, PetscReal *force, PetscReal *H)
{
  const PetscReal d = x[0] - x[1];

  *E = *force = *H = 0.;
  p->least = PetscMin(p->least, d);
  if (d >= WIDTH)
    return;
  *E = d > 0. ? -STIFF * PetscSqr(d - WIDTH) * PetscLogReal(d / WIDTH) : PETSC_INFINITY;
  *force = STIFF * (2. * (d - WIDTH) * PetscLogReal(d / WIDTH) + PetscSqr(d - WIDTH) / d);
  *H = -STIFF * (2. * PetscLogReal(d / WIDTH) + 4. * (d - WIDTH) / d - PetscSqr((d - WIDTH) / d));
}

static PetscErrorCode get(Vec X, PetscReal x[2])
{
  const PetscScalar *a;

  PetscFunctionBeginUser;
  x[0] = x[1] = 0.;
  PetscCall(VecGetArrayRead(X, &a));
  x[0] = a[0];
  x[1] = a[1];
  PetscCall(VecRestoreArrayRead(X, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode put(Vec X, PetscReal x, PetscReal y)
{
  PetscFunctionBeginUser;
  PetscCall(VecSetValue(X, 0, x, INSERT_VALUES));
  PetscCall(VecSetValue(X, 1, y, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(X));
  PetscCall(VecAssemblyEnd(X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode function(SNES snes, Vec X, Vec F, void *ctx)
{
  Problem *p = (Problem *)ctx;
  PetscReal x[2], g[2], E, H[4];
  PetscReal force = 0.;

  PetscFunctionBeginUser;
  (void)snes;
  PetscCall(get(X, x));
  (*p->energy)(p, x, &E, g, H);
  if (p->prescribed)
    repel(p, x, &E, &force, H);
  PetscCall(put(F, g[0] - force, p->prescribed ? 0. : g[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The exact Hessian, or with its diagonal made positive. */
static PetscErrorCode jacobian(SNES snes, Vec X, Mat J, Mat P, void *ctx)
{
  const Problem *p = (const Problem *)ctx;
  const PetscInt row[2] = {0, 1};
  PetscReal x[2], g[2], E, H[4];

  PetscFunctionBeginUser;
  (void)snes, (void)J;
  PetscCall(get(X, x));
  (*p->energy)(p, x, &E, g, H);
  if (p->filtered) {
    H[0] = PetscMax(PetscAbsReal(H[0]), 1e-3);
    H[3] = PetscAbsReal(H[3]);
  }
  PetscCall(MatSetValues(P, 2, row, 2, row, H, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode energy(void *ctx, Vec X, SbNewtonEnergy *value, Vec strain, Vec contact)
{
  Problem *p = (Problem *)ctx;
  PetscReal x[2], g[2], force, H[4];

  PetscFunctionBeginUser;
  PetscCall(get(X, x));
  (*p->energy)(p, x, &value->strain, g, H);
  PetscCall(put(strain, g[0], p->prescribed ? 0. : g[1]));
  value->ninverted = p->limit_energy && value->strain > VALLEY_HIGH;
  value->contact = 0.;
  if (p->prescribed) {
    repel(p, x, &value->contact, &force, H);
    PetscCall(put(contact, -force, 0.));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode filter(void *ctx, PetscBool filtered, PetscBool required)
{
  PetscFunctionBeginUser;
  (void)required;
  ((Problem *)ctx)->filtered = filtered;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the well's tangent, which `jacobian` assembled. */
static PetscErrorCode negative_eigenvalues(void *ctx, PetscInt *n)
{
  const Problem *p = (const Problem *)ctx;

  PetscFunctionBeginUser;
  *n = !p->filtered && p->load < 1. / 3.; /* `load` holds x^2 */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same energy, whose last tangent is remembered for the count above. */
static PetscErrorCode remember(SNES snes, Vec X, Mat J, Mat P, void *ctx)
{
  PetscReal x[2];

  PetscFunctionBeginUser;
  PetscCall(get(X, x));
  ((Problem *)ctx)->load = x[0] * x[0];
  PetscCall(jacobian(snes, X, J, P, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode interrupted(void *ctx, PetscBool *is)
{
  Problem *p = (Problem *)ctx;

  PetscFunctionBeginUser;
  *is = (PetscBool)(++p->calls == p->stop_at);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At most nine tenths of the gap are closed. */
static PetscErrorCode max_step(void *ctx, Vec X, Vec Y, PetscReal *part, PetscInt *nactive)
{
  PetscReal x[2], y[2];
  PetscReal gap, closed;

  PetscFunctionBeginUser;
  (void)ctx;
  PetscCall(get(X, x));
  PetscCall(get(Y, y));
  gap = x[0] - x[1];
  closed = y[0] - y[1];
  *part = closed > 0.9 * gap ? 0.9 * gap / closed : 1.;
  if (nactive)
    *nactive = gap - *part * closed < WIDTH;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode advance(void *ctx, PetscReal fraction)
{
  PetscFunctionBeginUser;
  (void)ctx, (void)fraction;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode prescribed_part(void *ctx, Vec D)
{
  PetscReal d[2];

  PetscFunctionBeginUser;
  (void)ctx;
  PetscCall(get(D, d));
  PetscCall(put(D, 0., d[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode inverted(void *ctx, Vec X, PetscReal *E, PetscInt *n)
{
  const Problem *p = (const Problem *)ctx;
  PetscReal x[2], g[2], H[4];

  PetscFunctionBeginUser;
  PetscCall(get(X, x));
  (*p->energy)(p, x, E, g, H);
  *n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode hessian(void *ctx, Vec X, Vec F, SbContactHessian kind, Vec rhs,
                              PetscInt *nblock)
{
  Problem *p = (Problem *)ctx;
  PetscReal x[2], E, force;

  PetscFunctionBeginUser;
  (void)kind; /* it is convex */
  PetscCall(get(X, x));
  repel(p, x, &E, &force, &p->H);
  *nblock = x[0] - x[1] < WIDTH;
  PetscCall(VecCopy(F, rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(void *ctx, Mat P, Vec rhs, Vec Y, KSPConvergedReason *reason,
                            PetscInt *iterations)
{
  const Problem *p = (const Problem *)ctx;
  PetscReal f[2];

  PetscFunctionBeginUser;
  (void)P;
  PetscCall(get(rhs, f));
  PetscCall(put(Y, f[0] / (SPRING + p->H), f[1]));
  *reason = KSP_CONVERGED_ITS;
  *iterations = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode step_tolerance(void *ctx, PetscReal *longest)
{
  PetscFunctionBeginUser;
  (void)ctx;
  *longest = 1e-9;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The spring's rest position follows half of the way to the particle and 1 m: x = 2 m in the
   end. */
static PetscErrorCode update_friction(void *ctx, Vec X, PetscBool solved, PetscBool *again)
{
  Problem *p = (Problem *)ctx;
  PetscReal x[2], next;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  if (!p->stop_at || !solved)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(get(X, x));
  next = 0.5 * x[0] + 1.;
  *again = (PetscBool)(PetscAbsReal(next - p->friction) > 1e-8);
  p->friction = next;
  p->updates++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver of the problem, and its first guess. */
static PetscErrorCode open(Problem *p, PetscReal x, PetscReal y, SNES *snes, Vec *X)
{
  Mat J;
  Vec F;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  p->least = PETSC_MAX_REAL;
  p->newton.energy = energy;
  p->newton.ctx = p;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 2, X));
  PetscCall(put(*X, x, y));
  PetscCall(VecDuplicate(*X, &F));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 2, 2, NULL, &J));
  PetscCall(SNESCreate(PETSC_COMM_SELF, snes));
  PetscCall(SNESSetType(*snes, SB_SNES_NEWTON));
  PetscCall(SNESSetFunction(*snes, F, function, p));
  PetscCall(SNESSetJacobian(*snes, J, J, p->newton.negative_eigenvalues ? remember : jacobian, p));
  PetscCall(SNESSetTolerances(*snes, 1e-12, 0., 0., SB_NEWTON_ITERATIONS, PETSC_MAX_INT));
  PetscCall(SNESGetKSP(*snes, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(SbNewtonSetProblem(*snes, &p->newton));
  PetscCall(VecDestroy(&F));
  PetscCall(MatDestroy(&J));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves from (x, y) to the solution in x. */
static PetscErrorCode minimise(Problem *p, PetscReal x[2], PetscInt *iterations,
                               SNESConvergedReason *reason, PetscBool *unstable)
{
  SNES snes;
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(open(p, x[0], x[1], &snes, &X));
  PetscCall(SNESSolve(snes, NULL, X));
  PetscCall(get(X, x));
  PetscCall(SNESGetIterationNumber(snes, iterations));
  PetscCall(SNESGetConvergedReason(snes, reason));
  PetscCall(SbNewtonUnstable(snes, unstable));
  PetscCall(VecDestroy(&X));
  PetscCall(SNESDestroy(&snes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A full step that raises the energy from 5 to 1400 is the fastest way through the valley. */
static PetscErrorCode check_valley(void)
{
  PetscInt iterations[2];
  SNESConvergedReason reason;
  PetscBool unstable;

  PetscFunctionBeginUser;
  for (int monotone = 0; monotone < 2; monotone++) {
    Problem p = {.energy = valley, .limit_energy = (PetscBool)monotone};
    PetscReal x[2] = {-1.2, 1.};

    PetscCall(minimise(&p, x, &iterations[monotone], &reason, &unstable));
    SB_CHECK(reason > 0, "valley: %s", SNESConvergedReasons[reason]);
    SB_CHECK_NEAR(x[0], 1., 1e-9, "x in the valley");
    SB_CHECK_NEAR(x[1], 1., 1e-9, "y in the valley");
    SB_CHECK(!unstable, "the valley has no indefinite tangent on the way");
  }
  test_print("  valley: %d iterations, %d without provisional steps\n", (int)iterations[0],
             (int)iterations[1]);
  SB_CHECK(iterations[0] <= 8, "%d iterations with provisional steps", (int)iterations[0]);
  SB_CHECK(iterations[1] >= 2 * iterations[0] && iterations[1] <= 40,
           "%d iterations without provisional steps", (int)iterations[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Between two wells: the saddle attracts exact tangents; the well is found with filtered ones,
   which need the count of negative eigenvalues where the direction descends. */
static PetscErrorCode check_two_wells(void)
{
  static const struct {
    PetscReal x, y; /* start */
    PetscBool filter, count;
    PetscReal end;
  } list[] = {{0.1, 0., PETSC_FALSE, PETSC_FALSE, 0.},
              {0.1, 0., PETSC_TRUE, PETSC_FALSE, 1.},
              {-0.1, 0., PETSC_TRUE, PETSC_FALSE, -1.},
              {1e-3, 1., PETSC_TRUE, PETSC_FALSE, 0.},
              {1e-3, 1., PETSC_TRUE, PETSC_TRUE, 1.}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(list); k++) {
    Problem p = {.energy = two_wells};
    PetscReal x[2] = {list[k].x, list[k].y};
    SNESConvergedReason reason;
    PetscBool unstable;
    PetscInt its;

    if (list[k].filter)
      p.newton.filter = filter;
    if (list[k].count)
      p.newton.negative_eigenvalues = negative_eigenvalues;
    PetscCall(minimise(&p, x, &its, &reason, &unstable));
    SB_CHECK(reason > 0, "wells, case %d: %s", (int)k, SNESConvergedReasons[reason]);
    SB_CHECK_NEAR(x[0], list[k].end, 1e-8, "x at the end");
    SB_CHECK_NEAR(x[1], 0., 1e-9, "y at the end");
    SB_CHECK(unstable || list[k].end == 0., "wells, case %d: an indefinite tangent was met",
             (int)k);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Beyond its limit load h^3 / (3 sqrt 3) a truss snaps to the only equilibrium, behind w = 2 h. */
static PetscErrorCode check_snap(void)
{
  const PetscReal limit = HEIGHT * HEIGHT * HEIGHT / (3. * PetscSqrtReal(3.));

  PetscFunctionBeginUser;
  for (int over = 0; over < 2; over++) {
    Problem p = {.energy = truss, .load = (over ? 1.01 : 0.8) * limit};
    PetscReal x[2] = {0., 0.};
    PetscReal E, g[2], H[4];
    SNESConvergedReason reason;
    PetscBool unstable;
    PetscInt its;

    p.newton.filter = filter;
    PetscCall(minimise(&p, x, &its, &reason, &unstable));
    test_print("  truss: deflection %g of its height after %d iterations\n",
               (double)(x[0] / HEIGHT), (int)its);
    truss(&p, x, &E, g, H);
    SB_CHECK(reason > 0, "truss: %s", SNESConvergedReasons[reason]);
    SB_CHECK_NEAR(g[0], 0., 1e-12, "force of the truss");
    SB_CHECK(H[0] > 0., "the truss is stable, stiffness %g", (double)H[0]);
    SB_CHECK(over == (x[0] > 2. * HEIGHT), "deflection %g of the height", (double)(x[0] / HEIGHT));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void add_barrier(Problem *p, Vec start)
{
  p->prescribed = PETSC_TRUE;
  p->barrier = (SbNewtonBarrier){.max_step = max_step,
                                 .advance = advance,
                                 .inverted = inverted,
                                 .hessian = hessian,
                                 .solve = solve,
                                 .step_tolerance = step_tolerance,
                                 .update_friction = update_friction,
                                 .start = start,
                                 .total_mass = 1.};
  p->newton.barrier = &p->barrier;
  p->newton.prescribed_part = prescribed_part;
  p->newton.dt = 1.;
}

/* A spring pulls a particle to a wall, that is at rest, comes nearer, or moves past where the
   particle was. */
static PetscErrorCode check_barrier(void)
{
  static const PetscReal wall[] = {0., 0.9, 4.};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(wall); k++) {
    Problem p = {.energy = particle, .load = -1.};
    SNESConvergedReason reason;
    PetscReal x[2], E, force, H;
    PetscInt its;
    SNES snes;
    Vec start, X;

    PetscCall(VecCreateSeq(PETSC_COMM_SELF, 2, &start));
    PetscCall(put(start, 1., 0.));
    add_barrier(&p, start);
    PetscCall(open(&p, 1., wall[k], &snes, &X));
    PetscCall(SNESSolve(snes, NULL, X));
    PetscCall(SNESGetConvergedReason(snes, &reason));
    PetscCall(SNESGetIterationNumber(snes, &its));
    PetscCall(get(X, x));
    test_print("  wall at %g m: gap %g m after %d iterations, the smallest %g m\n", (double)wall[k],
               (double)(x[0] - x[1]), (int)its, (double)p.least);
    SB_CHECK(reason > 0, "wall at %g: %s", (double)wall[k], SNESConvergedReasons[reason]);
    SB_CHECK(x[1] == wall[k], "the wall is at %g", (double)x[1]);
    SB_CHECK(p.least > 0., "smallest gap %g", (double)p.least);
    repel(&p, x, &E, &force, &H);
    SB_CHECK_NEAR(force, SPRING * (x[0] - p.load), 1e-9 * force, "force of the barrier");
    SB_CHECK(its <= 30, "%d iterations", (int)its);
    PetscCall(SNESDestroy(&snes));
    PetscCall(VecDestroy(&X));
    PetscCall(VecDestroy(&start));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Friction's lag: solved again until it stays, with the barrier far away. */
static PetscErrorCode check_friction(void)
{
  Problem p = {.energy = particle, .stop_at = -1};
  SNESConvergedReason reason;
  PetscReal x[2];
  SNES snes;
  Vec start, X;

  PetscFunctionBeginUser;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 2, &start));
  PetscCall(put(start, 1., -9.));
  add_barrier(&p, start);
  PetscCall(open(&p, 1., -9., &snes, &X));
  PetscCall(SNESSolve(snes, NULL, X));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  PetscCall(get(X, x));
  SB_CHECK(reason > 0, "friction: %s", SNESConvergedReasons[reason]);
  SB_CHECK_NEAR(x[0], 2., 1e-7, "fixed point of friction");
  SB_CHECK(p.updates > 20 && p.updates < 35, "%d updates", (int)p.updates); /* log2(1e8) = 27 */
  PetscCall(SNESDestroy(&snes));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A warm start takes the tolerance of the solve before, and an interruption ends it. */
static PetscErrorCode check_starts(void)
{
  Problem p = {.energy = two_wells};
  SNESConvergedReason reason;
  PetscInt its;
  SNES snes;
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(open(&p, 3., 0., &snes, &X));
  PetscCall(SNESSetTolerances(snes, 0., 0.05, 0., SB_NEWTON_ITERATIONS, PETSC_MAX_INT));
  PetscCall(SNESSolve(snes, NULL, X));
  for (int warm = 1; warm >= 0; warm--) {
    /* forces are 1.34 N here, 0.30 N and 0.04 N after the next steps; they were 24 N at (3, 0) */
    p.newton.warm_start = (PetscBool)warm;
    PetscCall(put(X, 1.4, 0.));
    PetscCall(SNESSolve(snes, NULL, X));
    PetscCall(SNESGetIterationNumber(snes, &its));
    SB_CHECK(its == (warm ? 1 : 2), "%d iterations after a start that is %s", (int)its,
             warm ? "warm" : "cold");
  }

  p.newton.interrupted = interrupted;
  p.stop_at = 2;
  PetscCall(put(X, 3., 0.));
  PetscCall(SNESSolve(snes, NULL, X));
  PetscCall(SNESGetIterationNumber(snes, &its));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  SB_CHECK(its == 1 && reason == SNES_DIVERGED_MAX_IT, "interrupted after %d: %s", (int)its,
           SNESConvergedReasons[reason]);
  PetscCall(SNESDestroy(&snes));
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SNESRegister(SB_SNES_NEWTON, SbNewtonCreate));
  PetscCall(check_valley());
  PetscCall(check_two_wells());
  PetscCall(check_snap());
  PetscCall(check_barrier());
  PetscCall(check_friction());
  PetscCall(check_starts());
  SB_TEST_END();
}
