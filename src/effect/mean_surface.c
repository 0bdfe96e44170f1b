/*
  mean_surface.c - a continuous surface of CR and DG bodies, whose own facets do not meet at their
  edges.

  A vertex has the mean displacement of the cells behind the facets around it, as in contact
  (src/contact/contact_surface.c): the surface is closed, linear fields are reproduced, and it
  stretches and turns like the wall itself, while a facet of CR moves with the centre of its cell, a
  quarter of the cell's height behind the wall. Forces on vertices act on nodes by the transpose:
  their sum and moment stay.

  Where a support prescribes the normal displacement of a facet only, as in a plane of symmetry, the
  vertices of the facet follow its nodes in that direction: as if the body went on behind the plane.

  The owner of a vertex has all facets around it, moves it and sums its forces; other ranks get them
  from it.
*/
#include "mean_surface.h"
#include "sbkernel.h"

#define ALONG 1e-6 /* component of a unit normal that counts as none */

/* Components that the plane of a support prescribes at facet i; 0: there is no such plane. */
static int plane_of(const SbMeanSurface *m, PetscInt i)
{
  const int fixed = m->space->fixed[m->node[i]];

  return fixed != 7 && SbMeanSurfaceHeld(m, i) ? fixed : 0;
}

PetscBool SbMeanSurfaceHeld(const SbMeanSurface *m, PetscInt i)
{
  const int fixed = m->space->fixed[m->node[i]];

  for (int c = 0; c < 3; c++)
    if (!(fixed >> c & 1) && PetscAbsReal(m->facet[i].normal[c]) > ALONG)
      return PETSC_FALSE;
  return PETSC_TRUE;
}

PetscErrorCode SbMeanSurfaceCreate(SbSpace space, const PetscBool in[], SbMeanSurface **surface)
{
  const SbMesh mesh = space->mesh;
  PetscInt n = 0;
  SbMeanSurface *m;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&m));
  *surface = m;
  m->space = space;
  PetscCall(SbSpaceGetSetFacets(space, -1, &m->nfacet, &m->facet));
  for (PetscInt i = 0; i < m->nfacet; i++)
    if (in[mesh->cell_body[m->facet[i].cell]])
      m->facet[n++] = m->facet[i];
  m->nfacet = n;
  PetscCall(PetscMalloc1(n, &m->node));
  PetscCall(PetscCalloc1(3 * (size_t)mesh->nvert, &m->part));
  PetscCall(PetscCalloc1(mesh->nvert, &m->plane));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt k = 4 * m->facet[i].cell + m->facet[i].face;
    const PetscBool weak = (PetscBool)(space->dirichlet_node && space->dirichlet_node[k] >= 0);

    m->node[i] = weak ? space->dirichlet_node[k] : space->cell_node[k];
    for (int a = 0; a < 3; a++)
      m->plane[m->facet[i].vertex[a]] |= (uint8_t)plane_of(m, i);
  }

  /* numbers of facets that contribute to each component, as the owner of the vertex knows them */
  for (PetscInt i = 0; i < n; i++) {
    for (int a = 0; a < 3; a++) {
      const PetscInt v = m->facet[i].vertex[a];

      for (int c = 0; c < 3; c++)
        m->part[3 * v + c] += !(m->plane[v] >> c & 1) || plane_of(m, i) >> c & 1 ? 1. : 0.;
    }
  }
  for (PetscInt k = 0; k < 3 * mesh->nvert_owned; k++)
    m->part[k] = m->part[k] > 0. ? 1. / m->part[k] : 0.;
  PetscCall(SbForestBroadcast(mesh->vert_sf, 1, MPI_UINT8_T, m->plane, m->plane));
  PetscCall(SbForestBroadcast(mesh->vert_sf, 3, MPIU_REAL, m->part, m->part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeanSurfaceMove(const SbMeanSurface *m, PetscBool rate, const PetscReal u[],
                                 PetscReal y[])
{
  const SbMesh mesh = m->space->mesh;

  PetscFunctionBeginUser;
  if (rate)
    PetscCall(PetscArrayzero(y, 3 * mesh->nvert));
  else
    PetscCall(PetscArraycpy(y, mesh->x, 3 * mesh->nvert));
  for (PetscInt i = 0; i < m->nfacet && u; i++) {
    const SbFacet *facet = &m->facet[i];
    const SbElement e = SbSpaceCellElement(m->space, facet->cell);
    const PetscInt *node = m->space->cell_node + 4 * facet->cell;

    for (int k = 0; k < 3; k++) {
      const PetscInt v = facet->vertex[k];

      if (v >= mesh->nvert_owned)
        continue;
      for (int c = 0; c < 3; c++) {
        PetscReal sum = 0.;

        if (m->plane[v] >> c & 1)
          sum = plane_of(m, i) >> c & 1 ? u[3 * m->node[i] + c] : 0.;
        else
          for (int a = 0; a < 4; a++)
            sum += e->ops.vertex[facet->corner[k]][a] * u[3 * node[a] + c];
        y[3 * v + c] += m->part[3 * v + c] * sum;
      }
    }
  }
  PetscCall(SbForestBroadcast(mesh->vert_sf, 3, MPIU_REAL, y, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeanSurfaceForces(const SbMeanSurface *m, PetscReal g[], PetscReal f[])
{
  PetscFunctionBeginUser;
  PetscCall(SbForestBroadcast(m->space->mesh->vert_sf, 3, MPIU_REAL, g, g));
  for (PetscInt i = 0; i < m->nfacet; i++) {
    const SbFacet *facet = &m->facet[i];
    const SbElement e = SbSpaceCellElement(m->space, facet->cell);
    const PetscInt *node = m->space->cell_node + 4 * facet->cell;

    for (int k = 0; k < 3; k++) {
      const PetscInt v = facet->vertex[k];

      for (int c = 0; c < 3; c++) {
        const PetscReal force = m->part[3 * v + c] * g[3 * v + c];

        if (!(m->plane[v] >> c & 1))
          for (int a = 0; a < 4; a++)
            f[3 * node[a] + c] += e->ops.vertex[facet->corner[k]][a] * force;
        else if (plane_of(m, i) >> c & 1)
          f[3 * m->node[i] + c] += force;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeanSurfaceDestroy(SbMeanSurface **surface)
{
  SbMeanSurface *m = *surface;

  PetscFunctionBeginUser;
  if (!m)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(m->facet));
  PetscCall(PetscFree(m->node));
  PetscCall(PetscFree(m->part));
  PetscCall(PetscFree(m->plane));
  PetscCall(PetscFree(*surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}
