/*
  group_membership.c - which groups an item belongs to, where a file lists its sets after its elements.
*/
#include <stdlib.h>
#include "meshio_impl.h"

PetscErrorCode SbGroupMembershipAdd(SbGroupMembership *m, PetscInt dim, PetscInt item, PetscInt group)
{
  PetscFunctionBeginUser;
  if (m->n == m->capacity) {
    m->capacity = PetscMax(256, 2 * m->capacity);
    PetscCall(PetscRealloc((size_t)m->capacity * sizeof(*m->row), &m->row));
  }
  m->row[m->n++] = (SbGroupMember){dim, item, group};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGroupMembershipDestroy(SbGroupMembership *m)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(m->row));
  PetscCall(PetscMemzero(m, sizeof(*m)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int compare_members(const void *a, const void *b)
{
  const SbGroupMember *p = (const SbGroupMember *)a, *q = (const SbGroupMember *)b;

  if (p->dim != q->dim) return p->dim < q->dim ? -1 : 1;
  if (p->item != q->item) return p->item < q->item ? -1 : 1;
  return (p->group > q->group) - (p->group < q->group);
}

/* The groups of rows [first, last) join those of their item. */
static PetscErrorCode join(const SbGroupMembership *m, PetscInt first, PetscInt last, PetscInt group[],
                           SbImport *im)
{
  PetscInt *tags = &im->item[m->row[first].dim].tags[m->row[first].item], n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = im->tags_start[*tags]; i < im->tags_start[*tags + 1]; i++) group[n++] = im->tags_group[i];
  for (PetscInt i = first; i < last; i++) group[n++] = m->row[i].group;
  PetscCall(SbImportTagSet(im, n, group, tags));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool same_item(const SbGroupMember *a, const SbGroupMember *b)
{
  return (PetscBool)(a->dim == b->dim && a->item == b->item);
}

PetscErrorCode SbGroupMembershipApply(SbGroupMembership *m, SbImport *im)
{
  PetscInt *group;

  PetscFunctionBeginUser;
  if (m->n) {
    qsort(m->row, (size_t)m->n, sizeof(*m->row), compare_members);
    PetscCall(PetscMalloc1(m->n + im->ngroup, &group));
    for (PetscInt i = 0, j; i < m->n; i = j) {
      for (j = i + 1; j < m->n && same_item(&m->row[i], &m->row[j]);) j++;
      PetscCall(join(m, i, j, group, im));
    }
    PetscCall(PetscFree(group));
  }
  PetscCall(SbGroupMembershipDestroy(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}
