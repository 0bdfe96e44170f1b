/*
  tet_near.c - places with finer tets: the option, its checks, and the size as a formula for gmsh.

  The edge length at a distance d from a place is h + GROWTH d, up to that of the other tets; of
  several places the least one counts. d is the distance from a box, less the radius; a sphere is a
  box without edges.
*/
#include "surface_impl.h"

/* Increase of the edge length per distance: that of neighbouring tets differs by about a quarter,
   and the quality stays that of tets of one size (tests/verify/tet_near.py). */
#define GROWTH 0.25

PetscErrorCode SbTetNearRead(const SbScope *scope, const char *key, SbTetOptions *o)
{
  char text[1024] = "";
  char option[SB_NAME_MAX * 3];

  PetscFunctionBeginUser;
  PetscCall(SbOptionString(scope, key, sizeof(text), text));
  SbOptionName(scope, key, sizeof(option), option);
  o->nnear = 0;
  for (char *at = text, *next; at[0]; at = next) {
    SbTetNear *near = &o->near[o->nnear];
    PetscReal p[7];
    PetscBool sphere, box;

    next = at + strcspn(at, ";");
    if (*next)
      *next++ = 0;
    at += strspn(at, " ");
    PetscCheck(o->nnear < SB_TET_NEAR_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: more than %d places", option, SB_TET_NEAR_MAX);
    sphere = (PetscBool)(!strncmp(at, "sphere:", 7) && SbParseNumbers(at + 7, 5, p) == 5);
    box = (PetscBool)(!strncmp(at, "box:", 4) && SbParseNumbers(at + 4, 7, p) == 7);
    PetscCheck(sphere || box, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s '%s': write sphere:x,y,z,r,size or box:x0,y0,z0,x1,y1,z1,size (m), several "
               "separated by semicolons",
               option, at);
    PetscCheck(p[sphere ? 4 : 6] > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s '%s': the size %g m is not above 0 m", option, at, (double)p[sphere ? 4 : 6]);
    PetscCheck(!sphere || p[3] >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s '%s': the radius %g m is below 0 m", option, at, (double)p[3]);
    PetscCheck(!box || (p[0] <= p[3] && p[1] <= p[4] && p[2] <= p[5]), PETSC_COMM_SELF,
               PETSC_ERR_USER_INPUT,
               "%s '%s': the first corner must lie below the second in x, y and z", option, at);
    near->size = p[sphere ? 4 : 6];
    near->radius = sphere ? p[3] : 0;
    for (int i = 0; i < 3; i++) {
      near->x[i] = sphere ? p[i] : (p[i] + p[3 + i]) / 2;
      near->half[i] = sphere ? 0 : (p[3 + i] - p[i]) / 2;
      for (int j = 0; j < 3; j++)
        near->axes[i][j] = i == j;
    }
    o->nnear++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTetNearCheck(const SbTetJob *job, PetscReal volume, PetscReal *expected)
{
  const SbSurface *s = job->surface;
  char option[SB_IMPORT_OPTION_MAX], size[SB_IMPORT_OPTION_MAX];
  PetscReal box[6];

  PetscFunctionBeginUser;
  (void)SbImportOption(job->body, "tet_near", option);
  SbBoxClear(box);
  for (PetscInt v = 0; v < s->nvert; v++)
    SbBoxAdd(box, s->x + 3 * v);
  for (PetscInt k = 0; k < job->options.nnear; k++) {
    const SbTetNear *near = &job->options.near[k];
    PetscReal own = 4 * PETSC_PI / 3 * near->radius * near->radius * near->radius;

    own = PetscMin(volume, PetscMax(own, 8 * near->half[0] * near->half[1] * near->half[2]));
    *expected += 6 * PETSC_SQRT2 * own / (near->size * near->size * near->size);
    PetscCheck(near->size < job->size, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: %s: place %" PetscInt_FMT
               " has tets of size %g m, which is not below the %g m of the others (%s)",
               job->where, option, k + 1, (double)near->size, (double)job->size,
               SbImportOption(job->body, "tet_size", size));
    for (int i = 0; i < 3; i++) {
      PetscReal reach = near->radius;

      for (int a = 0; a < 3; a++)
        reach += PetscAbsReal(near->axes[a][i]) * near->half[a];
      PetscCheck(near->x[i] + reach >= box[i] && near->x[i] - reach <= box[3 + i], PETSC_COMM_SELF,
                 PETSC_ERR_USER_INPUT,
                 "%s: %s: place %" PetscInt_FMT
                 " lies outside of the body: its middle is (%.4g, %.4g, %.4g) m, and the surface "
                 "goes from (%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g) m, both before the body is "
                 "rotated and translated",
                 job->where, option, k + 1, (double)near->x[0], (double)near->x[1],
                 (double)near->x[2], (double)box[0], (double)box[1], (double)box[2], (double)box[3],
                 (double)box[4], (double)box[5]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbTetNearFormula(const SbTetOptions *o, size_t size, char text[])
{
  text[0] = 0;
  for (PetscInt k = 0; k < o->nnear; k++) {
    const SbTetNear *near = &o->near[k];

    // min(a, min(b, c))
    SbAppend(size, text, k + 1 < o->nnear ? "%sMin(%.17g+%g*Max(0,Sqrt(" : "%s%.17g+%g*Max(0,Sqrt(",
             k ? "," : "", (double)near->size, GROWTH);
    for (int i = 0; i < 3; i++)
      SbAppend(size, text,
               "%sMax(0,Abs((%.17g)*(x-(%.17g))+(%.17g)*(y-(%.17g))+(%.17g)*(z-(%.17g)))-%.17g)^2",
               i ? "+" : "", (double)near->axes[i][0], (double)near->x[0], (double)near->axes[i][1],
               (double)near->x[1], (double)near->axes[i][2], (double)near->x[2],
               (double)near->half[i]);
    SbAppend(size, text, ")-%.17g)", (double)near->radius);
  }
  for (PetscInt k = 1; k < o->nnear; k++)
    SbAppend(size, text, ")");
}
