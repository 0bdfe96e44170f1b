/*
  obstacle.c - rigid obstacles by their signed distance.

  Each shape is a rounded primitive, a core with a radius: distance = |x - nearest point of the
  core| - r, the core being a point (sphere), a segment (capsule), a solid box or a solid cylinder
  (r = 0; inside them the nearest side counts). A bowl is a sphere inverted. What a closed mesh
  encloses is in src/geometry/signed_distance.c.
*/
#include "obstacle.h"

#define SIDES 96  /* of a cylinder as triangles */
#define LARGE 20. /* m; files of larger obstacles are in mm */

static const struct {
  const char *form;
  int numbers, nvert, ntri; /* in the option; vertices and triangles of the surface */
} shapes[] = {
  {"plane:nx,ny,nz,d", 4, 2, 0},
  {"sphere:x,y,z,r", 4, 1, 0},
  {"box:x0,y0,z0,x1,y1,z1", 6, 8, 12},
  {"capsule:x0,y0,z0,x1,y1,z1,r", 7, 2, 0},
  {"cylinder:x0,y0,z0,x1,y1,z1,r", 7, 2 * SIDES + 2, 4 * SIDES},
  {"bowl:x,y,z,r", 4, 1, 0},
  {"mesh:FILE", 0, 0, 0},
};

/* Unit vector from v; `other` where v vanishes. Returns its length. */
static PetscReal unit(const PetscReal v[3], const PetscReal other[3], PetscReal n[3])
{
  const PetscReal length = PetscSqrtReal(SbDot3(v, v));

  for (int i = 0; i < 3; i++)
    n[i] = length > 0 ? v[i] / length : other[i];
  return length;
}

/* Some unit vector at right angles to the unit vector a. */
static void across(const PetscReal a[3], PetscReal n[3])
{
  const PetscBool first = (PetscBool)(PetscAbsReal(a[0]) < 0.6);
  const PetscReal e[3] = {first, !first, 0};

  SbCross(a, e, n);
  (void)SbNormalise(n);
}

/* What is wrong with the numbers of a shape, or NULL. Makes the normal of a plane a unit vector. */
static const char *normalise(SbObstacle o)
{
  const PetscReal length = PetscSqrtReal(SbDot3(o->p, o->p));

  switch (o->shape) {
  case PLANE:
    if (length <= 0)
      return "the normal 0,0,0 has no direction";
    for (int i = 0; i < 4; i++)
      o->p[i] /= length;
    return NULL;
  case SPHERE:
  case BOWL:
    return o->p[3] > 0 ? NULL : "the radius must be positive";
  case BOX:
    for (int i = 0; i < 3; i++)
      if (o->p[i] >= o->p[3 + i])
        return "the first corner must be the lower one in x, y and z";
    return NULL;
  default:
    if (o->p[6] <= 0)
      return "the radius must be positive";
    for (int i = 0; i < 3; i++)
      if (o->p[i] != o->p[3 + i])
        return NULL;
    return "its two ends are one point";
  }
}

/* Vertices and triangles of a shape: a plane has a point and the tip of its normal, a sphere the
   centre. */
