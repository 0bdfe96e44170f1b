/*
  exact_pairs.c - the responses `projected` and `multiplier` of pairs: their constraints as rows of
  the linear systems of Newton's method (src/solver/contact_constraints.c).

  In the matrix a pair has the stiffness of the response `augmented`, the rest is in its row
  (SbPairMatrixLaw).
*/
#include "barrier.h"

PetscErrorCode SbContactConstraints_Pairs(SbContact contact, SbSpace s, const PetscReal u[],
                                          SbConstraintRows *rows)
{
  Barrier *b = (Barrier *)contact;
  const SbContactSurface m = b->surface;

  PetscFunctionBeginUser;
  (void)s;
  if (!contact->exact)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, u));
  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    const SbPairLaw law = SbPairLawOf(b, a);
    PetscInt most = 0;
    PetscBool row;
    const SbPairLaw matrix = SbPairMatrixLaw(b, a, &row);

    if (!row || !counts(b, &a->pair))
      continue;
    for (int k = 0; k < 4; k++)
      if (a->pair.v[k] < m->nbody_vertex)
        most += 3 * (m->start[a->pair.v[k] + 1] - m->start[a->pair.v[k]]);
    PetscCall(SbConstraintRowsReserve(rows, 1, most));

    /* the derivative of the gap by the free components of nodes */
    for (int k = 0; k < (a->pair.side ? 1 : 4); k++) {
      const PetscInt v = a->pair.v[k];

      for (PetscInt j = v < m->nbody_vertex ? m->start[v] : 0;
           v < m->nbody_vertex && j < m->start[v + 1]; j++) {
        for (int c = 0; c < 3; c++) {
          if (m->fixed[j] >> c & 1)
            continue;
          rows->column[rows->nentry] = 3 * m->gnode[j] + c;
          rows->value[rows->nentry++] = m->weight[j] * a->at.weight[k] * a->at.n[c];
        }
      }
    }
    rows->goal[rows->n] = a->gap - law.width;
    rows->soft[rows->n] = matrix.stiffness * a->pair.area;
    rows->stiffness[rows->n] = (law.stiffness - matrix.stiffness) * a->pair.area;
    rows->start[++rows->n] = rows->nentry;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
