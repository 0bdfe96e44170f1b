/*
  place.c - a point of a body at rest as a mean of its nodes, for what is attached to bodies at
  single points.

  The displacement of the point is the mean over the tets that hold it, by volume, of that of their
  elements: one tet inside, two on a face, all around an edge or a vertex, where CR and DG jump.
  With P1 and P2 all of them agree. Every rank looks into its owned tets; the sum over the ranks is
  the same for any partition, but for rounding.
*/
#include "effect_impl.h"
#include "sbgeometry.h"

#define ROUNDING 1e-9 /* of barycentric coordinates: a point so far outside is on the tet's face */

/* A node's part of the place. */
typedef struct {
  PetscReal gnode, weight; /* weight times volume, m^3 */
} Part;

typedef struct {
  PetscInt n, size;
  Part *part; /* [n] owned */
} Parts;

/* Whether an owned or ghost cell holds a point, and where. */
static PetscBool holds(SbMesh mesh, PetscInt cell, const PetscReal x[3], PetscReal L[4])
{
  const PetscInt *v = mesh->cell + 4 * cell;

  if (mesh->cell_set[cell] & SB_CURVED) {
    if (!SbTetCurvedBarycentric(mesh->x, v, mesh->edge_off + 18 * cell, x, L))
      return PETSC_FALSE;
  } else
    SbTetBarycentric(mesh->x, v, x, L);
  return (PetscBool)(PetscMin(PetscMin(L[0], L[1]), PetscMin(L[2], L[3])) >= -ROUNDING);
}

