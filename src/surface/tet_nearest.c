/*
  tet_nearest.c - which triangle of a surface lies nearest to the middle of each new one: so groups survive when a surface is remeshed.

  A tree of boxes is asked with a box that grows until it holds the nearest one.
*/
#include "sbkernel.h"
#include "tet_backends.h"

typedef struct {
  const SbSurface *s;
  const PetscReal *p; /* [3] */
  PetscReal best;     /* distance squared */
  PetscInt triangle;
} Search;

/* Distance squared of p from the segment from a to b. */
static PetscReal from_segment(const PetscReal p[3], const PetscReal a[3], const PetscReal b[3])
{
  const PetscReal u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]},
                  w[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
  const PetscReal uu = SbDot3(u, u), t = uu > 0 ? PetscMin(PetscMax(SbDot3(u, w) / uu, 0), 1) : 0;
  const PetscReal d[3] = {w[0] - t * u[0], w[1] - t * u[1], w[2] - t * u[2]};

  return SbDot3(d, d);
}

/* Distance squared of p from a triangle: from its plane above the inside, else from its edges. */
static PetscReal from_triangle(const SbSurface *s, PetscInt f, const PetscReal p[3])
{
  const PetscReal *x[3];
  PetscReal e[3][3], n[3], w[3], least = PETSC_MAX_REAL, nn;
  PetscBool inside = PETSC_TRUE;

  for (int k = 0; k < 3; k++) x[k] = s->x + 3 * s->tri[3 * f + k];
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++) e[k][i] = x[(k + 1) % 3][i] - x[k][i];
  }
  SbCross(e[0], e[1], n);
  nn = SbDot3(n, n);
  for (int k = 0; k < 3; k++) {
    PetscReal in[3];
    const PetscReal l2 = from_segment(p, x[k], x[(k + 1) % 3]);

    least = PetscMin(least, l2);
    SbCross(n, e[k], in);
    for (int i = 0; i < 3; i++) w[i] = p[i] - x[k][i];
    inside = (PetscBool)(inside && SbDot3(in, w) >= 0);
  }
  if (inside && nn > 0) return SbDot3(n, w) * SbDot3(n, w) / nn;
  return least;
}

static PetscErrorCode try_triangle(void *ctx, PetscInt f)
{
  Search *search = (Search *)ctx;
  const PetscReal d2 = from_triangle(search->s, f, search->p);

  PetscFunctionBeginUser;
  if (d2 < search->best || (d2 == search->best && f < search->triangle)) {
    search->best = d2;
    search->triangle = f;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTetNearest(const SbSurface *s, SbItems *tri, const PetscReal x[])
{
  PetscReal(*box)[6];
  SbBoxTree tree;
  Search search = {.s = s};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->ntri, &box));
  for (PetscInt f = 0; f < s->ntri; f++) SbTriangleBox(s->x, s->tri + 3 * f, box[f]);
  PetscCall(SbBoxTreeCreate(s->ntri, (const PetscReal(*)[6])box, &tree));
  for (PetscInt i = 0; i < tri->n; i++) {
    const PetscInt *v = tri->vert + 3 * i;
    PetscReal middle[3], own[6];
    PetscReal reach;

    SbTriangleBox(x, v, own);
    for (int k = 0; k < 3; k++) middle[k] = (x[3 * v[0] + k] + x[3 * v[1] + k] + x[3 * v[2] + k]) / 3;
    search.p = middle;
    // the box begins with the size of the new triangle and doubles; what it finds within its half width is nearest
    reach = PetscMax(own[3] - own[0], PetscMax(own[4] - own[1], own[5] - own[2]));
    search.best = PETSC_MAX_REAL;
    search.triangle = 0;
    for (int tries = 0; tries < 60; tries++, reach *= 2) {
      PetscReal query[6];

      for (int k = 0; k < 3; k++) {
        query[k] = search.p[k] - reach;
        query[3 + k] = search.p[k] + reach;
      }
      PetscCall(SbBoxTreeVisit(&tree, query, try_triangle, &search));
      if (search.best <= reach * reach) break;
    }
    tri->tags[i] = search.triangle;
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}
