/*
  hold.c - unknowns with a prescribed displacement, and the force that keeps them there.

  The unbalanced force r = M a + C v + f_int - f_ext of a prescribed unknown is what the support must push
  with: the support acts on the body with +r. A body hanging at rest under its weight m g pulls its support
  down; the reaction reported here points up, +m g.
*/
#include "sbeffect.h"

int SbHoldComponents(PetscInt choice)
{
  static const int bits[] = {1, 2, 4, 3, 6, 5, 7};

  return bits[choice];
}

PetscErrorCode SbHoldSetUp(SbHold *hold, SbSpace space, const SbEffectOn *on, int components)
{
  PetscInt counts[2] = {0, 0}, n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectNodes(space, on, &hold->n, &hold->node));
  PetscCall(PetscMalloc2(hold->n, &hold->components, hold->n, &hold->row));
  // An earlier effect keeps what it has; all ranks see a node with the same bits, so they decide alike.
  for (PetscInt i = 0; i < hold->n; i++) {
    const PetscInt node = hold->node[i];
    const int free = components & ~(int)space->fixed[node];

    if (!free) continue;
    PetscCall(SbSpaceFix(space, node, free));
    hold->node[n] = node;
    hold->components[n] = (uint8_t)free;
    n++;
    if (node < space->nnode_owned) hold->nowned = n;
  }
  hold->n = n;
  counts[0] = hold->nowned;
  PetscCallMPI(MPI_Allreduce(&counts[0], &counts[1], 1, MPIU_INT, MPI_SUM, space->comm));
  PetscCheck(counts[1], space->comm, PETSC_ERR_USER_INPUT,
             "%s: every displacement of %s is already prescribed by an earlier effect: remove one of the two",
             on->option, on->n == 1 ? on->name[0] : "these sets");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbHoldPrescribe(SbHold *hold, SbSpace space, const PetscReal value[])
{
  PetscFunctionBeginUser;
  // Rows exist only after every effect was set up, so they are looked up on first use.
  if (!hold->have_rows) {
    for (PetscInt i = 0; i < hold->n; i++) {
      hold->row[i] = SbSpaceFixedIndex(space, hold->node[i]);
      PetscCheck(hold->row[i] >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "Node %" PetscInt_FMT " is not marked as prescribed", hold->node[i]);
    }
    hold->have_rows = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < hold->n; i++) {
    for (int c = 0; c < 3; c++) {
      if (hold->components[i] & (1 << c))
        space->fixed_value[3 * hold->row[i] + c] = value ? value[3 * i + c] : 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbHoldReaction(const SbHold *hold, const PetscReal residual[], PetscReal force[3])
{
  for (int c = 0; c < 3; c++) force[c] = 0;
  for (PetscInt i = 0; i < hold->nowned; i++) {
    for (int c = 0; c < 3; c++) {
      if (hold->components[i] & (1 << c)) force[c] += residual[3 * hold->node[i] + c];
    }
  }
}

PetscErrorCode SbHoldFree(SbHold *hold)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(hold->node));
  PetscCall(PetscFree2(hold->components, hold->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}
