/*
  Which integrators and solvers go with contact: errors, before anything is computed.

  Barrier contact needs Newton's method with its potential, and is alone. Other contact needs
  several solves in a step and, where it constrains nodes, a matrix that can be projected.
*/
#include "sbsolver.h"
#include "time_impl.h"

/* implicit: an integrator of second_order.c, or static; matrix: the solver has the complete one. */
static PetscErrorCode check_barrier(SbRun run, PetscBool implicit, PetscBool matrix)
{
  const SbModel m = run->model;
  const char *name = m->contacts.potential[0]->effect->name;

  PetscFunctionBeginUser;
  PetscCheck(implicit, m->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_response barrier needs -time euler_implicit, newmark, genalpha or static",
             name);
  PetscCheck(run->solve.preset == SB_TIME_EULER_IMPLICIT || !m->dynamic ||
               !m->space->consistent_mass,
             m->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_response barrier with -time newmark or genalpha needs -mass lumped", name);
  PetscCheck(!m->contacts.nactive_set, m->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_response barrier and -effect_%s_response of another kind do not go "
             "together: give both the same",
             name, m->contacts.active_set[0]->effect->name);
  PetscCheck(matrix, m->comm, PETSC_ERR_USER_INPUT,
             "-solver %s has no complete matrix, to which the effect %s could add: use -solver "
             "auto or cg_two_level",
             run->solve.solver, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_active_set(SbRun run, PetscBool implicit, PetscBool matrix)
{
  const SbModel m = run->model;
  const char *name = m->contacts.active_set[0]->effect->name;
  const char *early = m->contacts.ends_step ? m->contacts.ends_step->effect->name : "";

  PetscFunctionBeginUser;
  PetscCheck(implicit, m->comm, PETSC_ERR_USER_INPUT,
             "The effect %s needs several solves in a step: use -time euler_implicit, newmark, "
             "genalpha or static",
             name);
  if (run->solve.preset == SB_TIME_NEWMARK) {
    /* its contact needs the trapezoidal rule, the lumped mass, and forces on constrained nodes
       only */
    PetscCheck(run->solve.newmark[0] == 0.25 && run->solve.newmark[1] == 0.5, m->comm,
               PETSC_ERR_USER_INPUT,
               "-time newmark with the effect %s needs -time_newmark_beta 0.25 and "
               "-time_newmark_gamma 0.5, not %g and %g: else impacts may gain energy",
               name, (double)run->solve.newmark[0], (double)run->solve.newmark[1]);
    PetscCheck(!m->space->consistent_mass, m->comm, PETSC_ERR_USER_INPUT,
               "-time newmark with the effect %s needs -mass lumped: velocities of contact are "
               "corrected node by node",
               name);
    for (PetscInt e = 0; e < m->contacts.nactive_set; e++)
      PetscCheck(!m->contacts.active_set[e]->springs, m->comm, PETSC_ERR_USER_INPUT,
                 "-time newmark gains energy by springs and friction of the effect %s: give "
                 "-effect_%s_response projected or multiplier and no friction, or use "
                 "euler_implicit or genalpha",
                 m->contacts.active_set[e]->effect->name, m->contacts.active_set[e]->effect->name);
  }
  PetscCheck(m->dynamic || !m->contacts.ends_step, m->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_time_of_impact yes is about the length of time steps, and -time static "
             "has none: leave it out",
             early);
  PetscCheck(
    run->solve.preset != SB_TIME_GENALPHA || !m->contacts.ends_step, m->comm, PETSC_ERR_USER_INPUT,
    "-time genalpha gains energy with -effect_%s_time_of_impact yes: it takes the acceleration of "
    "a short step, in which nodes are stopped, into a long one; use euler_implicit",
    early);
  PetscCheck(matrix || (!run->solve.solver_used->matrix_free && !m->contacts.nconstraint), m->comm,
             PETSC_ERR_USER_INPUT,
             "-solver %s has no complete matrix, in which the effect %s could constrain nodes: use "
             "-solver rotated or cg_two_level",
             run->solve.solver, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -contact_quality fast */
static PetscErrorCode check_fast(SbRun run)
{
  const SbContactSet *c = &run->model->contacts;
  const char *why = NULL;

  PetscFunctionBeginUser;
  if (!c->n)
    why = "no effect here is of type contact";
  else if (c->npotential < c->n)
    why = "an effect here has another response";
  else if (c->nrigid)
    why = "the response of an effect here has multipliers";
  else if (c->nrestitution)
    why = "an effect here has restitution";
  else if (run->model->space->rigid)
    why = "a body here is rigid, whose spin it does not follow";
  else if (run->solve.preset != SB_TIME_EULER_IMPLICIT)
    why = "the integrator here is another one";
  PetscCheck(!why, run->model->comm, PETSC_ERR_USER_INPUT,
             "-contact_quality fast is for contact with response barrier, without restitution, and "
             "-time euler_implicit: %s",
             why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunCheckContact(SbRun run)
{
  const SbModel m = run->model;
  const PetscBool implicit =
    (PetscBool)(!SbRunIsExplicit(run) && run->solve.preset != SB_TIME_ALPHA2);
  const PetscBool matrix =
    (PetscBool)(!run->solve.solver_used->matrix_free && strcmp(run->solve.solver, "pressure"));

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->contacts.n; k++)
    PetscCheck(
      m->contacts.contact[k]->restitution <= 0. || run->solve.preset == SB_TIME_EULER_IMPLICIT,
      m->comm, PETSC_ERR_USER_INPUT,
      "-effect_%s_restitution needs -time euler_implicit, whose velocities are those of a step",
      m->contacts.contact[k]->effect->name);
  if (run->solve.fast)
    PetscCall(check_fast(run));
  if (m->contacts.npotential)
    PetscCall(check_barrier(run, implicit, matrix));
  if (m->contacts.nactive_set)
    PetscCall(check_active_set(run, implicit, matrix));
  PetscFunctionReturn(PETSC_SUCCESS);
}
