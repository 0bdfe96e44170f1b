/*
  Negative eigenvalues of a symmetric matrix K that is known by its product, by Lanczos' method for
  the pencil K x = l M x. M is symmetric positive definite and known by its inverse: a
  preconditioner, or the factor of a matrix near K. By Sylvester's law the pencil has as many
  negative eigenvalues as K, and a good M has all others near 1, so that few products and solves
  find the lowest one: of a factor of the last Newton step about six.

    q_1 from the start, |q|_M = 1;  w = K q_k - a_k M q_k - b_k-1 M q_k-1,  q_k+1 = M^-1 w / b_k

  (Parlett, The Symmetric Eigenvalue Problem, 1998, chapter 13). The lowest eigenvalue l of the
  tridiagonal matrix (a, b), with the eigenvector s, is not below the lowest of K and M, and b_k
  |s_k| away from one of their eigenvalues at most. Vectors are not kept: once l is known to be
  negative the recurrence runs again and sums the mode, X = sum s_k q_k. Loss of orthogonality
  repeats eigenvalues that have converged, which does not matter to the lowest one.

  A mode counts as negative if x . K x is, beyond the rounding of sums over the unknowns. The next
  ones are found in the same way M-orthogonal to those before, each from a start of its own: one
  start has a part along one direction only of the modes of equal eigenvalues.
*/
#include "sbsolver.h"

#define FIRST 6        /* least number of steps */
#define LARGEST 1000   /* and most */
#define CLOSE 0.1      /* error of the lowest eigenvalue over its size, for its sign to be known */
#define CONVERGED 1e-2 /* the same for a mode */
#define EXACT 1e-13    /* error over the largest eigenvalue that is rounding */
#define ROUNDING 1e-13 /* x . K x over x . |D| x, D the diagonal of K, that is no evidence */

typedef struct {
  const SbPencil *p;
  Vec start;             /* right-hand side of the first vector */
  Vec before, now, w, q; /* M q_k-1, M q_k; w as above; q_k */
  Vec *mode, *dual;      /* negative modes and M times them */
  PetscInt nmode;
  PetscInt k;                       /* steps */
  PetscReal a[LARGEST], b[LARGEST]; /* the tridiagonal matrix */
  PetscReal s[LARGEST];             /* eigenvector of its lowest eigenvalue */
  PetscReal lowest, error;          /* that eigenvalue, and how far away one of K and M may be */
  PetscReal top;                    /* largest |a|, |b| */
  PetscInt solves;
  PetscBool definite; /* M is, as far as it was seen */
} Lanczos;

