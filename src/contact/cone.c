/*
  cone.c - cones of normals: which points and facets cannot face each other (Provot 1997, "Collision and self-collision handling in cloth
  model dedicated to design garments").

  A cone holds unit vectors m with angle(axis, m) <= alpha. All products of vectors of two cones are positive when angle(axes) + alpha +
  beta < 90 degrees:

    cos(alpha + beta) > 0  and  product of the axes > sin(alpha + beta)          (cones_out() in volume.c).

  The sums follow from the stored cosines and sines by the addition theorems: no function is called, and small angles keep their
  digits. From 90 degrees on a cone is kept as cosine 0, sine 1, which fails the first condition with any other.

  What counts is the contact normal (near.c), which is that of the facet only when the nearest point lies inside it. At an edge or
  corner it is the direction to the point, or the pseudonormal. There the following holds. Let the surface be closed around the
  place, and the normals m of all facets there within alpha < 45 degrees of an axis a. Then the surface there is the graph of a function
  h over the plane across a, homogeneous of degree one, with |h(v)| <= tan(alpha) |v|. The place is the nearest one of these facets for
  a point at r = (s, z), s in the plane and z along a, so r makes no acute angle with any direction of the surface:
  s . v + z h(v) <= 0 for all v. With v = s: |s|^2 <= |z| tan(alpha) |s|, so r is within alpha of a or of -a. The pseudonormal, a sum of
  the m with positive weights, is within alpha of a, and so tells the two apart: the contact normal is within alpha of a.

  Hence the cone of a facet is that around all normals of the facets at its three vertices. It is the widest one where the surface has
  a border, three facets at an edge, a facet almost without area (near.c then looks further), or bends by more than 45 degrees. A
  contact always faces its point, also one that was found by its motion; so a point whose normal is on the same side as the cones of all
  facets that its volume meets has none. This needs no test of contours (Volino and Magnenat-Thalmann 1994): they ask whether a region
  can meet itself, for which normals in one half-space are not enough (a spiral), and here such a meeting does not count.
*/
#include "volume.h"

/* Area over squared length: rounding turns the normal of a slimmer facet by more than the 1e-6 by which near.c wants normals to oppose. */
#define SLIM 1e-8
/* sqrt(2 TIE / TOUCH) of near.c, rad: so far the direction from a place that counts as the nearest may be off. */
#define DOUBT 0.045

static void cone_set(SbBound cone[SB_VOLUME_CONE], const PetscReal axis[3], PetscReal c, PetscReal s)
{
  for (int i = 0; i < 3; i++) cone[i] = (SbBound)axis[i];
  cone[3] = (SbBound)c;
  cone[4] = (SbBound)s;
}

static void cone_wide(SbBound cone[SB_VOLUME_CONE])
{
  cone_set(cone, (PetscReal[3]){0, 0, 0}, 0, 1);
}

void SbConeOf(const PetscReal normal[3], SbBound cone[SB_VOLUME_CONE])
{
  const PetscReal length = PetscSqrtReal(SbDot3(normal, normal));

  cone_wide(cone);
  if (length > 0)
    cone_set(cone, (PetscReal[3]){normal[0] / length, normal[1] / length, normal[2] / length}, 1, 0);
}

void SbConeMerge(const SbBound block[], PetscInt row, PetscInt lane, PetscInt n, SbBound cone[SB_VOLUME_CONE])
{
  PetscReal axis[3] = {0, 0, 0}, c = 1, s = 0, length;

  for (PetscInt l = 0; l < n; l++) {
    for (int i = 0; i < 3; i++) axis[i] += block[row * i + lane * l];
  }
  length = PetscSqrtReal(SbDot3(axis, axis));
  cone_wide(cone);
  if (length < 0.1) return;
  for (int i = 0; i < 3; i++) axis[i] /= length;
  /* the half-angle is the largest of angle(axis, other) + half-angle of the other */
  for (PetscInt l = 0; l < n; l++) {
    const SbBound *o = block + lane * l;
    const PetscReal other[3] = {o[0], o[row], o[2 * row]}, co = o[3 * row], so = o[4 * row];
    PetscReal cross[3], ct, st;

    SbCross(axis, other, cross);
    ct = SbDot3(axis, other);
    st = PetscSqrtReal(SbDot3(cross, cross));
    if (ct <= 0 || ct * co - st * so <= 0) return;
    if (st * co + ct * so > s) {
      s = st * co + ct * so;
      c = ct * co - st * so;
    }
  }
  cone_set(cone, axis, c, s);
}

/* Unit normals of all facets now; zero where a facet is too slim to have one. */
static void facet_normals(const SbDetectScene *s, PetscReal normal[])
{
  for (PetscInt f = 0; f < s->nfacet; f++) {
    const PetscInt *corner = s->facet + 3 * f;
    PetscReal v[3], w[3], *n = normal + 3 * f, length, scale;

    for (int i = 0; i < 3; i++) {
      v[i] = s->x[3 * corner[1] + i] - s->x[3 * corner[0] + i];
      w[i] = s->x[3 * corner[2] + i] - s->x[3 * corner[0] + i];
    }
    SbCross(v, w, n);
    length = PetscSqrtReal(SbDot3(n, n));
    scale = PetscMax(SbDot3(v, v), SbDot3(w, w));
    for (int i = 0; i < 3; i++) n[i] = length > SLIM * scale ? n[i] / length : 0;
  }
}

/* Cone around the normals of the facets at one vertex; the widest above 45 degrees. */
static void cone_of_ring(const SbDetectRings *r, PetscInt vertex, const PetscReal normal[],
                         SbBound cone[SB_VOLUME_CONE])
{
  PetscReal axis[3] = {0, 0, 0}, c = 1, s = 0, length;

  cone_wide(cone);
  for (PetscInt j = r->ring_start[vertex]; j < r->ring_start[vertex + 1]; j++) {
    for (int i = 0; i < 3; i++) axis[i] += normal[3 * (r->ring[j] / 3) + i];
  }
  length = PetscSqrtReal(SbDot3(axis, axis));
  if (length < 0.1) return;
  for (int i = 0; i < 3; i++) axis[i] /= length;
  for (PetscInt j = r->ring_start[vertex]; j < r->ring_start[vertex + 1]; j++) {
    const PetscReal *n = normal + 3 * (r->ring[j] / 3);
    PetscReal cross[3], dot = SbDot3(axis, n);

    if (!(dot > PETSC_SQRT2 / 2)) return;
    SbCross(axis, n, cross);
    s = PetscMax(s, PetscSqrtReal(SbDot3(cross, cross)));
    c = PetscMin(c, dot);
  }
  cone_set(cone, axis, c * cos(DOUBT) - s * sin(DOUBT), s * cos(DOUBT) + c * sin(DOUBT));
}

void SbConesOfVertices(const SbDetectScene *s, const SbDetectRings *r, const PetscBool open[],
                       PetscReal normal[], SbBound cone[])
{
  facet_normals(s, normal);
  for (PetscInt v = 0; v < r->nvertex; v++) {
    if (open[v])
      cone_wide(cone + SB_VOLUME_CONE * v);
    else
      cone_of_ring(r, v, normal, cone + SB_VOLUME_CONE * v);
  }
}
