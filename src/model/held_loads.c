/*
  held_loads.c - loads that act on held nodes alone: they move and strain nothing, which is mostly a
  set named by mistake. Asked of loads on places that a scene names; weight of a body that is held
  all over, and springs that measure a force, are common.
*/
#include "model_impl.h"

/* A part of a force that is rounding: facets of a wall that is held in one direction push along it,
   too, by what rounding turns their normals. */
#define ROUNDING 1e-12

static PetscBool is_aimed(SbEffect e)
{
  static const char *const types[] = {"traction", "pressure", "point_force", "torque"};
  PetscBool found = PETSC_FALSE;

  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(types); k++)
    found = (PetscBool)(found || !strcmp(e->type, types[k]));
  return found;
}

PetscErrorCode SbModelWarnHeldLoads(SbModel m, PetscReal t, Vec U, Vec V)
{
  const SbSpace s = m->space;
  SbEvaluation e = {.U = U, .V = V};
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * s->nnode, &f));
  PetscCall(SbEvaluationBegin(m, t, &e));
  for (PetscInt k = 0; k < m->nforce; k++) {
    const SbEffect load = m->force[k];
    PetscReal size[2] = {0., 0.}; // sums of |f| of all and of free unknowns

    if (!is_aimed(load) || !SbEffectActs(load, t))
      continue;
    PetscCall(PetscArrayzero(f, 3 * s->nnode));
    SbEffectCall(load, force, s, &e.stage, f);
    for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
      size[0] += PetscAbsReal(f[i]);
      size[1] += s->fixed[i / 3] & (1 << (i % 3)) ? 0. : PetscAbsReal(f[i]);
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, size, 2, MPIU_REAL, MPI_SUM, m->comm));
    if (size[0] > 0. && size[1] <= ROUNDING * size[0])
      PetscCall(
        SbWarning(m->comm,
                  "effect %s of type %s acts at the end on held nodes alone: there it moves "
                  "and strains nothing, and shows in the reactions only. If that is not "
                  "meant, name other nodes or facets for it, or for what holds them",
                  load->name, load->type));
  }
  PetscCall(SbEvaluationEnd(m, &e));
  PetscCall(PetscFree(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
