/*
  exact_pairs.c - the responses `projected` and `multiplier` of pairs: their constraints as rows of
  the linear systems of Newton's method (src/solver/contact_constraints.c).

  In the matrix a pair has the stiffness of the response `augmented`, the rest is in its row
  (SbPairMatrixLaw).
*/
#include "surfaces.h"

/* Adds the row of the derivative of `direction` . sum weight x by the free components of nodes. */
static PetscErrorCode add_row(const Surfaces *b, const Active *a, const PetscReal direction[3],
                              PetscReal goal, PetscReal soft, PetscReal stiffness,
                              SbConstraintRows *rows)
{
  const SbContactSurface m = b->surface;
  PetscInt most = 0;

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++)
    if (a->pair.v[k] < m->nbody_vertex)
      most += 3 * (m->start[a->pair.v[k] + 1] - m->start[a->pair.v[k]]);
  PetscCall(SbConstraintRowsReserve(rows, 1, most));
  for (int k = 0; k < (a->pair.side ? 1 : 4); k++) {
    const PetscInt v = a->pair.v[k];

    for (PetscInt j = v < m->nbody_vertex ? m->start[v] : 0;
         v < m->nbody_vertex && j < m->start[v + 1]; j++) {
      for (int c = 0; c < 3; c++) {
        if (m->fixed[j] >> c & 1)
          continue;
        rows->column[rows->nentry] = 3 * m->gnode[j] + c;
        rows->value[rows->nentry++] = m->weight[j] * a->at.weight[k] * direction[c];
      }
    }
  }
  rows->goal[rows->n] = goal;
  rows->soft[rows->n] = soft;
  rows->stiffness[rows->n] = stiffness;
  rows->start[++rows->n] = rows->nentry;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two unit vectors across n. */
static void find_tangents(const PetscReal n[3], PetscReal t[2][3])
{
  PetscReal axis[3] = {0.};

  axis[PetscAbsReal(n[0]) < 0.6 ? 0 : 1] = 1.;
  SbCross(n, axis, t[0]);
  (void)SbNormalise(t[0]);
  SbCross(n, t[0], t[1]);
}

/* Whether some pair sticks where surfaces were last. Collective. */
static PetscErrorCode some_stick(const Surfaces *b, MPI_Comm comm, PetscBool *some)
{
  PetscBool mine = PETSC_FALSE;
  PetscReal q[3];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < b->friction.pairs.n && b->motion.begun; i++) {
    const FrictionPair *friction = &b->friction.pairs.pair[i];

    mine = (PetscBool)(mine || SbFrictionSticks(b, friction, SbPairSticking(b, friction, q)));
  }
  PetscCallMPI(MPI_Allreduce(&mine, some, 1, SB_MPI_BOOL, MPI_LOR, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Normals of pairs that press at u, and their tangents unless all slid at the iterate before. */
PetscErrorCode SbContactHolding_Pairs(SbContact contact, SbSpace s, const PetscReal u[],
                                      SbConstraintRows *rows)
{
  Surfaces *b = (Surfaces *)contact;
  PetscBool sticks;

  PetscFunctionBeginUser;
  PetscCall(some_stick(b, s->comm, &sticks));
  PetscCall(SbSurfacesUpdate(b, u));
  for (PetscInt i = 0; i < b->active.n && b->motion.begun; i++) {
    const Active *a = &b->active.pair[i];
    const SbPairLaw law = SbPairLawOf(b, a);
    PetscReal d[3], t[2][3];

    SbPairLawEvaluate(&law, a->gap, a->pair.area, d);
    if (d[1] >= 0. || !counts(b, &a->pair))
      continue;
    PetscCall(add_row(b, a, a->at.n, 0., 1., 1., rows));
    find_tangents(a->at.n, t);
    for (int k = 0; k < 2 && sticks; k++)
      PetscCall(add_row(b, a, t[k], 0., 1., 1., rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactConstraints_Pairs(SbContact contact, SbSpace s, const PetscReal u[],
                                          SbConstraintRows *rows)
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  (void)s;
  if (!contact->exact)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSurfacesUpdate(b, u));

  /* gaps */
  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    const SbPairLaw law = SbPairLawOf(b, a);
    PetscBool row;
    const SbPairLaw matrix = SbPairMatrixLaw(b, a, &row);
    const PetscReal area = a->pair.area;

    if (row && counts(b, &a->pair))
      PetscCall(add_row(b, a, a->at.n, a->gap - law.width, matrix.stiffness * area,
                        (law.stiffness - matrix.stiffness) * area, rows));
  }

  /* slip of pairs that stick */
  for (PetscInt i = 0; i < b->friction.pairs.n; i++) {
    const FrictionPair *friction = &b->friction.pairs.pair[i];
    const PetscReal soft = friction->stiffness / STIFFER;
    PetscReal q[3], slip[3], t[2][3];

    if (!counts(b, &friction->on.pair) ||
        !SbFrictionSticks(b, friction, SbPairSticking(b, friction, q)))
      continue;
    (void)SbPairSlip(b, friction, slip);
    find_tangents(friction->on.at.n, t);
    for (int k = 0; k < 2; k++)
      PetscCall(add_row(b, &friction->on, t[k], SbDot3(slip, t[k]), soft,
                        friction->stiffness - soft, rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