/* w <- w - sum (mode . w) dual: M^-1 w becomes M-orthogonal to the modes found so far. */
static PetscErrorCode deflate(Lanczos *z, Vec w)
{
  PetscReal part;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < z->nmode; i++) {
    PetscCall(VecDot(z->mode[i], w, &part));
    PetscCall(VecAXPY(w, -part, z->dual[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* q <- M^-1 w, b = |q|_M, 0 where nothing is left but rounding (of `first`). */
static PetscErrorCode solve(Lanczos *z, PetscReal first, PetscReal *b)
{
  PetscReal square;

  PetscFunctionBeginUser;
  PetscCall(deflate(z, z->w));
  PetscCall((*z->p->solve)(z->p->ctx, z->w, z->q));
  PetscCall(VecDot(z->w, z->q, &square));
  z->solves++;
  *b = square > 0. ? PetscSqrtReal(square) : 0.;
  if (!(square >= -EXACT * PetscSqr(first)) || PetscIsInfOrNanReal(square))
    z->definite = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pivots d[k] of the tridiagonal matrix less x; whether all are positive. */
static PetscBool factor(const Lanczos *z, PetscReal x, PetscReal d[])
{
  for (PetscInt i = 0; i < z->k; i++) {
    d[i] = z->a[i] - x - (i ? PetscSqr(z->b[i - 1]) / d[i - 1] : 0.);
    if (!(d[i] > 0.))
      return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The lowest eigenvalue of the tridiagonal matrix of k steps by bisection, its vector by inverse
   iteration, its error. */
static void find_lowest(Lanczos *z)
{
  const PetscInt n = z->k;
  PetscReal below = z->a[0];
  PetscReal above = z->a[0];
  PetscReal d[LARGEST], size;

  /* by Gershgorin: between these */
  z->top = 0.;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal off = (i ? z->b[i - 1] : 0.) + (i < n - 1 ? z->b[i] : 0.);

    below = PetscMin(below, z->a[i] - off);
    above = PetscMin(above, z->a[i]);
    z->top = PetscMax(z->top, PetscMax(PetscAbsReal(z->a[i]), z->b[i]));
  }
  below -= PETSC_MACHINE_EPSILON * z->top;
  while (above - below > 4. * PETSC_MACHINE_EPSILON * z->top) {
    const PetscReal x = 0.5 * (below + above);

    if (factor(z, x, d))
      below = x;
    else
      above = x;
  }
  z->lowest = above;
  for (size = PetscMax(PETSC_MACHINE_EPSILON * z->top, PETSC_MIN_REAL); !factor(z, below, d);
       size *= 2.)
    below -= size;

  /* inverse iteration with the definite matrix just below, which is all but singular */
  for (PetscInt i = 0; i < n; i++)
    z->s[i] = 1.;
  for (int pass = 0; pass < 3; pass++) {
    for (PetscInt i = 1; i < n; i++)
      z->s[i] -= z->b[i - 1] / d[i - 1] * z->s[i - 1];
    for (PetscInt i = n - 1; i >= 0; i--)
      z->s[i] = (z->s[i] - (i < n - 1 ? z->b[i] * z->s[i + 1] : 0.)) / d[i];
    size = 0.;
    for (PetscInt i = 0; i < n; i++)
      size += PetscSqr(z->s[i]);
    for (PetscInt i = 0; i < n; i++)
      z->s[i] /= PetscSqrtReal(size);
  }
  z->error = z->b[n - 1] * PetscAbsReal(z->s[n - 1]);
}

/* Whether the lowest eigenvalue is known well enough. */
static PetscBool is_known(const Lanczos *z)
{
  const PetscReal close = z->lowest < 0. ? CONVERGED : CLOSE;

  return (PetscBool)(z->error <= PetscMax(close * PetscAbsReal(z->lowest), EXACT * z->top));
}

/* The recurrence. sum, dual: NULL, and it ends when the lowest eigenvalue is known, or after
   LARGEST steps; else it repeats the k steps, and they become the mode and M times it. */
static PetscErrorCode iterate(Lanczos *z, Vec sum, Vec dual, PetscBool *known)
{
  const PetscInt most = sum ? z->k : LARGEST;
  PetscInt next = FIRST;
  PetscReal first, b;

  PetscFunctionBeginUser;
  *known = PETSC_FALSE;
  PetscCall(VecCopy(z->start, z->w));
  PetscCall(VecZeroEntries(z->before));
  PetscCall(solve(z, 0., &first));
  b = first;
  for (z->k = 0; z->k < most && b > 0. && z->definite;) {
    const PetscReal last = z->k ? b : 0.;

    /* q_k, M q_k */
    PetscCall(VecScale(z->q, 1. / b));
    PetscCall(VecCopy(z->w, z->now));
    PetscCall(VecScale(z->now, 1. / b));
    if (sum) {
      PetscCall(VecAXPY(sum, z->s[z->k], z->q));
      PetscCall(VecAXPY(dual, z->s[z->k], z->now));
    }

    /* w, the next row of the tridiagonal matrix */
    PetscCall((*z->p->multiply)(z->p->ctx, z->q, z->w));
    PetscCall(VecAXPY(z->w, -last, z->before));
    PetscCall(VecDot(z->q, z->w, &z->a[z->k]));
    PetscCall(VecAXPY(z->w, -z->a[z->k], z->now));
    PetscCall(VecCopy(z->now, z->before));
    PetscCall(solve(z, 1., &b));
    if (PetscIsInfOrNanReal(b) || PetscIsInfOrNanReal(z->a[z->k]))
      z->definite = PETSC_FALSE;
    z->b[z->k++] = b;
    if (sum || !z->definite || (z->k < next && b > 0. && z->k < most))
      continue;
    find_lowest(z);
    *known = (PetscBool)(b == 0. || is_known(z));
    if (*known)
      break;
    next = z->k + PetscMax(2, z->k / 8);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether x . K x is negative beyond rounding; scale: |D|. */
static PetscErrorCode is_negative(Lanczos *z, Vec x, Vec scale, PetscBool *is)
{
  PetscReal energy, size;

  PetscFunctionBeginUser;
  PetscCall((*z->p->multiply)(z->p->ctx, x, z->w));
  PetscCall(VecDot(x, z->w, &energy));
  PetscCall(VecPointwiseMult(z->w, scale, x));
  PetscCall(VecDot(x, z->w, &size));
  *is = (PetscBool)(energy < -ROUNDING * size);
  PetscCall(PetscInfo(NULL,
                      "lowest eigenvalue %g of the preconditioned matrix, %g of its diagonal, "
                      "after %" PetscInt_FMT " steps\n",
                      (double)z->lowest, (double)(energy / size), z->k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNegativeModes(const SbPencil *pencil, Vec scale, PetscInt most, Vec mode,
                               SbInertia *found)
{
  PetscBool known = PETSC_TRUE;
  PetscBool negative = PETSC_TRUE;
  Lanczos *z;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&z));
  z->p = pencil;
  z->definite = PETSC_TRUE;
  for (Vec *v[] = {&z->start, &z->before, &z->now, &z->w, &z->q, NULL}, **at = v; *at; at++)
    PetscCall(VecDuplicate(scale, *at));
  PetscCall(VecDuplicateVecs(scale, most, &z->mode));
  PetscCall(VecDuplicateVecs(scale, most, &z->dual));
  while (z->nmode < most && known && negative) {
    Vec x = z->mode[z->nmode];
    Vec dual = z->dual[z->nmode];
    PetscBool repeated;
    PetscReal square;

    PetscCall((*pencil->start)(pencil->ctx, z->nmode, z->start));
    PetscCall(iterate(z, NULL, NULL, &known));
    negative = (PetscBool)(known && z->definite && z->k && z->lowest < 0.);
    if (!negative)
      break;
    PetscCall(VecZeroEntries(x));
    PetscCall(VecZeroEntries(dual));
    PetscCall(iterate(z, x, dual, &repeated));
    PetscCall(VecDot(x, dual, &square)); /* 1, but for the loss of orthogonality */
    PetscCall(VecScale(x, 1. / PetscSqrtReal(square)));
    PetscCall(VecScale(dual, 1. / PetscSqrtReal(square)));
    PetscCall(is_negative(z, x, scale, &negative));
    if (!negative)
      break;
    if (!z->nmode)
      PetscCall(VecCopy(x, mode));
    z->nmode++;
  }
  *found = (SbInertia){.negative = z->nmode,
                       .more = (PetscBool)(z->nmode == most),
                       .known = (PetscBool)(known && z->definite),
                       .definite = z->definite,
                       .solves = z->solves};
  PetscCall(VecDestroyVecs(most, &z->mode));
  PetscCall(VecDestroyVecs(most, &z->dual));
  for (Vec *v[] = {&z->start, &z->before, &z->now, &z->w, &z->q, NULL}, **at = v; *at; at++)
    PetscCall(VecDestroy(*at));
  PetscCall(PetscFree(z));
  PetscFunctionReturn(PETSC_SUCCESS);
}
