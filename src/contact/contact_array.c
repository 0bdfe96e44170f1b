/*
  contact_array.c - the arrays of a surface, which grow as a rank meets features of other ranks, and
  those by vertex that grow with it (positions, directions).
*/
#include "pairs.h"

PetscErrorCode SbContactSurfaceRoom(SbContactSurface m, PetscInt nvertex, PetscInt nentry,
                                    PetscInt ntriangle, PetscInt nedge)
{
  const PetscInt need[] = {nvertex, nentry, ntriangle, nedge};
  const struct {
    int of;
    size_t unit;
    void *array;
  } table[] = {
    {0, sizeof(*m->start), &m->start},
    {0, sizeof(*m->part), &m->part},
    {0, sizeof(*m->number), &m->number},
    {0, sizeof(*m->remote), &m->remote},
    {0, sizeof(*m->mine), &m->mine},
    {0, sizeof(*m->own), &m->own},
    {0, sizeof(*m->driven), &m->driven},
    {0, 3 * sizeof(*m->X), &m->X},
    {0, sizeof(*m->area), &m->area},
    {1, sizeof(*m->gnode), &m->gnode},
    {1, sizeof(*m->node), &m->node},
    {1, sizeof(*m->column), &m->column},
    {1, sizeof(*m->weight), &m->weight},
    {1, sizeof(*m->fixed), &m->fixed},
    {2, 3 * sizeof(*m->triangle), &m->triangle},
    {2, sizeof(*m->triangle_number), &m->triangle_number},
    {2, 6 * sizeof(*m->share), &m->share},
    {3, 2 * sizeof(*m->edge), &m->edge},
    {3, sizeof(*m->edge_number), &m->edge_number},
    {3, sizeof(*m->edge_area), &m->edge_area},
    {3, 2 * sizeof(*m->edge_share), &m->edge_share},
  };

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    if (need[k] < m->room[k])
      continue;
    m->room[k] = need[k] + m->room[k] / 2 + 1;
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(table); i++)
      if (table[i].of == k)
        PetscCall(PetscRealloc((size_t)m->room[k] * table[i].unit, table[i].array));
    for (int i = 0; i < m->narray && k == 0; i++)
      PetscCall(PetscRealloc(3 * (size_t)m->room[0] * sizeof(PetscReal), m->array[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceCreateArray(SbContactSurface m, PetscReal **x)
{
  PetscFunctionBeginUser;
  PetscCheck(m->narray < SB_CONTACT_ARRAYS, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "More than %d arrays of a surface", SB_CONTACT_ARRAYS);
  PetscCall(PetscCalloc1(3 * PetscMax(m->room[0], m->nvertex), x));
  m->array[m->narray++] = x;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceDestroyArray(SbContactSurface m, PetscReal **x)
{
  int n = 0;

  PetscFunctionBeginUser;
  for (int i = 0; i < m->narray; i++)
    if (m->array[i] != x)
      m->array[n++] = m->array[i];
  m->narray = n;
  PetscCall(PetscFree(*x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceFindNodes(SbContactSurface m, PetscInt v)
{
  const SbSpace s = m->space;

  PetscFunctionBeginUser;
  m->mine[v] = m->own[v];
  for (PetscInt e = m->start[v]; e < m->start[v + 1]; e++) {
    const PetscInt node = m->gnode[e] - s->gnode_start;

    if (node >= 0 && node < s->nnode_owned) {
      m->node[e] = node;
      m->mine[v] = 1;
      continue;
    }
    PetscCall(PetscFindInt(m->gnode[e], s->nnode_cell - s->nnode_owned, s->gnode + s->nnode_owned,
                           &m->node[e]));
    m->node[e] = m->node[e] < 0 ? -1 : s->nnode_owned + m->node[e];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
