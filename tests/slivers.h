/*
  slivers.h - a box of tets with a given fraction of slivers of a given smallest dihedral angle.

  Interior vertices without common tets are moved, each in a random direction, until the first of
  its tets has the angle; vertices are taken in random order until the fraction is reached. No tet
  is inverted.
*/
#pragma once
#include "verify/verify.h"

typedef struct {
  PetscInt n[3];     /* numbers of cells */
  PetscReal size[3]; /* side lengths, m */
  PetscReal part;    /* fraction of slivers, at most 0.01 */
  PetscReal degrees; /* smallest dihedral angle of the slivers */
} Slivers;

/* Smallest dihedral angle in degrees of a tet with the corners x[v[a]], negative if it is
   inverted. */
static inline PetscReal slivers_angle(const PetscReal x[], const PetscInt v[4])
{
  PetscReal e[3][3], normal[4][3];
  PetscReal most = -1.;
  PetscReal det = 0.;

  for (int a = 0; a < 3; a++)
    for (int k = 0; k < 3; k++)
      e[a][k] = x[3 * v[a + 1] + k] - x[3 * v[0] + k];
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3;
    const int j = (k + 2) % 3;

    for (int a = 0; a < 3; a++) {
      const PetscReal *p = e[(a + 1) % 3];
      const PetscReal *q = e[(a + 2) % 3];

      normal[a + 1][k] = q[i] * p[j] - q[j] * p[i];
    }
    normal[0][k] = -normal[1][k] - normal[2][k] - normal[3][k];
    det -= e[0][k] * normal[1][k];
  }
  for (int a = 0; a < 4; a++) {
    for (int b = 0; b < a; b++) {
      PetscReal aa = 0.;
      PetscReal bb = 0.;
      PetscReal ab = 0.;

      for (int k = 0; k < 3; k++) {
        aa += normal[a][k] * normal[a][k];
        bb += normal[b][k] * normal[b][k];
        ab += normal[a][k] * normal[b][k];
      }
      most = PetscMax(most, -ab / PetscSqrtReal(aa * bb));
    }
  }
  return (det > 0. ? 180. : -180.) / PETSC_PI * acos(PetscMin(1., most));
}

/* Smallest angle of the tets at vertex at[3], and number of those within a hundredth of
   `degrees`. */
static inline PetscReal slivers_star(const Slivers *s, const PetscInt at[3], const PetscReal x[],
                                     PetscInt *count)
{
  const PetscInt vertex = verify_vertex(s->n, at);
  PetscReal least = 180.;

  *count = 0;
  for (int cell = 0; cell < 8; cell++) {
    const PetscInt c[3] = {at[0] - (cell & 1), at[1] - (cell >> 1 & 1), at[2] - (cell >> 2)};

    for (int w = 0; w < 6; w++) {
      PetscInt v[4];
      PetscReal angle;

      verify_tet(s->n, c, w, v);
      if (v[0] != vertex && v[1] != vertex && v[2] != vertex && v[3] != vertex)
        continue;
      angle = slivers_angle(x, v);
      least = PetscMin(least, angle);
      *count += angle < 1.01 * s->degrees;
    }
  }
  return least;
}

/* Moves a vertex in a random direction; returns the number of new slivers. */
static inline PetscInt slivers_move(const Slivers *s, PetscRandom random, const PetscInt at[3],
                                    PetscReal x[])
{
  PetscReal *p = x + 3 * verify_vertex(s->n, at);
  PetscReal start[3], e[3];
  PetscReal good = 0.;
  PetscReal bad = 0.;
  PetscInt count;

  for (int k = 0; k < 3; k++) {
    (void)PetscRandomGetValueReal(random, &e[k]);
    e[k] = (2. * e[k] - 1.) * s->size[k] / (PetscReal)s->n[k];
    start[k] = p[k];
  }
  for (int it = 0; it < 200; it++) {
    const PetscReal t = bad > 0. ? 0.5 * (good + bad) : good + 1. / 64.;

    for (int k = 0; k < 3; k++)
      p[k] = start[k] + t * e[k];
    if (slivers_star(s, at, x, &count) >= s->degrees)
      good = t;
    else
      bad = t;
  }
  for (int k = 0; k < 3; k++)
    p[k] = start[k] + good * e[k];
  (void)slivers_star(s, at, x, &count);
  return count;
}

static inline void slivers_place(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal *all = (const PetscReal *)place->ctx;

  for (int k = 0; k < 3; k++)
    x[k] = all[3 * verify_vertex(place->n, place->at) + k];
}

/* Writes the mesh. Collective. Output: made, number of slivers among 6 n[0] n[1] n[2] tets. */
static inline PetscErrorCode slivers_write(const Slivers *s, char path[512], PetscInt *made)
{
  const PetscInt nvert = (s->n[0] + 1) * (s->n[1] + 1) * (s->n[2] + 1);
  const PetscInt wanted = (PetscInt)(s->part * 6. * (PetscReal)(s->n[0] * s->n[1] * s->n[2]));
  PetscInt at[3], (*place)[3], nplace = 0;
  PetscRandom random;
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(3 * nvert, &x, nvert, &place));
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 16));
  PetscCall(PetscRandomSeed(random));
  for (at[2] = 0; at[2] <= s->n[2]; at[2]++) {
    for (at[1] = 0; at[1] <= s->n[1]; at[1]++) {
      for (at[0] = 0; at[0] <= s->n[0]; at[0]++) {
        PetscBool inner = (PetscBool)(at[0] & 1 && !(at[1] & 1) && !(at[2] & 1));

        for (int k = 0; k < 3; k++) {
          x[3 * verify_vertex(s->n, at) + k] = s->size[k] * (PetscReal)at[k] / (PetscReal)s->n[k];
          inner = (PetscBool)(inner && at[k] && at[k] < s->n[k]);
        }
        for (int k = 0; inner && k < 3; k++)
          place[nplace][k] = at[k];
        nplace += inner;
      }
    }
  }
  for (*made = 0; *made < wanted && nplace; nplace--) {
    PetscReal r;
    PetscInt k;

    PetscCall(PetscRandomGetValueReal(random, &r));
    k = PetscMin(nplace - 1, (PetscInt)(r * (PetscReal)nplace));
    *made += slivers_move(s, random, place[k], x);
    PetscCall(PetscArraycpy(place[k], place[nplace - 1], 3));
  }
  PetscCall(verify_mesh_write(s->n, slivers_place, x, path));
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(PetscFree2(x, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}
