/*
  pour.h - small bodies poured into a bowl: what the short and the long program share.

  Boxes of a few tets, turned this way and that, fall in layers. Energy with the potential of gravity never exceeds that of the start;
  momentum changes by weight and the force of the bowl; no vertex of the surface ends a step behind the bowl, and none ever is deep in
  another body; centres end inside the bowl, and what came to rest below is carried.
*/
#pragma once
#include "../../src/effect/collision.h"
#include "contact.h"

#define POUR_G 9.81
#define POUR_RADIUS 0.2 /* of the bowl, m */
#define POUR_SIZE 0.06  /* edges of the bodies are about that, m */

/* A number in [-1, 1] for each body and purpose. */
static inline PetscReal pour_noise(PetscInt body, PetscInt purpose)
{
  const PetscReal x = 12.9898 * (PetscReal)(body + 1) + 78.233 * (PetscReal)(purpose + 1);

  return PetscSinReal(x * x);
}

/* Options of n bodies in layers: rings of four, of many bodies rings of eight with one in the middle. */
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
    const PetscInt layer = k / many, place_in = k % many;
    const PetscReal angle =
      2 * PETSC_PI * (PetscReal)place_in / (PetscReal)(many == 9 ? 8 : 4) + 0.4 * (PetscReal)layer;
    const PetscReal r = many == 4 ? 0.075 : place_in == 8 ? 0 : 0.14;
    const PetscReal place[3] = {r * PetscCosReal(angle), r * PetscSinReal(angle),
                                -0.02 + 0.1 * (PetscReal)layer + 0.008 * pour_noise(k, 0)};
    char one[768];

    /* turned about the origin, which is a corner: the centre is within 0.052 m of `place` */
    PetscCall(PetscSNPrintf(one, sizeof(one),
                            " -body_b%d_mesh box:%g,%g,%g:1 -body_b%d_rotate %g,%g,%g,%g -body_b%d_translate "
                            "%g,%g,%g -body_b%d_material corotated "
                            "-body_b%d_young 3e4 -body_b%d_poisson 0.3 -body_b%d_density 1000",
                            (int)k, (double)(0.05 + 0.01 * pour_noise(k, 1)),
                            (double)(0.05 + 0.01 * pour_noise(k, 2)), 0.04, (int)k, (double)pour_noise(k, 3),
                            (double)pour_noise(k, 4), 0.5, (double)(25 * pour_noise(k, 5)), (int)k,
                            (double)(place[0] - 0.025), (double)(place[1] - 0.025), (double)(place[2] - 0.02),
                            (int)k, (int)k, (int)k, (int)k));
    PetscCall(PetscStrlcat(text, one, size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distance of the body's centre from that of the bowl that is furthest away, m. */
static inline PetscErrorCode pour_furthest(TestScene *t, const PetscReal bowl[3], PetscReal *distance)
{
  const SbModel m = t->model;
  PetscReal sum[3 * CONTACT_BODIES], mass[CONTACT_BODIES];
  PetscScalar *x;
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(t->run->U, &X));
  PetscCall(VecCopy(t->run->U, X));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < 3 * m->space->nnode_owned; i++) x[i] += m->space->node_x[i] - bowl[i % 3];
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(contact_body_sums(m, X, PETSC_TRUE, sum));
  PetscCall(contact_body_masses(m, mass));
  PetscCall(VecDestroy(&X));
  *distance = 0;
  for (PetscInt b = 0; b < m->nbody; b++) {
    for (int k = 0; k < 3; k++) sum[3 * b + k] /= mass[b];
    *distance = PetscMax(*distance, PetscSqrtReal(SbDot3(sum + 3 * b, sum + 3 * b)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  ContactWatch w;
  PetscReal inside; /* deepest place of a body inside another, by its own measure, m */
} Pour;

/* Depth of a point in a convex body, behind the facets [from, to) of a scene, m; negative outside. */
static inline PetscReal pour_depth(const SbDetectScene *s, const PetscInt from[], PetscInt n,
                                   const PetscReal p[3])
{
  PetscReal depth = PETSC_MAX_REAL;

  for (PetscInt i = 0; i < n && depth > 0; i++) {
    const PetscInt *v = s->facet + 3 * from[i];
    PetscReal a[3], b[3], r[3], normal[3];

    for (int k = 0; k < 3; k++) {
      a[k] = s->x[3 * v[1] + k] - s->x[3 * v[0] + k];
      b[k] = s->x[3 * v[2] + k] - s->x[3 * v[0] + k];
      r[k] = s->x[3 * v[0] + k] - p[k];
    }
    SbCross(a, b, normal);
    depth = PetscMin(depth, SbDot3(r, normal) / PetscSqrtReal(SbDot3(normal, normal)));
  }
  return depth;
}

/*
  How deep bodies are in each other without asking the detector: places along all edges of all facets against the facets of every other
  body, which is convex but for its strain. On one rank.
*/
static inline PetscErrorCode pour_inside(SbModel m, PetscReal *inside)
{
  const SbDetectScene *s = &((Collision *)contact_effect(m, "meet")->data)->surface->scene;
  PetscInt *list[CONTACT_BODIES], n[CONTACT_BODIES] = {0};

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++) PetscCall(PetscMalloc1(s->nfacet, &list[b]));
  for (PetscInt f = 0; f < s->nfacet; f++) list[s->facet_part[f]][n[s->facet_part[f]]++] = f;
  for (PetscInt f = 0; f < s->nfacet; f++) {
    for (int q = 0; q < 3 * 8; q++) {
      const PetscInt a = s->facet[3 * f + q / 8], b = s->facet[3 * f + (q / 8 + 1) % 3];
      PetscReal p[3];

      for (int k = 0; k < 3; k++)
        p[k] = s->x[3 * a + k] + (PetscReal)(q % 8) / 8 * (s->x[3 * b + k] - s->x[3 * a + k]);
      for (PetscInt o = 0; o < m->nbody; o++) {
        if (o != s->facet_part[f]) *inside = PetscMax(*inside, pour_depth(s, list[o], n[o], p));
      }
    }
  }
  for (PetscInt b = 0; b < m->nbody; b++) PetscCall(PetscFree(list[b]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode pour_watch(SbRun run, const SbStep *step, void *ctx)
{
  Pour *p = (Pour *)ctx;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCall(contact_watch(run, step, &p->w));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size == 1 && step->step > 0) PetscCall(pour_inside(run->model, &p->inside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n bodies, up to the time `end` (s) by which all have landed; `radius` of the bowl in m; bounds: of the depth in each other, as a
   part of their size, and of the momentum of a step, as a part of the weight's. */
static inline PetscErrorCode pour(PetscInt n, PetscReal end, PetscReal radius, PetscReal deep,
                                  PetscReal missing)
{
  const size_t size = 1024 * (size_t)n + VERIFY_TEXT;
  const PetscReal bowl[3] = {0, 0, radius - 0.15};
  Pour p = {.w = {.obstacle = {"bowl"}, .meet = "meet", .g = POUR_G}};
  const ContactWatch *w = &p.w;
  PetscReal furthest = 0, weight;
  char *text, effects[1024];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(size, &text));
  PetscCall(pour_bodies(n, size, text));
  PetscCall(PetscSNPrintf(
    effects, sizeof(effects),
    " -effects gravity,bowl,meet -effect_bowl_type contact -effect_bowl_obstacle bowl:0,0,%g,%g "
    "-effect_meet_type collision -time euler_implicit -ts_dt 0.004 -ts_max_time %g "
    "-snes_rtol 1e-9 -ksp_rtol 1e-8",
    (double)bowl[2], (double)radius, (double)end));
  PetscCall(PetscStrlcat(text, effects, size));
  PetscCall(test_scene_open(text, &t));
  PetscCall(PetscFree(text));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, pour_watch, &p, NULL));
  PetscCall(verify_solve(&t, "pour"));
  weight = POUR_G * t.model->mass;
  PetscCall(pour_furthest(&t, bowl, &furthest));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  %d bodies of %.2f kg in all, %d steps, %d cut, %d solves: energy %.2g J above the start at most, "
    "%.1e J gained in a step, now %.3g J less; momentum off by %.1e kg m/s\n",
    (int)n, (double)t.model->mass, (int)t.run->steps_total, (int)t.run->rejected_total,
    (int)t.run->newton_total, (double)w->most, (double)w->gain, (double)(w->start - w->energy),
    (double)w->missing));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  behind the bowl %.1e m, in bodies %.1e m (history %.1e); %g pairs at most; centres within %.3f m of "
    "%g; mean force of the bowl %.3f of the weight; min J %.2f\n",
    (double)w->behind, (double)p.inside, (double)w->deepest, (double)w->contacts, (double)furthest,
    (double)radius, (double)(w->impulse / (end * weight)), (double)w->min_J));
  SB_CHECK(w->most <= 1e-6 * weight * radius, "energy is %g J above that of the start", (double)w->most);
  /* what nodes pull with that stay for the rest of a step is not in the history of the bowl */
  SB_CHECK(w->missing < missing * weight * 0.004, "momentum changed by %g kg m/s without a force",
           (double)w->missing);
  SB_CHECK(w->behind < 1e-6 * radius, "%g m behind the bowl", (double)w->behind);
  SB_CHECK(p.inside < deep * POUR_SIZE, "%g m inside another body", (double)p.inside);
  SB_CHECK(w->deepest < deep * POUR_SIZE, "the history says %g m inside another body", (double)w->deepest);
  SB_CHECK(furthest < radius, "a body's centre is %g m from the centre of the bowl", (double)furthest);
  SB_CHECK(w->contacts >= 2 * n && w->force > weight, "%g pairs, %g N: the bodies do not meet",
           (double)w->contacts, (double)w->force);
  SB_CHECK(w->start - w->energy > 0.1 * weight * radius, "the bodies do not fall: %g J",
           (double)(w->start - w->energy));
  SB_CHECK(w->min_J > 0, "a cell is inverted");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}