/* The parts of this rank's tets of a body, -1: of any; volume[nbody], of all ranks. */
static PetscErrorCode gather(SbSpace s, PetscInt body, const PetscReal x[3], Parts *list,
                             PetscReal volume[])
{
  const SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  list->n = 0;
  PetscCall(PetscArrayzero(volume, mesh->nbody));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscReal V = SbTetDeterminant(mesh->x, mesh->cell + 4 * c) / 6;
    PetscReal L[4], phi[SB_CELL_NODES];
    PetscInt n;

    if ((body >= 0 && mesh->cell_body[c] != body) || !holds(mesh, c, x, L))
      continue;
    n = SbCellBasis(s, c, L, phi);
    PetscCall(SbReserve(list->n + n, sizeof(*list->part), &list->size, &list->part));
    for (PetscInt a = 0; a < n; a++)
      list->part[list->n++] = (Part){(PetscReal)s->gnode[SbSpaceCellNode(s, c, a)], V * phi[a]};
    volume[mesh->cell_body[c]] += V;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, volume, (PetscMPIInt)mesh->nbody, MPIU_REAL, MPI_SUM, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x becomes the nearest place of a body, -1: of any; the distance to it, m. */
static PetscErrorCode move_to_nearest(SbSpace s, PetscInt body, PetscReal x[3], PetscReal *off)
{
  const SbMesh mesh = s->mesh;
  struct {
    double distance;
    int rank;
  } mine = {PETSC_MAX_REAL, s->rank}, best;
  PetscReal L[4], phi[SB_CELL_NODES], at[3], corner[4][3];
  PetscReal *edges = NULL;
  PetscInt n = 0;
  PetscInt *number, *cell, found;
  SbLocator locator;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(mesh->ncell_owned, &number, 4 * (size_t)mesh->ncell_owned, &cell));
  if (mesh->edge_off)
    PetscCall(PetscMalloc1(18 * (size_t)mesh->ncell_owned, &edges));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    if (body >= 0 && mesh->cell_body[c] != body)
      continue;
    PetscCall(PetscArraycpy(cell + 4 * n, mesh->cell + 4 * c, 4));
    if (edges)
      PetscCall(PetscArraycpy(edges + 18 * n, mesh->edge_off + 18 * c, 18));
    number[n++] = c;
  }
  PetscCall(SbLocatorCreate(n, cell, mesh->x, edges, &locator));
  mine.distance = (double)SbLocatorFind(locator, x, &found, L);
  PetscCall(SbLocatorDestroy(&locator));
  PetscCallMPI(MPI_Allreduce(&mine, &best, 1, MPI_DOUBLE_INT, MPI_MINLOC, s->comm));
  if (best.rank == s->rank && found >= 0) {
    (void)SbEffectPoint(s, number[found], L, phi, at, corner);
    PetscCall(PetscArraycpy(x, at, 3));
  }
  PetscCallMPI(MPI_Bcast(x, 3, MPIU_REAL, best.rank, s->comm));
  *off = best.distance;
  PetscCall(PetscFree(edges));
  PetscCall(PetscFree2(number, cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int compare_parts(const void *a, const void *b)
{
  const Part *p = (const Part *)a;
  const Part *q = (const Part *)b;

  return (p->gnode > q->gnode) - (p->gnode < q->gnode);
}

/* The parts of all ranks, one for each node, over the volume. */
static PetscErrorCode merge(SbSpace s, const Parts *list, PetscReal volume, SbMeanPlace *place)
{
  PetscMPIInt mine = (PetscMPIInt)(2 * list->n);
  PetscMPIInt *count, *start;
  PetscInt total = 0;
  Part *all;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(s->size, &count, s->size, &start));
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, count, 1, MPI_INT, s->comm));
  for (PetscMPIInt r = 0; r < s->size; r++) {
    start[r] = (PetscMPIInt)total;
    total += count[r];
  }
  total /= 2;
  PetscCall(PetscMalloc1(total, &all));
  PetscCallMPI(MPI_Allgatherv(list->part, mine, MPIU_REAL, all, count, start, MPIU_REAL, s->comm));
  PetscCall(PetscFree2(count, start));
  qsort(all, (size_t)total, sizeof(*all), compare_parts);
  PetscCall(PetscMalloc2(total, &place->gnode, total, &place->weight));
  place->n = 0;
  for (PetscInt i = 0, k; i < total; i = k) {
    PetscReal sum = 0;

    for (k = i; k < total && all[k].gnode == all[i].gnode; k++)
      sum += all[k].weight / volume;
    if (PetscAbsReal(sum) <= ROUNDING)
      continue;
    place->gnode[place->n] = (PetscInt)all[i].gnode;
    place->weight[place->n++] = sum;
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPlaceFind(SbSpace s, const char *option, PetscInt body, const PetscReal point[3],
                           SbMeanPlace *place)
{
  const SbMesh mesh = s->mesh;
  Parts list = {0};
  PetscReal total = 0;
  PetscReal *volume;

  PetscFunctionBeginUser;
  place->off = 0;
  place->body = -1;
  PetscCall(PetscArraycpy(place->x, point, 3));
  PetscCall(PetscMalloc1(mesh->nbody, &volume));
  for (int again = 0; again < 2 && total == 0; again++) {
    if (again)
      PetscCall(move_to_nearest(s, body, place->x, &place->off));
    PetscCall(gather(s, body, place->x, &list, volume));
    for (PetscInt b = 0; b < mesh->nbody; b++) {
      PetscCheck(volume[b] == 0 || total == 0, s->comm, PETSC_ERR_USER_INPUT,
                 "%s: the point (%g, %g, %g) m is in the bodies %s and %s: name the one that is "
                 "meant, %s:%g,%g,%g",
                 option, (double)point[0], (double)point[1], (double)point[2],
                 mesh->body[place->body].name, mesh->body[b].name, mesh->body[b].name,
                 (double)point[0], (double)point[1], (double)point[2]);
      if (volume[b] == 0)
        continue;
      place->body = b;
      total = volume[b];
    }
  }
  PetscCheck(total > 0, s->comm, PETSC_ERR_USER_INPUT,
             "%s: no tetrahedron holds the point (%g, %g, %g) m", option, (double)point[0],
             (double)point[1], (double)point[2]);
  PetscCall(PetscFree(volume));
  PetscCall(merge(s, &list, total, place));
  PetscCall(PetscFree(list.part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPlaceDestroy(SbMeanPlace *place)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(place->gnode, place->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}
