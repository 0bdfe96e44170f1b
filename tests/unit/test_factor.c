// @ranks 1
/*
  The factor in 16-bit integers against dense linear algebra: solves, Schur complement of kept
  nodes, disconnected parts, a matrix that is not positive definite. Rounding the columns to 1.5e-5
  of their largest entry gives errors of that size times the condition number of the factor, here
  about 3: 2e-4 is allowed.
*/
#include "sbfactor.h"
#include <test.h>
#include <petscblaslapack.h>

typedef struct {
  PetscInt n, nkeep, *ia, *ja; /* full graph; the factor reads the rows of the free nodes */
  PetscReal *block, *dense;    /* [ia[n]][9]; [3n][3n] */
} Problem;

/* Two nodes are connected if they are neighbours in a grid of nx x ny x nz nodes that is
   disconnected every `gap` layers. */
static PetscBool joined(const PetscInt d[3], PetscInt gap, PetscInt i, PetscInt j)
{
  const PetscInt p[3] = {i % d[0], i / d[0] % d[1], i / (d[0] * d[1])};
  const PetscInt q[3] = {j % d[0], j / d[0] % d[1], j / (d[0] * d[1])};

  for (int k = 0; k < 3; k++)
    if (PetscAbsInt(p[k] - q[k]) > 1)
      return PETSC_FALSE;
  return (PetscBool)(!gap || p[2] / gap == q[2] / gap);
}

static PetscErrorCode make_problem(const PetscInt d[3], PetscInt gap, PetscInt nkeep,
                                   PetscRandom random, Problem *p)
{
  const PetscInt n = d[0] * d[1] * d[2];

  PetscFunctionBeginUser;
  p->n = n;
  p->nkeep = nkeep;
  PetscCall(PetscMalloc2(n + 1, &p->ia, 27 * n, &p->ja));
  PetscCall(PetscMalloc2(9 * 27 * n, &p->block, 9 * n * n, &p->dense));
  PetscCall(PetscArrayzero(p->dense, 9 * n * n));
  p->ia[0] = 0;
  for (PetscInt i = 0; i < n; i++) {
    p->ia[i + 1] = p->ia[i];
    for (PetscInt j = 0; j < n; j++)
      if (joined(d, gap, i, j))
        p->ja[p->ia[i + 1]++] = j;
  }

  /* off-diagonal entries in (-1, 1), with a dominant diagonal */
  for (PetscInt i = 0; i < 3 * n; i++) {
    for (PetscInt j = 0; j < i; j++) {
      if (!joined(d, gap, i / 3, j / 3))
        continue;
      PetscCall(PetscRandomGetValue(random, &p->dense[i * 3 * n + j]));
      p->dense[j * 3 * n + i] = p->dense[i * 3 * n + j];
      p->dense[i * 3 * n + i] += PetscAbsReal(p->dense[i * 3 * n + j]);
      p->dense[j * 3 * n + j] += PetscAbsReal(p->dense[i * 3 * n + j]);
    }
    p->dense[i * 3 * n + i] += 1.;
  }
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt k = p->ia[i]; k < p->ia[i + 1]; k++)
      for (PetscInt e = 0; e < 9; e++)
        p->block[9 * k + e] = p->dense[(3 * i + e / 3) * 3 * n + 3 * p->ja[k] + e % 3];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves A x = b with known x; the dense Schur complement solves for the kept nodes. */
