/*
  pour.h - small bodies poured into a bowl: common part of the short and the long test.

  Boxes of a few tets with various orientations fall in layers. Checks: the energy including gravity
  never exceeds the initial one; the momentum changes by weight and the force of the bowl; no
  surface vertex is behind the bowl at the end of a step, or deep inside another body; body centres
  end inside the bowl, and resting bodies are supported.
*/
#pragma once
#include "../../src/contact/surfaces.h"
#include "contact.h"

#define POUR_G 9.81
#define POUR_RADIUS 0.2 /* radius of the bowl, m */
#define POUR_SIZE 0.06  /* approximate edge length of the bodies, m */

/* Pseudorandom number in [-1, 1] for each body and purpose. */
static inline PetscReal pour_noise(PetscInt body, PetscInt purpose)
{
  const PetscReal x = 12.9898 * (PetscReal)(body + 1) + 78.233 * (PetscReal)(purpose + 1);

  return PetscSinReal(x * x);
}

/* Options of n bodies in layers: rings of four, or for many bodies rings of eight with one in the
   centre. */
static inline PetscErrorCode pour_bodies(PetscInt n, size_t size, char text[])
{
  const PetscInt many = n > 8 ? 9 : 4;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(text, "-bodies", size));
  for (PetscInt k = 0; k < n; k++) {
    char one[32];

    PetscCall(PetscSNPrintf(one, sizeof(one), "%cb%d", k ? ',' : ' ', (int)k));
    PetscCall(PetscStrlcat(text, one, size));
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt layer = k / many;
    const PetscInt place_in = k % many;
    const PetscReal angle =
      2 * PETSC_PI * (PetscReal)place_in / (PetscReal)(many == 9 ? 8 : 4) + 0.4 * (PetscReal)layer;
    const PetscReal r = many == 4 ? 0.075 : place_in == 8 ? 0 : 0.14;
    const PetscReal place[3] = {r * PetscCosReal(angle), r * PetscSinReal(angle),
                                -0.02 + 0.1 * (PetscReal)layer + 0.008 * pour_noise(k, 0)};
    char one[768];

    /* turned about the origin, which is a corner: the centre is within 0.052 m of `place` */
    PetscCall(PetscSNPrintf(
      one, sizeof(one),
      " -body_b%d_mesh box:%g,%g,%g:1 -body_b%d_rotate %g,%g,%g,%g -body_b%d_translate %g,%g,%g "
      "-body_b%d_material corotated -body_b%d_young 3e4 -body_b%d_poisson 0.3 -body_b%d_density "
      "1000",
      (int)k, 0.05 + 0.01 * pour_noise(k, 1), 0.05 + 0.01 * pour_noise(k, 2), 0.04, (int)k,
      pour_noise(k, 3), pour_noise(k, 4), 0.5, 25 * pour_noise(k, 5), (int)k, place[0] - 0.025,
      place[1] - 0.025, place[2] - 0.02, (int)k, (int)k, (int)k, (int)k));
    PetscCall(PetscStrlcat(text, one, size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distance of the body's centre from that of the bowl that is furthest away, m. */
static inline PetscErrorCode pour_furthest(TestScene *t, const PetscReal bowl[3],
                                           PetscReal *distance)
{
  const SbModel m = t->model;
  PetscReal sum[3 * CONTACT_BODIES], mass[CONTACT_BODIES];
  PetscScalar *x;
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(t->run->state.U, &X));
  PetscCall(VecCopy(t->run->state.U, X));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < 3 * m->space->nnode_owned; i++)
    x[i] += m->space->node_x[i] - bowl[i % 3];
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(contact_body_sums(m, X, PETSC_TRUE, sum));
  PetscCall(contact_body_masses(m, mass));
  PetscCall(VecDestroy(&X));
  *distance = 0;
  for (PetscInt b = 0; b < m->nbody; b++) {
    for (int k = 0; k < 3; k++)
      sum[3 * b + k] /= mass[b];
    *distance = PetscMax(*distance, PetscSqrtReal(SbDot3(sum + 3 * b, sum + 3 * b)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Depth of a point in a convex body, behind n triangles of it, m; negative outside. */
static inline PetscReal pour_depth(const Surfaces *s, const PetscInt from[], PetscInt n,
                                   const PetscReal p[3])
{
  PetscReal depth = PETSC_MAX_REAL;

  for (PetscInt i = 0; i < n && depth > 0; i++) {
    const PetscInt *v = s->surface->triangle + 3 * from[i];
    PetscReal a[3], b[3], r[3], normal[3];

    for (int k = 0; k < 3; k++) {
      a[k] = s->motion.x[3 * v[1] + k] - s->motion.x[3 * v[0] + k];
      b[k] = s->motion.x[3 * v[2] + k] - s->motion.x[3 * v[0] + k];
      r[k] = s->motion.x[3 * v[0] + k] - p[k];
    }
    SbCross(a, b, normal);
    depth = PetscMin(depth, SbDot3(r, normal) / PetscSqrtReal(SbDot3(normal, normal)));
  }
  return depth;
}

/*
  How deep bodies are in each other without asking for pairs: places along all edges of all facets
  against the facets of every other body, which is convex but for its strain. On one rank.
*/
static inline PetscErrorCode pour_inside(SbModel m, PetscReal *inside)
{
  const Surfaces *s = (const Surfaces *)contact_effect(m, "meet")->data;
  PetscInt *list[CONTACT_BODIES];
  PetscInt n[CONTACT_BODIES] = {0};

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCall(PetscMalloc1(s->surface->ntriangle, &list[b]));
  for (PetscInt f = 0; f < s->surface->ntriangle; f++)
    list[s->surface->part[s->surface->triangle[3 * f]]]
        [n[s->surface->part[s->surface->triangle[3 * f]]]++] = f;
  for (PetscInt f = 0; f < s->surface->ntriangle; f++) {
    for (int q = 0; q < 3 * 8; q++) {
      const PetscInt a = s->surface->triangle[3 * f + q / 8];
      const PetscInt b = s->surface->triangle[3 * f + (q / 8 + 1) % 3];
      PetscReal p[3];

      for (int k = 0; k < 3; k++)
        p[k] = s->motion.x[3 * a + k] +
               (PetscReal)(q % 8) / 8 * (s->motion.x[3 * b + k] - s->motion.x[3 * a + k]);
      for (PetscInt o = 0; o < m->nbody; o++)
        if (o != s->surface->part[s->surface->triangle[3 * f]])
          *inside = PetscMax(*inside, pour_depth(s, list[o], n[o], p));
    }
  }
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCall(PetscFree(list[b]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The deepest place of a body inside another in any step, by pour_inside(), m. */
static inline PetscErrorCode pour_watch(SbRun run, const SbStep *step, void *ctx)
{
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size == 1 && step->step > 0)
    PetscCall(pour_inside(run->model, (PetscReal *)ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n bodies, up to the time `end` (s) by which all have landed; `radius` of the bowl in m; bounds:
   of the depth in each other, as a part of their size, and of the momentum of a step, as a part of
   the weight's. */
static inline PetscErrorCode pour(PetscInt n, PetscReal end, PetscReal radius, PetscReal deep,
                                  PetscReal missing)
{
  const size_t size = 1024 * (size_t)n + VERIFY_TEXT;
  const PetscReal bowl[3] = {0, 0, radius - 0.15};
  Record r = {.g = POUR_G};
  PetscReal furthest = 0;
  PetscReal inside = 0;
  PetscReal weight, lost;
  char *text, effects[1024];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(size, &text));
  PetscCall(pour_bodies(n, size, text));
  PetscCall(PetscSNPrintf(
    effects, sizeof(effects),
    " -effects gravity,bowl,meet -effect_bowl_type contact "
    "-effect_bowl_obstacle bowl:0,0,%g,%g -effect_meet_type contact "
    "-time euler_implicit -ts_dt 0.004 -ts_max_time %g -snes_rtol 1e-9 -ksp_rtol 1e-8",
    bowl[2], radius, end));
  PetscCall(PetscStrlcat(text, effects, size));
  PetscCall(test_scene_open(text, &t));
  PetscCall(PetscFree(text));
  verify_case("%d bodies", (int)n);
  PetscCall(SbRunAddMonitor(t.run, pour_watch, &inside));
  PetscCall(record_solve(&t, &r));
  PetscCall(pour_furthest(&t, bowl, &furthest));
  PetscCall(test_scene_close(&t));
  weight = POUR_G * r.mass;
  lost = record_at(&r, "energy", 0) - record_last(&r, "energy");
  verify_show("steps cut", (PetscReal)r.rejected);
  verify_show("solves", (PetscReal)r.newton);
  verify_show("mean force of the bowl, of the weight",
              record_impulse(&r, "bowl_force_z") / (end * weight));
  VERIFY_LESS(record_max(&r, "energy") - record_at(&r, "energy", 0), 1e-6 * weight * radius,
              "energy above the start, J");
  /* what nodes pull with that stay for the rest of a step is not in the history of the bowl */
  VERIFY_LESS(record_max(&r, "missing"), missing * weight * 0.004,
              "momentum that no force explains, kg m/s");
  VERIFY_LESS(record_max(&r, "bowl_penetration"), 1e-6 * radius, "behind the bowl, m");
  VERIFY_LESS(inside, deep * POUR_SIZE, "inside another body, m");
  VERIFY_LESS(record_max(&r, "meet_penetration"), deep * POUR_SIZE,
              "inside another body by the history, m");
  VERIFY_LESS(furthest, radius, "furthest centre from that of the bowl, m");
  VERIFY_MORE(record_max(&r, "meet_contacts"), (PetscReal)(2 * n - 1), "pairs");
  VERIFY_MORE(record_max(&r, "bowl_force_z"), weight, "largest force of the bowl, N");
  VERIFY_MORE(lost, 0.1 * weight * radius, "energy lost in the fall, J");
  VERIFY_MORE(record_min(&r, "min_J"), 0, "least det F");
  PetscFunctionReturn(PETSC_SUCCESS);
}
