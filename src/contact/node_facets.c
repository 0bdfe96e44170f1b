/*
  node_facets.c - facets of a body that an obstacle enters between their nodes, where the nodes
  alone are tested against its distance: said, once for a contact.

  A distance g(x) changes by no more than |dx|, so a triangle with the centre c and the radius r is
  outside where g(c) > r; else it is cut in four, and so on, until its deepest point p is known. It
  counts as missed where every node i of the facet is outside, and g rises towards each by more than
  SLOPE |x_i - p|. That holds for obstacles of any shape: a needle has slopes near 1, also as a
  detail of a mesh; an edge of a box 0.7. A sphere of radius R that touches a flat facet of edges h
  in its middle has h / (2 sqrt(3) R), as a chord is nearer than its arc; that is the error of any
  mesh.

  An obstacle that is thinner than the shortest edge of a facet within reach, the facet's radius, is
  named before that happens.

  A facet of P2 is four flat triangles over its six nodes; one of CR and DG has one node, at its
  centroid. Half-spaces and bowls touch nodes only, and need none of this.
*/
#include "nodes.h"

#define SLOPE 0.15 /* least one of a miss: of spheres with R < 1.9 h; 0.3: 1 h; 0.075: 3.8 h */
#define DEEPER 1.1 /* points that are deeper by this factor are looked for */
#define LEVELS 8   /* times that a triangle is cut in four: to 1/256 of its edges */
#define LOOKS 400  /* most distances that are taken for one triangle */

/* What is worse comes later. */
enum {
  NOTHING,
  THIN,  /* the obstacle is thinner than a facet near it */
  MISSED /* it goes through a facet between its nodes */
};

/* The deepest point of a triangle. */
typedef struct {
  const Nodes *c;
  const SbPose *pose;
  PetscReal p[3], gap; /* m */
  int looks;
} Deepest;

/* The worst triangle, in bytes for MPI. */
typedef struct {
  double
    by; /* 0: none; up to THIN, more the nearer the obstacle; from MISSED on, more the deeper */
  PetscReal x[3], depth, edge[2]; /* m: place, depth there, shortest and longest edge */
  PetscInt body;
} Found;

PetscErrorCode SbNodeFacetsCreate(Nodes *c, SbSpace space, PetscInt n, const SbFacet facet[])
{
  const SbObstacle o = c->contact.partner.obstacle;
  PetscInt nown = 0;

  PetscFunctionBeginUser;
  if (o->shape == PLANE || o->shape == BOWL) {
    c->between.told = MISSED;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(n, &c->between.facet));
  for (PetscInt i = 0; i < n; i++)
    if (facet[i].cell < space->mesh->ncell_owned)
      c->between.facet[nown++] = facet[i];
  c->between.n = nown;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNodeFacetsDestroy(Nodes *c)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(c->between.facet));
  c->between.n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest width of an obstacle, m; of a mesh that of the box around it. */
static PetscReal width_of(SbObstacle o)
{
  const PetscReal *p = o->p;
  PetscReal least = PETSC_MAX_REAL;

  if (o->shape == SPHERE)
    return 2. * p[3];
  if (o->shape == CAPSULE)
    return 2. * p[6];
  if (o->shape == CYLINDER)
    return PetscMin(2. * p[6], PetscSqrtReal(SbDistance2(p, p + 3)));
  for (int k = 0; k < 3; k++) {
    PetscReal lo = PETSC_MAX_REAL;
    PetscReal hi = -PETSC_MAX_REAL;

    for (PetscInt i = 0; i < o->surface.nvert; i++) {
      lo = PetscMin(lo, o->surface.x[3 * i + k]);
      hi = PetscMax(hi, o->surface.x[3 * i + k]);
    }
    least = PetscMin(least, hi - lo);
  }
  return least;
}

/* The points of a facet at the displacement u, m: its corners, with P2 the middles of its sides as
   well, 3 + k behind corner k. Returns their number. */
