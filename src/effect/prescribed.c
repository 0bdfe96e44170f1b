/*
  prescribed.c - unknowns with a prescribed displacement, and their reaction force.

  The unbalanced force r = M a + C v + f_int - f_ext of a prescribed unknown is what the support must
  exert: the support acts on the body with +r. A body hanging at rest under its weight m g pulls its support
  down; the reaction reported here points up, +m g.
*/
#include "effect_impl.h"

int SbPrescribedComponents(PetscInt choice)
{
  static const int bits[] = {1, 2, 4, 3, 6, 5, 7};

  return bits[choice];
}

PetscErrorCode SbPrescribedSetUp(SbPrescribed *prescribed, SbSpace space, const SbEffectOn *on,
                                 int components)
{
  PetscInt counts[2] = {0, 0}, n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectNodes(space, on, &prescribed->n, &prescribed->node));
  PetscCall(PetscMalloc2(prescribed->n, &prescribed->components, prescribed->n, &prescribed->row));
  // An earlier effect keeps what it has; all ranks see a node with the same bits, so they decide alike.
  for (PetscInt i = 0; i < prescribed->n; i++) {
    const PetscInt node = prescribed->node[i];
    const int free = components & ~(int)space->fixed[node];

    if (!free) continue;
    PetscCall(SbSpacePrescribe(space, node, free));
    prescribed->node[n] = node;
    prescribed->components[n] = (uint8_t)free;
    n++;
    if (node < space->nnode_owned) prescribed->nowned = n;
  }
  prescribed->n = n;
  counts[0] = prescribed->nowned;
  PetscCallMPI(MPI_Allreduce(&counts[0], &counts[1], 1, MPIU_INT, MPI_SUM, space->comm));
  PetscCheck(counts[1], space->comm, PETSC_ERR_USER_INPUT,
             "%s: every displacement of %s is already prescribed by an earlier effect: remove one of the two",
             on->option, on->n == 1 ? on->name[0] : "these sets");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPrescribedSetValues(SbPrescribed *prescribed, SbSpace space, const PetscReal value[])
{
  PetscFunctionBeginUser;
  // Rows exist only after every effect was set up, so they are looked up on first use.
  if (!prescribed->have_rows) {
    for (PetscInt i = 0; i < prescribed->n; i++) {
      PetscCall(PetscFindInt(prescribed->node[i], space->nfixed, space->fixed_node, &prescribed->row[i]));
      PetscCheck(prescribed->row[i] >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "Node %" PetscInt_FMT " is not marked as prescribed", prescribed->node[i]);
    }
    prescribed->have_rows = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < prescribed->n; i++) {
    for (int c = 0; c < 3; c++) {
      if (prescribed->components[i] & (1 << c))
        space->fixed_value[3 * prescribed->row[i] + c] = value ? value[3 * i + c] : 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbPrescribedReaction(const SbPrescribed *prescribed, const PetscReal residual[], PetscReal force[3])
{
  for (int c = 0; c < 3; c++) force[c] = 0;
  for (PetscInt i = 0; i < prescribed->nowned; i++) {
    for (int c = 0; c < 3; c++) {
      if (prescribed->components[i] & (1 << c)) force[c] += residual[3 * prescribed->node[i] + c];
    }
  }
}

PetscErrorCode SbPrescribedFree(SbPrescribed *prescribed)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(prescribed->node));
  PetscCall(PetscFree2(prescribed->components, prescribed->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}
