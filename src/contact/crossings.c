/*
  crossings.c - intersections of surfaces: edges that intersect triangles. It shares nothing with the search
  for pairs but the tree of boxes.

  An edge goes through a triangle where its ends are on different sides of the plane and the line passes the
  three sides in the same sense: signs of volumes of tets. A volume within rounding, also that of the
  coordinates, counts as no intersection: bodies in contact do not intersect.
*/
#include "contact_mesh.h"

#define ROUNDING 64 /* rounding of a volume, in machine epsilons of its products */

/* Sign of the volume of a tet, 0 within rounding. */
static int side_of(const PetscReal *a, const PetscReal *b, const PetscReal *c, const PetscReal *d)
{
  PetscReal p[3], q[3], r[3], n[3], volume, size = 0., far = 0.;

  SbSubtract(b, a, p);
  SbSubtract(c, a, q);
  SbSubtract(d, a, r);
  for (int i = 0; i < 3; i++)
    far = PetscMax(far, PetscMax(PetscMax(PetscAbsReal(a[i]), PetscAbsReal(b[i])),
                                 PetscMax(PetscAbsReal(c[i]), PetscAbsReal(d[i]))));
  SbCross(p, q, n);
  volume = SbDot3(n, r);
  for (int i = 0; i < 3; i++)
    size += (PetscAbsReal(p[(i + 1) % 3] * q[(i + 2) % 3]) + PetscAbsReal(p[(i + 2) % 3] * q[(i + 1) % 3])) *
            (PetscAbsReal(r[i]) + far);
  if (PetscAbsReal(volume) <= ROUNDING * PETSC_MACHINE_EPSILON * size) return 0;
  return volume > 0. ? 1 : -1;
}

/* Whether an edge intersects a triangle. */
static PetscBool goes_through(SbContactMesh m, PetscBool self, const PetscReal x[], PetscInt edge, PetscInt t)
{
  const PetscInt *e = m->edge + 2 * edge, *v = m->triangle + 3 * t;
  const PetscReal *a = x + 3 * e[0], *b = x + 3 * e[1], *p = x + 3 * v[0], *q = x + 3 * v[1],
                  *r = x + 3 * v[2];
  int around;

  /* with an obstacle, contact between bodies belongs to another effect */
  if (m->nvertex > m->nbody_vertex && e[0] < m->nbody_vertex && v[0] < m->nbody_vertex) return PETSC_FALSE;
  if (m->part[e[0]] == m->part[v[0]] && (!self || e[0] >= m->nbody_vertex)) return PETSC_FALSE;
  for (int k = 0; k < 6; k++)
    if (e[k / 3] == v[k % 3]) return PETSC_FALSE;
  if (m->driven[e[0]] && m->driven[e[1]] && m->driven[v[0]] && m->driven[v[1]] && m->driven[v[2]])
    return PETSC_FALSE;
  if (side_of(p, q, r, a) * side_of(p, q, r, b) >= 0) return PETSC_FALSE;
  around = side_of(a, b, p, q);
  return (PetscBool)(around && side_of(a, b, q, r) == around && side_of(a, b, r, p) == around);
}

PetscErrorCode SbContactMeshCrossings(SbContactMesh m, PetscBool self, const PetscReal x[], PetscInt *n,
                                      PetscInt **hits)
{
  PetscInt nmine = 0, size = 0, *mine = NULL, hit;
  SbBoxNearest query;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(SbBoxTreeCreateTriangles(m->ntriangle, m->triangle, x, &tree));
  for (PetscInt e = m->space->rank; e < m->nedge; e += m->space->size) {
    PetscReal around[6];

    SbBoxClear(around);
    for (int k = 0; k < 2; k++) SbBoxAdd(around, x + 3 * m->edge[2 * e + k]);
    for (SbBoxNearestBegin(&tree, around, 0, &query); SbBoxNearestNext(&query, &hit);) {
      if (!goes_through(m, self, x, e, hit)) continue;
      PetscCall(SbReserve(nmine + 2, sizeof(*mine), &size, &mine));
      mine[nmine++] = e;
      mine[nmine++] = hit;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));

  /* those of all ranks */
  PetscCall(SbAllgatherv(m->space->comm, MPIU_INT, nmine, mine, n, hits, NULL));
  PetscCall(PetscFree(mine));
  *n /= 2;
  PetscCall(SbSortByKeys(*n, 2 * sizeof(**hits), 2, *hits));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactMeshIsInside(SbContactMesh m, const PetscReal x[], PetscInt body[2], PetscBool *found)
{
  const SbMesh mesh = m->space->mesh;
  const PetscInt nbody = mesh->nbody;
  PetscReal *point, *winding;
  PetscMPIInt *speaks;

  PetscFunctionBeginUser;
  *found = PETSC_FALSE;
  PetscCall(PetscCalloc3(nbody, &speaks, 3 * nbody, &point, nbody * nbody, &winding));

  /* the middle of a tet of each body, of the lowest rank that has one */
  for (PetscInt b = 0; b < nbody; b++) speaks[b] = PETSC_MPI_INT_MAX;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) speaks[mesh->cell_body[c]] = m->space->rank;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, speaks, (PetscMPIInt)nbody, MPI_INT, MPI_MIN, m->space->comm));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt b = mesh->cell_body[c];

    if (speaks[b] != m->space->rank) continue;
    speaks[b] = PETSC_MPI_INT_MAX;
    for (int k = 0; k < 12; k++)
      point[3 * b + k % 3] += 0.25 * mesh->x[3 * mesh->cell[4 * c + k / 3] + k % 3];
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, point, (PetscMPIInt)(3 * nbody), MPIU_REAL, MPI_SUM, m->space->comm));

  /* winding number of each surface about it */
  for (PetscInt t = 0; t < m->nbody_triangle; t++) {
    const PetscInt *v = m->triangle + 3 * t, to = m->part[v[0]];

    for (PetscInt b = 0; b < nbody; b++)
      if (b != to) winding[nbody * b + to] += SbTriangleSolidAngle(x, v, point + 3 * b) / (4. * PETSC_PI);
  }
  for (PetscInt k = 0; k < nbody * nbody && !*found; k++) {
    if (PetscAbsReal(winding[k]) < 0.5) continue;
    *found = PETSC_TRUE;
    body[0] = k / nbody;
    body[1] = k % nbody;
  }
  PetscCall(PetscFree3(speaks, point, winding));
  PetscFunctionReturn(PETSC_SUCCESS);
}