static int find_points(SbSpace space, const SbFacet *f, const PetscReal u[], PetscReal x[6][3])
{
  const SbElement element = SbSpaceCellElement(space, f->cell);

  for (int k = 0; k < 3; k++) {
    const PetscReal *w = element->ops.vertex[f->corner[k]];

    for (int i = 0; i < 3; i++) {
      x[k][i] = space->mesh->x[3 * f->vertex[k] + i];
      for (int a = 0; a < 4; a++)
        x[k][i] += w[a] * u[3 * space->cell_node[4 * f->cell + a] + i];
    }
  }
  if (!element->nodes_per[1])
    return 3;
  for (int k = 0; k < 3; k++)
    for (int e = 0; e < 6; e++) {
      const PetscInt a = f->corner[k];
      const PetscInt b = f->corner[(k + 1) % 3];

      if ((SbTetEdge[e][0] == a && SbTetEdge[e][1] == b) ||
          (SbTetEdge[e][0] == b && SbTetEdge[e][1] == a))
        place(space, SbSpaceCellNode(space, f->cell, 4 + e), u, x[3 + k]);
    }
  return 6;
}

/* Centre and radius of a triangle, m. */
static PetscReal radius_of(const PetscReal y[3][3], PetscReal centre[3])
{
  PetscReal r2 = 0.;

  for (int i = 0; i < 3; i++)
    centre[i] = (y[0][i] + y[1][i] + y[2][i]) / 3.;
  for (int k = 0; k < 3; k++)
    r2 = PetscMax(r2, SbDistance2(centre, y[k]));
  return PetscSqrtReal(r2);
}

/* Looks for a point of a triangle that is deeper than d->gap. */
static void look(Deepest *d, const PetscReal y[3][3], int level)
{
  PetscReal centre[3], n[3], middle[3][3];
  const PetscReal r = radius_of(y, centre);
  const PetscReal gap = SbNodeGap(d->c, d->pose, centre, n);

  d->looks++;
  if (gap < d->gap) {
    d->gap = gap;
    for (int i = 0; i < 3; i++)
      d->p[i] = centre[i];
  }
  if (level == LEVELS || d->looks >= LOOKS || gap - r >= DEEPER * d->gap)
    return;
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 3; i++)
      middle[k][i] = 0.5 * (y[k][i] + y[(k + 1) % 3][i]);
  look(d, (const PetscReal(*)[3])middle, level + 1);
  for (int k = 0; k < 3; k++) {
    PetscReal part[3][3];

    for (int i = 0; i < 3; i++) {
      part[0][i] = y[k][i];
      part[1][i] = middle[k][i];
      part[2][i] = middle[(k + 2) % 3][i];
    }
    look(d, (const PetscReal(*)[3])part, level + 1);
  }
}

/* Notes in *found what is to be said of a triangle y of a facet, if it is worse. corners: they are
   its nodes, else its centroid is; width: of the obstacle, m; slope: the least one of a miss. */
static void check_triangle(Nodes *c, const SbPose *pose, const PetscReal y[3][3], PetscBool corners,
                           PetscReal width, PetscReal slope, Found *found)
{
  const PetscReal small = NODE_TOLERANCE * c->size;
  Deepest d = {.c = c, .pose = pose};
  PetscReal centre[3], n[3], gap[3];
  PetscReal edge[2] = {PETSC_MAX_REAL, 0.};
  const PetscReal r = radius_of(y, centre);
  const PetscReal middle = SbNodeGap(c, pose, centre, n);
  const int points = corners ? 3 : 1;
  PetscBool felt = PETSC_FALSE; /* by a node, or not there */
  double by = 0.;

  /* out of reach */
  if (middle > r)
    return;
  for (int k = 0; k < 3; k++) {
    const PetscReal length = PetscSqrtReal(SbDistance2(y[k], y[(k + 1) % 3]));

    edge[0] = PetscMin(edge[0], length);
    edge[1] = PetscMax(edge[1], length);
    gap[k] = corners ? SbNodeGap(c, pose, y[k], n) : middle;
    felt = (PetscBool)(felt || gap[k] <= small);
  }

  /* missed where the distance rises steeply towards all nodes */
  if (!felt)
    look(&d, y, 0);
  felt = (PetscBool)(felt || d.gap >= -small);
  for (int k = 0; k < points && !felt; k++)
    felt = (PetscBool)(gap[k] - d.gap <
                       slope * PetscSqrtReal(SbDistance2(corners ? y[k] : centre, d.p)));
  if (!felt)
    by = MISSED - (double)(d.gap / c->size);
  else if (width < edge[0] && c->between.told < THIN)
    by = (double)(c->size / (c->size + PetscAbsReal(middle)));
  if (by <= found->by)
    return;
  *found = (Found){.by = by, .depth = -d.gap, .edge = {edge[0], edge[1]}};
  for (int i = 0; i < 3; i++)
    found->x[i] = felt ? centre[i] : d.p[i];
}

