/*
  tet_nearest.c - which triangle of a surface lies nearest to the middle of each new one: so groups survive when a surface is remeshed.
*/
#include "tet_backends.h"

PetscErrorCode SbTetNearest(const SbSurface *s, SbItems *tri, const PetscReal x[])
{
  PetscReal(*box)[6];
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->ntri, &box));
  for (PetscInt f = 0; f < s->ntri; f++) SbTriangleBox(s->x, s->tri + 3 * f, box[f]);
  PetscCall(SbBoxTreeCreate(s->ntri, (const PetscReal(*)[6])box, &tree));
  for (PetscInt i = 0, f; i < tri->n; i++) {
    const PetscInt *v = tri->vert + 3 * i;
    PetscReal middle[6];
    SbBoxNearest nearest;

    for (int k = 0; k < 6; k++)
      middle[k] = (x[3 * v[0] + k % 3] + x[3 * v[1] + k % 3] + x[3 * v[2] + k % 3]) / 3;
    tri->tags[i] = 0;
    // of equally near ones the first
    for (SbBoxNearestBegin(&tree, middle, PETSC_MAX_REAL, &nearest); SbBoxNearestNext(&nearest, &f);) {
      const PetscInt *c = s->tri + 3 * f;
      const PetscReal *const corner[3] = {s->x + 3 * c[0], s->x + 3 * c[1], s->x + 3 * c[2]};
      PetscReal w[3], d2;

      (void)SbTriangleClosestPoint(middle, corner, w, &d2);
      if (d2 > nearest.limit2 || (d2 == nearest.limit2 && f > tri->tags[i])) continue;
      nearest.limit2 = d2;
      tri->tags[i] = f;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}