static PetscErrorCode check_solve(const Problem *p, PetscRandom random, const char *name)
{
  const PetscInt n = 3 * p->n;
  const PetscInt m = 3 * p->nkeep;
  const PetscInt free = n - m;
  PetscReal *schur, *x;
  PetscReal error = 0.;
  PetscReal size = 0.;
  float *b, *kept, *y;
  PetscBLASInt bm;
  PetscBLASInt one = 1;
  PetscBLASInt info;
  SbFactor f;
  SbFactor old = NULL;
  PetscBool ok;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(m * m + 1, &schur, n, &x, n, &b, n, &y));
  PetscCall(PetscMalloc1(m + 1, &kept));
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt j = 0; j < m; j++)
      schur[i * m + j] = p->dense[(free + i) * n + free + j];
  PetscCall(SbFactorCreate(p->n, p->nkeep, p->ia, p->ja, NULL, &f));
  for (int again = 0; again < 2; again++) {
    PetscReal *work = NULL;

    /* the second call must not add to the first result */
    PetscCall(PetscMalloc1(m * m + 1, &work));
    PetscCall(PetscArraycpy(work, schur, m * m));
    PetscCall(SbFactorNumeric(f, p->ia, p->ja, p->block, work, &ok));
    SB_CHECK(ok, "%s: not positive definite", name);
    if (again)
      PetscCall(PetscArraycpy(schur, work, m * m));
    PetscCall(PetscFree(work));
  }
  for (PetscInt i = 0; i < n; i++)
    PetscCall(PetscRandomGetValue(random, &x[i]));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal sum = 0.;

    for (PetscInt j = 0; j < n; j++)
      sum += p->dense[i * n + j] * x[j];
    b[i] = (float)sum;
  }
  SbFactorForward(f, b, kept);
  if (m) {
    PetscReal *k;

    PetscCall(PetscMalloc1(m, &k));
    for (PetscInt i = 0; i < m; i++)
      k[i] = kept[i];
    PetscCall(PetscBLASIntCast(m, &bm));
    PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &bm, schur, &bm, &info));
    SB_CHECK(info == 0, "%s: Schur complement is not positive definite", name);
    PetscCallBLAS("LAPACKpotrs", LAPACKpotrs_("L", &bm, &one, schur, &bm, k, &bm, &info));
    for (PetscInt i = 0; i < m; i++)
      kept[i] = (float)k[i];
    PetscCall(PetscFree(k));
  }
  SbFactorBackward(f, kept, y);
  for (PetscInt i = 0; i < n; i++) {
    error = PetscMax(error, PetscAbsReal(y[i] - x[i]));
    size = PetscMax(size, PetscAbsReal(x[i]));
  }
  SB_CHECK(error < 2e-4 * size, "%s: error %g of %g", name, error, size);
  PetscCall(SbFactorDestroy(&f));

  /* stored in full: exact up to rounding, with its own order and with that of another factor, in
     place */
  for (int given = 0; given < 2 && !m; given++) {
    PetscReal *z;

    PetscCall(PetscMalloc1(n, &z));
    PetscCall(SbFactorCreate(p->n, SB_FACTOR_EXACT, p->ia, p->ja, old, &f));
    PetscCall(SbFactorNumeric(f, p->ia, p->ja, p->block, NULL, &ok));
    SB_CHECK(ok, "%s: not positive definite when kept as it is", name);
    for (PetscInt i = 0; i < n; i++) {
      z[i] = 0.;
      for (PetscInt j = 0; j < n; j++)
        z[i] += p->dense[i * n + j] * x[j];
    }
    PetscCall(SbFactorSolve(f, z, z));
    for (PetscInt i = 0; i < n; i++)
      SB_CHECK_NEAR(z[i], x[i], 1e-9 * size, name);
    PetscCall(SbFactorDestroy(&old));
    old = f;
    PetscCall(PetscFree(z));
  }
  PetscCall(SbFactorDestroy(&old));
  PetscCall(PetscFree(kept));
  PetscCall(PetscFree4(schur, x, b, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exact Schur complement (in doubles): A_kk - A_ki A_ii^-1 A_ik by dense elimination. */
static PetscErrorCode check_schur(Problem *p)
{
  const PetscInt n = 3 * p->n;
  const PetscInt m = 3 * p->nkeep;
  const PetscInt free = n - m;
  PetscReal *mine;
  PetscReal error = 0.;
  SbFactor f;
  PetscBool ok;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m * m, &mine));
  for (PetscInt i = 0; i < m * m; i++)
    mine[i] = p->dense[(free + i / m) * n + free + i % m];
  PetscCall(SbFactorCreate(p->n, p->nkeep, p->ia, p->ja, NULL, &f));
  PetscCall(SbFactorNumeric(f, p->ia, p->ja, p->block, mine, &ok));
  PetscCall(SbFactorDestroy(&f));
  for (PetscInt k = 0; k < free; k++) {
    for (PetscInt i = k + 1; i < n; i++) {
      const PetscReal l = p->dense[i * n + k] / p->dense[k * n + k];

      for (PetscInt j = k + 1; j < n && l != 0.; j++)
        p->dense[i * n + j] -= l * p->dense[k * n + j];
    }
  }
  for (PetscInt j = 0; j < m; j++)
    for (PetscInt i = j; i < m; i++)
      error = PetscMax(error, PetscAbsReal(mine[j * m + i] - p->dense[(free + i) * n + free + j]));
  SB_CHECK(error < 1e-11, "Schur complement is off by %g", error);
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_indefinite(Problem *p)
{
  SbFactor f;
  PetscBool ok = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(SbFactorCreate(p->n, 0, p->ia, p->ja, NULL, &f));
  for (PetscInt k = p->ia[5]; k < p->ia[6]; k++)
    if (p->ja[k] == 5)
      p->block[9 * k] = -1.;
  PetscCall(SbFactorNumeric(f, p->ia, p->ja, p->block, NULL, &ok));
  SB_CHECK(!ok, "an indefinite matrix was factored");
  PetscCall(SbFactorDestroy(&f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const struct {
    PetscInt d[3], gap, nkeep;
    const char *name;
    PetscErrorCode (*check)(Problem *); /* after the solve; NULL: none */
  } cases[] = {{{1, 1, 1}, 0, 0, "one node", NULL},
               {{4, 3, 2}, 0, 5, "small, five kept", check_schur},
               {{6, 6, 6}, 0, 0, "cube", check_indefinite},
               {{6, 6, 6}, 0, 36, "cube, a layer kept", check_schur},
               {{6, 6, 6}, 2, 40, "three slabs, the last one kept", NULL},
               {{4, 3, 2}, 1, 24, "all kept", NULL}};
  PetscRandom random;
  Problem p;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetInterval(random, -1., 1.));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    PetscCall(make_problem(cases[k].d, cases[k].gap, cases[k].nkeep, random, &p));
    PetscCall(check_solve(&p, random, cases[k].name));
    if (cases[k].check)
      PetscCall((*cases[k].check)(&p));
    PetscCall(PetscFree2(p.ia, p.ja));
    PetscCall(PetscFree2(p.block, p.dense));
  }
  PetscCall(PetscRandomDestroy(&random));
  SB_TEST_END();
}