/* Whether a node of some rank touches the obstacle. Collective. */
static PetscErrorCode is_touched(const Nodes *c, SbSpace space, const SbPose *pose,
                                 const PetscReal u[], PetscBool *is)
{
  PetscFunctionBeginUser;
  *is = PETSC_FALSE;
  for (PetscInt i = 0; i < c->n && !*is; i++) {
    PetscReal x[3], n[3];

    place(space, c->node[i].node, u, x);
    *is = (PetscBool)(SbNodeGap(c, pose, x, n) <= NODE_TOLERANCE * c->size);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, is, 1, SB_MPI_BOOL, MPI_LOR, space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNodeFacetsCheck(Nodes *c, SbSpace space, PetscReal t, const SbPose *pose,
                                 const PetscReal u[])
{
  static const PetscInt parts[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
  static const PetscInt whole[3] = {0, 1, 2};
  const char *name = c->contact.base.effect->name;
  const char *unit = c->contact.base.effect->dynamic ? "t = " : "load factor ";
  Found found = {.by = 0.};
  struct {
    double by;
    int rank;
  } worst = {0., space->rank};
  PetscReal width;
  PetscBool touched = PETSC_TRUE;

  PetscFunctionBeginUser;
  if (c->between.told == MISSED) /* alike on all ranks */
    PetscFunctionReturn(PETSC_SUCCESS);
  width = width_of(c->contact.partner.obstacle);
  if (!c->contact.base.effect->dynamic)
    PetscCall(is_touched(c, space, pose, u, &touched));
  for (PetscInt i = 0; i < c->between.n; i++) {
    const SbFacet *f = &c->between.facet[i];
    const PetscBool corners = (PetscBool)(SbSpaceCellElement(space, f->cell)->nodes_per[0] > 0);
    const double before = found.by;
    PetscReal x[6][3], y[3][3];
    const int n = find_points(space, f, u, x) == 6 ? 4 : 1;

    for (int part = 0; part < n; part++) {
      const PetscInt *v = n == 1 ? whole : parts[part];

      for (int k = 0; k < 9; k++)
        y[k / 3][k % 3] = x[v[k / 3]][k % 3];
      check_triangle(c, pose, (const PetscReal(*)[3])y, corners, width, touched ? SLOPE : 0.,
                     &found);
    }
    if (found.by > before)
      found.body = space->mesh->cell_body[f->cell];
  }
  worst.by = found.by;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, space->comm));
  if (worst.by <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  c->between.told = worst.by >= MISSED ? MISSED : THIN;
  PetscCallMPI(MPI_Bcast(&found, (PetscMPIInt)sizeof(found), MPI_BYTE, worst.rank, space->comm));
  if (c->between.told == MISSED)
    PetscCall(SbWarning(
      space->comm,
      "effect %s: at %s%g the obstacle (%.3g m wide) is %.2g m inside a facet of %s between its "
      "nodes, at (%g, %g, %g) m, and pushes none of them: the facet's edges are %.3g to %.3g m "
      "long, and this response tests nodes only; said once: -effect_%s_response barrier also tests "
      "facets, or make the mesh finer there",
      name, unit, (double)t, (double)width, (double)found.depth, space->mesh->body[found.body].name,
      (double)found.x[0], (double)found.x[1], (double)found.x[2], (double)found.edge[0],
      (double)found.edge[1], name));
  else
    PetscCall(SbWarning(
      space->comm,
      "effect %s: the obstacle is %.3g m wide, and a facet of %s near it at (%g, %g, %g) m has "
      "edges of %.3g to %.3g m: this response tests nodes only, and the obstacle may go in between "
      "them; said once: -effect_%s_response barrier also tests facets, or make the mesh finer "
      "there",
      name, (double)width, space->mesh->body[found.body].name, (double)found.x[0],
      (double)found.x[1], (double)found.x[2], (double)found.edge[0], (double)found.edge[1], name));
  PetscFunctionReturn(PETSC_SUCCESS);
}