static PetscErrorCode make_surface(SbObstacle o)
{
  static const PetscInt box[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                   2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  SbTriangles *s = &o->surface;
  const PetscReal *p = o->p;
  PetscReal a[3], e[3], f[3];

  PetscFunctionBeginUser;
  s->nvert = shapes[o->shape].nvert;
  s->ntri = shapes[o->shape].ntri;
  PetscCall(PetscMalloc1(3 * s->nvert, &s->x));
  PetscCall(PetscMalloc1(3 * s->ntri, &s->tri));
  for (PetscInt k = 0; k < 3 * s->nvert && o->shape != CYLINDER; k++) {
    const PetscInt v = k / 3;
    const PetscInt i = k % 3;

    if (o->shape == BOX)
      s->x[k] = p[3 * ((v >> i) & 1) + i];
    else
      s->x[k] = o->shape == PLANE ? (p[3] + (PetscReal)v) * p[i] : p[k];
  }
  if (o->shape == BOX)
    PetscCall(PetscArraycpy(s->tri, box, 36));
  if (o->shape != CYLINDER)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* a closed cylinder: fans at both ends, a band between them; its vertices lie on it */
  SbSubtract(p + 3, p, a);
  (void)unit(a, a, a);
  across(a, e);
  SbCross(a, e, f);
  for (PetscInt k = 0; k < 6 * SIDES; k++) {
    const PetscReal angle = 2 * PETSC_PI * (PetscReal)(k / 3 % SIDES) / SIDES;

    s->x[k] = p[3 * (k / (3 * SIDES)) + k % 3] +
              p[6] * (PetscCosReal(angle) * e[k % 3] + PetscSinReal(angle) * f[k % 3]);
  }
  for (int i = 0; i < 6; i++)
    s->x[6 * SIDES + i] = p[i];
  for (PetscInt k = 0; k < SIDES; k++) {
    const PetscInt l = (k + 1) % SIDES;
    const PetscInt t[12] = {k, l, SIDES + l,     k,         SIDES + l, SIDES + k, 2 * SIDES,
                            l, k, 2 * SIDES + 1, SIDES + k, SIDES + l};

    PetscCall(PetscArraycpy(s->tri + 12 * k, t, 12));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbObstacleCreate(const char *option, const char *text, SbObstacle *obstacle)
{
  const char *colon = strchr(text, ':');
  const char *problem;
  SbObstacle o;
  size_t k = 0;

  PetscFunctionBeginUser;
  while (k < PETSC_STATIC_ARRAY_LENGTH(shapes) &&
         (!colon || strncmp(shapes[k].form, text, (size_t)(colon - text) + 1)))
    k++;
  PetscCheck(
    k < PETSC_STATIC_ARRAY_LENGTH(shapes), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s %s: write one of plane:..., sphere:..., box:..., capsule:..., cylinder:..., bowl:..., "
    "mesh:FILE",
    option, text);
  PetscCall(PetscNew(&o));
  *obstacle = o;
  o->shape = (Shape)k;
  PetscCall(PetscStrncpy(o->option, option, sizeof(o->option)));
  if (o->shape == MESH) {
    PetscCheck(colon[1], PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s %s: write %s", option, text,
               shapes[k].form);
    PetscCall(PetscStrallocpy(colon + 1, &o->file));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(SbParseNumbers(colon + 1, 7, o->p) == shapes[k].numbers, PETSC_COMM_SELF,
             PETSC_ERR_USER_INPUT, "%s %s: write %s, lengths in m", option, text, shapes[k].form);
  problem = normalise(o);
  PetscCheck(!problem, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s %s: %s", option, text, problem);
  PetscCall(make_surface(o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbObstacleSetUp(SbObstacle o, MPI_Comm comm, PetscReal scale, const PetscReal at[3],
                               size_t size, char note[])
{
  SbTriangles *t = &o->surface;
  PetscReal length = 0.;

  PetscFunctionBeginUser;
  if (o->shape != MESH)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbTrianglesRead(comm, o->option, o->file, scale, at, t));
  PetscCall(SbSignedDistanceCreate(t->nvert, t->x, t->ntri, t->tri, t->across, &o->distance));
  SbAppend(size, note, "%s%s: %" PetscInt_FMT " triangles around %.4g m^3%s", note[0] ? "; " : "",
           o->file, t->ntri, (double)t->volume, t->turned ? " (turned: they were inverted)" : "");
  for (PetscInt i = 0; i < 3 * t->nvert; i++)
    length = PetscMax(length, t->x[i] - t->x[i % 3]);
  if (length > LARGE && scale == 1.)
    PetscCall(
      SbWarning(comm, "%s: %s is more than %.3g m long: if the file is in mm, give %s_scale 0.001",
                o->option, o->file, (double)length, o->option));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbObstacleDestroy(SbObstacle *obstacle)
{
  PetscFunctionBeginUser;
  if (!*obstacle)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*obstacle)->file));
  PetscCall(SbSignedDistanceDestroy(&(*obstacle)->distance));
  PetscCall(SbTrianglesDestroy(&(*obstacle)->surface));
  PetscCall(PetscFree(*obstacle));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal from_box(const PetscReal p[6], const PetscReal x[3], PetscReal n[3])
{
  PetscReal v[3];
  PetscReal depth = PETSC_MAX_REAL;
  PetscBool inside = PETSC_TRUE;

  for (int i = 0; i < 3; i++) {
    v[i] = PetscMin(x[i] - p[i], 0) + PetscMax(x[i] - p[3 + i], 0);
    if (v[i] != 0)
      inside = PETSC_FALSE;
  }
  if (!inside)
    return unit(v, v, n);
  for (int side = 0; side < 6; side++) {
    const int i = side % 3;
    const PetscReal d = side < 3 ? x[i] - p[i] : p[3 + i] - x[i];

    if (d >= depth)
      continue;
    depth = d;
    n[0] = n[1] = n[2] = 0;
    n[i] = side < 3 ? -1 : 1;
  }
  return -depth;
}

/* Coordinate s along the axis (m from the first end), distance, unit vectors along and away from
   it. */
static PetscReal axial(const PetscReal p[6], const PetscReal x[3], PetscReal *s, PetscReal *length,
                       PetscReal a[3], PetscReal away[3])
{
  PetscReal axis[3], v[3], other[3];

  SbSubtract(p + 3, p, axis);
  *length = unit(axis, axis, a);
  SbSubtract(x, p, v);
  *s = SbDot3(v, a);
  for (int i = 0; i < 3; i++)
    v[i] -= *s * a[i];
  across(a, other);
  return unit(v, other, away);
}

static PetscReal from_cylinder(const PetscReal p[7], const PetscReal x[3], PetscReal n[3])
{
  PetscReal s, length, a[3], away[3];
  const PetscReal radial = axial(p, x, &s, &length, a, away) - p[6];
  const PetscReal end = PetscMax(-s, s - length);
  const PetscReal sign = s > 0.5 * length ? 1 : -1;

  if (radial > 0 && end > 0) {
    PetscReal v[3];

    for (int i = 0; i < 3; i++)
      v[i] = radial * away[i] + end * sign * a[i];
    return unit(v, v, n);
  }
  for (int i = 0; i < 3; i++)
    n[i] = radial > end ? away[i] : sign * a[i];
  return PetscMax(radial, end);
}

PetscReal SbObstacleDistance(SbObstacle o, const PetscReal x[3], PetscReal n[3])
{
  const PetscReal *p = o->p;
  PetscReal v[3], a[3];
  PetscReal other[3] = {0, 0, 1};
  PetscReal s, length;

  SbSubtract(x, p, v);
  switch (o->shape) {
  case PLANE:
    for (int i = 0; i < 3; i++)
      n[i] = p[i];
    return SbDot3(p, x) - p[3];
  case SPHERE:
    return unit(v, other, n) - p[3];
  case BOWL:
    length = unit(v, other, n);
    for (int i = 0; i < 3; i++)
      n[i] = -n[i];
    return p[3] - length;
  case BOX:
    return from_box(p, x, n);
  case CAPSULE:
    (void)axial(p, x, &s, &length, a, other);
    for (int i = 0; i < 3; i++)
      v[i] -= PetscMax(0, PetscMin(s, length)) * a[i];
    return unit(v, other, n) - p[6];
  case MESH:
    return SbSignedDistanceEvaluate(o->distance, x, n);
  default:
    return from_cylinder(p, x, n);
  }
}
